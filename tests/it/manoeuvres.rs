//! Manoeuvres against closed forms: when each phase begins, how long it takes, where it ends. And an audit of random spaces.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use avastra::action::{ActionTable, Draw, Effect, Situation};
use avastra::ads;
use avastra::episode::{Choice, Moment, Outcome};
use avastra::geometry::{
    Pose, SMOOTH_STEP_SLOPE_MAX, Vec2, distance_m, smooth_step, unit_vector, wrap_angle,
};
use avastra::model::vocabulary::{Light, Priority, ShownLights};
use avastra::model::{NpcFacts, RulesInForce};
use avastra::rng;
use avastra::rng::{Rng, Stream};
use avastra::sim::{DT_S, Obstacle, Scene, Sensed, Start, VehicleParameters, World};

use crate::wishes::{number, row, wish};
use crate::world::{assert_replays, loaded, run_against, run_of, space};

/// What a dry road grips, m/s².
const GRIP_MPS2: f64 = 0.85 * 9.81;
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
fn watched(table: &ActionTable, rows: &[&str], names: &[&str], episodes: u64, without: &[&str]) -> Vec<Seen> {
    let rows: Vec<usize> = rows.iter().map(|label| row(table, label)).collect();
    let run = run_of(table.space().clone(), 8, episodes, without);
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
    for Seen { moments, drawn } in
        watched(&table, &["cuts_in(from: Right)"], &["ttc", "aside"], 12, &["not_too_near"])
    {
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

/// Two smooth steps against each other, of which the second begins half way through the first.
#[test]
fn who_thinks_better_of_a_lane_change_goes_back() {
    let table = wish("thinks_better_of_it");
    let mut returns = 0;
    for Seen { moments, drawn } in watched(&table, &["goes_back()"], &["back"], 8, &[]) {
        let back_mps = drawn[0];
        let (_, first) = moments[0];
        let Some(begin) = moments.iter().position(|(_, npc)| npc.offset_m < first.offset_m - 1e-6) else {
            continue;
        };
        let Some(half) = moments.iter().position(|(_, npc)| npc.offset_m <= 1.75) else { continue };
        let (begin_s, half_s) = (moments[begin - 1].0, moments[half].0);
        let out_s = 2.0 * (half_s - begin_s);
        let back_s = SMOOTH_STEP_SLOPE_MAX * 3.5 / back_mps;
        // The second one begins with the tick after the one in which the middle was reached.
        for (at_s, npc) in &moments[half + 1..] {
            let out = smooth_step((at_s - begin_s) / out_s).value;
            let back = smooth_step((at_s - half_s) / back_s).value;
            let wanted_m = 3.5 * (1.0 - out + back);
            assert!((npc.offset_m - wanted_m).abs() < PLACE_M, "{npc:?} at {at_s} s: {wanted_m} m");
        }
        let (_, last) = moments.last().expect("it is there");
        returns += usize::from((last.offset_m - 3.5).abs() < 1e-6);
    }
    assert!(returns >= 4, "{returns} cars came back");
}

#[test]
fn who_stands_before_a_junction_turns_in_time() {
    let table = wish("turns_in_time");
    let mut turns = 0;
    for Seen { moments, drawn } in watched(&table, &["turns_in_time()"], &["arrival"], 12, &[]) {
        let Some(begin) = moments.iter().position(|(_, npc)| npc.speed_mps > 0.0) else { continue };
        // What the ego vehicle has still to go grows less by as much as it drives, and is below 0 behind the place.
        assert!(
            moments[..begin].iter().all(|(_, npc)| npc.crossing_ahead_m > 0.0 && npc.crossing_ahead_m < 40.0)
        );
        let ahead = |at: usize| moments[at].1.ego_crossing_ahead_m;
        let ego_mps = (ahead(begin - 2) - ahead(begin - 1)) / DT_S;
        let arrival_s = ahead(begin - 1) / ego_mps;
        assert!((arrival_s - drawn[0]).abs() < 0.05, "{arrival_s} s of {} s", drawn[0]);
        turns += 1;
    }
    assert!(turns >= 3, "{turns} cars turned");
}

#[test]
fn who_follows_a_way_beside_the_route_passes_its_points() {
    let table = wish("walks_round_a_van");
    let mut walks = 0;
    for Seen { moments, .. } in watched(&table, &["walks_round()"], &[], 8, &[]) {
        let middle = |npc: &NpcFacts| ((npc.front_m + npc.rear_m) / 2.0, npc.offset_m);
        let (begin_m, _) = middle(&moments[0].1);
        let (_, last) = moments.last().expect("it is there");
        if last.offset_m < 4.0 - PLACE_M {
            continue;
        }
        for (along_m, offset_m) in [(10.0, -2.0), (4.0, -1.5), (0.0, 0.0), (0.0, 4.0)] {
            let away_m = moments.iter().map(|(_, npc)| {
                let (here_m, left_m) = middle(npc);
                libm::hypot(here_m - begin_m + 10.0 - along_m, left_m - offset_m)
            });
            assert!(away_m.fold(f64::INFINITY, f64::min) < PLACE_M, "{along_m} m, {offset_m} m");
        }
        walks += 1;
    }
    assert!(walks >= 6, "{walks} walks");
}

#[test]
fn one_keeps_its_gap_to_another_that_slows_down() {
    let table = wish("drives_in_convoy");
    let run = run_of(table.space().clone(), 8, 4, &[]);
    let mut kept = 0;
    for episode in 0..run.episodes() {
        let gap_m = Cell::new(None);
        let mut choose = |moment: &Moment| match table.offer(moment.situation, row(&table, "convoy()")) {
            Ok(draw) if gap_m.get().is_none() => {
                gap_m.set(Some(number(&draw, "gap")));
                Choice::Act(draw)
            }
            _ => Choice::Pass,
        };
        let mut worst_m = 0.0_f64;
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            let (Some(car), Some(truck)) = (world.npc_facts(1), world.npc_facts(2)) else { return };
            let wanted_m = gap_m.get().expect("it was drawn");
            // The truck brakes and gains speed at 1 m/s², and the car follows it critically damped (1 rad/s / 2): it is never
            // farther off than a second-order system behind a ramp of its speed, 1 / 0.25 m.
            if contacts.is_empty() && car.front_m > 0.0 {
                worst_m = worst_m.max((truck.rear_m - car.front_m - wanted_m).abs());
            }
        });
        assert_replays(&run, episode, &log);
        assert!(worst_m < 4.0, "{worst_m} m");
        kept += usize::from(worst_m > 0.1);
    }
    assert!(kept >= 3, "in {kept} episodes the truck slowed down");
}

