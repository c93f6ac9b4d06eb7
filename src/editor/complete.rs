//! Completion: what may be written next, as an editor lists it.

use std::collections::BTreeSet;
use std::path::Path;

use avastra_base::units;
use avastra_lang::check::{Symbol, normal};
use avastra_lang::model::Type;
use avastra_lang::syntax::ast::Span;
use avastra_lang::syntax::keyword;

use super::context::Kind;
use super::position::Range;
use super::words::Entry;
use super::workspace::{Analysis, Workspace};
use super::{context, hover, words};

/// The kind of a proposal, as shown to the author.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProposalKind {
    Function,
    /// A field, a word of the engine or a parameter.
    Field,
    /// A state or a parameter.
    Variable,
    Type,
    /// A group or a road.
    Module,
    Unit,
    Enum,
    Variant,
    Keyword,
    File,
    Constant,
    Action,
    /// An operator, a rule or a verdict.
    Operator,
}

/// A word that may be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Proposal {
    pub label: String,
    pub kind: ProposalKind,
    /// How well it fits: 0 is best.
    pub rank: u32,
    /// A type, an enum or a dimension; may be empty.
    pub detail: String,
    /// In Markdown; may be empty.
    pub text: String,
}

/// The texts that may be written next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Proposals {
    /// The part of the text that a proposal replaces.
    pub range: Range,
    pub list: Vec<Proposal>,
}

// How well a proposal fits.
const WANTED: u32 = 0;
const LIKELY: u32 = 1;
const POSSIBLE: u32 = 2;

/// The proposals at a byte of the document. `workspace` lists the files that a path may name.
pub fn complete(workspace: &Workspace, analysis: &Analysis, byte: usize) -> Proposals {
    let text = analysis.text(Analysis::ROOT);
    let (kinds, start) = context::wanted(analysis.references(), text, byte);
    let range = analysis.range(Span::new(Analysis::ROOT, start, byte.max(start)));
    let mut list = List { workspace, analysis, seen: BTreeSet::new(), found: Vec::new() };
    kinds.iter().for_each(|kind| list.kind(kind));
    Proposals { range, list: list.found }
}

struct List<'a> {
    workspace: &'a Workspace,
    analysis: &'a Analysis,
    seen: BTreeSet<String>,
    found: Vec<Proposal>,
}

