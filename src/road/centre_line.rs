//! Centre lines of lanes: the exact offset curve of a reference line, sampled.

use core::cell::Cell;

use avastra_base::geometry::{Path, Vec2, unit_vector, wrap_angle};

use super::crossing::segment_crossing;
use super::opendrive::{Across, RoadElement, SectionElement};

/// Largest distance of a chord from the curve, m; other modules rely on twice as much.
const CHORD_ERROR_M: f64 = 5e-4;

/// Between two vertices the heading and the road's station are interpolated linearly: largest error, rad and m.
/// It matters where a lane runs near the centre of a tight bend.
const HEADING_ERROR_RAD: f64 = 5e-4;
const STATION_ERROR_M: f64 = 2e-3;

/// Longest chord where anything bends or widens, m.
pub const CHORD_M_MAX: f64 = 1.0;

/// Distance of the last vertex before a jump in curvature from that jump, m. Without this vertex, linear
/// interpolation would spread the jump over the whole straight.
const JUMP_M: f64 = 0.05;

/// The same for a jump in heading, where a taper begins or ends, or in position, where a width steps: a vertex on
/// either side of the jump, so that each side keeps its own pose. Nearer vertices would be dropped as one.
const TURN_M: f64 = 1e-4;

/// Smaller jumps in position (m), heading (rad) and curvature (1/m) are rounding.
const LEAP_M_MIN: f64 = 1e-5;
const TURN_RAD_MIN: f64 = 1e-6;
const JUMP_PER_M_MIN: f64 = 1e-6;

/// Limit on the vertices of a lane; no lane of a real road needs as many.
const SAMPLES_MAX: usize = 500_000;

/// Limit on the length of a lane, m; a road is at most a tenth as long.
const LANE_M_MAX: f64 = 1e6;

/// Limit on the distance from the origin, m; no map in metres reaches it (UTM northings reach 1e7).
const COORDINATE_M_MAX: f64 = 1e8;

/// A lane of one section, sampled in driving direction.
pub struct CentreLine {
    pub path: Path,
    /// Width at each vertex, m.
    pub widths_m: Vec<f64>,
    /// Station of the road's reference line at each vertex, m.
    pub road_stations_m: Vec<f64>,
    /// The largest of the loops that were cut off.
    pub unfolded: Option<Unfolded>,
}

/// Where a lane ran backwards, because it lies beyond the centre of a bend: the loop is cut off where the lane
/// crosses itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unfolded {
    pub position: Vec2,
    /// How far the part that was cut off reached, m.
    pub off_m: f64,
}

/// A smaller loop is rounding, m.
const UNFOLDED_M_MIN: f64 = 0.01;

/// A loop that reaches farther than this is no mistake of a bend's radius, m: such a lane is left out.
const UNFOLDED_M_MAX: f64 = 2.0;

#[derive(Clone, Copy)]
struct Sample {
    s_m: f64,
    position: Vec2,
    heading_rad: f64,
    curvature_per_m: f64,
    width_m: f64,
    folded: bool,
}

/// Widths below this are a mistake, m; a cubic that ends at zero undershoots a little.
const WIDTH_M_MIN: f64 = -0.1;

/// Why a lane has no centre line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoCentreLine {
    #[error("it has no length")]
    Short,
    /// Its polynomials or curves have values that no road has.
    #[error("it is no road: look at its widths, offsets and curves")]
    Wild,
    /// Its edges would cross, and its centre lie in another lane.
    #[error("it becomes narrower than nothing: look at its widths")]
    Inverted,
    #[error("it runs backwards in a bend")]
    Folded,
    #[error("its road turns too sharply")]
    Broken,
}

