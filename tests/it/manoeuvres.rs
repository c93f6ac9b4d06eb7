//! Manoeuvres against closed forms: when each phase begins, how long it takes, where it ends.

use avastra::action::ActionTable;
use avastra::episode::{Choice, Moment};
use avastra::geometry::SMOOTH_STEP_SLOPE_MAX;
use avastra::model::NpcFacts;
use avastra::sim::DT_S;

use crate::wishes::{number, row, wish};
use crate::world::{assert_replays, run_of};

/// A lane change is at its place within this distance, m.
const PLACE_M: f64 = 0.05;

/// What was known of a road user at the ticks of an episode, until the ego vehicle touched something.
struct Seen {
    /// When, s, and what.
    moments: Vec<(f64, NpcFacts)>,
    /// The values that were drawn, by name.
    drawn: Vec<f64>,
}

/// Plays episodes in which the first legal offers of these rows are taken, one after another, and looks at the first road
/// user that appears. `names` are the values of the last row that are wanted.
fn watched(table: &ActionTable, rows: &[&str], names: &[&str], episodes: u64) -> Vec<Seen> {
    let rows: Vec<usize> = rows.iter().map(|label| row(table, label)).collect();
    let run = run_of(table.space().clone(), 8, episodes, &[]);
    let mut found = Vec::new();
    for episode in 0..run.episodes() {
        let (mut done, mut drawn) = (0, Vec::new());
        let mut choose = |moment: &Moment| {
            let Some(&wanted) = rows.get(done) else { return Choice::Pass };
            let Ok(draw) = table.offer(moment.situation, wanted) else { return Choice::Pass };
            done += 1;
            if done == rows.len() {
                drawn = names.iter().map(|name| number(&draw, name)).collect();
            }
            Choice::Act(draw)
        };
        let (mut moments, mut is_whole) = (Vec::new(), true);
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            is_whole &= contacts.is_empty();
            moments.extend(world.npc_facts(1).filter(|_| is_whole).map(|facts| (world.time_s(), facts)));
        });
        assert_replays(&run, episode, &log);
        if done == rows.len() {
            found.push(Seen { moments, drawn });
        }
    }
    found
}

#[test]
fn a_car_cuts_in_when_it_is_near_and_takes_the_time_of_its_lane_change() {
    let table = wish("cuts_in");
    let mut changes = 0;
    for Seen { moments, drawn } in watched(&table, &["cuts_in(from: Right)"], &["ttc", "aside"], 12) {
        let [ttc_s, aside_mps] = drawn[..] else { panic!("two values were drawn") };
        // It begins in the tick after the one at whose end it was near enough.
        let Some(begin) = moments.iter().position(|(_, npc)| npc.ttc_s <= ttc_s) else { continue };
        let (begin_s, before) = moments[begin];
        let aside_m = before.offset_m.abs();
        let takes_s = SMOOTH_STEP_SLOPE_MAX * aside_m / aside_mps;
        let after = moments[begin..].iter().find(|(at_s, _)| at_s - begin_s >= takes_s + DT_S);
        let Some((_, after)) = after else { continue };
        assert!(after.offset_m.abs() < PLACE_M, "{after:?} after {takes_s} s");
        let halfway = moments[begin..].iter().find(|(at_s, _)| at_s - begin_s >= takes_s / 2.0);
        let (_, halfway) = halfway.expect("it comes before the end");
        let within_m = PLACE_M + aside_mps * DT_S;
        assert!((halfway.offset_m.abs() - aside_m / 2.0).abs() < within_m, "{halfway:?}");
        let speed = |pair: &[(f64, NpcFacts)]| (pair[1].1.offset_m - pair[0].1.offset_m).abs() / DT_S;
        let fastest = moments.windows(2).map(speed).fold(0.0, f64::max);
        assert!(
            (fastest - aside_mps).abs() < 0.02 * aside_mps,
            "{fastest} m/s of {aside_mps} m/s to the side"
        );
        changes += 1;
    }
    assert!(changes >= 3, "{changes} cars cut in");
}

