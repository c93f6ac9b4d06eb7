//! Typed expressions: names are resolved, units are gone (all numbers are SI), every type fits.

use core::ops::Range;

use crate::model::body::BodyWord;
use crate::model::value::{EnumIndex, Type, Value};
use crate::model::vocabulary::{Fact, Known, LaneChoice, NearWord, NumberWord, PastWord, WordFact};
use crate::syntax::ast::Span;
pub use crate::syntax::ast::{Arithmetic, Comparison};
use avastra_base::units::Rational;

/// A pure function; its parameters are the locals of its body.
#[derive(Debug, Clone, PartialEq)]
pub struct FnDef {
    pub name: String,
    pub parameters: Vec<(String, Type)>,
    pub result: Type,
    pub body: Expr,
    pub span: Span,
}

/// A word of the engine: fixed, or chosen by a value of one of the author's enums.
#[derive(Debug, Clone, PartialEq)]
pub enum WordExpr<W> {
    Fixed(W),
    /// The word for each variant of the expression's enum.
    Of(Expr, Vec<W>),
}

/// Whom a fact is about, or an order is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Who {
    /// The latest bearer of a name, by index in `Space::bearers`.
    Named(usize),
    /// The bearer of the name that is the value of this parameter, by position.
    Given(usize),
}

impl Who {
    /// The name, by index in `Space::bearers`: the names are the variants of their type, in the same order.
    pub fn bearer(self, locals: &[Value]) -> usize {
        match self {
            Who::Named(who) => who,
            Who::Given(local) => locals[local].variant(),
        }
    }

    /// The names that it may be, by index in `Space::bearers`, of which there are so many.
    pub fn bearers(self, count: usize) -> Range<usize> {
        match self {
            Who::Named(who) => who..who + 1,
            Who::Given(_) => 0..count,
        }
    }
}

/// An expression with its type and the place where it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    pub kind: ExprKind,
    pub ty: Type,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    Bool(bool),
    Number(Rational),
    Variant(EnumIndex, usize),
    /// A parameter of the function or action around it, by position.
    Local(usize),
    /// A cell of the memory that is known by position.
    Cell(usize),
    /// A map in the memory: its first cell and the key.
    CellAt(usize, Box<Expr>),
    Fact(Fact),
    /// `npc#2.speed`: a fact about the road user with that number. NaN while it is not there.
    OfRoadUser(u32, Fact),
    /// `truck.speed`: a fact about the latest bearer of a name. NaN while none is there.
    OfBearer(Who, Fact),
    /// `truck.there`: whether there is a bearer of that name.
    IsThere(Who),
    /// `since(vehicles)`: the time since one of these actions last happened, and how they are called.
    Since(Vec<usize>, String),
    /// `recently(npc.gap <= 5 m, 2 s)`: whether it held at this tick or one of so many before. `throughout(…)`: whether it
    /// held at all of them. `change(ego.speed, 1 s)`: by how much it is more than so many ticks ago.
    Past(Box<Expr>, PastWord, u32),
    /// `some(Pedestrian, npc.gap <= 5 m)`: whether it holds of a road user near that has one of these bodies; of any, if
    /// there is none.
    Near(NearWord, Vec<BodyWord>, Box<Expr>),
    /// `stops_at_red.breached`: whether a requirement was breached in the step.
    Breached(usize),
    /// `keeps_distance.margin`: the smallest margin of a requirement in the step.
    Margin(usize),
    /// A function by its index in `Space::functions`.
    Call(usize, Vec<Expr>),
    /// `min(a, b)`, `max(a, b)`, `abs(a)`: of as many numbers as the word takes.
    OfNumbers(NumberWord, Vec<Expr>),
    Not(Box<Expr>),
    Negate(Box<Expr>),
    Arithmetic(Arithmetic, Box<Expr>, Box<Expr>),
    /// Compares numbers, or variants of one ordered enum.
    Compare(Comparison, Box<Expr>, Box<Expr>),
    And(Box<Expr>, Box<Expr>),
    Or(Box<Expr>, Box<Expr>),
    Implies(Box<Expr>, Box<Expr>),
    /// Both ends included.
    InRange(Box<Expr>, Box<Expr>, Box<Expr>),
    InList(Box<Expr>, Vec<Expr>),
    /// Membership in `road.lanes`; the list gives the lane for each variant of the expression's enum.
    InLanes(Box<Expr>, Vec<LaneChoice>),
    /// `road == corner`, `road in [corner, boulevard]`: whether the road is one of these.
    OnRoad(Vec<String>),
    /// `priority == ego`, `ego.light in [Yellow, Red]`: whether the fact is one of these words.
    IsWord(WordFact, Vec<String>),
    /// `van.light == Red`: the same of the latest bearer of a name.
    IsWordOf(Who, WordFact, Vec<String>),
    /// `hit == Scooter`, `near in [Sedan, SUV]`: whether the fact is one of these bodies.
    IsBody(WordFact, Vec<BodyWord>),
    /// The arm for each variant of the subject's enum is `arms[arm_of[variant]]`.
    Match {
        subject: Box<Expr>,
        arm_of: Vec<usize>,
        arms: Vec<Expr>,
    },
}

