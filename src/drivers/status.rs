//! The inside of a driving system, as far as the paper's internal state and the pictures need it.

use core::fmt;
use std::sync::Arc;

use avastra_base::geometry::{Pose, Vec2};
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::{Control, SensedObject};

/// The beliefs, plans and commands of a driving system.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Status {
    /// Where it believes its rear axle is.
    pub localized: Option<Pose>,
    pub perceived: Vec<PerceivedObject>,
    /// Ids of the true objects that the last look detected, known or not: an annotation for judges.
    pub detected: Vec<u32>,
    /// Planned positions of the rear axle, every 0.1 s from the moment of planning.
    pub planned: Vec<Vec2>,
    pub control: Control,
    /// Apollo's `steering_rate`: its command is constant, so this is the measured rate, rad/s.
    pub steer_rate_radps: f64,
    /// The manoeuvre along the path.
    pub manoeuvre: Manoeuvre,
    /// Why it drives as it does now: the constraint that holds it back most.
    pub reason: Reason,
    /// The same in the words of an external driving system, if it says so.
    pub reported: Option<Arc<str>>,
}

/// Ids from here on belong to ghosts: objects that a driving system sees and that are not there.
pub const GHOST_ID_MIN: u32 = 1 << 31;

/// The manoeuvre of a plan. `Display` gives a few words, for example `nudge 3`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Manoeuvre {
    #[default]
    LaneFollow,
    /// Passes something that stands at the edge of the lane, within it.
    Nudge(u32),
    /// Changes lanes.
    LaneChange,
    /// Keeps its lane until there is a gap in the one that it must change to.
    AwaitGap,
}

impl Manoeuvre {
    /// The manoeuvre with the number of its object replaced.
    pub(super) fn renumbered(self, number: impl Fn(u32) -> u32) -> Manoeuvre {
        match self {
            Manoeuvre::Nudge(id) => Manoeuvre::Nudge(number(id)),
            other => other,
        }
    }
}

impl fmt::Display for Manoeuvre {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Manoeuvre::LaneFollow => write!(f, "lane follow"),
            Manoeuvre::Nudge(id) => write!(f, "nudge {}", named(*id)),
            Manoeuvre::LaneChange => write!(f, "lane change"),
            Manoeuvre::AwaitGap => write!(f, "await gap"),
        }
    }
}

/// An object's number, or that it is a ghost.
fn named(id: u32) -> String {
    if id >= GHOST_ID_MIN { "a ghost".to_owned() } else { id.to_string() }
}

/// An object as the driving system believes it to be.
#[derive(Debug, Clone, PartialEq)]
pub struct PerceivedObject {
    /// Id of the true object; `None` is a ghost.
    pub id: Option<u32>,
    /// The number under which the driving system follows it.
    pub track: u32,
    pub body: Body,
    /// Centre of the outline.
    pub pose: Pose,
    pub velocity_mps: Vec2,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// Predicted positions of the centre, every 0.5 s from the moment of planning.
    pub predicted: Vec<Vec2>,
}

impl PerceivedObject {
    /// The truth, as one perceives it who drives by the truth.
    pub fn as_it_is(object: &SensedObject) -> PerceivedObject {
        PerceivedObject {
            id: Some(object.id),
            track: object.id,
            body: object.body,
            pose: object.pose,
            velocity_mps: object.velocity_mps,
            length_m: object.length_m,
            width_m: object.width_m,
            height_m: object.height_m,
            predicted: Vec::new(),
        }
    }
}

