//! Expressions: every name found, every type and unit fitted. Operators are in `operator`.

use std::collections::BTreeSet;

use crate::check::checker::Checker;
use crate::check::declaration::HEIGHT_MAX;
use crate::check::mistakes::Report;
use crate::check::names::unknown;
use crate::check::operator::Sides;
use crate::check::references::Symbol;
use crate::model::expr::{Expr, ExprKind, Who};
use crate::model::vocabulary::{
    BEGINS, Fact, Known, NearWord, NumberWord, PastWord, ROAD_LANES, SINCE, Site, THERE, Word, WordFact,
    parts_of, parts_of_named, thing_of, things,
};
use crate::model::{EnumIndex, STATE_MAX, StateDef, Type, code};
use crate::syntax::ast::{Span, UnaryOp};
use crate::syntax::{Diagnostic, ast, listed, nearest, one_of};
use avastra_base::units;
use avastra_base::units::{Dimension, Rational};

/// The names that an expression may use where it stands, apart from constants and functions.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place<'a> {
    pub locals: &'a [(String, Type)],
    /// The function, action or manoeuvre whose parameters the locals are.
    pub owner: Option<&'a Symbol>,
    pub states: bool,
    pub site: Site,
}

impl Place<'_> {
    /// The condition of a rule.
    pub const RULE: Place<'static> = Place { locals: &[], owner: None, states: true, site: Site::Rule };

    fn fact(&self, name: &str) -> Option<Fact> {
        Fact::from_name(name).filter(|fact| self.site.knows_fact(*fact))
    }

    /// Whether something can be asked of a thing (`road`) here.
    pub(super) fn knows(&self, thing: &str) -> bool {
        self.site.knows_thing(thing)
    }
}

/// A fact of a road user that is named, or told by its number. Some are watched for requirements `on` bodies alone.
fn fact_of_named(part: &str) -> Option<Fact> {
    Fact::from_name(&format!("npc.{part}")).filter(|fact| fact.known() == Known::Spawn)
}

/// Most enums that the error about an ambiguous variant names.
const OWNERS_NAMED_MAX: usize = 12;

/// The thing that a bare name stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Named {
    /// The parameter, constant or state of that index.
    Local(usize),
    Constant(usize),
    State(usize),
    Fact(Fact),
    /// A variant of an enum, or no name that is known here.
    Variant,
}

impl Checker {
    /// The meaning of a bare name: the first of these that exists.
    fn named(&self, name: &str, place: &Place<'_>) -> Named {
        let local = || place.locals.iter().position(|(local, _)| local == name).map(Named::Local);
        let constant = || self.constant_places.get(name).copied().map(Named::Constant);
        let state = || self.state_places.get(name).copied().filter(|_| place.states);
        let fact = || place.fact(name).map(Named::Fact);
        let found = local().or_else(constant).or_else(|| state().map(Named::State)).or_else(fact);
        found.unwrap_or(Named::Variant)
    }

    /// Whether a name can only be a variant here, so that its type must come from elsewhere.
    pub(super) fn is_bare_variant(&self, expr: &ast::Expr, place: &Place<'_>) -> bool {
        matches!(&expr.kind, ast::ExprKind::Name(name) if self.named(name, place) == Named::Variant)
    }

    /// An expression of a wanted type; `None` once the mistake is reported.
    pub(super) fn typed(&mut self, expr: &ast::Expr, place: &Place<'_>, wanted: Type) -> Option<Expr> {
        let found = self.expr(expr, place, Some(wanted))?;
        self.fit(found, wanted, || unit_help(expr, wanted))
    }

    /// Reports an expression that is not of the wanted type; `help` says what to do about a number.
    pub(super) fn fit(
        &mut self,
        found: Expr,
        wanted: Type,
        help: impl FnOnce() -> Option<String>,
    ) -> Option<Expr> {
        if fits(found.ty, wanted) {
            return Some(found);
        }
        let (wanted_name, found_name) =
            (self.references.type_name(wanted), self.references.type_name(found.ty));
        let both_numbers = is_number(wanted) && is_number(found.ty);
        let (code, what) =
            if both_numbers { (code::UNIT_MISMATCH, "unit") } else { (code::TYPE_MISMATCH, "type") };
        let error =
            Diagnostic::error(code, format!("{what} mismatch: wanted `{wanted_name}`, found `{found_name}`"))
                .at(found.span, format!("this is {}", article(&found_name)));
        let help = match wanted {
            Type::Enum(of) if self.enums[of.0].variants.len() <= 12 => {
                let variants: Vec<&str> = self.enums[of.0].variants.iter().map(String::as_str).collect();
                Some(format!("a `{wanted_name}` is {}", one_of(&variants)))
            }
            Type::Enum(_) | Type::Bool => None,
            Type::Int | Type::Quantity(_) if both_numbers => help(),
            Type::Int | Type::Quantity(_) => None,
        };
        self.reject(error.help_if(help))
    }

