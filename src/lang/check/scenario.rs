//! Scenarios: checks a timeline against its space, with the start and every step. Its claims are in `scenario_claim`.

use std::cell::Cell;
use std::sync::Arc;

use core::ops::{Range, RangeInclusive};

use crate::check::mistakes::Report;
use crate::check::names::docs;
use crate::check::names::unknown;
use crate::check::scenario_condition::condition;
use crate::check::scenario_rules::{Moment, breaches, broken_start};
use crate::check::scenario_value::{number, value};
use crate::model::expr::Expr;
use crate::model::rules::{Before, Nearest, RowRules, TRIES_MAX};
use crate::model::scenario::{Condition, Origin, Scenario, ScenarioStart, ScenarioStep, Trigger, ticks_s};
use crate::model::vocabulary::{OriginField, StartField, WAIT, Word};
use crate::model::{
    AMBIENT_MAX, Domain, Initial, Memory, Parameter, RoadFacts, Row, RulesInForce, SIGNAL_PHASE_S,
    SPEED_MPS_MAX, START_MPS, Space, StateDef, TICK_MS, Value, code, locals,
};
use crate::syntax::{Diagnostic, ast, listed, print_expr};
use avastra_base::units::Dimension;

/// Step numbers must be below this.
const STEPS_MAX: u64 = 100_000;

/// The scenario of a file, checked against the space that it uses.
///
/// # Errors
/// All mistakes in the scenario. A file without a scenario, or with two, is an error too.
pub fn scenario(file: &ast::File, space: &Space) -> Result<Scenario, Vec<Diagnostic>> {
    let mut found = file.items.iter().filter_map(|item| Some((item, item.kind.as_scenario()?)));
    let Some((item, declared)) = found.next() else {
        let error = Diagnostic::error(code::ONE_SCENARIO, "the file holds no scenario");
        return Err(vec![error.at(file.span, "")]);
    };
    if let Some((second, _)) = found.next() {
        let error = Diagnostic::error(code::ONE_SCENARIO, "the file holds two scenarios");
        return Err(vec![error.at(second.span, "the second").help("one file, one scenario")]);
    }
    let mut reader = Reader { space, diagnostics: Vec::new() };
    let origin = reader.origin(&declared.origin);
    let road = reader.road(&declared.road);
    let start = reader.start(declared, road);
    if let (true, Some(road)) = (reader.diagnostics.is_empty(), road) {
        let in_force = reader.in_force(&origin);
        let at = declared.start.first().map_or(declared.name.span, |field| field.name.span);
        reader.diagnostics.extend(broken_start(space, &start.memory, &space.roads[road], &in_force, at));
    }
    let steps = reader.steps(&declared.steps, &start.memory, &origin, road);
    let claims = declared.expects.iter().filter_map(|expect| reader.claim(expect)).collect();
    let docs = docs(item);
    let name = declared.name.text.clone();
    match road {
        Some(road) if reader.diagnostics.is_empty() => {
            Ok(Scenario { name, docs, origin, road, start, steps, claims })
        }
        _ => Err(reader.diagnostics),
    }
}

/// The row that a call means. It names the values of the axes, or gives them in their order.
///
/// # Errors
/// If there is no such row.
pub(crate) fn row<'a>(space: &'a Space, call: &ast::Call) -> Result<&'a Row, Vec<Diagnostic>> {
    let mut reader = Reader { space, diagnostics: Vec::new() };
    reader.row(call).ok_or(reader.diagnostics)
}

/// Reads parts of a scenario and collects what is wrong with them.
pub(super) struct Reader<'a> {
    pub space: &'a Space,
    pub diagnostics: Vec<Diagnostic>,
}

impl Report for Reader<'_> {
    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }
}

/// Where a step stands.
struct Place<'a> {
    /// Index in `Space::roads`; `None` if the road is unknown.
    road: Option<usize>,
    in_force: &'a RulesInForce,
    /// The memory before it.
    before: &'a Memory,
}

