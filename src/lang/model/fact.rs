//! The facts: what an expression may ask about the world.
//!
//! A row has the spelling of a fact, its type, when it is known, and where an expression reads its value. It also has one
//! sentence for people, and the range of a bounded number on any road and at any moment.

use core::ops::RangeInclusive;

use crate::model::facts::{
    CROSSWALK_GAP_M_MAX, Facts, JUNCTION_AHEAD_M_MAX, LEAD_GAP_M_MAX, MomentFacts, SINCE_S_MAX, TIME_S_MAX,
    TickFacts,
};
use crate::model::limits::{AMBIENT_MAX, COMMANDED_MAX, EGO_ACCELERATION_MPS2_MAX, SPEED_MPS_MAX};
use crate::model::value::{Type, Value};
use crate::model::vocabulary::{Known, ROAD_LANES, Site, Word, WordFact, thing_of, words};
use avastra_base::units::Dimension;

/// Facts that are looked up together, because that costs something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Limit,
    /// Facts of the place on the route, the limit included.
    Route,
    Crosswalks,
    /// How many others there are, and the nearest of them.
    Users,
    RuleBreakers,
    Lead,
    OverRed,
    OverStop,
    OverLine,
    OverCrosswalk,
    OverOncoming,
    /// Facts of the ego vehicle in its route's lane.
    Lane,
    EgoOffRoad,
    Crosses,
    Jerk,
    /// Facts of each road user near.
    LanesLeft,
    OffRoad,
    Encroachment,
}

/// Parts that an expression asks for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Parts(u32);

impl Parts {
    pub const ALL: Parts = Parts(u32::MAX);

    /// The parts that these facts are in.
    pub fn of(facts: impl IntoIterator<Item = Fact>, words: impl IntoIterator<Item = WordFact>) -> Parts {
        let of_words = words.into_iter().filter_map(|word| match word {
            WordFact::EgoLight | WordFact::EgoRoad | WordFact::EgoTurn => Some(Part::Route),
            WordFact::EgoCrosses => Some(Part::Crosses),
            _ => None,
        });
        let all = facts.into_iter().filter_map(Fact::part).chain(of_words);
        Parts(all.fold(0, |bits, part| bits | 1 << part as u32))
    }

    pub fn has(self, part: Part) -> bool {
        self.0 >> part as u32 & 1 == 1
    }
}

/// The value where a fact is found.
trait FactValue: Copy {
    /// Where nothing is found.
    const MISSING: Value;

    fn value(self) -> Value;
}

/// The same of a number. No truth is one, so that none of the moment or the tick can be taken for a number.
trait Number: Copy {
    fn number(self) -> f64;
}

impl Number for f64 {
    fn number(self) -> f64 {
        self
    }
}

impl Number for u64 {
    fn number(self) -> f64 {
        self as f64
    }
}

macro_rules! numbers {
    ($($of:ty),+) => {
        $(impl FactValue for $of {
            const MISSING: Value = Value::Number(f64::NAN);

            fn value(self) -> Value {
                Value::Number(self.number())
            }
        })+
    };
}
numbers!(f64, u64);

impl FactValue for bool {
    const MISSING: Value = Value::Bool(false);

    fn value(self) -> Value {
        Value::Bool(self)
    }
}

fn found_value<T: FactValue>(found: Option<T>) -> Value {
    found.map_or(T::MISSING, T::value)
}

/// Where the facts of a kind stand.
macro_rules! source {
    ($facts:ident, moment) => {
        $facts.world.map(|world| &world.moment)
    };
    ($facts:ident, tick) => {
        $facts.world.map(|world| &world.tick)
    };
    ($facts:ident, world) => {
        $facts.world
    };
    ($facts:ident, npc) => {
        $facts.spawn.as_ref().map(|spawn| &spawn.npc)
    };
    ($facts:ident, spawn) => {
        $facts.spawn.as_ref()
    };
    ($facts:ident, road) => {
        $facts.road
    };
    ($facts:ident, outcome) => {
        Some(&$facts.outcome)
    };
}

