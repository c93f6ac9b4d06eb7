//! The server as an editor meets it: messages over pipes, in documents that are never finished.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

use crate::cases::{expect_snapshot, root};
use crate::command::done;

/// An editor with a server.
struct Editor {
    process: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    requests: u64,
    version: i64,
}

impl Editor {
    /// A server that has got no message yet.
    fn start() -> Editor {
        let mut process = Command::new(env!("CARGO_BIN_EXE_avastra"))
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let input = process.stdin.take();
        let output = BufReader::new(process.stdout.take().expect("stdout is piped"));
        Editor { process, input, output, requests: 0, version: 0 }
    }

    /// A server that is ready.
    fn ready() -> Editor {
        let mut editor = Editor::start();
        editor.ask("initialize", json!({ "capabilities": {} })).expect("it can be initialized");
        editor.tell("initialized", json!({}));
        editor
    }

    fn raw(&mut self, bytes: &[u8]) {
        let input = self.input.as_mut().expect("the input is open");
        input.write_all(bytes).expect("the server reads");
        input.flush().expect("the server reads");
    }

    fn send(&mut self, body: &str) {
        self.raw(format!("Content-Length: {}\r\n\r\n{body}", body.len()).as_bytes());
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }).to_string());
    }

    /// Waits for the next message of the server.
    fn hear(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            assert_ne!(self.output.read_line(&mut line).expect("the server writes UTF-8"), 0, "it ended");
            match line.trim_end().split_once(": ") {
                Some(("Content-Length", value)) => length = value.parse().expect("a length"),
                _ => break,
            }
        }
        let mut body = vec![0; length];
        self.output.read_exact(&mut body).expect("the body is as long as it says");
        serde_json::from_slice(&body).expect("the server writes JSON")
    }

    /// The result of a request, or its error.
    fn ask(&mut self, method: &str, params: Value) -> Result<Value, Value> {
        self.requests += 1;
        let id = self.requests;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }).to_string());
        loop {
            let answer = self.hear();
            if answer["id"] == id {
                return match answer.get("error") {
                    Some(error) => Err(error.clone()),
                    None => Ok(answer["result"].clone()),
                };
            }
        }
    }

    /// Opens a document, or gives it another text. Returns its mistakes.
    fn write(&mut self, uri: &str, text: &str) -> Vec<Value> {
        self.version += 1;
        if self.version == 1 || text.is_empty() {
            let document =
                json!({ "uri": uri, "languageId": "avastra", "version": self.version, "text": text });
            self.tell("textDocument/didOpen", json!({ "textDocument": document }));
        } else {
            let document = json!({ "uri": uri, "version": self.version });
            let changes = json!([{ "text": text }]);
            self.tell(
                "textDocument/didChange",
                json!({ "textDocument": document, "contentChanges": changes }),
            );
        }
        self.mistakes(uri)
    }

    /// Waits for the next list of mistakes of a document.
    fn mistakes(&mut self, uri: &str) -> Vec<Value> {
        loop {
            let message = self.hear();
            if message["method"] == "textDocument/publishDiagnostics" && message["params"]["uri"] == uri {
                return message["params"]["diagnostics"].as_array().expect("a list").clone();
            }
        }
    }

    /// Asks about the place of `|` in a text, which is written without it.
    fn ask_at(&mut self, method: &str, uri: &str, marked: &str, more: Value) -> Result<Value, Value> {
        let (text, position) = unmarked(marked);
        self.write(uri, &text);
        let mut params = json!({ "textDocument": { "uri": uri }, "position": position });
        for (key, value) in more.as_object().into_iter().flatten() {
            params[key] = value.clone();
        }
        self.ask(method, params)
    }

    /// What the server knows of the place of `|`.
    fn find(&mut self, what: &str, uri: &str, marked: &str) -> Value {
        let found = self.ask_at(&format!("textDocument/{what}"), uri, marked, json!({}));
        found.expect("it can be asked")
    }

    fn rename(&mut self, uri: &str, marked: &str, name: &str) -> Result<Value, Value> {
        self.ask_at("textDocument/rename", uri, marked, json!({ "newName": name }))
    }

    /// The labels that are proposed at `|`, best first.
    fn proposals(&mut self, marked: &str) -> Vec<String> {
        let list = self.find("completion", &space_uri(), marked);
        let mut items: Vec<(String, String)> = list["items"]
            .as_array()
            .expect("a list")
            .iter()
            .map(|item| (text(&item["sortText"]), text(&item["label"])))
            .collect();
        items.sort();
        items.into_iter().map(|(_, label)| label).collect()
    }

    fn hover(&mut self, marked: &str) -> String {
        text(&self.find("hover", &space_uri(), marked)["contents"]["value"])
    }

    /// Ends the input. Returns exit status and stderr.
    fn end(mut self) -> (i32, String) {
        drop(self.input.take());
        let mut said = String::new();
        let stderr = self.process.stderr.take();
        stderr.expect("stderr is piped").read_to_string(&mut said).expect("it is text");
        let status = self.process.wait().expect("it ends");
        (status.code().expect("no signal ends it"), said)
    }
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// A document beside the shipped roads.
fn space_uri() -> String {
    uri(&root().join("scenarios/unsaved.ava"))
}

fn shipped() -> String {
    std::fs::read_to_string(root().join("scenarios/avastra45.ava")).expect("it is shipped")
}

