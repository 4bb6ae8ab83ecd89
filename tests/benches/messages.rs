//! What it takes to hand words to another processor: through the caches, and as steps and reports are written.
//!
//! `cargo bench -p collided-tests --bench messages`. Two threads share one piece of memory: one writes it, the other adds its words up, in turn.
//! Written and read whole, medians. The figures depend on which caches the two processors share; where the host is one of several, that
//! may change from one run to the next.

use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

use collided_client::transport;
use collided_protocol::step::Word;

type Memory = Vec<MaybeUninit<Word>>;
type Write = fn(&mut [MaybeUninit<Word>], &[Word]);

const SIZES: [usize; 6] = [1_000, 2_000, 4_096, 12_000, 40_000, 120_000];
const WAYS: [(&str, Write); 2] = [("through the caches", through_caches), ("as steps are written", transport::copy)];
const ROUNDS: usize = 2_000;

/// Memory that two threads have in turn: the writer when the turn is even, the reader when it is odd.
struct Shared {
    turn: AtomicU64,
    memory: Mutex<Memory>,
}

fn main() {
    println!("{:>8} | {:21} | write us | write and read us", "words", "");
    for words in SIZES {
        let times = times(words);
        for (way, (name, _)) in WAYS.iter().enumerate() {
            let [written, read] =
                [0, 1].map(|which| median(times.iter().skip(way).step_by(WAYS.len()).map(|time| time[which])));
            println!("{words:8} | {name:21} | {written:8.2} | {read:8.2}");
        }
    }
}

/// Microseconds until the words were written, and until they were read; the ways take turns.
fn times(words: usize) -> Vec<[f64; 2]> {
    let shared = Shared { turn: AtomicU64::new(0), memory: Mutex::new(vec![MaybeUninit::new(0); words]) };
    let turns = 2 * (WAYS.len() * ROUNDS) as u64;
    std::thread::scope(|scope| {
        scope.spawn(|| read(&shared, turns));
        (0..turns).step_by(2).map(|turn| handed_over(&shared, turn)).collect()
    })
}

fn handed_over(shared: &Shared, turn: u64) -> [f64; 2] {
    let content: Vec<Word> = (turn..).take(shared.mine(turn).len()).collect();
    let (_, write) = WAYS[(turn / 2) as usize % WAYS.len()];
    let start = Instant::now();
    let microseconds = || start.elapsed().as_secs_f64() * 1e6;
    write(&mut shared.mine(turn), &content);
    let written = microseconds();
    shared.turn.store(turn + 1, Ordering::Release);
    drop(shared.mine(turn + 2));
    [written, microseconds()]
}

fn read(shared: &Shared, turns: u64) {
    for turn in (1..turns).step_by(2) {
        let memory = shared.mine(turn);
        // SAFETY: it was initialised when it was made, and again by the writer.
        let sum = memory.iter().fold(0, |sum: Word, word| sum.wrapping_add(unsafe { word.assume_init() }));
        std::hint::black_box(sum);
        drop(memory);
        shared.turn.store(turn + 1, Ordering::Release);
    }
}

impl Shared {
    /// The memory, as soon as it is this turn.
    fn mine(&self, turn: u64) -> MutexGuard<'_, Memory> {
        while self.turn.load(Ordering::Acquire) < turn {
            std::hint::spin_loop();
        }
        self.memory.lock().expect("the other thread has not panicked")
    }
}

fn through_caches(memory: &mut [MaybeUninit<Word>], words: &[Word]) {
    for (place, &word) in memory.iter_mut().zip(words) {
        place.write(word);
    }
}

fn median(times: impl Iterator<Item = f64>) -> f64 {
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
