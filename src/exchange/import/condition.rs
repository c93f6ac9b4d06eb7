//! Triggers as conditions of the language, asked while a vehicle waits for its lane change.

use super::ground::Ground;
use super::scene::Placed;
use super::source::{Mark, Source};
use super::trigger::{Condition, Pair, Trigger, When};

/// What holds from the beginning.
const ALWAYS: &str = "elapsed >= 0 s";

/// Whether a group of conditions holds from the beginning.
pub fn is_always(all: &[Condition]) -> bool {
    all.iter().all(|condition| matches!(condition.kind, When::Always))
}

/// A trigger for an action of `actor`, in the language; `elapsed >= 0 s` if it holds from the beginning.
pub fn text(
    source: &mut Source,
    ground: &Ground,
    trigger: &Trigger,
    actor: &Placed,
    placed: &[Placed],
) -> Option<String> {
    if trigger.is_empty() || trigger.iter().any(|all| is_always(all)) {
        return Some(ALWAYS.to_owned());
    }
    let mut groups = Vec::new();
    for all in trigger {
        let mut parts = Vec::new();
        for condition in all.iter().filter(|condition| !matches!(condition.kind, When::Always)) {
            parts.push(part(source, ground, condition, actor, placed)?);
        }
        groups.push(parts.join(" and "));
    }
    Some(groups.join(" or "))
}

fn part(
    source: &mut Source,
    ground: &Ground,
    condition: &Condition,
    actor: &Placed,
    placed: &[Placed],
) -> Option<String> {
    let mark = &condition.mark;
    match &condition.kind {
        When::Always => Some(ALWAYS.to_owned()),
        When::After(seconds) => Some(format!("elapsed >= {seconds:.2} s")),
        When::Headway { pair, seconds } => {
            let gap = gap(source, mark, pair, actor, placed)?;
            let (of, mps) = if pair.of == actor.name() { ("npc", actor.mps) } else { ("ego", placed[0].mps) };
            if holds(pair, actor, placed, mps * seconds) {
                return already(source, condition);
            }
            Some(format!("{gap} {} {of}.speed * {seconds:.3} s", sign(pair)))
        }
        When::Collides { pair, seconds } => {
            let gap = gap(source, mark, pair, actor, placed)?;
            let closing_mps = (actor.mps - placed[0].mps) * if is_behind(actor) { 1.0 } else { -1.0 };
            if holds(pair, actor, placed, closing_mps * seconds) {
                return already(source, condition);
            }
            let (back, front) = if is_behind(actor) { ("npc", "ego") } else { ("ego", "npc") };
            Some(format!("{gap} < ({back}.speed - {front}.speed) * {seconds:.3} s"))
        }
        When::Distance { pair, metres } => {
            let names = [pair.of.as_str(), pair.to.as_str()];
            if names.contains(&actor.name()) && names.contains(&placed[0].name()) {
                let gap = gap(source, mark, pair, actor, placed)?;
                if holds(pair, actor, placed, *metres) {
                    return already(source, condition);
                }
                return Some(format!("{gap} {} {metres:.2} m", sign(pair)));
            }
            let (of, to) = (named(source, mark, &pair.of, placed)?, named(source, mark, &pair.to, placed)?);
            meeting(source, condition, (of, to), *metres, pair)
        }
        When::Reaches { entity, position, within_m } => {
            let of = named(source, mark, entity, placed)?;
            let there = ground.beside(source, mark, position)?;
            let station_m = there.station_m - within_m;
            let (from_m, mps) = (of.beside.station_m, of.along_mps());
            if (from_m - there.station_m).abs() <= *within_m {
                return already(source, condition);
            }
            if entity == placed[0].name() {
                return Some(format!(
                    "ego.route_left <= {:.2} m",
                    (ground.route.goal_m - station_m).max(0.0)
                ));
            }
            // One that comes towards the ego vehicle meets the far side of the place first.
            let edge_m = if mps < 0.0 { there.station_m + within_m } else { station_m };
            at(source, mark, (edge_m - from_m) / mps)
        }
    }
}

