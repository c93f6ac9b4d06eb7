//! Reads XML into elements. Each function reads one kind of element and reports what the element lacks.

use std::collections::BTreeMap;

use crate::geometry::Vec2;
use crate::road::{RoadError, SignKind, StripKind};

use super::cubic::{Cubic, Cubics};
use super::elements::{
    ConnectionElement, Contact, ControllerElement, Document, JunctionElement, LaneElement, MarkElement,
    MarkRule, Meaning, ObjectElement, ObjectKind, Orientation, Outline, RoadElement, RoadLink,
    SectionElement, SignalElement,
};
use super::geometry::{Piece, ReferenceLine, Shape};
use super::xml::{Element, Lines, wrong};

/// Limit on the length of a road, m; it bounds the work of sampling lanes.
const ROAD_M_MAX: f64 = 100_000.0;

/// Limit on the lanes of one side of a road.
const LANES_MAX: i32 = 100;

/// Limit on the copies of one crosswalk.
const REPEATS_MAX: f64 = 1000.0;

/// Limit on the turn of one curve, rad; a real curve turns by a few.
const TURN_RAD_MAX: f64 = 200.0;

/// The error for a text that is not XML. If the text ends too early, the error names its last line, because the
/// XML reader would name the first.
fn not_xml(text: &str, error: &roxmltree::Error) -> RoadError {
    let message = error.to_string();
    if matches!(error, roxmltree::Error::UnexpectedEndOfStream | roxmltree::Error::UnclosedRootNode) {
        let last = u32::try_from(text.trim_end().lines().count()).unwrap_or(u32::MAX);
        return wrong(last, format!("this is not well-formed XML, as if cut off in the middle: {message}"));
    }
    wrong(error.pos().row, format!("this is not well-formed XML: {message}"))
}

/// Reads a whole file.
///
/// # Errors
/// The first thing that is wrong, with its line.
pub fn read(name: &str, text: &str) -> Result<Document, RoadError> {
    if text.trim().is_empty() {
        return Err(wrong(1, "the file is empty; an OpenDRIVE map is expected"));
    }
    let document = roxmltree::Document::parse(text).map_err(|error| not_xml(text, &error))?;
    let lines = Lines::new(text);
    let root = Element::new(document.root_element(), &lines);
    if root.name() != "OpenDRIVE" {
        return Err(root.wrong(format!("the root element is `{}`; `OpenDRIVE` is expected", root.name())));
    }
    let mut reader = Reader { warnings: Vec::new(), ignored: BTreeMap::new() };
    let header_name = root.child("header").and_then(|header| header.attribute("name")).unwrap_or("");
    let roads: Vec<_> = root.children("road").map(|road| reader.road(road)).collect::<Result<_, _>>()?;
    if roads.is_empty() {
        return Err(root.wrong("the map holds no `road`"));
    }
    let junctions = root.children("junction").map(junction).collect::<Result<_, _>>()?;
    let controllers = root.children("controller").map(controller).collect::<Result<_, _>>()?;
    let mut warnings = reader.warnings;
    warnings
        .extend(reader.ignored.into_iter().map(|(what, times)| format!("ignored {what} ({times} times)")));
    Ok(Document {
        name: if header_name.is_empty() { name.to_owned() } else { header_name.to_owned() },
        roads,
        junctions,
        controllers,
        warnings,
    })
}

/// Reads elements and collects what it does not understand.
struct Reader {
    warnings: Vec<String>,
    /// Each kind of thing that was left out, with its number.
    ignored: BTreeMap<String, usize>,
}

impl Reader {
    fn warn(&mut self, element: Element, message: impl AsRef<str>) {
        self.warnings.push(format!("line {}: {}", element.line(), message.as_ref()));
    }

    fn ignore(&mut self, what: String) {
        *self.ignored.entry(what).or_default() += 1;
    }

