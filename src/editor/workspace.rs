//! The documents that the editor has open, and what the checker knows of each.
//!
//! Every open document is loaded with all that it uses, as `avastra check` would load it, except that open
//! files are read from the editor. A document is loaded again only when a file that it read has changed. Maps
//! are kept by content.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use avastra_lang::check::{self, Loaded, MapCache, ReadError, References};
use avastra_lang::model::{self, Space};
use avastra_lang::syntax::Diagnostic;
use avastra_lang::syntax::ast::{FileId, Span};
use avastra_world::places::{self, Scenes};

use super::position::{Lines, Place, Range};

/// Files that the editor does not have open. The caller reads them: nothing here touches a file.
pub trait Files {
    /// The text of a file.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn read(&self, path: &Path) -> Result<String, ReadError>;
    /// Every source below a folder.
    fn below(&self, folder: &Path) -> Vec<PathBuf>;
    /// The sources near a file that may declare what it lacks: each one's path, as the file would write it, and its
    /// text.
    fn nearby(&self, path: &Path) -> Vec<(String, String)>;
    /// The entries of a folder: each name, and whether it is a folder. Empty if the folder cannot be read.
    fn entries(&self, folder: &Path) -> Vec<(String, bool)>;
}

/// A document with all that it uses.
#[derive(Debug)]
pub struct Analysis {
    pub loaded: Loaded,
    /// The lines of each file, by [`FileId`].
    lines: Vec<Lines>,
    /// Every file that the load tried to read, maps and missing files included.
    inputs: BTreeSet<PathBuf>,
    /// The last sound space of the document.
    sound: Option<Arc<Space>>,
    /// Whether an input has changed since.
    stale: bool,
}

/// The documents and folders that the editor has open.
pub struct Workspace {
    /// The folders that the editor has open.
    pub folders: Vec<PathBuf>,
    files: Box<dyn Files>,
    /// The text of each open document.
    documents: BTreeMap<PathBuf, String>,
    analyses: BTreeMap<PathBuf, Analysis>,
    maps: MapCache,
    scenes: Scenes,
}

impl Workspace {
    /// A workspace with nothing open.
    pub fn new(files: impl Files + 'static) -> Workspace {
        Workspace {
            folders: Vec::new(),
            files: Box::new(files),
            documents: BTreeMap::new(),
            analyses: BTreeMap::new(),
            maps: MapCache::default(),
            scenes: Scenes::default(),
        }
    }

    /// Opens a document, or gives an open one another text.
    pub fn open(&mut self, path: PathBuf, text: String) {
        self.changed(&path);
        self.documents.insert(path, text);
    }

    pub fn close(&mut self, path: &Path) {
        self.documents.remove(path);
        self.analyses.remove(path);
        self.changed(path);
    }

    /// Notes that a file has changed: every analysis that read it is stale.
    pub fn changed(&mut self, path: &Path) {
        for analysis in self.analyses.values_mut().filter(|analysis| analysis.inputs.contains(path)) {
            analysis.stale = true;
        }
    }

    pub fn is_open(&self, path: &Path) -> bool {
        self.documents.contains_key(path)
    }

