//! The language's own words, each with a sentence for a reader: keywords, types, units, fields and
//! what the engine knows.
//!
//! Keywords follow `grammar/ava.pest`, fields the checker in `model::check`; a test here compares the
//! keywords with the grammar. Whatever the author declares is in the files and not here.

use crate::model::vocabulary::{Body, Colour, LaneChoice, Side, Then, Verb, Word};
use crate::model::{ENDS, MODULES};

/// A word and what it means.
pub type Entry = (&'static str, &'static str);

/// What begins a declaration.
pub const DECLARATIONS: &[Entry] = &[
    ("language", "The version of the language that the file is written in; its first line: `language 1`."),
    ("use", "Takes everything that another file declares: `use \"roads.ava\"`."),
    ("enum", "A finite type: `enum Side = Left | Right`, or ordered: `enum Level = None < Light < High`."),
    ("odds", "How often variants are drawn, beside each other: `odds Vehicle { BoxTruck => 2 }`."),
    ("state", "What is remembered between steps: `state time: Time = any`."),
    ("let", "A constant: `let weight = 1.5`."),
    ("fn", "A pure function: `fn lead(v: Speed) -> Length = v * 0.5 s`."),
    (
        "action",
        "What may be done in a step. Its `each` parameters make rows of the action table, its `any` parameters are drawn.",
    ),
    ("group", "A name for several actions: `group vehicles = drive_ahead, overtake`."),
    ("optional", "A rule that is off unless asked for with `--with NAME`: `optional rule …`."),
    ("rule", "A named constraint, enforced on every action that it binds; `--without NAME` switches it off."),
    ("road", "A map with a start and a goal, on which episodes are driven."),
    ("episode", "How episodes run: their roads, steps and ends."),
    ("reward", "What an agent learns from: the first case that holds."),
    ("verdict", "What is to be said of a collision; `counted` decides which ones count."),
    ("expect", "A claim that is checked: `expect count(actions) == 45`."),
    ("scenario", "One concrete timeline."),
    ("policy", "What an agent learned."),
    ("override", "Stands in place of the declaration of that kind and name in a used file."),
];

/// What begins or joins a part of a declaration.
pub const CLAUSES: &[Entry] = &[
    ("digest", "The content that a used file must have: `use \"a.ava\" digest \"sha256:…\"`."),
    ("without", "What is left out of a used file: `use \"a.ava\" without set_time`."),
    ("each", "A parameter with a row of the action table for each of its values."),
    ("any", "A parameter, or the first value of a state, that is drawn from a seeded stream."),
    ("where", "A condition on a parameter and those before it."),
    ("set", "Changes a state: `set sky[Rain] = High`."),
    ("spawn", "Lets a road user appear: `spawn vehicle ahead 20 m { speed: speed, does: DriveAhead }`."),
    ("ahead", "Before the ego vehicle, along its route."),
    ("behind", "Behind the ego vehicle, along its route: where an overtaker comes from."),
    ("on", "The actions that a rule binds, or the state whose changes it orders."),
    ("with", "Values of drawn parameters, or the road user that a claim is about."),
    ("at", "The time of a claim, or the station of a place on a lane."),
    ("by", "The reference drivers that a claim names."),
    ("origin", "Where a file that avastra wrote came from."),
    ("start", "The states at the start of a scenario; in a road, where the ego vehicle starts."),
    ("steps", "The actions of a scenario, by number of the step."),
    ("net", "The exact face of a policy: its network."),
    ("claims", "What a policy's rules say of themselves."),
    ("rules", "The readable face of a policy: the first line that applies acts."),
    ("when", "The condition of a line of a policy."),
    ("lane", "A place on a map: `lane 7/-1 at 80 m`, the road's id, the lane's id and the station."),
    ("match", "One value for each variant: `match mode { Near => 12 m, Far => 50 m }`."),
];

