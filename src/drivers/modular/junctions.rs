//! The junctions of the route, as stretches of it.

use avastra_world::sim::Scene;

/// Where the route is inside junctions.
#[derive(Debug, Clone, Default)]
pub struct Junctions {
    /// From and to, m, rising and apart.
    spans_m: Vec<(f64, f64)>,
}

/// Two stretches this near are one junction, m.
const JOINT_M: f64 = 0.5;

impl Junctions {
    pub fn of(scene: &Scene) -> Junctions {
        let mut spans_m: Vec<(f64, f64)> = Vec::new();
        for lane in scene.route.lanes.iter().filter(|on| scene.map.lane(on.lane).junction.is_some()) {
            match spans_m.last_mut() {
                Some(last) if lane.enter_m <= last.1 + JOINT_M => last.1 = lane.to_m.max(last.1),
                _ => spans_m.push((lane.enter_m, lane.to_m)),
            }
        }
        Junctions { spans_m }
    }

    #[cfg(test)]
    pub fn for_tests(spans_m: &[(f64, f64)]) -> Junctions {
        Junctions { spans_m: spans_m.to_vec() }
    }

    pub fn inside(&self, station_m: f64) -> bool {
        self.spans_m.iter().any(|(from_m, to_m)| (*from_m..=*to_m).contains(&station_m))
    }

    /// The junctions that begin between two stations: from and to, m.
    pub fn between(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = (f64, f64)> {
        self.spans_m.iter().copied().filter(move |(enter_m, _)| (from_m..to_m).contains(enter_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{corner, straight};

    #[test]
    fn the_corner_has_junctions_and_a_straight_road_none() {
        assert_eq!(Junctions::of(&straight()).between(0.0, 600.0).count(), 0);
        let junctions = Junctions::of(&corner());
        let spans: Vec<(f64, f64)> = junctions.between(-100.0, 1000.0).collect();
        assert!(!spans.is_empty());
        for (enter_m, exit_m) in spans {
            assert!(enter_m < exit_m && junctions.inside((enter_m + exit_m) / 2.0));
            assert!(!junctions.inside(exit_m + 1.0));
        }
    }
}
