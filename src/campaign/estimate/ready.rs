//! An estimate that is ready to play: its parts and their episodes.

use ndarray::Array1;

use crate::episode::{EpisodeLog, Setup};
use crate::estimate::part::Part;
use crate::estimate::settings::{EstimateError, EstimateSettings, Method};
use crate::oracle::Found;
use crate::run::{EpisodeSummary, Run, RunError};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_world::action::ActionTable;

/// Where the event of an episode is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct EventPlace {
    /// The step that it belongs to: the one whose action made appear what was hit, else the one in which it happened.
    pub step: usize,
    /// The step in which it happened.
    pub hit_step: usize,
}

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
        settings.event.check(run.space(), run.arena().rules())?;
        if run.settings().rows > 0 {
            return Err(RunError::OneRow { name: settings.run.agent }.into());
        }
        let rows = run.table().rows().len();
        if settings.method == Method::Probe
            && run.agent().chances(Array1::from_elem(rows, true).view()).is_none()
        {
            return Err(EstimateError::NoChances { agent: settings.run.agent.clone() });
        }
        Ok(Estimate { run, settings })
    }

    pub fn run(&self) -> &Run {
        &self.run
    }

    pub fn settings(&self) -> &EstimateSettings {
        &self.settings
    }

    /// Seed of everything that a part draws. It depends neither on the driving system nor on the agent.
    pub(super) fn seed(&self, part: Part) -> u64 {
        let of_road = rng::child_seed(self.settings.run.seed, Stream::Estimate, part.road as u64);
        rng::child_seed(of_road, Stream::Estimate, u64::from(part.number))
    }

    /// The nth episode of a part.
    pub(super) fn setup(&self, part: Part, number: u32) -> Setup {
        self.run.setup_of(part.road, rng::child_seed(self.seed(part), Stream::Episode, u64::from(number)))
    }

    /// Where the event of an episode is, if it is there.
    pub(super) fn event(&self, setup: &Setup, log: &EpisodeLog) -> Option<EventPlace> {
        let found = self.settings.event.first(setup, log)?;
        let happened = found.step(log);
        let made_it = match found {
            Found::Collision(index) => {
                let obstacle = log.collisions[index].contact.obstacle;
                log.steps.iter().position(|step| step.outcome.spawned().contains(&obstacle))
            }
            Found::Breach(_) => None,
        };
        Some(EventPlace { step: made_it.unwrap_or(happened), hit_step: happened })
    }

    /// An episode of a part, judged, under a number that no other episode of the estimate on its road has.
    pub(super) fn judged(&self, part: Part, number: u32, log: &EpisodeLog) -> EpisodeSummary {
        let of_estimate = part.number as usize * self.settings.run.episodes as usize + number as usize;
        let setup = self.setup(part, number);
        let mut summary = EpisodeSummary::judged(&setup, of_estimate, log);
        if self.settings.event.is_breach() {
            summary.find_keepers(&setup, log);
        }
        summary
    }
}
