//! The axes: where numbers stand, and what is written beside them.

use crate::accuracy::units;

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Written along it.
    pub title: String,
    /// What is shown.
    pub unit: Unit,
}

/// What an axis shows, and so how its numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Nanoseconds, logarithmic.
    Time,
    /// Shares as percentages, logarithmic.
    Share,
    /// Powers of ten, logarithmic.
    Power,
    /// Integers, linear.
    Count,
}

impl Unit {
    fn is_logarithmic(self) -> bool {
        self != Unit::Count
    }

    fn write(self, value: f64) -> String {
        match self {
            Unit::Time => units::duration(value),
            Unit::Share => units::percent(value),
            Unit::Power => units::power(value),
            Unit::Count => format!("{value:.0}"),
        }
    }
}

/// An axis laid over some pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    unit: Unit,
    /// The first and the last number that has a place, logarithms where the axis is logarithmic.
    ends: [f64; 2],
    /// Where these are.
    pixels: [f64; 2],
    /// Where 0 is, if it has a place of its own.
    zero: Option<f64>,
    /// Whether it is logarithmic and spans few decades.
    is_few: bool,
}

/// Logarithms that differ by less are of the same number.
const NEARLY: f64 = 1e-9;

/// An axis with fewer decades ends at, and has numbers at, 1, 2 and 5 of a decade.
const FEW_DECADES: f64 = 2.0;

/// An axis with more decades has no lines within them.
const MANY_DECADES: f64 = 6.0;

/// Pixels between the last decade and the line of zeros.
const ZERO_GAP: f64 = 34.0;

impl Scale {
    /// Covers the numbers, whole decades where logarithmic.
    pub fn covering(unit: Unit, numbers: impl Iterator<Item = f64> + Clone, [from, to]: [f64; 2]) -> Scale {
        let has_zero = unit.is_logarithmic() && numbers.clone().any(|number| number == 0.0);
        let placed = numbers.filter(|&number| number.is_finite() && (number > 0.0 || !unit.is_logarithmic()));
        let placed = placed.map(|number| if unit.is_logarithmic() { number.log10() } else { number });
        let nothing = [f64::INFINITY, f64::NEG_INFINITY];
        let [low, high] = placed.fold(nothing, |[low, high], at| [low.min(at), high.max(at)]);
        let is_few = unit.is_logarithmic() && high - low < FEW_DECADES;
        let (low, high) = match (low <= high, is_few) {
            (false, _) => (-1.0, 0.0),
            (true, true) => around(low, high),
            (true, false) => ((low + NEARLY).floor(), (high - NEARLY).ceil()),
        };
        let high = if high > low { high } else { low + 1.0 };
        let start = if has_zero { from + ZERO_GAP.copysign(to - from) } else { from };
        Scale { unit, ends: [low, high], pixels: [start, to], zero: has_zero.then_some(from), is_few }
    }

    /// Where a number is; at the end where it is not covered.
    pub fn at(&self, number: f64) -> f64 {
        match self.zero {
            Some(zero) if number == 0.0 => zero,
            _ => self.place(if self.unit.is_logarithmic() { number.log10() } else { number }),
        }
    }

    fn place(&self, position: f64) -> f64 {
        let share = (position - self.ends[0]) / (self.ends[1] - self.ends[0]);
        self.pixels[0] + share.clamp(0.0, 1.0) * (self.pixels[1] - self.pixels[0])
    }

    /// Where the line of zeros is, if there is one.
    pub fn zero(&self) -> Option<f64> {
        self.zero
    }

    /// The pixels of the part that is not the line of zeros.
    pub fn pixels(&self) -> [f64; 2] {
        self.pixels
    }

    /// Lines with a number: decades, or integers; every other one, or fewer, where there are many; 1, 2 and 5 of each decade
    /// where there are few.
    pub fn lines(&self) -> Vec<(f64, String)> {
        let [low, high] = self.ends;
        let most = if self.unit == Unit::Count { 20.0 } else { 8.0 };
        let stride = ((high - low) / most).ceil().max(1.0) as usize;
        let positions = match self.is_few {
            true => self.of_decades(&[1, 2, 5]),
            false => (0..=(high - low) as usize).step_by(stride).map(|step| low + step as f64).collect(),
        };
        let number = |position: f64| if self.unit.is_logarithmic() { 10f64.powf(position) } else { position };
        positions.into_iter().map(|position| (self.place(position), self.unit.write(number(position)))).collect()
    }

