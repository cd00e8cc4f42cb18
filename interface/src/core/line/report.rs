//! The messages of a side after a window: measurement, contacts of a frame, report (PROTOCOL.md section 5).

use super::{Line, State};
use crate::config::capability::CONTACTS;
use crate::core::check;
use crate::core::event::{Action, Task};
use crate::message::Kind;
use crate::message::control::Party;
use crate::message::wire::{Report, StepHeader, flags};

impl Line {
    /// The window is over, or the side has halted: sends the measurement if it is asked for, then the report.
    pub(crate) fn finish(&mut self) -> Action {
        let measured = self.grant.flags & flags::MEASURE != 0;
        self.report = [Report {
            epoch: self.grant.epoch,
            next: self.step,
            halted: (!self.window_done()).into(),
            measured: measured.into(),
            items: self.items,
            imps: self.imps,
            rebuilds: self.set,
            limits: self.limits,
            ..Report::default()
        }];
        if measured {
            self.state = State::Measuring;
            return Action::Do(Task::Measure);
        }
        self.list_contacts()
    }

    /// Whether the contacts of the grant's first step must be reported.
    fn tells_contacts(&self) -> bool {
        let frame = self.grant.flags & flags::FRAME != 0;
        frame && self.party == Party::Dem && self.capabilities.has(CONTACTS)
    }

    /// Whether the contacts of the present step must be reported.
    pub(crate) fn is_first_of_frame(&self) -> bool {
        self.done == 0 && self.tells_contacts()
    }

    /// Sends the contacts if they are asked for, then the report.
    pub(super) fn list_contacts(&mut self) -> Action {
        if self.tells_contacts() {
            self.state = State::Listing;
            return Action::Do(Task::ListContacts);
        }
        self.report_now()
    }

    pub(super) fn report_now(&mut self) -> Action {
        self.state = State::Reporting;
        if let Err(error) = check::number(self.party, "R-2", self.step, &self.report[0]) {
            return self.fail(error);
        }
        let header = StepHeader {
            epoch: self.grant.epoch,
            step: self.step,
            count: 1,
            ..StepHeader::default()
        };
        self.send(Kind::Report, header)
    }
}
