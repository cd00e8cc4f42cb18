//! Frames: they change no bit of a run, they hold what was where, and another program reads them.
//!
//! Where `python3` cannot import meshio, h5py or vtk, what needs them is left out; `.ci/run` installs them first.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::harness::needs::Need;
use crate::harness::{HARD, Place, RunFiles, has, python, root, scene};
use coupler::record::frames::vtu::{Array, Mesh};
use coupler::record::frames::{Frame, FrameList};
use serde_json::Value;

const BETWEEN: f64 = 2e-3;

/// Runs the collision with frames.
fn framed(place: &Place) {
    let more = format!("--variant quick --set output.frames={BETWEEN}");
    place.run("framed", &scene(HARD), &more).expect(0);
}

fn column<'a>(mesh: &'a Mesh, name: &str, component: usize) -> impl Iterator<Item = f64> + 'a {
    let Array {
        components, values, ..
    } = mesh.array(name).expect("an array of the manual");
    values.iter().skip(component).step_by(*components).copied()
}

fn frame_at(run: &Path, time: f64) -> Frame {
    FrameList::read(run).unwrap().frame(time).unwrap()
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
        let frame = frame_at(&run, t);
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
        let bodies = frame_at(&run, f64::from(k) * BETWEEN).bodies.unwrap();
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
        let points = frame_at(&run, t).points.unwrap();
        column(&points, "stress", 0).fold(0.0, |m: f64, s| m.max(s.abs()))
    };
    assert_eq!(largest(0.0), 0.0);
    assert!(largest(BETWEEN) > 1e3);
    // And points press the disc that is hit away: a line for each, from its centre to the point.
    let contacts = |t: f64| frame_at(&run, t).contacts.unwrap();
    assert_eq!(contacts(0.0).ends.len(), 0);
    let pressing = contacts(BETWEEN);
    assert!(pressing.ends.len() > 3);
    assert!(column(&pressing, "force", 0).sum::<f64>() > 1e3);
    let frame = frame_at(&run, BETWEEN);
    let points = frame.points.unwrap();
    let ids: Vec<f64> = column(&points, "id", 0).collect();
    for (line, id) in pressing.cells().zip(column(&pressing, "other", 0)) {
        let point = ids.iter().position(|&known| known == id).unwrap();
        assert_eq!(line[1], points.points[point]);
        assert_eq!(line[0], pressing.points[0], "the centre of the one body");
    }
    let missing = FrameList::read(&run)
        .unwrap()
        .frame(0.4 * BETWEEN)
        .unwrap_err()
        .to_string();
    assert!(missing.contains("the nearest is at 0 s"), "{missing}");
}

/// Fields that are chosen, with half of their digits: less on the disk, and places as they were.
#[test]
fn a_scene_chooses_what_frames_hold() {
    let place = Place::new();
    framed(&place);
    let frames = format!("--variant quick --set output.frames={BETWEEN}");
    let chosen = "--set 'output.fields=[\"velocity\", \"spin\"]' --set output.precision=single";
    let more = format!("{frames} {chosen}");
    place.run("chosen", &scene(HARD), &more).expect(0);
    let [all, chosen] = ["framed", "chosen"].map(|out| {
        let run = place.path(out);
        frame_at(&run, BETWEEN)
    });
    let names = |mesh: &Mesh| -> Vec<String> {
        let arrays = mesh.of_points.iter().chain(&mesh.of_cells);
        arrays.map(|array| array.name.clone()).collect()
    };
    assert!(all.contacts.is_some() && chosen.contacts.is_none());
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
    let unknown = "--set 'output.fields=[\"temperature\"]'";
    let refused = place.run("out", &scene(HARD), unknown);
    refused.expect(2).says(&["temperature", "velocity"]);
}

/// Blocks that run into a wall: one that flows, one that cannot, one of sand that forgets how far it has flowed.
const BLOCKS: &str = r#"version = 1
name = "blocks"
[time]
end = 0.004
[output]
every = 0.001
[mpm]
cell = 0.01
domain = [[0.0, 0.0], [0.4, 0.4]]
shape = "quadratic_bspline"
transfer = "flip"
walls.left = "fixed"
[[mpm.material]]
name = "metal"
density = 1000.0
model.von_mises = { bulk_modulus = 1e7, shear_modulus = 5e6, yield_stress = 2e4, hardening_modulus = 1e5 }
[[mpm.material]]
name = "rubber"
density = 1000.0
model.linear_elastic = { bulk_modulus = 1e6, shear_modulus = 5e5 }
[[mpm.material]]
name = "sand"
density = 1000.0
model.drucker_prager = { bulk_modulus = 1e6, shear_modulus = 5e5, friction_angle = 30.0, dilation_angle = 0.0, cohesion = 100.0, tensile_strength = 0.0 }
"#;

