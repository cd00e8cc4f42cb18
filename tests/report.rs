//! The page of a run, opened in a real browser: it shows what the run has left, plays, and asks nobody for anything.
//!
//! The browser is Chromium (`apt-get install chromium`; `.ci/run` does it), found on the PATH or named by `CHROME`. Without it
//! these tests are left out.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use crate::harness::browser::Reader;
use crate::harness::{HARD, Place, RunFiles, has, scene};
use coupler::record::frames::FrameList;
use serde_json::Value;

/// Widths in pixels: a phone, a tablet, a desk.
const WIDTHS: [u32; 3] = [360, 800, 1400];
/// The quick collision with its report, and the output of the program.
fn collision(place: &Place) -> (PathBuf, String) {
    let ended = place.run("run", &scene(HARD), "--variant quick --report");
    let ended = ended.expect(0);
    (place.path("run"), ended.stdout)
}

#[test]
fn a_run_ends_with_a_page_that_plays() {
    let place = Place::new();
    let (run, stdout) = collision(&place);
    let page = run.join("report.html");
    let line = stdout.lines().find(|line| line.starts_with("report in "));
    assert!(
        line.is_some_and(|line| line.contains("report.html (")),
        "{stdout}"
    );
    assert!(fs::metadata(&page).unwrap().len() < 5_000_000);
    let log = fs::read_to_string(run.join("log.jsonl")).unwrap();
    let end: Value = serde_json::from_str(log.lines().next_back().unwrap()).unwrap();
    assert_eq!(end["fields"]["message"], "ends");
    let ended = format!(
        "<dt>Ended</dt><dd>{}</dd>",
        end["timestamp"].as_str().unwrap()
    );
    has(&fs::read_to_string(&page).unwrap(), &ended);
    let Some(reader) = Reader::open(&page) else {
        return;
    };
    for id in [
        "motion", "checks", "energy", "step", "time", "history", "log", "scene", "details",
    ] {
        assert_eq!(
            reader.number(&format!("document.querySelectorAll('#{id} h2').length")),
            1.0
        );
    }
    let mut screens = BTreeSet::new();
    for width in WIDTHS {
        for dark in [false, true] {
            reader.look(width, dark);
            reader.ask("(tandem.player.show(0), 1)");
            let start = reader.pixels();
            // The slider moves the picture: what its own handler hears is what a hand does.
            reader.ask(
                "(() => { const s = document.getElementById('scrub'); s.value = Math.round(s.max / 2); \
                 s.dispatchEvent(new Event('input')); return 1; })()",
            );
            let middle = reader.pixels();
            assert!(
                start.0 > 5 && middle.0 > 20,
                "{width}: {start:?} {middle:?}"
            );
            assert_ne!(start.1, middle.1, "{width}: the slider moves nothing");
            reader.ask("(scrollTo(0, 0), 1)");
            let scheme = if dark { "dark" } else { "light" };
            screens.insert(reader.screenshot(&format!("{width}-{scheme}")));
            let overflow = "document.scrollingElement.scrollWidth - innerWidth";
            assert!(
                reader.number(overflow) <= 0.0,
                "{width}: the page is wider than the screen"
            );
            assert_eq!(reader.ask(OVERLAPS), serde_json::json!([]), "{width}");
        }
    }
    assert_eq!(screens.len(), 6, "each width and scheme has its own look");
    reader.assert_silent();
}

/// Words in a chart that lie on one another, and charts without words.
const OVERLAPS: &str = "(() => { const bad = []; \
     for (const svg of document.querySelectorAll('.chart svg')) { \
       const boxes = [...svg.querySelectorAll('text')].map((t) => [t.textContent, t.getBoundingClientRect()]); \
       if (boxes.length < 4) bad.push('a chart without words'); \
       boxes.forEach(([a, p], i) => boxes.slice(i + 1).forEach(([b, q]) => { \
         if (p.left < q.right && q.left < p.right && p.top + 2 < q.bottom && q.top + 2 < p.bottom) bad.push(`${a} on ${b}`); })); } \
     return bad; })()";

