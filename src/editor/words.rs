//! The words that no file declares, as lists for the editor. The keywords stand in `syntax::keyword`, the
//! engine's words in `model::vocabulary`.

use avastra_lang::model::field::Kind;
use avastra_lang::model::vocabulary::{
    BEGINS, Body, Colour, EpisodeField, Field, LightColour, LightField, NearWord, NumberWord, PastWord,
    ROAD_USER, RoadField, SINCE, Side, Site, StartField, TYPES, Then, TrafficRule, Verb, Word,
};
use avastra_lang::model::{DRIVERS, ENDS, MODULES};

/// A word and what it means.
pub type Entry = (&'static str, &'static str);

/// The words of a kind.
pub fn of<W: Word>() -> Vec<Entry> {
    W::ALL.iter().map(|word| (word.name(), word.meaning())).collect()
}

/// The types of the language.
pub fn types() -> Vec<Entry> {
    TYPES.iter().map(|(word, _, meaning)| (*word, *meaning)).chain([ROAD_USER]).collect()
}

/// The facts that are known at a site, without those that have a `.`.
pub fn facts(site: Site) -> Vec<Entry> {
    let facts = site.facts().map(|fact| (fact.name(), fact.meaning()));
    let words = site.word_facts().map(|fact| (fact.name(), fact.meaning()));
    let since = site.knows_actions().then_some(SINCE);
    let past = if site.is_requirement() {
        [of::<PastWord>(), of::<NearWord>(), vec![BEGINS]].concat()
    } else {
        Vec::new()
    };
    facts
        .chain(words)
        .filter(|(name, _)| !name.contains('.'))
        .chain(since)
        .chain(past)
        .chain(of::<NumberWord>())
        .collect()
}

/// The words for a field of a spawn or an order; `body` is what stands before `ahead` or `behind`.
pub fn engine_words(field: &str) -> Vec<Entry> {
    let Some(field) = Field::from_name(field) else {
        return if field == "body" { of::<Body>() } else { Vec::new() };
    };
    match (field, field.kind()) {
        (_, Kind::Word(kind)) => (kind.words)(),
        (_, Kind::Rules) => of::<TrafficRule>(),
        (Field::Does, _) => of::<Verb>(),
        (Field::Side, _) => of::<Side>(),
        (Field::Then, _) => of::<Then>(),
        (Field::Colour, _) => of::<Colour>(),
        _ => Vec::new(),
    }
}

/// The words for a field of `order light`.
pub fn light_words(field: &str) -> Vec<Entry> {
    match LightField::from_name(field) {
        Some(LightField::Colour) => of::<LightColour>(),
        Some(LightField::At) | None => Vec::new(),
    }
}

/// The words of a claim in a scenario: how an episode ends, and which module is at fault.
pub fn claim_words(claim: &str) -> &'static [&'static str] {
    match claim {
        "end" => &ENDS,
        "cause" => &MODULES,
        _ => &[],
    }
}

/// Driving systems by which a claim may say that something is avoided or kept.
pub fn drivers() -> Vec<Entry> {
    DRIVERS.into_iter().map(|driver| (driver, "")).collect()
}

/// The meaning of a field in a block: a spawn, an order, a road, an episode or a start.
pub fn field(word: &str) -> Option<&'static str> {
    let blocks = [of::<Field>(), of::<RoadField>(), of::<EpisodeField>(), of::<StartField>()];
    blocks.iter().find_map(|fields| meaning(fields, word))
}

/// The meaning of a word in a list.
pub fn meaning(words: &[Entry], word: &str) -> Option<&'static str> {
    words.iter().find(|(known, _)| *known == word).map(|(_, meaning)| *meaning)
}
