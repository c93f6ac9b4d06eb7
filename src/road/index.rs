//! A grid over the plane that finds the lanes near a point.

use core::ops::RangeInclusive;
use std::collections::{BTreeMap, BTreeSet};

use avastra_base::geometry::{Bounds, Path, Pose, Projection, Vec2, smaller, wrap_angle};

use super::map::{Lane, LaneIndex};

/// Side of a cell, m. It is doubled as long as lanes would lie in more than [`CELLS_WANTED`] cells, so that the grid of a
/// country needs no more memory than its lanes.
const CELL_M: f64 = 8.0;
const CELLS_WANTED: f64 = 500_000.0;

/// A lane is entered into the grid by stretches of this part of a cell.
const STRETCH_PART: f64 = 0.5;

/// Added to distances because of rounding, m.
const SLACK_M: f64 = 1e-3;

/// Added to angles because of rounding, rad.
const SLACK_RAD: f64 = 1e-6;

/// Up to this number of lanes, and beyond this number of columns of cells in a box, every lane is tried, which is quicker than
/// to look into the cells.
const LANES_FEW: usize = 500;
const COLUMNS_MAX: i64 = 64;

/// Above this number of cells, every lane is tried instead: with a reach that wide nearly all lanes are in it,
/// and each stands in many cells.
const CELLS_MAX: i64 = 36;

/// Which stretches of which lanes touch which cell.
#[derive(Debug, Clone, Default)]
pub struct LaneGrid {
    /// Side of a cell, m.
    cell_m: f64,
    cells: BTreeMap<(i64, i64), Vec<Stretch>>,
    /// Half the width of the widest lane, m.
    half_width_m: f64,
    /// The box around each lane's centre line.
    boxes: Vec<Bounds>,
    /// By lane.
    headings: Vec<Headings>,
}

/// All headings of a centre line: one of them, and how far the others are from it at most, rad.
#[derive(Debug, Clone, Copy)]
struct Headings {
    first_rad: f64,
    turn_rad_max: f64,
}

impl Headings {
    fn of(path: &Path) -> Headings {
        let first_rad = path.points()[0].heading_rad;
        let turn_rad = |heading_rad: f64| wrap_angle(heading_rad - first_rad).abs();
        let turns_rad = path.points().iter().map(|point| turn_rad(point.heading_rad));
        Headings { first_rad, turn_rad_max: turns_rad.fold(0.0, f64::max) }
    }

    /// Whether a place of the line may have a heading within an angle of this one.
    fn may_be_parallel(&self, heading_rad: f64, within_rad: f64) -> bool {
        let turn_rad = wrap_angle(self.first_rad - heading_rad).abs();
        turn_rad <= within_rad + self.turn_rad_max + SLACK_RAD
    }
}

#[derive(Debug, Clone, Copy)]
struct Stretch {
    lane: LaneIndex,
    from_m: f64,
    to_m: f64,
    bounds: Bounds,
}

impl Stretch {
    /// The nearest point of it, on the centre line of its lane.
    fn project(&self, centre: &Path, point: Vec2) -> Projection {
        let (middle_m, half_m) = ((self.from_m + self.to_m) / 2.0, (self.to_m - self.from_m) / 2.0);
        centre.project_near(point, middle_m, half_m)
    }
}

fn of_one_lane((a, _): &(&Stretch, f64), (b, _): &(&Stretch, f64)) -> bool {
    a.lane == b.lane
}

/// The nearest point of stretches of a lane; of several that are as near that of the first.
fn nearest_of(centre: &Path, stretches: &[(&Stretch, f64)], point: Vec2) -> Projection {
    let found = stretches.iter().map(|(stretch, _)| stretch.project(centre, point));
    let nearer =
        |best: Projection, next: Projection| if next.distance_m < best.distance_m { next } else { best };
    found.reduce(nearer).expect("there is a stretch")
}

impl LaneGrid {
    pub fn new(lanes: &[Lane]) -> LaneGrid {
        let widths_m = lanes.iter().flat_map(|lane| &lane.widths_m);
        let widest_m = widths_m.copied().fold(0.0, f64::max);
        let boxes = lanes.iter().map(|lane| lane.centre.bounds()).collect();
        let headings = lanes.iter().map(|lane| Headings::of(&lane.centre)).collect();
        let all_m: f64 = lanes.iter().map(|lane| lane.centre.length_m()).sum();
        let mut cell_m = CELL_M;
        while all_m > cell_m * CELLS_WANTED {
            cell_m *= 2.0;
        }
        let cells = BTreeMap::new();
        let mut grid = LaneGrid { cell_m, cells, half_width_m: widest_m / 2.0, boxes, headings };
        for (index, lane) in lanes.iter().enumerate() {
            let stretches = (lane.centre.length_m() / (cell_m * STRETCH_PART)).ceil().max(1.0);
            let step_m = lane.centre.length_m() / stretches;
            for i in 0..stretches as u32 {
                let from_m = step_m * f64::from(i);
                let to_m = from_m + step_m;
                let bounds = lane.centre.bounds_between(from_m, to_m);
                grid.insert(&lane.centre, Stretch { lane: LaneIndex(index), from_m, to_m, bounds });
            }
        }
        grid
    }

