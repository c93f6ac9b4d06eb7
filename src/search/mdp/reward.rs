//! The reward of a step in the search for crashes (paper, "Reward Function", Eq. 8).
//!
//! A collision is a contact that begins in the step. An obstacle that the ego vehicle has hit already
//! has no collision probability any more: otherwise a wreck against the bumper would be worth a collision
//! at every step.

/// Constants of the reward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RewardSettings {
    /// Reward of a collision that counts, R_col.
    pub collision: f64,
    /// Reward of a collision that the space's verdict does not count.
    pub uncounted: f64,
    /// A collision probability up to this is safe.
    pub safe_proc_max: f64,
    /// Whether exactly `safe_proc_max` is safe. Paper: yes; the published package: no.
    pub bound_is_safe: bool,
    /// Reward of a safe step.
    pub safe: f64,
}

/// The outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepOutcome {
    /// Largest collision probability, in `[0, 1]`.
    pub proc: f64,
    /// Whether a contact began.
    pub collided: bool,
    /// Whether a contact began that the verdict counts.
    pub counted: bool,
}

/// The reward of a step, Eq. 8.
pub fn reward(settings: &RewardSettings, outcome: StepOutcome) -> f64 {
    let bound = settings.safe_proc_max;
    if outcome.counted {
        settings.collision
    } else if outcome.collided {
        settings.uncounted
    } else if outcome.proc < bound || settings.bound_is_safe && outcome.proc == bound {
        settings.safe
    } else {
        outcome.proc
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_worth_what_the_equation_says() {
        let paper = RewardSettings {
            collision: 7.5,
            uncounted: 0.0,
            safe_proc_max: 0.2,
            bound_is_safe: true,
            safe: -1.0,
        };
        let quiet = |proc| reward(&paper, StepOutcome { proc, ..StepOutcome::default() });
        assert_eq!([quiet(0.0), quiet(0.2), quiet(0.21), quiet(1.0)], [-1.0, -1.0, 0.21, 1.0]);
        let hit = StepOutcome { proc: 1.0, collided: true, counted: false };
        assert_eq!(reward(&paper, hit), 0.0);
        assert_eq!(reward(&paper, StepOutcome { counted: true, ..hit }), 7.5);
        let released = RewardSettings { bound_is_safe: false, ..paper };
        assert_eq!(reward(&released, StepOutcome { proc: 0.2, ..StepOutcome::default() }), 0.2);
    }
}