#[test]
fn phases_wait_for_their_rules() {
    let table = wish("cuts_in");
    let space = table.space();
    let gap_m = |npc: &NpcFacts, ego_front_m: f64| npc.rear_m - ego_front_m;
    let mut begun = 0;
    for without in [&[][..], &["not_too_near"]] {
        let run = run_of(space.clone(), 8, 12, without);
        for episode in 0..run.episodes() {
            let cuts_in = row(&table, "cuts_in(from: Left)");
            let mut is_asked = true;
            let mut choose = |moment: &Moment| match table.offer(moment.situation, cuts_in) {
                Ok(draw) if core::mem::take(&mut is_asked) => Choice::Act(draw),
                _ => Choice::Pass,
            };
            // The gap at the tick before the car first moved to the side.
            let (mut before_m, mut begun_m) = (f64::INFINITY, None);
            let log = run.play(episode, &mut choose, &mut |world, _, _| {
                let Some(npc) = world.npc_facts(1) else { return };
                if begun_m.is_none() && npc.offset_m < 3.499 {
                    begun_m = Some(before_m);
                }
                before_m = gap_m(&npc, world.moment_facts().ego_front_m);
            });
            assert_replays(&run, episode, &log);
            let Some(begun_m) = begun_m else { continue };
            assert!(begun_m >= 3.8, "it began {begun_m} m ahead");
            begun += usize::from(without.is_empty());
        }
    }
    assert!(begun >= 3, "{begun} cut in under the rule");
}

#[test]
fn a_cyclist_swerves_round_a_van_and_comes_back() {
    let table = wish("cyclist_swerves");
    let run = run_of(table.space().clone(), 2, 3, &[]);
    let mut passed = 0;
    for episode in 0..run.episodes() {
        let mut choose = |moment: &Moment| match table.offer(moment.situation, 0) {
            Ok(draw) if moment.step == 0 => Choice::Act(draw),
            _ => Choice::Pass,
        };
        // Of the cyclist: when it began to swerve, and its places beside the middle of its lane before, beside and behind the van.
        let (mut begun_m, mut beside, mut after) = (None, Vec::new(), Vec::new());
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            let (Some(van), Some(cyclist)) = (world.npc_facts(1), world.npc_facts(2)) else { return };
            let lane_m = cyclist.offset_m + 3.5;
            let to_van_m = van.rear_m - cyclist.front_m;
            if begun_m.is_none() && (lane_m + 1.0).abs() > 1e-6 {
                begun_m = Some(to_van_m);
            }
            if cyclist.front_m > van.rear_m && cyclist.rear_m < van.front_m {
                beside.push(lane_m);
            }
            if cyclist.rear_m > van.front_m + 20.0 {
                after.push(lane_m);
            }
            assert!(world.incidents().is_empty(), "it touches the van");
        });
        assert_replays(&run, episode, &log);
        let begun_m = begun_m.expect("it swerves");
        assert!((19.5..=20.0).contains(&begun_m), "{begun_m} m before the van");
        assert!(!beside.is_empty() && beside.iter().all(|lane_m| (lane_m - 1.2).abs() < 1e-9), "{beside:?}");
        passed += usize::from(after.iter().all(|lane_m| (lane_m + 1.0).abs() < 1e-9) && !after.is_empty());
    }
    assert_eq!(passed, 2, "cyclists came back");
}

#[test]
fn an_ambulance_passes_red_lights_and_is_the_only_one_that_does() {
    let table = wish("ambulance");
    let rows = ["ambulance(from: Left)", "ambulance(from: Right)"].map(|label| row(&table, label));
    let run = run_of(table.space().clone(), 16, 3, &[]);
    let (mut came, mut ran_red) = (0, 0);
    for episode in 0..run.episodes() {
        let mut choose = |moment: &Moment| {
            let breakers = moment.situation.surroundings.moment().rule_breakers;
            let legal = rows.iter().find_map(|row| table.offer(moment.situation, *row).ok());
            assert!(legal.is_none() || breakers == 0, "{breakers} break rules already");
            came += usize::from(legal.is_some());
            legal.map_or(Choice::Pass, Choice::Act)
        };
        let mut is_running = false;
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            is_running |= world.obstacles().any(|other| world.runs_red(other.id));
        });
        assert_replays(&run, episode, &log);
        ran_red += usize::from(is_running);
    }
    assert!(came > 0 && ran_red > 0, "{came} came, {ran_red} episodes with a red light passed");
}
