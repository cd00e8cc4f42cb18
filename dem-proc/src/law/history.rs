//! What contacts remember from one step to the next: numbers, so that a state can be saved whatever the law.

use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::saved::{count, finite, refusal};

/// Plain values that may be stored in arrays and shared between threads.
pub trait Plain: Copy + Send + Sync + std::fmt::Debug + 'static {}
impl<T: Copy + Send + Sync + std::fmt::Debug + 'static> Plain for T {}

/// What a law remembers, as numbers: for a saved state.
pub trait Numbers: Plain + Default {
    /// How many.
    const COUNT: usize;
    /// Appends them.
    fn put(&self, numbers: &mut Vec<f64>);
    /// Takes as many; what is missing is zero.
    fn take(numbers: &mut impl Iterator<Item = f64>) -> Self;
}

impl Numbers for () {
    const COUNT: usize = 0;
    fn put(&self, _: &mut Vec<f64>) {}
    fn take(_: &mut impl Iterator<Item = f64>) {}
}

impl<const N: usize> Numbers for [f64; N]
where
    Self: Default,
{
    const COUNT: usize = N;
    fn put(&self, numbers: &mut Vec<f64>) {
        numbers.extend(self);
    }
    fn take(numbers: &mut impl Iterator<Item = f64>) -> Self {
        std::array::from_fn(|_| numbers.next().unwrap_or(0.0))
    }
}

/// What the contacts of a list remember. Most pairs of a list do not touch and remember nothing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SavedHistories {
    /// Length of the list.
    pairs: u64,
    /// Pairs that remember something, ascending.
    at: Vec<u32>,
    /// What they remember, one after another.
    numbers: Vec<f64>,
}

impl SavedHistories {
    /// Those of a list.
    pub fn of<H: Numbers>(histories: &[H]) -> Self {
        let mut saved = Self {
            pairs: histories.len() as u64,
            ..Self::default()
        };
        for (k, history) in (0..).zip(histories) {
            let from = saved.numbers.len();
            history.put(&mut saved.numbers);
            // By bits: minus zero is not nothing.
            if saved.numbers[from..].iter().all(|x| x.to_bits() == 0) {
                saved.numbers.truncate(from);
            } else {
                saved.at.push(k);
            }
        }
        saved
    }

    /// For a list of `pairs` pairs.
    ///
    /// # Errors
    /// A refusal if they are of another list or another law.
    pub fn restored<H: Numbers>(&self, pairs: usize) -> Result<Vec<H>, Refusal> {
        let Self {
            pairs: length,
            at,
            numbers,
        } = self;
        count("pairs in a list", *length as usize, pairs)?;
        count("numbers of contacts", numbers.len(), at.len() * H::COUNT)?;
        finite(|| "the memory of a contact".into(), numbers)?;
        let mut histories = vec![H::default(); pairs];
        let mut numbers = numbers.iter().copied();
        for &k in at {
            let history = histories.get_mut(k as usize);
            let text = || refusal(format!("a contact of pair {k} in a list of {pairs}"));
            *history.ok_or_else(text)? = H::take(&mut numbers);
        }
        Ok(histories)
    }
}
