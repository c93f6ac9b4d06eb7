//! Choosing the drawn values of a row from exactly what its rules leave, one parameter after the other.
//!
//! The room of a number is found by trying. Between two neighbouring places where a clause may change (`critical`), every
//! clause holds everywhere or nowhere. Only a part of 1e-9 beside the place differs, where numbers count as equal. So one
//! try in between and one at each place decide. A try is judged as drawing and replaying judge ([`RowRules::breaches`]).
//!
//! 1. Forwards: each parameter gets what the clauses leave that no later parameter decides. That is nearly always
//!    enough, and cheap.
//! 2. If a later parameter is left without a value by what was chosen before it, all are chosen again. Each then gets
//!    only the values that leave values to all later ones. The places where that may change come from polynomials
//!    without the later numbers (`polynomial::project`).
//!
//! Both draw from the same values with the same shares: where the first way fails, the second draws again. The values
//! that it leaves after choices from lists are kept for further draws: there are few such choices, and they come again.

use std::borrow::Cow;
use std::cell::Cell;
use std::rc::Rc;

use crate::model::effort;
use crate::model::eval::evaluate;
use crate::model::expr::{Comparison, ExprKind};
use crate::model::facts::{Facts, WorldFacts};
use crate::model::rules::critical::polynomials;
use crate::model::rules::polynomial::{NUMBERS_MAX, Polynomial, project};
use crate::model::rules::{Candidate, Clause, Room, RowRules, RulesInForce};
use crate::model::space::{ActionDef, Domain};
use crate::model::value::{Memory, Value};

/// The most judgements for one draw. Rows that need more are refused when they are compiled.
pub const TRIES_MAX: usize = 50_000;

/// A number this far from both ends of its range, SI, equals neither end, nor what is tried between: equality tolerates a
/// part of 1e-9.
const WELL_WITHIN: f64 = 1.0;

/// The facts known before a row is solved.
#[derive(Clone, Copy)]
pub struct Before<'a> {
    pub memory: &'a Memory,
    /// As in [`Candidate`]. The spawns are not known yet, so a rule about them holds.
    pub world: Option<&'a WorldFacts>,
    /// Judgements that may still be made; at 0 nothing more is found.
    pub tries: &'a Cell<usize>,
}

/// Chooses one of the values that are left.
pub trait Choose {
    /// One of several values from a list; never asked about none.
    fn value(&mut self, local: usize, left: &[Value]) -> Value;

    /// A number of a room that is not empty.
    fn number(&mut self, local: usize, room: &Room) -> Option<f64>;
}

/// Chooses what is nearest to wanted values, by parameter.
pub struct Nearest {
    pub wanted: Vec<Value>,
}

impl Choose for Nearest {
    fn value(&mut self, local: usize, left: &[Value]) -> Value {
        let wanted = self.wanted[local];
        if left.contains(&wanted) { wanted } else { left[0] }
    }

    fn number(&mut self, local: usize, room: &Room) -> Option<f64> {
        room.nearest(self.wanted[local].number())
    }
}

/// No values were found.
#[derive(Debug, Clone)]
pub struct Unsolved {
    /// The clause that leaves nothing, as an index in `Space::clauses` of the action; that of the last try, if
    /// several share it.
    pub clause: Option<usize>,
    /// The parameter that it leaves without a value; `None` if the clause depends on nothing that is drawn.
    pub local: Option<usize>,
    /// The values that were chosen before; the others are the first of their lists or the low ends of their ranges.
    pub values: Vec<Value>,
    /// Whether there are no values at all. `false`: the search was too long, or the clauses too complicated.
    pub is_proved: bool,
}

impl<'a> RowRules<'a> {
    /// Values of all parameters that obey every clause: those of `open` as `choose` wants, the others as given.
    ///
    /// # Errors
    /// The clause that is in the way.
    pub fn solve(
        self,
        given: Vec<Value>,
        open: &[usize],
        before: Before<'a>,
        choose: &mut dyn Choose,
    ) -> Result<Vec<Value>, Unsolved> {
        self.solver(given, open, before)?.solve(choose)
    }

