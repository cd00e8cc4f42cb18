//! A solver in Python takes the place of a built-in one by the command line alone, and gives the same physics.
//!
//! Where `python3` cannot import iceoryx2, what needs it is left out; `.ci/run` installs the wheel first.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::harness::needs::Need;
use crate::harness::{
    Ended, HARD, History, PATIENCE, Place, QUICK, RunFiles, has, python as python_with_readers,
    python_can_join, quoted, root, scene, signal, until,
};
use crate::resume;
use interface::message::wire::{LAYOUT, layout_hash};

/// For the points joined by springs: few of them, and K = 5/3 G.
const COARSE: &str = "--set mpm.material.0.model.linear_elastic.shear_modulus=3e6 --set mpm.points.0.spacing.per_cell=4";
/// Largest difference of a column relative to its largest value: sums in another order, over a thousand steps.
const SAME: f64 = 1e-9;

fn example() -> PathBuf {
    root().join("python/examples/disc_dem.py")
}

/// Runs a scene with the bodies of `command`, or with the built-in ones.
fn run_with(place: &Place, out: &str, scene: &str, dem: Option<&str>, more: &str) -> Ended {
    let dem = dem.map_or(String::new(), |command| {
        format!("--dem {}", quoted(command))
    });
    place.run(out, scene, &format!("{dem} {more}"))
}

fn run_quick(place: &Place, out: &str, dem: Option<&str>, more: &str) -> Ended {
    run_with(place, out, &scene(HARD), dem, &format!("{QUICK} {more}"))
}

fn disc_dem() -> String {
    format!("python3 '{}'", example().display())
}

/// The command of a continuum of another kind.
fn springs() -> String {
    let program = root().join("python/examples/springs_mpm.py");
    format!("python3 '{}'", program.display())
}

#[test]
fn records_in_python_are_laid_out_as_in_rust() {
    let there = Command::new("python3").arg("--version").output().is_ok();
    if !Need::Python.is_met(there, "there is no python3") {
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
    if !python_can_join() {
        return;
    }
    let folder = root().join("python");
    let tests = Command::new("python3")
        .args(["-m", "unittest", "discover", "-s", "tests"])
        .current_dir(folder)
        .output()
        .unwrap();
    let output = String::from_utf8_lossy(&tests.stderr);
    assert!(tests.status.success(), "{output}");
    assert!(
        output.contains("Ran ") && !output.contains("Ran 0 "),
        "{output}"
    );
}

#[test]
fn scenes_are_run_and_studied_from_python() {
    let tests = root().join("python/tests");
    let code = format!(
        "import sys, unittest; sys.path.insert(0, {tests:?}); unittest.main(None, sys.argv)"
    );
    let modules = ["-c", &code, "test_tandem", "test_plugin"];
    python_with_readers("pandas, pyvista, pytest, SALib", &modules);
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

/// Runs a scene with the built-in bodies and with those of `command`; both reach their end and leave nothing behind.
#[track_caller]
fn both(name: &str, command: &str, more: &str) -> (Place, [RunFiles; 2]) {
    let place = Place::new();
    run_with(&place, "rust", &scene(name), None, more).expect(0);
    let ended = run_with(&place, "python", &scene(name), Some(command), more).expect(0);
    place.assert_clean(&ended.runs);
    let files = ["rust", "python"].map(|out| RunFiles::read(&place.path(out)));
    (place, files)
}

/// Runs the collision, changed by `more`, with the built-in bodies and with those of `command`: the same physics.
#[track_caller]
fn same_physics(command: &str, more: &str) {
    same_physics_of(HARD, command, &format!("{QUICK} {more}"));
}

/// As [`same_physics`], of any scene.
#[track_caller]
fn same_physics_of(name: &str, command: &str, more: &str) {
    let (_place, [rust, python]) = both(name, command, more);
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

const OBLIQUE: &str = "--set dem.body.0.position=[0.036,0.02] --set check=[]";

#[test]
fn discs_in_python_slide_and_spin_as_the_built_in_ones_do() {
    if python_can_join() {
        same_physics(&disc_dem(), &format!("{OBLIQUE} --set gravity=[0,-9.81]"));
    }
}

/// The Python block of `docs/solver-authors.md` is a solver that works.
#[test]
fn the_solver_of_the_guide_holds_discs_as_the_built_in_one_does() {
    if !python_can_join() {
        return;
    }
    let guide = std::fs::read_to_string(root().join("docs/solver-authors.md")).unwrap();
    let (_, block) = guide.split_once("```python\n").expect("a block of Python");
    let (block, _) = block.split_once("```").expect("its end");
    let place = Place::new();
    let package = root().join("python").display().to_string();
    let text = format!("import sys\nsys.path.insert(0, {package:?})\n{block}");
    let path = place.write("held.py", &text);
    let held = "--set dem.body.0.motion=fixed --set contact.linear.friction=0";
    // Parted, and still within the domain.
    let more = format!("{OBLIQUE} {held} --set time.end=0.006");
    let command = format!("python3 '{}'", path.display());
    same_physics(&command, &more);
    // And it is judged as what it says that it takes.
    let kit = "conformance --require held --cases 20 --dem";
    let judged = place.tandem(&format!("{kit} \"{command}\"")).expect(0);
    has(&judged.stdout, "profile held");
}

#[test]
fn what_the_python_solver_cannot_do_it_refuses_by_its_key() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let damped = "--set contact.linear.damping_ratio=0.1";
    run_quick(&place, "out", Some(&disc_dem()), damped)
        .expect(3)
        .says(&["contact.linear.damping_ratio", "needs damping"]);
}

/// Runs with a solver that is the example but for `change`, Python that has its module as `disc_dem`.
fn run_changed(place: &Place, change: &str) -> Ended {
    let folder = example().parent().unwrap().display().to_string();
    let text = format!(
        "import sys\nsys.path.insert(0, {folder:?})\nimport disc_dem\n{change}\nsys.exit(disc_dem.serve_dem(disc_dem.Discs()))\n"
    );
    let path = place.write("changed.py", &text);
    let command = format!("python3 '{}'", path.display());
    run_quick(place, "out", Some(&command), "")
}

#[test]
fn a_velocity_that_is_not_finite_is_reported_with_its_body() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let change = "
advance = disc_dem.Discs.advance
def spoilt(self, step):
    advance(self, step)
    if step.index == 20:
        self.discs[0].motion = self.discs[0].motion._replace(vx=float('nan'))
disc_dem.Discs.advance = spoilt";
    run_changed(&place, change)
        .expect(4)
        .says(&["velocity of body 0 (target) is not finite"]);
}

#[test]
fn forces_that_are_not_finite_never_leave_the_python_solver() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let change = "
contact = disc_dem.Discs.contact
def spoilt(self, step, points, forces):
    contact(self, step, points, forces)
    for slot in range(len(points)):
        forces.add(slot, 0, (0.0, 0.0), (float('nan'), 0.0), 1.0)
disc_dem.Discs.contact = spoilt";
    let ended = run_changed(&place, change);
    let ended = ended.expect(3).says(&["dem broke F-4", "not finite"]);
    // The coupler hears the other side for a quarter of a second. It did so for the 30 s of the wait before.
    assert!(ended.took < Duration::from_secs(20), "{:?}", ended.took);
}