impl<'a> Reader<'a> {
    fn origin(&mut self, fields: &[ast::Field]) -> Origin {
        let mut origin = Origin::default();
        for (field, value) in self.fields_known(fields) {
            match field {
                OriginField::Seed => origin.seed = self.whole(value),
                OriginField::Episode => origin.episode = self.whole(value),
                OriginField::Policy => origin.policy = self.text(value),
                OriginField::Ads => origin.ads = self.text(value),
                OriginField::Profile => origin.profile = self.text(value),
                OriginField::ProfileDigest => origin.profile_digest = self.text(value),
                OriginField::Answers => origin.answers = self.text(value),
                OriginField::Engine => origin.engine = self.text(value),
                OriginField::Traffic => origin.traffic = self.text(value),
                OriginField::TrafficDigest => origin.traffic_digest = self.text(value),
                OriginField::With => origin.with = self.rule_names(value),
                OriginField::Without => origin.without = self.rule_names(value),
            }
        }
        origin
    }

    fn rule_names(&mut self, list: &ast::Expr) -> Vec<String> {
        let ast::ExprKind::List(items) = &list.kind else {
            let error = Diagnostic::error(code::TYPE_MISMATCH, "wanted a list of rules and requirements");
            self.report(error.at(list.span, "not a list"));
            return Vec::new();
        };
        let mut names = Vec::new();
        for item in items {
            let Some(name) = self.name_of(item, "a rule or a requirement") else { continue };
            let rules = self.space.rules.iter().map(|rule| rule.name.as_str());
            let required = self.space.requirements.iter().map(|required| required.name.as_str());
            let known = rules.chain(required);
            match known.clone().any(|known| known == name) {
                true => names.push(name.to_owned()),
                false => self.report(unknown("rule or requirement", name, item.span, known)),
            }
        }
        names
    }

    fn road(&mut self, name: &ast::Name) -> Option<usize> {
        let roads = || self.space.roads.iter().map(|road| road.name.as_str());
        let found = roads().position(|road| road == name.text);
        found.or_else(|| self.reject(unknown("road", &name.text, name.span, roads())))
    }

    fn start(&mut self, declared: &ast::Scenario, road: Option<usize>) -> ScenarioStart {
        let space = self.space;
        // Any seed will do: every state that it draws is replaced below or reported as missing.
        let mut start = ScenarioStart {
            memory: space.initial_memory(0),
            signal_phase_s: road.and_then(|road| self.space.roads[road].signal_phase_s).unwrap_or(0.0),
            traffic_seed: None,
            ambient: 0,
            ego_mps: road.map_or(START_MPS, |road| self.space.roads[road].ego_mps),
        };
        self.fields_once("field", &declared.start);
        for field in &declared.start {
            match StartField::from_name(&field.name.text) {
                Some(StartField::SignalPhase) => {
                    let wanted = (Dimension::DURATION, "s", SIGNAL_PHASE_S, "a signal phase");
                    start.signal_phase_s = self.bounded(field, wanted).unwrap_or(start.signal_phase_s);
                }
                Some(StartField::EgoSpeed) => {
                    let wanted = (Dimension::SPEED, "m/s", 0.0..=SPEED_MPS_MAX, "a speed");
                    start.ego_mps = self.bounded(field, wanted).unwrap_or(start.ego_mps);
                }
                Some(StartField::TrafficSeed) => start.traffic_seed = self.whole(&field.value),
                Some(StartField::Ambient) => {
                    let wanted = self.whole(&field.value).unwrap_or(0);
                    if wanted > u64::from(AMBIENT_MAX) {
                        let message = format!("{wanted} ambient vehicles are not possible");
                        let error = Diagnostic::error(code::OUT_OF_RANGE, message);
                        self.report(
                            error.at(field.value.span, format!("must lie within 0 .. {AMBIENT_MAX}")),
                        );
                    }
                    start.ambient = wanted.min(u64::from(AMBIENT_MAX)) as u32;
                }
                None => match space.state(&field.name.text) {
                    Some(state) => self.start_state(state, &field.value, &mut start.memory),
                    None => {
                        let states = space.states.iter().map(|state| state.name.as_str());
                        let names = states.chain(StartField::names());
                        self.report(unknown("state or field", &field.name.text, field.name.span, names));
                    }
                },
            }
        }
        for state in &space.states {
            self.check_open(state, declared);
        }
        start
    }

