//! An episode log as a scenario file: its steps up to the last counted collision, and what the
//! replay must find.

use std::sync::Arc;

use crate::episode::{Breach, Collision, EpisodeLog, Outcome};
use crate::oracle::{Found, Recurrence, mixed_text};
use crate::run::{EpisodeSummary, Finding};
use avastra_base::units::Dimension;
use avastra_drivers::external;
use avastra_drivers::external::Conversation;
use avastra_lang::model::vocabulary::{BREACHED, KEPT, RECURRENCE, Word};
use avastra_lang::model::{ActionDef, START_MPS, Space, StateDef, Value, digest_text, ticks_s};
use avastra_lang::syntax::ast::{
    Arithmetic, BinaryOp, ClauseKind, Expect, Expr, Field, File, ItemKind, Name, Scenario, Span, Step,
};
use avastra_world::action::{ActionTable, Draw};
use avastra_world::sim::{ENGINE, TrafficProfile};

use super::tree;

/// The origin that an emitted file states.
#[derive(Debug, Clone, Copy)]
pub struct Provenance<'a> {
    /// The command that writes it, for example `run`.
    pub command: &'a str,
    /// Name of the scenario.
    pub name: &'a str,
    /// Path of the space's file, from the emitted file.
    pub space_path: &'a str,
    /// Number of the episode in its run.
    pub episode: usize,
    pub agent: &'a str,
    /// Rules that were switched off, and optional ones that were on.
    pub without: &'a [String],
    pub with: &'a [String],
}

/// The scenario of an episode, cut after the step of its last counted collision or breach; there must be one. Its first
/// claims are about `about`, because that is what commands take it for.
pub fn scenario(
    table: &ActionTable,
    (log, summary): (&EpisodeLog, &EpisodeSummary),
    about: Found,
    source: &Provenance,
) -> File {
    let steps = summary.last_step(log).expect("an episode without a finding is not emitted") + 1;
    let headline = headline_of(table.space(), log, summary, about);
    let expects = expects(table, (log, summary), Some(about), steps);
    file(table, log, source, [REPLAY, &headline], steps, expects)
}

/// The scenario of an episode that played an emitted scenario again. It keeps all steps, because they are the scenario,
/// and says how the episode ended.
pub fn retold(table: &ActionTable, log: &EpisodeLog, summary: &EpisodeSummary, source: &Provenance) -> File {
    let about = summary.first_found(log);
    let headline = about.map_or_else(String::new, |about| headline_of(table.space(), log, summary, about));
    let steps = log.steps.len();
    let mut expects = expects(table, (log, summary), about, steps);
    expects.push(end(log));
    file(table, log, source, [REPLAY, &headline], steps, expects)
}

/// A whole episode, as a scenario that ends as it did: one in which an external driving system failed, or one in which nothing
/// was found. If it failed before the first step, the scenario has no step.
pub fn whole(table: &ActionTable, log: &EpisodeLog, headline: &str, source: &Provenance) -> File {
    let trace = tree::text(digest_text(&log.trace()));
    let trace = tree::expect(tree::equal(tree::name("trace"), trace), Vec::new());
    file(table, log, source, [REPLAY, headline], log.steps.len(), vec![end(log), trace])
}

/// All steps of an episode as a scenario without claims, to look at.
pub fn unclaimed(table: &ActionTable, log: &EpisodeLog, headline: &str, source: &Provenance) -> File {
    let look = "look at it with `avastra render FILE --strip`";
    file(table, log, source, [look, headline], log.steps.len(), Vec::new())
}

/// The hint for the reader in most files.
const REPLAY: &str = "replay with `avastra replay FILE`";

fn file(
    table: &ActionTable,
    log: &EpisodeLog,
    source: &Provenance,
    [advice, headline]: [&str; 2],
    steps: usize,
    expects: Vec<Expect>,
) -> File {
    let space = table.space();
    let item = Scenario {
        name: Name::built(source.name),
        origin: origin(log, source),
        road: Name::built(log.road.as_str()),
        start: start(space, log),
        steps: (0..steps).map(|number| step(table, log, number)).collect(),
        expects,
    };
    let docs = vec![tree::doc(headline)];
    tree::file(source.command, advice, space, source.space_path, docs, ItemKind::Scenario(item))
}

