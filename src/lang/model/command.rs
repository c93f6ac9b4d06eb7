//! What a road user is told by an order or a phase: how fast it goes, and a vehicle where to the side, how near to others, in
//! which manner, and where at the next junction. All of it runs together.

use core::ops::RangeInclusive;

use crate::model::eval::evaluate;
use crate::model::expr::{Expr, ExprKind, FnDef, Who, WordExpr};
use crate::model::facts::Facts;
use crate::model::limits::{EARLY_S, OFFSET_M, SPEED_MPS_MAX, out_of_bounds, rounded_into};
use crate::model::value::Type;
use avastra_base::geometry::SMOOTH_STEP_SLOPE_MAX;
use avastra_base::units::{Dimension, Rational};

use crate::model::vocabulary::{CommandField, LaneChoice, ShownLights, TrafficRule, Turning, Verb, Word};

/// Speeds that an order or a phase may name, m/s. What of it somebody does, [`Moves`] says.
const SPEED_MPS: RangeInclusive<f64> = -BACK_MPS_MAX..=SPEED_MPS_MAX;

/// Nobody on foot is told to go faster, m/s: below a sprinter's 12 m/s.
const ON_FOOT_MPS_MAX: f64 = 10.0;

/// Nobody is told to go back faster, m/s.
const BACK_MPS_MAX: f64 = ON_FOOT_MPS_MAX;

/// What a road user is told: fields of an order. Not everybody can be told all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Told(u32);

impl Told {
    pub const NOTHING: Told = Told(0);

    /// All that drivers are told.
    pub const BY_DRIVERS: Told = Told(!(Told::of(&[CommandField::Reach, CommandField::Steady]).0));

    const fn of(fields: &[CommandField]) -> Told {
        let (mut bits, mut nth) = (0, 0);
        while nth < fields.len() {
            bits |= 1 << fields[nth] as u16;
            nth += 1;
        }
        Told(bits)
    }

    /// These figures, and those of the words that are said.
    fn all(
        figures: impl Iterator<Item = CommandField>,
        words: impl IntoIterator<Item = (CommandField, bool)>,
    ) -> Told {
        let words = words.into_iter().filter(|(_, is_said)| *is_said).map(|(field, _)| field);
        figures.chain(words).fold(Told::NOTHING, |told, field| told.and(Told::of(&[field])))
    }

    /// What can be told to who does that.
    pub fn to(verb: Verb) -> Told {
        use CommandField::{Aside, At, Continuous, Early, Lights, Offset, Rate, Reach, Speed, Steady};
        match verb {
            Verb::Walk | Verb::Stand => Told::of(&[Speed, Continuous]),
            Verb::WalkAhead | Verb::WalkOpposite => Told::of(&[Speed, Continuous, Offset, Aside]),
            Verb::Follow => {
                Told::of(&[Speed, Rate, Continuous, Offset, Aside, Early, At, Reach, Steady, Lights])
            }
            Verb::DriveAhead | Verb::DriveBehind | Verb::Overtake | Verb::DriveOpposite | Verb::CrossRoad => {
                Told::BY_DRIVERS
            }
        }
    }

    #[must_use]
    pub fn and(self, other: Told) -> Told {
        Told(self.0 | other.0)
    }

    pub fn holds(self, field: CommandField) -> bool {
        self.0 >> field as u16 & 1 == 1
    }

    /// Whether all that `other` says is among this.
    pub fn covers(self, other: Told) -> bool {
        other.0 & !self.0 == 0
    }

    /// The fields, in words.
    pub fn words(self) -> String {
        if self == Told::BY_DRIVERS {
            return "all but a `reach` and a `steady`".to_owned();
        }
        // Beside a `speed`, and so left out.
        let is_named = |field: &&CommandField| self.holds(**field) && **field != CommandField::Continuous;
        let fields = CommandField::ALL.iter().filter(is_named);
        let fields: Vec<String> = fields.map(|field| format!("`{}`", field.name())).collect();
        match fields.split_last() {
            Some((last, [])) => format!("a {last} alone"),
            Some((last, others)) => format!("{} and {last} alone", others.join(", ")),
            None => "nothing".to_owned(),
        }
    }

