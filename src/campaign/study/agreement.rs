//! A study's figures held against published ones: whether each lies within our interval, and whether every comparison
//! that they allow goes the same way.

use avastra_base::statistics::{Estimate, holm, mann_whitney, superiority};

use crate::study::file::PublishedTable;
use crate::study::measures::MeasuredCell;
use crate::study::results::{estimate, values};

/// From this p-value on, two agents are not told apart.
pub const P_MAX: f64 = 0.05;

/// The comparison of a study with a table of published figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    /// Each figure that our study has a number for, in the order of the study's agents and roads.
    pub figures: Vec<ComparedFigure>,
    /// Every pair of differing figures of a road whose two agents the study has played, so that a test can compare
    /// ours.
    pub pairs: Vec<ComparedPair>,
}

/// A published figure and ours.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedFigure {
    pub agent: String,
    pub road: String,
    pub published: f64,
    pub ours: Estimate,
}

/// Two agents of which the first has the larger published figure.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedPair {
    pub road: String,
    pub larger: String,
    pub smaller: String,
    pub verdict: Verdict,
}

/// The verdict of our figures on an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Same,
    Opposite,
    /// Mann–Whitney's p, after Holm's correction over the table, is not below [`P_MAX`].
    NotToldApart,
}

impl ComparedFigure {
    /// Whether the published figure lies within our interval; `None` if ours has none, or was never observed.
    pub fn is_within(&self) -> Option<bool> {
        let interval = self.ours.interval.filter(|_| self.ours.mean > 0.0)?;
        Some(interval.low <= self.published && interval.high.is_none_or(|high| self.published <= high))
    }
}

impl Agreement {
    /// `agents` and `roads` are those of the study, in its order.
    pub fn new(table: &PublishedTable, agents: &[&str], roads: &[&str], cells: &[MeasuredCell]) -> Agreement {
        let of = |agent: &str, road: &str| {
            let own = cells.iter().filter(|cell| cell.agent == agent && cell.road == road);
            own.collect::<Vec<_>>()
        };
        let (mut figures, mut pairs, mut tests) = (Vec::new(), Vec::new(), Vec::new());
        for road in roads {
            let published: Vec<(&str, f64, Vec<&MeasuredCell>)> = agents
                .iter()
                .filter_map(|agent| Some((*agent, *table.figures.get(*agent)?.get(*road)?, of(agent, road))))
                .collect();
            for (agent, published, own) in &published {
                let Some(ours) = estimate(&table.measure, own) else { continue };
                let (agent, road) = ((*agent).to_owned(), (*road).to_owned());
                figures.push(ComparedFigure { agent, road, published: *published, ours });
            }
            for (larger, figure, own) in &published {
                for (smaller, other, theirs) in &published {
                    if figure <= other {
                        continue;
                    }
                    let (own, theirs) = (values(&table.measure, own), values(&table.measure, theirs));
                    let test = mann_whitney(&own, &theirs).zip(superiority(&own, &theirs));
                    let Some((test, (superiority, _))) = test else { continue };
                    tests.push((test.p, superiority));
                    pairs.push(ComparedPair {
                        road: (*road).to_owned(),
                        larger: (*larger).to_owned(),
                        smaller: (*smaller).to_owned(),
                        verdict: Verdict::NotToldApart,
                    });
                }
            }
        }
        let corrected = holm(&tests.iter().map(|(p, _)| *p).collect::<Vec<_>>());
        for ((pair, p), (_, superiority)) in pairs.iter_mut().zip(corrected).zip(tests) {
            pair.verdict = match p < P_MAX {
                false => Verdict::NotToldApart,
                true if superiority > 0.5 => Verdict::Same,
                true => Verdict::Opposite,
            };
        }
        Agreement { figures, pairs }
    }
}
