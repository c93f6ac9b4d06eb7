//! An emitted scenario played again, and its claims checked.

use std::sync::Arc;

use crate::episode;
use crate::episode::{Breach, EpisodeLog, Script, Watch};
use crate::oracle;
use crate::oracle::{
    ClaimResult, Found, Judgement, NoModules, NoTries, REPLAYS, Recurrence, Replayed, Replays, can_replay,
};
use avastra_drivers::{ModularConfig, Selected};
use avastra_lang::model::{Claim, RulesInForce, Scenario, digest_text};
use avastra_search::mdp::ProcKind;
use avastra_world::action::ActionTable;
use avastra_world::sim::{ENGINE, Scene, Start, TrafficProfile};

use crate::run::profile::recorded_traffic;
use crate::run::settings::RunError;

/// A scenario that is ready to play: its road and the rules that it was made with.
pub struct Stage<'a> {
    table: ActionTable,
    scenario: &'a Scenario,
    rules: Arc<RulesInForce>,
    scene: Arc<Scene>,
    traffic: TrafficProfile,
}

impl<'a> Stage<'a> {
    /// # Errors
    /// If the scenario was made in another world, or with rules or traffic that do not exist.
    pub fn new(table: &ActionTable, scenario: &'a Scenario) -> Result<Stage<'a>, RunError> {
        let origin = &scenario.origin;
        if let Some(engine) = origin.engine.as_ref().filter(|engine| engine.as_str() != ENGINE) {
            return Err(RunError::Engine { scenario: scenario.name.clone(), engine: engine.clone() });
        }
        let rules = RulesInForce::new(table.space(), &origin.with, &origin.without)?;
        let scene = Arc::new(Scene::of(&table.space().roads[scenario.road]));
        let traffic = recorded_traffic(scenario)?;
        Ok(Stage { table: table.clone(), scenario, rules: Arc::new(rules), scene, traffic })
    }

    /// The beginning of its episode, with any driving system.
    pub fn setup(&self, ads: &Selected) -> episode::Setup {
        let space = self.table.space();
        let start = &self.scenario.start;
        let seed = self.scenario.origin.seed.unwrap_or(0);
        let memory = start.memory.clone();
        episode::Setup {
            table: self.table.clone(),
            road_index: self.scenario.road,
            scene: self.scene.clone(),
            rules: self.rules.clone(),
            ads: ads.clone(),
            seed,
            start: Start {
                signal_phase_s: start.signal_phase_s,
                seed: start.traffic_seed.unwrap_or(seed),
                ambient: start.ambient,
                ego_mps: start.ego_mps,
                traffic: self.traffic,
                ..Start::drawn(space, &space.roads[self.scenario.road], &memory, seed)
            },
            memory,
            proc: ProcKind::default(),
        }
    }

    /// Most replays of a test whether its findings recur, as far as its claims tell; 0 without such a claim. A test that was sure
    /// early claims few replays, and had more.
    pub fn most_replays(&self) -> u32 {
        let most = self.scenario.claims.iter().map(|claim| match claim {
            Claim::Recurrence { recurred, replays, from: None, .. } => {
                let known = Recurrence { recurred: *recurred, replays: *replays };
                if known.is_settled(REPLAYS) { REPLAYS.max(*replays) } else { *replays }
            }
            _ => 0,
        });
        most.max().unwrap_or(0)
    }

    /// Plays it as it is written down.
    pub fn play(&self, ads: &Selected, watch: &mut Watch) -> EpisodeLog {
        let script = Script::of_scenario(self.scenario);
        episode::run_watched(&self.setup(ads), &mut |moment| script.choose(moment), watch)
    }

    /// Plays it, and finds its first counted collision, if there is one.
    pub fn first_counted(&self, ads: &Selected) -> (EpisodeLog, Vec<Judgement>, Option<usize>) {
        let log = self.play(ads, &mut |_, _, _| {});
        let judgements = self.judge(ads, &log);
        let first = oracle::counted(self.table.space(), &log, &judgements).first().copied();
        (log, judgements, first)
    }

    /// Plays it, and finds its subject: the first of the counted collisions and breaches that the file claims and that
    /// happen. If the file claims none, the first counted collision.
    pub fn first_found(&self, ads: &Selected) -> (EpisodeLog, Vec<Judgement>, Option<Found>) {
        let log = self.play(ads, &mut |_, _, _| {});
        let judgements = self.judge(ads, &log);
        let counted = oracle::counted(self.table.space(), &log, &judgements);
        let claimed = |claim: &Claim| match claim {
            Claim::Breach { requirement, .. } => {
                let is_meant = |breach: &Breach| {
                    self.table.space().requirements[breach.requirement].name == *requirement
                };
                log.breaches.iter().position(is_meant).map(Found::Breach)
            }
            Claim::Collision { obstacle, .. } => {
                let is_meant = |index: &&usize| {
                    let hit = log.collisions[**index].contact.obstacle;
                    obstacle.is_none_or(|obstacle| obstacle.number == hit)
                };
                counted.iter().find(is_meant).copied().map(Found::Collision)
            }
            _ => None,
        };
        let found = match self.scenario.claims_a_finding() {
            true => self.scenario.claims.iter().find_map(claimed),
            false => counted.first().copied().map(Found::Collision),
        };
        (log, judgements, found)
    }

    /// The reason why [`Stage::first_found`] finds nothing, in words that follow its name.
    pub fn lack_in_words(&self) -> &'static str {
        match self.scenario.claims_a_finding() {
            true => "has none of the collisions and breaches that it claims",
            false => "has no counted collision",
        }
    }

