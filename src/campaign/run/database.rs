//! `run.db`: one row an episode, a step and a collision, in SQLite.
//!
//! Each episode is one transaction, so a kill at any moment loses at most the episode under way.

use std::collections::{BTreeMap, BTreeSet};

use rusqlite::{Connection, Transaction, params};
use sha2::{Digest, Sha256};

use crate::episode::{Breach, EpisodeLog, Margin, Outcome};
use crate::files::PlainName;
use crate::oracle;
use crate::oracle::Recurrence;
use avastra_drivers::external::Failure;
use avastra_lang::model::policy::VARIABLES;
use avastra_lang::model::vocabulary::Word;
use avastra_lang::model::{Memory, RequirementDef, Space, StateMeaning, Value};
use avastra_search::mdp::STATE_LEN;
use avastra_world::action::Draw;

use crate::run::findings::scenario_name;
use crate::run::offered::{RowCount, without_figures};
use crate::run::sealed::{DatabaseError, Layout, insert_row, of_columns, query_all};
use crate::run::settled::{Units, WrittenScenario};
use crate::run::summary::{EpisodeSummary, Finding};

pub(crate) const LAYOUT: Layout = Layout {
    version: 17,
    schema: || format!("{SCHEMA}{}", step_table()),
    unit: "episode",
    tables: &[
        "episode",
        "step",
        "held",
        "offer",
        "collision",
        "breach",
        "margin",
        "failure",
        "learning",
        "scenario",
    ],
    naming: Some(("offer", "reason")),
    // A scenario names its space by a path from the file.
    local: &["scenario"],
    apart: &["checkpoint", "result"],
    sound: &[
        (
            "episode",
            "min(duration_s, distance_m, steps, red_runs, collisions, counted) >= 0
           AND max(duration_s, distance_m, steps, red_runs, collisions, counted) <= 1e9
           AND coalesce(first_counted_s, 0) BETWEEN 0 AND 1e9",
        ),
        ("collision", "time_s BETWEEN 0 AND 1e9 AND max(abs(ego_speed_mps), abs(delta_v_mps)) <= 1e9"),
        (
            "collision",
            "harm_share BETWEEN 0 AND 1e9 AND coalesce(replays, 1) BETWEEN 1 AND 1000
           AND coalesce(recurred, 0) BETWEEN 0 AND coalesce(replays, 0)",
        ),
        (
            "breach",
            "coalesce(replays, 1) BETWEEN 1 AND 1000 AND coalesce(recurred, 0) BETWEEN 0 AND coalesce(replays, 0)",
        ),
        ("margin", "asked_s BETWEEN 0 AND 1e9"),
        ("learning", "simulated_s BETWEEN 0 AND 1e9 AND abs(return) <= 1e12"),
    ],
};

