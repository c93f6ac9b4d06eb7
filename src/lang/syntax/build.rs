//! Builds declarations from pest's pairs. Expressions are built in `expression`.
//!
//! The grammar guarantees the shape of every pair, so a missing part is a bug of ours and not a
//! mistake of the author: each `expect` says which rule promises the part.

use std::cell::Cell;

use pest::iterators::Pair;

use crate::syntax::ast::{
    Action, ActionParam, Also, Block, Case, Clause, ClauseKind, Effect, EffectKind, Enum, Expect, Expr,
    Field, FileId, Fn, FnParam, Group, Initial, InitialKey, ItemKind, Let, Manoeuvre, Move, Name, Number,
    Odds, ParamMode, Phase, Place, Policy, PolicyLine, Require, Rule as NamedRule, RuleBody, Scenario, Span,
    Spawn, State, Step, Text, Type, TypeKind, Use, Verdict,
};
use crate::syntax::grammar::{Rule, is_plain_terminal};
use crate::syntax::{Diagnostic, code};

/// A node, or the mistake that keeps its whole declaration out of the tree.
pub type Built<T> = Result<T, Diagnostic>;

/// Builds the tree of one declaration.
pub struct Builder {
    pub file: FileId,
    /// Number of operators around the expression that is being built. Together with the depth of
    /// brackets it bounds the height of the tree.
    pub operators_above: Cell<usize>,
}

/// The parts of a pair in order, without the marks and keywords that the tree does not keep.
pub struct Parts<'i>(std::iter::Peekable<std::vec::IntoIter<Pair<'i, Rule>>>);

impl<'i> Parts<'i> {
    pub fn of(pair: Pair<'i, Rule>) -> Self {
        let parts: Vec<_> = pair.into_inner().filter(|part| !is_plain_terminal(part.as_rule())).collect();
        Parts(parts.into_iter().peekable())
    }

    /// The next part, if it is of this rule.
    pub fn take(&mut self, rule: Rule) -> Option<Pair<'i, Rule>> {
        self.0.next_if(|part| part.as_rule() == rule)
    }

    pub fn next(&mut self) -> Pair<'i, Rule> {
        self.0.next().expect("the grammar promises this part")
    }

    /// All parts that are left.
    pub fn rest(self) -> impl Iterator<Item = Pair<'i, Rule>> {
        self.0
    }
}

impl Builder {
    pub fn new(file: FileId) -> Self {
        Builder { file, operators_above: Cell::new(0) }
    }

    pub fn span(&self, pair: &Pair<'_, Rule>) -> Span {
        Span::new(self.file, pair.as_span().start(), end_of(pair))
    }

    pub fn name(&self, pair: Pair<'_, Rule>) -> Name {
        let span = self.span(&pair);
        Name::new(pair.as_str(), span)
    }

    pub fn number(&self, pair: Pair<'_, Rule>) -> Number {
        let span = self.span(&pair);
        if pair.as_rule() == Rule::integer {
            return Number { digits: pair.as_str().to_owned(), unit: None, span };
        }
        let mut parts = Parts::of(pair);
        let digits = parts.next().as_str().to_owned();
        let unit = parts.take(Rule::unit).map(|unit| self.name(unit));
        Number { digits, unit, span }
    }

    /// The value of a text literal.
    pub fn text(&self, pair: Pair<'_, Rule>) -> Built<Text> {
        let span = self.span(&pair);
        let quoted = pair.as_str();
        let inside = &quoted[1..quoted.len() - 1];
        let value = unescape(inside).map_err(|at| {
            let start = span.start + 1 + at;
            let width = inside[at..].chars().take(2).map(char::len_utf8).sum::<usize>();
            Diagnostic::error(code::TEXT, "unknown escape in a text")
                .at(Span::new(self.file, start, start + width), "")
                .help(
                    "escapes are `\\\"`, `\\\\`, `\\n`, `\\t` and `\\u{…}` with a code point in hexadecimal",
                )
        })?;
        Ok(Text::new(value, span))
    }

    /// The declaration of an `item`.
    pub fn item(&self, pair: Pair<'_, Rule>) -> Built<ItemKind> {
        let declaration = pair.into_inner().next().expect("an item is one declaration");
        self.declaration(declaration)
    }

