//! What a declaration says of its parameter's value: a type, and groups of constraints of which one must hold.

use roxmltree::Node;

use super::source::{Source, elements};

const TYPES: [&str; 8] =
    ["integer", "int", "double", "string", "unsignedInt", "unsignedShort", "boolean", "dateTime"];

const RULES: [&str; 6] =
    ["equalTo", "notEqualTo", "lessThan", "lessOrEqual", "greaterThan", "greaterOrEqual"];

/// Refuses a value that is not of the declared type, or is excluded by every group of constraints.
pub fn check(source: &mut Source, declared: Node, value: &str) {
    let Some(kind) = source.word(declared, "parameterType", &TYPES) else { return };
    if !is_of(kind, value) {
        source.refuse::<()>(declared, format!("its value `{value}` is no `{kind}`"));
        return;
    }
    let mut is_free = true;
    for group in elements(declared, "ConstraintGroup") {
        let held: Option<Vec<bool>> =
            elements(group, "ValueConstraint").map(|constraint| holds(source, constraint, value)).collect();
        match held {
            Some(held) if held.iter().all(|holds| *holds) => return,
            Some(_) => is_free = false,
            None => return,
        }
    }
    if !is_free {
        source.refuse::<()>(declared, format!("its constraints exclude the value `{value}`"));
    }
}

fn is_of(kind: &str, value: &str) -> bool {
    let number = value.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    let is_whole = number.is_some_and(|number| number.fract() == 0.0);
    let is_within = |high: f64| is_whole && number.is_some_and(|number| (0.0..=high).contains(&number));
    match kind {
        "integer" | "int" => is_whole,
        "double" => number.is_some(),
        "unsignedInt" => is_within(f64::from(u32::MAX)),
        "unsignedShort" => is_within(f64::from(u16::MAX)),
        "boolean" => ["true", "false", "1", "0"].contains(&value),
        "dateTime" => value.contains('T'),
        _ => true,
    }
}

/// Whether a value obeys one constraint: as numbers where both are, else as texts, which may be equal or not.
fn holds(source: &mut Source, constraint: Node, value: &str) -> Option<bool> {
    let bound = source.text(constraint, "value")?;
    let rule = source.text(constraint, "rule")?;
    if !RULES.contains(&rule.as_str()) {
        return source.refuse(constraint, format!("`rule` is `{rule}`; it may be {}", RULES.join(", ")));
    }
    let order = match (value.trim().parse::<f64>(), bound.trim().parse::<f64>()) {
        (Ok(value), Ok(bound)) => value.partial_cmp(&bound),
        // Dates of one form are in the order of their texts.
        _ => Some(value.cmp(bound.as_str())),
    };
    let Some(order) = order else { return source.refuse(constraint, "its `value` is no number") };
    Some(match rule.as_str() {
        "equalTo" => order.is_eq(),
        "notEqualTo" => order.is_ne(),
        "lessThan" => order.is_lt(),
        "lessOrEqual" => order.is_le(),
        "greaterThan" => order.is_gt(),
        _ => order.is_ge(),
    })
}
