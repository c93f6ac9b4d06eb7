//! The station-time graph: a dynamic programme that ranks the ways past all road users by cost.
//!
//! Apollo's speed heuristic (`GriddedPathTimeGraph`): columns of 1 s, rows of stations, the cheapest way from
//! the vehicle's place to the last column under limits of speed and acceleration. The resulting profile is
//! not driven. It is compared with every region, and gives the decision about each road user: below a region
//! the vehicle stays behind, above it passes before. The law in `speed` then drives the decisions.
//!
//! Ours: rows of 2 m (Apollo: 0.1 to 1 m), because decisions alone are read off; and hypotheses that are too
//! improbable to bind count in the cost, weighted with their probability. Left out are Apollo's costs near the
//! limits of acceleration: the four possible accelerations do not need them.

use crate::kit::Guide;
use avastra_base::geometry::{larger, smaller};
use avastra_base::kinematics::braking_m;
use avastra_world::sim::VehicleParameters;

use super::super::config::PlanningConfig;
use super::claim::{Claim, Role, Stance};
use super::trajectory::Point;

/// Time between columns, s. Apollo's DP `unit_t`: 1.0; `total_time`: 7.0.
const UNIT_S: f64 = 1.0;
const COLUMNS: usize = 8;
/// Distance between rows, m; the last is at 100 m, Apollo's `st_max_s`.
const ROW_M: f64 = 2.0;
const ROWS: usize = 51;
/// Regions that fit into a set of bits; the nearest come first, others do not matter yet.
const REGIONS_MAX: usize = 32;

/// Apollo's `speed_heuristic_optimizer_config`: `default_obstacle_cost`, `default_speed_cost`.
const OBSTACLE_COST: f64 = 1e4;
const SPEED_COST: f64 = 1e3;
/// `exceed_speed_penalty` and `low_speed_penalty`, factors of the speed cost.
const EXCEED_PENALTY: f64 = 1e3;
const LOW_PENALTY: f64 = 10.0;
/// `accel_penalty`, `decel_penalty`, and `positive_jerk_coeff`, `negative_jerk_coeff`: all of them 1.0.
const ACCELERATION_PENALTY: f64 = 1.0;
const JERK_PENALTY: f64 = 1.0;
/// `spatial_potential_penalty`, per metre that is left to the last row.
const LEFT_PENALTY: f64 = 1e2;
/// Cost of a moment inside a region: more than any way round it, but not infinite, so that a vehicle that is
/// inside one finds the best way out. Ours.
const INSIDE_COST: f64 = 1e9;

/// The inputs of a cycle's decisions.
pub struct Situation<'a> {
    pub config: &'a PlanningConfig,
    pub guide: &'a Guide,
    pub start: Point,
    /// The first place at which a rule demands a stop, m; infinite if there is none.
    pub stop_m: f64,
    /// Without it each cycle decides anew.
    pub hysteresis: bool,
}

/// A claim in the graph: where the front bumper must not be, m ahead of where it is now.
#[derive(Debug, Clone, Copy)]
pub struct Region {
    /// Index in the claims.
    pub claim: usize,
    /// Lowest and highest place in each column. Beside the columns in which the region is active, the places
    /// of the nearest of these.
    low_m: [f64; COLUMNS],
    high_m: [f64; COLUMNS],
    /// Part of the safe distance that is missing inside, in `[0, 1]`: 1 where it is active, time buffer
    /// included, less by how long it is to that; 0 where it does not matter.
    near: [f64; COLUMNS],
    /// Distance below it that costs nothing, m.
    room_m: f64,
    /// Whether the vehicle must stay on one side of it, or else how probable it is.
    binds: bool,
    probability: f64,
    /// The side on which it stayed in the last cycle, if any.
    pub remembered: Stance,
}

impl Region {
    /// The region of a claim, if it begins within the time of the graph.
    pub fn new(
        config: &PlanningConfig,
        claim: &Claim,
        index: usize,
        binds: bool,
        front_m: f64,
    ) -> Option<Region> {
        let buffer_s = config.conflict_buffer_s.max(UNIT_S);
        if claim.entry_s() - buffer_s > (COLUMNS - 1) as f64 * UNIT_S {
            return None;
        }
        let goes_along = claim.role(config.static_mps) != Role::Crosses;
        let mut region = Region {
            claim: index,
            low_m: [f64::INFINITY; COLUMNS],
            high_m: [f64::NEG_INFINITY; COLUMNS],
            near: [0.0; COLUMNS],
            room_m: if goes_along { config.dp_safe_distance_m } else { config.yield_gap_m },
            binds,
            probability: claim.probability,
            remembered: Stance::Open,
        };
        for (time_s, span) in claim.steps() {
            let first = rounded_up((time_s - buffer_s) / UNIT_S);
            let last = ((time_s + buffer_s) / UNIT_S) as u32 as usize;
            for column in first..=last.min(COLUMNS - 1) {
                region.low_m[column] = smaller(region.low_m[column], span.from_m - front_m);
                let clear_m = span.to_m + VehicleParameters::MKZ.length_m - front_m;
                region.high_m[column] = larger(region.high_m[column], clear_m);
                region.near[column] = 1.0;
            }
        }
        region.widen(UNIT_S / config.dp_safe_time_s);
        Some(region)
    }

