//! Compares a scenario's claims about its world with the present. The space, the engine and the driving system may have
//! changed since it was written. It is played again as they are now, each difference is said in words, and an updated text
//! is made. Only differing parts of the file are replaced: digests, the engine, the driving system, and claims that do not
//! hold any more. Claims that an author took out stay out.

use std::sync::Arc;

use avastra_campaign::emit;
use avastra_campaign::episode::{EpisodeLog, Outcome, Script};
use avastra_campaign::oracle::{self, ClaimResult};
use avastra_campaign::run::{Asked, EpisodeSummary, RunError, Stage, recorded_traffic};
use avastra_drivers::external;
use avastra_lang::model::{Claim, Scenario};
use avastra_world::action::ActionTable;
use avastra_world::sim::ENGINE;

use super::error::Failure;
use super::rewritten::rewritten;

/// Fields of an origin that say which driving system drove.
const DRIVEN_BY: [&str; 4] = ["ads", "profile", "profile_digest", "answers"];

/// Fields of an origin that say in which world it drove.
const PLAYED_IN: [&str; 2] = ["engine", "traffic_digest"];

/// How what a scenario is about differs from what the scenario says; the larger difference comes later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    Same,
    /// The same at the same time, by a drive that is not the same to the bit.
    OtherDrive,
    OtherTime,
    OtherVerdict,
    OtherObstacle,
    /// No collision counts any more, or a step is not legal any more: what is played is another scenario.
    Gone,
}

impl Change {
    pub fn in_words(self) -> &'static str {
        match self {
            Change::Same => "same",
            Change::OtherDrive => "same finding, another drive",
            Change::OtherTime => "same finding, other time",
            Change::OtherVerdict => "same finding, other verdict",
            Change::OtherObstacle => "another crash",
            Change::Gone => "gone",
        }
    }
}

/// The result of playing a scenario as things are now.
pub struct Review {
    pub change: Change,
    /// Each difference in words.
    pub differences: Vec<String>,
    /// Which step is not legal any more, and why.
    pub illegal: Option<String>,
    /// The present state; `None` if the finding is gone.
    pub now: Option<Now>,
}

/// The content of a scenario's files if the present state is accepted.
pub struct Now {
    pub text: String,
    /// The text of its file of answers; `None` if there is none, or if the one that is there holds as it is.
    pub answers: Option<Arc<str>>,
}

