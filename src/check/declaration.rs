//! Enums, constants, functions and states.

use crate::check::checker::{Checker, docs, each};
use crate::check::expression::Place;
use crate::check::names::{Names, unknown};
use crate::check::rule::names_in;
use crate::model::expr::{Expr, ExprKind};
use crate::model::vocabulary::{Level, Phenomenon, TimeOfDay, Word};
use crate::model::{EnumDef, EnumIndex, FnDef, Initial, StateDef, StateMeaning, Type, code};
use crate::prove::VARIANTS_MAX;
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast, listed, nearest};

/// A function may come to so many operations, those of the functions it calls included: each call
/// stands for a copy, and copies of copies grow fast.
const OPERATIONS_MAX: u64 = 10_000;

/// Calls within calls, at most.
const CALLS_MAX: u32 = 64;

/// What a function comes to, all that it calls included.
#[derive(Debug, Clone, Copy)]
struct Cost {
    operations: u64,
    /// Calls within calls.
    depth: u32,
}

/// A variant may be drawn so many times as often as another.
const ODDS_MAX: u32 = 100;

impl Checker {
    pub(super) fn declare_enums(&mut self, items: &[&ast::Item]) {
        for (item, declared) in each(items, |kind| match kind {
            ItemKind::Enum(declared) => Some(declared),
            _ => None,
        }) {
            if let Err(error) = self.enum_names.declare("enum", &declared.name, self.enums.len()) {
                self.report(error);
                continue;
            }
            let mut variants = Names::default();
            for (index, variant) in declared.variants.iter().enumerate() {
                if let Err(error) = variants.declare("variant", variant, index) {
                    self.report(error);
                }
            }
            if declared.variants.len() > VARIANTS_MAX {
                let message = format!("`{}` has {} variants", declared.name.text, declared.variants.len());
                let error = Diagnostic::error(code::TOO_MANY_VARIANTS, message);
                let error = error.at(declared.name.span, format!("at most {VARIANTS_MAX} are possible"));
                self.report(error.help("make two enums of it, or take an `Int` with a range"));
            }
            self.enums.push(EnumDef {
                name: declared.name.text.clone(),
                docs: docs(item),
                variants: variants_of(declared),
                ordered: declared.ordered,
                odds: vec![1; declared.variants.len().min(VARIANTS_MAX)],
                span: declared.name.span,
            });
        }
    }

    /// How often variants are drawn: whole numbers, folded like constants.
    pub(super) fn declare_odds(&mut self, items: &[&ast::Item]) {
        let mut names = Names::default();
        for (_, declared) in each(items, |kind| match kind {
            ItemKind::Odds(declared) => Some(declared),
            _ => None,
        }) {
            if let Err(error) = names.declare("odds of", &declared.name, 0) {
                self.report(error);
                continue;
            }
            let Some(of) = self.enum_names.get(&declared.name.text) else {
                let error = unknown("enum", &declared.name.text, declared.name.span, self.enum_names.all());
                self.report(error);
                continue;
            };
            let variants = self.enums[of].variants.clone();
            let mut odds: Vec<Option<u32>> = vec![None; variants.len()];
            for arm in &declared.arms {
                let value = self.odds_of(&arm.value).unwrap_or(1);
                let named: Vec<Option<usize>> =
                    arm.patterns.iter().map(|pattern| self.variant(pattern, &variants)).collect();
                let taken: Vec<usize> = match arm.patterns.is_empty() {
                    true => (0..variants.len()).filter(|variant| odds[*variant].is_none()).collect(),
                    false => named.into_iter().flatten().collect(),
                };
                // An unknown variant was reported.
                let sound = arm.patterns.is_empty() || !taken.is_empty();
                if sound && !taken.iter().any(|variant| odds[*variant].is_none()) {
                    let error = Diagnostic::error(code::NEVER_REACHED, "these odds never count");
                    self.report(error.at(arm.span, "the lines before it say it all").help("remove the line"));
                }
                for variant in taken {
                    odds[variant] = odds[variant].or(Some(value));
                }
            }
            // Whoever is not named is as likely as before.
            let odds: Vec<u32> = odds.into_iter().map(|odds| odds.unwrap_or(1)).collect();
            if odds.iter().all(|odds| *odds == 0) {
                let message = format!("no `{}` is ever drawn", declared.name.text);
                let error =
                    Diagnostic::error(code::EMPTY, message).at(declared.name.span, "all its odds are 0");
                self.report(error.help("give at least one variant odds above 0"));
                continue;
            }
            self.enums[of].odds = odds;
        }
    }

