//! The text for a name under the pointer: its declaration, its type, the values that the rules leave, and its
//! documentation.

use core::fmt::Write;
use std::collections::BTreeSet;

use avastra_base::outside::Shown;
use avastra_base::units::{self, Rational};
use avastra_lang::check::{Declaration, Symbol};
use avastra_lang::model::vocabulary::{Word, WorldState};
use avastra_lang::model::{ActionDef, Interval, Parameter, Reach, RuleBody, Space};
use avastra_lang::syntax::ast::Span;
use avastra_lang::syntax::{keyword, listed};

use super::position::Range;
use super::workspace::Analysis;
use super::{tokens, words};

/// Lines of a declaration that are shown, at most.
const LINES_MAX: usize = 12;

/// The description of a name or a keyword.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hover {
    pub range: Range,
    /// In Markdown.
    pub text: String,
}

/// Describes the name or keyword at a byte of the document.
pub fn hover(analysis: &Analysis, byte: usize) -> Option<Hover> {
    if let Some(occurrence) = analysis.references().at(Analysis::ROOT, byte) {
        let mut texts: Vec<String> = Vec::new();
        for symbol in &occurrence.symbols {
            // A rule over several actions names a parameter of each. Equal texts are shown once.
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
        return Some(Hover { range: analysis.range(occurrence.span), text });
    }
    let text = analysis.text(Analysis::ROOT);
    let (start, word) = tokens::word_at(text, byte)?;
    let field = || text[start + word.len()..].trim_start().starts_with(':').then(|| words::field(word))?;
    let meaning = keyword::meaning(word).or_else(field)?;
    let span = Span::new(Analysis::ROOT, start, start + word.len());
    Some(Hover { range: analysis.range(span), text: format!("**{word}**\n\n{meaning}") })
}

/// The action or function that has the parameter.
fn owner(symbol: &Symbol) -> Option<&str> {
    match symbol {
        Symbol::Argument(of, _) | Symbol::Given(of, _) | Symbol::Parameter(of, _) => Some(of),
        _ => None,
    }
}

/// Markdown about a symbol; `None` if nothing is known of it.
pub fn describe(analysis: &Analysis, symbol: &Symbol) -> Option<String> {
    let references = analysis.references();
    match symbol {
        Symbol::File(path) => return Some(format!("`{}`", path.shown())),
        Symbol::Engine(word, meaning) => return Some(format!("**{word}**\n\n{meaning}")),
        Symbol::Type(name) => {
            return Some(format!("**{name}**\n\n{}", words::meaning(&words::types(), name)?));
        }
        Symbol::Number(digits, unit) => return number(digits, unit.as_deref()?),
        _ => {}
    }
    let declared = references.declaration(symbol)?;
    let text = block(analysis, declared);
    let ty = declared.type_name(references);
    let typed = ty.as_ref().map(|ty| format!("\n\nType: `{ty}`")).unwrap_or_default();
    let space = analysis.space();
    Some(match symbol {
        Symbol::Enum(name) => match references.enum_named(name).is_some_and(|of| of.ordered) {
            true => format!("{text}\n\nOrdered: `<` compares its variants."),
            false => text,
        },
        Symbol::Variant(of, name) => {
            let variants = &references.enum_named(of)?.variants;
            let place = variants.iter().position(|variant| variant == name)?;
            format!("{text}\n\n`{name}`: variant {} of {} of `{of}`", place + 1, variants.len())
        }
        Symbol::State(name) => {
            let world = WorldState::from_name(name).map_or("", |_| "\n\nThe world reads it.");
            format!("{text}{typed}{world}")
        }
        Symbol::Constant(_) => format!("{text}{typed}"),
        Symbol::Argument(_, name) | Symbol::Given(_, name) => {
            format!("```avastra\n{name}: {}\n```", ty.as_deref().unwrap_or("unknown"))
        }
        Symbol::Action(name) => {
            let last = declared.parts.last().and_then(|last| references.declaration(last));
            let header = match last {
                Some(last) => format!("{})", analysis.slice(declared.span.to(last.span))),
                None => format!("action {name}()"),
            };
            let rows = space.and_then(|space| rows_of(space, name, when(analysis))).unwrap_or_default();
            with_docs(&header, &declared.docs) + &rows
        }
        Symbol::Parameter(action, name) => format!("{text}{typed}{}", ranges(analysis, action, name)),
        Symbol::Group(name) => {
            let members = references.actions(name);
            let rows = space.map(|space| {
                let names: BTreeSet<&str> = members.iter().filter_map(Symbol::word).collect();
                let actions = space.actions.iter().enumerate();
                let of_group = actions.filter(|(_, action)| names.contains(action.name.as_str()));
                let count: usize = of_group.map(|(action, _)| space.rows_of(action).len()).sum();
                format!("\n\n{}", counted(count))
            });
            text + &rows.unwrap_or_default()
        }
        Symbol::Rule(name) => text + &space.and_then(|space| bound_by(space, name)).unwrap_or_default(),
        Symbol::Road(name) => text + &space.and_then(|space| facts_of(space, name)).unwrap_or_default(),
        Symbol::Scenario(_) | Symbol::Policy(_) if declared.docs.is_empty() => return None,
        Symbol::Scenario(_) | Symbol::Policy(_) => declared.docs.join("\n"),
        _ => text,
    })
}

fn block(analysis: &Analysis, declared: &Declaration) -> String {
    let text = analysis.slice(declared.span);
    let mut lines: Vec<&str> = text.lines().take(LINES_MAX).collect();
    if text.lines().count() > LINES_MAX {
        lines.push("…");
    }
    with_docs(&lines.join("\n"), &declared.docs)
}

fn with_docs(code: &str, docs: &[String]) -> String {
    let docs = if docs.is_empty() { String::new() } else { format!("\n\n{}", docs.join("\n")) };
    format!("```avastra\n{code}\n```{docs}")
}

/// A remark that a proof is about an earlier state of the files; empty while the space is sound.
fn when(analysis: &Analysis) -> &'static str {
    if analysis.is_sound() { "" } else { " (when the file was last sound)" }
}

