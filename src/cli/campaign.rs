//! The common part of a run, a training, a study and an estimate: a directory with settings, a database of units, and the
//! scenarios written of them. Each of the four is defined in its own file. `run_directory` begins and resumes all of them.
//! `merge` brings their shards together, for the kinds that can be cut.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;

use avastra_campaign::estimate::EstimateSettings;
use avastra_campaign::run::{DatabaseError, Numbered, PolicyReference, RunSettings, Shard, Units};
use avastra_campaign::study::StudySettings;
use avastra_campaign::train::TrainSettings;
use avastra_drivers::external::{Attached, Program};

use super::error::Failure;
use super::findings::unfinished;
use super::output::{Output, for_shell, plural};
use super::progress::Progress;
use super::run_directory::Directory;
use super::shard;

/// All kinds. One directory holds one of them; the first that it holds counts.
pub const KINDS: [Kind; 4] =
    [StudySettings::KIND, EstimateSettings::KIND, TrainSettings::KIND, RunSettings::KIND];

/// A kind of campaign.
pub struct Kind {
    /// The noun for the campaign, in a word.
    pub what: &'static str,
    /// The command that begins it and goes on with it.
    pub command: &'static str,
    /// The name of its files: `run.yaml`, `run.db`.
    pub file: &'static str,
    /// Whether a directory holds one.
    pub is_in: fn(&Path) -> bool,
    /// Whether a copy of its space lies in the directory, in which its scenarios are shown as they were recorded.
    pub keeps_space: bool,
    /// Brings shards together; nothing for what is one piece.
    pub merge: Option<Merge>,
    /// Names the scenarios in a directory that it did not write.
    pub foreign: fn(&Path) -> Option<String>,
}

impl Kind {
    /// The file of the settings in a directory.
    pub fn settings(&self, directory: &Path) -> PathBuf {
        directory.join(format!("{}.yaml", self.file))
    }

    /// The file of the database in a directory.
    pub fn database(&self, directory: &Path) -> PathBuf {
        directory.join(format!("{}.db", self.file))
    }
}

/// Brings the shards in these directories together; without a new directory, only says what is missing.
pub type Merge = fn(&Output, &[PathBuf], Option<&Path>) -> Result<(), Failure>;

/// A campaign, by its settings.
pub trait Campaign: Serialize + DeserializeOwned {
    const KIND: Kind;
    type Database: Units;

    /// The space, the external driving system and the policy that the settings name outside of their directory.
    fn outside(&mut self) -> Outside<'_>;

    /// These settings; for a dry run with an external driving system that is not started.
    fn started_unless(mut self, is_dry_run: bool) -> Self {
        self.outside().external.iter_mut().for_each(|attached| attached.is_recorded |= is_dry_run);
        self
    }
}

/// The space, the external driving system and the policy that settings name outside of their directory, by paths from there.
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

    /// Which of the unplayed items, in rising order, are played next: all of them, unless what was found decides how many
    /// there are.
    fn to_play(&self, lacking: Vec<usize>, _: &Self::Database) -> Result<Vec<usize>, DatabaseError> {
        Ok(lacking)
    }

    /// Whether it cannot be cut at all.
    fn is_one_piece(&self) -> bool {
        false
    }

    /// Takes over what a shard keeps beside its database.
    fn take_beside(_: [&Path; 2]) -> Result<(), Failure> {
        Ok(())
    }

    /// Ends a directory in which all is played.
    fn conclude(output: &Output, directory: &Path) -> Result<(), Failure>;
}

/// A piece of work that a shard has as a whole, or not at all.
pub struct Item {
    /// Its cost in episodes.
    pub cost: u64,
    /// The numbers of its units in a settled file.
    pub units: Range<i64>,
}

impl Item {
    /// Whether all of its units are among these.
    pub fn is_in(&self, units: &BTreeSet<i64>) -> bool {
        self.units.clone().all(|unit| units.contains(&unit))
    }
}

/// The costs of all items, by which they are shared out.
pub fn costs(work: &[Item]) -> Vec<u64> {
    work.iter().map(|item| item.cost).collect()
}

