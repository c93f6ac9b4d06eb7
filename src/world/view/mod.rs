//! Questions about a moment that change nothing: the world as one road user sees it, facts, lines of sight.

pub mod around;
pub mod crossing;
pub mod encroachment;
pub mod moment;
pub mod safety;
pub mod sense;
pub mod watched;
pub mod world;