/// An action as it was drawn, in one line: `drive_ahead(lane: Left, …) with { speed: 11 m/s, … }`.
pub fn action_text(table: &ActionTable, draw: &Draw) -> String {
    let axes = &table.rows()[draw.row].label;
    if draw.values.is_empty() {
        return axes.clone();
    }
    let drawn = drawn(table, draw);
    let fields: Vec<String> = drawn
        .iter()
        .map(|field| format!("{}: {}", field.name.text, avastra_lang::syntax::print_expr(&field.value)))
        .collect();
    format!("{axes} with {{ {} }}", fields.join(", "))
}

fn origin(log: &EpisodeLog, source: &Provenance) -> Vec<Field> {
    let names = |rules: &[String]| tree::list(rules.iter().map(|rule| tree::name(rule)).collect());
    let mut fields = vec![
        tree::field("seed", tree::whole(log.seed)),
        tree::field("episode", tree::whole(source.episode as u64)),
        tree::field("policy", tree::text(source.agent)),
        tree::field("ads", tree::text(log.ads.as_str())),
    ];
    if let Some(profile) = &log.profile {
        let line = profile.to_line();
        if !line.is_empty() {
            fields.push(tree::field("profile", tree::text(line)));
        }
        fields.push(tree::field("profile_digest", tree::text(profile.digest())));
    }
    if let Some(Conversation { attached, exchanges, .. }) = log.conversation.as_deref() {
        fields.push(tree::field("profile", tree::text(attached.to_line())));
        fields.push(tree::field("profile_digest", tree::text(attached.digest())));
        fields.push(tree::field("answers", tree::text(external::digest_of(exchanges))));
    }
    fields.push(tree::field("engine", tree::text(ENGINE)));
    let traffic = &log.start.traffic;
    if *traffic != TrafficProfile::default() {
        fields.push(tree::field("traffic", tree::text(traffic.to_line())));
        fields.push(tree::field("traffic_digest", tree::text(traffic.digest())));
    }
    if !source.without.is_empty() {
        fields.push(tree::field("without", names(source.without)));
    }
    if !source.with.is_empty() {
        fields.push(tree::field("with", names(source.with)));
    }
    fields
}

fn start(space: &Space, log: &EpisodeLog) -> Vec<Field> {
    let road = space.roads.iter().find(|road| road.name == log.road);
    let road_mps = road.map_or(START_MPS, |road| road.ego_mps);
    let states = space.states.iter().map(|state| tree::field(&state.name, state_value(space, log, state)));
    states
        .chain([
            tree::field("signal_phase", tree::quantity(log.start.signal_phase_s, Dimension::DURATION)),
            tree::field("traffic_seed", tree::whole(log.start.seed)),
        ])
        .chain(
            (log.start.ego_mps != road_mps)
                .then(|| tree::field("ego_speed", tree::quantity(log.start.ego_mps, Dimension::SPEED))),
        )
        .chain((log.start.ambient > 0).then(|| tree::field("ambient", tree::whole(log.start.ambient.into()))))
        .collect()
}

/// A plain state's value, or a map's cells as a record; if all cells are equal, one value.
fn state_value(space: &Space, log: &EpisodeLog, state: &StateDef) -> Expr {
    let cells = &log.memory.cells()[state.first_cell..state.first_cell + state.cells];
    let literal = |value: &Value| tree::value(space, *value, state.ty);
    match state.key {
        Some(key) if cells.iter().any(|cell| cell != &cells[0]) => {
            let keys = &space.enums[key.0].variants;
            tree::record(keys.iter().zip(cells).map(|(key, cell)| tree::field(key, literal(cell))).collect())
        }
        _ => literal(&cells[0]),
    }
}

