//! Triage that remembers. A *known failure* is a name for findings, and a rule over their facts. The findings of a run are sorted
//! into known failures, and into kinds that are new. A known failure of which nothing is found is gone.

use std::collections::{BTreeMap, BTreeSet};

use avastra_lang::syntax::{listed, nearest, read_yaml};

use crate::oracle::Recurrence;
use crate::run::database::{Database, from_columns};
use crate::run::findings::scenario_name;
use crate::run::left::kind_text;
use crate::run::sealed::{DatabaseError, query_all};

/// The facts of a finding that are words.
const WORDS: [&str; 10] =
    ["kind", "requirement", "road", "body", "verb", "side", "approach", "shape", "priority", "cause"];
/// The facts of a finding that are numbers.
const NUMBERS: [&str; 4] = ["precrash", "ego_speed_mps", "closing_speed_mps", "harm_share"];

/// A known failure.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Known {
    pub name: String,
    /// What its findings have in common: facts, and the values that each may have.
    #[serde(rename = "where")]
    pub rule: BTreeMap<String, Values>,
    /// How often it was seen when it was named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen: Option<Seen>,
    /// For people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// The values that a fact may have.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Values {
    Number(f64),
    Word(String),
    Words(Vec<String>),
    Range(Range),
}

/// From the one to below the other.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below: Option<f64>,
}

/// In how many episodes a failure was seen, in how many simulated hours.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seen {
    pub episodes: u64,
    pub hours: f64,
}

/// A finding, by its facts.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    pub scenario: String,
    /// Whether it recurs.
    pub recurs: bool,
    words: BTreeMap<&'static str, String>,
    numbers: BTreeMap<&'static str, f64>,
}

/// The findings of runs, sorted.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Sorted {
    pub simulated_h: f64,
    pub known: Vec<FoundFailures>,
    /// Known failures of which findings are there, but none that was shown to recur.
    pub open: Vec<FoundFailures>,
    pub gone: Vec<GoneFailures>,
    /// The kinds of what no rule fits.
    pub new: Vec<FoundFailures>,
    /// Findings that no rule fits and that were not shown to recur. They are left out.
    pub unsure: usize,
}

/// A known failure, or a kind that has no name yet, of which something was found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct FoundFailures {
    pub name: String,
    pub episodes: u64,
    /// The scenario of the first.
    pub scenario: String,
    /// When it was named.
    pub before: Option<Seen>,
}

/// A known failure of which nothing was found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct GoneFailures {
    pub name: String,
    pub before: Option<Seen>,
    /// The chance to find nothing of it although it comes as it came before, if that is known.
    pub chance: Option<f64>,
}

/// Reads a file of known failures.
///
/// # Errors
/// If it has another form, has a name twice, or has a rule that fits everything, fits nothing or is about no fact: what is wrong.
pub fn read_known(text: &str) -> Result<Vec<Known>, String> {
    // A file without failures is no mistake.
    let failures: Vec<Known> = read_yaml::<Option<Vec<Known>>>(text)?.unwrap_or_default();
    let mut names = BTreeSet::new();
    for failure in &failures {
        let Known { name, rule, seen, .. } = failure;
        if !names.insert(name) {
            return Err(format!("two failures are called `{name}`: give one of them another name"));
        }
        if rule.is_empty() {
            return Err(format!("failure `{name}`: `where` is empty, so it would fit all findings"));
        }
        rule.iter()
            .try_for_each(|(fact, values)| check(fact, values))
            .map_err(|reason| format!("failure `{name}`: {reason}"))?;
        if seen.is_some_and(|seen| !(seen.hours > 0.0 && seen.hours.is_finite())) {
            return Err(format!("failure `{name}`: `hours` must be above 0"));
        }
    }
    Ok(failures)
}

/// Whether such a fact can have such values.
fn check(fact: &str, values: &Values) -> Result<(), String> {
    let is_word = WORDS.contains(&fact);
    if !is_word && !NUMBERS.contains(&fact) {
        let all: Vec<&str> = WORDS.into_iter().chain(NUMBERS).collect();
        let hint = nearest(fact, all.iter().copied())
            .map_or_else(|| format!("there are {}", listed(&all)), |near| format!("did you mean `{near}`?"));
        return Err(format!("a finding has no fact `{fact}`: {hint}"));
    }
    match (is_word, values) {
        (true, Values::Word(_)) | (false, Values::Number(_)) => Ok(()),
        (true, Values::Words(words)) if !words.is_empty() => Ok(()),
        (true, _) => Err(format!("`{fact}` is a word: write a word, or a list of words")),
        (false, Values::Range(Range { from, below })) => match (from, below) {
            (None, None) => Err(format!("`{fact}` has a range without ends: write `from`, `below` or both")),
            (Some(from), Some(below)) if from >= below => {
                Err(format!("`{fact}` has an empty range: `from` must be less than `below`"))
            }
            _ => Ok(()),
        },
        (false, _) => Err(format!("`{fact}` is a number: write a number, or `{{ from: …, below: … }}`")),
    }
}

