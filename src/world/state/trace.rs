//! The digest of all states of a world, tick after tick.
//!
//! Every tick gives some two hundred words, so a word may cost a few instructions. SHA-256 takes two hundred a word
//! where the processor has none of its own; here it closes a digest once a step. What comes before is made to notice
//! accidents, not to resist forgery: two streams that first differ in one word always have different lanes after it,
//! because each step of a lane can be undone, and what follows brings them together again by chance of 2⁻⁶⁴ alone.

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

    /// A number, bit by bit, but both zeros alike: which of them `f64::max` and the like give is left to the compiler.
    #[inline]
    pub fn number(&mut self, number: f64) {
        self.word((number + 0.0).to_bits());
    }

    #[inline]
    pub fn words(&mut self, words: impl IntoIterator<Item = u64>) {
        words.into_iter().for_each(|word| self.word(word));
    }

    #[inline]
    pub fn numbers(&mut self, numbers: impl IntoIterator<Item = f64>) {
        numbers.into_iter().for_each(|number| self.number(number));
    }

    /// Which of up to 64 things there are, in one word: fed before them, it keeps what there is from being taken for what is not.
    #[inline]
    pub fn flags<const N: usize>(&mut self, flags: [bool; N]) {
        const { assert!(N <= 64, "a flag is a bit of a word") };
        self.word(flags.into_iter().enumerate().fold(0, |bits, (nth, is_so)| bits | u64::from(is_so) << nth));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(words: &[u64]) -> [u8; 32] {
        let mut trace = Trace::default();
        trace.words(words.iter().copied());
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
