//! Requirements: what the ego vehicle must keep.

use crate::check::checker::{Checker, docs};
use crate::check::expression::Place;
use crate::check::names::unknown;
use crate::check::references::Symbol;
use crate::check::report::Report;
use crate::model::expr::{Expr, ExprKind};
use crate::model::requirement::{margin_dimension, open_divisor};
use crate::model::vocabulary::{BREACHED, Body, Site, Word, things};
use crate::model::{BodyWord, RequirementDef, RuleDef, TICK_MS, Type, code};
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast};
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
        self.requirement_names = names;
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
            requirements.extend(self.requirement(item, declared));
        }
        requirements
    }

    pub(super) fn requirement(
        &mut self,
        item: &ast::Item,
        declared: &ast::Require,
    ) -> Option<RequirementDef> {
        let on = declared.on.iter().map(|name| self.body_required(name)).collect::<Option<Vec<_>>>();
        let site = if declared.on.is_empty() { Site::Requirement } else { Site::RequirementOn };
        let place = Place { states: true, site, ..Place::default() };
        let when = declared.when.as_ref().map(|when| self.typed(when, &place, Type::Bool));
        let condition = self.typed(&declared.condition, &place, Type::Bool);
        let within_ticks = match &declared.within {
            None => Some(0),
            Some(within) => self.within_ticks(within),
        };
        let (when, condition) = (when.map_or(Some(None), |when| when.map(Some))?, condition?);
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
        // Who asks `truck.there` wants an answer while it is not there.
        let mut bearers: Vec<usize> = when
            .iter()
            .chain([&condition])
            .flat_map(|expr| {
                expr.filter_map(|kind| match kind {
                    ExprKind::OfBearer(who, _) | ExprKind::IsWordOf(who, ..) => Some(*who),
                    _ => None,
                })
            })
            .flat_map(|who| who.bearers(0))
            .collect();
        bearers.sort_unstable();
        bearers.dedup();
        Some(RequirementDef {
            name: declared.name.text.clone(),
            docs: docs(item),
            optional: declared.optional,
            on: on?,
            margin: margin_dimension(&condition),
            when,
            condition,
            within_ticks: within_ticks?,
            bearers,
            span: declared.name.span,
        })
    }

    /// A body that a requirement is about.
    fn body_required(&mut self, name: &ast::Name) -> Option<BodyWord> {
        let Some(body) = self.body_named(&name.text) else {
            let names = Body::names().chain(self.bodies.iter().map(|body| body.name.as_str()));
            let error = unknown("body", &name.text, name.span, names);
            return self.reject(error);
        };
        self.note_body(name.span, &name.text);
        Some(body)
    }

    /// `stops_at_red.breached` in a reward; `None` if this is no requirement.
    pub(super) fn breached(
        &mut self,
        base: &ast::Expr,
        part: &ast::Name,
        place: &Place<'_>,
        span: Span,
    ) -> Option<Option<Expr>> {
        let ast::ExprKind::Name(name) = &base.kind else { return None };
        // A requirement that is called `ego` takes nothing from the ego vehicle.
        let index = self.requirement_names.get(name).filter(|_| !things().contains(&name.as_str()))?;
        self.references.uses(base.span, Symbol::Requirement(name.clone()));
        if part.text != BREACHED.0 {
            let error =
                Diagnostic::error(code::UNKNOWN, format!("unknown fact of a requirement `{}`", part.text));
            return Some(
                self.reject(error.at(part.span, "not known").help(format!("write `{name}.breached`"))),
            );
        }
        self.references.note(part.span, Symbol::Engine(BREACHED.0, BREACHED.1), false);
        if place.site != Site::Reward {
            let error = Diagnostic::error(code::NOT_HERE, format!("`{name}.breached` is not known here"));
            return Some(self.reject(error.at(span, "only rewards, and claims of scenarios, see it")));
        }
        Some(Some(Expr { kind: ExprKind::Breached(index), ty: Type::Bool, span }))
    }

    /// How many ticks `within` lasts: a part of a tick is one more.
    fn within_ticks(&mut self, within: &ast::Expr) -> Option<u32> {
        let found = self.typed(within, &Place::default(), Type::Quantity(Dimension::DURATION))?;
        let exact_s = self.fold_number(&found)?;
        let ticks =
            exact_s.checked_mul(Rational::new(1000, TICK_MS.into())?).map(|ticks| ticks.to_f64().ceil());
        match ticks {
            Some(ticks) if ticks > 0.0 && exact_s <= Rational::integer(WITHIN_S_MAX) => Some(ticks as u32),
            _ => {
                let message = format!("a requirement cannot wait {} s", exact_s.to_f64());
                let error = Diagnostic::error(code::SETTING, message);
                let wanted = format!("must be more than 0 s and at most {WITHIN_S_MAX} s");
                self.reject(
                    error.at(found.span, wanted).help("leave `within` out to judge every moment by itself"),
                )
            }
        }
    }
}
