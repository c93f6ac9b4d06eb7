//! docs/reference/settings.md has each setting of each agent that learns, and the values of each preset.

use std::collections::BTreeMap;

use serde_json::Value;

use avastra::agent::{Kind, REGISTRY, Settings};

const PAGE: &str = "docs/reference/settings.md";
/// What stands before the table of values, which ends the page.
const HEAD: &str = "A policy names its preset in `preset`; the other settings are:\n\n";

/// The settings of an agent by their names, but for the name of the preset.
fn record(settings: &Settings) -> BTreeMap<String, Value> {
    let Value::Object(record) = serde_json::to_value(settings).expect("settings are plain") else {
        panic!("settings are an object")
    };
    record.into_iter().filter(|(name, _)| name != "preset").collect()
}

/// The settings of each agent that learns, by its name and its preset.
fn all() -> Vec<(&'static str, Option<&'static str>, BTreeMap<String, Value>)> {
    let mut all = Vec::new();
    for entry in REGISTRY {
        let presets: Vec<Option<&str>> = match entry.kind {
            Kind::Learning(presets) => presets.iter().map(|preset| Some(preset.name)).collect(),
            Kind::Searching(_) => vec![None],
            Kind::Ready(_) | Kind::OneRow(_) => continue,
        };
        for preset in presets {
            let settings = Settings::from_yaml(entry, preset, "").expect("it learns");
            all.push((entry.name, preset, record(&settings.expect("presets are sound"))));
        }
    }
    all
}

/// The cells of the rows of all tables of a page.
fn rows(page: &str) -> Vec<Vec<&str>> {
    let rows = page.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    rows.map(|row| row.split(" | ").collect()).collect()
}

#[test]
#[expect(clippy::disallowed_methods, reason = "a test may ask whether snapshots are to be written")]
fn the_page_of_learners_has_each_setting_and_each_value() {
    let page = std::fs::read_to_string(PAGE).expect("it is there");
    let rows = rows(&page);
    let presets: Vec<_> = all().into_iter().filter(|(_, preset, _)| preset.is_some()).collect();
    let names: Vec<&String> = presets[0].2.keys().collect();
    for name in &names {
        let means = rows.iter().filter(|row| row[0] == format!("`{name}`") && row.len() < presets.len());
        assert_eq!(means.count(), 1, "{PAGE} says once what `{name}` means");
    }
    for (agent, _, settings) in all().iter().filter(|(_, preset, _)| preset.is_none()) {
        for (name, value) in settings {
            let (agent, name, value) = (format!("`{agent}`"), format!("`{name}`"), value.to_string());
            let has = |row: &&Vec<&str>| row[0] == agent && row[1] == name && row.last() == Some(&&*value);
            assert_eq!(rows.iter().filter(has).count(), 1, "{PAGE}: {agent} {name} {value}");
        }
    }
    let heads: Vec<String> = presets
        .iter()
        .map(|(agent, preset, _)| format!("`{agent}` `{}`", preset.expect("it has one")))
        .collect();
    let mut table = format!("| setting | {} |\n|---|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
    for name in names {
        let values: Vec<String> =
            presets.iter().map(|(_, _, settings)| settings[name].to_string().replace('"', "")).collect();
        table += &format!("| `{name}` | {} |\n", values.join(" | "));
    }
    let (before, found) = page.split_once(HEAD).expect("the page ends with the values");
    if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
        std::fs::write(PAGE, format!("{before}{HEAD}{table}")).expect("it is writable");
        return;
    }
    assert!(
        found == table,
        "the values in {PAGE} are not those of the presets: INSTA_UPDATE=always writes\n{table}"
    );
}
