//! `avastra estimate`: how often would it crash; and `avastra compare`: which of two crashes more often.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::estimate::{
    Comparison, ComparisonResults, Estimate, EstimateDatabase, EstimateResults, EstimateSettings, EventKind,
    Method, Probability, RoadEstimate, compared, play_parts,
};
use crate::run::{Run, RunSettings};
use crate::statistics::Interval;

use super::arguments::{CompareArguments, EstimateArguments, EventArgument, MethodArgument};
use super::error::Failure;
use super::files::write;
use super::interrupt::stop_on_interrupt;
use super::load::UnderTest;
use super::output::{Output, plural};
use super::parallel::jobs;
use super::progress::Progress;
use super::run_directory::{Held, Resumed};
use super::{conditions, load, run_directory};

/// Plays what an estimate still lacks and prints its result.
pub fn estimate(output: &Output, arguments: &EstimateArguments) -> Result<(), Failure> {
    let (estimate, held, settings) = match &arguments.resume {
        Some(path) => resumed(output, path)?,
        None => begun(output, arguments)?,
    };
    let path = held.path.clone();
    let file = path.join("estimate.db");
    let stop = stop_on_interrupt();
    let mut database =
        EstimateDatabase::open(&file, &settings).map_err(|error| Failure::file("open", &file, error))?;
    let unread = |error| Failure::file("read", &file, error);
    let done: Vec<_> = database.parts().map_err(unread)?.iter().map(|record| record.part).collect();
    let todo: Vec<_> = estimate.parts().into_iter().filter(|part| !done.contains(part)).collect();
    output.tell(&heading(&estimate, &path));

    let episodes = u64::from(estimate.settings().run.episodes);
    let mut progress =
        Progress::new(output, estimate.parts().len() as u64 * episodes, done.len() as u64 * episodes);
    let jobs = jobs(arguments.jobs, estimate.run().program())?;
    play_parts(&estimate, &todo, jobs, &stop, &mut |record| {
        // Such a part says nothing, and is not kept: with a repaired system the estimate can go on.
        if record.failed > 0 {
            output.say("no estimate: the driving system failed; `avastra run` with it says how");
            return Err(Failure::Ads { findings: record.failed as usize });
        }
        for number in 0..record.episodes {
            progress.episode(usize::from(number < record.events));
        }
        database.add(&estimate, &record).map_err(|error| Failure::file("write", &file, error))
    })?;
    drop(progress);

    let records = database.parts().map_err(unread)?;
    let results = EstimateResults::new(estimate.settings(), &records);
    let text = serde_json::to_string_pretty(&results).expect("results have string keys only");
    write(&path.join("results.json"), &format!("{text}\n"))?;
    output.say(&estimate_text(&results));
    let is_unfinished = results.parts < results.parts_wanted;
    output.result(serde_json::json!({ "directory": path, "results": results }));
    if stop.load(Ordering::Relaxed) && is_unfinished {
        return Err(Failure::Interrupted { command: "estimate", directory: path });
    }
    Ok(())
}

/// A new estimate, from the command line, with the text of its settings.
fn begun(output: &Output, arguments: &EstimateArguments) -> Result<(Estimate, Held, String), Failure> {
    let file = arguments.file.as_ref().expect("clap asks for it where there is no `--resume`");
    let table = load::table(output, file)?;
    let under_test = conditions::named(&arguments.under_test)?;
    let (conditions, episodes) = (&arguments.conditions, arguments.episodes);
    let settings = EstimateSettings {
        event: event(arguments.event),
        method: match arguments.method {
            MethodArgument::Count => Method::Count,
            MethodArgument::Split => Method::Split,
        },
        parts: arguments.parts,
        run: conditions::settings(table.space(), conditions, &conditions.agent, under_test, episodes)?,
    };
    let estimate = Estimate::new(table, settings).map_err(Failure::usage)?;
    let held = run_directory::create_empty(arguments.out.as_deref())?;
    let space = load::relative(&held.path, &estimate.run().space().path)?;
    let settings = estimate.settings().clone();
    let settings = EstimateSettings { run: RunSettings { space, ..settings.run }, ..settings };
    let text = run_directory::write_settings(&held.path, "estimate", &settings)?;
    Ok((estimate, held, text))
}

