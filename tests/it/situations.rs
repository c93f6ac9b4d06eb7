//! Situations that analysts labelled (`tests/cases/situations`): those that the shipped `blind` driver plays. The rest needs
//! Python: `tests/interop/situations.py`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rusqlite::{Connection, OpenFlags};

use crate::cases::{expect_snapshot, root};
use crate::command::done;

/// Where avastra says otherwise than every analyst, and why it does.
const ARGUED: [(&str, &str); 5] = [
    (
        "i09_ball_and_child",
        "a ball that has rolled off is no road user that UN R157's driver would brake for",
    ),
    (
        "y01_late_yellow_other_starts_on_red",
        "both passed their lights, so neither has priority, and no excuse covers the ego vehicle",
    ),
    ("r04_circulating_truck_creeps_in", "it left room to brake gently, so it had given way (article 1)"),
    (
        "y9_overtakes_where_ego_turns_left",
        "who turns across the road is not overtaken there (article 11); whether the ego vehicle indicated is not known",
    ),
    ("z1_cuts_in_within_junction", "the one behind changes lanes and runs into the one ahead: type 22"),
];

type Label = BTreeMap<String, String>;

#[test]
fn situations_are_judged_as_their_analysts_signed() {
    let folder = root().join("tests/cases/situations");
    // Requirements that the law gained after the labels were written: no label can have named them.
    let newer = std::fs::read_to_string(folder.join("newer.txt")).expect("it is there");
    let mut wrong = Vec::new();
    let mut played = 0;
    for part in ["first", "second", "third"] {
        let mut all = String::new();
        let tables: Vec<BTreeMap<String, Label>> = labels(&folder.join(part));
        for path in blind(&folder.join(part)) {
            played += 1;
            let case = path.file_stem().expect("it has a name").to_string_lossy().into_owned();
            let said = play(&path);
            all += &format!("{case}\n{}", said.in_full);
            let of = tables.iter().map(|table| disagreements(&table[&case], &said, &newer));
            let found: Vec<Vec<String>> = of.collect();
            let agrees = found.iter().any(Vec::is_empty);
            let is_argued = ARGUED.iter().any(|(name, _)| *name == case);
            if agrees == is_argued {
                wrong.push(format!("{part}/{case}: {found:?}"));
            }
        }
        // A label says what; the snapshot also says when, by which rule and by how much.
        expect_snapshot("situations", part, &all);
    }
    assert!(played >= 110, "{played} situations");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The situations of a folder that the blind driver plays.
fn blind(folder: &Path) -> Vec<PathBuf> {
    let entries =
        std::fs::read_dir(folder).expect("it is there").map(|entry| entry.expect("it is there").path());
    let is_one = |path: &PathBuf| {
        path.extension().is_some_and(|extension| extension == "ava")
            && std::fs::read_to_string(path).expect("it is text").contains("\n// ADS: blind\n")
    };
    let mut all: Vec<PathBuf> = entries.filter(is_one).collect();
    all.sort();
    all
}

/// The tables of labels of a folder, each by case.
fn labels(folder: &Path) -> Vec<BTreeMap<String, Label>> {
    let names = ["labels.csv", "labels-a.csv", "labels-b.csv"];
    let texts = names.iter().filter_map(|name| std::fs::read_to_string(folder.join(name)).ok());
    texts
        .map(|text| {
            let mut lines = text.lines();
            let head: Vec<&str> = lines.next().expect("it has a head").split(',').collect();
            let row = |line: &str| {
                let cells = line.split(',').map(str::to_owned);
                let label: Label = head.iter().map(|name| (*name).to_owned()).zip(cells).collect();
                (label["case"].clone(), label)
            };
            lines.map(row).collect()
        })
        .collect()
}

/// What was said of a situation: of each contact by the labels' names, and the requirements that were breached.
struct Said {
    contacts: Vec<Label>,
    breaches: BTreeSet<String>,
    /// All that was found, a line each.
    in_full: String,
}

fn play(path: &Path) -> Said {
    let out = tempfile::tempdir().expect("there is room");
    let run = out.path().join("run");
    let mut command = assert_cmd::Command::cargo_bin("avastra").expect("it was built");
    command.arg("run").arg(path).args([
        "--agent",
        "every-row",
        "--ads",
        "blind",
        "--jobs",
        "1",
        "--repeat",
        "0",
    ]);
    command.arg("--out").arg(&run).output().expect("it runs");
    let database = Connection::open_with_flags(run.join("run.db"), OpenFlags::SQLITE_OPEN_READ_ONLY)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let names = "avoidability, priority, struck, sudden, precrash_number, harm";
    let query = format!("SELECT {names} FROM collision ORDER BY episode, number");
    let mut statement = database.prepare(&query).expect("the columns are there");
    let yes = |is: bool| if is { "yes" } else { "no" }.to_owned();
    let contacts = statement.query_map([], |row| {
        let avoidability: String = row.get(0)?;
        let number: Option<i64> = row.get(4)?;
        Ok(Label::from([
            ("avoid".to_owned(), yes(avoidability == "avoidable")),
            ("prio".to_owned(), row.get(1)?),
            ("struck".to_owned(), yes(row.get(2)?)),
            ("sudden".to_owned(), yes(row.get(3)?)),
            ("kind".to_owned(), number.map_or(String::new(), |number| number.to_string())),
            ("harm".to_owned(), row.get(5)?),
        ]))
    });
    let contacts = contacts.expect("it can be read").map(|row| row.expect("it can be read")).collect();
    let mut statement = database.prepare("SELECT requirement FROM breach").expect("the table is there");
    let breaches = statement.query_map([], |row| row.get(0)).expect("it can be read");
    let breaches = breaches.map(|name| name.expect("it can be read")).collect();
    let in_full = in_full(&database) + &asked(&database);
    Said { contacts, breaches, in_full }
}

/// All that a run found, a line each: collisions with their whole verdicts, and breaches.
fn in_full(database: &Connection) -> String {
    let query = "SELECT printf('  %s_%04d %s#%d at %.2f s: %s by %s at %.2f s (%s); %s from %.2f s by %s, %s; %s; %s, harm %.3f%s%s', \
                   road, episode, body, obstacle, time_s, priority, priority_rule, priority_time_s, priority_motion, avoidability, \
                   hazard_onset_s, trim(avoided_by || ' to the letter ' || r157_letter), coalesce(evasion, 'no evasion'), precrash, shape, harm_share, \
                   iif(struck, ', struck', ''), iif(sudden, ', sudden', '')), episode, number \
                 FROM collision JOIN episode USING (episode) \
                 UNION ALL SELECT printf('  %s_%04d %s at %.2f to %.2f s, margin %s%s', road, episode, requirement, time_s, until_s, \
                   coalesce(printf('%.3f', margin), 'unknown'), coalesce(', kept by ' || kept_by, '')), episode, number \
                 FROM breach JOIN episode USING (episode) ORDER BY 2, 3, 1";
    lines(database, query)
}

/// How long each requirement was asked for, and by how much it was kept.
fn asked(database: &Connection) -> String {
    let query = "SELECT printf('  %s asked for %.2f s, at least %s', requirement, asked_s, \
                   coalesce(printf('%.3f', smallest), 'unknown')) FROM margin WHERE asked_s > 0";
    lines(database, query)
}

fn lines(database: &Connection, query: &str) -> String {
    let mut statement = database.prepare(query).expect("the columns are there");
    let lines = statement.query_map([], |row| row.get::<_, String>(0)).expect("it can be read");
    lines.map(|line| line.expect("it can be read") + "\n").collect()
}

/// What happens in shipped spaces to a driver that heeds nobody, and to one that yields to nobody: each verdict in full. Labels of
/// single situations say what is right; this says that nothing else moves.
#[test]
fn runs_of_careless_drivers_are_judged_as_before() {
    let never_yields = "scenarios/ads/faults/planning_never_yields.yaml";
    for (name, space, ads, episodes, ambient) in [
        ("heeds_nobody_law", "avastra45_law", "blind", "50", "4"),
        ("heeds_nobody_manoeuvres", "manoeuvres", "blind", "14", "0"),
        ("heeds_nobody_motorway", "r157", "blind", "5", "0"),
        ("heeds_nobody_deepcollision", "deepcollision52", "blind", "40", "0"),
        ("never_yields_law", "avastra45_law", never_yields, "60", "6"),
        ("never_yields_manoeuvres", "manoeuvres", never_yields, "20", "0"),
    ] {
        let out = tempfile::tempdir().expect("there is room");
        let out = out.path().join("run").display().to_string();
        let file = format!("scenarios/{space}.ava");
        let run = ["run", &file, "--ads", ads, "--episodes", episodes, "--ambient", ambient, "--seed", "1"];
        done(&[&run[..], &["--repeat", "0", "--out", &out]].concat());
        let database = Connection::open_with_flags(format!("{out}/run.db"), OpenFlags::SQLITE_OPEN_READ_ONLY);
        expect_snapshot("situations", name, &in_full(&database.expect("it was written")));
    }
}

/// The fields of a label that are said otherwise.
fn disagreements(label: &Label, said: &Said, newer: &str) -> Vec<String> {
    let told = |name: &str| label.get(name).map(String::as_str).filter(|value| !value.is_empty());
    let nth: usize = told("n").map_or(1, |number| number.parse().expect("it is a number"));
    let contact = said.contacts.get(nth - 1);
    let mut found = Vec::new();
    if let Some(value) = told("breach") {
        let known = said.breaches.iter().filter(|name| !newer.lines().any(|one| one == *name));
        let is_right = match value {
            "none" => known.count() == 0,
            names => names.split(';').all(|name| said.breaches.contains(name)),
        };
        if !is_right {
            found.push(format!("breach: labelled {value}, found {:?}", said.breaches));
        }
    }
    if told("hit") == Some("no") {
        if contact.is_some() {
            found.push("a contact".to_owned());
        }
        return found;
    }
    for name in ["avoid", "prio", "struck", "sudden", "kind", "harm"] {
        let Some(value) = told(name) else { continue };
        let is = contact.map_or("no contact", |contact| contact[name].as_str());
        if !value.split('|').any(|one| one == is) {
            found.push(format!("{name}: labelled {value}, found {is}"));
        }
    }
    found
}