#[test]
fn the_page_shows_what_the_frames_hold() {
    let place = Place::new();
    let (run, _) = collision(&place);
    let Some(reader) = Reader::open(&run.join("report.html")) else {
        return;
    };
    let times: Vec<f64> = serde_json::from_value(reader.ask("tandem.player.times")).unwrap();
    assert_eq!(times, FrameList::read(&run).unwrap().times());
    assert!(times.len() > 50, "a report makes frames");
    for place in [0, times.len() / 3, times.len() - 1] {
        let frame = FrameList::read(&run).unwrap().frame(times[place]).unwrap();
        let there: Vec<[f64; 2]> = serde_json::from_value(reader.ask(&format!(
            "(() => {{ const p = tandem.player.stages[0].motion.points, n = {place} * p.count; \
             return Array.from({{length: p.count}}, (_, k) => \
             [p.place.x + p.place.dx * p.x[n + k], p.place.y + p.place.dy * p.y[n + k]]); }})()"
        )))
        .unwrap();
        let mut ours = frame.points.unwrap().points;
        let mut shown = there;
        assert_eq!(ours.len(), shown.len());
        // In the order of y along rows of x, which the disc has thousands of: compare sums and extremes instead of pairs.
        for axis in [0, 1] {
            ours.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
            shown.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
            for (a, b) in ours.iter().zip(&shown) {
                assert!(
                    (a[axis] - b[axis]).abs() < 5e-6,
                    "{place}: {} {}",
                    a[axis],
                    b[axis]
                );
            }
        }
        let middle: [f64; 2] = serde_json::from_value(reader.ask(&format!(
            "(() => {{ const b = tandem.player.stages[0].motion.bodies, k = {place} * b.count; \
             return [b.place.x + b.place.dx * b.x[k], b.place.y + b.place.dy * b.y[k]]; }})()"
        )))
        .unwrap();
        let outline = frame.bodies.unwrap();
        let outline = outline.cells().next().unwrap();
        let x = outline.iter().map(|p| p[0]).sum::<f64>() / outline.len() as f64;
        assert!((middle[0] - x).abs() < 5e-6, "{middle:?} {x}");
    }
    reader.assert_silent();
}

#[test]
fn the_player_is_played_by_keys_and_colours_by_choice() {
    let place = Place::new();
    let (run, _) = collision(&place);
    let Some(reader) = Reader::open(&run.join("report.html")) else {
        return;
    };
    reader.look(800, false);
    let at = || reader.number("tandem.player.place");
    reader.ask("(document.getElementById('player').focus(), 1)");
    reader.press("ArrowRight");
    reader.press("ArrowRight");
    reader.press("ArrowLeft");
    assert_eq!(at(), 1.0);
    reader.press("End");
    assert_eq!(at(), reader.number("tandem.player.times.length - 1"));
    reader.press("Home");
    assert_eq!(at(), 0.0);
    reader.press(" ");
    let moved = crate::harness::until(crate::harness::PATIENCE, || (at() > 2.0).then_some(()));
    assert!(moved.is_some(), "it does not play");
    reader.press(" ");
    let stopped = at();
    reader.look(801, false);
    assert_eq!(at(), stopped, "it does not pause");
    let fields = reader.ask("[...document.getElementById('field').options].map((o) => o.value)");
    let fields: Vec<String> = serde_json::from_value(fields).unwrap();
    assert!(fields.len() >= 4 && fields[0] == "speed", "{fields:?}");
    reader.ask("(tandem.player.show(30), 1)");
    let choose = |field: &str| {
        reader.ask(&format!(
            "(() => {{ const f = document.getElementById('field'); f.value = '{field}'; f.dispatchEvent(new Event('change')); return 1; }})()"
        ));
        (
            reader.pixels(),
            reader.ask("document.querySelector('#bar').textContent"),
        )
    };
    let [speed, pressure] = ["speed", "pressure"].map(choose);
    assert_ne!(speed.0, pressure.0, "the colours do not change");
    assert_ne!(speed.1, pressure.1, "the colour bar does not change");
    // The toggle wins over the system.
    let ground = "getComputedStyle(document.body).backgroundColor";
    let light = reader.ask(ground);
    reader.ask("(document.getElementById('theme').click(), 1)");
    assert_ne!(light, reader.ask(ground));
    reader.assert_silent();
}

