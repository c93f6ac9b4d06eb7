//! Where the truth of clauses may change: the polynomials whose signs decide them, in the numbers that are still
//! to be drawn.
//!
//! Everything else is known at this moment: the other parameters, the memory, the road, the world. Expressions are
//! computed with the open numbers as unknowns. A `match` on something open has every arm, so that too many
//! polynomials may be found, never too few.

use crate::model::effort;
use crate::model::eval::evaluate;
use crate::model::expr::FnDef;
use crate::model::expr::{Arithmetic, Expr, ExprKind};
use crate::model::facts::Facts;
use crate::model::numbers::{arithmetic, compare, of_numbers};
use crate::model::rules::polynomial::Polynomial;
use crate::model::rules::{Clause, Demand, RowRules, Source, state_at};
use crate::model::space::{SetDef, StateDef};
use crate::model::value::Value;
use crate::model::vocabulary::{Known, NumberWord};

/// The most forms that one expression may have, by the arms of its `match`es.
const FORMS_MAX: usize = 64;

/// The form of an expression, as far as the open numbers leave it.
#[derive(Debug, Clone, PartialEq)]
enum Form {
    Known(Value),
    /// A number: one of these quotients.
    Numbers(Vec<Quotient>),
    /// A truth value or a variant that depends on open numbers.
    Open,
}

#[derive(Debug, Clone, PartialEq)]
struct Quotient {
    above: Polynomial,
    below: Polynomial,
}

/// The polynomials that decide these clauses; `None` if an expression is too complicated. `open` are the locals that are
/// still to be drawn, in the order of their places in polynomials. `facts` has values of all parameters and the memory
/// before; the values of open parameters do not count.
pub(super) fn polynomials<'c>(
    rules: RowRules<'_>,
    open: &[usize],
    facts: Facts<'_>,
    clauses: impl Iterator<Item = &'c Clause>,
) -> Option<Vec<Polynomial>> {
    let space = rules.space;
    effort::spend(facts.locals.len() + facts.memory.cells().len());
    let form = |(local, value): (usize, &Value)| match open.iter().position(|open| *open == local) {
        Some(place) => Form::Numbers(vec![Quotient::whole(Polynomial::number(place))]),
        None => Form::Known(*value),
    };
    let locals: Vec<Form> = facts.locals.iter().enumerate().map(form).collect();
    let cells = facts.memory.cells().iter().map(|value| Form::Known(*value)).collect();
    let (functions, states) = (&space.functions, &space.states);
    let mut reader = Reader { functions, states, facts, cells, found: Vec::new() };
    let action = rules.row.action;
    let mut are_effects_read = false;
    for clause in clauses {
        if effort::is_spent() {
            return None;
        }
        if clause.reads_effects && !are_effects_read {
            for set in space.sets(Some(action)) {
                reader.apply(set, &locals)?;
            }
            are_effects_read = true;
        }
        let condition = match clause.source {
            Source::Where(parameter) => space.actions[action].parameters[parameter].condition.as_ref(),
            Source::Rule(rule) => match space.rules[rule].body.demand(action) {
                Some(Demand::Holds(condition)) => Some(condition),
                // The effect that sets the state already gave the numbers that decide the move.
                Some(Demand::Moves { .. }) | None => None,
            },
        };
        let is_asked = |condition: &&Expr| match condition.known() {
            Known::Road => true,
            Known::World => facts.world.is_some(),
            Known::Spawn | Known::Tick | Known::Near | Known::Step | Known::Judgement => false,
        };
        if let Some(condition) = condition.filter(is_asked) {
            reader.read(condition, &locals)?;
        }
    }
    Some(reader.found)
}

struct Reader<'a> {
    functions: &'a [FnDef],
    states: &'a [StateDef],
    facts: Facts<'a>,
    /// The memory: before the effects, and after them once they are applied.
    cells: Vec<Form>,
    found: Vec<Polynomial>,
}

