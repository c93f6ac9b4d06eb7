//! The margins of an episode's requirements over its ticks, for those that draw them.

use avastra_lang::model::Space;

use super::monitor::Monitor;

/// The margins of a requirement, tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct MarginSeries {
    /// By index in `Space::requirements`.
    pub requirement: usize,
    /// The margin at each tick from the first one up to the first contact, SI; `None` where nothing was asked, or where
    /// it was excused. The time that `within` grants is not in it. Among several road users the worst margin counts.
    pub margins: Vec<Option<f64>>,
}

impl MarginSeries {
    /// The empty series of the requirements that are asked and have a margin, before the first tick.
    pub(super) fn of_asked(monitor: &Monitor, space: &Space) -> Vec<MarginSeries> {
        let with_margin = monitor.asked().filter(|index| space.requirements[*index].margin.is_some());
        with_margin.map(|requirement| MarginSeries { requirement, margins: Vec::new() }).collect()
    }

    /// Adds that of the tick that was judged last.
    pub(super) fn note(&mut self, monitor: &Monitor) {
        self.margins.push(monitor.now(self.requirement));
    }
}
