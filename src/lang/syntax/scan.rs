//! One pass over a text before the grammar sees it: comments, brackets, and characters that the
//! language does not have.
//!
//! The grammar recurses only through brackets and through the subject between `match` and its `{`. The depth of
//! both is measured here, and bounds its stack whatever the input; the number of words and signs is counted here,
//! and bounds its memory. Texts and comments are skipped by the same rules as in `ava.pest`.

use crate::syntax::ast::{FileId, Span};
use crate::syntax::keyword::{DECLARING, OPERATORS};
use crate::syntax::{DEPTH_MAX, Diagnostic, TOKENS_MAX, code};
use avastra_base::outside::is_bidi;

/// A `//` comment, markers included, up to but without the line break.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Comment {
    pub start: usize,
    pub end: usize,
    /// Whether nothing but blanks stands before it on its line.
    pub own_line: bool,
}

impl Comment {
    /// `///` on a line of its own; `////` is a plain comment.
    pub fn is_item_doc(&self, text: &str) -> bool {
        let comment = &text[self.start..self.end];
        self.own_line && comment.starts_with("///") && !comment.starts_with("////")
    }

    /// `//!` on a line of its own.
    pub fn is_file_doc(&self, text: &str) -> bool {
        self.own_line && text[self.start..self.end].starts_with("//!")
    }
}

/// The findings of one pass.
#[derive(Debug, Default)]
pub struct Scan {
    /// In the order of the text.
    pub comments: Vec<Comment>,
    /// Openers that are never closed, in the order of the text.
    pub unclosed: Vec<Span>,
    /// Mistakes that are certain without a grammar, in the order of the text.
    pub problems: Vec<Diagnostic>,
    /// Whether something is deeper than [`DEPTH_MAX`], or the text is longer than [`TOKENS_MAX`]: the grammar must not
    /// see it.
    pub is_too_large: bool,
}

/// Scans a whole text, or as much of it as has [`TOKENS_MAX`] words and signs. Linear in its length.
pub fn scan(file: FileId, text: &str) -> Scan {
    let mut scanner = Scanner {
        file,
        text,
        at: 0,
        line_blank: true,
        open: Vec::new(),
        tokens: 0,
        open_matches: 0,
        after_operand: false,
        found: Scan::default(),
    };
    while scanner.at < text.len() && scanner.tokens <= TOKENS_MAX {
        scanner.step();
    }
    scanner.check_length();
    let Scanner { open, mut found, .. } = scanner;
    found.unclosed.extend(open.into_iter().map(|(_, span)| span));
    found.unclosed.sort_unstable();
    found
}

struct Scanner<'a> {
    file: FileId,
    text: &'a str,
    at: usize,
    /// Whether the line has held nothing but blanks so far.
    line_blank: bool,
    open: Vec<(char, Span)>,
    /// Words and signs so far.
    tokens: usize,
    /// `match`es whose `{` is still to come.
    open_matches: usize,
    /// Whether the last word or sign may end an expression.
    after_operand: bool,
    found: Scan,
}

