//! Traffic signals: each junction runs a fixed cycle over its groups.
//!
//! A group is green for 12 s and yellow for 3 s, then all are red for 2 s and the next group follows. In towns yellow
//! of 3 to 4 s and all-red of 1 to 2 s are usual; the green is ours. Where so many groups follow each other that the
//! cycle would last longer than two minutes, the greens are shorter, down to 5 s. A road may say other times. Counted
//! in ticks, so that the colour of any moment is exact. No vehicle detection, no pedestrian lights.

use std::sync::Arc;

use avastra_lang::model::SignalProgram;
use avastra_lang::model::vocabulary::LightColour;
use avastra_road::RoadMap;

use super::sensed::SignalColour;
use super::time::{DT_S, ticks};
use super::trace::traced;

const GREEN_S: f64 = 12.0;
const YELLOW_S: f64 = 3.0;
const ALL_RED_S: f64 = 2.0;

/// A longer cycle than 120 s is bad practice everywhere; the shortest green is a usual minimum.
const CYCLE_S_MAX: f64 = 120.0;
const GREEN_S_MIN: f64 = 5.0;

/// How long what is shown, in ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Program {
    /// Without it as long as so many groups allow.
    green: Option<u64>,
    yellow: u64,
    all_red: u64,
}

impl Program {
    fn of(written: SignalProgram) -> Program {
        Program {
            green: written.green_s.map(ticks),
            yellow: ticks(written.yellow_s.unwrap_or(YELLOW_S)),
            all_red: ticks(written.all_red_s.unwrap_or(ALL_RED_S)),
        }
    }

    /// How long each of some groups is green.
    fn green(&self, groups: u64) -> u64 {
        let left = (ticks(CYCLE_S_MAX) / groups).saturating_sub(self.yellow + self.all_red);
        self.green.unwrap_or_else(|| left.clamp(ticks(GREEN_S_MIN), ticks(GREEN_S)))
    }
}

/// Time after which every cycle of up to seven groups begins anew, s: 720 720 is divisible by 1, 2, … 7. (Beyond
/// it a phase is only kept within bounds.)
const REPEAT_S: f64 = 720_720.0 * (GREEN_S + YELLOW_S + ALL_RED_S);

/// Where in its cycle every signal stands at tick 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SignalClock {
    offset_ticks: i64,
    program: Program,
}

/// The colour of every signal, and until when it shows it.
#[derive(Debug, Clone)]
pub(crate) struct Colours {
    /// By index in `RoadMap::signals`.
    pub now: Arc<[SignalColour]>,
    /// The tick in which one of them changes.
    until: u64,
}

impl Colours {
    pub fn at(clock: &SignalClock, map: &RoadMap, tick: u64) -> Colours {
        let all = 0..map.signals.len();
        let left = all.clone().map(|signal| clock.around(map, signal, tick).1).min();
        Colours {
            now: all.map(|signal| clock.colour(map, signal, tick)).collect(),
            until: left.map_or(u64::MAX, |left| tick + left),
        }
    }

    /// Brings it up to date in a tick. Nothing is worked out before one of them changes.
    pub fn pass(&mut self, clock: &SignalClock, map: &RoadMap, tick: u64) {
        if tick >= self.until {
            *self = Colours::at(clock, map, tick);
        }
    }
}

/// The cycle of a signal: first it is green, then yellow, then red.
struct Cycle {
    /// How far it is, in ticks.
    at: u64,
    /// How long it is green, until when it is yellow, and how long all of it is, in ticks.
    green: u64,
    yellow_ends: u64,
    all: u64,
}

impl SignalClock {
    /// A clock that is `phase_s` into the cycle; a phase that is negative or not finite counts as 0.
    pub fn new(phase_s: f64, program: SignalProgram) -> SignalClock {
        let offset_ticks = (phase_s.max(0.0) % REPEAT_S / DT_S + 0.5) as i64;
        SignalClock { offset_ticks, program: Program::of(program) }
    }

