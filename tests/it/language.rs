//! The reference page: every example on it compiles, and every word of the language is on it.

use std::collections::BTreeSet;
use std::path::Path;

use avastra::check::{Loaded, load};
use avastra::model::vocabulary::{
    Body, Colour, LaneChoice, Level, Phenomenon, Side, Then, TimeOfDay, Verb, Word,
};
use avastra::model::{ENDS, MODULES};
use avastra::syntax::Diagnostic;
use avastra::units::UNITS;

use crate::cases::root;
use crate::world::read;

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
    load(Path::new("example.ava"), &|path| match path.to_str() {
        Some("example.ava") => Ok(text.clone()),
        _ => read(&root().join("scenarios").join(path)),
    })
    .expect("its text is known")
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

/// The words between the quotes of a source text.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('"').skip(1).step_by(2)
}

/// The words of the lists that the checker declares as constants: fields, settings, facts.
fn words_of_the_checker() -> Vec<String> {
    let folder = root().join("src/check");
    let mut words = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the checker is there").flatten() {
        if entry.path().is_dir() {
            continue;
        }
        let text = std::fs::read_to_string(entry.path()).expect("a source file is readable");
        for list in ["const FIELDS", "const FACTS"] {
            for (at, _) in text.match_indices(list) {
                let end = text[at..].find("];").expect("a list ends");
                words.extend(quoted(&text[at..at + end]).map(str::to_owned));
            }
        }
    }
    assert!(words.len() > 25, "{words:?}");
    words
}

#[test]
fn every_word_of_the_language_is_on_the_page() {
    let page = page();
    let mut on_page: BTreeSet<&str> = page.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    // Units and the like do not consist of letters alone.
    on_page.extend(page.split([' ', '`', ',', '|', '\n', ')', '(', '}']));
    let names = |all: &[&'static str]| all.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    fn spelt<W: Word>() -> Vec<String> {
        W::ALL.iter().map(|word| word.name().to_owned()).collect()
    }
    let grammar = std::fs::read_to_string(root().join("grammar/ava.pest")).expect("it is there");
    let terminals = grammar.lines().filter(|line| line.starts_with("kw_") || line.starts_with("op_"));
    let keywords: Vec<String> = terminals.filter_map(|line| quoted(line).next()).map(str::to_owned).collect();
    assert!(keywords.len() > 55, "{keywords:?}");
    let types = ["Bool", "Int", "Length", "Duration", "Speed", "Accel", "Angle", "Ratio"];
    let claims =
        ["count", "every", "actions", "realisable", "counted", "beyond_reference", "unavoidable", "wait"];
    let all = [
        keywords,
        words_of_the_checker(),
        names(&types),
        names(&claims),
        names(&ENDS),
        names(&MODULES),
        UNITS.iter().map(|unit| unit.word.to_owned()).collect(),
        spelt::<Body>(),
        spelt::<Colour>(),
        spelt::<LaneChoice>(),
        spelt::<Level>(),
        spelt::<Phenomenon>(),
        spelt::<Side>(),
        spelt::<Then>(),
        spelt::<TimeOfDay>(),
        spelt::<Verb>(),
        names(&["limit", "lanes", "arrived", "stalled", "signal_phase", "traffic_seed", "ambient"]),
    ];
    let missing: Vec<String> =
        all.into_iter().flatten().filter(|word| !on_page.contains(word.as_str())).collect();
    assert!(missing.is_empty(), "LANGUAGE.md does not mention {missing:?}");
}
