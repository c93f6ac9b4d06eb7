//! The states that a policy comes to, and what its network thinks of each.

use crate::action::ActionTable;
use crate::agent::Agent;
use crate::agent::QPolicy;
use crate::agent::Visit;
use crate::episode;
use crate::episode::Choice;
use crate::episode::Moment;
use crate::rng;
use crate::rng::Stream;
use crate::study::arena::Arena;
use crate::study::arena::carry_out;
use crate::study::arena::legal;

/// Lets a policy choose, and shows the state that it chooses in with its legal rows, also where the policy
/// itself would not ask what is legal. States in which nothing is legal are left out.
pub fn visit(
    table: &ActionTable,
    policy: &mut QPolicy,
    moment: &Moment,
    visited: &mut dyn FnMut(Visit),
) -> Choice {
    let offers = table.offers(moment.situation);
    let legal = legal(&offers);
    let open = policy.legal_rows(legal.view());
    if let Some(best) = policy.greedy(moment.observation, &open) {
        let q_values = policy.q_values(moment.observation).to_vec();
        visited(Visit { observation: moment.observation.clone(), open, q_values, best });
    }
    carry_out(offers, legal.view(), policy, moment)
}

/// The states of so many episodes on each road; seeds come from a stream, numbered from `first`.
pub(super) fn visits(
    arena: &Arena,
    policy: &QPolicy,
    episodes: u64,
    (seed, stream, first): (u64, Stream, u64),
) -> Vec<Visit> {
    let mut visits = Vec::new();
    for number in 0..episodes * arena.roads() as u64 {
        let seed = rng::child_seed(seed, stream, first + number);
        let setup = arena.setup((number % arena.roads() as u64) as usize, seed);
        let mut agent = policy.clone();
        agent.begin();
        let mut visited = |one| visits.push(one);
        let mut choose = |moment: &Moment| visit(arena.table(), &mut agent, moment, &mut visited);
        episode::run(&setup, &mut choose, &mut |_, _, _| {});
    }
    visits
}
