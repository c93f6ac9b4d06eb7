//! Loads files for the commands. Each file is read and checked, and its diagnostics are printed. A command gets a table,
//! a scenario, a policy or a profile, or an error.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use avastra_base::outside::Shown;
use avastra_campaign::run::{self, Asked, Profile, RunError, driving_system};
use avastra_drivers::external::{Attached, ExternalSettings, Target};
use avastra_drivers::{EXTERNAL, ModularConfig, REGISTRY};
use avastra_lang::check::{self, KnownSpaces, Loaded, LoadedFile, ReadError};
use avastra_lang::model::{Policy, Scenario, Space};
use avastra_lang::syntax::{Sources, nearest, read_yaml};
use avastra_world::action::ActionTable;
use avastra_world::places::{self, Scenes};
use avastra_world::sim::TrafficProfile;

use super::error::Failure;
use super::output::{Output, for_shell};

/// In a directory with more files than this, a file that declares a missing name is too weak a hint.
const NEARBY_MAX: usize = 32;

/// Neighbours are read for a hint as long as they come to no more than this together.
const NEARBY_BYTES_MAX: u64 = 256 << 10;

/// Files and folders that are looked at in search of source files.
const ENTRIES_MAX: usize = 20_000;

/// Folders of build outputs.
const PASSED_OVER: [&str; 2] = ["target", "node_modules"];

/// Why a path cannot be used: it would be written into files, which are text.
const NOT_UTF8: &str = "the path is not UTF-8; rename it";

/// Larger files are refused: neither people nor our commands write them. Maps of whole towns have some 20 MiB.
const FILE_BYTES_MAX: u64 = 64 << 20;

/// Larger sources are refused: the policy of a network with 500,000 weights has 2.7 MiB.
const SOURCE_BYTES_MAX: u64 = 4 << 20;

thread_local! {
    /// Spaces that scenarios use, and maps: each thread reads the space of a suite once. A command that changes a file which others use
    /// calls [`forget`].
    static KNOWN: RefCell<KnownSpaces> = RefCell::default();
}

/// Reads and checks a file with everything that it uses. Diagnostics are printed.
///
/// # Errors
/// If the file cannot be read, or the source has mistakes.
pub fn load(output: &Output, path: &Path) -> Result<Loaded, Failure> {
    // If the root file is missing, the command fails; that is no mistake in a source.
    sound(output, read_and_check(path)?)
}

/// Prints the diagnostics of a file.
fn sound(output: &Output, loaded: Loaded) -> Result<Loaded, Failure> {
    output.diagnostics(&loaded.sources, &loaded.diagnostics);
    without_mistakes(loaded)
}

/// Passes a file on if it has no mistakes. Its diagnostics are not printed here.
pub fn without_mistakes(loaded: Loaded) -> Result<Loaded, Failure> {
    match loaded.diagnostics.iter().filter(|diagnostic| diagnostic.is_error()).count() {
        0 => Ok(loaded),
        errors => Err(Failure::Source { errors }),
    }
}

/// Reads and checks a file. For a missing name, the diagnostic names a nearby file that declares it.
pub fn read_and_check(path: &Path) -> Result<Loaded, Failure> {
    check_read(path, &reader(path))
}

/// Forgets what this thread has read: files may have changed since.
pub fn forget() {
    KNOWN.take();
}

/// Reads the file that the user named, and those that it uses.
fn reader(path: &Path) -> impl Fn(&Path) -> Result<String, ReadError> {
    let own = check::normal(path);
    move |other| if other == own { read(other) } else { read_used(other) }
}

/// Does the same for a file that has another text than the one on the disk.
///
/// # Errors
/// If the file has no path.
pub fn check_text(path: &Path, text: &str) -> Result<Loaded, Failure> {
    let own = check::normal(path);
    check_read(path, &|other| if other == own { Ok(text.to_owned()) } else { read_used(other) })
}

fn check_read(path: &Path, read: &check::ReadFile<'_>) -> Result<Loaded, Failure> {
    let loaded = KNOWN.with_borrow_mut(|known| check::load_among(path, read, known));
    judged(path, loaded)
}

/// The texts and the files of a space that was checked before.
pub fn files_of(space: &Path) -> Result<(Sources, Vec<LoadedFile>), Failure> {
    check::read_files(space, &reader(space)).map_err(|error| Failure::file("read", space, error))
}

