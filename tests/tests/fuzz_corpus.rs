//! Every fuzz target on every file of its corpus, and on mutations of them: a bounded run without a fuzzer.

use std::fs;
use std::path::Path;

use collided_tests::fuzz_targets::{TARGETS, Target};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Of each target. A fuzzer does as many in seconds, and chooses them better.
const MUTATIONS: u32 = 3000;

fn target(name: &str) -> Target {
    let found = TARGETS.iter().find(|(target, _)| *target == name);
    found.unwrap_or_else(|| panic!("no target is called {name}")).1
}

/// The files of a corpus, in the order of their names.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("the corpus can be listed").path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} is empty", folder.display());
    paths.iter().map(|path| fs::read(path).expect("a file of the corpus can be read")).collect()
}

/// One change of some bytes. Places are shares of the length, so that they fit whatever went before.
#[derive(Debug, Clone)]
enum Mutation {
    Replace(Index, u8),
    Flip(Index, u8),
    Insert(Index, Vec<u8>),
    Remove(Index, usize),
    Repeat(Index, usize),
    Truncate(Index),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let place = any::<Index>;
    prop_oneof![
        4 => (place(), any::<u8>()).prop_map(|(at, byte)| Mutation::Replace(at, byte)),
        2 => (place(), 0..8u8).prop_map(|(at, bit)| Mutation::Flip(at, bit)),
        2 => (place(), vec(any::<u8>(), 1..12)).prop_map(|(at, bytes)| Mutation::Insert(at, bytes)),
        2 => (place(), 1..12usize).prop_map(|(at, count)| Mutation::Remove(at, count)),
        1 => (place(), 1..40usize).prop_map(|(at, count)| Mutation::Repeat(at, count)),
        1 => place().prop_map(Mutation::Truncate),
    ]
}

impl Mutation {
    fn apply(&self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        let length = bytes.len();
        match self {
            Mutation::Replace(at, byte) => *at.get_mut(bytes) = *byte,
            Mutation::Flip(at, bit) => *at.get_mut(bytes) ^= 1 << bit,
            Mutation::Insert(at, more) => drop(bytes.splice(at.index(length)..at.index(length), more.iter().copied())),
            Mutation::Remove(at, count) => drop(bytes.drain(at.index(length)..(at.index(length) + count).min(length))),
            Mutation::Repeat(at, count) => {
                bytes.extend_from_within(at.index(length)..(at.index(length) + count).min(length));
            }
            Mutation::Truncate(at) => bytes.truncate(at.index(length)),
        }
    }
}

fn run(name: &str) {
    let (target, corpus) = (target(name), corpus(name));
    corpus.iter().for_each(|bytes| target(bytes));
    let inputs = (select(corpus), vec(mutation(), 1..8)).prop_map(|(mut bytes, mutations)| {
        mutations.iter().for_each(|mutation| mutation.apply(&mut bytes));
        bytes
    });
    let config = Config { cases: MUTATIONS, failure_persistence: None, ..Config::default() };
    // Always the same mutations: finding new ones is the fuzzer's work.
    let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let outcome = TestRunner::new_with_rng(config, random).run(&inputs, |bytes| {
        target(&bytes);
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{name}: {error}"));
}

#[test]
fn mesh_file() {
    run("mesh_file");
}

#[test]
fn meshes_and_transforms() {
    run("meshes_and_transforms");
}

#[test]
fn report_payloads() {
    run("report_payloads");
}

#[test]
fn scene_file() {
    run("scene_file");
}

#[test]
fn step_payloads() {
    run("step_payloads");
}

#[test]
fn wire_messages() {
    run("wire_messages");
}
