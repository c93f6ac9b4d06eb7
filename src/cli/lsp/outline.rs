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

fn symbol(item: &Item, analysis: &Analysis) -> Option<Value> {
    let inner = item.kind.plain();
    let leaf = |name: &Name, kind: u32| entry(analysis, &name.text, kind, name.span, name.span, Vec::new());
    let (kind, children): (u32, Vec<Value>) = match inner {
        ItemKind::Language(_) | ItemKind::Use(_) | ItemKind::Expect(_) | ItemKind::Override(_) => {
            return None;
        }
        ItemKind::Enum(of) => (ENUM, of.variants.iter().map(|name| leaf(name, ENUM_MEMBER)).collect()),
        ItemKind::Odds(_) => (ARRAY, Vec::new()),
        ItemKind::State(_) => (VARIABLE, Vec::new()),
        ItemKind::Let(_) => (CONSTANT, Vec::new()),
        ItemKind::Fn(_) => (FUNCTION, Vec::new()),
        ItemKind::Action(of) => {
            let parameter = |p: &crate::syntax::ast::ActionParam| {
                entry(analysis, &p.name.text, FIELD, p.span, p.name.span, Vec::new())
            };
            (EVENT, of.params.iter().map(parameter).collect())
        }
        ItemKind::Group(_) => (ARRAY, Vec::new()),
        ItemKind::Rule(_) => (OPERATOR, Vec::new()),
        ItemKind::Road(_) | ItemKind::Episode(_) | ItemKind::Reward(_) => (OBJECT, Vec::new()),
        ItemKind::Verdict(_) => (OPERATOR, Vec::new()),
        ItemKind::Scenario(_) | ItemKind::Policy(_) => (MODULE, Vec::new()),
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