/// `step.top_speed_mps` is the ego vehicle's greatest speed in the step before the first contact, NULL after it.
/// `step.others_crashed` says whether other road users crashed into each other in it.
/// `held` says what limited the speed of the ego vehicle, from the row's time to that of the next row. `offer`
/// counts, per episode and row, the steps in which the row was legal (`reason` 0) or refused (other reasons); training
/// writes nothing there. `breach.kept_by` has the careful drivers that keep the
/// requirement, NULL where none was asked (in a training). `recurred` of `replays` under other chance found the same, NULL where
/// that was not tried. `scenario` has the text of the file that was written of an episode. `learning`, `checkpoint`
/// and `result` belong to a training (`train::record`) and stay empty in a run.
const SCHEMA: &str = "
CREATE TABLE episode (
  episode INTEGER PRIMARY KEY, road TEXT NOT NULL, seed TEXT NOT NULL, ended TEXT NOT NULL,
  duration_s REAL NOT NULL, distance_m REAL NOT NULL, steps INTEGER NOT NULL, red_runs INTEGER NOT NULL,
  collisions INTEGER NOT NULL, counted INTEGER NOT NULL, first_counted_s REAL, trace TEXT NOT NULL, pet_s REAL
) STRICT;
CREATE TABLE collision (
  episode INTEGER NOT NULL REFERENCES episode, number INTEGER NOT NULL, time_s REAL NOT NULL,
  step INTEGER NOT NULL, obstacle INTEGER NOT NULL, body TEXT NOT NULL, own_body TEXT, verb TEXT NOT NULL,
  ego_speed_mps REAL NOT NULL, closing_speed_mps REAL NOT NULL,
  on_ego_ahead_m REAL NOT NULL, on_ego_left_m REAL NOT NULL,
  repeated INTEGER NOT NULL, sudden INTEGER NOT NULL, struck INTEGER NOT NULL, counted INTEGER NOT NULL,
  avoidability TEXT NOT NULL, hazard_onset_s REAL NOT NULL, avoided_by TEXT NOT NULL, evasion TEXT,
  side TEXT NOT NULL, approach TEXT NOT NULL, relative_speed_mps REAL NOT NULL, delta_v_mps REAL NOT NULL,
  obstacle_delta_v_mps REAL NOT NULL, cause TEXT, shape TEXT NOT NULL, precrash TEXT NOT NULL, precrash_number INTEGER, priority TEXT NOT NULL, r157_letter TEXT NOT NULL,
  harm TEXT NOT NULL, harm_share REAL NOT NULL, recurred INTEGER, replays INTEGER,
  priority_rule TEXT NOT NULL, priority_time_s REAL NOT NULL, priority_motion TEXT NOT NULL, unmet TEXT NOT NULL,
  PRIMARY KEY (episode, number)
) STRICT;
CREATE TABLE breach (
  episode INTEGER NOT NULL REFERENCES episode, number INTEGER NOT NULL, requirement TEXT NOT NULL,
  time_s REAL NOT NULL, until_s REAL NOT NULL, step INTEGER NOT NULL, margin REAL,
  kept_by TEXT, recurred INTEGER, replays INTEGER, obstacle INTEGER,
  PRIMARY KEY (episode, number)
) STRICT;
CREATE TABLE margin (
  episode INTEGER NOT NULL REFERENCES episode, requirement TEXT NOT NULL, smallest REAL, unit TEXT, asked_s REAL NOT NULL,
  PRIMARY KEY (episode, requirement)
) STRICT, WITHOUT ROWID;
CREATE TABLE scenario (episode INTEGER PRIMARY KEY REFERENCES episode, text TEXT NOT NULL) STRICT;
CREATE TABLE failure (
  episode INTEGER PRIMARY KEY REFERENCES episode, kind TEXT NOT NULL, problem TEXT NOT NULL, stage TEXT NOT NULL,
  detail TEXT NOT NULL, exit TEXT, stderr TEXT NOT NULL
) STRICT;
CREATE TABLE held (
  episode INTEGER NOT NULL REFERENCES episode, number INTEGER NOT NULL, from_s REAL NOT NULL, text TEXT NOT NULL,
  PRIMARY KEY (episode, number)
) STRICT, WITHOUT ROWID;
CREATE TABLE reason (reason INTEGER PRIMARY KEY, text TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE offer (
  episode INTEGER NOT NULL REFERENCES episode, action_row INTEGER NOT NULL, reason INTEGER NOT NULL, steps INTEGER NOT NULL,
  PRIMARY KEY (episode, action_row, reason)
) STRICT, WITHOUT ROWID;
CREATE TABLE learning (
  episode INTEGER PRIMARY KEY REFERENCES episode, return REAL NOT NULL, collisions INTEGER NOT NULL,
  counted INTEGER NOT NULL, epsilon REAL NOT NULL, loss REAL, updates INTEGER NOT NULL,
  steps INTEGER NOT NULL, simulated_s REAL NOT NULL
) STRICT;
CREATE TABLE checkpoint (
  only INTEGER PRIMARY KEY CHECK (only = 1), episodes INTEGER NOT NULL, digest TEXT NOT NULL,
  learner BLOB NOT NULL
) STRICT;
CREATE TABLE result (
  only INTEGER PRIMARY KEY CHECK (only = 1), digest TEXT NOT NULL, text TEXT NOT NULL
) STRICT;
";

/// An open run database.
pub struct Database {
    pub(crate) connection: Connection,
}

impl Units for Database {
    const LAYOUT: &'static Layout = &LAYOUT;

    fn connection(&self) -> &Connection {
        &self.connection
    }

    fn from_connection(connection: Connection) -> Database {
        Database { connection }
    }

    fn scenarios(&self) -> Result<Vec<WrittenScenario>, DatabaseError> {
        let query = "SELECT episode, road, text FROM scenario JOIN episode USING (episode) ORDER BY episode";
        let rows = query_all(&self.connection, query, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        let named = |(unit, road, text): (i64, String, String)| {
            if unit < 0 {
                return Err(DatabaseError::Episode { found: unit });
            }
            // Names of files begin with that of the road.
            let road = PlainName::new(road)?;
            PlainName::scenario(format!("{}.ava", &*road))?;
            let name = PlainName::scenario(format!("{}_{unit:04}.ava", &*road))?;
            Ok(WrittenScenario { unit, name, text })
        };
        rows.into_iter().map(named).collect()
    }
}

impl Database {
    /// Adds a whole episode, or nothing. `space` is the one that was played, and `in_words` says what a draw does in its
    /// words; `scenario` is the text of the file that was written of it.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(
        &mut self,
        summary: &EpisodeSummary,
        log: &EpisodeLog,
        space: &Space,
        in_words: impl Fn(&Draw) -> String,
        scenario: Option<&str>,
    ) -> Result<(), DatabaseError> {
        let transaction = self.connection.transaction()?;
        add_all(&transaction, summary, log, space, in_words, scenario)?;
        LAYOUT.seal(&transaction, summary.episode as i64)?;
        transaction.commit()?;
        Ok(())
    }

    /// Says of an episode that is in it how often its counted collisions recur, with another text of its scenario, which
    /// claims so.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add_recurrence(
        &mut self,
        summary: &EpisodeSummary,
        space: &Space,
        scenario: &str,
    ) -> Result<(), DatabaseError> {
        let transaction = self.connection.transaction()?;
        let episode = summary.episode as i64;
        for finding in &summary.collisions {
            let [recurred, replays] = in_columns(finding.recurrence);
            let change = "UPDATE collision SET recurred = ?, replays = ? WHERE episode = ? AND number = ?";
            transaction.execute(change, params![recurred, replays, episode, finding.number as i64])?;
        }
        for found in &summary.breached {
            let [recurred, replays] = in_columns(found.recurrence);
            let change = "UPDATE breach SET kept_by = ?, recurred = ?, replays = ? WHERE episode = ? AND requirement = ?";
            let (kept_by, name) = (found.kept_by.join(" "), &space.requirements[found.requirement].name);
            transaction.execute(change, params![kept_by, recurred, replays, episode, name])?;
        }
        transaction.execute("UPDATE scenario SET text = ? WHERE episode = ?", params![scenario, episode])?;
        LAYOUT.seal_anew(&transaction, episode)?;
        transaction.commit()?;
        Ok(())
    }

    /// The numbers of all episodes so far.
    ///
    /// # Errors
    /// If the file cannot be read, or holds an episode number below 0.
    pub fn episodes(&self) -> Result<BTreeSet<usize>, DatabaseError> {
        let numbers = query_all(&self.connection, "SELECT episode FROM episode", |row| row.get(0))?;
        let number = |found: i64| usize::try_from(found).map_err(|_| DatabaseError::Episode { found });
        numbers.into_iter().map(number).collect()
    }

    /// Why chosen actions were refused, and how often; the most frequent reason first. Figures in a reason are
    /// replaced by `…`, so that reasons that differ only in figures count as one.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn refusals(&self) -> Result<Vec<RefusalCount>, DatabaseError> {
        let mut statement = self.connection.prepare("SELECT refused FROM step WHERE refused IS NOT NULL")?;
        let mut counts: BTreeMap<String, i64> = BTreeMap::new();
        for reason in statement.query_map([], |row| row.get::<_, String>(0))? {
            *counts.entry(without_figures(&reason?)).or_default() += 1;
        }
        let mut refusals: Vec<RefusalCount> =
            counts.into_iter().map(|(reason, times)| RefusalCount { reason, times }).collect();
        refusals.sort_by_key(|refusal| -refusal.times);
        Ok(refusals)
    }

    /// Steps of all episodes.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn steps(&self) -> Result<i64, DatabaseError> {
        let steps: Vec<i64> = query_all(&self.connection, "SELECT count(*) FROM step", |row| row.get(0))?;
        Ok(steps.into_iter().sum())
    }

    /// The outcomes of each row of the table, by its number, over all episodes. A row for which no agent asked is
    /// absent.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn rows(&self) -> Result<BTreeMap<i64, RowCount>, DatabaseError> {
        let mut rows: BTreeMap<i64, RowCount> = BTreeMap::new();
        let offers = "SELECT action_row, text, sum(steps) FROM offer LEFT JOIN reason USING (reason)
             GROUP BY action_row, text ORDER BY sum(steps) DESC, text";
        let offers = query_all(&self.connection, offers, |row| {
            Ok((row.get(0)?, row.get::<_, Option<String>>(1)?, row.get(2)?))
        })?;
        for (row, reason, times) in offers {
            let count = rows.entry(row).or_default();
            match reason {
                None => count.legal = times,
                Some(reason) => count.refused.push(RefusalCount { reason, times }),
            }
        }
        let chosen = "SELECT action_row, count(*), count(action) FROM step WHERE action_row IS NOT NULL
             GROUP BY action_row";
        let chosen = query_all(&self.connection, chosen, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        for (row, chosen, realised) in chosen {
            let count = rows.entry(row).or_default();
            (count.chosen, count.realised) = (chosen, realised);
        }
        Ok(rows)
    }

    /// The failures of an external driving system, by their kind; the most frequent first.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn failures(&self) -> Result<Vec<FailureCount>, DatabaseError> {
        // The bare columns of an aggregate query with `min` are those of the row that has the minimum. All steps are one stage.
        // Other stages are counted apart, because each has its own time limit and message.
        let query = "SELECT kind, problem, count(*), min(failure.episode), stage, detail, exit, road,
                    CASE WHEN stage LIKE 'step %' THEN 'step' ELSE stage END AS when_failed
             FROM failure JOIN episode USING (episode) GROUP BY kind, problem, when_failed
             ORDER BY count(*) DESC, kind, problem, when_failed";
        query_all(&self.connection, query, |row| {
            let (episode, stage, detail): (i64, String, String) = (row.get(3)?, row.get(4)?, row.get(5)?);
            let (exit, road): (Option<String>, String) = (row.get(6)?, row.get(7)?);
            let exit = exit.map_or_else(String::new, |exit| format!(" ({exit})"));
            Ok(FailureCount {
                kind: row.get(0)?,
                problem: row.get(1)?,
                times: row.get(2)?,
                detail: format!("at {stage}, {detail}{exit}"),
                scenario: scenario_name(&road, episode),
            })
        })
    }

    /// The requirements that were in force, by name: how often each was breached, and how near it came to that.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn requirements(&self) -> Result<Vec<RequirementCount>, DatabaseError> {
        // The bare columns of an aggregate query with `min` are those of the row that has the minimum.
        let query = "SELECT margin.requirement, unit, count(*), min(smallest), episode.episode, road,
                    (SELECT count(*) FROM breach WHERE breach.requirement = margin.requirement),
                    (SELECT count(DISTINCT episode) FROM breach WHERE breach.requirement = margin.requirement),
                    (SELECT count(DISTINCT episode) FROM breach
                     WHERE breach.requirement = margin.requirement AND kept_by != ''),
                    (SELECT road || '/' || episode.episode
                     FROM breach JOIN episode USING (episode) JOIN scenario USING (episode)
                     WHERE breach.requirement = margin.requirement
                     ORDER BY replays IS NULL, coalesce(breach.margin, 0), episode LIMIT 1),
                    sum(asked_s), sum(asked_s > 0),
                    (SELECT count(DISTINCT episode) FROM breach
                     WHERE breach.requirement = margin.requirement AND kept_by IS NOT NULL)
             FROM margin JOIN episode USING (episode) GROUP BY margin.requirement
             ORDER BY 7 DESC, margin.requirement";
        let named = |at: Option<String>| {
            let (road, episode) = at.as_deref().and_then(|at| at.split_once('/'))?;
            Some(scenario_name(road, episode.parse().ok()?))
        };
        query_all(&self.connection, query, |row| {
            let (episode, road): (i64, String) = (row.get(4)?, row.get(5)?);
            let smallest: Option<f64> = row.get(3)?;
            Ok(RequirementCount {
                requirement: row.get(0)?,
                unit: row.get(1)?,
                episodes: row.get(2)?,
                smallest,
                nearest: smallest.map(|_| scenario_name(&road, episode)),
                breaches: row.get(6)?,
                breached_in: row.get(7)?,
                kept_in: row.get(8)?,
                scenario: named(row.get(9)?),
                asked_s: row.get(10)?,
                asked_in: row.get(11)?,
                tried_in: row.get(12)?,
            })
        })
    }

    /// Totals over all episodes.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn totals(&self) -> Result<Totals, DatabaseError> {
        // A requirement that is breached several times in an episode is one finding.
        let findings = "SELECT recurred, replays, TRUE FROM collision WHERE counted
             UNION ALL SELECT min(recurred), min(replays), FALSE FROM breach GROUP BY episode, requirement";
        let findings = query_all(&self.connection, findings, |row| {
            Ok(from_columns(row.get(0)?, row.get(1)?).zip(row.get::<_, Option<bool>>(2)?))
        })?;
        let found = findings.len() as i64;
        let replayed: Vec<(Recurrence, bool)> = findings.into_iter().flatten().collect();
        let recurring: Vec<bool> =
            replayed.iter().filter(|(of, _)| of.recurs()).map(|(_, is_collision)| *is_collision).collect();
        let counted_recurring = recurring.iter().filter(|is_collision| **is_collision).count() as i64;
        let (replayed, recurring) = (replayed.len() as i64, recurring.len() as i64);
        Ok(self.connection.query_row(
            "SELECT count(*), coalesce(sum(collisions), 0), coalesce(sum(counted), 0),
                        coalesce(sum(collisions > 0), 0), coalesce(sum(counted > 0), 0),
                        coalesce(sum(ended = 'arrived'), 0), coalesce(sum(ended = 'stalled'), 0),
                        coalesce(sum(ended = 'stalled' AND collisions = 0), 0),
                        coalesce(sum(ended = 'limit'), 0), coalesce(sum(duration_s), 0.0),
                        coalesce(sum(distance_m), 0.0), coalesce(sum(red_runs), 0), avg(first_counted_s),
                        (SELECT coalesce(sum(sudden), 0) FROM collision),
                        (SELECT coalesce(sum(struck), 0) FROM collision),
                        (SELECT coalesce(sum(repeated), 0) FROM collision),
                        (SELECT coalesce(sum(avoidability = 'avoidable'), 0) FROM collision),
                        (SELECT coalesce(sum(avoidability = 'beyond_reference'), 0) FROM collision),
                        (SELECT coalesce(sum(avoidability = 'unavoidable'), 0) FROM collision),
                        (SELECT coalesce(sum(priority = 'ego'), 0) FROM collision),
                        (SELECT coalesce(sum(priority = 'other'), 0) FROM collision),
                        coalesce(sum(ended = 'blocked'), 0), (SELECT count(*) FROM failure),
                        coalesce(sum(ended = 'astray'), 0), coalesce(sum(ended = 'left_the_map'), 0),
                        (SELECT count(DISTINCT episode) FROM breach), ?1, ?2, ?3, ?4,
                        coalesce(sum(red_runs > 0 AND counted = 0
                          AND episode NOT IN (SELECT episode FROM breach)), 0),
                        (SELECT count(DISTINCT episode) FROM step WHERE others_crashed)
                 FROM episode",
            [found, replayed, recurring, counted_recurring],
            |row| {
                let totals = of_columns!(
                    row,
                    0,
                    Totals {
                        episodes,
                        collisions,
                        counted,
                        episodes_with_collision,
                        episodes_with_counted,
                        arrived,
                        stalled,
                        stuck,
                        step_limit,
                        simulated_s,
                        driven_m,
                        red_runs,
                        first_counted_s_mean,
                        sudden,
                        struck,
                        repeated,
                        avoidable,
                        beyond_reference,
                        unavoidable,
                        wronged,
                        wrong,
                        blocked,
                        failed,
                        astray,
                        left_map,
                        episodes_with_breach,
                        findings,
                        replayed,
                        recurring,
                        counted_recurring,
                        red_unkept,
                        others_crashed,
                    }
                );
                Ok(totals)
            },
        )?)
    }
}

