//! What commands say of a driving system of one's own that failed, or that need not repeat itself.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::ads::external::{FailureKind, Program};
use crate::run::FailureCount;

use super::output::plural;
use super::run::cut_short;

/// Why the same command need not lead to the same run, if an external driving system gives a reason.
pub fn doubts(program: Option<&Arc<Program>>) -> Vec<String> {
    let Some(program) = program else { return Vec::new() };
    let attached = program.attached();
    let loose = (!attached.is_deterministic()).then(|| {
        format!(
            "{} says that it is not deterministic: the same seed need not lead to the same episodes again; scenarios \
             replay from the recorded answers",
            attached.name()
        )
    });
    let missed = (program.missed() > 0).then(|| {
        let waited_s = program.missed() as f64 * program.settings().timeouts.step_s;
        format!(
            "{} were not answered in time ({waited_s:.0} s of waiting), and the answers before held on: what was driven \
             then depends on this machine",
            plural(program.missed() as usize, "step")
        )
    });
    loose.into_iter().chain(missed).collect()
}

/// Findings about an external driving system, by what is wrong and when; `place` says where they happened or stand.
pub fn failures_text(failures: &[FailureCount], place: &str) -> String {
    let line = |failure: &FailureCount| {
        let FailureCount { kind, problem, times, detail, scenario, .. } = failure;
        format!("{times} × {kind} ({problem}): {detail}; for example {scenario}")
    };
    let all: i64 = failures.iter().map(|failure| failure.times).sum();
    let head = format!("\nthe driving system failed {}{place}:", plural(all as usize, "time"));
    cut_short(head, failures, line, |more| format!("and {more} others"))
}

/// Numbers of failures by kind: `2 × ads_crash`.
pub fn kinds_text<N: core::fmt::Display>(kinds: &BTreeMap<FailureKind, N>) -> String {
    let kinds = kinds.iter().map(|(kind, times)| format!("{times} × {}", kind.name()));
    kinds.collect::<Vec<_>>().join(", ")
}
