//! Time of day and weather of a file, in the engine's words.

use roxmltree::Node;

use super::catalogue;
use super::source::{Source, children, element};

/// Levels of the engine's sky, and the upper limit of each. Rain: the bounds of light and moderate rain (WMO), as a part
/// of the most where a file of 1.0 gives no millimetres. Fog: the range of sight. Wetness: the part of friction that is
/// left.
const LEVELS: [&str; 4] = ["None", "Light", "Moderate", "High"];
const RAIN_MMPH: [f64; 3] = [0.0, 2.5, 10.0];
const RAIN_PART: [f64; 3] = [0.0, 0.2, 0.5];
const SIGHT_M: [f64; 3] = [1000.0, 200.0, 75.0];
const FRICTION: [f64; 3] = [0.9, 0.75, 0.65];
/// Less friction than that of a flooded road is ice.
const FRICTION_MIN: f64 = 0.5;

/// With less light of the sun than this it is night; civil twilight ends at some 3 lx.
const DARK_LX: f64 = 10.0;

/// Words for clouds, of which nothing is taken over.
const CLOUDS: [&str; 6] = ["cloudy", "free", "overcast", "rainy", "skyOff", "skyoff"];
const OKTAS: [&str; 10] = [
    "zeroOktas",
    "oneOktas",
    "twoOktas",
    "threeOktas",
    "fourOktas",
    "fiveOktas",
    "sixOktas",
    "sevenOktas",
    "eightOktas",
    "nineOktas",
];

/// The values that an `EnvironmentAction` sets.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Weather {
    /// The engine's word for the time of day.
    pub time: Option<&'static str>,
    /// Levels of rain, fog and wetness, where the file says them.
    pub sky: [Option<&'static str>; 3],
}

impl Weather {
    /// The values after one action and then another.
    pub fn then(self, later: Weather) -> Weather {
        let mut sky = self.sky;
        for (level, new) in sky.iter_mut().zip(later.sky) {
            *level = new.or(*level);
        }
        Weather { time: later.time.or(self.time), sky }
    }

    /// Whether it is other than dry and clear.
    pub fn is_rough(&self) -> bool {
        self.sky.iter().flatten().any(|level| *level != LEVELS[0])
    }
}

/// Levels of rain, fog and wetness.
pub fn levels(weather: &Weather) -> [&'static str; 3] {
    weather.sky.map(|level| level.unwrap_or(LEVELS[0]))
}

/// The weather of a `GlobalAction`.
pub fn weather(source: &mut Source, global: Node) -> Option<Weather> {
    let action = children(global).next()?;
    source.refuse_if(!action.has_tag_name("EnvironmentAction"), action, "this action is not read")?;
    if let Some(own) = element(action, "Environment") {
        return environment(source, own);
    }
    let reference = source.required(action, "CatalogReference")?;
    catalogue::entry(source, reference, &[catalogue::ENVIRONMENT], environment)
}

fn environment(source: &mut Source, environment: Node) -> Option<Weather> {
    source.scoped(environment, |source| sky_of(source, environment))
}

fn sky_of(source: &mut Source, environment: Node) -> Option<Weather> {
    let mut found = Weather::default();
    let (mut is_dark, mut snow) = (false, None);
    for node in environment.descendants() {
        match node.tag_name().name() {
            "Precipitation" => {
                let level = precipitation(source, node)?;
                let is_snow = node.attribute("precipitationType") == Some("snow");
                found.sky[0] = Some(if is_snow { LEVELS[0] } else { level });
                snow = is_snow.then_some(level);
            }
            "Fog" if node.has_attribute("visualRange") => {
                let sight_m = source.amount(node, "visualRange")?;
                found.sky[1] = Some(level(|bound| sight_m >= SIGHT_M[bound]));
            }
            "RoadCondition" => found.sky[2] = wetness(source, node)?,
            "TimeOfDay" => {
                if source.switch(node, "animation", false)? {
                    source.note("the time of day stands still");
                }
                found.time = Some(time(source, node)?);
            }
            "Weather" => {
                source.word(node, "cloudState", &CLOUDS)?;
                source.word(node, "fractionalCloudCover", &OKTAS)?;
            }
            "Sun" => {
                is_dark = node.has_attribute("illuminance") && source.amount(node, "illuminance")? < DARK_LX;
                source.note("sun, wind and clouds are not taken over");
            }
            "Wind" | "DomeImage" => source.note("sun, wind and clouds are not taken over"),
            _ => {}
        }
    }
    if is_dark && found.time.is_none_or(|time| matches!(time, "Morning" | "Noon")) {
        source.note("it is night: the file's sun gives no light of a day");
        found.time = Some("Night");
    }
    if let Some(level) = snow {
        source.note("snow that falls is fog of its level for the sensors");
        let rank = |level: &&str| LEVELS.iter().position(|known| known == level);
        found.sky[1] = found.sky[1].into_iter().chain([level]).max_by_key(rank);
    }
    if found.is_rough() {
        source.note("weather is the nearest of the engine's levels of rain, fog and wetness");
    }
    Some(found)
}

/// The first level whose bound holds.
fn level(holds: impl Fn(usize) -> bool) -> &'static str {
    LEVELS[(0..3).find(|bound| holds(*bound)).unwrap_or(3)]
}

/// How much falls of it, rain or snow, which counts by the water that it holds.
fn precipitation(source: &mut Source, node: Node) -> Option<&'static str> {
    match source.word(node, "precipitationType", &["dry", "rain", "snow"])? {
        "rain" | "snow" if node.has_attribute("precipitationIntensity") => {
            let mmph = source.amount(node, "precipitationIntensity")?;
            Some(level(|bound| mmph <= RAIN_MMPH[bound]))
        }
        "rain" | "snow" => {
            let part = source.amount(node, "intensity")?;
            Some(level(|bound| part <= RAIN_PART[bound]))
        }
        _ => Some(LEVELS[0]),
    }
}

/// The water on the road: by its word, or by the friction that is left.
fn wetness(source: &mut Source, node: Node) -> Option<Option<&'static str>> {
    let words = ["dry", "moist", "wetWithPuddles", "lowFlooded", "highFlooded"];
    let word = source.word(node, "wetness", &words)?;
    if let Some(at) = words.iter().position(|known| *known == word) {
        return Some(Some(LEVELS[at.min(3)]));
    }
    if !node.has_attribute("frictionScaleFactor") {
        return Some(None);
    }
    let part = source.amount(node, "frictionScaleFactor")?;
    source.refuse_if(part < FRICTION_MIN, node, "so little friction is ice, of which the engine has none")?;
    Some(Some(level(|bound| part >= FRICTION[bound])))
}

fn time(source: &mut Source, node: Node) -> Option<&'static str> {
    let text = source.text(node, "dateTime")?;
    let hour = text.split_once('T').and_then(|(_, clock)| clock.get(..2)?.parse::<u32>().ok());
    match hour {
        Some(6) => Some("Dawn"),
        Some(7..=11) => Some("Morning"),
        Some(12..=17) => Some("Noon"),
        Some(18) => Some("Dusk"),
        Some(0..=23) => Some("Night"),
        _ => source.refuse(node, format!("`{text}` is no date and time")),
    }
}
