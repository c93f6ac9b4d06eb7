//! Wishes of road users that are told where to be beside the ego vehicle, whom to heed, and for how long something must have
//! held: what was written, seen at the ticks of episodes that replay.

use avastra::action::ActionTable;
use avastra::episode::{Choice, Moment, Outcome};
use avastra::model::{Laid, NpcFacts};
use avastra::sim::{DT_S, World};

use crate::wishes::{number, row, wish};
use crate::world::{assert_replays, loaded, run_of, space_at};

/// What was seen at a tick of an episode, before the ego vehicle touched anybody.
struct Tick {
    at_s: f64,
    ego_mps: f64,
    ego_front_m: f64,
    ego_rear_m: f64,
    /// The first and the second road user.
    npcs: [Option<NpcFacts>; 2],
}

/// Plays episodes in which a row is chosen in the first step in which it is legal; calls `see` with what was seen and the draw's
/// values of these names.
fn played(name: &str, label: &str, values: &[&str], mut see: impl FnMut(&[Tick], &[f64])) {
    let table = wish(name);
    let wanted = row(&table, label);
    let run = run_of(table.space().clone(), 8, 6, &[]);
    for episode in 0..run.episodes() {
        let mut drawn = None;
        let mut choose = |moment: &Moment| match table.offer(moment.situation, wanted) {
            Ok(draw) if drawn.is_none() => {
                drawn = Some(values.iter().map(|value| number(&draw, value)).collect::<Vec<f64>>());
                Choice::Act(draw)
            }
            _ => Choice::Pass,
        };
        let (mut ticks, mut is_whole) = (Vec::new(), true);
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            is_whole &= contacts.is_empty();
            if is_whole {
                ticks.push(tick(world));
            }
        });
        assert_replays(&run, episode, &log);
        if let Some(drawn) = drawn {
            see(&ticks, &drawn);
        }
    }
}

fn tick(world: &World) -> Tick {
    let moment = world.moment_facts();
    Tick {
        at_s: world.time_s(),
        ego_mps: world.ego().speed_mps,
        ego_front_m: moment.ego_front_m,
        ego_rear_m: moment.ego_rear_m,
        npcs: [1, 2].map(|id| world.npc_facts(id)),
    }
}

#[test]
fn a_tailgater_keeps_its_time_gap_and_passes() {
    let (mut kept, mut passed) = (0, 0);
    played("tailgates", "tailgates()", &["gap"], |ticks, drawn| {
        let gap_s = |tick: &Tick, npc: &NpcFacts| (tick.ego_rear_m - npc.front_m) / npc.speed_mps;
        let behind = |tick: &&Tick| {
            tick.npcs[0].is_some_and(|npc| npc.front_m < tick.ego_rear_m && npc.offset_m.abs() < 1e-6)
        };
        let Some(last) = ticks.iter().rfind(behind) else { return };
        // In the last of its 6 s behind the ego vehicle, whose speed changes little then.
        let second = ticks.iter().filter(behind).filter(|tick| tick.at_s > last.at_s - 1.0);
        let steady: Vec<&Tick> = second.collect();
        let change_mps = steady.iter().map(|tick| tick.ego_mps).fold(0.0, f64::max) - steady[0].ego_mps;
        if steady.len() > 40 && change_mps.abs() < 0.2 && steady[0].ego_mps > 5.0 {
            for tick in &steady {
                let npc = tick.npcs[0].expect("it is behind");
                assert!(
                    (gap_s(tick, &npc) - drawn[0]).abs() < 0.15,
                    "{} s of {} s",
                    gap_s(tick, &npc),
                    drawn[0]
                );
            }
            kept += 1;
        }
        let end = ticks.last().expect("it drove");
        passed += usize::from(
            end.npcs[0].is_some_and(|npc| npc.rear_m > end.ego_front_m && npc.offset_m.abs() < 0.1),
        );
    });
    assert!(kept >= 2 && passed >= 1, "{kept} kept their gap, {passed} came in before the ego vehicle");
}

