//! Operators: logic, arithmetic, comparison and `in`, and what may stand on their two sides. Roads are no
//! values: `road == corner` and `road in [corner, boulevard]` are read here as one condition.

use crate::check::checker::Checker;
use crate::check::expression::{
    Place, SEEN_BY, article, dimension, fits, is_number, unit_help, unknown_here,
};
use crate::check::mistakes::{Report, all_of};
use crate::check::names::unknown;
use crate::check::references::Symbol;
use crate::model::expr::{Arithmetic, Comparison, Expr, ExprKind, Who};
use crate::model::vocabulary::{Known, LaneChoice, Site, Word, WordFact};
use crate::model::{BodyWord, Type, code};
use crate::syntax::ast::{BinaryOp, Span};
use crate::syntax::{Diagnostic, ast, one_of, print_expr};
use avastra_base::units;
use avastra_base::units::Rational;

/// Two expressions with an operator between them.
#[derive(Clone, Copy)]
pub(super) struct Sides<'a> {
    pub left: &'a ast::Expr,
    pub right: &'a ast::Expr,
    /// That of the whole.
    pub span: Span,
}

impl Checker {
    pub(super) fn binary(
        &mut self,
        op: BinaryOp,
        op_span: Span,
        sides: Sides<'_>,
        place: &Place<'_>,
    ) -> Option<Expr> {
        let Sides { left, right, span } = sides;
        let logic: fn(Box<Expr>, Box<Expr>) -> ExprKind = match op {
            BinaryOp::Implies => ExprKind::Implies,
            BinaryOp::Or => ExprKind::Or,
            BinaryOp::And => ExprKind::And,
            BinaryOp::In => return self.membership(sides, place),
            BinaryOp::Compare(op) => return self.comparison(op, sides, place),
            BinaryOp::Arithmetic(op) => return self.arithmetic(op, op_span, sides, place),
        };
        // Both sides are looked at, so that mistakes in both are reported.
        let left = self.typed(left, place, Type::Bool);
        let right = self.typed(right, place, Type::Bool);
        Some(Expr { kind: logic(Box::new(left?), Box::new(right?)), ty: Type::Bool, span })
    }

    fn arithmetic(&mut self, op: Arithmetic, at: Span, of: Sides<'_>, place: &Place<'_>) -> Option<Expr> {
        if let Some(error) = self.unit_apart(op, of, place) {
            return self.reject(error);
        }
        let (left, right) = (self.numeric(of.left, place), self.numeric(of.right, place));
        let (left, right, span) = (left?, right?, of.span);
        let (a, b) = (dimension(left.ty), dimension(right.ty));
        if op == Arithmetic::Divide && right.kind == ExprKind::Number(Rational::ZERO) {
            let error = Diagnostic::error(code::NUMBER, "a division by 0 has no value");
            return self.reject(error.at(span, "").beside(right.span, "is 0"));
        }
        let both_whole = left.ty == Type::Int && right.ty == Type::Int;
        let result = match op {
            Arithmetic::Add | Arithmetic::Subtract if a == b => Some(a),
            Arithmetic::Add | Arithmetic::Subtract => {
                let verb = if op == Arithmetic::Add { "added" } else { "subtracted" };
                self.mismatch(&format!("cannot be {verb}"), at, of, &left, &right);
                return None;
            }
            Arithmetic::Multiply => a.times(b),
            Arithmetic::Divide => a.per(b),
        };
        let Some(result) = result else {
            let error = Diagnostic::error(code::UNIT_MISMATCH, "the dimension is out of range");
            return self.reject(error.at(span, ""));
        };
        let ty = if both_whole && op != Arithmetic::Divide { Type::Int } else { Type::Quantity(result) };
        Some(Expr { kind: ExprKind::Arithmetic(op, Box::new(left), Box::new(right)), ty, span })
    }

    /// The mistake if a unit is written with blanks around its `/`: `18 km / h`.
    fn unit_apart(&self, op: Arithmetic, of: Sides<'_>, place: &Place<'_>) -> Option<Diagnostic> {
        let ast::ExprKind::Number(number) = &of.left.kind else { return None };
        let ast::ExprKind::Name(name) = &of.right.kind else { return None };
        let first = number.unit.as_ref().filter(|_| op == Arithmetic::Divide)?;
        let unit = units::unit(&format!("{}/{name}", first.text))?;
        let is_unknown = self.is_bare_variant(of.right, place) && self.references.owners(name).is_empty();
        is_unknown.then(|| {
            let span = Span::new(first.span.file, first.span.start, of.right.span.end);
            let error = Diagnostic::error(code::UNKNOWN_UNIT, "a unit is written without blanks");
            error.at(span, "read as a division").meant(span, unit.word)
        })
    }

