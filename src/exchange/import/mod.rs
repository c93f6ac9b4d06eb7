//! OpenSCENARIO XML of others as a scenario of the language.
//!
//! A documented subset (LANGUAGE.md): vehicles and pedestrians that stand or drive before, behind or beside the ego vehicle, keep
//! their speed, and change lanes when a condition holds. The driving system under test takes the place of whatever moves the
//! ego vehicle in the file. What cannot be said is refused, each with its line; what is left to the driving
//! system or to the engine's drivers becomes a note in the scenario.
//!
//! `vocabulary` refuses what no file may hold. `story` reads the file, with `body`, `position`, `action`, `trigger` and `weather`
//! for what stands in it, through `source`, which fills in each `parameter` and its `expression`; `ground` finds places on the map,
//! `scene` decides who is where and does what, `condition` turns triggers into conditions of the language, and `write` prints the
//! scenario. A file that avastra exported carries its scenario (`own`). No file is read here: `cli` gives texts.

mod action;
mod body;
mod condition;
mod expression;
mod ground;
mod own;
mod parameter;
mod position;
mod scene;
mod source;
mod story;
mod trigger;
mod vocabulary;
mod weather;
mod write;

use std::collections::{BTreeMap, BTreeSet};

use scene::Scene;
use source::Source;

/// Gives the texts of the files that a scenario names.
pub trait Files {
    /// The map at a path that the scenario names.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn map(&self, path: &str) -> Result<String, String>;

    /// The texts of the `.xosc` files in a folder of catalogues.
    ///
    /// # Errors
    /// Why they cannot be read.
    fn catalogues(&self, folder: &str) -> Result<Vec<String>, String>;
}

/// A scenario of another tool in the language.
#[derive(Debug)]
pub struct Imported {
    /// The text of the file: the space and its one scenario.
    pub text: String,
    /// The map as the scenario of the other tool names it; the text names the map by its file name alone.
    pub map: String,
    /// What drives otherwise here than the file says.
    pub notes: BTreeSet<String>,
}

/// Something that the language cannot say, or that is no OpenSCENARIO.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub struct Refusal {
    pub line: u32,
    /// The name of the XML element.
    pub element: String,
    pub reason: String,
}

/// The scenario of an OpenSCENARIO XML file (1.0 to 1.3). `name` is what it is to be called, `ego` the entity that is the ego
/// vehicle, if it is not called so, and `parameters` have values in place of those that the file declares.
///
/// # Errors
/// All that cannot be said, by lines.
pub fn openscenario(
    text: &str,
    name: &str,
    ego: Option<&str>,
    parameters: &BTreeMap<String, String>,
    files: &dyn Files,
) -> Result<Imported, Vec<Refusal>> {
    let document = avastra_road::well_formed(text).map_err(|error| {
        let (line, reason) = match error {
            avastra_road::RoadError::Map { line, message } => (line, message),
            avastra_road::RoadError::Route { message } => (1, message),
        };
        vec![Refusal { line, element: "OpenSCENARIO".to_owned(), reason }]
    })?;
    let mut source = Source::new(text, parameters);
    // With another ego vehicle or other values, the file is read like those of other tools.
    let is_as_written = ego.is_none() && parameters.is_empty();
    if let Some(own) = is_as_written.then(|| own::read(&mut source, &document)).flatten() {
        return Ok(write::own(&own, name, source.notes()));
    }
    let imported = story::read(&mut source, &document, ego, files).and_then(|story| {
        let scene = Scene::of(&mut source, &story, files)?;
        Some(write::scenario(&scene, &story, name, source.notes()))
    });
    match (imported, source.refusals()) {
        (Some(imported), refusals) if refusals.is_empty() => Ok(imported),
        (_, refusals) => Err(refusals),
    }
}
