//! The actions of all entities, phase by phase.

use avastra_lang::model::SPAWN_SPEED_MPS;
use avastra_road::LanePlace;

use super::across::aside_fields;
use super::action::{Act, ActKind, Aside, Way};
use super::cast::{Cast, Leg, Moving, too_fast};
use super::condition::Waiting;
use super::order::{Sequence, is_aside, is_speed};
use super::pace::{self, PACE};
use super::said::Said;
use super::source::{Mark, Source};
use super::story::Event;
use super::trigger::{Condition, Edge, When};

/// A distance that is to be reached is, this near to it, m, as for esmini.
const KEPT_M: f64 = 0.1;

/// An entity that is so near to the end of its way has reached it, m.
pub const ARRIVES_M: f64 = 0.05;

const TIMES_LATER: &str =
    "it moves, and its trajectory has times only from later on: where it is until then is not known";

/// Times of a trajectory that differ by less count as the same, s. Ours.
const SAME_TIME_S: f64 = 0.05;

const TIMES_OF_NO_BEGINNING: &str = "its times count from the beginning of the scenario, and when it begins is not known: `relative` ones are read";

const BESIDE_TIMES: &str =
    "beside the times of a trajectory or of a profile only what waits for their end is read";

/// A speed that is asked anew at every tick.
pub const CONTINUOUS: &str = "continuous: true";

/// The state of an entity after its orders so far.
pub struct Told {
    /// Its speed, if the file says it.
    pub mps: Option<f64>,
    pub offset_m: f64,
    /// Where on its way it is told the next thing, m: behind its last trajectory.
    pub at_m: f64,
    pub lane: Option<LanePlace>,
    /// How far the middle of that lane is to the left of its way, m.
    pub lane_m: f64,
    /// A phase that begins when the one is done that tells it.
    pub then: Option<Said>,
}

/// The phases of an entity, as far as they are written.
struct Script<'c, 'a, 'e> {
    cast: &'c Cast<'a>,
    moving: &'c Moving<'a>,
    sequence: Sequence<'e>,
    told: Told,
    phases: Vec<Said>,
    /// The actions of the last phases, if they take a while: what may follow.
    takes: Option<Takes>,
    /// When that ends, s, if its times say so.
    ends_s: Option<f64>,
}

