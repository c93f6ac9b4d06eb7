//! The parser of `--state`: the states of a space for `avastra table --row`, the variables of a policy for
//! `avastra policy explain`. Mistakes come back as one sentence, because a command line has no place to point at.

use std::collections::BTreeSet;

use crate::check::mistakes::Report;
use crate::check::names::unknown;
use crate::check::policy::value_of;
use crate::check::scenario::Reader;
use crate::model::{Memory, NoStart, Road, RulesInForce, Space};
use crate::syntax::ast::Field;
use crate::syntax::{Diagnostic, parse_fields};

/// How `--state` is written.
const EXAMPLE: &str = "time: Night, sky: { Rain: High }";

/// The memory that a text describes as the `start` of a scenario does, for example
/// `time: Night, sky: { Rain: High }`. A state that the text leaves out has its initial value; the seed draws
/// the states that begin as `any`. Rules do not count: see [`legal_memory_from`].
///
/// # Errors
/// The first mistake, in words.
pub fn memory_from(space: &Space, text: &str, seed: u64) -> Result<Memory, String> {
    let fields = fields_of(text, "states", EXAMPLE)?;
    let mut reader = Reader { space, diagnostics: Vec::new() };
    let mut memory = space.initial_memory(seed);
    for field in &fields {
        match space.state(&field.name.text) {
            Some(state) => reader.start_state(state, &field.value, &mut memory),
            None => {
                let states = space.states.iter().map(|state| state.name.as_str());
                reader.report(unknown("state", &field.name.text, field.name.span, states));
            }
        }
    }
    reader.diagnostics.into_iter().next().map_or(Ok(memory), |mistake| Err(in_words(mistake)))
}

/// As [`memory_from`], with states that obey the rules: what the text leaves out is drawn from what they leave.
///
/// # Errors
/// The first mistake, in words; also a state that breaks a rule which holds from the start on.
pub fn legal_memory_from(
    space: &Space,
    text: &str,
    road: &Road,
    rules: &RulesInForce,
    seed: u64,
) -> Result<Memory, String> {
    let begun = memory_from(space, text, seed)?;
    let fields = fields_of(text, "states", EXAMPLE)?;
    let mut open = space.open_cells();
    for state in &space.states {
        if fields.iter().any(|field| field.name.text == state.name) {
            open.retain(|cell| !(state.first_cell..state.first_cell + state.cells).contains(cell));
        }
    }
    let drawn = space.memory_from_start(begun, &open, road, rules, seed);
    drawn.map_err(|no_start| {
        let NoStart { rule, road, .. } = no_start;
        format!("`{text}` breaks rule `{rule}` on `{road}`, which holds in every moment; switch it off by `--without {rule}`")
    })
}

/// The index of each variable that a text names, and the value that an observation holds for it, for example
/// `ego_speed: 12 m/s, time: Night`. A number may stand without its unit.
///
/// # Errors
/// The first mistake, in words.
pub fn values_from(text: &str) -> Result<Vec<(usize, f32)>, String> {
    let fields = fields_of(text, "a state", "ego_speed: 12 m/s, time: Night")?;
    fields.iter().map(|field| value_of(&field.name, &field.value).map_err(in_words)).collect()
}

/// The fields of a text, each given once.
fn fields_of(text: &str, what: &str, example: &str) -> Result<Vec<Field>, String> {
    let fields =
        parse_fields(text).ok_or_else(|| format!("cannot read `{text}` as {what}: write `{example}`"))?;
    let mut names = BTreeSet::new();
    match fields.iter().find(|field| !names.insert(&field.name.text)) {
        Some(again) => Err(format!("`{}` is given twice", again.name.text)),
        None => Ok(fields),
    }
}

/// The message of a mistake, and what to do about it.
fn in_words(mistake: Diagnostic) -> String {
    match mistake.help {
        Some(help) => format!("{}; {help}", mistake.message),
        None => mistake.message,
    }
}