    /// An expression of any type. `hint` decides between variants of the same name.
    pub(super) fn expr(&mut self, expr: &ast::Expr, place: &Place<'_>, hint: Option<Type>) -> Option<Expr> {
        let span = expr.span;
        let make = |kind, ty| Some(Expr { kind, ty, span });
        match &expr.kind {
            ast::ExprKind::Number(number) => self.number(number),
            ast::ExprKind::Bool(truth) => make(ExprKind::Bool(*truth), Type::Bool),
            ast::ExprKind::Name(name) => self.name(name, span, place, hint),
            ast::ExprKind::Unary { op: UnaryOp::Not, operand } => {
                let inner = self.typed(operand, place, Type::Bool)?;
                make(ExprKind::Not(Box::new(inner)), Type::Bool)
            }
            ast::ExprKind::Unary { op: UnaryOp::Negate, operand } => {
                let inner = self.numeric(operand, place)?;
                let ty = inner.ty;
                match inner.kind {
                    ExprKind::Number(value) => {
                        make(ExprKind::Number(self.exact(value.checked_neg(), span)?), ty)
                    }
                    _ => make(ExprKind::Negate(Box::new(inner)), ty),
                }
            }
            ast::ExprKind::Binary { op, op_span, left, right } => {
                self.binary(*op, *op_span, Sides { left, right, span }, place)
            }
            ast::ExprKind::Field { base, field } => self.part(base, field, place, span),
            ast::ExprKind::Index { base, index } => self.index(base, index, place, span),
            ast::ExprKind::Call(call) => self.call(call, place),
            ast::ExprKind::Match { subject, arms } => self.matching(subject, arms, place, hint, span),
            ast::ExprKind::Text(text) => self.misplaced_text(text, span),
            ast::ExprKind::List(items) => {
                items.iter().for_each(|item| self.look_at(item, place, hint));
                self.misplaced("a list", span)
            }
            ast::ExprKind::Record(fields) => {
                fields.iter().for_each(|field| self.look_at(&field.value, place, hint));
                self.misplaced("a record", span)
            }
            ast::ExprKind::Range { low, high } => {
                [low, high].into_iter().for_each(|end| self.look_at(end, place, hint));
                self.misplaced("a range", span)
            }
            ast::ExprKind::LanePoint { .. } => self.misplaced("a lane point", span),
            ast::ExprKind::Numbered { .. } => self.misplaced("a numbered road user", span),
        }
    }

    /// Notes the names of an expression in a place that is broken already: no mistake is reported.
    pub(super) fn look_at(&mut self, expr: &ast::Expr, place: &Place<'_>, hint: Option<Type>) {
        self.quietly(|checker| checker.expr(expr, place, hint));
    }

    /// Notes the names of fields, and looks at the values of fields that do not exist.
    pub(super) fn note_fields<W: Word>(&mut self, fields: &[ast::Field], among: &[W], place: &Place<'_>) {
        for field in fields {
            match W::from_name(&field.name.text).filter(|word| among.contains(word)) {
                Some(word) => self.references.word(field.name.span, word),
                None => self.look_at(&field.value, place, None),
            }
        }
    }

    /// A text in an expression; most often a word of an enum, as other languages write it.
    fn misplaced_text(&mut self, text: &str, span: Span) -> Option<Expr> {
        let message = "a text cannot be computed with";
        let error = Diagnostic::error(code::TYPE_MISMATCH, message).at(span, "not a value of an expression");
        let is_word = text.starts_with(|first: char| first.is_ascii_alphabetic())
            && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        self.reject(match is_word {
            true => error.help(format!("write `{text}`: words stand without quotes")),
            false => error,
        })
    }

    fn misplaced(&mut self, what: &str, span: Span) -> Option<Expr> {
        let error = Diagnostic::error(code::TYPE_MISMATCH, format!("{what} cannot be computed with"));
        self.reject(error.at(span, "not a value of an expression"))
    }

    /// A number literal in SI units.
    pub(super) fn number(&mut self, number: &ast::Number) -> Option<Expr> {
        self.references.number(number);
        let value = self.exact(Rational::from_literal(&number.digits), number.span)?;
        let (value, ty) = match &number.unit {
            None if value.is_integer() && !number.digits.contains(['.', 'e', 'E']) => {
                if is_beyond_states(value) {
                    let error = Diagnostic::error(code::NUMBER, "no `Int` is so large");
                    return self.reject(error.at(number.span, NUMBER_MAX));
                }
                (Some(value), Type::Int)
            }
            None => (Some(value), Type::Quantity(Dimension::RATIO)),
            Some(word) => match units::unit(&word.text) {
                Some(unit) => (value.checked_mul(unit.factor()), Type::Quantity(unit.dimension)),
                None => {
                    return self.reject(unknown_unit(word));
                }
            },
        };
        let value = self.exact(value, number.span)?;
        Some(Expr { kind: ExprKind::Number(value), ty, span: number.span })
    }

    fn exact(&mut self, value: Option<Rational>, span: Span) -> Option<Rational> {
        value.or_else(|| {
            let message = "the number is too large or too fine to be held exactly";
            let error = Diagnostic::error(code::NUMBER, message).at(span, "about 38 digits are possible");
            self.reject(error.help("round it, or take a unit that is larger or smaller"))
        })
    }

    fn name(&mut self, name: &str, span: Span, place: &Place<'_>, hint: Option<Type>) -> Option<Expr> {
        let make = |kind, ty| Some(Expr { kind, ty, span });
        match self.named(name, place) {
            Named::Local(index) => {
                if let Some(owner) = place.owner {
                    self.references.uses_parameter(&ast::Name::new(name, span), owner);
                }
                make(ExprKind::Local(index), place.locals[index].1)
            }
            Named::Constant(index) => {
                self.references.uses(span, Symbol::Constant(name.to_owned()));
                self.constants[index].1.clone().map(|value| Expr { span, ..value })
            }
            Named::State(index) => {
                self.references.uses(span, Symbol::State(name.to_owned()));
                let state = &self.states[index];
                if state.key.is_none() {
                    return make(ExprKind::Cell(state.first_cell), state.ty);
                }
                let error = Diagnostic::error(code::TYPE_MISMATCH, format!("`{name}` is a map"));
                self.reject(error.at(span, "a key is missing").help(format!("write `{name}[key]`")))
            }
            Named::Fact(fact) => {
                self.references.word(span, fact);
                make(ExprKind::Fact(fact), fact.ty())
            }
            Named::Variant => self.bare_variant(name, span, place, hint),
        }
    }