impl Reader<'_> {
    fn apply(&mut self, set: &SetDef, locals: &[Form]) -> Option<()> {
        let SetDef { state, key, value, .. } = set;
        let value = self.read(value, locals)?;
        let state = &self.states[*state];
        let cells = state.first_cell..state.first_cell + state.cells;
        let Some(key) = key else {
            self.cells[cells].fill(value);
            return Some(());
        };
        match self.read(key, locals)? {
            Form::Known(key) => self.cells[state.first_cell + key.variant()] = value,
            Form::Numbers(_) | Form::Open => {
                for cell in cells {
                    self.cells[cell] = join([self.cells[cell].clone(), value.clone()])?;
                }
            }
        }
        Some(())
    }

    fn read(&mut self, expr: &Expr, locals: &[Form]) -> Option<Form> {
        effort::spend(1);
        Some(match &expr.kind {
            ExprKind::Bool(_)
            | ExprKind::Number(_)
            | ExprKind::Variant(..)
            | ExprKind::Fact(_)
            | ExprKind::OfRoadUser(..)
            | ExprKind::OfBearer(..)
            | ExprKind::IsThere(_)
            | ExprKind::Since(..)
            | ExprKind::Breached(_)
            | ExprKind::Margin(_)
            | ExprKind::OnRoad(_)
            | ExprKind::IsWord(..)
            | ExprKind::IsWordOf(..)
            | ExprKind::IsBody(..) => Form::Known(evaluate(expr, self.functions, &self.facts)),
            ExprKind::Past(..) | ExprKind::Near(..) => Form::Open,
            ExprKind::Local(local) => locals[*local].clone(),
            ExprKind::Cell(cell) => self.cells[*cell].clone(),
            ExprKind::CellAt(first, key) => match self.read(key, locals)? {
                Form::Known(key) => self.cells[first + key.variant()].clone(),
                _ => {
                    let state = &self.states[state_at(*first, self.states)];
                    join(self.cells[*first..][..state.cells].iter().cloned())?
                }
            },
            ExprKind::Call(function, arguments) => {
                let given = arguments.iter().map(|argument| self.read(argument, locals));
                let given: Vec<Form> = given.collect::<Option<_>>()?;
                let body = &self.functions[*function].body;
                // A function knows nothing but its arguments.
                let known = given.iter().map(|form| match form {
                    Form::Known(value) => Some(*value),
                    Form::Numbers(_) | Form::Open => None,
                });
                match known.collect::<Option<Vec<Value>>>() {
                    Some(locals) => {
                        Form::Known(evaluate(body, self.functions, &Facts { locals: &locals, ..self.facts }))
                    }
                    None => self.read(body, &given)?,
                }
            }
            ExprKind::OfNumbers(word, numbers) => {
                let mut forms =
                    numbers.iter().map(|number| self.read(number, locals)).collect::<Option<Vec<_>>>()?;
                let known = forms.iter().map(|form| match form {
                    Form::Known(value) => Some(value.number()),
                    Form::Numbers(_) | Form::Open => None,
                });
                if let Some(known) = known.collect::<Option<Vec<f64>>>() {
                    return Some(Form::Known(Value::Number(of_numbers(*word, known.into_iter()))));
                }
                if *word == NumberWord::Abs {
                    let negated = forms[0].quotients()?.into_iter().map(|form| form.scaled(-1.0)).collect();
                    forms.push(Form::Numbers(negated));
                }
                // It changes from one to the other where both are equal.
                self.compared(&forms[0], &forms[1])?;
                join(forms)?
            }
            ExprKind::Not(inner) => match self.read(inner, locals)? {
                Form::Known(value) => Form::Known(Value::Bool(!value.truth())),
                other => other,
            },
            ExprKind::Negate(inner) => match self.read(inner, locals)? {
                Form::Known(value) => Form::Known(Value::Number(-value.number())),
                Form::Numbers(forms) => {
                    Form::Numbers(forms.into_iter().map(|form| form.scaled(-1.0)).collect())
                }
                Form::Open => Form::Open,
            },
            ExprKind::Arithmetic(op, left, right) => {
                let (left, right) = (self.read(left, locals)?, self.read(right, locals)?);
                combined(*op, left, right)?
            }
            ExprKind::Compare(op, left, right) => {
                let (left, right) = (self.read(left, locals)?, self.read(right, locals)?);
                match (&left, &right) {
                    (Form::Known(left), Form::Known(right)) => {
                        Form::Known(Value::Bool(compare(*op, *left, *right)))
                    }
                    _ => self.compared(&left, &right)?,
                }
            }
            ExprKind::And(left, right) => self.read_both(left, right, locals, (false, false))?,
            ExprKind::Or(left, right) => self.read_both(left, right, locals, (true, true))?,
            ExprKind::Implies(left, right) => self.read_both(left, right, locals, (false, true))?,
            ExprKind::InRange(inner, low, high) => {
                let inner = self.read(inner, locals)?;
                for end in [low, high] {
                    let end = self.read(end, locals)?;
                    self.compared(&inner, &end)?;
                }
                Form::Open
            }
            ExprKind::InList(inner, list) => {
                let inner = self.read(inner, locals)?;
                for item in list {
                    let item = self.read(item, locals)?;
                    self.compared(&inner, &item)?;
                }
                Form::Open
            }
            ExprKind::InLanes(inner, lanes) => match self.read(inner, locals)? {
                Form::Known(lane) => {
                    let has = self.facts.road.is_some_and(|road| road.has_lane(lanes[lane.variant()]));
                    Form::Known(Value::Bool(has))
                }
                _ => Form::Open,
            },
            ExprKind::Match { subject, arm_of, arms } => match self.read(subject, locals)? {
                Form::Known(value) => self.read(&arms[arm_of[value.variant()]], locals)?,
                _ => {
                    let forms = arms.iter().map(|arm| self.read(arm, locals));
                    join(forms.collect::<Option<Vec<Form>>>()?)?
                }
            },
        })
    }

    /// Reads two truths. If the left one is known to be `deciding`, the result is `decided`, and the right one is not read.
    fn read_both(
        &mut self,
        left: &Expr,
        right: &Expr,
        locals: &[Form],
        (deciding, decided): (bool, bool),
    ) -> Option<Form> {
        match self.read(left, locals)? {
            Form::Known(value) if value.truth() == deciding => Some(Form::Known(Value::Bool(decided))),
            Form::Open => self.read(right, locals).map(|_| Form::Open),
            Form::Known(_) | Form::Numbers(_) => self.read(right, locals),
        }
    }

    /// Notes where two numbers may be equal.
    fn compared(&mut self, left: &Form, right: &Form) -> Option<Form> {
        if let (Some(left), Some(right)) = (left.quotients(), right.quotients()) {
            for a in &left {
                for b in &right {
                    effort::spend(1 + self.found.len());
                    let difference = a.above.times(&b.below)?.minus(&b.above.times(&a.below)?)?;
                    for polynomial in [&difference, &a.below, &b.below] {
                        let is_new = !polynomial.is_constant() && !self.found.contains(polynomial);
                        if is_new && polynomial.is_finite() {
                            self.found.push(polynomial.clone());
                        }
                    }
                }
            }
        }
        Some(Form::Open)
    }
}

