//! Which module of a driving system is at fault for a collision.
//!
//! The ego vehicle drives as it did until the obstacle appears. From then on the same system drives with
//! one module without its errors (`ads::Module`), which has watched from the start, so that the hazard
//! is the same to the bit; other road users decide for themselves. A module *suffices* if the collision
//! vanishes without its errors. If no module suffices alone, pairs are tried.
//!
//! Several modules may suffice: good brakes make up for bad eyes, and one crash does not tell which of the
//! two is at fault. A *baseline* says how good eyes and brakes should be: if the collision vanishes with a
//! module as the baseline has it, only such modules are candidates. Where several are left, these criteria
//! decide, in this order:
//!
//! 1. the errors of the module alone lead to the collision, all other modules being as in the baseline, or
//!    without errors (asked only if the collision vanishes with all modules so);
//! 2. the module prevents most of the collisions under small variations; if no variation leads to the
//!    collision, it was chance, and no module is named;
//! 3. the module has a documented weakness, and the collision vanishes without that weakness alone;
//! 4. the module comes first on the data's way.
//!
//! Left out: errors from before the obstacle appeared.

use std::sync::Arc;

use crate::ads::{Foresight, ModularConfig, Module, Selected};
use crate::episode::{EpisodeLog, Setup};

use super::crash::{Crash, Fate, play};
use super::variation::Variation;

/// Number of variations that are played where several modules suffice.
pub const VARIATIONS: u32 = 8;

/// The takeover is at most this long before the collision, s: longer than any reaction or braking, because
/// ambient traffic may have appeared long before.
const LOOK_BACK_S: f64 = 15.0;

/// Why no cause can be found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{ads}` is not made of modules that could be at fault: only `modular` is")]
pub struct NoModules {
    pub ads: String,
}

/// The cause of a collision, and what it was found by.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Diagnosis {
    /// The module at fault; two if only both together suffice; none if no two do.
    pub cause: Vec<Module>,
    pub modules: Vec<ModuleFinding>,
    /// The collision if no module has errors.
    pub ideal: Fate,
    /// The collision without each documented weakness that is switched on.
    pub weaknesses: Vec<WeaknessFinding>,
    /// How many of [`VARIATIONS`] small variations led to the collision. Played only to tell modules apart.
    pub varied_crashes: Option<u32>,
    /// Pairs that suffice, looked for if no module does alone.
    pub pairs: Vec<[Module; 2]>,
    /// When the other driving systems took over, s.
    pub from_s: f64,
}

/// What one module has to do with a collision.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ModuleFinding {
    pub module: Module,
    /// The collision with this module as the baseline has it; `None` if it is so already.
    pub restored: Option<Fate>,
    /// The collision with only this module without errors.
    pub idealised: Fate,
    /// The collision with the errors of this module alone: all others are as in the baseline, if this one
    /// differs from it, or else without errors.
    pub alone: Fate,
    /// Of the collisions under small variations, the share that vanishes with it restored, if that
    /// suffices, or else idealised. Played only to tell modules apart.
    pub prevented: Option<f64>,
}

/// A documented weakness, and the collision without it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct WeaknessFinding {
    pub weakness: &'static str,
    pub without: Fate,
}

/// What becomes of the nth collision of a log if another profile of the driving system takes over.
///
/// # Errors
/// If the driving system has no modules.
pub fn fate(
    setup: &Setup,
    log: &EpisodeLog,
    index: usize,
    profile: &ModularConfig,
) -> Result<Fate, NoModules> {
    Ok(Inquiry::new(&Crash::new(setup, log, index))?.fate(profile))
}

/// Finds the cause of the nth collision of a log that was played from `setup`.
///
/// # Errors
/// If the driving system has no modules.
pub fn diagnose(
    setup: &Setup,
    log: &EpisodeLog,
    index: usize,
    baseline: &ModularConfig,
) -> Result<Diagnosis, NoModules> {
    let crash = Crash::new(setup, log, index);
    let inquiry = Inquiry::new(&crash)?;
    let own = inquiry.profile;
    let mut modules: Vec<ModuleFinding> = Vec::new();
    for module in Module::ALL {
        let others = Module::ALL.into_iter().filter(|other| *other != module);
        let alone = others.fold(own, |config, other| config.idealised(other));
        let restored = own.with_module_of(module, baseline);
        let differs = restored != own;
        modules.push(ModuleFinding {
            module,
            restored: differs.then(|| inquiry.fate(&restored)),
            idealised: inquiry.fate(&own.idealised(module)),
            alone: inquiry.fate(&if differs { baseline.with_module_of(module, &own) } else { alone }),
            prevented: None,
        });
    }
    let ideal = inquiry.fate(&Module::ALL.into_iter().fold(own, |config, module| config.idealised(module)));
    let off = own.weaknesses.each_off().into_iter();
    let weaknesses: Vec<WeaknessFinding> = off
        .map(|(weakness, weaknesses)| {
            let without = inquiry.fate(&ModularConfig { weaknesses, ..own });
            WeaknessFinding { weakness, without }
        })
        .collect();
    // Indices of the modules that may be the cause; each criterion leaves fewer.
    let mut best: Vec<usize> = (0..modules.len()).collect();
    best.retain(|&index| modules[index].suffices());
    prefer(&mut best, |index| modules[index].restored == Some(Fate::Vanished));
    let mut pairs = Vec::new();
    if best.is_empty() {
        pairs = inquiry.pairs();
    }
    let is_restored = best.iter().any(|&index| modules[index].restored == Some(Fate::Vanished));
    let flawless = if is_restored { inquiry.fate(baseline) } else { ideal };
    if flawless == Fate::Vanished {
        prefer(&mut best, |index| modules[index].alone == Fate::Crash);
    }
    let mut varied_crashes = None;
    if best.len() > 1 {
        let candidates = best.iter().map(|&index| match modules[index].restored {
            Some(Fate::Vanished) => own.with_module_of(modules[index].module, baseline),
            _ => own.idealised(modules[index].module),
        });
        let (crashes, vanished) = varied(&crash, &candidates.collect::<Vec<_>>());
        varied_crashes = Some(crashes);
        if crashes == 0 {
            best.clear();
        }
        for (&index, count) in best.iter().zip(vanished) {
            modules[index].prevented = Some(f64::from(count) / f64::from(crashes));
        }
        let most = best.iter().filter_map(|&index| modules[index].prevented).fold(0.0, f64::max);
        prefer(&mut best, |index| modules[index].prevented >= Some(most));
        let to_blame = |found: &WeaknessFinding| found.without == Fate::Vanished;
        prefer(&mut best, |index| {
            let owned = |found: &WeaknessFinding| owns(modules[index].module, found.weakness);
            !is_restored && weaknesses.iter().any(|found| to_blame(found) && owned(found))
        });
    }
    let cause = match (best.first(), pairs.first()) {
        (Some(&index), _) => vec![modules[index].module],
        (None, Some(pair)) => pair.to_vec(),
        (None, None) => Vec::new(),
    };
    Ok(Diagnosis { cause, modules, ideal, weaknesses, varied_crashes, pairs, from_s: inquiry.from_s })
}

