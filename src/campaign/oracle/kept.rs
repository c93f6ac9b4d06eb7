//! Would a careful driver have kept a requirement that the ego vehicle breached?
//!
//! A careful driver drives the same steps from the start of the episode, under the same rules: an action happens at the
//! same time with the same values, if it is legal there, too. Most requirements are about the drive up to then rather
//! than about a last moment, so the question begins at the start, and not at a hazard as that of a collision does. It ends
//! with the breach: up to then the careful driver must not have breached the requirement, nor touched anybody.

use crate::episode::{self, EpisodeLog, Script, Setup};
use avastra_drivers as ads;
use avastra_drivers::Selected;

use super::avoidable::CAREFUL;

/// A requirement that the ego vehicle did not keep, and who would have.
#[derive(Debug, Clone, PartialEq)]
pub struct Breached {
    /// By index in `Space::requirements`.
    pub requirement: usize,
    /// The careful drivers that keep it up to its first breach.
    pub kept_by: Vec<String>,
}

/// Every requirement of which a log has a breach, in the order of their first ones, judged by playing the episode again with
/// each careful driver.
pub fn breached(setup: &Setup, script: &Script, log: &EpisodeLog) -> Vec<Breached> {
    let mut found: Vec<(Breached, f64)> = Vec::new();
    for breach in &log.breaches {
        if !found.iter().any(|(known, _)| known.requirement == breach.requirement) {
            found.push((Breached { requirement: breach.requirement, kept_by: Vec::new() }, breach.time_s));
        }
    }
    let Some(last) = log.breaches.last().filter(|_| !found.is_empty()) else { return Vec::new() };
    for name in CAREFUL {
        let entry = ads::by_name(name).expect("careful drivers are driving systems of avastra");
        let mut setup = setup.clone();
        setup.ads = Selected::new(entry);
        // No step after the last breach.
        let mut choose = |moment: &episode::Moment| match moment.step <= last.step {
            true => script.choose(moment.setup().table, moment),
            false => episode::Choice::Stop,
        };
        let again = episode::run(&setup, &mut choose, &mut |_, _, _| {});
        for (breached, time_s) in &mut found {
            let is_by = |time: f64| time <= *time_s;
            let breaks =
                again.breaches.iter().any(|b| b.requirement == breached.requirement && is_by(b.time_s));
            let crashes = again.collisions.iter().any(|collision| is_by(collision.contact.time_s));
            if !breaks && !crashes {
                breached.kept_by.push(name.to_owned());
            }
        }
    }
    found.into_iter().map(|(breached, _)| breached).collect()
}
