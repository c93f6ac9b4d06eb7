//! The differences between two spaces: declarations, rules, rows and ranges.
//!
//! Declarations are compared by exactly the texts that the digest covers (`meaning`), so a difference is told if and only
//! if the digests differ. Rules are also compared by what they leave of the ranges that both spaces have. Rows are compared
//! by their labels, and draws by the ranges that all rules together leave.

use core::fmt;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::check::load::Loaded;
use crate::check::names::flat;
use crate::model::rules::RowRules;
use crate::model::{Interval, Road, Row, RuleBody, RulesInForce, Space, Type};

/// One difference; its parts together make a sentence.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Difference {
    pub change: Change,
    /// ``rule `npc_speed` ``, ``row `rain(how: High)` ``.
    pub subject: String,
    /// The change in figures; may be empty.
    pub detail: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Change {
    Added,
    Removed,
    /// It has another row number, or comes before another declaration.
    Moved,
    /// It forbids more.
    Tightened,
    /// It forbids less.
    Loosened,
    Changed,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&format!("{self:?}").to_lowercase())
    }
}

/// Every difference from one space to another, declarations first; `None` if one is unsound. There is one if and only if
/// the digests of the two differ, because each declaration that the digest covers is held against the other space's.
pub fn differences(old: &Loaded, new: &Loaded) -> Option<Vec<Difference>> {
    let (old, new) = (Side::new(old.space.as_deref()?), Side::new(new.space.as_deref()?));
    // Equal texts in equal order make equal tables, whatever files they stand in.
    if old.space.meaning.digest() == new.space.meaning.digest() {
        return Some(Vec::new());
    }
    let mut found = declarations(&old, &new);
    found.extend(order(&old, &new));
    found.extend(rows(&old, &new));
    found.extend(reaches(&old, &new));
    Some(found)
}

fn difference(change: Change, subject: impl Into<String>, detail: impl Into<String>) -> Difference {
    Difference { change, subject: subject.into(), detail: detail.into() }
}

/// How the titles of declarations begin that rules compute with.
const TERMS: [&str; 7] = ["body `", "enum `", "`episode`", "fn `", "let `", "road `", "state `"];

/// One of the two spaces.
struct Side<'a> {
    space: &'a Space,
    /// The text of each declaration that the digest covers, by its title. Effects of every step, and further effects of an
    /// action, may stand in several places: they are joined into one text.
    texts: BTreeMap<&'a str, String>,
    /// The rows by their labels. If several have one label, the first counts.
    rows: BTreeMap<&'a str, &'a Row>,
}

impl<'a> Side<'a> {
    fn new(space: &'a Space) -> Side<'a> {
        let mut texts: BTreeMap<&str, String> = BTreeMap::new();
        for (title, text) in space.meaning.declarations() {
            let known = texts.entry(title).or_default();
            known.push_str(text);
            known.push('\n');
        }
        let rows = space.rows.iter().rev().map(|row| (row.label.as_str(), row)).collect();
        Side { space, texts, rows }
    }

    /// The row that has the label of a row of the other space.
    fn row(&self, other: &Row) -> Option<&'a Row> {
        self.rows.get(other.label.as_str()).copied()
    }

    /// Whether something besides a rule's own text, on which its meaning may depend, is declared in another way. Actions do
    /// not count: the range of their parameters is no work of the rule.
    fn has_other_terms(&self, other: &Side<'_>) -> bool {
        let differs = |of: &Side<'_>, than: &Side<'_>| {
            let mut terms =
                of.texts.iter().filter(|(title, _)| TERMS.iter().any(|kind| title.starts_with(*kind)));
            terms.any(|(title, text)| than.texts.get(*title) != Some(text))
        };
        differs(self, other) || differs(other, self)
    }

    /// The index of the rule with this title.
    fn rule(&self, title: &str) -> Option<usize> {
        let name = title.strip_prefix("rule `")?.strip_suffix('`')?;
        self.space.rules.iter().position(|rule| rule.name == name)
    }
}

/// Differences between declarations: rules are compared by what they forbid where that is known, all others by their text.
fn declarations(old: &Side<'_>, new: &Side<'_>) -> Vec<Difference> {
    let mut found = Vec::new();
    for (&title, text) in &old.texts {
        let Some(other) = new.texts.get(title) else {
            found.push(difference(Change::Removed, title, flat(text)));
            continue;
        };
        match (old.rule(title), new.rule(title)) {
            (Some(rule), Some(same)) => {
                found.extend(of_rule(old, new, [rule, same], title, (text, other)));
            }
            _ if text != other => found.push(difference(Change::Changed, title, changed_lines(text, other))),
            _ => {}
        }
    }
    let added = new.texts.iter().filter(|(title, _)| !old.texts.contains_key(**title));
    found.extend(added.map(|(&title, text)| difference(Change::Added, title, flat(text))));
    found
}

