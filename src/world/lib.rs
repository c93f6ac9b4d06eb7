//! The action table, and the world in which its rows are carried out. It knows no driving system.
//!
//! [`action::ActionTable`] says which rows a moment offers and which rule refuses the others; no action reaches the
//! [`sim::World`] in another way. A world moves by ticks of 20 ms; its `Clone` is a snapshot.

pub mod action;
pub mod sim;
