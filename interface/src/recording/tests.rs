use std::fs;

use super::*;
use crate::message::control::Party;
use crate::message::wire::ImpState;
use crate::message::{Kind, Message, Records};
use crate::packed::{self, BlockSize};
use crate::transport::TransportError;
use crate::transport::domain::OwnedDomain;
use crate::transport::iceoryx;
use core::time::Duration;

fn states_channel() -> Channel {
    Channel::of(Party::Mpm, Kind::States)
}

fn about() -> About {
    About::run("scene", "hash")
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
        ..ImpState::default()
    }
}

fn create(path: &Path, about: &About) -> Recorder {
    Recorder::create(fs::File::create(path).unwrap(), path, about).unwrap()
}

/// Writes a recording of so many messages, with or without its end.
fn write(path: &Path, messages: u64, ended: bool) {
    let recorder = create(path, &about());
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

fn read(path: &Path) -> (Vec<(Channel, Message)>, End) {
    let mut playback = Playback::open(path).unwrap();
    let mut messages = Vec::new();
    while let Some(message) = playback.message().unwrap() {
        messages.push(message);
    }
    (messages, playback.end().unwrap())
}

fn assert_first(messages: &[(Channel, Message)]) {
    for (step, (channel, message)) in (0..).zip(messages) {
        assert_eq!(channel.name(), "imp/states");
        assert_eq!(message.header, header(step));
        let [read] = *message.payload.of::<ImpState>() else {
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
    let recorder = create(&path, &about());
    let states: Vec<_> = (0..100_000).map(state).collect();
    for _ in 0..3 {
        recorder
            .sink()
            .note(states_channel(), &header(0), Records::States(&states));
    }
    recorder.finish().unwrap();
    let (messages, end) = read(&path);
    assert_eq!(end, End::Whole { messages: 3 });
    assert_eq!(messages[2].1.payload.len(), 100_000);
}

#[test]
fn without_its_end_a_recording_is_torn_and_its_prefix_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    write(&path, 30_000, false);
    let whole = fs::read(&path).unwrap();
    let (messages, end) = read(&path);
    assert_first(&messages);
    let written = messages.len() as u64;
    assert_eq!(end, End::Torn { messages: written });
    for cut in [1, 4, 8, 9, whole.len() / 3] {
        fs::write(&path, &whole[..whole.len() - cut]).unwrap();
        let (messages, end) = read(&path);
        assert_first(&messages);
        let End::Torn { messages: intact } = end else {
            panic!("{end:?}");
        };
        assert!(intact == messages.len() as u64 && intact < written);
    }
}

/// A length that was changed to more than follows ends like a file that was cut.
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
        let end = Playback::verify(&path);
        let torn = |messages| matches!(end, Ok(End::Torn { messages: whole }) if whole < messages);
        assert!(end.is_err() || torn(20), "byte {at}: {end:?}");
    }
    let mut longer = whole.clone();
    longer.push(0);
    fs::write(&path, longer).unwrap();
    let message = Playback::verify(&path).unwrap_err().to_string();
    assert!(message.contains("after the end"), "{message}");
}

#[test]
fn files_that_are_not_recordings_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    for text in ["", "short", "name,x [m],y [m],angle [rad]\nfloor,0,0,0\n"] {
        fs::write(&path, text).unwrap();
        let message = Playback::verify(&path).unwrap_err().to_string();
        assert!(message.contains("is not a recording"), "{message}");
    }
    let mut other = about();
    other.made.layout = "0123456789abcdef".into();
    create(&path, &other).finish().unwrap();
    let message = Playback::verify(&path).unwrap_err().to_string();
    assert!(
        message.contains("layout 0123456789abcdef, this is"),
        "{message}"
    );
}

/// `/dev/full` is a disk without room.
#[test]
fn a_full_disk_is_reported_and_delays_nothing() {
    let path = Path::new("/dev/full");
    let full = fs::OpenOptions::new().write(true).open(path).unwrap();
    let Err(error) = Recorder::create(full, path, &about()) else {
        panic!("the first write finds out");
    };
    assert!(error.to_string().contains("No space left"), "{error}");
}

/// A run whose tap was late by 64 messages lost some, and its recording could not be replayed.
#[test]
fn a_tap_that_has_looked_once_misses_nothing() {
    let domain = OwnedDomain::create().unwrap();
    let (names, parties) = (domain.domain(), [Party::Mpm, Party::Dem]);
    let _channels = iceoryx::create(names, &parties, true).unwrap();
    let join = |party| {
        let patience = Duration::from_millis(20);
        let mut ends = iceoryx::join(names, party, &parties, patience).unwrap();
        ends.open(&[states_channel()]).unwrap();
        ends
    };
    let mut tap = iceoryx::listen(names).unwrap();
    let [mut mpm, mut dem] = parties.map(join);
    let mut sent = |step| {
        let records = [state(step)];
        mpm.send(states_channel(), &header(step), Records::States(&records))?;
        Ok::<_, TransportError>(dem.take(states_channel())?.is_some())
    };
    let mut heard = || {
        core::iter::from_fn(|| tap.take(states_channel()).unwrap())
            .map(|message| message.header.step)
            .collect::<Vec<_>>()
    };
    // Before its first look it gets what its buffer holds, and the sender does not notice.
    for step in 0..70 {
        assert!(sent(step).unwrap());
    }
    assert_eq!(heard(), (0..64).collect::<Vec<_>>());
    // From then on the sender waits for it.
    for step in 0..64 {
        assert!(sent(step).unwrap());
    }
    assert!(matches!(sent(64), Err(TransportError::Full { .. })));
    assert_eq!(heard(), (0..64).collect::<Vec<_>>());
}

#[test]
fn after_an_error_nothing_waits_for_the_disk() {
    let dir = tempfile::tempdir().unwrap();
    let recorder = create(&dir.path().join("r"), &about());
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
fn a_message_that_announces_more_than_follows_is_torn() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("r");
    let mut packer = packed::packer(packed::head(NAME, &about()), BlockSize::Max64KB);
    let announced = [&[0][..], &u32::MAX.to_le_bytes(), &[0; 48], &[7; 8]].concat();
    std::io::Write::write_all(&mut packer, &announced).unwrap();
    fs::write(&path, packer.finish().unwrap()).unwrap();
    assert_eq!(Playback::verify(&path).unwrap(), End::Torn { messages: 0 });
}
