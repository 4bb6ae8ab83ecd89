//! The measurements of a family as a table, for terminals and for the page.

use super::measurement::{Family, Measurement};
use super::units::{duration, percent};

/// Headings and rows of cells; the first column is text, all others are numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The headings.
    pub headings: Vec<&'static str>,
    /// As many cells each.
    pub rows: Vec<Vec<String>>,
}

/// A column: its heading, and what stands in it.
type Column = (&'static str, fn(&Measurement) -> String);

const SETTING: Column =
    ("setting", |row| format!("{} {}", row.setting.curve(), row.setting.label()).trim_end().to_owned());
const THREADS: Column = ("threads", |row| row.threads.to_string());
const TIME: Column = ("a step", |row| duration(row.time.median));
const SPREAD: Column = ("quartiles", |row| format!("{} to {}", duration(row.time.low), duration(row.time.high)));
const OPEN: Column = ("open", |row| percent(row.worth.open_share()));
const OPEN_PAIRS: Column = ("open pairs", |row| format!("{} of {}", row.worth.open, row.worth.pairs));
const WRONG: Column = ("wrong pairs", |row| format!("{} of {}", row.worth.wrong, row.worth.pairs));
const OVERRUN: Column = ("overrun (99 %)", |row| row.worth.overrun.map_or_else(String::new, duration));
const MEMORY: Column =
    ("memory", |row| row.worth.memory.map_or_else(String::new, |bytes| indicatif::HumanBytes(bytes).to_string()));
const MEDIAN_ERROR: Column =
    ("median error", |row| row.worth.error.map_or_else(String::new, |error| small(error.median)));
const LARGEST_ERROR: Column =
    ("largest error", |row| row.worth.error.map_or_else(String::new, |error| small(error.largest)));
const APART: Column = ("apart at most", |row| row.worth.apart.map_or_else(String::new, |apart| format!("{apart:.3}")));
const TEST_TIME: Column = ("a test", |row| duration(row.time.median));
const WRONG_TESTS: Column = ("wrong tests", |row| {
    let [tests, wrong] = row.worth.tests.unwrap_or_default();
    format!("{wrong} of {tests}")
});

fn small(error: f64) -> String {
    if error == 0.0 { "0".to_owned() } else { format!("{error:.1e}") }
}

fn columns(family: Family) -> &'static [Column] {
    match family {
        Family::Level => &[SETTING, THREADS, TIME, SPREAD, OPEN, OPEN_PAIRS, APART],
        Family::Budget => &[SETTING, THREADS, TIME, SPREAD, OPEN, OPEN_PAIRS, OVERRUN],
        Family::Matrix => &[SETTING, THREADS, TIME, SPREAD, MEMORY],
        Family::Distance | Family::TimeOfContact => {
            &[SETTING, THREADS, TIME, SPREAD, MEDIAN_ERROR, LARGEST_ERROR, OPEN_PAIRS]
        }
        Family::Effect => &[SETTING, THREADS, TIME, SPREAD],
        Family::Arithmetic => &[SETTING, TEST_TIME, SPREAD, WRONG_TESTS, WRONG],
    }
}

impl Table {
    /// The measurements of a family; `None` when there are none.
    pub fn of(family: Family, measured: &[Measurement]) -> Option<Table> {
        let columns = columns(family);
        let of_family = measured.iter().filter(|row| row.setting.family() == family);
        let rows: Vec<_> = of_family.map(|row| columns.iter().map(|(_, cell)| cell(row)).collect()).collect();
        let headings = columns.iter().map(|(heading, _)| *heading).collect();
        (!rows.is_empty()).then_some(Table { headings, rows })
    }

    /// Aligned for a terminal, a line a row.
    pub fn text(&self) -> String {
        let headings: Vec<String> = self.headings.iter().map(|heading| (*heading).to_owned()).collect();
        let lines = || std::iter::once(&headings).chain(&self.rows);
        let width = |column: usize| lines().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..headings.len()).map(width).collect();
        lines().map(|row| aligned(row, &widths)).collect()
    }
}

fn aligned(row: &[String], widths: &[usize]) -> String {
    let cells = row.iter().zip(widths).enumerate().map(|(column, (cell, &width))| match column {
        0 => format!("{cell:width$}"),
        _ => format!("  {cell:>width$}"),
    });
    cells.collect::<String>().trim_end().to_owned() + "\n"
}

#[cfg(test)]
mod tests {
    use super::super::measurement::{Setting, Worth};
    use super::super::statistics::Spread;
    use super::*;

    #[test]
    fn columns_are_aligned_and_other_families_left_out() {
        let row = |nanoseconds: u64, open: u64| Measurement {
            setting: Setting::Budget { nanoseconds },
            threads: 1,
            repetitions: 1,
            time: Spread { median: 1e3, low: 1e3, high: 2e3 },
            worth: Worth { pairs: 200, open, ..Worth::default() },
        };
        let measured = [row(1_000, 200), row(20_000, 3)];
        let table = Table::of(Family::Budget, &measured).expect("there are rows");
        let text = table.text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[2], "budget 20 µs        1    1 µs  1 µs to 2 µs  1.5 %    3 of 200");
        let ends = lines.iter().map(|line| line.find("quartiles").or(line.find("1 µs to")));
        assert!(ends.clone().all(|end| end.is_some()), "{text}");
        assert_eq!(Table::of(Family::Matrix, &measured), None);
    }
}
