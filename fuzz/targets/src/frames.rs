//! VTK files and their list, read back; and names in them, written.

use coupler::record::frames::vtu::{Array, Cell, Mesh, Precision};
use coupler::record::frames::{Frame, times};

use crate::run::{LEFT, directory};
use crate::target::Target;

/// Frames. An input begins with what it is: a mesh as a file, the list of frames, or a name of an array.
pub const TARGET: Target = Target {
    name: "frames",
    run,
    seeds,
    change: |changer, input, seeds| changer.text(input, seeds),
    base: 1 << 20,
    // What zlib has packed is up to a thousand times as long, and numbers of 32 bits are read as 64.
    per_byte: 4096,
};

fn run(input: &[u8]) {
    let Some((what, rest)) = input.split_first() else {
        return;
    };
    match what % 3 {
        0 => {
            if let Ok(mesh) = Mesh::from_file(rest) {
                let points: usize = mesh.cells().map(<[_]>::len).sum();
                assert!(points <= mesh.points.len());
                // What was read is written so that it reads back.
                let again = Mesh::from_file(&mesh.to_file(Precision::Double))
                    .expect("a mesh that was read");
                assert_eq!(again.ends, mesh.ends);
            }
        }
        1 => list(rest),
        _ => name(&String::from_utf8_lossy(rest)),
    }
}

/// The list may name any file: only those of the folder are read.
fn list(text: &[u8]) {
    let dir = directory();
    let folder = dir.path().join("frames");
    let written =
        std::fs::create_dir(&folder).and_then(|()| std::fs::write(folder.join("frames.pvd"), text));
    written.expect("room for an input");
    let Ok(times) = times(dir.path()) else {
        return;
    };
    for time in times.into_iter().take(4) {
        let _ = Frame::read(dir.path(), time).map_err(|e| e.to_string());
    }
}

/// An array of any name that XML can carry comes back under it.
fn name(name: &str) {
    let mesh = Mesh {
        cell: Cell::Vertex,
        points: vec![[0.0, 1.0]],
        ends: vec![1],
        of_points: vec![Array::real(name, 1, vec![1.0])],
        of_cells: Vec::new(),
        names: Vec::new(),
    };
    // XML has no word for most control characters, and white space in it is of one kind.
    if !name.contains(|c: char| c.is_control()) {
        assert_eq!(
            Mesh::from_file(&mesh.to_file(Precision::Double)),
            Ok(mesh),
            "{name:?}"
        );
    }
}

fn seeds() -> Vec<Vec<u8>> {
    let read = |file: &str| LEFT.frames[file].as_slice();
    vec![
        [&[0], read("points_0001.vtu")].concat(),
        [&[0], read("bodies_0001.vtu")].concat(),
        [&[1], read("frames.pvd")].concat(),
        b"\x02velocity".to_vec(),
        "\u{2}a \"b\" <c> & 'd' \u{1F600} ]]> --> &amp; &#0;".into(),
    ]
}
