//! The page of a run that goes on: it follows the run to its end.

use std::fs;
use std::path::PathBuf;

use crate::harness::browser::Reader;
use crate::harness::{Ended, HARD, PATIENCE, Place, Running, has, scene, signal, until};

/// A run that lasts until it is stopped, and its page.
fn begun(place: &Place) -> (Running<'_>, PathBuf) {
    let long = "--watch --report --variant quick --set time.end=1000 \
        --set output.every=1e-2 --set output.frames=1e-2";
    let mut run = place.start_run("run", &scene(HARD), long);
    run.stepping("run");
    let line = until(PATIENCE, || {
        let output = run.output();
        let line = output.lines().find(|line| line.contains("is shown at"));
        line.map(str::to_owned)
    });
    let line = line.expect("the place is shown");
    let (_, page) = line.split_once("file://").unwrap();
    assert_eq!(page, place.path("run/live.html").to_str().unwrap());
    (run, page.into())
}

/// What keeps the page up to date ends with the run.
fn nobody_is_left(place: &Place, ended: &Ended) {
    let gone = until(PATIENCE, || place.processes().is_empty().then_some(()));
    assert!(gone.is_some(), "{:?} live on", place.processes());
    place.assert_clean(&ended.runs);
}

#[test]
fn the_page_goes_on_with_the_run_and_ends_with_it() {
    let place = Place::new();
    let (run, page) = begun(&place);
    let text = || fs::read_to_string(&page).unwrap();
    let first = text();
    assert!(first.contains("Under way") && first.contains("data-again"));
    until(PATIENCE, || (text() != first).then_some(())).expect("the page goes on");
    signal(run.pid(), "INT");
    let ended = run.end().expect(130);
    nobody_is_left(&place, &ended);
    let last = text();
    assert!(last.contains("Interrupted") && !last.contains("data-again"));
}

#[test]
fn a_browser_follows_a_run_to_its_end() {
    let place = Place::new();
    let (run, page) = begun(&place);
    let Some(reader) = Reader::open(&page) else {
        return;
    };
    // Between two pages there is no answer.
    let ask = |what: &str| until(PATIENCE, || reader.ask_if_ready(what)).expect(what);
    let number = |what: &str| ask(what).as_f64().expect(what);
    // Not their number, which a long run's page keeps below a bound.
    let newest = || number("window.tandem.player?.times.at(-1) ?? 0");
    let newer = |than: f64| {
        let found = until(PATIENCE, || Some(newest()).filter(|&time| time > than));
        found.expect("newer frames are shown")
    };
    newer(newer(0.0));
    // Who looks at the last frame stays with the run; who looks at another one stays there. Asked at once: the page goes on.
    let at_the_end = "window.tandem.player.place === window.tandem.player.times.length - 1";
    assert_eq!(ask(at_the_end), true);
    let time = number("(window.tandem.player.show(1), window.tandem.player.time)");
    newer(newest());
    // A page that leaves frames out shows the nearest one.
    let off = format!("Math.abs(window.tandem.player.time - {time})");
    let nearest = format!("Math.min(...window.tandem.player.times.map(t => Math.abs(t - {time})))");
    assert_eq!(ask(&format!("{off} === {nearest}")), true);
    let status = || ask("document.querySelector('.verdict').textContent");
    has(status().as_str().unwrap(), "Under way");
    signal(run.pid(), "INT");
    let ended = run.end().expect(130);
    let last = until(PATIENCE, || {
        (ask("document.documentElement.dataset.again ?? null").is_null()).then_some(())
    });
    assert!(last.is_some(), "the page does not hear of the end");
    has(status().as_str().unwrap(), "Interrupted");
    assert_eq!(ask(&format!("{off} === {nearest}")), true);
    assert!(reader.pixels().0 > 5, "the stage is blank");
    reader.screenshot("watch");
    reader.assert_silent();
    nobody_is_left(&place, &ended);
}

#[test]
fn a_run_that_has_ended_is_not_watched() {
    let place = Place::new();
    let ended = place.run("run", &scene(HARD), "--variant quick --in-process");
    ended.expect(0);
    for dir in ["run", "elsewhere"] {
        let ended = place.tandem(&format!("watch {dir}")).expect(2);
        ended.says(&["no run goes on in", "tandem report"]);
    }
}
