//! The path beside the guide: a shift within the lane past vehicles that stand at its edge, and the way back
//! from a lane change that was broken off.
//!
//! Apollo's path bounds keep 0.4 m from static obstacles, 3 m before and 2 m behind them (here `lateral_buffer_m`); its
//! piecewise-jerk optimiser is replaced by a quintic shift of bounded lateral acceleration. Vehicles that stand
//! in a row are passed as one. Pedestrians and moving road users are not passed in this way. Left out is lane
//! borrowing, a shift into the next lane: behind what stands, the stop gap leaves no room to turn out of the lane.

use crate::kit::{Aside, Guide};
use avastra_base::geometry::{Span, extent_m, smooth_step};
use avastra_world::sim::{Scene, VehicleParameters};

use super::super::config::PlanningConfig;
use super::super::prediction::Forecast;
use super::HORIZON_M;

/// Apollo's `obstacle_lon_start_buffer` and `obstacle_lon_end_buffer`, m.
const BEFORE_M: f64 = 3.0;
const BEHIND_M: f64 = 2.0;
/// Where there is no room for that, the shift may go on until the bumper is so near, m.
const BEFORE_M_MIN: f64 = 0.5;
/// Lateral acceleration of the shift, m/s², and its least length, m. Ours.
const LATERAL_MPS2: f64 = 1.5;
const LENGTH_M_MIN: f64 = 5.0;
/// Room left to the edge of the lane, m. Ours.
const EDGE_M: f64 = 0.1;
/// Vehicles that stand so near behind one another are passed as one, m. Ours.
const ROW_GAP_M: f64 = 15.0;
/// The way back from a lane change that was broken off: its time, s, and its least length, m. Ours.
const RETURN_S: f64 = 2.5;
const RETURN_M_MIN: f64 = 10.0;

/// Where the path lies beside the guide.
#[derive(Debug, Clone, Default)]
pub struct LateralPlan {
    bump: Option<Bump>,
    /// All that is passed, the first of them first.
    row: Vec<u32>,
    /// Objects of the row that reach into the shifted way now, because they have moved or were not where they
    /// seemed: the vehicle stops for them.
    met: Vec<u32>,
    way_back: Option<WayBack>,
}

/// The way back to the guide from a place beside it: a cubic that begins with the slope of the way before.
#[derive(Debug, Clone, Copy)]
struct WayBack {
    from_m: f64,
    length_m: f64,
    offset_m: f64,
    slope: f64,
}