/// The rest of an interrupted estimate, with the text of its settings.
fn resumed(output: &Output, path: &Path) -> Result<(Estimate, Held, String), Failure> {
    let resumed: Resumed<EstimateSettings> = run_directory::resume(output, path, "estimate", "estimate")?;
    let Resumed { settings, text, table, held } = resumed;
    Ok((Estimate::new(table, settings).map_err(Failure::usage)?, held, text))
}

/// Plays two driving systems in the same episodes.
pub fn compare(output: &Output, arguments: &CompareArguments) -> Result<(), Failure> {
    let table = load::table(output, &arguments.file)?;
    let side = |named: &str| {
        let (conditions, under_test) = (&arguments.conditions, side_of(named)?);
        let episodes = arguments.episodes;
        let settings =
            conditions::settings(table.space(), conditions, &conditions.agent, under_test, episodes)?;
        Ok::<_, Failure>(Run::new(table.clone(), settings)?)
    };
    let (first, second) = (side(&arguments.first)?, side(&arguments.second)?);
    let comparison = Comparison { first, second, event: event(arguments.event) };
    let numbers: Vec<usize> = (0..comparison.pairs()).collect();
    output.tell(&format!(
        "{}: {} and {} in the same {}",
        arguments.file.display(),
        arguments.first,
        arguments.second,
        plural(numbers.len(), "episode")
    ));
    // Nothing is kept of a comparison, so Ctrl-C ends it at once.
    let stop = AtomicBool::new(false);
    let mut progress = Progress::new(output, numbers.len() as u64, 0);
    let mut pairs = Vec::new();
    // Whichever has a program serves so many at a time.
    let program = comparison.first.program().or(comparison.second.program());
    let jobs = jobs(arguments.jobs, program)?;
    compared(&comparison, &numbers, jobs, &stop, &mut |pair| {
        progress.episode(usize::from(pair.first.happened) + usize::from(pair.second.happened));
        pairs.push(pair);
        Ok::<_, Failure>(())
    })?;
    drop(progress);
    let failed =
        pairs.iter().map(|pair| usize::from(pair.first.failed) + usize::from(pair.second.failed)).sum();
    if failed > 0 {
        output.say("no comparison: a driving system failed; `avastra run` with it says how");
        return Err(Failure::Ads { findings: failed });
    }
    let results = ComparisonResults::new(comparison.event, &pairs).expect("there is at least one episode");
    let sides = [&arguments.first, &arguments.second];
    output.say(&comparison_text(&results, sides));
    output.result(serde_json::json!({ "sides": sides, "results": results }));
    Ok(())
}

/// The driving system of a side: a profile if it is a file, else a name.
fn side_of(named: &str) -> Result<UnderTest, Failure> {
    let path = Path::new(named);
    if path.extension().is_some_and(|extension| extension == "yaml" || extension == "yml") {
        return load::under_test(crate::run::DEFAULT_ADS, Some(path), None);
    }
    load::under_test(named, None, None)
}

fn event(argument: EventArgument) -> EventKind {
    match argument {
        EventArgument::Counted => EventKind::Counted,
        EventArgument::Collision => EventKind::Collision,
    }
}

fn heading(estimate: &Estimate, directory: &Path) -> String {
    let settings = estimate.settings();
    let method = match settings.method {
        Method::Count => "by counting",
        Method::Split => "by splitting",
    };
    format!(
        "{}: how often {} under {} against {}, {method}, {} of {} on {}, seed {}, into {}",
        estimate.run().space().path.display(),
        settings.event.in_words(),
        settings.run.agent,
        estimate.run().ads_name(),
        plural(settings.parts as usize, "part"),
        plural(settings.run.episodes as usize, "episode"),
        settings.run.roads.join(", "),
        settings.run.seed,
        directory.display()
    )
}

