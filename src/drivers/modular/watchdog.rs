//! Time: how late perception is under load, when a module hangs, and the degraded mode that follows.
//!
//! Apollo's control gives up a pose that is older than 0.2 s or a trajectory that is older than 2 s, and
//! brakes at 50 %; a limit for perception is ours. The vehicle drives on as soon as the module is back. Left
//! out: a hang has no cause but is planted, and no module is restarted or replaced.

use avastra_world::sim::{Control, DT_S};

use super::config::LatencyConfig;

#[derive(Debug, Clone)]
pub struct Watchdog {
    pub config: LatencyConfig,
    /// Age of the last pose, of the last look and of the last plan, s.
    localization_s: f64,
    pub perception_s: f64,
    pub trajectory_s: f64,
}

impl Watchdog {
    pub fn new(config: &LatencyConfig) -> Watchdog {
        Watchdog { config: *config, localization_s: 0.0, perception_s: 0.0, trajectory_s: 0.0 }
    }

    /// Whether localisation gives a pose at a moment of the drive; to be asked once a tick.
    pub fn localizes(&mut self, time_s: f64) -> bool {
        let works = !self.hangs(self.config.localization_hang_s, time_s);
        self.localization_s = if works { 0.0 } else { self.localization_s + DT_S };
        self.perception_s += DT_S;
        self.trajectory_s += DT_S;
        works
    }

    /// Whether perception takes a look in the frame that begins now. If it does, says how long ago its last
    /// one was, s.
    pub fn looks(&mut self, time_s: f64) -> Option<f64> {
        let works = !self.hangs(self.config.perception_hang_s, time_s);
        works.then(|| core::mem::take(&mut self.perception_s))
    }

    /// Whether a plan is made in the frame that begins now. If it is, gives the age of the last one, s.
    pub fn plans(&mut self, time_s: f64) -> Option<f64> {
        let works = !self.hangs(self.config.planning_hang_s, time_s);
        works.then(|| core::mem::take(&mut self.trajectory_s))
    }

    /// Whether something is too old to drive by.
    pub fn is_degraded(&self) -> bool {
        let config = &self.config;
        config.watchdog
            && (self.localization_s > config.localization_s_max + 1e-9
                || self.perception_s > config.perception_s_max + 1e-9
                || self.trajectory_s > config.trajectory_s_max + 1e-9)
    }

    /// The command of the degraded mode, which brakes no less than the one given.
    pub fn brake(&self, control: Control) -> Control {
        Control { throttle_pct: 0.0, brake_pct: control.brake_pct.max(self.config.brake_pct), ..control }
    }

    fn hangs(&self, hang_s: f64, time_s: f64) -> bool {
        let every_s = self.config.hang_every_s;
        // Times are sums of ticks: the least bit must not decide.
        hang_s > 0.0 && time_s >= every_s && (time_s + 1e-6) % every_s < hang_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn load_makes_late_beyond_the_budget() {
        let default = LatencyConfig::default();
        let counts = [0, 12, 16, 17, 22, 32, 500];
        assert_eq!(counts.map(|count| default.load_frames(count)), [0, 0, 0, 1, 1, 2, 5]);
    }

    /// When the degraded mode holds during a drive of 20 s, as the number of ticks and the first of them.
    fn degraded(config: LatencyConfig) -> (u32, Option<u32>) {
        let mut watchdog = Watchdog::new(&config);
        let (mut ticks, mut first) = (0, None);
        for tick in 0..1000_u32 {
            let time_s = f64::from(tick) * DT_S;
            watchdog.localizes(time_s);
            if tick % 5 == 0 {
                watchdog.looks(time_s);
                watchdog.plans(time_s);
            }
            if watchdog.is_degraded() {
                ticks += 1;
                first = first.or(Some(tick));
            }
        }
        (ticks, first)
    }

    #[test]
    fn what_hangs_is_noticed_at_its_own_limit_and_until_it_is_back() {
        let default = LatencyConfig::default();
        assert_eq!(degraded(default), (0, None));
        // Hangs begin at 10 s; the last look before was at 9.9 s.
        let (ticks, first) = degraded(LatencyConfig { perception_hang_s: 1.5, ..default });
        assert!((520..=522).contains(&first.unwrap()) && (53..=56).contains(&ticks), "{ticks} {first:?}");
        let (ticks, first) = degraded(LatencyConfig { planning_hang_s: 3.0, ..default });
        assert!((595..=597).contains(&first.unwrap()) && (53..=56).contains(&ticks), "{ticks} {first:?}");
        let (ticks, first) = degraded(LatencyConfig { localization_hang_s: 0.5, ..default });
        assert!((509..=511).contains(&first.unwrap()) && (13..=16).contains(&ticks), "{ticks} {first:?}");
        let unwatched = LatencyConfig { perception_hang_s: 1.5, watchdog: false, ..default };
        assert_eq!(degraded(unwatched), (0, None));
    }
}
