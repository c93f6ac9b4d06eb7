//! Which rows run on which road, in the states to which an episode comes.
//!
//! A row is searched for in the states in which an episode begins. Then the search follows rows and time step by step,
//! until every row has run once or the episode is over. Rows that never ran are searched for in other states and at other
//! times.

use std::collections::BTreeSet;

use crate::model::expr::ExprKind;
use crate::model::rules::RowRules;
use crate::model::vocabulary::Fact;
use crate::model::{Memory, Reach, Road, Row, RulesInForce, Space, Value, effort};
use crate::prove::enclose::Values;
use crate::prove::lists::{product, rule_names};
use crate::prove::moment::Case;
use crate::prove::reach::declared;
use crate::prove::witness::{Found, Left, Search, points};

/// The most boxes of ranges that the searches of all rows look at; most rows need one for each road.
const BOXES_MAX: usize = 20_000;
/// The most states that are followed from step to step on one road, beside those to which time alone leads.
const STATES_MAX: usize = 256;

/// The finding about a row on a road.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Realised {
    /// It runs in a state in which a step of an episode may begin, at its time.
    Runs,
    /// It runs, but not in a state in which a step begins, at its time.
    Unreached,
    /// It runs, but in no state and at no time of which that was found out.
    Elsewhere,
    /// There are no values that obey its rules.
    Never,
    /// There may be values, but none were found.
    Unknown,
    /// The boxes were spent before.
    NotSearched,
}

/// The findings about every row on every road, by row and road.
pub type Realisable = Vec<Vec<Realised>>;

/// The states in which rows were found to run.
#[derive(Debug, Clone, Default)]
pub struct RunsIn {
    /// By road.
    states: Vec<Vec<Memory>>,
    /// By row and road: a position among the states of the road.
    found: Vec<Vec<Option<usize>>>,
}

impl RunsIn {
    /// The number of a state in which a step begins on the road, and the row runs; `None` if none was found.
    pub fn state_of(&self, row: usize, road: usize) -> Option<usize> {
        *self.found.get(row)?.get(road)?
    }

    /// The state of a road with that number.
    pub fn state(&self, road: usize, number: usize) -> &Memory {
        &self.states[road][number]
    }
}

/// Searches for values of every row on every road.
pub fn realise(space: &Space) -> (Realisable, RunsIn) {
    let left = Left::new(BOXES_MAX);
    let in_force = RulesInForce::by_default(space);
    let mut realisable = vec![vec![Realised::Never; space.roads.len()]; space.rows.len()];
    let found = vec![vec![None; space.roads.len()]; space.rows.len()];
    let mut runs_in = RunsIn { states: Vec::new(), found };
    let begun = space.initial_memory(0);
    let of_the_moment = space.cells_of_the_moment();
    for (index, road) in space.roads.iter().enumerate() {
        let on_road = OnRoad {
            space,
            road,
            in_force: &in_force,
            left: &left,
            begun: &begun,
            of_the_moment: &of_the_moment,
        };
        on_road.rows(index, &mut realisable, &mut runs_in);
    }
    (realisable, runs_in)
}

/// Marks the rows as dead for which no values exist.
pub(crate) fn mark_dead(space: &mut Space, realisable: &Realisable) {
    let (in_force, left) = (RulesInForce::by_default(space), Left::new(BOXES_MAX));
    let mut found: Vec<(usize, usize, Reach)> = Vec::new();
    for (row, realised) in space.rows.iter().zip(realisable) {
        for (index, road) in space.roads.iter().enumerate() {
            if realised[index] == Realised::Never && matches!(row.roads[index], Reach::Open(_)) {
                found.push((row.index, index, dead(space, row, road, &in_force, &left)));
            }
        }
    }
    for (row, road, reach) in found {
        space.rows[row].roads[road] = reach;
    }
}

