//! Each question, asked of a text with a mark where the cursor is: `‸`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use avastra_lang::check::ReadError;

use crate::diagnostics::Changes;
use crate::workspace::{Analysis, Files, Workspace};
use crate::{
    Place, complete, diagnostics, formatting, hints, hover, navigate, outline, rename, signature, structure,
};

/// Files by name, all in one folder.
struct Shelf(BTreeMap<PathBuf, String>);

impl Files for Shelf {
    fn read(&self, path: &Path) -> Result<String, ReadError> {
        self.0.get(path).cloned().ok_or_else(|| ReadError::missing("no such file"))
    }

    fn below(&self, _: &Path) -> Vec<PathBuf> {
        self.0.keys().cloned().collect()
    }

    fn nearby(&self, _: &Path) -> Vec<(String, String)> {
        Vec::new()
    }

    fn entries(&self, _: &Path) -> Vec<(String, bool)> {
        self.0.keys().map(|path| (path.display().to_string(), false)).collect()
    }
}

const BASE: &str = "language 1\n\
    /// How thick it is.\n\
    enum Level = None < Light < High\n\
    state fog: Level = None\n\
    let far = 50 m\n\
    fn twice(of: Length, more: Length) -> Length = of * 2 + more\n\
    action lift(each to: Level) { set fog = to }\n";

/// A workspace with `base.ava` on the disk and `mine.ava` open, and where its cursor is.
fn opened(marked: &str) -> (Workspace, PathBuf, usize) {
    let byte = marked.find('‸').expect("a cursor is marked");
    let path = PathBuf::from("mine.ava");
    let mut workspace = Workspace::new(Shelf(BTreeMap::from([(PathBuf::from("base.ava"), BASE.to_owned())])));
    workspace.folders = vec![PathBuf::new()];
    workspace.open(path.clone(), format!("language 1\nuse \"base.ava\"\n{}", marked.replace('‸', "")));
    workspace.analysis(&path).expect("it is open");
    (workspace, path, "language 1\nuse \"base.ava\"\n".len() + byte)
}

/// The answer to a question about the place of the cursor.
fn asked<T>(marked: &str, ask: impl FnOnce(&Workspace, &Analysis, usize) -> T) -> T {
    let (workspace, path, byte) = opened(marked);
    ask(&workspace, workspace.known(&path).expect("it was analysed"), byte)
}

/// Names that fit best at the cursor.
fn proposed(marked: &str) -> Vec<String> {
    asked(marked, |workspace, analysis, byte| {
        let all = complete::complete(workspace, analysis, byte).list;
        let best = all.iter().map(|one| one.rank).min();
        all.into_iter().filter(|one| Some(one.rank) == best).map(|one| one.label).collect()
    })
}

/// File and line, from 1, of each place.
fn lines(places: &[Place]) -> Vec<(String, usize)> {
    places.iter().map(|place| (place.path.display().to_string(), place.range.start.line + 1)).collect()
}

/// How often a text is written in each file.
fn written(changes: &Changes, text: &str) -> Vec<(String, usize)> {
    let count = |of: &Vec<diagnostics::Change>| of.iter().filter(|change| change.text == text).count();
    changes.iter().map(|(path, of)| (path.display().to_string(), count(of))).collect()
}

#[test]
fn what_fits_at_the_cursor_is_proposed() {
    assert_eq!(proposed("action sink() { set fog = ‸ }")[..3], ["None", "Light", "High"]);
    assert!(proposed("let farther = twice(‸").contains(&"far".to_owned()));
    assert!(proposed("state was: ‸").contains(&"Level".to_owned()));
    assert_eq!(proposed("action sink() { set ‸ }"), ["fog"]);
    let fields = proposed("action car() { spawn Sedan ahead 20 m { does: DriveAhead, ‸ } }");
    assert!(fields.contains(&"speed".to_owned()) && !fields.contains(&"does".to_owned()), "{fields:?}");
    assert!(proposed("rule r on lift: ego.‸").contains(&"speed".to_owned()));
}

/// A scenario with this step and claim.
fn scenario(step: &str, claim: &str) -> String {
    let road = "road way { map: \"way.xodr\" }";
    format!("{road}\nscenario one {{\n  road: way\n  start {{ }}\n  steps {{ {step} }}\n  {claim}\n}}")
}

#[test]
fn every_part_of_a_scenario_has_proposals() {
    let holds = |step: &str, claim: &str, wanted: &str| {
        let found = proposed(&scenario(step, claim));
        assert!(found.contains(&wanted.to_owned()), "{step} {claim}: {found:?}");
    };
    holds("0: ‸", "", "lift");
    holds("0: lift(to: ‸)", "", "High");
    holds("0: lift(to: High) once ego.‸", "", "speed");
    holds("0: lift(to: High) once ego.speed > 3 ‸", "", "km/h");
    holds("0: lift(to: High) once ego.speed > 3 m/s for 2 ‸", "", "s");
    holds("0: lift(to: High) after 2 ‸", "", "s");
    holds("0: wait()", "expect ‸", "collision");
    holds("0: wait()", "expect collision at 3 ‸", "s");
    holds("0: wait()", "expect avoidable by [‸]", "cc");
    holds("0: wait()", "expect avoidable by [cc, ‸]", "fsm");
}

#[test]
fn a_name_says_what_the_checker_knows_of_it() {
    let told = |marked: &str| {
        asked(marked, |_, analysis, byte| hover::hover(analysis, byte).map(|found| found.text))
    };
    let text = told("state mine: Le‸vel = None").expect("it is a name");
    assert!(text.contains("enum Level = None < Light < High") && text.contains("How thick it is."), "{text}");
    assert!(told("let farther = fa‸r * 2").is_some_and(|text| text.contains("let far = 50 m")));
    assert!(
        told("rule r on lift: ego.spe‸ed <= 3 m/s")
            .is_some_and(|text| text.contains("speed of the ego vehicle"))
    );
    assert_eq!(told("let farther = far * 2 ‸"), None);
}

