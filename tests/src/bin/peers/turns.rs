//! Libraries taking turns.

use std::hint::black_box;
use std::time::Instant;

use serde::Serialize;

/// How often, and how long.
#[derive(Debug, clap::Args)]
pub struct Limits {
    /// Passes over all items; the fastest of each item counts
    #[arg(long, default_value_t = 3)]
    pub passes: usize,
    /// A library that takes longer than this for a pass is stopped there, and takes no other
    #[arg(long, default_value_t = 10.0)]
    pub seconds: f64,
}

/// Microseconds, and what was answered.
pub type Timed = (f64, f64);

/// Times a question; what has to be done before and is not part of it is done by the caller.
pub fn timed<T>(ask: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let answer = black_box(ask());
    (start.elapsed().as_secs_f64() * 1e6, answer)
}

/// A library, and how it answers an item by its number.
pub struct Contender<'a> {
    pub name: &'static str,
    pub ask: Box<dyn FnMut(usize) -> Timed + 'a>,
}

impl<'a> Contender<'a> {
    pub fn new(name: &'static str, ask: impl FnMut(usize) -> Timed + 'a) -> Contender<'a> {
        Contender { name, ask: Box::new(ask) }
    }
}

/// What a library did with the first items; it may have been stopped before the last one.
#[derive(Debug, Serialize)]
pub struct Record {
    pub library: &'static str,
    /// Of each item the fastest pass.
    pub us: Vec<f64>,
    pub answers: Vec<f64>,
}

/// Every library goes through all items before the next one does: its own data are in the caches, as they would be without
/// the others.
pub fn in_turns(mut contenders: Vec<Contender<'_>>, items: usize, limits: &Limits) -> Vec<Record> {
    let name = |contender: &Contender<'_>| Record { library: contender.name, us: Vec::new(), answers: Vec::new() };
    let mut records: Vec<Record> = contenders.iter().map(name).collect();
    for pass in 0..limits.passes {
        for (contender, record) in contenders.iter_mut().zip(&mut records) {
            if pass == 0 {
                first_pass(contender, record, items, limits.seconds);
            } else if record.us.len() == items {
                for (item, fastest) in record.us.iter_mut().enumerate() {
                    *fastest = fastest.min((contender.ask)(item).0);
                }
            }
        }
    }
    records
}

fn first_pass(contender: &mut Contender<'_>, record: &mut Record, items: usize, seconds: f64) {
    let start = Instant::now();
    for item in 0..items {
        let (us, answer) = (contender.ask)(item);
        record.us.push(us);
        record.answers.push(answer);
        if start.elapsed().as_secs_f64() > seconds {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_pass_of_each_item_counts() {
        let mut times = [5.0, 7.0, 6.0, 3.0].into_iter();
        let contender = Contender::new("it", move |item| (times.next().expect("two passes"), item as f64));
        let records = in_turns(vec![contender], 2, &Limits { passes: 2, seconds: 60.0 });
        assert_eq!((&records[0].us, &records[0].answers), (&vec![5.0, 3.0], &vec![0.0, 1.0]));
    }

    #[test]
    fn who_takes_too_long_is_stopped() {
        let records = in_turns(vec![Contender::new("it", |_| (1.0, 0.0))], 2, &Limits { passes: 2, seconds: -1.0 });
        assert_eq!(records[0].us, [1.0]);
    }
}
