//! Cells in which an external driving system failed. The statistics would lack what it did not drive, so a study with
//! such a cell has no statistics.

use std::collections::BTreeMap;

use avastra_drivers::external::FailureKind;

use crate::study::record::CellRecord;

/// A cell with episodes that ended because the driving system failed.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct FailedCell {
    pub agent: String,
    pub road: String,
    pub number: u32,
    /// Episodes of its training, by how the driving system failed. All cells of one training have the same.
    pub trained: BTreeMap<FailureKind, usize>,
    /// Evaluated episodes, likewise.
    pub evaluated: BTreeMap<FailureKind, usize>,
}

impl FailedCell {
    /// The failed cells among these, in their order.
    pub fn among(cells: &[CellRecord]) -> Vec<FailedCell> {
        let found = cells.iter().map(|cell| FailedCell {
            agent: cell.agent.clone(),
            road: cell.road.clone(),
            number: cell.number,
            trained: counts(cell.trained.iter().map(|episode| episode.ended.as_str())),
            evaluated: counts(cell.episodes.iter().map(|episode| episode.ended.as_str())),
        });
        found.filter(|cell| !cell.trained.is_empty() || !cell.evaluated.is_empty()).collect()
    }

    /// How often the driving system failed in cells: a training that several share counts once.
    pub fn findings(cells: &[FailedCell]) -> usize {
        let trainings: BTreeMap<(&str, u32), usize> = cells
            .iter()
            .map(|cell| ((cell.agent.as_str(), cell.number), cell.trained.values().sum()))
            .collect();
        trainings.values().sum::<usize>()
            + cells.iter().flat_map(|cell| cell.evaluated.values()).sum::<usize>()
    }
}

/// How many of these ends are failures of the driving system, by kind.
fn counts<'a>(ends: impl Iterator<Item = &'a str>) -> BTreeMap<FailureKind, usize> {
    let mut counts = BTreeMap::new();
    for end in ends {
        if let Some(kind) = FailureKind::ALL.into_iter().find(|kind| kind.name() == end) {
            *counts.entry(kind).or_default() += 1;
        }
    }
    counts
}
