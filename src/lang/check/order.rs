//! Orders, and what their fields tell a road user: those of phases and spawns, too.

use crate::check::checker::Checker;
use crate::check::expression::Place;
use crate::check::mistakes::{Report, all_of, field};
use crate::model::command::{CommandDef, Moves, Told};
use crate::model::expr::{Expr, Who};
use crate::model::field::{Fields, Kind, Term, Unit};
use crate::model::vocabulary::{Field, TrafficRule, Word};
use crate::model::{OrderDef, Type, WordExpr, code};
use crate::syntax::ast::Span;
use crate::syntax::{Diagnostic, ast};

impl Checker {
    pub(super) fn order(
        &mut self,
        who: &ast::Name,
        fields: &[ast::Field],
        place: &Place<'_>,
        span: Span,
    ) -> Option<OrderDef> {
        let bearer = self.named_road_user(who, place);
        let among = Field::of_orders();
        self.note_fields(fields, &among, place);
        let (declared, fields) = (fields.len(), self.fields_among(fields, &among));
        let manoeuvre = match field(&fields, Field::Then) {
            Some(value) => match self.manoeuvre_call(value, place) {
                Some(call) => Some(call?),
                None => return self.no_manoeuvre(value, place),
            },
            None => None,
        };
        let command = self.command(&fields, place)?;
        if let Some(continuous) = command.expr(Field::Continuous) {
            let error = Diagnostic::error(code::NOT_HERE, "only the `speed` of a phase is `continuous`");
            let error = error.at(continuous.span, "in an order, whose numbers are drawn");
            return self.reject(error.help("write a manoeuvre with that phase, and order `then: …`"));
        }
        if let (Some(to), true) = (field(&fields, Field::To), bearer.is_some() && command.to() == bearer) {
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, "nobody keeps a gap to itself");
            let help = "name somebody else, or leave `to` out: then the gap is to the ego vehicle";
            return self
                .reject(error.at(to.span, format!("this is who is ordered, `{}`", who.text)).help(help));
        }
        if manoeuvre.is_none() && command.is_empty() {
            // A misspelt field was reported.
            if fields.len() < declared {
                return None;
            }
            let message = "the order tells the vehicle nothing".to_owned();
            return self.missing_field(Field::Speed, span, message);
        }
        let told = manoeuvre.as_ref().map_or(Told::NOTHING, |call| self.told(call.manoeuvre));
        let has = match bearer {
            Some(Who::Given(_)) => self.obeys.values().copied().reduce(Told::and),
            Some(Who::Named(_)) | None => self.obeys.get(&who.text).copied(),
        };
        let has = has.unwrap_or(Told::BY_DRIVERS);
        // A road user on foot is never told a rate.
        let moves = Moves::told(has);
        if bearer.is_some() && !has.covers(told.and(command.told())) {
            let message = format!("`{}` cannot be told that", who.text);
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message);
            let error = error.at(who.span, "on foot, or on a trajectory, whenever it is there");
            let help = format!("it can be told {}", has.words());
            self.report(error.help(help));
        }
        Some(OrderDef { who: bearer?, command, manoeuvre, moves, span })
    }

    pub(super) fn no_manoeuvre<T>(&mut self, value: &ast::Expr, place: &Place<'_>) -> Option<T> {
        self.look_at(value, place, None);
        let error =
            Diagnostic::error(code::TYPE_MISMATCH, "the `then` of an order or a phase is a manoeuvre");
        let error = error.at(value.span, "no call of one");
        self.reject(error.help("write its name and what it is given: `then: brake(4 m/s^2)`"))
    }

    /// Reads the fields that an order or a phase tells a road user; `None` after a mistake, which is reported.
    pub(super) fn command(
        &mut self,
        fields: &[(Field, &ast::Expr)],
        place: &Place<'_>,
    ) -> Option<CommandDef> {
        let command = self.told_by(fields, place);
        let mut all = true;
        let says = |wanted: Field| field(fields, wanted).is_some();
        let goes_aside = says(Field::Lane) || says(Field::Offset);
        let (keeps, is_early) = (says(Field::Keep), says(Field::Early));
        if let Some(value) = field(fields, Field::Early).filter(|_| keeps) {
            let error = Diagnostic::error(code::NOT_HERE, "`keep` and `early` both say the speed");
            let error = error.at(value.span, "beside `keep`");
            self.report(error.help("leave one of the two out, or write them in two phases"));
            all = false;
        }
        if let Some(value) = field(fields, Field::Continuous).filter(|_| keeps || is_early) {
            let error =
                Diagnostic::error(code::NOT_HERE, "`keep` and `early` say the speed at every tick already");
            self.report(error.at(value.span, "beside one of them").help("leave it out"));
            all = false;
        }
        for (part, of, is_there) in [
            (Field::To, "a `keep`", keeps),
            (Field::At, "an `early`", is_early),
            (Field::Reach, "an `early` and an `at`", is_early && says(Field::At)),
            (Field::Steady, "a `reach` and a `speed`", says(Field::Reach) && says(Field::Speed)),
            (Field::Rate, "a `speed`, a `keep` or an `early`", says(Field::Speed) || keeps || is_early),
            (Field::Aside, "a `lane` or an `offset`", goes_aside),
            (Field::Continuous, "a `speed`", says(Field::Speed)),
        ] {
            if let Some(value) = field(fields, part).filter(|_| !is_there) {
                let message = format!("`{}` belongs to {of}", part.name());
                let error = Diagnostic::error(code::NOT_HERE, message);
                let error = error.at(value.span, format!("without {of}"));
                self.report(error.help(format!("say {of}, too, or leave `{}` out", part.name())));
                all = false;
            }
        }
        command.filter(|_| all)
    }

    /// Reads the fields of a spawn, an order or a phase but for those that are read separately; `None` after a mistake,
    /// which is reported. All fields are read, also after a wrong one.
    pub(super) fn told_by(
        &mut self,
        fields: &[(Field, &ast::Expr)],
        place: &Place<'_>,
    ) -> Option<Fields<Term>> {
        let (mut told, mut all) = (Fields::default(), true);
        for (field, value) in fields {
            let quantity = |unit: &Unit| Type::Quantity(unit.dimension);
            let term = match field.kind() {
                Kind::Figure(unit, None) => {
                    let expr = self.typed(value, place, quantity(&unit));
                    expr.map(|expr| Term::Figure { expr, second: false })
                }
                Kind::Figure(first, Some(second)) => {
                    let expr = self.either(*field, value, [&first, &second], place);
                    expr.map(|expr| Term::Figure { second: expr.ty == quantity(&second), expr })
                }
                Kind::Truth => self.typed(value, place, Type::Bool).map(Term::Truth),
                Kind::Word(kind) => self.word_among(kind, value, place).map(Term::Word),
                Kind::Rules => self.ignored_rules(value, place).map(Term::Rules),
                Kind::Who => self.kept(value, place).map(Term::Who),
                Kind::Own => continue,
            };
            all &= term.is_some();
            told.set(*field, term);
        }
        all.then_some(told)
    }

    /// A quantity in one of two units.
    fn either(
        &mut self,
        field: Field,
        value: &ast::Expr,
        units: [&Unit; 2],
        place: &Place<'_>,
    ) -> Option<Expr> {
        let found = self.expr(value, place, None)?;
        if units.iter().any(|unit| found.ty == Type::Quantity(unit.dimension)) {
            return Some(found);
        }
        let label = format!("this is a `{}`", self.references.type_name(found.ty));
        let [first, second] = units.map(|unit| self.references.type_name(Type::Quantity(unit.dimension)));
        let message = format!("`{}` is a `{first}` or a `{second}`", field.name());
        let error = Diagnostic::error(code::UNIT_MISMATCH, message).at(value.span, label);
        // Its sentence ends with an example in each unit.
        let examples = field.meaning().split_once(": `").map(|(_, examples)| examples.trim_end_matches('.'));
        self.reject(error.help_if(examples.map(|examples| format!("write `{examples}"))))
    }

    /// The road user to whom a gap is kept.
    fn kept(&mut self, value: &ast::Expr, place: &Place<'_>) -> Option<Who> {
        if let ast::ExprKind::Name(name) = &value.kind {
            return self.named_road_user(&ast::Name::new(name, value.span), place);
        }
        self.look_at(value, place, None);
        let error = Diagnostic::error(code::TYPE_MISMATCH, "a gap is kept to a road user that has a name");
        self.reject(
            error.at(value.span, "no name").help("write `to: truck`, or leave `to` out for the ego vehicle"),
        )
    }

    /// The rules of the road that are ignored: `[Signals, Ego]`.
    fn ignored_rules(&mut self, value: &ast::Expr, place: &Place<'_>) -> Option<Vec<WordExpr<TrafficRule>>> {
        let ast::ExprKind::List(items) = &value.kind else {
            self.look_at(value, place, None);
            let error = Diagnostic::error(code::TYPE_MISMATCH, "`ignores` is a list of rules of the road");
            let error = error.at(value.span, "no list");
            return self.reject(error.help("write them in brackets: `ignores: [Signals]`; `[]` for none"));
        };
        all_of(items.iter().map(|item| self.word::<TrafficRule>("rule of the road", item, place)))
    }
}
