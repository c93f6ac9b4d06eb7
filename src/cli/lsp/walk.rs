//! Through the trees of a set of files, from name to name.

use std::path::{Path, PathBuf};

use crate::check::LoadedFile;
use crate::model::Type;
use crate::model::vocabulary::{
    EpisodeField, Fact, RoadField, ScenarioClaim, SpaceClaim, SpawnField, StartField, StopReason, WAIT, Word,
    parts_of,
};
use crate::syntax::ast::{BinaryOp, Expr, ExprKind, FileId, ItemKind, Name, Span};
use crate::syntax::{Sources, ast};
use crate::units;
use crate::units::Dimension;

use super::declared::Declared;
use super::names::{Locals, Occurrence, Symbol, Ty};
use super::words::Entry;
use super::{uri, words};

/// Every name of the files that stands for something.
pub fn occurrences(files: &[LoadedFile], sources: &Sources, declared: &Declared) -> Vec<Occurrence> {
    let mut found = Vec::new();
    for (index, file) in files.iter().enumerate() {
        let id = FileId(u32::try_from(index).expect("a file's id is its position"));
        let folder = file.path.parent().unwrap_or(Path::new(""));
        let mut walker = Walker { declared, text: sources.text(id), folder, found: Vec::new() };
        file.tree.items.iter().for_each(|item| walker.item(&item.kind));
        found.append(&mut walker.found);
    }
    found
}

/// The type of an expression without parameters.
pub fn type_of(expr: &Expr, declared: &Declared) -> Option<Ty> {
    Walker { declared, text: "", folder: Path::new(""), found: Vec::new() }.expr(
        expr,
        &Locals::default(),
        None,
    )
}

struct Walker<'a> {
    declared: &'a Declared,
    text: &'a str,
    folder: &'a Path,
    found: Vec<Occurrence>,
}