/// What holds from the beginning, unless it is asked to begin to hold.
fn already(source: &mut Source, condition: &Condition) -> Option<String> {
    if condition.is_rising {
        let reason =
            "it holds from the beginning, so `rising` never comes: with `conditionEdge=\"none\"` it is read";
        return source.refuse(&condition.mark, reason);
    }
    Some(ALWAYS.to_owned())
}

fn sign(pair: &Pair) -> &'static str {
    if pair.is_less { "<" } else { ">" }
}

/// The distance between the ego vehicle and the actor, in the language.
fn gap(source: &mut Source, mark: &Mark, pair: &Pair, actor: &Placed, placed: &[Placed]) -> Option<String> {
    let ego = &placed[0];
    let names = [pair.of.as_str(), pair.to.as_str()];
    if !(names.contains(&actor.name()) && names.contains(&ego.name())) {
        return source.refuse(mark, "it must ask about the ego vehicle and the one that acts");
    }
    if pair.is_free_space {
        return Some("npc.gap".to_owned());
    }
    // From the reference points to those ends that face each other. One that begins behind comes nearer from there, and
    // has passed when it is farther away.
    let faces_front = is_behind(actor) && pair.is_less;
    let more_m = match faces_front {
        true => actor.ends_m().0 - actor.beside.station_m - ego.ends_m().1,
        false => ego.ends_m().0 + actor.beside.station_m - actor.ends_m().1,
    };
    Some(format!("npc.gap + {more_m:.2} m"))
}

fn is_behind(actor: &Placed) -> bool {
    actor.beside.station_m < 0.0
}

/// Whether a distance between the ego vehicle and the actor compares so at the beginning.
fn holds(pair: &Pair, actor: &Placed, placed: &[Placed], metres: f64) -> bool {
    let ((front_m, back_m), (ego_front_m, ego_back_m)) = (actor.ends_m(), placed[0].ends_m());
    let away_m = match pair.is_free_space {
        true => (back_m - ego_front_m).max(ego_back_m - front_m).max(0.0),
        false => actor.beside.station_m.abs(),
    };
    if pair.is_less { away_m < metres } else { away_m > metres }
}

/// When two that keep their speeds are so far from each other.
fn meeting(
    source: &mut Source,
    condition: &Condition,
    (of, to): (&Placed, &Placed),
    metres: f64,
    pair: &Pair,
) -> Option<String> {
    let mark = &condition.mark;
    let (front, back) = if of.beside.station_m <= to.beside.station_m { (to, of) } else { (of, to) };
    let gap_m = match pair.is_free_space {
        true => front.ends_m().1 - back.ends_m().0,
        false => front.beside.station_m - back.beside.station_m,
    };
    if if pair.is_less { gap_m < metres } else { gap_m > metres } {
        return already(source, condition);
    }
    let closing_mps = back.along_mps() - front.along_mps();
    let seconds = (gap_m - metres) / closing_mps;
    if closing_mps > 0.0 && pair.is_less || closing_mps < 0.0 && !pair.is_less {
        return at(source, mark, seconds);
    }
    source.refuse(mark, "at the speeds of the beginning this never comes")
}

/// A moment that follows from speeds and distances.
fn at(source: &mut Source, mark: &Mark, seconds: f64) -> Option<String> {
    if !(0.0..1e4).contains(&seconds) {
        return source.refuse(mark, "at the speeds of the beginning this never comes");
    }
    source.note(
        "a condition between others is asked at the time at which it comes true if they keep their speeds",
    );
    Some(format!("elapsed >= {seconds:.2} s"))
}

fn named<'a>(
    source: &mut Source,
    mark: &Mark,
    name: &str,
    placed: &'a [Placed<'a>],
) -> Option<&'a Placed<'a>> {
    let found = placed.iter().find(|other| other.name() == name && !source.is_torn(name));
    if found.is_none() && !source.is_torn(name) {
        source.refuse::<()>(mark, format!("`{name}` is no vehicle with a place"));
    }
    found
}
