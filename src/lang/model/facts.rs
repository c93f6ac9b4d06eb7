//! The facts that an expression may read at a moment: of the road, the ego vehicle, others, a spawn and an outcome.

use std::sync::Arc;

use avastra_base::units::Rational;

use crate::model::body::BodyWord;
use crate::model::on_route::Stretch;
use crate::model::value::{Memory, Value};
use crate::model::vocabulary::{Crossing, LaneChoice, Light, Priority, RoadKind, Turn};

/// The value of a fact that nobody looked up.
pub trait Unknown {
    const UNKNOWN: Self;
}

macro_rules! unknown {
    ($($of:ty = $unknown:expr;)+) => { $(impl Unknown for $of { const UNKNOWN: $of = $unknown; })+ };
}

unknown! {
    f64 = f64::NAN;
    bool = false;
    Crossing = Crossing::None;
    Light = Light::None;
    LightTimes = LightTimes { since_s: f64::NAN, left_s: f64::NAN };
    Priority = Priority::None;
    RoadKind = RoadKind::OneWay;
    Turn = Turn::None;
}

/// Declares a struct of facts whose default has looked up nothing.
macro_rules! of_facts {
    ($(#[$of:meta])* pub struct $name:ident { $($(#[$doc:meta])* pub $field:ident: $ty:ty,)+ }) => {
        $(#[$of])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name { $($(#[$doc])* pub $field: $ty),+ }

        impl Default for $name {
            fn default() -> $name {
                $name { $($field: Unknown::UNKNOWN),+ }
            }
        }
    };
}

/// The facts that an expression may read. Facts that are not known at its place in the file keep their
/// defaults.
#[derive(Debug, Clone, Copy)]
pub struct Facts<'a> {
    /// The parameters of the action or function around it.
    pub locals: &'a [Value],
    pub memory: &'a Memory,
    pub road: Option<&'a RoadFacts>,
    pub world: Option<&'a WorldFacts>,
    /// The spawn that the expression is about.
    pub spawn: Option<SpawnFacts>,
    pub outcome: OutcomeFacts,
    /// The smallest margin of each requirement in the step, NaN for a requirement that was not asked.
    pub margins: &'a [f64],
}

/// The facts of the world that rules may ask at a draw ([`Known::World`] and later).
///
/// [`Known::World`]: crate::model::vocabulary::Known::World
#[derive(Debug, Clone, Default)]
pub struct WorldFacts {
    pub moment: MomentFacts,
    /// Number of the step.
    pub step: u64,
    /// Each spawn of the action for which the world has found a place.
    pub spawns: Vec<SpawnFacts>,
    /// Those that are asked for by number and are there.
    pub road_users: Vec<(u32, NpcFacts)>,
    /// Those that are asked for by name and are there.
    pub bearers: Vec<(usize, NpcFacts)>,
    /// Those near, if a requirement asks of them.
    pub near: Vec<NearFacts>,
    /// Facts for requirements alone.
    pub tick: TickFacts,
    /// When each action last happened, s since the episode began; empty if nothing asks for that.
    pub happened_s: Vec<f64>,
}

/// A road user near the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearFacts {
    pub id: u32,
    pub body: BodyWord,
    pub npc: NpcFacts,
}

impl NearFacts {
    /// Whether it has one of these bodies; any will do where there is none.
    pub fn is_of(&self, bodies: &[BodyWord]) -> bool {
        bodies.is_empty() || bodies.iter().any(|named| self.body.is(*named))
    }
}

/// Stands for a road user ahead that is farther away, and for none at all, m.
pub const LEAD_GAP_M_MAX: f64 = 1000.0;

of_facts! {
    /// The facts watched over time for requirements ([`Known::Tick`]).
    ///
    /// [`Known::Tick`]: crate::model::vocabulary::Known::Tick
    pub struct TickFacts {
        /// To the next road user ahead in the ego vehicle's way, and its speed along the route.
        pub lead_gap_m: f64,
        pub lead_speed_mps: f64,
        pub lead_since_s: f64,
        pub over_red_m: f64,
        pub over_stop_m: f64,
        pub over_line_m: f64,
        pub over_crosswalk_m: f64,
        pub crosses: Crossing,
        pub lane_offset_m: f64,
        pub over_oncoming_m: f64,
        pub over_lane_m: f64,
        /// How far its middle is beside all lanes, m.
        pub off_road_m: f64,
        pub visibility_m: f64,
        pub jerk_mps3: f64,
        pub lateral_mps2: f64,
    }
}