/// Plays a scenario as things are now: against the driving system that is asked for, or else the recorded one. `text` is its
/// file's, with the digest that its space has now.
///
/// # Errors
/// If it cannot be played: its driving system, rules or traffic do not exist any more.
pub fn review(
    table: &ActionTable,
    scenario: &Scenario,
    asked: &Asked,
    text: &str,
) -> Result<Review, Failure> {
    let mut scenario = scenario.clone();
    let mut differences = as_now(&mut scenario);
    let (ads, is_recorded) = match asked.selected_for(&scenario) {
        Err(RunError::ProfileDigest { .. }) => {
            scenario.origin.profile_digest = None;
            differences.push("the settings of its driving system mean something else by now".to_owned());
            (asked.selected_for(&scenario)?.0, false)
        }
        found => {
            let (ads, is_recorded) = found?;
            if !is_recorded {
                differences.push(format!("played against {} as asked for", ads.name()));
            }
            (ads, is_recorded)
        }
    };
    let stage = Stage::new(table, &scenario)?;
    let log = stage.play(&ads, &mut |_, _, _| {});
    let illegal = illegal(&log);
    differences.extend(illegal.clone());
    let results = stage.verify(&ads, &log);
    // Before those of the claims stand those of illegal steps.
    let results = &results[results.len() - scenario.claims.len()..];
    let refuted = || scenario.claims.iter().zip(results).filter(|(_, result)| result.is_refuted());

    // A scenario that claims neither collision nor breach, but how its driving system fails, has nothing to be rewritten by.
    if !scenario.claims.iter().any(Claim::is_of_a_collision) && scenario.breached().next().is_none() {
        let is_same = refuted().count() == 0 && illegal.is_none();
        let change = if is_same { Change::Same } else { Change::Gone };
        differences.extend(refuted().map(|(_, result)| in_words(result)));
        let is_kept = change == Change::Gone || !is_recorded;
        // Such a scenario is a whole episode: if it ends as it did, its answers are those that are recorded.
        let now = (!is_kept).then(|| Now { text: text.to_owned(), answers: None });
        return Ok(Review { change, differences, illegal, now });
    }

    let setup = stage.setup(&ads);
    let episode = scenario.origin.episode.unwrap_or(0) as usize;
    let mut summary = EpisodeSummary::judged(&setup, episode, &log);
    summary.find_keepers(&setup, &log);
    let replays = stage.most_replays();
    summary.find_recurrence(&setup, &Script::of_scenario(&scenario), &log, replays);
    let change = match &illegal {
        None => change(&scenario, (&log, &summary), table, results),
        // Whatever it crashes with: it is not this scenario that does.
        Some(_) => Change::Gone,
    };
    let told = refuted().filter(|(claim, _)| !matches!(claim, Claim::Proc(_) | Claim::Trace(_)));
    differences.extend(told.map(|(_, result)| in_words(result)));
    if change == Change::Gone {
        return Ok(Review { change, differences, illegal, now: None });
    }
    differences.extend(newly_hit(&scenario, &summary));
    let claims = |is: fn(&Claim) -> bool| scenario.claims.iter().any(is);
    if claims(|claim| matches!(claim, Claim::Cause { .. })) {
        summary.find_causes(&setup, &log).map_err(Failure::usage)?;
    }
    if claims(|claim| matches!(claim, Claim::Minimal { .. })) {
        let judgements: Vec<_> = summary.collisions.iter().map(|found| found.judgement.clone()).collect();
        for found in summary.collisions.iter_mut().filter(|found| found.counted) {
            found.minimal = oracle::spare_steps(&setup, &log, found.number, &judgements, replays).is_empty();
        }
    }
    let source = emit::Provenance {
        command: "test",
        name: &scenario.name,
        space_path: "",
        episode,
        agent: scenario.origin.policy.as_deref().unwrap_or("none"),
        without: &scenario.origin.without,
        with: &scenario.origin.with,
    };
    let told_anew = avastra_lang::syntax::print(&emit::retold(table, &log, &summary, &source));
    let is_refuted: Vec<bool> = results.iter().map(ClaimResult::is_refuted).collect();
    let is_kept = answers_hold(&scenario, &log);
    let fields = if is_kept { PLAYED_IN.to_vec() } else { [&DRIVEN_BY[..], &PLAYED_IN].concat() };
    let conversation = log.conversation.as_deref().filter(|_| !is_kept);
    let answers = conversation.map(|conversation| external::to_text(&conversation.exchanges).into());
    let now = Now { text: rewritten(text, &told_anew, &is_refuted, &fields), answers };
    Ok(Review { change, differences, illegal, now: Some(now) })
}

/// Whether the recorded answers hold for a log: it has the same driving system and the same answers, as far as it goes. The
/// recorded ones may go on, because they are those of the whole episode, and a scenario is cut after its last crash.
fn answers_hold(scenario: &Scenario, log: &EpisodeLog) -> bool {
    let origin = &scenario.origin;
    let (Some(conversation), Some(text)) = (log.conversation.as_deref(), origin.recorded_answers.as_deref())
    else {
        return false;
    };
    origin.profile_digest.as_deref() == Some(conversation.attached.digest().as_str())
        && external::from_text(text, origin.answers.as_deref())
            .is_ok_and(|recorded| conversation.begins(&recorded))
}

/// Gives a scenario the present engine and traffic as its origin, and returns what has changed, in words.
pub fn as_now(scenario: &mut Scenario) -> Vec<String> {
    let mut differences = Vec::new();
    let origin = &mut scenario.origin;
    if let Some(engine) = origin.engine.replace(ENGINE.to_owned()).filter(|engine| engine != ENGINE) {
        differences.push(format!("the world is `{ENGINE}` in place of `{engine}`"));
    }
    if matches!(recorded_traffic(scenario), Err(RunError::TrafficDigest { .. })) {
        scenario.origin.traffic_digest = None;
        differences.push("the settings of its traffic mean something else by now".to_owned());
    }
    differences
}

