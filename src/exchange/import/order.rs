//! Keeps the order of a file: refuses events that may come, or end, at another time than in it.
//!
//! A manoeuvre goes from phase to phase, and asks what is so now; a file's events come side by side, and remember.

use avastra_lang::model::expr::Comparison;

use super::action::{Act, ActKind, Over, Speed};
use super::body::Body;
use super::cast::{Cast, Moving, is_called};
use super::condition::Waiting;
use super::phases::same_moment;
use super::said::Said;
use super::source::{Mark, Source};
use super::story::Event;
use super::trigger::{Condition, Edge, Pair, PlaceMark, Trigger, When, asks_for_less};

/// An event that is estimated to come at most this much before the event above it still counts as coming after it, s.
const EARLY_S_MAX: f64 = 0.1;

/// Times that differ by less are the same, s.
const LEAST_S: f64 = 1e-6;

/// When an event comes, and when it is over, if all entities go on as they begin; `None`: it is not known.
#[derive(Debug, Clone, Copy)]
struct Times {
    comes_s: Option<f64>,
    /// When it comes at the earliest.
    least_s: Option<f64>,
    ends_s: Option<f64>,
    takes_s: Option<f64>,
    /// Whether it is a change to the speed that is there already, which takes a time in the file.
    is_idle: bool,
    /// Whether it comes by what stands directly before it.
    is_made_to_come: bool,
    /// The least time by which it comes after what stands before it.
    after_s_min: f64,
}

/// The events of an entity, in their order, and what is known of their times.
pub struct Sequence<'e> {
    events: Vec<(&'e Event, Times)>,
}

