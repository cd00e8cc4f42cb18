//! Handles a point that is outside the domain.

use interface::config::Leaving;
use interface::solver::Fault;

/// What happens to points outside.
#[derive(Debug)]
pub struct Outside {
    rule: Leaving,
    /// Lanes to be removed at the end of the step: cloud and lane, in this order.
    pub gone: Vec<(usize, usize)>,
}

impl Outside {
    /// With this rule.
    pub fn new(rule: Leaving) -> Self {
        Self {
            rule,
            gone: Vec::new(),
        }
    }

    /// A point was found outside.
    ///
    /// # Errors
    /// `fault`, which names it, where points must stay.
    pub fn take(&mut self, cloud: usize, lane: usize, fault: Fault) -> Result<(), Fault> {
        match self.rule {
            Leaving::Stop => Err(fault),
            Leaving::Remove => {
                self.gone.push((cloud, lane));
                Ok(())
            }
        }
    }
}
