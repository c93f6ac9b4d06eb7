//! What each name is, for colours that follow meaning: a variant, a state, a word of the engine.
//!
//! Keywords, numbers and comments are coloured by the TextMate grammar.

use crate::check::Symbol;

use super::workspace::Analysis;

/// The kinds of names. A token holds the position of its kind in this list.
pub const TYPES: [&str; 9] =
    ["enum", "enumMember", "variable", "function", "parameter", "event", "namespace", "type", "property"];

/// The modifiers of a token, one bit each.
pub const MODIFIERS: [&str; 3] = ["declaration", "readonly", "defaultLibrary"];

const DECLARATION: u32 = 1;
const READONLY: u32 = 2;
const DEFAULT_LIBRARY: u32 = 4;

/// Five numbers for each name, as the protocol wants them: lines since the last name, UTF-16 units since the
/// last name or the start of the line, length, kind and modifiers.
pub fn tokens(analysis: &Analysis) -> Vec<usize> {
    let text = analysis.text(Analysis::ROOT);
    let Some(lines) = analysis.lines(Analysis::ROOT) else { return Vec::new() };
    let mut data = Vec::new();
    let mut last = (0, 0);
    for occurrence in analysis.references().in_file(Analysis::ROOT) {
        let Some((kind, modifiers)) = occurrence.symbols.first().and_then(kind) else { continue };
        let (line, column) = lines.position(text, occurrence.span.start);
        let length: usize = analysis.slice(occurrence.span).chars().map(char::len_utf16).sum();
        let since = if line == last.0 { column - last.1 } else { column };
        let declares = if occurrence.declares { DECLARATION } else { 0 };
        data.extend([line - last.0, since, length, kind, (modifiers | declares) as usize]);
        last = (line, column);
    }
    data
}

fn kind(symbol: &Symbol) -> Option<(usize, u32)> {
    let (name, modifiers) = match symbol {
        Symbol::Enum(_) | Symbol::Body(_) => ("enum", 0),
        Symbol::Variant(..) => ("enumMember", 0),
        Symbol::State(_) => ("variable", 0),
        Symbol::Constant(_) => ("variable", READONLY),
        Symbol::Function(_) => ("function", 0),
        Symbol::Argument(..) | Symbol::Parameter(..) => ("parameter", 0),
        Symbol::Action(_) => ("event", 0),
        Symbol::Group(_) | Symbol::Road(_) | Symbol::Scenario(_) | Symbol::Policy(_) => ("namespace", 0),
        Symbol::Rule(_) | Symbol::Verdict(_) => ("property", 0),
        Symbol::Engine(..) => ("property", DEFAULT_LIBRARY),
        Symbol::Type(_) => ("type", DEFAULT_LIBRARY),
        Symbol::File(_) | Symbol::Number(..) => return None,
    };
    Some((TYPES.iter().position(|known| *known == name)?, modifiers))
}
