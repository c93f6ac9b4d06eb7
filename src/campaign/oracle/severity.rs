//! How hard a collision was.
//!
//! Delta-v is the change of velocity of a perfectly inelastic impact of two bodies across the gap that closes:
//! `m2 / (m1 + m2)` of the speed at which it closes where they meet. Sliding along the contact changes nothing,
//! so a scrape at 20 m/s is no crash at 20 m/s. Both are taken to be hit in line with their centres; an impact
//! beside them turns the bodies and changes their velocity less, so this is an upper bound. The world carries the same
//! impact out (`world::step::contact`), as far as a car can follow: neither backwards nor sideways.
//!
//! Three classes ([`Harm`]) give the harm to people, by the speed at which one in ten is seriously injured (MAIS 3 and
//! more). Such speeds describe whole populations of people and cars. So they order findings, and do not tell the outcome
//! of a single crash.

use crate::episode::Collision;
use avastra_base::geometry::Vec2;
use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::VehicleParameters;

use crate::episode::side;

/// How hard an impact was.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Severity {
    /// Speed at which the gap closed where the outlines met, m/s.
    pub closing_speed_mps: f64,
    /// Speed of the two relative to each other, m/s.
    pub relative_speed_mps: f64,
    /// Change of velocity of the ego vehicle, m/s.
    pub delta_v_mps: f64,
    /// Change of velocity of the obstacle, m/s.
    pub obstacle_delta_v_mps: f64,
    /// Where the ego vehicle was hit: `front`, `front left`, `front right` (its corners), `left`, `right`
    /// or `rear`.
    pub side: &'static str,
    /// How the obstacle moved, seen from the ego vehicle: `standing`, `along` with it, `oncoming`,
    /// `from the left` or `from the right`.
    pub approach: &'static str,
    /// The speed of the impact as a share of that at which one person in ten is seriously injured.
    pub harm_share: f64,
    pub harm: Harm,
}

/// The harm of an impact to people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Harm {
    /// Between vehicles, or with a thing, below walking pace.
    Minor,
    Moderate,
    /// At least one person in ten is seriously injured at such a speed.
    Serious,
}

impl Harm {
    pub fn name(self) -> &'static str {
        match self {
            Harm::Minor => "minor",
            Harm::Moderate => "moderate",
            Harm::Serious => "serious",
        }
    }
}

/// Closing speeds at which one in ten is seriously injured by the front of a car, m/s: Lubbe, Wu and Jeppsson 2022 (Traffic
/// Safety Research 2, 000006), from German crashes.
const PEDESTRIAN_MPS: f64 = 29.0 / 3.6;
const CYCLIST_MPS: f64 = 44.0 / 3.6;
const MOTORCYCLIST_MPS: f64 = 48.0 / 3.6;
/// The same among cars, m/s, front to front and front to side, from crashes in the United States. Source: Campolettano and
/// others, "TARGET setting for high severity collisions", Traffic Safety Research. Front to rear they have 126 km/h for
/// people in front; the front's speed holds for people behind.
const FRONT_MPS: f64 = 99.0 / 3.6;
const SIDE_MPS: f64 = 73.0 / 3.6;
/// Walking pace, m/s. Ours.
const WALKING_MPS: f64 = 1.4;

/// The speed of an impact, and that at which one in ten is seriously injured, m/s. Cars of unequal mass are hit as if by their
/// like at twice the larger delta-v.
fn harm(severity: &Severity, body: Body) -> (f64, f64) {
    let is_side = matches!(severity.side, "left" | "right") || severity.approach.starts_with("from");
    let of_mps = |delta_v_mps: f64| (2.0 * delta_v_mps, if is_side { SIDE_MPS } else { FRONT_MPS });
    match body {
        Body::Pedestrian => (severity.closing_speed_mps, PEDESTRIAN_MPS),
        Body::Bicycle => (severity.closing_speed_mps, CYCLIST_MPS),
        Body::Motorcycle => (severity.closing_speed_mps, MOTORCYCLIST_MPS),
        // Only the ego vehicle has people in it.
        Body::Animal | Body::Object => of_mps(severity.delta_v_mps),
        Body::BoxTruck | Body::SchoolBus | Body::Jeep | Body::Sedan | Body::SUV | Body::Hatchback => {
            of_mps(severity.delta_v_mps.max(severity.obstacle_delta_v_mps))
        }
    }
}