    fn odds_of(&mut self, value: &ast::Expr) -> Option<u32> {
        let expr = self.expr(value, &Place::default(), Some(Type::Int))?;
        let found = match (expr.ty, self.fold(&expr)?) {
            (Type::Int, ExprKind::Number(number)) => {
                number.to_i64().and_then(|odds| u32::try_from(odds).ok())
            }
            _ => None,
        };
        let odds = found.filter(|odds| *odds <= ODDS_MAX);
        if odds.is_none() {
            let error = Diagnostic::error(code::SETTING, "odds are whole numbers");
            let error = error.at(value.span, format!("wanted a whole number from 0 to {ODDS_MAX}"));
            self.report(error.help("`BoxTruck => 2` makes trucks twice as likely as what has 1"));
        }
        odds
    }

    pub(super) fn declare_constants(&mut self, items: &[&ast::Item]) {
        let mut names = Names::default();
        let mut open: Vec<&ast::Let> = Vec::new();
        for (_, declared) in each(items, |kind| match kind {
            ItemKind::Let(declared) => Some(declared),
            _ => None,
        }) {
            match names.declare("constant", &declared.name, open.len()) {
                Ok(()) => open.push(declared),
                Err(error) => self.report(error),
            }
        }
        // The order of declarations means nothing: a constant waits for those that it names. Where
        // they wait in a circle, the first is taken, and its names are unknown.
        let named: Vec<Vec<ast::Name>> = open.iter().map(|declared| names_in(&declared.value)).collect();
        let mut waiting: Vec<usize> = (0..open.len()).collect();
        while !waiting.is_empty() {
            let waits = |at: usize| {
                named[at].iter().any(|name| {
                    names.get(&name.text).is_some_and(|other| other == at || waiting.contains(&other))
                })
            };
            let next = waiting.iter().position(|at| !waits(*at)).unwrap_or(0);
            let declared = open[waiting.remove(next)];
            let value = self.expr(&declared.value, &Place::default(), None);
            let value = value.and_then(|value| Some(Expr { kind: self.fold(&value)?, ..value }));
            self.constants.push((declared.name.text.clone(), value));
        }
    }

    pub(super) fn declare_functions(&mut self, items: &[&ast::Item]) {
        let mut declared = Vec::new();
        for (_, function) in each(items, |kind| match kind {
            ItemKind::Fn(function) => Some(function),
            _ => None,
        }) {
            match self.function_names.declare("function", &function.name, declared.len()) {
                Ok(()) => declared.push(function),
                Err(error) => self.report(error),
            }
        }
        for function in &declared {
            let signature = self.signature(function);
            self.signatures.push(signature);
        }
        for (index, function) in declared.iter().enumerate() {
            let Some((parameters, result, span)) = self.signatures[index].clone() else { continue };
            let place = Place { locals: &parameters, ..Place::default() };
            let Some(body) = self.typed(&function.body, &place, result) else { continue };
            let name = function.name.text.clone();
            self.functions.push(FnDef { name, parameters, result, body, span });
        }
        // With a body missing, indices would be off; the mistake is reported already.
        if self.functions.len() == declared.len() {
            self.reject_recursion();
        } else {
            self.functions.clear();
        }
    }