fn judged(path: &Path, loaded: Result<Loaded, ReadError>) -> Result<Loaded, Failure> {
    let failed = |error| match path.is_dir() {
        true => Failure::file("read", path, name_a_file_in(path)),
        false => Failure::file("read", path, error),
    };
    let mut loaded = loaded.map_err(failed)?;
    places::judge_claims(&mut loaded, &mut Scenes::default());
    if loaded.diagnostics.iter().any(avastra_lang::syntax::Diagnostic::is_error) {
        check::suggest_uses(&mut loaded, &nearby(path));
    }
    Ok(loaded)
}

/// Tells the user what to name in place of a folder: the scenarios of a run, or the sources in the folder.
fn name_a_file_in(folder: &Path) -> String {
    let within = ["critical", "failures", ""].map(|name| folder.join(name));
    match within.iter().find(|folder| sources_in(folder).is_ok_and(|files| !files.is_empty())) {
        Some(folder) => format!("it is a folder: name files in it, as `{}`", folder.join("*.ava").shown()),
        None => FOLDER.to_owned(),
    }
}

/// Other source files in the directory of a file and in the one above, with their paths from the file.
pub fn nearby(path: &Path) -> Vec<(String, String)> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut found = Vec::new();
    let mut bytes_left = NEARBY_BYTES_MAX;
    for prefix in ["", "../"] {
        let directory = Path::new(".").join(folder).join(prefix);
        let Ok(files) = sources_in(&directory) else { continue };
        if files.len() > NEARBY_MAX {
            continue;
        }
        for file in files {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if let Ok(text) = read_up_to(&file, bytes_left) {
                bytes_left -= text.len() as u64;
                found.push((format!("{prefix}{name}"), text));
            }
        }
    }
    found
}

/// Source files in a directory, sorted.
///
/// # Errors
/// If the directory cannot be read, or the name of one of them is not UTF-8.
pub fn sources_in(directory: &Path) -> Result<Vec<PathBuf>, Failure> {
    let files = files_in(directory, "ava").map_err(|error| Failure::file("read", directory, error))?;
    match files.iter().find(|file| file.to_str().is_none()) {
        Some(file) => Err(Failure::file("read", file, NOT_UTF8)),
        None => Ok(files),
    }
}

/// Files with an extension in a directory, sorted.
pub fn files_in(directory: &Path, extension: &str) -> std::io::Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(directory)?.flatten().map(|entry| entry.path()).collect();
    files.retain(|file| file.extension().is_some_and(|found| found == extension));
    files.sort();
    Ok(files)
}

/// Whether a file is one of the language, by its name.
pub fn is_source(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension == "ava")
}

/// Source files below a folder, sorted. Hidden folders and folders of build outputs are passed over, and so
/// is what comes after many entries: a folder so large is no workspace.
pub fn below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    let mut entries_left = ENTRIES_MAX;
    while let Some(folder) = open.pop() {
        let Ok(entries) = std::fs::read_dir(folder) else { continue };
        for entry in entries.flatten() {
            entries_left -= 1;
            if entries_left == 0 {
                return found;
            }
            let name = entry.file_name().to_string_lossy().into_owned();
            // The type of a link is not followed: links may go in a circle.
            match entry.file_type() {
                Ok(kind) if kind.is_dir() && !name.starts_with('.') && !PASSED_OVER.contains(&&*name) => {
                    open.push(entry.path());
                }
                Ok(kind) if kind.is_file() && is_source(&entry.path()) => found.push(entry.path()),
                _ => {}
            }
        }
    }
    found.sort();
    found
}

/// All files of a directory and of the folders in it, by their paths in it.
pub fn everything_in(directory: &Path) -> Result<BTreeMap<PathBuf, PathBuf>, Failure> {
    let mut found = BTreeMap::new();
    let mut open = vec![directory.to_owned()];
    while let Some(folder) = open.pop() {
        let failed = |error| Failure::file("read", &folder, error);
        for entry in std::fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let path = entry.path();
            // A link is not followed: links may go in a circle.
            if entry.file_type().map_err(failed)?.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(directory).expect("it is below").to_owned();
                found.insert(name, path);
            }
        }
    }
    Ok(found)
}

