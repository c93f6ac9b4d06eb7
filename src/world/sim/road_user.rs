//! A road user other than the ego vehicle: what others may see of it (`Obstacle`), and what moves it
//! (`Mover`): a driver, two legs, or nothing.

use std::sync::Arc;

use crate::action::{Course, LaterMoment};
use avastra_base::geometry::{OrientedBox, Pose, Sweep, Vec2, distance_m, unit_vector};
use avastra_base::kinematics::GRAVITY_MPS2;
use avastra_lang::model::command::{Command, Moves};
use avastra_lang::model::vocabulary::{Body, Colour, ShownLights, TrafficRule, Verb};
use avastra_road::is_apart;

use super::ambient::COMMANDED_MAX;
use super::around::{Around, Other};
use super::body::BodyParameters;
use super::guided::Guided;
use super::npc::{Driver, View};
use super::pedestrian::Walker;
use super::right_of_way::{Rights, SIDEWAYS_MPS};
use super::stroller::Stroller;
use crate::state::time::{DT_S, ticks};
use crate::state::trace::Trace;

/// How long a wreck stays where it came to rest, s; longer while the ego vehicle sees it.
const WRECK_S: f64 = 2.0;

/// A road user this near to the speed of a phase has it, m/s, or by this part of it: without a `rate`, the driver model only
/// approaches it.
const SPEED_REACHED_MPS: f64 = 0.1;
const SPEED_REACHED_PART: f64 = 0.02;

/// What walks or stands does so beside this stretch of the ego vehicle's route, before and behind it, m.
const ON_FOOT_M: f64 = 200.0;

/// A road user other than the ego vehicle, as others may see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// From 1, in order of appearance; ambient traffic has numbers of its own.
    pub id: u32,
    pub body: Body,
    pub colour: Colour,
    pub verb: Verb,
    pub outline: OrientedBox,
    /// Unit vector along the outline's heading, kept because it is asked for so often.
    pub forward: Vec2,
    pub height_m: f64,
    /// Heading of the lane that it drives in; a pedestrian's own heading.
    pub lane_heading_rad: f64,
    pub velocity_mps: Vec2,
    /// Along its heading, over the last tick; negative when it brakes.
    pub acceleration_mps2: f64,
    /// Height of the road under it, m.
    pub elevation_m: f64,
    /// Whether its road passes over or under that of the ego vehicle, which then neither sees nor meets it; at
    /// most 0.1 s old.
    pub is_apart: bool,
    /// Gap between its outline and the ego vehicle's, m; 0 if they touch.
    pub distance_m: f64,
    pub spawned_tick: u64,
    /// What it was told to show.
    pub lights: ShownLights,
}

impl Obstacle {
    /// Whether it is ambient traffic, which no action made appear.
    pub fn is_ambient(&self) -> bool {
        self.id > COMMANDED_MAX
    }

    /// Whether a vehicle comes out of its lane sideways, as in a lane change.
    pub fn moves_aside(&self) -> bool {
        let lane = unit_vector(self.lane_heading_rad);
        self.body.is_vehicle() && lane.perp(&self.velocity_mps).abs() > SIDEWAYS_MPS
    }
}

/// One road user of the world.
#[derive(Debug, Clone)]
pub(super) struct RoadUser {
    pub obstacle: Obstacle,
    pub mover: Mover,
}

/// The hidden side of a road user.
#[derive(Debug, Clone)]
pub(super) struct Mover {
    pub size: BodyParameters,
    pub motion: Motion,
    /// Whether it and the ego vehicle have touched, whichever ran into the other.
    pub touched: bool,
    /// The obstacle that it touched last: it slides to rest.
    crashed_with: Option<u32>,
    /// Ticks that it has been a wreck at rest.
    rest_ticks: u32,
    /// Part of it that the ego vehicle's sensors saw when they last looked.
    pub visible_fraction: f64,
    /// Which of the two has priority: it or the ego vehicle.
    pub rights: Rights,
    /// The name that its action gave it, by index in the space.
    pub bearer: Option<usize>,
    /// The manoeuvre that it does, until it ends or an order replaces it.
    pub course: Option<Running>,
    /// How many phases of its last manoeuvre have begun, and ended, and how many there are. Nothing depends on them.
    pub phases: PhaseCount,
}

