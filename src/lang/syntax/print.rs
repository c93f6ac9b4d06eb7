//! Prints trees in the one style. If there is a source, its comments are printed too.
//!
//! The printer works by *entries*: an entry begins a line of its own, like a declaration, a
//! parameter, an effect, a field, an arm or a step. Comments that stand before an entry stay before
//! it, a comment at the end of its line stays there, and a comment in the middle of an entry moves
//! before it. One blank line between entries is kept; more are not.

use crate::syntax::ast::{
    Action, ActionParam, Case, ClauseKind, Doc, Effect, EffectKind, Expect, Expr, ExprKind, Field, File,
    FnParam, Initial, InitialKey, Item, ItemKind, Move, Name, ParamMode, Phase, Place, Policy, PolicyLine,
    Require, Rule, RuleBody, Scenario, Span, Spawn, Step, Type, TypeKind,
};
use crate::syntax::layout::{INDENT, Layout, WIDTH};
use crate::syntax::print_expression::{
    arm, braced, call, expression, expression_on_new_line, field, fields, needs_comma, number, patterns,
    quoted,
};
use crate::syntax::scan::Comment;

/// The text of a tree that was built, not read: documentation is in the tree, other comments do not exist. The text reads
/// back to the same tree.
pub fn print(file: &File) -> String {
    print_with(file, "", &[])
}

/// A declaration that was read or built, without its documentation and comments.
pub fn print_item(kind: &ItemKind) -> String {
    let item = Item { docs: Vec::new(), kind: kind.clone(), span: Span::NONE };
    print(&File { items: vec![item], ..File::default() }).trim_end().to_owned()
}

/// An expression in one line.
pub fn print_expr(expr: &Expr) -> String {
    expression(expr).flat()
}

/// The text of a tree that was read from `source`. `comments` are those that are not in the tree, in the
/// order of the source.
pub fn print_with(file: &File, source: &str, comments: &[Comment]) -> String {
    let mut printer =
        Printer { out: String::new(), level: 0, source, comments, limit: source.len(), opened: true };
    printer.file(file);
    printer.out
}

struct Printer<'a> {
    out: String,
    level: usize,
    /// Empty if the tree was built.
    source: &'a str,
    /// Comments that are not printed yet.
    comments: &'a [Comment],
    /// End in the source of the block around the current entry: a later comment stands outside the block.
    limit: usize,
    /// Whether a block has just been opened: no blank line follows.
    opened: bool,
}

