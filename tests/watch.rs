//! The page of a run that goes on: a browser follows it to its end, nobody without the token sees it, and it ends with the run.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;

use crate::harness::browser::Reader;
use crate::harness::{Ended, PATIENCE, Place, Running, scene, signal, until};

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
/// The server ends with the run.
fn nobody_is_left(place: &Place, ended: &Ended) {
    let gone = until(PATIENCE, || place.processes().is_empty().then_some(()));
    assert!(gone.is_some(), "{:?} live on", place.processes());
    place.assert_clean(&ended.runs);
}

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
        ("/news", None, "GET", "403"),
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
    nobody_is_left(&place, &ended);
}

#[test]
fn a_browser_follows_a_run_to_its_end() {
    let place = Place::new();
    let (run, address) = begun(&place);
    let origin = &address[..=address.rfind('/').unwrap()];
    let Some(reader) = Reader::go(&address, origin) else {
        return;
    };
    // Not their number, which a long run's page keeps below a bound.
    let newest = || reader.number("window.tandem?.player?.times.at(-1) ?? 0");
    let newer = |than: f64| {
        let found = until(PATIENCE, || Some(newest()).filter(|&time| time > than));
        found.expect("newer frames are shown")
    };
    newer(newer(0.0));
    // Who looks at the last frame stays with the run; who looks at another one stays there. Asked at once: the page goes on.
    let at_the_end = "tandem.player.place === tandem.player.times.length - 1";
    assert_eq!(reader.ask(at_the_end), true);
    let time = reader.number("(tandem.player.show(1), tandem.player.time)");
    newer(newest());
    // A page that leaves frames out shows the nearest one.
    let off = format!("Math.abs(tandem.player.time - {time})");
    let nearest = format!("Math.min(...tandem.player.times.map(t => Math.abs(t - {time})))");
    assert_eq!(reader.ask(&format!("{off} === {nearest}")), true);
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
    nobody_is_left(&place, &ended);
}

/// A length of 1e12 ended the server with SIGABRT, 2^64 - 1 a thread of it, 625 idle connections all of it, and a slow
/// request stayed for ever.
#[test]
fn what_the_server_hears_has_limits() {
    let place = Place::new();
    let (run, address) = begun(&place);
    let own = &address[address.rfind('/').unwrap()..];
    let at = address.strip_prefix("http://").unwrap();
    let at = &at[..at.find('/').unwrap()];
    let connect = || TcpStream::connect(at).unwrap();
    for target in ["/", own] {
        for length in [
            "999999999999",
            "18446744073709551615",
            "99999999999999999999",
            "-1",
        ] {
            let mut stream = connect();
            let head = format!(
                "POST {target} HTTP/1.1\r\nHost: {at}\r\nContent-Length: {length}\r\n\r\nx"
            );
            stream.write_all(head.as_bytes()).unwrap();
            let mut answer = String::new();
            // Who has said too much may be cut off.
            let _ = stream.read_to_string(&mut answer);
            let refused = answer.is_empty() || answer.starts_with("HTTP/1.1 4");
            assert!(refused, "{length}: {answer}");
        }
    }
    // A head without an end, and connections that say nothing.
    let mut endless = connect();
    let _ = endless.write_all(b"GET / HTTP/1.1\r\n").and_then(|()| {
        (0..100_000).try_for_each(|k| endless.write_all(format!("X-{k}: y\r\n").as_bytes()))
    });
    let mut slow = connect();
    slow.write_all(b"GET / HT").unwrap();
    let idle: Vec<_> = (0..700)
        .map_while(|_| TcpStream::connect(at).ok())
        .collect();
    assert!(idle.len() > 100, "{}", idle.len());
    let mut rest = String::new();
    let _ = slow.read_to_string(&mut rest);
    assert!(!rest.contains("200"), "{rest}");
    // The others are cut off too, and then there is room.
    let answered = until(PATIENCE, || {
        let mut stream = TcpStream::connect(at).ok()?;
        let head = format!("GET {own} HTTP/1.1\r\nHost: {at}\r\nConnection: close\r\n\r\n");
        stream.write_all(head.as_bytes()).ok()?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).ok()?;
        answer.starts_with("HTTP/1.1 200").then_some(())
    });
    assert!(answered.is_some(), "the server answers nobody");
    drop(idle);
    signal(run.pid(), "INT");
    let ended = run.end().expect(130);
    nobody_is_left(&place, &ended);
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
