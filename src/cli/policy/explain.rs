//! `avastra policy explain`: what a policy favours, expects and looks at.

use crate::cli::arguments::ExplainPolicyArguments;
use crate::cli::error::Failure;
use crate::cli::load;
use crate::cli::output::{Output, plural};
use crate::cli::progress::Working;
use avastra_campaign::train::{Insight, insight, training_arena};
use avastra_lang::check::state_argument::values_from;
use avastra_search::agent::Face;

use super::acting;

/// Rows and variables that are listed; JSON has them all.
const LISTED_MAX: usize = 12;

/// Lets the policy drive, and prints which rows it chose and why.
pub fn explain(output: &Output, arguments: &ExplainPolicyArguments) -> Result<(), Failure> {
    let (table, policy) = load::policy(output, &arguments.file)?;
    let acting = acting(&table, &policy, Face::Network)?;
    let given = arguments.state.as_deref().map_or(Ok(Vec::new()), values_from).map_err(Failure::usage)?;
    let roads = if arguments.road.is_empty() { &policy.origin.roads } else { &arguments.road };
    let test = (u64::from(arguments.episodes), arguments.seed, u64::from(arguments.repeats));
    let arena = training_arena(&table, &policy, &acting, roads)?;
    let working = Working::new(output, format!("{} drives on {}", policy.name, roads.join(", ")));
    let found = insight(&arena, &acting, &given, test);
    drop(working);
    output.say(&format!(
        "{} on {}: {} of {}, {:.3} of Q-value at stake in each",
        policy.name,
        roads.join(", "),
        plural(found.states, "state"),
        plural(arguments.episodes as usize * roads.len(), "episode"),
        found.stake,
    ));
    output.say(&rows_text(&found));
    output.say(&state_text(&found, !given.is_empty()));
    output.say(&importance_text(&found));
    output.result(serde_json::json!({ "policy": policy.name, "roads": roads, "insight": found }));
    Ok(())
}

fn rows_text(found: &Insight) -> String {
    let mut text =
        "\nrows that it prefers (share of states, mean Q-value; where it differs from its mean state):"
            .to_owned();
    for row in found.rows.iter().take(LISTED_MAX) {
        let share = 100.0 * row.states as f64 / found.states.max(1) as f64;
        text.push_str(&format!("\n  {share:5.1} %  {:7.3}  {}", row.q_value, row.label));
        let when = row.when.iter().map(|(name, here, all)| format!("{name} {here} (mean {all})"));
        let when: Vec<String> = when.collect();
        if !when.is_empty() {
            text.push_str(&format!("\n{:20}{}", "", when.join(", ")));
        }
    }
    if found.rows.len() > LISTED_MAX {
        text.push_str(&format!("\n  and {} others", found.rows.len() - LISTED_MAX));
    }
    text
}

fn state_text(found: &Insight, is_given: bool) -> String {
    let what = if is_given { "the state given, else the mean" } else { "the mean state" };
    let variables = found.state.variables.iter().map(|(name, value)| format!("{name}: {value}"));
    let variables: Vec<String> = variables.collect();
    let mut text = format!("\nQ-values in {what} ({}):", variables.join(", "));
    for (_, label, q_value) in found.state.q_values.iter().take(LISTED_MAX) {
        text.push_str(&format!("\n  {q_value:7.3}  {label}"));
    }
    if let Some((_, label, q_value)) =
        found.state.q_values.last().filter(|_| found.state.q_values.len() > LISTED_MAX)
    {
        text.push_str(&format!("\n  …\n  {q_value:7.3}  {label}"));
    }
    text
}

fn importance_text(found: &Insight) -> String {
    let mut text = format!(
        "\npermutation importance, {} shuffles: mean Q-value that the choice loses in a state, and share of \
         the stake on which it changes (± standard deviation):",
        found.repeats
    );
    for one in &found.importance {
        if !one.seen {
            continue;
        }
        let mark = if one.of_paper { "" } else { " (not of the paper's 19)" };
        text.push_str(&format!(
            "\n  {:7.4} ± {:.4}  {:5.1} ± {:.1} %  {}{mark}",
            one.loss,
            one.loss_deviation,
            100.0 * one.change,
            100.0 * one.change_deviation,
            one.variable,
        ));
    }
    let unseen: Vec<&str> = found.importance.iter().filter(|one| !one.seen).map(|one| one.variable).collect();
    if !unseen.is_empty() {
        text.push_str(&format!("\n  not seen by this policy: {}", unseen.join(", ")));
    }
    text
}