/// How far a road user is with a manoeuvre. To be handed over to another one adds that one's phases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct PhaseCount {
    pub begun: u32,
    pub ended: u32,
    pub all: u32,
}

/// A manoeuvre under way.
#[derive(Debug, Clone)]
pub(super) struct Running {
    course: Arc<Course>,
    phase: usize,
    stage: Stage,
    /// Tick at which the stage began.
    since: u64,
    tracked: Option<Tracked>,
}

/// A phase whose speed is told anew in every tick, until another one is told.
#[derive(Debug, Clone)]
struct Tracked {
    course: Arc<Course>,
    phase: usize,
    /// What it told first.
    first: Command,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Until what the phase waits for has held for long enough: the tick since which it has held.
    Waiting(Option<u64>),
    /// Until this tick, and until the rules let the phase begin.
    Holding(u64),
    /// Until the road user has done what it was told.
    UnderWay(Command),
    /// No phase is left; a speed is still tracked.
    Over,
}

/// How far a road user is with what it was told.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress {
    /// Below 0 back to where it began, on foot.
    pub speed_mps: f64,
    /// Whether it is in the lane and at the offset that it was told.
    pub is_aside: bool,
    /// Whether the junction at which it was told to turn is behind it.
    pub has_turned: bool,
    /// Whether it is beside the ego vehicle as it was told, or was.
    pub has_met: bool,
    pub moves: Moves,
    /// Whether it is where its walk ends, this way or back: no speed would get it farther.
    pub is_over: bool,
}

impl Progress {
    /// Whether it has done what a command says.
    pub fn meets(&self, command: &Command) -> bool {
        let speed_mps = command.speed_mps.filter(|_| !command.pursues());
        // Who stands as told moves no farther to the side.
        let stands = self.moves != Moves::Walks && speed_mps == Some(0.0) && self.speed_mps == 0.0;
        !command.is_continuous
            && speed_mps.is_none_or(|mps| self.is_over || self.has_speed(mps))
            && (self.has_met || !command.pursues())
            && (self.is_aside || stands || !command.goes_aside())
            && (self.has_turned || command.turn.is_none())
    }

    /// Whether it has the speed that a phase wants, m/s. A stop is exact, and who follows a trajectory comes to every speed exactly.
    fn has_speed(&self, wanted_mps: f64) -> bool {
        let is_exact = wanted_mps == 0.0 || self.moves == Moves::Follows;
        let near_mps = SPEED_REACHED_MPS.max(SPEED_REACHED_PART * wanted_mps.abs());
        self.speed_mps == wanted_mps || !is_exact && (self.speed_mps - wanted_mps).abs() < near_mps
    }
}

/// What a tick does to a manoeuvre.
pub(super) struct Advance {
    /// What is left of it.
    pub rest: Option<Running>,
    /// What a phase tells the driver that begins now.
    pub command: Option<Command>,
    /// How many phases have begun, and ended. One that is left out has done both.
    pub begun: u32,
    pub ended: u32,
    /// Whether what is left is another manoeuvre.
    pub hands_over: bool,
}

impl Running {
    pub fn new(course: Arc<Course>, tick: u64) -> Running {
        Running { course, phase: 0, stage: Stage::Waiting(None), since: tick, tracked: None }
    }

    /// The phase that is under way: its manoeuvre, by its index in the space, its number from 1, and the tick in which it
    /// began.
    pub fn under_way(&self) -> Option<(usize, u32, u64)> {
        let is_under_way = matches!(self.stage, Stage::UnderWay(_));
        is_under_way.then_some((self.course.manoeuvre, self.phase as u32 + 1, self.since))
    }

