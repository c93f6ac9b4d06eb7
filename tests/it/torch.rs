//! Writes updates of the learner on made-up transitions. `tests/interop/torch.sh` lets PyTorch compute them
//! again.

use avastra::agent::{Adam, Network, Settings, Shape, Transition};
use avastra::rng::Stream;
use avastra::{agent, rng};
use serde_json::json;

use crate::cases::root;

const INPUTS: usize = 19;
const ROWS: usize = 45;
const TRANSITIONS: usize = 512;
const UPDATES: usize = 100;
const TARGET_PERIOD: usize = 25;

#[test]
#[ignore = "its reader is tests/interop/torch.sh"]
fn torch_reference() {
    let cases = [
        ("released", "hidden_units: [64, 48]\ninitialization: { normal: 0.1 }\n"),
        ("avastra", "state: full\nencoding: raw\nhidden_units: [64, 48]\ngradient_norm_max: 0.5\n"),
        ("paper", "hidden_units: [256, 256]\ndouble: false\ninitialization: he\nlearning_rate: 1e-3\n"),
    ];
    let cases: Vec<_> = cases.iter().map(|(preset, text)| case(preset, text)).collect();
    let path = root().join("target/interop/torch.json");
    std::fs::create_dir_all(path.parent().expect("it is in a directory")).expect("it is writable");
    std::fs::write(&path, json!(cases).to_string()).expect("it is writable");
}

fn case(preset: &str, text: &str) -> serde_json::Value {
    let entry = agent::by_name("ddqn").expect("it is registered");
    let read = Settings::from_yaml(entry, Some(preset), text).expect("it is trained");
    let read = read.expect("the settings are sound");
    let settings = read.learner().expect("it learns");
    let network = &settings.network;
    let layers = [INPUTS].into_iter().chain(network.hidden_units.clone()).chain([ROWS]).collect();
    let shape = Shape { layers, dueling: network.dueling };
    let mut rng = rng::stream(7, Stream::Initialization, 0);
    let mut online = Network::new(shape.clone(), network.initialization, &mut rng);
    let mut adam = Adam::new(online.parameters().len(), settings.learning_rate);
    let mut target = online.clone();
    let first = online.parameters().to_vec();
    let transitions: Vec<Transition> = (0..TRANSITIONS).map(|_| transition(&mut rng)).collect();
    let mut losses = Vec::new();
    for update in 0..UPDATES {
        // Both programs use the same transitions and weights for an update.
        let chosen = (0..settings.batch_len).map(|at| (update * 37 + at * 11) % TRANSITIONS);
        let batch: Vec<&Transition> = chosen.map(|index| &transitions[index]).collect();
        let weights: Vec<f32> = (0..settings.batch_len).map(|at| 1.0 / (1.0 + (at % 4) as f32)).collect();
        let (loss, _) = agent::improve(&mut online, &target, &mut adam, settings, &batch, &weights);
        losses.push(loss);
        if (update + 1) % TARGET_PERIOD == 0 {
            target.copy_from(&online);
        }
    }
    json!({
        "preset": preset, "layers": shape.layers, "dueling": shape.dueling, "double": settings.double,
        "huber": settings.loss == agent::Loss::Huber, "norm_max": settings.gradient_norm_max,
        "learning_rate": settings.learning_rate, "batch_len": settings.batch_len,
        "target_period": TARGET_PERIOD, "first": first, "last": online.parameters(), "losses": losses,
        "transitions": transitions.iter().map(|one| json!({
            "inputs": one.inputs, "row": one.row, "reward": one.reward, "discount": one.discount,
            "next_inputs": one.next_inputs, "next_legal": one.next_legal,
        })).collect::<Vec<_>>(),
    })
}

fn transition(rng: &mut rng::Rng) -> Transition {
    let mut state = || (0..INPUTS).map(|_| rng::normal(rng) as f32).collect();
    let (inputs, next_inputs) = (state(), state());
    let row = rng::below(rng, ROWS as u32);
    Transition {
        inputs,
        row,
        reward: (rng::normal(rng) * 2.0) as f32,
        discount: if rng::unit(rng) < 0.1 { 0.0 } else { 0.9 },
        next_inputs,
        // At least the row itself is legal.
        next_legal: (0..ROWS as u32).map(|other| other == row || rng::unit(rng) < 0.6).collect(),
    }
}
