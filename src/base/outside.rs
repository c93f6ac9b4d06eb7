//! Texts from outside: what programs say, what files hold that others wrote, and file names. Each place where such a text may
//! stand has one function here, named for the place.
//!
//! A text from outside may try to end the place that it stands in. A line break ends a comment or a line of a terminal, `"`
//! a cell of CSV, `<` a text of a page. The texts that the functions here return cannot. `tests/it/layers.rs` keeps paths
//! from being printed otherwise.

use std::borrow::Cow;
use std::fmt;
use std::path::Path;

/// Whether the character changes the direction in which the text around it is shown.
pub fn is_bidi(character: char) -> bool {
    matches!(character, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Whether a terminal may obey a character: a control character other than a line feed or a tab, or a sign that turns the
/// direction of writing.
pub fn acts_on_terminal(character: char) -> bool {
    !matches!(character, '\n' | '\t') && (character.is_control() || is_bidi(character))
}

/// Whether a character may end a line or act on it.
fn acts_on_line(character: char) -> bool {
    character.is_control() || is_bidi(character) || matches!(character, '\u{2028}' | '\u{2029}')
}

/// Lines for a terminal, whose breaks are ours: characters that would act on the terminal are written as their numbers
/// (`\u{1b}`), and commands to continuous integration are broken up. Texts from outside in these lines went through
/// [`in_line`] before.
pub fn on_terminal(text: &str) -> Cow<'_, str> {
    let lines = text.split('\n').map(|line| match line.strip_suffix('\r') {
        // Windows ends lines so.
        Some(line) => Cow::Owned(format!("{}\r", escaped(line, acts_on_terminal))),
        None => escaped(line, acts_on_terminal),
    });
    let lines: Vec<Cow<'_, str>> = lines.collect();
    match lines.iter().all(|line| matches!(line, Cow::Borrowed(_))) {
        true => Cow::Borrowed(text),
        false => Cow::Owned(lines.join("\n")),
    }
}

/// A text within a line that is printed or logged. Line breaks and other control characters are written as escapes (`\n`,
/// `\u{1b}`), and commands to continuous integration are broken up.
pub fn in_line(text: &str) -> Cow<'_, str> {
    escaped(text, acts_on_line)
}

/// Command prefixes that Azure Pipelines and older runners of GitHub obey anywhere in a line.
const COMMANDS: [&str; 2] = ["##[", "##vso["];

fn escaped(text: &str, acts: fn(char) -> bool) -> Cow<'_, str> {
    // GitHub obeys `::error::` where a line begins.
    let begin = text.len() - text.trim_start().len();
    let is_command = text[begin..].starts_with("::") || COMMANDS.iter().any(|command| text.contains(command));
    if !is_command && !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut line = String::with_capacity(text.len() + 16);
    for (at, c) in text.char_indices() {
        let begins = |word: &str| text[at..].starts_with(word);
        match c {
            c if at == begin && begins("::") => line.extend(c.escape_unicode()),
            c if COMMANDS.into_iter().any(begins) => line.extend(c.escape_unicode()),
            '\n' | '\r' | '\t' if acts(c) => line.extend(c.escape_default()),
            c if acts(c) => line.extend(c.escape_unicode()),
            c => line.push(c),
        }
    }
    Cow::Owned(line)
}

/// JSON that is printed, which holds any text in its strings. A command to continuous integration anywhere in a line is
/// written with an escape, which means the same.
pub fn json_on_terminal(json: &str) -> String {
    json.replace("##", r"#\u0023")
}

