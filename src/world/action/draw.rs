//! Drawing the values of a row, and judging given values. Both end in `Judge::judge`.

use std::cell::Cell;
use std::sync::Arc;

use crate::action::course::Part;
use crate::action::later::Later;
use crate::action::table::{Draw, Refusal, Situation};
use crate::action::{
    Begins, Course, Effect, GAP_TO_ITSELF, GAP_TO_NOBODY, LaneChangeRules, LightRequest, OnTrajectory,
    OrderRequest, SpawnRequest,
};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::model::body::{OwnBody, parameters};
use avastra_lang::model::command::Told;
use avastra_lang::model::expr::{Expr, Who};
use avastra_lang::model::field::Said;
use avastra_lang::model::rules::{
    Before, Candidate, Choose, Clause, Nearest, Room, RowRules, TRIES_MAX, Unsolved,
};
use avastra_lang::model::vocabulary::{Field, LaneChoice, Verb};
use avastra_lang::model::{
    ActionDef, BodyWord, Domain, EffectDef, Facts, LIGHT_AT_M, LightDef, ManoeuvreCall, Memory, MomentFacts,
    NpcFacts, OrderDef, Parameter, SPAWN_SPEED_MPS, Space, SpawnDef, Type, Value, WorldFacts, evaluate,
    locals, reached, rounded_into, spawn_distance_m, told,
};

/// Draws of one row in a step before the row is refused. Every draw obeys what can be known before. A further draw is
/// made only if the world has no place for the spawn, or a rule about its gap refuses that place.
const DRAWS_MAX: usize = 16;

/// One row in one situation.
pub(super) struct Judge<'a> {
    /// The row on its road, with the rules in force.
    row: RowRules<'a>,
    action: &'a ActionDef,
    situation: &'a Situation<'a>,
    /// Filled in if a rule or a `where` asks for it.
    moment: MomentFacts,
    /// The named road users that a rule or a `where` asks about, and that are there.
    bearers: Vec<(usize, NpcFacts)>,
}

/// Why there is no place beside another road user.
const ABSENT: &str = "the road user beside whom it would appear is not there";
const PASSED: &str = "that place is on the other side of the ego vehicle";

