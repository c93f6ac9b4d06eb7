//! Scenarios to look at: `render`, `report` and `replay` show them even if their space, engine or settings have changed.
//!
//! A run, a training and an estimate keep a copy of their space. A scenario whose space has changed is played in that copy,
//! as it was recorded. Without a copy it is played in the present space, and the digest of its trace tells whether that is
//! the recorded episode. Either way a banner says what has changed, and how to bring the scenario along. `test`, `shrink`,
//! `diagnose` and `export` judge by the space or pass it on. They refuse a scenario whose space has changed, and say where
//! the copy of the space is.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::run::{self, RunError};
use avastra_lang::check::{Loaded, normal};
use avastra_lang::model::{Scenario, code};
use avastra_lang::syntax::ast::{Expr, ExprKind, FileId};
use avastra_lang::syntax::{Diagnostic, apply_fixes, print_expr};
use avastra_world::action::ActionTable;

use super::error::Failure;
use super::load;
use super::output::{Output, plural};
use super::pack::SPACE;
use super::review::as_now;

/// Advice on how a scenario is brought along.
const BRING_ALONG: &str = "`avastra test --review` says what the change means for it, and `--accept` takes it over; \
                           `avastra run --self-contained` and `avastra export --to ava` keep scenarios and their space together";

/// A scenario to look at.
pub struct Looked {
    pub table: ActionTable,
    pub scenario: Scenario,
    /// The changes since it was written; `None` if there are none.
    pub changed: Option<Changed>,
}

/// The changes since a scenario was written, and how it is shown.
pub struct Changed {
    what: Vec<String>,
    /// The copy of its space in which it is played as it was recorded.
    copy: Option<PathBuf>,
}

impl Changed {
    /// The banner. `is_same` tells whether what was played is the recorded episode, if that can be told.
    pub fn banner(&self, is_same: Option<bool>) -> String {
        let shown = match (&self.copy, is_same) {
            (Some(copy), None | Some(true)) => {
                format!("shown as it was recorded, in the copy of its space at `{}`", copy.shown())
            }
            (None, Some(true)) => "it still plays as it was recorded, to the bit".to_owned(),
            (_, Some(false)) => "what is shown is what plays now, not what was recorded".to_owned(),
            (None, None) => "what is shown is what plays now, which need not be what was recorded".to_owned(),
        };
        format!("{}; {shown}. {BRING_ALONG}", self.what.join("; "))
    }
}

/// Banners of files; files with the same banner share one.
pub fn together(banners: impl IntoIterator<Item = (String, String)>) -> Vec<String> {
    let mut told: Vec<(String, String, usize)> = Vec::new();
    for (file, banner) in banners {
        match told.iter_mut().find(|(_, known, _)| *known == banner) {
            Some((_, _, files)) => *files += 1,
            None => told.push((file, banner, 1)),
        }
    }
    let in_words = |(file, banner, files): (String, String, usize)| match files {
        1 => format!("{file}: {banner}"),
        more => format!("{file} and {}: {banner}", plural(more - 1, "other scenario")),
    };
    told.into_iter().map(in_words).collect()
}

/// The scenario of a file, also if its space, the engine or the settings that it names have changed since.
///
/// # Errors
/// If the file cannot be read, has no scenario, or has no meaning any more.
pub fn scenario(output: &Output, path: &Path) -> Result<Looked, Failure> {
    scenario_in(output, path, load::read_and_check(path)?)
}

/// As [`scenario`], of a file that was read and checked.
pub fn scenario_in(output: &Output, path: &Path, loaded: Loaded) -> Result<Looked, Failure> {
    let mut changed = Changed { what: Vec::new(), copy: None };
    let loaded = match loaded.diagnostics.iter().any(Diagnostic::is_error) {
        false => loaded,
        true => match kept(path, &loaded) {
            Some((copy, kept)) => {
                changed = Changed { what: vec![meaning_text(&loaded)], copy: Some(copy) };
                kept
            }
            None if is_outdated(&loaded) => {
                changed.what.push(meaning_text(&loaded));
                as_it_is_now(path, &loaded)?.1
            }
            None => loaded,
        },
    };
    let (table, mut scenario) = load::scenario_in(output, path, loaded)?;
    let mut beside = as_now(&mut scenario);
    if matches!(run::recorded(&scenario), Err(RunError::ProfileDigest { .. })) {
        scenario.origin.profile_digest = None;
        beside.push("the settings of its driving system mean something else by now".to_owned());
    }
    if !beside.is_empty() {
        // Even in the copy of its space it may play otherwise.
        changed.copy = None;
    }
    changed.what.extend(beside);
    let changed = (!changed.what.is_empty()).then_some(changed);
    Ok(Looked { table, scenario, changed })
}

