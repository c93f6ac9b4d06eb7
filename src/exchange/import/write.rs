//! The variations of a file as a text of the language.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use avastra_base::outside::in_comment;
use avastra_campaign::emit::quoted;
use avastra_lang::model::vocabulary::{Body, BodyClass, Word};
use avastra_lang::syntax::ast::FileId;
use avastra_lang::syntax::format;

use super::body::wheelbase_m;
use super::own::Own;
use super::pace;
use super::rows::{Parameters, capital, small, unique};
use super::said::{Figure, Piece, Said, number};
use super::scene::{OFFSET, Other, Scene};
use super::sky::{self, Sky};
use super::whole::{Imported, Variant, Whole};

/// The space of a file's variations. With one of them, it has a scenario, too. `order` names the parameters as they are listed.
pub fn space(whole: &Whole, order: &[String], name: &str) -> Imported {
    let values: Vec<_> = whole.variants.iter().map(|variant| &variant.values).collect();
    let others = whole.variants.iter().flat_map(|variant| &variant.scene.others);
    let names = others.map(|other| other.bearer.as_str()).collect();
    let mut space = Space {
        variants: &whole.variants,
        parameters: Parameters::of(order, &values, &names),
        own: small(name),
        roads: Vec::new(),
        road_of: Vec::new(),
        declared: String::new(),
        names: ["Time", "Sky", "Level"].map(str::to_owned).into(),
        made: Vec::new(),
    };
    let mut notes = whole.notes.clone();
    if whole.excluded > 0 {
        let count = whole.excluded + whole.variants.len();
        notes.insert(format!(
            "{} of {count} variations have values that the file's own constraints exclude, and are left out",
            whole.excluded
        ));
    }
    let durations = whole.variants.iter().map(|variant| variant.duration_s);
    let (least_s, most_s) =
        durations.fold((f64::INFINITY, 0.0), |(least, most), s| (s.min(least), s.max(most)));
    if most_s - least_s > TOLD_S {
        notes.insert(format!("each row is played for {} s, as long as the slowest needs", number(most_s)));
    }
    let body = space.text();
    let drawn: Vec<String> = space.parameters.drawn.iter().map(|name| format!("`{name}`")).collect();
    if !drawn.is_empty() {
        let text = format!(
            "the parameters of {} variations have too many combinations to list: each row draws {}",
            whole.variants.len(),
            drawn.join(", ")
        );
        notes.insert(text);
    }
    let text = head(&whole.description, name, &notes) + &body;
    // A text that does not parse is refused when it is checked.
    let text = format(FileId(0), &text).unwrap_or(text);
    let maps = whole.variants.iter().map(|variant| variant.map.clone()).collect();
    Imported { scenario: space.scenario(name), space: Some(text), maps, notes }
}

/// The file of a scenario that the other file carries.
pub fn own(own: &Own, name: &str, notes: BTreeSet<String>) -> Imported {
    let text = head(&own.description, name, &notes) + &own.text + "\n";
    let text = format(FileId(0), &text).unwrap_or(text);
    Imported { space: None, scenario: Some(text), maps: BTreeSet::from([own.map.clone()]), notes }
}

/// How a file begins: what it is, what differs, and the version of the language.
fn head(description: &str, name: &str, notes: &BTreeSet<String>) -> String {
    let description = in_comment(description);
    let title = if description.is_empty() { name.to_owned() } else { description };
    let mut text = format!(
        "//! {title}\n//!\n//! From OpenSCENARIO XML by `avastra import`. What differs from the file:\n"
    );
    for note in notes {
        let _ = writeln!(text, "//! - {}", in_comment(note));
    }
    text += "language 1\n\n";
    text
}

/// Where the ego vehicle begins and arrives: the map, the two places, its speed and the limit.
type Home<'a> = (&'a str, &'a str, &'a str, Figure, Option<Figure>);