impl ExprKind {
    /// The parameter that it names, also as the one who is asked about.
    pub fn local(&self) -> Option<usize> {
        match self {
            ExprKind::Local(local)
            | ExprKind::OfBearer(Who::Given(local), _)
            | ExprKind::IsThere(Who::Given(local))
            | ExprKind::IsWordOf(Who::Given(local), ..) => Some(*local),
            _ => None,
        }
    }

    /// From when on the fact is known that it is itself; [`Known::Road`] if it is none.
    fn known(&self) -> Known {
        match self {
            ExprKind::Fact(fact) => fact.known(),
            ExprKind::IsWord(fact, _) | ExprKind::IsBody(fact, _) => fact.known(),
            ExprKind::OfBearer(..) | ExprKind::IsWordOf(..) | ExprKind::IsThere(_) | ExprKind::Since(..) => {
                Known::World
            }
            ExprKind::Breached(_) | ExprKind::Margin(_) => Known::Step,
            _ => Known::Road,
        }
    }
}

impl Expr {
    /// The conditions that `and` joins, from left to right.
    pub fn clauses(&self) -> Vec<&Expr> {
        match &self.kind {
            ExprKind::And(left, right) => left.clauses().into_iter().chain(right.clauses()).collect(),
            _ => vec![self],
        }
    }

    /// Calls `visit` for this expression and everything inside it; bodies of called functions are
    /// not entered, because they know only their arguments.
    pub fn walk(&self, visit: &mut dyn FnMut(&Expr)) {
        visit(self);
        self.each_part(&mut |part| part.walk(visit));
    }

    /// As [`Expr::walk`], for a caller that keeps what it visits.
    pub(crate) fn walk_all<'a>(&'a self, visit: &mut dyn FnMut(&'a Expr)) {
        visit(self);
        self.each_part(&mut |part| part.walk_all(visit));
    }

