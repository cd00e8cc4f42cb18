//! Axes, linear and logarithmic, and the round numbers along them.

use super::shape::{GAP, NUMBERS, width};

/// How numbers lie along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithms; numbers that have none are left out.
    Log,
}

/// An axis: its scale, and the places of its ends on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axis(Scale, [f64; 2]);

/// The least and the largest of those that are finite, in the wrong order if there are none.
pub(crate) fn extent(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let finite = numbers.filter(|n| n.is_finite());
    finite.fold(none, |[low, high], n| [low.min(n), high.max(n)])
}

impl Scale {
    /// Logarithmic for positive numbers of which the largest is at least `many` times the least.
    pub(super) fn of(numbers: impl Iterator<Item = f64>, many: f64) -> Self {
        match extent(numbers) {
            [low, high] if low > 0.0 && high >= many * low => Self::Log,
            _ => Self::Linear,
        }
    }

    fn place(self, n: f64) -> f64 {
        if self == Self::Log { n.log10() } else { n }
    }
}

impl Axis {
    /// Just this range; a logarithmic one is above 0.
    pub fn over(range: [f64; 2], scale: Scale) -> Self {
        Self(scale, range.map(|end| scale.place(end)))
    }

    /// A range around numbers with some room on either side, but for the ends that are given.
    pub fn around(
        numbers: impl Iterator<Item = f64>,
        scale: Scale,
        given: [Option<f64>; 2],
    ) -> Self {
        let [low, high] = match extent(numbers.map(|n| scale.place(n))) {
            [low, high] if low < high => [1.04 * low - 0.04 * high, 1.04 * high - 0.04 * low],
            [low, _] if low.is_infinite() => [0.0, 1.0],
            [low, _] if scale == Scale::Log || low == 0.0 => [low - 1.0, low + 1.0],
            [low, _] => [low - low.abs(), low + low.abs()],
        };
        let [low, high] =
            [(0, low), (1, high)].map(|(k, end)| given[k].map_or(end, |given| scale.place(given)));
        // A given end beyond all numbers leaves nothing between.
        let beyond = low + low.abs().max(1.0);
        Self(scale, [low, if low < high { high } else { beyond }])
    }

    /// Share of the axis's length at which a number is; not finite where it has no place.
    pub fn share(&self, number: f64) -> f64 {
        let Self(scale, [low, high]) = self;
        (scale.place(number) - low) / (high - low)
    }

    /// As many round numbers as have room along this length, beside one another or one above the other, and at which share.
    pub fn numbers(&self, length: f64, beside: bool) -> Vec<(f64, String)> {
        let numbers = |most| -> Vec<(f64, String)> {
            let ticks = self.ticks(most).into_iter();
            ticks.map(|tick| (self.share(tick), label(tick))).collect()
        };
        let long = |text: &str| {
            if beside {
                width(text, NUMBERS)
            } else {
                NUMBERS
            }
        };
        let fits = |numbers: &Vec<(f64, String)>| {
            let longest = numbers
                .iter()
                .map(|(_, text)| long(text))
                .fold(0.0, f64::max);
            let mut pairs = numbers.windows(2);
            pairs.all(|pair| (pair[1].0 - pair[0].0) * length >= longest + 2.0 * GAP)
        };
        let mut choices = (2..10).rev().map(numbers);
        choices.find(fits).unwrap_or_default()
    }

    /// Round numbers on the axis, no more than `most`: over a decade or more powers of ten and multiples of them.
    fn ticks(&self, most: usize) -> Vec<f64> {
        let Self(scale, [low, high]) = *self;
        let powers = low.floor() as i32..=high.ceil() as i32;
        let of = |multiples: &[f64], every: i32| -> Vec<f64> {
            let powers = powers.clone().filter(|power| power.rem_euclid(every) == 0);
            let powers = powers.map(|power| 10f64.powi(power));
            let all = powers.flat_map(|power| multiples.iter().map(move |m| m * power));
            let within = |n: &f64| (-1e-9..1.0 + 1e-9).contains(&self.share(*n));
            all.filter(within).collect()
        };
        match scale {
            Scale::Linear => even([low, high], most),
            Scale::Log if high - low < 1.0 => even([low, high].map(|end| 10f64.powf(end)), most),
            Scale::Log => {
                let whole = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
                let few = [&whole[..], &[1.0, 2.0, 5.0], &[1.0, 3.0]];
                let few = few.into_iter().map(|multiples| of(multiples, 1));
                let mut all = few.chain((0..10).map(|k| of(&[1.0], 1 << k)));
                all.find(|ticks| ticks.len() <= most).unwrap_or_default()
            }
        }
    }
}

