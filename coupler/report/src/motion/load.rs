//! Reads the frames of a run: not all of them, where they are more than a page can have.

use std::collections::HashMap;
use std::path::Path;

use coupler::record::frames::numbers::Column;
use coupler::record::frames::vtu::Mesh;
use coupler::record::frames::{Frame, FrameError, FrameList};
use rayon::prelude::*;

use crate::field::{self, Field};
use crate::pack::Scale;
use crate::thin::{Amount, along_a_curve, evenly, shares};

/// Bytes of text that a point of a frame takes in a run that is not at rest: of more points of frames than fit by this, no more
/// are kept in the first place. Measured: 5 while waves run through all of them.
const USUAL: f64 = 4.0;

/// Frames and points of a run.
#[derive(Debug, Clone, Default)]
pub struct Loaded {
    /// Times of the frames in s.
    pub times: Vec<f64>,
    /// Sides in m of the points as squares of their volumes, in an order in which neighbours in space are neighbours.
    pub points: Vec<f64>,
    /// Each body outline about its middle, in m, at the first frame.
    pub outlines: Vec<Vec<[f64; 2]>>,
    /// What is where, frame by frame.
    pub frames: Vec<Instant>,
    /// Fields of the points.
    pub point_fields: Vec<Field>,
    /// Fields of the bodies.
    pub body_fields: Vec<Field>,
    /// What the run has kept.
    pub all: Amount,
    /// What could not be read, for people.
    pub faults: Vec<String>,
}

/// What is where at an instant.
#[derive(Debug, Clone, Default)]
pub struct Instant {
    /// Where the points are, in m; `None` where one has left.
    pub at: Vec<Option<[f32; 2]>>,
    /// Their numbers, field by field.
    pub of_points: Vec<Vec<f32>>,
    /// Middle of each outline in m, and how far it has turned since the first frame in rad.
    pub poses: Vec<[f64; 3]>,
    /// The numbers of the bodies, field by field.
    pub of_bodies: Vec<Vec<f32>>,
}

/// What frames have in common.
struct Common {
    /// Id of each point that is kept → its place.
    places: HashMap<u64, u32>,
    /// The ids in their order.
    ids: Vec<u64>,
    angles: Vec<f64>,
}

/// Reads what a run directory has of frames, about as much of it as `room` bytes of text can tell; `None` where a run has
/// kept none.
///
/// # Errors
/// [`FrameError`]: there are frames, and their list or the first of them cannot be read.
pub fn load(run: &Path, room: usize) -> Result<Option<Loaded>, FrameError> {
    let list = FrameList::read(run)?;
    let times = list.times();
    let Some(&start) = times.first() else {
        return Ok(None);
    };
    let first = list.frame(start)?;
    let points = first.points.as_ref().map_or(0, |mesh| mesh.points.len());
    let outlines = first.bodies.as_ref().map_or(0, |mesh| mesh.ends.len());
    let all = Amount {
        frames: times.len(),
        points,
    };
    let kept = shares(all, 2 * outlines, (room as f64 / USUAL) as usize);
    let mut loaded = Loaded {
        all,
        point_fields: first.points.as_ref().map_or(Vec::new(), field::fields),
        body_fields: first.bodies.as_ref().map_or(Vec::new(), field::fields),
        ..Loaded::default()
    };
    let common = common(&first, kept.points, &mut loaded);
    let wanted = evenly(times.len(), kept.frames);
    let read = wanted.into_par_iter().map(|k| {
        let frame = list.frame(times[k]).map_err(|error| error.to_string());
        frame.and_then(|frame| Ok((times[k], common.instant(&frame, &loaded)?)))
    });
    let read: Vec<Result<(f64, Instant), String>> = read.collect();
    for read in read {
        match read {
            Ok((time, instant)) => {
                loaded.times.push(time);
                loaded.frames.push(instant);
            }
            Err(fault) => loaded.faults.push(format!("A frame is left out: {fault}.")),
        }
    }
    Ok(Some(loaded))
}