impl<'a> Cast<'a> {
    /// The events of an entity in this order, where each is known to come after those before it; others are refused.
    pub fn in_sequence<'e>(
        &self,
        source: &mut Source,
        moving: &Moving<'a>,
        events: &[&'e Event],
    ) -> Option<Sequence<'e>> {
        let sequence = self.estimated(source, moving, events);
        for pair in sequence.events.windows(2) {
            sequence.refuse_out_of_order(source, moving, &pair[0], &pair[1])?;
        }
        for (nth, (event, times)) in sequence.events.iter().enumerate() {
            self.refuse_if_stopped(source, moving, &sequence, (event, times))?;
            let like = |kind: fn(&Act) -> bool| event.acts.iter().any(kind);
            let (told_speed, told_aside) = (like(is_speed), like(is_aside));
            let is_like = |act: &Act| told_speed && is_speed(act) || told_aside && is_aside(act);
            let mut later = sequence.events[nth + 1..].iter().flat_map(|(event, _)| &event.acts);
            let reason = "it may happen again after what comes later: `maximumExecutionCount=\"1\"` is read";
            source.refuse_if(event.comes_again && later.any(is_like), &event.mark, reason)?;
        }
        Some(sequence)
    }

    /// Refuses an event that the stop trigger of its act may cut short or keep from coming.
    fn refuse_if_stopped(
        &self,
        source: &mut Source,
        moving: &Moving<'a>,
        sequence: &Sequence,
        (event, times): (&Event, &Times),
    ) -> Option<()> {
        let Some((mark, stop)) = event.stop.as_deref() else { return Some(()) };
        let is_time = stop.iter().flatten().all(|one| matches!(one.kind, When::Always | When::After(_)));
        let waiting = Waiting::at_first(self, moving);
        let stop_s = waiting.comes_s(source, stop, &|when| sequence.time_s(when));
        let comes_s = times.comes_s.filter(|comes_s| comes_s.is_finite());
        match (stop_s, times.ends_s.or(comes_s)) {
            (Some(stop_s), _) if stop_s >= self.story.duration_s => return Some(()),
            (Some(stop_s), Some(known_s)) if known_s > stop_s => {
                let reason = format!(
                    "as they begin, it stops its act at {stop_s:.1} s, before what `{}` does then has ended: what stops nothing is read",
                    event.name()
                );
                return source.refuse(mark, reason);
            }
            (Some(stop_s), _) if times.ends_s.is_some_and(|ends_s| ends_s <= stop_s) && is_time => {
                return Some(());
            }
            _ => {}
        }
        let reason = format!(
            "whether what `{}` does has ended when it stops its act is not known: what stops nothing is read",
            event.name()
        );
        source.refuse_if(is_time, mark, reason)?;
        // The driving system may bring about another order.
        source.note(
            "an act that stops with what happens, and not at a time, is taken to stop after all that it does",
        );
        Some(())
    }

    /// When these events come, as far as that is known.
    fn estimated<'e>(&self, source: &mut Source, moving: &Moving<'a>, events: &[&'e Event]) -> Sequence<'e> {
        let waiting = Waiting::at_first(self, moving);
        let mut sequence = Sequence { events: Vec::new() };
        let mut mps = Some(moving.mps);
        // The least and the greatest speed that it is told, as long as they are known.
        let mut told_mps = Some((moving.mps, moving.mps));
        // Which of them changes its speed first, and when at the earliest: what is asked about it is estimated until then.
        let mut changes: Option<(usize, f64)> = None;
        for event in events {
            let estimate_s = waiting.comes_s(source, &event.when, &|when| sequence.time_s(when));
            let is_changed = changes.filter(|_| event.asks_about(&moving.entity.name));
            let (comes_s, least_s) = match (is_changed, estimate_s) {
                (Some((_, changed_s)), Some(estimate_s)) if estimate_s > changed_s => (None, Some(changed_s)),
                _ => (estimate_s, estimate_s),
            };
            let is_idle = event.acts.iter().any(|act| match &act.kind {
                ActKind::Speed(Speed::Absolute(to_mps), _) => mps == Some(*to_mps) && takes_time(act),
                _ => false,
            });
            let takes_s = event.acts.iter().map(|act| takes_s(act, &moving.entity.body, &mut mps));
            let takes_s =
                takes_s.collect::<Option<Vec<f64>>>().map(|all| all.into_iter().fold(0.0, f64::max));
            let ends_s = match event.acts.as_slice() {
                // It ends when the other one is at its place.
                [Act { kind: ActKind::Meet(meeting), mark }] => {
                    waiting.is_at_s(source, mark, &meeting.master, &PlaceMark(meeting.master_at.clone()))
                }
                _ => comes_s.zip(takes_s).map(|(comes_s, takes_s)| comes_s + takes_s),
            };
            let after_s_min =
                told_mps.and_then(|told_mps| waiting.takes_at_least_s(source, &event.when, told_mps));
            // As they begin it never comes: what stands directly before it changes that.
            let is_made_to_come = estimate_s == Some(f64::INFINITY)
                && changes.is_some_and(|(changer, _)| changer + 1 == sequence.events.len());
            let after_s_min = after_s_min.filter(|_| is_made_to_come).unwrap_or(0.0);
            if changes.is_none() && event.acts.iter().any(is_speed) {
                changes = Some((sequence.events.len(), least_s.unwrap_or(0.0)));
            }
            let times = Times { comes_s, least_s, ends_s, takes_s, is_idle, is_made_to_come, after_s_min };
            sequence.events.push((event, times));
            if event.acts.iter().any(is_speed) {
                told_mps = told_mps.zip(mps).map(|((least, most), mps)| (mps.min(least), mps.max(most)));
            }
        }
        sequence
    }
}