fn step(table: &ActionTable, log: &EpisodeLog, number: usize) -> Step {
    let (action, drawn, after) = match &log.steps[number].outcome {
        Outcome::Passed | Outcome::Refused { .. } => (tree::call("wait", Vec::new()), Vec::new(), None),
        Outcome::Done { draw, delay_ticks, .. } => {
            let space = table.space();
            let row = &table.rows()[draw.row];
            let action = &space.actions[row.action];
            let axes =
                row.axes.iter().map(|(name, value)| (name.to_string(), literal(space, action, name, *value)));
            // The tick at which it happened, whatever it waited for: so it replays to the bit.
            let after = tree::quantity(ticks_s(*delay_ticks), Dimension::DURATION);
            let after = (*delay_ticks > 0).then_some(after);
            (tree::call(&action.name, axes.collect()), self::drawn(table, draw), after)
        }
    };
    Step {
        number: tree::digits(number.to_string()),
        action,
        drawn,
        once: None,
        held: None,
        after,
        span: Span::NONE,
    }
}

/// The drawn parameters of a step, as fields of its `with` block.
fn drawn(table: &ActionTable, draw: &Draw) -> Vec<Field> {
    let space = table.space();
    let action = &space.actions[table.rows()[draw.row].action];
    let field = |(name, value): &(Arc<str>, Value)| tree::field(name, literal(space, action, name, *value));
    draw.values.iter().map(field).collect()
}

/// A parameter's value as its literal.
fn literal(space: &Space, action: &ActionDef, parameter: &str, value: Value) -> Expr {
    let found = action.parameters.iter().find(|candidate| &*candidate.name == parameter);
    tree::value(space, value, found.expect("values are of the action's own parameters").ty)
}

/// All claims, those about `about` first.
fn expects(
    table: &ActionTable,
    (log, summary): (&EpisodeLog, &EpisodeSummary),
    about: Option<Found>,
    steps: usize,
) -> Vec<Expect> {
    let of_breaches = log.first_breaches().map(|breach| {
        let is_about = matches!(about, Some(Found::Breach(index))
            if log.breaches[index].requirement == breach.requirement);
        (is_about, of_breach(table.space(), breach, summary))
    });
    let findings = summary.collisions.iter().filter(|finding| finding.collision.step < steps);
    let of_collisions =
        findings.map(|finding| (about == Some(Found::Collision(finding.number)), of_collision(finding)));
    let mut groups: Vec<(bool, Vec<Expect>)> = of_breaches.chain(of_collisions).collect();
    groups.sort_by_key(|(is_about, _)| !is_about);
    let mut expects: Vec<Expect> = groups.into_iter().flat_map(|(_, claims)| claims).collect();
    let proc = log.steps[..steps].iter().map(|step| tree::rounded(step.proc, 3, Dimension::RATIO));
    expects.push(tree::expect(tree::equal(tree::name("proc"), tree::list(proc.collect())), Vec::new()));
    let trace = tree::text(digest_text(&log.steps[steps - 1].trace));
    expects.push(tree::expect(tree::equal(tree::name("trace"), trace), Vec::new()));
    expects
}

/// The claims about a requirement that is breached.
fn of_breach(space: &Space, breach: &Breach, summary: &EpisodeSummary) -> Vec<Expect> {
    let name = &space.requirements[breach.requirement].name;
    let at = tree::clause(ClauseKind::At, tree::rounded(breach.time_s, 2, Dimension::DURATION));
    let mut expects = vec![tree::expect(tree::part(name, BREACHED.0), vec![at])];
    if let Some(found) = summary.breached.iter().find(|found| found.requirement == breach.requirement) {
        let by = tree::list(found.kept_by.iter().map(|driver| tree::name(driver)).collect());
        expects.push(tree::expect(tree::part(name, KEPT.0), vec![tree::clause(ClauseKind::By, by)]));
        let again = found.recurrence.map(|of| tree::equal(tree::part(name, RECURRENCE.0), share(of)));
        expects.extend(again.map(|claim| tree::expect(claim, Vec::new())));
    }
    expects
}

