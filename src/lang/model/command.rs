//! The fields of an order or a phase for a road user. All road users have a speed; vehicles also a lateral offset, a gap to
//! others, manners, and a turn at the next junction. All of them run together.

use core::ops::RangeInclusive;

use avastra_base::geometry::SMOOTH_STEP_SLOPE_MAX;
use avastra_base::units::Rational;

use crate::model::expr::{Expr, ExprKind};
use crate::model::field::{BACK_MPS_MAX, Fields, ON_FOOT_MPS_MAX, Said, Term};
use crate::model::limits::SPEED_MPS_MAX;
use crate::model::vocabulary::{Field, Verb, Word};

/// A set of fields of an order. Not every road user can be told all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Told(u32);

impl Told {
    pub const NOTHING: Told = Told(0);

    /// All that drivers are told.
    pub const BY_DRIVERS: Told = Told(!(Told::of(&[Field::Reach, Field::Steady]).0));

    const fn of(fields: &[Field]) -> Told {
        let (mut bits, mut nth) = (0, 0);
        while nth < fields.len() {
            bits |= 1 << fields[nth] as u16;
            nth += 1;
        }
        Told(bits)
    }

    /// The fields that a road user with this verb can be told.
    pub fn to(verb: Verb) -> Told {
        use Field::{Aside, At, Continuous, Early, Lights, Offset, Rate, Reach, Speed, Steady};
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

    pub fn holds(self, field: Field) -> bool {
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
        let is_named = |field: &&Field| self.holds(**field) && **field != Field::Continuous;
        let fields = Field::ALL.iter().filter(is_named);
        let fields: Vec<String> = fields.map(|field| format!("`{}`", field.name())).collect();
        match fields.split_last() {
            Some((last, [])) => format!("a {last} alone"),
            Some((last, others)) => format!("{} and {last} alone", others.join(", ")),
            None => "nothing".to_owned(),
        }
    }

    /// Why a road user with this verb cannot be told this, in words; `None` if it can.
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

/// How a road user moves, which decides the speeds that it can be told.
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

    /// The kind of motion of a road user that can be told these fields. If it may be one of several, it gets the widest
    /// range.
    pub(crate) fn told(can: Told) -> Moves {
        match () {
            () if can.holds(Field::Reach) => Moves::Follows,
            () if can.holds(Field::Rate) => Moves::Drives,
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

/// The fields of an order or a phase, as the file writes them.
pub type CommandDef = Fields<Term>;

/// An order to a road user. A field that is not said stays as it is.
pub type Command = Fields<Said>;

/// How a road user moves laterally: by the smooth step of least jerk.
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

impl Fields<Term> {
    /// Whether it is written as a speed below 0. One that is computed may still be.
    pub fn goes_back(&self) -> bool {
        let is_negative = |speed: &Expr| match &speed.kind {
            ExprKind::Number(number) => *number < Rational::ZERO,
            kind => matches!(kind, ExprKind::Negate(_)),
        };
        self.expr(Field::Speed).is_some_and(is_negative)
    }
}

impl<T> Fields<T> {
    /// Which fields it says.
    pub fn told(&self) -> Told {
        self.iter().fold(Told::NOTHING, |told, (field, _)| told.and(Told::of(&[field])))
    }
}

impl Command {
    /// The same for a road user that moves so: the nearest speed that it can be told.
    pub fn for_who(self, moves: Moves) -> Command {
        let speeds_mps = moves.speeds_mps();
        match self.speed_mps() {
            Some(mps) => self.with(Field::Speed, mps.clamp(*speeds_mps.start(), *speeds_mps.end())),
            None => self,
        }
    }

    /// Why a road user with this verb cannot be told this, in words; `None` if it can.
    pub fn impossible(&self, verb: Verb) -> Option<String> {
        let moves = Moves::of(verb);
        let is_out = |mps: f64| !moves.speeds_mps().contains(&mps);
        if verb == Verb::Stand {
            return Some("it stands, and does not walk".to_owned());
        }
        if verb == Verb::Follow && self.says(Field::Early) && !self.says(Field::Reach) {
            return Some("it is `early` at a place of its trajectory: say where by `reach`".to_owned());
        }
        self.told().lacked_by(verb).or_else(|| match self.speed_mps() {
            Some(mps) if is_out(mps) => Some(match moves {
                Moves::Drives => "it does not drive backwards".to_owned(),
                Moves::Walks => format!("nobody on foot is told more than {ON_FOOT_MPS_MAX} m/s"),
                Moves::Follows => format!("it goes back at {BACK_MPS_MAX} m/s at most"),
            }),
            Some(_) | None => None,
        })
    }

    /// Whether the speed will be told anew in every tick.
    pub fn is_continuous(&self) -> bool {
        self.continuous() == Some(true)
    }

    /// Whether it says where beside the ego vehicle.
    pub fn pursues(&self) -> bool {
        self.says(Field::Keep) || self.says(Field::Early)
    }

    /// How it moves to the side; `None`: as by itself.
    pub fn aside(&self) -> Option<AsideBy> {
        self.aside_mps().map(AsideBy::Speed).or(self.aside_s().map(AsideBy::Time))
    }

    /// Whether it says where to the side.
    pub fn goes_aside(&self) -> bool {
        self.says(Field::Lane) || self.says(Field::Offset)
    }
}
