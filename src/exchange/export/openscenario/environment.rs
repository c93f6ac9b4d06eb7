//! Sky and lights as OpenSCENARIO describes them.
//!
//! The world has words where the standard wants numbers. Rain, sight, water and friction are those of the model card
//! (`sim::environment`); of sun and clouds the world has none, so these are ours
//! (the clock is docs/language/words.md's):
//!
//! | time | clock | sun's elevation and azimuth | illuminance |
//! |---|---|---|---|
//! | Morning | 10:00 | 20° in the east | 20,000 lx |
//! | Noon | 14:00 | 60° in the south | 100,000 lx |
//! | Night | 20:00 | 30° below the horizon in the north | 0.1 lx |

use core::f64::consts::{FRAC_PI_2, PI};
use std::collections::{BTreeMap, BTreeSet};

use avastra_campaign::episode::{Lights, Sky};
use avastra_lang::model::vocabulary::{Level, TimeOfDay};
use avastra_world::sim::{DT_S, SignalColour};

use super::super::DATE;
use super::super::recording::Recording;
use super::super::xml::Element;

/// A sky as a `GlobalAction`.
pub fn environment(sky: &Sky, number: usize) -> Element {
    let (sun, illuminance_lx) = sun(sky);
    let sun = sun.measured("illuminance", illuminance_lx);
    let fog = Element::new("Fog").measured("visualRange", sky.visibility_m);
    let rain = Element::new("Precipitation")
        .with("precipitationType", if sky.rain_mmph > 0.0 { "rain" } else { "dry" })
        .measured("precipitationIntensity", sky.rain_mmph);
    let weather = Element::new("Weather")
        .with("fractionalCloudCover", if sky.rain_mmph > 0.0 { "eightOktas" } else { "zeroOktas" })
        .holding(sun)
        .holding(fog)
        .holding(rain);
    let road = Element::new("RoadCondition")
        .measured("frictionScaleFactor", sky.friction_scale)
        .with("wetness", wetness(sky));
    let environment = Element::new("Environment")
        .with("name", format!("sky_{number}"))
        .holding(time(sky))
        .holding(weather)
        .holding(road);
    Element::new("GlobalAction").holding(Element::new("EnvironmentAction").holding(environment))
}

/// The clock of the world's time of day.
pub fn time(sky: &Sky) -> Element {
    let hour = sky.time_of_day.hour();
    Element::new("TimeOfDay").with("animation", false).with("dateTime", format!("{DATE}T{hour:02}:00:00"))
}

/// Where the sun is, and its illuminance, lx.
pub fn sun(sky: &Sky) -> (Element, f64) {
    let elevation_deg = sky.time_of_day.sun_elevation_deg();
    // In civil twilight the ground has 400 lx as the sun sets and 3.4 lx as it is 6 degrees below the horizon.
    let (azimuth_rad, illuminance_lx) = match sky.time_of_day {
        TimeOfDay::Dawn => (FRAC_PI_2, 30.0),
        TimeOfDay::Morning => (FRAC_PI_2, 20_000.0),
        TimeOfDay::Noon => (PI, 100_000.0),
        TimeOfDay::Dusk => (PI + FRAC_PI_2, 30.0),
        TimeOfDay::Night => (0.0, 0.1),
    };
    let sun = Element::new("Sun")
        .measured("azimuth", azimuth_rad)
        .measured("elevation", elevation_deg / 180.0 * PI);
    (sun, illuminance_lx)
}

/// The word for the level of wetness or rain, whichever is higher: the world's road is at least as wet as that.
fn wetness(sky: &Sky) -> &'static str {
    let [rain, _, wetness] = sky.levels;
    match rain.max(wetness) {
        Level::None if sky.water_mm > 0.0 => "moist",
        Level::None => "dry",
        Level::Light => "moist",
        Level::Moderate => "wetWithPuddles",
        Level::High => "lowFlooded",
    }
}

/// The lights: a controller for each junction, with the phases that were seen. A phase ends when one of its lights changes;
/// the last one lasts until the end of the recording. A light on its own has a controller, too.
pub fn signals(recording: &Recording) -> Option<Element> {
    let mut junctions: BTreeMap<(Option<usize>, usize), Vec<&Lights>> = BTreeMap::new();
    for lights in &recording.seen.lights {
        let junction = recording.map.signals[lights.signal].junction;
        let lone = if junction.is_some() { 0 } else { lights.signal };
        junctions.entry((junction, lone)).or_default().push(lights);
    }
    let controllers = junctions.values().enumerate().map(|(number, lights)| {
        let name = format!("lights_{}", number + 1);
        let begins: BTreeSet<u64> =
            lights.iter().flat_map(|lights| &lights.changes).map(|(tick, _)| *tick).collect();
        let ends = begins.iter().skip(1).copied().chain([recording.seen.end_tick]);
        let phases = begins.iter().zip(ends).enumerate().map(|(index, (begin, end))| {
            Element::new("Phase")
                .with("name", format!("{name}_phase_{}", index + 1))
                .measured("duration", (end - begin) as f64 * DT_S)
                .holding_all(lights.iter().map(|lights| {
                    Element::new("TrafficSignalState")
                        .with("trafficSignalId", &recording.map.signals[lights.signal].id)
                        .with("state", state(lights.at(*begin)))
                }))
        });
        Element::new("TrafficSignalController").with("name", &name).holding_all(phases)
    });
    let controllers: Vec<Element> = controllers.collect();
    (!controllers.is_empty()).then(|| Element::new("TrafficSignals").holding_all(controllers))
}

/// The lamps of a light from top to bottom, red, yellow, green.
fn state(colour: SignalColour) -> &'static str {
    match colour {
        SignalColour::Red => "on;off;off",
        SignalColour::Yellow => "off;on;off",
        SignalColour::Green => "off;off;on",
    }
}
