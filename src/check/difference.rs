//! What differs between two spaces: rows, ranges, rules and declarations, compared by their meaning.
//!
//! Rows are matched by their labels. Rules are compared by what they leave of each range that both spaces have;
//! if the ranges show no difference, a rule with another text is called changed.

use core::fmt;
use std::collections::{BTreeMap, BTreeSet};

use crate::check::load::{Loaded, standing_items};
use crate::model::rules::RowRules;
use crate::model::{Interval, Reach, Road, Row, RuleBody, RulesInForce, Space, Type};
use crate::prove::Values;
use crate::syntax::ast::ItemKind;
use crate::syntax::{listed, print_item};

/// One difference; its parts together make a sentence.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Difference {
    pub change: Change,
    /// ``rule `npc_speed` ``, ``row `rain(how: High)` ``.
    pub subject: String,
    /// What has changed in figures; may be empty.
    pub detail: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Change {
    Added,
    Removed,
    /// It has another row number.
    Moved,
    /// It forbids more.
    Tightened,
    /// It forbids less.
    Loosened,
    Changed,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Change::Added => "added",
            Change::Removed => "removed",
            Change::Moved => "moved",
            Change::Tightened => "tightened",
            Change::Loosened => "loosened",
            Change::Changed => "changed",
        })
    }
}

/// Every difference from one space to another, declarations first; `None` if one is unsound.
pub fn differences(old: &Loaded, new: &Loaded) -> Option<Vec<Difference>> {
    let (old_space, new_space) = (old.space.as_deref()?, new.space.as_deref()?);
    let (old_texts, new_texts) = (texts(old), texts(new));
    let mut found = declarations(&old_texts, &new_texts);
    let pairs = Pairs::of(old_space, new_space);
    found.extend(rules((old_space, &old_texts), (new_space, &new_texts), &pairs));
    found.extend(rows(old_space, new_space, &pairs));
    found.extend(reaches(old_space, new_space, &pairs));
    Some(found)
}

/// The rows of two spaces by their labels.
struct Pairs<'a> {
    old: BTreeMap<&'a str, &'a Row>,
    new: BTreeMap<&'a str, &'a Row>,
}

impl<'a> Pairs<'a> {
    fn of(old: &'a Space, new: &'a Space) -> Pairs<'a> {
        // Of rows with the same label the first counts.
        let by_label =
            |space: &'a Space| space.rows.iter().rev().map(|row| (row.label.as_str(), row)).collect();
        Pairs { old: by_label(old), new: by_label(new) }
    }

    fn now(&self, row: &Row) -> Option<&'a Row> {
        self.new.get(row.label.as_str()).copied()
    }

    fn before(&self, row: &Row) -> Option<&'a Row> {
        self.old.get(row.label.as_str()).copied()
    }
}

fn difference(change: Change, subject: String, detail: impl Into<String>) -> Difference {
    Difference { change, subject, detail: detail.into() }
}

/// The formatted text of every declaration, by keyword and name.
type Texts = BTreeMap<(String, String), String>;

fn texts(loaded: &Loaded) -> Texts {
    let items = standing_items(loaded);
    let named = items.iter().filter(|item| {
        !matches!(
            item.kind,
            ItemKind::Language(_)
                | ItemKind::Use(_)
                | ItemKind::Expect(_)
                | ItemKind::Scenario(_)
                | ItemKind::Policy(_)
        )
    });
    let mut texts = Texts::new();
    for item in named {
        let name = match &item.kind {
            ItemKind::Also(also) => {
                let on: Vec<&str> = also.on.iter().map(|name| name.text.as_str()).collect();
                format!(" {}", listed(&on))
            }
            kind => kind.name().map_or(String::new(), |name| format!(" `{}`", name.text)),
        };
        let text = texts.entry((item.kind.keyword().to_owned(), name)).or_default();
        // Effects of every step, and more effects of an action, may stand in several places.
        text.push_str(&print_item(&item.kind));
        text.push('\n');
    }
    texts
}

