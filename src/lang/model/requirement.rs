//! Requirements on the ego vehicle, at a moment: whether each is asked for, whether it holds, and by how much.
//!
//! The margin is the quantitative meaning of signal temporal logic (Fainekos and Pappas 2009, Donzé and Maler 2010). A
//! comparison has the difference of its sides, `and` the smaller margin, `or` the larger. `recently` has the largest of the
//! last ticks, `throughout` the smallest. A margin above 0 implies that the condition holds, below 0 that it does not.

use std::collections::VecDeque;

use crate::model::body::BodyWord;
use crate::model::eval::{about, evaluate};
use crate::model::expr::FnDef;
use crate::model::expr::{Arithmetic, Comparison, Expr, ExprKind};
use crate::model::facts::{Facts, MomentFacts, NearFacts, TickFacts};
use crate::model::limits::TICK_MS;
use crate::model::numbers::{arithmetic, compare_numbers};
use crate::model::sliding::Sliding;
use crate::model::space::RequirementDef;
use crate::model::value::Type;
use crate::model::vocabulary::{Known, Light, NearWord, PastWord, Word, WordFact};
use avastra_base::units::Dimension;

/// How a requirement stands at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept {
    pub holds: bool,
    /// In SI; NaN for a condition without one.
    pub margin: f64,
}

/// A requirement as it is asked at every tick: its numbers are fractions no more, and what they come to is known.
#[derive(Debug, Clone)]
pub struct ReadyRequirement {
    when: Option<Node>,
    until: Option<Node>,
    after: Option<Node>,
    condition: Node,
    unless: Option<Node>,
    has_margin: bool,
    needed: Vec<usize>,
    /// Its conditions on the past, inner ones first.
    pasts: Vec<PastNode>,
    /// Whether `after` asks nothing of `npc`.
    after_is_of_ego: bool,
}

/// A word for the past with what it is asked of: `recently(condition, …)`, `change(number, …)`.
#[derive(Debug, Clone)]
struct PastNode {
    of: Node,
    /// Whether the condition needs it: then nothing is asked until it is known.
    is_awaited: bool,
    /// Whether it asks nothing of `npc`: then it is the same for all of them.
    is_of_ego: bool,
    is_number: bool,
    has_margin: bool,
    word: PastWord,
    ticks: u32,
    /// The first of those within it, which stand before it; its own index if there is none.
    first: usize,
}

/// The memory of a requirement from tick to tick, about the ego vehicle or about one road user.
#[derive(Debug, Clone, Default)]
pub struct RequirementMemory {
    /// For each word for the past.
    pasts: Vec<Past>,
    /// Whether `when` held at some tick since which `until` did not.
    is_latched: bool,
    /// Whether `after` held at the tick before, and whether it began to hold at this one.
    was: bool,
    began: bool,
}

/// The last ticks of a condition, or of a number.
#[derive(Debug, Clone, Default)]
struct Past {
    /// Whether enough is past to say something.
    is_known: bool,
    /// Ticks up to now, and the last deciding tick: the condition held there (`recently`), or failed (`throughout`). For
    /// `total` and `times`, the ticks that count.
    ticks: u32,
    decided: Option<u32>,
    /// The result for these ticks now, and its margin, without the `margins` that were not looked at yet. For `throughout`
    /// the margins have the other sign.
    holds: bool,
    margin: f64,
    largest: Sliding,
    margins: VecDeque<f64>,
    /// The answers of these ticks, if one is recalled.
    answers: VecDeque<Kept>,
    /// The numbers of these ticks; or for those at which the condition counts 1, and 0 for the others.
    numbers: VecDeque<f64>,
    /// The sum of these, and those of the ones before them: of all older ones, and so on.
    sum: f64,
    sums: Vec<f64>,
    /// The mean, or by how much the number changed, or the time or the number of times that it counts.
    number: f64,
    /// Whether the condition held at the tick before.
    held: bool,
}

/// How a requirement is asked at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    pub kept: Kept,
    /// Whether its `after` begins to hold now.
    pub begins: bool,
}

