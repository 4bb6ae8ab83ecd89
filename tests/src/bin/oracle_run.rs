//! Compares the kernel's exact triangle test with the oracle on as many random pairs as one likes.
//!
//! Pair `n` of a seed is always the same. Exit status 1 when a pair differs.

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use collided_tests::kernel_pair;
use collided_tests::oracle;
use collided_tests::triangle_pairs::{Pair, any_pair};
use indicatif::{ParallelProgressIterator, ProgressBar, ProgressStyle};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use rayon::prelude::*;

/// Compare the kernel's exact triangle test with the exact oracle on random pairs of triangles.
#[derive(Parser)]
struct Arguments {
    /// How many pairs; rounded up to whole chunks of 1000
    #[arg(long, default_value_t = 1_000_000)]
    pairs: u64,
    /// Which pairs
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

const CHUNK: u64 = 1000;

/// Differences printed in full; the rest is only counted.
const PRINTED: usize = 20;

struct Difference {
    pair: Pair,
    kernel: oracle::Relation,
    oracle: oracle::Relation,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let chunks = arguments.pairs.div_ceil(CHUNK);
    let progress = ProgressBar::new(chunks).with_style(style());
    let start = Instant::now();
    let tallies = (0..chunks).into_par_iter().progress_with(progress).map(|chunk| run_chunk(arguments.seed, chunk));
    let (differences, by_relation) = tallies.reduce(Default::default, merged);
    print_summary(&differences, by_relation, start.elapsed().as_secs_f64());
    if differences.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:40} {percent}% of {len} thousand pairs, {per_sec}, {eta} left")
        .expect("the template is well formed")
}

/// Differences, and how many pairs had each relation.
type Tally = (Vec<Difference>, [u64; 4]);

fn run_chunk(seed: u64, chunk: u64) -> Tally {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    bytes[8..16].copy_from_slice(&chunk.to_le_bytes());
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let mut runner = TestRunner::new_with_rng(Config::default(), random);
    let strategy = any_pair();
    let mut tally = Tally::default();
    for _ in 0..CHUNK {
        let tree = strategy.new_tree(&mut runner).expect("few pairs overflow");
        compare(tree.current(), &mut tally);
    }
    tally
}

fn compare(pair: Pair, (differences, by_relation): &mut Tally) {
    let kernel = kernel_pair::triangles(&pair.0, &pair.1);
    let oracle = oracle::triangles(&pair.0, &pair.1);
    by_relation[oracle as usize] += 1;
    if kernel != oracle {
        differences.push(Difference { pair, kernel, oracle });
    }
}

fn merged(mut a: Tally, b: Tally) -> Tally {
    a.0.extend(b.0);
    a.1.iter_mut().zip(b.1).for_each(|(count, more)| *count += more);
    a
}

fn print_summary(differences: &[Difference], by_relation: [u64; 4], seconds: f64) {
    for Difference { pair, kernel, oracle } in differences.iter().take(PRINTED) {
        println!("kernel {}, oracle {}: {:?} {:?}", kernel.name(), oracle.name(), pair.0, pair.1);
    }
    let [none, touch, coplanar, cross] = by_relation;
    let pairs: u64 = by_relation.iter().sum();
    println!("{pairs} pairs: {none} apart, {touch} touch, {coplanar} coplanar, {cross} cross");
    println!("{} differences; {seconds:.1} s, {:.0} pairs a second", differences.len(), pairs as f64 / seconds);
}
