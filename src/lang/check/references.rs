//! The meaning of every name in the loaded files: where each thing is declared, and where it is used.
//!
//! [`References::declared`] notes the declarations of all files, including those that are overridden or left out. The
//! checker then notes every use in a space at the place where it resolves the name. A separate pass (`scenario_names`)
//! notes the uses in scenarios and policies, because their readers do not run on a broken space. The editor's server reads
//! the record and resolves nothing itself.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::check::files::{LoadedFile, maps_named, path_from, used_path, uses};
use crate::check::names::docs;
use crate::model::vocabulary::{ROAD_USER, TYPES, Word};
use crate::model::{EnumDef, EnumIndex, Type};
use crate::syntax::ast::{FileId, Item, ItemKind, Name, Number, ParamMode, Span};
use crate::syntax::{Sources, ast};

/// Largest number of parameters of an action or a function.
pub(super) const PARAMETERS_MAX: usize = 100;

/// The thing that a name stands for. Two declarations of one kind and name are one symbol: an `override` and the
/// declaration it replaces are renamed together.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    File(PathBuf),
    Enum(String),
    /// An enum and its variant.
    Variant(String, String),
    State(String),
    Constant(String),
    Function(String),
    /// A function and its parameter.
    Argument(String, String),
    Manoeuvre(String),
    /// A manoeuvre and its parameter.
    Given(String, String),
    Action(String),
    /// An action and its parameter.
    Parameter(String, String),
    Group(String),
    /// A name that spawns give to a road user.
    RoadUser(String),
    Rule(String),
    Requirement(String),
    Body(String),
    Trajectory(String),
    Road(String),
    Verdict(String),
    Scenario(String),
    Policy(String),
    /// A word of the engine and its meaning.
    Engine(&'static str, &'static str),
    /// A type of the language.
    Type(String),
    /// The digits and the unit of a number.
    Number(String, Option<String>),
}

/// A name in a text.
#[derive(Debug, Clone)]
pub struct Occurrence {
    pub span: Span,
    /// More than one where a rule over several actions names a parameter of each.
    pub symbols: Vec<Symbol>,
    pub declares: bool,
}

/// The known facts of a declared symbol.
#[derive(Debug, Clone)]
pub struct Declaration {
    /// The whole declaration, `override` included.
    pub span: Span,
    pub docs: Vec<String>,
    /// Variants of an enum, parameters of a function or an action. A member of a group is an action here, also
    /// where it is another group: see [`References::actions`].
    pub parts: Vec<Symbol>,
    /// Whether a parameter makes rows of the action table.
    pub axis: bool,
    /// Type of a value, of a map's values, or of a function's result. `None` if the checker could not tell.
    pub ty: Option<Type>,
    /// The enum of a map's keys.
    pub key: Option<EnumIndex>,
    overrides: bool,
}

/// Every declaration of a set of files, and every place where a name stands for something.
#[derive(Debug, Clone, Default)]
pub struct References {
    declarations: BTreeMap<Symbol, Declaration>,
    /// Notes from the running checker, by the spans of expressions.
    notes: BTreeMap<Span, Occurrence>,
    /// The same once the checker is done, by the spans of names, in the order of files and texts.
    occurrences: Vec<Occurrence>,
    enums: Vec<EnumDef>,
    /// Positions in `enums`, by name.
    enum_places: BTreeMap<String, usize>,
    /// For each variant the enums that have it.
    owners: BTreeMap<String, Vec<usize>>,
}

impl References {
    /// The name at a byte, or that ends there.
    pub fn at(&self, file: FileId, byte: usize) -> Option<&Occurrence> {
        let behind = self.occurrences.partition_point(|o| (o.span.file, o.span.start) <= (file, byte));
        let before = self.occurrences[..behind].last()?;
        (before.span.file == file && byte <= before.span.end).then_some(before)
    }

    /// The names of a file, in the order of the text.
    pub fn in_file(&self, file: FileId) -> impl Iterator<Item = &Occurrence> {
        self.occurrences.iter().filter(move |occurrence| occurrence.span.file == file)
    }

    /// The names that stand for one of the symbols.
    pub fn of<'a>(&'a self, symbols: &'a BTreeSet<Symbol>) -> impl Iterator<Item = &'a Occurrence> {
        self.occurrences.iter().filter(|o| o.symbols.iter().any(|symbol| symbols.contains(symbol)))
    }

