//! stub
use super::Scene;
/// What will run.
#[derive(Debug, Clone)]
pub struct Plan;
impl Plan {
    pub(super) fn new(_: &Scene) -> Self {
        Self
    }
}