struct Space<'a> {
    variants: &'a [Variant],
    parameters: Parameters,
    /// The name of the file.
    own: String,
    /// Each with its name.
    roads: Vec<(Home<'a>, String)>,
    /// The road of each variation.
    road_of: Vec<usize>,
    /// Bodies, trajectories and manoeuvres, as they were needed.
    declared: String,
    /// The names of those.
    names: BTreeSet<String>,
    /// The fields of bodies and trajectories, whose they are, and what they are called.
    made: Vec<(String, String, String)>,
}

impl<'a> Space<'a> {
    fn text(&mut self) -> String {
        let all: Vec<usize> = (0..self.variants.len()).collect();
        self.lay_roads();
        let skies: BTreeSet<&Sky> = self.variants.iter().map(|variant| &variant.sky).collect();
        let first = &self.variants[0].sky;
        let mut text = self.road_declarations();
        text += &sky::states(&first.begins, &skies);
        // Variations that differ in numbers alone are one action.
        let mut groups: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        let mut order = Vec::new();
        for at in all {
            let form = form(&self.variants[at]);
            let rows = groups.entry(form.clone()).or_default();
            if rows.is_empty() {
                order.push(form);
            }
            rows.push(at);
        }
        let manoeuvres = self.manoeuvres(&groups, &order);
        let (mut actions, mut rules) = (String::new(), String::new());
        for (nth, form) in order.iter().enumerate() {
            let group = &groups[form];
            let name = if order.len() == 1 { "begin".to_owned() } else { format!("begin_{}", nth + 1) };
            let set = self.variants[group[0]].sky.set(&skies);
            let times = order.len() * self.roads.len();
            actions += &self.action(&name, group, times, &set, &manoeuvres);
            if self.roads.len() > 1 {
                rules += &self.rule(&name, group);
            }
            if first.changes() {
                // Only the sky goes on after the first step.
                let _ = writeln!(rules, "rule {name}_at_first on {name}: elapsed <= 0 s");
            }
        }
        if actions.contains(BEGUN) {
            text += "state begun: Bool = false\n";
        }
        text += &self.parameters.enums();
        text += &self.declared;
        for function in self.parameters.functions() {
            let _ = writeln!(text, "{function}");
        }
        text += &actions;
        text += &rules;
        text += &first.each_step();
        let (step_s, steps) = self.steps();
        let _ =
            writeln!(text, "\nepisode {{ step: {} s, stop: arrived, limit: {steps} steps }}", number(step_s));
        text
    }

    /// How long a step is, s, and how many there are: one, in which everything happens, if the sky stays as it is.
    fn steps(&self) -> (f64, usize) {
        let duration_s = self.variants.iter().map(|variant| variant.duration_s).fold(0.0, f64::max);
        let whole_s = (duration_s * 50.0).ceil().max(1.0) / 50.0;
        let step_s = self.variants[0].sky.step_s().filter(|step_s| *step_s < whole_s);
        step_s.map_or((whole_s, 1), |step_s| (step_s, (whole_s / step_s - 1e-6).ceil() as usize))
    }

    /// The scenario of the only variation, in a file beside that of the space.
    fn scenario(&self, file: &str) -> Option<String> {
        let ([_], [(_, road)]) = (self.variants, self.roads.as_slice()) else { return None };
        let (own, file) = (&self.own, quoted(&format!("{file}.ava")));
        let (_, steps) = self.steps();
        let rest = if steps > 1 { format!(" {}: wait()", steps - 1) } else { String::new() };
        let text = format!(
            "language 1\nuse {file}\nscenario {own} {{ road: {road} steps {{ 0: begin(){rest} }} }}\n"
        );
        Some(format(FileId(0), &text).unwrap_or(text))
    }

