use std::fs;

use super::*;
use crate::message::control::Party;
use crate::message::wire::{Grant, ImpForce, ImpState, Report};
use crate::message::{Kind, Records};

fn states_channel() -> Channel {
    Channel::of(Party::Mpm, Kind::States)
}

fn about() -> About {
    About::run("scene", "hash", "test")
}

fn header(step: u64) -> StepHeader {
    StepHeader {
        step,
        count: 1,
        ..StepHeader::default()
    }
}

fn state(step: u64) -> ImpState {
    ImpState {
        position: [step as f64 / 3.0, -0.0],
        velocity: [1e-300, f64::NAN],
    }
}

/// Writes a recording of so many messages, with or without its end.
fn write(path: &Path, messages: u64, ended: bool) {
    let recorder = Recorder::create(path, &about()).unwrap();
    for step in 0..messages {
        recorder.sink().note(
            states_channel(),
            &header(step),
            Records::States(&[state(step)]),
        );
    }
    if ended {
        recorder.finish().unwrap();
    }
}

fn read(path: &Path) -> (Vec<Message>, End) {
    let mut playback = Playback::open(path).unwrap();
    let mut messages = Vec::new();
    while let Some(message) = playback.message().unwrap() {
        messages.push(message);
    }
    (messages, playback.end().unwrap())
}

fn assert_first(messages: &[Message]) {
    for (step, message) in (0..).zip(messages) {
        assert_eq!(message.channel.name(), "imp/states");
        assert_eq!(message.header, header(step));
        let [read] = message.records::<ImpState>().unwrap()[..] else {
            panic!("{message:?}");
        };
        // NaN is recorded too: a recorder does not check what it records.
        let bits = |s: ImpState| [s.position, s.velocity].map(|v| v.map(f64::to_bits));
        assert_eq!(bits(read), bits(state(step)));
    }
}

#[test]
fn what_is_noted_is_read_back_to_the_bit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    // More than two blocks.
    let messages = 30_000;
    write(&path, messages, true);
    let (read, end) = read(&path);
    assert_eq!(end, End::Whole { messages });
    assert_eq!(read.len() as u64, messages);
    assert_first(&read);
    assert_eq!(Playback::open(&path).unwrap().about(), &about());
}

#[test]
fn a_message_longer_than_a_block_is_one_block() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    let recorder = Recorder::create(&path, &about()).unwrap();
    let states: Vec<_> = (0..100_000).map(state).collect();
    for _ in 0..3 {
        recorder
            .sink()
            .note(states_channel(), &header(0), Records::States(&states));
    }
    recorder.finish().unwrap();
    let (messages, end) = read(&path);
    assert_eq!(end, End::Whole { messages: 3 });
    assert_eq!(messages[2].payload.len(), 3_200_000);
}

#[test]
fn without_its_end_a_recording_is_torn_and_its_prefix_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    write(&path, 30_000, false);
    let whole = fs::read(&path).unwrap();
    let (messages, end) = read(&path);
    assert_first(&messages);
    let at = whole.len() as u64;
    let written = messages.len() as u64;
    assert_eq!(
        end,
        End::Torn {
            messages: written,
            at
        }
    );
    for cut in [1, CHECK, CHECK + 1, whole.len() / 3] {
        fs::write(&path, &whole[..whole.len() - cut]).unwrap();
        let (messages, end) = read(&path);
        assert_first(&messages);
        let End::Torn { messages: told, .. } = end else {
            panic!("{end:?}");
        };
        assert!(told == messages.len() as u64 && told < written);
    }
}

#[test]
fn every_flipped_byte_is_detected() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    write(&path, 20, true);
    let whole = fs::read(&path).unwrap();
    for at in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x10;
        fs::write(&path, flipped).unwrap();
        let told = Playback::verify(&path);
        // A description that is said to be longer than the file looks like a file that is not a recording.
        assert!(told.is_err(), "byte {at}: {told:?}");
    }
    let mut longer = whole.clone();
    longer.push(0);
    fs::write(&path, longer).unwrap();
    let told = Playback::verify(&path).unwrap_err().to_string();
    assert!(told.contains("after the end"), "{told}");
}

#[test]
fn files_that_are_not_recordings_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    for text in ["", "short", "name,x [m],y [m],angle [rad]\nfloor,0,0,0\n"] {
        fs::write(&path, text).unwrap();
        let told = Playback::verify(&path).unwrap_err().to_string();
        assert!(told.contains("is not a recording"), "{told}");
    }
    let other = About {
        layout: "0123456789abcdef".into(),
        ..about()
    };
    Recorder::create(&path, &other).unwrap().finish().unwrap();
    let told = Playback::verify(&path).unwrap_err().to_string();
    assert!(told.contains("layout 0123456789abcdef, this is"), "{told}");
}

/// `/dev/full` is a disk without room.
#[test]
fn a_full_disk_is_reported_and_delays_nothing() {
    let path = Path::new("/dev/full");
    let Err(told) = Recorder::create(path, &about()) else {
        panic!("the first write finds out");
    };
    assert!(told.to_string().contains("No space left"), "{told}");
}

#[test]
fn after_an_error_nothing_waits_for_the_disk() {
    let dir = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(&dir.path().join("r"), &about()).unwrap();
    let sink = recorder.sink();
    sink.fail(RecordingError::Tap("deaf".into()));
    let states = vec![state(0); 1 << 20];
    for _ in 0..4 {
        sink.note(states_channel(), &header(0), Records::States(&states));
    }
    assert!(sink.failure().unwrap().to_string().contains("deaf"));
    assert!(recorder.finish().is_err());
}

