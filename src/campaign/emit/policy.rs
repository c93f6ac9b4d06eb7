//! A policy as a file: the network bit by bit, every setting, its origin, its claims and its rules.

use serde_json::Value;

use avastra_base::units::decimal;
use avastra_lang::model::policy::{
    Condition, Net, PolicyRule, VARIABLES, VariableKind, expression, seal, weights_to_lines,
};
use avastra_lang::model::{Policy, Space};
use avastra_lang::syntax::ast::{
    Arg, BinaryOp, Call, Expr, ExprKind, Field, File, FileId, ItemKind, Name, PolicyLine, Span,
};
use avastra_lang::syntax::{ast, parse, print};

use super::tree;

/// The text of a policy file that a command emits, sealed with a new digest; the policy's own digest is ignored. `space_path` is the
/// path from the file to its space.
pub fn policy_text(policy: &Policy, space: &Space, space_path: &str, command: &str) -> String {
    // The seal covers the text, so the text is printed first without it.
    let open = print(&file(policy, space, space_path, (String::new(), command)));
    let (tree, mistakes) = parse(FileId(0), &open);
    debug_assert!(mistakes.is_empty(), "what is printed can be read");
    print(&file(policy, space, space_path, (seal(&open, &tree), command)))
}

fn file(policy: &Policy, space: &Space, space_path: &str, (digest, command): (String, &str)) -> File {
    let net = Net {
        layers: policy.layers.clone(),
        dueling: policy.dueling,
        hyperparameters: policy.hyperparameters.clone(),
        weights: weights_to_lines(&policy.parameters),
        digest,
    };
    let item = ast::Policy {
        name: Name::built(&policy.name),
        origin: fields(&policy.origin),
        net: fields(&net),
        claims: policy.claims.as_ref().map_or(Vec::new(), fields),
        rules: policy.rules.iter().map(|rule| line(space, rule)).collect(),
    };
    let docs = policy.docs.iter().map(|text| tree::doc(text)).collect();
    tree::file(
        command,
        "play it with `avastra run --policy FILE`",
        space,
        space_path,
        docs,
        ItemKind::Policy(item),
    )
}

/// `when ego_speed > 8.25 m/s and time == Night => pedestrian(from: Left)`.
fn line(space: &Space, rule: &PolicyRule) -> PolicyLine {
    let and = |left, right| tree::binary(BinaryOp::And, left, right);
    PolicyLine {
        condition: rule.conditions.iter().map(condition).reduce(and),
        actions: rule.rows.iter().map(|&row| call(space, row)).collect(),
        span: Span::NONE,
    }
}

fn condition(condition: &Condition) -> Expr {
    let variable = &VARIABLES[condition.variable];
    let value = match variable.kind {
        VariableKind::Words { .. } => {
            let word =
                variable.word(condition.value as f32).expect("only the words' own values are compared");
            tree::name(word)
        }
        VariableKind::Quantity { unit, .. } => {
            tree::signed(decimal(condition.value.abs(), false), condition.value < 0.0, unit)
        }
    };
    tree::binary(BinaryOp::Compare(condition.comparison), tree::name(variable.name), value)
}

/// The call that names a row, its values in the order of the axes.
fn call(space: &Space, row: usize) -> Call {
    let row = &space.rows[row];
    let action = &space.actions[row.action];
    let axes = action.parameters.iter().filter(|parameter| parameter.axis).zip(&row.axes);
    let args = axes.map(|(axis, (_, value))| Arg { name: None, value: tree::value(space, *value, axis.ty) });
    Call { name: Name::built(&action.name), args: args.collect(), span: Span::NONE }
}

/// The fields of a struct, in its own order.
fn fields(value: &impl serde::Serialize) -> Vec<Field> {
    let value: Value = serde_json::to_value(value).expect("policies are plain data");
    match expression(&value).kind {
        ExprKind::Record(fields) => fields,
        _ => unreachable!("a struct is a record"),
    }
}
