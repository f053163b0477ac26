//! Logarithmic axes: their range, where a value lies, and their labelled ticks.

use crate::table::format::count;

/// A logarithmic axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct LogAxis {
    /// Ends of the range, positive, `low < high`.
    pub(super) low: f64,
    pub(super) high: f64,
    /// Where the ends lie \[px\].
    from: f64,
    to: f64,
}

impl LogAxis {
    /// The axis over positive `values` between two places \[px\], widened to a number 1, 2 or 5
    /// times a power of ten at each end.
    pub(super) fn decimal(values: impl IntoIterator<Item = f64>, (from, to): (f64, f64)) -> Self {
        let (min, max) = range(values);
        let (mut low, mut high) = (nice_below(min), nice_above(max));
        if high <= low * 2.5 {
            (low, high) = (nice_below(0.99 * low), nice_above(1.01 * high));
        }
        Self {
            low,
            high,
            from,
            to,
        }
    }

    /// The axis with its ends at least this ratio apart, moved by powers of ten in turn.
    pub(super) fn widened(mut self, least_ratio: f64) -> Self {
        let mut is_low_next = true;
        while self.high / self.low < least_ratio * (1.0 - 1e-9) {
            if is_low_next {
                self.low *= 0.1;
            } else {
                self.high *= 10.0;
            }
            is_low_next = !is_low_next;
        }
        self
    }

    /// The axis over positive `values` between two places \[px\], from the least to the greatest
    /// with a margin.
    pub(super) fn binary(values: impl IntoIterator<Item = f64>, (from, to): (f64, f64)) -> Self {
        let (min, max) = range(values);
        Self {
            low: min / 1.2,
            high: max * 1.2,
            from,
            to,
        }
    }

    /// Where a positive value lies \[px\].
    pub(super) fn place(&self, value: f64) -> f64 {
        let part = (value / self.low).ln() / (self.high / self.low).ln();
        self.from + part * (self.to - self.from)
    }

    /// At most about `most` values to label: every power of ten or every few, and 1, 2, 5 times
    /// them on short axes.
    pub(super) fn decimal_ticks(&self, most: usize) -> Vec<f64> {
        let (first, last) = (exponent(self.low), exponent(self.high));
        let fine = self.high / self.low <= 1000.0;
        let mantissas: &[f64] = if fine { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let inside =
            |value: &f64| self.low * (1.0 - 1e-9) <= *value && *value <= self.high * (1.0 + 1e-9);
        let decades = usize::try_from(last - first + 1).unwrap_or(1);
        let step = if fine {
            1
        } else {
            decades.div_ceil(most.max(1))
        };
        let exponents = (first..=last)
            .filter(|exponent| exponent.rem_euclid(i32::try_from(step).unwrap_or(1)) == 0);
        exponents
            .flat_map(|e| mantissas.iter().map(move |m| power_of_ten(*m, e)))
            .filter(inside)
            .collect()
    }

    /// The multiples 2 to 9 of powers of ten, which are marked without a label; none where they
    /// would be crowded.
    pub(super) fn minor_ticks(&self) -> Vec<f64> {
        let (first, last) = (exponent(self.low), exponent(self.high));
        if last - first > 8 {
            return Vec::new();
        }
        let multiples = |e: i32| (2..=9).map(move |m| power_of_ten(f64::from(m), e));
        (first..=last)
            .flat_map(multiples)
            .filter(|value| (self.low..=self.high).contains(value))
            .collect()
    }

    /// At most about `most` powers of two to label, at even distances.
    pub(super) fn binary_ticks(&self, most: usize) -> Vec<f64> {
        let powers: Vec<f64> = (0..64)
            .map(|power| 2_f64.powi(power))
            .filter(|value| (self.low..=self.high).contains(value))
            .collect();
        let step = powers.len().div_ceil(most.max(1)).max(1);
        powers.into_iter().step_by(step).collect()
    }
}

/// The least and the greatest value; 1 and 1 when there are none.
fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (min, max) = values
        .into_iter()
        .fold((f64::INFINITY, 0.0_f64), |(min, max), value| {
            (min.min(value), max.max(value))
        });
    if min <= max { (min, max) } else { (1.0, 1.0) }
}

/// The power of ten at or below a positive value.
fn exponent(value: f64) -> i32 {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "logarithms of f64 values are within +-324"
    )]
    let exponent = (value.log10() + 1e-9).floor() as i32;
    exponent
}

/// `mantissa` times a power of ten, rounded as its decimal literal is.
fn power_of_ten(mantissa: f64, exponent: i32) -> f64 {
    if exponent < 0 {
        mantissa / 10_f64.powi(-exponent)
    } else {
        mantissa * 10_f64.powi(exponent)
    }
}

/// The greatest of 1, 2, 5 times a power of ten that is not above a positive value.
fn nice_below(value: f64) -> f64 {
    let e = exponent(value);
    let nice = [5.0, 2.0, 1.0].map(|m| power_of_ten(m, e));
    nice.into_iter()
        .find(|nice| *nice <= value * (1.0 + 1e-9))
        .unwrap_or(nice[2])
}

