//! Triggers as conditions of the language, asked while a vehicle waits for its lane change.

use super::scene::{Placed, Setting};
use super::source::{Mark, Source};
use super::trigger::{Condition, Pair, Trigger, When};

/// What holds from the beginning.
const ALWAYS: &str = "elapsed >= 0 s";

/// Why a condition between others is refused.
const NEVER: &str = "at the speeds of the beginning this never comes";

/// Whether a group of conditions holds from the beginning.
pub fn is_always(all: &[Condition]) -> bool {
    all.iter().all(|condition| matches!(condition.kind, When::Always))
}

/// A vehicle that waits for a trigger.
pub struct Waiting<'a> {
    pub actor: &'a Placed<'a>,
    pub setting: &'a Setting<'a>,
}

impl Waiting<'_> {
    /// A trigger in the language; `elapsed >= 0 s` if it holds from the beginning.
    pub fn text(&self, source: &mut Source, trigger: &Trigger) -> Option<String> {
        if trigger.is_empty() || trigger.iter().any(|all| is_always(all)) {
            return Some(ALWAYS.to_owned());
        }
        let mut groups = Vec::new();
        for all in trigger {
            let mut parts = Vec::new();
            for condition in all.iter().filter(|condition| !matches!(condition.kind, When::Always)) {
                parts.push(self.part(source, condition)?);
            }
            groups.push(parts.join(" and "));
        }
        Some(groups.join(" or "))
    }

    fn part(&self, source: &mut Source, condition: &Condition) -> Option<String> {
        let (actor, ego) = (self.actor, self.setting.ego());
        let mark = &condition.mark;
        match &condition.kind {
            When::Always => Some(ALWAYS.to_owned()),
            When::After(seconds) => Some(format!("elapsed >= {seconds:.2} s")),
            When::Headway { pair, seconds } => {
                let gap = self.gap(source, mark, pair)?;
                let (of, mps) = if pair.of == actor.name() { ("npc", actor.mps) } else { ("ego", ego.mps) };
                if self.holds(pair, mps * seconds) {
                    return already(source, condition);
                }
                Some(format!("{gap} {} {of}.speed * {seconds:.3} s", sign(pair)))
            }
            When::Collides { pair, seconds } => {
                let gap = self.gap(source, mark, pair)?;
                let is_behind = self.is_behind();
                let closing_mps = (actor.mps - ego.mps) * if is_behind { 1.0 } else { -1.0 };
                if self.holds(pair, closing_mps * seconds) {
                    return already(source, condition);
                }
                let (back, front) = if is_behind { ("npc", "ego") } else { ("ego", "npc") };
                Some(format!("{gap} < ({back}.speed - {front}.speed) * {seconds:.3} s"))
            }
            When::Distance { pair, metres } if self.is_to_ego(pair) => {
                let gap = self.gap(source, mark, pair)?;
                if self.holds(pair, *metres) {
                    return already(source, condition);
                }
                Some(format!("{gap} {} {metres:.2} m", sign(pair)))
            }
            When::Distance { pair, metres } => {
                let (of, to) = (self.named(source, mark, &pair.of)?, self.named(source, mark, &pair.to)?);
                meeting(source, condition, (of, to), *metres, pair)
            }
            When::Reaches { entity, position, within_m } => {
                let of = self.named(source, mark, entity)?;
                let there = self.setting.ground.beside(source, mark, position)?;
                let station_m = there.station_m - within_m;
                let (from_m, mps) = (of.beside.station_m, of.along_mps());
                if (from_m - there.station_m).abs() <= *within_m {
                    return already(source, condition);
                }
                if entity == ego.name() {
                    let left_m = (self.setting.ground.route.goal_m - station_m).max(0.0);
                    return Some(format!("ego.route_left <= {left_m:.2} m"));
                }
                // One that comes towards the ego vehicle meets the far side of the place first.
                let edge_m = if mps < 0.0 { there.station_m + within_m } else { station_m };
                at(source, mark, (edge_m - from_m) / mps)
            }
        }
    }

    /// Whether a pair is the ego vehicle and the actor.
    fn is_to_ego(&self, pair: &Pair) -> bool {
        let names = [pair.of.as_str(), pair.to.as_str()];
        names.contains(&self.actor.name()) && names.contains(&self.setting.ego().name())
    }

    /// The distance between the ego vehicle and the actor, in the language.
    fn gap(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<String> {
        let (actor, ego) = (self.actor, self.setting.ego());
        let reason = "it must ask about the ego vehicle and the one that acts";
        source.refuse_if(!self.is_to_ego(pair), mark, reason)?;
        if pair.is_free_space {
            return Some("npc.gap".to_owned());
        }
        // From the reference points to those ends that face each other. One that begins behind comes nearer from there, and
        // has passed when it is farther away.
        let faces_front = self.is_behind() && pair.is_less;
        let more_m = match faces_front {
            true => actor.ends_m().0 - actor.beside.station_m - ego.ends_m().1,
            false => ego.ends_m().0 + actor.beside.station_m - actor.ends_m().1,
        };
        Some(format!("npc.gap + {more_m:.2} m"))
    }

    fn is_behind(&self) -> bool {
        self.actor.beside.station_m < 0.0
    }

    /// Whether a distance between the ego vehicle and the actor compares so at the beginning.
    fn holds(&self, pair: &Pair, metres: f64) -> bool {
        let ((front_m, back_m), (ego_front_m, ego_back_m)) =
            (self.actor.ends_m(), self.setting.ego().ends_m());
        let away_m = match pair.is_free_space {
            true => (back_m - ego_front_m).max(ego_back_m - front_m).max(0.0),
            false => self.actor.beside.station_m.abs(),
        };
        if pair.is_less { away_m < metres } else { away_m > metres }
    }

    fn named(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<&Placed<'_>> {
        let is_torn = source.is_torn(name);
        let found = self.setting.find(name).filter(|_| !is_torn);
        if found.is_none() && !is_torn {
            source.refuse::<()>(mark, format!("`{name}` is no vehicle with a place"));
        }
        found
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
    let comes = if pair.is_less { closing_mps > 0.0 } else { closing_mps < 0.0 };
    source.refuse_if(!comes, mark, NEVER)?;
    at(source, mark, (gap_m - metres) / closing_mps)
}

/// A moment that follows from speeds and distances.
fn at(source: &mut Source, mark: &Mark, seconds: f64) -> Option<String> {
    source.refuse_if(!(0.0..1e4).contains(&seconds), mark, NEVER)?;
    source.note(
        "a condition between others is asked at the time at which it comes true if they keep their speeds",
    );
    Some(format!("elapsed >= {seconds:.2} s"))
}
