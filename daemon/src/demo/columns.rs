//! The columns of the demonstration's tables.

use collided_client::StageTimes;

use super::event::Step;

/// Width of a column of times.
const TIME_WIDTH: usize = 9;

/// What a table shows in a column of times, and the time it shows, in nanoseconds.
type Column = (&'static str, fn(&Step) -> u64);

/// The columns of times: the stages in order, then the whole step in the daemon and seen from the client.
const COLUMNS: [Column; 8] = [
    ("boxes", |step| step.times.boxes),
    ("broad", |step| step.times.broad_phase + step.times.interest),
    ("voxels", |step| step.times.voxels),
    ("polygons", |step| step.times.polygon_pairs),
    ("tests", |step| step.times.polygon_tests),
    ("report", |step| step.times.effects + step.times.report),
    ("daemon", |step| step.times.total),
    ("client", |step| step.round_trip),
];

/// The headings of the columns of a step.
pub fn headings() -> String {
    let times: String = COLUMNS.iter().map(|(name, _)| format!("{name:>TIME_WIDTH$}")).collect();
    format!("{:>6}{:>9}{times}", "pairs", "polygons")
}

/// The columns of a step.
pub fn row(step: &Step) -> String {
    let times: String = COLUMNS.iter().map(|(_, time)| format!("{:>TIME_WIDTH$}", duration(time(step)))).collect();
    format!("{:>6}{:>9}{times}", step.pairs, step.polygon_pairs)
}

/// A step whose every number is the median of those of `steps`; `None` when there are none.
pub fn median(steps: &[Step]) -> Option<Step> {
    let of = |number: &dyn Fn(&Step) -> u64| {
        let mut numbers: Vec<u64> = steps.iter().map(number).collect();
        numbers.sort_unstable();
        numbers.get(numbers.len() / 2).copied()
    };
    Some(Step {
        step: of(&|step| step.step)?,
        pairs: of(&|step| step.pairs)?,
        polygon_pairs: of(&|step| step.polygon_pairs)?,
        round_trip: of(&|step| step.round_trip)?,
        times: StageTimes {
            boxes: of(&|step| step.times.boxes)?,
            broad_phase: of(&|step| step.times.broad_phase)?,
            interest: of(&|step| step.times.interest)?,
            voxels: of(&|step| step.times.voxels)?,
            polygon_pairs: of(&|step| step.times.polygon_pairs)?,
            polygon_tests: of(&|step| step.times.polygon_tests)?,
            effects: of(&|step| step.times.effects)?,
            report: of(&|step| step.times.report)?,
            total: of(&|step| step.times.total)?,
        },
    })
}

/// A duration given in nanoseconds, with a unit that fits.
fn duration(nanoseconds: u64) -> String {
    let microseconds = nanoseconds as f64 / 1e3;
    if microseconds < 1000.0 { format!("{microseconds:.1} µs") } else { format!("{:.2} ms", microseconds / 1e3) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_a_unit_that_fits() {
        for (nanoseconds, text) in [(0, "0.0 µs"), (1_249, "1.2 µs"), (999_900, "999.9 µs"), (1_234_567, "1.23 ms")]
        {
            assert_eq!(duration(nanoseconds), text);
        }
    }

    #[test]
    fn headings_stand_above_their_columns() {
        let step = Step { step: 0, pairs: 1, polygon_pairs: 2, round_trip: 3, times: StageTimes::default() };
        assert_eq!(headings().chars().count(), row(&step).chars().count());
        assert_eq!(median(&[step]), Some(step));
        assert_eq!(median(&[]), None);
    }
}
