//! `avastra policy distil`: readable rules for a trained policy, beside its network.

use std::path::PathBuf;
use std::sync::Arc;

use crate::cli::arguments::DistilArguments;
use crate::cli::error::Failure;
use crate::cli::files::{place, write_result};
use crate::cli::load;
use crate::cli::output::{Output, plural};
use crate::cli::progress::Working;
use avastra_base::outside::Shown;
use avastra_campaign::emit;
use avastra_campaign::run::Arena;
use avastra_campaign::train;
use avastra_lang::model::Policy;
use avastra_lang::model::policy::RulesClaims;
use avastra_search::agent::{Face, QPolicy};

use super::{acting, same_world};

/// Distils rules anew, with other settings than those of the training, and writes the policy with them.
pub fn distil(output: &Output, arguments: &DistilArguments) -> Result<(), Failure> {
    let path = place(arguments.output.as_ref(), arguments.file.with_extension("distilled.ava"))?;
    let (table, mut policy) = load::policy(output, &arguments.file)?;
    same_world(&policy)?;
    for (name, value) in [("rules_leaves", arguments.leaves), ("rules_episodes", arguments.episodes)] {
        if let Some(value) = value {
            policy.hyperparameters.insert(name.to_owned(), value.into());
        }
    }
    if policy.claims.is_none() {
        let path = arguments.file.shown();
        return Err(Failure::usage(format!(
            "`{path}` makes no claims, because it was trained with `--evaluate 0`: train it with an evaluation"
        )));
    }
    let acting = acting(&table, &policy, Face::Network)?;
    if acting.settings().rules.rules_leaves == 0 {
        let message = "the policy was trained with `rules_leaves: 0`: say how many with `--leaves N`";
        return Err(Failure::usage(message));
    }
    let arena = train::training_arena(&table, &policy, &acting, &policy.origin.roads)?;
    let working = Working::new(output, "distilling rules from the network");
    let policy = with_rules(&arena, &acting, policy);
    drop(working);
    let folder = path.parent().map_or(PathBuf::new(), PathBuf::from);
    let space_path = load::relative(&folder, &table.space().path)?;
    write_result(
        arguments.output.as_ref(),
        &path,
        &emit::policy_text(&policy, table.space(), &space_path, "train"),
    )?;
    let claims = policy.claims.as_ref();
    if let Some((claims, rules)) = claims.and_then(|claims| Some((claims, claims.rules.as_ref()?))) {
        output.say(&rules_text(policy.rules.len(), claims.return_mean, rules));
    }
    output.say(&path.shown().to_string());
    let rules = claims.map(|claims| &claims.rules);
    output.result(serde_json::json!({ "policy": path, "lines": policy.rules.len(), "rules": rules }));
    Ok(())
}

/// The policy with rules distilled by its settings, and with the claims about them. `arena` is where it was
/// trained.
pub fn with_rules(arena: &Arena, acting: &QPolicy, policy: Policy) -> Policy {
    let mut policy = Policy { rules: Vec::new(), ..policy };
    let Some(claims) = &mut policy.claims else { return policy };
    claims.rules = None;
    if acting.settings().rules.rules_leaves == 0 {
        return policy;
    }
    let rules = Arc::new(train::distill(arena, acting, policy.origin.seed));
    if !rules.is_empty() {
        let test = (claims.episodes, claims.seed);
        claims.rules = Some(train::judge_rules(arena, acting, &rules, test));
        policy.rules = rules.to_vec();
    }
    policy
}

/// The performance of the rules, compared with the network.
pub fn rules_text(lines: usize, network_return: f64, rules: &RulesClaims) -> String {
    format!(
        "its {lines} rules choose as the network in {:.1} % of {} states and lose {:.3} of Q-value in each; \
         by themselves: {} counted in {}, return {:.2} where the network has {:.2}",
        100.0 * rules.fidelity,
        rules.states,
        rules.regret,
        rules.counted,
        plural(rules.colliding as usize, "episode"),
        rules.return_mean,
        network_return,
    )
}
