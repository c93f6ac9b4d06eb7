//! Checks a policy: its digest, its form, and whether its network fits the action table.

mod lines;
mod region;

pub(super) use lines::value_of;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::check::names::docs;
use crate::check::policy::lines::rules;
use crate::model::policy::{
    Net, Policy, PolicyClaims, PolicyOrigin, WEIGHT_MAX, record, seal, weights_from_lines,
};
use crate::model::{Space, code};
use crate::syntax::ast::{Field, Span};
use crate::syntax::{Diagnostic, ast, settings_mistake};

/// Most episodes on each road that a policy may claim; `avastra train` claims 15.
const EPISODES_MAX: u64 = 10_000;

/// The policy of a file, checked against the space that it uses. `text` is what the tree was read from.
///
/// # Errors
/// All mistakes in the policy. If the digest is wrong, only that: the other mistakes of a damaged file do not
/// help.
pub fn policy(text: &str, file: &ast::File, space: &Space) -> Result<Policy, Vec<Diagnostic>> {
    let mut found = file.items.iter().filter_map(|item| Some((item, item.kind.as_policy()?)));
    let (item, declared) = found.next().expect("it is asked only where there is one");
    if let Some((second, _)) = found.next() {
        let error = Diagnostic::error(code::ONE_POLICY, "the file holds two policies");
        return Err(vec![error.at(second.span, "the second").help("one file, one policy")]);
    }
    let whole = item.span;
    let net: Net = block(&declared.net, "net", whole)?;
    let found = seal(text, file);
    if net.digest != found {
        let error = Diagnostic::error(code::POLICY_DIGEST, "the policy is not what was written")
            .at(field_span(&declared.net, "digest", whole), "its digest differs")
            .note(format!("the file has {found}"))
            .help("get back the file as it was: a policy comes from `avastra train`, not from an editor");
        return Err(vec![error]);
    }
    let origin: PolicyOrigin = block(&declared.origin, "origin", whole)?;
    let claims: Option<PolicyClaims> =
        if declared.claims.is_empty() { None } else { Some(block(&declared.claims, "claims", whole)?) };
    if claims.as_ref().is_some_and(|claims| claims.episodes > EPISODES_MAX) {
        let message = "the policy claims more episodes than can be played again";
        let error = Diagnostic::error(code::POLICY_FORM, message);
        let span = field_span(&declared.claims, "episodes", whole);
        return Err(vec![error.at(span, format!("at most {EPISODES_MAX} on each road"))]);
    }
    let parameters = parameters(&net, declared, whole, space)?;
    let rules = rules(&declared.rules, space, &origin)?;
    if claims.as_ref().is_some_and(|claims| claims.rules.is_some() == rules.is_empty()) {
        let message = "the rules of the policy and the claims about them do not belong together";
        let error = Diagnostic::error(code::POLICY_FORM, message);
        let span = field_span(&declared.claims, "rules", whole);
        return Err(vec![error.at(span, "one is there without the other")]);
    }
    Ok(Policy {
        name: declared.name.text.clone(),
        docs: docs(item),
        origin,
        layers: net.layers,
        dueling: net.dueling,
        hyperparameters: net.hyperparameters,
        parameters,
        claims,
        rules,
        digest: net.digest,
    })
}

/// Reads a block of fields into a struct.
fn block<T: DeserializeOwned>(fields: &[Field], name: &str, whole: Span) -> Result<T, Vec<Diagnostic>> {
    let error = |span, label: String| {
        let message = format!("cannot read `{name}` of the policy");
        vec![Diagnostic::error(code::POLICY_FORM, message).at(span, label)]
    };
    let span = fields.first().map_or(whole, |field| field.name.span);
    let record = record(fields).map_err(|(span, label)| error(span, label.to_owned()))?;
    serde_json::from_value(Value::Object(record))
        .map_err(|reason| error(span, settings_mistake(&reason.to_string(), None)))
}

/// The weights of the network. Their number must fit its layers, and the last layer the table of the space.
fn parameters(
    net: &Net,
    declared: &ast::Policy,
    whole: Span,
    space: &Space,
) -> Result<Vec<f32>, Vec<Diagnostic>> {
    let shape = field_span(&declared.net, "layers", whole);
    let rows = space.rows.len();
    if net.layers.len() < 2 || net.layers.last() != Some(&rows) {
        let message = "the network does not fit the action table";
        let error = Diagnostic::error(code::POLICY_SHAPE, message).at(shape, "its layers");
        let note = format!("the table has {rows} rows, which must be the width of the last layer");
        return Err(vec![error.note(note)]);
    }
    let found = weights_from_lines(&net.weights);
    // NaN is not below the limit either.
    let found = found.filter(|all| all.iter().all(|weight| weight.abs() <= WEIGHT_MAX));
    let Some(found) = found else {
        let message = format!("the weights are no Base64 of numbers up to {WEIGHT_MAX}");
        let weights = field_span(&declared.net, "weights", whole);
        return Err(vec![Diagnostic::error(code::POLICY_FORM, message).at(weights, "here")]);
    };
    let wanted = wanted(&net.layers, net.dueling);
    if wanted != Some(found.len()) {
        let message = "the network has another number of weights than its layers want";
        let error = Diagnostic::error(code::POLICY_SHAPE, message).at(shape, "its layers");
        let wanted = wanted.map_or("too many".to_owned(), |wanted| wanted.to_string());
        return Err(vec![error.note(format!("they want {wanted}, there are {}", found.len()))]);
    }
    Ok(found)
}

/// Number of weights and biases; `None` if it exceeds `usize`.
fn wanted(layers: &[usize], dueling: bool) -> Option<usize> {
    let mut sum = 0_usize;
    for (at, pair) in layers.windows(2).enumerate() {
        let is_last = at + 2 == layers.len();
        let outputs = pair[1].checked_add(usize::from(dueling && is_last))?;
        sum = sum.checked_add(pair[0].checked_add(1)?.checked_mul(outputs)?)?;
    }
    Some(sum)
}

fn field_span(fields: &[Field], name: &str, otherwise: Span) -> Span {
    fields.iter().find(|field| field.name.text == name).map_or(otherwise, |field| field.value.span)
}
