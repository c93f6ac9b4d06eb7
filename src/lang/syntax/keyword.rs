//! The keywords of the language, each with one sentence for people.
//!
//! The parser takes its suggestions from here, the editor's server its completions. The spellings stand in
//! `grammar/ava.pest` once more, as the rules `kw_…`, `op_…` and `boolean`; a test compares the two.

/// A keyword and what it means.
pub type Keyword = (&'static str, &'static str);

/// Keywords that begin a declaration.
pub const DECLARATIONS: &[Keyword] = &[
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
    ("optional", "A rule or requirement that is off unless asked for with `--with NAME`: `optional rule …`."),
    ("rule", "A named constraint, enforced on every action that it binds; `--without NAME` switches it off."),
    (
        "require",
        "What the ego vehicle must keep, judged at every tick: `require calm: ego.speed <= ego.limit within 1 s`.",
    ),
    ("body", "A body of your own for road users: `body Scooter { like: Motorcycle, mass: 180 kg }`."),
    (
        "manoeuvre",
        "What a road user does, phase by phase: `manoeuvre brake(rate: Accel) { after 3 s { speed: 0 m/s, rate: rate } }`.",
    ),
    (
        "trajectory",
        "A way in a map that a road user follows: `trajectory across { road: corner, lanes: [lane 3/-1 at 0 m, lane 5/-1 at 60 m] }`.",
    ),
    ("road", "A map with a start and a goal, on which episodes are driven."),
    ("episode", "How episodes run: their roads, steps and ends."),
    ("reward", "What an agent learns from: the first case that holds."),
    ("verdict", "What is to be said of a collision; `counted` decides which ones count."),
    ("expect", "A claim that is checked: `expect count(actions) == 45`."),
    ("scenario", "One concrete timeline."),
    ("policy", "What an agent learned."),
    ("override", "Stands in place of the declaration of that kind and name in a used file."),
];

/// The keywords of declarations that cannot be names: each ends every expression before it.
pub const DECLARING: &[&str] = &[
    "language", "use", "enum", "odds", "state", "let", "fn", "action", "group", "optional", "rule",
    "require", "verdict", "scenario", "policy", "override",
];

/// Keywords that begin or join parts of a declaration.
pub const CLAUSES: &[Keyword] = &[
    ("digest", "The content that a used file must have: `use \"a.ava\" digest \"sha256:…\"`."),
    ("without", "What is left out of a used file: `use \"a.ava\" without set_time`."),
    (
        "each",
        "A parameter with a row of the action table for each of its values. `each step { … }`: effects at the end of every step, also of one without an action.",
    ),
    ("any", "A parameter, or the first value of a state, that is drawn from a seeded stream."),
    ("where", "A condition on a parameter and those before it."),
    ("set", "Changes a state: `set sky[Rain] = High`."),
    ("spawn", "Lets a road user appear: `spawn vehicle ahead 20 m { speed: speed, does: DriveAhead }`."),
    (
        "as",
        "A name for what is spawned, by which orders find it: `spawn BoxTruck as truck ahead 40 m { … }`.",
    ),
    (
        "of",
        "The named road user from which the distance of a spawn is measured: `spawn Pedestrian ahead 2 m of bus { … }`.",
    ),
    (
        "apart",
        "The gaps within a row of road users: `spawn BoxTruck as [last, first] ahead 40 m apart 15 m { … }`.",
    ),
    (
        "order",
        "Tells a named road user that is there what to do: `order truck { speed: 0 m/s, rate: 4 m/s^2 }`.",
    ),
    ("also", "More effects for actions, after their own: `on vehicles also { set count = count + 1 }`."),
    ("step", "With `each`, effects at the end of every step: `each step { set age = age + 1 }`."),
    ("ahead", "Before the ego vehicle, along its route."),
    ("behind", "Behind the ego vehicle, along its route: where an overtaker comes from."),
    ("from", "With `behind`, what hides a pedestrian: `spawn Pedestrian ahead 30 m from behind SUV { … }`."),
    (
        "on",
        "The actions that a rule binds or that have more effects, the state whose changes a rule orders, or the trajectory of a \
         spawn: `spawn Sedan on across at 20 m { does: Follow, speed: 8 m/s }`.",
    ),
    ("with", "Values of drawn parameters, or the road user that a claim is about."),
    ("at", "The time of a claim, or the station of a place on a lane or a trajectory."),
    ("by", "The reference drivers that a claim names."),
    ("during", "What a rule restricts instead of the draw: `rule calm on vehicles during change: …`."),
    ("once", "The moment of a scenario's action, or of a phase: `once ego.junction_ahead <= 40 m`."),
    (
        "if",
        "Leaves a phase out where its condition does not hold: `if npc.headway <= 2 s { then: swerve() }`.",
    ),
    ("for", "How long the condition of `once` must have held: `once ego.speed <= 1 m/s for 2 s`."),
    ("repeat", "How often a manoeuvre goes through its phases: `manoeuvre stop_and_go() repeat 3 { … }`."),
    (
        "within",
        "How long a phase waits for its moment, or a requirement for its condition: `once npc.gap <= 20 m within 10 s`.",
    ),
    (
        "after",
        "How long a scenario's action or a phase waits: `after 2.5 s`; in a requirement, what must begin to hold for it to be \
         asked.",
    ),
    ("origin", "Where a file that avastra wrote came from."),
    ("start", "The states at the start of a scenario; in a road, where the ego vehicle starts."),
    ("steps", "The actions of a scenario, by number of the step."),
    ("net", "The exact face of a policy: its network."),
    ("claims", "What a policy's rules say of themselves."),
    ("rules", "The readable face of a policy: the first line that applies acts."),
    ("when", "The condition of a line of a policy, or where a requirement is asked."),
    (
        "unless",
        "Where a requirement that does not hold is excused: `npc.aside >= 1.5 m unless ego.speed < 1 m/s`.",
    ),
    (
        "until",
        "The end of what a requirement asks from `when` on: `when ego.lead_gap <= 5 m until ego.lead_gap >= 10 m`.",
    ),
    ("lane", "A place on a map: `lane 7/-1 at 80 m`, the road's id, the lane's id and the station."),
    ("match", "One value for each variant: `match mode { Near => 12 m, Far => 50 m }`."),
];

