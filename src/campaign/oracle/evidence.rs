//! The evidence about the cause of a collision, collected by replays, and the verdict that follows from it. Pure: nothing
//! is played here.
//!
//! [`Evidence`] is the table that `diagnose` prints. Verdict and cause follow from it alone, and the sentence below the
//! table puts the verdict into words, so none of the three can contradict another.
//!
//! **Suspects.** A *baseline* says how good each module should be. If some modules of the driving system differ from it,
//! only these are suspects, because a module that is the same explains no difference. If none differs, the driving system
//! is the baseline, and its own weaknesses are looked for.
//!
//! **Chance.** Any change of a near crash may save it. So the collision is played again with other sensor noise: once with
//! the noise alone, and once with the same noise and the change. Only the pairs of replays that end differently count. A
//! change that does no more than chance would prevent the collision as often as it brings it about. A change is *told apart
//! from chance* if the 95 % interval of the share of pairs in which it prevents the collision lies above one half. The
//! interval is exact (Clopper and Pearson), and wider if several changes are tried (Bonferroni).
//!
//! **Verdict.** The first of these that holds, see [`Verdict`]:
//!
//! 1. Some modules differ from the baseline, and one of them, made as in the baseline, prevents the collision, told apart
//!    from chance. If several do, the verdict names the module whose errors alone lead to the collision most often, and
//!    each module that the replays do not tell apart from it. Mending any one of them prevents the collision.
//! 2. None differs, and a documented weakness, switched off, prevents the collision, told apart from chance.
//! 3. No change alone is told apart from chance, and two modules together prevent the collision, told apart from it.
//! 4. None differs, a module's output was beyond its specification in the seconds before (see `measured`), and the module
//!    prevents the collision without its errors, told apart from chance. An output beyond its specification alone is no
//!    proof: it occurs before many near misses, too. Where other noise prevents the collision anyway, another draw of any
//!    module's errors would have, too. The table shows the measurements all the same.
//! 5. None differs, and a module that decides (planning, control, emergency braking) prevents the collision without its
//!    errors, told apart from chance; of several as above.
//! 6. None differs, and a module that gives planning its picture prevents the collision without its errors, told apart from
//!    chance. These errors are within its specification, so planning is brittle.
//!
//! Otherwise no module is named, and the verdict says why.

use core::cmp::Reverse;

use avastra_base::statistics::binomial_missing;
use avastra_drivers::Module;

use super::case::Fate;
use super::measured::Measure;

/// Share of changes without effect that are wrongly told apart from chance: an interval of 95 %.
const MISSING: f64 = 0.05;

/// The cause of a collision, with the evidence for it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Diagnosis {
    /// The module at fault. Several if they are not told apart, or if only both together prevent the collision. None
    /// where the verdict says why.
    pub cause: Vec<Module>,
    pub verdict: Verdict,
    /// The documented weakness by which it is at fault.
    pub weakness: Option<&'static str>,
    #[serde(flatten)]
    pub evidence: Evidence,
}

/// Why a module is named, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The module differs from the baseline, and as there it prevents the collision.
    Outside,
    /// The driving system is the baseline, and a documented weakness of the module makes the collision.
    Weakness,
    /// The driving system is the baseline. The module's output in the seconds before was beyond its specification, and
    /// without its errors it prevents the collision.
    Measured,
    /// The driving system is the baseline, and without its errors the module prevents the collision.
    Deciding,
    /// The driving system is the baseline: planning could not bear errors that other modules may have.
    Brittle,
    /// Two modules prevent the collision together.
    Together,
    /// None: the baseline has the collision as well, so the difference from it does not explain the collision.
    Baseline,
    /// None: no change is told apart from chance.
    Chance,
    /// None: neither one module nor two prevent the collision.
    Unexplained,
}

/// The results of all replays of a collision.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Evidence {
    /// The noun of the explained finding: `crash` or `breach`. In the other fields "collision" stands for it.
    pub noun: &'static str,
    pub modules: Vec<ModuleFinding>,
    /// The collision if all modules are as in the baseline; `None` if the driving system is the baseline.
    pub baseline: Option<Fate>,
    /// The collision if no module has errors.
    pub ideal: Fate,
    /// The collision without each documented weakness that is switched on.
    pub weaknesses: Vec<WeaknessFinding>,
    /// Pairs that prevent the collision together. They are looked for if no single change is told apart from chance.
    pub pairs: Vec<PairFinding>,
    /// The collision with other sensor noise and nothing else changed; `None` if no change prevents it.
    pub chance: Option<Chance>,
    /// Errors of the modules in the seconds before the collision.
    pub measured: Vec<Measure>,
    /// When the other driving systems took over, s.
    pub from_s: f64,
}

