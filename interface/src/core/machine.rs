//! The common trait of the machines of both solvers' sides.

use super::error::SessionError;
use super::event::{Action, Event};
use super::line::Line;

/// A solver's side of a session, whichever it is.
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

    /// The same where a clause may be broken.
    ///
    /// # Errors
    /// Any [`SessionError`]; it ends the session.
    fn react(&mut self, event: Event<'_>) -> Result<Action, SessionError>;
    /// No step of the exchange is under way any more.
    fn leave_exchange(&mut self);
    /// What both sides have in common.
    fn line(&self) -> &Line;
    /// What both sides have in common.
    fn line_mut(&mut self) -> &mut Line;
}