/// D17: a block that announced 4 GiB, with correct checksums, was allocated before it was read.
#[test]
fn a_block_that_announces_more_than_follows_is_torn_or_damaged() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    write(&path, 1, true);
    let whole = fs::read(&path).unwrap();
    let block = Playback::open(&path).unwrap().offset as usize;
    let lie = |stored: u32, raw: u32| {
        let numbers = [stored, raw, 1].map(u32::to_le_bytes).concat();
        let sum = check(&[&0_u64.to_le_bytes(), &numbers]);
        let body = [7; 8];
        let body_sum = check(&[&body]);
        let bytes = [&whole[..block], &numbers, &sum, &body, &body_sum].concat();
        fs::write(&path, bytes).unwrap();
        let mut playback = Playback::open(&path).unwrap();
        let ended = playback.message().map(|message| message.is_some());
        (ended, playback.end())
    };
    let (ended, end) = lie(u32::MAX, u32::MAX);
    assert!(matches!(ended, Ok(false)) && matches!(end, Some(End::Torn { .. })));
    let (ended, _) = lie(8, u32::MAX);
    assert!(
        ended
            .unwrap_err()
            .to_string()
            .contains("the length of a block")
    );
}

/// A description of 1 MiB that was announced and not there was allocated (`fuzz/corpus/recording`).
#[test]
fn memory_is_taken_for_what_is_there_and_not_for_what_is_announced() {
    let read = playback::up_to(&mut &b"two"[..], 1 << 20).unwrap();
    assert_eq!(read, b"two");
    assert!(read.capacity() < 1 << 10);
    let longer = &mut &b"two and more"[..];
    assert_eq!(playback::up_to(longer, 3).unwrap(), b"two");
}

/// Records steps `from..to` of a run in windows of `window`. The messages between the solvers are recorded a window
/// late.
fn steps(sink: &RecordingSink, (from, to): (u64, u64), window: u64) {
    let between = |first: u64, end: u64| {
        for step in first..end {
            let states = Records::States(&[state(step)]);
            sink.note(states_channel(), &header(step), states);
            let forces = [ImpForce::default()];
            let channel = Channel::of(Party::Mpm, Kind::Forces);
            sink.note(channel, &header(step), Records::Forces(&forces));
        }
    };
    let (mut first, mut late) = (from, from);
    while first < to {
        let end = (first + window).min(to);
        for party in [Party::Mpm, Party::Dem] {
            let grant = Grant {
                first,
                steps: end - first,
                dt: 1.0,
                ..Grant::default()
            };
            let channel = Channel::of(party, Kind::Grant);
            sink.note(channel, &header(first), Records::Grant(&[grant]));
        }
        between(late, first);
        late = first;
        for party in [Party::Mpm, Party::Dem] {
            let report = Report {
                next: end,
                ..Report::default()
            };
            let channel = Channel::of(party, Kind::Report);
            sink.note(channel, &header(end), Records::Report(&[report]));
        }
        first = end;
    }
    between(late, to);
}

fn of_kind(messages: &[Message], kind: Kind) -> Vec<u64> {
    let of_kind = messages.iter().filter(|m| m.channel.kind == kind);
    of_kind.map(|m| m.header.step).collect()
}

#[test]
fn a_recording_goes_on_from_a_step_without_a_gap_or_a_step_twice() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    for (window, at) in [(1, 3000), (7, 3500), (64, 64), (64, 4992)] {
        // The run was killed at step 5000 and continues from a window before.
        let recorder = Recorder::create(&path, &about()).unwrap();
        steps(&recorder.sink(), (0, 5000), window);
        drop(recorder);
        let moment = Moment { step: at, epoch: 0 };
        let recorder = Recorder::resume(&path, &about(), moment).unwrap();
        // The handshake is repeated, and the state is restored.
        for (kind, records) in [
            (Kind::Order, Records::Order(&[1])),
            (Kind::Notice, Records::Notice(&[2])),
            (Kind::Restore, Records::Restore(&[3])),
            (Kind::Notice, Records::Notice(&[4])),
        ] {
            let channel = Channel::of(Party::Dem, kind);
            recorder.sink().note(channel, &header(0), records);
        }
        steps(&recorder.sink(), (at, 6000), 10);
        recorder.sink().sync();
        let (settled, _) = read(&path);
        recorder.finish().unwrap();
        let (messages, end) = read(&path);
        assert_eq!(settled, messages, "all of it is on disk before its end");
        assert!(matches!(end, End::Whole { .. }));
        for kind in [Kind::States, Kind::Forces] {
            assert!(of_kind(&messages, kind).into_iter().eq(0..6000), "{kind:?}");
        }
        assert!(of_kind(&messages, Kind::Order).is_empty());
        assert!(of_kind(&messages, Kind::Notice).is_empty());
        assert!(of_kind(&messages, Kind::Restore).is_empty());
        let grants = of_kind(&messages, Kind::Grant);
        assert!(grants.is_sorted() && grants.len() == of_kind(&messages, Kind::Report).len());
    }
    // The recording ends before this step.
    let far = Moment {
        step: 7000,
        epoch: 0,
    };
    let short = Recorder::resume(&path, &about(), far).unwrap_err();
    assert!(matches!(short, RecordingError::Short { step: 7000, .. }));
    let other = About::run("scene", "another", "test");
    let near = Moment {
        step: 1000,
        epoch: 0,
    };
    let foreign = Recorder::resume(&path, &other, near).unwrap_err();
    assert!(matches!(foreign, RecordingError::Foreign { .. }));
}
