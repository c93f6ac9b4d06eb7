//! Roads: each has a map, a start and a goal on it, the route between them, and the facts that rules may use.

use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::check::checker::{Checker, Maps};
use crate::check::expression::{Place, number_help};
use crate::check::mistakes::{Report, all_of, field};
use crate::check::names::docs;
use crate::check::names::unknown;
use crate::model::vocabulary::{RoadField, Word};
use crate::model::{
    Road, RoadFacts, SIGNAL_PHASE_S, SPAWN_SPEED_MPS, SPEED_MPS_MAX, START_MPS, SignalProgram, Type, code,
    stretches,
};
use crate::syntax::ast::ItemKind;
use crate::syntax::{Diagnostic, ast, print_expr};
use avastra_base::units::{Dimension, Rational};
use avastra_road::{LEVEL_SLOPE_MAX, LanePlace, Obstacle, RoadMap, Route, SignKind};

/// Least speed that an ego vehicle may want, m/s: it has to arrive.
const SET_MPS_MIN: f64 = 1.0;

/// How long a light may show a colour, s; red for all may be left out.
const LIGHT_S_MIN: f64 = 0.5;
const LIGHT_S_MAX: f64 = 600.0;

impl Checker {
    /// The roads of `episode.roads`, or all.
    pub(super) fn roads(
        &mut self,
        items: &[&ast::Item],
        chosen: Option<Vec<ast::Name>>,
        maps: &mut dyn Maps,
    ) -> Vec<Road> {
        let (names, declared) = self.declared("road", items, ItemKind::as_road);
        let mut roads: Vec<Option<Road>> =
            declared.into_iter().map(|(item, block)| self.road(item, block, maps)).collect();
        self.lay_trajectories(&mut roads, maps);
        let Some(chosen) = chosen else { return roads.into_iter().flatten().collect() };
        let mut picked = Vec::new();
        for name in &chosen {
            match names.get(&name.text) {
                None => self.report(unknown("road", &name.text, name.span, names.all())),
                // A road that is named twice is taken once.
                Some(index) => picked.extend(roads[index].take()),
            }
        }
        picked
    }

