//! An episode that another program steps through, one choice after another: what `python/native` gives to learners that
//! others wrote.
//! If the rows of an episode of `avastra run` are chosen again here under the same seed, the bytes are the same. This
//! does not hold for agents that also choose the values of a row (`space-filling` and the searches), nor for policies
//! with a different observation period.

use std::sync::Arc;

use ndarray::Array1;

use crate::episode::{Choice, Collision, End, EpisodeLog, Moment, Play, Setup, StepLog};
use avastra_base::geometry::smaller;
use avastra_lang::model::{Domain, Value};
use avastra_search::mdp;
use avastra_search::mdp::{Criticality, Observation, RewardSettings, StepOutcome};
use avastra_world::action::Offer;
use avastra_world::sim::World;

use crate::run::arena::legal;
use crate::run::summary::{EpisodeSummary, Finding};

/// An episode under way. A clone goes on exactly as the original would: it is a snapshot and a branch.
#[derive(Clone)]
pub struct Stepped {
    play: Play,
    observation: Observation,
    /// One for each row, at this moment.
    offers: Vec<Offer>,
    end: Option<End>,
    /// The collisions that were judged already, the first of all.
    findings: Vec<Finding>,
    measures: Vec<Measures>,
}

/// How near the ego vehicle came to others in a step. Road users that it had touched before do not count.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measures {
    /// Least distance between the outlines, m; `None` if nobody was there.
    pub distance_m: Option<f64>,
    pub criticality: Criticality,
}

impl Measures {
    fn note(&mut self, world: &World, is_hit: &dyn Fn(u32) -> bool) {
        self.criticality.note(world, is_hit);
        let others = world
            .obstacles()
            .filter(|other| !other.is_apart && !is_hit(other.id))
            .map(|other| other.distance_m);
        self.distance_m = others.chain(self.distance_m).reduce(smaller);
    }

    /// The nearer of two periods.
    #[must_use]
    pub fn and(&self, other: &Measures) -> Measures {
        Measures {
            distance_m: [self.distance_m, other.distance_m].into_iter().flatten().reduce(smaller),
            criticality: self.criticality.and(&other.criticality),
        }
    }
}

/// A row to carry out in a step, with values for some of what it draws.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    pub row: usize,
    /// By the names of parameters, SI. What is not given is drawn beside them; see [`ActionTable::offer_with`].
    ///
    /// [`ActionTable::offer_with`]: avastra_world::action::ActionTable::offer_with
    pub values: Vec<(Arc<str>, Value)>,
}

/// Why a step is not possible.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StepError {
    #[error("the episode has ended (`{end}`): reset it")]
    Over { end: &'static str },
    #[error("no row {row}: the table has rows 0 to {last}")]
    Row { row: usize, last: usize },
    #[error("`{action}` draws no `{name}`")]
    NoDraw { action: String, name: String },
    #[error("that is none of the listed values of `{name}`")]
    NoValue { name: String },
}

impl Stepped {
    /// An episode before its first step. If an external driving system fails at the beginning, it has ended already.
    pub fn new(setup: &Setup) -> Stepped {
        let play = Play::new(setup);
        let observation = play.observation();
        let (offers, findings, measures) = (Vec::new(), Vec::new(), Vec::new());
        let mut begun = Stepped { play, observation, offers, end: None, findings, measures };
        begun.look();
        begun
    }

    pub fn seed(&self) -> u64 {
        self.play.setup().seed
    }

    /// An agent's observation now.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// Which rows are legal now, shape `(rows,)`.
    pub fn legal(&self) -> Array1<bool> {
        legal(&self.offers)
    }

    /// How the episode ended; `None` while it goes on.
    pub fn end(&self) -> Option<End> {
        self.end
    }

    /// The steps so far.
    pub fn steps(&self) -> &[StepLog] {
        self.play.steps()
    }

    /// How near it came to others, for each step so far.
    pub fn measures(&self) -> &[Measures] {
        &self.measures
    }

    /// The setup of the episode.
    pub fn setup(&self) -> &Setup {
        self.play.setup()
    }

    /// The collisions so far.
    pub fn collisions(&self) -> &[Collision] {
        self.play.collisions()
    }

