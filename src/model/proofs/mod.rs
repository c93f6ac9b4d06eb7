//! What can be proved of a sound space beyond which rows are dead, and what only a search can show.
//!
//! A proof goes over exact intervals (`reach`, `enclose`), so it may say too little, never too much.
//! A witness is found by search and judged by the evaluator that drawing uses.

mod clock;
mod cut;
mod implied;
mod reduce;
mod twins;
mod undecided;
mod unfair;
mod witness;

pub(crate) use clock::{forbids, next_rows, shortest_way};
pub use cut::{Removal, removals};
pub use witness::{Witness, witness};

use crate::model::space::Space;
use crate::syntax::Diagnostic;

/// Warnings and remarks about a sound space.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = twins::report(space);
    diagnostics.extend(undecided::report(space));
    diagnostics.extend(cut::report(space));
    diagnostics.extend(implied::report(space));
    diagnostics.extend(unfair::report(space));
    diagnostics.extend(clock::report(space));
    diagnostics
}
