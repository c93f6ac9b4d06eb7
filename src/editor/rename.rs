//! Rename: another name for something that the author declared, wherever the name stands.
//!
//! A rename is tried first: the files are checked with the new name. It is refused if that brings a new
//! mistake, with the compiler's message, or if a name would stand for something else.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_lang::check::{Loaded, Symbol};
use avastra_lang::model::COUNTED;
use avastra_lang::model::vocabulary::{Word, WorldState};
use avastra_lang::syntax::ast::Span;
use avastra_lang::syntax::{Diagnostic, keyword};

use super::diagnostics::{Change, Changes};
use super::position::Range;
use super::workspace::{Analysis, Workspace};
use super::{diagnostics, tokens};

/// The name that a rename at this byte would change.
///
/// # Errors
/// Why the author cannot rename it, as a sentence for the author.
pub fn prepare(analysis: &Analysis, byte: usize) -> Result<Range, String> {
    nameable(analysis, byte).map(|span| analysis.range(span))
}

fn nameable(analysis: &Analysis, byte: usize) -> Result<Span, String> {
    let Some(occurrence) = analysis.references().at(Analysis::ROOT, byte) else {
        let word = tokens::word_at(analysis.text(Analysis::ROOT), byte).map(|(_, word)| word);
        return Err(match word {
            Some(word) if keyword::meaning(word).is_some() => {
                format!("`{word}` is a word of the language")
            }
            Some(word) => format!("`{word}` is declared nowhere"),
            None => "there is no name here".to_owned(),
        });
    };
    match occurrence.symbols.iter().find_map(fixed) {
        Some(reason) => Err(reason),
        None => Ok(occurrence.span),
    }
}

/// Why a symbol cannot be renamed.
fn fixed(symbol: &Symbol) -> Option<String> {
    match symbol {
        Symbol::Engine(word, _) => Some(format!("`{word}` is a word of the engine")),
        Symbol::Type(word) => Some(format!("`{word}` is a type of the language")),
        Symbol::State(word) if WorldState::from_name(word).is_some() => {
            Some(format!("the world reads the state `{word}` by this name"))
        }
        Symbol::Verdict(word) if word == COUNTED => {
            Some(format!("`{word}` is the verdict by which collisions count"))
        }
        Symbol::File(_) => Some("a file is renamed where it is, not in what uses it".to_owned()),
        Symbol::Number(..) => Some("a number has no name".to_owned()),
        _ => None,
    }
}

/// The edits that rename the name at a byte of a document, in open documents and in the other files of the
/// editor's folders.
///
/// # Errors
/// Why the rename is not possible, as a sentence for the author.
pub fn rename(workspace: &mut Workspace, path: &Path, byte: usize, name: &str) -> Result<Changes, String> {
    let paths = workspace.paths();
    for path in &paths {
        workspace.analysis(path);
    }
    let analysis = workspace.known(path).ok_or("the document is not open")?;
    let span = nameable(analysis, byte)?;
    let old = analysis.slice(span).to_owned();
    let refusal = |reason: &str| format!("`{old}` cannot be called `{name}`: {reason}");
    check_name(name)?;
    let occurrence = analysis.references().at(Analysis::ROOT, byte).ok_or("there is no name here")?;
    let mut symbols = analysis.references().tied(&occurrence.symbols.iter().cloned().collect());
    let home = home(analysis, &symbols);
    let closed = workspace.closed_users(&home);
    // Another document may declare a different thing by the same name.
    let is_same = |known: &&Analysis| self::home(known, &symbols).iter().any(|file| home.contains(file));
    let open = paths.iter().filter_map(|path| workspace.known(path));
    let touched: Vec<&Analysis> = open.chain(&closed).filter(is_same).collect();
    if let Some(reason) = touched.iter().find_map(|known| broken(known)) {
        return Err(reason);
    }
    for known in &touched {
        symbols = known.references().tied(&symbols);
    }
    if touched.iter().any(|known| is_taken(known, &symbols, name)) {
        return Err(refusal("that name is taken"));
    }
    let (texts, changes) = renamed(&touched, &symbols, name);
    let touched: Vec<PathBuf> =
        touched.iter().filter_map(|known| known.path(Analysis::ROOT)).map(Path::to_owned).collect();
    for path in &touched {
        let trials = (workspace.trial(path, &BTreeMap::new()), workspace.trial(path, &texts));
        let (Some(before), Some(after)) = trials else { continue };
        let errors = |loaded: &Loaded| loaded.diagnostics.iter().filter(|found| found.is_error()).count();
        if errors(&after) > errors(&before) {
            let first = after.diagnostics.into_iter().find(Diagnostic::is_error);
            return Err(refusal(&first.map(|first| first.message).unwrap_or_default()));
        }
        if after.references.pattern() != before.references.pattern() {
            return Err(refusal("a name would stand for something else"));
        }
    }
    Ok(changes)
}

