//! Which declarations of the used files stand: `override` replaces the declaration of the same kind and name,
//! `use … without` leaves actions, groups, rules and requirements out.
//!
//! The new declaration takes the place of the old one, so that the rows of a table keep their numbers.
//! Everything that used the old declaration uses the new one, in the used file too, and is checked with it.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::check::files::{LoadedFile, used_path, used_paths, uses as uses_of};
use crate::check::names::unknown;
use crate::check::unused::names_of_expr;
use crate::model::code;
use crate::model::vocabulary::{Fact, Known, Word};
use crate::syntax::ast::{Also, EffectKind, Group, Item, ItemKind, Name, Rule, RuleBody, Span, Use};
use crate::syntax::{Diagnostic, nearest};

/// A declaration that stands, and the index of its file.
struct Standing<'a> {
    file: usize,
    item: Cow<'a, Item>,
}

/// Every declaration that stands, in the given order of files (imports first); overridden ones are replaced.
pub(super) fn resolve<'a>(files: &'a [LoadedFile], order: &[usize]) -> (Vec<Cow<'a, Item>>, Vec<Diagnostic>) {
    let mut standing: Vec<Standing<'a>> = Vec::new();
    let mut diagnostics = Vec::new();
    for &file in order {
        for used in uses_of(&files[file]).filter(|used| !used.without.is_empty()) {
            leave_out(files, &mut standing, file, used, &mut diagnostics);
        }
        for item in &files[file].tree.items {
            match &item.kind {
                ItemKind::Override(kind) => match find(files, &standing, file, item, kind) {
                    Ok(place) => {
                        let item = Item { docs: item.docs.clone(), kind: (**kind).clone(), span: item.span };
                        standing[place] = Standing { file, item: Cow::Owned(item) };
                    }
                    Err(error) => diagnostics.push(error),
                },
                _ => standing.push(Standing { file, item: Cow::Borrowed(item) }),
            }
        }
    }
    (standing.into_iter().map(|standing| standing.item).collect(), diagnostics)
}