/// An expression. Frequent parts have nodes of their own; the evaluator of all expressions does the rest.
#[derive(Debug, Clone)]
enum Node {
    Number(f64),
    Fact(Of),
    Arithmetic(Arithmetic, Box<Node>, Box<Node>),
    /// Compares a fact with a number, which is what most conditions do.
    Bound(Of, Comparison, f64),
    /// Compares numbers.
    Compare(Comparison, Box<Node>, Box<Node>),
    InRange(Box<Node>, Box<Node>, Box<Node>),
    Not(Box<Node>),
    /// Joined by `and`, in their order.
    And(Vec<Node>),
    Or(Box<Node>, Box<Node>),
    Implies(Box<Node>, Box<Node>),
    /// Whether the next light is one of these.
    IsLight(Vec<Light>),
    /// By index in `ReadyRequirement::pasts`.
    Past(usize),
    /// Whether it holds of a road user near with one of these bodies.
    Some(Vec<BodyWord>, Box<Node>),
    /// The number of road users for which the condition holds.
    Count(Vec<BodyWord>, Box<Node>),
    Other(Expr),
}

/// How a fact is read.
#[derive(Debug, Clone, Copy)]
enum Of {
    Moment(fn(&MomentFacts) -> f64),
    Tick(fn(&TickFacts) -> f64),
}

impl RequirementDef {
    /// Made ready to be asked often.
    pub fn ready(&self) -> ReadyRequirement {
        let mut pasts = Vec::new();
        let condition = Node::of(&self.condition, &mut pasts);
        for node in &mut pasts {
            node.is_awaited = true;
            node.has_margin &= self.margin.is_some();
        }
        let mut of = |expr: &Expr| Node::of(expr, &mut pasts);
        let [when, until, after, unless] =
            [&self.when, &self.until, &self.after, &self.unless].map(|part| part.as_ref().map(&mut of));
        // Only the truth of the other parts is needed.
        pasts.iter_mut().filter(|node| !node.is_awaited).for_each(|node| node.has_margin = false);
        ReadyRequirement {
            when,
            until,
            after,
            condition,
            unless,
            has_margin: self.margin.is_some(),
            needed: self.needed.clone(),
            pasts,
            after_is_of_ego: self.after.as_ref().is_some_and(|after| !asks_of_npc(after)),
        }
    }
}

impl ReadyRequirement {
    /// Whether what it says depends on ticks before: by `until`, `after` or a word for the past.
    pub fn remembers(&self) -> bool {
        self.after.is_some() || self.until.is_some() || !self.pasts.is_empty()
    }

    /// The state, at a moment, of a requirement without memory. `None` where it is not asked, because `when` does not
    /// hold or a road user that it names is not there.
    #[inline]
    pub fn at(&self, functions: &[FnDef], facts: &Facts<'_>) -> Option<Kept> {
        let at = At { functions, facts, pasts: &[] };
        if !self.are_there(facts) || self.when.as_ref().is_some_and(|when| !at.holds(when)) {
            return None;
        }
        Some(self.kept(&at))
    }

    /// The state of its condition. An excused condition is kept, as far as can be from failing.
    fn kept(&self, at: &At<'_>) -> Kept {
        match self.unless.as_ref().is_some_and(|unless| at.holds(unless)) {
            true => Kept { holds: true, margin: if self.has_margin { f64::INFINITY } else { f64::NAN } },
            false => at.kept_of(&self.condition, self.has_margin),
        }
    }

    /// Whether the road users are there that it names.
    fn are_there(&self, facts: &Facts<'_>) -> bool {
        let is_there = |who: &usize| {
            facts.world.is_some_and(|world| world.bearers.iter().any(|(known, _)| known == who))
        };
        self.needed.iter().all(is_there)
    }

    /// Whether it remembers something that is the same for all road users of which it is asked.
    pub fn remembers_of_ego(&self) -> bool {
        self.after_is_of_ego || self.pasts.iter().any(|node| node.is_of_ego)
    }