/// The first declaration whose successor is another one than before. Declarations that may stand in any order are sorted in
/// both spaces.
fn order(old: &Side<'_>, new: &Side<'_>) -> Option<Difference> {
    let shared = |of: &Side<'_>, other: &Side<'_>| -> Vec<String> {
        let titles = of.space.meaning.declarations().map(|(title, _)| title);
        titles.filter(|title| other.texts.contains_key(*title)).map(str::to_owned).collect()
    };
    let (before, after) = (shared(old, new), shared(new, old));
    let (was, is) = before.iter().zip(&after).find(|(was, is)| was != is)?;
    Some(difference(Change::Moved, is.as_str(), format!("it comes before {was} now")))
}

/// The part of a declaration's text that changed: the lines from the first to the last that differ.
fn changed_lines(old: &str, new: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (old.lines().collect(), new.lines().collect());
    let begin = old.iter().zip(&new).take_while(|(one, other)| one == other).count();
    let (old, new) = (&old[begin..], &new[begin..]);
    let end = old.iter().rev().zip(new.iter().rev()).take_while(|(one, other)| one == other).count();
    let (old, new) = (&old[..old.len() - end], &new[..new.len() - end]);
    let (old, new) = (flat(&old.join(" ")), flat(&new.join(" ")));
    match (old.is_empty(), new.is_empty()) {
        (true, _) => format!("now with {new}"),
        (_, true) => format!("now without {old}"),
        _ => format!("{old} → {new}"),
    }
}

/// Changes of a rule that both spaces have: whether it is optional, and what it forbids. Another text is always told. A rule
/// with the same text may forbid something else because of a function or a constant.
fn of_rule(
    old: &Side<'_>,
    new: &Side<'_>,
    [rule, same]: [usize; 2],
    title: &str,
    (before, after): (&str, &str),
) -> Vec<Difference> {
    let mut found = Vec::new();
    let (was_optional, is_optional) = (old.space.rules[rule].optional, new.space.rules[same].optional);
    if was_optional != is_optional {
        let (change, detail) = match is_optional {
            true => (Change::Loosened, "it is optional now"),
            false => (Change::Tightened, "it is no longer optional"),
        };
        found.push(difference(change, title, detail));
    }
    let mandatory = |text: &str| text.strip_prefix("optional ").unwrap_or(text).to_owned();
    let (before, after) = (mandatory(before), mandatory(after));
    let written = (before != after).then(|| changed_lines(&before, &after));
    let may_differ = written.is_some() || old.has_other_terms(new);
    match (compared(old, new, [rule, same], may_differ), written) {
        (Some((change, detail)), None) => found.push(difference(change, title, detail)),
        (Some((change, detail)), Some(written)) => {
            found.push(difference(change, title, format!("{detail}; {written}")));
        }
        (None, Some(written)) => found.push(difference(Change::Changed, title, written)),
        (None, None) => {}
    }
    found
}

/// Whether a rule forbids more or less than before, by its moves or by what it leaves of each range. If it cannot itself
/// differ (`may_differ`), another range is that of the action, which is told there.
fn compared(
    old: &Side<'_>,
    new: &Side<'_>,
    [rule, same]: [usize; 2],
    may_differ: bool,
) -> Option<(Change, String)> {
    let mut turns = Turns::default();
    if let (
        RuleBody::Moves { state, allowed: before, .. },
        RuleBody::Moves { state: other, allowed: after, .. },
    ) = (&old.space.rules[rule].body, &new.space.rules[same].body)
    {
        let variants = |space: &Space, state: usize| match space.states[state].ty {
            Type::Enum(of) => space.enums[of.0].variants.clone(),
            Type::Bool | Type::Int | Type::Quantity(_) => Vec::new(),
        };
        let (names, others) = (variants(old.space, *state), variants(new.space, *other));
        for (from, from_name) in names.iter().enumerate() {
            for (to, to_name) in names.iter().enumerate() {
                let find = |name: &String| others.iter().position(|other| other == name);
                let (Some(from_now), Some(to_now)) = (find(from_name), find(to_name)) else { continue };
                let word = format!("{from_name} -> {to_name}");
                match (before[from][to], after[from_now][to_now]) {
                    (true, false) => turns.tighter.push(word),
                    (false, true) => turns.looser.push(word),
                    _ => {}
                }
            }
        }
    } else {
        let binds = |row: &Row, rule: usize| row.rules.binary_search(&rule).is_ok();
        for row in old.space.rows.iter().filter(|row| binds(row, rule)) {
            let Some(other) = new.row(row) else { continue };
            if !binds(other, same) {
                turns.looser.push(format!("binds `{}` no longer", row.label));
                continue;
            }
            for (was, is) in shared_roads(old.space, new.space).into_iter().filter(|_| may_differ) {
                let (was, is) = (&old.space.roads[was], &new.space.roads[is]);
                let (before, after) = (left(old.space, rule, row, was), left(new.space, same, other, is));
                turns.judge(before.as_deref(), after.as_deref(), &was.name);
            }
        }
        for row in new.space.rows.iter().filter(|row| binds(row, same)) {
            if old.row(row).is_some_and(|known| !binds(known, rule)) {
                turns.tighter.push(format!("binds `{}`", row.label));
            }
        }
    }
    turns.in_words()
}