/// Operators that are words.
pub const OPERATORS: &[Keyword] = &[
    ("and", "Both sides hold."),
    ("or", "At least one side holds."),
    ("not", "The condition does not hold."),
    ("implies", "Where the left side holds, the right side does."),
    ("in", "The value is one of a list, of a range `low .. high`, or of `road.lanes`."),
];

pub const LITERALS: &[Keyword] =
    &[("true", "The condition that always holds."), ("false", "The condition that never holds.")];

/// Every keyword.
pub fn keywords() -> impl Iterator<Item = &'static Keyword> {
    [DECLARATIONS, CLAUSES, OPERATORS, LITERALS].into_iter().flatten()
}

/// The meaning of a keyword.
pub fn meaning(word: &str) -> Option<&'static str> {
    keywords().find(|(known, _)| *known == word).map(|(_, meaning)| *meaning)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The words that the grammar makes of terminals: `kw_…`, `op_…`, and the truth values.
    fn grammar_words() -> BTreeSet<&'static str> {
        let grammar = include_str!("../grammar/ava.pest");
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

    /// The words in a rule of the grammar.
    fn words_of(rule: &str) -> BTreeSet<&'static str> {
        let grammar = include_str!("../grammar/ava.pest");
        let body = grammar.split(&format!("\n{rule} = @{{")).nth(1).and_then(|rest| rest.split("\n}").next());
        let quoted = body.unwrap_or_else(|| panic!("no rule {rule}")).split('"').skip(1).step_by(2);
        quoted.filter(|word| word.starts_with(|c: char| c.is_ascii_alphabetic())).collect()
    }

    /// Where one declaration ends and the next begins is told by lists of their own.
    #[test]
    fn the_lists_of_the_grammar_hold_every_declaration() {
        let declarations: BTreeSet<&str> = DECLARATIONS.iter().map(|(word, _)| *word).collect();
        // `on … also` and `each step` begin one, too.
        let begins = words_of("declaration_keyword");
        assert_eq!(begins, declarations.union(&BTreeSet::from(["on", "each", "step"])).copied().collect());
        assert_eq!(words_of("declaring_word"), DECLARING.iter().copied().collect());
        let (no_name, no_unit) = (words_of("declaring_word"), words_of("unit_stop"));
        assert!(no_name.is_subset(&declarations), "{no_name:?}");
        assert!(no_unit.iter().all(|word| meaning(word).is_some()), "{no_unit:?}");
        let stops: BTreeSet<&str> = no_name.union(&no_unit).copied().collect();
        assert!(declarations.is_subset(&stops), "{:?}", declarations.difference(&stops));
    }
}
