//! A driving system as it is chosen for a run: by name, and with its settings.

use std::sync::Arc;

use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_world::sim::Scene;

use super::altered::{Alteration, Altered};
use super::driver::Ads;
use super::external::{External, Program};
use super::handover::Handover;
use super::modular::{Foresight, Modular, ModularConfig};
use super::registry::Entry;

/// Name of every driving system outside this program.
pub const EXTERNAL: &str = "external";

/// A driving system and, if it is `modular`, its profile.
#[derive(Debug, Clone)]
pub struct Selected {
    kind: Kind,
    profile: Option<ModularConfig>,
    foresight: Option<Arc<Foresight>>,
    /// The number of other errors than those of the episode's seed.
    noise: Option<u32>,
    /// What it is told, or what becomes of its commands, is changed from a moment on, s; the first nearest to it.
    alterations: Vec<(Alteration, f64)>,
    /// The driving system that takes over, and when, s.
    successor: Option<(Box<Selected>, f64)>,
}

#[derive(Debug, Clone)]
enum Kind {
    Ours(&'static Entry),
    External(Arc<Program>),
}

/// A profile for a driving system that has no settings.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{ads}` has no settings: only `modular` takes a profile")]
pub struct NoSettings {
    pub ads: String,
}

impl Selected {
    /// The driving system with its default settings.
    pub fn new(entry: &'static Entry) -> Selected {
        let profile = (entry.name == MODULAR).then(ModularConfig::default);
        Selected {
            kind: Kind::Ours(entry),
            profile,
            foresight: None,
            noise: None,
            alterations: Vec::new(),
            successor: None,
        }
    }

    /// A driving system outside this program.
    pub fn external(program: Arc<Program>) -> Selected {
        let kind = Kind::External(program);
        Selected {
            kind,
            profile: None,
            foresight: None,
            noise: None,
            alterations: Vec::new(),
            successor: None,
        }
    }

    /// With a profile.
    ///
    /// # Errors
    /// If it is not `modular`.
    pub fn with_profile(self, profile: ModularConfig) -> Result<Selected, NoSettings> {
        if self.profile.is_none() {
            return Err(NoSettings { ads: self.name().to_owned() });
        }
        Ok(Selected { profile: Some(profile), ..self })
    }

    /// With the recorded future of others, which a perfect prediction uses.
    pub fn with_foresight(self, foresight: Arc<Foresight>) -> Selected {
        Selected { foresight: Some(foresight), ..self }
    }

    /// With other errors of its sensors in the same episode: a number for each.
    pub fn with_other_noise(self, number: u32) -> Selected {
        Selected { noise: Some(number), ..self }
    }

    /// Behind a change, from a moment of the episode on, s; outside of those that it has already.
    #[must_use]
    pub fn altered(mut self, alteration: Alteration, from_s: f64) -> Selected {
        self.alterations.push((alteration, from_s));
        self
    }

    /// Drives up to a moment of the episode, s; from there on `successor` drives, which has watched until then.
    pub fn until(self, at_s: f64, successor: Selected) -> Selected {
        Selected { successor: Some((Box::new(successor), at_s)), ..self }
    }

    pub fn name(&self) -> &'static str {
        match &self.kind {
            Kind::Ours(entry) => entry.name,
            Kind::External(_) => EXTERNAL,
        }
    }

    /// Its name for people: what one outside this program calls itself.
    pub fn title(&self) -> String {
        self.program().map_or_else(|| self.name().to_owned(), |program| program.attached().name())
    }

    /// The driving system outside this program, if it is one.
    pub fn program(&self) -> Option<&Arc<Program>> {
        match &self.kind {
            Kind::Ours(_) => None,
            Kind::External(program) => Some(program),
        }
    }

    /// Its settings, if it has any.
    pub fn profile(&self) -> Option<&ModularConfig> {
        self.profile.as_ref()
    }

    /// A fresh driver for one episode.
    pub fn build(&self, scene: &Arc<Scene>, seed: u64) -> Box<dyn Ads> {
        // The seed of its sensor errors.
        let own_seed =
            self.noise.map_or(seed, |number| rng::child_seed(seed, Stream::Noise, u64::from(number)));
        let first: Box<dyn Ads> = match (&self.kind, &self.profile) {
            (_, Some(profile)) => Box::new(Modular::new(scene, profile, own_seed, self.foresight.clone())),
            (Kind::Ours(entry), None) => (entry.build)(scene, own_seed),
            (Kind::External(program), None) => {
                let mut external = External::new(program, scene, own_seed);
                for (alteration, from_s) in &self.alterations {
                    external.mend(*alteration, *from_s);
                }
                Box::new(external)
            }
        };
        let first = self
            .alterations
            .iter()
            .fold(first, |ads, (alteration, from_s)| Box::new(Altered::new(ads, *alteration, *from_s)));
        match &self.successor {
            Some((second, at_s)) => Box::new(Handover::new(first, second.build(scene, seed), *at_s)),
            None => first,
        }
    }
}

/// Name of the driving system that has settings.
const MODULAR: &str = "modular";
