//! The declaration of a parameter: a type, and groups of constraints of which one must hold for its value.

use roxmltree::Node;

use super::source::{Source, elements};

const TYPES: [&str; 8] =
    ["integer", "int", "double", "string", "unsignedInt", "unsignedShort", "boolean", "dateTime"];

const RULES: [&str; 6] =
    ["equalTo", "notEqualTo", "lessThan", "lessOrEqual", "greaterThan", "greaterOrEqual"];

/// Refuses a value that is not of the declared type. A value that every group of constraints excludes is refused, too.
/// Then `Some` says that it can be read on: other errors of the file do not follow from it.
pub fn check(source: &mut Source, declared: Node, value: &str) -> Option<()> {
    let kind = source.word(declared, "parameterType", &TYPES)?;
    source.refuse_if(!is_of(kind, value), declared, format!("its value `{value}` is no `{kind}`"))?;
    let mut is_excluded = false;
    for group in elements(declared, "ConstraintGroup") {
        let constraints = elements(group, "ValueConstraint");
        let held: Option<Vec<bool>> =
            constraints.map(|constraint| holds(source, constraint, kind, value)).collect();
        match held {
            Some(held) if held.iter().all(|holds| *holds) => return Some(()),
            Some(_) => is_excluded = true,
            None => return Some(()),
        }
    }
    source.is_excluded |= is_excluded;
    source.refuse_if(is_excluded, declared, format!("its constraints exclude the value `{value}`"));
    Some(())
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

/// Whether a value obeys one constraint, whose bound is of the same type.
fn holds(source: &mut Source, constraint: Node, kind: &str, value: &str) -> Option<bool> {
    let bound = source.text(constraint, "value")?;
    let rule = source.text(constraint, "rule")?;
    let reason = format!("`rule` is `{rule}`; it may be {}", RULES.join(", "));
    source.refuse_if(!RULES.contains(&rule.as_str()), constraint, reason)?;
    source.refuse_if(!is_of(kind, &bound), constraint, format!("its value `{bound}` is no `{kind}`"))?;
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let order = match kind {
        // Dates of one form are in the order of their texts.
        "string" | "dateTime" | "" => value.cmp(bound.as_str()),
        "boolean" => is_true(value).cmp(&is_true(&bound)),
        _ => number(value).partial_cmp(&number(&bound))?,
    };
    Some(match rule.as_str() {
        "equalTo" => order.is_eq(),
        "notEqualTo" => order.is_ne(),
        "lessThan" => order.is_lt(),
        "lessOrEqual" => order.is_le(),
        "greaterThan" => order.is_gt(),
        _ => order.is_ge(),
    })
}

fn is_true(value: &str) -> bool {
    matches!(value, "true" | "1")
}