    /// How many phases it has.
    pub fn phases(&self) -> u32 {
        self.course.phases() as u32
    }

    /// What the continuous speed of a phase tells now, at the rate with which that began; `None` if there is none, or it has no value
    /// now.
    pub fn tracked(&self, moment: &LaterMoment, moves: Moves) -> Option<Command> {
        let Tracked { course, phase, first } = self.tracked.as_ref()?;
        let speed_mps = Some(course.speed_mps(*phase, moment)?);
        let now = Command { speed_mps, rate_mps2: first.rate_mps2, ..Command::default() };
        Some(now.for_who(moves))
    }

    /// The names of road users that its phases ask about.
    pub fn bearers(&self) -> Vec<usize> {
        let tracked = self.tracked.iter().filter(|tracked| !Arc::ptr_eq(&tracked.course, &self.course));
        self.course
            .bearers()
            .into_iter()
            .chain(tracked.flat_map(|tracked| tracked.course.bearers()))
            .collect()
    }

    /// Advances by one tick. `progress`: how far the road user is with what it was told.
    pub fn advance(mut self, moment: &LaterMoment, progress: Progress, tick: u64) -> Advance {
        let (mut begun, mut ended) = (0, 0);
        let stays = |rest, command, begun, ended| Advance { rest, command, begun, ended, hands_over: false };
        loop {
            match self.stage {
                Stage::Waiting(held) => {
                    let held = self.course.has_come(self.phase, moment).then(|| held.unwrap_or(tick));
                    let is_long = |since: u64| tick - since >= ticks(self.course.held_s(self.phase, moment));
                    if held.is_some_and(is_long) {
                        let holds = ticks(self.course.after_s(self.phase, moment));
                        (self.stage, self.since) = (Stage::Holding(tick.saturating_add(holds)), tick);
                        continue;
                    }
                    self.stage = Stage::Waiting(held);
                    let waited_s = (tick - self.since) as f64 * DT_S;
                    let is_over =
                        self.course.within_s(self.phase, moment).is_some_and(|most_s| waited_s >= most_s);
                    let rest = if is_over { self.over() } else { Some(self) };
                    return stays(rest, None, begun, ended);
                }
                Stage::Holding(until) if tick >= until && self.course.may_begin(moment) => {
                    if !self.course.comes(self.phase, moment) {
                        begun += 1;
                        ended += 1;
                        if !self.goes_on(tick) {
                            return stays(self.over(), None, begun, ended);
                        }
                        continue;
                    }
                    let Some(command) = self.course.command(self.phase, moment) else {
                        return stays(self.over(), None, begun, ended);
                    };
                    begun += 1;
                    let command = command.for_who(progress.moves);
                    if command.speed_mps.is_some() || command.pursues() {
                        let course = Arc::clone(&self.course);
                        let tracked = Tracked { course, phase: self.phase, first: command };
                        self.tracked = command.is_continuous.then_some(tracked);
                    }
                    if let Some(next) = self.course.next(self.phase, moment) {
                        let rest = Running { tracked: self.tracked, ..Running::new(Arc::new(next), tick) };
                        let (rest, command) = (Some(rest), Some(command));
                        return Advance { hands_over: true, ..stays(rest, command, begun, ended + 1) };
                    }
                    (self.stage, self.since) = (Stage::UnderWay(command), tick);
                    return stays(Some(self), Some(command), begun, ended);
                }
                Stage::UnderWay(command)
                    if tick > self.since && (progress.meets(&command) || self.next_has_come(moment)) =>
                {
                    ended += 1;
                    if !self.goes_on(tick) {
                        return stays(self.over(), None, begun, ended);
                    }
                }
                Stage::Over | Stage::Holding(_) | Stage::UnderWay(_) => {
                    return stays(Some(self), None, begun, ended);
                }
            }
        }
    }

    /// What is left when no phase is: a speed that is tracked.
    fn over(self) -> Option<Running> {
        self.tracked.is_some().then_some(Running { stage: Stage::Over, ..self })
    }

