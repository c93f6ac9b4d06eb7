//! The laws that hold for every text, however hostile: it is read to its end, every diagnostic can be shown,
//! a text without syntax errors survives the printer and the formatter, and what a sound space draws is legal.
//!
//! Shared by the fuzz target, which makes up texts, and by `tests/it/hostile.rs`, which runs the texts that
//! were kept. No file is read: a text may use only the files that stand here.

use std::path::Path;

use avastra::action::{ActionTable, Situation, SpawnFacts, SpawnRequest, Surroundings};
use avastra::check::{ReadError, load};
use avastra::model::{MomentFacts, RulesInForce};
use avastra::places::{self, Scenes};
use avastra::syntax::ast::FileId;
use avastra::syntax::{Diagnostic, Style, apply_fixes, format, parse, print, record, render, same_meaning};

/// The shipped space; its roads are those of [`ROADS`].
const AVASTRA: &str = include_str!("../scenarios/avastra45.ava");

/// Four names for one road, so that no time goes into reading maps.
pub const ROADS: &str = r#"language 1
road corner { map: "straight.xodr", start: lane 1/-2 at 10 m, goal: lane 1/-2 at 190 m }
road residential { map: "straight.xodr", start: lane 1/-2 at 10 m, goal: lane 1/-2 at 190 m }
road boulevard { map: "straight.xodr", start: lane 1/-2 at 10 m, goal: lane 1/-2 at 190 m }
road crossroad { map: "straight.xodr", start: lane 1/-2 at 10 m, goal: lane 1/-1 at 190 m }
"#;

/// A straight road with three lanes in each direction.
pub const STRAIGHT: &str = r#"<OpenDRIVE><header name="straight"/><road id="1" length="200" junction="-1">
<type s="0" type="town"><speed max="13" unit="m/s"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry></planView>
<lanes><laneSection s="0">
<left>
<lane id="3" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="2" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</left>
<center><lane id="0" type="none"><roadMark sOffset="0" type="broken"/></lane></center>
<right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="broken"/></lane>
<lane id="-2" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="broken"/></lane>
<lane id="-3" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right>
</laneSection></lanes></road></OpenDRIVE>"#;

/// Rows of a table that are drawn.
const ROWS_MAX: usize = 64;

/// The file name of the text.
const OWN: &str = "text.ava";

/// Panics if a text breaks one of the laws.
pub fn examine(text: &str) {
    examine_syntax(text);
    examine_meaning(text);
}

fn examine_syntax(text: &str) {
    let file = FileId(0);
    let (tree, found) = parse(file, text);
    if found.iter().any(Diagnostic::is_error) {
        assert!(format(file, text).is_err(), "what has mistakes is not formatted");
        return;
    }
    let (again, mistakes) = parse(file, &print(&tree));
    assert!(mistakes.is_empty() && same_meaning(&tree, &again), "what is printed reads back");
    let formatted = format(file, text).expect("what parses can be formatted");
    let twice = format(file, &formatted).expect("what is formatted can be formatted");
    assert_eq!(formatted, twice, "formatting again changes nothing");
}

fn examine_meaning(text: &str) {
    let read = |path: &Path| match path.to_str() {
        Some(OWN) => Ok(text.to_owned()),
        Some("avastra45.ava") => Ok(AVASTRA.to_owned()),
        Some("roads.ava") => Ok(ROADS.to_owned()),
        _ if path.extension().is_some_and(|ending| ending == "xodr") => Ok(STRAIGHT.to_owned()),
        _ => Err(ReadError::missing("no such file")),
    };
    let mut loaded = load(Path::new(OWN), &read).expect("its text is known");
    let mut scenes = Scenes::default();
    places::judge_claims(&mut loaded, &mut scenes);
    places::warn(&mut loaded, &mut scenes);
    let found: Vec<Diagnostic> = loaded.diagnostics.iter().chain(&loaded.remarks).cloned().collect();
    for diagnostic in &found {
        assert!(!render(diagnostic, &loaded.sources, Style::Plain).is_empty());
        let _ = record(diagnostic, &loaded.sources);
    }
    let _ = apply_fixes(FileId(0), text, &found);
    let is_refused = found.iter().any(Diagnostic::is_error);
    assert!(is_refused || loaded.space.is_some(), "without an error there is a space");
    if let Some(space) = loaded.space {
        examine_draws(ActionTable::new(space));
    }
}

/// What is drawn at the start of an episode is legal when it is judged again.
fn examine_draws(table: ActionTable) {
    let space = table.space().clone();
    let rules = RulesInForce::new(&space, &[], &[]).expect("no rule is named");
    for road in &space.roads {
        let memory = space.memory_at_start(road, &rules, 1).expect("what is checked has a start");
        let situation = Situation {
            memory: &memory,
            road,
            rules: &rules,
            surroundings: &Empty,
            seed: 1,
            step: 0,
            happened_s: &[],
        };
        for row in 0..table.rows().len().min(ROWS_MAX) {
            let Ok(draw) = table.offer(&situation, row) else { continue };
            assert_eq!(table.check(&situation, row, &draw.values), Ok(draw), "what is drawn is legal");
        }
    }
}

/// A world in which every place is free.
struct Empty;

impl Surroundings for Empty {
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String> {
        Ok(SpawnFacts { spawn_gap_m: request.distance_m, ..SpawnFacts::default() })
    }

    fn moment(&self) -> MomentFacts {
        MomentFacts { ego_speed_mps: 10.0, ..MomentFacts::default() }
    }
}
