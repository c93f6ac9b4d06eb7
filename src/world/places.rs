//! Whether a row finds a place: it is offered, as to an agent, at moments along each road on which it was found to run.
//! No road is driven for that. The ego vehicle is put at stations of the route, at low speeds and at the limit. The
//! lights are at several phases, and there is no other road user. If a place is found, the row has one. If none is
//! found, that is no proof: only some stations are tried, and a row may need traffic. `prove` tests rules about the
//! moment, because it knows all moments of a route; only rules about the newcomer are tested here.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::action::{ActionTable, Count, Situation, Surroundings};
use crate::sim::{Scene, Start, World};
use avastra_lang::check::{Claim, Loaded, Runs};
use avastra_lang::model::{EffectDef, Memory, Road, Row, RulesInForce, Space, code, effort};
use avastra_lang::syntax::{Diagnostic, listed};
use avastra_road::{LanePlace, RoadMap};

/// Stations of a road at which rows are offered.
const STATIONS: usize = 64;
/// By how much the phase of the lights differs from moment to moment, s.
const PHASE_S: f64 = 17.0;
/// The ego vehicle as an episode begins, and in traffic, as a share of the limit.
const SPEED_MPS: f64 = 3.0;
const SHARE_OF_LIMIT: f64 = 0.8;
/// Fastest speed of the ego vehicle at a station, m/s. Maps have roads without a limit.
const FAST_MPS_MAX: f64 = 30.0;
/// Most offers in one search over all rows. A row that finds a place nowhere needs 128 on each road. An offer that takes
/// many steps to draw counts as several.
const OFFERS_MAX: usize = 5_000;
const STEPS_AN_OFFER: u64 = 4_000;
/// If a table has more rows than this beside those that are claimed to run, there are no warnings: the search would
/// take seconds.
const ROWS_WARNED_MAX: usize = 1_000;
/// Rows named in one diagnostic, at most.
const ROWS_SHOWN: usize = 5;

/// Most scenes that are kept. An author who moves the start of a road makes a new scene with each keystroke.
const SCENES_MAX: usize = 16;

/// The scenes of roads that were searched before. A caller that searches often, such as the editor's server, then makes
/// each once.
#[derive(Debug, Default)]
pub struct Scenes(Vec<(Arc<RoadMap>, [LanePlace; 2], Arc<Scene>)>);

impl Scenes {
    fn of(&mut self, road: &Road) -> Arc<Scene> {
        let ends = [road.start, road.goal];
        let known = self.0.iter().find(|(map, of, _)| Arc::ptr_eq(map, &road.map) && *of == ends);
        if let Some((_, _, scene)) = known {
            return Arc::clone(scene);
        }
        if self.0.len() >= SCENES_MAX {
            self.0.clear();
        }
        let scene = Arc::new(Scene::of(road));
        self.0.push((Arc::clone(&road.map), ends, Arc::clone(&scene)));
        scene
    }
}

/// Adds an error for each claim that a row runs for which no place is found; then the space is not sound.
pub fn judge_claims(loaded: &mut Loaded, scenes: &mut Scenes) {
    let Some(space) = loaded.space.clone().filter(|_| !loaded.runs.claims.is_empty()) else { return };
    // One search serves all claims, because many may be about the same rows.
    let claimed: BTreeSet<usize> = loaded.runs.claims.iter().flat_map(|claim| &claim.rows).copied().collect();
    let claimed: Vec<usize> = claimed.into_iter().collect();
    let all = without_place(&space, &loaded.runs, &claimed, scenes);
    for Claim { span, rows } in loaded.runs.claims.clone() {
        let lost: Vec<&Lost<'_>> =
            all.iter().filter(|lost| rows.binary_search(&lost.row.index).is_ok()).collect();
        if lost.is_empty() {
            continue;
        }
        let message = format!("{} of {} rows were not found to run", lost.len(), rows.len());
        let error = Diagnostic::error(code::FALSE_CLAIM, message).at(span, "this is not shown");
        let note = |lost: &Lost<'_>| match lost.is_searched {
            true => format!("{} finds no place: {}", lost.row.label, lost.reasons()),
            false => {
                format!("{} was given up: the searches for other rows came to their limit", lost.row.label)
            }
        };
        let error = lost.iter().copied().take(ROWS_SHOWN).fold(error, |error, lost| error.note(note(lost)));
        loaded.diagnostics.push(error);
        loaded.space = None;
    }
}

