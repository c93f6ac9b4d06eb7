//! `timing.jsonl`: what the cells of a study took on the machines that played them. No part of its result, so it is no part of
//! `study.db`: two machines agree on everything else.

use std::collections::BTreeMap;
use std::path::Path;

use avastra_campaign::study::{CellRecord, Spent};

use super::error::Failure;
use super::files::write;
use super::load;

/// The file's name.
pub const FILE: &str = "timing.jsonl";

/// Times of cells, by agent, road and number.
#[derive(Default)]
pub struct Times {
    of_cells: BTreeMap<(String, String, u32), Spent>,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct Line {
    agent: String,
    road: String,
    number: u32,
    #[serde(flatten)]
    spent: Spent,
}

impl Times {
    /// The times in a study's directory. A file or line that cannot be read gives no times: they are not known.
    pub fn read(directory: &Path) -> Times {
        let text = load::read(&directory.join(FILE)).unwrap_or_default();
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
        let is_time = |spent: &Spent| spent.wall_s >= 0.0 && spent.cpu_s.is_none_or(|cpu_s| cpu_s >= 0.0);
        let sound = lines.filter(|line| is_time(&line.spent));
        Times { of_cells: sound.map(|line| ((line.agent, line.road, line.number), line.spent)).collect() }
    }

    /// Takes the times of cells in that were played.
    pub fn add(&mut self, cells: &[CellRecord]) {
        let timed =
            |cell: &CellRecord| Some(((cell.agent.clone(), cell.road.clone(), cell.number), cell.spent?));
        self.of_cells.extend(cells.iter().filter_map(timed));
    }

    /// Takes those of another directory in.
    pub fn extend(&mut self, others: Times) {
        self.of_cells.extend(others.of_cells);
    }

    /// Writes them, sorted.
    pub fn write(&self, directory: &Path) -> Result<(), Failure> {
        let line = |((agent, road, number), spent): (&(String, String, u32), &Spent)| {
            let line = Line { agent: agent.clone(), road: road.clone(), number: *number, spent: *spent };
            serde_json::to_string(&line).expect("it has string keys only") + "\n"
        };
        write(&directory.join(FILE), &self.of_cells.iter().map(line).collect::<String>())
    }

    /// The cells with their times, as far as they are known.
    pub fn on(&self, mut cells: Vec<CellRecord>) -> Vec<CellRecord> {
        for cell in &mut cells {
            let key = (cell.agent.clone(), cell.road.clone(), cell.number);
            cell.spent = self.of_cells.get(&key).copied();
        }
        cells
    }
}
