//! Makes random spaces: their text, and their rules as data, which the audit's twin judges.

use core::fmt;

use avastra_base::rng;
use avastra_base::rng::Rng;

use super::STEPS;

pub(super) const LEVELS: [&str; 3] = ["None", "Light", "High"];
pub(super) const KEYS: [&str; 2] = ["Front", "Back"];
pub(super) const OPS: [&str; 6] = ["<", "<=", ">", ">=", "==", "!="];
pub(super) const ROADS: [(&str, f64); 2] = [("corner", 11.0), ("slow", 8.0)];

/// A number of a rule, of the dimension of its place.
#[derive(Clone)]
pub(super) enum Number {
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
pub(super) enum Level {
    Literal(usize),
    Fog,
    Wet(usize),
}

#[derive(Clone)]
pub(super) enum Condition {
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
pub(super) enum Binds {
    /// The actions of these names, as the group or action of that name.
    On(&'static str),
    /// The states, always.
    Always,
}

pub(super) enum Rule {
    Holds(Binds, Condition),
    /// Which levels `fog` may move to.
    Fog([[bool; 3]; 3]),
}

/// The change that every step makes at its end.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum EachStep {
    Nothing,
    FogLifts,
    CountFalls,
    FlagTurns,
    FogSoaks,
    /// As the moment has it, of which proofs know nothing.
    FlagOfTheMoment,
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
            EachStep::FlagOfTheMoment => "each step { set flag = ego.speed >= 8 m/s + count * 1 m/s }\n",
        }
    }
}

/// A space: its text without rules, and its rules.
pub(super) struct Made {
    pub(super) text: String,
    pub(super) each_step: EachStep,
    pub(super) rules: Vec<Rule>,
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
pub(super) struct Maker(pub(super) Rng);

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

    pub(super) fn space(&mut self) -> Made {
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
        let [fog, wet, was, flag] =
            ["None", "Light", "Near", "true"].map(|fixed| if self.below(2) == 0 { "any" } else { fixed });
        let mut range = |max: u32, unit: &str| {
            let (a, b) = (1 + self.below(max), 1 + self.below(max));
            format!("{} {unit} .. {} {unit}", a.min(b), a.max(b))
        };
        let (speed, distance, a, b) = (range(16, "m/s"), range(70, "m"), range(70, "m"), range(70, "m"));
        let text = format!(
            "language 1
enum Mode = Near | Far
enum Level = None < Light < High
enum Key = Front | Back
enum Car = Sedan | SUV | Jeep
state fog: Level = {fog}
state wet: Key -> Level = {wet}
state was: Mode = {was}
state flag: Bool = {flag}
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
action ahead(each mode: Mode, any speed: Speed in {speed}, any distance: Length in {distance}, any car: Car) {{
  spawn car ahead distance {{ lane: Current, speed: speed, does: DriveAhead }}
  set was = mode
}}
action pair(any speed: Speed in {speed}, any a: Length in {a}, any b: Length in {b}) {{
  spawn Sedan ahead a {{ lane: Current, speed: speed, does: DriveAhead }}
  spawn Jeep ahead b {{ lane: Current, speed: speed, does: DriveAhead }}
}}
group cars = ahead, pair
episode {{ limit: {STEPS} steps }}
",
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
            4 => EachStep::FlagOfTheMoment,
            _ => EachStep::Nothing,
        };
        Made { text: format!("{text}{}", each_step.text()), each_step, rules }
    }
}

impl Made {
    pub(super) fn text(&self) -> String {
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
