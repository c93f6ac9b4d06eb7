//! Which module of a driving system a collision is the fault of.
//!
//! The ego vehicle drives as it did until the obstacle appears. From then on the same system drives with
//! one module without its errors (`ads::Module`), which has watched from the start, so that the hazard
//! is the same to the bit; everybody else decides for themselves. Modules without which the collision
//! vanishes *suffice* to avoid it. If none does alone, pairs are tried.
//!
//! Several modules may suffice: good brakes make up for bad eyes. Then the cause is, in this order, one
//! whose errors alone, all other modules being without any, still lead to the collision; the one that
//! prevents most of the collisions under small variations; and the first on the data's way.
//!
//! Left out: what an error before the obstacle appeared has to do with it.

use std::sync::Arc;

use crate::ads::Foresight;
use crate::ads::ModularConfig;
use crate::ads::Module;
use crate::ads::Selected;
use crate::episode::EpisodeLog;
use crate::episode::Setup;

use super::crash::Crash;
use super::crash::Fate;
use super::crash::play;
use super::variation::Variation;

/// Variations by which modules that suffice alike are told apart.
const VARIATIONS: u32 = 8;

/// Ambient traffic may have been around for long: no takeover is earlier than this before the
/// collision, s. Longer than any reaction or braking.
const LOOK_BACK_S: f64 = 15.0;

/// Why there is no cause to be found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{ads}` is not made of modules that could be at fault: only `modular` is")]
pub struct NoModules {
    pub ads: String,
}

/// What a collision is owed to.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Diagnosis {
    /// The module at fault; two if only both together suffice; none if no two do.
    pub cause: Vec<Module>,
    pub modules: Vec<ModuleFinding>,
    /// Pairs that suffice, looked for if no module does alone.
    pub pairs: Vec<[Module; 2]>,
    /// Takeover of the driving systems compared, s.
    pub from_s: f64,
}

/// What one module has to do with a collision.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ModuleFinding {
    pub module: Module,
    /// With this module alone without its errors.
    pub idealised: Fate,
    /// With the errors of this module alone, all others being without.
    pub alone: Fate,
    /// Of the collisions under small variations, the share that vanishes without its errors. Looked at
    /// only to tell modules apart.
    pub prevented: Option<f64>,
}

/// A documented weakness, and the collision without it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct WeaknessFinding {
    pub weakness: &'static str,
    pub without: Fate,
}

/// Finds the cause of the nth collision of a log that was played from `setup`.
///
/// # Errors
/// If the driving system has no modules.
pub fn diagnose(setup: &Setup, log: &EpisodeLog, index: usize) -> Result<Diagnosis, NoModules> {
    let crash = Crash::new(setup, log, index);
    let inquiry = Inquiry::new(&crash)?;
    let own = inquiry.profile;
    let mut modules: Vec<ModuleFinding> = Vec::new();
    for module in Module::ALL {
        let others = Module::ALL.into_iter().filter(|other| *other != module);
        let alone = others.fold(own, |config, other| config.idealised(other));
        modules.push(ModuleFinding {
            module,
            idealised: inquiry.fate(&own.idealised(module)),
            alone: inquiry.fate(&alone),
            prevented: None,
        });
    }
    let mut best = sufficient(&modules);
    if best.iter().any(|&index| modules[index].alone == Fate::Crash) {
        best.retain(|&index| modules[index].alone == Fate::Crash);
    }
    if best.len() > 1 {
        let candidates: Vec<Module> = best.iter().map(|&index| modules[index].module).collect();
        for (index, share) in best.iter().zip(prevented(&crash, &own, &candidates)) {
            modules[*index].prevented = Some(share);
        }
    }
    let most = best.iter().filter_map(|&index| modules[index].prevented).fold(0.0, f64::max);
    let first = best.iter().find(|&&index| modules[index].prevented.is_none_or(|share| share >= most));
    let mut cause: Vec<Module> = first.map(|&index| modules[index].module).into_iter().collect();
    let mut pairs = Vec::new();
    if cause.is_empty() {
        pairs = inquiry.pairs();
        cause = pairs.first().map(|pair: &[Module; 2]| pair.to_vec()).unwrap_or_default();
    }
    Ok(Diagnosis { cause, modules, pairs, from_s: inquiry.from_s })
}

