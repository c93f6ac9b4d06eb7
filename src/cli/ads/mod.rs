//! `avastra ads`: for those who attach a driving system of their own.

mod check;
mod drive;
mod toy;

use avastra_drivers::external::schemas;

use super::arguments::{AdsArguments, AdsCommand};
use super::error::Failure;
use super::output::Output;

/// Checks a driving system, prints the schemas, or is a toy.
pub fn ads(output: &Output, arguments: &AdsArguments) -> Result<(), Failure> {
    match &arguments.command {
        AdsCommand::Check(arguments) => check::check(output, arguments),
        AdsCommand::Schema => {
            schema(output);
            Ok(())
        }
        AdsCommand::Toy(arguments) => toy::toy(arguments),
    }
}

/// All schemas as one JSON document.
fn schema(output: &Output) {
    let mut messages = serde_json::Map::new();
    for (direction, word, mut schema) in schemas() {
        schema["$comment"] = direction.into();
        messages.insert(word.to_owned(), schema);
    }
    let alternatives: Vec<serde_json::Value> =
        messages.keys().map(|word| serde_json::json!({ "$ref": format!("#/$defs/{word}") })).collect();
    let document = serde_json::json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": avastra_drivers::external::PROTOCOL,
        "description": "A line of avastra-ads/1 is one of these; the page of the protocol says which, when and what it means.",
        "oneOf": alternatives, "$defs": messages,
    });
    output.document(&serde_json::to_string_pretty(&document).expect("schemas are plain data"));
    output.result(serde_json::json!({ "protocol": document }));
}
