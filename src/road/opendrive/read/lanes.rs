//! Reads lane sections and their lanes.

use crate::{LeftOut, RoadError, StripKind};

use super::super::elements::{Holds, LaneElement, MarkElement, MarkRule, SectionElement};
use super::super::xml::{Element, wrong};
use super::{Reader, cubics};

/// Limit on the lanes of one side of a road.
const LANES_MAX: u32 = 100;

impl Reader {
    pub(super) fn sections(
        &mut self,
        lanes: Element,
        id: &str,
        length_m: f64,
    ) -> Result<Vec<SectionElement>, RoadError> {
        let mut sections: Vec<SectionElement> = Vec::new();
        for section in lanes.children("laneSection") {
            let begin_m = section.number("s")?;
            if section.attribute("singleSide") == Some("true") {
                let message =
                    "lane sections of a single side are not read; give both sides the same sections";
                return Err(section.wrong(message));
            }
            if begin_m < 0.0 || begin_m > length_m {
                let message = format!("a lane section begins at {begin_m} m, beyond the ends of road `{id}`");
                return Err(section.wrong(message));
            }
            if sections.last().is_some_and(|last| begin_m <= last.begin_m) {
                return Err(section.wrong(format!("lane sections of road `{id}` must stand by rising `s`")));
            }
            let mut all = Vec::new();
            for side in section.elements().filter(|side| matches!(side.name(), "left" | "right")) {
                for lane in side.children("lane") {
                    all.push(self.lane(lane)?);
                }
            }
            all.sort_by_key(|lane| -lane.id);
            if let Some(pair) = all.windows(2).find(|pair| pair[0].id == pair[1].id) {
                let message = format!("lane {} stands twice in a section of road `{id}`", pair[1].id);
                return Err(wrong(pair[1].line, message));
            }
            if let Some(last) = sections.last_mut() {
                last.end_m = begin_m;
            }
            sections.push(SectionElement { begin_m, end_m: length_m, lanes: all });
        }
        if sections.is_empty() {
            return Err(lanes.wrong(format!("road `{id}` has no `laneSection`")));
        }
        Ok(sections)
    }

    fn lane(&mut self, lane: Element) -> Result<LaneElement, RoadError> {
        let id = lane.integer("id")?;
        if id == 0 || id.unsigned_abs() > LANES_MAX {
            return Err(lane.wrong(format!("a lane beside the reference line cannot have the id {id}")));
        }
        let linked = |name: &str| -> Result<Vec<i32>, RoadError> {
            let links = lane.child("link").into_iter().flat_map(|link| link.children(name));
            links.map(|link| link.integer("id")).collect()
        };
        let mut speeds = Vec::new();
        for speed in lane.children("speed") {
            speeds.push((speed.number_or("sOffset", 0.0)?, self.speed(speed)?));
        }
        speeds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let kind = lane.attribute("type").unwrap_or("none");
        let (is_driving, for_vehicles, on_foot) = lane_type(kind);
        let undriven = match lane.attribute("direction") {
            _ if !is_driving => Some(format!("of type `{kind}`")),
            Some(direction @ ("reversed" | "both")) => Some(format!("of direction `{direction}`")),
            _ => None,
        };
        let undriven = undriven.map(|what| LeftOut { what, for_vehicles });
        // Lanes beside those for driving, as for parking, cycles or walking, are left out without a warning.
        if let Some(LeftOut { what, for_vehicles: true }) = &undriven {
            self.ignore(format!("lanes {what}"));
        }
        let beside = on_foot.filter(|_| undriven.is_some());
        let widths = cubics(lane.children("width"), "sOffset")?;
        let borders = cubics(lane.children("border"), "sOffset")?;
        if undriven.is_none() && widths.is_empty() && borders.is_empty() {
            return Err(lane.wrong(format!("lane {id} has neither `width` nor `border`")));
        }
        let marks = lane.children("roadMark");
        let mut marks: Vec<MarkElement> = marks.map(|mark| road_mark(mark, id)).collect::<Result<_, _>>()?;
        marks.sort_by(|a, b| a.begin_m.total_cmp(&b.begin_m));
        let mut buses = self.kept_for_buses(lane)?;
        if kind == "bus" {
            buses = vec![(0.0, true)];
        }
        Ok(LaneElement {
            id,
            line: lane.line(),
            undriven,
            holds: Holds::UNKNOWN,
            buses,
            beside,
            widths,
            borders,
            predecessors: linked("predecessor")?,
            successors: linked("successor")?,
            speeds,
            marks,
        })
    }
}