    fn road(&mut self, road: Element) -> Result<RoadElement, RoadError> {
        let id = road.text("id")?.to_owned();
        let length_m = road.number("length")?;
        if !(length_m > 0.0 && length_m <= ROAD_M_MAX) {
            return Err(road.wrong(format!(
                "road `{id}` is {length_m} m long; more than 0 and at most {ROAD_M_MAX} m is expected"
            )));
        }
        let junction = road.attribute("junction").filter(|id| !id.is_empty() && *id != "-1");
        let link = |name: &str| match road.child("link").and_then(|link| link.child(name)) {
            Some(link) => road_link(link).map(Some),
            None => Ok(None),
        };
        let (predecessor, successor) = (link("predecessor")?, link("successor")?);
        let mut speeds = Vec::new();
        for kind in road.children("type") {
            let limit = kind.child("speed").map(|speed| self.speed(speed)).transpose()?;
            speeds.push((kind.number_or("s", 0.0)?, limit.flatten()));
        }
        self.ignore_heights(road)?;
        if let Some(rule) = road.attribute("rule").filter(|rule| !["LHT", "RHT"].contains(rule)) {
            self.warn(road, format!("road `{id}` has the rule `{rule}`, taken for RHT"));
        }
        let lanes =
            road.child("lanes").ok_or_else(|| road.wrong(format!("road `{id}` lacks its `lanes`")))?;
        Ok(RoadElement {
            line: road.line(),
            junction: junction.map(str::to_owned),
            left_hand: road.attribute("rule") == Some("LHT"),
            predecessor,
            successor,
            speeds,
            reference: self.reference_line(road, &id, length_m)?,
            lane_offset: cubics(lanes.children("laneOffset"), "s")?,
            sections: self.sections(lanes, &id, length_m)?,
            signals: self.signals(road)?,
            objects: self.objects(road)?,
            id,
            length_m,
        })
    }

    /// Roads are read as flat; a road that is not flat gives a warning.
    fn ignore_heights(&mut self, road: Element) -> Result<(), RoadError> {
        let profiles = [
            ("elevationProfile", "elevation", "slopes: roads are taken as flat"),
            ("lateralProfile", "superelevation", "banked roads: they are taken as flat"),
            ("lateralProfile", "crossfall", "crossfalls: roads are taken as flat"),
            ("lateralProfile", "shape", "lateral shapes: roads are taken as flat"),
        ];
        for (profile, record, words) in profiles {
            for entry in road.child(profile).into_iter().flat_map(|profile| profile.children(record)) {
                // A constant height is no slope; a constant bank is one.
                let names = if record == "elevation" { &["b", "c", "d"][..] } else { &["a", "b", "c", "d"] };
                let mut bends = false;
                for name in names {
                    bends |= entry.number_or(name, 0.0)?.abs() > 1e-9;
                }
                if bends {
                    self.ignore(words.to_owned());
                    break;
                }
            }
        }
        Ok(())
    }

    fn reference_line(&mut self, road: Element, id: &str, length_m: f64) -> Result<ReferenceLine, RoadError> {
        let plan =
            road.child("planView").ok_or_else(|| road.wrong(format!("road `{id}` lacks its `planView`")))?;
        let mut pieces: Vec<Piece> = Vec::new();
        for geometry in plan.children("geometry") {
            if geometry.number("length")? < 1e-9 {
                // Some tools write empty curves; they hold nothing.
                continue;
            }
            pieces.push(piece(geometry)?);
        }
        pieces.sort_by(|a, b| a.begin_m.total_cmp(&b.begin_m));
        let end_m = pieces.last().map_or(0.0, |last| last.begin_m + last.length_m);
        let reference = ReferenceLine::new(pieces)
            .ok_or_else(|| plan.wrong(format!("road `{id}` has no `geometry` of any length")))?;
        if (end_m - length_m).abs() > 0.1 {
            self.warn(road, format!("road `{id}` is {length_m} m long, but its curves end at {end_m:.3} m"));
        }
        let (gap_m, at_m) = reference.largest_gap();
        if gap_m > 0.05 {
            self.warn(plan, format!("the curves of road `{id}` leave a gap of {gap_m:.3} m at s {at_m:.3}"));
        }
        Ok(reference)
    }

