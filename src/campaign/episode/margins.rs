//! The margins of an episode's requirements over its ticks, for those that draw them.

use avastra_world::sim::World;

use super::log::EpisodeLog;
use super::monitor::Monitor;
use super::script::Script;
use super::setup::Setup;

/// The margins of a requirement, tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct MarginSeries {
    /// By index in `Space::requirements`.
    pub requirement: usize,
    /// Of each tick from the first one up to the first contact, SI; `None` where nothing was asked, or where it was excused. What
    /// `within` grants is not in it; of several road users it is that of the worst.
    pub margins: Vec<Option<f64>>,
}

/// Plays an episode once more, and notes the margins of the requirements that have one.
pub fn margins_over_time(setup: &Setup, log: &EpisodeLog) -> Vec<MarginSeries> {
    let Some(mut monitor) = Monitor::new(setup) else { return Vec::new() };
    let (script, own_bodies) = (Script::of_log(log), log.own_bodies());
    let mut series: Vec<MarginSeries> = monitor
        .asked()
        .filter(|index| setup.table.space().requirements[*index].margin.is_some())
        .map(|requirement| MarginSeries { requirement, margins: Vec::new() })
        .collect();
    let mut touched = false;
    super::run_watched(setup, &mut |moment| script.choose(moment), &mut |world: &World, _, contacts| {
        touched |= !contacts.is_empty();
        if touched || world.ticks() == 0 {
            return;
        }
        // The step that is driven began before this tick.
        let begun = log.steps.partition_point(|step| step.time_s < world.time_s() - 1e-6);
        let step = begun.max(1) - 1;
        monitor.judge(setup, (world, &own_bodies), log.memory_after(step), step);
        for one in &mut series {
            one.margins.push(monitor.now(one.requirement));
        }
    });
    series
}
