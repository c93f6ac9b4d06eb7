//! The promise, audited by drawing: random spaces with rules of every form, judged by a twin that shares no code with
//! the language. From the first moment on no rule is broken, what the checker calls realisable is drawn, and what it
//! calls dead or out of reach is not.
//!
//! `verdicts_agree_with_sampling` in `sound` did not see that rows were never realised and that the start was not
//! checked: it asks only that dead rows are not drawn and that witnesses run, so that a refused draw passed; its rules
//! read no state in a bound and bind one action by name; and what it draws is judged by the code that draws.
//!
//! This audit in turn did not see that time alone may break a rule: its rules asked for no time, only draws were
//! judged, and a step without an action was played only where every step does something. Now rules ask for `step` and
//! `elapsed`, every kind of space has such steps and whole episodes of them, and the states are judged after each. What
//! the checker says of rows for which an episode is too short is asked too: episodes end where those of the space do.

use core::fmt;
use std::collections::BTreeMap;

use crate::action::tests::Plain;
use crate::action::tests::sound::compiled;
use crate::action::{ActionTable, Draw, Offer, Situation, SpawnFacts, SpawnRequest, Surroundings};
use crate::model::{Memory, MomentFacts, Row, RulesInForce, Space, Type, Value, code};
use crate::prove::{Realised, realise};
use crate::rng;
use crate::rng::{Rng, Stream};

/// The most draws in which a row that the checker calls realisable is drawn once.
const DRAWS_MAX: u32 = 10_000;
/// Steps of an episode.
const STEPS: u64 = 12;

const LEVELS: [&str; 3] = ["None", "Light", "High"];
const KEYS: [&str; 2] = ["Front", "Back"];
const OPS: [&str; 6] = ["<", "<=", ">", ">=", "==", "!="];
const ROADS: [(&str, f64); 2] = [("corner", 11.0), ("slow", 8.0)];