    pub(super) fn mismatch(&mut self, what: &str, at: Span, sides: Sides<'_>, left: &Expr, right: &Expr) {
        let (a, b) = (self.references.type_name(left.ty), self.references.type_name(right.ty));
        let code =
            if is_number(left.ty) && is_number(right.ty) { code::UNIT_MISMATCH } else { code::TYPE_MISMATCH };
        let error = Diagnostic::error(code, format!("`{a}` and `{b}` {what}")).at(at, "");
        let error = error.beside(left.span, article(&a)).beside(right.span, article(&b));
        // The number beside what has a dimension already is the one that lacks it.
        let help = unit_help(sides.right, left.ty).or_else(|| unit_help(sides.left, right.ty));
        self.report(error.help_if(help.filter(|_| is_number(left.ty) && is_number(right.ty))));
    }

    fn comparison(&mut self, op: Comparison, sides: Sides<'_>, place: &Place<'_>) -> Option<Expr> {
        let Sides { left, right, span } = sides;
        let beside_road = self.names_road(left, place).then_some(right);
        let beside_road = beside_road.or_else(|| self.names_road(right, place).then_some(left));
        if let Some(road) = beside_road {
            if op.orders() {
                self.note_roads(core::slice::from_ref(road));
                let help = "write `road == corner`, or `road in [corner, boulevard]`";
                return self.unordered("roads have no order", op, span, help);
            }
            return Some(equal_or_not(op, self.on_road(core::slice::from_ref(road), place, span)?));
        }
        let facts = [self.word_fact(left, place), self.word_fact(right, place)];
        if let Some((who, fact)) = facts[0].or(facts[1]) {
            let word = if facts[0].is_some() { right } else { left };
            if op.orders() {
                let (words, name) = (fact.words(), self.as_asked(who, fact, place));
                let help =
                    format!("write `{name} == {0}`, or `{name} in [{0}, {1}]`", words[0].0, words[1].0);
                return self.unordered(&format!("`{name}` has no order"), op, span, &help);
            }
            return Some(equal_or_not(
                op,
                self.is_word(who, fact, core::slice::from_ref(word), place, span)?,
            ));
        }
        let (left, right) = self.both_sides(left, right, place)?;
        if !fits(left.ty, right.ty) && !fits(right.ty, left.ty) {
            self.mismatch("cannot be compared", span, sides, &left, &right);
            return None;
        }
        match left.ty {
            Type::Bool if op.orders() => {
                let help = "compare them with `==` or `!=`, or join them with `and`, `or`, `implies`";
                return self.unordered("truth values have no order", op, span, help);
            }
            Type::Enum(of) if op.orders() && !self.enums[of.0].ordered => {
                let of = &self.enums[of.0];
                let error = Diagnostic::error(code::UNORDERED, format!("`{}` has no order", of.name))
                    .at(span, format!("`{}` needs one", op.symbol()))
                    .beside(of.span, "declared with `|`")
                    .help("declare its variants with `<` between them, or compare with `==` or `in [..]`");
                return self.reject(error);
            }
            Type::Bool | Type::Enum(_) | Type::Int | Type::Quantity(_) => {}
        }
        Some(Expr { kind: ExprKind::Compare(op, Box::new(left), Box::new(right)), ty: Type::Bool, span })
    }

    /// Checks first the side that tells the type of the other.
    fn both_sides(&mut self, left: &ast::Expr, right: &ast::Expr, place: &Place<'_>) -> Option<(Expr, Expr)> {
        if self.is_bare_variant(left, place) {
            let Some(right) = self.expr(right, place, None) else {
                self.look_at(left, place, None);
                return None;
            };
            return Some((self.expr(left, place, Some(right.ty))?, right));
        }
        let left = self.expr(left, place, None);
        let right = self.expr(right, place, left.as_ref().map(|left| left.ty));
        Some((left?, right?))
    }