impl<'e> Sequence<'e> {
    /// Refuses an event that is not known to come after the one that stands before it.
    fn refuse_out_of_order(
        &self,
        source: &mut Source,
        moving: &Moving,
        (before, earlier): &(&Event, Times),
        (event, later): &(&Event, Times),
    ) -> Option<()> {
        if !before.when.is_empty() && same_moment(before, event) {
            let is_cut = event.overwrites && event.is_beside(before) && earlier.takes_s != Some(0.0);
            let reason = "it ends another event of its manoeuvre at the moment at which that begins";
            source.refuse_if(is_cut, &event.mark, reason)?;
            return Some(());
        }
        let has_come = |one: &Condition| {
            let came_s = self.time_s(&one.kind).map(|came_s| came_s + one.delay_s);
            came_s.zip(later.least_s).is_some_and(|(came_s, least_s)| came_s <= least_s)
        };
        if before.when.is_empty()
            || event.waits_for(before)
            || is_implied(&before.when, &event.when, has_come)
        {
            return Some(());
        }
        // The driving system may bring about another order.
        let note = format!("what `{}` does is taken to come in the order of the file", moving.entity.name);
        let other = before.name();
        let reason = match (earlier.comes_s, later.least_s) {
            (Some(earlier_s), Some(later_s))
                if earlier_s.is_finite() && later_s >= earlier_s - EARLY_S_MAX =>
            {
                if before.time_s().is_none() || event.time_s().is_none() {
                    source.note(note);
                }
                return Some(());
            }
            (None, _) if later.is_made_to_come => {
                source.note(note);
                return Some(());
            }
            (Some(earlier_s), Some(later_s)) if earlier_s.is_finite() => format!(
                "as they begin, it comes at {later_s:.1} s, and `{other}`, which stands before it, at {earlier_s:.1} s: what one does is read in the order in which it comes"
            ),
            _ => format!(
                "whether it comes after `{other}` is not known, and what one does is read in the order in which it comes: let it wait for the end of that"
            ),
        };
        source.refuse(&event.mark, reason)
    }

    /// The events that begin with an event, itself among them.
    pub fn with(&self, event: &Event) -> impl Iterator<Item = &'e Event> {
        self.events.iter().map(|(other, _)| *other).filter(move |other| same_moment(other, event))
    }

    /// When something of this sequence has begun or ended, if that is known.
    fn time_s(&self, when: &When) -> Option<f64> {
        let (kind, name, of): (_, _, fn(&Times) -> Option<f64>) = match when {
            When::Ended { kind, name } => (kind, name, |times| times.ends_s),
            When::Begun { kind, name } => (kind, name, |times| times.comes_s),
            _ => return None,
        };
        let own = self.events.iter().filter(|(event, _)| is_called(event, kind, name));
        let times: Option<Vec<f64>> = own.map(|(_, times)| of(times)).collect();
        times?.into_iter().reduce(f64::max)
    }

    /// The events that may still be under way when an event comes: those before it that take
    /// time and are not known to be over.
    fn under_way(&self, event: &Event) -> Vec<&'e Event> {
        let at = self.events.iter().position(|(own, _)| core::ptr::eq(*own, event)).unwrap_or(0);
        let (comes_s, after_s_min) =
            self.events.get(at).map_or((None, 0.0), |(_, times)| (times.comes_s, times.after_s_min));
        let is_over = |(other, times): &(&Event, Times)| {
            // The event may also wait for another event that waits for the end: then it comes later still.
            let (mut ended, mut seen): (Vec<&Event>, Vec<&Event>) = (vec![event], Vec::new());
            while let Some(last) = ended.pop() {
                if last.waits_for_the_end_of(other) {
                    return true;
                }
                for (own, _) in self.events.iter().filter(|(own, _)| last.waits_for(own)) {
                    if !seen.iter().any(|known| core::ptr::eq(*known, *own)) {
                        seen.push(own);
                        ended.push(own);
                    }
                }
            }
            times.takes_s.is_some_and(|takes_s| takes_s <= after_s_min + LEAST_S)
                || times
                    .ends_s
                    .zip(comes_s)
                    .is_some_and(|(ends_s, comes_s)| ends_s <= comes_s && comes_s.is_finite())
        };
        let before = self.events.iter().take(at);
        before
            .filter(|other| !same_moment(other.0, event) && !is_over(other))
            .map(|(other, _)| *other)
            .collect()
    }

    /// Whether its speed may still change when an event comes.
    pub fn changes_speed_at(&self, event: &Event) -> bool {
        self.under_way(event)
            .iter()
            .any(|other| other.acts.iter().any(|act| is_speed(act) && takes_time(act)))
    }

    /// Refuses to wait for ends that come at another time here: of idle changes of speed, of steps to the side, and of moves over a way.
    pub fn waits_for_known_ends(&self, source: &mut Source, event: &Event) -> Option<()> {
        let of_way = |act: &Act| match &act.kind {
            ActKind::Lane(_, _, dynamics) | ActKind::Offset(_, dynamics) => {
                matches!(dynamics.over, Over::Way(_))
            }
            _ => false,
        };
        let changes = |acts: &[Act]| acts.iter().any(|act| is_speed(act) && takes_time(act));
        for (other, times) in self.events.iter().filter(|(other, _)| event.waits_for_the_end_of(other)) {
            let reason = "it waits for the end of a change to the speed that is there already, which is done at once here";
            source.refuse_if(times.is_idle, &event.mark, reason)?;
            let is_step = other.acts.iter().all(|act| is_aside(act) && !takes_time(act));
            let reason =
                "it waits for the end of a step to the side, for which a vehicle here needs its time";
            source.refuse_if(is_step && !other.acts.is_empty(), &event.mark, reason)?;
            let is_slower =
                other.acts.iter().any(of_way) && (self.changes_speed_at(other) || changes(&other.acts));
            let reason = "it waits for the end of a move to the side over a way, on which the speed changes";
            source.refuse_if(is_slower, &event.mark, reason)?;
        }
        Some(())
    }

    /// Refuses an event that may meet a lateral move, or a trajectory, under way. Returns the field that ends a change of
    /// speed which the event overwrites without giving a speed.
    pub fn ends_what_goes_on(&self, source: &mut Source, event: &Event) -> Option<Option<Said>> {
        let mut field = None;
        for other in self.under_way(event) {
            let is_cut = event.overwrites && event.is_beside(other);
            let follows = other.acts.iter().any(|act| matches!(act.kind, ActKind::Follow(_)));
            let reason = "a trajectory may be under way, which it would end, or lead beside: what waits for its end is read";
            source.refuse_if(follows && (is_cut || event.acts.iter().any(is_aside)), &event.mark, reason)?;
            for act in other.acts.iter().filter(|act| takes_time(act)) {
                let says_the_same = event.acts.iter().any(|own| is_aside(own) && is_aside(act));
                let reason = "it begins while another move to the side may be under way: where that has come to by then is not known";
                source.refuse_if(says_the_same, &event.mark, reason)?;
                if !is_cut || event.acts.iter().any(|own| is_aside(own) == is_aside(act)) {
                    continue;
                }
                let reason = "it may end another event of its manoeuvre, which goes on here: `parallel` is read, and what waits for its end";
                source.refuse_if(!matches!(act.kind, ActKind::Speed(..)), &event.mark, reason)?;
                field = Some(Said::text("speed: npc.speed"));
            }
        }
        Some(field)
    }
}

