//! The sighting of a road user after an action made it appear: its frames, ten a second.

use avastra_base::geometry::{OrientedBox, Vec2};
use avastra_drivers::Ads;
use avastra_lang::model::command::Command;
use avastra_road::LaneIndex;
use avastra_world::sim::{Contact, DT_S, FRAME_TICKS, PhaseCount, Scene, Sensed, World};

/// How far beside its nearest lane a vehicle still counts as on the road, m.
const LANE_REACH_M: f64 = 5.0;

/// One road user and the ego vehicle at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// Since the road user appeared, s.
    pub after_s: f64,
    pub ego: OrientedBox,
    /// Station of the ego vehicle's rear axle on the route, m.
    pub ego_station_m: f64,
    pub outline: OrientedBox,
    pub velocity_mps: Vec2,
    /// Gap between the two outlines, m.
    pub gap_m: f64,
    /// Station of the road user's centre on the route, m, and how far left of the route it is, m.
    pub route_station_m: f64,
    pub route_offset_m: f64,
    /// Heading of the route beside it, rad.
    pub route_heading_rad: f64,
    /// The lane that it drives in, and how far beyond that lane's edge its centre is, m.
    pub lane: Option<(LaneIndex, f64)>,
}

/// Why a sighting ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    /// The time that a verb has was over.
    TimeOver,
    /// The ego vehicle reached its goal.
    Arrived,
    /// The ego vehicle and the road user touched each other.
    TouchedEgo,
    /// The road user touched another one.
    TouchedOther,
    /// The road user left the world, or drove over the edge of the map.
    Left,
}

/// A road user from its appearance to the end of what is seen of it.
pub(super) struct Sighting {
    /// Never empty; the first is of the moment at which it appeared.
    pub frames: Vec<Frame>,
    pub ending: Ending,
    /// How many phases of its manoeuvre began, and ended, and how many there are.
    pub phases: PhaseCount,
    /// Whether it has done what it was told.
    pub has_done: bool,
    /// By how much it missed the moment of its last `early`, s; below 0 if it was too soon.
    pub late_s: Option<f64>,
}

/// Lets time pass for up to `horizon_s` and watches the road user of an id; `None` if there is none.
pub(super) fn watch(
    mut world: World,
    ads: &mut dyn Ads,
    sensed: &mut Sensed,
    id: u32,
    told: &Command,
    horizon_s: f64,
) -> Option<Sighting> {
    let scene = world.scene().clone();
    let begin_s = world.time_s();
    let drives = world.obstacle(id)?.body.is_vehicle();
    let mut frames = vec![frame(&scene, &world, id, begin_s)?];
    let mut phases = PhaseCount::default();
    let mut has_done = false;
    let ending = loop {
        if world.time_s() - begin_s >= horizon_s - DT_S / 2.0 {
            break Ending::TimeOver;
        }
        world.sense(sensed);
        let control = ads.drive(sensed);
        phases = world.phases(id).max(phases);
        has_done |= world.has_done(id, told);
        let touched = world.tick(&control).iter().any(|contact: &Contact| contact.obstacle == id);
        let bumped =
            world.incidents().iter().any(|incident| [incident.obstacle, incident.other].contains(&id));
        let ends = touched || bumped;
        if ends || world.ticks().is_multiple_of(FRAME_TICKS) {
            match frame(&scene, &world, id, begin_s) {
                Some(frame) if drives && is_off_map(&scene, &frames[frames.len() - 1], &frame) => {
                    break Ending::Left;
                }
                Some(frame) => frames.push(frame),
                None => break Ending::Left,
            }
        }
        if touched {
            break Ending::TouchedEgo;
        }
        if bumped {
            break Ending::TouchedOther;
        }
        if world.arrived() {
            break Ending::Arrived;
        }
    };
    let phases = world.phases(id).max(phases);
    Some(Sighting { frames, ending, phases, has_done, late_s: world.late_s(id) })
}

/// Whether a vehicle drove over the edge of the map between two frames. It goes on there while it is in sight, and
/// there is no road by which to judge it.
fn is_off_map(scene: &Scene, before: &Frame, now: &Frame) -> bool {
    let at_edge = |(index, _): (LaneIndex, f64)| {
        let lane = scene.map.lane(index);
        lane.successors.is_empty() || lane.predecessors.is_empty()
    };
    now.lane.is_none() && before.lane.is_some_and(at_edge)
}

fn frame(scene: &Scene, world: &World, id: u32, begin_s: f64) -> Option<Frame> {
    let obstacle = world.obstacle(id)?;
    let pose = obstacle.outline.pose;
    let (station_m, offset_m) = scene.route.path.beside(pose.position);
    let lane = scene.map.nearest(pose.position, obstacle.lane_heading_rad, LANE_REACH_M).map(|place| {
        let half_width_m = scene.map.lane(place.lane).width_at(place.station_m) / 2.0;
        (place.lane, (place.offset_m.abs() - half_width_m).max(0.0))
    });
    Some(Frame {
        after_s: world.time_s() - begin_s,
        ego: world.ego_outline(),
        ego_station_m: world.ego_station_m(),
        outline: obstacle.outline,
        velocity_mps: obstacle.velocity_mps,
        gap_m: obstacle.distance_m,
        route_station_m: station_m,
        route_offset_m: offset_m,
        route_heading_rad: scene.route.path.pose_at(station_m).heading_rad,
        lane,
    })
}
