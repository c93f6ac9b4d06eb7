//! Traffic profiles: how other vehicles drive, as settings that a run can change.
//!
//! The default, `scenarios/traffic/careful.yaml`, is how they drive unless a run says otherwise.
//! `scenarios/traffic/rightful.yaml` does not save an ego vehicle that breaks the rules.
//! `scenarios/traffic/released.yaml` has the behaviour of LGSVL's vehicles, as far as its published constants tell. No
//! profile changes signals, conflict areas among other vehicles, bodies or friction.

use avastra_lang::model::{LIMIT_PART_MAX, digest};
use avastra_lang::syntax::{listed, read_yaml};

section! {
    /// How other vehicles drive.
    pub struct TrafficProfile {
        /// Whether ambient vehicles yield to the ego vehicle at junctions. Commanded ones never do: see `behave::npc::manners`.
        yields_to_ego: bool = true;
        /// Whether ambient vehicles take their right of way before the ego vehicle. They then expect that it keeps the
        /// rules. For an ego vehicle that breaks them they brake only once it is where their ways cross. Ours.
        takes_right: bool = false;
        /// Ambient vehicles drive at least at this part of each lane's limit, in `[0.1, 1.5]`. Ours.
        limit_part_min: f64 = 0.8, 0.1..=LIMIT_PART_MAX;
        /// And at most at this part, in `[0.1, 1.5]`. Ours.
        limit_part_max: f64 = 1.0, 0.1..=LIMIT_PART_MAX;
        /// Whether drivers see only what three rays ahead of them meet, and stop at once inside a stop distance. LGSVL. Otherwise they look along their way and follow by the Intelligent Driver Model.
        rays: bool = false;
        /// Length of the ray from the middle of the front, m, in `[1, 100]`; those from its corners are half as long. LGSVL: 20.
        ray_m: f64 = 20.0, 1.0..=100.0;
        /// Stop distance at rest, m, in `[0, 50]`. LGSVL: 4.
        stop_m_min: f64 = 4.0, 0.0..=50.0;
        /// Stop distance of the gentlest vehicle at the limit, m, in `[0, 50]`. LGSVL: 12.
        stop_m: f64 = 12.0, 0.0..=50.0;
        /// The same on straight lanes through junctions and within 10 m before them, m, in `[0, 50]`. LGSVL: 20.
        stop_junction_m: f64 = 20.0, 0.0..=50.0;
        /// Part of a speed that is lost in a second, 1/s, in `[0.1, 20]`. Each step of aggression from 1 to 3 adds as
        /// much again. LGSVL: 2.
        stop_rate_ps: f64 = 2.0, 0.1..=20.0;
        /// Room in front and behind that drivers want before changing lanes, m, in `[0, 50]`. Ours.
        change_room_m: f64 = 2.0, 0.0..=50.0;
        /// And the time for which a gap that closes must last, s, in `[0, 10]`. Ours.
        change_time_s: f64 = 1.0, 0.0..=10.0;
        /// No change that makes another vehicle brake harder than this, magnitude, m/s², in `[0.5, 100]`. MOBIL (Kesting, Treiber and Helbing 2007), `b_safe`: 4.
        change_safe_mps2: f64 = 4.0, 0.5..=100.0;
        /// Highest lateral speed of a lane change, m/s, in `[0.2, 5]`: with which UN R157's careful driver reckons at a cut-in (0.72 m in 0.4 s).
        change_mps_max: f64 = 1.8, 0.2..=5.0;
        /// A lane change takes at least this long, s, in `[0.5, 20]`. Ours.
        change_s_min: f64 = 2.0, 0.5..=20.0;
        /// Whether instead of all this a driver changes lanes at once if a sphere half its width beside the corner of its front is empty. LGSVL.
        change_by_sphere: bool = false;
        /// Whether ambient vehicles change lanes for their own gain, by MOBIL. Otherwise they keep their lane.
        mobil: bool = true;
        /// MOBIL's politeness: what a gain of the followers counts against the own, in `[0, 1]`. Treiber's page of MOBIL: up to 0.5 is realistic.
        politeness: f64 = 0.3, 0.0..=1.0;
        /// Gain that a change must bring, m/s², in `[0, 5]`. MOBIL: 0.1; Treiber's page of it: 0.2.
        change_gain_mps2: f64 = 0.2, 0.0..=5.0;
        /// So much less gain for a change to the right, and more for one to the left, m/s², in `[0, 5]`. Ours: below the gain, so that on streets no vehicle changes for nothing; MOBIL has 0.3 for motorways.
        right_bias_mps2: f64 = 0.1, 0.0..=5.0;
        /// The oldest of ten commanded road users leaves for the next one even in sight. The published package.
        oldest_leaves_in_sight: bool = false;
        /// Time of day and weather may change again only after this time, s, in `[0, 600]`; 0 is at any step. The published package: five steps of 6 s.
        weather_rest_s: f64 = 0.0, 0.0..=600.0;
    }
}