impl Printer<'_> {
    fn file(&mut self, file: &File) {
        self.docs("//!", &file.docs);
        for (index, item) in file.items.iter().enumerate() {
            let previous = index.checked_sub(1).map(|previous| &file.items[previous]);
            self.item(item, previous);
        }
        self.comments_before(usize::MAX);
        if !self.out.is_empty() {
            self.out.push('\n');
        }
    }

    /// Begins a line for what stands at `start` in the source.
    fn line(&mut self, start: usize) {
        let blank = !self.opened && self.blank_line_before(start);
        self.plain_line(blank);
    }

    fn plain_line(&mut self, blank_before: bool) {
        if !self.out.is_empty() {
            self.out.push_str(if blank_before { "\n\n" } else { "\n" });
        }
        self.out.extend(std::iter::repeat_n(' ', self.level * INDENT));
        self.opened = false;
    }

    fn blank_line_before(&self, start: usize) -> bool {
        let before = self.source.get(..start).unwrap_or_default();
        let gap = &before[before.trim_end().len()..];
        gap.bytes().filter(|byte| *byte == b'\n').count() > 1
    }

    /// Prints the comments that begin before a place in the source, each on its own line.
    fn comments_before(&mut self, end: usize) {
        while let Some((comment, later)) = self.comments.split_first().filter(|(next, _)| next.start < end) {
            self.comments = later;
            self.line(comment.start);
            let text = &self.source[comment.start..comment.end];
            // Before a declaration it would read as documentation, which it was not within a line or an expression.
            let is_before_declaration = self.level == 0 && end != usize::MAX;
            let is_marked = text.starts_with("///") || text.starts_with("//!");
            if is_marked && (!comment.own_line || is_before_declaration) {
                self.out.extend(["//", text.trim_start_matches(['/', '!'])]);
            } else {
                self.out.push_str(text);
            }
        }
    }

    /// Whether a comment stands between two places in the source.
    fn comment_between(&self, start: usize, end: usize) -> bool {
        self.comments.iter().take_while(|comment| comment.start < end).any(|comment| comment.start >= start)
    }

    /// Prints the comment that ends the line on which an entry ended.
    fn trailing_comment(&mut self, end: usize) {
        let Some((comment, later)) = self.comments.split_first() else { return };
        let same_line = comment.start >= end
            && comment.start < self.limit
            && !self.source[end..comment.start].contains('\n');
        if same_line {
            self.comments = later;
            self.out.push(' ');
            self.out.push_str(&self.source[comment.start..comment.end]);
        }
    }

    /// Prints an entry as a whole, and what ends it.
    fn entry(&mut self, span: Span, layout: &Layout, ending: &str) {
        self.comments_before(span.end);
        self.line(span.start);
        self.put(layout);
        self.words(ending);
        self.trailing_comment(span.end);
    }

    /// Prints an entry that holds entries; `print` writes it, beginning on a new line.
    fn entry_of_entries(&mut self, span: Span, print: impl FnOnce(&mut Self)) {
        self.comments_before(span.start);
        self.line(span.start);
        print(self);
        self.trailing_comment(span.end);
    }

    /// Prints entries in braces, one a line. `end` is where the block ends in the source: comments before
    /// it belong inside.
    fn block(&mut self, end: usize, entries: impl FnOnce(&mut Self)) {
        let limit = std::mem::replace(&mut self.limit, end);
        self.out.push('{');
        self.level += 1;
        self.opened = true;
        entries(self);
        self.opened = false;
        self.comments_before(end);
        self.level -= 1;
        self.limit = limit;
        self.plain_line(false);
        self.out.push('}');
    }

    /// Prints entries in braces, one a line.
    fn lines(&mut self, end: usize, entries: impl IntoIterator<Item = (Span, Layout)>) {
        self.block(end, |printer| {
            for (span, layout) in entries {
                printer.entry(span, &layout, "");
            }
        });
    }

    /// Prints entries in braces, on one line if they fit and none has a comment of its own; gives whether it is one line.
    fn braced(&mut self, span: Span, entries: Vec<(Span, Layout)>) -> bool {
        let layout = braced(entries.iter().map(|(_, entry)| entry.clone()));
        let is_one_line = !self.comment_between(span.start, span.end) && self.fits(&layout);
        match is_one_line {
            true => self.words(&layout.flat()),
            false => self.lines(span.end, entries),
        }
        is_one_line
    }

    /// Prints a layout from the current column on.
    fn put(&mut self, layout: &Layout) {
        let text = layout.render(self.level * INDENT, self.column());
        self.out.push_str(&text);
    }

    fn column(&self) -> usize {
        let line = self.out.rfind('\n').map_or(0, |newline| newline + 1);
        self.out[line..].chars().count()
    }

    /// Whether the layout fits on the rest of the line.
    fn fits(&self, layout: &Layout) -> bool {
        self.column() + layout.flat().chars().count() <= WIDTH
    }

    fn docs(&mut self, marker: &str, docs: &[Doc]) {
        for doc in docs {
            // The text of a tree that was built may hold line breaks: what follows one must not become code.
            for line in doc.text.split('\n') {
                self.line(doc.span.start);
                let text = format!("{marker} {line}");
                self.out.push_str(text.trim_end());
            }
        }
    }

    fn item(&mut self, item: &Item, previous: Option<&Item>) {
        // A blank line separates declarations that were built, unless both are short and of one
        // kind.
        let short = |item: &Item| item.docs.is_empty() && one_line(&item.kind);
        let together = |previous: &Item| {
            short(previous) && short(item) && previous.kind.keyword() == item.kind.keyword()
                || matches!((&previous.kind, &item.kind), (ItemKind::Language(_), ItemKind::Use(_)))
        };
        let apart = self.source.is_empty() && previous.is_some_and(|previous| !together(previous));
        if apart {
            self.out.push('\n');
        }
        let whole = one_line(&item.kind) && !self.is_annotated_list(&item.kind, item.span);
        self.comments_before(if whole { item.span.end } else { item.span.start });
        self.docs("///", &item.docs);
        self.line(item.span.start);
        self.declaration(&item.kind, item.span);
        self.trailing_comment(item.span.end);
    }

    fn declaration(&mut self, kind: &ItemKind, span: Span) {
        match kind {
            ItemKind::Override(inner) => {
                self.words("override ");
                self.declaration(inner, span);
            }
            ItemKind::Language(version) => self.words(&format!("language {}", number(version))),
            ItemKind::Use(used) => {
                self.words(&format!("use {}", quoted(&used.path.value)));
                if let Some(digest) = &used.digest {
                    self.words(&format!(" digest {}", quoted(&digest.value)));
                }
                if !used.without.is_empty() {
                    self.put(&separated(" without", ",", &used.without));
                }
            }
            ItemKind::Enum(item) => {
                let separator = if item.ordered { "<" } else { "|" };
                let head = format!("enum {} =", item.name.text);
                self.list(&head, separator, &item.variants, span);
            }
            ItemKind::Odds(item) => {
                self.words(&format!("odds {} ", item.name.text));
                self.lines(span.end, item.arms.iter().map(|line| (line.span, arm(line))));
            }
            ItemKind::State(item) => {
                self.words(&format!("state {}: {} =", item.name.text, type_text(&item.ty)));
                match &item.initial {
                    Initial::Any => self.words(" any"),
                    Initial::Value(value) => self.value(value),
                    Initial::Keys(keys) => {
                        self.words(" ");
                        self.braced(span, keys.iter().map(|key| (key.span, initial_key(key))).collect());
                    }
                }
            }
            ItemKind::Let(item) => {
                self.words(&format!("let {} =", item.name.text));
                self.value(&item.value);
            }
            ItemKind::Fn(item) => {
                self.words(&format!("fn {}", item.name.text));
                self.put(&Layout::row([
                    fn_params(&item.params),
                    Layout::text(format!(" -> {} =", type_text(&item.result))),
                ]));
                self.value(&item.body);
            }
            ItemKind::Manoeuvre(item) => {
                self.words(&format!("manoeuvre {}", item.name.text));
                let repeat = item
                    .repeat
                    .iter()
                    .flat_map(|times| [Layout::text("repeat "), expression(times), Layout::text(" ")]);
                self.put(&Layout::row(
                    [fn_params(&item.params), Layout::text(" ")].into_iter().chain(repeat),
                ));
                self.block(span.end, |printer| {
                    item.phases.iter().for_each(|of| printer.entry(of.span, &phase(of), ""));
                });
            }
            ItemKind::Action(item) => self.action(item, span),
            ItemKind::Group(item) => {
                let head = format!("group {} =", item.name.text);
                self.list(&head, ",", &item.members, span);
            }
            ItemKind::Also(item) => {
                self.sets(&format!("on {} also ", names(&item.on, ", ")), &item.effects, span);
            }
            ItemKind::EachStep(effects) => self.sets("each step ", effects, span),
            ItemKind::Rule(item) => self.rule(item, span),
            ItemKind::Require(item) => self.require(item),
            ItemKind::Body(item) => {
                self.words(&format!("body {} ", item.name.text));
                self.braced(span, field_entries(&item.fields).collect());
            }
            ItemKind::Trajectory(item) => {
                self.words(&format!("trajectory {} ", item.name.text));
                self.lines(span.end, field_entries(&item.fields));
            }
            ItemKind::Road(item) => {
                self.words(&format!("road {} ", item.name.text));
                self.lines(span.end, field_entries(&item.fields));
            }
            ItemKind::Episode(entries) => {
                self.words("episode ");
                self.lines(span.end, field_entries(entries));
            }
            ItemKind::Reward(cases) => {
                self.words("reward ");
                let line = |case: &Case| {
                    let condition = case.condition.as_ref().map_or(Layout::text("_"), expression_on_new_line);
                    Layout::row([condition, Layout::text(" => "), expression(&case.value)])
                };
                self.lines(span.end, cases.iter().map(|case| (case.span, line(case))));
            }
            ItemKind::Verdict(item) => {
                self.words(&format!("verdict {}:", item.name.text));
                self.value(&item.condition);
            }
            ItemKind::Expect(item) => self.put(&expect(item)),
            ItemKind::Scenario(item) => self.scenario(item, span),
            ItemKind::Policy(item) => self.policy(item, span),
        }
    }

    /// Whether the names of an `enum` or a `group` carry comments, so that each needs its own line.
    fn is_annotated_list(&self, kind: &ItemKind, span: Span) -> bool {
        matches!(kind.plain(), ItemKind::Enum(_) | ItemKind::Group(_))
            && self.comment_between(span.start, span.end)
    }

    /// `head A | B`: on one line if it fits and no name has a comment of its own.
    fn list(&mut self, head: &str, separator: &str, names: &[Name], span: Span) {
        if !self.comment_between(span.start, span.end) {
            return self.put(&separated(head, separator, names));
        }
        self.words(head);
        self.level += 1;
        self.opened = true;
        for (index, name) in names.iter().enumerate() {
            let last = index + 1 == names.len();
            let text = match separator {
                "," if last => name.text.clone(),
                "," => format!("{},", name.text),
                _ if index == 0 => name.text.clone(),
                _ => format!("{separator} {}", name.text),
            };
            self.comments_before(name.span.end);
            // Where the separator comes first, a blank line between it and the name would not be found again.
            match separator {
                "," => self.line(name.span.start),
                _ => self.plain_line(false),
            }
            self.words(&text);
            if !last {
                self.trailing_comment(name.span.end);
            }
        }
        self.level -= 1;
    }

    fn words(&mut self, words: &str) {
        self.out.push_str(words);
    }

    /// Prints the expression after `=` or `:` of a declaration. The arms of a `match` open on that line;
    /// another expression goes to the next line if it does not fit.
    fn value(&mut self, value: &Expr) {
        if let ExprKind::Match { .. } = &value.kind {
            self.words(" ");
            return self.arms(value);
        }
        self.put(&Layout::group([Layout::nest([Layout::Line(" "), expression(value)])]));
    }

    fn arms(&mut self, value: &Expr) {
        let ExprKind::Match { subject, arms } = &value.kind else {
            return self.put(&expression(value));
        };
        self.words("match ");
        self.put(&expression(subject));
        self.words(" ");
        self.block(value.span.end, |printer| {
            for (at, arm) in arms.iter().enumerate() {
                printer.entry_of_entries(arm.span, |printer| {
                    printer.words(&format!("{} => ", patterns(arm)));
                    printer.arms(&arm.value);
                    if needs_comma(arms, at) {
                        printer.words(",");
                    }
                });
            }
        });
    }

    fn action(&mut self, item: &Action, span: Span) {
        self.words(&format!("action {}", item.name.text));
        let head = Layout::row([Layout::listed("(", item.params.iter().map(param), ")"), Layout::text(" ")]);
        let body_start = item.params.last().map_or(span.start, |last| last.span.end);
        let commented = self.comment_between(span.start, body_start);
        if self.one_set(&head, &item.effects, span) {
            return;
        }
        let brace = Layout::row([head.clone(), Layout::text("{")]);
        if !commented && self.fits(&brace) {
            self.words(&head.flat());
        } else {
            self.params(&item.params, body_start);
        }
        self.effects(&item.effects, span);
    }

    fn sets(&mut self, head: &str, effects: &[Effect], span: Span) {
        if !self.one_set(&Layout::text(head), effects, span) {
            self.words(head);
            self.effects(effects, span);
        }
    }

    /// Prints `head { set … }` if it is one `set`, fits on the line and has no comment; gives whether it was printed.
    fn one_set(&mut self, head: &Layout, effects: &[Effect], span: Span) -> bool {
        let [only @ Effect { kind: EffectKind::Set { .. }, .. }] = effects else { return false };
        let layout = Layout::row([head.clone(), Layout::text("{ "), effect(only), Layout::text(" }")]);
        let is_printed = !self.comment_between(span.start, span.end) && self.fits(&layout);
        if is_printed {
            self.words(&layout.flat());
        }
        is_printed
    }

    /// Effects in braces, one a line.
    fn effects(&mut self, effects: &[Effect], span: Span) {
        self.block(span.end, |printer| {
            for step in effects {
                match &step.kind {
                    EffectKind::Set { state, key, value } if matches!(value.kind, ExprKind::Match { .. }) => {
                        printer.entry_of_entries(step.span, |printer| {
                            printer.put(&assigned(state, key.as_deref()));
                            printer.value(value);
                        });
                    }
                    _ => printer.entry(step.span, &effect(step), ""),
                }
            }
        });
    }

    fn params(&mut self, params: &[ActionParam], end: usize) {
        let limit = std::mem::replace(&mut self.limit, self.source.len());
        self.words("(");
        self.level += 1;
        self.opened = true;
        for each in params {
            self.entry(each.span, &param(each), ",");
        }
        self.opened = false;
        self.comments_before(end);
        self.level -= 1;
        self.limit = limit;
        self.plain_line(false);
        self.words(") ");
    }

    fn rule(&mut self, item: &Rule, span: Span) {
        if item.optional {
            self.words("optional ");
        }
        self.words(&format!("rule {}", item.name.text));
        match &item.body {
            RuleBody::Holds { on, during, condition } => {
                if !on.is_empty() {
                    self.words(&format!(" on {}", names(on, ", ")));
                }
                if let Some(during) = during {
                    self.words(&format!(" during {}", during.text));
                }
                self.words(":");
                self.value(condition);
            }
            RuleBody::Moves { state, key, moves } => {
                let key = key.as_ref().map_or(String::new(), |key| format!("[{}]", key.text));
                self.words(&format!(" on {}{key} ", state.text));
                let line =
                    |step: &Move| Layout::text(format!("{} -> {}", step.from.text, names(&step.to, " | ")));
                self.lines(span.end, moves.iter().map(|step| (step.span, line(step))));
            }
        }
    }

    fn require(&mut self, item: &Require) {
        if item.optional {
            self.words("optional ");
        }
        self.words(&format!("require {}", item.name.text));
        if !item.on.is_empty() {
            self.words(&format!(" on {}", names(&item.on, ", ")));
        }
        let clauses = [("when", &item.when), ("until", &item.until), ("after", &item.after)];
        let clauses = clauses.into_iter().filter_map(|(word, part)| {
            let part = expression(part.as_ref()?);
            Some(Layout::row([Layout::Line(" "), Layout::text(format!("{word} ")), part]))
        });
        let mut parts: Vec<Layout> = clauses.collect();
        if parts.is_empty() || matches!(item.condition.kind, ExprKind::Match { .. }) {
            self.put(&Layout::group([Layout::nest(parts)]));
            self.words(":");
            self.value(&item.condition);
        } else {
            // Clauses too long for one line have a line each, and the condition has one, too.
            parts.extend([Layout::text(":"), Layout::Line(" "), expression(&item.condition)]);
            self.put(&Layout::group([Layout::nest(parts)]));
        }
        if let Some(unless) = &item.unless {
            let parts = [Layout::Line(" "), Layout::text("unless "), expression(unless)];
            self.put(&Layout::group([Layout::nest(parts)]));
        }
        if let Some(within) = &item.within {
            self.words(" within ");
            self.put(&expression(within));
        }
    }

    /// `origin { … }` in a block: on one line if it fits, absent if it is empty.
    fn section(&mut self, keyword: &str, entries: &[Field]) {
        let (Some(first), Some(last)) = (entries.first(), entries.last()) else { return };
        let span = first.span.to(last.span);
        // Comments before the first field, or inside it, move above the section.
        self.comments_before(first.span.end);
        self.plain_line(false);
        self.words(&format!("{keyword} "));
        if self.braced(span, field_entries(entries).collect()) {
            self.trailing_comment(span.end);
        }
    }

    fn scenario(&mut self, item: &Scenario, span: Span) {
        self.words(&format!("scenario {} ", item.name.text));
        self.block(span.end, |printer| {
            printer.section("origin", &item.origin);
            printer.comments_before(item.road.span.end);
            printer.plain_line(false);
            printer.words(&format!("road: {}", item.road.text));
            printer.trailing_comment(item.road.span.end);
            printer.section("start", &item.start);
            printer.plain_line(false);
            printer.words("steps ");
            match item.steps.last() {
                None => printer.words("{}"),
                Some(last) => {
                    printer.lines(last.span.end, item.steps.iter().map(|each| (each.span, step(each))));
                }
            }
            for each in &item.expects {
                printer.entry(each.span, &expect(each), "");
            }
        });
    }

    fn policy(&mut self, item: &Policy, span: Span) {
        self.words(&format!("policy {} ", item.name.text));
        self.block(span.end, |printer| {
            printer.section("origin", &item.origin);
            printer.section("net", &item.net);
            printer.section("claims", &item.claims);
            let Some(last) = item.rules.last() else { return };
            printer.plain_line(false);
            printer.words("rules ");
            printer.lines(last.span.end, item.rules.iter().map(|each| (each.span, policy_line(each))));
        });
    }
}

