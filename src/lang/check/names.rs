//! Declared names, suggestions for names that are not declared, and the documentation and text of a declaration.

use std::collections::BTreeMap;

use crate::model::code;
use crate::syntax::ast;
use crate::syntax::ast::{Name, Span};
use crate::syntax::{Diagnostic, listed, nearest};

/// The names of one kind of declaration.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// For each name its index among the declarations of the kind, and the span of the name.
    found: BTreeMap<String, (usize, Span)>,
    /// The names in the order of their indices.
    by_index: Vec<String>,
}

impl Names {
    /// Records a declaration, with the next index.
    ///
    /// # Errors
    /// If the name is taken.
    pub fn declare(&mut self, kind: &str, name: &Name) -> Result<(), Diagnostic> {
        if let Some((_, first)) = self.found.get(&name.text) {
            let help = match first.file == name.span.file {
                true => "rename or remove one of them",
                false => "rename one of them, or write `override` before the later one to replace the other",
            };
            let message = format!("the {kind} `{}` is declared twice", name.text);
            let error = Diagnostic::error(code::DUPLICATE, message).at(name.span, "again here");
            return Err(error.beside(*first, "first here").help(help));
        }
        self.found.insert(name.text.clone(), (self.by_index.len(), name.span));
        self.by_index.push(name.text.clone());
        Ok(())
    }

    pub fn get(&self, name: &str) -> Option<usize> {
        self.found.get(name).map(|(index, _)| *index)
    }

    /// Where a name is declared.
    pub fn place(&self, name: &str) -> Option<Span> {
        self.found.get(name).map(|(_, place)| *place)
    }

    /// The name with that index.
    pub fn name(&self, index: usize) -> Option<&str> {
        self.by_index.get(index).map(String::as_str)
    }

    pub fn all(&self) -> impl Iterator<Item = &str> {
        self.found.keys().map(String::as_str)
    }
}

/// The most names that an error lists: as many as all bodies and their classes, with a few of the author's own.
const LISTED_MAX: usize = 16;

/// The diagnostic for a name that is not declared, with the most similar candidate or a short list of them.
pub(crate) fn unknown<'a>(
    kind: &str,
    name: &str,
    span: Span,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Diagnostic {
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let error = Diagnostic::error(code::UNKNOWN, format!("unknown {kind} `{name}`")).at(span, "not declared");
    if let Some((help, instead)) = foreign(name).filter(|_| matches!(kind, "name" | "variant" | "function")) {
        let error = error.help(help);
        return match instead {
            Some(instead) => error.fix(format!("write `{instead}`"), span, instead),
            None => error,
        };
    }
    match nearest(name, candidates.iter().copied()) {
        Some(near) => error.meant(span, near),
        // All facts, because whoever asks for one that is missing needs to know what there is.
        None if !candidates.is_empty()
            && (candidates.len() <= LISTED_MAX || kind.ends_with(" fact") || kind == "field") =>
        {
            error.help(format!("there is {}", listed(&candidates)))
        }
        None => error,
    }
}

/// Help for a name that is a word of other languages, and the text to write in its place if there is one.
fn foreign(name: &str) -> Option<(&'static str, Option<&'static str>)> {
    Some(match name {
        "True" | "TRUE" => ("write `true`", Some("true")),
        "False" | "FALSE" => ("write `false`", Some("false")),
        "else" | "default" | "otherwise" => ("the rest is written `_`", Some("_")),
        "null" | "NULL" | "nil" | "undefined" => {
            ("everything has a value: an enum may have a variant for nothing, like `None`", None)
        }
        "crash" | "crashed" | "collided" => ("write `collision`", Some("collision")),
        "if" => ("`match` chooses a value: `match near { true => 3 m, false => 9 m }`", None),
        _ => return None,
    })
}

/// The documentation of a declaration, line by line.
pub(super) fn docs(item: &ast::Item) -> Vec<String> {
    item.docs.iter().map(|doc| doc.text.clone()).collect()
}

/// A declaration on one line.
pub(super) fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
