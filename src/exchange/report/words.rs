//! Words that several pages and pictures share.

use avastra_lang::model::vocabulary::{Level, Phenomenon, TimeOfDay, Word};

/// `Morning, light rain, high fog`.
pub fn sky(time: TimeOfDay, levels: [Level; 3]) -> String {
    let weather = Phenomenon::ALL.iter().zip(levels).filter(|(_, level)| level.intensity() > 0.0);
    let weather: Vec<String> = weather
        .map(|(phenomenon, level)| format!("{} {}", level.name(), phenomenon.name()).to_lowercase())
        .collect();
    let weather = if weather.is_empty() { "clear".to_owned() } else { weather.join(", ") };
    format!("{}, {weather}", time.name())
}