    fn signature(&mut self, function: &ast::Fn) -> Option<crate::check::checker::Signature> {
        let mut names = Names::default();
        let mut parameters = Some(Vec::new());
        for (index, parameter) in function.params.iter().enumerate() {
            if let Err(error) = names.declare("parameter", &parameter.name, index) {
                self.report(error);
            }
            let ty = self.plain_type(&parameter.ty);
            parameters = parameters.zip(ty).map(|(mut all, ty)| {
                all.push((parameter.name.text.clone(), ty));
                all
            });
        }
        let result = self.plain_type(&function.result);
        Some((parameters?, result?, function.name.span))
    }

    /// Functions may not call themselves, nor grow without measure by calling others.
    fn reject_recursion(&mut self) {
        let calls: Vec<Vec<usize>> = self.functions.iter().map(|function| calls_of(&function.body)).collect();
        // `None` while a function is being measured: meeting it again is recursion.
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
            let too_large = |cost: Cost| cost.operations > OPERATIONS_MAX || cost.depth > CALLS_MAX;
            if costs[start].flatten().is_some_and(too_large) {
                let function = &self.functions[start];
                let message = format!("`{}` calls too much", function.name);
                let error =
                    Diagnostic::error(code::TOO_LARGE, message).at(function.span, "with all that it calls");
                let error = error.note(format!(
                    "at most {OPERATIONS_MAX} operations and {CALLS_MAX} calls within calls are possible"
                ));
                self.report(error.help("compute what is needed twice once, and pass it on as a parameter"));
                self.functions.clear();
                return;
            }
        }
    }

    /// Operations of a function and all it calls.
    ///
    /// # Errors
    /// The functions of a circle.
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
            // Far enough to know that it is too far.
            None if path.len() > CALLS_MAX as usize => {
                return Ok(Cost { operations: 0, depth: CALLS_MAX + 1 });
            }
            None => {}
        }
        costs[function] = Some(None);
        path.push(function);
        let mut cost = Cost { operations: 0, depth: 1 };
        self.functions[function].body.walk(&mut |_| cost.operations += 1);
        for callee in &calls[function] {
            let inner = self.cost(*callee, calls, costs, path)?;
            cost.operations = cost.operations.saturating_add(inner.operations);
            cost.depth = cost.depth.max(inner.depth.saturating_add(1));
        }
        path.pop();
        costs[function] = Some(Some(cost));
        Ok(cost)
    }

    pub(super) fn declare_states(&mut self, items: &[&ast::Item]) {
        let mut names = Names::default();
        let mut cells_so_far = 0;
        for (item, declared) in each(items, |kind| match kind {
            ItemKind::State(declared) => Some(declared),
            _ => None,
        }) {
            if let Err(error) = names.declare("state", &declared.name, self.states.len()) {
                self.report(error);
                continue;
            }
            let (key, value) = match &declared.ty.kind {
                ast::TypeKind::Named(name) => (None, self.named_type(name)),
                ast::TypeKind::Map { key, value } => {
                    let Some(Type::Enum(of)) = self.named_type(key) else {
                        let error =
                            Diagnostic::error(code::TYPE_MISMATCH, "the keys of a map must be an enum");
                        self.report(error.at(key.span, "not an enum"));
                        continue;
                    };
                    (Some(of), self.named_type(value))
                }
            };
            let Some(ty) = value else { continue };
            let Some(initial) = self.initial(declared, ty) else { continue };
            // A state with a broken meaning is a state all the same to whatever names it.
            let meaning = self.meaning(&declared.name, key, ty).unwrap_or(StateMeaning::Private);
            let cells = key.map_or(1, |of| self.enums[of.0].variants.len());
            self.states.push(StateDef {
                name: declared.name.text.clone(),
                docs: docs(item),
                key,
                ty,
                first_cell: cells_so_far,
                cells,
                initial,
                meaning,
                span: declared.name.span,
            });
            cells_so_far += cells;
        }
    }

    fn initial(&mut self, declared: &ast::State, ty: Type) -> Option<Initial> {
        match &declared.initial {
            ast::Initial::Value(value) => {
                let value = self.typed(value, &Place::default(), ty)?;
                Some(Initial::Value(Expr { kind: self.fold(&value)?, ..value }))
            }
            ast::Initial::Any if matches!(ty, Type::Bool | Type::Enum(_)) => Some(Initial::Any),
            ast::Initial::Any => {
                let error = Diagnostic::error(
                    code::INFINITE,
                    format!("`{}` cannot begin as `any` number", declared.name.text),
                );
                self.report(error.at(declared.ty.span, "has no end of values").help("give it a value"));
                None
            }
        }
    }

    /// `time` and `sky` are the world's own; any other state is the author's bookkeeping.
    fn meaning(&mut self, name: &ast::Name, key: Option<EnumIndex>, ty: Type) -> Option<StateMeaning> {
        match (name.text.as_str(), key) {
            ("time", None) => {
                Some(StateMeaning::Time(self.words::<TimeOfDay>("time of day", ty, name.span)?))
            }
            ("sky", Some(key)) => {
                let phenomena = self.words::<Phenomenon>("phenomenon", Type::Enum(key), name.span);
                let levels = self.words::<Level>("level", ty, name.span);
                Some(StateMeaning::Sky(phenomena?, levels?))
            }
            ("time" | "sky", _) => {
                let shape = if name.text == "time" { "`time: Time`" } else { "`sky: Sky -> Level`" };
                let error = Diagnostic::error(
                    code::TYPE_MISMATCH,
                    format!("`{}` is a state of the world", name.text),
                );
                self.report(error.at(name.span, format!("must be declared as {shape}")));
                None
            }
            _ => Some(StateMeaning::Private),
        }
    }

    /// The engine's word for each variant of an enum whose values reach the world.
    pub(super) fn words<W: Word>(&mut self, kind: &str, ty: Type, span: Span) -> Option<Vec<W>> {
        let Type::Enum(of) = ty else {
            let name = self.type_name(ty);
            let error = Diagnostic::error(
                code::TYPE_MISMATCH,
                format!("type mismatch: wanted a {kind}, found `{name}`"),
            );
            self.report(error.at(span, format!("this is a `{name}`")));
            return None;
        };
        let declared = self.enums[of.0].clone();
        let mut words = Some(Vec::new());
        for variant in &declared.variants {
            match W::from_name(variant) {
                Some(word) => {
                    if let Some(words) = &mut words {
                        words.push(word);
                    }
                }
                None => {
                    words = None;
                    let error = unknown_word::<W>(kind, variant, declared.span);
                    self.report(error.beside(span, format!("`{}` is used as a {kind} here", declared.name)));
                }
            }
        }
        words
    }
}

