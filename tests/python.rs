//! A solver in Python takes the place of a built-in one by the command line alone, and gives the same physics.
//!
//! Where `python3` cannot import iceoryx2, what needs it says that it is skipped; `.ci/run` installs the wheel first.

mod harness;

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use harness::{Ended, History, Place, RunFiles, lives, root, scene, signal, until};
use interface::wire::{LAYOUT, layout_hash};

const HARD: &str = "jiang2020/collision_hard";
/// Largest difference of a column relative to its largest value: sums in another order, over a thousand steps.
const SAME: f64 = 1e-9;

/// Whether `python3` takes `arguments`.
fn python(arguments: &[&str]) -> bool {
    let mut python = Command::new("python3");
    python.args(arguments).stdout(Stdio::null());
    python.stderr(Stdio::null());
    python.status().is_ok_and(|status| status.success())
}

/// Whether solvers in Python can run here; tells if not.
fn can_run() -> bool {
    let can = python(&["-c", "import iceoryx2"]);
    if !can {
        println!("skipped: python3 cannot import iceoryx2 (python/README.md says how to get it)");
    }
    can
}

fn example() -> PathBuf {
    root().join("python/examples/disc_dem.py")
}

fn run_quick(place: &Place, out: &str, dem: Option<&str>, more: &[&str]) -> Ended {
    let mut arguments = vec!["--variant", "quick"];
    arguments.extend(dem.iter().flat_map(|command| ["--dem", command]));
    arguments.extend(more);
    place.run(out, &scene(HARD), &arguments)
}

fn disc_dem() -> String {
    format!("python3 '{}'", example().display())
}

#[test]
fn records_in_python_are_laid_out_as_in_rust() {
    if !python(&["-c", "pass"]) {
        println!("skipped: there is no python3");
        return;
    }
    let module = root().join("python/tandem_solver/wire.py");
    let printed = Command::new("python3").arg(module).output().unwrap();
    assert!(printed.status.success(), "{printed:?}");
    let printed = String::from_utf8(printed.stdout).unwrap();
    let printed: Vec<&str> = printed.lines().collect();
    let (hash, lines) = printed.split_last().expect("lines");
    assert_eq!(lines, LAYOUT);
    assert_eq!(*hash, layout_hash());
}

#[test]
fn the_python_package_passes_its_own_tests() {
    if !can_run() {
        return;
    }
    let folder = root().join("python");
    let tests = Command::new("python3")
        .args(["-m", "unittest", "discover", "-s", "tests"])
        .current_dir(folder)
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&tests.stderr);
    assert!(tests.status.success(), "{told}");
    assert!(told.contains("Ran ") && !told.contains("Ran 0 "), "{told}");
}

/// Asserts that the columns of two histories are the same but for [`SAME`].
#[track_caller]
fn assert_same(a: &History, b: &History) {
    assert_eq!(a.header, b.header);
    assert_eq!(a.rows.len(), b.rows.len());
    // The residual is a difference of energies over their total: its scale is 1, not its own size.
    for name in a.header.iter().filter(|name| !name.starts_with("residual")) {
        let (x, y) = (a.column(name), b.column(name));
        let scale = x.iter().fold(0.0, |m: f64, n| m.max(n.abs()));
        let apart = x.iter().zip(&y).map(|(p, q)| (p - q).abs());
        let apart = apart.fold(0.0, f64::max);
        assert!(apart <= SAME * scale, "`{name}` differs by {apart:e}");
    }
}

/// Runs the collision, changed by `more`, with the built-in bodies and with those of `command`: the same physics.
#[track_caller]
fn same_physics(command: &str, more: &[&str]) {
    let place = Place::new();
    run_quick(&place, "rust", None, more).expect(0);
    let ended = run_quick(&place, "python", Some(command), more).expect(0);
    place.assert_clean(&ended.runs);
    let rust = RunFiles::read(&place.path("rust"));
    let python = RunFiles::read(&place.path("python"));
    assert_same(&rust.history(), &python.history());
    assert_eq!(rust.summary["steps"], python.summary["steps"]);
    for key in ["dt_min", "dt_max"] {
        let (x, y) = (rust.number(key), python.number(key));
        assert!((x - y).abs() <= SAME * x, "{key}: {x} and {y}");
    }
    for at in ["start", "end"] {
        let [x, y] = [&rust, &python].map(|files| &files.summary["energy"][at]);
        let scale = x["total"].as_f64().unwrap();
        for (name, x) in x.as_object().unwrap() {
            let (x, y) = (x.as_f64().unwrap(), y[name].as_f64().unwrap());
            assert!(
                (x - y).abs() <= SAME * scale,
                "{name} at the {at}: {x} and {y}"
            );
        }
    }
}

