//! Trajectories: ways in the map of a road, along its lanes or straight from point to point.

use std::path::PathBuf;
use std::sync::Arc;

use crate::check::checker::Checker;
use crate::check::checker::Maps;
use crate::check::expression::Place;
use crate::check::mistakes::{Report, all_of, field};
use crate::check::names::docs;
use crate::check::references::Symbol;
use crate::model::vocabulary::{PointField, TrajectoryField, Word};
use crate::model::{
    BesideRoute, Laid, Road, Trajectory, TrajectoryDef, Type, WayPoint, WordExpr, code, through,
};
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast};
use avastra_base::geometry::{Path, Vec2};
use avastra_base::units::Dimension;
use avastra_road::RoadMap;

/// A way that is shorter leads nowhere, m.
const LENGTH_M_MIN: f64 = 0.1;

/// Points along the ego vehicle's route lie at most so far before and behind where the way begins, and beside the route, m.
const ALONG_M: f64 = 1000.0;
const BESIDE_ROUTE_M: f64 = 100.0;
/// Wherever such a way begins it is laid anew, so it has at most so many points.
const POINTS_MAX: usize = 200;

const BESIDE_EXAMPLE: &str = "points: [{ along: 0 m, offset: -3 m }, { along: 15 m, offset: 0 m }]";

/// The road under a point is at most so far beside it, m; beyond that the height is taken for 0 m.
const BESIDE_M: f64 = 30.0;

impl Checker {
    /// Notes the names of trajectories, which spawns use before roads are known.
    pub(super) fn declare_trajectories(&mut self, items: &[&ast::Item]) {
        let (_, declared) = self.declared("trajectory", items, ItemKind::as_trajectory);
        self.trajectories = declared
            .into_iter()
            .map(|(item, block)| TrajectoryDef {
                name: block.name.text.clone(),
                docs: docs(item),
                declared: block.clone(),
            })
            .collect();
    }

    /// The trajectory of a spawn: its name, or an expression of an enum whose variants are such names.
    pub(super) fn trajectory_word(&mut self, expr: &ast::Expr, place: &Place<'_>) -> Option<WordExpr<usize>> {
        let known = |checker: &Checker, name: &str, span: Span| {
            let found = checker.trajectories.iter().position(|one| one.name == name);
            found.ok_or_else(|| {
                let names = checker.trajectories.iter().map(|one| one.name.as_str());
                checker.unknown("trajectory", name, span, names)
            })
        };
        let note = |checker: &mut Checker, span, name: &str| {
            checker.references.uses(span, Symbol::Trajectory(name.to_owned()));
        };
        self.word_or_enum("trajectory", expr, place, known, note)
    }

    /// Lays every trajectory on the map of its road, and gives it to all roads on that map. `roads` may lack those with
    /// mistakes.
    pub(super) fn lay_trajectories(&mut self, roads: &mut [Option<Road>], maps: &mut dyn Maps) {
        for definition in self.trajectories.clone() {
            if definition.is_beside_route() {
                let laid =
                    self.beside_route(&definition.declared).map(|way| Laid::BesideRoute(Arc::new(way)));
                roads.iter_mut().flatten().for_each(|road| road.trajectories.push(laid.clone()));
                continue;
            }
            let laid = self.on_map(&definition.declared, roads, maps);
            for road in roads.iter_mut().flatten() {
                let on_it = laid.as_ref().filter(|(map_path, _)| *map_path == road.map_path);
                road.trajectories.push(on_it.map(|(_, trajectory)| Laid::OnMap(Arc::clone(trajectory))));
            }
        }
    }

    /// A trajectory without a `road`: all its points lie along the ego vehicle's route.
    fn beside_route(&mut self, block: &ast::Block) -> Option<BesideRoute> {
        let fields = self.fields_known::<TrajectoryField>(&block.fields);
        let name = &block.name;
        let points = field(&fields, TrajectoryField::Points);
        let is_along = |item: &ast::Expr| match &item.kind {
            ast::ExprKind::Record(fields) => {
                fields.iter().any(|field| field.name.text == PointField::Along.name())
            }
            _ => false,
        };
        let items = match points.map(|points| (points, &points.kind)) {
            Some((points, ast::ExprKind::List(items))) if items.is_empty() || items.iter().any(is_along) => {
                self.places(points, BESIDE_EXAMPLE)?
            }
            _ => {
                let message = format!("trajectory `{}` has no `road`", name.text);
                let error = Diagnostic::error(code::MISSING_FIELD, message);
                return self.reject(error.at(name.span, "`road: …` is missing").help(format!(
                    "without one it lies beside the ego vehicle's route, wherever it begins: `{BESIDE_EXAMPLE}`"
                )));
            }
        };
        if let Some(item) = items.get(POINTS_MAX) {
            let message = format!("a way beside the route has at most {POINTS_MAX} points");
            let error = Diagnostic::error(code::SETTING, message).at(item.span, "one too many");
            return self.reject(error.help("leave some out: the way is a curve through its points"));
        }
        let points = all_of(items.iter().map(|item| self.point_beside(item)))?;
        let way = BesideRoute::new(&points).filter(|way| way.length_m() >= LENGTH_M_MIN);
        way.or_else(|| self.has_no_length(block.name.span))
    }