/// Multiples of 1, 2, 2.5, 5 times a power of ten.
fn even([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let start = ((high - low) / most as f64).log10().floor() as i32;
    let steps = (start..start + 3).map(|power| 10f64.powi(power));
    let steps = steps.flat_map(|power| [1.0, 2.0, 2.5, 5.0].map(|m| m * power));
    let mut ticks = steps.map(|step| -> Vec<f64> {
        // Rounding must not take away an end.
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        (first..=last).map(|k| k as f64 * step).collect()
    });
    ticks.find(|ticks| ticks.len() <= most).unwrap_or_default()
}

/// A number at a tick: its digits without the rounding that multiples carry.
pub fn label(number: f64) -> String {
    let number: f64 = format!("{number:.11e}").parse().expect("it is a number");
    if number == 0.0 || (1e-3..1e5).contains(&number.abs()) {
        (number + 0.0).to_string()
    } else {
        format!("{number:e}")
    }
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
                    let count = ticks.len();
                    assert!((2..=most).contains(&count), "{axis:?}, {most}: {ticks:?}");
                    let within = |t: &f64| (-1e-6..1.0 + 1e-6).contains(&axis.share(*t));
                    assert!(ticks.iter().all(within), "{axis:?}: {ticks:?}");
                    let mut labels: Vec<String> = ticks.iter().copied().map(label).collect();
                    labels.dedup();
                    assert_eq!(labels.len(), ticks.len(), "{axis:?}: {labels:?}");
                }
            }
        }
        let wide = Axis::over([1e-300, 1e300], Scale::Log).ticks(8);
        assert!((3..=8).contains(&wide.len()), "{wide:?}");
    }

    #[test]
    fn a_range_has_room_on_both_sides_and_the_ends_that_it_is_given() {
        let around = |numbers: &[f64], scale, given| {
            let Axis(_, ends) = Axis::around(numbers.iter().copied(), scale, given);
            ends
        };
        let none = [None; 2];
        let log = around(&[1.0, f64::NAN, 100.0, 0.0, -1.0], Scale::Log, none);
        assert!(log[0] < -0.05 && log[1] > 2.05, "{log:?}");
        for scale in [Scale::Linear, Scale::Log] {
            assert_eq!(around(&[], scale, none), [0.0, 1.0]);
            let five = scale.place(5.0);
            let single = around(&[5.0], scale, none);
            assert!(single[0] < five && single[1] > five);
            let given = around(&[5.0, 7.0], scale, [Some(6.0), None]);
            assert!(given[0] == scale.place(6.0) && given[1] > scale.place(7.0));
            let beyond = around(&[5.0], scale, [Some(50.0), None]);
            assert!(beyond[1] > beyond[0]);
        }
        let zero = around(&[0.0], Scale::Linear, none);
        assert!(zero[0] < 0.0 && zero[1] > 0.0);
    }

    #[test]
    fn numbers_have_room_and_are_as_many_as_have_it() {
        let axis = Axis::over([0.0, 8.0], Scale::Linear);
        let count = |length| axis.numbers(length, true).len();
        assert_eq!((count(600.0), count(150.0), count(50.0)), (9, 5, 2));
    }

    #[test]
    fn a_label_has_the_digits_that_it_needs() {
        for (number, text) in [
            (0.600_000_000_000_000_1, "0.6"),
            (-25.0, "-25"),
            (12_500.0, "12500"),
            (1e5, "1e5"),
            (2.5e-4, "2.5e-4"),
            (0.001, "0.001"),
            (1.180_000_000_001, "1.18"),
            (0.0, "0"),
            (-0.0, "0"),
            (123_456_789_012.3, "1.23456789012e11"),
        ] {
            assert_eq!(label(number), text);
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
