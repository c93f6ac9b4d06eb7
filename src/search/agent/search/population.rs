//! Populations of scripts, and AV-Fuzzer's operators on them.

use std::collections::BTreeSet;

use avastra_base::rng;
use avastra_base::rng::Rng;

use super::genes::{Gene, seed};

/// A script and how good it is.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Individual {
    pub genes: Vec<Gene>,
    /// At least 0; 0 until it has been played.
    pub fitness: f64,
}

impl Individual {
    pub fn random(steps: usize, rows: usize, rng: &mut Rng) -> Individual {
        Individual { genes: (0..steps).map(|_| Gene::random(rows, rng)).collect(), fitness: 0.0 }
    }

    pub fn rows(&self) -> Vec<u32> {
        self.genes.iter().map(|gene| gene.row).collect()
    }

    /// The gene of a step; a script begins anew after its end. `None` if the script is empty.
    pub fn gene(&mut self, step: usize) -> Option<&mut Gene> {
        let at = step.checked_rem(self.genes.len())?;
        Some(&mut self.genes[at])
    }

    /// A new draw or a new row at one step, each as likely.
    pub fn change(&mut self, rows: usize, rng: &mut Rng) {
        let at = rng::below(rng, self.genes.len() as u32) as usize;
        if rng::below(rng, 2) == 0 {
            self.genes[at].draw_seed = seed(rng);
        } else {
            self.genes[at] = Gene::random(rows, rng);
        }
    }

    /// Whether it has `steps` steps, with rows below `rows`.
    pub fn is_sound(&self, steps: usize, rows: usize) -> bool {
        self.genes.len() == steps && self.genes.iter().all(|gene| (gene.row as usize) < rows)
    }
}

/// Scripts of one length.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Population {
    pub individuals: Vec<Individual>,
}

impl Population {
    pub fn random(size: usize, steps: usize, rows: usize, rng: &mut Rng) -> Population {
        Population { individuals: (0..size).map(|_| Individual::random(steps, rows, rng)).collect() }
    }

    /// Copies of one script, each with one change.
    pub fn around(one: &Individual, size: usize, rows: usize, rng: &mut Rng) -> Population {
        let mut copy = || {
            let mut copy = one.clone();
            copy.change(rows, rng);
            copy
        };
        Population { individuals: (0..size).map(|_| copy()).collect() }
    }

    /// The indices of all individuals, the last first.
    pub fn all(&self) -> Vec<usize> {
        (0..self.individuals.len()).rev().collect()
    }

    pub fn best(&self) -> &Individual {
        &self.individuals[self.best_index()]
    }

    pub fn best_mut(&mut self) -> &mut Individual {
        let index = self.best_index();
        &mut self.individuals[index]
    }

    /// The first of the fittest.
    fn best_index(&self) -> usize {
        let fitness = |index: usize| self.individuals[index].fitness;
        (0..self.individuals.len())
            .fold(0, |best, index| if fitness(index) > fitness(best) { index } else { best })
    }

    /// The next generation: selected, crossed and mutated with these probabilities. Gives the indices of the changed ones.
    pub fn breed(&mut self, crossover: f64, mutation: f64, rows: usize, rng: &mut Rng) -> Vec<usize> {
        self.select(rng);
        let mut touched = self.cross(crossover, rng);
        touched.extend(self.mutate(mutation, rows, rng));
        touched.into_iter().collect()
    }

    /// Roulette: as many as there are, each drawn with a probability in proportion to its fitness.
    fn select(&mut self, rng: &mut Rng) {
        // Published code: every individual has some chance.
        let weights: Vec<f64> = self.individuals.iter().map(|one| one.fitness.max(0.001)).collect();
        let total: f64 = weights.iter().sum();
        let mut draw = || {
            let mut mass = rng::unit(rng) * total;
            for (index, weight) in weights.iter().enumerate() {
                if mass < *weight {
                    return self.individuals[index].clone();
                }
                mass -= weight;
            }
            self.individuals[weights.len() - 1].clone()
        };
        self.individuals = (0..weights.len()).map(|_| draw()).collect();
    }