/// What is the same in all frames, from the first one; so many of its points are kept.
fn common(first: &Frame, kept: usize, loaded: &mut Loaded) -> Common {
    let mut common = Common {
        places: HashMap::new(),
        ids: Vec::new(),
        angles: Vec::new(),
    };
    if let Some(mesh) = &first.points {
        let [x, y] = [0, 1].map(|axis| Scale::of(mesh.points.iter().map(|p| p[axis])));
        let places: Vec<[u16; 2]> = mesh
            .points
            .iter()
            .map(|&[px, py]| [x.fine(px), y.fine(py)])
            .collect();
        let order = along_a_curve(&places);
        let (id, volume) = (ids(mesh), Column::of(mesh, "volume"));
        for k in evenly(order.len(), kept).into_iter().map(|k| order[k]) {
            common.ids.push(id(k));
            let side = volume.as_ref().map_or(0.0, |volume| volume.at(k).sqrt());
            loaded.points.push(side);
        }
        let ids = common.ids.iter().zip(0..);
        common.places = ids.map(|(&id, place)| (id, place)).collect();
    }
    if let Some(mesh) = &first.bodies {
        loaded.outlines = mesh
            .cells()
            .map(|cell| {
                let [x, y] = middle(cell);
                cell.iter().map(|p| [p[0] - x, p[1] - y]).collect()
            })
            .collect();
        common.angles = angles(mesh);
    }
    common
}

impl Common {
    fn instant(&self, frame: &Frame, first: &Loaded) -> Result<Instant, String> {
        let mut instant = Instant::default();
        if let Some(mesh) = &frame.points {
            let found = self.find(mesh);
            let at = |&place: &Option<u32>| {
                let [x, y] = mesh.points[place? as usize];
                Some([x as f32, y as f32])
            };
            instant.at = found.iter().map(at).collect();
            let fields = first.point_fields.iter();
            instant.of_points = fields.map(|f| field::values(mesh, f, &found)).collect();
        }
        if let Some(mesh) = &frame.bodies {
            let (found, outlines) = (mesh.ends.len(), first.outlines.len());
            if found != outlines {
                let time = frame.time;
                return Err(format!(
                    "the frame at {time} s has {found} outlines of bodies, the first one {outlines}"
                ));
            }
            let turned = angles(mesh).into_iter().zip(&self.angles);
            let poses = mesh.cells().zip(turned).map(|(cell, (now, start))| {
                let [x, y] = middle(cell);
                [x, y, now - start]
            });
            instant.poses = poses.collect();
            let places: Vec<Option<u32>> = (0..outlines as u32).map(Some).collect();
            let fields = first.body_fields.iter();
            instant.of_bodies = fields.map(|f| field::values(mesh, f, &places)).collect();
        }
        Ok(instant)
    }

    /// Where in a mesh the kept points are.
    fn find(&self, mesh: &Mesh) -> Vec<Option<u32>> {
        let (id, mut found) = (ids(mesh), vec![None; self.ids.len()]);
        for k in 0..mesh.points.len() {
            if let Some(&place) = self.places.get(&id(k)) {
                found[place as usize] = Some(k as u32);
            }
        }
        found
    }
}

/// The id of each point; its place where a frame has no ids.
fn ids(mesh: &Mesh) -> impl Fn(usize) -> u64 {
    let ids = Column::of(mesh, "id");
    move |point| {
        ids.as_ref()
            .map_or(point as u64, |ids| ids.at(point) as u64)
    }
}

/// The angle of each outline in rad.
fn angles(mesh: &Mesh) -> Vec<f64> {
    let angles = Column::of(mesh, "angle");
    let angle = |k| angles.as_ref().map_or(0.0, |angles| angles.at(k));
    (0..mesh.ends.len()).map(angle).collect()
}

/// The mean of the vertices, which moves with the outline.
fn middle(outline: &[[f64; 2]]) -> [f64; 2] {
    let count = outline.len().max(1) as f64;
    [0, 1].map(|axis| outline.iter().map(|p| p[axis]).sum::<f64>() / count)
}

#[cfg(test)]
mod tests {
    use coupler::record::frames::vtu::{Array, Precision};

    use super::*;

    /// A frame from elsewhere made the report panic.
    #[test]
    fn points_whose_numbers_are_those_of_cells_are_no_fault() {
        let dir = tempfile::tempdir().unwrap();
        let frames = dir.path().join("frames");
        std::fs::create_dir(&frames).unwrap();
        let list = r#"<VTKFile><DataSet timestep="0" part="0" name="points" file="points_0000.vtu"/></VTKFile>"#;
        std::fs::write(frames.join("frames.pvd"), list).unwrap();
        let mesh = Mesh {
            points: vec![[0.0, 0.0], [1.0, 0.0]],
            ends: vec![2],
            of_cells: ["id", "volume"]
                .map(|name| Array::whole(name, vec![7.0]))
                .to_vec(),
            ..Mesh::default()
        };
        std::fs::write(
            frames.join("points_0000.vtu"),
            mesh.to_file(Precision::Double),
        )
        .unwrap();
        let loaded = load(dir.path(), 1000).unwrap().unwrap();
        assert_eq!((loaded.points.len(), loaded.frames[0].at.len()), (2, 2));
    }
}
