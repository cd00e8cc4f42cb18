//! The history of contacts from one step to the next, as numbers, so that the state of any law can be saved, and another
//! law can go on from it.

/// Plain values that may be stored in arrays and shared between threads.
pub trait Plain: Copy + Send + Sync + std::fmt::Debug + 'static {}
impl<T: Copy + Send + Sync + std::fmt::Debug + 'static> Plain for T {}

/// What a contact may remember, whatever its law: each part has its place. Those that a law does not have are zero.
pub type All = [f64; 7];

/// Place of a tangential spring of constant stiffness in [`All`]: 1 number.
pub const ELONGATION: usize = 0;
/// Of a tangential spring that stiffens: 2 numbers.
pub const SHEARED: usize = 1;
/// Of a dashpot: 2 numbers.
pub const DASHPOT: usize = 3;
/// Of rolling: 2 numbers.
pub const ROLLING: usize = 5;

/// What a part of a law remembers of a contact: `N` numbers, in [`All`] from `AT` on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part<const AT: usize, const N: usize>(pub [f64; N]);

impl<const AT: usize, const N: usize> Default for Part<AT, N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

/// The history of a contact as numbers. Histories of several parts are pairs of histories.
pub trait Numbers: Plain + Default {
    /// Writes the values to their places.
    fn put(&self, all: &mut All);
    /// Reads the values from their places.
    fn take(all: &All) -> Self;
    /// What another history has of the same parts; the others start from zero.
    #[inline]
    fn of(other: &impl Numbers) -> Self {
        let mut all = All::default();
        other.put(&mut all);
        Self::take(&all)
    }
}

impl Numbers for All {
    #[inline]
    fn put(&self, all: &mut All) {
        *all = *self;
    }
    #[inline]
    fn take(all: &All) -> Self {
        *all
    }
}

impl<const AT: usize, const N: usize> Numbers for Part<AT, N> {
    #[inline]
    fn put(&self, all: &mut All) {
        all[AT..AT + N].copy_from_slice(&self.0);
    }
    #[inline]
    fn take(all: &All) -> Self {
        Self(std::array::from_fn(|k| all[AT + k]))
    }
}

impl<A: Numbers, B: Numbers> Numbers for (A, B) {
    #[inline]
    fn put(&self, all: &mut All) {
        self.0.put(all);
        self.1.put(all);
    }
    #[inline]
    fn take(all: &All) -> Self {
        (A::take(all), B::take(all))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::dashpot::Drag;
    use crate::law::tangent::{Elongation, Sheared};

    #[test]
    fn what_two_laws_both_remember_goes_over() {
        let before: (Elongation, Drag) = (Part([3.0]), Part([4.0, 5.0]));
        assert_eq!(<(Elongation, Drag)>::of(&All::of(&before)), before);
        assert_eq!(Elongation::of(&before), before.0);
        assert_eq!(Drag::of(&before), before.1);
        // A tangential spring with two numbers belongs to another law.
        assert_eq!(<(Sheared, Drag)>::of(&before), (Part([0.0; 2]), before.1));
    }
}