    /// Takes the next tick of what is the same for all road users, whoever is near.
    pub fn next_of_ego(&self, memory: &mut RequirementMemory, functions: &[FnDef], facts: &Facts<'_>) {
        self.next_pasts(memory, |node| !node.is_of_ego, None, functions, facts);
        memory.pasts.iter_mut().zip(&self.pasts).for_each(|(past, node)| past.settle(node));
        let RequirementMemory { pasts, was, began, .. } = memory;
        if self.after_is_of_ego {
            let at = At { functions, facts, pasts };
            let is_now = self.after.as_ref().is_some_and(|after| at.holds(after));
            (*began, *was) = (is_now && !*was, is_now);
        }
    }

    /// Takes the next tick of the past, except the parts that are left out. Parts that are the same for all road users come
    /// from `of_ego`, if it is given.
    fn next_pasts(
        &self,
        memory: &mut RequirementMemory,
        is_left_out: impl Fn(&PastNode) -> bool,
        of_ego: Option<&RequirementMemory>,
        functions: &[FnDef],
        facts: &Facts<'_>,
    ) {
        let pasts = &mut memory.pasts;
        pasts.resize_with(self.pasts.len(), Past::default);
        for (index, node) in self.pasts.iter().enumerate().filter(|(_, node)| !is_left_out(node)) {
            let (within, from) = pasts.split_at_mut(index);
            if let Some(known) = of_ego.filter(|_| node.is_of_ego).and_then(|of_ego| of_ego.pasts.get(index))
            {
                from[0].take_over(known);
                continue;
            }
            // A condition on the past begins once all parts within it are known.
            if node.is_awaited && within[node.first..].iter().any(|past| !past.is_known) {
                continue;
            }
            if node.has_margin {
                within[node.first..]
                    .iter_mut()
                    .zip(&self.pasts[node.first..])
                    .for_each(|(past, node)| past.settle(node));
            }
            let at = At { functions, facts, pasts: within };
            from[0].next(node, &at);
        }
    }

    /// The state, at the next tick, of a requirement with memory. `None` as in [`ReadyRequirement::at`], while `after`
    /// does not begin to hold, and while too little is past. With `after`, the condition is also asked while it
    /// `is_awaited`.
    pub fn at_next(
        &self,
        memory: &mut RequirementMemory,
        of_ego: Option<&RequirementMemory>,
        is_awaited: bool,
        functions: &[FnDef],
        facts: &Facts<'_>,
    ) -> Option<Asked> {
        if !self.are_there(facts) {
            *memory = RequirementMemory::default();
            return None;
        }
        self.next_pasts(memory, |_| false, of_ego, functions, facts);
        let RequirementMemory { pasts, is_latched, was, .. } = memory;
        let at = At { functions, facts, pasts };
        let holds = |node: &Option<Node>| node.as_ref().is_none_or(|node| at.holds(node));
        let is_asked = match &self.until {
            None => holds(&self.when),
            Some(until) => !at.holds(until) && (*is_latched || holds(&self.when)),
        };
        let is_now = self.after.as_ref().is_some_and(|after| at.holds(after));
        let began = match of_ego.filter(|_| self.after_is_of_ego) {
            Some(of_ego) => of_ego.began,
            None => is_now && !*was,
        };
        let begins = began && is_asked;
        (*is_latched, *was) = (is_asked, is_now);
        if pasts.iter().zip(&self.pasts).any(|(past, node)| node.is_awaited && !past.is_known) {
            return None;
        }
        let asks = if self.after.is_some() { begins || is_awaited } else { is_asked };
        asks.then(|| {
            if self.has_margin {
                pasts.iter_mut().zip(&self.pasts).for_each(|(past, node)| past.settle(node));
            }
            let at = At { functions, facts, pasts };
            Asked { kept: self.kept(&at), begins }
        })
    }
}