#[test]
fn who_walks_along_the_road_steps_out_when_the_ego_vehicle_comes() {
    for label in ["walks(going: WalkAhead)", "walks(going: WalkOpposite)"] {
        let mut stepped = 0;
        played("steps_off_the_kerb", label, &["ttc"], |ticks, drawn| {
            let there = |tick: &Tick| tick.npcs[0].map(|npc| (tick.at_s, npc));
            let seen: Vec<(f64, NpcFacts)> = ticks.iter().filter_map(there).collect();
            let Some(begin) = seen.iter().position(|(_, npc)| npc.ttc_s <= drawn[0]) else { return };
            assert!(seen[..begin].iter().all(|(_, npc)| (npc.offset_m + 4.0).abs() < 1e-6), "{label}");
            let begin_s = seen[begin].0;
            // Before an ego vehicle that is about to pass it stops.
            for (at_s, npc) in seen[begin..].iter().take_while(|(_, npc)| npc.gap_m > 2.0) {
                // From 4 m beside the middle of the lane into it, at 1.5 m/s, beginning with the next tick.
                let wanted_m = (-4.0 + 1.5 * (at_s - begin_s)).min(0.0);
                assert!(
                    (npc.offset_m - wanted_m).abs() <= 1.5 * DT_S + 1e-6,
                    "{label}: {npc:?}, {wanted_m} m"
                );
                stepped += usize::from(npc.offset_m == 0.0);
            }
        });
        assert!(stepped > 0, "{label}: nobody came into the lane");
    }
}

#[test]
fn a_car_makes_way_for_the_ambulance_that_it_was_told_of() {
    let (mut made_way, mut back) = (0, 0);
    played("makes_way", "comes()", &[], |ticks, _| {
        let both = |tick: &Tick| Some((tick.npcs[0]?, tick.npcs[1]?));
        let mut was_near = false;
        for (car, ambulance) in ticks.iter().filter_map(both) {
            let is_near = car.rear_m - ambulance.front_m <= 25.0;
            assert!(was_near || is_near || car.offset_m.abs() < 1e-6, "{car:?} {ambulance:?}");
            was_near |= is_near;
            made_way += usize::from((car.offset_m - 0.8).abs() < 1e-6);
            back += usize::from(ambulance.rear_m > car.front_m + 20.0 && car.offset_m.abs() < 1e-6);
        }
    });
    assert!(made_way > 0 && back > 0, "{made_way} ticks at the side, {back} back behind it");
}

#[test]
fn somebody_crosses_when_the_ego_vehicle_has_stood_for_so_long() {
    let mut crossed = 0;
    played("waits_for_a_stop", "waits()", &[], |ticks, _| {
        let walks = |tick: &Tick| tick.npcs[0].is_some_and(|npc| npc.speed_mps > 0.0);
        let Some(begin) = ticks.iter().position(walks) else { return };
        let stood = ticks[..begin].iter().rev().take_while(|tick| tick.ego_mps <= 0.1).count();
        let stood_s = stood as f64 * DT_S;
        // It sets out in the tick after the condition has held for 1.5 s.
        assert!((stood_s - 1.5).abs() <= 2.5 * DT_S, "it had stood for {stood_s} s");
        crossed += 1;
    });
    assert!(crossed >= 2, "{crossed} crossed");
}

#[test]
fn a_child_appears_beside_a_bus_that_has_stopped() {
    let table = wish("child_before_the_bus");
    let rows = [row(&table, "bus()"), row(&table, "child()")];
    let run = run_of(table.space().clone(), 8, 4, &[]);
    let mut appeared = 0;
    for episode in 0..run.episodes() {
        let (mut done, mut gap_m) = (0, f64::NAN);
        let mut choose = |moment: &Moment| {
            let Some(Ok(draw)) = rows.get(done).map(|row| table.offer(moment.situation, *row)) else {
                return Choice::Pass;
            };
            done += 1;
            if done == 2 {
                gap_m = number(&draw, "gap");
            }
            Choice::Act(draw)
        };
        let mut came: Option<(f64, f64)> = None;
        let mut went_s: Option<f64> = None;
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            let (Some(bus), Some(child)) = (world.npc_facts(1), world.npc_facts(2)) else { return };
            came.get_or_insert((world.time_s(), child.rear_m - bus.front_m));
            went_s = went_s.or((child.speed_mps > 0.0).then(|| world.time_s()));
        });
        assert_replays(&run, episode, &log);
        let Some((came_s, found_m)) = came else { continue };
        // A crosswalk within 5 m would be taken; there is none here.
        assert!((found_m - gap_m).abs() < 0.05, "{found_m} m before the bus, not {gap_m} m");
        let Some(went_s) = went_s else { continue };
        assert!((went_s - came_s - 2.0).abs() <= 2.0 * DT_S, "it went after {} s", went_s - came_s);
        appeared += 1;
    }
    assert!(appeared >= 2, "{appeared} children");
}

