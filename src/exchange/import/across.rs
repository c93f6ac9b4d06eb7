//! Places across the road: other lanes, offsets in them, and the speed of lateral moves.

use avastra_base::geometry::{SMOOTH_STEP_SLOPE_MAX, wrap_angle};
use avastra_lang::model::OFFSET_M;
use avastra_road::{Lane, LanePlace, Side};

use super::action::{Dynamics, Over, Target};
use super::cast::{Cast, Moving};
use super::order::is_aside;
use super::phases::{Told, instead_of};
use super::said::Said;
use super::source::{Mark, Source};

/// The largest lateral speed of an order, m/s.
const ASIDE_MPS_MAX: f64 = 10.0;

/// A lateral move that is faster than this part of an entity's speed makes it markedly slower along its way in the
/// file's player.
const SLOW_PART: f64 = 0.15;

/// A way is looked at in such steps for the roads that it leads over, m.
const ROADS_M: f64 = 10.0;

/// A way is looked at in such steps for lanes beside it, m.
const LOOK_M: f64 = 0.5;

/// Lanes beside a road user's lane along a stretch of its way.
pub struct LanesBeside {
    /// Stations of its way, m.
    pub from_m: f64,
    pub to_m: f64,
    /// Where they begin and end across the road, m to its left.
    pub right_m: f64,
    pub left_m: f64,
}

impl<'a> Cast<'a> {
    /// Turns a distance to the left in the road's direction into one to the left of a road user in a lane, on its way.
    pub fn left_m(&self, moving: &Moving, told: &Told, left_m: f64) -> f64 {
        let Some(place) = told.lane else { return left_m };
        let is_along = self.map.lane(place.lane).is_along();
        if self.goes_with_lane(moving, told.at_m, place) == is_along { left_m } else { -left_m }
    }

    /// Whether a road user drives in the direction of a lane that it is in.
    fn goes_with_lane(&self, moving: &Moving, at_m: f64, place: LanePlace) -> bool {
        let lane_rad = self.map.lane(place.lane).centre.heading_at(place.station_m);
        wrap_angle(moving.path.heading_at(at_m) - lane_rad).abs() < core::f64::consts::FRAC_PI_2
    }

    /// Whether the lanes of all roads ahead on a road user's way agree in a property, as far as steps of [`ROADS_M`]
    /// show.
    pub fn are_lanes_alike<K: PartialEq>(
        &self,
        moving: &Moving,
        told: &Told,
        of: impl Fn(&Lane) -> K,
    ) -> bool {
        let Some(own) = told.lane.map(|place| self.map.lane(place.lane)) else { return true };
        if self.map.lanes.iter().all(|lane| lane.key.road == own.key.road) {
            return true;
        }
        let steps = ((moving.path.length_m() - told.at_m) / ROADS_M) as usize;
        (0..=steps).all(|step| {
            let pose = moving.path.pose_at(told.at_m + step as f64 * ROADS_M);
            let lane = self.places.borrow().in_plane(pose).lane;
            lane.is_none_or(|place| of(self.map.lane(place.lane)) == of(own))
        })
    }

    /// The lateral place on its way at which a road user is `more_m` to the left of another one: as both begin, and as
    /// both are then.
    pub fn beside(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        name: &str,
        more_m: f64,
        told: &Told,
    ) -> Option<(f64, Said)> {
        let reason = "to be beside another one is read before the first trajectory";
        source.refuse_if(told.at_m > moving.at_m, mark, reason)?;
        let other = self.begins(source, mark, name)?;
        let own = moving.placed.pose;
        let along = self.route.path.project(own.position);
        let turned_rad = wrap_angle(own.heading_rad - self.route.path.heading_at(along.station_m));
        let reason = "to be beside another one is read of those that drive along the ego vehicle's way";
        source.refuse_if(turned_rad.abs() > 1.0, mark, reason)?;
        let of = self.called(source, mark, moving, name)?;
        let away_m = self.route.path.project(other).offset_m - along.offset_m;
        let said = Said::text(format!("{of}.offset - npc.offset + ")).number(told.offset_m + more_m, "m");
        Some((moving.offset_m + away_m + more_m, said))
    }

