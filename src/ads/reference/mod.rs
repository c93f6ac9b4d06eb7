//! Reference drivers: simple, published, with perfect knowledge; what `modular` is compared with.

mod idm;

pub use idm::Idm;