/// Differences between declarations other than rules and actions, which are compared by their meaning.
fn declarations(old: &Texts, new: &Texts) -> Vec<Difference> {
    let mut found = Vec::new();
    let of_table = |keyword: &str| matches!(keyword, "rule" | "action");
    for ((keyword, name), text) in old.iter().filter(|((keyword, _), _)| !of_table(keyword)) {
        let subject = format!("{keyword}{name}");
        match new.get(&(keyword.clone(), name.clone())) {
            None => found.push(difference(Change::Removed, subject, "")),
            Some(other) if other != text => {
                found.push(difference(Change::Changed, subject, format!("{} → {}", flat(text), flat(other))));
            }
            Some(_) => {}
        }
    }
    for (key @ (keyword, name), text) in new.iter().filter(|((keyword, _), _)| !of_table(keyword)) {
        if !old.contains_key(key) {
            found.push(difference(Change::Added, format!("{keyword}{name}"), flat(text)));
        }
    }
    found
}

/// A declaration on one line.
fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn rules(
    (old_space, old_texts): (&Space, &Texts),
    (new_space, new_texts): (&Space, &Texts),
    pairs: &Pairs<'_>,
) -> Vec<Difference> {
    let text = |texts: &Texts, name: &str| {
        texts.get(&("rule".to_owned(), format!(" `{name}`"))).map_or(String::new(), |text| flat(text))
    };
    let named = |space: &Space| -> BTreeMap<String, usize> {
        space.rules.iter().enumerate().map(|(index, rule)| (rule.name.clone(), index)).collect()
    };
    let (known, now) = (named(old_space), named(new_space));
    let mut found = Vec::new();
    for (index, rule) in old_space.rules.iter().enumerate() {
        let subject = format!("rule `{}`", rule.name);
        let Some(&other) = now.get(&rule.name) else {
            found.push(difference(Change::Removed, subject, text(old_texts, &rule.name)));
            continue;
        };
        let optional = new_space.rules[other].optional;
        if optional != rule.optional {
            let (change, detail) = match optional {
                true => (Change::Loosened, "it is optional now"),
                false => (Change::Tightened, "it is no longer optional"),
            };
            found.push(difference(change, subject.clone(), detail));
        }
        let (before, after) = (text(old_texts, &rule.name), text(new_texts, &rule.name));
        let written = || format!("{before} → {after}");
        match compared((old_space, index), (new_space, other), pairs) {
            Some((change, detail)) => found.push(difference(change, subject, detail)),
            None if before != after => found.push(difference(Change::Changed, subject, written())),
            None => {}
        }
    }
    for rule in &new_space.rules {
        if !known.contains_key(&rule.name) {
            let subject = format!("rule `{}`", rule.name);
            found.push(difference(Change::Added, subject, text(new_texts, &rule.name)));
        }
    }
    found
}

/// Whether a rule forbids more or less than before, by its moves or by what it leaves of each range.
fn compared(
    old: (&Space, usize),
    new: (&Space, usize),
    pairs: &Pairs<'_>,
) -> Option<(Change, String)> {
    let mut turns = Turns::default();
    if let (
        RuleBody::Moves { state, allowed: before, .. },
        RuleBody::Moves { state: other, allowed: after, .. },
    ) = (&old.0.rules[old.1].body, &new.0.rules[new.1].body)
    {
        let variants = |space: &Space, state: usize| match space.states[state].ty {
            Type::Enum(of) => space.enums[of.0].variants.clone(),
            Type::Bool | Type::Int | Type::Quantity(_) => Vec::new(),
        };
        let (names, others) = (variants(old.0, *state), variants(new.0, *other));
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
        for row in old.0.rows.iter().filter(|row| binds(row, old.1)) {
            let Some(other) = pairs.now(row) else { continue };
            let unbound = !binds(other, new.1);
            if unbound {
                turns.looser.push(format!("binds `{}` no longer", row.label));
                continue;
            }
            for (road, same) in shared_roads(old.0, new.0) {
                let (before, after) = (left(old, row, road), left(new, other, same));
                turns.judge(&before, &after, &road.name);
            }
        }
        for row in new.0.rows.iter().filter(|row| binds(row, new.1)) {
            if pairs.before(row).is_some_and(|known| !binds(known, old.1)) {
                turns.tighter.push(format!("binds `{}`", row.label));
            }
        }
    }
    turns.in_words()
}

