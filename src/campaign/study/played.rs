//! A study as it was played, in short: its settings, and of each cell the measures. A study's directory holds every
//! episode; this is what is kept of it beside the study's file, as text that can be committed.
//!
//! The text is JSON Lines: a line about the study, and then one for each cell, so that a study that is played on adds lines.
//! The last line is the seal, a digest of all lines before it, by which an edited figure is noticed.

use std::collections::{BTreeMap, BTreeSet};

use crate::run::Conditions;
use crate::study::measures::{MEASURES, MeasuredCell};
use crate::study::record::CellRecord;
use crate::study::settings::{AgentSettings, StudySettings};
use avastra_drivers::external::Attached;
use avastra_lang::model::digest;
use avastra_search::agent::by_name;

/// Raised whenever a field changes its meaning or goes away.
const SCHEMA: u32 = 2;

/// A study as it was played.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    /// The commit that avastra was built from when it played the study, if it was given.
    pub commit: Option<String>,
    pub settings: StudySettings,
    pub cells: Vec<MeasuredCell>,
}

/// How a study that was played differs from the same study as its file asks for it today, in words.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Departures {
    /// In size: then the result says less.
    pub smaller: Vec<String>,
    /// In anything else.
    pub other: Vec<String>,
}

/// The first line.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    schema: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    commit: Option<String>,
    settings: StudySettings,
    /// Names of the values of each cell.
    measures: Vec<String>,
}

/// The last line.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Seal {
    /// Digest of the bytes of all lines before.
    seal: String,
}

/// Advice for a text whose seal does not fit.
const UNSEALED: &str =
    "get it back as it was, or remove it and add its study again with `avastra study results --add DIR`";

/// The lines before the seal, if the seal fits them.
fn unsealed(text: &str) -> Result<&str, String> {
    let last = text.strip_suffix('\n').unwrap_or(text).rfind('\n').map_or(0, |end| end + 1);
    let (lines, last) = text.split_at(last);
    match serde_json::from_str::<Seal>(last) {
        Ok(Seal { seal }) if seal == digest(lines.as_bytes()) => Ok(lines),
        Ok(_) => Err(format!("it was changed since it was written: {UNSEALED}")),
        Err(_) => Err(format!("its last line is not the seal of those before: {UNSEALED}")),
    }
}

/// Reads the first line. An agent that was played may be gone since. Its findings stay. Nothing can read its settings any
/// more; only their episodes stay.
fn read_head(line: &str) -> Result<Head, serde_json::Error> {
    let mut head: serde_json::Value = serde_json::from_str(line)?;
    let agents = head.pointer_mut("/settings/agents").and_then(serde_json::Value::as_array_mut);
    for agent in agents.into_iter().flatten() {
        let is_gone = agent["name"].as_str().is_some_and(|name| by_name(name).is_none());
        if let Some(settings) = agent.pointer_mut("/training/hyperparameters").filter(|_| is_gone) {
            *settings = serde_json::json!({});
        }
    }
    serde_json::from_value(head)
}

impl Played {
    /// The kept figures of a study's cells, in the order of agents, roads and numbers.
    pub fn new(settings: StudySettings, cells: &[CellRecord], commit: Option<String>) -> Played {
        let cells = cells.iter().map(|cell| MeasuredCell::new(cell, &settings.evaluation)).collect();
        Played { commit, settings, cells }.in_order()
    }

    /// With the cells of another part of the same study.
    ///
    /// # Errors
    /// If a cell that both have differs in more than the time that it took.
    pub fn and(self, other: Played) -> Result<Played, String> {
        let mut cells = self.cells;
        for cell in other.cells {
            let is_it = |known: &&MeasuredCell| {
                (&known.agent, &known.road, known.number) == (&cell.agent, &cell.road, cell.number)
            };
            match cells.iter().find(is_it) {
                Some(known) if known.values == cell.values => {}
                Some(MeasuredCell { agent, road, number, .. }) => {
                    return Err(format!(
                        "its cell of `{agent}` on `{road}`, number {number}, differs from the one that is kept"
                    ));
                }
                None => cells.push(cell),
            }
        }
        Ok(Played { cells, commit: other.commit, ..self }.in_order())
    }