    /// The symbols and all that must have the same name: one word in a rule over several actions names a
    /// parameter of each.
    pub fn tied(&self, symbols: &BTreeSet<Symbol>) -> BTreeSet<Symbol> {
        let mut tied = symbols.clone();
        loop {
            let before = tied.len();
            let more: Vec<Symbol> = self.of(&tied).flat_map(|o| o.symbols.iter().cloned()).collect();
            tied.extend(more);
            if tied.len() == before {
                return tied;
            }
        }
    }

    /// Which names stand for the same symbols: for each name, in order, the number of the first name with
    /// its meaning. A rename that changes no meaning leaves the pattern as it is.
    pub fn pattern(&self) -> Vec<usize> {
        let mut first: BTreeMap<&[Symbol], usize> = BTreeMap::new();
        let numbered = self.occurrences.iter().enumerate();
        numbered.map(|(number, o)| *first.entry(o.symbols.as_slice()).or_insert(number)).collect()
    }

    /// Where the symbols are declared. An `override` comes before what it replaces, because the file that
    /// uses another is read first.
    pub fn declarations_of(&self, symbols: &[Symbol]) -> Vec<Span> {
        let wanted: BTreeSet<Symbol> = symbols.iter().cloned().collect();
        self.of(&wanted).filter(|o| o.declares).map(|o| o.span).collect()
    }

    /// The declaration of a symbol; the `override` where there is one.
    pub fn declaration(&self, symbol: &Symbol) -> Option<&Declaration> {
        self.declarations.get(symbol)
    }

    /// Every declared symbol, by kind and name.
    pub fn symbols(&self) -> impl Iterator<Item = &Symbol> {
        self.declarations.keys()
    }

    /// The actions of a target: an action itself, or all actions of a group.
    pub fn actions(&self, target: &str) -> Vec<Symbol> {
        let (mut found, mut open, mut seen) = (Vec::new(), vec![target], BTreeSet::new());
        while let Some(name) = open.pop() {
            let action = Symbol::Action(name.to_owned());
            match self.declarations.get(&Symbol::Group(name.to_owned())) {
                // A broken text may put a group into itself.
                _ if !seen.insert(name) => {}
                Some(group) if !self.declarations.contains_key(&action) => {
                    open.extend(group.parts.iter().rev().filter_map(Symbol::word));
                }
                _ => found.push(action),
            }
        }
        found
    }

    /// The enum of a type.
    pub fn enum_of(&self, ty: Type) -> Option<&EnumDef> {
        match ty {
            Type::Enum(of) => self.enums.get(of.0),
            Type::Bool | Type::Int | Type::Quantity(_) => None,
        }
    }

    /// The enum of that name.
    pub fn enum_named(&self, name: &str) -> Option<&EnumDef> {
        self.enum_places.get(name).map(|of| &self.enums[*of])
    }

    /// The enums that have a variant, by index.
    pub(super) fn owners(&self, variant: &str) -> &[usize] {
        self.owners.get(variant).map(Vec::as_slice).unwrap_or_default()
    }

    /// Sets the enums in which types and variants are looked up.
    pub(super) fn set_enums(&mut self, enums: Vec<EnumDef>) {
        self.enum_places.clear();
        self.owners.clear();
        for (of, declared) in enums.iter().enumerate() {
            self.enum_places.entry(declared.name.clone()).or_insert(of);
            for variant in &declared.variants {
                let owners = self.owners.entry(variant.clone()).or_default();
                if owners.last() != Some(&of) {
                    owners.push(of);
                }
            }
        }
        self.enums = enums;
    }

    /// The type of that name.
    pub fn type_named(&self, name: &str) -> Option<Type> {
        let built_in = TYPES.iter().find(|(word, ..)| *word == name).map(|(_, ty, _)| *ty);
        built_in.or_else(|| self.enum_places.get(name).map(|index| Type::Enum(EnumIndex(*index))))
    }

    /// A type as an author writes it.
    pub fn type_name(&self, ty: Type) -> String {
        match ty {
            Type::Bool => "Bool".to_owned(),
            Type::Int => "Int".to_owned(),
            Type::Quantity(dimension) => dimension.to_string(),
            Type::Enum(_) => self.enum_of(ty).map(|of| of.name.clone()).unwrap_or_default(),
        }
    }
}

