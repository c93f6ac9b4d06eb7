//! Triggers as conditions of the language, asked while a phase waits.

use avastra_base::geometry::Vec2;

use super::across::LanesBeside;
use super::action::{ActKind, Speed};
use super::cast::{Cast, EGO_FRONT_M, Moving, is_called};
use super::order::{is_aside, is_speed};
use super::phases::ARRIVES_M;
use super::said::Said;
use super::source::{Mark, Source};
use super::story::Event;
use super::trigger::{Clearance, Condition, Edge, Pair, Trigger, When, asks_for_less};

/// An entity may drive through a circle of a smaller radius within a tick: the circle is reached once its near edge is,
/// m.
const PASSED_M: f64 = 1.0;

/// A lateral distance may change a distance along the way by at most this, m.
const ASIDE_M: f64 = 0.5;

/// A value that differs by less from a bound is just there, m.
const JUST_M: f64 = 1e-6;

const AT_ITS_BOUND: &str = "as they begin it is just at its bound, and whether it holds cannot be told";

/// The words before a phase.
#[derive(Debug, Clone, Default)]
pub struct Begins {
    /// Whether what was told before has to be done first.
    pub is_after: bool,
    /// The condition that must come before.
    pub first: Option<Said>,
    pub once: Option<Said>,
    /// s.
    pub held_s: f64,
    pub after_s: f64,
}

impl Begins {
    /// The words with a blank after each.
    pub fn said(&self) -> Said {
        let mut said = Said::default();
        if let Some(once) = &self.once {
            said = said.and("once ").then(once.clone()).and(" ");
            if self.held_s > 0.0 {
                said = said.and("for ").number(self.held_s, "s").and(" ");
            }
        }
        if self.after_s > 0.0 {
            said = said.and("after ").number(self.after_s, "s").and(" ");
        }
        said
    }
}

/// An entity that waits for a trigger.
pub struct Waiting<'w, 'a> {
    pub cast: &'w Cast<'a>,
    pub actor: &'w Moving<'a>,
    /// The events before this one that began together.
    pub before: Vec<&'w Event>,
    /// Whether nothing came before, and it waits for one condition: what becomes less then does so from the side where it begins.
    pub is_first: bool,
}

impl<'w, 'a> Waiting<'w, 'a> {
    /// Before which nothing came.
    pub fn at_first(cast: &'w Cast<'a>, actor: &'w Moving<'a>) -> Waiting<'w, 'a> {
        Waiting { cast, actor, before: Vec::new(), is_first: true }
    }
}

impl Waiting<'_, '_> {
    /// Whether a trigger waits for nothing but the end of the event before it.
    pub fn waits_for_the_end(&self, trigger: &Trigger) -> bool {
        let is_end = |condition: &Condition| match &condition.kind {
            When::Ended { kind, name } => self.before.iter().any(|event| is_called(event, kind, name)),
            _ => condition.kind == When::Always,
        };
        matches!(trigger.as_slice(), [all] if all.iter().all(is_end))
    }

    /// Whether a trigger waits for the end of a way, among others.
    pub fn waits_for_a_way(&self, trigger: &Trigger) -> bool {
        let is_way = |event: &&&Event| event.acts.iter().any(|act| matches!(act.kind, ActKind::Follow(_)));
        trigger.iter().flatten().any(|condition| match &condition.kind {
            When::Ended { kind, name } => {
                self.before.iter().filter(is_way).any(|event| is_called(event, kind, name))
            }
            _ => false,
        })
    }

