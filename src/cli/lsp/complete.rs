//! Completion: what may be written next, as an editor lists it.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use crate::check::{Symbol, normal};
use crate::model::Type;
use crate::syntax::keyword;
use crate::units;

use super::context::Kind;
use super::words::Entry;
use super::workspace::Analysis;
use super::{context, hover, words};

// Kinds of completions, by the protocol's numbers.
const FUNCTION: u32 = 3;
const FIELD: u32 = 5;
const VARIABLE: u32 = 6;
const CLASS: u32 = 7;
const MODULE: u32 = 9;
const UNIT: u32 = 11;
const ENUM: u32 = 13;
const KEYWORD: u32 = 14;
const FILE: u32 = 17;
const ENUM_MEMBER: u32 = 20;
const CONSTANT: u32 = 21;
const EVENT: u32 = 23;
const OPERATOR: u32 = 24;

// How well a proposal fits. Editors sort by this number.
const WANTED: u32 = 0;
const LIKELY: u32 = 1;
const POSSIBLE: u32 = 2;

/// The proposals at a byte of the document.
pub fn complete(analysis: &Analysis, byte: usize) -> Value {
    let text = analysis.text(Analysis::ROOT);
    let (kinds, start) = context::wanted(analysis.references(), text, byte);
    let range = crate::syntax::ast::Span::new(Analysis::ROOT, start, byte.max(start));
    let mut list = List { analysis, range: analysis.range(range), seen: BTreeSet::new(), items: Vec::new() };
    kinds.iter().for_each(|kind| list.kind(kind));
    json!({ "isIncomplete": false, "items": list.items })
}

struct List<'a> {
    analysis: &'a Analysis,
    /// The range of the text that a proposal replaces.
    range: Value,
    seen: BTreeSet<String>,
    items: Vec<Value>,
}