    /// Why somebody who does that cannot be told this, in words; `None` if they can.
    pub fn lacked_by(self, verb: Verb) -> Option<String> {
        let can = Told::to(verb);
        (!can.covers(self)).then(|| {
            let what = match verb {
                _ if verb.is_on_foot() => "it is on foot",
                Verb::Follow => "it follows a trajectory",
                _ => "it drives",
            };
            format!("{what}, and can be told {}", can.words())
        })
    }
}

/// How somebody moves, which decides how fast they can be told to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moves {
    Drives,
    /// Below 0 m/s for the way back.
    Walks,
    /// Along a trajectory; below 0 m/s backwards.
    Follows,
}

impl Moves {
    fn of(verb: Verb) -> Moves {
        match verb {
            Verb::Follow => Moves::Follows,
            _ if verb.is_on_foot() => Moves::Walks,
            _ => Moves::Drives,
        }
    }

    /// Of somebody who can be told this; who may be one of several has the widest range.
    pub(crate) fn told(can: Told) -> Moves {
        match () {
            () if can.holds(CommandField::Reach) => Moves::Follows,
            () if can.holds(CommandField::Rate) => Moves::Drives,
            () => Moves::Walks,
        }
    }

    /// m/s.
    pub fn speeds_mps(self) -> RangeInclusive<f64> {
        match self {
            Moves::Drives => 0.0..=SPEED_MPS_MAX,
            Moves::Walks => -BACK_MPS_MAX..=ON_FOOT_MPS_MAX,
            Moves::Follows => -BACK_MPS_MAX..=SPEED_MPS_MAX,
        }
    }
}

/// Rates at which a vehicle may be told to change its speed, m/s². The most is more than tyres give.
pub const RATE_MPS2: RangeInclusive<f64> = 0.1..=15.0;

/// Speeds to the side, m/s. UN R157's cut-ins reach 3 m/s; who follows a trajectory may run aside.
const ASIDE_MPS: RangeInclusive<f64> = 0.1..=10.0;

/// How long a move to the side may take, s.
const ASIDE_S: RangeInclusive<f64> = 0.5..=60.0;

/// Time gaps that a vehicle may be told to keep, s: from bumper on bumper to the sight of a town.
const TIME_GAP_S: RangeInclusive<f64> = 0.1..=10.0;

/// Gaps that a vehicle may be told to keep to the ego vehicle, m.
const KEEP_M: RangeInclusive<f64> = 0.5..=200.0;

/// Stations of the ego vehicle's route, m.
const AT_M: RangeInclusive<f64> = 0.0..=1e6;

/// A command whose values are still to be computed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CommandDef {
    /// m/s.
    pub speed: Option<Expr>,
    /// m/s²; without it the driver goes over to the speed as it would by itself.
    pub rate: Option<Expr>,
    /// Whether the speed is asked anew at every tick.
    pub continuous: Option<Expr>,
    pub lane: Option<WordExpr<LaneChoice>>,
    /// m to the left of the middle of its lane.
    pub offset: Option<Expr>,
    /// m/s, or s; without it the driver moves over as it would by itself.
    pub aside: Option<Expr>,
    /// s; without it as before.
    pub time_gap: Option<Expr>,
    /// The gap to the ego vehicle: m, or s.
    pub keep: Option<Expr>,
    /// To whom, in place of the ego vehicle.
    pub to: Option<Who>,
    /// How much before the ego vehicle it is somewhere, s.
    pub early: Option<Expr>,
    /// Where, m along the ego vehicle's route; without it where the two ways cross.
    pub at: Option<Expr>,
    /// Where on its own trajectory, m.
    pub reach: Option<Expr>,
    /// For how long a way before that it has its speed already, m.
    pub steady: Option<Expr>,
    pub ignores: Option<Vec<WordExpr<TrafficRule>>>,
    pub siren: Option<Expr>,
    pub turn: Option<WordExpr<Turning>>,
    pub lights: Option<WordExpr<ShownLights>>,
}

