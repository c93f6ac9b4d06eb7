//! Reads objects: crosswalks, and things that stand beside the road.

use crate::RoadError;

use super::super::elements::{ObjectElement, ObjectKind, Outline};
use super::super::xml::Element;
use super::{ROAD_M_MAX, Reader};

/// An object that begins at least this high above the road is in nobody's way, m.
const ABOVE_M: f64 = 3.0;

/// Limit on the copies of one crosswalk.
const REPEATS_MAX: f64 = 1000.0;

/// Limit on the corners and copies of all objects of a map: a hundred bytes of a file may stand for a thousand copies.
const CORNERS_MAX: usize = 2_000_000;

impl Reader {
    /// The objects of a road. One that cannot be read is left out, with a warning.
    ///
    /// # Errors
    /// If the map's objects are more than can be held.
    pub(super) fn objects(&mut self, road: Element) -> Result<Vec<ObjectElement>, RoadError> {
        let mut all = Vec::new();
        for object in road.child("objects").into_iter().flat_map(|objects| objects.children("object")) {
            let word = object.attribute("type").unwrap_or("");
            let Some(kind) = object_kind(word) else {
                self.ignore(format!("objects of type `{word}`"));
                continue;
            };
            match self.object(object, word, kind) {
                Ok(read) => all.extend(read),
                Err(error) if self.corners > CORNERS_MAX => return Err(error),
                Err(error) => self.leave_out(&error),
            }
        }
        Ok(all)
    }

    /// Counts corners or copies of an object.
    fn count_corners(&mut self, object: Element, number: usize) -> Result<(), RoadError> {
        self.corners = self.corners.saturating_add(number);
        if self.corners > CORNERS_MAX {
            let message = format!(
                "the objects up to here have more than {CORNERS_MAX} corners and copies in all: leave some out, or \
                 repeat them at greater distances"
            );
            return Err(object.wrong(message));
        }
        Ok(())
    }

    /// An object, or its copies.
    fn object(
        &mut self,
        object: Element,
        word: &str,
        kind: ObjectKind,
    ) -> Result<Vec<ObjectElement>, RoadError> {
        let id = match kind {
            ObjectKind::Crosswalk => object.text("id")?,
            ObjectKind::Solid => object.attribute("id").unwrap_or(""),
        };
        let (s_m, t_m) = (object.number("s")?, object.number_or("t", 0.0)?);
        // Crowns of trees and arms of lamps are above, whatever their outlines are.
        let is_on_the_ground = !matches!(word, "gantry" | "tree" | "vegetation" | "streetLamp")
            && object.number_or("zOffset", 0.0)? < ABOVE_M;
        if kind == ObjectKind::Solid
            && let Some(corners) = stretched(object, s_m, t_m)?
        {
            self.count_corners(object, corners.len())?;
            let (outline, heading_rad) = (Outline::Road(corners), 0.0);
            let (id, word) = (id.to_owned(), word.to_owned());
            return Ok(vec![ObjectElement {
                id,
                word,
                kind,
                is_on_the_ground,
                s_m,
                t_m,
                heading_rad,
                outline,
            }]);
        }
        let Some(outline) = outline(object)? else {
            match kind {
                ObjectKind::Crosswalk => {
                    self.warn(object, "ignored a crosswalk without an outline of three corners");
                }
                ObjectKind::Solid => self.ignore(format!("objects of type `{word}` without an outline")),
            }
            return Ok(Vec::new());
        };
        if object.child("outlines").is_some_and(|outlines| outlines.children("outline").nth(1).is_some()) {
            self.ignore("outlines of objects after the first".to_owned());
        }
        let heading_rad = object.number_or("hdg", 0.0)?;
        let places = self.repeats(object, s_m, t_m)?;
        let (Outline::Local(corners) | Outline::Road(corners)) = &outline;
        self.count_corners(object, places.len().saturating_mul(corners.len()))?;
        let copies = places.into_iter().map(|(moved_m, t_m)| ObjectElement {
            id: id.to_owned(),
            word: word.to_owned(),
            kind,
            is_on_the_ground,
            s_m: s_m + moved_m,
            t_m,
            heading_rad,
            outline: match &outline {
                Outline::Local(corners) => Outline::Local(corners.clone()),
                Outline::Road(corners) => {
                    Outline::Road(corners.iter().map(|(s, t)| (s + moved_m, *t)).collect())
                }
            },
        });
        Ok(copies.collect())
    }

    /// Offsets of an object, m: ahead of its station, and to the left of the reference line.
    fn repeats(&mut self, object: Element, s_m: f64, t_m: f64) -> Result<Vec<(f64, f64)>, RoadError> {
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
            self.count_corners(object, times as usize + 1)?;
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
}

/// The kind of an object for pedestrians; `None` for an object that does not concern them, like paint.
fn object_kind(kind: &str) -> Option<ObjectKind> {
    match kind {
        "crosswalk" => Some(ObjectKind::Crosswalk),
        "building" | "barrier" | "railing" | "soundBarrier" | "wall" | "fence" | "guardRail" | "obstacle"
        | "pole" | "streetLamp" | "gantry" | "tree" | "vegetation" | "car" | "van" | "truck" | "bus"
        | "trailer" => Some(ObjectKind::Solid),
        _ => None,
    }
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
