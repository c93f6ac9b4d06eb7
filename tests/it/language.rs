//! The reference page: every example on it compiles, and every word of the language is on it.

use std::collections::BTreeSet;

use avastra::check::Loaded;
use avastra::model::vocabulary::{
    Body, Colour, EpisodeField, Fact, Field, LaneChoice, Level, Light, OriginField, Phenomenon, Priority,
    ROAD_LANES, ROAD_USER, RoadField, RoadKind, ScenarioClaim, Side, SpaceClaim, StartField, StopReason,
    TYPES, Then, TimeOfDay, TrafficRule, Verb, WAIT, Word, WordFact,
};
use avastra::model::{Avoidability, COUNTED, ENDS, MODULES, body};
use avastra::syntax::Diagnostic;
use avastra::syntax::keyword::keywords;
use avastra::units::UNITS;

use crate::cases::root;
use crate::world::loaded;

#[test]
fn the_bodies_of_the_page_are_the_engines() {
    let page = page();
    for body in Body::ALL {
        let size = body::parameters(*body);
        let (length_m, width_m, height_m) = (size.length_m, size.width_m, size.height_m);
        let (gains_mps2, loses_mps2) = (size.acceleration_mps2_max, size.deceleration_mps2_max);
        let row =
            format!("| `{}` | {length_m}, {width_m}, {height_m} | {gains_mps2}, {loses_mps2} |", body.name());
        assert!(page.contains(&row), "{row}");
    }
}

fn page() -> String {
    std::fs::read_to_string(root().join("LANGUAGE.md")).expect("the page is there")
}

/// The texts between the fences of ```` ```ava ````, each with the words after `ava` and its line.
fn examples(page: &str) -> Vec<(String, String, usize)> {
    let mut found = Vec::new();
    let mut lines = page.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let Some(info) = line.strip_prefix("```ava") else { continue };
        let inside: Vec<&str> =
            lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```").collect();
        found.push((info.trim().to_owned(), inside.join("\n") + "\n", number + 1));
    }
    found
}

/// Compiles an example as if it stood beside the shipped files.
fn compiled(example: &str) -> Loaded {
    let text = match example.starts_with("language") || example.starts_with("//!") {
        true => example.to_owned(),
        false => format!("language 1\nuse \"avastra45.ava\"\n{example}"),
    };
    loaded("scenarios/example.ava", &text)
}

#[test]
fn every_example_says_what_the_page_says_of_it() {
    let examples = examples(&page());
    assert!(examples.len() >= 18, "{} examples", examples.len());
    let mut wrong = Vec::new();
    for (info, text, line) in &examples {
        let loaded = compiled(text);
        let errors = loaded.diagnostics.iter().filter(|found| found.is_error());
        let codes: Vec<&str> = errors.map(|found| found.code).collect();
        let wanted: Vec<&str> = info.strip_prefix("error=").into_iter().collect();
        if codes != wanted {
            let messages: Vec<&Diagnostic> = loaded.diagnostics.iter().collect();
            wrong.push(format!("line {line}: {messages:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The words in the first column of the table with that heading.
fn first_column<'a>(page: &'a str, heading: &str) -> BTreeSet<&'a str> {
    let from = page.find(&format!("\n| {heading} |")).expect("the table is there") + 1;
    let rows = page[from..].lines().skip(2).take_while(|line| line.starts_with('|'));
    rows.filter_map(|row| row.strip_prefix("| `")?.split('`').next()).collect()
}

#[test]
fn the_tables_of_the_page_list_the_words_of_the_engine() {
    let page = page();
    let check = |heading: &str, words: Vec<&str>| {
        assert_eq!(first_column(&page, heading), BTreeSet::from_iter(words), "the table `{heading}`");
    };
    check("type", TYPES.iter().map(|(word, ..)| *word).chain([ROAD_USER.0]).collect());
    check("field", Field::of_spawns().into_iter().map(Word::name).collect());
    check("verb", Verb::names().collect());
    check("setting", EpisodeField::names().collect());
}

#[test]
fn every_word_of_the_language_is_on_the_page() {
    let page = page();
    let mut on_page: BTreeSet<&str> = page.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    // Units and the like do not consist of letters alone.
    on_page.extend(page.split([' ', '`', ',', '|', '\n', ')', '(', '}']));
    let all: [Vec<&str>; 25] = [
        keywords().map(|(word, _)| *word).collect(),
        UNITS.iter().map(|unit| unit.word).collect(),
        ENDS.to_vec(),
        MODULES.to_vec(),
        Avoidability::names().collect(),
        vec![COUNTED, ROAD_LANES.0, WAIT.0],
        Fact::names().chain(WordFact::names()).collect(),
        Light::names().chain(RoadKind::names()).collect(),
        RoadField::names().collect(),
        StartField::names().collect(),
        OriginField::names().collect(),
        StopReason::names().collect(),
        SpaceClaim::names().collect(),
        ScenarioClaim::names().collect(),
        Body::names().collect(),
        Colour::names().collect(),
        LaneChoice::names().collect(),
        Level::names().collect(),
        TrafficRule::names().collect(),
        Field::names().collect(),
        Phenomenon::names().collect(),
        Priority::names().collect(),
        Side::names().collect(),
        Then::names().collect(),
        TimeOfDay::names().collect(),
    ];
    let missing: Vec<&str> = all.into_iter().flatten().filter(|word| !on_page.contains(word)).collect();
    assert!(missing.is_empty(), "LANGUAGE.md does not mention {missing:?}");
}