#[test]
fn as_many_of_a_row_appear_as_are_asked_for() {
    let table = wish("queue_of_some");
    for cars in 1..=4 {
        let run = run_of(table.space().clone(), 8, 2, &["longer_at_night"]);
        for episode in 0..run.episodes() {
            let mut is_done = false;
            let label = format!("queue(cars: {cars})");
            let mut choose = |moment: &Moment| match table.offer(moment.situation, row(&table, &label)) {
                Ok(draw) if !is_done => {
                    is_done = true;
                    Choice::Act(draw)
                }
                _ => Choice::Pass,
            };
            let mut most = 0;
            let log =
                run.play(episode, &mut choose, &mut |world, _, _| most = most.max(world.obstacles().count()));
            assert_replays(&run, episode, &log);
            assert_eq!(most, if is_done { cars } else { 0 });
        }
    }
}

#[test]
fn who_is_to_cross_early_is_placed_so_for_the_present_speeds() {
    let table = wish("meets_within_half_a_second");
    let mut met = 0;
    for label in ["runs(from: Left)", "runs(from: Right)"] {
        for Seen { moments, drawn } in watched(&table, &[label], &["by", "speed"], 12, &[]) {
            let (first, next) = (&moments[0].1, &moments[1].1);
            let ego_mps = (first.ego_crossing_ahead_m - next.ego_crossing_ahead_m) / DT_S;
            let own_mps = (first.crossing_ahead_m - next.crossing_ahead_m) / DT_S;
            assert!(own_mps <= drawn[1] + 1e-6, "{own_mps} m/s");
            let Some(passes) = moments.windows(2).position(|pair| {
                let [(_, before), (_, after)] = pair else { unreachable!("pairs") };
                before.crossing_ahead_m < 1.0 && after.crossing_ahead_m > before.crossing_ahead_m
            }) else {
                continue;
            };
            // Of a way that crosses the route twice, nobody says which place is meant.
            if moments[passes + 1].1.crossing_ahead_m < 1000.0 {
                continue;
            }
            let early_s = first.ego_crossing_ahead_m / ego_mps - (moments[passes].0 - moments[0].0);
            // A bend on its way makes it a little sooner.
            let is_straight =
                moments[..=passes].iter().all(|(_, npc)| (npc.speed_mps - drawn[1]).abs() < 0.01);
            let most_s = if is_straight { 0.15 } else { 0.4 };
            assert!((early_s - drawn[0]).abs() < most_s, "{early_s} s, wanted {} s", drawn[0]);
            met += 1;
        }
    }
    assert!(met >= 6, "{met} meetings");
}

#[test]
fn a_light_turns_yellow_when_the_ego_vehicle_is_so_near() {
    let table = wish("yellow_at_the_wrong_moment");
    let run = run_of(table.space().clone(), 8, 24, &[]);
    let mut turned = 0;
    for episode in 0..run.episodes() {
        let at_m = Cell::new(None);
        let mut choose = |moment: &Moment| match table.offer(moment.situation, row(&table, "turns_yellow()"))
        {
            Ok(draw) if at_m.get().is_none() => {
                at_m.set(Some(number(&draw, "at")));
                Choice::Act(draw)
            }
            _ => Choice::Pass,
        };
        let (mut before, mut begins) = (None, None);
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            let Some(at_m) = at_m.get() else { return };
            let facts = world.moment_facts();
            let line_m =
                world.scene().route.stop_lines.iter().find(|line| line.station_m >= world.ego_station_m());
            let away_m = line_m.map_or(f64::INFINITY, |line| line.station_m - facts.ego_front_m);
            if before == Some(Light::Green) && facts.ego_light == Light::Yellow && begins.is_none() {
                begins = Some((away_m, at_m, facts.ego_light_times.since_s, facts.ego_speed_mps));
            }
            before = Some(facts.ego_light);
        });
        assert_replays(&run, episode, &log);
        let Some((away_m, at_m, since_s, ego_mps)) = begins else { continue };
        assert!(away_m <= at_m && at_m - away_m <= ego_mps * 2.0 * DT_S, "{away_m} m, wanted {at_m} m");
        assert!(since_s <= DT_S, "yellow for {since_s} s");
        turned += 1;
    }
    assert!(turned >= 3, "{turned} lights");
}