    /// A variant of the wanted enum, or of the only one that has it.
    fn bare_variant(
        &mut self,
        name: &str,
        span: Span,
        place: &Place<'_>,
        hint: Option<Type>,
    ) -> Option<Expr> {
        let owners = self.references.owners(name).to_vec();
        let wanted = enum_of(hint);
        let of = match (wanted, owners.as_slice()) {
            (Some(of), owners) if owners.contains(&of) => of,
            (_, [of]) => *of,
            (_, []) => {
                self.note_broken(name, span, place);
                let error = self.not_here(name, span, place);
                let error = error.unwrap_or_else(|| self.unknown_name(name, span, place, wanted));
                return self.reject(error);
            }
            (_, owners) => {
                let named = owners.iter().take(OWNERS_NAMED_MAX);
                let enums: Vec<&str> = named.map(|of| self.enums[*of].name.as_str()).collect();
                let others = match owners.len() - enums.len() {
                    0 => String::new(),
                    others => format!(" and of {others} other enums"),
                };
                let message = format!("`{name}` is a variant of {}{others}", listed(&enums));
                let error = Diagnostic::error(code::AMBIGUOUS, message)
                    .at(span, "which one is meant does not follow from here")
                    .help("compare it with what has the wanted type, or rename one of the two");
                return self.reject(error);
            }
        };
        let index = self.enums[of].variants.iter().position(|variant| variant == name)?;
        self.references.variant(&ast::Name::new(name, span), Some(of));
        Some(Expr { kind: ExprKind::Variant(EnumIndex(of), index), ty: Type::Enum(EnumIndex(of)), span })
    }

    /// The diagnostic for a bare name that stands for nothing; `wanted` is the enum that the place asks for.
    fn unknown_name(&self, name: &str, span: Span, place: &Place<'_>, wanted: Option<usize>) -> Diagnostic {
        let locals = place.locals.iter().map(|(name, _)| name.as_str());
        let enums = match wanted {
            Some(of) => core::slice::from_ref(&self.enums[of]),
            None => self.enums.as_slice(),
        };
        let variants = enums.iter().flat_map(|of| &of.variants).map(String::as_str);
        let constants = self.constants.iter().map(|(name, _)| name.as_str());
        let states = self.states.iter().filter(|_| place.states).map(|state| state.name.as_str());
        let facts = place.site.facts().map(|fact| fact.name());
        let words = place.site.word_facts().map(|fact| fact.name());
        let of_engine = facts.chain(words).filter(|name| !name.contains('.'));
        let candidates = locals.chain(variants).chain(constants).chain(states).chain(of_engine);
        self.unknown("name", name, span, candidates)
    }

    /// Notes the name of a declaration that is itself broken, or that is not known in this place.
    fn note_broken(&mut self, name: &str, span: Span, place: &Place<'_>) {
        let parameter = place.owner.and_then(|owner| owner.parameter(name));
        let others = [Symbol::Constant, Symbol::State].map(|symbol| symbol(name.to_owned()));
        parameter.into_iter().chain(others).for_each(|symbol| self.references.uses(span, symbol));
        self.references.word_named::<Fact>(span, name);
    }

    /// The diagnostic for a name that exists and cannot be used here; `None` if there is no such name.
    fn not_here(&self, name: &str, span: Span, place: &Place<'_>) -> Option<Diagnostic> {
        let reason = self.lacking(name, place)?;
        let error = Diagnostic::error(code::NOT_HERE, format!("`{name}` cannot be used here"));
        Some(error.at(span, "not in this place").note(reason))
    }

    /// Why a name that exists cannot be used here; `None` if there is no such name.
    fn lacking(&self, name: &str, place: &Place<'_>) -> Option<String> {
        if place.knows(name) {
            let facts = place.site.facts().map(|fact| fact.name());
            let known = facts.chain(place.site.word_facts().map(|fact| fact.name()));
            let of_thing = known.filter(|known| thing_of(known) == Some(name));
            let mut asked: Vec<String> = of_thing.map(str::to_owned).collect();
            if name == "road" {
                asked.extend(["road == corner", "road in [corner, boulevard]"].map(str::to_owned));
            }
            return Some(format!("`{name}` is no value: ask for {}", one_of(&asked)));
        }
        if let Some(fact) = WordFact::from_name(name).filter(|fact| place.site.knows(fact.known())) {
            let example = fact.words().first().map_or("", |(word, _)| word);
            return Some(format!("`{name}` is no value: compare it, as in `{name} == {example}`"));
        }
        if Fact::from_name(name).is_some() && place.fact(name).is_none() {
            return Some(format!("`{name}` is known to the engine, but not in this place"));
        }
        if place.states || !self.state_places.contains_key(name) {
            return None;
        }
        Some(match place.site {
            Site::Axis => format!(
                "`{name}` is a state, and the rows of the table are the same in every state: write a rule"
            ),
            Site::Change => format!("`{name}` is a state, and none is looked up when a lane change begins"),
            Site::Phase => format!("`{name}` is a state, and none is looked up when a phase begins"),
            _ => format!("`{name}` is a state, and functions and constants see none: pass it as a parameter"),
        })
    }

