//! Drawing the values of a row, and judging values: one set of rules for both.

use std::sync::Arc;

use crate::action::table::{ActionTable, Draw, Refusal, Situation};
use crate::action::{Effect, SpawnRequest};
use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::{
    ActionDef, Bound, Domain, EffectDef, Facts, Memory, Parameter, Row, RuleBody, SPAWN_DISTANCE_M,
    SPAWN_SPEED_MPS, Space, SpawnDef, StateMeaning, Value, evaluate, locals,
};
use crate::rng;
use crate::rng::{Rng, Stream};

/// Draws before a row is refused.
const DRAWS_MAX: usize = 16;

/// Drawn numbers are multiples of this, so that they are short in text and exact in binary, SI.
const GRID: f64 = 1.0 / 64.0;

/// One row in one situation.
pub(super) struct Judge<'a> {
    space: &'a Space,
    row: &'a Row,
    action: &'a ActionDef,
    bounds: &'a [Bound],
    situation: &'a Situation<'a>,
}

/// The numbers that a parameter may still have.
#[derive(Debug, Clone, Copy)]
struct Room {
    low: f64,
    high: f64,
    low_open: bool,
    high_open: bool,
    /// Set by an equality.
    exact: Option<f64>,
    /// The rule that cut last.
    cut_by: Option<usize>,
}