#[test]
fn who_joins_changes_before_its_lane_ends_and_in_the_time_that_it_is_given() {
    let table = wish("joins_and_changes_in_time");
    let mut joined = 0;
    for Seen { moments, drawn } in watched(&table, &["truck_joins()"], &["left", "takes"], 8, &[]) {
        let [left_m, takes_s] = drawn[..] else { panic!("two values") };
        // What is left of its lane is what it does not drive.
        for pair in moments.windows(2).filter(|pair| pair[1].1.lane_left_m < 1000.0) {
            let [(_, before), (_, after)] = pair else { unreachable!("pairs") };
            let driven_m = after.front_m - before.front_m;
            assert!((before.lane_left_m - after.lane_left_m - driven_m).abs() < 0.01, "{before:?} {after:?}");
        }
        let Some(begin) = moments.iter().position(|(_, npc)| npc.lane_left_m <= left_m) else { continue };
        let Some(end) = moments.iter().position(|(_, npc)| npc.offset_m.abs() < 1e-9) else { continue };
        let took_s = moments[end].0 - moments[begin].0;
        assert!((took_s - takes_s).abs() <= 3.0 * DT_S, "{took_s} s, wanted {takes_s} s");
        joined += 1;
    }
    assert!(joined >= 4, "{joined} trucks joined");
}

#[test]
fn lights_are_shown_as_they_are_told() {
    for (name, label, expected) in [
        ("queue_with_hazard_lights", "queue()", &[(1, ShownLights::Hazard)][..]),
        ("tailgates_and_flashes", "tailgater()", &[(1, ShownLights::Flash), (1, ShownLights::Left)][..]),
    ] {
        let table = wish(name);
        let run = run_of(table.space().clone(), 8, 1, &[]);
        let mut is_done = false;
        let mut choose = |moment: &Moment| match table.offer(moment.situation, row(&table, label)) {
            Ok(draw) if !is_done => {
                is_done = true;
                Choice::Act(draw)
            }
            _ => Choice::Pass,
        };
        let mut shown = Vec::new();
        let log = run.play(0, &mut choose, &mut |world, _, _| {
            for obstacle in world.obstacles().filter(|obstacle| obstacle.lights != ShownLights::Off) {
                let one = (obstacle.id, obstacle.lights);
                if shown.last() != Some(&one) {
                    shown.push(one);
                }
                let sensed = world.sensed();
                let seen = sensed.objects.iter().find(|object| object.id == obstacle.id);
                assert!(seen.is_none_or(|object| object.lights == obstacle.lights));
            }
        });
        assert_replays(&run, 0, &log);
        assert_eq!(shown, expected, "{name}");
    }
}

#[test]
fn one_brakes_after_the_one_before_it() {
    let table = wish("brakes_in_turn");
    let (mut seen, run) = (0, run_of(table.space().clone(), 8, 6, &[]));
    for episode in 0..run.episodes() {
        let mut drawn = None;
        let mut choose = |moment: &Moment| match table.offer(moment.situation, row(&table, "row()")) {
            Ok(draw) if drawn.is_none() => {
                drawn = Some((number(&draw, "rate"), number(&draw, "reaction")));
                Choice::Act(draw)
            }
            _ => Choice::Pass,
        };
        // When each of the two begins to brake, s, and its hardest braking.
        let (mut begun_s, mut hardest_mps2) = ([None; 2], [0.0_f64; 2]);
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            assert!(contacts.is_empty() || begun_s.iter().all(Option::is_some));
            for (at, id) in [2, 1].into_iter().enumerate() {
                let Some(facts) = world.npc_facts(id).filter(|_| contacts.is_empty()) else { continue };
                if facts.acceleration_mps2 < -1.0 {
                    begun_s[at] = begun_s[at].or(Some(world.time_s()));
                }
                hardest_mps2[at] = hardest_mps2[at].min(facts.acceleration_mps2);
            }
        });
        assert_replays(&run, episode, &log);
        let (Some((rate_mps2, reaction_s)), [Some(first_s), Some(last_s)]) = (drawn, begun_s) else {
            continue;
        };
        assert!(
            (last_s - first_s - reaction_s).abs() <= 2.5 * DT_S,
            "{first_s} s, {last_s} s, {reaction_s} s"
        );
        assert!((hardest_mps2[0] + rate_mps2).abs() < 0.01, "{hardest_mps2:?} of {rate_mps2}");
        assert!((hardest_mps2[1] + rate_mps2 + 1.0).abs() < 0.01, "{hardest_mps2:?} of {rate_mps2}");
        seen += 1;
    }
    assert!(seen >= 4, "{seen} rows braked");
}

#[test]
fn a_lane_and_a_place_in_it_are_one_move() {
    let table = wish("filters");
    let mut moves = 0;
    for Seen { moments, drawn } in watched(&table, &["motorcycle()"], &["aside"], 6, &[]) {
        let Some(begin) = moments.iter().position(|(_, npc)| npc.offset_m < 2.0 - 1e-6) else { continue };
        // From 1.5 m to the right of the middle of the left lane, 3.5 m away, to the middle of this one.
        let takes_s = SMOOTH_STEP_SLOPE_MAX * 2.0 / drawn[0];
        let (begin_s, _) = moments[begin - 1];
        let Some(end) = moments.iter().find(|(at_s, _)| at_s - begin_s >= takes_s + DT_S) else { continue };
        assert!(end.1.offset_m.abs() < PLACE_M, "{end:?} after {takes_s} s");
        for pair in moments[begin..].windows(2) {
            let [(_, before), (_, after)] = pair else { panic!("pairs") };
            let moved_m = before.offset_m - after.offset_m;
            assert!((-1e-6..=drawn[0] * DT_S * 1.02).contains(&moved_m), "{before:?} {after:?}");
            assert!(after.offset_m > -PLACE_M, "it overshoots: {after:?}");
        }
        moves += 1;
    }
    assert!(moves >= 3, "{moves} motorcycles came in");
}

