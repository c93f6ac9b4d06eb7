//! Light, weather and grip: the **model card** of the physical world.
//!
//! Levels come from the language. The numbers behind them are in this file; for those that are in another
//! file, the table names it. "Ours" marks what no source gives.
//!
//! | effect | model | source | where |
//! |---|---|---|---|
//! | rain | 2.5, 10, 50 mm/h | bounds of light, moderate, violent rain (WMO) | here |
//! | fog | meteorological optical range 500, 150, 50 m | classes fog < 1000, thick < 200, dense < 50 m | here |
//! | wetness | 0.1, 0.5, 1.5 mm of water | ours, within the columns of the friction table | here |
//! | water on the road | rain fills, drains with [`DRAIN_S`], dries with [`DRYING_MMPH`] | ours, from the rows of rain and wetness | here |
//! | friction | new tyres at 50, 90, 130 km/h and 0, 0.2, 1, 2 mm | Bosch, Automotive Handbook; between its columns the mapping 0.1, 0.5, 1.5 mm to 0.70, 0.60, 0.52 is ours | here |
//! | braking | min(brakes, μ·g), forces inside the friction circle | physics | `step::ego`, `view::around` |
//! | light | 0.8, 1, 0.15 of a camera's light by morning, noon, night, 0.4 in twilight | ours: a low sun costs contrast, street lamps leave the range of low beams | here |
//! | headlights | on from dusk to dawn, unless the vehicle ignores `Headlights`: then seen in the dark no farther than a pedestrian's share of a camera's range | Vienna Convention on Road Traffic, article 32; the share is ours | `ads::modular::perception`, `drivers::kit` |
//! | sight through fog and rain | R·e^(σR) = R₀, σ = 2.996 / MOR (Koschmieder) + 1.076·R^0.67 dB/km (Carbonneau) | as named | `ads::modular::perception` |
//! | detection by class, position noise | ranges of LiDAR and camera for cars and pedestrians, noise per metre | as `scenarios/ads/default.yaml` says | `ads::modular::perception` |
//! | night | camera ranges fall with the light, LiDAR's do not | ours: low beams leave 40 % on pedestrians, 70 % on lit vehicles | `ads::modular::perception` |
//! | localisation | error grows to a factor at 50 mm/h or 1.5 mm | ours | `ads::modular::localization` |
//! | line of sight | rays against outlines; low bodies hide the lower part | geometry | `view::sense` |
//!
//! The level that an action sets is where the water on the road begins; from then on it follows the rain.
//! Left out: temperature, ice, wind, spray, drifting fog, glare, and single puddles: the water is as deep
//! everywhere.

use avastra_lang::model::vocabulary::{Level, Phenomenon, TimeOfDay};

use crate::state::sensed::Conditions;
use crate::state::trace::traced;

/// A camera's light, 1 at noon. Ours: a low sun costs a camera some contrast, and twilight lies between it and night.
/// Street lamps leave it the recognition range that low beams give (35 to 50 %) on few pixels.
fn light(time: TimeOfDay) -> f64 {
    match time {
        TimeOfDay::Morning => 0.8,
        TimeOfDay::Noon => 1.0,
        TimeOfDay::Dawn | TimeOfDay::Dusk => 0.4,
        TimeOfDay::Night => 0.15,
    }
}

// The next three tables have an entry for each level: None, Light, Moderate, High.
/// Rain, mm/h: bounds of light, moderate and violent rain (WMO).
const RAIN_MMPH: [f64; 4] = [0.0, 2.5, 10.0, 50.0];
/// Meteorological optical range, m: within the classes fog (< 1000), thick (< 200) and dense (< 50).
const VISIBILITY_M: [f64; 4] = [10_000.0, 500.0, 150.0, 50.0];
/// Water on the road, mm, with which a level of wetness begins. Ours, spaced like the friction table's
/// columns.
const WATER_MM: [f64; 4] = [0.0, 0.1, 0.5, 1.5];