/// The variants as far as they can be held.
fn variants_of(declared: &ast::Enum) -> Vec<String> {
    declared.variants.iter().take(VARIANTS_MAX).map(|variant| variant.text.clone()).collect()
}

/// A spelling that means nothing to the engine.
pub(super) fn unknown_word<W: Word>(kind: &str, word: &str, span: Span) -> Diagnostic {
    let words: Vec<&str> = W::ALL.iter().map(|word| word.name()).collect();
    let error = Diagnostic::error(code::NOT_A_WORD, format!("the engine knows no {kind} `{word}`"));
    let error = error.at(span, "");
    match nearest(word, words.iter().copied()) {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None => error.help(format!("it knows {}", listed(&words))),
    }
}

/// A state or other thing that is not declared, among candidates.
pub(super) fn unknown_state(checker: &Checker, name: &ast::Name) -> Diagnostic {
    let states = checker.states.iter().map(|state| state.name.as_str());
    let mut error = unknown("state", &name.text, name.span, states);
    error.code = code::UNKNOWN_STATE;
    match error.help {
        Some(_) => error,
        None => error.help(format!("declare it with `state {}: …`", name.text)),
    }
}

fn calls_of(body: &Expr) -> Vec<usize> {
    let mut calls = Vec::new();
    body.walk(&mut |expr| {
        if let ExprKind::Call(callee, _) = expr.kind {
            calls.push(callee);
        }
    });
    calls
}
