//! Another name for what the author declared, wherever it stands.
//!
//! A rename is tried before it is offered: the files with the new name are checked. What would bring a
//! mistake is refused with the compiler's own words, and so is what would give a name another meaning.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::model::COUNTED;
use crate::syntax::ast::Span;
use crate::syntax::{Diagnostic, keyword};

use super::names::Symbol;
use super::workspace::{Analysis, Workspace};
use super::{diagnostics, tokens};

/// Where the name stands that would be renamed.
///
/// # Errors
/// If it is not the author's to rename, in a sentence for the author.
pub fn prepare(analysis: &Analysis, byte: usize) -> Result<Span, String> {
    let Some(occurrence) = analysis.names.at(Analysis::ROOT, byte) else {
        let word = tokens::word_at(analysis.text(Analysis::ROOT), byte).map(|(_, word)| word);
        return Err(match word {
            Some(word) if keyword::keywords().any(|(known, _)| *known == word) => {
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
        Symbol::State(word) if matches!(word.as_str(), "time" | "sky") => {
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

/// The changes that give the name at a byte of a document another spelling.
///
/// # Errors
/// If that cannot be, in a sentence for the author.
pub fn rename(workspace: &mut Workspace, path: &Path, byte: usize, name: &str) -> Result<Value, String> {
    let paths = workspace.paths();
    for path in &paths {
        workspace.analysis(path);
    }
    let analysis = workspace.known(path).ok_or("the document is not open")?;
    let span = prepare(analysis, byte)?;
    let old = analysis.slice(span).to_owned();
    check_name(name)?;
    let symbols = &analysis.names.at(Analysis::ROOT, byte).ok_or("there is no name here")?.symbols;
    let symbols = analysis.names.tied(symbols);
    let home = home(analysis, &symbols);
    let mut places: BTreeMap<PathBuf, BTreeSet<Span>> = BTreeMap::new();
    let mut touched = Vec::new();
    for path in &paths {
        let Some(analysis) = workspace.known(path) else { continue };
        // Another document may declare something else by that name.
        let is_same = self::home(analysis, &symbols).iter().any(|file| home.contains(file));
        if !is_same {
            continue;
        }
        if let Some(broken) = analysis.loaded.diagnostics.iter().find(|found| is_syntax(found)) {
            let file = broken.place().and_then(|place| analysis.path(place.file)).unwrap_or(path);
            return Err(format!("repair the syntax of `{}` first: {}", file.display(), broken.message));
        }
        for occurrence in analysis.names.of(&symbols) {
            let Some(file) = analysis.path(occurrence.span.file) else { continue };
            places
                .entry(file.to_owned())
                .or_default()
                .insert(Span { file: Analysis::ROOT, ..occurrence.span });
        }
        touched.push(path.clone());
    }
    let mut texts = BTreeMap::new();
    for (file, spans) in &places {
        let known = touched.iter().filter_map(|path| workspace.known(path));
        let mut found = known.filter_map(|known| Some((known, diagnostics::file_of(known, file)?)));
        let (known, id) = found.next().ok_or("a file has gone")?;
        let mut text = known.text(id).to_owned();
        for span in spans.iter().rev() {
            text.replace_range(span.start..span.end, name);
        }
        texts.insert(file.clone(), text);
    }
    for path in &touched {
        let trials = (workspace.trial(path, &BTreeMap::new()), workspace.trial(path, &texts));
        let (Some(before), Some(after)) = trials else { continue };
        if after.errors.len() > before.errors.len() {
            let reason = after.errors.into_iter().next().map(|first| first.message).unwrap_or_default();
            return Err(format!("`{old}` cannot be called `{name}`: {reason}"));
        }
        if after.names.pattern() != before.names.pattern() {
            let reason = "a name would stand for something else";
            return Err(format!("`{old}` cannot be called `{name}`: {reason}"));
        }
    }
    edit(workspace, &touched, &places, name)
}

fn is_syntax(found: &Diagnostic) -> bool {
    found.is_error() && found.code.starts_with("AV00")
}

/// The files that declare the symbols.
pub fn home(analysis: &Analysis, symbols: &BTreeSet<Symbol>) -> BTreeSet<PathBuf> {
    let declaring = analysis.names.of(symbols).filter(|occurrence| occurrence.declares);
    declaring.filter_map(|occurrence| analysis.path(occurrence.span.file)).map(Path::to_owned).collect()
}

/// A name is a word that is none of the language's.
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

fn edit(
    workspace: &Workspace,
    touched: &[PathBuf],
    places: &BTreeMap<PathBuf, BTreeSet<Span>>,
    name: &str,
) -> Result<Value, String> {
    let mut changes = serde_json::Map::new();
    for (file, spans) in places {
        let known = touched.iter().filter_map(|path| workspace.known(path));
        let mut found = known.filter_map(|known| Some((known, diagnostics::file_of(known, file)?)));
        let (known, id) = found.next().ok_or("a file has gone")?;
        let of = |span: &Span| serde_json::json!({ "range": known.range(Span { file: id, ..*span }), "newText": name });
        changes.insert(workspace.uri(file), spans.iter().map(of).collect());
    }
    Ok(serde_json::json!({ "changes": changes }))
}
