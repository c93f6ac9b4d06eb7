//! Policies as files: both the network and the rules are played and verified, a flipped byte is noticed
//! wherever it is, and an emitted policy reads back to the same value.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use avastra::agent::{Visit, distilled};
use avastra::emit::policy_text;
use avastra::mdp::Observation;
use avastra::model::policy::{RulesClaims, VARIABLES, VariableKind, seal};
use avastra::model::{Policy, Space};
use avastra::syntax::ast::FileId;
use proptest::prelude::*;
use safetensors::SafeTensors;

use crate::cases::root;
use crate::command::{avastra, done, fails, last_line, outcome};
use crate::world::{SMALL, loaded};

/// A policy of a few episodes with a network of a few neurons, trained once for all tests.
fn trained() -> &'static Path {
    static TRAINED: OnceLock<PathBuf> = OnceLock::new();
    TRAINED.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("policies");
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("it can be made");
        let (config, out) = (folder.join("small.yaml"), folder.join("run"));
        std::fs::write(&config, SMALL).expect("it is writable");
        let (config, out_text) = (config.display().to_string(), out.display().to_string());
        let words =
            ["train", "scenarios/avastra45.ava", "--road", "corner", "--episodes", "20", "--seed", "5"];
        done(&[&words[..], &["--config", &config, "--out", &out_text]].concat());
        out.join("policy/corner_ddqn_5.ava")
    })
}

fn trained_text() -> String {
    std::fs::read_to_string(trained()).expect("a policy is written at the end")
}

/// Writes a file beside the trained policy, so that its `use` still finds the space.
fn beside(name: &str, bytes: &[u8]) -> String {
    let path = trained().with_file_name(name);
    std::fs::write(&path, bytes).expect("it is writable");
    path.display().to_string()
}

/// Loads a text as if it stood beside the shipped spaces.
pub fn load(text: &str) -> Result<Policy, Vec<String>> {
    let loaded = loaded("scenarios/policy_under_test.ava", text);
    let messages = loaded.diagnostics.iter().map(|found| format!("{}: {}", found.code, found.message));
    loaded.policy.ok_or_else(|| messages.collect())
}

fn space() -> &'static Arc<Space> {
    static SPACE: OnceLock<Arc<Space>> = OnceLock::new();
    SPACE.get_or_init(|| crate::world::space("avastra45.ava"))
}

/// A policy with the `use` of a file that stands beside the shipped space.
pub fn moved(text: &str) -> String {
    let begin = text.find("use \"").expect("it uses a space") + 5;
    let end = begin + text[begin..].find('"').expect("the path ends");
    format!("{}avastra45.ava{}", &text[..begin], &text[end..])
}

/// A changed text with a seal that fits it.
pub fn sealed(text: &str) -> String {
    let (tree, _) = avastra::syntax::parse(FileId(0), text);
    let begin = text.find("digest: \"sha256:").expect("it is sealed") + 9;
    format!("{}{}{}", &text[..begin], seal(text, &tree), &text[begin + 71..])
}

#[test]
fn both_faces_are_played_and_what_they_claim_is_checked() {
    let file = trained().display().to_string();
    let stdout = done(&["replay", &file]);
    assert!(stdout.contains("played again by each of its faces"), "{stdout}");
    fails(&["replay", &file, "--ads", "idm"], "that it was trained against");

    let traces = ["network", "rules"].map(|face| {
        let out = trained().with_file_name(format!("played_{face}"));
        let _ = std::fs::remove_dir_all(&out);
        let out_text = out.display().to_string();
        let words = ["run", "--policy", &file, "--face", face, "--road", "corner", "--episodes", "3"];
        let stdout = done(&[&words[..], &["--format", "json", "--out", &out_text]].concat());
        let settings = std::fs::read_to_string(out.join("run.yaml")).expect("it is written");
        assert!(settings.contains(&format!("face: {face}")), "{settings}");
        let last = stdout.lines().last().expect("a result").to_owned();
        last.split_once("totals").map(|(_, totals)| totals.to_owned())
    });
    assert_ne!(traces[0], traces[1], "the faces are two");

    let text = trained_text();
    let fidelity = text.find("fidelity: ").expect("it is claimed") + 10;
    let end = fidelity + text[fidelity..].find('\n').expect("the line ends");
    let lie = beside("lie.ava", sealed(&format!("{}0.9999{}", &text[..fidelity], &text[end..])).as_bytes());
    let (status, stdout, _) = outcome(&mut avastra(&["replay", &lie]));
    assert_eq!(status, 3, "{stdout}");
    assert!(stdout.contains("rules: fidelity: claimed 0.9999, found "), "{stdout}");
}

