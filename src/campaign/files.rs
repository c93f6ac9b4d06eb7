//! The one place where files and folders are made, replaced, renamed and removed; `tests/it/layers.rs` keeps it so.
//!
//! A directory may be hostile: a cloned repository, a shard or a run from another machine. So four rules hold here:
//!
//! - A file is written under a new name and takes its place by a rename, which replaces a symbolic link and never follows it.
//! - A folder of ours inside a directory is used only if it is a folder and no link.
//! - A name that a database or a file gives must be a [`PlainName`]; otherwise the database or the file is refused.
//! - Where the user named a place to read, nothing is written beside it or in it if a folder on the way there is a link
//!   ([`without_links`]). A place outside a clone, to which a link in it leads, was not named as a place to write.
//!
//! Only a path that the user named to be written (`--out`, `--resume`) is followed wherever it leads ([`write_named`], [`make`]).
//! A file that is to be changed (`fmt`, `check --fix`) is between the two: it may be a link itself, on the way to it there is none.
//! A file that is there keeps its rights, its owner and its further names; a read-only one is refused.
//!
//! A process that changes the directory at the same moment is not guarded against: it has the user's rights already.
//! Files are read in `cli::load`.

use avastra_base::outside::Shown;
use std::collections::BTreeSet;
use std::fs::{File, Metadata, TryLockError};
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt, fchown};
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{LazyLock, Mutex};

use nix::errno::Errno;
use nix::fcntl::OFlag;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use sha2::{Digest, Sha256};

// These need no care. `make` makes a folder that the user named, with those on the way to it. `make_new` makes a folder
// where nothing is. `rename` gives a folder a name that nothing has, or that of an empty folder. `remove_empty` removes
// an empty folder.
pub use std::fs::{create_dir as make_new, create_dir_all as make, remove_dir as remove_empty, rename};

/// Longest name of a file that common file systems take, in bytes.
const NAME_BYTES_MAX: usize = 255;

/// Bytes of two files that are compared at once.
const CHUNK: usize = 32 << 10;

/// Ending of the names of files that are not whole yet.
const ENDING: &str = ".partial";

/// Why a link is not used.
const LINK: &str = "it is a symbolic link, which may lead anywhere: put what it leads to in its place";

/// Eight digits for this machine, because the process numbers of another one say nothing here, and a disk may be shared. Its
/// name tells containers apart, its identity tells machines of one name apart. Where a system has neither, all are one.
static MACHINE: LazyLock<String> = LazyLock::new(|| {
    let mut digest = Sha256::new();
    for file in ["/proc/sys/kernel/hostname", "/etc/machine-id"] {
        let found = std::fs::read(file).unwrap_or_default();
        digest.update(found.len().to_le_bytes());
        digest.update(found);
    }
    digest.finalize().iter().take(4).map(|byte| format!("{byte:02x}")).collect()
});

/// Number of the next temporary file of this process.
static NEXT: AtomicU64 = AtomicU64::new(0);

/// The name of a file or folder inside of a folder: no separator, neither `.` nor `..`, no control character, not empty.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct PlainName(String);

/// A text that is no plain name, or none of a scenario.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotPlain {
    #[error(
        "`{}` is no plain name: a name here has no `/`, `\\` or control character, and is not `.` or `..`",
        name.escape_debug()
    )]
    Anywhere { name: String },
    #[error(
        "`{}` is no name of a scenario: such a name ends in `.ava` and does not begin with `.` or `-`",
        name.escape_debug()
    )]
    Scenario { name: String },
}

impl PlainName {
    /// # Errors
    /// If the text is no plain name.
    pub fn new(name: impl Into<String>) -> std::result::Result<PlainName, NotPlain> {
        let name = name.into();
        let mut parts = Path::new(&name).components();
        // `a/` also has one part, but that part is `a`, which differs from the name.
        let is_one = parts.next() == Some(Component::Normal(name.as_ref())) && parts.next().is_none();
        let is_plain = is_one && !name.contains('\\') && !name.contains(char::is_control);
        if is_plain { Ok(PlainName(name)) } else { Err(NotPlain::Anywhere { name }) }
    }

