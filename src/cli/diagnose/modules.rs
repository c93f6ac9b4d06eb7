//! What `diagnose` says of a driving system with modules: the table of evidence, and the verdict in a sentence.

use avastra_campaign::oracle::{Comparison, Diagnosis, Evidence, Fate, Measure, ModuleFinding, Verdict};
use avastra_drivers::Module;

/// All about one finding.
pub fn whole_text(diagnosis: &Diagnosis) -> String {
    let evidence = &diagnosis.evidence;
    let mut parts = vec![table_text(evidence), weaknesses_text(evidence)];
    if !evidence.measured.is_empty() {
        parts.push(measured_text(&evidence.measured));
    }
    parts.push(format!("\n{}", sentence(diagnosis)));
    parts.join("\n")
}

/// The modules at fault, in a word or two.
pub fn cause(diagnosis: &Diagnosis) -> String {
    let names: Vec<&str> = diagnosis.cause.iter().map(|module| module.name()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(joint(diagnosis.verdict)) }
}

/// The word between the names of several modules: two prevent the collision together, or they are not told apart.
fn joint(verdict: Verdict) -> &'static str {
    if verdict == Verdict::Together { " and " } else { " or " }
}

fn table_text(evidence: &Evidence) -> String {
    let noun = evidence.noun;
    let mut text = format!(
        "\n{:<14}{:<20}{:<20}{:<18}{}",
        "module", "as in the baseline", "without its errors", "its errors alone", "with other noise"
    );
    let mut line = |name: &str, restored: Option<Fate>, idealised: Fate, alone: &str, noise: &str| {
        let restored = restored.map_or_else(|| "the same".to_owned(), |fate| fate.in_words(noun));
        let idealised = idealised.in_words(noun);
        let line = format!("{name:<14}{restored:<20}{idealised:<20}{alone:<18}{noise}");
        text.push('\n');
        text.push_str(line.trim_end());
    };
    for found in &evidence.modules {
        let noise = found.noise.map_or(String::new(), noise_text);
        line(found.module.name(), found.restored, found.idealised, &found.alone.in_words(noun), &noise);
    }
    line("all of them", evidence.baseline, evidence.ideal, "", "");
    if let Some(chance) = evidence.chance {
        let count = format!("no {noun} in {} of {}", chance.vanished, chance.replays);
        text.push_str(&format!("\n{:<72}{count}", "nothing changed (chance)"));
    }
    for found in &evidence.pairs {
        let [first, second] = found.modules.map(|module| module.name());
        let noise = found.noise.map_or(String::new(), |noise| format!("; {}", noise_text(noise)));
        text.push_str(&format!("\n{first} and {second}: no {noun} {}{noise}", changed_text(evidence)));
    }
    text
}

/// How modules are changed to see whether that prevents the collision.
fn changed_text(evidence: &Evidence) -> &'static str {
    if evidence.differs() { "as in the baseline" } else { "without errors" }
}

/// The result of a change in replays with other noise.
pub fn noise_text(noise: Comparison) -> String {
    let percent = |share: f64| share * 100.0;
    format!(
        "prevents {}, brings {} ({:.0} to {:.0} %)",
        noise.prevents,
        noise.brings,
        percent(noise.low),
        percent(noise.high)
    )
}

fn weaknesses_text(evidence: &Evidence) -> String {
    let mut text = format!("\n{:<34}{:<14}{}", "weakness", "without it", "with other noise");
    for found in &evidence.weaknesses {
        let noise = found.noise.map_or(String::new(), noise_text);
        let line = format!("{:<34}{:<14}{noise}", found.weakness, found.without.in_words(evidence.noun));
        text.push('\n');
        text.push_str(line.trim_end());
    }
    text
}

fn measured_text(measured: &[Measure]) -> String {
    let mut text =
        format!("\n{:<14}{:<44}{:>8}{:>18}", "module", "in the 5 s before", "worst", "specification");
    for found in measured {
        let module = found.module.name();
        text.push_str(&format!("\n{module:<14}{:<44}{:>8.2}{:>18.2}", found.what, found.worst, found.bound));
    }
    text
}