/// The work that a directory has to play. Items go by their positions in the work of the whole.
pub struct Share {
    pub shard: Shard,
    /// The items of its shard, rising.
    pub own: Vec<usize>,
    work: Vec<Item>,
}

impl Share {
    /// The share of the shard that a directory holds.
    pub fn of<C: Cut>(directory: &Path, settings: &C) -> Result<Share, Failure> {
        let (shard, work) = (shard::kept(directory)?, settings.work());
        Ok(Share { shard, own: shard.share(&costs(&work)), work })
    }

    /// Those of its items that are to be played next.
    pub fn lacking<C: Cut>(&self, settings: &C, directory: &Directory<C>) -> Result<Vec<usize>, Failure> {
        directory.read(|database| self.to_play(settings, database))
    }

    fn to_play<C: Cut>(&self, settings: &C, database: &C::Database) -> Result<Vec<usize>, DatabaseError> {
        let played = settings.numbered(database)?.into_iter().map(|(_, place)| place).collect();
        let lacking = self.own.iter().copied().filter(|&item| !self.work[item].is_in(&played));
        settings.to_play(lacking.collect(), database)
    }

    /// The progress over its episodes. `how` is as for [`Progress`], `lacking` has the items that are not played.
    pub fn progress(&self, output: &Output, how: &'static str, lacking: &[usize]) -> Progress {
        let episodes = |items: &[usize]| items.iter().map(|&item| self.work[item].cost).sum::<u64>();
        let all = episodes(&self.own);
        Progress::new(output, how, all, all - episodes(lacking))
    }

    /// Says the next step after playing: how to go on if something is left, and how to bring shards together.
    pub fn end<C: Cut>(
        &self,
        output: &Output,
        directory: Directory<C>,
        is_over: bool,
        program: Option<&Arc<Program>>,
    ) -> Result<(), Failure> {
        if !is_over {
            return Err(unfinished(C::KIND.command, directory.path, program));
        }
        if !self.shard.is_whole() {
            output.say(&shard::next_step(self.shard));
        }
        Ok(())
    }
}

/// Says how many units a directory lacks of its share, if any. `is_wanted` tells which units it must have.
pub fn missing<C: Cut>(
    directory: &Path,
    settings: &C,
    database: &C::Database,
    is_wanted: impl Fn(i64) -> bool,
) -> Result<Option<String>, Failure> {
    let share = Share::of(directory, settings)?;
    let unread = |error| Failure::file("read", &C::KIND.database(directory), error);
    let played = settings.numbered(database).map_err(unread)?;
    let played: BTreeSet<i64> = played.into_iter().map(|(_, place)| place).collect();
    let lacking = share.to_play(settings, database).map_err(unread)?;
    let lacking = lacking.iter().flat_map(|&item| share.work[item].units.clone());
    let lacking: BTreeSet<i64> = lacking.filter(|unit| is_wanted(*unit) && !played.contains(unit)).collect();
    let there = share.own.iter().flat_map(|&item| share.work[item].units.clone());
    let there = there.filter(|unit| is_wanted(*unit) && played.contains(unit)).count();
    Ok(lacks::<C>(directory, lacking.len(), there + lacking.len()))
}

/// Says that units are missing, and how to go on; nothing if none is.
pub fn lacks<C: Campaign>(directory: &Path, lacking: usize, wanted: usize) -> Option<String> {
    let (are, them) = if lacking == 1 { ("is", "it") } else { ("are", "them") };
    (lacking > 0).then(|| {
        format!(
            "{lacking} of {} {are} missing: `avastra {} --resume {}` plays {them}",
            plural(wanted, C::Database::LAYOUT.unit),
            C::KIND.command,
            for_shell(directory)
        )
    })
}

/// Settles the database of a directory in which all is played.
pub fn settled<C: Cut>(settings: &C, directory: Directory<C>) -> Result<Directory<C>, Failure> {
    let units = directory.read(|database| settings.numbered(database))?;
    directory.settle(&units)
}

/// Units that have the same numbers in every file.
pub fn as_they_are(database: &impl Units) -> Result<Vec<Numbered>, DatabaseError> {
    Ok(database.numbers()?.into_iter().map(|number| (number, number)).collect())
}
