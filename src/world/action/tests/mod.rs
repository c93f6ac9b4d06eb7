//! The shipped spaces as tables, and draws against what proofs say of them. Each rule's refusals are tested in
//! `tests/it/rules.rs`.

mod promise;
mod rules;
mod witnesses;

use std::path::Path;
use std::sync::Arc;

use crate::action::{ActionTable, SpawnFacts, SpawnRequest, Surroundings};
use avastra_lang::check::{ReadError, load};
use avastra_lang::model::{MomentFacts, Value};
use avastra_lang::syntax::{Style, render};

/// The table of a shipped space on Road 2.
fn table(path: &str) -> ActionTable {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    let loaded =
        load(&root, &|path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string())))
            .unwrap();
    let shown: Vec<String> =
        loaded.diagnostics.iter().map(|found| render(found, &loaded.sources, Style::Plain)).collect();
    assert!(shown.is_empty(), "{}", shown.join("\n"));
    ActionTable::new(loaded.space.unwrap())
}

/// A world, so many seconds after the start, in which everything fits, no gap is too small, and the gap is the distance
/// asked for.
struct Plain(f64);

/// How fast the ego vehicle is there, m/s.
const EGO_SPEED_MPS: f64 = 10.0;

impl Surroundings for Plain {
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String> {
        Ok(SpawnFacts { spawn_gap_m: request.distance_m, ..SpawnFacts::default() })
    }

    fn moment(&self) -> MomentFacts {
        MomentFacts { ego_speed_mps: EGO_SPEED_MPS, elapsed_s: self.0, ..MomentFacts::default() }
    }
}

fn value_of(values: &[(Arc<str>, Value)], name: &str) -> Option<Value> {
    values.iter().find(|(known, _)| &**known == name).map(|(_, value)| *value)
}