fn blocks(groups: &[(&str, &str)]) -> String {
    let group = |(k, (name, material)): (usize, &(&str, &str))| {
        let (low, high) = (0.04 + 0.12 * k as f64, 0.1 + 0.12 * k as f64);
        format!(
            "[[mpm.points]]\nname = \"{name}\"\nmaterial = \"{material}\"\nspacing.per_cell = 4\n\
             fill.rectangle = {{ lower = [0.02, {low}], upper = [0.12, {high}] }}\nvelocity = [-5.0, 0.0]\n"
        )
    };
    let groups = groups.iter().enumerate().map(group);
    BLOCKS.to_owned() + &groups.collect::<String>()
}

/// A picture of the plastic strain, in each format. Where a run has none, the message says when one does.
#[test]
fn plastic_strain_colours_pictures_and_films() {
    let place = Place::new();
    let all = [("bar", "metal"), ("ball", "rubber"), ("heap", "sand")];
    for (out, groups) in [("strain", &all[..]), ("none", &all[1..])] {
        let file = format!("{out}.toml");
        place.write(&file, &blocks(groups));
        place.run(out, &file, "--set output.frames=0.002").expect(0);
    }
    let plot = |run: &str, colour: &str, out: &str| {
        place.tandem(&format!(
            "plot {run} --frames all --out {out} --colour '{colour}'"
        ))
    };
    plot("strain", "plastic_strain", "a.svg").expect(0);
    let figure = fs::read_to_string(place.path("a.svg")).unwrap();
    has(&figure, "\nplastic_strain; grey: no number\n");
    plot("strain", "flow [%]=100*plastic_strain", "b.svg").expect(0);
    let other = fs::read_to_string(place.path("b.svg")).unwrap();
    let points = |figure: &str| figure.matches("<rect").count();
    assert!(points(&figure) > 300, "{}", points(&figure));
    assert!(points(&other) == points(&figure) && other.contains("\nflow [%]; grey: no number\n"));
    for colour in ["plastic_strain", "speed + plastic_strain"] {
        let refused = plot("none", colour, "none.svg").expect(2);
        refused.says(&[
            "none",
            "have no `plastic_strain`",
            "von_mises",
            "output.fields",
        ]);
        assert!(!place.path("none.svg").exists());
    }
    plot("none", "speed", "none.svg").expect(0);
    plot("strain", "plastic_strain", "a.png").expect(0);
    plot("strain", "plastic_strain", "a.gif").expect(0);
    assert!(fs::metadata(place.path("a.gif")).unwrap().len() > 1000);
}

/// Contacts of two points were not among those of frames.
#[test]
fn contacts_of_two_groups_are_lines_from_point_to_point() {
    let place = Place::new();
    let bars = scene("verification/two_bars_pairs");
    let more = "--variant quick --set output.frames=0.001";
    place.run("pair", &bars, more).expect(0);
    let frame = frame_at(&place.path("pair"), 0.004);
    let (points, contacts) = (frame.points.unwrap(), frame.contacts.unwrap());
    let ids: Vec<f64> = column(&points, "id", 0).collect();
    let groups: Vec<f64> = column(&points, "group", 0).collect();
    let of_id = |id: f64| ids.iter().position(|&known| known == id).unwrap();
    let lines: Vec<&[[f64; 2]]> = contacts.cells().collect();
    assert!(lines.len() > 5, "{} contacts of eight rows", lines.len());
    let cells = |name: &str| contacts.array(name).unwrap().values.clone();
    let (with, force) = (cells("with_point"), cells("force"));
    let (body, other) = (cells("body"), cells("other"));
    for (k, line) in lines.iter().enumerate() {
        let ends = [of_id(body[k]), of_id(other[k])];
        assert_eq!((with[k], line.len()), (2.0, 2));
        assert_eq!([line[0], line[1]], ends.map(|end| points.points[end]));
        let mut of_groups = ends.map(|end| groups[end]);
        of_groups.sort_by(f64::total_cmp);
        assert_eq!(of_groups, [0.0, 1.0]);
        // The force on the first points away from the second.
        let away = line[0][0] - line[1][0];
        assert!(force[3 * k] * away > 0.0, "{k}");
    }
}

