//! Collisions made by hand, whose verdicts are known beforehand.

use crate::episode::{Collision, PreCrash, Shape};
use avastra_base::geometry::{OrientedBox, Vec2};
use avastra_drivers as ads;
use avastra_drivers::{Ads, Status};
use avastra_lang::model::vocabulary::{Body, Level, Verb};
use avastra_lang::model::{Avoidability, BodyWord};
use avastra_road::testing::{lanes, street};
use avastra_world::action::Effect;
use avastra_world::sim::{Contact, Control, DT_S, Sensed, Start, World, testing};

use super::avoidable::{Judgement, judge_one};
use super::hazard::{Onset, onset};
use super::severity::severity;

/// A lane along +x for 800 m, 3 m wide: too narrow to pass another vehicle.
fn world() -> World {
    let lanes = lanes(&[(-1, "driving", 3.0, "")]);
    let road = street("1", [0.0, 0.0, 0.0, 800.0], "-1", "", &lanes, "");
    let scene = testing::scene(&road, ("1", -1, 10.0), ("1", -1, 790.0));
    World::new(scene, &Start { seed: 1, ..testing::start() })
}

/// IDM without brakes.
#[derive(Debug, Clone)]
struct Broken(ads::Idm);

impl Ads for Broken {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        Control { brake_pct: 0.0, ..self.0.drive(sensed) }
    }

    fn status(&self) -> &Status {
        self.0.status()
    }
}

fn vehicle(world: &mut World, distance_m: f64, speed_mps: f64) {
    appear(world, Verb::DriveAhead, distance_m, speed_mps);
}

fn appear(world: &mut World, verb: Verb, distance_m: f64, speed_mps: f64) {
    let request = testing::request(verb, distance_m, speed_mps);
    world.apply(&Effect::Spawn(request)).expect("there is room");
}

const EVENT_S: f64 = 12.0;

/// Drives without brakes, makes `event` happen, and judges the first contact.
fn judged(event: impl Fn(&mut World)) -> Judgement {
    judged_in(world(), event)
}

/// As [`judged`], in a given world.
fn judged_in(world: World, event: impl Fn(&mut World)) -> Judgement {
    let (recording, contact, met) = crashed(world, event);
    let recent = &recording[recording.len().saturating_sub(500)..];
    judge_one(recent, &contact, met)
}

/// The worlds before the first contact, the contact, and where the ego vehicle was then.
fn crashed(mut world: World, event: impl Fn(&mut World)) -> (Vec<World>, Contact, OrientedBox) {
    let mut broken = Broken(ads::Idm::new(world.scene()));
    let mut recording: Vec<World> = Vec::new();
    let mut sensed = world.sensed();
    for tick in 0..3000_u32 {
        if tick == (EVENT_S / DT_S).round() as u32 {
            event(&mut world);
        }
        world.sense(&mut sensed);
        let control = broken.drive(&sensed);
        let contact = world.tick(&control).first().copied();
        if let Some(contact) = contact {
            return (recording, contact, world.ego_outline());
        }
        recording.push(world.clone());
    }
    panic!("no contact in a minute");
}

#[test]
fn the_change_of_velocity_that_is_told_is_the_one_that_was_driven() {
    for (slower_mps, verb) in [(10.0, Verb::DriveAhead), (3.0, Verb::DriveAhead), (0.0, Verb::Stand)] {
        let mut world = world();
        let mut blind = Blind(ads::Idm::new(world.scene()));
        let mut sensed = world.sensed();
        let contact = loop {
            if world.ticks() == 600 {
                let speed_mps = (world.ego().speed_mps - slower_mps).max(0.5);
                appear(&mut world, verb, 40.0, speed_mps);
            }
            world.sense(&mut sensed);
            let control = blind.drive(&sensed);
            if let Some(contact) = world.tick(&control).first().copied() {
                break contact;
            }
        };
        let mass_t = world.body(contact.obstacle).expect("it is still there").mass_t;
        let body = BodyWord::engine(Body::Sedan);
        let (shape, kind) = (Shape::Straight, PreCrash::Other);
        let collision = Collision { contact, shape, kind, step: 0, body, mass_t, verb, spawned_s: 12.0 };
        let told = severity(&collision);
        let driven_mps = contact.ego_speed_mps - world.ego().speed_mps;
        assert!(contact.closing_speed_mps > 1.0, "{contact:?}");
        assert!((told.delta_v_mps - driven_mps).abs() < 1e-9, "{told:?}, driven {driven_mps}");
    }
}

