//! Tests at the pipeline's edges: a case is a file under `tests/cases/`, its expectation a file
//! under `snapshots/`.

mod agents;
mod alarms;
mod cases;
mod command;
mod corpus;
mod contacts;
mod disks;
mod drives;
mod editor;
mod emitted;
mod examples;
mod failures;
mod faults;
mod help;
mod hostile;
mod json;
mod language;
mod layers;
mod pedestrians;
mod policies;
mod profiles;
mod references;
mod road;
mod rules;
mod studies;
mod suites;
mod surveys;
mod tables;
mod traces;
mod torch;
mod training;
mod traffic;
mod trials;
mod wishes;
mod world;