/// A number of a rule, of the dimension of its place.
#[derive(Clone)]
enum Number {
    /// With its unit.
    Literal(f64, &'static str),
    Parameter(&'static str),
    /// `base(mode)`.
    Base,
    /// `far(LEVEL)`.
    Far(Level),
    /// `lead(speed)`.
    Lead(Box<Number>),
    Sum(Box<Number>, Box<Number>),
    Times(f64, Box<Number>),
    Limit,
    Count,
}

#[derive(Clone)]
enum Level {
    Literal(usize),
    Fog,
    Wet(usize),
}

#[derive(Clone)]
enum Condition {
    Compare(&'static str, Number, Number),
    InRange(Number, Number, Number),
    InList(Number, Vec<Number>),
    Level(&'static str, Level, Level),
    Mode(bool),
    Same,
    Flag,
    Road(usize),
    /// `step >= 3`.
    Step(&'static str, u64),
    /// `elapsed >= 18 s`.
    Elapsed(&'static str, u64),
    /// `quiet(LEVEL)`.
    Quiet(Level),
    Not(Box<Condition>),
    Join(&'static str, Box<Condition>, Box<Condition>),
}

#[derive(Clone)]
enum Binds {
    /// The actions of these names, as the group or action of that name.
    On(&'static str),
    /// The states, always.
    Always,
}

enum Rule {
    Holds(Binds, Condition),
    /// Which levels `fog` may move to.
    Fog([[bool; 3]; 3]),
}

/// What every step does at its end.
#[derive(Clone, Copy, PartialEq)]
enum EachStep {
    Nothing,
    FogLifts,
    CountFalls,
    FlagTurns,
    FogSoaks,
}

impl EachStep {
    fn text(self) -> &'static str {
        match self {
            EachStep::Nothing => "",
            EachStep::FogLifts => {
                "each step { set fog = match fog { None | Light => None\n  High => Light } }\n"
            }
            EachStep::CountFalls => "each step { set count = match count { 0 => 0\n  _ => count - 1 } }\n",
            EachStep::FlagTurns => "each step { set flag = match flag { true => false\n  false => true } }\n",
            EachStep::FogSoaks => "each step { set wet[Back] = fog }\n",
        }
    }
}

/// A space: its text without rules, and its rules.
struct Made {
    text: String,
    each_step: EachStep,
    rules: Vec<Rule>,
}

/// What a rule may ask about, as the twin knows it.
#[derive(Clone)]
struct Twin {
    road: usize,
    step: u64,
    fog: usize,
    wet: [usize; 2],
    was: usize,
    flag: bool,
    count: f64,
    numbers: BTreeMap<String, f64>,
    mode: usize,
}

impl Number {
    fn value(&self, twin: &Twin) -> f64 {
        match self {
            Number::Literal(value, _) => *value,
            Number::Parameter(name) => twin.numbers[*name],
            Number::Base => [12.0, 50.0][twin.mode],
            Number::Far(level) => [20.0, 40.0, 60.0][level.value(twin)],
            Number::Lead(speed) => 2.0 * speed.value(twin) + 1.0,
            Number::Sum(a, b) => a.value(twin) + b.value(twin),
            Number::Times(factor, of) => factor * of.value(twin),
            Number::Limit => ROADS[twin.road].1,
            Number::Count => twin.count,
        }
    }
}

impl Level {
    fn value(&self, twin: &Twin) -> usize {
        match self {
            Level::Literal(level) => *level,
            Level::Fog => twin.fog,
            Level::Wet(key) => twin.wet[*key],
        }
    }
}

impl Condition {
    fn asks_for_time(&self) -> bool {
        match self {
            Condition::Step(..) | Condition::Elapsed(..) => true,
            Condition::Not(of) => of.asks_for_time(),
            Condition::Join(_, a, b) => a.asks_for_time() || b.asks_for_time(),
            _ => false,
        }
    }

    fn holds(&self, twin: &Twin) -> bool {
        match self {
            Condition::Compare(op, a, b) => compared(op, a.value(twin), b.value(twin)),
            Condition::InRange(of, low, high) => {
                (low.value(twin)..=high.value(twin)).contains(&of.value(twin))
            }
            Condition::InList(of, list) => {
                list.iter().any(|item| compared("==", of.value(twin), item.value(twin)))
            }
            Condition::Level(op, a, b) => compared(op, a.value(twin) as f64, b.value(twin) as f64),
            Condition::Mode(is_near) => (twin.mode == 0) == *is_near,
            Condition::Same => twin.mode == twin.was,
            Condition::Flag => twin.flag,
            Condition::Road(road) => twin.road == *road,
            Condition::Step(op, step) => compared(op, twin.step as f64, *step as f64),
            Condition::Elapsed(op, time_s) => compared(op, 6.0 * twin.step as f64, *time_s as f64),
            Condition::Quiet(level) => level.value(twin) < 2,
            Condition::Not(of) => !of.holds(twin),
            Condition::Join(word, a, b) => match *word {
                "and" => a.holds(twin) && b.holds(twin),
                "or" => a.holds(twin) || b.holds(twin),
                _ => !a.holds(twin) || b.holds(twin),
            },
        }
    }
}

/// Numbers that differ in the tenth digit are equal, as the language says.
fn compared(op: &str, a: f64, b: f64) -> bool {
    let equal = a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
    match op {
        "<" => a < b,
        "<=" => a <= b,
        ">" => a > b,
        ">=" => a >= b,
        "==" => equal,
        _ => !equal,
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Number::Literal(value, unit) => write!(f, "{value} {unit}"),
            Number::Parameter(name) => f.write_str(name),
            Number::Base => f.write_str("base(mode)"),
            Number::Far(level) => write!(f, "far({level})"),
            Number::Lead(speed) => write!(f, "lead({speed})"),
            Number::Sum(a, b) => write!(f, "({a} + {b})"),
            Number::Times(factor, of) => write!(f, "{factor} * {of}"),
            Number::Limit => f.write_str("road.limit"),
            Number::Count => f.write_str("count"),
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Level::Literal(level) => f.write_str(LEVELS[*level]),
            Level::Fog => f.write_str("fog"),
            Level::Wet(key) => write!(f, "wet[{}]", KEYS[*key]),
        }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Condition::Compare(op, a, b) => write!(f, "{a} {op} {b}"),
            Condition::InRange(of, low, high) => write!(f, "{of} in {low} .. {high}"),
            Condition::InList(of, list) => {
                let list: Vec<String> = list.iter().map(Number::to_string).collect();
                write!(f, "{of} in [{}]", list.join(", "))
            }
            Condition::Level(op, a, b) => write!(f, "{a} {op} {b}"),
            Condition::Mode(is_near) => write!(f, "mode {} Near", if *is_near { "==" } else { "!=" }),
            Condition::Same => f.write_str("mode == was"),
            Condition::Flag => f.write_str("flag"),
            Condition::Road(road) => write!(f, "road == {}", ROADS[*road].0),
            Condition::Step(op, step) => write!(f, "step {op} {step}"),
            Condition::Elapsed(op, time_s) => write!(f, "elapsed {op} {time_s} s"),
            Condition::Quiet(level) => write!(f, "quiet({level})"),
            Condition::Not(of) => write!(f, "not ({of})"),
            Condition::Join(word, a, b) => write!(f, "({a}) {word} ({b})"),
        }
    }
}

/// Makes spaces from a seed.
struct Maker(Rng);

impl Maker {
    fn below(&mut self, count: u32) -> usize {
        rng::below(&mut self.0, count) as usize
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u32)]
    }

    fn level(&mut self) -> Level {
        match self.below(3) {
            0 => Level::Fog,
            key => Level::Wet(key - 1),
        }
    }

    fn speed(&mut self) -> Number {
        match self.below(3) {
            0 => Number::Limit,
            1 => Number::Times(0.5 + 0.25 * self.below(4) as f64, Box::new(Number::Limit)),
            _ => Number::Literal(1.0 + self.below(14) as f64, "m/s"),
        }
    }

    fn length(&mut self, lengths: &[&'static str], has_mode: bool) -> Number {
        match self.below(7) {
            0 if has_mode => Number::Base,
            1 => Number::Far(self.level()),
            2 => Number::Lead(Box::new(Number::Parameter("speed"))),
            3 => {
                let parts = [self.length(lengths, has_mode), self.length(lengths, has_mode)];
                let [a, b] = parts.map(Box::new);
                Number::Sum(a, b)
            }
            4 => Number::Times(
                0.5 + 0.5 * self.below(3) as f64,
                Box::new(Number::Parameter(self.one(lengths))),
            ),
            _ => Number::Literal(10.0 + self.below(60) as f64, "m"),
        }
    }

    /// A condition on states and the road.
    fn of_states(&mut self) -> Condition {
        match self.below(6) {
            0 => Condition::Flag,
            1 => Condition::Quiet(self.level()),
            2 => Condition::Compare(self.one(&["<", "<=", "!="]), Number::Count, Number::Literal(3.0, "")),
            3 => Condition::Level(self.one(&OPS), self.level(), self.level()),
            4 => {
                let (a, b) = (self.of_states(), self.of_states());
                Condition::Join(self.one(&["and", "or", "implies"]), Box::new(a), Box::new(b))
            }
            _ => Condition::Level(self.one(&OPS), self.level(), Level::Literal(self.below(3))),
        }
    }

    /// A condition on states and time.
    fn of_time(&mut self) -> Condition {
        let op = self.one(&["<", "<", "<", "<=", "<=", ">", ">=", "=="]);
        let time = match self.below(2) {
            0 => Condition::Step(op, self.below(6) as u64),
            _ => Condition::Elapsed(op, self.below(40) as u64),
        };
        let of_states = self.of_states();
        Condition::Join(self.one(&["implies", "implies", "or"]), Box::new(time), Box::new(of_states))
    }

    /// A condition on an action with `speed`, these lengths, and perhaps `mode`.
    fn of_action(&mut self, lengths: &[&'static str], has_mode: bool, depth: u32) -> Condition {
        let a_length = Number::Parameter(lengths.first().copied().unwrap_or("speed"));
        match self.below(if depth == 0 { 9 } else { 13 }) {
            0 | 1 => Condition::Compare(self.one(&OPS), Number::Parameter("speed"), self.speed()),
            2 | 3 if !lengths.is_empty() => Condition::Compare(
                self.one(&OPS),
                Number::Parameter(self.one(lengths)),
                self.length(lengths, has_mode),
            ),
            4 if !lengths.is_empty() => {
                let list = (0..1 + self.below(3)).map(|_| Number::Literal(10.0 + self.below(60) as f64, "m"));
                Condition::InList(a_length, list.collect())
            }
            5 => {
                let low = 1.0 + self.below(9) as f64;
                let ends = [low, low + self.below(5) as f64].map(|end| Number::Literal(end, "m/s"));
                let [low, high] = ends;
                Condition::InRange(Number::Parameter("speed"), low, high)
            }
            6 if has_mode && self.below(3) == 0 => Condition::Same,
            6 if has_mode => Condition::Mode(self.below(2) == 0),
            7 => Condition::Road(self.below(2)),
            8 => self.of_states(),
            9 => Condition::Not(Box::new(self.of_action(lengths, has_mode, depth - 1))),
            n if n >= 10 => {
                let (a, b) = (
                    self.of_action(lengths, has_mode, depth - 1),
                    self.of_action(lengths, has_mode, depth - 1),
                );
                Condition::Join(self.one(&["and", "or", "implies", "implies"]), Box::new(a), Box::new(b))
            }
            _ => Condition::Compare("<=", Number::Parameter("speed"), self.speed()),
        }
    }

    fn space(&mut self) -> Made {
        let mut rules = Vec::new();
        for _ in 0..1 + self.below(3) {
            rules.push(Rule::Holds(Binds::On("ahead"), self.of_action(&["distance"], true, 2)));
        }
        for _ in 0..self.below(3) {
            rules.push(Rule::Holds(Binds::On("pair"), self.of_action(&["a", "b"], false, 2)));
        }
        if self.below(2) == 0 {
            rules.push(Rule::Holds(Binds::On("cars"), self.of_action(&[], false, 1)));
        }
        for _ in 0..self.below(3) {
            rules.push(Rule::Holds(Binds::Always, self.of_states()));
        }
        for _ in 0..self.below(3) {
            rules.push(Rule::Holds(Binds::Always, self.of_time()));
        }
        if self.below(3) == 0 {
            let mut moves = [[false; 3]; 3];
            for (from, moves) in moves.iter_mut().enumerate() {
                moves.iter_mut().for_each(|allowed| *allowed = self.below(2) == 0);
                moves[(from + 1) % 3] = true;
            }
            rules.push(Rule::Fog(moves));
        }
        let begin = |any: bool, fixed: &str| if any { "any".to_owned() } else { fixed.to_owned() };
        let any = [(); 4].map(|()| self.below(2) == 0);
        let range = |maker: &mut Maker, max: u32| {
            let (a, b) = (1 + maker.below(max), 1 + maker.below(max));
            (a.min(b), a.max(b))
        };
        let (speed, distance, a, b) = (range(self, 16), range(self, 70), range(self, 70), range(self, 70));
        let text = format!(
            "language 1
enum Mode = Near | Far
enum Level = None < Light < High
enum Key = Front | Back
enum Car = Sedan | SUV | Jeep
state fog: Level = {}
state wet: Key -> Level = {}
state was: Mode = {}
state flag: Bool = {}
state count: Int = 0
road corner {{ map: \"made_up.xodr\" start: lane 1/-1 at 10 m goal: lane 1/-1 at 90 m }}
road slow {{ map: \"made_up.xodr\" start: lane 1/-1 at 10 m goal: lane 1/-1 at 90 m limit: 8 m/s }}
fn base(mode: Mode) -> Length = match mode {{ Near => 12 m
  Far => 50 m }}
fn far(w: Level) -> Length = match w {{ None => 20 m
  Light => 40 m
  High => 60 m }}
fn lead(v: Speed) -> Length = 2 s * v + 1 m
fn quiet(w: Level) -> Bool = match w {{ None | Light => true
  High => false }}
action thicken(each to: Level) {{ set fog = to }}
action soak(each at: Key, any how: Level) {{ set wet[at] = how }}
action turn(each on: Bool) {{ set flag = on }}
action tick() {{ set count = count + 1 }}
action ahead(each mode: Mode, any speed: Speed in {} m/s .. {} m/s, any distance: Length in {} m .. {} m, any car: Car) {{
  spawn car ahead distance {{ lane: Current, speed: speed, does: DriveAhead }}
  set was = mode
}}
action pair(any speed: Speed in {} m/s .. {} m/s, any a: Length in {} m .. {} m, any b: Length in {} m .. {} m) {{
  spawn Sedan ahead a {{ lane: Current, speed: speed, does: DriveAhead }}
  spawn Jeep ahead b {{ lane: Current, speed: speed, does: DriveAhead }}
}}
group cars = ahead, pair
episode {{ limit: {STEPS} steps }}
",
            begin(any[0], "None"),
            begin(any[1], "Light"),
            begin(any[2], "Near"),
            begin(any[3], "true"),
            speed.0,
            speed.1,
            distance.0,
            distance.1,
            speed.0,
            speed.1,
            a.0,
            a.1,
            b.0,
            b.1,
        );
        // The last one is dropped first.
        for at in (1..rules.len()).rev() {
            let with = self.below(at as u32 + 1);
            rules.swap(at, with);
        }
        let each_step = match self.below(8) {
            0 => EachStep::FogLifts,
            1 => EachStep::CountFalls,
            2 => EachStep::FlagTurns,
            3 => EachStep::FogSoaks,
            _ => EachStep::Nothing,
        };
        Made { text: format!("{text}{}", each_step.text()), each_step, rules }
    }
}

impl Made {
    fn text(&self) -> String {
        let mut text = self.text.clone();
        for (index, rule) in self.rules.iter().enumerate() {
            text.push_str(&match rule {
                Rule::Holds(Binds::On(name), condition) => format!("rule r{index} on {name}: {condition}\n"),
                Rule::Holds(Binds::Always, condition) => format!("rule r{index}: {condition}\n"),
                Rule::Fog(moves) => {
                    let line = |from: usize| {
                        let to: Vec<&str> =
                            (0..3).filter(|to| moves[from][*to]).map(|to| LEVELS[to]).collect();
                        format!("  {} -> {}\n", LEVELS[from], to.join(" | "))
                    };
                    format!("rule r{index} on fog {{\n{}}}\n", [0, 1, 2].map(line).concat())
                }
            });
        }
        text
    }
}

impl Twin {
    /// The states of a memory, read by name.
    fn of(space: &Space, memory: &Memory, road: usize, step: u64) -> Twin {
        let cells = |name: &str| {
            let state = space.state(name).expect("it is declared");
            &memory.cells()[state.first_cell..][..state.cells]
        };
        Twin {
            road,
            step,
            fog: cells("fog")[0].variant(),
            wet: [cells("wet")[0].variant(), cells("wet")[1].variant()],
            was: cells("was")[0].variant(),
            flag: cells("flag")[0].truth(),
            count: cells("count")[0].number(),
            numbers: BTreeMap::new(),
            mode: 0,
        }
    }

    fn states(&self) -> (usize, [usize; 2], usize, bool, f64) {
        (self.fog, self.wet, self.was, self.flag, self.count)
    }

    /// What every step does after its action.
    fn end_step(&mut self, each_step: EachStep) {
        match each_step {
            EachStep::Nothing => {}
            EachStep::FogLifts => self.fog = self.fog.saturating_sub(1),
            EachStep::CountFalls => self.count = (self.count - 1.0).max(0.0),
            EachStep::FlagTurns => self.flag = !self.flag,
            EachStep::FogSoaks => self.wet[1] = self.fog,
        }
    }

    /// After a step without an action: what every step does, unless it would break a rule.
    fn waited(&self, made: &Made) -> Twin {
        let mut after = self.clone();
        after.end_step(made.each_step);
        let breaks = |rule: &Rule| match rule {
            Rule::Holds(Binds::Always, condition) => !condition.holds(&after),
            Rule::Holds(Binds::On(_), _) => false,
            Rule::Fog(moves) => made.each_step == EachStep::FogLifts && !moves[self.fog][after.fog],
        };
        if made.rules.iter().any(breaks) { self.clone() } else { after }
    }

    /// What a draw does, by what the action of that name says.
    fn after(&self, space: &Space, row: &Row, draw: &Draw, each_step: EachStep) -> Twin {
        let axis = |name: &str| row.axes.iter().find(|(known, _)| &**known == name).map(|(_, value)| *value);
        let drawn =
            |name: &str| draw.values.iter().find(|(known, _)| &**known == name).map(|(_, value)| *value);
        let mut after = self.clone();
        let position = |value: Option<Value>| value.expect("it is a parameter").variant();
        match space.actions[row.action].name.as_str() {
            "thicken" => after.fog = position(axis("to")),
            "soak" => after.wet[position(axis("at"))] = position(drawn("how")),
            "turn" => after.flag = axis("on").expect("it is a parameter").truth(),
            "tick" => after.count += 1.0,
            "ahead" => {
                after.mode = position(axis("mode"));
                after.was = after.mode;
            }
            _ => {}
        }
        for (name, value) in &draw.values {
            if let Value::Number(number) = value {
                after.numbers.insert(name.to_string(), *number);
            }
        }
        after.end_step(each_step);
        after
    }

    /// Asserts that the rules hold that hold always.
    fn stands(&self, made: &Made) {
        for rule in &made.rules {
            if let Rule::Holds(Binds::Always, condition) = rule {
                assert!(condition.holds(self), "step {} breaks {condition}\n{}", self.step, made.text());
            }
        }
    }

    /// The rule that a step from `self` to `after` breaks, by its number.
    fn broken(&self, after: &Twin, action: &str, made: &Made) -> Option<usize> {
        made.rules.iter().position(|rule| match rule {
            Rule::Holds(Binds::Always, condition) => !condition.holds(after),
            Rule::Holds(Binds::On(name), condition) => {
                let binds = *name == action || (*name == "cars" && matches!(action, "ahead" | "pair"));
                binds && !condition.holds(after)
            }
            Rule::Fog(moves) => {
                let sets = action == "thicken" || made.each_step == EachStep::FogLifts;
                sets && !moves[self.fog][after.fog]
            }
        })
    }
}

/// What an audit saw.
#[derive(Debug, Default)]
struct Seen {
    spaces: u32,
    /// Spaces that the checker refused before a rule was dropped, by the first code.
    refused: BTreeMap<&'static str, u32>,
    draws: u64,
    /// Steps without an action.
    waits: u64,
    /// Rules on states and time that the checker let stand.
    timed: u64,
    rows_realised: u32,
    /// The most draws before a realisable row was drawn.
    longest_wait: u64,
}

fn audit(spaces: u64, draws: u32) -> Seen {
    let mut seen = Seen::default();
    for number in 0..spaces {
        let mut made = Maker(rng::stream(number, Stream::Exploration, 77)).space();
        // A space that the checker refuses has one rule too many.
        let space = loop {
            let loaded = compiled(&made.text());
            if let Some(space) = loaded.space {
                break space;
            }
            let errors = loaded.diagnostics.iter().filter(|found| found.is_error());
            let first = errors.map(|found| found.code).next().expect("a space is refused with a reason");
            assert!(
                [code::DEAD, code::NO_START, code::UNDECIDED, code::BROKEN_BY_TIME].contains(&first),
                "{first}: {:?}\n{}",
                loaded.diagnostics.iter().map(|found| &found.message).collect::<Vec<_>>(),
                made.text()
            );
            *seen.refused.entry(first).or_default() += 1;
            made.rules.pop().expect("without rules every space is sound");
        };
        seen.spaces += 1;
        let timed =
            |rule: &&Rule| matches!(rule, Rule::Holds(Binds::Always, condition) if condition.asks_for_time());
        seen.timed += made.rules.iter().filter(timed).count() as u64;
        played(&space, &made, draws, &mut seen);
    }
    seen
}

/// [`Plain`] so many seconds after the start.
struct Later(f64);

impl Surroundings for Later {
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String> {
        Plain.survey(request)
    }

    fn moment(&self) -> MomentFacts {
        MomentFacts { elapsed_s: self.0, ..Plain.moment() }
    }
}

/// Plays random episodes on each road and judges every offer, and the states of every step.
fn played(space: &std::sync::Arc<Space>, made: &Made, draws: u32, seen: &mut Seen) {
    let realised = realise(space);
    let table = ActionTable::new(space.clone());
    let rules = RulesInForce::by_default(space);
    for (road_index, road) in space.roads.iter().enumerate() {
        let road_number =
            ROADS.iter().position(|(name, _)| *name == road.name).expect("it is one of the two");
        let mut drawn = vec![false; space.rows.len()];
        let (mut count, mut episode) = (0, 0);
        while count < draws {
            let mut choices = rng::stream(episode, Stream::Exploration, 78);
            let mut memory = space.memory_at_start(road, &rules, episode).expect("the checker found a start");
            let start = Twin::of(space, &memory, road_number, 0);
            start.stands(made);
            // Time alone may break what actions keep.
            let waits_always = episode % 8 == 0;
            for step in 0..STEPS {
                let before = Twin::of(space, &memory, road_number, step);
                let situation = Situation {
                    memory: &memory,
                    road,
                    rules: &rules,
                    surroundings: &Later(6.0 * step as f64),
                    seed: episode,
                    step,
                };
                let mut legal = Vec::new();
                for offer in table.offers(&situation) {
                    let Offer::Legal(draw) = offer else { continue };
                    count += 1;
                    let row = &space.rows[draw.row];
                    let after = before.after(space, row, &draw, made.each_step);
                    let name = &space.actions[row.action].name;
                    let broken = before.broken(&after, name, made);
                    assert_eq!(broken, None, "{} {:?}\n{}", row.label, draw.values, made.text());
                    assert_eq!(
                        Twin::of(space, &draw.memory_after, road_number, step).states(),
                        after.states()
                    );
                    let found = realised[draw.row][road_index];
                    let is_said = !matches!(found, Realised::Never | Realised::Unreached);
                    assert!(is_said, "{} is {found:?} and drawn\n{}", row.label, made.text());
                    if !drawn[draw.row] {
                        drawn[draw.row] = true;
                        seen.rows_realised += 1;
                        seen.longest_wait = seen.longest_wait.max(u64::from(count));
                    }
                    legal.push(draw);
                }
                if legal.is_empty() || waits_always || rng::below(&mut choices, 4) == 0 {
                    let (_, waited) = table.wait(&memory, step, road, &rules);
                    let found = Twin::of(space, &waited, road_number, step);
                    assert_eq!(found.states(), before.waited(made).states(), "{}", made.text());
                    memory = waited;
                    seen.waits += 1;
                } else {
                    let chosen = rng::below(&mut choices, legal.len() as u32) as usize;
                    memory = legal.swap_remove(chosen).memory_after;
                }
                Twin::of(space, &memory, road_number, step).stands(made);
            }
            episode += 1;
            // A space in which nothing is ever legal would not end.
            if episode > u64::from(draws) {
                break;
            }
        }
        seen.draws += u64::from(count);
        if draws < DRAWS_MAX {
            continue;
        }
        for (row, drawn) in drawn.iter().enumerate() {
            let (label, found) = (&space.rows[row].label, realised[row][road_index]);
            assert!(
                *drawn || found != Realised::Runs,
                "{label} on {} is never drawn\n{}",
                road.name,
                made.text()
            );
        }
    }
}

#[test]
fn random_spaces_keep_the_promise() {
    let seen = audit(24, 400);
    assert!(seen.rows_realised >= 24 * 8 && seen.waits > 100 && seen.timed >= 6, "{seen:?}");
}

/// `cargo test --lib -- --ignored --nocapture random_spaces_keep_the_promise_at_length`
#[test]
#[ignore = "takes minutes"]
fn random_spaces_keep_the_promise_at_length() {
    let seen = audit(300, DRAWS_MAX);
    println!("{seen:?}");
    assert!(seen.rows_realised >= 300 * 8 && seen.timed >= 60, "{seen:?}");
}

/// The types of the drawn values are those of the parameters.
#[test]
fn the_twin_knows_every_action() {
    let made = Maker(rng::stream(0, Stream::Exploration, 77)).space();
    let drawn = ["thicken", "soak", "turn", "tick", "ahead", "pair"];
    let space = compiled(&made.text).space.expect("without rules it is sound");
    let names: Vec<&str> = space.actions.iter().map(|action| action.name.as_str()).collect();
    assert_eq!(names, drawn);
    assert!(space.states.iter().all(|state| !matches!(state.ty, Type::Quantity(_))));
}
