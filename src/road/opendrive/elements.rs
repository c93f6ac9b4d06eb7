//! The elements of an OpenDRIVE file that are read, in OpenDRIVE's own terms.

use crate::{LeftOut, SignKind, StripKind};
use avastra_base::geometry::Vec2;

use super::cubic::{Cubics, Jet};
use super::geometry::ReferenceLine;

/// A whole file.
#[derive(Debug, Clone)]
pub struct Document {
    pub name: String,
    pub roads: Vec<RoadElement>,
    pub junctions: Vec<JunctionElement>,
    pub controllers: Vec<ControllerElement>,
    pub warnings: Vec<String>,
    /// The places in the plane that warnings are about: index of the warning, position.
    pub warned_at: Vec<(usize, Vec2)>,
}

#[derive(Debug, Clone)]
pub struct RoadElement {
    pub id: String,
    pub line: u32,
    pub length_m: f64,
    /// Id of the junction the road lies in.
    pub junction: Option<String>,
    /// Whether traffic keeps left: lanes with positive ids then run along the reference line.
    pub left_hand: bool,
    pub predecessor: Option<RoadLink>,
    pub successor: Option<RoadLink>,
    pub reference: ReferenceLine,
    /// Height of the reference line, m. Banks and crossfalls are not read.
    pub elevation: Cubics,
    pub lane_offset: Cubics,
    pub sections: Vec<SectionElement>,
    pub signals: Vec<SignalElement>,
    pub objects: Vec<ObjectElement>,
}

/// The element that a road's beginning or end touches.
#[derive(Debug, Clone, PartialEq)]
pub enum RoadLink {
    Road { id: String, contact: Contact, line: u32 },
    Junction { id: String, line: u32 },
}

/// An end of a road.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    Start,
    End,
}

/// The speed limit that a record states, if it states one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// m/s.
    Of(f64),
    /// There is none.
    No,
    Unstated,
}

/// A kind of road, from a station on.
#[derive(Debug, Clone, Copy)]
pub struct TypeElement {
    pub begin_m: f64,
    pub limit: Limit,
    pub is_motorway: bool,
}

/// A lane section, or a piece of one (`cut`).
#[derive(Debug, Clone)]
pub struct SectionElement {
    pub begin_m: f64,
    pub end_m: f64,
    /// By falling id: from left to right. The centre lane (id 0) is left out.
    pub lanes: Vec<LaneElement>,
}

/// The rules of a lane: its limit, whether its road is a motorway, and whether it is for buses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holds {
    pub limit: Limit,
    pub is_motorway: bool,
    pub for_buses: bool,
}

impl Holds {
    /// Nothing is known yet.
    pub const UNKNOWN: Holds = Holds { limit: Limit::Unstated, is_motorway: false, for_buses: false };
}

#[derive(Debug, Clone)]
pub struct LaneElement {
    pub id: i32,
    pub line: u32,
    /// Why no car drives on it, in one direction; `None` for a driving lane.
    pub undriven: Option<LeftOut>,
    /// The rules of the lane; unknown until `cut` has found them.
    pub holds: Holds,
    /// The lane's kind for people on foot. `None` for a driving lane, and for one along which they do not walk.
    pub beside: Option<StripKind>,
    /// Width over the distance from the section's begin.
    pub widths: Cubics,
    pub borders: Cubics,
    pub predecessors: Vec<i32>,
    pub successors: Vec<i32>,
    /// The lane's own limits, each from a distance on from the section's beginning, m, by rising distance.
    pub speeds: Vec<(f64, Limit)>,
    /// In the same way, whether it is for buses.
    pub buses: Vec<(f64, bool)>,
    /// Markings of its outer line, by rising beginning.
    pub marks: Vec<MarkElement>,
}

/// A marking between two lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkElement {
    /// From the section's beginning, m.
    pub begin_m: f64,
    pub rule: MarkRule,
}

/// The direction in which a vehicle may cross a marking, by the order of the lane ids.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkRule {
    Both,
    Neither,
    /// Only into the lane with the greater id.
    Increase,
    Decrease,
}

#[derive(Debug, Clone)]
pub struct SignalElement {
    pub id: String,
    pub line: u32,
    pub s_m: f64,
    pub t_m: f64,
    /// The light itself, or a further place for the light with this id.
    pub reference: bool,
    pub meaning: Meaning,
    pub orientation: Orientation,
    /// Inclusive ranges of lane ids; empty means all.
    pub validity: Vec<(i32, i32)>,
}

/// The kind of a signal, and the traffic that it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meaning {
    /// A light for vehicles. A reference counts as one until its light or sign is found.
    Light,
    /// A light for pedestrians, cyclists or trams.
    OtherLight,
    Sign(SignKind),
}

/// The traffic that a signal holds for, by its direction along the reference line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    Along,
    Against,
    Both,
}

