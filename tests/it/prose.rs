//! Sentences of the pages for users are short: what a machine can see of plain English.

use crate::cases::{files_below, root};

/// No sentence has more words.
const WORDS_MAX: usize = 40;
/// A long sentence has more words than this, and of hundred sentences at most so many are long.
const LONG: usize = 25;
const LONG_PERCENT: usize = 8;

/// The paragraphs, items of lists and longer cells of tables of a page, with their lines; without code.
fn paragraphs(page: &str) -> Vec<(usize, String)> {
    let (mut found, mut open): (Vec<(usize, String)>, bool) = (Vec::new(), false);
    let mut is_code = false;
    for (number, line) in (1..).zip(page.lines().map(str::trim)) {
        if line.starts_with("```") {
            (is_code, open) = (!is_code, false);
            continue;
        }
        let is_item = line.starts_with("- ") || line.starts_with(|first: char| first.is_ascii_digit());
        if is_code || line.is_empty() || line.starts_with('#') {
            open = false;
        } else if let Some(row) = line.strip_prefix('|') {
            open = false;
            let cells = row.split('|').map(str::trim);
            found.extend(cells.filter(|cell| !cell.is_empty()).map(|cell| (number, cell.to_owned())));
        } else if open && !is_item {
            let (_, text) = found.last_mut().expect("a paragraph is open");
            *text += " ";
            *text += line;
        } else {
            found.push((number, line.trim_start_matches("- ").to_owned()));
            open = true;
        }
    }
    found
}

/// The numbers of words of the sentences of a text. What stands in backticks is one word.
fn sentences(text: &str) -> Vec<usize> {
    let plain: String =
        text.split('`').enumerate().map(|(nth, part)| if nth % 2 == 1 { "x" } else { part }).collect();
    let ends = |word: &str| word.trim_end_matches(['"', '\'', ')', '*', '_']).ends_with(['.', '!', '?', ':']);
    // Names in a row are a list, and count once.
    let is_name = |word: &str| word.trim_end_matches(',') == "x";
    let mut words: Vec<&str> = plain.split_whitespace().collect();
    words.dedup_by(|next, before| is_name(next) && *before == "x,");
    words.split_inclusive(|word| ends(word)).map(<[&str]>::len).collect()
}

#[test]
fn the_pages_for_users_have_short_sentences() {
    let mut pages = files_below(root().join("docs"), "md");
    pages.push(root().join("README.md"));
    for path in pages {
        let name = path.strip_prefix(root()).expect("it lies there").display();
        let page = std::fs::read_to_string(&path).expect("it is there");
        let (mut all, mut long) = (0, 0);
        for (line, text) in paragraphs(&page) {
            for words in sentences(&text) {
                assert!(words <= WORDS_MAX, "{name}:{line}: a sentence has {words} words: {text}");
                (all, long) = (all + 1, long + usize::from(words > LONG));
            }
        }
        assert!(
            100 * long <= LONG_PERCENT * all,
            "{name}: {long} of {all} sentences have more than {LONG} words"
        );
    }
}

#[test]
fn sentences_are_told_apart() {
    let text = "A vehicle drives (as `a b c d` says). It stops. \"Then it goes on.\" At 3.5 m/s it turns.";
    assert_eq!(sentences(text), [6, 2, 4, 5]);
    let page =
        "# Head\n\nOne two\nthree.\n- four\n- five\n  six\n\n```\ncode here\n```\n| a | seven eight |\n";
    let found: Vec<String> = paragraphs(page).into_iter().map(|(_, text)| text).collect();
    assert_eq!(found, ["One two three.", "four", "five six", "a", "seven eight"]);
}