impl<'a> Judge<'a> {
    pub fn new(table: &'a ActionTable, situation: &'a Situation<'a>, row: usize) -> Judge<'a> {
        let space = table.space();
        let row = &space.rows[row];
        Judge { space, row, action: &space.actions[row.action], bounds: &table.bounds[row.action], situation }
    }

    /// Draws until all rules hold.
    ///
    /// # Errors
    /// The most frequent refusal, by rule or by the world's reason, the first among equals.
    pub fn draw(&self) -> Result<Draw, Refusal> {
        let seed = rng::child_seed(self.situation.seed, Stream::Draw, self.situation.step);
        let mut rng = rng::stream(seed, Stream::Draw, self.row.index as u64);
        let mut failures: Vec<(usize, Refusal)> = Vec::new();
        // What a rule says differs in its figures from draw to draw; what the world says differs in
        // its reason.
        let same = |a: &Refusal, b: &Refusal| a.rule == b.rule && (a.rule.is_some() || a.reason == b.reason);
        let mut note = |refusal: Refusal| match failures.iter_mut().find(|(_, known)| same(known, &refusal)) {
            Some((count, _)) => *count += 1,
            None => failures.push((1, refusal)),
        };
        // Without anything to draw, one look is as good as many.
        let fixed = self.action.parameters.iter().all(|parameter| parameter.axis);
        for _ in 0..if fixed { 1 } else { DRAWS_MAX } {
            match self.draw_values(&mut rng).and_then(|values| self.judge(&values).map_err(first)) {
                Ok(draw) => return Ok(draw),
                Err(refusal) => note(refusal),
            }
        }
        let most = failures.iter().map(|(count, _)| *count).max();
        let worst = failures.into_iter().find(|(count, _)| Some(*count) == most);
        Err(worst.map(|(_, refusal)| refusal).expect("every draw that failed left its reason"))
    }

    /// # Errors
    /// Everything that is wrong with the values.
    pub fn check(&self, values: &[(Arc<str>, Value)]) -> Result<Draw, Vec<Refusal>> {
        let mut refusals = Vec::new();
        let drawn = || self.action.parameters.iter().filter(|parameter| !parameter.axis);
        for (name, _) in values.iter().filter(|(name, _)| !drawn().any(|parameter| parameter.name == *name)) {
            refusals.push(refuse(None, format!("`{}` draws no `{name}`", self.action.name)));
        }
        for parameter in drawn() {
            match values.iter().find(|(name, _)| *name == parameter.name) {
                None => refusals.push(refuse(None, format!("`{}` is missing", parameter.name))),
                Some((_, value)) if !parameter.domain.holds(*value) => {
                    refusals.push(self.out_of_range(parameter, *value));
                }
                Some(_) => {}
            }
        }
        if !refusals.is_empty() {
            return Err(refusals);
        }
        self.judge(&locals(self.action, self.row, values))
    }

    /// # Errors
    /// Everything that is wrong with the nearest values, or with those that are no numbers.
    pub fn nearest(&self, wanted: &[(Arc<str>, Value)]) -> Result<Draw, Vec<Refusal>> {
        let values = self.values(wanted, &mut |wanted, room| room.nearest(wanted.number()));
        let values = values.map_err(|refusal| vec![refusal])?;
        let drawn = self.action.parameters.iter().zip(values).filter(|(parameter, _)| !parameter.axis);
        let drawn: Vec<(Arc<str>, Value)> =
            drawn.map(|(parameter, value)| (parameter.name.clone(), value)).collect();
        self.check(&drawn)
    }

    /// Applies every rule in force to a complete set of values.
    fn judge(&self, locals: &[Value]) -> Result<Draw, Vec<Refusal>> {
        let space = self.space;
        let before = self.situation.memory;
        let after = space.memory_after(self.row.action, locals, before);
        let effects = self.effects(locals, &after);
        let mut refusals = Vec::new();
        let mut gaps_m = Vec::new();
        for effect in &effects {
            let Effect::Spawn(request) = effect else { continue };
            if let Some(reason) = out_of_bounds(request) {
                refusals.push(refuse(None, reason));
                continue;
            }
            match self.situation.surroundings.survey(request) {
                Ok(facts) => gaps_m.push((facts.spawn_gap_m, facts.safety_gap_m)),
                Err(reason) => refusals.push(refuse(None, format!("cannot spawn: {reason}"))),
            }
        }
        for parameter in &self.action.parameters {
            let holds = |c: &Expr| evaluate(c, &space.functions, &self.facts(locals, &after)).truth();
            if !parameter.condition.as_ref().is_none_or(holds) {
                refusals.push(refuse(None, format!("the `where` of `{}` does not hold", parameter.name)));
            }
        }
        for rule in self.row.rules.iter().copied().filter(|rule| self.situation.rules.is_active(*rule)) {
            let reason = match &space.rules[rule].body {
                RuleBody::Holds(bindings) => bindings
                    .iter()
                    .filter(|binding| binding.action == self.row.action)
                    .find_map(|binding| self.breach(&binding.condition, locals, &after, &gaps_m)),
                RuleBody::Moves { .. } => space.forbidden_move(&space.rules[rule], before, &after),
            };
            refusals.extend(reason.map(|reason| refuse(Some(space.rules[rule].name.clone()), reason)));
        }
        if !refusals.is_empty() {
            return Err(refusals);
        }
        let drawn = self.action.parameters.iter().zip(locals).filter(|(parameter, _)| !parameter.axis);
        let values = drawn.map(|(parameter, value)| (parameter.name.clone(), *value)).collect();
        Ok(Draw { row: self.row.index, values, effects, memory_after: after })
    }

    /// Why a condition fails, if it does. One that asks about a spawn must hold of every spawn; where
    /// the world has no place for it, that was said already.
    fn breach(
        &self,
        condition: &Expr,
        locals: &[Value],
        after: &Memory,
        gaps_m: &[(f64, f64)],
    ) -> Option<String> {
        let base = self.facts(locals, after);
        let holds = |facts: &Facts<'_>| evaluate(condition, &self.space.functions, facts).truth();
        if condition.needs_survey() {
            let failed = gaps_m.iter().find(|gaps_m| !holds(&Facts { gaps_m: **gaps_m, ..base }))?;
            return Some(format!("the gap would be {:.1} m, a fair one is {:.1} m", failed.0, failed.1));
        }
        if holds(&base) {
            return None;
        }
        Some(self.figures(condition, &base))
    }

    /// The parameters that a failed condition names, with their values, and the other side of a
    /// comparison.
    fn figures(&self, condition: &Expr, facts: &Facts<'_>) -> String {
        let mut shown = Vec::new();
        for (index, parameter) in self.action.parameters.iter().enumerate() {
            if condition.any(|kind| matches!(kind, ExprKind::Local(local) if *local == index)) {
                shown.push(format!(
                    "{} = {}",
                    parameter.name,
                    self.space.show(facts.locals[index], parameter.ty)
                ));
            }
        }
        if let ExprKind::Compare(op, _, right) = &condition.kind {
            let right_value = evaluate(right, &self.space.functions, facts);
            shown.push(format!("wanted {} {}", op.symbol(), self.space.show(right_value, right.ty)));
        }
        match shown.is_empty() {
            true => "its condition does not hold".to_owned(),
            false => shown.join(", "),
        }
    }

    fn facts<'f>(&'f self, locals: &'f [Value], memory: &'f Memory) -> Facts<'f> {
        Facts { road: Some(&self.situation.road.facts), ..Facts::new(locals, memory) }
    }

    /// What the world is told. States are told as they end up, so that world and memory agree.
    fn effects(&self, locals: &[Value], after: &Memory) -> Vec<Effect> {
        let mut effects = Vec::new();
        for effect in &self.action.effects {
            match effect {
                EffectDef::Set(set) => {
                    let state = &self.space.states[set.state];
                    let key = set.key.as_ref().map(|key| {
                        evaluate(key, &self.space.functions, &self.facts(locals, after)).variant()
                    });
                    let touched = key.map_or(0..state.cells, |key| key..key + 1);
                    for cell in touched {
                        let value = after.cells()[state.first_cell + cell].variant();
                        let effect = match &state.meaning {
                            StateMeaning::Private => continue,
                            StateMeaning::Time(words) => Effect::Time(words[value]),
                            StateMeaning::Sky(phenomena, levels) => {
                                Effect::Sky(phenomena[cell], levels[value])
                            }
                        };
                        if !effects.contains(&effect) {
                            effects.push(effect);
                        }
                    }
                }
                EffectDef::Spawn(spawn) => effects.push(Effect::Spawn(self.request(spawn, locals, after))),
            }
        }
        effects
    }

    fn request(&self, spawn: &SpawnDef, locals: &[Value], after: &Memory) -> SpawnRequest {
        let functions = &self.space.functions;
        let facts = self.facts(locals, after);
        SpawnRequest {
            body: spawn.body.word(functions, &facts),
            colour: spawn.colour.word(functions, &facts),
            verb: spawn.verb.word(functions, &facts),
            lane: spawn.lane.word(functions, &facts),
            side: spawn.side.word(functions, &facts),
            then: spawn.then.word(functions, &facts),
            speed_mps: evaluate(&spawn.speed, functions, &facts).number(),
            distance_m: evaluate(&spawn.distance, functions, &facts).number(),
        }
    }

    fn draw_values(&self, rng: &mut Rng) -> Result<Vec<Value>, Refusal> {
        let drawn = self.action.parameters.iter().filter(|parameter| !parameter.axis);
        let chosen = drawn.filter_map(|parameter| match &parameter.domain {
            Domain::Values(choices) => {
                let choice = choices[rng::below(rng, choices.len() as u32) as usize];
                Some((parameter.name.clone(), choice))
            }
            Domain::Range(..) => None,
        });
        let chosen: Vec<(Arc<str>, Value)> = chosen.collect();
        self.values(&chosen, &mut |_, room| room.draw(rng))
    }

    /// Values for all parameters: first what was `given` of what is chosen from lists, then the numbers,
    /// each once everything that fixes it is known; `number` takes one, given what was given for it,
    /// where no equality sets it.
    fn values(
        &self,
        given: &[(Arc<str>, Value)],
        number: &mut dyn FnMut(Value, &Room) -> f64,
    ) -> Result<Vec<Value>, Refusal> {
        let parameters = &self.action.parameters;
        let mut values = locals(self.action, self.row, given);
        let is_open = |(_, parameter): &(usize, &Parameter)| {
            !parameter.axis && matches!(parameter.domain, Domain::Range(..))
        };
        let open = parameters.iter().enumerate().filter(is_open);
        let mut open: Vec<usize> = open.map(|(index, _)| index).collect();
        while !open.is_empty() {
            let waits = |local: usize| {
                self.bounds_on(local).any(|bound| {
                    bound.op == Comparison::Equal
                        && open.iter().any(|other| *other != local && bound.needs(*other))
                })
            };
            // Where two equalities wait for each other, the order of declaration decides, and the
            // rules have the last word.
            let next = open.iter().position(|local| !waits(*local)).unwrap_or(0);
            let local = open.remove(next);
            values[local] = Value::Number(self.number(local, &open, &values, number)?);
        }
        Ok(values)
    }

    /// Bounds in force on a parameter that can be computed beforehand.
    fn bounds_on(&self, local: usize) -> impl Iterator<Item = &'a Bound> {
        let rules = self.situation.rules;
        let in_force = move |bound: &&Bound| bound.rule.is_none_or(|rule| rules.is_active(rule));
        self.bounds
            .iter()
            .filter(move |bound| bound.local == local && bound.is_known_early())
            .filter(in_force)
    }

    fn number(
        &self,
        local: usize,
        open: &[usize],
        values: &[Value],
        number: &mut dyn FnMut(Value, &Room) -> f64,
    ) -> Result<f64, Refusal> {
        let parameter = &self.action.parameters[local];
        let (low, high) = parameter.domain.ends();
        let mut room = Room { low, high, low_open: false, high_open: false, exact: None, cut_by: None };
        let facts = self.facts(values, self.situation.memory);
        for bound in self.bounds_on(local).filter(|bound| !open.iter().any(|other| bound.needs(*other))) {
            let holds = |guard: &Expr| evaluate(guard, &self.space.functions, &facts).truth();
            if bound.guards.iter().all(holds) {
                room.cut(bound, evaluate(&bound.limit, &self.space.functions, &facts).number());
            }
        }
        // The draw is made in any case: a rule that sets a value must not shift later draws.
        let drawn = number(values[local], &room);
        let value = room.exact.unwrap_or(drawn);
        if room.is_empty() || !(low..=high).contains(&value) {
            let rule = room.cut_by.map(|rule| self.space.rules[rule].name.clone());
            let shown = |number: f64| self.space.show(Value::Number(number), parameter.ty);
            let wanted = match room.exact {
                Some(exact) => format!("be {}", shown(exact)),
                None => format!("lie in {} .. {}", shown(room.low), shown(room.high)),
            };
            let range = format!("its range is {} .. {}", shown(low), shown(high));
            return Err(refuse(rule, format!("`{}` would have to {wanted}, {range}", parameter.name)));
        }
        Ok(value)
    }

    fn out_of_range(&self, parameter: &Parameter, value: Value) -> Refusal {
        let shown = |value: Value| self.space.show(value, parameter.ty);
        let range = match &parameter.domain {
            Domain::Values(values) => {
                // What is likelier stands there more than once.
                let mut words: Vec<String> = Vec::new();
                for word in values.iter().map(|value| shown(*value)) {
                    if !words.contains(&word) {
                        words.push(word);
                    }
                }
                words.join(" | ")
            }
            Domain::Range(low, high) => {
                format!("{} .. {}", shown(Value::Number(low.to_f64())), shown(Value::Number(high.to_f64())))
            }
        };
        refuse(None, format!("`{}` is {}, its range is {range}", parameter.name, shown(value)))
    }
}

