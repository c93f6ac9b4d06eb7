//! A page of HTML that holds everything: style, script and data. It opens from a file, and asks nothing of a network.
//!
//! The script is ES modules, one file for each subject. Here they are joined into one, in the order in which they use
//! each other, without their `import` lines, the word `export` and documentation. A name is therefore declared once in
//! all of them (kept by `tests/page`); `tests/interop/report.sh` opens pages in a browser.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Value, json};

use avastra_base::outside::in_markup;
use avastra_campaign::run::VERSION;
use avastra_world::sim::ENGINE;

use super::recording::{Recording, quantisation};

const FRAME: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");

const MODULES: &[&str] = &[
    include_str!("page/decode.js"),
    include_str!("page/dom.js"),
    include_str!("page/link.js"),
    include_str!("page/words.js"),
    include_str!("page/moment.js"),
    include_str!("page/paint.js"),
    include_str!("page/ground.js"),
    include_str!("page/bodies.js"),
    include_str!("page/view.js"),
    include_str!("page/axis.js"),
    include_str!("page/plots.js"),
    include_str!("page/strip.js"),
    include_str!("page/thumbs.js"),
    include_str!("page/source.js"),
    include_str!("page/facts.js"),
    include_str!("page/clock.js"),
    include_str!("page/keys.js"),
    include_str!("page/controls.js"),
    include_str!("page/watch.js"),
    include_str!("page/charts.js"),
    include_str!("page/list.js"),
    include_str!("page/coverage.js"),
    include_str!("page/heat.js"),
    include_str!("page/study.js"),
    include_str!("page/estimate.js"),
    include_str!("page/overview.js"),
    include_str!("page/main.js"),
];

/// A scenario of a page.
pub struct Scene {
    /// Its file, as it is to be named; links name it so, and no two scenarios have one name.
    pub file: String,
    pub recording: Recording,
    /// The drive of another driving system, if one was asked for, and what became of the crash.
    pub compared: Option<(Recording, Value)>,
    /// Name of the scenario of which this is the shrunk one.
    pub shrunk_from: Option<String>,
    /// The banner about changes since its file was written, if there are any.
    pub changed: Option<String>,
}

/// Everything that a page shows.
pub struct Page {
    pub title: String,
    /// The part about a whole run, training or study; `Null` for scenarios alone.
    pub overview: Value,
    /// The parts that it leaves out or could not play, in words.
    pub remarks: Vec<String>,
    pub scenes: Vec<Scene>,
    /// Name of the other driving system, if two are compared.
    pub compared_with: Option<String>,
}

impl Page {
    /// The page as HTML. The worst scenario comes first.
    pub fn html(mut self) -> String {
        self.scenes.sort_by(|a, b| {
            let (a_key, b_key) = (badness(&a.recording.summary), badness(&b.recording.summary));
            (b_key.0, b_key.1)
                .cmp(&(a_key.0, a_key.1))
                .then(b_key.2.total_cmp(&a_key.2))
                .then(a.file.cmp(&b.file))
        });
        let mut blobs = String::new();
        let mut grounds: BTreeMap<String, String> = BTreeMap::new();
        let mut listed = Vec::new();
        for (number, scene) in self.scenes.iter().enumerate() {
            let Scene { file, recording, compared, shrunk_from, changed } = scene;
            blob(&mut blobs, &format!("s{number}"), &recording.packed);
            let ground = ground_id(&mut grounds, &recording.ground);
            if let Some((compared, _)) = compared {
                blob(&mut blobs, &format!("c{number}"), &compared.packed);
            }
            let change = compared.as_ref().map(|(_, change)| change);
            listed.push(json!({
                "n": number, "file": file, "ground": ground, "summary": recording.summary, "shrunk_from": shrunk_from,
                "compared": compared.is_some(), "change": change, "changed": changed,
            }));
        }
        for (packed, id) in &grounds {
            blob(&mut blobs, id, packed);
        }
        let index = json!({
            "schema": 1, "title": self.title, "avastra": VERSION, "engine": ENGINE, "quantisation": quantisation(),
            "overview": self.overview, "remarks": self.remarks, "compared_with": self.compared_with, "scenarios": listed,
        });
        // Nothing in the data may end the element that holds it.
        let index = index.to_string().replace('<', "\\u003c");
        let (title, script) = (in_markup(&self.title), script());
        // Each part is looked for in the frame alone, whatever the others hold.
        let mut html = String::new();
        let mut parts = FRAME.split("{{");
        html.push_str(parts.next().unwrap_or_default());
        for part in parts {
            let (name, rest) = part.split_once("}}").expect("page.html ends each name that it begins");
            html.push_str(match name {
                "title" => &title,
                "style" => STYLE,
                "script" => &script,
                "blobs" => &blobs,
                "index" => &index,
                _ => unreachable!("page.html names no other part than these: {name}"),
            });
            html.push_str(rest);
        }
        html
    }
}

/// The larger, the worse: whether something of it counts, whether one of that recurs, and how fast the impact was beside what
/// people bear, 0 without a collision.
fn badness(summary: &Value) -> (bool, bool, f64) {
    let all = |name: &str| summary[name].as_array().map_or(&[][..], Vec::as_slice);
    let of_collisions = all("collisions").iter().map(|collision| (collision["counted"] == true, collision));
    let findings: Vec<(bool, &Value)> =
        of_collisions.chain(all("breaches").iter().map(|breach| (true, breach))).collect();
    let counts = findings.iter().any(|(counts, _)| *counts);
    let meant = || findings.iter().filter(|found| found.0 == counts).map(|(_, finding)| finding);
    let recurs = meant().any(|finding| finding["recurrence"]["recurs"] != false);
    let harm = meant().filter_map(|finding| finding["harm_share"].as_f64()).fold(0.0, f64::max);
    (counts, recurs, harm)
}

/// The number of a road's shape: scenarios of one road share it.
fn ground_id(grounds: &mut BTreeMap<String, String>, packed: &str) -> String {
    let next = format!("g{}", grounds.len());
    grounds.entry(packed.to_owned()).or_insert(next).clone()
}

fn blob(blobs: &mut String, id: &str, packed: &str) {
    let _ = writeln!(blobs, "<script type=\"text/plain\" id=\"{id}\">{packed}</script>");
}

/// All modules as one script, without their documentation.
fn script() -> String {
    let mut script = String::from("(() => {\n\"use strict\";\n");
    for module in MODULES {
        let (mut is_import, mut is_doc) = (false, false);
        for line in module.lines() {
            // A cast begins as documentation does, and has code behind it.
            let code = line.trim_start();
            is_doc |= code.starts_with("/**") && (!code.contains("*/") || code.ends_with("*/"));
            if is_doc {
                is_doc = !code.ends_with("*/");
                continue;
            }
            is_import |= line.starts_with("import ");
            if is_import {
                is_import = !line.ends_with(';');
                continue;
            }
            script.push_str(line.strip_prefix("export ").unwrap_or(line));
            script.push('\n');
        }
    }
    script.push_str("})();\n");
    script
}
