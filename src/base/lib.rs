//! Numbers, units, chance, texts and geometry for all other crates. This crate knows no roads and no vehicles.
//!
//! - [`outside`]: texts from outside, and one function for each place where they may stand.
//! - [`threads`]: work on as many threads as the system gives, with results in order.
//! - [`units`]: exact numbers with dimensions, at the language's edge; inside, everything is SI and `f64`.
//! - [`rng`]: one stream of chance for each consumer, by seed and number.
//! - [`statistics`]: intervals, rank tests and survival of samples.
//! - [`geometry`]: poses, boxes, paths, and when moving boxes first touch.
//! - [`kinematics`]: gravity, standing, braking, following: one figure or law each, with its source.
//!
//! ```
//! use avastra_base::rng::{self, Stream};
//!
//! let drawn = |index| rng::unit(&mut rng::stream(1, Stream::Exploration, index));
//! assert_eq!(drawn(7), drawn(7), "the same seed, stream and number give the same chance");
//! assert_ne!(drawn(7), drawn(8));
//! ```

pub mod outside;
mod folded;
pub mod threads;
pub mod units;
pub mod rng;
pub mod statistics;
pub mod geometry;
pub mod kinematics;

pub use folded::folded;
