//! The history of contacts from one step to the next, as numbers, so that the state of any law can be saved.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Plain values that may be stored in arrays and shared between threads.
pub trait Plain: Copy + Send + Sync + std::fmt::Debug + 'static {}
impl<T: Copy + Send + Sync + std::fmt::Debug + 'static> Plain for T {}

/// What a part of a law remembers of a contact, as numbers. `OF` says which part it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part<const OF: u32, const N: usize>(pub [f64; N]);

/// The tangential part of a law.
pub const TANGENT: u32 = 1;
/// The viscous part.
pub const DASHPOT: u32 = 2;
/// The rolling part.
pub const ROLLING: u32 = 3;
/// What the geometry of a pair remembers.
pub const GEOMETRY: u32 = 4;

impl<const OF: u32, const N: usize> Default for Part<OF, N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

/// The history of a contact as numbers, for a saved state. Histories of several parts are pairs of histories.
pub trait Numbers: Plain + Default {
    /// Number of values.
    const COUNT: usize;
    /// The parts of the history in their order, each with its number of values.
    fn parts() -> Vec<(u32, u32)>;
    /// Appends the values.
    fn put(&self, numbers: &mut Vec<f64>);
    /// Reads the numbers; missing ones are zero.
    fn take(numbers: &mut impl Iterator<Item = f64>) -> Self;
}

impl Numbers for () {
    const COUNT: usize = 0;
    fn parts() -> Vec<(u32, u32)> {
        Vec::new()
    }
    fn put(&self, _: &mut Vec<f64>) {}
    fn take(_: &mut impl Iterator<Item = f64>) {}
}

impl<const OF: u32, const N: usize> Numbers for Part<OF, N> {
    const COUNT: usize = N;
    fn parts() -> Vec<(u32, u32)> {
        vec![(OF, N as u32)]
    }
    fn put(&self, numbers: &mut Vec<f64>) {
        numbers.extend(self.0);
    }
    fn take(numbers: &mut impl Iterator<Item = f64>) -> Self {
        Self(std::array::from_fn(|_| numbers.next().unwrap_or(0.0)))
    }
}

impl<A: Numbers, B: Numbers> Numbers for (A, B) {
    const COUNT: usize = A::COUNT + B::COUNT;
    fn parts() -> Vec<(u32, u32)> {
        [A::parts(), B::parts()].concat()
    }
    fn put(&self, numbers: &mut Vec<f64>) {
        self.0.put(numbers);
        self.1.put(numbers);
    }
    fn take(numbers: &mut impl Iterator<Item = f64>) -> Self {
        (A::take(numbers), B::take(numbers))
    }
}

/// The histories of the contacts of a list, as they are saved. Most pairs of a list do not touch and have no history.
#[derive(Debug, Serialize, Deserialize)]
pub struct Saved {
    /// Length of the list.
    pairs: usize,
    /// The parts to which the numbers of each pair belong.
    parts: Vec<(u32, u32)>,
    /// Pairs with a history, ascending.
    at: Vec<u32>,
    /// Their histories, one after another.
    numbers: Vec<f64>,
}

impl Saved {
    /// The form of these.
    pub fn of<H: Numbers>(histories: &[H]) -> Self {
        let mut saved = Self {
            pairs: histories.len(),
            parts: H::parts(),
            at: Vec::new(),
            numbers: Vec::new(),
        };
        for (k, history) in (0..).zip(histories) {
            let from = saved.numbers.len();
            history.put(&mut saved.numbers);
            // The comparison is by bits, since minus zero must be restored as minus zero.
            if saved.numbers[from..].iter().all(|x| x.to_bits() == 0) {
                saved.numbers.truncate(from);
            } else {
                saved.at.push(k);
            }
        }
        saved
    }

    /// The histories. If the law has other parts than the saved one, the parts that both have are taken over, and the
    /// others start from zero.
    pub fn histories<H: Numbers>(&self) -> Vec<H> {
        let of_a_pair = (self.parts.iter())
            .map(|(_, count)| *count as usize)
            .sum::<usize>();
        let places = places(&self.parts, &H::parts());
        let mut histories = vec![H::default(); self.pairs];
        let numbers = self.numbers.chunks_exact(of_a_pair.max(1));
        for (&k, numbers) in self.at.iter().zip(numbers) {
            let number = |place: &Option<usize>| place.map_or(0.0, |place| numbers[place]);
            if let Some(history) = histories.get_mut(k as usize) {
                *history = H::take(&mut places.iter().map(number));
            }
        }
        histories
    }
}

/// Writes the histories of a list: `#[serde(with = "crate::law::history")]`.
///
/// # Errors
/// As the serializer.
pub fn serialize<H: Numbers, S: Serializer>(histories: &[H], to: S) -> Result<S::Ok, S::Error> {
    Saved::of(histories).serialize(to)
}

/// Reads the histories of a list ([`Saved::histories`]).
///
/// # Errors
/// As the deserializer.
pub fn deserialize<'a, H: Numbers, D: Deserializer<'a>>(from: D) -> Result<Vec<H>, D::Error> {
    Saved::deserialize(from).map(|saved| saved.histories())
}

/// The index among the `saved` numbers of each number of the `own` parts; `None` if it is not there.
fn places(saved: &[(u32, u32)], own: &[(u32, u32)]) -> Vec<Option<usize>> {
    let mut places = Vec::new();
    for part in own {
        let mut first = 0;
        let mut found = None;
        for other in saved {
            found = found.or_else(|| (other == part).then_some(first));
            first += other.1 as usize;
        }
        places.extend((0..part.1 as usize).map(|k| found.map(|first| first + k)));
    }
    places
}