/// Operators that are words.
pub const OPERATORS: &[Entry] = &[
    ("and", "Both sides hold."),
    ("or", "At least one side holds."),
    ("not", "The condition does not hold."),
    ("implies", "Where the left side holds, the right side does."),
    ("in", "The value is one of a list, of a range `low .. high`, or of `road.lanes`."),
];

pub const LITERALS: &[Entry] =
    &[("true", "The condition that always holds."), ("false", "The condition that never holds.")];

/// Types that nobody declares.
pub const TYPES: &[Entry] = &[
    ("Bool", "`true` or `false`."),
    ("Int", "A whole number; may stand wherever a ratio may."),
    ("Ratio", "A number without a unit, or with `%`."),
    ("Length", "In `m` or `km`."),
    ("Duration", "In `s`, `ms` or `min`."),
    ("Speed", "In `m/s`, `km/h` or `mph`."),
    ("Accel", "In `m/s^2`."),
    ("Angle", "In `deg` or `rad`."),
];

pub const EPISODE_FIELDS: &[Entry] = &[
    ("roads", "The roads on which episodes are driven, in this order: `roads: [corner, boulevard]`."),
    ("step", "The observation period after each action: `step: 6 s`."),
    ("stop", "What ends an episode: `arrived`, `stalled >= 4`, or both with `or`."),
    ("limit", "The steps after which an episode is cut off: `limit: 20 steps`."),
];

pub const ROAD_FIELDS: &[Entry] = &[
    ("map", "The OpenDRIVE file, relative to this file: `map: \"roads/corner.xodr\"`."),
    ("start", "Where the ego vehicle starts: `start: lane 1/-1 at 12 m`."),
    ("goal", "Where it is to arrive: `goal: lane 7/-1 at 80 m`."),
    ("limit", "A lower limit for the whole road: `limit: 30 km/h`."),
];

pub const SPAWN_FIELDS: &[Entry] = &[
    ("does", "What the road user does: a verb of the engine."),
    ("lane", "Its lane, seen from the ego vehicle: `Left`, `Current` or `Right`."),
    ("side", "The side that it comes from: `Left` or `Right`."),
    ("then", "Whether it keeps its lane or changes it: `Keep` or `Change`."),
    ("speed", "How fast it is."),
    ("colour", "Its paint."),
];

pub const START_FIELDS: &[Entry] = &[
    ("signal_phase", "Where the cycle of the signals begins, in seconds."),
    ("traffic_seed", "The seed of the choices of other road users."),
    ("ambient", "The number of vehicles of ambient traffic."),
];

/// What a spawn may be asked about, in rules.
pub const SPAWN_FACTS: &[Entry] = &[
    ("spawn_gap", "A `Length`: the gap between the ego vehicle and who appears."),
    ("safety_gap", "A `Length`: the gap that a careful driver needs."),
];

/// What a step or a collision may be asked about, in rewards and verdicts.
pub const OUTCOME_FACTS: &[Entry] = &[
    ("proc", "A `Ratio`: the collision probability of the step."),
    ("collision", "A `Bool`: the ego vehicle collided."),
    ("repeated", "A `Bool`: with an obstacle that it has hit before."),
    ("sudden", "A `Bool`: with an obstacle that appeared a moment ago."),
    ("struck", "A `Bool`: the obstacle ran into the side or the rear of the ego vehicle."),
    ("avoidable", "A `Bool`: a careful reference driver avoids it. Verdicts only."),
];

/// What may be asked about the road, in rules.
pub const ROAD_FACTS: &[Entry] = &[
    ("limit", "A `Speed`: the lowest limit along the route."),
    ("lanes", "The lanes in the ego vehicle's direction: `lane in road.lanes`."),
];

/// What an episode may stop for.
pub const STOPS: &[Entry] =
    &[("arrived", "The ego vehicle is at the goal."), ("stalled", "Steps without progress: `stalled >= 4`.")];