    fn membership(&mut self, Sides { left, right, span }: Sides<'_>, place: &Place<'_>) -> Option<Expr> {
        if let ast::ExprKind::List(items) = &right.kind
            && items.is_empty()
        {
            self.look_at(left, place, None);
            let error = Diagnostic::error(code::EMPTY, "nothing is in an empty list").at(right.span, "empty");
            return self.reject(error.help("list what is meant, or leave the condition out"));
        }
        if let (true, ast::ExprKind::List(roads)) = (self.names_road(left, place), &right.kind) {
            return self.on_road(roads, place, span);
        }
        if let (ast::ExprKind::List(words), Some((who, fact))) = (&right.kind, self.word_fact(left, place)) {
            return self.is_word(who, fact, words, place, span);
        }
        let Some(value) = self.expr(left, place, None) else {
            self.look_at(right, place, None);
            return None;
        };
        let ty = value.ty;
        let value = Box::new(value);
        let kind = match &right.kind {
            ast::ExprKind::Range { low, high } => {
                let low = self.typed(low, place, ty);
                let high = self.typed(high, place, ty);
                if !is_number(ty) {
                    let error = Diagnostic::error(code::TYPE_MISMATCH, "a range holds numbers");
                    return self.reject(error.at(value.span, "not a number"));
                }
                ExprKind::InRange(value, Box::new(low?), Box::new(high?))
            }
            ast::ExprKind::List(items) => {
                let items = items.iter().map(|item| self.typed(item, place, ty));
                ExprKind::InList(value, all_of(items)?)
            }
            ast::ExprKind::Field { base, field }
                if field.text == "lanes"
                    && matches!(&base.kind, ast::ExprKind::Name(name) if name == "road") =>
            {
                self.note_part(base, field);
                if !place.knows("road") {
                    return self.reject(unknown_here("road", right.span, place.site));
                }
                let lanes = self.words::<LaneChoice>("lane", ty, value.span)?;
                ExprKind::InLanes(value, lanes)
            }
            _ => {
                self.look_at(right, place, Some(ty));
                let error =
                    Diagnostic::error(code::TYPE_MISMATCH, "`in` needs a list, a range or `road.lanes`");
                return self.reject(with_range(error.at(right.span, "none of them"), right));
            }
        };
        Some(Expr { kind, ty: Type::Bool, span })
    }

    /// Reports that an operator asks for an order where there is none.
    fn unordered(&mut self, what: &str, op: Comparison, span: Span, help: &str) -> Option<Expr> {
        let error = Diagnostic::error(code::UNORDERED, what).at(span, format!("`{}` needs one", op.symbol()));
        self.reject(error.help(help))
    }

    /// `road == corner`: whether the road is one of these.
    fn on_road(&mut self, names: &[ast::Expr], place: &Place<'_>, span: Span) -> Option<Expr> {
        self.note_roads(names);
        if !place.knows("road") {
            return self.reject(unknown_here("road", span, place.site));
        }
        let road = |name: &ast::Expr| match &name.kind {
            ast::ExprKind::Name(text) if self.announced.roads.contains(text) => Some(text.clone()),
            ast::ExprKind::Name(text) => {
                let known = self.announced.roads.iter().map(String::as_str);
                self.reject(unknown("road", text, name.span, known))
            }
            _ => {
                let error = Diagnostic::error(code::TYPE_MISMATCH, "wanted the name of a road");
                self.reject(error.at(name.span, "not a name").help("write `road == corner`"))
            }
        };
        let roads = all_of(names.iter().map(road))?;
        Some(Expr { kind: ExprKind::OnRoad(roads), ty: Type::Bool, span })
    }

    /// A fact as the author asks for it: `ego.light`, `bus.light`.
    fn as_asked(&self, who: Option<Who>, fact: WordFact, place: &Place<'_>) -> String {
        let name = match who {
            None => return fact.name().to_owned(),
            Some(Who::Named(bearer)) => &self.bearers[bearer],
            Some(Who::Given(local)) => &place.locals[local].0,
        };
        let (_, part) = fact.name().split_once('.').expect("a fact about a road user has two parts");
        format!("{name}.{part}")
    }

