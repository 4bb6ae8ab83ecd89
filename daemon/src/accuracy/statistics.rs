//! What repetitions come to.

/// The middle of some numbers, and how far they spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Half of the numbers are below.
    pub median: f64,
    /// Lower quartile: a quarter of the numbers are below.
    pub low: f64,
    /// Upper quartile: a quarter of the numbers are above.
    pub high: f64,
}

impl Spread {
    /// Of numbers in any order; `None` when there are none.
    pub fn of(mut numbers: Vec<f64>) -> Option<Spread> {
        numbers.sort_unstable_by(f64::total_cmp);
        Some(Spread {
            median: quantile(&numbers, 0.5)?,
            low: quantile(&numbers, 0.25)?,
            high: quantile(&numbers, 0.75)?,
        })
    }
}

impl Spread {
    /// Of rows of equally many numbers: the mean over the columns of what each column has. So a row in which the machine was
    /// busy with something else for a moment spoils one number, and not the whole row.
    pub fn mean_of_columns(rows: &[Vec<f64>]) -> Option<Spread> {
        let count = rows.first()?.len();
        let column = |at: usize| Spread::of(rows.iter().map(|row| row[at]).collect());
        let columns: Vec<Spread> = (0..count).filter_map(column).collect();
        let mean = |part: fn(&Spread) -> f64| columns.iter().map(part).sum::<f64>() / count as f64;
        let spread = Spread {
            median: mean(|column| column.median),
            low: mean(|column| column.low),
            high: mean(|column| column.high),
        };
        (count > 0).then_some(spread)
    }
}

/// The number below which a share of ascending numbers lies, between two of them by linear interpolation (Hyndman and Fan,
/// "Sample Quantiles in Statistical Packages", The American Statistician 1996, definition 7).
pub fn quantile(ascending: &[f64], share: f64) -> Option<f64> {
    let place = share * ascending.len().checked_sub(1)? as f64;
    let (below, above) = (ascending[place.floor() as usize], ascending[place.ceil() as usize]);
    // Two infinities have no difference.
    Some(if below == above { below } else { below + place.fract() * (above - below) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_of_numbers_in_any_order() {
        let spread = Spread::of(vec![4.0, 1.0, 3.0, 2.0, 5.0]);
        assert_eq!(spread, Some(Spread { median: 3.0, low: 2.0, high: 4.0 }));
        assert_eq!(Spread::of(vec![1.0, 2.0]).map(|spread| spread.median), Some(1.5));
        assert_eq!(Spread::of(vec![7.0]), Some(Spread { median: 7.0, low: 7.0, high: 7.0 }));
        assert_eq!(Spread::of(Vec::new()), None);
    }

    #[test]
    fn one_busy_moment_spoils_no_median() {
        let rows = [vec![1.0, 10.0], vec![1.0, 1000.0], vec![500.0, 12.0]];
        assert_eq!(Spread::mean_of_columns(&rows).map(|spread| spread.median), Some(6.5));
        assert_eq!(Spread::mean_of_columns(&[]), None);
        assert_eq!(Spread::mean_of_columns(&[vec![]]), None);
    }

    #[test]
    fn the_ends_are_quantiles_too() {
        let numbers = [1.0, 2.0, f64::INFINITY];
        assert_eq!(
            [0.0, 0.25, 1.0].map(|share| quantile(&numbers, share)),
            [Some(1.0), Some(1.5), Some(f64::INFINITY)]
        );
    }
}