/// Whether a declaration holds no entries of its own.
fn one_line(kind: &ItemKind) -> bool {
    let plain = |value: &Expr| !matches!(value.kind, ExprKind::Match { .. });
    match kind.plain() {
        ItemKind::Language(_) | ItemKind::Use(_) | ItemKind::Enum(_) | ItemKind::Group(_) => true,
        ItemKind::State(item) => match &item.initial {
            Initial::Any => true,
            Initial::Value(value) => plain(value),
            Initial::Keys(_) => false,
        },
        ItemKind::Let(item) => plain(&item.value),
        ItemKind::Fn(item) => plain(&item.body),
        ItemKind::Rule(item) => {
            matches!(&item.body, RuleBody::Holds { condition, .. } if plain(condition))
        }
        ItemKind::Require(item) => item.parts().all(plain),
        ItemKind::Verdict(item) => plain(&item.condition),
        ItemKind::Expect(_) => true,
        ItemKind::Action(_)
        | ItemKind::Manoeuvre(_)
        | ItemKind::Also(_)
        | ItemKind::EachStep(_)
        | ItemKind::Odds(_)
        | ItemKind::Body(_)
        | ItemKind::Trajectory(_)
        | ItemKind::Road(_)
        | ItemKind::Episode(_)
        | ItemKind::Reward(_)
        | ItemKind::Scenario(_)
        | ItemKind::Override(_)
        | ItemKind::Policy(_) => false,
    }
}