    fn sections(
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
        if id == 0 || id.abs() > LANES_MAX {
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
        let kind = lane.attribute("type").unwrap_or("none");
        let mut driving = is_driving(kind);
        if !driving && !BESIDE_THE_ROAD.contains(&kind) {
            self.ignore(format!("lanes of type `{kind}`"));
        }
        if let Some(direction @ ("reversed" | "both")) = lane.attribute("direction").filter(|_| driving) {
            self.ignore(format!("lanes of direction `{direction}`"));
            driving = false;
        }
        let beside = if driving { None } else { strip_kind(kind) };
        let widths = cubics(lane.children("width"), "sOffset")?;
        let borders = cubics(lane.children("border"), "sOffset")?;
        if driving && widths.is_empty() && borders.is_empty() {
            return Err(lane.wrong(format!("lane {id} has neither `width` nor `border`")));
        }
        let marks = lane.children("roadMark");
        let mut marks: Vec<MarkElement> = marks.map(|mark| road_mark(mark, id)).collect::<Result<_, _>>()?;
        marks.sort_by(|a, b| a.begin_m.total_cmp(&b.begin_m));
        Ok(LaneElement {
            id,
            line: lane.line(),
            driving,
            beside,
            widths,
            borders,
            predecessors: linked("predecessor")?,
            successors: linked("successor")?,
            speeds,
            marks,
        })
    }

    /// A limit in m/s; `None` for `no limit` and `undefined`.
    fn speed(&mut self, speed: Element) -> Result<Option<f64>, RoadError> {
        if matches!(speed.attribute("max"), Some("no limit" | "undefined")) {
            return Ok(None);
        }
        let factor = match speed.attribute("unit").unwrap_or("m/s") {
            "m/s" => 1.0,
            "km/h" => 1.0 / 3.6,
            "mph" => 0.447_04,
            unit => {
                let message = format!("unknown unit of speed `{unit}`; write m/s, km/h or mph");
                return Err(speed.wrong(message));
            }
        };
        let limit_mps = speed.number("max")? * factor;
        if limit_mps <= 0.0 {
            // Some tools write 0 or -1 for "none".
            self.warn(speed, format!("ignored a speed limit of {limit_mps} m/s"));
            return Ok(None);
        }
        Ok(Some(limit_mps))
    }

    fn signals(&mut self, road: Element) -> Result<Vec<SignalElement>, RoadError> {
        let mut all = Vec::new();
        for signal in road.child("signals").into_iter().flat_map(Element::elements) {
            let reference = match signal.name() {
                "signal" => false,
                "signalReference" => true,
                name => {
                    self.ignore(format!("`{name}` among signals"));
                    continue;
                }
            };
            let kind = signal.attribute("type").unwrap_or("");
            let Some(meaning) = (if reference { Some(Meaning::Light) } else { meaning(signal, kind) }) else {
                self.ignore(format!("signals of type `{kind}`"));
                continue;
            };
            let validity = signal.children("validity");
            all.push(SignalElement {
                id: signal.text("id")?.to_owned(),
                line: signal.line(),
                s_m: signal.number("s")?,
                t_m: signal.number_or("t", 0.0)?,
                reference,
                meaning,
                orientation: match signal.attribute("orientation") {
                    Some("+") => Orientation::Along,
                    Some("-") => Orientation::Against,
                    _ => Orientation::Both,
                },
                validity: validity
                    .map(|range| {
                        let (from, to) = (range.integer("fromLane")?, range.integer("toLane")?);
                        Ok((from.min(to), from.max(to)))
                    })
                    .collect::<Result<_, _>>()?,
            });
        }
        Ok(all)
    }

    fn objects(&mut self, road: Element) -> Result<Vec<ObjectElement>, RoadError> {
        let mut all = Vec::new();
        for object in road.child("objects").into_iter().flat_map(|objects| objects.children("object")) {
            let word = object.attribute("type").unwrap_or("");
            let Some(kind) = object_kind(word) else {
                self.ignore(format!("objects of type `{word}`"));
                continue;
            };
            let id = match kind {
                ObjectKind::Crosswalk => object.text("id")?,
                ObjectKind::Solid => object.attribute("id").unwrap_or(""),
            };
            let (s_m, t_m) = (object.number("s")?, object.number_or("t", 0.0)?);
            if kind == ObjectKind::Solid
                && let Some(corners) = stretched(object, s_m, t_m)?
            {
                let (outline, heading_rad) = (Outline::Road(corners), 0.0);
                all.push(ObjectElement { id: id.to_owned(), kind, s_m, t_m, heading_rad, outline });
                continue;
            }
            let Some(outline) = outline(object)? else {
                match kind {
                    ObjectKind::Crosswalk => {
                        self.warn(object, "ignored a crosswalk without an outline of three corners");
                    }
                    ObjectKind::Solid => self.ignore(format!("objects of type `{word}` without an outline")),
                }
                continue;
            };
            for (moved_m, t_m) in repeats(object, s_m, t_m)? {
                all.push(ObjectElement {
                    id: id.to_owned(),
                    kind,
                    s_m: s_m + moved_m,
                    t_m,
                    heading_rad: object.number_or("hdg", 0.0)?,
                    outline: match &outline {
                        Outline::Local(corners) => Outline::Local(corners.clone()),
                        Outline::Road(corners) => {
                            Outline::Road(corners.iter().map(|(s, t)| (s + moved_m, *t)).collect())
                        }
                    },
                });
            }
        }
        Ok(all)
    }
}

/// What a signal means: OpenDRIVE's own catalogue for lights; for signs the numbers of the road traffic
/// regulations of Germany (which CARLA's maps use everywhere), the United States and Great Britain, or else the
/// name.
fn meaning(signal: Element, kind: &str) -> Option<Meaning> {
    let country = signal.attribute("country").unwrap_or("");
    let is_british = country.eq_ignore_ascii_case("GB") || country.eq_ignore_ascii_case("UK");
    match kind {
        "1000002" | "1000007" | "1000013" => Some(Meaning::OtherLight),
        "206" | "R1-1" => Some(Meaning::Sign(SignKind::Stop)),
        "205" | "R1-2" => Some(Meaning::Sign(SignKind::Yield)),
        // Priority at the next junction, and until further notice.
        "301" | "306" => Some(Meaning::Sign(SignKind::PriorityRoad)),
        "601.1" if is_british => Some(Meaning::Sign(SignKind::Stop)),
        "602" if is_british => Some(Meaning::Sign(SignKind::Yield)),
        _ if kind.parse().is_ok_and(|number| (1_000_001..=1_000_020).contains(&number)) => {
            Some(Meaning::Light)
        }
        _ => named(signal.attribute("name").unwrap_or("")).map(Meaning::Sign),
    }
}

/// The sign of a name such as `Sign_Stop` or `give way`. Names with further words are left: `bus stop`.
fn named(name: &str) -> Option<SignKind> {
    let words = name.split(|letter: char| !letter.is_ascii_alphabetic()).filter(|word| !word.is_empty());
    let plain: String = words.map(str::to_ascii_lowercase).filter(|word| word != "sign").collect();
    match plain.strip_suffix("sign").unwrap_or(&plain) {
        "stop" => Some(SignKind::Stop),
        "yield" | "giveway" => Some(SignKind::Yield),
        "priorityroad" => Some(SignKind::PriorityRoad),
        _ => None,
    }
}

/// What an object is to people on foot; `None` for one that is nothing to them, like paint.
fn object_kind(kind: &str) -> Option<ObjectKind> {
    match kind {
        "crosswalk" => Some(ObjectKind::Crosswalk),
        "building" | "barrier" | "railing" | "soundBarrier" | "wall" | "fence" | "guardRail" | "obstacle"
        | "pole" | "streetLamp" | "gantry" | "tree" | "vegetation" | "car" | "van" | "truck" | "bus"
        | "trailer" => Some(ObjectKind::Solid),
        _ => None,
    }
}

/// What a lane that cars do not drive on is to people on foot; `None` for verges and medians, where they may
/// stand but do not walk along.
fn strip_kind(kind: &str) -> Option<StripKind> {
    match kind {
        "sidewalk" | "walking" => Some(StripKind::Walkway),
        "parking" | "stop" | "biking" | "bus" | "taxi" | "HOV" | "bidirectional" | "tram" | "rail" => {
            Some(StripKind::Paved)
        }
        // A driving lane of another direction attribute.
        _ => is_driving(kind).then_some(StripKind::Paved),
    }
}

/// Whether vehicles of all kinds may use a lane of a type, in one direction.
fn is_driving(kind: &str) -> bool {
    matches!(
        kind,
        "driving"
            | "entry"
            | "exit"
            | "onRamp"
            | "offRamp"
            | "connectingRamp"
            | "slipLane"
            | "mwyEntry"
            | "mwyExit"
    )
}

/// Types of lanes that no car drives on; they are left out without a warning.
const BESIDE_THE_ROAD: [&str; 14] = [
    "none",
    "shoulder",
    "border",
    "curb",
    "median",
    "sidewalk",
    "walking",
    "biking",
    "parking",
    "stop",
    "rail",
    "tram",
    "roadWorks",
    "roadMarks",
];

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

fn piece(geometry: Element) -> Result<Piece, RoadError> {
    let length_m = geometry.number("length")?;
    let shape = match geometry.elements().find(|shape| shape.name() != "userData") {
        None => return Err(geometry.wrong("`geometry` lacks its shape, such as `line` or `arc`")),
        Some(shape) => match shape.name() {
            "line" => Shape::Line,
            "arc" => Shape::Arc { curvature_per_m: curvature(shape, "curvature", length_m)? },
            "spiral" => Shape::Spiral {
                begin_per_m: curvature(shape, "curvStart", length_m)?,
                end_per_m: curvature(shape, "curvEnd", length_m)?,
            },
            "paramPoly3" => {
                let p_max = if shape.attribute("pRange") == Some("arcLength") { length_m } else { 1.0 };
                let u = [shape.number("aU")?, shape.number("bU")?, shape.number("cU")?, shape.number("dU")?];
                let v = [shape.number("aV")?, shape.number("bV")?, shape.number("cV")?, shape.number("dV")?];
                cubic_shape(shape, u, v, p_max, length_m)?
            }
            "poly3" => {
                let v = [shape.number("a")?, shape.number("b")?, shape.number("c")?, shape.number("d")?];
                poly3(shape, v, length_m)?
            }
            name => return Err(shape.wrong(format!("unknown geometry `{name}`"))),
        },
    };
    Ok(Piece {
        begin_m: geometry.number("s")?,
        length_m,
        origin: Vec2::new(geometry.number("x")?, geometry.number("y")?),
        heading_rad: geometry.number("hdg")?,
        shape,
    })
}

fn curvature(shape: Element, name: &str, length_m: f64) -> Result<f64, RoadError> {
    let per_m = shape.number(name)?;
    if (per_m * length_m).abs() > TURN_RAD_MAX {
        return Err(shape.wrong(format!("a curvature of {per_m} 1/m over {length_m} m is no road")));
    }
    Ok(per_m)
}

fn cubic_shape(
    shape: Element,
    u: [f64; 4],
    v: [f64; 4],
    p_max: f64,
    length_m: f64,
) -> Result<Shape, RoadError> {
    let cubic = Shape::cubic(u, v, p_max).ok_or_else(|| shape.wrong("this curve has no direction"))?;
    let Shape::Cubic { lengths_m, .. } = &cubic else { return Ok(cubic) };
    let own_m = lengths_m[lengths_m.len() - 1];
    if own_m > 2.0 * length_m || own_m < 0.5 * length_m {
        let message = format!("this curve is {own_m:.3} m long, but its geometry says {length_m} m");
        return Err(shape.wrong(message));
    }
    Ok(cubic)
}

/// A curve `v(u)`. The file does not state the last `u`; bisection finds the one at which the curve has its
/// length.
fn poly3(shape: Element, v: [f64; 4], length_m: f64) -> Result<Shape, RoadError> {
    let (mut low, mut high) = (0.0, length_m);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        match Shape::cubic([0.0, 1.0, 0.0, 0.0], v, middle) {
            Some(Shape::Cubic { lengths_m, .. }) if lengths_m[lengths_m.len() - 1] < length_m => low = middle,
            Some(_) => high = middle,
            None => return Err(shape.wrong("this curve has no direction")),
        }
    }
    cubic_shape(shape, [0.0, 1.0, 0.0, 0.0], v, high, length_m)
}

