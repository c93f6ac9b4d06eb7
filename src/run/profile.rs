//! Driving systems by name, with the profiles that runs, scenarios and policies record.

use crate::ads;
use crate::ads::{ModularConfig, Selected};
use crate::model::{Policy, Scenario};
use crate::sim::TrafficProfile;
use crate::syntax::listed;

use crate::run::settings::RunError;

/// The driving system under test where none is named.
pub const DEFAULT_ADS: &str = "modular";

/// The driving system of that name, with its default settings.
///
/// # Errors
/// If there is none.
pub fn driving_system(name: &str) -> Result<Selected, RunError> {
    ads::by_name(name).map(Selected::new).ok_or_else(|| {
        let known = listed(&ads::REGISTRY.iter().map(|entry| entry.name).collect::<Vec<_>>());
        RunError::Ads { name: name.to_owned(), known }
    })
}

/// Settings of a driving system, with a digest: a later version of avastra sees whether they still mean the same.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    pub digest: String,
    pub settings: ModularConfig,
}

impl Profile {
    pub fn new(settings: &ModularConfig) -> Profile {
        Profile { digest: settings.digest(), settings: *settings }
    }
}

/// How other vehicles drive, with a digest as in [`Profile`].
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrafficRecord {
    pub digest: String,
    pub settings: TrafficProfile,
}

impl TrafficRecord {
    /// What a run records of a traffic profile: nothing of the default.
    pub fn new(traffic: &TrafficProfile) -> Option<TrafficRecord> {
        let is_default = *traffic == TrafficProfile::default();
        (!is_default).then(|| TrafficRecord { digest: traffic.digest(), settings: *traffic })
    }
}

/// The traffic profile that the settings of a run or a training record; without a record the default.
///
/// # Errors
/// If its settings mean something else in this version.
pub(crate) fn traffic_of(record: Option<&TrafficRecord>) -> Result<TrafficProfile, RunError> {
    match record {
        None => Ok(TrafficProfile::default()),
        Some(record) if record.settings.digest() != record.digest => {
            Err(RunError::TrafficDigest { what: "the run".to_owned() })
        }
        Some(record) => Ok(record.settings),
    }
}

/// The traffic profile that a scenario was made with.
///
/// # Errors
/// If its settings do not exist any more or mean something else.
pub fn recorded_traffic(scenario: &Scenario) -> Result<TrafficProfile, RunError> {
    let origin = &scenario.origin;
    let traffic = match &origin.traffic {
        None => TrafficProfile::default(),
        Some(line) => TrafficProfile::from_yaml(line)
            .map_err(|error| RunError::Traffic { name: scenario.name.clone(), error })?,
    };
    match &origin.traffic_digest {
        Some(digest) if *digest != traffic.digest() => {
            Err(RunError::TrafficDigest { what: format!("`{}`", scenario.name) })
        }
        _ => Ok(traffic),
    }
}

/// The driving system that the settings of a run or a training name, with their profile if they have one.
///
/// # Errors
/// If there is none of that name, it has no settings, or they mean something else in this version.
pub(crate) fn under_test(ads: &str, profile: Option<&Profile>) -> Result<Selected, RunError> {
    let selected = driving_system(ads)?;
    match profile {
        None => Ok(selected),
        Some(profile) if profile.settings.digest() != profile.digest => {
            Err(RunError::ProfileDigest { what: "the run".to_owned(), ads: ads.to_owned() })
        }
        Some(profile) => Ok(selected.with_profile(profile.settings)?),
    }
}

/// The driving system that a scenario was made with, and its settings.
///
/// # Errors
/// If there is none of that name, or its settings do not exist any more or mean something else.
pub fn recorded(scenario: &Scenario) -> Result<Selected, RunError> {
    let origin = &scenario.origin;
    let ads = origin.ads.as_deref().unwrap_or(DEFAULT_ADS);
    selected(&scenario.name, ads, origin.profile.as_deref(), origin.profile_digest.as_deref())
}

/// The driving system to play with, and whether it is the one that the scenario records.
/// Without a name and a profile it is that one; without a name, its driving system with another profile.
///
/// # Errors
/// If there is no driving system of that name, or it has no profile.
pub fn selected_for(
    ads: Option<&str>,
    profile: Option<&ModularConfig>,
    scenario: &Scenario,
) -> Result<(Selected, bool), RunError> {
    if ads.is_none() && profile.is_none() {
        return Ok((recorded(scenario)?, true));
    }
    let recorded = scenario.origin.ads.as_deref().unwrap_or(DEFAULT_ADS);
    let selected = driving_system(ads.unwrap_or(recorded))?;
    let Some(profile) = profile else { return Ok((selected, false)) };
    let same = ads.is_none() && scenario.origin.profile_digest == Some(profile.digest());
    Ok((selected.with_profile(*profile)?, same))
}

/// The driving system that a policy was trained against, and its settings.
///
/// # Errors
/// As [`recorded`].
pub fn trained_against(policy: &Policy) -> Result<Selected, RunError> {
    let origin = &policy.origin;
    selected(&policy.name, &origin.ads, origin.profile.as_deref(), origin.profile_digest.as_deref())
}

/// A driving system as the file of this name records it.
fn selected(
    name: &str,
    ads: &str,
    profile: Option<&str>,
    profile_digest: Option<&str>,
) -> Result<Selected, RunError> {
    let mut ads = driving_system(ads)?;
    if let Some(line) = profile {
        let profile = ModularConfig::from_yaml(line)
            .map_err(|error| RunError::Profile { name: name.to_owned(), error })?;
        ads = ads.with_profile(profile)?;
    }
    let digest = ads.profile().map(ModularConfig::digest);
    match profile_digest {
        Some(recorded) if Some(recorded) != digest.as_deref() => {
            Err(RunError::ProfileDigest { what: format!("`{name}`"), ads: ads.name().to_owned() })
        }
        _ => Ok(ads),
    }
}