    /// The name of a file with a scenario. A database from elsewhere could otherwise name a file that a shell or a program
    /// reads, or that a command takes for an option.
    ///
    /// # Errors
    /// If the text is no plain name, does not end in `.ava`, or begins with `.` or `-`.
    pub fn scenario(name: impl Into<String>) -> std::result::Result<PlainName, NotPlain> {
        let name = PlainName::new(name)?;
        let is_scenario = name.ends_with(".ava") && !name.starts_with(['.', '-']);
        if is_scenario { Ok(name) } else { Err(NotPlain::Scenario { name: name.0 }) }
    }
}

impl std::ops::Deref for PlainName {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl AsRef<Path> for PlainName {
    fn as_ref(&self) -> &Path {
        Path::new(&self.0)
    }
}

/// A file or a folder that no other process has as long as this lives. The lock ends with the process however that ends.
pub struct Lock {
    /// Nothing where files cannot be locked, as on some network drives: there is no lock.
    file: Option<File>,
}

impl Lock {
    /// Locks a folder.
    ///
    /// # Errors
    /// If another process has it: [`ErrorKind::WouldBlock`].
    pub fn of_folder(path: &Path) -> Result<Lock> {
        File::open(path).map_or(Ok(Lock { file: None }), Lock::of)
    }

    /// Locks a file of ours, which is made if it is not there.
    ///
    /// # Errors
    /// As [`Lock::of_folder`], and if the file is a link or cannot be made.
    pub fn of_file(path: &Path) -> Result<Lock> {
        own_file(path)?;
        Lock::of(File::options().create(true).append(true).custom_flags(OFlag::O_NOFOLLOW.bits()).open(path)?)
    }

    fn of(file: File) -> Result<Lock> {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => Err(ErrorKind::WouldBlock.into()),
            _ => Ok(Lock { file: Some(file) }),
        }
    }

    /// Whether what is locked has this path. It may have been removed before it was locked.
    pub fn is_at(&self, path: &Path) -> bool {
        let locked = self.file.as_ref().and_then(|file| file.metadata().ok());
        let there = std::fs::symlink_metadata(path).ok();
        locked.zip(there).is_some_and(|(one, other)| (one.dev(), one.ino()) == (other.dev(), other.ino()))
    }
}

/// A new file beside its destination. Dropping this removes the file unless it was moved to the destination.
pub struct Temporary {
    path: PathBuf,
    is_placed: bool,
}

impl Temporary {
    /// Makes the file under a name that nothing has, so that neither links nor files that other processes write are touched.
    /// The first one in a folder sweeps it.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn beside(destination: &Path) -> Result<(Temporary, File)> {
        sweep_once(folder_of(destination));
        let name = destination.file_name().ok_or_else(|| Error::other("the path has no name"))?;
        let name = name.to_string_lossy();
        loop {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let ending = format!(".{}-{}-{number}{ENDING}", *MACHINE, std::process::id());
            let kept = name.floor_char_boundary(NAME_BYTES_MAX - ending.len());
            let path = destination.with_file_name(format!("{}{ending}", &name[..kept]));
            match File::create_new(&path) {
                // A killed process with the same number may have left it.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                made => {
                    let file = made?;
                    return Ok((Temporary { path, is_placed: false }, file));
                }
            }
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file the name of the destination and replaces what has that name; if that is a link, the link itself.
    ///
    /// # Errors
    /// If that is not possible, because a folder has the name for example.
    pub fn take_place_of(mut self, destination: &Path) -> Result<()> {
        std::fs::rename(&self.path, destination)?;
        self.is_placed = true;
        // Where a folder cannot be synchronised, the old file may come back after a loss of power; it is whole, too.
        let _ = File::open(folder_of(destination)).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.is_placed {
            // The failure before this is reported; that the file could not be removed would add nothing.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Writes a file in an existing folder, completely or not at all: after a kill or a loss of power either the old or the new
/// file is there. A file or a link of that name is replaced; a link is not followed.
///
/// # Errors
/// If it cannot be written; then nothing of it is left.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let (temporary, mut file) = Temporary::beside(path)?;
    file.write_all(bytes)?;
    // Without this, a loss of power can leave an empty file under the new name.
    file.sync_all()?;
    drop(file);
    temporary.take_place_of(path)
}

/// Writes a file that the user named. Its folders are made, and a symbolic link is followed. A file that is there keeps its
/// rights, its owner and its further names. A pipe, a terminal or the null device is written to and not replaced.
///
/// # Errors
/// As [`write()`], and if the file that is there is read-only.
pub fn write_named(path: &Path, bytes: &[u8]) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_file() => return write_over(&std::fs::canonicalize(path)?, &found, bytes),
        Ok(_) => {
            let _reader = is_read(path)?;
            return std::fs::write(path, bytes);
        }
        Err(_) if path.is_symlink() => {
            return Err(Error::other("it is a link to a file that does not exist"));
        }
        Err(_) => {}
    }
    make(folder_of(path))?;
    write(path, bytes)
}

