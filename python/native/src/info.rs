//! What is said of a moment and of its collisions, as dicts.

use avastra::action::ActionTable;
use avastra::model::digest_text;
use avastra::model::vocabulary::Word as _;
use avastra::oracle;
use avastra::run::Finding;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::chosen::{breaches, carried_out, margins, measures};
use crate::episodes::{Ended, Seen};

/// What is said of a moment beside observation, reward and mask.
pub fn info<'py>(py: Python<'py>, table: &ActionTable, seen: &Seen) -> PyResult<Bound<'py, PyDict>> {
    let info = PyDict::new(py);
    info.set_item("seed", seen.seed)?;
    if let Some(step) = &seen.step {
        info.set_item("time_s", step.time_s)?;
        info.set_item("proc", step.proc)?;
        info.update(carried_out(py, table, &step.log)?.as_mapping())?;
        info.set_item("measures", measures(py, &step.measures)?)?;
        info.set_item("collisions", step.collisions)?;
        if let Some(counted) = step.counted {
            info.set_item("counted", counted)?;
        }
    }
    if let Some(ended) = &seen.ended {
        info.set_item("ended", ended_dict(py, table, ended)?)?;
    }
    Ok(info)
}

/// What is said of an episode that has ended.
pub fn ended_dict<'py>(
    py: Python<'py>,
    table: &ActionTable,
    Ended { log, findings: found, measures: least }: &Ended,
) -> PyResult<Bound<'py, PyDict>> {
    let end = PyDict::new(py);
    end.set_item("end", log.end.name())?;
    end.set_item("duration_s", log.duration_s)?;
    end.set_item("distance_m", log.distance_m)?;
    end.set_item("red_runs", log.red_runs)?;
    end.set_item("trace", digest_text(&log.trace()))?;
    end.set_item("counted", found.iter().filter(|finding| finding.counted).count())?;
    end.set_item("findings", findings(py, found)?)?;
    end.set_item("breaches", breaches(py, table.space(), log)?)?;
    end.set_item("margins", margins(py, table.space(), log)?)?;
    end.set_item("measures", measures(py, least)?)?;
    let steps = log.steps.iter().map(|step| carried_out(py, table, step));
    end.set_item("steps", steps.collect::<PyResult<Vec<_>>>()?)?;
    Ok(end)
}

/// Judged collisions as dicts, with the names of `run.db`'s columns.
pub fn findings<'py>(py: Python<'py>, found: &[Finding]) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for Finding { collision, facts, judgement, counted, own_body, .. } in found {
        let severity = oracle::severity(collision);
        let one = PyDict::new(py);
        one.set_item("step", collision.step)?;
        one.set_item("time_s", collision.contact.time_s)?;
        one.set_item("counted", counted)?;
        one.set_item("avoidability", judgement.class.name())?;
        one.set_item("priority", facts.priority.name())?;
        one.set_item("body", collision.body.like.name())?;
        one.set_item("own_body", own_body)?;
        one.set_item("verb", collision.verb.name())?;
        one.set_item("side", severity.side)?;
        one.set_item("approach", severity.approach)?;
        one.set_item("ego_speed_mps", collision.contact.ego_speed_mps)?;
        one.set_item("closing_speed_mps", collision.contact.closing_speed_mps)?;
        one.set_item("delta_v_mps", severity.delta_v_mps)?;
        list.append(one)?;
    }
    Ok(list)
}