    pub fn begins(&self, source: &mut Source, trigger: &Trigger) -> Option<Begins> {
        let mut begins = Begins::default();
        self.comes_as_said(source, trigger)?;
        let [all] = trigger.as_slice() else {
            let mut groups = Vec::new();
            for all in trigger {
                for condition in all {
                    let is_edge = match condition.edge {
                        Edge::None => false,
                        Edge::Rising => self.holds(source, condition)?,
                        Edge::Falling | Edge::Either => true,
                    };
                    let reason = "what ceases to hold is read where there is one group of conditions";
                    source.refuse_if(is_edge, &condition.mark, reason)?;
                }
                if let Some(condition) = all.iter().find(|condition| needs_alone(condition)) {
                    return source.refuse(
                        &condition.mark,
                        "a `delay`, or a time that must pass, is read where there is one condition",
                    );
                }
                let parts: Option<Vec<Said>> = all.iter().map(|one| self.part(source, one)).collect();
                groups.push(Said::joined(parts?, " and "));
            }
            begins.once = (!groups.is_empty()).then(|| Said::joined(groups, " or "));
            return Some(begins);
        };
        let follows = |condition: &&Condition| match &condition.kind {
            When::Ended { kind, name } => self.before.iter().any(|event| is_called(event, kind, name)),
            _ => false,
        };
        let (own, others): (Vec<&Condition>, Vec<&Condition>) = all.iter().partition(follows);
        begins.after_s = own.iter().map(|condition| condition.delay_s).fold(0.0, f64::max);
        // The words of a phase would cut short what has to end first.
        begins.is_after = !own.is_empty() && others.iter().any(|one| one.kind != When::Always);
        if let [only] = others.as_slice() {
            let reason =
                "an event waits some time after another has ended, or for a moment, and not for both";
            let is_both = begins.after_s > 0.0 && only.kind != When::Always;
            source.refuse_if(is_both, &only.mark, reason)?;
            if !matches!(only.kind, When::After(_)) {
                begins.after_s += only.delay_s;
            }
            if let When::Stands { seconds, .. } = &only.kind {
                begins.held_s = *seconds;
            }
        } else if let Some(delayed) = others.iter().find(|condition| needs_alone(condition)) {
            return source.refuse(
                &delayed.mark,
                "a `delay`, or a time that must pass, is read where there is one condition",
            );
        }
        let mut parts = Vec::new();
        let mut first = Vec::new();
        for condition in others {
            let ceases =
                matches!(condition.edge, Edge::Falling | Edge::Either) && is_small_circle(&condition.kind);
            let reason = format!("that a place within {PASSED_M} m is left is not read");
            source.refuse_if(ceases, &condition.mark, reason)?;
            if condition.kind == When::Always {
                continue;
            }
            let part = self.part(source, condition)?;
            let not = Said::text("not (").then(part.clone()).and(")");
            // An edge needs the other side before it.
            let (before, then) = match (condition.edge, self.holds(source, condition)?) {
                (Edge::None, _) | (Edge::Rising, false) => (None, part),
                (Edge::Either, false) => (None, part),
                (Edge::Rising, true) => (Some(not), part),
                (Edge::Falling, false) => (Some(part), not),
                (Edge::Falling | Edge::Either, true) => (None, not),
            };
            first.extend(before);
            parts.push(then);
        }
        begins.first = (!first.is_empty()).then(|| Said::joined(first, " and "));
        begins.once = (!parts.is_empty()).then(|| Said::joined(parts, " and "));
        Some(begins)
    }

