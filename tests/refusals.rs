//! Bad input ends with exit 2 before anything is started, with words that say what to do, and leaves nothing behind.

use std::fs;

use crate::harness::{Ended, HARD, Place, RunFiles, scene};

/// The scene's text with one thing replaced.
fn with(original: &str, replacement: &str) -> String {
    let text = fs::read_to_string(scene(HARD)).unwrap();
    assert!(text.contains(original), "the scene has no `{original}`");
    text.replacen(original, replacement, 1)
}

/// Runs what is to be refused: exit 2, and everything is as before.
#[track_caller]
fn refused(place: &Place, line: &str) -> Ended {
    let before = place.content();
    let ended = place.tandem(line).expect(2);
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
    assert_eq!(ended.stdout, "", "what is wrong goes to standard error");
    assert_eq!(place.content(), before, "something was left behind");
    assert!(ended.runs.is_empty(), "a run was begun");
    place.assert_clean(&ended.runs);
    ended
}

/// Discs that were put into one another flew apart without a word before.
#[test]
fn what_presses_at_the_start_is_told() {
    let place = Place::new();
    for (x, is_refused) in [("0.042", false), ("0.039", true)] {
        let text = with("position = [0.042, 0.0]", &format!("position = [{x}, 0.0]"));
        place.write("near.toml", &text);
        for line in ["check near.toml", "plan near.toml"] {
            let ended = place.tandem(line).expect(0);
            let phrase = "overlaps body `target` by";
            assert_eq!(
                ended.stdout.contains(phrase),
                is_refused,
                "{}",
                ended.stdout
            );
        }
    }
}

#[test]
fn an_output_directory_that_cannot_be_written_is_refused() {
    let place = Place::new();
    place.write("file", "not a directory");
    let run = |out: &str| {
        let line = format!("run '{}' --variant quick --out {out}", scene(HARD));
        refused(&place, &line)
    };
    for out in ["file", "file/run", "file/a/b/run"] {
        run(out).says(&["cannot create the run directory", out]);
    }
    assert_eq!(
        fs::read_to_string(place.path("file")).unwrap(),
        "not a directory"
    );
    // A directory where a file of the run belongs.
    fs::create_dir_all(place.path("taken/summary.json")).unwrap();
    run("taken").says(&["taken/summary.json"]);
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let place = Place::new();
    let run = |option: &str| {
        let line = format!("run '{}' --out out {option}", scene(HARD));
        refused(&place, &line)
    };
    run("--window 0").says(&["--window", "'0'"]);
    run("--window -1").says(&["-1"]);
    run("--threads 0").says(&["--threads"]);
    run("--wndow 8").says(&["--wndow", "--window"]);
    run("--dem \\'").says(&["--dem", "not a command"]);
    run("--mpm ''").says(&["--mpm", "not a command"]);
    run("--dem x --in-process").says(&["--dem", "--in-process", "cannot be used with"]);
    run("--set solvers.dem=x --in-process").says(&[
        "--in-process",
        "`--set solvers.dem=built-in` selects the built-in one",
    ]);
}

#[test]
fn a_run_that_does_not_exist_is_not_joined() {
    let place = Place::new();
    for solver in ["mpm", "dem"] {
        let joined = |run: &str| place.tandem(&format!("{solver} --join {run}")).expect(3);
        joined("0123abcd").says(&["there is no run `0123abcd` to join"]);
        joined("../../etc");
    }
}

/// What only a solver can know ends with exit 3, the solver's name, the key, and what would be accepted.
#[test]
fn a_refusal_by_a_solver_names_the_key() {
    let place = Place::new();
    let root_of_what_is_negative = "mpm.points.0.velocity=[\"sqrt(-1-x^2)\", 0.0]";
    let set = format!("--variant quick --set '{root_of_what_is_negative}'");
    let ended = place.tandem(&format!("run '{}' --out out {set}", scene(HARD)));
    let ended = ended.expect(3);
    place.assert_clean(&ended.runs);
    let refusal = "the mpm refuses `mpm.points.0.velocity`";
    let count = ended.stderr.matches(refusal).count();
    assert_eq!(count, 1, "{}", ended.stderr);
    assert_eq!(ended.stdout, "", "there are no results");
    assert!(!place.path("out").exists(), "it left a directory");
    ended.says(&[
        "it must be finite at every point",
        "--set mpm.points.0.velocity",
    ]);
    // The result of an earlier run stays.
    place.run("out", &scene(HARD), "--variant quick").expect(0);
    let ended = place.run("out", &scene(HARD), &set);
    ended.expect(3).says(&[refusal]);
    assert_eq!(RunFiles::read(&place.path("out")).text("status"), "done");
    assert!(!place.path("out/failed-start").exists());
}