impl Scanner<'_> {
    fn step(&mut self) {
        let rest = &self.text[self.at..];
        let next = rest.chars().next().expect("the scanner stands before the end");
        let start = self.at;
        match next {
            '\n' => {
                self.line_blank = true;
                self.at += 1;
                return;
            }
            ' ' | '\t' | '\r' => {
                self.at += 1;
                return;
            }
            // A byte order mark is harmless at the very beginning.
            '\u{feff}' if start == 0 => {
                self.at += next.len_utf8();
                return;
            }
            '/' if rest.starts_with("//") => {
                self.comment();
                return;
            }
            '/' if rest.starts_with("/*") => {
                self.foreign_comment();
                return;
            }
            '"' => {
                self.quoted();
                self.after_operand = true;
            }
            '(' | '[' | '{' => {
                self.at += 1;
                // After an operand, `{` belongs to a `match`; elsewhere it begins a record.
                if next == '{' && self.after_operand {
                    self.open_matches = self.open_matches.saturating_sub(1);
                }
                self.opens(next, self.span(start));
                self.after_operand = false;
            }
            ')' | ']' | '}' => {
                self.at += 1;
                self.closes(next);
                self.after_operand = true;
            }
            _ if next.is_ascii_alphanumeric() || next == '_' => self.word(),
            _ if next.is_ascii() && !next.is_ascii_control() => {
                self.at += 1;
                self.after_operand = next == '%';
            }
            _ => self.invalid(),
        }
        self.tokens += 1;
        self.line_blank = false;
    }

    fn word(&mut self) {
        let start = self.at;
        let rest = &self.text[start..];
        let end = rest.find(|next: char| !(next.is_ascii_alphanumeric() || next == '_'));
        self.at = end.map_or(self.text.len(), |end| start + end);
        let word = &self.text[start..self.at];
        let is_operator = OPERATORS.iter().any(|(operator, _)| *operator == word);
        self.after_operand = !is_operator && !matches!(word, "match" | "where");
        if word == "match" {
            self.opens_match(self.span(start));
        } else if DECLARING.contains(&word) {
            self.open_matches = 0;
        }
    }

    /// Counts a `match`. Its subject may hold the next `match` without any bracket.
    fn opens_match(&mut self, span: Span) {
        self.open_matches += 1;
        if self.open_matches > DEPTH_MAX && !self.found.is_too_large {
            self.found.is_too_large = true;
            let message = format!("more than {DEPTH_MAX} `match`es in one another");
            let error = Diagnostic::error(code::DEPTH, message).at(span, "one too many");
            self.found.problems.push(error.help("give a part of it a name, with `let` or `fn`"));
        }
    }

    fn check_length(&mut self) {
        if self.tokens <= TOKENS_MAX || self.found.is_too_large {
            return;
        }
        self.found.is_too_large = true;
        let message = format!("the file has more than {TOKENS_MAX} words and signs");
        let error =
            Diagnostic::error(code::LENGTH, message).at(self.span(self.at), "the limit is passed here");
        let help = "make it shorter: `each` parameters make many rows of one action, `fn` says once what comes often, and \
                    a part may be a file of its own, which this one takes in by `use`";
        self.found.problems.push(error.help(help));
    }

    fn span(&self, start: usize) -> Span {
        Span::new(self.file, start, self.at)
    }

    fn comment(&mut self) {
        let start = self.at;
        self.at = self.text[start..].find('\n').map_or(self.text.len(), |newline| start + newline);
        let end = start + self.text[start..self.at].trim_end().len();
        self.found.comments.push(Comment { start, end, own_line: self.line_blank });
        self.hidden_characters(start);
    }

    /// Reports `/* … */`, a comment of other languages, and skips what is inside.
    fn foreign_comment(&mut self) {
        let start = self.at;
        let inside = start + "/*".len();
        let closer = self.text[inside..].find("*/").map(|at| inside + at);
        self.at = closer.map_or(self.text.len(), |at| at + "*/".len());
        let line_end = self.text[start..].find('\n').map_or(self.text.len(), |at| start + at);
        let span = Span::new(self.file, start, self.at.min(line_end));
        let problem = Diagnostic::error(code::COMMENT, "`/*` begins no comment")
            .at(span, "a comment begins with `//` and ends with its line")
            .help("write `//` before each of its lines");
        let whole_line =
            closer.is_some() && self.at <= line_end && self.text[self.at..line_end].trim().is_empty();
        let problem = match closer {
            Some(closer) if whole_line => {
                let text = format!("// {}", self.text[inside..closer].trim());
                problem.fix("write it with `//`", span, text)
            }
            _ => problem,
        };
        self.found.problems.push(problem);
    }

    fn quoted(&mut self) {
        let start = self.at;
        let mut escaped = false;
        for (offset, character) in self.text[start + 1..].char_indices() {
            match character {
                '\n' => {
                    self.at = start + 1 + offset;
                    return self.unclosed_text(start);
                }
                '"' if !escaped => {
                    self.at = start + 1 + offset + 1;
                    return self.hidden_characters(start);
                }
                _ => escaped = character == '\\' && !escaped,
            }
        }
        self.at = self.text.len();
        self.unclosed_text(start);
    }

    fn unclosed_text(&mut self, start: usize) {
        let span = Span::new(self.file, start, start + self.text[start..self.at].trim_end().len());
        self.found.problems.push(
            Diagnostic::error(code::TEXT, "text without a closing `\"`")
                .at(span, "begins here and must end on the same line"),
        );
    }

    fn opens(&mut self, bracket: char, span: Span) {
        self.open.push((bracket, span));
        if self.open.len() > DEPTH_MAX && !self.found.is_too_large {
            self.found.is_too_large = true;
            self.found.problems.push(
                Diagnostic::error(code::DEPTH, format!("nested deeper than {DEPTH_MAX} brackets"))
                    .at(span, "one too many")
                    .help("give a part of it a name, with `let` or `fn`"),
            );
        }
    }

    /// Closes the innermost open bracket that fits; brackets that are still open inside it are unclosed. A
    /// closing bracket that fits none is left to the grammar.
    fn closes(&mut self, bracket: char) {
        let opener = match bracket {
            ')' => '(',
            ']' => '[',
            _ => '{',
        };
        // Only the innermost few are searched, so that hostile input takes linear time.
        let innermost = self.open.iter().rev().take(DEPTH_MAX);
        if let Some(back) = innermost.map(|(open, _)| *open).position(|open| open == opener) {
            let keep = self.open.len() - 1 - back;
            let forgotten = self.open.drain(keep..).skip(1).map(|(_, span)| span);
            self.found.unclosed.extend(forgotten);
        }
    }

    /// Reports characters that make a text look like another: bidirectional overrides and the like.
    fn hidden_characters(&mut self, start: usize) {
        for (offset, character) in self.text[start..self.at].char_indices() {
            if is_bidi(character) {
                let at = start + offset;
                let span = Span::new(self.file, at, at + character.len_utf8());
                self.found.problems.push(bidi(character, span));
            }
        }
    }

    /// Reports a run of characters that mean nothing outside comments and texts.
    fn invalid(&mut self) {
        let start = self.at;
        let rest = &self.text[start..];
        let first = rest.chars().next().expect("the caller has seen it");
        if is_bidi(first) {
            self.at += first.len_utf8();
            let problem = bidi(first, self.span(start));
            self.found.problems.push(problem);
            return;
        }
        let meant = meant(first);
        let run = |character: &char| {
            !is_bidi(*character)
                && (!character.is_ascii() || character.is_ascii_control())
                && !matches!(character, '\n' | '\t' | '\r')
        };
        // A sign with a known counterpart is reported alone, so that the advice fits it.
        let taken = if meant.is_some() { 1 } else { usize::MAX };
        self.at += rest.chars().take_while(run).take(taken).map(char::len_utf8).sum::<usize>();
        let span = self.span(start);
        let what = if self.text[start..self.at].chars().any(char::is_control) {
            format!("control character U+{:04X}", u32::from(first))
        } else {
            format!("`{}` has no meaning here", &self.text[start..self.at])
        };
        let problem = Diagnostic::error(code::CHARACTER, what)
            .at(span, format!("U+{:04X}", u32::from(first)))
            .note("names are made of ASCII letters, digits and `_`; comments and texts may hold anything");
        let problem = match meant {
            Some(meant) => {
                problem.help(format!("write `{meant}`")).fix(format!("write `{meant}`"), span, meant)
            }
            None => problem,
        };
        self.found.problems.push(problem);
    }
}

