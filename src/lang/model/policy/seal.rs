//! The seal of a policy file: a digest over every byte of it, so that a flipped one anywhere is noticed.
//!
//! The digest itself and the paths of the files that it uses are left out, so that a policy can move to
//! another directory. A file at the end of a path has its own digest.

use sha2::{Digest, Sha256};

use crate::model::digest_text;
use crate::syntax::ast;
use crate::syntax::ast::{ItemKind, Span};

/// The seal that a policy file ought to have. `tree` is what was read from `text`.
pub fn seal(text: &str, tree: &ast::File) -> String {
    let mut open: Vec<Span> = tree
        .items
        .iter()
        .filter_map(|item| match &item.kind {
            ItemKind::Use(used) => Some(used.path.span),
            ItemKind::Policy(policy) => {
                let digest = policy.net.iter().find(|field| field.name.text == "digest");
                digest.map(|field| field.value.span)
            }
            _ => None,
        })
        .collect();
    open.sort_by_key(|span| span.start);
    let (mut hash, mut from) = (Sha256::new(), 0);
    for span in open {
        hash.update(&text.as_bytes()[from..span.start]);
        // A mark in place of the part that is left out, so that the part cannot move unnoticed.
        hash.update([0]);
        from = span.end;
    }
    hash.update(&text.as_bytes()[from..]);
    digest_text(&hash.finalize().into())
}
