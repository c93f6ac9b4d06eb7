//! What a road user is told by an order or a phase: how fast it goes, and a vehicle where to the side, how near to others, in
//! which manner, and where at the next junction. All of it runs together.

use core::ops::RangeInclusive;

use crate::model::eval::{Facts, evaluate};
use crate::model::expr::{Expr, ExprKind};
use crate::model::limits::{SPEED_MPS_MAX, out_of_bounds, rounded_into};
use crate::model::space::{FnDef, WordExpr};
use avastra_base::units::Rational;

use crate::model::vocabulary::{CommandField, LaneChoice, TrafficRule, Turning, Verb, Word};

/// Speeds that an order or a phase may name, m/s. What of it a body does, [`speeds_mps`] says.
const SPEED_MPS: RangeInclusive<f64> = -ON_FOOT_MPS_MAX..=SPEED_MPS_MAX;

/// Nobody on foot is told to go faster, m/s: below a sprinter's 12 m/s.
const ON_FOOT_MPS_MAX: f64 = 10.0;

/// Why nobody on foot is told anything else.
pub const ON_FOOT: &str = "it is on foot, and can be told a speed alone";

/// Speeds that somebody can be told, m/s: on foot below 0 for the way back.
pub fn speeds_mps(on_foot: bool) -> RangeInclusive<f64> {
    if on_foot { -ON_FOOT_MPS_MAX..=ON_FOOT_MPS_MAX } else { 0.0..=SPEED_MPS_MAX }
}

/// Rates at which a vehicle may be told to change its speed, m/s². The most is more than tyres give.
const RATE_MPS2: RangeInclusive<f64> = 0.1..=15.0;

/// Places beside the middle of a lane, m to the left: the next lane's middle and more, on either side.
pub const OFFSET_M: RangeInclusive<f64> = -5.0..=5.0;

/// Speeds to the side, m/s. UN R157's cut-ins reach 3 m/s.
const ASIDE_MPS: RangeInclusive<f64> = 0.1..=4.0;

/// Time gaps that a vehicle may be told to keep, s: from bumper on bumper to the sight of a town.
const HEADWAY_S: RangeInclusive<f64> = 0.1..=10.0;

/// A command whose values are still to be computed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CommandDef {
    /// m/s.
    pub speed: Option<Expr>,
    /// m/s²; without it the driver goes over to the speed as it would by itself.
    pub rate: Option<Expr>,
    pub lane: Option<WordExpr<LaneChoice>>,
    /// m to the left of the middle of its lane.
    pub offset: Option<Expr>,
    /// m/s; without it the driver moves over as it would by itself.
    pub aside: Option<Expr>,
    /// s; without it as before.
    pub headway: Option<Expr>,
    pub ignores: Option<Vec<WordExpr<TrafficRule>>>,
    pub siren: Option<Expr>,
    pub turn: Option<WordExpr<Turning>>,
}

/// A command. What is `None` stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    pub speed_mps: Option<f64>,
    pub rate_mps2: Option<f64>,
    pub lane: Option<LaneChoice>,
    pub offset_m: Option<f64>,
    pub aside_mps: Option<f64>,
    pub headway_s: Option<f64>,
    pub ignores: Option<IgnoredRules>,
    pub siren: Option<bool>,
    /// Where it goes at the next junction.
    pub turn: Option<Turning>,
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

const FIGURES: [Figure; 5] = [
    Figure {
        field: CommandField::Speed,
        unit: "m/s",
        bounds: SPEED_MPS,
        may_be_left_out: false,
        written: |def| def.speed.as_ref(),
        value: |command| &mut command.speed_mps,
    },
    Figure {
        field: CommandField::Rate,
        unit: "m/s^2",
        bounds: RATE_MPS2,
        may_be_left_out: true,
        written: |def| def.rate.as_ref(),
        value: |command| &mut command.rate_mps2,
    },
    Figure {
        field: CommandField::Offset,
        unit: "m",
        bounds: OFFSET_M,
        may_be_left_out: false,
        written: |def| def.offset.as_ref(),
        value: |command| &mut command.offset_m,
    },
    Figure {
        field: CommandField::Aside,
        unit: "m/s",
        bounds: ASIDE_MPS,
        may_be_left_out: true,
        written: |def| def.aside.as_ref(),
        value: |command| &mut command.aside_mps,
    },
    Figure {
        field: CommandField::Headway,
        unit: "s",
        bounds: HEADWAY_S,
        may_be_left_out: true,
        written: |def| def.headway.as_ref(),
        value: |command| &mut command.headway_s,
    },
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

    /// Whether it can be told to somebody on foot: it says a speed alone.
    pub fn is_for_feet(&self) -> bool {
        *self == CommandDef { speed: self.speed.clone(), ..CommandDef::default() }
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
        self.figures().map(|figure| figure.expr).chain(lane).chain(ignores).chain(&self.siren).chain(turn)
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
            turn: self.turn.as_ref().map(|turn| turn.word(functions, facts)),
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

    /// Brings every figure into its range. Drops a `rate`, an `aside` or a `headway` without a value; `None` if the speed or the offset
    /// has none.
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

    /// The same for somebody on foot, or for a vehicle: the nearest speed that it can be told.
    pub fn for_body(self, on_foot: bool) -> Command {
        let speeds_mps = speeds_mps(on_foot);
        let speed_mps = self.speed_mps.map(|mps| mps.clamp(*speeds_mps.start(), *speeds_mps.end()));
        Command { speed_mps, ..self }
    }

    /// Why nobody of that kind can be told this, in words; `None` if they can.
    pub fn impossible(&self, verb: Verb) -> Option<String> {
        let on_foot = matches!(verb, Verb::Walk | Verb::Stand);
        let is_out = |mps: f64| !speeds_mps(on_foot).contains(&mps);
        match (verb, self.speed_mps) {
            (Verb::Stand, _) => Some("it stands, and does not walk".to_owned()),
            (Verb::Walk, speed_mps) if *self != (Command { speed_mps, ..Command::default() }) => {
                Some(ON_FOOT.to_owned())
            }
            (Verb::Walk, Some(mps)) if is_out(mps) => {
                Some(format!("nobody on foot is told more than {ON_FOOT_MPS_MAX} m/s"))
            }
            (_, Some(mps)) if is_out(mps) => Some("it does not drive backwards".to_owned()),
            _ => None,
        }
    }

    /// Whether it says where to the side.
    pub fn goes_aside(&self) -> bool {
        self.lane.is_some() || self.offset_m.is_some()
    }
}