/// The results of the replays that change one module.
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
    /// Replays with other sensor noise and this module changed: made as in the baseline if any module differs from it,
    /// otherwise without errors. Played only if the change prevents the collision.
    pub noise: Option<Comparison>,
    /// Number of these replays in which the errors of this module alone do not lead to the collision. Played only to
    /// tell several modules apart.
    pub noise_alone: Option<u32>,
    /// For each of these replays, how many of two signs it has that this module is at fault: its change prevents the
    /// collision, and its errors alone lead to it. The second is looked for only to tell several modules apart.
    pub signs: Vec<u8>,
}

/// A documented weakness, and the collision without it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct WeaknessFinding {
    pub weakness: &'static str,
    /// The module that it belongs to.
    pub module: Module,
    pub without: Fate,
    /// Replays with other sensor noise and without it. Played only if the driving system is the baseline.
    pub noise: Option<Comparison>,
}

/// Two modules that prevent a collision together.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PairFinding {
    pub modules: [Module; 2],
    /// As for a module; played for the first pair only.
    pub noise: Option<Comparison>,
}

/// Replays with other sensor noise alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Chance {
    pub replays: u32,
    /// Replays in which the collision vanishes.
    pub vanished: u32,
}

/// Replays with other sensor noise and a change, beside the same noise alone.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Replays without the collision.
    pub vanished: u32,
    /// Replays in which the change prevents the collision that the noise alone does not.
    pub prevents: u32,
    /// Replays that have the collision only with the change.
    pub brings: u32,
    /// Interval of `prevents / (prevents + brings)`.
    pub low: f64,
    pub high: f64,
}

impl Chance {
    /// Counts replays, each with whether the collision vanishes in it.
    pub(super) fn of(vanished: &[bool]) -> Chance {
        let gone = vanished.iter().filter(|vanished| **vanished).count();
        Chance { replays: vanished.len() as u32, vanished: gone as u32 }
    }
}

impl Comparison {
    /// Counts pairs of replays, each with whether the collision vanishes with the noise alone, and with the change.
    /// `tries` is the number of changes that are compared.
    pub(super) fn of(replays: impl Iterator<Item = (bool, bool)>, tries: usize) -> Comparison {
        let (mut vanished, mut prevents, mut brings) = (0_u32, 0_u32, 0_u32);
        for (unchanged, changed) in replays {
            vanished += u32::from(changed);
            prevents += u32::from(changed && !unchanged);
            brings += u32::from(unchanged && !changed);
        }
        let missing = MISSING / tries.max(1) as f64;
        let interval = binomial_missing(u64::from(prevents), u64::from(prevents + brings), missing);
        Comparison { vanished, prevents, brings, low: interval.low, high: interval.high.unwrap_or(1.0) }
    }

    /// Whether the change does more than chance.
    pub fn is_told_apart(&self) -> bool {
        self.low > 0.5
    }
}

/// Whether replays were played, and the change does more than chance in them.
pub(super) fn is_told_apart(noise: Option<Comparison>) -> bool {
    noise.is_some_and(|noise| noise.is_told_apart())
}

impl Diagnosis {
    pub(super) fn of(evidence: Evidence) -> Diagnosis {
        let (verdict, cause, weakness) = evidence.conclude();
        Diagnosis { cause, verdict, weakness, evidence }
    }
}

impl Evidence {
    /// Whether some modules differ from the baseline: only these are suspects.
    pub fn differs(&self) -> bool {
        self.baseline.is_some()
    }

    /// The modules that prevent the collision, told apart from chance.
    pub fn told_apart(&self) -> impl Iterator<Item = &ModuleFinding> {
        self.modules.iter().filter(|found| is_told_apart(found.noise))
    }

    /// Whether a module or a weakness alone prevents the collision, told apart from chance.
    pub(super) fn is_told_apart(&self) -> bool {
        self.told_apart().next().is_some() || self.weakness().is_some()
    }

