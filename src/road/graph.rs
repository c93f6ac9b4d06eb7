//! From OpenDRIVE elements to the lane graph: lanes, their links, neighbours and limits.
//!
//! The cost of a map grows with its text. Where it could grow faster there is a limit, and a file past it is refused with a
//! message that says what to make smaller. A whole city, 50,000 roads with 100,000 lane sections, is well within all limits.

use core::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use avastra_base::geometry::{Path, Vec2, wrap_angle};

use super::centre_line::{CHORD_M_MAX, CentreLine, NoCentreLine, centre_line};
use super::heights::Heights;
use super::index::LaneGrid;
use super::lane_change::permitted;
use super::map::{
    Junction, Lane, LaneIndex, LaneKey, LeftOut, Neighbour, Precedence, RoadError, RoadMap, Strip, Turn,
};
use super::opendrive::{
    Contact, Document, JunctionElement, LaneElement, Limit, RoadElement, RoadLink, SectionElement, read,
    wrong,
};
use super::phases::share_phases;
use super::signals::{add_objects, add_signals, find_obstacles, set_precedence};

impl RoadMap {
    /// Reads an OpenDRIVE file (1.4 to 1.8).
    ///
    /// # Errors
    /// The mistake in the file, and its line.
    pub fn from_opendrive(name: &str, text: &str) -> Result<RoadMap, RoadError> {
        build(&read(name, text)?)
    }
}

/// The limit of a road whose file states none, m/s: 50 km/h, usual in towns.
pub const LIMIT_MPS_DEFAULT: f64 = 50.0 / 3.6;

/// The limit of a motorway without one, m/s: 130 km/h, which Germany advises.
const ADVISED_MPS: f64 = 130.0 / 3.6;

/// Below this change of heading a connection is straight (survey conventions).
const STRAIGHT_RAD_MAX: f64 = 30.0 * core::f64::consts::PI / 180.0;

/// Above this change of heading a connection is a U-turn (survey conventions).
const U_TURN_RAD_MIN: f64 = 150.0 * core::f64::consts::PI / 180.0;

/// A turn by more than this, with a smaller mean radius (m), is left out: it leads back into the next lane beside,
/// and no car can drive it in one go (between kerbs, cars need 10 to 12 m).
const TIGHT_RAD_MIN: f64 = 100.0 * core::f64::consts::PI / 180.0;
const TIGHT_M_MIN: f64 = 3.0;

/// Lanes that meet at a larger angle than this are not linked: so sharp a corner within a reference line is left out
/// as well.
const LINK_RAD_MAX: f64 = 60.0 * core::f64::consts::PI / 180.0;

/// Limit on the vertices of all centre lines of a map: for any map, and more for each of its roads. A curved lane has a
/// vertex at each metre; a straight one has two.
const VERTICES_MAX: usize = 2_000_000;
const VERTICES_A_ROAD: usize = 100;

/// Limit on the steps of `centre_line` for all centre lines, also with more for each road. A map within the limit on vertices
/// exceeds it only if it curls, or if tens of lanes beside each other change their widths all the time.
const STEPS_MAX: u64 = 50_000_000;
const STEPS_A_ROAD: u64 = 5_000;

/// Limit on the length of all lanes of a map together, m.
const LANES_M_MAX: f64 = 5e7;

/// Limits on the lanes inside one junction, and on their vertices, because each lane is compared with every other.
const JUNCTION_LANES_MAX: usize = 1000;
const JUNCTION_VERTICES_MAX: usize = 50_000;

