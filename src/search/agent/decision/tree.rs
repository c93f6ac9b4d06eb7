//! A decision tree over named variables, grown best first by weighted Gini impurity.
//!
//! Thresholds are the shortest decimals that tell the two neighbouring values apart, because people
//! are to read them. Equal gains go to the first variable and the lowest threshold.

use crate::mdp::Observation;
use avastra_lang::model::expr::Comparison;
use avastra_lang::model::policy::{Condition, VARIABLES, VariableKind};

/// A state that was visited, and the network's view of it.
#[derive(Debug, Clone)]
pub struct Visit {
    pub observation: Observation,
    /// Rows that were open, shape `(rows,)`; at least one.
    pub open: Vec<bool>,
    /// Q-values, shape `(rows,)`.
    pub q_values: Vec<f32>,
    /// The open row of the highest Q-value.
    pub best: usize,
}

impl Visit {
    /// How much can be lost here: the highest Q-value less the lowest of the open rows (VIPER, Eq. 4).
    pub fn stake(&self) -> f64 {
        let open = self.q_values.iter().zip(&self.open).filter(|(_, is_open)| **is_open);
        let lowest = open.map(|(&value, _)| f64::from(value)).fold(f64::INFINITY, f64::min);
        f64::from(self.q_values[self.best]) - lowest
    }

    /// The loss from choosing a row: the whole stake if the row is not open, or if no row is chosen.
    pub fn loss(&self, row: Option<usize>) -> f64 {
        match row.filter(|&row| self.open[row]) {
            Some(row) => f64::from(self.q_values[self.best] - self.q_values[row]),
            None => self.stake(),
        }
    }
}

/// A tree whose leaves hold indices: of the visits that come to them, or of the rows that act there.
pub(super) enum Tree {
    Leaf(Vec<usize>),
    /// A condition, the branch where it holds, and the branch where it does not.
    Split(Condition, Box<Tree>, Box<Tree>),
}

/// Limits on the size of a tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub leaves: usize,
    pub depth: usize,
    /// Fewest visits in a leaf.
    pub visits: usize,
}

/// The best split of a leaf.
struct Split {
    gain: f64,
    condition: Condition,
}

/// A node of the tree while it grows.
struct Bud {
    visits: Vec<usize>,
    depth: usize,
    split: Option<Split>,
    /// The split that was made, and the indices of the two buds: condition holds, does not hold.
    children: Option<(Condition, usize, usize)>,
}

/// Grows a tree that tells the visits' best rows apart by these variables.
pub(super) fn grow(visits: &[Visit], variables: &[usize], bounds: Bounds) -> Tree {
    let stakes: Vec<f64> = visits.iter().map(Visit::stake).collect();
    let grower = Grower { visits, stakes, variables, bounds };
    let mut buds = vec![grower.bud((0..visits.len()).collect(), 0)];
    for _ in 1..bounds.leaves {
        // If gains are equal, the first counts.
        let gain = |at: usize| Some((at, buds[at].split.as_ref()?.gain));
        let gains = (0..buds.len()).rev().filter_map(gain);
        let Some((at, _)) = gains.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let Some(split) = buds[at].split.take() else { break };
        let (inside, outside): (Vec<usize>, Vec<usize>) =
            buds[at].visits.iter().partition(|&&visit| holds(&split.condition, &visits[visit].observation));
        let depth = buds[at].depth + 1;
        buds.push(grower.bud(inside, depth));
        buds.push(grower.bud(outside, depth));
        buds[at].children = Some((split.condition, buds.len() - 2, buds.len() - 1));
    }
    tree(&mut buds, 0)
}

fn tree(buds: &mut [Bud], at: usize) -> Tree {
    match buds[at].children {
        None => Tree::Leaf(std::mem::take(&mut buds[at].visits)),
        Some((condition, inside, outside)) => {
            Tree::Split(condition, Box::new(tree(buds, inside)), Box::new(tree(buds, outside)))
        }
    }
}

/// Whether a condition holds of an observation.
pub(super) fn holds(condition: &Condition, observation: &Observation) -> bool {
    condition.comparison.holds(f64::from(observation.get(condition.variable)), condition.value)
}

struct Grower<'a> {
    visits: &'a [Visit],
    /// Stake of each visit.
    stakes: Vec<f64>,
    variables: &'a [usize],
    bounds: Bounds,
}