fn cubics<'a, 'input: 'a>(
    records: impl Iterator<Item = Element<'a, 'input>>,
    begin: &str,
) -> Result<Cubics, RoadError> {
    let pieces = records.map(|record| {
        Ok(Cubic {
            begin_m: record.number_or(begin, 0.0)?,
            a: record.number("a")?,
            b: record.number_or("b", 0.0)?,
            c: record.number_or("c", 0.0)?,
            d: record.number_or("d", 0.0)?,
        })
    });
    pieces.collect::<Result<_, _>>().map(Cubics::new)
}

/// Offsets of an object, m: ahead of its own station, and to the left of the reference line.
fn repeats(object: Element, s_m: f64, t_m: f64) -> Result<Vec<(f64, f64)>, RoadError> {
    let mut places = Vec::new();
    for repeat in object.children("repeat") {
        let (begin_m, length_m) = (repeat.number("s")?, repeat.number_or("length", 0.0)?);
        let distance_m = repeat.number_or("distance", 0.0)?;
        let (from_m, to_m) = (repeat.number_or("tStart", t_m)?, repeat.number_or("tEnd", t_m)?);
        // Without a distance, `repeat` means one body stretched over the length; a crosswalk is not such a
        // body.
        let times = if distance_m > 1e-3 {
            (length_m / distance_m + 1e-9).floor().clamp(0.0, REPEATS_MAX)
        } else {
            0.0
        };
        for i in 0..=times as u32 {
            let ahead_m = distance_m * f64::from(i);
            let fraction = if length_m > 0.0 { ahead_m / length_m } else { 0.0 };
            places.push((begin_m + ahead_m - s_m, from_m + (to_m - from_m) * fraction));
        }
    }
    if places.is_empty() {
        places.push((0.0, t_m));
    }
    Ok(places)
}

