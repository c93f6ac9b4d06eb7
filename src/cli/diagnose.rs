//! `avastra diagnose`: which module of the driving system a scenario's collision is the fault of.

use crate::ads::Module;
use crate::episode::Collision;
use crate::model::vocabulary::Word;
use crate::oracle;
use crate::oracle::Diagnosis;
use crate::oracle::Likelihood;
use crate::oracle::WeaknessFinding;
use crate::study;
use crate::study::Stage;

use super::arguments::DiagnoseArguments;
use super::error::Failure;
use super::load;
use super::output::Output;

/// Plays the scenario again with one module idealised at a time.
pub fn diagnose(output: &Output, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    let (table, scenario) = load::scenario(output, &arguments.file)?;
    let usage = |error: &dyn std::error::Error| Failure::usage(error.to_string());
    let mut ads = match &arguments.ads_config {
        Some(_) => study::driving_system(scenario.origin.ads.as_deref().unwrap_or(study::DEFAULT_ADS)),
        None => study::recorded(&scenario),
    }
    .map_err(|error| usage(&error))?;
    if let Some(path) = &arguments.ads_config {
        ads = ads.with_profile(load::profile(path)?).map_err(|error| usage(&error))?;
    }
    let stage = Stage::new(&table, &scenario).map_err(|error| usage(&error))?;
    let log = stage.play(&ads, &mut |_, _, _| {});
    let judgements = stage.judge(&ads, &log);
    let Some(&index) = oracle::counted(table.space(), &log, &judgements).first() else {
        let count = super::progress::plural(log.collisions.len(), "collision");
        return Err(Failure::usage(format!(
            "`{}` has no counted collision to explain with this driving system ({count} in all)",
            scenario.name
        )));
    };
    let setup = stage.setup(&ads);
    let baseline = arguments.baseline.as_deref().map(load::profile).transpose()?.unwrap_or_default();
    let diagnosis = oracle::diagnose(&setup, &log, index, &baseline).map_err(|error| usage(&error))?;
    let likelihood = arguments.likelihood.map(|count| oracle::likelihood(&setup, &log, index, count));
    let collision = &log.collisions[index];
    output.tell(&heading(collision));
    output.say(&table_text(&diagnosis));
    output.say(&weaknesses_text(&diagnosis.weaknesses));
    output.say(&sentence(&diagnosis));
    if let Some(likelihood) = &likelihood {
        output.say(&likelihood_text(likelihood));
    }
    output.result(
        "diagnose",
        serde_json::json!({
            "file": arguments.file, "scenario": scenario.name, "ads": ads.name(),
            "obstacle": collision.contact.obstacle, "time_s": collision.contact.time_s,
            "diagnosis": diagnosis, "likelihood": likelihood,
        }),
    );
    Ok(())
}

fn heading(collision: &Collision) -> String {
    format!(
        "{} npc#{} ({}) is hit at {:.2} s",
        collision.body.name(),
        collision.contact.obstacle,
        collision.verb.name(),
        collision.contact.time_s
    )
}

fn table_text(diagnosis: &Diagnosis) -> String {
    let mut text = format!(
        "\n{:<14}{:<20}{:<20}{}",
        "module", "as in the baseline", "without its errors", "its errors alone"
    );
    for found in &diagnosis.modules {
        let prevented =
            found.prevented.map_or(String::new(), |share| format!("prevents {:.0} %", share * 100.0));
        let line = format!(
            "\n{:<14}{:<20}{:<20}{:<18}{prevented}",
            found.module.name(),
            found.restored.map_or("the same", oracle::Fate::in_words),
            found.idealised.in_words(),
            found.alone.in_words()
        );
        text.push('\n');
        text.push_str(line.trim());
    }
    text.push_str(&format!("\n{:<34}{}", "all of them", diagnosis.ideal.in_words()));
    for [first, second] in &diagnosis.pairs {
        text.push_str(&format!(
            "\n{} and {}: no crash without the errors of both",
            first.name(),
            second.name()
        ));
    }
    text
}

fn weaknesses_text(weaknesses: &[WeaknessFinding]) -> String {
    let mut text = format!("\n{:<34}{}", "weakness", "without it");
    for found in weaknesses {
        text.push_str(&format!("\n{:<34}{}", found.weakness, found.without.in_words()));
    }
    text
}

/// The cause in a sentence.
fn sentence(diagnosis: &Diagnosis) -> String {
    let others: Vec<&str> = diagnosis
        .modules
        .iter()
        .filter(|found| found.suffices() && !diagnosis.cause.contains(&found.module))
        .map(|found| found.module.name())
        .collect();
    let finding = |module: Module| diagnosis.modules.iter().find(|found| found.module == module);
    match diagnosis.cause.as_slice() {
        [] if diagnosis.varied_crashes.is_some() => {
            "\nit hung by a hair: small variations do not crash, and no module can be named".to_owned()
        }
        [] => "\nno module is at fault alone, nor are two together".to_owned(),
        [module] => {
            let found = finding(*module);
            let alone = found.is_some_and(|found| found.alone == oracle::Fate::Crash);
            let cure = match found.and_then(|found| found.restored) {
                Some(oracle::Fate::Vanished) => "as in the baseline, there is no crash",
                _ => "without its errors there is no crash",
            };
            let alone = if alone && diagnosis.ideal == oracle::Fate::Vanished {
                ", and they alone lead to it"
            } else {
                ""
            };
            let others = match others.as_slice() {
                [] => String::new(),
                names => format!("; {} would have made up for it", names.join(", ")),
            };
            let name = module.name();
            format!("\n{name} is at fault: {cure}{alone}{others}")
        }
        modules => {
            let names: Vec<&str> = modules.iter().map(|module| module.name()).collect();
            let names = names.join(" and ");
            format!("\n{names} are at fault together: without the errors of both there is no crash")
        }
    }
}

fn likelihood_text(likelihood: &Likelihood) -> String {
    format!(
        "\n{} of {} small variations crash: {:.0} %, between {:.0} and {:.0} % (95 %)",
        likelihood.crashes,
        likelihood.variations,
        likelihood.share * 100.0,
        likelihood.low * 100.0,
        likelihood.high * 100.0
    )
}