impl Past {
    /// Takes the next tick.
    fn next(&mut self, node: &PastNode, at: &At<'_>) {
        match node.word {
            PastWord::Change | PastWord::Ago if node.is_number => {
                self.take_number(at.number(&node.of), node);
            }
            PastWord::Change | PastWord::Ago => self.recall(at.kept_of(&node.of, node.has_margin), node),
            PastWord::Mean => self.average(at.number(&node.of), node.ticks),
            PastWord::Total => self.count(at.holds(&node.of), node.ticks, TICK_MS as f64 / 1000.0),
            PastWord::Times => {
                let holds = at.holds(&node.of);
                let held = core::mem::replace(&mut self.held, holds);
                self.count(holds && !held, node.ticks, 1.0);
            }
            PastWord::Recently | PastWord::Throughout => {
                self.take(at.kept_of(&node.of, node.has_margin), node);
            }
        }
    }

    /// Takes the result of another memory of the same past.
    fn take_over(&mut self, known: &Past) {
        (self.is_known, self.holds, self.margin, self.number) =
            (known.is_known, known.holds, known.margin, known.number);
    }

    /// Takes the answer of a tick.
    fn take(&mut self, kept: Kept, node: &PastNode) {
        let is_some = node.word == PastWord::Recently;
        self.ticks = self.ticks.saturating_add(1);
        if kept.holds == is_some {
            self.decided = Some(self.ticks);
        }
        let lately = self.decided.is_some_and(|tick| self.ticks - tick <= node.ticks);
        self.holds = lately == is_some;
        self.is_known = is_some || self.ticks > node.ticks;
        if node.has_margin {
            self.margins.push_back(if is_some { kept.margin } else { -kept.margin });
            if self.margins.len() > node.ticks as usize + 1 {
                self.margins.pop_front();
            }
        }
    }

    /// Finds the margin of these ticks, which is seldom asked for.
    fn settle(&mut self, node: &PastNode) {
        while let Some(margin) = self.margins.pop_front() {
            let largest = self.largest.largest(margin, node.ticks);
            self.margin = if node.word == PastWord::Recently { largest } else { -largest };
        }
    }

    /// Takes the number of a tick.
    fn take_number(&mut self, number: f64, node: &PastNode) {
        self.numbers.push_back(number);
        if self.numbers.len() > node.ticks as usize {
            let before = self.numbers.pop_front().unwrap_or(f64::NAN);
            self.number = if node.word == PastWord::Ago { before } else { number - before };
            self.is_known = true;
        }
    }

    /// Takes the number of a tick, and finds the mean of the last ones. Numbers are only ever added, so nothing is left of
    /// those that are gone. The older ones are kept as their sums from each of them on, the latest to be popped first.
    fn average(&mut self, number: f64, ticks: u32) {
        self.numbers.push_back(number);
        self.sum += number;
        if self.numbers.len() + self.sums.len() > ticks as usize {
            if self.sums.is_empty() {
                let mut sum = 0.0;
                while let Some(number) = self.numbers.pop_back() {
                    sum += number;
                    self.sums.push(sum);
                }
                self.sum = 0.0;
            }
            self.sums.pop();
        }
        let count = self.numbers.len() + self.sums.len();
        self.number = (self.sums.last().copied().unwrap_or(0.0) + self.sum) / count as f64;
        self.is_known = true;
    }

    /// Takes the answer of a tick, and finds that of the one so many before.
    fn recall(&mut self, kept: Kept, node: &PastNode) {
        self.answers.push_back(kept);
        if self.answers.len() > node.ticks as usize
            && let Some(before) = self.answers.pop_front()
        {
            (self.holds, self.margin) = (before.holds, before.margin);
            self.is_known = true;
        }
    }

    /// Takes whether a tick counts; what each of the last ones that count is worth, is the number.
    fn count(&mut self, counts: bool, ticks: u32, worth: f64) {
        self.ticks += u32::from(counts);
        self.numbers.push_back(f64::from(u8::from(counts)));
        if self.numbers.len() > ticks as usize {
            self.ticks -= u32::from(self.numbers.pop_front() == Some(1.0));
        }
        self.number = f64::from(self.ticks) * worth;
        self.is_known = true;
    }
}

