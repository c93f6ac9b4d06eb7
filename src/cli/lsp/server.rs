//! The server without input and output: messages in, messages out.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::AssertUnwindSafe;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::check::Symbol;
use crate::syntax;

use super::workspace::{Analysis, Document, Workspace};
use super::{complete, diagnostics, highlight, hints, hover, outline, rename, signature, structure, uri};

// Codes of JSON-RPC and of the protocol.
const PARSE_ERROR: i64 = -32700;
const INVALID_REQUEST: i64 = -32600;
const METHOD_NOT_FOUND: i64 = -32601;
const INVALID_PARAMS: i64 = -32602;
const INTERNAL_ERROR: i64 = -32603;
const NOT_INITIALIZED: i64 = -32002;
const REQUEST_FAILED: i64 = -32803;

/// Why a request has no result.
#[derive(Debug, thiserror::Error)]
enum Refusal {
    #[error("no method `{0}`")]
    UnknownMethod(String),
    #[error("`{0}` is missing or of another kind")]
    Params(&'static str),
    #[error("no open document `{0}`")]
    NotOpen(String),
    /// The request is well formed but not possible. Holds a sentence for the author.
    #[error("{0}")]
    Impossible(String),
}

impl Refusal {
    fn code(&self) -> i64 {
        match self {
            Refusal::UnknownMethod(_) => METHOD_NOT_FOUND,
            Refusal::Params(_) | Refusal::NotOpen(_) => INVALID_PARAMS,
            Refusal::Impossible(_) => REQUEST_FAILED,
        }
    }
}

/// How far the conversation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    #[default]
    Fresh,
    Running,
    ShutDown,
}

/// The state of a conversation with one editor.
#[derive(Debug, Default)]
pub struct Server {
    stage: Stage,
    /// Set by `exit`: whether `shutdown` came before it.
    exit: Option<bool>,
    workspace: Workspace,
    /// Whether a document or file has changed since mistakes were last published.
    news: bool,
    /// Documents whose text changed since then.
    touched: BTreeSet<PathBuf>,
    /// What the editor shows, by file.
    published: BTreeMap<PathBuf, Vec<Value>>,
}

impl Server {
    /// Whether `exit` has come, and if so, whether after `shutdown`.
    pub fn exit(&self) -> Option<bool> {
        self.exit
    }

    pub fn is_shut_down(&self) -> bool {
        self.stage == Stage::ShutDown
    }

    /// Whether [`Server::publish`] has something to look at.
    pub fn has_news(&self) -> bool {
        self.news
    }

    /// Takes a message in; gives the answers to it.
    pub fn receive(&mut self, message: &Value) -> Vec<Value> {
        let (id, method) = (message.get("id"), message.get("method").and_then(Value::as_str));
        let is_object = message.is_object();
        match (id, method) {
            (Some(id), Some(method)) if id.is_string() || id.is_number() => {
                vec![self.answer(id, method, &message["params"])]
            }
            (None, Some(method)) => {
                self.notice(method, &message["params"]);
                Vec::new()
            }
            // A reply to a request that the server never sent.
            (Some(_), None) if message.get("result").or(message.get("error")).is_some() => Vec::new(),
            _ => {
                let what =
                    if is_object { "neither a request nor a notification" } else { "no JSON-RPC object" };
                vec![error_reply(&Value::Null, INVALID_REQUEST, what)]
            }
        }
    }

    fn answer(&mut self, id: &Value, method: &str, params: &Value) -> Value {
        match (self.stage, method) {
            (Stage::Fresh, "initialize") => {
                self.stage = Stage::Running;
                self.workspace.folders = folders(params);
                return reply(id, capabilities());
            }
            (Stage::Fresh, _) => return error_reply(id, NOT_INITIALIZED, "`initialize` comes first"),
            (Stage::ShutDown, _) => return error_reply(id, INVALID_REQUEST, "shut down already"),
            (Stage::Running, "initialize") => return error_reply(id, INVALID_REQUEST, "initialized already"),
            (Stage::Running, "shutdown") => {
                self.stage = Stage::ShutDown;
                return reply(id, Value::Null);
            }
            (Stage::Running, _) => {}
        }
        // A panic of ours must not end the server, which serves all documents.
        let result = std::panic::catch_unwind(AssertUnwindSafe(|| self.result(method, params)));
        match result {
            Ok(Ok(result)) => reply(id, result),
            Ok(Err(refusal)) => error_reply(id, refusal.code(), &refusal.to_string()),
            Err(_) => error_reply(id, INTERNAL_ERROR, "a mistake in avastra; please report it"),
        }
    }