    /// Prepares [`RowRules::solve`] for several solutions.
    ///
    /// # Errors
    /// The clause that is in the way of all of them: nothing that is open decides it.
    pub fn solver(
        self,
        mut given: Vec<Value>,
        open: &[usize],
        before: Before<'a>,
    ) -> Result<Solver<'a>, Unsolved> {
        for local in open {
            given[*local] = first(&self.space.actions[self.row.action].parameters[*local].domain);
        }
        let mut solver = Solver {
            rules: self,
            before,
            values: given.clone(),
            given,
            places: Vec::new(),
            known_choices: Vec::new(),
            order: self.order(open),
            is_exact: Cell::new(true),
        };
        let fails = |clause: &Clause| !clause.needs_any(open) && solver.breaks(clause);
        if let Some(clause) = self.clauses().find(|index| fails(solver.clause(*index))) {
            let is_proved = before.tries.get() > 0;
            return Err(Unsolved { clause: Some(clause), local: None, values: solver.given, is_proved });
        }
        solver.places = (0..solver.order.len()).map(|place| solver.place(place)).collect();
        Ok(solver)
    }

    /// The rules in force without those that none of these parameters decides.
    pub fn deciding(self, open: &[usize]) -> RulesInForce {
        let others = self.space.clauses[self.row.action].iter().filter(|clause| !clause.needs_any(open));
        others.filter_map(Clause::rule).fold(self.in_force.clone(), |rules, rule| rules.except(rule))
    }

    /// The clauses of the row under the rules in force, as indices in `Space::clauses` of its action.
    fn clauses(self) -> impl Iterator<Item = usize> {
        let all = self.space.clauses[self.row.action].iter().enumerate();
        effort::spend(self.space.clauses[self.row.action].len());
        // The rules of a row are sorted.
        let is_in_force =
            move |rule| self.in_force.contains(rule) && self.row.rules.binary_search(&rule).is_ok();
        let applies = move |clause: &Clause| clause.rule().is_none_or(is_in_force);
        all.filter(move |(_, clause)| applies(clause)).map(|(index, _)| index)
    }

    /// The order in which parameters are chosen: lists before numbers, and a number that another one sets after it.
    fn order(self, open: &[usize]) -> Vec<usize> {
        let parameters = &self.space.actions[self.row.action].parameters;
        let is_list = |local: &usize| matches!(parameters[*local].domain, Domain::Values(_));
        let (mut order, mut numbers): (Vec<usize>, Vec<usize>) = open.iter().copied().partition(is_list);
        while !numbers.is_empty() {
            let waits = |local: usize| {
                self.bounds().any(|bound| {
                    bound.local == local
                        && bound.op == Comparison::Equal
                        && bound.is_drawn_within
                        && numbers.iter().any(|other| *other != local && bound.needs(*other))
                })
            };
            // Where two numbers set each other, the order of declaration decides.
            let next = numbers.iter().position(|local| !waits(*local)).unwrap_or(0);
            order.push(numbers.remove(next));
        }
        order
    }
}

/// A row in a situation, and one solution in the making.
pub struct Solver<'a> {
    rules: RowRules<'a>,
    before: Before<'a>,
    /// The parameters to choose.
    order: Vec<usize>,
    /// By place of the order.
    places: Vec<Place>,
    /// Results of earlier draws by the second way.
    known_choices: Vec<KnownChoices>,
    /// A value for each parameter of the action. A parameter that is still to be chosen has any value of its type.
    given: Vec<Value>,
    /// As `given`, with the values that are chosen so far.
    values: Vec<Value>,
    /// Whether every polynomial that was needed was found.
    is_exact: Cell<bool>,
}

/// How one parameter is chosen.
struct Place {
    /// Whether any clause needs it.
    is_asked: bool,
    /// The clauses that it decides, together with earlier parameters alone.
    decided: Vec<usize>,
    /// Whether one of them needs an earlier choice.
    depends: bool,
    /// Its remaining values once known, if they do not depend on other choices: the same in every solution.
    kept: Option<Left>,
}

/// The values that the clauses leave to a parameter.
struct Left {
    choices: Choices,
    /// The clause that the last broken try broke.
    blamed: Option<usize>,
    is_exact: bool,
}