/// Writes a file anew that lies in a folder which the user named. It keeps its rights and its owner; if there is none, it is made.
///
/// # Errors
/// As [`write_named`], and if it is a link or has further names: who put it there need not be the user.
pub fn write_anew(path: &Path, bytes: &[u8]) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if found.is_file() && found.nlink() == 1 => write_over(path, &found, bytes),
        Ok(_) => {
            Err(Error::other("it is a link, or has further names: name the file itself to have it written"))
        }
        Err(_) => write(path, bytes),
    }
}

/// Writes a file anew. Where another file in its place would be less than it was, because it has further names or another owner,
/// the file itself is written: then a kill can leave it half written.
fn write_over(path: &Path, found: &Metadata, bytes: &[u8]) -> Result<()> {
    // An administrator of the system may write it all the same.
    if found.permissions().readonly() {
        return Err(Error::other("it is read-only"));
    }
    let mut there = File::options().write(true).open(path)?;
    let (temporary, mut file) = Temporary::beside(path)?;
    let is_alike = found.nlink() == 1 && fchown(&file, Some(found.uid()), Some(found.gid())).is_ok();
    // Before there is anything to read in it.
    file.set_permissions(found.permissions())?;
    file.write_all(bytes)?;
    file.sync_all()?;
    if is_alike {
        return temporary.take_place_of(path);
    }
    // That the disk has room for it was tried with the other file, which goes now.
    drop((temporary, file));
    there.write_all(bytes)?;
    there.set_len(bytes.len() as u64)?;
    there.sync_all()
}

/// Writes a new file. A file or a link that is there already stays as it is.
///
/// # Errors
/// If something is there, or the file cannot be written; then nothing of it is left.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = File::create_new(path).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => Error::other("something is there already"),
        _ => error,
    })?;
    file.write_all(bytes).and_then(|()| file.sync_all()).inspect_err(|_| {
        // A partial file would make the next attempt fail.
        let _ = std::fs::remove_file(path);
    })
}

/// Removes a file if it is there; if it is a link, the link itself.
///
/// # Errors
/// If it is there and cannot be removed.
pub fn remove(file: &Path) -> Result<()> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Removes a folder with all that is in it; links in it are removed and not followed.
///
/// # Errors
/// If something cannot be removed.
pub fn remove_all(folder: &Path) -> Result<()> {
    own_folder(folder)?;
    std::fs::remove_dir_all(folder)
}

/// Makes the missing parts of a path of folders inside a directory, and returns the whole path. No part may be a link.
///
/// # Errors
/// If a part is no folder, or cannot be made.
pub fn folder(directory: &Path, inside: impl AsRef<Path>) -> Result<PathBuf> {
    let mut folder = directory.to_owned();
    for part in inside.as_ref().components() {
        let Component::Normal(name) = part else {
            return Err(Error::other("its path leads out of its folder"));
        };
        folder.push(name);
        match std::fs::create_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => own_folder(&folder)?,
            made => made?,
        }
    }
    Ok(folder)
}

