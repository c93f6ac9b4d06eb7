//! `avastra lsp`: the language in an editor, by the Language Server Protocol 3.17 over stdin and stdout.
//!
//! Every question of the protocol is one of `avastra_editor`; here it is read from JSON and its answer written as JSON.
//! A thread reads messages into a queue. The server looks at all queued messages before it answers one. So a request can
//! be cancelled, and a burst of keystrokes is checked once.

mod transport;
mod uri;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::BufReader;
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};

use serde_json::{Map, Value, json};

use avastra_base::outside::Shown;
use avastra_editor::complete::{Proposal, ProposalKind};
use avastra_editor::diagnostics::{Change, Changes, Mistake, Remedy};
use avastra_editor::highlight::Token;
use avastra_editor::outline::{Entry, OutlineKind};
use avastra_editor::{
    Analysis, Files, Place, Point, Range, Workspace, complete, diagnostics, formatting, highlight, hints,
    hover, navigate, outline, rename, signature, structure,
};
use avastra_lang::check::ReadError;
use avastra_lang::syntax::Severity;

use super::error::Failure;
use super::load;
use transport::TransportError;

// Codes of JSON-RPC and of the protocol.
const PARSE_ERROR: i64 = -32700;
const INVALID_REQUEST: i64 = -32600;
const METHOD_NOT_FOUND: i64 = -32601;
const INVALID_PARAMS: i64 = -32602;
const INTERNAL_ERROR: i64 = -32603;
const NOT_INITIALIZED: i64 = -32002;
const REQUEST_FAILED: i64 = -32803;
const REQUEST_CANCELLED: i64 = -32800;

/// The kinds of names, in the order of [`NameKind`](avastra_editor::highlight::NameKind). A token holds the position of its
/// kind in this list.
const TOKEN_TYPES: [&str; 9] =
    ["enum", "enumMember", "variable", "function", "parameter", "event", "namespace", "type", "property"];

/// The modifiers of a token, one bit each.
const TOKEN_MODIFIERS: [&str; 3] = ["declaration", "readonly", "defaultLibrary"];

/// A message from the reading thread.
type Incoming = Result<Vec<u8>, TransportError>;

/// Serves until the editor sends `exit` or closes the input.
///
/// # Errors
/// If the input is not the protocol, or ends without `shutdown`.
pub fn serve() -> Result<(), Failure> {
    let (sender, receiver) = mpsc::channel();
    // The thread ends with the process, because a read from stdin cannot be interrupted.
    let reader = move || {
        let mut input = BufReader::new(std::io::stdin());
        while let Some(message) = transport::read(&mut input).transpose() {
            let is_last = message.is_err();
            if sender.send(message).is_err() || is_last {
                break;
            }
        }
    };
    let begun = std::thread::Builder::new().spawn(reader);
    begun.map_err(|error| Failure::usage(format!("the system gives no thread to read with: {error}")))?;
    let mut server = Server::new();
    let mut waiting: VecDeque<Value> = VecDeque::new();
    loop {
        let ended = take(&receiver, &mut waiting, &mut server)?;
        let Some(message) = waiting.pop_front() else {
            if ended {
                break;
            }
            send(server.publish());
            continue;
        };
        send(server.receive(&message));
        if let Some(in_order) = server.exit {
            return if in_order { Ok(()) } else { Err(Failure::usage("`exit` came without `shutdown`")) };
        }
    }
    match server.stage == Stage::ShutDown {
        true => Ok(()),
        false => Err(Failure::usage("the input ended without `shutdown`")),
    }
}