impl ModuleFinding {
    /// Whether the collision vanishes with this module restored or idealised.
    pub fn suffices(&self) -> bool {
        self.restored == Some(Fate::Vanished) || self.idealised == Fate::Vanished
    }
}

/// Keeps the modules that meet a criterion, if any do.
fn prefer(best: &mut Vec<usize>, criterion: impl Fn(usize) -> bool) {
    if best.iter().any(|&index| criterion(index)) {
        best.retain(|&index| criterion(index));
    }
}

/// Whether a documented weakness belongs to a module: `ModularConfig::idealised` switches it off with it.
fn owns(module: Module, weakness: &str) -> bool {
    match weakness {
        "late_unstable_tracks" => matches!(module, Module::Perception | Module::Tracking),
        "lane_bound_prediction" => module == Module::Prediction,
        _ => module == Module::Planning,
    }
}

/// The collision driven up to by its own driving system, and from then on by others.
pub(super) struct Inquiry<'a> {
    crash: &'a Crash<'a>,
    pub profile: ModularConfig,
    foresight: Arc<Foresight>,
    from_s: f64,
}

impl<'a> Inquiry<'a> {
    pub fn new(crash: &'a Crash<'a>) -> Result<Inquiry<'a>, NoModules> {
        let ads = &crash.setup.ads;
        let profile = *ads.profile().ok_or_else(|| NoModules { ads: ads.name().to_owned() })?;
        let (_, foresight) = play(crash.setup, |moment| crash.script.choose(crash.setup.table, moment));
        let collision = &crash.collision;
        let from_s = collision.spawned_s.max(collision.contact.time_s - LOOK_BACK_S);
        Ok(Inquiry { crash, profile, foresight, from_s })
    }

    /// What becomes of the collision if another profile takes over when its obstacle appears.
    pub fn fate(&self, profile: &ModularConfig) -> Fate {
        // The same settings make the same drive.
        if *profile == self.profile {
            return Fate::Crash;
        }
        let ads = taken_over(&self.crash.setup.ads, profile, &self.foresight, self.from_s);
        self.crash.fate(&self.crash.play(&ads))
    }

    /// Pairs of modules that suffice together.
    fn pairs(&self) -> Vec<[Module; 2]> {
        let mut found = Vec::new();
        for (index, first) in Module::ALL.into_iter().enumerate() {
            for second in Module::ALL.into_iter().skip(index + 1) {
                let both = self.profile.idealised(first).idealised(second);
                if self.fate(&both) == Fate::Vanished {
                    found.push([first, second]);
                }
            }
        }
        found
    }
}

/// How many variations lead to the collision, and for each profile, how many of them no longer do.
fn varied(crash: &Crash, profiles: &[ModularConfig]) -> (u32, Vec<u32>) {
    let (mut crashes, mut vanished) = (0_u32, vec![0_u32; profiles.len()]);
    for number in 1..=VARIATIONS {
        let variation = Variation::of(crash, number);
        let Some(collision) = crash.again(&variation.log) else { continue };
        crashes += 1;
        let from_s = collision.spawned_s.max(collision.contact.time_s - LOOK_BACK_S);
        for (profile, count) in profiles.iter().zip(&mut vanished) {
            let ads = taken_over(&crash.setup.ads, profile, &variation.foresight, from_s);
            let fate = crash.fate(&variation.play(crash, &ads));
            *count += u32::from(fate == Fate::Vanished);
        }
    }
    (crashes, vanished)
}

/// A driving system that another profile of it takes over from, knowing the future.
fn taken_over(ads: &Selected, profile: &ModularConfig, foresight: &Arc<Foresight>, from_s: f64) -> Selected {
    let successor =
        ads.clone().with_profile(*profile).expect("a driving system with a profile takes another");
    ads.clone().until(from_s, successor.with_foresight(foresight.clone()))
}
