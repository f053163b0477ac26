//! Numbers as a person reads them.

/// The unit that gives a time \[s\] one to three digits before the point, and how many of it make a
/// second.
pub(crate) fn unit(seconds: f64) -> (f64, &'static str) {
    match seconds {
        s if s < 999.5e-9 => (1e9, "ns"),
        s if s < 999.5e-6 => (1e6, "µs"),
        s if s < 999.5e-3 => (1e3, "ms"),
        _ => (1.0, "s"),
    }
}

/// Three significant digits of a positive number, all of those before the point.
fn three_digits(value: f64) -> String {
    match value {
        v if v >= 99.95 => format!("{v:.0}"),
        v if v >= 9.995 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

/// A time \[s\] with its unit: `12.3 ms`.
pub(crate) fn seconds(value: f64) -> String {
    let (per_second, name) = unit(value);
    format!("{} {name}", three_digits(value * per_second))
}

/// The range between two times around `median` \[s\], in the unit of that: `12.1..12.9 ms`.
pub(crate) fn spread((from, to): (f64, f64), median: f64) -> String {
    let (per_second, name) = unit(median);
    format!(
        "{}..{} {name}",
        three_digits(from * per_second),
        three_digits(to * per_second)
    )
}

/// A count, in groups of three digits from five digits on: `65 536`.
pub(crate) fn count(value: u64) -> String {
    let digits = value.to_string();
    if digits.len() < 5 {
        return digits;
    }
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// An error figure to two digits: `1.2e-14`, and `0` for none at all.
pub(crate) fn error_figure(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else {
        format!("{value:.1e}")
    }
}

/// A rate: `21.4 M`.
pub(crate) fn rate(per_second: f64) -> String {
    let (unit, name) = match per_second {
        r if r < 999.5e3 => (1e3, "k"),
        r if r < 999.5e6 => (1e6, "M"),
        r if r < 999.5e9 => (1e9, "G"),
        _ => (1e12, "T"),
    };
    format!("{} {name}", three_digits(per_second / unit))
}

/// A ratio: `12.3x`.
pub(crate) fn times(ratio: f64) -> String {
    format!("{}x", three_digits(ratio))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well_at_every_magnitude() {
        let shown: Vec<String> = [2.5e-9, 999.4e-9, 999.9e-9, 36e-6, 57.94e-3, 0.9999, 10.378]
            .map(seconds)
            .into();
        assert_eq!(
            shown,
            [
                "2.50 ns", "999 ns", "1.00 µs", "36.0 µs", "57.9 ms", "1.00 s", "10.4 s"
            ]
        );
        assert_eq!(spread((0.98e-3, 1.21e-3), 1.0e-3), "0.98..1.21 ms");
        assert_eq!(
            [0, 999, 8192, 65_536, 197_170_960].map(count),
            ["0", "999", "8192", "65 536", "197 170 960"]
        );
        assert_eq!(
            [0.0, 1.24e-14, 3.0].map(error_figure),
            ["0", "1.2e-14", "3.0e0"]
        );
        assert_eq!(
            [1234.0, 999.9e3, 21.4e6, 61.4e9, 2e13].map(rate),
            ["1.23 k", "1.00 M", "21.4 M", "61.4 G", "20.0 T"]
        );
        assert_eq!([0.5, 9.996, 1234.5].map(times), ["0.50x", "10.0x", "1234x"]);
    }
}