/// The severity of a collision.
pub fn severity(collision: &Collision) -> Severity {
    let contact = &collision.contact;
    let obstacle_mps = contact.obstacle_velocity_on_ego_mps;
    let (ahead_mps, left_mps) = (contact.ego_speed_mps - obstacle_mps.x, obstacle_mps.y);
    let relative_speed_mps = (ahead_mps * ahead_mps + left_mps * left_mps).sqrt();
    let (ego_t, other_t) = (VehicleParameters::MKZ.mass_t, collision.mass_t);
    let part = |mass_t: f64| mass_t / (ego_t + other_t) * contact.closing_speed_mps;
    let mut severity = Severity {
        closing_speed_mps: contact.closing_speed_mps,
        relative_speed_mps,
        delta_v_mps: part(other_t),
        obstacle_delta_v_mps: part(ego_t),
        side: side(contact.on_ego, &VehicleParameters::MKZ),
        approach: approach(obstacle_mps),
        harm_share: 0.0,
        harm: Harm::Moderate,
    };
    let body = collision.body.like;
    let (speed_mps, serious_mps) = harm(&severity, body);
    severity.harm_share = speed_mps / serious_mps;
    severity.harm = match () {
        () if severity.harm_share >= 1.0 => Harm::Serious,
        // A touch stays one, however heavy the other is.
        () if speed_mps.min(severity.closing_speed_mps) < WALKING_MPS
            && body.is_vehicle()
            && !body.has_two_wheels() =>
        {
            Harm::Minor
        }
        () => Harm::Moderate,
    };
    severity
}

/// How the obstacle moves, by its velocity in the ego vehicle's frame: x ahead, y left.
fn approach(velocity_mps: Vec2) -> &'static str {
    match velocity_mps {
        v if v.norm() < STANDING_MPS => "standing",
        v if v.y.abs() <= v.x.abs() && v.x > 0.0 => "along",
        v if v.y.abs() <= v.x.abs() => "oncoming",
        v if v.y > 0.0 => "from the right",
        _ => "from the left",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::{PreCrash, Shape};
    use avastra_lang::model::BodyWord;
    use avastra_lang::model::body::parameters;
    use avastra_lang::model::vocabulary::{Body, Verb};
    use avastra_world::sim::{Contact, Ruling};

    #[test]
    fn momentum_is_kept() {
        let contact = Contact {
            time_s: 10.0,
            obstacle: 1,
            point: Vec2::zeros(),
            on_ego: Vec2::new(2.4, 0.3),
            ego_speed_mps: 8.0,
            obstacle_velocity_mps: Vec2::zeros(),
            obstacle_velocity_on_ego_mps: Vec2::new(4.0, 3.0),
            closing_speed_mps: 4.0,
            ruling: Ruling::default(),
        };
        for body in [Body::SchoolBus, Body::Hatchback, Body::Pedestrian] {
            let mass_t = parameters(body).mass_t;
            let collision = Collision {
                shape: Shape::Straight,
                kind: PreCrash::Other,
                contact,
                step: 0,
                body: BodyWord::engine(body),
                mass_t,
                verb: Verb::DriveAhead,
                spawned_s: 5.0,
            };
            let found = severity(&collision);
            assert_eq!((found.relative_speed_mps, found.side, found.approach), (5.0, "front", "along"));
            // It closes at 4 m/s; 3 m/s along the bumper do nothing.
            assert!((found.delta_v_mps + found.obstacle_delta_v_mps - 4.0).abs() < 1e-12);
            let (ego_t, other_t) = (VehicleParameters::MKZ.mass_t, parameters(body).mass_t);
            assert!((ego_t * found.delta_v_mps - other_t * found.obstacle_delta_v_mps).abs() < 1e-9);
            let share = |body| harm(&found, body).0;
            // What the others in it would feel does not count where there are none.
            assert!((share(Body::Object) - 2.0 * found.delta_v_mps).abs() < 1e-12);
            assert!(share(Body::Sedan) >= share(Body::Object));
        }
    }
}