/// The declarations that do not stand as they are written: overridden ones, ones that a `use` leaves out,
/// and groups and rules that lost a name. The checker looks at them for their names alone.
pub(super) fn set_aside<'a>(files: &'a [LoadedFile], standing: &[Cow<'_, Item>]) -> Vec<&'a Item> {
    let whole = standing.iter().filter(|item| matches!(item, Cow::Borrowed(_)));
    let whole: BTreeSet<Span> = whole.map(|item| item.span).collect();
    let all: BTreeSet<Span> = standing.iter().map(|item| item.span).collect();
    let stands = |item: &&Item| match item.kind {
        ItemKind::Override(_) => all.contains(&item.span),
        _ => whole.contains(&item.span),
    };
    files.iter().flat_map(|file| &file.tree.items).filter(|item| !stands(item)).collect()
}

/// Removes the names that a `use` leaves out, also from groups and after `on`. Then removes what has lost its
/// meaning: groups and rules without any name left, and rules about a state or a gap that no action touches any
/// more.
fn leave_out(
    files: &[LoadedFile],
    standing: &mut Vec<Standing<'_>>,
    file: usize,
    used: &Use,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let path = used_path(&files[file], used);
    // A file that cannot be read was reported already.
    let Some(target) = files.iter().position(|other| other.path == path) else { return };
    let offered: Vec<bool> = (0..files.len()).map(|other| uses(files, target, other)).collect();
    let mut left = left_names(standing, &offered, used, diagnostics);
    // Actions of other files may still touch what a rule is about.
    let others = files.iter().zip(&offered).filter(|(_, is_offered)| !**is_offered);
    let others = touched(others.flat_map(|(file, _)| &file.tree.items));
    let touched_now = |standing: &[Standing<'_>]| {
        let mut touched = touched(standing.iter().map(|standing| standing.item.as_ref()));
        touched.extend(others.iter().cloned());
        touched
    };
    let touched_before = touched_now(standing);
    standing.retain(|standing| {
        let name = standing.item.kind.name();
        !(is_offered(standing, &offered) && name.is_some_and(|name| left.contains(&name.text)))
    });
    let touched_after = touched_now(standing);
    let has_lost = |named: &BTreeSet<&str>| {
        let among = |touched: &BTreeSet<String>| named.iter().any(|name| touched.contains(*name));
        among(&touched_before) && !among(&touched_after)
    };
    loop {
        let before = left.len();
        standing.retain_mut(|standing| {
            !is_offered(standing, &offered) || keeps_something(&mut standing.item, &mut left, &has_lost)
        });
        if left.len() == before {
            return;
        }
    }
}

/// Whether a `use` can leave this declaration out.
fn is_offered(standing: &Standing<'_>, offered: &[bool]) -> bool {
    offered[standing.file]
        && matches!(
            standing.item.kind,
            ItemKind::Action(_)
                | ItemKind::Group(_)
                | ItemKind::Also(_)
                | ItemKind::Rule(_)
                | ItemKind::Require(_)
        )
}

/// The names that a `use` leaves out; for a group also its members.
fn left_names(
    standing: &[Standing<'_>],
    offered: &[bool],
    used: &Use,
    diagnostics: &mut Vec<Diagnostic>,
) -> BTreeSet<String> {
    let members = || standing.iter().filter(|standing| is_offered(standing, offered));
    let mut left = BTreeSet::new();
    for name in &used.without {
        let mut open = vec![name.text.clone()];
        while let Some(next) = open.pop() {
            // In a broken text a group may contain itself.
            if left.contains(&next) {
                continue;
            }
            let is_next =
                |standing: &&Standing<'_>| standing.item.kind.name().is_some_and(|known| known.text == next);
            let mut known = false;
            for member in members().filter(is_next) {
                known = true;
                let group = member.item.kind.as_group();
                open.extend(group.iter().flat_map(|group| &group.members).map(|member| member.text.clone()));
            }
            if known {
                left.insert(next);
            } else if next == name.text {
                let candidates = members().filter_map(|standing| standing.item.kind.name());
                let candidates: Vec<&str> = candidates.map(|name| name.text.as_str()).collect();
                let error = unknown("action, group or rule", &name.text, name.span, candidates);
                let is_road = |standing: &Standing<'_>| {
                    standing.item.kind.as_road().is_some_and(|road| road.name.text == name.text)
                };
                diagnostics.push(match standing.iter().any(is_road) {
                    true => {
                        error.help("it is a road: `episode { roads: [NAME] }` says on which ones to play")
                    }
                    false => error,
                });
            }
        }
    }
    left
}

/// Removes the names in `left` from a group or a rule, and gives whether the declaration still has a meaning.
/// A group without members is added to `left`.
fn keeps_something(
    item: &mut Cow<'_, Item>,
    left: &mut BTreeSet<String>,
    has_lost: &dyn Fn(&BTreeSet<&str>) -> bool,
) -> bool {
    let gone = |name: &Name| left.contains(&name.text);
    let names = match &item.kind {
        ItemKind::Group(group) => &group.members,
        ItemKind::Also(also) => &also.on,
        ItemKind::Rule(rule) => match &rule.body {
            RuleBody::Holds { on, during, condition } if on.is_empty() => {
                let mut named = BTreeSet::new();
                match during {
                    None => names_of_expr(condition, &mut named),
                    // It binds what spawns, as a rule about the gap does.
                    Some(_) => drop(named.insert(Fact::SpawnGap.name())),
                }
                return !has_lost(&named);
            }
            RuleBody::Holds { on, .. } => on,
            RuleBody::Moves { state, .. } => return !has_lost(&BTreeSet::from([state.text.as_str()])),
        },
        _ => return true,
    };
    let kept: Vec<Name> = names.iter().filter(|name| !gone(name)).cloned().collect();
    if kept.len() == names.len() {
        return true;
    }
    let is_kept = !kept.is_empty();
    if let (ItemKind::Group(group), false) = (&item.kind, is_kept) {
        left.insert(group.name.text.clone());
    }
    if let ItemKind::Group(Group { members: names, .. })
    | ItemKind::Also(Also { on: names, .. })
    | ItemKind::Rule(Rule { body: RuleBody::Holds { on: names, .. }, .. }) = &mut item.to_mut().kind
    {
        *names = kept;
    }
    is_kept
}

/// The names that decide which actions a rule without `on` binds: the states that steps set, and the gaps if an action
/// spawns.
fn touched<'a>(items: impl Iterator<Item = &'a Item>) -> BTreeSet<String> {
    let effects = items.flat_map(|item| match item.kind.plain() {
        ItemKind::Action(action) => action.effects.as_slice(),
        ItemKind::Also(also) => &also.effects,
        ItemKind::EachStep(effects) => effects,
        _ => &[],
    });
    let gaps = Fact::ALL.iter().filter(|fact| fact.known() == Known::Spawn);
    let gaps: Vec<String> = gaps.map(|fact| fact.name().to_owned()).collect();
    effects
        .flat_map(|effect| match &effect.kind {
            EffectKind::Set { state, .. } => vec![state.text.clone()],
            EffectKind::Spawn(_) => gaps.clone(),
            EffectKind::Order { .. } => Vec::new(),
        })
        .collect()
}

