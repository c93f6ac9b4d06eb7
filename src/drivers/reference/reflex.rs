//! The phases between a perceived risk and the brake: evaluation, reaction, build-up, release.
//!
//! The times and slopes are those of the models; that a driver who has just braked stays alert and
//! does not react anew is ours. In the code that the models were published with, a driver never speeds up
//! again; here the brake is released when no risk is left.

/// A driver stays ready to brake for this time after a risk has ended, s.
const ALERT_S: f64 = 2.0;

/// How a driver brakes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Braking {
    /// The risk must last this long before it is believed, s.
    pub evaluation_s: f64,
    /// From believing the risk to the brake, s.
    pub reaction_s: f64,
    /// Deceleration by the released accelerator during the reaction, m/s².
    pub release_mps2: f64,
    /// Jerk of the build-up, m/s³; infinite for a step.
    pub jerk_mps3: f64,
    /// Hardest braking, m/s².
    pub deceleration_mps2_max: f64,
}

/// A driver's foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflex {
    braking: Braking,
    state: State,
    deceleration_mps2: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Calm,
    /// A risk has been there for so long, s.
    Risk {
        for_s: f64,
    },
    /// On the brake, or ready for it; no risk for so long, s.
    Ready {
        calm_s: f64,
    },
}

impl Reflex {
    pub fn new(braking: Braking) -> Reflex {
        Reflex { braking, state: State::Calm, deceleration_mps2: 0.0 }
    }

    /// The deceleration (m/s²) at the end of a time step of `dt_s`, in which the risk demands
    /// `demand_mps2`; 0 is no risk.
    pub fn step(&mut self, demand_mps2: f64, dt_s: f64) -> f64 {
        let demand_mps2 = demand_mps2.min(self.braking.deceleration_mps2_max);
        let is_risk = demand_mps2 > 0.0;
        self.state = match self.state {
            _ if !is_risk => match self.state {
                State::Ready { calm_s } if calm_s < ALERT_S => State::Ready { calm_s: calm_s + dt_s },
                _ => State::Calm,
            },
            State::Calm => State::Risk { for_s: dt_s },
            State::Risk { for_s } => {
                // Steps add up with rounding errors, which must not delay the brake by a step.
                if for_s + 1e-9 >= self.braking.evaluation_s + self.braking.reaction_s {
                    State::Ready { calm_s: 0.0 }
                } else {
                    State::Risk { for_s: for_s + dt_s }
                }
            }
            State::Ready { .. } => State::Ready { calm_s: 0.0 },
        };
        let wanted_mps2 = match self.state {
            State::Calm => 0.0,
            State::Risk { for_s } if for_s <= self.braking.evaluation_s + 1e-9 => 0.0,
            State::Risk { .. } => self.braking.release_mps2,
            State::Ready { .. } => demand_mps2,
        };
        let change_mps2 = self.braking.jerk_mps3 * dt_s;
        self.deceleration_mps2 = match self.state {
            State::Risk { .. } => wanted_mps2,
            _ => {
                wanted_mps2.clamp(self.deceleration_mps2 - change_mps2, self.deceleration_mps2 + change_mps2)
            }
        };
        self.deceleration_mps2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::driver::Model;
    use crate::reference::r157::CarefulHuman;
    use avastra_base::kinematics::CAREFUL_BRAKING_MPS2;

    #[test]
    fn evaluation_reaction_and_build_up_follow_each_other() {
        let mut reflex = Reflex::new(CarefulHuman::default().braking());
        let course: Vec<f64> = (0..200).map(|_| reflex.step(9.0, 0.01)).collect();
        assert_eq!(course[38], 0.0);
        assert_eq!(course[80], 0.4);
        // a(t) = min(0.4 + 12.65 (t - 1.15), 7.593).
        assert!((course[144] - (0.4 + 12.65 * 0.3)).abs() < 0.13, "{}", course[144]);
        assert_eq!(course[199], CAREFUL_BRAKING_MPS2);
    }

    #[test]
    fn a_driver_that_has_just_braked_does_not_react_anew() {
        let mut reflex = Reflex::new(CarefulHuman::default().braking());
        for _ in 0..200 {
            reflex.step(9.0, 0.01);
        }
        for _ in 0..100 {
            reflex.step(0.0, 0.01);
        }
        assert_eq!(reflex.step(0.0, 0.01), 0.0);
        assert!(reflex.step(9.0, 0.01) > 0.1);
        for _ in 0..300 {
            reflex.step(0.0, 0.01);
        }
        assert_eq!(reflex.step(9.0, 0.01), 0.0);
    }
}
