//! An estimate that is ready to play: its parts and their episodes.

use crate::action::ActionTable;
use crate::episode::{EpisodeLog, Setup};
use crate::estimate::part::Part;
use crate::estimate::settings::{EstimateError, EstimateSettings, Method};
use crate::rng;
use crate::rng::Stream;
use crate::run::Run;

/// An estimate that is ready to play.
pub struct Estimate {
    run: Run,
    settings: EstimateSettings,
}

impl Estimate {
    /// Looks everything up that the settings name.
    ///
    /// # Errors
    /// If something does not exist or is not possible.
    pub fn new(table: ActionTable, settings: EstimateSettings) -> Result<Estimate, EstimateError> {
        settings.check()?;
        let run = Run::new(table, settings.run.clone())?;
        if settings.method == Method::Split && run.agent().looks_ahead() {
            return Err(EstimateError::Ahead { agent: settings.run.agent.clone() });
        }
        Ok(Estimate { run, settings })
    }

    pub fn run(&self) -> &Run {
        &self.run
    }

    pub fn settings(&self) -> &EstimateSettings {
        &self.settings
    }

    /// All parts: the first of every road before the second of any, so that an unfinished estimate says something
    /// about all roads.
    pub fn parts(&self) -> Vec<Part> {
        let roads = self.settings.run.roads.len();
        (0..self.settings.parts)
            .flat_map(|number| (0..roads).map(move |road| Part { road, number }))
            .collect()
    }

    /// Seed of everything that a part draws. It depends neither on the driving system nor on the agent.
    pub(super) fn seed(&self, part: Part) -> u64 {
        let of_road = rng::child_seed(self.settings.run.seed, Stream::Estimate, part.road as u64);
        rng::child_seed(of_road, Stream::Estimate, u64::from(part.number))
    }

    /// The nth episode of a part.
    pub(super) fn setup(&self, part: Part, number: u32) -> Setup<'_> {
        self.run.setup_of(part.road, rng::child_seed(self.seed(part), Stream::Episode, u64::from(number)))
    }

    /// Whether the event is in an episode.
    pub(super) fn happened(&self, setup: &Setup, log: &EpisodeLog) -> bool {
        self.settings.event.happened(setup, log, &self.settings.run)
    }
}
