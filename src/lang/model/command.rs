//! What a vehicle is told by an order or a phase: how fast it drives, and where to the side. The two run together.

use core::ops::RangeInclusive;

use crate::model::eval::{Facts, evaluate};
use crate::model::expr::Expr;
use crate::model::limits::{SPAWN_SPEED_MPS, out_of_bounds, rounded_into};
use crate::model::space::{FnDef, WordExpr};
use crate::model::vocabulary::{CommandField, LaneChoice, Manner, Word};

/// Rates at which a vehicle may be told to change its speed, m/s². The most is more than tyres give.
pub const RATE_MPS2: RangeInclusive<f64> = 0.1..=15.0;

/// Places beside the middle of a lane, m to the left: the next lane's middle and more, on either side.
pub const OFFSET_M: RangeInclusive<f64> = -5.0..=5.0;

/// Speeds to the side, m/s. UN R157's cut-ins reach 3 m/s.
pub const ASIDE_MPS: RangeInclusive<f64> = 0.1..=4.0;

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
    pub ignores: Option<Vec<WordExpr<Manner>>>,
}

/// A command. What is `None` stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    pub speed_mps: Option<f64>,
    pub rate_mps2: Option<f64>,
    pub lane: Option<LaneChoice>,
    pub offset_m: Option<f64>,
    pub aside_mps: Option<f64>,
    pub ignores: Option<Manners>,
}

/// The rules of the road that a vehicle ignores; none by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Manners(u8);

impl Manners {
    pub fn of(ignored: impl IntoIterator<Item = Manner>) -> Manners {
        Manners(ignored.into_iter().fold(0, |bits, manner| bits | 1 << manner as u8))
    }

    pub fn ignores(self, manner: Manner) -> bool {
        self.0 >> manner as u8 & 1 == 1
    }

    /// Those that are ignored.
    pub fn ignored(self) -> impl Iterator<Item = Manner> {
        Manner::ALL.iter().copied().filter(move |manner| self.ignores(*manner))
    }

    pub fn bits(self) -> u8 {
        self.0
    }
}

/// The fields that are figures.
const FIGURES: [CommandField; 4] =
    [CommandField::Speed, CommandField::Rate, CommandField::Offset, CommandField::Aside];

/// One figure of a command, as the file says it.
#[derive(Debug, Clone)]
pub struct Figure<'a> {
    pub field: CommandField,
    pub expr: &'a Expr,
    pub unit: &'static str,
    pub bounds: RangeInclusive<f64>,
}

/// The unit and the bounds of a figure.
fn bounds(field: CommandField) -> (&'static str, RangeInclusive<f64>) {
    match field {
        CommandField::Rate => ("m/s^2", RATE_MPS2),
        CommandField::Offset => ("m", OFFSET_M),
        CommandField::Aside => ("m/s", ASIDE_MPS),
        _ => ("m/s", SPAWN_SPEED_MPS),
    }
}

impl CommandDef {
    pub fn figures(&self) -> impl Iterator<Item = Figure<'_>> {
        let all = FIGURES.into_iter().zip([&self.speed, &self.rate, &self.offset, &self.aside]);
        all.filter_map(|(field, expr)| {
            let (unit, bounds) = bounds(field);
            Some(Figure { field, expr: expr.as_ref()?, unit, bounds })
        })
    }

    /// All expressions, those of its words among them.
    pub fn parts(&self) -> impl Iterator<Item = &Expr> {
        let lane = self.lane.iter().filter_map(WordExpr::expr);
        let ignores = self.ignores.iter().flatten().filter_map(WordExpr::expr);
        self.figures().map(|figure| figure.expr).chain(lane).chain(ignores)
    }

    /// The command with its values. What has no value is NaN.
    pub fn evaluate(&self, functions: &[FnDef], facts: &Facts<'_>) -> Command {
        let manners = |ignores: &Vec<WordExpr<Manner>>| {
            Manners::of(ignores.iter().map(|manner| manner.word(functions, facts)))
        };
        let mut command = Command {
            lane: self.lane.as_ref().map(|lane| lane.word(functions, facts)),
            ignores: self.ignores.as_ref().map(manners),
            ..Command::default()
        };
        for Figure { field, expr, bounds, .. } in self.figures() {
            let value = rounded_into(evaluate(expr, functions, facts).number(), bounds);
            *command.figure(field) = Some(value);
        }
        command
    }
}

impl Command {
    fn figure(&mut self, field: CommandField) -> &mut Option<f64> {
        match field {
            CommandField::Rate => &mut self.rate_mps2,
            CommandField::Offset => &mut self.offset_m,
            CommandField::Aside => &mut self.aside_mps,
            _ => &mut self.speed_mps,
        }
    }

    /// The figures that it has, each with its name, unit and bounds.
    fn figures(&self) -> impl Iterator<Item = (&'static str, f64, &'static str, RangeInclusive<f64>)> {
        FIGURES.into_iter().filter_map(|field| {
            let (unit, range) = bounds(field);
            let mut all = *self;
            let value = *all.figure(field);
            value.map(|value| (field.name(), value, unit, range))
        })
    }

    /// Why the world must not be given this command; `None` if it may.
    pub fn out_of_bounds(&self) -> Option<String> {
        out_of_bounds("order", self.figures())
    }

    /// The same with its figures brought within their bounds; a rate and a speed to the side that have no value are left
    /// out. `None` if its speed or its offset has none.
    pub fn within_bounds(mut self) -> Option<Command> {
        for field in FIGURES {
            let (_, range) = bounds(field);
            let figure = self.figure(field);
            let Some(value) = *figure else { continue };
            *figure = match (value.is_nan(), field) {
                (false, _) => Some(value.clamp(*range.start(), *range.end())),
                (true, CommandField::Rate | CommandField::Aside) => None,
                (true, _) => return None,
            };
        }
        Some(self)
    }

    /// Whether it says where to the side.
    pub fn goes_aside(&self) -> bool {
        self.lane.is_some() || self.offset_m.is_some()
    }
}
