//! `avastra export --to ava`: scenarios and policies with all that they use, in a folder that can be moved.
//!
//! Spaces and maps go into its folder `space`, where they lie to each other as before. So a packed file has the
//! digest that it had.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::files;
use avastra_lang::check::{Loaded, LoadedFile, WrittenPath, normal, written_paths};
use avastra_lang::syntax::ast::{Expr, ExprKind, FileId};
use avastra_lang::syntax::{Sources, print_expr};

use super::error::Failure;
use super::files::{make_way, write};
use super::load;
use super::output::{Output, plural};

/// The folder of spaces and maps, in the one that can be moved.
pub const SPACE: &str = "space";

/// Copies every file with all that it uses into a folder.
pub fn pack(output: &Output, files: &[PathBuf], folder: &Path) -> Result<(), Failure> {
    let mut plan = Plan::default();
    let mut packed: Vec<PathBuf> = Vec::new();
    for path in files {
        let loaded = load::load(output, path)?;
        let name = path.file_name().ok_or_else(|| Failure::usage("a file has a name"))?;
        let target = folder.join(name);
        let holds_space = loaded.scenario.is_none() && loaded.policy.is_none();
        let Loaded { sources, files, .. } = loaded;
        let mut moves = moves(&files, holds_space, folder)?;
        moves.insert(absolute(path)?, target.clone());
        // The recorded answers of an external driving system lie beside their scenario.
        let answers = load::answers_path(path);
        if answers.is_file() {
            moves.insert(absolute(&answers)?, load::answers_path(&target));
        }
        plan.copy(&sources, &files, &moves)?;
        // A file that is named twice is one file.
        if !packed.contains(&target) {
            packed.push(target);
        }
    }
    plan.carry_out(folder, &|| packed.iter().try_for_each(|target| load::load(output, target).map(drop)))?;
    output.say(&format!("{}: {} with all that they use", folder.shown(), plural(packed.len(), "file")));
    output.result(serde_json::json!({ "files": packed, "left_out": [], "refuted": 0, "failed": [] }));
    Ok(())
}

/// Copies a space with all that it uses into a folder, and returns the path of its copy. Its diagnostics are not printed,
/// because it was read before.
pub fn pack_space(space: &Path, folder: &Path) -> Result<PathBuf, Failure> {
    let (sources, files) = load::files_of(space)?;
    let space = absolute(space)?;
    let moves = moves(&files, true, folder)?;
    let mut plan = Plan::default();
    plan.copy(&sources, &files, &moves)?;
    plan.carry_out(folder, &|| Ok(()))?;
    Ok(moves[&space].clone())
}

/// Where every file and map goes that a file needs, itself included: below the nearest folder that holds them all.
fn moves(
    files: &[LoadedFile],
    holds_space: bool,
    folder: &Path,
) -> Result<BTreeMap<PathBuf, PathBuf>, Failure> {
    let own = files.iter().skip(usize::from(!holds_space)).map(|file| file.path.clone());
    let maps = written_paths(files).into_iter().map(|path| path.target);
    let needed: Vec<PathBuf> = own.chain(maps).map(|path| absolute(&path)).collect::<Result<_, _>>()?;
    let Some(first) = needed.first() else { return Ok(BTreeMap::new()) };
    let mut shared: Vec<Component<'_>> = first.parent().unwrap_or(first).components().collect();
    for path in &needed {
        let parent = path.parent().unwrap_or(path);
        let alike = parent.components().zip(&shared).take_while(|(a, b)| a == *b).count();
        shared.truncate(alike);
    }
    let depth = shared.len();
    let place = |path: &PathBuf| folder.join(SPACE).join(path.components().skip(depth).collect::<PathBuf>());
    Ok(needed.iter().map(|path| (path.clone(), place(path))).collect())
}

/// The files that are to be written: nothing is, before all are known.
#[derive(Default)]
struct Plan {
    texts: BTreeMap<PathBuf, String>,
}

impl Plan {
    /// Adds the files of `moves` at their new places, and in them the new paths of what they use. A file that is there
    /// already must have the same content.
    fn copy(
        &mut self,
        sources: &Sources,
        files: &[LoadedFile],
        moves: &BTreeMap<PathBuf, PathBuf>,
    ) -> Result<(), Failure> {
        let paths = written_paths(files);
        for (from, to) in moves {
            let is_meant = |file: &LoadedFile| absolute(&file.path).is_ok_and(|path| path == *from);
            let text = match files.iter().position(is_meant) {
                Some(index) => {
                    let file = FileId(u32::try_from(index).expect("a file's id is its position"));
                    let own = paths.iter().filter(|path| path.span.file == file);
                    moved(sources.text(file), own, to, moves)?
                }
                None => load::text(from)?,
            };
            let is_equal = match self.texts.get(to) {
                Some(known) => *known == text,
                None => !to.exists() || load::read(to).is_ok_and(|known| known == text),
            };
            if !is_equal {
                return Err(Failure::usage(format!(
                    "`{}` is already there, with another content: name another folder",
                    to.shown()
                )));
            }
            self.texts.insert(to.clone(), text);
        }
        Ok(())
    }

    /// Writes the files that do not exist yet below the folder. If that or the check afterwards fails, it removes them.
    fn carry_out(&self, folder: &Path, check: &dyn Fn() -> Result<(), Failure>) -> Result<(), Failure> {
        let (mut written, mut folders) = (Vec::new(), Vec::new());
        let done = self.texts.iter().filter(|(path, _)| !path.exists()).try_for_each(|(path, text)| {
            let missing = path
                .ancestors()
                .skip(1)
                .take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists());
            folders.extend(missing.map(Path::to_owned));
            make_way(folder, path).and_then(|()| write(path, text)).map(|()| written.push(path))
        });
        done.and_then(|()| check()).inspect_err(|_| {
            // A file that cannot be removed either is left: the failure is told.
            written.iter().for_each(|file| drop(files::remove(file)));
            folders.sort_by_key(|folder| core::cmp::Reverse(folder.components().count()));
            folders.iter().for_each(|folder| drop(files::remove_empty(folder)));
        })
    }
}

/// A file's text with the paths that lead to the new places.
fn moved<'a>(
    text: &str,
    paths: impl Iterator<Item = &'a WrittenPath>,
    to: &Path,
    moves: &BTreeMap<PathBuf, PathBuf>,
) -> Result<String, Failure> {
    let folder = to.parent().unwrap_or(Path::new(""));
    let mut moved = text.to_owned();
    let mut paths: Vec<&WrittenPath> = paths.collect();
    paths.sort_by_key(|path| std::cmp::Reverse(path.span));
    for path in paths {
        let Some(target) = moves.get(&absolute(&path.target)?) else { continue };
        if normal(&folder.join(&path.written)) != normal(target) {
            let now = load::path_between(&normal(folder), &normal(target))?;
            let now = print_expr(&Expr::built(ExprKind::Text(now)));
            moved.replace_range(path.span.start..path.span.end, &now);
        }
    }
    Ok(moved)
}

/// The path from the root of the file system, without `..`; links are not followed, as files name each other
/// without following them.
pub fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    let absolute = std::path::absolute(path).map_err(|error| Failure::file("find", path, error))?;
    Ok(normal(&absolute))
}
