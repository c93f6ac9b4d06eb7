//! Requirements: what the ego vehicle must keep.

use crate::check::checker::{Checker, Required};
use crate::check::expression::Place;
use crate::check::mistakes::{Report, with_value};
use crate::check::names::docs;
use crate::check::names::flat;
use crate::check::references::Symbol;
use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::requirement::{margin_dimension, open_divisor, past_inside};
use crate::model::vocabulary::{BEGINS, BREACHED, EVENTS, MARGIN, NearWord, PastWord, Site, Word, things};
use crate::model::{BodyWord, RequirementDef, RuleDef, TICK_MS, Type, code};
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast, print_item};
use avastra_base::units::{Dimension, Rational};

/// The most requirements of a space: a set of them fits one integer, and each is judged at every tick.
const REQUIREMENTS_MAX: usize = 64;

/// The longest `within`, s: that of an observation period.
const WITHIN_S_MAX: i64 = 600;

impl Checker {
    /// All requirements. `--with` and `--without` name them as they do rules, so no rule has the name of one.
    pub(super) fn requirements(&mut self, items: &[&ast::Item], rules: &[RuleDef]) -> Vec<RequirementDef> {
        let mut requirements = Vec::new();
        let (names, all) = self.declared("requirement", items, ItemKind::as_require);
        self.required = Some(Required { names, margins: Vec::new() });
        if let Some((_, first)) = all.get(REQUIREMENTS_MAX) {
            let message = format!("more than {REQUIREMENTS_MAX} requirements");
            let error = Diagnostic::error(code::TOO_MUCH, message).at(first.name.span, "one too many");
            self.report(
                error.help("join some by `and`, or leave out those of a used file by `use … without`"),
            );
        }
        for (item, declared) in all {
            if let Some(rule) = rules.iter().find(|rule| rule.name == declared.name.text) {
                let message = format!("`{}` is a rule and a requirement", rule.name);
                let error = Diagnostic::error(code::DUPLICATE, message).at(declared.name.span, "again here");
                let error = error.beside(rule.span, "first here");
                self.report(error.help("rename one of them: `--without` switches both kinds off by name"));
            }
            let requirement = self.requirement(item, declared);
            let margin = requirement.as_ref().map(|of| (of.name.clone(), of.margin));
            if let Some(required) = &mut self.required {
                required.margins.extend(margin);
            }
            requirements.extend(requirement);
        }
        requirements
    }