    fn part(&self, source: &mut Source, condition: &Condition) -> Option<Said> {
        let mark = &condition.mark;
        match &condition.kind {
            When::Always => Some(Said::text("elapsed >= ").number(0.0, "s")),
            When::Never => source.refuse(mark, "it never comes"),
            When::Contact(_) => source.refuse(mark, "what others do after a contact of two is not read"),
            When::After(seconds) => Some(Said::text("elapsed >= ").number(seconds + condition.delay_s, "s")),
            When::Headway { pair, seconds } => {
                let of = self.who(source, mark, &pair.of)?;
                let bound = Said::text(format!("{of}.speed * ")).number(*seconds, "s");
                let bound_m = self.cast.begins_mps(source, mark, &pair.of)? * seconds;
                self.is_along(source, mark, pair, Some(bound_m))?;
                self.is_beyond_doubt(source, mark, pair, bound_m)?;
                self.headway(source, mark, pair, &of, &bound)
            }
            When::Collides { pair, seconds } => {
                self.is_along(source, mark, pair, None)?;
                self.meet_along(source, mark, pair)?;
                let way = self.nearer(source, mark, pair)?;
                let is_behind = self.is_behind(source, mark, pair)?;
                let (back, front) = if is_behind { (&pair.of, &pair.to) } else { (&pair.to, &pair.of) };
                let looks = [back, front].map(|name| self.cast.looks_ahead(source, mark, name));
                let looks = (looks[0]?, looks[1]?);
                let (back, front) = (self.who(source, mark, back)?, self.who(source, mark, front)?);
                let closing = match looks {
                    (true, true) => format!("{back}.speed - {front}.speed"),
                    (true, false) => format!("{back}.speed + {front}.speed"),
                    (false, false) => format!("{front}.speed - {back}.speed"),
                    (false, true) => return source.refuse(mark, "the two drive away from each other"),
                };
                let said = way.clone().and(format!(" < ({closing}) * ")).number(*seconds, "s");
                // A road user that has passed the other one comes no nearer.
                Some(if self.is_first {
                    said
                } else {
                    said.and(" and ").then(way).and(" >= ").number(0.0, "m")
                })
            }
            When::Distance { pair, metres } => {
                let bound = Said::default().number(*metres, "m");
                self.is_along(source, mark, pair, Some(*metres))?;
                self.is_beyond_doubt(source, mark, pair, *metres)?;
                self.distance(source, mark, pair, &bound)
            }
            When::Apart { pair, metres } => {
                source.note("distances across the road are taken across the ego vehicle's route");
                let metres = metres + if pair.is_free_space { self.cast.half_widths_m(pair) } else { 0.0 };
                let is_just = (self.apart_m(source, mark, pair)? - metres).abs() < JUST_M;
                source.refuse_if(is_just, mark, AT_ITS_BOUND)?;
                let (of, to) = (self.who(source, mark, &pair.of)?, self.who(source, mark, &pair.to)?);
                let (above, below) = (pair.rule.symbol(), pair.rule.mirrored().symbol());
                let word = if asks_for_less(pair.rule) { "and" } else { "or" };
                let apart = || Said::text(format!("{of}.offset - {to}.offset "));
                let said = Said::text("(").then(apart()).and(format!("{above} ")).number(metres, "m");
                let other = apart().and(format!("{below} ")).number(-metres, "m").and(")");
                Some(said.and(format!(" {word} ")).then(other))
            }
            When::Clear(room) => self.clear(source, mark, room),
            When::Reaches { entity, position, within_m, is_less } => {
                self.cast.stays(source, &position.0)?;
                self.stays_beside(source, condition, entity)?;
                let point = self.cast.place(source, &position.0)?.pose.position;
                let (said, station_m) = self.station(source, mark, entity, point)?;
                let aside_m = self.aside_m(source, mark, entity, point)?;
                let less_m = within_m - (within_m * within_m - aside_m * aside_m).max(0.0).sqrt();
                let reason =
                    format!("the place is {aside_m:.1} m beside its way: only what is on it is read");
                source.refuse_if(aside_m > *within_m || less_m > ASIDE_M, mark, reason)?;
                if is_small_circle(&condition.kind) {
                    return Some(said.and(" >= ").number(station_m - within_m, "m"));
                }
                if *is_less {
                    let far = said.clone().and(" <= ").number(station_m + within_m, "m").and(")");
                    let near = Said::text("(").then(said).and(" >= ").number(station_m - within_m, "m");
                    return Some(near.and(" and ").then(far));
                }
                let before = Said::text("(").then(said.clone()).and(" < ").number(station_m - within_m, "m");
                Some(before.and(" or ").then(said).and(" > ").number(station_m + within_m, "m").and(")"))
            }
            When::Travelled { entity, metres } => {
                if self.cast.is_ego(entity) {
                    return Some(Said::text("ego.front >= ").number(EGO_FRONT_M + metres, "m"));
                }
                let who = self.who(source, mark, entity)?;
                let from_m = self.cast.moving(source, mark, entity)?.at_m;
                Some(Said::text(format!("{who}.station >= ")).number(from_m + metres, "m"))
            }
            When::Stands { entity, .. } => {
                let who = self.who(source, mark, entity)?;
                Some(Said::text(format!("{who}.speed <= ")).number(0.01, "m/s"))
            }
            When::Speed { entity, mps, rule } => {
                let who = self.who(source, mark, entity)?;
                Some(Said::text(format!("{who}.speed {} ", rule.symbol())).number(*mps, "m/s"))
            }
            When::Faster { of, to, mps, rule } => {
                let (of, to) = (self.who(source, mark, of)?, self.who(source, mark, to)?);
                Some(Said::text(format!("{of}.speed - {to}.speed {} ", rule.symbol())).number(*mps, "m/s"))
            }
            When::Nears { entity, position, seconds, is_free_space } => {
                self.cast.stays(source, &position.0)?;
                let point = self.cast.place(source, &position.0)?.pose.position;
                let (said, station_m) = self.station(source, mark, entity, point)?;
                let station_m = station_m - if *is_free_space { self.cast.front_m(entity) } else { 0.0 };
                let who = self.who(source, mark, entity)?;
                let said = said.and(format!(" + {who}.speed * ")).number(*seconds, "s");
                Some(said.and(" >= ").number(station_m, "m"))
            }
            When::Ended { kind, name } => self.ended(source, mark, kind, name),
            When::Begun { kind, name } => self.begun(source, mark, kind, name),
        }
    }

