//! Verdicts that were labelled by hand (`tests/cases/verdicts`). Each file is one situation with the priority, the blame
//! and the avoidability that an engineer would sign, and a sentence that says why. A verdict that changes shows here, and
//! the change is reviewed like that of a snapshot.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use avastra::action::ActionTable;
use avastra::model::{Avoidability, Claim, Scenario};
use avastra::run::{Stage, on_threads, recorded};

use crate::cases::{entries, name, root};
use crate::world::{read, run_of};

/// The folder with a folder for each family of situations.
const AREA: &str = "tests/cases/verdicts";
/// The family of situations that are judged otherwise than their labels say.
const DISPUTED: &str = "disputed";
const THREADS: usize = 2;

/// What the replay of a situation shows.
struct Shown {
    path: PathBuf,
    /// What its label lacks.
    missing: Vec<&'static str>,
    /// The claims that do not hold, each with what was found.
    refuted: Vec<String>,
}

#[test]
fn situations_are_judged_as_labelled() {
    let settled = families().into_iter().filter(|name| name != DISPUTED);
    let paths: Vec<PathBuf> = settled.flat_map(|name| files(&name)).collect();
    assert!(paths.len() >= 200, "{} situations", paths.len());
    let wrong =
        show_all(&paths).into_iter().filter(|shown| !shown.missing.is_empty() || !shown.refuted.is_empty());
    let told = wrong
        .map(|shown| format!("{}: without {:?}, {:?}", shown.path.display(), shown.missing, shown.refuted));
    let told: Vec<String> = told.collect();
    assert!(told.is_empty(), "{}", told.join("\n"));
}

/// A disputed situation that is judged as labelled belongs to its family.
#[test]
fn disputed_situations_are_still_disputed() {
    for shown in show_all(&files(DISPUTED)) {
        assert!(shown.missing.is_empty(), "{}: without {:?}", shown.path.display(), shown.missing);
        assert!(!shown.refuted.is_empty(), "{} is settled: move it to its family", shown.path.display());
    }
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

/// The names of the families, sorted.
fn families() -> Vec<String> {
    entries(root().join(AREA)).iter().filter(|path| path.is_dir()).map(|path| name(path)).collect()
}

/// The situations of a family, sorted.
fn files(family: &str) -> Vec<PathBuf> {
    let folder = root().join(AREA).join(family);
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

fn show_all(paths: &[PathBuf]) -> Vec<Shown> {
    let mut all = Vec::new();
    let work = |path: &PathBuf, tell: &mut dyn FnMut(Shown) -> bool| {
        tell(show(path));
    };
    let mut keep = |shown| -> Result<(), ()> {
        all.push(shown);
        Ok(())
    };
    on_threads(paths, THREADS, &AtomicBool::new(false), work, &mut keep).expect("nothing here fails");
    assert_eq!(all.len(), paths.len());
    all
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
    let log = stage.play(&ads, &mut |_, _, _| {});
    let results = stage.verify(&ads, &log);
    let refuted = results.iter().filter(|result| result.confirmed != Some(true));
    let refuted = refuted.map(|result| format!("{}, found {}", result.claim, result.found)).collect();
    Shown { path: path.to_owned(), missing: missing(&scenario), refuted }
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
