//! Checks the declarations of enums, constants, functions and states.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::check::checker::{Checker, Signature, each};
use crate::check::expression::{NUMBER_MAX, Place, article, is_beyond_states};
use crate::check::mistakes::{Report, all_of};
use crate::check::names::docs;
use crate::check::references::Symbol;
use crate::check::rule::names_in;
use crate::model::expr::{Expr, ExprKind};
use crate::model::vocabulary::{Level, Phenomenon, ROAD_USER, Site, SpaceClaim, TimeOfDay, Word, WorldState};
use crate::model::{ACTION_ODDS_MAX, EnumDef, EnumIndex, FnDef, Initial, StateDef, StateMeaning, Type, code};
use crate::prove::{VARIANTS_MAX, odds_out_of_bounds};
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast, listed, nearest};
use avastra_base::units::{Dimension, Rational};

/// Most values that states hold together: proofs copy them.
const CELLS_MAX: usize = 10_000;

/// Limit on a function's operations with every call inlined; nested calls multiply.
const OPERATIONS_MAX: u64 = 10_000;

/// Limit on the depth of nested calls.
const CALLS_MAX: u32 = 64;

/// Limit on how deep operators and calls stand in one another, with every call inlined: evaluation recurses so deep.
pub(super) const HEIGHT_MAX: u32 = 4_096;

/// Size of a function with every call inlined.
#[derive(Debug, Clone, Copy)]
struct Cost {
    operations: u64,
    /// Depth of nested calls.
    depth: u32,
    /// Depth of operators and calls.
    height: u32,
}

/// Largest value that `odds` may give to a variant.
const ODDS_MAX: u32 = 100;

/// The odds of what `odds` does not name.
fn even_odds() -> Expr {
    Expr { kind: ExprKind::Number(Rational::ONE), ty: Type::Int, span: Span::NONE }
}

impl Checker {
    pub(super) fn declare_enums(&mut self, items: &[&ast::Item]) {
        let (names, enums) = self.declared("enum", items, ItemKind::as_enum);
        self.enum_names = names;
        for (item, declared) in enums {
            self.once("variant", &declared.variants);
            if declared.name.text == ROAD_USER.0 {
                let message = format!("`{}` cannot be the name of an enum", ROAD_USER.0);
                let error = Diagnostic::error(code::NOT_HERE, message)
                    .at(declared.name.span, "a type of the language");
                self.report(error.help("choose another name"));
            }
            if declared.variants.len() > VARIANTS_MAX {
                let message = format!("`{}` has {} variants", declared.name.text, declared.variants.len());
                let error = Diagnostic::error(code::TOO_MANY_VARIANTS, message);
                let error = error.at(declared.name.span, format!("at most {VARIANTS_MAX} are possible"));
                self.report(error.help("make two enums of it, or take an `Int` with a range"));
            }
            let variants = declared.variants.iter().take(VARIANTS_MAX);
            self.enums.push(EnumDef {
                name: declared.name.text.clone(),
                docs: docs(item),
                variants: variants.map(|variant| variant.text.clone()).collect(),
                ordered: declared.ordered,
                odds: vec![1; declared.variants.len().min(VARIANTS_MAX)],
                span: declared.name.span,
            });
        }
    }

    /// The odds of variants: whole numbers, folded like constants.
    pub(super) fn declare_odds(&mut self, items: &[&ast::Item]) {
        for (_, declared) in self.declared("odds of", items, ItemKind::as_odds).1 {
            if self.is_of_actions(declared) {
                continue;
            }
            if let Some((of, odds)) = self.odds(declared) {
                self.enums[of].odds = odds;
            }
        }
    }