/// Samples the centre of a lane of a section. Adds its steps of work to `steps`, even if it fails: for each place the steps of
/// the reference line, and one step for each lane between.
///
/// # Errors
/// If the lane is too short, too large, or narrower than zero.
pub fn centre_line(
    road: &RoadElement,
    section: &SectionElement,
    lane: i32,
    steps: &Cell<u64>,
) -> Result<CentreLine, NoCentreLine> {
    if road.reference.breaks_between(section.begin_m - 1e-6, section.end_m + 1e-6) {
        return Err(NoCentreLine::Broken);
    }
    let of_reference = road.reference.beginnings_between(section.begin_m, section.end_m);
    let of_offset = road.lane_offset.beginnings_between(section.begin_m, section.end_m);
    let mut breaks_m: Vec<f64> = of_reference.chain(of_offset).collect();
    for element in section.lanes.iter().filter(|element| element.id.signum() == lane.signum()) {
        let within = element.widths.beginnings().chain(element.borders.beginnings());
        breaks_m.extend(within.map(|begin_m| section.begin_m + begin_m));
    }
    breaks_m.retain(|at_m| *at_m > section.begin_m + 1e-6 && *at_m < section.end_m - 1e-6);
    breaks_m.extend([section.begin_m, section.end_m]);
    breaks_m.sort_by(f64::total_cmp);
    breaks_m.dedup_by(|a, b| (*a - *b).abs() < 1e-6);

    let curve = Curve { road, across: road.across(section, lane), left_at: Cell::default(), steps };
    let mut samples: Vec<Sample> = Vec::new();
    for (i, piece) in breaks_m.windows(2).enumerate() {
        let (begin_m, limit_m) = (piece[0], piece[1]);
        // At its end the polynomials of the next piece hold; just before it still those of this piece.
        let mut end_m = limit_m - 1e-7;
        if i + 2 < breaks_m.len() {
            end_m -= curve.retreat_m(end_m, limit_m).min((limit_m - begin_m) / 2.0);
        }
        curve.sample(curve.at(begin_m), curve.at(end_m), &mut samples);
    }
    let tame = |sample: &Sample| {
        let numbers = [sample.heading_rad, sample.curvature_per_m, sample.width_m];
        let finite = numbers.iter().all(|number| number.is_finite());
        finite && sample.position.iter().all(|part| part.abs() < COORDINATE_M_MAX)
    };
    if samples.len() > SAMPLES_MAX || !samples.iter().all(tame) {
        return Err(NoCentreLine::Wild);
    }
    if samples.iter().any(|sample| sample.width_m < WIDTH_M_MIN) {
        return Err(NoCentreLine::Inverted);
    }
    let unfolded = unfold(&mut samples)?;
    // `Path` drops points that coincide; the lists of widths and stations must drop the same ones.
    samples.dedup_by(|b, a| (b.position - a.position).norm() < 1e-5);
    if !road.runs_along(lane) {
        samples.reverse();
        for sample in &mut samples {
            sample.heading_rad += core::f64::consts::PI;
            sample.curvature_per_m = -sample.curvature_per_m;
        }
    }
    let points = samples.iter().map(|p| (p.position, wrap_angle(p.heading_rad), p.curvature_per_m));
    let path = Path::new(points).ok_or(NoCentreLine::Short)?;
    debug_assert_eq!(path.points().len(), samples.len());
    if path.length_m() > LANE_M_MAX {
        return Err(NoCentreLine::Wild);
    }
    Ok(CentreLine {
        path,
        widths_m: samples.iter().map(|sample| sample.width_m.max(0.0)).collect(),
        road_stations_m: samples.iter().map(|sample| sample.s_m).collect(),
        unfolded,
    })
}

/// Cuts off the loops in which a lane runs backwards, and tells the largest; `None` if there are none to speak of.
fn unfold(samples: &mut Vec<Sample>) -> Result<Option<Unfolded>, NoCentreLine> {
    let mut largest: Option<Unfolded> = None;
    let mut from = 0;
    while let Some(back) =
        (from..samples.len().saturating_sub(1)).find(|i| runs_back(samples[*i], samples[*i + 1]))
    {
        let (first, last, crossing) = loop_around(samples, back).ok_or(NoCentreLine::Folded)?;
        let reach_m = |sample: &Sample| (sample.position - crossing.position).norm();
        let off_m = samples[first + 1..=last].iter().map(reach_m).fold(0.0, f64::max);
        if off_m > UNFOLDED_M_MAX {
            return Err(NoCentreLine::Folded);
        }
        samples.splice(first + 1..=last, [crossing]);
        if off_m > UNFOLDED_M_MIN && largest.is_none_or(|known| known.off_m < off_m) {
            largest = Some(Unfolded { position: crossing.position, off_m });
        }
        from = first + 1;
    }
    Ok(largest)
}

