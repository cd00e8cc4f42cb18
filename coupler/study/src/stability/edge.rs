//! Where something that holds at small values ceases to hold: a coarse grid, then bisection in the logarithm.

use clap::Args;

use crate::plot_options::numbers;

/// What was tried, and what it says of the edge.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Edge {
    /// Values tried and whether they were stable, in the order of trying.
    pub tried: Vec<(f64, bool)>,
    /// Largest value below which, of those tried, none is unstable.
    pub stable: Option<f64>,
    /// Smallest unstable value.
    pub unstable: Option<f64>,
}

/// How an edge is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct Search {
    /// Range of the search: stable at the first value, unstable at the second.
    #[arg(long, value_name = "LOW,HIGH", default_value = "0.5,8", value_parser = numbers::<2>)]
    pub between: [f64; 2],
    /// Values of the grid along a column, before bisection.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(2..))]
    pub grid: u16,
    /// Largest ratio between an unstable value and the stable one below it, at which the search ends.
    #[arg(long, value_name = "RATIO", default_value_t = 1.1)]
    pub ratio: f64,
}

impl Search {
    /// The values to try next for an edge; none once it is known. The grid is tried as a whole, so that stable values beyond an
    /// unstable one are seen; the edge is that before the first unstable one.
    pub fn next(&self, edge: &Edge) -> Vec<f64> {
        if edge.tried.is_empty() {
            return self.grid();
        }
        let (Some(low), Some(high)) = (edge.stable, edge.unstable) else {
            return Vec::new();
        };
        let middle = tidy((low * high).sqrt());
        let is_known = high / low <= self.ratio || middle <= low || middle >= high;
        if is_known { Vec::new() } else { vec![middle] }
    }

    fn grid(&self) -> Vec<f64> {
        let [low, high] = self.between;
        let steps = self.grid.max(2) - 1;
        let at = |k: u16| tidy(low * (high / low).powf(f64::from(k) / f64::from(steps)));
        (0..=steps).map(at).collect()
    }
}

impl Edge {
    /// A value was tried.
    pub fn take(&mut self, value: f64, stable: bool) {
        self.tried.push((value, stable));
        let unstable = self.tried.iter().filter(|t| !t.1).map(|t| t.0);
        self.unstable = unstable.reduce(f64::min);
        let below = self.unstable.unwrap_or(f64::INFINITY);
        let stable = self.tried.iter().filter(|t| t.1 && t.0 < below);
        self.stable = stable.map(|t| t.0).reduce(f64::max);
    }
}

/// Four digits: values go into names and tables.
fn tidy(value: f64) -> f64 {
    format!("{value:.3e}")
        .parse()
        .expect("a number is written as one")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEARCH: Search = Search {
        between: [0.5, 8.0],
        grid: 5,
        ratio: 1.05,
    };

    fn find(is_stable: impl Fn(f64) -> bool) -> Edge {
        let mut edge = Edge::default();
        loop {
            let next = SEARCH.next(&edge);
            if next.is_empty() {
                return edge;
            }
            for &value in &next {
                edge.take(value, is_stable(value));
            }
        }
    }

    #[test]
    fn the_edge_is_bracketed_to_the_ratio() {
        for edge in [0.51, 1.0, 1.234, 3.999, 7.9] {
            let found = find(|x| x <= edge);
            let (low, high) = (found.stable.unwrap(), found.unstable.unwrap());
            assert!(low <= edge && edge < high, "{edge}: {low} to {high}");
            assert!(high / low <= 1.05, "{edge}: {low} to {high}");
            // log2(2)/log2(1.05) halvings of one interval of the grid.
            assert!(found.tried.len() <= 5 + 4, "{}", found.tried.len());
        }
    }

    #[test]
    fn a_limit_outside_the_range_is_reported() {
        let all = find(|_| true);
        assert_eq!((all.stable, all.unstable), (Some(8.0), None));
        let none = find(|_| false);
        assert_eq!((none.stable, none.unstable), (None, Some(0.5)));
        assert_eq!(all.tried.len(), 5);
    }

    #[test]
    fn an_island_beyond_the_first_instability_is_not_the_edge() {
        let found = find(|x| !(1.5..=6.0).contains(&x));
        assert!(found.stable.unwrap() < 1.5 && found.unstable.unwrap() >= 1.5);
        assert!(found.tried.contains(&(8.0, true)));
    }
}