    /// Goes on to the next phase, if there is one.
    fn goes_on(&mut self, tick: u64) -> bool {
        self.phase += 1;
        (self.stage, self.since) = (Stage::Waiting(None), tick);
        self.phase < self.course.phases()
    }

    /// Whether what the next phase waits for has come: it does not wait for the end of this one.
    fn next_has_come(&self, moment: &LaterMoment) -> bool {
        self.phase + 1 < self.course.phases()
            && self.course.waits(self.phase + 1)
            && self.course.has_come(self.phase + 1, moment)
    }

    fn trace(&self, trace: &mut Trace) {
        let Running { course, phase, stage, since, tracked } = self;
        trace.words([course.part as u64, *phase as u64, *since, course.arguments().count() as u64]);
        trace.words(course.arguments());
        match *stage {
            Stage::Waiting(held) => trace.words([0, held.map_or(0, |tick| tick + 1)]),
            Stage::Holding(until) => trace.words([1, until]),
            Stage::UnderWay(command) => {
                trace.word(2);
                trace_command(&command, trace);
            }
            Stage::Over => trace.word(3),
        }
        trace.flags([tracked.is_some()]);
        if let Some(Tracked { course, phase, first }) = tracked {
            trace.words([course.part as u64, *phase as u64, course.arguments().count() as u64]);
            trace.words(course.arguments());
            trace_command(first, trace);
        }
    }
}

/// What was told, as far as it is still asked.
fn trace_command(command: &Command, trace: &mut Trace) {
    let Command {
        speed_mps,
        rate_mps2,
        turn,
        // Whether one of them is said is asked below; how, was handed over to the driver as it was told.
        lane: _,
        offset_m: _,
        keep_m: _,
        keep_s: _,
        early_s: _,
        // These were handed over as they were told.
        is_continuous: _,
        aside_mps: _,
        aside_s: _,
        time_gap_s: _,
        to: _,
        at_m: _,
        reach_m: _,
        steady_m: _,
        ignores: _,
        siren: _,
        lights: _,
    } = command;
    trace.flags([
        speed_mps.is_some(),
        rate_mps2.is_some(),
        turn.is_some(),
        command.goes_aside(),
        command.pursues(),
    ]);
    trace.numbers(speed_mps.iter().chain(rate_mps2).copied());
}

#[derive(Debug, Clone)]
pub(super) enum Motion {
    Drive(Driver),
    Walk(Walker),
    Stroll(Stroller),
    Guide(Guided),
    Stand,
}

impl Motion {
    /// How far it is with what it was told; `None` for who only stands.
    pub fn progress(&self, around: &Around) -> Option<Progress> {
        let on_foot = |speed_mps, is_aside, is_over| Progress {
            speed_mps,
            is_aside,
            has_turned: true,
            has_met: true,
            moves: Moves::Walks,
            is_over,
        };
        match self {
            Motion::Drive(driver) => {
                let (is_aside, has_turned) = (driver.is_aside_as_told(), driver.has_turned());
                let (speed_mps, has_met) = (driver.speed_mps, driver.has_met());
                Some(Progress {
                    speed_mps,
                    is_aside,
                    has_turned,
                    has_met,
                    moves: Moves::Drives,
                    is_over: false,
                })
            }
            Motion::Walk(walker) => {
                let (speed_mps, is_over) = (walker.pace_mps(), walker.is_over());
                Some(on_foot(speed_mps, true, is_over))
            }
            Motion::Stroll(stroller) => {
                let (speed_mps, is_aside) = (stroller.pace_mps(), stroller.is_aside());
                let is_over = stroller.is_over(around);
                Some(on_foot(speed_mps, is_aside, is_over))
            }
            Motion::Guide(guided) => Some(Progress {
                speed_mps: guided.speed_mps,
                is_aside: guided.is_aside(),
                has_turned: true,
                has_met: guided.has_met(),
                moves: Moves::Follows,
                is_over: guided.is_over(),
            }),
            Motion::Stand => None,
        }
    }

