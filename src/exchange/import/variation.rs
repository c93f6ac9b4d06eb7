//! Variations of a scenario: the values that a file with a `ParameterValueDistribution` gives to its parameters.

use std::collections::BTreeMap;

use roxmltree::Node;

use super::chance;
use super::source::{Source, children, element, elements};
use super::story::check_header;
use super::vocabulary;

/// The most variations that a file may be asked to have: a test with more is not practical.
pub const VARIATIONS_MAX: u32 = 60_000;

/// The most variations that are read unless more are asked for: what is read within a second.
pub const VARIATIONS_USUAL: u32 = 500;

/// The most values of all variations together.
const VALUES_MAX: usize = 2_000_000;

/// Values of parameters, by name.
pub type Values = BTreeMap<String, String>;

/// The content of a distribution.
#[derive(Debug)]
pub struct Distribution {
    pub description: String,
    /// The parameters in the order of the file.
    pub parameters: Vec<String>,
    /// One or more.
    pub variations: Vec<Values>,
}

/// The scenario that a file of variations names, and its line; the outer `None` if it is another file, the inner one if something
/// is refused.
pub fn scenario(source: &mut Source, root: Node) -> Option<Option<(String, u32)>> {
    let found = element(root, "ParameterValueDistribution")?;
    let named = |source: &mut Source| {
        let file = source.required(found, "ScenarioFile")?;
        Some((source.text(file, "filepath")?, source.mark(file).line))
    };
    Some(named(source))
}

/// The distribution of a file, of at most `most` variations, over a scenario that declares these parameters, with their values
/// there; `None` if something is refused.
pub fn read(source: &mut Source, root: Node, declared: &Values, most: usize) -> Option<Distribution> {
    let found = element(root, "ParameterValueDistribution")?;
    for (node, reason) in vocabulary::looked_over(root).unknown {
        source.refuse::<()>(node, reason);
    }
    let header = check_header(source, root)?;
    source.declare(root);
    let mut parameters: Vec<String> = Vec::new();
    let mut claim = |source: &mut Source, part: Node, name: &str| {
        let reason = format!("it lists values of `{name}` again: one of the two would count for nothing");
        source.refuse_if(parameters.iter().any(|known| known == name), part, reason)?;
        let reason = format!("the scenario declares no parameter `{name}`");
        source.refuse_if(!declared.contains_key(name), part, reason)?;
        parameters.push(name.to_owned());
        Some(())
    };
    let mut variations = match element(found, "Stochastic") {
        Some(stochastic) => chance::runs(source, stochastic, most, &mut claim)?,
        None => {
            let listed = source.required(found, "Deterministic")?;
            combined(source, listed, most, &mut claim)?
        }
    };
    let description = header.attribute("description").unwrap_or("").to_owned();
    // A set need not say all of them.
    for values in &mut variations {
        for name in parameters.iter().filter(|name| !values.contains_key(*name)).collect::<Vec<_>>() {
            values.insert(name.clone(), declared.get(name).cloned().unwrap_or_default());
        }
    }
    Some(Distribution { description, parameters, variations })
}

/// How many variations are read at most, as the end of a refusal.
pub fn too_many(most: usize) -> String {
    let more = if most < VARIATIONS_MAX as usize {
        format!(", up to {VARIATIONS_MAX} with `--variations`")
    } else {
        String::new()
    };
    format!("{most} are read{more}")
}

/// Each value that is listed with each value of the other parameters. `claim` is asked about each parameter.
fn combined(
    source: &mut Source,
    listed: Node,
    most: usize,
    mut claim: impl FnMut(&mut Source, Node, &str) -> Option<()>,
) -> Option<Vec<Values>> {
    let mut variations = vec![Values::new()];
    let mut width = 0;
    for part in children(listed) {
        let (own, choices) = match part.tag_name().name() {
            "DeterministicSingleParameterDistribution" => {
                let name = source.named(part, "parameterName")?;
                let values = single(source, part, most)?;
                let choices: Vec<Values> =
                    values.into_iter().map(|value| Values::from([(name.clone(), value)])).collect();
                (vec![name], choices)
            }
            "DeterministicMultiParameterDistribution" => sets(source, part)?,
            _ => return source.refuse(part, "such a distribution is not read"),
        };
        source.refuse_if(choices.is_empty(), part, "it lists no value")?;
        width += own.len();
        for name in own {
            claim(source, part, &name)?;
        }
        let count = variations.len().saturating_mul(choices.len());
        let reason = format!("its values make {count} variations: {}", too_many(most));
        source.refuse_if(count > most, part, reason)?;
        let reason = format!("{count} variations of {width} parameters are more than {VALUES_MAX} values");
        source.refuse_if(count.saturating_mul(width) > VALUES_MAX, part, reason)?;
        let with = |values: &Values| {
            let values = values.clone();
            choices
                .iter()
                .map(move |more| values.iter().chain(more).map(|(k, v)| (k.clone(), v.clone())).collect())
        };
        variations = variations.iter().flat_map(with).collect();
    }
    Some(variations)
}

/// The values of one parameter.
fn single(source: &mut Source, part: Node, most: usize) -> Option<Vec<String>> {
    let Some(inner) = children(part).next() else { return source.refuse(part, "it is empty") };
    match inner.tag_name().name() {
        "DistributionSet" => {
            let value = |one: Node| {
                source.refuse_if(one.has_attribute("weight"), one, "it has no attribute `weight`")?;
                source.text(one, "value")
            };
            elements(inner, "Element").map(value).collect()
        }
        "DistributionRange" => {
            let step = source.number(inner, "stepWidth")?;
            let range = source.required(inner, "Range")?;
            let [low, high] = chance::bounds(source, range)?;
            source.refuse_if(step <= 0.0, inner, "its steps are above 0")?;
            // A range whose last step misses its end by rounding reaches it all the same.
            let count = ((high - low) / step + 1e-6).floor();
            let reason = format!("it has {:.0} values: {}", count + 1.0, too_many(most));
            source.refuse_if(count >= most as f64, inner, reason)?;
            Some((0..=count as usize).map(|nth| plain(low + nth as f64 * step)).collect())
        }
        "UserDefinedDistribution" => source.refuse(inner, "a distribution of the user's own is not read"),
        _ => source.refuse(inner, "such a distribution is not read"),
    }
}

/// A number without the noise of adding steps.
pub fn plain(value: f64) -> String {
    let rounded = (value * 1e9).round() / 1e9;
    format!("{rounded}")
}

/// Values of several parameters together, and the names of these in the order in which they come.
fn sets(source: &mut Source, part: Node) -> Option<(Vec<String>, Vec<Values>)> {
    let list = source.required(part, "ValueSetDistribution")?;
    let (mut names, mut found) = (Vec::new(), Vec::new());
    for set in elements(list, "ParameterValueSet") {
        let mut values = Values::new();
        for one in elements(set, "ParameterAssignment") {
            let name = source.named(one, "parameterRef")?;
            if !names.contains(&name) {
                names.push(name.clone());
            }
            values.insert(name, source.text(one, "value")?);
        }
        found.push(values);
    }
    Some((names, found))
}
