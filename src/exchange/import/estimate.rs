//! Estimates of a trigger from how all entities begin: whether it holds then, and about when it comes.

use avastra_base::geometry::Vec2;

use super::across::LanesBeside;
use super::condition::Waiting;
use super::source::{Mark, Source};
use super::trigger::{Condition, Edge, Pair, PlaceMark, Trigger, When, asks_for_less};

impl Waiting<'_, '_> {
    /// Whether a condition holds at the beginning, as far as the speeds and places there say.
    pub fn holds(&self, source: &mut Source, condition: &Condition) -> Option<bool> {
        let mark = &condition.mark;
        Some(match &condition.kind {
            When::Distance { pair, metres } => {
                let away_m = self.away_m(source, mark, pair)?;
                pair.rule.holds(away_m, *metres)
            }
            When::Apart { pair, metres } => {
                let metres = metres + if pair.is_free_space { self.cast.half_widths_m(pair) } else { 0.0 };
                pair.rule.holds(self.apart_m(source, mark, pair)?, metres)
            }
            When::Clear(room) => {
                let beside = self.beside(source, mark, room)?;
                let here = self.cast.begins(source, mark, &room.of)?;
                let begins_m = self.cast.moving(source, mark, &room.of)?.at_m;
                let mut is_clear = beside.as_ref().is_none_or(|beside| beside.from_m <= begins_m);
                for name in self.counted(source, mark, room)? {
                    let there = self.cast.begins(source, mark, &name)?;
                    let ahead_m = self.cast.station_m(there) - self.cast.station_m(here);
                    let pair = |of: &str, to: &str| (of.to_owned(), to.to_owned());
                    let (back, front) =
                        if ahead_m >= 0.0 { pair(&room.of, &name) } else { pair(&name, &room.of) };
                    let outlines_m = match room.is_free_space {
                        true => self.cast.overhangs_m(source, mark, &back, &front)?,
                        false => 0.0,
                    };
                    let ahead_m = ahead_m.signum() * (ahead_m.abs() - outlines_m).max(0.0);
                    let offset_m = |point: Vec2| self.cast.route.path.project(point).offset_m;
                    let left_m = offset_m(there) - offset_m(here);
                    let is_in = |lanes: &LanesBeside| lanes.right_m <= left_m && left_m <= lanes.left_m;
                    let is_beside = beside.as_ref().is_none_or(is_in);
                    is_clear &= !(is_beside && -room.behind_m <= ahead_m && ahead_m <= room.ahead_m);
                }
                is_clear
            }
            When::Headway { pair, seconds } => {
                let away_m = self.away_m(source, mark, pair)?;
                let mps = self.cast.begins_mps(source, mark, &pair.of)?;
                self.is_ahead(source, mark, pair)? && mps > 0.0 && pair.rule.holds(away_m, mps * seconds)
            }
            When::Collides { pair, seconds } => {
                self.away_m(source, mark, pair)? < self.closes_mps(source, mark, pair)? * seconds
            }
            When::Speed { entity, mps, rule } => {
                rule.holds(self.cast.begins_mps(source, mark, entity)?, *mps)
            }
            When::Faster { of, to, mps, rule } => {
                let of_mps = self.cast.begins_mps(source, mark, of)?;
                let by_mps = of_mps - self.cast.begins_mps(source, mark, to)?;
                rule.holds(by_mps, *mps)
            }
            When::Reaches { entity, position, within_m, is_less } => {
                let ahead_m = self.ahead_m(source, mark, entity, position)?;
                (ahead_m.abs() <= *within_m) == *is_less
            }
            When::Nears { entity, position, seconds, is_free_space } => {
                let way_m = self.cast.begins_mps(source, mark, entity)? * seconds;
                let front_m = if *is_free_space { self.cast.front_m(entity) } else { 0.0 };
                self.ahead_m(source, mark, entity, position)? - front_m <= way_m
            }
            When::Travelled { metres, .. } => *metres <= 0.0,
            When::Always => true,
            When::Never
            | When::Contact(_)
            | When::After(_)
            | When::Stands { .. }
            | When::Ended { .. }
            | When::Begun { .. } => false,
        })
    }

