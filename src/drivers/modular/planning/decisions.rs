//! Decisions about road users that come onto the way or cross it: ranked by cost, and remembered.
//!
//! The cheapest profile through the station-time graph says for each of them whether the vehicle passes before
//! (OVERTAKE) or stays behind (YIELD, or FOLLOW if it goes along the way). A decision once taken is left only
//! when the profile without it is cheaper by a margin, or when its object is gone. Apollo keeps decisions from
//! cycle to cycle in the same spirit (`PATH_REUSE`, the sides of its speed bounds). The margin is ours.

use avastra_world::sim::VehicleParameters;

use super::super::config::PlanningConfig;
use super::claim::{Claim, Role, Stance};
use super::st_graph::{Profile, Region, Situation};

#[derive(Debug, Clone, Default)]
pub struct Decisions {
    /// The stance on each object.
    taken: Vec<(u32, Stance)>,
    /// Buffer of a cycle: the regions of all claims.
    regions: Vec<Region>,
}

impl Decisions {
    /// Sets the stance of every claim about which there is something to decide.
    pub fn decide(&mut self, situation: &Situation, claims: &mut [Claim]) {
        let config = situation.config;
        let front_m = VehicleParameters::MKZ.front_m(situation.start.station_m);
        self.regions.clear();
        let mut remembered = false;
        let mut contested = false;
        for (index, claim) in claims.iter().enumerate() {
            let binds = claim.binds(config);
            let Some(mut region) = Region::new(config, claim, index, binds, front_m) else { continue };
            if binds && claim.is_contested(config) {
                contested = true;
                region.remembered = self.remembered(claim.id);
                remembered |= region.remembered != Stance::Open;
            }
            self.regions.push(region);
        }
        if !contested {
            return;
        }
        let free = Profile::cheapest(situation, &self.regions, false);
        let chosen = if remembered && situation.hysteresis {
            let kept = Profile::cheapest(situation, &self.regions, true);
            if free.cost < kept.cost * (1.0 - config.decision_margin) { free } else { kept }
        } else {
            free
        };
        for region in &self.regions {
            let claim = &mut claims[region.claim];
            if claim.binds(config) && claim.is_contested(config) {
                let is_way = chosen.cost.is_finite();
                claim.stance = if is_way { chosen.side_of(region) } else { Stance::Yield };
            }
        }
    }

    /// Keeps what was done about each object, for the next cycle: it yields to an object if it yields to any
    /// of the object's hypotheses.
    pub fn remember(&mut self, claims: &[Claim]) {
        self.taken.clear();
        for claim in claims.iter().filter(|claim| claim.stance != Stance::Open) {
            match self.taken.iter_mut().find(|(id, _)| *id == claim.id) {
                Some((_, stance)) if claim.stance == Stance::Yield => *stance = Stance::Yield,
                Some(_) => {}
                None => self.taken.push((claim.id, claim.stance)),
            }
        }
    }

    fn remembered(&self, id: u32) -> Stance {
        self.taken.iter().find(|taken| taken.0 == id).map_or(Stance::Open, |taken| taken.1)
    }
}

impl Claim {
    /// Whether the plan must keep clear of this hypothesis, instead of counting it in the cost alone.
    ///
    /// One that would break the ego vehicle's right of way must be the more probable one.
    pub fn binds(&self, config: &PlanningConfig) -> bool {
        // A planted fault: it goes, whoever comes.
        if config.priority_misread && self.owes_way {
            return false;
        }
        let least = if self.owes_way { config.hypothesis_min_owing } else { config.hypothesis_min };
        self.probability >= least
    }

    /// Whether there is something to decide: it comes onto the way or crosses it.
    pub fn is_contested(&self, config: &PlanningConfig) -> bool {
        matches!(self.role(config.static_mps), Role::Merges | Role::Crosses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kit::Guide;
    use crate::modular::planning::claim::testing::crosser;
    use crate::modular::planning::trajectory::Point;
    use crate::testing::straight;

    /// The decisions at 10 m/s, cycle after cycle, about a car that will be on the way 8 m ahead between two
    /// moments. Without a margin each cycle decides anew.
    fn decided(margin: Option<f64>, moments: &[(f64, f64)]) -> Vec<Stance> {
        let usual = PlanningConfig::default();
        let config = PlanningConfig { decision_margin: margin.unwrap_or(usual.decision_margin), ..usual };
        let guide = Guide::new(&straight(), &config.speed_rules());
        let start = Point { station_m: 40.0, speed_mps: 10.0, acceleration_mps2: 0.0 };
        let from_m = VehicleParameters::MKZ.front_m(start.station_m) + 8.0;
        let situation = Situation {
            config: &config,
            guide: &guide,
            start,
            stop_m: f64::INFINITY,
            hysteresis: margin.is_some(),
        };
        let mut decisions = Decisions::default();
        let decide = |&(from_s, to_s): &(f64, f64)| {
            let mut claims = [crosser(from_m, from_s, to_s)];
            decisions.decide(&situation, &mut claims);
            decisions.remember(&claims);
            claims[0].stance
        };
        moments.iter().map(decide).collect()
    }

    #[test]
    fn it_yields_to_what_comes_soon_and_goes_before_what_comes_late() {
        assert_eq!(decided(Some(0.3), &[(1.0, 2.0)]), [Stance::Yield]);
        assert_eq!(decided(Some(0.3), &[(5.5, 6.5)]), [Stance::Overtake]);
    }

    #[test]
    fn a_decision_is_kept_until_the_other_is_much_cheaper() {
        let later = [(1.0, 2.0), (6.0, 7.0)];
        assert_eq!(decided(None, &later), [Stance::Yield, Stance::Overtake]);
        assert_eq!(decided(Some(0.3), &later), [Stance::Yield, Stance::Overtake]);
        assert_eq!(decided(Some(1.0), &later), [Stance::Yield, Stance::Yield]);
        // Nothing is remembered of what is gone.
        let mut decisions = Decisions { taken: vec![(1, Stance::Yield)], ..Decisions::default() };
        decisions.remember(&[]);
        assert_eq!(decisions.remembered(1), Stance::Open);
    }
}