/// A fact of the kind that is asked for, as a function; `None` for others.
macro_rules! if_of {
    (moment, moment, $($part:ident).+) => { Some(|moment| Number::number(moment.$($part).+)) };
    (tick, tick, $($part:ident).+) => { Some(|tick| Number::number(tick.$($part).+)) };
    ($kind:ident, $other:ident, $($part:ident).+) => { None };
}

/// The range of a number without bounds.
macro_rules! range {
    () => {
        f64::NEG_INFINITY..=f64::INFINITY
    };
    ($range:expr) => {
        $range
    };
}

macro_rules! part_of {
    () => {
        None
    };
    ($part:ident) => {
        Some(Part::$part)
    };
}

macro_rules! facts {
    ($($fact:ident $spelling:literal $ty:expr, $known:ident, $source:ident . $($part:ident).+ $(in $of:ident)? =
       $meaning:literal $(, $range:expr)?;)+) => {
        words! { Fact "What an expression may ask about the world.": $($fact $spelling = $meaning),+ }

        impl Fact {
            pub fn ty(self) -> Type {
                match self { $(Fact::$fact => $ty),+ }
            }

            pub fn known(self) -> Known {
                match self { $(Fact::$fact => Known::$known),+ }
            }

            /// The part needed to look it up; `None` if it costs nothing.
            fn part(self) -> Option<Part> {
                match self { $(Fact::$fact => part_of!($($of)?)),+ }
            }

            /// Its value; NaN, or false, where it is not known.
            pub(crate) fn value(self, facts: &Facts<'_>) -> Value {
                match self { $(Fact::$fact => found_value(source!(facts, $source).map(|of| of.$($part).+))),+ }
            }

            /// Reads a fact of the moment; `None` for another fact.
            pub(crate) fn of_moment(self) -> Option<fn(&MomentFacts) -> f64> {
                match self { $(Fact::$fact => if_of!(moment, $source, $($part).+)),+ }
            }

            /// Reads a fact that is watched at every tick; `None` for another fact.
            pub(crate) fn of_tick(self) -> Option<fn(&TickFacts) -> f64> {
                match self { $(Fact::$fact => if_of!(tick, $source, $($part).+)),+ }
            }

            /// The range of a number on any road and at any moment.
            pub(crate) fn range(self) -> RangeInclusive<f64> {
                match self { $(Fact::$fact => range!($($range)?)),+ }
            }
        }
    };
}

const ACCEL: Type = Type::Quantity(Dimension::ACCEL);
const JERK: Type = Type::Quantity(Dimension::JERK);
const DURATION: Type = Type::Quantity(Dimension::DURATION);
const LENGTH: Type = Type::Quantity(Dimension::LENGTH);
const RATIO: Type = Type::Quantity(Dimension::RATIO);
const SPEED: Type = Type::Quantity(Dimension::SPEED);
/// A number that is not negative.
const FROM_0: RangeInclusive<f64> = 0.0..=f64::INFINITY;

