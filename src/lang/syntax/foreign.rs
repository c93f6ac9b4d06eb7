//! Marks and words of other languages where this one has others: `a && b`, `x = 1` for a comparison, `if a then b`.
//!
//! They are looked for only where the grammar has failed, so they take nothing from what an author may write.

use crate::syntax::grammar::NAME;
use crate::syntax::keyword::OPERATORS;
use avastra_base::units::unit;

/// Where the grammar failed.
#[derive(Debug)]
pub struct Failure {
    pub at: usize,
    /// The expected things there, in the author's words.
    pub expected: Vec<&'static str>,
    /// Whether an expression could have gone on there.
    pub continues: bool,
}

impl Failure {
    fn expects(&self, what: &'static str) -> bool {
        self.expected.contains(&what)
    }
}

/// A mark or word of another language, and what to do about it.
#[derive(Debug, PartialEq, Eq)]
pub struct Foreign {
    /// Where it stands.
    pub start: usize,
    pub end: usize,
    /// The mistake; `None` if it is a mark of this language, too, and only stands in the wrong place.
    pub message: Option<String>,
    pub help: String,
    /// A change of one place that removes the mistake: from, to, and the text to write there.
    pub fix: Option<(usize, usize, String)>,
}

/// Marks, those first that begin with others. Some of them are marks of this language, too.
const MARKS: &[&str] = &[
    "===", "!==", "...", "..=", "&&", "||", "<>", "=<", "=>", "->", "==", ":=", "**", "++", "+=", "-=", "*=",
    "/=", "&", "|", "!", "=", ":", "^", "?", ";", "'", "#",
];

const MARK_LEN_MAX: usize = 3;

/// The mark or word of another language at which the grammar failed, if it did so at one. `token` is where the next token
/// begins, and `same_line` says whether the one before stands on its line.
pub fn foreign(text: &str, token: usize, same_line: bool, failure: &Failure) -> Option<Foreign> {
    if same_line {
        let (start, end) = word_before(text, token);
        let found = unit_of_next_entry(text, (start, end), token, failure)
            .or_else(|| percent_of_nothing(text, token, failure))
            .or_else(|| of_word(text, (start, end), prefix_word(&text[start..end], failure)?));
        if found.is_some() {
            return found;
        }
    }
    if let Some(found) = mark_at_number(text, token, same_line, failure) {
        return Some(found);
    }
    if failure.expected.iter().any(|what| what.starts_with("a phase")) && word_at(text, token) == "when" {
        return of_word(text, (token, token + "when".len()), ("write `once`".to_owned(), Some("once")));
    }
    let word = word_at(text, token);
    if !word.is_empty() {
        let meant = if same_line { infix_word(word, failure)? } else { return None };
        return of_word(text, (token, token + word.len()), meant);
    }
    // The grammar may have read the beginning of the mark: it takes `<>` for `<` and something odd.
    let first = token.saturating_sub(MARK_LEN_MAX - 1);
    (first..=token).filter(|start| text.is_char_boundary(*start)).find_map(|start| {
        let covers = |mark: &&&str| text[start..].starts_with(**mark) && start + mark.len() > token;
        of_mark(text, MARKS.iter().find(covers)?, start, failure)
    })
}

