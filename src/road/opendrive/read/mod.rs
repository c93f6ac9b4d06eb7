//! Reads XML into elements. Each function reads one kind of element and reports what the element lacks.

use std::collections::BTreeMap;

use crate::RoadError;
use avastra_base::geometry::Vec2;

use super::cubic::{Cubic, Cubics};
use super::cut::cut;
use super::elements::{
    ConnectionElement, Contact, ControllerElement, Document, JunctionElement, Limit, RoadElement, RoadLink,
    TypeElement,
};
use super::vocabulary;
use super::xml::{Element, Lines, wrong};

mod lanes;
mod objects;
mod plan;
mod signals;

/// Limit on the length of a road, m; it bounds the work of sampling lanes.
const ROAD_M_MAX: f64 = 100_000.0;

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

/// The tree of an XML text, also of another format than OpenDRIVE.
///
/// # Errors
/// If it is not well-formed, and in which line.
pub fn well_formed(text: &str) -> Result<roxmltree::Document<'_>, RoadError> {
    refuse_costly_tags(text)?;
    let parsed = match roxmltree::Document::parse(text) {
        Err(roxmltree::Error::DtdDetected) => {
            if let Some(begin) = declaring_type(text) {
                let line = Lines::new(text).of(begin);
                let message = "a document type with declarations of its own (`<!DOCTYPE … [`) is not read: take them out";
                return Err(wrong(line, message));
            }
            let options =
                roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
            roxmltree::Document::parse_with_options(text, options)
        }
        parsed => parsed,
    };
    parsed.map_err(|error| not_xml(text, &error))
}

/// Where a document type begins that has internal declarations: they may let a short text stand for a long one.
fn declaring_type(text: &str) -> Option<usize> {
    let declares = |(begin, _): &(usize, &str)| {
        let mut quote = None;
        for byte in text[*begin..].bytes() {
            match (quote, byte) {
                (None, b'[') => return true,
                (None, b'>') => return false,
                (None, b'"' | b'\'') => quote = Some(byte),
                (Some(open), _) if open == byte => quote = None,
                _ => {}
            }
        }
        true
    };
    text.match_indices("<!DOCTYPE").find(declares).map(|(begin, _)| begin)
}

/// The text of an XML file: UTF-8, UTF-16, or the Latin-1 that it declares.
///
/// # Errors
/// If it is none of these, what it is.
pub fn xml_text(bytes: Vec<u8>) -> Result<String, String> {
    let wide = match bytes[..] {
        [0xFF, 0xFE, ..] | [b'<', 0, ..] => Some(u16::from_le_bytes as fn([u8; 2]) -> u16),
        [0xFE, 0xFF, ..] | [0, b'<', ..] => Some(u16::from_be_bytes as fn([u8; 2]) -> u16),
        _ => None,
    };
    if let Some(unit) = wide {
        let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        let text: Result<String, _> = char::decode_utf16(units).collect();
        let text =
            text.map_err(|_| "not text: it begins as UTF-16 and goes on as something else".to_owned())?;
        return Ok(text.trim_start_matches('\u{feff}').to_owned());
    }
    let bytes = match String::from_utf8(bytes) {
        Ok(text) => return Ok(text),
        Err(error) => error.into_bytes(),
    };
    let declaration: String = bytes
        .iter()
        .take(DECLARATION_BYTES_MAX)
        .map(|byte| char::from(*byte))
        .take_while(|one| *one != '>')
        .collect();
    let named = declaration.split_once("encoding").and_then(|(_, rest)| rest.split(['"', '\'']).nth(1));
    let encoding = named.unwrap_or("UTF-8").to_ascii_lowercase();
    let is_latin = ["iso-8859-1", "latin1", "latin-1", "us-ascii"].contains(&encoding.as_str());
    // Windows' own has other letters in place of the control characters alone.
    let is_plain = || !bytes.iter().any(|byte| (0x80..0xA0).contains(byte));
    match is_latin || encoding == "windows-1252" && is_plain() {
        true => Ok(bytes.iter().map(|byte| char::from(*byte)).collect()),
        false => Err(format!(
            "not text: its encoding `{encoding}` is not read, or it is another one; save it as UTF-8"
        )),
    }
}

/// The declaration of an XML file ends before this.
const DECLARATION_BYTES_MAX: usize = 200;

/// Limit on the attributes of an element; no element of OpenDRIVE has more than thirty. The XML reader compares
/// every attribute of an element with every other.
const ATTRIBUTES_MAX: usize = 256;