/// The claims about a collision.
fn of_collision(finding: &Finding) -> Vec<Expect> {
    let contact = &finding.collision.contact;
    let obstacle = || tree::clause(ClauseKind::With, tree::road_user(contact.obstacle));
    let at = tree::clause(ClauseKind::At, tree::rounded(contact.time_s, 2, Dimension::DURATION));
    let mut expects = vec![tree::expect(tree::name("collision"), vec![obstacle(), at])];
    if finding.counted {
        expects.push(tree::expect(tree::name("counted"), vec![obstacle()]));
    }
    let drivers = &finding.judgement.avoided_by;
    let by = (!drivers.is_empty()).then(|| {
        let drivers = drivers.iter().map(|driver| tree::name(driver));
        tree::clause(ClauseKind::By, tree::list(drivers.collect()))
    });
    let class = tree::name(finding.judgement.class.name());
    expects.push(tree::expect(class, by.into_iter().chain([obstacle()]).collect()));
    let priority = tree::name(contact.ruling.priority.name());
    expects.push(tree::expect(tree::equal(tree::name("priority"), priority), vec![obstacle()]));
    if let Some([first, rest @ ..]) = finding.cause.as_deref() {
        let first = tree::name(first.name());
        let modules = rest.iter().map(|module| tree::name(module.name()));
        let modules = match rest {
            [] => first,
            _ => tree::list(core::iter::once(first).chain(modules).collect()),
        };
        expects.push(tree::expect(tree::equal(tree::name("cause"), modules), vec![obstacle()]));
    }
    if let Some(recurrence) = finding.recurrence {
        let claim = tree::equal(tree::name(RECURRENCE.0), share(recurrence));
        expects.push(tree::expect(claim, vec![obstacle()]));
    }
    if finding.minimal {
        expects.push(tree::expect(tree::name("minimal"), vec![obstacle()]));
    }
    expects
}

/// `14 / 20`.
fn share(Recurrence { recurred, replays }: Recurrence) -> Expr {
    tree::binary(
        BinaryOp::Arithmetic(Arithmetic::Divide),
        tree::whole(recurred.into()),
        tree::whole(replays.into()),
    )
}

/// How it ends.
fn end(log: &EpisodeLog) -> Expect {
    tree::expect(tree::equal(tree::name("end"), tree::name(log.end.name())), Vec::new())
}

/// The finding, in a sentence for the reader.
fn headline_of(space: &Space, log: &EpisodeLog, summary: &EpisodeSummary, about: Found) -> String {
    let what = match about {
        Found::Collision(index) => headline(space, log, &log.collisions[index]),
        Found::Breach(index) => {
            let breach = &log.breaches[index];
            let name = &space.requirements[breach.requirement].name;
            let at_s = breach.time_s;
            let of = breach.obstacle.map_or(String::new(), |obstacle| format!(" of npc#{obstacle}"));
            format!("The ego vehicle does not keep `{name}`{of} at {at_s:.2} s on {}.", log.road)
        }
    };
    let program = log.conversation.as_deref().map(|conversation| &conversation.attached);
    let is_mixed = program.is_some_and(|attached| !attached.is_deterministic());
    let again = |of: Recurrence| {
        format!("{what} It {}: {of} under other noise{}.", of.word(is_mixed), mixed_text(is_mixed))
    };
    summary.recurrence_of(log, about).map_or_else(|| what.clone(), again)
}

fn capitalised(text: &str) -> String {
    let (first, rest) = text.split_at(1);
    first.to_ascii_uppercase() + rest
}

/// The collision, in a sentence for the reader.
fn headline(space: &Space, log: &EpisodeLog, collision: &Collision) -> String {
    let contact = &collision.contact;
    format!(
        "{} npc#{} ({}) is hit at {:.2} s by an ego vehicle at {:.1} km/h on {}. {}.",
        space.body_name(collision.body),
        contact.obstacle,
        collision.verb.name(),
        contact.time_s,
        contact.ego_speed_mps * 3.6,
        log.road,
        capitalised(&contact.ruling.describe())
    )
}