impl<'a> Judge<'a> {
    pub fn new(space: &'a Space, situation: &'a Situation<'a>, row: usize) -> Judge<'a> {
        let row = &space.rows[row];
        let action = &space.actions[row.action];
        let row = RowRules { space, row, road: Some(&situation.road.facts), in_force: situation.rules };
        let in_force = |clause: &&Clause| clause.rule().is_none_or(|rule| situation.rules.contains(rule));
        let asked = || space.clauses[row.row.action].iter().filter(in_force);
        let beside = || space.actions[row.row.action].spawns().filter_map(|spawn| spawn.of);
        let is_beside = |who: &usize| beside().any(|of| of.bearers(space.bearers.len()).contains(who));
        let asks_who = |who: &usize| {
            is_beside(who)
                || asked().any(|clause| clause.bearers.contains(who))
                || space.bearers_of_each_step().any(|asked| asked == *who)
        };
        let facts = |who: usize| Some((who, situation.surroundings.bearer(who)?));
        let bearers = (0..space.bearers.len()).filter(asks_who).filter_map(facts).collect();
        let asks = asked().any(|clause| clause.asks_the_world) || beside().next().is_some();
        let moment = match asks || space.each_step_asks_the_world() {
            true => situation.surroundings.moment(),
            false => MomentFacts::default(),
        };
        Judge { row, action, situation, moment, bearers }
    }

    /// Draws until all rules hold. `shares` places the values of the first try: for each parameter, where in its range
    /// its value lies, in `[0, 1)`. Parameters without a share, and every further try, are drawn by chance.
    ///
    /// # Errors
    /// The most frequent refusal; the earliest, if several are equally frequent.
    pub fn draw(&self, shares: &[f64]) -> Result<Draw, Refusal> {
        self.draw_beside(&[], shares)
    }

    /// As [`Judge::draw`], beside values that stay as they are given.
    ///
    /// # Errors
    /// As there; also if no values of the others fit.
    pub fn draw_beside(&self, fixed: &[(Arc<str>, Value)], shares: &[f64]) -> Result<Draw, Refusal> {
        let seed = rng::child_seed(self.situation.seed, Stream::Draw, self.situation.step);
        let mut rng = rng::stream(seed, Stream::Draw, self.row.row.index as u64);
        let mut failures: Vec<(usize, Refusal)> = Vec::new();
        // Refusals by the same rule count as one, because only their figures differ from draw to draw.
        // Refusals by the world are told apart by their reasons.
        let same = |a: &Refusal, b: &Refusal| a.rule == b.rule && (a.rule.is_some() || a.reason == b.reason);
        let mut note = |refusal: Refusal| match failures.iter_mut().find(|(_, known)| same(known, &refusal)) {
            Some((count, _)) => *count += 1,
            None => failures.push((1, refusal)),
        };
        let parameters = self.action.parameters.iter().enumerate();
        let is_fixed = |parameter: &Parameter| fixed.iter().any(|(name, _)| *name == parameter.name);
        let open: Vec<usize> =
            parameters.filter(|(_, p)| !p.axis && !is_fixed(p)).map(|(local, _)| local).collect();
        let (world, tries) = (self.world(), Cell::new(TRIES_MAX));
        let before = Before { memory: self.situation.memory, world: Some(&world), tries: &tries };
        // No other draw finds what does not exist.
        let refused = |unsolved: Unsolved| self.refused(&unsolved, &world);
        let given = locals(self.action, self.row.row, fixed);
        let mut solver = self.row.solver(given, &open, before).map_err(refused)?;
        // With nothing to draw, every try gives the same result.
        let is_single = open.is_empty();
        let mut chance = Chance { rng: &mut rng, shares: shares.iter().copied().map(Some).collect() };
        for _ in 0..if is_single { 1 } else { DRAWS_MAX } {
            tries.set(TRIES_MAX);
            let values = solver.solve(&mut chance).map_err(refused)?;
            chance.shares.clear();
            match self.judge(&values, 1).map_err(first) {
                Ok(draw) => return Ok(draw),
                Err(refusal) => note(refusal),
            }
        }
        let most = failures.iter().map(|(count, _)| *count).max();
        let worst = failures.into_iter().find(|(count, _)| Some(*count) == most);
        Err(worst.map(|(_, refusal)| refusal).expect("every draw that failed left its reason"))
    }

    /// The draw with these values.
    ///
    /// # Errors
    /// Everything that is wrong with the values.
    pub fn check(&self, values: &[(Arc<str>, Value)]) -> Result<Draw, Vec<Refusal>> {
        let mut refusals = Vec::new();
        let is_drawn = |name: &Arc<str>| self.action.drawn().any(|parameter| parameter.name == *name);
        for (name, _) in values.iter().filter(|(name, _)| !is_drawn(name)) {
            refusals.push(refuse(None, format!("`{}` draws no `{name}`", self.action.name)));
        }
        for parameter in self.action.drawn() {
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
        self.judge(&locals(self.action, self.row.row, values), usize::MAX)
    }

    /// The draw with the legal values nearest to these.
    ///
    /// # Errors
    /// Everything that is wrong with the nearest values, or with the values that are not numbers.
    pub fn nearest(&self, wanted: &[(Arc<str>, Value)]) -> Result<Draw, Vec<Refusal>> {
        let given = locals(self.action, self.row.row, wanted);
        let open: Vec<usize> = self.action.drawn_numbers().collect();
        let mut choose = Nearest { wanted: given.clone() };
        let (world, tries) = (self.world(), Cell::new(TRIES_MAX));
        let before = Before { memory: self.situation.memory, world: Some(&world), tries: &tries };
        let values = self.row.solve(given, &open, before, &mut choose);
        let values = values.map_err(|unsolved| vec![self.refused(&unsolved, &world)])?;
        self.check(&self.action.drawn_of(&values))
    }

    /// Asks the world about every spawn, then applies every rule in force to a complete set of values.
    ///
    /// # Errors
    /// The first refusals, at most `refusals_max`.
    fn judge(&self, values: &[Value], refusals_max: usize) -> Result<Draw, Vec<Refusal>> {
        let before = self.situation.memory;
        let after = self.after(values);
        let (mut effects, written) = self.effects(values, &after);
        let mut refusals = Vec::new();
        let mut spawns = Vec::new();
        for (nth, (effect, written)) in effects.iter().zip(&written).enumerate() {
            if refusals.len() >= refusals_max {
                return Err(refusals);
            }
            let request = match effect {
                Effect::Spawn(request) => request,
                Effect::Order(order) => {
                    refusals.extend(self.order_refusal(order, &effects[..nth]));
                    continue;
                }
                Effect::Light(light) => {
                    let refusal = self.situation.surroundings.light_refusal(light);
                    refusals.extend(refusal.map(|reason| refuse(None, reason)));
                    continue;
                }
                Effect::Time(_) | Effect::Sky(..) => {
                    let refusal =
                        self.situation.surroundings.weather_refusal().map(|reason| refuse(None, reason));
                    // One reason is enough for an action that sets several.
                    refusals.extend(refusal.filter(|refusal| !refusals.contains(refusal)));
                    continue;
                }
            };
            let is_beside = matches!(written, EffectDef::Spawn(spawn) if spawn.of.is_some());
            let least_m = match request.lane {
                LaneChoice::Current => spawn_distance_m(request.verb).start().max(0.0),
                LaneChoice::Left | LaneChoice::Right => *spawn_distance_m(request.verb).start(),
            };
            if is_beside && (request.distance_m.is_nan() || request.distance_m < least_m) {
                let why = if request.distance_m.is_nan() { ABSENT } else { PASSED };
                refusals.push(refuse(None, format!("cannot spawn: {why}")));
                continue;
            }
            if let Some(reason) = request.out_of_bounds() {
                refusals.push(refuse(None, reason));
                continue;
            }
            match self.situation.surroundings.survey(request) {
                Ok(facts) => spawns.push(facts),
                Err(reason) => refusals.push(refuse(None, format!("cannot spawn: {reason}"))),
            }
        }
        let world = WorldFacts { spawns, ..self.world() };
        let candidate = Candidate { values, before, after: &after, world: Some(&world) };
        let breaches = self.row.breaches(candidate).take(refusals_max.saturating_sub(refusals.len()));
        refusals.extend(breaches.map(|breach| {
            let rule = breach.rule().map(|rule| self.row.space.rules[rule].name.clone());
            refuse(rule, self.row.words(breach, candidate))
        }));
        if !refusals.is_empty() {
            return Err(refusals);
        }
        let courses = self.courses(values, &after, &written);
        // Changes by `each_step` come without a question: they are no action, and not the world's to refuse.
        for effect in Effect::of_change(self.row.space, before, &after) {
            if !effects.contains(&effect) {
                effects.push(effect);
            }
        }
        let lane_changes = self.lane_changes(values);
        let values = self.action.drawn_of(values);
        Ok(Draw { row: self.row.row.index, values, effects, memory_after: after, lane_changes, courses })
    }

    /// The rules on the lane changes of what the action spawns.
    fn lane_changes(&self, values: &[Value]) -> Option<Arc<LaneChangeRules>> {
        let conditions: Vec<Expr> = self.row.during().cloned().collect();
        (!conditions.is_empty()).then(|| {
            let later = self.later(values.to_vec());
            Arc::new(LaneChangeRules { conditions, later })
        })
    }

    /// The manoeuvres of its spawns and orders, each with the place of its effect among `written`.
    fn courses(&self, values: &[Value], after: &Memory, written: &[&EffectDef]) -> Vec<(usize, Arc<Course>)> {
        let space = self.row.space;
        let course = |call: &ManoeuvreCall| {
            let facts = self.facts(values, after);
            let value = |argument: &Expr| evaluate(argument, &space.functions, &facts);
            let later = self.later(call.arguments.iter().map(value).collect());
            let part = |manoeuvre: usize| Part {
                manoeuvre,
                definition: space.manoeuvres[manoeuvre].clone(),
                rules: self.row.on_phases(manoeuvre).cloned().collect(),
            };
            let all = reached(call.manoeuvre, |manoeuvre| space.manoeuvres.get(manoeuvre));
            let parts: Arc<[Part]> = all.into_iter().map(part).collect();
            Arc::new(Course::new(parts, 0, later))
        };
        let calls = written.iter().enumerate().filter_map(|(at, effect)| Some((at, effect.manoeuvre()?)));
        calls.map(|(at, call)| (at, course(call))).collect()
    }

    /// The expressions that are evaluated after the draw, with these values.
    fn later(&self, locals: Vec<Value>) -> Later {
        let space = self.row.space;
        Later {
            functions: space.functions.clone(),
            locals,
            road: self.row.road.cloned(),
            step_ms: (space.episode.step_s * 1000.0).round() as u64,
        }
    }

    fn facts<'f>(&'f self, values: &'f [Value], memory: &'f Memory) -> Facts<'f> {
        Facts { road: self.row.road, ..Facts::new(values, memory) }
    }

