//! `cargo +nightly fuzz run step_payloads`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| collided_tests::fuzz_targets::step_payloads(bytes));
