//! What a mutant does wrong.

use conformance::Flaw;

/// What a mutant does wrong.
pub struct Wrong {
    /// To what passes, whichever way: a kind of message goes one way only.
    pub messages: Flaw,
    /// Outside the messages.
    pub process: ProcessFlaws,
}

/// Flaws of the solver as a process, besides its messages.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is the flaw of one mutant"
)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProcessFlaws {
    /// Exit status after Close, instead of 0.
    pub status_closed: Option<u8>,
    /// Exit status after anything else, instead of 3.
    pub status_failed: Option<u8>,
    /// Exit status when there is nothing to join, instead of 2.
    pub status_unjoined: Option<u8>,
    /// Opens where it measures to only after it has sent Ready.
    pub opens_late: bool,
    /// Wakes nobody.
    pub wakes_nobody: bool,
    /// Looks for messages only when somebody has woken it.
    pub waits_to_be_woken: bool,
    /// Ends when it has sent Bye.
    pub goes_at_bye: bool,
    /// Does not look whether the coupler lives.
    pub never_looks_up: bool,
    /// Does not look whether the coupler lives between a grant and the report.
    pub never_looks_up_in_a_step: bool,
    /// Does not keep the file by which it notes that it takes part.
    pub joins_without_note: bool,
    /// Removes the run's lock when it ends.
    pub removes_the_lock: bool,
    /// Ends without a word when no grant comes.
    pub gives_up_silently: bool,
    /// Ends on Ctrl-C.
    pub ends_on_interrupt: bool,
}

impl Wrong {
    /// Behaves badly.
    pub fn process(change: impl FnOnce(&mut ProcessFlaws)) -> Self {
        let mut wrong = Self::from(nothing());
        change(&mut wrong.process);
        wrong
    }
}

impl From<Flaw> for Wrong {
    fn from(messages: Flaw) -> Self {
        Self {
            messages,
            process: ProcessFlaws::default(),
        }
    }
}

/// What passes is not changed.
pub fn nothing() -> Flaw {
    Flaw::passing(|message| vec![message])
}
