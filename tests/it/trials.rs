//! Every row on every road does what it says, or the result says why not.

use avastra::action::ActionTable;
use avastra::report;
use avastra::run::{Arena, driving_system};
use avastra::trial::{Cell, Outcome, TrialSettings, Trials};

use crate::cases::expect_snapshot;
use crate::world::space;

/// Cells by row, then by road.
fn cells(name: &str, settings: TrialSettings) -> Vec<Cell> {
    let table = ActionTable::new(space(name));
    let roads: Vec<String> = table.space().roads.iter().map(|road| road.name.clone()).collect();
    let arena =
        Arena::new(table, &roads, driving_system("modular").unwrap(), &[], &[]).expect("all of it is there");
    Trials::new(&arena, settings).cells(&|| {})
}

/// Least share of the trials of a verb, over all rows and roads, that do what they say before the ego vehicle
/// arrives. Overtakers may not drive faster than the limit, at which the ego vehicle drives as well, so most of
/// them have not passed when the time is over.
const REALISED_PART_MIN: [(&str, f64); 5] = [
    ("pedestrian", 0.9),
    ("drive_ahead", 0.9),
    ("drive_opposite", 0.9),
    ("cross_road", 0.9),
    ("overtake", 0.2),
];

#[test]
fn every_row_does_what_it_says_or_it_is_said_why_not() {
    let cells = cells("avastra45.ava", TrialSettings { drives: 6, tries: 3, seed: 1 });
    for cell in &cells {
        let trial = format!("{} on {}", cell.label, cell.road);
        let failed: usize = cell.failures.iter().map(|failure| failure.count).sum();
        let refused: usize = cell.refusals.iter().map(|refusal| refusal.count).sum();
        assert_eq!(cell.realised + failed, cell.tried, "{trial}");
        assert_eq!(cell.legal + refused, cell.moments, "{trial}");
        assert_eq!(cell.outcome == Outcome::Masked, cell.legal == 0, "{trial}");
        assert!(cell.unfair.is_empty(), "{trial}: {:?}", cell.unfair);
        // These complaints must never occur, however the trial ends.
        let wild = |why: &str| why.starts_with("it drives") || why.starts_with("it does not appear");
        assert!(!cell.failures.iter().any(|failure| wild(&failure.reason)), "{trial}: {:?}", cell.failures);
    }
    for (verb, part_min) in REALISED_PART_MIN {
        let of_verb = || cells.iter().filter(|cell| cell.label.starts_with(verb));
        let arrived = of_verb().flat_map(|cell| &cell.failures);
        let arrived = arrived.filter(|failure| failure.reason.starts_with("the ego vehicle was at its goal"));
        let arrived: usize = arrived.map(|failure| failure.count).sum();
        let tried = of_verb().map(|cell| cell.tried).sum::<usize>() - arrived;
        let realised: usize = of_verb().map(|cell| cell.realised).sum();
        assert!(realised as f64 >= part_min * tried as f64, "{verb}: {realised} of {tried}");
    }
    expect_snapshot("tables", "avastra45_trials", &report::trials(&cells));
}

#[test]
fn no_vehicle_comes_across_a_median() {
    let cells = cells("avastra45.ava", TrialSettings { drives: 2, tries: 1, seed: 3 });
    let far =
        cells.iter().filter(|cell| cell.road == "boulevard" && cell.label.starts_with("drive_opposite"));
    let widths =
        far.flat_map(|cell| &cell.refusals).filter(|refusal| refusal.reason.contains("a median of 20."));
    assert!(widths.count() >= 4);
}