    /// Half the width of the widest lane, m.
    pub fn half_width_m(&self) -> f64 {
        self.half_width_m
    }

    fn insert(&mut self, path: &Path, stretch: Stretch) {
        let (a, b) = (path.pose_at(stretch.from_m).position, path.pose_at(stretch.to_m).position);
        // A curve lies less than half its length away from its chord.
        let margin = Vec2::repeat(self.cell_m * STRETCH_PART / 2.0);
        let (low, high) = (self.cell(a.inf(&b) - margin), self.cell(a.sup(&b) + margin));
        for x in low.0..=high.0 {
            for y in low.1..=high.1 {
                let entries = self.cells.entry((x, y)).or_default();
                match entries.last_mut() {
                    Some(last) if last.lane == stretch.lane && last.to_m >= stretch.from_m - 1e-9 => {
                        last.to_m = stretch.to_m;
                        last.bounds = last.bounds.with(&stretch.bounds);
                    }
                    _ => entries.push(stretch),
                }
            }
        }
    }

    /// The lanes that may have a point within `ahead_m` before or behind a pose and at one of these distances to the left
    /// of it, with a heading there within an angle of the given one, by rising index. A few lanes elsewhere, or with
    /// other headings, may be among them.
    pub fn beside(
        &self,
        pose: &Pose,
        (heading_rad, within_rad): (f64, f64),
        ahead_m: f64,
        aside_m: RangeInclusive<f64>,
    ) -> impl Iterator<Item = LaneIndex> {
        let forward = pose.forward();
        let left = Vec2::new(-forward.y, forward.x);
        let position = pose.position;
        let near = (self.boxes.len() > LANES_FEW).then(|| {
            let corner = |ahead_m: f64, aside_m: f64| position + forward * ahead_m + left * aside_m;
            let (right_m, left_m) = (*aside_m.start(), *aside_m.end());
            let corners = [(-ahead_m, right_m), (ahead_m, right_m), (-ahead_m, left_m), (ahead_m, left_m)];
            let around = Bounds::around(&corners.map(|(ahead_m, aside_m)| corner(ahead_m, aside_m)));
            self.lanes_in(&around.grown(SLACK_M))
        });
        let near = near.flatten();
        let every = if near.is_some() { 0..0 } else { 0..self.boxes.len() };
        let may_be = move |&Bounds { least, most }: &Bounds| {
            let (middle, half) = ((least + most) / 2.0 - position, (most - least) / 2.0);
            let within = |axis: &Vec2, from_m: f64, to_m: f64| {
                let (at_m, half_m) = (axis.dot(&middle), axis.abs().dot(&half) + SLACK_M);
                at_m + half_m >= from_m && at_m - half_m <= to_m
            };
            within(&forward, -ahead_m, ahead_m) && within(&left, *aside_m.start(), *aside_m.end())
        };
        let candidates = every.chain(near.into_iter().flatten()).filter(move |index| {
            may_be(&self.boxes[*index]) && self.headings[*index].may_be_parallel(heading_rad, within_rad)
        });
        candidates.map(LaneIndex)
    }

    /// The indices of all lanes with a place in a box, and perhaps of some near it. `None` if the box has more than
    /// [`COLUMNS_MAX`] columns of cells.
    fn lanes_in(&self, around: &Bounds) -> Option<BTreeSet<usize>> {
        let (low, high) = (self.cell(around.least), self.cell(around.most));
        if high.0.saturating_sub(low.0) > COLUMNS_MAX {
            return None;
        }
        let columns = (low.0..=high.0).map(|x| self.cells.range((x, low.1)..=(x, high.1)));
        let stretches = columns.flatten().flat_map(|(_, stretches)| stretches);
        Some(stretches.map(|stretch| stretch.lane.0).collect())
    }