/// A crosswalk, or a thing that stands beside the road.
#[derive(Debug, Clone)]
pub struct ObjectElement {
    pub id: String,
    /// The file's word for what it is.
    pub word: String,
    pub kind: ObjectKind,
    /// Whether it stands on the ground, and so in the way of whatever drives there.
    pub is_on_the_ground: bool,
    pub s_m: f64,
    pub t_m: f64,
    pub heading_rad: f64,
    pub outline: Outline,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObjectKind {
    Crosswalk,
    /// Something solid, such as a building, a wall or a tree: nobody walks through it.
    Solid,
}

#[derive(Debug, Clone)]
pub enum Outline {
    /// Corners in the object's own frame: ahead, left, m.
    Local(Vec<(f64, f64)>),
    /// Corners along the road: station, left of the reference line, m.
    Road(Vec<(f64, f64)>),
}

#[derive(Debug, Clone)]
pub struct JunctionElement {
    pub id: String,
    pub line: u32,
    pub name: String,
    pub connections: Vec<ConnectionElement>,
    /// Pairs of roads, incoming or connecting ones: traffic of the first goes before traffic of the second.
    pub priorities: Vec<(String, String)>,
    /// Ids of its controllers, in order, with their lines.
    pub controllers: Vec<(String, u32)>,
}

#[derive(Debug, Clone)]
pub struct ConnectionElement {
    pub line: u32,
    pub incoming_road: String,
    pub connecting_road: String,
    pub contact: Contact,
    /// From lane (incoming road), to lane (connecting road).
    pub lane_links: Vec<(i32, i32)>,
}

#[derive(Debug, Clone)]
pub struct ControllerElement {
    pub id: String,
    /// Ids of the signals it switches, with their lines.
    pub signals: Vec<(String, u32)>,
}

impl LaneElement {
    /// The part between two distances from the section's beginning, m.
    pub fn between(&self, from_m: f64, to_m: f64) -> LaneElement {
        let marks = self.marks.iter().filter(|mark| mark.begin_m < to_m);
        let marks = marks.map(|mark| MarkElement { begin_m: mark.begin_m - from_m, ..*mark });
        // The last mark that has begun holds.
        let mut marks: Vec<MarkElement> = marks.collect();
        let begun = marks.partition_point(|mark| mark.begin_m <= 0.0);
        marks.drain(..begun.max(1) - 1);
        LaneElement {
            id: self.id,
            line: self.line,
            undriven: self.undriven.clone(),
            holds: self.holds,
            beside: self.beside,
            widths: self.widths.between(from_m, to_m),
            borders: self.borders.between(from_m, to_m),
            predecessors: self.predecessors.clone(),
            successors: self.successors.clone(),
            speeds: Vec::new(),
            buses: Vec::new(),
            marks,
        }
    }
}

impl SignalElement {
    /// Whether its validity names a lane.
    pub fn names(&self, lane: i32) -> bool {
        self.validity.iter().any(|(from, to)| (*from..=*to).contains(&lane))
    }
}

impl RoadElement {
    /// Index of the section that holds a station.
    pub fn section_at(&self, s_m: f64) -> usize {
        self.sections.partition_point(|section| section.begin_m <= s_m).max(1) - 1
    }

    /// Whether traffic on a lane runs in the direction of the reference line.
    pub fn runs_along(&self, lane: i32) -> bool {
        (lane < 0) != self.left_hand
    }

    /// The widths and offsets that decide where a lane of a section lies.
    pub fn across<'a>(&'a self, section: &'a SectionElement, lane: i32) -> Across<'a> {
        let side = lane.signum();
        let lanes = (1..=lane.abs()).map(|id| section.lane(id * side)).collect();
        Across { lane_offset: &self.lane_offset, begin_m: section.begin_m, side: f64::from(side), lanes }
    }
}

/// A lane of a section with those between it and the reference line.
pub struct Across<'a> {
    lane_offset: &'a Cubics,
    begin_m: f64,
    side: f64,
    /// From the inside out; `None` where the file leaves a number out.
    lanes: Vec<Option<&'a LaneElement>>,
}

impl Across<'_> {
    /// Number of lanes from the reference line to this one, which is counted, too.
    pub fn lane_count(&self) -> usize {
        self.lanes.len()
    }

    /// Whether the lane has one width along its section, and those between it and the reference line, too.
    pub fn is_constant(&self) -> bool {
        let is_constant = |lane: &&LaneElement| lane.widths.is_constant() && lane.borders.is_constant();
        self.lanes.iter().flatten().all(is_constant)
    }

    /// Centre (m left of the reference line) and width at a station.
    pub fn at(&self, s_m: f64) -> (Jet, Jet) {
        let zero = self.lane_offset.at(s_m);
        let distance_m = s_m - self.begin_m;
        let mut inner = zero;
        let mut outer = zero;
        for lane in &self.lanes {
            inner = outer;
            let Some(element) = lane else { continue };
            outer = if element.widths.is_empty() && !element.borders.is_empty() {
                zero + element.borders.at(distance_m)
            } else {
                inner + element.widths.at(distance_m) * self.side
            };
        }
        ((inner + outer) * 0.5, (outer - inner) * self.side)
    }
}

impl SectionElement {
    pub fn lane(&self, id: i32) -> Option<&LaneElement> {
        let found = self.lanes.binary_search_by(|lane| id.cmp(&lane.id));
        found.ok().map(|index| &self.lanes[index])
    }
}
