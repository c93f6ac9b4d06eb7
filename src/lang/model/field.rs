//! The fields of a `spawn`, an `order` and a phase of a manoeuvre: one table for all three.
//!
//! A field is a word of [`Field`] with its sentence, an arm of [`Field::kind`], which says what may be written there, and a
//! line of `getters!`, by which the world reads it. To check, prove, evaluate, compare, print and complete fields are
//! loops over this table.

use core::array;
use core::ops::RangeInclusive;

use crate::model::eval::evaluate;
use crate::model::expr::{Expr, FnDef, Who, WordExpr};
use crate::model::facts::Facts;
use crate::model::limits::{OFFSET_M, SPEED_MPS_MAX, out_of_bounds, rounded_into};
use crate::model::vocabulary::{Field, LaneChoice, ShownLights, TrafficRule, Turning, Word};
use avastra_base::units::{Dimension, decimal};

/// The greatest speed that a road user on foot can be told, m/s: below a sprinter's 12 m/s.
pub(super) const ON_FOOT_MPS_MAX: f64 = 10.0;

/// The greatest speed backwards that a road user can be told, m/s.
pub(super) const BACK_MPS_MAX: f64 = ON_FOOT_MPS_MAX;

/// Speeds that an order or a phase may name, m/s. [`Moves`] says which of them a road user can be told.
///
/// [`Moves`]: crate::model::command::Moves
const SPEED_MPS: RangeInclusive<f64> = -BACK_MPS_MAX..=SPEED_MPS_MAX;

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

/// How much before the ego vehicle a road user may be asked to be somewhere, s; below 0 after it.
const EARLY_S: RangeInclusive<f64> = -30.0..=30.0;

/// Times that a road user may wait at the kerb, s.
const WAITS_S: RangeInclusive<f64> = 0.0..=600.0;

/// Parts of the ego vehicle's front at which a road user may be met.
const MEET: RangeInclusive<f64> = 0.0..=1.0;

const OF_SPAWNS_ALONE: [Field; 6] =
    [Field::Does, Field::Side, Field::Count, Field::Waits, Field::Meet, Field::Colour];

const OF_ORDERS_ALONE: [Field; 9] = {
    use Field::{Aside, At, Continuous, Keep, Rate, Reach, Steady, TimeGap, To};
    [Rate, Continuous, Aside, TimeGap, Keep, To, At, Reach, Steady]
};

/// The kind of value that a field takes.
pub enum Kind {
    /// A number in this unit, or in the second one.
    Figure(Unit, Option<Unit>),
    Truth,
    Word(WordKind),
    /// A list of rules of the road.
    Rules,
    /// The name of a road user.
    Who,
    /// Neither of these, as a verb, a count or a manoeuvre: `check` reads the field by itself.
    Own,
}

/// A unit of a figure, and the bounds of the figure in it.
pub struct Unit {
    pub dimension: Dimension,
    pub name: &'static str,
    pub bounds: RangeInclusive<f64>,
}

/// The words of the engine that a field takes.
#[derive(Clone, Copy)]
pub struct WordKind {
    /// The name of such a word in messages.
    pub called: &'static str,
    /// Spellings and sentences, in the order of [`Word::ALL`].
    pub words: fn() -> Vec<(&'static str, &'static str)>,
}

impl WordKind {
    pub const fn of<W: Word>(called: &'static str) -> WordKind {
        WordKind { called, words: || W::ALL.iter().map(|word| (word.name(), word.meaning())).collect() }
    }
}

