//! What points of cost and error show: which of them nothing beats, and the order of a method.

/// Which points are on the Pareto front: no other has both less or equal cost and less or equal error, and one of them
/// less. Points that are not finite are not.
pub fn pareto(points: &[(f64, f64)]) -> Vec<bool> {
    let sound = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    let all = || points.iter().filter(|p| sound(p));
    points
        .iter()
        .map(|p| sound(p) && !all().any(|other| beats(other, p)))
        .collect()
}

/// A relative error that is no larger than this is rounding, which has no order.
const ROUNDING: f64 = 1e-12;

/// The exponent `p` of `y = C x^p` that fits best, of relative errors `y`: least squares of the logarithms. `None` of fewer
/// than two different `x` whose errors are finite and more than rounding.
pub fn order(points: &[(f64, f64)]) -> Option<f64> {
    let finite = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let positive = |p: &&(f64, f64)| p.0 > 0.0 && p.1 > ROUNDING && finite(p);
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(positive)
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    let n = logs.len() as f64;
    let (x, y) = logs
        .iter()
        .fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let covariance: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let variance: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    // Rounding leaves a variance of some 1e-32 of equal numbers.
    (variance > 1e-20).then(|| covariance / variance)
}

/// The exponent `p` of `y = C (x^p - finest^p)` that fits best: the order of an error that is taken against a run that has
/// one itself. Least squares of the logarithms. `None` if `p` is not in 0.1 to 8, or of fewer than two different `x` above
/// `finest`.
pub fn order_against(finest: f64, points: &[(f64, f64)]) -> Option<f64> {
    let usable: Vec<(f64, f64)> = points
        .iter()
        .copied()
        .filter(|p| p.0 > finest && p.1 > ROUNDING && p.1.is_finite())
        .collect();
    order(&usable)?;
    let spread = |p: f64| {
        let n = usable.len() as f64;
        let gaps: Vec<f64> = usable
            .iter()
            .map(|(x, y)| y.ln() - (x.powf(p) - finest.powf(p)).ln())
            .collect();
        let mean = gaps.iter().sum::<f64>() / n;
        gaps.iter().map(|gap| (gap - mean).powi(2)).sum::<f64>()
    };
    // Golden section; the spread has one minimum, since the shape in x is monotone in p.
    let (mut low, mut high) = (0.1, 8.0);
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    while high - low > 1e-6 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if spread(a) < spread(b) {
            high = b;
        } else {
            low = a;
        }
    }
    // At an end of the search the best one lies beyond it: the errors do not fall as such a power.
    (low > 0.1 && high < 8.0).then_some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_the_finest_run_itself_does_not_bias_the_order() {
        let finest = 1.25f64;
        for p in [0.5, 1.0, 2.0, 3.0] {
            let points: Vec<(f64, f64)> = [10.0, 5.0, 2.5]
                .iter()
                .map(|&h: &f64| (h, 3e-4 * (h.powf(p) - finest.powf(p))))
                .collect();
            assert!((order_against(finest, &points).unwrap() - p).abs() < 1e-4);
            // What a straight line would make of it.
            assert!(order(&points).unwrap() > p + 0.02);
        }
        // Errors that do not fall had the order 0.10, the lower end of the search.
        assert_eq!(order_against(1.0, &[(4.0, 1.0), (2.0, 1.0)]), None);
        assert_eq!(order_against(1.0, &[(4.0, 1.0), (2.0, 1e-7)]), None);
        assert_eq!(order_against(2.5, &[(5.0, 1.0)]), None);
        assert_eq!(order_against(2.5, &[(5.0, 1.0), (2.5, 1.0)]), None);
    }

    #[test]
    fn rounding_has_no_order() {
        assert_eq!(order(&[(0.01, 4.103e-15), (0.005, 5.234e-15)]), None);
        assert_eq!(order(&[(0.01, 1e-3), (0.005, 5e-15)]), None);
    }

    #[test]
    fn the_order_of_a_power_is_its_exponent() {
        for p in [-1.5, 0.0, 1.0, 2.0, 3.3] {
            let points: Vec<(f64, f64)> = [0.01, 0.02, 0.05, 0.3]
                .iter()
                .map(|&h: &f64| (h, 7e-3 * h.powf(p)))
                .collect();
            assert!((order(&points).unwrap() - p).abs() < 1e-12);
        }
    }

    #[test]
    fn the_order_is_the_line_of_least_squares() {
        // ln x = 0, 1, 2; ln y = 0, 3, 3: the slope is 3/2 by hand.
        let e = std::f64::consts::E;
        let points = [(1.0, 1.0), (e, e.powi(3)), (e * e, e.powi(3))];
        assert!((order(&points).unwrap() - 1.5).abs() < 1e-14);
    }

    #[test]
    fn no_order_without_enough_points() {
        assert_eq!(order(&[]), None);
        assert_eq!(order(&[(0.1, 1.0)]), None);
        assert_eq!(order(&[(0.1, 1.0), (0.1, 2.0)]), None);
        // An error of zero has no logarithm.
        assert_eq!(order(&[(0.1, 1.0), (0.2, 0.0)]), None);
        assert_eq!(order(&[(0.1, 1.0), (0.2, f64::NAN)]), None);
    }

    #[test]
    fn nothing_beats_what_is_on_the_front() {
        let points = [
            (1.0, 1.0),
            (2.0, 0.5),
            (2.0, 0.7), // as dear as the one before, and worse
            (3.0, 0.6), // dearer and worse
            (4.0, 0.1),
            (5.0, 0.1), // dearer for the same
            (0.5, f64::NAN),
        ];
        assert_eq!(
            pareto(&points),
            [true, true, false, false, true, false, false]
        );
        // Twins are both on it.
        assert_eq!(pareto(&[(1.0, 1.0), (1.0, 1.0)]), [true, true]);
    }
}