impl Declaration {
    /// The type as an author writes it, for example `Sky -> Level`.
    pub fn type_name(&self, references: &References) -> Option<String> {
        let value = references.type_name(self.ty?);
        Some(match self.key {
            Some(key) => format!("{} -> {value}", references.type_name(Type::Enum(key))),
            None => value,
        })
    }
}

impl Symbol {
    /// The parameter of a function or an action.
    pub(super) fn parameter(&self, name: &str) -> Option<Symbol> {
        match self {
            Symbol::Function(of) => Some(Symbol::Argument(of.clone(), name.to_owned())),
            Symbol::Manoeuvre(of) => Some(Symbol::Given(of.clone(), name.to_owned())),
            Symbol::Action(of) => Some(Symbol::Parameter(of.clone(), name.to_owned())),
            _ => None,
        }
    }

    /// The word that stands for it; `None` for a file or a number.
    pub fn word(&self) -> Option<&str> {
        match self {
            Symbol::File(_) | Symbol::Number(..) => None,
            Symbol::Engine(name, _) => Some(name),
            Symbol::Enum(name)
            | Symbol::Variant(_, name)
            | Symbol::State(name)
            | Symbol::Constant(name)
            | Symbol::Function(name)
            | Symbol::Argument(_, name)
            | Symbol::Manoeuvre(name)
            | Symbol::Given(_, name)
            | Symbol::Action(name)
            | Symbol::Parameter(_, name)
            | Symbol::Group(name)
            | Symbol::RoadUser(name)
            | Symbol::Rule(name)
            | Symbol::Requirement(name)
            | Symbol::Body(name)
            | Symbol::Trajectory(name)
            | Symbol::Road(name)
            | Symbol::Verdict(name)
            | Symbol::Scenario(name)
            | Symbol::Policy(name)
            | Symbol::Type(name) => Some(name),
        }
    }
}

/// Notes made by the checker.
impl References {
    /// All that the files declare, and the files that they name.
    pub(super) fn declared(files: &[LoadedFile]) -> References {
        let mut references = References::default();
        for item in files.iter().flat_map(|file| &file.tree.items) {
            references.declare_item(item);
        }
        files.iter().for_each(|file| references.names_files(file));
        references
    }

    /// Adds what a scenario or policy file declares, and the files that it names.
    pub(super) fn add(&mut self, file: &LoadedFile) {
        file.tree.items.iter().for_each(|item| self.declare_item(item));
        self.names_files(file);
    }

    fn names_files(&mut self, file: &LoadedFile) {
        for used in uses(file) {
            self.note(used.path.span, Symbol::File(used_path(file, used)), false);
            for name in &used.without {
                self.uses_target(name.span, &name.text);
                self.uses(name.span, Symbol::Rule(name.text.clone()));
                self.uses(name.span, Symbol::Requirement(name.text.clone()));
            }
        }
        for (path, span) in maps_named(file) {
            self.note(span, Symbol::File(path_from(file, path)), false);
        }
    }

    /// Notes a use. The use of a symbol that is declared nowhere is dropped: its name stands for nothing.
    pub(super) fn uses(&mut self, span: Span, symbol: Symbol) {
        if self.declarations.contains_key(&symbol) {
            self.note(span, symbol, false);
        }
    }

    /// Notes the use of an action or a group.
    pub(super) fn uses_target(&mut self, span: Span, name: &str) {
        self.uses(span, Symbol::Action(name.to_owned()));
        self.uses(span, Symbol::Group(name.to_owned()));
    }

    /// Notes the use of a parameter of a function or an action.
    pub(super) fn uses_parameter(&mut self, name: &Name, owner: &Symbol) {
        if let Some(symbol) = owner.parameter(&name.text) {
            self.uses(name.span, symbol);
        }
    }

    /// Notes a word of the engine.
    pub(super) fn word(&mut self, span: Span, word: impl Word) {
        self.engine(span, (word.name(), word.meaning()));
    }

    /// Notes a word of the engine, with its sentence.
    pub(super) fn engine(&mut self, span: Span, (name, meaning): (&'static str, &'static str)) {
        self.note(span, Symbol::Engine(name, meaning), false);
    }

