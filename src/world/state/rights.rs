//! The memory of a road user and the ego vehicle, as far as priority depends on it.

use avastra_base::geometry::Vec2;
use avastra_lang::model::vocabulary::Priority;
use avastra_road::LaneIndex;

use crate::state::passed::Passed;
use crate::state::ruling::{Rule, Ruling};
use crate::state::time::DT_S;
use crate::state::trace::{Trace, Traced, traced};

/// A ruling holds for this long after the two have left each other's way, s. Ours: outlines that touch behind a
/// junction do so because of what happened in it.
const HOLDS_S: f64 = 2.0;

/// The memory of a road user and the ego vehicle, as far as priority depends on it.
#[derive(Debug, Clone, Default)]
pub struct Rights {
    /// The lines that the road user passed last.
    pub passed: Passed,
    /// Whether it and the ego vehicle are in one lane, or it is a pedestrian in the ego vehicle's way; `None` before
    /// the first look.
    pub shares: Option<bool>,
    pub meeting: Option<Meeting>,
    /// The priority if it is a wreck in the ego vehicle's way, and since when, s; `None` if it is not.
    pub wreck: Option<(Priority, f64)>,
    /// Whether it came into the ego vehicle's way, or the ego vehicle into its, and left room.
    pub left_room: bool,
    /// Where it has stood since a moment at which the ego vehicle saw it and could brake gently for it.
    pub foreseen: Option<Foreseen>,
    /// Where a pedestrian was last looked for on the carriageway, and whether it was there: most stand and wait.
    pub on_road: Option<(Vec2, bool)>,
}

impl Rights {
    /// The priority, as long as the ruling on the two holds.
    pub fn now(&self, tick: u64) -> Priority {
        let wreck = self.wreck.map(|(priority, _)| priority);
        wreck.or(self.held(tick).map(|ruling| ruling.priority)).unwrap_or(Priority::None)
    }

    /// The ruling on the two, as long as it holds.
    pub fn held(&self, tick: u64) -> Option<Ruling> {
        self.meeting.filter(|meeting| meeting.holds(tick)).map(|meeting| meeting.ruling)
    }
}

/// The road user or the ego vehicle came into the other's way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    pub place: Place,
    pub ruling: Ruling,
    /// Last tick in which they were in each other's way.
    pub tick: u64,
    /// Whether the first of the two, which may clear the junction, waits beside the other's way.
    pub waits: bool,
    /// When the one behind could have come to rest by braking gently, s since the episode began; never in a junction.
    pub rests_s: f64,
}

impl Meeting {
    pub fn new(place: Place, ruling: Ruling, tick: u64) -> Meeting {
        Meeting { place, ruling, tick, waits: false, rests_s: f64::INFINITY }
    }

    /// Whether the two were in each other's way a short time ago.
    pub fn holds(&self, tick: u64) -> bool {
        (tick - self.tick) as f64 * DT_S <= HOLDS_S
    }

    /// Whether the first of the two left the other room, and may clear the junction.
    pub fn is_clearing(&self) -> bool {
        self.ruling.rule == Rule::Clearing
    }
}

/// A vehicle that the ego vehicle saw standing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foreseen {
    pub at: Vec2,
    /// Whether it stood across the strip that the ego vehicle drives on.
    pub blocks: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// In a junction: the lanes of the ego vehicle and of the road user.
    Area(LaneIndex, LaneIndex),
    /// In a lane, or on foot on the carriageway.
    Lane,
}

traced! {
    // `on_road` follows from the pedestrian's position.
    Rights { passed, shares, meeting, wreck, left_room, foreseen } but { on_road };
    // Whether a vehicle waits, and how long it rests, follow from what was traced before.
    Meeting { place, ruling, tick } but { waits, rests_s };
    // So do the rule and its moments.
    Ruling { priority } but { rule, mover, time_s };
    Foreseen { at, blocks };
}

impl Traced for Place {
    fn trace(&self, trace: &mut Trace) {
        match self {
            Place::Area(ego, other) => (*ego, *other).trace(trace),
            Place::Lane => trace.word(u64::MAX),
        }
    }
}