    /// Crossover: in half as many tries as there are individuals, with a probability, swaps the gene of one
    /// step between two of them. Gives the indices of the changed ones.
    fn cross(&mut self, probability: f64, rng: &mut Rng) -> BTreeSet<usize> {
        let mut touched = BTreeSet::new();
        let size = self.individuals.len() as u32;
        for _ in 0..size / 2 {
            if rng::unit(rng) >= probability {
                continue;
            }
            let first = rng::below(rng, size);
            let second = (first + 1 + rng::below(rng, size - 1)) % size;
            let (first, second) = (first as usize, second as usize);
            let at = rng::below(rng, self.individuals[first].genes.len() as u32) as usize;
            let gene = self.individuals[first].genes[at];
            self.individuals[first].genes[at] = self.individuals[second].genes[at];
            self.individuals[second].genes[at] = gene;
            touched.extend([first, second]);
        }
        touched
    }

    /// Mutation: changes each individual with two thirds of a probability (published code). Gives the indices
    /// of the changed ones.
    fn mutate(&mut self, probability: f64, rows: usize, rng: &mut Rng) -> BTreeSet<usize> {
        let mut touched = BTreeSet::new();
        for (index, individual) in self.individuals.iter_mut().enumerate() {
            if rng::unit(rng) < probability && rng::below(rng, 3) < 2 {
                individual.change(rows, rng);
                touched.insert(index);
            }
        }
        touched
    }

    /// The individuals whose rows differ most from former scripts, on average.
    pub fn least_like(self, former: &[Vec<u32>], size: usize) -> Population {
        let alike = |individual: &Individual| -> usize {
            let same = |rows: &Vec<u32>| {
                individual.genes.iter().zip(rows).filter(|(gene, row)| gene.row == **row).count()
            };
            former.iter().map(same).sum()
        };
        let mut ranked: Vec<(usize, Individual)> =
            self.individuals.into_iter().map(|individual| (alike(&individual), individual)).collect();
        ranked.sort_by_key(|(alike, _)| *alike);
        ranked.truncate(size);
        Population { individuals: ranked.into_iter().map(|(_, individual)| individual).collect() }
    }

    /// Whether it has `size` scripts of `steps` steps, with rows below `rows`.
    pub fn is_sound(&self, size: usize, steps: usize, rows: usize) -> bool {
        self.individuals.len() == size && self.individuals.iter().all(|one| one.is_sound(steps, rows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng::{Stream, stream};

    #[test]
    fn operators_keep_scripts_whole_and_say_what_they_change() {
        let mut rng = stream(1, Stream::Search, 0);
        let mut population = Population::random(6, 8, 45, &mut rng);
        for _ in 0..50 {
            let before = population.clone();
            let mut touched = population.cross(0.4, &mut rng);
            touched.extend(population.mutate(0.4, 45, &mut rng));
            assert!(population.is_sound(6, 8, 45));
            for index in (0..6).filter(|index| !touched.contains(index)) {
                assert_eq!(population.individuals[index], before.individuals[index]);
            }
        }
        let mut genes: Vec<Gene> = population.individuals.iter().flat_map(|one| one.genes.clone()).collect();
        population.cross(1.0, &mut rng);
        let mut crossed: Vec<Gene> =
            population.individuals.iter().flat_map(|one| one.genes.clone()).collect();
        genes.sort_by_key(|gene| (gene.draw_seed, gene.row));
        crossed.sort_by_key(|gene| (gene.draw_seed, gene.row));
        assert_eq!(genes, crossed, "crossover makes nothing up");
    }

    #[test]
    fn the_fit_are_drawn_in_proportion() {
        let mut rng = stream(2, Stream::Search, 0);
        let mut population = Population::random(4, 2, 45, &mut rng);
        for (individual, fitness) in population.individuals.iter_mut().zip([0.0, 10.0, 20.0, 70.0]) {
            individual.fitness = fitness;
        }
        assert_eq!(population.best().fitness, 70.0);
        let mut seen = [0; 4];
        for _ in 0..1000 {
            let mut selected = population.clone();
            selected.select(&mut rng);
            for one in selected.individuals {
                seen[[0.0, 10.0, 20.0, 70.0].iter().position(|fitness| *fitness == one.fitness).unwrap()] +=
                    1;
            }
        }
        assert!(seen[0] < 5 && (330..470).contains(&seen[1]) && (2700..2900).contains(&seen[3]), "{seen:?}");
    }

    #[test]
    fn a_restart_takes_what_is_new() {
        let mut rng = stream(3, Stream::Search, 0);
        let candidates = Population::random(200, 10, 3, &mut rng);
        let former = vec![vec![0; 10], vec![1; 10]];
        let chosen = candidates.least_like(&former, 4);
        let old = chosen.individuals.iter().flat_map(Individual::rows).filter(|&row| row < 2).count();
        assert!(chosen.individuals.len() == 4 && old < 20, "{old} of 40 are old rows");
    }
}
