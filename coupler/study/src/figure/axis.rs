//! Axes, linear and logarithmic, and the round numbers along them.

/// How numbers lie along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithms; numbers that have none are left out.
    Log,
}

/// An axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    scale: Scale,
    range: [f64; 2],
}

impl Axis {
    /// Just this range; a logarithmic one is above 0.
    pub fn over(range: [f64; 2], scale: Scale) -> Self {
        Self { scale, range }
    }

    /// A range around numbers with some room on either side, but for the ends that are given.
    pub fn around(
        numbers: impl IntoIterator<Item = f64>,
        scale: Scale,
        ends: [Option<f64>; 2],
    ) -> Self {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = numbers
            .into_iter()
            .filter(|n| scale.has(*n))
            .fold(none, |(low, high), n| (low.min(n), high.max(n)));
        let around = match scale {
            _ if low > high => [0.1, 1.0],
            Scale::Linear if low == high => {
                let margin = if low == 0.0 { 1.0 } else { low.abs() };
                [low - margin, low + margin]
            }
            Scale::Linear => {
                let margin = 0.03 * (high - low);
                [low - margin, high + margin]
            }
            Scale::Log => {
                // By logarithms: the quotient of the ends may be beyond all numbers.
                let margin = (0.06 * (high.ln() - low.ln())).exp().max(1.25);
                [
                    (low / margin).max(f64::MIN_POSITIVE),
                    (high * margin).min(f64::MAX),
                ]
            }
        };
        let range = [0, 1].map(|k| ends[k].unwrap_or(around[k]));
        // An end beyond all numbers leaves nothing between.
        let range = match range {
            [low, high] if low < high => range,
            [low, _] if scale == Scale::Log => [low, 10.0 * low],
            [low, _] => [low, low + low.abs().max(1.0)],
        };
        Self { scale, range }
    }

    /// Share of the axis's length at which a number is.
    pub fn share(&self, number: f64) -> f64 {
        let [low, high] = self.range;
        match self.scale {
            Scale::Linear => (number - low) / (high - low),
            Scale::Log => (number.ln() - low.ln()) / (high.ln() - low.ln()),
        }
    }

    /// Whether a number has a place on such an axis, within its ends or beyond.
    pub fn has(&self, number: f64) -> bool {
        self.scale.has(number)
    }

    /// Round numbers on the axis: no more than `most`, which is at least 4, and two or more.
    pub fn ticks(&self, most: usize) -> Vec<f64> {
        let most = most.max(4);
        let even = even(self.range, most);
        if self.scale == Scale::Linear {
            return even;
        }
        let decades = decades(self.range, most);
        // Over less than a decade there may be no power of ten, nor a multiple of one.
        let [low, high] = self.range;
        if high < 10.0 * low && decades.len() < 3 {
            even
        } else {
            decades
        }
    }
}

impl Scale {
    /// Logarithmic for positive numbers of which the largest is at least `many` times the least.
    pub fn of(numbers: impl Iterator<Item = f64>, many: f64) -> Self {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = (numbers.filter(|n| n.is_finite()))
            .fold(none, |(low, high), n| (low.min(n), high.max(n)));
        if low > 0.0 && high >= many * low {
            Self::Log
        } else {
            Self::Linear
        }
    }

    fn has(self, number: f64) -> bool {
        number.is_finite() && (self == Self::Linear || number > 0.0)
    }
}