    /// From now on it does what it is told, as soon as it can. `to` is the id of the road user to whom the command says to keep
    /// a gap, if it names one.
    pub fn order(&mut self, command: &Command, to: Option<u32>, tick: u64) {
        match self {
            Motion::Drive(driver) => driver.order(command, to),
            Motion::Walk(walker) => {
                command.speed_mps.iter().for_each(|speed_mps| walker.order(*speed_mps, tick));
            }
            Motion::Stroll(stroller) => stroller.order(command),
            Motion::Guide(guided) => guided.order(command),
            Motion::Stand => {}
        }
    }
}

/// Where a road user is after a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moved {
    /// Centre of the outline.
    pub pose: Pose,
    /// Unit vector along its heading.
    pub forward: Vec2,
    /// Heading of the lane that it drives in; a pedestrian's own heading.
    pub lane_heading_rad: f64,
    pub velocity_mps: Vec2,
}

impl RoadUser {
    /// A newcomer where `moved` says.
    pub fn new(
        around: &Around,
        id: u32,
        body: Body,
        colour: Colour,
        verb: Verb,
        mover: Mover,
        moved: Moved,
    ) -> RoadUser {
        let outline = OrientedBox::new(moved.pose, mover.size.length_m, mover.size.width_m);
        let obstacle = Obstacle {
            id,
            body,
            colour,
            verb,
            outline,
            forward: moved.forward,
            height_m: mover.size.height_m,
            lane_heading_rad: moved.lane_heading_rad,
            velocity_mps: moved.velocity_mps,
            acceleration_mps2: 0.0,
            elevation_m: mover.elevation_m().unwrap_or_else(|| {
                let route = &around.scene.route;
                let beside = route.path.project_near(moved.pose.position, around.ego_station_m, ON_FOOT_M);
                route.height_at(&around.scene.map, beside.station_m)
            }),
            is_apart: false,
            distance_m: distance_m(around.ego_outline, &outline),
            spawned_tick: around.tick,
            lights: ShownLights::Off,
        };
        let mut newcomer = RoadUser { obstacle, mover };
        newcomer.obstacle.is_apart = around.is_apart_from_ego(&newcomer);
        newcomer
    }

    /// Whether every other road user, the ego vehicle included, is at least `room_m` away.
    pub fn has_room(&self, around: &Around, room_m: f64) -> bool {
        self.who_is_there(around, room_m).is_none()
    }

    /// The first one that leaves it no such room; the ego vehicle before all others.
    pub fn who_is_there<'a>(&self, around: &'a Around, room_m: f64) -> Option<Other<'a>> {
        let this = &self.obstacle;
        around.others().find(|other| {
            distance_m(&this.outline, other.outline) < room_m
                && !is_apart(this.elevation_m, other.elevation_m)
        })
    }

    /// Every bit that later ticks depend on.
    pub fn trace(&self, trace: &mut Trace) {
        let RoadUser { obstacle, mover } = self;
        let Obstacle {
            id,
            body,
            colour,
            verb,
            outline,
            velocity_mps,
            spawned_tick,
            lights,
            // These follow from the body, the outline, the way and the ego vehicle, now and in the ticks before.
            forward: _,
            height_m: _,
            lane_heading_rad: _,
            acceleration_mps2: _,
            elevation_m: _,
            is_apart: _,
            distance_m: _,
        } = obstacle;
        trace.words([
            u64::from(*id),
            *spawned_tick,
            *body as u64,
            *colour as u64,
            *verb as u64,
            *lights as u64,
        ]);
        let pose = &outline.pose;
        trace.numbers([pose.position.x, pose.position.y, pose.heading_rad]);
        trace.numbers([velocity_mps.x, velocity_mps.y]);
        mover.trace(trace);
    }
}

impl Mover {
    pub fn new(size: BodyParameters, motion: Motion) -> Mover {
        Mover {
            size,
            motion,
            touched: false,
            crashed_with: None,
            rest_ticks: 0,
            visible_fraction: 1.0,
            rights: Rights::default(),
            bearer: None,
            course: None,
            phases: PhaseCount::default(),
        }
    }

