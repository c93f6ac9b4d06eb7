//! `avastra table --markdown`: a space as Markdown, from its documentation comments and from what was proved about it.

use core::fmt::Write;
use std::collections::BTreeSet;

use avastra_base::units::{Dimension, quantity_short};
use avastra_lang::model::{
    ActionDef, Domain, Initial, Interval, Parameter, RuleBody, RuleDef, Space, StateDef, Type, Value,
};

use super::output::{Output, plural};
use super::why::by_key;

/// Prints the page.
pub fn doc(output: &Output, space: &Space) {
    let text = page(space);
    output.say(text.trim_end());
    output.result(serde_json::json!({ "text": text }));
}

fn page(space: &Space) -> String {
    let mut text = String::new();
    let stem = space.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    // Writing to a String cannot fail.
    let _ = write!(text, "# {}\n\n{}", tagless(&stem), paragraph(&space.docs));
    let _ = writeln!(text, "## Actions\n\n{}.\n", plural(space.rows.len(), "row"));
    for (index, action) in space.actions.iter().enumerate() {
        action_section(&mut text, space, index, action);
    }
    text.push_str("## Rules\n\n");
    for (index, rule) in space.rules.iter().enumerate() {
        rule_section(&mut text, space, index, rule);
    }
    if !space.requirements.is_empty() {
        text.push_str("## Requirements\n\n");
        for required in &space.requirements {
            let optional = if required.optional { ", optional" } else { "" };
            let on: Vec<&str> = required.on.iter().map(|body| space.body_name(*body)).collect();
            let on = if on.is_empty() { String::new() } else { format!(", of each {}", on.join(", ")) };
            let _ = writeln!(text, "- `{}`{optional}{on}: {}", required.name, inline(&required.docs));
        }
        text.push('\n');
    }
    if !space.states.is_empty() {
        text.push_str("## State\n\n| state | values | begins as | meaning |\n|---|---|---|---|\n");
        for state in &space.states {
            let of = match state.key {
                Some(key) => format!("{} -> {}", space.enums[key.0].name, type_name(space, state.ty)),
                None => type_name(space, state.ty),
            };
            let begins = begins(space, state);
            let _ = writeln!(text, "| `{}` | {of} | {begins} | {} |", state.name, inline(&state.docs));
        }
        text.push('\n');
    }
    if !space.each_step.is_empty() {
        let mut set: Vec<String> =
            space.each_step.iter().map(|set| format!("`{}`", space.states[set.state].name)).collect();
        set.dedup();
        let _ = writeln!(text, "Every step ends with a change of {}.\n", set.join(", "));
    }
    if !space.enums.is_empty() {
        text.push_str("## Enums\n\n| enum | variants | meaning |\n|---|---|---|\n");
        for declared in &space.enums {
            let between = if declared.ordered { " < " } else { ", " };
            let variants = declared.variants.join(between);
            let _ = writeln!(text, "| `{}` | {variants} | {} |", declared.name, inline(&declared.docs));
        }
        text.push('\n');
    }
    text.push_str("## Roads\n\n| road | limit | map | meaning |\n|---|---|---|---|\n");
    for road in &space.roads {
        let map = cell(&road.map_path.file_name().unwrap_or_default().to_string_lossy());
        let limit = quantity_short(road.facts.limit_mps, Dimension::SPEED);
        let _ = writeln!(text, "| `{}` | {limit} | {map} | {} |", road.name, inline(&road.docs));
    }
    text.push_str("\n## Verdicts\n\n");
    for verdict in &space.verdicts {
        let _ = writeln!(text, "- `{}`: {}", verdict.name, inline(&verdict.docs));
    }
    text
}

/// The initial value of a state: one word for all its keys if they have the same.
fn begins(space: &Space, state: &StateDef) -> String {
    let memory = space.initial_memory(0);
    let values = state.initial.iter().zip(&memory.cells()[state.first_cell..]);
    let words: Vec<String> = values
        .map(|(initial, value)| match initial {
            Initial::Any => "drawn".to_owned(),
            Initial::Value(_) => space.show(*value, state.ty),
        })
        .collect();
    by_key(space, state, &words).unwrap_or_else(|| words[0].clone())
}

