//! What a run, a training, a study and an estimate have in common: a directory with settings, a database of units, and
//! scenarios that were written of them. Each says in its own file what it is; `run_directory` begins and resumes all of them,
//! and `merge` brings the shards of all together that can be cut.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use avastra_campaign::estimate::EstimateSettings;
use avastra_campaign::run::{DatabaseError, Numbered, PolicyReference, RunSettings, Units};
use avastra_campaign::study::StudySettings;
use avastra_campaign::train::TrainSettings;
use avastra_drivers::external::Attached;

use super::error::Failure;
use super::output::Output;

/// All kinds. One directory holds one of them; the first that it holds counts.
pub const KINDS: [Kind; 4] =
    [StudySettings::KIND, EstimateSettings::KIND, TrainSettings::KIND, RunSettings::KIND];

/// A kind of campaign.
pub struct Kind {
    /// What was begun, in a word.
    pub what: &'static str,
    /// The command that begins it and goes on with it.
    pub command: &'static str,
    /// The name of its files: `run.yaml`, `run.db`.
    pub file: &'static str,
    /// Whether a directory holds one.
    pub is_in: fn(&Path) -> bool,
    /// Brings shards together; nothing for what is one piece.
    pub merge: Option<Merge>,
}

/// Brings the shards in these directories together; without a new directory, only says what is missing.
pub type Merge = fn(&Output, &[PathBuf], Option<&Path>) -> Result<(), Failure>;

/// A campaign, by its settings.
pub trait Campaign: Serialize + DeserializeOwned {
    const KIND: Kind;
    type Database: Units;

    /// What the settings name outside of the directory.
    fn outside(&mut self) -> Outside<'_>;
}

/// What settings name outside of their directory, by paths from there.
pub struct Outside<'a> {
    pub space: &'a mut String,
    pub space_digest: &'a str,
    pub external: &'a mut Option<Attached>,
    /// The policy that is played; nothing where no policy can be.
    pub policy: Option<&'a mut Option<PolicyReference>>,
}

/// A campaign that can be cut into shards.
pub trait Cut: Campaign {
    /// Everything that is shared out.
    fn work(&self) -> Vec<Item>;

    /// The numbers of the units of a file, each with the one in a settled file.
    fn numbered(&self, database: &Self::Database) -> Result<Vec<Numbered>, DatabaseError> {
        as_they_are(database)
    }

    /// Takes over what a shard keeps beside its database.
    fn take_beside(_: [&Path; 2]) -> Result<(), Failure> {
        Ok(())
    }

    /// Ends a directory in which all is played.
    fn conclude(output: &Output, directory: &Path) -> Result<(), Failure>;
}

/// What a shard has as a whole, or not at all.
pub struct Item {
    pub cost: u64,
    /// The numbers of its units in a settled file.
    pub units: Vec<i64>,
}

/// Units that have the same numbers in every file.
pub fn as_they_are(database: &impl Units) -> Result<Vec<Numbered>, DatabaseError> {
    Ok(database.numbers()?.into_iter().map(|number| (number, number)).collect())
}