/// Corners, along the road, of one body stretched over a length: what `repeat` without a distance means for a
/// wall or a barrier. Stretched bodies are taken as straight between stations 5 m apart.
fn stretched(object: Element, s_m: f64, t_m: f64) -> Result<Option<Vec<(f64, f64)>>, RoadError> {
    const STRETCH_M: f64 = 5.0;
    let Some(repeat) = object.child("repeat") else { return Ok(None) };
    let length_m = repeat.number_or("length", 0.0)?;
    if repeat.number_or("distance", 0.0)? > 1e-3 || !(0.0..=ROAD_M_MAX).contains(&length_m) {
        return Ok(None);
    }
    let begin_m = repeat.number_or("s", s_m)?;
    let (from_m, to_m) = (repeat.number_or("tStart", t_m)?, repeat.number_or("tEnd", t_m)?);
    let width_m = repeat.number_or("widthStart", object.number_or("width", 0.0)?)?;
    let times = (length_m / STRETCH_M).ceil().max(1.0) as u32;
    let at = |index: u32, left_m: f64| {
        let fraction = f64::from(index) / f64::from(times);
        (begin_m + length_m * fraction, from_m + (to_m - from_m) * fraction + left_m)
    };
    let there = (0..=times).map(|index| at(index, width_m / 2.0));
    let back = (0..=times).rev().map(|index| at(index, -width_m / 2.0));
    Ok(Some(there.chain(back).collect()))
}

