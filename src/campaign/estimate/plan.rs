//! Which rows are worth trying out, beside the one that chance chooses: what a pilot found, and the shares that follow.
//!
//! A row that chance chooses with probability p, and that is tried out besides with probability π, is seen with
//! probability p + π − pπ. Its events weigh p / (p + π − pπ) (Horvitz and Thompson 1952), which is at most 1. Where
//! nothing is tried out, this is counting. No plan can make the estimate worse than its own cost.
//!
//! If h is the probability of the event after a row, the variance is about the sum of p² h / (p + π). The cost is that of
//! the episode and of all trials. The product is least at π = p (√(h / λ) − 1) with one λ for all rows (Neyman 1934). The
//! pilot estimates h, each figure drawn towards that of its row on all roads and of all rows.

use std::collections::BTreeMap;

use avastra_lang::model::MomentFacts;
use avastra_lang::model::vocabulary::RoadKind;

/// How strongly an estimate for a cell is drawn towards that of its wider class: as if the cell had met this many
/// events more, in as many trials as the wider class needs for them. One lucky event tells little, and a row without
/// events is not safe before enough trials. Ours.
const PRIOR_EVENTS: f64 = 1.0;
/// Below this speed the ego vehicle crawls; above the next one it drives fast, m/s. Ours.
const CRAWLING_MPS_MAX: f64 = 2.0;
const SLOW_MPS_MAX: f64 = 8.0;

/// A row on a road in a class of situations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell {
    pub row: usize,
    /// Index among the roads of the estimate.
    pub road: usize,
    pub situation: Situation,
}

/// A class of situations: the kind of road, and how fast the ego vehicle is. A database keeps the number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Situation(pub(super) u32);

/// A pilot's observations of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seen {
    /// Times that the row was carried out.
    pub trials: u32,
    /// Trials after which the event came, with a road user that the row made appear.
    pub events: u32,
    /// Moments at which the row could have been chosen.
    pub moments: u32,
    /// Sum over these moments of the probability that chance chooses it.
    pub chance: f64,
}

/// A pilot's observations.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pilot {
    pub cells: BTreeMap<Cell, Seen>,
    /// Time of the episodes themselves and of what was tried out beside them, s; and the number of these trials.
    pub whole_s: f64,
    pub tried_s: f64,
    pub tried: u32,
}

/// With which probability a row is tried out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    risks: Risks,
    /// A row whose risk is higher is tried out; `None`: none is.
    threshold: Option<f64>,
    /// Number of trials at each moment that are spread evenly over all rows, whatever their risk. A pilot learns from
    /// these.
    even: f64,
}

/// Probability of the event after a row: by cell, by row, and over all rows. A cell that a pilot has not seen has the
/// probability of its row.
#[derive(Debug, Clone, PartialEq, Default)]
struct Risks {
    of_cells: BTreeMap<Cell, f64>,
    of_rows: BTreeMap<usize, f64>,
    all: f64,
}

impl Situation {
    /// The class of a moment.
    pub fn of(moment: &MomentFacts) -> Situation {
        let road = match moment.ego_road {
            RoadKind::OneWay => 0,
            RoadKind::TwoWay => 1,
            RoadKind::NearJunction => 2,
            RoadKind::InJunction => 3,
        };
        let speed = match moment.ego_speed_mps {
            speed_mps if speed_mps < CRAWLING_MPS_MAX => 0,
            speed_mps if speed_mps < SLOW_MPS_MAX => 1,
            _ => 2,
        };
        Situation(3 * road + speed)
    }
}

/// The weight of an event after a row of this chance that is tried out with probability `share`.
pub fn weight(chance: f64, share: f64) -> f64 {
    if chance <= 0.0 { 0.0 } else { chance / (chance + share - chance * share) }
}

impl Pilot {
    /// Takes another one in.
    pub fn add(&mut self, other: &Pilot) {
        for (cell, seen) in &other.cells {
            let sum = self.cells.entry(*cell).or_default();
            sum.trials += seen.trials;
            sum.events += seen.events;
            sum.moments += seen.moments;
            sum.chance += seen.chance;
        }
        self.whole_s += other.whole_s;
        self.tried_s += other.tried_s;
        self.tried += other.tried;
    }

