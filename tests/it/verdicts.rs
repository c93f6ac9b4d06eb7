//! Verdicts that were labelled by hand (`tests/cases/verdicts`). Each file is one situation with the priority, the blame
//! and the avoidability that an engineer would sign, and a sentence that says why. A verdict that changes shows here, and
//! the change is reviewed like that of a snapshot.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Mutex;

use avastra::action::ActionTable;
use avastra::model::vocabulary::Word;
use avastra::model::{Avoidability, Claim, Scenario};
use avastra::oracle::Judgement;
use avastra::run::{Stage, recorded};
use avastra::sim::Contact;

use crate::cases::{cases, expect_snapshot, root, try_each};
use crate::world::{read, run_of};

/// The family of situations that are judged otherwise than their labels say.
const DISPUTED: &str = "disputed/";

/// A disputed situation that is judged as labelled belongs to its family.
#[test]
fn situations_are_judged_as_labelled() {
    assert!(cases("verdicts").len() >= 200);
    let families: Mutex<BTreeMap<String, BTreeSet<String>>> = Mutex::default();
    try_each("verdicts", |name, path| {
        let Shown { missing, refuted, in_full } = show(path);
        let (family, case) = name.split_once('/').expect("each stands in a family");
        let mut families = families.lock().expect("nothing fails while it is held");
        families.entry(family.to_owned()).or_default().insert(format!("{case}\n{in_full}"));
        drop(families);
        assert!(missing.is_empty(), "its label lacks {missing:?}");
        match name.starts_with(DISPUTED) {
            false => assert!(refuted.is_empty(), "{refuted:?}"),
            true => assert!(!refuted.is_empty(), "it is settled: move it to its family"),
        }
    });
    // A label says what; the snapshot also says when, by which rule and by whom it would have been avoided.
    for (family, cases) in families.into_inner().expect("nothing failed while it was held") {
        expect_snapshot("verdicts", &family, &cases.into_iter().collect::<String>());
    }
}

/// What the replay of a situation shows.
struct Shown {
    /// What its label lacks.
    missing: Vec<&'static str>,
    /// The claims that do not hold, each with what was found.
    refuted: Vec<String>,
    /// The verdict on each collision, a line each.
    in_full: String,
}

/// A driver that takes over after a lane change of the route stays in the lane that it is in: it neither swerves into one
/// that stands there, nor takes it to be beside its way.
#[test]
fn people_who_stand_in_plain_view_can_be_avoided_after_a_lane_change_too() {
    let loaded =
        avastra::check::load(&root().join("tests/cases/faults/statues.ava"), &read).expect("it is there");
    let run = run_of(loaded.space.expect("a space without mistakes is a space"), 15, 5, &[]);
    let mut hits = 0;
    for number in 0..run.episodes() {
        for found in run.judged(number).0.collisions {
            let (class, by) = (found.judgement.class, &found.judgement.avoided_by);
            assert_eq!(class, Avoidability::Avoidable, "episode {number}, by {by:?}");
            hits += 1;
        }
    }
    assert!(hits >= 5, "{hits} hits show little");
}

/// Plays a situation and checks its claims.
fn show(path: &Path) -> Shown {
    let loaded = avastra::check::load(path, &read).expect("it is there");
    let (Some(space), Some(scenario)) = (loaded.space, loaded.scenario) else {
        panic!("{}: {:?}", path.display(), loaded.diagnostics)
    };
    let table = ActionTable::new(space);
    let stage = Stage::new(&table, &scenario).expect("it is of this engine");
    let ads = recorded(&scenario).expect("its driving system exists");
    let (log, judgements, _) = stage.first_found(&ads);
    let results = stage.verify(&ads, &log);
    let refuted = results.iter().filter(|result| result.confirmed != Some(true));
    let refuted = refuted.map(|result| format!("{}, found {}", result.claim, result.found)).collect();
    let in_full = log.collisions.iter().zip(&judgements).map(|(collision, judgement)| {
        let Contact { obstacle, time_s, ruling, .. } = collision.contact;
        let Judgement { class, onset_s, avoided_by, r157_letter, evasion } = judgement;
        format!(
            "  #{obstacle} at {time_s:.2} s: {} by {} at {:.2} s ({}); {} from {onset_s:.2} s by {}, to the letter by {}, {}; {}\n",
            ruling.priority.name(),
            ruling.rule.name(),
            ruling.time_s,
            ruling.mover.name(),
            class.name(),
            avoided_by.join(" "),
            r157_letter.join(" "),
            evasion.as_deref().unwrap_or("no evasion"),
            collision.kind.name(),
        )
    });
    Shown { missing: missing(&scenario), refuted, in_full: in_full.collect() }
}

/// What the label of a situation lacks: a sentence, or one of the claims.
fn missing(scenario: &Scenario) -> Vec<&'static str> {
    let claims = |wanted: &dyn Fn(&Claim) -> bool| scenario.claims.iter().any(wanted);
    let verdict =
        |wanted: &str| claims(&|claim| matches!(claim, Claim::Verdict { name, .. } if name == wanted));
    let begins = |words: &str| scenario.docs.first().is_some_and(|line| line.trim_start().starts_with(words));
    let is_class = |claim: &Claim| matches!(claim, Claim::Avoidability { .. });
    let told = [
        ("the collision", claims(&|claim| matches!(claim, Claim::Collision { .. }))),
        ("the priority", claims(&|claim| matches!(claim, Claim::Priority { .. }))),
        ("the blame", verdict("is_struck") != verdict("not_struck")),
        ("the avoidability", claims(&is_class) != verdict("not_avoidable")),
        ("a sentence that says what counts", begins("Counts: ") != begins("Does not count: ")),
        ("the claim that it counts", verdict("counted") == begins("Counts: ")),
        ("the claim that it does not count", verdict("excused") == begins("Does not count: ")),
    ];
    told.into_iter().filter(|(_, is_told)| !is_told).map(|(what, _)| what).collect()
}
