//! Curves over a count, and the same numbers as a table.

use std::time::Instant;

use collided::accuracy::plot::{Axis, Curve, Plot, Point, Unit};

/// A plot, and the name of its file.
pub type Figure = (&'static str, Plot);

/// Numbers over a count: of each count one for each curve.
pub struct Series<'a> {
    pub title: &'a str,
    pub counted: (&'a str, Unit),
    pub shown: (&'a str, Unit),
    pub curves: &'a [&'a str],
}

impl Series<'_> {
    pub fn plot(&self, rows: &[(f64, Vec<f64>)]) -> Plot {
        let axis = |(title, unit): (&str, Unit)| Axis { title: title.to_owned(), unit };
        let point = |(count, shown): &(f64, Vec<f64>), curve: usize| Point {
            x: *count,
            spread: [*count; 2],
            y: shown[curve],
            label: String::new(),
        };
        let curve = |(style, name): (usize, &&str)| Curve {
            name: (*name).to_owned(),
            companion: false,
            style,
            points: rows.iter().map(|row| point(row, style)).collect(),
        };
        let curves = self.curves.iter().enumerate().map(curve).collect();
        Plot { title: self.title.to_owned(), x: axis(self.counted), y: axis(self.shown), curves }
    }
}

/// A line of a table.
pub fn print_row<T: AsRef<str>>(cells: impl IntoIterator<Item = T>) {
    let cells: Vec<T> = cells.into_iter().collect();
    println!("| {} |", cells.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(" | "));
}

/// The head of a table.
pub fn print_head(cells: &[&str]) {
    println!();
    print_row(cells);
    print_row(cells.iter().map(|_| "---"));
}

/// Nanoseconds that something takes.
pub fn nanoseconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let done = work();
    (start.elapsed().as_nanos() as f64, done)
}

pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}