impl Room {
    fn cut(&mut self, bound: &Bound, limit: f64) {
        let (low, high, exact) = (self.low, self.high, self.exact);
        match bound.op {
            Comparison::Equal => self.exact = self.exact.or(Some(limit)),
            Comparison::Less if limit <= self.high => (self.high, self.high_open) = (limit, true),
            Comparison::LessEqual if limit < self.high => (self.high, self.high_open) = (limit, false),
            Comparison::Greater if limit >= self.low => (self.low, self.low_open) = (limit, true),
            Comparison::GreaterEqual if limit > self.low => (self.low, self.low_open) = (limit, false),
            // Judged with the other rules once the draw is complete.
            Comparison::NotEqual
            | Comparison::Less
            | Comparison::LessEqual
            | Comparison::Greater
            | Comparison::GreaterEqual => {}
        }
        if (low, high, exact) != (self.low, self.high, self.exact) {
            self.cut_by = bound.rule;
        }
    }

    fn is_empty(&self) -> bool {
        self.low > self.high || self.low == self.high && (self.low_open || self.high_open)
    }

    /// A number of the room, on the grid where the room holds a point of it.
    fn draw(&self, rng: &mut Rng) -> f64 {
        self.on_grid(rng::between(rng, self.low, self.high))
    }

    /// The number of the room nearest to another; the middle of the room for what is no number.
    fn nearest(&self, wanted: f64) -> f64 {
        let inside = |value: f64| {
            (value > self.low || value == self.low && !self.low_open)
                && (value < self.high || value == self.high && !self.high_open)
        };
        match () {
            () if inside(wanted) => wanted,
            () if wanted.is_nan() => self.on_grid(self.low + (self.high - self.low) / 2.0),
            () => self.on_grid(wanted.max(self.low).min(self.high)),
        }
    }