fn names(names: &[Name], separator: &str) -> String {
    names.iter().map(|name| name.text.as_str()).collect::<Vec<_>>().join(separator)
}

fn field_entries(fields: &[Field]) -> impl Iterator<Item = (Span, Layout)> {
    fields.iter().map(|entry| (entry.span, field(entry)))
}

/// `head A | B`, or one name a line.
fn separated(head: &str, separator: &str, names: &[Name]) -> Layout {
    let mut inside = Vec::new();
    for (index, name) in names.iter().enumerate() {
        match (index, separator) {
            (0, _) => inside.push(Layout::Line(" ")),
            (_, ",") => inside.extend([Layout::text(","), Layout::Line(" ")]),
            _ => inside.extend([Layout::Line(" "), Layout::text(format!("{separator} "))]),
        }
        inside.push(Layout::text(&name.text));
    }
    Layout::group([Layout::text(head), Layout::nest(inside)])
}

fn type_text(ty: &Type) -> String {
    match &ty.kind {
        TypeKind::Named(name) => name.text.clone(),
        TypeKind::Map { key, value } => format!("{} -> {}", key.text, value.text),
    }
}

fn initial_key(key: &InitialKey) -> Layout {
    let name = key.key.as_ref().map_or("_", |name| name.text.as_str());
    let value = key.value.as_ref().map_or(Layout::text("any"), expression);
    Layout::row([Layout::text(format!("{name}: ")), value])
}