/// Names of bodies, as two readers print them.
const MESHIO: &str = "
import sys, meshio
print(bytes(meshio.read(sys.argv[1]).field_data['names'].ravel().tolist()).decode())";
const VTK: &str = "
import sys
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
reader = vtkXMLUnstructuredGridReader()
reader.SetFileName(sys.argv[1])
reader.Update()
names = reader.GetOutput().GetFieldData().GetArray('names')
print(bytes(int(names.GetValue(k)) for k in range(names.GetNumberOfValues())).decode())";

/// Bodies are found by their names, in the files and by other readers.
#[test]
fn frames_name_the_bodies() {
    let place = Place::new();
    let more = "--variant quick --set time.end=0.002 --set output.every=0.001 \
        --set output.frames=0.001 --set check=[]";
    let ledger = scene("verification/random_ledger");
    place.run("named", &ledger, more).expect(0);
    let run = place.path("named");
    let bodies = frame_at(&run, 0.001).bodies.unwrap();
    let table = fs::read_to_string(run.join("bodies.csv")).unwrap();
    let named = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').next().unwrap());
    let named: Vec<&str> = named.collect();
    assert!(named.len() > 20);
    assert_eq!(bodies.names, named);
    let file = run.join("frames/bodies_0001.vtu");
    for (modules, read) in [("meshio", MESHIO), ("vtkmodules", VTK)] {
        if let Some(output) = python(modules, &["-c", read, file.to_str().unwrap()]) {
            let output = String::from_utf8(output).unwrap();
            assert_eq!(
                output.trim_end().lines().collect::<Vec<_>>(),
                named,
                "{modules}"
            );
        }
    }
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
    let read = python("meshio", &["-c", READ, file.to_str().unwrap()])?;
    Some(serde_json::from_slice(&read).unwrap())
}