/// The most restrictive constraint of a plan. `Display` gives a few words, for example `follow 3`;
/// numbers are ids of objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reason {
    /// Nothing planned yet.
    #[default]
    Start,
    /// Free road: the limit, a curve ahead or the cruising speed decides.
    Cruise,
    /// A red or yellow light.
    RedLight,
    /// A stop sign at which the vehicle has not stood yet.
    StopSign,
    /// Something that stands in the way.
    Stop(u32),
    /// Something that moves ahead in the same direction.
    Follow(u32),
    /// Something that will cross the way.
    Yield(u32),
    /// Waits for a gap in the lane that it must change to.
    LaneChange,
    /// A crosswalk that a pedestrian is on or comes onto.
    Crosswalk,
    /// Comes slowly to a junction at which others go first.
    Approach,
    /// Creeps into such a junction, or waits there, until nothing enters.
    Creep,
    /// No faster than it can stop within what it sees.
    Sight,
    /// A junction that could not be left at once.
    KeepClear,
    /// Lost the route: constant braking.
    Fallback,
    /// A module is too late: the degraded mode brakes.
    Degraded,
    /// Emergency braking before something.
    Emergency(u32),
    /// It has touched something: it brakes to rest and stays.
    Contact,
    /// An external driving system drives: see [`Status::reported`].
    Reported,
}

/// How much a reason holds the speed back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Restraint {
    /// It brakes as hard as it can, or drives no farther.
    Hard,
    /// It comes to a stop, or goes slowly until a way is free.
    Stops,
    /// As fast as others or the sight allow.
    Follows,
    /// As fast as the road allows, or what an external driving system calls in its own words.
    Free,
}

impl Status {
    /// Replaces what is perceived by objects without forecasts; the buffers of forecasts are kept.
    pub(super) fn perceive(&mut self, objects: impl Iterator<Item = PerceivedObject>) {
        let mut count = 0;
        for mut object in objects {
            match self.perceived.get_mut(count) {
                Some(place) => {
                    object.predicted = core::mem::take(&mut place.predicted);
                    object.predicted.clear();
                    *place = object;
                }
                None => self.perceived.push(object),
            }
            count += 1;
        }
        self.perceived.truncate(count);
    }

    /// Why it drives as it does now, in words.
    pub fn reason_text(&self) -> String {
        self.reason.in_words(self.reported.as_deref())
    }
}

impl Reason {
    /// The reason in an external driving system's own words, if it gives any.
    pub fn in_words(self, reported: Option<&str>) -> String {
        reported.map_or_else(|| self.to_string(), str::to_owned)
    }

    /// How much it holds the speed back.
    pub fn restraint(self) -> Restraint {
        match self {
            Reason::Emergency(_) | Reason::Contact | Reason::Fallback | Reason::Degraded => Restraint::Hard,
            Reason::Stop(_)
            | Reason::StopSign
            | Reason::RedLight
            | Reason::Crosswalk
            | Reason::Yield(_)
            | Reason::Creep
            | Reason::Approach
            | Reason::KeepClear => Restraint::Stops,
            Reason::Follow(_) | Reason::LaneChange | Reason::Sight => Restraint::Follows,
            Reason::Start | Reason::Cruise | Reason::Reported => Restraint::Free,
        }
    }

    /// The reason with the number of its object replaced.
    pub(super) fn renumbered(self, number: impl Fn(u32) -> u32) -> Reason {
        match self {
            Reason::Stop(id) => Reason::Stop(number(id)),
            Reason::Follow(id) => Reason::Follow(number(id)),
            Reason::Yield(id) => Reason::Yield(number(id)),
            Reason::Emergency(id) => Reason::Emergency(number(id)),
            other => other,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Start => write!(f, "start"),
            Reason::Cruise => write!(f, "cruise"),
            Reason::RedLight => write!(f, "red light"),
            Reason::StopSign => write!(f, "stop sign"),
            Reason::Stop(id) => write!(f, "stop {}", named(*id)),
            Reason::Follow(id) => write!(f, "follow {}", named(*id)),
            Reason::Yield(id) => write!(f, "yield {}", named(*id)),
            Reason::LaneChange => write!(f, "lane change"),
            Reason::Crosswalk => write!(f, "crosswalk"),
            Reason::Approach => write!(f, "approach"),
            Reason::Creep => write!(f, "creep"),
            Reason::Sight => write!(f, "sight"),
            Reason::KeepClear => write!(f, "keep clear"),
            Reason::Fallback => write!(f, "fallback"),
            Reason::Degraded => write!(f, "degraded mode"),
            Reason::Emergency(id) => write!(f, "emergency {}", named(*id)),
            Reason::Contact => write!(f, "stop after a contact"),
            Reason::Reported => write!(f, "its own program, which gave no reason"),
        }
    }
}
