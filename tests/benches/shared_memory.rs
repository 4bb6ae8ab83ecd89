//! Whole steps through shared memory, beside raw iceoryx2 of the same shape in the same run, as a table.
//!
//! `cargo bench -p collided-tests --bench shared_memory`. A real daemon process with two threads; this process is the client. The raw twin
//! is a request-response service between two threads, which spin, or are woken by events. Figures are medians of the rounds, and each
//! round's that of its steps; a ratio is one of figures of the same round. With an argument, only the steps in whose name it is.

use collided_tests::raw_iceoryx2::Waiting;
use collided_tests::shared_memory::{Bench, Measured, SHAPES, Shape};

const ROUNDS: usize = 7;
const STEPS: usize = 1000;
/// Steps before which both sides fall asleep take longer.
const STEPS_AFTER_REST: usize = 200;

fn main() {
    let bench = Bench::new();
    println!("{:60} |   raw us |  ours us | ratio (range)      | asked | kernel us", "step");
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with('-')).unwrap_or_default();
    for shape in SHAPES.iter().filter(|shape| shape.name.contains(&wanted)) {
        row(&(0..ROUNDS).map(|_| bench.round(shape, steps(shape))).collect::<Vec<_>>());
    }
}

fn steps(shape: &Shape) -> usize {
    if shape.waiting == Waiting::Blocked { STEPS_AFTER_REST } else { STEPS }
}

fn row(rounds: &[Measured]) {
    let sorted = |of: fn(&Measured) -> f64| {
        let mut values: Vec<f64> = rounds.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let kernel = sorted(|round| round.kernel)[rounds.len() / 2];
    let (raw, ours, ratios) =
        (sorted(|round| round.raw), sorted(|round| round.ours), sorted(|round| round.ours / round.raw));
    let middle = rounds.len() / 2;
    let asked = rounds[0].asked.map_or_else(|| "–".to_owned(), |asked| asked.to_string());
    let (lowest, highest) = (ratios[0], ratios[rounds.len() - 1]);
    let Measured { name, .. } = rounds[0];
    println!(
        "{name:60} | {:8.2} | {:8.2} | {:.2} ({lowest:.2}–{highest:.2}) | {asked:5} | {kernel:.2}",
        raw[middle], ours[middle], ratios[middle]
    );
}