/// Queues every message that has arrived, and waits for one if there is nothing else to do. Returns whether
/// the input has ended.
fn take(
    receiver: &Receiver<Incoming>,
    waiting: &mut VecDeque<Value>,
    server: &mut Server,
) -> Result<bool, Failure> {
    loop {
        let idle = waiting.is_empty() && !server.news;
        let next = match idle {
            true => receiver.recv().map_err(|_| true),
            false => receiver.try_recv().map_err(|error| error == mpsc::TryRecvError::Disconnected),
        };
        let body = match next {
            Ok(body) => body.map_err(|error| Failure::usage(error.to_string()))?,
            Err(ended) => return Ok(ended),
        };
        match serde_json::from_slice::<Value>(&body) {
            Err(error) => {
                let reason = format!("the message is not JSON: {error}");
                send(vec![error_reply(&Value::Null, PARSE_ERROR, &reason)]);
            }
            Ok(message) if message["method"] == "$/cancelRequest" => {
                cancel(&message["params"]["id"], waiting);
            }
            Ok(message) => waiting.push_back(message),
        }
    }
}

/// Answers a waiting request as cancelled. A request that is done has its answer already.
fn cancel(id: &Value, waiting: &mut VecDeque<Value>) {
    let is_meant = |message: &Value| message["method"].is_string() && message.get("id") == Some(id);
    if let Some(place) = waiting.iter().position(is_meant) {
        waiting.remove(place);
        send(vec![error_reply(id, REQUEST_CANCELLED, "cancelled")]);
    }
}

/// Writes a message. A failure is ignored: the end of the input follows and ends the server.
fn send(messages: Vec<Value>) {
    let mut output = std::io::stdout().lock();
    for message in messages {
        let _ = transport::write(&mut output, &message);
    }
}

/// The files on the disk, which the editor does not have open.
struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> Result<String, ReadError> {
        load::read_used(path)
    }

    fn below(&self, folder: &Path) -> Vec<PathBuf> {
        load::below(folder)
    }

    fn nearby(&self, path: &Path) -> Vec<(String, String)> {
        load::nearby(path)
    }

    fn entries(&self, folder: &Path) -> Vec<(String, bool)> {
        let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
        let named = entries.flatten().map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, entry.path().is_dir())
        });
        named.collect()
    }
}

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

/// A document as the editor knows it.
struct Document {
    /// As the editor spells it.
    uri: String,
    version: i64,
}

/// The state of a conversation with one editor: messages in, messages out.
struct Server {
    stage: Stage,
    /// Set by `exit`: whether `shutdown` came before it.
    exit: Option<bool>,
    workspace: Workspace,
    documents: BTreeMap<PathBuf, Document>,
    /// Whether a document or file has changed since mistakes were last published.
    news: bool,
    /// Documents whose text changed since then.
    touched: BTreeSet<PathBuf>,
    /// The diagnostics that the editor shows, by file.
    published: BTreeMap<PathBuf, Vec<Mistake>>,
}

impl Server {
    fn new() -> Server {
        Server {
            stage: Stage::Fresh,
            exit: None,
            workspace: Workspace::new(Disk),
            documents: BTreeMap::new(),
            news: false,
            touched: BTreeSet::new(),
            published: BTreeMap::new(),
        }
    }

