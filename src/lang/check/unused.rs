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
            ItemKind::Trajectory(declared) if is_unused(&declared.name) => {
                diagnostics.push(warning("trajectory", &declared.name));
            }
            ItemKind::Manoeuvre(declared) if is_unused(&declared.name) => {
                diagnostics.push(warning("manoeuvre", &declared.name));
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
    let mut names: Vec<&Name> = Vec::new();
    let mut exprs: Vec<&ast::Expr> = Vec::new();
    let mut effects: &[ast::Effect] = &[];
    let mut fields: Vec<&ast::Field> = Vec::new();
    match kind {
        ItemKind::State(declared) => {
            names.extend(names_of_type(&declared.ty));
            match &declared.initial {
                ast::Initial::Any => {}
                ast::Initial::Value(value) => exprs.push(value),
                ast::Initial::Keys(keys) => {
                    names.extend(keys.iter().filter_map(|key| key.key.as_ref()));
                    exprs.extend(keys.iter().filter_map(|key| key.value.as_ref()));
                }
            }
        }
        ItemKind::Let(declared) => exprs.push(&declared.value),
        ItemKind::Fn(declared) => {
            let types = declared.params.iter().map(|param| &param.ty).chain([&declared.result]);
            names.extend(types.flat_map(names_of_type));
            exprs.push(&declared.body);
        }
        ItemKind::Action(declared) => {
            for param in &declared.params {
                names.extend(names_of_type(&param.ty));
                exprs.extend(&param.within);
                // A parameter that only its own `where` names is unused.
                if let Some(condition) = &param.condition {
                    let mut inside = BTreeSet::new();
                    names_of_expr(condition, &mut inside);
                    inside.remove(param.name.text.as_str());
                    used.extend(inside);
                }
            }
            effects = &declared.effects;
        }
        ItemKind::Group(declared) => names.extend(&declared.members),
        ItemKind::Also(declared) => {
            names.extend(&declared.on);
            effects = &declared.effects;
        }
        ItemKind::EachStep(declared) => effects = declared,
        ItemKind::Rule(declared) => match &declared.body {
            ast::RuleBody::Holds { on, condition, .. } => {
                names.extend(on);
                exprs.push(condition);
            }
            ast::RuleBody::Moves { state, key, moves } => {
                names.extend([state].into_iter().chain(key));
                names.extend(moves.iter().flat_map(|line| line.to.iter().chain([&line.from])));
            }
        },
        ItemKind::Body(block) | ItemKind::Trajectory(block) | ItemKind::Road(block) => {
            fields.extend(&block.fields)
        }
        ItemKind::Episode(declared) => fields.extend(declared),
        ItemKind::Reward(cases) => {
            exprs.extend(cases.iter().flat_map(|case| case.condition.iter().chain([&case.value])));
        }
        ItemKind::Require(declared) => exprs.extend(declared.parts()),
        ItemKind::Verdict(declared) => exprs.push(&declared.condition),
        ItemKind::Manoeuvre(declared) => {
            names.extend(declared.params.iter().flat_map(|param| names_of_type(&param.ty)));
            exprs.extend(&declared.repeat);
            for phase in &declared.phases {
                exprs.extend(phase.once.iter().chain(&phase.held).chain(&phase.within).chain(&phase.after));
                exprs.extend(&phase.only_if);
                fields.extend(&phase.fields);
            }
        }
        ItemKind::Expect(expect) => exprs.push(&expect.claim),
        ItemKind::Odds(declared) => {
            names.push(&declared.name);
            exprs.extend(declared.arms.iter().map(|arm| &arm.value));
        }
        ItemKind::Override(inner) => names_of_item(inner, used),
        ItemKind::Language(_)
        | ItemKind::Use(_)
        | ItemKind::Enum(_)
        | ItemKind::Scenario(_)
        | ItemKind::Policy(_) => {}
    }
    for effect in effects {
        match &effect.kind {
            ast::EffectKind::Set { state, key, value } => {
                names.push(state);
                exprs.extend(key.as_deref().into_iter().chain([&**value]));
            }
            ast::EffectKind::Order { who, fields: of_order } => {
                names.push(who);
                fields.extend(of_order);
            }
            ast::EffectKind::Spawn(spawn) => {
                names.extend(&spawn.of);
                exprs.extend(spawn.place.trajectory());
                exprs.extend(
                    [&spawn.body, &spawn.distance].into_iter().chain(&spawn.apart).chain(&spawn.cover),
                );
                fields.extend(&spawn.fields);
            }
        }
    }
    used.extend(names.into_iter().map(|name| name.text.as_str()));
    exprs.extend(fields.into_iter().map(|field| &field.value));
    exprs.into_iter().for_each(|expr| names_of_expr(expr, used));
}

fn names_of_type(ty: &ast::Type) -> Vec<&Name> {
    match &ty.kind {
        ast::TypeKind::Named(name) => vec![name],
        ast::TypeKind::Map { key, value } => vec![key, value],
    }
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