    fn declaration(&self, declaration: Pair<'_, Rule>) -> Built<ItemKind> {
        let rule = declaration.as_rule();
        let span = self.span(&declaration);
        let mut parts = Parts::of(declaration);
        Ok(match rule {
            Rule::overriding => ItemKind::Override(Box::new(self.declaration(parts.next())?)),
            Rule::language => ItemKind::Language(self.number(parts.next())),
            Rule::use_file => {
                let path = self.text(parts.next())?;
                let digest = parts.take(Rule::text).map(|digest| self.text(digest)).transpose()?;
                let without = parts.take(Rule::names).map_or_else(Vec::new, |names| self.names(names));
                ItemKind::Use(Use { path, digest, without })
            }
            Rule::enumeration => ItemKind::Enum(self.enumeration(parts)),
            Rule::odds => {
                let name = self.name(parts.next());
                ItemKind::Odds(Odds { name, arms: self.all(parts, Builder::arm)? })
            }
            Rule::state => {
                let name = self.name(parts.next());
                let ty = self.type_name(parts.next());
                let initial = match parts.next() {
                    any if any.as_rule() == Rule::drawn_initially => Initial::Any,
                    keys if keys.as_rule() == Rule::initial_keys => {
                        Initial::Keys(self.all(Parts::of(keys), Builder::initial_key)?)
                    }
                    value => Initial::Value(self.expression(value)?),
                };
                ItemKind::State(State { name, ty, initial })
            }
            Rule::constant => {
                let name = self.name(parts.next());
                ItemKind::Let(Let { name, value: self.expression(parts.next())? })
            }
            Rule::function => ItemKind::Fn(self.function(parts)?),
            Rule::manoeuvre => ItemKind::Manoeuvre(self.manoeuvre(parts)?),
            Rule::action => ItemKind::Action(self.action(parts)?),
            Rule::group => {
                let name = self.name(parts.next());
                ItemKind::Group(Group { name, members: self.names(parts.next()) })
            }
            Rule::also => {
                let on = self.names(parts.next());
                ItemKind::Also(Also { on, effects: self.all(parts, Builder::effect)? })
            }
            Rule::each_step => {
                parts.take(Rule::kw_each);
                ItemKind::EachStep(self.all(parts, Builder::effect)?)
            }
            Rule::named_rule => ItemKind::Rule(self.rule(parts, span)?),
            Rule::requirement => {
                let optional = parts.take(Rule::kw_optional).is_some();
                let name = self.name(parts.next());
                let on = self.targets(&mut parts);
                let part = |parts: &mut Parts<'_>, rule: Rule| {
                    parts.take(rule).map(|part| self.only_expression(part)).transpose()
                };
                let when = part(&mut parts, Rule::while_holds)?;
                let until = part(&mut parts, Rule::until_holds)?;
                let after = part(&mut parts, Rule::after_event)?;
                let condition = part(&mut parts, Rule::holds)?.expect("the grammar asks for one");
                let unless = part(&mut parts, Rule::unless_holds)?;
                let within = part(&mut parts, Rule::within_time)?;
                let required = Require { optional, name, on, when, until, after, condition, unless, within };
                ItemKind::Require(Box::new(required))
            }
            Rule::body => {
                let name = self.name(parts.next());
                ItemKind::Body(Block { name, fields: self.fields(parts.next())? })
            }
            Rule::trajectory => {
                let name = self.name(parts.next());
                ItemKind::Trajectory(Block { name, fields: self.fields(parts.next())? })
            }
            Rule::road => {
                let name = self.name(parts.next());
                ItemKind::Road(Block { name, fields: self.fields(parts.next())? })
            }
            Rule::episode => ItemKind::Episode(self.fields(parts.next())?),
            Rule::reward => ItemKind::Reward(self.all(parts, Builder::reward_case)?),
            Rule::verdict => {
                let name = self.name(parts.next());
                ItemKind::Verdict(Verdict { name, condition: self.expression(parts.next())? })
            }
            Rule::expect => ItemKind::Expect(self.expect(parts, span)?),
            Rule::scenario => ItemKind::Scenario(self.scenario(parts)?),
            Rule::policy => ItemKind::Policy(self.policy(parts)?),
            other => unreachable!("an item is never `{other:?}`"),
        })
    }

    fn names(&self, pair: Pair<'_, Rule>) -> Vec<Name> {
        Parts::of(pair).rest().map(|name| self.name(name)).collect()
    }

    fn initial_key(&self, pair: Pair<'_, Rule>) -> Built<InitialKey> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let first = parts.next();
        let key = (first.as_rule() == Rule::name).then(|| self.name(first));
        let value = match parts.next() {
            any if any.as_rule() == Rule::drawn_initially => None,
            value => Some(self.expression(value)?),
        };
        Ok(InitialKey { key, value, span })
    }

    fn type_name(&self, pair: Pair<'_, Rule>) -> Type {
        let span = self.span(&pair);
        let mut names = Parts::of(pair);
        let first = self.name(names.next());
        let kind = match names.take(Rule::name) {
            None => TypeKind::Named(first),
            Some(value) => TypeKind::Map { key: first, value: self.name(value) },
        };
        Type { kind, span }
    }

    fn enumeration(&self, mut parts: Parts<'_>) -> Enum {
        let name = self.name(parts.next());
        let mut variants = vec![self.name(parts.next())];
        let mut ordered = false;
        for more in parts.rest() {
            ordered = more.as_rule() == Rule::ordered;
            variants.extend(self.names(more));
        }
        Enum { name, ordered, variants }
    }

    fn function(&self, mut parts: Parts<'_>) -> Built<Fn> {
        let name = self.name(parts.next());
        let params = self.function_params(&mut parts);
        let result = self.type_name(parts.next());
        Ok(Fn { name, params, result, body: self.expression(parts.next())? })
    }

    fn function_params(&self, parts: &mut Parts<'_>) -> Vec<FnParam> {
        let mut params = Vec::new();
        while let Some(param) = parts.take(Rule::function_param) {
            let mut param = Parts::of(param);
            params.push(FnParam { name: self.name(param.next()), ty: self.type_name(param.next()) });
        }
        params
    }

    fn manoeuvre(&self, mut parts: Parts<'_>) -> Built<Manoeuvre> {
        let name = self.name(parts.next());
        let params = self.function_params(&mut parts);
        let repeat = parts.take(Rule::repeat).map(|repeat| self.only_expression(repeat)).transpose()?;
        Ok(Manoeuvre { name, params, repeat, phases: self.all(parts, Builder::phase)? })
    }

    fn phase(&self, pair: Pair<'_, Rule>) -> Built<Phase> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let (once, held) = self.once(&mut parts)?;
        let mut clause = |rule| parts.take(rule).map(|clause| self.only_expression(clause)).transpose();
        let (within, after, only_if) =
            (clause(Rule::within_time)?, clause(Rule::after)?, clause(Rule::only_if)?);
        Ok(Phase { once, held, within, after, only_if, fields: self.fields(parts.next())?, span })
    }

    /// `once npc.speed <= 1 m/s for 2 s`: the condition, and how long it must have held.
    fn once(&self, parts: &mut Parts<'_>) -> Built<(Option<Expr>, Option<Expr>)> {
        let Some(once) = parts.take(Rule::once) else { return Ok((None, None)) };
        let mut parts = Parts::of(once);
        let condition = self.expression(parts.next())?;
        Ok((Some(condition), parts.take(Rule::held).map(|held| self.only_expression(held)).transpose()?))
    }

    fn action(&self, mut parts: Parts<'_>) -> Built<Action> {
        let name = self.name(parts.next());
        let mut params = Vec::new();
        while let Some(param) = parts.take(Rule::action_param) {
            params.push(self.action_param(param)?);
        }
        Ok(Action { name, params, effects: self.all(parts, Builder::effect)? })
    }

    /// All parts that are left, each built in the same way.
    pub fn all<'i, T>(
        &self,
        parts: Parts<'i>,
        build: fn(&Builder, Pair<'i, Rule>) -> Built<T>,
    ) -> Built<Vec<T>> {
        parts.0.map(|part| build(self, part)).collect()
    }

    fn action_param(&self, pair: Pair<'_, Rule>) -> Built<ActionParam> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let mode = match parts.next().as_rule() {
            Rule::kw_each => ParamMode::Each,
            _ => ParamMode::Any,
        };
        let name = self.name(parts.next());
        let ty = self.type_name(parts.next());
        let within = parts.take(Rule::within).map(|within| self.only_expression(within)).transpose()?;
        let condition = parts.take(Rule::condition).map(|when| self.only_expression(when)).transpose()?;
        Ok(ActionParam { mode, name, ty, within, condition, span })
    }

    /// The expression of a pair that holds nothing else.
    fn only_expression(&self, pair: Pair<'_, Rule>) -> Built<Expr> {
        self.expression(Parts::of(pair).next())
    }

    fn effect(&self, pair: Pair<'_, Rule>) -> Built<Effect> {
        let span = self.span(&pair);
        let effect = pair.into_inner().next().expect("an effect is `set`, `spawn` or `order`");
        let rule = effect.as_rule();
        let mut parts = Parts::of(effect);
        let kind = if rule == Rule::order {
            let who = self.name(parts.next());
            EffectKind::Order { who, fields: self.fields(parts.next())? }
        } else if rule == Rule::set {
            let state = self.name(parts.next());
            let key = parts.take(Rule::key).map(|key| self.only_expression(key)).transpose()?;
            EffectKind::Set { state, key: key.map(Box::new), value: Box::new(self.expression(parts.next())?) }
        } else {
            let body = self.expression(parts.next())?;
            let bearers = parts.take(Rule::bearer).map_or_else(Vec::new, |bearer| {
                let mut parts = Parts::of(bearer);
                match parts.take(Rule::names) {
                    Some(names) => self.names(names),
                    None => vec![self.name(parts.next())],
                }
            });
            let place = parts.next();
            let place = match place.as_rule() {
                Rule::kw_ahead => Place::Ahead,
                Rule::on_trajectory => Place::On(Box::new(self.only_expression(place)?)),
                Rule::along_trajectory => {
                    let mut parts = Parts::of(place);
                    let trajectory = Box::new(self.expression(parts.next())?);
                    Place::Along { trajectory, behind: parts.take(Rule::kw_behind).is_some() }
                }
                _ => Place::Behind,
            };
            let distance = self.expression(parts.next())?;
            let of = parts.take(Rule::of_whom).map(|of| self.name(Parts::of(of).next()));
            let apart = parts.take(Rule::apart).map(|apart| self.only_expression(apart)).transpose()?;
            let cover = parts.take(Rule::cover).map(|cover| {
                let mut parts = Parts::of(cover);
                parts.take(Rule::kw_behind);
                self.expression(parts.next())
            });
            let cover = cover.transpose()?;
            let fields = self.fields(parts.next())?;
            EffectKind::Spawn(Box::new(Spawn { body, bearers, place, distance, of, apart, cover, fields }))
        };
        Ok(Effect { kind, span })
    }

    /// `on vehicles, pedestrian`; nothing without it.
    fn targets(&self, parts: &mut Parts<'_>) -> Vec<Name> {
        parts.take(Rule::targets).map_or_else(Vec::new, |targets| {
            Parts::of(targets).rest().flat_map(|names| self.names(names)).collect()
        })
    }

    fn rule(&self, mut parts: Parts<'_>, span: Span) -> Built<NamedRule> {
        let optional = parts.take(Rule::kw_optional).is_some();
        let name = self.name(parts.next());
        let on = self.targets(&mut parts);
        let key = parts.take(Rule::moved_key).map(|key| self.name(Parts::of(key).next()));
        let during = parts.take(Rule::during).map(|during| self.name(Parts::of(during).next()));
        let body = parts.next();
        if body.as_rule() == Rule::holds {
            if let Some(key) = key {
                let error =
                    Diagnostic::error(code::MOVES, "only transitions are about a key").at(key.span, "");
                return Err(error.help("put the key into the condition: `sky[Rain] > None`"));
            }
            let condition = self.only_expression(body)?;
            return Ok(NamedRule { optional, name, body: RuleBody::Holds { on, during, condition } });
        }
        if let Some(during) = during {
            let error = Diagnostic::error(code::MOVES, "transitions are not about what road users do");
            return Err(error.at(during.span, "").help("write a condition: `during change: …`"));
        }
        let [state] = <[Name; 1]>::try_from(on).map_err(|on| {
            let place = on.get(1).map_or(Span { end: name.span.end, ..span }, |second| second.span);
            Diagnostic::error(code::MOVES, "transitions are about exactly one state")
                .at(place, "")
                .help(format!("write `rule {} on time {{ Noon -> Night }}`", name.text))
        })?;
        let moves = Parts::of(body).rest().map(|transition| {
            let span = self.span(&transition);
            let mut names = self.names(transition).into_iter();
            let from = names.next().expect("a transition begins with a name");
            Move { from, to: names.collect(), span }
        });
        let moves = moves.collect();
        Ok(NamedRule { optional, name, body: RuleBody::Moves { state, key, moves } })
    }

    fn reward_case(&self, pair: Pair<'_, Rule>) -> Built<Case> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let condition = match parts.take(Rule::otherwise) {
            Some(_) => None,
            None => Some(self.expression(parts.next())?),
        };
        Ok(Case { condition, value: self.expression(parts.next())?, span })
    }

    fn expect(&self, mut parts: Parts<'_>, span: Span) -> Built<Expect> {
        let claim = self.expression(parts.next())?;
        Ok(Expect { claim, clauses: self.all(parts, Builder::clause)?, span })
    }

    fn clause(&self, pair: Pair<'_, Rule>) -> Built<Clause> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let kind = match parts.next().as_rule() {
            Rule::kw_with => ClauseKind::With,
            Rule::kw_at => ClauseKind::At,
            _ => ClauseKind::By,
        };
        Ok(Clause { kind, value: self.expression(parts.next())?, span })
    }

    pub fn fields(&self, pair: Pair<'_, Rule>) -> Built<Vec<Field>> {
        self.all(Parts::of(pair), Builder::field)
    }

    fn field(&self, pair: Pair<'_, Rule>) -> Built<Field> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let name = self.name(parts.next());
        Ok(Field { name, value: self.expression(parts.next())?, span })
    }

    /// The fields of a block that may be absent, like `origin { … }`.
    fn section(&self, parts: &mut Parts<'_>, rule: Rule) -> Built<Vec<Field>> {
        parts.take(rule).map_or(Ok(Vec::new()), |section| self.fields(Parts::of(section).next()))
    }

    fn scenario(&self, mut parts: Parts<'_>) -> Built<Scenario> {
        let name = self.name(parts.next());
        let origin = self.section(&mut parts, Rule::origin)?;
        let road = self.name(Parts::of(parts.next()).next());
        let start = self.section(&mut parts, Rule::start)?;
        let steps = self.all(Parts::of(parts.next()), Builder::step)?;
        let expects = parts.rest().map(|expect| {
            let span = self.span(&expect);
            self.expect(Parts::of(expect), span)
        });
        let expects = expects.collect::<Built<_>>()?;
        Ok(Scenario { name, origin, road, start, steps, expects })
    }

    fn step(&self, pair: Pair<'_, Rule>) -> Built<Step> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let number = self.number(parts.next());
        let action = self.call(parts.next())?;
        let drawn = parts.take(Rule::drawn).map_or(Ok(Vec::new()), |drawn| {
            // Clauses need `with` as a part of the pair, so it stands before the fields here too.
            let fields = drawn.into_inner().find(|part| part.as_rule() == Rule::fields);
            self.fields(fields.expect("`with` has fields"))
        })?;
        let (once, held) = self.once(&mut parts)?;
        let after = parts.take(Rule::after).map(|after| self.only_expression(after)).transpose()?;
        Ok(Step { number, action, drawn, once, held, after, span })
    }

    fn policy(&self, mut parts: Parts<'_>) -> Built<Policy> {
        let name = self.name(parts.next());
        let origin = self.section(&mut parts, Rule::origin)?;
        let net = self.section(&mut parts, Rule::net)?;
        let claims = self.section(&mut parts, Rule::claims)?;
        let rules = parts.take(Rule::policy_rules);
        let rules = rules.map_or(Ok(Vec::new()), |rules| self.all(Parts::of(rules), Builder::policy_line))?;
        Ok(Policy { name, origin, net, claims, rules })
    }

    fn policy_line(&self, pair: Pair<'_, Rule>) -> Built<PolicyLine> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let condition = match parts.take(Rule::otherwise) {
            Some(_) => None,
            None => Some(self.expression(parts.next())?),
        };
        Ok(PolicyLine { condition, actions: self.all(parts, Builder::call)?, span })
    }
}