impl Node {
    /// Builds the node of an expression; its conditions on the past go to `pasts`.
    fn of(expr: &Expr, pasts: &mut Vec<PastNode>) -> Node {
        let mut node = |expr: &Expr| Node::of(expr, pasts);
        let is_number = |expr: &Expr| matches!(expr.ty, Type::Int | Type::Quantity(_));
        match &expr.kind {
            ExprKind::Number(number) => Node::Number(number.to_f64()),
            ExprKind::Fact(fact) => match (fact.of_moment(), fact.of_tick()) {
                (Some(of), _) => Node::Fact(Of::Moment(of)),
                (None, Some(of)) => Node::Fact(Of::Tick(of)),
                (None, None) => Node::Other(expr.clone()),
            },
            ExprKind::Arithmetic(op, left, right) => match (node(left), node(right)) {
                (Node::Number(left), Node::Number(right)) => Node::Number(arithmetic(*op, left, right)),
                (left, right) => Node::Arithmetic(*op, Box::new(left), Box::new(right)),
            },
            ExprKind::Compare(op, left, right) if is_number(left) => match (node(left), node(right)) {
                (Node::Fact(of), Node::Number(number)) => Node::Bound(of, *op, number),
                (left, right) => Node::Compare(*op, Box::new(left), Box::new(right)),
            },
            ExprKind::InRange(value, low, high) if is_number(value) => {
                Node::InRange(Box::new(node(value)), Box::new(node(low)), Box::new(node(high)))
            }
            ExprKind::IsWord(WordFact::EgoLight, words) => {
                Node::IsLight(words.iter().filter_map(|word| Light::from_name(word)).collect())
            }
            ExprKind::Not(inner) => Node::Not(Box::new(node(inner))),
            ExprKind::And(left, right) => {
                let parts = |node: Node| match node {
                    Node::And(parts) => parts,
                    node => vec![node],
                };
                Node::And([parts(node(left)), parts(node(right))].concat())
            }
            ExprKind::Or(left, right) => Node::Or(Box::new(node(left)), Box::new(node(right))),
            ExprKind::Implies(left, right) => Node::Implies(Box::new(node(left)), Box::new(node(right))),
            ExprKind::Past(inner, word, ticks) => {
                let first = pasts.len();
                let of = Node::of(inner, pasts);
                let has_margin = margin_dimension(inner).is_some();
                let is_number = is_number(inner);
                let (is_of_ego, word, ticks) = (!asks_of_npc(inner), *word, *ticks);
                pasts.push(PastNode {
                    of,
                    is_awaited: false,
                    is_of_ego,
                    is_number,
                    has_margin,
                    word,
                    ticks,
                    first,
                });
                Node::Past(pasts.len() - 1)
            }
            ExprKind::Negate(inner) => {
                Node::Arithmetic(Arithmetic::Subtract, Box::new(Node::Number(0.0)), Box::new(node(inner)))
            }
            ExprKind::Near(word, bodies, condition) => {
                let (bodies, condition) = (bodies.clone(), Box::new(node(condition)));
                match word {
                    NearWord::Some => Node::Some(bodies, condition),
                    NearWord::Count => Node::Count(bodies, condition),
                }
            }
            _ => Node::Other(expr.clone()),
        }
    }
}

/// Whether an expression asks something of `npc`. Whom `some` asks is its own.
fn asks_of_npc(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Near(..) => false,
        ExprKind::Fact(fact) => matches!(fact.known(), Known::Spawn | Known::Near),
        ExprKind::IsWord(word, _) => word.known() == Known::Spawn,
        _ => {
            let mut asks = false;
            expr.each_part(&mut |part| asks |= asks_of_npc(part));
            asks
        }
    }
}

/// A part of an expression that asks of the past in a place that is not followed. Only `and`, `or`, `not`, `implies`,
/// comparisons of numbers, arithmetic and the past itself may stand around it.
pub(crate) fn past_inside(of: &Expr) -> Option<&Expr> {
    let is_number = |expr: &Expr| matches!(expr.ty, Type::Int | Type::Quantity(_));
    match &of.kind {
        ExprKind::Not(inner) | ExprKind::Past(inner, ..) | ExprKind::Negate(inner) => past_inside(inner),
        ExprKind::And(left, right)
        | ExprKind::Or(left, right)
        | ExprKind::Implies(left, right)
        | ExprKind::Arithmetic(_, left, right) => past_inside(left).or_else(|| past_inside(right)),
        ExprKind::Compare(_, left, right) if is_number(left) => {
            past_inside(left).or_else(|| past_inside(right))
        }
        ExprKind::InRange(value, low, high) if is_number(value) => {
            [value, low, high].into_iter().find_map(|part| past_inside(part))
        }
        _ => {
            let mut found = None;
            of.walk_all(&mut |part| {
                if matches!(part.kind, ExprKind::Past(..)) {
                    found.get_or_insert(part);
                }
            });
            found
        }
    }
}

