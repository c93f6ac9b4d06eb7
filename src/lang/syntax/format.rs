//! The formatter: one style for every file, without options. It never changes what a file says.

use crate::syntax::ast::{File, FileId};
use crate::syntax::print::print_with;
use crate::syntax::scan::{Comment, scan};
use crate::syntax::{Diagnostic, parse};

/// Why a text was not formatted.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The text does not parse.
    #[error("the file has mistakes in its syntax")]
    Syntax(Vec<Diagnostic>),
    /// A bug of the printer, noticed before a file was written.
    #[error("formatting would change what the file says, so it is left as it is; please report this")]
    Meaning,
}

/// The text in the one style. Formatting the result again changes nothing.
///
/// # Errors
/// [`FormatError::Syntax`] with diagnostics for `file`, if the text does not parse.
/// [`FormatError::Meaning`] if the result would read back to another tree or lose a comment.
pub fn format(file: FileId, text: &str) -> Result<String, FormatError> {
    let (tree, found) = parse(file, text);
    if found.iter().any(Diagnostic::is_error) {
        return Err(FormatError::Syntax(found));
    }
    let comments = loose_comments(&tree, text);
    let formatted = print_with(&tree, text, &comments);
    let (again, mistakes) = parse(file, &formatted);
    let kept = comment_texts(&loose_comments(&again, &formatted), &formatted);
    if !mistakes.is_empty() || !same_meaning(&tree, &again) || comment_texts(&comments, text) != kept {
        return Err(FormatError::Meaning);
    }
    Ok(formatted)
}

/// Whether two trees are equal but for their spans.
pub fn same_meaning(one: &File, other: &File) -> bool {
    // Spans are left out when a tree is serialised, and nothing else is.
    // As text, because a tree of JSON values takes many times the memory of the tree that is compared.
    let data = |file: &File| serde_json::to_vec(file).expect("a tree has no maps with odd keys");
    data(one) == data(other)
}

/// The comments that are not documentation in the tree.
fn loose_comments(tree: &File, text: &str) -> Vec<Comment> {
    let item_docs = tree.items.iter().flat_map(|item| &item.docs);
    let mut docs: Vec<usize> = tree.docs.iter().chain(item_docs).map(|doc| doc.span.start).collect();
    docs.sort_unstable();
    let is_doc = |comment: &Comment| docs.binary_search(&comment.start).is_ok();
    scan(FileId::default(), text).comments.into_iter().filter(|comment| !is_doc(comment)).collect()
}

fn comment_texts<'a>(comments: &[Comment], text: &'a str) -> Vec<&'a str> {
    // The marks may change: a comment at the end of a line is no documentation on a line of its own.
    let said = |comment: &Comment| text[comment.start..comment.end].trim_start_matches(['/', '!']);
    let mut texts: Vec<&str> = comments.iter().map(said).collect();
    texts.sort_unstable();
    texts
}