    /// `road.limit`: a fact about a thing.
    fn part(&mut self, base: &ast::Expr, part: &ast::Name, place: &Place<'_>, span: Span) -> Option<Expr> {
        if let ast::ExprKind::Numbered { name, number } = &base.kind {
            return self.part_of_road_user((name, number, base.span), part, place, span);
        }
        if let ast::ExprKind::Name(name) = &base.kind
            && let Some(who) = self.who(name, base.span, place)
        {
            return self.part_of_bearer(who, part, place, span);
        }
        if let Some(found) = self.part_of_requirement(base, part, place, span) {
            return found;
        }
        self.note_part(base, part);
        let things = things();
        let thing = match &base.kind {
            ast::ExprKind::Name(name) if things.contains(&name.as_str()) => name,
            _ => {
                self.look_at(base, place, None);
                let message = format!("only named road users, {} have fields", listed(&things));
                let error = Diagnostic::error(code::UNKNOWN, message).at(base.span, "none of these");
                let ast::ExprKind::Name(name) = &base.kind else { return self.reject(error) };
                let known = things.iter().copied().chain(self.bearers.iter().map(String::as_str));
                return match nearest(name, known) {
                    Some(word) => self.reject(error.meant(base.span, word)),
                    None => self.reject(error),
                };
            }
        };
        let name = format!("{thing}.{}", part.text);
        let is_known = |known: Known| place.site.knows(known);
        if let Some(fact) = place.fact(&name) {
            return Some(Expr { kind: ExprKind::Fact(fact), ty: fact.ty(), span });
        } else if Fact::from_name(&name).is_some_and(|fact| {
            fact.known() == Known::Tick || fact.known() == Known::Near && !place.site.is_requirement()
        }) {
            let error = Diagnostic::error(code::NOT_HERE, format!("`{name}` is not known here"));
            self.report(error.at(span, "only requirements see it: it is watched at every tick"));
        } else if !place.knows(thing) || Fact::from_name(&name).is_some_and(|fact| !is_known(fact.known())) {
            self.report(unknown_here(thing, span, place.site));
        } else if let Some(fact) = WordFact::from_name(&name) {
            let words = fact.words();
            let example = words.first().map_or("", |(word, _)| word);
            let error = Diagnostic::error(code::TYPE_MISMATCH, format!("`{name}` is a word of the engine"));
            self.report(error.at(span, "no value").help(format!("compare it: `{name} == {example}`")));
        } else if name == ROAD_LANES.0 {
            let error = Diagnostic::error(code::TYPE_MISMATCH, "`road.lanes` is a set of lanes");
            self.report(error.at(span, "not a value").help("write `lane in road.lanes`"));
        } else {
            let parts = parts_of(thing).into_iter().map(|(part, _)| part);
            self.report(unknown(&format!("{thing} fact"), &part.text, part.span, parts));
        }
        None
    }

    /// `npc#2.gap`: a fact about a road user by its number.
    fn part_of_road_user(
        &mut self,
        (name, number, at): (&ast::Name, &str, Span),
        part: &ast::Name,
        place: &Place<'_>,
        span: Span,
    ) -> Option<Expr> {
        if place.site != Site::Trigger {
            let error = Diagnostic::error(code::NOT_HERE, "road users have no numbers here");
            return self.reject(error.at(at, "only a scenario's `once` asks for one by its number"));
        }
        let id = number.parse::<u32>().ok().filter(|id| *id > 0 && name.text == "npc");
        let Some(id) = id else {
            let error = Diagnostic::error(code::UNKNOWN, "no such road user").at(at, "none has this number");
            return self.reject(error.help("road users are `npc#1`, `npc#2` and so on, as they appear"));
        };
        let Some(fact) = fact_of_named(&part.text) else {
            return self.reject(unknown(
                "npc fact",
                &part.text,
                part.span,
                parts_of_named().into_iter().map(|(part, _)| part),
            ));
        };
        self.references.note(part.span, Symbol::Engine(fact.name(), fact.meaning()), false);
        Some(Expr { kind: ExprKind::OfRoadUser(id, fact), ty: fact.ty(), span })
    }

    /// `truck.gap`: a fact about a road user by its name.
    fn part_of_bearer(&mut self, who: Who, part: &ast::Name, place: &Place<'_>, span: Span) -> Option<Expr> {
        if !place.site.knows(Known::World) || place.site == Site::Change {
            let error = Diagnostic::error(code::NOT_HERE, "no road user is looked up here");
            let error = error.at(span, "about one that is there at a moment");
            return self.reject(error.help("ask for it in a rule, or in the `where` of a drawn parameter"));
        }
        if part.text == THERE.0 {
            self.references.note(part.span, Symbol::Engine(THERE.0, THERE.1), false);
            return Some(Expr { kind: ExprKind::IsThere(who), ty: Type::Bool, span });
        }
        if let Some(fact) = WordFact::from_name(&format!("npc.{}", part.text)) {
            let words = fact.words();
            let example = words.first().map_or("", |(word, _)| word);
            let message = format!("`{}` is a word of the engine", part.text);
            let error = Diagnostic::error(code::TYPE_MISMATCH, message).at(span, "no value");
            return self.reject(error.help(format!("compare it: `.{} == {example}`", part.text)));
        }
        let Some(fact) = fact_of_named(&part.text) else {
            if Fact::from_name(&format!("npc.{}", part.text)).is_some_and(|fact| fact.known() == Known::Near)
            {
                let error =
                    Diagnostic::error(code::NOT_HERE, format!("`.{}` is not known of a name", part.text));
                let help = format!("ask for `npc.{}` in a requirement `on` its body", part.text);
                return self.reject(error.at(span, "watched of each road user near").help(help));
            }
            let parts = parts_of_named().into_iter().map(|(part, _)| part).chain([THERE.0]);
            return self.reject(unknown("fact of a road user", &part.text, part.span, parts));
        };
        self.references.note(part.span, Symbol::Engine(fact.name(), fact.meaning()), false);
        Some(Expr { kind: ExprKind::OfBearer(who, fact), ty: fact.ty(), span })
    }