    fn conclude(&self) -> (Verdict, Vec<Module>, Option<&'static str>) {
        let differs = self.differs();
        let named = foremost(self.told_apart());
        if differs && !named.is_empty() {
            return (Verdict::Outside, named, None);
        }
        if let Some(found) = self.weakness() {
            return (Verdict::Weakness, vec![found.module], Some(found.weakness));
        }
        if let Some(pair) = self.pairs.iter().find(|pair| is_told_apart(pair.noise)) {
            return (Verdict::Together, pair.modules.to_vec(), None);
        }
        if !differs && let Some(found) = self.beyond_specification() {
            return (Verdict::Measured, vec![found.module], None);
        }
        let named = foremost(self.told_apart().filter(|found| decides(found.module)));
        if !differs && !named.is_empty() {
            return (Verdict::Deciding, named, None);
        }
        if !differs && self.told_apart().next().is_some() {
            return (Verdict::Brittle, vec![Module::Planning], None);
        }
        let verdict = if self.chance.is_some() {
            Verdict::Chance
        } else if self.baseline.is_some_and(|fate| fate != Fate::Vanished) {
            Verdict::Baseline
        } else {
            Verdict::Unexplained
        };
        (verdict, Vec::new(), None)
    }

    /// The documented weakness that makes the collision most often, told apart from chance.
    fn weakness(&self) -> Option<&WeaknessFinding> {
        let told_apart = self.weaknesses.iter().filter(|found| is_told_apart(found.noise));
        told_apart.min_by_key(|found| Reverse(found.noise.map(|noise| noise.vanished)))
    }

    /// The module that was farthest beyond its specification, of those that prevent the collision, told apart from chance.
    pub fn beyond_specification(&self) -> Option<&Measure> {
        let prevents = |module: Module| self.told_apart().any(|found| found.module == module);
        let beyond = self.measured.iter().filter(|found| found.excess() > 1.0 && prevents(found.module));
        beyond.max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }
}

impl WeaknessFinding {
    /// Whether the collision vanishes without it.
    pub fn vanishes(&self) -> bool {
        self.without == Fate::Vanished
    }
}

impl ModuleFinding {
    /// Whether the collision vanishes by the change that is asked about: the module as in the baseline if any
    /// module differs from it, or else without errors.
    pub fn vanishes(&self, differs: bool) -> bool {
        let fate = if differs { self.restored } else { Some(self.idealised) };
        fate == Some(Fate::Vanished)
    }

    /// How much it explains: its signs in all replays together.
    fn weight(&self) -> u32 {
        self.signs.iter().map(|signs| u32::from(*signs)).sum()
    }

    /// Whether the replays say that this module is at fault rather than another. Only those count in which the two have
    /// different numbers of signs. `tries` is the number of modules that it is compared with.
    fn is_told_apart_from(&self, other: &ModuleFinding, tries: usize) -> bool {
        let replays = self.signs.iter().zip(&other.signs);
        Comparison::of(replays.map(|(own, other)| (other > own, own > other)), tries).is_told_apart()
    }
}

/// The module that explains most, and each that is not told apart from it; in the order of the flow of data.
fn foremost<'a>(found: impl Iterator<Item = &'a ModuleFinding>) -> Vec<Module> {
    let found: Vec<&ModuleFinding> = found.collect();
    let Some(first) = found.iter().min_by_key(|one| Reverse(one.weight())) else { return Vec::new() };
    let named = found.iter().filter(|one| !first.is_told_apart_from(one, found.len() - 1));
    named.map(|one| one.module).collect()
}

