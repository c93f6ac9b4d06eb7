//! OpenSCENARIO XML of others as spaces of the language (docs/reference/openscenario.md has what is read).
//!
//! A scenario becomes a space with one row, and a scenario that plays it. A file with a `ParameterValueDistribution`
//! becomes a space with a row for each of its variations. Others follow their ways as the file's player moves them
//! (`Follow`). The driving system under test takes the place of whatever moves the ego vehicle in the file. Content that
//! the language cannot say is refused, with its line. Differences in driving are notes at the head of the space.
//!
//! `variation` reads the values of a distribution, and `chance` draws those that it leaves to chance. For each variation
//! `story` reads the scenario, with `body`, `position`, `shape`, `action`, `trigger` and `weather` for its elements. It
//! reads them through `source`, which fills in each `parameter` and its `expression`, and `catalogue`, which finds the
//! content of other files. `vocabulary` refuses elements and attributes that no file may have. `place` finds places on the
//! map. `scene` gives each entity a way, to which `ways` joins trajectories. `phases` writes the actions, `pace` the
//! speeds, and `condition` the moments at which the actions begin, all as `said`: text with its numbers apart. `order`
//! refuses events that may come at another time, by what `estimate` knows of how all entities begin. `rows` finds how the
//! numbers follow from the parameters, `sky` how weather changes, and `write` prints the space. A file that avastra
//! exported carries its scenario (`own`). No file is read here: `cli` gives texts.

mod across;
mod action;
mod body;
mod cast;
mod catalogue;
mod chance;
mod condition;
mod estimate;
mod expression;
mod ground;
mod order;
mod own;
mod pace;
mod parameter;
mod phases;
mod place;
mod position;
mod rows;
mod said;
mod scene;
mod shape;
mod sky;
mod source;
mod story;
mod trigger;
mod variation;
mod vocabulary;
mod ways;
mod whole;
mod weather;
mod write;

use std::collections::BTreeSet;
use std::rc::Rc;

use avastra_road::Lines;
use roxmltree::Document;

use catalogue::Library;
use source::Source;
use variation::Values;
use whole::Whole;

pub use source::{Files, Refusal};
pub use variation::{VARIATIONS_MAX, VARIATIONS_USUAL};
pub use whole::Imported;

/// How a file is to be read.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The name of the space.
    pub name: &'a str,
    /// The entity that is the ego vehicle, if it is not called so.
    pub ego: Option<&'a str>,
    /// In place of the values that the file declares or lists.
    pub parameters: &'a Values,
    /// More variations are refused.
    pub variations_max: u32,
}

/// The space of an OpenSCENARIO XML file (1.0 to 1.3).
///
/// # Errors
/// All that cannot be said, by lines.
pub fn openscenario(text: &str, request: &Request, files: &dyn Files) -> Result<Imported, Vec<Refusal>> {
    let &Request { name, ego, parameters, variations_max } = request;
    let document = parsed(text, None)?;
    let lines = Rc::new(Lines::new(text));
    let library = Library::new(files, String::new());
    let mut source = Source::new(Rc::clone(&lines), parameters, &library);
    // With another ego vehicle or other values, the file is read like those of other tools.
    let is_as_written = ego.is_none() && parameters.is_empty();
    if let Some(own) = is_as_written.then(|| own::read(&mut source, &document)).flatten() {
        return Ok(write::own(&own, name, source.notes()));
    }
    let mut whole = Whole {
        ego,
        description: String::new(),
        notes: BTreeSet::new(),
        variants: Vec::new(),
        excluded: 0,
        is_known: false,
    };
    let Some(named) = variation::scenario(&mut source, document.root_element()) else {
        whole
            .add(&document, &lines, &library, parameters.clone(), parameters)
            .map_err(|refused| refused.0)?;
        return Ok(write::space(&whole, &[], name));
    };
    let Some((path, line)) = named else { return Err(source.refusals()) };
    let path = path.replace('\\', "/");
    let text = files.scenario(&path).map_err(|reason| {
        let reason = format!("`{path}`: {reason}");
        vec![Refusal { scenario: None, line, element: "ScenarioFile".to_owned(), reason }]
    })?;
    let of_variations = document;
    let document = parsed(&text, Some(&path))?;
    let declared = declared(&document);
    let read = variation::read(&mut source, of_variations.root_element(), &declared, variations_max as usize);
    let Some(distribution) = read.filter(|_| !source.is_refused()) else { return Err(source.refusals()) };
    // The errors of the scenario, and the values with which they occur.
    let of_scenario = |refusals: Vec<Refusal>, values: &Values| {
        let pairs: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        let with = |refusal: Refusal| {
            let reason = match pairs.is_empty() {
                true => refusal.reason,
                false => format!("{} (where {})", refusal.reason, pairs.join(", ")),
            };
            Refusal { scenario: Some(path.clone()), reason, ..refusal }
        };
        refusals.into_iter().map(with).collect::<Vec<_>>()
    };
    let lines = Rc::new(Lines::new(&text));
    let folder = path.rfind('/').map_or_else(String::new, |at| path[..=at].to_owned());
    let library = Library::new(files, folder);
    let (mut excluded, mut repeated) = (None, 0);
    let mut known = BTreeSet::new();
    for values in &distribution.variations {
        // Values that were asked for stand in place of those that are listed.
        let values: Values = values.iter().chain(parameters).map(|(k, v)| (k.clone(), v.clone())).collect();
        if !known.insert(values.clone()) {
            repeated += 1;
            continue;
        }
        match whole.add(&document, &lines, &library, values.clone(), &values) {
            Ok(()) => {}
            Err((refusals, true)) => excluded = Some((refusals, values)),
            Err((refusals, false)) => return Err(of_scenario(refusals, &values)),
        }
    }
    match excluded.filter(|_| whole.variants.is_empty()) {
        Some((refusals, values)) => Err(of_scenario(refusals, &values)),
        None => {
            whole.description = distribution.description;
            whole.notes.extend(source.notes());
            if repeated > 0 {
                let note = format!(
                    "variations with the values of another one, which make one row with it: {repeated}"
                );
                whole.notes.insert(note);
            }
            Ok(write::space(&whole, &distribution.parameters, name))
        }
    }
}

/// The parameters that a scenario declares, with their values as it writes them.
fn declared(document: &Document) -> Values {
    let lists = source::elements(document.root_element(), "ParameterDeclarations");
    let declared = lists.flat_map(source::children);
    declared
        .filter_map(|one| {
            Some((source::plain(one.attribute("name")?).to_owned(), one.attribute("value")?.to_owned()))
        })
        .collect()
}

fn parsed<'t>(text: &'t str, scenario: Option<&str>) -> Result<Document<'t>, Vec<Refusal>> {
    avastra_road::well_formed(text).map_err(|error| {
        let (line, reason) = match error {
            avastra_road::RoadError::Map { line, message } => (line, message),
            avastra_road::RoadError::Route { message } => (1, message),
        };
        let scenario = scenario.map(str::to_owned);
        vec![Refusal { scenario, line, element: "OpenSCENARIO".to_owned(), reason }]
    })
}