/// Advice about a word, and its replacement where that is enough.
type Meant = (String, Option<&'static str>);

fn of_word(text: &str, (start, end): (usize, usize), (help, instead): Meant) -> Option<Foreign> {
    let message = Some(format!("`{}` has no meaning here", &text[start..end]));
    Some(Foreign { start, end, message, help, fix: instead.map(|instead| (start, end, instead.to_owned())) })
}

/// The mark of this language for a mark of another one, where it stands in its place.
fn of_mark(text: &str, mark: &str, start: usize, failure: &Failure) -> Option<Foreign> {
    let end = start + mark.len();
    let is_ours = matches!(mark, "=>" | "->" | "==" | "=" | ":" | "|");
    let message = (!is_ours).then(|| format!("`{mark}` has no meaning here"));
    let told = |help: &str, fix: Option<(usize, usize, String)>| {
        Some(Foreign { start, end, message: message.clone(), help: help.to_owned(), fix })
    };
    let write = |instead: &str| told(&format!("write `{instead}`"), Some((start, end, instead.to_owned())));
    match mark {
        "&&" | "&" => write("and"),
        "||" => write("or"),
        "|" if failure.continues && !failure.expects("`|`") => write("or"),
        "!" if !failure.continues && !text[end..].starts_with('=') => {
            told("write `not`", Some((start, end, "not ".to_owned())))
        }
        "===" => write("=="),
        "!==" | "<>" => write("!="),
        "=<" => write("<="),
        "..." | "..=" => told("write `..`: both ends belong to a range", Some((start, end, "..".to_owned()))),
        "->" if failure.expects("`=>`") => write("=>"),
        "=>" if failure.expects("`->`") => write("->"),
        // Before the next entry of a block `,` is missing, and nothing is compared.
        "=>" if failure.continues && !failure.expects("`,`") => {
            told("a comparison is written `>=`", Some((start, end, ">=".to_owned())))
        }
        ":=" | "==" if failure.expects("`=`") => write("="),
        "=" if failure.continues => told("a comparison is written `==`", Some((start, end, "==".to_owned()))),
        ":" if failure.expects("`=`") => match type_of_value(text, end) {
            Some(to) => told("leave the type out: the value has one", Some((start, to, String::new()))),
            None => write("="),
        },
        "**" | "^" => told("there are no powers: multiply, as in `x * x`", None),
        "++" | "+=" | "-=" | "*=" | "/=" => told("say what the state becomes: `set count = count + 1`", None),
        "?" => told(CHOICE, None),
        ";" => {
            let line = text[end..].lines().next().unwrap_or_default().trim();
            let is_last = line.is_empty() || line.starts_with("//");
            match !is_last && failure.expects("`,`") {
                true => write(","),
                false => told("delete it: nothing ends with `;`", Some((start, end, String::new()))),
            }
        }
        "'" => told("a text stands in `\"`", None),
        "#" => told("a comment begins with `//`", Some((start, end, "//".to_owned()))),
        _ => None,
    }
}

/// The keyword that begins such a declaration, where other languages have another.
pub fn foreign_declaration(word: &str) -> Option<&'static str> {
    Some(match word {
        "const" | "var" | "val" => "let",
        "def" | "func" | "function" => "fn",
        "import" | "include" => "use",
        "assert" => "expect",
        "constraint" | "invariant" => "rule",
        _ => return None,
    })
}

/// The advice on what replaces `if … then … else …`.
const CHOICE: &str = "`match` chooses a value: `match near { true => 3 m, false => 9 m }`";

/// The advice on what replaces `if` and `else` in a list of cases.
const CASES: &str =
    "the first case that holds counts: write `condition => value`, and `_ => value` for the rest";

/// A word that other languages put between two expressions or after one.
fn infix_word(word: &str, failure: &Failure) -> Option<Meant> {
    if !failure.continues {
        return None;
    }
    let write = |instead: &'static str| Some((format!("write `{instead}`"), Some(instead)));
    match word.to_ascii_lowercase().as_str() {
        "if" | "then" | "else" | "elif" | "elseif" => Some((CHOICE.to_owned(), None)),
        "is" | "equals" | "eq" => write("=="),
        "xor" => write("!="),
        "to" => write(".."),
        "mod" => Some(("there is no remainder".to_owned(), None)),
        lower => {
            let mut operators = OPERATORS.iter().map(|(known, _)| *known);
            write(operators.find(|known| *known == lower && *known != word)?)
        }
    }
}

/// A word that other languages put before an expression. The grammar has taken it for a name.
fn prefix_word(word: &str, failure: &Failure) -> Option<Meant> {
    match word {
        "if" | "elif" | "elseif" if failure.expects("`=>`") => Some((CASES.to_owned(), None)),
        "if" | "elif" | "elseif" | "then" | "else" => failure.continues.then(|| (CHOICE.to_owned(), None)),
        "NOT" | "Not" if failure.continues => Some(("write `not`".to_owned(), Some("not"))),
        _ => None,
    }
}

/// `environment => 1 vehicles => 0` on one line: the number has taken the next entry for its unit.
fn unit_of_next_entry(
    text: &str,
    (word_start, word_end): (usize, usize),
    token: usize,
    failure: &Failure,
) -> Option<Foreign> {
    let word = &text[word_start..word_end];
    let leads_on = text[token..].starts_with("=>") || text[token..].starts_with('|');
    if !leads_on || !failure.expects("`,`") || word.is_empty() || unit(word).is_some() {
        return None;
    }
    let number_end = text[..word_start].trim_end_matches([' ', '\t']).len();
    let digits =
        text[..number_end].bytes().rev().take_while(|byte| byte.is_ascii_digit() || *byte == b'.').count();
    let start = number_end - digits;
    let is_number =
        digits > 0 && !text[..start].ends_with(|last: char| last.is_ascii_alphanumeric() || last == '_');
    is_number.then(|| Foreign {
        start,
        end: word_end,
        message: Some(format!("`{}` is read as a number with its unit", &text[start..word_end])),
        help: format!("write `,` after the number, or begin a new line with `{word}`"),
        fix: Some((number_end, number_end, ",".to_owned())),
    })
}