#[test]
fn phases_wait_for_their_rules() {
    let table = wish("cuts_in");
    let space = table.space();
    let gap_m = |npc: &NpcFacts, ego_front_m: f64| npc.rear_m - ego_front_m;
    let (mut begun, mut near) = (0, 0);
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
            assert!(!without.is_empty() || begun_m >= 7.8, "it began {begun_m} m ahead");
            begun += usize::from(without.is_empty());
            near += usize::from(begun_m < 7.8);
        }
    }
    assert!(begun >= 3 && near > 0, "{begun} cut in under the rule, {near} nearer without it");
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
        // How far before the van the cyclist began to swerve, and its offset in its lane beside the van and behind it.
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
    let (mut came, mut ran) = (0, 0);
    for episode in 0..run.episodes() {
        let mut choose = |moment: &Moment| {
            let breakers = moment.situation.surroundings.moment().rule_breakers;
            let legal = rows.iter().find_map(|row| table.offer(moment.situation, *row).ok());
            assert!(legal.is_none() || breakers == 0.0, "{breakers} break rules already");
            came += usize::from(legal.is_some());
            legal.map_or(Choice::Pass, Choice::Act)
        };
        let mut is_running = false;
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            is_running |= world.obstacles().any(|other| world.runs_signal(other.id));
        });
        assert_replays(&run, episode, &log);
        ran += usize::from(is_running);
    }
    assert!(came > 0 && ran > 0, "{came} came, {ran} episodes in which a light or sign was run");
}

#[test]
fn who_runs_into_a_siren_had_to_wait() {
    let table = wish("siren");
    let (mut came, mut ran, mut hit) = (0, 0, 0);
    for ads in ["idm", "modular", "reactive"] {
        let run = run_against(ads, table.space().clone(), 24, 3, &[]);
        for episode in 0..run.episodes() {
            let mut choose = |moment: &Moment| {
                let legal = (0..2).find_map(|row| table.offer(moment.situation, row).ok());
                came += usize::from(legal.is_some());
                legal.map_or(Choice::Pass, Choice::Act)
            };
            let mut is_running = false;
            let log = run.play(episode, &mut choose, &mut |world, _, _| {
                assert_eq!(world.moment_facts().rule_breakers, 0.0);
                is_running |= world.obstacles().any(|other| world.runs_signal(other.id));
            });
            assert_replays(&run, episode, &log);
            ran += usize::from(is_running);
            for collision in &log.collisions {
                assert_ne!(collision.contact.ruling.priority, Priority::Ego, "{ads}: {collision:?}");
                hit += usize::from(collision.contact.ruling.priority == Priority::Other);
            }
        }
    }
    assert!(came > 30 && ran > 0 && hit > 0, "{came} came, {ran} ran a red light, {hit} were hit");
}

#[test]
fn phases_come_as_often_as_they_are_repeated() {
    let table = wish("stops_again");
    let mut by_times = BTreeSet::new();
    for seen in watched(&table, &["stops()"], &["times"], 12, &[]) {
        let speeds = seen.moments.iter().map(|(_, npc)| npc.speed_mps);
        let stands: Vec<bool> = speeds.map(|speed_mps| speed_mps == 0.0).collect();
        let stops = stands.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        let last = seen.moments.last().expect("it came").1;
        let times = seen.drawn[0] as usize;
        assert!(stops <= times, "{stops} stops, {times} were drawn");
        // It may leave, or the episode may end, before.
        if stops == times && last.speed_mps > 5.9 {
            by_times.insert(times);
        }
    }
    assert_eq!(by_times, BTreeSet::from([1, 2, 3]), "how often they stopped");
    let (table, mut whole) = (wish("weaves"), 0);
    for seen in watched(&table, &["weaves()"], &[], 4, &[]) {
        let places = seen.moments.iter().map(|(_, npc)| npc.offset_m);
        // In a bend a long vehicle's middle is not where its axles are.
        let outside: Vec<f64> = places.filter(|offset_m| offset_m.abs() > 0.3).map(f64::signum).collect();
        let sides = 1 + outside.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(sides <= 6, "{sides} sides");
        whole += usize::from(sides == 6);
    }
    assert!(whole > 0, "nobody weaved three times");
}

#[test]
fn who_is_told_to_turn_does_so_at_the_next_junction() {
    let across: (&[&str], f64) = (&["turns_across()"], 1.0);
    turn_as_told(&wish("turns_across"), &[across]);
    let plans: [(&[&str], f64); 5] = [
        (&["drives()", "goes(way: Left)"], 1.0),
        (&["drives()", "goes(way: Right)"], -1.0),
        (&["drives()", "goes(way: Straight)"], 0.0),
        (&["drives()", "goes(way: Left)", "turns_and_stops(turn: Left)"], 1.0),
        (&["drives()", "goes(way: Right)", "turns_and_stops(turn: Right)"], -1.0),
    ];
    turn_as_told(&wish("turns_as_told"), &plans);
}

