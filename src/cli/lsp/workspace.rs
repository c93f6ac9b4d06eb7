//! The documents that the editor has open, and what the checker knows of each.
//!
//! Every open document is loaded with all that it uses, as `avastra check` would load it, except that open
//! files are read from the editor. A document is loaded again only when a file that it read has changed. Maps
//! are kept by content.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::check;
use crate::check::{Loaded, MapCache, ReadError, References};
use crate::cli::load;
use crate::model;
use crate::model::Space;
use crate::syntax::Diagnostic;
use crate::syntax::ast::{FileId, Span};
use crate::trial::places::{self, Scenes};

use super::position::Lines;
use super::uri;

/// A text in the editor.
#[derive(Debug, Clone)]
pub struct Document {
    /// As the editor spells it.
    pub uri: String,
    pub version: i64,
    pub text: String,
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

#[derive(Debug, Default)]
pub struct Workspace {
    /// The folders that the editor has open.
    pub folders: Vec<PathBuf>,
    documents: BTreeMap<PathBuf, Document>,
    analyses: BTreeMap<PathBuf, Analysis>,
    maps: MapCache,
    scenes: Scenes,
}

impl Workspace {
    pub fn open(&mut self, path: PathBuf, document: Document) {
        self.changed(&path);
        self.documents.insert(path, document);
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

    pub fn document(&self, path: &Path) -> Option<&Document> {
        self.documents.get(path)
    }

    /// Every open document.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.documents.keys().cloned().collect()
    }

    /// The URI by which the editor knows a file.
    pub fn uri(&self, path: &Path) -> String {
        self.documents.get(path).map_or_else(|| uri::from_path(path), |document| document.uri.clone())
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
        let documents = &self.documents;
        let inputs = RefCell::new(BTreeSet::new());
        let read = |path: &Path| {
            inputs.borrow_mut().insert(path.to_owned());
            read(documents, path)
        };
        let mut loaded = check::load_with(path, &read, &mut self.maps).ok()?;
        places::judge_claims(&mut loaded, &mut self.scenes);
        let is_unknown = |found: &Diagnostic| found.is_error() && found.code == model::code::UNKNOWN;
        if loaded.diagnostics.iter().any(is_unknown) {
            check::suggest_uses(&mut loaded, &load::nearby(path));
        }
        let ids = 0..u32::try_from(loaded.files.len()).expect("a file's id is its position");
        let lines = ids.map(|id| Lines::new(loaded.sources.text(FileId(id)))).collect();
        let inputs = inputs.into_inner();
        Some(Analysis { loaded, lines, inputs, sound: None, stale: false })
    }

    /// The files of the open folders that are not open themselves and use one of these files.
    pub fn closed_users(&mut self, used: &BTreeSet<PathBuf>) -> Vec<Analysis> {
        let files: BTreeSet<PathBuf> = self.folders.iter().flat_map(|folder| load::below(folder)).collect();
        let uses = |workspace: &Workspace, file: &Path| {
            let read = |path: &Path| read(&workspace.documents, path);
            check::files_used(file, &read).iter().any(|file| used.contains(file))
        };
        let closed: Vec<PathBuf> =
            files.into_iter().filter(|file| !self.documents.contains_key(file) && uses(self, file)).collect();
        closed.iter().filter_map(|file| self.analyse(file)).collect()
    }

    /// Checks a document with other texts for some files, and keeps nothing of it.
    pub fn trial(&mut self, path: &Path, texts: &BTreeMap<PathBuf, String>) -> Option<Loaded> {
        let documents = &self.documents;
        let read = |path: &Path| match texts.get(path) {
            Some(text) => Ok(text.clone()),
            None => read(documents, path),
        };
        check::load_with(path, &read, &mut self.maps).ok()
    }
}

/// The text of a file: from the editor if it is open there, else from the disk.
fn read(documents: &BTreeMap<PathBuf, Document>, path: &Path) -> Result<String, ReadError> {
    match documents.get(path) {
        Some(document) => Ok(document.text.clone()),
        None => load::read_used(path),
    }
}

impl Analysis {
    /// The document itself.
    pub const ROOT: FileId = FileId(0);

    /// What each name stands for.
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

    /// The range of a span, in JSON.
    pub fn range(&self, span: Span) -> serde_json::Value {
        match self.lines(span.file) {
            Some(lines) => lines.range(self.text(span.file), span),
            None => Lines::new("").range("", Span::NONE),
        }
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