    /// With its cells in the order of agents, roads and numbers.
    fn in_order(mut self) -> Played {
        let StudySettings { agents, conditions, .. } = &self.settings;
        self.cells.sort_by_key(|cell| {
            let agent = agents.iter().position(|agent| agent.label == cell.agent);
            (agent, conditions.roads.iter().position(|road| *road == cell.road), cell.number)
        });
        self
    }

    pub fn to_text(&self) -> String {
        let head = Head {
            schema: SCHEMA,
            commit: self.commit.clone(),
            settings: self.settings.clone(),
            measures: MEASURES.iter().map(|measure| measure.name.to_owned()).collect(),
        };
        let mut text = serde_json::to_string(&head).expect("it has string keys only") + "\n";
        for cell in &self.cells {
            text.push_str(&serde_json::to_string(cell).expect("it has string keys only"));
            text.push('\n');
        }
        let seal = Seal { seal: digest(text.as_bytes()) };
        text.push_str(&serde_json::to_string(&seal).expect("it has string keys only"));
        text.push('\n');
        text
    }

    /// Reads the text back. A measure that it does not have has no values.
    ///
    /// # Errors
    /// If it was changed since it was written, or has another form: the line and the reason.
    pub fn from_text(text: &str) -> Result<Played, String> {
        let at = |index: usize| move |reason: serde_json::Error| format!("line {}: {reason}", index + 1);
        let mut lines = unsealed(text)?.lines().enumerate();
        let (_, head) = lines.next().ok_or("it is empty")?;
        let head = read_head(head).map_err(at(0))?;
        if head.schema != SCHEMA {
            return Err(format!("it has schema {}, this version of avastra reads {SCHEMA}", head.schema));
        }
        let places: BTreeMap<&str, usize> =
            head.measures.iter().enumerate().map(|(place, name)| (name.as_str(), place)).collect();
        let cell = |(index, line): (usize, &str)| {
            let cell: MeasuredCell = serde_json::from_str(line).map_err(at(index))?;
            if cell.values.len() != head.measures.len() {
                let (found, wanted) = (cell.values.len(), head.measures.len());
                return Err(format!("line {}: {found} values of {wanted} measures", index + 1));
            }
            let value =
                |name: &str| places.get(name).and_then(|&place| cell.values.get(place).copied().flatten());
            let values = MEASURES.iter().map(|measure| value(measure.name)).collect();
            Ok(MeasuredCell { values, ..cell })
        };
        let cells = lines.map(cell).collect::<Result<Vec<_>, String>>()?;
        let mut known = BTreeSet::new();
        for (index, cell) in cells.iter().enumerate() {
            if !known.insert((&cell.agent, &cell.road, cell.number)) {
                return Err(format!("line {}: this cell is there already", index + 2));
            }
        }
        Ok(Played { commit: head.commit, settings: head.settings, cells })
    }

    /// Time of one worker for all cells, s; `None` if that of a cell is not known.
    pub fn wall_s(&self) -> Option<f64> {
        self.cells.iter().map(|cell| cell.wall_s).sum()
    }

    /// Simulated time of all trainings and evaluations, h.
    pub fn simulated_h(&self) -> f64 {
        let sum = |measure: &str, cells: &mut dyn Iterator<Item = &MeasuredCell>| -> f64 {
            cells.filter_map(|cell| cell.value(measure)).sum()
        };
        // A training that goes round several roads stands in the cell of each.
        let first = self.settings.conditions.roads.first();
        let goes_round = |label: &str| {
            let agent = self.settings.agents.iter().find(|agent| agent.label == label);
            agent.and_then(|agent| agent.training.as_ref()).is_some_and(|plan| !plan.roads.is_empty())
        };
        let mut trained =
            self.cells.iter().filter(|cell| !goes_round(&cell.agent) || Some(&cell.road) == first);
        sum("evaluation_h", &mut self.cells.iter()) + sum("training_h", &mut trained)
    }

    /// How it differs from the study that `wanted` asks for.
    pub fn departures(&self, wanted: &StudySettings) -> Departures {
        let mut found = Departures::default();
        self.departs_in_size(wanted, &mut found.smaller);
        self.departs_otherwise(wanted, &mut found.other);
        found
    }

