//! A small run that was whole: what it left is what the seeds of other targets are made of.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use coupler::record::rundir::RunDir;
use coupler::record::summary::Status;
use coupler::run::{RunOptions, Solvers};
use coupler::scene::SceneFile;
use interface::message::{Channel, Message};
use interface::recording::Playback;
use tempfile::TempDir;

/// A block that falls on a disc, which stands on a wall: with sets that change, frames and checkpoints.
pub const SCENE: &str = r#"
version = 1
name = "fuzz"
about = "a block falls on a disc"
gravity = [0.0, -9.81]

[time]
end = 0.03
max_step = 1e-3

[mpm]
domain = [[0.0, 0.0], [1.0, 1.0]]
cell = 0.1
shape = "linear"
transfer = "flip"

[[mpm.material]]
name = "jelly"
density = 1000.0
model.linear_elastic = { bulk_modulus = 2000.0, shear_modulus = 1000.0 }

[[mpm.points]]
name = "block"
material = "jelly"
fill.rectangle = { lower = [0.4, 0.42], upper = [0.6, 0.52] }
spacing.distance = 0.05
velocity = [0.0, -3.0]
contact_radius = 0.01

[dem]
[[dem.body]]
name = "disc"
shape = "disc"
sphero_radius = 0.1
density = 600.0
position = [0.48, 0.279]

[[dem.body]]
name = "wall"
shape.rectangle = { width = 0.8, height = 0.02 }
sphero_radius = 0.05
position = [0.5, 0.12]
motion = "fixed"

[contact]
linear = { normal_stiffness = 1e4, tangential_stiffness = 5e3, friction = 0.4 }

[body_contact]
linear = { normal_stiffness = 1e5, tangential_stiffness = 5e4, friction = 0.4 }

[output]
every = 0.01
frames = 0.01
checkpoint.time = 0.01
"#;

/// What the run has left.
#[derive(Debug)]
pub struct Left {
    /// `recording.tandem`.
    pub recording: Vec<u8>,
    /// The messages of it, each with its channel.
    pub messages: Vec<(Channel, Message)>,
    /// The files of `frames/`, by name.
    pub frames: BTreeMap<String, Vec<u8>>,
}

/// The run, made once.
pub static LEFT: LazyLock<Left> = LazyLock::new(left);

/// How it is run: recorded, and everything in this thread.
fn options() -> RunOptions {
    RunOptions {
        screen: None,
        solvers: Solvers::InProcess {
            mpm: || Box::new(mpm_proc::Mpm::default()),
            dem: || Box::new(dem_proc::Sdem::default()),
        },
        threads: 1,
        window: None,
        record: true,
        trace: None,
        progress: false,
        patience: Duration::from_secs(1),
        stepping: None,
        interrupt: Arc::new(AtomicBool::new(false)),
        at_once: Arc::default(),
        save: Arc::new(AtomicBool::new(false)),
    }
}

/// A directory in memory, where the system has one.
pub fn directory() -> TempDir {
    let memory = Path::new("/dev/shm");
    let place = if memory.is_dir() {
        memory.to_path_buf()
    } else {
        std::env::temp_dir()
    };
    tempfile::Builder::new()
        .prefix("tandem-fuzz-")
        .tempdir_in(place)
        .expect("a directory for files of a target")
}

fn left() -> Left {
    let dir = directory();
    let file = SceneFile::of_text("scene.toml", SCENE, dir.path());
    let scene = file.and_then(|file| file.scene(None, &[]));
    let scene = scene.unwrap_or_else(|errors| panic!("{errors}"));
    let run = RunDir::create(dir.path(), &scene.resolved_toml).expect("an empty directory");
    let finished = coupler::run::run(&scene, &options(), &run, None);
    assert_eq!(
        finished.summary.status,
        Status::Done,
        "{:?}",
        finished.summary.reason
    );
    drop(run);
    let recording = dir.path().join("recording.tandem");
    let mut playback = Playback::open(&recording).expect("a recording");
    let mut messages = Vec::new();
    while let Some(message) = playback.message().expect("a whole recording") {
        messages.push(message);
    }
    let frames = std::fs::read_dir(dir.path().join("frames")).expect("the frames of the run");
    let frames = frames.flatten().map(|entry| {
        let name = entry.file_name().into_string().expect("a plain name");
        (name, std::fs::read(entry.path()).expect("a frame"))
    });
    Left {
        recording: std::fs::read(recording).expect("a recording"),
        messages,
        frames: frames.collect(),
    }
}
