//! Data that is kept between steps, and its replacement.

/// The lists and histories that are kept between steps, and those that the last evaluation built. An evaluation changes
/// nothing that is kept, so a step can be evaluated again.
#[derive(Debug, Default)]
pub(super) struct Versions<T> {
    /// The data that are kept.
    pub kept: T,
    /// Replaces `kept` if `rebuilt`.
    pub fresh: T,
    /// Whether the last evaluation built `fresh`.
    pub rebuilt: bool,
}

impl<T> Versions<T> {
    /// The version that an evaluation uses.
    pub fn current(&self) -> &T {
        if self.rebuilt {
            &self.fresh
        } else {
            &self.kept
        }
    }

    /// Keeps the version that the last evaluation used. Returns whether it was new.
    pub fn keep(&mut self) -> bool {
        if self.rebuilt {
            std::mem::swap(&mut self.kept, &mut self.fresh);
        }
        std::mem::replace(&mut self.rebuilt, false)
    }
}