    /// Colour of a signal (an index in `RoadMap::signals`) at a tick.
    pub fn colour(&self, map: &RoadMap, signal: usize, tick: u64) -> SignalColour {
        let Cycle { at, green, yellow_ends, .. } = self.cycle(map, signal, tick);
        match at {
            at if at < green => SignalColour::Green,
            at if at < yellow_ends => SignalColour::Yellow,
            _ => SignalColour::Red,
        }
    }

    /// For how many ticks a signal has had its colour at a tick, and after how many it has another one.
    pub fn around(&self, map: &RoadMap, signal: usize, tick: u64) -> (u64, u64) {
        let Cycle { at, green, yellow_ends, all } = self.cycle(map, signal, tick);
        match at {
            at if at < green => (at, green - at),
            at if at < yellow_ends => (at - green, yellow_ends - at),
            _ => (at - yellow_ends, all - at),
        }
    }

    /// From a tick on the signal shows a colour, as if that had begun then. The cycles of all others jump with it.
    pub fn jump(&mut self, map: &RoadMap, signal: usize, tick: u64, colour: LightColour) {
        let Cycle { at, green, yellow_ends, all } = self.cycle(map, signal, tick);
        let to = match colour {
            LightColour::Green => 0,
            LightColour::Yellow => green,
            LightColour::Red => yellow_ends,
        };
        self.offset_ticks += ((to + all - at) % all) as i64;
    }

    /// A signal that would have another colour at a tick keeps the one before that for a tick more, and all others with it.
    pub fn stay(&mut self, map: &RoadMap, signal: usize, tick: u64) {
        if self.around(map, signal, tick).0 == 0 {
            self.offset_ticks -= 1;
        }
    }

    fn cycle(&self, map: &RoadMap, signal: usize, tick: u64) -> Cycle {
        let signal = &map.signals[signal];
        // A light on its own (at a zebra crossing) alternates with an unseen group.
        let groups = signal.junction.map_or(2, |junction| map.junctions[junction].groups);
        let groups = (groups.max(signal.group + 1)) as u64;
        let Program { yellow, all_red, .. } = self.program;
        let green = self.program.green(groups);
        let slot = green + yellow + all_red;
        let all = groups * slot;
        let now = (tick as i64 + self.offset_ticks).rem_euclid(all as i64) as u64;
        let at = (now + all - signal.group as u64 * slot) % all;
        Cycle { at, green, yellow_ends: green + yellow, all }
    }
}

traced! {
    // No tick changes the program.
    SignalClock { offset_ticks => *offset_ticks as u64 } but { program };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::testing;
    use avastra_lang::model::vocabulary::Word;

    fn program() -> Program {
        Program::of(SignalProgram::default())
    }

    fn clock(phase_s: f64) -> SignalClock {
        SignalClock::new(phase_s, SignalProgram::default())
    }

    #[test]
    fn a_cycle_is_bounded() {
        let Program { yellow, all_red, .. } = program();
        let cycle_s = |groups: u64| (groups * (program().green(groups) + yellow + all_red)) as f64 * DT_S;
        let cycles_s = [1, 2, 7, 8, 12].map(cycle_s);
        for (cycle_s, expected_s) in cycles_s.iter().zip([17.0, 34.0, 119.0, 120.0, 120.0]) {
            assert!((cycle_s - expected_s).abs() < 0.2, "{cycles_s:?}");
        }
        assert_eq!(program().green(20), ticks(GREEN_S_MIN));
    }

    #[test]
    fn what_is_said_of_a_colour_s_time_is_so() {
        let map = testing::crossing().map.clone();
        let mut clock = clock(0.0);
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
        let clock = clock(0.0);
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
        assert_eq!(self::clock(17.0).colour(&map, 1, 0), Green);
        assert_eq!(self::clock(f64::MAX).offset_ticks, (f64::MAX % REPEAT_S / DT_S + 0.5) as i64);
        for odd_s in [-1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(self::clock(odd_s), self::clock(0.0));
        }
        assert_eq!(
            self::clock(1e300).colour(&map, 1, 1000),
            self::clock(1e300 % REPEAT_S).colour(&map, 1, 1000)
        );
    }
}