/// How a requirement was kept over all episodes.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RequirementCount {
    pub requirement: String,
    /// Episodes in which it was in force.
    pub episodes: i64,
    /// For how long it was asked in all of them, s, and in how many of them at all.
    pub asked_s: f64,
    pub asked_in: i64,
    pub breaches: i64,
    /// Episodes with a breach of it.
    pub breached_in: i64,
    /// Among these, episodes in which careful drivers were tried, and in which one would have kept it.
    pub tried_in: i64,
    pub kept_in: i64,
    /// The smallest margin of all episodes, in the unit; `None` if it has none or was never asked.
    pub smallest: Option<f64>,
    pub unit: Option<String>,
    /// Name of the episode with the smallest margin, and name of the scenario with the worst breach, of those that were played
    /// again if any were.
    pub nearest: Option<String>,
    pub scenario: Option<String>,
}

/// How often a reason kept an action from being carried out.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct RefusalCount {
    pub reason: String,
    pub times: i64,
}

/// A failure of an external driving system: how often it happened, and the first time.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct FailureCount {
    pub kind: String,
    pub problem: String,
    pub times: i64,
    /// When and how, the first time.
    pub detail: String,
    /// Name of the first episode's files.
    pub scenario: String,
}

/// The results of a run so far.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Totals {
    pub episodes: i64,
    pub collisions: i64,
    /// Collisions that the space's verdict counts.
    pub counted: i64,
    pub episodes_with_collision: i64,
    pub episodes_with_counted: i64,
    /// Episodes in which a requirement was breached.
    pub episodes_with_breach: i64,
    /// Counted collisions and breached requirements. A requirement counts once an episode.
    pub findings: i64,
    /// Those that were played again under other chance, and those of them that recur, as [`Recurrence::recurs`] says.
    pub replayed: i64,
    pub recurring: i64,
    /// Those of them that are counted collisions.
    pub counted_recurring: i64,
    pub arrived: i64,
    /// Ended without progress: for a reason of the driving system's own, because others blocked its way, and
    /// because it had left its lane.
    pub stalled: i64,
    /// Stalled without a collision: the driving system stopped by itself.
    pub stuck: i64,
    pub blocked: i64,
    pub astray: i64,
    /// Ended because the ego vehicle drove off the map.
    pub left_map: i64,
    /// Ended because an external driving system failed.
    pub failed: i64,
    pub step_limit: i64,
    pub simulated_s: f64,
    pub driven_m: f64,
    pub red_runs: i64,
    /// Episodes in which one was passed and nothing was found, so that no scenario is kept.
    pub red_unkept: i64,
    /// Mean time to the first counted collision over the episodes that have one, s: the paper's
    /// "TTC" (survivorship-biased, like the paper's).
    pub first_counted_s_mean: Option<f64>,
    /// Collisions with each of the facts that a verdict may exclude; one may have several.
    pub sudden: i64,
    pub struck: i64,
    pub repeated: i64,
    /// Collisions by their avoidability. The three numbers sum to `collisions`.
    pub avoidable: i64,
    pub beyond_reference: i64,
    pub unavoidable: i64,
    /// Collisions in which the ego vehicle had priority, and in which the other had; the rest is neither.
    pub wronged: i64,
    pub wrong: i64,
    /// Episodes in which other road users crashed into each other.
    pub others_crashed: i64,
}

