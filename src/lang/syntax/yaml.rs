//! Reads files in YAML. A mistake is told in words for its author: line, field, and what is allowed.

use serde::de::{Deserialize, DeserializeOwned, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_path_to_error::{Path, Segment};
use serde_yaml::Spanned;

use super::diagnostic::listed;
use super::nearest;

/// Reads a value from a text in YAML, by way of JSON's values: so the parser is compiled once, and not once for each type.
///
/// # Errors
/// If the text is no YAML or has another form: the reason, with its line.
pub fn read_yaml<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let value: serde_json::Value =
        serde_yaml::from_str(text).map_err(|error| mistake(&error.to_string(), text))?;
    serde_path_to_error::deserialize(value)
        .map_err(|error| misfit(&error.inner().to_string(), error.path(), text))
}

/// The message for a value that its reader refuses; `path` leads to it.
fn misfit(said: &str, path: &Path, text: &str) -> String {
    let Ok(whole) = serde_yaml::from_str::<Lines>(text) else { return settings_mistake(said, None) };
    let (mut line, mut field, mut reached) = (1, None, Some(whole));
    for step in path {
        let Some(lines) = reached else { break };
        let next = match (step, lines) {
            (Segment::Seq { index }, Lines::List(items)) => {
                items.into_iter().nth(*index).map(|item| (item.referenced, item.value))
            }
            (Segment::Map { key }, Lines::Map(entries)) => {
                field = Some(key.as_str());
                let found = entries.into_iter().find(|(name, _)| name.value == *key);
                found.map(|(name, value)| (name.referenced, value))
            }
            _ => None,
        };
        reached = next.map(|(place, value)| {
            line = place.line();
            value
        });
    }
    format!("line {line}: {}", settings_mistake(said, field))
}

/// Where the parts of a text stand: each item of a list, and each key of a map. JSON's values do not say it, so a text with a
/// mistake is read again.
enum Lines {
    Value,
    List(Vec<Spanned<Lines>>),
    Map(Vec<(Spanned<String>, Lines)>),
}

impl<'de> Deserialize<'de> for Lines {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Lines, D::Error> {
        struct Reader;

        impl<'de> Visitor<'de> for Reader {
            type Value = Lines;

            fn expecting(&self, to: &mut std::fmt::Formatter) -> std::fmt::Result {
                to.write_str("any value")
            }

            fn visit_bool<E>(self, _: bool) -> Result<Lines, E> {
                Ok(Lines::Value)
            }

            fn visit_i64<E>(self, _: i64) -> Result<Lines, E> {
                Ok(Lines::Value)
            }

            fn visit_u64<E>(self, _: u64) -> Result<Lines, E> {
                Ok(Lines::Value)
            }

            fn visit_f64<E>(self, _: f64) -> Result<Lines, E> {
                Ok(Lines::Value)
            }

            fn visit_str<E>(self, _: &str) -> Result<Lines, E> {
                Ok(Lines::Value)
            }

            fn visit_unit<E>(self) -> Result<Lines, E> {
                Ok(Lines::Value)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Lines, A::Error> {
                let mut list = Vec::new();
                while let Some(item) = items.next_element()? {
                    list.push(item);
                }
                Ok(Lines::List(list))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Lines, A::Error> {
                let mut map = Vec::new();
                while let Some(entry) = entries.next_entry()? {
                    map.push(entry);
                }
                Ok(Lines::Map(map))
            }
        }

        deserializer.deserialize_any(Reader)
    }
}

/// The message for what the YAML reader said, whose own words speak of Rust and of YAML's grammar.
fn mistake(said: &str, text: &str) -> String {
    let first = said.trim().lines().next().unwrap_or_default();
    let first = first.strip_prefix("error: ").unwrap_or(first);
    // `line 3 column 5: what is wrong`
    let placed = first.strip_prefix("line ").and_then(|rest| {
        let (place, what) = rest.split_once(": ")?;
        let (line, column) = place.split_once(" column ")?;
        Some((line.parse::<usize>().ok()?, column.parse::<usize>().ok()?, what))
    });
    let Some((line, column, what)) = placed else { return settings_mistake(first, None) };
    let (line, column) =
        if what.contains(GOES_ON) { (opening_line(text, line), None) } else { (line, Some(column)) };
    let written = text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
    // One line may hold several keys: `agents: [{ name: random, repeats: 2 }]`.
    let before: Option<String> =
        column.map(|column| written.chars().take(column.saturating_sub(1)).collect());
    let nearest_key = before.as_deref().and_then(|before| before.rsplit_once(':')).map(|(before, _)| {
        let is_in_key = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        before.trim_end().rsplit(|c: char| !is_in_key(c)).next().unwrap_or_default()
    });
    let first_key = written.split_once(':').map(|(field, _)| field.trim().trim_start_matches("- "));
    let field = nearest_key.filter(|key| !key.is_empty()).or(first_key);
    let is_word = |field: &&str| field.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c));
    format!("line {line}: {}", settings_mistake(what, field.filter(is_word)))
}