/// A moment at which nodes are asked.
#[derive(Clone, Copy)]
struct At<'a> {
    functions: &'a [FnDef],
    facts: &'a Facts<'a>,
    pasts: &'a [Past],
}

impl<'a> At<'a> {
    fn number(&self, node: &Node) -> f64 {
        match node {
            Node::Number(number) => *number,
            Node::Fact(of) => self.fact(*of),
            Node::Arithmetic(op, left, right) => arithmetic(*op, self.number(left), self.number(right)),
            Node::Other(expr) => evaluate(expr, self.functions, self.facts).number(),
            Node::Past(index) => {
                self.pasts.get(*index).filter(|past| past.is_known).map_or(f64::NAN, |past| past.number)
            }
            Node::Count(bodies, condition) => {
                let holds = |facts: &Facts<'_>| At { facts, ..*self }.holds(condition);
                self.each_near(bodies).filter(holds).count() as f64
            }
            Node::Bound(..)
            | Node::Compare(..)
            | Node::InRange(..)
            | Node::Not(_)
            | Node::And(..)
            | Node::Or(..)
            | Node::Implies(..)
            | Node::Some(..)
            | Node::IsLight(_) => f64::NAN,
        }
    }

    fn fact(&self, of: Of) -> f64 {
        self.facts.world.map_or(f64::NAN, |world| match of {
            Of::Moment(of) => of(&world.moment),
            Of::Tick(of) => of(&world.tick),
        })
    }

    fn holds(&self, node: &Node) -> bool {
        match node {
            Node::Bound(of, op, number) => compare_numbers(*op, self.fact(*of), *number),
            Node::Compare(op, left, right) => compare_numbers(*op, self.number(left), self.number(right)),
            Node::InRange(value, low, high) => {
                let value = self.number(value);
                compare_numbers(Comparison::GreaterEqual, value, self.number(low))
                    && compare_numbers(Comparison::LessEqual, value, self.number(high))
            }
            Node::Not(inner) => !self.holds(inner),
            Node::And(parts) => parts.iter().all(|part| self.holds(part)),
            Node::Or(left, right) => self.holds(left) || self.holds(right),
            Node::Implies(left, right) => !self.holds(left) || self.holds(right),
            Node::IsLight(lights) => {
                self.facts.world.is_some_and(|world| lights.contains(&world.moment.ego_light))
            }
            Node::Past(index) => self.past(*index).holds,
            Node::Some(bodies, condition) => {
                self.each_near(bodies).any(|facts| At { facts: &facts, ..*self }.holds(condition))
            }
            Node::Other(expr) => evaluate(expr, self.functions, self.facts).truth(),
            Node::Number(_) | Node::Fact(_) | Node::Arithmetic(..) | Node::Count(..) => false,
        }
    }

