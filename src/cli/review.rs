//! Compares a scenario's claims about its world with the present. The space, the engine and the driving system may have
//! changed since it was written. It is played again as they are now, each difference is said in words, and an updated text
//! is made. Only differing parts of the file are replaced: digests, the engine, the driving system, and claims that do not
//! hold any more. Claims that an author took out stay out.

use std::ops::Range;
use std::sync::Arc;

use avastra_campaign::emit;
use avastra_campaign::episode::{EpisodeLog, Outcome, Script};
use avastra_campaign::oracle::{self, ClaimResult};
use avastra_campaign::run::{Asked, EpisodeSummary, RunError, Stage, recorded_traffic};
use avastra_drivers::external;
use avastra_lang::model::vocabulary::Word;
use avastra_lang::model::{Avoidability, Claim, Scenario};
use avastra_lang::syntax::ast::{self, ClauseKind, Doc, Expect, ExprKind, FileId, Span};
use avastra_world::action::ActionTable;
use avastra_world::sim::ENGINE;

use super::error::Failure;

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

/// A scenario's file with these `fields` of its origin taken from another text of it. The other text's claims replace the
/// refuted ones. Everything else stays: other claims, comments, ends of lines.
fn rewritten(text: &str, anew: &str, is_refuted: &[bool], fields: &[&str]) -> String {
    let (old_file, new_file) = (parsed(text), parsed(anew));
    let (Some((old, old_docs)), Some((new, new_docs))) = (scenario_of(&old_file), scenario_of(&new_file))
    else {
        return text.to_owned();
    };
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for name in fields {
        edits.extend(field_edit(name, (text, old), (anew, new)));
    }
    edits.extend(claim_edits((text, &old.expects), (anew, &new.expects), is_refuted));
    // The sentence above it tells of the crash, unless the author wrote another one.
    if let ([old], [new]) = (old_docs, new_docs)
        && is_refuted.contains(&true)
        && old.text.contains(" is hit at ")
    {
        edits.push((range(old.span), anew[range(new.span)].to_owned()));
    }
    edits.sort_by_key(|(range, _)| range.start);
    let line_end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    let mut result = String::with_capacity(text.len());
    let mut at = 0;
    for (range, with) in edits {
        // Two fields that go, side by side, may both claim the comma between them.
        result.push_str(&text[at..range.start.max(at)]);
        result.push_str(&with.replace('\n', line_end));
        at = range.end.max(at);
    }
    result + &text[at..]
}

/// The subject of a claim: its kind, and the number of the obstacle or the requirement.
type About<'a> = (&'a str, Option<&'a str>);

/// Replaces claims that do not hold. The new claim is of the same kind and about the same obstacle, or else about an
/// obstacle for which the file has no claim of that kind. A claim without such a replacement goes.
fn claim_edits(
    (text, old): (&str, &[Expect]),
    (anew, new): (&str, &[Expect]),
    is_refuted: &[bool],
) -> Vec<(Range<usize>, String)> {
    let claimed: Vec<About> = old.iter().map(about).collect();
    let mut left: Vec<(About, &Expect)> = new.iter().map(|expect| (about(expect), expect)).collect();
    let refuted = old.iter().zip(&claimed).zip(is_refuted).filter(|(_, is_refuted)| **is_refuted);
    let edit = |((expect, known), _): ((&Expect, &About), &bool)| {
        let is_new = |found: &About| found.0 == known.0 && !claimed.contains(found);
        let same = left.iter().position(|(found, _)| found == known);
        match same.or_else(|| left.iter().position(|(found, _)| is_new(found))) {
            Some(at) => (range(expect.span), anew[range(left.remove(at).1.span)].to_owned()),
            None => (with_separator(text, range(expect.span)), String::new()),
        }
    };
    refuted.map(edit).collect()
}

fn about(expect: &Expect) -> About<'_> {
    let kind = match &expect.claim.kind {
        ExprKind::Name(name) if Avoidability::from_name(name).is_some() => "avoidable",
        ExprKind::Name(name) => name,
        ExprKind::Field { .. } => return about_requirement(&expect.claim),
        ExprKind::Binary { left, .. } => match &left.kind {
            ExprKind::Name(name) => name,
            ExprKind::Field { .. } => return about_requirement(left),
            _ => "",
        },
        _ => "",
    };
    let with = expect.clauses.iter().find(|clause| clause.kind == ClauseKind::With);
    let number = with.and_then(|clause| match &clause.value.kind {
        ExprKind::Numbered { number, .. } => Some(number.as_str()),
        _ => None,
    });
    (kind, number)
}

