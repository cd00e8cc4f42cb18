//! `--sample N --over KEY=uniform(A,B),...`: values that are drawn from ranges, and statistics of what they lead to.

use std::collections::BTreeSet;

use crate::StudyError;
use crate::vary::{Setting, split, twice};

/// Shares of the results that are below the quantiles of [`Statistics`].
pub const SHARES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// What is drawn for the runs of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Keys and their ranges.
    pub over: Vec<Over>,
    /// Runs.
    pub count: usize,
    /// The same seed draws the same values on every machine.
    pub seed: u64,
}

/// A scene key and the range of its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Over {
    /// Dotted key.
    pub key: String,
    kind: Kind,
    ends: [f64; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Uniform,
    /// Its logarithm is uniform.
    LogUniform,
    /// Whole numbers, both ends among them.
    Integer,
}

impl Over {
    /// Of `KEY=uniform(A,B),...`; also `log_uniform` and `integer`.
    ///
    /// # Errors
    /// [`StudyError::Usage`].
    pub fn parse(argument: &str) -> Result<Vec<Self>, StudyError> {
        let all = split(argument).and_then(|all| all.iter().map(|one| Self::one(one)).collect());
        all.map_err(|what| {
            let help = "write `--over 'KEY=uniform(0.1,0.4)'`, or `log_uniform`, or `integer`";
            StudyError::usage(format!("--over {argument}: {what}"), help)
        })
    }

    fn one(text: &str) -> Result<Self, String> {
        let (key, range) = text.split_once('=').ok_or("there is no `=`")?;
        let key = key.trim().to_owned();
        if key.is_empty() {
            return Err("no key before the `=`".into());
        }
        let none = || format!("`{range}` is not a distribution");
        let inner = range.trim().strip_suffix(')').ok_or_else(none)?;
        let (kind, numbers) = inner.split_once('(').ok_or_else(none)?;
        let kind = match kind {
            "uniform" => Kind::Uniform,
            "log_uniform" => Kind::LogUniform,
            "integer" => Kind::Integer,
            _ => return Err(none()),
        };
        let ends: Option<Vec<f64>> = numbers.split(',').map(|n| n.trim().parse().ok()).collect();
        let Some(&[low, high]) = ends.as_deref() else {
            return Err(format!("`{numbers}` is not two numbers"));
        };
        if !(low < high && (high - low).is_finite()) {
            return Err(format!(
                "{low} is not below {high}, or the range is not finite"
            ));
        }
        if kind == Kind::LogUniform && low <= 0.0 {
            return Err(format!("{low} has no logarithm"));
        }
        if kind == Kind::Integer && (low.fract() != 0.0 || high.fract() != 0.0) {
            return Err(format!("{low} and {high} are not both whole"));
        }
        Ok(Self {
            key,
            kind,
            ends: [low, high],
        })
    }

    /// The value below which this share lies, as `--set` takes it.
    fn at(&self, share: f64) -> String {
        let [low, high] = self.ends;
        match self.kind {
            Kind::Uniform => format!("{:?}", low + (high - low) * share),
            Kind::LogUniform => format!("{:?}", low * (high / low).powf(share)),
            Kind::Integer => (low + (high - low + 1.0) * share).floor().to_string(),
        }
    }
}

impl Sample {
    /// A Latin hypercube: each range is cut into as many parts of the same share as there are runs, and each part gets one
    /// value.
    ///
    /// # Errors
    /// [`StudyError::Usage`] when a key is there twice, or when two runs are the same.
    pub fn draw(&self) -> Result<Vec<Vec<Setting>>, StudyError> {
        let keys: Vec<String> = self.over.iter().map(|over| over.key.clone()).collect();
        if let Some(key) = twice(&keys) {
            let what = format!("`{key}` is drawn twice");
            return Err(StudyError::usage(what, "give each key one range"));
        }
        let mut dice = fastrand::Rng::with_seed(self.seed);
        let mut runs = vec![Vec::new(); self.count];
        for over in &self.over {
            let mut parts: Vec<usize> = (0..self.count).collect();
            dice.shuffle(&mut parts);
            for (run, part) in runs.iter_mut().zip(parts) {
                let share = (part as f64 + dice.f64()) / self.count as f64;
                run.push((over.key.clone(), over.at(share)));
            }
        }
        if runs.iter().collect::<BTreeSet<_>>().len() < runs.len() {
            return Err(StudyError::usage(
                format!("two of {} runs have the same values", self.count),
                "give fewer runs or longer ranges",
            ));
        }
        Ok(runs)
    }
}