    /// That the lanes beside an entity are free.
    fn clear(&self, source: &mut Source, mark: &Mark, room: &Clearance) -> Option<Said> {
        let reason =
            "the room beside a road user is read only of a road user that drives the ego vehicle's way";
        let is_along = self.cast.looks_ahead(source, mark, &room.of)?;
        source.refuse_if(!is_along || self.cast.is_ego(&room.of), mark, reason)?;
        let beside = self.beside(source, mark, room)?;
        let own = self.who(source, mark, &room.of)?;
        // Where there are no such lanes there is no room.
        let mut nobody = Vec::new();
        if let Some(LanesBeside { from_m, to_m, .. }) = beside {
            let station = || Said::text(format!("{own}.station "));
            nobody.push(station().and(">= ").number(from_m, "m"));
            nobody.push(station().and("<= ").number(to_m, "m"));
        }
        for name in self.counted(source, mark, room)? {
            let ahead = self.between(source, mark, &room.of, &name, room.is_free_space)?;
            let behind = self.between(source, mark, &name, &room.of, room.is_free_space)?;
            let mut is_there = vec![
                ahead.and(" <= ").number(room.ahead_m, "m"),
                behind.and(" <= ").number(room.behind_m, "m"),
            ];
            if let Some(LanesBeside { right_m, left_m, .. }) = beside {
                let name = self.who(source, mark, &name)?;
                let aside = || Said::text(format!("{name}.offset - {own}.offset "));
                is_there.push(aside().and(">= ").number(right_m, "m"));
                is_there.push(aside().and("<= ").number(left_m, "m"));
            }
            nobody.push(Said::text("not (").then(Said::joined(is_there, " and ")).and(")"));
        }
        Some(match nobody.is_empty() {
            true => Said::text("elapsed >= ").number(0.0, "s"),
            false => Said::joined(nobody, " and "),
        })
    }

    /// The lanes that a condition about free room means; the inner `None` for all.
    pub fn beside(&self, source: &mut Source, mark: &Mark, room: &Clearance) -> Option<Option<LanesBeside>> {
        let Some(lanes) = room.lanes else { return Some(None) };
        self.cast.lanes_beside(source, mark, &room.of, lanes, room.has_oncoming).map(Some)
    }

    /// The names of the entities that count for a condition about free room.
    pub fn counted(&self, source: &mut Source, mark: &Mark, room: &Clearance) -> Option<Vec<String>> {
        let ahead = self.cast.looks_ahead(source, mark, &room.of)?;
        let mut counted = Vec::new();
        for name in self.cast.names().filter(|name| *name != room.of) {
            let is_meant = room.others.is_empty() || room.others.iter().any(|other| other == name);
            if is_meant && (room.has_oncoming || self.cast.looks_ahead(source, mark, name)? == ahead) {
                counted.push(name.to_owned());
            }
        }
        Some(counted)
    }

