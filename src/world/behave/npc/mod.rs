//! Other drivers: how they follow, stop at lights, change lanes and let others go first.
//!
//! | question | file |
//! |---|---|
//! | in what order a driver decides and moves | `driver` |
//! | which vehicle it follows, and how close | `leader`; in tight turns `foresight` |
//! | where it stops for a red or yellow light, or a sign | `stop_line` |
//! | which vehicles it waits for at a junction, and for how long | `manners` |
//! | when and how it changes lanes | `change`; for its own gain `mobil` |
//! | how it does what an order or a phase tells it | lateral orders `aside`, next junction `turn`, beside the ego vehicle `pursuit`, speed `driver` |
//! | what it sees and does under the profile `released` | `rays` |

mod aside;
pub mod change;
mod driver;
mod figures;
mod foresight;
mod leader;
mod manners;
mod mobil;
mod pursuit;
mod rays;
mod stop_line;
mod turn;