/// Adds a warning for each action with rows for which no place is found, and that no claim is about.
pub fn warn(loaded: &mut Loaded, scenes: &mut Scenes) {
    let Some(space) = loaded.space.clone() else { return };
    let claimed: BTreeSet<usize> = loaded.runs.claims.iter().flat_map(|claim| claim.rows.clone()).collect();
    let rows: Vec<usize> = (0..space.rows.len()).filter(|row| !claimed.contains(row)).collect();
    if rows.len() > ROWS_WARNED_MAX {
        return;
    }
    let mut lost = without_place(&space, &loaded.runs, &rows, scenes);
    lost.retain(|lost| lost.is_searched);
    for (action, definition) in space.actions.iter().enumerate() {
        let of_action: Vec<&Lost<'_>> = lost.iter().filter(|lost| lost.row.action == action).collect();
        let Some(first) = of_action.first() else { continue };
        let labels: Vec<&str> = of_action.iter().take(ROWS_SHOWN).map(|lost| &*lost.row.label).collect();
        let more = match of_action.len() - labels.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let message = format!("no place is found for {}{more}", listed(&labels));
        let warning = Diagnostic::warning(code::NEVER_ENABLED, message)
            .at(definition.span, "never enabled, as far as can be seen")
            .note(format!("{}: {}", first.row.label, first.reasons()));
        let warning = match first.left_out() {
            Some(left_out) => warning.note(left_out),
            None => warning,
        };
        let help = "remove the rows with `where`, or add a road that has such a place; `avastra table FILE --try` drives them";
        loaded.diagnostics.push(warning.help(help));
    }
}

/// A row for which no place is found.
struct Lost<'a> {
    row: &'a Row,
    /// Why it was refused, by road.
    refusals: BTreeMap<usize, Vec<Count>>,
    /// Whether it was offered at every moment.
    is_searched: bool,
    space: &'a Space,
}

impl Lost<'_> {
    /// Whether the row finds a place in this world; a refusal is noted.
    fn finds_place(
        &mut self,
        table: &ActionTable,
        situation: &Situation<'_>,
        world: &World,
        road: usize,
    ) -> bool {
        let reason = match table.offer(situation, self.row.index) {
            // Each spawn was judged alone: the first of an action may stand in the way of its second.
            Ok(draw) if draw.effects.len() > 1 => match world.clone().carry_out(&draw) {
                Ok(_) => return true,
                Err((_, reason)) => reason,
            },
            Ok(_) => return true,
            Err(refusal) => refusal.in_words(),
        };
        Count::add(self.refusals.entry(road).or_default(), &reason);
        false
    }

    /// The lanes beside the route that the map has but no car drives on, in words, if the row asks for a missing lane.
    fn left_out(&self) -> Option<String> {
        let mut found = BTreeSet::new();
        for (road, counts) in &self.refusals {
            if !counts.iter().any(|count| count.reason.contains("no lane on the ")) {
                continue;
            }
            let road = &self.space.roads[*road];
            let passed = road.route.lanes.iter().map(|part| road.map.lane(part.lane).key.road.as_str());
            let passed: BTreeSet<&str> = passed.collect();
            let beside = road.map.left_out.iter().filter(|(_, left_out)| left_out.for_vehicles);
            let beside = beside.filter(|((id, _), _)| passed.contains(id.as_str()));
            let named = beside.map(|((id, lane), left_out)| format!("lane {id}/{lane}, {}", left_out.what));
            found.extend(named);
        }
        let named: Vec<String> = found.into_iter().take(ROWS_SHOWN).collect();
        (!named.is_empty()).then(|| format!("the map has, and no car drives on it: {}", named.join("; ")))
    }

    /// The most frequent reason on each road.
    fn reasons(&self) -> String {
        let mut by_reason: Vec<(&str, Vec<&str>)> = Vec::new();
        for (road, counts) in &self.refusals {
            let name = self.space.roads[*road].name.as_str();
            let most = counts.iter().map(|count| count.count).max();
            let Some(worst) = counts.iter().find(|count| Some(count.count) == most) else { continue };
            match by_reason.iter_mut().find(|(reason, _)| *reason == worst.reason) {
                Some((_, roads)) => roads.push(name),
                None => by_reason.push((&worst.reason, vec![name])),
            }
        }
        let shown = by_reason.iter().map(|(reason, roads)| format!("on {}, {reason}", listed(roads)));
        shown.collect::<Vec<_>>().join("; ")
    }
}