impl<'c, 'a, 'e> Script<'c, 'a, 'e> {
    fn new(cast: &'c Cast<'a>, moving: &'c Moving<'a>, sequence: Sequence<'e>) -> Script<'c, 'a, 'e> {
        let lane = moving.placed.lane;
        let told = Told {
            mps: Some(moving.mps),
            offset_m: moving.offset_m,
            at_m: moving.at_m,
            lane,
            lane_m: lane.map_or(0.0, |lane| cast.aside_m(moving, moving.at_m, lane)),
            then: None,
        };
        Script { cast, moving, sequence, told, phases: Vec::new(), takes: None, ends_s: None }
    }

    /// The times of the trajectory on which it begins.
    fn on_its_way(&mut self, source: &mut Source) -> Option<()> {
        let (cast, moving) = (self.cast, self.moving);
        let Some(way) = &moving.entity.way else { return Some(()) };
        let leg = moving.leg(way)?;
        if way.timing.is_some() {
            let (timed, then) = self.timed(source, &way.shape.mark, leg, Said::default(), Some(0.0), true)?;
            self.phases.extend(timed);
            self.takes = Some(Takes { then: vec![then], is_cut_short: false });
        }
        cast.told_at_the_end(moving, leg, &mut self.told);
        Some(())
    }

    /// The words before the phase of an event, behind the phases that wait for what it waits for. `before` are the events of the
    /// moment before it.
    fn begins(&mut self, source: &mut Source, event: &Event, before: &[&Event]) -> Option<Said> {
        let rises = |one: &Condition| matches!(one.edge, Edge::None | Edge::Rising);
        let is_first = matches!(event.when.as_slice(), [all] if all.len() == 1 && all.iter().all(rises))
            && before.iter().all(|event| event.when.is_empty());
        let waiting = Waiting { cast: self.cast, actor: self.moving, before: before.to_vec(), is_first };
        let begins = waiting.begins(source, &event.when)?;
        let is_endless = self.phases.last().is_some_and(|phase| phase.holds(CONTINUOUS));
        let waits = begins.once.is_some() && !begins.is_after;
        let never = "what comes after a speed or a distance that is kept waits for the end of that, which never comes";
        source.refuse_if(is_endless && !waits, &event.mark, never)?;
        if let Some(Takes { then, is_cut_short }) = self.takes.take() {
            let waits = match is_cut_short {
                true => waiting.waits_for_a_way(&event.when),
                false => waiting.waits_for_the_end(&event.when),
            };
            source.refuse_if(!waits && !is_cut_short, &event.mark, BESIDE_TIMES)?;
            if waits {
                let then = then.into_iter().filter(|then| !then.0.is_empty());
                self.phases.extend(then.map(|then| then.and("{}")));
            }
        }
        if begins.is_after {
            self.phases.push(Said::text("after 0 s {}"));
        }
        let first = begins.first.as_ref();
        self.phases.extend(first.map(|first| Said::text("once ").then(first.clone()).and(" {}")));
        Some(begins.said())
    }

    /// The phases of what begins at one moment, which `begins` says.
    fn together(
        &mut self,
        source: &mut Source,
        event: Option<&Event>,
        begins: Said,
        acts: &[&Act],
    ) -> Option<()> {
        let mut fields = match event {
            Some(event) => self.ended(source, event)?,
            None => Vec::new(),
        };
        go_together(source, acts, &self.told)?;
        let begins_s = event.map_or(Some(0.0), |event| event.time_s().or_else(|| self.after_s(event)));
        self.ends_s = None;
        let mut timed = Vec::new();
        let mut takes: Option<Takes> = None;
        for act in acts {
            match &act.kind {
                ActKind::Keep(kept) if !kept.is_continuous => {
                    let (_, too_far) = self.cast.too_far(source, self.moving, &act.mark, kept)?;
                    let near = Said::text("once ").then(too_far.clone()).and(" <= ").number(KEPT_M, "m");
                    let near = near.and(" and ").then(too_far).and(" >= ").number(-KEPT_M, "m");
                    self.cast.fields(source, self.moving, act, &mut self.told, &mut fields)?;
                    self.told.then = Some(near.and(" { speed: npc.speed }"));
                }
                ActKind::Follow(way) => {
                    let then = self.follow(source, act, way, (&begins, begins_s), &mut timed)?;
                    Takes::add(&mut takes, then, way.timing.is_none());
                }
                ActKind::Profile(entries) => {
                    let reason = "its trajectory has times, which say the speed already";
                    let has_times = self.moving.legs.iter().any(|leg| !leg.timed.is_empty());
                    source.refuse_if(has_times, &act.mark, reason)?;
                    let then;
                    (timed, then) = pace::profile(source, &act.mark, self.told.mps, entries, begins.clone())?;
                    Takes::add(&mut takes, then, false);
                    self.told.mps = entries.last().map(|entry| entry.mps);
                }
                _ => self.cast.fields(source, self.moving, act, &mut self.told, &mut fields)?,
            }
        }
        self.takes = takes.or(self.takes.take());
        if timed.is_empty() {
            // A phase that waits for nothing and tells nothing is none.
            if !(begins.0.is_empty() && fields.is_empty()) {
                self.phases.push(begins.and("{ ").then(Said::joined(fields, ", ")).and(" }"));
            }
            self.phases.extend(self.told.then.take());
        } else if fields.is_empty() {
            self.phases.extend(timed);
        } else {
            let mark = event.map_or(&self.moving.entity.mark, |event| &event.mark);
            return source.refuse(mark, BESIDE_TIMES);
        }
        Some(())
    }

    /// The fields that end what goes on when an event and those with it begin.
    fn ended(&mut self, source: &mut Source, event: &Event) -> Option<Vec<Said>> {
        let mut fields = Vec::new();
        for event in self.sequence.with(event) {
            let ended = self.sequence.ends_what_goes_on(source, event)?;
            if fields.is_empty() {
                fields.extend(ended);
            }
            self.sequence.waits_for_known_ends(source, event)?;
            if self.sequence.changes_speed_at(event) {
                self.told.mps = None;
            }
        }
        Some(fields)
    }

    /// Begins to follow a trajectory: its phases if it has times, and the words before a phase that waits for its end.
    fn follow(
        &mut self,
        source: &mut Source,
        act: &Act,
        way: &Way,
        (begins, begins_s): (&Said, Option<f64>),
        timed: &mut Vec<Said>,
    ) -> Option<Said> {
        let (cast, moving) = (self.cast, self.moving);
        let leg = moving.leg(way)?;
        let is_beside = (self.told.offset_m - moving.offset_m).abs() > 0.01;
        source.refuse_if(is_beside, &act.mark, "it is beside its way when its trajectory begins")?;
        // Without times it goes on with the speed that it has, which is 0 where nothing tells it more.
        let stands = self.told.mps == Some(0.0) && way.shape.drops_times;
        let reason = "its times are not read, and it stands: `Polyline` is read with times";
        source.refuse_if(stands, &act.mark, reason)?;
        let then = if way.timing.is_some() {
            let then;
            (*timed, then) =
                self.timed(source, &way.shape.mark, leg, begins.clone(), begins_s, way.is_absolute)?;
            then
        } else {
            arrives(leg.end_m)
        };
        cast.told_at_the_end(moving, leg, &mut self.told);
        Some(then)
    }

    /// When an event comes that waits for the end of what has times, s.
    fn after_s(&self, event: &Event) -> Option<f64> {
        match event.when.as_slice() {
            [all] => match all.as_slice() {
                [Condition { kind: When::Ended { .. }, delay_s, .. }] => Some(self.ends_s? + delay_s),
                _ => None,
            },
            _ => None,
        }
    }

    /// The phases of one that is at the places of a trajectory at its times, and the words before a phase that waits for the end.
    /// `begins_s`: when the trajectory begins, if that is known.
    fn timed(
        &mut self,
        source: &mut Source,
        mark: &Mark,
        leg: &Leg,
        begins: Said,
        begins_s: Option<f64>,
        is_absolute: bool,
    ) -> Option<(Vec<Said>, Said)> {
        let (moving, places) = (self.moving, &leg.timed);
        let mut phases = Vec::new();
        let (Some((_, first_s)), Some((last_m, last_s))) = (places.first(), places.last()) else {
            return Some((phases, Said::default()));
        };
        // How long it waits at its first place.
        let wait_s = match begins_s {
            _ if !is_absolute => *first_s,
            Some(begins_s) => first_s - begins_s,
            None => return source.refuse(mark, TIMES_OF_NO_BEGINNING),
        };
        let reason = format!(
            "its times begin {:.2} s before it does: where on its way it begins is not read",
            -wait_s
        );
        source.refuse_if(wait_s < -SAME_TIME_S, mark, reason)?;
        source.refuse_if(wait_s > SAME_TIME_S && self.told.mps != Some(0.0), mark, TIMES_LATER)?;
        let mut begins = begins;
        if wait_s > 0.0 {
            begins = match is_absolute {
                true => Said::text("once elapsed >= ").number(*first_s, "s").and(" "),
                false => begins.and("after ").number(*first_s, "s").and(" "),
            };
        }
        let mut is_wait = false;
        for pair in places.windows(2) {
            let ((from_m, from_s), (to_m, to_s)) = (pair[0], pair[1]);
            let (way_m, time_s) = (to_m - from_m, to_s - from_s);
            let reason = "a later place of its trajectory has no later time";
            source.refuse_if(time_s < 0.0 || time_s == 0.0 && way_m > 0.0, mark, reason)?;
            if time_s == 0.0 {
                continue;
            }
            let said = core::mem::take(&mut begins);
            let said = match (phases.is_empty(), is_wait) {
                (true, _) | (false, true) => said,
                (false, false) => {
                    Said::text("once npc.station >= ").number(from_m + moving.more_m(), "m").and(" ")
                }
            };
            let mps = way_m / time_s;
            source.refuse_if(mps > *SPAWN_SPEED_MPS.end(), &moving.entity.mark, too_fast(mps))?;
            phases.push(said.and("{ speed: ").number(mps, "m/s").and(" }"));
            self.told.mps = Some(mps);
            is_wait = way_m < 1e-6;
            if is_wait {
                begins = Said::text("after ").number(time_s, "s").and(" ");
            }
        }
        self.ends_s = begins_s.map(|begins_s| if is_absolute { *last_s } else { begins_s + last_s });
        Some((phases, if is_wait { begins } else { arrives(last_m + moving.more_m()) }))
    }
}

impl<'a> Cast<'a> {
    /// The phases of an entity.
    pub fn phases(&self, source: &mut Source, moving: &Moving<'a>) -> Option<Vec<Said>> {
        let entity = moving.entity;
        let is_placed = |act: &Act| matches!(act.kind, ActKind::Ahead(..));
        let mut events: Vec<&Event> = entity.events.iter().filter(|event| !event.acts.is_empty()).collect();
        events.retain(|event| !(event.when.is_empty() && event.acts.iter().all(is_placed)));
        if events.iter().all(|event| event.time_s().is_some()) {
            events.sort_by(|a, b| a.time_s().unwrap_or(0.0).total_cmp(&b.time_s().unwrap_or(0.0)));
        }
        let sequence = self.in_sequence(source, moving, &events)?;
        let mut script = Script::new(self, moving, sequence);
        script.on_its_way(source)?;
        let (at_once, later): (Vec<&Event>, Vec<&Event>) =
            events.into_iter().partition(|event| event.when.is_empty());
        let first = at_once.iter().flat_map(|event| &event.acts).filter(|act| !is_placed(act)).collect();
        // An event that only placed the entity counts, too; it took no time.
        let mut before: Vec<&Event> = entity.events.iter().filter(|event| event.when.is_empty()).collect();
        for (event, acts) in by_moment(first, later) {
            let begins = match event {
                None => {
                    source.refuse_if(script.takes.is_some(), &entity.mark, BESIDE_TIMES)?;
                    Said::default()
                }
                Some(event) => {
                    let begins = script.begins(source, event, &before)?;
                    before = entity.events.iter().filter(|other| same_moment(other, event)).collect();
                    begins
                }
            };
            script.together(source, event, begins, &acts)?;
        }
        Some(script.phases)
    }

