//! Numbers as text: little-endian `f32` in Base64 (RFC 4648), so that every bit comes back.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Largest weight, in absolute value. Trained ones stay below 100; larger ones than this overflow in a few layers.
pub const WEIGHT_MAX: f32 = 10_000.0;

/// Bytes of one line: 96 characters, which stay on a line of a formatted file.
const LINE_BYTES: usize = 72;

/// The numbers as lines of text.
pub fn weights_to_lines(weights: &[f32]) -> Vec<String> {
    let bytes: Vec<u8> = weights.iter().flat_map(|weight| weight.to_le_bytes()).collect();
    bytes.chunks(LINE_BYTES).map(|line| STANDARD.encode(line)).collect()
}

/// The numbers that lines of text stand for; `None` if the text is not Base64, or
/// its bytes are not whole numbers.
pub fn weights_from_lines(lines: &[String]) -> Option<Vec<f32>> {
    let mut bytes = Vec::new();
    for line in lines {
        STANDARD.decode_vec(line, &mut bytes).ok()?;
    }
    let (weights, rest) = bytes.as_chunks();
    rest.is_empty().then(|| weights.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Two texts never mean the same numbers.
    #[test]
    fn text_of_another_form_is_refused() {
        let read = |line: &str| weights_from_lines(&[line.to_owned()]);
        assert_eq!(read("AACAPw=="), Some(vec![1.0]));
        for wrong in ["AACAPw=", "AACAPx==", "AACAPw", "AACA====", "AACAPw==AACA", "AACAP*==", "AACA"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn every_bit_comes_back(bits in proptest::collection::vec(any::<u32>(), 0..100)) {
            let weights: Vec<f32> = bits.iter().map(|&bits| f32::from_bits(bits)).collect();
            let read = weights_from_lines(&weights_to_lines(&weights)).expect("it was written");
            let read: Vec<u32> = read.into_iter().map(f32::to_bits).collect();
            prop_assert_eq!(read, bits);
        }
    }
}
