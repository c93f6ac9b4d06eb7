//! Writing files for the commands: `avastra_campaign::files`, with its errors as failures of a command.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::episode::EpisodeLog;
use avastra_campaign::files;
use avastra_drivers::external;

use super::error::Failure;
use super::load::{self, answers_path, stderr_path};

/// Refuses a file by its name before work begins, so that no scenario or database is overwritten by mistake. A pipe or a
/// device may have any name.
pub fn must_end_in(path: &Path, extension: &str) -> Result<(), Failure> {
    let is_device = path.exists() && !path.is_file();
    if is_device || path.extension().is_some_and(|found| found == extension) {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "`{}` must end in `.{extension}`: choose such a name for what is written",
        path.shown()
    )))
}

/// Writes a file of our own naming, as [`files::write`].
pub fn write(path: &Path, text: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    files::write(path, text.as_ref()).map_err(|error| Failure::file("write", path, error))
}

/// Writes a file that the user named, as [`files::write_named`].
pub fn write_named(path: &Path, text: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    files::write_named(path, text.as_ref()).map_err(|error| Failure::file("write", path, error))
}

/// Writes a file anew that the user named to be changed. It may be a link itself; on the way to it there must be none.
pub fn write_again(path: &Path, text: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    without_links(path)?;
    write_named(path, text)
}

/// Writes a file anew in a folder that the user named, as [`files::write_anew`].
pub fn write_anew(path: &Path, text: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    without_links(path)?;
    files::write_anew(path, text.as_ref()).map_err(|error| Failure::file("write", path, error))
}

/// Refuses a place that the user did not name to be written, as [`files::without_links`].
pub fn without_links(path: &Path) -> Result<(), Failure> {
    files::without_links(path).map_err(|error| Failure::file("write", path, error))
}

/// The path for the result of a command: the user's path, or else our own if no link leads there.
pub fn place(named: Option<&PathBuf>, own: PathBuf) -> Result<PathBuf, Failure> {
    match named {
        Some(path) => Ok(path.clone()),
        None => without_links(&own).map(|()| own),
    }
}

/// Writes the result of a command to the path that the user named, or else to one of our own naming.
pub fn write_result(
    named: Option<&PathBuf>,
    own: &Path,
    text: &(impl AsRef<[u8]> + ?Sized),
) -> Result<(), Failure> {
    named.map_or_else(|| write(own, text), |path| write_named(path, text))
}

/// Writes a new file, as [`files::write_new`].
pub fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    files::write_new(path, text.as_bytes()).map_err(|error| Failure::file("write", path, error))
}

/// A new folder in the one for temporary files, for this process alone. It is removed with all that is in it when this
/// is dropped.
pub struct Scratch {
    pub path: PathBuf,
}

impl Scratch {
    /// # Errors
    /// If no folder can be made there.
    pub fn new(purpose: &str) -> Result<Scratch, Failure> {
        let folder = std::env::temp_dir();
        let id = std::process::id();
        // A name that anything has, a link included, is passed over, so nothing is written through a link.
        Ok(Scratch { path: make_first(|number| folder.join(format!("avastra-{purpose}-{id}-{number}")))? })
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // If it cannot be removed, the system clears it with the other temporary files.
        let _ = files::remove_all(&self.path);
    }
}

/// Makes the first of these folders whose name nothing has yet; numbers begin with 1.
pub fn make_first(numbered: impl Fn(u32) -> PathBuf) -> Result<PathBuf, Failure> {
    for path in (1..).map(numbered) {
        match files::make_new(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(Failure::file("create", &path, error)),
        }
    }
    unreachable!("there is always a next number")
}

/// Removes a file, if it is there.
pub fn remove(file: &Path) -> Result<(), Failure> {
    files::remove(file).map_err(|error| Failure::file("remove", file, error))
}

/// Makes a folder that the user named.
pub fn make(folder: &Path) -> Result<(), Failure> {
    files::make(folder).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => Failure::file("create", folder, "it is a file: name a folder"),
        _ => Failure::file("create", folder, error),
    })
}

/// Makes a folder inside a directory, as [`files::folder`].
pub fn folder(directory: &Path, inside: impl AsRef<Path>) -> Result<PathBuf, Failure> {
    let inside = inside.as_ref();
    files::folder(directory, inside).map_err(|error| Failure::file("use", &directory.join(inside), error))
}

/// Makes the folders on the way to a file, as [`files::make_way`].
pub fn make_way(directory: &Path, file: &Path) -> Result<(), Failure> {
    let way = |error| Failure::file("use", file.parent().unwrap_or(directory), error);
    files::make_way(directory, file).map_err(way)
}

/// Where what is made of a file is written: to the folder that the user named, or else to `own` beside the file.
pub fn target(file: &Path, named: Option<&PathBuf>, own: &str, extension: &str) -> Result<PathBuf, Failure> {
    let beside = || file.parent().unwrap_or(Path::new("")).join(own);
    let stem = file.file_stem();
    let stem = stem.ok_or_else(|| Failure::file("read", file, "it is a folder: name a file in it"))?;
    let target = named.cloned().unwrap_or_else(beside).join(stem).with_added_extension(extension);
    if named.is_none() {
        without_links(&target)?;
    }
    Ok(target)
}

/// Copies a map. Several scenarios share it; nothing else that has its name is overwritten.
pub fn copy_map(map: &Path, target: &Path) -> Result<(), Failure> {
    let text = load::text(map)?;
    let is_free = std::fs::symlink_metadata(target).is_err_and(|error| error.kind() == ErrorKind::NotFound);
    if is_free {
        return write_new(target, &text);
    }
    let other = match load::read(target) {
        Ok(there) if there == text => return Ok(()),
        Ok(_) => format!("another map is already at `{}`", target.shown()),
        Err(reason) => format!("`{}` is in the place of the map: {reason}", target.shown()),
    };
    Err(Failure::usage(format!("{other}: name another folder with `--out`")))
}

/// Writes the answers of an external driving system beside the scenario of its episode; nothing for others.
pub fn write_answers(scenario: &Path, log: &EpisodeLog) -> Result<(), Failure> {
    match log.conversation.as_deref() {
        Some(conversation) => {
            let said = conversation.stderr();
            if !said.is_empty() {
                write(&stderr_path(scenario), &said)?;
            }
            write(&answers_path(scenario), &external::to_text(&conversation.exchanges))
        }
        None => Ok(()),
    }
}