/// A failure for each of these kinds, to be added to a file of them.
pub fn named(kinds: &[FoundFailures], hours: f64) -> Vec<Known> {
    let failure = |kind: &FoundFailures| Known {
        name: kind.name.clone(),
        rule: BTreeMap::from([("kind".to_owned(), Values::Word(kind.name.clone()))]),
        seen: Some(Seen { episodes: kind.episodes, hours: (10.0 * hours).ceil() / 10.0 }),
        note: None,
    };
    kinds.iter().map(failure).collect()
}

impl Fact {
    /// The same, with its scenario named as one of a run.
    #[must_use]
    pub fn of(self, run: &str) -> Fact {
        Fact { scenario: format!("{run}/critical/{}.ava", self.scenario), ..self }
    }
}

impl Known {
    fn fits(&self, finding: &Fact) -> bool {
        self.rule.iter().all(|(fact, values)| {
            let word = finding.words.get(fact.as_str());
            let number = finding.numbers.get(fact.as_str()).copied();
            match values {
                Values::Word(wanted) => word == Some(wanted),
                Values::Words(wanted) => word.is_some_and(|word| wanted.contains(word)),
                Values::Number(wanted) => number == Some(*wanted),
                Values::Range(Range { from, below }) => number.is_some_and(|number| {
                    from.is_none_or(|from| number >= from) && below.is_none_or(|below| number < below)
                }),
            }
        })
    }
}

impl Database {
    /// All findings, by their facts.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn facts(&self) -> Result<Vec<Fact>, DatabaseError> {
        let query = "SELECT episode, road, recurred, replays, precrash_number, precrash, cause, NULL AS requirement,
                    coalesce(own_body, body), verb, side, approach, shape, priority, ego_speed_mps, closing_speed_mps, harm_share
             FROM collision JOIN episode USING (episode) WHERE collision.counted
             UNION ALL SELECT episode, road, max(recurred), max(replays), NULL, NULL, NULL, requirement,
                    NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL
             FROM breach JOIN episode USING (episode) GROUP BY episode, requirement
             ORDER BY episode";
        query_all(&self.connection, query, |row| {
            let (episode, road): (i64, String) = (row.get(0)?, row.get(1)?);
            let recurrence = from_columns(row.get(2)?, row.get(3)?);
            let number: Option<u32> = row.get(4)?;
            let (precrash, requirement): (Option<String>, Option<String>) = (row.get(5)?, row.get(7)?);
            let cause: Option<String> = row.get(6)?;
            let kind = precrash.map(|name| kind_text(number, &name, cause.as_deref()));
            let scenario = scenario_name(&road, episode);
            let mut words: BTreeMap<&'static str, String> = BTreeMap::new();
            let mut note = |fact, value: Option<String>| drop(value.map(|value| words.insert(fact, value)));
            note("kind", kind.or_else(|| requirement.clone()));
            note("requirement", requirement);
            note("road", Some(road));
            note("cause", cause);
            // From the body to the priority, in the order of the query.
            for (at, fact) in WORDS[3..9].iter().enumerate() {
                note(fact, row.get(8 + at)?);
            }
            let mut numbers: BTreeMap<&'static str, f64> = BTreeMap::new();
            numbers.extend(number.map(|number| ("precrash", f64::from(number))));
            for (at, fact) in NUMBERS[1..].iter().enumerate() {
                numbers.extend(row.get::<_, Option<f64>>(14 + at)?.map(|value| (*fact, value)));
            }
            let recurs = recurrence.is_some_and(Recurrence::recurs);
            Ok(Fact { scenario, recurs, words, numbers })
        })
    }
}

/// Sorts the findings of a run into the first known failure whose rule fits, or else by their kinds.
pub fn sort(failures: &[Known], facts: &[Fact], simulated_h: f64) -> Sorted {
    let mut known: BTreeMap<usize, BTreeSet<&str>> = BTreeMap::new();
    let mut new: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    let mut open: BTreeMap<usize, BTreeSet<&str>> = BTreeMap::new();
    let mut unsure = 0;
    for finding in facts {
        let scenarios = match (failures.iter().position(|failure| failure.fits(finding)), finding.recurs) {
            (Some(failure), true) => known.entry(failure).or_default(),
            (Some(failure), false) => open.entry(failure).or_default(),
            (None, true) => new.entry(&finding.words["kind"]).or_default(),
            (None, false) => {
                unsure += 1;
                continue;
            }
        };
        scenarios.insert(&finding.scenario);
    }
    let found = |name: &str, scenarios: &BTreeSet<&str>, before| FoundFailures {
        name: name.to_owned(),
        episodes: scenarios.len() as u64,
        scenario: scenarios.first().map_or(String::new(), |first| (*first).to_owned()),
        before,
    };
    let gone =
        failures.iter().enumerate().filter(|(at, _)| !known.contains_key(at) && !open.contains_key(at)).map(
            |(_, failure)| GoneFailures {
                name: failure.name.clone(),
                before: failure.seen,
                chance: failure.seen.map(|seen| seen.chance_of_none(simulated_h)),
            },
        );
    let mut new: Vec<FoundFailures> =
        new.iter().map(|(name, scenarios)| found(name, scenarios, None)).collect();
    new.sort_by_key(|kind| core::cmp::Reverse(kind.episodes));
    Sorted {
        simulated_h,
        gone: gone.collect(),
        known: known
            .iter()
            .map(|(&at, found_in)| found(&failures[at].name, found_in, failures[at].seen))
            .collect(),
        open: open
            .iter()
            .filter(|(at, _)| !known.contains_key(at))
            .map(|(&at, found_in)| found(&failures[at].name, found_in, failures[at].seen))
            .collect(),
        new,
        unsure,
    }
}