impl Field {
    pub fn kind(self) -> Kind {
        let unit = |dimension, name, bounds| Unit { dimension, name, bounds };
        let figure = |dimension, name, bounds| Kind::Figure(unit(dimension, name, bounds), None);
        match self {
            Field::Speed => figure(Dimension::SPEED, "m/s", SPEED_MPS),
            Field::Rate => figure(Dimension::ACCEL, "m/s^2", RATE_MPS2),
            Field::Lane => Kind::Word(WordKind::of::<LaneChoice>("lane")),
            Field::Offset => figure(Dimension::LENGTH, "m", OFFSET_M),
            Field::Aside => Kind::Figure(
                unit(Dimension::SPEED, "m/s", ASIDE_MPS),
                Some(unit(Dimension::DURATION, "s", ASIDE_S)),
            ),
            Field::TimeGap => figure(Dimension::DURATION, "s", TIME_GAP_S),
            Field::Keep => Kind::Figure(
                unit(Dimension::LENGTH, "m", KEEP_M),
                Some(unit(Dimension::DURATION, "s", TIME_GAP_S)),
            ),
            Field::Early => figure(Dimension::DURATION, "s", EARLY_S),
            Field::At | Field::Reach | Field::Steady => figure(Dimension::LENGTH, "m", AT_M),
            Field::Waits => figure(Dimension::DURATION, "s", WAITS_S),
            Field::Meet => figure(Dimension::RATIO, "", MEET),
            Field::Continuous | Field::Siren => Kind::Truth,
            Field::Ignores => Kind::Rules,
            Field::To => Kind::Who,
            Field::Lights => Kind::Word(WordKind::of::<ShownLights>("kind of lights")),
            Field::Turn => Kind::Word(WordKind::of::<Turning>("turn")),
            Field::Does | Field::Side | Field::Count | Field::Then | Field::Colour => Kind::Own,
        }
    }

    /// Whether a command goes on without this figure if that has no value.
    fn may_be_left_out(self) -> bool {
        matches!(self, Field::Rate | Field::Aside | Field::TimeGap | Field::Steady)
    }

    fn unit(self, second: bool) -> Unit {
        match self.kind() {
            Kind::Figure(_, Some(unit)) if second => unit,
            Kind::Figure(unit, _) => unit,
            _ => panic!("`{}` is no figure", self.name()),
        }
    }

    /// The fields of a `spawn`.
    pub fn of_spawns() -> Vec<Field> {
        Field::ALL.iter().copied().filter(|field| !OF_ORDERS_ALONE.contains(field)).collect()
    }

    /// The fields of an `order`, and of a phase.
    pub fn of_orders() -> Vec<Field> {
        Field::ALL.iter().copied().filter(|field| !OF_SPAWNS_ALONE.contains(field)).collect()
    }
}

/// The values of some fields; the others stay as they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fields<T>([Option<T>; Field::ALL.len()]);

/// The value of a field, as the file writes it.
#[derive(Debug, Clone, PartialEq)]
pub enum Term {
    /// In the first unit of the field, or in its second one.
    Figure {
        expr: Expr,
        second: bool,
    },
    Truth(Expr),
    /// By its place among the words of the field.
    Word(WordExpr<u8>),
    Rules(Vec<WordExpr<TrafficRule>>),
    Who(Who),
}

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Said {
    /// NaN without a value.
    Figure {
        value: f64,
        second: bool,
    },
    Truth(bool),
    Word(u8),
    Rules(IgnoredRules),
    /// By index in `Space::bearers`.
    Who(usize),
}

/// A figure as the file says it.
pub struct WrittenFigure<'a> {
    pub field: Field,
    pub expr: &'a Expr,
    pub unit: Unit,
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

impl<T> Default for Fields<T> {
    fn default() -> Fields<T> {
        Fields(array::from_fn(|_| None))
    }
}

impl<T> Fields<T> {
    pub fn get(&self, field: Field) -> Option<&T> {
        self.0[field as usize].as_ref()
    }

    pub fn says(&self, field: Field) -> bool {
        self.get(field).is_some()
    }

    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }

    pub fn set(&mut self, field: Field, said: Option<T>) {
        self.0[field as usize] = said;
    }

    pub fn iter(&self) -> impl Iterator<Item = (Field, &T)> {
        Field::ALL.iter().zip(&self.0).filter_map(|(field, said)| Some((*field, said.as_ref()?)))
    }
}