/// The verdict in a sentence that follows from the evidence alone.
pub fn sentence(diagnosis: &Diagnosis) -> String {
    let Diagnosis { cause, verdict, weakness, evidence } = diagnosis;
    let name = cause.iter().map(|module| module.name()).collect::<Vec<_>>().join(joint(*verdict));
    let (changed, noun) = (changed_text(evidence), evidence.noun);
    // Other modules that prevent it, told apart from chance.
    let told_apart: Vec<&str> = evidence
        .told_apart()
        .filter(|found| !cause.contains(&found.module))
        .map(|found| found.module.name())
        .collect();
    let others = match told_apart.as_slice() {
        [] => String::new(),
        names => format!("; {} would have made up for it", names.join(", ")),
    };
    match verdict {
        Verdict::Outside => {
            let mut found = evidence.modules.iter().filter(|found| cause.contains(&found.module));
            let is_alone = |found: &ModuleFinding| found.alone == Fate::Same;
            let alone = if evidence.baseline == Some(Fate::Vanished) && found.all(is_alone) {
                format!(
                    ", and {} alone lead to it",
                    if cause.len() > 1 { "the errors of each" } else { "its errors" }
                )
            } else {
                String::new()
            };
            let crash = perfect_text(evidence, cause);
            format!("{name} is at fault: {}{alone}{crash}{others}", mended_text(cause, changed, noun))
        }
        Verdict::Weakness => {
            let weakness = weakness.unwrap_or_default();
            format!("{name} is at fault by a documented weakness: without `{weakness}` there is no {noun}")
        }
        Verdict::Measured => {
            let error = evidence.beyond_specification().map_or(String::new(), |found| {
                format!("{} was {:.2}, and {:.2} is specified", found.what, found.worst, found.bound)
            });
            format!("{name} is at fault by what it gave this time: {error}; {changed}, there is no {noun}")
        }
        Verdict::Deciding => format!("{name} is at fault: {}{others}", mended_text(cause, changed, noun)),
        Verdict::Brittle => format!(
            "{name} is brittle: it could not bear the errors of {}, which are within their specification",
            told_apart.join(", ")
        ),
        Verdict::Together => {
            format!("{name} are at fault together: both {changed}, there is no {noun}")
        }
        Verdict::Baseline => {
            let baseline =
                evidence.baseline.map_or_else(|| "the same".to_owned(), |fate| fate.in_words(noun));
            format!(
                "no module is at fault by what differs from the baseline: with all as in the baseline, there is {}",
                if baseline == noun { format!("the {noun} as well") } else { baseline }
            )
        }
        Verdict::Chance => format!(
            "no module is named: what prevents the {noun} with its own noise ({}) is not told apart from chance{}",
            preventing(evidence).join(", "),
            chance_text(evidence)
        ),
        Verdict::Unexplained => "no module is at fault alone, nor are two together".to_owned(),
    }
}

/// That the collision is gone if the module at fault is changed, whichever of several it is.
fn mended_text(cause: &[Module], changed: &str, noun: &str) -> String {
    let one = match cause {
        [_] => return format!("{changed}, there is no {noun}"),
        [_, _] => "either",
        _ => "any of them",
    };
    format!("with {one} {changed} there is no {noun}, and the replays do not tell them apart")
}

/// Says which of the modules that crash by their difference from the baseline crash without any errors as well. With such a
/// module, the collision depends on how the module errs, and not on how much.
fn perfect_text(evidence: &Evidence, cause: &[Module]) -> String {
    let crashes = |found: &&ModuleFinding| matches!(found.idealised, Fate::Same | Fate::Other);
    let found = evidence.modules.iter().filter(|found| cause.contains(&found.module)).filter(crashes);
    let names: Vec<&str> = found.map(|found| found.module.name()).collect();
    let noun = evidence.noun;
    match names.as_slice() {
        [] => String::new(),
        names => format!("; but with {} free of errors there is a {noun} as well", names.join(" or ")),
    }
}

/// How often chance alone prevents the collision.
fn chance_text(evidence: &Evidence) -> String {
    evidence.chance.map_or(String::new(), |chance| {
        format!(": other sensor noise alone prevents it in {} of {} replays", chance.vanished, chance.replays)
    })
}

