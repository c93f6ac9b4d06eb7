//! The judgement: which rules a complete choice of values breaks.

use crate::model::eval::{evaluate, word_of, word_of_bearer};
use crate::model::expr::{Expr, ExprKind, Who};
use crate::model::facts::{Facts, SpawnFacts, WorldFacts};
use crate::model::numbers::compare;
use crate::model::rules::{Bound, Clause, Demand, RowRules, Source};
use crate::model::space::Parameter;
use crate::model::value::{Memory, Value};
use crate::model::vocabulary::{Fact, Known, Word};

/// A complete choice for a row, and what it would do.
#[derive(Clone, Copy)]
pub struct Candidate<'a> {
    /// Values of all parameters of the row's action.
    pub values: &'a [Value],
    pub before: &'a Memory,
    /// The memory after the action.
    pub after: &'a Memory,
    /// The facts of the world. Without them, a rule that asks the world holds. A rule that asks about a spawn also holds
    /// where there is none.
    pub world: Option<&'a WorldFacts>,
}

/// One rule, or one `where`, that a candidate breaks.
#[derive(Debug, Clone, Copy)]
pub enum Breach<'a> {
    /// The parameter's `where` does not hold.
    Where(&'a Parameter, &'a Expr),
    Condition {
        rule: usize,
        condition: &'a Expr,
    },
    /// A rule that asks about a spawn.
    Spawn {
        rule: usize,
        condition: &'a Expr,
        spawn: SpawnFacts,
    },
    /// An effect gives a state a number that no state may have: see [`Value::is_kept`].
    Number {
        cell: usize,
    },
    /// A state makes a move that the rule does not allow.
    Move {
        rule: usize,
        state: usize,
        cell: usize,
        from: Value,
        to: Value,
    },
}

impl<'a> RowRules<'a> {
    /// Everything that the candidate breaks: `where`s first, then the numbers that states may have, then the rules in
    /// force that bind the row.
    pub fn breaches(self, candidate: Candidate<'a>) -> impl Iterator<Item = Breach<'a>> {
        let parameters = 0..self.space.actions[self.row.action].parameters.len();
        let wheres = parameters.filter_map(move |parameter| self.where_breach(parameter, candidate));
        let rules = self.demands().filter_map(move |(rule, demand)| self.breach(rule, demand, candidate));
        let cells = candidate.before.cells.iter().zip(&candidate.after.cells).enumerate();
        let numbers = cells.filter(|(_, (before, after))| before != after && !after.is_kept());
        wheres.chain(numbers.map(|(cell, _)| Breach::Number { cell })).chain(rules)
    }

    /// Whether this clause forbids the candidate.
    pub fn breaks(self, clause: &Clause, candidate: Candidate<'_>) -> bool {
        match clause.source {
            Source::Where(parameter) => self.where_breach(parameter, candidate).is_some(),
            Source::Rule(rule) => {
                let demand = self.space.rules[rule].body.demand(self.row.action);
                demand.is_some_and(|demand| self.breach(rule, demand, candidate).is_some())
            }
        }
    }

    fn where_breach(self, parameter: usize, candidate: Candidate<'_>) -> Option<Breach<'a>> {
        let parameter = &self.space.actions[self.row.action].parameters[parameter];
        let condition = parameter.condition.as_ref()?;
        let is_open = condition.known() == Known::World && candidate.world.is_none();
        let facts = self.facts(candidate);
        (!is_open && !self.holds(condition, facts)).then_some(Breach::Where(parameter, condition))
    }

    /// Why the rule forbids the candidate; `None` if it does not.
    fn breach(self, rule: usize, demand: Demand<'a>, candidate: Candidate<'_>) -> Option<Breach<'a>> {
        let facts = self.facts(candidate);
        match demand {
            Demand::Holds(condition) => {
                let breach = Breach::Condition { rule, condition };
                match condition.known() {
                    Known::World if candidate.world.is_none() => None,
                    Known::Road | Known::World => (!self.holds(condition, facts)).then_some(breach),
                    Known::Spawn => {
                        let mut spawns = candidate.world?.spawns.iter().copied();
                        let is_broken = |spawn: &SpawnFacts| {
                            !self.holds(condition, Facts { spawn: Some(*spawn), ..facts })
                        };
                        Some(Breach::Spawn { rule, condition, spawn: spawns.find(is_broken)? })
                    }
                    Known::Tick | Known::Near | Known::Step | Known::Judgement => {
                        unreachable!("no rule may read what comes after it")
                    }
                }
            }
            Demand::Moves { state, cell, allowed } => {
                let (from, to) = (candidate.before.cells[cell], candidate.after.cells[cell]);
                (!allowed[from.variant()][to.variant()]).then_some(Breach::Move {
                    rule,
                    state,
                    cell,
                    from,
                    to,
                })
            }
        }
    }

    fn facts<'c>(self, candidate: Candidate<'c>) -> Facts<'c>
    where
        'a: 'c,
    {
        Facts { road: self.road, world: candidate.world, ..Facts::new(candidate.values, candidate.after) }
    }