    /// Every open document.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.documents.keys().cloned().collect()
    }

    /// The text of a file: from the editor if it is open there, else from the caller.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub fn text(&self, path: &Path) -> Result<String, ReadError> {
        match self.documents.get(path) {
            Some(text) => Ok(text.clone()),
            None => self.files.read(path),
        }
    }

    /// Every source below the editor's folders.
    pub fn below(&self) -> BTreeSet<PathBuf> {
        self.folders.iter().flat_map(|folder| self.files.below(folder)).collect()
    }

    /// The entries of a folder: each name, and whether it is a folder.
    pub fn entries(&self, folder: &Path) -> Vec<(String, bool)> {
        self.files.entries(folder)
    }

    /// The analysis of an open document, brought up to date.
    pub fn analysis(&mut self, path: &Path) -> Option<&Analysis> {
        self.documents.get(path)?;
        if self.analyses.get(path).is_none_or(|known| known.stale) {
            let before = self.analyses.remove(path).and_then(|known| known.sound);
            let mut analysis = self.analyse(path)?;
            analysis.sound = analysis.loaded.space.clone().or(before);
            self.analyses.insert(path.to_owned(), analysis);
        }
        self.analyses.get(path)
    }

    /// The last analysis of a document, up to date or not.
    pub fn known(&self, path: &Path) -> Option<&Analysis> {
        self.analyses.get(path)
    }

    fn analyse(&mut self, path: &Path) -> Option<Analysis> {
        let (documents, files) = (&self.documents, &self.files);
        let inputs = RefCell::new(BTreeSet::new());
        let read = |path: &Path| {
            inputs.borrow_mut().insert(path.to_owned());
            documents.get(path).map_or_else(|| files.read(path), |text| Ok(text.clone()))
        };
        let mut loaded = check::load_with(path, &read, &mut self.maps).ok()?;
        places::judge_claims(&mut loaded, &mut self.scenes);
        let is_unknown = |found: &Diagnostic| found.is_error() && found.code == model::code::UNKNOWN;
        if loaded.diagnostics.iter().any(is_unknown) {
            check::suggest_uses(&mut loaded, &self.files.nearby(path));
        }
        let ids = 0..u32::try_from(loaded.files.len()).expect("a file's id is its position");
        let lines = ids.map(|id| Lines::new(loaded.sources.text(FileId(id)))).collect();
        let inputs = inputs.into_inner();
        Some(Analysis { loaded, lines, inputs, sound: None, stale: false })
    }

    /// The files of the open folders that are not open themselves and use one of these files.
    pub fn closed_users(&mut self, used: &BTreeSet<PathBuf>) -> Vec<Analysis> {
        let read = |path: &Path| self.text(path);
        let uses = |file: &Path| check::files_used(file, &read).iter().any(|file| used.contains(file));
        let closed: Vec<PathBuf> =
            self.below().into_iter().filter(|file| !self.is_open(file) && uses(file)).collect();
        closed.iter().filter_map(|file| self.analyse(file)).collect()
    }

    /// Checks a document with other texts for some files, and keeps nothing of it.
    pub fn trial(&mut self, path: &Path, texts: &BTreeMap<PathBuf, String>) -> Option<Loaded> {
        let (documents, files) = (&self.documents, &self.files);
        let read = |path: &Path| match texts.get(path).or_else(|| documents.get(path)) {
            Some(text) => Ok(text.clone()),
            None => files.read(path),
        };
        check::load_with(path, &read, &mut self.maps).ok()
    }
}

impl Analysis {
    /// The document itself.
    pub const ROOT: FileId = FileId(0);

    /// The symbols that each name stands for.
    pub fn references(&self) -> &References {
        &self.loaded.references
    }

    pub fn text(&self, file: FileId) -> &str {
        self.loaded.sources.text(file)
    }

    /// The text of a span; empty if the span is in no file.
    pub fn slice(&self, span: Span) -> &str {
        self.text(span.file).get(span.start..span.end).unwrap_or_default()
    }

    pub fn path(&self, file: FileId) -> Option<&Path> {
        self.loaded.files.get(file.0 as usize).map(|file| file.path.as_path())
    }

    pub fn lines(&self, file: FileId) -> Option<&Lines> {
        self.lines.get(file.0 as usize)
    }

    /// The range of a span; empty and at the start if the span is in no file.
    pub fn range(&self, span: Span) -> Range {
        self.lines(span.file).map(|lines| lines.range(self.text(span.file), span)).unwrap_or_default()
    }

    /// The file and the range of a span; `None` if the span is in no file.
    pub fn place(&self, span: Span) -> Option<Place> {
        Some(Place { path: self.path(span.file)?.to_owned(), range: self.range(span) })
    }

    /// The byte of the document at a place in the editor.
    pub fn byte(&self, line: usize, column: usize) -> usize {
        self.lines[0].byte(self.text(Analysis::ROOT), line, column)
    }

    /// The space, or the last sound space while the files are broken.
    pub fn space(&self) -> Option<&Space> {
        self.sound.as_deref()
    }

    pub fn is_sound(&self) -> bool {
        self.loaded.space.is_some()
    }
}