/// The text without its one `|`, and where that was. `||` stands for a `|` of the text.
fn unmarked(marked: &str) -> (String, Value) {
    let plain = marked.replace("||", "\u{1}");
    let at = plain.find('|').expect("a place is marked");
    let before = plain[..at].replace('\u{1}', "|");
    let line = before.matches('\n').count();
    let column = before.rsplit('\n').next().unwrap_or_default().encode_utf16().count();
    let text = plain.replacen('|', "", 1).replace('\u{1}', "|");
    (text, json!({ "line": line, "character": column }))
}

/// The shipped space with a mark behind the first `before`.
fn marked(before: &str) -> String {
    let text = shipped().replace('|', "||");
    let before = before.replace('|', "||");
    assert!(text.contains(&before), "{before}");
    text.replacen(&before, &format!("{before}|"), 1)
}

/// A text after the edits of one document.
fn edited(text: &str, edits: &Value) -> String {
    let starts: Vec<usize> =
        std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let byte = |place: &Value| {
        let line = place["line"].as_u64().expect("a line") as usize;
        let column = place["character"].as_u64().expect("a column") as usize;
        let start = starts[line];
        let units: Vec<u16> = text[start..].encode_utf16().take(column).collect();
        start + String::from_utf16(&units).expect("between characters").len()
    };
    let mut edits: Vec<(usize, usize, String)> = edits
        .as_array()
        .expect("a list")
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            (byte(&range["start"]), byte(&range["end"]), self::text(&edit["newText"]))
        })
        .collect();
    edits.sort();
    let mut text = text.to_owned();
    for (from, to, new) in edits.into_iter().rev() {
        text.replace_range(from..to, &new);
    }
    text
}

/// One line for each mistake.
fn shown(mistakes: &[Value]) -> String {
    let line = |mistake: &Value| {
        let (start, end) = (&mistake["range"]["start"], &mistake["range"]["end"]);
        let related = mistake["relatedInformation"].as_array().map_or(0, Vec::len);
        format!(
            "{}:{}..{}:{} {} {} {} (+{related})\n",
            start["line"],
            start["character"],
            end["line"],
            end["character"],
            mistake["severity"],
            text(&mistake["code"]),
            text(&mistake["message"]).replace('\n', " / "),
        )
    };
    mistakes.iter().map(line).collect()
}

#[test]
fn mistakes_appear_and_vanish_as_one_types() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    let sound = editor.write(&uri, &shipped());
    assert!(sound.iter().all(|found| found["severity"] == 4), "{}", shown(&sound));
    // Four mistakes far apart.
    let broken = shipped()
        .replace("let weight_size = 1.0", "let weight_size = 12 m + 3 s")
        .replace("rule walking_pace on pedestrian: speed", "rule walking_pace on pedestrain: speed")
        .replace("speed <= 1.4 m/s", "speed <= 1.4 furlong")
        .replace("rule ped_gap on", "rule npc_gap on");
    let found = editor.write(&uri, &broken);
    // A character of two UTF-16 units before a mistake on the same line.
    let odd = shipped().replace("rule no_teleport:", "rule no_teleport 🚗 £ :");
    let all = format!("{}\n{}", shown(&found), shown(&editor.write(&uri, &odd)));
    expect_snapshot("editor", "mistakes", &all);
    let unfinished = shipped().replace("limit: 20 steps", "limit: 20 steps stop");
    let found = editor.write(&uri, &unfinished);
    assert_eq!(found.len(), 1, "{}", shown(&found));
    assert_eq!(editor.write(&uri, &shipped()), sound);
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": uri } }));
    assert_eq!(editor.mistakes(&uri), Vec::<Value>::new());
}

#[test]
fn a_used_file_is_read_from_the_editor() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let (a, b) = (uri(&scratch.path().join("a.ava")), uri(&scratch.path().join("b.ava")));
    std::fs::write(scratch.path().join("b.ava"), "language 1\nlet far = 50 m\n").expect("it is writable");
    let text = "language 1\nuse \"b.ava\"\nfn twice() -> Length = far * 2\n";
    let mut editor = Editor::ready();
    assert_eq!(editor.write(&a, text), Vec::<Value>::new());
    // The editor's text of the used file differs from the one on the disk.
    let document = json!({ "uri": b, "version": 7, "text": "language 1\nlet far = 50 s\n" });
    editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
    let found = editor.mistakes(&a);
    assert_eq!(text_of(&found), ["AV0201"], "{}", shown(&found));
    // A mistake in the used file is reported there.
    let document = json!({ "uri": b, "version": 8 });
    let changes = json!([{ "text": "language 1\nlet far = \n" }]);
    editor.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": changes }));
    assert_eq!(editor.mistakes(&a), Vec::<Value>::new());
    assert_eq!(text_of(&editor.mistakes(&b)), ["AV0001"]);
    // Once the used file is closed, the text on the disk counts.
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": b } }));
    assert_eq!(editor.mistakes(&b), Vec::<Value>::new());
    // The file changes on the disk, and the editor did not change it.
    std::fs::write(scratch.path().join("b.ava"), "language 1\nlet fur = 50 m\n").expect("it is writable");
    editor.tell("workspace/didChangeWatchedFiles", json!({ "changes": [{ "uri": b, "type": 2 }] }));
    assert_eq!(text_of(&editor.mistakes(&a)), ["AV0101"]);
}