/// Springs join the points of a region, which no oracle knows: cases of a continuum without a grid list their points.
#[test]
fn springs_in_python_pass_the_cases_of_a_continuum() {
    if !python_can_join() {
        return;
    }
    let springs = springs();
    let kit = format!(
        "conformance --only T-1a,F-1a --cases 3 --mpm {}",
        quoted(&springs)
    );
    Place::new().tandem(&kit).expect(0);
}

/// A continuum of another kind, points joined by springs, gives the collision of an elastic disc but for its waves.
#[test]
fn springs_in_python_take_the_place_of_the_continuum() {
    if !python_can_join() {
        return;
    }
    let springs = springs();
    let springs = format!("--mpm {}", quoted(&springs));
    let place = Place::new();
    run_quick(&place, "rust", None, COARSE).expect(0);
    // Both sides in Python: the coupler is all that is left of Tandem.
    let more = format!("{COARSE} {springs}");
    let ended = run_quick(&place, "python", Some(&disc_dem()), &more).expect(0);
    place.assert_clean(&ended.runs);
    let [rust, python] = ["rust", "python"].map(|out| RunFiles::read(&place.path(out)));
    assert!(python.number("momentum_error") < 1e-12);
    for (name, share) in [("v_target [m/s]", 0.01), ("force [N/m]", 0.03)] {
        let largest =
            |files: &RunFiles| files.history().column(name).into_iter().fold(0.0, f64::max);
        let (x, y) = (largest(&rust), largest(&python));
        assert!((x - y).abs() <= share * x, "{name}: {x} and {y}");
    }
    run_quick(&place, "refused", None, &springs)
        .expect(3)
        .says(&["mpm.points.0.material", "bulk_modulus = 5/3 shear_modulus"]);
}

