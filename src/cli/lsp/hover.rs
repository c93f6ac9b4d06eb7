//! What is said of a name under the pointer: its declaration, its type, what the rules leave of it,
//! and its documentation.

use core::fmt::Write;

use crate::cli::doc::{range_on, unit};
use crate::cli::progress::plural;
use crate::model::{ActionDef, Reach, RuleBody, Space};
use crate::syntax::ast::Span;
use crate::syntax::{keyword, listed};
use crate::units;
use crate::units::Rational;

use super::names::Symbol;
use super::workspace::Analysis;
use super::{tokens, words};

/// Longer declarations are cut.
const LINES_MAX: usize = 12;

/// The place that is meant by a byte of the document, and Markdown about it.
pub fn hover(analysis: &Analysis, byte: usize) -> Option<(Span, String)> {
    if let Some(occurrence) = analysis.names.at(Analysis::ROOT, byte) {
        let mut texts: Vec<String> = Vec::new();
        for symbol in &occurrence.symbols {
            // A rule names the same parameter of several actions: what is alike is said once.
            let text = describe(analysis, symbol)?;
            if !texts.contains(&text) {
                texts.push(text);
            }
        }
        let mut text = texts.join("\n\n---\n\n");
        let owners: Vec<&str> = occurrence.symbols.iter().filter_map(owner).collect();
        if !owners.is_empty() {
            let _ = write!(text, "\n\nParameter of {}", listed(&owners));
        }
        return Some((occurrence.span, text));
    }
    let text = analysis.text(Analysis::ROOT);
    let (start, word) = tokens::word_at(text, byte)?;
    let meaning = keyword::keywords().find(|(known, _)| *known == word).map(|(_, meaning)| *meaning)?;
    let span = Span::new(Analysis::ROOT, start, start + word.len());
    Some((span, format!("**{word}**\n\n{meaning}")))
}

/// The action or function that a parameter is of.
fn owner(symbol: &Symbol) -> Option<&str> {
    match symbol {
        Symbol::Argument(of, _) | Symbol::Parameter(of, _) => Some(of),
        _ => None,
    }
}

