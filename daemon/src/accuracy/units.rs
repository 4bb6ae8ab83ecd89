//! Numbers in the words of tables and plots.

/// A duration given in nanoseconds, to three digits, with a unit that fits.
pub fn duration(nanoseconds: f64) -> String {
    let (value, unit) = match nanoseconds {
        ..999.5 => (nanoseconds, "ns"),
        ..999.5e3 => (nanoseconds / 1e3, "µs"),
        ..999.5e6 => (nanoseconds / 1e6, "ms"),
        _ => (nanoseconds / 1e9, "s"),
    };
    format!("{} {unit}", digits(value))
}

/// A share as a percentage, to three digits; what is not quite all or nothing does not read so.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        100.0 => "100 %".to_owned(),
        99.95.. => "over 99.9 %".to_owned(),
        10.0.. => format!("{} %", trimmed(format!("{percent:.1}"))),
        _ => format!("{} %", digits(percent)),
    }
}

/// A positive number as a power of ten, with a factor where it is not one.
pub fn power(value: f64) -> String {
    // The logarithm of a power of ten may come out just below the integer.
    let exponent = (value.log10() + 1e-9).floor();
    let factor = value / 10f64.powf(exponent);
    let power = format!("10{}", superscript(exponent as i32));
    if (factor - 1.0).abs() < 1e-6 { power } else { format!("{factor:.1}·{power}") }
}

/// Three digits, without zeros behind the point.
fn digits(value: f64) -> String {
    let places = match value {
        0.0 => 0,
        ..0.001 => return format!("{value:.2e}"),
        ..1.0 => 3,
        ..10.0 => 2,
        ..100.0 => 1,
        _ => 0,
    };
    trimmed(format!("{value:.places$}"))
}

fn trimmed(text: String) -> String {
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

fn superscript(exponent: i32) -> String {
    let raised = |character: char| match character {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize - '0' as usize],
    };
    exponent.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_three_digits_and_a_unit_that_fits() {
        let durations = [0.5, 12.0, 999.9, 40_000.0, 310_400.0, 1_234_567.0, 2e9].map(duration);
        assert_eq!(durations, ["0.5 ns", "12 ns", "1 µs", "40 µs", "310 µs", "1.23 ms", "2 s"]);
    }

    #[test]
    fn percentages_are_neither_all_nor_nothing_unless_they_are() {
        let shares = [1.0, 0.99999, 0.996, 0.25, 0.0123, 0.000_001_2].map(percent);
        assert_eq!(shares, ["100 %", "over 99.9 %", "99.6 %", "25 %", "1.23 %", "1.20e-4 %"]);
        assert_eq!(percent(0.0), "0 %");
    }

    #[test]
    fn powers_of_ten() {
        assert_eq!([1e-10, 1.0, 100.0, 2.5e-3].map(power), ["10⁻¹⁰", "10⁰", "10²", "2.5·10⁻³"]);
    }
}
