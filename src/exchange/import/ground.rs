//! A map with the ways on it that were asked for: most variations of a scenario ask for the same ones.

use core::ops::Deref;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use avastra_base::geometry::Path;
use avastra_road::{LanePlace, RoadMap, Route};

/// A place on a lane as a key: the lane, and its station in bits.
type Place = (usize, u64);

/// The results by key; an error says why nothing was found.
pub type Known<K, T> = RefCell<BTreeMap<K, Result<Rc<T>, String>>>;

/// A map that remembers.
#[derive(Debug)]
pub struct Ground {
    map: RoadMap,
    routes: Known<[Place; 2], Route>,
    ways: Known<Vec<Place>, Path>,
}

impl Deref for Ground {
    type Target = RoadMap;

    fn deref(&self) -> &RoadMap {
        &self.map
    }
}

impl Ground {
    pub fn new(map: RoadMap) -> Ground {
        Ground { map, routes: RefCell::default(), ways: RefCell::default() }
    }

    /// The route from one place to another.
    ///
    /// # Errors
    /// Why there is none.
    pub fn route(&self, from: LanePlace, to: LanePlace) -> Result<Rc<Route>, String> {
        let find = || Route::find(&self.map, from, to).map_err(|error| error.to_string());
        once(&self.routes, [key(&from), key(&to)], find)
    }

    /// The way along lanes from place to place.
    ///
    /// # Errors
    /// Why there is none.
    pub fn way(&self, places: &[LanePlace]) -> Result<Rc<Path>, String> {
        let lay = || {
            let mut parts = Vec::new();
            for pair in places.windows(2) {
                let route = self.route(pair[0], pair[1])?;
                // Its path goes on behind the goal.
                parts.extend(route.path.part(0.0, route.goal_m));
            }
            Path::join(&parts).ok_or_else(|| "it has no length".to_owned())
        };
        once(&self.ways, places.iter().map(key).collect(), lay)
    }
}

fn key(place: &LanePlace) -> Place {
    (place.lane.0, place.station_m.to_bits())
}

/// The known result, or else the one that is found now and known from then on.
pub fn once<K: Ord, T>(
    known: &Known<K, T>,
    key: K,
    find: impl FnOnce() -> Result<T, String>,
) -> Result<Rc<T>, String> {
    if let Some(found) = known.borrow().get(&key) {
        return found.clone();
    }
    let found = find().map(Rc::new);
    known.borrow_mut().insert(key, found.clone());
    found
}