    /// That something has begun: what it waits for holds now. That it held earlier is not remembered.
    fn begun(&self, source: &mut Source, mark: &Mark, kind: &'static str, name: &str) -> Option<Said> {
        let Some((_, event)) = self.cast.last_event(kind, name) else {
            let reason =
                format!("what begins with `{name}` is not known here: the ego vehicle's, or the player's");
            return source.refuse(mark, reason);
        };
        let mut waits = false;
        for condition in event.when.iter().flatten() {
            waits |= needs_alone(condition)
                || matches!(condition.kind, When::Begun { .. } | When::Ended { .. })
                || matches!(condition.edge, Edge::Falling | Edge::Either)
                || condition.edge == Edge::Rising && self.holds(source, condition)?;
        }
        let reason = format!(
            "`{name}` waits for another event, for some time, or for what must first cease: when it begins is not read"
        );
        source.refuse_if(waits, mark, reason)?;
        let mut groups = Vec::new();
        for all in &event.when {
            let parts: Option<Vec<Said>> = all.iter().map(|one| self.part(source, one)).collect();
            groups.push(Said::joined(parts?, " and "));
        }
        match groups.is_empty() {
            true => Some(Said::text("elapsed >= ").number(0.0, "s")),
            false => Some(Said::text("(").then(Said::joined(groups, " or ")).and(")")),
        }
    }

    /// That an event of another road user, or an earlier one of the actor, has ended. For a speed this can be told only
    /// if the road user comes to that speed for the first time then.
    fn ended(&self, source: &mut Source, mark: &Mark, kind: &'static str, name: &str) -> Option<Said> {
        let Some((moving, event)) = self.cast.last_event(kind, name) else {
            let reason =
                format!("what ends with `{name}` is not known here: the ego vehicle's, or the player's");
            return source.refuse(mark, reason);
        };
        let who = if moving.entity.name == self.actor.entity.name { "npc" } else { moving.bearer.as_str() };
        let Some(act) = event.acts.last() else {
            return source.refuse(mark, format!("`{name}` does nothing that ends"));
        };
        match &act.kind {
            ActKind::Meet(meeting) => {
                let at_once = event.when.iter().all(|all| all.iter().all(|one| one.kind == When::Always));
                let is_cut = moving
                    .entity
                    .after(event)
                    .filter(|other| other.acts.iter().any(is_speed) || other.overwrites)
                    .any(|other| !other.waits_for_the_end_of(event));
                let reason = format!("whether `{name}` goes on until its place is reached is not known");
                source.refuse_if(!at_once || is_cut, mark, reason)?;
                let at_m = moving.reach_m(source, self.cast, &meeting.own_at)?;
                Some(Said::text(format!("{who}.station >= ")).number(at_m, "m"))
            }
            ActKind::Follow(way) => {
                let end_m = moving.leg(way)?.end_m;
                Some(Said::text(format!("{who}.station >= ")).number(end_m - ARRIVES_M, "m"))
            }
            ActKind::Speed(Speed::Absolute(mps), _) => {
                self.comes_to_once(source, mark, moving, event, *mps)?;
                Some(Said::text(format!("{who}.speed == ")).number(*mps, "m/s"))
            }
            _ => source.refuse(mark, format!("when `{name}` has ended is not read")),
        }
    }

