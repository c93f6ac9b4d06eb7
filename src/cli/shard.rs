//! Which shard a process plays: the one that is asked for, or that Slurm or Kubernetes gave it. `shard.yaml` keeps it beside the
//! settings, which are those of the whole.

use std::path::Path;

use avastra_campaign::run::{SHARDS_MAX, Shard};

use super::campaign::{Cut, costs};
use super::error::Failure;
use super::files::{remove, write};
use super::load;
use super::output::Output;
use super::run_directory::refuse_used;

/// The file that keeps it; a directory of the whole has none.
pub const FILE: &str = "shard.yaml";

/// How many completions a Kubernetes Job has. Kubernetes tells a pod its index alone, so a manifest must set this.
const COMPLETIONS: &str = "JOB_COMPLETIONS";

/// The shard that is asked for, or else the one that the environment says; then this is told.
///
/// # Errors
/// If the environment says a part of it only.
pub fn asked(output: &Output, argument: Option<Shard>) -> Result<Shard, Failure> {
    if let Some(shard) = argument {
        return Ok(shard);
    }
    #[allow(
        clippy::disallowed_methods,
        reason = "this is cli, and a scheduler speaks by the environment alone"
    )]
    let read = |name: &str| std::env::var(name).ok();
    match from_environment(&read).map_err(Failure::usage)? {
        None => Ok(Shard::WHOLE),
        Some((shard, origin)) => {
            output.aside(&format!("shard {shard}, because of {origin}; `--shard 1/1` plays all"));
            Ok(shard)
        }
    }
}

/// Writes it into a directory, before the settings.
pub fn keep(directory: &Path, shard: Shard) -> Result<(), Failure> {
    let file = directory.join(FILE);
    if !shard.is_whole() {
        return write(&file, &serde_yaml::to_string(&shard).expect("a shard is two numbers"));
    }
    // A kill may have left the one of a shard that was never begun.
    remove(&file)
}

/// The shard that a directory holds.
pub fn kept(directory: &Path) -> Result<Shard, Failure> {
    let file = directory.join(FILE);
    if !file.exists() {
        return Ok(Shard::WHOLE);
    }
    load::parsed(&file, &load::text(&file)?)
}

/// The next step after a shard is played.
pub fn next_step(shard: Shard) -> String {
    format!(
        "\nthis is shard {shard}: when all are played, `avastra merge DIRS --out DIR` brings them together"
    )
}

/// Says what a command would play, for `--dry-run`; `what` says it of the whole.
pub fn planned(
    output: &Output,
    out: Option<&Path>,
    settings: &impl Cut,
    (heading, what): (&str, &str),
    shard: Shard,
) -> Result<(), Failure> {
    refuse_used(out)?;
    let costs = costs(&settings.work());
    let (units, own) = (costs.len(), shard.share(&costs));
    let most = units.min(SHARDS_MAX as usize);
    let mut text = format!("{heading}\nwould play {what}");
    if !shard.is_whole() {
        text.push_str(&format!("; shard {shard} is {} of {units} pieces", own.len()));
    }
    text.push_str(&match most {
        1 => "\nit cannot be cut into shards".to_owned(),
        _ => format!("\nit can be cut into {most} shards at most"),
    });
    output.say(&text);
    let episodes: u64 = own.iter().map(|&unit| costs[unit]).sum();
    output.result(serde_json::json!({
        "planned": { "units": own.len(), "episodes": episodes, "shards_max": most },
    }));
    Ok(())
}

/// The shard that a scheduler gave this process, and by which variable; `None` where there is no scheduler.
///
/// # Errors
/// If it is not clear how many shards there are.
fn from_environment(read: &dyn Fn(&str) -> Option<String>) -> Result<Option<(Shard, &'static str)>, String> {
    const SAY: &str = "say `--shard I/N` (`--shard 1/1` plays all)";
    let number = |name: &str| -> Result<Option<u32>, String> {
        let Some(text) = read(name) else { return Ok(None) };
        text.trim().parse().map(Some).map_err(|_| format!("{name} is `{text}`, which is no number: {SAY}"))
    };
    if let Some(task) = number("SLURM_ARRAY_TASK_ID")? {
        let [low, high, count] =
            ["_MIN", "_MAX", "_COUNT"].map(|end| number(&format!("SLURM_ARRAY_TASK{end}")));
        let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
        let (Some(low), Some(high), Some(count)) = (low?, high?, count?) else {
            return Err(format!("there is a SLURM_ARRAY_TASK_ID, but not its _MIN, _MAX and _COUNT: {SAY}"));
        };
        // An array of some tasks only, like those that are run again, does not say how many there were.
        let is_regular =
            low <= task && task <= high && (high - low) / step + 1 == count && (task - low) % step == 0;
        if !is_regular {
            return Err(format!(
                "this Slurm array has {count} tasks from {low} to {high}, so its numbers do not say which shard this is: {SAY}"
            ));
        }
        return Ok(Some((Shard::new((task - low) / step + 1, count)?, "SLURM_ARRAY_TASK_ID")));
    }
    let Some(index) = number("JOB_COMPLETION_INDEX")? else { return Ok(None) };
    let Some(count) = number(COMPLETIONS)? else {
        return Err(format!(
            "there is a JOB_COMPLETION_INDEX, but no {COMPLETIONS} with the number of them all: set it in the manifest, or {SAY}"
        ));
    };
    Ok(Some((Shard::new(index.saturating_add(1), count)?, "JOB_COMPLETION_INDEX")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(variables: &[(&str, &str)]) -> Result<Option<String>, String> {
        let read = |name: &str| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        };
        Ok(from_environment(&read)?.map(|(shard, _)| shard.to_string()))
    }

    #[test]
    fn schedulers_say_which_shard_it_is() {
        let slurm = |task, low, high, count| {
            found(&[
                ("SLURM_ARRAY_TASK_ID", task),
                ("SLURM_ARRAY_TASK_MIN", low),
                ("SLURM_ARRAY_TASK_MAX", high),
                ("SLURM_ARRAY_TASK_COUNT", count),
            ])
        };
        assert_eq!(found(&[]), Ok(None));
        assert_eq!(slurm("0", "0", "7", "8"), Ok(Some("1/8".to_owned())));
        assert_eq!(slurm("8", "1", "8", "8"), Ok(Some("8/8".to_owned())));
        let stepped = [
            ("SLURM_ARRAY_TASK_ID", "8"),
            ("SLURM_ARRAY_TASK_MIN", "0"),
            ("SLURM_ARRAY_TASK_MAX", "12"),
            ("SLURM_ARRAY_TASK_STEP", "4"),
            ("SLURM_ARRAY_TASK_COUNT", "4"),
        ];
        assert_eq!(found(&stepped), Ok(Some("3/4".to_owned())));
        // Two tasks of eight are run again.
        assert!(slurm("7", "3", "7", "2").unwrap_err().contains("2 tasks from 3 to 7"));
        assert!(slurm("x", "3", "7", "5").unwrap_err().contains("no number"));
        assert!(found(&[("SLURM_ARRAY_TASK_ID", "3")]).unwrap_err().contains("_COUNT"));
        let kubernetes = [("JOB_COMPLETION_INDEX", "0"), ("JOB_COMPLETIONS", "64")];
        assert_eq!(found(&kubernetes), Ok(Some("1/64".to_owned())));
        assert!(found(&kubernetes[..1]).unwrap_err().contains("JOB_COMPLETIONS"));
        assert!(found(&[("JOB_COMPLETION_INDEX", "64"), kubernetes[1]]).unwrap_err().contains("65 of 64"));
    }
}
