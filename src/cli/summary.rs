//! The summary of a run or a training in words: totals, refusals, groups of failures, requirements, scenarios, and what to do next.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::oracle::mixed_text;
use avastra_campaign::run::{FoundIn, Group, RefusalCount, RequirementCount, Totals, cause_text};

use super::output::{for_shell, plural};

/// Episodes that did not arrive that are named at most.
const NOT_ARRIVED_NAMED: usize = 3;

/// Largest number of critical scenarios, groups and refusal reasons that the summary lists.
const NAMED_MAX: usize = 10;

/// `not_arrived`: the names of the episodes that did not arrive.
pub fn totals_text(
    totals: &Totals,
    not_arrived: &[String],
    elapsed_s: f64,
    played: usize,
    is_mixed: bool,
) -> String {
    let ends = [
        (totals.arrived, "at the goal"),
        (totals.stalled, "stalled"),
        (totals.blocked, "blocked by others"),
        (totals.astray, "out of its lane"),
        (totals.left_map, "off the map"),
        (totals.step_limit, "at the step limit"),
        (totals.failed, "because the driving system failed"),
    ];
    let ends = ends.iter().filter(|(count, _)| *count > 0).map(|(count, how)| format!("{count} {how}"));
    let ends: Vec<String> = ends.collect();
    let mut text = format!("\n{} ended", plural(totals.episodes as usize, "episode"));
    if !ends.is_empty() {
        text.push_str(&format!(": {}", ends.join(", ")));
    }
    if !not_arrived.is_empty() {
        let named =
            not_arrived.iter().take(NOT_ARRIVED_NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
        let others = match not_arrived.len().saturating_sub(NOT_ARRIVED_NAMED) {
            0 => String::new(),
            more => format!(" and {}", plural(more, "other")),
        };
        text.push_str(&format!("\nnot at the goal: {named}{others}"));
    }
    let (driven_km, simulated_min) = (totals.driven_m / 1000.0, totals.simulated_s / 60.0);
    text.push_str(&format!("\n{driven_km:.1} km in {simulated_min:.1} min of simulated time"));
    if played == totals.episodes as usize && elapsed_s > 0.0 {
        text.push_str(&format!(" ({elapsed_s:.1} s, {:.0} times real time)", totals.simulated_s / elapsed_s));
    }
    text.push_str(&format!(
        "\n{} in {}; {} counted in {}",
        plural(totals.collisions as usize, "collision"),
        plural(totals.episodes_with_collision as usize, "episode"),
        totals.counted,
        plural(totals.episodes_with_counted as usize, "episode"),
    ));
    if let Some(first_s) = totals.first_counted_s_mean {
        text.push_str(&format!(", the first after {first_s:.1} s on average"));
    }
    if totals.replayed > 0 {
        text.push_str(&format!(
            "\n{} of {} {} under other noise (a finding does if its 95 % interval lies above one half)",
            totals.recurring,
            plural(totals.replayed as usize, "finding"),
            if totals.replayed == 1 { "recurs" } else { "recur" }
        ));
        text.push_str(&mixed_text(is_mixed));
    }
    if totals.others_crashed > 0 {
        let episodes = plural(totals.others_crashed as usize, "episode");
        text.push_str(&format!("\nother road users crashed into each other in {episodes}"));
    }
    if totals.red_runs > 0 {
        text.push_str(&format!("\n{} passed", plural(totals.red_runs as usize, "red light")));
    }
    if totals.red_unkept > 0 {
        text.push_str(&format!(
            "; {} of these kept as no scenario, because nothing of the space asks about red lights: `law.ava` has a \
             requirement that does",
            plural(totals.red_unkept as usize, "episode")
        ));
    }
    if totals.collisions > 0 {
        text.push_str("\nan episode goes on after a collision, if the ego vehicle can");
        text.push_str(&format!(
            "\nof all: {} sudden, {} where the other ran into the ego vehicle",
            totals.sudden, totals.struck
        ));
        text.push_str(&format!(
            "\nof all: {} in which the ego vehicle had priority, {} in which the other had",
            totals.wronged, totals.wrong
        ));
        text.push_str(&format!(
            "\nof all: {} avoidable by a careful driver, {} only by a quicker one or an evasive manoeuvre, {} unavoidable",
            totals.avoidable, totals.beyond_reference, totals.unavoidable
        ));
    }
    text
}

/// Refused actions, by reason.
pub fn refusals_text(refusals: &[RefusalCount]) -> String {
    let all: i64 = refusals.iter().map(|refusal| refusal.times).sum();
    let line = |refusal: &RefusalCount| format!("{} × {}", refusal.times, refusal.reason);
    let head = format!("refused: {}", plural(all as usize, "action"));
    cut_short(head, refusals, line, |more| format!("and for {more} other reasons"))
}

/// Distinct failures by pre-crash type. Each has how often it was found, a scenario that shows it, how often its collision
/// recurs, and what happened there.
pub fn groups_text(groups: &[Group]) -> String {
    let line = |group: &Group| {
        let cause = cause_text(group.cause.as_deref());
        let priority = match group.priority.as_str() {
            "ego" => ", ego first",
            "other" => ", the other first",
            _ => "",
        };
        let again = match group.recurrence {
            None => ", not played again".to_owned(),
            Some(of) if group.count == 1 => format!(" {}", of.in_words()),
            Some(of) => {
                let Group { recurring, tried, .. } = group;
                format!(" {}; {recurring} of {tried} that were played again recur", of.in_words())
            }
        };
        let number = group.precrash_number.map_or(String::new(), |number| format!("{number} "));
        let Group { count, precrash, kind, manoeuvre, approach, side, shape, road, episode, .. } = group;
        format!(
            "{count} × {number}{precrash}{cause}: {road}_{episode:04}{again}; {kind} ({manoeuvre}, {approach}{priority}), hit \
             by the {side} ({shape})"
        )
    };
    let counted: usize = groups.iter().map(|group| group.count).sum();
    let head = format!(
        "{} (NHTSA's pre-crash types) among {}:",
        plural(groups.len(), "distinct failure"),
        plural(counted, "counted collision")
    );
    cut_short(head, groups, line, |more| format!("and {more} others"))
}

/// Each requirement with its breaches, or with how near it came to one.
pub fn requirements_text(requirements: &[RequirementCount]) -> String {
    let figure = |of: &RequirementCount| match (of.smallest, of.unit.as_deref()) {
        (Some(smallest), Some(unit)) => format!("{smallest:.2} {unit}").trim_end().to_owned(),
        (Some(_) | None, _) => String::new(),
    };
    // That it is kept says little where it is hardly ever asked.
    let asked = |of: &RequirementCount| {
        let episodes = plural(of.asked_in as usize, "episode");
        format!("asked for {:.1} s in {episodes}", of.asked_s)
    };
    let line = |of: &RequirementCount| match figure(of) {
        figure if of.breaches > 0 => format!(
            "{} × {} in {} ({} of {} kept by a careful driver){}{}; {}",
            of.breaches,
            of.requirement,
            plural(of.breached_in as usize, "episode"),
            of.kept_in,
            if of.tried_in == of.breached_in { "these".to_owned() } else { of.tried_in.to_string() },
            if figure.is_empty() { figure } else { format!(", by up to {}", figure.trim_start_matches('-')) },
            of.scenario.as_ref().map_or_else(String::new, |scenario| format!(": {scenario}")),
            asked(of),
        ),
        _ if of.asked_in == 0 => format!("{} never asked", of.requirement),
        figure if figure.is_empty() && of.unit.is_some() => {
            format!(
                "{} not breached, and no margin is known: what was asked was excused, or over too soon; {}",
                of.requirement,
                asked(of)
            )
        }
        figure if figure.is_empty() => format!("{} kept; {}", of.requirement, asked(of)),
        figure => {
            let nearest = of.nearest.as_deref().unwrap_or_default();
            format!("{} kept, by at least {figure}: {nearest}; {}", of.requirement, asked(of))
        }
    };
    let breached = requirements.iter().filter(|of| of.breaches > 0).count();
    let head = format!("{} of {} breached:", breached, plural(requirements.len(), "requirement"));
    cut_short(head, requirements, line, |more| format!("and {more} others"))
}

/// Lists scenarios in the order of their files. The finding in each says how sure and how bad it is.
pub fn critical_text(directory: &Path, files: &[PathBuf], found: &[FoundIn]) -> String {
    if files.is_empty() {
        return "no critical scenario".to_owned();
    }
    let by_name: BTreeMap<String, &FoundIn> = found.iter().map(|of| (of.name(), of)).collect();
    let line = |file: &PathBuf| {
        let of = file.file_stem().and_then(|stem| by_name.get(&*stem.to_string_lossy()));
        let told = of.map_or_else(String::new, |of| format!("  {}", of.in_words()));
        format!("{}{told}", file.shown())
    };
    let head = format!("\n{} with a counted collision or a breach:", plural(files.len(), "scenario"));
    let mut text = cut_short(head, files, line, |more| format!("and {more} more"));
    // The star stands outside of the quotes: the shell must expand it.
    let directory = for_shell(directory);
    text.push_str(&format!("\nreplay them with: avastra replay {directory}/critical/*.ava"));
    text
}

/// The next step: to look at the findings and make the worst of each kind small. If none is known to recur, the first is made
/// small. Without findings, it is to look at the nearest misses, or to find more.
pub fn next_text(directory: &Path, critical: &[PathBuf], recurs: bool, kept: &[PathBuf]) -> String {
    let directory = for_shell(directory);
    match (critical.first(), kept) {
        (Some(_), _) if recurs => format!(
            "next: avastra report {directory} makes a page to watch them;\n      avastra shrink {directory} looks for the\n      \
             smallest scenario of each kind that recurs"
        ),
        (Some(first), _) => format!(
            "next: avastra report {directory} makes a page to watch them;\n      avastra shrink {} looks for the\n      \
             smallest scenario that fails so",
            for_shell(first)
        ),
        (None, [_, ..]) => format!("next: avastra report {directory} makes a page to watch them"),
        (None, []) => "next: more episodes (`--episodes`), ordinary traffic (`--ambient`) or other\n      roads may find more".to_owned(),
    }
}

/// The head and a line for each of the first items; `rest` says how many more there are.
pub fn cut_short<T>(
    head: String,
    items: &[T],
    line: impl Fn(&T) -> String,
    rest: impl Fn(usize) -> String,
) -> String {
    let mut lines = vec![head];
    lines.extend(items.iter().take(NAMED_MAX).map(|item| format!("  {}", line(item))));
    if items.len() > NAMED_MAX {
        lines.push(format!("  {}", rest(items.len() - NAMED_MAX)));
    }
    lines.join("\n")
}