    /// That the distance from an entity to another one ahead of it is less or more than a bound. There is no headway to
    /// an entity behind it, and none if it stands.
    fn headway(&self, source: &mut Source, mark: &Mark, pair: &Pair, of: &str, bound: &Said) -> Option<Said> {
        let (back, front) = match self.cast.looks_ahead(source, mark, &pair.of)? {
            true => (&pair.of, &pair.to),
            false => (&pair.to, &pair.of),
        };
        let way = self.between(source, mark, back, front, pair.is_free_space)?;
        let said = way.clone().and(format!(" {} ", pair.rule.symbol())).then(bound.clone());
        Some(match asks_for_less(pair.rule) {
            false => {
                Said::text("(").then(said).and(format!(" and {of}.speed > ")).number(0.0, "m/s").and(")")
            }
            true if self.is_first && self.is_ahead(source, mark, pair)? => said,
            true => {
                let nearest = match pair.is_free_space {
                    // Beside each other there is no room between the outlines, and no headway.
                    true => {
                        let (back, front) = (self.who(source, mark, back)?, self.who(source, mark, front)?);
                        Said::text(format!("{front}.front - {back}.rear"))
                    }
                    false => way,
                };
                said.and(" and ").then(nearest).and(" >= ").number(0.0, "m")
            }
        })
    }

    /// The distance of two, less or more than a bound. Less it becomes from the side from which the first one comes.
    fn distance(&self, source: &mut Source, mark: &Mark, pair: &Pair, bound: &Said) -> Option<Said> {
        let is_apart =
            self.cast.is_far_off(source, mark, &pair.of)? || self.cast.is_far_off(source, mark, &pair.to)?;
        if asks_for_less(pair.rule) && (self.is_first || is_apart) {
            let sign = format!(" {} ", pair.rule.symbol());
            return Some(self.nearer(source, mark, pair)?.and(sign).then(bound.clone()));
        }
        let (sign, word) =
            (format!(" {} ", pair.rule.symbol()), if asks_for_less(pair.rule) { " and " } else { " or " });
        let sides = [(&pair.of, &pair.to), (&pair.to, &pair.of)];
        let sides = sides.map(|(back, front)| {
            Some(self.between(source, mark, back, front, pair.is_free_space)?.and(&sign).then(bound.clone()))
        });
        let [ahead, behind] = sides;
        Some(Said::text("(").then(ahead?).and(word).then(behind?).and(")"))
    }

    /// Refuses a distance as the crow flies of two so far beside each other that the way along the road is another, where it is
    /// `bound_m` long.
    fn is_along(&self, source: &mut Source, mark: &Mark, pair: &Pair, bound_m: Option<f64>) -> Option<()> {
        if !pair.is_straight {
            return Some(());
        }
        if self.cast.is_far_off(source, mark, &pair.of)? || self.cast.is_far_off(source, mark, &pair.to)? {
            source.note(
                "distances as the crow flies of those who come from other roads are taken along the road",
            );
            return Some(());
        }
        let outlines_m = if pair.is_free_space { self.cast.half_widths_m(pair) } else { 0.0 };
        let aside_m = (self.apart_m(source, mark, pair)? - outlines_m).max(0.0);
        let is_short = |bound_m: f64| {
            aside_m > bound_m || bound_m - (bound_m * bound_m - aside_m * aside_m).sqrt() > ASIDE_M
        };
        let is_other = bound_m.map_or(aside_m > ASIDE_M, is_short);
        let reason = format!(
            "they begin {aside_m:.1} m beside each other, and distances are read along the road: `relativeDistanceType=\"longitudinal\"`"
        );
        source.refuse_if(is_other, mark, reason)
    }