#[test]
fn discs_in_python_collide_as_the_built_in_ones_do() {
    if can_run() {
        same_physics(&disc_dem(), &[]);
    }
}

const OBLIQUE: [&str; 4] = [
    "--set",
    "dem.body.0.position=[0.036,0.02]",
    "--set",
    "check=[]",
];

#[test]
fn discs_in_python_slide_and_spin_as_the_built_in_ones_do() {
    if can_run() {
        let falling = ["--set", "gravity=[0,-9.81]"];
        same_physics(&disc_dem(), &[&OBLIQUE[..], &falling].concat());
    }
}

/// The Python block of `docs/solver-authors.md` is a solver that works.
#[test]
fn the_solver_of_the_guide_holds_discs_as_the_built_in_one_does() {
    if !can_run() {
        return;
    }
    let guide = std::fs::read_to_string(root().join("docs/solver-authors.md")).unwrap();
    let (_, block) = guide.split_once("```python\n").expect("a block of Python");
    let (block, _) = block.split_once("```").expect("its end");
    let place = Place::new();
    let package = root().join("python").display().to_string();
    let text = format!("import sys\nsys.path.insert(0, {package:?})\n{block}");
    let path = place.write("held.py", &text);
    let held = [
        "dem.body.0.motion=\"fixed\"",
        "contact.linear.friction=0",
        "time.end=0.006", // parted, and still within the domain
    ];
    let held = held.map(|set| ["--set", set]).concat();
    let more = [&OBLIQUE[..], &held].concat();
    same_physics(&format!("python3 '{}'", path.display()), &more);
}

#[test]
fn what_the_python_solver_cannot_do_it_refuses_by_its_key() {
    if !can_run() {
        return;
    }
    let place = Place::new();
    let damped = ["--set", "contact.linear.damping_ratio=0.1"];
    run_quick(&place, "out", Some(&disc_dem()), &damped)
        .expect(3)
        .says(&["dem.point_contact.linear.damping_ratio", "no dashpots"]);
}

/// Runs with a solver that is the example but for `change`, Python that has its module as `disc_dem`.
fn run_changed(place: &Place, change: &str) -> Ended {
    let folder = example().parent().unwrap().display().to_string();
    let text = format!(
        "import sys\nsys.path.insert(0, {folder:?})\nimport disc_dem\n{change}\nsys.exit(disc_dem.serve_dem(disc_dem.Discs()))\n"
    );
    let path = place.write("changed.py", &text);
    let command = format!("python3 '{}'", path.display());
    run_quick(place, "out", Some(&command), &[])
}

#[test]
fn a_velocity_that_is_not_finite_is_told_with_its_body() {
    if !can_run() {
        return;
    }
    let place = Place::new();
    let change = "
advance = disc_dem.Discs.advance
def spoilt(self, step):
    advance(self, step)
    if step.index == 20:
        self.bodies[0].vx = float('nan')
disc_dem.Discs.advance = spoilt";
    run_changed(&place, change)
        .expect(4)
        .says(&["velocity of body 0 (target) is not finite"]);
}

#[test]
fn forces_that_are_not_finite_never_leave_the_python_solver() {
    if !can_run() {
        return;
    }
    let place = Place::new();
    let change = "
contact = disc_dem.Discs.contact
def spoilt(self, step, states):
    answer = contact(self, step, states)
    answer.forces = [(float('nan'), 0.0, 1.0) for _ in answer.forces]
    return answer
disc_dem.Discs.contact = spoilt";
    run_changed(&place, change)
        .expect(3)
        .says(&["dem broke F-4", "not finite"]);
}

#[test]
fn the_python_solver_ends_when_its_coupler_is_killed() {
    if !can_run() {
        return;
    }
    let place = Place::new();
    let command = disc_dem();
    let long = [
        "--variant",
        "quick",
        "--set",
        "time.end=20",
        "--set",
        "check=[]",
    ];
    let more = [&long[..], &["--dem", &command]].concat();
    let mut run = place.start_run("out", &scene(HARD), &more);
    let dem = run.solver("out", "dem");
    run.stepping("out");
    assert!(lives(dem));
    signal(run.pid(), "KILL");
    assert_eq!(run.end().signal(), Some(9));
    let gone = until(Duration::from_secs(5), || (!lives(dem)).then_some(()));
    assert!(gone.is_some(), "the solver of a dead coupler lives on");
}