/// The index of the declaration that an `override` replaces.
fn find(
    files: &[LoadedFile],
    standing: &[Standing<'_>],
    file: usize,
    item: &Item,
    kind: &ItemKind,
) -> Result<usize, Diagnostic> {
    let name = |kind: &ItemKind| kind.name().map(|name| name.text.clone());
    let same_kind = |other: &ItemKind| core::mem::discriminant(other) == core::mem::discriminant(kind);
    let wanted = name(kind);
    let what = match &wanted {
        Some(name) => format!("{} `{name}`", kind.keyword()),
        None => format!("`{}`", kind.keyword()),
    };
    let span = kind.name().map_or(item.span, |name| name.span);
    let error = |message: String| Diagnostic::error(code::OVERRIDE, message);
    let place = standing
        .iter()
        .rposition(|standing| same_kind(&standing.item.kind) && name(&standing.item.kind) == wanted);
    let Some(place) = place else {
        let error = error(format!("there is no {what} to override")).at(span, "no used file declares it");
        let other = standing.iter().find(|standing| wanted.is_some() && name(&standing.item.kind) == wanted);
        if let Some(other) = other {
            let is = other.item.kind.keyword();
            let note = format!("this is of another kind: `{is}`");
            let help = format!("write `override {is} {}`", wanted.as_deref().unwrap_or_default());
            return Err(error.beside(other.item.span, note).help(help));
        }
        let alike = standing.iter().filter(|standing| same_kind(&standing.item.kind));
        let names: Vec<String> = alike.filter_map(|standing| name(&standing.item.kind)).collect();
        let near = wanted.as_deref().and_then(|wanted| nearest(wanted, names.iter().map(String::as_str)));
        return Err(match near {
            Some(near) => error.meant(span, near),
            None => error.help("leave out `override`, or `use` the file that declares it"),
        });
    };
    let old = &standing[place];
    let old_span = old.item.kind.name().map_or(old.item.span, |name| name.span);
    if old.file == file {
        let error = error(format!("{what} is declared in this very file")).at(span, "overridden here");
        let error = error.beside(old_span, "declared here");
        return Err(error.help("change the declaration itself, and remove this one"));
    }
    if !uses(files, file, old.file) {
        let error = error(format!("{what} is overridden by two files that do not know each other"));
        let error = error.at(span, "overridden here").beside(old_span, "and here");
        return Err(error.help("let one of the two `use` the other: then its override is the last"));
    }
    Ok(place)
}

/// Whether a file uses the other, directly or through other files.
fn uses(files: &[LoadedFile], from: usize, to: usize) -> bool {
    let mut seen: BTreeSet<PathBuf> = BTreeSet::new();
    let mut open = vec![files[from].path.clone()];
    while let Some(path) = open.pop() {
        if path == files[to].path {
            return true;
        }
        if !seen.insert(path.clone()) {
            continue;
        }
        open.extend(files.iter().filter(|file| file.path == path).flat_map(used_paths));
    }
    false
}
