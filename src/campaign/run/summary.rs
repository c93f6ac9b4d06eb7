//! An episode's result: its collisions, each with its verdict and the facts behind it.

use crate::episode::{Collision, EpisodeLog, Script, Setup};
use crate::oracle;
use crate::oracle::{Breached, Found, Judgement, NoModules, Recurrence, Replayed, can_replay};
use avastra_drivers::{ModularConfig, Module};
use avastra_lang::model::{OutcomeFacts, Space};
use avastra_search::mdp::Criticality;

use crate::run::gauges::Manners;
use crate::run::offered::Offered;

/// An episode, judged.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EpisodeSummary {
    /// Number of the episode in its run, from 0.
    pub episode: usize,
    pub collisions: Vec<Finding>,
    /// The requirements that were breached, and the drivers that would have kept them; empty if that was not asked.
    pub breached: Vec<Breached>,
    /// Measures of danger for each step; empty if the episode was not measured.
    pub criticality: Vec<Criticality>,
    /// The ego vehicle's greatest speed in each step, m/s, until its first contact; empty if the episode was not measured.
    pub top_speeds_mps: Vec<Option<f64>>,
    /// Least post-encroachment time over the obstacles that were not hit, s; `None` above 5 s.
    pub pet_s: Option<f64>,
    /// How the ego vehicle kept to limit and lane; zeros if the episode was not measured.
    pub manners: Manners,
    /// The offers of every row; empty if the episode is not a run's.
    pub offered: Offered,
}

/// A collision, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Index among the collisions of its episode.
    pub number: usize,
    pub collision: Collision,
    pub facts: OutcomeFacts,
    pub judgement: Judgement,
    /// Modules at fault, if they were looked for.
    pub cause: Option<Vec<Module>>,
    pub counted: bool,
    /// The clauses of the verdict that it does not meet.
    pub unmet: Vec<String>,
    /// How often it happens again under other chance, if that was tried.
    pub recurrence: Option<Recurrence>,
    /// Whether it is proved that no step before it can be left out.
    pub minimal: bool,
    /// The author's name for the obstacle, if its body is one that the author defined.
    pub own_body: Option<String>,
}

impl Finding {
    /// The names of the modules at fault, with a space between them.
    pub(crate) fn cause_in_words(&self) -> Option<String> {
        let modules = self.cause.as_ref()?;
        Some(modules.iter().map(|module| module.name()).collect::<Vec<_>>().join(" "))
    }
}

impl EpisodeSummary {
    /// Judges every collision of a log by playing it again from its setup, and applies the space's verdict.
    pub fn judged(setup: &Setup, number: usize, log: &EpisodeLog) -> EpisodeSummary {
        let judgements = oracle::judge(setup, &Script::of_log(log), log);
        EpisodeSummary::new(setup.table.space(), number, log, judgements)
    }

    /// Applies the space's verdict to every collision of a log. `judgements` has one for each.
    pub fn new(space: &Space, number: usize, log: &EpisodeLog, judgements: Vec<Judgement>) -> EpisodeSummary {
        let find = |(index, judgement)| {
            let facts = oracle::facts(log, index, &judgement);
            let counted = oracle::counts(space, log, index, &judgement);
            let unmet = oracle::unmet(space, log, index, &judgement);
            let collision = log.collisions[index];
            Finding {
                number: index,
                collision,
                own_body: collision.body.own.map(|own| space.bodies[own].name.clone()),
                facts,
                judgement,
                cause: None,
                counted,
                unmet: unmet.into_iter().map(str::to_owned).collect(),
                recurrence: None,
                minimal: false,
            }
        };
        let collisions = judgements.into_iter().enumerate().map(find).collect();
        EpisodeSummary { episode: number, collisions, ..EpisodeSummary::default() }
    }

    /// Asks which careful drivers keep what was breached.
    pub fn find_keepers(&mut self, setup: &Setup, log: &EpisodeLog) {
        self.breached = oracle::breached(setup, &Script::of_log(log), log);
    }

    /// How often a finding happens again, if that was tried.
    pub fn recurrence_of(&self, log: &EpisodeLog, found: Found) -> Option<Recurrence> {
        match found {
            Found::Collision(index) => self.collisions[index].recurrence,
            Found::Breach(index) => {
                let requirement = log.breaches[index].requirement;
                self.breached.iter().find(|found| found.requirement == requirement)?.recurrence
            }
        }
    }

    /// The subject of its scenario: the first counted collision, because a crash is more than a breach that led to it.
    /// Without a counted collision, the first breach.
    pub fn first_found(&self, log: &EpisodeLog) -> Option<Found> {
        let counted = self.collisions.iter().find(|finding| finding.counted);
        let breach = (!log.breaches.is_empty()).then_some(Found::Breach(0));
        counted.map(|finding| Found::Collision(finding.number)).or(breach)
    }

    /// The step of the last counted collision or breach: what comes later is not part of the scenario.
    pub fn last_step(&self, log: &EpisodeLog) -> Option<usize> {
        let counted = self.collisions.iter().filter(|finding| finding.counted);
        let of_collisions = counted.map(|finding| finding.collision.step).max();
        of_collisions.max(log.breaches.iter().map(|breach| breach.step).max())
    }

    /// Tests whether every counted collision, and a breach of every breached requirement, recurs. The scenario of the log is
    /// played at most `most` times more. Says nothing if the driving system cannot be asked.
    pub fn find_recurrence(&mut self, setup: &Setup, script: &Script, log: &EpisodeLog, most: u32) {
        if most == 0 || self.last_step(log).is_none() || !can_replay(&setup.ads) {
            return;
        }
        let again = Replayed::new(setup, script, log);
        // If the driving system failed in each, they say nothing.
        let tested = |found| Some(again.tested(found, most)).filter(|tested| tested.replays > 0);
        let counted = self.collisions.iter().filter(|finding| finding.counted);
        let collisions: Vec<_> = counted.map(|finding| tested(Found::Collision(finding.number))).collect();
        let first = |found: &Breached| tested(Found::Breach(log.first_breach(found.requirement)?));
        let breaches: Vec<_> = self.breached.iter().map(first).collect();
        // A driving system that was given up meanwhile drove only some of them.
        if !can_replay(&setup.ads) {
            return;
        }
        let counted = self.collisions.iter_mut().filter(|finding| finding.counted);
        for (finding, recurrence) in counted.zip(collisions) {
            finding.recurrence = recurrence;
        }
        for (found, recurrence) in self.breached.iter_mut().zip(breaches) {
            found.recurrence = recurrence;
        }
    }

    /// Looks for the cause of every counted collision.
    ///
    /// # Errors
    /// If the driving system has no modules.
    pub fn find_causes(&mut self, setup: &Setup, log: &EpisodeLog) -> Result<(), NoModules> {
        for finding in self.collisions.iter_mut().filter(|finding| finding.counted) {
            let diagnosis =
                oracle::diagnose(setup, log, Found::Collision(finding.number), &ModularConfig::default())?;
            finding.cause = Some(diagnosis.cause);
        }
        Ok(())
    }

    /// Number of counted collisions.
    pub fn counted(&self) -> usize {
        self.collisions.iter().filter(|finding| finding.counted).count()
    }

    /// Time to the first counted collision (TTFC), s.
    pub fn first_counted_s(&self) -> Option<f64> {
        let counted = self.collisions.iter().find(|finding| finding.counted)?;
        Some(counted.collision.contact.time_s)
    }
}
