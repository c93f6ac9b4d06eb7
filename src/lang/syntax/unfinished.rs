//! A declaration that breaks off where an author is typing: what the grammar expects there, and the tree that the
//! declaration has once the shortest text ends it.
//!
//! The grammar decides both. A name of our own, [`HERE`], is put at the place. While the declaration does not parse, one of
//! the tokens is added that pest expects. Text behind the place is ignored.

use pest::Parser;

use crate::syntax::ast::{FileId, ItemKind};
use crate::syntax::build::Builder;
use crate::syntax::grammar::{AvaParser, Rule, continues_expression, lone_item, opening_words};
use crate::syntax::scan::scan;
use crate::syntax::{Diagnostic, code};

/// The name that stands at the place, in the tree of [`Unfinished`].
pub const HERE: &str = "written_here";

/// Most tokens that are added to end a declaration: enough for any that nests as deep as the language does.
const ADDED_MAX: usize = 96;

/// A longer declaration was written by a program. Completion would read it several times, so nothing is said of it.
const BYTES_MAX: usize = 200_000;

/// The tokens that end a declaration soonest, by the rule that is expected: the first that fits is added.
const ENDINGS: &[(Rule, &str)] = &[
    (Rule::close_brace, "}"),
    (Rule::close_paren, ")"),
    (Rule::close_bracket, "]"),
    (Rule::fat_arrow, "=>"),
    (Rule::colon, ":"),
    (Rule::equals, "="),
    (Rule::arrow, "->"),
    (Rule::open_brace, "{"),
    (Rule::fields, "{"),
    (Rule::open_paren, "("),
    (Rule::kw_ahead, "ahead"),
    (Rule::kw_road, "road"),
    (Rule::kw_steps, "steps"),
    (Rule::kw_also, "also"),
    (Rule::kw_set, "set"),
    (Rule::kw_rule, "rule"),
    (Rule::kw_at, "at"),
    (Rule::slash, "/"),
    (Rule::lane_id, "1"),
    (Rule::integer, "0"),
    (Rule::number, "0"),
    (Rule::expression, "0"),
    (Rule::operand, "0"),
    (Rule::name, "x"),
    (Rule::field_name, "x"),
    (Rule::moved, "x"),
    (Rule::pattern, "x"),
    (Rule::arm, "_"),
    (Rule::initial_key, "_"),
    (Rule::reward_case, "_"),
    (Rule::text, "\"\""),
    (Rule::arguments, "()"),
];

/// The context of a place in a text.
#[derive(Debug, Default)]
pub struct Unfinished {
    /// Where the word or the text literal at the place begins. A proposal replaces the text from here to the place.
    pub start: usize,
    /// The keywords that may come next.
    pub keywords: Vec<&'static str>,
    /// Whether a declaration may begin, because the one before it may end.
    pub begins_declaration: bool,
    /// Whether an infix operator may come next.
    pub continues_expression: bool,
    /// The declaration up to the place with [`HERE`] at it, and ended; `None` if no name or text may stand there, or
    /// something before the place is wrong.
    pub tree: Option<ItemKind>,
}

/// The context of a byte in a text. Empty within a comment.
pub fn unfinished(text: &str, byte: usize) -> Unfinished {
    let byte = text.floor_char_boundary(byte.min(text.len()));
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let word = text[..byte].trim_end_matches(is_word).len();
    let begin = declaration_start(text, word);
    let before = &text[begin..byte];
    if before.len() > BYTES_MAX {
        return Unfinished { start: word, ..Unfinished::default() };
    }
    let scanned = scan(FileId::default(), before);
    let is_open = |start: usize| !before[start..].contains('\n');
    if scanned.is_too_large || scanned.comments.last().is_some_and(|comment| is_open(comment.start)) {
        return Unfinished { start: word, ..Unfinished::default() };
    }
    let literals = scanned.problems.iter().filter(|problem| problem.code == code::TEXT);
    let literal = literals.filter_map(Diagnostic::place).map(|place| place.start).find(|at| is_open(*at));
    if let Some(quote) = literal {
        let inside = quote + "\"".len();
        let tree = ended(format!("{}{HERE}\"", &before[..inside]));
        return Unfinished { start: begin + inside, tree, ..Unfinished::default() };
    }
    let before = &text[begin..word];
    // No declaration has a control character, so the reading fails at the place if not before it.
    let expected = match read(&format!("{before} \u{1}")) {
        Err((at, expected)) if at == before.len() + " ".len() => expected,
        _ => Vec::new(),
    };
    let expects = |rules: &[Rule]| expected.iter().any(|rule| rules.contains(rule));
    Unfinished {
        start: word,
        keywords: expected.iter().flat_map(|rule| opening_words(*rule)).collect(),
        begins_declaration: expects(&[Rule::item, Rule::EOI]),
        continues_expression: expected.iter().any(|rule| is_infix(*rule)),
        tree: ended(format!("{before}{HERE}")),
    }
}

/// Whether an infix operator fits, and not only a unit or what stands behind a name.
fn is_infix(rule: Rule) -> bool {
    continues_expression(rule)
        && ![Rule::unit, Rule::index, Rule::field_access, Rule::arguments].contains(&rule)
}

/// Where the declaration around a byte begins: at the last line before it that begins with the keyword of one.
pub fn declaration_start(text: &str, byte: usize) -> usize {
    let mut at = byte;
    loop {
        let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
        let line = text[start..].lines().next().unwrap_or_default();
        let end = keyword_end(line).map(|end| start + end);
        if start == 0 || end.is_some_and(|end| end <= byte) || byte - start > BYTES_MAX {
            return start;
        }
        at = start - 1;
    }
}

/// The end of the keyword of a declaration at the start of a line.
fn keyword_end(line: &str) -> Option<usize> {
    if !line.starts_with(|first: char| first.is_ascii_lowercase()) {
        return None;
    }
    let keyword = AvaParser::parse(Rule::declaration_keyword, line).ok()?.next()?;
    Some(keyword.as_span().end())
}

/// The tree of a declaration that breaks off, ended in the shortest way. `None` if it fails before its end.
fn ended(mut text: String) -> Option<ItemKind> {
    for _ in 0..ADDED_MAX {
        let (at, expected) = match read(&text) {
            Ok(item) => return item,
            Err(failure) => failure,
        };
        if at < text.len() {
            return None;
        }
        let (_, token) = ENDINGS.iter().find(|(rule, _)| expected.contains(rule))?;
        text.push(' ');
        text.push_str(token);
    }
    None
}

/// Reads one declaration. `Ok(None)` if it parses, and its tree cannot be built.
///
/// # Errors
/// As [`lone_item`].
fn read(text: &str) -> Result<Option<ItemKind>, (usize, Vec<Rule>)> {
    let item = lone_item(text)?.next().and_then(|whole| whole.into_inner().next());
    Ok(item.and_then(|item| Builder::new(FileId::default()).item(item).ok()))
}
