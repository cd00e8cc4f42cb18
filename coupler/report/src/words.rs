//! Numbers as people read them.

/// Significant digits of a number in a table.
pub const DIGITS: i32 = 4;

/// A number with four significant digits: `0.9966`, `12.3`, `4.2e-4`.
pub fn number(value: f64) -> String {
    in_digits(value, DIGITS)
}

/// A number with this many significant digits.
pub fn in_digits(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return if value.is_nan() {
            "not a number".to_owned()
        } else {
            "infinite".to_owned()
        };
    }
    let magnitude = value.abs().log10().floor() as i32;
    if value.fract() == 0.0 && value.abs() < 1e7 {
        return grouped(value as i64);
    }
    if (-3..6).contains(&magnitude) {
        let decimals = (digits - 1 - magnitude).max(0) as usize;
        return without_zeros(&format!("{value:.decimals$}"));
    }
    let text = format!("{value:.*e}", (digits - 1) as usize);
    match text.split_once('e') {
        Some((mantissa, exponent)) => format!("{}e{exponent}", without_zeros(mantissa)),
        None => text,
    }
}

/// A number of which only the size is of interest, with two significant digits: `8.8e-16`.
pub fn size_of(value: f64) -> String {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    number(rounded)
}

/// A number and its unit; none behind a pure number.
pub fn quantity(value: f64, unit: &str) -> String {
    with_unit(number(value), unit)
}

/// What stands for a number, and its unit.
pub fn with_unit(number: String, unit: &str) -> String {
    match unit {
        "" | "1" => number,
        _ => format!("{number}\u{a0}{}", unit_of(unit)),
    }
}

/// A simulated time in s, in the unit that makes it a plain number: `12 ms`, `11.11 µs`.
pub fn moment(seconds: f64) -> String {
    let units = [(1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")];
    // Half of the last digit of a number that rounds up to the next unit.
    let fits = |(one, _): &&(f64, &str)| seconds.abs() >= 0.999_95 * one;
    match units.iter().find(fits) {
        Some((one, unit)) => quantity(rounded(seconds / one), unit),
        None => quantity(seconds, "s"),
    }
}

/// Without what division adds far behind the point.
fn rounded(number: f64) -> f64 {
    (number * 1e9).round() / 1e9
}

/// A unit as it is printed: `m²`, not `m^2`.
pub fn unit_of(unit: &str) -> String {
    unit.replace("^2", "²").replace("^3", "³")
}

/// A count, with its digits in groups of three.
pub fn count(value: u64) -> String {
    grouped(i64::try_from(value).unwrap_or(i64::MAX))
}

/// A wall time in s: `340 ms`, `12.3 s`, `4 min 12 s`, `1 h 2 min`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    if !seconds.is_finite() || seconds < 0.0 {
        "unknown".to_owned()
    } else if seconds < 1.0 {
        format!("{:.0}\u{a0}ms", seconds * 1e3)
    } else if whole < 60 {
        format!("{seconds:.1}\u{a0}s")
    } else if whole < 3600 {
        format!("{}\u{a0}min {}\u{a0}s", whole / 60, whole % 60)
    } else {
        format!("{}\u{a0}h {}\u{a0}min", whole / 3600, whole % 3600 / 60)
    }
}

/// Digits in groups of three, from five digits on.
fn grouped(value: i64) -> String {
    let digits = value.unsigned_abs().to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && digits.len() > 4 && (digits.len() - k).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    if value < 0 { format!("-{text}") } else { text }
}

fn without_zeros(text: &str) -> String {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_people_read() {
        for (value, text) in [
            (0.0, "0"),
            (0.996_615_5, "0.9966"),
            (12.3, "12.3"),
            (-0.001_234_56, "-0.001235"),
            (4.2e-4, "4.2e-4"),
            (1.0 / 3.0 * 1e9, "3.333e8"),
            (1080.0, "1080"),
            (123_456.0, "123\u{202f}456"),
            (f64::NAN, "not a number"),
        ] {
            assert_eq!(number(value), text);
        }
        assert_eq!(size_of(8.839e-16), "8.8e-16");
        assert_eq!(quantity(2.5, "m^2"), "2.5\u{a0}m²");
        assert_eq!(quantity(2.5, "1"), "2.5");
    }

    #[test]
    fn moments_have_the_unit_of_their_size() {
        let moments = [0.012, 1.0 / 90_000.0, 3.0, 1e-3, 0.0].map(moment);
        let words = [
            "12\u{a0}ms",
            "11.11\u{a0}µs",
            "3\u{a0}s",
            "1\u{a0}ms",
            "0\u{a0}s",
        ];
        assert_eq!(moments, words);
    }

    #[test]
    fn times_have_the_unit_that_people_use() {
        let times = [0.34, 12.34, 252.0, 3720.0].map(duration);
        let words = [
            "340\u{a0}ms",
            "12.3\u{a0}s",
            "4\u{a0}min 12\u{a0}s",
            "1\u{a0}h 2\u{a0}min",
        ];
        assert_eq!(times, words);
    }
}
