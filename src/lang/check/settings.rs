//! Checks the `episode`, `reward` and `verdict` declarations: which fields they may have, and of which type.

use crate::check::checker::{Checker, each};
use crate::check::expression::Place;
use crate::check::mistakes::{Report, with_value};
use crate::check::names::docs;
use crate::check::rule::names_in;
use crate::model::expr::{Expr, ExprKind};
use crate::model::vocabulary::{EpisodeField, Fact, Site, StopReason, Word};
use crate::model::{COUNTED, EpisodeDef, RewardCase, TICK_MS, Type, VerdictDef, code};
use crate::syntax::ast::{BinaryOp, Comparison, ItemKind, Span};
use crate::syntax::{Diagnostic, ast, print_expr};
use avastra_base::units::{Dimension, Rational};

/// The paper's observation period, s.
const STEP_S: f64 = 6.0;

/// Longest observation period, s.
const STEP_S_MAX: f64 = 600.0;

/// Steps of an episode, if the space does not say.
const STEP_LIMIT: u32 = 20;

impl Checker {
    /// The first block of a kind that a space has once. Reports every further one.
    fn only<'a, T>(
        &mut self,
        items: &'a [&'a ast::Item],
        pick: impl Fn(&'a ItemKind) -> Option<&'a T> + 'a,
    ) -> Option<(&'a ast::Item, &'a T)> {
        let mut blocks = each(items, pick);
        let first = blocks.next()?;
        for (item, _) in blocks {
            let message = format!("`{}` is declared twice", item.kind.keyword());
            let error = Diagnostic::error(code::DUPLICATE, message)
                .at(item.span, "again here")
                .beside(first.0.span, "first here");
            self.report(match first.0.span.file == item.span.file {
                true => error.help("remove one of them"),
                false => error.help("write `override` before the later one to replace the other"),
            });
            self.doubles.insert(item.span);
        }
        Some(first)
    }

    /// The settings of the episode, and its list of roads if the block has one.
    pub(super) fn episode(&mut self, items: &[&ast::Item]) -> (EpisodeDef, Option<Vec<ast::Name>>) {
        let fields = self.only(items, ItemKind::as_episode).map_or(&[][..], |(_, fields)| fields);
        self.settings(fields)
    }

    pub(super) fn settings(&mut self, fields: &[ast::Field]) -> (EpisodeDef, Option<Vec<ast::Name>>) {
        let mut episode =
            EpisodeDef { step_s: STEP_S, stop_arrived: true, stalled_steps: None, step_limit: STEP_LIMIT };
        let mut roads = None;
        self.note_fields(fields, EpisodeField::ALL, &Place::default());
        for (field, value) in self.fields_known(fields) {
            match field {
                EpisodeField::Roads => roads = self.road_list(value),
                EpisodeField::Step => episode.step_s = self.step(value).unwrap_or(STEP_S),
                EpisodeField::Stop => self.stop(value, &mut episode),
                EpisodeField::Limit => episode.step_limit = self.count_of_steps(value).unwrap_or(STEP_LIMIT),
            }
        }
        (episode, roads)
    }

    fn road_list(&mut self, value: &ast::Expr) -> Option<Vec<ast::Name>> {
        let ast::ExprKind::List(items) = &value.kind else {
            self.note_roads(core::slice::from_ref(value));
            let error = Diagnostic::error(code::TYPE_MISMATCH, "`roads` needs a list of roads");
            return self.reject(error.at(value.span, "not a list").help("write `roads: [name, name]`"));
        };
        self.note_roads(items);
        let mut roads = Vec::new();
        for item in items {
            match &item.kind {
                ast::ExprKind::Name(name) => roads.push(ast::Name::new(name.clone(), item.span)),
                _ => self.report(
                    Diagnostic::error(code::TYPE_MISMATCH, "`roads` needs names").at(item.span, "not a name"),
                ),
            }
        }
        Some(roads)
    }

    fn step(&mut self, value: &ast::Expr) -> Option<f64> {
        let step = self.typed(value, &Place::default(), Type::Quantity(Dimension::DURATION))?;
        let exact_s = self.fold_number(&step)?;
        let seconds = exact_s.to_f64();
        let ticks = exact_s.checked_mul(Rational::integer(1000)).and_then(|ms| ms.to_i64());
        let is_whole = ticks.is_some_and(|ms| ms % i64::from(TICK_MS) == 0);
        if is_whole && seconds > 0.0 && seconds <= STEP_S_MAX {
            return Some(seconds);
        }
        let message = format!("a step of {} is not possible", with_value(value, exact_s, "s"));
        let error = Diagnostic::error(code::SETTING, message);
        let wanted = format!("must be a multiple of {TICK_MS} ms, more than 0 s and at most {STEP_S_MAX} s");
        self.reject(error.at(value.span, wanted).help("time passes in ticks; write for example `6 s`"))
    }

    /// `20`, or `20 steps`.
    fn count_of_steps(&mut self, value: &ast::Expr) -> Option<u32> {
        if let ast::ExprKind::Number(number) = &value.kind {
            self.references.number(number);
        }
        let count = match &value.kind {
            ast::ExprKind::Number(number)
                if number.unit.as_ref().is_none_or(|unit| matches!(unit.text.as_str(), "steps" | "step")) =>
            {
                number.digits.parse::<u32>().ok().filter(|count| *count > 0)
            }
            _ => None,
        };
        count.or_else(|| {
            let error = Diagnostic::error(code::SETTING, "wanted a number of steps");
            self.reject(error.at(value.span, "not a whole number from 1").help("write `20 steps`"))
        })
    }

    /// `arrived`, `stalled >= 4`, or both with `or` between them.
    fn stop(&mut self, value: &ast::Expr, episode: &mut EpisodeDef) {
        episode.stop_arrived = false;
        for name in names_in(value) {
            self.references.word_named::<StopReason>(name.span, &name.text);
        }
        let mut parts = vec![value];
        let reason = |expr: &ast::Expr| match &expr.kind {
            ast::ExprKind::Name(name) => StopReason::from_name(name),
            _ => None,
        };
        while let Some(part) = parts.pop() {
            let (reason, count) = match &part.kind {
                ast::ExprKind::Binary { op: BinaryOp::Or, left, right, .. } => {
                    parts.extend([&**left, &**right]);
                    continue;
                }
                ast::ExprKind::Binary {
                    op: BinaryOp::Compare(Comparison::GreaterEqual),
                    left,
                    right,
                    ..
                } => (reason(left), Some(right)),
                _ => (reason(part), None),
            };
            match (reason, count) {
                (Some(StopReason::Arrived), None) => episode.stop_arrived = true,
                (Some(StopReason::Stalled), Some(count)) => {
                    episode.stalled_steps = self.count_of_steps(count);
                }
                (Some(StopReason::Arrived), Some(_)) | (Some(StopReason::Stalled), None) | (None, _) => {
                    let error = Diagnostic::error(code::STOP, "an episode cannot be stopped by this");
                    let help =
                        "reasons are `arrived` and `stalled >= 4` (steps without progress), joined by `or`";
                    self.report(error.at(part.span, "unknown reason").help(help));
                }
            }
        }
    }

    pub(super) fn reward(&mut self, items: &[&ast::Item]) -> Vec<RewardCase> {
        let Some((item, declared)) = self.only(items, ItemKind::as_reward) else { return Vec::new() };
        self.cases(item, declared)
    }

    pub(super) fn cases(&mut self, item: &ast::Item, declared: &[ast::Case]) -> Vec<RewardCase> {
        let place = Place { states: true, site: Site::Reward, ..Place::default() };
        let mut cases = Vec::new();
        let mut closed = false;
        for case in declared {
            if closed {
                let error = Diagnostic::error(code::NEVER_REACHED, "this case is never reached");
                let error = error.at(case.span, "`_` before it takes everything");
                self.report(error.help("let `_` be the last line, or remove this one"));
            }
            let condition = case.condition.as_ref().map(|c| self.typed(c, &place, Type::Bool));
            let value = self.typed(&case.value, &place, Type::Quantity(Dimension::RATIO));
            closed |= condition.is_none();
            if let (Some(value), false) = (value, matches!(condition, Some(None))) {
                cases.push(RewardCase { condition: condition.flatten(), value });
            }
        }
        if !closed {
            let error = Diagnostic::error(code::NOT_EXHAUSTIVE, "`reward` does not cover every case");
            self.report(error.at(item.span, "the rest is missing").help("end with `_ => 0`"));
        }
        cases
    }

    pub(super) fn verdicts(&mut self, items: &[&ast::Item]) -> Vec<VerdictDef> {
        let mut verdicts = Vec::new();
        let declared: Vec<_> = each(items, ItemKind::as_verdict).collect();
        self.once("verdict", declared.iter().map(|(_, declared)| &declared.name));
        let is_counted = |(_, declared): &(&ast::Item, &ast::Verdict)| declared.name.text == COUNTED;
        let names_counted = declared.iter().any(is_counted);
        for (item, declared) in declared {
            if let Some(condition) = self.verdict(declared) {
                let clauses = clauses(&declared.condition).into_iter().map(print_expr).collect();
                verdicts.push(VerdictDef {
                    name: declared.name.text.clone(),
                    docs: docs(item),
                    condition,
                    clauses,
                });
            }
        }
        if !names_counted {
            verdicts.push(counted());
        }
        verdicts
    }

    pub(super) fn verdict(&mut self, declared: &ast::Verdict) -> Option<Expr> {
        let place = Place { states: true, site: Site::Verdict, ..Place::default() };
        self.typed(&declared.condition, &place, Type::Bool)
    }
}

/// The verdict [`COUNTED`] for a space that does not declare it. It counts as the paper does:
/// `collision and not repeated and not sudden`.
fn counted() -> VerdictDef {
    let expr = |kind| Expr { kind, ty: Type::Bool, span: Span::NONE };
    let fact = |fact| Box::new(expr(ExprKind::Fact(fact)));
    let not = |of| Box::new(expr(ExprKind::Not(fact(of))));
    let first = Box::new(expr(ExprKind::And(fact(Fact::Collision), not(Fact::Repeated))));
    let condition = expr(ExprKind::And(first, not(Fact::Sudden)));
    let clauses = ["collision", "not repeated", "not sudden"].map(str::to_owned).to_vec();
    VerdictDef { name: COUNTED.to_owned(), docs: Vec::new(), condition, clauses }
}

/// The conditions that `and` joins, from left to right.
fn clauses(condition: &ast::Expr) -> Vec<&ast::Expr> {
    match &condition.kind {
        ast::ExprKind::Binary { op: BinaryOp::And, left, right, .. } => {
            clauses(left).into_iter().chain(clauses(right)).collect()
        }
        _ => vec![condition],
    }
}