    /// Notes the `limit` of `road.limit`.
    pub(super) fn note_part(&mut self, base: &ast::Expr, part: &ast::Name) {
        let ast::ExprKind::Name(thing) = &base.kind else { return };
        if let Some((word, meaning)) = parts_of(thing).into_iter().find(|(word, _)| *word == part.text) {
            self.references.note(part.span, Symbol::Engine(word, meaning), false);
        }
    }

    fn index(&mut self, base: &ast::Expr, index: &ast::Expr, place: &Place<'_>, span: Span) -> Option<Expr> {
        let state = match &base.kind {
            ast::ExprKind::Name(name) => {
                self.references.uses(base.span, Symbol::State(name.clone()));
                self.state_places.get(name).copied().filter(|_| place.states)
            }
            _ => {
                self.look_at(base, place, None);
                None
            }
        };
        let Some(state) = state else {
            let maps =
                || self.states.iter().filter(|state| state.key.is_some()).map(|state| state.name.as_str());
            let error = match &base.kind {
                ast::ExprKind::Name(name) => {
                    let error = self.not_here(name, base.span, place);
                    error.unwrap_or_else(|| self.unknown("map", name, base.span, maps()))
                }
                _ => Diagnostic::error(code::TYPE_MISMATCH, "only a state can have a key")
                    .at(base.span, "not a state"),
            };
            self.look_at(index, place, None);
            return self.reject(error);
        };
        let StateDef { ref name, key, ty, first_cell, span: declared_at, .. } = self.states[state];
        let Some(key_of) = key else {
            let message = format!("`{name}` is not a map");
            self.look_at(index, place, None);
            let error = Diagnostic::error(code::TYPE_MISMATCH, message);
            return self.reject(error.at(span, "takes no key").beside(declared_at, "declared here"));
        };
        let key = self.typed(index, place, Type::Enum(key_of))?;
        let kind = match key.kind {
            ExprKind::Variant(_, key) => ExprKind::Cell(first_cell + key),
            _ => ExprKind::CellAt(first_cell, Box::new(key)),
        };
        Some(Expr { kind, ty, span })
    }

    /// `since(vehicles)`: the time since one of these actions last happened.
    fn since(&mut self, call: &ast::Call, place: &Place<'_>) -> Option<Expr> {
        self.references.note(call.name.span, Symbol::Engine(SINCE.0, SINCE.1), false);
        if !place.site.knows_actions() {
            let error = Diagnostic::error(code::NOT_HERE, "`since` cannot be asked here");
            let error = error.at(call.span, "not in this place");
            return self.reject(error.help("ask in a rule, in `each step` or in `odds actions`"));
        }
        let [ast::Arg { name: None, value }] = call.args.as_slice() else {
            let error = Diagnostic::error(code::ARGUMENTS, "`since` takes one name").at(call.span, "");
            return self.reject(error.help("write an action or a group: `since(vehicles) >= 10 s`"));
        };
        let ast::ExprKind::Name(name) = &value.kind else {
            let error = Diagnostic::error(code::TYPE_MISMATCH, "`since` is about actions");
            let error = error.at(value.span, "no name of one");
            return self.reject(error.help("write an action or a group: `since(vehicles) >= 10 s`"));
        };
        let actions = self.targets(&ast::Name::new(name, value.span));
        if actions.is_empty() {
            return None;
        }
        let ty = Type::Quantity(Dimension::DURATION);
        Some(Expr { kind: ExprKind::Since(actions, name.clone()), ty, span: call.span })
    }

    fn call(&mut self, call: &ast::Call, place: &Place<'_>) -> Option<Expr> {
        let name = call.name.text.as_str();
        let built_in = (PastWord::from_name(name), NumberWord::from_name(name), NearWord::from_name(name));
        let is_built_in = built_in != (None, None, None) || [SINCE.0, BEGINS.0].contains(&name);
        match self.function_names.place(name) {
            // A file that uses this one must not change what it says.
            Some(declared) if is_built_in && declared.file != call.name.span.file => {
                let message =
                    format!("`{name}` is built in, and another file declares a function of that name");
                let error = Diagnostic::error(code::DUPLICATE, message).at(declared, "declared here");
                let error = error.beside(call.name.span, "the built-in one is meant here");
                return self.reject(error.help("give the function another name"));
            }
            Some(_) => {}
            None => match built_in {
                (Some(word), ..) => return self.past(word, call, place),
                (_, Some(word), _) => return self.of_numbers(word, call, place),
                (.., Some(word)) => return self.near(word, call, place),
                _ if name == SINCE.0 => return self.since(call, place),
                _ if name == BEGINS.0 => return self.begins(call, place),
                _ => {}
            },
        }
        let symbol = Symbol::Function(call.name.text.clone());
        let named = call.args.iter().filter_map(|argument| argument.name.as_ref());
        for name in named {
            self.references.uses_parameter(name, &symbol);
        }
        self.references.uses(call.name.span, symbol);
        let Some(index) = self.function_names.get(&call.name.text) else {
            self.look_at_arguments(&call.args, place);
            if self.announced.functions.contains(&call.name.text) {
                let error = Diagnostic::error(code::NOT_HERE, "a constant cannot call functions");
                return self
                    .reject(error.at(call.span, "called here").help("make it a `fn` without parameters"));
            }
            let names = self.function_names.all();
            let error = self.unknown("function", &call.name.text, call.name.span, names);
            return self.reject(error);
        };
        // A function whose own header is broken was reported there.
        let Some((parameters, result, header)) = self.signatures.get(index).cloned().flatten() else {
            self.look_at_arguments(&call.args, place);
            return None;
        };
        let arguments = self.arguments(call, &parameters, Some(header), place)?;
        Some(Expr { kind: ExprKind::Call(index, arguments), ty: result, span: call.span })
    }

