//! The style of a file, and the elements that all of its parts share.

use crate::export::xml::Element;

/// An entity that must not be met is this far beneath its place, m.
pub const BENEATH_M: f64 = 100.0;

/// The standard's version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    V1_2,
    /// 1.0, and of it what CARLA's ScenarioRunner reads; always natural, the ego vehicle too.
    Carla,
}

/// How the file describes the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ego {
    /// It drives as it was recorded.
    Trajectory,
    /// It has a controller named `ads`, which the player provides, and is told the goal.
    Controller,
    /// It stands at its start with its first speed; the player moves it or lets it roll.
    None,
}

/// How the file says what others do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Others {
    /// As recorded, tick by tick.
    Exact,
    /// By actions that a person would write, which come near to the recording.
    Natural,
}

/// How a file is to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    pub version: Version,
    pub ego: Ego,
    pub others: Others,
}

/// A fact about the file.
pub fn property(name: &str, value: &str) -> Element {
    Element::new("Property").with("name", name).with("value", value)
}
