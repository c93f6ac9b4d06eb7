//! Profiles of driving systems as runs and scenarios record them.

use crate::ads::{ModularConfig, Selected};
use crate::model::{Policy, Scenario};

use crate::run::arena::{DEFAULT_ADS, driving_system};
use crate::run::play::RunError;

/// Settings of a driving system, and a digest that tells whether they still mean the same.
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

/// The driving system that a scenario was made with, and its settings.
///
/// # Errors
/// If there is none of that name, or its settings do not exist any more or mean something else.
pub fn recorded(scenario: &Scenario) -> Result<Selected, RunError> {
    let origin = &scenario.origin;
    let ads = origin.ads.as_deref().unwrap_or(DEFAULT_ADS);
    selected(&scenario.name, ads, origin.profile.as_deref(), origin.profile_digest.as_deref())
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
