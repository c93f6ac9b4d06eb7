//! The rules of the shipped space, seen from outside: no episode breaks one that is on, and switching
//! one off changes what may happen, and only that.
//!
//! The predicates are written here by hand, from the paper and not from the space's file.

use avastra::action::ActionTable;
use avastra::action::Draw;
use avastra::action::Effect;
use avastra::action::Offer;
use avastra::action::SpawnRequest;
use avastra::episode::Choice;
use avastra::episode::Moment;
use avastra::model::vocabulary::Body;
use avastra::model::vocabulary::TimeOfDay;
use avastra::model::vocabulary::Verb;
use avastra::rng;
use avastra::rng::Stream;
use avastra::study::Run;

use crate::world::assert_replays;
use crate::world::run;

const RULES: [&str; 5] = ["chronology", "npc_gap", "npc_speed", "walking_pace", "no_teleport"];

/// Limits of the four roads: 25 mph on Roads 1 and 2, 50 km/h on Roads 3 and 4.
const LIMITS_MPS: [f64; 4] = [11.176, 11.176, 50.0 / 3.6, 50.0 / 3.6];

/// Episodes on each road.
const EPISODES: u32 = 10;

#[test]
fn no_episode_breaks_a_rule_and_each_switch_frees_its_own() {
    assert_eq!(broken(&run(EPISODES, 5, &[])), [false; 5], "with all rules on");
    for (index, rule) in RULES.into_iter().enumerate() {
        let mut expected = [false; 5];
        expected[index] = true;
        assert_eq!(broken(&run(EPISODES, 5, &[rule])), expected, "without {rule}");
    }
}

/// Which of [`RULES`] some step of the run's episodes broke.
fn broken(run: &Run) -> [bool; 5] {
    let mut broken = [false; 5];
    for number in 0..run.episodes() {
        let mut time = None;
        let limit_mps = LIMITS_MPS[number / EPISODES as usize];
        let log = run.play(
            number,
            &mut |moment| {
                let Some(draw) = drawn(run.table(), moment, number) else { return Choice::Pass };
                let before = time.unwrap_or_else(|| run.space().weather(moment.situation.memory).0);
                let after = judge(&draw, before, limit_mps, moment, &mut broken);
                time = Some(after);
                Choice::Act(draw)
            },
            &mut |_, _, _| {},
        );
        assert_replays(run, number, &log);
    }
    broken
}

/// Any legal row, by a stream of the test's own.
fn drawn(table: &ActionTable, moment: &Moment, number: usize) -> Option<Draw> {
    let legal: Vec<Draw> = table
        .offers(moment.situation)
        .into_iter()
        .filter_map(|offer| match offer {
            Offer::Legal(draw) => Some(draw),
            Offer::Refused(_) => None,
        })
        .collect();
    let mut rng = rng::stream(number as u64, Stream::Exploration, moment.step as u64);
    let nth = rng::below(&mut rng, legal.len().max(1) as u32) as usize;
    legal.into_iter().nth(nth)
}

/// Marks the rules that a draw breaks; the time of day after it.
fn judge(
    draw: &Draw,
    mut time: TimeOfDay,
    limit_mps: f64,
    moment: &Moment,
    broken: &mut [bool; 5],
) -> TimeOfDay {
    for effect in &draw.effects {
        match effect {
            Effect::Time(next) => {
                broken[0] |= !follows(time, *next);
                time = *next;
            }
            Effect::Spawn(request) if request.body == Body::Pedestrian => {
                broken[3] |= request.speed_mps > 1.4;
                broken[4] |= appears_too_near(request, moment);
            }
            Effect::Spawn(request) => {
                broken[1] |= !gap_is_as_the_paper_says(request);
                broken[2] |= request.speed_mps > limit_mps + 1e-9;
                broken[4] |= appears_too_near(request, moment);
            }
            Effect::Sky(..) => {}
        }
    }
    time
}

fn follows(time: TimeOfDay, next: TimeOfDay) -> bool {
    use TimeOfDay::Morning;
    use TimeOfDay::Night;
    use TimeOfDay::Noon;
    matches!((time, next), (Morning, Morning | Noon) | (Noon, Noon | Night) | (Night, Night | Morning))
}

/// Eq. 7 with the paper's figures, and half a second's lead for the speed.
fn gap_is_as_the_paper_says(request: &SpawnRequest) -> bool {
    let size_m = if matches!(request.body, Body::BoxTruck | Body::SchoolBus) { 3.0 } else { 0.0 };
    let off_m = |mode_m: f64| request.distance_m - (mode_m + size_m + 0.5 * request.speed_mps);
    off_m(12.0).abs() < 1e-9 || (off_m(50.0).abs() < 1e-9 && request.verb != Verb::Overtake)
}

fn appears_too_near(request: &SpawnRequest, moment: &Moment) -> bool {
    match moment.situation.surroundings.survey(request) {
        Ok(facts) => facts.spawn_gap_m < facts.safety_gap_m,
        Err(_) => false,
    }
}
