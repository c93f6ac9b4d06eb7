//! Numbers as text: little-endian `f32` in Base64 (RFC 4648), so that every bit comes back.

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Bytes of one line: 96 characters, which stay on a line of a formatted file.
const LINE_BYTES: usize = 72;

/// The numbers as lines of text.
pub fn weights_to_lines(weights: &[f32]) -> Vec<String> {
    let bytes: Vec<u8> = weights.iter().flat_map(|weight| weight.to_le_bytes()).collect();
    bytes.chunks(LINE_BYTES).map(encode).collect()
}

/// The numbers that lines of text stand for; `None` if the text is not Base64, or
/// its bytes are not whole numbers.
pub fn weights_from_lines(lines: &[String]) -> Option<Vec<f32>> {
    let mut bytes = Vec::new();
    for line in lines {
        decode(line, &mut bytes)?;
    }
    let (weights, rest) = bytes.as_chunks();
    rest.is_empty().then(|| weights.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect())
}

fn encode(bytes: &[u8]) -> String {
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let byte = |at: usize| u32::from(chunk.get(at).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for at in 0..4 {
            let digit = ALPHABET[(bits >> (18 - 6 * at) & 63) as usize];
            text.push(if at <= chunk.len() { digit as char } else { '=' });
        }
    }
    text
}

fn decode(text: &str, bytes: &mut Vec<u8>) -> Option<()> {
    let (quads, rest) = text.as_bytes().as_chunks::<4>();
    if !rest.is_empty() {
        return None;
    }
    for (number, quad) in quads.iter().enumerate() {
        let padding = quad.iter().rev().take_while(|&&digit| digit == b'=').count();
        if padding > 2 || padding > 0 && number + 1 < quads.len() {
            return None;
        }
        let mut bits = 0_u32;
        for &digit in &quad[..4 - padding] {
            let value = ALPHABET.iter().position(|&known| known == digit)?;
            bits = bits << 6 | value as u32;
        }
        bits <<= 6 * padding;
        let [_, decoded @ ..] = bits.to_be_bytes();
        let (kept, cut) = decoded.split_at(3 - padding);
        // Left-over bits must be 0; otherwise two texts would mean the same numbers.
        if cut.iter().any(|&byte| byte != 0) {
            return None;
        }
        bytes.extend(kept);
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn text_is_as_in_the_standard() {
        let texts: Vec<String> = ["", "f", "fo", "foo", "foob"].map(|text| encode(text.as_bytes())).into();
        assert_eq!(texts, ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg=="]);
        for wrong in ["Zg=", "Zh==", "Z===", "Zg==Zm9v", "Zm9*"] {
            assert_eq!(decode(wrong, &mut Vec::new()), None, "{wrong}");
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