/// Whether the way from one sample to the next leads against the road.
fn runs_back(a: Sample, b: Sample) -> bool {
    let heading_rad = a.heading_rad + wrap_angle(b.heading_rad - a.heading_rad) / 2.0;
    let step = b.position - a.position;
    step.norm() > LEAP_M_MIN && step.dot(&unit_vector(heading_rad)) < -0.5 * step.norm()
}

/// How many samples before and after a step that leads backwards its loop may have.
const LOOP_SAMPLES: usize = 400;

/// The loop around a step that leads backwards: the last sample before it, the last sample of it, and the sample
/// in its place, where the lane crosses itself. Where it crosses nothing, because it only overlaps, the lane goes
/// on with the first sample that lies ahead again.
fn loop_around(samples: &[Sample], back: usize) -> Option<(usize, usize, Sample)> {
    let behind = back + 1..(back + LOOP_SAMPLES).min(samples.len() - 1);
    for first in (back.saturating_sub(LOOP_SAMPLES)..back).rev() {
        for last in behind.clone() {
            let [a, b, c, d] = [first, first + 1, last, last + 1].map(|i| samples[i]);
            if let Some((x, _)) = segment_crossing(a.position, b.position, c.position, d.position) {
                let s_m = (a.s_m + (b.s_m - a.s_m) * x).min(d.s_m);
                let position = a.position + (b.position - a.position) * x;
                return Some((first, last, Sample { s_m, position, folded: false, ..a }));
            }
        }
    }
    let last = behind.into_iter().find(|last| !runs_back(samples[back], samples[last + 1]))?;
    Some((back.checked_sub(1)?, last, samples[back]))
}

/// A lane's centre as a function of the road's station.
struct Curve<'a> {
    road: &'a RoadElement,
    across: Across<'a>,
    /// The heading that was met last, rad, and the unit vector to its left: a straight has one for all its places.
    left_at: Cell<Option<(f64, Vec2)>>,
    steps: &'a Cell<u64>,
}

