//! Which module of a driving system is at fault for a collision.
//!
//! The ego vehicle drives as it did until the obstacle appears. From then on the same system drives with one
//! module changed (`ads::Module`), which has watched from the start, so that the hazard is the same to the bit;
//! other road users decide for themselves. A *baseline* is the specification: how good each module should be.
//!
//! - A module that differs from the baseline is **outside its specification**. If the collision vanishes with
//!   it as in the baseline, it is at fault.
//! - Where no such module is found, all are within their specifications: their errors are those that they may
//!   have. The fault then lies with a module that decides (prediction, planning, control, emergency braking):
//!   one without whose errors and weaknesses the collision vanishes. If the collision also vanishes without the
//!   errors of a module that senses (localisation, perception, tracking, latency), the deciding one is
//!   **brittle**: it could not bear what it must expect. Where no deciding module makes up for the senses,
//!   planning is brittle, because it drives no slower than it can see.
//!
//! **Chance.** The collision is played again with other sensor noise and nothing else changed; the share that
//! vanishes is the placebo. A module whose change makes no more of them vanish is not named by it. What chance
//! prevents, chance has made: then the errors that were drawn are **measured** in the seconds before the collision
//! (see `measured`), and the module whose error was farthest beyond its specification is named, if the collision
//! vanishes without it.
//!
//! Where several modules are left, these criteria decide, in this order:
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
use super::measured::{Measure, measure};
use super::variation::Variation;

/// Number of variations that are played where several modules suffice, and of replays with other noise.
pub const VARIATIONS: u32 = 8;

/// The takeover is at most this long before the collision, s: longer than any reaction or braking, because
/// ambient traffic may have appeared long before.
const LOOK_BACK_S: f64 = 15.0;

/// Why no cause can be found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{ads}` is not made of modules that could be at fault: only `modular` is, so `--causes` and `diagnose` are for it alone"
)]
pub struct NoModules {
    pub ads: String,
}

/// The cause of a collision, and what it was found by.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Diagnosis {
    /// The module at fault; two if only both together suffice; none if no two do, or if it was chance.
    pub cause: Vec<Module>,
    /// Whether all modules are within their specifications, and the one at fault could not bear the errors that
    /// others may have.
    pub brittle: bool,
    pub modules: Vec<ModuleFinding>,
    /// The collision if no module has errors.
    pub ideal: Fate,
    /// The collision without each documented weakness that is switched on.
    pub weaknesses: Vec<WeaknessFinding>,
    /// Of the replays with other sensor noise alone, the share in which the collision vanishes.
    pub placebo: f64,
    /// The errors of the modules that sense, in the seconds before the collision.
    pub measured: Vec<Measure>,
    /// Whether the module at fault is named by its measured error, because chance does as much as any change.
    pub by_measure: bool,
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
    /// Of the replays with other sensor noise, the share that vanishes with it restored, if that suffices, or
    /// else idealised: to compare with the placebo. Played only for modules that suffice.
    pub share: Option<f64>,
    /// As `share`, of the collisions under small variations. Played only to tell modules apart.
    pub prevented: Option<f64>,
}