impl List<'_> {
    fn kind(&mut self, kind: &Kind) {
        match kind {
            Kind::Declarations => self.words(keyword::DECLARATIONS, KEYWORD, LIKELY),
            Kind::Words(entries) => self.words(entries, FIELD, WANTED),
            Kind::Keyword(word) => {
                self.add(word, KEYWORD, LIKELY, "", keyword::meaning(word).map(str::to_owned));
            }
            Kind::Types => {
                self.kind(&Kind::Enums);
                self.words(&words::types(), CLASS, LIKELY);
            }
            Kind::Bodies => {
                self.words(&words::engine_words("body"), FIELD, WANTED);
                self.symbols(ENUM, |symbol| matches!(symbol, Symbol::Body(_)));
            }
            Kind::Enums => self.symbols(ENUM, |symbol| matches!(symbol, Symbol::Enum(_))),
            Kind::Units => {
                for unit in units::UNITS {
                    self.add(unit.word, UNIT, WANTED, &unit.dimension.to_string(), None);
                }
            }
            Kind::Actions => self.symbols(EVENT, |symbol| matches!(symbol, Symbol::Action(_))),
            Kind::Groups => self.symbols(MODULE, |symbol| matches!(symbol, Symbol::Group(_))),
            Kind::States => self.symbols(VARIABLE, |symbol| matches!(symbol, Symbol::State(_))),
            Kind::Roads => self.symbols(MODULE, |symbol| matches!(symbol, Symbol::Road(_))),
            Kind::Rules => self.symbols(OPERATOR, |symbol| matches!(symbol, Symbol::Rule(_))),
            Kind::Verdicts => self.symbols(OPERATOR, |symbol| matches!(symbol, Symbol::Verdict(_))),
            Kind::Functions => self.symbols(FUNCTION, |symbol| matches!(symbol, Symbol::Function(_))),
            Kind::Constants => self.symbols(CONSTANT, |symbol| matches!(symbol, Symbol::Constant(_))),
            Kind::Value(ty) => self.value(*ty),
            Kind::Operators => self.words(keyword::OPERATORS, OPERATOR, POSSIBLE),
            Kind::Variants(of) => self.variants(of, WANTED),
            Kind::Local(name, ty, fits) => {
                let ty = ty.map(|ty| self.analysis.references().type_name(ty)).unwrap_or_default();
                self.add(name, VARIABLE, if *fits { WANTED } else { LIKELY }, &ty, None);
            }
            Kind::Parameters(action, axis) => {
                let references = self.analysis.references();
                let action = references.declaration(&Symbol::Action(action.clone()));
                for parameter in action.iter().flat_map(|action| &action.parts) {
                    if references.declaration(parameter).is_some_and(|known| known.axis == *axis) {
                        self.symbol(parameter, FIELD, WANTED);
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
            self.words(keyword::LITERALS, KEYWORD, POSSIBLE);
        }
        for symbol in references.symbols() {
            let found = references.declaration(symbol).and_then(|known| known.ty);
            let rank = if found.is_some() && found == ty { WANTED } else { LIKELY };
            match symbol {
                Symbol::Constant(_) => self.symbol(symbol, CONSTANT, rank),
                Symbol::Function(_) => self.symbol(symbol, FUNCTION, rank),
                Symbol::State(_) => self.symbol(symbol, VARIABLE, LIKELY),
                _ => {}
            }
        }
        self.kind(&Kind::Keyword("match"));
        self.kind(&Kind::Keyword("not"));
    }

    fn variants(&mut self, of: &str, rank: u32) {
        let variants = self.analysis.references().enum_named(of).map(|of| of.variants.as_slice());
        for variant in variants.unwrap_or_default() {
            self.add(variant, ENUM_MEMBER, rank, of, None);
        }
    }

    fn words(&mut self, entries: &[Entry], kind: u32, rank: u32) {
        for (word, meaning) in entries {
            self.add(word, kind, rank, "", Some((*meaning).to_owned()));
        }
    }

    /// Every declared symbol of a kind.
    fn symbols(&mut self, kind: u32, is_wanted: impl Fn(&Symbol) -> bool) {
        for symbol in self.analysis.references().symbols().filter(|symbol| is_wanted(symbol)) {
            self.symbol(symbol, kind, WANTED);
        }
    }

    fn symbol(&mut self, symbol: &Symbol, kind: u32, rank: u32) {
        let text = hover::describe(self.analysis, symbol);
        self.add(symbol.word().unwrap_or_default(), kind, rank, "", text);
    }

    fn add(&mut self, label: &str, kind: u32, rank: u32, detail: &str, documentation: Option<String>) {
        if !self.seen.insert(label.to_owned()) {
            return;
        }
        let mut item = json!({
            "label": label,
            "kind": kind,
            "sortText": format!("{rank}{label}"),
            "textEdit": { "range": self.range, "newText": label },
        });
        if !detail.is_empty() {
            item["detail"] = detail.into();
        }
        if let Some(text) = documentation.filter(|text| !text.is_empty()) {
            item["documentation"] = json!({ "kind": "markdown", "value": text });
        }
        self.items.push(item);
    }

    /// Files and folders that continue a path.
    fn files(&mut self, extension: &str, written: &str) {
        let root = &self.analysis.loaded.files[0].path;
        let folder = root.parent().unwrap_or(Path::new(""));
        let beginning = written.rfind('/').map_or("", |slash| &written[..=slash]);
        let directory = normal(&folder.join(beginning));
        // A directory that cannot be read gives no proposals.
        let Ok(entries) = std::fs::read_dir(directory) else { return };
        let mut names: Vec<String> = entries
            .flatten()
            .filter_map(|entry| {
                let name = entry.file_name().to_string_lossy().into_owned();
                let path = entry.path();
                let is_root = path == *root || name.starts_with('.');
                let fits = path.extension().is_some_and(|found| found == extension) && !is_root;
                match path.is_dir() && !is_root {
                    true => Some(format!("{beginning}{name}/")),
                    false => fits.then(|| format!("{beginning}{name}")),
                }
            })
            .collect();
        names.sort();
        names.iter().for_each(|name| self.add(name, FILE, WANTED, "", None));
    }
}
