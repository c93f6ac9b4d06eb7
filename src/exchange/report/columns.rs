//! Series of numbers as small as they get in a text: quantised, differenced, deflated, in base64.
//!
//! A number becomes a whole multiple of the column's step, so it is at most half a step away from what it was. Then
//! first or second differences are taken, whichever are smaller, and written as variable-length integers: what moves
//! smoothly costs a few bits a value. The page's `decode.js` reads it back.

use avastra_base::geometry::Vec2;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use miniz_oxide::deflate::compress_to_vec_zlib;

/// Effort of the compression, of 10.
const LEVEL: u8 = 8;

/// Columns of numbers, and how each was made small.
#[derive(Debug, Default)]
pub struct Columns {
    layouts: Vec<Layout>,
    bytes: Vec<u8>,
}

/// How a column is to be read: its step, how often it was differenced, and how many values it has.
#[derive(Debug, serde::Serialize)]
struct Layout(f64, u8, usize);

impl Columns {
    /// Adds a column and gives its number.
    pub fn add(&mut self, step: f64, values: impl IntoIterator<Item = f64>) -> usize {
        let whole: Vec<i64> = values.into_iter().map(|value| (value / step).round() as i64).collect();
        let candidates: Vec<Vec<i64>> = (0..3).map(|order| differenced(&whole, order)).collect();
        let cost = |values: &Vec<i64>| -> u64 {
            values.iter().map(|value| u64::from(64 - value.unsigned_abs().leading_zeros())).sum()
        };
        let (order, smallest) = candidates
            .iter()
            .enumerate()
            .min_by_key(|(_, values)| cost(values))
            .expect("there are three candidates");
        smallest.iter().for_each(|value| push_varint(&mut self.bytes, *value));
        self.layouts.push(Layout(step, order as u8, whole.len()));
        self.layouts.len() - 1
    }

    /// Adds columns of x and y (m), and gives their numbers.
    pub fn add_points(&mut self, step: f64, points: impl Iterator<Item = Vec2> + Clone) -> [usize; 2] {
        [self.add(step, points.clone().map(|point| point.x)), self.add(step, points.map(|point| point.y))]
    }

    /// The header and all columns as text: base64 of a zlib stream of the header's length (four bytes, little end
    /// first), the header, and the columns one after another.
    pub fn pack(&self, header: &impl serde::Serialize) -> String {
        #[derive(serde::Serialize)]
        struct Whole<'a, H> {
            columns: &'a [Layout],
            header: &'a H,
        }
        let whole = Whole { columns: &self.layouts, header };
        let header = serde_json::to_vec(&whole).expect("headers are plain data");
        let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
        bytes.extend(header);
        bytes.extend(&self.bytes);
        STANDARD.encode(compress_to_vec_zlib(&bytes, LEVEL))
    }
}

fn differenced(values: &[i64], order: usize) -> Vec<i64> {
    let mut values = values.to_vec();
    for _ in 0..order {
        let mut before = 0;
        for value in &mut values {
            let difference = *value - before;
            before = *value;
            *value = difference;
        }
    }
    values
}

/// Seven bits a byte, the lowest first; the sign is the lowest bit.
fn push_varint(bytes: &mut Vec<u8>, value: i64) {
    let mut rest = ((value << 1) ^ (value >> 63)) as u64;
    while rest >= 0x80 {
        bytes.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_evenly_costs_a_byte_a_value_before_deflation() {
        let mut columns = Columns::default();
        let evenly = columns.add(0.01, (0..1000).map(|tick| 200.0 + 0.2 * f64::from(tick)));
        assert_eq!(evenly, 0);
        assert_eq!(columns.layouts[0].1, 2, "second differences");
        assert!(columns.bytes.len() < 1010, "{}", columns.bytes.len());
        // 1000 equal bytes deflate to nearly nothing.
        assert!(columns.pack(&()).len() < 150);
    }
}