fn step_table() -> String {
    let paper = VARIABLES[..STATE_LEN].iter();
    let states: Vec<String> =
        paper.map(|variable| format!("{} REAL NOT NULL", variable.observed_as)).collect();
    format!(
        "CREATE TABLE step (
           episode INTEGER NOT NULL REFERENCES episode, step INTEGER NOT NULL, time_s REAL NOT NULL,
           action_row INTEGER, action TEXT, refused TEXT, states TEXT, proc REAL NOT NULL, reward REAL NOT NULL,
           ttc_s REAL, thw_s REAL, drac_mps2 REAL, required_mps2 REAL, rss_unsafe_s REAL,
           top_speed_mps REAL,
           {}, others_crashed INTEGER NOT NULL, PRIMARY KEY (episode, step)) STRICT;",
        states.join(", ")
    )
}

/// An episode with its steps, its collisions and the text of its scenario, if one was written.
pub(crate) fn add_all(
    transaction: &Transaction,
    summary: &EpisodeSummary,
    log: &EpisodeLog,
    space: &Space,
    in_words: impl Fn(&Draw) -> String,
    scenario: Option<&str>,
) -> Result<(), DatabaseError> {
    add_episode(transaction, summary, log)?;
    for (index, step) in log.steps.iter().enumerate() {
        let (row, action, refused) = match &step.outcome {
            Outcome::Done { draw, .. } => (Some(draw.row), Some(in_words(draw)), None),
            Outcome::Passed => (None, None, None),
            Outcome::Refused { row, rule, reason } => (
                Some(*row),
                None,
                Some(rule.as_ref().map_or(reason.clone(), |rule| format!("{rule}: {reason}"))),
            ),
        };
        let mut values: Vec<rusqlite::types::Value> = vec![
            (summary.episode as i64).into(),
            (index as i64).into(),
            step.time_s.into(),
            row.map(|row| row as i64).into(),
            action.into(),
            refused.into(),
            own_states(space, &step.memory).into(),
            step.proc.into(),
            step.reward.into(),
        ];
        // A run measures this, a training does not.
        let measured = summary.criticality.get(index);
        values.extend([
            measured.and_then(|step| step.ttc_s).into(),
            measured.and_then(|step| step.thw_s).into(),
            measured.map(|step| step.drac_mps2).into(),
            measured.map(|step| step.required_mps2).into(),
            measured.map(|step| step.rss_unsafe_s).into(),
            summary.top_speeds_mps.get(index).copied().flatten().into(),
        ]);
        values.extend(step.state.iter().map(|&value| f64::from(value).into()));
        values.push(log.others_crashed_in(index).into());
        let places = vec!["?"; values.len()].join(", ");
        transaction
            .prepare_cached(&format!("INSERT INTO step VALUES ({places})"))?
            .execute(rusqlite::params_from_iter(values))?;
    }
    for (number, held) in log.held.iter().enumerate() {
        let values = params![summary.episode as i64, number as i64, held.from_s, held.text()];
        insert_row(transaction, "held", values)?;
    }
    for finding in &summary.collisions {
        add_collision(transaction, summary.episode, finding)?;
    }
    add_breaches(transaction, summary, log, space)?;
    if let Some(failure) = &log.failure {
        let Failure { problem, stage, detail, exit, stderr } = failure;
        let (kind, problem) = (problem.kind().name(), problem.name());
        let values = params![summary.episode as i64, kind, problem, stage, detail, exit, stderr];
        insert_row(transaction, "failure", values)?;
    }
    add_offers(transaction, summary)?;
    if let Some(text) = scenario {
        insert_row(transaction, "scenario", params![summary.episode as i64, text])?;
    }
    Ok(())
}