/// Markdown about a symbol; `None` where there is nothing to say.
pub fn describe(analysis: &Analysis, symbol: &Symbol) -> Option<String> {
    let declared = &analysis.names.declared;
    let space = analysis.space();
    match symbol {
        Symbol::File(path) => Some(format!("`{}`", path.display())),
        Symbol::Enum(name) => {
            let of = declared.enums.get(name)?;
            let order = if of.of.ordered { "\n\nOrdered: `<` compares its variants." } else { "" };
            Some(block(analysis, of.span, &of.docs) + order)
        }
        Symbol::Variant(of, name) => {
            let of_enum = declared.enums.get(of)?;
            let place = of_enum.of.variants.iter().position(|variant| variant == name)?;
            let count = of_enum.of.variants.len();
            let text = block(analysis, of_enum.span, &of_enum.docs);
            Some(format!("{text}\n\n`{name}`: variant {} of {count} of `{of}`", place + 1))
        }
        Symbol::State(name) => {
            let of = declared.states.get(name)?;
            let text = block(analysis, of.span, &of.docs);
            let world = match name.as_str() {
                "time" | "sky" => "\n\nThe world reads it.",
                _ => "",
            };
            Some(format!("{text}\n\nType: `{}`{world}", of.of.as_ref()?.name()))
        }
        Symbol::Constant(name) => {
            let of = declared.constants.get(name)?;
            let ty = of.of.as_ref().map(|ty| format!("\n\nType: `{}`", ty.name())).unwrap_or_default();
            Some(block(analysis, of.span, &of.docs) + &ty)
        }
        Symbol::Function(name) => declared.functions.get(name).map(|of| block(analysis, of.span, &of.docs)),
        Symbol::Argument(of, name) => {
            let function = declared.functions.get(of)?;
            let (_, ty) = function.of.parameters.iter().find(|(known, _)| known == name)?;
            let ty = ty.as_ref().map_or_else(|| "unknown".to_owned(), super::names::Ty::name);
            Some(format!("```avastra\n{name}: {ty}\n```"))
        }
        Symbol::Action(name) => {
            let of = declared.actions.get(name)?;
            let header = match of.of.last() {
                Some(last) => format!("{})", analysis.slice(Span { end: last.span.end, ..of.span })),
                None => format!("action {name}()"),
            };
            let rows = space.and_then(|space| rows_of(space, name, when(analysis))).unwrap_or_default();
            Some(with_docs(&header, &of.docs) + &rows)
        }
        Symbol::Parameter(action, name) => parameter(analysis, action, name),
        Symbol::Group(name) => {
            let of = declared.groups.get(name)?;
            let text = block(analysis, of.span, &of.docs);
            let members = declared.targets(name);
            let rows = space.map(|space| {
                let is_member =
                    |action: usize| members.iter().any(|name| *name == space.actions[action].name);
                let count = space.rows.iter().filter(|row| is_member(row.action)).count();
                format!("\n\n{}", plural(count, "row"))
            });
            Some(text + &rows.unwrap_or_default())
        }
        Symbol::Rule(name) => {
            let of = declared.rules.get(name)?;
            let text = block(analysis, of.span, &of.docs);
            Some(text + &space.and_then(|space| bound_by(space, name)).unwrap_or_default())
        }
        Symbol::Road(name) => {
            let of = declared.roads.get(name)?;
            let text = block(analysis, of.span, &of.docs);
            Some(text + &space.and_then(|space| facts_of(space, name)).unwrap_or_default())
        }
        Symbol::Verdict(name) => declared.verdicts.get(name).map(|of| block(analysis, of.span, &of.docs)),
        Symbol::Scenario(name) | Symbol::Policy(name) => {
            let of = declared.others.get(name)?;
            (!of.docs.is_empty()).then(|| of.docs.join("\n"))
        }
        Symbol::Engine(word, meaning) => Some(format!("**{word}**\n\n{meaning}")),
        Symbol::Type(name) => {
            words::meaning(&words::types(), name).map(|meaning| format!("**{name}**\n\n{meaning}"))
        }
        Symbol::Number(digits, unit) => number(digits, unit.as_deref()?),
    }
}

fn block(analysis: &Analysis, span: Span, docs: &[String]) -> String {
    let text = analysis.slice(span);
    let mut lines: Vec<&str> = text.lines().take(LINES_MAX).collect();
    if text.lines().count() > LINES_MAX {
        lines.push("…");
    }
    with_docs(&lines.join("\n"), docs)
}

fn with_docs(code: &str, docs: &[String]) -> String {
    let docs = if docs.is_empty() { String::new() } else { format!("\n\n{}", docs.join("\n")) };
    format!("```avastra\n{code}\n```{docs}")
}

/// What was proved holds for the last sound state of the files, and should say so.
fn when(analysis: &Analysis) -> &'static str {
    if analysis.is_sound() { "" } else { " (when the file was last sound)" }
}

fn parameter(analysis: &Analysis, action: &str, name: &str) -> Option<String> {
    let declared = analysis.names.declared.parameter(action, name)?;
    let ty = declared.ty.as_ref().map(|ty| format!("\n\nType: `{}`", ty.name())).unwrap_or_default();
    let code = analysis.slice(declared.span);
    let mut text = format!("```avastra\n{code}\n```{ty}");
    let Some(space) = analysis.space() else { return Some(text) };
    let Some((index, of)) = find_action(space, action) else { return Some(text) };
    let Some(of) = of.parameters.iter().find(|parameter| *parameter.name == *name) else {
        return Some(text);
    };
    let unit = unit(of.ty);
    let mut lines = String::new();
    for (road, known) in space.roads.iter().enumerate() {
        if let Some(left) = range_on(space, index, of, road) {
            let _ = write!(lines, "\n- `{}`: {left} {unit}", known.name);
        }
    }
    if !lines.is_empty() {
        let _ = write!(text, "\n\nAfter the rules{}:\n{lines}", when(analysis));
    }
    Some(text)
}

