//! A sky that changes as time goes on, and how the language says it.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::said::number;
use super::source::Mark;
use super::weather::{Weather, levels};

/// A sky changes at multiples of this, s: so that the steps of a space are no shorter.
const CHANGES_S: f64 = 0.1;

/// A weather that comes at a time.
#[derive(Debug, Clone)]
pub struct Change {
    pub mark: Mark,
    pub at_s: f64,
    pub weather: Weather,
}

/// The weather from the beginning on, and the whole of it after each change, with the tenths of a second at which that comes.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Sky {
    pub begins: Weather,
    changes: Vec<(u64, Weather)>,
}

impl Sky {
    /// `changes` stand in the order of the file.
    pub fn of(begins: Weather, changes: &[Change]) -> Sky {
        let mut changes: Vec<&Change> = changes.iter().collect();
        changes.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        let mut sky = Sky { begins, changes: Vec::new() };
        for change in changes {
            let at = (change.at_s / CHANGES_S).round() as u64;
            let last = sky.changes.last().map_or(&sky.begins, |(_, weather)| weather).clone();
            let then = last.clone().then(change.weather.clone());
            match sky.changes.last_mut() {
                _ if at == 0 => sky.begins = then,
                // It stays as it is.
                _ if shown(&then) == shown(&last) => {}
                Some((known, weather)) if *known == at => *weather = then,
                _ => sky.changes.push((at, then)),
            }
        }
        sky
    }

    pub fn changes(&self) -> bool {
        !self.changes.is_empty()
    }

    /// Whether a time is one at which a sky can change.
    pub fn can_change_at(at_s: f64) -> bool {
        ((at_s / CHANGES_S).round() * CHANGES_S - at_s).abs() < 1e-6
    }

    /// The longest step at whose beginnings all changes come, s; `None` if there are none.
    pub fn step_s(&self) -> Option<f64> {
        let common = self.changes.iter().fold(0, |common, (at, _)| gcd(common, *at));
        (common > 0).then(|| (common as f64 * CHANGES_S * 50.0).round() / 50.0)
    }

    fn all(&self) -> impl Iterator<Item = &Weather> {
        core::iter::once(&self.begins).chain(self.changes.iter().map(|(_, weather)| weather))
    }

    /// Effects of each step that let it change.
    pub fn each_step(&self) -> String {
        if !self.changes() {
            return String::new();
        }
        let mut text = self.effect("time", &|weather| shown(weather).0);
        for (at, key) in ["Rain", "Fog", "Wetness"].into_iter().enumerate() {
            text += &self.effect(&format!("sky[{key}]"), &|weather| shown(weather).1[at]);
        }
        format!("each step {{\n{text}}}\n")
    }

    /// The effect that gives a state the value that it has by then; empty if it never has another.
    fn effect(&self, state: &str, value: &dyn Fn(&Weather) -> &'static str) -> String {
        let first = value(&self.begins);
        let (mut text, mut last) = (first.to_owned(), first);
        for (at, weather) in &self.changes {
            let now = value(weather);
            if now != last {
                let at_s = number(*at as f64 * CHANGES_S);
                text = format!("match elapsed >= {at_s} s {{ true => {now}, false => {text} }}");
                last = now;
            }
        }
        if text == first { String::new() } else { format!("  set {state} = {text}\n") }
    }

    /// The effects that set it as it begins, if another variation begins otherwise.
    pub fn set(&self, all: &BTreeSet<&Sky>) -> String {
        let (begins, mut text) = (&self.begins, String::new());
        if all.iter().any(|other| other.begins.time != begins.time) {
            let _ = writeln!(text, "  set time = {}", begins.time.unwrap_or("Noon"));
        }
        if all.iter().any(|other| levels(&other.begins) != levels(begins)) {
            let [rain, fog, wetness] = levels(begins);
            let _ = writeln!(
                text,
                "  set sky[Rain] = {rain}\n  set sky[Fog] = {fog}\n  set sky[Wetness] = {wetness}"
            );
        }
        text
    }
}

/// The time of day, and the levels of rain, fog and wetness, also where the file says none.
fn shown(weather: &Weather) -> (&'static str, [&'static str; 3]) {
    (weather.time.unwrap_or("Noon"), levels(weather))
}

/// The states of time and weather, as they are when the first variation begins; those of all variations have words.
pub fn states(begins: &Weather, all: &BTreeSet<&Sky>) -> String {
    let mut text = String::new();
    let weathers: BTreeSet<&Weather> = all.iter().flat_map(|sky| sky.all()).collect();
    let times: BTreeSet<&str> = weathers.iter().filter_map(|weather| weather.time).collect();
    if !times.is_empty() {
        let more: String = ["Dawn", "Dusk"]
            .iter()
            .filter(|time| times.contains(*time))
            .map(|time| format!(" | {time}"))
            .collect();
        let _ = write!(
            text,
            "enum Time = Morning | Noon | Night{more}\nstate time: Time = {}\n\n",
            begins.time.unwrap_or("Noon")
        );
    }
    if weathers.iter().any(|weather| weather.is_rough()) {
        text += "enum Sky = Rain | Fog | Wetness\nenum Level = None < Light < Moderate < High\n";
        let [rain, fog, wetness] = levels(begins);
        let _ =
            writeln!(text, "state sky: Sky -> Level = {{ Rain: {rain}, Fog: {fog}, Wetness: {wetness} }}\n");
    }
    text
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weather(time: Option<&'static str>, fog: Option<&'static str>) -> Weather {
        Weather { time, sky: [None, fog, None] }
    }

    fn change(at_s: f64, weather: Weather) -> Change {
        Change { mark: Mark { line: 1, element: String::new(), at: 0 }, at_s, weather }
    }

    #[test]
    fn changes_add_up_in_the_order_of_their_times() {
        let night = change(4.0, weather(Some("Night"), None));
        let fog = change(1.0, weather(None, Some("High")));
        let sky = Sky::of(Weather::default(), &[night, fog, change(10.0, weather(None, Some("None")))]);
        assert_eq!(sky.step_s(), Some(1.0));
        let time = "  set time = match elapsed >= 4 s { true => Night, false => Noon }\n";
        let fog = "  set sky[Fog] = match elapsed >= 10 s { true => None, false => match elapsed >= 1 s { true => High, false => None } }\n";
        assert_eq!(sky.each_step(), format!("each step {{\n{time}{fog}}}\n"));
        assert_eq!(states(&sky.begins, &[&sky].into()).lines().count(), 7);
    }

    #[test]
    fn what_comes_at_once_is_how_it_begins() {
        let sky = Sky::of(Weather::default(), &[change(0.0, weather(Some("Night"), None))]);
        assert!(!sky.changes() && sky.begins.time == Some("Night"));
        assert_eq!((sky.step_s(), sky.each_step()), (None, String::new()));
        let same = Sky::of(sky.begins, &[change(3.0, weather(Some("Night"), Some("None")))]);
        assert!(!same.changes(), "what stays as it is does not change");
        assert!(Sky::can_change_at(0.3) && !Sky::can_change_at(0.25));
    }
}