/// The action table of a space file.
///
/// # Errors
/// As [`load`], and if the file declares no action, or is a scenario.
pub fn table(output: &Output, path: &Path) -> Result<ActionTable, Failure> {
    let loaded = load(output, path)?;
    if loaded.scenario.is_some() {
        let (path, word) = (path.shown(), for_shell(path));
        return Err(Failure::usage(format!("`{path}` is a scenario: `avastra replay {word}` plays it")));
    }
    if loaded.policy.is_some() {
        let (path, word) = (path.shown(), for_shell(path));
        return Err(Failure::usage(format!("`{path}` is a policy: `avastra run --policy {word}` plays it")));
    }
    Ok(ActionTable::new(space(loaded, path)?))
}

/// A scenario file: its space's table and its scenario.
///
/// # Errors
/// As [`load`], and if the file has no scenario.
pub fn scenario(output: &Output, path: &Path) -> Result<(ActionTable, Scenario), Failure> {
    scenario_in(output, path, read_and_check(path)?)
}

/// The table and the scenario of a file that was read and checked.
pub fn scenario_in(output: &Output, path: &Path, loaded: Loaded) -> Result<(ActionTable, Scenario), Failure> {
    let mut loaded = sound(output, loaded)?;
    let Some(scenario) = loaded.scenario.take() else {
        let (path, word) = (path.shown(), for_shell(path));
        let hint = match (&loaded.policy, &loaded.space) {
            (Some(_), _) => format!(": it is a policy, and `avastra run --policy {word}` plays it"),
            (None, Some(space)) if !space.actions.is_empty() => {
                format!(": it is a space, and `avastra run {word}` looks for scenarios in it")
            }
            _ => String::new(),
        };
        return Err(Failure::usage(format!("`{path}` has no scenario{hint}")));
    };
    let scenario = with_answers(scenario, path)?;
    Ok((ActionTable::new(space(loaded, path)?), scenario))
}

/// A profile of the `modular` driving system.
///
/// # Errors
/// If the file cannot be read, or is no profile.
pub fn profile(path: &Path) -> Result<ModularConfig, Failure> {
    ModularConfig::from_yaml(&text(path)?).map_err(|error| Failure::file("use", path, error))
}

/// The driving system that a run, a training or a study is to be played against.
pub struct UnderTest {
    pub ads: String,
    pub profile: Option<Profile>,
    pub external: Option<Attached>,
}

/// The driving system of a name, with the profile in a file; without a file, the one that it comes with, if there is
/// one. A command, or a profile with an `ads` block, makes it an external one.
///
/// # Errors
/// If the file cannot be read or is no profile, or the command is none.
pub fn under_test(ads: &str, config: Option<&Path>, command: Option<&str>) -> Result<UnderTest, Failure> {
    if let Some(settings) = external(config, command)? {
        let external = Some(Attached { identity: None, settings, is_recorded: false });
        return Ok(UnderTest { ads: EXTERNAL.to_owned(), profile: None, external });
    }
    let settings = match config {
        Some(path) => Some(profile(path)?),
        None => driving_system(ads).ok().and_then(|ads| ads.profile().copied()),
    };
    Ok(UnderTest { ads: ads.to_owned(), profile: settings.as_ref().map(Profile::new), external: None })
}

/// The value of `--ads`: the name of a driving system of avastra, or else a profile or a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Driver<'a> {
    /// That name; with a profile or a command the default one.
    pub ads: &'a str,
    /// A profile of `modular`, or of an external one.
    pub profile: Option<&'a Path>,
    /// The command or address of an external one.
    pub command: Option<&'a str>,
}

/// Reads a text after `--ads`: an address, a profile (ends like YAML), a command (has a blank or a path), or else a name.
///
/// # Errors
/// If it is a lone word and no name: a typing mistake must not start a program of the search path.
pub fn driver(text: &str) -> Result<Driver<'_>, Failure> {
    let given = Driver { ads: run::DEFAULT_ADS, profile: None, command: None };
    let is_address = text.starts_with("tcp:") || text.starts_with("unix:");
    let has_blank = text.contains(char::is_whitespace);
    // `python3 drive.py --profile fast.yaml` is a command.
    if !is_address && is_yaml(text) && (!has_blank || Path::new(text).is_file()) {
        return Ok(Driver { profile: Some(Path::new(text)), ..given });
    }
    if is_address || has_blank || text.contains(std::path::is_separator) {
        return Ok(Driver { command: Some(text), ..given });
    }
    match driving_system(text) {
        Ok(_) => Ok(Driver { ads: text, ..given }),
        Err(RunError::Ads { name, known }) => {
            let names = REGISTRY.iter().map(|entry| entry.name);
            let near = nearest(&name, names).map_or(String::new(), |near| format!("did you mean `{near}`? "));
            Err(Failure::usage(format!(
                "no driving system `{name}`: {near}there are {known}; a profile ends in `.yaml`, and a command has a path or \
                 arguments, as `./{name}`"
            )))
        }
        Err(error) => Err(error.into()),
    }
}

