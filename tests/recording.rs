//! `tandem run --record`: what crossed is kept, whatever becomes of the run, and keeping it changes nothing. And `--trace`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::harness::{HARD, Place, QUICK, RunFiles, scene};
use interface::recording::{End, Playback};

fn recording(place: &Place, out: &str) -> PathBuf {
    place.path(out).join("recording.tandem")
}

/// What a recording has: messages by channel, and how it ends.
fn content(path: &Path) -> (BTreeMap<&'static str, u64>, End) {
    let mut playback = Playback::open(path).unwrap();
    let mut messages = BTreeMap::new();
    while let Some((channel, _)) = playback.message().unwrap() {
        *messages.entry(channel.name()).or_default() += 1;
    }
    (messages, playback.end().expect("the end has been read"))
}

/// Asserts that every step of a coupled run is there, with what the coupler sent and received.
#[track_caller]
/// `clouds`: how often all points crossed. Between processes they do once at the start, so that the memory for them is there.
fn assert_whole(path: &Path, run: &RunFiles, clouds: u64) {
    let (messages, end) = content(path);
    assert!(matches!(end, End::Whole { .. }), "{end:?}");
    let steps = run.number("steps") as u64 + 2; // opening and closing
    let sets = run.number("rebuilds") as u64;
    let grants = run.number("grants") as u64;
    for (channel, expected) in [
        ("imp/forces", steps),
        ("imp/set", sets),
        ("imp/envelopes", sets),
        ("dem/grants", grants),
        ("mpm/grants", grants),
        ("dem/reports", grants),
        ("mpm/reports", grants),
        ("dem/orders", 3),
        ("mpm/orders", 3),
        ("dem/notices", 3),
        ("mpm/notices", 3),
        ("mpm/points", clouds),
    ] {
        assert_eq!(messages.get(channel), Some(&expected), "{channel}");
    }
    assert!(messages["imp/states"] >= steps + sets);
    assert_eq!(messages["mpm/groups"], messages["dem/bodies"]);
}

#[test]
fn recording_changes_nothing_and_has_everything() {
    let place = Place::new();
    place.run("plain", &scene(HARD), QUICK).expect(0);
    let plain = RunFiles::read(&place.path("plain"));
    let history = fs::read(place.path("plain").join("history.csv")).unwrap();
    assert!(!recording(&place, "plain").exists());
    for (out, how) in [("three", ""), ("one", "--in-process")] {
        let more = format!("{QUICK} --record {how}");
        let ended = place.run(out, &scene(HARD), &more).expect(0);
        place.assert_clean(&ended.runs);
        let recorded = RunFiles::read(&place.path(out));
        assert_eq!(recorded.text("state_hash"), plain.text("state_hash"));
        let path = place.path(out).join("history.csv");
        assert_eq!(fs::read(path).unwrap(), history);
        let clouds = if how.is_empty() { 2 } else { 1 };
        assert_whole(&recording(&place, out), &recorded, clouds);
    }
    // A run without it leaves none of an earlier one.
    place.run("three", &scene(HARD), QUICK).expect(0);
    assert!(!recording(&place, "three").exists());
}

/// A file that may not grow stands for a disk without room.
#[test]
fn a_recording_that_cannot_be_written_ends_the_run_with_the_reason() {
    let place = Place::new();
    let line = format!(
        "run '{}' {QUICK} --record --in-process --log json --out out",
        scene(HARD)
    );
    let ended = place.start_after("trap '' XFSZ; ulimit -f 64", &line).end();
    ended
        .expect(3)
        .says(&["cannot write the recording", "run without --record"]);
    assert!(place.temporary().is_empty());
}

/// The timeline has what each process did, and as long as the summary says; and it changes no bit.
#[test]
fn a_timeline_has_the_times_of_the_summary() {
    let place = Place::new();
    let trace = place.path("trace.json");
    for (out, more) in [("plain", ""), ("out", "--trace trace.json")] {
        let save = format!("{QUICK} --set output.checkpoint.time=2e-3 {more}");
        place.run(out, &scene(HARD), &save).expect(0);
    }
    let [plain, run] = ["plain", "out"].map(|out| RunFiles::read(&place.path(out)));
    assert_eq!(plain.text("state_hash"), run.text("state_hash"));

    let events: serde_json::Value = serde_json::from_slice(&fs::read(&trace).unwrap()).unwrap();
    let events = events.as_array().unwrap();
    let named = |name: &'static str| events.iter().filter(move |event| event["name"] == name);
    assert_eq!(named("process_name").count(), 3);
    let (sets, epochs) = (run.number("rebuilds"), run.number("epochs"));
    assert_eq!(named("new set").count() as f64, sets);
    assert_eq!(named("epoch").count() as f64, epochs);
    assert!(named("checkpoint").count() >= 2);
    for party in ["mpm", "dem"] {
        let process = named("process_name").find(|event| event["args"]["name"] == party);
        let process = &process.unwrap()["pid"];
        for what in ["compute", "exchange", "wait"] {
            let spans = named(what).filter(|event| &event["pid"] == process);
            let lengths = spans.map(|event| event["dur"].as_f64().unwrap());
            let (count, all) = lengths.fold((0, 0.0), |(n, sum), us| (n + 1, sum + us * 1e-6));
            let summary = run.summary["wall_by_part"][party][what].as_f64().unwrap();
            assert!(count > 100, "{party} {what}: {count}");
            // The last report is sent before the spans of the end.
            assert!(
                all >= summary * 0.999,
                "{party} {what}: {all} s, {summary} s"
            );
            assert!(
                all <= summary + 0.5 * run.number("wall_s"),
                "{party} {what}: {all} s, {summary} s"
            );
        }
    }
    let nowhere = format!("{QUICK} --trace no/such/folder.json");
    for out in ["out", "new"] {
        let refused = place.run(out, &scene(HARD), &nowhere);
        refused.expect(2).says(&["--trace"]);
    }
    assert!(!place.path("new").exists());
}

/// It was emptied before it was known that nothing runs.
#[test]
fn a_timeline_stays_where_nothing_runs() {
    let place = Place::new();
    let save = format!("{QUICK} --set output.checkpoint.end=true --trace trace.json");
    place.run("out", &scene(HARD), &save).expect(0);
    let before = fs::read(place.path("trace.json")).unwrap();
    let again = |more: &str, code: i32| {
        let ended = place.run("out", &scene(HARD), &format!("{save} {more}"));
        ended.expect(code);
        assert!(
            fs::read(place.path("trace.json")).unwrap() == before,
            "{more}"
        );
    };
    again("--unless-done", 0);
    again("--set start.from=out --set time.end=1", 2);
    let held = fs::File::open(place.path("out")).unwrap();
    held.try_lock().unwrap();
    again("", 2);
}
