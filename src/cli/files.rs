//! Writing files.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::OFlag;

use crate::ads::external;
use crate::episode::EpisodeLog;
use crate::model::digest;

use super::error::Failure;
use super::load;
use super::load::answers_path;

/// Longest name of a file that common file systems take, in bytes.
const NAME_BYTES_MAX: usize = 255;

/// Refuses a file by its name before work begins, so that nobody's scenario or database is written over by mistake. A pipe
/// or a device may have any name.
pub fn must_end_in(path: &Path, extension: &str) -> Result<(), Failure> {
    let is_device = path.exists() && !path.is_file();
    if is_device || path.extension().is_some_and(|found| found == extension) {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "`{}` must end in `.{extension}`: choose such a name for what is written",
        path.display()
    )))
}

/// Writes a file completely or not at all: after a kill or a loss of power the old one or the new one is there. A
/// symbolic link is followed; what is no regular file (a pipe, a terminal, the null device) is written to and not
/// replaced.
pub fn write(path: &Path, text: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    let followed = std::fs::canonicalize(path);
    if followed.is_err() && path.is_symlink() {
        return Err(Failure::file("write", path, "it is a link to a file that does not exist"));
    }
    let path = followed.as_deref().unwrap_or(path);
    let failed = |error| Failure::file("write", path, error);
    if path.exists() && !path.is_file() {
        let _reader = is_read(path).map_err(failed)?;
        return std::fs::write(path, text).map_err(failed);
    }
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(|error| Failure::file("create", folder, error))?;
    }
    let partial = partial(path);
    let written = File::create(&partial).and_then(|mut file| {
        file.write_all(text.as_ref())?;
        // Without this, a loss of power can leave an empty file under the new name.
        file.sync_all()
    });
    written.map_err(|error| Failure::file("write", &partial, error))?;
    std::fs::rename(&partial, path).map_err(failed)?;
    // Where a folder cannot be synchronised, the name may be lost, but no file is torn.
    let _ = File::open(folder.unwrap_or(Path::new("."))).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Writes a file where nothing is: what is there, or others put there meanwhile, stays.
pub fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(|error| Failure::file("create", folder, error))?;
    }
    let failed = |error| Failure::file("write", path, error);
    let mut file = File::create_new(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => Failure::file("write", path, "something is there already"),
        _ => failed(error),
    })?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(|error| {
        // A part of it would be in the way of the whole.
        let _ = std::fs::remove_file(path);
        failed(error)
    })
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
        for number in 0.. {
            let path = folder.join(format!("avastra-{purpose}-{}-{number}", std::process::id()));
            // It fails where anything has the name, a link included, so nothing is written through what others put there.
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Scratch { path }),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(Failure::file("create", &path, error)),
            }
        }
        unreachable!("there is always a next number")
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What cannot be removed is left to whoever clears the folder for temporary files.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// Removes a file, if it is there.
pub fn remove(file: &Path) -> Result<(), Failure> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Failure::file("remove", file, error))
        }
        _ => Ok(()),
    }
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
        Ok(_) => format!("another map is already at `{}`", target.display()),
        Err(reason) => format!("`{}` is in the place of the map: {reason}", target.display()),
    };
    Err(Failure::usage(format!("{other}: name another folder with `--out`")))
}

/// Asks whether somebody reads from a named pipe: to open one that nobody reads would wait without end. As long as the
/// result lives, the pipe has a writer.
fn is_read(path: &Path) -> std::io::Result<Option<File>> {
    if !std::fs::metadata(path)?.file_type().is_fifo() {
        return Ok(None);
    }
    let opened = File::options().write(true).custom_flags(OFlag::O_NONBLOCK.bits()).open(path);
    opened.map(Some).map_err(|error| match error.raw_os_error() {
        Some(number) if number == Errno::ENXIO as i32 => {
            std::io::Error::other("it is a pipe, and nothing reads from it")
        }
        _ => error,
    })
}

/// Writes the answers of an external driving system beside the scenario of its episode; nothing for others.
pub fn write_answers(scenario: &Path, log: &EpisodeLog) -> Result<(), Failure> {
    match log.conversation.as_deref() {
        Some(conversation) => write(&answers_path(scenario), &external::to_text(&conversation.exchanges)),
        None => Ok(()),
    }
}

/// Where a file is written before it has its name.
fn partial(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let ending = ".partial";
    if name.len() + ending.len() <= NAME_BYTES_MAX {
        return path.with_file_name(format!("{name}{ending}"));
    }
    // As much of the name as there is room for. The digest keeps names apart that begin alike.
    let digest = digest(name.as_bytes());
    let digest = &digest["sha256:".len()..][..16];
    let kept = name.floor_char_boundary(NAME_BYTES_MAX - ending.len() - digest.len() - 1);
    path.with_file_name(format!("{}-{digest}{ending}", &name[..kept]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_names_are_written() {
        let scratch = tempfile::tempdir().unwrap();
        for name in ["a".repeat(255), "ä".repeat(127), "b".repeat(248)] {
            let path = scratch.path().join(&name);
            write(&path, "text").unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), "text");
        }
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 3, "no partial file is left");
    }

    #[test]
    fn a_pipe_that_nobody_reads_is_refused() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("pipe");
        let name = std::ffi::CString::new(path.to_str().unwrap()).unwrap();
        // SAFETY: the name is a string with an end.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        let refused = write(&path, "text").unwrap_err().to_string();
        assert!(refused.contains("nothing reads from it"), "{refused}");
        let reader = std::thread::spawn({
            let path = path.clone();
            move || std::fs::read_to_string(path).unwrap()
        });
        let long = "x".repeat(1 << 20);
        while write(&path, &long).is_err() {
            std::thread::yield_now();
        }
        assert_eq!(reader.join().unwrap(), long);
    }
}