/// The path of the profile that a text after `--ads` gives, if it gives one.
pub fn profile_path(text: &str) -> Option<&Path> {
    driver(text).ok()?.profile
}

/// The driving system under test that `--ads` gives.
pub fn named(text: &str) -> Result<UnderTest, Failure> {
    let Driver { ads, profile, command } = driver(text)?;
    under_test(ads, profile, command)
}

/// The driving system that scenarios are to be played with, in place of the recorded one, if `--ads` is given. An external one
/// is started.
///
/// # Errors
/// As [`named`], and if an external one does not start.
pub fn asked(text: Option<&str>) -> Result<Asked, Failure> {
    let Some(text) = text else { return Ok(Asked::default()) };
    let given = driver(text)?;
    if let Some(settings) = external(given.profile, given.command)? {
        return Ok(Asked { external: Some(run::started(&settings)?), ..Asked::default() });
    }
    match given.profile {
        Some(path) => Ok(Asked { profile: Some(profile(path)?), ..Asked::default() }),
        None => Ok(Asked { ads: Some(given.ads.to_owned()), ..Asked::default() }),
    }
}

/// Whether a text that may be a name or a file is a file: it ends like YAML.
pub fn is_yaml(text: &str) -> bool {
    Path::new(text).extension().is_some_and(|extension| extension == "yaml" || extension == "yml")
}

/// An external driving system, by a command or by the `ads` block of a profile. With both, the command takes precedence
/// over the profile's.
pub fn external(config: Option<&Path>, command: Option<&str>) -> Result<Option<ExternalSettings>, Failure> {
    let target = command.map(|text| {
        Target::from_text(text).map_err(|reason| Failure::usage(format!("cannot start `{text}`: {reason}")))
    });
    let target = target.transpose()?;
    let Some(path) = config else { return Ok(target.map(ExternalSettings::of)) };
    let folder = path.parent().unwrap_or(Path::new(""));
    let settings = ExternalSettings::from_yaml(&text(path)?, folder).transpose();
    let settings = settings.map_err(|error| Failure::file("use", path, error))?;
    match (settings, target) {
        (Some(settings), Some(command)) => Ok(Some(ExternalSettings { command, ..settings })),
        (None, Some(_)) => Err(Failure::usage(format!(
            "`{}` is a profile of `modular`: with a command it must have an `ads` block",
            path.shown()
        ))),
        (settings, None) => Ok(settings),
    }
}

/// The file of the recorded answers of a scenario.
pub fn answers_path(scenario: &Path) -> PathBuf {
    scenario.with_extension("answers.jsonl")
}

/// The file of what the driving system of a scenario wrote to standard error.
pub fn stderr_path(scenario: &Path) -> PathBuf {
    scenario.with_extension("stderr.txt")
}

/// A scenario with the recorded answers of its driving system, if that is an external one and they lie beside it.
fn with_answers(mut scenario: Scenario, path: &Path) -> Result<Scenario, Failure> {
    let answers = answers_path(path);
    if scenario.origin.ads.as_deref() == Some(EXTERNAL) && answers.is_file() {
        scenario.origin.recorded_answers = Some(text(&answers)?.into());
    }
    Ok(scenario)
}

/// The traffic profile of that name, or in that file.
///
/// # Errors
/// If there is no such name, or the file cannot be used.
pub fn traffic(wanted: &str) -> Result<TrafficProfile, Failure> {
    if is_yaml(wanted) {
        let path = Path::new(wanted);
        return TrafficProfile::from_yaml(&text(path)?).map_err(|error| Failure::file("use", path, error));
    }
    TrafficProfile::shipped(wanted).map_err(Failure::usage)
}

/// The content of a file that avastra wrote, with the table of its space.
pub enum Emitted {
    Scenario(ActionTable, Box<Scenario>),
    Policy(ActionTable, Box<Policy>),
}