    /// When a trigger comes if all entities go on as they begin, s. Infinity means never, and `None` that it is not
    /// known. `known`: when something of the story begins or ends.
    pub fn comes_s(
        &self,
        source: &mut Source,
        trigger: &Trigger,
        known: &dyn Fn(&When) -> Option<f64>,
    ) -> Option<f64> {
        let mut first_s: f64 = if trigger.is_empty() { 0.0 } else { f64::INFINITY };
        for all in trigger {
            let mut comes_s: f64 = 0.0;
            for condition in all {
                let own_s = match (&condition.kind, condition.edge) {
                    (when @ (When::Ended { .. } | When::Begun { .. }), _) => known(when)?,
                    (When::After(seconds), Edge::None | Edge::Rising) => *seconds,
                    (_, Edge::None) => self.holds_from_s(source, condition)?,
                    // A condition that must first cease does so at a time that the beginning does not say.
                    (_, Edge::Rising) if !self.holds(source, condition)? => {
                        self.holds_from_s(source, condition)?
                    }
                    _ => return None,
                };
                comes_s = comes_s.max(own_s + condition.delay_s);
            }
            first_s = first_s.min(comes_s);
        }
        Some(first_s)
    }

    /// When a condition holds for the first time, as [`Self::comes_s`].
    fn holds_from_s(&self, source: &mut Source, condition: &Condition) -> Option<f64> {
        let mark = &condition.mark;
        let gap = |source: &mut Source, pair: &Pair, bound_m: f64| {
            let closes_mps = self.closes_mps(source, mark, pair)?;
            let away_m = self.away_m(source, mark, pair)?;
            Some(match asks_for_less(pair.rule) {
                _ if pair.rule.holds(away_m, bound_m) => 0.0,
                true => takes_s(away_m - bound_m, closes_mps),
                false if closes_mps > 0.0 => (away_m + bound_m) / closes_mps,
                false => takes_s(bound_m - away_m, -closes_mps),
            })
        };
        match &condition.kind {
            When::Distance { pair, metres } => gap(source, pair, *metres),
            When::Headway { pair, seconds } => {
                let bound_m = self.cast.begins_mps(source, mark, &pair.of)? * seconds;
                if self.is_ahead(source, mark, pair)? {
                    return gap(source, pair, bound_m);
                }
                // It must first be passed.
                let more_m = if asks_for_less(pair.rule) { 0.0 } else { bound_m };
                Some(takes_s(self.away_m(source, mark, pair)? + more_m, self.closes_mps(source, mark, pair)?))
            }
            When::Travelled { entity, metres } => {
                Some(takes_s(*metres, self.cast.begins_mps(source, mark, entity)?))
            }
            When::Reaches { entity, position, within_m, is_less: true } => {
                let way_m = (self.ahead_m(source, mark, entity, position)? - within_m).max(0.0);
                Some(takes_s(way_m, self.cast.begins_mps(source, mark, entity)?))
            }
            When::Stands { entity, seconds } => {
                let stands = self.cast.begins_mps(source, mark, entity)? == 0.0;
                Some(if stands { *seconds } else { f64::INFINITY })
            }
            When::Speed { .. } | When::Faster { .. } | When::Always => {
                Some(if self.holds(source, condition)? { 0.0 } else { f64::INFINITY })
            }
            When::Never => Some(f64::INFINITY),
            _ => None,
        }
    }

    /// The least time, s, in which a distance of the actor that does not come to hold by itself does so while the actor drives at speeds
    /// in this range; `None` if that is not known.
    pub fn takes_at_least_s(
        &self,
        source: &mut Source,
        trigger: &Trigger,
        (slowest_mps, fastest_mps): (f64, f64),
    ) -> Option<f64> {
        let [all] = trigger.as_slice() else { return None };
        let mut own = all.iter().filter(|condition| condition.kind != When::Always);
        let Some(Condition { kind: When::Distance { pair, metres }, mark, .. }) = own.next() else {
            return None;
        };
        let actor = &self.actor.entity.name;
        let other = if pair.of == *actor { &pair.to } else { &pair.of };
        let is_own = (pair.of == *actor) != (pair.to == *actor);
        let along = |source: &mut Source, name: &str| self.cast.looks_ahead(source, mark, name);
        if !is_own || !along(source, &pair.of)? || !along(source, &pair.to)? {
            return None;
        }
        let other_mps = self.cast.begins_mps(source, mark, other)?;
        let is_behind = self.is_behind(source, mark, pair)? == (pair.of == *actor);
        let away_m = self.away_m(source, mark, pair)?;
        let (closes_mps, parts_mps) = match is_behind {
            true => (fastest_mps - other_mps, other_mps - slowest_mps),
            false => (other_mps - slowest_mps, fastest_mps - other_mps),
        };
        Some(match asks_for_less(pair.rule) {
            true => takes_s(away_m - metres, closes_mps),
            false => takes_s(away_m + metres, closes_mps).min(takes_s(metres - away_m, parts_mps)),
        })
    }