    /// How far to the left of its way a lane lies, m.
    pub fn lane_offset_m(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        target: &Target,
        told: &mut Told,
    ) -> Option<f64> {
        let Some(own) = told.lane else { return source.refuse(mark, "it drives in no lane") };
        let to = match target {
            Target::Beside(name, lanes) => {
                let (of, goes_with) = match () {
                    () if *name == moving.entity.name => (own, self.goes_with_lane(moving, told.at_m, own)),
                    () => {
                        let placed = self.places.borrow_mut().of(source, mark, name)?;
                        let Some(lane) = placed.lane else {
                            return source.refuse(mark, "that one is in no lane");
                        };
                        let other = self.moving.iter().find(|other| other.entity.name == *name);
                        let acts =
                            other.iter().flat_map(|other| &other.entity.events).flat_map(|event| &event.acts);
                        let reason =
                            format!("`{name}` moves aside: in which lane it is by then is not known");
                        source.refuse_if(acts.into_iter().any(is_aside), mark, reason)?;
                        if self.is_ego(name) {
                            source.note("lanes beside the ego vehicle are those beside where it begins");
                        }
                        (lane, other.is_none_or(|other| self.goes_with_lane(other, other.at_m, lane)))
                    }
                };
                // Beside this one, wherever the other one is along the road.
                self.lane_beside(own, of, if goes_with { *lanes } else { -*lanes })
            }
            Target::Lane(id) => {
                let are_alike = self.are_lanes_alike(moving, told, |lane| (lane.key.lane, lane.is_along()));
                let reason = "its way leads over roads on which its lanes have other numbers, and on which of them it is by then is not known";
                source.refuse_if(!are_alike, mark, reason)?;
                let lane = self.map.lane(own.lane);
                let s_m = lane.road_station_m(own.station_m);
                self.map.place(&lane.key.road, *id, s_m).ok()
            }
        };
        let Some(to) = to else { return source.refuse(mark, "no such lane is beside its own") };
        (told.lane, told.lane_m) = (Some(to), self.aside_m(moving, told.at_m, to));
        Some(told.lane_m)
    }

    /// Lanes to the left of a road user's lane, where it comes to the first stretch of its way that has any of them.
    /// Lanes of the other direction count if they are asked for.
    pub fn lanes_beside(
        &self,
        source: &mut Source,
        mark: &Mark,
        name: &str,
        (from, to): (i32, i32),
        has_oncoming: bool,
    ) -> Option<LanesBeside> {
        let moving = self.moving(source, mark, name)?;
        // Each beside a station of its way: how far to the left its middle lies, and half its width.
        let lanes_at = |at_m: f64| -> Vec<(f64, f64)> {
            let Some(own) = self.places.borrow().in_plane(moving.path.pose_at(at_m)).lane else {
                return Vec::new();
            };
            let is_along = self.map.lane(own.lane).is_along();
            let beside = (from..=to).filter_map(|lanes| self.lane_beside(own, own, lanes));
            let beside =
                beside.filter(|lane| has_oncoming || self.map.lane(lane.lane).is_along() == is_along);
            let own_m = self.aside_m(moving, at_m, own);
            let width_m = |lane: &LanePlace| self.map.lane(lane.lane).width_at(lane.station_m);
            beside.map(|lane| (self.aside_m(moving, at_m, lane) - own_m, width_m(&lane) / 2.0)).collect()
        };
        let steps = ((moving.path.length_m() - moving.at_m) / LOOK_M) as usize;
        let stations = || (0..=steps).map(|step| moving.at_m + step as f64 * LOOK_M);
        let mut has_some = stations().skip_while(|at_m| lanes_at(*at_m).is_empty());
        let Some(from_m) = has_some.next() else {
            return source.refuse(mark, "no such lane is beside its own");
        };
        let to_m = has_some.take_while(|at_m| !lanes_at(*at_m).is_empty()).last().unwrap_or(from_m);
        let found = lanes_at((from_m + to_m) / 2.0);
        let right_m = found.iter().map(|(middle_m, half_m)| middle_m - half_m).fold(f64::INFINITY, f64::min);
        let left_m =
            found.iter().map(|(middle_m, half_m)| middle_m + half_m).fold(f64::NEG_INFINITY, f64::max);
        Some(LanesBeside { from_m, to_m, right_m, left_m })
    }