/// Whether something of the kind of one of the symbols has that name already, at the same place.
fn is_taken(known: &Analysis, symbols: &BTreeSet<Symbol>, name: &str) -> bool {
    let of = |symbol: &Symbol| match symbol {
        Symbol::Variant(of, _) | Symbol::Argument(of, _) | Symbol::Parameter(of, _) => Some(of.clone()),
        _ => None,
    };
    let kind = |symbol: &Symbol| (std::mem::discriminant(symbol), of(symbol));
    let mut declared = known.references().symbols().filter(|symbol| symbol.word() == Some(name));
    declared.any(|other| symbols.iter().any(|symbol| kind(symbol) == kind(other) && symbol != other))
}

/// Why nothing can be renamed in a document: the syntax of one of its files is broken.
fn broken(known: &Analysis) -> Option<String> {
    let broken = known.loaded.diagnostics.iter().find(|found| is_syntax(found))?;
    let file = broken.place().map_or(Analysis::ROOT, |place| place.file);
    let file = known.path(file).unwrap_or(Path::new(""));
    Some(format!("repair the syntax of `{}` first: {}", file.shown(), broken.message))
}

/// The files with the symbols under another name: their texts, and the changes for the editor.
fn renamed(
    touched: &[&Analysis],
    symbols: &BTreeSet<Symbol>,
    name: &str,
) -> (BTreeMap<PathBuf, String>, Changes) {
    // A file that several documents use may have names that only one of them resolves.
    let mut places: BTreeMap<PathBuf, BTreeSet<Span>> = BTreeMap::new();
    for known in touched {
        for occurrence in known.references().of(symbols) {
            let Some(file) = known.path(occurrence.span.file) else { continue };
            let span = Span { file: Analysis::ROOT, ..occurrence.span };
            places.entry(file.to_owned()).or_default().insert(span);
        }
    }
    let (mut texts, mut changes) = (BTreeMap::new(), Changes::new());
    for (file, spans) in places {
        let mut found = touched.iter().filter_map(|known| Some((known, diagnostics::file_of(known, &file)?)));
        let Some((known, id)) = found.next() else { continue };
        let mut text = known.text(id).to_owned();
        spans.iter().rev().for_each(|span| text.replace_range(span.start..span.end, name));
        let change =
            |span: &Span| Change { range: known.range(Span { file: id, ..*span }), text: name.to_owned() };
        changes.insert(file.clone(), spans.iter().map(change).collect());
        texts.insert(file, text);
    }
    (texts, changes)
}

fn is_syntax(found: &Diagnostic) -> bool {
    found.is_error() && found.code.starts_with("AV00")
}

/// The files that declare the symbols.
pub fn home(analysis: &Analysis, symbols: &BTreeSet<Symbol>) -> BTreeSet<PathBuf> {
    let declaring = analysis.references().of(symbols).filter(|occurrence| occurrence.declares);
    declaring.filter_map(|occurrence| analysis.path(occurrence.span.file)).map(Path::to_owned).collect()
}

/// Refuses a text that does not have the form of a name.
fn check_name(name: &str) -> Result<(), String> {
    let is_start = |first: char| first.is_ascii_alphabetic() || first == '_';
    let is_word = name.starts_with(is_start)
        && name != "_"
        && name.chars().all(|character| character.is_ascii_alphanumeric() || character == '_');
    if is_word {
        Ok(())
    } else {
        Err(format!("`{name}` is no name: names are ASCII letters, digits and `_`"))
    }
}