/// Builds the map of a file.
pub fn build(document: &Document) -> Result<RoadMap, RoadError> {
    let mut builder = Builder::new(document)?;
    refuse_long_bends(document)?;
    builder.add_lanes()?;
    builder.link_sections();
    builder.link_roads();
    builder.link_junctions();
    builder.warn_of_unlinked_roads();
    builder.unlink_corners();
    builder.set_neighbours();
    add_signals(&mut builder)?;
    add_objects(&mut builder);
    builder.add_strips()?;
    let mut map = builder.map;
    map.warnings.extend(loose_links(&map));
    for lane in &mut map.lanes {
        lane.successors.sort();
        lane.predecessors.sort();
        lane.stop_lines.sort_by(|a, b| a.station_m.total_cmp(&b.station_m));
    }
    for index in 0..map.lanes.len() {
        if let Some(junction) = map.lanes[index].junction {
            map.junctions[junction].lanes.push(LaneIndex(index));
        }
    }
    for (index, junction) in document.junctions.iter().enumerate() {
        if map.ways_through(index).is_none() {
            let message = format!(
                "junction `{}` has too many ways through it: its connecting roads lead into each other; link each of \
                 them to roads outside",
                junction.id
            );
            return Err(wrong(junction.line, message));
        }
    }
    map.close_for_buses();
    map.has_levels = map.find_levels();
    share_phases(&mut map);
    set_precedence(document, &mut map);
    map.grid = LaneGrid::new(&map.lanes);
    find_obstacles(document, &mut map);
    Ok(map)
}

/// Refuses a map whose curves alone need more vertices than a map may have, before any is computed.
fn refuse_long_bends(document: &Document) -> Result<(), RoadError> {
    let mut bent_m = 0.0;
    for road in &document.roads {
        for section in &road.sections {
            let sampled = section.lanes.iter().filter(|lane| is_sampled(lane)).count();
            if sampled > 0 {
                bent_m += road.reference.bent_m(section.begin_m, section.end_m) * sampled as f64;
            }
        }
        if bent_m > vertices_max(document) as f64 * CHORD_M_MAX {
            return Err(too_large(road, "its curved lanes are too long"));
        }
    }
    Ok(())
}

fn vertices_max(document: &Document) -> usize {
    VERTICES_MAX + VERTICES_A_ROAD * document.roads.len()
}

/// Whether a lane gets a centre line.
fn is_sampled(lane: &LaneElement) -> bool {
    lane.undriven.is_none() || lane.beside.is_some()
}

/// The error for a map that is past a limit up to a road.
fn too_large(road: &RoadElement, what: &str) -> RoadError {
    let message =
        format!("the map is too large, up to road `{}`: {what}; cut out the part to be driven", road.id);
    wrong(road.line, message)
}

/// The work and size of the lanes so far.
#[derive(Default)]
struct Spent {
    steps: Cell<u64>,
    vertices: usize,
    length_m: f64,
}

impl Spent {
    /// The centre line of a lane, or why the lane has none. Counts its work and size.
    ///
    /// # Errors
    /// If the map is past a limit.
    fn centre_line(
        &mut self,
        document: &Document,
        road: &RoadElement,
        section: &SectionElement,
        lane: i32,
    ) -> Result<Result<CentreLine, NoCentreLine>, RoadError> {
        let found = centre_line(road, section, lane, &self.steps);
        if let Ok(centre) = &found {
            self.vertices += centre.path.points().len();
            self.length_m += centre.path.length_m();
        }
        if self.steps.get() > STEPS_MAX + STEPS_A_ROAD * document.roads.len() as u64 {
            return Err(too_large(road, "its lanes bend and widen too often"));
        }
        if self.vertices > vertices_max(document) {
            return Err(too_large(road, "its curved lanes are too long"));
        }
        if self.length_m > LANES_M_MAX {
            return Err(too_large(road, "its lanes are too long"));
        }
        Ok(found)
    }
}

/// A map while it is being built.
pub struct Builder<'a> {
    pub document: &'a Document,
    pub map: RoadMap,
    /// Index in `document.roads`.
    pub roads: BTreeMap<&'a str, usize>,
    /// Index in `map.junctions` and in `document.junctions`.
    pub junctions: BTreeMap<&'a str, usize>,
    /// Lanes by road index, section and lane id.
    lanes: BTreeMap<(usize, usize, i32), LaneIndex>,
    spent: Spent,
}

