//! The memory as sets of values: what each cell may hold, and how an action changes that.

use std::collections::BTreeSet;

use crate::model::effort;
use crate::model::{Interval, SetDef, Space, StateDef, Type};
use crate::prove::enclose::{Known, Values, enclose};

impl Space {
    /// [`Space::memory_after`] for sets of values.
    pub(crate) fn cells_after(&self, action: usize, locals: &[Values], before: &[Values]) -> Vec<Values> {
        effort::spend(before.len());
        let mut after = before.to_vec();
        self.sets(Some(action)).for_each(|set| self.change_cells(&mut after, set, locals));
        after
    }

    /// [`Space::memory_after_wait`] for sets of values, where no rule is in the way.
    pub(crate) fn cells_after_wait(&self, before: &[Values]) -> Vec<Values> {
        effort::spend(before.len());
        let mut after = before.to_vec();
        self.sets(None).for_each(|set| self.change_cells(&mut after, set, &[]));
        after
    }

    fn change_cells(&self, memory: &mut [Values], set: &SetDef, locals: &[Values]) {
        let known = Known { functions: &self.functions, locals, cells: memory, road: None, case: None };
        let value = enclose(&set.value, &known);
        let key = set.key.as_ref().map(|key| enclose(key, &known));
        let state = &self.states[set.state];
        effort::spend(state.cells);
        let cells = &mut memory[state.first_cell..][..state.cells];
        match key {
            None => cells.fill(value),
            Some(Values::Variants(set)) if set.is_power_of_two() => {
                cells[set.trailing_zeros() as usize] = value;
            }
            Some(Values::Variants(set)) => {
                let hit = cells.iter_mut().enumerate().filter(|(key, _)| set >> key & 1 == 1);
                hit.for_each(|(_, cell)| *cell = cell.union(value));
            }
            Some(Values::Truth { .. } | Values::Number(_)) => {}
        }
    }

    /// The cells that a step with an action may set.
    pub(crate) fn cells_set(&self, action: usize, locals: &[Values]) -> BTreeSet<usize> {
        let unknown = self.cells_unknown();
        let known = Known { functions: &self.functions, locals, cells: &unknown, road: None, case: None };
        let mut found = BTreeSet::new();
        for set in self.sets(Some(action)) {
            let state = &self.states[set.state];
            effort::spend(state.cells);
            let keys = match set.key.as_ref().map(|key| enclose(key, &known)) {
                Some(Values::Variants(keys)) => keys,
                Some(Values::Truth { .. } | Values::Number(_)) | None => u128::MAX,
            };
            found.extend(
                (0..state.cells).filter(|key| keys >> key & 1 == 1).map(|key| state.first_cell + key),
            );
        }
        found
    }

    /// Every value of every cell.
    pub(crate) fn cells_unknown(&self) -> Vec<Values> {
        effort::spend(self.states.len());
        let unknown = |state: &StateDef| core::iter::repeat_n(self.all_values(state.ty), state.cells);
        self.states.iter().flat_map(unknown).collect()
    }

    /// Every value of a type.
    pub(crate) fn all_values(&self, ty: Type) -> Values {
        match ty {
            Type::Bool => Values::UNKNOWN_TRUTH,
            Type::Int | Type::Quantity(_) => Values::Number(Interval::ALL),
            Type::Enum(of) => {
                let count = self.enums[of.0].variants.len();
                Values::Variants(u128::MAX >> (128 - count))
            }
        }
    }
}
