//! Traffic signals: each junction runs a fixed cycle over its groups.
//!
//! A group is green for 12 s and yellow for 3 s, then all are red for 2 s and the next group follows
//! (yellow 3 to 4 s and all-red 1 to 2 s are usual in towns; the green is ours). Where so many groups
//! follow each other that the cycle would last longer than two minutes, the greens are shorter, down to
//! 5 s. Counted in ticks, so that the colour of any moment is exact. No vehicle detection, no pedestrian
//! lights.

use avastra_lang::model::vocabulary::LightColour;
use avastra_road::RoadMap;

use super::sense::SignalColour;
use super::trace::Trace;
use super::world::{DT_S, ticks};

const GREEN_S: f64 = 12.0;
const YELLOW_S: f64 = 3.0;
const ALL_RED_S: f64 = 2.0;

/// A longer cycle than 120 s is bad practice everywhere; the shortest green is a usual minimum.
const CYCLE_S_MAX: f64 = 120.0;
const GREEN_S_MIN: f64 = 5.0;

const GREEN_TICKS: u64 = ticks(GREEN_S);
const YELLOW_TICKS: u64 = ticks(YELLOW_S);
const CHANGE_TICKS: u64 = ticks(YELLOW_S) + ticks(ALL_RED_S);

/// How long each of some groups is green.
fn green_ticks(groups: u64) -> u64 {
    (ticks(CYCLE_S_MAX) / groups).saturating_sub(CHANGE_TICKS).clamp(ticks(GREEN_S_MIN), GREEN_TICKS)
}

/// Time after which every cycle of up to seven groups begins anew, s: 720 720 is divisible by 1, 2, … 7. (Beyond
/// it a phase is only kept within bounds.)
const REPEAT_S: f64 = 720_720.0 * (GREEN_S + YELLOW_S + ALL_RED_S);

/// Where in its cycle every signal stands at tick 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SignalClock {
    offset_ticks: u64,
}

/// The cycle of a signal: first it is green, then yellow, then red.
struct Cycle {
    /// How far it is, in ticks.
    at: u64,
    /// How long it is green, in ticks.
    green: u64,
    all: u64,
}

impl SignalClock {
    /// A clock that is `phase_s` into the cycle; a phase that is negative or not finite counts as 0.
    pub fn new(phase_s: f64) -> SignalClock {
        SignalClock { offset_ticks: (phase_s.max(0.0) % REPEAT_S / DT_S + 0.5) as u64 }
    }

    /// Colour of a signal (an index in `RoadMap::signals`) at a tick.
    pub fn colour(&self, map: &RoadMap, signal: usize, tick: u64) -> SignalColour {
        let Cycle { at, green, .. } = self.cycle(map, signal, tick);
        match at {
            at if at < green => SignalColour::Green,
            at if at < green + YELLOW_TICKS => SignalColour::Yellow,
            _ => SignalColour::Red,
        }
    }

    /// For how many ticks a signal has had its colour at a tick, and after how many it has another one.
    pub fn around(&self, map: &RoadMap, signal: usize, tick: u64) -> (u64, u64) {
        let Cycle { at, green, all } = self.cycle(map, signal, tick);
        let yellow_ends = green + YELLOW_TICKS;
        match at {
            at if at < green => (at, green - at),
            at if at < yellow_ends => (at - green, yellow_ends - at),
            _ => (at - yellow_ends, all - at),
        }
    }

    /// From a tick on the signal shows a colour, as if that had begun then. The cycles of all others jump with it.
    pub fn jump(&mut self, map: &RoadMap, signal: usize, tick: u64, colour: LightColour) {
        let Cycle { at, green, all } = self.cycle(map, signal, tick);
        let to = match colour {
            LightColour::Green => 0,
            LightColour::Yellow => green,
            LightColour::Red => green + YELLOW_TICKS,
        };
        self.offset_ticks = (self.offset_ticks + (to + all - at) % all) % ticks(REPEAT_S);
    }