/// Whether who does what the rows say, one after another, has turned so, to the left above 0, behind the junction.
fn turn_as_told(table: &ActionTable, plans: &[(&[&str], f64)]) {
    let run = run_of(table.space().clone(), 15, 3, &[]);
    for &(plan, left) in plans {
        let (mut passed, mut stood) = (0, 0);
        for episode in 0..run.episodes() {
            let done = Cell::new(0);
            let mut choose = |moment: &Moment| {
                let Some(label) = plan.get(done.get()) else { return Choice::Pass };
                let Ok(draw) = table.offer(moment.situation, row(table, label)) else { return Choice::Pass };
                done.set(done.get() + 1);
                Choice::Act(draw)
            };
            // Its headings, rad, in the first junction that it comes to after it was told, until somebody touches somebody.
            let mut headings_rad = Vec::new();
            let (mut last_rad, mut most_mps2) = (None, 0.0_f64);
            let (mut has_touched, mut is_out, mut is_past) = (false, false, false);
            let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
                has_touched |= !contacts.is_empty() || !world.incidents().is_empty();
                let Some(other) = world.obstacle(1).filter(|_| !has_touched) else { return };
                let Pose { heading_rad, .. } = other.outline.pose;
                let map = &world.scene().map;
                let is_in_junction = |pose: Pose| {
                    let place = map.nearest(pose.position, heading_rad, 1.0);
                    place.is_some_and(|place| map.lane(place.lane).junction.is_some())
                };
                let is_inside = is_in_junction(other.outline.pose);
                // However late it was told, it does not turn faster than it would have by itself.
                let yaw_rps = wrap_angle(heading_rad - last_rad.unwrap_or(heading_rad)) / DT_S;
                most_mps2 = most_mps2.max(yaw_rps.abs() * other.velocity_mps.norm());
                last_rad = Some(heading_rad);
                let front = other.outline.pose.offset(other.outline.half_length_m, 0.0);
                is_out |= done.get() == plan.len() && !is_inside && !is_in_junction(front);
                is_past |= !headings_rad.is_empty() && !is_inside;
                if is_out && is_inside && !is_past {
                    headings_rad.push(heading_rad);
                }
                stood += usize::from(is_past && other.velocity_mps.norm() == 0.0);
            });
            assert_replays(&run, episode, &log);
            assert!(most_mps2 < 6.0, "{plan:?} in episode {episode}: {most_mps2} m/s²");
            if let ([first, .., last], true) = (&headings_rad[..], is_past) {
                let turned_rad = wrap_angle(last - first);
                passed += 1;
                let is_right = if left == 0.0 {
                    turned_rad.abs() < 0.7
                } else {
                    (0.7..2.6).contains(&(left * turned_rad))
                };
                // By the time of a third row it may have turned already; a phase then waits for the next lane that leads there.
                assert!(is_right || plan.len() == 3, "{plan:?} in episode {episode}: {turned_rad} rad");
            }
        }
        assert!(passed > 0, "nobody came to a junction by {plan:?}");
        assert_eq!(stood > 0, plan.len() == 3, "{stood} ticks at rest after the turn of {plan:?}");
    }
}

#[test]
fn an_adult_is_met_at_the_point_that_was_asked_for() {
    let table = wish("adult_at_a_point");
    let space = table.space();
    let (road, rules) = (&space.roads[0], RulesInForce::by_default(space));
    let scene = Arc::new(Scene::of(road));
    let memory = space.initial_memory(1);
    let mut met = 0;
    for seed in 0..4 {
        for (row, part) in [0.25, 0.5, 0.75].into_iter().enumerate() {
            let mut world = World::new(Arc::clone(&scene), &Start::drawn(space, road, &memory, seed));
            let situation = Situation {
                memory: &memory,
                road,
                rules: &rules,
                surroundings: &world,
                seed,
                step: 0,
                happened_s: &[],
            };
            let draw = table.offer(&situation, row).expect("there is room");
            world.carry_out(&draw).expect("there is room");
            let mut driver = (ads::by_name("idm").expect("it is one of ours").build)(&scene, seed);
            let contact = loop {
                // It does not see who walks there, and keeps its speed.
                let sensed = Sensed { objects: Vec::new(), ..world.sensed() };
                let control = driver.drive(&sensed);
                if let Some(contact) = world.tick(&control).first() {
                    break *contact;
                }
                assert!(world.time_s() < 30.0, "{part}: nobody was met");
            };
            let width_m = VehicleParameters::MKZ.width_m;
            // From the right.
            let wanted_m = (part - 0.5) * width_m;
            let walker = world.obstacle(1).expect("it was hit").outline.pose.position;
            let hit_m = world.ego_outline().pose.to_local(walker).y;
            assert!((hit_m - wanted_m).abs() < PLACE_M, "{part}: {hit_m} m, not {wanted_m} m; {contact:?}");
            met += 1;
        }
    }
    assert_eq!(met, 12);
}

#[test]
fn somebody_on_foot_stops_hesitates_and_runs_back_and_comes_again_when_told() {
    let table = wish("hesitates_and_runs_back");
    let [adult, again] = [row(&table, "adult()"), row(&table, "comes_again()")];
    let run = run_of(table.space().clone(), 12, 5, &[]);
    let (mut returned, mut crossed) = (0, 0);
    for episode in 0..run.episodes() {
        let (mut drawn, mut told_s): (Option<f64>, Option<f64>) = (None, None);
        let mut choose = |moment: &Moment| {
            if drawn.is_none() {
                let Ok(draw) = table.offer(moment.situation, adult) else { return Choice::Pass };
                drawn = Some(number(&draw, "wait"));
                return Choice::Act(draw);
            }
            // Every second one is told to come again, long after it is back.
            let is_due = episode % 2 == 1 && told_s.is_none() && moment.step == 9;
            match table.offer(moment.situation, again) {
                Ok(draw) if is_due => {
                    told_s = Some(moment.situation.surroundings.moment().elapsed_s);
                    Choice::Act(draw)
                }
                _ => Choice::Pass,
            }
        };
        let (mut seen, mut is_whole): (Vec<(f64, NpcFacts)>, bool) = (Vec::new(), true);
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            is_whole &= contacts.is_empty();
            seen.extend(world.npc_facts(1).filter(|_| is_whole).map(|facts| (world.time_s(), facts)));
        });
        assert_replays(&run, episode, &log);
        let Some(wait_s) = drawn else { continue };
        let before = |(at_s, _): &&(f64, NpcFacts)| told_s.is_none_or(|told_s| *at_s <= told_s);
        let first: Vec<(f64, NpcFacts)> = seen.iter().take_while(before).copied().collect();
        // It stops where it was told, within a tick of its way, for so long, and goes back to where it stood.
        let Some(stop) = first.iter().position(|(_, npc)| npc.offset_m >= -3.0) else { continue };
        let (stop_s, stands) = first[stop];
        assert!(stands.offset_m + 3.0 <= stands.speed_mps * DT_S + 1e-9, "{stands:?}");
        let Some(back) = first[stop + 2..].iter().find(|(_, npc)| npc.speed_mps > 0.0) else { continue };
        // A tick to see that it is there, one until it stands.
        assert!((back.0 - stop_s - wait_s).abs() <= 3.0 * DT_S, "{} s, not {wait_s} s", back.0 - stop_s);
        assert!((back.1.speed_mps - 3.0).abs() < 1e-9, "{back:?}");
        let (Some(begin), Some(end)) = (first.first(), first.last()) else { continue };
        if end.1.speed_mps == 0.0 {
            assert!((end.1.offset_m - begin.1.offset_m).abs() < 1e-6, "{begin:?} {end:?}");
            returned += 1;
        }
        let last = seen.last().expect("it was seen").1;
        crossed += usize::from(told_s.is_some() && last.offset_m > 3.0);
    }
    assert!(returned > 3 && crossed > 0, "{returned} returned, {crossed} crossed");
}