    /// The number of a field of the start in SI units, if it lies within its range.
    fn bounded(
        &mut self,
        field: &ast::Field,
        (dimension, unit, range, what): (Dimension, &str, RangeInclusive<f64>, &str),
    ) -> Option<f64> {
        let found = self.take(number(&field.value, dimension))?;
        if !range.contains(&found) {
            let message = format!("{what} of {found} {unit} is not possible");
            let range = format!("{} .. {} {unit}", range.start(), range.end());
            let error = Diagnostic::error(code::OUT_OF_RANGE, message);
            self.report(error.at(field.value.span, format!("must lie within {range}")));
            return None;
        }
        Some(found)
    }

    /// Reports a state of which the start leaves something to chance.
    fn check_open(&mut self, state: &StateDef, declared: &ast::Scenario) {
        let given = declared.start.iter().find(|field| field.name.text == state.name);
        let key = |cell: usize| state.key.map_or("", |of| self.space.enums[of.0].variants[cell].as_str());
        let is_given = |cell: usize| match given.map(|field| &field.value.kind) {
            Some(ast::ExprKind::Record(keys)) => keys.iter().any(|known| known.name.text == key(cell)),
            Some(_) => true,
            None => false,
        };
        let mut drawn = (0..state.cells).filter(|cell| state.initial[*cell] == Initial::Any);
        let Some(open) = drawn.find(|cell| !is_given(*cell)) else { return };
        let (name, example) = match given {
            None => (state.name.clone(), format!("{}: …", state.name)),
            Some(_) => (
                self.space.cell_name(state.first_cell + open),
                format!("{}: {{ {}: … }}", state.name, key(open)),
            ),
        };
        let error = Diagnostic::error(code::OPEN_START, format!("the start does not say `{name}`"));
        let error = error.at(declared.name.span, "a scenario leaves nothing to chance");
        self.report(error.help(format!("add `start {{ {example} }}`")));
    }

    /// `time: Noon`, `sky: None` for all keys, `sky: { Rain: High }` for some.
    pub(super) fn start_state(&mut self, state: &StateDef, given: &ast::Expr, memory: &mut Memory) {
        let space = self.space;
        if let (ast::ExprKind::Record(fields), Some(of)) = (&given.kind, state.key) {
            let keys = &space.enums[of.0].variants;
            self.fields_once("key", fields);
            for field in fields {
                match keys.iter().position(|key| *key == field.name.text) {
                    Some(key) => {
                        if let Some(value) = self.take(value(space, &field.value, state.ty)) {
                            memory.cells[state.first_cell + key] = value;
                        }
                    }
                    None => {
                        let keys = keys.iter().map(String::as_str);
                        self.report(unknown("key", &field.name.text, field.name.span, keys));
                    }
                }
            }
        } else if let Some(value) = self.take(value(space, given, state.ty)) {
            memory.cells[state.first_cell..][..state.cells].fill(value);
        }
    }

    fn in_force(&self, origin: &Origin) -> RulesInForce {
        let in_force = RulesInForce::new(self.space, &origin.with, &origin.without);
        in_force.expect("the origin was read without the names that are no rules")
    }