impl Event {
    /// Whether it waits, whatever else comes, for the beginning or the end of another one.
    fn waits_for(&self, other: &Event) -> bool {
        self.waits_in_all(|when| match when {
            When::Ended { kind, name } | When::Begun { kind, name } => is_called(other, kind, name),
            _ => false,
        })
    }

    pub fn waits_for_the_end_of(&self, other: &Event) -> bool {
        self.waits_in_all(|when| matches!(when, When::Ended { kind, name } if is_called(other, kind, name)))
    }

    /// Whether a condition is about an entity.
    fn asks_about(&self, name: &str) -> bool {
        self.when.iter().flatten().any(|condition| match &condition.kind {
            When::Headway { pair, .. }
            | When::Distance { pair, .. }
            | When::Apart { pair, .. }
            | When::Collides { pair, .. } => pair.of == name || pair.to == name,
            When::Clear(_) => true,
            When::Reaches { entity, .. }
            | When::Travelled { entity, .. }
            | When::Stands { entity, .. }
            | When::Speed { entity, .. }
            | When::Nears { entity, .. } => entity == name,
            When::Faster { of, to, .. } => of == name || to == name,
            When::Always
            | When::Never
            | When::Contact(_)
            | When::After(_)
            | When::Ended { .. }
            | When::Begun { .. } => false,
        })
    }

    fn waits_in_all(&self, is_meant: impl Fn(&When) -> bool) -> bool {
        !self.when.is_empty() && self.when.iter().all(|all| all.iter().any(|one| is_meant(&one.kind)))
    }
}

/// Whether something leads to the side.
pub fn is_aside(act: &Act) -> bool {
    matches!(act.kind, ActKind::Lane(..) | ActKind::Offset(..))
}

