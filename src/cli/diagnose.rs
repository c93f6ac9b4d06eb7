//! `avastra diagnose`: which module of the driving system is at fault for a scenario's collision or breach.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_base::statistics::Estimate;
use avastra_campaign::episode::EpisodeLog;
use avastra_campaign::oracle::{
    self, Branched, Comparison, Diagnosis, Evidence, Fate, Found, Likelihood, Measure, MechanismShare,
    Mechanisms, ModuleFinding, NoReturn, Verdict,
};
use avastra_campaign::run::{Asked, Stage};
use avastra_drivers::{ModularConfig, Module, Selected};
use avastra_lang::model::Scenario;
use avastra_lang::model::vocabulary::Word;
use avastra_world::action::ActionTable;
use avastra_world::sim::Contact;

use super::arguments::{CountedBy, DiagnoseArguments};
use super::error::Failure;
use super::findings::needs_program;
use super::load;
use super::look;
use super::output::{Output, plural};
use super::parallel::each_file;

/// Says which module is at fault for what every file is about: its first counted collision, or else the first breach that it
/// claims. Or, with
/// `--mechanisms`, which share of all of these each documented weakness causes.
pub fn diagnose(output: &Output, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    let asked = load::asked(arguments.against.ads.as_deref())?;
    if arguments.mechanisms {
        return mechanisms(output, arguments, &asked);
    }
    if arguments.moment {
        return moments(output, arguments, &asked);
    }
    let baseline = arguments.baseline.as_deref().map(load::profile).transpose()?.unwrap_or_default();
    let found =
        each_file(output, &arguments.many, None, |file| explain(output, arguments, &asked, &baseline, file))?;
    match found.done.as_slice() {
        [only] if found.is_single() => tell_one(output, only),
        several => several.iter().for_each(|found| {
            output.tell(&format!("{}: {}", found.file.shown(), sentence(&found.diagnosis)));
        }),
    }
    let [causes, cures] = [Explained::cause, Explained::cure].map(|of| counted(&found.done, of));
    if !found.is_single() {
        let (head, counts) = match arguments.by {
            CountedBy::Cause => ("at fault", &causes),
            CountedBy::Cure => ("removed by", &cures),
        };
        output.say(&format!("\n{}, {head}:", plural(found.done.len(), "finding")));
        counts.iter().for_each(|(of, count)| output.say(&format!("{count:>6}  {of}")));
    }
    let told = |name: &str, counts: &[(String, usize)]| -> Vec<serde_json::Value> {
        counts.iter().map(|(of, count)| serde_json::json!({ name: of, "count": count })).collect()
    };
    output.result(serde_json::json!({
        "causes": told("cause", &causes), "cures": told("cure", &cures), "mechanisms": null, "placebo": null,
        "scenarios": found.done.iter().map(Explained::in_json).collect::<Vec<_>>(),
        "failed": found.failed_in_json(),
    }));
    found.complete("explained")
}

/// How often each cause, or each cure, was found; the most frequent first.
fn counted(found: &[Explained], of: fn(&Explained) -> String) -> Vec<(String, usize)> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    found.iter().for_each(|found| *counts.entry(of(found)).or_default() += 1);
    let mut counts: Vec<(String, usize)> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| core::cmp::Reverse(*count));
    counts
}

/// All about one finding.
fn tell_one(output: &Output, found: &Explained) {
    output.tell(&found.heading);
    let evidence = &found.diagnosis.evidence;
    output.say(&table_text(evidence));
    output.say(&weaknesses_text(evidence));
    if !evidence.measured.is_empty() {
        output.say(&measured_text(&evidence.measured));
    }
    output.say(&format!("\n{}", sentence(&found.diagnosis)));
    if let Some(likelihood) = &found.likelihood {
        output.say(&likelihood_text(likelihood, evidence.noun));
    }
}

/// A scenario that was played, with what it is about.
struct Case<'a> {
    stage: Stage<'a>,
    ads: Selected,
    log: EpisodeLog,
    found: Found,
}

impl Case<'_> {
    fn of<'a>(table: &'a ActionTable, scenario: &'a Scenario, asked: &Asked) -> Result<Case<'a>, Failure> {
        let (ads, _) = asked.selected_for(scenario)?;
        let stage = Stage::new(table, scenario)?;
        let (log, _, found) = stage.first_found(&ads);
        let Some(found) = found else {
            let count = plural(log.collisions.len(), "collision");
            let loose = ads.program().filter(|program| !program.is_deterministic());
            let hint = loose.map_or("", |_| "; it is not deterministic, so another play may have it");
            return Err(Failure::usage(format!(
                "`{}` {} with this driving system ({count} in all){hint}",
                scenario.name,
                stage.lack_in_words()
            )));
        };
        Ok(Case { stage, ads, log, found })
    }
}

/// The diagnosis of one file.
struct Explained {
    file: PathBuf,
    scenario: String,
    ads: &'static str,
    /// The finding, in words and in JSON.
    heading: String,
    what: serde_json::Value,
    diagnosis: Diagnosis,
    likelihood: Option<Likelihood>,
}