fn estimate_text(results: &EstimateResults) -> String {
    let mut text = String::new();
    if results.parts < results.parts_wanted {
        text.push_str(&format!("unfinished: {} of {} parts\n", results.parts, results.parts_wanted));
    }
    text.push_str(&format!("\nepisodes with {}; in brackets: 95 % intervals\n", results.event.in_words()));
    for road in &results.roads {
        text.push_str(&format!("  {}: {}\n", road.road, probability_text(&road.estimate)));
    }
    match &results.together {
        Some(all) if results.roads.len() > 1 => {
            text.push_str(&format!("  all roads: {}\n", probability_text(all)));
        }
        _ => {}
    }
    if let Some(gain) = results.together.as_ref().and_then(|all| all.gain) {
        let (factor, how) = if gain >= 1.0 { (gain, "less") } else { (1.0 / gain, "more") };
        text.push_str(&format!(
            "roughly {factor:.1} times {how} simulated time than counting for the same precision (from the spread of the parts)\n"
        ));
    }
    let misses = |road: &RoadEstimate| 2 * road.estimate.parts_without > road.estimate.parts;
    if results.method == Method::Split && results.roads.iter().any(misses) {
        text.push_str(
            "where most parts have not found it, the interval is too short: say more `--episodes`\n",
        );
    }
    text.trim_end().to_owned()
}

fn probability_text(found: &Probability) -> String {
    let rate = match (found.per_1000_km, found.per_1000_km_interval) {
        (Some(rate), interval) => format!(", {} in 1000 km", bracketed(rate, interval)),
        (None, _) => String::new(),
    };
    let without = match found.parts_without {
        0 => String::new(),
        _ if found.interval.is_none() => String::new(),
        without => format!("; {without} of {} without", plural(found.parts, "part")),
    };
    let spread = match found.interval {
        None => format!("; all {} alike: no interval", plural(found.parts, "part")),
        Some(_) => String::new(),
    };
    format!(
        "{}{rate}{spread}{without} ({} over {:.1} km, {:.2} h simulated)",
        bracketed(found.probability, found.interval),
        plural(found.episodes as usize, "episode"),
        found.driven_km,
        found.simulated_h
    )
}

/// `0.00123 [0.0004, 0.0021]`.
fn bracketed(value: f64, interval: Option<Interval>) -> String {
    match interval {
        None => figures(value),
        Some(Interval { low, high }) => {
            format!("{} [{}, {}]", figures(value), figures(low), high.map_or("∞".to_owned(), figures))
        }
    }
}

/// Three significant figures.
fn figures(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2 - libm::log10(value.abs()).floor() as i32).clamp(0, 12) as usize;
    if value.abs() < 1e-4 { format!("{value:.2e}") } else { format!("{value:.digits$}") }
}

fn comparison_text(results: &ComparisonResults, [first, second]: [&String; 2]) -> String {
    let [of_first, of_second] = results.probability;
    let [interval_first, interval_second] = results.intervals.map(Some);
    let [km_first, km_second] = results.driven_km;
    let mut text = format!(
        "\nepisodes with {} of {}; in brackets: 95 % intervals\n",
        results.event.in_words(),
        results.episodes
    );
    text.push_str(&format!("  {first}: {} over {km_first:.1} km\n", bracketed(of_first, interval_first)));
    text.push_str(&format!("  {second}: {} over {km_second:.1} km\n", bracketed(of_second, interval_second)));
    text.push_str(&format!(
        "the same in both: {} with, {} without; {first} alone: {}, {second} alone: {}\n",
        results.both,
        results.episodes - results.both - results.first_only - results.second_only,
        results.first_only,
        results.second_only
    ));
    text.push_str(&format!(
        "difference: {}, sign test p {}\n",
        bracketed(results.difference, Some(results.difference_interval)),
        if results.p < 1e-4 { "< 0.0001".to_owned() } else { format!("= {:.4}", results.p) }
    ));
    text.push_str(&match results.told_apart_km {
        Some(km) => {
            format!("told apart after {km:.0} km of both together (looked at after each pair: no test)")
        }
        None => "not told apart".to_owned(),
    });
    text
}