    /// The changes of the world, and beside each the effect that asks for it. They carry the values of the memory after the
    /// action, so that world and memory agree.
    fn effects<'f>(&'f self, locals: &[Value], after: &Memory) -> (Vec<Effect>, Vec<&'f EffectDef>) {
        let facts = self.facts(locals, after);
        let functions = &self.row.space.functions;
        // A road user that this row leaves out takes no order.
        let appears = |spawn: &SpawnDef| spawn.appears(functions, &facts);
        let missing = self.action.spawns().filter(|spawn| !appears(spawn)).filter_map(|spawn| spawn.bearer);
        let missing: Vec<usize> = missing.collect();
        let happens = |effect: &&EffectDef| match effect {
            EffectDef::Spawn(spawn) => appears(spawn),
            EffectDef::Order(order) => !missing.contains(&order.who.bearer(locals)),
            EffectDef::Set(_) | EffectDef::Light(_) => true,
        };
        let (mut effects, mut written) = (Vec::new(), Vec::new());
        for effect in self.action.effects.iter().filter(happens) {
            let mut add = |change: Effect| {
                effects.push(change);
                written.push(effect);
            };
            match effect {
                EffectDef::Set(set) => {
                    let state = &self.row.space.states[set.state];
                    let key = set.key.as_ref().map(|key| evaluate(key, functions, &facts).variant());
                    let touched = key.map_or(0..state.cells, |key| key..key + 1);
                    for change in touched.filter_map(|cell| Effect::of_cell(state, cell, after)) {
                        if !effects.contains(&change) {
                            effects.push(change);
                            written.push(effect);
                        }
                    }
                }
                EffectDef::Spawn(spawn) => add(Effect::Spawn(self.request(spawn, locals, after))),
                EffectDef::Order(order) => add(Effect::Order(self.order(order, locals, after))),
                EffectDef::Light(light) => add(Effect::Light(self.light(light, locals, after))),
            }
        }
        (effects, written)
    }

    /// The distance from the ego vehicle of a place beside another road user, m. It is NaN while that road user is
    /// absent, and below 0 on the other side of the ego vehicle.
    fn beside_m(
        &self,
        of: Who,
        spawn: &SpawnDef,
        distance_m: f64,
        length_m: f64,
        verb: Verb,
        locals: &[Value],
    ) -> f64 {
        let near_m = self.near_m(of, spawn.behind, distance_m, locals);
        let rear_m = if spawn.behind { near_m - length_m } else { near_m };
        match verb.begins_behind() {
            true => self.moment.ego_rear_m - rear_m - length_m,
            false => rear_m - self.moment.ego_front_m,
        }
    }

    /// Where a way beside the ego vehicle's route begins: at NaN m beside a road user that is absent.
    fn begins(&self, spawn: &SpawnDef, distance_m: f64, locals: &[Value]) -> Begins {
        let Some(of) = spawn.of else {
            return match spawn.behind {
                true => Begins::BehindRear(distance_m),
                false => Begins::BeforeFront(distance_m),
            };
        };
        Begins::BeforeFront(self.near_m(of, spawn.behind, distance_m, locals) - self.moment.ego_front_m)
    }

    /// The station on the ego vehicle's route this far ahead of a road user's front, or behind its rear, m; NaN while
    /// it is absent.
    fn near_m(&self, of: Who, behind: bool, distance_m: f64, locals: &[Value]) -> f64 {
        let who = of.bearer(locals);
        let Some((_, npc)) = self.bearers.iter().find(|(known, _)| *known == who) else { return f64::NAN };
        if behind { npc.rear_m - distance_m } else { npc.front_m + distance_m }
    }

    fn request(&self, spawn: &SpawnDef, locals: &[Value], after: &Memory) -> SpawnRequest {
        let functions = &self.row.space.functions;
        let facts = self.facts(locals, after);
        let own = |body: BodyWord| {
            let shape = |index: usize| self.row.space.bodies[index].shape;
            body.own.map(|index| OwnBody { index, shape: shape(index) })
        };
        let body = spawn.body.word(functions, &facts);
        let cover = spawn.cover.as_ref().map(|cover| cover.word(functions, &facts));
        // The bodies of a row are all of one kind.
        let shape = own(body).map_or_else(|| parameters(body.like), |own| own.shape);
        let verb = spawn.verb.word(functions, &facts);
        let behind_first_m = spawn.behind_first_m(shape.length_m, functions, &facts);
        let is_first = behind_first_m == 0.0;
        let first_asked_m = evaluate(&spawn.distance, functions, &facts).number();
        // Those who cross come one after the other to where the first meets the ego vehicle.
        let (asked_m, behind_first_m) = match (first_asked_m, verb) {
            (asked_m, Verb::CrossRoad) => (asked_m, behind_first_m),
            (asked_m, _) => (asked_m + behind_first_m, 0.0),
        };
        let trajectory = spawn.trajectory.as_ref().map(|one| one.word(functions, &facts));
        let is_beside_route = |index: usize| self.row.space.trajectories[index].is_beside_route();
        let begins = trajectory.filter(|index| is_beside_route(*index));
        let begins = begins.map(|_| self.begins(spawn, asked_m, locals));
        let distance_m = |asked_m: f64| match spawn.of {
            _ if begins.is_some() => 0.0,
            None => rounded_into(asked_m, spawn_distance_m(verb)),
            Some(of) => self.beside_m(of, spawn, asked_m, shape.length_m, verb, locals),
        };
        SpawnRequest {
            body: body.like,
            own: own(body),
            cover_own: cover.and_then(own),
            colour: spawn.colour.word(functions, &facts),
            verb,
            lane: spawn.lane.word(functions, &facts),
            side: spawn.side.word(functions, &facts),
            then: spawn.then.word(functions, &facts),
            speed_mps: rounded_into(evaluate(&spawn.speed, functions, &facts).number(), SPAWN_SPEED_MPS),
            distance_m: distance_m(asked_m),
            first_m: (!is_first).then(|| distance_m(first_asked_m)),
            cover: cover.map(|cover| cover.like),
            told: spawn.told.evaluate(functions, &facts),
            trajectory: trajectory.map(|index| OnTrajectory { index, begins }),
            behind_first_m,
            bearer: spawn.bearer,
        }
    }

    fn order(&self, order: &OrderDef, locals: &[Value], after: &Memory) -> OrderRequest {
        let facts = self.facts(locals, after);
        let command = order.command.evaluate(&self.row.space.functions, &facts);
        let of = |manoeuvre: usize| self.row.space.manoeuvres.get(manoeuvre);
        let needed = |call: &ManoeuvreCall| told(call.manoeuvre, of);
        let phases = order.manoeuvre.as_ref().map_or(Told::NOTHING, needed);
        OrderRequest { bearer: order.who.bearer(locals), command, phases }
    }

    fn light(&self, light: &LightDef, locals: &[Value], after: &Memory) -> LightRequest {
        let (functions, facts) = (&self.row.space.functions, self.facts(locals, after));
        let at_m = |at: &Expr| rounded_into(evaluate(at, functions, &facts).number(), LIGHT_AT_M);
        LightRequest { colour: light.colour.word(functions, &facts), at_m: light.at.as_ref().map(at_m) }
    }

    /// Why an order cannot be given after the effects before it. A road user that one of them spawns under that name
    /// counts as present.
    fn order_refusal(&self, order: &OrderRequest, before: &[Effect]) -> Option<Refusal> {
        let spawned = |who: usize| {
            before.iter().rev().find_map(|effect| match effect {
                Effect::Spawn(request) if request.bearer == Some(who) => Some(request.verb),
                Effect::Spawn(_)
                | Effect::Time(_)
                | Effect::Sky(..)
                | Effect::Order(_)
                | Effect::Light(_) => None,
            })
        };
        let is_there = |who: usize| self.bearers.iter().any(|(known, _)| *known == who);
        // The world does not yet know the gap to a road user that appears with the order.
        let to = order.command.to().filter(|to| *to == order.bearer || spawned(*to).is_none());
        let impossible = || match (spawned(order.bearer), to) {
            (None, _) => {
                let mut command = order.command;
                command.set(Field::To, to.map(Said::Who));
                self.situation.surroundings.order_refusal(&OrderRequest { command, ..*order })
            }
            (Some(verb), to) => order.impossible(verb).or_else(|| match to? {
                to if to == order.bearer => Some(GAP_TO_ITSELF.to_owned()),
                to => (!is_there(to)).then(|| GAP_TO_NOBODY.to_owned()),
            }),
        };
        let name = || &self.row.space.bearers[order.bearer];
        let reason = order
            .command
            .out_of_bounds("order")
            .or_else(|| Some(format!("cannot order `{}`: {}", name(), impossible()?)));
        reason.map(|reason| refuse(None, reason))
    }

    /// The memory after the step.
    fn after(&self, values: &[Value]) -> Memory {
        let RowRules { space, row, road, .. } = self.row;
        space.memory_after(row.action, values, self.situation.memory, road, Some(&self.world()))
    }

    /// The world's facts before it is asked about spawns.
    fn world(&self) -> WorldFacts {
        let (bearers, happened_s) = (self.bearers.clone(), self.situation.happened_s.to_vec());
        let step = self.situation.step;
        WorldFacts { moment: self.moment, step, bearers, happened_s, ..WorldFacts::default() }
    }

    /// Why there are no values, in words.
    fn refused(&self, unsolved: &Unsolved, world: &WorldFacts) -> Refusal {
        let space = self.row.space;
        let values = &unsolved.values;
        let after = self.after(values);
        let candidate =
            Candidate { values, before: self.situation.memory, after: &after, world: Some(world) };
        let clause = unsolved.clause.map(|clause| &space.clauses[self.row.row.action][clause]);
        let rule = clause.and_then(Clause::rule);
        let named = rule.map(|rule| space.rules[rule].name.clone());
        let Some(local) = unsolved.local else {
            let breach = self.row.breaches(candidate).find(|breach| breach.rule() == rule);
            let words = breach.map(|breach| self.row.words(breach, candidate));
            return refuse(named, words.unwrap_or_else(|| "its conditions leave no value".to_owned()));
        };
        let Parameter { name, ty, domain, .. } = &self.action.parameters[local];
        let range = match domain {
            Domain::Values(_) => format!("none of its values {}", self.values_of(domain, *ty)),
            Domain::Range(..) => format!("no value of its range {}", self.values_of(domain, *ty)),
        };
        let bound = rule
            .and_then(|rule| self.row.broken_bounds(rule, candidate, None).find(|(b, _)| b.local == local));
        let wanted = match bound {
            Some((bound, limit)) => format!("it wants {} {}", bound.op.symbol(), space.show(limit, *ty)),
            None => "with the values of the others".to_owned(),
        };
        refuse(named, format!("`{name}`: {range} is possible, {wanted}"))
    }

    /// The values of a list or the ends of a range, in words.
    fn values_of(&self, domain: &Domain, ty: Type) -> String {
        let space = self.row.space;
        match domain {
            Domain::Values(values) => {
                // A value that is likelier stands in the list more than once.
                let mut words: Vec<String> = Vec::new();
                for word in space.show_all(values, ty) {
                    if !words.contains(&word) {
                        words.push(word);
                    }
                }
                words.join(" | ")
            }
            Domain::Range(low, high) => {
                let ends = [low, high].map(|end| Value::Number(end.to_f64()));
                space.show_all(&ends, ty).join(" .. ")
            }
        }
    }

    fn out_of_range(&self, parameter: &Parameter, value: Value) -> Refusal {
        let shown = self.row.space.show(value, parameter.ty);
        let range = self.values_of(&parameter.domain, parameter.ty);
        refuse(None, format!("`{}` is {shown}, its range is {range}", parameter.name))
    }
}