impl Explained {
    fn in_json(&self) -> serde_json::Value {
        let mut told = serde_json::json!({
            "file": self.file, "scenario": self.scenario, "ads": self.ads, "diagnosis": self.diagnosis,
            "likelihood": self.likelihood,
        });
        if let (Some(told), Some(what)) = (told.as_object_mut(), self.what.as_object()) {
            told.extend(what.clone());
        }
        told
    }

    /// The cause in a word or two.
    fn cause(&self) -> String {
        let names: Vec<&str> = self.diagnosis.cause.iter().map(|module| module.name()).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(joint(self.diagnosis.verdict)) }
    }

    /// The smallest change that removes the finding, told apart from chance. The change is a weakness that is switched
    /// off, or else modules that are as in the baseline or without errors.
    fn cure(&self) -> String {
        let change = match (self.diagnosis.weakness, self.diagnosis.verdict) {
            (Some(weakness), _) => return format!("without `{weakness}`"),
            (None, Verdict::Outside) => "as in the baseline",
            (None, Verdict::Brittle) => return "none of one module".to_owned(),
            (None, _) if self.diagnosis.cause.is_empty() => return "none".to_owned(),
            (None, _) => "without errors",
        };
        format!("{} {change}", self.cause())
    }
}

/// The word between the names of several modules: two prevent the collision together, or they are not told apart.
fn joint(verdict: Verdict) -> &'static str {
    if verdict == Verdict::Together { " and " } else { " or " }
}

fn explain(
    output: &Output,
    arguments: &DiagnoseArguments,
    asked: &Asked,
    baseline: &ModularConfig,
    file: &Path,
) -> Result<Explained, Failure> {
    let (table, scenario) = look::unchanged(output, file)?;
    let Case { stage, ads, log, found } = Case::of(&table, &scenario, asked)?;
    let setup = stage.setup(&ads);
    let diagnosis = oracle::diagnose(&setup, &log, found, baseline).map_err(Failure::usage)?;
    let likelihood = arguments.likelihood.map(|count| oracle::likelihood(&setup, &log, found, count));
    let (heading, what) = told(&table, &log, found);
    let (file, scenario) = (file.to_owned(), scenario.name.clone());
    Ok(Explained { file, scenario, ads: ads.name(), heading, what, diagnosis, likelihood })
}

/// The share of all files' crashes that vanish without each documented weakness, and by chance.
fn mechanisms(output: &Output, arguments: &DiagnoseArguments, asked: &Asked) -> Result<(), Failure> {
    let found = each_file(output, &arguments.many, None, |file| {
        let (table, scenario) = look::unchanged(output, file)?;
        let Case { stage, ads, log, found } = Case::of(&table, &scenario, asked)?;
        let found = oracle::mechanisms(&stage.setup(&ads), &log, found).map_err(Failure::usage)?;
        Ok((file.clone(), scenario.name.clone(), found))
    })?;
    let crashes: Vec<Mechanisms> = found.done.iter().map(|(_, _, crash)| crash.clone()).collect();
    let (shares, placebo) = (oracle::mechanism_shares(&crashes), oracle::placebo(&crashes));
    output.say(&shares_text(crashes.len(), &shares, placebo.as_ref()));
    let scenarios = found.done.iter().map(|(file, scenario, crash)| {
        serde_json::json!({
            "file": file, "scenario": scenario, "without": crash.without, "placebo": crash.placebo,
        })
    });
    output.result(serde_json::json!({
        "causes": null, "cures": null, "mechanisms": shares, "placebo": placebo, "scenarios": scenarios.collect::<Vec<_>>(),
        "failed": found.failed_in_json(),
    }));
    found.complete("explained")
}

/// With `--moment`, from when on each finding was all but certain.
fn moments(output: &Output, arguments: &DiagnoseArguments, asked: &Asked) -> Result<(), Failure> {
    let found = each_file(output, &arguments.many, asked.external.as_ref(), |file| {
        let (table, scenario) = look::unchanged(output, file)?;
        let Case { stage, ads, log, found } = Case::of(&table, &scenario, asked)?;
        if !oracle::can_replay(&ads) {
            return Err(needs_program(&scenario.name, "branch"));
        }
        let risen = oracle::no_return(&stage.setup(&ads), &log, found, oracle::REPLAYS);
        Ok((file.clone(), scenario.name.clone(), found.noun(), risen))
    })?;
    for (file, _, noun, risen) in &found.done {
        output.say(&format!("{}: {}", file.shown(), moment_text(noun, risen)));
        if found.is_single() {
            let line =
                |at: &Branched| format!("  {:>6.1} s  {:<12} {}", at.time_s, bar(at.share()), at.again);
            output.say(&risen.moments.iter().map(line).collect::<Vec<_>>().join("\n"));
        }
    }
    let scenarios = found.done.iter().map(|(file, scenario, _, risen)| {
        let mut told = serde_json::json!({ "file": file, "scenario": scenario });
        let risen = serde_json::to_value(risen).expect("it is plain data");
        if let (Some(told), Some(risen)) = (told.as_object_mut(), risen.as_object()) {
            told.extend(risen.clone());
        }
        told
    });
    output.result(serde_json::json!({
        "causes": null, "cures": null, "mechanisms": null, "placebo": null,
        "scenarios": scenarios.collect::<Vec<_>>(), "failed": found.failed_in_json(),
    }));
    found.complete("explained")
}