/// Whether a module decides what the vehicle does. Prediction does not count as one: without errors it would know the
/// future, which no prediction can, so it is judged by its forecasts.
fn decides(module: Module) -> bool {
    match module {
        Module::Planning | Module::Control | Module::Emergency => true,
        Module::Localization
        | Module::Perception
        | Module::Tracking
        | Module::Prediction
        | Module::Latency => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng;
    use avastra_base::rng::{Rng, Stream};

    /// A comparison in which the change prevents so many collisions and brings so many.
    fn compared(prevents: usize, brings: usize, tries: usize) -> Comparison {
        let replays = (0..prevents).map(|_| (false, true)).chain((0..brings).map(|_| (true, false)));
        Comparison::of(replays.chain([(true, true), (false, false)]), tries)
    }

    #[test]
    fn a_change_must_do_more_than_chance() {
        let told = |prevents, brings, tries| compared(prevents, brings, tries).is_told_apart();
        assert!(told(6, 0, 1) && !told(5, 0, 1), "a coin falls five times the same way once in sixteen");
        assert!(told(8, 0, 4) && !told(7, 0, 4), "four tries need more");
        assert!(told(16, 4, 1) && !told(14, 6, 1));
        assert!(!told(0, 0, 1) && !told(0, 9, 1));
        let found = compared(6, 1, 1);
        assert_eq!((found.vanished, found.prevents, found.brings), (7, 6, 1));
        assert!(found.low < 6.0 / 7.0 && 6.0 / 7.0 < found.high);
    }

    fn finding(module: Module, restored: Option<Fate>, idealised: Fate) -> ModuleFinding {
        ModuleFinding {
            module,
            restored,
            idealised,
            alone: Fate::Vanished,
            noise: None,
            noise_alone: None,
            signs: Vec::new(),
        }
    }

    /// Evidence of a driving system that is the baseline, or that differs from it in some modules.
    fn evidence(differ: &[Module]) -> Evidence {
        let restored = |module| differ.contains(&module).then_some(Fate::Same);
        let findings = Module::ALL.into_iter().map(|module| finding(module, restored(module), Fate::Same));
        Evidence {
            noun: "crash",
            modules: findings.collect(),
            baseline: (!differ.is_empty()).then_some(Fate::Vanished),
            ideal: Fate::Vanished,
            weaknesses: Vec::new(),
            pairs: Vec::new(),
            chance: None,
            measured: Vec::new(),
            from_s: 0.0,
        }
    }

    fn named(evidence: &Evidence) -> (Verdict, Vec<Module>) {
        let (verdict, cause, _) = evidence.conclude();
        (verdict, cause)
    }

    #[test]
    fn what_is_as_in_the_baseline_is_never_at_fault_for_what_differs() {
        let mut found = evidence(&[Module::Perception]);
        // A forecast that was far off, and a prediction without errors that would have prevented the collision.
        found.measured =
            vec![Measure { module: Module::Prediction, what: "error, m", worst: 9.0, bound: 1.0 }];
        found.modules[Module::Prediction as usize].idealised = Fate::Vanished;
        assert_eq!(named(&found), (Verdict::Unexplained, vec![]));
        found.baseline = Some(Fate::Same);
        assert_eq!(named(&found), (Verdict::Baseline, vec![]));
        let perception = &mut found.modules[Module::Perception as usize];
        perception.restored = Some(Fate::Vanished);
        found.chance = Some(Chance { replays: 64, vanished: 60 });
        assert_eq!(named(&found), (Verdict::Chance, vec![]));
        found.measured.push(Measure { module: Module::Perception, what: "error, m", worst: 9.0, bound: 1.0 });
        assert_eq!(named(&found), (Verdict::Chance, vec![]), "chance explains it, however wrong it was");
        found.modules[Module::Perception as usize].noise = Some(compared(10, 0, 1));
        assert_eq!(named(&found), (Verdict::Outside, vec![Module::Perception]));
    }

    #[test]
    fn of_several_the_one_whose_errors_alone_suffice_is_named() {
        let mut found = evidence(&[Module::Tracking, Module::Latency]);
        found.chance = Some(Chance { replays: 10, vanished: 0 });
        // In each replay the change prevents the collision, and in some of them the errors alone lead to it.
        let signs = |alone: usize| [vec![2; alone], vec![1; 10 - alone]].concat();
        for (module, alone) in [(Module::Tracking, 1), (Module::Latency, 9)] {
            let one = &mut found.modules[module as usize];
            one.restored = Some(Fate::Vanished);
            one.noise = Some(compared(10, 0, 2));
            one.signs = signs(alone);
        }
        assert_eq!(named(&found), (Verdict::Outside, vec![Module::Latency]));
        let either = (Verdict::Outside, vec![Module::Tracking, Module::Latency]);
        for alone in [6, 1, 0] {
            found.modules[Module::Latency as usize].signs = signs(alone);
            assert_eq!(named(&found), either, "{alone}: they are not told apart");
        }
    }

    #[test]
    fn the_default_is_at_fault_by_a_weakness_by_what_it_gave_or_by_being_brittle() {
        let mut found = evidence(&[]);
        assert_eq!(named(&found), (Verdict::Unexplained, vec![]));
        found.chance = Some(Chance { replays: 12, vanished: 2 });
        found.modules[Module::Perception as usize].idealised = Fate::Vanished;
        assert_eq!(named(&found), (Verdict::Chance, vec![]));
        found.measured =
            vec![Measure { module: Module::Perception, what: "error, m", worst: 9.0, bound: 1.0 }];
        assert_eq!(named(&found), (Verdict::Chance, vec![]), "chance explains it, however wrong it was");
        found.measured.clear();
        found.modules[Module::Perception as usize].noise = Some(compared(10, 0, 1));
        assert_eq!(named(&found), (Verdict::Brittle, vec![Module::Planning]));
        found.modules[Module::Planning as usize].idealised = Fate::Vanished;
        found.modules[Module::Planning as usize].noise = Some(compared(9, 0, 1));
        assert_eq!(named(&found), (Verdict::Deciding, vec![Module::Planning]));
        let measure =
            |module, worst| Measure { module, what: "longest time not detected, s", worst, bound: 1.2 };
        found.measured = vec![measure(Module::Perception, 1.7), measure(Module::Tracking, 9.0)];
        assert_eq!(named(&found), (Verdict::Measured, vec![Module::Perception]), "tracking prevents nothing");
        found.measured = vec![measure(Module::Perception, 1.2)];
        assert_eq!(named(&found), (Verdict::Deciding, vec![Module::Planning]), "it was within");
        found.weaknesses = vec![WeaknessFinding {
            weakness: "closest_static_only",
            module: Module::Planning,
            without: Fate::Vanished,
            noise: Some(compared(10, 0, 1)),
        }];
        assert_eq!(named(&found), (Verdict::Weakness, vec![Module::Planning]));
        assert_eq!(found.conclude().2, Some("closest_static_only"));
    }

    /// Any evidence: fates, replays and measures by lot.
    fn any(rng: &mut Rng) -> Evidence {
        let fates = [Fate::Same, Fate::Other, Fate::Vanished, Fate::Absent];
        let fate = |rng: &mut Rng| fates[rng::below(rng, 4) as usize];
        let is = |rng: &mut Rng| rng::below(rng, 2) == 0;
        let noise = |rng: &mut Rng| {
            is(rng).then(|| compared(rng::below(rng, 12) as usize, rng::below(rng, 3) as usize, 2))
        };
        let differ: Vec<Module> =
            if is(rng) { Vec::new() } else { Module::ALL.into_iter().filter(|_| is(rng)).collect() };
        let mut found = evidence(&differ);
        let differs = found.differs();
        found.baseline = differs.then(|| fate(rng));
        for one in &mut found.modules {
            one.restored = one.restored.map(|_| fate(rng));
            one.idealised = fate(rng);
            one.noise = noise(rng).filter(|_| one.vanishes(differs));
            one.signs = (0..12).map(|_| rng::below(rng, 3) as u8).collect();
        }
        if found.modules.iter().any(|one| one.vanishes(differs)) {
            found.chance = Some(Chance { replays: 12, vanished: 2 });
        }
        found.measured = [Module::Localization, Module::Perception, Module::Prediction]
            .map(|module| Measure {
                module,
                what: "error, m",
                worst: f64::from(rng::below(rng, 3)),
                bound: 1.0,
            })
            .to_vec();
        found
    }

    #[test]
    fn no_verdict_contradicts_the_table() {
        let mut rng = rng::stream(1, Stream::Variation, 0);
        let mut named = 0;
        for _ in 0..4000 {
            let found = any(&mut rng);
            let (verdict, cause, _) = found.conclude();
            let is_named = !matches!(verdict, Verdict::Baseline | Verdict::Chance | Verdict::Unexplained);
            named += u32::from(is_named);
            assert_eq!(is_named, !cause.is_empty(), "{verdict:?}");
            let of = |module: Module| &found.modules[module as usize];
            for &module in &cause {
                assert!(
                    !found.differs() || of(module).restored.is_some(),
                    "{module:?} is as in the baseline"
                );
                let says_so = verdict == Verdict::Brittle || of(module).vanishes(found.differs());
                assert!(says_so, "{verdict:?} of {module:?}, without which there is the collision as well");
            }
            if is_named {
                assert!(found.is_told_apart(), "{verdict:?} of {cause:?}, which chance explains");
            }
            if verdict == Verdict::Brittle {
                let within = |one: &ModuleFinding| {
                    let own = found.measured.iter().find(|measure| measure.module == one.module);
                    own.is_none_or(|measure| measure.excess() <= 1.0)
                };
                assert!(
                    found.told_apart().all(within),
                    "what planning could not bear is within its specification"
                );
            }
        }
        assert!(named > 500, "{named}");
    }
}