/// The scenario or policy of a file without mistakes.
///
/// # Errors
/// If it has neither a scenario nor a policy.
pub fn emitted_in(path: &Path, mut loaded: Loaded) -> Result<Emitted, Failure> {
    if let Some(policy) = loaded.policy.take() {
        return Ok(Emitted::Policy(ActionTable::new(space(loaded, path)?), Box::new(policy)));
    }
    if let Some(scenario) = loaded.scenario.take() {
        let scenario = with_answers(scenario, path)?;
        return Ok(Emitted::Scenario(ActionTable::new(space(loaded, path)?), Box::new(scenario)));
    }
    Err(Failure::usage(format!("`{}` has neither a scenario nor a policy", path.shown())))
}

/// A policy file: its space's table and its policy.
///
/// # Errors
/// As [`load`], and if the file has no policy.
pub fn policy(output: &Output, path: &Path) -> Result<(ActionTable, Policy), Failure> {
    policy_in(output, path, read_and_check(path)?)
}

/// The table and the policy of a file that was read and checked.
pub fn policy_in(output: &Output, path: &Path, loaded: Loaded) -> Result<(ActionTable, Policy), Failure> {
    match emitted_in(path, sound(output, loaded)?)? {
        Emitted::Policy(table, policy) => Ok((table, *policy)),
        Emitted::Scenario(..) => Err(Failure::usage(format!("`{}` is no policy", path.shown()))),
    }
}

/// Whether a file declares a policy, with mistakes or without.
pub fn is_policy(loaded: &Loaded) -> bool {
    loaded.files[0].tree.items.iter().any(|item| item.kind.as_policy().is_some())
}

fn space(loaded: Loaded, path: &Path) -> Result<Arc<Space>, Failure> {
    let space = loaded.space.filter(|space| !space.actions.is_empty());
    space.ok_or_else(|| Failure::usage(format!("`{}` declares no action", path.shown())))
}

/// Parses a text in YAML; `path` is its file.
///
/// # Errors
/// If it has another form: the reason, with its place.
pub fn parsed<T: serde::de::DeserializeOwned>(path: &Path, text: &str) -> Result<T, Failure> {
    read_yaml(text).map_err(|reason| Failure::file("read", path, reason))
}

/// The text of a file that a command needs.
pub fn text(path: &Path) -> Result<String, Failure> {
    read(path).map_err(|error| Failure::file("read", path, error))
}

/// Why a folder is not read.
const FOLDER: &str = "it is a folder: name a file in it";

/// Reads a text file; everything that avastra reads comes this way.
pub fn read(path: &Path) -> Result<String, ReadError> {
    read_up_to(path, if is_source(path) { SOURCE_BYTES_MAX } else { FILE_BYTES_MAX })
}

/// Reads a source or a map that another file names.
pub fn read_used(path: &Path) -> Result<String, ReadError> {
    read_named(path, &["ava", "xodr"], "neither a source (`.ava`) nor a map (`.xodr`)")
}

/// Reads a file that another file names. The naming file may be untrusted, so only files of the given kinds are read and
/// shown in a diagnostic. The extension must match: for a link, that of the file at its end.
pub fn read_named(path: &Path, extensions: &[&str], what_else: &str) -> Result<String, ReadError> {
    let followed = path.canonicalize().map_err(|error| {
        let meant = beside(path).map_or(String::new(), |meant| format!("; did you mean `{meant}`?"));
        unread(path, &error, &meant)
    })?;
    let is_of_the_kind = |path: &Path| {
        path.extension().is_some_and(|extension| extensions.iter().any(|known| extension == *known))
    };
    if followed.is_file() && !is_of_the_kind(&followed) {
        return Err(ReadError::new(format!("it is {what_else}")));
    }
    read(path)
}

/// The source or map beside a missing file whose name is near to its name.
fn beside(missing: &Path) -> Option<String> {
    let (stem, extension) = (missing.file_stem()?.to_str()?, missing.extension()?.to_str()?);
    let folder = missing.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
    let paths = entries.take(ENTRIES_MAX).filter_map(|entry| Some(entry.ok()?.path()));
    let paths = paths.filter(|path| path.extension().is_some_and(|own| own == extension) && path.is_file());
    let mut stems: Vec<String> =
        paths.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).collect();
    stems.sort();
    let near = nearest(stem, stems.iter().map(String::as_str))?;
    Some(format!("{near}.{extension}"))
}

