//! Cells that another study has played already. A cell depends on its agent's settings, its road, its number and what
//! all agents of a study share. It does not depend on the agent's label or on the other agents of the study.

use crate::run::Conditions;
use crate::study::job::Job;
use crate::study::record::CellRecord;
use crate::study::settings::{AgentSettings, StudySettings};

impl StudySettings {
    /// The jobs of this study that another one has played: the cells of each, under this one's labels.
    ///
    /// # Errors
    /// If the two studies play differently: the settings in which they differ.
    pub fn played_elsewhere(
        &self,
        other: &StudySettings,
        cells: &[CellRecord],
    ) -> Result<Vec<(Job, Vec<CellRecord>)>, Vec<&'static str>> {
        let differences = self.plays_otherwise(other);
        if !differences.is_empty() {
            return Err(differences);
        }
        let played = |job: Job| {
            let agent = &self.agents[job.agent];
            let same: Vec<&AgentSettings> =
                other.agents.iter().filter(|one| self.is_same(agent, other, one)).collect();
            let on_road = |&road: &usize| {
                let is_it = |cell: &&CellRecord| {
                    cell.road == self.conditions.roads[road]
                        && cell.number == job.number
                        && same.iter().any(|one| one.label == cell.agent)
                };
                let cell = cells.iter().find(is_it)?;
                Some(CellRecord { agent: agent.label.clone(), ..cell.clone() })
            };
            let cells = job.roads.iter().map(on_road).collect::<Option<Vec<_>>>()?;
            Some((job, cells))
        };
        Ok(self.jobs().into_iter().filter_map(played).collect())
    }

    /// The settings of all agents in which two studies differ.
    fn plays_otherwise(&self, other: &StudySettings) -> Vec<&'static str> {
        let StudySettings {
            conditions,
            first_seed,
            evaluation,
            causes,
            avoidability,
            // `is_same` compares agents, with their profiles and rules; the rest is no part of a cell.
            question: _,
            quick: _,
            agents: _,
            baselines: _,
        } = self;
        let Conditions {
            avastra,
            engine,
            space_digest,
            ads,
            external,
            ambient,
            traffic,
            space: _,
            roads: _,
            profile: _,
            without: _,
            with: _,
        } = conditions;
        let theirs = &other.conditions;
        let same = [
            ("avastra", *avastra == theirs.avastra),
            ("engine", *engine == theirs.engine),
            ("space", *space_digest == theirs.space_digest),
            // A program that is attached need not do the same twice.
            ("ads", *ads == theirs.ads && external.is_none() && theirs.external.is_none()),
            ("ambient", *ambient == theirs.ambient),
            ("traffic", *traffic == theirs.traffic),
            ("first_seed", *first_seed == other.first_seed),
            ("evaluation", *evaluation == other.evaluation),
            ("causes", *causes == other.causes),
            ("avoidability", *avoidability == other.avoidability),
        ];
        same.into_iter().filter(|(_, is_same)| !is_same).map(|(name, _)| name).collect()
    }

    /// Whether an agent is one of another study, but for its label and how often it is repeated.
    fn is_same(&self, agent: &AgentSettings, other: &StudySettings, one: &AgentSettings) -> bool {
        let AgentSettings { name, searched, training, profile, without, with, label: _, repeats: _ } = agent;
        *name == one.name
            && *searched == one.searched
            && *training == one.training
            && profile.as_ref().or(self.conditions.profile.as_ref())
                == one.profile.as_ref().or(other.conditions.profile.as_ref())
            && *without == one.without
            && *with == one.with
    }
}