fn text_of(mistakes: &[Value]) -> Vec<String> {
    mistakes.iter().map(|mistake| text(&mistake["code"])).collect()
}

#[test]
fn hovers_say_what_the_compiler_knows() {
    let mut editor = Editor::ready();
    let places = [
        "any distance: Length in 1 m",
        "action drive_ah",
        "rule npc_sp",
        "rule npc_speed on vehicles: sp",
        "on vehicles: speed <= road.lim",
        "gap(mode, size(vehicle), sp",
        "fn lea",
        "what counts",
        "drive_ahead(\n  each lane: La",
        "state sk",
        "roads: [residential, corn",
        "does: DriveAh",
        "spa",
        "set sky[Rain] = ho",
        "use \"roads",
    ];
    let mut all = String::new();
    for place in places {
        let text = marked(match place {
            "what counts" => "/// What counts",
            "spa" => "{\n  spa",
            place => place,
        });
        let name = place.replace('\n', " ");
        let said = editor.hover(&text).replace(&root().display().to_string(), "…");
        all.push_str(&format!("## {name}\n\n{said}\n\n"));
    }
    let exact = editor.hover("language 1\nlet fast = 50 km|/h\n");
    all.push_str(&format!("## 50 km/h\n\n{exact}\n\n"));
    editor.write(&space_uri(), &shipped());
    // With the name of a parameter, and a broken line elsewhere, everything known before is still known.
    let broken = marked("any vehicle: Vehicle,\n  any colour: Colour,\n  any sp")
        .replace("group environment =", "group environment = = =");
    all.push_str(&format!("## in a broken file\n\n{}\n", editor.hover(&broken)));
    expect_snapshot("editor", "hover", &all);
}

#[test]
fn proposals_fit_their_place() {
    let mut editor = Editor::ready();
    editor.write(&space_uri(), "");
    let head = "language 1\nenum Side = Left || Right\nenum Level = None < High\nenum Sky = Rain || Fog\n\
                state sky: Sky -> Level = None\nlet far = 50 m\nfn near(s: Side) -> Length = far\n\
                action cross(each from: Side, any pace: Speed in 1 m/s .. 2 m/s) {\n  \
                spawn Pedestrian ahead far { side: from, speed: pace, does: Walk }\n}\n\
                group all = cross\nroad corner { map: \"roads/corner.xodr\" start: lane 1/-1 at 5 m goal: lane 5/-3 at 7 m }\n";
    let places = [
        "|",
        "ru|",
        "state other: |",
        "state other: Side = |",
        "action a(|",
        "action a(each x: |",
        "action a(each x: Side |",
        "action a(each x: Level where x > |",
        "action a(any x: Speed in 10 |",
        "action a(each x: Side) {\n  |",
        "action a(each x: Side) {\n  set |",
        "action a(each x: Side) {\n  set sky[|",
        "action a(each x: Side) {\n  set sky = |",
        "each step {\n  set sky[Fog] = match step >= 2 and eg|",
        "odds actions { cross => |",
        "action a(each x: Side) {\n  spawn |",
        "action a(each x: Side) {\n  spawn Sedan ahead 5 m { lane: Current, |",
        "action a(each x: Side) {\n  spawn Sedan ahead 5 m { does: |",
        "action a(each x: Side) {\n  spawn Sedan ahead 5 m { side: |",
        "action a() {\n  spawn Sedan as v ahead 5 m { } order |",
        "action a() {\n  spawn Sedan as v ahead 5 m { } order v { keep: 5 m, to: |",
        "action a() {\n  order light { |",
        "action a() {\n  order light { colour: |",
        "trajectory t { points: [{ |",
        "action a() {\n  spawn Sedan on |",
        "rule r |",
        "rule r on |",
        "rule r on all: |",
        "rule r on all: pace |",
        "rule r on all: pace <= road.|",
        "rule r on all: pace <= ego.|",
        "rule r on all: from == |",
        "rule r: sky[Rain] == |",
        "rule r: road == |",
        "rule r: road in [|",
        "odds Level {\n  |",
        "use \"roads.ava\" without |",
        "fn f(s: Side) -> Length = match s { |",
        "fn f(s: Side) -> Length = near(|",
        "episode {\n  step: 6 s\n  |",
        "episode { roads: [|",
        "episode { stop: |",
        "verdict v: |",
        "expect count(|",
        "road r { map: \"a.xodr\", |",
        "scenario s {\n  |",
        "scenario s { road: |",
        "scenario s { road: corner steps { 0: |",
        "scenario s { road: corner steps { 0: cross(|",
        "scenario s { road: corner steps { 0: cross(from: |",
        "scenario s { road: corner steps { 0: cross(from: Left) with { |",
        "scenario s { road: corner start { sky: { Rain: |",
        "scenario s { road: corner steps { } expect end == |",
        "policy p { rules {\n    when from == Left => |",
        "override |",
        "// nothing in a comment |",
    ];
    let mut all = String::new();
    for place in places {
        let proposals = editor.proposals(&format!("{head}{place}"));
        let rest =
            if proposals.len() > 9 { format!(" … {} in all", proposals.len()) } else { String::new() };
        let first: Vec<&str> = proposals.iter().take(9).map(String::as_str).collect();
        all.push_str(&format!("{}\n    {}{rest}\n", place.replace('\n', "⏎"), first.join(" ")));
    }
    expect_snapshot("editor", "proposals", &all);
    // Files beside the document, as far as they fit.
    let files = editor.proposals(&format!("{head}use \"ro|"));
    assert!(files.iter().any(|file| file == "roads.ava"), "{files:?}");
    let maps = editor.proposals("language 1\nroad r { map: \"roads/|\" }\n");
    assert!(maps.iter().any(|map| map == "roads/corner.xodr"), "{maps:?}");
}