/// `3,5`, `.5`, `speed % 2` and `80 road.limit`: marks at which numbers or products end too early.
fn mark_at_number(text: &str, token: usize, same_line: bool, failure: &Failure) -> Option<Foreign> {
    let is_digit = |letter: char| letter.is_ascii_digit();
    let (before, after) = (&text[..token], &text[token..]);
    let mark = after.chars().next().filter(|mark| matches!(mark, ',' | '.' | '%'))?;
    let next = &after[1..];
    let told = |(start, end): (usize, usize), message: String, help: String, fix| {
        Some(Foreign { start, end, message: Some(message), help, fix })
    };
    match mark {
        ',' if failure.continues && before.ends_with(is_digit) && next.starts_with(is_digit) => {
            let whole = before.len() - before.trim_end_matches(|c: char| is_digit(c) || c == '.').len();
            let part = next.len() - next.trim_start_matches(is_digit).len();
            let (start, end) = (token - whole, token + 1 + part);
            let help = format!("write `{}.{}`", &text[start..token], &text[token + 1..end]);
            let fix = Some((token, token + 1, ".".to_owned()));
            told((start, end), "a number has a decimal point, and no comma".to_owned(), help, fix)
        }
        '.' if !failure.continues && next.starts_with(is_digit) && !before.ends_with('.') => {
            let part = next.len() - next.trim_start_matches(is_digit).len();
            let end = token + 1 + part;
            let help = format!("write `0{}`", &text[token..end]);
            let fix = Some((token, token, "0".to_owned()));
            told((token, end), "a number begins with a digit".to_owned(), help, fix)
        }
        '%' if failure.continues => {
            let message = "`%` after a number means percent".to_owned();
            told((token, token + 1), message, "there is no remainder".to_owned(), None)
        }
        '.' if same_line && next.starts_with(|next: char| next.is_ascii_alphabetic()) => {
            let (word_start, word_end) = word_before(text, token);
            let number = text[..word_start].trim_end_matches([' ', '\t']);
            let digits = number.len() - number.trim_end_matches(|c: char| is_digit(c) || c == '.').len();
            let start = number.len() - digits;
            let is_number = number.ends_with(is_digit) && !number[..start].ends_with(is_in_word);
            if !is_number || word_start == word_end || word_end != token {
                return None;
            }
            let end = token + 1 + next.find(|next| !is_in_word(next)).unwrap_or(next.len());
            let (figure, factor) = (&text[start..number.len()], &text[word_start..end]);
            let help = format!("write `{figure} * {factor}`");
            let fix = Some((number.len(), number.len(), " *".to_owned()));
            told((start, end), "between a number and what it multiplies stands `*`".to_owned(), help, fix)
        }
        _ => None,
    }
}

/// `7 % 2`: the mark makes percents of the number before it.
fn percent_of_nothing(text: &str, token: usize, failure: &Failure) -> Option<Foreign> {
    let end = text[..token].trim_end_matches([' ', '\t']).len();
    let follows = text[token..].starts_with(|next: char| next.is_ascii_alphanumeric() || next == '(');
    (failure.continues && follows && text[..end].ends_with('%')).then(|| Foreign {
        start: end - 1,
        end,
        message: Some("`%` after a number means percent".to_owned()),
        help: "there is no remainder".to_owned(),
        fix: None,
    })
}

/// `5. m/s`: the point after which a number ends, which the grammar has taken for that of a part. `end` is where the last
/// token before the failure ends.
pub fn bare_point(text: &str, end: usize, failure: &Failure) -> Option<Foreign> {
    let number = text[..end].strip_suffix('.').filter(|_| failure.expects(NAME))?;
    let from = number.rfind("..").map_or(0, |range| range + "..".len());
    let rest = number[from..].trim_end_matches(|letter: char| letter.is_ascii_digit() || letter == '.');
    let start = from + rest.len();
    let is_number = number[start..].ends_with(|last: char| last.is_ascii_digit())
        && !rest.ends_with(|letter: char| is_in_word(letter) || letter == '#');
    is_number.then(|| Foreign {
        start,
        end,
        message: Some("a number ends with a digit".to_owned()),
        help: format!("write `{}`", &number[start..]),
        fix: Some((end - 1, end, String::new())),
    })
}