    /// The odds of rows, which are those of their actions.
    pub(super) fn declare_action_odds(&mut self, items: &[&ast::Item]) {
        // A second declaration was reported before.
        let of_actions = each(items, ItemKind::as_odds).find(|(_, declared)| self.is_of_actions(declared));
        let Some((_, declared)) = of_actions else { return };
        for (action, odds) in self.action_odds(declared).into_iter().enumerate() {
            let known = self.actions[action].as_mut().map(Arc::make_mut);
            known.into_iter().for_each(|known| known.odds = Some(odds.clone()));
        }
    }

    /// Whether odds are those of actions and not those of an enum with that name.
    pub(super) fn is_of_actions(&self, declared: &ast::Odds) -> bool {
        declared.name.text == SpaceClaim::Actions.name() && self.enum_names.get(&declared.name.text).is_none()
    }

    /// The odds of each action.
    pub(super) fn action_odds(&mut self, declared: &ast::Odds) -> Vec<Expr> {
        self.references.word(declared.name.span, SpaceClaim::Actions);
        let place = Place { states: true, site: Site::StepBegins, ..Place::default() };
        let value = |checker: &mut Checker, value: &ast::Expr| {
            let odds = checker.expr(value, &place, None)?;
            if odds.ty == Type::Quantity(Dimension::RATE) {
                return Some(odds);
            }
            let odds = checker.fit(odds, Type::Int, || {
                Some("write a whole number, or a rate: `nothing => 30`, `walker => 10 / 1 h`".to_owned())
            })?;
            let is_out = |number: &Rational| {
                *number < Rational::ZERO || *number > Rational::integer(i64::from(ACTION_ODDS_MAX))
            };
            // A computed number is proved later, once everything is known.
            if matches!(&odds.kind, ExprKind::Number(number) if is_out(number)) {
                return checker.reject(odds_out_of_bounds(odds.span));
            }
            Some(odds)
        };
        let odds = self.shares(declared, self.actions.len(), value, Checker::all_targets);
        let odds: Vec<Expr> = odds.into_iter().map(|odds| odds.unwrap_or_else(even_odds)).collect();
        let is_zero =
            |odds: &Expr| matches!(&odds.kind, ExprKind::Number(number) if *number == Rational::ZERO);
        if !odds.is_empty() && odds.iter().all(is_zero) {
            let error = Diagnostic::error(code::EMPTY, "no action is ever drawn")
                .at(declared.name.span, "all its odds are 0");
            self.report(error.help("give at least one action odds above 0"));
        }
        odds
    }

    /// The odds of so many things: `value` reads them, `named` gives the things that a line names. A line counts for those
    /// of them that have no odds yet. A thing that no line names has none.
    fn shares<T: Clone>(
        &mut self,
        declared: &ast::Odds,
        count: usize,
        value: impl Fn(&mut Checker, &ast::Expr) -> Option<T>,
        named: impl Fn(&mut Checker, &[ast::Name]) -> Vec<usize>,
    ) -> Vec<Option<T>> {
        let mut odds: Vec<Option<Option<T>>> = vec![None; count];
        for arm in &declared.arms {
            let value = value(self, &arm.value);
            let is_rest = arm.patterns.is_empty();
            let taken = if is_rest { (0..count).collect() } else { named(self, &arm.patterns) };
            // An unknown name was reported.
            let sound = is_rest || !taken.is_empty();
            if sound && !taken.iter().any(|index| odds[*index].is_none()) {
                let error = Diagnostic::error(code::NEVER_REACHED, "these odds never count");
                self.report(error.at(arm.span, "the lines before it say it all").help("remove the line"));
            }
            for index in taken {
                odds[index].get_or_insert_with(|| value.clone());
            }
        }
        odds.into_iter().map(Option::flatten).collect()
    }

