//! What is measured, each beside its yardstick.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use coupler::record::rundir::RunDir;
use coupler::record::summary::Status;
use coupler::run::{RunOptions, Solvers};
use coupler::scene::Scene;
use interface::config::MaterialModel;
use interface::hosted::Host;
use interface::session::together::Together;
use interface::solver::MpmSolver;
use interface::step::Step;
use mechanics::generate::Grain;
use mpm_proc::Mpm;

use crate::grain_box::{DT, PENTAGON, pile, run, step};
use crate::yardsticks::{Grid, Mail, PlainDiscs, Polygons};
use column::{ELASTIC, SAND, column};
use toys::{Course, HalfPlane, Points};

#[path = "../../../mpm-proc/tests/column.rs"]
mod column;
#[path = "../../../interface/tests/toys/mod.rs"]
mod toys;

/// A slice of work: a few milliseconds.
type Slice = Box<dyn FnMut()>;

/// A job and its yardstick.
pub struct Job {
    /// As in `ratios.csv`.
    pub name: &'static str,
    /// How often both take turns.
    pub turns: usize,
    /// Both from their start.
    pub start: fn() -> (Slice, Slice),
}

/// All of them.
pub const JOBS: [Job; 6] = [
    Job {
        name: "discs",
        turns: 250,
        start: discs,
    },
    Job {
        name: "pentagons",
        turns: 250,
        start: pentagons,
    },
    Job {
        name: "elastic",
        turns: 250,
        start: || continuum(ELASTIC),
    },
    Job {
        name: "sand",
        turns: 250,
        start: || continuum(SAND),
    },
    Job {
        name: "coupled",
        turns: 15,
        start: coupled,
    },
    Job {
        name: "exchange",
        turns: 150,
        start: exchange,
    },
];

/// A settled pile of 1,000 discs.
fn discs() -> (Slice, Slice) {
    let mut dem = run(&pile(Grain::Disc, 1000), 500);
    let mut plain = PlainDiscs::settled(&dem);
    let work = move || (0..80).for_each(|_| step(&mut dem, DT, false));
    let plain = move || {
        plain.run(360);
    };
    (Box::new(work), Box::new(plain))
}

/// A settled pile of 500 spheropentagons.
fn pentagons() -> (Slice, Slice) {
    let mut dem = run(&pile(PENTAGON, 500), 500);
    let mut plain = Polygons::new(600);
    let work = move || (0..60).for_each(|_| step(&mut dem, DT, false));
    (Box::new(work), Box::new(move || plain.run(20)))
}

/// A column of 10,000 points that collapses.
fn continuum(model: MaterialModel) -> (Slice, Slice) {
    let mut mpm = Mpm::new();
    let ready = mpm.configure(&column(10_000, 1, model)).expect("a column");
    let dt = 0.3 * ready.courant_time;
    let mut step = Step {
        index: 0,
        time: 0.0,
        dt_before: dt,
        dt,
        measure: false,
    };
    let work = move || {
        for _ in 0..8 {
            mpm.step(&step, &[]).expect("a sound step");
            step.index += 1;
            step.time += dt;
        }
    };
    let mut plain = Grid::new(5_000);
    (Box::new(work), Box::new(move || plain.run(16)))
}

/// A whole run of a quick scene in this process, from the scene to the files that it leaves.
fn coupled() -> (Slice, Slice) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let path = root.join("scenes/jiang2020/collision_hard.toml");
    let scene = Scene::load(&path, Some("quick"), &[]).expect("a scene");
    let work = move || {
        let memory = Path::new("/dev/shm");
        let place = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        };
        let dir = place.expect("a directory for the run");
        let run = RunDir::create(dir.path(), &scene.resolved_toml).expect("an empty directory");
        let finished = coupler::run::run(&scene, &options(), &run, None);
        assert_eq!(finished.summary.status, Status::Done);
    };
    let mut grid = Grid::new(2_000);
    let plain = move || grid.run(600);
    (Box::new(work), Box::new(plain))
}

fn options() -> RunOptions {
    RunOptions {
        screen: None,
        solvers: Solvers::InProcess {
            mpm: || Box::new(mpm_proc::Mpm::default()),
            dem: || Box::new(dem_proc::Sdem::default()),
        },
        threads: 1,
        window: None,
        record: false,
        trace: None,
        progress: false,
        patience: Duration::from_mins(1),
        stepping: None,
        interrupt: Arc::new(AtomicBool::new(false)),
        at_once: Arc::default(),
        save: Arc::new(AtomicBool::new(false)),
    }
}

/// 20,000 coupled steps of two solvers that compute next to nothing, by direct calls.
fn exchange() -> (Slice, Slice) {
    let work = || {
        let points = Host::Mpm(Box::new(Points::new(0)));
        let wall = Host::Dem(Box::<HalfPlane>::default());
        let mut course = Course::still(20_000, 64);
        let [coupler, ..] = Together::of(&mut course, [points, wall]).run();
        coupler.expect("an orderly end");
    };
    let mut mail = Mail::default();
    (Box::new(work), Box::new(move || mail.run(400_000)))
}
