//! Which module of a driving system is at fault for a collision or a breach: the replays that show it.
//!
//! The ego vehicle drives as it did until the obstacle appears (before a breach, until 15 s before it). From then on the same system drives with one
//! module changed (`ads::Module`), which has watched from the start, so that the hazard is the same to the bit.
//! Other road users decide for themselves. The changes are:
//!
//! - Each module alone is made as in the baseline, and made free of errors. So are all of them together.
//! - Each documented weakness alone is switched off.
//! - The module's errors are left alone: all others are as in the baseline, or free of errors.
//! - Two modules are changed together, if no change alone prevents the collision, told apart from chance.
//!
//! A change that prevents the collision is played again with other sensor noise, and so is the noise alone, to tell the
//! change apart from chance. `evidence` draws the conclusions.
//!
//! Below, "collision" stands for the finding, also for a breach. Left out: errors from before the obstacle appeared.

use std::sync::Arc;

use crate::episode::{EpisodeLog, Setup};
use avastra_drivers::{Foresight, ModularConfig, Module};

use super::case::{Case, Fate, Found, play};
use super::evidence::{
    Chance, Comparison, Diagnosis, Evidence, ModuleFinding, PairFinding, WeaknessFinding, is_told_apart,
};
use super::measured::measure;

/// The collision is played with other noise until it has happened again this many times: enough to tell each of several
/// changes apart from chance.
const AGAIN: usize = 12;
/// Most replays with other noise: a collision that happens in a tenth of them can be explained.
const REPLAYS_MAX: u32 = 100;
/// If it happens again fewer times than this, no change can be told apart from chance, and none is tried.
pub(super) const AGAIN_MIN: usize = 6;

/// Why no cause can be found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{ads}` is not made of modules that could be at fault: only `modular` is, so `--causes` is for it alone; `diagnose` looks at any driving \
     system from outside"
)]
pub struct NoModules {
    pub ads: String,
}

/// The fate of a finding of a log if another profile of the driving system takes over.
///
/// # Errors
/// If the driving system has no modules.
pub fn fate(
    setup: &Setup,
    log: &EpisodeLog,
    found: Found,
    profile: &ModularConfig,
) -> Result<Fate, NoModules> {
    Ok(Inquiry::new(&Case::new(setup, log, found))?.fate(profile))
}

/// Finds the cause of a finding of a log that was played from `setup`.
///
/// # Errors
/// If the driving system has no modules.
pub fn diagnose(
    setup: &Setup,
    log: &EpisodeLog,
    found: Found,
    baseline: &ModularConfig,
) -> Result<Diagnosis, NoModules> {
    let case = Case::new(setup, log, found);
    Ok(Diagnosis::of(Inquiry::new(&case)?.evidence(found.noun(), baseline)))
}

/// The collision driven up to by its own driving system, and from then on by others.
pub(super) struct Inquiry<'a> {
    case: &'a Case<'a>,
    pub profile: ModularConfig,
    foresight: Arc<Foresight>,
    from_s: f64,
}

