//! The part of a recording that is kept when its run continues from a checkpoint.

use std::path::Path;

use super::playback::Begin;
use super::{About, Message, Playback, RecordingError};
use crate::message::Kind;
use crate::message::codec::decode;
use crate::message::control::{Order, Party};
use crate::message::wire::Grant;

/// The point at which a run continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// First step that is not done.
    pub step: u64,
    /// The epoch of that step.
    pub epoch: u64,
}

impl Moment {
    fn is_after(self, epoch: u64, step: u64) -> bool {
        epoch < self.epoch || (epoch == self.epoch && step < self.step)
    }
}

/// The part of a recording that is kept.
pub(super) struct Kept {
    /// The first block that is not kept whole.
    pub end: Begin,
    /// The messages that are kept of this block and of those after it.
    pub rest: Vec<Message>,
}

/// Reads what the recording at `path` of the run `about` has before `moment`.
///
/// # Errors
/// [`RecordingError`], also if the recording ends before that moment.
pub(super) fn keep(path: &Path, about: &About, moment: Moment) -> Result<Kept, RecordingError> {
    let mut playback = Playback::open(path)?;
    if playback.about() != about {
        let reason = "it is of another run or program".to_owned();
        let path = path.to_path_buf();
        return Err(RecordingError::Foreign { path, reason });
    }
    let mut filter = MomentFilter::new(moment);
    let (mut block, mut end, mut rest) = (Begin::default(), None, Vec::new());
    // Damage after the moment does not matter; whether all messages before it are there is tested below.
    while let Ok(Some(message)) = playback.message() {
        if end.is_none() && playback.begin != block {
            block = playback.begin;
            rest.clear();
        }
        if filter.keeps(&message) {
            rest.push(message);
        } else {
            end.get_or_insert(block);
        }
    }
    if end.is_none() && playback.begin != block {
        rest.clear();
    }
    if !filter.is_whole() {
        let (path, step) = (path.to_path_buf(), moment.step);
        return Err(RecordingError::Short { path, step });
    }
    let end = end.unwrap_or(playback.begin);
    Ok(Kept { end, rest })
}

/// Selects the messages before a moment.
struct MomentFilter {
    moment: Moment,
    /// The coupler has granted the step of the moment. The coupler's own messages are recorded in the order in which
    /// they were sent.
    over: bool,
    /// First step that is not done, by the last report of each solver.
    reported: [Option<u64>; 2],
    /// The last step for which the bodies sent forces.
    answered: Option<u64>,
}

impl MomentFilter {
    fn new(moment: Moment) -> Self {
        Self {
            moment,
            over: false,
            reported: [None; 2],
            answered: None,
        }
    }

    fn keeps(&mut self, message: &Message) -> bool {
        let (channel, header) = (message.channel, &message.header);
        if channel.is_between_solvers() {
            let before = self.moment.is_after(header.epoch, header.step);
            if before && channel.kind == Kind::Forces {
                self.answered = Some(header.step);
            }
            return before;
        }
        if channel.kind == Kind::Grant
            && let Some([grant]) = message.records::<Grant>().as_deref()
        {
            self.over |= !self.moment.is_after(grant.epoch, grant.first);
        }
        // It ended an attempt to go on, before the moment at which the run goes on now.
        if channel.kind == Kind::Order && matches!(decode(&message.payload), Ok(Order::Abort(_))) {
            return false;
        }
        if channel.kind == Kind::Report && !self.over {
            let solver = usize::from(channel.is_of(Party::Dem));
            self.reported[solver] = Some(header.step);
        }
        !self.over
    }

    /// Whether all messages before the moment were found.
    fn is_whole(&self) -> bool {
        let step = self.moment.step;
        let reported = self.reported.iter().flatten();
        let coupled = self.reported.iter().all(Option::is_some);
        let answered = !coupled || self.answered.is_some_and(|last| last + 1 == step);
        reported.clone().count() > 0 && reported.clone().all(|next| *next == step) && answered
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Channel;
    use crate::message::codec::encode;
    use crate::message::wire::StepHeader;

    /// An attempt to go on that was interrupted before its first grant left its Abort in the recording for good.
    #[test]
    fn an_abort_before_the_moment_is_not_kept() {
        let moment = Moment { step: 19, epoch: 1 };
        let order = |order: &Order| Message {
            channel: Channel::of(Party::Dem, Kind::Order),
            header: StepHeader::default(),
            payload: encode(order),
        };
        let mut filter = MomentFilter::new(moment);
        assert!(!filter.keeps(&order(&Order::Abort("interrupted".into()))));
        assert!(filter.keeps(&order(&Order::Drain)));
    }
}