#[test]
fn definitions_and_references_cross_files() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    let roads = self::uri(&root().join("scenarios/roads.ava"));
    let found = editor.find("definition", &uri, &marked("roads: [residential, corn"));
    assert_eq!(found[0]["uri"], roads.as_str());
    assert_eq!(found[0]["range"]["start"], json!({ "line": 4, "character": 5 }));
    let found = editor.find("definition", &uri, &marked("use \"roads"));
    assert_eq!(found[0]["uri"], roads.as_str());
    let found = editor.find("references", &uri, &marked("enum Mode = Ne"));
    assert_eq!(found.as_array().map(Vec::len), Some(4));
    // A rule over a group names a parameter of each of its actions.
    let found = editor.find("definition", &uri, &marked("rule npc_speed on vehicles: sp"));
    assert_eq!(found.as_array().map(Vec::len), Some(4));
    let context = json!({ "context": { "includeDeclaration": false } });
    let found = editor.ask_at("textDocument/references", &uri, &marked("fn si"), context);
    assert_eq!(found.expect("it can be asked").as_array().map(Vec::len), Some(1));
    let found = editor.find("documentHighlight", &uri, &marked("state sk"));
    assert_eq!(found.as_array().map(Vec::len), Some(12));
    assert_eq!(editor.find("definition", &uri, &marked("\nlangua")), Value::Null);
}

#[test]
fn odds_and_roads_in_rules_are_names_too() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    let own = "language 1\nuse \"avastra45.ava\" without set_time, chronology\nodds Vehicle { BoxTruck => 2 }\n\
               rule quiet on pedestrian: road == corner implies speed <= 1 m/s\n";
    let mut lines = |before: &str| {
        let marked = own.replacen(before, &format!("{before}|"), 1);
        let found = editor.find("definition", &uri, &marked);
        text(&found[0]["uri"]).rsplit('/').next().unwrap_or_default().to_owned()
    };
    for before in ["without set_", "chrono", "odds Veh", "BoxTr", "on pedes"] {
        assert_eq!(lines(before), "avastra45.ava", "{before}");
    }
    assert_eq!(lines("road == cor"), "roads.ava");
}

#[test]
fn renames_are_tried_first() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    let mut rename = |before: &str, name: &str| editor.rename(&uri, &marked(before), name);
    // One parameter of four actions, and its uses in rules and effects.
    let found = rename("rule npc_speed on vehicles: sp", "pace").expect("it can be renamed");
    let edits = &found["changes"][&uri];
    assert_eq!(edits.as_array().map(Vec::len), Some(10));
    let renamed = edited(&shipped(), edits);
    assert!(renamed.contains("rule npc_speed on vehicles: pace <= road.limit"), "{renamed}");
    assert!(renamed.contains("rule walking_pace on pedestrian: speed <= 1.4 m/s"), "{renamed}");
    // Into a used file.
    let found = rename("roads: [residential, corn", "bend").expect("it can be renamed");
    let roads = self::uri(&root().join("scenarios/roads.ava"));
    assert_eq!(found["changes"][&roads].as_array().map(Vec::len), Some(1), "{found}");
    assert_eq!(found["changes"][&uri].as_array().map(Vec::len), Some(1));

    let refused = [
        ("does: DriveAh", "x", "`DriveAhead` is a word of the engine"),
        ("state ti", "clock", "the world reads the state `time` by this name"),
        ("each lane: La", "x y", "`x y` is no name"),
        ("each lane: La", "match", "`Lane` cannot be called `match`"),
        ("enum Colour = Pi", "Rose", "`Pink` cannot be called `Rose`"),
        ("fn si", "base", "`size` cannot be called `base`"),
        ("any speed: Spe", "x", "`Speed` is a type of the language"),
        ("any distance: Length in 1 m", "x", "a number has no name"),
        ("\nacti", "x", "`action` is a word of the language"),
        ("verdict coun", "x", "`counted` is the verdict by which collisions count"),
    ];
    for (before, name, reason) in refused {
        let error = rename(before, name).expect_err(before);
        assert_eq!(error["code"], -32803, "{error}");
        assert!(text(&error["message"]).contains(reason), "{error}");
    }
    // Without a mistake, but the rule would compare the parameter with itself.
    let own = "language 1\nuse \"avastra45.ava\"\nlet fa|st = 12 m/s\nrule slow on vehicles: speed <= fast\n";
    let error = editor.rename(&uri, own, "speed").expect_err("the parameter hides it");
    assert!(text(&error["message"]).contains("would stand for something else"), "{error}");
    let broken = marked("fn si").replace("group environment =", "group environment = =");
    let error = editor.rename(&uri, &broken, "bulk").expect_err("it is broken");
    assert!(text(&error["message"]).contains("repair the syntax"));
    let range = editor.find("prepareRename", &uri, &marked("fn si"));
    assert_eq!(range["end"]["character"], 7);
}

