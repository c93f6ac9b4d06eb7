//! Places in a text: bytes here, lines and UTF-16 code units in an editor.

use std::path::PathBuf;

use avastra_lang::syntax::ast::Span;

/// A place in a text, as editors count: line and UTF-16 column, both from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Point {
    pub line: usize,
    pub column: usize,
}

/// A part of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Range {
    pub start: Point,
    pub end: Point,
}

/// A part of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    pub path: PathBuf,
    pub range: Range,
}

/// The lines of a text.
#[derive(Debug, Clone)]
pub struct Lines {
    /// First byte of each line.
    starts: Vec<usize>,
}

impl Lines {
    /// Lines end with `\n`, `\r\n` or a lone `\r`, as the protocol has it.
    pub fn new(text: &str) -> Lines {
        let bytes = text.as_bytes();
        let ends = |(at, byte): (usize, &u8)| match byte {
            b'\n' => Some(at + 1),
            b'\r' if bytes.get(at + 1) != Some(&b'\n') => Some(at + 1),
            _ => None,
        };
        Lines { starts: std::iter::once(0).chain(bytes.iter().enumerate().filter_map(ends)).collect() }
    }

    /// The place of a byte. A byte within a character counts as its first.
    pub fn point(&self, text: &str, byte: usize) -> Point {
        let byte = text.floor_char_boundary(byte.min(text.len()));
        let line = self.starts.partition_point(|start| *start <= byte) - 1;
        let column = text[self.starts[line]..byte].chars().map(char::len_utf16).sum();
        Point { line, column }
    }

    /// The byte at a line and UTF-16 column. A column beyond its line means the end of the line. A line beyond the
    /// text means the end of the text. The second half of a character means its first.
    pub fn byte(&self, text: &str, line: usize, column: usize) -> usize {
        let Some(&start) = self.starts.get(line) else { return text.len() };
        let end = self.starts.get(line + 1).copied().unwrap_or(text.len());
        let content = text[start..end].trim_end_matches(['\n', '\r']);
        let mut passed = 0;
        for (offset, character) in content.char_indices() {
            passed += character.len_utf16();
            if passed > column {
                return start + offset;
            }
        }
        start + content.len()
    }

    pub fn range(&self, text: &str, span: Span) -> Range {
        Range { start: self.point(text, span.start), end: self.point(text, span.end.max(span.start)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn columns_count_utf16_units() {
        let text = "a\u{e4}\u{1f697}b\r\nc\rd";
        let lines = Lines::new(text);
        // `ä` takes two bytes and one unit, the car takes four bytes and two units.
        assert_eq!(lines.point(text, 3), Point { line: 0, column: 2 });
        assert_eq!(lines.point(text, 7), Point { line: 0, column: 4 });
        assert_eq!(lines.byte(text, 0, 4), 7);
        assert_eq!(lines.byte(text, 0, 3), 3, "within the car");
        assert_eq!(lines.byte(text, 0, 99), 8, "behind the line's end");
        assert_eq!(lines.byte(text, 2, 0), 12, "a lone carriage return ends a line");
        assert_eq!(lines.byte(text, 99, 0), text.len());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn places_read_back(text in "[a\u{e4}\u{1f697}\r\n ]{0,40}", at in 0..80_usize) {
            let lines = Lines::new(&text);
            let byte = text.floor_char_boundary(at.min(text.len()));
            let Point { line, column } = lines.point(&text, byte);
            let back = lines.byte(&text, line, column);
            // The two may differ only within the `\r\n` that ends a line.
            prop_assert!(back == byte || text[back..byte].chars().all(|c| c == '\r' || c == '\n'));
        }
    }
}