impl Fields<Term> {
    pub fn figures(&self) -> impl Iterator<Item = WrittenFigure<'_>> {
        self.iter().filter_map(|(field, term)| match term {
            Term::Figure { expr, second } => Some(WrittenFigure { field, expr, unit: field.unit(*second) }),
            _ => None,
        })
    }

    /// The expression of a figure or of a truth value.
    pub fn expr(&self, field: Field) -> Option<&Expr> {
        match self.get(field)? {
            Term::Figure { expr, .. } | Term::Truth(expr) => Some(expr),
            Term::Word(_) | Term::Rules(_) | Term::Who(_) => None,
        }
    }

    /// To whom a gap is kept.
    pub fn to(&self) -> Option<Who> {
        match self.get(Field::To)? {
            Term::Who(who) => Some(*who),
            _ => None,
        }
    }

    /// All expressions, those of its words among them.
    pub fn parts(&self) -> impl Iterator<Item = &Expr> {
        self.iter().flat_map(|(_, term)| match term {
            Term::Figure { expr, .. } | Term::Truth(expr) => vec![expr],
            Term::Word(word) => word.expr().into_iter().collect(),
            Term::Rules(rules) => rules.iter().filter_map(WordExpr::expr).collect(),
            Term::Who(_) => Vec::new(),
        })
    }

    pub fn evaluate(&self, functions: &[FnDef], facts: &Facts<'_>) -> Fields<Said> {
        let value = |field: Field, term: &Term| match term {
            Term::Figure { expr, second } => {
                let value = evaluate(expr, functions, facts).number();
                Said::Figure { value: rounded_into(value, field.unit(*second).bounds), second: *second }
            }
            Term::Truth(expr) => Said::Truth(evaluate(expr, functions, facts).truth()),
            Term::Word(word) => Said::Word(word.word(functions, facts)),
            Term::Rules(rules) => {
                Said::Rules(IgnoredRules::of(rules.iter().map(|rule| rule.word(functions, facts))))
            }
            Term::Who(who) => Said::Who(who.bearer(facts.locals)),
        };
        let mut said = Fields::default();
        self.iter().for_each(|(field, term)| said.set(field, Some(value(field, term))));
        said
    }
}

impl Fields<Said> {
    /// These fields alone.
    pub fn only(&self, fields: &[Field]) -> Fields<Said> {
        let mut only = Fields::default();
        fields.iter().for_each(|field| only.set(*field, self.get(*field).copied()));
        only
    }

    /// The same, and this.
    #[must_use]
    pub fn with(mut self, field: Field, said: impl Into<Said>) -> Fields<Said> {
        self.set(field, Some(said.into()));
        self
    }

    fn figures(&self) -> impl Iterator<Item = (Field, f64, Unit)> {
        self.iter().filter_map(|(field, said)| match said {
            Said::Figure { value, second } => Some((field, *value, field.unit(*second))),
            _ => None,
        })
    }

    /// Why the world must not be told this, whatever the rules say; `None` if it may. NaN is out of bounds, too. `whose` is
    /// `spawn` or `order`.
    pub fn out_of_bounds(&self, whose: &str) -> Option<String> {
        let figures =
            self.figures().map(|(field, value, unit)| (field.name(), value, unit.name, unit.bounds));
        out_of_bounds(whose, figures)
    }

    /// Brings every figure into its range, and drops what goes without a value: a `rate`, an `aside`, a `time_gap`. `None`
    /// if another figure has none.
    pub fn within_bounds(mut self) -> Option<Fields<Said>> {
        for (field, said) in Field::ALL.iter().zip(&mut self.0) {
            let Some(Said::Figure { value, second }) = said else { continue };
            let bounds = field.unit(*second).bounds;
            match value.is_nan() {
                false => *value = value.clamp(*bounds.start(), *bounds.end()),
                true if field.may_be_left_out() => *said = None,
                true => return None,
            }
        }
        Some(self)
    }

    /// Each as a field of the language: `speed: 3 m/s`. `names` are those of road users.
    pub fn written(&self, names: &[String]) -> Vec<String> {
        let written = |(field, said): (Field, &Said)| {
            let value = match (said, field.kind()) {
                (Said::Figure { value, second }, _) => {
                    format!("{} {}", decimal(*value, false), field.unit(*second).name).trim_end().to_owned()
                }
                (Said::Truth(truth), _) => truth.to_string(),
                (Said::Word(word), Kind::Word(kind)) => (kind.words)()[usize::from(*word)].0.to_owned(),
                (Said::Word(_), _) => unreachable!("`{}` takes no word", field.name()),
                (Said::Rules(rules), _) => {
                    let rules: Vec<&str> = rules.iter().map(Word::name).collect();
                    format!("[{}]", rules.join(", "))
                }
                (Said::Who(who), _) => names[*who].clone(),
            };
            format!("{}: {value}", field.name())
        };
        self.iter().map(written).collect()
    }
}