    fn holds(self, condition: &Expr, facts: Facts<'_>) -> bool {
        evaluate(condition, &self.space.functions, &facts).truth()
    }

    /// A breach in words, with its figures.
    pub fn words(self, breach: Breach<'_>, candidate: Candidate<'a>) -> String {
        match breach {
            Breach::Where(parameter, condition) => {
                let words = format!("the `where` of `{}` does not hold", parameter.name);
                match condition.asks_the_world() || condition.reads_memory() {
                    true => format!("{words}: {}", self.figures(None, condition, candidate, None)),
                    false => words,
                }
            }
            Breach::Condition { rule, condition } => {
                let decisive = self.decisive(condition, self.facts(candidate));
                self.figures(Some(rule), decisive, candidate, None)
            }
            Breach::Spawn { rule, condition, spawn } => {
                let facts = Facts { spawn: Some(spawn), ..self.facts(candidate) };
                let decisive = self.decisive(condition, facts);
                self.gap_words(decisive, spawn, facts)
                    .unwrap_or_else(|| self.figures(Some(rule), decisive, candidate, Some(spawn)))
            }
            Breach::Number { cell } => format!(
                "`{}` would have no value: a division by 0, or a number of 2^53 or more",
                self.space.cell_name(cell)
            ),
            Breach::Move { state, cell, from, to, .. } => {
                let ty = self.space.states[state].ty;
                let (from, to) = (self.space.show(from, ty), self.space.show(to, ty));
                format!("`{}` may not move from {from} to {to}", self.space.cell_name(cell))
            }
        }
    }

    /// The part of a broken condition that decides: the side of an `and` that fails, what an `implies` leads to.
    fn decisive<'e>(self, condition: &'e Expr, facts: Facts<'_>) -> &'e Expr {
        match &condition.kind {
            ExprKind::And(left, right) => {
                let failing = if self.holds(left, facts) { right } else { left };
                self.decisive(failing, facts)
            }
            ExprKind::Implies(_, right) => self.decisive(right, facts),
            _ => condition,
        }
    }

    /// A comparison of the spawn's gap in words; `None` for any other condition.
    fn gap_words(self, condition: &Expr, spawn: SpawnFacts, facts: Facts<'_>) -> Option<String> {
        let ExprKind::Compare(op, left, right) = &condition.kind else { return None };
        if left.kind != ExprKind::Fact(Fact::SpawnGap) {
            return None;
        }
        let SpawnFacts { spawn_gap_m, safety_gap_m, .. } = spawn;
        if right.kind == ExprKind::Fact(Fact::SafetyGap) {
            return Some(format!("the gap would be {spawn_gap_m:.1} m, a fair one is {safety_gap_m:.1} m"));
        }
        let wanted_m = evaluate(right, &self.space.functions, &facts).number();
        let mut words =
            format!("the gap would be {spawn_gap_m:.1} m, wanted {} {wanted_m:.1} m", op.symbol());
        if right.any(|kind| *kind == ExprKind::Fact(Fact::SafetyGap)) {
            words.push_str(&format!(", where {safety_gap_m:.1} m are fair"));
        }
        Some(words)
    }