    /// The facts about each road user near with one of these bodies.
    fn each_near<'b>(&self, bodies: &'b [BodyWord]) -> impl Iterator<Item = Facts<'a>> + use<'a, 'b> {
        let facts = self.facts;
        let near: &'a [NearFacts] = facts.world.map_or(&[][..], |world| &world.near);
        near.iter().filter(move |near| near.is_of(bodies)).map(move |near| about(Some(near.npc), facts))
    }

    /// The result about the past at this tick. Inner results are known before outer ones.
    fn past(&self, index: usize) -> Kept {
        let Past { is_known, holds, margin, .. } = self.pasts[index];
        Kept { holds: is_known && holds, margin: if is_known { margin } else { f64::NEG_INFINITY } }
    }

    /// Truth of a condition, and its margin if it has one.
    fn kept_of(&self, node: &Node, has_margin: bool) -> Kept {
        match has_margin {
            true => self.kept(node),
            false => Kept { holds: self.holds(node), margin: f64::NAN },
        }
    }

    /// Truth and margin of a condition that has one.
    fn kept(&self, node: &Node) -> Kept {
        let two = |left: &Node, right: &Node| (self.kept(left), self.kept(right));
        match node {
            Node::Bound(of, op, number) => compared(*op, self.fact(*of), *number),
            Node::Compare(op, left, right) => compared(*op, self.number(left), self.number(right)),
            Node::InRange(value, low, high) => {
                let [value, low, high] = [value, low, high].map(|node| self.number(node));
                let holds = compare_numbers(Comparison::GreaterEqual, value, low)
                    && compare_numbers(Comparison::LessEqual, value, high);
                Kept { holds, margin: (value - low).min(high - value) }
            }
            Node::Not(inner) => {
                let Kept { holds, margin } = self.kept(inner);
                Kept { holds: !holds, margin: -margin }
            }
            Node::And(parts) => {
                let all = Kept { holds: true, margin: f64::INFINITY };
                parts.iter().map(|part| self.kept(part)).fold(all, |all, part| Kept {
                    holds: all.holds && part.holds,
                    margin: all.margin.min(part.margin),
                })
            }
            Node::Or(left, right) => {
                let (left, right) = two(left, right);
                Kept { holds: left.holds || right.holds, margin: left.margin.max(right.margin) }
            }
            Node::Implies(left, right) => {
                let (left, right) = two(left, right);
                Kept { holds: !left.holds || right.holds, margin: (-left.margin).max(right.margin) }
            }
            Node::Past(index) => self.past(*index),
            // Where no road user is near, the condition is as far as can be from holding.
            Node::Some(bodies, condition) => {
                let nobody = Kept { holds: false, margin: f64::NEG_INFINITY };
                self.each_near(bodies).fold(nobody, |some, facts| {
                    let one = At { facts: &facts, ..*self }.kept(condition);
                    Kept { holds: some.holds || one.holds, margin: some.margin.max(one.margin) }
                })
            }
            Node::Number(_)
            | Node::Fact(_)
            | Node::Arithmetic(..)
            | Node::Count(..)
            | Node::IsLight(_)
            | Node::Other(_) => Kept { holds: self.holds(node), margin: f64::NAN },
        }
    }
}

fn compared(op: Comparison, left: f64, right: f64) -> Kept {
    let is_less = matches!(op, Comparison::Less | Comparison::LessEqual);
    let margin = if is_less { right - left } else { left - right };
    Kept { holds: compare_numbers(op, left, right), margin }
}

/// The dimension of a condition's margin; `None` if it has none: truth values, words and `==` have no distance, and
/// distances of different dimensions cannot be compared.
pub(crate) fn margin_dimension(condition: &Expr) -> Option<Dimension> {
    match &condition.kind {
        ExprKind::Compare(Comparison::Equal | Comparison::NotEqual, ..) => None,
        ExprKind::Compare(_, value, _) | ExprKind::InRange(value, ..) => match value.ty {
            Type::Int => Some(Dimension::RATIO),
            Type::Quantity(dimension) => Some(dimension),
            Type::Bool | Type::Enum(_) => None,
        },
        ExprKind::Not(inner)
        | ExprKind::Past(inner, PastWord::Recently | PastWord::Throughout | PastWord::Ago, _)
        | ExprKind::Near(NearWord::Some, _, inner) => margin_dimension(inner),
        ExprKind::And(left, right) | ExprKind::Or(left, right) | ExprKind::Implies(left, right) => {
            margin_dimension(left).filter(|dimension| margin_dimension(right) == Some(*dimension))
        }
        _ => None,
    }
}