impl Walker<'_> {
    fn note(&mut self, span: Span, symbols: Vec<Symbol>, declares: bool) {
        if !symbols.is_empty() {
            self.found.push(Occurrence { span, symbols, declares });
        }
    }

    fn declares(&mut self, name: &Name, symbol: impl FnOnce(String) -> Symbol) {
        self.note(name.span, vec![symbol(name.text.clone())], true);
    }

    fn uses(&mut self, span: Span, symbol: Symbol) {
        self.note(span, vec![symbol], false);
    }

    fn engine(&mut self, name: &str, span: Span, words: &[Entry]) {
        if let Some(meaning) = words::meaning(words, name) {
            self.uses(span, Symbol::Engine(name.to_owned(), meaning));
        }
    }

    /// Where a name expression stands; its own span may hold parentheses.
    fn name_span(&self, name: &str, span: Span) -> Span {
        let inside = self.text.get(span.start..span.end).and_then(|text| text.find(name)).unwrap_or(0);
        Span::new(span.file, span.start + inside, span.start + inside + name.len())
    }

    fn path(&self, written: &str) -> PathBuf {
        uri::normal(&self.folder.join(written))
    }

    fn item(&mut self, kind: &ItemKind) {
        match kind {
            ItemKind::Language(_) => {}
            ItemKind::Use(used) => {
                let path = self.path(&used.path.value);
                self.uses(used.path.span, Symbol::File(path));
                for name in &used.without {
                    self.target(name);
                    if self.declared.rules.contains_key(&name.text) {
                        self.uses(name.span, Symbol::Rule(name.text.clone()));
                    }
                }
            }
            ItemKind::Enum(declared) => {
                self.declares(&declared.name, Symbol::Enum);
                for variant in &declared.variants {
                    self.declares(variant, |name| Symbol::Variant(declared.name.text.clone(), name));
                }
            }
            ItemKind::Odds(declared) => {
                let of = &declared.name.text;
                self.uses(declared.name.span, Symbol::Enum(of.clone()));
                for arm in &declared.arms {
                    let ty = Ty::Enum(of.clone());
                    arm.patterns.iter().for_each(|pattern| self.variant(pattern, Some(&ty)));
                    self.expr(&arm.value, &Locals::default(), None);
                }
            }
            ItemKind::State(declared) => {
                self.declares(&declared.name, Symbol::State);
                self.ty(&declared.ty);
                if let ast::Initial::Value(value) = &declared.initial {
                    let ty = match self.declared.ty(&declared.ty) {
                        Some(Ty::Map(_, value)) => Some(*value),
                        ty => ty,
                    };
                    self.expr(value, &Locals::default(), ty);
                }
            }
            ItemKind::Let(declared) => {
                self.declares(&declared.name, Symbol::Constant);
                self.expr(&declared.value, &Locals::default(), None);
            }
            ItemKind::Fn(declared) => self.function(declared),
            ItemKind::Action(declared) => self.action(declared),
            ItemKind::Group(declared) => {
                self.declares(&declared.name, Symbol::Group);
                declared.members.iter().for_each(|member| self.target(member));
            }
            ItemKind::Rule(declared) => self.rule(declared),
            ItemKind::Road(block) => self.road(block),
            ItemKind::Episode(fields) => self.episode(fields),
            ItemKind::Reward(cases) => {
                for case in cases {
                    if let Some(condition) = &case.condition {
                        self.expr(condition, &Locals::default(), Some(Ty::Bool));
                    }
                    self.expr(&case.value, &Locals::default(), None);
                }
            }
            ItemKind::Verdict(declared) => {
                self.declares(&declared.name, Symbol::Verdict);
                self.expr(&declared.condition, &Locals::default(), Some(Ty::Bool));
            }
            ItemKind::Expect(expect) => self.expect(expect),
            ItemKind::Scenario(declared) => self.scenario(declared),
            ItemKind::Policy(declared) => self.policy(declared),
            ItemKind::Override(inner) => self.item(inner),
        }
    }

    fn ty(&mut self, ty: &ast::Type) {
        match &ty.kind {
            ast::TypeKind::Named(name) => self.type_name(name),
            ast::TypeKind::Map { key, value } => {
                self.type_name(key);
                self.type_name(value);
            }
        }
    }

    fn type_name(&mut self, name: &Name) {
        if self.declared.enums.contains_key(&name.text) {
            self.uses(name.span, Symbol::Enum(name.text.clone()));
        } else if words::meaning(&words::types(), &name.text).is_some() {
            self.uses(name.span, Symbol::Type(name.text.clone()));
        }
    }

    fn function(&mut self, declared: &ast::Fn) {
        self.declares(&declared.name, Symbol::Function);
        let mut locals = Locals::default();
        for param in &declared.params {
            let symbol = Symbol::Argument(declared.name.text.clone(), param.name.text.clone());
            self.note(param.name.span, vec![symbol.clone()], true);
            self.ty(&param.ty);
            locals.0.insert(param.name.text.clone(), (vec![symbol], self.declared.ty(&param.ty)));
        }
        self.ty(&declared.result);
        self.expr(&declared.body, &locals, self.declared.ty(&declared.result));
    }

    fn action(&mut self, declared: &ast::Action) {
        self.declares(&declared.name, Symbol::Action);
        let mut locals = Locals::default();
        for param in &declared.params {
            let symbol = Symbol::Parameter(declared.name.text.clone(), param.name.text.clone());
            locals.0.insert(param.name.text.clone(), (vec![symbol], self.declared.ty(&param.ty)));
        }
        for param in &declared.params {
            let symbol = Symbol::Parameter(declared.name.text.clone(), param.name.text.clone());
            self.note(param.name.span, vec![symbol], true);
            self.ty(&param.ty);
            if let Some(within) = &param.within {
                self.expr(within, &Locals::default(), self.declared.ty(&param.ty));
            }
            if let Some(condition) = &param.condition {
                self.expr(condition, &locals, Some(Ty::Bool));
            }
        }
        declared.effects.iter().for_each(|effect| self.effect(effect, &locals));
    }

    fn effect(&mut self, effect: &ast::Effect, locals: &Locals) {
        match &effect.kind {
            ast::EffectKind::Set { state, key, value } => {
                let ty = self.state(state);
                let (key_of, value_of) = match ty {
                    Some(Ty::Map(key, value)) => (Some(Ty::Enum(key)), Some(*value)),
                    ty => (None, ty),
                };
                if let Some(key) = key {
                    self.expr(key, locals, key_of);
                }
                self.expr(value, locals, value_of);
            }
            ast::EffectKind::Spawn { body, distance, fields, .. } => {
                self.word("body", body, locals);
                self.expr(distance, locals, Some(Ty::Quantity(Dimension::LENGTH)));
                for field in fields {
                    self.engine(&field.name.text, field.name.span, &words::of::<SpawnField>());
                    self.word(&field.name.text, &field.value, locals);
                }
            }
        }
    }

    /// What reaches the world: a word of the engine, or an expression.
    fn word(&mut self, field: &str, expr: &Expr, locals: &Locals) {
        match &expr.kind {
            ExprKind::Name(name) if !self.is_variable(name, locals) => {
                let span = self.name_span(name, expr.span);
                self.engine(name, span, &words::engine_words(field));
            }
            _ => {
                self.expr(expr, locals, None);
            }
        }
    }

    fn is_variable(&self, name: &str, locals: &Locals) -> bool {
        let declared = self.declared;
        locals.0.contains_key(name)
            || declared.constants.contains_key(name)
            || declared.states.contains_key(name)
    }

    /// The use of a state, and its type.
    fn state(&mut self, name: &Name) -> Option<Ty> {
        let of = self.declared.states.get(&name.text)?;
        self.uses(name.span, Symbol::State(name.text.clone()));
        of.of.clone()
    }

    /// An action or a group.
    fn target(&mut self, name: &Name) {
        if self.declared.actions.contains_key(&name.text) {
            self.uses(name.span, Symbol::Action(name.text.clone()));
        } else if self.declared.groups.contains_key(&name.text) {
            self.uses(name.span, Symbol::Group(name.text.clone()));
        }
    }

    fn rule(&mut self, declared: &ast::Rule) {
        self.declares(&declared.name, Symbol::Rule);
        match &declared.body {
            ast::RuleBody::Holds { on, condition } => {
                on.iter().for_each(|name| self.target(name));
                let mut locals = Locals::default();
                for action in on.iter().flat_map(|name| self.declared.targets(&name.text)) {
                    for parameter in self.declared.actions.get(&action).iter().flat_map(|action| &action.of) {
                        let symbol = Symbol::Parameter(action.clone(), parameter.name.clone());
                        let (symbols, _) = locals
                            .0
                            .entry(parameter.name.clone())
                            .or_insert_with(|| (Vec::new(), parameter.ty.clone()));
                        symbols.push(symbol);
                    }
                }
                self.expr(condition, &locals, Some(Ty::Bool));
            }
            ast::RuleBody::Moves { state, moves } => {
                let ty = self.state(state);
                for line in moves {
                    self.variant(&line.from, ty.as_ref());
                    line.to.iter().for_each(|to| self.variant(to, ty.as_ref()));
                }
            }
        }
    }

    fn variant(&mut self, name: &Name, ty: Option<&Ty>) {
        if let Some(of) = self.variant_of(&name.text, ty) {
            self.uses(name.span, Symbol::Variant(of, name.text.clone()));
        }
    }

    /// The enum that a variant belongs to: the wanted one, or the only one.
    fn variant_of(&self, name: &str, wanted: Option<&Ty>) -> Option<String> {
        let owners: Vec<&str> = self.declared.owners(name).collect();
        let wanted = wanted.and_then(Ty::variants_of);
        match (wanted, owners.as_slice()) {
            (Some(of), owners) if owners.contains(&of) => Some(of.to_owned()),
            (_, [only]) => Some((*only).to_owned()),
            _ => None,
        }
    }

    fn road(&mut self, block: &ast::Block) {
        self.declares(&block.name, Symbol::Road);
        for field in &block.fields {
            self.engine(&field.name.text, field.name.span, &words::of::<RoadField>());
            match &field.value.kind {
                ExprKind::Text(path) if field.name.text == "map" => {
                    let path = self.path(path);
                    self.uses(field.value.span, Symbol::File(path));
                }
                _ => {
                    self.expr(&field.value, &Locals::default(), None);
                }
            }
        }
    }

    fn episode(&mut self, fields: &[ast::Field]) {
        for field in fields {
            self.engine(&field.name.text, field.name.span, &words::of::<EpisodeField>());
            match (&field.value.kind, field.name.text.as_str()) {
                (ExprKind::List(roads), "roads") => self.listed(roads, Symbol::Road),
                (_, "stop") => self.stop(&field.value),
                _ => {
                    self.expr(&field.value, &Locals::default(), None);
                }
            }
        }
    }

    fn stop(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Name(name) => {
                self.engine(name, self.name_span(name, expr.span), &words::of::<StopReason>())
            }
            ExprKind::Binary { left, right, .. } => {
                self.stop(left);
                self.stop(right);
            }
            _ => {}
        }
    }

    /// Names of roads or rules.
    fn listed(&mut self, items: &[Expr], symbol: impl Fn(String) -> Symbol) {
        for item in items {
            if let ExprKind::Name(name) = &item.kind {
                self.uses(self.name_span(name, item.span), symbol(name.clone()));
            }
        }
    }

    fn expect(&mut self, expect: &ast::Expect) {
        self.claim(&expect.claim);
        for clause in &expect.clauses {
            self.expr(&clause.value, &Locals::default(), None);
        }
    }

    fn claim(&mut self, claim: &Expr) {
        match &claim.kind {
            ExprKind::Binary { left, right, .. } => {
                self.claim(left);
                self.claim(right);
            }
            ExprKind::Call(call) => {
                self.engine(&call.name.text, call.name.span, &words::of::<SpaceClaim>());
                for argument in &call.args {
                    if let ExprKind::Name(name) = &argument.value.kind {
                        let span = self.name_span(name, argument.value.span);
                        self.engine(name, span, &words::of::<SpaceClaim>());
                        self.target(&Name::new(name.clone(), span));
                    }
                }
            }
            ExprKind::Name(name) if self.declared.verdicts.contains_key(name) => {
                self.uses(self.name_span(name, claim.span), Symbol::Verdict(name.clone()));
            }
            ExprKind::Name(name) if ScenarioClaim::from_name(name).is_some() => {
                self.engine(name, self.name_span(name, claim.span), &words::of::<ScenarioClaim>());
            }
            _ => {
                self.expr(claim, &Locals::default(), None);
            }
        }
    }

    fn scenario(&mut self, declared: &ast::Scenario) {
        self.declares(&declared.name, Symbol::Scenario);
        self.origin(&declared.origin);
        self.uses(declared.road.span, Symbol::Road(declared.road.text.clone()));
        for field in &declared.start {
            self.engine(&field.name.text, field.name.span, &words::of::<StartField>());
            let ty = self.state(&field.name);
            match (&field.value.kind, ty) {
                (ExprKind::Record(cells), Some(Ty::Map(key, value))) => {
                    for cell in cells {
                        self.variant(&cell.name, Some(&Ty::Enum(key.clone())));
                        self.expr(&cell.value, &Locals::default(), Some((*value).clone()));
                    }
                }
                (_, Some(Ty::Map(_, value))) => {
                    self.expr(&field.value, &Locals::default(), Some(*value));
                }
                (_, ty) => {
                    self.expr(&field.value, &Locals::default(), ty);
                }
            }
        }
        for step in &declared.steps {
            self.step(&step.action);
            for field in &step.drawn {
                self.argument(&step.action.name.text, &field.name, &field.value);
            }
        }
        declared.expects.iter().for_each(|expect| self.expect(expect));
    }

    fn origin(&mut self, fields: &[ast::Field]) {
        for field in fields {
            match (&field.value.kind, field.name.text.as_str()) {
                (ExprKind::List(items), "with" | "without") => self.listed(items, Symbol::Rule),
                (ExprKind::List(items), "roads") => self.listed(items, Symbol::Road),
                _ => {}
            }
        }
    }

    /// An action with values of its `each` parameters.
    fn step(&mut self, call: &ast::Call) {
        let action = &call.name.text;
        if action == WAIT.0 {
            self.engine(action, call.name.span, &[WAIT]);
        }
        self.target(&call.name);
        for (index, argument) in call.args.iter().enumerate() {
            if let Some(name) = &argument.name {
                self.argument(action, name, &argument.value);
                continue;
            }
            let axes = self.declared.actions.get(action).map(|action| action.of.iter());
            let axis = axes.and_then(|axes| axes.filter(|p| p.mode == ast::ParamMode::Each).nth(index));
            let ty = axis.and_then(|axis| axis.ty.clone());
            self.expr(&argument.value, &Locals::default(), ty);
        }
    }

    /// The value of a parameter that is named.
    fn argument(&mut self, action: &str, name: &Name, value: &Expr) {
        let parameter = self.declared.parameter(action, &name.text);
        let ty = parameter.and_then(|parameter| parameter.ty.clone());
        if parameter.is_some() {
            self.uses(name.span, Symbol::Parameter(action.to_owned(), name.text.clone()));
        }
        self.expr(value, &Locals::default(), ty);
    }

    fn policy(&mut self, declared: &ast::Policy) {
        self.declares(&declared.name, Symbol::Policy);
        self.origin(&declared.origin);
        for line in &declared.rules {
            if let Some(condition) = &line.condition {
                self.expr(condition, &Locals::default(), Some(Ty::Bool));
            }
            line.actions.iter().for_each(|action| self.step(action));
        }
    }

    /// Notes the names of an expression; gives its type, as far as it can be told.
    fn expr(&mut self, expr: &Expr, locals: &Locals, hint: Option<Ty>) -> Option<Ty> {
        match &expr.kind {
            ExprKind::Number(number) => self.number(number),
            ExprKind::Bool(_) => Some(Ty::Bool),
            ExprKind::Name(name) => self.name(name, expr.span, locals, hint),
            ExprKind::Unary { operand, .. } => self.expr(operand, locals, None),
            ExprKind::Binary { op, left, right, .. } => self.binary(*op, left, right, locals),
            ExprKind::Field { base, field } => {
                let ExprKind::Name(thing) = &base.kind else { return None };
                self.engine(&field.text, field.span, &parts_of(thing));
                Fact::from_name(&format!("{thing}.{}", field.text)).and_then(type_of_fact)
            }
            ExprKind::Index { base, index } => {
                let ExprKind::Name(name) = &base.kind else { return None };
                let name = Name::new(name.clone(), self.name_span(name, base.span));
                let (key, value) = match self.state(&name) {
                    Some(Ty::Map(key, value)) => (Some(Ty::Enum(key)), Some(*value)),
                    _ => (None, None),
                };
                self.expr(index, locals, key);
                value
            }
            ExprKind::Call(call) => self.call(call, locals),
            ExprKind::List(items) => {
                items.iter().for_each(|item| {
                    self.expr(item, locals, hint.clone());
                });
                None
            }
            ExprKind::Record(fields) => {
                fields.iter().for_each(|field| {
                    self.expr(&field.value, locals, None);
                });
                None
            }
            ExprKind::Range { low, high } => {
                let ty = self.expr(low, locals, hint.clone());
                self.expr(high, locals, hint);
                ty
            }
            ExprKind::Match { subject, arms } => {
                let of = self.expr(subject, locals, None);
                let mut ty = hint;
                for arm in arms {
                    arm.patterns.iter().for_each(|pattern| self.variant(pattern, of.as_ref()));
                    let value = self.expr(&arm.value, locals, ty.clone());
                    ty = ty.or(value);
                }
                ty
            }
            ExprKind::LanePoint { station, .. } => self.number(station),
            ExprKind::Text(_) | ExprKind::Numbered { .. } => None,
        }
    }

    fn number(&mut self, number: &ast::Number) -> Option<Ty> {
        let unit = number.unit.as_ref().map(|unit| unit.text.clone());
        self.uses(number.span, Symbol::Number(number.digits.clone(), unit.clone()));
        match unit {
            Some(word) => units::unit(&word).map(|unit| Ty::Quantity(unit.dimension)),
            None if number.digits.contains(['.', 'e', 'E']) => Some(Ty::Quantity(Dimension::RATIO)),
            None => Some(Ty::Int),
        }
    }

    fn name(&mut self, name: &str, span: Span, locals: &Locals, hint: Option<Ty>) -> Option<Ty> {
        let span = self.name_span(name, span);
        if let Some((symbols, ty)) = locals.0.get(name) {
            self.note(span, symbols.clone(), false);
            return ty.clone();
        }
        if let Some(constant) = self.declared.constants.get(name) {
            self.uses(span, Symbol::Constant(name.to_owned()));
            return constant.of.clone();
        }
        if self.declared.states.contains_key(name) {
            return self.state(&Name::new(name, span));
        }
        if let Some(fact) = Fact::from_name(name) {
            self.engine(name, span, &[(fact.name(), fact.meaning())]);
            return type_of_fact(fact);
        }
        let of = self.variant_of(name, hint.as_ref())?;
        self.uses(span, Symbol::Variant(of.clone(), name.to_owned()));
        Some(Ty::Enum(of))
    }

    fn binary(&mut self, op: BinaryOp, left: &Expr, right: &Expr, locals: &Locals) -> Option<Ty> {
        match op {
            BinaryOp::Implies | BinaryOp::Or | BinaryOp::And => {
                self.expr(left, locals, Some(Ty::Bool));
                self.expr(right, locals, Some(Ty::Bool));
                Some(Ty::Bool)
            }
            BinaryOp::Add | BinaryOp::Subtract | BinaryOp::Multiply | BinaryOp::Divide => {
                let a = self.expr(left, locals, None);
                let b = self.expr(right, locals, None);
                product(op, a?, b?)
            }
            BinaryOp::Equal
            | BinaryOp::NotEqual
            | BinaryOp::Less
            | BinaryOp::LessEqual
            | BinaryOp::Greater
            | BinaryOp::GreaterEqual
            | BinaryOp::In => {
                let is_road = |side: &Expr| matches!(&side.kind, ExprKind::Name(name) if name == "road");
                if let Some(of) = [(left, right), (right, left)].into_iter().find(|(side, _)| is_road(side)) {
                    match &of.1.kind {
                        ExprKind::List(roads) => self.listed(roads, Symbol::Road),
                        _ => self.listed(core::slice::from_ref(of.1), Symbol::Road),
                    }
                    return Some(Ty::Bool);
                }
                // The side that is no bare variant tells the type of the other.
                let bare = matches!(&left.kind, ExprKind::Name(name) if !self.is_variable(name, locals));
                let (first, second) = if bare { (right, left) } else { (left, right) };
                let ty = self.expr(first, locals, None);
                self.expr(second, locals, ty);
                Some(Ty::Bool)
            }
        }
    }

    fn call(&mut self, call: &ast::Call, locals: &Locals) -> Option<Ty> {
        let function = self.declared.functions.get(&call.name.text);
        if function.is_some() {
            self.uses(call.name.span, Symbol::Function(call.name.text.clone()));
        }
        for (index, argument) in call.args.iter().enumerate() {
            let parameters = function.map(|function| function.of.parameters.iter());
            let parameter = parameters.and_then(|mut parameters| match &argument.name {
                Some(name) => parameters.find(|(known, _)| *known == name.text),
                None => parameters.nth(index),
            });
            if let (Some(name), Some(_)) = (&argument.name, parameter) {
                self.uses(name.span, Symbol::Argument(call.name.text.clone(), name.text.clone()));
            }
            self.expr(&argument.value, locals, parameter.and_then(|(_, ty)| ty.clone()));
        }
        function.and_then(|function| function.of.result.clone())
    }
}

fn type_of_fact(fact: Fact) -> Option<Ty> {
    match fact.ty() {
        Type::Bool => Some(Ty::Bool),
        Type::Int => Some(Ty::Int),
        Type::Quantity(dimension) => Some(Ty::Quantity(dimension)),
        Type::Enum(_) => None,
    }
}

/// The type of a sum, difference, product or quotient.
fn product(op: BinaryOp, a: Ty, b: Ty) -> Option<Ty> {
    let dimension = |ty: &Ty| match ty {
        Ty::Int => Some(Dimension::RATIO),
        Ty::Quantity(dimension) => Some(*dimension),
        Ty::Bool | Ty::Enum(_) | Ty::Map(..) => None,
    };
    let (x, y) = (dimension(&a)?, dimension(&b)?);
    match op {
        BinaryOp::Multiply if a == Ty::Int && b == Ty::Int => Some(Ty::Int),
        BinaryOp::Multiply => x.times(y).map(Ty::Quantity),
        BinaryOp::Divide => x.per(y).map(Ty::Quantity),
        _ if a == Ty::Int => Some(b),
        _ => Some(a),
    }
}
