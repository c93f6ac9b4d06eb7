//! Warnings about declarations that nothing names.
//!
//! Only the space's own file is examined: a used file offers more than each of its users needs. Names are
//! compared without scopes, so a declaration counts as used if anything of that name is used. A name that
//! begins with `_` is unused on purpose.

use std::collections::BTreeSet;

use crate::model::code;
use crate::model::vocabulary::{Word, WorldState};
use crate::syntax::ast::{ItemKind, Name, ParamMode};
use crate::syntax::{Diagnostic, ast};

/// One warning for each declaration of `own` that no declaration of `all` names.
pub(super) fn report(own: &[&ast::Item], all: &[&ast::Item]) -> Vec<Diagnostic> {
    // A file without actions is meant to be used by other files.
    if !all.iter().any(|item| matches!(item.kind, ItemKind::Action(_))) {
        return Vec::new();
    }
    let mut used = BTreeSet::new();
    all.iter().for_each(|item| names_of_item(&item.kind, &mut used));
    let is_unused = |name: &Name| !name.text.starts_with('_') && !used.contains(name.text.as_str());
    let warning = |what: &str, name: &Name| {
        Diagnostic::warning(code::UNUSED, format!("{what} `{}` is never used", name.text))
            .at(name.span, "nothing names it")
            .help(format!("remove it, or call it `_{}` if it is meant to be there", name.text))
    };
    let mut diagnostics = Vec::new();
    for item in own {
        match &item.kind {
            ItemKind::Enum(declared)
                if is_unused(&declared.name) && declared.variants.iter().all(is_unused) =>
            {
                diagnostics.push(warning("enum", &declared.name));
            }
            ItemKind::Let(declared) if is_unused(&declared.name) => {
                diagnostics.push(warning("constant", &declared.name));
            }
            ItemKind::Fn(declared) => {
                if is_unused(&declared.name) {
                    diagnostics.push(warning("function", &declared.name));
                }
                let mut inside = BTreeSet::new();
                names_of_expr(&declared.body, &mut inside);
                let params = declared.params.iter().map(|param| &param.name);
                let unused = params.filter(|name| !inside.contains(name.text.as_str()));
                diagnostics
                    .extend(unused.filter(|name| is_unused(name)).map(|name| warning("parameter", name)));
            }
            ItemKind::Group(declared) if is_unused(&declared.name) => {
                diagnostics.push(warning("group", &declared.name));
            }
            // The world reads `time` and `sky`, whether the file does or not.
            ItemKind::State(declared)
                if is_unused(&declared.name) && WorldState::from_name(&declared.name.text).is_none() =>
            {
                diagnostics.push(warning("state", &declared.name));
            }
            ItemKind::Action(declared) => {
                let drawn = declared.params.iter().filter(|param| param.mode == ParamMode::Any);
                let unused = drawn.filter(|param| is_unused(&param.name));
                diagnostics.extend(unused.map(|param| warning("drawn parameter", &param.name)));
            }
            _ => {}
        }
    }
    diagnostics
}

