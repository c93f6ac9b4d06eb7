//! The outcome of each executed action, with its values: the table of a protocol, and heat maps by two parameters.

use std::collections::{BTreeMap, BTreeSet};

use crate::run::database::Database;
use crate::run::findings::scenario_name;
use crate::run::sealed::{DatabaseError, query_all};
use avastra_base::units::{Dimension, decimal};
use avastra_lang::model::{Space, Type};

/// Below this time to collision or post-encroachment time a drive without a contact is a near miss, s: the threshold of traffic
/// conflicts (Hydén 1987; the default of FHWA's SSAM, 2008).
pub const NEAR_S: f64 = 1.5;

/// A contact is mitigated if the ego vehicle was slower by this than before, m/s: 5 km/h, a step of Euro NCAP's speeds.
pub const MITIGATED_MPS: f64 = 5.0 / 3.6;

/// Why a row counts as not tested, although it may have come.
const TOUCHED: &str = "the ego vehicle touched somebody before it came";

/// Values of one axis beyond which numbers are put into ranges.
const AXIS_MAX: usize = 24;
/// Ranges into which more numbers are put.
const RANGES: usize = 12;

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
    /// Without a contact, but other road users crashed into each other: it was not the test that was meant.
    OthersCrashed,
    /// The driving system failed before anything else came of it: its process died, say.
    Failed,
}

impl Ending {
    pub const ALL: [Ending; 6] = [
        Ending::Avoided,
        Ending::Near,
        Ending::Mitigated,
        Ending::Hit,
        Ending::OthersCrashed,
        Ending::Failed,
    ];

    pub fn in_words(self) -> &'static str {
        match self {
            Ending::Avoided => "avoided",
            Ending::Near => "near miss",
            Ending::Mitigated => "mitigated",
            Ending::Hit => "hit",
            Ending::OthersCrashed => "others crashed",
            Ending::Failed => "driving system failed",
        }
    }
}

/// An action that was carried out, or an episode in which none was.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ProtocolTest {
    pub episode: i64,
    pub road: String,
    /// The action's name: it was carried out if there is an `ending`, else asked for and refused. `None` if no row alone was asked for.
    pub action: Option<String>,
    /// Its values, as the language writes them.
    pub values: Vec<(String, String)>,
    pub ending: Option<Ending>,
    /// The ego vehicle's greatest speed before the first contact, m/s.
    pub before_mps: Option<f64>,
    /// Its speed at the first contact, and that of the two against each other, m/s.
    pub impact_mps: Option<f64>,
    pub relative_mps: Option<f64>,
    /// The pre-crash type of the first contact, with its number among NHTSA's 37; a wreck has none.
    pub precrash: Option<String>,
    /// The least time to collision, s.
    pub ttc_s: Option<f64>,
    /// Whether a collision counts by the space's verdict.
    pub counted: bool,
    /// The requirements that were breached.
    pub breached: Vec<String>,
    /// Why nothing was carried out.
    pub refused: Option<String>,
    /// Whether other road users crashed into each other.
    pub others_crashed: bool,
}

impl ProtocolTest {
    /// The reduction of the speed before the contact, m/s.
    pub fn reduction_mps(&self) -> Option<f64> {
        Some((self.before_mps? - self.impact_mps?).max(0.0))
    }