/// Whether something says a speed.
pub fn is_speed(act: &Act) -> bool {
    matches!(act.kind, ActKind::Speed(..) | ActKind::Profile(_) | ActKind::Meet(_) | ActKind::Keep(_))
}

/// Whether something is not done at once.
fn takes_time(act: &Act) -> bool {
    match &act.kind {
        ActKind::Speed(_, dynamics) | ActKind::Lane(_, _, dynamics) | ActKind::Offset(_, dynamics) => {
            dynamics.is_continuous || !matches!(dynamics.over, Over::AtOnce)
        }
        ActKind::Profile(_) | ActKind::Meet(_) | ActKind::Keep(_) => true,
        _ => false,
    }
}

/// How long something takes, s, of one that has a speed before it, and then the one that it is told.
fn takes_s(act: &Act, body: &Body, mps: &mut Option<f64>) -> Option<f64> {
    let dynamics = match &act.kind {
        ActKind::Speed(wanted, dynamics) => {
            let from_mps = mps.take();
            if let Speed::Absolute(to_mps) = wanted {
                *mps = Some(*to_mps);
                let over_mps = from_mps.map(|from_mps| (to_mps - from_mps).abs());
                let takes_s = match dynamics.over {
                    Over::AtOnce => return Some(0.0),
                    Over::Time(time_s) => Some(time_s),
                    Over::Rate(rate_mps2) => Some(over_mps? * dynamics.peak / rate_mps2.abs()),
                    Over::Way(way_m) => Some(2.0 * way_m / (from_mps? + to_mps)),
                    Over::Never => None,
                };
                // Its vehicle may need longer.
                let gains = from_mps.is_none_or(|from_mps| from_mps < *to_mps);
                let can_mps2 = if gains { body.gains_mps2 } else { body.loses_mps2 };
                return takes_s.map(|takes_s| {
                    takes_s.max(over_mps.map_or(0.0, |over_mps| over_mps * dynamics.peak / can_mps2))
                });
            }
            dynamics
        }
        ActKind::Lane(_, _, dynamics) | ActKind::Offset(_, dynamics) => dynamics,
        ActKind::Profile(entries) => {
            *mps = entries.last().map(|entry| entry.mps);
            return Some(entries.iter().map(|entry| entry.time_s).sum());
        }
        ActKind::Meet(_) | ActKind::Keep(_) | ActKind::Follow(_) => {
            *mps = None;
            return None;
        }
        ActKind::Placed(_) | ActKind::Ahead(..) | ActKind::Route(_) => return Some(0.0),
    };
    match dynamics.over {
        _ if dynamics.is_continuous => None,
        Over::AtOnce => Some(0.0),
        Over::Time(time_s) => Some(time_s),
        Over::Rate(_) | Over::Way(_) | Over::Never => None,
    }
}

/// Whether `then` holds only once `before` has held. All conditions in one group of `before` must have come by then, or
/// ask the same of the same two, less far on.
fn is_implied(before: &Trigger, then: &Trigger, has_come: impl Fn(&Condition) -> bool) -> bool {
    let [all] = then.as_slice() else { return false };
    let then: Vec<&Condition> = all.iter().filter(|one| one.kind != When::Always).collect();
    let [then] = then.as_slice() else { return false };
    let is_before = |one: &Condition| one.kind == When::Always || has_come(one) || is_farther_on(one, then);
    before.iter().any(|all| all.iter().all(is_before))
}

/// Whether the second condition holds only once the first one has held.
fn is_farther_on(before: &Condition, then: &Condition) -> bool {
    let ceases = |one: &Condition| matches!(one.edge, Edge::Falling | Edge::Either);
    if before.delay_s > then.delay_s || ceases(before) || ceases(then) {
        return false;
    }
    let is_farther = |first: (Comparison, f64), second: (Comparison, f64)| match (
        asks_for_less(first.0),
        asks_for_less(second.0),
    ) {
        (true, true) => second.1 <= first.1,
        (false, false) => second.1 >= first.1,
        // It must first not be so, which is beyond the first bound.
        _ => {
            then.edge == Edge::Rising
                && if asks_for_less(first.0) { second.1 <= first.1 } else { second.1 >= first.1 }
        }
    };
    match (&before.kind, &then.kind) {
        (When::Distance { pair, metres }, When::Distance { pair: other, metres: second })
        | (When::Headway { pair, seconds: metres }, When::Headway { pair: other, seconds: second }) => {
            is_of_the_same(pair, other) && is_farther((pair.rule, *metres), (other.rule, *second))
        }
        (When::Speed { entity, mps, rule }, When::Speed { entity: other, mps: second, rule: then }) => {
            entity == other && is_farther((*rule, *mps), (*then, *second))
        }
        (When::Travelled { entity, metres }, When::Travelled { entity: other, metres: second }) => {
            entity == other && metres <= second
        }
        _ => false,
    }
}