/// A file that overrides a declaration of another.
const OVERRIDING: (&str, &str) = (
    "language 1\nlet far = 50 m\nfn twice(d: Length) -> Length = d * 2\nfn reach(pace: Speed) -> Length = pace * 3 s + twice(d: far)\n",
    "language 1\nuse \"base.ava\"\noverride fn reach(pace: Speed) -> Length = pace * 2 s\n",
);

#[test]
fn an_overridden_declaration_is_known_too() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    std::fs::write(scratch.path().join("base.ava"), OVERRIDING.0).expect("it is writable");
    let base = uri(&scratch.path().join("base.ava"));
    let own = uri(&scratch.path().join("own.ava"));
    let mut editor = Editor::ready();
    // From the override to what it replaces, and the body of that is known: `far` and `twice` are used there.
    let marked = OVERRIDING.1.replace("fn rea", "fn rea|");
    let found = editor.find("definition", &own, &marked);
    assert_eq!(found.as_array().map(Vec::len), Some(1));
    assert_eq!((&found[0]["uri"], &found[0]["range"]["start"]["line"]), (&json!(base), &json!(3)));
    let said = editor.find("hover", &own, &marked);
    assert!(text(&said["contents"]["value"]).contains("pace * 2 s"), "{said}");
    let found = editor.rename(&own, &marked, "range").expect("both are renamed");
    let changes = [&found["changes"][&base], &found["changes"][&own]];
    assert_eq!(changes.map(|edits| edits.as_array().map(Vec::len)), [Some(1), Some(1)], "{found}");
    let more = OVERRIDING.1.to_owned() + "fn more() -> Length = fa|r\n";
    let found = editor.find("references", &own, &more);
    assert_eq!(found.as_array().map(Vec::len), Some(3), "{found}");
    let more = OVERRIDING.1.to_owned() + "fn more() -> Length = twice(d|: 5 m)\n";
    let found = editor.rename(&own, &more, "length").expect("the overridden use is renamed");
    assert_eq!(found["changes"][&base].as_array().map(Vec::len), Some(3), "{found}");
}

#[test]
fn a_half_written_declaration_keeps_its_names() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    let head = "language 1\nenum Side = Left || Right\nlet far = 50 m\nfn near(s: Side) -> Length = far\nstate seen: Side = any\n";
    // In each text something before the name is unknown, lacking or of a wrong type.
    let places = [
        ("fn f(s: Nothing) -> Length = near(Left) + fa|r\n", 2, "Type: `Length`"),
        ("fn f(s: Side) -> Length = unknown(fa|r)\n", 2, "Type: `Length`"),
        ("fn f(s: Side) -> Length = match nothing { Left => fa|r }\n", 2, "Type: `Length`"),
        ("fn f(s: Side) -> Length = near(Left, Right, fa|r)\n", 2, "Type: `Length`"),
        ("action a(each x: Nothing) {\n  set nothing = fa|r\n}\n", 2, "Type: `Length`"),
        (
            "action a(each x: Side where x == nothing, any y: Nothing in 1 m .. fa|r) {\n}\n",
            2,
            "Type: `Length`",
        ),
        ("action a(any y: Length where y > fa|r) {\n  set seen = Left\n}\n", 2, "Type: `Length`"),
        ("action a(any y: Length in 1 m .. far) {\n  set seen[nothing] = Ri|ght\n}\n", 1, "variant 2 of 2"),
        ("rule r on nothing: se|en == Left\n", 4, "Type: `Side`"),
        ("rule r on nothing {\n  Left -> Ri|ght\n}\n", 1, "variant 2 of 2"),
        ("odds Nothing {\n  Ri|ght => 2\n}\n", 1, "variant 2 of 2"),
        ("state other: Nothing = Ri|ght\n", 1, "variant 2 of 2"),
        ("scenario s { road: nothing start { seen: Ri|ght } steps { } }\n", 1, "variant 2 of 2"),
    ];
    for (place, line, wanted) in places {
        // A line that does not parse, elsewhere: the rest of the file is known all the same.
        for broken in ["", "group g = = =\n"] {
            let marked = format!("{head}{broken}{place}");
            let found = editor.find("definition", &uri, &marked);
            assert_eq!(found[0]["range"]["start"]["line"], line, "{broken}{place}: {found}");
            let said = editor.hover(&marked);
            assert!(said.contains(wanted), "{broken}{place}: {said}");
        }
    }
    let marked = format!("{head}fn f(s: Nothing) -> Length = near(Left) + fa|r\n");
    let found = editor.rename(&uri, &marked, "away").expect("a mistake beside it is no reason not to");
    assert_eq!(found["changes"][&uri].as_array().map(Vec::len), Some(3), "{found}");
}

#[test]
fn a_rename_reaches_files_that_are_not_open() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let write = |name: &str, text: &str| {
        std::fs::create_dir_all(scratch.path().join("deep")).expect("it is writable");
        std::fs::write(scratch.path().join(name), text).expect("it is writable");
    };
    write("deep/user.ava", "language 1\nuse \"../base.ava\"\nfn twice() -> Length = far * 2\n");
    write("stranger.ava", "language 1\nlet far = 2 s\n");
    let mut editor = Editor::start();
    let folder = json!([{ "uri": uri(scratch.path()), "name": "all" }]);
    editor.ask("initialize", json!({ "workspaceFolders": folder })).expect("it can be initialized");
    let base = uri(&scratch.path().join("base.ava"));
    let marked = "language 1\nlet fa|r = 50 m\n";
    let found = editor.rename(&base, marked, "away").expect("it can be renamed");
    let user = uri(&scratch.path().join("deep/user.ava"));
    assert_eq!(found["changes"].as_object().map(serde_json::Map::len), Some(2), "{found}");
    assert_eq!(found["changes"][&user][0]["range"]["start"], json!({ "line": 2, "character": 23 }));
    // A clash in a file that is not open is a reason to refuse.
    write("deep/user.ava", "language 1\nuse \"../base.ava\"\nlet away = far * 2\n");
    let error = editor.rename(&base, marked, "away").expect_err("the name is taken there");
    assert!(text(&error["message"]).contains("`far` cannot be called `away`"), "{error}");
}

