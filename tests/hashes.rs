//! The bits of every scene and variant are those of `tests/hashes/baseline.csv`, however a run is made.
//! So a change of the structure is seen to have changed no number, and no way to run a scene to change a bit.
//! A run that stops by itself also says why.
//!
//! The normal command runs every row that is quick in one way, the ways taking turns; `scenes.rs` compares the variants
//! called `quick`, which it runs anyway. All rows take half an hour in the same manner; `TANDEM_NIGHT`, the number of a night,
//! takes a quarter of them, which after four nights has another way:
//!
//!     TANDEM_NIGHT=3 cargo test --release --test tandem-tests -- --ignored --nocapture every_row
//!
//! A change of arithmetic that is meant takes rows again instead, which then replace those of `baseline.csv` in a commit of its
//! own that says what changed them:
//!
//!     TANDEM_RETAKE=rows.csv cargo test --release --test tandem-tests -- --ignored every_row
//!
//! Another compiler or C library may change last bits too (ARCHITECTURE.md, "Where determinism comes from"): where the
//! build that took a row does not give its hashes, that build takes it again first.
//!
//! For these two commands, `TANDEM_SCENES="silo d2cm"` leaves out rows without this in scene and variant; for the first of
//! them, `TANDEM_LONGEST=20` leaves out rows that take more than 20 s.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use coupler::record::summary::Status;
use coupler::scene::Scene;

use crate::harness::{Place, RunFiles, at_once, catalogue, has, root, scene};

/// Ways to run a scene that must not show in its result; the first is the one that the file was taken with.
pub const WAYS: [&str; 7] = [
    "",
    "--in-process",
    "--threads 2",
    "--window 1",
    "--window 7",
    "--window 64",
    "--in-process --threads 2 --window 7",
];

/// Longest run in s, as the file has it, that the normal command makes.
const QUICK: f64 = 0.8;
/// Longest wait for a run that is taken for the first time.
const PATIENCE: Duration = Duration::from_mins(30);
/// Nights after which all rows have been run.
const NIGHTS: usize = 4;
/// Runs at a time; each has three processes.
pub const WORKERS: usize = 2;

const HEADER: &str = "scene,variant,exit,steps,state_hash,history_lines,history_blake3,wall_s";
/// The variant that `tests/scenes.rs` runs of every scene.
pub const QUICK_VARIANT: &str = "quick";
/// The variant of a scene as it stands.
const PLAIN: &str = "plain";
/// Stands for the state and the steps that a run does not have.
const NONE: &str = "none";
/// Exit status of a run that a solver has stopped. It stops within a window, of which nothing is reported: what was
/// reported of the last steps depends on the window.
const STOPPED: i32 = 3;

/// A scene of the catalogue and one of its variants, or [`PLAIN`].
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Case {
    pub scene: String,
    pub variant: String,
}

/// What must be the same to the bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    pub exit: i32,
    /// Number of steps; [`NONE`] if [`STOPPED`].
    steps: String,
    /// `state_hash` of the summary; [`NONE`] if the end was not reached.
    state: String,
    /// Lines of `history.csv` that the hash is of: all but those that depend on the window.
    lines: usize,
    /// BLAKE3 of these lines.
    history: String,
}

/// A row of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub case: Case,
    pub outcome: Outcome,
    /// Wall time of the run in s when it was taken: shows what is quick, and is not compared.
    pub wall: f64,
}

impl Row {
    /// Longest wait for it, in the slowest way on a busy machine.
    fn patience(&self) -> Duration {
        Duration::from_mins(2) + Duration::from_secs_f64(40.0 * self.wall)
    }

    fn parse(line: &str) -> Self {
        let fields: Vec<&str> = line.split(',').collect();
        let &[scene, variant, exit, steps, state, lines, history, wall] = &fields[..] else {
            panic!("not `{HEADER}`: {line}");
        };
        let outcome = Outcome {
            exit: exit.parse().expect("an exit status"),
            steps: steps.into(),
            state: state.into(),
            lines: lines.parse().expect("a count"),
            history: history.into(),
        };
        Self {
            case: Case::new(scene, variant),
            outcome,
            wall: wall.parse().expect("a time"),
        }
    }

    fn line(&self) -> String {
        let (Case { scene, variant }, o) = (&self.case, &self.outcome);
        format!(
            "{scene},{variant},{},{},{},{},{},{:.1}",
            o.exit, o.steps, o.state, o.lines, o.history, self.wall
        )
    }
}

/// The option of a variant; none for the scene as it stands.
fn option(variant: &str) -> String {
    match variant {
        PLAIN => String::new(),
        variant => format!("--variant {variant}"),
    }
}