/// Makes a directory that the user named, and the folders in it on the way to a file. None of these may be a link.
///
/// # Errors
/// If a part is no folder, or cannot be made.
pub fn make_way(directory: &Path, file: &Path) -> Result<()> {
    let inside = file.strip_prefix(directory).map_err(Error::other)?;
    make(directory)?;
    folder(directory, inside.parent().unwrap_or(Path::new(""))).map(drop)
}

/// Refuses a path of ours at which something else than a regular file is, above all a link. Nothing there is fine.
///
/// # Errors
/// Why it is refused.
pub fn own_file(path: &Path) -> Result<()> {
    own(path, Metadata::is_file, "it is no regular file")
}

/// Refuses a path of ours at which something else than a folder is, above all a link. Nothing there is fine.
///
/// # Errors
/// Why it is refused.
pub fn own_folder(path: &Path) -> Result<()> {
    own(path, Metadata::is_dir, "it is no folder")
}

/// Refuses a path if a folder on the way to it is a link. The path itself may be one. A link in the root of the file system is
/// passed: only the system makes such links, as `/tmp` of some systems.
///
/// # Errors
/// Which folder is a link.
pub fn without_links(path: &Path) -> Result<()> {
    let mut folder = PathBuf::new();
    for part in path.parent().unwrap_or(Path::new("")).components() {
        folder.push(part);
        let is_of_system = folder.parent() == Some(Path::new("/"));
        if folder.is_symlink() && !is_of_system {
            return Err(Error::other(format!(
                "`{}` on the way to it is a symbolic link, which may lead anywhere: name the path that it leads to",
                folder.shown()
            )));
        }
    }
    Ok(())
}

/// The first bytes of a file: fewer if it is shorter, none if nothing is there.
///
/// # Errors
/// If it is there and cannot be read.
pub fn first_bytes(path: &Path, count: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    match File::open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        opened => {
            opened?.take(count).read_to_end(&mut bytes)?;
        }
    }
    Ok(bytes)
}

/// Refuses a file that has further names. SQLite writes into its journal, and another name of it may be a file of the user's.
///
/// # Errors
/// If it has.
pub fn without_further_names(path: &Path) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if found.nlink() > 1 => Err(Error::other(
            "it has a further name (hard link), which may be another file of yours: remove it",
        )),
        _ => Ok(()),
    }
}

/// Whether two regular files hold the same bytes. Anything else, a link for example, is equal to nothing.
///
/// # Errors
/// If one of them is not there or cannot be read.
pub fn are_equal(one: &Path, other: &Path) -> Result<bool> {
    let length = |path| std::fs::symlink_metadata(path).map(|found| found.is_file().then_some(found.len()));
    let (one_long, other_long) = (length(one)?, length(other)?);
    let Some(length) = one_long.filter(|_| one_long == other_long) else { return Ok(false) };
    let mut files = [File::open(one)?, File::open(other)?];
    let mut read = [[0; CHUNK], [0; CHUNK]];
    let mut left = length;
    while left > 0 {
        let next = left.min(CHUNK as u64) as usize;
        for (file, bytes) in files.iter_mut().zip(&mut read) {
            file.read_exact(&mut bytes[..next])?;
        }
        if read[0][..next] != read[1][..next] {
            return Ok(false);
        }
        left -= next as u64;
    }
    Ok(true)
}

fn own(path: &Path, fits: fn(&Metadata) -> bool, otherwise: &'static str) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(()),
        Err(error) => Err(error),
        Ok(found) if found.is_symlink() => Err(Error::other(LINK)),
        Ok(found) if fits(&found) => Ok(()),
        Ok(_) => Err(Error::other(otherwise)),
    }
}