    fn result(&mut self, method: &str, params: &Value) -> Result<Value, Refusal> {
        match method {
            "textDocument/hover" => {
                let (path, byte) = self.place(params)?;
                let analysis = self.analysis(&path)?;
                Ok(hover::hover(analysis, byte).map_or(Value::Null, |(span, text)| {
                    json!({
                        "contents": { "kind": "markdown", "value": text },
                        "range": analysis.range(span),
                    })
                }))
            }
            "textDocument/completion" => {
                let (path, byte) = self.place(params)?;
                Ok(complete::complete(self.analysis(&path)?, byte))
            }
            "textDocument/definition" => self.definition(params),
            "textDocument/references" => self.references(params),
            "textDocument/documentHighlight" => self.highlights(params),
            "textDocument/prepareRename" => {
                let (path, byte) = self.place(params)?;
                let analysis = self.analysis(&path)?;
                let span = rename::prepare(analysis, byte).map_err(Refusal::Impossible)?;
                Ok(analysis.range(span))
            }
            "textDocument/rename" => {
                let (path, byte) = self.place(params)?;
                let name = params["newName"].as_str().ok_or(Refusal::Params("newName"))?;
                rename::rename(&mut self.workspace, &path, byte, name).map_err(Refusal::Impossible)
            }
            "textDocument/formatting" => self.formatting(params),
            "textDocument/documentSymbol" => {
                let path = self.document(params)?;
                Ok(outline::symbols(self.analysis(&path)?).into())
            }
            "textDocument/foldingRange" => {
                let path = self.document(params)?;
                Ok(structure::folds(self.analysis(&path)?).into())
            }
            "textDocument/documentLink" => {
                let path = self.document(params)?;
                self.analysis(&path)?;
                let analysis = self.workspace.known(&path).ok_or(Refusal::Params("textDocument"))?;
                Ok(structure::links(analysis, &self.workspace).into())
            }
            "textDocument/signatureHelp" => {
                let (path, byte) = self.place(params)?;
                Ok(signature::help(self.analysis(&path)?, byte).unwrap_or(Value::Null))
            }
            "workspace/symbol" => {
                let query = params["query"].as_str().ok_or(Refusal::Params("query"))?;
                Ok(structure::search(&self.workspace, query).into())
            }
            "textDocument/semanticTokens/full" => {
                let path = self.document(params)?;
                Ok(json!({ "data": highlight::tokens(self.analysis(&path)?) }))
            }
            "textDocument/inlayHint" => {
                let (path, from, to) = self.span(params)?;
                Ok(hints::hints(self.analysis(&path)?, from, to).into())
            }
            "textDocument/codeAction" => {
                let (path, from, to) = self.span(params)?;
                self.analysis(&path)?;
                let analysis = self.workspace.known(&path).ok_or(Refusal::Params("textDocument"))?;
                Ok(diagnostics::fixes(analysis, &self.workspace, from, to).into())
            }
            _ => Err(Refusal::UnknownMethod(method.to_owned())),
        }
    }

    fn definition(&mut self, params: &Value) -> Result<Value, Refusal> {
        let (path, byte) = self.place(params)?;
        self.analysis(&path)?;
        let analysis = self.workspace.known(&path).ok_or(Refusal::Params("position"))?;
        let Some(occurrence) = analysis.references().at(Analysis::ROOT, byte) else { return Ok(Value::Null) };
        if let [Symbol::File(file)] = occurrence.symbols.as_slice() {
            let start = json!({ "line": 0, "character": 0 });
            let range = json!({ "start": start, "end": start });
            return Ok(json!([{ "uri": self.workspace.uri(file), "range": range }]));
        }
        let mut spans = analysis.references().declarations_of(&occurrence.symbols);
        // At an `override`, go to the declaration that it replaces.
        spans.retain(|span| !occurrence.declares || *span != occurrence.span);
        if spans.is_empty() && occurrence.declares {
            spans.push(occurrence.span);
        }
        let places = spans.iter().filter_map(|span| diagnostics::location(*span, analysis, &self.workspace));
        Ok(places.collect())
    }

    fn references(&mut self, params: &Value) -> Result<Value, Refusal> {
        let (path, byte) = self.place(params)?;
        let with_declarations = params["context"]["includeDeclaration"].as_bool().unwrap_or(true);
        for path in self.workspace.paths() {
            self.analysis(&path)?;
        }
        let analysis = self.workspace.known(&path).ok_or(Refusal::Params("position"))?;
        let Some(occurrence) = analysis.references().at(Analysis::ROOT, byte) else { return Ok(json!([])) };
        let symbols: BTreeSet<Symbol> = occurrence.symbols.iter().cloned().collect();
        let home = rename::home(analysis, &symbols);
        let closed = self.workspace.closed_users(&home);
        let mut found: Vec<Value> = Vec::new();
        // The document itself comes first, then others that use the same declaration, open or not.
        let others = self.workspace.paths().into_iter().filter(|other| *other != path);
        let open = std::iter::once(path.clone()).chain(others);
        for known in open.filter_map(|path| self.workspace.known(&path)).chain(&closed) {
            let is_same = known.path(Analysis::ROOT) == Some(&path)
                || rename::home(known, &symbols).iter().any(|file| home.contains(file));
            if !is_same {
                continue;
            }
            for occurrence in known.references().of(&symbols).filter(|o| with_declarations || !o.declares) {
                let place = diagnostics::location(occurrence.span, known, &self.workspace);
                found.extend(place.filter(|place| !found.contains(place)));
            }
        }
        Ok(found.into())
    }