/// The breaches of an episode, and the smallest margin of each requirement, in SI.
fn add_breaches(
    transaction: &Transaction,
    summary: &EpisodeSummary,
    log: &EpisodeLog,
    space: &Space,
) -> Result<(), rusqlite::Error> {
    let episode = summary.episode;
    for (number, breach) in log.breaches.iter().enumerate() {
        let Breach { requirement, time_s, until_s, margin, step, obstacle } = *breach;
        let name = &space.requirements[requirement].name;
        let found = summary.breached.iter().find(|found| found.requirement == requirement);
        let kept_by = found.map(|found| found.kept_by.join(" "));
        let [recurred, replays] = in_columns(found.and_then(|found| found.recurrence));
        let (episode, number, step) = (episode as i64, number as i64, step as i64);
        let values = params![
            episode, number, name, time_s, until_s, step, margin, kept_by, recurred, replays, obstacle
        ];
        insert_row(transaction, "breach", values)?;
    }
    for Margin { requirement, smallest, asked_s } in &log.margins {
        let RequirementDef { name, margin, .. } = &space.requirements[*requirement];
        let unit = margin.map(|dimension| dimension.si_unit());
        insert_row(transaction, "margin", params![episode as i64, name, smallest, unit, asked_s])?;
    }
    Ok(())
}