impl Reader {
    /// From which distances on `access` keeps cars out of a lane and lets buses in, or no longer does, m. The records of one
    /// distance belong together, and hold until the next.
    fn kept_for_buses(&mut self, lane: Element) -> Result<Vec<(f64, bool)>, RoadError> {
        let mut records = Vec::new();
        for access in lane.children("access") {
            records.push((access.number_or("sOffset", 0.0)?, access));
        }
        records.sort_by(|a, b| a.0.total_cmp(&b.0));
        let groups = records.chunk_by(|a, b| a.0 == b.0);
        Ok(groups.map(|group| (group[0].0, self.is_kept_for_buses(group))).collect())
    }

    fn is_kept_for_buses(&mut self, records: &[(f64, Element)]) -> bool {
        let (mut for_buses, mut for_cars, mut without_cars, mut for_others) = (false, false, false, false);
        for (_, access) in records {
            // Without a rule, as before OpenDRIVE 1.6, a restriction says who alone may use the lane.
            let allows = access.attribute("rule") != Some("deny");
            let named = access.children("restriction").filter_map(|one| one.attribute("type"));
            for who in access.attribute("restriction").into_iter().chain(named) {
                match (allows, who) {
                    (true, "bus") => for_buses = true,
                    (
                        true,
                        "none" | "passengerCar" | "throughTraffic" | "autonomousTraffic"
                        | "autonomous traffic",
                    ) => {
                        for_cars = true;
                    }
                    (true, _) => for_others = true,
                    (false, "passengerCar") => without_cars = true,
                    (false, _) => {}
                }
            }
        }
        let kept = for_buses && !for_cars || without_cars;
        if for_others && !kept && !for_cars {
            self.ignore("rules of access to lanes for others than buses".to_owned());
        }
        kept
    }
}

/// The use of a type of lane: whether vehicles drive on it in one direction, whether some kinds of vehicle may, and its
/// kind for people on foot where no car drives on it. The last is `None` for verges and medians, on which people may
/// stand but along which they do not walk.
fn lane_type(kind: &str) -> (bool, bool, Option<StripKind>) {
    match kind {
        "driving" | "entry" | "exit" | "onRamp" | "offRamp" | "connectingRamp" | "slipLane" | "mwyEntry"
        | "mwyExit" | "bus" => (true, true, Some(StripKind::Paved)),
        "taxi" | "HOV" | "bidirectional" => (false, true, Some(StripKind::Paved)),
        "parking" | "stop" | "biking" | "tram" | "rail" => (false, false, Some(StripKind::Paved)),
        "sidewalk" | "walking" => (false, false, Some(StripKind::Walkway)),
        "none" | "shoulder" | "border" | "curb" | "median" | "roadWorks" | "roadMarks" => {
            (false, false, None)
        }
        _ => (false, true, None),
    }
}

/// A marking at the outer line of a lane. `laneChange` decides; without it, the paint does: a solid line and
/// anything raised forbid a change, and a broken line beside a solid one permits a change from the broken side.
fn road_mark(mark: Element, lane: i32) -> Result<MarkElement, RoadError> {
    // A double line names the inner line first, the one nearer to the reference line.
    let (outwards, inwards) = match lane < 0 {
        true => (MarkRule::Decrease, MarkRule::Increase),
        false => (MarkRule::Increase, MarkRule::Decrease),
    };
    let rule = match (mark.attribute("laneChange"), mark.attribute("type").unwrap_or("none")) {
        (Some("both"), _) => MarkRule::Both,
        (Some("none"), _) => MarkRule::Neither,
        (Some("increase"), _) => MarkRule::Increase,
        (Some("decrease"), _) => MarkRule::Decrease,
        (_, "solid" | "solid solid" | "curb" | "edge" | "grass") => MarkRule::Neither,
        (_, "solid broken") => inwards,
        (_, "broken solid") => outwards,
        _ => MarkRule::Both,
    };
    Ok(MarkElement { begin_m: mark.number_or("sOffset", 0.0)?, rule })
}
