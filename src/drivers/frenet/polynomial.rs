//! The two polynomials of least jerk that Werling's sampling is made of.
//!
//! Werling, Ziegler, Kammel and Thrun 2010, section IV: a quintic goes from a state to a state, a quartic from
//! a state to a speed, wherever that is reached.

use crate::kit::Aside;

/// A shift to a constant offset: the quintic of least jerk over a length.
///
/// The paper plans the offset over the time, and at low speeds over the distance. Here it is over the distance
/// at every speed, so that one curve serves every speed along it, and a vehicle that stops does not slide
/// sideways.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quintic {
    terms: [f64; 6],
    pub length_m: f64,
}

impl Quintic {
    /// From an offset, slope and curvature to a goal (m to the left) over a length.
    pub fn shift(from: Aside, goal_m: f64, length_m: f64) -> Quintic {
        let l = length_m;
        let (offset, slope, bend) = (from.offset_m, from.slope, from.curvature_per_m);
        let away = goal_m - offset - (slope + bend / 2.0 * l) * l;
        let (turn, unbend) = (-slope - bend * l, -bend);
        let cubic = (10.0 * away - (4.0 * turn - unbend / 2.0 * l) * l) / (l * l * l);
        let quartic = (-15.0 * away + (7.0 * turn - unbend * l) * l) / (l * l * l * l);
        let quintic = (6.0 * away - (3.0 * turn - unbend / 2.0 * l) * l) / (l * l * l * l * l);
        Quintic { terms: [offset, slope, bend / 2.0, cubic, quartic, quintic], length_m }
    }

    /// Offset, slope and curvature after a distance; before the beginning and beyond the end they are constant.
    pub fn at(&self, distance_m: f64) -> Aside {
        let x = distance_m.clamp(0.0, self.length_m);
        let [c0, c1, c2, c3, c4, c5] = self.terms;
        Aside {
            offset_m: c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5)))),
            slope: c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5))),
            curvature_per_m: 2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5)),
        }
    }

    /// The same curve, beside a guide that lies `left_m` to the left of the present one.
    pub fn beside(mut self, left_m: f64) -> Quintic {
        self.terms[0] -= left_m;
        self
    }

    /// Integral of the squared jerk at a constant speed, m²/s⁵.
    pub fn squared_jerk(&self, speed_mps: f64) -> f64 {
        let l = self.length_m;
        let (a, b, c) = (6.0 * self.terms[3], 24.0 * self.terms[4], 60.0 * self.terms[5]);
        let over_m = l
            * (a * a + l * (a * b + l * ((b * b + 2.0 * a * c) / 3.0 + l * (b * c / 2.0 + l * c * c / 5.0))));
        let square = speed_mps * speed_mps;
        square * square * speed_mps * over_m
    }
}

/// A change of speed: the quartic of least jerk over a time, which ends without acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quartic {
    /// Acceleration at the beginning, m/s², and its two slopes.
    start_mps2: f64,
    jerk: f64,
    snap: f64,
    pub time_s: f64,
}

impl Quartic {
    /// From a speed and an acceleration to a speed.
    pub fn to_speed(speed_mps: f64, acceleration_mps2: f64, goal_mps: f64, time_s: f64) -> Quartic {
        let gain_mps = goal_mps - speed_mps - acceleration_mps2 * time_s;
        let cubic = (gain_mps + acceleration_mps2 * time_s / 3.0) / (time_s * time_s);
        let quartic = -(acceleration_mps2 + 6.0 * cubic * time_s) / (12.0 * time_s * time_s);
        Quartic { start_mps2: acceleration_mps2, jerk: 6.0 * cubic, snap: 24.0 * quartic, time_s }
    }

    /// Acceleration after a time, m/s²; none after the end.
    pub fn acceleration_mps2(&self, time_s: f64) -> f64 {
        if time_s >= self.time_s {
            return 0.0;
        }
        self.start_mps2 + time_s * (self.jerk + time_s / 2.0 * self.snap)
    }

    /// Integral of the squared jerk, m²/s⁵.
    pub fn squared_jerk(&self) -> f64 {
        let (t, jerk, snap) = (self.time_s, self.jerk, self.snap);
        t * (jerk * jerk + t * (jerk * snap + t * snap * snap / 3.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral from 0 to `end`, by the middle of small steps.
    fn integral(end: f64, value: impl Fn(f64) -> f64) -> f64 {
        let step = end / 1000.0;
        (0..1000).map(|i| value((f64::from(i) + 0.5) * step) * step).sum()
    }

    #[test]
    fn a_quintic_begins_and_ends_as_asked() {
        let from = Aside { offset_m: 0.4, slope: 0.05, curvature_per_m: -0.01 };
        let curve = Quintic::shift(from, -1.0, 30.0);
        assert_eq!(curve.at(0.0), from);
        let end = curve.at(30.0);
        assert!((end.offset_m + 1.0).abs() < 1e-9 && end.slope.abs() < 1e-9, "{end:?}");
        assert!(end.curvature_per_m.abs() < 1e-9);
        let jerk =
            |x: f64| (curve.at(x + 1e-4).curvature_per_m - curve.at(x - 1e-4).curvature_per_m) / 2e-4 * 512.0;
        let expected = integral(30.0, |x| jerk(x) * jerk(x)) / 8.0;
        assert!((curve.squared_jerk(8.0) / expected - 1.0).abs() < 1e-3, "{expected}");
        assert!((curve.beside(3.5).at(10.0).offset_m - curve.at(10.0).offset_m + 3.5).abs() < 1e-12);
    }

    #[test]
    fn a_quartic_reaches_its_speed_without_acceleration() {
        let profile = Quartic::to_speed(9.0, 0.8, 4.0, 3.0);
        assert_eq!(profile.acceleration_mps2(0.0), 0.8);
        assert!(profile.acceleration_mps2(3.0 - 1e-9).abs() < 1e-6);
        let gain_mps = integral(3.0, |t| profile.acceleration_mps2(t));
        assert!((gain_mps + 5.0).abs() < 1e-3, "{gain_mps}");
        let jerk =
            |t: f64| (profile.acceleration_mps2(t + 1e-5) - profile.acceleration_mps2(t - 1e-5)) / 2e-5;
        let expected = integral(3.0 - 1e-4, |t| jerk(t) * jerk(t));
        assert!((profile.squared_jerk() / expected - 1.0).abs() < 1e-2, "{expected}");
    }
}
