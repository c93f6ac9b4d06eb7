//! docs/reference/formats.md says of every attribute of OpenSCENARIO and OpenDRIVE what becomes of it: that is what the code does, as far as
//! its text shows. `tests/interop/formats.py` compares the page with the schemas.

use std::collections::{BTreeMap, BTreeSet};

use crate::cases::{files_below, root};

/// The attributes of an element that are read, noted and passed over.
type Fates = [BTreeSet<String>; 3];

/// Each format: its heading on the page, the file with its table, and the folders of its readers.
const FORMATS: [(&str, &str, &[&str]); 2] = [
    ("OpenSCENARIO", "src/exchange/import/vocabulary.rs", &["src/exchange/import"]),
    ("OpenDRIVE", "src/road/opendrive/vocabulary.rs", &["src/road/opendrive"]),
];

/// Attributes of elements that are refused as a whole where these say so.
const OF_REFUSED: [&str; 1] = ["active"];

/// Functions that ask an element for an attribute.
const ASKS: [&str; 13] = [
    "amount",
    "attribute",
    "has_attribute",
    "integer",
    "left",
    "left_or_0",
    "named",
    "number",
    "number_or",
    "switch",
    "text",
    "within",
    "word",
];

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).expect("it is there")
}

/// The table of a file: rows of `Element [read noted~ passed-]`.
fn of_code(path: &str) -> BTreeMap<String, Fates> {
    let text = read(path);
    let table = text.split("const ELEMENTS: &str = \"").nth(1).and_then(|rest| rest.split("\";").next());
    let row = |row: &str| {
        let (name, rest) = row.trim().split_once(" [")?;
        let mut fates = Fates::default();
        for attribute in rest.split_once(']')?.0.split_whitespace() {
            let (fate, name) = match (attribute.strip_suffix('~'), attribute.strip_suffix('-')) {
                (Some(name), _) => (1, name),
                (_, Some(name)) => (2, name),
                _ => (0, attribute),
            };
            fates[fate].insert(name.to_owned());
        }
        Some((name.to_owned(), fates))
    };
    table.expect("it has the table").split(';').filter_map(row).collect()
}

/// The table of a section of the page.
fn of_page(heading: &str) -> BTreeMap<String, Fates> {
    let page = read("docs/reference/formats.md");
    let section =
        page.split("\n## ").find(|section| section.starts_with(heading)).expect("it has the section");
    let names = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<BTreeSet<_>>();
    let row = |line: &str| {
        let cells: Vec<&str> = line.strip_prefix("| `")?.split('|').collect();
        let [name, read, noted, passed, _] = cells[..] else { return None };
        Some((name.trim().trim_matches('`').to_owned(), [names(read), names(noted), names(passed)]))
    };
    section.lines().filter_map(row).collect()
}

#[test]
fn the_page_of_formats_says_what_the_code_does() {
    for (heading, path, _) in FORMATS {
        let (code, page) = (of_code(path), of_page(heading));
        assert!(code.len() > 50, "{heading}: {}", code.len());
        for (element, fates) in &code {
            assert_eq!(page.get(element), Some(fates), "{heading}: `{element}`: the code is right");
        }
        assert_eq!(page.keys().collect::<Vec<_>>(), code.keys().collect::<Vec<_>>(), "{heading}");
    }
}

#[test]
fn what_the_readers_ask_for_is_what_the_tables_call_read() {
    for (heading, path, folders) in FORMATS {
        let table = of_code(path);
        let read = table.values().flat_map(|fates| fates[0].iter().map(String::as_str));
        let is_read: BTreeSet<&str> = read.collect();
        let files = folders.iter().flat_map(|folder| files_below(root().join(folder), "rs"));
        let files = files.filter(|file| !file.ends_with("vocabulary.rs"));
        let code: String = files.map(|file| std::fs::read_to_string(file).expect("it is there")).collect();
        let (mut asked, mut quoted) = (BTreeSet::new(), BTreeSet::new());
        let parts: Vec<&str> = code.split('"').collect();
        for pair in parts.windows(2) {
            let name = pair[1];
            if name.is_empty() || !name.chars().all(|one| one.is_ascii_alphanumeric()) {
                continue;
            }
            quoted.insert(name);
            // `number(place, "x"` or `number("x"`.
            let before = pair[0].trim_end();
            let open = before.rfind('(').filter(|open| !before[open + 1..].contains([')', ';', '"']));
            let function =
                open.map(|open| before[..open].rsplit(|one: char| !(one.is_alphanumeric() || one == '_')));
            let asks = function.and_then(|mut words| words.next()).is_some_and(|word| ASKS.contains(&word));
            // Elements begin upper case, and a word of one letter may be a unit.
            let is_attribute = name.starts_with(|one: char| one.is_ascii_lowercase()) && name.len() > 1;
            if asks && is_attribute && !OF_REFUSED.contains(&name) {
                asked.insert(name);
            }
        }
        let unsaid: Vec<&&str> = asked.iter().filter(|name| !is_read.contains(*name)).collect();
        assert!(unsaid.is_empty(), "{heading}: asked for, and not read by the table: {unsaid:?}");
        let unasked: Vec<&&str> = is_read.iter().filter(|name| !quoted.contains(*name)).collect();
        assert!(unasked.is_empty(), "{heading}: read by the table, and never asked for: {unasked:?}");
    }
}