    /// Sets the state of an entity to the end of a trajectory, where its next orders begin.
    fn told_at_the_end(&self, moving: &Moving<'a>, leg: &Leg, told: &mut Told) {
        (told.at_m, told.lane, told.offset_m) = (leg.end_m, leg.lane, 0.0);
        told.lane_m = leg.lane.map_or(0.0, |lane| self.aside_m(moving, told.at_m, lane));
    }

    /// The fields of an order that an action is.
    fn fields(
        &self,
        source: &mut Source,
        moving: &Moving<'a>,
        act: &Act,
        told: &mut Told,
        fields: &mut Vec<Said>,
    ) -> Option<()> {
        let mark = &act.mark;
        match &act.kind {
            // It may be tilted there, which is not taken over.
            ActKind::Placed(position) if position.is_own_place(&moving.entity.name) => Some(()),
            ActKind::Placed(_) | ActKind::Ahead(..) => {
                source.refuse(mark, "a road user cannot be moved to another place during the story")
            }
            ActKind::Keep(kept) => {
                let said = self.kept(source, moving, mark, kept)?;
                (told.mps, told.then) = (None, None);
                instead_of(fields, &PACE);
                fields.extend(said);
                Some(())
            }
            ActKind::Route(_) => source.refuse(mark, "a route is taken from the beginning"),
            // Those of `phases`.
            ActKind::Follow(_) | ActKind::Profile(_) => Some(()),
            ActKind::Speed(wanted, dynamics) => {
                self.speed_fields(source, moving, mark, wanted, *dynamics, told, fields)
            }
            ActKind::Lane(target, more_m, dynamics) => {
                let lane_m = self.lane_offset_m(source, moving, mark, target, told)?;
                let to_m = lane_m + self.left_m(moving, told, *more_m);
                let to = Said::default().number(to_m, "m");
                aside_fields(source, mark, to_m, to, *dynamics, told, fields)
            }
            ActKind::Offset(Aside::InLane(offset_m), dynamics) => {
                let reason = "its way leads over roads of which some run the other way, and to which side of them it is to be is not known";
                let are_alike = self.are_lanes_alike(moving, told, |lane| lane.is_along());
                source.refuse_if(!are_alike, mark, reason)?;
                let to_m = told.lane_m + self.left_m(moving, told, *offset_m);
                let to = Said::default().number(to_m, "m");
                aside_fields(source, mark, to_m, to, *dynamics, told, fields)
            }
            ActKind::Offset(Aside::Of(name, more_m), dynamics) => {
                let (to_m, to) = self.beside(source, moving, mark, name, *more_m, told)?;
                aside_fields(source, mark, to_m, to, *dynamics, told, fields)
            }
            ActKind::Meet(meeting) => self.meeting_fields(source, moving, mark, meeting, told, fields),
        }
    }
}

/// Actions that take a while.
struct Takes {
    /// The words before phases that wait for the end of each part of it.
    then: Vec<Said>,
    /// Whether something else may begin before that.
    is_cut_short: bool,
}

impl Takes {
    /// With something that begins at the same moment.
    fn add(takes: &mut Option<Takes>, then: Said, is_cut_short: bool) {
        let known = takes.get_or_insert(Takes { then: Vec::new(), is_cut_short });
        known.then.push(then);
        known.is_cut_short &= is_cut_short;
    }
}

/// Before a phase that waits until a station has been reached.
fn arrives(station_m: f64) -> Said {
    Said::text("once npc.station >= ").number(station_m - ARRIVES_M, "m").and(" ")
}

/// If two actions begin together, the later one counts.
pub fn instead_of(fields: &mut Vec<Said>, names: &[&str]) {
    fields.retain(|field| !names.contains(&field.name().as_str()));
}

/// The actions from the start, and then those of each moment: one phase each, with the first of its events.
fn by_moment<'e>(first: Vec<&'e Act>, later: Vec<&'e Event>) -> Vec<(Option<&'e Event>, Vec<&'e Act>)> {
    let mut groups: Vec<(Option<&Event>, Vec<&Act>)> = Vec::new();
    if !first.is_empty() {
        groups.push((None, first));
    }
    for event in later {
        let is_same =
            |(last, _): &&mut (Option<&Event>, Vec<&Act>)| last.is_some_and(|last| same_moment(last, event));
        match groups.last_mut().filter(is_same) {
            Some((_, acts)) => acts.extend(&event.acts),
            None => groups.push((Some(event), event.acts.iter().collect())),
        }
    }
    groups
}