impl List<'_> {
    fn kind(&mut self, kind: &Kind) {
        match kind {
            Kind::Declarations => self.words(keyword::DECLARATIONS, ProposalKind::Keyword, LIKELY),
            Kind::Words(entries) => self.words(entries, ProposalKind::Field, WANTED),
            Kind::Keyword(word) => {
                self.add(word, ProposalKind::Keyword, LIKELY, "", keyword::meaning(word).map(str::to_owned));
            }
            Kind::Types => {
                self.kind(&Kind::Enums);
                self.words(&words::types(), ProposalKind::Type, LIKELY);
            }
            Kind::Bodies => {
                self.words(&words::engine_words("body"), ProposalKind::Field, WANTED);
                self.symbols(ProposalKind::Enum, |symbol| matches!(symbol, Symbol::Body(_)));
            }
            Kind::Enums => self.symbols(ProposalKind::Enum, |symbol| matches!(symbol, Symbol::Enum(_))),
            Kind::Units => {
                for unit in units::UNITS {
                    self.add(unit.word, ProposalKind::Unit, WANTED, &unit.dimension.to_string(), None);
                }
            }
            Kind::Actions => self.symbols(ProposalKind::Action, |symbol| matches!(symbol, Symbol::Action(_))),
            Kind::Groups => self.symbols(ProposalKind::Module, |symbol| matches!(symbol, Symbol::Group(_))),
            Kind::States => self.symbols(ProposalKind::Variable, |symbol| matches!(symbol, Symbol::State(_))),
            Kind::Roads => self.symbols(ProposalKind::Module, |symbol| matches!(symbol, Symbol::Road(_))),
            Kind::Trajectories => {
                self.symbols(ProposalKind::Module, |symbol| matches!(symbol, Symbol::Trajectory(_)));
            }
            Kind::Manoeuvres => {
                self.symbols(ProposalKind::Function, |symbol| matches!(symbol, Symbol::Manoeuvre(_)))
            }
            Kind::RoadUsers => {
                self.symbols(ProposalKind::Variable, |symbol| matches!(symbol, Symbol::RoadUser(_)))
            }
            Kind::Rules => self.symbols(ProposalKind::Operator, |symbol| matches!(symbol, Symbol::Rule(_))),
            Kind::Requirements => {
                self.symbols(ProposalKind::Operator, |symbol| matches!(symbol, Symbol::Requirement(_)))
            }
            Kind::Verdicts => {
                self.symbols(ProposalKind::Operator, |symbol| matches!(symbol, Symbol::Verdict(_)))
            }
            Kind::Functions => {
                self.symbols(ProposalKind::Function, |symbol| matches!(symbol, Symbol::Function(_)))
            }
            Kind::Constants => {
                self.symbols(ProposalKind::Constant, |symbol| matches!(symbol, Symbol::Constant(_)))
            }
            Kind::Value(ty) => self.value(*ty),
            Kind::Operators => self.words(keyword::OPERATORS, ProposalKind::Operator, POSSIBLE),
            Kind::Variants(of) => self.variants(of, WANTED),
            Kind::Local(name, ty, fits) => {
                let ty = ty.map(|ty| self.analysis.references().type_name(ty)).unwrap_or_default();
                self.add(name, ProposalKind::Variable, if *fits { WANTED } else { LIKELY }, &ty, None);
            }
            Kind::Parameters(action, axis) => {
                let references = self.analysis.references();
                let action = references.declaration(&Symbol::Action(action.clone()));
                for parameter in action.iter().flat_map(|action| &action.parts) {
                    if references.declaration(parameter).is_some_and(|known| known.axis == *axis) {
                        self.symbol(parameter, ProposalKind::Field, WANTED);
                    }
                }
            }
            Kind::Files(extension, written) => self.files(extension, written),
        }
    }

    fn value(&mut self, ty: Option<Type>) {
        let references = self.analysis.references();
        match ty.and_then(|ty| references.enum_of(ty)) {
            Some(of) => self.variants(&of.name, WANTED),
            None => {
                for symbol in references.symbols() {
                    if let Symbol::Enum(of) = symbol {
                        self.variants(of, POSSIBLE);
                    }
                }
            }
        }
        if ty.is_none_or(|ty| ty == Type::Bool) {
            self.words(keyword::LITERALS, ProposalKind::Keyword, POSSIBLE);
        }
        for symbol in references.symbols() {
            let found = references.declaration(symbol).and_then(|known| known.ty);
            let rank = if found.is_some() && found == ty { WANTED } else { LIKELY };
            match symbol {
                Symbol::Constant(_) => self.symbol(symbol, ProposalKind::Constant, rank),
                Symbol::Function(_) => self.symbol(symbol, ProposalKind::Function, rank),
                Symbol::State(_) => self.symbol(symbol, ProposalKind::Variable, LIKELY),
                _ => {}
            }
        }
        self.kind(&Kind::Keyword("match"));
        self.kind(&Kind::Keyword("not"));
    }

    fn variants(&mut self, of: &str, rank: u32) {
        let variants = self.analysis.references().enum_named(of).map(|of| of.variants.as_slice());
        for variant in variants.unwrap_or_default() {
            self.add(variant, ProposalKind::Variant, rank, of, None);
        }
    }

    fn words(&mut self, entries: &[Entry], kind: ProposalKind, rank: u32) {
        for (word, meaning) in entries {
            self.add(word, kind, rank, "", Some((*meaning).to_owned()));
        }
    }

    /// Every declared symbol of a kind.
    fn symbols(&mut self, kind: ProposalKind, is_wanted: impl Fn(&Symbol) -> bool) {
        for symbol in self.analysis.references().symbols().filter(|symbol| is_wanted(symbol)) {
            self.symbol(symbol, kind, WANTED);
        }
    }

    fn symbol(&mut self, symbol: &Symbol, kind: ProposalKind, rank: u32) {
        let text = hover::describe(self.analysis, symbol);
        self.add(symbol.word().unwrap_or_default(), kind, rank, "", text);
    }

    fn add(
        &mut self,
        label: &str,
        kind: ProposalKind,
        rank: u32,
        detail: &str,
        documentation: Option<String>,
    ) {
        if self.seen.insert(label.to_owned()) {
            let (label, detail) = (label.to_owned(), detail.to_owned());
            self.found.push(Proposal { label, kind, rank, detail, text: documentation.unwrap_or_default() });
        }
    }

    /// Files and folders that continue a path.
    fn files(&mut self, extension: &str, written: &str) {
        let root = &self.analysis.loaded.files[0].path;
        let folder = root.parent().unwrap_or(Path::new(""));
        let beginning = written.rfind('/').map_or("", |slash| &written[..=slash]);
        let directory = normal(&folder.join(beginning));
        let named = |(name, is_folder): (String, bool)| {
            let path = directory.join(&name);
            if path == *root || name.starts_with('.') {
                return None;
            }
            match is_folder {
                true => Some(format!("{beginning}{name}/")),
                false => (path.extension()? == extension).then(|| format!("{beginning}{name}")),
            }
        };
        let mut names: Vec<String> =
            self.workspace.entries(&directory).into_iter().filter_map(named).collect();
        names.sort();
        names.iter().for_each(|name| self.add(name, ProposalKind::File, WANTED, "", None));
    }
}
