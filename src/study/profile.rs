//! Profiles of driving systems as runs and scenarios record them.

use crate::ads::ModularConfig;
use crate::ads::Selected;
use crate::model::Scenario;

use super::arena::DEFAULT_ADS;
use super::arena::driving_system;
use super::run::RunError;

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
    let mut ads = driving_system(origin.ads.as_deref().unwrap_or(DEFAULT_ADS))?;
    if let Some(line) = &origin.profile {
        let profile = ModularConfig::from_yaml(line)
            .map_err(|error| RunError::Profile { scenario: scenario.name.clone(), error })?;
        ads = ads.with_profile(profile)?;
    }
    let digest = ads.profile().map(ModularConfig::digest);
    match &origin.profile_digest {
        Some(recorded) if Some(recorded) != digest.as_ref() => {
            Err(RunError::ProfileDigest { what: format!("`{}`", scenario.name), ads: ads.name().to_owned() })
        }
        _ => Ok(ads),
    }
}