/// A documented weakness, and the collision without it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct WeaknessFinding {
    pub weakness: &'static str,
    /// The module that it belongs to.
    pub module: Module,
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
    let mut modules: Vec<ModuleFinding> =
        Module::ALL.into_iter().map(|module| inquiry.finding(module, baseline)).collect();
    let ideal = inquiry.fate(&Module::ALL.into_iter().fold(own, |config, module| config.idealised(module)));
    let weaknesses = inquiry.weaknesses();
    let placebo = inquiry.vanished(&own);
    let Suspects { kind, mut cures } = Suspects::of(&modules);
    let pairs = if cures.is_empty() { inquiry.pairs() } else { Vec::new() };
    // Chance never outranks: a change must do more than other noise does.
    for &index in &cures {
        modules[index].share = Some(inquiry.vanished(&modules[index].cured(&own, baseline)));
    }
    cures.retain(|&index| modules[index].share > Some(placebo));
    let mut best = match kind {
        Kind::Sensing { planning } if !cures.is_empty() => vec![planning],
        Kind::Outside | Kind::Deciding { .. } | Kind::Sensing { .. } => cures,
    };
    let is_restored = kind == Kind::Outside;
    let flawless = if is_restored { inquiry.fate(baseline) } else { ideal };
    if flawless == Fate::Vanished {
        prefer(&mut best, |index| modules[index].alone == Fate::Crash);
    }
    let varied_crashes = (best.len() > 1).then(|| prevented(&crash, &own, baseline, &mut modules, &best));
    if let Some(crashes) = varied_crashes {
        if crashes == 0 {
            best.clear();
        }
        let most = best.iter().filter_map(|&index| modules[index].prevented).fold(0.0, f64::max);
        prefer(&mut best, |index| modules[index].prevented >= Some(most));
        prefer(&mut best, |index| {
            let to_blame = |found: &WeaknessFinding| {
                found.without == Fate::Vanished && found.module == modules[index].module
            };
            !is_restored && weaknesses.iter().any(to_blame)
        });
    }
    let measured = measure(&crash, baseline);
    let unlucky = by_measure(&measured, &modules).filter(|_| best.is_empty());
    let cause = match (best.first(), unlucky, pairs.first()) {
        (Some(&index), ..) => vec![modules[index].module],
        (None, Some(module), _) => vec![module],
        (None, None, Some(pair)) => pair.to_vec(),
        (None, None, None) => Vec::new(),
    };
    let is_brittle = matches!(kind, Kind::Deciding { brittle: true } | Kind::Sensing { .. });
    let brittle = is_brittle && !best.is_empty();
    let (by_measure, from_s) = (unlucky.is_some(), inquiry.from_s);
    Ok(Diagnosis {
        cause,
        brittle,
        modules,
        ideal,
        weaknesses,
        placebo,
        measured,
        by_measure,
        varied_crashes,
        pairs,
        from_s,
    })
}

/// The module whose error was farthest beyond its specification, of those without which the collision vanishes.
fn by_measure(measured: &[Measure], modules: &[ModuleFinding]) -> Option<Module> {
    let suffices = |module: Module| modules.iter().any(|found| found.module == module && found.suffices());
    let beyond = measured.iter().filter(|found| found.excess() > 1.0 && suffices(found.module));
    beyond.max_by(|a, b| a.excess().total_cmp(&b.excess())).map(|found| found.module)
}

/// Which modules may be at fault, before chance and the criteria.
struct Suspects {
    kind: Kind,
    /// Indices of the modules whose change makes the collision vanish.
    cures: Vec<usize>,
}

/// What the suspects have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// They are outside their specifications.
    Outside,
    /// They decide, and all modules are within their specifications.
    Deciding { brittle: bool },
    /// They sense, within their specifications; planning, the module with this index, could not bear it.
    Sensing { planning: usize },
}

impl Suspects {
    fn of(modules: &[ModuleFinding]) -> Suspects {
        let those = |criterion: &dyn Fn(&ModuleFinding) -> bool| {
            (0..modules.len()).filter(|&index| criterion(&modules[index])).collect::<Vec<usize>>()
        };
        let outside = those(&|found| found.restored == Some(Fate::Vanished));
        let deciding = those(&|found| found.idealised == Fate::Vanished && decides(found.module));
        let sensing = those(&|found| found.idealised == Fate::Vanished && !decides(found.module));
        let planning = modules.iter().position(|found| found.module == Module::Planning);
        let planning = planning.expect("every module is looked at");
        if !outside.is_empty() {
            Suspects { kind: Kind::Outside, cures: outside }
        } else if !deciding.is_empty() {
            Suspects { kind: Kind::Deciding { brittle: !sensing.is_empty() }, cures: deciding }
        } else {
            Suspects { kind: Kind::Sensing { planning }, cures: sensing }
        }
    }
}

/// Whether a module decides what the vehicle does, with what others tell it.
fn decides(module: Module) -> bool {
    match module {
        Module::Prediction | Module::Planning | Module::Control | Module::Emergency => true,
        Module::Localization | Module::Perception | Module::Tracking | Module::Latency => false,
    }
}

impl ModuleFinding {
    /// Whether the collision vanishes with this module restored or idealised.
    pub fn suffices(&self) -> bool {
        self.restored == Some(Fate::Vanished) || self.idealised == Fate::Vanished
    }

