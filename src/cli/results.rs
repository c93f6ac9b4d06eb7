//! `avastra study results`: what a folder of studies found, as one text.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::study::Played;
use avastra_exchange::report::{self, Chapter};

use super::arguments::ResultsArguments;
use super::error::Failure;
use super::files::{without_links, write, write_named};
use super::load;
use super::output::{Output, plural};
use super::study;

/// Takes played studies in, and writes what all studies of a folder found.
pub fn results(output: &Output, arguments: &ResultsArguments) -> Result<(), Failure> {
    let mut chapters = chapters(output, &arguments.studies)?;
    for directory in &arguments.add {
        let (settings, cells) = study::read(directory)?;
        let played = Played::new(settings, &cells, arguments.commit.clone());
        let chapter = chapter_of(&mut chapters, directory, &played)?;
        let path = kept(&arguments.studies, &chapter.name);
        let mut played = as_from_file(played, chapter);
        if let Some(kept) = chapter.played.take_if(|kept| kept.settings == played.settings) {
            played = kept.and(played).map_err(|reason| Failure::file("add", directory, reason))?;
        }
        if let Some(kept) = chapter.played.as_ref().filter(|kept| kept.cells.len() > played.cells.len()) {
            let (more, less) = (kept.cells.len(), plural(played.cells.len(), "cell"));
            let path = path.shown();
            let reason = format!(
                "it has {less}, and `{path}` has {more} of other settings: to keep less, remove that file"
            );
            return Err(Failure::file("add", directory, reason));
        }
        without_links(&path)?;
        write(&path, &played.to_text())?;
        output.tell(&format!(
            "{} of {} into {}",
            plural(played.cells.len(), "cell"),
            directory.shown(),
            path.shown()
        ));
        chapter.played = Some(played);
    }
    let folder = arguments.studies.to_string_lossy();
    write_named(&arguments.out, &report::results(folder.trim_end_matches('/'), &chapters))?;
    let there = chapters.iter().filter(|chapter| chapter.played.is_some()).count();
    output.say(&format!("{}: {there} of {} studies are played", arguments.out.shown(), chapters.len()));
    let listed = chapters.iter().map(|chapter| {
        let departures = chapter.played.as_ref().map(|played| played.departures(&chapter.wanted));
        serde_json::json!({
            "study": chapter.name,
            "cells": chapter.played.as_ref().map(|played| played.cells.len()),
            "smaller": departures.as_ref().map(|found| &found.smaller),
            "other": departures.as_ref().map(|found| &found.other),
        })
    });
    output.result(serde_json::json!({ "output": arguments.out, "studies": listed.collect::<Vec<_>>() }));
    Ok(())
}

/// The studies of a folder, in the order of their names, with what is kept of playing them.
fn chapters(output: &Output, folder: &Path) -> Result<Vec<Chapter>, Failure> {
    let files = load::files_in(folder, "yaml").map_err(|error| Failure::file("read", folder, error))?;
    if files.is_empty() {
        return Err(Failure::file("use", folder, "it has no study (`*.yaml`)"));
    }
    files.iter().map(|file| chapter(output, folder, file)).collect()
}

fn chapter(output: &Output, folder: &Path, path: &Path) -> Result<Chapter, Failure> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (file, _, wanted) = study::wanted(output, path, None)?;
    let kept = kept(folder, &name);
    let played = match kept.is_file() {
        false => None,
        true => {
            let played = Played::from_text(&load::text(&kept)?);
            Some(played.map_err(|reason| Failure::file("read", &kept, reason))?)
        }
    };
    Ok(Chapter { name, command: format!("avastra study {}", path.shown()), file, wanted, played })
}

/// Where a played study is kept.
fn kept(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.jsonl"))
}

/// The study that a directory was played for: the one that asks the same question.
fn chapter_of<'a>(
    chapters: &'a mut [Chapter],
    directory: &Path,
    played: &Played,
) -> Result<&'a mut Chapter, Failure> {
    let question = &played.settings.question;
    let mut found = chapters.iter_mut().filter(|chapter| chapter.file.question == *question);
    let (Some(chapter), None) = (found.next(), found.next()) else {
        let question = question.as_deref().unwrap_or_default();
        return Err(Failure::file(
            "add",
            directory,
            format!("not one of the studies alone asks its question, `{question}`"),
        ));
    };
    Ok(chapter)
}

/// The same without the paths of the machine that played it.
fn as_from_file(played: Played, chapter: &Chapter) -> Played {
    let mut settings = played.settings;
    settings.conditions.space = chapter.file.space.clone();
    if let Some(attached) = &mut settings.conditions.external {
        attached.settings.working_directory = None;
    }
    Played { settings, ..played }
}
