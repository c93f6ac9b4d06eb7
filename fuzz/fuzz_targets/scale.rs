//! Any bytes as the choice of a construct and its size: the text must be examined within the limits.

#![no_main]

#[path = "../examine.rs"]
mod examine;
#[path = "../scale.rs"]
mod scale;

use libfuzzer_sys::fuzz_target;

/// Most times that a construct occurs.
const SIZE_MAX: usize = 3_000;

fuzz_target!(|bytes: &[u8]| {
    let [construct, low, high, ..] = bytes else { return };
    let (_, text) = scale::GRAMMAR[usize::from(*construct) % scale::GRAMMAR.len()];
    let size = 1 + usize::from(u16::from_le_bytes([*low, *high])) % SIZE_MAX;
    examine::examine(&text(size));
});