pub fn find_action<'a>(space: &'a Space, name: &str) -> Option<(usize, &'a ActionDef)> {
    space.actions.iter().enumerate().find(|(_, action)| action.name == name)
}

/// `12 rows, 15 to 26`.
pub fn row_numbers(space: &Space, action: usize) -> String {
    let rows: Vec<usize> =
        space.rows.iter().filter(|row| row.action == action).map(|row| row.index).collect();
    match rows.as_slice() {
        [] => "no rows".to_owned(),
        [only] => format!("row {only}"),
        [first, .., last] => format!("{}, {first} to {last}", plural(rows.len(), "row")),
    }
}

fn rows_of(space: &Space, name: &str, when: &str) -> Option<String> {
    let (index, _) = find_action(space, name)?;
    let mut text = format!("\n\n{}{when}", row_numbers(space, index));
    for (road, known) in space.roads.iter().enumerate() {
        let rows = space.rows.iter().filter(|row| row.action == index);
        let dead: Vec<String> = rows
            .filter(|row| matches!(row.roads[road], Reach::Dead { .. }))
            .map(|row| row.index.to_string())
            .collect();
        if !dead.is_empty() {
            let _ = write!(text, "\n- masked on `{}`: {}", known.name, dead.join(", "));
        }
    }
    Some(text)
}

fn bound_by(space: &Space, name: &str) -> Option<String> {
    let (index, rule) = space.rules.iter().enumerate().find(|(_, rule)| rule.name == name)?;
    let rows = space.rows.iter().filter(|row| row.rules.contains(&index)).count();
    let actions: Vec<String> = (0..space.actions.len())
        .filter(|action| rule.body.binds(*action))
        .map(|action| format!("`{}`", space.actions[action].name))
        .collect();
    let kind = match &rule.body {
        RuleBody::Holds(_) => "Binds",
        RuleBody::Moves { .. } => "Orders the changes made by",
    };
    let optional = if rule.optional { "\n\nOff unless asked for: `--with`." } else { "" };
    Some(format!("\n\n{kind} {} of {}{optional}", plural(rows, "row"), actions.join(", ")))
}

fn facts_of(space: &Space, name: &str) -> Option<String> {
    let road = space.roads.iter().find(|road| road.name == name)?;
    let rounded = |value: f64| units::decimal((value * 1000.0).round() / 1000.0, false);
    let limit = road.facts.limit_mps;
    let lanes: Vec<&str> = ["left", "current", "right"]
        .into_iter()
        .zip(road.facts.lanes)
        .filter(|(_, is_there)| *is_there)
        .map(|(name, _)| name)
        .collect();
    Some(format!(
        "\n\n- limit: {} m/s ({} km/h)\n- lanes beside the route: {}",
        rounded(limit),
        rounded(limit * 3.6),
        lanes.join(", ")
    ))
}

/// A number with a unit in SI, exactly.
fn number(digits: &str, word: &str) -> Option<String> {
    let unit = units::unit(word)?;
    let exact = Rational::from_decimal(digits)?.checked_mul(unit.factor())?;
    let si = unit.dimension.si_unit();
    let shown = units::decimal((exact.to_f64() * 1e6).round() / 1e6, false);
    let exactly = exact.to_string();
    let exactly = if exactly == shown { String::new() } else { format!(", exactly {exactly}") };
    let in_si = if word == si { String::new() } else { format!("\n\n{shown} {si}{exactly}") };
    Some(format!("`{digits} {word}`: {}{in_si}", unit.dimension))
}