impl Case {
    fn new(scene: &str, variant: &str) -> Self {
        Self {
            scene: scene.into(),
            variant: variant.into(),
        }
    }

    /// Whether it belongs to the scenes not all of which are to reach their end.
    pub fn is_at_the_edge(&self) -> bool {
        self.scene.starts_with("extreme/")
    }

    /// Runs it, which may take `patience`. For `lines` see [`Outcome::of`].
    fn run(&self, way: &str, lines: Option<usize>, patience: Duration) -> Row {
        let (place, path) = (Place::new(), scene(&self.scene));
        let out = place.path("out");
        let line = format!("run '{path}' --out out {way} {}", option(&self.variant));
        let ended = place.start(&line).end_within(patience);
        place.assert_clean(&ended.runs);
        let files = RunFiles::read(&out);
        let exit = ended.status.code().expect("it is not killed");
        let outcome = Outcome::of(&files, exit, lines);
        if exit > 1 {
            self.assert_says_why(&files);
        }
        let (case, wall) = (self.clone(), files.number("wall_s"));
        Row {
            case,
            outcome,
            wall,
        }
    }

    /// What the reason has of each that stops by itself.
    fn reason(&self) -> &'static [&'static str] {
        match self.scene.as_str() {
            "extreme/forced" => &["at t = ", "created numerically", "unstable with dt = "],
            // A point outside of the domain, by its number and place.
            "extreme/leaving" | "extreme/rest" => {
                &["the mpm stopped at step", "point", "left the domain at ("]
            }
            "extreme/mach" => &[
                "the dem stopped at step",
                "has passed through body 0 (wall) with an overlap of",
            ],
            "extreme/squeeze" | "extreme/thin_floor" => &[
                "the dem stopped at step",
                "is near the middle of body",
                "with an overlap of",
                "stiffer contact",
            ],
            "extreme/chain" => &[
                "marker 1 of chain 0 at (0.1, 0.12) m has lost its material",
                "no node near it has mass",
            ],
            "extreme/ring" | "chen2023/rings" => &[
                "of groups 0 and 1 overlap by",
                "they would pass through one another",
                "stiffer contact",
            ],
            _ => panic!("{self:?} stops: with which reason?"),
        }
    }

    /// Asserts that a run that stopped says why, and leaves finite numbers only.
    fn assert_says_why(&self, files: &RunFiles) {
        for words in self.reason() {
            has(files.text("reason"), words);
        }
        // A NaN would be a null, or a word in the history.
        for key in ["/energy/start", "/energy/end", "/momentum_error"] {
            let numbers = files.summary.pointer(key).expect("numbers").to_string();
            assert!(!numbers.contains("null"), "{self:?}: {numbers}");
        }
        if files.number("steps") > 0.0 {
            files.history().assert_sound();
        }
    }
}

impl Outcome {
    /// Of a run, by its files. If a solver has stopped it, `lines` of the history are looked at; without, all but the last,
    /// which a shorter or longer window may lack.
    pub fn of(files: &RunFiles, exit: i32, lines: Option<usize>) -> Self {
        let steps = files.summary["steps"].to_string();
        let history = files.dir.join("history.csv");
        let history = fs::read_to_string(history).expect("a run leaves a history");
        let mut rows: Vec<&str> = history.split_inclusive('\n').collect();
        if exit == STOPPED {
            rows.truncate(lines.unwrap_or(rows.len() - 1));
        }
        Self {
            exit,
            steps: if exit == STOPPED { NONE.into() } else { steps },
            state: files.summary["state_hash"].as_str().unwrap_or(NONE).into(),
            lines: rows.len(),
            history: blake3::hash(rows.concat().as_bytes()).to_string(),
        }
    }
}

/// The rows of the file, which begins with comments and a line that names the columns.
pub fn baseline() -> Vec<Row> {
    let path = root().join("tests/hashes/baseline.csv");
    let text = fs::read_to_string(path).expect("the file is there");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    assert_eq!(lines.next(), Some(HEADER));
    lines.map(Row::parse).collect()
}

/// Every scene of the catalogue, plain and with each of its variants.
fn cases() -> Vec<Case> {
    let folder = root().join("scenes");
    let of_scene = |path: &PathBuf| {
        let name = path.strip_prefix(&folder).unwrap().with_extension("");
        let name = name.to_str().expect("scenes have UTF-8 names").to_string();
        let table: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
        let variants = table.get("variant").and_then(toml::Value::as_table);
        // One that begins with another run is not alone what it is.
        let alone =
            |(name, set): (_, &toml::Value)| set.get("start.from").is_none().then_some(name);
        let variants = variants.into_iter().flatten().filter_map(alone);
        let variants: Vec<&String> = variants.collect();
        let plain = Case::new(&name, PLAIN);
        let variants = variants
            .into_iter()
            .map(|variant| Case::new(&name, variant));
        std::iter::once(plain).chain(variants).collect::<Vec<_>>()
    };
    catalogue().iter().flat_map(of_scene).collect()
}