    /// `min`, `max` and `abs`: of numbers of one kind, of which the result is one, too.
    fn of_numbers(&mut self, word: NumberWord, call: &ast::Call, place: &Place<'_>) -> Option<Expr> {
        self.references.note(call.name.span, Symbol::Engine(word.name(), word.meaning()), false);
        let wanted = word.arity();
        if call.args.len() != wanted || call.args.iter().any(|argument| argument.name.is_some()) {
            self.look_at_arguments(&call.args, place);
            let (name, numbers, given) = match wanted {
                1 => (word.name(), "one number", "(npc.offset)"),
                _ => (word.name(), "two numbers", "(npc.speed, 10 m/s)"),
            };
            let error = Diagnostic::error(code::ARGUMENTS, format!("`{name}` takes {numbers}"));
            return self.reject(error.at(call.span, "").help(format!("write `{name}{given}`, for example")));
        }
        let numbers: Vec<Option<Expr>> =
            call.args.iter().map(|argument| self.numeric(&argument.value, place)).collect();
        let numbers: Vec<Expr> = numbers.into_iter().collect::<Option<_>>()?;
        if let [left, right] = numbers.as_slice()
            && dimension(left.ty) != dimension(right.ty)
        {
            let (left_of, right_of) = (&call.args[0].value, &call.args[1].value);
            let sides = Sides { left: left_of, right: right_of, span: call.span };
            self.mismatch("cannot be compared", call.name.span, sides, left, right);
            return None;
        }
        let all_whole = numbers.iter().all(|number| number.ty == Type::Int);
        let ty = if all_whole { Type::Int } else { Type::Quantity(dimension(numbers[0].ty)) };
        Some(Expr { kind: ExprKind::OfNumbers(word, numbers), ty, span: call.span })
    }

    /// The arguments of a call, by parameter. `header` is where the parameters are declared.
    pub(super) fn arguments(
        &mut self,
        call: &ast::Call,
        parameters: &[(String, Type)],
        header: Option<Span>,
        place: &Place<'_>,
    ) -> Option<Vec<Expr>> {
        if call.args.len() != parameters.len() {
            self.look_at_arguments(&call.args, place);
            let message = format!(
                "`{}` takes {} argument{}, not {}",
                call.name.text,
                parameters.len(),
                if parameters.len() == 1 { "" } else { "s" },
                call.args.len()
            );
            let error = Diagnostic::error(code::ARGUMENTS, message).at(call.span, "");
            let beside = |error: Diagnostic, header| error.beside(header, "declared here");
            return self.reject(header.into_iter().fold(error, beside));
        }
        let names: Vec<&str> = parameters.iter().map(|(parameter, _)| parameter.as_str()).collect();
        let mut given = vec![None; parameters.len()];
        let mut arguments: Vec<Option<Expr>> = vec![None; parameters.len()];
        for (position, argument) in call.args.iter().enumerate() {
            let Some(slot) = self.slot(call, position, &names, &mut given) else {
                self.look_at_arguments(&call.args[position..], place);
                return None;
            };
            arguments[slot] = self.typed(&argument.value, place, parameters[slot].1);
        }
        arguments.into_iter().collect()
    }

    pub(super) fn look_at_arguments(&mut self, arguments: &[ast::Arg], place: &Place<'_>) {
        arguments.iter().for_each(|argument| self.look_at(&argument.value, place, None));
    }

    fn matching(
        &mut self,
        subject: &ast::Expr,
        arms: &[ast::Arm],
        place: &Place<'_>,
        hint: Option<Type>,
        span: Span,
    ) -> Option<Expr> {
        let subject = self.expr(subject, place, None);
        let of = enum_of(subject.as_ref().map(|subject| subject.ty));
        arms.iter().flat_map(|arm| &arm.patterns).for_each(|pattern| self.references.variant(pattern, of));
        if subject.is_none() {
            arms.iter().for_each(|arm| self.look_at(&arm.value, place, hint));
        }
        let subject = subject?;
        let variants: Vec<String> = match subject.ty {
            Type::Enum(of) => self.enums[of.0].variants.clone(),
            Type::Bool => vec!["false".to_owned(), "true".to_owned()],
            Type::Int | Type::Quantity(_) => {
                return self.matching_number(subject, arms, place, hint, span);
            }
        };
        let mut arm_of: Vec<Option<usize>> = vec![None; variants.len()];
        let mut bodies: Vec<Option<Expr>> = Vec::new();
        let mut ty = hint;
        for (index, arm) in arms.iter().enumerate() {
            self.cover(arm, index, &variants, &mut arm_of);
            bodies.push(self.arm_value(&arm.value, place, &mut ty));
        }
        let missing: Vec<&str> = (0..variants.len())
            .filter(|variant| arm_of[*variant].is_none())
            .map(|variant| variants[variant].as_str())
            .collect();
        if !missing.is_empty() {
            let error = Diagnostic::error(code::NOT_EXHAUSTIVE, "`match` does not cover every case");
            let error = error.at(span, format!("missing: {}", listed(&missing)));
            return self.reject(error.help("add an arm for each, or `_ => …` for the rest"));
        }
        let arms: Option<Vec<Expr>> = bodies.into_iter().collect();
        let arms = arms?;
        let ty = arms.first()?.ty;
        let arm_of = arm_of.into_iter().flatten().collect();
        Some(Expr { kind: ExprKind::Match { subject: Box::new(subject), arm_of, arms }, ty, span })
    }