/// Time in which a road drains to a third, s. Under steady rain the depth tends to rain times this: 0.1 mm at 2.5 mm/h,
/// 0.4 mm at 10 mm/h, and 2 mm, which are puddles, at 50 mm/h. So light rain keeps the wetness of its level (144 s =
/// 0.1 mm / 2.5 mm/h). The other two stay near theirs.
const DRAIN_S: f64 = 144.0;
/// Evaporation from a wet road, mm/h. Ours: open water loses 3 to 5 mm on a summer's day.
const DRYING_MMPH: f64 = 0.3;
const S_PER_H: f64 = 3600.0;

/// Depths of water of the columns of [`FRICTION`], mm.
const DEPTHS_MM: [f64; 7] = [0.0, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0];
/// Speeds of its rows, m/s.
const SPEEDS_MPS: [f64; 3] = [50.0 / 3.6, 90.0 / 3.6, 130.0 / 3.6];
/// Friction of new tyres. At 0, 0.2, 1 and 2 mm Bosch's table; at 50 km/h also our mapping of the three
/// levels, elsewhere what lies between the columns.
const FRICTION: [[f64; 7]; 3] = [
    [0.85, 0.70, 0.65, 0.60, 0.55, 0.52, 0.50],
    [0.80, 0.70, 0.60, 0.4875, 0.30, 0.175, 0.05],
    [0.75, 0.65, 0.55, 0.41875, 0.20, 0.10, 0.0],
];
/// Friction never falls below this, which is that of ice. The table's 0 is a wheel that floats on water,
/// not a car that brakes.
const FRICTION_MIN: f64 = 0.05;

/// Time of day, the levels of the three phenomena, and the water on the road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Environment {
    pub time: TimeOfDay,
    /// The levels of rain, fog and wetness.
    pub sky: [Level; 3],
    water_mm: f64,
    /// The friction on a road with that water.
    grip: Grip,
}

impl Environment {
    /// The road is as wet as the higher of the levels of rain and wetness: an episode does not begin with
    /// the first drop.
    pub fn new(time: TimeOfDay, sky: [Level; 3]) -> Environment {
        let [rain, _, wetness] = sky;
        let water_mm = WATER_MM[wetness.max(rain) as usize];
        Environment { time, sky, water_mm, grip: Grip::under(water_mm) }
    }

    /// Sets a level from now on. A level of wetness adds water at once, but none takes water away: it
    /// drains and dries (see [`Environment::pass`]).
    pub fn set(&mut self, phenomenon: Phenomenon, level: Level) {
        self.sky[phenomenon as usize] = level;
        if phenomenon == Phenomenon::Wetness {
            self.water_mm = self.water_mm.max(WATER_MM[level as usize]);
            self.grip = Grip::under(self.water_mm);
        }
    }

    /// Lets it rain, drain and dry for a while that is short against [`DRAIN_S`].
    pub fn pass(&mut self, time_s: f64) {
        let rain_mmph = RAIN_MMPH[self.sky[Phenomenon::Rain as usize] as usize];
        let gain_mmps = (rain_mmph - DRYING_MMPH) / S_PER_H - self.water_mm / DRAIN_S;
        self.water_mm = (self.water_mm + gain_mmps * time_s).max(0.0);
        self.grip = Grip::under(self.water_mm);
    }

    pub fn grip(&self) -> &Grip {
        &self.grip
    }

    /// The conditions for an ego vehicle at a speed.
    pub fn conditions(&self, ego_mps: f64) -> Conditions {
        let [rain, fog, _] = self.sky;
        Conditions {
            light: light(self.time),
            rain_mmph: RAIN_MMPH[rain as usize],
            visibility_m: VISIBILITY_M[fog as usize],
            water_mm: self.water_mm,
            friction: self.grip.friction(ego_mps),
        }
    }
}

/// Friction of a tyre on a road with some depth of water: the table, linear between its entries and held
/// beyond its ends. Every vehicle asks for it in every tick, at its own speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// At the speeds of the table's rows.
    frictions: [f64; 3],
}

impl Grip {
    pub fn under(water_mm: f64) -> Grip {
        let (column, right) = place(&DEPTHS_MM, water_mm);
        Grip { frictions: FRICTION.map(|row| row[column] + (row[column + 1] - row[column]) * right) }
    }

