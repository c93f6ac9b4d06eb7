//! The table of the engine's words: facts, fields, claims, and what a `spawn`, a `set time` or a `set sky`
//! may mean.
//! A row holds the spelling of a word and one sentence for people. The facts have a table of their own (`fact`). Each
//! becomes known at a stated time ([`Known`]), which decides where it may be read and when a rule that reads it is judged.
//! The checker, the editor's server, the highlighter and the test of the book read the rows. Keywords stand in
//! `syntax::keyword`, because the grammar knows them.
//!
//! Enums are the author's; the names of their variants must be found here wherever a value reaches
//! the world.

use crate::model::value::Type;
use avastra_base::units::Dimension;

pub use crate::model::fact::{Fact, Part, Parts, parts_of, parts_of_named, things};

/// A word of the engine: it has a spelling, and the spelling finds it again.
pub trait Word: Copy + PartialEq + 'static {
    /// Every word of this kind, in the order in which they are listed to authors.
    const ALL: &'static [Self];

    fn name(self) -> &'static str;

    /// One sentence for people.
    fn meaning(self) -> &'static str;

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|word| word.name() == name)
    }

    /// The spellings, in the order of [`Word::ALL`].
    fn names<'a>() -> impl Iterator<Item = &'a str> {
        Self::ALL.iter().map(|word| -> &'a str { word.name() })
    }
}

/// Declares an enum of words. A row is the variant, its spelling if that differs, and its sentence if the
/// sentence of the kind is not enough.
macro_rules! words {
    ($(#[$mark:meta])* $kind:ident $each:literal:
     $($(#[$of_word:meta])* $word:ident $($spelling:literal)? $(= $own:literal)?),+ $(,)?) => {
        #[doc = $each]
        $(#[$mark])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum $kind { $($(#[doc = $own])? $(#[$of_word])* $word),+ }

        impl Word for $kind {
            const ALL: &'static [$kind] = &[$($kind::$word),+];

            fn name(self) -> &'static str {
                match self { $($kind::$word => words!(@last stringify!($word) $(, $spelling)?)),+ }
            }

            fn meaning(self) -> &'static str {
                match self { $($kind::$word => words!(@last $each $(, $own)?)),+ }
            }
        }
    };
    (@last $only:expr) => { $only };
    (@last $first:expr, $second:expr) => { $second };
}
pub(in crate::model) use words;

/// Declares the facts that are one of a list of words.
macro_rules! word_facts {
    ($($fact:ident $spelling:literal $words:ident, $known:ident = $meaning:literal;)+) => {
        words! {
            /// The words are no values: they stand only beside the fact, and mean nothing elsewhere.
            WordFact "What is compared with words of the engine.": $($fact $spelling = $meaning),+
        }

        impl WordFact {
            pub fn known(self) -> Known {
                match self { $(WordFact::$fact => Known::$known),+ }
            }

            /// The words that it may be, each with its sentence.
            pub fn words(self) -> Vec<(&'static str, &'static str)> {
                match self {
                    $(WordFact::$fact => $words::ALL.iter().map(|word| (word.name(), word.meaning())).collect()),+
                }
            }
        }
    };
}

/// From when on a fact is known; later ones come later in an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Known {
    /// Without the world, once the road is known: the checker judges rules about it, and numbers are drawn
    /// within their bounds.
    Road,
    /// At the draw, in the world; without a world it is left to the replay.
    World,
    /// At the draw, for each spawn, once the world has found a place for it.
    Spawn,
    /// At every tick, where requirements are judged: what must be watched over time, or costs too much elsewhere.
    Tick,
    /// The same of a road user near: what is watched, or costs too much elsewhere.
    Near,
    /// After the step.
    Step,
    /// After a collision was judged.
    Judgement,
}

/// Where an expression stands, which decides the facts that it may read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Site {
    /// In functions, constants and effects, which see no facts.
    #[default]
    Elsewhere,
    /// In the `where` of an axis, which is decided before any episode.
    Axis,
    /// In the `where` of a drawn parameter.
    Where,
    Rule,
    /// In a rule `during change`.
    Change,
    /// In a phase of a manoeuvre.
    Phase,
    /// In what every step does, and in the odds of actions: at the moment at which a step begins.
    StepBegins,
    /// In a requirement, at every tick.
    Requirement,
    /// In a requirement `on` bodies, of each road user near that has one.
    RequirementOn,
    /// In `once` of a scenario's step.
    Trigger,
    Reward,
    Verdict,
}

