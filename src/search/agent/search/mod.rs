//! Searches: they keep a record of what rows led to, and learn no values.

mod bandit;
mod constant;
mod situation;
mod worth;

pub use bandit::BanditSettings;
pub use constant::ConstantSettings;
