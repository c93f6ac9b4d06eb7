//! Proofs about a space for every draw: which rows are dead, which rules are idle, which spawns are unfair.
//!
//! A proof works on exact intervals (`enclose`, `reach`), so it may say too little, never too much. It goes
//! over the demands and bounds of `model::rules`. A witness is found by search and judged as drawing judges.
//!
//! Three proofs follow states, and each needs a walk of its own. `clock` follows one cell on all roads and at any time, and
//! asks what the moves of its rule allow. `time` follows sets of values, rather too many than too few: it must not pass a
//! rule that time breaks. `realise` follows single memories that an episode certainly reaches, rather too few than too
//! many: a row that it says runs must run. With `time`'s states, `realise` would call impossible rows possible. With
//! `realise`'s, `time` would miss states.

mod cells;
mod clock;
mod cut;
mod enclose;
mod implied;
mod kept;
mod lists;
mod moment;
mod never_drawn;
mod reach;
mod realise;
mod reduce;
mod spawn_bounds;
mod start;
mod sums;
mod time;
mod twins;
mod undecided;
mod unfair;
mod witness;

pub(crate) use clock::{forbids, next_rows, shortest_way};
pub use cut::{Removal, removals};
pub(crate) use enclose::{Known, VARIANTS_MAX, enclose};
pub use kept::is_never_asked;
pub(crate) use reach::{product_size, rows};
pub(crate) use realise::mark_dead;
pub use realise::{Realisable, Realised, RunsIn, realise};
pub(crate) use spawn_bounds::odds_out_of_bounds;
pub use time::{BrokenByTime, lasts};
pub use witness::{Witness, witness};

use crate::model::{Space, effort};
use crate::syntax::Diagnostic;

/// Errors, warnings and remarks about a space whose names and types are right.
pub(crate) fn report(space: &Space, realisable: &Realisable) -> Vec<Diagnostic> {
    let proofs: [&dyn Fn() -> Vec<Diagnostic>; 13] = [
        &|| reach::report(space),
        &|| start::report(space),
        &|| time::report(space),
        &|| spawn_bounds::report(space),
        &|| twins::report(space),
        &|| undecided::report(space, realisable),
        &|| cut::report(space),
        &|| never_drawn::report(space),
        &|| implied::report(space),
        &|| unfair::report(space),
        &|| moment::report(space),
        &|| clock::report(space),
        &|| kept::report(space),
    ];
    // Once the steps are spent, the checker drops all findings.
    proofs.into_iter().take_while(|_| !effort::is_spent()).flat_map(|report| report()).collect()
}
