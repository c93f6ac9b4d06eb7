//! What may be written next, as an editor lists it.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use crate::syntax::keyword;
use crate::units;

use super::context::Kind;
use super::names::{Symbol, Ty};
use super::words::Entry;
use super::workspace::Analysis;
use super::{context, hover, uri, words};

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

/// How near a proposal is to what is wanted: editors sort by it.
const WANTED: u32 = 0;
const LIKELY: u32 = 1;
const POSSIBLE: u32 = 2;

/// The proposals at a byte of the document.
pub fn complete(analysis: &Analysis, byte: usize) -> Value {
    let text = analysis.text(Analysis::ROOT);
    let (kinds, start) = context::wanted(&analysis.names, text, byte);
    let range = crate::syntax::ast::Span::new(Analysis::ROOT, start, byte.max(start));
    let mut list = List { analysis, range: analysis.range(range), seen: BTreeSet::new(), items: Vec::new() };
    kinds.iter().for_each(|kind| list.kind(kind));
    json!({ "isIncomplete": false, "items": list.items })
}

struct List<'a> {
    analysis: &'a Analysis,
    /// What is replaced.
    range: Value,
    seen: BTreeSet<String>,
    items: Vec<Value>,
}

impl List<'_> {
    fn kind(&mut self, kind: &Kind) {
        let declared = &self.analysis.names.declared;
        match kind {
            Kind::Declarations => self.words(keyword::DECLARATIONS, KEYWORD, LIKELY),
            Kind::Words(entries) => self.words(entries, FIELD, WANTED),
            Kind::Keyword(word) => {
                let meaning =
                    keyword::keywords().find(|(known, _)| known == word).map(|(_, meaning)| *meaning);
                self.add(word, KEYWORD, LIKELY, "", meaning.map(str::to_owned));
            }
            Kind::Types => {
                self.kind(&Kind::Enums);
                self.words(&words::types(), CLASS, LIKELY);
            }
            Kind::Enums => {
                for name in declared.enums.keys() {
                    self.symbol(name, ENUM, WANTED, Symbol::Enum(name.clone()));
                }
            }
            Kind::Units => {
                for unit in units::UNITS {
                    self.add(unit.word, UNIT, WANTED, &unit.dimension.to_string(), None);
                }
            }
            Kind::Actions => {
                for name in declared.actions.keys() {
                    self.symbol(name, EVENT, WANTED, Symbol::Action(name.clone()));
                }
            }
            Kind::Groups => {
                for name in declared.groups.keys() {
                    self.symbol(name, MODULE, WANTED, Symbol::Group(name.clone()));
                }
            }
            Kind::States => {
                for name in declared.states.keys() {
                    self.symbol(name, VARIABLE, WANTED, Symbol::State(name.clone()));
                }
            }
            Kind::Roads => {
                for name in declared.roads.keys() {
                    self.symbol(name, MODULE, WANTED, Symbol::Road(name.clone()));
                }
            }
            Kind::Rules => {
                for name in declared.rules.keys() {
                    self.symbol(name, OPERATOR, WANTED, Symbol::Rule(name.clone()));
                }
            }
            Kind::Verdicts => {
                for name in declared.verdicts.keys() {
                    self.symbol(name, OPERATOR, WANTED, Symbol::Verdict(name.clone()));
                }
            }
            Kind::Value(ty) => self.value(ty.as_ref()),
            Kind::Operators => self.words(keyword::OPERATORS, OPERATOR, POSSIBLE),
            Kind::Variants(of) => self.variants(of, WANTED),
            Kind::Local(name, ty, fits) => {
                let ty = ty.as_ref().map(Ty::name).unwrap_or_default();
                self.add(name, VARIABLE, if *fits { WANTED } else { LIKELY }, &ty, None);
            }
            Kind::Parameters(action, mode) => {
                for parameter in declared.actions.get(action).iter().flat_map(|of| &of.of) {
                    if parameter.mode == *mode {
                        let symbol = Symbol::Parameter(action.clone(), parameter.name.clone());
                        self.symbol(&parameter.name, FIELD, WANTED, symbol);
                    }
                }
            }
            Kind::Files(extension, written) => self.files(extension, written),
        }
    }

    fn value(&mut self, ty: Option<&Ty>) {
        let declared = &self.analysis.names.declared;
        match ty.and_then(Ty::variants_of) {
            Some(of) => self.variants(of, WANTED),
            None => {
                for of in declared.enums.keys() {
                    self.variants(of, POSSIBLE);
                }
            }
        }
        if ty.is_none_or(|ty| *ty == Ty::Bool) {
            self.words(keyword::LITERALS, KEYWORD, POSSIBLE);
        }
        for (name, of) in &declared.constants {
            let rank = if of.of.is_some() && of.of.as_ref() == ty { WANTED } else { LIKELY };
            self.symbol(name, CONSTANT, rank, Symbol::Constant(name.clone()));
        }
        for (name, of) in &declared.functions {
            let fits = of.of.result.is_some() && of.of.result.as_ref() == ty;
            self.symbol(name, FUNCTION, if fits { WANTED } else { LIKELY }, Symbol::Function(name.clone()));
        }
        for name in declared.states.keys() {
            self.symbol(name, VARIABLE, LIKELY, Symbol::State(name.clone()));
        }
        self.kind(&Kind::Keyword("match"));
        self.kind(&Kind::Keyword("not"));
    }

    fn variants(&mut self, of: &str, rank: u32) {
        let declared = &self.analysis.names.declared;
        for variant in declared.enums.get(of).iter().flat_map(|of| &of.of.variants) {
            self.add(variant, ENUM_MEMBER, rank, of, None);
        }
    }

    fn words(&mut self, entries: &[Entry], kind: u32, rank: u32) {
        for (word, meaning) in entries {
            self.add(word, kind, rank, "", Some((*meaning).to_owned()));
        }
    }

    fn symbol(&mut self, name: &str, kind: u32, rank: u32, symbol: Symbol) {
        let text = hover::describe(self.analysis, &symbol);
        self.add(name, kind, rank, "", text);
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

    /// Files and folders that go on from a path.
    fn files(&mut self, extension: &str, written: &str) {
        let root = &self.analysis.loaded.files[0].path;
        let folder = root.parent().unwrap_or(Path::new(""));
        let beginning = written.rfind('/').map_or("", |slash| &written[..=slash]);
        let directory = uri::normal(&folder.join(beginning));
        // A directory that cannot be read has nothing to propose.
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