    /// Takes a message in; gives the answers to it.
    fn receive(&mut self, message: &Value) -> Vec<Value> {
        let (id, method) = (message.get("id"), message.get("method").and_then(Value::as_str));
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
                let what = match message.is_object() {
                    true => "neither a request nor a notification",
                    false => "no JSON-RPC object",
                };
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
                let found = hover::hover(self.analysis(&path)?, byte);
                Ok(found.map(|of| json!({ "contents": markdown(&of.text), "range": range(of.range) })).into())
            }
            "textDocument/completion" => {
                let (path, byte) = self.place(params)?;
                let found = complete::complete(&self.workspace, self.known(&path)?, byte);
                let items: Vec<Value> =
                    found.list.iter().map(|proposal| item(proposal, found.range)).collect();
                Ok(json!({ "isIncomplete": false, "items": items }))
            }
            "textDocument/definition" => {
                let (path, byte) = self.place(params)?;
                let found = navigate::definition(self.known(&path)?, byte);
                let places = |places: Vec<Place>| {
                    let places = places.iter().filter(|of| self.can_be_opened(&of.path));
                    places.map(|of| self.location(of)).collect()
                };
                Ok(found.map_or(Value::Null, places))
            }
            "textDocument/references" => {
                let (path, byte) = self.place(params)?;
                let with_declarations = params["context"]["includeDeclaration"].as_bool().unwrap_or(true);
                let found = navigate::references(&mut self.workspace, &path, byte, with_declarations);
                Ok(found.iter().map(|of| self.location(of)).collect())
            }
            "textDocument/documentHighlight" => {
                let (path, byte) = self.place(params)?;
                let found = navigate::highlights(self.analysis(&path)?, byte).into_iter();
                Ok(found.map(|of| json!({ "range": range(of) })).collect())
            }
            "textDocument/prepareRename" => {
                let (path, byte) = self.place(params)?;
                rename::prepare(self.analysis(&path)?, byte).map(range).map_err(Refusal::Impossible)
            }
            "textDocument/rename" => {
                let (path, byte) = self.place(params)?;
                let name = params["newName"].as_str().ok_or(Refusal::Params("newName"))?;
                let changes = rename::rename(&mut self.workspace, &path, byte, name);
                let changes = changes.map_err(Refusal::Impossible)?;
                if let Some(path) = changes.keys().find(|path| !self.can_be_opened(path)) {
                    let reason = format!("it is declared in `{}`, which is built in", path.shown());
                    return Err(Refusal::Impossible(reason));
                }
                Ok(self.edit(&changes))
            }
            "textDocument/formatting" => {
                let path = self.document(params)?;
                let changes = formatting::format(self.analysis(&path)?);
                let changes = changes.map_err(|error| Refusal::Impossible(error.to_string()))?;
                Ok(changes.map_or(Value::Null, |changes| changes.iter().map(change).collect()))
            }
            "textDocument/documentSymbol" => {
                let path = self.document(params)?;
                Ok(outline::symbols(self.analysis(&path)?).iter().map(symbol).collect())
            }
            "textDocument/foldingRange" => {
                let path = self.document(params)?;
                let fold = |of: structure::Fold| {
                    let kind = if of.is_comment { "comment" } else { "region" };
                    json!({ "startLine": of.start, "endLine": of.end, "kind": kind })
                };
                Ok(structure::folds(self.analysis(&path)?).into_iter().map(fold).collect())
            }
            "textDocument/documentLink" => {
                let path = self.document(params)?;
                let found = structure::links(self.analysis(&path)?);
                let link =
                    |(of, path): &(Range, PathBuf)| json!({ "range": range(*of), "target": self.uri(path) });
                Ok(found.iter().filter(|(_, path)| self.can_be_opened(path)).map(link).collect())
            }
            "textDocument/signatureHelp" => {
                let (path, byte) = self.place(params)?;
                let signature = |found: signature::Signature| {
                    let parameters: Value =
                        found.parameters.iter().map(|label| json!({ "label": label })).collect();
                    let text = markdown(&found.text);
                    let of = json!({ "label": found.label, "parameters": parameters, "documentation": text });
                    json!({ "signatures": [of], "activeSignature": 0, "activeParameter": found.due })
                };
                Ok(signature::help(self.analysis(&path)?, byte).map(signature).into())
            }
            "workspace/symbol" => {
                let query = params["query"].as_str().ok_or(Refusal::Params("query"))?;
                let found = structure::search(&self.workspace, query);
                let one = |of: &structure::Found| json!({ "name": of.name, "kind": symbol_kind(of.kind), "location": self.location(&of.place) });
                Ok(found.iter().map(one).collect())
            }
            "textDocument/semanticTokens/full" => {
                let path = self.document(params)?;
                Ok(json!({ "data": token_data(&highlight::tokens(self.analysis(&path)?)) }))
            }
            "textDocument/inlayHint" => {
                let (path, from, to) = self.span(params)?;
                let hint = |hints::Hint { at, label, tooltip }| json!({ "position": point(at), "label": label, "tooltip": tooltip, "paddingLeft": true });
                Ok(hints::hints(self.analysis(&path)?, from, to).into_iter().map(hint).collect())
            }
            "textDocument/codeAction" => {
                let (path, from, to) = self.span(params)?;
                let found = diagnostics::fixes(self.analysis(&path)?, from, to);
                Ok(found.iter().map(|remedy| self.action(remedy)).collect())
            }
            _ => Err(Refusal::UnknownMethod(method.to_owned())),
        }
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
                self.documents.insert(path.clone(), Document { uri: uri.to_owned(), version });
                self.workspace.open(path.clone(), text.to_owned());
                self.touched.insert(path);
                self.news = true;
            }
            "textDocument/didClose" => {
                self.documents.remove(&path);
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
    fn publish(&mut self) -> Vec<Value> {
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

    fn published_message(&self, path: &Path, list: &[Mistake]) -> Value {
        let list: Vec<Value> = list.iter().map(|of| self.mistake(of)).collect();
        let mut params = json!({ "uri": self.uri(path), "diagnostics": list });
        if let Some(document) = self.documents.get(path) {
            params["version"] = document.version.into();
        }
        json!({ "jsonrpc": "2.0", "method": "textDocument/publishDiagnostics", "params": params })
    }

    /// The document that a request is about.
    fn document(&self, params: &Value) -> Result<PathBuf, Refusal> {
        let uri = params["textDocument"]["uri"].as_str().ok_or(Refusal::Params("textDocument"))?;
        let path = uri::to_path(uri);
        match self.workspace.is_open(&path) {
            true => Ok(path),
            false => Err(Refusal::NotOpen(uri.to_owned())),
        }
    }

    fn analysis(&mut self, path: &Path) -> Result<&Analysis, Refusal> {
        self.workspace.analysis(path).ok_or_else(|| Refusal::NotOpen(path.shown().to_string()))
    }

    /// The analysis of a document that [`Server::place`] has brought up to date.
    fn known(&self, path: &Path) -> Result<&Analysis, Refusal> {
        self.workspace.known(path).ok_or_else(|| Refusal::NotOpen(path.shown().to_string()))
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

    /// The URI by which the editor knows a file.
    fn uri(&self, path: &Path) -> String {
        self.documents.get(path).map_or_else(|| uri::from_path(path), |document| document.uri.clone())
    }

    /// Whether an editor finds the file: one that is built in need not be there.
    fn can_be_opened(&self, path: &Path) -> bool {
        self.documents.contains_key(path) || path.exists()
    }

    fn location(&self, place: &Place) -> Value {
        json!({ "uri": self.uri(&place.path), "range": range(place.range) })
    }

    fn edit(&self, changes: &Changes) -> Value {
        let of_file =
            |(path, list): (&PathBuf, &Vec<Change>)| (self.uri(path), list.iter().map(change).collect());
        let changes: Map<String, Value> = changes.iter().map(of_file).collect();
        json!({ "changes": changes })
    }

    fn mistake(&self, mistake: &Mistake) -> Value {
        let severity = match mistake.severity {
            Severity::Error => 1,
            Severity::Warning => 2,
            // 4 is a hint: a note asks for no change and should not look like a mistake.
            Severity::Note => 4,
        };
        let related = mistake.related.iter();
        let related =
            related.map(|(place, text)| json!({ "location": self.location(place), "message": text }));
        let mut shown = json!({
            "range": range(mistake.range),
            "severity": severity,
            "code": mistake.code,
            "source": "avastra",
            "message": mistake.message,
            "relatedInformation": related.collect::<Vec<Value>>(),
        });
        if mistake.is_unnecessary {
            // 1 means unnecessary: editors show the text faded.
            shown["tags"] = json!([1]);
        }
        shown
    }

    fn action(&self, remedy: &Remedy) -> Value {
        json!({
            "title": remedy.title,
            "kind": "quickfix",
            "diagnostics": [self.mistake(&remedy.mistake)],
            "isPreferred": remedy.is_preferred,
            "edit": self.edit(&remedy.changes),
        })
    }
}

fn byte(analysis: &Analysis, position: &Value, name: &'static str) -> Result<usize, Refusal> {
    let number = |key: &str| position[key].as_u64().and_then(|number| usize::try_from(number).ok());
    let (line, column) = number("line").zip(number("character")).ok_or(Refusal::Params(name))?;
    Ok(analysis.byte(line, column))
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

fn error_reply(id: &Value, code: i64, message: &str) -> Value {
    json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message } })
}