/// A command. What is `None` stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    pub speed_mps: Option<f64>,
    pub rate_mps2: Option<f64>,
    /// Whether the speed will be told anew in every tick.
    pub is_continuous: bool,
    pub lane: Option<LaneChoice>,
    pub offset_m: Option<f64>,
    pub aside_mps: Option<f64>,
    pub aside_s: Option<f64>,
    pub time_gap_s: Option<f64>,
    pub keep_m: Option<f64>,
    pub keep_s: Option<f64>,
    /// To whom, by index in `Space::bearers`; without it to the ego vehicle.
    pub to: Option<usize>,
    pub early_s: Option<f64>,
    pub at_m: Option<f64>,
    pub reach_m: Option<f64>,
    pub steady_m: Option<f64>,
    pub ignores: Option<IgnoredRules>,
    pub siren: Option<bool>,
    /// Where it goes at the next junction.
    pub turn: Option<Turning>,
    pub lights: Option<ShownLights>,
}

/// How somebody moves to the side: by the smooth step of least jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AsideBy {
    /// With this greatest speed, m/s.
    Speed(f64),
    /// In this time, s.
    Time(f64),
}

impl AsideBy {
    /// How long a move over this way takes, s.
    pub fn takes_s(self, by_m: f64) -> f64 {
        match self {
            AsideBy::Speed(mps) => SMOOTH_STEP_SLOPE_MAX * by_m / mps,
            AsideBy::Time(takes_s) => takes_s,
        }
    }
}

/// The rules of the road that a vehicle ignores; none by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IgnoredRules(u8);

impl IgnoredRules {
    pub fn of(ignored: impl IntoIterator<Item = TrafficRule>) -> IgnoredRules {
        IgnoredRules(ignored.into_iter().fold(0, |bits, rule| bits | 1 << rule as u8))
    }

    pub fn contains(self, rule: TrafficRule) -> bool {
        self.0 >> rule as u8 & 1 == 1
    }

    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub fn iter(self) -> impl Iterator<Item = TrafficRule> {
        TrafficRule::ALL.iter().copied().filter(move |rule| self.contains(*rule))
    }

    pub fn bits(self) -> u8 {
        self.0
    }
}

/// One figure of a command: what it is, and where it stands.
struct Figure {
    field: CommandField,
    unit: &'static str,
    bounds: RangeInclusive<f64>,
    /// Whether a command goes on without its value if it has none.
    may_be_left_out: bool,
    written: fn(&CommandDef) -> Option<&Expr>,
    value: fn(&mut Command) -> &mut Option<f64>,
}

/// One row a figure: its field, unit and bounds, whether it may be left out, and its fields in [`CommandDef`] and in [`Command`]. A
/// field of two dimensions is two figures.
macro_rules! figures {
    ($(($field:ident, $unit:literal, $bounds:ident, $left_out:literal,
        $from:ident $(in $dimension:ident)? => $into:ident)),+ $(,)?) => {
        [$(Figure {
            field: CommandField::$field,
            unit: $unit,
            bounds: $bounds,
            may_be_left_out: $left_out,
            written: |def| {
                def.$from.as_ref()$(.filter(|expr| expr.ty == Type::Quantity(Dimension::$dimension)))?
            },
            value: |command| &mut command.$into,
        }),+]
    };
}