/// A range for each name.
type Ranges = [(Arc<str>, Interval)];

/// The part of each range of a row that one rule alone leaves; `None` if it leaves nothing.
fn left(space: &Space, rule: usize, row: &Row, road: &Road) -> Option<Vec<(Arc<str>, Interval)>> {
    let alone = RulesInForce::only(space, rule);
    RowRules { space, row, road: Some(&road.facts), in_force: &alone }.ranges()
}

/// How something forbids more than before, and how less.
#[derive(Default)]
struct Turns {
    tighter: Vec<String>,
    looser: Vec<String>,
}

impl Turns {
    /// The change as a whole, and its parts in words; `None` if there is no change.
    fn in_words(&self) -> Option<(Change, String)> {
        let shown = |parts: &[String]| {
            let mut seen: BTreeSet<&str> = BTreeSet::new();
            let kept: Vec<&str> =
                parts.iter().map(String::as_str).filter(|part| seen.insert(*part)).collect();
            match kept.len() {
                0..=4 => kept.join("; "),
                more => format!("{}; and {} more", kept[..4].join("; "), more - 4),
            }
        };
        let (tighter, looser) = (shown(&self.tighter), shown(&self.looser));
        match (tighter.is_empty(), looser.is_empty()) {
            (true, true) => None,
            (false, true) => Some((Change::Tightened, tighter)),
            (true, false) => Some((Change::Loosened, looser)),
            (false, false) => Some((Change::Changed, format!("tighter: {tighter}; looser: {looser}"))),
        }
    }

    /// Compares what is left of each range on a road; `None` if nothing is.
    fn judge(&mut self, before: Option<&Ranges>, after: Option<&Ranges>, road: &str) {
        let (before, after) = match (before, after) {
            (None, None) => return,
            (None, Some(_)) => return self.looser.push(format!("no longer forbids everything on {road}")),
            (Some(_), None) => return self.tighter.push(format!("forbids everything on {road}")),
            (Some(before), Some(after)) => (before, after),
        };
        for (name, was) in before {
            let Some((_, is)) = after.iter().find(|(known, _)| known == name) else { continue };
            let shared = was.intersect(is);
            let word = format!("{name} {was} → {is} on {road}");
            if shared != *was {
                self.tighter.push(word.clone());
            }
            if shared != *is {
                self.looser.push(word);
            }
        }
    }
}

/// The roads that both spaces have: the index in the old one, and in the new one.
fn shared_roads(old: &Space, new: &Space) -> Vec<(usize, usize)> {
    let now = |road: &Road| new.roads.iter().position(|other| other.name == road.name);
    old.roads.iter().enumerate().filter_map(|(index, road)| Some((index, now(road)?))).collect()
}

fn rows(old: &Side<'_>, new: &Side<'_>) -> Vec<Difference> {
    let subject = |row: &Row| format!("row `{}`", row.label);
    let mut found = Vec::new();
    let mut moved = 0;
    for row in &old.space.rows {
        match new.row(row) {
            None => found.push(difference(Change::Removed, subject(row), format!("it was {}", row.index))),
            Some(now) if now.index != row.index => moved += 1,
            Some(_) => {}
        }
    }
    let added = new.space.rows.iter().filter(|row| old.row(row).is_none());
    found.extend(added.map(|row| difference(Change::Added, subject(row), format!("it is {}", row.index))));
    if moved > 0 {
        let detail = "a policy learned on the old table does not fit the new one";
        found.push(difference(Change::Moved, format!("{moved} rows"), detail));
    }
    found
}

/// Differences in what all rules together leave of the ranges.
fn reaches(old: &Side<'_>, new: &Side<'_>) -> Vec<Difference> {
    let mut found: Vec<Difference> = Vec::new();
    let mut told: BTreeSet<(Change, usize, String)> = BTreeSet::new();
    let shared = shared_roads(old.space, new.space);
    for row in &old.space.rows {
        let Some(other) = new.row(row) else { continue };
        for &(index, same) in &shared {
            let action = &old.space.actions[row.action].name;
            let mut turns = Turns::default();
            let (before, after) = (row.roads[index].ranges(), other.roads[same].ranges());
            turns.judge(before, after, &old.space.roads[index].name);
            let Some((change, detail)) = turns.in_words() else { continue };
            if told.insert((change, row.action, detail.clone())) {
                found.push(difference(change, format!("draws of `{action}`"), detail));
            }
        }
    }
    found
}