#[test]
fn meshio_reads_the_same_numbers() {
    let place = Place::new();
    framed(&place);
    let run = place.path("framed");
    let frame = frame_at(&run, BETWEEN);
    for (name, mesh, kind) in [
        ("points", frame.points.unwrap(), "vertex"),
        ("bodies", frame.bodies.unwrap(), "polygon"),
        ("contacts", frame.contacts.unwrap(), "line"),
    ] {
        let file = run.join(format!("frames/{name}_0001.vtu"));
        let Some(read) = by_meshio(&file) else {
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

/// What VTK reads at a time: the time, places, cells with the numbers of their points and kinds, arrays, names of bodies.
type ReadBack = (
    f64,
    Vec<[f64; 3]>,
    Vec<(usize, u8)>,
    BTreeMap<String, Vec<f64>>,
    Vec<String>,
);

/// A run as VTKHDF, read back by VTK: the same places, cells and arrays at every time.
#[test]
fn vtk_reads_the_converted_frames() {
    const READ: &str = r"
import json, sys
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as pipeline
reader = vtkHDFReader()
reader.SetFileName(sys.argv[1])
reader.UpdateInformation()
times = reader.GetOutputInformation(0).Get(pipeline.TIME_STEPS())
frames = []
for time in times:
    reader.UpdateTimeStep(time)
    grid = reader.GetOutput()
    cells = [[grid.GetCell(k).GetPointIds().GetNumberOfIds(), grid.GetCellType(k)] for k in range(grid.GetNumberOfCells())]
    arrays = {}
    for data in (grid.GetPointData(), grid.GetCellData()):
        for k in range(data.GetNumberOfArrays()):
            array = data.GetArray(k)
            arrays[array.GetName()] = vtk_to_numpy(array).ravel().astype(float).tolist()
    points = vtk_to_numpy(grid.GetPoints().GetData()).tolist() if grid.GetNumberOfPoints() else []
    names = grid.GetFieldData().GetAbstractArray('names')
    names = [names.GetValue(k) for k in range(names.GetNumberOfValues())] if names else []
    frames.append([time, points, cells, arrays, names])
print(json.dumps(frames))
";
    let place = Place::new();
    framed(&place);
    let run = place.path("framed");
    let convert = ["-m", "tandem_frames", run.to_str().unwrap()];
    let Some(written) = python("h5py, vtkmodules", &convert) else {
        return;
    };
    let written = String::from_utf8(written).unwrap();
    assert_eq!(written.lines().count(), 3, "{written}");
    let times = FrameList::read(&run).unwrap().times();
    let frames: Vec<Frame> = times.iter().map(|&time| frame_at(&run, time)).collect();
    for (name, cell) in [("points", 1), ("bodies", 7), ("contacts", 3)] {
        let file = run.join(format!("vtkhdf/{name}.vtkhdf"));
        let read = python("vtkmodules", &["-c", READ, file.to_str().unwrap()]).unwrap();
        let read_back: Vec<ReadBack> = serde_json::from_slice(&read).unwrap();
        assert_eq!(read_back.len(), frames.len());
        for (frame, (time, places, cells, arrays, names)) in frames.iter().zip(read_back) {
            let mesh = match name {
                "points" => &frame.points,
                "bodies" => &frame.bodies,
                _ => &frame.contacts,
            };
            let mesh = mesh.as_ref().unwrap();
            assert_eq!(time, frame.time);
            let expected: Vec<[f64; 3]> = mesh.points.iter().map(|&[x, y]| [x, y, 0.0]).collect();
            assert_eq!(places, expected, "{name} at {time}");
            let expected: Vec<(usize, u8)> = mesh.cells().map(|c| (c.len(), cell)).collect();
            assert_eq!(cells, expected, "{name} at {time}");
            let expected = mesh.of_points.iter().chain(&mesh.of_cells);
            let expected: BTreeMap<String, Vec<f64>> = expected
                .map(|array| (array.name.clone(), array.values.clone()))
                .collect();
            assert_eq!(arrays, expected, "{name} at {time}");
            assert_eq!(names, mesh.names, "{name} at {time}");
        }
    }
}

/// Whether there is such a program.
fn is_installed(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

/// ParaView takes 600 MB, so `.ci/run` does not install it: `apt-get install paraview python3-paraview xvfb`.
#[test]
fn paraview_opens_the_frames_in_colours() {
    const LOOK: &str = "
import sys
from PIL import Image
picture = Image.open(sys.argv[1]).convert('RGB')
counts = picture.getcolors(1 << 24)
white = sum(count for count, colour in counts if colour == (255, 255, 255))
blue = sum(count for count, (r, g, b) in counts if b > g + 30)
grey = sum(count for count, (r, g, b) in counts if max(r, g, b) - min(r, g, b) < 16 and 150 < g < 200)
print(picture.width * picture.height, white, blue, grey, len(counts))
";
    let there = ["pvpython", "xvfb-run"].into_iter().all(is_installed);
    if !Need::Paraview.is_met(there, "no pvpython or no xvfb-run") {
        return;
    }
    let place = Place::new();
    framed(&place);
    let picture = place.path("picture.png");
    let ended = Command::new("xvfb-run")
        .args(["-a", "pvpython"])
        .arg(root().join("python/tandem_frames/in_paraview.py"))
        .arg(&picture)
        .env("TANDEM_RUN", place.path("framed"))
        .env_remove("PYTHONPATH")
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success() && picture.is_file(), "{stderr}");
    assert!(!stderr.contains("Traceback"), "{stderr}");
    let Some(seen) = python("PIL", &["-c", LOOK, picture.to_str().unwrap()]) else {
        return;
    };
    let seen = String::from_utf8(seen).unwrap();
    let seen: Vec<f64> = seen
        .split_whitespace()
        .map(|n| n.parse().unwrap())
        .collect();
    let [all, white, blue, grey, colours] = seen[..] else {
        panic!("{seen:?}");
    };
    // The disc that was hit is grey; the points of the other have the first colours of the scale, dark blue, on white.
    assert_eq!(all, 1600.0 * 1000.0);
    assert!(white > 0.3 * all && grey > 0.04 * all, "{seen:?}");
    assert!(blue > 0.02 * all && colours > 50.0, "{seen:?}");
}

/// What is no run with frames is refused in a line.
#[test]
fn a_folder_without_frames_is_not_converted() {
    let place = Place::new();
    let (code, nowhere) = (
        "import sys, tandem_frames.__main__ as m; sys.argv = sys.argv[1:]; print(m.main())",
        place.path("nowhere"),
    );
    let arguments = ["-c", code, "tandem_frames", nowhere.to_str().unwrap()];
    if let Some(output) = python("h5py", &arguments) {
        assert_eq!(String::from_utf8(output).unwrap().trim(), "2");
    }
}