/// Both sides in Python, killed with their coupler in the middle of the collision, go on to the same bits.
#[test]
fn python_solvers_go_on_from_a_checkpoint_to_the_same_bits() {
    if !python_can_join() {
        return;
    }
    let springs = springs();
    let place = Place::new();
    // Friction has a history: the springs of the discs.
    let set = format!("{QUICK} {OBLIQUE} {COARSE} --set gravity=[0,-9.81]");
    let output = "--set output.frames=5e-4 --set output.checkpoint.time=5e-4";
    let dem = disc_dem();
    let solvers = format!("--mpm {} --dem {}", quoted(&springs), quoted(&dem));
    let more = format!("{set} {output} {solvers}");
    place.run("whole", &scene(HARD), &more).expect(0);
    let run = place.start_run("cut", &scene(HARD), &more);
    let folder = place.path("cut/checkpoints");
    let two = until(PATIENCE, || {
        let files = std::fs::read_dir(&folder).into_iter().flatten();
        (files.count() >= 2).then_some(())
    });
    assert!(two.is_some(), "no checkpoints");
    signal(run.pid(), "KILL");
    assert_eq!(run.end().signal(), Some(9));
    // The scene that the run has left names the programs.
    place.tandem("resume cut").expect(2);
    place.tandem("resume cut --trust").expect(0);
    resume::assert_same(&place.path("cut"), &place.path("whole"));
}

const TUMBLE: &str = "verification/tumble";
/// The collision of it, without the flight.
const COLLISION: &str = "--set time.end=0.006";

/// The command of YADE as the bodies' side, by the first Python that has it; notes if there is none.
fn yade_dem() -> Option<String> {
    let example = root().join("python/examples/yade_dem.py");
    // Started by hand it says how it wants to be started, once it has imported all it needs.
    let has_it = |python: &&str| {
        let mut command = Command::new(python);
        command.arg(&example).stdout(Stdio::null());
        command.stderr(Stdio::null());
        command
            .status()
            .is_ok_and(|status| status.code() == Some(2))
    };
    let python = ["python3", "/usr/bin/python3"].into_iter().find(has_it);
    let why = "no Python has both yade and iceoryx2: docs/solver-authors.md";
    Need::Yade.is_met(python.is_some(), why);
    Some(format!("{} '{}'", python?, example.display()))
}

#[test]
fn yade_moves_a_block_without_friction_as_the_built_in_solver_does() {
    if let Some(yade) = yade_dem() {
        same_physics_of(TUMBLE, &yade, "");
    }
}

/// On a corner YADE looks at the edge that comes first, whose turning it takes for another one (seed 3); a point that is new has
/// not slid.
#[test]
fn yade_keeps_what_friction_of_its_own_has_to() {
    let Some(yade) = yade_dem() else { return };
    let kit = "conformance --only F-7,N-1 --seed 3 --cases 2 --time 600 --startup 120 --shrink 0";
    let ended = Place::new().tandem(&format!("{kit} --dem {}", quoted(&yade)));
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stdout);
}

/// YADE's grid connections slide by another way (docs/solver-authors.md), so with friction the two differ by some
/// percent; the energies balance all the same.
#[test]
fn yade_with_friction_balances_its_energies_and_comes_near() {
    let Some(yade) = yade_dem() else { return };
    let rough = format!("--variant rough {COLLISION}");
    let (_place, [rust, yade]) = both(TUMBLE, &yade, &rough);
    let (a, b) = (rust.history(), yade.history());
    let last = |history: &History, name: &str| *history.column(name).last().unwrap();
    for (name, share) in [
        ("v_block [m/s]", 0.01),
        ("spin [rad/s]", 0.05),
        ("angle [rad]", 0.05),
    ] {
        let (x, y) = (last(&a, name), last(&b, name));
        assert!((x - y).abs() <= share * x.abs(), "{name}: {x} and {y}");
        assert!(
            (x - y).abs() > SAME * x.abs(),
            "{name}: friction is not YADE's own"
        );
    }
    let residual = |history: &History| last(history, "residual [1]");
    assert!((residual(&a) - residual(&b)).abs() < 1e-3);
}

#[test]
fn what_yade_cannot_do_is_refused_by_its_key() {
    let Some(yade) = yade_dem() else { return };
    let place = Place::new();
    let refused = |set: &str, phrases: &[&str]| {
        let more = format!("--set {set}");
        let ended = run_with(&place, "out", &scene(TUMBLE), Some(&yade), &more);
        ended.expect(3).says(phrases);
    };
    refused(
        "contact.linear.damping_ratio=0.1",
        &["contact.linear.damping_ratio", "needs damping"],
    );
    refused(
        "body_contact={linear={normal_stiffness=6e4}}",
        &["body_contact", "needs body_contact"],
    );
    refused(
        "dem.body.0.sphero_radius=0",
        &["dem.body.0.sphero_radius", "above 0"],
    );
    refused(
        "dem.body.0.motion=driven",
        &["dem.body.0.motion", "needs driven"],
    );
}