/// A row without values on a road, and the rules that leave it none.
fn dead(space: &Space, row: &Row, road: &Road, in_force: &RulesInForce, left: &Left) -> Reach {
    let on_row = RowRules { space, row, road: Some(&road.facts), in_force };
    let rules = on_row.conflict(&|fewer| {
        let search = Search { rules: fewer, left, moment: None };
        search.memories().0.iter().all(|memory| search.at(memory) == Found::Never)
    });
    let search = Search { rules: on_row, left, moment: None };
    let place = match search.reads_any() {
        true => " in states to which an episode comes in time",
        false => "",
    };
    let reason = match rules.is_empty() {
        true => "its own ranges and conditions leave no value".to_owned(),
        false => format!("no values obey {}{place} (road `{}`)", rule_names(space, &rules), road.name),
    };
    Reach::Dead { rules, reason }
}

/// The rows of a space on one of its roads.
struct OnRoad<'a> {
    space: &'a Space,
    road: &'a Road,
    in_force: &'a RulesInForce,
    left: &'a Left,
    /// The states as they are declared, for rows that no state decides.
    begun: &'a Memory,
    /// The cells that the moment decides. No search knows them, so what it finds impossible there is not proved.
    of_the_moment: &'a BTreeSet<usize>,
}

impl<'a> OnRoad<'a> {
    fn is_of_the_moment(&self, row: &Row) -> bool {
        let OnRoad { space, road, in_force, of_the_moment, .. } = *self;
        RowRules { space, row, road: Some(&road.facts), in_force }.reads_any_of(of_the_moment)
    }

    /// A memory after a step, with each value that the moment may give to what it decides: `after` has all that may be.
    /// Numbers stay as they are.
    fn at_any_moment(&self, memory: &Memory, after: impl Fn() -> Vec<Values>) -> Vec<Memory> {
        let mut found = vec![memory.clone()];
        if self.of_the_moment.is_empty() {
            return found;
        }
        let after = after();
        for cell in self.of_the_moment {
            let ty = self.space.state_of(*cell).ty;
            let literals: Vec<Value> =
                after[*cell].each().into_iter().filter_map(|one| one.value(ty)).collect();
            if !literals.is_empty() && found.len() * literals.len() <= STATES_MAX {
                found = product(&found, &literals, |memory, value| memory.cells[*cell] = value);
            }
        }
        found
    }

    /// A search for values of a row, at a moment of which that is known.
    fn search<'s>(&'s self, row: &'s Row, moment: Option<&'s Case>) -> Search<'s> {
        let OnRoad { space, road, in_force, left, .. } = *self;
        Search { rules: RowRules { space, row, road: Some(&road.facts), in_force }, left, moment }
    }

    fn asked(&self, row: &'a Row) -> Asked<'a> {
        let search = self.search(row, None);
        Asked {
            row,
            about_states: search.reads_any(),
            about_time: is_about_time(search.rules),
            is_undecided: false,
        }
    }

    /// Whether a row may run in some state at that moment.
    fn is_in_time(&self, asked: &Asked<'_>, moment: &Case) -> bool {
        !asked.about_time || self.search(asked.row, Some(moment)).may_run(&self.space.cells_unknown())
    }

    /// Writes down what is found of each row that is not dead on the road, whose index is given.
    fn rows(&self, index: usize, realisable: &mut Realisable, runs_in: &mut RunsIn) {
        let is_open = |row: &&Row| matches!(row.roads[index], Reach::Open(_));
        let open: Vec<Asked<'_>> =
            self.space.rows.iter().filter(is_open).map(|row| self.asked(row)).collect();
        let sets = |asked: &&Asked<'_>| self.space.actions[asked.row.action].sets().next().is_some();
        let movers: Vec<Asked<'_>> = open.iter().filter(sets).copied().collect();
        let mut pending = open;
        let mut way = Way::begin(self, movers.len());
        for step in 0..u64::from(self.space.episode.step_limit) {
            let moment = Case::of_steps(&self.space.episode, step..=step, false);
            pending.retain_mut(|asked| {
                if effort::is_spent() {
                    return true;
                }
                let state = way.runs(self, asked, step, &moment);
                if state.is_some() {
                    realisable[asked.row.index][index] = Realised::Runs;
                    runs_in.found[asked.row.index][index] = state;
                }
                state.is_none()
            });
            if effort::is_spent()
                || self.left.is_spent()
                || !pending.iter().any(|asked| asked.about_states || asked.about_time)
            {
                break;
            }
            let is_at_rest = !way.go_on(self, &movers, step, &moment);
            if is_at_rest && !pending.iter().any(|asked| asked.about_time) {
                break;
            }
        }
        for asked in pending {
            realisable[asked.row.index][index] = self.elsewhere(&asked, way.is_complete);
        }
        runs_in.states.push(way.states.into_iter().map(|met| met.memory).collect());
    }

    /// How a row is classed that ran in no state that was followed.
    fn elsewhere(&self, asked: &Asked<'a>, is_way_complete: bool) -> Realised {
        if effort::is_spent() {
            return Realised::NotSearched;
        }
        let search = self.search(asked.row, None);
        let (made, are_all) = if asked.about_states { search.memories() } else { (Vec::new(), true) };
        let memories = if asked.about_states { &made[..] } else { core::slice::from_ref(self.begun) };
        let is_complete = !asked.is_undecided && (is_way_complete || !asked.about_states);
        let mut is_proved = are_all || is_complete;
        for memory in memories {
            if effort::is_spent() || self.left.is_spent() {
                return Realised::NotSearched;
            }
            match search.at(memory) {
                _ if self.left.is_spent() => return Realised::NotSearched,
                Found::Runs(_) if is_complete && !self.is_of_the_moment(asked.row) => {
                    return Realised::Unreached;
                }
                Found::Runs(_) => return Realised::Elsewhere,
                Found::Never => {}
                Found::Unknown => is_proved = false,
            }
        }
        match (is_proved, is_complete) {
            // Facts of the moment may be as the rules want them.
            _ if self.is_of_the_moment(asked.row) => Realised::Elsewhere,
            (true, _) => Realised::Never,
            (false, true) => Realised::Unreached,
            (false, false) => Realised::Unknown,
        }
    }
}

