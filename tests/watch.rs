//! The page of a run that goes on: a browser follows it to its end, nobody without the token sees it, and it ends with the run.

#[path = "harness/browser.rs"]
mod browser;
mod harness;

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;

use browser::Reader;
use harness::{PATIENCE, Place, Running, scene, signal, until};

const HARD: &str = "jiang2020/collision_hard";

/// A run that lasts until it is stopped, and the address of its page.
fn begun(place: &Place) -> (Running<'_>, String) {
    let long = [
        "--watch",
        "--report",
        "--variant",
        "quick",
        "--set",
        "time.end=1000",
        "--set",
        "output.every=1e-2",
        "--set",
        "output.frames=1e-2",
    ];
    let mut run = place.start_run("run", &scene(HARD), &long);
    run.stepping("run");
    let line = until(PATIENCE, || {
        let said = run.said();
        let line = said.lines().find(|line| line.contains("is shown at"));
        line.map(str::to_owned)
    });
    let line = line.expect("the address is said");
    let address = line.split_whitespace().last().unwrap().to_owned();
    (run, address)
}

/// The status line and the text of an answer.
fn get(address: &str, target: &str, host: Option<&str>, method: &str) -> (String, String) {
    let place = address.strip_prefix("http://").unwrap();
    let place = &place[..place.find('/').unwrap()];
    let mut stream = TcpStream::connect(place).unwrap();
    let host = host.unwrap_or(place);
    write!(
        stream,
        "{method} {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let status = answer.lines().next().unwrap_or_default().to_owned();
    (status, answer)
}

#[test]
fn only_who_has_the_token_sees_a_run_and_nobody_changes_it() {
    let place = Place::new();
    let (run, address) = begun(&place);
    let own = &address[address.rfind('/').unwrap()..];
    let before = fs::read_to_string(place.path("run/scene.toml")).unwrap();
    for (target, host, method, status) in [
        (own, None, "GET", "200"),
        ("/", None, "GET", "403"),
        ("/?token=0", None, "GET", "403"),
        ("/events", None, "GET", "403"),
        (own, Some("elsewhere.example"), "GET", "403"),
        (own, None, "POST", "405"),
        (&own.replace("/?", "/../scene.toml?"), None, "GET", "404"),
    ] {
        let (said, text) = get(&address, target, host, method);
        assert!(said.contains(status), "{method} {target}: {said}");
        assert_eq!(text.contains("collision_hard"), status == "200", "{target}");
    }
    assert!(address.starts_with("http://127.0.0.1:"), "{address}");
    assert_eq!(
        fs::read_to_string(place.path("run/scene.toml")).unwrap(),
        before
    );
    signal(run.pid(), "INT");
    let ended = run.end().expect(130);
    // The server ends with the run: nobody follows it.
    let gone = until(PATIENCE, || place.processes().is_empty().then_some(()));
    assert!(gone.is_some(), "{:?} live on", place.processes());
    place.assert_clean(&ended.runs);
}

#[test]
fn a_browser_follows_a_run_to_its_end() {
    let place = Place::new();
    let (run, address) = begun(&place);
    let origin = &address[..=address.rfind('/').unwrap()];
    let Some(reader) = Reader::go(&address, origin) else {
        return;
    };
    let frames = || reader.number("window.tandem?.player?.times.length ?? 0");
    let first = until(PATIENCE, || (frames() > 1.0).then(&frames)).expect("the motion is shown");
    let more = until(PATIENCE, || (frames() > first).then_some(()));
    assert!(more.is_some(), "no new frames are shown");
    // Who looks at the last frame stays with the run; who looks at another one stays there.
    assert_eq!(
        reader.number("tandem.player.place"),
        reader.number("tandem.player.times.length - 1")
    );
    let time = reader.number("(tandem.player.show(1), tandem.player.time)");
    let known = frames();
    assert!(until(PATIENCE, || (frames() > known).then_some(())).is_some());
    // A long run's page leaves frames out, this one too: then the nearest one is shown.
    let off = format!("Math.abs(tandem.player.time - {time})");
    let nearest = format!("Math.min(...tandem.player.times.map(t => Math.abs(t - {time})))");
    assert_eq!(reader.number(&off), reader.number(&nearest));
    assert!(reader.pixels().0 > 5, "the stage is blank");
    let status = || reader.ask("document.querySelector('.verdict').textContent");
    assert!(
        status().as_str().unwrap().contains("Under way"),
        "{}",
        status()
    );
    reader.screenshot("watch");
    signal(run.pid(), "INT");
    let ended = run.end().expect(130);
    let last = until(PATIENCE, || {
        (reader.ask("document.documentElement.dataset.live") == "ended").then_some(())
    });
    assert!(last.is_some(), "the page does not hear of the end");
    assert!(
        status().as_str().unwrap().contains("Interrupted"),
        "{}",
        status()
    );
    reader.assert_silent();
    let gone = until(PATIENCE, || place.processes().is_empty().then_some(()));
    assert!(gone.is_some(), "{:?} live on", place.processes());
    place.assert_clean(&ended.runs);
}

#[test]
fn a_run_that_has_ended_is_not_watched() {
    let place = Place::new();
    place
        .run("run", &scene(HARD), &["--variant", "quick", "--in-process"])
        .expect(0);
    for dir in ["run", "elsewhere"] {
        let ended = place.start(&["watch", dir]).end().expect(2);
        ended.says(&["no run goes on in", "tandem report"]);
    }
}
