//! The document as `avastra fmt` would write it.

use avastra_lang::syntax::ast::Span;
use avastra_lang::syntax::{self, FormatError};

use super::diagnostics::Change;
use super::workspace::Analysis;

/// The changes that format the document: none, or one from the first character that differs to the last. `None` if the
/// document does not parse; it stays as it is.
///
/// # Errors
/// If the formatted text would mean something else, which is a mistake of ours.
pub fn format(analysis: &Analysis) -> Result<Option<Vec<Change>>, FormatError> {
    let text = analysis.text(Analysis::ROOT);
    let formatted = match syntax::format(Analysis::ROOT, text) {
        Ok(formatted) => formatted,
        Err(FormatError::Syntax(_)) => return Ok(None),
        Err(error @ FormatError::Meaning) => return Err(error),
    };
    if formatted == text {
        return Ok(Some(Vec::new()));
    }
    let same = |(a, b): &(char, char)| a == b;
    let mut before: usize =
        text.chars().zip(formatted.chars()).take_while(same).map(|(a, _)| a.len_utf8()).sum();
    let rest = (&text[before..], &formatted[before..]);
    let mut after: usize =
        rest.0.chars().rev().zip(rest.1.chars().rev()).take_while(same).map(|(a, _)| a.len_utf8()).sum();
    // An editor has no position between the `\r` and the `\n` that end a line.
    let splits = |at: usize| text[..at].ends_with('\r') && text[at..].starts_with('\n');
    before -= usize::from(splits(before));
    after -= usize::from(splits(text.len() - after));
    let range = analysis.range(Span::new(Analysis::ROOT, before, text.len() - after));
    Ok(Some(vec![Change { range, text: formatted[before..formatted.len() - after].to_owned() }]))
}