#[test]
fn formatting_is_that_of_fmt() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    let ask = |editor: &mut Editor, text: &str| {
        editor.write(&uri, text);
        editor.ask("textDocument/formatting", json!({ "textDocument": { "uri": uri }, "options": {} }))
    };
    let wild = shipped().replace("fn size(v: Vehicle)", "fn   size( v:Vehicle )  ").replace('\n', "\r\n");
    let edits = ask(&mut editor, &shipped().replace("fn size(v: Vehicle)", "fn   size( v:Vehicle )  "));
    let edits = edits.expect("it can be formatted");
    assert_eq!(edits.as_array().map(Vec::len), Some(1));
    let text = shipped().replace("fn size(v: Vehicle)", "fn   size( v:Vehicle )  ");
    assert_eq!(edited(&text, &edits), shipped());
    assert_eq!(ask(&mut editor, &shipped()), Ok(json!([])));
    assert_eq!(ask(&mut editor, "language 1\nlet x = \n"), Ok(Value::Null), "a broken file stays as it is");
    assert!(ask(&mut editor, &wild).is_ok_and(|edits| edits.as_array().map(Vec::len) == Some(1)));
}

#[test]
fn outlines_hints_and_quick_fixes() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    editor.write(&uri, &shipped());
    let document = json!({ "textDocument": { "uri": uri } });
    let symbols = editor.ask("textDocument/documentSymbol", document).expect("it has an outline");
    let mut outline = String::new();
    for symbol in symbols.as_array().expect("a list") {
        let children: Vec<String> =
            symbol["children"].as_array().into_iter().flatten().map(|child| text(&child["name"])).collect();
        let line = &symbol["selectionRange"]["start"]["line"];
        let (kind, name) = (&symbol["kind"], text(&symbol["name"]));
        outline.push_str(&format!("{line} {kind} {name} [{}]\n", children.join(" ")));
    }
    let all = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 9999, "character": 0 } });
    let params = json!({ "textDocument": { "uri": uri }, "range": all });
    let hints = editor.ask("textDocument/inlayHint", params).expect("it has hints");
    for hint in hints.as_array().expect("a list") {
        let place = &hint["position"];
        let tooltip = text(&hint["tooltip"]).replace('\n', " / ");
        let (line, column, label) = (&place["line"], &place["character"], text(&hint["label"]));
        outline.push_str(&format!("hint {line}:{column} {label} ({tooltip})\n"));
    }
    expect_snapshot("editor", "outline", &outline);

    let document = json!({ "textDocument": { "uri": uri } });
    let data =
        editor.ask("textDocument/semanticTokens/full", document).expect("it has tokens")["data"].clone();
    let data: Vec<u64> = serde_json::from_value(data).expect("numbers");
    // `Time`, a declared enum, and `Morning`, its first variant, on line 9.
    assert_eq!(data[..10], [9, 5, 4, 0, 1, 0, 7, 7, 1, 1]);

    let broken = shipped().replace("rule npc_speed on vehicles", "rule npc_speed on vehicels");
    let found = editor.write(&uri, &broken);
    let params = json!({ "textDocument": { "uri": uri }, "range": found[0]["range"], "context": { "diagnostics": found } });
    let actions = editor.ask("textDocument/codeAction", params).expect("it can be asked");
    assert_eq!(actions[0]["title"], "write `vehicles`");
    assert_eq!(actions[0]["kind"], "quickfix");
    assert_eq!(edited(&broken, &actions[0]["edit"]["changes"][&uri]), shipped());
}

