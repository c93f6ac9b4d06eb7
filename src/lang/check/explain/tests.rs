//! Every code has a page, and its examples are true: the wrong example gives that code, the right one is
//! sound.

use std::path::Path;

use crate::check::explain::{PAGES, page};
use crate::check::{Loaded, ReadError, load};
use crate::model::policy::VARIABLES;
use crate::syntax::{Style, render};

/// Compiles an example as if it were in the folder of the shipped files.
fn compiled(text: &str) -> Loaded {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    load(Path::new("example.ava"), &|path| match path.to_str() {
        Some("example.ava") => Ok(text.to_owned()),
        _ => std::fs::read_to_string(folder.join(path)).map_err(|error| ReadError::new(error.to_string())),
    })
    .unwrap()
}

fn codes(loaded: &Loaded) -> Vec<&'static str> {
    loaded.diagnostics.iter().chain(&loaded.remarks).map(|found| found.code).collect()
}

fn shown(loaded: &Loaded) -> String {
    let all = loaded.diagnostics.iter().chain(&loaded.remarks);
    all.map(|found| render(found, &loaded.sources, Style::Plain)).collect::<Vec<_>>().join("\n")
}

/// The codes that the two tables declare.
fn declared() -> Vec<String> {
    let tables = [include_str!("../../model/code.rs"), include_str!("../../syntax/code.rs")];
    let quoted =
        |text: &'static str| text.split('"').filter(|part| part.starts_with("AV0")).map(str::to_owned);
    let mut codes: Vec<String> = tables.into_iter().flat_map(quoted).collect();
    codes.sort_unstable();
    codes
}

#[test]
fn the_page_about_variables_lists_them_all() {
    let page = page("AV0705").unwrap().text;
    let names = VARIABLES.iter().map(|variable| variable.name);
    let missing: Vec<&str> = names.filter(|name| !page.contains(&format!("`{name}`"))).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn every_code_has_a_page_and_no_other() {
    let pages: Vec<&str> = PAGES.iter().map(|page| page.code).collect();
    assert_eq!(pages, declared());
    let mut once = pages.clone();
    once.dedup();
    assert_eq!(pages, once, "a code is never used twice");
    assert_eq!(page("av0101").map(|page| page.code), Some("AV0101"));
}

#[test]
fn wrong_examples_are_wrong_and_right_ones_right() {
    let mut untrue = Vec::new();
    for page in PAGES {
        assert!(page.text.starts_with(&format!("# {}: ", page.code)), "{}", page.code);
        assert!(!page.title().is_empty() && page.summary().ends_with('.'), "{}", page.code);
        // A page does not print a file that is too long; its lines are added here.
        let lines = if page.code == "AV0013" { 110_000 } else { 0 };
        let wrong = compiled(&(page.example("## Wrong").to_owned() + &"let a = 1\n".repeat(lines)));
        if !codes(&wrong).contains(&page.code) {
            untrue.push(format!("{} wrong:\n{}", page.code, shown(&wrong)));
        }
        let right = compiled(page.example("## Right"));
        let errors = right.diagnostics.iter().any(crate::syntax::Diagnostic::is_error);
        if errors || codes(&right).contains(&page.code) {
            untrue.push(format!("{} right:\n{}", page.code, shown(&right)));
        }
    }
    assert!(untrue.is_empty(), "{}", untrue.join("\n"));
}