fn outline(object: Element) -> Result<Option<Outline>, RoadError> {
    // Since 1.5 an object may have several outlines; before, one without the wrapper.
    let wrapper = object.child("outlines").unwrap_or(object);
    let Some(outline) = wrapper.child("outline") else {
        let (length_m, width_m) = (object.number_or("length", 0.0)?, object.number_or("width", 0.0)?);
        let (u, v) = (length_m / 2.0, width_m / 2.0);
        let corners = vec![(-u, -v), (u, -v), (u, v), (-u, v)];
        return Ok((u > 0.0 && v > 0.0).then_some(Outline::Local(corners)));
    };
    let corners =
        |name: &'static str, x: &'static str, y: &'static str| -> Result<Vec<(f64, f64)>, RoadError> {
            outline.children(name).map(|corner| Ok((corner.number(x)?, corner.number(y)?))).collect()
        };
    let local = corners("cornerLocal", "u", "v")?;
    if local.len() >= 3 {
        return Ok(Some(Outline::Local(local)));
    }
    let along = corners("cornerRoad", "s", "t")?;
    Ok((along.len() >= 3).then_some(Outline::Road(along)))
}

fn road_link(link: Element) -> Result<RoadLink, RoadError> {
    let (id, line) = (link.text("elementId")?.to_owned(), link.line());
    match link.attribute("elementType").unwrap_or("road") {
        "junction" => Ok(RoadLink::Junction { id, line }),
        "road" => Ok(RoadLink::Road { id, contact: contact(link)?, line }),
        other => {
            Err(link.wrong(format!("unknown `elementType` `{other}`; `road` or `junction` is expected")))
        }
    }
}

