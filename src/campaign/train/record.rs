//! A training in the run database: learning curves, checkpoints to resume from, and its results.
//!
//! A checkpoint and the episodes up to it are committed together. Episodes after the last checkpoint are deleted
//! when a training is resumed, and played again to the same bytes.

use rusqlite::{OptionalExtension, params};

use crate::run::{Database, DatabaseError, LAYOUT, add_all, insert_row, query_all, settings_digest};
use avastra_lang::model::{Space, digest};
use avastra_world::action::Draw;

use crate::train::training::TrainedEpisode;

/// An agent as it was after so many episodes.
pub struct Checkpoint {
    pub episodes: usize,
    pub learner: Vec<u8>,
}

impl Database {
    /// Adds an episode of a training, and with it a checkpoint if there is one to keep. The rest is as for
    /// [`Database::add`].
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add_trained(
        &mut self,
        trained: &TrainedEpisode,
        checkpoint: Option<&[u8]>,
        space: &Space,
        in_words: impl Fn(&Draw) -> String,
        scenario: Option<&str>,
    ) -> Result<(), DatabaseError> {
        let transaction = self.connection.transaction()?;
        let episode = trained.summary.episode;
        add_all(&transaction, &trained.summary, &trained.log, space, in_words, scenario)?;
        let values = params![
            episode as i64,
            trained.sum,
            trained.log.collisions.len() as i64,
            trained.summary.counted() as i64,
            trained.exploration_epsilon,
            trained.lesson.loss,
            trained.lesson.updates as i64,
            trained.steps as i64,
            trained.simulated_s,
        ];
        insert_row(&transaction, "learning", values)?;
        if let Some(learner) = checkpoint {
            transaction.execute(
                "INSERT OR REPLACE INTO checkpoint VALUES (1, ?, ?, ?)",
                params![episode as i64 + 1, seal(episode as i64 + 1, learner), learner],
            )?;
        }
        LAYOUT.seal(&transaction, episode as i64)?;
        transaction.commit()?;
        Ok(())
    }

    /// Keeps the results of a finished training, as JSON, in place of earlier ones.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn keep_results(&self, text: &str) -> Result<(), DatabaseError> {
        let seal = self.result_seal(text)?;
        self.connection.execute("INSERT OR REPLACE INTO result VALUES (1, ?, ?)", params![seal, text])?;
        Ok(())
    }

    /// The results of a training, as JSON, if it is finished.
    ///
    /// # Errors
    /// If the file cannot be read, or the results were changed.
    pub fn results(&self) -> Result<Option<String>, DatabaseError> {
        let kept: Option<(String, String)> = self
            .connection
            .query_row("SELECT digest, text FROM result", [], |row| Ok((row.get(0)?, row.get(1)?)))
            .optional()?;
        match kept {
            Some((seal, text)) if self.result_seal(&text)? != seal => Err(DatabaseError::Results),
            kept => Ok(kept.map(|(_, text)| text)),
        }
    }

    /// The digest of results, and of the settings that they came from.
    fn result_seal(&self, text: &str) -> Result<String, DatabaseError> {
        let settings = settings_digest(&self.connection)?;
        Ok(digest(&[&settings[..], text.as_bytes()].concat()))
    }

    /// Time simulated for the episodes of a training so far, s.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn trained_s(&self) -> Result<f64, DatabaseError> {
        // Summed as a training does it: SQLite's own sum rounds otherwise, and what is left of a training follows from it.
        let all = query_all(&self.connection, "SELECT simulated_s FROM learning ORDER BY episode", |row| {
            row.get::<_, f64>(0)
        })?;
        Ok(all.into_iter().fold(0.0, |sum, one| sum + one))
    }

    /// Returns the last checkpoint and deletes all episodes after it. Without a checkpoint, all episodes are
    /// deleted. A whole evaluation of so many episodes stays: what recurs was perhaps tested after it.
    ///
    /// # Errors
    /// If the file cannot be read or written, or the checkpoint is damaged.
    pub fn return_to_checkpoint(&mut self, evaluation: usize) -> Result<Option<Checkpoint>, DatabaseError> {
        let is_evaluated = self.evaluated()? >= evaluation;
        let transaction = self.connection.transaction()?;
        let kept: Option<(i64, String, Vec<u8>)> = transaction
            .query_row("SELECT episodes, digest, learner FROM checkpoint", [], |row| {
                Ok((row.get(0)?, row.get(1)?, row.get(2)?))
            })
            .optional()?;
        let checkpoint = match kept {
            None => None,
            Some((episodes, claimed, learner)) => {
                let episodes =
                    usize::try_from(episodes).map_err(|_| DatabaseError::Episode { found: episodes })?;
                if seal(episodes as i64, &learner) != claimed {
                    return Err(DatabaseError::Checkpoint);
                }
                Some(Checkpoint { episodes, learner })
            }
        };
        let first = checkpoint.as_ref().map_or(0, |checkpoint| checkpoint.episodes) as i64;
        if !is_evaluated || checkpoint.is_none() {
            LAYOUT.delete_from(&transaction, first)?;
        }
        transaction.commit()?;
        Ok(checkpoint)
    }

    /// The number of episodes that judge what was learned: they begin when the training is over.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn evaluated(&self) -> Result<usize, DatabaseError> {
        let query = "SELECT count(*) FROM episode WHERE episode NOT IN (SELECT episode FROM learning)";
        let count: i64 = self.connection.query_row(query, [], |row| row.get(0))?;
        Ok(usize::try_from(count).unwrap_or(0))
    }
}

/// The digest of a checkpoint: of its bytes, and of the number of episodes that it comes after.
fn seal(episodes: i64, learner: &[u8]) -> String {
    digest(&[&episodes.to_le_bytes(), learner].concat())
}