fn point(point: Point) -> Value {
    json!({ "line": point.line, "character": point.column })
}

fn range(range: Range) -> Value {
    json!({ "start": point(range.start), "end": point(range.end) })
}

fn markdown(text: &str) -> Value {
    json!({ "kind": "markdown", "value": text })
}

fn change(change: &Change) -> Value {
    json!({ "range": range(change.range), "newText": change.text })
}

/// A proposal, and the range that it replaces. Editors sort by `sortText`.
fn item(proposal: &Proposal, replaced: Range) -> Value {
    let kind = match proposal.kind {
        ProposalKind::Function => 3,
        ProposalKind::Field => 5,
        ProposalKind::Variable => 6,
        ProposalKind::Type => 7,
        ProposalKind::Module => 9,
        ProposalKind::Unit => 11,
        ProposalKind::Enum => 13,
        ProposalKind::Keyword => 14,
        ProposalKind::File => 17,
        ProposalKind::Variant => 20,
        ProposalKind::Constant => 21,
        ProposalKind::Action => 23,
        ProposalKind::Operator => 24,
    };
    let mut item = json!({
        "label": proposal.label,
        "kind": kind,
        "sortText": format!("{}{}", proposal.rank, proposal.label),
        "textEdit": { "range": range(replaced), "newText": proposal.label },
    });
    if !proposal.detail.is_empty() {
        item["detail"] = proposal.detail.as_str().into();
    }
    if !proposal.text.is_empty() {
        item["documentation"] = markdown(&proposal.text);
    }
    item
}