impl Site {
    /// Whether what is known from then on is known here. A verdict knows what a reward knows, and how the
    /// collision was judged.
    pub fn knows(self, known: Known) -> bool {
        match known {
            Known::Road | Known::World => {
                matches!(
                    self,
                    Site::Where
                        | Site::Rule
                        | Site::Change
                        | Site::Phase
                        | Site::StepBegins
                        | Site::Requirement
                        | Site::RequirementOn
                        | Site::Trigger
                )
            }
            Known::Spawn => matches!(self, Site::Rule | Site::Change | Site::Phase | Site::RequirementOn),
            Known::Tick => self.is_requirement(),
            Known::Near => self == Site::RequirementOn,
            Known::Step => matches!(self, Site::Reward | Site::Verdict),
            Known::Judgement => self == Site::Verdict,
        }
    }

    pub fn is_requirement(self) -> bool {
        matches!(self, Site::Requirement | Site::RequirementOn)
    }

    /// Whether it is known here when actions happened.
    pub fn knows_actions(self) -> bool {
        matches!(self, Site::Rule | Site::StepBegins)
    }

    /// Those that are words.
    pub fn word_facts(self) -> impl Iterator<Item = WordFact> {
        WordFact::ALL.iter().copied().filter(move |fact| self.knows(fact.known()))
    }
}

/// The types of the language itself, with their spelling and a sentence.
pub const TYPES: &[(&str, Type, &str)] = &[
    ("Bool", Type::Bool, "`true` or `false`."),
    ("Int", Type::Int, "A whole number; may stand wherever a ratio may."),
    ("Length", LENGTH, "In `m` or `km`."),
    ("Duration", Type::Quantity(Dimension::DURATION), "In `s`, `ms`, `min` or `h`."),
    ("Speed", SPEED, "In `m/s`, `km/h` or `mph`."),
    ("Accel", Type::Quantity(Dimension::ACCEL), "In `m/s^2`."),
    ("Jerk", Type::Quantity(Dimension::JERK), "In `m/s^3`."),
    ("Angle", Type::Quantity(Dimension::ANGLE), "In `deg` or `rad`."),
    ("Mass", Type::Quantity(Dimension::MASS), "In `kg`."),
    ("Ratio", RATIO, "A number without a unit, or with `%`."),
];

/// The type whose values are the names of road users.
pub const ROAD_USER: (&str, &str) = (
    "RoadUser",
    "The name that a spawn gives to a road user: `each who: RoadUser in [truck, van]`, `order who { … }`.",
);

const LENGTH: Type = Type::Quantity(Dimension::LENGTH);
const RATIO: Type = Type::Quantity(Dimension::RATIO);
const SPEED: Type = Type::Quantity(Dimension::SPEED);

/// The lane changes that a rule may restrict instead of the draw.
pub const CHANGE: (&str, &str) = (
    "change",
    "`during change`: a lane change that the action commands begins only while the condition holds.",
);

/// `lane in road.lanes`: spelt like a fact, but a set, which may only stand after `in`.
pub const ROAD_LANES: (&str, &str) =
    ("road.lanes", "The lanes in the ego vehicle's direction: `lane in road.lanes`.");

/// `truck.there`: what may be asked of a named road user beside the facts of `npc`.
pub const THERE: (&str, &str) = ("there", "Whether a road user of that name is there.");

/// Events of estimates that are no requirement, so that no requirement has their names.
pub const EVENTS: [&str; 3] = ["counted", "collision", "breach"];

/// `stops_at_red.breached`: what may be asked of a requirement.
pub const BREACHED: (&str, &str) =
    ("breached", "Whether the requirement was not kept: `expect stops_at_red.breached at 14.22 s`.");

/// `keeps_distance.margin` in a reward.
pub const MARGIN: (&str, &str) = (
    "margin",
    "By how much the requirement was kept in the step, at least; below 0 it was not: `keeps_distance.margin < 2 m => 1`.",
);