    /// Height of the road on its way, m; `None` for what has no way.
    pub fn elevation_m(&self) -> Option<f64> {
        match &self.motion {
            Motion::Drive(driver) => Some(driver.way.height_at(driver.station_m)),
            Motion::Stroll(stroller) => Some(stroller.height_m()),
            Motion::Guide(guided) => Some(guided.height_m()),
            Motion::Walk(_) | Motion::Stand => None,
        }
    }

    /// Whether it does nothing any more but come to rest.
    pub fn is_wreck(&self) -> bool {
        self.touched || self.crashed_with.is_some()
    }

    /// By how much it missed the moment of its last `early`, s; below 0 if it was too soon. `None` before that.
    pub fn late_s(&self) -> Option<f64> {
        match &self.motion {
            Motion::Drive(driver) => driver.late_s,
            Motion::Guide(guided) => guided.late_s.filter(|_| guided.has_met()),
            Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => None,
        }
    }

    /// Whether it is an emergency vehicle under way.
    pub fn has_siren(&self) -> bool {
        matches!(&self.motion, Motion::Drive(driver) if driver.has_siren)
    }

    /// Whether it drives a lane change; `None` of what no driver leads along lanes.
    pub fn changes_lanes(&self) -> Option<bool> {
        match &self.motion {
            Motion::Drive(driver) => Some(driver.is_changing_lanes()),
            Motion::Guide(_) | Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => None,
        }
    }

    /// Whether it drives, and ignores a rule of the road.
    pub fn ignores(&self, rule: TrafficRule) -> bool {
        matches!(&self.motion, Motion::Drive(driver) if driver.ignores.contains(rule))
    }

    /// Whether it drives without lights.
    pub fn is_unlit(&self) -> bool {
        self.ignores(TrafficRule::Headlights)
    }

    /// Whether it has crashed into another obstacle, or another into it.
    pub fn has_crashed(&self) -> bool {
        self.crashed_with.is_some()
    }

    /// Whether it stands and will not go by itself: a wreck, a driver that has given up waiting, or one that was asked to
    /// stand.
    pub fn is_stuck(&self, this: &Obstacle) -> bool {
        match &self.motion {
            _ if self.is_wreck() => this.velocity_mps == Vec2::zeros(),
            // One that stands within a manoeuvre may go on by itself.
            Motion::Drive(driver) => driver.has_given_up() || self.course.is_none() && driver.is_parked(),
            Motion::Guide(guided) => self.course.is_none() && guided.speed_mps == 0.0,
            Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => false,
        }
    }

    /// One tick of the obstacle `this`; `None` if it leaves the world.
    pub fn step(&mut self, this: &Obstacle, around: &Around) -> Option<Moved> {
        let in_sight = around.is_in_sight(this, self.visible_fraction);
        if self.is_wreck() && this.velocity_mps == Vec2::zeros() {
            self.rest_ticks = self.rest_ticks.saturating_add(1);
            if f64::from(self.rest_ticks) * DT_S >= WRECK_S && !in_sight {
                return None;
            }
        }
        let rest = Moved::at_rest(this);
        match &mut self.motion {
            _ if self.crashed_with.is_some() => Some(slide(this, around)),
            Motion::Drive(driver) => {
                let (way, before_m) = (Arc::as_ptr(&driver.way), driver.station_m);
                let moved = driver.step(&View { this, size: &self.size, around }, self.touched, in_sight);
                if way == Arc::as_ptr(&driver.way) {
                    let front_m = this.outline.half_length_m;
                    let (from_m, to_m) = (before_m + front_m, driver.station_m + front_m);
                    let stops = driver.way.stop_signs_m.iter();
                    let stops = stops.map(|at_m| (*at_m, driver.way.lane_at(*at_m).0));
                    let lights = &driver.way.stop_lines;
                    self.rights.passed.pass(lights, stops, (from_m, to_m), driver.speed_mps, around);
                }
                moved
            }
            Motion::Walk(_) | Motion::Stroll(_) if self.touched => Some(rest),
            // Who has still something to do does not leave.
            Motion::Walk(walker) => walker.step(this, in_sight || self.course.is_some(), around),
            Motion::Stroll(stroller) => stroller.step(this, in_sight || self.course.is_some(), around),
            Motion::Guide(guided) => {
                let moved = guided.step(this, &self.size, self.touched, around);
                self.rights.passed.pass_freely(this, &moved, around);
                Some(moved)
            }
            Motion::Stand => Some(rest),
        }
    }