/// Multiples of 1, 2, 5 (or, where these leave fewer than two, 2.5) times a power of ten.
fn even([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let start = ((high - low) / most as f64).log10().floor() as i32;
    let of = |step: f64| -> Vec<f64> {
        // Rounding must not take away an end.
        let slack = 1e-9;
        let first = (low / step - slack).ceil() as i64;
        let last = (high / step + slack).floor() as i64;
        (first..=last).map(|k| k as f64 * step).collect()
    };
    let fits = |multiples: &[f64]| {
        (start..start + 3)
            .flat_map(|power| multiples.iter().map(move |m| m * 10f64.powi(power)))
            .map(of)
            .find(|ticks| ticks.len() <= most)
            .unwrap_or_default()
    };
    let round = fits(&[1.0, 2.0, 5.0]);
    if round.len() >= 2 {
        round
    } else {
        fits(&[1.0, 2.0, 2.5, 5.0])
    }
}

/// Powers of ten, or of some multiples too, as many as fit.
fn decades([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let within = |x: &f64| *x >= low * (1.0 - 1e-9) && *x <= high * (1.0 + 1e-9);
    let of = |multiples: &[f64], every: i32| -> Vec<f64> {
        (first..=last)
            .filter(|exponent| exponent.rem_euclid(every) == 0)
            .flat_map(|exponent| multiples.iter().map(move |m| m * 10f64.powi(exponent)))
            .filter(within)
            .collect()
    };
    let fine: Vec<f64> = (2..20).map(|m| f64::from(m) * 0.5).collect();
    let whole: Vec<f64> = (1..10).map(f64::from).collect();
    let few: [&[f64]; 4] = [&fine, &whole, &[1.0, 2.0, 5.0], &[1.0, 3.0]];
    let many = (0..10).map(|k| of(&[1.0], 1 << k));
    few.into_iter()
        .map(|multiples| of(multiples, 1))
        .chain(many)
        .find(|ticks| ticks.len() <= most)
        .unwrap_or_default()
}

/// A number at a tick: its digits without the rounding that multiples carry.
pub fn label(number: f64) -> String {
    if number == 0.0 {
        return "0".to_owned();
    }
    let text = format!("{number:.11e}");
    let (mantissa, exponent) = text
        .split_once('e')
        .expect("a number in this form has an exponent");
    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
    let power: i32 = exponent.parse().expect("an exponent is a whole number");
    if !(-3..5).contains(&power) {
        return format!("{mantissa}e{exponent}");
    }
    let digits = mantissa.chars().filter(char::is_ascii_digit);
    let after = digits.fold(-1 - power, |digits, _| digits + 1).max(0) as usize;
    format!("{number:.after$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: [f64; 2], scale: Scale, most: usize) -> Vec<String> {
        let ticks = Axis::over(range, scale).ticks(most);
        ticks.into_iter().map(label).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        use Scale::Linear;
        assert_eq!(
            labels([-0.1, 1.1], Linear, 8),
            ["0", "0.2", "0.4", "0.6", "0.8", "1"]
        );
        assert_eq!(
            labels([0.0, 25.0], Linear, 8),
            ["0", "5", "10", "15", "20", "25"]
        );
        assert_eq!(
            labels([1.0001, 1.00029], Linear, 4),
            ["1.0001", "1.00015", "1.0002", "1.00025"]
        );
        assert_eq!(
            labels([2e6, 5e6], Linear, 8),
            ["2e6", "2.5e6", "3e6", "3.5e6", "4e6", "4.5e6", "5e6"]
        );
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten_or_even_over_less_than_a_decade() {
        use Scale::Log;
        assert_eq!(
            labels([1e-3, 1e2], Log, 8),
            ["0.001", "0.01", "0.1", "1", "10", "100"]
        );
        assert_eq!(labels([0.15, 6.0], Log, 8), ["0.2", "0.5", "1", "2", "5"]);
        assert_eq!(
            labels([2e-6, 4e-6], Log, 8),
            ["2e-6", "2.5e-6", "3e-6", "3.5e-6", "4e-6"]
        );
        assert_eq!(
            labels([1.02, 1.09], Log, 8),
            [
                "1.02", "1.03", "1.04", "1.05", "1.06", "1.07", "1.08", "1.09"
            ]
        );
        assert_eq!(
            labels([0.06, 0.09], Log, 5),
            ["0.06", "0.07", "0.08", "0.09"]
        );
    }

    #[test]
    fn every_axis_has_two_ticks_within_it_and_no_more_than_fit() {
        // Ranges of 1e-3 of a decade to 600 decades, from all over the numbers.
        let mut random = 1u64;
        let mut next = || {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (random >> 11) as f64 / (1u64 << 53) as f64
        };
        for k in 0..20_000 {
            let low = 10f64.powf(600.0 * next() - 300.0);
            let high = low * (1.0 + 10f64.powf(6.0 * next() - 3.0));
            let log = Axis::over([low, high], Scale::Log);
            let (low, high) = if k % 2 == 0 {
                (low, high)
            } else {
                (-high, low)
            };
            let linear = Axis::over([low, high], Scale::Linear);
            for axis in [log, linear] {
                for most in [4, 5, 8, 12] {
                    let ticks = axis.ticks(most);
                    assert!(
                        (2..=most).contains(&ticks.len()),
                        "{axis:?}, {most}: {ticks:?}"
                    );
                    let within = |t: &f64| (-1e-6..1.0 + 1e-6).contains(&axis.share(*t));
                    assert!(ticks.iter().all(within), "{axis:?}: {ticks:?}");
                    let mut said: Vec<String> = ticks.iter().copied().map(label).collect();
                    said.dedup();
                    assert_eq!(said.len(), ticks.len(), "{axis:?}: {said:?}");
                }
            }
        }
        let wide = Axis::over([1e-300, 1e300], Scale::Log).ticks(8);
        assert!((3..=8).contains(&wide.len()), "{wide:?}");
    }

    #[test]
    fn a_range_has_room_on_both_sides_and_the_ends_that_it_is_given() {
        let none = [None, None];
        let log = Axis::around([1.0, f64::NAN, 100.0, 0.0, -1.0], Scale::Log, none);
        assert!(log.range[0] < 0.81 && log.range[1] > 124.0);
        for scale in [Scale::Linear, Scale::Log] {
            assert_eq!(Axis::around([], scale, none).range, [0.1, 1.0]);
            let single = Axis::around([5.0], scale, none).range;
            assert!(single[0] < 5.0 && single[1] > 5.0);
            let given = Axis::around([5.0, 7.0], scale, [Some(6.0), None]).range;
            assert!(given[0] == 6.0 && given[1] > 7.0);
            let beyond = Axis::around([5.0], scale, [Some(50.0), None]).range;
            assert!(beyond[1] > beyond[0]);
        }
        assert!(Axis::around([0.0], Scale::Linear, none).share(0.0) > 0.0);
    }

    #[test]
    fn a_label_has_the_digits_that_it_needs() {
        for (number, said) in [
            (0.600_000_000_000_000_1, "0.6"),
            (-25.0, "-25"),
            (12_500.0, "12500"),
            (1e5, "1e5"),
            (2.5e-4, "2.5e-4"),
            (0.001, "0.001"),
            (1.180_000_000_001, "1.18"),
            (0.0, "0"),
        ] {
            assert_eq!(label(number), said);
        }
    }

    #[test]
    fn numbers_of_many_sizes_lie_along_a_logarithmic_axis() {
        let of = |numbers: &[f64]| Scale::of(numbers.iter().copied(), 8.0);
        assert_eq!(of(&[1.0, 2.0, 4.0]), Scale::Linear);
        assert_eq!(of(&[1.0, f64::NAN, 8.0]), Scale::Log);
        assert_eq!(of(&[0.0, 2.0, 80.0]), Scale::Linear);
        assert_eq!(of(&[]), Scale::Linear);
    }
}
