//! What a set of files declares, by kind and name. Where two declarations share a name, the one that
//! overrides the other counts, else the first.

use std::collections::{BTreeMap, BTreeSet};

use crate::check::LoadedFile;
use crate::syntax::ast;
use crate::syntax::ast::{ItemKind, ParamMode, Span, TypeKind};
use crate::units::Dimension;

use super::names::Ty;
use super::walk;

/// What every declaration has.
#[derive(Debug, Clone)]
pub struct Of<T> {
    pub docs: Vec<String>,
    /// The whole declaration.
    pub span: Span,
    overrides: bool,
    pub of: T,
}

#[derive(Debug, Clone)]
pub struct EnumOf {
    pub variants: Vec<String>,
    pub ordered: bool,
}

#[derive(Debug, Clone)]
pub struct FunctionOf {
    pub parameters: Vec<(String, Option<Ty>)>,
    pub result: Option<Ty>,
}

#[derive(Debug, Clone)]
pub struct ParameterOf {
    pub name: String,
    pub mode: ParamMode,
    pub ty: Option<Ty>,
    /// `each lane: Lane`, as written without what follows the type.
    pub span: Span,
}

/// By kind, then by name.
#[derive(Debug, Clone, Default)]
pub struct Declared {
    pub enums: BTreeMap<String, Of<EnumOf>>,
    pub states: BTreeMap<String, Of<Option<Ty>>>,
    pub constants: BTreeMap<String, Of<Option<Ty>>>,
    pub functions: BTreeMap<String, Of<FunctionOf>>,
    pub actions: BTreeMap<String, Of<Vec<ParameterOf>>>,
    pub groups: BTreeMap<String, Of<Vec<String>>>,
    pub rules: BTreeMap<String, Of<()>>,
    pub roads: BTreeMap<String, Of<()>>,
    pub verdicts: BTreeMap<String, Of<()>>,
    pub others: BTreeMap<String, Of<()>>,
}

impl Declared {
    pub fn new(files: &[LoadedFile]) -> Declared {
        let mut declared = Declared::default();
        let items = || files.iter().flat_map(|file| &file.tree.items);
        // Types first, then what has a type, then constants, whose types follow from the rest.
        for item in items() {
            if let ItemKind::Enum(of) = item.kind.plain() {
                let variants = of.variants.iter().map(|variant| variant.text.clone()).collect();
                note(&mut declared.enums, item, &of.name, EnumOf { variants, ordered: of.ordered });
            }
        }
        for item in items() {
            declared.note(item);
        }
        for item in items() {
            if let ItemKind::Let(of) = item.kind.plain() {
                let ty = walk::type_of(&of.value, &declared);
                note(&mut declared.constants, item, &of.name, ty);
            }
        }
        declared
    }

    fn note(&mut self, item: &ast::Item) {
        match item.kind.plain() {
            ItemKind::State(of) => {
                let ty = self.ty(&of.ty);
                note(&mut self.states, item, &of.name, ty);
            }
            ItemKind::Fn(of) => {
                let parameters = of.params.iter().map(|p| (p.name.text.clone(), self.ty(&p.ty))).collect();
                let result = self.ty(&of.result);
                note(&mut self.functions, item, &of.name, FunctionOf { parameters, result });
            }
            ItemKind::Action(of) => {
                let parameter = |p: &ast::ActionParam| ParameterOf {
                    name: p.name.text.clone(),
                    mode: p.mode,
                    ty: self.ty(&p.ty),
                    span: p.span,
                };
                let parameters = of.params.iter().map(parameter).collect();
                note(&mut self.actions, item, &of.name, parameters);
            }
            ItemKind::Group(of) => {
                let members = of.members.iter().map(|member| member.text.clone()).collect();
                note(&mut self.groups, item, &of.name, members);
            }
            ItemKind::Rule(of) => note(&mut self.rules, item, &of.name, ()),
            ItemKind::Road(of) => note(&mut self.roads, item, &of.name, ()),
            ItemKind::Verdict(of) => note(&mut self.verdicts, item, &of.name, ()),
            ItemKind::Scenario(of) => note(&mut self.others, item, &of.name, ()),
            ItemKind::Policy(of) => note(&mut self.others, item, &of.name, ()),
            ItemKind::Language(_)
            | ItemKind::Use(_)
            | ItemKind::Enum(_)
            | ItemKind::Odds(_)
            | ItemKind::Let(_)
            | ItemKind::Episode(_)
            | ItemKind::Reward(_)
            | ItemKind::Expect(_)
            | ItemKind::Override(_) => {}
        }
    }

    /// The type that is meant, if it exists.
    pub fn ty(&self, ty: &ast::Type) -> Option<Ty> {
        match &ty.kind {
            TypeKind::Named(name) => self.named(&name.text),
            TypeKind::Map { key, value } => {
                Some(Ty::Map(key.text.clone(), Box::new(self.named(&value.text)?)))
            }
        }
    }

    /// The type of that name.
    pub fn named(&self, name: &str) -> Option<Ty> {
        match name {
            "Bool" => Some(Ty::Bool),
            "Int" => Some(Ty::Int),
            name => {
                let quantity = Dimension::from_name(name).map(Ty::Quantity);
                quantity.or_else(|| self.enums.contains_key(name).then(|| Ty::Enum(name.to_owned())))
            }
        }
    }

    /// The actions that a name in a rule or a group means: itself, or the members of a group.
    pub fn targets(&self, name: &str) -> Vec<String> {
        let mut found = Vec::new();
        let mut open = vec![name];
        // A broken text may put a group into itself.
        let mut seen = BTreeSet::new();
        while let Some(name) = open.pop() {
            match self.groups.get(name) {
                _ if !seen.insert(name) => {}
                Some(group) if !self.actions.contains_key(name) => {
                    open.extend(group.of.iter().rev().map(String::as_str));
                }
                _ => found.push(name.to_owned()),
            }
        }
        found
    }

    pub fn parameter(&self, action: &str, name: &str) -> Option<&ParameterOf> {
        self.actions.get(action)?.of.iter().find(|parameter| parameter.name == name)
    }

    /// The enums that have a variant of that name.
    pub fn owners<'a>(&'a self, variant: &'a str) -> impl Iterator<Item = &'a str> {
        let has = move |declared: &Of<EnumOf>| declared.of.variants.iter().any(|name| name == variant);
        self.enums.iter().filter(move |(_, declared)| has(declared)).map(|(name, _)| name.as_str())
    }
}

fn note<T>(into: &mut BTreeMap<String, Of<T>>, item: &ast::Item, name: &ast::Name, of: T) {
    let overrides = matches!(item.kind, ItemKind::Override(_));
    // The root is read first, so that of two overrides the first is the last word.
    if into.get(&name.text).is_none_or(|known| overrides && !known.overrides) {
        let docs = item.docs.iter().map(|doc| doc.text.clone()).collect();
        into.insert(name.text.clone(), Of { docs, span: item.span, overrides, of });
    }
}