    fn lay_roads(&mut self) {
        let variants = self.variants;
        let all: Vec<usize> = (0..variants.len()).collect();
        let mut known: BTreeMap<Home, usize> = BTreeMap::new();
        let mut firsts = Vec::new();
        for variant in variants {
            let next = known.len();
            let road = *known.entry(home(variant)).or_insert(next);
            if road == next {
                firsts.push(self.road_of.len());
            }
            self.road_of.push(road);
        }
        let road_of = &self.road_of;
        let names = self.parameters.names(&all, |at| road_of[at]);
        let mut taken = BTreeSet::new();
        for first in firsts {
            let name = match names[first].as_str() {
                "" => format!("{}_road", self.own),
                name => small(&format!("at_{name}")),
            };
            self.roads.push((home(&variants[first]), unique(&name, &mut taken)));
        }
    }

    fn road_declarations(&self) -> String {
        let mut text = String::new();
        for ((map, start, goal, ego, limit), name) in &self.roads {
            let map = quoted(map.rsplit('/').next().unwrap_or_default());
            let _ = writeln!(text, "road {name} {{\n  map: {map}\n  start: {start}\n  goal: {goal}");
            if let Some(limit) = limit {
                let _ = writeln!(text, "  limit: {}", limit.text());
            }
            let _ = writeln!(text, "  ego_speed: {}", ego.text());
            if ego.value() >= SET_SPEED_MPS_MIN {
                let _ = writeln!(text, "  set_speed: {}", ego.text());
            }
            text += "}\n\n";
        }
        text
    }

    /// An action that lets all entities of a group of variations appear.
    fn action(
        &mut self,
        name: &str,
        group: &[usize],
        times: usize,
        set: &str,
        manoeuvres: &Manoeuvres,
    ) -> String {
        let mut effects = set.to_owned();
        let variants = self.variants;
        let first = &variants[group[0]];
        if first.scene.others.is_empty() && set.is_empty() {
            effects += BEGUN;
        }
        for (nth, other) in first.scene.others.iter().enumerate() {
            let body = self.body(other);
            let trajectory = self.trajectory(other, &first.map);
            let columns: Vec<&Said> = group.iter().map(|at| &variants[*at].scene.others[nth].spawn).collect();
            let spawn = self.said(group, &columns, &other.bearer);
            let then = match manoeuvres.of(other) {
                None => String::new(),
                Some(manoeuvre) => {
                    let arguments: Vec<String> = manoeuvre
                        .varied
                        .iter()
                        .map(|place| {
                            let figures: Vec<Figure> = group
                                .iter()
                                .map(|at| figures(&variants[*at].scene.others[nth])[place.at])
                                .collect();
                            let name = format!("{}_{}", other.bearer, place.word);
                            self.parameters.number(group, &figures, &name)
                        })
                        .collect();
                    format!(", then: {}({})", manoeuvre.name, arguments.join(", "))
                }
            };
            let _ =
                writeln!(effects, "  spawn {body} as {} on {trajectory} at {spawn}{then} }}", other.bearer);
        }
        let parameters = self.parameters.declared(group, times);
        format!("/// All that the file places.\naction {name}({parameters}) {{\n{effects}}}\n")
    }

    /// A text whose numbers follow from the parameters.
    fn said(&mut self, group: &[usize], columns: &[&Said], name: &str) -> String {
        let mut nth = 0;
        let mut text = String::new();
        let mut word = String::new();
        for piece in &columns[0].0 {
            match piece {
                Piece::Text(part) => {
                    text += part;
                    word = last_word(part).unwrap_or(word);
                }
                Piece::Number(_) => {
                    let figures: Vec<Figure> =
                        columns.iter().filter_map(|said| said.figures().nth(nth)).collect();
                    let word = if word.is_empty() { "at" } else { word.as_str() };
                    text += &self.parameters.number(group, &figures, &format!("{name}_{word}"));
                    nth += 1;
                }
            }
        }
        // In the middle of its way it needs no word.
        text.strip_suffix(&format!("{OFFSET}0 m")).map_or(text.clone(), str::to_owned)
    }