impl Grower<'_> {
    fn bud(&self, visits: Vec<usize>, depth: usize) -> Bud {
        let may_split = depth < self.bounds.depth && visits.len() >= 2 * self.bounds.visits;
        let split = if may_split { self.split(&visits) } else { None };
        Bud { visits, depth, split, children: None }
    }

    /// The split that makes the visits purest.
    fn split(&self, visits: &[usize]) -> Option<Split> {
        let mut best: Option<Split> = None;
        let mut keep = |gain: f64, condition: Condition| {
            if gain > 1e-12 && best.as_ref().is_none_or(|best| gain > best.gain) {
                best = Some(Split { gain, condition });
            }
        };
        for &variable in self.variables {
            let mut sorted: Vec<(f32, usize)> =
                visits.iter().map(|&visit| (self.visits[visit].observation.get(variable), visit)).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            match VARIABLES[variable].kind {
                VariableKind::Words { words, ordered: false } => {
                    for &(_, value) in words {
                        let condition =
                            Condition { variable, comparison: Comparison::Equal, value: f64::from(value) };
                        let first = sorted.partition_point(|(other, _)| *other < value);
                        let end = sorted.partition_point(|(other, _)| *other <= value);
                        if let Some(gain) = self.gain_of(&sorted, first..end) {
                            keep(gain, condition);
                        }
                    }
                }
                VariableKind::Words { ordered: true, .. } => {
                    self.thresholds(&sorted, |low, _, gain| {
                        let (comparison, value) = (Comparison::LessEqual, f64::from(low));
                        keep(gain, Condition { variable, comparison, value });
                    });
                }
                VariableKind::Quantity { .. } => self.thresholds(&sorted, |low, high, gain| {
                    let (comparison, value) = (Comparison::LessEqual, shortest(low, high));
                    keep(gain, Condition { variable, comparison, value });
                }),
            }
        }
        best
    }

    /// The gain of separating a range of the visits from the others; `None` if a side has too few visits.
    fn gain_of(&self, sorted: &[(f32, usize)], inside: core::ops::Range<usize>) -> Option<f64> {
        let count = inside.len();
        if count < self.bounds.visits || sorted.len() - count < self.bounds.visits {
            return None;
        }
        let (mut within, mut without) = (Weights::default(), Weights::default());
        for (at, (_, visit)) in sorted.iter().enumerate() {
            let side = if inside.contains(&at) { &mut within } else { &mut without };
            side.add(self.visits[*visit].best, self.stakes[*visit]);
        }
        let mut whole = Weights::default();
        sorted.iter().for_each(|(_, visit)| whole.add(self.visits[*visit].best, self.stakes[*visit]));
        Some(whole.impurity() - within.impurity() - without.impurity())
    }

    /// Calls `found` for every pair of neighbouring values, with the gain of splitting between them.
    fn thresholds(&self, sorted: &[(f32, usize)], mut found: impl FnMut(f32, f32, f64)) {
        let (mut below, mut above) = (Weights::default(), Weights::default());
        sorted.iter().for_each(|(_, visit)| above.add(self.visits[*visit].best, self.stakes[*visit]));
        let whole = above.impurity();
        for (at, pair) in sorted.windows(2).enumerate() {
            let (low, visit) = pair[0];
            below.add(self.visits[visit].best, self.stakes[visit]);
            above.add(self.visits[visit].best, -self.stakes[visit]);
            let fits = at + 1 >= self.bounds.visits && sorted.len() - at > self.bounds.visits;
            if fits && low < pair[1].0 {
                found(low, pair[1].0, whole - below.impurity() - above.impurity());
            }
        }
    }
}

/// Weight of each row among some visits.
#[derive(Default)]
struct Weights {
    of_row: Vec<f64>,
    sum: f64,
    squares: f64,
}

impl Weights {
    fn add(&mut self, row: usize, weight: f64) {
        if row >= self.of_row.len() {
            self.of_row.resize(row + 1, 0.0);
        }
        let before = self.of_row[row];
        self.of_row[row] += weight;
        self.sum += weight;
        self.squares += self.of_row[row] * self.of_row[row] - before * before;
    }

    /// Gini impurity times weight.
    fn impurity(&self) -> f64 {
        if self.sum > 0.0 { self.sum - self.squares / self.sum } else { 0.0 }
    }
}

/// The decimal with the fewest places in `[low, high)`, the one nearest to the middle of those.
fn shortest(low: f32, high: f32) -> f64 {
    let (low, high) = (f64::from(low), f64::from(high));
    let middle = low + (high - low) / 2.0;
    let mut scale = 1.0;
    for _ in 0..9 {
        let (least, most) = ((low * scale).ceil(), (high * scale).ceil() - 1.0);
        let rounded = (middle * scale).round().min(most).max(least) / scale;
        if rounded >= low && rounded < high {
            return rounded;
        }
        scale *= 10.0;
    }
    // Neighbours that no nine places tell apart: the lower one itself.
    low
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use avastra_lang::model::policy::variable_index;

    pub fn visit(speed_mps: f32, hour: f32, best: usize, stake: f32) -> Visit {
        let mut observation = Observation::zeros();
        observation.state[18] = speed_mps;
        observation.state[1] = hour;
        let mut q_values = vec![0.0; 3];
        q_values[best] = stake;
        Visit { observation, open: vec![true; 3], q_values, best }
    }

    #[test]
    fn thresholds_are_short_and_in_between() {
        assert_eq!(shortest(8.13, 8.31), 8.2);
        assert_eq!(shortest(3.0, 4.0), 3.0);
        assert_eq!(shortest(-0.26, -0.24), -0.25);
        let (low, high) = (1.0_f32, f32::from_bits(1.0_f32.to_bits() + 1));
        assert!(shortest(low, high) >= f64::from(low) && shortest(low, high) < f64::from(high));
    }

    #[test]
    fn dear_mistakes_decide_the_first_split() {
        // Speed tells rows 0 and 1 apart, where a mistake costs much; the hour rows 1 and 2, where it costs little.
        let mut visits = Vec::new();
        for at in 0..40 {
            let (fast, night) = (at % 2 == 0, at % 4 < 2);
            let speed_mps = if fast { 9.0 } else { 2.0 } + at as f32 * 0.01;
            let (best, stake) = if fast { (0, 10.0) } else { (1 + usize::from(night), 1.0) };
            visits.push(visit(speed_mps, if night { 20.0 } else { 10.0 }, best, stake));
        }
        let variables = [variable_index("time").unwrap(), variable_index("ego_speed").unwrap()];
        let bounds = Bounds { leaves: 3, depth: 3, visits: 2 };
        let Tree::Split(first, slow, _) = grow(&visits, &variables, bounds) else { panic!("it splits") };
        assert_eq!((first.variable, first.value), (variables[1], 6.0));
        let Tree::Split(second, _, _) = *slow else { panic!("the slow side splits again") };
        assert_eq!(second.variable, variables[0]);
    }
}
