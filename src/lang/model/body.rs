//! Bodies of road users: dimensions, axles, masses, acceleration and brakes.
//!
//! Typical cars of each class, in the absence of published dimensions of LGSVL's models; the truck
//! and the bus brake better than FMVSS 121 demands on average (3.8 and 4.2 m/s²). Wheelbases are those of a
//! typical sedan (2.80 m), Golf, SUV, four-door Wrangler, 16 to 20 ft box truck and American school bus of
//! type C. The rear overhangs are ours, about 0.6 of what the wheelbase leaves of the length. A motorcycle is one of
//! 125 to 500 cm³ and a bicycle one of 28 inches, both with their riders. The animal is a deer, the object a box of goods;
//! ours.

use crate::model::vocabulary::Body;

/// A body of the author's own, as a spawn asks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnBody {
    /// Index in [`Space::bodies`](super::Space::bodies).
    pub index: usize,
    pub shape: BodyParameters,
}

/// The body that a spawn names: a body of the engine, or a declared body that is like one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyWord {
    pub like: Body,
    /// Index in [`Space::bodies`](super::Space::bodies).
    pub own: Option<usize>,
}

impl BodyWord {
    /// A body of the engine.
    pub const fn engine(like: Body) -> BodyWord {
        BodyWord { like, own: None }
    }

    /// Whether this is what a body of that name means: one of the engine's names stands for the author's own that are
    /// like it, too.
    pub fn is(self, named: BodyWord) -> bool {
        self.like == named.like && (named.own.is_none() || self.own == named.own)
    }
}

/// The size of a body and its abilities on a dry road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyParameters {
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// From the rear axle to the front axle; 0 for a pedestrian.
    pub wheelbase_m: f64,
    /// From the rear axle to the centre of the outline.
    pub rear_axle_m: f64,
    pub mass_t: f64,
    pub acceleration_mps2_max: f64,
    /// Magnitude.
    pub deceleration_mps2_max: f64,
}

/// The default share of the length beside the wheelbase that lies behind the rear axle, for a declared body.
pub const REAR_PART: f64 = 0.6;

/// The values that a declared body changes; the other values are those of the body that it is like.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Changes {
    pub length_m: Option<f64>,
    pub width_m: Option<f64>,
    pub height_m: Option<f64>,
    pub wheelbase_m: Option<f64>,
    pub mass_t: Option<f64>,
    pub acceleration_mps2_max: Option<f64>,
    pub deceleration_mps2_max: Option<f64>,
}

impl BodyParameters {
    /// These parameters with changes. Axles keep their places in proportion to the length, unless the wheelbase is
    /// given.
    pub fn changed(self, changes: &Changes) -> BodyParameters {
        let length_m = changes.length_m.unwrap_or(self.length_m);
        let scale = length_m / self.length_m;
        let (wheelbase_m, rear_axle_m) = match changes.wheelbase_m {
            Some(wheelbase_m) => (wheelbase_m, length_m / 2.0 - REAR_PART * (length_m - wheelbase_m)),
            None => (self.wheelbase_m * scale, self.rear_axle_m * scale),
        };
        BodyParameters {
            length_m,
            width_m: changes.width_m.unwrap_or(self.width_m),
            height_m: changes.height_m.unwrap_or(self.height_m),
            wheelbase_m,
            rear_axle_m,
            mass_t: changes.mass_t.unwrap_or(self.mass_t),
            acceleration_mps2_max: changes.acceleration_mps2_max.unwrap_or(self.acceleration_mps2_max),
            deceleration_mps2_max: changes.deceleration_mps2_max.unwrap_or(self.deceleration_mps2_max),
        }
    }
}

/// The parameters of a body of the engine.
pub fn parameters(body: Body) -> BodyParameters {
    let of = |[length_m, width_m, height_m]: [f64; 3],
              [wheelbase_m, rear_overhang_m]: [f64; 2],
              mass_t,
              acceleration_mps2_max,
              deceleration_mps2_max| BodyParameters {
        length_m,
        width_m,
        height_m,
        wheelbase_m,
        rear_axle_m: length_m / 2.0 - rear_overhang_m,
        mass_t,
        acceleration_mps2_max,
        deceleration_mps2_max,
    };
    match body {
        Body::Jeep => of([4.79, 1.88, 1.87], [3.01, 1.05], 2.00, 2.5, 7.0),
        Body::Sedan => of([4.80, 1.85, 1.45], [2.80, 1.10], 1.55, 3.0, 8.0),
        Body::SUV => of([4.70, 1.90, 1.70], [2.75, 1.05], 1.85, 2.8, 7.8),
        Body::Hatchback => of([4.28, 1.79, 1.46], [2.62, 0.78], 1.30, 3.0, 8.0),
        Body::BoxTruck => of([7.50, 2.40, 3.20], [4.2, 2.0], 6.0, 1.5, 5.5),
        Body::SchoolBus => of([11.0, 2.44, 3.10], [6.6, 2.6], 11.0, 1.2, 5.0),
        Body::Pedestrian => of([0.5, 0.5, 1.75], [0.0, 0.25], 0.075, 1.5, 1.5),
        Body::Motorcycle => of([2.10, 0.80, 1.50], [1.40, 0.35], 0.25, 3.5, 7.0),
        Body::Bicycle => of([1.80, 0.60, 1.75], [1.05, 0.37], 0.090, 1.0, 3.5),
        Body::Animal => of([1.60, 0.50, 1.20], [0.0, 0.80], 0.080, 4.0, 4.0),
        Body::Object => of([1.00, 1.00, 0.80], [0.0, 0.50], 0.050, 1.0, 4.0),
    }
}