impl Curve<'_> {
    /// The offset curve `R + t N` of the reference line `R`: with `T' = k N` and `N' = -k T` its
    /// derivatives are `(1 - k t) T + t' N` and `-(k' t + 2 k t') T + ((1 - k t) k + t'') N`.
    fn at(&self, s_m: f64) -> Sample {
        let steps = self.road.reference.place_steps() + self.across.lane_count() as u64;
        self.steps.set(self.steps.get() + steps);
        let reference = self.road.reference.at(s_m);
        let (t, width) = self.across.at(s_m);
        let (k, k_rate) = (reference.curvature_per_m, reference.curvature_rate_per_m2);
        let (ahead, aside) = (1.0 - k * t.value, t.first);
        let (ahead_rate, aside_rate) =
            (-(k_rate * t.value + 2.0 * k * t.first), (1.0 - k * t.value) * k + t.second);
        let speed = libm::sqrt(ahead * ahead + aside * aside);
        let folded = ahead < 1e-3;
        let curvature_per_m =
            if folded { 0.0 } else { (ahead * aside_rate - aside * ahead_rate) / (speed * speed * speed) };
        // Where the lane runs beside the line, `atan2` gives the 0 that it is asked about.
        let turned_rad = if aside == 0.0 { aside } else { libm::atan2(aside, ahead) };
        let heading_rad = reference.heading_rad + if folded { 0.0 } else { turned_rad };
        let left = match self.left_at.get() {
            Some((known_rad, left)) if known_rad.to_bits() == reference.heading_rad.to_bits() => left,
            _ => {
                let (sin, cos) = libm::sincos(reference.heading_rad);
                let left = Vec2::new(-sin, cos);
                self.left_at.set(Some((reference.heading_rad, left)));
                left
            }
        };
        Sample {
            s_m,
            position: reference.position + left * t.value,
            heading_rad,
            curvature_per_m,
            width_m: width.value,
            folded,
        }
    }

    /// How far before a break the last vertex of a piece lies, m; `before_m` is a station just before it.
    fn retreat_m(&self, before_m: f64, break_m: f64) -> f64 {
        let (before, after) = (self.at(before_m), self.at(break_m));
        let turns = wrap_angle(after.heading_rad - before.heading_rad).abs() > TURN_RAD_MIN;
        if turns || (after.position - before.position).norm() > LEAP_M_MIN {
            TURN_M
        } else if (after.curvature_per_m - before.curvature_per_m).abs() > JUMP_PER_M_MIN {
            JUMP_M
        } else {
            0.0
        }
    }

    /// Appends both ends and the vertices needed between them.
    fn sample(&self, begin: Sample, end: Sample, samples: &mut Vec<Sample>) {
        samples.push(begin);
        let steps = if self.is_straight(begin, end) {
            1
        } else {
            ((end.s_m - begin.s_m) / CHORD_M_MAX).ceil().max(1.0) as usize
        };
        let mut from = begin;
        for i in 1..=steps {
            let fraction = i as f64 / steps as f64;
            let to = if i == steps { end } else { self.at(begin.s_m + (end.s_m - begin.s_m) * fraction) };
            self.refine(from, self.between(from, to), to, 12, samples);
            samples.push(to);
            from = to;
        }
    }

    /// The point at the middle station.
    fn between(&self, begin: Sample, end: Sample) -> Sample {
        self.at((begin.s_m + end.s_m) / 2.0)
    }

    /// Appends points strictly between two until the chords are near enough; `middle` is the point at the
    /// middle station. A point takes long to compute, so each level hands the points that it has computed to
    /// the next.
    fn refine(&self, begin: Sample, middle: Sample, end: Sample, depth: u32, samples: &mut Vec<Sample>) {
        if depth == 0 || samples.len() > SAMPLES_MAX {
            return;
        }
        let (early, late) = (self.between(begin, middle), self.between(middle, end));
        let quarters = [early, middle, late];
        if deviation_m(begin, quarters, end) < CHORD_ERROR_M && interpolates(begin, middle, end) {
            return;
        }
        self.refine(begin, early, middle, depth - 1, samples);
        samples.push(middle);
        self.refine(middle, late, end, depth - 1, samples);
    }

    fn is_straight(&self, begin: Sample, end: Sample) -> bool {
        let same_heading = |other: Sample| (other.heading_rad - begin.heading_rad).abs() < 1e-9;
        let middle = self.between(begin, end);
        if !same_heading(middle) || !same_heading(end) {
            return false;
        }
        let quarters = [self.between(begin, middle), middle, self.between(middle, end)];
        deviation_m(begin, quarters, end) < 1e-6
    }
}

/// Whether linear interpolation gives nearly the curve's station and heading at the middle of the chord.
fn interpolates(begin: Sample, middle: Sample, end: Sample) -> bool {
    let chord = end.position - begin.position;
    let length_m = chord.norm().max(1e-9);
    let ahead_m = chord.dot(&(middle.position - begin.position)) / length_m;
    let turned_rad = wrap_angle(end.heading_rad - begin.heading_rad);
    let heading_rad = begin.heading_rad + turned_rad * (ahead_m / length_m);
    let aside_rad = wrap_angle(middle.heading_rad - heading_rad).abs();
    middle.folded || aside_rad < HEADING_ERROR_RAD && (ahead_m - length_m / 2.0).abs() < STATION_ERROR_M
}

/// Largest distance of the curve from its chord, or of the width from its linear interpolation, m.
fn deviation_m(begin: Sample, quarters: [Sample; 3], end: Sample) -> f64 {
    let chord = end.position - begin.position;
    let length_m = chord.norm().max(1e-9);
    let mut deviation_m: f64 = 0.0;
    for (fraction, between) in [0.25, 0.5, 0.75].into_iter().zip(quarters) {
        let delta = between.position - begin.position;
        let width_m = begin.width_m + (end.width_m - begin.width_m) * fraction;
        let aside_m = (chord.x * delta.y - chord.y * delta.x).abs() / length_m;
        deviation_m = deviation_m.max(aside_m).max((between.width_m - width_m).abs());
    }
    deviation_m
}
