//! Text to tree and back: the grammar, `parse`, `format`, and diagnostics.
//!
//! Nothing here knows what a name means, and nothing outside knows what the grammar looks like.
//!
//! ```
//! use avastra_lang::syntax::ast::FileId;
//! use avastra_lang::syntax::format;
//!
//! let text = format(FileId::default(), "language 1\nlet far=40m // enough\n").expect("it has no mistakes");
//! assert!(text.ends_with("let far = 40 m // enough\n"));
//! ```

pub mod ast;
mod build;
pub mod code;
mod diagnostic;
mod expression;
mod foreign;
mod format;
mod grammar;
pub mod keyword;
mod layout;
mod nearest;
mod operator;
mod parse;
mod print;
mod print_expression;
mod record;
mod scan;
mod unfinished;
mod yaml;

pub use diagnostic::{Diagnostic, Fix, Label, Severity, Sources, Style, listed, render};
pub(crate) use diagnostic::{enumerated, one_of};
pub use format::{FormatError, format, same_meaning};
pub use nearest::nearest;
pub use parse::{DEPTH_MAX, LANGUAGE, OPERATORS_MAX, TOKENS_MAX, parse, parse_fields};
pub use print::{print, print_expr, print_item};
pub use record::{
    DiagnosticRecord, EditRecord, FixRecord, LabelRecord, PlaceRecord, SCHEMA, apply_fixes, record,
};
pub use unfinished::{HERE, Unfinished, declaration_start, unfinished};
pub use yaml::{read_yaml, settings_mistake};

#[cfg(test)]
mod tests;