// Policies have variables of their own (`policy::VARIABLES`): what an agent observes is rounded and cut off.
facts! {
    RoadLimit "road.limit" SPEED, Road, road.limit_mps =
        "`Speed`: lowest speed limit along the route.", FROM_0;
    EgoSpeed "ego.speed" SPEED, World, moment.ego_speed_mps =
        "`Speed`: speed of the ego vehicle.", 0.0..=SPEED_MPS_MAX;
    EgoAcceleration "ego.acceleration" ACCEL, World, moment.ego_acceleration_mps2 =
        "`Accel`: acceleration along its heading. Below 0 it brakes.", -EGO_ACCELERATION_MPS2_MAX..=EGO_ACCELERATION_MPS2_MAX;
    EgoLimit "ego.limit" SPEED, World, moment.ego_limit_mps in Limit =
        "`Speed`: speed limit of its lane.", FROM_0;
    EgoJunctionAhead "ego.junction_ahead" LENGTH, World, moment.ego_junction_ahead_m in Route =
        "`Length`: distance along the route to the next junction: 0 in one, 1000 m if none is nearer.", 0.0..=JUNCTION_AHEAD_M_MAX;
    EgoJunctionEnd "ego.junction_end" LENGTH, World, moment.ego_junction_end_m in Route =
        "`Length`: distance along the route to the end of that junction: 1000 m if none is nearer.", 0.0..=JUNCTION_AHEAD_M_MAX;
    EgoCrosswalkAhead "ego.crosswalk_ahead" LENGTH, World, moment.ego_crosswalk_ahead_m in Crosswalks =
        "`Length`: distance along the route to the next crosswalk: 0 on one, 1000 m if none is nearer.", 0.0..=JUNCTION_AHEAD_M_MAX;
    EgoLaneWidth "ego.lane_width" LENGTH, World, moment.ego_lane_width_m in Route =
        "`Length`: width of the route's lane at the ego vehicle.", FROM_0;
    EgoLightSince "ego.light_since" DURATION, World, moment.ego_light_times.since_s in Route =
        "`Duration`: time since the light of `ego.light` took its colour: 1000 s without a light.", 0.0..=SINCE_S_MAX;
    EgoLightLeft "ego.light_left" DURATION, World, moment.ego_light_times.left_s in Route =
        "`Duration`: time until the light of `ego.light` changes: 1000 s without a light.", 0.0..=SINCE_S_MAX;
    EgoRouteLeft "ego.route_left" LENGTH, World, moment.ego_route_left_m in Route =
        "`Length`: distance along the route to the goal.";
    EgoOffset "ego.offset" LENGTH, World, moment.ego_offset_m =
        "`Length`: lateral offset from the route, positive to the left.";
    EgoFront "ego.front" LENGTH, World, moment.ego_front_m =
        "`Length`: station of the ego vehicle's front on the route. The route begins at 0 m, under its rear axle at the start.";
    EgoRear "ego.rear" LENGTH, World, moment.ego_rear_m =
        "`Length`: station of its rear on the route. It is 4.70 m long and 2.06 m wide.";
    RoadUsers "road_users" Type::Int, World, moment.road_users in Users =
        "`Int`: number of other road users: from actions (parked ones and wrecks included) and from ordinary traffic.", 0.0..=f64::from(COMMANDED_MAX + AMBIENT_MAX);
    RuleBreakers "rule_breakers" Type::Int, World, moment.rule_breakers in RuleBreakers =
        "`Int`: how many of them drive and ignore a rule of the road. A wreck ignores none.", 0.0..=f64::from(COMMANDED_MAX + AMBIENT_MAX);
    NearestGap "nearest.gap" LENGTH, World, moment.nearest_gap_m in Users =
        "`Length`: gap to the nearest road user: 100 m without one.", FROM_0;
    NearestSpeed "nearest.speed" SPEED, World, moment.nearest_speed_mps in Users =
        "`Speed`: speed of the nearest road user: 0 without one.", FROM_0;
    Elapsed "elapsed" DURATION, World, moment.elapsed_s =
        "`Duration`: time since the episode began.", FROM_0;
    StepNumber "step" Type::Int, World, world.step =
        "`Int`: number of the step, from 0.", FROM_0;
    NpcSpeed "npc.speed" SPEED, Spawn, npc.speed_mps =
        "`Speed`: speed of the road user.", FROM_0;
    NpcAcceleration "npc.acceleration" ACCEL, Spawn, npc.acceleration_mps2 =
        "`Accel`: acceleration along its heading, over the last 0.02 s. Below 0 it brakes; 0 as it appears.";
    NpcGap "npc.gap" LENGTH, Spawn, npc.gap_m =
        "`Length`: gap between its outline and the ego vehicle's.", FROM_0;
    NpcJunctionAhead "npc.junction_ahead" LENGTH, Spawn, npc.junction_ahead_m =
        "`Length`: distance from its middle along its way to the next junction: 0 in one, 1000 m if none is nearer.", 0.0..=JUNCTION_AHEAD_M_MAX;
    NpcCrossingAhead "npc.crossing_ahead" LENGTH, Spawn, npc.crossing_ahead_m =
        "`Length`: distance from its front to the place where its way next crosses or joins the ego vehicle's: 1000 m if it does not, or if it is a pedestrian or on a trajectory.", 0.0..=JUNCTION_AHEAD_M_MAX;
    NpcEgoCrossingAhead "npc.ego_crossing_ahead" LENGTH, Spawn, npc.ego_crossing_ahead_m =
        "`Length`: distance from the ego vehicle's front to that place. Below 0 the ego vehicle is past it; 1000 m without one.";
    NpcLaneLeft "npc.lane_left" LENGTH, Spawn, npc.lane_left_m =
        "`Length`: distance from a vehicle's front to the end of its lane where others beside it go on, as at a merge lane: 1000 m if it does not end.";
    NpcLightSince "npc.light_since" DURATION, Spawn, npc.light_times.since_s =
        "`Duration`: as `ego.light_since`, for the light of `npc.light`.", 0.0..=SINCE_S_MAX;
    NpcLightLeft "npc.light_left" DURATION, Spawn, npc.light_times.left_s =
        "`Duration`: as `ego.light_left`, for the light of `npc.light`.", 0.0..=SINCE_S_MAX;
    NpcLimit "npc.limit" SPEED, Spawn, npc.limit_mps =
        "`Speed`: speed limit of its lane.", FROM_0;
    NpcFront "npc.front" LENGTH, Spawn, npc.front_m =
        "`Length`: station on the ego vehicle's route of its end that is farther along, even when it is oncoming.";
    NpcRear "npc.rear" LENGTH, Spawn, npc.rear_m =
        "`Length`: station on the ego vehicle's route of its other end.";
    NpcOffset "npc.offset" LENGTH, Spawn, npc.offset_m =
        "`Length`: lateral offset of its middle from the ego vehicle's route, positive to the left.";
    NpcTtc "npc.ttc" DURATION, Spawn, npc.ttc_s =
        "`Duration`: time until it and the ego vehicle are side by side along the route, at present speeds: 0 if they are, 100 s if not sooner. They need not touch.", 0.0..=TIME_S_MAX;
    NpcHeadway "npc.headway" DURATION, Spawn, npc.headway_s =
        "`Duration`: distance between the two along the route, divided by the speed of the rear one: at most 100 s.", 0.0..=TIME_S_MAX;
    NpcAlong "npc.along" SPEED, Spawn, npc.along_mps =
        "`Speed`: speed along the ego vehicle's route. Below 0 it comes towards the ego vehicle.";
    NpcAcross "npc.across" SPEED, Spawn, npc.across_mps =
        "`Speed`: speed across the ego vehicle's route, positive to the left.";
    NpcAside "npc.aside" LENGTH, Spawn, npc.aside_m =
        "`Length`: lateral gap between the two outlines, each at its full width across the route. Below 0 they overlap.";
    NpcInLane "npc.in_lane" LENGTH, Spawn, npc.in_lane_m =
        "`Length`: how far its outline reaches into the ego vehicle's lane beside it. Below 0: how much is missing.";
    NpcCrosswalkGap "npc.crosswalk_gap" LENGTH, Spawn, npc.crosswalk_gap_m =
        "`Length`: distance from its middle to the map's nearest crosswalk: 0 on one, 100 m if none is nearer.", 0.0..=CROSSWALK_GAP_M_MAX;
    NpcNextCrosswalkGap "npc.next_crosswalk_gap" LENGTH, Spawn, npc.next_crosswalk_gap_m =
        "`Length`: distance from its middle to the crosswalk of `ego.crosswalk_ahead`: 0 on it, 100 m if there is none or it is farther away.", 0.0..=CROSSWALK_GAP_M_MAX;
    NpcContactIn "npc.contact_in" DURATION, Spawn, npc.contact_in_s =
        "`Duration`: time to collision: until the outlines touch, if both keep their speeds along and across the route. 0 if they touch, 100 s if they do not.", 0.0..=TIME_S_MAX;
    NpcPet "npc.pet" DURATION, Near, npc.pet_s in Encroachment =
        "`Duration`: post-encroachment time: how long ago the ego vehicle or this road user left the place where the other one is now. More than 5 s ago: 100 s.", 0.0..=TIME_S_MAX;
    NpcLeads "npc.leads" Type::Bool, Near, npc.leads in Lead =
        "`Bool`: whether it is the road user of `ego.lead_gap`.";
    NpcLanesLeft "npc.lanes_left" Type::Int, Near, npc.lanes_left in LanesLeft =
        "`Int`: how many lanes its middle is to the left of the ego vehicle's lane: -1 in the next to the right, 100 in no lane beside the route. Lanes of the other direction count. In junctions only the route's own lane is known.";
    NpcOffRoad "npc.off_road" LENGTH, Near, npc.off_road_m in OffRoad =
        "`Length`: distance from its middle to the nearest driving lane, at most 3 m. Below 0 it is on one.";
    NpcInNextJunction "npc.in_next_junction" Type::Bool, Spawn, npc.in_next_junction =
        "`Bool`: whether a vehicle is in the junction of `ego.junction_ahead`.";
    NpcStation "npc.station" LENGTH, Spawn, npc.station_m =
        "`Length`: under `Follow`: station of its rear axle (of a pedestrian: its middle) on its trajectory. 0 without `Follow`.", FROM_0;
    NpcSiren "npc.siren" Type::Bool, Spawn, npc.has_siren =
        "`Bool`: whether it is an emergency vehicle under way, for which all others wait.";
    NpcCrashed "npc.crashed" Type::Bool, Spawn, npc.crashed =
        "`Bool`: whether it and another road user, not the ego vehicle, have crashed into each other.";
    SpawnGap "spawn_gap" LENGTH, Spawn, spawn.spawn_gap_m =
        "`Length`: gap from the ego vehicle to the road user that appears.", FROM_0;
    SafetyGap "safety_gap" LENGTH, Spawn, spawn.safety_gap_m =
        "`Length`: gap that a careful driver needs to the road user that appears.", FROM_0;
    EgoLeadGap "ego.lead_gap" LENGTH, Tick, tick.lead_gap_m in Lead =
        "`Length`: gap to the next road user ahead: 1000 m without one.", 0.0..=LEAD_GAP_M_MAX;
    EgoLeadSpeed "ego.lead_speed" SPEED, Tick, tick.lead_speed_mps in Lead =
        "`Speed`: speed of that road user along the route: 0 without one.";
    EgoLeadSince "ego.lead_since" DURATION, Tick, tick.lead_since_s in Lead =
        "`Duration`: for how long it has been that one. A cut-in starts this time anew. 0 without one.", FROM_0;
    EgoOverRed "ego.over_red" LENGTH, Tick, tick.over_red_m in OverRed =
        "`Length`: how far its front is beyond the stop line of a light that was red as it passed: up to 30 m, and while the light stays red. Before a red light: minus the distance to its line, at least -100 m.";
    EgoOverStop "ego.over_stop" LENGTH, Tick, tick.over_stop_m in OverStop =
        "`Length`: how far its front is beyond the line of a stop sign, until its rear has passed it. Before it: minus the distance to it, at least -100 m.";
    EgoOverLine "ego.over_line" LENGTH, Tick, tick.over_line_m in OverLine =
        "`Length`: how far its front is beyond the stop line of a traffic light of any colour, until its rear has passed it. Before it: minus the distance to it, at least -100 m.";
    EgoOverCrosswalk "ego.over_crosswalk" LENGTH, Tick, tick.over_crosswalk_m in OverCrosswalk =
        "`Length`: how far its front is beyond the near edge of a crosswalk on the route, until its rear has passed the far edge. Before it: minus the distance to it, at least -100 m.";
    EgoLaneOffset "ego.lane_offset" LENGTH, Tick, tick.lane_offset_m in Lane =
        "`Length`: how far its rear axle is to the left of the middle of its route's lane. `ego.offset` is from the route, also while the route changes lanes.";
    EgoOverOncoming "ego.over_oncoming" LENGTH, Tick, tick.over_oncoming_m in OverOncoming =
        "`Length`: how far its outline reaches into a lane of the other direction. Below 0: the room that is left. In junctions, and where there is no such lane: -100 m.";
    EgoOverLane "ego.over_lane" LENGTH, Tick, tick.over_lane_m in Lane =
        "`Length`: how far its outline at the rear axle reaches beyond the lines of its route's lane (of both lanes where the route may change lanes). Below 0: the room that is left. In junctions: -100 m.";
    EgoOffRoad "ego.off_road" LENGTH, Tick, tick.off_road_m in EgoOffRoad =
        "`Length`: distance from its middle to the nearest driving lane, at most 3 m. Below 0 it is on one.";
    EgoVisibility "ego.visibility" LENGTH, Tick, tick.visibility_m =
        "`Length`: how far one sees in fog: 10 km in clear air; 500 m, 150 m and 50 m at the levels of `Fog`.";
    EgoJerk "ego.jerk" JERK, Tick, tick.jerk_mps3 in Jerk =
        "`Jerk`: change of its acceleration over the last second, divided by that second. 0 in the first one.";
    EgoLateralAcceleration "ego.lateral_acceleration" ACCEL, Tick, tick.lateral_mps2 =
        "`Accel`: acceleration to its left. Below 0 to its right.";
    Proc "proc" RATIO, Step, outcome.proc =
        "`Ratio`: collision probability of the step.", 0.0..=1.0;
    Collision "collision" Type::Bool, Step, outcome.collision =
        "`Bool`: whether the ego vehicle collided.";
    Repeated "repeated" Type::Bool, Step, outcome.repeated =
        "`Bool`: with an obstacle that it has hit before. Today an obstacle is hit once, so this never holds.";
    Sudden "sudden" Type::Bool, Step, outcome.sudden =
        "`Bool`: with an obstacle that had appeared at most 0.75 s before.";
    Struck "struck" Type::Bool, Step, outcome.struck =
        "`Bool`: the ego vehicle did not have to give way, and the obstacle ran into its side, a front corner or its rear, or into any part of it while it stood.";
    Avoidable "avoidable" Type::Bool, Judgement, outcome.avoidable =
        "`Bool`: whether a careful reference driver avoids it. Verdicts only.";
}