/// The author's own states as they are after the action of a step, as a JSON object by cell: words, truth values, and numbers
/// in SI units. `None` in a space without any.
fn own_states(space: &Space, memory: &Memory) -> Option<String> {
    let own = space.states.iter().filter(|state| state.meaning == StateMeaning::Private);
    let cells = own.flat_map(|state| state.first_cell..state.first_cell + state.cells);
    let told: serde_json::Map<String, serde_json::Value> = cells
        .map(|cell| {
            let value = match memory.cells()[cell] {
                Value::Bool(truth) => truth.into(),
                Value::Number(number) if number.fract() == 0.0 => (number as i64).into(),
                Value::Number(number) => number.into(),
                Value::Variant(of, variant) => space.enums[of.0].variants[variant].as_str().into(),
            };
            (space.cell_name(cell), value)
        })
        .collect();
    (!told.is_empty()).then(|| serde_json::Value::Object(told).to_string())
}

fn add_offers(transaction: &Transaction, summary: &EpisodeSummary) -> Result<(), rusqlite::Error> {
    let mut known =
        transaction.prepare_cached("INSERT OR IGNORE INTO reason (reason, text) VALUES (?, ?)")?;
    let mut insert = transaction.prepare_cached(
        "INSERT INTO offer VALUES (?, ?, coalesce((SELECT reason FROM reason WHERE text = ?), 0), ?)",
    )?;
    for ((row, reason), steps) in &summary.offered.steps() {
        if let Some(reason) = reason {
            known.execute(params![reason_number(reason), reason])?;
        }
        insert.execute(params![summary.episode as i64, *row as i64, reason, steps])?;
    }
    Ok(())
}

