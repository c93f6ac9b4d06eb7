//! A decision tree becomes a list of rules, of which the first that applies acts.
//!
//! A split becomes two lines: the smaller branch with its test, then the other without one. A leaf becomes a
//! list of rows, because the variables do not tell which rows are legal. First comes the row that most of the
//! stake wants, then the row that most of the stake wants where the first is not open, and so on.

use crate::agent::checked::{SettingsError, require, within};
use crate::mdp::Observation;
use avastra_lang::model::expr::Comparison;
use avastra_lang::model::policy::{Condition, PolicyRule, variable_index};

use super::tree::{Bounds, Tree, Visit, grow, holds};

/// Most rows of a line, besides one that is always open. Ours.
const ALTERNATIVES_MAX: usize = 4;
/// A leaf holds at least this share of the visits. Ours: less is noise.
const LEAF_SHARE_MIN: f64 = 0.005;

/// The first open row of the first line whose conditions hold; `None` if that line has no open row.
pub fn chosen_by(rules: &[PolicyRule], observation: &Observation, open: &[bool]) -> Option<usize> {
    let applies = |rule: &&PolicyRule| rule.conditions.iter().all(|condition| holds(condition, observation));
    let rule = rules.iter().find(applies)?;
    rule.rows.iter().copied().find(|&row| open[row])
}

/// The readable rules that are distilled from the network at the end (VIPER, Bastani et al., 2018). The
/// numbers are ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RulesSettings {
    /// Most leaves of the decision tree, and so lines of rules; 0: no rules are distilled.
    pub rules_leaves: usize,
    /// Largest depth of the tree, and so tests in a line.
    pub rules_depth: usize,
    /// Rounds of DAgger: the network drives in the first, the rules of the round before in each later one.
    pub rules_rounds: u32,
    /// Episodes in a round, on each road.
    pub rules_episodes: u32,
}

impl RulesSettings {
    /// # Errors
    /// If a value is out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        require([
            within("rules_leaves", self.rules_leaves, 0..=256, "up to 256"),
            within("rules_depth", self.rules_depth, 1..=32, "from 1 to 32"),
            within("rules_rounds", self.rules_rounds, 1..=1000, "from 1 to 1000"),
            within("rules_episodes", self.rules_episodes, 1..=1000, "from 1 to 1000"),
        ])
    }
}

/// Rules that imitate the visits, with at most `leaves` lines and `depth` tests in a line. There must be a
/// visit.
pub fn distilled(visits: &[Visit], variables: &[usize], leaves: usize, depth: usize) -> Vec<PolicyRule> {
    let fewest = (visits.len() as f64 * LEAF_SHARE_MIN).ceil() as usize;
    let tree = grow(visits, &readable(variables), Bounds { leaves, depth, visits: fewest.max(2) });
    let rows = visits[0].open.len();
    let always: Vec<bool> = (0..rows).map(|row| visits.iter().all(|visit| visit.open[row])).collect();
    let mut rules = lines(&ranked(tree, visits, &always));
    rules.iter_mut().for_each(|rule| simplify(&mut rule.conditions));
    rules
}

/// The variables that a reader understands: `weather` packs three phenomena, which take its place.
fn readable(variables: &[usize]) -> Vec<usize> {
    let index = |name| variable_index(name).expect("it is a variable");
    let (packed, sky) = (index("weather"), ["rain", "fog", "wetness"].map(index));
    let parts = |&variable: &usize| if variable == packed { sky.to_vec() } else { vec![variable] };
    variables.iter().flat_map(parts).collect()
}

/// The tree with rows in place of the visits of each leaf; a split of two leaves with the same rows becomes one
/// leaf.
fn ranked(tree: Tree, visits: &[Visit], always: &[bool]) -> Tree {
    match tree {
        Tree::Leaf(own) => {
            let own: Vec<&Visit> = own.iter().map(|&visit| &visits[visit]).collect();
            Tree::Leaf(alternatives(&own, always))
        }
        Tree::Split(condition, inside, outside) => {
            match (ranked(*inside, visits, always), ranked(*outside, visits, always)) {
                (Tree::Leaf(rows), Tree::Leaf(others)) if rows == others => Tree::Leaf(rows),
                (inside, outside) => Tree::Split(condition, Box::new(inside), Box::new(outside)),
            }
        }
    }
}

