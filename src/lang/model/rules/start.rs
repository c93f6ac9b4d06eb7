//! The states with which an episode may begin.
//!
//! A rule without `on` that asks about states, and perhaps the road, `step` and `elapsed`, holds from the start on
//! ([`RuleDef::start`]). The actions that set such a state keep the rule, and no other action can break it. A rule with
//! `on` is about the actions that it names, and says nothing about the start.

use std::collections::{BTreeMap, BTreeSet};

use crate::model::effort;
use crate::model::eval::evaluate;
use crate::model::expr::{Expr, ExprKind};
use crate::model::facts::{Facts, MomentFacts, RoadFacts, WorldFacts};
use crate::model::rules::RulesInForce;
use crate::model::space::{Initial, Road, RuleDef, Space, StateDef};
use crate::model::value::{Memory, Type, Value};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};

/// The most combinations of drawn values that are looked at for rules that share states.
const COMBINATIONS_MAX: usize = 100_000;

/// No episode can begin so.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("on `{road}` {}", self.words())]
pub struct NoStart {
    pub road: String,
    pub rule: String,
    /// The index of the rule.
    pub(crate) index: usize,
    /// The cells that the rule reads.
    pub(crate) cells: Vec<usize>,
    /// Whether states were left untried, because there are too many.
    pub(crate) is_too_large: bool,
}

impl NoStart {
    /// The mistake, without the road.
    pub(crate) fn words(&self) -> String {
        match self.is_too_large {
            true => format!("whether an episode can begin under rule `{}` is not known", self.rule),
            false => format!("no episode can begin under rule `{}`", self.rule),
        }
    }
}

impl Space {
    /// The memory at the start of an episode: fixed states as declared, `any` states drawn from what the rules in
    /// force leave on the road.
    ///
    /// # Errors
    /// If a rule leaves nothing.
    pub fn memory_at_start(&self, road: &Road, rules: &RulesInForce, seed: u64) -> Result<Memory, NoStart> {
        self.memory_from_start(self.initial_memory(seed), &self.open_cells(), road, rules, seed)
    }

    /// As [`Space::memory_at_start`], where only the given cells may still be drawn, and the others are fixed.
    pub(crate) fn memory_from_start(
        &self,
        begun: Memory,
        open: &[usize],
        road: &Road,
        rules: &RulesInForce,
        seed: u64,
    ) -> Result<Memory, NoStart> {
        // States of the first draw that break a rule are drawn again from all values left, with the same odds.
        let mut memory = begun;
        if self.broken_start(&memory, &road.facts, rules).is_none() {
            return Ok(memory);
        }
        let mut rng = rng::stream(seed, Stream::Reset, 1);
        for group in self.groups(rules) {
            memory = self.drawn_again(&group, &memory, open, road, &mut rng)?;
        }
        Ok(memory)
    }

    /// The memory with those open cells drawn again that a group of rules reads, from all combinations that obey the rules.
    fn drawn_again(
        &self,
        group: &Group,
        memory: &Memory,
        open: &[usize],
        road: &Road,
        rng: &mut Rng,
    ) -> Result<Memory, NoStart> {
        let no_start = |index: usize, is_too_large| {
            let (road, rule) = (road.name.clone(), self.rules[index].name.clone());
            let cells = self.rules[index].start.iter().flat_map(|start| cells_read(start, &self.states));
            NoStart { road, rule, index, cells: cells.collect(), is_too_large }
        };
        let open: BTreeSet<usize> = open.iter().copied().collect();
        let cells = group.cells.iter().copied().filter(|cell| open.contains(cell));
        let all = Combinations::of(self, memory, cells);
        if all.count() > COMBINATIONS_MAX {
            return Err(no_start(group.rules[0], true));
        }
        // The numbers of the combinations that obey the rules.
        let mut legal: Vec<usize> = (0..all.count()).collect();
        for rule in &group.rules {
            legal.retain(|number| {
                !effort::is_spent() && self.stands(*rule, &all.get(*number).1, Some(&road.facts), 0)
            });
            if legal.is_empty() {
                return Err(no_start(*rule, false));
            }
        }
        let odds: Vec<f64> = legal.iter().map(|number| all.get(*number).0).collect();
        let mut ticket = rng::unit(rng) * odds.iter().sum::<f64>();
        let found = legal.iter().zip(odds).find(|(_, odds)| {
            ticket -= odds;
            ticket < 0.0
        });
        let number = found.map(|(number, _)| number).or(legal.last());
        Ok(all.get(*number.expect("no rule left nothing")).1)
    }

    /// The first rule in force that a start breaks on a road, by index.
    pub(crate) fn broken_start(
        &self,
        memory: &Memory,
        road: &RoadFacts,
        rules: &RulesInForce,
    ) -> Option<usize> {
        rules.all().find(|rule| !self.stands(*rule, memory, Some(road), 0))
    }