fn action_section(text: &mut String, space: &Space, index: usize, action: &ActionDef) {
    let numbers = match space.rows_of(index) {
        [] => "no rows".to_owned(),
        [only] => format!("row {}", only.index),
        [first, .., last] => format!("rows {} to {}", first.index, last.index),
    };
    let _ = write!(text, "### `{}` ({numbers})\n\n{}", action.name, paragraph(&action.docs));
    if action.parameters.is_empty() {
        return;
    }
    text.push_str("| parameter | how | values | after the rules |\n|---|---|---|---|\n");
    for parameter in &action.parameters {
        let how = if parameter.axis { "each" } else { "any" };
        let _ = writeln!(
            text,
            "| `{}` | {how} | {} | {} |",
            parameter.name,
            values(space, &occurring(space, index, parameter), parameter.ty),
            ranges(space, index, parameter)
        );
    }
    text.push('\n');
}

fn rule_section(text: &mut String, space: &Space, index: usize, rule: &RuleDef) {
    let rows = space.rows.iter().filter(|row| row.rules.contains(&index)).count();
    let optional = if rule.optional { ", optional" } else { "" };
    let during = match rule.body {
        RuleBody::During(_) => " during lane changes",
        RuleBody::Phases { .. } => " as phases of a manoeuvre begin",
        RuleBody::Holds(_) | RuleBody::Moves { .. } => "",
    };
    let _ = write!(text, "### `{}` (binds {}{during}{optional})\n\n", rule.name, plural(rows, "row"));
    text.push_str(&paragraph(&rule.docs));
    if let RuleBody::Moves { state, cell, allowed, .. } = &rule.body {
        let state = &space.states[*state];
        let Type::Enum(of) = state.ty else { return };
        let variants = &space.enums[of.0].variants;
        let _ = writeln!(text, "| `{}` from | to |\n|---|---|", space.cell_name(*cell));
        for (from, to) in allowed.iter().enumerate() {
            let to: Vec<&str> =
                to.iter().zip(variants).filter(|(allowed, _)| **allowed).map(|(_, to)| to.as_str()).collect();
            let _ = writeln!(text, "| {} | {} |", variants[from], to.join(", "));
        }
        text.push('\n');
    }
}

/// The part of a parameter's range that the rules leave, for each road on which they narrow it.
fn ranges(space: &Space, action: usize, parameter: &Parameter) -> String {
    let Domain::Range(low, high) = &parameter.domain else { return String::new() };
    let declared = Interval::closed(*low, *high);
    let unit = parameter.unit();
    let roads = space.roads.iter().enumerate();
    let left = roads.filter_map(|(road, of)| Some((of, space.range_on(action, parameter, road)?)));
    let shown = left.filter(|(_, kept)| *kept != declared);
    let shown: Vec<String> =
        shown.map(|(road, kept)| format!("{} on {}", kept.shown(parameter.ty, unit), road.name)).collect();
    shown.join("; ")
}

/// The values of a parameter; of an `each` parameter those that have rows, because a `where` may leave others out.
fn occurring(space: &Space, action: usize, parameter: &Parameter) -> Domain {
    match &parameter.domain {
        Domain::Values(values) if parameter.axis => {
            let axes = space.rows_of(action).iter().flat_map(|row| &row.axes);
            let of_parameter = axes.filter(|(name, _)| *name == parameter.name);
            let found: BTreeSet<u64> = of_parameter.map(|(_, value)| sign_of(*value)).collect();
            Domain::Values(values.iter().filter(|value| found.contains(&sign_of(**value))).copied().collect())
        }
        domain => domain.clone(),
    }
}

/// A number that tells the values of one parameter apart.
fn sign_of(value: Value) -> u64 {
    match value {
        Value::Number(number) => number.to_bits(),
        Value::Bool(_) | Value::Variant(..) => value.variant() as u64,
    }
}