fn contact(element: Element) -> Result<Contact, RoadError> {
    match element.text("contactPoint")? {
        "start" => Ok(Contact::Start),
        "end" => Ok(Contact::End),
        other => {
            Err(element.wrong(format!("unknown `contactPoint` `{other}`; `start` or `end` is expected")))
        }
    }
}

fn junction(junction: Element) -> Result<JunctionElement, RoadError> {
    let connections = junction.children("connection").map(|connection| {
        let links = connection.children("laneLink");
        Ok(ConnectionElement {
            line: connection.line(),
            incoming_road: connection.text("incomingRoad")?.to_owned(),
            connecting_road: match connection.attribute("connectingRoad") {
                Some(road) => road.to_owned(),
                // A direct junction (1.7) links two roads without a connecting road.
                None => connection.text("linkedRoad")?.to_owned(),
            },
            contact: contact(connection)?,
            lane_links: links
                .map(|link| Ok((link.integer("from")?, link.integer("to")?)))
                .collect::<Result<_, _>>()?,
        })
    });
    let controllers = junction.children("controller");
    Ok(JunctionElement {
        id: junction.text("id")?.to_owned(),
        name: junction.attribute("name").unwrap_or("").to_owned(),
        connections: connections.collect::<Result<_, _>>()?,
        controllers: controllers
            .map(|entry| Ok((entry.text("id")?.to_owned(), entry.line())))
            .collect::<Result<_, _>>()?,
    })
}

fn controller(controller: Element) -> Result<ControllerElement, RoadError> {
    let controls = controller.children("control");
    Ok(ControllerElement {
        id: controller.text("id")?.to_owned(),
        signals: controls
            .map(|control| Ok((control.text("signalId")?.to_owned(), control.line())))
            .collect::<Result<_, _>>()?,
    })
}