    /// Refuses the time in which two meet of whom one goes across the way of the other.
    fn meet_along(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<()> {
        for name in [&pair.of, &pair.to] {
            let reason =
                format!("`{name}` goes across the road: a time to meet is read of those who go along it");
            let goes_across = self.cast.goes_across(source, mark, name)?;
            source.refuse_if(goes_across, mark, reason)?;
        }
        Some(())
    }

    /// Refuses a way that is just at its bound as the scenario begins, and stays there: whether it holds depends on the last digit.
    fn is_beyond_doubt(&self, source: &mut Source, mark: &Mark, pair: &Pair, bound_m: f64) -> Option<()> {
        let is_just = bound_m > 0.0
            && (self.away_m(source, mark, pair)? - bound_m).abs() < JUST_M
            && self.closes_mps(source, mark, pair)? == 0.0;
        source.refuse_if(is_just, mark, AT_ITS_BOUND)
    }

    /// Refuses a condition on the place of an entity that moves laterally on the way there: the place counts across, too.
    fn stays_beside(&self, source: &mut Source, condition: &Condition, entity: &str) -> Option<()> {
        if self.cast.is_ego(entity) {
            return Some(());
        }
        let events = &self.cast.moving(source, &condition.mark, entity)?.entity.events;
        // Actions after it has been there do not count.
        let waits = |event: &&Event| event.when.iter().flatten().any(|own| own.mark == condition.mark);
        let before = events.iter().take_while(|event| !waits(event));
        let moves_aside = before.flat_map(|event| &event.acts).any(is_aside);
        let reason = format!("`{entity}` moves aside: places are read of those that keep to their way");
        source.refuse_if(moves_aside, &condition.mark, reason)
    }

    /// The lateral distance of a point from the way of an entity, m.
    fn aside_m(&self, source: &mut Source, mark: &Mark, entity: &str, point: Vec2) -> Option<f64> {
        if self.cast.is_ego(entity) {
            return Some(self.cast.route.path.project(point).offset_m.abs());
        }
        let moving = self.cast.moving(source, mark, entity)?;
        Some((moving.path.project(point).offset_m - moving.offset_m).abs())
    }

    /// The way between two, from the side from which the first one comes.
    fn nearer(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<Said> {
        let (back, front) =
            if self.is_behind(source, mark, pair)? { (&pair.of, &pair.to) } else { (&pair.to, &pair.of) };
        self.between(source, mark, back, front, pair.is_free_space)
    }

    /// The way from one to another that is ahead of it along the ego vehicle's route: between outlines, or reference points.
    pub fn between(
        &self,
        source: &mut Source,
        mark: &Mark,
        back: &str,
        front: &str,
        is_free_space: bool,
    ) -> Option<Said> {
        let (from, to) = (self.who(source, mark, back)?, self.who(source, mark, front)?);
        // Places beside the ego vehicle's route say little of two that are far from it.
        if self.cast.is_far_off(source, mark, back)? || self.cast.is_far_off(source, mark, front)? {
            let Some((more_m, overhangs_m)) = self.cast.stations_apart_m(back, front) else {
                return source.refuse(mark, "the way between two on different roads is not known");
            };
            let more_m = if is_free_space { more_m - overhangs_m } else { more_m };
            return Some(Said::text(format!("{to}.station - {from}.station + ")).number(more_m, "m"));
        }
        let overhangs_m = self.cast.overhangs_m(source, mark, back, front)?;
        let said = Said::text(format!("{to}.rear - {from}.front"));
        Some(if is_free_space { said } else { said.and(" + ").number(overhangs_m, "m") })
    }

    /// The station of an entity in the language, and that of a point on the same way, m.
    pub fn station(
        &self,
        source: &mut Source,
        mark: &Mark,
        entity: &str,
        point: Vec2,
    ) -> Option<(Said, f64)> {
        if self.cast.is_ego(entity) {
            let station_m = self.cast.station_m(point) + EGO_FRONT_M;
            return Some((Said::text("ego.front"), station_m));
        }
        let who = self.who(source, mark, entity)?;
        let station_m = self.cast.moving(source, mark, entity)?.station_m(point);
        Some((Said::text(format!("{who}.station")), station_m))
    }

    /// The name of an entity in a phase of the actor.
    pub fn who(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<String> {
        self.cast.called(source, mark, self.actor, name)
    }
}

/// Whether a condition has a duration, which only a separate condition keeps.
fn needs_alone(condition: &Condition) -> bool {
    let is_time = matches!(condition.kind, When::After(_));
    condition.delay_s > 0.0 && !is_time
        || matches!(condition.kind, When::Stands { seconds, .. } if seconds > 0.0)
}

/// Whether a place is reached for a moment only.
fn is_small_circle(kind: &When) -> bool {
    matches!(kind, When::Reaches { within_m, is_less: true, .. } if *within_m < PASSED_M)
}