/// Whether this is the name of a temporary file for a file named `of`.
pub fn is_partial(name: &str, of: &str) -> bool {
    name.strip_prefix(of).is_some_and(|rest| rest.starts_with('.') && rest.ends_with(ENDING))
}

/// Whether this is the name of a temporary file, of whatever file, process and machine.
pub fn is_temporary(name: &str) -> bool {
    maker_of(name).is_some()
}

/// Removes the temporary files that killed processes of this machine left in a folder. Those of running processes stay, and
/// those of other machines, of which it is not known whether they run.
///
/// # Errors
/// If the folder cannot be read, or a file cannot be removed.
pub fn sweep(folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let maker = name.to_str().and_then(maker_of);
        let is_left = maker.is_some_and(|(machine, process)| machine == *MACHINE && !runs(process));
        if is_left && entry.file_type().is_ok_and(|kind| kind.is_file()) {
            remove(&entry.path())?;
        }
    }
    Ok(())
}

/// As [`sweep`], in the folders within, too. Links are not followed.
///
/// # Errors
/// As [`sweep`].
pub fn sweep_all(folder: &Path) -> Result<()> {
    sweep(folder)?;
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sweep_all(&entry.path())?;
        }
    }
    Ok(())
}

/// Sweeps a folder if this process has not done so yet. A file that cannot be removed stays: nothing rests on it.
fn sweep_once(folder: &Path) {
    static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let is_new = SWEPT.lock().is_ok_and(|mut swept| swept.insert(folder.to_owned()));
    if is_new {
        let _ = sweep(folder);
    }
}

/// The machine and the number of the process that made a temporary file, from the file's name.
fn maker_of(name: &str) -> Option<(&str, i32)> {
    // SQLite keeps a journal beside a database while it is written.
    let name = name.strip_suffix("-journal").unwrap_or(name);
    let (_, numbers) = name.strip_suffix(ENDING)?.rsplit_once('.')?;
    let (machine, numbers) = numbers.split_once('-')?;
    let (process, number) = numbers.split_once('-')?;
    number.parse::<u64>().ok()?;
    let is_machine = machine.len() == MACHINE.len() && machine.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_machine.then_some((machine, process.parse().ok()?))
}

fn runs(process: i32) -> bool {
    // Without a signal, `kill` only tells whether the process exists.
    kill(Pid::from_raw(process), None::<Signal>) != Err(Errno::ESRCH)
}

