//! Many episodes, stepped at once.

use std::ptr;
use std::sync::{Mutex, MutexGuard, PoisonError};

use avastra::run::Stepped;
use numpy::{PyArray1, PyArray2, PyArrayMethods as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::episodes::{Array, EpisodeError, Episodes, Seen, can_advance};
use crate::info::info;

/// Steps several episodes at once, on threads of Rust without Python's lock; one whose `seeds` has a number begins anew
/// instead. If one of them cannot be stepped so, none is.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "the tuple that Python gets")]
pub fn step_all<'py>(
    py: Python<'py>,
    worlds: Vec<Py<Episodes>>,
    rows: Vec<Option<i64>>,
    seeds: Vec<Option<u64>>,
    threads: usize,
) -> PyResult<(
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<bool>>,
    Array<'py, f64>,
    Vec<Option<&'static str>>,
    Vec<Bound<'py, PyDict>>,
)> {
    if rows.len() != worlds.len() || seeds.len() != worlds.len() {
        return Err(PyValueError::new_err("`rows` and `seeds` have one value for each of the episodes"));
    }
    let worlds: Vec<&Episodes> = worlds.iter().map(Py::get).collect();
    let row = |(index, world): (usize, &&Episodes)| match seeds[index] {
        Some(_) => Ok(None),
        None => world.row(rows[index]).map_err(|reason| format!("world {index}: {reason}")),
    };
    let rows = worlds.iter().enumerate().map(row).collect::<Result<Vec<Option<usize>>, String>>();
    let rows = rows.map_err(EpisodeError::new_err)?;
    let seen = py.detach(|| play_all(&worlds, &rows, &seeds, threads)).map_err(EpisodeError::new_err)?;
    let infos = worlds
        .iter()
        .zip(&seen)
        .map(|(world, seen)| info(py, world.table(), seen))
        .collect::<PyResult<_>>()?;
    let (ends, rewards) = (seen.iter().map(Seen::end).collect(), seen.iter().map(Seen::reward).collect());
    let (mut observations, mut masks) = (Vec::new(), Vec::new());
    let (width, rows) = seen.first().map_or((0, 0), |seen| (seen.observation.len(), seen.legal.len()));
    let len = seen.len();
    for one in seen {
        observations.extend(one.observation);
        masks.extend(one.legal);
    }
    let observations = PyArray1::from_vec(py, observations).reshape([len, width])?;
    let masks = PyArray1::from_vec(py, masks).reshape([len, rows])?;
    Ok((observations, masks, PyArray1::from_vec(py, rewards), ends, infos))
}

fn play_all(
    worlds: &[&Episodes],
    rows: &[Option<usize>],
    seeds: &[Option<u64>],
    threads: usize,
) -> Result<Vec<Seen>, String> {
    let mut held = hold(worlds)?;
    for (index, now) in held.iter().enumerate().filter(|(index, _)| seeds[*index].is_none()) {
        can_advance(now, rows[index]).map_err(|reason| format!("world {index}: {reason}"))?;
    }
    let mut seen: Vec<Option<Result<Seen, String>>> = worlds.iter().map(|_| None).collect();
    // A lock's guard stays on the thread that took it; what it guards may go to another.
    let now: Vec<&mut Option<Stepped>> = held.iter_mut().map(|now| &mut **now).collect();
    let tasks = Mutex::new(now.into_iter().zip(&mut seen).enumerate());
    let next = || tasks.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work = || {
        while let Some((index, (now, seen))) = next() {
            let world = worlds[index];
            *seen = Some(match seeds[index] {
                Some(seed) => Ok(world.begin(now, seed)),
                None => world.advance(now, rows[index]),
            });
        }
    };
    std::thread::scope(|scope| {
        // This thread works, too.
        for _ in 1..threads.clamp(1, worlds.len().max(1)) {
            scope.spawn(work);
        }
        work();
    });
    seen.into_iter().map(|seen| seen.expect("every episode is someone's work")).collect()
}

/// The episodes under way, all locked before any is stepped. They are locked by rising address, so that two calls with some
/// of the same episodes do not wait for each other for ever.
fn hold<'a>(worlds: &[&'a Episodes]) -> Result<Vec<MutexGuard<'a, Option<Stepped>>>, String> {
    let mut order: Vec<usize> = (0..worlds.len()).collect();
    order.sort_by_key(|&index| ptr::from_ref(worlds[index]));
    if let Some(pair) = order.windows(2).find(|pair| ptr::eq(worlds[pair[0]], worlds[pair[1]])) {
        let (one, other) = (pair[0], pair[1]);
        return Err(format!("worlds {one} and {other} are the same object: give one a `sibling()`"));
    }
    let mut held: Vec<_> = order.into_iter().map(|index| (index, worlds[index].now())).collect();
    held.sort_by_key(|(index, _)| *index);
    Ok(held.into_iter().map(|(_, now)| now).collect())
}
