//! Any bytes as the text of an `.ava` file.

#![no_main]

#[path = "../examine.rs"]
mod examine;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| examine::examine(&String::from_utf8_lossy(bytes)));