fn symbol(entry: &Entry) -> Value {
    json!({
        "name": entry.name,
        "kind": symbol_kind(entry.kind),
        "range": range(entry.whole),
        "selectionRange": range(entry.range),
        "children": entry.children.iter().map(symbol).collect::<Vec<Value>>(),
    })
}

/// The protocol's number of a kind of symbols.
fn symbol_kind(kind: OutlineKind) -> u32 {
    match kind {
        OutlineKind::Module => 2,
        OutlineKind::Parameter => 8,
        OutlineKind::Enum => 10,
        OutlineKind::Function => 12,
        OutlineKind::State => 13,
        OutlineKind::Constant => 14,
        OutlineKind::List => 18,
        OutlineKind::Block => 19,
        OutlineKind::Variant => 22,
        OutlineKind::Action => 24,
        OutlineKind::Rule => 25,
    }
}

/// Five numbers for each name: lines since the last name, column, length, kind and modifiers. The column counts UTF-16
/// units since the last name or the start of the line.
fn token_data(tokens: &[Token]) -> Vec<usize> {
    let mut data = Vec::new();
    let mut last = Point::default();
    for token in tokens {
        let start = token.range.start;
        let since = if start.line == last.line { start.column - last.column } else { start.column };
        let flags = [token.declares, token.is_constant, token.is_built_in];
        let modifiers: usize =
            flags.iter().enumerate().map(|(bit, is_set)| usize::from(*is_set) << bit).sum();
        // No name has a line break in it.
        let length = token.range.end.column - start.column;
        data.extend([start.line - last.line, since, length, token.kind as usize, modifiers]);
        last = start;
    }
    data
}

/// The capabilities of the server, for the editor.
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
                "legend": { "tokenTypes": TOKEN_TYPES, "tokenModifiers": TOKEN_MODIFIERS },
                "full": true,
            },
            "codeActionProvider": { "codeActionKinds": ["quickfix"] },
        },
        "serverInfo": { "name": "avastra", "version": env!("CARGO_PKG_VERSION") },
    })
}
