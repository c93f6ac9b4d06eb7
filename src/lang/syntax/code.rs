//! The codes of mistakes in the syntax. Never reused, never renumbered.

/// A word or mark that the grammar does not allow in this place.
pub const SYNTAX: &str = "AV0001";
/// No declaration begins with this word.
pub const DECLARATION: &str = "AV0002";
/// Brackets or operators that are nested too deeply.
pub const DEPTH: &str = "AV0003";
/// A bracket that is never closed.
pub const UNCLOSED: &str = "AV0004";
/// `language` is missing, late or repeated.
pub const LANGUAGE: &str = "AV0005";
/// A file for a version of the language that this compiler does not know.
pub const VERSION: &str = "AV0006";
/// A character that reverses the text around it.
pub const BIDI: &str = "AV0007";
/// A character that means nothing in the language.
pub const CHARACTER: &str = "AV0008";
/// A text literal that does not end, or that has an unknown escape.
pub const TEXT: &str = "AV0009";
/// Comparisons in a chain: `a < b < c`.
pub const CHAIN: &str = "AV0010";
/// A comment in the style of another language: `/* … */`.
pub const COMMENT: &str = "AV0012";
/// A rule with transitions that is not on exactly one state.
pub const MOVES: &str = "AV0011";
/// A file with too many words and signs.
pub const LENGTH: &str = "AV0013";