    /// Writes into the columns before and after the active ones how near these are; `fall` is lost a column.
    fn widen(&mut self, fall: f64) {
        for column in 1..COLUMNS {
            self.take_over(column, column - 1, fall);
        }
        for column in (0..COLUMNS - 1).rev() {
            self.take_over(column, column + 1, fall);
        }
    }

    fn take_over(&mut self, column: usize, from: usize, fall: f64) {
        if self.near[from] - fall > self.near[column] {
            (self.low_m[column], self.high_m[column]) = (self.low_m[from], self.high_m[from]);
            self.near[column] = self.near[from] - fall;
        }
    }

    fn is_active(&self, column: usize) -> bool {
        self.near[column] >= 1.0
    }

    /// Cost of a moment at a place, and whether the place is above the region. With `is_kept` the other side than the
    /// remembered one is wrong.
    ///
    /// Apollo's obstacle cost: the square of what is missing to the safe distance, below and above. Ours: the
    /// same for what is missing to the safe time before and after it, and inside what does not bind.
    fn cost(&self, config: &PlanningConfig, column: usize, place_m: f64, is_kept: bool) -> (f64, bool) {
        let (low_m, high_m) = (self.low_m[column], self.high_m[column]);
        let share = if self.binds { OBSTACLE_COST } else { self.probability * OBSTACLE_COST };
        let (below, above) = (place_m <= low_m, place_m >= high_m);
        let missing_m = match (self.is_active(column), below, above) {
            (false, false, false) => self.near[column] * config.dp_safe_distance_m,
            (false, ..) => return (0.0, false),
            (true, true, _) => self.room_m - (low_m - place_m),
            (true, _, true) => config.dp_safe_distance_m - (place_m - high_m),
            (true, ..) if self.binds => return (INSIDE_COST, place_m > (low_m + high_m) / 2.0),
            (true, ..) => config.dp_safe_distance_m,
        };
        let is_other =
            below && self.remembered == Stance::Overtake || above && self.remembered == Stance::Yield;
        let wrong = if is_kept && is_other { INSIDE_COST } else { 0.0 };
        (wrong + share * larger(missing_m, 0.0) * larger(missing_m, 0.0), above)
    }
}

/// The cheapest way through the graph.
#[derive(Debug, Clone, Copy)]
pub struct Profile {
    /// Infinite if there is no way.
    pub cost: f64,
    /// Way of the front bumper at each column, m.
    way_m: [f64; COLUMNS],
}

/// The cheapest way to a place of the graph.
#[derive(Debug, Clone, Copy)]
struct Node {
    cost: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
    /// Row in the column before.
    from: usize,
    /// The regions that the place is above of, a bit for each.
    above: u32,
}

const UNREACHED: Node =
    Node { cost: f64::INFINITY, speed_mps: 0.0, acceleration_mps2: 0.0, from: 0, above: 0 };

/// A place of a column: its own cost, the regions that it is above of, and the speed that the road allows.
#[derive(Debug, Clone, Copy)]
struct Place {
    cost: f64,
    above: u32,
    limit_mps: f64,
}

/// The inputs of a search through the graph.
struct Search<'a> {
    config: &'a PlanningConfig,
    guide: &'a Guide,
    front_m: f64,
    regions: &'a [Region],
    /// Whether the remembered sides are kept.
    is_kept: bool,
}

impl Profile {
    /// The cheapest way from the start on which the front bumper stays before the stop, or as near behind it as braking
    /// allows; with the remembered sides of all regions or without.
    pub fn cheapest(situation: &Situation, regions: &[Region], is_kept: bool) -> Profile {
        let &Situation { config, guide, start, stop_m, .. } = situation;
        let front_m = VehicleParameters::MKZ.front_m(start.station_m);
        let regions = &regions[..regions.len().min(REGIONS_MAX)];
        let search = Search { config, guide, front_m, regions, is_kept };
        let braking_m = braking_m(start.speed_mps, config.deceleration_mps2_max);
        let last_m = (stop_m - front_m).max(braking_m + ROW_M);
        let end = (last_m / ROW_M).min((ROWS - 1) as f64) as usize + 1;
        let mut nodes = [[UNREACHED; ROWS]; COLUMNS];
        let here = search.place(0, 0);
        nodes[0][0] = Node { cost: 0.0, speed_mps: start.speed_mps, above: here.above, ..UNREACHED };
        // A region that the vehicle is inside of may be left to either side.
        let mut active = search.active(0) & !search.inside(0);
        let mut rows = 0..1;
        for column in 1..COLUMNS {
            let (done, open) = nodes.split_at_mut(column);
            let was_active = active;
            active = search.active(column);
            rows = search.advance(column, &done[column - 1], &mut open[0], rows, end, was_active & active);
        }
        Profile::back_from(&nodes)
    }

