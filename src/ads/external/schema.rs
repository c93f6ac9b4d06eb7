//! JSON Schemas (draft 2020-12) of the messages, from their types; and whether numbers keep to their ranges.
//!
//! `schemars` was turned down: it is not among the crates here, and this is all that the messages need.

use serde_json::{Value, json};

/// A type that has a JSON Schema.
pub trait Schema {
    fn schema() -> Value;
}

/// A value that may be out of its range.
pub trait InRange {
    /// What is out of its range, in words; `at` is the path to the value.
    fn out_of_range(&self, at: &str) -> Option<String>;
}

macro_rules! plain {
    ($($type:ty => $schema:expr),* $(,)?) => {
        $(
            impl Schema for $type {
                fn schema() -> Value {
                    $schema
                }
            }

            impl InRange for $type {
                fn out_of_range(&self, _at: &str) -> Option<String> {
                    None
                }
            }
        )*
    };
}

plain! {
    f64 => json!({ "type": "number" }),
    u64 => json!({ "type": "integer", "minimum": 0 }),
    bool => json!({ "type": "boolean" }),
    String => json!({ "type": "string" }),
}

impl<T: Schema> Schema for Vec<T> {
    fn schema() -> Value {
        json!({ "type": "array", "items": T::schema() })
    }
}

impl<T: InRange> InRange for Vec<T> {
    fn out_of_range(&self, at: &str) -> Option<String> {
        self.iter().enumerate().find_map(|(index, item)| item.out_of_range(&format!("{at}[{index}].")))
    }
}

impl<T: Schema, const N: usize> Schema for [T; N] {
    fn schema() -> Value {
        json!({ "type": "array", "items": T::schema(), "minItems": N, "maxItems": N })
    }
}

impl<T: InRange, const N: usize> InRange for [T; N] {
    fn out_of_range(&self, at: &str) -> Option<String> {
        self.iter().find_map(|item| item.out_of_range(at))
    }
}

impl<T: Schema> Schema for Option<T> {
    fn schema() -> Value {
        json!({ "anyOf": [T::schema(), { "type": "null" }] })
    }
}

impl<T: InRange> InRange for Option<T> {
    fn out_of_range(&self, at: &str) -> Option<String> {
        self.as_ref()?.out_of_range(at)
    }
}

/// A field: name, description, schema, range, whether it is required.
pub(super) type FieldSchema = (&'static str, &'static str, Value, Option<(f64, f64)>, bool);

/// The schema of a struct. Unknown fields are allowed: later versions may add some.
pub(super) fn fields_schema(about: &str, fields: &[FieldSchema]) -> Value {
    let mut properties = serde_json::Map::new();
    for (name, about, schema, range, _) in fields {
        let mut schema = schema.clone();
        if !about.is_empty() {
            schema["description"] = about.trim().into();
        }
        if let Some((low, high)) = range {
            schema["minimum"] = json!(low);
            schema["maximum"] = json!(high);
        }
        properties.insert((*name).to_owned(), schema);
    }
    let required: Vec<&str> =
        fields.iter().filter(|(.., is_required)| *is_required).map(|(name, ..)| *name).collect();
    json!({ "type": "object", "description": about.trim(), "properties": properties, "required": required })
}