/// A text within a comment of the language: one line, without signs that change how the line looks.
pub fn in_comment(text: &str) -> String {
    let is_hidden = |c: char| matches!(c, '\u{200b}'..='\u{200d}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
    if !text.contains(|c: char| acts_on_line(c) || is_hidden(c)) {
        return text.to_owned();
    }
    let is_seen = |c: &char| c.is_whitespace() || !(acts_on_line(*c) || is_hidden(*c));
    let plain: String = text.chars().filter(is_seen).collect();
    plain.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A text within a cell of CSV.
pub fn in_csv(text: &str) -> Cow<'_, str> {
    match text.contains([',', '"', '\n', '\r']) {
        true => Cow::Owned(format!("\"{}\"", text.replace('"', "\"\""))),
        false => Cow::Borrowed(text),
    }
}

/// A text within a cell of a Markdown table.
pub fn in_markdown_cell(text: &str) -> String {
    in_line(text).replace('|', "\\|")
}

/// A text within an element or an attribute of XML, SVG or HTML; what XML cannot hold at all becomes U+FFFD.
pub fn in_markup(text: &str) -> String {
    let mut escaped = String::new();
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' | '\t' | '\r' => escaped.push(' '),
            letter if letter.is_control() || matches!(letter, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('\u{fffd}');
            }
            letter => escaped.push(letter),
        }
    }
    escaped
}

/// Paths as they may stand in a line.
pub trait Shown {
    /// The path as [`in_line`] has it. `display` of the standard library would print the line breaks of a file name.
    fn shown(&self) -> ShownPath<'_>;
}

/// A path within a line.
pub struct ShownPath<'a>(&'a Path);

impl Shown for Path {
    fn shown(&self) -> ShownPath<'_> {
        ShownPath(self)
    }
}

impl fmt::Display for ShownPath<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&in_line(&self.0.to_string_lossy()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Characters that end a line, turn it, or begin a command of continuous integration.
    const HOSTILE: &str = "x\nrequire injected: ego.speed <= 1 m/s\n///\r\u{85}\u{2028}\u{2029}\u{b}\u{c}\u{202e}\u{1b}[2J\t##vso[task] */";

    #[test]
    fn nothing_acts_on_a_terminal() {
        let shown = on_terminal("a\tb\r\n\u{1b}[2J\r\u{9b}x\u{202e}");
        assert_eq!(shown, "a\tb\r\n\\u{1b}[2J\\rx\\u{202e}".replace('x', "\\u{9b}x"));
        assert_eq!(on_terminal("a\n  ::error::x\n## b"), "a\n  \\u{3a}:error::x\n## b");
    }

    #[test]
    fn a_text_from_outside_stays_in_its_line() {
        for line in [in_line(HOSTILE).into_owned(), in_comment(HOSTILE)] {
            assert!(!line.contains(acts_on_line), "{line:?}");
        }
        assert_eq!(in_line("a ä\n\tb"), "a ä\\n\\tb");
        assert_eq!(in_comment(" a\u{2028}ä\n\n b\u{7}\u{202e} "), "a ä b");
        assert_eq!(json_on_terminal(r###"["##vso[x]"]"###), r##"["#\u0023vso[x]"]"##);
        assert!(matches!(in_line("plain: text # 1"), Cow::Borrowed(_)));
        assert_eq!(in_line(" ::error::x ::"), " \\u{3a}:error::x ::");
        assert_eq!(in_line("##[error] ##vso[x] ## x"), "\\u{23}#[error] \\u{23}#vso[x] ## x");
        assert_eq!(Path::new("::a\nb").shown().to_string(), "\\u{3a}:a\\nb");
        assert_eq!(format!("{:>4}|", Path::new("a").shown()), "   a|");
    }

    #[test]
    fn cells_and_markup_hold_any_text() {
        assert_eq!(in_csv("a \"b\",\n"), "\"a \"\"b\"\",\n\"");
        assert_eq!(in_csv("a b"), "a b");
        assert_eq!(in_markdown_cell("a|b\nc"), "a\\|b\\nc");
        assert_eq!(in_markup("<a b=\"&\">\n\u{1b}"), "&lt;a b=&quot;&amp;&quot;&gt; \u{fffd}");
    }
}