    fn back_from(nodes: &[[Node; ROWS]; COLUMNS]) -> Profile {
        let last = &nodes[COLUMNS - 1];
        let mut row =
            (0..ROWS).fold(0, |best, row| if last[row].cost < last[best].cost { row } else { best });
        let mut profile = Profile { cost: last[row].cost, way_m: [0.0; COLUMNS] };
        for column in (0..COLUMNS).rev() {
            profile.way_m[column] = row as f64 * ROW_M;
            row = nodes[column][row].from;
        }
        profile
    }

    /// On which side of a region the profile passes; open if it does not come to that.
    pub fn side_of(&self, region: &Region) -> Stance {
        let Some(column) = (1..COLUMNS).find(|&column| region.is_active(column)) else { return Stance::Open };
        let middle_m = (region.low_m[column] + region.high_m[column]) / 2.0;
        if self.way_m[column] > middle_m { Stance::Overtake } else { Stance::Yield }
    }
}

impl Search<'_> {
    /// From every place of a column to all that can be reached of the next; returns the rows that were.
    /// `compared` are the regions that are active in both: none of them may be passed through.
    fn advance(
        &self,
        column: usize,
        before: &[Node; ROWS],
        here: &mut [Node; ROWS],
        rows: core::ops::Range<usize>,
        end: usize,
        compared: u32,
    ) -> core::ops::Range<usize> {
        let mut places: [Option<Place>; ROWS] = [None; ROWS];
        #[allow(clippy::reversed_empty_ranges, reason = "nothing is reached yet; each row widens it")]
        let mut reached = ROWS..0;
        for row in rows {
            let from = &before[row];
            if from.cost.is_infinite() {
                continue;
            }
            let slowest_mps = larger(from.speed_mps - self.config.deceleration_mps2_max * UNIT_S, 0.0);
            let fastest_mps = from.speed_mps + self.config.acceleration_mps2_max * UNIT_S;
            let first = row + rounded_up(slowest_mps * UNIT_S / ROW_M);
            let last = row + (fastest_mps * UNIT_S / ROW_M) as u32 as usize;
            for next in first..=last.min(end - 1) {
                let place = *places[next].get_or_insert_with(|| self.place(column, next));
                if (from.above ^ place.above) & compared != 0 {
                    continue;
                }
                let speed_mps = f64::from((next - row) as u32) * ROW_M / UNIT_S;
                let acceleration_mps2 = (speed_mps - from.speed_mps) / UNIT_S;
                let jerk_mps3 = (acceleration_mps2 - from.acceleration_mps2) / UNIT_S;
                let cost = from.cost
                    + place.cost
                    + way_cost(speed_mps, acceleration_mps2, jerk_mps3, place.limit_mps);
                if cost < here[next].cost {
                    here[next] = Node { cost, speed_mps, acceleration_mps2, from: row, above: place.above };
                    reached = reached.start.min(next)..reached.end.max(next + 1);
                }
            }
        }
        reached
    }

    fn place(&self, column: usize, row: usize) -> Place {
        let way_m = row as f64 * ROW_M;
        let left_m = (ROWS - 1 - row) as f64 * ROW_M;
        let mut place = Place {
            cost: left_m * LEFT_PENALTY,
            above: 0,
            limit_mps: self.guide.speed_mps_max(self.front_m + way_m - VehicleParameters::MKZ.front_m(0.0)),
        };
        for (bit, region) in self.regions.iter().enumerate() {
            let (cost, above) = region.cost(self.config, column, way_m, self.is_kept);
            place.cost += cost;
            place.above |= u32::from(above) << bit;
        }
        place
    }

    /// The binding regions that are active in a column, a bit for each.
    fn active(&self, column: usize) -> u32 {
        self.bits(|region| region.binds && region.is_active(column))
    }

    /// The regions that the vehicle is inside of now.
    fn inside(&self, column: usize) -> u32 {
        self.bits(|region| region.low_m[column] < 0.0 && region.high_m[column] > 0.0)
    }

    fn bits(&self, holds: impl Fn(&Region) -> bool) -> u32 {
        let bit = |(bit, region): (usize, &Region)| u32::from(holds(region)) << bit;
        self.regions.iter().enumerate().map(bit).fold(0, |bits, bit| bits | bit)
    }
}

/// A small number rounded up, at least 0: `f64::ceil` is a call where the processor need not have it.
fn rounded_up(value: f64) -> usize {
    let down = value as u32;
    (down + u32::from(f64::from(down) < value)) as usize
}

/// Cost of a step between two columns, by Apollo's speed, acceleration and jerk costs.
fn way_cost(speed_mps: f64, acceleration_mps2: f64, jerk_mps3: f64, limit_mps: f64) -> f64 {
    let excess = (speed_mps - limit_mps) / larger(limit_mps, 0.1);
    let speed_cost =
        if excess > 0.0 { EXCEED_PENALTY * excess * excess } else { LOW_PENALTY * -excess } * SPEED_COST;
    speed_cost
        + ACCELERATION_PENALTY * acceleration_mps2 * acceleration_mps2
        + JERK_PENALTY * jerk_mps3 * jerk_mps3
}
