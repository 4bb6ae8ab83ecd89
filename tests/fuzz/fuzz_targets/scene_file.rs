//! `cargo +nightly fuzz run scene_file`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| collided_tests::fuzz_targets::scene_file(bytes));