    /// The bounds of a rule on single numbers that the candidate breaks, each with its limit.
    pub fn broken_bounds(
        self,
        rule: usize,
        candidate: Candidate<'a>,
        spawn: Option<SpawnFacts>,
    ) -> impl Iterator<Item = (&'a Bound, Value)> {
        let facts = Facts { spawn, ..self.facts(candidate) };
        self.space.bounds[self.row.action].iter().filter_map(move |bound| {
            let applies =
                bound.rule == Some(rule) && bound.guards.iter().all(|guard| self.holds(guard, facts));
            let limit = applies.then(|| evaluate(&bound.limit, &self.space.functions, &facts))?;
            (!compare(bound.op, candidate.values[bound.local], limit)).then_some((bound, limit))
        })
    }

    /// The parameters, states and facts of the world that a broken condition names, with their values, and the wanted
    /// value. That is the first broken bound, or the right side of a comparison that bounds no single number.
    fn figures(
        self,
        rule: Option<usize>,
        condition: &Expr,
        candidate: Candidate<'a>,
        spawn: Option<SpawnFacts>,
    ) -> String {
        let parameters = &self.space.actions[self.row.action].parameters;
        let mut shown = Vec::new();
        for (index, parameter) in parameters.iter().enumerate() {
            if condition.any(|kind| kind.local() == Some(index)) {
                let value = self.space.show(candidate.values[index], parameter.ty);
                shown.push(format!("{} = {value}", parameter.name));
            }
        }
        let facts = Facts { spawn, ..self.facts(candidate) };
        let to = |per_unit: f64, expr: &Expr| match evaluate(expr, &self.space.functions, &facts) {
            Value::Number(number) => {
                let rounded = (number * per_unit).round() / per_unit;
                let shown = if rounded.is_finite() { rounded } else { number };
                self.space.show(Value::Number(shown), expr.ty)
            }
            other => self.space.show(other, expr.ty),
        };
        // Computed values lose the digits that binary fractions leave; measured ones are rounded to a thousandth of a unit.
        let value = |expr: &Expr| to(1e9, expr);
        let measured = |expr: &Expr| to(1e3, expr);
        let is_known = |expr: &Expr| evaluate(expr, &self.space.functions, &facts).number().is_finite();
        let name = |who: Who| &self.space.bearers[who.bearer(candidate.values)];
        condition.walk(&mut |part| {
            let figure = match &part.kind {
                ExprKind::Fact(fact) if matches!(fact.known(), Known::World | Known::Spawn) => {
                    format!("{} = {}", fact.name(), measured(part))
                }
                ExprKind::OfBearer(who, fact) if is_known(part) => {
                    let fact = fact.name().trim_start_matches("npc.");
                    format!("{}.{fact} = {}", name(*who), measured(part))
                }
                ExprKind::Since(_, name) => format!("since({name}) = {}", measured(part)),
                ExprKind::IsThere(who) => {
                    let is_there = evaluate(part, &self.space.functions, &facts).truth();
                    let fate = if is_there { "is there" } else { "is not there" };
                    format!("`{}` {fate}", name(*who))
                }
                ExprKind::Cell(cell) => format!("{} = {}", self.space.cell_name(*cell), value(part)),
                ExprKind::CellAt(first, key) => {
                    let key = evaluate(key, &self.space.functions, &facts).variant();
                    format!("{} = {}", self.space.cell_name(first + key), value(part))
                }
                ExprKind::IsWordOf(who, fact, _) => {
                    let Some(word) = word_of_bearer(*who, *fact, &facts) else { return };
                    format!("{}.{} = {word}", name(*who), fact.name().trim_start_matches("npc."))
                }
                ExprKind::IsWord(fact, _) => {
                    let Some(word) = word_of(*fact, &facts) else { return };
                    format!("{} = {word}", fact.name())
                }
                _ => return,
            };
            if !shown.contains(&figure) {
                shown.push(figure);
            }
        });
        let has_no_value = |expr: &Expr| match evaluate(expr, &self.space.functions, &facts) {
            Value::Number(number) => !number.is_finite(),
            Value::Bool(_) | Value::Variant(..) => false,
        };
        let bound = rule.and_then(|rule| self.broken_bounds(rule, candidate, spawn).next());
        match (bound, &condition.kind) {
            (Some((bound, limit)), kind) => {
                let Parameter { name, ty, .. } = &parameters[bound.local];
                let (op, limit) = (bound.op.symbol(), self.space.show(limit, *ty));
                let local = ExprKind::Local(bound.local);
                let is_left = matches!(kind, ExprKind::Compare(_, left, _) if left.kind == local);
                shown.push(match is_left {
                    true => format!("wanted {op} {limit}"),
                    false => format!("wanted {name} {op} {limit}"),
                });
            }
            (None, ExprKind::Compare(op, _, right)) if !has_no_value(right) => {
                shown.push(format!("wanted {} {}", op.symbol(), value(right)));
            }
            (None, _) => {}
        }
        let is_there = |who: &usize| {
            facts.world.is_some_and(|world| world.bearers.iter().any(|(known, _)| known == who))
        };
        let lacks_a_side = |kind: &ExprKind| match kind {
            ExprKind::Compare(_, left, right) => has_no_value(left) || has_no_value(right),
            ExprKind::InRange(inner, _, _) => has_no_value(inner),
            ExprKind::IsWordOf(who, ..) => !is_there(&who.bearer(candidate.values)),
            _ => false,
        };
        if condition.any(lacks_a_side) {
            let absent = condition
                .asked()
                .into_iter()
                .map(|who| who.bearer(candidate.values))
                .find(|who| !is_there(who));
            let why = match absent {
                Some(who) if self.space.actions[self.row.action].spawn_of(who).is_some() => {
                    format!(
                        "no earlier `{}` is there (the one that appears is `npc`)",
                        self.space.bearers[who]
                    )
                }
                Some(who) => format!("`{}` is not there", self.space.bearers[who]),
                None => "a division by 0 has no value".to_owned(),
            };
            if !shown.contains(&why) {
                shown.push(why);
            }
        }
        let asks_for_limit = condition.any(|kind| matches!(kind, ExprKind::Fact(Fact::RoadLimit)));
        let limited_at = self.road.and_then(|road| road.limited_at.as_ref());
        if let Some(place) = limited_at.filter(|_| asks_for_limit) {
            shown.push(format!("road.limit is that of {place}"));
        }
        match shown.is_empty() {
            true => "its condition does not hold".to_owned(),
            false => shown.join(", "),
        }
    }
}

impl Breach<'_> {
    /// Whether it depends on a moment, or on a place in the world.
    pub fn asks_about_moment(&self) -> bool {
        match self {
            Breach::Where(_, condition)
            | Breach::Condition { condition, .. }
            | Breach::Spawn { condition, .. } => condition.asks_about_moment(),
            Breach::Number { .. } | Breach::Move { .. } => false,
        }
    }

    /// The rule that is broken; `None` for a `where` and for a number that no state may have.
    pub fn rule(&self) -> Option<usize> {
        match self {
            Breach::Where(..) | Breach::Number { .. } => None,
            Breach::Condition { rule, .. } | Breach::Spawn { rule, .. } | Breach::Move { rule, .. } => {
                Some(*rule)
            }
        }
    }
}