/// The first part of a condition that divides by anything but a literal number, here or in a function that it calls.
pub(crate) fn open_divisor<'a>(condition: &'a Expr, functions: &'a [FnDef]) -> Option<&'a Expr> {
    let mut found = None;
    let mut called = Vec::new();
    let look = |expr: &'a Expr, found: &mut Option<&'a Expr>, called: &mut Vec<usize>| match &expr.kind {
        ExprKind::Arithmetic(Arithmetic::Divide, _, divisor)
            if !matches!(divisor.kind, ExprKind::Number(_)) =>
        {
            found.get_or_insert(divisor);
        }
        ExprKind::Call(function, _) => called.push(*function),
        _ => {}
    };
    condition.walk_all(&mut |expr| look(expr, &mut found, &mut called));
    let mut looked = 0;
    while let Some(function) = called.get(looked).copied() {
        looked += 1;
        if !called[..looked - 1].contains(&function) {
            functions.get(function)?.body.walk_all(&mut |expr| look(expr, &mut found, &mut called));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::vocabulary::Fact;
    use crate::model::{Memory, WorldFacts};
    use crate::syntax::ast::Span;
    use avastra_base::units::Rational;

    fn expr(kind: ExprKind) -> Box<Expr> {
        Box::new(Expr { kind, ty: Type::Bool, span: Span::NONE })
    }

    fn speed(kind: ExprKind) -> Box<Expr> {
        Box::new(Expr { kind, ty: Type::Quantity(Dimension::SPEED), span: Span::NONE })
    }

    /// Conditions on one number, all that a seed can make up.
    fn made_up(seed: &mut u64, depth: u32) -> Box<Expr> {
        let mut next = |most: u64| {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*seed >> 33) % most
        };
        let kind = next(if depth == 0 { 5 } else { 9 });
        let number = |value: u64| speed(ExprKind::Number(Rational::integer(value as i64)));
        let fact = || speed(ExprKind::Fact(Fact::EgoSpeed));
        let compare =
            [Comparison::Less, Comparison::LessEqual, Comparison::Greater, Comparison::GreaterEqual];
        match kind {
            0..=3 => expr(ExprKind::Compare(compare[kind as usize], fact(), number(next(20)))),
            4 => {
                let low = next(20);
                expr(ExprKind::InRange(fact(), number(low), number(low + next(5))))
            }
            5 => expr(ExprKind::Not(made_up(seed, depth - 1))),
            6 => expr(ExprKind::And(made_up(seed, depth - 1), made_up(seed, depth - 1))),
            7 => expr(ExprKind::Or(made_up(seed, depth - 1), made_up(seed, depth - 1))),
            _ => expr(ExprKind::Implies(made_up(seed, depth - 1), made_up(seed, depth - 1))),
        }
    }

    #[test]
    fn a_margin_has_the_sign_of_its_condition_and_no_less_than_its_size() {
        let memory = Memory { cells: Vec::new() };
        let mut seed = 7;
        for _ in 0..2_000 {
            let condition = *made_up(&mut seed, 4);
            assert_eq!(margin_dimension(&condition), Some(Dimension::SPEED));
            let ready = Node::of(&condition, &mut Vec::new());
            let at = |value: f64| {
                let mut world = WorldFacts::default();
                world.moment.ego_speed_mps = value;
                let facts = Facts { world: Some(&world), ..Facts::new(&[], &memory) };
                let Kept { holds, margin } = At { functions: &[], facts: &facts, pasts: &[] }.kept(&ready);
                // It is the evaluator's answer, and that of the way without a margin.
                assert_eq!(holds, evaluate(&condition, &[], &facts).truth());
                assert_eq!(holds, At { functions: &[], facts: &facts, pasts: &[] }.holds(&ready));
                (holds, margin)
            };
            for half in 0..50 {
                let value = f64::from(half) * 0.5;
                let (holds, margin) = at(value);
                assert!(margin == 0.0 || holds == (margin > 0.0), "{condition:?} at {value}");
                // Every value nearer than the margin has the same answer.
                for near in [value - 0.99 * margin.abs(), value + 0.99 * margin.abs()] {
                    assert!(margin == 0.0 || at(near).0 == holds, "{condition:?} at {value} and {near}");
                }
            }
        }
    }
}
