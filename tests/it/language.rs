//! The reference of the language (docs/language): every word of the language is on it.

use std::collections::BTreeSet;

use avastra::model::vocabulary::{
    Body, Colour, EpisodeField, Fact, Field, LaneChoice, Level, Light, OriginField, Phenomenon, Priority,
    ROAD_LANES, ROAD_USER, RoadField, RoadKind, ScenarioClaim, Side, SpaceClaim, StartField, StopReason,
    TYPES, Then, TimeOfDay, TrafficRule, Verb, WAIT, Word, WordFact,
};
use avastra::model::{Avoidability, COUNTED, ENDS, MODULES, body};
use avastra::syntax::keyword::keywords;
use avastra::units::UNITS;

use crate::cases::{files_below, root};

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

/// The reference of the language, as one text.
fn page() -> String {
    let files = files_below(root().join("docs/language"), "md");
    let texts = files.iter().map(|file| std::fs::read_to_string(file).expect("it is a text"));
    texts.collect()
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
    assert!(missing.is_empty(), "docs/language does not mention {missing:?}");
}