/// What each weakness that is switched on has to do with the nth collision of a log.
///
/// # Errors
/// As [`diagnose`].
pub fn weaknesses(
    setup: &Setup,
    log: &EpisodeLog,
    index: usize,
) -> Result<Vec<WeaknessFinding>, NoModules> {
    let crash = Crash::new(setup, log, index);
    let inquiry = Inquiry::new(&crash)?;
    let off = inquiry.profile.weaknesses.each_off();
    let finding = |(weakness, weaknesses)| {
        let without = inquiry.fate(&ModularConfig { weaknesses, ..inquiry.profile });
        WeaknessFinding { weakness, without }
    };
    Ok(off.into_iter().map(finding).collect())
}

/// Places of the modules that suffice alone.
fn sufficient(modules: &[ModuleFinding]) -> Vec<usize> {
    let suffices = |index: &usize| modules[*index].idealised == Fate::Vanished;
    (0..modules.len()).filter(suffices).collect()
}

/// The collision driven up to by its own driving system, and from then on by others.
struct Inquiry<'a> {
    crash: &'a Crash<'a>,
    profile: ModularConfig,
    foresight: Arc<Foresight>,
    from_s: f64,
}

impl<'a> Inquiry<'a> {
    fn new(crash: &'a Crash<'a>) -> Result<Inquiry<'a>, NoModules> {
        let ads = &crash.setup.ads;
        let profile = *ads.profile().ok_or_else(|| NoModules { ads: ads.name().to_owned() })?;
        let (_, foresight) = play(crash.setup, |moment| crash.script.choose(crash.setup.table, moment));
        let collision = &crash.collision;
        let from_s = collision.spawned_s.max(collision.contact.time_s - LOOK_BACK_S);
        Ok(Inquiry { crash, profile, foresight, from_s })
    }

    fn fate(&self, profile: &ModularConfig) -> Fate {
        // The same settings make the same drive.
        if *profile == self.profile {
            return Fate::Crash;
        }
        let ads = taken_over(&self.crash.setup.ads, profile, &self.foresight, self.from_s);
        self.crash.fate(&self.crash.play(&ads))
    }

    /// Pairs that suffice.
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

/// For each module, the share of the collisions under variations that vanishes without its errors.
fn prevented(crash: &Crash, own: &ModularConfig, modules: &[Module]) -> Vec<f64> {
    let (mut crashes, mut vanished) = (0_u32, vec![0_u32; modules.len()]);
    for number in 1..=VARIATIONS {
        let variation = Variation::of(crash, number);
        let Some(collision) = crash.again(&variation.log) else { continue };
        crashes += 1;
        let from_s = collision.spawned_s.max(collision.contact.time_s - LOOK_BACK_S);
        for (module, count) in modules.iter().zip(&mut vanished) {
            let ads =
                taken_over(&crash.setup.ads, &own.idealised(*module), &variation.foresight, from_s);
            let fate = crash.fate(&variation.play(crash, &ads));
            *count += u32::from(fate == Fate::Vanished);
        }
    }
    vanished.into_iter().map(|count| f64::from(count) / f64::from(crashes.max(1))).collect()
}

/// A driving system that another profile of it takes over from, knowing the future.
fn taken_over(
    ads: &Selected,
    profile: &ModularConfig,
    foresight: &Arc<Foresight>,
    from_s: f64,
) -> Selected {
    let successor = ads.clone().with_profile(*profile).expect("a driving system with a profile takes another");
    ads.clone().until(from_s, successor.with_foresight(foresight.clone()))
}