#[test]
fn rates_are_those_of_the_clock_and_not_of_the_rows() {
    let table = wish("jaywalkers");
    let hour = table.space().state("time").expect("it is declared").first_cell;
    let run = run_of(table.space().clone(), 400, 5, &[]);
    // Steps in which each could come, and did: jaywalkers by day and by night, cars.
    let (mut steps, mut came) = ([0_u32; 3], [0_u32; 3]);
    for episode in 0..run.episodes() {
        let mut random = match avastra::agent::by_name("random").expect("it is there").kind {
            avastra::agent::Kind::Ready(build) => build(),
            _ => panic!("it learns nothing"),
        };
        let mut choose = |moment: &Moment| {
            let choice = avastra::run::choose(random.as_mut(), moment);
            let at_night = moment.situation.memory.cells()[hour].variant() == 1;
            let legal = |row: usize| table.offer(moment.situation, row).is_ok();
            let did = |rows: &[usize]| matches!(&choice, Choice::Act(draw) if rows.contains(&draw.row));
            if legal(0) || legal(1) {
                steps[usize::from(at_night)] += 1;
                came[usize::from(at_night)] += u32::from(did(&[0, 1]));
            }
            steps[2] += u32::from(legal(2));
            came[2] += u32::from(did(&[2]));
            choice
        };
        run.play(episode, &mut choose, &mut |_, _, _| {});
    }
    for ((steps, came), an_hour) in steps.into_iter().zip(came).zip([30.0, 90.0, 60.0]) {
        // Steps of 6 s, and three standard deviations of a count.
        let wanted = f64::from(steps) * an_hour / 600.0;
        let off = (f64::from(came) - wanted).abs();
        assert!(wanted > 40.0 && off < 3.0 * wanted.sqrt(), "{came} of {wanted} in {steps} steps");
    }
}

#[test]
fn a_red_light_runner_starts_under_both_lights_and_crosses_first() {
    let mut crossed = 0;
    played("red_light_runner", "runner()", &[], |ticks, _| {
        let seen: Vec<(f64, NpcFacts)> =
            ticks.iter().filter_map(|tick| Some((tick.ego_front_m, tick.npcs[0]?))).collect();
        // Where its middle comes over the ego vehicle's route, that one's front is still before that place.
        let over = seen.windows(2).find(|pair| pair[0].1.offset_m < 0.0 && pair[1].1.offset_m >= 0.0);
        let Some([_, (front_m, npc)]) = over else { return };
        assert!(*front_m < npc.front_m, "{front_m} m, {npc:?}");
        crossed += 1;
    });
    assert!(crossed >= 1, "nobody crossed");
}

#[test]
fn a_cyclist_swerves_or_waits_by_who_is_behind() {
    let (mut went_round, mut waited) = (0, 0);
    played("swerves_or_waits", "cyclist()", &[], |ticks, _| {
        let both = |tick: &Tick| Some((tick.ego_rear_m, tick.npcs[0]?, tick.npcs[1]?));
        let seen: Vec<(f64, NpcFacts, NpcFacts)> = ticks.iter().filter_map(both).collect();
        // What the branch saw: the first moment at which the van was near.
        let Some(at) = seen.iter().position(|(_, van, cyclist)| van.rear_m - cyclist.front_m <= 15.0) else {
            return;
        };
        let goes_round = seen[at].2.headway_s >= 2.0;
        // It begins 1 m to the right of the middle of its lane, which lies 3.5 m to the right of the route.
        let moves = seen.iter().position(|(_, _, cyclist)| cyclist.offset_m > -4.4);
        let Some(moves) = moves else { return };
        let (ego_rear_m, _, cyclist) = seen[moves];
        match goes_round {
            true => {
                assert!(ego_rear_m < cyclist.front_m, "it waited though the ego vehicle was far behind");
                went_round += 1;
            }
            false => {
                assert!(ego_rear_m >= cyclist.front_m, "it did not wait: {ego_rear_m} m, {cyclist:?}");
                waited += 1;
            }
        }
    });
    assert!(went_round > 0 && waited > 0, "{went_round} went round the van, {waited} waited behind it");
}

