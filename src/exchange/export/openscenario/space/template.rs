//! Files that differ in numbers alone as one template with parameters, and the list of their values.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::super::super::xml::Element;
use super::super::{Version, file_header};
use super::RowFile;

/// A file with parameters, and the file that lists their values.
pub struct Template {
    pub text: String,
    /// `None` where nothing tells the rows apart.
    pub variations: Option<String>,
}

/// The owner of the facts in a file's header.
const HEADER: &str = "road";

/// A parameter: its name, its type, and its value in each file.
struct Parameter {
    name: String,
    /// The entity that it is about; empty for one of the action.
    owner: String,
    kind: &'static str,
    values: Vec<String>,
}

/// The template of files of one form, which will be called `file`.
pub fn of(rows: &[RowFile], file: &str) -> Template {
    let mut parameters = declared(rows);
    let mut taken: BTreeSet<String> = parameters.iter().map(|parameter| parameter.name.clone()).collect();
    let places = places(&rows[0].file);
    let values: Vec<Vec<Attribute>> = rows.iter().map(|row| self::places(&row.file)).collect();
    let mut given = Vec::new();
    for (at, place) in places.iter().enumerate() {
        let column: Vec<&str> = values.iter().map(|places| places[at].value).collect();
        if column.iter().all(|value| *value == column[0]) {
            given.push(None);
            continue;
        }
        // An attribute with the values of a known parameter uses that one; but a fact of the header has a separate one.
        let is_same = |known: &&Parameter| {
            known.kind == place.kind
                && known.owner != HEADER
                && place.owner != HEADER
                && known.values == column
        };
        if let Some(known) = parameters.iter().find(is_same) {
            given.push(Some(format!("${}", known.name)));
            continue;
        }
        let own = format!("{}_{}", place.owner, place.word);
        let names = (1..).map(|nth| if nth == 1 { own.clone() } else { format!("{own}_{nth}") });
        let name =
            names.into_iter().find(|name| !taken.contains(name)).expect("there is always a next number");
        taken.insert(name.clone());
        given.push(Some(format!("${name}")));
        let values = column.into_iter().map(str::to_owned).collect();
        parameters.push(Parameter { name, owner: place.owner.clone(), kind: place.kind, values });
    }
    let declarations = parameters.iter().map(|parameter| {
        Element::new("ParameterDeclaration")
            .with("name", &parameter.name)
            .with("parameterType", parameter.kind)
            .with("value", &parameter.values[0])
    });
    let declarations = Element::new("ParameterDeclarations").holding_all(declarations);
    let mut given = given.into_iter();
    let whole = rows[0].file.with_values(&mut |_| given.next().flatten());
    let text = match parameters.is_empty() {
        true => whole.document(),
        false => whole.holding_second(declarations).document(),
    };
    let has_values = rows.len() > 1 && !parameters.is_empty();
    Template { text, variations: has_values.then(|| variations(rows, &parameters, file)) }
}

/// An attribute of a file.
struct Attribute<'e> {
    /// The entity that it is about.
    owner: String,
    /// Its meaning, in a word.
    word: &'static str,
    /// Its type in OpenSCENARIO.
    kind: &'static str,
    value: &'e str,
}

/// All attributes of a file in its order.
fn places(file: &Element) -> Vec<Attribute<'_>> {
    let mut found = Vec::new();
    note(file, "scenario", &mut found);
    found
}

fn note<'e>(element: &'e Element, owner: &str, found: &mut Vec<Attribute<'e>>) {
    let named = match element.name() {
        "Private" => element.attribute("entityRef"),
        "FileHeader" => Some(HEADER),
        "ScenarioObject" => element.attribute("name"),
        "ManeuverGroup" => element.attribute("name").and_then(|name| name.strip_suffix("_group")),
        _ => None,
    };
    let owner = named.unwrap_or(owner);
    for (name, value) in element.attributes() {
        let kind = match *name {
            "roadId" => "string",
            "laneId" => "integer",
            _ => "double",
        };
        found.push(Attribute { owner: owner.to_owned(), word: word(element.name(), name), kind, value });
    }
    element.children().iter().for_each(|child| note(child, owner, found));
}

/// The name of an attribute as a parameter.
fn word(element: &str, attribute: &'static str) -> &'static str {
    match (element, attribute) {
        ("Property", "value") => "speed_limit",
        ("AbsoluteTargetSpeed" | "AbsoluteSpeed" | "SpeedCondition" | "RelativeSpeedCondition", "value") => {
            "speed"
        }
        ("SpeedActionDynamics", "value") => "rate",
        ("SimulationTimeCondition", "value") => "time",
        ("FollowTrajectoryAction", "initialDistanceOffset") => "begins",
        ("AbsoluteTargetLaneOffset", "value") => "aside",
        ("LaneOffsetActionDynamics", "maxLateralAcc") => "aside_acceleration",
        ("TargetDistanceSteadyState", "distance") => "steady",
        ("RelativeDistanceCondition", "value") => "gap",
        ("TimeHeadwayCondition", "value") => "headway",
        ("TraveledDistanceCondition", "value") => "way",
        _ => attribute,
    }
}

/// A file's elements, attributes and words, without its numbers: what files of one template have in common.
pub fn form(file: &Element) -> String {
    let mut text = String::new();
    shape(file, &mut text);
    text
}

fn shape(element: &Element, text: &mut String) {
    let _ = write!(text, "<{}", element.name());
    for (name, value) in element.attributes() {
        let is_number =
            value.parse::<f64>().is_ok_and(|_| value.ends_with(|letter: char| letter.is_ascii_digit()));
        let _ = write!(text, " {name}={}", if is_number { "#" } else { value });
    }
    element.children().iter().for_each(|child| shape(child, text));
    text.push('>');
}

/// The parameters of the action that tell files apart.
fn declared(rows: &[RowFile]) -> Vec<Parameter> {
    let own = rows[0].values.iter().enumerate().map(|(at, (name, _, kind))| {
        let values = rows.iter().map(|row| row.values[at].1.clone()).collect();
        Parameter { name: name.clone(), owner: String::new(), kind, values }
    });
    own.filter(|parameter| parameter.values.iter().any(|value| *value != parameter.values[0])).collect()
}

/// The file that lists the values.
fn variations(rows: &[RowFile], parameters: &[Parameter], file: &str) -> String {
    let header = file_header(Version::V1_2, &format!("Variations of {file}"));
    let sets = (0..rows.len()).map(|row| {
        let values = parameters.iter().map(|parameter| {
            Element::new("ParameterAssignment")
                .with("parameterRef", &parameter.name)
                .with("value", &parameter.values[row])
        });
        Element::new("ParameterValueSet").holding_all(values)
    });
    let listed = Element::new("DeterministicMultiParameterDistribution")
        .holding(Element::new("ValueSetDistribution").holding_all(sets));
    let distribution = Element::new("ParameterValueDistribution")
        .holding(Element::new("ScenarioFile").with("filepath", file))
        .holding(Element::new("Deterministic").holding(listed));
    Element::new("OpenSCENARIO").holding(header).holding(distribution).document()
}
