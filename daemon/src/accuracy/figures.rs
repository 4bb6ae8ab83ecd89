//! The work–precision diagrams of a study.

use super::measurement::{Family, Measurement, Worth};
use super::plot::{Axis, Curve, Plot, Point, Unit};

/// The diagram of a family; `None` when there is nothing to see.
pub fn plot(family: Family, measured: &[Measurement]) -> Option<Plot> {
    let rows: Vec<&Measurement> = measured.iter().filter(|row| row.setting.family() == family).collect();
    let time = || Axis { title: "time of a step, median".to_owned(), unit: Unit::Time };
    let axis = |title: &str, unit| Axis { title: title.to_owned(), unit };
    let open = || axis("pairs left open", Unit::Share);
    let open_share = |worth: &Worth| Some(worth.open_share());
    let largest = |worth: &Worth| worth.error.map(|error| error.largest);
    let median = |worth: &Worth| worth.error.map(|error| error.median);
    let wrong = |worth: &Worth| worth.tests.map(|[tests, wrong]| wrong as f64 / tests.max(1) as f64);
    let (title, x, y, curves) = match family {
        Family::Level => ("Levels, and voxels of each order", time(), open(), by_threads(&rows, open_share)),
        Family::Budget => ("Budgets", time(), open(), by_threads(&rows, open_share)),
        Family::Matrix => {
            let curves = by_threads(&rows, |_| Some(0.0)).into_iter().map(turned).collect();
            ("Orders M of the voxel matrices", axis("order M", Unit::Count), time(), curves)
        }
        Family::Distance => {
            ("Tolerances of distance", time(), axis("relative error", Unit::Power), by_error(&rows, largest, median))
        }
        Family::TimeOfContact => {
            let error = axis("error, share of the step", Unit::Power);
            ("Tolerances of time of contact", time(), error, by_error(&rows, largest, median))
        }
        Family::Arithmetic => {
            let curves = by_threads(&rows, wrong);
            let time = axis("time of a test, median", Unit::Time);
            ("Arithmetics of the polygon tests", time, axis("tests that come out wrong", Unit::Share), curves)
        }
        Family::Effect => return None,
    };
    let plot = Plot { title: title.to_owned(), x, y, curves };
    (!plot.is_empty()).then_some(plot)
}

/// A curve for each name and thread count; those of more than one thread accompany those of one.
fn by_threads(rows: &[&Measurement], y: impl Fn(&Worth) -> Option<f64> + Copy) -> Vec<Curve> {
    let mut names: Vec<&str> = rows.iter().map(|row| row.setting.curve()).collect();
    names.dedup();
    let mut seen: Vec<&str> = Vec::new();
    names.retain(|name| {
        !seen.contains(name) && {
            seen.push(name);
            true
        }
    });
    let mut threads: Vec<usize> = rows.iter().map(|row| row.threads).collect();
    threads.sort_unstable();
    threads.dedup();
    let curve = |(style, name): (usize, &str), threads: usize| {
        let of_curve = rows.iter().filter(|row| row.setting.curve() == name && row.threads == threads);
        let legend = if threads == 1 { name.to_owned() } else { format!("{name}, {threads} threads") };
        Curve { name: legend, companion: threads > 1, style, points: points(of_curve, y) }
    };
    let curves = threads.iter().flat_map(|&threads| names.iter().copied().enumerate().map(move |name| (name, threads)));
    curves.map(|(name, threads)| curve(name, threads)).filter(|curve| !curve.points.is_empty()).collect()
}

/// The largest errors, and the median ones beside them, in one thread.
fn by_error(
    rows: &[&Measurement],
    largest: impl Fn(&Worth) -> Option<f64>,
    median: impl Fn(&Worth) -> Option<f64>,
) -> Vec<Curve> {
    let alone = || rows.iter().filter(|row| row.threads == 1);
    let curve = |name: &str, companion, points| Curve { name: name.to_owned(), companion, style: 0, points };
    vec![curve("largest error", false, points(alone(), largest)), curve("median error", true, points(alone(), median))]
}

fn points<'m>(rows: impl Iterator<Item = &'m &'m Measurement>, y: impl Fn(&Worth) -> Option<f64>) -> Vec<Point> {
    let point = |row: &&Measurement| {
        let label = row.setting.label();
        let spread = [row.time.low, row.time.high];
        Some(Point { x: row.time.median, spread, y: y(&row.worth).filter(|y| y.is_finite())?, label })
    };
    rows.filter_map(point).collect()
}

/// The same times over the orders, which are the labels.
fn turned(curve: Curve) -> Curve {
    let point = |point: Point| {
        let order = point.label.parse().expect("orders are labelled with themselves");
        Point { x: order, spread: [order; 2], y: point.x, label: String::new() }
    };
    Curve { points: curve.points.into_iter().map(point).collect(), ..curve }
}