    /// A rule that lets an action happen on the roads of its variations alone.
    fn rule(&self, name: &str, group: &[usize]) -> String {
        let cases = self.parameters.cases(
            group,
            |at| self.road_of[at],
            |road| format!("road == {}", self.roads[*road].1),
        );
        format!("rule {name}_is_there on {name}: {cases}\n")
    }

    /// The name of a body of the road user's size.
    fn body(&mut self, other: &Other) -> String {
        let body = &other.body;
        let [length, width, height] = [body.length_m, body.width_m, body.height_m].map(number);
        // The axle lies where the file's reference point is.
        let wheelbase = match body.is_on_foot() {
            true => String::new(),
            false => format!(", wheelbase: {} m", number(wheelbase_m(body.length_m, body.middle_m))),
        };
        let size = format!("length: {length} m, width: {width} m, height: {height} m{wheelbase}");
        let fields = format!("{{ like: {}, {size} }}", body.like);
        let name = capital(&other.bearer);
        let is_known = Body::from_name(&name).is_some() || BodyClass::from_name(&name).is_some();
        self.declare("body", &if is_known { format!("{name}_1") } else { name }, &fields)
    }

    /// The name of the road user's trajectory, which every road of its map has.
    fn trajectory(&mut self, other: &Other, map: &str) -> String {
        let road = self.roads.iter().find(|((of, ..), _)| *of == map).map_or("", |(_, name)| name.as_str());
        let fields = format!("{{ road: {road}, {} }}", other.trajectory);
        self.declare("trajectory", &format!("{}_way", other.bearer), &fields)
    }

    /// The name of a declaration, which is made if it does not exist yet.
    fn declare(&mut self, kind: &str, name: &str, fields: &str) -> String {
        let known = self.made.iter().find(|(own, of, _)| own == fields && of == name);
        if let Some((_, _, known)) = known {
            return known.clone();
        }
        let known = unique(name, &mut self.names);
        let _ = writeln!(self.declared, "{kind} {known} {fields}");
        self.made.push((fields.to_owned(), name.to_owned(), known.clone()));
        known
    }

    /// The manoeuvres in all variations. Road users whose phases differ in numbers alone share one manoeuvre.
    fn manoeuvres(&mut self, groups: &BTreeMap<String, Vec<usize>>, order: &[String]) -> Manoeuvres {
        let variants = self.variants;
        let mut found: Vec<(String, Vec<&Other>)> = Vec::new();
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        for other in order.iter().flat_map(|form| &groups[form]).flat_map(|at| &variants[*at].scene.others) {
            if other.phases.is_empty() {
                continue;
            }
            let form = phases_form(other);
            let at = *places.entry(form.clone()).or_insert(found.len());
            if at == found.len() {
                found.push((form, Vec::new()));
            }
            found[at].1.push(other);
        }
        if found.iter().any(|(form, _)| form.contains("keeping(")) {
            self.declared += pace::KEEPING;
        }
        let mut manoeuvres = BTreeMap::new();
        for (form, others) in found {
            let name = unique(&format!("{}_does", others[0].bearer), &mut self.names);
            let columns: Vec<Vec<Figure>> = others.iter().map(|other| figures(other)).collect();
            let manoeuvre = Manoeuvre::of(name, others[0], &columns);
            let _ = writeln!(self.declared, "{}", manoeuvre.text(others[0]));
            manoeuvres.insert(form, manoeuvre);
        }
        Manoeuvres(manoeuvres)
    }
}

/// Manoeuvres by the form of their phases.
struct Manoeuvres(BTreeMap<String, Manoeuvre>);

impl Manoeuvres {
    fn of(&self, other: &Other) -> Option<&Manoeuvre> {
        self.0.get(&phases_form(other))
    }
}

struct Manoeuvre {
    name: String,
    /// Its parameters.
    varied: Vec<Varied>,
    /// For each number of its phases the parameter that it is, if it varies.
    parameter: Vec<Option<usize>>,
}

