//! Where episodes are played: a space with its roads, a driving system and the rules in force.

use std::collections::BTreeSet;
use std::sync::Arc;

use ndarray::Array1;

use crate::episode;
use crate::episode::{Choice, Moment};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_drivers::Selected;
use avastra_drivers::external::{Attached, Program};
use avastra_lang::model::{Reach, Road, Row, RulesInForce, Space};
use avastra_lang::prove;
use avastra_lang::syntax::listed;
use avastra_search::agent::{Agent, Mask};
use avastra_search::mdp::ProcKind;
use avastra_world::action::{ActionTable, Draw, Offer};
use avastra_world::sim::{Scene, Start, TrafficProfile};

use crate::run::profile::{traffic_of, under_test};
use crate::run::settings::{Conditions, RunError};

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

    /// The arena of some conditions, with the driving system and the traffic that they record.
    ///
    /// # Errors
    /// As [`Arena::new`], and if the driving system or the traffic cannot be had as recorded.
    pub(crate) fn under(table: ActionTable, conditions: &Conditions) -> Result<Arena, RunError> {
        let Conditions { roads, ads, profile, external, traffic, with, without, .. } = conditions;
        let ads = under_test(ads, profile.as_ref(), external.as_ref())?;
        let traffic = traffic_of(traffic.as_ref())?;
        Ok(Arena::new(table, roads, ads, with, without)?.with_traffic(traffic))
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

    /// The identity of an external driving system.
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

/// Lets an agent choose among the offers of the moment. If no row is legal, the step passes.
pub fn choose(agent: &mut dyn Agent, moment: &Moment) -> Choice {
    let mut offers = Offers::of(agent, moment);
    let row = offers.chosen_by(agent);
    offers.choice(row)
}

/// The offers of all rows at this moment. A row is judged when a caller asks for it.
pub(crate) struct Offers<'a> {
    moment: &'a Moment<'a>,
    shares: Vec<f64>,
    /// By row.
    judged: Vec<Option<Offer>>,
}

impl<'a> Offers<'a> {
    /// As the agent wants the values drawn.
    pub fn of(agent: &mut dyn Agent, moment: &'a Moment<'a>) -> Offers<'a> {
        let table = &moment.setup().table;
        agent.weigh(&|| table.odds(moment.situation));
        let shares = agent.draw_shares(moment.step, moment.situation.seed).to_vec();
        Offers { moment, shares, judged: vec![None; table.rows().len()] }
    }

    /// The row that the agent chooses, from its own randomness in this step.
    pub fn chosen_by(&mut self, agent: &mut dyn Agent) -> Option<usize> {
        let Moment { situation, step, observation, .. } = *self.moment;
        let mut rng = rng::stream(situation.seed, Stream::Exploration, step as u64);
        agent.choose(observation, self, &mut rng)
    }

    /// The choice for the step if that row is chosen; without a row nothing happens.
    pub fn choice(mut self, row: Option<usize>) -> Choice {
        row.map_or(Choice::Pass, |row| {
            self.is_legal(row);
            Choice::of(row, self.judged.swap_remove(row).expect("it was judged"))
        })
    }

    /// Which rows are legal, shape `(rows,)`.
    pub fn legal(&mut self) -> Array1<bool> {
        self.all().unwrap_or_else(|| Array1::from_elem(self.rows(), false))
    }

    /// The draws, by row: nothing for a row that is refused or was not judged.
    pub fn draws(&self) -> impl Iterator<Item = Option<&Draw>> {
        self.judged.iter().map(|offer| offer.as_ref()?.as_ref().ok())
    }

    /// The judged offers, by row.
    pub fn judged(&self) -> &[Option<Offer>] {
        &self.judged
    }
}

impl Mask for Offers<'_> {
    fn is_legal(&mut self, row: usize) -> bool {
        let Moment { situation, .. } = *self.moment;
        let judge = || self.moment.setup().table.offer_at(situation, row, &self.shares);
        self.judged[row].get_or_insert_with(judge).is_ok()
    }

    fn all(&mut self) -> Option<Array1<bool>> {
        if self.judged.contains(&None) {
            let all = self.moment.setup().table.offers_at(self.moment.situation, &self.shares);
            self.judged = all.into_iter().map(Some).collect();
        }
        let legal: Array1<bool> = self.judged.iter().map(|offer| matches!(offer, Some(Ok(_)))).collect();
        legal.iter().any(|is_legal| *is_legal).then_some(legal)
    }

    fn rows(&self) -> usize {
        self.judged.len()
    }
}

/// Which of the offers are legal, shape `(rows,)`.
pub(crate) fn legal(offers: &[Offer]) -> Array1<bool> {
    offers.iter().map(Result::is_ok).collect()
}

/// The first name that comes a second time.
fn twice<'a>(names: impl IntoIterator<Item = &'a String>) -> Option<String> {
    let mut seen = BTreeSet::new();
    names.into_iter().find(|name| !seen.insert(*name)).cloned()
}