fn param(param: &ActionParam) -> Layout {
    let mode = match param.mode {
        ParamMode::Each => "each",
        ParamMode::Any => "any",
    };
    let mut parts = vec![Layout::text(format!("{mode} {}: {}", param.name.text, type_text(&param.ty)))];
    for (word, value) in [("in", &param.within), ("where", &param.condition)] {
        if let Some(value) = value {
            parts.extend([Layout::text(format!(" {word} ")), expression(value)]);
        }
    }
    Layout::Row(parts)
}

/// `set state[key] =`.
fn assigned(state: &Name, key: Option<&Expr>) -> Layout {
    let key = key.map_or(Layout::Row(Vec::new()), |key| {
        Layout::row([Layout::text("["), expression(key), Layout::text("]")])
    });
    Layout::row([Layout::text(format!("set {}", state.text)), key, Layout::text(" =")])
}

fn effect(effect: &Effect) -> Layout {
    match &effect.kind {
        EffectKind::Set { state, key, value } => Layout::group([
            assigned(state, key.as_deref()),
            Layout::nest([Layout::Line(" "), expression(value)]),
        ]),
        EffectKind::Order { who, fields: entries } => {
            Layout::row([Layout::text(format!("order {} ", who.text)), fields(entries)])
        }
        EffectKind::Spawn(spawn) => {
            let Spawn { body, bearers, place, distance, of, apart, cover, fields: entries } = &**spawn;
            let mut parts = vec![Layout::text("spawn "), expression(body)];
            let names: Vec<&str> = bearers.iter().map(|name| name.text.as_str()).collect();
            match names[..] {
                [] => {}
                [name] => parts.push(Layout::text(format!(" as {name}"))),
                _ => parts.push(Layout::text(format!(" as [{}]", names.join(", ")))),
            }
            match place {
                Place::Ahead => parts.push(Layout::text(" ahead ")),
                Place::Behind => parts.push(Layout::text(" behind ")),
                Place::On(trajectory) => {
                    parts.extend([Layout::text(" on "), expression(trajectory), Layout::text(" at ")]);
                }
                Place::Along { trajectory, behind } => {
                    let side = if *behind { " behind " } else { " ahead " };
                    parts.extend([Layout::text(" on "), expression(trajectory), Layout::text(side)]);
                }
            }
            parts.push(expression(distance));
            if let Some(of) = of {
                parts.push(Layout::text(format!(" of {}", of.text)));
            }
            if let Some(apart) = apart {
                parts.extend([Layout::text(" apart "), expression(apart)]);
            }
            if let Some(cover) = cover {
                parts.extend([Layout::text(" from behind "), expression(cover)]);
            }
            parts.extend([Layout::text(" "), fields(entries)]);
            Layout::Row(parts)
        }
    }
}

