//! A policy as a file: the network bit by bit, every setting, where it comes from and what it claims.

use serde_json::Value;

use crate::agent::QPolicy;
use crate::model::digest_text;
use crate::model::policy::Net;
use crate::model::policy::PolicyClaims;
use crate::model::policy::PolicyOrigin;
use crate::model::policy::expression;
use crate::model::policy::seal;
use crate::model::policy::weights_to_lines;
use crate::study::Evaluation;
use crate::study::TrainSettings;
use crate::syntax::LANGUAGE;
use crate::syntax::ast::ExprKind;
use crate::syntax::ast::Field;
use crate::syntax::ast::File;
use crate::syntax::ast::FileId;
use crate::syntax::ast::ItemKind;
use crate::syntax::ast::Name;
use crate::syntax::ast::Policy;
use crate::syntax::ast::Span;
use crate::syntax::ast::Text;
use crate::syntax::ast::Use;
use crate::syntax::parse;
use crate::syntax::print;

use super::tree;

/// The text of a policy file. `space_path` is the way from the file to its space.
pub fn policy_text(
    policy: &QPolicy,
    settings: &TrainSettings,
    evaluation: &Evaluation,
    name: &str,
    space_path: &str,
) -> String {
    // The seal is over the text, so the text comes first.
    let open = print(&file(policy, settings, evaluation, name, space_path, String::new()));
    let (tree, mistakes) = parse(FileId(0), &open);
    debug_assert!(mistakes.is_empty(), "what is printed can be read");
    print(&file(policy, settings, evaluation, name, space_path, seal(&open, &tree)))
}

fn file(
    policy: &QPolicy,
    settings: &TrainSettings,
    evaluation: &Evaluation,
    name: &str,
    space_path: &str,
    digest: String,
) -> File {
    let shape = policy.network().shape();
    let net = Net {
        layers: shape.layers.clone(),
        dueling: shape.dueling,
        hyperparameters: policy.settings().record(),
        weights: weights_to_lines(policy.network().parameters()),
        digest,
    };
    let item = Policy {
        name: Name::built(name),
        origin: fields(&origin(settings)),
        net: fields(&net),
        claims: fields(&claims(evaluation)),
        rules: Vec::new(),
    };
    let digest = Some(Text::new(settings.space_digest.clone(), Span::NONE));
    let space_use = Use { path: Text::new(space_path, Span::NONE), digest, without: Vec::new() };
    File {
        docs: vec![tree::doc("Emitted by `avastra train`; play it with `avastra run --policy FILE`.")],
        items: vec![
            tree::item(Vec::new(), ItemKind::Language(tree::digits(LANGUAGE.to_string()))),
            tree::item(Vec::new(), ItemKind::Use(space_use)),
            tree::item(vec![tree::doc(headline(settings, evaluation))], ItemKind::Policy(item)),
        ],
        span: Span::NONE,
    }
}

fn origin(settings: &TrainSettings) -> PolicyOrigin {
    PolicyOrigin {
        agent: settings.agent.clone(),
        seed: settings.seed,
        episodes: u64::from(settings.episodes),
        roads: settings.roads.clone(),
        ads: settings.ads.clone(),
        profile: settings
            .profile
            .as_ref()
            .map(|profile| profile.settings.to_line())
            .filter(|line| !line.is_empty()),
        profile_digest: settings.profile.as_ref().map(|profile| profile.digest.clone()),
        engine: settings.engine.clone(),
        avastra: settings.avastra.clone(),
        with: settings.with.clone(),
        without: settings.without.clone(),
    }
}

fn claims(evaluation: &Evaluation) -> PolicyClaims {
    PolicyClaims {
        episodes: evaluation.episodes,
        seed: evaluation.seed,
        collisions: evaluation.collisions,
        counted: evaluation.counted,
        colliding: evaluation.colliding,
        trace: digest_text(&evaluation.trace),
    }
}

/// A struct as fields, in its own order.
fn fields(value: &impl serde::Serialize) -> Vec<Field> {
    let value: Value = serde_json::to_value(value).expect("policies are plain data");
    match expression(&value).kind {
        ExprKind::Record(fields) => fields,
        _ => unreachable!("a struct is a record"),
    }
}

/// What it is, in a sentence for the reader.
fn headline(settings: &TrainSettings, evaluation: &Evaluation) -> String {
    let roads = settings.roads.len() as u64;
    format!(
        "{} ({}) after {} episodes on {}: {} counted collisions in {} episodes of its own.",
        settings.agent,
        settings.hyperparameters.preset(),
        settings.episodes,
        settings.roads.join(", "),
        evaluation.counted,
        evaluation.episodes * roads,
    )
}
