//! Where episodes are played: a space with its roads, a driving system and the rules in force.

use std::collections::BTreeSet;
use std::sync::Arc;

use ndarray::Array1;

use crate::episode;
use crate::episode::{Choice, Moment};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_drivers::Selected;
use avastra_drivers::external::{Attached, Program};
use avastra_lang::model::{Reach, Road, Row, RulesInForce, Space};
use avastra_lang::prove;
use avastra_lang::syntax::listed;
use avastra_search::agent::Agent;
use avastra_search::mdp::ProcKind;
use avastra_world::action::{ActionTable, Offer};
use avastra_world::sim::{Scene, Start, TrafficProfile};

use crate::run::offered::Offered;
use crate::run::settings::RunError;

/// Everything that the episodes of a run or a training share.
pub struct Arena {
    table: ActionTable,
    rules: Arc<RulesInForce>,
    ads: Selected,
    traffic: TrafficProfile,
    /// Index of each road in the space, with its scene.
    roads: Vec<(usize, Arc<Scene>)>,
}

impl Arena {
    /// Looks the names up: of roads, and of the rules that are switched on (`with`) and off (`without`).
    ///
    /// # Errors
    /// If a road or a rule does not exist, or is named twice, or no episode can begin under the rules.
    pub fn new(
        table: ActionTable,
        roads: &[String],
        ads: Selected,
        with: &[String],
        without: &[String],
    ) -> Result<Arena, RunError> {
        if let Some(name) = twice(roads).or_else(|| twice(with.iter().chain(without))) {
            return Err(RunError::Twice { name });
        }
        let space = table.space();
        let roads = roads.iter().map(|name| {
            let index = road_named(space, name)?;
            Ok((index, Arc::new(Scene::of(&space.roads[index]))))
        });
        let roads: Vec<(usize, Arc<Scene>)> = roads.collect::<Result<_, RunError>>()?;
        let rules = RulesInForce::new(space, with, without)?;
        for (index, _) in &roads {
            space.memory_at_start(&space.roads[*index], &rules, 0)?;
            // The rules by default were shown to last when the space was checked.
            if rules != RulesInForce::by_default(space) {
                prove::lasts(space, &space.roads[*index], &rules)?;
            }
        }
        Ok(Arena { table, rules: Arc::new(rules), ads, traffic: TrafficProfile::default(), roads })
    }

    /// The same arena, in which other vehicles drive by another profile.
    pub fn with_traffic(self, traffic: TrafficProfile) -> Arena {
        Arena { traffic, ..self }
    }

    pub fn table(&self) -> &ActionTable {
        &self.table
    }

    pub fn rules(&self) -> &RulesInForce {
        &self.rules
    }

    /// The driving system under test.
    pub fn ads(&self) -> &Selected {
        &self.ads
    }

    /// The driving system: its name here, or what an external one calls itself.
    pub fn ads_name(&self) -> String {
        self.ads.title()
    }

    /// The external driving system, if it is one.
    pub fn program(&self) -> Option<&Arc<Program>> {
        self.ads.program()
    }

    /// What identifies an external driving system.
    pub fn attached(&self) -> Option<Attached> {
        Some(self.ads.program()?.attached())
    }

    /// Number of roads.
    pub fn roads(&self) -> usize {
        self.roads.len()
    }

    /// Each road with each row that its rules let run there. Rules that are switched on or off may change that: then every
    /// row is taken, and its refusals are told.
    pub fn rows_on_roads(&self) -> Vec<(usize, usize)> {
        let space = self.table.space();
        let is_usual = *self.rules == RulesInForce::by_default(space);
        let runs = |row: &Row, road: usize| !is_usual || matches!(row.roads[road], Reach::Open(_));
        let roads = self.roads.iter().enumerate();
        roads
            .flat_map(|(nth, (road, _))| {
                let rows = space.rows.iter().filter(move |row| runs(row, *road));
                rows.map(move |row| (nth, row.index))
            })
            .collect()
    }

    /// The nth of the roads.
    pub fn road(&self, road: usize) -> &Road {
        &self.table.space().roads[self.roads[road].0]
    }