/// The number of a reason: the beginning of its digest, so that it does not depend on which thread's episode is
/// written first. Never 0.
fn reason_number(text: &str) -> i64 {
    let digest: [u8; 32] = Sha256::digest(text.as_bytes()).into();
    let [a, b, c, d, e, f, g, h, ..] = digest;
    (i64::from_le_bytes([a, b, c, d, e, f, g, h]) & i64::MAX) | 1
}

fn add_episode(
    transaction: &Transaction,
    summary: &EpisodeSummary,
    log: &EpisodeLog,
) -> Result<(), rusqlite::Error> {
    let values = params![
        summary.episode as i64,
        log.road,
        log.seed.to_string(),
        log.end.name(),
        log.duration_s,
        log.distance_m,
        log.steps.len() as i64,
        log.red_runs,
        log.collisions.len() as i64,
        summary.counted() as i64,
        summary.first_counted_s(),
        avastra_lang::model::digest_text(&log.trace()),
        summary.pet_s,
    ];
    insert_row(transaction, "episode", values)
}

/// From its two columns; `None` where it was not tried, or where they do not belong together.
pub(crate) fn from_columns(recurred: Option<u32>, replays: Option<u32>) -> Option<Recurrence> {
    let found = Recurrence { recurred: recurred?, replays: replays? };
    (found.replays > 0 && found.recurred <= found.replays).then_some(found)
}