    fn highlights(&mut self, params: &Value) -> Result<Value, Refusal> {
        let (path, byte) = self.place(params)?;
        let analysis = self.analysis(&path)?;
        let Some(occurrence) = analysis.references().at(Analysis::ROOT, byte) else { return Ok(json!([])) };
        let symbols: BTreeSet<Symbol> = occurrence.symbols.iter().cloned().collect();
        let here = analysis.references().of(&symbols).filter(|o| o.span.file == Analysis::ROOT);
        Ok(here.map(|o| json!({ "range": analysis.range(o.span) })).collect())
    }

    /// One edit, from the first character that differs to the last. A broken file is not formatted.
    fn formatting(&mut self, params: &Value) -> Result<Value, Refusal> {
        let path = self.document(params)?;
        let analysis = self.analysis(&path)?;
        let text = analysis.text(Analysis::ROOT);
        let formatted = match syntax::format(Analysis::ROOT, text) {
            Ok(formatted) => formatted,
            Err(syntax::FormatError::Syntax(_)) => return Ok(Value::Null),
            Err(error @ syntax::FormatError::Meaning) => return Err(Refusal::Impossible(error.to_string())),
        };
        if formatted == text {
            return Ok(json!([]));
        }
        let same = |(a, b): &(char, char)| a == b;
        let mut before: usize =
            text.chars().zip(formatted.chars()).take_while(same).map(|(a, _)| a.len_utf8()).sum();
        let rest = (&text[before..], &formatted[before..]);
        let mut after: usize =
            rest.0.chars().rev().zip(rest.1.chars().rev()).take_while(same).map(|(a, _)| a.len_utf8()).sum();
        // An editor has no position between the `\r` and the `\n` that end a line.
        let splits = |at: usize| text[..at].ends_with('\r') && text[at..].starts_with('\n');
        before -= usize::from(splits(before));
        after -= usize::from(splits(text.len() - after));
        let span = syntax::ast::Span::new(Analysis::ROOT, before, text.len() - after);
        let text = &formatted[before..formatted.len() - after];
        Ok(json!([{ "range": analysis.range(span), "newText": text }]))
    }

    /// Acts on a notification. An unknown one is ignored, as the protocol wants it.
    fn notice(&mut self, method: &str, params: &Value) {
        if method == "exit" {
            self.exit = Some(self.stage == Stage::ShutDown);
        }
        if self.stage != Stage::Running {
            return;
        }
        let document = &params["textDocument"];
        let Some(uri) = document["uri"].as_str() else {
            if method == "workspace/didChangeWatchedFiles" {
                let files = params["changes"].as_array().into_iter().flatten();
                files.filter_map(|file| file["uri"].as_str()).for_each(|uri| self.changed(uri));
            }
            return;
        };
        let path = uri::to_path(uri);
        match method {
            "textDocument/didOpen" | "textDocument/didChange" => {
                let text = match method {
                    "textDocument/didOpen" => document["text"].as_str(),
                    // Each change holds the whole text, so the last one counts.
                    _ => params["contentChanges"].as_array().and_then(|all| all.last()?["text"].as_str()),
                };
                let Some(text) = text else { return };
                let version = document["version"].as_i64().unwrap_or(0);
                let document = Document { uri: uri.to_owned(), version, text: text.to_owned() };
                self.workspace.open(path.clone(), document);
                self.touched.insert(path);
                self.news = true;
            }
            "textDocument/didClose" => {
                self.workspace.close(&path);
                self.news = true;
            }
            "textDocument/didSave" => self.changed(uri),
            _ => {}
        }
    }

    fn changed(&mut self, uri: &str) {
        self.workspace.changed(&uri::to_path(uri));
        self.news = true;
    }

