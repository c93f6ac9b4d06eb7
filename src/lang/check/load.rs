//! Loads a root file: reads its imports and maps, compares digests, and runs the checks.
//!
//! Files are read through a function that `cli` gives; nothing here reads the disk itself.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::check::checker::{Checked, DIAGNOSTICS_MAX, Maps, Root, Runs};
use crate::check::files::{
    LoadedFile, ReadError, ReadFile, built_in, folder, maps_named, normal, path_from, used_path, uses,
};
use crate::check::meaning::meaning;
use crate::check::references::References;
use crate::check::{checker, overriding, policy, scenario, scenario_names};
use crate::model::policy::Policy;
use crate::model::scenario::Scenario;
use crate::model::{Meaning, Space, code, digest};
use crate::syntax::ast::{FileId, ItemKind, Span};
use crate::syntax::{Diagnostic, Severity, Sources, TOKENS_MAX, ast, parse};
use avastra_base::outside::Shown;
use avastra_base::threads::in_order;
use avastra_road::{LanePlace, RoadError, RoadMap, Route};

/// A root file with all it uses, checked.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The texts that the diagnostics point into.
    pub sources: Sources,
    pub diagnostics: Vec<Diagnostic>,
    /// Facts about a sound space that ask for no change; only `avastra check` prints them.
    pub remarks: Vec<Diagnostic>,
    /// In order of reading, the root first, so never empty; a file's [`FileId`] is its position.
    pub files: Vec<LoadedFile>,
    /// The meaning of each name in the files, as far as mistakes leave it known.
    pub references: References,
    /// The space that the root is or uses, if it is sound.
    pub space: Option<Arc<Space>>,
    /// The scenario of the root, if it has one and it is sound.
    pub scenario: Option<Scenario>,
    /// The policy of the root, if it has one and it is sound.
    pub policy: Option<Policy>,
    /// The findings about the rows of the root. A scenario or a policy claims nothing of its space.
    pub runs: Runs,
}

/// A path that is written in a file: of a file that it uses, or of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenPath {
    /// The text with its quotes.
    pub span: Span,
    pub written: String,
    /// The path that is meant.
    pub target: PathBuf,
}

impl Loaded {
    /// The paths that are written in the files.
    pub fn written_paths(&self) -> Vec<WrittenPath> {
        written_paths(&self.files)
    }
}

/// The paths that are written in files.
pub fn written_paths(files: &[LoadedFile]) -> Vec<WrittenPath> {
    let mut found = Vec::new();
    for file in files {
        let used = uses(file).map(|used| (used.path.value.as_str(), used.path.span));
        found.extend(used.chain(maps_named(file)).map(|(written, span)| WrittenPath {
            span,
            written: written.to_owned(),
            target: path_from(file, written),
        }));
    }
    found
}

/// Maps that were read before, by name and content, and the routes found on them. A caller that loads often, such as the
/// editor's server, then reads each map once.
#[derive(Debug, Clone, Default)]
pub struct MapCache {
    known: BTreeMap<(String, String), Result<Arc<RoadMap>, String>>,
    routes: Vec<(Arc<RoadMap>, [LanePlace; 2], Route)>,
}

/// Spaces that scenarios and policies used before, for a caller that loads many of them: each space is read and checked
/// once. As long as this lives, only the files that are loaded themselves may change.
#[derive(Debug, Default)]
pub struct KnownSpaces {
    maps: MapCache,
    /// The files that others use, by their paths and their places in the order of reading.
    files: KnownFiles,
    /// By the files that are read beside the scenario: their places in the order of reading are those in spans.
    spaces: BTreeMap<Vec<PathBuf>, KnownSpace>,
}

type KnownFiles = BTreeMap<(usize, PathBuf), KnownFile>;

/// A file as it was read and parsed.
#[derive(Debug, Clone)]
struct KnownFile {
    text: String,
    tree: ast::File,
    diagnostics: Vec<Diagnostic>,
}