/// The values of a parameter that leave values to all later ones, after these choices.
struct KnownChoices {
    place: usize,
    /// Values of the earlier parameters that a clause needs.
    after: Vec<Value>,
    choices: Rc<Choices>,
    is_exact: bool,
}

enum Choices {
    Values(Vec<Value>),
    Numbers(Room),
}

impl Choices {
    fn choose(&self, local: usize, choose: &mut dyn Choose) -> Option<Value> {
        match self {
            Choices::Values(left) => (!left.is_empty()).then(|| choose.value(local, left)),
            Choices::Numbers(room) => choose.number(local, room).map(Value::Number),
        }
    }
}

impl<'a> Solver<'a> {
    /// Values of all parameters that obey every clause.
    ///
    /// # Errors
    /// As [`RowRules::solve`].
    pub fn solve(&mut self, choose: &mut dyn Choose) -> Result<Vec<Value>, Unsolved> {
        self.values.clone_from(&self.given);
        self.is_exact.set(true);
        match self.forwards(choose) {
            Err(unsolved) if !unsolved.is_proved => self.backwards(choose, unsolved),
            done => done,
        }
    }

    fn place(&self, place: usize) -> Place {
        let is_asked = self.rules.clauses().any(|clause| self.clause(clause).needs(self.order[place]));
        let decided: Vec<usize> = self.decided_by(place).collect();
        let earlier = &self.order[..place];
        let depends = decided.iter().any(|clause| self.clause(*clause).needs_any(earlier));
        Place { is_asked, decided, depends, kept: None }
    }