/// `speed_mps: f64 = Speed, Said::Figure { value, .. } => value;` makes a getter of that name and type.
macro_rules! getters {
    ($($name:ident: $of:ty = $field:ident, $said:pat => $value:expr;)*) => {
        impl Fields<Said> {$(
            pub fn $name(&self) -> Option<$of> {
                match self.get(Field::$field).copied()? {
                    $said => Some($value),
                    _ => None,
                }
            }
        )*}

        /// How many getters read something.
        #[cfg(test)]
        fn read(said: &Fields<Said>) -> usize {
            [$(said.$name().is_some()),*].into_iter().filter(|is_read| *is_read).count()
        }
    };
}

getters! {
    speed_mps: f64 = Speed, Said::Figure { value, .. } => value;
    rate_mps2: f64 = Rate, Said::Figure { value, .. } => value;
    continuous: bool = Continuous, Said::Truth(truth) => truth;
    lane: LaneChoice = Lane, Said::Word(word) => LaneChoice::ALL[usize::from(word)];
    offset_m: f64 = Offset, Said::Figure { value, .. } => value;
    aside_mps: f64 = Aside, Said::Figure { value, second: false } => value;
    aside_s: f64 = Aside, Said::Figure { value, second: true } => value;
    time_gap_s: f64 = TimeGap, Said::Figure { value, .. } => value;
    keep_m: f64 = Keep, Said::Figure { value, second: false } => value;
    keep_s: f64 = Keep, Said::Figure { value, second: true } => value;
    to: usize = To, Said::Who(who) => who;
    early_s: f64 = Early, Said::Figure { value, .. } => value;
    at_m: f64 = At, Said::Figure { value, .. } => value;
    reach_m: f64 = Reach, Said::Figure { value, .. } => value;
    steady_m: f64 = Steady, Said::Figure { value, .. } => value;
    waits_s: f64 = Waits, Said::Figure { value, .. } => value;
    meet: f64 = Meet, Said::Figure { value, .. } => value;
    ignores: IgnoredRules = Ignores, Said::Rules(rules) => rules;
    siren: bool = Siren, Said::Truth(truth) => truth;
    lights: ShownLights = Lights, Said::Word(word) => ShownLights::ALL[usize::from(word)];
    turn: Turning = Turn, Said::Word(word) => Turning::ALL[usize::from(word)];
}

impl From<f64> for Said {
    /// In the field's first unit.
    fn from(value: f64) -> Said {
        Said::Figure { value, second: false }
    }
}

impl From<bool> for Said {
    fn from(truth: bool) -> Said {
        Said::Truth(truth)
    }
}

impl From<IgnoredRules> for Said {
    fn from(rules: IgnoredRules) -> Said {
        Said::Rules(rules)
    }
}

impl<W: Word> From<W> for Said {
    fn from(word: W) -> Said {
        let place = W::ALL.iter().position(|known| *known == word);
        Said::Word(place.expect("a word is among its own").try_into().expect("there are few words"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_getter_reads_what_a_field_says() {
        for field in Field::ALL.iter().copied() {
            let figure = |second| Said::Figure { value: 1.0, second };
            let said = match field.kind() {
                Kind::Figure(_, None) => vec![figure(false)],
                Kind::Figure(_, Some(_)) => vec![figure(false), figure(true)],
                Kind::Truth => vec![Said::Truth(true)],
                Kind::Word(kind) => (0..).zip((kind.words)()).map(|(word, _)| Said::Word(word)).collect(),
                Kind::Rules => vec![Said::Rules(IgnoredRules::of([TrafficRule::Signals]))],
                Kind::Who => vec![Said::Who(0)],
                Kind::Own => continue,
            };
            for said in said {
                assert_eq!(read(&Fields::default().with(field, said)), 1, "{field:?} {said:?}");
            }
        }
    }
}