#[test]
fn rules_are_distilled_anew_and_hold() {
    let file = trained().display().to_string();
    let fewer = trained().with_file_name("fewer.ava").display().to_string();
    done(&["policy", "distil", &file, "--leaves", "2", "--episodes", "2", "--out", &fewer]);
    let policy = load(&moved(&std::fs::read_to_string(&fewer).expect("it is written"))).expect("it is sound");
    assert!((1..=2).contains(&policy.rules.len()));
    assert!(
        policy.rules.last().is_some_and(|rule| rule.conditions.is_empty()),
        "the last line takes the rest"
    );
    done(&["replay", &fewer]);
    let (first, second) = (load(&moved(&trained_text())).expect("sound"), policy);
    assert_eq!(first.parameters, second.parameters, "the network stays as it is");
}

/// Every bit of every byte is flipped, except the bit that changes the case of a letter in the digest.
#[test]
fn a_flipped_bit_anywhere_in_a_small_policy_is_noticed() {
    let path = root().join("tests/cases/diagnostics/policies/policy_line_shadowed.ava");
    let text = std::fs::read_to_string(path).expect("it is a case");
    let sound = text.replacen("    when ego_speed > 10 m/s and time == Noon => light(on: false)\n", "", 1);
    let sound = sound.replacen("    when ego_speed > 10 m/s and time == Noon => light(false)\n", "", 1);
    let sound = sealed(&sound);
    load(&sound).expect("without its dead line it is sound");
    let (mut noticed, mut not_text) = (0, 0);
    for at in 0..sound.len() {
        for bit in 0..8 {
            let mut bytes = sound.clone().into_bytes();
            bytes[at] ^= 1 << bit;
            match String::from_utf8(bytes) {
                Err(_) => not_text += 1,
                Ok(flipped) => {
                    let messages = load(&flipped).expect_err(&format!("bit {bit} of byte {at}"));
                    assert!(messages.iter().all(|message| message.len() > 10), "{at}: {messages:?}");
                    noticed += 1;
                }
            }
        }
    }
    assert_eq!(noticed + not_text, 8 * sound.len());
    let mut bytes = sound.into_bytes();
    bytes[40] ^= 0x80;
    fails(&["replay", &beside("not_text.ava", &bytes)], "not text: byte 40 is not UTF-8");
}

#[test]
fn weights_come_back_from_safetensors_bit_by_bit() {
    let file = trained().display().to_string();
    let out = trained().with_extension("safetensors");
    done(&["policy", "weights", &file]);
    let bytes = std::fs::read(&out).expect("it is written");
    let tensors = SafeTensors::deserialize(&bytes).expect("it is safetensors");
    let policy = load(&moved(&trained_text())).expect("it is sound");
    let mut parameters = Vec::new();
    for (at, pair) in policy.layers.windows(2).enumerate() {
        let head = usize::from(policy.dueling && at + 2 == policy.layers.len());
        let (inputs, outputs) = (pair[0], pair[1] + head);
        let numbers = |name: &str, shape: &[usize]| -> Vec<f32> {
            let tensor = tensors.tensor(&format!("{}.{name}", 2 * at)).expect("the layer is there");
            assert_eq!(tensor.shape(), shape);
            let (numbers, rest) = tensor.data().as_chunks();
            assert!(rest.is_empty());
            numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()
        };
        let weights = numbers("weight", &[outputs, inputs]);
        parameters
            .extend((0..inputs * outputs).map(|place| weights[place % outputs * inputs + place / outputs]));
        parameters.extend(numbers("bias", &[outputs]));
    }
    let bits = |numbers: &[f32]| -> Vec<u32> { numbers.iter().map(|number| number.to_bits()).collect() };
    assert_eq!(bits(&parameters), bits(&policy.parameters));
}

#[test]
fn a_policy_is_explained() {
    let file = trained().display().to_string();
    let words = ["policy", "explain", &file, "--episodes", "3", "--repeats", "3"];
    let stdout = done(&[&words[..], &["--format", "json"]].concat());
    let result = last_line(&stdout);
    let insight = &result["insight"];
    let importance = insight["importance"].as_array().expect("a list");
    assert_eq!(importance.iter().filter(|one| one["of_paper"] == true).count(), 19);
    let number = |one: &serde_json::Value, name: &str| one[name].as_f64().expect("a number");
    assert!(importance.iter().all(|one| (0.0..=1.0).contains(&number(one, "change"))));
    assert!(importance.iter().any(|one| number(one, "loss") > 0.0), "something matters");
    let rows = insight["rows"].as_array().expect("a list");
    let counted: u64 = rows.iter().map(|row| row["states"].as_u64().expect("a count")).sum();
    assert_eq!(Some(counted), insight["states"].as_u64(), "every state prefers one row");
    assert_eq!(insight["state"]["q_values"].as_array().map(Vec::len), Some(45));

    let given = ["--state", "ego_speed: 12, time: Night, dist_nearest: 0.02 km"];
    let stdout = done(&[&words[..], &given[..]].concat());
    for shown in ["ego_speed: 12.00 m/s", "time: Night", "dist_nearest: 20.00 m", "permutation importance"] {
        assert!(stdout.contains(shown), "{shown}: {stdout}");
    }
    for (state, reason) in
        [("ego_sped: 12", "did you mean `ego_speed`?"), ("time: 12", "Morning"), ("=", "write")]
    {
        fails(&[&words[..], &["--state", state]].concat(), reason);
    }
}

