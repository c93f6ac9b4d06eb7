//! The result of a study as tables for people. Everything else that it holds is in `results.json`.

use avastra_base::statistics::{Estimate, Interval};
use avastra_campaign::study::{
    AgentResults, BaselineComparison, QUICK_EPISODES, QUICK_REPEATS, Rate, RoadResults, StudyResults,
};

/// The width that every terminal shows in a line.
const WIDTH_MAX: usize = 80;

/// Measures by which comparisons are printed.
const PRINTED_COMPARISONS: [&str; 2] = ["counted", "kinds_per_h"];

/// All roads, one after another, and then all together.
pub fn study(results: &StudyResults) -> String {
    let mut text = String::new();
    if let Some(question) = &results.question {
        text.push_str(&format!("\n{question}\n"));
    }
    if results.quick {
        text.push_str(&format!(
            "\ncut down by `--quick` to {QUICK_REPEATS} trainings of {QUICK_EPISODES} episodes at most: no result, but a sign that it works\n"
        ));
    }
    if results.cells < results.cells_wanted {
        text.push_str(&format!("\nunfinished: {} of {} cells\n", results.cells, results.cells_wanted));
    }
    let plan = &results.evaluation;
    text.push_str(&format!(
        "\nnumbers are of {} episodes, averaged over {} seeds; in brackets: 95 % intervals; restricted: up to {} s\n",
        plan.episodes, plan.seeds, plan.horizon_s
    ));
    for road in results.roads.iter().filter(|road| !road.agents.is_empty()) {
        text.push_str(&format!("\n{}\n", road.road));
        let tables = [found_table(road), verdict_table(road), comparison_table(road), causes_text(road)];
        text.push_str(&tables.into_iter().filter(|table| !table.is_empty()).collect::<Vec<_>>().join("\n"));
    }
    text.push_str("\nall roads together\n");
    text.push_str(&together_table(results));
    text.trim_end().to_owned()
}

fn found_table(road: &RoadResults) -> String {
    let measures = [
        ("counted", "counted"),
        ("all", "collisions"),
        ("kinds", "kinds"),
        ("colliding episodes", "colliding"),
        ("TTFC s", "ttfc_s"),
        ("restricted s", "ttfc_restricted_s"),
    ];
    let head = ["agent", "cells"].into_iter().chain(measures.map(|(title, _)| title));
    let row = |agent: &AgentResults| {
        let cells = measures.map(|(_, name)| agent.measures.get(name).map_or("-".to_owned(), estimate));
        [agent.agent.clone(), agent.cells.to_string()].into_iter().chain(cells).collect()
    };
    table(head, road.agents.iter().map(row))
}

fn verdict_table(road: &RoadResults) -> String {
    let measures = [
        ("avoidable", "avoidable"),
        ("beyond reference", "beyond_reference"),
        ("unavoidable", "unavoidable"),
        ("sudden", "sudden"),
        ("struck", "struck"),
        ("ego's priority", "wronged"),
        ("other's priority", "wrong"),
        ("red runs", "red_runs"),
        ("speeding", "speeding_share"),
        ("beside lane", "astray_share"),
        ("trained with", "training_counted"),
    ];
    let head = ["agent"].into_iter().chain(measures.map(|(title, _)| title));
    let row = |agent: &AgentResults| {
        let cells = measures.map(|(_, name)| match agent.measures.get(name) {
            None => "-".to_owned(),
            Some(found) if name.ends_with("_share") => format!("{:.2} %", 100.0 * found.mean),
            Some(found) => format!("{:.2}", found.mean),
        });
        [agent.agent.clone()].into_iter().chain(cells).collect()
    };
    table(head, road.agents.iter().map(row))
}

fn comparison_table(road: &RoadResults) -> String {
    let printed = road.comparisons.iter().filter(|one| PRINTED_COMPARISONS.contains(&one.measure));
    let row = |one: &BaselineComparison| {
        let ratio = one.ratio.map_or("-".to_owned(), |ratio| with_interval(ratio, one.ratio_interval));
        vec![
            format!("{} / {}", one.agent, one.baseline),
            one.measure.to_owned(),
            ratio,
            with_interval(one.superiority, Some(one.superiority_interval)),
            format!("{:.4}", one.test.p),
            format!("{:.4}", one.p_holm),
            one.paired.map_or("-".to_owned(), |paired| format!("{:.4}", paired.p)),
        ]
    };
    let rows: Vec<Vec<String>> = printed.map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    table(["comparison", "by", "ratio", "Â12", "p", "p (Holm)", "p (pairs)"], rows)
}

fn causes_text(road: &RoadResults) -> String {
    let mut text = String::new();
    for agent in road.agents.iter().filter(|agent| !agent.causes.is_empty()) {
        let mut causes: Vec<(&String, &usize)> = agent.causes.iter().collect();
        causes.sort_by_key(|(_, count)| core::cmp::Reverse(**count));
        let causes: Vec<String> = causes.iter().map(|(name, count)| format!("{name} {count}")).collect();
        text.push_str(&format!("causes, {}: {}\n", agent.agent, causes.join(", ")));
    }
    text
}

fn together_table(results: &StudyResults) -> String {
    let head = [
        "agent",
        "episodes",
        "km",
        "with a counted one",
        "collisions / 1000 km",
        "counted / 1000 km",
        "red runs / 1000 km",
    ];
    let rows = results.together.iter().filter(|one| one.episodes.episodes > 0).map(|one| {
        let pooled = &one.episodes;
        vec![
            one.agent.clone(),
            pooled.episodes.to_string(),
            format!("{:.1}", pooled.driven_km),
            rate(&pooled.colliding),
            rate(&pooled.collisions_per_1000_km),
            rate(&pooled.counted_per_1000_km),
            rate(&pooled.red_runs_per_1000_km),
        ]
    });
    table(head, rows)
}

pub(super) fn estimate(found: &Estimate) -> String {
    with_interval(found.mean, found.interval)
}

fn rate(found: &Rate) -> String {
    found.rate.map_or("-".to_owned(), |rate| with_interval(rate, found.interval))
}

/// `3.20 [2.10, 4.30]`, `∞` for no bound.
fn with_interval(value: f64, interval: Option<Interval>) -> String {
    let digits = if value.abs() >= 100.0 { 0 } else { 2 };
    match interval {
        None => format!("{value:.digits$}"),
        Some(Interval { low, high }) => {
            let high = high.map_or("∞".to_owned(), |high| format!("{high:.digits$}"));
            format!("{value:.digits$} [{low:.digits$}, {high}]")
        }
    }
}

/// Columns side by side; all but the first are aligned right. Columns that do not fit in a line go on below, beside the
/// first column again.
fn table<'a>(head: impl IntoIterator<Item = &'a str>, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut lines = vec![head.into_iter().map(str::to_owned).collect::<Vec<_>>()];
    lines.extend(rows);
    let columns = lines[0].len();
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    let mut from = 1;
    while from < columns {
        let mut taken = 2 + widths[0];
        let fitting = widths[from..].iter().take_while(|width| {
            taken += 2 + **width;
            taken <= WIDTH_MAX
        });
        let to = from + fitting.count().max(1);
        for line in &lines {
            let mut row = format!("  {:width$}", line[0], width = widths[0]);
            for (cell, width) in line[from..to].iter().zip(&widths[from..to]) {
                row.push_str(&format!("  {cell:>width$}"));
            }
            text.push_str(row.trim_end());
            text.push('\n');
        }
        from = to;
    }
    text
}
