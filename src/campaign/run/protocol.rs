//! What came of each action that was carried out, with its values: the table of a protocol, and heat maps by two parameters.

use std::collections::{BTreeMap, BTreeSet};

use crate::run::database::Database;
use crate::run::sealed::{DatabaseError, query_all};

/// Below this time to collision or post-encroachment time a drive without a contact is a near miss, s: the threshold of traffic
/// conflicts (Hydén 1987; the default of FHWA's SSAM, 2008).
pub const NEAR_S: f64 = 1.5;

/// A contact is mitigated if the ego vehicle was slower by this than before, m/s: 5 km/h, a step of Euro NCAP's speeds.
pub const MITIGATED_MPS: f64 = 5.0 / 3.6;

/// Values of one axis beyond which numbers are put into as many ranges.
const AXIS_MAX: usize = 12;

/// How an action ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// Without a contact, and never near one.
    Avoided,
    /// Without a contact, but with less than [`NEAR_S`] to it.
    Near,
    /// With a contact, at a speed that was less than before by at least [`MITIGATED_MPS`].
    Mitigated,
    /// With a contact at nearly the speed before.
    Hit,
}

impl Ending {
    pub const ALL: [Ending; 4] = [Ending::Avoided, Ending::Near, Ending::Mitigated, Ending::Hit];

    pub fn in_words(self) -> &'static str {
        match self {
            Ending::Avoided => "avoided",
            Ending::Near => "near miss",
            Ending::Mitigated => "mitigated",
            Ending::Hit => "hit",
        }
    }
}

/// An action that was carried out, or an episode in which none was.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Trial {
    pub episode: i64,
    pub road: String,
    /// The action's name; `None` if none was carried out in the episode.
    pub action: Option<String>,
    /// Its values, as the language writes them.
    pub values: Vec<(String, String)>,
    pub ending: Option<Ending>,
    /// The ego vehicle's greatest speed before the first contact, m/s.
    pub before_mps: Option<f64>,
    /// Its speed at the first contact, and that of the two against each other, m/s.
    pub impact_mps: Option<f64>,
    pub relative_mps: Option<f64>,
    /// The least time to collision, s.
    pub ttc_s: Option<f64>,
    /// Whether a collision counts by the space's verdict.
    pub counted: bool,
    /// The requirements that were breached.
    pub breached: Vec<String>,
    /// Why nothing was carried out.
    pub refused: Option<String>,
}

impl Trial {
    /// What was lost of the speed before the contact, m/s.
    pub fn reduction_mps(&self) -> Option<f64> {
        Some((self.before_mps? - self.impact_mps?).max(0.0))
    }

    /// Whether a protocol calls it failed: a contact, or a requirement that was breached.
    pub fn is_failed(&self) -> bool {
        self.ending.is_some() && (self.impact_mps.is_some() || !self.breached.is_empty())
    }

    /// The action with its values, without the road: `begin(speed: 30)`.
    pub fn label(&self) -> String {
        let values: Vec<String> =
            self.values.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        match &self.action {
            Some(action) => format!("{action}({})", values.join(", ")),
            None => "no action".to_owned(),
        }
    }

    fn value(&self, name: &str) -> Option<&str> {
        self.values.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }
}