/// `stops_at_red.kept by [cc, fsm]`: who would have kept it.
pub const KEPT: (&str, &str) = (
    "kept",
    "Which careful drivers keep the requirement in the same steps: `expect stops_at_red.kept by [cc, fsm]`.",
);

/// `stops_at_red.recurrence == 14 / 20`: how often it is breached again, as [`ScenarioClaim::Recurrence`] of a collision.
pub const RECURRENCE: (&str, &str) = (
    "recurrence",
    "How often it is breached again with other sensor errors and reactions: `expect stops_at_red.recurrence == 14 / 20`, or from a moment on: `… at 3.8 s`.",
);

/// `since(vehicles)`: spelt like a function, but of an action or a group.
pub const SINCE: (&str, &str) = (
    "since",
    "`Duration`: time since an action, or one of a group, last happened: 1000 s if never. `since(vehicles) >= 10 s`.",
);

words! {
    PastWord "What a requirement may ask of the last seconds: spelt like a function of a condition and a time.":
    Recently "recently" = "Whether a condition held at some moment of the last seconds: `recently(npc.gap <= 5 m, 2 s)`.",
    Throughout "throughout" = "Whether a condition held at every moment of the last seconds: `throughout(ego.speed <= 0.1 m/s, 3 s)`.",
    Total "total" = "For how long in all a condition held during the last seconds: `total(ego.acceleration <= -3 m/s^2, 10 s) <= 2 s`.",
    Times "times" = "How often a condition began to hold during the last seconds: `times(ego.acceleration <= -3 m/s^2, 60 s) <= 2`.",
    Mean "mean" = "The mean of a number over the last seconds: `mean(ego.jerk * ego.jerk, 10 s) <= 1 m/s^3 * 1 m/s^3`.",
    Ago "ago" = "What a condition or a number was so many seconds ago: `ago(ego.speed, 2 s)`.",
    Change "change" = "By how much a number is more than so many seconds ago: `change(ego.acceleration, 0.5 s) <= 1 m/s^2`.",
}

/// `begins(ego.light == Red)`: spelt like a function of a condition.
pub const BEGINS: (&str, &str) = (
    "begins",
    "Whether a condition begins to hold at this moment, or holds as it is first looked at: `recently(begins(ego.light == Red), 3 s)`.",
);

words! {
    NumberWord "What is made of numbers of one kind: spelt like a function.":
    Min "min" = "The lesser of two numbers: `min(npc.speed, 10 m/s)`.",
    Max "max" = "The greater of two numbers: `max(gap - 1 s, 0 s)`.",
    Abs "abs" = "A number without its sign: `abs(npc.offset) <= 0.5 m`.",
}

impl NumberWord {
    /// How many numbers it takes.
    pub fn arity(self) -> usize {
        if self == NumberWord::Abs { 1 } else { 2 }
    }
}

words! {
    NearWord "What a requirement may ask of the road users near: spelt like a function of bodies and a condition.":
    Some "some" = "Whether a condition holds of a road user near, with one of these bodies if they are named: `some(Pedestrian, npc.gap <= 5 m)`.",
    Count "count" = "Of how many road users near a condition holds: `count(Vehicle, npc.gap <= 20 m) <= 3`.",
}

word_facts! {
    EgoLight "ego.light" Light, World = "The next traffic light within 100 m on its route, until the rear axle has passed the line. The value also changes when the next light comes into range or replaces a passed one.";
    EgoRoad "ego.road" RoadKind, World = "Kind of road. `NearJunction` is at most 20 m before a junction.";
    EgoTurn "ego.turn" Turn, World = "Direction of its route at the present junction, or at the next within 1000 m.";
    EgoCrosses "ego.crosses" Crossing, Tick = "Side to which it crosses a line of its lane. This lasts from the first corner over the line until it is wholly in a lane again. In junctions: `None`.";
    NpcLight "npc.light" Light, Spawn = "The next traffic light within 100 m on a vehicle's way.";
    NpcTurn "npc.turn" Turn, Spawn = "Direction of a vehicle's present way at this junction, or its next.";
    NpcPriority "npc.priority" Priority, Spawn = "Which of the two goes first. It counts once one has come into the other's way (in a junction, in a lane, as a pedestrian), and for 2 s after that.";
    Priority "priority" Priority, Step = "Whether the ego vehicle or the road user that was hit had to give way: `priority == ego`, `priority in [other, none]`.";
    Hit "hit" Body, Step = "What was hit: `hit == Pedestrian`; nothing if there was no collision.";
    Near "near" Body, Step = "The road user with the greatest collision probability of the step: `near == Pedestrian`.";
}