impl<'a> Inquiry<'a> {
    pub fn new(case: &'a Case<'a>) -> Result<Inquiry<'a>, NoModules> {
        let ads = &case.setup.ads;
        let profile = *ads.profile().ok_or_else(|| NoModules { ads: ads.title() })?;
        let (_, foresight) = play(case.setup, |moment| case.script.choose(moment));
        Ok(Inquiry { case, profile, foresight, from_s: case.begins_s() })
    }

    /// The fate of the collision if another profile takes over when its obstacle appears.
    pub fn fate(&self, profile: &ModularConfig) -> Fate {
        // The same settings make the same drive.
        if *profile == self.profile {
            return Fate::Same;
        }
        self.play(profile, None)
    }

    /// Whether the collision vanishes if a profile takes over with other sensor noise, which a number selects.
    pub fn vanishes(&self, profile: &ModularConfig, noise: u32) -> bool {
        self.play(profile, Some(noise)) == Fate::Vanished
    }

    fn play(&self, profile: &ModularConfig, noise: Option<u32>) -> Fate {
        let ads = self.case.setup.ads.clone();
        let successor =
            ads.clone().with_profile(*profile).expect("a driving system with a profile takes another");
        let successor = successor.with_foresight(self.foresight.clone());
        let successor = match noise {
            None => successor,
            Some(number) => successor.with_other_noise(number),
        };
        self.case.fate(&self.case.play(&ads.until(self.from_s, successor)))
    }

    fn evidence(&self, noun: &'static str, baseline: &ModularConfig) -> Evidence {
        let own = self.profile;
        let ideal = Module::ALL.into_iter().fold(own, |config, module| config.idealised(module));
        let mut evidence = Evidence {
            noun,
            modules: Module::ALL.into_iter().map(|module| self.finding(module, baseline)).collect(),
            baseline: (*baseline != own).then(|| self.fate(baseline)),
            ideal: self.fate(&ideal),
            weaknesses: self.weaknesses(),
            pairs: Vec::new(),
            chance: None,
            measured: measure(self.case, &own, baseline),
            from_s: self.from_s,
        };
        let differs = evidence.differs();
        let is_prevented = evidence.modules.iter().any(|found| found.vanishes(differs))
            || (!differs && evidence.weaknesses.iter().any(WeaknessFinding::vanishes));
        let mut unchanged = Vec::new();
        if is_prevented {
            unchanged = self.unchanged();
            evidence.chance = Some(Chance::of(&unchanged));
            if again(&unchanged) < AGAIN_MIN {
                return evidence;
            }
            self.tell_apart(&mut evidence, baseline, &unchanged);
            if evidence.is_told_apart() {
                return evidence;
            }
        }
        evidence.pairs = self.pairs(&evidence, baseline);
        let Some(first) = evidence.pairs.first().map(|pair| pair.modules) else { return evidence };
        if unchanged.is_empty() {
            unchanged = self.unchanged();
            evidence.chance = Some(Chance::of(&unchanged));
        }
        if again(&unchanged) >= AGAIN_MIN {
            let changed = first.into_iter().fold(own, |own, module| change(&own, module, baseline, differs));
            let tries = evidence.pairs.len();
            evidence.pairs[0].noise = Some(self.compared(&changed, &unchanged, tries));
        }
        evidence
    }

    /// The part of one module in the collision.
    fn finding(&self, module: Module, baseline: &ModularConfig) -> ModuleFinding {
        let own = self.profile;
        let restored = own.with_module_of(module, baseline);
        let differs = restored != own;
        let others = Module::ALL.into_iter().filter(|other| *other != module);
        let alone = if differs {
            baseline.with_module_of(module, &own)
        } else {
            others.fold(own, |config, other| config.idealised(other))
        };
        ModuleFinding {
            module,
            restored: differs.then(|| self.fate(&restored)),
            idealised: self.fate(&own.idealised(module)),
            alone: self.fate(&alone),
            noise: None,
            noise_alone: None,
            signs: Vec::new(),
        }
    }

    /// The collision without each documented weakness that is switched on.
    fn weaknesses(&self) -> Vec<WeaknessFinding> {
        let own = self.profile;
        let off = own.weaknesses.each_off().into_iter();
        off.map(|(weakness, weaknesses)| {
            let without = ModularConfig { weaknesses, ..own };
            // A weakness belongs to the module that takes it along.
            let owner = |module: &Module| own.with_module_of(*module, &without) != own;
            let module = Module::ALL.into_iter().find(owner).expect("each weakness has its module");
            WeaknessFinding { weakness, module, without: self.fate(&without), noise: None }
        })
        .collect()
    }

    /// Pairs of modules that prevent the collision together; pairs in which the errors of each module alone lead to it
    /// come first. If one module prevents it, though not told apart from chance, only such pairs are looked at, because
    /// any pair with that module may prevent it. If some modules differ from the baseline, only these are paired.
    fn pairs(&self, evidence: &Evidence, baseline: &ModularConfig) -> Vec<PairFinding> {
        if evidence.baseline.is_some_and(|fate| fate != Fate::Vanished) {
            return Vec::new();
        }
        let differs = evidence.differs();
        let asked: Vec<&ModuleFinding> =
            evidence.modules.iter().filter(|found| !differs || found.restored.is_some()).collect();
        let sufficient_min = if evidence.chance.is_some() { 2 } else { 0 };
        let mut found = Vec::new();
        for (index, first) in asked.iter().enumerate() {
            for second in &asked[index + 1..] {
                let sufficient = [first, second].iter().filter(|one| one.alone == Fate::Same).count();
                let both = [first.module, second.module];
                let changed = both
                    .into_iter()
                    .fold(self.profile, |own, module| change(&own, module, baseline, differs));
                if sufficient >= sufficient_min && self.fate(&changed) == Fate::Vanished {
                    found.push((sufficient, PairFinding { modules: both, noise: None }));
                }
            }
        }
        found.sort_by_key(|(sufficient, _)| core::cmp::Reverse(*sufficient));
        found.into_iter().map(|(_, pair)| pair).collect()
    }

    fn unchanged(&self) -> Vec<bool> {
        unchanged(|noise| self.vanishes(&self.profile, noise))
    }

    /// Plays the collision again with other noise and with each single change that prevents it.
    fn tell_apart(&self, evidence: &mut Evidence, baseline: &ModularConfig, unchanged: &[bool]) {
        let (own, differs) = (self.profile, evidence.differs());
        if !differs {
            let tries = evidence.weaknesses.iter().filter(|found| found.vanishes()).count();
            for (found, (_, weaknesses)) in evidence.weaknesses.iter_mut().zip(own.weaknesses.each_off()) {
                let without = ModularConfig { weaknesses, ..own };
                found.noise = found.vanishes().then(|| self.compared(&without, unchanged, tries));
            }
        }
        // A weakness says more than its module without any errors.
        if evidence.is_told_apart() {
            return;
        }
        let tries = evidence.modules.iter().filter(|found| found.vanishes(differs)).count();
        for found in evidence.modules.iter_mut().filter(|found| found.vanishes(differs)) {
            let changed = self.replayed(&change(&own, found.module, baseline, differs), unchanged.len());
            let both = unchanged.iter().copied().zip(changed.iter().copied());
            found.noise = Some(Comparison::of(both, tries));
            found.signs = changed.into_iter().map(u8::from).collect();
        }
        if differs && evidence.told_apart().count() > 1 {
            let modules = evidence.modules.iter_mut();
            for found in modules.filter(|found| is_told_apart(found.noise)) {
                let alone = baseline.with_module_of(found.module, &own);
                let vanished = self.replayed(&alone, unchanged.len());
                found.noise_alone = Some(vanished.iter().filter(|vanished| **vanished).count() as u32);
                for (signs, vanished) in found.signs.iter_mut().zip(vanished) {
                    *signs += u8::from(!vanished);
                }
            }
        }
    }

    /// Compares replays with a change to those with the same noise alone; `tries` is the number of changes that are compared.
    fn compared(&self, changed: &ModularConfig, unchanged: &[bool], tries: usize) -> Comparison {
        let changed = self.replayed(changed, unchanged.len());
        Comparison::of(unchanged.iter().copied().zip(changed), tries)
    }

    /// Whether the collision vanishes if a profile takes over, in each of so many replays with other noise.
    fn replayed(&self, profile: &ModularConfig, replays: usize) -> Vec<bool> {
        (1..=replays as u32).map(|noise| self.vanishes(profile, noise)).collect()
    }
}

/// Whether the collision vanishes in each replay with other noise and nothing else changed: until it has happened
/// [`AGAIN`] times again, but at most [`REPLAYS_MAX`]. When to end does not depend on what changes do.
pub(super) fn unchanged(vanishes: impl Fn(u32) -> bool) -> Vec<bool> {
    let mut vanished = Vec::new();
    for noise in 1..=REPLAYS_MAX {
        vanished.push(vanishes(noise));
        if again(&vanished) == AGAIN {
            break;
        }
    }
    vanished
}

/// The number of replays in which the collision happens again.
pub(super) fn again(vanished: &[bool]) -> usize {
    vanished.iter().filter(|vanished| !**vanished).count()
}

/// A profile with one module as in the baseline, if any module differs from it, or else without errors.
fn change(own: &ModularConfig, module: Module, baseline: &ModularConfig, differs: bool) -> ModularConfig {
    if differs { own.with_module_of(module, baseline) } else { own.idealised(module) }
}