/// The first step that is refused: without it, what is played is another scenario.
fn illegal(log: &EpisodeLog) -> Option<String> {
    log.steps.iter().enumerate().find_map(|(number, step)| match &step.outcome {
        Outcome::Refused { rule, reason, .. } => {
            let rule = rule.as_ref().map_or(String::new(), |rule| format!("rule `{rule}`: "));
            Some(format!("step {number} is not legal any more, because {rule}{reason}"))
        }
        Outcome::Done { .. } | Outcome::Passed => None,
    })
}

fn in_words(result: &ClaimResult) -> String {
    format!("{}: {}", result.claim, result.found)
}

/// The largest difference between what a scenario claims and what was found.
fn change(
    scenario: &Scenario,
    (log, summary): (&EpisodeLog, &EpisodeSummary),
    table: &ActionTable,
    results: &[ClaimResult],
) -> Change {
    let is_breached = |claim: &Claim| match claim {
        Claim::Breach { requirement, .. } => log.breach_of(table.space(), requirement).is_some(),
        _ => false,
    };
    let mut counted = summary.collisions.iter().filter(|found| found.counted).peekable();
    let is_of_breaches = !scenario.claims.iter().any(Claim::is_of_a_collision);
    let crashes = counted.peek().is_some() && !is_of_breaches;
    if !crashes && !scenario.claims.iter().any(is_breached) {
        return Change::Gone;
    }
    if crashes && !counted.any(|found| scenario.crashes_with(found.collision.contact.obstacle)) {
        return Change::OtherObstacle;
    }
    let is_hit =
        |number: u32| summary.collisions.iter().any(|found| found.collision.contact.obstacle == number);
    let of = |(claim, result): (&Claim, &ClaimResult)| match claim {
        _ if !result.is_refuted() => Change::Same,
        Claim::Collision { obstacle: Some(obstacle), .. } if !is_hit(obstacle.number) => {
            Change::OtherObstacle
        }
        Claim::Proc(_) | Claim::Trace(_) | Claim::End(_) | Claim::Minimal { .. } => Change::OtherDrive,
        Claim::Collision { .. } => Change::OtherTime,
        Claim::Breach { .. } if is_breached(claim) => Change::OtherTime,
        Claim::Breach { .. } | Claim::Kept { .. } => Change::OtherVerdict,
        Claim::Recurrence { .. } => Change::OtherDrive,
        Claim::Verdict { .. } | Claim::Avoidability { .. } | Claim::Cause { .. } | Claim::Priority { .. } => {
            Change::OtherVerdict
        }
    };
    scenario.claims.iter().zip(results).map(of).max().unwrap_or(Change::Same)
}

/// Obstacles that are hit now and were not.
fn newly_hit(scenario: &Scenario, summary: &EpisodeSummary) -> Vec<String> {
    let was_hit = |number: u32| {
        scenario.claims.iter().any(|claim| match claim {
            Claim::Collision { obstacle, .. } => obstacle.is_none_or(|obstacle| obstacle.number == number),
            Claim::Verdict { obstacle, .. }
            | Claim::Avoidability { obstacle, .. }
            | Claim::Cause { obstacle, .. }
            | Claim::Priority { obstacle, .. }
            | Claim::Recurrence { obstacle, .. }
            | Claim::Minimal { obstacle } => obstacle.is_some_and(|obstacle| obstacle.number == number),
            Claim::Proc(_) | Claim::Trace(_) | Claim::End(_) | Claim::Breach { .. } | Claim::Kept { .. } => {
                false
            }
        })
    };
    let contacts = summary.collisions.iter().map(|found| &found.collision.contact);
    let new = contacts.filter(|contact| !was_hit(contact.obstacle));
    new.map(|contact| format!("npc#{} is hit at {:.2} s", contact.obstacle, contact.time_s)).collect()
}