/// When a finding became certain, in words.
fn moment_text(noun: &str, risen: &NoReturn) -> String {
    let percent = |at: &Branched| format!("{:.0} %", 100.0 * at.share());
    let NoReturn { found_s, moments, rises_s, avoidable_until_s } = risen;
    let rise = match (rises_s, risen.ends()) {
        (Some(_), [Some(low), Some(high)]) => format!(
            "until {:.1} s there was the {noun} in {} of the branches, from {:.1} s on in {}",
            low.time_s,
            percent(low),
            high.time_s,
            percent(high)
        ),
        (Some(rises_s), _) => {
            format!("from {rises_s:.1} s on there was the {noun} in more than three quarters of the branches")
        }
        (None, _) if moments.first().is_some_and(Branched::is_likely) => format!(
            "at each moment of the last {:.0} s there was the {noun} in most branches: it was certain before",
            found_s - moments[0].time_s
        ),
        (None, _) => format!("up to the last moment many branches had no {noun}: chance made it"),
    };
    let avoidable = avoidable_until_s.map_or(String::new(), |until_s| {
        format!("; a careful driver who takes over avoids it until {until_s:.1} s")
    });
    format!("{noun} at {found_s:.2} s; {rise}{avoidable}")
}

/// A share as a bar of ten signs.
fn bar(share: f64) -> String {
    let full = (10.0 * share).round() as usize;
    format!("{}{}", "█".repeat(full), "·".repeat(10 - full))
}

fn shares_text(crashes: usize, shares: &[MechanismShare], placebo: Option<&Estimate>) -> String {
    let mut text = format!(
        "{}; each weakness switched off alone when the obstacle appears, what vanishes (95 %):\n\
         {:<34}{:<24}{:<24}{}",
        plural(crashes, "finding"),
        "weakness",
        "with its own noise",
        "with other noise",
        "beyond chance"
    );
    let mut line = |weakness: &str, as_it_was: &str, noise: Option<&Estimate>, beyond: Option<&Estimate>| {
        let [noise, beyond] = [noise, beyond].map(|found| found.map_or(String::new(), percent_text));
        let line = format!("{weakness:<34}{as_it_was:<24}{noise:<24}{beyond}");
        text.push_str(&format!("\n{}", line.trim_end()));
    };
    for found in shares {
        let share = &found.as_it_was;
        let [part, low, high] = [share.share, share.low, share.high].map(|share| share * 100.0);
        let as_it_was = format!("{:>4} {part:>4.0} % ({low:.0} to {high:.0})", share.vanished);
        line(found.mechanism, &as_it_was, found.other_noise.as_ref(), found.beyond_chance.as_ref());
    }
    line("none, by chance", "", placebo, None);
    text
}

/// A mean share with its interval, in percent.
fn percent_text(share: &Estimate) -> String {
    let percent = |share: f64| share * 100.0;
    let interval = share.interval.and_then(|interval| Some((interval.low, interval.high?)));
    let interval = interval
        .map_or(String::new(), |(low, high)| format!(" ({:.0} to {:.0})", percent(low), percent(high)));
    format!("{:>4.0} %{interval}", percent(share.mean))
}

/// The finding, in words and in JSON.
fn told(table: &ActionTable, log: &EpisodeLog, found: Found) -> (String, serde_json::Value) {
    match found {
        Found::Collision(index) => {
            let collision = &log.collisions[index];
            let Contact { obstacle, time_s, ruling, .. } = collision.contact;
            let priority = ruling.priority;
            let body = table.space().body_name(collision.body);
            let (verb, first) = (collision.verb.name(), ruling.describe());
            let heading = format!("{body} npc#{obstacle} ({verb}) is hit at {time_s:.2} s; {first}");
            let priority = priority.name();
            (heading, serde_json::json!({ "obstacle": obstacle, "time_s": time_s, "priority": priority }))
        }
        Found::Breach(index) => {
            let breach = &log.breaches[index];
            let (name, time_s) = (&table.space().requirements[breach.requirement].name, breach.time_s);
            let heading = format!("`{name}` is not kept at {time_s:.2} s");
            (heading, serde_json::json!({ "requirement": name, "time_s": time_s }))
        }
    }
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
fn noise_text(noise: Comparison) -> String {
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
fn sentence(diagnosis: &Diagnosis) -> String {
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

fn likelihood_text(likelihood: &Likelihood, noun: &str) -> String {
    format!(
        "\n{} of {} small variations have the {noun}: {:.0} %, between {:.0} and {:.0} % (95 %)",
        likelihood.crashes,
        likelihood.variations,
        likelihood.share * 100.0,
        likelihood.low * 100.0,
        likelihood.high * 100.0
    )
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
