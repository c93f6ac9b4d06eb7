//! Writing files.

use std::path::{Path, PathBuf};

use super::error::Failure;

/// Writes a file completely or not at all: after a kill the old one is still there. A symbolic link is followed;
/// what is no regular file (a pipe, a terminal, the null device) is written to and not replaced.
pub fn write(path: &Path, text: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    let followed = std::fs::canonicalize(path);
    let path = followed.as_deref().unwrap_or(path);
    if path.exists() && !path.is_file() {
        return std::fs::write(path, text).map_err(|error| Failure::file("write", path, error));
    }
    if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).map_err(|error| Failure::file("create", parent, error))?;
    }
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    std::fs::write(&partial, text).map_err(|error| Failure::file("write", &partial, error))?;
    std::fs::rename(&partial, path).map_err(|error| Failure::file("write", path, error))
}
