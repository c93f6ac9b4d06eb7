//! `avastra editor-files`: what colours a text and follows from the language. For VS Code it is a TextMate grammar, and the
//! rules for brackets and comments; for Vim a syntax file; for the book a language of highlight.js.
//!
//! A test compares what is shipped with what would be written.

use serde_json::{Value, json};

use avastra_base::outside::Shown;
use avastra_base::units;
use avastra_editor::words::{self, Entry};
use avastra_lang::model::vocabulary::{Fact, Site, StopReason, Word, WordFact};
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

/// The files: name in the repository, and text.
fn texts() -> [(&'static str, String); 4] {
    let text = |value: &Value| {
        let text = serde_json::to_string_pretty(value).expect("it is JSON already");
        format!("{text}\n")
    };
    [
        ("editors/vscode/syntaxes/avastra.tmLanguage.json", text(&grammar())),
        ("editors/vscode/language-configuration.json", text(&behaviour())),
        ("editors/vim/syntax/avastra.vim", vim()),
        ("docs/ava.js", highlight()),
    ]
}

/// The words of the engine that a file may use, sorted.
fn engine_words() -> Vec<&'static str> {
    let engine = ["does", "lane", "side", "then", "colour", "ignores", "body"].map(words::engine_words);
    let mut engine: Vec<&str> = engine.iter().flatten().map(|(word, _)| *word).collect();
    engine.sort_unstable();
    engine.dedup();
    engine
}

/// The facts, and what an episode stops for.
fn facts() -> Vec<&'static str> {
    let sites = [Site::Requirement, Site::Rule, Site::Verdict].map(words::facts);
    let mut facts = names(&[sites.concat(), words::of::<StopReason>()].concat());
    facts.sort_unstable();
    facts.dedup();
    facts
}

/// The facts with those of things, such as `ego.speed`, for editors whose words may have dots.
fn all_facts() -> Vec<&'static str> {
    let dotted = Fact::names().chain(WordFact::names()).filter(|name| name.contains('.'));
    let mut all: Vec<&str> = facts().into_iter().chain(dotted).collect();
    all.sort_unstable();
    // A word that is a keyword, too, has its colour.
    all.retain(|name| !keyword::keywords().any(|(word, _)| word == name));
    all
}

/// The syntax file of Vim and Neovim.
fn vim() -> String {
    let mut text = "\" The syntax of avastra's files, written by `avastra editor-files`.\n\
         if exists(\"b:current_syntax\")\n  finish\nendif\n\
         syntax iskeyword @,48-57,_,.\n"
        .to_owned();
    for (group, words) in [
        ("avaDeclaration", names(keyword::DECLARATIONS)),
        ("avaClause", names(keyword::CLAUSES)),
        ("avaOperator", names(keyword::OPERATORS)),
        ("avaLiteral", names(keyword::LITERALS)),
        ("avaType", names(&words::types())),
        ("avaWord", engine_words()),
        ("avaFact", all_facts()),
    ] {
        text += &format!("syntax keyword {group} {}\n", words.join(" "));
    }
    text += concat!(
        "syntax match avaNumber /\\<\\d\\+\\(\\.\\d\\+\\)\\?\\([eE][+-]\\?\\d\\+\\)\\?/\n",
        "syntax region avaString start=/\"/ skip=/\\\\./ end=/\"/ oneline\n",
        "syntax match avaComment /\\/\\/.*$/\n",
        "syntax match avaDoc /\\/\\/[\\/!].*$/\n",
    );
    for (group, of) in [
        ("avaDeclaration", "Keyword"),
        ("avaClause", "Statement"),
        ("avaOperator", "Operator"),
        ("avaLiteral", "Boolean"),
        ("avaType", "Type"),
        ("avaWord", "Constant"),
        ("avaFact", "Identifier"),
        ("avaNumber", "Number"),
        ("avaString", "String"),
        ("avaComment", "Comment"),
        ("avaDoc", "SpecialComment"),
    ] {
        text += &format!("highlight default link {group} {of}\n");
    }
    text + "let b:current_syntax = \"avastra\"\n"
}

/// The language of highlight.js, which mdBook uses. A page is coloured before this is loaded, so its blocks are coloured again.
fn highlight() -> String {
    let keyword = [names(keyword::DECLARATIONS), names(keyword::CLAUSES), names(keyword::OPERATORS)].concat();
    let built_in = [engine_words(), all_facts()].concat();
    let keywords = json!({
        "$pattern": r"[A-Za-z_][A-Za-z0-9_.]*",
        "keyword": keyword.join(" "),
        "literal": names(keyword::LITERALS).join(" "),
        "type": names(&words::types()).join(" "),
        "built_in": built_in.join(" "),
    });
    format!(
        "// The colours of avastra's files, written by `avastra editor-files`.\n\
         hljs.registerLanguage(\"ava\", (hljs) => ({{\n  keywords: {keywords},\n  \
         contains: [hljs.C_LINE_COMMENT_MODE, hljs.QUOTE_STRING_MODE, hljs.C_NUMBER_MODE],\n}}));\n\
         document.querySelectorAll(\"code.language-ava\").forEach((block) => {{\n  \
         block.textContent = block.textContent;\n  hljs.highlightBlock(block);\n}});\n"
    )
}

/// The grammar by which editors colour a text without a server.
fn grammar() -> Value {
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
            rule("support.constant", one_of(engine_words())),
            rule("support.variable", one_of(facts())),
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
