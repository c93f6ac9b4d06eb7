//! `avastra pack`: scenarios and policies with all that they use, in a folder that can be moved.
//!
//! Spaces and maps go into its folder `space`, where they lie to each other as before. So a packed file has the
//! digest that it had.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use crate::check::{Loaded, WrittenPath, normal};
use crate::syntax::ast::{Expr, ExprKind, FileId};
use crate::syntax::print_expr;

use super::arguments::PackArguments;
use super::error::Failure;
use super::files::write;
use super::load;
use super::output::{Output, plural};

/// The folder of spaces and maps, in the one that can be moved.
pub const SPACE: &str = "space";

/// Copies every file with all that it uses.
pub fn pack(output: &Output, arguments: &PackArguments) -> Result<(), Failure> {
    let folder = &arguments.out;
    let mut packed = Vec::new();
    for path in &arguments.files {
        let loaded = load::load(output, path)?;
        let name = path.file_name().ok_or_else(|| Failure::usage("a file has a name"))?;
        let target = folder.join(name);
        let mut moves = moves(&loaded, folder)?;
        moves.insert(absolute(path)?, target.clone());
        copy(&loaded, &moves)?;
        load::load(output, &target)?;
        packed.push(target);
    }
    output.say(&format!("{}: {} with all that they use", folder.display(), plural(packed.len(), "file")));
    output.result(serde_json::json!({ "directory": folder, "files": packed }));
    Ok(())
}

/// Copies a space with all that it uses into a folder, and returns the path of its copy.
pub fn pack_space(output: &Output, space: &Path, folder: &Path) -> Result<PathBuf, Failure> {
    let loaded = load::load(output, space)?;
    let space = absolute(space)?;
    let moves = moves(&loaded, folder)?;
    copy(&loaded, &moves)?;
    Ok(moves[&space].clone())
}

/// Where every file and map goes that a file needs, itself included: below the nearest folder that holds them all.
fn moves(loaded: &Loaded, folder: &Path) -> Result<BTreeMap<PathBuf, PathBuf>, Failure> {
    let holds_space = loaded.scenario.is_none() && loaded.policy.is_none();
    let files = loaded.files.iter().skip(usize::from(!holds_space)).map(|file| file.path.clone());
    let maps = loaded.written_paths().into_iter().map(|path| path.target);
    let needed: Vec<PathBuf> = files.chain(maps).map(|path| absolute(&path)).collect::<Result<_, _>>()?;
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

/// Writes the files of `moves` at their new places, and in them the new paths of what they use. A file that is there
/// already must have the same content.
fn copy(loaded: &Loaded, moves: &BTreeMap<PathBuf, PathBuf>) -> Result<(), Failure> {
    let paths = loaded.written_paths();
    for (from, to) in moves {
        let index = loaded.files.iter().position(|file| absolute(&file.path).is_ok_and(|path| path == *from));
        let text = match index {
            Some(index) => {
                let file = FileId(u32::try_from(index).expect("a file's id is its position"));
                let own = paths.iter().filter(|path| path.span.file == file);
                moved(loaded.sources.text(file), own, to, moves)?
            }
            None => load::text(from)?,
        };
        match std::fs::read(to) {
            Ok(known) if known == text.as_bytes() => {}
            Ok(_) => {
                return Err(Failure::usage(format!(
                    "`{}` is already there, with another content: name another folder",
                    to.display()
                )));
            }
            Err(_) => write(to, &text)?,
        }
    }
    Ok(())
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
fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    let absolute = std::path::absolute(path).map_err(|error| Failure::file("find", path, error))?;
    Ok(normal(&absolute))
}
