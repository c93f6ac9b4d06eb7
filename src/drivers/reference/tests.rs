//! The published cut-in grid, recomputed from the equations.

use super::driver::Model;
use super::encounter::Encounter;
use super::r157::{CarefulHuman, FuzzySafety, MinimalPerformance};
use super::reflex::{Braking, Reflex};
use super::rss::Rss;

/// Length of the cars of the grid, m. Lateral gap between two in the middle of lanes of 3.5 m. Time between looks, s.
const LENGTH_M: f64 = 5.0;
const SIDE_GAP_M: f64 = 1.6;
const LOOK_S: f64 = 0.1;

/// A car in the next lane, `gap_m` ahead, moves over at once at a constant lateral speed.
#[derive(Debug, Clone, Copy)]
struct CutIn {
    own_kmph: f64,
    other_kmph: f64,
    lateral_mps: f64,
    gap_m: f64,
}

/// Whether a driver of the model touches the car that cuts in, on a straight road at 10 Hz.
///
/// The published simulation moves with the speed at the end of a look, and moves both cars once before
/// the first decision. Some cases lie so near to the grid's borders that both matter.
fn crashes(model: &impl Model, braking: Braking, cut_in: CutIn) -> bool {
    let mut reflex = Reflex::new(braking);
    let (mut own_mps, mut own_mps2) = (cut_in.own_kmph / 3.6, 0.0);
    let other_mps = cut_in.other_kmph / 3.6;
    let mut gap_m = cut_in.gap_m + (other_mps - own_mps) * LOOK_S;
    let mut side_gap_m = SIDE_GAP_M - cut_in.lateral_mps * LOOK_S;
    let over_m = SIDE_GAP_M - 3.5;
    for _ in 0..200 {
        let encounter = Encounter {
            gap_m,
            side_gap_m,
            towards_mps: if side_gap_m > over_m { cut_in.lateral_mps } else { 0.0 },
            own_mps,
            own_mps2,
            other_mps,
            other_mps2: 0.0,
            aside_m: SIDE_GAP_M - side_gap_m,
            lengths_m: 2.0 * LENGTH_M,
            crosses: false,
            meeting_s: None,
        };
        let deceleration_mps2 = reflex.step(model.demand_mps2(&encounter), LOOK_S);
        let next_mps = (own_mps - deceleration_mps2 * LOOK_S).max(0.0);
        own_mps2 = (next_mps - own_mps) / LOOK_S;
        gap_m += (other_mps - next_mps) * LOOK_S;
        own_mps = next_mps;
        side_gap_m = (side_gap_m - cut_in.lateral_mps * LOOK_S).max(over_m);
        if side_gap_m < 0.0 && gap_m < 0.0 && gap_m > -2.0 * LENGTH_M {
            return true;
        }
    }
    false
}

/// Which models crash: FSM, RSS, the regulation's minimum, the careful human. The published grid reads the
/// regulation so that the human notices a cut-in when it is in the way, without evaluation.
fn grid(cut_in: CutIn) -> [bool; 4] {
    let rss = Rss::default();
    [
        crashes(&FuzzySafety, FuzzySafety.braking(), cut_in),
        crashes(&rss, rss.braking(), cut_in),
        crashes(&MinimalPerformance, MinimalPerformance.braking(), cut_in),
        crashes(
            &CarefulHuman::default(),
            Braking { evaluation_s: 0.0, ..CarefulHuman::default().braking() },
            cut_in,
        ),
    ]
}

#[test]
fn the_cut_in_grid_is_the_published_one() {
    let slow = |gap_m| CutIn { own_kmph: 50.0, other_kmph: 30.0, lateral_mps: 1.0, gap_m };
    let fast = |gap_m| CutIn { own_kmph: 60.0, other_kmph: 20.0, lateral_mps: 1.8, gap_m };
    let cases = [
        (slow(5.0), [true, true, true, true]),
        (slow(8.0), [true, true, true, true]),
        (slow(10.0), [false, false, true, true]),
        (slow(12.0), [false, false, false, true]),
        (slow(15.0), [false, false, false, true]),
        (slow(20.0), [false, false, false, false]),
        (slow(30.0), [false, false, false, false]),
        (fast(10.0), [true, true, true, true]),
        (fast(20.0), [true, true, true, true]),
        (fast(25.0), [false, false, false, true]),
        (fast(30.0), [false, false, false, false]),
        (fast(40.0), [false, false, false, false]),
    ];
    for (cut_in, expected) in cases {
        assert_eq!(grid(cut_in), expected, "FSM, RSS, R157, human in {cut_in:?}");
    }
}

#[test]
fn a_cut_in_must_be_avoided_from_the_regulations_time_on() {
    for (closing_kmph, time_s) in [(10.0, 0.58), (30.0, 1.04), (60.0, 1.74)] {
        let found_s = super::r157::avoidable_from_s(closing_kmph / 3.6);
        assert!((found_s - time_s).abs() < 0.005, "{closing_kmph}: {found_s}");
    }
}

#[test]
fn a_careful_human_needs_the_published_distance() {
    // A standing obstacle in the way: 0.4 s, 0.75 s at 0.4 m/s², then 12.65 m/s³ up to 7.593 m/s².
    // The published figures leave out the released accelerator, so they are an upper bound.
    for (speed_kmph, published_m) in
        [(10.0, 4.4), (20.0, 10.0), (30.0, 16.5), (40.0, 24.1), (50.0, 32.7), (60.0, 42.4)]
    {
        let mut reflex = Reflex::new(CarefulHuman::default().braking());
        let (mut speed_mps, mut way_m): (f64, f64) = (speed_kmph / 3.6, 0.0);
        while speed_mps > 0.0 {
            let next_mps = (speed_mps - reflex.step(9.0, 0.001) * 0.001).max(0.0);
            way_m += (speed_mps + next_mps) / 2.0 * 0.001;
            speed_mps = next_mps;
        }
        assert!(way_m < published_m + 0.05 && way_m > 0.9 * published_m, "{speed_kmph}: {way_m}");
    }
}
