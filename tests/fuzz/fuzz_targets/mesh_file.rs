//! `cargo +nightly fuzz run mesh_file`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| collided_tests::fuzz_targets::mesh_file(bytes));