    /// Whether a protocol calls it failed: a contact, a requirement that was breached, or a driving system that gave up.
    pub fn is_failed(&self) -> bool {
        let is_hit = self.impact_mps.is_some() || !self.breached.is_empty();
        self.ending.is_some_and(|ending| is_hit || ending == Ending::Failed)
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
    /// Every action that was carried out, in order, and the episodes in which none was. `protocol` is the space of a run that
    /// asked for one row in each episode: then there is one test of each, of that row.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn tests(&self, protocol: Option<&Space>) -> Result<Vec<ProtocolTest>, DatabaseError> {
        let read = &self.connection;
        let steps = "SELECT episode, step, action, ttc_s, top_speed_mps, action_row, others_crashed FROM step ORDER BY episode, step";
        let steps = query_all(read, steps, |row| {
            let (episode, step, action) = (row.get(0)?, row.get(1)?, row.get(2)?);
            let (ttc_s, top_mps, row_number, others_crashed) =
                (row.get(3)?, row.get(4)?, row.get(5)?, row.get(6)?);
            Ok(Step { episode, step, action, ttc_s, top_mps, row: row_number, others_crashed })
        })?;
        let contacts =
            "SELECT episode, step, ego_speed_mps, relative_speed_mps, counted, precrash, precrash_number
            FROM collision ORDER BY episode, number";
        let contacts = query_all(read, contacts, |row| {
            let (episode, step, ego_mps) = (row.get(0)?, row.get(1)?, row.get(2)?);
            let (name, number): (String, Option<u32>) = (row.get(5)?, row.get(6)?);
            let precrash = number.map_or(name.clone(), |number| format!("{number} {name}"));
            Ok(Contact { episode, step, ego_mps, relative_mps: row.get(3)?, counted: row.get(4)?, precrash })
        })?;
        let breaches = "SELECT episode, step, requirement FROM breach ORDER BY episode, number";
        let breaches: Vec<(i64, i64, String)> =
            query_all(read, breaches, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        let reasons = "SELECT episode, action_row, text FROM offer JOIN reason USING (reason)
            ORDER BY episode, steps DESC, text";
        let reasons: Vec<(i64, i64, String)> =
            query_all(read, reasons, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        let offered = "SELECT DISTINCT episode, action_row FROM offer ORDER BY episode, action_row";
        let offered: Vec<(i64, i64)> = query_all(read, offered, |row| Ok((row.get(0)?, row.get(1)?)))?;
        let episodes = "SELECT episode, road, pet_s FROM episode ORDER BY episode";
        let episodes: Vec<(i64, String, Option<f64>)> =
            query_all(read, episodes, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        let failures: Vec<i64> =
            query_all(read, "SELECT episode FROM failure ORDER BY episode", |row| row.get(0))?;
        let mut tests = Vec::new();
        for (episode, road, pet_s) in episodes {
            let has_failed = failures.binary_search(&episode).is_ok();
            let steps = of_episode(&steps, episode, |step| step.episode);
            let contacts = of_episode(&contacts, episode, |contact| contact.episode);
            let breaches = of_episode(&breaches, episode, |breach| breach.0);
            let mut begun: Vec<usize> = (0..steps.len()).filter(|at| steps[*at].action.is_some()).collect();
            let offered = of_episode(&offered, episode, |offer| offer.0);
            // An episode that was asked for one row notes only that row as offered, whatever else it plays.
            let own = offered.first().and_then(|(_, row)| usize::try_from(*row).ok());
            let asked = protocol.and_then(|space| space.rows.get(own?));
            // The rows before the one that was asked for make road users appear.
            begun.retain(|at| asked.is_none_or(|row| steps[*at].row == i64::try_from(row.index).ok()));
            let of_asked = |reason: &&(i64, i64, String)| {
                asked.is_none_or(|row| i64::try_from(row.index) == Ok(reason.1))
            };
            let refused = of_episode(&reasons, episode, |reason| reason.0).iter().find(of_asked);
            let mut refused = refused.map(|(_, _, reason)| reason.clone());
            let first_step = begun.first().map_or(i64::MAX, |at| steps[*at].step);
            if asked.is_some() && contacts.iter().any(|contact| contact.step < first_step) {
                refused = Some(TOUCHED.to_owned());
                begun.clear();
            }
            if begun.is_empty() {
                let mut test = ProtocolTest::without_action(episode, &road);
                if let Some(row) = asked {
                    let (name, values) = said(&row.label);
                    (test.action, test.values) = (Some(name), values);
                }
                test.refused = refused;
                test.ending = has_failed.then_some(Ending::Failed);
                tests.push(test);
            }
            for (nth, at) in begun.iter().enumerate() {
                // All steps until the next action are put down to this one.
                let until = begun.get(nth + 1).copied().unwrap_or(steps.len());
                // The encroachment is the episode's: it belongs to its only action, if there is one.
                let pet_s = pet_s.filter(|_| begun.len() == 1);
                let mut test = ProtocolTest::of(&road, &steps[*at..until], contacts, breaches, pet_s);
                if has_failed && until == steps.len() && test.impact_mps.is_none() {
                    test.ending = Some(Ending::Failed);
                }
                tests.push(test);
            }
        }
        Ok(tests)
    }
}

/// The rows of an episode among those of all, which are in order.
fn of_episode<T>(rows: &[T], episode: i64, number: impl Fn(&T) -> i64) -> &[T] {
    let first = rows.partition_point(|row| number(row) < episode);
    let last = rows.partition_point(|row| number(row) <= episode);
    &rows[first..last]
}

impl ProtocolTest {
    fn without_action(episode: i64, road: &str) -> ProtocolTest {
        ProtocolTest {
            episode,
            road: road.to_owned(),
            action: None,
            values: Vec::new(),
            ending: None,
            before_mps: None,
            impact_mps: None,
            relative_mps: None,
            precrash: None,
            ttc_s: None,
            counted: false,
            breached: Vec::new(),
            refused: None,
            others_crashed: false,
        }
    }

    /// An action with all that came until the next one: `steps` are its own, one or more, the others those of the episode.
    fn of(
        road: &str,
        steps: &[Step],
        contacts: &[Contact],
        breaches: &[(i64, i64, String)],
        pet_s: Option<f64>,
    ) -> ProtocolTest {
        let is_own = |step: i64| steps.iter().any(|one| one.step == step);
        let contacts: Vec<&Contact> = contacts.iter().filter(|contact| is_own(contact.step)).collect();
        let ttc_s = steps.iter().filter_map(|step| step.ttc_s).reduce(f64::min);
        let before_mps = steps.iter().filter_map(|step| step.top_mps).reduce(f64::max);
        let is_near = ttc_s.into_iter().chain(pet_s).any(|time_s| time_s < NEAR_S);
        let impact = contacts.first();
        let others_crashed = steps.iter().any(|step| step.others_crashed);
        let ending = match (impact, before_mps) {
            (None, _) if others_crashed => Ending::OthersCrashed,
            (None, _) if is_near => Ending::Near,
            (None, _) => Ending::Avoided,
            (Some(impact), Some(before_mps)) if before_mps - impact.ego_mps >= MITIGATED_MPS => {
                Ending::Mitigated
            }
            (Some(_), _) => Ending::Hit,
        };
        let mut breached: Vec<String> = Vec::new();
        for (_, step, name) in breaches {
            if is_own(*step) && !breached.contains(name) {
                breached.push(name.clone());
            }
        }
        let (action, values) = said(steps[0].action.as_deref().unwrap_or_default());
        ProtocolTest {
            action: Some(action),
            values,
            ending: Some(ending),
            before_mps,
            impact_mps: impact.map(|impact| impact.ego_mps),
            relative_mps: impact.map(|impact| impact.relative_mps),
            precrash: impact.map(|impact| impact.precrash.clone()),
            ttc_s,
            counted: contacts.iter().any(|contact| contact.counted),
            breached,
            others_crashed,
            ..ProtocolTest::without_action(steps[0].episode, road)
        }
    }
}

struct Contact {
    episode: i64,
    step: i64,
    ego_mps: f64,
    relative_mps: f64,
    counted: bool,
    precrash: String,
}

struct Step {
    episode: i64,
    step: i64,
    action: Option<String>,
    ttc_s: Option<f64>,
    top_mps: Option<f64>,
    row: Option<i64>,
    others_crashed: bool,
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
    pub endings: [u32; Ending::ALL.len()],
    /// Tests with a breach.
    pub breached: u32,
    /// Means over contacts, m/s: the speed of the two against each other, that of the ego vehicle, and what this lost of its
    /// speed before.
    pub relative_mps: Option<f64>,
    pub impact_mps: Option<f64>,
    pub reduction_mps: Option<f64>,
    /// The names that scenarios of their episodes have, of those in which something came of the action.
    pub scenarios: Vec<String>,
}

impl Tally {
    pub fn of<'t>(tests: impl IntoIterator<Item = &'t ProtocolTest>) -> Tally {
        let mut tally = Tally::default();
        let (mut relatives, mut impacts, mut reductions) = (Vec::new(), Vec::new(), Vec::new());
        for test in tests {
            if let Some(ending) = test.ending {
                tally.endings[ending as usize] += 1;
            }
            tally.breached += u32::from(!test.breached.is_empty());
            if test.ending != Some(Ending::Avoided) || !test.breached.is_empty() {
                tally.scenarios.push(scenario_name(&test.road, test.episode));
            }
            relatives.extend(test.relative_mps);
            impacts.extend(test.impact_mps);
            reductions.extend(test.reduction_mps());
        }
        let mean =
            |values: Vec<f64>| (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64);
        tally.relative_mps = mean(relatives);
        (tally.impact_mps, tally.reduction_mps) = (mean(impacts), mean(reductions));
        tally
    }

    pub fn count(&self) -> u32 {
        self.endings.iter().sum()
    }
}

/// Tests by the values of two parameters, or of one.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct HeatMap {
    pub action: String,
    /// What its documentation says of it; empty without one.
    pub about: String,
    /// The parameter of each axis; the second is empty if there is none.
    pub down: String,
    pub across: String,
    pub rows: Vec<String>,
    pub columns: Vec<String>,
    /// By row and column; `None` where nothing was tried.
    pub cells: Vec<Vec<Option<Tally>>>,
}

/// A map of each action that has both parameters: its tests by their values. `across` is empty for one parameter alone, and `road` is
/// one, too. Numbers of more than two dozen values come in ranges.
pub fn heat_maps(tests: &[ProtocolTest], down: &str, across: &str) -> Vec<HeatMap> {
    let of = |action: &String| heat_map(tests, action, core::slice::from_ref(action), [down, across]);
    actions(tests).iter().filter_map(of).collect()
}

/// The actions that were carried out, in the order in which they first were.
fn actions(tests: &[ProtocolTest]) -> Vec<String> {
    let mut actions: Vec<String> = Vec::new();
    for action in tests.iter().filter(|test| test.ending.is_some()).filter_map(|test| test.action.as_ref()) {
        if !actions.contains(action) {
            actions.push(action.clone());
        }
    }
    actions
}

/// A map of some actions, under a title.
fn heat_map(
    tests: &[ProtocolTest],
    title: &str,
    actions: &[String],
    [down, across]: [&str; 2],
) -> Option<HeatMap> {
    let value = |test: &ProtocolTest, name: &str| match name {
        "" => Some(String::new()),
        "road" => Some(test.road.clone()),
        ACTION => test.action.clone(),
        _ => test.value(name).map(str::to_owned),
    };
    let has = |test: &&ProtocolTest| {
        test.ending.is_some()
            && test.action.as_ref().is_some_and(|action| actions.contains(action))
            && value(test, down).is_some()
            && value(test, across).is_some()
    };
    let tests: Vec<&ProtocolTest> = tests.iter().filter(has).collect();
    if tests.is_empty() {
        return None;
    }
    let values = |name: &str| -> Vec<String> {
        tests.iter().map(|test| value(test, name).unwrap_or_default()).collect()
    };
    let (rows, columns) = (Axis::of(&values(down)), Axis::of(&values(across)));
    let mut within: BTreeMap<(usize, usize), Vec<&ProtocolTest>> = BTreeMap::new();
    for (nth, test) in tests.iter().enumerate() {
        within.entry((rows.at[nth], columns.at[nth])).or_default().push(test);
    }
    let cell = |row, column| within.get(&(row, column)).map(|found| Tally::of(found.iter().copied()));
    let line = |row| (0..columns.labels.len()).map(|column| cell(row, column)).collect();
    let cells = (0..rows.labels.len()).map(line).collect();
    let [action, down, across] = [title, down, across].map(str::to_owned);
    let (rows, columns, about) = (rows.labels, columns.labels, String::new());
    Some(HeatMap { action, about, down, across, rows, columns, cells })
}

impl HeatMap {
    /// The map with the words of the space: the action's documentation, and shares in per cent.
    pub fn told_by(mut self, space: &Space) -> HeatMap {
        let Some(action) = space.actions.iter().find(|action| action.name == self.action) else {
            return self;
        };
        self.about = action.docs.join(" ").trim().to_owned();
        let is_share = |name: &str| {
            let parameter = action.parameters.iter().find(|parameter| &*parameter.name == name);
            parameter.is_some_and(|parameter| parameter.ty == Type::Quantity(Dimension::RATIO))
        };
        for (name, labels) in [(&self.down, &mut self.rows), (&self.across, &mut self.columns)] {
            let numbers: Option<Vec<f64>> = labels.iter().map(|label| label.parse().ok()).collect();
            // Other numbers without a unit are counts, speeds without their unit and the like.
            let is_share = is_share(name)
                && numbers.as_ref().is_some_and(|all| {
                    all.iter().all(|share| share.abs() <= 1.0) && all.iter().any(|share| share.fract() != 0.0)
                });
            if let Some(numbers) = numbers.filter(|_| is_share) {
                *labels = numbers
                    .iter()
                    .map(|share| format!("{} %", decimal((share * 1e6).round() / 1e4, false)))
                    .collect();
            }
        }
        self
    }
}

/// The word for the action among parameters; no parameter has this name, since it is a keyword.
const ACTION: &str = "action";

/// A map of each action by the two of its parameters that have the most values, and one of all those without such parameters; by road
/// if that is a single one.
pub fn main_maps(tests: &[ProtocolTest]) -> Vec<HeatMap> {
    let mut single: Vec<String> = Vec::new();
    let mut of = |action: &String| {
        let mut values: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        let is_of = |test: &&ProtocolTest| test.ending.is_some() && test.action.as_ref() == Some(action);
        for test in tests.iter().filter(is_of) {
            for (name, value) in &test.values {
                values.entry(name).or_default().insert(value);
            }
        }
        let mut names: Vec<(&str, usize)> = values
            .into_iter()
            .map(|(name, values)| (name, values.len()))
            .filter(|(_, count)| *count > 1)
            .collect();
        names.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
        let name = |nth: usize| names.get(nth).map(|(name, _)| *name);
        let Some(first) = name(0) else {
            single.push(action.clone());
            return None;
        };
        heat_map(tests, action, core::slice::from_ref(action), [first, name(1).unwrap_or("")])
    };
    let mut maps: Vec<HeatMap> = actions(tests).iter().filter_map(&mut of).collect();
    maps.extend(match single.as_slice() {
        [only] => heat_map(tests, only, &single, ["road", ""]),
        _ => heat_map(tests, if maps.is_empty() { "all" } else { "all others" }, &single, [ACTION, ""]),
    });
    maps
}

/// The parameters of all actions that were carried out, and `road`.
pub fn parameters(tests: &[ProtocolTest]) -> Vec<String> {
    let mut names = vec!["road".to_owned()];
    for (name, _) in tests.iter().filter(|test| test.ending.is_some()).flat_map(|test| &test.values) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

/// The values of a parameter in order, and which of them each test has.
struct Axis {
    labels: Vec<String>,
    at: Vec<usize>,
}

impl Axis {
    fn of(values: &[String]) -> Axis {
        let number = |text: &str| text.split(' ').next().and_then(|digits| digits.parse::<f64>().ok());
        let unit = |text: &str| text.split_once(' ').map_or(String::new(), |(_, unit)| format!(" {unit}"));
        let mut distinct: Vec<&String> = values.iter().collect::<BTreeSet<_>>().into_iter().collect();
        // Numbers of several units have no order.
        let is_one_unit = values.iter().all(|value| unit(value) == unit(&values[0]));
        let numbers: Option<Vec<f64>> =
            values.iter().map(|value| number(value).filter(|_| is_one_unit)).collect();
        if numbers.is_some() {
            distinct.sort_by(|a, b| number(a).unwrap_or(0.0).total_cmp(&number(b).unwrap_or(0.0)));
        }
        let Some(numbers) = numbers.filter(|_| distinct.len() > AXIS_MAX) else {
            let at = |value: &String| distinct.iter().position(|known| *known == value).unwrap_or(0);
            return Axis {
                at: values.iter().map(at).collect(),
                labels: distinct.into_iter().cloned().collect(),
            };
        };
        let (low, high) = numbers.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        });
        let width = (high - low) / RANGES as f64;
        let unit = unit(&values[0]);
        let label = |nth: usize| {
            let [from, to] = [nth, nth + 1].map(|edge| low + width * edge as f64);
            format!("{from:.3} to {to:.3}{unit}")
        };
        let at = |value: &f64| (((value - low) / width) as usize).min(RANGES - 1);
        Axis { labels: (0..RANGES).map(label).collect(), at: numbers.iter().map(at).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn test(values: &[(&str, &str)], impact_mps: Option<f64>) -> ProtocolTest {
        let ending = Some(if impact_mps.is_some() { Ending::Hit } else { Ending::Avoided });
        ProtocolTest {
            episode: 0,
            road: "corner".to_owned(),
            action: Some("begin".to_owned()),
            values: values.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect(),
            ending,
            before_mps: Some(10.0),
            impact_mps,
            relative_mps: impact_mps,
            precrash: None,
            ttc_s: None,
            counted: false,
            breached: Vec::new(),
            refused: None,
            others_crashed: false,
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
        let tests = [
            test(&[("speed", "30"), ("overlap", "50")], None),
            test(&[("speed", "5"), ("overlap", "100")], Some(4.0)),
            test(&[("speed", "5"), ("overlap", "100")], Some(6.0)),
            test(&[("speed", "5")], None),
        ];
        let map =
            heat_map(&tests, "begin", &["begin".to_owned()], ["speed", "overlap"]).expect("three have both");
        assert_eq!(
            (map.rows, map.columns),
            (vec!["5".to_owned(), "30".to_owned()], vec!["50".to_owned(), "100".to_owned()])
        );
        assert_eq!(map.cells[0][0], None);
        let tally = map.cells[0][1].clone().expect("two were tried");
        assert_eq!(
            (tally.endings, tally.impact_mps, tally.reduction_mps),
            ([0, 0, 0, 2, 0, 0], Some(5.0), Some(5.0))
        );
        assert!(heat_maps(&tests, "speed", "colour").is_empty());
        assert_eq!(heat_maps(&tests, "speed", "")[0].columns, [""]);
        let main = &main_maps(&tests)[0];
        assert_eq!((main.down.as_str(), main.across.as_str()), ("overlap", "speed"));
        let named = |name: &str| ProtocolTest { action: Some(name.to_owned()), ..test(&[], None) };
        let of_all = &main_maps(&[named("one"), named("two")])[0];
        assert_eq!(
            (of_all.down.as_str(), &of_all.rows),
            ("action", &vec!["one".to_owned(), "two".to_owned()])
        );
        assert_eq!(main_maps(&[named("one")])[0].down, "road");
        assert_eq!(parameters(&tests), ["road", "speed", "overlap"]);
    }

    #[test]
    fn many_numbers_come_in_ranges() {
        let values: Vec<String> = (0..=48).map(|nth| format!("{} m/s", nth as f64 / 4.0)).collect();
        let axis = Axis::of(&values);
        assert_eq!((axis.labels.len(), axis.labels[0].as_str()), (12, "0.000 to 1.000 m/s"));
        assert_eq!((axis.at[0], axis.at[4], axis.at[48]), (0, 1, 11));
    }
}