    /// Whether the states obey what a rule says about them where no action is judged: at the start, and after a step
    /// without an action.
    pub(crate) fn stands(&self, rule: usize, memory: &Memory, road: Option<&RoadFacts>, step: u64) -> bool {
        let Some(condition) = &self.rules[rule].start else { return true };
        let elapsed_s = self.episode.time_s(step);
        let moment = MomentFacts { elapsed_s, ..MomentFacts::default() };
        let world = WorldFacts { moment, step, ..WorldFacts::default() };
        let facts = Facts { road, world: Some(&world), ..Facts::new(&[], memory) };
        evaluate(condition, &self.functions, &facts).truth()
    }

    /// The cells that are drawn when an episode begins.
    pub(crate) fn open_cells(&self) -> Vec<usize> {
        let of_state = |state: &StateDef| {
            let drawn = state.initial.iter().enumerate().filter(|(_, initial)| **initial == Initial::Any);
            drawn.map(|(cell, _)| state.first_cell + cell).collect::<Vec<_>>()
        };
        self.states.iter().flat_map(of_state).collect()
    }

    /// The state to which a cell belongs.
    pub(crate) fn state_of(&self, cell: usize) -> &StateDef {
        &self.states[state_at(cell, &self.states)]
    }

    /// The rules about the start that are in force, those that share states together.
    fn groups(&self, rules: &RulesInForce) -> Vec<Group> {
        let mut groups: Vec<Option<Group>> = Vec::new();
        // By cell: the group that it is in. A joined group leaves its number to none, and the joint one is the last.
        let mut group_of: BTreeMap<usize, usize> = BTreeMap::new();
        for rule in rules.all() {
            let Some(condition) = &self.rules[rule].start else { continue };
            let mut group = Group { rules: vec![rule], cells: cells_read(condition, &self.states) };
            let near: BTreeSet<usize> =
                group.cells.iter().filter_map(|cell| group_of.get(cell).copied()).collect();
            for other in near.into_iter().filter_map(|number| groups[number].take()) {
                group.rules.extend(other.rules);
                group.cells.extend(other.cells);
            }
            group.rules.sort_unstable();
            group.cells.sort_unstable();
            group.cells.dedup();
            effort::spend(group.rules.len() + group.cells.len());
            if effort::is_spent() {
                break;
            }
            group_of.extend(group.cells.iter().map(|cell| (*cell, groups.len())));
            groups.push(Some(group));
        }
        groups.into_iter().flatten().collect()
    }

    /// The values of a cell's type that are drawn, each with its odds.
    pub(crate) fn drawn_values(&self, ty: Type) -> Vec<(u32, Value)> {
        match ty {
            Type::Bool => vec![(1, Value::Bool(false)), (1, Value::Bool(true))],
            Type::Enum(of) => {
                let odds = self.enums[of.0].odds.iter().enumerate().filter(|(_, odds)| **odds > 0);
                odds.map(|(variant, odds)| (*odds, Value::Variant(of, variant))).collect()
            }
            // The checker allows `any` states for finite types alone.
            Type::Int | Type::Quantity(_) => vec![(1, Value::Number(0.0))],
        }
    }
}

/// Rules that share states, and the cells which they read.
struct Group {
    rules: Vec<usize>,
    cells: Vec<usize>,
}

/// Memories that differ in some cells alone, by number: one for each combination of the values that are drawn for these
/// cells. Those of the first cell vary fastest.
pub(crate) struct Combinations<'a> {
    memory: &'a Memory,
    /// The cells, each with its values and their odds.
    cells: Vec<(usize, Vec<(u32, Value)>)>,
}

impl<'a> Combinations<'a> {
    pub fn of(space: &Space, memory: &'a Memory, cells: impl Iterator<Item = usize>) -> Combinations<'a> {
        let cells = cells.map(|cell| (cell, space.drawn_values(space.state_of(cell).ty)));
        Combinations { memory, cells: cells.collect() }
    }

    /// At most `usize::MAX`.
    pub fn count(&self) -> usize {
        self.cells.iter().map(|(_, values)| values.len()).fold(1, usize::saturating_mul)
    }

    /// The odds of a combination, relative to the others, and the memory with it.
    pub fn get(&self, mut number: usize) -> (f64, Memory) {
        effort::spend(self.memory.cells.len());
        let (mut odds, mut memory) = (1.0, self.memory.clone());
        for (cell, values) in &self.cells {
            let (of_value, value) = values[number % values.len()];
            number /= values.len();
            odds *= f64::from(of_value);
            memory.cells[*cell] = value;
        }
        (odds, memory)
    }
}

/// The cells that an expression reads.
pub(crate) fn cells_read(expr: &Expr, states: &[StateDef]) -> Vec<usize> {
    let (mut found, mut passed) = (Vec::new(), 0);
    expr.walk(&mut |part| {
        passed += 1;
        match part.kind {
            ExprKind::Cell(cell) => found.push(cell),
            ExprKind::CellAt(first, _) => found.extend(first..first + states[state_at(first, states)].cells),
            _ => {}
        }
    });
    effort::spend(passed + found.len());
    found
}

/// The index of the state to which a cell belongs. States have consecutive cells, and each state has at least one.
pub(crate) fn state_at(cell: usize, states: &[StateDef]) -> usize {
    states.partition_point(|state| state.first_cell <= cell) - 1
}

impl RuleDef {
    /// Whether the rule also binds the start of an episode.
    pub fn binds_start(&self) -> bool {
        self.start.is_some()
    }
}
