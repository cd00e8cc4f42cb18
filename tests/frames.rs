//! Frames: they change no bit of a run, they hold what was where, and another program reads them.
//!
//! Where `python3` cannot import meshio, what needs it says that it is skipped; `.ci/run` installs it first.

mod harness;

use std::fs;
use std::path::Path;
use std::process::Command;

use coupler::record::frames::Frame;
use coupler::record::frames::vtu::{Array, Mesh};
use harness::{Place, RunFiles, root, scene};
use serde_json::Value;

/// A disc of points hits one that is a body.
const HARD: &str = "jiang2020/collision_hard";
const BETWEEN: f64 = 2e-3;

/// Runs the collision with frames.
fn framed(place: &Place) {
    let frames = format!("output.frames={BETWEEN}");
    let more = ["--variant", "quick", "--set", &frames];
    place.run("framed", &scene(HARD), &more).expect(0);
}

#[test]
fn frames_change_no_bit_of_a_run() {
    let place = Place::new();
    framed(&place);
    let plain = ["--variant", "quick", "--set", "output.report=false"];
    place.run("plain", &scene(HARD), &plain).expect(0);
    let [framed, plain] = ["framed", "plain"].map(|out| RunFiles::read(&place.path(out)));
    assert_eq!(framed.summary["state_hash"], plain.summary["state_hash"]);
    let history = |out: &str| fs::read_to_string(place.path(out).join("history.csv")).unwrap();
    assert_eq!(history("framed"), history("plain"));
    assert!(!place.path("plain").join("frames").exists());
}

fn column<'a>(mesh: &'a Mesh, name: &str, component: usize) -> impl Iterator<Item = f64> + 'a {
    let Array {
        components, values, ..
    } = mesh.array(name).expect("an array of the manual");
    values.iter().skip(component).step_by(*components).copied()
}

#[test]
fn a_frame_holds_what_was_where() {
    let place = Place::new();
    framed(&place);
    let run = place.path("framed");
    let history = RunFiles::read(&run).history();
    let (time, v_disc, v_target) = (
        history.column("time [s]"),
        history.column("v_disc [m/s]"),
        history.column("v_target [m/s]"),
    );
    let end = *time.last().unwrap();
    let frames = (end / BETWEEN).floor() as u32;
    assert!(frames >= 3);
    for k in 0..=frames {
        let t = f64::from(k) * BETWEEN;
        let frame = Frame::read(&run, t).unwrap();
        let row = time
            .iter()
            .position(|time| (time - t).abs() < 1e-9)
            .unwrap();
        let (points, bodies) = (frame.points.unwrap(), frame.bodies.unwrap());
        // The rows' means are over the two half steps around t, the frame's velocities are of the one before.
        let mass: f64 = column(&points, "mass", 0).sum();
        let momentum: f64 = column(&points, "mass", 0)
            .zip(column(&points, "velocity", 0))
            .map(|(m, v)| m * v)
            .sum();
        assert!(
            (momentum / mass - v_disc[row]).abs() < 0.02,
            "{t}: {}",
            momentum / mass
        );
        assert_eq!(
            column(&bodies, "velocity", 0).next().unwrap(),
            v_target[row],
            "{t}"
        );
        // The disc that is hit: its outline is a circle of 2 cm about its centre.
        let outline = bodies.cells().next().unwrap();
        let x = outline.iter().map(|p| p[0]).sum::<f64>() / outline.len() as f64;
        for p in outline {
            assert!(((p[0] - x).hypot(p[1]) - 0.02).abs() < 1e-12, "{p:?}");
        }
    }
    let middle = |k: u32| {
        let bodies = Frame::read(&run, f64::from(k) * BETWEEN)
            .unwrap()
            .bodies
            .unwrap();
        bodies.points.iter().map(|p| p[0]).sum::<f64>() / bodies.points.len() as f64
    };
    // From the last but one to the last frame the disc that was hit flies freely.
    let flown = middle(frames) - middle(frames - 1);
    assert!(
        (flown / BETWEEN - v_target.last().unwrap()).abs() < 1e-9,
        "{flown}"
    );
    // While they press, the disc is under pressure somewhere; at the start nowhere.
    let largest = |t: f64| {
        let points = Frame::read(&run, t).unwrap().points.unwrap();
        column(&points, "stress", 0).fold(0.0, |m: f64, s| m.max(s.abs()))
    };
    assert_eq!(largest(0.0), 0.0);
    assert!(largest(BETWEEN) > 1e3);
    let missing = Frame::read(&run, 0.4 * BETWEEN).unwrap_err().to_string();
    assert!(missing.contains("the nearest is at 0 s"), "{missing}");
}

