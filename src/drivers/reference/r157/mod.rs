//! The drivers of UN R157: its two performance models, by which a careful driver is told from others (`cc`, `fsm`), and
//! the least that it demands of a system (`minimal`, by name `r157`). Their figures are `kinematics`'.

mod cc;
mod fsm;
mod minimal;

pub use cc::CarefulHuman;
pub use fsm::FuzzySafety;
pub use minimal::MinimalPerformance;
#[cfg(test)]
pub use minimal::avoidable_from_s;
