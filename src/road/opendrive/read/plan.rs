//! Reads the plan view of a road: its curves.

use crate::RoadError;
use avastra_base::geometry::Vec2;

use super::super::geometry::{Piece, ReferenceLine, Shape};
use super::super::xml::Element;
use super::Reader;

/// Limit on the turn of one curve, rad; a real curve turns by a few.
const TURN_RAD_MAX: f64 = 200.0;

impl Reader {
    pub(super) fn reference_line(
        &mut self,
        road: Element,
        id: &str,
        length_m: f64,
    ) -> Result<ReferenceLine, RoadError> {
        let plan =
            road.child("planView").ok_or_else(|| road.wrong(format!("road `{id}` lacks its `planView`")))?;
        let mut pieces: Vec<Piece> = Vec::new();
        for geometry in plan.children("geometry") {
            if geometry.number("length")? < 1e-9 {
                // Some tools write empty curves; they hold nothing.
                continue;
            }
            pieces.push(piece(geometry)?);
        }
        pieces.sort_by(|a, b| a.begin_m.total_cmp(&b.begin_m));
        let end_m = pieces.last().map_or(0.0, |last| last.begin_m + last.length_m);
        let mut reference = ReferenceLine::new(pieces)
            .ok_or_else(|| plan.wrong(format!("road `{id}` has no `geometry` of any length")))?;
        if (end_m - length_m).abs() > 0.1 {
            self.warn(road, format!("road `{id}` is {length_m} m long, but its curves end at {end_m:.3} m"));
        }
        let (gap_m, at_m) = reference.largest_gap();
        if gap_m > 0.05 {
            self.warn(plan, format!("the curves of road `{id}` leave a gap of {gap_m:.3} m at s {at_m:.3}"));
        }
        let corners = reference.round_corners();
        let rounded = || corners.iter().filter_map(|corner| Some((corner, corner.off_m?)));
        let sharpest = rounded().max_by(|a, b| a.0.turn_rad.abs().total_cmp(&b.0.turn_rad.abs()));
        if let Some((sharpest, _)) = sharpest {
            let off_m = rounded().map(|(_, off_m)| off_m).fold(0.0, f64::max);
            let message = format!(
                "the curves of road `{id}` meet at {} angles, the largest {:.1} degrees at s {:.3}: they are rounded, \
                 by up to {off_m:.2} m",
                rounded().count(),
                sharpest.turn_rad.to_degrees().abs(),
                sharpest.at_m
            );
            self.warn_at(plan, sharpest.position, message);
        }
        for corner in corners.iter().filter(|corner| corner.off_m.is_none()) {
            let message = format!(
                "road `{id}` turns by {:.1} degrees at s {:.3}: its lanes are left out there",
                corner.turn_rad.to_degrees().abs(),
                corner.at_m
            );
            self.warn_at(plan, corner.position, message);
        }
        Ok(reference)
    }
}

fn piece(geometry: Element) -> Result<Piece, RoadError> {
    let length_m = geometry.number("length")?;
    let shape = match geometry.elements().find(|shape| shape.name() != "userData") {
        None => return Err(geometry.wrong("`geometry` lacks its shape, such as `line` or `arc`")),
        Some(shape) => match shape.name() {
            "line" => Shape::Line,
            "arc" => Shape::Arc { curvature_per_m: curvature(shape, "curvature", length_m)? },
            "spiral" => {
                let (begin_per_m, end_per_m) =
                    (curvature(shape, "curvStart", length_m)?, curvature(shape, "curvEnd", length_m)?);
                Shape::spiral(begin_per_m, end_per_m, length_m)
            }
            "paramPoly3" => {
                let p_max = if shape.attribute("pRange") == Some("arcLength") { length_m } else { 1.0 };
                let u = [shape.number("aU")?, shape.number("bU")?, shape.number("cU")?, shape.number("dU")?];
                let v = [shape.number("aV")?, shape.number("bV")?, shape.number("cV")?, shape.number("dV")?];
                cubic_shape(shape, u, v, p_max, length_m)?
            }
            "poly3" => {
                let v = [shape.number("a")?, shape.number("b")?, shape.number("c")?, shape.number("d")?];
                poly3(shape, v, length_m)?
            }
            name => return Err(shape.wrong(format!("unknown geometry `{name}`"))),
        },
    };
    let begin_m = geometry.number("s")?;
    let origin = Vec2::new(geometry.number("x")?, geometry.number("y")?);
    Ok(Piece::new(begin_m, length_m, (origin, geometry.number("hdg")?), shape))
}

fn curvature(shape: Element, name: &str, length_m: f64) -> Result<f64, RoadError> {
    let per_m = shape.number(name)?;
    if (per_m * length_m).abs() > TURN_RAD_MAX {
        return Err(shape.wrong(format!("a curvature of {per_m} 1/m over {length_m} m is no road")));
    }
    Ok(per_m)
}

fn cubic_shape(
    shape: Element,
    u: [f64; 4],
    v: [f64; 4],
    p_max: f64,
    length_m: f64,
) -> Result<Shape, RoadError> {
    let cubic = Shape::cubic(u, v, p_max).ok_or_else(|| shape.wrong("this curve has no direction"))?;
    let Shape::Cubic { lengths_m, .. } = &cubic else { return Ok(cubic) };
    let own_m = lengths_m[lengths_m.len() - 1];
    if own_m > 2.0 * length_m || own_m < 0.5 * length_m {
        let message = format!("this curve is {own_m:.3} m long, but its geometry says {length_m} m");
        return Err(shape.wrong(message));
    }
    Ok(cubic)
}

/// Rounds in which the last parameter of a `poly3` is found; each comes nearer by a factor of about 64.
const POLY3_ROUNDS: usize = 6;

/// A curve `v(u)`. The file states the length of the curve and not its last `u`, which is at most that length.
fn poly3(shape: Element, v: [f64; 4], length_m: f64) -> Result<Shape, RoadError> {
    let u = [0.0, 1.0, 0.0, 0.0];
    let mut last = length_m;
    for _ in 0..POLY3_ROUNDS {
        let curve = Shape::cubic(u, v, last).ok_or_else(|| shape.wrong("this curve has no direction"))?;
        last = curve.parameter_at(length_m).unwrap_or(last);
    }
    cubic_shape(shape, u, v, last, length_m)
}