    /// How far to the left of a station of a road user's way the middle of a lane lies, m.
    pub fn aside_m(&self, moving: &Moving, at_m: f64, lane: LanePlace) -> f64 {
        let here = moving.path.pose_at(at_m);
        let centre = &self.map.lane(lane.lane).centre;
        here.to_local(centre.position_at(centre.project(here.position).station_m)).y
    }

    /// The lane that is so many lanes to the left of another's, beside a place.
    fn lane_beside(&self, own: LanePlace, of: LanePlace, lanes: i32) -> Option<LanePlace> {
        let (own_key, of_key) = (&self.map.lane(own.lane).key, &self.map.lane(of.lane).key);
        if own_key.road == of_key.road {
            let s_m = self.map.lane(own.lane).road_station_m(own.station_m);
            // Numbers rise to the left of the road, which is to the right of a vehicle that drives against it.
            let lanes = if self.map.lane(of.lane).is_along() { lanes } else { -lanes };
            let mut id = of_key.lane + lanes;
            // Lanes have no number 0.
            if (of_key.lane < 0) != (id < 0) || id == 0 {
                id += lanes.signum();
            }
            return self.map.place(&own_key.road, id, s_m).ok();
        }
        let mut lane = own.lane;
        let side = if lanes > 0 { Side::Left } else { Side::Right };
        for _ in 0..lanes.abs() {
            lane = self.map.lane(lane).neighbour(side)?.lane;
        }
        Some(LanePlace { lane, ..own })
    }
}

/// The fields of a move to a place across.
pub fn aside_fields(
    source: &mut Source,
    mark: &Mark,
    to_m: f64,
    to: Said,
    dynamics: Dynamics,
    told: &mut Told,
    fields: &mut Vec<Said>,
) -> Option<()> {
    if matches!(dynamics.over, Over::Never) {
        source.note("who moves aside at 0 m/s stays where it is");
        return Some(());
    }
    let by_m = (to_m - told.offset_m).abs();
    let (low_m, high_m) = (OFFSET_M.start(), OFFSET_M.end());
    let reason = format!("it moves to {to_m:.1} m beside its way: {low_m} to {high_m} m is possible");
    source.refuse_if(!OFFSET_M.contains(&to_m), mark, reason)?;
    told.offset_m = to_m;
    if by_m < 1e-6 {
        return Some(());
    }
    instead_of(fields, &["offset", "aside"]);
    fields.push(Said::text("offset: ").then(to));
    if !matches!(dynamics.over, Over::AtOnce) {
        source.note("who moves aside needs the file's time for it, and is faster in the middle than by a sine, up to a fifth");
    }
    let slope = SMOOTH_STEP_SLOPE_MAX;
    let aside_mps = match dynamics.over {
        Over::AtOnce | Over::Never => ASIDE_MPS_MAX,
        Over::Time(time_s) => slope * by_m / time_s,
        // By the greatest acceleration, along a cosine: `T = π √(d / 2a)`.
        Over::Rate(mps) if mps < 0.0 => slope * by_m / (core::f64::consts::PI * (by_m / (2.0 * -mps)).sqrt()),
        Over::Rate(mps) => slope * mps / dynamics.peak,
        Over::Way(way_m) => {
            source.note("who moves aside over a way does so by the speed with which it begins");
            fields.push(Said::text("aside: npc.speed * ").number(slope * by_m / way_m, ""));
            return Some(());
        }
    };
    if aside_mps > ASIDE_MPS_MAX || matches!(dynamics.over, Over::AtOnce) {
        source.note(format!("no road user moves sideways faster than {ASIDE_MPS_MAX} m/s"));
    }
    if told.mps.is_none_or(|mps| aside_mps > SLOW_PART * mps) {
        source.note("who moves aside, or brakes while it does, keeps its speed along its way, and is up to a metre or two ahead");
    }
    fields.push(Said::text("aside: ").number(aside_mps.clamp(0.1, ASIDE_MPS_MAX), "m/s"));
    Some(())
}
