//! `avastra editor-files`: the parts of the VS Code extension (`editors/vscode`) that follow from the language. They are
//! a TextMate grammar with its words, and the rules for its brackets and comments.
//!
//! A test compares what is shipped with what would be written.

use serde_json::{Value, json};

use avastra_base::outside::Shown;
use avastra_base::units;
use avastra_editor::words::{self, Entry};
use avastra_lang::model::vocabulary::{Site, StopReason};
use avastra_lang::syntax::keyword;

use super::arguments::EditorFilesArguments;
use super::error::Failure;
use super::files::{make_way, write};
use super::output::Output;

/// Writes the files, in place of older ones.
pub fn editor_files(output: &Output, arguments: &EditorFilesArguments) -> Result<(), Failure> {
    let mut paths = Vec::new();
    for (name, text) in texts() {
        let path = arguments.directory.join(name);
        make_way(&arguments.directory, &path)?;
        write(&path, &text)?;
        output.tell(&path.shown().to_string());
        paths.push(path);
    }
    output.result(json!({ "files": paths }));
    Ok(())
}

/// The files: name in the folder of the extension, and text.
fn texts() -> [(&'static str, String); 2] {
    let text = |value: &Value| {
        let text = serde_json::to_string_pretty(value).expect("it is JSON already");
        format!("{text}\n")
    };
    [
        ("syntaxes/avastra.tmLanguage.json", text(&grammar())),
        ("language-configuration.json", text(&behaviour())),
    ]
}

/// The grammar by which editors colour a text without a server.
fn grammar() -> Value {
    let engine = ["does", "lane", "side", "then", "colour", "ignores", "body"].map(words::engine_words);
    let mut engine: Vec<&str> = engine.iter().flatten().map(|(word, _)| *word).collect();
    engine.sort_unstable();
    engine.dedup();
    let facts = [
        words::facts(Site::Requirement),
        words::facts(Site::Rule),
        words::facts(Site::Verdict),
        words::of::<StopReason>(),
    ]
    .concat();
    // No name follows these keywords.
    let nameless = ["language", "use", "optional", "episode", "reward", "expect", "override"];
    let mut naming = names(keyword::DECLARATIONS);
    naming.retain(|word| !nameless.contains(word));
    let rule = |name: &str, pattern: String| json!({ "name": format!("{name}.avastra"), "match": pattern });
    json!({
        "$schema": "https://raw.githubusercontent.com/martinring/tmlanguage/master/tmlanguage.json",
        "name": "avastra",
        "scopeName": "source.avastra",
        "fileTypes": ["ava"],
        "patterns": [
            rule("comment.line.documentation", "//[/!].*$".to_owned()),
            rule("comment.line.double-slash", "//.*$".to_owned()),
            {
                "name": "string.quoted.double.avastra",
                "begin": "\"",
                "end": "\"|$",
                "patterns": [rule("constant.character.escape", r#"\\([\\"nt]|u\{[0-9a-fA-F]+\})"#.to_owned())],
            },
            {
                "match": format!("{}\\s+([A-Za-z_][A-Za-z0-9_]*)", one_of(naming)),
                "captures": {
                    "1": { "name": "keyword.declaration.avastra" },
                    "2": { "name": "entity.name.avastra" },
                },
            },
            // A field may have the name of a keyword.
            rule("variable.other.member", r"\b[A-Za-z_][A-Za-z0-9_]*(?=\s*:)".to_owned()),
            rule("keyword.declaration", one_of(names(keyword::DECLARATIONS))),
            rule("keyword.operator.word", one_of(names(keyword::OPERATORS))),
            rule("constant.language", one_of(names(keyword::LITERALS))),
            rule("keyword.control", one_of(names(keyword::CLAUSES))),
            rule("support.type", one_of(names(&words::types()))),
            rule("support.constant", one_of(engine)),
            rule("support.variable", one_of(names(&facts))),
            {
                "match": format!(r"\b([0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?)(?:[ \t]*({}))?", units_pattern()),
                "captures": {
                    "1": { "name": "constant.numeric.avastra" },
                    "2": { "name": "keyword.other.unit.avastra" },
                },
            },
            rule("keyword.operator", r"=>|->|\.\.|==|!=|<=|>=|[=<>+\-*/|]".to_owned()),
            rule("entity.name.function", r"\b[a-z_][A-Za-z0-9_]*(?=\s*\()".to_owned()),
            rule("variable.other.enummember", r"\b[A-Z][A-Za-z0-9_]*\b".to_owned()),
        ],
    })
}

fn names(entries: &[Entry]) -> Vec<&'static str> {
    entries.iter().map(|(word, _)| *word).collect()
}

fn one_of(mut words: Vec<&str>) -> String {
    words.sort_unstable();
    words.dedup();
    format!(r"\b({})\b", words.join("|"))
}

/// The units, longer ones first: `m/s^2` must not match as `m`.
fn units_pattern() -> String {
    let mut words: Vec<&str> = units::UNITS.iter().map(|unit| unit.word).collect();
    words.sort_by_key(|word| (std::cmp::Reverse(word.len()), *word));
    let escaped: Vec<String> = words
        .iter()
        .map(|word| match *word {
            "%" => "%".to_owned(),
            word => format!(r"{}(?![A-Za-z0-9_])", word.replace('^', r"\^")),
        })
        .collect();
    escaped.join("|")
}

fn behaviour() -> Value {
    let pairs = [["{", "}"], ["[", "]"], ["(", ")"]];
    let closing: Vec<Value> =
        pairs.iter().map(|[open, close]| json!({ "open": open, "close": close })).collect();
    let mut auto = closing.clone();
    auto.push(json!({ "open": "\"", "close": "\"", "notIn": ["string", "comment"] }));
    json!({
        "comments": { "lineComment": "//" },
        "brackets": pairs,
        "autoClosingPairs": auto,
        "surroundingPairs": [["{", "}"], ["[", "]"], ["(", ")"], ["\"", "\""]],
        "indentationRules": {
            "increaseIndentPattern": r"[{(\[]\s*(//.*)?$",
            "decreaseIndentPattern": r"^\s*[})\]]",
        },
        "onEnterRules": [
            { "beforeText": r"^\s*///", "action": { "indent": "none", "appendText": "/// " } },
            { "beforeText": r"^\s*//!", "action": { "indent": "none", "appendText": "//! " } },
        ],
    })
}