#[test]
fn actions_come_after_each_other_as_a_rule_says() {
    let table = wish("one_of_them_brakes");
    let run = run_of(table.space().clone(), 12, 4, &[]);
    let (mut gaps, mut braked) = (0, 0);
    for episode in 0..run.episodes() {
        let mut choose = |moment: &Moment| {
            let legal = (0..4).rev().find_map(|row| table.offer(moment.situation, row).ok());
            legal.map_or(Choice::Pass, Choice::Act)
        };
        let log = run.play(episode, &mut choose, &mut |_, _, _| {});
        assert_replays(&run, episode, &log);
        let times = |first: bool| {
            let is_one = move |row: usize| (row == 0) == first;
            let steps = log.steps.iter();
            let done =
                steps.filter(|step| matches!(&step.outcome, Outcome::Done { draw, .. } if is_one(draw.row)));
            done.map(|step| step.time_s).collect::<Vec<f64>>()
        };
        let (came, brakes) = (times(true), times(false));
        braked += brakes.len();
        for pair in brakes.windows(2) {
            assert!(pair[1] - pair[0] >= 20.0 - 1e-9, "{brakes:?}");
            gaps += 1;
        }
        for brake_s in &brakes {
            let before = came.iter().rfind(|came_s| *came_s < brake_s).expect("they came before");
            assert!(brake_s - before >= 5.0 - 1e-9, "{came:?} {brakes:?}");
        }
    }
    assert!(braked > 4 && gaps > 0, "{braked} brakes, {gaps} gaps");
}

#[test]
fn a_drawn_road_user_is_one_that_the_rules_allow() {
    let text = "language 1\nuse \"../../../scenarios/roads.ava\"\n\
        action first() { spawn Sedan as a ahead 90 m { does: DriveAhead, lane: Current, speed: 5 m/s } }\n\
        action second() { spawn Sedan as b ahead 40 m { does: DriveAhead, lane: Current, speed: 5 m/s } }\n\
        action slows(any who: RoadUser where who.there) { order who { speed: 2 m/s } }\n\
        rule near on slows: who.gap <= 60 m\n";
    let found = loaded("tests/cases/wishes/random.ava", text);
    let table = ActionTable::new(found.space.expect("it is sound"));
    let [second, slows] = [row(&table, "second()"), row(&table, "slows()")];
    let run = run_of(table.space().clone(), 4, 2, &[]);
    let mut ordered = 0;
    for episode in 0..run.episodes() {
        let mut choose = |moment: &Moment| {
            let wanted = if moment.step == 0 { second } else { slows };
            table.offer(moment.situation, wanted).map_or(Choice::Pass, Choice::Act)
        };
        let log = run.play(episode, &mut choose, &mut |_, _, _| {});
        assert_replays(&run, episode, &log);
        for step in &log.steps {
            if let Outcome::Done { draw, .. } = &step.outcome
                && draw.row == slows
            {
                assert_eq!(draw.values[0].1.variant(), 1, "nobody else is there");
                ordered += 1;
            }
        }
    }
    assert!(ordered > 4, "{ordered} orders");
}

#[test]
fn who_follows_a_trajectory_goes_on_along_it_and_replays() {
    let run = run_of(space_at("tests/cases/spaces/trajectory.ava"), 3, 4, &[]);
    let table = run.table();
    for episode in 0..run.episodes() {
        let wanted = episode % table.rows().len();
        let mut drawn = false;
        let mut choose = |moment: &Moment| match table.offer(moment.situation, wanted) {
            Ok(draw) if !drawn => {
                drawn = true;
                Choice::Act(draw)
            }
            _ => Choice::Pass,
        };
        let (mut stations_m, mut fastest_mps) = (Vec::new(), 0.0_f64);
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            if let Some(npc) = world.npc_facts(1) {
                stations_m.push(npc.station_m);
                fastest_mps = fastest_mps.max(npc.speed_mps);
            }
        });
        assert!(stations_m.windows(2).all(|pair| pair[0] <= pair[1]), "it goes on");
        assert!(stations_m.last() > stations_m.first(), "row {wanted} moves");
        assert!((0.5..7.0).contains(&fastest_mps), "{fastest_mps}");
        assert_replays(&run, episode, &log);
    }
}

/// Each leg of a way through several places ends where the next one begins, though the lanes go on.
#[test]
fn a_way_through_several_places_never_leads_back() {
    let space = space_at("tests/cases/spaces/places.ava");
    let road = space.roads.iter().find(|road| road.name == "boulevard").expect("it is there");
    let [whole, first] = [0, 1].map(|way| match &road.trajectories[way] {
        Some(Laid::OnMap(way)) => &way.path,
        _ => panic!("it lies on the map of its road"),
    });
    assert!((whole.length_m() - first.length_m()).abs() < 0.1, "{} m", whole.length_m());
    let steps = (whole.length_m() / 0.5) as usize;
    for step in 1..steps {
        let (before, here) = (whole.pose_at((step - 1) as f64 * 0.5), whole.pose_at(step as f64 * 0.5));
        assert!(before.to_local(here.position).x > 0.4, "it goes on at {} m", step as f64 * 0.5);
    }
}