fn fn_params(params: &[FnParam]) -> Layout {
    let param = |param: &FnParam| Layout::text(format!("{}: {}", param.name.text, type_text(&param.ty)));
    Layout::listed("(", params.iter().map(param), ")")
}

fn phase(phase: &Phase) -> Layout {
    let mut parts = Vec::new();
    let Phase { once, held, within, after, only_if, .. } = phase;
    for (keyword, clause) in
        [("once ", once), ("for ", held), ("within ", within), ("after ", after), ("if ", only_if)]
    {
        parts.extend(
            clause.iter().flat_map(|clause| [Layout::text(keyword), expression(clause), Layout::text(" ")]),
        );
    }
    parts.push(fields(&phase.fields));
    Layout::Row(parts)
}

fn expect(expect: &Expect) -> Layout {
    let mut parts = vec![Layout::text("expect "), expression(&expect.claim)];
    for clause in &expect.clauses {
        let word = match clause.kind {
            ClauseKind::With => " with ",
            ClauseKind::At => " at ",
            ClauseKind::By => " by ",
        };
        parts.extend([Layout::text(word), expression(&clause.value)]);
    }
    Layout::Row(parts)
}

fn step(step: &Step) -> Layout {
    let mut parts = vec![Layout::text(format!("{}: ", number(&step.number))), call(&step.action)];
    if !step.drawn.is_empty() {
        parts.extend([Layout::text(" with "), fields(&step.drawn)]);
    }
    for (keyword, clause) in [(" once ", &step.once), (" for ", &step.held), (" after ", &step.after)] {
        parts.extend(clause.iter().flat_map(|clause| [Layout::text(keyword), expression(clause)]));
    }
    Layout::Row(parts)
}

fn policy_line(line: &PolicyLine) -> Layout {
    let condition = match &line.condition {
        None => Layout::text("_"),
        Some(condition) => Layout::row([Layout::text("when "), expression(condition)]),
    };
    let mut actions = Vec::new();
    for (at, action) in line.actions.iter().enumerate() {
        actions.extend([Layout::Line(" "), Layout::text(if at == 0 { "" } else { "| " }), call(action)]);
    }
    Layout::group([condition, Layout::text(" =>"), Layout::nest(actions)])
}