/// Rewrites the message of a YAML reader about a mistake in settings, in words for the author; `field` is the key of the
/// line. Any other message is already ours and stays.
pub fn settings_mistake(what: &str, field: Option<&str>) -> String {
    let of_field = |text: String| field.map_or(text.clone(), |field| format!("`{field}`: {text}"));
    let unknown = what.strip_prefix("unknown field `").or(what.strip_prefix("unknown variant `"));
    if let Some((name, known)) = unknown.and_then(|rest| rest.split_once("`, expected ")) {
        return no_such(name, known);
    }
    if let Some(name) = what.strip_prefix("missing field `").and_then(|rest| rest.split('`').next()) {
        return format!("`{name}: …` is missing");
    }
    if let Some(rest) =
        what.strip_prefix("duplicate mapping key: ").or(what.strip_prefix("duplicate field `"))
    {
        let name = rest.split([',', '`']).next().unwrap_or(rest);
        return format!("`{name}` stands twice");
    }
    let mismatch = what.strip_prefix("invalid type: ").or(what.strip_prefix("invalid value: "));
    if let Some((found, expected)) = mismatch.and_then(|rest| rest.split_once(", expected ")) {
        return of_field(format!("write {}, not {}", wanted(expected), found_in_words(found)));
    }
    if let Some((_, expected)) =
        what.strip_prefix("invalid length ").and_then(|rest| rest.split_once(", expected "))
    {
        return of_field(format!("write {}", wanted(expected)));
    }
    // The layout comes first: `invalid indentation` begins as `invalid i64` does.
    said(LAYOUT, |part| what.contains(part))
        .or_else(|| said(VALUES, |begin| what.starts_with(begin)).map(of_field))
        .unwrap_or_else(|| what.to_owned())
}

/// The reader notices an unclosed quote in the first line below it that is not indented, or at the end.
const GOES_ON: &str = "multiline quoted scalar";

/// The line in which the text in quotes begins that goes on in a line, both from 1.
fn opening_line(text: &str, line: usize) -> usize {
    let above = text.lines().take(line.saturating_sub(1)).enumerate();
    above.filter(|(_, written)| written.contains(['"', '\''])).last().map_or(line, |(index, _)| index + 1)
}

fn said(table: &[Said], fits: impl Fn(&str) -> bool) -> Option<String> {
    let found = table.iter().find(|(parts, _)| parts.iter().any(|part| fits(part)));
    found.map(|(_, said)| (*said).to_owned())
}

/// Parts of a reader's sentences, and what to say in their place.
type Said = (&'static [&'static str], &'static str);

/// Values of the wrong kind, by the beginning of the reader's sentence.
const VALUES: &[Said] = &[
    (&["invalid floating point", "non-finite float"], "write a number"),
    (&["invalid boolean"], "write `true` or `false`"),
    (&["invalid u", "invalid i"], "write a whole number"),
    (&["cannot deserialize null"], "it is empty; write a text"),
    (&["expected sequence start"], "write a list: `[…]`"),
    (&["expected mapping start", "expected empty mapping"], "write `key: value` lines"),
    (&["expected scalar", "expected string scalar"], "write one value"),
];

