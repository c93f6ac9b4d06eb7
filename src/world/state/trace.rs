//! The digest of all states of a world, tick after tick.
//!
//! Every tick gives some two hundred words, so a word may cost a few instructions. SHA-256 takes two hundred a word
//! where the processor has no instructions for it; here it closes a digest once a step. The lanes, which take the words
//! before, are made to notice accidents, not to resist forgery. Two streams that first differ in one word always have
//! different lanes after it, because each step of a lane can be undone. The words that follow bring them together again
//! by chance of 2⁻⁶⁴ alone.

use std::sync::Arc;

use avastra_base::geometry::{Pose, Vec2};
use avastra_lang::model::vocabulary::{
    Body, Colour, LaneChoice, Level, LightColour, Priority, ShownLights, Side, TimeOfDay, Turning, Verb,
};
use avastra_road::LaneIndex;
use sha2::{Digest, Sha256};

/// A word goes to one lane after the other, so that the multiplications overlap.
const LANES: usize = 4;

/// Odd, so that multiplying by it can be undone; the fractional part of the golden ratio.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

/// The words up to now.
#[derive(Debug, Clone)]
pub struct Trace {
    lanes: [u64; LANES],
    words: u64,
}

impl Default for Trace {
    /// No words yet.
    fn default() -> Trace {
        Trace { lanes: core::array::from_fn(|lane| FACTOR.rotate_left(16 * lane as u32)), words: 0 }
    }
}

impl Trace {
    #[inline]
    pub fn word(&mut self, word: u64) {
        let lane = &mut self.lanes[self.words as usize % LANES];
        let mixed = (*lane ^ word).wrapping_mul(FACTOR);
        // Multiplying carries a difference to higher bits only.
        *lane = mixed ^ (mixed >> 32);
        self.words += 1;
    }

    /// A number, bit by bit, but with one pattern for both zeros: which of them `f64::max` and similar functions give
    /// is left to the compiler.
    #[inline]
    pub fn number(&mut self, number: f64) {
        self.word((number + 0.0).to_bits());
    }

    /// SHA-256 over what the words up to now left.
    pub fn digest(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        for word in self.lanes.iter().chain([&self.words]) {
            hash.update(word.to_le_bytes());
        }
        hash.finalize().into()
    }
}

/// Stands for what is not there. No number and no count has these bits. A struct that may be absent must not begin with a field that
/// may be absent, too.
const NOTHING: u64 = 0x7ff8_7e3d_91a5_0c42;

/// State whose every bit goes into a trace.
pub trait Traced {
    fn trace(&self, trace: &mut Trace);
}

/// Implements [`Traced`] for plain structs: `traced! { Name { a, b => b.len() } but { c }; }`.
///
/// - It feeds the fields in this order; what stands after `=>` in place of a field.
/// - It leaves out the fields after `but`. A field in neither list does not compile.
/// - `traced!(enum A, B)` is for enums without data, and for what else becomes a word by itself.
macro_rules! traced {
    (@ $trace:ident, $field:ident) => { $crate::state::trace::Traced::trace($field, $trace) };
    (@ $trace:ident, $field:ident, $word:expr) => { $crate::state::trace::Traced::trace(&$word, $trace) };
    (enum $($name:ty),*) => {$(
        impl $crate::state::trace::Traced for $name {
            #[inline]
            fn trace(&self, trace: &mut $crate::state::trace::Trace) {
                trace.word(*self as u64);
            }
        }
    )*};
    ($($name:ident { $($field:ident $(=> $word:expr)?),* $(,)? } $(but { $($left:ident),* $(,)? })?;)*) => {$(
        impl $crate::state::trace::Traced for $name {
            fn trace(&self, trace: &mut $crate::state::trace::Trace) {
                let $name { $($field,)* $($($left: _,)*)? } = self;
                $($crate::state::trace::traced!(@ trace, $field $(, $word)?);)*
            }
        }
    )*};
}
pub(crate) use traced;

traced!(enum bool, u8, u32, u64, usize);
traced!(enum Body, Colour, LaneChoice, Level, LightColour, Priority, ShownLights, Side, TimeOfDay, Turning, Verb);

traced! {
    Pose { position, heading_rad };
}

impl Traced for LaneIndex {
    fn trace(&self, trace: &mut Trace) {
        trace.word(self.0 as u64);
    }
}

impl Traced for Vec2 {
    fn trace(&self, trace: &mut Trace) {
        (self.x, self.y).trace(trace);
    }
}

impl<A: Traced, B: Traced> Traced for (A, B) {
    #[inline]
    fn trace(&self, trace: &mut Trace) {
        self.0.trace(trace);
        self.1.trace(trace);
    }
}

impl<T: Traced> Traced for Box<T> {
    fn trace(&self, trace: &mut Trace) {
        self.as_ref().trace(trace);
    }
}

impl<T: Traced> Traced for Arc<T> {
    fn trace(&self, trace: &mut Trace) {
        self.as_ref().trace(trace);
    }
}

impl Traced for f64 {
    #[inline]
    fn trace(&self, trace: &mut Trace) {
        trace.number(*self);
    }
}

impl<T: Traced> Traced for Option<T> {
    #[inline]
    fn trace(&self, trace: &mut Trace) {
        match self {
            Some(value) => value.trace(trace),
            None => trace.word(NOTHING),
        }
    }
}

impl<T: Traced, const N: usize> Traced for [T; N] {
    fn trace(&self, trace: &mut Trace) {
        self.iter().for_each(|value| value.trace(trace));
    }
}

impl<T: Traced> Traced for Vec<T> {
    fn trace(&self, trace: &mut Trace) {
        self.len().trace(trace);
        self.iter().for_each(|value| value.trace(trace));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(words: &[u64]) -> [u8; 32] {
        let mut trace = Trace::default();
        words.iter().for_each(|word| trace.word(*word));
        trace.digest()
    }

    #[test]
    fn both_zeros_are_one_number() {
        let [plus, minus, other] = [0.0, -0.0, f64::from_bits(1)].map(|number| {
            let mut trace = Trace::default();
            trace.number(number);
            trace.digest()
        });
        assert_eq!(plus, minus);
        assert_ne!(plus, other);
    }

    #[test]
    fn every_bit_order_and_length_count() {
        let words: Vec<u64> = (0..9_u64).map(|word| word.wrapping_mul(0x0123_4567_89ab_cdef)).collect();
        let mut found = vec![digest(&words), digest(&words[..8])];
        for place in 0..words.len() {
            for bit in 0..64 {
                let mut changed = words.clone();
                changed[place] ^= 1 << bit;
                found.push(digest(&changed));
            }
            for other in 0..place {
                let mut changed = words.clone();
                changed.swap(place, other);
                found.push(digest(&changed));
            }
        }
        // Zeros at the end count as well.
        found.extend((1..9).map(|zeros| digest(&[0; 8][..zeros])));
        let all = found.len();
        found.sort_unstable();
        found.dedup();
        assert_eq!(found.len(), all);
    }
}