    /// A number of the room near one of it, on the grid where the room holds a point of it.
    fn on_grid(&self, drawn: f64) -> f64 {
        let inside = |value: f64| {
            (value > self.low || value == self.low && !self.low_open)
                && (value < self.high || value == self.high && !self.high_open)
        };
        let down = (drawn / GRID).floor() * GRID;
        let up = down + GRID;
        match () {
            () if inside(down) => down,
            () if inside(up) => up,
            () if inside(drawn) => drawn,
            // A room of one number, or between two neighbours: rules decide.
            () => self.low + (self.high - self.low) / 2.0,
        }
    }
}

/// Why the world must not be asked for this, whatever its rules say. NaN is out of bounds, too.
fn out_of_bounds(request: &SpawnRequest) -> Option<String> {
    let speed_mps = request.speed_mps;
    if !SPAWN_SPEED_MPS.contains(&speed_mps) {
        let (low, high) = (SPAWN_SPEED_MPS.start(), SPAWN_SPEED_MPS.end());
        return Some(format!("the spawn's speed is {speed_mps} m/s, possible is {low} .. {high} m/s"));
    }
    let distance_m = request.distance_m;
    if !SPAWN_DISTANCE_M.contains(&distance_m) {
        let (low, high) = (SPAWN_DISTANCE_M.start(), SPAWN_DISTANCE_M.end());
        return Some(format!("the spawn's distance is {distance_m} m, possible is {low} .. {high} m"));
    }
    None
}