    /// The area that it sweeps within a tick.
    pub fn sweep(&self, mut start: OrientedBox, end: Pose) -> Sweep {
        let on_foot = match &self.motion {
            Motion::Walk(_) | Motion::Stroll(_) => true,
            Motion::Guide(guided) => guided.turns_on_the_spot(),
            Motion::Drive(_) | Motion::Stand => false,
        };
        if on_foot {
            // A person turns round on the spot, so the corners of its box must not sweep half a circle within a tick.
            start.pose.heading_rad = end.heading_rad;
        }
        Sweep { start, end }
    }

    /// It touched the ego vehicle: from now on it goes at most `speed_mps`, until its brakes stop it.
    pub fn touch(&mut self, speed_mps: f64) {
        self.touched = true;
        if let Motion::Drive(driver) = &mut self.motion {
            driver.speed_mps = speed_mps;
        }
    }

    /// It and another obstacle touched: from now on it slides to rest. Returns the obstacle that it had
    /// touched last.
    pub fn crash(&mut self, other: u32) -> Option<u32> {
        if let Motion::Drive(driver) = &mut self.motion {
            driver.speed_mps = 0.0;
        }
        self.crashed_with.replace(other)
    }

    fn trace(&self, trace: &mut Trace) {
        let Mover {
            motion,
            touched,
            crashed_with,
            rest_ticks,
            visible_fraction,
            rights,
            bearer,
            course,
            // No tick changes it.
            size: _,
            // No tick reads it.
            phases: _,
        } = self;
        // Which name and which manoeuvre is left out: they are numbered as the space declares them, and what is declared beside
        // them changes no episode.
        trace.flags([*touched, crashed_with.is_some(), bearer.is_some(), course.is_some()]);
        trace.words(crashed_with.iter().chain([rest_ticks]).copied().map(u64::from));
        trace.number(*visible_fraction);
        if let Some(running) = course {
            running.trace(trace);
        }
        rights.trace(trace);
        match motion {
            Motion::Drive(driver) => driver.trace(trace),
            Motion::Walk(walker) => walker.trace(trace),
            Motion::Stroll(stroller) => stroller.trace(trace),
            Motion::Guide(guided) => guided.trace(trace),
            Motion::Stand => {}
        }
    }
}

/// A tick with wheels locked: straight on, without turning, slowed by the friction of the road.
fn slide(this: &Obstacle, around: &Around) -> Moved {
    let speed_mps = this.velocity_mps.norm();
    let rest = Moved::at_rest(this);
    if speed_mps == 0.0 {
        return rest;
    }
    let lost_mps = around.grip.friction(speed_mps) * GRAVITY_MPS2 * DT_S;
    let velocity_mps = this.velocity_mps * (1.0 - lost_mps / speed_mps).max(0.0);
    let position = rest.pose.position + (this.velocity_mps + velocity_mps) / 2.0 * DT_S;
    Moved { pose: Pose { position, ..rest.pose }, velocity_mps, ..rest }
}

impl Moved {
    /// Standing where it was.
    pub fn at_rest(this: &Obstacle) -> Moved {
        Moved {
            pose: this.outline.pose,
            forward: this.forward,
            lane_heading_rad: this.lane_heading_rad,
            velocity_mps: Vec2::zeros(),
        }
    }
}