    /// Indices of the collisions that the space's verdict counts, in a log of this scenario.
    pub fn counted(&self, ads: &Selected, log: &EpisodeLog) -> Vec<usize> {
        oracle::counted_at_need(self.table.space(), log, || self.judge(ads, log))
    }

    /// Whether a log of it is the recorded episode, to the bit; `None` if the scenario does not say.
    pub fn is_as_recorded(&self, log: &EpisodeLog) -> Option<bool> {
        self.scenario.claims.iter().find_map(|claim| match claim {
            Claim::Trace(digest) => Some(*digest == digest_text(&log.trace())),
            _ => None,
        })
    }

    /// Checks its claims against a log of it.
    pub fn verify(&self, ads: &Selected, log: &EpisodeLog) -> Vec<ClaimResult> {
        let setup = self.setup(ads);
        let judgements = self.judge(ads, log);
        let script = Script::of_scenario(self.scenario);
        // Played once, for all claims that need it.
        let again = Replayed::new(&setup, &script, log);
        let replays = Replays {
            recurrence: &|found, from_s, replays| match (can_replay(ads), from_s) {
                (false, _) => Err(NoTries),
                (true, None) => Ok(again.recurrence(found, replays)),
                (true, Some(from_s)) => Ok(oracle::recurrence_from(&setup, log, found, from_s, replays)),
            },
            cause: &|index| {
                Ok(oracle::diagnose(&setup, log, Found::Collision(index), &ModularConfig::default())?.cause)
            },
            breached: &|| Some(oracle::breached(&setup, &script, log)),
            spare_steps: &|index| {
                if ads.program().is_some_and(|program| !program.can_start()) {
                    return Err(NoTries);
                }
                Ok(oracle::spare_steps(&setup, log, index, &judgements, self.most_replays()))
            },
        };
        oracle::verify(self.table.space(), self.scenario, log, &judgements, &replays)
    }

    /// The claims that a log of it refutes, among those that `asked` selects. Claims that need further plays (causes,
    /// recurrence, minimality) count as not tried. `judgements` has one for each collision, if one of these claims is about
    /// verdicts.
    pub fn refuted(
        &self,
        ads: &Selected,
        log: &EpisodeLog,
        judgements: &[Judgement],
        asked: impl Fn(&Claim) -> bool,
    ) -> Vec<ClaimResult> {
        let claims = self.scenario.claims.iter().filter(|claim| asked(claim)).cloned().collect();
        let scenario = Scenario { claims, ..self.scenario.clone() };
        let replays = Replays {
            cause: &|_| Err(NoModules { ads: ads.title() }),
            breached: &|| None,
            recurrence: &|_, _, _| Err(NoTries),
            spare_steps: &|_| Err(NoTries),
        };
        let mut results = oracle::verify(self.table.space(), &scenario, log, judgements, &replays);
        results.retain(ClaimResult::is_refuted);
        results
    }

    /// Judges the collisions of its log, by playing it again.
    pub fn judge(&self, ads: &Selected, log: &EpisodeLog) -> Vec<Judgement> {
        oracle::judge(&self.setup(ads), &Script::of_scenario(self.scenario), log)
    }
}
