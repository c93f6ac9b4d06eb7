//! Every driving system by name. A new one is one line here; the conformance tests run through it.

use std::sync::Arc;

use avastra_world::sim::Scene;

use super::blind::Blind;
use super::driver::Ads;
use super::frenet::Frenet;
use super::modular::{Modular, ModularConfig};
use super::reactive::Reactive;
use super::reference::{CarefulHuman, FuzzySafety, Idm, MinimalPerformance, Reference, Rss};

/// A driving system that can be asked for by name.
#[derive(Debug)]
pub struct Entry {
    pub name: &'static str,
    pub summary: &'static str,
    /// A fresh driver for one episode; the seed feeds its sensor errors.
    pub build: fn(scene: &Arc<Scene>, seed: u64) -> Box<dyn Ads>,
}

/// The driving system of that name.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    REGISTRY.iter().find(|entry| entry.name == name)
}

/// Every driving system of avastra.
pub const REGISTRY: &[Entry] = &[
    Entry {
        name: "modular",
        summary: "localisation, perception, prediction, planning and control after Apollo 7.0",
        build: |scene, seed| Box::new(Modular::new(scene, &ModularConfig::default(), seed, None)),
    },
    Entry {
        name: "frenet",
        summary: "plans by sampling in a Frenet frame (Werling), with the proposals and scores of PDM-Closed",
        build: |scene, _seed| Box::new(Frenet::new(scene)),
    },
    Entry {
        name: "reactive",
        summary: "reacts only: Stanley steering, adaptive cruise control, emergency braking, lane change assistant",
        build: |scene, _seed| Box::new(Reactive::new(scene)),
    },
    Entry {
        name: "idm",
        summary: "reference driver: perfect knowledge, intelligent driver model, lane following",
        build: |scene, _seed| Box::new(Idm::new(scene)),
    },
    Entry {
        name: "cc",
        summary: "reference driver: competent and careful human of UN R157, after JAMA",
        build: |scene, _seed| Box::new(Reference::new(scene, CarefulHuman { looks_far: scene.is_motorway })),
    },
    Entry {
        name: "fsm",
        summary: "reference driver: fuzzy safety model of UN R157",
        build: |scene, _seed| Box::new(Reference::new(scene, FuzzySafety)),
    },
    Entry {
        name: "rss",
        summary: "reference driver: responsibility-sensitive safety",
        build: |scene, _seed| Box::new(Reference::new(scene, Rss::default())),
    },
    Entry {
        name: "r157",
        summary: "reference driver: the least that UN R157 demands",
        build: |scene, _seed| Box::new(Reference::new(scene, MinimalPerformance)),
    },
    Entry {
        name: BLIND,
        summary: "keeps its lane and speed and sees nothing: what it does not hit is no test",
        build: |scene, _seed| Box::new(Blind::new(scene)),
    },
];

/// The one that sees nothing.
const BLIND: &str = "blind";

/// Those that mind others.
pub fn seeing() -> impl Iterator<Item = &'static Entry> {
    REGISTRY.iter().filter(|entry| entry.name != BLIND)
}

#[cfg(test)]
mod tests {
    use avastra_lang::model::DRIVERS;

    use super::*;

    #[test]
    fn scenarios_know_every_driver_that_can_judge() {
        assert_eq!(seeing().map(|entry| entry.name).collect::<Vec<_>>(), DRIVERS);
    }
}