/// The longest time that `since` tells, s: also of actions that never happened.
pub const SINCE_S_MAX: f64 = 1000.0;

of_facts! {
    /// The facts of the ego vehicle and its surroundings at a moment.
    pub struct MomentFacts {
        pub ego_speed_mps: f64,
        pub ego_acceleration_mps2: f64,
        /// Limit of the route's lane at the ego vehicle.
        pub ego_limit_mps: f64,
        /// Along the route to the next junction: 0 inside one, at most [`JUNCTION_AHEAD_M_MAX`].
        pub ego_junction_ahead_m: f64,
        /// The same to the end of that junction.
        pub ego_junction_end_m: f64,
        pub ego_crosswalk_ahead_m: f64,
        /// Width of the route's lane at the ego vehicle.
        pub ego_lane_width_m: f64,
        pub ego_route_left_m: f64,
        /// Positive to the left of the route.
        pub ego_offset_m: f64,
        /// Stations of its bumpers on the route.
        pub ego_front_m: f64,
        pub ego_rear_m: f64,
        pub ego_light: Light,
        pub ego_light_times: LightTimes,
        pub ego_road: RoadKind,
        /// Where the route goes at the next junction.
        pub ego_turn: Turn,
        /// How many there are beside the ego vehicle.
        pub road_users: f64,
        /// Those that were told to ignore a rule of the road.
        pub rule_breakers: f64,
        /// Between the outlines.
        pub nearest_gap_m: f64,
        pub nearest_speed_mps: f64,
        pub elapsed_s: f64,
    }
}

/// Since when a light has its colour and until when, s: [`SINCE_S_MAX`] without a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightTimes {
    pub since_s: f64,
    pub left_s: f64,
}

impl LightTimes {
    pub const NO_LIGHT: LightTimes = LightTimes { since_s: SINCE_S_MAX, left_s: SINCE_S_MAX };
}

/// Stands for a junction that is farther away, and for none at all, m.
pub const JUNCTION_AHEAD_M_MAX: f64 = 1000.0;

of_facts! {
    /// The facts of a road user other than the ego vehicle at a moment.
    pub struct NpcFacts {
        pub speed_mps: f64,
        /// Along its heading, negative when it brakes.
        pub acceleration_mps2: f64,
        /// To the ego vehicle, between the outlines.
        pub gap_m: f64,
        /// Along its way to the next junction, as in [`MomentFacts`].
        pub junction_ahead_m: f64,
        /// From its front, and from the ego vehicle's, to where their ways cross next.
        pub crossing_ahead_m: f64,
        pub ego_crossing_ahead_m: f64,
        /// From its front to the end of its lane, at most [`JUNCTION_AHEAD_M_MAX`].
        pub lane_left_m: f64,
        /// Limit of the lane that it is in.
        pub limit_mps: f64,
        /// The next light on its way; none for a road user on foot.
        pub light: Light,
        pub light_times: LightTimes,
        /// Which of it and the ego vehicle goes first, since one of them came into the other's way.
        pub priority: Priority,
        /// Stations of its ends on the ego vehicle's route.
        pub front_m: f64,
        pub rear_m: f64,
        /// How far its middle is to the left of that route.
        pub offset_m: f64,
        /// Until the stretches of the route beside the two meet, at most [`TIME_S_MAX`].
        pub ttc_s: f64,
        /// Way between the two, by the speed of the one behind, at most [`TIME_S_MAX`].
        pub headway_s: f64,
        /// Its speed along that route, and to the left across it.
        pub along_mps: f64,
        pub across_mps: f64,
        /// The room between the two across the route; below 0 they overlap.
        pub aside_m: f64,
        /// How far it reaches into the ego vehicle's lane there; below 0 what is missing.
        pub in_lane_m: f64,
        /// From its middle to the nearest crosswalk, at most [`CROSSWALK_GAP_M_MAX`].
        pub crosswalk_gap_m: f64,
        /// The same of the crosswalk that is the next one on the ego vehicle's route.
        pub next_crosswalk_gap_m: f64,
        /// Until the two touch, if both go on along and across the route as now, at most [`TIME_S_MAX`].
        pub contact_in_s: f64,
        /// Time since one of the two left the place where the other is, at most [`TIME_S_MAX`]. Known to requirements
        /// alone.
        pub pet_s: f64,
        /// Where it is along the trajectory that it follows; 0 if it follows none.
        pub station_m: f64,
        pub has_siren: bool,
        /// Whether it has crashed with a road user other than the ego vehicle. Known only for a road user that
        /// is there.
        pub crashed: bool,
        /// Whether it is the road user ahead of the ego vehicle, how many lanes left of the ego vehicle's lane it is, and
        /// how far off the road, m. Known to requirements alone.
        pub leads: bool,
        pub lanes_left: f64,
        pub off_road_m: f64,
        /// Whether it drives in the junction that is the next one of the ego vehicle's route.
        pub in_next_junction: bool,
        /// Its intended turn at the next junction; none for a road user on foot.
        pub turn: Turn,
    }
}

