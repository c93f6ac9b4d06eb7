//! The scenario as a text of the language.

use std::collections::BTreeSet;
use std::fmt::Write;

use avastra_campaign::emit::{identifier, quoted};
use avastra_lang::syntax::ast::FileId;
use avastra_lang::syntax::format;

use super::Imported;
use super::body::Shape;
use super::own::Own;
use super::scene::{Other, Scene};
use super::story::Story;

/// The file: its space, with a body for each road user and one action that lets all of them appear, and the scenario.
pub fn scenario(scene: &Scene, story: &Story, name: &str, notes: BTreeSet<String>) -> Imported {
    let mut text = head(&story.description, name, &notes);
    let own = identifier(name);
    let Scene { start, goal, .. } = scene;
    let map = quoted(story.map.1.rsplit(['/', '\\']).next().unwrap_or_default());
    let ego_mps = number(scene.ego_mps);
    let _ = writeln!(text, "road {own}_road {{\n  map: {map}\n  start: {start}\n  goal: {goal}");
    if scene.ego_mps > 0.0 {
        let _ = writeln!(text, "  // the ego vehicle's speed in the file\n  limit: {ego_mps} m/s");
    }
    text += "}\n\n";
    if let Some(time) = story.weather.time {
        let more = if matches!(time, "Dawn" | "Dusk") { format!(" | {time}") } else { String::new() };
        let _ = write!(text, "enum Time = Morning | Noon | Night{more}\nstate time: Time = any\n\n");
    }
    if story.weather.is_rough() {
        text += "enum Sky = Rain | Fog | Wetness\nenum Level = None < Light < Moderate < High\n";
        text += "state sky: Sky -> Level = None\n\n";
    }
    for (index, other) in scene.others.iter().enumerate() {
        let Shape { like, length_m, width_m, height_m, .. } = &other.shape;
        let [length, width, height] = [length_m, width_m, height_m].map(|metres| number(*metres));
        let body = body(index, other);
        let size = format!("length: {length} m, width: {width} m, height: {height} m");
        let _ = writeln!(text, "body {body} {{ like: {like}, {size} }}");
    }
    if scene.others.is_empty() {
        text += "state begun: Bool = false\naction begin() { set begun = true }\n";
    } else {
        text += "/// All that the file places.\naction begin() {\n";
        for (index, other) in scene.others.iter().enumerate() {
            let _ = writeln!(text, "  {}", spawn(&body(index, other), other));
        }
        text += "}\n";
    }
    if let Some(change) = &scene.change {
        let _ = writeln!(text, "rule change_begins on begin during change: {change}");
    }
    // One step: its action happens at the beginning, or at the moment that it waits for.
    let step_ms = (story.duration_s * 50.0).ceil().max(1.0) * 20.0;
    let step = number(step_ms / 1000.0);
    let _ = writeln!(
        text,
        "\nepisode {{\n  roads: [{own}_road]\n  step: {step} s\n  stop: arrived\n  limit: 1 steps\n}}"
    );
    let mut start = story.weather.time.map_or_else(String::new, |time| format!("time: {time}, "));
    if story.weather.is_rough() {
        let [rain, fog, wetness] = story.weather.sky.map(|level| level.unwrap_or("None"));
        let _ = write!(start, "sky: {{ Rain: {rain}, Fog: {fog}, Wetness: {wetness} }}, ");
    }
    let once = scene.once.as_ref().map_or_else(String::new, |once| format!(" once {once}"));
    let _ = writeln!(
        text,
        "\nscenario {own} {{\n  road: {own}_road\n  start {{ {start}ego_speed: {ego_mps} m/s }}\n  steps {{ 0: begin(){once} }}\n}}"
    );
    // A text that does not parse is refused when it is checked.
    let text = format(FileId(0), &text).unwrap_or(text);
    Imported { text, map: story.map.1.clone(), notes }
}

/// The file of a scenario that the other file carries.
pub fn own(own: &Own, name: &str, notes: BTreeSet<String>) -> Imported {
    let text = head(&own.description, name, &notes) + &own.text + "\n";
    let text = format(FileId(0), &text).unwrap_or(text);
    Imported { text, map: own.map.clone(), notes }
}

/// How a file begins: what it is, what differs, and the version of the language.
fn head(description: &str, name: &str, notes: &BTreeSet<String>) -> String {
    let description = one_line(description);
    let title = if description.is_empty() { name.to_owned() } else { description };
    let mut text = format!(
        "//! {title}\n//!\n//! From OpenSCENARIO XML by `avastra import`. What differs from the file:\n"
    );
    for note in notes {
        let _ = writeln!(text, "//! - {}", one_line(note));
    }
    text += "language 1\n\n";
    text
}

fn spawn(body: &str, other: &Other) -> String {
    let direction = if other.is_behind { "behind" } else { "ahead" };
    let mut fields = Vec::new();
    fields.extend(other.lane.map(|lane| format!("lane: {lane}")));
    fields.extend(other.side.map(|side| format!("side: {side}")));
    if other.does != "Stand" {
        fields.push(format!("speed: {} m/s", number(other.speed_mps)));
    }
    fields.push(format!("does: {}", other.does));
    if other.changes {
        fields.push("then: Change".to_owned());
    }
    format!("spawn {body} {direction} {} m {{ {} }}", number(other.gap_m), fields.join(", "))
}

/// The number keeps two bodies with one name apart.
fn body(index: usize, other: &Other) -> String {
    format!("{}_{}", capital(&identifier(&other.name)), index + 1)
}

/// To the millimetre: a file's figures have no more.
fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_ascii_uppercase().to_string() + letters.as_str())
}