impl Quotient {
    fn whole(above: Polynomial) -> Quotient {
        Quotient { above, below: Polynomial::constant(1.0) }
    }

    fn scaled(self, factor: f64) -> Quotient {
        Quotient { above: self.above.scaled(factor), ..self }
    }
}

impl Form {
    /// The quotients that a number may be; `None` if it is no number.
    fn quotients(&self) -> Option<Vec<Quotient>> {
        match self {
            Form::Known(Value::Number(number)) => Some(vec![Quotient::whole(Polynomial::constant(*number))]),
            Form::Numbers(forms) => Some(forms.clone()),
            Form::Known(_) | Form::Open => None,
        }
    }
}

fn combined(op: Arithmetic, left: Form, right: Form) -> Option<Form> {
    if let (Form::Known(left), Form::Known(right)) = (&left, &right) {
        return Some(Form::Known(Value::Number(arithmetic(op, left.number(), right.number()))));
    }
    let mut forms = Vec::new();
    for a in &left.quotients()? {
        for b in &right.quotients()? {
            let form = quotient(op, a, b)?;
            if !forms.contains(&form) {
                forms.push(form);
            }
        }
    }
    (forms.len() <= FORMS_MAX).then_some(Form::Numbers(forms))
}

fn quotient(op: Arithmetic, a: &Quotient, b: &Quotient) -> Option<Quotient> {
    let one = Polynomial::constant(1.0);
    let plain = a.below == one && b.below == one;
    Some(match op {
        // The usual case keeps the digits that evaluation has.
        Arithmetic::Add if plain => Quotient::whole(a.above.plus(&b.above)?),
        Arithmetic::Subtract if plain => Quotient::whole(a.above.minus(&b.above)?),
        Arithmetic::Add | Arithmetic::Subtract => {
            let (left, right) = (a.above.times(&b.below)?, b.above.times(&a.below)?);
            let above = if op == Arithmetic::Add { left.plus(&right)? } else { left.minus(&right)? };
            Quotient { above, below: a.below.times(&b.below)? }
        }
        Arithmetic::Multiply => Quotient { above: a.above.times(&b.above)?, below: a.below.times(&b.below)? },
        Arithmetic::Divide => match b.above.value() {
            Some(divisor) if divisor != 0.0 => {
                Quotient { above: a.above.divided(divisor).times(&b.below)?, below: a.below.clone() }
            }
            _ => Quotient { above: a.above.times(&b.below)?, below: a.below.times(&b.above)? },
        },
    })
}

/// One of several forms.
fn join(forms: impl IntoIterator<Item = Form>) -> Option<Form> {
    let mut different: Vec<Form> = Vec::new();
    for form in forms {
        if !different.contains(&form) {
            different.push(form);
        }
    }
    if different.len() == 1 {
        return different.pop();
    }
    let mut numbers = Vec::new();
    for form in &different {
        let Some(quotients) = form.quotients() else { return Some(Form::Open) };
        numbers.extend(quotients);
    }
    (numbers.len() <= FORMS_MAX).then_some(Form::Numbers(numbers))
}