impl Database {
    /// Every action that was carried out, in order, and the episodes in which none was.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn trials(&self) -> Result<Vec<Trial>, DatabaseError> {
        let steps = "SELECT episode, step, action, ttc_s, top_speed_mps FROM step ORDER BY episode, step";
        let steps = query_all(&self.connection, steps, |row| {
            Ok(Step {
                episode: row.get(0)?,
                step: row.get(1)?,
                action: row.get(2)?,
                ttc_s: row.get(3)?,
                top_mps: row.get(4)?,
            })
        })?;
        let contacts = "SELECT episode, step, ego_speed_mps, relative_speed_mps, counted FROM collision ORDER BY episode, number";
        let contacts: Vec<(i64, i64, f64, f64, bool)> = query_all(&self.connection, contacts, |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?))
        })?;
        let breaches = "SELECT episode, step, requirement FROM breach ORDER BY episode, number";
        let breaches: Vec<(i64, i64, String)> =
            query_all(&self.connection, breaches, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        let episodes: Vec<(i64, String, Option<f64>)> = query_all(
            &self.connection,
            "SELECT episode, road, pet_s FROM episode ORDER BY episode",
            |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)),
        )?;
        let reasons =
            "SELECT episode, text FROM offer JOIN reason USING (reason) ORDER BY episode, steps DESC, text";
        let reasons: Vec<(i64, String)> =
            query_all(&self.connection, reasons, |row| Ok((row.get(0)?, row.get(1)?)))?;
        let by_episode = |wanted: i64, from: &mut usize| {
            let first = *from + steps[*from..].partition_point(|step| step.episode < wanted);
            *from = first + steps[first..].partition_point(|step| step.episode == wanted);
            &steps[first..*from]
        };
        let (mut trials, mut from) = (Vec::new(), 0);
        for (episode, road, pet_s) in episodes {
            let own = by_episode(episode, &mut from);
            let begun: Vec<usize> = (0..own.len()).filter(|at| own[*at].action.is_some()).collect();
            let plain = Trial {
                episode,
                road,
                action: None,
                values: Vec::new(),
                ending: None,
                before_mps: None,
                impact_mps: None,
                relative_mps: None,
                ttc_s: None,
                counted: false,
                breached: Vec::new(),
                refused: None,
            };
            if begun.is_empty() {
                let at = reasons.partition_point(|(of, _)| *of < episode);
                let refused = reasons.get(at).filter(|(of, _)| *of == episode).map(|(_, text)| text.clone());
                trials.push(Trial { refused, ..plain });
                continue;
            }
            for (nth, at) in begun.iter().enumerate() {
                // What comes until the next action is put down to this one.
                let until = begun.get(nth + 1).copied().unwrap_or(own.len());
                let span = &own[*at..until];
                let is_within = |step: i64| span.iter().any(|one| one.step == step);
                let own_contacts: Vec<_> =
                    contacts.iter().filter(|(of, step, ..)| *of == episode && is_within(*step)).collect();
                let least = |values: &mut dyn Iterator<Item = f64>| values.reduce(f64::min);
                let ttc_s = least(&mut span.iter().filter_map(|step| step.ttc_s));
                let before_mps = span.iter().filter_map(|step| step.top_mps).reduce(f64::max);
                let impact = own_contacts.first();
                // The encroachment is the episode's: it belongs to its only action, if there is one.
                let pet_s = pet_s.filter(|_| begun.len() == 1);
                let is_near = ttc_s.into_iter().chain(pet_s).any(|time_s| time_s < NEAR_S);
                let ending = match (impact, before_mps) {
                    (None, _) if is_near => Ending::Near,
                    (None, _) => Ending::Avoided,
                    (Some((_, _, mps, ..)), Some(before)) if before - mps >= MITIGATED_MPS => {
                        Ending::Mitigated
                    }
                    (Some(_), _) => Ending::Hit,
                };
                let mut breached: Vec<String> = Vec::new();
                for (of, step, name) in &breaches {
                    if *of == episode && is_within(*step) && !breached.contains(name) {
                        breached.push(name.clone());
                    }
                }
                let (action, values) = said(span[0].action.as_deref().unwrap_or_default());
                trials.push(Trial {
                    action: Some(action),
                    values,
                    ending: Some(ending),
                    before_mps,
                    impact_mps: impact.map(|(_, _, mps, ..)| *mps),
                    relative_mps: impact.map(|(_, _, _, mps, _)| *mps),
                    ttc_s,
                    counted: own_contacts.iter().any(|(.., counted)| *counted),
                    breached,
                    ..plain.clone()
                });
            }
        }
        Ok(trials)
    }
}

struct Step {
    episode: i64,
    step: i64,
    action: Option<String>,
    ttc_s: Option<f64>,
    top_mps: Option<f64>,
}

/// The name and the values of an action as a run writes it: `name(a: 1, b: Left) with { c: 2 m }`.
fn said(text: &str) -> (String, Vec<(String, String)>) {
    let name = text.split(['(', ' ']).next().unwrap_or_default().to_owned();
    let mut values = Vec::new();
    let inner = |open: char, close: char| {
        let begin = text.find(open)?;
        text.get(begin + 1..text.rfind(close)?)
    };
    // The values in brackets end where those in braces begin.
    let listed = inner('(', ')').filter(|_| !text.split('(').next().unwrap_or_default().contains('{'));
    for part in [listed, inner('{', '}')].into_iter().flatten() {
        let part = part.split(") with {").next().unwrap_or(part);
        for one in part.split(", ") {
            if let Some((name, value)) = one.trim().split_once(": ") {
                values.push((name.to_owned(), value.to_owned()));
            }
        }
    }
    (name, values)
}