    fn road(&mut self, item: &ast::Item, block: &ast::Block, maps: &mut dyn Maps) -> Option<Road> {
        let fields = self.fields_known(&block.fields);
        let [map, start, goal] = [RoadField::Map, RoadField::Start, RoadField::Goal].map(|needed| {
            field(&fields, needed).or_else(|| {
                let message = format!("road `{}` has no `{}`", block.name.text, needed.name());
                self.missing_field(needed, block.name.span, message)
            })
        });
        let (map, start, goal) = (map?, start?, goal?);
        let ast::ExprKind::Text(path) = &map.kind else {
            let error = Diagnostic::error(code::TYPE_MISMATCH, "`map` needs a path in quotes");
            return self.reject(error.at(map.span, "not a text"));
        };
        let (map_path, map) = match maps.map(&ast::Text::new(path.clone(), map.span)) {
            Ok(found) => found,
            Err(reason) => {
                let error = Diagnostic::error(code::UNREADABLE, format!("cannot use map `{path}`"));
                return self.reject(error.at(map.span, reason));
            }
        };
        let map = match field(&fields, RoadField::Limit).map(|limit| self.limit(limit)) {
            None => map,
            Some(limit_mps) => slowed(&map, limit_mps?),
        };
        let map = match field(&fields, RoadField::BusLanes) {
            None => map,
            Some(lanes) => self.with_bus_lanes(lanes, &map)?,
        };
        let start = self.lane_point(start, &map);
        let goal = self.lane_point(goal, &map);
        let (start, goal) = (start?, goal?);
        let route = match maps.route(&map, start, goal) {
            Ok(route) => route,
            Err(error) => {
                let message = format!("road `{}` has no route", block.name.text);
                let error = Diagnostic::error(code::NO_ROUTE, message).at(block.name.span, error.to_string());
                return self.reject(error.help("`avastra road MAP` tells which lane leads where"));
            }
        };
        let unlit = match field(&fields, RoadField::Unlit).map(|unlit| self.truth(unlit)) {
            None => false,
            Some(unlit) => unlit?,
        };
        if !unlit {
            self.refuse_idle_lights(block, &map, &route)?;
        }
        if let Some((leap_m, from, to)) = route.leap(&map) {
            let [from, to] = [from, to].map(|lane| &map.lane(lane).key);
            let message = format!("the route of road `{}` leaps over a gap of the map", block.name.text);
            let label = format!(
                "{leap_m:.1} m, from lane {}/{} to lane {}/{}",
                from.road, from.lane, to.road, to.lane
            );
            self.report(Diagnostic::warning(code::NO_ROUTE, message).at(block.name.span, label).help(
                "mend the map, or choose places between which it has none; `avastra road MAP` lists the gaps",
            ));
        }
        self.warn_of_undriven(block, &map, &route);
        let ego_mps = match field(&fields, RoadField::EgoSpeed) {
            Some(value) => self.road_speed(value, RoadField::EgoSpeed, "a speed", 0.0),
            None => Some(START_MPS),
        };
        let set_mps = match field(&fields, RoadField::SetSpeed) {
            Some(value) => {
                Some(self.road_speed(value, RoadField::SetSpeed, "a wanted speed", SET_MPS_MIN)?)
            }
            None => None,
        };
        let signal_phase_s = match field(&fields, RoadField::SignalPhase) {
            Some(value) => {
                let what = "a signal phase";
                let example = "signal_phase: 12 s";
                Some(self.road_number(value, Dimension::DURATION, what, SIGNAL_PHASE_S, example)?)
            }
            None => None,
        };
        let mut light_time = |wanted: RoadField, least_s: f64| match field(&fields, wanted) {
            Some(value) => {
                let what = format!("a time of {}", wanted.name().replace('_', " "));
                let example = format!("{}: 3 s", wanted.name());
                self.road_number(value, Dimension::DURATION, &what, least_s..=LIGHT_S_MAX, &example).map(Some)
            }
            None => Some(None),
        };
        let signal_program = SignalProgram {
            green_s: light_time(RoadField::Green, LIGHT_S_MIN)?,
            yellow_s: light_time(RoadField::Yellow, LIGHT_S_MIN)?,
            all_red_s: light_time(RoadField::AllRed, 0.0)?,
        };
        let facts = facts(&block.name.text, &map, &route);
        let name = block.name.text.clone();
        Some(Road {
            name,
            docs: docs(item),
            map_path,
            map,
            start,
            goal,
            route,
            ego_mps: ego_mps?,
            set_mps,
            signal_phase_s,
            signal_program,
            trajectories: Vec::new(),
            facts,
        })
    }

    /// Notes the names and numbers of a road, whether its map can be read or not.
    pub(super) fn note_road(&mut self, block: &ast::Block) {
        for field in &block.fields {
            self.references.word_named::<RoadField>(field.name.span, &field.name.text);
            let parts = match &field.value.kind {
                ast::ExprKind::List(items) => items.as_slice(),
                _ => core::slice::from_ref(&field.value),
            };
            let stations = parts.iter().filter_map(|part| match &part.kind {
                ast::ExprKind::LanePoint { station, .. } => Some(station),
                _ => None,
            });
            match stations.clone().count() == parts.len() {
                true => stations.for_each(|station| self.references.number(station)),
                false => self.look_at(&field.value, &Place::default(), None),
            }
        }
    }

    /// Warns of what the map has on a route and no driver knows.
    fn warn_of_undriven(&mut self, block: &ast::Block, map: &RoadMap, route: &Route) {
        let name = &block.name;
        let slope = route.steepest(map);
        if slope > LEVEL_SLOPE_MAX {
            let message = format!("the slopes of road `{}` are not driven", name.text);
            let label = format!("up to {:.0} %: everything drives as on the flat", slope * 100.0);
            let help = "speeds and braking ways are those of a level road: choose a level part, or mind it in what you conclude";
            self.report(Diagnostic::warning(code::NOT_DRIVEN, message).at(name.span, label).help(help));
        }
        let count = route.obstacles(map).count();
        if let Some(Obstacle { what, place }) = route.obstacles(map).next() {
            let message = format!("solid objects of the map stand on the route of road `{}`", name.text);
            let lane = map.lane(place.lane);
            let s_m = lane.road_station_m(place.station_m);
            let label = format!(
                "{count}, the first of them {what} in lane {}/{} at {s_m:.1} m: whatever drives passes through it",
                lane.key.road, lane.key.lane
            );
            let help = "to have drivers see it and hit it, spawn an `Object` there";
            self.report(Diagnostic::warning(code::NOT_DRIVEN, message).at(name.span, label).help(help));
        }
    }