/// The result of reading the files of a space, whatever scenario or policy uses it.
#[derive(Debug, Clone)]
struct KnownSpace {
    space: Option<Arc<Space>>,
    diagnostics: Vec<Diagnostic>,
    references: References,
    meanings: BTreeMap<PathBuf, Option<Meaning>>,
}

/// Maps that are parsed at the same time.
const MAPS_AT_ONCE: usize = 4;

/// Routes that are kept: while an author types a place, each keystroke makes another route.
const ROUTES_MAX: usize = 64;

/// Reads a root file, all it uses, and checks the whole.
///
/// # Errors
/// If the root itself cannot be read. All other mistakes are in the diagnostics.
pub fn load(root: &Path, read: &ReadFile<'_>) -> Result<Loaded, ReadError> {
    load_with(root, read, &mut MapCache::default())
}

/// Does the same as [`load`], and takes maps from earlier loads.
///
/// # Errors
/// As [`load`].
pub fn load_with(root: &Path, read: &ReadFile<'_>, cache: &mut MapCache) -> Result<Loaded, ReadError> {
    load_knowing(root, read, cache, None)
}

/// Reads and checks one of many files; takes the spaces that earlier ones used from `known`.
///
/// # Errors
/// As [`load`].
pub fn load_among(root: &Path, read: &ReadFile<'_>, known: &mut KnownSpaces) -> Result<Loaded, ReadError> {
    let KnownSpaces { maps, files, spaces } = known;
    load_knowing(root, read, maps, Some((files, spaces)))
}

fn load_knowing(
    root: &Path,
    read: &ReadFile<'_>,
    cache: &mut MapCache,
    known: Option<(&mut KnownFiles, &mut BTreeMap<Vec<PathBuf>, KnownSpace>)>,
) -> Result<Loaded, ReadError> {
    let (known_files, spaces) = known.unzip();
    let Loader { sources, files, order, mut diagnostics, .. } = Loader::read(root, read, known_files)?;
    // A file that does not parse lacks declarations, and their uses would be reported as unknown. So it is
    // checked for the names alone, and the checker's diagnostics are dropped.
    let is_whole = !diagnostics.iter().any(Diagnostic::is_error);
    let root = &files[0].tree;
    let has_scenario = root.items.iter().any(|item| item.kind.as_scenario().is_some());
    let has_policy = root.items.iter().any(|item| item.kind.as_policy().is_some());
    let spaces = spaces.filter(|_| is_whole && (has_scenario || has_policy) && !declares(&files[0]));
    let is_shared = spaces.is_some();
    let used: Vec<PathBuf> = files[1..].iter().map(|file| file.path.clone()).collect();
    let known = spaces.as_ref().and_then(|spaces| spaces.get(&used).cloned());
    let mut maps =
        MapReader { read, files: &files, texts: BTreeMap::new(), meanings: BTreeMap::new(), cache };
    let mut runs = Runs::default();
    let mut known = match known {
        Some(mut known) => {
            maps.meanings = std::mem::take(&mut known.meanings);
            diagnostics.extend(check_digests(&mut maps));
            known
        }
        None => {
            if is_whole {
                maps.parse();
                diagnostics.extend(check_digests(&mut maps));
            }
            let declared = References::declared(if is_shared { &files[1..] } else { &files });
            let checked = check_space(&order, &mut maps, is_whole, declared);
            runs = checked.runs;
            let space = checked.space.map(Arc::new);
            let (diagnostics, references) = (checked.diagnostics, checked.references);
            let known = KnownSpace { space, diagnostics, references, meanings: BTreeMap::new() };
            if let Some(spaces) = spaces {
                spaces.insert(
                    used,
                    KnownSpace { meanings: std::mem::take(&mut maps.meanings), ..known.clone() },
                );
            }
            known
        }
    };
    if is_shared {
        known.references.add(&files[0]);
    }
    files.iter().for_each(|file| scenario_names::note(&file.tree, &mut known.references));
    known.references.settle(&sources);
    let KnownSpace { space, diagnostics: found, references, .. } = known;
    let (mut remarks, found): (Vec<_>, Vec<_>) =
        found.into_iter().partition(|found| found.severity == Severity::Note);
    diagnostics.extend(found.into_iter().filter(|_| is_whole));
    let space = space.filter(|_| !diagnostics.iter().any(Diagnostic::is_error));
    let scenario = space
        .as_ref()
        .filter(|_| has_scenario)
        .and_then(|space| scenario::scenario(root, space).map_err(|found| diagnostics.extend(found)).ok());
    let policy = space.as_ref().filter(|_| has_policy).and_then(|space| {
        policy::policy(sources.text(FileId(0)), root, space).map_err(|found| diagnostics.extend(found)).ok()
    });
    // Remarks are about the space. They are shown when the space itself is checked, not for each of its
    // scenarios and policies.
    if has_scenario || has_policy || diagnostics.iter().any(Diagnostic::is_error) {
        remarks.clear();
    }
    let (diagnostics, remarks) = (as_many_as_help(merged(diagnostics)), as_many_as_help(merged(remarks)));
    let runs = if has_scenario || has_policy { Runs::default() } else { runs };
    Ok(Loaded { sources, diagnostics, remarks, files, references, space, scenario, policy, runs })
}