    /// Carries a row out and drives for one observation period. A row that is refused loses the step: nothing happens
    /// in it but driving, as with `None`, or where no row is legal.
    ///
    /// # Errors
    /// If the episode has ended, or there is no such row.
    pub fn step(&mut self, row: Option<usize>) -> Result<(), StepError> {
        self.can_step(row)?;
        let mut offers = std::mem::take(&mut self.offers);
        let is_any_legal = offers.iter().any(Result::is_ok);
        let choice = match row.filter(|_| is_any_legal) {
            Some(row) => Choice::of(row, offers.swap_remove(row)),
            None => Choice::Pass,
        };
        self.drive(choice, &mut |_| {});
        self.look();
        Ok(())
    }

    /// As [`Stepped::step`], with values of the caller.
    ///
    /// # Errors
    /// As there, and if the row draws no such value, or a value that is no number is none of its choices.
    pub fn step_with(&mut self, chosen: &Chosen) -> Result<(), StepError> {
        let choice = self.choice(chosen)?;
        self.drive(choice, &mut |_| {});
        self.look();
        Ok(())
    }

    /// Carries out one choice in each step, and then none until the episode ends; `watch` sees every tick. It is faster than single
    /// steps, because nobody asks what is legal. Where a row is refused, the step's log says why.
    ///
    /// # Errors
    /// As [`Stepped::step_with`].
    pub fn to_the_end(
        &mut self,
        chosen: &[Option<Chosen>],
        watch: &mut dyn FnMut(&World),
    ) -> Result<(), StepError> {
        watch(self.play.world());
        for chosen in chosen.iter().map(Option::as_ref).chain(std::iter::repeat(None)) {
            if self.end.is_some() {
                // What is legal is known again, for a snapshot.
                self.look();
                return Ok(());
            }
            let choice = chosen.map_or(Ok(Choice::Pass), |chosen| self.choice(chosen))?;
            self.drive(choice, watch);
            if self.end.is_none() {
                match self.play.look() {
                    Ok(observation) => self.observation = observation,
                    Err(end) => self.end = Some(end),
                }
            }
        }
        Ok(())
    }

    /// The choice of a row with values of the caller.
    fn choice(&self, Chosen { row, values }: &Chosen) -> Result<Choice, StepError> {
        self.can_step(Some(*row))?;
        let table = &self.play.setup().table;
        let action = &table.space().actions[table.rows()[*row].action];
        for (name, value) in values {
            let Some(parameter) = action.drawn().find(|parameter| parameter.name == *name) else {
                let (action, name) = (action.name.clone(), name.to_string());
                return Err(StepError::NoDraw { action, name });
            };
            let is_number = matches!(parameter.domain, Domain::Range(..));
            if !is_number && !parameter.domain.holds(*value) {
                return Err(StepError::NoValue { name: name.to_string() });
            }
        }
        let judged = |moment: &Moment| table.offer_with(moment.situation, *row, values);
        Ok(Choice::of(*row, self.play.at(&self.observation, judged)))
    }

    /// Drives for one observation period.
    fn drive(&mut self, choice: Choice, watch: &mut dyn FnMut(&World)) {
        let observation = std::mem::replace(&mut self.observation, Observation::zeros());
        let mut hit: Vec<u32> =
            self.collisions().iter().map(|collision| collision.contact.obstacle).collect();
        let mut measures = Measures::default();
        self.end = self.play.step(observation, choice, &mut |world, _, contacts| {
            // The tick of a contact is its nearest.
            measures.note(world, &|id| hit.contains(&id));
            hit.extend(contacts.iter().map(|contact| contact.obstacle));
            watch(world);
        });
        self.measures.push(measures);
    }

    /// Whether [`Stepped::step`] takes that row now.
    ///
    /// # Errors
    /// As there.
    pub fn can_step(&self, row: Option<usize>) -> Result<(), StepError> {
        if let Some(end) = self.end {
            return Err(StepError::Over { end: end.name() });
        }
        let rows = self.play.setup().table.rows().len();
        match row.filter(|row| *row >= rows) {
            Some(row) => Err(StepError::Row { row, last: rows - 1 }),
            None => Ok(()),
        }
    }

    /// Every collision so far, judged. A verdict needs nothing that comes after the step of its collision, so it does not
    /// change any more; each costs a replay of the episode and several of its last seconds.
    pub fn findings(&mut self) -> &[Finding] {
        if self.findings.len() < self.play.collisions().len() {
            self.findings = EpisodeSummary::judged(self.play.setup(), 0, &self.log()).collisions;
        }
        &self.findings
    }