    /// Notes the word of that spelling, if there is one.
    pub(super) fn word_named<W: Word>(&mut self, span: Span, name: &str) {
        W::from_name(name).into_iter().for_each(|word| self.word(span, word));
    }

    pub(super) fn number(&mut self, number: &Number) {
        let unit = number.unit.as_ref().map(|unit| unit.text.clone());
        self.note(number.span, Symbol::Number(number.digits.clone(), unit), false);
    }

    pub(super) fn note(&mut self, span: Span, symbol: Symbol, declares: bool) {
        let empty = || Occurrence { span, symbols: Vec::new(), declares: false };
        let noted = self.notes.entry(span).or_insert_with(empty);
        noted.declares |= declares;
        // A condition is checked for one action after another: the same symbol comes again at once.
        if noted.symbols.last() != Some(&symbol) {
            noted.symbols.push(symbol);
        }
    }

    /// Notes the type of a symbol. The first type counts: standing declarations are checked first.
    pub(super) fn typed(&mut self, symbol: &Symbol, ty: Type, key: Option<EnumIndex>) {
        if let Some(known) = self.declarations.get_mut(symbol).filter(|known| known.ty.is_none()) {
            known.ty = Some(ty);
            known.key = key;
        }
    }

    /// The parameters of a function or an action with their types. One that is broken passes for a `Bool`:
    /// its name is known all the same.
    pub fn locals(&self, owner: &Symbol) -> Vec<(String, Type)> {
        let parts = self.declaration(owner).map(|known| known.parts.as_slice()).unwrap_or_default();
        let ty = |part| self.declaration(part).and_then(|known| known.ty).unwrap_or(Type::Bool);
        // An action with more is refused; what is said of it beside that need not be whole.
        parts
            .iter()
            .take(PARAMETERS_MAX)
            .filter_map(|part| Some((part.word()?.to_owned(), ty(part))))
            .collect()
    }

    /// Notes a variant of an enum; without an enum, of the only one that has it.
    pub(super) fn variant(&mut self, name: &Name, of: Option<usize>) {
        let owners = self.owners(&name.text);
        let of = of.filter(|of| owners.binary_search(of).is_ok()).or(match owners {
            [only] => Some(*only),
            _ => None,
        });
        if let Some(of) = of {
            let symbol = match self.enums[of].name.as_str() {
                of if of == ROAD_USER.0 => Symbol::RoadUser(name.text.clone()),
                of => Symbol::Variant(of.to_owned(), name.text.clone()),
            };
            self.uses(name.span, symbol);
        }
    }

    /// Ends the record: names in the order of the texts, each once.
    pub(super) fn settle(&mut self, sources: &Sources) {
        self.occurrences = core::mem::take(&mut self.notes).into_values().collect();
        for occurrence in &mut self.occurrences {
            let mut seen = BTreeSet::new();
            occurrence.symbols.retain(|symbol| seen.insert(symbol.clone()));
            if let Some(word) = occurrence.symbols[0].word() {
                occurrence.span = name_within(occurrence.span, word, sources);
            }
        }
        self.occurrences.sort_by_key(|occurrence| occurrence.span);
    }