/// Diagnostics that say the same of the same place become one, which shows the other places of all. A rule, for example,
/// is checked for each of its actions.
fn merged(diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut merged: Vec<Diagnostic> = Vec::new();
    let mut known: BTreeMap<(Option<Span>, String), Vec<usize>> = BTreeMap::new();
    for found in diagnostics {
        let says = |one: &Diagnostic| (one.code, one.notes.clone(), one.help.clone(), one.fixes.clone());
        let alike = known.entry((found.place(), found.message.clone())).or_default();
        match alike.iter().find(|index| says(&merged[**index]) == says(&found)) {
            Some(index) => {
                let labels = &mut merged[*index].labels;
                let new: Vec<_> = found.labels.into_iter().filter(|label| !labels.contains(label)).collect();
                labels.extend(new);
            }
            None => {
                alike.push(merged.len());
                merged.push(found);
            }
        }
    }
    merged
}

/// The first [`DIAGNOSTICS_MAX`] diagnostics, and one that gives the number of the others.
fn as_many_as_help(mut found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    if found.len() > DIAGNOSTICS_MAX {
        let left = found.split_off(DIAGNOSTICS_MAX);
        let message = format!("{} further mistakes are not listed", left.len());
        let worst = left.iter().find(|one| one.is_error()).unwrap_or(&left[0]);
        found.push(Diagnostic { severity: worst.severity, ..Diagnostic::error(worst.code, message) });
    }
    found
}

/// The texts and the files of a root and of all that it uses, as in [`Loaded`]. Nothing is checked.
///
/// # Errors
/// As [`load`].
pub fn read_files(root: &Path, read: &ReadFile<'_>) -> Result<(Sources, Vec<LoadedFile>), ReadError> {
    Loader::read(root, read, None).map(|loader| (loader.sources, loader.files))
}

/// The files that a file uses, itself included, however far away. Nothing is checked.
pub fn files_used(root: &Path, read: &ReadFile<'_>) -> Vec<PathBuf> {
    let files = Loader::read(root, read, None).map(|loader| loader.files).unwrap_or_default();
    files.into_iter().map(|file| file.path).collect()
}

/// Whether a file makes a new space.
fn declares(file: &LoadedFile) -> bool {
    let declares = |item: &ast::Item| match &item.kind {
        ItemKind::Language(_) | ItemKind::Scenario(_) | ItemKind::Policy(_) => false,
        // A `use` with `without` makes a new space.
        ItemKind::Use(used) => !used.without.is_empty(),
        _ => true,
    };
    // A file that uses several others makes a new space, too.
    uses(file).count() > 1 || file.tree.items.iter().any(declares)
}