/// Names and words of a scene are text wherever they stand, not markup.
#[test]
fn nothing_of_a_scene_becomes_markup() {
    let place = Place::new();
    let text = fs::read_to_string(scene(HARD)).unwrap();
    let evil = "</script><script>document.title='taken'</script><img src=x onerror=document.title='taken'>&amp;";
    let text = text
        .replace(
            "name = \"no energy is created\"",
            &format!("name = \"{evil}\""),
        )
        .replace(
            "name = \"v_disc\"\nunit = \"m/s\"",
            &format!("name = \"v_disc\"\nunit = \"{evil}\""),
        )
        .replace("about = \"A hard", &format!("about = \"{evil} A hard"))
        .replace("v_target\"]", "v_target\"] # </script>");
    place.write("evil.toml", &text);
    place.run("run", "evil.toml", "--variant quick").expect(0);
    let run = place.path("run");
    let mut summary = RunFiles::read(&run).summary;
    summary["reason"] = evil.into();
    fs::write(run.join("summary.json"), summary.to_string()).unwrap();
    let line = serde_json::json!({"timestamp": evil, "level": evil, "fields": {"message": evil}});
    fs::write(run.join("log.jsonl"), format!("{line}\n")).unwrap();
    place.tandem("report run").expect(0);
    let Some(reader) = Reader::open(&run.join("report.html")) else {
        return;
    };
    let title = reader.ask("document.title");
    assert_eq!(title, "collision_hard · Tandem report");
    for place in [
        ".checks th",
        ".about",
        ".multiples .axis-title",
        "#scene code",
        ".outcome .reason",
        ".log",
    ] {
        let texts = format!(
            "[...document.querySelectorAll('{place}')].map((e) => e.textContent).join(' ')"
        );
        let texts = reader.ask(&texts);
        assert!(texts.as_str().unwrap().contains(evil), "{place}: {texts}");
    }
    assert_eq!(
        reader.number("document.querySelectorAll('img').length"),
        0.0
    );
    reader.assert_silent();
}

#[test]
fn runs_stand_beside_one_another() {
    let place = Place::new();
    collision(&place);
    let more = "--variant quick --report --set time.end=0.004";
    // Too short for the collision to be over: its checks fail, and it has its page all the same.
    place.run("short", &scene(HARD), more).expect(1);
    assert!(place.path("short").join("report.html").exists());
    let table = place.tandem("report run --out run/history.csv").expect(2);
    table.says(&["--out", "end its name with .html"]);
    place.tandem("report run short --out both.html").expect(0);
    let Some(reader) = Reader::open(&place.path("both.html")) else {
        return;
    };
    for width in WIDTHS {
        reader.look(width, false);
        let overflow = "document.scrollingElement.scrollWidth - innerWidth";
        assert!(reader.number(overflow) <= 0.0, "{width}");
        reader.ask("(tandem.player.seek(0.003), 1)");
        reader.screenshot(&format!("both-{width}"));
    }
    assert_eq!(
        reader.number("document.querySelectorAll('canvas').length"),
        2.0
    );
    assert_eq!(
        reader.number("document.querySelectorAll('.compare thead th').length"),
        3.0
    );
    // What fails comes first, whichever run it is of.
    assert_eq!(
        reader.ask("document.querySelector('.checks tbody tr').className"),
        "fail"
    );
    let frames = reader.ask("tandem.player.stages.map((s) => s.motion.times[s.frame])");
    let frames: Vec<f64> = serde_json::from_value(frames).unwrap();
    assert!(
        frames.iter().all(|t| (t - 0.003).abs() < 1e-9),
        "{frames:?}"
    );
    reader.assert_silent();
}

