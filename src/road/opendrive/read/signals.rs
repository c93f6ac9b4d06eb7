//! Reads signals, and what they mean.

use crate::{RoadError, SignKind};

use super::super::elements::{Meaning, Orientation, SignalElement};
use super::super::xml::Element;
use super::Reader;

impl Reader {
    /// The signals of a road. One that cannot be read is left out, with a warning.
    pub(super) fn signals(&mut self, road: Element) -> Vec<SignalElement> {
        let mut all = Vec::new();
        for signal in road.child("signals").into_iter().flat_map(Element::elements) {
            match self.signal(signal) {
                Ok(read) => all.extend(read),
                Err(error) => self.leave_out(&error),
            }
        }
        all
    }

    /// `None` for what says nothing to vehicles.
    fn signal(&mut self, signal: Element) -> Result<Option<SignalElement>, RoadError> {
        let reference = match signal.name() {
            "signal" => false,
            "signalReference" => true,
            name => {
                self.ignore(format!("`{name}` among signals"));
                return Ok(None);
            }
        };
        let kind = signal.attribute("type").unwrap_or("");
        let Some(meaning) = (if reference { Some(Meaning::Light) } else { meaning(signal, kind) }) else {
            self.ignore(format!("signals of type `{kind}`"));
            return Ok(None);
        };
        let validity = signal.children("validity").map(|range| {
            let (from, to) = (range.integer("fromLane")?, range.integer("toLane")?);
            Ok((from.min(to), from.max(to)))
        });
        Ok(Some(SignalElement {
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
            validity: validity.collect::<Result<_, _>>()?,
        }))
    }
}

/// The meaning of a signal. For lights: OpenDRIVE's own catalogue. For signs: the numbers of national
/// regulations, or else the name. Older files write the catalogue's numbers with dots.
fn meaning(signal: Element, kind: &str) -> Option<Meaning> {
    let number = kind.replace('.', "").parse::<u32>().unwrap_or(0);
    match number {
        1_000_002 | 1_000_007 | 1_000_013 => Some(Meaning::OtherLight),
        // Whatever never changes is no light: `1000003` is the paint of a crosswalk in older files.
        1_000_001..=1_000_020 => (signal.attribute("dynamic") != Some("no")).then_some(Meaning::Light),
        _ => {
            let subtype = signal.attribute("subtype").unwrap_or("");
            let sign = national(signal.attribute("country").unwrap_or(""), kind, subtype);
            sign.or_else(|| named(signal.attribute("name").unwrap_or(""))).map(Meaning::Sign)
        }
    }
}

/// A sign by its number in a national regulation, with the country's code after ISO 3166 (or the older words for
/// it). Files of no country, or of the country `OpenDRIVE`, use the numbers of Germany or of the United States.
fn national(country: &str, kind: &str, subtype: &str) -> Option<SignKind> {
    let country = country.to_ascii_uppercase();
    let plain: String =
        kind.chars().filter(|letter| letter.is_ascii_alphanumeric() || *letter == '.').collect();
    let number = plain.to_ascii_uppercase();
    match country.as_str() {
        "GB" | "UK" | "GBR" => match number.as_str() {
            "601.1" => Some(SignKind::Stop),
            "602" => Some(SignKind::Yield),
            _ => None,
        },
        "FR" | "FRA" => lettered(&number, subtype, "AB4", "AB3A", "AB6"),
        "ES" | "ESP" => lettered(&number, subtype, "R2", "R1", "R3"),
        "NL" | "NLD" => lettered(&number, subtype, "B7", "B6", "B1"),
        "BE" | "BEL" => lettered(&number, subtype, "B5", "B1", "B9"),
        "PL" | "POL" => lettered(&number, subtype, "B20", "A7", "D1"),
        "CZ" | "CZE" => lettered(&number, subtype, "P6", "P4", "P2"),
        "SE" | "SWE" => lettered(&number, subtype, "B2", "B1", "B4"),
        "CH" | "CHE" => lettered(&number, subtype, "3.01", "3.02", "3.03"),
        "AT" | "AUT" => lettered(&number, subtype, "5224", "5223", "5225A"),
        "PT" | "PRT" => lettered(&number, subtype, "B2", "B1", "B3"),
        "DK" | "DNK" => lettered(&number, subtype, "B13", "B11", "B16"),
        // Norway's 206 is the priority road, and no stop sign.
        "NO" | "NOR" => lettered(&number, subtype, "204", "202", "206"),
        "RU" | "RUS" => lettered(&number, subtype, "2.5", "2.4", "2.1"),
        // Neither Canada nor Australia has a sign for a priority road.
        "CA" | "CAN" => lettered(&number, subtype, "RA1", "RA2", "-"),
        _ => lettered(&number, subtype, "206", "205", "306")
            // Priority at the next junction only.
            .or_else(|| lettered(&number, subtype, "R11", "R12", "301")),
    }
}

/// A sign whose whole number stands in `type`, or its letters there and the rest in `subtype`.
fn lettered(number: &str, subtype: &str, stop: &str, yields: &str, priority: &str) -> Option<SignKind> {
    // -1 stands for no subtype.
    let subtype = if subtype == "-1" { "" } else { subtype };
    let rest = subtype.chars().filter(char::is_ascii_alphanumeric).map(|letter| letter.to_ascii_uppercase());
    let whole: String = number.chars().chain(rest).collect();
    let is = |sign: &str| number == sign || whole == sign;
    [(stop, SignKind::Stop), (yields, SignKind::Yield), (priority, SignKind::PriorityRoad)]
        .into_iter()
        .find_map(|(sign, kind)| is(sign).then_some(kind))
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