/// The least of 1, 2, 5 times a power of ten that is not below a positive value.
fn nice_above(value: f64) -> f64 {
    let e = exponent(value);
    let nice = [1.0, 2.0, 5.0].map(|m| power_of_ten(m, e));
    nice.into_iter()
        .find(|nice| *nice >= value * (1.0 - 1e-9))
        .unwrap_or(power_of_ten(1.0, e + 1))
}

/// Label of a tick of time \[s\]: `20 µs`.
pub(super) fn seconds_label(value: f64) -> String {
    let (per_second, name) = crate::table::format::unit(value);
    format!("{} {name}", round_label(value * per_second))
}

/// Label of a tick of speed: `50 M`.
pub(super) fn metric_label(value: f64) -> String {
    let (unit, prefix) = match value {
        v if v >= 0.999e12 => (1e12, " T"),
        v if v >= 0.999e9 => (1e9, " G"),
        v if v >= 0.999e6 => (1e6, " M"),
        v if v >= 0.999e3 => (1e3, " k"),
        _ => (1.0, ""),
    };
    format!("{}{prefix}", round_label(value / unit))
}

/// Label of a tick of an error: `10⁻⁶`, `2·10⁻⁶`.
pub(super) fn power_label(value: f64) -> String {
    let e = exponent(value);
    let digits: String = e
        .unsigned_abs()
        .to_string()
        .chars()
        .map(superscript)
        .collect();
    let power = format!("10{}{digits}", if e < 0 { "⁻" } else { "" });
    let mantissa = (value / power_of_ten(1.0, e)).round();
    if mantissa == 1.0 {
        power
    } else {
        format!("{mantissa}·{power}")
    }
}

/// Label of a tick of a count: `65 536`.
pub(super) fn count_label(value: f64) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "ticks of counts are positive and small"
    )]
    let whole = value.round() as u64;
    count(whole)
}

/// A number without the rounding error of its last digits.
fn round_label(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    rounded.to_string()
}

fn superscript(digit: char) -> char {
    match digit {
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_end_at_round_numbers_and_cover_the_data() {
        for (values, low, high) in [
            ([3.1e-5, 0.04], 2e-5, 0.05),
            ([1e-6, 1e-3], 1e-6, 1e-3),
            ([1.0e-3, 1.05e-3], 5e-4, 5e-3),
            ([7e-3, 7e-3], 2e-3, 2e-2),
        ] {
            let axis = LogAxis::decimal(values, (0.0, 1.0));
            assert!(
                (axis.low / low - 1.0).abs() < 1e-9 && (axis.high / high - 1.0).abs() < 1e-9,
                "{axis:?}"
            );
            assert!(
                values
                    .iter()
                    .all(|value| (-1e-9..=1.0 + 1e-9).contains(&axis.place(*value)))
            );
            assert!(
                (2..=9).contains(&axis.decimal_ticks(9).len()),
                "{:?}",
                axis.decimal_ticks(9)
            );
        }
    }

    #[test]
    fn a_widened_axis_has_its_data_in_the_middle() {
        let axis = LogAxis::decimal([1e-14, 1e-13], (0.0, 100.0));
        assert_eq!(axis.widened(10.0).low, axis.low);
        let wide = axis.widened(1e4);
        assert!((wide.high / wide.low / 1e4 - 1.0).abs() < 1e-9, "{wide:?}");
        assert!(
            wide.place(1e-14) > 30.0 && wide.place(1e-13) < 80.0,
            "{wide:?}"
        );
    }

    #[test]
    fn ticks_thin_out_and_place_is_logarithmic() {
        let axis = LogAxis::decimal([1e-16, 1.0], (0.0, 160.0));
        let ticks = axis.decimal_ticks(9);
        assert_eq!(
            ticks
                .iter()
                .map(|tick| power_label(*tick))
                .take(3)
                .collect::<Vec<_>>(),
            ["10⁻¹⁶", "10⁻¹⁴", "10⁻¹²"]
        );
        assert!((axis.place(1e-8) - 80.0).abs() < 1e-9);
        let axis = LogAxis::binary([128.0, 2048.0], (0.0, 100.0));
        assert_eq!(axis.binary_ticks(9), [128.0, 256.0, 512.0, 1024.0, 2048.0]);
        assert_eq!(axis.binary_ticks(3), [128.0, 512.0, 2048.0]);
    }

    #[test]
    fn labels_are_short() {
        assert_eq!(
            [1e-9, 2e-5, 1e-3, 50e-3, 1.0].map(seconds_label),
            ["1 ns", "20 µs", "1 ms", "50 ms", "1 s"]
        );
        assert_eq!(
            [0.5, 20.0, 1e3, 5e7, 1e12].map(metric_label),
            ["0.5", "20", "1 k", "50 M", "1 T"]
        );
        assert_eq!(
            [1.0, 2e-6, 5e2].map(power_label),
            ["10⁰", "2·10⁻⁶", "5·10²"]
        );
        assert_eq!(count_label(65_536.0), "65 536");
    }
}