/// Whether the second is about the distance of the same two as the first. Where more is asked for, it may be about
/// outlines instead of reference points, because that distance is shorter; where less is asked for, the other way round.
fn is_of_the_same(pair: &Pair, then: &Pair) -> bool {
    let is_as_far = match asks_for_less(pair.rule) {
        false => then.is_free_space || !pair.is_free_space,
        true => pair.is_free_space || !then.is_free_space,
    };
    pair.of == then.of && pair.to == then.to && pair.is_straight == then.is_straight && is_as_far
}

impl Waiting<'_, '_> {
    /// Refuses what is not so at one moment: edges beside others, the ends of what several do, and what waits for itself.
    pub fn comes_as_said(&self, source: &mut Source, trigger: &Trigger) -> Option<()> {
        for all in trigger {
            edges_are_alone(source, trigger, all)?;
        }
        for condition in trigger.iter().flatten() {
            let (When::Ended { kind, name } | When::Begun { kind, name }) = &condition.kind else { continue };
            let own = self.actor.entity.events.iter().find(|event| is_called(event, kind, name));
            let of = own.or_else(|| self.cast.last_event(kind, name).map(|(_, event)| event));
            let does = |moving: &&Moving| {
                moving.entity.events.iter().any(|event| of.is_some_and(|of| of.mark == event.mark))
            };
            let reason = format!("several do `{name}`: when all of them have begun or ended it is not read");
            source.refuse_if(self.cast.moving.iter().filter(does).count() > 1, &condition.mark, reason)?;
            self.is_one_moment(source, condition, kind, name)?;
            let waits = |own: &&Event| own.when.iter().flatten().any(|one| one.mark == condition.mark);
            let is_within =
                self.actor.entity.events.iter().filter(waits).any(|own| is_called(own, kind, name));
            let reason = format!("it waits for `{name}`, of which it is a part");
            source.refuse_if(is_within, &condition.mark, reason)?;
            let ends = matches!(condition.kind, When::Ended { .. });
            let reason =
                format!("`{name}` happens several times, and when the last time has ended is not read");
            source.refuse_if(ends && of.is_some_and(|of| of.comes_again), &condition.mark, reason)?;
            let reason = format!("it waits for `{name}`, and that, by way of others, for itself");
            source.refuse_if(self.cast.waits_for_itself(kind, name), &condition.mark, reason)?;
        }
        Some(())
    }

    /// Refuses what begins or ends with the first or the last of several things, unless they come one after the other.
    fn is_one_moment(
        &self,
        source: &mut Source,
        condition: &Condition,
        kind: &str,
        name: &str,
    ) -> Option<()> {
        let of = self.cast.moving.iter().map(|moving| &moving.entity.events);
        for events in of {
            let events: Vec<&Event> = events.iter().filter(|event| is_called(event, kind, name)).collect();
            let has_several = events.iter().any(|event| event.acts.len() > 1);
            let reason = "its event does several things, and when this one of them has ended is not read";
            source.refuse_if(kind == "action" && has_several, &condition.mark, reason)?;
            if matches!(kind, "action" | "event") {
                continue;
            }
            let is_chain = events.windows(2).all(|pair| pair[1].waits_for_the_end_of(pair[0]));
            let reason = format!("`{name}` has several events, which do not wait for each other");
            source.refuse_if(!is_chain, &condition.mark, reason)?;
            let reason = format!("a {kind} begins with its act: name one of its events");
            let begins = matches!(condition.kind, When::Begun { .. });
            source.refuse_if(begins && !events.is_empty(), &condition.mark, reason)?;
        }
        Some(())
    }