/// The values of a drawn parameter that the rules leave, road by road.
fn ranges(analysis: &Analysis, action: &str, name: &str) -> String {
    let known = analysis.space().and_then(|space| ranges_left(space, action, name));
    let Some((of, left)) = known.filter(|(_, left)| !left.is_empty()) else { return String::new() };
    let shown = |left: &Interval| left.shown(of.ty, of.unit());
    let lines: String = left.iter().map(|(road, left)| format!("\n- `{road}`: {}", shown(left))).collect();
    format!("\n\nAfter the rules{}:\n{lines}", when(analysis))
}

/// A parameter of an action, and the range that the rules leave of it on each road.
pub fn ranges_left<'a>(
    space: &'a Space,
    action: &str,
    name: &str,
) -> Option<(&'a Parameter, Vec<(&'a str, Interval)>)> {
    let (index, action) = find_action(space, action)?;
    let of = action.parameters.iter().find(|parameter| *parameter.name == *name)?;
    let roads = space.roads.iter().enumerate();
    let left = roads.filter_map(|(road, known)| Some((&*known.name, space.range_on(index, of, road)?)));
    Some((of, left.collect()))
}

pub fn find_action<'a>(space: &'a Space, name: &str) -> Option<(usize, &'a ActionDef)> {
    space.actions.iter().enumerate().find(|(_, action)| action.name == name)
}

/// `1 row`, `12 rows`.
fn counted(rows: usize) -> String {
    if rows == 1 { "1 row".to_owned() } else { format!("{rows} rows") }
}

/// `12 rows, 15 to 26`.
pub fn row_numbers(space: &Space, action: usize) -> String {
    match space.rows_of(action) {
        [] => "no rows".to_owned(),
        [only] => format!("row {}", only.index),
        rows @ [first, .., last] => {
            format!("{}, {} to {}", counted(rows.len()), first.index, last.index)
        }
    }
}

fn rows_of(space: &Space, name: &str, when: &str) -> Option<String> {
    let (index, _) = find_action(space, name)?;
    let mut text = format!("\n\n{}{when}", row_numbers(space, index));
    for (road, known) in space.roads.iter().enumerate() {
        let rows = space.rows_of(index).iter();
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
        RuleBody::During(_) => "Binds, when they change lanes, the road users of",
        RuleBody::Phases { .. } => "Binds, when phases of their manoeuvre begin, the road users of",
        RuleBody::Moves { .. } => "Orders the changes made by",
    };
    let optional = if rule.optional { "\n\nOff unless asked for: `--with`." } else { "" };
    Some(format!("\n\n{kind} {} of {}{optional}", counted(rows), actions.join(", ")))
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
        "\n\n- limit: {} m/s ({} km/h){}\n- lanes beside the route: {}",
        rounded(limit),
        rounded(limit * 3.6),
        road.facts.limited_at.as_ref().map_or(String::new(), |place| format!(", in {place}")),
        lanes.join(", ")
    ))
}

/// A number with its unit, and its exact value in SI.
fn number(digits: &str, word: &str) -> Option<String> {
    let unit = units::unit(word)?;
    let exact = Rational::from_literal(digits)?.checked_mul(unit.factor())?;
    let si = unit.dimension.si_unit();
    let shown = units::decimal((exact.to_f64() * 1e6).round() / 1e6, false);
    let exactly = exact.to_string();
    let exactly = if exactly == shown { String::new() } else { format!(", exactly {exactly}") };
    let in_si = if word == si { String::new() } else { format!("\n\n{shown} {si}{exactly}") };
    Some(format!("`{digits} {word}`: {}{in_si}", unit.dimension))
}