const FIGURES: [Figure; 12] = figures![
    (Speed, "m/s", SPEED_MPS, false, speed => speed_mps),
    (Rate, "m/s^2", RATE_MPS2, true, rate => rate_mps2),
    (Offset, "m", OFFSET_M, false, offset => offset_m),
    (Aside, "m/s", ASIDE_MPS, true, aside in SPEED => aside_mps),
    (Aside, "s", ASIDE_S, true, aside in DURATION => aside_s),
    (TimeGap, "s", TIME_GAP_S, true, time_gap => time_gap_s),
    (Keep, "m", KEEP_M, false, keep in LENGTH => keep_m),
    (Keep, "s", TIME_GAP_S, false, keep in DURATION => keep_s),
    (Early, "s", EARLY_S, false, early => early_s),
    (At, "m", AT_M, false, at => at_m),
    (Reach, "m", AT_M, false, reach => reach_m),
    (Steady, "m", AT_M, true, steady => steady_m),
];

/// A figure as the file says it, with its unit and its bounds.
pub struct WrittenFigure<'a> {
    pub field: CommandField,
    pub expr: &'a Expr,
    pub unit: &'static str,
    pub bounds: RangeInclusive<f64>,
}

impl CommandDef {
    pub fn figures(&self) -> impl Iterator<Item = WrittenFigure<'_>> {
        FIGURES.into_iter().filter_map(|Figure { field, unit, bounds, written, .. }| {
            Some(WrittenFigure { field, expr: written(self)?, unit, bounds })
        })
    }

    /// What it says.
    pub fn told(&self) -> Told {
        let CommandDef { lane, ignores, siren, turn, continuous, to, lights, .. } = self;
        let words = [
            (CommandField::Lane, lane.is_some()),
            (CommandField::Ignores, ignores.is_some()),
            (CommandField::Siren, siren.is_some()),
            (CommandField::Turn, turn.is_some()),
            (CommandField::Continuous, continuous.is_some()),
            (CommandField::To, to.is_some()),
            (CommandField::Lights, lights.is_some()),
        ];
        Told::all(self.figures().map(|figure| figure.field), words)
    }

    /// Whether it is written as a speed below 0. One that is computed may still be.
    pub fn goes_back(&self) -> bool {
        let is_negative = |speed: &Expr| match &speed.kind {
            ExprKind::Number(number) => *number < Rational::ZERO,
            kind => matches!(kind, ExprKind::Negate(_)),
        };
        self.speed.as_ref().is_some_and(is_negative)
    }

    /// All expressions, those of its words among them.
    pub fn parts(&self) -> impl Iterator<Item = &Expr> {
        let lane = self.lane.iter().filter_map(WordExpr::expr);
        let ignores = self.ignores.iter().flatten().filter_map(WordExpr::expr);
        let turn = self.turn.iter().filter_map(WordExpr::expr);
        let lights = self.lights.iter().filter_map(WordExpr::expr);
        let words = lane.chain(ignores).chain(&self.siren).chain(turn).chain(lights).chain(&self.continuous);
        self.figures().map(|figure| figure.expr).chain(words)
    }

    /// The command with its values. What has no value is NaN.
    pub fn evaluate(&self, functions: &[FnDef], facts: &Facts<'_>) -> Command {
        let ignored = |ignores: &Vec<WordExpr<TrafficRule>>| {
            IgnoredRules::of(ignores.iter().map(|rule| rule.word(functions, facts)))
        };
        let mut command = Command {
            lane: self.lane.as_ref().map(|lane| lane.word(functions, facts)),
            ignores: self.ignores.as_ref().map(ignored),
            siren: self.siren.as_ref().map(|siren| evaluate(siren, functions, facts).truth()),
            is_continuous: self.continuous.as_ref().is_some_and(|is| evaluate(is, functions, facts).truth()),
            turn: self.turn.as_ref().map(|turn| turn.word(functions, facts)),
            lights: self.lights.as_ref().map(|lights| lights.word(functions, facts)),
            to: self.to.map(|to| to.bearer(facts.locals)),
            ..Command::default()
        };
        for Figure { bounds, written, value, .. } in FIGURES {
            if let Some(expr) = written(self) {
                let number = evaluate(expr, functions, facts).number();
                *value(&mut command) = Some(rounded_into(number, bounds));
            }
        }
        command
    }
}

