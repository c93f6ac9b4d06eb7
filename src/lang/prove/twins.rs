//! Rows that are the same action under two names.
//!
//! Two rows are the same if, with the values of their axes put in, they draw the same parameters, have the
//! same effects and are bound by the same conditions. Forms are compared, not meanings, so equal rows that
//! are written differently may be missed.

use std::collections::BTreeMap;

use crate::model::expr::{Expr, ExprKind};
use crate::model::field::{Fields, Term};
use crate::model::vocabulary::Field;
use crate::model::{
    Domain, EffectDef, ManoeuvreCall, Row, RuleBody, Space, SpawnDef, Value, WordExpr, code, effort,
};
use crate::prove::reduce::{reduce, reduced_who};
use crate::syntax::Diagnostic;
use crate::syntax::ast::Span;
use avastra_base::units::Rational;

/// Tables with more rows than this are not searched for equal rows.
const ROWS_MAX: usize = 10_000;

/// Steps for the text of a listed value.
const VALUE_STEPS: usize = 16;

/// Pairs listed for two actions, at most.
const PAIRS_SHOWN: usize = 6;

/// One warning for each two actions that share rows.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    if space.rows.len() > ROWS_MAX {
        return Vec::new();
    }
    // Conditions are long to write down: only rows that do the same are compared by them.
    let mut alike: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for row in space.rows.iter().take_while(|_| !effort::is_spent()) {
        alike.entry(RowText::of(space, row).effects()).or_default().push(row.index);
    }
    let mut pairs: BTreeMap<(usize, usize), Vec<(usize, usize)>> = BTreeMap::new();
    for rows in alike.into_values().filter(|rows| rows.len() > 1) {
        let mut first_of: BTreeMap<String, usize> = BTreeMap::new();
        for again in rows.into_iter().take_while(|_| !effort::is_spent()) {
            let first = *first_of.entry(RowText::of(space, &space.rows[again]).conditions()).or_insert(again);
            if first != again {
                let actions = (space.rows[first].action, space.rows[again].action);
                pairs.entry(actions).or_default().push((first, again));
            }
        }
    }
    pairs.values_mut().for_each(|pairs| pairs.sort_by_key(|(_, again)| *again));
    let warning = |((first, again), pairs): ((usize, usize), Vec<(usize, usize)>)| {
        let (one, other) = (&space.actions[first], &space.actions[again]);
        let label = |row: usize| format!("`{}`", space.rows[row].label);
        let (a, b) = pairs[0];
        let message = format!("{} and {} are the same action", label(a), label(b));
        let mut warning = Diagnostic::warning(code::TWINS, message).at(other.span, format!("row {b}"));
        if first != again {
            warning = warning.beside(one.span, format!("row {a}"));
        } else {
            let axes = other.parameters.iter().filter(|parameter| parameter.axis);
            let differs = |name: &str| {
                let value = |row: usize| space.rows[row].axes.iter().find(|(known, _)| &**known == name);
                value(a) != value(b)
            };
            let axes = axes.filter(|parameter| differs(&parameter.name));
            warning = axes.fold(warning, |warning, axis| {
                warning.beside(axis.span, format!("`{}` makes no difference", axis.name))
            });
        }
        for (a, b) in pairs.iter().skip(1).take(PAIRS_SHOWN) {
            warning = warning.note(format!("so are rows {a} and {b}: {} and {}", label(*a), label(*b)));
        }
        if pairs.len() > PAIRS_SHOWN + 1 {
            warning = warning.note(format!("and {} more", pairs.len() - PAIRS_SHOWN - 1));
        }
        warning.help("remove one of the two: an agent would have to learn the same thing twice")
    };
    pairs.into_iter().map(warning).collect()
}

/// A row with the values of its axes put in, as two texts: rows are the same if both are.
struct RowText<'a> {
    space: &'a Space,
    row: &'a Row,
    /// The parameters: literals on axes, the others by their place.
    locals: Vec<Expr>,
}

