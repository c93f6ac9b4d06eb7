//! The effects of a row on the world once its parameters are drawn.

use avastra_lang::model::body::OwnBody;
use avastra_lang::model::command::{Command, Told};
use avastra_lang::model::expr::Expr;
use avastra_lang::model::field::{Fields, IgnoredRules, Said};
use avastra_lang::model::vocabulary::{
    Body, Colour, LaneChoice, Level, LightColour, Phenomenon, Side, Then, TimeOfDay, Verb,
};
use avastra_lang::model::{
    Memory, MomentFacts, NpcFacts, Space, SpawnFacts, StateDef, StateMeaning, spawn_out_of_bounds,
};

use super::later::{Later, LaterMoment};

/// One change of the world. A row has one or more, applied in order.
#[expect(clippy::large_enum_variant, reason = "a draw has few effects, and requests are plain data")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Effect {
    Time(TimeOfDay),
    /// Sets one phenomenon and leaves the others.
    Sky(Phenomenon, Level),
    Spawn(SpawnRequest),
    Order(OrderRequest),
    Light(LightRequest),
}

/// The colour that the ego vehicle's next traffic light is to show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightRequest {
    pub colour: LightColour,
    /// How far the ego vehicle's front is before its line then, m; `None`: at once.
    pub at_m: Option<f64>,
}

/// An order to the latest bearer of a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderRequest {
    /// The name, by its index in the space.
    pub bearer: usize,
    /// Empty for an order of a manoeuvre alone.
    pub command: Command,
    /// The commands of its manoeuvre's phases.
    pub phases: Told,
}

impl OrderRequest {
    /// Why no road user of that kind can get this order, in words; `None` if it can.
    pub fn impossible(&self, verb: Verb) -> Option<String> {
        self.command.impossible(verb).or_else(|| self.phases.lacked_by(verb))
    }
}

/// Why a gap to an absent road user cannot be kept, in words that complete "cannot order `NAME`: …".
pub(crate) const GAP_TO_NOBODY: &str = "nobody is there to whom it is to keep a gap";
pub(crate) const GAP_TO_ITSELF: &str = "it keeps no gap to itself";

/// A road user that is to appear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpawnRequest {
    pub body: Body,
    pub colour: Colour,
    pub verb: Verb,
    /// Lane of `DriveAhead` and `Overtake`; ignored by the other verbs.
    pub lane: LaneChoice,
    /// Where `CrossRoad` and `Walk` come from; ignored by the other verbs.
    pub side: Side,
    pub then: Then,
    /// Cruising speed, m/s.
    pub speed_mps: f64,
    /// Gap to the ego vehicle along its route, m; behind the ego vehicle for `Overtake`. `world::place`
    /// says for each verb what exactly lies at that distance.
    pub distance_m: f64,
    /// The author's own body that is meant, in place of `body` and of `cover`.
    pub own: Option<OwnBody>,
    pub cover_own: Option<OwnBody>,
    /// A vehicle that is parked with it, so that it steps out from behind; for `Walk` alone.
    pub cover: Option<Body>,
    /// The other fields of its command.
    pub told: Fields<Said>,
    /// The trajectory that it follows; `distance_m` is then its station there.
    pub trajectory: Option<OnTrajectory>,
    /// How far it drives behind the first one of its row, m; for `CrossRoad`, where the distance is that of their meeting place.
    pub behind_first_m: f64,
    /// The distance of the first one of its row, m, whose lane it shares; `None` for that one and for one alone.
    pub first_m: Option<f64>,
    /// The name that it bears, by its index in the space.
    pub bearer: Option<usize>,
}

/// A trajectory that a road user follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnTrajectory {
    /// In the space.
    pub index: usize,
    /// Where one begins that lies beside the ego vehicle's route. The station is then 0.
    pub begins: Option<Begins>,
}

/// Where a way beside the ego vehicle's route begins, along that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Begins {
    /// So far before its front, m; below 0 behind that.
    BeforeFront(f64),
    /// So far behind its rear, m.
    BehindRear(f64),
}

impl SpawnRequest {
    /// A sedan or a pedestrian that appears in the ego vehicle's lane, or from the right.
    pub fn new(verb: Verb, distance_m: f64, speed_mps: f64) -> SpawnRequest {
        SpawnRequest {
            body: if verb.is_on_foot() { Body::Pedestrian } else { Body::Sedan },
            colour: Colour::Red,
            verb,
            lane: LaneChoice::Current,
            side: Side::Right,
            then: Then::Keep,
            speed_mps,
            distance_m,
            own: None,
            cover_own: None,
            cover: None,
            told: Fields::default(),
            trajectory: None,
            behind_first_m: 0.0,
            first_m: None,
            bearer: None,
        }
    }

