//! The messages of avastra-ads/1, as docs/reference/protocol.md has them. Their JSON Schemas follow from the types here (`schema`).

use serde::{Deserialize, Serialize};

use super::link::Broken;
use super::schema::{Bounds, Schema, fields_schema, inside, length_beyond, value_beyond};
use super::words::words;

/// An acceleration beyond this, m/s², is no plan but the output of a formula, for example of a car-following model at a small
/// gap.
pub const EXTREME_MPS2: f64 = 100.0;

/// The message of an `error` is cut off here, characters.
pub const ERROR_CHARS_MAX: usize = 2000;

/// The name and version of the protocol.
pub const PROTOCOL: &str = "avastra-ads/1";

/// A struct of a message: each field once, with its description and, for numbers, its range; after `=> length`, how long a
/// text or list is. Fields after `?` are optional. Serde, the schema and the check of bounds follow from it.
macro_rules! message {
    (
        $(#[doc = $about:literal])*
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])* $field:ident: $type:ty $(, $low:literal ..= $high:literal)?
                $(=> length $least:literal ..= $most:expr)?;
            )*
            $(
                ? $(#[doc = $more:literal])* $option:ident: $inner:ty $(, $from:literal ..= $to:literal)?
                $(=> length $fewest:literal ..= $longest:expr)?;
            )*
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub struct $name {
            $( $(#[doc = $doc])* pub $field: $type, )*
            $( $(#[doc = $more])* #[serde(default, skip_serializing_if = "Option::is_none")] pub $option: Option<$inner>, )*
        }

        impl Schema for $name {
            fn schema() -> serde_json::Value {
                fields_schema(
                    concat!($($about),*),
                    &[
                        $((stringify!($field), concat!($($doc),*), <$type as Schema>::schema(), bounds!($($low, $high)? $(=> $least, $most)?), true),)*
                        $((stringify!($option), concat!($($more),*), <$inner as Schema>::schema(), bounds!($($from, $to)? $(=> $fewest, $longest)?), false),)*
                    ],
                )
            }

            fn out_of_range(&self, at: &str) -> Option<Broken> {
                let _ = at;
                $( if let Some(found) = checked!(&self.$field, &inside(at, stringify!($field)) $(, $low, $high)? $(=> $least, $most)?) { return Some(found); } )*
                $( if let Some(value) = &self.$option
                    && let Some(found) = checked!(value, &inside(at, stringify!($option)) $(, $from, $to)? $(=> $fewest, $longest)?) { return Some(found); } )*
                None
            }
        }
    };
}

macro_rules! bounds {
    () => {
        None
    };
    ($low:literal, $high:literal) => {
        Some(Bounds::Value($low as f64, $high as f64))
    };
    (=> $least:literal, $most:expr) => {
        Some(Bounds::Length($least, $most))
    };
}

macro_rules! checked {
    ($value:expr, $at:expr) => {
        Schema::out_of_range($value, $at)
    };
    ($value:expr, $at:expr, $low:literal, $high:literal) => {
        value_beyond(*$value, $at, $low as f64, $high as f64)
    };
    ($value:expr, $at:expr => $least:literal, $most:expr) => {
        length_beyond($value, $at, $least, $most).or_else(|| Schema::out_of_range($value, $at))
    };
}

/// Schemas of closed sets of words.
macro_rules! schemas_of_words {
    ($($name:ident),* $(,)?) => {
        $(
            impl Schema for $name {
                fn schema() -> serde_json::Value {
                    serde_json::json!({ "enum": $name::ALL.map($name::name) })
                }
            }
        )*
    };
}

schemas_of_words!(
    Observation,
    AnswerKind,
    Class,
    Light,
    TurnWord,
    SignWord,
    PrecedenceWord,
    VehicleLights,
    LaneChangeWord
);

words! {
    /// What a driving system is shown.
    #[derive(Default)]
    pub enum Observation { #[default] Perceived = "perceived", Truth = "truth" }
}

words! {
    /// The kinds of answers to a step.
    pub enum AnswerKind { Control = "control", Trajectory = "trajectory", Acceleration = "acceleration" }
}

words! {
    /// Kinds of road users.
    pub enum Class {
        Car = "car", Truck = "truck", Bus = "bus", Motorcycle = "motorcycle", Cyclist = "cyclist",
        Pedestrian = "pedestrian", Animal = "animal", Object = "object", Unknown = "unknown",
    }
}

words! {
    /// Lights that a vehicle shows beside its headlights: indicators on both sides or on one, or headlights that are flashed.
    pub enum VehicleLights { Hazard = "hazard", Left = "left", Right = "right", Flash = "flash" }
}

words! {
    /// What a driving system that answers accelerations says of the route's next lane change: not now, or now, whoever is there.
    pub enum LaneChangeWord { Wait = "wait", Go = "go" }
}

words! {
    /// What a light shows.
    pub enum Light { Red = "red", Yellow = "yellow", Green = "green", Unknown = "unknown" }
}

words! {
    /// What a lane does inside a junction.
    pub enum TurnWord { Straight = "straight", Left = "left", Right = "right", UTurn = "u_turn" }
}

words! {
    /// Signs at which a lane stops or gives way.
    pub enum SignWord { Stop = "stop", Yield = "yield" }
}

words! {
    /// What signs say of a lane inside a junction.
    pub enum PrecedenceWord { Priority = "priority", Equal = "equal", Yield = "yield" }
}

/// A point on the map: x, y, m.
pub type Point = [f64; 2];

message! {
    /// Sent once, first: the protocol, the vehicle and how it will be asked.
    pub struct Init {
        /// Name and version of the protocol.
        protocol: String;
        /// Who asks.
        simulator: String;
        /// Length of a tick, µs.
        tick_us: u64;
        /// Time between two steps, µs.
        period_us: u64;
        /// What steps will show.
        observation: Observation;
        /// The ego vehicle.
        vehicle: Vehicle;
        ? /// The kind of answer that is asked for.
        answer: AnswerKind;
    }
}

message! {
    /// The ego vehicle: dimensions in m, limits.
    pub struct Vehicle {
        length: f64; width: f64; height: f64; wheelbase: f64;
        /// From the centre of the rear axle to the front bumper, m.
        rear_axle_to_front: f64;
        /// From the centre of the rear axle to the rear bumper, m.
        rear_axle_to_back: f64;
        /// Largest angle of the road wheels, rad.
        max_steer: f64;
        /// Fastest change of that angle, rad/s.
        max_steer_rate: f64;
        /// m/s².
        max_accel: f64;
        /// Magnitude, m/s².
        max_decel: f64;
        /// kg.
        mass: f64;
    }
}

message! {
    /// A map, before the first episode on it.
    pub struct Map {
        /// Name of the map.
        id: String;
        /// Absolute path of its OpenDRIVE file.
        opendrive: Option<String>;
        /// The driving lanes.
        lanes: Vec<LaneMessage>;
        /// Traffic lights for vehicles.
        signals: Vec<SignalPlace>;
        crosswalks: Vec<CrosswalkMessage>;
    }
}

message! {
    /// A driving lane, in the direction of its traffic.
    pub struct LaneMessage {
        /// Its name, unique on the map.
        id: String;
        /// m.
        length: f64;
        /// Stations of the points below, m, rising.
        s: Vec<f64>;
        /// Its centre line, m.
        centerline: Vec<Point>;
        /// Its left edge, m.
        left: Vec<Point>;
        /// Its right edge, m.
        right: Vec<Point>;
        /// m/s.
        speed_limit: f64;
        turn: TurnWord;
        /// Id of the junction that it lies in.
        junction: Option<String>;
        successors: Vec<String>;
        predecessors: Vec<String>;
        left_neighbor: Option<NeighborMessage>;
        right_neighbor: Option<NeighborMessage>;
        /// Stretches (from, to, m) on which a vehicle may change to the left.
        changes_left: Vec<[f64; 2]>;
        /// Stretches (from, to, m) on which a vehicle may change to the right.
        changes_right: Vec<[f64; 2]>;
        /// Where it stops for lights.
        stop_lines: Vec<LaneStop>;
        /// Where it stops or gives way by a sign.
        signs: Vec<LaneSign>;
        precedence: PrecedenceWord;
    }
}

message! {
    /// The next driving lane on a side.
    pub struct NeighborMessage {
        id: String;
        same_direction: bool;
        /// Width of what lies between the two, m.
        gap: f64;
    }
}

message! {
    /// A stop line for a light.
    pub struct LaneStop { s: f64; signal: String; }
}

message! {
    /// A sign that holds for a lane.
    pub struct LaneSign { s: f64; kind: SignWord; }
}

message! {
    /// Where a light stands.
    pub struct SignalPlace { id: String; x: f64; y: f64; }
}

message! {
    /// A crosswalk: its corners in order.
    pub struct CrosswalkMessage { id: String; outline: Vec<Point>; }
}

message! {
    /// The beginning of an episode: forget everything but the map.
    pub struct Reset {
        /// For everything random in the driving system.
        seed: u64;
        /// Id of the map.
        map: String;
        start: Start;
        goal: Goal;
        route: RouteMessage;
        ? /// `names`: the episode's seed in full, as scenarios and `run.db` have it.
        episode_seed: String;
    }
}

message! {
    /// The rear axle at the start: m, rad, m/s.
    pub struct Start { x: f64; y: f64; heading: f64; speed: f64; }
}

message! {
    /// Where the rear axle is to go.
    pub struct Goal { x: f64; y: f64; heading: f64; lane: String; route_s: f64; }
}

message! {
    /// The way to the goal.
    pub struct RouteMessage {
        lanes: Vec<RouteStretch>;
        /// m.
        length: f64;
        /// Distance between the points of the path, m.
        spacing: f64;
        /// Centre line of the way: x, y (m), heading (rad), curvature (1/m), speed limit (m/s).
        path: Vec<[f64; 5]>;
        changes: Vec<RouteChange>;
        stop_lines: Vec<RouteStop>;
        signs: Vec<RouteSign>;
        /// Where the path crosses crosswalks: from, to, m.
        crosswalks: Vec<[f64; 2]>;
        ? /// `conflicts`: where the path crosses other lanes inside junctions.
        conflicts: Vec<ConflictMessage>;
    }
}

message! {
    /// A crossing with another lane. `precedence` of both lanes, their signs and lights say who goes first.
    pub struct ConflictMessage {
        /// Place on the route, m.
        route_s: f64;
        /// Id of the other lane.
        lane: String;
        /// Place on that lane, m.
        s: f64;
        /// Heading of that lane minus that of the route, rad; positive comes from the right.
        angle: f64;
    }
}

message! {
    /// A lane of the way, between two stations of it, m.
    pub struct RouteStretch { id: String; from: f64; to: f64; }
}

message! {
    /// A lane change on the way, by stations of it, m.
    pub struct RouteChange {
        from: f64; to: f64;
        /// By where it must be over.
        latest: f64;
        /// How far it goes to the left, m.
        lateral: f64;
    }
}

message! {
    /// A light on the way.
    pub struct RouteStop { route_s: f64; signal: String; }
}

message! {
    /// A sign on the way.
    pub struct RouteSign { route_s: f64; kind: SignWord; }
}

message! {
    /// A moment, and the question what to do.
    pub struct Step {
        /// Number of the step in its episode, from 0.
        seq: u64;
        /// Time in the episode, µs.
        t_us: u64;
        ego: EgoMessage;
        objects: Vec<ObjectMessage>;
        /// Lights within 150 m.
        signals: Vec<SignalState>;
        conditions: ConditionsMessage;
    }
}

message! {
    /// The ego vehicle, at the centre of its rear axle.
    pub struct EgoMessage {
        x: f64; y: f64; heading: f64;
        /// Velocity in the map frame, m/s.
        vx: f64; vy: f64;
        /// Along the vehicle, m/s.
        speed: f64;
        /// m/s².
        accel: f64;
        /// rad/s.
        yaw_rate: f64;
        /// Angle of the road wheels now, rad.
        steer: f64;
        /// Whether it has touched something in this episode.
        touched: bool;
        /// The lane that it is on.
        lane: Option<String>;
        /// Place on that lane, m; 0 without one.
        s: f64;
        /// Offset to the left of that lane's centre, m; 0 without one.
        d: f64;
        /// Place on the route, m.
        route_s: f64;
        /// Offset to the left of the route, m.
        route_d: f64;
        /// Standard deviation of x and of y, m; 0 for the truth.
        position_std: f64;
    }
}

message! {
    /// A road user, at the centre of its outline.
    pub struct ObjectMessage {
        id: u64;
        class: Class;
        x: f64; y: f64; heading: f64;
        /// Velocity in the map frame, m/s.
        vx: f64; vy: f64;
        length: f64; width: f64; height: f64;
        /// How much of it is in sight, from 0 to 1.
        visible: f64;
        ? /// What a vehicle shows that shows something.
        lights: VehicleLights;
        ? /// `motion`: acceleration in the map frame since the step before, m/s²; 0 in the first.
        ax: f64;
        ? /// `motion`: as `ax`.
        ay: f64;
        ? /// `motion`: turn of the heading since the step before, rad/s; 0 in the first.
        yaw_rate: f64;
        ? /// `motion`: since when it is known under this number without a gap, s.
        age: f64;
        ? /// `names`: the road user's number in scenarios and reports. A ghost has none.
        npc: u64;
    }
}

message! {
    /// What a light shows.
    pub struct SignalState { id: String; state: Light; }
}

message! {
    /// Light, weather and road where the ego vehicle is.
    pub struct ConditionsMessage {
        /// From 0 to 1 (day).
        light: f64;
        /// mm/h.
        rain: f64;
        /// How far one sees, m.
        visibility: f64;
        /// Water on the road, mm.
        water: f64;
        /// Coefficient of tyre friction.
        friction: f64;
    }
}

message! {
    /// Something happened. No answer.
    pub struct Event {
        /// `collision`, `end`, or a word of a later version.
        kind: String;
        /// Time in the episode, µs.
        t_us: u64;
    }
}

message! {
    /// The end: exit with status 0.
    pub struct Close {}
}

message! {
    /// Ready for the next message. To `init` with every field, to `map` and `reset` with none.
    pub struct Ready {
        ? /// Name and version of the protocol.
        protocol: String;
        ? /// What is under test.
        name: String => length 1..=100;
        ? /// Its version.
        version: String => length 1..=100;
        ? /// The kind of every answer to a step.
        answer: AnswerKind;
        ? /// Whether the same questions lead to the same answers.
        deterministic: bool;
        ? /// Groups of fields that it also wants: `motion`, `conflicts`, `names`. Other words are for later versions.
        wants: Vec<String> => length 0..=20;
    }
}

message! {
    /// Pedals and wheel: `accel`, or `throttle` and `brake`.
    pub struct ControlMessage {
        seq: u64;
        /// Wanted angle of the road wheels, rad.
        steer: f64, -3.2..=3.2;
        ? /// m/s²; negative brakes. The vehicle does as much of it as it can.
        accel: f64;
        ? /// Position of the pedal.
        throttle: f64, 0..=1;
        ? /// Position of the pedal.
        brake: f64, 0..=1;
        ? /// What it believes and wants.
        internal: Internal;
    }
}

message! {
    /// A planned drive of the rear axle.
    pub struct TrajectoryMessage {
        seq: u64;
        /// By rising time, from not later than the step to at least 1 s after it.
        points: Vec<TrajectoryPoint> => length 2..=1000;
        ? /// What it believes and wants.
        internal: Internal;
    }
}

message! {
    /// Where the rear axle is to be, and when.
    pub struct TrajectoryPoint {
        /// Time in the episode, µs.
        t_us: u64;
        x: f64, -10000000..=10000000;
        y: f64, -10000000..=10000000;
        heading: f64, -1000..=1000;
        /// Along the vehicle, m/s.
        v: f64, 0..=100;
        ? /// m/s²; by default from the speeds. The vehicle does as much of it as it can.
        a: f64;
    }
}

message! {
    /// A wanted acceleration; avastra steers along the route.
    pub struct AccelerationMessage {
        seq: u64;
        /// m/s²; negative brakes. The vehicle does as much of it as it can.
        accel: f64;
        ? /// What is to become of the route's next lane change; without it avastra looks whether there is room.
        lane_change: LaneChangeWord;
        ? /// What it believes and wants.
        internal: Internal;
    }
}

message! {
    /// What a driving system believes and wants, for pictures and logs.
    pub struct Internal {
        ? /// What holds the speed back now.
        reason: String => length 0..=200;
        ? /// Where the rear axle shall be, every 0.1 s from now on.
        planned: Vec<Point> => length 0..=1000;
        ? /// Where it believes its rear axle is.
        localized: PoseMessage;
        ? /// Time that planning took, ms.
        plan_ms: f64;
    }
}

message! {
    /// A place and a direction.
    pub struct PoseMessage {
        x: f64, -10000000..=10000000;
        y: f64, -10000000..=10000000;
        heading: f64, -1000..=1000;
    }
}

message! {
    /// The driving system cannot go on.
    pub struct ErrorMessage {
        /// Cut off after 2,000 characters.
        message: String => length 0..=ERROR_CHARS_MAX;
    }
}

/// A message to the driving system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Question {
    Init(Init),
    Map(Map),
    Reset(Reset),
    Step(Box<Step>),
    Event(Event),
    Close(Close),
}

/// A message from the driving system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Answer {
    Ready(Ready),
    Control(ControlMessage),
    Trajectory(TrajectoryMessage),
    Acceleration(AccelerationMessage),
    Error(ErrorMessage),
}

impl Question {
    /// As a line, with its end.
    pub fn line(&self) -> String {
        let mut line = serde_json::to_string(self).expect("messages are plain data");
        line.push('\n');
        line
    }
}

impl Answer {
    /// The step that it answers.
    pub fn seq(&self) -> Option<u64> {
        match self {
            Answer::Control(answer) => Some(answer.seq),
            Answer::Trajectory(answer) => Some(answer.seq),
            Answer::Acceleration(answer) => Some(answer.seq),
            Answer::Ready(_) | Answer::Error(_) => None,
        }
    }

    /// Whether it asks for an acceleration beyond [`EXTREME_MPS2`]. The vehicle then does as much of it as it can.
    pub fn is_extreme(&self) -> bool {
        let is_beyond = |accel: f64| accel.abs() > EXTREME_MPS2;
        match self {
            Answer::Control(answer) => answer.accel.is_some_and(is_beyond),
            Answer::Trajectory(answer) => answer.points.iter().filter_map(|point| point.a).any(is_beyond),
            Answer::Acceleration(answer) => is_beyond(answer.accel),
            Answer::Ready(_) | Answer::Error(_) => false,
        }
    }

    pub fn internal(&self) -> Option<&Internal> {
        match self {
            Answer::Control(answer) => answer.internal.as_ref(),
            Answer::Trajectory(answer) => answer.internal.as_ref(),
            Answer::Acceleration(answer) => answer.internal.as_ref(),
            Answer::Ready(_) | Answer::Error(_) => None,
        }
    }

    pub(super) fn internal_mut(&mut self) -> Option<&mut Option<Internal>> {
        match self {
            Answer::Control(answer) => Some(&mut answer.internal),
            Answer::Trajectory(answer) => Some(&mut answer.internal),
            Answer::Acceleration(answer) => Some(&mut answer.internal),
            Answer::Ready(_) | Answer::Error(_) => None,
        }
    }
}

/// Every message by the word in its `type`, with its schema: to the driving system, and from it.
pub fn schemas() -> Vec<(&'static str, &'static str, serde_json::Value)> {
    let typed = |direction, word: &'static str, mut schema: serde_json::Value| {
        schema["properties"]["type"] = serde_json::json!({ "const": word });
        schema["required"].as_array_mut().expect("a struct says what it requires").insert(0, "type".into());
        (direction, word, schema)
    };
    vec![
        typed("to the driving system", "init", Init::schema()),
        typed("to the driving system", "map", Map::schema()),
        typed("to the driving system", "reset", Reset::schema()),
        typed("to the driving system", "step", Step::schema()),
        typed("to the driving system", "event", Event::schema()),
        typed("to the driving system", "close", Close::schema()),
        typed("from the driving system", "ready", Ready::schema()),
        typed("from the driving system", "control", ControlMessage::schema()),
        typed("from the driving system", "trajectory", TrajectoryMessage::schema()),
        typed("from the driving system", "acceleration", AccelerationMessage::schema()),
        typed("from the driving system", "error", ErrorMessage::schema()),
    ]
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    /// A value as its type writes it: fields that the type does not know are gone.
    fn again(value: &Value) -> Result<Value, serde_json::Error> {
        let word = value["type"].as_str().unwrap_or_default();
        if ["init", "map", "reset", "step", "event", "close"].contains(&word) {
            serde_json::to_value(serde_json::from_value::<Question>(value.clone())?)
        } else {
            serde_json::to_value(serde_json::from_value::<Answer>(value.clone())?)
        }
    }

    /// Whether two values are the same. A number is the same whether it is written as an integer or not.
    fn alike(a: &Value, b: &Value) -> bool {
        match (a, b) {
            (Value::Number(a), Value::Number(b)) => a.as_f64() == b.as_f64(),
            (Value::Array(a), Value::Array(b)) => {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b))
            }
            (Value::Object(a), Value::Object(b)) => {
                a.len() == b.len() && a.iter().all(|(key, a)| b.get(key).is_some_and(|b| alike(a, b)))
            }
            _ => a == b,
        }
    }

    #[test]
    fn the_examples_of_the_specification_are_whole_messages() {
        let text = include_str!("../../../docs/reference/protocol.md");
        let mut words = Vec::new();
        for line in text.lines().filter(|line| line.starts_with("{\"type\"")) {
            let value: Value = serde_json::from_str(line).expect(line);
            let read = again(&value).unwrap_or_else(|error| panic!("{line}: {error}"));
            assert!(alike(&read, &value), "{line}\n{read}");
            words.push(value["type"].as_str().expect("a word").to_owned());
        }
        for (_, word, _) in schemas() {
            assert!(words.iter().any(|known| known == word), "no example of `{word}`");
        }
    }

    #[test]
    fn a_recorded_conversation_is_read_and_follows_the_schemas() {
        let text = include_str!("../../../python/tests/conversation.jsonl");
        let schemas = schemas();
        for line in text.lines() {
            let (_, value): (String, Value) = serde_json::from_str(line).expect(line);
            let read = again(&value).unwrap_or_else(|error| panic!("{line}: {error}"));
            assert!(alike(&read, &value), "{line}\n{read}");
            let found = schemas.iter().find(|(_, word, _)| value["type"] == *word).expect("a known word");
            let required = found.2["required"].as_array().expect("names").iter();
            for name in required {
                assert!(value.get(name.as_str().expect("a name")).is_some(), "{name} in {line}");
            }
        }
    }
}