/// Limit on the elements around an element that declare namespaces. The XML reader copies the namespaces of all of them
/// for each further one, and compares each with every other.
const NAMESPACES_MAX: usize = 32;

/// Refuses elements with too many attributes, and too many namespaces within each other, in one pass over the text. They make
/// the XML reader slow, and no real file has them.
fn refuse_costly_tags(text: &str) -> Result<(), RoadError> {
    let mut at = 0;
    // For each open element, whether it declares a namespace, and how many of them do.
    let (mut open, mut declaring): (Vec<bool>, usize) = (Vec::new(), 0);
    let refused = |begin: usize, message: String| {
        let line = text[..begin].bytes().filter(|byte| *byte == b'\n').count() + 1;
        Err(wrong(u32::try_from(line).unwrap_or(u32::MAX), message))
    };
    while let Some(begin) = text[at..].find('<').map(|found| at + found) {
        let rest = &text[begin..];
        let hidden = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        if let Some((_, end)) = hidden.iter().find(|(mark, _)| rest.starts_with(mark)) {
            let Some(length) = rest.find(end) else { return Ok(()) };
            at = begin + length;
            continue;
        }
        let (mut quote, mut equals, mut end) = (None, 0, rest.len());
        for (offset, byte) in rest.bytes().enumerate() {
            match (quote, byte) {
                (None, b'>') => {
                    end = offset;
                    break;
                }
                (None, b'"' | b'\'') => quote = Some(byte),
                (Some(open), _) if open == byte => quote = None,
                (None, b'=') => equals += 1,
                _ => {}
            }
        }
        if equals > ATTRIBUTES_MAX {
            let message =
                format!("an element has {equals} attributes; no file needs more than {ATTRIBUTES_MAX}");
            return refused(begin, message);
        }
        let tag = &rest[..end];
        if tag.starts_with("</") {
            declaring -= usize::from(open.pop() == Some(true));
        } else if !tag.ends_with('/') {
            let declares = tag.contains("xmlns");
            declaring += usize::from(declares);
            open.push(declares);
            if declaring > NAMESPACES_MAX {
                let message = format!(
                    "more than {NAMESPACES_MAX} elements within each other declare namespaces; no file needs as \
                     many"
                );
                return refused(begin, message);
            }
        }
        at = begin + end.max(1);
    }
    Ok(())
}

/// Reads a whole file.
///
/// # Errors
/// The first thing that is wrong, with its line.
pub fn read(name: &str, text: &str) -> Result<Document, RoadError> {
    if text.trim().is_empty() {
        return Err(wrong(1, "the file is empty; an OpenDRIVE map is expected"));
    }
    let document = well_formed(text)?;
    let lines = Lines::new(text);
    let root = Element::new(document.root_element(), &lines);
    if root.name() != "OpenDRIVE" {
        return Err(root.wrong(format!("the root element is `{}`; `OpenDRIVE` is expected", root.name())));
    }
    let mut reader = Reader::default();
    let header_name = root.child("header").and_then(|header| header.attribute("name")).unwrap_or("");
    let roads: Vec<_> = root.children("road").map(|road| reader.road(road)).collect::<Result<_, _>>()?;
    if roads.is_empty() {
        return Err(root.wrong("the map holds no `road`"));
    }
    let junctions = root.children("junction").map(|one| reader.junction(one)).collect::<Result<_, _>>()?;
    let controllers = root.children("controller").map(controller).collect::<Result<_, _>>()?;
    vocabulary::unread(document.root_element()).for_each(|what| reader.ignore(what));
    let (mut warnings, warned_at) = (reader.warnings, reader.warned_at);
    warnings
        .extend(reader.ignored.into_iter().map(|(what, times)| format!("ignored {what} ({times} times)")));
    Ok(Document {
        name: if header_name.is_empty() { name.to_owned() } else { header_name.to_owned() },
        roads,
        junctions,
        controllers,
        warnings,
        warned_at,
    })
}

/// Reads elements and collects what it does not understand.
#[derive(Default)]
struct Reader {
    warnings: Vec<String>,
    /// The places in the plane that warnings are about: index of the warning, position.
    warned_at: Vec<(usize, Vec2)>,
    /// Each kind of thing that was left out, with its number.
    ignored: BTreeMap<String, usize>,
    /// Corners and copies of all objects so far.
    corners: usize,
    /// Lanes of sections that were cut so far.
    lanes_cut: usize,
}

impl Reader {
    fn warn(&mut self, element: Element, message: impl AsRef<str>) {
        self.warnings.push(format!("line {}: {}", element.line(), message.as_ref()));
    }