    /// m to the left of the middle of its lane.
    pub fn offset_m(&self) -> f64 {
        self.told.offset_m().unwrap_or(0.0)
    }

    /// The rules of the road that it ignores.
    pub fn ignores(&self) -> IgnoredRules {
        self.told.ignores().unwrap_or_default()
    }

    pub fn has_siren(&self) -> bool {
        self.told.siren() == Some(true)
    }

    /// Why the world must not be asked for this, whatever the rules say; `None` if it may.
    pub fn out_of_bounds(&self) -> Option<String> {
        let placed = spawn_out_of_bounds(self.verb, self.speed_mps, self.distance_m);
        placed.or_else(|| self.told.out_of_bounds("spawn"))
    }
}

impl Effect {
    /// The effect of a state's cell on the world: none if the state is the author's own record.
    pub(super) fn of_cell(state: &StateDef, cell: usize, memory: &Memory) -> Option<Effect> {
        let value = memory.cells()[state.first_cell + cell].variant();
        match &state.meaning {
            StateMeaning::Private => None,
            StateMeaning::Time(words) => Some(Effect::Time(words[value])),
            StateMeaning::Sky(phenomena, levels) => Some(Effect::Sky(phenomena[cell], levels[value])),
        }
    }

    /// The effects of a change of the memory on the world.
    pub(super) fn of_change(space: &Space, before: &Memory, after: &Memory) -> Vec<Effect> {
        let cells = space.states.iter().flat_map(|state| (0..state.cells).map(move |cell| (state, cell)));
        let changed = cells.filter(|(state, cell)| {
            let cell = state.first_cell + cell;
            before.cells()[cell] != after.cells()[cell]
        });
        changed.filter_map(|(state, cell)| Effect::of_cell(state, cell, after)).collect()
    }

    /// The author's own bodies among the newcomers: id of the road user, and index of the body in the space. `first` is
    /// the id of the first newcomer.
    pub fn own_bodies(&self, first: u32) -> impl Iterator<Item = (u32, usize)> {
        let own = match self {
            Effect::Spawn(request) => [request.own, request.cover_own],
            Effect::Time(_) | Effect::Sky(..) | Effect::Order(_) | Effect::Light(_) => [None, None],
        };
        (first..).zip(own).filter_map(|(id, own)| Some((id, own?.index)))
    }

    /// How many road users it makes appear. Their ids follow each other; the one that was asked for is the first.
    pub fn newcomers(&self) -> u32 {
        match self {
            Effect::Spawn(request) => 1 + u32::from(request.cover.is_some()),
            Effect::Time(_) | Effect::Sky(..) | Effect::Order(_) | Effect::Light(_) => 0,
        }
    }
}

/// The rules in force on the lane changes of a commanded road user (`during change`), with the values of its action.
#[derive(Debug, Clone, PartialEq)]
pub struct LaneChangeRules {
    pub(super) conditions: Vec<Expr>,
    pub(super) later: Later,
}

impl LaneChangeRules {
    /// Whether a lane change may begin at a moment.
    pub fn allow(&self, moment: MomentFacts, npc: NpcFacts) -> bool {
        let moment = LaterMoment { moment, npc, bearers: Vec::new() };
        self.conditions.iter().all(|condition| self.later.value(condition, &moment).truth())
    }
}

/// The questions that the action table may ask the world.
pub trait Surroundings {
    /// Where a spawn would put its road user, in numbers; or why it cannot, in words.
    ///
    /// # Errors
    /// A reason that completes "cannot spawn: …", for example `no lane on the left`.
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String>;

    /// Facts about the ego vehicle and its surroundings now.
    fn moment(&self) -> MomentFacts;

    /// Surroundings for many questions about this moment, which find once what the questions have in common; `None` if
    /// nothing is gained by that.
    fn for_many(&self) -> Option<Box<dyn Surroundings + '_>> {
        None
    }

    /// Facts about the latest bearer of a name, if there is one.
    fn bearer(&self, _who: usize) -> Option<NpcFacts> {
        None
    }

    /// Why an order cannot be given now, in words that complete "cannot order `NAME`: …".
    fn order_refusal(&self, _order: &OrderRequest) -> Option<String> {
        None
    }

    /// Why an order to the ego vehicle's next traffic light cannot be given now, in words.
    fn light_refusal(&self, _light: &LightRequest) -> Option<String> {
        None
    }

    /// Why the time of day and the weather cannot change now, in words.
    fn weather_refusal(&self) -> Option<String> {
        None
    }
}