impl Seen {
    /// The chance that nothing comes in so many hours, if what came before comes as a Poisson process: with a flat prior, its
    /// rate has a gamma distribution.
    fn chance_of_none(self, hours: f64) -> f64 {
        libm::pow(self.hours / (self.hours + hours), self.episodes as f64 + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(scenario: &str, kind: &str, road: &str, speed: f64) -> Fact {
        let words = BTreeMap::from([("kind", kind.to_owned()), ("road", road.to_owned())]);
        let numbers = BTreeMap::from([("ego_speed_mps", speed)]);
        Fact { scenario: scenario.to_owned(), recurs: true, words, numbers }
    }

    #[test]
    fn findings_are_sorted_into_what_is_known_new_and_gone() {
        let failures = read_known(
            "- name: fast ones\n  where: { kind: 12 pedestrian, ego_speed_mps: { from: 8 } }\n\
             - name: the rest\n  where: { kind: [12 pedestrian, 11 pedestrian], road: corner }\n\
             - name: old\n  where: { requirement: goes_on }\n  seen: { episodes: 3, hours: 10 }\n",
        )
        .expect("it is right");
        let facts = [
            finding("corner_0001", "12 pedestrian", "corner", 9.0),
            finding("corner_0002", "12 pedestrian", "corner", 7.9),
            finding("corner_0002", "11 pedestrian", "corner", 2.0),
            finding("avenue_0003", "11 pedestrian", "avenue", 2.0),
        ];
        let unsure = Fact { recurs: false, ..finding("avenue_0004", "27 left turn", "avenue", 3.0) };
        let sorted = sort(&failures, &[&facts[..], &[unsure]].concat(), 10.0);
        let named = |all: &[FoundFailures]| -> Vec<(String, u64, String)> {
            all.iter().map(|one| (one.name.clone(), one.episodes, one.scenario.clone())).collect()
        };
        let known = |name: &str, scenario: &str| (name.to_owned(), 1, scenario.to_owned());
        assert_eq!(
            named(&sorted.known),
            [known("fast ones", "corner_0001"), known("the rest", "corner_0002")]
        );
        assert_eq!(named(&sorted.new), [known("11 pedestrian", "avenue_0003")]);
        assert_eq!((sorted.gone.len(), sorted.gone[0].name.as_str(), sorted.unsure), (1, "old", 1));
        // Three in ten hours, none in ten more: (1/2) to the power of four.
        assert!((sorted.gone[0].chance.expect("it was seen before") - 0.0625).abs() < 1e-12);
        // What is named is known the next time.
        let text = serde_yaml::to_string(&super::named(&sorted.new, 9.96)).expect("it can be written");
        let again = read_known(&text).expect("it can be read");
        assert_eq!(again[0].seen, Some(Seen { episodes: 1, hours: 10.0 }));
        assert_eq!(sort(&again, &facts[3..], 1.0).new, []);
        // What was seen and not shown to recur is not gone.
        let open = sort(&again, &[Fact { recurs: false, ..facts[3].clone() }], 1.0);
        assert_eq!(
            (open.known.len(), open.gone.len(), named(&open.open)),
            (0, 0, vec![known("11 pedestrian", "avenue_0003")])
        );
    }

    #[test]
    fn mistakes_in_a_file_of_failures_are_named() {
        let wrong = |text: &str, reason: &str| {
            let error = read_known(text).expect_err(text);
            assert!(error.contains(reason), "{text}: {error}");
        };
        wrong("- name: a\n  where: {}\n", "it would fit all findings");
        wrong("- name: a\n  where: { rod: corner }\n", "no fact `rod`: did you mean `road`?");
        wrong("- name: a\n  where: { road: 3 }\n", "`road` is a word");
        wrong("- name: a\n  where: { road: [] }\n", "`road` is a word");
        wrong("- name: a\n  where: { precrash: eleven }\n", "`precrash` is a number");
        wrong("- name: a\n  where: { precrash: {} }\n", "without ends");
        wrong("- name: a\n  where: { precrash: { from: 3, below: 3 } }\n", "empty range");
        wrong(
            "- name: a\n  where: { road: x }\n- name: a\n  where: { road: z }\n",
            "two failures are called `a`",
        );
        wrong("- name: a\n  where: { road: x }\n  seen: { episodes: 1, hours: 0 }\n", "above 0");
        wrong("failures: 3\n", "");
        assert_eq!(read_known("").expect("no failures"), []);
        assert_eq!(read_known("# none yet\n").expect("no failures"), []);
    }
}