    /// Pairs of lanes of different groups that have a cell in common, in order, the lower index first in each; at most `most`
    /// of them, and whether these are all. A lane without a group is left out. The numbers of the groups must rise with the
    /// indices of the lanes.
    pub fn sharing_cells(
        &self,
        most: usize,
        group_of: impl Fn(usize) -> Option<usize>,
    ) -> (Vec<(usize, usize)>, bool) {
        let (mut pairs, mut is_whole) = (Vec::new(), true);
        'all: for stretches in self.cells.values() {
            let lanes = stretches.iter().map(|stretch| stretch.lane.0);
            let here: Vec<(usize, usize)> = lanes.filter_map(|lane| Some((group_of(lane)?, lane))).collect();
            let mut rest = here.as_slice();
            while let Some((group, _)) = rest.first() {
                let (own, others) = rest.split_at(rest.partition_point(|(other, _)| other <= group));
                for (_, a) in own {
                    if pairs.len() + others.len() > most {
                        is_whole = false;
                        break 'all;
                    }
                    pairs.extend(others.iter().map(|(_, b)| (*a, *b)));
                }
                rest = others;
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        (pairs, is_whole)
    }

    fn cell(&self, point: Vec2) -> (i64, i64) {
        ((point.x / self.cell_m).floor() as i64, (point.y / self.cell_m).floor() as i64)
    }

    /// Distance from a point to the nearest edge of a lane, m: negative on the lane, at most `reach_m`.
    pub fn least_room_m(&self, lanes: &[Lane], point: Vec2, reach_m: f64) -> f64 {
        let mut least_m = reach_m;
        self.visit(lanes, point, reach_m, |lane, found| {
            least_m = smaller(least_m, found.distance_m - lanes[lane.0].width_at(found.station_m) / 2.0);
            least_m
        });
        least_m
    }

    /// The nearest point of each lane as in [`LaneGrid::near`], the nearest lanes first. `visit` says how far beyond its edge, m, a lane
    /// may be to matter still.
    pub fn visit(
        &self,
        lanes: &[Lane],
        point: Vec2,
        reach_m: f64,
        mut visit: impl FnMut(LaneIndex, Projection) -> f64,
    ) {
        let Some(stretches) = self.stretches(point, reach_m) else {
            self.near(lanes, point, reach_m).into_iter().for_each(|(lane, found)| {
                visit(lane, found);
            });
            return;
        };
        let nearest_m2 =
            |lane: &[(&Stretch, f64)]| lane.iter().map(|part| part.1).fold(f64::INFINITY, smaller);
        let mut by_lane: Vec<_> =
            stretches.chunk_by(of_one_lane).map(|parts| (nearest_m2(parts), parts)).collect();
        by_lane.sort_by(|(a_m2, _), (b_m2, _)| a_m2.total_cmp(b_m2));
        let mut matters_m = f64::INFINITY;
        for (nearest_m2, parts) in by_lane {
            // From here on every lane is farther away.
            if nearest_m2.sqrt() - SLACK_M - self.half_width_m > matters_m {
                break;
            }
            let lane = parts[0].0.lane;
            matters_m = visit(lane, nearest_of(&lanes[lane.0].centre, parts, point));
        }
    }

    /// The nearest point of each lane whose centre comes within `reach_m` and half a lane width of a
    /// point, by rising index; a few lanes that are farther away may be among them.
    pub fn near(&self, lanes: &[Lane], point: Vec2, reach_m: f64) -> Vec<(LaneIndex, Projection)> {
        let Some(stretches) = self.stretches(point, reach_m) else {
            let radius_m = self.radius_m(reach_m);
            let in_reach = lanes.iter().zip(&self.boxes).enumerate().filter_map(|(index, (lane, bounds))| {
                if bounds.distance_m2_min(point) > radius_m * radius_m {
                    return None;
                }
                let projection = lane.centre.project(point);
                (projection.distance_m <= radius_m).then_some((LaneIndex(index), projection))
            });
            return in_reach.collect();
        };
        let place = |parts: &[(&Stretch, f64)]| {
            let lane = parts[0].0.lane;
            (lane, nearest_of(&lanes[lane.0].centre, parts, point))
        };
        stretches.chunk_by(of_one_lane).map(place).collect()
    }

    /// Stretches of lanes that may come within `reach_m` and half a lane width of a point, each with the square of a distance
    /// that none of its places undercuts, m², by rising lane. `None` if nearly all of them may.
    fn stretches(&self, point: Vec2, reach_m: f64) -> Option<Vec<(&Stretch, f64)>> {
        let radius_m = self.radius_m(reach_m);
        let margin = Vec2::new(radius_m, radius_m);
        let (low, high) = (self.cell(point - margin), self.cell(point + margin));
        let cells = (high.0 - low.0 + 1).saturating_mul(high.1 - low.1 + 1);
        if cells > CELLS_MAX {
            return None;
        }
        let mut found: Vec<(&Stretch, f64)> = Vec::new();
        for x in low.0..=high.0 {
            for stretch in self.cells.range((x, low.1)..=(x, high.1)).flat_map(|(_, stretches)| stretches) {
                let least_m2 = stretch.bounds.distance_m2_min(point);
                if least_m2 <= radius_m * radius_m {
                    found.push((stretch, least_m2));
                }
            }
        }
        found.sort_by_key(|(stretch, _)| stretch.lane);
        Some(found)
    }

    fn radius_m(&self, reach_m: f64) -> f64 {
        reach_m.max(0.0) + self.half_width_m
    }
}