    /// Refuses the end of a change to a speed that the entity may have at another time, or may never come to.
    pub fn comes_to_once(
        &self,
        source: &mut Source,
        mark: &Mark,
        moving: &Moving,
        event: &Event,
        mps: f64,
    ) -> Option<()> {
        let reason = "when this has ended cannot be told by a speed, which may be there at another time";
        let mut known = vec![moving.mps];
        for other in moving.entity.events.iter().take_while(|other| !core::ptr::eq(*other, event)) {
            for act in &other.acts {
                match &act.kind {
                    ActKind::Speed(Speed::Absolute(mps), _) => known.push(*mps),
                    _ => source.refuse_if(is_speed(act), mark, reason)?,
                }
            }
        }
        let (least_mps, most_mps) =
            known.iter().fold((f64::MAX, f64::MIN), |(least, most), mps| (least.min(*mps), most.max(*mps)));
        source.refuse_if((least_mps..=most_mps).contains(&mps), mark, reason)?;
        if !event.acts.last().is_some_and(takes_time) {
            return Some(());
        }
        // An event that cuts it short ends it, too, and then the speed is another one.
        for other in moving
            .entity
            .after(event)
            .filter(|other| other.acts.iter().any(is_speed) || other.overwrites && other.is_beside(event))
        {
            let reason = "another event may cut this short, and end it without its speed";
            source.refuse_if(!other.waits_for_the_end_of(event), mark, reason)?;
        }
        Some(())
    }
}

/// Refuses an edge beside other conditions: they would have to hold at its very moment.
fn edges_are_alone(source: &mut Source, trigger: &Trigger, all: &[Condition]) -> Option<()> {
    let (of_act, own): (Vec<&Condition>, Vec<&Condition>) =
        all.iter().filter(|one| one.kind != When::Always).partition(|one| one.is_of_act);
    for some in [&of_act, &own] {
        let edge = some.iter().find(|condition| some.len() > 1 && condition.edge != Edge::None);
        if let Some(edge) = edge {
            let reason = "beside other conditions, which would have to hold at the moment of its edge, only `conditionEdge=\"none\"` is read";
            return source.refuse(&edge.mark, reason);
        }
    }
    runs_on(source, trigger, all)?;
    begins_after_its_act(source, &of_act, &own)
}

/// Refuses what holds only while something runs, beside other conditions, which may come later.
fn runs_on(source: &mut Source, trigger: &Trigger, all: &[Condition]) -> Option<()> {
    for own in all.iter().filter(|one| one.is_running && !one.is_of_act && all.len() > 1) {
        let (When::Begun { name, .. } | When::Ended { name, .. }) = &own.kind else { continue };
        // A condition that holds while an element runs, and after it, holds from the beginning of the element.
        let is_after =
            |other: &Condition| matches!(&other.kind, When::Ended { name: ended, .. } if ended == name);
        let goes_on = trigger.iter().any(|other| other.iter().any(is_after));
        let reason =
            format!("it ceases to hold when `{name}` has ended, beside other conditions that may come later");
        source.refuse_if(!goes_on, &own.mark, reason)?;
    }
    Some(())
}

/// Refuses edges and delays of conditions that may have come before the act in which they are asked begins.
fn begins_after_its_act(source: &mut Source, of_act: &[&Condition], own: &[&Condition]) -> Option<()> {
    let latest_s = of_act.iter().map(|one| one.time_s()).collect::<Option<Vec<f64>>>();
    let latest_s = latest_s.map(|times| times.into_iter().fold(0.0, f64::max));
    let waits = |one: &&&Condition| one.edge != Edge::None || one.delay_s > 0.0;
    for condition in own.iter().filter(|_| !of_act.is_empty()).filter(waits) {
        let is_later = match &condition.kind {
            When::After(seconds) => latest_s.is_some_and(|latest_s| *seconds >= latest_s),
            When::Ended { .. } | When::Begun { .. } => true,
            _ => false,
        };
        let reason = "its act begins later, and whether it holds by then is not known: with `conditionEdge=\"none\"` it is read";
        source.refuse_if(!is_later, &condition.mark, reason)?;
    }
    Some(())
}
