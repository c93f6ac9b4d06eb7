//! Parses a text into a tree, and reports every mistake that can be told from the others.
//!
//! pest stops at the first mistake. So a failing text is read again with a rule that sets aside the parts that it cannot
//! read, up to the next line that begins a declaration. Each slice set aside is then read alone, for a message of its own.
//! The tree holds everything that could be read.

use pest::Parser;
use pest::iterators::Pair;

use crate::syntax::ast::{Doc, Field, File, FileId, Item, Span};
use crate::syntax::build::{Builder, Built, end_of};
use crate::syntax::diagnostic::{enumerated, one_of};
use crate::syntax::foreign::{Failure, Foreign, bare_point, foreign, foreign_declaration};
use crate::syntax::grammar::{
    AvaParser, EFFECT, EFFECTS, NAME, ONLY_SET, Rule, VARIANT, continues_expression, lone_item, words,
};
use crate::syntax::keyword::{CLAUSES, DECLARATIONS, OPERATORS};
use crate::syntax::scan::{Comment, Scan, scan};
use crate::syntax::{Diagnostic, code, nearest};

/// Most brackets and most `match`es within one another.
pub const DEPTH_MAX: usize = 64;

/// Most operators in one another, those around brackets included. Trees are walked by recursion.
pub const OPERATORS_MAX: usize = 128;

/// Most words and signs of a file. The parser needs some 250 bytes of memory for each.
pub const TOKENS_MAX: usize = 400_000;

/// The version of the language that this compiler reads.
pub const LANGUAGE: u64 = 1;

/// Most mistakes that are reported for one file.
const DIAGNOSTICS_MAX: usize = 100;

/// Expected where nothing better is known.
const DECLARATION: &str = "a declaration";

fn declarations() -> impl Iterator<Item = &'static str> {
    DECLARATIONS.iter().map(|(word, _)| *word)
}

/// The keywords inside declarations. Keywords of two letters are left out: too many words are near to them.
fn words_inside() -> impl Iterator<Item = &'static str> {
    let words = CLAUSES.iter().chain(OPERATORS).map(|(word, _)| *word);
    words.filter(|word| word.len() > 2).chain(["rule", "expect"])
}

/// Reads a text. The tree holds what could be read; it is whole if no diagnostic is an error.
///
/// Never panics, whatever the text, and takes time in proportion to its length.
pub fn parse(file: FileId, text: &str) -> (File, Vec<Diagnostic>) {
    let scanned = scan(file, text);
    if scanned.is_too_large {
        return (File { span: Span::new(file, 0, text.len()), ..File::default() }, sorted(scanned.problems));
    }
    let reader = Reader { file, text, scan: &scanned };
    let (tree, mistakes) = reader.read();
    let version = reader.check_version(&tree, mistakes.is_empty() && scanned.problems.is_empty());
    if let Some(newer) = version.iter().find(|found| found.code == code::VERSION) {
        // Everything else that looks wrong may be right in that version.
        return (tree, vec![newer.clone()]);
    }
    let found = scanned.problems.into_iter().chain(mistakes).chain(version).collect();
    (tree, sorted(found))
}

/// Reads fields that stand in no file, as a command's argument gives them: `time: Night, sky: { Rain: High }`.
/// `None` if the text has another form.
pub fn parse_fields(text: &str) -> Option<Vec<Field>> {
    let file = FileId::default();
    if !scan(file, text).problems.is_empty() {
        return None;
    }
    let fields = AvaParser::parse(Rule::lone_fields, text).ok()?.next()?;
    Builder::new(file).fields(fields).ok()
}

/// Sorts mistakes by their place, and keeps the first [`DIAGNOSTICS_MAX`].
fn sorted(mut found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    found.sort_by_key(Diagnostic::place);
    let more = found.len().saturating_sub(DIAGNOSTICS_MAX);
    found.truncate(DIAGNOSTICS_MAX);
    if let (Some(last), true) = (found.last_mut(), more > 0) {
        last.notes.push(format!("{more} more mistakes in this file are not shown"));
    }
    found
}

struct Reader<'a> {
    file: FileId,
    text: &'a str,
    scan: &'a Scan,
}

