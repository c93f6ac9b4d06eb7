//! Files that `avastra export` wrote. They carry their scenario, with its seeds and the moments of its actions, which is taken
//! over in place of the ways of the road users.
//!
//! The text is not trusted: the imported file is checked and played like any other.

use core::fmt::Write;

use roxmltree::Document;

use crate::export::{SCENARIO_TEXT, SCENARIO_TEXT_LACKS};
use avastra_campaign::emit::quoted;
use avastra_lang::model::ENDS;
use avastra_world::sim::ENGINE;

use super::source::{Source, element};

/// The scenario that a file carries.
pub struct Own {
    /// From the road to the end of the scenario, with the claims that are taken over.
    pub text: String,
    /// The map as the file names it.
    pub map: String,
    pub description: String,
}

/// The scenario in a file that avastra exported; `None` for other files.
pub fn read(source: &mut Source, document: &Document) -> Option<Own> {
    let root = document.root_element();
    let header =
        element(root, "FileHeader").filter(|header| header.attribute("author") == Some("avastra"))?;
    let properties = root.descendants().filter(|node| node.has_tag_name("Property"));
    let facts = properties.filter_map(|node| Some((node.attribute("name")?, node.attribute("value")?)));
    let facts: Vec<(&str, &str)> = facts.collect();
    let value = |name: &str| facts.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
    let scenario = value(SCENARIO_TEXT)?.trim_end().strip_suffix('}')?;
    let network = element(root, "RoadNetwork")?;
    let map = element(network, "LogicFile")?.attribute("filepath")?.to_owned();
    source.note(
        "an export of avastra: its actions are taken over with the values that they had, and neither the \
         ways of the road users nor the rules of its space",
    );
    let mut text = scenario.to_owned();
    let lacks = value(SCENARIO_TEXT_LACKS);
    let engine = value("engine").filter(|engine| *engine != ENGINE);
    match (lacks, engine) {
        (None, None) => facts.iter().filter_map(claim).for_each(|claim| {
            let _ = write!(text, " expect {claim}");
        }),
        (lacks, engine) => {
            source.note("its claims are not taken over");
            if let Some(lacks) = lacks {
                source.note(format!("not kept: {lacks}"));
            }
            if let Some(engine) = engine {
                let other = format!("it was made in the world `{engine}`, and this is `{ENGINE}`");
                source.note(other + ": its episode may differ");
            }
        }
    }
    text += " }";
    Some(Own { text, map, description: header.attribute("description").unwrap_or("").to_owned() })
}

/// A claim about the drive, as the language says it.
fn claim(&(name, value): &(&str, &str)) -> Option<String> {
    match name {
        "end" => ENDS.contains(&value).then(|| format!("end == {value}")),
        "trace" => Some(format!("trace == {}", quoted(value))),
        _ => {
            let number: u32 = name.strip_prefix("collision npc_")?.parse().ok()?;
            let at_s = value.strip_suffix(" s").filter(|time_s| time_s.parse::<f64>().is_ok());
            let at = at_s.map_or_else(String::new, |at_s| format!(" at {at_s} s"));
            Some(format!("collision with npc#{number}{at}"))
        }
    }
}