/// How often each ending came, in the order of [`Ending::ALL`], and the speeds of contacts.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Tally {
    pub endings: [u32; 4],
    /// Trials with a breach.
    pub breached: u32,
    /// The mean speed at contacts, and what was lost of the speed before them, m/s.
    pub impact_mps: Option<f64>,
    pub reduction_mps: Option<f64>,
}

impl Tally {
    pub fn of<'t>(trials: impl IntoIterator<Item = &'t Trial>) -> Tally {
        let mut tally = Tally::default();
        let (mut impacts, mut reductions) = (Vec::new(), Vec::new());
        for trial in trials {
            if let Some(ending) = trial.ending {
                tally.endings[ending as usize] += 1;
            }
            tally.breached += u32::from(!trial.breached.is_empty());
            impacts.extend(trial.impact_mps);
            reductions.extend(trial.reduction_mps());
        }
        let mean =
            |values: Vec<f64>| (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64);
        (tally.impact_mps, tally.reduction_mps) = (mean(impacts), mean(reductions));
        tally
    }

    pub fn count(&self) -> u32 {
        self.endings.iter().sum()
    }
}

/// Trials by the values of two parameters, or of one.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct HeatMap {
    /// The parameter of each axis; the second is empty if there is none.
    pub down: String,
    pub across: String,
    pub rows: Vec<String>,
    pub columns: Vec<String>,
    /// By row and column; `None` where nothing was tried.
    pub cells: Vec<Vec<Option<Tally>>>,
}

/// The trials of actions that have both parameters, by their values. Numbers of more than twelve values come in ranges. `across`
/// is empty for one parameter alone; `None` if no action has them.
pub fn heat_map(trials: &[Trial], down: &str, across: &str) -> Option<HeatMap> {
    let value = |trial: &Trial, name: &str| match name {
        "" => Some(String::new()),
        "road" => Some(trial.road.clone()),
        _ => trial.value(name).map(str::to_owned),
    };
    let has = |trial: &&Trial| {
        trial.ending.is_some() && value(trial, down).is_some() && value(trial, across).is_some()
    };
    let trials: Vec<&Trial> = trials.iter().filter(has).collect();
    if trials.is_empty() {
        return None;
    }
    let values = |name: &str| -> Vec<String> {
        trials.iter().map(|trial| value(trial, name).unwrap_or_default()).collect()
    };
    let (rows, columns) = (Axis::of(&values(down)), Axis::of(&values(across)));
    let mut within: BTreeMap<(usize, usize), Vec<&Trial>> = BTreeMap::new();
    for (nth, trial) in trials.iter().enumerate() {
        within.entry((rows.at[nth], columns.at[nth])).or_default().push(trial);
    }
    let cell = |row, column| within.get(&(row, column)).map(|found| Tally::of(found.iter().copied()));
    let line = |row| (0..columns.labels.len()).map(|column| cell(row, column)).collect();
    let cells = (0..rows.labels.len()).map(line).collect();
    let (down, across) = (down.to_owned(), across.to_owned());
    Some(HeatMap { down, across, rows: rows.labels, columns: columns.labels, cells })
}

/// The two parameters with the most values among those that are listed in the table; fewer if fewer differ.
pub fn main_parameters(trials: &[Trial]) -> Vec<String> {
    let mut values: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (name, value) in trials.iter().flat_map(|trial| &trial.values) {
        values.entry(name).or_default().insert(value);
    }
    let mut names: Vec<(&str, usize)> = values
        .into_iter()
        .map(|(name, values)| (name, values.len()))
        .filter(|(_, count)| (2..=AXIS_MAX * AXIS_MAX).contains(count))
        .collect();
    names.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
    names.into_iter().take(2).map(|(name, _)| name.to_owned()).collect()
}

/// The values of a parameter in order, and which of them each trial has.
struct Axis {
    labels: Vec<String>,
    at: Vec<usize>,
}