/// The end of a type between `:` and `=`, as in `let far: Length = 3 m`.
fn type_of_value(text: &str, from: usize) -> Option<usize> {
    let rest = &text[from..];
    let name = rest.len() - rest.trim_start_matches([' ', '\t']).len();
    let word = word_at(text, from + name).len();
    let end = from + name + word;
    let is_value_next = text[end..].trim_start_matches([' ', '\t']).starts_with('=');
    (word > 0 && is_value_next).then_some(end)
}

/// The word that begins at a byte; empty if none does.
fn word_at(text: &str, at: usize) -> &str {
    let rest = &text[at..];
    let is_begin = rest.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
    let len = rest.find(|next: char| !is_in_word(next)).unwrap_or(rest.len());
    if is_begin { &rest[..len] } else { "" }
}

/// Where the word stands that ends before a byte, with only blanks between; empty if none does.
fn word_before(text: &str, at: usize) -> (usize, usize) {
    let end = text[..at].trim_end_matches([' ', '\t']).len();
    let len = text[..end].chars().rev().take_while(|letter| is_in_word(*letter)).count();
    let digits = text[end - len..end].bytes().take_while(u8::is_ascii_digit).count();
    // A unit may follow its number without a blank.
    (end - len + digits, end)
}

fn is_in_word(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || letter == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The message where a text fails at a byte, and the text that is written there.
    fn said(
        text: &str,
        at: usize,
        expected: &[&'static str],
        continues: bool,
    ) -> Option<(String, Option<String>)> {
        let found = foreign(text, at, true, &Failure { at, expected: expected.to_vec(), continues })?;
        let mended =
            found.fix.map(|(from, to, instead)| format!("{}{instead}{}", &text[..from], &text[to..]));
        Some((found.help, mended))
    }

    #[test]
    fn what_this_language_knows_is_left_alone() {
        assert_eq!(said("let far = = 12 m", 10, &["an expression"], false), None);
        assert_eq!(said("enum A = B < C | D", 15, &["`<`"], false), None);
        assert_eq!(said("let far != 3", 8, &["`=`"], false), None);
        assert_eq!(said("gap speed", 4, &["an operator"], true), None);
        assert_eq!(said("{ a => 1 m => 0 }", 11, &["`,`", "`}`"], true), None, "a unit that there is");
    }

    #[test]
    fn numbers_of_other_places_are_found() {
        let (help, mended) = said("let k = 3,5", 9, &["an operator"], true).unwrap();
        assert_eq!((help.as_str(), mended.as_deref()), ("write `3.5`", Some("let k = 3.5")));
        assert_eq!(said("[3, 5 }", 2, &["an operator"], true), None, "a list");
        let (help, mended) = said("let k = .5 m", 8, &["an expression"], false).unwrap();
        assert_eq!((help.as_str(), mended.as_deref()), ("write `0.5`", Some("let k = 0.5 m")));
        let (help, mended) = said("speed % 2 == 0", 6, &["an operator"], true).unwrap();
        assert_eq!((help.as_str(), mended), ("there is no remainder", None));
        let (help, mended) = said("v <= 80 road.limit", 12, &["a name"], false).unwrap();
        assert_eq!(
            (help.as_str(), mended.as_deref()),
            ("write `80 * road.limit`", Some("v <= 80 * road.limit"))
        );
        let failure = Failure { at: 8, expected: vec![NAME], continues: false };
        let pointed = |text: &str| bare_point(text, text.trim_end().len(), &failure);
        assert_eq!(pointed("v <= 5. ").unwrap().help, "write `5`");
        assert_eq!(pointed("in 1.50 .. 2.50.").unwrap().help, "write `2.50`");
        assert_eq!(pointed("in 1..2.").unwrap().help, "write `2`");
        assert_eq!(pointed("v <= road1."), None, "a part of something");
        assert_eq!(pointed("once npc#1."), None, "a part of a road user");
        assert_eq!(said("road.limit.x", 10, &["an operator"], true), None);
    }
}
