//! The declarations of a document, as a tree for the editor's outline.

use avastra_lang::syntax::ast::{ActionParam, Item, ItemKind, Name, Span};

use super::position::Range;
use super::workspace::Analysis;

/// The kind of a declaration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutlineKind {
    /// A scenario or a policy.
    Module,
    Parameter,
    Enum,
    Variant,
    Function,
    State,
    Constant,
    /// A group, or odds.
    List,
    /// A body, a road, an episode or a reward.
    Block,
    /// An action, or effects.
    Action,
    /// A rule or a verdict.
    Rule,
}

/// A declaration, or a part of one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    pub name: String,
    pub kind: OutlineKind,
    /// The whole declaration.
    pub whole: Range,
    /// Its name.
    pub range: Range,
    pub children: Vec<Entry>,
}

/// One symbol for each declaration except `language`, `use` and `expect`.
pub fn symbols(analysis: &Analysis) -> Vec<Entry> {
    analysis.loaded.files[0].tree.items.iter().filter_map(|item| symbol(item, analysis)).collect()
}

/// The name of a declaration, if it has one, and its kind.
pub fn named(item: &Item) -> Option<(&Name, OutlineKind)> {
    Some((item.kind.plain().name()?, kind(item)?))
}

/// `None` for what is no symbol.
fn kind(item: &Item) -> Option<OutlineKind> {
    Some(match item.kind.plain() {
        ItemKind::Language(_) | ItemKind::Use(_) | ItemKind::Expect(_) | ItemKind::Override(_) => {
            return None;
        }
        ItemKind::Enum(_) => OutlineKind::Enum,
        ItemKind::Odds(_) | ItemKind::Group(_) => OutlineKind::List,
        ItemKind::State(_) => OutlineKind::State,
        ItemKind::Let(_) => OutlineKind::Constant,
        ItemKind::Fn(_) | ItemKind::Manoeuvre(_) => OutlineKind::Function,
        ItemKind::Action(_) | ItemKind::Also(_) | ItemKind::EachStep(_) => OutlineKind::Action,
        ItemKind::Rule(_) | ItemKind::Require(_) | ItemKind::Verdict(_) => OutlineKind::Rule,
        ItemKind::Body(_)
        | ItemKind::Trajectory(_)
        | ItemKind::Road(_)
        | ItemKind::Episode(_)
        | ItemKind::Reward(_) => OutlineKind::Block,
        ItemKind::Scenario(_) | ItemKind::Policy(_) => OutlineKind::Module,
    })
}

fn symbol(item: &Item, analysis: &Analysis) -> Option<Entry> {
    let (inner, kind) = (item.kind.plain(), kind(item)?);
    let part = |name: &Name, kind: OutlineKind, whole: Span| Entry {
        name: name.text.clone(),
        kind,
        whole: analysis.range(whole),
        range: analysis.range(name.span),
        children: Vec::new(),
    };
    let children: Vec<Entry> = match inner {
        ItemKind::Enum(of) => {
            of.variants.iter().map(|name| part(name, OutlineKind::Variant, name.span)).collect()
        }
        ItemKind::Action(of) => {
            let parameter = |of: &ActionParam| part(&of.name, OutlineKind::Parameter, of.span);
            of.params.iter().map(parameter).collect()
        }
        _ => Vec::new(),
    };
    let keyword = inner.keyword();
    let (name, place) = match inner.name() {
        Some(name) => (name.text.as_str(), name.span),
        None => (keyword, Span { end: item.span.start + keyword.len(), ..item.span }),
    };
    let (whole, range) = (analysis.range(item.span), analysis.range(place));
    Some(Entry { name: name.to_owned(), kind, whole, range, children })
}