fn bidi(character: char, span: Span) -> Diagnostic {
    let code_point = u32::from(character);
    Diagnostic::error(
        code::BIDI,
        format!("invisible character U+{code_point:04X} reverses the text around it"),
    )
    .at(span, "")
    .note("what such a line shows is not what it says")
    .help("delete the character")
    .fix("delete it", span, "")
}

/// The plain sign that an author meant, where a word processor put a prettier one.
fn meant(character: char) -> Option<&'static str> {
    Some(match character {
        '“' | '”' | '„' | '«' | '»' => "\"",
        '–' | '—' | '−' | '‐' | '‑' => "-",
        '×' | '·' => "*",
        '÷' => "/",
        '≤' => "<=",
        '≥' => ">=",
        '≠' => "!=",
        '→' => "->",
        '⇒' => "=>",
        '…' => "..",
        '¬' => "not",
        '∧' => "and",
        '∨' => "or",
        '∈' => "in",
        '²' => "^2",
        '°' => "deg",
        '\u{a0}' => " ",
        // Letters of other alphabets that look like Latin ones.
        'а' | 'α' => "a",
        'с' => "c",
        'е' => "e",
        'і' | 'ι' => "i",
        'о' | 'ο' => "o",
        'р' | 'ρ' => "p",
        'ѕ' => "s",
        'х' | 'χ' => "x",
        'у' => "y",
        'ν' => "v",
        'А' | 'Α' => "A",
        'В' | 'Β' => "B",
        'С' => "C",
        'Е' | 'Ε' => "E",
        'Н' | 'Η' => "H",
        'К' | 'Κ' => "K",
        'М' | 'Μ' => "M",
        'Ν' => "N",
        'О' | 'Ο' => "O",
        'Р' | 'Ρ' => "P",
        'Ѕ' => "S",
        'Т' | 'Τ' => "T",
        'Х' | 'Χ' => "X",
        '；' | '，' => ",",
        '：' => ":",
        _ => return None,
    })
}