/// What the values of a result have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Standard deviation, with N - 1.
    pub deviation: f64,
    /// At [`SHARES`], linear between the values.
    pub quantiles: [f64; SHARES.len()],
}

impl Statistics {
    /// Of at least two finite values.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        let count = values.len();
        if count < 2 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        values.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let at = share * (count - 1) as f64;
            let (low, high) = (values[at.floor() as usize], values[at.ceil() as usize]);
            low + (high - low) * at.fract()
        };
        Some(Self {
            mean,
            deviation: (squares / (count - 1) as f64).sqrt(),
            quantiles: SHARES.map(quantile),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(over: &str, count: usize, seed: u64) -> Result<Vec<Vec<Setting>>, StudyError> {
        let over = Over::parse(over)?;
        Sample { over, count, seed }.draw()
    }

    #[test]
    fn each_part_of_each_range_has_one_value() {
        let over = "a=uniform(-1,3), b.0.c=log_uniform(1e-3,10),n=integer(1,50)";
        let runs = sample(over, 50, 7).unwrap();
        let column = |k: usize| -> Vec<f64> {
            let mut column: Vec<f64> = runs.iter().map(|run| run[k].1.parse().unwrap()).collect();
            column.sort_by(f64::total_cmp);
            column
        };
        for (k, (a, b)) in column(0).into_iter().zip(column(1)).enumerate() {
            assert_eq!(((a + 1.0) / 4.0 * 50.0).floor() as usize, k);
            assert_eq!(((b / 1e-3).log10() / 4.0 * 50.0).floor() as usize, k);
        }
        assert_eq!(column(2), (1..=50).map(f64::from).collect::<Vec<_>>());
        assert_eq!(runs, sample(over, 50, 7).unwrap());
        assert_ne!(runs, sample(over, 50, 8).unwrap());
        // Keys are drawn one after the other: another one changes none before it.
        let more = sample(&format!("{over},z=uniform(0,1)"), 50, 7).unwrap();
        assert!(runs.iter().zip(more).all(|(run, more)| *run == more[..3]));
    }

    #[test]
    fn what_is_no_range_is_refused() {
        for (over, phrase) in [
            ("a", "there is no `=`"),
            ("=uniform(0,1)", "no key"),
            ("a=0.3", "`0.3` is not a distribution"),
            ("a=normal(0,1)", "`normal(0,1)` is not a distribution"),
            ("a=uniform(0,1", "a closing `)` is missing"),
            ("a=uniform(1)", "`1` is not two numbers"),
            ("a=uniform(0,x)", "`0,x` is not two numbers"),
            ("a=uniform(2,1)", "2 is not below 1"),
            ("a=uniform(1,1)", "1 is not below 1"),
            ("a=uniform(0,inf)", "not finite"),
            ("a=uniform(nan,1)", "NaN is not below 1"),
            ("a=log_uniform(0,1)", "0 has no logarithm"),
            ("a=integer(0,1.5)", "not both whole"),
            ("a=uniform(0,1),a=uniform(0,2)", "`a` is drawn twice"),
            ("a=integer(1,3)", "two of 5 runs have the same values"),
        ] {
            let message = sample(over, 5, 0).unwrap_err().to_string();
            assert!(message.contains(phrase), "{over}: {message}");
        }
    }

    #[test]
    fn statistics_are_those_of_a_known_list() {
        let found = Statistics::of((0..=20).rev().map(f64::from).collect()).unwrap();
        assert_eq!(found.mean, 10.0);
        assert_eq!(found.deviation, 38.5f64.sqrt());
        assert_eq!(found.quantiles, [1.0, 5.0, 10.0, 15.0, 19.0]);
        assert_eq!(Statistics::of(vec![1.0, 2.0]).unwrap().quantiles[1], 1.25);
        assert_eq!(Statistics::of(vec![1.0]), None);
    }
}