/// A state within the ranges of the variables, from numbers in `[0, 1)`.
fn observation(numbers: &[f64]) -> Observation {
    let mut observation = Observation::zeros();
    for (variable, (described, share)) in VARIABLES.iter().zip(numbers).enumerate() {
        let value = match described.kind {
            VariableKind::Words { words, .. } => words[(share * words.len() as f64) as usize].1,
            VariableKind::Quantity { low, high, .. } => {
                let low = low.unwrap_or(-50.0);
                (low + share * (high.unwrap_or(120.0) - low)) as f32
            }
        };
        let paper = observation.state.len();
        if variable < paper {
            observation.state[variable] = value
        } else {
            observation.beyond[variable - paper] = value
        }
    }
    observation
}

/// A number of any bits, brought into the range that weights may have.
fn small(number: f32) -> f32 {
    if number.is_finite() { number % 10_000.0 } else { 0.0 }
}

fn visit() -> impl Strategy<Value = Visit> {
    let numbers = proptest::collection::vec(0.0..1.0_f64, VARIABLES.len());
    let rows = proptest::collection::vec((any::<bool>(), -2.0..9.0_f32), 45);
    (numbers, rows, 0..6_usize).prop_map(|(numbers, mut rows, favourite)| {
        // Only a few rows are ever the best, as in a network that has learned; the last row is never closed.
        rows[favourite] = (true, 10.0);
        rows[44].0 = true;
        let (open, q_values): (Vec<bool>, Vec<f32>) = rows.into_iter().unzip();
        Visit { observation: observation(&numbers), open, q_values, best: favourite }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// Distilled rules are sound, always have a row to offer, and read back to the same value.
    #[test]
    fn emitted_rules_are_sound_and_read_back(
        visits in proptest::collection::vec(visit(), 12..60),
        leaves in 1..20_usize,
        weights in proptest::collection::vec(any::<f32>().prop_map(small), 90),
        share in 0.0..1.0_f64,
    ) {
        let variables: Vec<usize> = (0..VARIABLES.len()).collect();
        let rules = distilled(&visits, &variables, leaves, 6);
        prop_assert!(rules.len() <= leaves);
        for visit in &visits {
            let row = avastra::agent::chosen_by(&rules, &visit.observation, &visit.open);
            prop_assert!(row.is_some_and(|row| visit.open[row]));
        }
        let mut policy = load(&moved(&trained_text())).expect("it is sound");
        policy.rules = rules;
        (policy.layers, policy.dueling, policy.parameters) = (vec![1, 45], false, weights);
        if let Some(claims) = &mut policy.claims {
            let trace = claims.trace.clone();
            let (states, return_mean) = (visits.len() as u64, -share);
            claims.rules = Some(RulesClaims {
                states, fidelity: share, regret: 3.0 * share, collisions: 3, counted: 2, colliding: 1, return_mean, trace,
            });
        }
        let text = policy_text(&policy, space(), "avastra45.ava", "train");
        let found = load(&text);
        policy.digest = found.as_ref().map(|found| found.digest.clone()).unwrap_or_default();
        prop_assert_eq!(found, Ok(policy.clone()));
        prop_assert_eq!(policy_text(&policy, space(), "avastra45.ava", "train"), text);
    }

    /// A bit is flipped anywhere in the text of a policy.
    #[test]
    fn a_flipped_bit_in_a_trained_policy_is_noticed(place in 0.0..1.0_f64, bit in 0..7_u8) {
        let mut bytes = moved(&trained_text()).into_bytes();
        let at = (place * bytes.len() as f64) as usize;
        bytes[at] ^= 1 << bit;
        if let Ok(flipped) = String::from_utf8(bytes) {
            prop_assert!(load(&flipped).is_err(), "bit {} of byte {}", bit, at);
        }
    }
}