    fn on_map(
        &mut self,
        block: &ast::Block,
        roads: &[Option<Road>],
        maps: &mut dyn Maps,
    ) -> Option<(PathBuf, Arc<Trajectory>)> {
        let fields = self.fields_known::<TrajectoryField>(&block.fields);
        let name = &block.name;
        let road = field(&fields, TrajectoryField::Road)?;
        let road_name = self.name_of(road, "a road")?;
        let Some(road) = roads.iter().flatten().find(|known| known.name == road_name) else {
            if self.announced.roads.iter().any(|known| known == road_name) {
                // The broken road has its own message.
                return None;
            }
            let names = self.announced.roads.iter().map(String::as_str);
            let error = self.unknown("road", road_name, road.span, names);
            return self.reject(error);
        };
        let (lanes, points) =
            (field(&fields, TrajectoryField::Lanes), field(&fields, TrajectoryField::Points));
        let (path, turns) = match (lanes, points) {
            (Some(lanes), None) => (self.along_lanes(lanes, &road.map, maps)?, Vec::new()),
            (None, Some(points)) => self.through_points(points, &road.map)?,
            (Some(_), Some(points)) => {
                let error = Diagnostic::error(code::NOT_HERE, "`lanes` and `points` both say the way");
                let error = error.at(points.span, "beside `lanes`");
                return self.reject(error.help("leave one of the two out"));
            }
            (None, None) => {
                let message = format!("trajectory `{}` does not say where it leads", name.text);
                let error = Diagnostic::error(code::MISSING_FIELD, message).at(name.span, "without a way");
                return self.reject(error.help(
                    "write `lanes: [lane 1/-1 at 0 m, lane 7/-1 at 80 m]` for a way along lanes, or `points: […]` for straight pieces",
                ));
            }
        };
        let heights_m = path.points().iter().map(|point| {
            let found = road.map.nearest(point.position, point.heading_rad, BESIDE_M);
            found.map_or(0.0, |place| road.map.lane(place.lane).height_at(place.station_m))
        });
        let heights_m = heights_m.collect();
        Some((road.map_path.clone(), Arc::new(Trajectory { path, heights_m, turns })))
    }