    /// The enum, and the odds of each of its variants.
    pub(super) fn odds(&mut self, declared: &ast::Odds) -> Option<(usize, Vec<u32>)> {
        self.references.uses(declared.name.span, Symbol::Enum(declared.name.text.clone()));
        let Some(of) = self.enum_names.get(&declared.name.text) else {
            for arm in &declared.arms {
                arm.patterns.iter().for_each(|pattern| self.references.variant(pattern, None));
                self.look_at(&arm.value, &Place::default(), None);
            }
            let error = self.unknown("enum", &declared.name.text, declared.name.span, self.enum_names.all());
            return self.reject(error);
        };
        let count = self.enums[of].variants.len();
        let odds = self.shares(declared, count, Checker::odds_of, |checker, names| {
            names.iter().filter_map(|name| checker.variant(name, of)).collect()
        });
        // A variant without a line of its own is as likely as before.
        let odds: Vec<u32> = odds.into_iter().map(|odds| odds.unwrap_or(1)).collect();
        if odds.iter().all(|odds| *odds == 0) {
            let message = format!("no `{}` is ever drawn", declared.name.text);
            let error = Diagnostic::error(code::EMPTY, message).at(declared.name.span, "all its odds are 0");
            return self.reject(error.help("give at least one variant odds above 0"));
        }
        Some((of, odds))
    }

    fn odds_of(&mut self, value: &ast::Expr) -> Option<u32> {
        let expr = self.expr(value, &Place::default(), Some(Type::Int))?;
        let found = match (expr.ty, self.fold(&expr)?) {
            (Type::Int, ExprKind::Number(number)) => {
                number.to_i64().and_then(|odds| u32::try_from(odds).ok())
            }
            _ => None,
        };
        found.filter(|odds| *odds <= ODDS_MAX).or_else(|| {
            let error = Diagnostic::error(code::SETTING, "odds are whole numbers")
                .at(value.span, format!("wanted a whole number from 0 to {ODDS_MAX}"));
            self.reject(error.help("`BoxTruck => 2` makes trucks twice as likely as what has 1"))
        })
    }

    pub(super) fn declare_constants(&mut self, items: &[&ast::Item]) {
        let (names, open) = self.declared("constant", items, ItemKind::as_let);
        // Constants may be declared in any order, so each waits for the constants that it names. If all that
        // are left wait for one another, the first is checked, and it reports an unknown name.
        let named = |(_, declared): &(_, &ast::Let)| -> BTreeSet<usize> {
            names_in(&declared.value).iter().filter_map(|name| names.get(&name.text)).collect()
        };
        let mut waits_for: Vec<BTreeSet<usize>> = open.iter().map(named).collect();
        let mut waited_for_by: Vec<Vec<usize>> = vec![Vec::new(); open.len()];
        for (at, others) in waits_for.iter().enumerate() {
            others.iter().for_each(|other| waited_for_by[*other].push(at));
        }
        let mut waiting: BTreeSet<usize> = (0..open.len()).collect();
        let mut ready: BTreeSet<usize> = (0..open.len()).filter(|at| waits_for[*at].is_empty()).collect();
        while let Some(next) = ready.pop_first().or_else(|| waiting.first().copied()) {
            waiting.remove(&next);
            let (_, declared) = open[next];
            let value = self.constant(declared);
            self.constant_places.insert(declared.name.text.clone(), self.constants.len());
            self.constants.push((declared.name.text.clone(), value));
            for at in &waited_for_by[next] {
                waits_for[*at].remove(&next);
                if waits_for[*at].is_empty() && waiting.contains(at) {
                    ready.insert(*at);
                }
            }
        }
    }

    pub(super) fn constant(&mut self, declared: &ast::Let) -> Option<Expr> {
        let value = self.expr(&declared.value, &Place::default(), None)?;
        self.references.typed(&Symbol::Constant(declared.name.text.clone()), value.ty, None);
        Some(Expr { kind: self.fold(&value)?, ..value })
    }

