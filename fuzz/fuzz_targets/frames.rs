//! A file of a frame: refused, or read as a mesh that reads back when it is written.

#![no_main]

use coupler::record::frames::vtu::{Mesh, Precision};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let Ok(mesh) = Mesh::from_file(input) else {
        return;
    };
    let points: usize = mesh.cells().map(<[_]>::len).sum();
    assert!(points <= mesh.points.len());
    let again = Mesh::from_file(&mesh.to_file(Precision::Double)).expect("a mesh that was read");
    assert_eq!(again.ends, mesh.ends);
});