    fn departs_in_size(&self, wanted: &StudySettings, found: &mut Vec<String>) {
        if self.settings.quick {
            found.push("cut down by `--quick`".to_owned());
        }
        let missing: Vec<&str> = wanted
            .agents
            .iter()
            .filter(|agent| self.agent(&agent.label).is_none())
            .map(|agent| agent.label.as_str())
            .collect();
        if !missing.is_empty() {
            found.push(format!("without {}", missing.join(", ")));
        }
        let (own, all) = (&self.settings.conditions.roads, &wanted.conditions.roads);
        let roads: Vec<&str> = all.iter().filter(|road| own.contains(road)).map(String::as_str).collect();
        if roads.len() < all.len() {
            found.push(format!("on {} of {} roads", roads.len(), all.len()));
        }
        // Facts that agents have in common are said once.
        let mut alike: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        for agent in &wanted.agents {
            let Some(own) = self.agent(&agent.label) else { continue };
            let counts = roads.iter().map(|road| {
                self.cells.iter().filter(|cell| cell.agent == agent.label && cell.road == **road).count()
            });
            let fewest = counts.min().unwrap_or(0);
            let (one, episodes) = match (&own.training, &agent.training) {
                (Some(own), Some(wanted)) => ("trainings", Some((own.episodes, wanted.episodes))),
                _ => ("repetitions", Some((own.searched, agent.searched))),
            };
            if fewest < agent.repeats as usize {
                let text = format!("{fewest} of {} {one}", agent.repeats);
                alike.entry(text).or_default().push(&agent.label);
            }
            if let Some((own, wanted)) = episodes.filter(|(own, wanted)| own < wanted) {
                let text = format!("{one} of {own} episodes in place of {wanted}");
                alike.entry(text).or_default().push(&agent.label);
            }
        }
        found.extend(alike.into_iter().map(|(text, labels)| format!("{text} ({})", labels.join(", "))));
        let (own, wanted) = (&self.settings.evaluation, &wanted.evaluation);
        if own.episodes < wanted.episodes {
            found.push(format!("judged by {} episodes a seed in place of {}", own.episodes, wanted.episodes));
        }
        if own.seeds < wanted.seeds {
            found.push(format!("judged under {} seeds in place of {}", own.seeds, wanted.seeds));
        }
    }

    fn departs_otherwise(&self, wanted: &StudySettings, found: &mut Vec<String>) {
        let own = &self.settings;
        let mut differs = |is_so: bool, what: &str| {
            if is_so {
                found.push(what.to_owned());
            }
        };
        let (was, is) = (&own.conditions, &wanted.conditions);
        differs(was.engine != is.engine, &format!("the world is `{}` by now", is.engine));
        differs(was.space_digest != is.space_digest, "the space means something else by now");
        let ads =
            |of: &Conditions| (of.ads.clone(), of.profile.clone(), of.external.as_ref().map(Attached::name));
        differs(ads(was) != ads(is), "played against another driving system or profile");
        differs((was.ambient, &was.traffic) != (is.ambient, &is.traffic), "played in other traffic");
        differs(own.first_seed != wanted.first_seed, "played from another first seed");
        differs(own.avoidability != wanted.avoidability, "verdicts have other settings by now");
        let (mine, theirs) = (&own.evaluation, &wanted.evaluation);
        let is_larger = mine.episodes > theirs.episodes || mine.seeds > theirs.seeds;
        differs(is_larger || mine.horizon_s != theirs.horizon_s, "judged by another plan of episodes");
        for agent in &own.agents {
            let label = &agent.label;
            match wanted.agents.iter().find(|one| one.label == *label) {
                None => found.push(format!("`{label}` is no longer in the study")),
                Some(wanted) if !agent.is_as(wanted) => found.push(format!("`{label}` had other settings")),
                Some(_) => {}
            }
        }
    }

    fn agent(&self, label: &str) -> Option<&AgentSettings> {
        self.settings.agents.iter().find(|agent| agent.label == label)
    }
}

impl AgentSettings {
    /// Whether it is the same agent, however often and long it is trained or repeated.
    fn is_as(&self, other: &AgentSettings) -> bool {
        let sizeless = |agent: &AgentSettings| {
            let mut agent = agent.clone();
            agent.repeats = 0;
            agent.searched = 0;
            if let Some(training) = &mut agent.training {
                training.episodes = 0;
            }
            agent
        };
        sizeless(self) == sizeless(other)
    }
}