/// A condition such as `npc.gap >= 8 m`: its text, and the fact that it bounds, of a road user and the ego vehicle's front.
struct Guard {
    text: String,
    fact: fn(&NpcFacts, f64) -> f64,
    least: f64,
}

impl Guard {
    fn of(who: &str, rng: &mut Rng) -> Guard {
        type Fact = (&'static str, &'static str, f64, fn(&NpcFacts, f64) -> f64);
        let facts: [Fact; 5] = [
            ("WHO.gap", "m", 40.0, |npc, _| npc.gap_m),
            ("WHO.ttc", "s", 20.0, |npc, _| npc.ttc_s),
            ("WHO.headway", "s", 6.0, |npc, _| npc.headway_s),
            ("WHO.rear - ego.front", "m", 60.0, |npc, front_m| npc.rear_m - front_m),
            ("WHO.offset", "m", 4.0, |npc, _| npc.offset_m),
        ];
        let (name, unit, most, fact) = facts[rng::below(rng, facts.len() as u32) as usize];
        let least = (rng::unit(rng) * most * 10.0).round() / 10.0 - if unit == "m" { 4.0 } else { 0.0 };
        Guard { text: format!("{} >= {least:.1} {unit}", name.replace("WHO", who)), fact, least }
    }

    fn holds(&self, npc: &NpcFacts, ego_front_m: f64) -> bool {
        (self.fact)(npc, ego_front_m) >= (self.least * 10.0).round() / 10.0 - 1e-9
    }
}