/// What a space may claim of itself.
pub const CLAIMS: &[Entry] = &[
    ("count", "The number of rows of an action, a group, or all `actions`: `count(actions)`."),
    ("every", "`every(actions, realisable)`: each row can run on some road."),
    ("actions", "All actions."),
    ("realisable", "Not proved dead on every road."),
];

/// What a scenario may claim beside facts and verdicts.
pub const SCENARIO_CLAIMS: &[Entry] = &[
    ("cause", "The module at fault: `expect cause == perception`."),
    ("end", "How the episode ends: `expect end == arrived`."),
    ("minimal", "Without any one of its steps the scenario loses its crash."),
    ("trace", "The digest of the whole state stream: `expect trace == \"sha256:…\"`."),
];

/// A step without an action.
pub const WAIT: Entry = ("wait", "A step without an action: `3: wait()`.");

/// What one of the engine's verbs does.
fn verb(verb: Verb) -> &'static str {
    match verb {
        Verb::DriveAhead => "Drives ahead of the ego vehicle in the same direction.",
        Verb::Overtake => "Comes from behind, faster, and passes.",
        Verb::DriveOpposite => "Comes towards the ego vehicle in an opposing lane.",
        Verb::CrossRoad => "Crosses the ego vehicle's way at a junction.",
        Verb::Walk => "A pedestrian who crosses the road on foot.",
        Verb::Stand => "A pedestrian who stands in the lane.",
    }
}

/// The engine's words for a field of a spawn; `body` is what stands before `ahead` or `behind`.
pub fn engine_words(field: &str) -> Vec<Entry> {
    fn named<W: Word>(meaning: &'static str) -> Vec<Entry> {
        W::ALL.iter().map(|word| (word.name(), meaning)).collect()
    }
    match field {
        "does" => Verb::ALL.iter().map(|word| (word.name(), verb(*word))).collect(),
        "lane" => named::<LaneChoice>("A lane, seen from the ego vehicle's lane."),
        "side" => named::<Side>("A side, seen from the ego vehicle's lane."),
        "then" => named::<Then>("Whether a vehicle keeps its lane or changes it."),
        "colour" => named::<Colour>("A paint."),
        "body" => named::<Body>("The body of a road user."),
        _ => Vec::new(),
    }
}

/// The words of a claim in a scenario: how an episode ends, and who is at fault.
pub fn claim_words(claim: &str) -> &'static [&'static str] {
    match claim {
        "end" => &ENDS,
        "cause" => &MODULES,
        _ => &[],
    }
}

/// Every keyword.
pub fn keywords() -> impl Iterator<Item = &'static Entry> {
    [DECLARATIONS, CLAUSES, OPERATORS, LITERALS].into_iter().flatten()
}

/// What a word of a list means.
pub fn meaning(words: &[Entry], word: &str) -> Option<&'static str> {
    words.iter().find(|(known, _)| *known == word).map(|(_, meaning)| *meaning)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The words that the grammar makes of terminals: `kw_…`, `op_…`, and the truth values.
    fn grammar_words() -> BTreeSet<&'static str> {
        let grammar = include_str!("../../../grammar/ava.pest");
        let is_word_rule =
            |line: &&str| ["kw_", "op_", "boolean"].iter().any(|start| line.starts_with(start));
        let quoted = grammar.lines().filter(is_word_rule).flat_map(|line| line.split('"').skip(1).step_by(2));
        quoted.filter(|word| word.chars().all(|c| c.is_ascii_alphabetic())).collect()
    }

    #[test]
    fn the_keywords_are_those_of_the_grammar() {
        let ours: BTreeSet<&str> = keywords().map(|(word, _)| *word).collect();
        assert_eq!(ours, grammar_words());
    }

    #[test]
    fn the_types_are_those_of_the_checker() {
        let named = crate::units::Dimension::NAMED.iter().map(|(_, name, _)| *name);
        let known: BTreeSet<&str> = named.chain(["Bool", "Int"]).collect();
        assert_eq!(TYPES.iter().map(|(word, _)| *word).collect::<BTreeSet<_>>(), known);
    }
}