    /// The number of a pattern, of the type of what is matched; `None` if it is none, which is reported.
    fn number_pattern(&mut self, pattern: &ast::Name, ty: Type) -> Option<Rational> {
        let written = pattern.text.strip_prefix('-').unwrap_or(&pattern.text);
        let is_digits = |end: &usize| {
            written.is_char_boundary(*end) && Rational::from_literal(&written[..*end]).is_some()
        };
        let Some(end) = (1..=written.len()).rev().find(is_digits) else {
            let message = format!("`{}` is no number", pattern.text);
            let error = Diagnostic::error(code::TYPE_MISMATCH, message);
            let error =
                error.at(pattern.span, format!("the value is {}", article(&self.references.type_name(ty))));
            return self.reject(error.help("write a number, or `_` for all that are left"));
        };
        let unit = written[end..].trim();
        let unit = (!unit.is_empty()).then(|| ast::Name::new(unit, pattern.span));
        let number = ast::Number { digits: written[..end].to_owned(), unit, span: pattern.span };
        let found = self.number(&number)?;
        let found = self.fit(found, ty, || None)?;
        let value = self.fold_number(&found)?;
        Some(if written.len() < pattern.text.len() { Rational::ZERO.checked_sub(value)? } else { value })
    }

    /// `match` on a number: a choice between an arm and the arms after it, for each arm.
    fn matching_number(
        &mut self,
        subject: Expr,
        arms: &[ast::Arm],
        place: &Place<'_>,
        hint: Option<Type>,
        span: Span,
    ) -> Option<Expr> {
        let (mut taken, mut seen): (Vec<Rational>, BTreeSet<Rational>) = (Vec::new(), BTreeSet::new());
        let mut ty = hint;
        let mut sound = true;
        let mut chosen: Vec<(Vec<Expr>, Expr)> = Vec::new();
        let mut rest: Option<Expr> = None;
        for arm in arms {
            let before = taken.len();
            for pattern in &arm.patterns {
                match self.number_pattern(pattern, subject.ty) {
                    Some(number) if seen.insert(number) => taken.push(number),
                    Some(_) => {}
                    None => sound = false,
                }
            }
            if sound && (rest.is_some() || before == taken.len() && !arm.patterns.is_empty()) {
                let error = Diagnostic::error(code::NEVER_REACHED, "this arm is never reached");
                self.report(error.at(arm.span, "earlier arms take everything it names").help("remove it"));
            }
            let Some(body) = self.arm_value(&arm.value, place, &mut ty) else {
                sound = false;
                continue;
            };
            let make = |kind, ty| Expr { kind, ty, span: arm.span };
            let numbers = taken[before..].iter().map(|number| make(ExprKind::Number(*number), subject.ty));
            match arm.patterns.is_empty() {
                true => rest = rest.or(Some(body)),
                false => chosen.push((numbers.collect(), body)),
            }
        }
        if !sound {
            return None;
        }
        let Some(rest) = rest else {
            let error = Diagnostic::error(code::NOT_EXHAUSTIVE, "`match` does not cover every case");
            let error = error.at(span, "missing: all other numbers");
            return self.reject(error.help("add `_ => …` for the rest"));
        };
        let too_large = || {
            let error = Diagnostic::error(code::TOO_LARGE, "this `match` has too many arms")
                .at(span, "each arm asks for the number again, after all arms before it");
            error.help("pass the number to a function as a parameter, or make several functions of it")
        };
        if chosen.len().saturating_mul(subject.operations()) > HEIGHT_MAX as usize {
            return self.reject(too_large());
        }
        let chain = chosen.into_iter().rev().fold(rest, |rest, (numbers, body)| {
            let ty = rest.ty;
            let is_one = ExprKind::InList(Box::new(subject.clone()), numbers);
            let subject = Box::new(Expr { kind: is_one, ty: Type::Bool, span: subject.span });
            Expr { kind: ExprKind::Match { subject, arm_of: vec![1, 0], arms: vec![body, rest] }, ty, span }
        });
        if chain.height() > HEIGHT_MAX {
            return self.reject(too_large());
        }
        Some(chain)
    }

    /// The value of an arm, of type `ty` if that is known already; else it gives the type of the arms after it.
    fn arm_value(&mut self, value: &ast::Expr, place: &Place<'_>, ty: &mut Option<Type>) -> Option<Expr> {
        let found = self.expr(value, place, *ty)?;
        let wanted = *ty.get_or_insert(found.ty);
        self.fit(found, wanted, || unit_help(value, wanted))
    }

    /// Notes which variants an arm takes, and reports the arm if it takes none.
    fn cover(&mut self, arm: &ast::Arm, index: usize, variants: &[String], arm_of: &mut [Option<usize>]) {
        let mut reached = false;
        let mut sound = true;
        if arm.patterns.is_empty() {
            for slot in arm_of.iter_mut().filter(|slot| slot.is_none()) {
                *slot = Some(index);
                reached = true;
            }
        }
        for pattern in &arm.patterns {
            match variants.iter().position(|variant| *variant == pattern.text) {
                None => {
                    sound = false;
                    let candidates = variants.iter().map(String::as_str);
                    self.report(unknown("variant", &pattern.text, pattern.span, candidates));
                }
                Some(variant) if arm_of[variant].is_none() => {
                    arm_of[variant] = Some(index);
                    reached = true;
                }
                Some(_) => {}
            }
        }
        if !reached && sound {
            let error = Diagnostic::error(code::NEVER_REACHED, "this arm is never reached");
            self.report(error.at(arm.span, "earlier arms take everything it names").help("remove it"));
        }
    }