/// Draws every value with equal chances, but for the shares that are given.
struct Chance<'a> {
    rng: &'a mut Rng,
    /// By parameter: where in its range the value is to lie, in `[0, 1)`. A share is used once: a solver that asks
    /// again could not use the same value.
    shares: Vec<Option<f64>>,
}

impl Chance<'_> {
    fn share(&mut self, local: usize) -> Option<f64> {
        self.shares.get_mut(local).and_then(Option::take)
    }
}

impl Choose for Chance<'_> {
    fn value(&mut self, local: usize, left: &[Value]) -> Value {
        match self.share(local) {
            Some(share) => left[((share * left.len() as f64) as usize).min(left.len() - 1)],
            None => left[rng::below(self.rng, left.len() as u32) as usize],
        }
    }

    fn number(&mut self, local: usize, room: &Room) -> Option<f64> {
        // Also where a rule sets the value: to switch it off must not shift later draws.
        room.at(self.share(local).unwrap_or_else(|| rng::unit(self.rng)))
    }
}

fn refuse(rule: Option<String>, reason: String) -> Refusal {
    Refusal { rule, reason }
}

/// The first of several refusals; judging never fails without one.
fn first(refusals: Vec<Refusal>) -> Refusal {
    refusals.into_iter().next().expect("a judgement that fails names its reason")
}
