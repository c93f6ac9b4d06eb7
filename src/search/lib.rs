//! The agents, which choose rows: they see measurable facts of a moment and the mask of legal rows, never the world or
//! the driving system.
//!
//! - [`mdp`]: the state variables, the collision probability and the reward, with the paper's equation numbers.
//! - [`agent`]: the agents, in a registry: by chance, learners, searches, and what a trained network or its rules choose.
//!
//! ```
//! use avastra_base::rng::{self, Stream};
//! use avastra_search::agent::{Kind, by_name};
//! use avastra_search::mdp::Observation;
//!
//! let Kind::Ready(build) = by_name("random").expect("it is in the registry").kind else {
//!     panic!("it needs no training")
//! };
//! // Three rows with equal odds, of which one is legal.
//! let mut agent = build();
//! let mut legal = vec![false, true, false];
//! let mut rng = rng::stream(1, Stream::Exploration, 0);
//! agent.begin(7);
//! assert_eq!(agent.choose(&Observation::zeros(), &mut legal, &mut rng), Some(1));
//! ```

pub mod mdp;
pub mod agent;