    /// Probability of the event after each row.
    fn risks(&self) -> Risks {
        let mut of_rows: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
        let mut of_roads: BTreeMap<(usize, usize), [f64; 2]> = BTreeMap::new();
        let mut all = [PRIOR_EVENTS, PRIOR_EVENTS];
        for (cell, seen) in &self.cells {
            for sum in [
                &mut all,
                of_rows.entry(cell.row).or_default(),
                of_roads.entry((cell.row, cell.road)).or_default(),
            ] {
                sum[0] += f64::from(seen.trials);
                sum[1] += f64::from(seen.events);
            }
        }
        let towards = |wider: f64, [trials, events]: [f64; 2]| {
            (events + PRIOR_EVENTS) / (trials + PRIOR_EVENTS / wider)
        };
        let all = all[1] / all[0];
        let of_rows: BTreeMap<usize, f64> =
            of_rows.into_iter().map(|(row, seen)| (row, towards(all, seen))).collect();
        let risk = |(cell, seen): (&Cell, &Seen)| {
            let of_road = towards(of_rows[&cell.row], of_roads[&(cell.row, cell.road)]);
            (*cell, towards(of_road, [f64::from(seen.trials), f64::from(seen.events)]))
        };
        let of_cells = self.cells.iter().map(risk).collect();
        Risks { of_cells, of_rows, all }
    }
}

impl Plan {
    /// A plan that tries every row equally often, `trials` times at each moment on average.
    pub fn even(trials: f64) -> Plan {
        Plan { even: trials, ..Plan::default() }
    }

    /// The plan with the least variance for its cost, as far as a pilot can tell. `even` trials at each moment are
    /// spread over all rows besides.
    pub fn of(pilot: &Pilot, even: f64) -> Plan {
        let risks = pilot.risks();
        let trial_s = pilot.tried_s / f64::from(pilot.tried.max(1));
        // Variance times cost with a threshold; without one it is that of counting.
        let product = |threshold: Option<f64>| {
            let (mut variance, mut cost_s) = (0.0, pilot.whole_s);
            for (cell, seen) in pilot.cells.iter().filter(|(_, seen)| seen.moments > 0) {
                let (risk, moments) = (risks.of(cell), f64::from(seen.moments));
                let chance = seen.chance / moments;
                let share = threshold.map_or(0.0, |threshold| share(chance, risk, threshold));
                variance += moments * chance * weight(chance, share) * risk;
                cost_s += moments * share * trial_s;
            }
            variance * cost_s
        };
        // Halvings from a certain event down to one in 10^12.
        let thresholds = (0..40).map(|halvings| Some(libm::exp2(-f64::from(halvings))));
        let best = |best: (Option<f64>, f64), threshold: Option<f64>| {
            let product = product(threshold);
            if product < best.1 { (threshold, product) } else { best }
        };
        let (threshold, _) = thresholds.fold((None, product(None)), best);
        Plan { risks, threshold, even }
    }

    /// Probability with which a row is tried out. `chance` is the probability that chance chooses it, `legal` the
    /// number of legal rows.
    pub fn share(&self, cell: &Cell, chance: f64, legal: usize) -> f64 {
        if chance <= 0.0 {
            return 0.0;
        }
        let even = self.even / legal.max(1) as f64;
        let wanted = self.threshold.map_or(0.0, |threshold| share(chance, self.risks.of(cell), threshold));
        (wanted + even).min(1.0)
    }
}

impl Risks {
    fn of(&self, cell: &Cell) -> f64 {
        let of_row = || self.of_rows.get(&cell.row).copied().unwrap_or(self.all);
        self.of_cells.get(cell).copied().unwrap_or_else(of_row)
    }
}

