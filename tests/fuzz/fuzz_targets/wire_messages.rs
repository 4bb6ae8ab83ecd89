//! `cargo +nightly fuzz run wire_messages`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| collided_tests::fuzz_targets::wire_messages(bytes));