/// Each solver in the place of the other: the run ends at once, and says of both sides what is wrong.
#[test]
fn a_solver_of_the_other_side_is_refused_by_name() {
    let program = env!("CARGO_BIN_EXE_tandem");
    for (expected, given) in [("dem", "mpm"), ("mpm", "dem")] {
        let place = Place::new();
        let more = format!("--variant quick --{expected} \"'{program}' {given}\"");
        let start = std::time::Instant::now();
        let ended = place.start_run("out", &scene(HARD), &more).end().expect(3);
        let took = start.elapsed().as_secs_f64();
        assert!(took < 20.0, "it took {took:.1} s");
        let what = format!("what was started as the {expected} is `tandem-{given}");
        place.assert_clean(&ended.runs);
        ended.says(&[&what, &format!("it may be given by `--{given}`")]);
    }
}

/// What geometry forbids at the start: `check` and `plan` say so before anything runs, in the words of the solver.
#[test]
fn what_cannot_begin_is_refused_by_check_and_plan() {
    let notched = "[[dem.body]]\nname = \"notched\"\nsphero_radius = 0.002\ndensity = 2000.0\n\
                   position = [0.05, 0.05]\nshape.polygon.vertices = \
                   [[0, 0], [0.03, 0], [0.03, 0.03], [0.016, 0.03], [0.015, 0.01], [0.014, 0.03], [0, 0.03]]\n";
    let rows = [
        (notched, "too large for the notch"),
        (
            "[[dem.body]]\nname = \"deep\"\nshape = \"disc\"\nsphero_radius = 0.005\ndensity = 2000.0\n\
             position = [0.043, 0.0]\n",
            "body \"deep\" overlaps body \"target\" by 2.400e-2 m",
        ),
        (
            "[[mpm.points]]\nname = \"again\"\nmaterial = \"hard_rubber\"\nspacing.per_cell = 4\n\
             fill.rectangle = { lower = [0.0, 0.0], upper = [0.01, 0.01] }\n",
            "group 'again' lies on top of group 'disc'",
        ),
    ];
    let sound = with(
        "[output]",
        "[body_contact]\nlinear = { normal_stiffness = 1e4 }\n[output]",
    );
    for (body, phrase) in rows {
        let place = Place::new();
        place.write("sound.toml", &sound);
        place.tandem("check sound.toml").expect(0);
        place.write("bad.toml", &format!("{sound}{body}"));
        refused(&place, "check bad.toml").says(&[phrase]);
        place.tandem("plan bad.toml").expect(2).says(&[phrase]);
    }
}

/// D18: a scene that named a program ran it without a word.
#[test]
fn a_program_that_a_scene_names_is_started_only_when_it_is_trusted() {
    let text = fs::read_to_string(scene("extreme/bodies_only")).unwrap();
    let place = Place::new();
    let named = format!("{text}\n[solvers]\ndem = \"sh -c 'touch started'\"\n");
    place.write("foreign.toml", &named);
    let phrases = [
        "would start a program of its own",
        "as its dem: sh -c 'touch started'",
        "`--trust` starts it",
        "`--set solvers.dem=built-in`",
    ];
    refused(&place, "run foreign.toml --out out").says(&phrases);
    let vary = "--vary dem.body.0.spin=1e4 --resolution dem.body.0.spin --finer angle";
    let ended = place.tandem(&format!("study foreign.toml --out studied {vary}"));
    ended.expect(2).says(&[
        "would start a program as its dem: sh -c 'touch started'",
        "give `--trust`",
    ]);
    assert!(!place.path("started").exists() && !place.path("out").exists());
    // What the scene lies beside, and reads only, starts nothing.
    place.tandem("plan foreign.toml").expect(0);
    place.tandem("check foreign.toml").expect(0);
    assert!(!place.path("started").exists());
    // With trust it is started, and is no solver.
    let ended = place.tandem("run foreign.toml --out out --trust");
    ended.expect(3).says(&["dem"]);
    assert!(place.path("started").exists());
    // A directory from elsewhere is a scene from elsewhere.
    refused(&place, "resume out").says(&phrases[..3]);
    // Whoever names it on the command line wants it; the scene's own is left out.
    let built_in = "run foreign.toml --out own --dem built-in --set check=[]";
    place.tandem(built_in).expect(0);
}