/// The profiles that come with avastra: name and text.
const SHIPPED: [(&str, &str); 3] = [
    ("careful", include_str!("../traffic/careful.yaml")),
    ("rightful", include_str!("../traffic/rightful.yaml")),
    ("released", include_str!("../traffic/released.yaml")),
];

/// Why a traffic profile cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrafficError {
    #[error("no traffic profile `{name}`: there are {known}; a file needs its ending, `.yaml`")]
    Name { name: String, known: String },
    #[error("{reason}")]
    Yaml { reason: String },
    #[error("the profile is empty; write what differs from `scenarios/traffic/careful.yaml`, or `{{}}`")]
    Empty,
    #[error("`{key}` is {value}; write a value from {low} to {high}")]
    Range { key: &'static str, value: f64, low: f64, high: f64 },
    #[error("`limit_part_min` is {low}, above `limit_part_max`, which is {high}")]
    Limits { low: f64, high: f64 },
}

impl TrafficProfile {
    /// The profile of that name that comes with avastra.
    ///
    /// # Errors
    /// If there is none.
    pub fn shipped(name: &str) -> Result<TrafficProfile, TrafficError> {
        match SHIPPED.iter().find(|(shipped, _)| *shipped == name) {
            Some((_, text)) => TrafficProfile::from_yaml(text),
            None => {
                let known = listed(&TrafficProfile::shipped_names());
                Err(TrafficError::Name { name: name.to_owned(), known })
            }
        }
    }

    /// The names that [`TrafficProfile::shipped`] knows.
    pub fn shipped_names() -> Vec<&'static str> {
        SHIPPED.map(|(name, _)| name).to_vec()
    }

    /// The name under which it is shipped, if it is.
    pub fn shipped_as(&self) -> Option<&'static str> {
        let mut names = TrafficProfile::shipped_names().into_iter();
        names.find(|name| TrafficProfile::shipped(name).as_ref() == Ok(self))
    }

    /// Reads a profile; what it leaves out is as in the default.
    ///
    /// # Errors
    /// Text that is no YAML or says nothing, an unknown key, a value of the wrong type or out of its range.
    pub fn from_yaml(text: &str) -> Result<TrafficProfile, TrafficError> {
        let profile: Option<TrafficProfile> =
            read_yaml(text).map_err(|reason| TrafficError::Yaml { reason })?;
        let profile = profile.ok_or(TrafficError::Empty)?;
        profile.check()?;
        Ok(profile)
    }

    /// # Errors
    /// If a number is out of its range.
    fn check(&self) -> Result<(), TrafficError> {
        let numbers = serde_json::to_value(self).expect("a profile is plain data");
        for &(key, low, high) in TrafficProfile::RANGES {
            // NaN and infinity have no JSON.
            let value = numbers[key].as_f64().unwrap_or(f64::NAN);
            if !(low..=high).contains(&value) {
                return Err(TrafficError::Range { key, value, low, high });
            }
        }
        if self.limit_part_min > self.limit_part_max {
            return Err(TrafficError::Limits { low: self.limit_part_min, high: self.limit_part_max });
        }
        Ok(())
    }

    /// The differences from the default, in one line of YAML for [`TrafficProfile::from_yaml`].
    pub fn to_line(&self) -> String {
        let settings = |profile| serde_json::to_value(profile).expect("a profile is plain data");
        let (mut own, usual) = (settings(*self), settings(TrafficProfile::default()));
        own.as_object_mut().expect("a profile has fields").retain(|key, value| *value != usual[key.as_str()]);
        own.to_string()
    }

    /// Digest of all settings, `sha256:` and 64 digits.
    pub fn digest(&self) -> String {
        digest(serde_json::to_string(self).expect("a profile is plain data").as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_profiles_are_the_default_and_lgsvls() {
        let careful = TrafficProfile::shipped("careful").expect("it is sound");
        assert_eq!(careful, TrafficProfile::default());
        // The file names every setting.
        for key in serde_json::to_value(careful).expect("plain data").as_object().expect("an object").keys() {
            assert!(SHIPPED[0].1.contains(&format!("\n{key}: ")), "{key}");
        }
        let released = TrafficProfile::shipped("released").expect("it is sound");
        assert!(released.rays && released.change_by_sphere && !released.yields_to_ego && !released.mobil);
        assert_eq!(released.weather_rest_s, 30.0);
        assert_eq!(careful.to_line(), "{}");
        for profile in [careful, released] {
            assert_eq!(TrafficProfile::from_yaml(&profile.to_line()), Ok(profile));
        }
        assert_ne!(careful.digest(), released.digest());
    }

    /// Other mistakes are in `tests/it/traffic.rs`.
    #[test]
    fn mistakes_are_told() {
        let told = |text: &str| TrafficProfile::from_yaml(text).expect_err("it is wrong").to_string();
        assert!(told("rays: 3").contains("rays") || told("rays: 3").contains("bool"), "{}", told("rays: 3"));
        assert!(told("limit_part_min: 1.2").contains("above"));
        assert_eq!(TrafficProfile::from_yaml("{}"), Ok(TrafficProfile::default()));
    }
}