/// The number of the night whose part of the work the environment asks for.
fn night() -> Option<usize> {
    let night = std::env::var("TANDEM_NIGHT").ok()?;
    Some(night.parse().expect("TANDEM_NIGHT is a whole number"))
}

/// What of long work is done in this night; all of it if there is none.
pub fn of_the_night<W>(work: Vec<W>) -> Vec<W> {
    let Some(night) = night() else { return work };
    let work = work.into_iter().skip(night % NIGHTS);
    work.step_by(NIGHTS).collect()
}

/// Whether the environment asks for a scene.
fn wanted(case: &Case) -> bool {
    let part = std::env::var("TANDEM_SCENES").unwrap_or_default();
    format!("{} {}", case.scene, case.variant).contains(&part)
}

/// Runs rows, each in its way, and asserts that they come out as the file says.
fn assert_same_bits(work: &[(&Row, &str)]) {
    let complaints = at_once(WORKERS, work, |(row, way)| {
        let Case { scene, variant } = &row.case;
        let name = format!("{scene}, variant {variant}, way {way:?}");
        let found = row.case.run(way, Some(row.outcome.lines), row.patience());
        let same = found.outcome == row.outcome;
        println!("{name}: {:.1} s, the same: {same}", found.wall);
        (!same).then(|| format!("{name}: {:?} instead of {:?}", found.outcome, row.outcome))
    });
    let complaints: Vec<String> = complaints.into_iter().flatten().collect();
    assert!(
        complaints.is_empty(),
        "{} of {} runs differ from tests/hashes/baseline.csv:\n{}",
        complaints.len(),
        work.len(),
        complaints.join("\n")
    );
}

/// But for the variants called `quick`, whose bits [`scenes`](crate::scenes) compares.
#[test]
fn every_quick_row_has_its_bits() {
    let rows = baseline();
    // Those at the edge as well, longer ones too.
    let quick = rows.iter().filter(|row| {
        if row.case.is_at_the_edge() {
            row.wall < 5.0
        } else {
            row.wall <= QUICK && row.case.variant != QUICK_VARIANT
        }
    });
    let work: Vec<_> = quick.zip(WAYS.into_iter().cycle()).collect();
    assert!(work.len() > 50, "only {} rows are quick", work.len());
    assert_same_bits(&work);
}

#[test]
#[ignore = "takes half an hour"]
fn every_row_has_its_bits() {
    if let Some(file) = std::env::var_os("TANDEM_RETAKE") {
        return retake(&file);
    }
    let longest = std::env::var("TANDEM_LONGEST").map_or(f64::INFINITY, |longest| {
        longest.parse().expect("TANDEM_LONGEST is in s")
    });
    let rows = baseline();
    let rows = rows
        .iter()
        .filter(|row| row.wall <= longest && wanted(&row.case));
    let round = night().map_or(0, |night| night / NIGHTS);
    let ways = WAYS.into_iter().cycle().skip(round % WAYS.len());
    let work = of_the_night(rows.zip(ways).collect());
    assert!(!work.is_empty(), "no row is left to run");
    assert_same_bits(&work);
}

#[test]
fn every_scene_and_variant_has_a_row() {
    let mut listed: Vec<Case> = baseline().into_iter().map(|row| row.case).collect();
    let mut there = cases();
    listed.sort();
    there.sort();
    assert_eq!(listed, there);
}

/// A scene passes, or says that it does not and why.
#[test]
fn every_row_ends_as_its_scene_says() {
    let mut wrong = Vec::new();
    for Row { case, outcome, .. } in baseline() {
        let variant = (case.variant != PLAIN).then_some(case.variant.as_str());
        let scene = Scene::load(Path::new(&scene(&case.scene)), variant, &[]);
        let status = match outcome.exit {
            0 => Status::Done,
            1 => Status::CheckFailed,
            _ => Status::Failed,
        };
        let expected = scene.expect("it is a scene").expect;
        if expected.is_met(status) != Some(true) {
            wrong.push(format!(
                "{} {}: exit {}, {expected:?}",
                case.scene, case.variant, outcome.exit
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Writes rows as `baseline.csv` has them.
fn retake(file: &OsStr) {
    let cases: Vec<Case> = cases().into_iter().filter(wanted).collect();
    let rows = at_once(WORKERS, &cases, |case| {
        case.run(WAYS[0], None, PATIENCE).line()
    });
    let text = format!("{HEADER}\n{}\n", rows.join("\n"));
    fs::write(root().join(file), text).expect("the file can be written");
}