fn check_space(order: &[usize], maps: &mut MapReader<'_>, is_whole: bool, declared: References) -> Checked {
    let files = maps.files;
    // A scenario file declares no space: its space is the first file that declares something.
    let index = files.iter().position(declares).unwrap_or(0);
    let root = &files[index];
    let root = Root {
        file: FileId(u32::try_from(index).expect("a file's id is its position")),
        path: root.path.clone(),
        // Without a meaning a map could not be read; then there is no space either.
        meaning: is_whole.then(|| maps.meaning(&root.path)).flatten().unwrap_or_default(),
        docs: root.tree.docs.iter().map(|doc| doc.text.clone()).collect(),
    };
    let (standing, mut diagnostics) = overriding::resolve(files, order);
    let aside = overriding::set_aside(files, &standing);
    let items: Vec<&ast::Item> = standing.iter().map(AsRef::as_ref).collect();
    let maps = is_whole.then_some(maps as &mut dyn Maps);
    let mut checked = checker::space(root, &items, &aside, declared, maps);
    diagnostics.append(&mut checked.diagnostics);
    Checked { diagnostics, ..checked }
}

/// Compares every `use … digest` with what was read.
fn check_digests(maps: &mut MapReader<'_>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for file in maps.files {
        for used in uses(file) {
            let Some(wanted) = &used.digest else { continue };
            // An unreadable file is reported where it is named.
            let Some(found) = maps.meaning(&used_path(file, used)) else { continue };
            if found.is_sealed_by(&wanted.value) {
                continue;
            }
            let message = "the imported file, or what it uses, does not mean what it meant";
            let mut error = Diagnostic::error(code::DIGEST, message).at(wanted.span, "its digest differs");
            if let Some(differences) = found.differences(&wanted.value) {
                error = error.note(differences);
            }
            error = error.note(format!("its digest is now {}", found.digest())).help(
                "get back the files as they were, or accept the change; `avastra test --review` says what it changes for \
                 scenarios, and `--accept` writes that into them",
            );
            // A policy's digest of itself covers this one: it has to be trained again.
            if !file.tree.items.iter().any(|item| item.kind.as_policy().is_some()) {
                error = error.fix("accept the change", wanted.span, format!("\"{}\"", found.seal()));
            }
            diagnostics.push(error);
        }
    }
    diagnostics
}

struct Loader<'a> {
    read: &'a ReadFile<'a>,
    known: Option<&'a mut KnownFiles>,
    sources: Sources,
    files: Vec<LoadedFile>,
    /// Indices of files, imports before the files that use them.
    order: Vec<usize>,
    diagnostics: Vec<Diagnostic>,
    /// Words and signs of the files so far.
    words: usize,
}

/// Most words and signs of all files of a space together, comments included: a file of the greatest length, and what it
/// uses.
const WORDS_MAX: usize = TOKENS_MAX + 100_000;

/// Most `use`s of a file: each asks the file system.
const USES_MAX: usize = 1_000;

/// Words, and signs that are part of none.
fn words(text: &str) -> usize {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    text.split_whitespace()
        .map(|part| {
            let signs = part.chars().filter(|c| !is_word(*c)).count();
            signs + part.split(|c| !is_word(c)).filter(|word| !word.is_empty()).count()
        })
        .sum()
}

