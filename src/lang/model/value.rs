//! Types and values of the language, and what an environment remembers.

use avastra_base::units::Dimension;

/// Index in [`Space::enums`](super::Space::enums).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct EnumIndex(pub usize);

/// Type of an expression, a parameter or one cell of the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    Bool,
    /// A whole number; may stand wherever a ratio may.
    Int,
    /// A real number in SI units; `Ratio` is the one without dimension.
    Quantity(Dimension),
    Enum(EnumIndex),
}

/// The largest number of a state, either side of 0: 2^53 - 1. At 2^53 itself adding 1 would change nothing.
pub(crate) const STATE_MAX: f64 = 9_007_199_254_740_991.0;

/// A value at run time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    Bool(bool),
    /// SI.
    Number(f64),
    Variant(EnumIndex, usize),
}

impl Value {
    /// Equal for equal values of one type.
    pub fn bits(self) -> u64 {
        match self {
            Value::Bool(truth) => u64::from(truth),
            // Both zeros are equal.
            Value::Number(number) => (number + 0.0).to_bits(),
            Value::Variant(_, variant) => variant as u64,
        }
    }

    /// The truth value; `false` for any other type, which the checker rules out.
    pub fn truth(self) -> bool {
        self == Value::Bool(true)
    }

    /// The number in SI units; NaN for any other type, which the checker rules out.
    pub fn number(self) -> f64 {
        match self {
            Value::Number(number) => number,
            Value::Bool(_) | Value::Variant(..) => f64::NAN,
        }
    }

    /// Whether a state may have it: whole numbers up to [`STATE_MAX`] are exact, and an infinite one would make rules
    /// mean nothing.
    pub fn is_kept(self) -> bool {
        match self {
            Value::Number(number) => number.abs() <= STATE_MAX,
            Value::Bool(_) | Value::Variant(..) => true,
        }
    }

    /// Position among the variants of its enum. `false` is 0, `true` is 1, and a number has 0.
    pub fn variant(self) -> usize {
        match self {
            Value::Variant(_, index) => index,
            Value::Bool(truth) => usize::from(truth),
            Value::Number(_) => 0,
        }
    }
}

/// The values of all state variables: one cell for a plain one, one per key for a map, in the order
/// of [`Space::states`](super::Space::states).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Memory {
    pub(crate) cells: Vec<Value>,
}

impl Memory {
    /// All cells, flat; [`StateDef::first_cell`](super::StateDef) says where the cells of a state begin.
    pub fn cells(&self) -> &[Value] {
        &self.cells
    }

    /// A copy with another value in one cell.
    pub fn with(&self, cell: usize, value: Value) -> Memory {
        let mut changed = self.clone();
        changed.cells[cell] = value;
        changed
    }
}
