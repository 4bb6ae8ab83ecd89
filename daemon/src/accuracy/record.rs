//! Measurements as programs read them: CSV, and one JSON object a line.

use serde_json::Value;

use super::measurement::Measurement;

/// Name and value of each column of a measurement; `Null` where it has none.
fn columns(measurement: &Measurement) -> [(&'static str, Value); 19] {
    let Measurement { setting, threads, repetitions, time, worth } = measurement;
    let microseconds = |nanoseconds: f64| Value::from(nanoseconds / 1e3);
    [
        ("family", setting.family().name().into()),
        ("curve", setting.curve().into()),
        ("label", setting.label().into()),
        ("value", setting.value().into()),
        ("threads", (*threads).into()),
        ("repetitions", (*repetitions).into()),
        ("time_us", microseconds(time.median)),
        ("time_us_low", microseconds(time.low)),
        ("time_us_high", microseconds(time.high)),
        ("pairs", worth.pairs.into()),
        ("open", worth.open.into()),
        ("wrong", worth.wrong.into()),
        ("error_median", worth.error.map(|error| error.median).into()),
        ("error_largest", worth.error.map(|error| error.largest).into()),
        ("memory_bytes", worth.memory.into()),
        ("overrun_us", worth.overrun.map_or(Value::Null, microseconds)),
        ("apart_at_most", worth.apart.into()),
        ("tests", worth.tests.map(|[tests, _]| tests).into()),
        ("wrong_tests", worth.tests.map(|[_, wrong]| wrong).into()),
    ]
}

/// All measurements as the text of a CSV file with a line of headings. No value has a comma or a quote in it.
pub fn csv(measured: &[Measurement]) -> String {
    let line = |cells: Vec<String>| cells.join(",") + "\n";
    let headings = measured.first().map(|first| line(columns(first).map(|(name, _)| name.to_owned()).to_vec()));
    let rows = measured.iter().map(|measurement| line(columns(measurement).map(|(_, value)| cell(&value)).to_vec()));
    headings.into_iter().chain(rows).collect()
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A measurement as one JSON object; what it has not is left out.
pub fn json(measurement: &Measurement) -> String {
    let columns = columns(measurement).into_iter().filter(|(_, value)| !value.is_null());
    let members: Vec<String> = columns.map(|(name, value)| format!("\"{name}\":{value}")).collect();
    format!("{{{}}}", members.join(","))
}

#[cfg(test)]
mod tests {
    use super::super::measurement::{Setting, Worth};
    use super::super::statistics::Spread;
    use super::*;

    fn measurement() -> Measurement {
        let worth = Worth { pairs: 4, open: 1, overrun: Some(250.0), ..Worth::default() };
        let time = Spread { median: 2_000.0, low: 1_500.0, high: 3_000.0 };
        Measurement { setting: Setting::Budget { nanoseconds: 5_000 }, threads: 2, repetitions: 3, time, worth }
    }

    #[test]
    fn every_line_of_csv_has_as_many_cells_as_there_are_headings() {
        let text = csv(&[measurement(), measurement()]);
        let widths: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(widths, [19; 3]);
        assert!(text.contains("\nbudget,budget,5 µs,5.0,2,3,2.0,1.5,3.0,4,1,0,,,,0.25,,,\n"), "{text}");
        assert_eq!(csv(&[]), "");
    }

    #[test]
    fn json_leaves_out_what_there_is_not() {
        let line: Value = serde_json::from_str(&json(&measurement())).expect("it is JSON");
        assert_eq!((line["label"].as_str(), line["open"].as_u64()), (Some("5 µs"), Some(1)));
        assert!(line.get("error_median").is_none());
    }
}