    fn action(&self) -> &'a ActionDef {
        &self.rules.space.actions[self.rules.row.action]
    }

    fn clause(&self, index: usize) -> &'a Clause {
        &self.rules.space.clauses[self.rules.row.action][index]
    }

    /// Whether the values break the clause; also if no try is left.
    fn breaks(&self, clause: &Clause) -> bool {
        match self.before.tries.get().checked_sub(1) {
            Some(left) => self.before.tries.set(left),
            None => return true,
        }
        let after = match clause.reads_effects {
            true => Cow::Owned(self.after(&self.values)),
            false => Cow::Borrowed(self.before.memory),
        };
        let Before { memory: before, world, .. } = self.before;
        let candidate = Candidate { values: &self.values, before, after: &after, world };
        self.rules.breaks(clause, candidate)
    }

    fn after(&self, values: &[Value]) -> Memory {
        let Before { memory, world, .. } = self.before;
        self.rules.space.memory_after(self.rules.row.action, values, memory, self.rules.road, world)
    }

    /// Chooses each parameter by the clauses that no later one decides.
    fn forwards(&mut self, choose: &mut dyn Choose) -> Result<Vec<Value>, Unsolved> {
        for place in 0..self.order.len() {
            let local = self.order[place];
            let left = self.places[place].kept.take().unwrap_or_else(|| self.left(place));
            self.is_exact.set(self.is_exact.get() && left.is_exact);
            let Some(value) = left.choices.choose(local, choose) else {
                self.values[local] = first(&self.action().parameters[local].domain);
                // The choices before matter only if a clause that decides here needs one of them.
                let is_proved =
                    self.is_exact.get() && self.before.tries.get() > 0 && !self.places[place].depends;
                let values = self.values.clone();
                return Err(Unsolved { clause: left.blamed, local: Some(local), values, is_proved });
            };
            self.values[local] = value;
            let Place { depends, kept, .. } = &mut self.places[place];
            *kept = (!*depends).then_some(left);
        }
        Ok(self.values.clone())
    }

    /// The values left to the parameter at this place of the order after the choices before it.
    fn left(&mut self, place: usize) -> Left {
        let local = self.order[place];
        // Taken out while the values change.
        let decided = core::mem::take(&mut self.places[place].decided);
        let mut blamed = None;
        let mut holds = |solver: &mut Solver<'_>, value: Value| {
            solver.values[local] = value;
            let broken = decided.iter().find(|clause| solver.breaks(solver.clause(**clause)));
            blamed = broken.copied().or(blamed);
            broken.is_none()
        };
        let mut is_exact = true;
        let choices = match &self.action().parameters[local].domain {
            Domain::Values(values) => {
                Choices::Values(values.iter().copied().filter(|value| holds(self, *value)).collect())
            }
            // A number that is set to what it must equal needs no try.
            Domain::Range(..) if let Some(number) = self.set_to(local, &decided) => {
                Choices::Numbers(Room::of(number))
            }
            Domain::Range(low, high) => {
                let changes = self.changes_in_one(local, &decided);
                is_exact = changes.is_some();
                let changes = changes.unwrap_or_default();
                Choices::Numbers(Room::where_holds(low.to_f64(), high.to_f64(), changes, |number| {
                    holds(self, Value::Number(number))
                }))
            }
        };
        self.places[place].decided = decided;
        Left { choices, blamed, is_exact }
    }

    /// The clauses that the parameter at this place of the order decides, together with earlier ones alone.
    fn decided_by(&self, place: usize) -> impl Iterator<Item = usize> {
        let (local, later) = (self.order[place], &self.order[place + 1..]);
        let is_decided = move |clause: &Clause| clause.needs(local) && !clause.needs_any(later);
        self.rules.clauses().filter(move |clause| is_decided(self.clause(*clause)))
    }

    /// The number that the only clause sets the parameter to, as `distance == gap(…)` does, if it lies well within the
    /// range. No other place to try is then equal to it. Nearly all draws of a distance end here.
    fn set_to(&self, local: usize, clauses: &[usize]) -> Option<f64> {
        let [clause] = clauses else { return None };
        let (clause, action) = (self.clause(*clause), self.rules.row.action);
        let demand = self.rules.space.rules[clause.rule()?].body.demand(action)?;
        let is_equation = matches!(demand.condition()?.kind, ExprKind::Compare(Comparison::Equal, ..));
        if clause.reads_effects || !is_equation {
            return None;
        }
        let mut bounds = self.rules.space.bounds[action].iter();
        let bound = bounds.find(|bound| bound.rule == clause.rule() && bound.local == local)?;
        let number = evaluate(&bound.limit, &self.rules.space.functions, &self.facts()).number();
        let (low, high) = self.action().parameters[local].domain.ends();
        let room = WELL_WITHIN.max(1e-6 * number.abs());
        (bound.is_drawn_within && number - low > room && high - number > room).then_some(number)
    }

    /// Where these clauses may change along one number, if all others are as they are; `None` if a polynomial was
    /// not found.
    fn changes_in_one(&self, local: usize, clauses: &[usize]) -> Option<Vec<f64>> {
        let (low, high) = self.action().parameters[local].domain.ends();
        let clauses = clauses.iter().map(|clause| self.clause(*clause));
        let found = polynomials(self.rules, &[local], self.facts(), clauses)?;
        Some(found.iter().flat_map(|polynomial| polynomial.turns(0, low, high)).collect())
    }

    fn facts(&self) -> Facts<'_> {
        let Before { memory, world, .. } = self.before;
        Facts { road: self.rules.road, world, ..Facts::new(&self.values, memory) }
    }

    /// Chooses each parameter from the values that leave values to all later ones.
    fn backwards(&mut self, choose: &mut dyn Choose, forwards: Unsolved) -> Result<Vec<Value>, Unsolved> {
        for place in 0..self.order.len() {
            let local = self.order[place];
            let chosen = self.completable(place).choose(local, choose);
            let Some(value) = chosen else {
                // Only rounding can leave a later parameter nothing.
                let is_proved = place == 0 && self.is_exact.get() && self.before.tries.get() > 0;
                return Err(Unsolved { is_proved, ..forwards });
            };
            self.values[local] = value;
        }
        Ok(self.values.clone())
    }

    /// The values that leave values to all later parameters.
    fn completable(&mut self, place: usize) -> Rc<Choices> {
        let after = self.listed_before(place);
        let mut known = self.known_choices.iter().filter(|known| known.place == place);
        if let Some(known) = known.find(|known| Some(&known.after) == after.as_ref()) {
            self.is_exact.set(self.is_exact.get() && known.is_exact);
            return Rc::clone(&known.choices);
        }
        let was_exact = self.is_exact.replace(true);
        let choices = Rc::new(match &self.action().parameters[self.order[place]].domain {
            Domain::Values(values) if !self.places[place].is_asked => {
                let leads_on = values.first().is_some_and(|value| self.leads_on(place, *value));
                Choices::Values(if leads_on { values.clone() } else { Vec::new() })
            }
            Domain::Values(values) => {
                Choices::Values(values.iter().copied().filter(|value| self.leads_on(place, *value)).collect())
            }
            Domain::Range(low, high) => {
                let changes = self.changes(place);
                Choices::Numbers(Room::where_holds(low.to_f64(), high.to_f64(), changes, |number| {
                    self.leads_on(place, Value::Number(number))
                }))
            }
        });
        let is_exact = self.is_exact.get();
        self.is_exact.set(was_exact && is_exact);
        // A search that ran out of tries may leave more another time.
        if let Some(after) = after.filter(|_| self.before.tries.get() > 0) {
            let choices = Rc::clone(&choices);
            self.known_choices.push(KnownChoices { place, after, choices, is_exact });
        }
        choices
    }

    /// The choices before this place of the order that a clause needs; `None` if a number is among them.
    fn listed_before(&self, place: usize) -> Option<Vec<Value>> {
        let asked = (0..place).filter(|earlier| self.places[*earlier].is_asked);
        let listed = asked.map(|earlier| {
            let local = self.order[earlier];
            let is_list = matches!(self.action().parameters[local].domain, Domain::Values(_));
            is_list.then_some(self.values[local])
        });
        listed.collect()
    }

    /// Whether this value of the parameter at the place, after the values before it, can be completed.
    fn leads_on(&mut self, place: usize, value: Value) -> bool {
        // Without a try left nothing will be found, so the choices that no clause has judged yet are not gone through.
        if self.before.tries.get() == 0 || effort::is_spent() {
            return false;
        }
        self.values[self.order[place]] = value;
        let is_broken = self.decided_by(place).any(|clause| self.breaks(self.clause(clause)));
        !is_broken && self.can_go_on(place + 1)
    }

    /// Whether the parameters from this place of the order on have values.
    fn can_go_on(&mut self, place: usize) -> bool {
        let Some(local) = self.order.get(place) else { return true };
        match &self.action().parameters[*local].domain {
            Domain::Values(values) => {
                // A parameter that no clause needs leads on with any value or with none.
                let tried = if self.places[place].is_asked { values.len() } else { 1 };
                values.iter().take(tried).any(|value| self.leads_on(place, *value))
            }
            Domain::Range(low, high) => {
                let changes = self.changes(place);
                let mut is_found = false;
                Room::where_holds(low.to_f64(), high.to_f64(), changes, |number| {
                    is_found = is_found || self.leads_on(place, Value::Number(number));
                    is_found
                });
                is_found
            }
        }
    }

    /// Where it may change along the number at this place whether all later numbers have values.
    fn changes(&self, place: usize) -> Vec<f64> {
        let open = &self.order[place..];
        let Domain::Range(low, high) = &self.action().parameters[open[0]].domain else { return Vec::new() };
        let found = self.projected(open);
        if found.is_none() {
            self.is_exact.set(false);
        }
        let found = found.unwrap_or_default();
        found.iter().flat_map(|polynomial| polynomial.turns(0, low.to_f64(), high.to_f64())).collect()
    }

    /// The polynomials in the first of these numbers alone.
    fn projected(&self, open: &[usize]) -> Option<Vec<Polynomial>> {
        if open.len() > NUMBERS_MAX {
            return None;
        }
        let clauses = self.rules.clauses().map(|index| self.clause(index));
        let clauses = clauses.filter(|clause| clause.needs_any(open));
        let mut found = polynomials(self.rules, open, self.facts(), clauses)?;
        for (place, local) in open.iter().enumerate().skip(1) {
            let (low, high) = self.action().parameters[*local].domain.ends();
            for end in [low, high] {
                let number = Polynomial::number(place);
                found.push(number.minus(&Polynomial::constant(end))?);
            }
        }
        for place in (1..open.len()).rev() {
            found = project(&found, place)?;
        }
        Some(found)
    }
}

/// A value of the right type for a parameter that is not chosen yet.
fn first(domain: &Domain) -> Value {
    match domain {
        Domain::Values(values) => values.first().copied().unwrap_or(Value::Bool(false)),
        Domain::Range(low, _) => Value::Number(low.to_f64()),
    }
}