    /// Coefficient of friction at a speed.
    pub fn friction(&self, speed_mps: f64) -> f64 {
        let (row, below) = place(&SPEEDS_MPS, speed_mps);
        let (slow, fast) = (self.frictions[row], self.frictions[row + 1]);
        (slow + (fast - slow) * below).max(FRICTION_MIN)
    }
}

/// The part of a dry road's friction that this depth of water leaves at up to 50 km/h.
pub fn friction_scale(water_mm: f64) -> f64 {
    Grip::under(water_mm).friction(0.0) / Grip::under(0.0).friction(0.0)
}

/// The entry at or before a value in a rising list, and how far it lies towards the next, in `[0, 1]`.
fn place(entries: &[f64], value: f64) -> (usize, f64) {
    let after = entries.partition_point(|entry| *entry <= value).clamp(1, entries.len() - 1);
    let (from, to) = (entries[after - 1], entries[after]);
    (after - 1, ((value - from) / (to - from)).clamp(0.0, 1.0))
}

traced! {
    // The grip follows from the water.
    Environment { time, sky, water_mm } but { grip };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(mut environment: Environment, time_s: u32) -> f64 {
        for _ in 0..time_s * 10 {
            environment.pass(0.1);
        }
        environment.conditions(0.0).water_mm
    }

    fn noon(levels: [Level; 3]) -> Environment {
        Environment::new(TimeOfDay::Noon, levels)
    }

    #[test]
    fn levels_mean_what_the_table_says() {
        let mut environment = noon([Level::None, Level::None, Level::Light]);
        assert_eq!(environment.conditions(0.0).friction, 0.70);
        environment.set(Phenomenon::Rain, Level::High);
        environment.set(Phenomenon::Wetness, Level::High);
        environment.set(Phenomenon::Fog, Level::Moderate);
        let conditions = environment.conditions(0.0);
        assert_eq!((conditions.friction, conditions.rain_mmph, conditions.visibility_m), (0.52, 50.0, 150.0));
        environment.set(Phenomenon::Rain, Level::None);
        environment.set(Phenomenon::Wetness, Level::None);
        assert_eq!(environment.conditions(0.0).friction, 0.52, "no word takes water away");
        (0..7200).for_each(|_| environment.pass(0.1));
        assert!(environment.conditions(0.0).friction > 0.80, "but it drains");
    }

    #[test]
    fn friction_is_the_handbooks() {
        for (water_mm, frictions) in [
            (0.0, [0.85, 0.80, 0.75]),
            (0.2, [0.65, 0.60, 0.55]),
            (1.0, [0.55, 0.30, 0.20]),
            (2.0, [0.50, 0.05, 0.05]),
        ] {
            for (speed_kmph, expected) in [50.0, 90.0, 130.0].into_iter().zip(frictions) {
                assert!(
                    (Grip::under(water_mm).friction(speed_kmph / 3.6) - expected).abs() < 1e-9,
                    "{water_mm} {speed_kmph}"
                );
            }
        }
        assert_eq!(Grip::under(9.0).friction(0.0), 0.50);
    }

    #[test]
    fn rain_wets_and_a_road_dries() {
        use Level::{High, Light, Moderate, None};
        // Rain alone fills the road in minutes, up to puddles.
        let mut downpour = noon([None; 3]);
        downpour.set(Phenomenon::Rain, High);
        assert!((after(downpour, 60) - 0.67).abs() < 0.02, "{}", after(downpour, 60));
        assert!((after(downpour, 1500) - 1.99).abs() < 0.02);
        // Each rain keeps about the wetness of its level.
        for (level, water_mm) in [(Light, 0.09), (Moderate, 0.39), (High, 1.99)] {
            assert!((after(noon([level, None, level]), 1500) - water_mm).abs() < 0.01, "{level:?}");
        }
        // A wet road under a dry sky.
        let wet = noon([None, None, High]);
        assert!((after(wet, 144) - 1.5 / core::f64::consts::E).abs() < 0.02);
        assert_eq!(after(wet, 1500), 0.0);
    }
}