    /// An episode of a seed on the nth of the roads.
    pub fn setup(&self, road: usize, seed: u64) -> episode::Setup {
        let (index, scene) = &self.roads[road];
        let space = self.table.space();
        let road = &space.roads[*index];
        let memory = space.memory_at_start(road, &self.rules, seed);
        let memory = memory.expect("the arena was made with a start on each road");
        episode::Setup {
            table: self.table.clone(),
            road_index: *index,
            scene: scene.clone(),
            rules: self.rules.clone(),
            ads: self.ads.clone(),
            seed,
            start: Start { traffic: self.traffic, ..Start::drawn(space, road, &memory, seed) },
            memory,
            period_shifts: Vec::new(),
            proc: ProcKind::default(),
        }
    }
}

/// Index of a road of the space.
///
/// # Errors
/// If there is none of that name; the message lists those there are.
pub fn road_named(space: &Space, name: &str) -> Result<usize, RunError> {
    space.roads.iter().position(|road| road.name == name).ok_or_else(|| {
        let known = listed(&space.roads.iter().map(|road| road.name.as_str()).collect::<Vec<_>>());
        RunError::Road { name: name.to_owned(), known }
    })
}

/// Lets an agent choose among the offers of the moment. If no row is legal, the step passes. Returns the choice, and
/// which rows are legal, shape `(rows,)`: all of them for an agent that does not look at the mask.
pub fn choose(agent: &mut dyn Agent, moment: &Moment) -> (Choice, Array1<bool>) {
    if agent.looks_at_mask() {
        let offers = offers(agent, moment);
        let legal = legal(&offers);
        return (carry_out(offers, legal.view(), agent, moment), legal);
    }
    let table = &moment.setup().table;
    let offer = |row| table.offer(moment.situation, row);
    let all = Array1::from_elem(table.rows().len(), true);
    if !(0..all.len()).any(|row| offer(row).is_ok()) {
        return (Choice::Pass, all);
    }
    let mut rng = exploration(moment);
    let chosen = agent.choose(moment.observation, all.view(), &mut rng);
    (chosen.map_or(Choice::Pass, |row| Choice::of(row, offer(row))), all)
}

/// Lets an agent choose that asks for a few rows alone. What became of the first one is noted.
pub(crate) fn choose_only(agent: &mut dyn Agent, moment: &Moment, offered: &mut Offered) -> Choice {
    let table = &moment.setup().table;
    let rows = agent.only().to_vec();
    let mut legal = Array1::from_elem(table.rows().len(), false);
    let mut offers: Vec<(usize, Offer)> = Vec::new();
    for row in rows {
        let offer = table.offer(moment.situation, row);
        if offers.is_empty() {
            offered.note_one(table.rows().len(), row, &offer);
        }
        legal[row] = offer.is_ok();
        offers.push((row, offer));
        if legal[row] {
            break;
        }
    }
    let chosen = agent.choose(moment.observation, legal.view(), &mut exploration(moment));
    let chosen = chosen.and_then(|row| offers.into_iter().find(|(asked, _)| *asked == row));
    chosen.map_or(Choice::Pass, |(row, offer)| Choice::of(row, offer))
}

/// What each row would do now.
pub(crate) fn offers(agent: &mut dyn Agent, moment: &Moment) -> Vec<Offer> {
    agent.weigh(&|| moment.setup().table.odds(moment.situation));
    let shares = agent.draw_shares(moment.step, moment.situation.seed);
    moment.setup().table.offers_at(moment.situation, shares)
}

/// The agent's own randomness in this step.
fn exploration(moment: &Moment) -> Rng {
    rng::stream(moment.situation.seed, Stream::Exploration, moment.step as u64)
}

/// Which of the offers are legal, shape `(rows,)`.
pub(crate) fn legal(offers: &[Offer]) -> Array1<bool> {
    offers.iter().map(Result::is_ok).collect()
}

/// The agent's choice among the offers.
pub(crate) fn carry_out(
    mut offers: Vec<Offer>,
    legal: ndarray::ArrayView1<bool>,
    agent: &mut dyn Agent,
    moment: &Moment,
) -> Choice {
    if !legal.iter().any(|&is_legal| is_legal) {
        return Choice::Pass;
    }
    let row = agent.choose(moment.observation, legal, &mut exploration(moment));
    row.map_or(Choice::Pass, |row| Choice::of(row, offers.swap_remove(row)))
}

/// The first name that comes a second time.
fn twice<'a>(names: impl IntoIterator<Item = &'a String>) -> Option<String> {
    let mut seen = BTreeSet::new();
    names.into_iter().find(|name| !seen.insert(*name)).cloned()
}