/// The names with a `.`, each with its sentence.
fn dotted() -> impl Iterator<Item = (&'static str, &'static str)> {
    let facts = Fact::ALL.iter().map(|fact| (fact.name(), fact.meaning()));
    let words = WordFact::ALL.iter().map(|fact| (fact.name(), fact.meaning()));
    facts.chain([ROAD_LANES]).chain(words).filter(|(name, _)| name.contains('.'))
}

/// The things that have facts: the words before a `.`.
pub fn things() -> Vec<&'static str> {
    let mut things: Vec<&str> = Vec::new();
    for thing in dotted().filter_map(|(name, _)| thing_of(name)) {
        if !things.contains(&thing) {
            things.push(thing);
        }
    }
    things
}

/// The facts of a thing (`road`): the words after its `.`, each with its sentence.
pub fn parts_of(thing: &str) -> Vec<(&'static str, &'static str)> {
    let parts = dotted().filter_map(|(name, meaning)| Some((name.split_once('.')?, meaning)));
    parts.filter(|((of, _), _)| *of == thing).map(|((_, part), meaning)| (part, meaning)).collect()
}

/// The facts of a road user that is named, or told by its number, each with its sentence. Facts that are watched only for
/// each road user near are left out.
pub fn parts_of_named() -> Vec<(&'static str, &'static str)> {
    let is_watched =
        |part: &str| Fact::from_name(&format!("npc.{part}")).is_some_and(|fact| fact.known() == Known::Near);
    parts_of("npc").into_iter().filter(|(part, _)| !is_watched(part)).collect()
}

impl Site {
    /// Whether a fact is known here. Gaps of a spawn are known at the draw alone.
    pub fn knows_fact(self, fact: Fact) -> bool {
        let is_of_spawn = matches!(fact, Fact::SpawnGap | Fact::SafetyGap);
        self.knows(fact.known())
            && !(is_of_spawn && matches!(self, Site::Change | Site::Phase | Site::RequirementOn))
    }

    /// The facts that are known here.
    pub fn facts(self) -> impl Iterator<Item = Fact> {
        Fact::ALL.iter().copied().filter(move |fact| self.knows_fact(*fact))
    }

    /// Whether anything can be asked of a thing (`road`) here.
    pub fn knows_thing(self, thing: &str) -> bool {
        self.facts().any(|fact| thing_of(fact.name()) == Some(thing))
            || self.word_facts().any(|fact| thing_of(fact.name()) == Some(thing))
    }
}
