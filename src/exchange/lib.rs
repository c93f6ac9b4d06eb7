//! Findings for other tools ([`export`]), scenarios of other tools ([`import`]), and pages and pictures ([`report`]).
//! Its functions are pure: texts and recordings in, texts out.

pub mod export;
pub mod import;
pub mod report;