struct Varied {
    /// Which number of the phases it is.
    at: usize,
    word: String,
    type_name: &'static str,
}

impl Manoeuvre {
    fn of(name: String, other: &Other, columns: &[Vec<Figure>]) -> Manoeuvre {
        let words = words(other);
        let (mut varied, mut parameter): (Vec<Varied>, Vec<Option<usize>>) = (Vec::new(), Vec::new());
        let mut taken = BTreeSet::new();
        for at in 0..columns[0].len() {
            if columns.iter().all(|column| column[at] == columns[0][at]) {
                parameter.push(None);
                continue;
            }
            // Numbers that are always the same are one parameter.
            let same = |known: &Varied| columns.iter().all(|column| column[known.at] == column[at]);
            let known = varied.iter().position(same);
            parameter.push(Some(known.unwrap_or(varied.len())));
            if known.is_none() {
                // A number behind the word keeps it from being one of the language.
                let word = unique(&format!("{}_1", words[at]), &mut taken);
                varied.push(Varied { at, word, type_name: columns[0][at].type_name() });
            }
        }
        Manoeuvre { name, varied, parameter }
    }

    fn text(&self, other: &Other) -> String {
        let typed: Vec<String> =
            self.varied.iter().map(|varied| format!("{}: {}", varied.word, varied.type_name)).collect();
        let mut text = format!("manoeuvre {}({}) {{", self.name, typed.join(", "));
        let mut parameters = self.parameter.iter();
        for phase in &other.phases {
            text += " ";
            text += &phase.shown(|figure| match parameters.next() {
                Some(Some(nth)) => self.varied[*nth].word.clone(),
                _ => figure.text(),
            });
        }
        text + " }"
    }
}

fn figures(other: &Other) -> Vec<Figure> {
    other.phases.iter().flat_map(Said::figures).collect()
}

/// The word before each number in the road user's phases.
fn words(other: &Other) -> Vec<String> {
    let mut words = Vec::new();
    for phase in &other.phases {
        let mut word = String::new();
        for piece in &phase.0 {
            match piece {
                Piece::Text(text) => word = last_word(text).unwrap_or(word),
                Piece::Number(_) => {
                    words.push(if word.is_empty() { "value".to_owned() } else { word.clone() })
                }
            }
        }
    }
    words
}

/// The last word of a text, without what stands before a point.
fn last_word(text: &str) -> Option<String> {
    let mut words = text.split(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'));
    words.rfind(|word| word.starts_with(|letter: char| letter.is_ascii_alphabetic())).map(str::to_owned)
}

/// All of a variation but its numbers, its road and what it is called.
fn form(variant: &Variant) -> String {
    let mut form = format!("{} {:?}", variant.map, variant.sky);
    for other in &variant.scene.others {
        let body = &other.body;
        let size = [body.length_m, body.width_m, body.height_m].map(number);
        let _ = write!(
            form,
            "\n{} {} {size:?} {} {} {} {}",
            other.bearer,
            body.like,
            number(body.middle_m),
            other.trajectory,
            other.spawn.form(),
            phases_form(other)
        );
    }
    form
}

fn phases_form(other: &Other) -> String {
    let phases: Vec<String> = other.phases.iter().map(Said::form).collect();
    phases.join(" ")
}

fn home(variant: &Variant) -> Home<'_> {
    let Scene { start, goal, ego_mps, limit_mps, .. } = &variant.scene;
    (&variant.map, start, goal, *ego_mps, *limit_mps)
}

/// The effect of an action that does nothing else.
const BEGUN: &str = "  set begun = true\n";

/// Below this no driving system has a wish to drive, m/s.
const SET_SPEED_MPS_MIN: f64 = 1.0;

/// A row that is played longer than its file says is told beyond this, s.
const TOLD_S: f64 = 1.0;