/// Judges a vehicle that is 30 km/h slower and appears this far ahead of an ego vehicle at about 11 m/s.
fn appears(distance_m: f64) -> Judgement {
    judged(|world| {
        let own_mps = world.ego().speed_mps;
        assert!((own_mps - 11.0).abs() < 0.5, "{own_mps}");
        vehicle(world, distance_m, own_mps - 30.0 / 3.6);
    })
}

#[test]
fn between_human_and_machine_lies_the_beyond() {
    let judgement = appears(9.0);
    assert_eq!(judgement.class, Avoidability::BeyondReference);
    assert_eq!(judgement.evasion.as_deref(), Some("full brake"));
    // 8.33 m/s at 1.15 s, 0.6 s of build-up and 6 m/s²: 9.6 + 4.2 + 2.9 m and something for the lag.
    assert_eq!(appears(20.0).class, Avoidability::Avoidable);
}

#[test]
fn the_hazard_of_a_pedestrian_begins_with_the_first_step() {
    let (recording, contact, met) = crashed(world(), |world| appear(world, Verb::Walk, 46.0, 1.4));
    let walks = |world: &&World| world.obstacle(1).is_some_and(|walker| walker.velocity_mps != Vec2::zeros());
    let first_step_s = recording.iter().find(walks).expect("it walked").time_s();
    let recent = &recording[recording.len().saturating_sub(500)..];
    let judgement = judge_one(recent, &contact, met);
    assert!((judgement.onset_s - first_step_s).abs() < 0.11, "{judgement:?}, {first_step_s}");
    assert_ne!(judgement.class, Avoidability::Unavoidable, "{judgement:?}");
}

#[test]
fn what_was_never_in_sight_has_no_onset() {
    let mut hidden = world();
    vehicle(&mut hidden, 20.0, 5.0);
    let met = hidden.ego_outline();
    assert_eq!(onset(&[hidden.clone()], 1, met), None, "20 m away, under way, and no way leads there");
    let there = hidden.obstacle(1).expect("it was put there").outline;
    assert_eq!(onset(&[hidden.clone()], 1, there), Some(Onset { first: 0, conflict: 0 }));
    assert_eq!(onset(&[hidden], 2, there), None, "no obstacle has that number");
    let mut creeps = world();
    vehicle(&mut creeps, 20.0, 0.5);
    let seen = Some(Onset { first: 0, conflict: 0 });
    assert_eq!(onset(&[creeps], 1, met), seen, "what creeps in the way is in it from the moment it is seen");
}

/// IDM that sees no other road user.
#[derive(Debug, Clone)]
struct Blind(ads::Idm);

impl Ads for Blind {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        self.0.drive(&Sensed { objects: Vec::new(), ..sensed.clone() })
    }

    fn status(&self) -> &Status {
        self.0.status()
    }
}

/// Judges a blind ego vehicle at 11.2 m/s before which a pedestrian stands, `distance_m` away when it appears.
fn stands(distance_m: f64) -> Avoidability {
    judged(|world| appear(world, Verb::Stand, distance_m, 1.0)).class
}

#[test]
fn un_r157_puts_the_border_of_a_standing_pedestrian_at_24_m() {
    assert_ne!(stands(20.0), Avoidability::Avoidable);
    assert_eq!(stands(28.0), Avoidability::Avoidable);
}

/// On a wet road no vehicle brakes with the 7.6 m/s² of a dry road, not even to the letter of the regulation.
#[test]
fn the_letter_of_un_r157_brakes_no_harder_than_the_road_allows() {
    let letter = |wet: Level, distance_m: f64| {
        let road = street("1", [0.0, 0.0, 0.0, 800.0], "-1", "", &lanes(&[(-1, "driving", 3.0, "")]), "");
        let scene = testing::scene(&road, ("1", -1, 10.0), ("1", -1, 790.0));
        let world =
            World::new(scene, &Start { seed: 1, sky: [Level::None, Level::None, wet], ..testing::start() });
        judged_in(world, |world| appear(world, Verb::Stand, distance_m, 1.0)).r157_letter
    };
    let border_m = |wet: Level| {
        let avoided = (0..80).map(|step| 15.0 + f64::from(step) * 0.5);
        avoided
            .into_iter()
            .find(|distance_m| !letter(wet, *distance_m).is_empty())
            .expect("far away it is avoided")
    };
    let (dry_m, wet_m) = (border_m(Level::None), border_m(Level::High));
    assert!(wet_m > dry_m + 1.0, "{dry_m} m on a dry road, {wet_m} m on a wet one");
}
