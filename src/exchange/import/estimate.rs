//! What is known of a trigger from how everybody begins: whether it holds then, and about when it comes.

use avastra_base::geometry::Vec2;

use super::across::LanesBeside;
use super::condition::Waiting;
use super::source::{Mark, Source};
use super::trigger::{Condition, Edge, Pair, PlaceMark, Trigger, When};

impl Waiting<'_, '_> {
    /// Whether a condition holds at the beginning, as far as the speeds and places there say.
    pub fn holds(&self, source: &mut Source, condition: &Condition) -> Option<bool> {
        let mark = &condition.mark;
        Some(match &condition.kind {
            When::Distance { pair, metres } => {
                let away_m = self.away_m(source, mark, pair)?;
                if pair.is_less { away_m < *metres } else { away_m > *metres }
            }
            When::Apart { pair, metres } => {
                let of = self.cast.begins(source, mark, &pair.of)?;
                let to = self.cast.begins(source, mark, &pair.to)?;
                let offset_m = |point: Vec2| self.cast.route.path.project(point).offset_m;
                let metres = metres + if pair.is_free_space { self.cast.half_widths_m(pair) } else { 0.0 };
                let apart_m = (offset_m(of) - offset_m(to)).abs();
                if pair.is_less { apart_m < metres } else { apart_m > metres }
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
                        true => {
                            self.cast.overhang_m(source, mark, &front, false)?
                                + self.cast.overhang_m(source, mark, &back, true)?
                        }
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
                let bound_m = self.cast.begins_mps(source, mark, &pair.of)? * seconds;
                if pair.is_less { away_m < bound_m } else { away_m > bound_m }
            }
            When::Collides { pair, seconds } => {
                self.away_m(source, mark, pair)? < self.closes_mps(source, mark, pair)? * seconds
            }
            When::Speed { entity, mps, is_less } => {
                let begins_mps = self.cast.begins_mps(source, mark, entity)?;
                if *is_less { begins_mps < *mps } else { begins_mps > *mps }
            }
            When::Faster { of, to, mps, is_less } => {
                let of_mps = self.cast.begins_mps(source, mark, of)?;
                let by_mps = of_mps - self.cast.begins_mps(source, mark, to)?;
                if *is_less { by_mps < *mps } else { by_mps > *mps }
            }
            When::Reaches { entity, position, within_m, is_less } => {
                let ahead_m = self.ahead_m(source, mark, entity, position)?;
                (ahead_m.abs() <= *within_m) == *is_less
            }
            When::Nears { entity, position, seconds } => {
                let way_m = self.cast.begins_mps(source, mark, entity)? * seconds;
                self.ahead_m(source, mark, entity, position)? <= way_m
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

    /// When a trigger comes if everybody goes on as they begin, s; `None` if that is not known.
    pub fn comes_s(&self, source: &mut Source, trigger: &Trigger) -> Option<f64> {
        let mut first_s: f64 = if trigger.is_empty() { 0.0 } else { f64::INFINITY };
        for all in trigger {
            let mut comes_s: f64 = 0.0;
            for condition in all {
                comes_s = comes_s.max(self.condition_comes_s(source, condition)? + condition.delay_s);
            }
            first_s = first_s.min(comes_s);
        }
        first_s.is_finite().then_some(first_s)
    }

    /// As [`Self::comes_s`], of one condition, without its delay.
    fn condition_comes_s(&self, source: &mut Source, condition: &Condition) -> Option<f64> {
        let mark = &condition.mark;
        let gap = |source: &mut Source, pair: &Pair, bound_m: f64| {
            let closes_mps = self.closes_mps(source, mark, pair)?;
            let away_m = self.away_m(source, mark, pair)?;
            match pair.is_less {
                true if away_m <= bound_m => Some(0.0),
                true => (closes_mps > 0.0).then(|| (away_m - bound_m) / closes_mps),
                false if away_m >= bound_m => (condition.edge == Edge::None).then_some(0.0),
                false if closes_mps > 0.0 => Some((away_m + bound_m) / closes_mps),
                false => (closes_mps < 0.0).then(|| (bound_m - away_m) / -closes_mps),
            }
        };
        match &condition.kind {
            When::Always => Some(0.0),
            When::After(seconds) => Some(*seconds),
            When::Distance { pair, metres } => gap(source, pair, *metres),
            When::Headway { pair, seconds } => {
                let bound_m = self.cast.begins_mps(source, mark, &pair.of)? * seconds;
                gap(source, pair, bound_m)
            }
            When::Travelled { entity, metres } => {
                let mps = self.cast.begins_mps(source, mark, entity)?;
                (mps > 0.0).then(|| metres / mps)
            }
            When::Reaches { entity, position, within_m, is_less: true } => {
                let mps = self.cast.begins_mps(source, mark, entity)?;
                let way_m = (self.ahead_m(source, mark, entity, position)? - within_m).max(0.0);
                (mps > 0.0).then(|| way_m / mps)
            }
            _ => None,
        }
    }

    /// How fast two come nearer to each other as they begin, m/s.
    fn closes_mps(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<f64> {
        let of_mps = self.cast.begins_mps(source, mark, &pair.of)?;
        let to_mps = self.cast.begins_mps(source, mark, &pair.to)?;
        Some(match self.is_behind(source, mark, pair)? {
            _ if self.face_each_other(source, mark, pair)? => of_mps + to_mps,
            true => of_mps - to_mps,
            false => to_mps - of_mps,
        })
    }

    /// How far a place is ahead of somebody at the beginning, m.
    fn ahead_m(&self, source: &mut Source, mark: &Mark, entity: &str, place: &PlaceMark) -> Option<f64> {
        let point = self.cast.place(source, &place.0)?.pose.position;
        let begins = self.cast.begins(source, mark, entity)?;
        let (_, station_m) = self.station(source, mark, entity, point)?;
        Some(station_m - self.station(source, mark, entity, begins)?.1)
    }

    /// Whether two look against each other as they begin.
    pub fn face_each_other(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<bool> {
        let [of, to] = [&pair.of, &pair.to].map(|name| self.cast.looks_ahead(source, mark, name));
        Some(of? != to?)
    }

    /// How far two are from each other at the beginning, m.
    fn away_m(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<f64> {
        let (of, to) = (self.cast.begins(source, mark, &pair.of)?, self.cast.begins(source, mark, &pair.to)?);
        let away_m = (self.cast.station_m(of) - self.cast.station_m(to)).abs();
        if !pair.is_free_space {
            return Some(away_m);
        }
        let (back, front) =
            if self.is_behind(source, mark, pair)? { (&pair.of, &pair.to) } else { (&pair.to, &pair.of) };
        let less_m = self.cast.overhang_m(source, mark, front, false)?
            + self.cast.overhang_m(source, mark, back, true)?;
        Some((away_m - less_m).max(0.0))
    }

    /// Whether the first of two begins behind the second along the ego vehicle's route.
    pub fn is_behind(&self, source: &mut Source, mark: &Mark, pair: &Pair) -> Option<bool> {
        let (of, to) = (self.cast.begins(source, mark, &pair.of)?, self.cast.begins(source, mark, &pair.to)?);
        Some(self.cast.station_m(of) < self.cast.station_m(to))
    }
}
