//! What keeps the order of a file: the refusals of events that may come, or end, at another time than in it.
//!
//! A manoeuvre goes from phase to phase, and asks what is so now; a file's events come side by side, and remember.

use super::action::{Act, ActKind, Over, Speed};
use super::condition::{Waiting, is_called};
use super::phases::same_moment;
use super::said::Said;
use super::scene::{Cast, Moving};
use super::source::{Mark, Source};
use super::story::Event;
use super::trigger::{Condition, Edge, Trigger, When};

/// What is estimated to come so much later is later, s.
const LATER_S: f64 = 0.5;

impl<'a> Cast<'a> {
    /// Refuses events of which a later one comes first, as those who are there begin.
    pub fn come_in_order(&self, source: &mut Source, moving: &Moving<'a>, events: &[&Event]) -> Option<()> {
        let waiting = Waiting::at_first(self, moving);
        let mut latest_s: f64 = 0.0;
        for event in events {
            let waits_for_another =
                |condition: &Condition| matches!(condition.kind, When::Ended { .. } | When::Begun { .. });
            if event.when.iter().any(|all| all.iter().any(waits_for_another)) {
                // What comes after another one comes in its own time.
                latest_s = 0.0;
                continue;
            }
            let Some(comes_s) = waiting.comes_s(source, &event.when) else { continue };
            let reason = format!(
                "as they begin, it comes at {comes_s:.1} s, and what stands before it at {latest_s:.1} s: what one does is read in the order in which it comes"
            );
            source.refuse_if(comes_s < latest_s - LATER_S, &event.mark, reason)?;
            latest_s = latest_s.max(comes_s);
        }
        Some(())
    }

    /// The field that ends a speed which an event overwrites and says nothing of; to the side nothing may be under way.
    pub fn ends_what_goes_on(
        &self,
        source: &mut Source,
        moving: &Moving<'a>,
        event: &Event,
    ) -> Option<Option<Said>> {
        let waiting = Waiting::at_first(self, moving);
        let is_aside = |act: &Act| matches!(act.kind, ActKind::Lane(..) | ActKind::Offset(..));
        let mut field = None;
        let earlier = moving.entity.events.iter().take_while(|other| !core::ptr::eq(*other, event));
        for other in earlier.filter(|other| event.overwrites && other.is_beside(event)) {
            let follows = |condition: &Condition| match &condition.kind {
                When::Ended { kind, name } => is_called(other, kind, name),
                _ => false,
            };
            if same_moment(other, event) || event.when.iter().all(|all| all.iter().any(follows)) {
                continue;
            }
            for act in &other.acts {
                let takes_s = match &act.kind {
                    ActKind::Speed(_, dynamics)
                    | ActKind::Lane(_, _, dynamics)
                    | ActKind::Offset(_, dynamics) => match dynamics.over {
                        _ if dynamics.is_continuous => None,
                        Over::AtOnce => Some(0.0),
                        Over::Time(time_s) => Some(time_s),
                        _ => None,
                    },
                    ActKind::Profile(_) | ActKind::Meet(_) | ActKind::Keep(_) => None,
                    _ => Some(0.0),
                };
                let is_ended = event.acts.iter().any(|own| is_aside(own) == is_aside(act));
                let ends_s = waiting
                    .comes_s(source, &other.when)
                    .zip(takes_s)
                    .map(|(comes_s, takes_s)| comes_s + takes_s);
                let comes_s = waiting.comes_s(source, &event.when);
                let is_over = ends_s.zip(comes_s).is_some_and(|(ends_s, comes_s)| ends_s <= comes_s);
                if takes_s == Some(0.0) || is_ended || is_over {
                    continue;
                }
                let reason = "it ends another event of its manoeuvre, which would go on here: `parallel` is read, and what waits for its end";
                source.refuse_if(!matches!(act.kind, ActKind::Speed(..)), &event.mark, reason)?;
                field = Some(Said::text("speed: npc.speed"));
            }
        }
        Some(field)
    }
}

impl Waiting<'_, '_> {
    /// Refuses what is not so at one moment: edges beside others, the ends of what several do, and what waits for itself.
    pub fn comes_as_said(&self, source: &mut Source, trigger: &Trigger) -> Option<()> {
        for all in trigger {
            edges_are_alone(source, all)?;
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
            let reason = format!("it waits for `{name}`, and that, by way of others, for itself");
            source.refuse_if(self.cast.waits_for_itself(kind, name), &condition.mark, reason)?;
        }
        Some(())
    }

    /// Refuses the end of a change to a speed that somebody may have at another time, or may never come to.
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
                    ActKind::Speed(..) | ActKind::Profile(_) | ActKind::Meet(_) | ActKind::Keep(_) => {
                        return source.refuse(mark, reason);
                    }
                    _ => {}
                }
            }
        }
        let (least_mps, most_mps) =
            known.iter().fold((f64::MAX, f64::MIN), |(least, most), mps| (least.min(*mps), most.max(*mps)));
        source.refuse_if((least_mps..=most_mps).contains(&mps), mark, reason)?;
        let is_at_once = |act: &Act| matches!(&act.kind, ActKind::Speed(_, dynamics) if matches!(dynamics.over, Over::AtOnce));
        if event.acts.last().is_some_and(is_at_once) {
            return Some(());
        }
        // What cuts it short ends it, too, and then the speed is another one.
        let is_speed = |act: &Act| {
            matches!(act.kind, ActKind::Speed(..) | ActKind::Profile(_) | ActKind::Meet(_) | ActKind::Keep(_))
        };
        let later = moving.entity.events.iter().skip_while(|other| !core::ptr::eq(*other, event)).skip(1);
        for other in later
            .filter(|other| other.acts.iter().any(is_speed) || other.overwrites && other.is_beside(event))
        {
            let follows = |condition: &Condition| match &condition.kind {
                When::Ended { kind, name } => is_called(event, kind, name),
                _ => false,
            };
            let waits = other.when.iter().all(|all| all.iter().any(follows));
            let reason = "another event may cut this short, and end it without its speed";
            source.refuse_if(!waits || other.when.is_empty(), mark, reason)?;
        }
        Some(())
    }
}

/// Refuses an edge beside other conditions: they would have to hold at its very moment.
fn edges_are_alone(source: &mut Source, all: &[Condition]) -> Option<()> {
    let (of_act, own): (Vec<&Condition>, Vec<&Condition>) =
        all.iter().filter(|one| one.kind != When::Always).partition(|one| one.is_of_act);
    for some in [&of_act, &own] {
        let edge = some.iter().find(|condition| some.len() > 1 && condition.edge != Edge::None);
        if let Some(edge) = edge {
            let reason = "beside other conditions, which would have to hold at the moment of its edge, only `conditionEdge=\"none\"` is read";
            return source.refuse(&edge.mark, reason);
        }
    }
    let latest_s = of_act.iter().map(|one| one.time_s()).collect::<Option<Vec<f64>>>();
    let latest_s = latest_s.map(|times| times.into_iter().fold(0.0, f64::max));
    for condition in own.iter().filter(|one| !of_act.is_empty() && one.edge != Edge::None) {
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
