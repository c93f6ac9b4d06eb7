//! Trajectories of the file, joined to one way: one after another, with the lanes that lead to the first and on from the last.

use std::rc::Rc;

use avastra_base::geometry::{Path, Vec2, wrap_angle};

use super::action::{Act, ActKind, Meeting, Speed, Way};
use super::cast::{Cast, Leg, Moving, is_called};
use super::condition::Waiting;
use super::phases::same_moment;
use super::place::{Placed, drawn};
use super::said::points_text;
use super::source::{Mark, Source};
use super::story::{Entity, Event};
use super::trigger::{Edge, When};

/// A trajectory that begins during the story does so this near to where its entity stands, m.
const NEAR_M: f64 = 1.5;

/// One that goes on from another way does so this near to its end, m.
const JOINED_M: f64 = 0.2;

/// Headings of vertices may be so far from the direction of the way, rad: as much as a driver on a curve is beside its chord.
const LOOKS_RAD: f64 = 0.1;

/// A way as it is put together.
struct Joined<'a> {
    points: Vec<Vec2>,
    legs: Vec<Leg<'a>>,
    /// Where it ends so far.
    here: Placed,
}

impl<'a> Cast<'a> {
    /// Lets all entities follow their trajectories. Whether a trajectory begins at once depends on where all entities
    /// begin.
    pub fn join_ways(&mut self, source: &mut Source) {
        for at in 0..self.moving.len() {
            let entity = self.moving[at].entity;
            if !is_led(entity) {
                continue;
            }
            if let Some(moving) = source.about(&entity.name, |source| self.joined(source, &self.moving[at])) {
                self.moving[at] = moving;
            }
        }
    }

    /// The entity with its whole way.
    fn joined(&self, source: &mut Source, moving: &Moving<'a>) -> Option<Moving<'a>> {
        let entity = moving.entity;
        let mut joined = Joined { points: Vec::new(), legs: Vec::new(), here: moving.placed };
        if let Some(way) = &entity.way {
            self.add(source, entity, &mut joined, way)?;
        }
        let mut before: Option<&Event> = None;
        for (event, way) in follows(entity) {
            let mark = &way.shape.mark;
            if joined.legs.is_empty() {
                match self.met_at(event, entity) {
                    Some(meeting) => {
                        let place = self.place(source, &meeting.own_at)?;
                        self.drive_to(source, mark, moving, &mut joined, place)?;
                    }
                    None => {
                        let stands = moving.mps == 0.0 && !moves_before(&entity.events, event);
                        let reason =
                            "it drives already when its trajectory begins: where it is then is not known";
                        let begins = stands || self.begins_at_once(source, moving, event)?;
                        source.refuse_if(!begins, mark, reason)?;
                    }
                }
            } else {
                let ends = |condition: &When| match condition {
                    When::Ended { kind, name } => before.is_some_and(|event| is_called(event, kind, name)),
                    _ => false,
                };
                let waits = matches!(event.when.as_slice(), [all] if all.iter().any(|one| ends(&one.kind)));
                let reason = "a second trajectory is read where it waits for the end of the one before it";
                source.refuse_if(!waits, mark, reason)?;
            }
            self.add(source, entity, &mut joined, way)?;
            before = Some(event);
        }
        let onwards = joined.here.lane.filter(|_| joined.here.is_along() && !entity.body.is_on_foot());
        if let Some(lane) = onwards {
            let points = self.places.borrow().onwards(lane);
            joined.points.extend(points.into_iter().skip(1));
        } else if joined.legs.last().is_some_and(|leg| leg.timed.is_empty()) {
            source.note("who comes to the end of a trajectory beside the lanes stands there");
        }
        let path = Rc::new(Path::through(&joined.points)?);
        // Only a way that begins with a trajectory begins in the middle of it.
        let at_m = joined.legs.first().map_or(0.0, |leg| leg.way.from_m);
        let trajectory = points_text(&joined.points);
        let Moving { placed, mps, .. } = *moving;
        let bearer = moving.bearer.clone();
        Some(Moving { entity, bearer, placed, path, trajectory, at_m, offset_m: 0.0, mps, legs: joined.legs })
    }

    /// Adds a trajectory.
    fn add(
        &self,
        source: &mut Source,
        entity: &'a Entity,
        joined: &mut Joined<'a>,
        way: &'a Way,
    ) -> Option<()> {
        let mark = &way.shape.mark;
        let is_given = entity.way.as_ref().is_some_and(|given| core::ptr::eq(given, way));
        let is_first = joined.points.is_empty();
        let here = joined.here.pose;
        let mut places = self.places.borrow_mut();
        let begins_there = places.stand(&entity.name, joined.here);
        let found = way.shape.drawn(source, &mut places, Some(here));
        if let Some(placed) = begins_there {
            places.stand(&entity.name, placed);
        }
        let found = found?;
        let is_in_part = way.timing.is_some() && found.is_timed_in_part;
        source.refuse_if(is_in_part, mark, "all of its vertices have a time, or none has one")?;
        if let Some((mark, turned_rad)) = found.turned.as_ref().filter(|_| !way.is_steered) {
            let reason = format!(
                "its heading is {turned_rad:.2} rad beside the direction of the way there: who follows a way looks along it"
            );
            source.refuse_if(*turned_rad > LOOKS_RAD && !entity.body.is_on_foot(), mark, reason)?;
            if *turned_rad > 0.01 {
                source.note("who follows a way looks along it, also where its vertices have other headings");
            }
        }
        let begins = found.path.pose_at(way.from_m);
        source.refuse_if(
            !is_first && way.from_m > 0.0,
            mark,
            "only the first trajectory begins in its middle",
        )?;
        let away_m = (begins.position - here.position).norm();
        let reason = format!("its trajectory begins {away_m:.1} m away from where it is then");
        let near_m = if is_first { NEAR_M } else { JOINED_M };
        source.refuse_if(!is_given && away_m > near_m, mark, reason)?;
        let turned_rad = wrap_angle(begins.heading_rad - here.heading_rad).abs();
        let is_turned = entity.position.is_some() && turned_rad > 2.0 && !entity.body.is_on_foot();
        source.refuse_if(is_turned, mark, "vehicles do not drive backwards")?;
        if !is_first {
            // Where it ends and the next one begins is one point.
            joined.points.pop();
        }
        let from_m = joined.length_m(&found.points);
        joined.points.extend(&found.points);
        let timed = match way.timing {
            Some((more_s, times)) => {
                let at = |(at_m, time_s): &(f64, f64)| (from_m + at_m, time_s * times + more_s);
                found.timed.iter().map(at).collect()
            }
            None => Vec::new(),
        };
        joined.here = places.in_plane(found.path.pose_at(found.path.length_m()));
        let lane = joined.here.lane;
        joined.legs.push(Leg { way, end_m: from_m + found.path.length_m(), timed, lane });
        Some(())
    }

    /// Lets an entity drive along its lane to a place.
    fn drive_to(
        &self,
        source: &mut Source,
        mark: &Mark,
        moving: &Moving<'a>,
        joined: &mut Joined<'a>,
        place: Placed,
    ) -> Option<()> {
        let end_m = moving.path.project(place.pose.position).station_m;
        source.refuse_if(end_m <= moving.at_m, mark, "its trajectory begins behind it")?;
        let beside_m = |at_m: f64| moving.path.pose_at(at_m).offset(0.0, moving.offset_m).position;
        joined.points = drawn(moving.at_m, end_m, beside_m);
        // A player minds how far along the place is, not where across.
        joined.here = self.places.borrow().in_plane(moving.path.pose_at(end_m).offset(0.0, moving.offset_m));
        Some(())
    }

    /// The synchronised arrival for whose end an event waits.
    fn met_at(&self, event: &Event, entity: &'a Entity) -> Option<&'a Meeting> {
        let [all] = event.when.as_slice() else { return None };
        let meets = |other: &'a Event| {
            other.acts.iter().find_map(|act| match &act.kind {
                ActKind::Meet(meeting) => Some(&**meeting),
                _ => None,
            })
        };
        all.iter().find_map(|condition| match &condition.kind {
            When::Ended { kind, name } => {
                entity.events.iter().filter(|other| is_called(other, kind, name)).find_map(meets)
            }
            _ => None,
        })
    }

    /// Whether what an event waits for holds at the beginning.
    fn begins_at_once(&self, source: &mut Source, moving: &Moving<'a>, event: &Event) -> Option<bool> {
        let waiting = Waiting::at_first(self, moving);
        let mut begins = event.when.is_empty();
        for all in &event.when {
            let mut holds = true;
            for condition in all {
                let is_plain = condition.edge == Edge::None && condition.delay_s == 0.0;
                holds = holds && is_plain && waiting.holds(source, condition)?;
            }
            begins |= holds;
        }
        Some(begins)
    }
}

impl Joined<'_> {
    /// How long the way is up to the first of more points, m.
    fn length_m(&self, more: &[Vec2]) -> f64 {
        let points: Vec<&Vec2> = self.points.iter().chain(more.first()).collect();
        points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }
}