/// The folder of a path, as a path that can be opened.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Refuses a named pipe without a reader, because opening it would wait without end. As long as the result lives, the pipe
/// has a writer.
fn is_read(path: &Path) -> Result<Option<File>> {
    if !std::fs::metadata(path)?.file_type().is_fifo() {
        return Ok(None);
    }
    let opened = File::options().write(true).custom_flags(OFlag::O_NONBLOCK.bits()).open(path);
    opened.map(Some).map_err(|error| match error.raw_os_error() {
        Some(number) if number == Errno::ENXIO as i32 => {
            Error::other("it is a pipe, and nothing reads from it")
        }
        _ => error,
    })
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn plain_names_stay_in_their_folder() {
        for plain in ["a", "corner_0004.ava", "ä ö", ".hidden", "..."] {
            assert_eq!(&*PlainName::new(plain).unwrap(), plain);
        }
        for other in
            ["", ".", "..", "/", "/a", "a/", "a/b", "../a", "./a", "a\\b", "a\nb", "a\0", "\u{1b}[2J"]
        {
            assert!(PlainName::new(other).is_err(), "{other:?}");
        }
    }

    #[test]
    fn scenarios_have_names_that_only_scenarios_have() {
        assert_eq!(&*PlainName::scenario("corner_0004.ava").unwrap(), "corner_0004.ava");
        for other in [".bashrc", "x.sh", "estimate.yaml", "-rf.ava", ".ava", "a/b.ava", "x.AVA", ""] {
            assert!(PlainName::scenario(other).is_err(), "{other:?}");
        }
    }

    #[test]
    fn the_longest_names_are_written_and_nothing_else_is_left() {
        let scratch = tempfile::tempdir().unwrap();
        for name in ["a".repeat(255), "ä".repeat(127), "b".repeat(248)] {
            let path = scratch.path().join(&name);
            write(&path, b"text").unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), "text");
        }
        std::fs::create_dir(scratch.path().join("folder")).unwrap();
        assert!(write(&scratch.path().join("folder"), b"text").is_err());
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 4, "no partial file is left");
    }

    #[test]
    fn folders_of_ours_are_no_links_and_lie_inside() {
        let scratch = tempfile::tempdir().unwrap();
        let at = |name: &str| scratch.path().join(name);
        std::fs::create_dir(at("elsewhere")).unwrap();
        std::os::unix::fs::symlink("elsewhere", at("folder")).unwrap();
        for refused in ["folder", "folder/inner", "../out"] {
            assert!(folder(scratch.path(), refused).is_err(), "{refused}");
        }
        assert!(remove_all(&at("folder")).is_err());
        assert_eq!(std::fs::read_dir(at("elsewhere")).unwrap().count(), 0);
        make_way(&at("made"), &at("made/x/y.ava")).unwrap();
        assert!(at("made/x").is_dir() && !at("made/x/y.ava").exists());
    }

    #[test]
    fn no_folder_on_the_way_is_a_link() {
        let scratch = tempfile::tempdir().unwrap();
        // The folder for temporary files may itself lie behind links.
        let clone = scratch.path().canonicalize().unwrap();
        std::fs::create_dir_all(clone.join("run/own")).unwrap();
        for (target, link) in [("own", "run/link"), ("own/x", "run/x"), ("/tmp", "run/system")] {
            std::os::unix::fs::symlink(target, clone.join(link)).unwrap();
        }
        for passed in ["run/x", "run/link", "run/own/x", "run/./own/../own/x", "run/missing/x"] {
            without_links(&clone.join(passed)).unwrap();
        }
        for refused in ["run/link/x", "run/link/./x", "run/link/../x", "run//link//own/x", "run/system/x"] {
            let error = without_links(&clone.join(refused)).unwrap_err().to_string();
            assert!(error.contains("is a symbolic link"), "{refused}: {error}");
        }
        for passed in ["", "x", "/x", "/tmp/x", "../x"] {
            without_links(Path::new(passed)).unwrap();
        }
    }

    #[test]
    fn a_file_that_is_written_again_keeps_what_it_was() {
        let scratch = tempfile::tempdir().unwrap();
        let at = |name: &str| scratch.path().join(name);
        let set =
            |name: &str, mode| std::fs::set_permissions(at(name), Permissions::from_mode(mode)).unwrap();
        let mode = |name: &str| std::fs::metadata(at(name)).unwrap().permissions().mode() & 0o7777;
        for (name, bits) in [("private", 0o600), ("run", 0o755), ("open", 0o666)] {
            std::fs::write(at(name), "a longer text").unwrap();
            set(name, bits);
            write_named(&at(name), b"text").unwrap();
            assert_eq!((mode(name), std::fs::read_to_string(at(name)).unwrap()), (bits, "text".to_owned()));
        }
        std::fs::hard_link(at("private"), at("further")).unwrap();
        std::os::unix::fs::symlink("further", at("link")).unwrap();
        write_named(&at("link"), b"new").unwrap();
        assert_eq!(std::fs::read_to_string(at("private")).unwrap(), "new");
        assert!(at("link").is_symlink() && mode("private") == 0o600);
        set("private", 0o400);
        assert!(write_named(&at("link"), b"other").unwrap_err().to_string().contains("read-only"));
        assert_eq!(std::fs::read_to_string(at("further")).unwrap(), "new");
        assert_eq!(std::fs::read_dir(scratch.path()).unwrap().count(), 5, "no partial file is left");
    }

    #[test]
    fn files_are_compared_by_what_they_hold() {
        let scratch = tempfile::tempdir().unwrap();
        let at = |name: &str| scratch.path().join(name);
        let long = vec![7; CHUNK * 2 + 3];
        let other = [&long[1..], &[8]].concat();
        for (name, bytes) in [("a", &long), ("b", &long), ("c", &other), ("d", &Vec::new())] {
            std::fs::write(at(name), bytes).unwrap();
        }
        std::os::unix::fs::symlink("/dev/zero", at("zero")).unwrap();
        let equal = |one: &str, other: &str| are_equal(&at(one), &at(other)).unwrap();
        assert!(equal("a", "b") && equal("d", "d"));
        assert!(!equal("a", "c") && !equal("a", "d") && !equal("zero", "zero") && !equal("a", "zero"));
        assert!(are_equal(&at("a"), &at("e")).is_err());
    }

    #[test]
    fn a_lock_is_had_once() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("mark");
        let lock = Lock::of_file(&path).unwrap();
        assert_eq!(Lock::of_file(&path).err().unwrap().kind(), ErrorKind::WouldBlock);
        assert!(lock.is_at(&path));
        std::fs::remove_file(&path).unwrap();
        assert!(!lock.is_at(&path));
        assert!(Lock::of_file(&path).unwrap().is_at(&path));
        std::os::unix::fs::symlink("nowhere", scratch.path().join("link")).unwrap();
        assert!(Lock::of_file(&scratch.path().join("link")).is_err());
        let folder = Lock::of_folder(scratch.path()).unwrap();
        assert!(Lock::of_folder(scratch.path()).is_err());
        drop(folder);
        assert!(Lock::of_folder(scratch.path()).is_ok());
    }

    #[test]
    fn what_the_dead_left_is_swept_away() {
        let scratch = tempfile::tempdir().unwrap();
        let own = format!("run.db.{}-{}-7.partial", *MACHINE, std::process::id());
        // No process has so high a number.
        let left = ["", "-journal"].map(|more| format!("run.db.{}-2147483647-0.partial{more}", *MACHINE));
        // The first is of another machine, the others only look like one.
        let others = ["run.db.0-2147483647-0.partial", "notes.partial", "x.2147483647.partial"];
        let others = others.map(str::to_owned);
        for name in [&own].into_iter().chain(&others).chain(&left) {
            std::fs::write(scratch.path().join(name), "").unwrap();
        }
        sweep(scratch.path()).unwrap();
        let kept: Vec<_> =
            std::fs::read_dir(scratch.path()).unwrap().flatten().map(|entry| entry.file_name()).collect();
        assert_eq!(kept.len(), 4, "{kept:?}");
        assert!(is_temporary(&own) && is_temporary(&left[1]) && !is_temporary("notes.partial"));
        std::fs::create_dir_all(scratch.path().join("a/b")).unwrap();
        std::fs::write(scratch.path().join("a/b").join(&left[0]), "").unwrap();
        sweep_all(scratch.path()).unwrap();
        assert_eq!(std::fs::read_dir(scratch.path().join("a/b")).unwrap().count(), 0);
        assert!(is_partial(&own, "run.db") && is_partial("run.yaml.partial", "run.yaml"));
        assert!(!is_partial("run.yaml", "run.yaml") && !is_partial("other.partial", "run.yaml"));
    }

    #[test]
    fn a_pipe_that_nobody_reads_is_refused() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("pipe");
        let name = std::ffi::CString::new(path.to_str().unwrap()).unwrap();
        // SAFETY: the name is a string with an end.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        let refused = write_named(&path, b"text").unwrap_err().to_string();
        assert!(refused.contains("nothing reads from it"), "{refused}");
        let reader = std::thread::spawn({
            let path = path.clone();
            move || std::fs::read_to_string(path).unwrap()
        });
        let long = "x".repeat(1 << 20);
        while write_named(&path, long.as_bytes()).is_err() {
            std::thread::yield_now();
        }
        assert_eq!(reader.join().unwrap(), long);
    }
}