#[test]
fn whatever_comes_is_answered() {
    let mut editor = Editor::start();
    let code = |answer: Result<Value, Value>| answer.map_err(|error| error["code"].clone());
    assert_eq!(code(editor.ask("textDocument/hover", json!({}))), Err(json!(-32002)));
    editor.ask("initialize", json!({})).expect("it can be initialized");
    assert_eq!(code(editor.ask("initialize", json!({}))), Err(json!(-32600)));
    assert_eq!(code(editor.ask("textDocument/moonPhase", json!({}))), Err(json!(-32601)));
    let hover = "textDocument/hover";
    assert_eq!(code(editor.ask(hover, json!({}))), Err(json!(-32602)));
    assert_eq!(code(editor.ask(hover, json!([1]))), Err(json!(-32602)));
    let closed = json!({ "textDocument": { "uri": "file:///nowhere.ava" }, "position": { "line": 0, "character": 0 } });
    assert_eq!(code(editor.ask(hover, closed)), Err(json!(-32602)));
    editor.write(&space_uri(), "language 1\n");
    for place in
        [json!({ "line": -1, "character": 0 }), json!({ "line": 1e30, "character": "x" }), json!(null)]
    {
        let params = json!({ "textDocument": { "uri": space_uri() }, "position": place });
        assert_eq!(code(editor.ask(hover, params)), Err(json!(-32602)));
    }
    let far = json!({ "textDocument": { "uri": space_uri() }, "position": { "line": 4_000_000_000_u32, "character": 9 } });
    assert_eq!(code(editor.ask(hover, far)), Ok(Value::Null));
    for (garbage, wanted) in [
        ("no JSON", -32700),
        ("{\"jsonrpc\":", -32700),
        ("[]", -32600),
        ("7", -32600),
        ("{\"id\":1}", -32600),
        ("{\"id\":{},\"method\":\"x\"}", -32600),
    ] {
        editor.send(garbage);
        let answer = editor.hear();
        assert_eq!((&answer["error"]["code"], &answer["id"]), (&json!(wanted), &Value::Null), "{garbage}");
    }
    editor.send(&"[".repeat(100_000));
    assert_eq!(editor.hear()["error"]["code"], -32700);
    editor.raw(b"Content-Length: 2\r\n\r\n\xff\xfe");
    assert_eq!(editor.hear()["error"]["code"], -32700);
    // Unknown notices, answers without a request, documents without their text.
    editor.tell("$/setTrace", json!({ "value": "off" }));
    editor.tell("textDocument/didOpen", json!({ "textDocument": { "uri": "file:///x.ava" } }));
    editor.tell("textDocument/didChange", json!({ "textDocument": { "uri": 7 }, "contentChanges": 3 }));
    editor.send("{\"jsonrpc\":\"2.0\",\"id\":99,\"result\":null}");
    assert_eq!(editor.ask("shutdown", Value::Null), Ok(Value::Null));
    assert_eq!(code(editor.ask("textDocument/hover", json!({}))), Err(json!(-32600)));
    editor.tell("exit", Value::Null);
    assert_eq!(editor.end(), (0, String::new()));
}

#[test]
fn the_server_ends_with_its_editor() {
    let (status, said) = Editor::ready().end();
    assert_eq!(status, 1);
    assert!(said.contains("ended without `shutdown`"), "{said}");
    let mut editor = Editor::ready();
    editor.tell("exit", Value::Null);
    assert_eq!(editor.end().0, 1);
    for garbage in ["GET / HTTP/1.1\r\n\r\n", "Content-Length: 99\r\n\r\n{}", "Content-Length: many\r\n\r\n"]
    {
        let mut editor = Editor::start();
        editor.raw(garbage.as_bytes());
        let (status, said) = editor.end();
        assert_eq!(status, 1, "{garbage}");
        assert!(said.starts_with("error: "), "{said}");
    }
}

#[test]
fn a_request_can_be_cancelled_while_it_waits() {
    let mut editor = Editor::ready();
    editor.write(&space_uri(), &shipped());
    let mut burst = String::new();
    let mut add = |message: Value| {
        let body = message.to_string();
        burst.push_str(&format!("Content-Length: {}\r\n\r\n{body}", body.len()));
    };
    let range = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 0, "character": 0 } });
    let params = json!({ "textDocument": { "uri": space_uri() }, "range": range });
    add(json!({ "id": 900, "method": "textDocument/inlayHint", "params": params }));
    add(json!({ "id": 901, "method": "textDocument/inlayHint", "params": params }));
    add(json!({ "method": "$/cancelRequest", "params": { "id": 901 } }));
    editor.raw(burst.as_bytes());
    // The first request may be done before the burst is read to its end; the second is done or cancelled.
    // Each has one answer.
    let mut answers = vec![editor.hear(), editor.hear()];
    answers.sort_by_key(|answer| answer["id"].as_u64());
    assert_eq!(answers[0]["id"], 900);
    assert_eq!(answers[1]["id"], 901);
    let code = &answers[1]["error"]["code"];
    assert!(*code == -32800 || answers[1].get("result").is_some(), "{answers:?}");
}

#[test]
fn no_prefix_of_a_file_breaks_anything() {
    let mut editor = Editor::ready();
    let uri = space_uri();
    let text = shipped();
    let ends = text.char_indices().map(|(at, _)| at).filter(|at| at % 97 == 0);
    for end in ends {
        let prefix = &text[..end];
        let (line, column) = (prefix.matches('\n').count(), prefix.rsplit('\n').next().unwrap_or_default());
        let position = json!({ "line": line, "character": column.encode_utf16().count() });
        editor.write(&uri, if prefix.is_empty() { " " } else { prefix });
        for method in ["completion", "hover", "definition", "references", "prepareRename"] {
            let params = json!({ "textDocument": { "uri": uri }, "position": position });
            let answer = editor.ask(&format!("textDocument/{method}"), params);
            assert!(
                answer.is_ok() || answer.is_err_and(|error| error["code"] == -32803),
                "{method} at {end}"
            );
        }
    }
}

/// All files below a folder.
fn files_of(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).expect("it is there");
    let paths = entries.map(|entry| entry.expect("it is readable").path());
    paths.flat_map(|path| if path.is_dir() { files_of(&path) } else { vec![path] }).collect()
}

