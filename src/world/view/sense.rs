//! The input of the ego vehicle's sensors: the truth, cut down to their range. Hidden objects are not left out: each
//! object says how much of it is in sight.
//!
//! This is the physical side of sensing (line of sight, light, weather). A driving system's own picture of it, with
//! its errors and delays, belongs to `ads`.

use avastra_base::geometry::{Frame, OrientedBox, Vec2, larger};

use crate::state::obstacle::Obstacle;

/// Points of an outline to which a line of sight is tried.
const RAYS: usize = 8;

/// Part of an obstacle's outline that can be seen from a point, in `[0, 1]`.
///
/// Lines of sight run to points spread evenly over its width as seen from `eye`. A line that meets a
/// lower body still shows what rises above that body, so a car does not hide a bus wholly. Buildings and
/// the ego vehicle itself hide nothing.
pub fn visible_fraction<'a>(
    eye: Vec2,
    target: &Obstacle,
    obstacles: impl Iterator<Item = &'a Obstacle>,
) -> f64 {
    let towards = target.outline.pose.position - eye;
    let distance_m = towards.norm();
    if distance_m < 1e-6 {
        return 1.0;
    }
    let radius_m = target.outline.radius_m();
    // Most often no road user stands in the way.
    let hides = |other: &&Obstacle| {
        other.id != target.id && may_hide(eye, towards, distance_m, radius_m, &other.outline)
    };
    let mut hiders = obstacles.filter(hides).peekable();
    if hiders.peek().is_none() {
        return 1.0;
    }
    let (first, last) = silhouette(eye, towards, target);
    let rays: [(Vec2, f64); RAYS] = core::array::from_fn(|ray| {
        let point = first + (last - first) * ((ray as f64 + 0.5) / RAYS as f64);
        let reach_m = (point - eye).norm();
        ((point - eye) / reach_m.max(1e-6), reach_m)
    });
    let mut shown = [1.0_f64; RAYS];
    for other in hiders {
        let above = (1.0 - other.height_m / target.height_m).max(0.0);
        let other = Frame::along(&other.outline, other.forward);
        for ((direction, reach_m), shown) in rays.iter().zip(&mut shown) {
            if *shown > above && other.is_hit(eye, *direction, *reach_m) {
                *shown = above;
            }
        }
    }
    shown.iter().map(|shown| shown / RAYS as f64).sum()
}

/// Whether a circle around `other` reaches into the cone that holds the circle of `target_m` around the target, in
/// front of it.
fn may_hide(eye: Vec2, towards: Vec2, distance_m: f64, target_m: f64, other: &OrientedBox) -> bool {
    let delta = other.pose.position - eye;
    let ahead_m = towards.dot(&delta) / distance_m;
    if ahead_m >= distance_m + target_m {
        return false;
    }
    let aside_m = (towards.x * delta.y - towards.y * delta.x).abs() / distance_m;
    let room_m = aside_m - target_m * larger(ahead_m / distance_m, 0.0);
    // Most are so far aside that their circle need not be worked out.
    room_m < other.half_length_m + other.half_width_m && {
        let radius_m = other.radius_m();
        ahead_m > -radius_m && room_m < radius_m
    }
}

/// The outermost corners of an outline as seen from a point: left and right of the line to it.
fn silhouette(eye: Vec2, towards: Vec2, target: &Obstacle) -> (Vec2, Vec2) {
    let seen = Frame::along(&target.outline, target.forward).corners().map(|corner| {
        let delta = corner - eye;
        let slope = (towards.x * delta.y - towards.y * delta.x) / larger(towards.dot(&delta), 1e-6);
        (slope, corner)
    });
    let (mut left, mut right) = (seen[0], seen[0]);
    for corner in seen {
        if corner.0 > left.0 {
            left = corner;
        }
        if corner.0 < right.0 {
            right = corner;
        }
    }
    (left.1, right.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::geometry::Pose;
    use avastra_lang::model::vocabulary::{Body, Colour, ShownLights, Verb};

    fn obstacle(id: u32, body: Body, x_m: f64, y_m: f64) -> Obstacle {
        let size = avastra_lang::model::body::parameters(body);
        Obstacle {
            id,
            body,
            colour: Colour::Red,
            verb: Verb::Stand,
            outline: OrientedBox::new(Pose::new(x_m, y_m, 0.0), size.length_m, size.width_m),
            height_m: size.height_m,
            forward: Vec2::new(1.0, 0.0),
            lane_heading_rad: 0.0,
            velocity_mps: Vec2::zeros(),
            elevation_m: 0.0,
            is_apart: false,
            distance_m: 0.0,
            acceleration_mps2: 0.0,
            spawned_tick: 0,
            lights: ShownLights::Off,
        }
    }

    #[test]
    fn a_bus_hides_and_a_sedan_does_so_in_part() {
        let eye = Vec2::zeros();
        let walker = obstacle(1, Body::Pedestrian, 30.0, 0.0);
        let see = |others: &[Obstacle]| visible_fraction(eye, &walker, others.iter());
        assert_eq!(see(&[walker]), 1.0);
        assert_eq!(see(&[walker, obstacle(2, Body::SchoolBus, 15.0, 0.0)]), 0.0);
        assert_eq!(see(&[walker, obstacle(2, Body::SchoolBus, 45.0, 0.0)]), 1.0);
        assert_eq!(see(&[walker, obstacle(2, Body::SchoolBus, 15.0, 4.0)]), 1.0);
        let over_the_roof = see(&[walker, obstacle(2, Body::Sedan, 15.0, 0.0)]);
        assert!((over_the_roof - (1.0 - 1.45 / 1.75)).abs() < 1e-9, "{over_the_roof}");
    }

    #[test]
    fn half_hidden_is_half_seen() {
        let target = obstacle(1, Body::Sedan, 40.0, 0.0);
        let mut wall = obstacle(2, Body::BoxTruck, 20.0, 0.0);
        // Its left flank lies on the line of sight to the target's middle.
        wall.outline.pose.position.y = -wall.outline.half_width_m;
        assert_eq!(visible_fraction(Vec2::zeros(), &target, [target, wall].iter()), 0.5);
    }
}
