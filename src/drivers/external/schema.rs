//! JSON Schemas (draft 2020-12) of the messages, from their types; and whether numbers keep to their ranges.
//!
//! `schemars` was turned down: it is not among the crates here, and this is all that the messages need.

use serde_json::{Value, json};

use super::finding::Problem;
use super::link::Broken;

/// Integers are at most this, 2^53 - 1: every language reads them exactly.
const INTEGER_MAX: u64 = (1 << 53) - 1;

/// A type that has a JSON Schema, and whose values may be out of range or too long.
pub trait Schema {
    fn schema() -> Value;

    /// The first part that is out of its range or too long; `at` is the path to the value.
    fn out_of_range(&self, _at: &str) -> Option<Broken> {
        None
    }
}

/// A text or a list.
pub trait Long {
    /// The number of characters or items, and which of the two they are.
    fn length(&self) -> (usize, &'static str);
}

impl Long for String {
    fn length(&self) -> (usize, &'static str) {
        (self.chars().count(), "characters")
    }
}

impl<T> Long for Vec<T> {
    fn length(&self) -> (usize, &'static str) {
        (self.len(), "items")
    }
}

/// Bounds of a field.
#[derive(Debug, Clone, Copy)]
pub enum Bounds {
    Value(f64, f64),
    Length(usize, usize),
}

/// The path to a field of the value at `at`; an empty path is the message itself.
pub fn inside(at: &str, field: &str) -> String {
    if at.is_empty() { field.to_owned() } else { format!("{at}.{field}") }
}

/// The finding about a number that is beyond its range; `None` if it is within.
pub fn value_beyond(found: f64, at: &str, low: f64, high: f64) -> Option<Broken> {
    let detail = || format!("`{at}` is {found}; it must be from {low} to {high}");
    (!(low..=high).contains(&found)).then(|| Broken { problem: Problem::OutOfRange, detail: detail() })
}

/// The finding about a text or a list that is too short or too long; `None` if it is neither.
pub fn length_beyond(value: &impl Long, at: &str, least: usize, most: usize) -> Option<Broken> {
    let (found, what) = value.length();
    let detail = || format!("`{at}` has {found} {what}; it must have from {least} to {most}");
    (!(least..=most).contains(&found)).then(|| Broken { problem: Problem::WrongShape, detail: detail() })
}

impl Schema for f64 {
    fn schema() -> Value {
        json!({ "type": "number" })
    }
}

impl Schema for bool {
    fn schema() -> Value {
        json!({ "type": "boolean" })
    }
}

impl Schema for String {
    fn schema() -> Value {
        json!({ "type": "string" })
    }
}

impl Schema for u64 {
    fn schema() -> Value {
        json!({ "type": "integer", "minimum": 0, "maximum": INTEGER_MAX })
    }

    fn out_of_range(&self, at: &str) -> Option<Broken> {
        let detail = || format!("`{at}` is {self}; integers are at most {INTEGER_MAX}");
        (*self > INTEGER_MAX).then(|| Broken { problem: Problem::OutOfRange, detail: detail() })
    }
}

impl<T: Schema> Schema for Vec<T> {
    fn schema() -> Value {
        json!({ "type": "array", "items": T::schema() })
    }

    fn out_of_range(&self, at: &str) -> Option<Broken> {
        self.iter().enumerate().find_map(|(index, item)| item.out_of_range(&format!("{at}[{index}]")))
    }
}

impl<T: Schema, const N: usize> Schema for [T; N] {
    fn schema() -> Value {
        json!({ "type": "array", "items": T::schema(), "minItems": N, "maxItems": N })
    }

    fn out_of_range(&self, at: &str) -> Option<Broken> {
        self.iter().find_map(|item| item.out_of_range(at))
    }
}

impl<T: Schema> Schema for Option<T> {
    fn schema() -> Value {
        json!({ "anyOf": [T::schema(), { "type": "null" }] })
    }

    fn out_of_range(&self, at: &str) -> Option<Broken> {
        self.as_ref()?.out_of_range(at)
    }
}

/// A field: name, description, schema, bounds, whether it is required.
pub(super) type FieldSchema = (&'static str, &'static str, Value, Option<Bounds>, bool);

/// The schema of a struct. Unknown fields are allowed: later versions may add some.
pub(super) fn fields_schema(about: &str, fields: &[FieldSchema]) -> Value {
    let mut properties = serde_json::Map::new();
    for (name, about, schema, bounds, _) in fields {
        let mut schema = schema.clone();
        if !about.is_empty() {
            schema["description"] = about.trim().into();
        }
        match bounds {
            None => {}
            Some(Bounds::Value(low, high)) => {
                schema["minimum"] = json!(low);
                schema["maximum"] = json!(high);
            }
            Some(Bounds::Length(least, most)) => {
                let what = if schema["type"] == "string" { "Length" } else { "Items" };
                schema[format!("min{what}")] = json!(least);
                schema[format!("max{what}")] = json!(most);
            }
        }
        properties.insert((*name).to_owned(), schema);
    }
    let required: Vec<&str> =
        fields.iter().filter(|(.., is_required)| *is_required).map(|(name, ..)| *name).collect();
    json!({ "type": "object", "description": about.trim(), "properties": properties, "required": required })
}
