//! The course of a run or a training, in more detail than its totals: rows on roads, and the episodes of a training.

use crate::run::database::Database;
use crate::run::sealed::{DatabaseError, of_columns, query_all};

/// The outcomes of a row on a road.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct CoverageCell {
    pub road: String,
    pub row: i64,
    /// Steps in which it was legal, refused, chosen and carried out.
    pub legal: i64,
    pub refused: i64,
    pub chosen: i64,
    pub realised: i64,
    /// The reason that refused it most often.
    pub why: Option<String>,
}

/// An episode of a training.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LearningPoint {
    pub episode: i64,
    pub reward: f64,
    pub counted: i64,
    pub exploration: f64,
    pub loss: Option<f64>,
}

impl Database {
    /// Every row on every road on which it was offered or chosen, by road and row.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn coverage(&self) -> Result<Vec<CoverageCell>, DatabaseError> {
        // The bare column of an aggregate query with `max` is that of the row that has the maximum.
        let query = "WITH offered AS (
               SELECT road, action_row, reason, sum(offer.steps) AS times FROM offer JOIN episode USING (episode)
               GROUP BY road, action_row, reason),
             refused AS (
               SELECT road, action_row, sum(times) AS times, max(times), text AS why
               FROM offered JOIN reason USING (reason) GROUP BY road, action_row),
             legal AS (SELECT road, action_row, times FROM offered WHERE reason = 0),
             chosen AS (
               SELECT road, action_row, count(*) AS times, count(action) AS done FROM step JOIN episode USING (episode)
               WHERE action_row IS NOT NULL GROUP BY road, action_row),
             cell AS (
               SELECT road, action_row FROM offered UNION SELECT road, action_row FROM chosen)
             SELECT road, action_row, coalesce(legal.times, 0), coalesce(refused.times, 0), coalesce(chosen.times, 0),
                    coalesce(done, 0), why
             FROM cell LEFT JOIN legal USING (road, action_row) LEFT JOIN refused USING (road, action_row)
                  LEFT JOIN chosen USING (road, action_row)
             ORDER BY road, action_row";
        query_all(&self.connection, query, |row| {
            Ok(of_columns!(row, 0, CoverageCell { road, row, legal, refused, chosen, realised, why }))
        })
    }

    /// The share of random choices in the last episode of a training, and the updates of all; `None` without any episode.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn learned(&self) -> Result<Option<(f64, i64)>, DatabaseError> {
        let query =
            "SELECT (SELECT epsilon FROM learning ORDER BY episode DESC LIMIT 1), sum(updates) FROM learning
                     HAVING count(*) > 0";
        Ok(query_all(&self.connection, query, |row| Ok((row.get(0)?, row.get(1)?)))?.into_iter().next())
    }

    /// The episodes of a training; none for a run.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn learning(&self) -> Result<Vec<LearningPoint>, DatabaseError> {
        let query = "SELECT episode, return, counted, epsilon, loss FROM learning ORDER BY episode";
        query_all(&self.connection, query, |row| {
            Ok(of_columns!(row, 0, LearningPoint { episode, reward, counted, exploration, loss }))
        })
    }
}
