//! Light, weather and grip: what the levels of a scenario mean in physical units.
//!
//! Levels come from the language; the numbers behind them stand here, each with its source. Weather acts at once and everywhere: no drying, no drifting fog.

use crate::model::vocabulary::Level;
use crate::model::vocabulary::Phenomenon;
use crate::model::vocabulary::TimeOfDay;

use super::sense::Conditions;

/// Standard gravity, m/s².
pub(super) const GRAVITY_MPS2: f64 = 9.80665;

/// Light for Morning, Noon and Night, 1 at noon. Ours: a low sun costs a camera some contrast, and
/// street lamps leave it the recognition range that low beams give (35 to 50 %) on few pixels.
const LIGHT: [f64; 3] = [0.8, 1.0, 0.15];
// The levels of the others are None, Light, Moderate, High.
/// Rain, mm/h: bounds of light, moderate and violent rain (WMO).
const RAIN_MMPH: [f64; 4] = [0.0, 2.5, 10.0, 50.0];
/// Meteorological optical range, m: within the classes fog (< 1000), thick (< 200) and dense (< 50).
const VISIBILITY_M: [f64; 4] = [10_000.0, 500.0, 150.0, 50.0];
/// Water on the road, mm. Ours, spaced like the friction table's columns.
const WATER_MM: [f64; 4] = [0.0, 0.1, 0.5, 1.5];
/// Friction at most 50 km/h for these depths of water, between new and worn tyres of Bosch's
/// Automotive Handbook.
const FRICTION: [f64; 4] = [0.85, 0.70, 0.60, 0.52];

/// Time of day and the levels of the three phenomena.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Environment {
    pub time: TimeOfDay,
    pub rain: Level,
    pub fog: Level,
    pub wetness: Level,
}

impl Environment {
    pub fn set(&mut self, phenomenon: Phenomenon, level: Level) {
        match phenomenon {
            Phenomenon::Rain => self.rain = level,
            Phenomenon::Fog => self.fog = level,
            Phenomenon::Wetness => self.wetness = level,
        }
    }

    /// Rain wets the road as much as the wetness of its own level: a dry road in a downpour does
    /// not exist, even where a scenario names the rain alone.
    pub fn conditions(&self) -> Conditions {
        let wet = self.wetness.max(self.rain) as usize;
        Conditions {
            light: LIGHT[self.time as usize],
            rain_mmph: RAIN_MMPH[self.rain as usize],
            visibility_m: VISIBILITY_M[self.fog as usize],
            water_mm: WATER_MM[wet],
            friction: FRICTION[wet],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rain_wets_and_fog_hides() {
        let mut environment =
            Environment { time: TimeOfDay::Noon, rain: Level::None, fog: Level::None, wetness: Level::Light };
        assert_eq!(environment.conditions().friction, 0.70);
        environment.set(Phenomenon::Rain, Level::High);
        environment.set(Phenomenon::Fog, Level::Moderate);
        let conditions = environment.conditions();
        assert_eq!((conditions.friction, conditions.rain_mmph, conditions.visibility_m), (0.52, 50.0, 150.0));
        environment.set(Phenomenon::Rain, Level::None);
        environment.set(Phenomenon::Wetness, Level::None);
        assert_eq!(environment.conditions().friction, 0.85);
    }
}
