//! Where names go in a picture: beside what they name, and on nothing else.

/// Width of a letter over its height, a little more than on average in a sans-serif face.
const LETTER_WIDTH: f64 = 0.58;

/// A box in px: left, top, right, bottom.
type Box4 = [f64; 4];

/// The places that are taken in a picture.
#[derive(Debug, Default)]
pub struct Labels {
    size_px: f64,
    taken: Vec<Box4>,
}

impl Labels {
    /// For a picture of this width and height, px.
    pub fn new(size_px: f64) -> Labels {
        Labels { size_px, taken: Vec::new() }
    }

    /// Keeps a place free of names.
    pub fn keep(&mut self, (x, y): (f64, f64), radius_px: f64) {
        self.taken.push([x - radius_px, y - radius_px, x + radius_px, y + radius_px]);
    }

    /// The left end of the base line for a text beside a point, `away_px` or a little more from it; `None` if there is no
    /// room. The first name has the free choice, each later one what is left.
    pub fn place(
        &mut self,
        (x, y): (f64, f64),
        text: &str,
        height_px: f64,
        away_px: f64,
    ) -> Option<(f64, f64)> {
        let width = text.chars().count() as f64 * height_px * LETTER_WIDTH + 4.0;
        let height = height_px + 4.0;
        let sides = [(1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0), (0.0, -1.0), (0.0, 1.0)];
        let around = [1.0, 1.8, 2.8, 4.0].into_iter().flat_map(|far| sides.map(|side| (far, side)));
        let boxes = around.map(|(far, (aside, down))| {
            let left = x - width / 2.0 + aside * (away_px * far + width / 2.0);
            let top = y - height / 2.0 + down * (away_px * far + height / 2.0);
            [left, top, left + width, top + height]
        });
        let is_free = |place: &Box4| {
            place[0] >= 0.0
                && place[1] >= 0.0
                && place[2] <= self.size_px
                && place[3] <= self.size_px
                && self.taken.iter().all(|other| are_apart(place, other))
        };
        let found = boxes.into_iter().find(is_free)?;
        self.taken.push(found);
        Some((found[0] + 2.0, found[3] - 4.0))
    }
}

fn are_apart(a: &Box4, b: &Box4) -> bool {
    a[2] < b[0] || a[0] > b[2] || a[3] < b[1] || a[1] > b[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_neighbours_lie_apart_and_in_the_picture() {
        let mut labels = Labels::new(300.0);
        let (name, height_px, away_px) = ("SUV #4 5 km/h", 12.0, 10.0);
        let kept = (150.0, 120.0);
        labels.keep(kept, 8.0);
        let points: Vec<(f64, f64)> = (0..8).map(|n| (150.0 + f64::from(n), 150.0)).collect();
        let places: Vec<_> =
            points.iter().map(|point| labels.place(*point, name, height_px, away_px)).collect();
        // The box of a text by its base line, found without the code under test.
        let width_px = name.len() as f64 * height_px * LETTER_WIDTH;
        let boxes: Vec<Box4> =
            places.iter().flatten().map(|(x, y)| [*x, y - height_px, x + width_px, *y]).collect();
        // Above and below, left and right, near and farther: there is room for all that fit side by side.
        assert!(boxes.len() >= 6, "{places:?}");
        for (n, a) in boxes.iter().enumerate() {
            assert!(a.iter().all(|px| (0.0..=300.0).contains(px)), "{a:?} is outside");
            let overlaps = |b: &Box4| a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
            assert!(!boxes[n + 1..].iter().any(overlaps), "{a:?} lies on another");
            assert!(!overlaps(&[kept.0, kept.1, kept.0, kept.1]), "{a:?} lies on what is to stay free");
        }
        // The first has the choice: to the right of its point and above it, as near as it may be.
        assert_eq!(places[0], Some((points[0].0 + away_px + 2.0, points[0].1 - away_px - 4.0)));
    }

    #[test]
    fn a_name_without_room_is_left_out() {
        let mut labels = Labels::new(40.0);
        assert_eq!(labels.place((20.0, 20.0), "a name that is too long", 12.0, 5.0), None);
    }
}
