//! What the names of a set of files stand for: every place where something is declared or meant.
//!
//! It follows the checker's order (parameters, constants, states, facts, variants), but goes over
//! trees that hold what could be read, reports nothing, and lets what is unknown be. `declared` knows
//! what there is; `walk` goes through the trees.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::syntax::ast::{FileId, Span};
use crate::units::Dimension;

use super::declared::Declared;
use super::walk;
use crate::check::LoadedFile;
use crate::syntax::Sources;

/// What a name stands for.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    File(PathBuf),
    Enum(String),
    /// Of an enum.
    Variant(String, String),
    State(String),
    Constant(String),
    Function(String),
    Action(String),
    Group(String),
    Rule(String),
    Road(String),
    Verdict(String),
    Scenario(String),
    Policy(String),
    /// Of a function.
    Argument(String, String),
    /// Of an action.
    Parameter(String, String),
    /// The engine's own: the word and what it means.
    Engine(String, &'static str),
    /// A type that nobody declares.
    Type(String),
    /// A number with its digits and unit.
    Number(String, Option<String>),
}

/// A type, as far as it can be told from a tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ty {
    Bool,
    Int,
    Quantity(Dimension),
    Enum(String),
    /// Key and value of a state.
    Map(String, Box<Ty>),
}

/// A place where a name stands.
#[derive(Debug, Clone)]
pub struct Occurrence {
    pub span: Span,
    /// More than one for a rule that binds several actions and names a parameter of each.
    pub symbols: Vec<Symbol>,
    pub declares: bool,
}

/// Every name of a set of files.
#[derive(Debug, Clone, Default)]
pub struct Names {
    pub declared: Declared,
    /// By file and place.
    occurrences: Vec<Occurrence>,
}

impl Names {
    pub fn new(files: &[LoadedFile], sources: &Sources) -> Names {
        let declared = Declared::new(files);
        let mut occurrences = walk::occurrences(files, sources, &declared);
        occurrences.sort_by_key(|occurrence| occurrence.span);
        occurrences.dedup_by(|later, earlier| later.span == earlier.span);
        Names { declared, occurrences }
    }

    /// What stands at a byte, or ends there.
    pub fn at(&self, file: FileId, byte: usize) -> Option<&Occurrence> {
        let behind = self.occurrences.partition_point(|o| (o.span.file, o.span.start) <= (file, byte));
        let before = self.occurrences[..behind].last()?;
        (before.span.file == file && byte <= before.span.end).then_some(before)
    }

    /// In the order of the text.
    pub fn in_file(&self, file: FileId) -> impl Iterator<Item = &Occurrence> {
        self.occurrences.iter().filter(move |occurrence| occurrence.span.file == file)
    }

    /// Where one of the symbols stands.
    pub fn of<'a>(&'a self, symbols: &'a BTreeSet<Symbol>) -> impl Iterator<Item = &'a Occurrence> {
        self.occurrences.iter().filter(|o| o.symbols.iter().any(|symbol| symbols.contains(symbol)))
    }

    /// The symbols, and all that must be called the same: a rule over several actions names a parameter
    /// of each by one word.
    pub fn tied(&self, symbols: &[Symbol]) -> BTreeSet<Symbol> {
        let mut tied: BTreeSet<Symbol> = symbols.iter().cloned().collect();
        loop {
            let before = tied.len();
            let more: Vec<Symbol> = self.of(&tied).flat_map(|o| o.symbols.iter().cloned()).collect();
            tied.extend(more);
            if tied.len() == before {
                return tied;
            }
        }
    }

    /// Which names stand for the same, whatever they are called: for each, in the order of the text, the
    /// number of the first one with its meaning.
    pub fn pattern(&self) -> Vec<usize> {
        let mut first: BTreeMap<&[Symbol], usize> = BTreeMap::new();
        let numbered = self.occurrences.iter().enumerate();
        numbered.map(|(number, o)| *first.entry(o.symbols.as_slice()).or_insert(number)).collect()
    }

    /// Where the symbols are declared; an `override` before what it replaces.
    pub fn declarations(&self, symbols: &[Symbol]) -> Vec<Span> {
        let wanted: BTreeSet<Symbol> = symbols.iter().cloned().collect();
        let mut spans: Vec<Span> = self.of(&wanted).filter(|o| o.declares).map(|o| o.span).collect();
        // The root comes first and overrides what it uses.
        spans.sort();
        spans
    }
}

impl Ty {
    /// As an author writes it.
    pub fn name(&self) -> String {
        match self {
            Ty::Bool => "Bool".to_owned(),
            Ty::Int => "Int".to_owned(),
            Ty::Quantity(dimension) => dimension.to_string(),
            Ty::Enum(name) => name.clone(),
            Ty::Map(key, value) => format!("{key} -> {}", value.name()),
        }
    }

    /// The enum whose variants are its values.
    pub fn variants_of(&self) -> Option<&str> {
        match self {
            Ty::Enum(name) => Some(name),
            Ty::Bool | Ty::Int | Ty::Quantity(_) | Ty::Map(..) => None,
        }
    }
}

/// What may be named in an expression beside what all files declare.
#[derive(Debug, Clone, Default)]
pub struct Locals(pub BTreeMap<String, (Vec<Symbol>, Option<Ty>)>);