/// The scenario of a file for a command that needs its space as it was. If that has changed, the help says how the command
/// can have it: in the copy that is kept, if there is one.
///
/// # Errors
/// If the file cannot be read, has no scenario, or does not mean what it meant.
pub fn unchanged(output: &Output, path: &Path) -> Result<(ActionTable, Scenario), Failure> {
    let mut loaded = load::read_and_check(path)?;
    let place = |is: &dyn Fn(&Diagnostic) -> bool| loaded.diagnostics.iter().position(is);
    let outdated = place(&|found| found.is_error() && found.code == code::DIGEST);
    if let Some(mistake) = outdated.or_else(|| place(&Diagnostic::is_error)) {
        let restore = format!(
            "get back the files as they were: no copy of them is kept beside the scenario. {BRING_ALONG}"
        );
        if let Some(help) = in_copy(path, &loaded).or_else(|| outdated.map(|_| restore)) {
            loaded.diagnostics[mistake].help = Some(help);
        }
    }
    load::scenario_in(output, path, loaded)
}

/// How a scenario whose space has changed is played in the copy of it; `None` without a copy.
fn in_copy(path: &Path, loaded: &Loaded) -> Option<String> {
    let (copy, _) = kept(path, loaded)?;
    let written = load::relative(path.parent().unwrap_or(Path::new("")), &copy).ok()?;
    Some(format!(
        "its space is kept as it was at `{}`: write `use \"{written}\"` with the same digest, and it is played there. \
         {BRING_ALONG}",
        copy.shown()
    ))
}

/// The first mistake of a file that cannot be played, in words.
pub fn first_mistake(path: &Path) -> Option<String> {
    let loaded = load::read_and_check(path).ok()?;
    let first = loaded.diagnostics.iter().find(|found| found.is_error())?;
    let note = first.notes.first().map_or_else(String::new, |note| format!("; {note}"));
    Some(format!("{}{note}", first.message))
}

/// The text of the file with the digest of the present space, and the file checked in it.
pub fn as_it_is_now(path: &Path, loaded: &Loaded) -> Result<(String, Loaded), Failure> {
    let root = FileId::default();
    let (text, _) = apply_fixes(root, loaded.sources.text(root), &loaded.diagnostics);
    let mut checked = load::check_text(path, &text)?;
    for mistake in &mut checked.diagnostics {
        mistake.notes.push("the space has changed since the scenario was written".to_owned());
    }
    Ok((text, checked))
}

/// The path of a copy of the scenario's space as it was when the scenario was written, and the file checked in it. A run or an estimate
/// keeps such a copy in its folder `space`; `--self-contained` and `export --to ava` put one beside the scenarios.
fn kept(path: &Path, loaded: &Loaded) -> Option<(PathBuf, Loaded)> {
    let root = FileId::default();
    let written: Vec<_> = loaded.written_paths().into_iter().filter(|used| used.span.file == root).collect();
    let [used] = written.as_slice() else { return None };
    let folder = path.parent().unwrap_or(Path::new(""));
    let copies = ["", ".."].map(|up| load::below(&normal(&folder.join(up).join(SPACE)))).concat();
    copies.into_iter().filter(|copy| copy.file_name() == used.target.file_name()).find_map(|copy| {
        let written = load::relative(folder, &copy).ok()?;
        let mut text = loaded.sources.text(root).to_owned();
        let written = print_expr(&Expr::built(ExprKind::Text(written)));
        text.replace_range(used.span.start..used.span.end, &written);
        // The digest in the file tells whether it is the space that was meant.
        let found = load::check_text(path, &text).ok()?;
        let is_sound = !found.diagnostics.iter().any(Diagnostic::is_error);
        (is_sound && is_sealed(&found)).then_some((copy, found))
    })
}

/// Whether the file has the digest of its space. Without a digest a copy cannot be told from another space.
fn is_sealed(loaded: &Loaded) -> bool {
    let mut used = loaded.files[0].tree.items.iter().filter_map(|item| item.kind.as_use());
    used.all(|used| used.digest.is_some())
}

/// Whether the only mistakes of a scenario are digests, which `--accept` can renew.
pub fn is_outdated(loaded: &Loaded) -> bool {
    let mut errors = loaded.diagnostics.iter().filter(|found| found.is_error()).peekable();
    errors.peek().is_some() && errors.all(|found| found.code == code::DIGEST && !found.fixes.is_empty())
}

/// The change of the space in words: the first note of the diagnostic, unless that only gives the digest.
pub fn meaning_text(loaded: &Loaded) -> String {
    let mut errors = loaded.diagnostics.iter().filter(|found| found.is_error());
    if errors.any(|found| found.code != code::DIGEST) {
        return "its space cannot be read any more, or has mistakes".to_owned();
    }
    let notes = loaded.diagnostics.iter().filter(|found| found.code == code::DIGEST);
    let notes: Vec<String> = notes.filter_map(|found| found.notes.split_last()?.1.first().cloned()).collect();
    let what = if notes.is_empty() { String::new() } else { format!(": {}", notes.join("; ")) };
    format!("the space means something else by now{what}")
}