impl<'a> Moving<'a> {
    /// A trajectory of its way.
    pub fn leg(&self, way: &Way) -> Option<&Leg<'a>> {
        self.legs.iter().find(|leg| core::ptr::eq(leg.way, way))
    }
}

/// Whether an entity follows a trajectory, from the beginning or later.
pub fn is_led(entity: &Entity) -> bool {
    entity.way.is_some() || follows(entity).next().is_some()
}

/// The trajectories that an entity follows during the story, with the events that begin them.
fn follows(entity: &Entity) -> impl Iterator<Item = (&Event, &Way)> {
    entity.events.iter().flat_map(|event| {
        event.acts.iter().filter_map(move |act| match &act.kind {
            ActKind::Follow(way) => Some((event, &**way)),
            _ => None,
        })
    })
}

/// Whether an event moves its entity.
pub fn moves(event: &Event) -> bool {
    let stays = |act: &Act| {
        matches!(act.kind, ActKind::Ahead(..) | ActKind::Follow(_) | ActKind::Speed(Speed::Absolute(0.0), _))
    };
    !event.acts.iter().all(stays)
}

/// Whether an event moves the entity and comes before the one with which its trajectory begins.
fn moves_before(events: &[Event], begins: &Event) -> bool {
    let at = events.iter().position(|event| core::ptr::eq(event, begins));
    events.iter().enumerate().any(|(nth, event)| {
        let is_earlier = match (event.time_s(), begins.time_s()) {
            (Some(time_s), Some(begins_s)) => time_s < begins_s,
            _ => at.is_none_or(|at| nth < at),
        };
        is_earlier && !same_moment(event, begins) && moves(event)
    })
}