/// The rows among these that were found to run on some road but find no place on any road.
fn without_place<'a>(
    space: &'a Arc<Space>,
    runs: &Runs,
    rows: &[usize],
    scenes: &mut Scenes,
) -> Vec<Lost<'a>> {
    let needs_place = |row: &Row| {
        let action = &space.actions[row.action];
        let asks =
            action.drawn().filter_map(|parameter| parameter.condition.as_ref()).any(|c| c.asks_the_world());
        // The worlds that are searched have no road user to order.
        let is_about_others = |effect: &EffectDef| match effect {
            EffectDef::Order(_) => true,
            EffectDef::Spawn(spawn) => spawn.of.is_some(),
            EffectDef::Light(_) => true,
            EffectDef::Set(_) => false,
        };
        let orders = action.effects.iter().any(is_about_others);
        // A `where` about the moment cannot be left out, nor can states that it decides.
        !asks
            && !orders
            && !space.depends_on_moment(row)
            && action.effects.iter().any(|effect| matches!(effect, EffectDef::Spawn(_)))
    };
    let wanted = rows.iter().map(|row| &space.rows[*row]).filter(|row| needs_place(row));
    let runs_somewhere =
        |row: &&Row| (0..space.roads.len()).any(|road| runs.runs_in.state_of(row.index, road).is_some());
    let lost = |row| Lost { row, refusals: BTreeMap::new(), is_searched: true, space };
    let mut open: Vec<Lost<'a>> = wanted.filter(runs_somewhere).map(lost).collect();
    let table = ActionTable::new(Arc::clone(space));
    let rules = about_places(space);
    let mut of_roads: Vec<Option<Arc<Scene>>> = vec![None; space.roads.len()];
    let mut offers_left = OFFERS_MAX;
    for moment in moments() {
        for (index, road) in space.roads.iter().enumerate() {
            let state_of = |lost: &Lost<'_>| runs.runs_in.state_of(lost.row.index, index);
            // Rows that run in one state share a world.
            let states: BTreeSet<usize> = open.iter().filter_map(state_of).collect();
            for state in states {
                let memory = runs.runs_in.state(index, state);
                let scene = of_roads[index].get_or_insert_with(|| scenes.of(road));
                let world = moment.world(space, road, scene, memory);
                let kept = world.for_many();
                let surroundings = kept.as_deref().unwrap_or(&world);
                let situation = Situation {
                    memory,
                    road,
                    rules: &rules,
                    surroundings,
                    seed: moment.number,
                    step: 0,
                    happened_s: &[],
                };
                open.retain_mut(|lost| {
                    if state_of(lost) != Some(state) {
                        return true;
                    }
                    if offers_left == 0 {
                        return true;
                    }
                    let (is_found, steps) =
                        effort::counted(|| lost.finds_place(&table, &situation, &world, index));
                    offers_left = offers_left.saturating_sub(1 + (steps / STEPS_AN_OFFER) as usize);
                    !is_found
                });
                if offers_left == 0 {
                    open.iter_mut().for_each(|lost| lost.is_searched = false);
                    return open;
                }
            }
        }
    }
    open
}

/// The rules in force that ask nothing of the moment.
fn about_places(space: &Space) -> RulesInForce {
    let asks = |rule: &usize| {
        let rule = &space.rules[*rule];
        let mut conditions =
            rule.body.actions().into_iter().filter_map(|action| rule.body.demand(action)?.condition());
        conditions.any(|condition| condition.asks_the_world())
    };
    let all = RulesInForce::by_default(space);
    (0..space.rules.len()).filter(asks).fold(all, |rules, rule| rules.except(rule))
}

/// A moment of a road.
#[derive(Clone, Copy)]
struct Moment {
    number: u64,
    /// Where on the route, in `[0, 1)`.
    share: f64,
    is_fast: bool,
    phase_s: f64,
}

/// The moments of a road: first its beginning, then the halves, quarters and so on, so that long stretches are tried
/// early.
fn moments() -> impl Iterator<Item = Moment> {
    let stations = (0..STATIONS).map(|nth| {
        let bits = STATIONS.trailing_zeros();
        nth.reverse_bits() >> (usize::BITS - bits)
    });
    stations.enumerate().flat_map(|(nth, station)| {
        [false, true].into_iter().enumerate().map(move |(speed, is_fast)| {
            let number = 2 * nth + speed;
            let share = station as f64 / STATIONS as f64;
            Moment { number: number as u64, share, is_fast, phase_s: number as f64 * PHASE_S }
        })
    })
}

impl Moment {
    fn world(&self, space: &Space, road: &Road, scene: &Arc<Scene>, memory: &Memory) -> World {
        let station_m = self.share * scene.route.goal_m;
        let limit_mps = scene.map.lane(scene.route.lane_at(station_m).lane).speed_limit_mps;
        let speed_mps = if self.is_fast { SHARE_OF_LIMIT * limit_mps.min(FAST_MPS_MAX) } else { SPEED_MPS };
        let start = Start { signal_phase_s: self.phase_s, ..Start::drawn(space, road, memory, self.number) };
        World::with_ego_at(Arc::clone(scene), &start, station_m, speed_mps)
    }
}