#[test]
fn a_name_leads_to_its_declaration_and_its_uses() {
    let declared = |marked: &str| {
        asked(marked, |_, analysis, byte| navigate::definition(analysis, byte).map(|found| lines(&found)))
    };
    let line = |file: &str, line: usize| (file.to_owned(), line);
    assert_eq!(declared("state mine: Le‸vel = None"), Some(vec![line("base.ava", 3)]));
    assert_eq!(declared("let half = far / 2\nlet all = ha‸lf * 2"), Some(vec![line("mine.ava", 3)]));
    assert_eq!(declared("let half = far / 2 ‸"), None);
    let (mut workspace, path, byte) = opened("let half = fa‸r / 2\nlet more = far + half");
    let found = navigate::references(&mut workspace, &path, byte, true);
    assert_eq!(lines(&found), [line("mine.ava", 3), line("mine.ava", 4), line("base.ava", 5)]);
    let found = navigate::references(&mut workspace, &path, byte, false);
    assert_eq!(lines(&found), [line("mine.ava", 3), line("mine.ava", 4)]);
    let analysis = workspace.known(&path).expect("it was analysed");
    assert_eq!(navigate::highlights(analysis, byte).len(), 2, "in the document alone");
}

#[test]
fn a_rename_is_made_in_all_files_or_refused() {
    let renamed = |marked: &str, name: &str| {
        let (mut workspace, path, byte) = opened(marked);
        rename::rename(&mut workspace, &path, byte, name)
    };
    let changes = renamed("let half = fa‸r / 2\nlet more = far + half", "away").expect("it can be renamed");
    assert_eq!(written(&changes, "away"), [("base.ava".to_owned(), 1), ("mine.ava".to_owned(), 2)]);
    let refused = |marked: &str, name: &str| renamed(marked, name).expect_err("it cannot be");
    assert!(refused("let half = fa‸r / 2", "half").contains("half"));
    assert!(refused("let half = fa‸r / 2", "rule").contains("rule"));
    assert_eq!(refused("state fine: Bo‸ol = true", "Truth"), "`Bool` is a type of the language");
    assert_eq!(refused("le‸t half = far / 2", "x"), "`let` is a word of the language");
    assert!(asked("let half = fa‸r / 2", |_, analysis, byte| rename::prepare(analysis, byte)).is_ok());
}

#[test]
fn a_call_says_which_argument_is_due() {
    let due = |marked: &str| {
        asked(marked, |_, analysis, byte| {
            signature::help(analysis, byte).map(|found| (found.label, found.due))
        })
    };
    let label = "twice(of: Length, more: Length) -> Length".to_owned();
    assert_eq!(due("let all = twice(‸"), Some((label.clone(), 0)));
    assert_eq!(due("let all = twice(far, ‸"), Some((label, 1)));
    assert_eq!(due("let all = far‸"), None);
}

#[test]
fn a_document_has_an_outline_folds_links_and_hints() {
    let text =
        "‸/// Two lines,\n/// and no more.\naction sink() {\n  set fog = None\n}\nlet half = far / 2\n";
    let entries = asked(text, |_, analysis, _| outline::symbols(analysis));
    let found: Vec<_> = entries.iter().map(|entry| (entry.name.as_str(), entry.kind)).collect();
    assert_eq!(found, [("sink", outline::OutlineKind::Action), ("half", outline::OutlineKind::Constant)]);
    let folds = asked(text, |_, analysis, _| structure::folds(analysis));
    assert!(folds.contains(&structure::Fold { start: 2, end: 3, is_comment: true }), "{folds:?}");
    let links = asked(text, |_, analysis, _| structure::links(analysis));
    assert!(matches!(&links[..], [(_, path)] if path == Path::new("base.ava")));
    let names = |query: &str| -> Vec<String> {
        asked(text, |workspace, _, _| {
            structure::search(workspace, query).into_iter().map(|one| one.name).collect()
        })
    };
    assert_eq!(names("FA"), ["far"]);
    let hints = asked(text, |_, analysis, _| hints::hints(analysis, 0, usize::MAX));
    assert!(matches!(&hints[..], [hint] if hint.label == "row 3"), "behind the three of `lift`: {hints:?}");
}

#[test]
fn a_mistake_has_a_remedy_and_a_text_its_form() {
    let text = "state mine: Levle‸ = None";
    let remedies = asked(text, |_, analysis, byte| diagnostics::fixes(analysis, byte, byte));
    assert_eq!(written(&remedies[0].changes, "Level"), [("mine.ava".to_owned(), 1)]);
    assert!(remedies[0].is_preferred);
    // A declaration of a used file may be replaced.
    let again = asked("let fa‸r = 60 m", |_, analysis, byte| diagnostics::fixes(analysis, byte, byte));
    assert!(again.iter().any(|one| written(&one.changes, "override ") == [("mine.ava".to_owned(), 1)]));
    let (mut workspace, path, _) = opened(text);
    let all = diagnostics::all(&mut workspace);
    assert_eq!(all[&path].iter().map(|mistake| mistake.code).collect::<Vec<_>>(), ["AV0101"]);
    let formed = asked("let   half=far/2‸\n", |_, analysis, _| formatting::format(analysis));
    assert!(formed.is_ok_and(|changes| changes.is_some_and(|changes| !changes.is_empty())));
    let formed = asked("let half = far / 2‸\n", |_, analysis, _| formatting::format(analysis));
    assert!(formed.is_ok_and(|changes| changes.is_none_or(|changes| changes.is_empty())));
}
