//! What a study comes to, in plain sentences.

use collided_kernel::Level;

use super::measurement::{Family, Measurement, Precision, Setting};
use super::units::{duration, percent, power};

/// A finer order that decides no more than this share of the pairs more is not worth its time.
const WORTH_IT: f64 = 0.01;

/// Orders that cost no more than so many times the best are well chosen.
const NEAR_BEST: f64 = 1.2;

/// The share of pairs that a budget must decide to be recommended.
const NEARLY_ALL: f64 = 0.95;

/// A tolerance that is tight enough for most.
const USUAL_TOLERANCE: f64 = 1e-3;

/// One sentence for each question that the study answers; the most important last.
pub fn sentences(measured: &[Measurement]) -> Vec<String> {
    let alone: Vec<&Measurement> = measured.iter().filter(|row| row.threads == 1).collect();
    [
        arithmetic(&alone),
        tolerance(&alone, Family::TimeOfContact),
        tolerance(&alone, Family::Distance),
        matrix(&alone),
        budget(&alone),
        level(&alone),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn of<'m>(rows: &'m [&'m Measurement], family: Family) -> impl Iterator<Item = &'m Measurement> {
    rows.iter().copied().filter(move |row| row.setting.family() == family)
}

/// The coarsest order behind which finer ones are not worth it, beside the exact answer.
fn level(rows: &[&Measurement]) -> Option<String> {
    let is = |row: &&Measurement, wanted: Level| matches!(row.setting, Setting::Level { level, .. } if level == wanted);
    let polygons = of(rows, Family::Level).find(|row| is(row, Level::Polygons))?;
    let exact = format!("polygons decide all in {}", duration(polygons.time.median));
    let voxels = || of(rows, Family::Level).filter(|row| is(row, Level::Voxels));
    let best = voxels().map(|row| row.worth.open_share()).min_by(f64::total_cmp)?;
    let knee = voxels().find(|row| row.worth.open_share() <= best + WORTH_IT)?;
    let decided = 1.0 - knee.worth.open_share();
    Some(match decided {
        0.0 => format!("{exact}; no order of voxels decides any, for all of them meet, or nearly"),
        _ => {
            let (order, share) = (knee.setting.label(), percent(decided));
            let cheap = format!("order {order} decides {share} of pairs in {}", duration(knee.time.median));
            let not_worth = if polygons.time.median <= knee.time.median { ", so nothing coarser pays" } else { "" };
            format!("{cheap}; {exact}{not_worth}")
        }
    })
}

fn budget(rows: &[&Measurement]) -> Option<String> {
    let enough = of(rows, Family::Budget).find(|row| row.worth.open_share() <= 1.0 - NEARLY_ALL)?;
    let (budget, decided) = (enough.setting.label(), percent(1.0 - enough.worth.open_share()));
    Some(format!("a budget of {budget} decides {decided} of pairs"))
}

/// Whether another order than the chosen ones would pay.
fn matrix(rows: &[&Measurement]) -> Option<String> {
    let is_chosen = |row: &&Measurement| matches!(row.setting, Setting::Matrix { chosen: true, .. });
    let chosen = of(rows, Family::Matrix).find(is_chosen)?.time.median;
    let best = of(rows, Family::Matrix)
        .filter(|row| !is_chosen(row))
        .min_by(|a, b| a.time.median.total_cmp(&b.time.median))?;
    let (order, least, chosen_time) = (best.setting.label(), best.time.median, duration(chosen));
    Some(match chosen <= NEAR_BEST * least {
        true => format!(
            "the orders M of the objects are well chosen: {chosen_time}; order {order} for all costs {}",
            duration(least)
        ),
        false => format!(
            "order M = {order} for all objects would cost {}, the orders they have cost {chosen_time}",
            duration(least)
        ),
    })
}

fn tolerance(rows: &[&Measurement], family: Family) -> Option<String> {
    let is_usual = |row: &&Measurement| row.setting.value() == Some(USUAL_TOLERANCE);
    let tightest = of(rows, family).next()?;
    let usual = of(rows, family).find(is_usual)?;
    let effect = usual.setting.curve().replace('_', " ");
    let (time, most) = (duration(usual.time.median), duration(tightest.time.median));
    Some(format!("{effect} to {} costs {time}, as exact as it gets {most}", power(USUAL_TOLERANCE)))
}

fn arithmetic(rows: &[&Measurement]) -> Option<String> {
    let find = |precision| of(rows, Family::Arithmetic).find(move |row| row.setting == Setting::Arithmetic(precision));
    let (single, plain, exact) = (find(Precision::F32)?, find(Precision::F64)?, find(Precision::Exact)?);
    let wrong = |row: &Measurement| row.worth.tests.map_or(0, |[_, wrong]| wrong);
    let [tests, _] = exact.worth.tests.filter(|[tests, _]| *tests > 0)?;
    let quotient = exact.time.median / plain.time.median;
    Some(format!(
        "exact polygon tests cost {quotient:.2} times what plain f64 costs, which gets {} of {tests} wrong; f32 gets {} wrong",
        wrong(plain),
        wrong(single)
    ))
}

#[cfg(test)]
mod tests {
    use super::super::measurement::Worth;
    use super::super::statistics::Spread;
    use super::*;

    fn row(level: Level, order: Option<u32>, microseconds: f64, open: u64) -> Measurement {
        let time = microseconds * 1e3;
        Measurement {
            setting: Setting::Level { level, order },
            threads: 1,
            repetitions: 1,
            time: Spread { median: time, low: time, high: time },
            worth: Worth { pairs: 1000, open, ..Worth::default() },
        }
    }

    #[test]
    fn the_coarsest_order_that_is_as_good_as_the_best_is_recommended() {
        let voxels = |order, time, open| row(Level::Voxels, Some(order), time, open);
        let polygons = row(Level::Polygons, None, 310.0, 0);
        let measured = [voxels(3, 10.0, 500), voxels(15, 40.0, 4), voxels(18, 90.0, 2), polygons.clone()];
        let expected = "order 15 decides 99.6 % of pairs in 40 µs; polygons decide all in 310 µs";
        assert_eq!(sentences(&measured), [expected]);
        let measured = [voxels(3, 400.0, 500), polygons.clone()];
        let expected =
            "order 3 decides 50 % of pairs in 400 µs; polygons decide all in 310 µs, so nothing coarser pays";
        assert_eq!(sentences(&measured), [expected]);
        let nothing = sentences(&[voxels(3, 1.0, 1000), polygons]);
        assert!(nothing[0].starts_with("polygons decide all in 310 µs; no order"), "{nothing:?}");
    }
}