impl Axis {
    fn of(values: &[String]) -> Axis {
        let number = |text: &str| text.split(' ').next().and_then(|digits| digits.parse::<f64>().ok());
        let unit = |text: &str| text.split_once(' ').map_or(String::new(), |(_, unit)| format!(" {unit}"));
        let mut distinct: Vec<&String> = values.iter().collect::<BTreeSet<_>>().into_iter().collect();
        let numbers: Option<Vec<f64>> = values.iter().map(|value| number(value)).collect();
        let Some(numbers) = numbers else {
            let at = |value: &String| distinct.iter().position(|known| *known == value).unwrap_or(0);
            return Axis {
                at: values.iter().map(at).collect(),
                labels: distinct.into_iter().cloned().collect(),
            };
        };
        if distinct.len() <= AXIS_MAX {
            distinct.sort_by(|a, b| number(a).unwrap_or(0.0).total_cmp(&number(b).unwrap_or(0.0)));
            let at = |value: &String| distinct.iter().position(|known| *known == value).unwrap_or(0);
            return Axis {
                at: values.iter().map(at).collect(),
                labels: distinct.into_iter().cloned().collect(),
            };
        }
        let (low, high) = numbers.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        });
        let width = (high - low) / AXIS_MAX as f64;
        let unit = unit(&values[0]);
        let label = |nth: usize| {
            let [from, to] = [nth, nth + 1].map(|edge| low + width * edge as f64);
            format!("{from:.3} to {to:.3}{unit}")
        };
        let at = |value: &f64| (((value - low) / width) as usize).min(AXIS_MAX - 1);
        Axis { labels: (0..AXIS_MAX).map(label).collect(), at: numbers.iter().map(at).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(values: &[(&str, &str)], impact_mps: Option<f64>) -> Trial {
        let ending = Some(if impact_mps.is_some() { Ending::Hit } else { Ending::Avoided });
        Trial {
            episode: 0,
            road: "corner".to_owned(),
            action: Some("begin".to_owned()),
            values: values.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect(),
            ending,
            before_mps: Some(10.0),
            impact_mps,
            relative_mps: impact_mps,
            ttc_s: None,
            counted: false,
            breached: Vec::new(),
            refused: None,
        }
    }

    #[test]
    fn values_are_read_back_as_a_run_writes_them() {
        let pairs = |text: &str| {
            said(text).1.into_iter().map(|(name, value)| name + "=" + &value).collect::<Vec<_>>()
        };
        assert_eq!(said("wait").0, "wait");
        assert_eq!(pairs("begin(a: -5, b: Left)"), ["a=-5", "b=Left"]);
        assert_eq!(pairs("begin(a: 1) with { v: 5 m/s, body: SUV }"), ["a=1", "v=5 m/s", "body=SUV"]);
        assert_eq!(pairs("begin with { v: 5 m/s }"), ["v=5 m/s"]);
        assert!(pairs("begin()").is_empty());
    }

    #[test]
    fn a_heat_map_has_a_cell_for_each_pair_of_values_that_was_tried() {
        let trials = [
            trial(&[("speed", "30"), ("overlap", "50")], None),
            trial(&[("speed", "5"), ("overlap", "100")], Some(4.0)),
            trial(&[("speed", "5"), ("overlap", "100")], Some(6.0)),
            trial(&[("speed", "5")], None),
        ];
        let map = heat_map(&trials, "speed", "overlap").expect("three have both");
        assert_eq!(
            (map.rows, map.columns),
            (vec!["5".to_owned(), "30".to_owned()], vec!["50".to_owned(), "100".to_owned()])
        );
        assert_eq!(map.cells[0][0], None);
        let tally = map.cells[0][1].clone().expect("two were tried");
        assert_eq!(
            (tally.endings, tally.impact_mps, tally.reduction_mps),
            ([0, 0, 0, 2], Some(5.0), Some(5.0))
        );
        assert!(heat_map(&trials, "speed", "colour").is_none());
        assert_eq!(heat_map(&trials, "speed", "").expect("all have it").columns, [""]);
        assert_eq!(main_parameters(&trials), ["overlap", "speed"]);
    }

    #[test]
    fn many_numbers_come_in_ranges() {
        let values: Vec<String> = (0..=24).map(|nth| format!("{} m/s", nth as f64 / 2.0)).collect();
        let axis = Axis::of(&values);
        assert_eq!((axis.labels.len(), axis.labels[0].as_str()), (12, "0.000 to 1.000 m/s"));
        assert_eq!((axis.at[0], axis.at[2], axis.at[24]), (0, 1, 11));
    }
}