/// A range for each name.
type Ranges = Vec<(String, Interval)>;

/// What one rule alone leaves of each range of a row; `None` if it leaves nothing.
fn left((space, rule): (&Space, usize), row: &Row, road: &Road) -> Option<Ranges> {
    let alone = RulesInForce::only(space, rule);
    let settled = RowRules { space, row, road: Some(&road.facts), in_force: &alone }.settle()?;
    let drawn = space.actions[row.action].parameters.iter().zip(settled).filter(|(p, _)| !p.axis);
    let ranges = drawn.filter_map(|(parameter, values)| match values {
        Values::Number(interval) => Some((parameter.name.to_string(), interval)),
        Values::Truth { .. } | Values::Variants(_) => None,
    });
    Some(ranges.collect())
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
    fn judge(&mut self, before: &Option<Ranges>, after: &Option<Ranges>, road: &str) {
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

fn shared_roads<'a>(old: &'a Space, new: &'a Space) -> Vec<(&'a Road, &'a Road)> {
    let same = |road: &'a Road| Some((road, new.roads.iter().find(|other| other.name == road.name)?));
    old.roads.iter().filter_map(same).collect()
}

fn rows(old: &Space, new: &Space, pairs: &Pairs<'_>) -> Vec<Difference> {
    let subject = |row: &Row| format!("row `{}`", row.label);
    let mut found = Vec::new();
    let mut moved = 0;
    for row in &old.rows {
        match pairs.now(row) {
            None => found.push(difference(Change::Removed, subject(row), format!("it was {}", row.index))),
            Some(now) if now.index != row.index => moved += 1,
            Some(_) => {}
        }
    }
    let added = new.rows.iter().filter(|row| pairs.before(row).is_none());
    found.extend(added.map(|row| difference(Change::Added, subject(row), format!("it is {}", row.index))));
    if moved > 0 {
        let detail = "a policy learned on the old table does not fit the new one";
        found.push(difference(Change::Moved, format!("{moved} rows"), detail));
    }
    found
}

/// Differences in what all rules together leave of the ranges.
fn reaches(old: &Space, new: &Space, pairs: &Pairs<'_>) -> Vec<Difference> {
    let mut found: Vec<Difference> = Vec::new();
    let mut told: BTreeSet<(Change, usize, String)> = BTreeSet::new();
    let shared: Vec<(usize, usize, &Road)> = old
        .roads
        .iter()
        .enumerate()
        .filter_map(|(index, road)| {
            Some((index, new.roads.iter().position(|known| known.name == road.name)?, road))
        })
        .collect();
    for row in &old.rows {
        let Some(other) = pairs.now(row) else { continue };
        for &(index, same, road) in &shared {
            let action = &old.actions[row.action].name;
            let mut turns = Turns::default();
            let ranges = |reach: &Reach| match reach {
                Reach::Open(ranges) => Some(ranges.iter().map(|(name, i)| (name.to_string(), *i)).collect()),
                Reach::Dead { .. } => None,
            };
            turns.judge(&ranges(&row.roads[index]), &ranges(&other.roads[same]), &road.name);
            let Some((change, detail)) = turns.in_words() else { continue };
            if told.insert((change, row.action, detail.clone())) {
                found.push(difference(change, format!("draws of `{action}`"), detail));
            }
        }
    }
    found
}