fn values(space: &Space, domain: &Domain, ty: Type) -> String {
    match domain {
        Domain::Range(low, high) => {
            let ends = [low, high].map(|end| Value::Number(end.to_f64()));
            space.show_all(&ends, ty).join(" .. ")
        }
        Domain::Values(values) if values.len() > 12 => {
            let ends = space.show_all(&[values[0], values[values.len() - 1]], ty);
            format!("{} … {} ({} values)", ends[0], ends[1], values.len())
        }
        Domain::Values(values) => space.show_all(values, ty).join(", "),
    }
}

fn type_name(space: &Space, ty: Type) -> String {
    match ty {
        Type::Bool => "Bool".to_owned(),
        Type::Int => "Int".to_owned(),
        Type::Quantity(dimension) => dimension.to_string(),
        Type::Enum(of) => space.enums[of.0].name.clone(),
    }
}

fn paragraph(docs: &[String]) -> String {
    if docs.is_empty() { String::new() } else { format!("{}\n\n", tagless(&docs.join("\n"))) }
}

fn inline(docs: &[String]) -> String {
    cell(&docs.join(" "))
}

/// A text in a cell of a table.
fn cell(text: &str) -> String {
    tagless(text).replace('|', "\\|")
}

/// A text in which no HTML tag begins and no link leads to a program. Markdown passes both through, and the space may come
/// from another author.
fn tagless(text: &str) -> String {
    let begins_tag = |next: char| next.is_ascii_alphabetic() || matches!(next, '/' | '!' | '?');
    let mut safe = String::with_capacity(text.len());
    let mut rest = text.char_indices().peekable();
    while let Some((at, c)) = rest.next() {
        let next = rest.peek().map(|&(_, next)| next);
        match c {
            '<' if next.is_some_and(begins_tag) => safe.push_str("&lt;"),
            // Behind `\`, a bracket or a colon makes no link.
            ']' if matches!(next, Some('(' | ':')) && !is_harmless(&text[at + 2..]) => safe.push_str("]\\"),
            c => safe.push(c),
        }
    }
    safe
}

/// Whether the target of a link, with which the text begins, is relative or a page of the web.
fn is_harmless(text: &str) -> bool {
    let target = text.trim_start();
    // Blanks end a target, but not in `<…>`, where browsers leave them out.
    let is_end = |c: char| "/#?)>".contains(c) || c.is_whitespace() && !target.starts_with('<');
    let begin = &target[..target.find(is_end).unwrap_or(target.len())];
    let begin = begin.trim_start_matches('<').to_ascii_lowercase();
    // `&` and `\` may write a colon in other words.
    matches!(begin.as_str(), "http:" | "https:") || !begin.contains([':', '&', '\\'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_link_leads_to_a_program() {
        for kept in ["[x](https://a.b/c:d)", "[x](HTTP://a)", "[x](a/b.md#c)", "[x](#c)", "sky[Rain]: wet"] {
            assert_eq!(tagless(kept), kept);
        }
        let to = |target: &str| tagless(&format!("[x]({target})"));
        for hostile in ["javascript:a", " JaVaScRiPt:a", "data:text/html,a", "javascript&colon;a", "java\\:a"]
        {
            assert_eq!(to(hostile), format!("[x]\\({hostile})"));
        }
        assert_eq!(to("< java\tscript:a>"), "[x]\\(< java\tscript:a>)");
        assert_eq!(tagless("[x]: vbscript:a"), "[x]\\: vbscript:a");
    }

    #[test]
    fn no_tag_begins_in_a_page() {
        let hostile = "<script>a</script> <!-- x --> <?php 1 < 2 <= 3 | <";
        assert_eq!(tagless(hostile), "&lt;script>a&lt;/script> &lt;!-- x --> &lt;?php 1 < 2 <= 3 | <");
        assert_eq!(cell("a < b | <b>"), "a < b \\| &lt;b>");
        assert_eq!(paragraph(&["<im".to_owned(), "g>".to_owned()]), "&lt;im\ng>\n\n");
    }
}