/// The byte after the last token of a pair.
///
/// If the optional end of a rule is absent, pest's own end includes the blanks and comments that were
/// skipped in search of it, and may lie far behind. Every rule that is not a token ends in a token.
pub fn end_of(pair: &Pair<'_, Rule>) -> usize {
    let mut last = pair.clone();
    while let Some(inner) = last.clone().into_inner().next_back() {
        last = inner;
    }
    last.as_span().end()
}

/// Resolves escapes; the error is the byte at which an unknown escape begins.
fn unescape(inside: &str) -> Result<String, usize> {
    let mut value = String::with_capacity(inside.len());
    let mut characters = inside.char_indices();
    while let Some((at, character)) = characters.next() {
        if character != '\\' {
            value.push(character);
            continue;
        }
        match characters.next().map(|(_, escape)| escape) {
            Some('"') => value.push('"'),
            Some('\\') => value.push('\\'),
            Some('n') => value.push('\n'),
            Some('t') => value.push('\t'),
            Some('u') => {
                let digits = characters.as_str().strip_prefix('{').and_then(|rest| rest.split_once('}'));
                let (digits, _) = digits.ok_or(at)?;
                let number = u32::from_str_radix(digits, 16).map_err(|_| at)?;
                value.push(char::from_u32(number).ok_or(at)?);
                characters.nth(digits.len() + 1);
            }
            _ => return Err(at),
        }
    }
    Ok(value)
}