    pub(super) fn requirement(
        &mut self,
        item: &ast::Item,
        declared: &ast::Require,
    ) -> Option<RequirementDef> {
        if EVENTS.contains(&declared.name.text.as_str()) {
            let message = format!("no requirement is called `{}`", declared.name.text);
            let error = Diagnostic::error(code::DUPLICATE, message).at(declared.name.span, "taken");
            self.report(
                error.help("`avastra estimate --event` has another meaning for that word: rename it"),
            );
        }
        let on = declared.on.iter().map(|name| self.bodies_named(&name.text, name.span));
        let on: Vec<Option<Vec<BodyWord>>> = on.collect();
        for (at, name) in declared.on.iter().enumerate() {
            if let Some(first) = declared.on[..at].iter().find(|first| first.text == name.text) {
                let message = format!("the body `{}` is named twice", name.text);
                let error = Diagnostic::error(code::DUPLICATE, message).at(name.span, "again here");
                self.report(error.beside(first.span, "first here").help("name it once"));
            }
        }
        let site = if declared.on.is_empty() { Site::Requirement } else { Site::RequirementOn };
        let place = Place { states: true, site, ..Place::default() };
        let mut part = |part: &Option<ast::Expr>| match part {
            None => Some(None),
            Some(part) => self.condition(part, &place).map(Some),
        };
        let (when, until, after) = (part(&declared.when), part(&declared.until), part(&declared.after));
        let unless = part(&declared.unless);
        let condition = self.condition(&declared.condition, &place);
        let within_ticks = match &declared.within {
            None => Some(0),
            Some(within) => self.ticks(within, "leave `within` out to judge every moment by itself"),
        };
        let (when, until, after, condition, unless) = (when?, until?, after?, condition?, unless?);
        if let Some(divisor) = open_divisor(&condition, &self.functions) {
            let message = format!("`{}` divides by what may be 0", declared.name.text);
            let error = Diagnostic::error(code::OPEN_DIVISOR, message).at(divisor.span, "may be 0");
            let error = match divisor.span.file == condition.span.file
                && (condition.span.start..condition.span.end).contains(&divisor.span.start)
            {
                true => error,
                false => error.beside(condition.span, "calls it"),
            };
            let help = "multiply the other side instead: `ego.lead_gap >= 0.8 s * ego.speed`";
            return self.reject(error.help(help));
        }
        let all = || when.iter().chain(&until).chain(&after).chain([&condition]).chain(&unless);
        let mut bearers: Vec<usize> = all().flat_map(|expr| expr.bearers(0)).collect();
        bearers.sort_unstable();
        bearers.dedup();
        // A requirement that reads `truck.there` needs an answer while the truck is absent, too.
        let is_needed = |who: &usize| {
            let asks = |kind: &ExprKind| matches!(kind, ExprKind::IsThere(of) if of.bearers(0).contains(who));
            !all().any(|expr| expr.any(asks))
        };
        let needed = bearers.iter().copied().filter(is_needed).collect();
        Some(RequirementDef {
            name: declared.name.text.clone(),
            docs: docs(item),
            formula: flat(&print_item(&item.kind)),
            optional: declared.optional,
            on: on.into_iter().collect::<Option<Vec<_>>>()?.concat(),
            margin: margin_dimension(&condition),
            when,
            until,
            after,
            condition,
            unless,
            within_ticks: within_ticks?,
            bearers,
            needed,
            span: declared.name.span,
        })
    }

    /// `stops_at_red.breached` in a reward or verdict, `stops_at_red.margin` in a reward; `None` if this is no requirement.
    pub(super) fn part_of_requirement(
        &mut self,
        base: &ast::Expr,
        part: &ast::Name,
        place: &Place<'_>,
        span: Span,
    ) -> Option<Option<Expr>> {
        let ast::ExprKind::Name(name) = &base.kind else { return None };
        // A requirement that is called `ego` takes nothing from the ego vehicle.
        let required = self.required.as_ref().filter(|_| !things().contains(&name.as_str()))?;
        let index = required.names.get(name)?;
        self.references.uses(base.span, Symbol::Requirement(name.clone()));
        let (known, sites) = match part.text.as_str() {
            word if word == BREACHED.0 => {
                (BREACHED, "only rewards, verdicts, and claims of scenarios, see it")
            }
            word if word == MARGIN.0 => (MARGIN, "only rewards see it"),
            _ => {
                let message = format!("unknown fact of a requirement `{}`", part.text);
                let error = Diagnostic::error(code::UNKNOWN, message).at(part.span, "not known");
                let help = format!("write `{name}.{}` or `{name}.{}`", BREACHED.0, MARGIN.0);
                return Some(self.reject(error.help(help)));
            }
        };
        self.references.note(part.span, Symbol::Engine(known.0, known.1), false);
        let is_margin = known == MARGIN;
        if place.site != Site::Reward && (is_margin || place.site != Site::Verdict) {
            let message = format!("`{name}.{}` is not known here", part.text);
            let error = Diagnostic::error(code::NOT_HERE, message);
            return Some(self.reject(error.at(span, sites)));
        }
        if !is_margin {
            return Some(Some(Expr { kind: ExprKind::Breached(index), ty: Type::Bool, span }));
        }
        // A requirement with a mistake in it has none yet.
        let margins = self.required.iter().flat_map(|required| &required.margins);
        let Some(dimension) = margins.into_iter().find(|(of, _)| of == name).map(|(_, dimension)| *dimension)
        else {
            return Some(None);
        };
        let Some(dimension) = dimension else {
            let message = format!("`{name}` has no margin");
            let error =
                Diagnostic::error(code::NOT_HERE, message).at(span, "words and `==` have no distance");
            return Some(self.reject(error.help(format!("ask for `{name}.{}`", BREACHED.0))));
        };
        Some(Some(Expr { kind: ExprKind::Margin(index), ty: Type::Quantity(dimension), span }))
    }

