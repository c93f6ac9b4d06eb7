//! The part of a page about a whole run, training, study or estimate, beside its scenarios.

use serde_json::{Value, json};

use avastra_campaign::estimate::FRAME;
use avastra_campaign::oracle::MIXED;
use avastra_campaign::run::{
    self, Database, DatabaseError, HeatMap, Profile, RequirementCount, TrafficRecord,
};
use avastra_drivers::external::Attached;
use avastra_lang::syntax::read_yaml;
use avastra_world::action::ActionTable;

/// The results of a run or a training: totals, groups of similar failures, rows on roads, refusals, the curve of
/// learning, and what was learned. `settings` is the text of its `run.yaml`. `results` is what a finished training wrote.
/// `heat` is the maps of how actions ended.
///
/// # Errors
/// If the database cannot be read.
pub fn of_run(
    database: &Database,
    table: Option<&ActionTable>,
    settings: &str,
    results: Option<&Value>,
    heat: &[HeatMap],
) -> Result<Value, DatabaseError> {
    let rows = table.map(|table| table.rows().iter().map(|row| row.label.as_str()).collect::<Vec<_>>());
    let learning = database.learning()?;
    let totals = database.totals()?;
    Ok(json!({
        "heat": heat,
        "kind": if learning.is_empty() { "run" } else { "training" },
        "settings": settings, "conditions": conditions(settings), "simulated_h": totals.simulated_s / 3600.0, "totals": totals,
        "requirements": requirements(database, table)?, "mixed": mixed(settings),
        "groups": database.groups()?, "left": database.left(read_yaml(settings).ok().as_ref())?, "refusals": database.refusals()?, "failures": database.failures()?,
        "rows": rows, "coverage": database.coverage()?, "learning": learning,
        "evaluation": results.map(|results| &results["evaluation"]),
    }))
}

/// The requirements that were in force, each with what it asks where the space can be read.
fn requirements(database: &Database, table: Option<&ActionTable>) -> Result<Vec<Value>, DatabaseError> {
    let declared = |name: &str| table?.space().requirements.iter().find(|of| of.name == name);
    let told = |of: RequirementCount| {
        let def = declared(&of.requirement);
        let mut told = json!(of);
        told["formula"] = json!(def.map(|def| &def.formula));
        told["docs"] = json!(def.map(|def| def.docs.join(" ")));
        told
    };
    Ok(database.requirements()?.into_iter().map(told).collect())
}

/// The remark on recurrences where the driving system says that it is not deterministic.
fn mixed(settings: &str) -> Option<&'static str> {
    let told = told_in(settings)?;
    told.external.filter(|attached| !attached.is_deterministic()).map(|_| MIXED)
}

/// A study's results, as its `results.json` has them.
pub fn of_study(results: &Value, settings: &str) -> Value {
    json!({ "kind": "study", "settings": settings, "conditions": conditions(settings), "study": results })
}

/// An estimate's results, as its `results.json` has them.
pub fn of_estimate(results: &Value, settings: &str) -> Value {
    json!({
        "kind": "estimate", "settings": settings, "conditions": conditions(settings), "estimate": results, "frame": FRAME,
    })
}

/// The part of the settings that a page shows.
#[derive(serde::Deserialize)]
struct Told {
    space: String,
    roads: Vec<String>,
    ads: String,
    profile: Option<Profile>,
    external: Option<Attached>,
    traffic: Option<TrafficRecord>,
    #[serde(default)]
    ambient: u32,
    /// Rules and requirements that are switched off, and optional ones that are switched on.
    #[serde(default)]
    without: Vec<String>,
    #[serde(default)]
    with: Vec<String>,
    agent: Option<String>,
    seed: Option<u64>,
    /// A study has this in place of `seed`.
    first_seed: Option<u64>,
}

/// Reads settings of earlier builds, too.
fn told_in(settings: &str) -> Option<Told> {
    serde_json::from_value(Value::Object(run::flat(settings)?.0)).ok()
}

/// The traffic profile of runs that ask for none.
const CAREFUL: &str = "careful";

/// What a run, a training, a study or an estimate played against what, by its settings: name and text of each condition.
/// Nothing if the settings are of a version that wrote them otherwise.
fn conditions(settings: &str) -> Vec<(&'static str, String)> {
    let Some(of) = told_in(settings) else { return Vec::new() };
    let program = of.external.as_ref().map(Attached::name);
    let driver = match &of.profile {
        None => program.unwrap_or(of.ads),
        Some(profile) => match profile.settings.in_words() {
            changes if changes.is_empty() => format!("{}, default profile", of.ads),
            changes => format!("{} with {changes}", of.ads),
        },
    };
    // A profile of the author's own is told by what it changes.
    let manners = of.traffic.as_ref().map(TrafficRecord::in_words).unwrap_or_else(|| CAREFUL.to_owned());
    let traffic = if of.ambient == 0 { manners } else { format!("{manners}, {} ambient", of.ambient) };
    let known = [
        ("Space", Some(of.space)),
        ("Driving system", Some(driver)),
        ("Traffic", Some(traffic)),
        ("Switched off", (!of.without.is_empty()).then(|| of.without.join(", "))),
        ("Switched on", (!of.with.is_empty()).then(|| of.with.join(", "))),
        ("Agent", of.agent),
        ("Roads", Some(of.roads.join(", "))),
        ("Seed", of.seed.or(of.first_seed).map(|seed| seed.to_string())),
    ];
    known.into_iter().filter_map(|(name, text)| Some((name, text?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_told_as_far_as_the_settings_have_them() {
        let settings = "conditions: {space: ../s.ava, roads: [corner, boulevard], ads: modular, ambient: 5}\nagent: random\nseed: 7";
        let told = conditions(settings);
        let text =
            |wanted: &str| told.iter().find(|(name, _)| *name == wanted).map(|(_, text)| text.as_str());
        assert_eq!(text("Space"), Some("../s.ava"));
        assert_eq!(text("Driving system"), Some("modular"));
        assert_eq!(text("Roads"), Some("corner, boulevard"));
        assert_eq!(text("Seed"), Some("7"));
        assert_eq!(text("Traffic"), Some("careful, 5 ambient"));
        let calm = conditions("space: s.ava\nroads: [corner]\nads: modular");
        assert!(calm.contains(&("Traffic", "careful".to_owned())), "{calm:?}");
        assert!(conditions("seed: 7").is_empty());
    }
}