/// The rows of a leaf, the one that most of the stake wants first.
fn alternatives(visits: &[&Visit], always: &[bool]) -> Vec<usize> {
    let mut rest = visits.to_vec();
    let mut rows = Vec::new();
    while !rest.is_empty() && rows.len() < ALTERNATIVES_MAX {
        let mut wanted = vec![0.0; always.len()];
        // A visit without stake counts a little: a leaf may hold no other visits.
        rest.iter().for_each(|visit| wanted[visit.best] += visit.stake() + 1e-9);
        let row = first_largest(&wanted);
        rows.push(row);
        rest.retain(|visit| !visit.open[row]);
    }
    if !rows.iter().any(|&row| always[row]) {
        // Where all of these rows are closed, the row acts that costs least of those that are always open.
        let cost = |row: usize| -> f64 { visits.iter().map(|visit| visit.loss(Some(row))).sum() };
        let costs: Vec<f64> =
            (0..always.len()).map(|row| if always[row] { -cost(row) } else { f64::NEG_INFINITY }).collect();
        if always.contains(&true) {
            rows.push(first_largest(&costs));
        }
    }
    rows
}

fn first_largest(values: &[f64]) -> usize {
    (0..values.len()).fold(0, |best, at| if values[at] > values[best] { at } else { best })
}

fn leaves(tree: &Tree) -> usize {
    match tree {
        Tree::Leaf(_) => 1,
        Tree::Split(_, inside, outside) => leaves(inside) + leaves(outside),
    }
}

fn lines(tree: &Tree) -> Vec<PolicyRule> {
    match tree {
        Tree::Leaf(rows) => vec![PolicyRule { conditions: Vec::new(), rows: rows.clone() }],
        Tree::Split(condition, inside, outside) => {
            let (condition, first, second) = match leaves(inside) <= leaves(outside) {
                true => (*condition, inside, outside),
                false => (opposite(condition), outside, inside),
            };
            let mut rules = lines(first);
            rules.iter_mut().for_each(|rule| rule.conditions.insert(0, condition));
            rules.extend(lines(second));
            rules
        }
    }
}

fn opposite(condition: &Condition) -> Condition {
    Condition { comparison: condition.comparison.negated(), ..*condition }
}

/// Leaves out what another test implies: of two tests of a variable in one direction, the later is narrower.
fn simplify(conditions: &mut Vec<Condition>) {
    let is_implied = |at: usize, all: &[Condition]| {
        let this = all[at];
        all[at + 1..].iter().any(|later| {
            later.variable == this.variable
                && (later.comparison == this.comparison && this.comparison != Comparison::NotEqual
                    || later.comparison == Comparison::Equal)
        })
    };
    let kept = (0..conditions.len()).filter(|&at| !is_implied(at, conditions)).map(|at| conditions[at]);
    *conditions = kept.collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::decision::tree::tests::visit;

    #[test]
    fn a_tree_becomes_a_list_that_says_the_same() {
        // Fast: row 0; slow by night: row 2, by day: row 1.
        let wanted = |fast: bool, night: bool| if fast { 0 } else { 1 + usize::from(night) };
        let visits: Vec<Visit> = (0..40)
            .map(|at| {
                let (fast, night) = (at % 2 == 0, at % 4 < 2);
                visit(if fast { 9.0 } else { 2.0 }, if night { 20.0 } else { 14.0 }, wanted(fast, night), 1.0)
            })
            .collect();
        let variables = ["time", "ego_speed"].map(|name| variable_index(name).unwrap());
        let rules = distilled(&visits, &variables, 8, 8);
        assert_eq!(rules.len(), 3);
        assert!(rules[2].conditions.is_empty());
        for visit in &visits {
            assert_eq!(chosen_by(&rules, &visit.observation, &visit.open), Some(visit.best));
            assert_eq!(chosen_by(&rules, &visit.observation, &[false; 3]), None);
        }
    }

    #[test]
    fn where_a_row_is_closed_the_next_acts() {
        let mut visits: Vec<Visit> = (0..20).map(|_| visit(5.0, 14.0, 0, 2.0)).collect();
        for visit in &mut visits[..8] {
            (visit.open[0], visit.best) = (false, 1);
            visit.q_values = vec![2.0, 1.0, 0.5];
        }
        let rules = distilled(&visits, &[variable_index("ego_speed").unwrap()], 4, 4);
        assert_eq!(rules, [PolicyRule { conditions: Vec::new(), rows: vec![0, 1] }]);
        assert_eq!(chosen_by(&rules, &visits[0].observation, &visits[0].open), Some(1));
    }

    #[test]
    fn narrower_tests_replace_wider_ones() {
        let test = |comparison, value| Condition { variable: 18, comparison, value };
        let mut conditions = vec![
            test(Comparison::LessEqual, 9.0),
            test(Comparison::Greater, 1.0),
            test(Comparison::LessEqual, 5.0),
        ];
        simplify(&mut conditions);
        assert_eq!(conditions, [test(Comparison::Greater, 1.0), test(Comparison::LessEqual, 5.0)]);
    }
}