/// Whether a rule on a row asks for the time.
pub(super) fn is_about_time(rules: RowRules<'_>) -> bool {
    let is_time = |kind: &ExprKind| matches!(kind, ExprKind::Fact(Fact::Elapsed | Fact::StepNumber));
    rules.conditions().iter().any(|condition| condition.any(is_time))
}

/// A row, and on what it depends whether it runs.
#[derive(Clone, Copy)]
struct Asked<'a> {
    row: &'a Row,
    about_states: bool,
    about_time: bool,
    /// Whether in some state and step neither values were found nor a proof that there are none.
    is_undecided: bool,
}

/// The states to which episodes come, step by step.
struct Way {
    states: Vec<Met>,
    /// The states in which the step may begin.
    now: BTreeSet<usize>,
    /// Whether no state was left out.
    is_complete: bool,
    /// The number of rows that set states.
    movers: usize,
}

/// A state that was met.
struct Met {
    memory: Memory,
    /// Digest of `memory`. It spares a look at all cells, because most states differ in it.
    digest: u64,
    since: u64,
    /// Whether the first start comes here without an action. Such states are followed however many others there are.
    is_waited_for: bool,
    /// The states to which rows that do not ask for the time lead from here.
    led_to: BTreeSet<usize>,
    /// The rows, by position, that were not tried here, or that ask for the time.
    open: Vec<usize>,
}

/// Equal for equal memories (FNV-1a over the cells).
fn digest(memory: &Memory) -> u64 {
    memory
        .cells()
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |digest: u64, cell| (digest ^ cell.bits()).wrapping_mul(0x100_0000_01b3))
}

impl Way {
    fn begin(on_road: &OnRoad<'_>, movers: usize) -> Way {
        let (starts, are_all) = on_road.space.initial_memories(on_road.road, on_road.in_force, STATES_MAX);
        let mut way = Way { states: Vec::new(), now: BTreeSet::new(), is_complete: are_all, movers };
        for (nth, start) in starts.into_iter().enumerate() {
            let start = way.number(start, 0, nth == 0);
            way.now.extend(start);
        }
        way
    }