    /// The expressions of a list of at least two places.
    fn places<'a>(&mut self, list: &'a ast::Expr, example: &str) -> Option<&'a [ast::Expr]> {
        match &list.kind {
            ast::ExprKind::List(items) if items.len() >= 2 => Some(items),
            _ => {
                let error = Diagnostic::error(code::TYPE_MISMATCH, "a way is a list of two places or more");
                self.reject(error.at(list.span, "leads nowhere").help(format!("write `{example}`")))
            }
        }
    }

    fn along_lanes(&mut self, list: &ast::Expr, map: &Arc<RoadMap>, maps: &mut dyn Maps) -> Option<Path> {
        let items = self.places(list, "lanes: [lane 1/-1 at 0 m, lane 7/-1 at 80 m]")?;
        let places = all_of(items.iter().map(|item| self.lane_point(item, map)))?;
        let mut parts = Vec::new();
        for (pair, item) in places.windows(2).zip(&items[1..]) {
            match maps.route(map, pair[0], pair[1]) {
                // The path of a route goes on behind its goal.
                Ok(route) => parts.extend(route.path.part(0.0, route.goal_m)),
                Err(error) => {
                    let message = "no way leads along the lanes to this place";
                    let error = Diagnostic::error(code::NO_ROUTE, message).at(item.span, error.to_string());
                    return self.reject(error.help(
                        "`avastra road MAP` tells which lane leads where; `points` lead straight from place to place",
                    ));
                }
            }
        }
        self.long_enough(Path::join(&parts), list.span)
    }

    /// The way, and how far one is turned at the stations of its points, if that is said of any.
    fn through_points(&mut self, list: &ast::Expr, map: &Arc<RoadMap>) -> Option<(Path, Vec<(f64, f64)>)> {
        let items = self.places(list, "points: [{ x: 0 m, y: 3 m }, { x: 40 m, y: 3 m }]")?;
        let points = all_of(items.iter().map(|item| self.point(item, map)))?;
        let (path, turns) = match through(&points) {
            Some(found) => found,
            None => return self.has_no_length(list.span),
        };
        Some((self.long_enough(Some(path), list.span)?, turns))
    }

    fn long_enough(&mut self, path: Option<Path>, span: Span) -> Option<Path> {
        path.filter(|path| path.length_m() >= LENGTH_M_MIN).or_else(|| self.has_no_length(span))
    }

    fn has_no_length<T>(&mut self, span: Span) -> Option<T> {
        let error = Diagnostic::error(code::SETTING, "the trajectory has no length");
        self.reject(error.at(span, format!("must be at least {LENGTH_M_MIN} m long")))
    }

    /// A point along the ego vehicle's route.
    fn point_beside(&mut self, item: &ast::Expr) -> Option<WayPoint> {
        let wrong = |checker: &mut Checker, span| {
            let message = "a point beside the route is `along` it, with an `offset` or without";
            let error = Diagnostic::error(code::MISSING_FIELD, message).at(span, "is not");
            checker
                .reject(error.help("write `{ along: 12 m, offset: -3 m }`, or give the trajectory a `road`"))
        };
        let ast::ExprKind::Record(fields) = &item.kind else { return wrong(self, item.span) };
        let fields = self.fields_known::<PointField>(fields);
        let elsewhere =
            fields.iter().find(|(known, _)| matches!(known, PointField::At | PointField::X | PointField::Y));
        if let Some((_, value)) = elsewhere {
            return wrong(self, value.span);
        }
        let Some(along) = field(&fields, PointField::Along) else { return wrong(self, item.span) };
        let along_m = self.bounded_m(along, ALONG_M)?;
        let offset_m = match field(&fields, PointField::Offset) {
            Some(offset) => self.bounded_m(offset, BESIDE_ROUTE_M)?,
            None => 0.0,
        };
        let turned_rad = self.turned_rad(&fields)?;
        Some(WayPoint { place: Vec2::new(along_m, offset_m), turned_rad })
    }

    fn turned_rad(&mut self, fields: &[(PointField, &ast::Expr)]) -> Option<f64> {
        match field(fields, PointField::Turned) {
            Some(value) => self.number_of(value, Dimension::ANGLE),
            None => Some(0.0),
        }
    }

    /// A length that is not farther from 0 m than this.
    fn bounded_m(&mut self, value: &ast::Expr, most_m: f64) -> Option<f64> {
        let number_m = self.number_of(value, Dimension::LENGTH)?;
        if number_m.abs() <= most_m {
            return Some(number_m);
        }
        let error = Diagnostic::error(code::SETTING, format!("must lie between -{most_m} m and {most_m} m"));
        self.reject(error.at(value.span, "too far away"))
    }

    /// A point: a place on a lane, one beside it, or one in the plane.
    fn point(&mut self, item: &ast::Expr, map: &RoadMap) -> Option<WayPoint> {
        let ast::ExprKind::Record(fields) = &item.kind else {
            let place = self.lane_point(item, map)?;
            let place = map.lane(place.lane).centre.position_at(place.station_m);
            return Some(WayPoint { place, turned_rad: 0.0 });
        };
        let fields = self.fields_known::<PointField>(fields);
        let turned_rad = self.turned_rad(&fields)?;
        if let Some(along) = field(&fields, PointField::Along) {
            let message = "a point `along` the ego vehicle's route lies on no road's map";
            let error = Diagnostic::error(code::NOT_HERE, message).at(along.span, "beside a `road`");
            return self.reject(error.help("leave the `road` out, or write where the point lies on its map"));
        }
        let mut number =
            |wanted| field(&fields, wanted).map(|value| self.number_of(value, Dimension::LENGTH));
        let (x, y, offset) = (number(PointField::X), number(PointField::Y), number(PointField::Offset));
        match (field(&fields, PointField::At), x, y) {
            (Some(at), None, None) => {
                let place = self.lane_point(at, map)?;
                let pose = map.lane(place.lane).centre.pose_at(place.station_m);
                let place = pose.offset(0.0, offset.unwrap_or(Some(0.0))?).position;
                Some(WayPoint { place, turned_rad })
            }
            (None, Some(x), Some(y)) if offset.is_none() => {
                Some(WayPoint { place: Vec2::new(x?, y?), turned_rad })
            }
            _ => {
                let message =
                    "a point is a place on a lane, with an `offset` or without, or an `x` and a `y`";
                let error = Diagnostic::error(code::MISSING_FIELD, message).at(item.span, "neither");
                self.reject(
                    error.help("write `{ at: lane 1/-1 at 40 m, offset: -4 m }` or `{ x: 12 m, y: 3 m }`"),
                )
            }
        }
    }

    fn number_of(&mut self, value: &ast::Expr, dimension: Dimension) -> Option<f64> {
        let number = self.typed(value, &Place::default(), Type::Quantity(dimension))?;
        Some(self.fold_number(&number)?.to_f64())
    }

    /// Notes the names and numbers of a trajectory, whether its map can be read or not.
    pub(super) fn note_trajectory(&mut self, block: &ast::Block) {
        for field in &block.fields {
            self.references.word_named::<TrajectoryField>(field.name.span, &field.name.text);
            match &field.value.kind {
                ast::ExprKind::Name(road) => {
                    self.references.uses(field.value.span, Symbol::Road(road.clone()));
                }
                ast::ExprKind::List(items) => items.iter().for_each(|item| self.note_point(item)),
                _ => {}
            }
        }
    }

    fn note_point(&mut self, item: &ast::Expr) {
        match &item.kind {
            ast::ExprKind::LanePoint { station, .. } => self.references.number(station),
            ast::ExprKind::Record(fields) => {
                for field in fields {
                    self.references.word_named::<PointField>(field.name.span, &field.name.text);
                    match &field.value.kind {
                        ast::ExprKind::LanePoint { station, .. } => self.references.number(station),
                        _ => self.look_at(&field.value, &Place::default(), None),
                    }
                }
            }
            _ => {}
        }
    }
}