/// The changes that prevent the collision with the noise that it was recorded with.
fn preventing(evidence: &Evidence) -> Vec<String> {
    let (differs, changed) = (evidence.differs(), changed_text(evidence));
    let modules = evidence.modules.iter().filter(|found| found.vanishes(differs));
    let weaknesses = evidence.weaknesses.iter().filter(|found| !differs && found.vanishes());
    let modules = modules.map(|found| format!("{} {changed}", found.module.name()));
    let weaknesses = weaknesses.map(|found| format!("no `{}`", found.weakness));
    let pairs = evidence.pairs.iter().map(|found| {
        let [first, second] = found.modules.map(|module| module.name());
        format!("{first} and {second} {changed}")
    });
    modules.chain(weaknesses).chain(pairs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_campaign::oracle::Chance;

    /// A diagnosis of a driving system that differs from the baseline in perception, or in nothing.
    fn diagnosis(verdict: Verdict, cause: &[Module], differs: bool) -> Diagnosis {
        let told_apart = Comparison { vanished: 10, prevents: 10, brings: 0, low: 0.69, high: 1.0 };
        let finding = |module| {
            let is_asked = module == Module::Perception;
            ModuleFinding {
                module,
                restored: (differs && is_asked).then_some(Fate::Vanished),
                idealised: if is_asked { Fate::Vanished } else { Fate::Same },
                alone: Fate::Same,
                noise: (is_asked && verdict != Verdict::Chance).then_some(told_apart),
                noise_alone: None,
                signs: Vec::new(),
            }
        };
        let measure = Measure { module: Module::Perception, what: "error, m", worst: 2.0, bound: 1.0 };
        let evidence = Evidence {
            noun: "crash",
            modules: Module::ALL.into_iter().map(finding).collect(),
            baseline: differs.then_some(Fate::Vanished),
            ideal: Fate::Vanished,
            weaknesses: Vec::new(),
            pairs: Vec::new(),
            chance: Some(Chance { replays: 64, vanished: 61 }),
            measured: vec![measure],
            from_s: 0.0,
        };
        Diagnosis { cause: cause.to_vec(), verdict, weakness: None, evidence }
    }

    #[test]
    fn a_sentence_says_what_the_table_says() {
        let perception = [Module::Perception];
        for (found, wanted) in [
            (
                diagnosis(Verdict::Outside, &perception, true),
                "perception is at fault: as in the baseline, there is no crash, and its errors alone lead to it",
            ),
            (
                diagnosis(Verdict::Measured, &perception, false),
                "perception is at fault by what it gave this time: error, m was 2.00, and 1.00 is specified; \
                 without errors, there is no crash",
            ),
            (
                diagnosis(Verdict::Brittle, &[Module::Planning], false),
                "planning is brittle: it could not bear the errors of perception, which are within their \
                 specification",
            ),
            (
                diagnosis(Verdict::Chance, &[], true),
                "no module is named: what prevents the crash with its own noise (perception as in the baseline) is \
                 not told apart from chance: other sensor noise alone prevents it in 61 of 64 replays",
            ),
        ] {
            assert_eq!(sentence(&found), wanted);
        }
    }

    #[test]
    fn a_sentence_says_what_weakens_it() {
        let mut found = diagnosis(Verdict::Outside, &[Module::Perception], true);
        found.evidence.modules[Module::Perception as usize].idealised = Fate::Same;
        assert_eq!(
            sentence(&found),
            "perception is at fault: as in the baseline, there is no crash, and its errors alone lead to it; but \
             with perception free of errors there is a crash as well"
        );
        let mut found = diagnosis(Verdict::Outside, &[Module::Perception, Module::Tracking], true);
        let told_apart = found.evidence.modules[Module::Perception as usize].clone();
        let tracking = ModuleFinding { module: Module::Tracking, alone: Fate::Vanished, ..told_apart };
        found.evidence.modules[Module::Tracking as usize] = tracking;
        assert_eq!(
            sentence(&found),
            "perception or tracking is at fault: with either as in the baseline there is no crash, and the replays \
             do not tell them apart"
        );
    }

    #[test]
    fn a_table_has_the_counts_of_the_replays() {
        let text = table_text(&diagnosis(Verdict::Outside, &[Module::Perception], true).evidence);
        assert!(text.contains("prevents 10, brings 0 (69 to 100 %)"), "{text}");
        assert!(text.contains("no crash in 61 of 64"), "{text}");
    }
}
