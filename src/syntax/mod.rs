//! Text to tree and back: the grammar, `parse`, `format`, and diagnostics.
//!
//! Nothing here knows what a name means, and nothing outside knows what the grammar looks like.

pub mod ast;
mod build;
pub mod code;
mod diagnostic;
mod expression;
mod format;
mod grammar;
mod layout;
mod parse;
mod print;
mod print_expression;
mod record;
mod scan;

pub use diagnostic::Diagnostic;
pub use diagnostic::Edit;
pub use diagnostic::Fix;
pub use diagnostic::Label;
pub use diagnostic::Severity;
pub use diagnostic::Sources;
pub use diagnostic::Style;
pub use diagnostic::listed;
pub use diagnostic::nearest;
pub use diagnostic::render;
pub use format::FormatError;
pub use format::format;
pub use format::same_meaning;
pub use parse::DEPTH_MAX;
pub use parse::LANGUAGE;
pub use parse::parse;
pub use print::print;
pub use print::print_expr;
pub use print::print_item;
pub use record::DiagnosticRecord;
pub use record::EditRecord;
pub use record::FixRecord;
pub use record::LabelRecord;
pub use record::PlaceRecord;
pub use record::SCHEMA;
pub use record::apply_fixes;
pub use record::record;

#[cfg(test)]
mod tests;