/// The share at which a threshold balances variance and cost.
fn share(chance: f64, risk: f64, threshold: f64) -> f64 {
    (chance * ((risk / threshold).sqrt() - 1.0)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng;
    use avastra_base::rng::{Rng, Stream};
    use avastra_base::statistics::weighted;

    /// Steps of an episode of the twin, its rows' chances, and their risks where the situation is calm and where it is not.
    const STEPS: usize = 8;
    const CHANCES: [f64; 4] = [0.001, 0.003, 0.004, 0.992];
    const RISKS: [[f64; 2]; 4] = [[0.02, 0.3], [2e-4, 2e-4], [0.0, 1e-3], [0.0, 0.0]];
    /// The last row makes nothing appear, so nothing is tried out there.
    const MATTERS: usize = 3;
    /// How likely a step is not calm.
    const WILD: f64 = 0.25;

    fn cell(row: usize, situation: u32) -> Cell {
        Cell { row, road: 0, situation: Situation(situation) }
    }

    /// The exact probability of the event in an episode.
    fn truth() -> f64 {
        let of = |situation: usize| (0..4).map(|row| CHANCES[row] * RISKS[row][situation]).sum::<f64>();
        let of_step = (1.0 - WILD) * of(0) + WILD * of(1);
        1.0 - libm::pow(1.0 - of_step, STEPS as f64)
    }

    /// An episode of the twin with its trials: its weighted events. It draws the results that a simulator would find out.
    /// `heaviest` is raised to the weight of what could have been met.
    fn sample(plan: &Plan, rng: &mut Rng, pilot: &mut Pilot, heaviest: &mut f64) -> f64 {
        let (mut weights, mut is_over) = (0.0, false);
        for _ in 0..STEPS {
            let situation = usize::from(rng::unit(rng) < WILD);
            let mut ticket = rng::unit(rng);
            let chosen = CHANCES.iter().position(|chance| {
                ticket -= chance;
                ticket < 0.0
            });
            for row in 0..MATTERS {
                let cell = cell(row, situation as u32);
                let share = plan.share(&cell, CHANCES[row], MATTERS);
                *heaviest = heaviest.max(weight(CHANCES[row], share));
                let is_tried = rng::unit(rng) < share;
                let has_event = rng::unit(rng) < RISKS[row][situation];
                let seen = pilot.cells.entry(cell).or_default();
                seen.moments += 1;
                seen.chance += CHANCES[row];
                if is_over || (!is_tried && chosen != Some(row)) {
                    continue;
                }
                seen.trials += 1;
                seen.events += u32::from(has_event);
                if chosen != Some(row) {
                    pilot.tried += 1;
                    pilot.tried_s += 6.0;
                }
                weights += if has_event { weight(CHANCES[row], share) } else { 0.0 };
            }
            pilot.whole_s += 6.0;
            // Trials of this step come before its end, and a later one has the event behind it.
            let ends = chosen.is_some_and(|row| {
                let risk = RISKS[row][situation];
                rng::unit(rng) < risk
            });
            is_over |= ends;
        }
        weights
    }

    fn learned(rng: &mut Rng) -> Plan {
        let mut pilot = Pilot::default();
        for plan in [Plan::even(1.5), Plan::even(0.5)] {
            for _ in 0..60 {
                sample(&plan, rng, &mut pilot, &mut 0.0);
            }
        }
        Plan::of(&pilot, 0.0)
    }

    #[test]
    fn a_plan_tries_what_a_pilot_found_dangerous_and_rare() {
        let plan = learned(&mut rng::stream(1, Stream::Estimate, 0));
        let share = |row, situation| plan.share(&cell(row, situation), CHANCES[row], 4);
        assert!(share(0, 1) > 20.0 * CHANCES[0], "{}", share(0, 1));
        assert_eq!(plan.share(&cell(0, 1), 0.0, 4), 0.0);
        // A cell that the pilot has not seen is like its row, or like all rows.
        let rarely = |row, situation| plan.share(&cell(row, situation), 1e-5, 4);
        assert!(rarely(0, 0) < rarely(0, 7) && rarely(0, 7) < rarely(0, 1), "{}", rarely(0, 7));
        assert!(rarely(9, 1) < rarely(0, 7), "{}", rarely(9, 1));
    }

    #[test]
    fn weights_undo_the_trials() {
        assert_eq!(weight(0.3, 0.0), 1.0);
        assert_eq!(weight(0.3, 1.0), 0.3);
        assert_eq!(weight(0.0, 0.5), 0.0);
        assert!((weight(0.1, 0.5) - 0.1 / 0.55).abs() < 1e-15);
    }

    #[test]
    fn estimates_have_no_bias_and_intervals_cover() {
        const EPISODES: usize = 1000;
        const REPEATS: u64 = 200;
        let truth = truth();
        let (mut means, mut covered, mut variances) = (Vec::new(), 0, 0.0);
        let mut cost = Pilot::default();
        for repeat in 0..REPEATS {
            let mut rng = rng::stream(7, Stream::Estimate, repeat);
            let plan = learned(&mut rng);
            let mut heaviest = 0.0;
            let samples: Vec<f64> =
                (0..EPISODES).map(|_| sample(&plan, &mut rng, &mut cost, &mut heaviest)).collect();
            let mean = samples.iter().sum::<f64>() / EPISODES as f64;
            let variance = avastra_base::statistics::variance_of_mean(&samples);
            let heaviest = samples.iter().copied().fold(heaviest, f64::max) / EPISODES as f64;
            let interval = weighted(mean, variance, heaviest, 0.05);
            covered += u32::from(interval.low <= truth && truth <= interval.high.unwrap());
            means.push(mean);
            variances += variance / REPEATS as f64;
        }
        let mean = means.iter().sum::<f64>() / REPEATS as f64;
        let error = avastra_base::statistics::variance_of_mean(&means).sqrt();
        assert!((mean - truth).abs() < 4.0 * error, "{mean} against {truth}, give or take {error}");
        assert!(covered >= 184, "{covered} of {REPEATS} intervals have {truth}");
        // Against counting for the same time.
        let whole = truth * (1.0 - truth) / EPISODES as f64;
        let gain = whole / variances * cost.whole_s / (cost.whole_s + cost.tried_s);
        assert!(gain > 30.0, "{gain}, {covered} covered, {mean} against {truth}");
    }
}
