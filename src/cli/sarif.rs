//! Diagnostics in SARIF 2.1.0 (OASIS, 2020), the form that code hosts and editors read.
//!
//! One run of one tool; every diagnostic is a result, every code that occurs is a rule. Columns count characters,
//! as SARIF's `unicodeCodePoints` says.

use serde_json::{Value, json};

use avastra_lang::check::explain::page;
use avastra_lang::syntax::{DiagnosticRecord, PlaceRecord, Severity};

/// The whole log.
pub fn log(records: &[DiagnosticRecord]) -> Value {
    let mut codes: Vec<&str> = records.iter().map(|record| record.code).collect();
    codes.sort_unstable();
    codes.dedup();
    let rules: Vec<Value> = codes.iter().map(|code| rule(code)).collect();
    let results: Vec<Value> = records.iter().map(|record| result(record, &codes)).collect();
    json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "avastra",
                "semanticVersion": avastra_campaign::run::VERSION,
                "rules": rules,
            } },
            "columnKind": "unicodeCodePoints",
            "results": results,
        }],
    })
}

fn rule(code: &str) -> Value {
    match page(code) {
        Some(page) => json!({
            "id": code,
            "shortDescription": { "text": page.title() },
            "fullDescription": { "text": page.summary() },
            "help": { "text": page.text, "markdown": page.text },
        }),
        None => json!({ "id": code }),
    }
}

fn result(record: &DiagnosticRecord, codes: &[&str]) -> Value {
    let level = match record.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    };
    let mut text = record.message.clone();
    let more = record.notes.iter().cloned().chain(record.help.iter().map(|help| format!("help: {help}")));
    more.for_each(|line| text = format!("{text}\n{line}"));
    let primary = record.labels.iter().position(|label| label.primary).unwrap_or(0);
    let located = |label: &avastra_lang::syntax::LabelRecord| {
        let mut place = location(&label.place);
        if !label.text.is_empty() {
            place["message"] = json!({ "text": label.text });
        }
        place
    };
    let main = record.labels.get(primary).map(located);
    let others = record.labels.iter().enumerate().filter(|(index, _)| *index != primary);
    let mut result = json!({
        "ruleId": record.code,
        "ruleIndex": codes.iter().position(|code| *code == record.code),
        "level": level,
        "message": { "text": text },
        "locations": main.into_iter().collect::<Vec<_>>(),
    });
    let related: Vec<Value> = others
        .map(|(index, label)| {
            let mut place = located(label);
            place["id"] = json!(index);
            place
        })
        .collect();
    if !related.is_empty() {
        result["relatedLocations"] = json!(related);
    }
    let fixes: Vec<Value> = record
        .fixes
        .iter()
        .map(|fix| {
            let changes = fix.edits.iter().map(|edit| {
                json!({
                    "artifactLocation": { "uri": edit.place.file },
                    "replacements": [{
                        "deletedRegion": region(&edit.place),
                        "insertedContent": { "text": edit.text },
                    }],
                })
            });
            json!({ "description": { "text": fix.title }, "artifactChanges": changes.collect::<Vec<_>>() })
        })
        .collect();
    if !fixes.is_empty() {
        result["fixes"] = json!(fixes);
    }
    result
}

fn location(place: &PlaceRecord) -> Value {
    json!({ "physicalLocation": {
        "artifactLocation": { "uri": place.file },
        "region": region(place),
    } })
}

fn region(place: &PlaceRecord) -> Value {
    json!({
        "startLine": place.line,
        "startColumn": place.column,
        "endLine": place.end_line,
        "endColumn": place.end_column,
    })
}