    pub(super) fn declare_functions(&mut self, items: &[&ast::Item]) {
        let (names, declared) = self.declared("function", items, ItemKind::as_fn);
        self.function_names = names;
        self.signatures = declared.iter().map(|(_, function)| self.signature(function)).collect();
        for (index, (_, function)) in declared.iter().enumerate() {
            let signature = self.signatures[index].clone();
            let found = self.function(function, signature);
            self.functions.extend(found);
        }
        // A function without a body is missing, so indices would be wrong; its mistake is already reported.
        if self.functions.len() == declared.len() {
            self.reject_recursion();
        } else {
            self.functions.clear();
        }
    }

    pub(super) fn function(&mut self, function: &ast::Fn, signature: Option<Signature>) -> Option<FnDef> {
        let owner = Symbol::Function(function.name.text.clone());
        let Some((parameters, result, span)) = signature else {
            let locals = self.references.locals(&owner);
            let place = Place { locals: &locals, owner: Some(&owner), ..Place::default() };
            self.look_at(&function.body, &place, None);
            return None;
        };
        let place = Place { locals: &parameters, owner: Some(&owner), ..Place::default() };
        let body = self.typed(&function.body, &place, result)?;
        Some(FnDef { name: function.name.text.clone(), parameters, result, body, span })
    }

    pub(super) fn signature(&mut self, function: &ast::Fn) -> Option<Signature> {
        if !self.has_few_parameters(&function.name, function.params.len()) {
            return None;
        }
        let symbol = Symbol::Function(function.name.text.clone());
        self.once("parameter", function.params.iter().map(|parameter| &parameter.name));
        // All types are looked at before one that is broken ends it.
        let types: Vec<Option<Type>> = function.params.iter().map(|p| self.plain_type(&p.ty)).collect();
        let result = self.plain_type(&function.result);
        let known = function.params.iter().zip(&types);
        let known = known.map(|(p, ty)| (symbol.parameter(&p.name.text), *ty));
        for (symbol, ty) in known.chain([(Some(symbol.clone()), result)]) {
            if let (Some(symbol), Some(ty)) = (symbol, ty) {
                self.references.typed(&symbol, ty, None);
            }
        }
        let parameters = function.params.iter().zip(types);
        let parameters: Option<_> = parameters.map(|(p, ty)| Some((p.name.text.clone(), ty?))).collect();
        Some((parameters?, result?, function.name.span))
    }

    /// Reports functions that call themselves, and functions that are too large with their calls inlined.
    fn reject_recursion(&mut self) {
        let calls: Vec<Vec<usize>> = self.functions.iter().map(|function| calls_of(&function.body)).collect();
        // `Some(None)` while a function is measured: to meet it again is recursion.
        let mut costs: Vec<Option<Option<Cost>>> = vec![None; calls.len()];
        for start in 0..calls.len() {
            let mut path = Vec::new();
            if let Err(cycle) = self.cost(start, &calls, &mut costs, &mut path) {
                let names: Vec<&str> = cycle.iter().map(|f| self.functions[*f].name.as_str()).collect();
                let message = match names.as_slice() {
                    [only] => format!("`{only}` calls itself"),
                    names => format!("{} call each other in a circle", listed(names)),
                };
                let span = self.functions[cycle[0]].span;
                let error = Diagnostic::error(code::RECURSION, message).at(span, "recursive");
                self.report(error.help("functions cannot recurse, so that every one of them ends"));
                self.functions.clear();
                return;
            }
            let too_large = |cost: Cost| {
                cost.operations > OPERATIONS_MAX || cost.depth > CALLS_MAX || cost.height > HEIGHT_MAX
            };
            if costs[start].flatten().is_some_and(too_large) {
                let function = &self.functions[start];
                let message = format!("`{}` calls too much", function.name);
                let limits = format!("{OPERATIONS_MAX} operations and {CALLS_MAX} calls within calls");
                let error = Diagnostic::error(code::TOO_LARGE, message)
                    .at(function.span, "with all that it calls")
                    .note(format!("at most {limits} are possible"));
                self.report(error.help("compute what is needed twice once, and pass it on as a parameter"));
                self.functions.clear();
                return;
            }
        }
    }