    /// The profile with this module restored, if that suffices, or else idealised.
    fn cured(&self, own: &ModularConfig, baseline: &ModularConfig) -> ModularConfig {
        match self.restored {
            Some(Fate::Vanished) => own.with_module_of(self.module, baseline),
            _ => own.idealised(self.module),
        }
    }
}

/// Keeps the modules that meet a criterion, if any do.
fn prefer(best: &mut Vec<usize>, criterion: impl Fn(usize) -> bool) {
    if best.iter().any(|&index| criterion(index)) {
        best.retain(|&index| criterion(index));
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
        let profile = *ads.profile().ok_or_else(|| NoModules { ads: ads.title() })?;
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
        let ads = taken_over(&self.crash.setup.ads, profile, &self.foresight, self.from_s, None);
        self.crash.fate(&self.crash.play(&ads))
    }

    /// What one module has to do with the collision.
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
            share: None,
            prevented: None,
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
            WeaknessFinding { weakness, module, without: self.fate(&without) }
        })
        .collect()
    }

    /// The share of replays with other sensor noise in which the collision vanishes, with a profile that takes
    /// over when the obstacle appears.
    pub fn vanished(&self, profile: &ModularConfig) -> f64 {
        let vanished = (1..=VARIATIONS).filter(|&number| {
            let ads = taken_over(&self.crash.setup.ads, profile, &self.foresight, self.from_s, Some(number));
            self.crash.fate(&self.crash.play(&ads)) == Fate::Vanished
        });
        f64::from(vanished.count() as u32) / f64::from(VARIATIONS)
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

/// How many variations lead to the collision. Notes for each of some modules the share that it prevents.
fn prevented(
    crash: &Crash,
    own: &ModularConfig,
    baseline: &ModularConfig,
    modules: &mut [ModuleFinding],
    suspects: &[usize],
) -> u32 {
    let profiles: Vec<ModularConfig> =
        suspects.iter().map(|&index| modules[index].cured(own, baseline)).collect();
    let (crashes, vanished) = varied(crash, &profiles);
    for (&index, count) in suspects.iter().zip(vanished).filter(|_| crashes > 0) {
        modules[index].prevented = Some(f64::from(count) / f64::from(crashes));
    }
    crashes
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
            let ads = taken_over(&crash.setup.ads, profile, &variation.foresight, from_s, None);
            let fate = crash.fate(&variation.play(crash, &ads));
            *count += u32::from(fate == Fate::Vanished);
        }
    }
    (crashes, vanished)
}

/// A driving system that another profile of it takes over from, knowing the future; with a number, its sensors
/// have other noise.
fn taken_over(
    ads: &Selected,
    profile: &ModularConfig,
    foresight: &Arc<Foresight>,
    from_s: f64,
    noise: Option<u32>,
) -> Selected {
    let successor =
        ads.clone().with_profile(*profile).expect("a driving system with a profile takes another");
    let successor = successor.with_foresight(foresight.clone());
    let successor = match noise {
        None => successor,
        Some(number) => successor.with_other_noise(number),
    };
    ads.clone().until(from_s, successor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_chance_made_is_named_by_the_largest_error_that_matters() {
        let finding = |module, idealised| ModuleFinding {
            module,
            restored: None,
            idealised,
            alone: Fate::Crash,
            share: None,
            prevented: None,
        };
        let modules = [
            finding(Module::Perception, Fate::Vanished),
            finding(Module::Tracking, Fate::Vanished),
            finding(Module::Prediction, Fate::Crash),
        ];
        let measure = |module, worst| Measure { module, what: "error, m", worst, bound: 1.0 };
        let named = |perception, tracking, prediction| {
            let measured = [
                measure(Module::Perception, perception),
                measure(Module::Tracking, tracking),
                measure(Module::Prediction, prediction),
            ];
            by_measure(&measured, &modules)
        };
        assert_eq!(named(2.0, 1.5, 9.0), Some(Module::Perception), "the collision does not need the third");
        assert_eq!(named(0.5, 1.5, 0.0), Some(Module::Tracking));
        assert_eq!(named(0.9, 1.0, 9.0), None, "all within their specification");
    }
}