/// Collects the names that a declaration uses; not the names that it declares.
fn names_of_item<'a>(kind: &'a ItemKind, used: &mut BTreeSet<&'a str>) {
    match kind {
        ItemKind::State(declared) => {
            names_of_type(&declared.ty, used);
            match &declared.initial {
                ast::Initial::Any => {}
                ast::Initial::Value(value) => names_of_expr(value, used),
                ast::Initial::Keys(keys) => {
                    used.extend(keys.iter().filter_map(|key| Some(key.key.as_ref()?.text.as_str())));
                    keys.iter().filter_map(|key| key.value.as_ref()).for_each(|v| names_of_expr(v, used));
                }
            }
        }
        ItemKind::Let(declared) => names_of_expr(&declared.value, used),
        ItemKind::Fn(declared) => {
            declared.params.iter().for_each(|param| names_of_type(&param.ty, used));
            names_of_type(&declared.result, used);
            names_of_expr(&declared.body, used);
        }
        ItemKind::Action(declared) => {
            for param in &declared.params {
                names_of_type(&param.ty, used);
                param.within.iter().for_each(|within| names_of_expr(within, used));
                // A parameter that only its own `where` names is unused.
                if let Some(condition) = &param.condition {
                    let mut inside = BTreeSet::new();
                    names_of_expr(condition, &mut inside);
                    inside.remove(param.name.text.as_str());
                    used.extend(inside);
                }
            }
            declared.effects.iter().for_each(|effect| names_of_effect(effect, used));
        }
        ItemKind::Group(declared) => used.extend(declared.members.iter().map(|name| name.text.as_str())),
        ItemKind::Also(declared) => {
            used.extend(declared.on.iter().map(|name| name.text.as_str()));
            declared.effects.iter().for_each(|effect| names_of_effect(effect, used));
        }
        ItemKind::EachStep(effects) => effects.iter().for_each(|effect| names_of_effect(effect, used)),
        ItemKind::Rule(declared) => match &declared.body {
            ast::RuleBody::Holds { on, condition, .. } => {
                used.extend(on.iter().map(|name| name.text.as_str()));
                names_of_expr(condition, used);
            }
            ast::RuleBody::Moves { state, key, moves } => {
                used.extend([state].into_iter().chain(key).map(|name| name.text.as_str()));
                for line in moves {
                    used.insert(&line.from.text);
                    used.extend(line.to.iter().map(|name| name.text.as_str()));
                }
            }
        },
        ItemKind::Body(block) | ItemKind::Road(block) => names_of_fields(&block.fields, used),
        ItemKind::Episode(fields) => names_of_fields(fields, used),
        ItemKind::Reward(cases) => {
            for case in cases {
                case.condition.iter().for_each(|condition| names_of_expr(condition, used));
                names_of_expr(&case.value, used);
            }
        }
        ItemKind::Verdict(declared) => names_of_expr(&declared.condition, used),
        ItemKind::Expect(expect) => names_of_expr(&expect.claim, used),
        ItemKind::Odds(declared) => {
            used.insert(&declared.name.text);
            declared.arms.iter().for_each(|arm| names_of_expr(&arm.value, used));
        }
        ItemKind::Override(inner) => names_of_item(inner, used),
        ItemKind::Language(_)
        | ItemKind::Use(_)
        | ItemKind::Enum(_)
        | ItemKind::Scenario(_)
        | ItemKind::Policy(_) => {}
    }
}

fn names_of_type<'a>(ty: &'a ast::Type, used: &mut BTreeSet<&'a str>) {
    match &ty.kind {
        ast::TypeKind::Named(name) => {
            used.insert(&name.text);
        }
        ast::TypeKind::Map { key, value } => used.extend([key.text.as_str(), value.text.as_str()]),
    }
}

fn names_of_effect<'a>(effect: &'a ast::Effect, used: &mut BTreeSet<&'a str>) {
    match &effect.kind {
        ast::EffectKind::Set { state, key, value } => {
            used.insert(&state.text);
            key.iter().for_each(|key| names_of_expr(key, used));
            names_of_expr(value, used);
        }
        ast::EffectKind::Spawn { body, distance, cover, fields, .. } => {
            [body, distance].into_iter().chain(cover).for_each(|expr| names_of_expr(expr, used));
            names_of_fields(fields, used);
        }
    }
}

fn names_of_fields<'a>(fields: &'a [ast::Field], used: &mut BTreeSet<&'a str>) {
    fields.iter().for_each(|field| names_of_expr(&field.value, used));
}

/// Collects every name in an expression.
pub(crate) fn names_of_expr<'a>(expr: &'a ast::Expr, used: &mut BTreeSet<&'a str>) {
    match &expr.kind {
        ast::ExprKind::Name(name) => used.extend([name.as_str()]),
        ast::ExprKind::Call(call) => used.extend([call.name.text.as_str()]),
        ast::ExprKind::Match { arms, .. } => {
            used.extend(arms.iter().flat_map(|arm| &arm.patterns).map(|pattern| pattern.text.as_str()));
        }
        _ => {}
    }
    expr.parts().into_iter().for_each(|part| names_of_expr(part, used));
}