/// Stands for a crosswalk that is farther away, and for none at all, m.
pub const CROSSWALK_GAP_M_MAX: f64 = 100.0;

/// Stands for a time that is longer, and for one that does not come at all, s.
pub const TIME_S_MAX: f64 = 100.0;

/// The facts that a rule may ask about a spawn before it happens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpawnFacts {
    /// Distance between the outlines of the ego vehicle and the newcomer, or the vehicle that is parked with it,
    /// whichever is nearer, m.
    pub spawn_gap_m: f64,
    /// Gap that a careful and competent driver would need there, m; 0 if the two do not approach.
    pub safety_gap_m: f64,
    /// The road user that would appear.
    pub npc: NpcFacts,
}

/// The facts that verdicts and rewards may read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OutcomeFacts {
    /// The ego vehicle touched something.
    pub collision: bool,
    /// The ego vehicle had touched this obstacle before.
    pub repeated: bool,
    /// The obstacle appeared too late for any driver.
    pub sudden: bool,
    /// The obstacle ran into the side or rear of an ego vehicle that did not have to give way.
    pub struck: bool,
    /// Which of the ego vehicle and the obstacle had priority, if either. Known for collisions alone.
    pub priority: Priority,
    /// The body that was hit, if any.
    pub hit: Option<BodyWord>,
    /// The body that was hit in the step, or came nearest to a collision.
    pub near: Option<BodyWord>,
    /// A careful reference driver would not have touched the obstacle. Known for judged collisions alone.
    pub avoidable: bool,
    /// Collision probability of the step, in `[0, 1]`.
    pub proc: f64,
    /// Bit `i` is set if requirement `i` was breached in the step.
    pub breached: u64,
}

impl<'a> Facts<'a> {
    pub fn new(locals: &'a [Value], memory: &'a Memory) -> Facts<'a> {
        let outcome = OutcomeFacts::default();
        Facts { locals, memory, road: None, world: None, spawn: None, outcome, margins: &[] }
    }
}

/// The facts that rules may ask about a road.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadFacts {
    /// The name of the road.
    pub name: String,
    /// The lowest limit of the route's lanes: a drawn speed must be legal on the whole of it, SI.
    pub limit: Rational,
    /// `limit` as a float, m/s.
    pub limit_mps: f64,
    /// Where on the route that is, in words, unless it is everywhere.
    pub limited_at: Option<String>,
    /// Which lanes in the ego vehicle's direction exist somewhere along the route, by
    /// [`LaneChoice`] in its order: left, current, right.
    pub lanes: [bool; 3],
    /// The lowest and the highest limit of any lane of the map, m/s.
    pub map_limits_mps: [f64; 2],
    /// Whether a stop sign stands at the route.
    pub has_stop_sign: bool,
    /// The route, by what each part of it says of a moment; none, if that is not known.
    pub stretches: Arc<[Stretch]>,
}

impl RoadFacts {
    pub fn has_lane(&self, lane: LaneChoice) -> bool {
        self.lanes[lane as usize]
    }
}