    /// A condition of a requirement.
    fn condition(&mut self, condition: &ast::Expr, place: &Place<'_>) -> Option<Expr> {
        let found = self.typed(condition, place, Type::Bool)?;
        let Some(inside) = past_inside(&found) else { return Some(found) };
        let message = "what was cannot be asked inside of this";
        let error = Diagnostic::error(code::NOT_HERE, message).at(inside.span, "within something else");
        self.reject(error.help(
            "it may stand in `and`, `or`, `not`, `implies`, comparisons and arithmetic: not in functions, `match`, `some` and `count`",
        ))
    }

    /// `recently(npc.gap <= 5 m, 2 s)`: whether a condition held at some moment of the last seconds, or at each of them.
    /// Also how long in all and how often, or by how much a number has changed.
    pub(super) fn past(&mut self, word: PastWord, call: &ast::Call, place: &Place<'_>) -> Option<Expr> {
        let name = word.name();
        self.references.note(call.name.span, Symbol::Engine(name, word.meaning()), false);
        if !place.site.is_requirement() {
            let error = Diagnostic::error(code::NOT_HERE, format!("`{name}` cannot be asked here"));
            return self.reject(error.at(call.span, "only requirements remember what was"));
        }
        let (wants, example) = match word {
            PastWord::Ago => {
                ("number or a condition", format!("write what and when: `{name}(ego.speed, 2 s)`"))
            }
            PastWord::Change | PastWord::Mean => {
                ("number", format!("write a number and a time: `{name}(ego.acceleration, 0.5 s)`"))
            }
            PastWord::Recently | PastWord::Throughout | PastWord::Total | PastWord::Times => {
                ("condition", format!("write a condition and a time: `{name}(nearest.gap <= 5 m, 2 s)`"))
            }
        };
        let [ast::Arg { name: None, value: condition }, ast::Arg { name: None, value: time }] =
            call.args.as_slice()
        else {
            let message = format!("`{name}` takes a {wants} and a time");
            let error = Diagnostic::error(code::ARGUMENTS, message).at(call.span, "");
            return self.reject(error.help(example));
        };
        let of = match word {
            PastWord::Ago => self.expr(condition, place, None),
            PastWord::Change | PastWord::Mean => self.numeric(condition, place),
            PastWord::Recently | PastWord::Throughout | PastWord::Total | PastWord::Times => {
                self.typed(condition, place, Type::Bool)
            }
        };
        let ticks = self.ticks(time, &example);
        let of = of?;
        if let Type::Enum(_) = of.ty {
            let message = format!("`{name}` takes a {wants} and a time");
            let error = Diagnostic::error(code::TYPE_MISMATCH, message).at(of.span, "a word");
            return self.reject(error.help("compare it: `ago(time == Night, 2 s)`"));
        }
        let ty = match word {
            PastWord::Mean if of.ty == Type::Int => Type::Quantity(Dimension::RATIO),
            PastWord::Recently | PastWord::Throughout | PastWord::Change | PastWord::Mean | PastWord::Ago => {
                of.ty
            }
            PastWord::Total => Type::Quantity(Dimension::DURATION),
            PastWord::Times => Type::Int,
        };
        Some(Expr { kind: ExprKind::Past(Box::new(of), word, ticks?), ty, span: call.span })
    }

    /// `begins(ego.light == Red)`: as `times(ego.light == Red, 20 ms) == 1`.
    pub(super) fn begins(&mut self, call: &ast::Call, place: &Place<'_>) -> Option<Expr> {
        self.references.note(call.name.span, Symbol::Engine(BEGINS.0, BEGINS.1), false);
        if !place.site.is_requirement() {
            let error = Diagnostic::error(code::NOT_HERE, "`begins` cannot be asked here");
            return self.reject(error.at(call.span, "only requirements remember what was"));
        }
        let [ast::Arg { name: None, value: condition }] = call.args.as_slice() else {
            let error = Diagnostic::error(code::ARGUMENTS, "`begins` takes a condition").at(call.span, "");
            return self.reject(error.help("write `begins(ego.light == Red)`"));
        };
        let of = self.typed(condition, place, Type::Bool)?;
        let whole = |kind| Box::new(Expr { kind, ty: Type::Int, span: call.span });
        let times = whole(ExprKind::Past(Box::new(of), PastWord::Times, 1));
        let once = whole(ExprKind::Number(Rational::integer(1)));
        Some(Expr {
            kind: ExprKind::Compare(Comparison::Equal, times, once),
            ty: Type::Bool,
            span: call.span,
        })
    }