/// Brackets, quotes, indentation, and what else of YAML settings do without.
const LAYOUT: &[Said] = &[
    (&["tabs disallowed", "found a tab", "with a tab", "tab cannot"], "indent with blanks, not with tabs"),
    (&["unclosed bracket '['"], "`[` is never closed"),
    (&["unclosed bracket '{'"], "`{` is never closed"),
    (&["mismatched bracket", "misplaced bracket"], "a bracket closes what it has not opened"),
    // These come before what is said of an indentation: it is most often the quote that is missing.
    (&["unclosed quote", GOES_ON, "unexpected document indicator"], "a text in quotes never ends"),
    (
        &["quoted scalar, found", "quoted scalar, did not"],
        "`\\` in double quotes is not followed by what it may; write `\\\\`",
    ),
    (&["unexpected character"], "a text that begins with such a mark stands in quotes"),
    (&["trailing content after"], "something stands behind the closing quote"),
    (&["unknown anchor"], "`*` stands for nothing: no `&` gives it a meaning"),
    (&["multiple YAML documents", "multiple documents"], "`---` begins a second document; write one"),
    (
        &["mapping values are not allowed"],
        "`key: value` does not fit here: look at the indentation, and put a text with `: ` in quotes",
    ),
    (&["simple key"], "`:` and a blank are missing behind the key"),
    (&["expected ',' or", "expected '}'", "placement of ':'"], "`,` or a closing bracket is missing"),
    (
        &["indentation", "indented", "expected key", "'-' ", "block sequence entries"],
        "the indentation does not fit that of the lines before",
    ),
    (&["comments must be separated"], "a comment begins with a blank and `#`"),
    (&["unexpected EOF", "unexpected eof", "unexpected end of input"], "the text ends too early"),
    (
        &["alias replay", "alias expansion", "budget breached", "recursion limit"],
        "this unfolds to too much: nest less, and write out what `*` stands for",
    ),
    (
        &["unsupported tag", "a tag", "TAG", "tagged", "!include", "!!binary", "directive"],
        "marks like `!…` and `%…` mean nothing here",
    ),
];

fn no_such(name: &str, known: &str) -> String {
    let known = known.trim_start_matches("one of ").split([',', ' ']).map(|name| name.trim_matches('`'));
    // With two known names, the reader says "`a` or `b`".
    let known: Vec<&str> = known.filter(|name| !matches!(*name, "" | "or")).collect();
    match nearest(name, known.iter().copied()) {
        Some(near) => format!("there is no `{name}`; did you mean `{near}`?"),
        None => format!("there is no `{name}`; there are {}", listed(&known)),
    }
}

/// The value that a reader expects, in the author's words. Our own types say themselves what they are.
fn wanted(expected: &str) -> &str {
    let is_sized = |kind: char| {
        expected.strip_prefix(kind).is_some_and(|rest| rest == "size" || rest.parse::<u8>().is_ok())
    };
    match expected {
        "f64" | "f32" | "floating point" => "a number",
        "a boolean" | "bool" => "`true` or `false`",
        "a string" | "string" | "str" => "a text",
        "integer" | "an integer" => "a whole number",
        _ if is_sized('u') || is_sized('i') || expected.starts_with("a nonzero ") => "a whole number",
        _ if ["a sequence", "a tuple", "an array", "tuple "]
            .iter()
            .any(|list| expected.starts_with(list)) =>
        {
            "a list"
        }
        _ if expected.starts_with("struct ") || expected == "a map" => "`key: value` lines",
        _ => expected,
    }
}