/// The error of the system, and what the user may have meant. A link whose target is not there is no missing file.
fn unread(path: &Path, error: &std::io::Error, meant: &str) -> ReadError {
    let reason = format!("{}{meant}", reason(error));
    let is_missing = error.kind() == std::io::ErrorKind::NotFound && path.symlink_metadata().is_err();
    if is_missing { ReadError::missing(reason) } else { ReadError::new(reason) }
}

/// Reads a text file of a limited size. A pipe would wait, a device has no end: only regular files are read.
fn read_up_to(path: &Path, bytes_max: u64) -> Result<String, ReadError> {
    let unread = |error| unread(path, &error, "");
    let metadata = std::fs::metadata(path).map_err(unread)?;
    if metadata.is_dir() {
        return Err(ReadError::new(FOLDER.to_owned()));
    }
    if !metadata.is_file() {
        return Err(ReadError::new("it is no regular file".to_owned()));
    }
    let bytes = bytes_of(File::open(path).map_err(unread)?, bytes_max)?;
    // Files of XML may say what encoding they are in.
    match path.extension().is_some_and(|extension| extension == "xodr" || extension == "xosc") {
        true => avastra_road::xml_text(bytes).map_err(ReadError::new),
        false => utf8(bytes),
    }
}

/// The text on standard input, which is a source.
pub fn stdin() -> Result<String, Failure> {
    let text = bytes_of(std::io::stdin().lock(), SOURCE_BYTES_MAX).and_then(utf8);
    text.map_err(|error| Failure::file("read", Path::new("stdin"), error))
}

/// Bytes of a limited number. A file may grow while it is read, and a device has no end.
fn bytes_of(from: impl Read, bytes_max: u64) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    from.take(bytes_max + 1).read_to_end(&mut bytes).map_err(|error| ReadError::new(reason(&error)))?;
    if bytes.len() as u64 > bytes_max {
        return Err(ReadError::new(format!("it is larger than {} MiB", bytes_max >> 20)));
    }
    Ok(bytes)
}

fn utf8(bytes: Vec<u8>) -> Result<String, ReadError> {
    String::from_utf8(bytes).map_err(|error| {
        ReadError::new(format!("not text: byte {} is not UTF-8", error.utf8_error().valid_up_to()))
    })
}

/// The system's reason without its error number.
pub fn reason(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}

/// A path to `file` that holds in `directory`, with `/` between its parts.
///
/// # Errors
/// If one of the two does not exist.
pub fn relative(directory: &Path, file: &Path) -> Result<String, Failure> {
    let absolute = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().map_err(|error| Failure::file("find", path, reason(&error)))
    };
    path_between(&absolute(directory)?, &absolute(file)?)
}

/// As [`relative`], by the names alone: both paths begin at the same place and have no `..`.
///
/// # Errors
/// If a file of the language could not write the path, because it is not UTF-8.
pub fn path_between(directory: &Path, file: &Path) -> Result<String, Failure> {
    let shared = directory.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = directory.components().skip(shared).map(|_| Component::ParentDir);
    let path: PathBuf = up.chain(file.components().skip(shared)).collect();
    let parts: Option<Vec<&str>> = path.components().map(|part| part.as_os_str().to_str()).collect();
    let parts = parts.ok_or_else(|| Failure::file("write", file, NOT_UTF8))?;
    Ok(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_is_a_name_a_profile_or_a_command() {
        fn is(text: &str) -> Result<Driver<'_>, String> {
            driver(text).map_err(|error| error.to_string())
        }
        let none = Driver { ads: run::DEFAULT_ADS, profile: None, command: None };
        for entry in REGISTRY {
            assert_eq!(is(entry.name).unwrap(), Driver { ads: entry.name, ..none });
        }
        for profile in ["car.yaml", "ads/car.yml", "/nowhere/car.yaml"] {
            assert_eq!(is(profile).unwrap(), Driver { profile: Some(Path::new(profile)), ..none });
        }
        for command in ["./planner", "python3 drive.py", "run --with car.yaml", "tcp:a:1", "unix:/tmp/a.yaml"]
        {
            assert_eq!(is(command).unwrap(), Driver { command: Some(command), ..none });
        }
        let slip = is("modualr").unwrap_err();
        assert!(slip.contains("did you mean `modular`?") && slip.contains("`./modualr`"), "{slip}");
        assert!(is("planner").is_err() && is("").is_err() && is(EXTERNAL).is_err());
    }
}
