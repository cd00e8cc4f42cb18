//! How saved states are written. The state of a component is one struct, which derives `Serialize` and `Deserialize` and
//! is saved whole; what stands beside it belongs to the configuration, follows from the state, or is a result of one
//! evaluation. This module writes the values that serde does not know: `#[serde(with = "crate::saved")]`.

use interface::Vec2;
use interface::message::wire::ImpInfo;
use interface::solver::Refusal;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A value with a form that serde knows.
pub trait Form {
    /// The form.
    type Saved: Serialize + DeserializeOwned;
    /// The value in this form.
    fn save(&self) -> Self::Saved;
    /// The value of this form.
    fn of(saved: Self::Saved) -> Self;
}

/// For serde.
///
/// # Errors
/// As the form.
pub fn serialize<T: Form, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    value.save().serialize(to)
}

/// For serde.
///
/// # Errors
/// As the form.
pub fn deserialize<'a, T: Form, D: Deserializer<'a>>(from: D) -> Result<T, D::Error> {
    T::Saved::deserialize(from).map(T::of)
}

impl Form for Vec2 {
    type Saved = [f64; 2];
    fn save(&self) -> [f64; 2] {
        (*self).into()
    }
    fn of(saved: [f64; 2]) -> Self {
        saved.into()
    }
}

impl Form for (Vec2, f64) {
    type Saved = ([f64; 2], f64);
    fn save(&self) -> Self::Saved {
        (self.0.into(), self.1)
    }
    fn of((v, x): Self::Saved) -> Self {
        (v.into(), x)
    }
}

impl Form for ImpInfo {
    type Saved = (u64, f64, f64, u32, u32);
    fn save(&self) -> Self::Saved {
        let Self {
            id,
            radius,
            mass,
            group,
            next,
        } = *self;
        (id, radius, mass, group, next)
    }
    fn of((id, radius, mass, group, next): Self::Saved) -> Self {
        Self {
            id,
            radius,
            mass,
            group,
            next,
        }
    }
}

impl<T: Form> Form for Vec<T> {
    type Saved = Vec<T::Saved>;
    fn save(&self) -> Self::Saved {
        self.iter().map(T::save).collect()
    }
    fn of(saved: Self::Saved) -> Self {
        saved.into_iter().map(T::of).collect()
    }
}

impl<T: Form> Form for Option<T> {
    type Saved = Option<T::Saved>;
    fn save(&self) -> Self::Saved {
        self.as_ref().map(T::save)
    }
    fn of(saved: Self::Saved) -> Self {
        saved.map(T::of)
    }
}

/// Refuses histories that do not belong to the pairs of the list that was built again.
///
/// # Errors
/// A refusal with both numbers.
pub fn one_for_each<H>(histories: &[H], pairs: usize) -> Result<(), Refusal> {
    if histories.len() == pairs {
        return Ok(());
    }
    let found = histories.len();
    let text = format!("the saved state has {found} pairs in a list, expected {pairs}");
    Err(interface::saved::refusal(text))
}