impl<'a> Builder<'a> {
    fn new(document: &'a Document) -> Result<Builder<'a>, RoadError> {
        let mut roads = BTreeMap::new();
        for (index, road) in document.roads.iter().enumerate() {
            if roads.insert(road.id.as_str(), index).is_some() {
                return Err(wrong(road.line, format!("a second road has the id `{}`", road.id)));
            }
        }
        let junctions = document.junctions.iter().enumerate().map(|(i, junction)| (junction.id.as_str(), i));
        let empty = |junction: &JunctionElement| Junction {
            id: junction.id.clone(),
            name: junction.name.clone(),
            groups: junction.controllers.len(),
            ..Junction::default()
        };
        let map = RoadMap {
            name: document.name.clone(),
            junctions: document.junctions.iter().map(empty).collect(),
            warnings: document.warnings.clone(),
            warned_at: document.warned_at.clone(),
            ..RoadMap::default()
        };
        let (junctions, lanes) = (junctions.collect(), BTreeMap::new());
        Ok(Builder { document, map, roads, junctions, lanes, spent: Spent::default() })
    }

    pub fn warn(&mut self, line: u32, message: impl AsRef<str>) {
        self.map.warnings.push(format!("line {line}: {}", message.as_ref()));
    }

    pub fn warn_at(&mut self, line: u32, position: Vec2, message: impl AsRef<str>) {
        self.map.warned_at.push((self.map.warnings.len(), position));
        self.warn(line, message);
    }

    pub fn lane_index(&self, road: usize, section: usize, lane: i32) -> Option<LaneIndex> {
        self.lanes.get(&(road, section, lane)).copied()
    }

    fn add_lanes(&mut self) -> Result<(), RoadError> {
        let document = self.document;
        // Lanes without a limit: motorways that have none, others that have none, and lanes of which none is stated.
        let (mut free, mut without, mut limitless) = (0, 0, 0);
        let mut tight: Vec<String> = Vec::new();
        // Lanes and vertices inside each junction.
        let mut inside = vec![(0, 0); document.junctions.len()];
        for (road_index, road) in document.roads.iter().enumerate() {
            let junction = road.junction.as_ref().and_then(|id| self.junctions.get(id.as_str()).copied());
            if let (Some(id), None) = (&road.junction, junction) {
                let message = format!(
                    "road `{}` lies in junction `{id}`, which does not exist: it is taken for one outside junctions",
                    road.id
                );
                self.warn(road.line, message);
            }
            for (section_index, section) in road.sections.iter().enumerate() {
                for element in &section.lanes {
                    let left_out = (road.id.clone(), element.id);
                    if let Some(undriven) = &element.undriven {
                        self.map.left_out.entry(left_out).or_insert_with(|| undriven.clone());
                        continue;
                    }
                    let undrivable = |what: &str| LeftOut { what: what.to_owned(), for_vehicles: true };
                    let at = format!("lane {} of road `{}` at s {}", element.id, road.id, section.begin_m);
                    let centre = match self.spent.centre_line(self.document, road, section, element.id)? {
                        Ok(centre) => centre,
                        Err(NoCentreLine::Short) => {
                            self.map.left_out.insert(left_out, undrivable("without length"));
                            self.warn(element.line, format!("left out {at}: it has no length"));
                            continue;
                        }
                        // The corner has its own warning.
                        Err(NoCentreLine::Broken) => continue,
                        Err(reason) => {
                            self.map.left_out.insert(left_out, undrivable("one that cannot be drawn"));
                            let begin = road.reference.at(section.begin_m).position;
                            self.warn_at(element.line, begin, format!("left out {at}: {reason}"));
                            continue;
                        }
                    };
                    if junction.is_some() && is_tight(&centre.path) {
                        let turn = undrivable("a turn that no car can drive in one go");
                        self.map.left_out.insert(left_out, turn);
                        tight.push(at);
                        continue;
                    }
                    if let Some(unfolded) = centre.unfolded {
                        let message = format!(
                            "{at} runs backwards in a bend: it is cut short there, by up to {:.2} m",
                            unfolded.off_m
                        );
                        self.warn_at(element.line, unfolded.position, message);
                    }
                    if let Some(junction) = junction {
                        let (lanes, vertices) = &mut inside[junction];
                        (*lanes, *vertices) = (*lanes + 1, *vertices + centre.path.points().len());
                        if *lanes > JUNCTION_LANES_MAX || *vertices > JUNCTION_VERTICES_MAX {
                            return Err(crowded(&document.junctions[junction]));
                        }
                    }
                    let (limit_mps, kind) = match element.holds.limit {
                        Limit::Of(limit_mps) => (limit_mps, None),
                        Limit::No if element.holds.is_motorway => (ADVISED_MPS, Some(&mut free)),
                        Limit::No => (LIMIT_MPS_DEFAULT, Some(&mut without)),
                        Limit::Unstated => (LIMIT_MPS_DEFAULT, Some(&mut limitless)),
                    };
                    let states_limit = kind.is_none();
                    kind.into_iter().for_each(|count: &mut usize| *count += 1);
                    let key = LaneKey { road: road.id.clone(), section: section_index, lane: element.id };
                    let index = LaneIndex(self.map.lanes.len());
                    self.lanes.insert((road_index, section_index, element.id), index);
                    let mut lane = new_lane(key, centre, limit_mps, road.left_hand, junction);
                    lane.states_limit = states_limit;
                    lane.is_motorway = element.holds.is_motorway;
                    lane.for_buses = element.holds.for_buses;
                    lane.heights = Heights::sampled(lane.centre.length_m(), |station_m| {
                        road.elevation.at(lane.road_station_m(station_m)).value
                    });
                    self.map.lanes.push(lane);
                }
            }
        }
        if self.map.lanes.is_empty() {
            let left_out = self.map.warnings.iter().find(|warning| warning.contains("left out"));
            let reason = left_out.map_or(String::new(), |warning| format!(" that can be driven; {warning}"));
            return Err(wrong(1, format!("the map has no lane of type `driving`{reason}")));
        }
        if let Some(first) = tight.first() {
            let (number, message) = (tight.len(), "so tight that no car can drive it in one go");
            self.map
                .warnings
                .push(format!("left out {number} lanes that turn round {message}; the first is {first}"));
        }
        for (count, words) in [
            (limitless, "lanes state no speed limit; 50 km/h is taken"),
            (without, "lanes off motorways state that they have no speed limit; 50 km/h is taken"),
            (
                free,
                "lanes of motorways state that they have no speed limit; 130 km/h is taken, which Germany advises",
            ),
        ] {
            self.map.warnings.extend((count > 0).then(|| format!("{count} {words}")));
        }
        Ok(())
    }

    /// Adds what lies beside the driving lanes. A strip that cannot be drawn is left out: it only helps to find
    /// the kerb.
    fn add_strips(&mut self) -> Result<(), RoadError> {
        for road in &self.document.roads {
            for (index, section) in road.sections.iter().enumerate() {
                for element in &section.lanes {
                    let Some(kind) = element.beside else { continue };
                    let found = self.spent.centre_line(self.document, road, section, element.id)?;
                    let Ok(CentreLine { path, widths_m, road_stations_m, .. }) = found else { continue };
                    let key = LaneKey { road: road.id.clone(), section: index, lane: element.id };
                    let bounds = path.bounds();
                    self.map.strips.push(Strip {
                        kind,
                        key,
                        road_stations_m,
                        centre: path,
                        widths_m,
                        bounds,
                    });
                }
            }
        }
        Ok(())
    }

    fn link_sections(&mut self) {
        for (road_index, road) in self.document.roads.iter().enumerate() {
            for (section, pair) in road.sections.windows(2).enumerate() {
                let here = |lane| End { road: road_index, section, lane, contact: Contact::End };
                let there =
                    |lane| End { road: road_index, section: section + 1, lane, contact: Contact::Start };
                for lane in &pair[0].lanes {
                    for next in &lane.successors {
                        self.link(here(lane.id), there(*next), lane.line);
                    }
                }
                for lane in &pair[1].lanes {
                    for previous in &lane.predecessors {
                        self.link(here(*previous), there(lane.id), lane.line);
                    }
                }
            }
        }
    }

    fn link_roads(&mut self) {
        for (road_index, road) in self.document.roads.iter().enumerate() {
            for (contact, link) in [(Contact::Start, &road.predecessor), (Contact::End, &road.successor)] {
                let (id, other_contact, line) = match link {
                    None => continue,
                    Some(RoadLink::Junction { id, line }) => {
                        if !self.junctions.contains_key(id.as_str()) {
                            self.warn_broken_link(road, &format!("junction `{id}`"), *line);
                        }
                        continue;
                    }
                    Some(RoadLink::Road { id, contact, line }) => (id, *contact, *line),
                };
                let Some(other) = self.roads.get(id.as_str()).copied() else {
                    self.warn_broken_link(road, &format!("road `{id}`"), line);
                    continue;
                };
                let section = end_section(road, contact);
                for lane in &road.sections[section].lanes {
                    let linked = match contact {
                        Contact::Start => &lane.predecessors,
                        Contact::End => &lane.successors,
                    };
                    for other_lane in linked {
                        let here = End { road: road_index, section, lane: lane.id, contact };
                        self.link(here, self.end(other, *other_lane, other_contact), lane.line);
                    }
                }
            }
        }
    }

    /// Warns of roads that lead into each other while none of their lanes does.
    fn warn_of_unlinked_roads(&mut self) {
        let document = self.document;
        for (road_index, road) in document.roads.iter().enumerate() {
            for (contact, link) in [(Contact::Start, &road.predecessor), (Contact::End, &road.successor)] {
                let Some(RoadLink::Road { id, contact: other_contact, line }) = link else { continue };
                let Some(other) = self.roads.get(id.as_str()).copied() else { continue };
                let goes_on = |(lane, leaves): &(LaneIndex, bool)| {
                    let lane = self.map.lane(*lane);
                    !(if *leaves { &lane.successors } else { &lane.predecessors }).is_empty()
                };
                let (here, there) =
                    (self.driven_at(road_index, contact), self.driven_at(other, *other_contact));
                // Lanes that come to the end need some that go on from there.
                let could = here.iter().any(|(_, leaves)| there.iter().any(|(_, other)| other != leaves));
                if could && !here.iter().any(goes_on) {
                    let message = format!(
                        "road `{}` leads to road `{id}`, but no lane says to which lane: nobody drives on there",
                        road.id
                    );
                    self.map.warnings.push(format!("line {line}: {message}"));
                }
            }
        }
    }

    /// The driving lanes at an end of a road, and whether their traffic leaves the road there.
    fn driven_at(&self, road_index: usize, contact: Contact) -> Vec<(LaneIndex, bool)> {
        let road = &self.document.roads[road_index];
        let section = end_section(road, contact);
        let driven = road.sections[section].lanes.iter().filter_map(|lane| {
            let leaves = road.runs_along(lane.id) == (contact == Contact::End);
            Some((self.lane_index(road_index, section, lane.id)?, leaves))
        });
        driven.collect()
    }

    fn warn_broken_link(&mut self, road: &RoadElement, missing: &str, line: u32) {
        let message =
            format!("road `{}` leads to {missing}, which does not exist: the link is left out", road.id);
        self.warn(line, message);
    }

    fn link_junctions(&mut self) {
        for junction in &self.document.junctions {
            for connection in &junction.connections {
                let ends = [&connection.incoming_road, &connection.connecting_road];
                let [Some(incoming), Some(connecting)] = ends.map(|id| self.roads.get(id.as_str()).copied())
                else {
                    let missing = ends.into_iter().find(|id| !self.roads.contains_key(id.as_str()));
                    let message = format!(
                        "junction `{}` connects road `{}`, which does not exist: ignored the connection",
                        junction.id,
                        missing.map_or("", String::as_str)
                    );
                    self.warn(connection.line, message);
                    continue;
                };
                if connection.lane_links.is_empty() {
                    let message = format!("a connection of junction `{}` links no lanes", junction.id);
                    self.warn(connection.line, message);
                }
                let contact = self.contact_at(incoming, &junction.id, connecting, connection.contact);
                for (from, to) in &connection.lane_links {
                    let from = self.end(incoming, *from, contact);
                    let to = self.end(connecting, *to, connection.contact);
                    self.link(from, to, connection.line);
                }
            }
        }
    }

    /// The end of a road that touches a junction; if both ends do, the one nearer to the connecting road.
    fn contact_at(&self, incoming: usize, junction: &str, connecting: usize, contact: Contact) -> Contact {
        let road = &self.document.roads[incoming];
        let touches =
            |link: &Option<RoadLink>| matches!(link, Some(RoadLink::Junction { id, .. }) if id == junction);
        match (touches(&road.predecessor), touches(&road.successor)) {
            (true, false) => return Contact::Start,
            (false, true) => return Contact::End,
            _ => {}
        }
        let at = |road: &RoadElement, contact: Contact| {
            road.reference.at(if contact == Contact::Start { 0.0 } else { road.length_m }).position
        };
        let meeting = at(&self.document.roads[connecting], contact);
        let distance = |contact| (at(road, contact) - meeting).norm();
        if distance(Contact::Start) < distance(Contact::End) { Contact::Start } else { Contact::End }
    }

    fn end(&self, road: usize, lane: i32, contact: Contact) -> End {
        End { road, section: end_section(&self.document.roads[road], contact), lane, contact }
    }

    /// Joins two lane ends that meet. The direction of traffic decides which lane leads into the other.
    fn link(&mut self, a: End, b: End, line: u32) {
        let roads = &self.document.roads;
        for end in [a, b] {
            let road = &roads[end.road];
            if end.lane != 0 && road.sections[end.section].lane(end.lane).is_none() {
                let message = format!(
                    "ignored a link to lane {} of road `{}`, which does not exist",
                    end.lane, road.id
                );
                self.warn(line, message);
                return;
            }
        }
        let lane = |end: End| self.lane_index(end.road, end.section, end.lane);
        let (Some(index_a), Some(index_b)) = (lane(a), lane(b)) else {
            // One of the two is not a driving lane: a parking or a turning bay begins or ends here.
            return;
        };
        let leaves = |end: End| roads[end.road].runs_along(end.lane) == (end.contact == Contact::End);
        let (from, to) = match (leaves(a), leaves(b)) {
            (true, false) => (index_a, index_b),
            (false, true) => (index_b, index_a),
            _ => {
                let message = format!(
                    "ignored a link between lane {} of road `{}` and lane {} of road `{}`: their traffic meets head on",
                    a.lane, roads[a.road].id, b.lane, roads[b.road].id
                );
                self.warn(line, message);
                return;
            }
        };
        // A thousand lanes may lead into one, so the shorter of the two lists is searched.
        let (ahead, behind) = (&self.map.lanes[from.0].successors, &self.map.lanes[to.0].predecessors);
        let is_known = if ahead.len() < behind.len() { ahead.contains(&to) } else { behind.contains(&from) };
        if !is_known {
            self.map.lanes[from.0].successors.push(to);
            self.map.lanes[to.0].predecessors.push(from);
        }
    }

    /// Removes the links between lanes that meet at a corner which nothing on wheels can follow.
    fn unlink_corners(&mut self) {
        let mut unlinked: BTreeSet<(LaneIndex, LaneIndex)> = BTreeSet::new();
        for index in 0..self.map.lanes.len() {
            let lane = &self.map.lanes[index];
            let end = lane.centre.pose_at(lane.centre.length_m());
            let turn_rad = |next: &LaneIndex| {
                wrap_angle(self.map.lane(*next).centre.pose_at(0.0).heading_rad - end.heading_rad).abs()
            };
            let sharp = lane.successors.iter().map(|next| (*next, turn_rad(next)));
            let sharp: Vec<_> = sharp.filter(|(_, turn_rad)| *turn_rad > LINK_RAD_MAX).collect();
            for (next, turn_rad) in sharp {
                let (from, to) = (&self.map.lanes[index].key, &self.map.lane(next).key);
                let message = format!(
                    "lane {} of road `{}` meets lane {} of road `{}` at an angle of {:.0} degrees: the link is left out",
                    from.lane,
                    from.road,
                    to.lane,
                    to.road,
                    turn_rad.to_degrees()
                );
                self.map.warned_at.push((self.map.warnings.len(), end.position));
                self.map.warnings.push(message);
                unlinked.insert((LaneIndex(index), next));
            }
        }
        if unlinked.is_empty() {
            return;
        }
        for (index, lane) in self.map.lanes.iter_mut().enumerate() {
            let here = LaneIndex(index);
            lane.successors.retain(|next| !unlinked.contains(&(here, *next)));
            lane.predecessors.retain(|before| !unlinked.contains(&(*before, here)));
        }
    }

    fn set_neighbours(&mut self) {
        for (road_index, road) in self.document.roads.iter().enumerate() {
            for (section_index, section) in road.sections.iter().enumerate() {
                // From left to right along the reference line.
                let lanes: Vec<(i32, LaneIndex)> = section
                    .lanes
                    .iter()
                    .filter_map(|lane| Some((lane.id, self.lane_index(road_index, section_index, lane.id)?)))
                    .collect();
                for pair in lanes.windows(2) {
                    let ((left, left_index), (right, right_index)) = (pair[0], pair[1]);
                    let same_direction = road.runs_along(left) == road.runs_along(right);
                    let gap_m = gap_m(road, section, left, right);
                    let neighbour = |lane| Some(Neighbour { lane, same_direction, gap_m });
                    let lane = &mut self.map.lanes[left_index.0];
                    let beside = if road.runs_along(left) { &mut lane.right } else { &mut lane.left };
                    *beside = neighbour(right_index);
                    let lane = &mut self.map.lanes[right_index.0];
                    let beside = if road.runs_along(right) { &mut lane.left } else { &mut lane.right };
                    *beside = neighbour(left_index);
                    if same_direction && road.junction.is_none() {
                        let [to_right, to_left] = permitted(road, section, left, right);
                        self.allow_changes(left_index, right_index, &to_right);
                        self.allow_changes(right_index, left_index, &to_left);
                    }
                }
            }
        }
    }

    /// Permits changes from a lane to its neighbour between stations of the road's reference line.
    fn allow_changes(&mut self, from: LaneIndex, to: LaneIndex, parts_m: &[(f64, f64)]) {
        let lane = &mut self.map.lanes[from.0];
        let stations_m = |(a_m, b_m): &(f64, f64)| {
            let (a_m, b_m) = (lane.station_of(*a_m), lane.station_of(*b_m));
            (a_m.min(b_m), a_m.max(b_m))
        };
        let mut parts_m: Vec<(f64, f64)> = parts_m.iter().map(stations_m).collect();
        parts_m.sort_by(|a, b| a.0.total_cmp(&b.0));
        if lane.left.is_some_and(|left| left.lane == to) {
            lane.changes_left_m = parts_m;
        } else {
            lane.changes_right_m = parts_m;
        }
    }
}

/// An end of a lane.
#[derive(Clone, Copy)]
struct End {
    road: usize,
    section: usize,
    lane: i32,
    contact: Contact,
}

/// Warns of linked lanes whose ends do not meet.
fn loose_links(map: &RoadMap) -> Option<String> {
    let links =
        map.lanes.iter().flat_map(|lane| lane.successors.iter().map(move |next| (lane, map.lane(*next))));
    let loose = links.filter_map(|(lane, next)| Some((lane.leap_m(next)?, lane, next)));
    let loose: Vec<_> = loose.collect();
    let (apart_m, lane, next) = loose.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let name = |lane: &Lane| format!("lane {} of road `{}`", lane.key.lane, lane.key.road);
    Some(format!(
        "{} links join lanes that do not meet; the worst, from {} to {}, leaps {apart_m:.2} m",
        loose.len(),
        name(lane),
        name(next)
    ))
}

fn end_section(road: &RoadElement, contact: Contact) -> usize {
    match contact {
        Contact::Start => 0,
        Contact::End => road.sections.len() - 1,
    }
}

fn new_lane(
    key: LaneKey,
    centre: CentreLine,
    speed_limit_mps: f64,
    keeps_left: bool,
    junction: Option<usize>,
) -> Lane {
    Lane {
        key,
        turn: if junction.is_some() { turn(&centre.path) } else { Turn::Straight },
        centre: centre.path,
        widths_m: centre.widths_m,
        speed_limit_mps,
        states_limit: true,
        is_motorway: false,
        for_buses: false,
        keeps_left,
        successors: Vec::new(),
        predecessors: Vec::new(),
        left: None,
        right: None,
        changes_left_m: Vec::new(),
        changes_right_m: Vec::new(),
        junction,
        stop_lines: Vec::new(),
        sign_lines: Vec::new(),
        precedence: Precedence::Equal,
        heights: Heights::default(),
        road_stations_m: centre.road_stations_m,
    }
}

fn is_tight(path: &Path) -> bool {
    let change_rad = change_rad(path).abs();
    change_rad > TIGHT_RAD_MIN && path.length_m() < change_rad * TIGHT_M_MIN
}

/// The sum of a path's changes of heading, rad.
fn change_rad(path: &Path) -> f64 {
    path.points().windows(2).map(|pair| wrap_angle(pair[1].heading_rad - pair[0].heading_rad)).sum()
}

fn turn(path: &Path) -> Turn {
    let change_rad = change_rad(path);
    match change_rad {
        _ if change_rad.abs() < STRAIGHT_RAD_MAX => Turn::Straight,
        _ if change_rad.abs() > U_TURN_RAD_MIN => Turn::UTurn,
        _ if change_rad > 0.0 => Turn::Left,
        _ => Turn::Right,
    }
}

/// The error for a junction with more lanes than can be compared with each other.
fn crowded(junction: &JunctionElement) -> RoadError {
    let message = format!(
        "junction `{}` is too large: more than {JUNCTION_LANES_MAX} lanes, or {JUNCTION_VERTICES_MAX} m of curved ones, \
         lie inside; make several junctions of it",
        junction.id
    );
    wrong(junction.line, message)
}

/// Width of the gap between two lanes, measured in the middle of a section, m.
fn gap_m(road: &RoadElement, section: &SectionElement, left: i32, right: i32) -> f64 {
    let middle_m = (section.begin_m + section.end_m) / 2.0;
    let (left_centre, left_width) = road.across(section, left).at(middle_m);
    let (right_centre, right_width) = road.across(section, right).at(middle_m);
    let pitch_m = left_centre.value - right_centre.value;
    let gap_m = pitch_m - (left_width.value + right_width.value) / 2.0;
    // Rounding leaves tiny gaps between lanes that share a line.
    if gap_m > 1e-6 { gap_m } else { 0.0 }
}