/// The thing before the `.` of a name: `road` for `road.limit`.
pub fn thing_of(name: &'static str) -> Option<&'static str> {
    name.split_once('.').map(|(thing, _)| thing)
}

words! {
    EpisodeField "A setting of `episode`.":
    Roads "roads" = "The roads on which episodes are driven, in this order: `roads: [corner, boulevard]`.",
    Step "step" = "The observation period after each action: `step: 6 s`.",
    Stop "stop" = "What ends an episode: `arrived`, `stalled >= 4`, or both with `or`.",
    Limit "limit" = "The steps after which an episode is cut off: `limit: 20 steps`.",
}

words! {
    StopReason "What an episode may stop for.":
    Arrived "arrived" = "The ego vehicle is at the goal.",
    Stalled "stalled" = "Steps without progress: `stalled >= 4`.",
}

words! {
    RoadField "A field of `road`.":
    Map "map" = "The OpenDRIVE file, relative to this file: `map: \"roads/corner.xodr\"`.",
    Start "start" = "Where the ego vehicle starts: `start: lane 1/-1 at 12 m`.",
    Goal "goal" = "Where it is to arrive: `goal: lane 7/-1 at 80 m`.",
    Limit "limit" = "A lower limit for the whole road: `limit: 30 km/h`.",
    BusLanes "bus_lanes" = "Lanes that only buses use, each by a place on it: `bus_lanes: [lane 3/4 at 10 m]`.",
    EgoSpeed "ego_speed" = "How fast the ego vehicle is as an episode begins: `ego_speed: 60 km/h`.",
    SetSpeed "set_speed" = "How fast the ego vehicle wants to drive where it is free to: `set_speed: 130 km/h`.",
    SignalPhase "signal_phase" = "When in their cycle the lights are as an episode begins: `signal_phase: 12 s`; by chance without it.",
    Green "green" = "How long each group of lights is green: `green: 20 s`; 12 s without it, less where many groups follow each other.",
    Yellow "yellow" = "How long a light is yellow: `yellow: 4 s`; 3 s without it.",
    AllRed "all_red" = "How long all are red before the next group is green: `all_red: 1 s`; 2 s without it.",
    Unlit "unlit" = "Whether to drive through junctions whose lights hold no lane, as if they had none: `unlit: true`.",
}

words! {
    LightField "A field of `order light`.":
    Colour "colour" = "What the ego vehicle's next traffic light shows from then on: `Red`, `Yellow` or `Green`.",
    At "at" = "How far the ego vehicle's front is before its line then: `at: 30 m`; at once without it.",
}

/// The word of `order` for the ego vehicle's next traffic light.
pub const LIGHT: (&str, &str) =
    ("light", "The ego vehicle's next traffic light: `order light { colour: Yellow, at: 30 m }`.");

words! {
    TrajectoryField "A field of `trajectory`.":
    Road "road" = "The road on whose map it lies: `road: corner`.",
    Lanes "lanes" = "Places between which it follows the lanes: `lanes: [lane 1/-1 at 12 m, lane 7/-1 at 80 m]`.",
    Points "points" = "Places between which it runs straight: `points: [{ at: lane 1/-1 at 40 m, offset: -4 m }, { x: 12 m, y: 3 m }]`; without a `road` places beside the ego vehicle's route, through which it leads in a curve: `points: [{ along: 0 m, offset: -3 m }, { along: 15 m }]`.",
}

words! {
    PointField "A field of a point of a `trajectory`.":
    At "at" = "A place on a lane: `at: lane 1/-1 at 40 m`.",
    Offset "offset" = "How far to the left of the middle of that lane, or of the ego vehicle's route; negative to the right.",
    Along "along" = "How far along the ego vehicle's route from where the way begins: `{ along: 12 m, offset: -3 m }`.",
    X "x" = "Where it is on the map, with `y`: `{ x: 12 m, y: -3.5 m }`.",
    Y "y" = "Where it is on the map, with `x`.",
    Turned "turned" = "How far who comes there is turned to the left of the way, as in a skid; in between it changes evenly.",
}

words! {
    BodyField "A field of `body`.":
    Like "like" = "The body of the engine that it is like: what it does not say itself, it has from there.",
    Length "length" = "How long it is.",
    Width "width" = "How wide it is.",
    Height "height" = "How high it is.",
    Wheelbase "wheelbase" = "From the rear axle to the front axle.",
    Mass "mass" = "How heavy it is.",
    Acceleration "acceleration" = "How fast it can gain speed.",
    Deceleration "deceleration" = "How hard it can brake on a dry road.",
}

words! {
    Field "A field of `spawn`, of `order`, and of a phase of a manoeuvre.":
    Does "does" = "What the road user does: a verb of the engine.",
    Side "side" = "The side that it comes from: `Left` or `Right`.",
    Count "count" = "How many of a row appear, from the first name on: `count: 2`.",
    Speed "speed" = "How fast it is; in an order, the speed that it goes over to.",
    Rate "rate" = "How fast it gains or loses speed for that, as far as its body and the road allow.",
    Continuous "continuous" = "Whether the `speed` of a phase is asked anew at every tick, until another one is told: `continuous: true`.",
    Lane "lane" = "Its lane, seen from the ego vehicle: `Left`, `Current` or `Right`; in an order, the lane that it changes to.",
    Offset "offset" = "How far to the left of its lane's middle it is, or goes; negative to the right.",
    Aside "aside" = "Its greatest speed to the side on the way there, or how long the move takes, as far as the road allows: `aside: 1.5 m/s`, `aside: 3 s`.",
    TimeGap "time_gap" = "The time gap that its driver keeps behind whoever is ahead of it.",
    Keep "keep" = "The gap that it keeps to the ego vehicle, ahead of it or behind it: `keep: 1.5 s`, `keep: 20 m`.",
    To "to" = "The road user to which it keeps that gap, in place of the ego vehicle: `keep: 20 m, to: truck`.",
    Early "early" = "How much before the ego vehicle it is where the two ways cross, or `at` a station, if that one keeps its speed: `early: 0.5 s`.",
    At "at" = "The station of the ego vehicle's route at which it is `early`: `at: van.rear`.",
    Reach "reach" = "Where on its own trajectory it is `early`, for who does `Follow`: `reach: 30 m`.",
    Steady "steady" = "For how long a way before that place it has its `speed` already: `steady: 10 m`.",
    Waits "waits" = "How long it stands at the kerb before it sets out: `waits: 2 s`.",
    Meet "meet" = "The part of the ego vehicle's front at which it is met, from the side that it comes from: `meet: 25 %`.",
    Ignores "ignores" = "The rules of the road that it ignores: `ignores: [Signals]`; `[]` for none.",
    Siren "siren" = "Whether it is an emergency vehicle under way, for which all others wait: `siren: true`.",
    Lights "lights" = "The lights that it shows: `Hazard`, `Left`, `Right`, `Flash` or `Off`.",
    Turn "turn" = "Where it goes at the next junction: `Left`, `Straight` or `Right`.",
    Then "then" = "Whether it keeps its lane or changes it, `Keep` or `Change`, or the manoeuvre that it does: `then: brake(4 m/s^2)`.",
    Colour "colour" = "Its paint.",
}

words! {
    /// A scenario's `start` also has a field for each state.
    StartField "A field of `start` in a scenario.":
    SignalPhase "signal_phase" = "Where the cycle of the signals begins, in seconds.",
    TrafficSeed "traffic_seed" = "The seed of the choices of other road users.",
    Ambient "ambient" = "The number of vehicles of ambient traffic.",
    EgoSpeed "ego_speed" = "The speed of the ego vehicle as the episode begins.",
}

words! {
    OriginField "A field of `origin` in a scenario: where it came from.":
    Seed "seed" = "The seed of the run.",
    Episode "episode" = "The number of the episode in the run.",
    Policy "policy" = "The agent that chose the actions.",
    Ads "ads" = "The driving system.",
    Profile "profile" = "The settings of the driving system that differ from the default.",
    ProfileDigest "profile_digest" = "The digest of all settings of the driving system.",
    Answers "answers" = "The digest of the recorded answers of an external driving system.",
    Engine "engine" = "The version of the world's physics.",
    Traffic "traffic" = "How other vehicles drove, if not as they usually do.",
    TrafficDigest "traffic_digest" = "The digest of all settings of the traffic.",
    With "with" = "The optional rules that were on.",
    Without "without" = "The rules that were off.",
}

words! {
    SpaceClaim "What a space may claim of itself.":
    Count "count" = "The number of rows of an action, a group, or all `actions`: `count(actions)`.",
    Every "every" = "`every(actions, realisable)`: each row can run on some road.",
    Actions "actions" = "All actions.",
    Realisable "realisable" = "Found to run on some road, in states to which an episode comes.",
}

words! {
    ScenarioClaim "What a scenario may claim beside facts and verdicts.":
    Cause "cause" = "The module at fault: `expect cause == perception`.",
    Priority "priority" = "Who had priority in a collision: `expect priority == other with npc#2`.",
    End "end" = "How the episode ends: `expect end == arrived`.",
    Recurrence "recurrence" = "How often the collision happens again with other sensor errors and reactions: `expect recurrence == 14 / 20 with npc#2`, or from a moment on: `… at 3.8 s`.",
    Minimal "minimal" = "Without any one of its steps the scenario loses its crash.",
    Trace "trace" = "The digest of the whole state stream: `expect trace == \"sha256:…\"`.",
}

/// Stands for an action in a step of a scenario.
pub const WAIT: (&str, &str) = ("wait", "A step without an action: `3: wait()`.");

words! {
    /// Its sentence is the form in which it must be declared.
    WorldState "A state that the world reads.":
    Time "time" = "time: Time",
    Sky "sky" = "sky: Sky -> Level",
}

words! {
    /// 10:00, 14:00 and 20:00 in the published package.
    /// New ones come last: traces hold their places.
    TimeOfDay "A period of the day.":
    Morning = "10:00, the sun at 20 degrees.",
    Noon = "14:00, the sun at 60 degrees.",
    Night = "20:00, the sun far below the horizon; headlights are on.",
    Dawn = "6:00, civil twilight, the sun 4 degrees below the horizon; headlights are on.",
    Dusk = "18:00, civil twilight, the sun 4 degrees below the horizon; headlights are on.",
}

words! {
    Phenomenon "What the sky does to the road.": Rain, Fog, Wetness
}

words! {
    /// 0, 0.2, 0.5 and 1 on LGSVL's scale.
    Level "How strong a phenomenon is.": None, Light, Moderate, High
}

words! {
    Body "The body of a road user.": Jeep, Sedan, SUV, Hatchback, BoxTruck, SchoolBus, Pedestrian, Motorcycle,
    Bicycle = "It rides on the road, as a vehicle does.",
    Animal = "It is on foot, as a pedestrian is.",
    Object = "A thing on the road: it stands, or follows a trajectory.",
}

words! {
    BodyClass "Bodies of road users together, where they are compared or listed.":
    RoadUser "RoadUser" = "All of them.",
    Vehicle "Vehicle" = "All but `Pedestrian`, `Animal` and `Object`.",
    MotorVehicle "MotorVehicle" = "All vehicles but `Bicycle`.",
    TwoWheeler "TwoWheeler" = "`Motorcycle` and `Bicycle`.",
}

impl BodyClass {
    pub fn holds(self, body: Body) -> bool {
        match self {
            BodyClass::RoadUser => true,
            BodyClass::Vehicle => body.is_vehicle() && body != Body::Object,
            BodyClass::MotorVehicle => body.is_vehicle() && !matches!(body, Body::Bicycle | Body::Object),
            BodyClass::TwoWheeler => body.has_two_wheels(),
        }
    }
}

words! {
    /// Paint changes nothing but the picture, yet it is part of the scenario.
    Colour "A paint.": Pink, Red, Yellow, Black, White, Skyblue
}

words! {
    Verb "What a spawned road user does.":
    DriveAhead = "Drives ahead of the ego vehicle in the same direction.",
    Overtake = "Comes from behind, faster, and passes.",
    DriveOpposite = "Comes towards the ego vehicle in an opposing lane.",
    CrossRoad = "Crosses the ego vehicle's way at a junction.",
    Walk = "A pedestrian who crosses the road on foot.",
    Stand = "Somebody on foot, or an object, that stands in the lane.",
    WalkAhead = "A pedestrian who walks along the road in the ego vehicle's direction.",
    WalkOpposite = "A pedestrian who walks along the road towards the ego vehicle.",
    DriveBehind = "Drives behind the ego vehicle in the same direction.",
    Follow = "Follows a trajectory exactly, whatever comes, as the targets of proving grounds do.",
}

impl Verb {
    pub fn is_on_foot(self) -> bool {
        matches!(self, Verb::Walk | Verb::Stand | Verb::WalkAhead | Verb::WalkOpposite)
    }

    /// Whether it appears behind the ego vehicle.
    pub fn begins_behind(self) -> bool {
        matches!(self, Verb::Overtake | Verb::DriveBehind)
    }

    /// The verb that stands for it where policies see road users: they know those of the paper.
    pub fn as_policies_know(self) -> Verb {
        match self {
            Verb::WalkAhead | Verb::WalkOpposite => Verb::Walk,
            Verb::DriveBehind => Verb::Overtake,
            Verb::DriveAhead
            | Verb::Overtake
            | Verb::DriveOpposite
            | Verb::CrossRoad
            | Verb::Walk
            | Verb::Stand => self,
            Verb::Follow => Verb::CrossRoad,
        }
    }

    /// Whether it walks along the road, rather than over it.
    pub fn walks_along(self) -> bool {
        matches!(self, Verb::WalkAhead | Verb::WalkOpposite)
    }
}

words! {
    LaneChoice "A lane, seen from the ego vehicle's lane.": Left, Current, Right
}

words! {
    Turning "Where a vehicle goes at a junction.": Left, Straight, Right
}

words! {
    ShownLights "The lights that a vehicle shows beside its headlights.":
    Off = "None.",
    Hazard = "All indicators.",
    Left = "The indicators on its left.",
    Right = "The indicators on its right.",
    Flash = "Its headlights, flashed.",
}

words! {
    LightColour "What a traffic light may be told to show.": Red, Yellow, Green
}

words! {
    /// The side from which a crossing road user comes.
    Side "A side, seen from the ego vehicle's lane.": Left, Right
}

words! {
    #[derive(Default)]
    Light "What the next traffic light shows.":
    Red = "The next traffic light is red.",
    Yellow = "The next traffic light is yellow.",
    Green = "The next traffic light is green.",
    #[default]
    None = "No traffic light within 100 m.",
}

words! {
    #[derive(Default)]
    Turn "Where somebody goes at the next junction.":
    Left = "To the left.",
    Straight = "Straight on.",
    Right = "To the right.",
    Back = "Back to where it came from.",
    #[default]
    None = "No junction within 1000 m.",
}

words! {
    #[derive(Default)]
    Crossing "To which side a line is crossed.":
    Left = "To the left.",
    Right = "To the right.",
    #[default]
    None = "It is in its lane, or in a junction.",
}

words! {
    #[derive(Default)]
    RoadKind "Where the ego vehicle drives.":
    #[default]
    OneWay = "On a street without lanes in the other direction.",
    TwoWay = "On a street with lanes in both directions.",
    NearJunction = "At most 20 m before a junction.",
    InJunction = "Inside a junction.",
}

words! {
    /// As far as the two meet: whoever has priority may count on the other to give way.
    #[derive(Default)]
    Priority "Which of the ego vehicle and a road user has priority over the other.":
    Ego "ego" = "The ego vehicle: the road user had to give way.",
    Other "other" = "The road user: the ego vehicle had to give way.",
    #[default]
    None "none" = "Neither, or both owed each other care.",
}

words! {
    Avoidability "Whether careful drivers avoid a collision.":
    #[serde(rename = "avoidable")]
    Avoidable "avoidable" = "A careful reference driver avoids it.",
    #[serde(rename = "beyond_reference")]
    BeyondReference "beyond_reference" = "Neither `cc` nor `fsm` avoids it, but `rss`, `r157` or an evasive manoeuvre without delay does.",
    #[serde(rename = "unavoidable")]
    Unavoidable "unavoidable" = "Nothing that was tried avoids it.",
}

words! {
    ObstacleKind "What a claim says of the body of a road user.":
    Npc "npc" = "Nothing.",
    Pedestrian "pedestrian",
    Vehicle "vehicle",
}

words! {
    TrafficRule "What a vehicle ignores, or drives without.":
    Signals "Signals" = "It stops neither at red lights nor at stop signs.",
    RightOfWay "RightOfWay" = "It waits for nobody at junctions.",
    Ego "Ego" = "It follows and changes lanes as if the ego vehicle were not there.",
    Others "Others" = "It follows and changes lanes as if nobody but the ego vehicle were there.",
    BusLanes "BusLanes" = "It drives in bus lanes though it is no bus.",
    Headlights "Headlights" = "It drives without lights from dusk to dawn.",
    Brakes "Brakes" = "Its brakes have failed: it only rolls out.",
}

words! {
    /// The paper's "lane-change" group.
    Then "Whether a vehicle keeps its lane or changes it.": Keep, Change
}

impl TimeOfDay {
    /// h. Those of Morning, Noon and Night are the published package's.
    pub fn hour(self) -> u32 {
        match self {
            TimeOfDay::Dawn => 6,
            TimeOfDay::Morning => 10,
            TimeOfDay::Noon => 14,
            TimeOfDay::Dusk => 18,
            TimeOfDay::Night => 20,
        }
    }

    /// Whether the sun is a little below the horizon.
    pub fn is_twilight(self) -> bool {
        matches!(self, TimeOfDay::Dawn | TimeOfDay::Dusk)
    }

    /// Height of the sun above the horizon, degrees. Civil twilight lasts down to -6 degrees.
    pub fn sun_elevation_deg(self) -> f64 {
        match self {
            TimeOfDay::Morning => 20.0,
            TimeOfDay::Noon => 60.0,
            TimeOfDay::Dawn | TimeOfDay::Dusk => -4.0,
            TimeOfDay::Night => -30.0,
        }
    }
}

impl Level {
    /// LGSVL's scale, in `[0, 1]`.
    pub fn intensity(self) -> f64 {
        match self {
            Level::None => 0.0,
            Level::Light => 0.2,
            Level::Moderate => 0.5,
            Level::High => 1.0,
        }
    }
}

impl Body {
    /// Everything that is not on foot. An object counts as a vehicle that stands, except where authors name classes.
    pub fn is_vehicle(self) -> bool {
        !matches!(self, Body::Pedestrian | Body::Animal)
    }

    /// Whether a road user of this body can do that.
    pub fn can(self, verb: Verb) -> bool {
        match (self, verb) {
            (_, Verb::Follow) | (Body::Object, Verb::Stand) => true,
            (Body::Object, _) => false,
            _ => verb.is_on_foot() != self.is_vehicle(),
        }
    }

    pub fn has_two_wheels(self) -> bool {
        matches!(self, Body::Motorcycle | Body::Bicycle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_spelt_as_they_are_shown() {
        let quantities = TYPES.iter().filter_map(|(word, ty, _)| match ty {
            Type::Quantity(dimension) => Some((*word, dimension.to_string())),
            Type::Bool | Type::Int | Type::Enum(_) => None,
        });
        let quantities: Vec<(&str, String)> = quantities.collect();
        assert!(quantities.iter().all(|(word, shown)| word == shown), "{quantities:?}");
        assert_eq!(quantities.len(), Dimension::NAMED.len());
    }

    #[test]
    fn the_sentence_of_a_fact_begins_with_its_type() {
        for fact in Fact::ALL {
            let ty = TYPES.iter().find(|(_, ty, _)| *ty == fact.ty()).map(|(word, ..)| *word);
            let begins = format!("`{}`: ", ty.expect("it has a name"));
            assert!(fact.meaning().starts_with(&begins), "{fact:?}");
        }
    }
}