impl<'a> Loader<'a> {
    fn read(
        root: &Path,
        read: &'a ReadFile<'a>,
        known: Option<&'a mut KnownFiles>,
    ) -> Result<Loader<'a>, ReadError> {
        let sources = Sources::new();
        let (files, order, diagnostics) = (Vec::new(), Vec::new(), Vec::new());
        let mut loader = Loader { read, known, sources, files, order, diagnostics, words: 0 };
        loader.read_file(&normal(root), &mut Vec::new())?;
        Ok(loader)
    }

    /// Reads a file that another one uses. A file that avastra has within itself need not be there.
    fn read_used(&mut self, written: &str, path: &Path, way: &mut Vec<PathBuf>) -> Result<(), ReadError> {
        let done = self.read_file(path, way);
        let is_missing = done.as_ref().is_err_and(ReadError::is_missing);
        match built_in(written).filter(|_| is_missing) {
            Some(text) => self.add_file(path, text.to_owned(), None, way),
            None => done,
        }
    }

    /// Reads a file and the files that it uses. `way` holds the files from the root to this one.
    fn read_file(&mut self, path: &Path, way: &mut Vec<PathBuf>) -> Result<(), ReadError> {
        if self.files.iter().any(|file| file.path == path) {
            return Ok(());
        }
        let place = (self.files.len(), path.to_owned());
        let (text, parsed) = match self.known.as_ref().and_then(|known| known.get(&place).cloned()) {
            Some(KnownFile { text, tree, diagnostics }) => (text, Some((tree, diagnostics))),
            None => ((self.read)(path)?, None),
        };
        self.add_file(path, text, parsed, way)
    }

    /// Adds a file, which may be parsed already, and reads the files that it uses.
    fn add_file(
        &mut self,
        path: &Path,
        text: String,
        parsed: Option<(ast::File, Vec<Diagnostic>)>,
        way: &mut Vec<PathBuf>,
    ) -> Result<(), ReadError> {
        let place = (self.files.len(), path.to_owned());
        self.words += words(&text);
        // The parser says it of a root that is too long by itself.
        if self.words > WORDS_MAX && !self.files.is_empty() {
            let message =
                format!("with it, the files of the space have more than {WORDS_MAX} words and signs");
            return Err(ReadError::new(message));
        }
        let file = self.sources.add(path.to_string_lossy(), text);
        let (tree, found) = parsed.unwrap_or_else(|| parse(file, self.sources.text(file)));
        if let Some(known) = self.known.as_mut().filter(|known| place.0 > 0 && !known.contains_key(&place)) {
            let text = self.sources.text(file).to_owned();
            known.insert(place, KnownFile { text, tree: tree.clone(), diagnostics: found.clone() });
        }
        self.diagnostics.extend(found);
        let index = self.files.len();
        self.files.push(LoadedFile { path: path.to_owned(), tree });
        let mut uses: Vec<ast::Use> = uses(&self.files[index]).cloned().collect();
        if let Some(beyond) = uses.get(USES_MAX) {
            let message = format!("the file has {} `use`s", uses.len());
            let error = Diagnostic::error(code::TOO_MUCH, message)
                .at(beyond.path.span, "not read, nor those after it");
            self.diagnostics.push(error.help(format!("at most {USES_MAX} are read")));
            uses.truncate(USES_MAX);
        }
        way.push(path.to_owned());
        for used in uses {
            let target = normal(&folder(path).join(&used.path.value));
            if let Some(begin) = way.iter().position(|step| *step == target) {
                let circle: Vec<String> = way[begin..].iter().map(|step| step.shown().to_string()).collect();
                let error = Diagnostic::error(code::IMPORT_CYCLE, "files use each other in a circle");
                let error = error.at(used.path.span, "this closes the circle");
                let error = error.note(format!("{} → {}", circle.join(" → "), target.shown()));
                self.diagnostics.push(error.help("move what both need into a file that uses neither"));
                continue;
            }
            if let Err(error) = self.read_used(&used.path.value, &target, way) {
                let message = format!("cannot read `{}`", target.shown());
                self.diagnostics
                    .push(Diagnostic::error(code::UNREADABLE, message).at(used.path.span, error.to_string()));
            }
        }
        way.pop();
        self.order.push(index);
        Ok(())
    }
}

struct MapReader<'a> {
    read: &'a ReadFile<'a>,
    files: &'a [LoadedFile],
    texts: BTreeMap<PathBuf, Result<MapText, ReadError>>,
    /// The meanings of files found so far.
    meanings: BTreeMap<PathBuf, Option<Meaning>>,
    cache: &'a mut MapCache,
}

struct MapText {
    text: String,
    digest: String,
}