/// Refuses what begins at one moment and cannot be said in one phase.
fn go_together(source: &mut Source, acts: &[&Act], told: &Told) -> Option<()> {
    let mut aside = acts.iter().filter(|act| is_aside(act));
    if let (Some(_), Some(second)) = (aside.next(), aside.next()) {
        return source.refuse(&second.mark, "another move to the side begins at the same moment");
    }
    let mut speeds = acts.iter().filter(|act| matches!(act.kind, ActKind::Speed(..)));
    if let (Some(_), Some(second)) = (speeds.next(), speeds.next()) {
        return source.refuse(&second.mark, "another speed is told at the same moment");
    }
    let Some(act) = acts.iter().find(|act| is_aside(act)) else { return Some(()) };
    let stands = told.mps == Some(0.0) && !acts.iter().any(|act| is_speed(act));
    source.refuse_if(stands, &act.mark, "it stands, and a standing road user cannot slide sideways here")
}

/// Whether two wait for the same.
pub fn same_moment(a: &Event, b: &Event) -> bool {
    a.when.len() == b.when.len()
        && a.when.iter().zip(&b.when).all(|(a, b)| {
            a.len() == b.len()
                && a.iter()
                    .zip(b)
                    .all(|(a, b)| a.kind == b.kind && a.edge == b.edge && a.delay_s == b.delay_s)
        })
}