    /// The size of a function with every call inlined.
    ///
    /// # Errors
    /// The functions that call each other in a circle.
    fn cost(
        &self,
        function: usize,
        calls: &[Vec<usize>],
        costs: &mut [Option<Option<Cost>>],
        path: &mut Vec<usize>,
    ) -> Result<Cost, Vec<usize>> {
        match costs[function] {
            Some(Some(cost)) => return Ok(cost),
            Some(None) => {
                let begin = path.iter().position(|step| *step == function).unwrap_or(0);
                return Err(path[begin..].to_vec());
            }
            // The limit on the depth is passed already, and the exact depth does not matter.
            None if path.len() > CALLS_MAX as usize => {
                return Ok(Cost { operations: 0, depth: CALLS_MAX + 1, height: 0 });
            }
            None => {}
        }
        costs[function] = Some(None);
        path.push(function);
        let mut cost = Cost { operations: 0, depth: 1, height: 0 };
        self.functions[function].body.walk(&mut |_| cost.operations += 1);
        let mut called = 0;
        for callee in &calls[function] {
            let inner = self.cost(*callee, calls, costs, path)?;
            cost.operations = cost.operations.saturating_add(inner.operations);
            cost.depth = cost.depth.max(inner.depth.saturating_add(1));
            called = called.max(inner.height);
        }
        cost.height = self.functions[function].body.height().saturating_add(called);
        path.pop();
        costs[function] = Some(Some(cost));
        Ok(cost)
    }

    pub(super) fn declare_states(&mut self, items: &[&ast::Item]) {
        let mut cells_so_far = 0;
        for (item, declared) in self.declared("state", items, ItemKind::as_state).1 {
            let Some(state) = self.state(item, declared) else { continue };
            let first_cell = cells_so_far;
            cells_so_far += state.cells;
            if cells_so_far > CELLS_MAX {
                let message = format!("the states have more than {CELLS_MAX} values together");
                let error = Diagnostic::error(code::TOO_MUCH, message).at(state.span, "one too many");
                self.report(error.help("give maps keys with fewer variants, or make fewer states"));
                return;
            }
            self.state_places.insert(state.name.clone(), self.states.len());
            self.states.push(StateDef { first_cell, ..state });
        }
    }

    /// A state, with its first cell still to be set.
    pub(super) fn state(&mut self, item: &ast::Item, declared: &ast::State) -> Option<StateDef> {
        let (key, value) = match &declared.ty.kind {
            ast::TypeKind::Named(name) => (None, self.named_type(name)),
            ast::TypeKind::Map { key, value } => match self.named_type(key) {
                Some(Type::Enum(of)) => (Some(of), self.named_type(value)),
                _ => {
                    self.quietly(|checker| checker.named_type(value));
                    let error = Diagnostic::error(code::TYPE_MISMATCH, "the keys of a map must be an enum");
                    self.report(error.at(key.span, "not an enum"));
                    (None, None)
                }
            },
        };
        let Some(ty) = value else {
            self.look_at_initial(&declared.initial);
            return None;
        };
        let symbol = Symbol::State(declared.name.text.clone());
        self.references.typed(&symbol, ty, key);
        let cells = key.map_or(1, |of| self.enums[of.0].variants.len());
        let initial = match &declared.initial {
            ast::Initial::Keys(keys) => self.initial_keys(declared, keys, key, ty),
            ast::Initial::Any => self.initial(declared, None, ty).map(|initial| vec![initial; cells]),
            ast::Initial::Value(value) => {
                self.initial(declared, Some(value), ty).map(|initial| vec![initial; cells])
            }
        };
        // A state with a broken beginning or meaning stays declared, so that its uses are not reported as unknown.
        let initial = initial.unwrap_or_else(|| vec![Initial::Any; cells]);
        let meaning = self.meaning(&declared.name, key, ty).unwrap_or(StateMeaning::Private);
        Some(StateDef {
            name: declared.name.text.clone(),
            docs: docs(item),
            key,
            ty,
            first_cell: 0,
            cells,
            initial,
            meaning,
            span: declared.name.span,
        })
    }

