//! `cargo +nightly fuzz run report_payloads`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| collided_tests::fuzz_targets::report_payloads(bytes));