#[test]
fn the_extension_is_that_of_the_language() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let folder = scratch.path().display().to_string();
    done(&["editor-files", &folder]);
    for path in files_of(scratch.path()) {
        let name = path.strip_prefix(scratch.path()).expect("it lies there");
        let read = |path: &Path| std::fs::read_to_string(path).expect("it is readable");
        assert_eq!(read(&root().join(name)), read(&path), "write it anew: `avastra editor-files .`");
    }
    let shipped = root().join("editors/vscode");
    let package = std::fs::read_to_string(shipped.join("package.json")).expect("it is readable");
    let package: Value = serde_json::from_str(&package).expect("it is JSON");
    assert_eq!(package["version"], env!("CARGO_PKG_VERSION"));
    let grammar = text(&package["contributes"]["grammars"][0]["path"]);
    assert!(shipped.join(&grammar).is_file(), "{grammar}");
}

/// Folds, links, symbols of the workspace, signatures, and the fields of blocks.
#[test]
fn a_document_has_a_structure() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let base = scratch.path().join("base.ava");
    std::fs::write(
        &base,
        "language 1\nfn lead(v: Speed, room: Length) -> Length = v * 1 s + room\nlet far = 9 m\n",
    )
    .expect("it is writable");
    let user = scratch.path().join("user.ava");
    std::fs::write(&user, "language 1\nuse \"base.ava\"\nlet twice = far * 2\n").expect("it is writable");
    let mut editor = Editor::start();
    let folder = json!([{ "uri": uri(scratch.path()), "name": "all" }]);
    editor.ask("initialize", json!({ "workspaceFolders": folder })).expect("it can be initialized");
    let here = uri(&scratch.path().join("here.ava"));
    let head = "// One\n// remark.\nlanguage 1\nuse \"base.ava\"\nenum Side =\n  Left\n  || Right\n";
    editor.write(&here, &head.replace("||", "|"));
    let document = json!({ "textDocument": { "uri": here } });
    let folds = editor.ask("textDocument/foldingRange", document.clone()).expect("it folds");
    let lines = |fold: &Value| (fold["startLine"].as_u64(), fold["endLine"].as_u64());
    let folds: Vec<_> = folds.as_array().expect("a list").iter().map(lines).collect();
    assert_eq!(folds, [(Some(4), Some(6)), (Some(0), Some(1))]);
    let links = editor.ask("textDocument/documentLink", document).expect("it has links");
    assert_eq!(links[0]["target"], uri(&base), "{links}");
    let found = editor.ask("workspace/symbol", json!({ "query": "LEA" })).expect("it searches");
    assert_eq!((&found[0]["name"], &found[0]["location"]["uri"]), (&"lead".into(), &uri(&base).into()));

    let help = editor.find("signatureHelp", &here, &format!("{head}let a = lead(2 m/s, |"));
    assert_eq!(help["signatures"][0]["label"], "lead(v: Speed, room: Length) -> Length", "{help}");
    assert_eq!(help["activeParameter"], 1, "{help}");
    assert_eq!(editor.find("signatureHelp", &here, &format!("{head}let a = |")), Value::Null);

    let labels = |list: Value| -> Vec<String> {
        list["items"].as_array().expect("a list").iter().map(|item| text(&item["label"])).collect()
    };
    for (written, wanted) in [("override fn |", "lead"), ("override let |", "far")] {
        let list = editor.find("completion", &here, &format!("{head}{written}"));
        assert_eq!(labels(list), [wanted], "{written}");
    }
    let list = labels(editor.find("completion", &here, &format!("{head}reward {{ |")));
    assert!(
        list.iter().any(|word| word == "proc") && !list.iter().any(|word| word == "avoidable"),
        "{list:?}"
    );

    let bodies =
        format!("{head}body Scooter {{ like: Motorcycle }}\nverdict v: hit == Sedan or near in [Bicycle, |");
    let list = labels(editor.find("completion", &here, &bodies));
    assert!(["Scooter", "Pedestrian"].iter().all(|body| list.iter().any(|word| word == body)), "{list:?}");

    let walker = "action a() { spawn Pedestrian ahead 9 m { d|oes: Walk, side: Left, speed: 1 m/s } }\n";
    let hover = editor.find("hover", &here, &format!("{head}{walker}"));
    assert!(text(&hover["contents"]["value"]).starts_with("**does**"));

    // Names in files that are not open, and a name that is taken.
    let place = format!("{head}let mine = f|ar\n");
    let found = editor.ask_at("textDocument/references", &here, &place, json!({ "context": {} }));
    let found = found.expect("it has references");
    let files: Vec<String> =
        found.as_array().expect("a list").iter().map(|place| text(&place["uri"])).collect();
    assert!(files.contains(&uri(&user)) && files.contains(&uri(&base)), "{files:?}");
    let taken = editor.rename(&here, &place, "mine").expect_err("the name is taken");
    let taken = text(&taken["message"]);
    assert_eq!(taken, "`far` cannot be called `mine`: that name is taken");

    // A second declaration of a name may be meant to replace the first.
    let again = format!("{head}let far = 3 m\n").replace("||", "|");
    let mistakes = editor.write(&here, &again);
    assert_eq!(mistakes[0]["code"], "AV0102", "{mistakes:?}");
    let params = json!({ "textDocument": { "uri": here }, "range": mistakes[0]["range"], "context": { "diagnostics": [] } });
    let actions = editor.ask("textDocument/codeAction", params).expect("it can be asked");
    assert_eq!(actions[0]["title"], "write `override` before `let`", "{actions}");
    let mended = edited(&again, &actions[0]["edit"]["changes"][&here]);
    assert!(mended.ends_with("override let far = 3 m\n"), "{mended}");
}