impl MapText {
    fn read(path: &Path, read: &ReadFile<'_>) -> Result<MapText, ReadError> {
        read(path).map(|text| MapText { digest: digest(text.as_bytes()), text })
    }
}

impl MapReader<'_> {
    /// The text of a map, read once.
    fn text(&mut self, path: &Path) -> &Result<MapText, ReadError> {
        let read = self.read;
        self.texts.entry(path.to_owned()).or_insert_with(|| MapText::read(path, read))
    }

    /// Parses the maps that the files name and that are not known yet, some at a time: they take longer than all the rest.
    fn parse(&mut self) {
        let of_file = |file| maps_named(file).map(move |(written, _)| path_from(file, written));
        let mut paths: Vec<PathBuf> = self.files.iter().flat_map(of_file).collect();
        paths.sort_unstable();
        paths.dedup();
        for path in &paths {
            let _ = self.text(path);
        }
        let MapReader { texts, cache, .. } = self;
        let mut open: BTreeMap<(String, String), (&Path, &str)> = BTreeMap::new();
        for (path, map) in paths.iter().filter_map(|path| Some((path, texts.get(path)?.as_ref().ok()?))) {
            let key = map_key(path, map);
            if !cache.known.contains_key(&key) {
                open.insert(key, (path, &map.text));
            }
        }
        let open: Vec<_> = open.into_iter().collect();
        let parsed = in_order(&open, MAPS_AT_ONCE, |(_, (path, text))| map_of(path, text));
        cache.known.extend(open.into_iter().map(|(key, _)| key).zip(parsed));
    }

    /// The meaning of a file with all files that it uses, as far as all could be read.
    fn meaning(&mut self, path: &Path) -> Option<Meaning> {
        if let Some(known) = self.meanings.get(path) {
            return known.clone();
        }
        let files = self.files;
        let digest = &mut |map: &Path| self.text(map).as_ref().ok().map(|map| map.digest.clone());
        let found = meaning(files, path, digest);
        self.meanings.insert(path.to_owned(), found.clone());
        found
    }
}

impl Maps for MapReader<'_> {
    fn map(&mut self, name: &ast::Text) -> Result<(PathBuf, Arc<RoadMap>), String> {
        let FileId(file) = name.span.file;
        let path = path_from(&self.files[file as usize], &name.value);
        let read = self.read;
        let found = self.texts.entry(path.clone()).or_insert_with(|| MapText::read(&path, read));
        let map = found.as_ref().map_err(ToString::to_string)?;
        let key = map_key(&path, map);
        let parse = || map_of(&path, &map.text);
        let map = self.cache.known.entry(key).or_insert_with(parse).clone()?;
        Ok((path, map))
    }

    fn route(&mut self, map: &Arc<RoadMap>, start: LanePlace, goal: LanePlace) -> Result<Route, RoadError> {
        let MapCache { known, routes } = &mut *self.cache;
        let found = routes.iter().find(|(of, ends, _)| Arc::ptr_eq(of, map) && *ends == [start, goal]);
        if let Some((_, _, route)) = found {
            return Ok(route.clone());
        }
        let route = Route::find(map, start, goal)?;
        // A map with its own limit is made anew at each load, so its routes are not found again.
        if known.values().flatten().any(|of| Arc::ptr_eq(of, map)) {
            if routes.len() >= ROUTES_MAX {
                routes.clear();
            }
            routes.push((Arc::clone(map), [start, goal], route.clone()));
        }
        Ok(route)
    }
}

/// By what a map is known: its name and the digest of its text.
fn map_key(path: &Path, map: &MapText) -> (String, String) {
    (stem(path), map.digest.clone())
}

fn map_of(path: &Path, text: &str) -> Result<Arc<RoadMap>, String> {
    let mut map = RoadMap::from_opendrive(&stem(path), text).map_err(|error| error.to_string())?;
    map.file = Some(path.to_owned());
    Ok(Arc::new(map))
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}