    /// A junction whose lights say nothing is driven through without a stop: nothing that an author would expect.
    fn refuse_idle_lights(&mut self, block: &ast::Block, map: &RoadMap, route: &Route) -> Option<()> {
        let passed = route.lanes.iter().filter_map(|part| map.lane(part.lane).junction);
        let Some(idle) = passed.map(|index| &map.junctions[index]).find(|junction| junction.idle_lights > 0)
        else {
            return Some(());
        };
        let message = format!("no light of junction `{}` holds a lane", idle.id);
        let reason = format!("the route leads through it; lights without a lane: {}", idle.idle_lights);
        self.reject(Diagnostic::error(code::NO_ROUTE, message).at(block.name.span, reason).help(
            "`avastra road MAP` names these lights; `unlit: true` drives through the junction as if it had none",
        ))
    }

    /// A copy of the map with these lanes kept for buses. Drivers read it there.
    fn with_bus_lanes(&mut self, value: &ast::Expr, map: &RoadMap) -> Option<Arc<RoadMap>> {
        let ast::ExprKind::List(items) = &value.kind else {
            let error = Diagnostic::error(code::TYPE_MISMATCH, "`bus_lanes` is a list of places on lanes");
            return self.reject(
                error.at(value.span, "no list").help("write one place for each: `[lane 3/4 at 10 m]`"),
            );
        };
        let places = all_of(items.iter().map(|item| self.lane_point(item, map)))?;
        let mut map = map.clone();
        map.keep_for_buses(&places);
        Some(Arc::new(map))
    }

    fn truth(&mut self, value: &ast::Expr) -> Option<bool> {
        if let ast::ExprKind::Bool(truth) = value.kind {
            return Some(truth);
        }
        let error = Diagnostic::error(code::TYPE_MISMATCH, "`unlit` is `true` or `false`");
        self.reject(error.at(value.span, "not a Bool"))
    }

    /// A limit for the whole road, m/s.
    fn limit(&mut self, value: &ast::Expr) -> Option<f64> {
        let limit = self.typed(value, &Place::default(), Type::Quantity(Dimension::SPEED))?;
        let limit_mps = self.fold_number(&limit)?.to_f64();
        if limit_mps > 0.0 && limit_mps <= *SPAWN_SPEED_MPS.end() {
            return Some(limit_mps);
        }
        let error =
            Diagnostic::error(code::SETTING, format!("a limit of `{}` is not possible", print_expr(value)));
        let wanted = format!("must be more than 0 m/s and at most {} m/s", SPAWN_SPEED_MPS.end());
        self.reject(error.at(value.span, wanted).help("write for example `limit: 30 km/h`"))
    }

    /// A speed of the ego vehicle, m/s.
    fn road_speed(&mut self, value: &ast::Expr, of: RoadField, what: &str, least_mps: f64) -> Option<f64> {
        let example = format!("{}: 60 km/h", of.name());
        self.road_number(value, Dimension::SPEED, what, least_mps..=SPEED_MPS_MAX, &example)
    }

    /// A number of a road in SI, within its range.
    fn road_number(
        &mut self,
        value: &ast::Expr,
        dimension: Dimension,
        what: &str,
        range: RangeInclusive<f64>,
        example: &str,
    ) -> Option<f64> {
        let number = self.typed(value, &Place::default(), Type::Quantity(dimension))?;
        let number = self.fold_number(&number)?.to_f64();
        if range.contains(&number) {
            return Some(number);
        }
        let message = format!("{what} of `{}` is not possible", print_expr(value));
        let unit = if dimension == Dimension::SPEED { "m/s" } else { "s" };
        let bounds = format!("must lie within {} .. {} {unit}", range.start(), range.end());
        let error = Diagnostic::error(code::SETTING, message).at(value.span, bounds);
        self.reject(error.help(format!("write for example `{example}`")))
    }