/// The value that a reader found, in the author's words: `` the text `fast` ``.
fn found_in_words(found: &str) -> String {
    match found {
        "sequence" => "a list".to_owned(),
        "map" => "`key: value` lines".to_owned(),
        "unit value" | "null" => "nothing".to_owned(),
        _ => match found.split_once(' ') {
            Some(("string", text)) => format!("the text `{}`", text.trim_matches('"')),
            Some((_, value)) if value.starts_with('`') => value.to_owned(),
            Some((_, value)) => value.trim_start_matches("point ").to_owned(),
            None => found.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only the reader's mistakes are looked at")]
    struct Settings {
        seed: Option<u64>,
        pace_mps: Option<f64>,
        yields: Option<bool>,
    }

    #[test]
    fn mistakes_name_line_and_field_and_what_is_allowed() {
        let said = |text: &str| read_yaml::<Settings>(text).expect_err("it is wrong");
        assert_eq!(said("seed: 3\npace_mp: 4\n"), "line 2: there is no `pace_mp`; did you mean `pace_mps`?");
        assert_eq!(said("x: 3\n"), "line 1: there is no `x`; there are `seed`, `pace_mps` and `yields`");
        assert_eq!(said("seed: abc\n"), "line 1: `seed`: write a whole number, not the text `abc`");
        assert_eq!(said("pace_mps: fast\n"), "line 1: `pace_mps`: write a number, not the text `fast`");
        let infinite = "seed: 1\npace_mps: -.inf\n";
        let error = read_yaml::<serde_json::Value>(infinite).expect_err("it is wrong");
        assert_eq!(error, "line 2: `pace_mps`: write a number");
        assert_eq!(
            said("seed: 1\nyields: maybe\n"),
            "line 2: `yields`: write `true` or `false`, not the text `maybe`"
        );
        assert_eq!(said("seed: 3\nseed: 4\n"), "line 2: `seed` stands twice");
        assert_eq!(
            said("{ pace_mps: 4, seed: abc }\n"),
            "line 1: `seed`: write a whole number, not the text `abc`"
        );
        // The key stands above its value, and the item that is wrong in a list.
        let lists = |text: &str| read_yaml::<BTreeMap<String, Vec<Settings>>>(text).expect_err("it is wrong");
        assert_eq!(
            lists("a:\n  - seed: 1\n\n  - { seed: 2 }\nb:\n  -\n    pace_mps: 1\n    sed: 3\n"),
            "line 8: there is no `sed`; did you mean `seed`?"
        );
        assert_eq!(
            lists("a:\n  - seed: 1\n  - fast\n"),
            "line 3: `a`: write `key: value` lines, not the text `fast`"
        );
    }

    #[test]
    fn mistakes_of_layout_are_told_as_what_they_are() {
        let quote = "a text in quotes never ends";
        let tab = "indent with blanks, not with tabs";
        let comma = "`,` or a closing bracket is missing";
        let bracket = "a bracket closes what it has not opened";
        for (text, line, ours) in [
            ("a:\n\tb: 3\n", 2, tab),
            ("a: 1\n\tb: 3\n", 1, tab),
            ("a:\n  b: 3\n\tc: 4\n", 2, tab),
            ("seed: \"abc", 1, quote),
            ("seed: \"abc\n", 1, quote),
            ("seed: \"abc\npace: 3\n", 1, quote),
            ("seed: 'abc\npace: 3\n", 1, quote),
            ("a:\n  b: \"abc\n\n  c: 3\n", 2, quote),
            ("a: [1, \"b, 2]\nc: 3\n", 1, quote),
            ("a: \"one\n---\nb: 2\n", 1, quote),
            ("a: \"b\" c\n", 1, "something stands behind the closing quote"),
            ("a: \"b\\q\"\n", 1, "`\\` in double quotes is not followed by what it may; write `\\\\`"),
            ("a: 1\n---\nb: 2\n", 3, "`---` begins a second document; write one"),
            ("a: *other\n", 1, "`*` stands for nothing: no `&` gives it a meaning"),
            ("a: [1, 2", 1, "`[` is never closed"),
            ("a: {b: 1\n", 1, "`{` is never closed"),
            ("a: [1, 2\nb: 3\n", 2, comma),
            ("a: {b: 3\nc: {}\n", 2, comma),
            ("a: [1}\n", 1, bracket),
            ("a: ]\n", 1, bracket),
        ] {
            let error = read_yaml::<serde_json::Value>(text).expect_err("it is wrong");
            assert_eq!(error, format!("line {line}: {ours}"), "{text:?}");
        }
    }

    #[test]
    fn the_words_of_readers_become_ours() {
        for (said, ours) in [
            ("missing field `agents`", "`agents: …` is missing"),
            ("invalid type: string \"fast\", expected f64", "`speed`: write a number, not the text `fast`"),
            (
                "invalid type: sequence, expected struct Timeouts",
                "`speed`: write `key: value` lines, not a list",
            ),
            ("invalid type: floating point `3.5`, expected u64", "`speed`: write a whole number, not `3.5`"),
            ("invalid length 3, expected an array of length 2", "`speed`: write a list"),
            ("expected sequence start", "`speed`: write a list: `[…]`"),
            ("expected mapping start", "`speed`: write `key: value` lines"),
            ("cannot deserialize null into string; use Option<String>", "`speed`: it is empty; write a text"),
            ("alias references unknown anchor", "`*` stands for nothing: no `&` gives it a meaning"),
            ("a step is from 1 to 9", "a step is from 1 to 9"),
        ] {
            assert_eq!(settings_mistake(said, Some("speed")), ours);
        }
    }
}