/// Its two columns, empty where it was not tried.
fn in_columns(recurrence: Option<Recurrence>) -> [Option<u32>; 2] {
    recurrence.map_or([None, None], |found| [Some(found.recurred), Some(found.replays)])
}

fn add_collision(
    transaction: &Transaction,
    episode: usize,
    finding: &Finding,
) -> Result<(), rusqlite::Error> {
    let Finding { collision, facts, judgement, .. } = finding;
    let contact = &collision.contact;
    let severity = oracle::severity(collision);
    let [recurred, replays] = in_columns(finding.recurrence);
    let values = params![
        episode as i64,
        finding.number as i64,
        contact.time_s,
        collision.step as i64,
        contact.obstacle,
        collision.body.like.name(),
        finding.own_body,
        collision.verb.name(),
        contact.ego_speed_mps,
        contact.closing_speed_mps,
        contact.on_ego.x,
        contact.on_ego.y,
        facts.repeated,
        facts.sudden,
        facts.struck,
        finding.counted,
        judgement.class.name(),
        judgement.onset_s,
        judgement.avoided_by.join(" "),
        judgement.evasion,
        severity.side,
        severity.approach,
        severity.relative_speed_mps,
        severity.delta_v_mps,
        severity.obstacle_delta_v_mps,
        finding.cause_in_words(),
        collision.shape.name(),
        collision.kind.name(),
        collision.kind.number(),
        facts.priority.name(),
        judgement.r157_letter.join(" "),
        severity.harm.name(),
        severity.harm_share,
        recurred,
        replays,
        contact.ruling.rule.name(),
        contact.ruling.time_s,
        contact.ruling.mover.name(),
        finding.unmet.join("; "),
    ];
    insert_row(transaction, "collision", values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_differ_by_their_words() {
        let reason = "no_teleport: the gap would be 12.5 m, a fair one is 17 m";
        assert_eq!(without_figures(reason), "no_teleport: the gap would be … m, a fair one is … m");
        assert_eq!(without_figures("cannot spawn: no lane on the left"), "cannot spawn: no lane on the left");
        let median = "cannot spawn: a median of 3.2 m lies before the opposing lane";
        assert_eq!(without_figures(median), "cannot spawn: a median lies before the opposing lane");
        assert_eq!(without_figures("no crossing leg within 60 m"), "no crossing leg");
    }
}