    /// The reward of the last step by Eq. 8, which knows whether a collision counts; 0 before the first step.
    pub fn judged_reward(&mut self, constants: &RewardSettings) -> f64 {
        let Some(step) = self.play.steps().len().checked_sub(1) else { return 0.0 };
        let proc = self.play.steps()[step].proc;
        let collided = self.play.collisions().iter().any(|collision| collision.step == step);
        let counts = |one: &Finding| one.counted && one.collision.step == step;
        let counted = collided && self.findings().iter().any(counts);
        mdp::reward(constants, StepOutcome { proc, collided, counted })
    }

    /// The log of the episode up to now.
    pub fn log(&self) -> EpisodeLog {
        self.play.clone().into_log(self.end.unwrap_or(End::Script))
    }

    /// Looks about after a step. After the last one, too: a learner wants to know what it would have seen next.
    fn look(&mut self) {
        match self.end.map_or_else(|| self.play.look(), Err) {
            Ok(observation) => self.observation = observation,
            Err(end) => {
                self.end = Some(end);
                self.observation = self.play.observation();
            }
        }
        let offers = |moment: &Moment| moment.setup().table.offers(moment.situation);
        self.offers = self.play.at(&self.observation, offers);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use super::*;
    use crate::episode::Outcome;
    use crate::run::{Conditions, Run, RunSettings};
    use avastra_lang::check::{ReadError, load};
    use avastra_world::action::ActionTable;

    /// A run of twelve episodes on the crossroad.
    fn run(ads: &str) -> Arc<Run> {
        let read =
            |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
        let loaded = load(Path::new("../../scenarios/avastra45.ava"), &read).unwrap();
        let space = loaded.space.unwrap();
        let roads = vec!["crossroad".to_owned()];
        let conditions = Conditions { roads, ads: ads.to_owned(), ..Conditions::of(&space) };
        let settings = RunSettings::new(conditions, "random", 12, 5);
        Arc::new(Run::new(ActionTable::new(space), settings).unwrap())
    }

    fn row(step: &StepLog) -> Option<usize> {
        match &step.outcome {
            Outcome::Done { draw, .. } => Some(draw.row),
            Outcome::Refused { row, .. } => Some(*row),
            Outcome::Passed => None,
        }
    }

    /// Chooses the rows of an episode of a run again, and goes on from a branch, too. Number of its collisions.
    fn replayed(run: &Arc<Run>, number: usize) -> usize {
        let (summary, log) = run.judged(number);
        let mut stepped = Stepped::new(&run.setup_of(0, log.seed));
        let mut branch = None;
        for (index, step) in log.steps.iter().enumerate() {
            if index == 2 {
                branch = Some(stepped.clone());
            }
            assert_eq!((&stepped.observation().state, stepped.end()), (&step.state, None));
            stepped.step(row(step)).unwrap();
            let met = stepped.collisions().len();
            // Judged after the step, and judged at the end.
            let (early, late) = (stepped.findings(), &summary.collisions[..met]);
            assert_eq!(early.len(), met);
            assert!(
                early.iter().zip(late).all(|(a, b)| (&a.judgement, a.counted) == (&b.judgement, b.counted))
            );
        }
        assert_eq!(stepped.log(), log);
        assert_eq!(stepped.step(None), Err(StepError::Over { end: log.end.name() }));
        let mut branch = branch.expect("no episode ends so soon");
        log.steps[2..].iter().for_each(|step| branch.step(row(step)).unwrap());
        assert_eq!(branch.log(), log);
        log.collisions.len()
    }

    #[test]
    fn the_rows_of_a_run_come_to_its_bytes() {
        assert_eq!(replayed(&run("modular"), 0), 0);
        assert!(
            replayed(&run("reactive"), 1) > 0,
            "another seed: without a collision no verdicts were compared"
        );
    }

    #[test]
    fn a_refused_row_loses_the_step() {
        let mut stepped = Stepped::new(&run("idm").setup_of(0, 1));
        let rows = stepped.legal().len();
        assert_eq!(stepped.step(Some(rows)), Err(StepError::Row { row: rows, last: rows - 1 }));
        let refused =
            stepped.legal().iter().position(|legal| !legal).expect("some row is illegal at the start");
        let mut passes = stepped.clone();
        stepped.step(Some(refused)).unwrap();
        passes.step(None).unwrap();
        assert!(matches!(stepped.steps()[0].outcome, Outcome::Refused { row, .. } if row == refused));
        assert_eq!(stepped.observation(), passes.observation());
        assert_eq!(stepped.steps()[0].trace, passes.steps()[0].trace);
    }
}