/// `NAME.breached`: a claim about one requirement is not about another.
fn about_requirement(claim: &ast::Expr) -> About<'_> {
    match &claim.kind {
        ExprKind::Field { base, field } => match &base.kind {
            ExprKind::Name(requirement) => (&field.text, Some(requirement)),
            _ => (&field.text, None),
        },
        _ => ("", None),
    }
}

/// How one field of an origin becomes what it is now.
fn field_edit(
    name: &str,
    (text, old): (&str, &ast::Scenario),
    (anew, new): (&str, &ast::Scenario),
) -> Option<(Range<usize>, String)> {
    let find = |scenario: &ast::Scenario| {
        let field = scenario.origin.iter().find(|field| field.name.text == name);
        field.map(|field| range(field.span))
    };
    match (find(old), find(new)) {
        (Some(old), Some(new)) => {
            (text[old.clone()] != anew[new.clone()]).then(|| (old, anew[new].to_owned()))
        }
        (Some(old), None) => Some((with_separator(text, old), String::new())),
        (None, Some(new)) => {
            let end = old.origin.last()?.span.end;
            Some((end..end, format!("\n    {}", &anew[new])))
        }
        (None, None) => None,
    }
}

/// A field with what parts it from its neighbours: its line, if that has nothing else, or a comma.
fn with_separator(text: &str, field: Range<usize>) -> Range<usize> {
    let before = text[..field.start].trim_end_matches([' ', '\t']);
    let after = text[field.end..].trim_start_matches([' ', '\t', ',']);
    let line_before = before.strip_suffix('\n').map(|before| before.strip_suffix('\r').unwrap_or(before));
    if let Some(before) = line_before
        && (after.is_empty() || after.starts_with(['\r', '\n']))
    {
        return before.len()..text.len() - after.len();
    }
    let is_last = !text[field.end..].trim_start().starts_with(',');
    match before.strip_suffix(',') {
        Some(before) if is_last => before.len()..field.end,
        _ => field.start..text.len() - after.len(),
    }
}

fn range(span: Span) -> Range<usize> {
    span.start..span.end
}

fn parsed(text: &str) -> ast::File {
    avastra_lang::syntax::parse(FileId::default(), text).0
}

fn scenario_of(file: &ast::File) -> Option<(&ast::Scenario, &[Doc])> {
    file.items.iter().find_map(|item| Some((item.kind.as_scenario()?, item.docs.as_slice())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_goes_with_its_line_or_with_its_comma() {
        let without = |text: &str| {
            let start = text.find("ads").expect("it is there");
            let mut text = text.to_owned();
            text.replace_range(with_separator(&text, start..start + "ads: cc".len()), "");
            text
        };
        assert_eq!(without("origin {\n    ads: cc,\n    seed: 1\n}"), "origin {\n    seed: 1\n}");
        assert_eq!(without("origin { ads: cc, seed: 1 }"), "origin { seed: 1 }");
        assert_eq!(without("origin { seed: 1, ads: cc }"), "origin { seed: 1 }");
        assert_eq!(without("origin { a: 1, ads: cc, seed: 1 }"), "origin { a: 1, seed: 1 }");
        assert_eq!(without("a: 1,\r\n  ads: cc,\r\n  b: 2"), "a: 1,\r\n  b: 2");
    }

    const OLD: &str = "\
language 1
/// Sedan npc#1 (DriveAhead) is hit at 3.0 s.
scenario s {
  road: corner
  steps { 0: wait() }
  // who
  expect collision with npc#1 at 3.00 s
  // how
  expect counted with npc#1
  expect avoidable by [cc] with npc#1 // by hand
  expect minimal with npc#1
  expect proc == [0.1]
}
";
    const NEW: &str = "\
language 1
/// SUV npc#2 (Stand) is hit at 4.0 s.
scenario s {
  road: corner
  steps { 0: wait() }
  expect collision with npc#2 at 4.00 s
  expect counted with npc#2
  expect unavoidable with npc#2
  expect priority == ego with npc#2
  expect proc == [
    0.2,
    0.3,
  ]
  expect trace == \"sha256:0\"
}
";

    #[test]
    fn claims_about_another_crash_take_the_place_of_those_about_the_one() {
        let now = rewritten(OLD, NEW, &[true; 5], &PLAYED_IN);
        let (_, claims) = now.split_once("wait() }\n").unwrap();
        let wanted = "  // who
  expect collision with npc#2 at 4.00 s
  // how
  expect counted with npc#2
  expect unavoidable with npc#2 // by hand
  expect proc == [
    0.2,
    0.3,
  ]
}
";
        assert_eq!(claims, wanted);
        // A file keeps its ends of lines.
        let crlf = |text: &str| text.replace('\n', "\r\n");
        assert_eq!(rewritten(&crlf(OLD), NEW, &[true; 5], &PLAYED_IN), crlf(&now));
    }
}