    pub(super) fn numeric(&mut self, expr: &ast::Expr, place: &Place<'_>) -> Option<Expr> {
        let found = self.expr(expr, place, None)?;
        if is_number(found.ty) {
            return Some(found);
        }
        let name = self.references.type_name(found.ty);
        let error =
            Diagnostic::error(code::TYPE_MISMATCH, format!("type mismatch: wanted a number, found `{name}`"));
        self.reject(error.at(found.span, format!("this is {}", article(&name))))
    }
}

/// Where facts of the world are known, in words that a thing follows.
pub(super) const SEEN_BY: &str =
    "only rules, the `where` of a drawn parameter, `each step`, phases, requirements and `once` see";

/// A thing that is asked where no fact about it is known.
pub(super) fn unknown_here(thing: &str, span: Span, site: Site) -> Diagnostic {
    let asked = parts_of(thing).first().map_or("", |(part, _)| part);
    let error = Diagnostic::error(code::NOT_HERE, format!("`{thing}` is not known here"));
    match site {
        Site::Where if thing == "npc" => error
            .at(span, "its place is known only once all values are drawn")
            .help("write a rule on the action"),
        Site::Trigger if thing == "npc" => {
            error.at(span, "which road user?").help("name it by its number, as it appeared: `npc#1.gap`")
        }
        Site::Requirement if thing == "npc" => error.at(span, "which road user?").help(
            "say whom it is asked of, `require … on Bicycle: npc.gap >= 1 m`, or name one where it is spawned: `truck.gap`",
        ),
        Site::StepBegins if thing == "npc" => error
            .at(span, "which road user?")
            .help("give it a name where it is spawned, and ask for that: `truck.gap`"),
        Site::Axis => error
            .at(span, "the rows of the table are the same at every moment")
            .help("write a rule on the action, or draw the parameter with `any`"),
        _ => error
            .at(span, format!("{SEEN_BY} the {}", if thing == "npc" { "newcomer" } else { thing }))
            .help(format!(
                "in an action, draw a value and bind it: `any x: … where x == {thing}.{asked}`; a function gets it as an argument"
            )),
    }
}

/// A word that is no unit.
pub(crate) fn unknown_unit(word: &ast::Name) -> Diagnostic {
    let words = || units::UNITS.iter().map(|unit| unit.word);
    let letters = |word: &str| word.chars().filter(|c| c.is_alphanumeric()).collect::<String>();
    // `kmh` means `km/h` rather than `km`.
    let meant = match word.text.to_ascii_lowercase().as_str() {
        "kph" | "kmph" | "kmh" => Some("km/h"),
        _ => words().find(|unit| letters(unit) == letters(&word.text) && !letters(unit).is_empty()),
    };
    let error = Diagnostic::error(code::UNKNOWN_UNIT, format!("unknown unit `{}`", word.text))
        .at(word.span, "not a unit");
    // Any unit of one letter is near another of one letter, whatever it measures.
    let near = || nearest(&word.text, words()).filter(|_| word.text.chars().count() > 1);
    match meant.or_else(near) {
        Some(near) => error.meant(word.span, near),
        None => error.help(format!("the units are {}", words().collect::<Vec<_>>().join(", "))),
    }
}

/// The text to write in place of a number that lacks a unit or has a wrong one; `None` for other expressions, and where no
/// unit is wanted.
pub(super) fn unit_help(expr: &ast::Expr, wanted: Type) -> Option<String> {
    match &expr.kind {
        ast::ExprKind::Number(number) => number_help("", number, dimension(wanted)),
        ast::ExprKind::Unary { op: UnaryOp::Negate, operand } => match &operand.kind {
            ast::ExprKind::Number(number) => number_help("-", number, dimension(wanted)),
            _ => None,
        },
        _ => None,
    }
}

/// As [`unit_help`], of a literal with its sign.
pub(super) fn number_help(sign: &str, number: &ast::Number, wanted: Dimension) -> Option<String> {
    if wanted == Dimension::RATIO {
        return None;
    }
    let of_wanted = units::UNITS.iter().filter(|unit| unit.dimension == wanted);
    let words: Vec<&str> = of_wanted.map(|unit| unit.word).collect();
    let usual = words.first()?;
    Some(match number.unit {
        None => format!("write a unit: `{sign}{} {usual}`", number.digits),
        Some(_) => format!("{} is in {}", article(&wanted.to_string()), one_of(&words)),
    })
}

/// The message for a number beyond the limits of states.
pub(super) const NUMBER_MAX: &str = "the largest is 2^53 - 1, either side of 0";

/// Whether no state may have a number. Compared exactly, because 2^53 + 1 would be rounded.
pub(super) fn is_beyond_states(number: Rational) -> bool {
    let is_within =
        |number: Option<Rational>| number.is_some_and(|number| Rational::from_f64(STATE_MAX) >= Some(number));
    !(is_within(Some(number)) && is_within(number.checked_neg()))
}

/// The index of a type's enum.
pub(super) fn enum_of(ty: Option<Type>) -> Option<usize> {
    match ty {
        Some(Type::Enum(of)) => Some(of.0),
        _ => None,
    }
}

pub(super) fn is_number(ty: Type) -> bool {
    matches!(ty, Type::Int | Type::Quantity(_))
}

pub(super) fn dimension(ty: Type) -> Dimension {
    match ty {
        Type::Quantity(dimension) => dimension,
        Type::Int | Type::Bool | Type::Enum(_) => Dimension::RATIO,
    }
}

/// A whole number may stand for a ratio; otherwise types must be equal.
pub(super) fn fits(found: Type, wanted: Type) -> bool {
    found == wanted || found == Type::Int && wanted == Type::Quantity(Dimension::RATIO)
}

pub(super) fn article(name: &str) -> String {
    let vowel = name.starts_with(['A', 'E', 'I', 'O', 'U']);
    format!("{} `{name}`", if vowel { "an" } else { "a" })
}
