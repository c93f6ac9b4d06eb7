//! The declarations of a document, as a tree for the editor's outline.

use serde_json::{Value, json};

use crate::syntax::ast::{Item, ItemKind, Name, Span};

use super::workspace::Analysis;

// Kinds of symbols, by the protocol's numbers.
const MODULE: u32 = 2;
const FIELD: u32 = 8;
const ENUM: u32 = 10;
const FUNCTION: u32 = 12;
const VARIABLE: u32 = 13;
const CONSTANT: u32 = 14;
const ARRAY: u32 = 18;
const OBJECT: u32 = 19;
const ENUM_MEMBER: u32 = 22;
const EVENT: u32 = 24;
const OPERATOR: u32 = 25;

/// One symbol for each declaration except `language`, `use` and `expect`.
pub fn symbols(analysis: &Analysis) -> Vec<Value> {
    analysis.loaded.files[0].tree.items.iter().filter_map(|item| symbol(item, analysis)).collect()
}

/// The name of a declaration, if it has one, and its kind.
pub fn named(item: &Item) -> Option<(&Name, u32)> {
    Some((item.kind.plain().name()?, kind(item)?))
}

/// `None` for what is no symbol.
fn kind(item: &Item) -> Option<u32> {
    Some(match item.kind.plain() {
        ItemKind::Language(_) | ItemKind::Use(_) | ItemKind::Expect(_) | ItemKind::Override(_) => {
            return None;
        }
        ItemKind::Enum(_) => ENUM,
        ItemKind::Odds(_) | ItemKind::Group(_) => ARRAY,
        ItemKind::State(_) => VARIABLE,
        ItemKind::Let(_) => CONSTANT,
        ItemKind::Fn(_) => FUNCTION,
        ItemKind::Action(_) | ItemKind::Also(_) | ItemKind::EachStep(_) => EVENT,
        ItemKind::Rule(_) | ItemKind::Verdict(_) => OPERATOR,
        ItemKind::Body(_) | ItemKind::Road(_) | ItemKind::Episode(_) | ItemKind::Reward(_) => OBJECT,
        ItemKind::Scenario(_) | ItemKind::Policy(_) => MODULE,
    })
}

fn symbol(item: &Item, analysis: &Analysis) -> Option<Value> {
    let (inner, kind) = (item.kind.plain(), kind(item)?);
    let leaf = |name: &Name, kind: u32| entry(analysis, &name.text, kind, name.span, name.span, Vec::new());
    let children: Vec<Value> = match inner {
        ItemKind::Enum(of) => of.variants.iter().map(|name| leaf(name, ENUM_MEMBER)).collect(),
        ItemKind::Action(of) => {
            let parameter = |p: &crate::syntax::ast::ActionParam| {
                entry(analysis, &p.name.text, FIELD, p.span, p.name.span, Vec::new())
            };
            of.params.iter().map(parameter).collect()
        }
        _ => Vec::new(),
    };
    let keyword = inner.keyword();
    let (name, place) = match inner.name() {
        Some(name) => (name.text.as_str(), name.span),
        None => (keyword, Span { end: item.span.start + keyword.len(), ..item.span }),
    };
    Some(entry(analysis, name, kind, item.span, place, children))
}

fn entry(
    analysis: &Analysis,
    name: &str,
    kind: u32,
    whole: Span,
    place: Span,
    children: Vec<Value>,
) -> Value {
    json!({
        "name": name,
        "kind": kind,
        "range": analysis.range(whole),
        "selectionRange": analysis.range(place),
        "children": children,
    })
}