    fn steps(
        &mut self,
        declared: &[ast::Step],
        start: &Memory,
        origin: &Origin,
        road: Option<usize>,
    ) -> Vec<ScenarioStep> {
        let in_force = self.in_force(origin);
        let mut steps: Vec<ScenarioStep> = Vec::new();
        let mut history = vec![(0, start.clone())];
        // The number of steps that are over.
        let mut over = 0;
        for step in declared {
            let Ok(number) = step.number.digits.parse::<u64>() else {
                let error = Diagnostic::error(code::STEP_ORDER, "the number of the step is too large");
                self.report(error.at(step.number.span, ""));
                continue;
            };
            if let Some(last) = steps.last().filter(|last| last.number >= number) {
                let message = format!("step {number} stands after step {}", last.number);
                let error = Diagnostic::error(code::STEP_ORDER, message).at(step.number.span, "out of order");
                self.report(error.help("number the steps upwards"));
            }
            if number >= STEPS_MAX {
                let error = Diagnostic::error(code::STEP_ORDER, format!("step {number} lies too far ahead"));
                self.report(error.at(step.number.span, format!("less than {STEPS_MAX} is possible")));
                continue;
            }
            let rules = (road.map(|road| &self.space.roads[road].facts), &in_force);
            let waits = self.is_wait(step);
            self.wait(over..number + u64::from(waits), rules, &mut history);
            over = over.max(number + 1);
            let trigger = self.trigger(step);
            if waits {
                if let Some(clause) = step.once.as_ref().or(step.after.as_ref()) {
                    let error =
                        Diagnostic::error(code::TRIGGER, "`wait()` does nothing, so it waits for nothing");
                    self.report(
                        error.at(clause.span, "no action to be carried out then").help("remove the clause"),
                    );
                }
                steps.push(ScenarioStep { number, row: None, drawn: Vec::new(), trigger: None });
                continue;
            }
            let Some(row) = self.row(&step.action) else { continue };
            let action = &self.space.actions[row.action];
            let memory = &history[history.len() - 1].1;
            let place = Place { road, in_force: &in_force, before: memory };
            let Some(drawn) = self.drawn(step, row, &place) else { continue };
            let locals = locals(action, row, &drawn);
            let road_facts = road.map(|road| &self.space.roads[road].facts);
            let after = self.space.memory_after(row.action, &locals, memory, road_facts, None);
            let moment = Moment { step, row, locals: &locals, after: &after, history: &history, road };
            self.diagnostics.extend(breaches(self.space, &moment, &in_force));
            history.push((number, after));
            steps.push(ScenarioStep { number, row: Some(row.index), drawn, trigger });
        }
        steps
    }

    /// Steps without an action change the states too, whether they are written or left out.
    fn wait(
        &self,
        steps: Range<u64>,
        (road, in_force): (Option<&RoadFacts>, &RulesInForce),
        history: &mut Vec<(u64, Memory)>,
    ) {
        let asks_for_step =
            |rule: usize| self.space.rules[rule].start.as_ref().is_some_and(Expr::asks_the_world);
        let is_timed = in_force.all().any(asks_for_step);
        for number in steps {
            let before = &history[history.len() - 1].1;
            let after = self.space.memory_after_wait(before, number, road, None, in_force);
            if after != *before {
                history.push((number, after));
            } else if !is_timed {
                // So it goes on until the next action.
                return;
            }
        }
    }

    /// `once ego.junction_ahead <= 40 m after 1 s`.
    fn trigger(&mut self, step: &ast::Step) -> Option<Arc<Trigger>> {
        let once = step.once.as_ref().and_then(|once| {
            let expr = condition(self.space, once).map_err(|errors| self.diagnostics.extend(errors)).ok()?;
            Some(Condition { expr, text: print_expr(once) })
        });
        let held_ticks = step.held.as_ref().map_or(Some(0), |held| self.after_ticks(held))?;
        let after_ticks = step.after.as_ref().map_or(Some(0), |after| self.after_ticks(after))?;
        let clause = step.once.as_ref().or(step.after.as_ref());
        if let Some(clause) = clause.filter(|_| !self.space.each_step.is_empty()) {
            let error =
                Diagnostic::error(code::TRIGGER, "in this space, actions happen when their step begins");
            let error = error.at(clause.span, "what `each step` does would come before it");
            return self.reject(error.help("write the action in a later step"));
        }
        let trigger = Trigger { once, held_ticks, after_ticks };
        (trigger.once.is_some() || trigger.after_ticks > 0).then(|| Arc::new(trigger))
    }

    fn after_ticks(&mut self, after: &ast::Expr) -> Option<u32> {
        let after_s = self.take(number(after, Dimension::DURATION))?;
        let step_s = self.space.episode.step_s;
        let ticks = (after_s * 1000.0 / TICK_MS as f64).round();
        if !(0.0..step_s).contains(&after_s) {
            let message = format!("`after {}` is not within the step", print_expr(after));
            let error = Diagnostic::error(code::TRIGGER, message);
            let error = error.at(after.span, format!("a step lasts {step_s} s"));
            return self
                .reject(error.help("write the action in a later step, and the rest of the time here"));
        }
        if (ticks * TICK_MS as f64 / 1000.0 - after_s).abs() > 1e-9 {
            let message = format!("nothing happens after `{}`", print_expr(after));
            let error = Diagnostic::error(code::TRIGGER, message);
            // The end of the step belongs to the next one.
            let last = (step_s * 1000.0 / TICK_MS as f64).round() - 1.0;
            let near = ticks_s(ticks.min(last) as u32);
            let error = error.at(after.span, format!("time passes in ticks of {TICK_MS} ms"));
            return self.reject(error.help(format!("the nearest is {near} s")));
        }
        Some(ticks as u32)
    }