    fn declare_item(&mut self, item: &Item) {
        let whole = item.span;
        match item.kind.plain() {
            ItemKind::Enum(of) => {
                let variant = |name: &Name| Symbol::Variant(of.name.text.clone(), name.text.clone());
                let parts = of.variants.iter().map(|name| (Some(name), variant(name), whole, false));
                self.declare(item, Symbol::Enum, parts.collect());
            }
            ItemKind::State(_) => self.declare(item, Symbol::State, Vec::new()),
            ItemKind::Let(_) => self.declare(item, Symbol::Constant, Vec::new()),
            ItemKind::Fn(of) => {
                let argument = |name: &Name| Symbol::Argument(of.name.text.clone(), name.text.clone());
                let parts = of.params.iter().map(|p| (Some(&p.name), argument(&p.name), p.name.span, false));
                self.declare(item, Symbol::Function, parts.collect());
            }
            ItemKind::Manoeuvre(of) => {
                let given = |name: &Name| Symbol::Given(of.name.text.clone(), name.text.clone());
                let parts = of.params.iter().map(|p| (Some(&p.name), given(&p.name), p.name.span, false));
                self.declare(item, Symbol::Manoeuvre, parts.collect());
            }
            ItemKind::Action(of) => {
                let parameter = |name: &Name| Symbol::Parameter(of.name.text.clone(), name.text.clone());
                let is_axis = |p: &ast::ActionParam| p.mode == ParamMode::Each;
                let parts = of.params.iter().map(|p| (Some(&p.name), parameter(&p.name), p.span, is_axis(p)));
                self.declare(item, Symbol::Action, parts.collect());
                let spawns = of.effects.iter().filter_map(|effect| Some((effect, effect.spawn()?)));
                let named = spawns.flat_map(|(effect, of)| of.bearers.iter().map(move |name| (effect, name)));
                for (effect, name) in named {
                    let declaration = Declaration {
                        span: effect.span,
                        docs: docs(item),
                        parts: Vec::new(),
                        axis: false,
                        ty: None,
                        key: None,
                        overrides: matches!(item.kind, ItemKind::Override(_)),
                    };
                    self.insert(name, Symbol::RoadUser(name.text.clone()), declaration);
                }
            }
            ItemKind::Group(of) => {
                let member = |name: &Name| Symbol::Action(name.text.clone());
                let parts = of.members.iter().map(|name| (None, member(name), whole, false));
                self.declare(item, Symbol::Group, parts.collect());
            }
            ItemKind::Rule(_) => self.declare(item, Symbol::Rule, Vec::new()),
            ItemKind::Require(_) => self.declare(item, Symbol::Requirement, Vec::new()),
            ItemKind::Body(_) => self.declare(item, Symbol::Body, Vec::new()),
            ItemKind::Trajectory(_) => self.declare(item, Symbol::Trajectory, Vec::new()),
            ItemKind::Road(_) => self.declare(item, Symbol::Road, Vec::new()),
            ItemKind::Verdict(_) => self.declare(item, Symbol::Verdict, Vec::new()),
            ItemKind::Scenario(_) => self.declare(item, Symbol::Scenario, Vec::new()),
            ItemKind::Policy(_) => self.declare(item, Symbol::Policy, Vec::new()),
            ItemKind::Language(_)
            | ItemKind::Use(_)
            | ItemKind::Odds(_)
            | ItemKind::Also(_)
            | ItemKind::EachStep(_)
            | ItemKind::Episode(_)
            | ItemKind::Reward(_)
            | ItemKind::Expect(_)
            | ItemKind::Override(_) => {}
        }
    }

    /// Notes a declaration with its parts: the name unless it is declared elsewhere, symbol, span of the part, and
    /// whether it is an axis.
    fn declare(
        &mut self,
        item: &Item,
        symbol: fn(String) -> Symbol,
        parts: Vec<(Option<&Name>, Symbol, Span, bool)>,
    ) {
        let Some(name) = item.kind.name() else { return };
        let overrides = matches!(item.kind, ItemKind::Override(_));
        let of =
            |span, docs, parts, axis| Declaration { span, docs, parts, axis, ty: None, key: None, overrides };
        let symbols = parts.iter().map(|(_, part, _, _)| part.clone()).collect();
        let docs = docs(item);
        self.insert(name, symbol(name.text.clone()), of(item.span, docs, symbols, false));
        for (name, part, span, axis) in parts {
            if let Some(name) = name {
                self.insert(name, part, of(span, Vec::new(), Vec::new(), axis));
            }
        }
    }

    fn insert(&mut self, name: &Name, symbol: Symbol, declaration: Declaration) {
        self.note(name.span, symbol.clone(), true);
        // The root is read first: the first of two overrides is the last word.
        let known = self.declarations.get(&symbol);
        if known.is_none_or(|known| declaration.overrides && !known.overrides) {
            self.declarations.insert(symbol, declaration);
        }
    }
}

/// Where a name stands within the span of its expression, which may hold parentheses.
fn name_within(span: Span, name: &str, sources: &Sources) -> Span {
    let text = sources.text(span.file).get(span.start..span.end).unwrap_or_default();
    let start = span.start + text.find(name).unwrap_or(0);
    Span::new(span.file, start, start + name.len())
}
