//! The common trait of the machines of both solvers' sides.

use super::error::SessionError;
use super::event::{Action, Event};
use super::line::Line;

/// The machine of a solver's side of a session, for either side.
pub trait Machine {
    /// The first action.
    fn start(&mut self) -> Action {
        self.line_mut().start()
    }

    /// The next action after an event.
    fn on(&mut self, event: Event<'_>) -> Action {
        match self.react(event) {
            Ok(action) => action,
            Err(error) => {
                self.leave_exchange();
                self.line_mut().fail(error)
            }
        }
    }

    /// The same as [`Self::on`], but a broken clause is an error.
    ///
    /// # Errors
    /// Any [`SessionError`]; it ends the session.
    fn react(&mut self, event: Event<'_>) -> Result<Action, SessionError>;
    /// Ends the exchange of a step that is under way.
    fn leave_exchange(&mut self);
    /// What both sides have in common.
    fn line(&self) -> &Line;
    /// What both sides have in common.
    fn line_mut(&mut self) -> &mut Line;
}