impl Reader<'_> {
    fn read(&self) -> (File, Vec<Diagnostic>) {
        let pairs =
            AvaParser::parse(Rule::file, self.text).or_else(|_| AvaParser::parse(Rule::recovered, self.text));
        let Some(whole) = pairs.ok().and_then(|mut pairs| pairs.next()) else {
            // This cannot happen, because the grammar recovers from everything; but the promise not
            // to panic is worth more than the proof.
            let mistake = Diagnostic::error(code::SYNTAX, "the file cannot be read");
            return (File::default(), vec![mistake.at(Span::new(self.file, 0, self.text.len()), "")]);
        };
        let mut items: Vec<Item> = Vec::new();
        let mut mistakes = Vec::new();
        let mut previous = (0, 0);
        for part in whole.into_inner() {
            let span = (part.as_span().start(), end_of(&part));
            match part.as_rule() {
                Rule::item => match self.item(part, previous.1) {
                    Ok(item) => items.push(item),
                    Err(mistake) => mistakes.push(mistake),
                },
                Rule::skipped => mistakes.extend(self.explain(span.0, span.1, previous)),
                _ => {}
            }
            previous = span;
        }
        let first = items.first().map_or(self.text.len(), |item| item.span.start);
        let docs = self.docs(0, first, Comment::is_file_doc);
        (File { docs, items, span: Span::new(self.file, 0, self.text.len()) }, mistakes)
    }

    fn item(&self, pair: Pair<'_, Rule>, previous_end: usize) -> Built<Item> {
        let builder = Builder::new(self.file);
        let span = builder.span(&pair);
        let docs = self.docs(previous_end, span.start, Comment::is_item_doc);
        Ok(Item { docs, kind: builder.item(pair)?, span })
    }

    /// The documentation between two bytes.
    fn docs(&self, from: usize, to: usize, is_doc: impl Fn(&Comment, &str) -> bool) -> Vec<Doc> {
        let first = self.scan.comments.partition_point(|comment| comment.start < from);
        let between = self.scan.comments[first..].iter().take_while(|comment| comment.start < to);
        let docs = between.filter(|comment| is_doc(comment, self.text)).map(|comment| {
            let marked = &self.text[comment.start + "///".len()..comment.end];
            let text = marked.strip_prefix(' ').unwrap_or(marked).to_owned();
            Doc { text, span: Span::new(self.file, comment.start, comment.end) }
        });
        docs.collect()
    }

    /// The mistake in a slice that was set aside; `previous` is the declaration before it.
    fn explain(&self, start: usize, end: usize, previous: (usize, usize)) -> Option<Diagnostic> {
        let starts_before = |problem: &Diagnostic| problem.place().is_some_and(|place| place.start < start);
        let next_problem = self.scan.problems.get(self.scan.problems.partition_point(starts_before));
        if next_problem.and_then(Diagnostic::place).is_some_and(|place| place.start <= end) {
            // The scan has reported it, and better than the grammar could.
            return None;
        }
        let (start, found) = self.token_after(start);
        if start >= end {
            return None;
        }
        // More effects and those of every step begin with a word of another clause.
        if declarations().chain(["on", "each"]).any(|word| word == found) {
            return Some(self.expected(&self.failure(start, end), (start, end)));
        }
        // The previous declaration may have ended too early: `f(1 2)` is read as far as `f`.
        let failure = self.failure(previous.0, end);
        if failure.at > start {
            return Some(self.expected(&failure, (previous.0, end)));
        }
        let failure = match failure.at == start {
            true => failure,
            false => Failure { at: start, expected: vec![DECLARATION], continues: false },
        };
        let span = Span::new(self.file, start, start + found.len());
        Some(self.not_a_declaration(found, span, previous.1, &failure))
    }

    /// Where the reading of one declaration fails, and what was expected there, in the author's words.
    fn failure(&self, start: usize, end: usize) -> Failure {
        match lone_item(&self.text[start..end]) {
            // The slice can be read alone, so the mistake comes after it: point at its end.
            Ok(_) => Failure { at: end, expected: vec![DECLARATION], continues: false },
            Err((at, rules)) => Failure {
                at: start + at,
                expected: in_words(&rules),
                continues: rules.iter().any(|rule| continues_expression(*rule)),
            },
        }
    }

    /// The mistake where a mark or word of another language stands at the token at which the reading failed.
    fn foreign(&self, token: usize, found: &str, failure: &Failure) -> Option<Diagnostic> {
        let same_line = !self.text[self.end_of_token_before(token)..token].contains('\n');
        Some(self.told(foreign(self.text, token, same_line, failure)?, found, failure))
    }

    fn told(&self, foreign: Foreign, found: &str, failure: &Failure) -> Diagnostic {
        let message = foreign.message;
        let message = message
            .unwrap_or_else(|| format!("expected {}, found `{found}`", enumerated(&failure.expected, "or")));
        let mistake = Diagnostic::error(code::SYNTAX, message)
            .at(Span::new(self.file, foreign.start, foreign.end), "unexpected")
            .help(foreign.help);
        match foreign.fix {
            Some((from, to, text)) => {
                let title = match text.trim() {
                    "" => "delete it".to_owned(),
                    text => format!("write `{text}`"),
                };
                mistake.fix(title, Span::new(self.file, from, to), text)
            }
            None => mistake,
        }
    }

    /// Reports a word or mark that begins no declaration. On the line where the previous declaration ended
    /// (at `previous_end`), it could also have been what the grammar expected there.
    fn not_a_declaration(
        &self,
        found: &str,
        span: Span,
        previous_end: usize,
        failure: &Failure,
    ) -> Diagnostic {
        let is_word = found.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
        let continues_line = !self.text[previous_end..span.start].contains('\n') && previous_end > 0;
        if let Some(mistake) = self.foreign(span.start, found, failure).filter(|_| continues_line || !is_word)
        {
            return mistake;
        }
        if continues_line {
            let expected = failure.expected.join(", ");
            let message = format!("expected {expected} or the next line, found `{found}`");
            return Diagnostic::error(code::SYNTAX, message).at(span, "unexpected");
        }
        if !is_word {
            return Diagnostic::error(code::SYNTAX, format!("expected a declaration, found `{found}`"))
                .at(span, "unexpected");
        }
        let unknown = Diagnostic::error(code::DECLARATION, format!("no declaration begins with `{found}`"));
        match foreign_declaration(found).or_else(|| nearest(found, declarations())) {
            Some(meant) => unknown.at(span, "unknown declaration").meant(span, meant),
            None => unknown
                .at(span, "unknown declaration")
                .note(format!("declarations begin with {}", one_of(&declarations().collect::<Vec<_>>()))),
        }
    }

    /// Reports that something else was expected at a byte of a slice.
    fn expected(&self, failure: &Failure, (start, end): (usize, usize)) -> Diagnostic {
        let words = &failure.expected;
        let expected = enumerated(words, "or");
        let (token_start, found) = self.token_after(failure.at);
        let at_end = token_start >= end;
        if let Some(pointed) = bare_point(self.text, self.end_of_token_before(token_start), failure) {
            return self.told(pointed, found, failure);
        }
        let before_end = self.scan.unclosed.partition_point(|opener| opener.start < end);
        let opener = self.scan.unclosed[..before_end].last().filter(|opener| opener.start >= start);
        if let (true, Some(opener)) = (at_end, opener) {
            let bracket = &self.text[opener.start..opener.end];
            let before = self.end_of_token_before(token_start);
            return Diagnostic::error(code::UNCLOSED, format!("`{bracket}` is never closed"))
                .at(*opener, "opened here")
                .beside(Span::new(self.file, before, before), format!("expected {expected}"));
        }
        if found == "_" && words.contains(&VARIANT) {
            return Diagnostic::error(code::SYNTAX, "a transition names its values, found `_`")
                .at(Span::new(self.file, token_start, token_start + 1), "stands for no value here")
                .help("write a line for each value that the state may change from");
        }
        if let Some(mistake) = (!at_end).then(|| self.foreign(token_start, found, failure)).flatten() {
            return mistake;
        }
        let span = Span::new(self.file, token_start, token_start + found.len());
        let mistake = Diagnostic::error(code::SYNTAX, format!("expected {expected}, found `{found}`"))
            .at(span, "unexpected");
        let effects: &[&str] = if words.contains(&EFFECT) {
            EFFECTS
        } else if words.contains(&ONLY_SET) {
            &EFFECTS[..1]
        } else {
            &[]
        };
        // Effects stand on lines of their own: a misspelt one is wrong itself, and not the end of the line before.
        if let Some(meant) = nearest(found, effects.iter().copied()).filter(|_| !at_end) {
            return mistake.meant(span, meant);
        }
        let before = self.end_of_token_before(token_start);
        let lacks_colon = !at_end && is_condition_after_head(words, found);
        let with_colon = |mistake: Diagnostic| {
            let place = Span::new(self.file, before, before);
            mistake.help("write `:` before the condition").fix("write `:`", place, ":")
        };
        if at_end || self.text[before..token_start].contains('\n') {
            // The next line is right: something is missing at the end of this one.
            let missing = Diagnostic::error(code::SYNTAX, format!("expected {expected}"))
                .at(Span::new(self.file, before, before), "here");
            return if lacks_colon { with_colon(missing) } else { missing };
        }
        if lacks_colon {
            return with_colon(mistake);
        }
        if words.contains(&NAME) && found.starts_with(|first: char| first.is_ascii_alphabetic()) {
            return mistake.help(format!("`{found}` is a word of the language; choose another name"));
        }
        let is_word = words_inside().any(|word| word == found);
        match nearest(found, words_inside()).filter(|_| found.len() > 2 && !is_word) {
            Some(meant) => mistake.meant(span, meant),
            None => mistake,
        }
    }

    /// The first token at or after a byte, and where it begins. Empty at the end of the text.
    fn token_after(&self, from: usize) -> (usize, &str) {
        let mut at = from;
        let mut next = self.scan.comments.partition_point(|comment| comment.end <= at);
        loop {
            let rest = &self.text[at..];
            at += rest.len() - rest.trim_start().len();
            match self.scan.comments.get(next) {
                Some(comment) if comment.start <= at => {
                    at = comment.end.max(at);
                    next += 1;
                }
                _ => break,
            }
        }
        let rest = &self.text[at..];
        let word =
            rest.find(|next: char| !(next.is_ascii_alphanumeric() || next == '_')).unwrap_or(rest.len());
        // A quotation in a message should fit on a line.
        let len = match word {
            0 => ["==", "!=", "<=", ">=", "=>", "->", ".."]
                .iter()
                .find(|mark| rest.starts_with(**mark))
                .map_or_else(|| rest.chars().next().map_or(0, char::len_utf8), |mark| mark.len()),
            _ => word.min(40),
        };
        (at, &rest[..len])
    }

    /// The end of the last token before a byte.
    fn end_of_token_before(&self, at: usize) -> usize {
        let mut end = at;
        let mut comments =
            self.scan.comments[..self.scan.comments.partition_point(|comment| comment.start < at)].iter();
        let mut last = comments.next_back();
        loop {
            end = self.text[..end].trim_end().len();
            match last {
                Some(comment) if comment.end >= end && comment.start < end => {
                    end = comment.start;
                    last = comments.next_back();
                }
                _ => return end,
            }
        }
    }

    /// Checks that `language` comes first and once, with a known version. `sound` says that nothing else is
    /// wrong: only then is it certain that the line is missing and not merely unreadable.
    fn check_version(&self, tree: &File, sound: bool) -> Vec<Diagnostic> {
        let mut declared = tree.items.iter().filter_map(|item| Some((item.span, item.kind.as_language()?)));
        let Some((span, number)) = declared.next() else {
            if !sound {
                return Vec::new();
            }
            let (start, found) = self.token_after(0);
            let message =
                if found.is_empty() { "the file is empty" } else { "the file does not say its language" };
            return vec![
                Diagnostic::error(code::LANGUAGE, message)
                    .at(Span::new(self.file, start, start + found.len()), "expected `language 1` here")
                    .help("begin the file with `language 1`")
                    .fix("write `language 1`", Span::new(self.file, start, start), "language 1\n"),
            ];
        };
        let mut found = Vec::new();
        let version: Option<u64> = number.digits.parse().ok();
        if version.is_none_or(|version| version > LANGUAGE) {
            let message = format!(
                "the file is written in language {}, which is newer than this compiler",
                number.digits
            );
            found.push(
                Diagnostic::error(code::VERSION, message)
                    .at(number.span, format!("this compiler reads language {LANGUAGE}"))
                    .help("use a newer avastra"),
            );
        } else if version == Some(0) {
            found.push(
                Diagnostic::error(code::VERSION, "there is no language 0")
                    .at(number.span, "")
                    .help(format!("write `language {LANGUAGE}`")),
            );
        }
        if tree.items.first().is_some_and(|first| first.span != span) {
            found.push(
                Diagnostic::error(code::LANGUAGE, "`language` must come before every other declaration")
                    .at(span, "move it to the top"),
            );
        }
        found.extend(declared.map(|(again, _)| {
            Diagnostic::error(code::LANGUAGE, "`language` is declared twice")
                .at(again, "again")
                .beside(span, "first here")
        }));
        found
    }
}

/// Whether the condition of a rule stands right after its name and what it binds, and the colon is forgotten.
fn is_condition_after_head(expected: &[&str], found: &str) -> bool {
    let is_head = ["`:`", "`during`"].iter().all(|word| expected.contains(word));
    let is_condition = found.starts_with(|first: char| first.is_ascii_alphanumeric() || first == '(');
    is_head && is_condition && nearest(found, ["on", "during"]).is_none()
}

/// The expected rules, in the author's words.
fn in_words(rules: &[Rule]) -> Vec<&'static str> {
    let mut expected = Vec::new();
    let each = |rule: &Rule| match rule {
        Rule::clause => vec![Rule::kw_with, Rule::kw_at, Rule::kw_by],
        rule => vec![*rule],
    };
    for rule in rules.iter().flat_map(each).filter(|rule| !continues_expression(*rule)) {
        if let Some(word) = words(rule).filter(|word| !expected.contains(word)) {
            expected.push(word);
        }
    }
    if expected.is_empty() {
        let only = match rules {
            [only] => words(*only),
            _ => None,
        };
        let continues = rules.iter().any(|rule| continues_expression(*rule));
        expected.push(only.unwrap_or(if continues { "an operator" } else { DECLARATION }));
    }
    expected
}