    /// A signal that would have another colour at a tick keeps the one before that for a tick more, and all others with it.
    pub fn stay(&mut self, map: &RoadMap, signal: usize, tick: u64) {
        if self.around(map, signal, tick).0 == 0 {
            self.offset_ticks = self.offset_ticks.checked_sub(1).unwrap_or(ticks(REPEAT_S) - 1);
        }
    }

    fn cycle(&self, map: &RoadMap, signal: usize, tick: u64) -> Cycle {
        let signal = &map.signals[signal];
        // A light on its own (at a zebra crossing) alternates with an unseen group.
        let groups = signal.junction.map_or(2, |junction| map.junctions[junction].groups);
        let groups = (groups.max(signal.group + 1)) as u64;
        let green = green_ticks(groups);
        let slot = green + CHANGE_TICKS;
        let all = groups * slot;
        let now = (tick + self.offset_ticks) % all;
        Cycle { at: (now + all - signal.group as u64 * slot) % all, green, all }
    }

    pub fn trace(&self, trace: &mut Trace) {
        trace.word(self.offset_ticks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::testing;
    use avastra_lang::model::vocabulary::Word;

    #[test]
    fn a_cycle_is_bounded() {
        let cycle_s = |groups: u64| (groups * (green_ticks(groups) + CHANGE_TICKS)) as f64 * DT_S;
        let cycles_s = [1, 2, 7, 8, 12].map(cycle_s);
        for (cycle_s, expected_s) in cycles_s.iter().zip([17.0, 34.0, 119.0, 120.0, 120.0]) {
            assert!((cycle_s - expected_s).abs() < 0.2, "{cycles_s:?}");
        }
        assert_eq!(green_ticks(20), ticks(GREEN_S_MIN));
    }

    #[test]
    fn what_is_said_of_a_colour_s_time_is_so() {
        let map = testing::crossing().map.clone();
        let mut clock = SignalClock::new(0.0);
        for tick in (0..4000).step_by(7) {
            let (since, left) = clock.around(&map, 0, tick + 4000);
            let colour = |tick| clock.colour(&map, 0, tick + 4000);
            let now = colour(tick);
            assert!((tick - since.min(tick)..tick + left).all(|near| colour(near) == now), "{tick}");
            assert!(
                clock.colour(&map, 0, tick + 4000 - since - 1) != now && colour(tick + left) != now,
                "{tick}"
            );
        }
        for to in LightColour::ALL {
            clock.jump(&map, 0, 500, *to);
            assert_eq!(clock.colour(&map, 0, 500).name(), to.name().to_lowercase());
            assert_eq!(clock.around(&map, 0, 500).0, 0);
            clock.stay(&map, 0, 500);
            assert_ne!(clock.colour(&map, 0, 500).name(), to.name().to_lowercase());
        }
    }

    #[test]
    fn one_group_at_a_time() {
        let map = testing::crossing().map.clone();
        let clock = SignalClock::new(0.0);
        let colours =
            |time_s: f64| [clock.colour(&map, 0, ticks(time_s)), clock.colour(&map, 1, ticks(time_s))];
        use SignalColour::{Green, Red, Yellow};
        for (time_s, expected) in [
            (0.0, [Green, Red]),
            (11.98, [Green, Red]),
            (12.0, [Yellow, Red]),
            (15.0, [Red, Red]),
            (17.0, [Red, Green]),
            (29.0, [Red, Yellow]),
            (32.0, [Red, Red]),
            (34.0, [Green, Red]),
        ] {
            assert_eq!(colours(time_s), expected, "at {time_s} s");
        }
        assert_eq!(SignalClock::new(17.0).colour(&map, 1, 0), Green);
        assert_eq!(SignalClock::new(f64::MAX).offset_ticks, (f64::MAX % REPEAT_S / DT_S + 0.5) as u64);
        for odd_s in [-1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(SignalClock::new(odd_s), SignalClock::new(0.0));
        }
        assert_eq!(
            SignalClock::new(1e300).colour(&map, 1, 1000),
            SignalClock::new(1e300 % REPEAT_S).colour(&map, 1, 1000)
        );
    }
}