    /// `some(Pedestrian, npc.gap <= 5 m)`, `some([Bicycle, Motorcycle], …)`, `some(npc.gap <= 5 m)`: whether a condition
    /// holds of a road user near; and `count` of how many.
    pub(super) fn near(&mut self, word: NearWord, call: &ast::Call, place: &Place<'_>) -> Option<Expr> {
        let name = word.name();
        let help = format!("write `{name}(Pedestrian, npc.gap <= 5 m)`");
        self.references.note(call.name.span, Symbol::Engine(name, word.meaning()), false);
        if !place.site.is_requirement() {
            let error = Diagnostic::error(code::NOT_HERE, format!("`{name}` cannot be asked here"));
            return self.reject(error.at(call.span, "only requirements look at each road user near"));
        }
        let (bodies, condition) = match call.args.as_slice() {
            [ast::Arg { name: None, value }] => (Vec::new(), value),
            [ast::Arg { name: None, value: bodies }, ast::Arg { name: None, value }] => {
                let named = match &bodies.kind {
                    ast::ExprKind::List(items) if !items.is_empty() => items.iter().collect(),
                    _ => vec![bodies],
                };
                let body = |named: &ast::Expr| match &named.kind {
                    ast::ExprKind::Name(name) => self.bodies_named(name, named.span),
                    _ => {
                        let error =
                            Diagnostic::error(code::TYPE_MISMATCH, format!("`{name}` is about bodies"));
                        self.reject(error.at(named.span, "no name of one").help(&help))
                    }
                };
                (named.into_iter().map(body).collect::<Option<Vec<_>>>()?.concat(), value)
            }
            _ => {
                let message = format!("`{name}` takes bodies and a condition, or a condition alone");
                return self.reject(Diagnostic::error(code::ARGUMENTS, message).at(call.span, "").help(help));
            }
        };
        let place = Place { site: Site::RequirementOn, ..*place };
        let condition = self.typed(condition, &place, Type::Bool)?;
        // The inner one would hide the road user of the outer one, and look at all of them for each.
        if condition.any(|kind| matches!(kind, ExprKind::Near(..))) {
            let error = Diagnostic::error(code::NOT_HERE, format!("`{name}` is not asked of each road user"));
            return self
                .reject(error.at(condition.span, "asks of them all").help("ask beside it, joined by `and`"));
        }
        let ty = if word == NearWord::Some { Type::Bool } else { Type::Int };
        Some(Expr { kind: ExprKind::Near(word, bodies, Box::new(condition)), ty, span: call.span })
    }

    /// How many ticks a time lasts: a part of a tick is one more.
    fn ticks(&mut self, time: &ast::Expr, help: &str) -> Option<u32> {
        let found = self.typed(time, &Place::default(), Type::Quantity(Dimension::DURATION))?;
        let exact_s = self.fold_number(&found)?;
        let ticks = exact_s.checked_mul(Rational::new(1000, TICK_MS.into())?);
        let is_possible =
            |ticks: &Rational| *ticks >= Rational::integer(1) && exact_s <= Rational::integer(WITHIN_S_MAX);
        match ticks.filter(is_possible) {
            Some(ticks) => Some(ticks.to_f64().ceil() as u32),
            None => {
                let message = format!("a requirement cannot wait {}", with_value(time, exact_s, "s"));
                let error = Diagnostic::error(code::SETTING, message);
                let wanted = format!("must be at least a tick of {TICK_MS} ms and at most {WITHIN_S_MAX} s");
                self.reject(error.at(found.span, wanted).help(help))
            }
        }
    }
}