    fn warn_at(&mut self, element: Element, position: Vec2, message: impl AsRef<str>) {
        self.warned_at.push((self.warnings.len(), position));
        self.warn(element, message);
    }

    /// Notes that the element of an error is left out.
    fn leave_out(&mut self, error: &RoadError) {
        self.warnings.push(format!("{error}: left out"));
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
        let link = |name: &str| {
            let link = road.child("link").and_then(|link| link.child(name));
            link.map(road_link).transpose().map(Option::flatten)
        };
        let (predecessor, successor) = (link("predecessor")?, link("successor")?);
        let mut types = Vec::new();
        for kind in road.children("type") {
            let limit = kind.child("speed").map(|speed| self.speed(speed)).transpose()?;
            types.push(TypeElement {
                begin_m: kind.number_or("s", 0.0)?,
                limit: limit.unwrap_or(Limit::Unstated),
                is_motorway: kind.attribute("type") == Some("motorway"),
            });
        }
        // OpenDRIVE asks for this order; not every file keeps it.
        types.sort_by(|a, b| a.begin_m.total_cmp(&b.begin_m));
        let elevation = self.elevation(road);
        self.ignore_slopes(road)?;
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
            reference: self.reference_line(road, &id, length_m)?,
            elevation,
            lane_offset: cubics(lanes.children("laneOffset"), "s")?,
            sections: cut(self.sections(lanes, &id, length_m)?, &types, &mut self.lanes_cut)?,
            signals: self.signals(road),
            objects: self.objects(road)?,
            id,
            length_m,
        })
    }

    fn junction(&mut self, junction: Element) -> Result<JunctionElement, RoadError> {
        // It has no place where a way ends and another begins: lanes that leave in the middle of a lane are not in the graph.
        let is_virtual = junction.attribute("type") == Some("virtual");
        if is_virtual {
            let message = format!(
                "junction `{}` is virtual: its connections lead off in the middle of a road, and are left out",
                junction.attribute("id").unwrap_or("")
            );
            self.warn(junction, message);
        }
        let connections = junction.children("connection").filter(|_| !is_virtual).map(|connection| {
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
            line: junction.line(),
            id: junction.text("id")?.to_owned(),
            name: junction.attribute("name").unwrap_or("").to_owned(),
            connections: connections.collect::<Result<_, _>>()?,
            priorities: junction
                .children("priority")
                .filter_map(|entry| {
                    Some((entry.attribute("high")?.to_owned(), entry.attribute("low")?.to_owned()))
                })
                .collect(),
            controllers: controllers
                .map(|entry| Ok((entry.text("id")?.to_owned(), entry.line())))
                .collect::<Result<_, _>>()?,
        })
    }

    /// Heights of the reference line. A road whose heights cannot be read lies at height 0.
    fn elevation(&mut self, road: Element) -> Cubics {
        let records =
            road.child("elevationProfile").into_iter().flat_map(|profile| profile.children("elevation"));
        cubics(records, "s").unwrap_or_else(|error| {
            self.leave_out(&error);
            Cubics::default()
        })
    }

    /// Everything drives as on the flat; a road that is not flat gives a warning.
    fn ignore_slopes(&mut self, road: Element) -> Result<(), RoadError> {
        let profiles = [
            ("elevationProfile", "elevation", "slopes: heights only tell which roads pass over each other"),
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

    fn speed(&mut self, speed: Element) -> Result<Limit, RoadError> {
        match speed.attribute("max") {
            Some("no limit") => return Ok(Limit::No),
            Some("undefined") => return Ok(Limit::Unstated),
            _ => {}
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
            return Ok(Limit::Unstated);
        }
        Ok(Limit::Of(limit_mps))
    }
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

/// The element that a road's end touches. `None` for a link to the middle of a road, as in virtual junctions, which have
/// their own warning.
fn road_link(link: Element) -> Result<Option<RoadLink>, RoadError> {
    if link.attribute("elementS").is_some() {
        return Ok(None);
    }
    let (id, line) = (link.text("elementId")?.to_owned(), link.line());
    match link.attribute("elementType").unwrap_or("road") {
        "junction" => Ok(Some(RoadLink::Junction { id, line })),
        "road" => Ok(Some(RoadLink::Road { id, contact: contact(link)?, line })),
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

fn controller(controller: Element) -> Result<ControllerElement, RoadError> {
    let controls = controller.children("control");
    Ok(ControllerElement {
        id: controller.text("id")?.to_owned(),
        signals: controls
            .map(|control| Ok((control.text("signalId")?.to_owned(), control.line())))
            .collect::<Result<_, _>>()?,
    })
}