    /// Calls `visit` for the expressions of which this one is made.
    pub(crate) fn each_part<'a>(&'a self, visit: &mut dyn FnMut(&'a Expr)) {
        match &self.kind {
            ExprKind::Bool(_)
            | ExprKind::Number(_)
            | ExprKind::Variant(..)
            | ExprKind::Local(_)
            | ExprKind::Cell(_)
            | ExprKind::OnRoad(_)
            | ExprKind::IsWord(..)
            | ExprKind::IsWordOf(..)
            | ExprKind::IsBody(..)
            | ExprKind::OfRoadUser(..)
            | ExprKind::OfBearer(..)
            | ExprKind::IsThere(_)
            | ExprKind::Since(..)
            | ExprKind::Breached(_)
            | ExprKind::Margin(_)
            | ExprKind::Fact(_) => {}
            ExprKind::CellAt(_, inner)
            | ExprKind::Not(inner)
            | ExprKind::Past(inner, ..)
            | ExprKind::Near(_, _, inner)
            | ExprKind::Negate(inner)
            | ExprKind::InLanes(inner, _) => visit(inner),
            ExprKind::Call(_, arguments) | ExprKind::OfNumbers(_, arguments) => {
                arguments.iter().for_each(visit);
            }
            ExprKind::Arithmetic(_, left, right)
            | ExprKind::Compare(_, left, right)
            | ExprKind::And(left, right)
            | ExprKind::Or(left, right)
            | ExprKind::Implies(left, right) => {
                visit(left);
                visit(right);
            }
            ExprKind::InRange(value, low, high) => {
                visit(value);
                visit(low);
                visit(high);
            }
            ExprKind::InList(value, list) => {
                visit(value);
                list.iter().for_each(visit);
            }
            ExprKind::Match { subject, arms, .. } => {
                visit(subject);
                arms.iter().for_each(visit);
            }
        }
    }

    /// The results of `of` for the expression and its parts, where there are any.
    pub fn filter_map<T>(&self, of: impl Fn(&ExprKind) -> Option<T>) -> Vec<T> {
        let mut found = Vec::new();
        self.walk(&mut |part| found.extend(of(&part.kind)));
        found
    }

    /// Number of its operations, names and literals; those of called functions do not count.
    pub fn operations(&self) -> usize {
        let mut count = 0;
        self.walk(&mut |_| count += 1);
        count
    }

    /// How deep its parts stand in one another.
    pub fn height(&self) -> u32 {
        let mut deepest = 0;
        self.each_part(&mut |part| deepest = deepest.max(part.height()));
        deepest + 1
    }

    /// Whether the expression or a part of it passes the test.
    pub fn any(&self, mut test: impl FnMut(&ExprKind) -> bool) -> bool {
        let mut found = false;
        self.walk(&mut |expr| found |= test(&expr.kind));
        found
    }

    /// From when on all facts are known that the expression names; [`Known::Road`] if it names none.
    pub fn known(&self) -> Known {
        let mut latest = Known::Road;
        self.walk(&mut |expr| latest = latest.max(expr.kind.known()));
        latest
    }

    /// Whether it asks about the moment in the world ([`Known::World`]).
    pub fn asks_the_world(&self) -> bool {
        self.any(|kind| kind.known() == Known::World)
    }

    /// Whether the start of an episode answers all that it asks: when `step` and `elapsed` are 0.
    pub(crate) fn is_known_at_start(&self) -> bool {
        let is_at_start = |kind: &ExprKind| matches!(kind, ExprKind::Fact(Fact::StepNumber | Fact::Elapsed));
        !self.any(|kind| kind.known() > Known::Road && !is_at_start(kind))
    }

    /// Whether it asks about the moment, or about more of a spawn than its gaps.
    pub(crate) fn asks_about_moment(&self) -> bool {
        let is_gap = |kind: &ExprKind| matches!(kind, ExprKind::Fact(Fact::SpawnGap | Fact::SafetyGap));
        self.asks_the_world() || self.any(|kind| kind.known() == Known::Spawn && !is_gap(kind))
    }

    /// Whom of the named road users it asks about.
    pub fn asked(&self) -> Vec<Who> {
        self.filter_map(|kind| match kind {
            ExprKind::OfBearer(who, _) | ExprKind::IsWordOf(who, ..) | ExprKind::IsThere(who) => Some(*who),
            _ => None,
        })
    }

    /// The names of road users that it may ask about, by index in `Space::bearers`, of which there are so many.
    pub fn bearers(&self, count: usize) -> Vec<usize> {
        self.asked().into_iter().flat_map(|who| who.bearers(count)).collect()
    }

    pub fn reads_memory(&self) -> bool {
        self.any(|kind| matches!(kind, ExprKind::Cell(_) | ExprKind::CellAt(..)))
    }
}