/// The text of a space with two manoeuvres, each bound by a rule, and orders that are bound by others.
fn random_space(rng: &mut Rng) -> (String, [Guard; 2], Guard) {
    let number = |rng: &mut Rng, low: f64, high: f64| (rng::between(rng, low, high) * 10.0).round() / 10.0;
    let chance = |rng: &mut Rng| rng::below(rng, 2) == 0;
    let fields = |rng: &mut Rng| {
        let mut fields = Vec::new();
        if chance(rng) {
            fields.push(format!("speed: {} m/s", number(rng, 0.0, 22.0)));
            if chance(rng) {
                fields.push(format!("rate: {} m/s^2", number(rng, 0.2, 12.0)));
            }
        }
        // Beside a `speed`, which then is the most.
        match rng::below(rng, 10) {
            0 => fields.push(format!("keep: {} m", number(rng, 1.0, 40.0))),
            1 => fields.push(format!("keep: {} s", number(rng, 0.3, 4.0))),
            2 => fields.push(format!(
                "early: {} s, at: {} m",
                number(rng, -3.0, 3.0),
                number(rng, 60.0, 300.0)
            )),
            3 => fields.push(format!(
                "keep: {} m, to: {}",
                number(rng, 1.0, 40.0),
                ["a", "b"][rng::below(rng, 2) as usize]
            )),
            _ => {}
        }
        let lane = chance(rng);
        if lane {
            fields.push(format!("lane: {}", ["Left", "Current", "Right"][rng::below(rng, 3) as usize]));
        }
        let offset = chance(rng) || fields.is_empty();
        if offset {
            fields.push(format!("offset: {} m", number(rng, -1.5, 1.5)));
        }
        if (lane || offset) && chance(rng) {
            fields.push(match rng::below(rng, 3) {
                0 => format!("aside: {} s", number(rng, 0.6, 8.0)),
                _ => format!("aside: {} m/s", number(rng, 0.2, 4.0)),
            });
        }
        if rng::below(rng, 6) == 0 {
            fields.push(format!("lights: {}", ["Hazard", "Left", "Off"][rng::below(rng, 3) as usize]));
        }
        if rng::below(rng, 4) == 0 {
            fields.push(
                ["ignores: []", "ignores: [Ego]", "ignores: [Signals, RightOfWay]"]
                    [rng::below(rng, 3) as usize]
                    .into(),
            );
        }
        if rng::below(rng, 6) == 0 {
            fields.push(format!("turn: {}", ["Left", "Straight", "Right"][rng::below(rng, 3) as usize]));
        }
        fields.join(", ")
    };
    let mut text = String::from(
        "language 1\nuse \"../../../scenarios/roads.ava\"\nenum Lane = Left | Current | Right\nenum Car = Sedan | BoxTruck | Motorcycle | Bicycle\n",
    );
    text += "road lanes { map: \"../verdicts/lanes.xodr\", start: lane 1/-2 at 60 m, goal: lane 1/-2 at 560 m }\n";
    for name in ["one", "two"] {
        let repeat = if rng::below(rng, 4) == 0 { "repeat 2 " } else { "" };
        text += &format!("manoeuvre {name}() {repeat}{{\n");
        for _ in 0..1 + rng::below(rng, 3) {
            if chance(rng) {
                text += &format!("once {} ", Guard::of("npc", rng).text);
                if rng::below(rng, 3) == 0 {
                    text += &format!("for {} s ", number(rng, 0.0, 1.0));
                }
                text += &format!("within {} s ", number(rng, 1.0, 9.0));
            }
            if chance(rng) {
                text += &format!("after {} s ", number(rng, 0.0, 3.0));
            }
            if rng::below(rng, 5) == 0 {
                text += &format!("if {} ", Guard::of("npc", rng).text);
            }
            text += &format!("{{ {} }}\n", fields(rng));
        }
        text += "}\n";
    }
    text += "action first(each lane: Lane, any car: Car, any speed: Speed in 0 m/s .. 18 m/s, any far: Length in 5 m .. 60 m, any offset: Length in -1 m .. 1 m) {\n  spawn car as a ahead far { does: DriveAhead, lane: lane, speed: speed, offset: offset, then: one() }\n}\n";
    text += "action second(each lane: Lane, any speed: Speed in 4 m/s .. 18 m/s) {\n  spawn SUV as b behind 15 m { does: Overtake, lane: lane, speed: speed, then: two() }\n}\n";
    text += "action third(each lane: Lane, any speed: Speed in 0 m/s .. 18 m/s) {\n  spawn SUV as b behind 15 m { does: DriveBehind, lane: lane, speed: speed, then: two() }\n}\n";
    text += "enum Going = WalkAhead | WalkOpposite\naction walker(each going: Going, any offset: Length in -5 m .. 5 m) {\n  spawn Pedestrian as w ahead 40 m { does: going, speed: 1.4 m/s, offset: offset }\n}\n";
    text += &format!(
        "action tell_walker() {{ order w {{ speed: {} m/s, offset: {} m, aside: {} m/s }} }}\n",
        number(rng, -3.0, 3.0),
        number(rng, -5.0, 5.0),
        number(rng, 0.5, 2.0)
    );
    text += "action again(each who: RoadUser in [a]) { order who { then: two() } }\n";
    // An order of a gap to itself does not compile.
    text += &format!("action tell() {{ order a {{ {} }} }}\n", fields(rng).replace("to: a", "to: b"));
    let guards = [Guard::of("npc", rng), Guard::of("npc", rng)];
    let of_orders = Guard::of("a", rng);
    text += &format!("rule g1 during one: {}\nrule g2 during two: {}\n", guards[0].text, guards[1].text);
    text += &format!("rule g3 on again, tell: {}\n", of_orders.text);
    text += "episode { roads: [lanes, boulevard, crossroad, corner], step: 1.5 s, limit: 20 steps }\n";
    (text, guards, of_orders)
}

/// What an audit of random spaces saw.
#[derive(Debug, Default)]
struct Audited {
    spaces: u64,
    manoeuvres: u64,
    phases: u64,
    orders: u64,
}

