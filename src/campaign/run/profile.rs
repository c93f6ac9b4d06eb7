//! Driving systems by name, with the profiles that runs, scenarios and policies record.

use std::sync::Arc;

use avastra_drivers as ads;
use avastra_drivers::external;
use avastra_drivers::external::{Attached, ExternalSettings, Program};
use avastra_drivers::{EXTERNAL, ModularConfig, Selected};
use avastra_lang::model::{Policy, Scenario};
use avastra_lang::syntax::listed;
use avastra_world::sim::TrafficProfile;

use crate::run::settings::RunError;

/// The driving system under test where none is named.
pub const DEFAULT_ADS: &str = "modular";

/// The driving system of that name, with its default settings.
///
/// # Errors
/// If there is none.
pub fn driving_system(name: &str) -> Result<Selected, RunError> {
    if name == EXTERNAL {
        return Err(RunError::ExternalUnnamed);
    }
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
    /// A run's record of a traffic profile: `None` for the default.
    pub fn new(traffic: &TrafficProfile) -> Option<TrafficRecord> {
        let is_default = *traffic == TrafficProfile::default();
        (!is_default).then(|| TrafficRecord { digest: traffic.digest(), settings: *traffic })
    }

    /// The name of the shipped profile, or what an own one changes, in one line.
    pub fn in_words(&self) -> String {
        self.settings.shipped_as().map_or_else(|| self.settings.to_line(), str::to_owned)
    }
}

/// The traffic profile that the settings of a run or a training record; without a record the default.
///
/// # Errors
/// If its settings mean something else in this version.
pub(super) fn traffic_of(record: Option<&TrafficRecord>) -> Result<TrafficProfile, RunError> {
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

/// The driving system that the settings of a run or a training name, with their profile if they have one. An external
/// one is started once, to see that it can be and is still the same, unless it is only known from its record.
///
/// # Errors
/// If there is none of that name, it has no settings, or they mean something else in this version. If an external system
/// cannot be started, or has another name, version or kind of answer.
pub(super) fn under_test(
    ads: &str,
    profile: Option<&Profile>,
    external: Option<&Attached>,
) -> Result<Selected, RunError> {
    if let Some(begun) = external {
        if begun.is_recorded {
            return Ok(Selected::external(Program::recorded(begun.clone(), Vec::new())));
        }
        let program = started(&begun.settings)?;
        let found = program.attached();
        if begun.identity.is_some() && begun.identity != found.identity {
            return Err(RunError::OtherProgram { begun: begun.name(), found: found.name() });
        }
        return Ok(Selected::external(program));
    }
    let selected = driving_system(ads)?;
    match profile {
        None => Ok(selected),
        Some(profile) if profile.settings.digest() != profile.digest => {
            Err(RunError::ProfileDigest { what: "the run".to_owned(), ads: ads.to_owned() })
        }
        Some(profile) => Ok(selected.with_profile(profile.settings)?),
    }
}

/// An external driving system that was seen to start.
///
/// # Errors
/// Why it does not.
pub fn started(settings: &ExternalSettings) -> Result<Arc<Program>, RunError> {
    let program = Program::new(settings.clone());
    program.start().map_err(|failure| RunError::External(Box::new(failure)))?;
    Ok(program)
}

/// The driving system that a scenario was made with, and its settings. An external one is known by its recorded answers
/// alone: no program that a file names is started.
///
/// # Errors
/// If there is none of that name, or its settings do not exist any more or mean something else.
pub fn recorded(scenario: &Scenario) -> Result<Selected, RunError> {
    let origin = &scenario.origin;
    let ads = origin.ads.as_deref().unwrap_or(DEFAULT_ADS);
    if ads == EXTERNAL {
        let attached = attached(scenario)?;
        let broken = |error| RunError::Answers { name: scenario.name.clone(), error };
        let Some(text) = origin.recorded_answers.as_deref() else {
            return Err(RunError::NoAnswers { name: scenario.name.clone(), ads: attached.name() });
        };
        let answers = external::from_text(text, origin.answers.as_deref()).map_err(broken)?;
        return Ok(Selected::external(Program::recorded(attached, answers)));
    }
    selected(&scenario.name, ads, origin.profile.as_deref(), origin.profile_digest.as_deref())
}

/// The name of the driving system with which a scenario was found; for an external one its name without the version, which
/// is meant to change.
pub fn found_with(scenario: &Scenario) -> String {
    let ads = scenario.origin.ads.as_deref().unwrap_or(DEFAULT_ADS);
    let attached = || attached(scenario).ok();
    match ads {
        EXTERNAL => attached().map_or_else(|| ads.to_owned(), |attached| attached.title()),
        _ => ads.to_owned(),
    }
}

/// The external driving system that a scenario names.
fn attached(scenario: &Scenario) -> Result<Attached, RunError> {
    let line = scenario.origin.profile.as_deref().unwrap_or_default();
    Attached::from_line(line).map_err(|reason| RunError::Attached { name: scenario.name.clone(), reason })
}

/// The driving system for playing scenarios, as a command line states it.
#[derive(Debug, Default, Clone)]
pub struct Asked {
    pub ads: Option<String>,
    pub profile: Option<ModularConfig>,
    /// An external one, which was started.
    pub external: Option<Arc<Program>>,
}

impl Asked {
    /// Whether nothing is asked: each scenario is played with the driving system that it records.
    pub fn is_nothing(&self) -> bool {
        self.ads.is_none() && self.profile.is_none() && self.external.is_none()
    }

    /// The driving system to play a scenario with, and whether it is the one that the scenario records. If nothing is
    /// asked, it is that one; a profile is one of `modular`, whatever drove before.
    ///
    /// # Errors
    /// If there is no driving system of that name.
    pub fn selected_for(&self, scenario: &Scenario) -> Result<(Selected, bool), RunError> {
        let Asked { ads, profile, external } = self;
        if let Some(program) = external {
            let recorded = scenario.origin.profile_digest.as_deref();
            let same = scenario.origin.ads.as_deref() == Some(EXTERNAL)
                && recorded == Some(program.attached().digest().as_str());
            return Ok((Selected::external(Arc::clone(program)), same));
        }
        if let Some(profile) = profile {
            let same = scenario.origin.profile_digest == Some(profile.digest());
            return Ok((driving_system(DEFAULT_ADS)?.with_profile(*profile)?, same));
        }
        match ads {
            Some(name) => Ok((driving_system(name)?, false)),
            None => Ok((recorded(scenario)?, true)),
        }
    }
}

/// The driving system that a policy was trained against, and its settings.
///
/// # Errors
/// As [`recorded`].
pub fn trained_against(policy: &Policy) -> Result<Selected, RunError> {
    let origin = &policy.origin;
    if origin.ads == EXTERNAL {
        return Err(RunError::TrainedExternal { name: policy.name.clone() });
    }
    selected(&policy.name, &origin.ads, origin.profile.as_deref(), origin.profile_digest.as_deref())
}

/// The traffic that a policy was trained in.
///
/// # Errors
/// If it is no profile of this version.
pub fn trained_in(policy: &Policy) -> Result<TrafficProfile, RunError> {
    let Some(traffic) = &policy.origin.traffic else { return Ok(TrafficProfile::default()) };
    let profile = TrafficProfile::shipped(traffic).or_else(|_| TrafficProfile::from_yaml(traffic));
    profile.map_err(|error| RunError::Traffic { name: policy.name.clone(), error })
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
