//! Would a careful driver have kept a requirement that the ego vehicle breached?
//!
//! A careful driver drives the same steps from the start of the episode, under the same rules: an action happens at the
//! same time with the same values, if it is legal there, too. Most requirements are about the drive up to then rather
//! than about a last moment. So the question begins at the start, and not at a hazard as for a collision. A driver that
//! comes to the same place a little later must keep the requirement there, too. So the question ends one step after that of
//! the breach. Up to then the careful driver must not have breached the requirement. A driver that touches a road user
//! before the moment of the breach has not come to it, and is left out.

use std::cmp::Ordering;

use crate::episode::{self, Breach, Choice, EpisodeLog, Moment, Script, Setup};
use avastra_drivers as ads;
use avastra_drivers::Selected;

use super::avoidable::CAREFUL;
use super::recurrence::Recurrence;

/// A requirement that the ego vehicle breached, and the careful drivers that would have kept it.
#[derive(Debug, Clone, PartialEq)]
pub struct Breached {
    /// By index in `Space::requirements`.
    pub requirement: usize,
    /// The careful drivers that keep it up to the end of the step after its first breach.
    pub kept_by: Vec<String>,
    /// How often it is breached again under other chance, if that was tried.
    pub recurrence: Option<Recurrence>,
}

impl Breached {
    /// Every requirement of which a log has a breach, in the order of their first ones, not yet judged.
    pub fn all(log: &EpisodeLog) -> Vec<Breached> {
        let breached = |first: &Breach| Breached {
            requirement: first.requirement,
            kept_by: Vec::new(),
            recurrence: None,
        };
        log.first_breaches().map(breached).collect()
    }
}

/// Every requirement of which a log has a breach, in the order of their first ones, judged by playing the episode again with
/// each careful driver.
pub fn breached(setup: &Setup, script: &Script, log: &EpisodeLog) -> Vec<Breached> {
    let firsts: Vec<&Breach> = log.first_breaches().collect();
    // No step after the last of them.
    let Some(last) = firsts.last() else { return Vec::new() };
    let mut found = Breached::all(log);
    for name in CAREFUL {
        let entry = ads::by_name(name).expect("careful drivers are driving systems of avastra");
        let setup = Setup { ads: Selected::new(entry), ..setup.clone() };
        let mut choose = |moment: &Moment| match moment.step.cmp(&(last.step + 1)) {
            Ordering::Less => script.choose(moment),
            Ordering::Equal => Choice::Pass,
            Ordering::Greater => Choice::Stop,
        };
        let again = episode::run(&setup, &mut choose);
        for (breached, first) in found.iter_mut().zip(&firsts) {
            let breaks = again
                .breaches
                .iter()
                .any(|breach| breach.requirement == first.requirement && breach.step <= first.step + 1);
            let crashed = again.collisions.iter().any(|crash| crash.contact.time_s < first.time_s);
            if !breaks && !crashed {
                breached.kept_by.push(name.to_owned());
            }
        }
    }
    found
}