fn refuse(rule: Option<String>, reason: String) -> Refusal {
    Refusal { rule, reason }
}

/// The first of several refusals; judging never fails without one.
fn first(refusals: Vec<Refusal>) -> Refusal {
    refusals.into_iter().next().expect("a judgement that fails names its reason")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::vocabulary::{Body, Colour, LaneChoice, Side, Then, Verb};

    #[test]
    fn no_spawn_lies_out_of_bounds() {
        let request = |speed_mps, distance_m| SpawnRequest {
            body: Body::Sedan,
            colour: Colour::Red,
            verb: Verb::DriveAhead,
            lane: LaneChoice::Current,
            side: Side::Left,
            then: Then::Keep,
            speed_mps,
            distance_m,
        };
        for (speed_mps, distance_m) in [(0.0, 0.0), (70.0, 1000.0)] {
            assert_eq!(out_of_bounds(&request(speed_mps, distance_m)), None);
        }
        for speed_mps in [-0.1, 70.1, f64::NAN] {
            assert!(out_of_bounds(&request(speed_mps, 10.0)).is_some_and(|reason| reason.contains("speed")));
        }
        for distance_m in [-0.1, 1000.1, f64::NAN] {
            assert!(
                out_of_bounds(&request(5.0, distance_m)).is_some_and(|reason| reason.contains("distance"))
            );
        }
    }
}