    /// The number of a state; `None` if there are too many.
    fn number(&mut self, memory: Memory, since: u64, is_waited_for: bool) -> Option<usize> {
        effort::spend(self.states.len() + memory.cells().len());
        let digest = digest(&memory);
        let is_it = |known: &Met| known.digest == digest && known.memory == memory;
        if let Some(known) = self.states.iter().position(is_it) {
            self.states[known].is_waited_for |= is_waited_for;
            return Some(known);
        }
        if self.states.len() >= STATES_MAX && !is_waited_for {
            self.is_complete = false;
            return None;
        }
        effort::spend(self.movers);
        let open = (0..self.movers).collect();
        self.states.push(Met { memory, digest, since, is_waited_for, led_to: BTreeSet::new(), open });
        Some(self.states.len() - 1)
    }

    /// A state in which the step begins and a row runs, as far as it was not asked before.
    fn runs(&self, on_road: &OnRoad<'_>, asked: &mut Asked<'_>, step: u64, moment: &Case) -> Option<usize> {
        if !on_road.is_in_time(asked, moment) {
            return None;
        }
        let search = on_road.search(asked.row, asked.about_time.then_some(moment));
        effort::spend(self.now.len());
        for (nth, number) in self.now.iter().enumerate() {
            let state = &self.states[*number];
            let is_due = match (asked.about_states, asked.about_time) {
                (true, true) => true,
                (true, false) => state.since == step,
                (false, true) => nth == 0,
                (false, false) => nth == 0 && step == 0,
            };
            if !is_due {
                continue;
            }
            if on_road.left.is_spent() {
                return None;
            }
            match search.at(&state.memory) {
                Found::Runs(_) => return Some(*number),
                Found::Never => {}
                Found::Unknown => asked.is_undecided = true,
            }
        }
        None
    }

    /// Goes on to the states in which the next step begins. Gives whether they are others, or may be later.
    fn go_on(&mut self, on_road: &OnRoad<'_>, movers: &[Asked<'_>], step: u64, moment: &Case) -> bool {
        let OnRoad { space, road, in_force, .. } = *on_road;
        effort::spend(movers.len());
        let in_time: Vec<bool> = movers.iter().map(|mover| on_road.is_in_time(mover, moment)).collect();
        let now = core::mem::take(&mut self.now);
        for state in &now {
            let Met { memory, is_waited_for, .. } = &self.states[*state];
            let (memory, is_waited_for) = (memory.clone(), *is_waited_for);
            let waited = space.memory_after_wait(&memory, step, Some(&road.facts), None, in_force);
            let after = || space.cells_after_wait(&points(memory.cells()));
            for one in on_road.at_any_moment(&waited, after) {
                let may_wait = || space.may_wait(&memory, &one, step, Some(&road.facts), in_force);
                // Where what every step does may not happen, all stays as it was.
                let one = if one == waited || may_wait() { one } else { memory.clone() };
                let number = self.number(one, step + 1, is_waited_for);
                self.now.extend(number);
            }
            for position in core::mem::take(&mut self.states[*state].open) {
                if effort::is_spent() {
                    return false;
                }
                let mover = &movers[position];
                if mover.about_time {
                    self.states[*state].open.push(position);
                }
                if !in_time[position] {
                    continue;
                }
                let search = on_road.search(mover.row, mover.about_time.then_some(moment));
                let (led_to, are_all) = search.successors(&memory);
                self.is_complete &= are_all;
                let after = || {
                    space.cells_after(mover.row.action, &declared(space, mover.row), &points(memory.cells()))
                };
                let led_to: Vec<Memory> =
                    led_to.iter().flat_map(|to| on_road.at_any_moment(to, after)).collect();
                let led_to: Vec<usize> =
                    led_to.into_iter().filter_map(|to| self.number(to, step + 1, false)).collect();
                match mover.about_time {
                    true => self.now.extend(led_to),
                    false => self.states[*state].led_to.extend(led_to),
                }
            }
            self.now.extend(&self.states[*state].led_to);
        }
        self.now != now || now.iter().any(|state| !self.states[*state].open.is_empty())
    }
}