    /// `wait()` is a step without an action, unless the space has an action of that name.
    fn is_wait(&self, step: &ast::Step) -> bool {
        step.action.name.text == WAIT.0
            && step.action.args.is_empty()
            && step.drawn.is_empty()
            && !self.space.actions.iter().any(|action| action.name == WAIT.0)
    }

    /// The row that a call means. It names the values of the axes, or gives them in their order.
    fn row(&mut self, call: &ast::Call) -> Option<&'a Row> {
        let space = self.space;
        let Some(action) = space.actions.iter().position(|action| action.name == call.name.text) else {
            let actions = space.actions.iter().map(|action| action.name.as_str());
            return self.reject(unknown("action", &call.name.text, call.name.span, actions));
        };
        let axes: Vec<&Parameter> = space.actions[action].parameters.iter().filter(|p| p.axis).collect();
        let mut values: Vec<Option<Value>> = vec![None; axes.len()];
        let names: Vec<&str> = axes.iter().map(|axis| &*axis.name).collect();
        let mut given = vec![None; axes.len()];
        let mut sound = true;
        for (position, argument) in call.args.iter().enumerate() {
            let Some(slot) = self.slot(call, position, &names, &mut given) else {
                sound = false;
                continue;
            };
            values[slot] = self.take(value(space, &argument.value, axes[slot].ty));
            sound &= values[slot].is_some();
        }
        let mut missing = axes.iter().zip(&values).filter(|(_, value)| value.is_none() && sound);
        if let Some((axis, _)) = missing.next() {
            let message = format!("`{}` is missing", axis.name);
            let error = Diagnostic::error(code::ARGUMENTS, message).at(call.span, "which row is meant?");
            return self.reject(error.beside(axis.span, "declared here"));
        }
        let values: Vec<Value> = values.into_iter().collect::<Option<_>>()?;
        let same = |row: &&Row| row.axes.iter().zip(&values).all(|((_, axis), value)| axis == value);
        let row = space.rows_of(action).iter().find(same);
        if row.is_none() {
            let message = format!("`{}` has no such row", call.name.text);
            let error = Diagnostic::error(code::NO_SUCH_ROW, message)
                .at(call.span, "excluded by a `where` or an `in`");
            let error = error.beside(space.actions[action].span, "declared here");
            let labels: Vec<&str> = space.rows_of(action).iter().map(|row| row.label.as_str()).collect();
            self.report(match labels.len() {
                1..=6 => error.help(format!("there is {}", listed(&labels))),
                _ => error.help("`avastra table FILE` lists the rows"),
            });
        }
        row
    }

    fn drawn(&mut self, step: &ast::Step, row: &Row, place: &Place<'_>) -> Option<Vec<(Arc<str>, Value)>> {
        let action = &self.space.actions[row.action];
        let mut sound = true;
        self.fields_once("drawn value", &step.drawn);
        for field in &step.drawn {
            if !action.drawn().any(|parameter| *parameter.name == *field.name.text) {
                let names = action.drawn().map(|parameter| &*parameter.name);
                self.report(unknown("drawn value", &field.name.text, field.name.span, names));
                sound = false;
            }
        }
        let mut values = Vec::new();
        let mut missing = Vec::new();
        for parameter in action.drawn() {
            let Some(field) = step.drawn.iter().find(|field| *parameter.name == *field.name.text) else {
                missing.push(parameter);
                continue;
            };
            let Some(value) = self.take(value(self.space, &field.value, parameter.ty)) else {
                sound = false;
                continue;
            };
            if !parameter.domain.holds(value) {
                let shown = self.space.show(value, parameter.ty);
                let error =
                    Diagnostic::error(code::OUT_OF_RANGE, format!("`{}` cannot be {shown}", parameter.name));
                let label = match &parameter.domain {
                    Domain::Range(low, high) => {
                        let ends = [low, high].map(|end| Value::Number(end.to_f64()));
                        format!("must lie within {}", self.space.show_all(&ends, parameter.ty).join(" .. "))
                    }
                    Domain::Values(_) => "is not among its values".to_owned(),
                };
                self.report(error.at(field.value.span, label).beside(parameter.span, "declared here"));
                sound = false;
            }
            values.push((parameter.name.clone(), value));
        }
        if !missing.is_empty() {
            let error = self.missing(step, row, place, &missing, values);
            return self.reject(error);
        }
        sound.then_some(values)
    }

    /// The error for drawn values that a step lacks, with an example of each: the value that a rule sets, else
    /// the first value of the list or the low end of the range.
    fn missing(
        &self,
        step: &ast::Step,
        row: &Row,
        place: &Place<'_>,
        missing: &[&Parameter],
        mut values: Vec<(Arc<str>, Value)>,
    ) -> Diagnostic {
        let space = self.space;
        let action = &space.actions[row.action];
        let names: Vec<&str> = missing.iter().map(|parameter| &*parameter.name).collect();
        let (what, is) = if names.len() == 1 { ("value", "is") } else { ("values", "are") };
        let message = format!("the drawn {what} {} {is} missing", listed(&names));
        let error =
            Diagnostic::error(code::NOT_DRAWN, message).at(step.span, "a scenario leaves nothing to chance");
        let error =
            missing.iter().fold(error, |error, parameter| error.beside(parameter.span, "declared here"));
        for parameter in missing {
            let value = match &parameter.domain {
                Domain::Values(values) => values[0],
                Domain::Range(low, _) => Value::Number(low.to_f64()),
            };
            values.push((parameter.name.clone(), value));
        }
        let mut known = locals(action, row, &values);
        let indices = || (0..known.len()).filter(|local| names.contains(&&*action.parameters[*local].name));
        let missing: Vec<usize> = indices().collect();
        let Place { road, in_force, before } = *place;
        if let Some(road) = road {
            let road = Some(&space.roads[road].facts);
            let is_number = |local: &usize| matches!(known[*local], Value::Number(_));
            let open: Vec<usize> = missing.iter().copied().filter(is_number).collect();
            // A rule that the given values break alone is no reason against an example for the others.
            let in_force = RowRules { space, row, road, in_force }.deciding(&open);
            let rules = RowRules { space, row, road, in_force: &in_force };
            let tries = Cell::new(TRIES_MAX);
            let before = Before { memory: before, world: None, tries: &tries };
            let mut example = Nearest { wanted: known.clone() };
            if let Ok(solved) = rules.solve(known.clone(), &open, before, &mut example) {
                known = solved;
            }
        }
        let shown = missing.iter().map(|local| {
            let parameter = &action.parameters[*local];
            format!("{}: {}", parameter.name, space.show(known[*local], parameter.ty))
        });
        let shown = shown.collect::<Vec<_>>().join(", ");
        let error = error.help(format!("for example `{shown}`"));
        let end = |span: ast::Span| ast::Span::new(span.file, span.end, span.end);
        match step.drawn.last() {
            Some(last) => error.fix(format!("add `{shown}`"), end(last.span), format!(", {shown}")),
            None if step.span.end == step.action.span.end => {
                let text = format!(" with {{ {shown} }}");
                error.fix(format!("add `{}`", text.trim_start()), end(step.span), text)
            }
            None => error,
        }
    }

    fn whole(&mut self, value: &ast::Expr) -> Option<u64> {
        let found = match &value.kind {
            ast::ExprKind::Number(number) if number.unit.is_none() => number.digits.parse().ok(),
            _ => None,
        };
        found.or_else(|| {
            let error = Diagnostic::error(code::TYPE_MISMATCH, "wanted a whole number");
            self.reject(error.at(value.span, "not one"))
        })
    }

    fn text(&mut self, value: &ast::Expr) -> Option<String> {
        match &value.kind {
            ast::ExprKind::Text(text) => Some(text.clone()),
            _ => self.reject(
                Diagnostic::error(code::TYPE_MISMATCH, "wanted a text in quotes")
                    .at(value.span, "not a text"),
            ),
        }
    }
}