    /// Finer lines without a number: 2 to 9 of each decade, unless there are many.
    pub fn fine_lines(&self) -> Vec<f64> {
        match self.unit.is_logarithmic() && self.ends[1] - self.ends[0] <= MANY_DECADES {
            true => {
                self.of_decades(&[2, 3, 4, 5, 6, 7, 8, 9]).into_iter().map(|position| self.place(position)).collect()
            }
            false => Vec::new(),
        }
    }

    /// These numbers of each decade that is covered.
    fn of_decades(&self, factors: &[u32]) -> Vec<f64> {
        let [low, high] = self.ends;
        let decades = (low + NEARLY).floor() as i32..=high as i32;
        let positions =
            decades.flat_map(|decade| factors.iter().map(move |&factor| f64::from(decade) + f64::from(factor).log10()));
        positions.filter(|&position| position > low - NEARLY && position < high + NEARLY).collect()
    }
}

/// The nearest 1, 2 or 5 of a decade on either side, as logarithms.
fn around(low: f64, high: f64) -> (f64, f64) {
    let steps = [0.0, 2f64.log10(), 5f64.log10(), 1.0];
    let [below, above] = [(low + NEARLY).floor(), (high - NEARLY).floor()];
    let first = steps.iter().rev().find(|&step| below + step <= low + NEARLY);
    let last = steps.iter().find(|&step| above + step >= high - NEARLY);
    (below + first.unwrap_or(&0.0), above + last.unwrap_or(&1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_are_covered_whole() {
        let scale = Scale::covering(Unit::Time, [2_000.0, 300_000.0].into_iter(), [0.0, 300.0]);
        assert_eq!([1e3, 1e4, 1e6].map(|time| scale.at(time).round()), [0.0, 100.0, 300.0]);
        let lines: Vec<String> = scale.lines().into_iter().map(|(_, text)| text).collect();
        assert_eq!(lines, ["1 µs", "10 µs", "100 µs", "1 ms"]);
        assert_eq!(scale.fine_lines().len(), 24);
    }

    #[test]
    fn less_than_two_decades_end_at_one_two_or_five() {
        let scale = Scale::covering(Unit::Time, [1_100.0, 4_000.0].into_iter(), [0.0, 100.0]);
        let lines: Vec<String> = scale.lines().into_iter().map(|(_, text)| text).collect();
        assert_eq!(lines, ["1 µs", "2 µs", "5 µs"]);
        let scale = Scale::covering(Unit::Time, [2_000.0].into_iter(), [0.0, 100.0]);
        assert_eq!(scale.at(2_000.0), 0.0);
    }

    #[test]
    fn zero_has_a_line_of_its_own() {
        let scale = Scale::covering(Unit::Share, [0.0, 0.01, 1.0].into_iter(), [400.0, 0.0]);
        assert_eq!((scale.zero(), scale.at(0.0), scale.at(1.0)), (Some(400.0), 400.0, 0.0));
        assert!(scale.at(0.01) < 400.0 - ZERO_GAP + 1.0);
        assert_eq!(Scale::covering(Unit::Share, [0.01].into_iter(), [400.0, 0.0]).zero(), None);
    }

    #[test]
    fn one_number_or_none_still_makes_an_axis() {
        let one = Scale::covering(Unit::Share, [1.0].into_iter(), [0.0, 100.0]);
        assert!(one.lines().len() >= 2);
        assert!(Scale::covering(Unit::Power, std::iter::empty(), [0.0, 100.0]).lines().len() >= 2);
        assert_eq!(Scale::covering(Unit::Count, [3.0, 17.0].into_iter(), [0.0, 140.0]).at(4.0), 10.0);
    }
}