    /// Position of the state of that name.
    pub(super) fn state_named(&mut self, name: &ast::Name) -> Option<usize> {
        self.references.uses(name.span, Symbol::State(name.text.clone()));
        let found = self.state_places.get(&name.text).copied();
        found.or_else(|| {
            let states = self.states.iter().map(|state| state.name.as_str());
            let mut error = self.unknown("state", &name.text, name.span, states);
            error.code = code::UNKNOWN_STATE;
            let declare = || format!("declare it with `state {}: …`", name.text);
            error.help = error.help.or_else(|| Some(declare()));
            self.reject(error)
        })
    }

    fn look_at_initial(&mut self, initial: &ast::Initial) {
        let values: Vec<&ast::Expr> = match initial {
            ast::Initial::Any => Vec::new(),
            ast::Initial::Value(value) => vec![value],
            ast::Initial::Keys(keys) => keys.iter().filter_map(|key| key.value.as_ref()).collect(),
        };
        values.into_iter().for_each(|value| self.look_at(value, &Place::default(), None));
    }

    /// How each key of a map begins: as its own line says, or as `_` says.
    fn initial_keys(
        &mut self,
        declared: &ast::State,
        keys: &[ast::InitialKey],
        of: Option<EnumIndex>,
        ty: Type,
    ) -> Option<Vec<Initial>> {
        let Some(of) = of else {
            self.look_at_initial(&declared.initial);
            let message = format!("`{}` is not a map", declared.name.text);
            let error = Diagnostic::error(code::TYPE_MISMATCH, message);
            return self.reject(error.at(declared.ty.span, "has no keys").help("give it one value"));
        };
        self.once("key", keys.iter().filter_map(|key| key.key.as_ref()));
        let mut cells: Vec<Option<Initial>> = vec![None; self.enums[of.0].variants.len()];
        let mut sound = true;
        for line in keys {
            let position = line.key.as_ref().map(|key| self.variant(key, of.0));
            let initial = self.initial(declared, line.value.as_ref(), ty);
            sound &= initial.is_some() && position != Some(None);
            let open = cells.iter_mut().enumerate().filter(|(cell, known)| {
                known.is_none() && position.flatten().is_none_or(|position| position == *cell)
            });
            let taken: Vec<&mut Option<Initial>> = open.map(|(_, known)| known).collect();
            if taken.is_empty() && line.key.is_none() {
                let error = Diagnostic::error(code::NEVER_REACHED, "this value is never taken");
                self.report(error.at(line.span, "the keys before it are all there are").help("remove it"));
            }
            if position != Some(None) {
                taken.into_iter().for_each(|known| *known = initial.clone());
            }
        }
        let variants = &self.enums[of.0].variants;
        let missing = cells.iter().zip(variants).filter(|(known, _)| known.is_none());
        let missing: Vec<&str> = missing.map(|(_, key)| key.as_str()).collect();
        if sound && !missing.is_empty() {
            let message = format!("`{}` does not say how every key begins", declared.name.text);
            let error = Diagnostic::error(code::NOT_EXHAUSTIVE, message);
            let error = error.at(declared.name.span, format!("missing: {}", listed(&missing)));
            return self.reject(error.help("add a value for each, or `_: …` for the rest"));
        }
        cells.into_iter().collect::<Option<_>>().filter(|_| sound)
    }