impl<'a> RowText<'a> {
    fn of(space: &'a Space, row: &'a Row) -> RowText<'a> {
        let mut drawn = 0;
        let parameters = space.actions[row.action].parameters.iter();
        let locals = parameters.map(|parameter| {
            let axis = row.axes.iter().find(|(name, _)| *name == parameter.name);
            let kind = match axis {
                Some((_, value)) => literal(*value),
                None => {
                    drawn += 1;
                    ExprKind::Local(drawn - 1)
                }
            };
            Expr { kind, ty: parameter.ty, span: Span::NONE }
        });
        RowText { space, row, locals: locals.collect() }
    }

    fn reduced(&self, expr: &Expr) -> Expr {
        reduce(expr, &self.space.functions, &self.locals)
    }

    fn effects(&self) -> String {
        let effects = self.space.actions[self.row.action].effects.iter().map(|effect| match effect {
            EffectDef::Set(set) => {
                let key = set.key.as_ref().map(|key| self.reduced(key));
                format!("set {} {key:?} {:?}", set.state, self.reduced(&set.value))
            }
            EffectDef::Spawn(spawn) => {
                let then = spawn.manoeuvre.as_ref().map(|then| self.call_form(then));
                format!("{} {then:?}", spawn_form(spawn, &self.locals, &|expr| self.reduced(expr)))
            }
            EffectDef::Light(light) => {
                let colour = word_form(&light.colour, &|expr| self.reduced(expr));
                format!("light {colour} {:?}", light.at.as_ref().map(|at| self.reduced(at).kind))
            }
            EffectDef::Order(order) => {
                let told = told_form(&order.command, &self.locals, &|expr| self.reduced(expr));
                let then = order.manoeuvre.as_ref().map(|then| self.call_form(then));
                format!("order {:?} {told} {then:?}", reduced_who(order.who, &self.locals))
            }
        });
        effects.collect::<Vec<_>>().join("\n")
    }

    fn call_form(&self, call: &ManoeuvreCall) -> String {
        let arguments = call.arguments.iter().map(|argument| self.reduced(argument).kind);
        format!("{} {:?}", call.manoeuvre, arguments.collect::<Vec<_>>())
    }

    /// The sources of the drawn values, and the rules.
    fn conditions(&self) -> String {
        let mut parts: Vec<String> = Vec::new();
        for parameter in self.space.actions[self.row.action].drawn() {
            let condition = parameter.condition.as_ref().map(|condition| self.reduced(condition));
            if let Domain::Values(values) = &parameter.domain {
                effort::spend(VALUE_STEPS * values.len());
            }
            parts.push(format!("any {:?} {:?} {condition:?}", parameter.ty, parameter.domain));
        }
        for rule in self.row.rules.iter() {
            match &self.space.rules[*rule].body {
                RuleBody::Phases { .. } | RuleBody::Moves { .. } => parts.push(format!("rule {rule}")),
                RuleBody::Holds(bindings) | RuleBody::During(bindings) => {
                    let found = bindings.binary_search_by_key(&self.row.action, |binding| binding.action);
                    let condition = found.ok().map(|binding| self.reduced(&bindings[binding].condition));
                    if let Some(condition) = condition.filter(|one| one.kind != ExprKind::Bool(true)) {
                        parts.push(format!("rule {rule} {:?}", condition.kind));
                    }
                }
            }
        }
        parts.join("\n")
    }
}

fn word_form<W: Copy + core::fmt::Debug>(word: &WordExpr<W>, reduced: &impl Fn(&Expr) -> Expr) -> String {
    match word {
        WordExpr::Fixed(word) => format!("{word:?}"),
        WordExpr::Of(expr, words) => match reduced(expr) {
            Expr { kind: ExprKind::Variant(_, variant), .. } => format!("{:?}", words[variant]),
            expr => format!("{:?} of {words:?}", expr.kind),
        },
    }
}

fn told_form(told: &Fields<Term>, locals: &[Expr], reduced: &impl Fn(&Expr) -> Expr) -> String {
    let form = |(field, term): (Field, &Term)| {
        let value = match term {
            Term::Figure { expr, .. } | Term::Truth(expr) => format!("{:?}", reduced(expr).kind),
            Term::Word(word) => word_form(word, reduced),
            Term::Rules(rules) => {
                rules.iter().map(|rule| word_form(rule, reduced)).collect::<Vec<_>>().join(" ")
            }
            Term::Who(who) => format!("{:?}", reduced_who(*who, locals)),
        };
        format!("{field:?} {value}")
    };
    told.iter().map(form).collect::<Vec<_>>().join(", ")
}

fn spawn_form(spawn: &SpawnDef, locals: &[Expr], reduced: &impl Fn(&Expr) -> Expr) -> String {
    format!(
        "spawn {} {} {} {} {} {} {:?} {:?} {} {} {:?} {} {:?} {:?} {:?}",
        word_form(&spawn.body, reduced),
        word_form(&spawn.colour, reduced),
        word_form(&spawn.verb, reduced),
        word_form(&spawn.lane, reduced),
        word_form(&spawn.side, reduced),
        word_form(&spawn.then, reduced),
        reduced(&spawn.speed).kind,
        reduced(&spawn.distance).kind,
        told_form(&spawn.told, locals, reduced),
        spawn.behind,
        spawn.of.map(|who| reduced_who(who, locals)),
        spawn.cover.as_ref().map_or(String::new(), |cover| word_form(cover, reduced)),
        spawn.trajectory.as_ref().map(|trajectory| word_form(trajectory, reduced)),
        spawn.bearer,
        spawn.row.as_ref().map(|row| {
            (row.nth, reduced(&row.apart).kind, row.count.as_ref().map(|count| reduced(count).kind))
        }),
    )
}

fn literal(value: Value) -> ExprKind {
    match value {
        Value::Bool(truth) => ExprKind::Bool(truth),
        Value::Variant(of, variant) => ExprKind::Variant(of, variant),
        Value::Number(number) => ExprKind::Number(
            Rational::from_rounded(number).expect("an axis holds a number from a source text"),
        ),
    }
}