    /// `priority == ego`, `ego.light in [Yellow, Red]`: whether the fact is one of these words.
    fn is_word(
        &mut self,
        who: Option<Who>,
        fact: WordFact,
        words: &[ast::Expr],
        place: &Place<'_>,
        span: Span,
    ) -> Option<Expr> {
        let knows = match who {
            Some(_) => place.site.knows(Known::World) && place.site != Site::Change,
            None => place.site.knows(fact.known()),
        };
        if !knows {
            let name = self.as_asked(who, fact, place);
            let error = Diagnostic::error(code::NOT_HERE, format!("`{name}` is not known here"));
            let who = match fact.known() {
                Known::Road | Known::World | Known::Spawn => format!("{SEEN_BY} the moment"),
                Known::Tick | Known::Near => {
                    "only requirements see it: it is watched at every tick".to_owned()
                }
                Known::Step => "only rewards and verdicts see what happened in the step".to_owned(),
                Known::Judgement => "only verdicts see how a collision was judged".to_owned(),
            };
            return self.reject(error.at(span, who));
        }
        if matches!(fact, WordFact::Hit | WordFact::Near) {
            let bodies = all_of(words.iter().map(|word| self.bodies_of(word)))?.concat();
            return Some(Expr { kind: ExprKind::IsBody(fact, bodies), ty: Type::Bool, span });
        }
        let words = all_of(words.iter().map(|word| self.word_of(fact, word)))?;
        let kind = match who {
            Some(who) => ExprKind::IsWordOf(who, fact, words),
            None => ExprKind::IsWord(fact, words),
        };
        Some(Expr { kind, ty: Type::Bool, span })
    }

    /// The bodies that a name beside `hit` or `near`: of the engine, or of the author's own.
    fn bodies_of(&mut self, word: &ast::Expr) -> Option<Vec<BodyWord>> {
        let name = self.name_of(word, "the name of a body")?;
        self.bodies_named(name, word.span)
    }

    fn word_of(&mut self, fact: WordFact, word: &ast::Expr) -> Option<String> {
        let words = fact.words();
        let names = || words.iter().map(|(name, _)| *name);
        let name = self.name_of(word, &one_of(&names().collect::<Vec<_>>()))?;
        let Some((known, meaning)) = words.iter().find(|(known, _)| *known == name) else {
            return self.reject(unknown(fact.name(), name, word.span, names()));
        };
        self.references.note(word.span, Symbol::Engine(known, meaning), false);
        Some(name.to_owned())
    }

    /// Notes the names among the expressions as roads.
    pub(super) fn note_roads(&mut self, names: &[ast::Expr]) {
        for expr in names {
            if let ast::ExprKind::Name(name) = &expr.kind {
                self.references.uses(expr.span, Symbol::Road(name.clone()));
            }
        }
    }

    /// Whether the expression is the word `road`, and no parameter, constant or state of that name hides it.
    fn names_road(&self, expr: &ast::Expr, place: &Place<'_>) -> bool {
        matches!(&expr.kind, ast::ExprKind::Name(name) if name == "road") && self.is_bare_variant(expr, place)
    }

    /// The fact that is compared with words, if the expression names one, which is then noted.
    fn word_fact(&mut self, expr: &ast::Expr, place: &Place<'_>) -> Option<(Option<Who>, WordFact)> {
        match &expr.kind {
            ast::ExprKind::Name(name) => {
                let fact = WordFact::from_name(name).filter(|_| self.is_bare_variant(expr, place))?;
                self.references.note(expr.span, Symbol::Engine(fact.name(), fact.meaning()), false);
                Some((None, fact))
            }
            ast::ExprKind::Field { base, field } => {
                let ast::ExprKind::Name(thing) = &base.kind else { return None };
                let Some(fact) = WordFact::from_name(&format!("{thing}.{}", field.text)) else {
                    let fact = WordFact::from_name(&format!("npc.{}", field.text))?;
                    let who = self.who(thing, base.span, place)?;
                    self.references.note(field.span, Symbol::Engine(fact.name(), fact.meaning()), false);
                    return Some((Some(who), fact));
                };
                self.note_part(base, field);
                Some((None, fact))
            }
            _ => None,
        }
    }
}

/// Says how a range is written, where a difference stands in its place: `5 m/s - 15 m/s`.
pub(super) fn with_range(error: Diagnostic, expr: &ast::Expr) -> Diagnostic {
    match &expr.kind {
        ast::ExprKind::Binary { op: BinaryOp::Arithmetic(Arithmetic::Subtract), op_span, left, right } => {
            let help = format!("a range is written `{} .. {}`", print_expr(left), print_expr(right));
            error.help(help).fix("write `..`", *op_span, "..")
        }
        _ => error,
    }
}

/// The result of `==`, or its opposite for `!=`.
fn equal_or_not(op: Comparison, is_so: Expr) -> Expr {
    match op {
        Comparison::NotEqual => {
            let span = is_so.span;
            Expr { kind: ExprKind::Not(Box::new(is_so)), ty: Type::Bool, span }
        }
        _ => is_so,
    }
}