impl WayBack {
    fn aside(&self, station_m: f64) -> Aside {
        let t = ((station_m - self.from_m) / self.length_m).clamp(0.0, 1.0);
        let (offset_m, rise_m) = (self.offset_m, self.slope * self.length_m);
        let value_m = offset_m * (1.0 - t * t * (3.0 - 2.0 * t)) + rise_m * t * (1.0 - t) * (1.0 - t);
        if station_m < self.from_m || t >= 1.0 {
            return Aside { offset_m: value_m, ..Aside::default() };
        }
        let slope_m = 6.0 * offset_m * t * (t - 1.0) + rise_m * (1.0 - t) * (1.0 - 3.0 * t);
        let bend_m = 6.0 * offset_m * (2.0 * t - 1.0) + rise_m * (6.0 * t - 4.0);
        Aside {
            offset_m: value_m,
            slope: slope_m / self.length_m,
            curvature_per_m: bend_m / (self.length_m * self.length_m),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Bump {
    id: u32,
    /// The stretch of the guide that the passed objects take.
    span: Span,
    offset_m: f64,
    /// Stations of the rear axle at which the shift begins and is complete, and at which it begins to
    /// end and has ended, m.
    up_m: (f64, f64),
    down_m: (f64, f64),
}

/// A standing object, and how far it reaches across the way.
struct Edge {
    id: u32,
    span: Span,
    right_m: f64,
    left_m: f64,
}

impl Edge {
    /// This edge and another as one.
    fn with(&self, other: &Edge) -> Edge {
        Edge {
            id: self.id,
            span: Span {
                from_m: self.span.from_m.min(other.span.from_m),
                to_m: self.span.to_m.max(other.span.to_m),
            },
            right_m: self.right_m.min(other.right_m),
            left_m: self.left_m.max(other.left_m),
        }
    }
}

impl LateralPlan {
    pub fn aside(&self, station_m: f64) -> Aside {
        if let Some(way_back) = &self.way_back {
            return way_back.aside(station_m);
        }
        let Some(bump) = &self.bump else { return Aside::default() };
        if station_m <= bump.up_m.0 || station_m >= bump.down_m.1 {
            return Aside::default();
        }
        let (from_m, length_m, sign) = if station_m < bump.up_m.1 {
            (bump.up_m.0, bump.up_m.1 - bump.up_m.0, 1.0)
        } else if station_m <= bump.down_m.0 {
            return Aside { offset_m: bump.offset_m, ..Aside::default() };
        } else {
            (bump.down_m.1, bump.down_m.1 - bump.down_m.0, -1.0)
        };
        let step = smooth_step(sign * (station_m - from_m) / length_m);
        Aside {
            offset_m: bump.offset_m * step.value,
            slope: sign * bump.offset_m * step.slope / length_m,
            curvature_per_m: bump.offset_m * step.bend / (length_m * length_m),
        }
    }

    /// Greatest distance of the path from the guide, m.
    pub fn offset_m_max(&self) -> f64 {
        let way_back_m =
            self.way_back.map_or(0.0, |way| way.offset_m.abs() + (way.slope * way.length_m).abs());
        self.bump.map_or(way_back_m, |bump| bump.offset_m.abs())
    }

    /// Begins the way back to the guide from a place `offset_m` beside it, whose path rises by `slope`.
    pub fn return_from(&mut self, station_m: f64, speed_mps: f64, offset_m: f64, slope: f64) {
        let length_m = (RETURN_S * speed_mps).max(RETURN_M_MIN);
        self.bump = None;
        self.way_back = Some(WayBack { from_m: station_m, length_m, offset_m, slope });
    }

    /// Whether the vehicle is on its way back to the guide.
    pub fn is_returning(&self) -> bool {
        self.way_back.is_some()
    }

    /// Whether an object is among those that are being passed.
    pub fn passes(&self, id: u32) -> bool {
        self.bump.is_some() && self.row.contains(&id) && !self.met.contains(&id)
    }

    /// What is being passed: the id of the first object, and the stretch of the guide that the whole row takes.
    pub fn passing(&self) -> Option<(u32, Span)> {
        self.bump.filter(|bump| !self.met.contains(&bump.id)).map(|bump| (bump.id, bump.span))
    }

    /// Once a cycle: ends a shift that is over, begins one that is needed and possible.
    pub fn update(
        &mut self,
        config: &PlanningConfig,
        scene: &Scene,
        guide: &Guide,
        station_m: f64,
        speed_mps: f64,
        forecasts: &[Forecast],
    ) {
        self.way_back = self.way_back.filter(|way| station_m < way.from_m + way.length_m);
        if let Some(bump) = self.bump {
            let gone = !forecasts.iter().any(|forecast| forecast.id == bump.id && !forecast.moving);
            if station_m > bump.down_m.1 || (gone && station_m < bump.up_m.0) {
                self.bump = None;
            }
        }
        let standing = Standing { config, guide, forecasts, station_m };
        self.met.clear();
        if let Some(bump) = self.bump {
            let in_row = standing.edges().filter(|edge| self.row.contains(&edge.id));
            self.met.extend(in_row.filter(|edge| standing.meets(edge, &bump)).map(|edge| edge.id));
        }
        if self.bump.is_some() || self.way_back.is_some() {
            return;
        }
        if let Some(edge) = standing.nearest().filter(|edge| standing.is_vehicle(edge.id)) {
            let on = scene.route.lane_at(edge.span.from_m);
            let lane_m = scene.map.lane(on.lane).width_at(edge.span.from_m - on.from_m);
            self.bump = self.row_from(&standing, edge, lane_m).and_then(|(edge, offset_m)| {
                Bump::past(&edge, offset_m, station_m, speed_mps)
                    .filter(|bump| standing.leave_room_for(bump, &self.row))
            });
        }
    }

    /// All that stands in a row with what is nearest, as one, and the shift that passes it within the lane, m. Its
    /// ids are noted. `None` if the lane has no room.
    fn row_from(&mut self, standing: &Standing, nearest: Edge, lane_m: f64) -> Option<(Edge, f64)> {
        let mut edge = nearest;
        let mut offset_m = standing.shift_m(&edge, lane_m)?;
        self.row.clear();
        self.row.push(edge.id);
        while let Some((id, longer, shift_m)) = standing.edges().find_map(|other| {
            let next = other.span.from_m < edge.span.to_m + ROW_GAP_M && standing.is_in_the_way(&other);
            let fits = next && !self.row.contains(&other.id) && standing.is_vehicle(other.id);
            let longer = edge.with(&other);
            let shift_m = standing.shift_m(&longer, lane_m).filter(|_| fits)?;
            Some((other.id, longer, shift_m))
        }) {
            self.row.push(id);
            (edge, offset_m) = (longer, shift_m);
        }
        Some((edge, offset_m))
    }
}

impl Bump {
    /// The shift past what stands, if there is room for it before.
    fn past(edge: &Edge, offset_m: f64, station_m: f64, speed_mps: f64) -> Option<Bump> {
        let vehicle = VehicleParameters::MKZ;
        let (before_m, behind_m) = (vehicle.front_m(0.0), -vehicle.rear_m(0.0));
        let length_m = (speed_mps * (5.78 * offset_m.abs() / LATERAL_MPS2).sqrt()).max(LENGTH_M_MIN);
        let wanted_m = edge.span.from_m - before_m - BEFORE_M;
        let up_to_m = wanted_m.max(station_m + length_m);
        let down_from_m = edge.span.to_m + behind_m + BEHIND_M;
        (up_to_m <= edge.span.from_m - before_m - BEFORE_M_MIN).then_some(Bump {
            id: edge.id,
            span: edge.span,
            offset_m,
            up_m: (up_to_m - length_m, up_to_m),
            down_m: (down_from_m, down_from_m + length_m),
        })
    }
}

/// The standing objects ahead, as the vehicle at a station knows them.
struct Standing<'a> {
    config: &'a PlanningConfig,
    guide: &'a Guide,
    forecasts: &'a [Forecast],
    station_m: f64,
}

impl Standing<'_> {
    /// How far the vehicle reaches to each side of its way, m.
    const HALF_WAY_M: f64 = VehicleParameters::MKZ.width_m / 2.0;

    fn front_m(&self) -> f64 {
        VehicleParameters::MKZ.front_m(self.station_m)
    }

    /// The objects that stand on the way or near it.
    fn edges(&self) -> impl Iterator<Item = Edge> {
        self.forecasts.iter().filter(|forecast| !forecast.moving).filter_map(|forecast| {
            let (station_m, position) = (self.station_m, forecast.positions[0]);
            let beside = self.guide.project(position, station_m, station_m + HORIZON_M);
            let (length_m, width_m) = (forecast.length_m, forecast.width_m);
            let (_, across_m) = extent_m(forecast.forward, beside.forward, (length_m, width_m));
            let span = beside.taken(forecast.forward, length_m, width_m, 2.0 * self.clear_m())?;
            let (right_m, left_m) = (beside.offset_m - across_m / 2.0, beside.offset_m + across_m / 2.0);
            (span.to_m > self.front_m()).then_some(Edge { id: forecast.id, span, right_m, left_m })
        })
    }

    fn is_in_the_way(&self, edge: &Edge) -> bool {
        edge.right_m < self.clear_m() && edge.left_m > -self.clear_m()
    }

    /// The nearest that is in the way and wholly ahead.
    fn nearest(&self) -> Option<Edge> {
        self.edges()
            .filter(|edge| self.is_in_the_way(edge) && edge.span.from_m > self.front_m())
            .min_by(|a, b| a.span.from_m.total_cmp(&b.span.from_m))
    }

    fn is_vehicle(&self, id: u32) -> bool {
        self.forecasts.iter().any(|forecast| forecast.id == id && forecast.body.is_vehicle())
    }

    /// From the way to what stands, at least, m.
    fn clear_m(&self) -> f64 {
        Self::HALF_WAY_M + self.config.lateral_buffer_m
    }

    /// The shift that passes what stands, m; `None` if a lane of that width has no room.
    fn shift_m(&self, edge: &Edge, lane_m: f64) -> Option<f64> {
        let left = edge.left_m + edge.right_m < 0.0;
        let offset_m = if left { edge.left_m + self.clear_m() } else { edge.right_m - self.clear_m() };
        (offset_m.abs() <= lane_m / 2.0 - Self::HALF_WAY_M - EDGE_M).then_some(offset_m)
    }

    /// Whether what stands reaches into the way beside, of the room that is wanted half at least.
    fn meets(&self, edge: &Edge, bump: &Bump) -> bool {
        let room_m = Self::HALF_WAY_M + self.config.lateral_buffer_m / 2.0;
        edge.left_m > bump.offset_m - room_m && edge.right_m < bump.offset_m + room_m
    }

    /// Whether a shift past a row meets nothing else that stands.
    fn leave_room_for(&self, bump: &Bump, row: &[u32]) -> bool {
        let before_m = VehicleParameters::MKZ.front_m(0.0);
        self.edges().filter(|other| !row.contains(&other.id)).all(|other| {
            let abreast = other.span.from_m < bump.down_m.1 + before_m && other.span.to_m > bump.up_m.0;
            let (right_m, left_m) = (bump.offset_m - self.clear_m(), bump.offset_m + self.clear_m());
            !abreast || other.left_m < right_m || other.right_m > left_m
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::prediction::forecasts_of;
    use crate::modular::tracking::Track;
    use crate::testing::straight;
    use avastra_base::geometry::{Pose, Vec2};
    use avastra_lang::model::vocabulary::Body;

    fn planned(places: &[(Body, f64, f64)]) -> LateralPlan {
        planned_on(LateralPlan::default(), 10.0, places)
    }

    /// The plan at a station after one look more.
    fn planned_on(mut plan: LateralPlan, station_m: f64, places: &[(Body, f64, f64)]) -> LateralPlan {
        let scene = straight();
        let config = PlanningConfig::default();
        let guide = Guide::new(&scene, &config.speed_rules());
        let tracks: Vec<Track> = places
            .iter()
            .zip(1..)
            .map(|((body, x_m, y_m), id)| {
                Track::for_tests(id, *body, Pose::new(*x_m, *y_m, 0.0), Vec2::zeros())
            })
            .collect();
        let forecasts = forecasts_of(&scene, &tracks, Vec2::zeros());
        plan.update(&config, &scene, &guide, station_m, 8.0, &forecasts);
        plan
    }

    #[test]
    fn it_shifts_as_far_as_needed_and_back_smoothly() {
        // The lane's middle is at -1.75; the car's left side at -2.65 leaves 0.9 m to it.
        let plan = planned(&[(Body::Sedan, 60.0, -3.6)]);
        let at_car = plan.aside(60.0);
        assert!((at_car.offset_m - (1.03 + 0.4 - 0.9)).abs() < 1e-6, "{at_car:?}");
        assert_eq!((plan.aside(10.0), plan.aside(120.0)), (Aside::default(), Aside::default()));
        let h = 1e-3;
        for decimetre in 100..1200 {
            let at_m = f64::from(decimetre) / 10.0 + 0.05;
            let (before, here, after) = (plan.aside(at_m - h), plan.aside(at_m), plan.aside(at_m + h));
            assert!(((after.offset_m - before.offset_m) / (2.0 * h) - here.slope).abs() < 1e-4, "{at_m}");
            assert!(((after.slope - before.slope) / (2.0 * h) - here.curvature_per_m).abs() < 1e-4, "{at_m}");
            assert!(8.0 * 8.0 * here.curvature_per_m.abs() < 1.6, "{here:?}");
        }
    }

    #[test]
    fn vehicles_in_a_row_are_passed_as_one() {
        let row =
            planned(&[(Body::Sedan, 60.0, -3.6), (Body::Sedan, 70.0, -3.55), (Body::Sedan, 110.0, -3.6)]);
        let (_, span) = row.passing().expect("there is room in the lane");
        assert!(row.passes(1) && row.passes(2) && !row.passes(3));
        assert!(span.to_m > 72.0 && span.to_m < 74.0, "{span:?}");
    }

    #[test]
    fn what_comes_into_the_shifted_way_is_no_longer_passed() {
        let plan = planned(&[(Body::Sedan, 60.0, -3.6)]);
        assert!(plan.passes(1));
        let plan = planned_on(plan, 20.0, &[(Body::Sedan, 60.0, -2.2)]);
        assert!(!plan.passes(1) && plan.passing().is_none(), "it is stopped for");
        let plan = planned_on(plan, 30.0, &[(Body::Sedan, 60.0, -3.5)]);
        assert!(plan.passes(1), "there is room again");
    }

    #[test]
    fn the_way_back_has_its_own_derivatives() {
        let mut plan = LateralPlan::default();
        plan.return_from(100.0, 8.0, 0.8, 0.06);
        assert!(
            (plan.aside(100.0).offset_m - 0.8).abs() < 1e-9 && (plan.aside(100.0).slope - 0.06).abs() < 1e-9
        );
        assert!(plan.aside(120.0).offset_m.abs() < 1e-9);
        let h = 1e-3;
        for metre in 1..20 {
            let at_m = 100.0 + f64::from(metre) - 0.5;
            let (before, here, after) = (plan.aside(at_m - h), plan.aside(at_m), plan.aside(at_m + h));
            assert!(((after.offset_m - before.offset_m) / (2.0 * h) - here.slope).abs() < 1e-5, "{at_m}");
            assert!(((after.slope - before.slope) / (2.0 * h) - here.curvature_per_m).abs() < 1e-5, "{at_m}");
            assert!(here.offset_m.abs() < 1.1 && 64.0 * here.curvature_per_m.abs() < 2.0, "{here:?}");
        }
    }

    #[test]
    fn obstacles_that_cannot_be_passed_are_not_passed() {
        assert!(planned(&[(Body::Sedan, 60.0, -1.75)]).passing().is_none(), "in the middle");
        assert!(planned(&[(Body::Pedestrian, 60.0, -3.6)]).passing().is_none(), "a pedestrian");
        assert!(planned(&[(Body::Sedan, 16.0, -3.6)]).passing().is_none(), "too near");
        let gate = [(Body::Sedan, 60.0, -3.6), (Body::Sedan, 62.0, 0.4)];
        assert!(planned(&gate).passing().is_none(), "one on each side");
        assert!(planned(&[(Body::Sedan, 60.0, -4.6)]).passing().is_none(), "beside the lane");
    }
}
