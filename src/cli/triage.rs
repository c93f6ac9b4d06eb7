//! `avastra triage`: what runs found, sorted into failures that a file knows, kinds that are new, and failures that are gone.

use std::collections::BTreeSet;

use avastra_base::outside::Shown;
use avastra_campaign::run::triage::{FoundFailures, GoneFailures, Seen, Sorted, named, read_known, sort};
use avastra_campaign::run::{Database, DatabaseError};

use super::arguments::TriageArguments;
use super::error::Failure;
use super::files::{write_again, write_named};
use super::output::{Output, for_shell, plural};
use super::{load, run_directory};

/// Sorts what runs found, and adds what is new to the file if that is asked for.
pub fn triage(output: &Output, arguments: &TriageArguments) -> Result<(), Failure> {
    let TriageArguments { directories, known, add, fail_on_new } = arguments;
    let wrong = |reason| Failure::file("use", known, reason);
    let text = match known.try_exists() {
        Ok(false) if *add => String::new(),
        Ok(false) => {
            let again = format!("avastra triage … --known {} --add", for_shell(known));
            return Err(Failure::file("read", known, format!("there is no such file; `{again}` begins it")));
        }
        _ => load::text(known)?,
    };
    let failures = read_known(&text).map_err(wrong)?;
    let (mut facts, mut simulated_h, mut seen) = (Vec::new(), 0.0, BTreeSet::new());
    for directory in directories {
        if !seen.insert(directory.canonicalize().unwrap_or_else(|_| directory.clone())) {
            return Err(Failure::usage(format!(
                "`{}` is named twice: its findings would count twice",
                directory.shown()
            )));
        }
        let file = directory.join("run.db");
        let unread = |error: DatabaseError| Failure::file("read", &file, error);
        let settings = load::text(&directory.join("run.yaml"))?;
        let (database, remark) = run_directory::open_to_read::<Database>(&file, &settings)?;
        remark.iter().for_each(|remark| output.warn(remark));
        let found = database.facts().map_err(unread)?;
        // Scenarios of two runs may have one name.
        facts.extend(found.into_iter().map(|fact| fact.of(&directory.shown().to_string())));
        simulated_h += database.left(None).map_err(unread)?.simulated_h;
    }
    let sorted = sort(&failures, &facts, simulated_h);
    output.say(&in_words(&sorted));
    if *add && !sorted.new.is_empty() {
        let separated = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
        let more = named(&sorted.new, simulated_h);
        let more = serde_yaml::to_string(&more).expect("failures are plain strings and numbers");
        let whole = format!("{text}{separated}{more}");
        // A list in one line cannot go on in lines of its own.
        read_known(&whole)
            .map_err(|reason| wrong(format!("what is new cannot be added at its end: {reason}")))?;
        match text.is_empty() {
            true => write_named(known, &whole)?,
            false => write_again(known, &whole)?,
        }
        output.say(&format!("\nadded to {}: give each a name of yours, and a rule", known.shown()));
    } else if !sorted.new.is_empty() {
        output.tell("\nnext: `--add` writes what is new to the file, with its kind as its rule");
    }
    let added = if *add { sorted.new.len() } else { 0 };
    output.result(serde_json::json!({
        "simulated_h": sorted.simulated_h, "known": sorted.known, "open": sorted.open, "gone": sorted.gone, "new": sorted.new,
        "unsure": sorted.unsure, "added": added,
    }));
    match sorted.new.len() {
        new if new > 0 && *fail_on_new => Err(Failure::Found { what: plural(new, "new kind") }),
        _ => Ok(()),
    }
}

fn in_words(sorted: &Sorted) -> String {
    let Sorted { simulated_h, known, open, gone, new, unsure } = sorted;
    let seen = |seen: &Seen| format!("{} in {:.1} h", plural(seen.episodes as usize, "episode"), seen.hours);
    let found = |one: &FoundFailures| {
        let before =
            one.before.as_ref().map_or(String::new(), |before| format!(" (before: {})", seen(before)));
        format!("  {}: {}{before}, {}", one.name, plural(one.episodes as usize, "episode"), one.scenario)
    };
    let missing = |one: &GoneFailures| match (&one.before, one.chance) {
        (Some(before), Some(chance)) => {
            let (name, before) = (&one.name, seen(before));
            format!("  {name} (before: {before}): the chance to find none of it all the same is {chance:.2}")
        }
        _ => format!("  {}", one.name),
    };
    let mut lines = vec![format!("in {simulated_h:.1} h of simulated time")];
    let mut part = |title: String, all: Vec<String>| {
        if !all.is_empty() {
            lines.push(title);
            lines.extend(all);
        }
    };
    part(format!("known: {}", plural(known.len(), "failure")), known.iter().map(found).collect());
    part(
        format!("seen, but not shown to recur: {}", plural(open.len(), "failure")),
        open.iter().map(found).collect(),
    );
    part(format!("gone: {}", plural(gone.len(), "failure")), gone.iter().map(missing).collect());
    part(format!("new: {}", plural(new.len(), "kind")), new.iter().map(found).collect());
    if known.is_empty() && new.is_empty() {
        lines.push("nothing was found that recurs".to_owned());
    }
    if *unsure > 0 {
        lines.push(format!("{} left out, not shown to recur", plural(*unsure, "finding")));
    }
    lines.join("\n")
}