impl Command {
    /// Why the world must not be given this command; `None` if it may.
    pub fn out_of_bounds(mut self) -> Option<String> {
        let figures = FIGURES.into_iter().filter_map(|Figure { field, unit, bounds, value, .. }| {
            Some((field.name(), (*value(&mut self))?, unit, bounds))
        });
        out_of_bounds("order", figures)
    }

    /// Brings every figure into its range, and drops what goes without a value: a `rate`, an `aside`, a `time_gap`. `None` if
    /// another figure has none.
    pub fn within_bounds(mut self) -> Option<Command> {
        for Figure { bounds, may_be_left_out, value, .. } in FIGURES {
            let figure = value(&mut self);
            let Some(number) = *figure else { continue };
            *figure = match number.is_nan() {
                false => Some(number.clamp(*bounds.start(), *bounds.end())),
                true if may_be_left_out => None,
                true => return None,
            };
        }
        Some(self)
    }

    /// The same for somebody who moves so: the nearest speed that it can be told.
    pub fn for_who(self, moves: Moves) -> Command {
        let speeds_mps = moves.speeds_mps();
        let speed_mps = self.speed_mps.map(|mps| mps.clamp(*speeds_mps.start(), *speeds_mps.end()));
        Command { speed_mps, ..self }
    }

    /// Why nobody of that kind can be told this, in words; `None` if they can.
    pub fn impossible(&self, verb: Verb) -> Option<String> {
        let moves = Moves::of(verb);
        let is_out = |mps: f64| !moves.speeds_mps().contains(&mps);
        if verb == Verb::Stand {
            return Some("it stands, and does not walk".to_owned());
        }
        if verb == Verb::Follow && self.early_s.is_some() && self.reach_m.is_none() {
            return Some("it is `early` at a place of its trajectory: say where by `reach`".to_owned());
        }
        self.told().lacked_by(verb).or_else(|| match self.speed_mps {
            Some(mps) if is_out(mps) => Some(match moves {
                Moves::Drives => "it does not drive backwards".to_owned(),
                Moves::Walks => format!("nobody on foot is told more than {ON_FOOT_MPS_MAX} m/s"),
                Moves::Follows => format!("it goes back at {BACK_MPS_MAX} m/s at most"),
            }),
            Some(_) | None => None,
        })
    }

    fn told(&self) -> Told {
        let Command { lane, ignores, siren, turn, is_continuous, to, lights, .. } = *self;
        let words = [
            (CommandField::Lane, lane.is_some()),
            (CommandField::Ignores, ignores.is_some()),
            (CommandField::Siren, siren.is_some()),
            (CommandField::Turn, turn.is_some()),
            (CommandField::Continuous, is_continuous),
            (CommandField::To, to.is_some()),
            (CommandField::Lights, lights.is_some()),
        ];
        let mut command = *self;
        let says = |figure: &Figure| (figure.value)(&mut command).is_some();
        Told::all(FIGURES.into_iter().filter(says).map(|figure| figure.field), words)
    }

    /// Whether it says where beside the ego vehicle.
    pub fn pursues(&self) -> bool {
        self.keep_m.is_some() || self.keep_s.is_some() || self.early_s.is_some()
    }

    /// How it moves to the side; `None`: as by itself.
    pub fn aside(&self) -> Option<AsideBy> {
        self.aside_mps.map(AsideBy::Speed).or(self.aside_s.map(AsideBy::Time))
    }

    /// Whether it says where to the side.
    pub fn goes_aside(&self) -> bool {
        self.lane.is_some() || self.offset_m.is_some()
    }
}
