//! Episodes, what is judged of them, and the campaigns that are made of many.
//!
//! [`episode`] plays one; [`oracle`] judges its collisions; [`run`], [`train`], [`study`], [`estimate`] and [`trial`] play
//! many and keep them in a database; [`emit`] writes what they find as files of the language; [`files`] alone creates,
//! replaces and removes files.

pub mod episode;
pub mod oracle;
pub mod files;
pub mod run;
pub mod estimate;
pub mod train;
pub mod trial;
pub mod study;
pub mod emit;