    /// Messages with the mistakes of every file for which the editor shows other ones.
    pub fn publish(&mut self) -> Vec<Value> {
        self.news = false;
        let touched = std::mem::take(&mut self.touched);
        let found = std::panic::catch_unwind(AssertUnwindSafe(|| diagnostics::all(&mut self.workspace)));
        let Ok(found) = found else { return Vec::new() };
        let gone: Vec<PathBuf> =
            self.published.keys().filter(|path| !found.contains_key(*path)).cloned().collect();
        let mut messages = Vec::new();
        for path in gone {
            let shown = self.published.remove(&path).unwrap_or_default();
            if !shown.is_empty() {
                messages.push(self.published_message(&path, &[]));
            }
        }
        for (path, list) in found {
            if touched.contains(&path) || self.published.get(&path) != Some(&list) {
                messages.push(self.published_message(&path, &list));
            }
            self.published.insert(path, list);
        }
        messages
    }

    fn published_message(&self, path: &std::path::Path, list: &[Value]) -> Value {
        let mut params = json!({ "uri": self.workspace.uri(path), "diagnostics": list });
        if let Some(document) = self.workspace.document(path) {
            params["version"] = document.version.into();
        }
        json!({ "jsonrpc": "2.0", "method": "textDocument/publishDiagnostics", "params": params })
    }

    /// The document that a request is about.
    fn document(&self, params: &Value) -> Result<PathBuf, Refusal> {
        let uri = params["textDocument"]["uri"].as_str().ok_or(Refusal::Params("textDocument"))?;
        let path = uri::to_path(uri);
        match self.workspace.document(&path) {
            Some(_) => Ok(path),
            None => Err(Refusal::NotOpen(uri.to_owned())),
        }
    }

    fn analysis(&mut self, path: &std::path::Path) -> Result<&Analysis, Refusal> {
        let gone = || Refusal::NotOpen(path.display().to_string());
        self.workspace.analysis(path).ok_or_else(gone)
    }

    /// The document and the byte that a request is about.
    fn place(&mut self, params: &Value) -> Result<(PathBuf, usize), Refusal> {
        let path = self.document(params)?;
        let byte = byte(self.analysis(&path)?, &params["position"], "position")?;
        Ok((path, byte))
    }

    /// The document and the two bytes that a request is about.
    fn span(&mut self, params: &Value) -> Result<(PathBuf, usize, usize), Refusal> {
        let path = self.document(params)?;
        let analysis = self.analysis(&path)?;
        let range = &params["range"];
        let (from, to) = (byte(analysis, &range["start"], "range")?, byte(analysis, &range["end"], "range")?);
        Ok((path, from, to))
    }
}

fn byte(analysis: &Analysis, position: &Value, name: &'static str) -> Result<usize, Refusal> {
    let number = |key: &str| position[key].as_u64().and_then(|number| usize::try_from(number).ok());
    let (line, column) = number("line").zip(number("character")).ok_or(Refusal::Params(name))?;
    Ok(analysis.byte(line, column))
}

/// The message in a body, or the error reply to a body that is not JSON.
pub fn parsed(body: &[u8]) -> Result<Value, Value> {
    serde_json::from_slice(body)
        .map_err(|error| error_reply(&Value::Null, PARSE_ERROR, &format!("the message is not JSON: {error}")))
}

/// The folders that the editor has open, as `initialize` names them.
fn folders(params: &Value) -> Vec<PathBuf> {
    let named = params["workspaceFolders"].as_array().into_iter().flatten();
    let named: Vec<&str> = named.filter_map(|folder| folder["uri"].as_str()).collect();
    let root = params["rootUri"].as_str().filter(|_| named.is_empty());
    named.into_iter().chain(root).map(uri::to_path).collect()
}

fn reply(id: &Value, result: Value) -> Value {
    json!({ "jsonrpc": "2.0", "id": id, "result": result })
}

pub fn error_reply(id: &Value, code: i64, message: &str) -> Value {
    json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message } })
}

/// What the server can do, for the editor.
fn capabilities() -> Value {
    json!({
        "capabilities": {
            "positionEncoding": "utf-16",
            // 1: every change holds the whole text.
            "textDocumentSync": { "openClose": true, "change": 1, "save": {} },
            "hoverProvider": true,
            "completionProvider": { "triggerCharacters": [".", ":", "\"", "[", "("] },
            "definitionProvider": true,
            "referencesProvider": true,
            "documentHighlightProvider": true,
            "renameProvider": { "prepareProvider": true },
            "documentFormattingProvider": true,
            "documentSymbolProvider": true,
            "workspaceSymbolProvider": true,
            "foldingRangeProvider": true,
            "documentLinkProvider": {},
            "signatureHelpProvider": { "triggerCharacters": ["(", ","] },
            "inlayHintProvider": true,
            "semanticTokensProvider": {
                "legend": { "tokenTypes": highlight::TYPES, "tokenModifiers": highlight::MODIFIERS },
                "full": true,
            },
            "codeActionProvider": { "codeActionKinds": ["quickfix"] },
        },
        "serverInfo": { "name": "avastra", "version": env!("CARGO_PKG_VERSION") },
    })
}