    /// How a cell begins; without a value it is drawn.
    fn initial(&mut self, declared: &ast::State, value: Option<&ast::Expr>, ty: Type) -> Option<Initial> {
        match value {
            Some(value) => {
                let value = self.typed(value, &Place::default(), ty)?;
                let kind = self.fold(&value)?;
                if let ExprKind::Number(number) = kind
                    && is_beyond_states(number)
                {
                    let error = Diagnostic::error(code::NUMBER, "no state holds such a number");
                    return self.reject(error.at(value.span, NUMBER_MAX));
                }
                Some(Initial::Value(Expr { kind, ..value }))
            }
            None if matches!(ty, Type::Bool | Type::Enum(_)) => Some(Initial::Any),
            None => {
                let message = format!("`{}` cannot begin as `any` number", declared.name.text);
                let error = Diagnostic::error(code::INFINITE, message);
                self.reject(error.at(declared.ty.span, "has no end of values").help("give it a value"))
            }
        }
    }

    /// `time` and `sky` set the time of day and the weather; any other state is only the author's record.
    fn meaning(&mut self, name: &ast::Name, key: Option<EnumIndex>, ty: Type) -> Option<StateMeaning> {
        let Some(state) = WorldState::from_name(&name.text) else { return Some(StateMeaning::Private) };
        match (state, key) {
            (WorldState::Time, None) => {
                Some(StateMeaning::Time(self.words::<TimeOfDay>("time of day", ty, name.span)?))
            }
            (WorldState::Sky, Some(key)) => {
                let phenomena = self.words::<Phenomenon>("phenomenon", Type::Enum(key), name.span);
                let levels = self.words::<Level>("level", ty, name.span);
                Some(StateMeaning::Sky(phenomena?, levels?))
            }
            (WorldState::Time | WorldState::Sky, _) => {
                let message = format!("`{}` is a state of the world", name.text);
                let error = Diagnostic::error(code::TYPE_MISMATCH, message);
                self.reject(error.at(name.span, format!("must be declared as `{}`", state.meaning())))
            }
        }
    }

    /// The engine's word for each variant of an enum, for values that reach the world.
    pub(super) fn words<W: Word>(&mut self, kind: &str, ty: Type, span: Span) -> Option<Vec<W>> {
        self.words_of(kind, ty, span, |_, variant, at| {
            W::from_name(variant).ok_or_else(|| unknown_word(kind, variant, W::names(), at))
        })
    }

    /// The words that `known` gives for the variants of an enum.
    pub(super) fn words_of<T>(
        &mut self,
        kind: &str,
        ty: Type,
        span: Span,
        known: impl Fn(&Checker, &str, Span) -> Result<T, Diagnostic>,
    ) -> Option<Vec<T>> {
        let Type::Enum(of) = ty else {
            let name = self.references.type_name(ty);
            let message = format!("type mismatch: wanted a {kind}, found `{name}`");
            let error = Diagnostic::error(code::TYPE_MISMATCH, message);
            // The help for an unknown word lists the known words.
            let help = known(self, "", span).err().and_then(|unknown| unknown.help);
            return self.reject(error.at(span, format!("this is {}", article(&name))).help_if(help));
        };
        let declared = self.enums[of.0].clone();
        let label = format!("`{}` is used as a {kind} here", declared.name);
        let word = |variant: &String| {
            let found = known(self, variant, declared.span);
            self.take(found.map_err(|error| error.beside(span, label.clone())))
        };
        all_of(declared.variants.iter().map(word))
    }
}

/// A word that is not among those of the engine.
pub(super) fn unknown_word<'a>(
    kind: &str,
    word: &str,
    words: impl Iterator<Item = &'a str>,
    span: Span,
) -> Diagnostic {
    let words: Vec<&str> = words.collect();
    let error =
        Diagnostic::error(code::NOT_A_WORD, format!("the engine knows no {kind} `{word}`")).at(span, "");
    match nearest(word, words.iter().copied()) {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None => error.help(format!("it knows {}", listed(&words))),
    }
}

fn calls_of(body: &Expr) -> Vec<usize> {
    body.filter_map(|kind| match kind {
        ExprKind::Call(callee, _) => Some(*callee),
        _ => None,
    })
}
