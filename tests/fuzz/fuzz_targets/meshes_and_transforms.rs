//! `cargo +nightly fuzz run meshes_and_transforms`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| collided_tests::fuzz_targets::meshes_and_transforms(bytes));