    pub(super) fn lane_point(&mut self, value: &ast::Expr, map: &RoadMap) -> Option<LanePlace> {
        let ast::ExprKind::LanePoint { road, lane, station } = &value.kind else {
            let error = Diagnostic::error(code::TYPE_MISMATCH, "wanted a place on a lane");
            return self.reject(
                error.at(value.span, "not a place").help("write `lane 1/-1 at 12 m`: road, lane and station"),
            );
        };
        let station_expr = self.number(station)?;
        let help = || number_help("", station, Dimension::LENGTH);
        let station = self.fit(station_expr, Type::Quantity(Dimension::LENGTH), help)?;
        let station_m = self.fold_number(&station)?.to_f64();
        let Ok(lane_id) = lane.text.parse::<i32>() else {
            let error = Diagnostic::error(code::NO_ROUTE, "the lane's number is too large");
            return self.reject(error.at(lane.span, ""));
        };
        match map.place(&road.value, lane_id, station_m) {
            Ok(place) => Some(place),
            Err(error) => {
                let message = format!("there is no such place on map `{}`", map.name);
                let error = Diagnostic::error(code::NO_ROUTE, message).at(value.span, error.to_string());
                self.reject(
                    error.help("`avastra road MAP` tells which lanes there are, and how long they are"),
                )
            }
        }
    }
}

/// A copy of the map in which no lane allows more than the limit; lower limits of the map stay, and where it states none,
/// the limit counts. It is stored in the lanes because driving systems read it there.
fn slowed(map: &RoadMap, limit_mps: f64) -> Arc<RoadMap> {
    let mut map = map.clone();
    for lane in &mut map.lanes {
        lane.speed_limit_mps =
            if lane.states_limit { lane.speed_limit_mps.min(limit_mps) } else { limit_mps };
    }
    Arc::new(map)
}

/// The facts about a route that rules may use.
fn facts(name: &str, map: &RoadMap, route: &Route) -> RoadFacts {
    let lanes = || route.lanes.iter().map(|part| map.lane(part.lane));
    let limit_mps = lanes().map(|lane| lane.speed_limit_mps).fold(f64::INFINITY, f64::min);
    let limit = exact_limit(limit_mps);
    let beside = |left: bool| {
        lanes().any(|lane| {
            let neighbour = if left { lane.left } else { lane.right };
            neighbour.is_some_and(|neighbour| neighbour.same_direction)
        })
    };
    let limited_at = route.slowest(map).map(|part| {
        let key = &map.lane(part.lane).key;
        let (from_m, to_m) = (part.enter_m.max(0.0), part.to_m);
        format!("lane {}/{} from {from_m:.0} to {to_m:.0} m along the route", key.road, key.lane)
    });
    let lanes = [beside(true), true, beside(false)];
    let all = || map.lanes.iter().map(|lane| lane.speed_limit_mps);
    RoadFacts {
        name: name.to_owned(),
        limit,
        limit_mps: limit.to_f64(),
        limited_at,
        lanes,
        map_limits_mps: [all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max)],
        has_stop_sign: route.sign_lines.iter().any(|line| line.kind == SignKind::Stop),
        stretches: stretches(map, route).into(),
    }
}

/// The exact limit: a whole number of km/h or mph if the map's `f64` is close to one, as on road signs.
fn exact_limit(limit_mps: f64) -> Rational {
    for unit in ["km/h", "mph"] {
        let Some(unit) = avastra_base::units::unit(unit) else { continue };
        let shown = (limit_mps / unit.factor().to_f64()).round();
        if (0.0..1e4).contains(&shown) {
            let exact = Rational::integer(shown as i64).checked_mul(unit.factor());
            if let Some(exact) = exact.filter(|exact| (exact.to_f64() - limit_mps).abs() < 1e-3) {
                return exact;
            }
        }
    }
    // A road without a limit gets 1000 m/s, which nothing reaches.
    Rational::from_rounded(limit_mps).unwrap_or(Rational::integer(1000))
}
