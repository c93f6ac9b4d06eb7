//! Which rows run on which road, in the states to which an episode comes.
//!
//! A row is searched for in the states in which an episode begins, then in those to which rows lead from there, until
//! every row has run once. What never ran there is searched for in other states.

use crate::model::rules::RowRules;
use crate::model::{Reach, Road, Row, RulesInForce, Space, StateDef};
use crate::prove::witness::{Found, Left, Search};
use crate::syntax::listed;

/// The most boxes of ranges that the searches of all rows look at; most rows need one for each road.
const BOXES_MAX: usize = 20_000;
/// The most states that are followed from step to step on one road.
const STATES_MAX: usize = 256;

/// What is found of a row on a road.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Realised {
    /// It runs in a state to which an episode comes.
    Runs,
    /// It runs, but not in a state to which an episode comes.
    Unreached,
    /// It runs, but in no state of which it was found out that an episode comes to it.
    Elsewhere,
    /// There are no values that obey its rules.
    Never,
    /// There may be values, but none were found.
    Unknown,
    /// The boxes were spent before.
    NotSearched,
}

/// What is found of every row on every road, by row and road.
pub(crate) type Realisable = Vec<Vec<Realised>>;

/// Searches for values of every row on every road.
pub(crate) fn realise(space: &Space) -> Realisable {
    let left = Left::new(BOXES_MAX);
    let in_force = RulesInForce::by_default(space);
    let mut realisable = vec![vec![Realised::NotSearched; space.roads.len()]; space.rows.len()];
    for (index, road) in space.roads.iter().enumerate() {
        let on_road = OnRoad { space, road, in_force: &in_force, left: &left };
        for (row, found) in on_road.rows(index).into_iter().enumerate() {
            realisable[row][index] = found;
        }
    }
    realisable
}

/// The rows with those marked as dead for which no values exist.
pub(crate) fn with_dead(space: &Space, realisable: &Realisable) -> Vec<Row> {
    let (in_force, left) = (RulesInForce::by_default(space), Left::new(BOXES_MAX));
    let mut rows = space.rows.clone();
    for (row, found) in rows.iter_mut().zip(realisable) {
        for (index, road) in space.roads.iter().enumerate() {
            if found[index] == Realised::Never && matches!(row.roads[index], Reach::Open(_)) {
                row.roads[index] = dead(space, &space.rows[row.index], road, &in_force, &left);
            }
        }
    }
    rows
}

/// A row without values on a road, and the rules that leave it none.
fn dead(space: &Space, row: &Row, road: &Road, in_force: &RulesInForce, left: &Left) -> Reach {
    let mut conflict = in_force.clone();
    for rule in in_force.on_row(row) {
        let fewer = conflict.except(rule);
        let rules = RowRules { space, row, road: Some(&road.facts), in_force: &fewer };
        let search = Search { rules, left };
        if search.memories().0.iter().all(|memory| search.at(memory) == Found::Never) {
            conflict = fewer;
        }
    }
    let rules: Vec<usize> = conflict.on_row(row).collect();
    let names: Vec<&str> = rules.iter().map(|rule| space.rules[*rule].name.as_str()).collect();
    let reason = match names.as_slice() {
        [] => "its own ranges and conditions leave no value".to_owned(),
        names => format!("no values obey {} (road `{}`)", listed(names), road.name),
    };
    Reach::Dead { rules, reason }
}

/// The rows of a space on one of its roads.
struct OnRoad<'a> {
    space: &'a Space,
    road: &'a Road,
    in_force: &'a RulesInForce,
    left: &'a Left,
}

impl<'a> OnRoad<'a> {
    fn search(&self, row: &'a Row) -> Search<'a> {
        let OnRoad { space, road, in_force, left } = *self;
        Search { rules: RowRules { space, row, road: Some(&road.facts), in_force }, left }
    }

    /// What is found of each row.
    fn rows(&self, index: usize) -> Vec<Realised> {
        let rows = &self.space.rows;
        let mut found: Vec<Realised> = rows
            .iter()
            .map(|row| match row.roads[index] {
                Reach::Dead { .. } => Realised::Never,
                Reach::Open(_) => Realised::NotSearched,
            })
            .collect();
        let mut pending: Vec<&Row> =
            rows.iter().filter(|row| found[row.index] == Realised::NotSearched).collect();
        let (mut states, mut is_complete) = self.space.initial_memories(self.road, self.in_force, STATES_MAX);
        let mut next = 0;
        while next < states.len() && !pending.is_empty() && !self.left.is_spent() {
            let state = states[next].clone();
            next += 1;
            pending.retain(|row| {
                // A row that depends on no state was searched for already.
                if next > 1 && !self.depends_on_states(row) || self.left.is_spent() {
                    return true;
                }
                let runs = matches!(self.search(row).at(&state), Found::Runs(_));
                if runs {
                    found[row.index] = Realised::Runs;
                }
                !runs
            });
            if !pending.iter().any(|row| self.depends_on_states(row)) {
                break;
            }
            let waited = self.space.memory_after_wait(&state, None, Some(&self.road.facts), self.in_force);
            match states.len() < STATES_MAX {
                _ if states.contains(&waited) => {}
                true => states.push(waited),
                false => is_complete = false,
            }
            for row in rows.iter().filter(|row| !matches!(row.roads[index], Reach::Dead { .. })) {
                let (led_to, are_all) = self.search(row).successors(&state);
                is_complete &= are_all;
                for after in led_to {
                    match states.len() < STATES_MAX {
                        _ if states.contains(&after) => {}
                        true => states.push(after),
                        false => is_complete = false,
                    }
                }
            }
        }
        is_complete &= next == states.len();
        for row in pending {
            found[row.index] = self.elsewhere(row, is_complete);
        }
        found
    }

    /// What there is of a row that did not run in any state that was followed.
    fn elsewhere(&self, row: &Row, is_complete: bool) -> Realised {
        let search = self.search(row);
        let (memories, are_all) = match self.depends_on_states(row) {
            true => search.memories(),
            false => (vec![self.space.initial_memory(0)], true),
        };
        let mut is_proved = are_all || is_complete;
        for memory in &memories {
            if self.left.is_spent() {
                return Realised::NotSearched;
            }
            match search.at(memory) {
                _ if self.left.is_spent() => return Realised::NotSearched,
                Found::Runs(_) if is_complete => return Realised::Unreached,
                Found::Runs(_) => return Realised::Elsewhere,
                Found::Never => {}
                Found::Unknown => is_proved = false,
            }
        }
        match is_proved {
            true => Realised::Never,
            false => Realised::Unknown,
        }
    }

    fn depends_on_states(&self, row: &Row) -> bool {
        let search = self.search(row);
        let cells = |state: &StateDef| (0..state.cells).any(|cell| search.reads(state, cell));
        self.space.states.iter().any(cells)
    }
}