/// Plays random spaces with manoeuvres, orders and rules about them. No phase begins and no order is given while its rule
/// does not hold, nothing leaps, overlaps unnoticed or is quicker than its body, and every log replays.
fn audit(from: u64, spaces: u64, episodes: u32) -> Audited {
    let mut seen = Audited::default();
    for number in from..from + spaces {
        let (text, guards, of_orders) = random_space(&mut rng::stream(number, Stream::Exploration, 1));
        let found = loaded("tests/cases/wishes/random.ava", &text);
        let space = found.space.unwrap_or_else(|| panic!("{:?}\n{text}", found.diagnostics));
        seen.spaces += 1;
        let table = ActionTable::new(Arc::clone(&space));
        let run = run_against("idm", Arc::clone(&space), episodes, number, &[]);
        for episode in 0..run.episodes() {
            let mut chosen = rng::stream(number, Stream::Exploration, 2 + episode as u64);
            // Which manoeuvre each road user does, and who was spawned as `a`.
            let (mut does, mut of_a): (BTreeMap<u32, usize>, Vec<u32>) = Default::default();
            let (mut begun, mut facts): (BTreeMap<u32, u32>, BTreeMap<u32, NpcFacts>) = Default::default();
            let mut before: BTreeMap<u32, Obstacle> = BTreeMap::new();
            let (mut front_m, mut crashed) = (f64::NAN, BTreeSet::new());
            // The action of this step, until its first tick has passed.
            let told: Cell<Option<&str>> = Cell::new(None);
            let mut choose = |moment: &Moment| {
                let offers = table.offers(moment.situation).into_iter().filter_map(Result::ok);
                let legal: Vec<Draw> = offers.collect();
                if legal.is_empty() || rng::below(&mut chosen, 4) == 0 {
                    return Choice::Pass;
                }
                let draw = legal[rng::below(&mut chosen, legal.len() as u32) as usize].clone();
                let action = &space.actions[space.rows[draw.row].action].name;
                if matches!(action.as_str(), "again" | "tell") {
                    let a = moment.situation.surroundings.bearer(0).expect("it is there");
                    let ego_front_m = moment.situation.surroundings.moment().ego_front_m;
                    assert!(of_orders.holds(&a, ego_front_m), "{action}: {a:?}\n{text}");
                }
                told.set(
                    ["first", "second", "third", "again", "tell"].into_iter().find(|name| name == action),
                );
                Choice::Act(draw)
            };
            let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
                let ids: Vec<u32> = world.obstacles().map(|other| other.id).collect();
                let told = told.take();
                crashed.extend(contacts.iter().map(|contact| contact.obstacle));
                crashed.extend(world.incidents().iter().flat_map(|incident| [incident.obstacle, incident.other]));
                for id in ids.iter().filter(|id| !before.contains_key(id)) {
                    does.insert(*id, usize::from(matches!(told, Some("second" | "third"))));
                    of_a.extend((told == Some("first")).then_some(*id));
                }
                if let (Some("again"), Some(id)) = (told, of_a.iter().rfind(|id| ids.contains(id))) {
                    does.insert(*id, 1);
                    begun.remove(id);
                }
                for id in &ids {
                    let now = world.phases(*id).begun;
                    let was = begun.insert(*id, now).unwrap_or(0);
                    let Some(npc) = facts.get(id) else { continue };
                    if now > was {
                        seen.phases += u64::from(now - was);
                        let holds = guards[does[id]].holds(npc, front_m);
                        assert!(holds, "a phase of {id} begins at {}\n{npc:?}\n{text}", world.time_s());
                    }
                }
                for id in &ids {
                    let (now, body) =
                        (world.obstacle(*id).expect("it is there"), world.body(*id).expect("it has one"));
                    if let Some(was) = before.get(id) {
                        let moved_m = (now.outline.pose.position - was.outline.pose.position).norm();
                        let most_m = was.velocity_mps.norm().max(now.velocity_mps.norm()) * DT_S + 0.01;
                        assert!(moved_m <= most_m, "{id} leaps {moved_m} m at {}\n{text}", world.time_s());
                        let is_hit = crashed.contains(id);
                        let along = unit_vector(now.lane_heading_rad);
                        let gained_mps2 = (now.velocity_mps - was.velocity_mps).dot(&along) / DT_S;
                        let on_lanes = world.scene().map.name.contains("lanes");
                        assert!(
                            is_hit || !on_lanes || !now.body.is_vehicle() || gained_mps2 <= body.acceleration_mps2_max + 0.6,
                            "{id} gains {gained_mps2} m/s² at {}\n{text}",
                            world.time_s()
                        );
                        let left = Vec2::new(-along.y, along.x);
                        // One that brakes or gains speed during a move to the side does so along its way, and so sideways
                        // as well: engine, brakes and tyres are bounded one by one.
                        let slope = (was.velocity_mps.dot(&left) / was.velocity_mps.dot(&along)).abs();
                        // A change that is broken off, and the move back, need a tenth more.
                        let along_way_mps2 = 1.0 + gained_mps2.abs() * slope.min(1.0);
                        let aside_mps2 = ((now.velocity_mps - was.velocity_mps).dot(&left) / DT_S).abs();
                        assert!(
                            is_hit || !on_lanes || !now.body.is_vehicle() || aside_mps2 <= GRIP_MPS2 + along_way_mps2,
                            "{id} is pushed aside by {aside_mps2} m/s² at {} in {number}/{episode}: {was:?} {now:?}\n{text}",
                            world.time_s()
                        );
                    }
                }
                for (nth, id) in ids.iter().enumerate() {
                    for other in ids[..nth].iter().filter(|other| !crashed.contains(id) || !crashed.contains(other)) {
                        let [a, b] = [id, other].map(|id| world.obstacle(*id).expect("it is there").outline);
                        assert!(distance_m(&a, &b) > 0.0, "{id} and {other} overlap at {} in {number}/{episode}\n{text}", world.time_s());
                    }
                }
                facts = ids.iter().filter_map(|id| Some((*id, world.npc_facts(*id)?))).collect();
                before = world.obstacles().map(|other| (other.id, *other)).collect();
                front_m = world.moment_facts().ego_front_m;
            });
            for step in &log.steps {
                if let Outcome::Done { draw, .. } = &step.outcome {
                    seen.manoeuvres += draw.courses.len() as u64;
                    seen.orders +=
                        draw.effects.iter().filter(|effect| matches!(effect, Effect::Order(_))).count()
                            as u64;
                }
            }
            assert_replays(&run, episode, &log);
        }
    }
    seen
}

#[test]
fn random_manoeuvres_keep_their_rules_and_their_bodies() {
    let seen = audit(0, 6, 2);
    assert!(seen.manoeuvres > 100 && seen.phases > 50 && seen.orders > 20, "{seen:?}");
}

#[test]
#[ignore = "takes minutes"]
fn ten_thousand_manoeuvres_keep_their_rules_and_their_bodies() {
    let seen = audit(1000, 300, 4);
    println!("{seen:?}");
    assert!(seen.manoeuvres > 10_000, "{seen:?}");
}

#[test]
fn the_shipped_space_of_manoeuvres_does_all_that_it_says() {
    let table = ActionTable::new(space("manoeuvres.ava"));
    let run = run_against("idm", table.space().clone(), 3, 5, &[]);
    let mut done = BTreeSet::new();
    for episode in 0..run.episodes() {
        let log = run.episode(episode);
        assert_replays(&run, episode, &log);
        done.extend(log.steps.iter().filter_map(|step| match &step.outcome {
            Outcome::Done { draw, .. } => Some(draw.row),
            Outcome::Passed | Outcome::Refused { .. } => None,
        }));
    }
    let rows = table.rows().iter().filter(|row| !done.contains(&row.index));
    let missing: Vec<&str> = rows.map(|row| &*row.label).collect();
    assert!(missing.is_empty(), "{missing:?} never happened");
}