/// A run that a solver's end has cut short has its cause at the top; one that was killed is shown as far as it has come.
#[test]
fn a_run_that_failed_says_why_at_the_top() {
    let place = Place::new();
    // Steps that are far beyond what this contact allows (tests/instability.rs).
    let step = "--set time.step_factor=20 --set time.max_step=3.9e-6";
    let more =
        format!("--variant quick --report {step} --set contact.linear.normal_stiffness=6e10");
    place.run("run", &scene(HARD), &more).expect(4);
    let files = RunFiles::read(&place.path("run"));
    let reason = files.summary["reason"].as_str().unwrap().to_owned();
    let Some(reader) = Reader::open(&place.path("run").join("report.html")) else {
        return;
    };
    reader.look(800, false);
    let top = reader.ask("document.querySelector('.outcome').textContent");
    assert!(top.as_str().unwrap().contains(&reason), "{top}");
    assert!(
        reader.number("document.querySelector('.outcome').getBoundingClientRect().top") < 400.0
    );
    assert_eq!(
        reader.ask("document.querySelectorAll('.badge.open').length"),
        4
    );
    reader.screenshot("failed");
    reader.assert_silent();
}

#[test]
fn what_is_left_of_a_killed_run_is_shown() {
    let place = Place::new();
    let (run, _) = collision(&place);
    for file in [
        "summary.json",
        "report.html",
        "course.csv",
        "frames/frames.pvd",
    ] {
        fs::remove_file(run.join(file)).unwrap();
    }
    let history = fs::read_to_string(run.join("history.csv")).unwrap();
    fs::write(run.join("history.csv"), &history[..history.len() / 2]).unwrap();
    place.tandem("report run").expect(0);
    let Some(reader) = Reader::open(&run.join("report.html")) else {
        return;
    };
    let text = reader.ask("document.body.innerText");
    let text = text.as_str().unwrap();
    for words in [
        "has not come to its end",
        "kept no frames",
        "in the middle of a row",
    ] {
        assert!(text.contains(words), "{words}");
    }
    assert_eq!(
        reader.number("document.querySelectorAll('canvas').length"),
        0.0
    );
    assert!(reader.number("document.querySelectorAll('#history svg path').length") >= 7.0);
    reader.assert_silent();
}

#[test]
fn what_is_no_run_is_refused_and_nothing_is_written() {
    let place = Place::new();
    fs::create_dir(place.path("empty")).unwrap();
    for name in ["empty", "missing"] {
        let ended = place.tandem(&format!("report {name}")).expect(2);
        ended.says(&["name a run directory"]);
        assert!(!place.path(name).join("report.html").exists());
    }
}

/// The frames of a report lie between the rows of the history: no bit of the run is another one.
#[test]
fn a_report_changes_no_bit_of_a_run() {
    let place = Place::new();
    for (out, more) in [("with", "--report"), ("without", "--window 1")] {
        let ended = place.run(out, &scene(HARD), &format!("--variant quick {more}"));
        ended.expect(0);
    }
    let [with, without] = ["with", "without"].map(|out| RunFiles::read(&place.path(out)));
    assert_eq!(with.summary["state_hash"], without.summary["state_hash"]);
    assert_eq!(with.summary["steps"], without.summary["steps"]);
    assert!(!place.path("without").join("report.html").exists());
    assert!(!place.path("without").join("frames").exists());
    let course = |out: &str| fs::read_to_string(place.path(out).join("course.csv")).unwrap();
    assert_eq!(course("with"), course("without"));
}

/// 1e5 points and 200 frames of sand that begins to slide.
#[test]
#[ignore = "a minute, and a gigabyte on disk"]
fn a_large_run_is_small_and_quick() {
    let place = Place::new();
    let scene = scene("verification/column_collapse");
    let large = "--set mpm.points.0.spacing.counts=[224,447] --set time.end=0.1 --set check=[] \
        --set output.every=5e-4 --set output.frames=5e-4 --in-process";
    place.run("run", &scene, large).expect(0);
    let (page, began) = (place.path("big.html"), std::time::Instant::now());
    place.tandem("report run --out big.html").expect(0);
    let (made, size) = (began.elapsed(), fs::metadata(&page).unwrap().len());
    let Some(reader) = Reader::open(&page) else {
        return;
    };
    reader.look(1400, false);
    let ready = reader.number("tandem.ready");
    println!("made in {made:?}, {size} bytes, ready after {ready:.0} ms");
    assert!(size < 5_000_000 && made < Duration::from_secs(10) && ready < 2000.0);
    reader.screenshot("big");
    reader.assert_silent();
}