    /// When an entity comes to a place, as [`Self::comes_s`].
    pub fn is_at_s(&self, source: &mut Source, mark: &Mark, entity: &str, place: &PlaceMark) -> Option<f64> {
        let (way_m, mps) =
            (self.ahead_m(source, mark, entity, place)?, self.cast.begins_mps(source, mark, entity)?);
        (way_m > 0.0 && mps > 0.0).then(|| way_m / mps)
    }

    /// How fast two come nearer to each other as they begin, m/s; below 0 they part.
    pub fn closes_mps(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<f64> {
        let (of_mps, to_mps) =
            (self.along_mps(source, mark, &pair.of)?, self.along_mps(source, mark, &pair.to)?);
        Some(if self.is_behind(source, mark, pair)? { of_mps - to_mps } else { to_mps - of_mps })
    }

    /// The speed of an entity along the ego vehicle's route at the beginning, m/s; below 0 against it.
    fn along_mps(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<f64> {
        let mps = self.cast.begins_mps(source, mark, name)?;
        Some(if self.cast.looks_ahead(source, mark, name)? { mps } else { -mps })
    }

    /// How far a place is ahead of an entity at the beginning, m.
    fn ahead_m(&self, source: &mut Source, mark: &Mark, entity: &str, place: &PlaceMark) -> Option<f64> {
        let point = self.cast.place(source, &place.0)?.pose.position;
        let begins = self.cast.begins(source, mark, entity)?;
        let (_, station_m) = self.station(source, mark, entity, point)?;
        Some(station_m - self.station(source, mark, entity, begins)?.1)
    }

    /// How far two are from each other across the ego vehicle's route at the beginning, m.
    pub fn apart_m(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<f64> {
        let [of, to] = [&pair.of, &pair.to].map(|name| self.cast.begins(source, mark, name));
        let offset_m = |point: Vec2| self.cast.route.path.project(point).offset_m;
        Some((offset_m(of?) - offset_m(to?)).abs())
    }

    /// How far two are from each other at the beginning, m.
    pub fn away_m(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<f64> {
        let (of, to) = (self.cast.begins(source, mark, &pair.of)?, self.cast.begins(source, mark, &pair.to)?);
        let away_m = (self.cast.station_m(of) - self.cast.station_m(to)).abs();
        if !pair.is_free_space {
            return Some(away_m);
        }
        let (back, front) =
            if self.is_behind(source, mark, pair)? { (&pair.of, &pair.to) } else { (&pair.to, &pair.of) };
        Some((away_m - self.cast.overhangs_m(source, mark, back, front)?).max(0.0))
    }

    /// Whether the second of two begins ahead of the first, as that looks.
    pub fn is_ahead(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<bool> {
        Some(self.is_behind(source, mark, pair)? == self.cast.looks_ahead(source, mark, &pair.of)?)
    }

    /// Whether the first of two begins behind the second along the ego vehicle's route.
    pub fn is_behind(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<bool> {
        let (of, to) = (self.cast.begins(source, mark, &pair.of)?, self.cast.begins(source, mark, &pair.to)?);
        Some(self.cast.station_m(of) < self.cast.station_m(to))
    }
}

/// How long a way takes at a speed, s; infinity if it does not lead there.
fn takes_s(way_m: f64, mps: f64) -> f64 {
    if mps > 0.0 { way_m / mps } else { f64::INFINITY }
}