/// Fields that are chosen, with half of their digits: less on the disk, and places as they were.
#[test]
fn a_scene_chooses_what_frames_hold() {
    let place = Place::new();
    framed(&place);
    let frames = format!("output.frames={BETWEEN}");
    let chosen = "output.fields=[\"velocity\", \"spin\"]";
    let more = ["--variant", "quick", "--set", &frames, "--set", chosen];
    let single = ["--set", "output.precision=single"];
    let more: Vec<&str> = more.into_iter().chain(single).collect();
    place.run("chosen", &scene(HARD), &more).expect(0);
    let [all, chosen] = ["framed", "chosen"].map(|out| {
        let run = place.path(out);
        Frame::read(&run, BETWEEN).unwrap()
    });
    let names = |mesh: &Mesh| -> Vec<String> {
        let arrays = mesh.of_points.iter().chain(&mesh.of_cells);
        arrays.map(|array| array.name.clone()).collect()
    };
    let (points, bodies) = (chosen.points.unwrap(), chosen.bodies.unwrap());
    assert_eq!(names(&points), ["id", "group", "velocity"]);
    assert_eq!(names(&bodies), ["body", "velocity", "spin"]);
    let whole = all.points.unwrap();
    assert_eq!(points.points, whole.points);
    for (short, long) in column(&points, "velocity", 0).zip(column(&whole, "velocity", 0)) {
        assert_eq!(short, f64::from(long as f32));
    }
    let bytes = |out: &str| {
        let file = place.path(out).join("frames/points_0001.vtu");
        fs::metadata(file).unwrap().len()
    };
    assert!(2 * bytes("chosen") < bytes("framed"));
    let unknown = "output.fields=[\"temperature\"]";
    let refused = place.start_run("out", &scene(HARD), &["--set", unknown]);
    refused.end().expect(2).says(&["temperature", "velocity"]);
}

/// What meshio reads, as JSON; `None` where there is no meshio.
fn by_meshio(file: &Path) -> Option<Value> {
    const READ: &str = "
import json, sys
import meshio
m = meshio.read(sys.argv[1])
cells = [len(cell) for block in m.cells for cell in block.data]
of_cells = {name: [list(map(float, row.ravel())) for block in blocks for row in block] for name, blocks in m.cell_data.items()}
of_points = {name: [list(map(float, row.ravel())) for row in rows] for name, rows in m.point_data.items()}
kinds = sorted({''.join(c for c in block.type if not c.isdigit()) for block in m.cells})
print(json.dumps([m.points.tolist(), cells, kinds, of_points, of_cells]))
";
    let mut path = root().join("target/readers").into_os_string();
    if let Some(more) = std::env::var_os("PYTHONPATH") {
        path.push(":");
        path.push(more);
    }
    let python = |arguments: &[&str]| {
        Command::new("python3")
            .env("PYTHONPATH", &path)
            .args(arguments)
            .output()
    };
    if !python(&["-c", "import meshio"]).is_ok_and(|o| o.status.success()) {
        return None;
    }
    let read = python(&["-c", READ, file.to_str().unwrap()]).unwrap();
    assert!(
        read.status.success(),
        "{}",
        String::from_utf8_lossy(&read.stderr)
    );
    Some(serde_json::from_slice(&read.stdout).unwrap())
}

#[test]
fn meshio_reads_the_same_numbers() {
    let place = Place::new();
    framed(&place);
    let run = place.path("framed");
    let frame = Frame::read(&run, BETWEEN).unwrap();
    for (name, mesh, kind) in [
        ("points", frame.points.unwrap(), "vertex"),
        ("bodies", frame.bodies.unwrap(), "polygon"),
    ] {
        let file = run.join(format!("frames/{name}_0001.vtu"));
        let Some(read) = by_meshio(&file) else {
            println!("skipped: python3 cannot import meshio (.ci/run installs it)");
            return;
        };
        let rows = |all: &Value| -> Vec<Vec<f64>> { serde_json::from_value(all.clone()).unwrap() };
        let places: Vec<Vec<f64>> = mesh.points.iter().map(|&[x, y]| vec![x, y, 0.0]).collect();
        assert_eq!(rows(&read[0]), places);
        let lengths: Vec<usize> = mesh.cells().map(<[_]>::len).collect();
        assert_eq!(
            serde_json::from_value::<Vec<usize>>(read[1].clone()).unwrap(),
            lengths
        );
        assert_eq!(read[2], serde_json::json!([kind]));
        for (arrays, there) in [(&mesh.of_points, &read[3]), (&mesh.of_cells, &read[4])] {
            for array in arrays {
                let ours: Vec<Vec<f64>> = array
                    .values
                    .chunks(array.components)
                    .map(<[f64]>::to_vec)
                    .collect();
                assert_eq!(rows(&there[&array.name]), ours, "{}", array.name);
            }
        }
    }
}
