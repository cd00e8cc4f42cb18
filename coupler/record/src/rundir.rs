//! The run directory: the files of a run, and the lock on them (docs/run-directory.md).
//!
//! One run at a time: [`RunDir`] holds a lock on a file in it. A list beside the lock names every file that Tandem has
//! written there; nothing else is ever removed. If there are files of an earlier run, a new run is built in a folder of
//! the directory and replaces them when its solvers are ready.

mod list;
mod lock;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufRead as _, BufReader, ErrorKind, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use interface::files::{self, How, SMALL};
use interface::message::wire::BodyState;
use interface::transport::vanished;

use self::list::{WRITTEN, Written};
pub use self::lock::in_use;
use self::lock::{LOCK, Lock};
pub use super::error::RunDirError;
use super::error::fail;
use super::frames::PARTS;
use super::summary::{SUMMARY, Summary};

/// The scene, with all that it takes from elsewhere.
pub const SCENE: &str = "scene.toml";
/// The messages of the run, one JSON object a line.
pub const LOG: &str = "log.jsonl";
/// The columns of the scene over time.
pub const HISTORY: &str = "history.csv";
/// Energies of the ledger and counts of steps over time.
pub const COURSE: &str = "course.csv";
/// Folder of the checkpoints.
pub const CHECKPOINTS: &str = "checkpoints";
/// Folder of the frames.
pub const FRAMES: &str = "frames";
/// A run as a page for a browser.
pub const REPORT: &str = "report.html";
/// ParaView's list of the frames.
pub const FRAME_LIST: &str = "frames/frames.pvd";
const BODIES: &str = "bodies.csv";
/// Every message of the run.
pub const RECORDING: &str = "recording.tandem";
/// The files that a resumed run goes on with.
const GROWING: [&str; 5] = [HISTORY, COURSE, LOG, "mpm.log", "dem.log"];
/// Folder of a new run, while the files of an earlier one are still there.
const NEXT: &str = ".tandem.next";
/// Folder of the files of the earlier run while they are replaced.
const EARLIER: &str = ".tandem.earlier";
/// Folder of a run that failed to start, beside the result of an earlier one.
pub(crate) const FAILED_START: &str = "failed-start";

/// A run directory in use.
#[derive(Debug, Clone)]
pub struct RunDir {
    root: PathBuf,
    inner: Arc<Mutex<Inner>>,
}

#[derive(Debug)]
struct Inner {
    /// The folder of the files within the directory; empty for the directory itself.
    place: PathBuf,
    /// Names of the files of this run.
    ours: Written,
    /// Names of the files of the run that this one replaces.
    earlier: BTreeSet<String>,
    /// Locked as long as it is open.
    lock: Lock,
}

impl RunDir {
    /// The directory of a new run, with its scene, before anything is started. Files of an earlier run stay there until
    /// [`Self::take_place`].
    ///
    /// # Errors
    /// [`RunDirError`]: another run uses the directory, it cannot be written, or it contains a file that is in the way.
    /// Then nothing is changed.
    pub fn create(path: &Path, scene: &str) -> Result<Self, RunDirError> {
        let existed = path.exists();
        fs::create_dir_all(path).map_err(fail("create the run directory", path))?;
        let locked_before = files::is_there(path, LOCK);
        let made = Self::create_in(path, scene);
        // If another run uses the directory, the lock belongs to that run.
        if !locked_before && !matches!(made, Ok(_) | Err(RunDirError::InUse { .. })) {
            let _ = files::remove(path, LOCK);
            if !existed {
                let _ = files::remove(path, WRITTEN);
                let _ = fs::remove_dir(path);
            }
        }
        made
    }

    fn create_in(path: &Path, scene: &str) -> Result<Self, RunDirError> {
        let lock = Lock::take(path)?;
        roll_back(path)?;
        let earlier = written(path)?;
        if let Some(name) = in_the_way(path, &earlier) {
            return Err(RunDirError::NotOurs(path.join(name)));
        }
        plain(path, &earlier)?;
        remove_all(&path.join(NEXT))?;
        let place = if earlier.iter().any(|name| files::is_there(path, name)) {
            PathBuf::from(NEXT)
        } else {
            PathBuf::new()
        };
        let inner = Inner {
            ours: Written::open(path, &place, BTreeSet::new())?,
            place,
            earlier,
            lock,
        };
        let dir = Self {
            root: path.to_path_buf(),
            inner: Arc::new(Mutex::new(inner)),
        };
        dir.replace(SCENE, scene.as_bytes(), false)?;
        Ok(dir)
    }

    /// The directory of a run that continues.
    ///
    /// # Errors
    /// [`RunDirError`] if another run uses it, or if it cannot be written.
    pub fn reopen(path: &Path) -> Result<Self, RunDirError> {
        let lock = Lock::take(path)?;
        roll_back(path)?;
        remove_all(&path.join(NEXT))?;
        let names = written(path)?;
        plain(path, &names)?;
        // Before anything is changed: a file with a second name cannot be.
        for name in GROWING {
            if files::is_there(path, name) {
                files::open(path, name, How::Change)
                    .map_err(fail("go on with", &path.join(name)))?;
            }
        }
        let inner = Inner {
            place: PathBuf::new(),
            ours: Written::open(path, Path::new(""), names)?,
            earlier: BTreeSet::new(),
            lock,
        };
        Ok(Self {
            root: path.to_path_buf(),
            inner: Arc::new(Mutex::new(inner)),
        })
    }

    /// Path of the directory.
    pub fn path(&self) -> &Path {
        &self.root
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().expect("no thread panics with the lock")
    }

    /// Whether the files of an earlier run are still in their place.
    pub fn is_beside(&self) -> bool {
        self.inner().place != Path::new("")
    }

    /// Whether Tandem has written this file.
    pub(crate) fn has_written(&self, name: &str) -> bool {
        self.inner().ours.names.contains(name)
    }

    /// Notes that this run writes a file of this name, if the directory is still its own; returns its name in the directory and
    /// its path.
    fn claim(&self, name: &str) -> Result<(PathBuf, PathBuf), RunDirError> {
        let mut inner = self.inner();
        let name_here = inner.place.join(name);
        let path = self.root.join(&name_here);
        inner.lock.is_at(&self.root).map_err(fail("write", &path))?;
        inner.ours.add(name).map_err(fail("write", &path))?;
        Ok((name_here, path))
    }

    /// Opens a file and notes that this run writes it; returns the file and its path.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn open(&self, name: &str, how: How) -> Result<(File, PathBuf), RunDirError> {
        let (name, path) = self.claim(name)?;
        let action = match how {
            How::Replace | How::Make => "create",
            _ => "write",
        };
        let file = files::open(&self.root, name, how).map_err(fail(action, &path))?;
        Ok((file, path))
    }

    /// Notes that this run writes its page.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn report(&self) -> Result<(), RunDirError> {
        self.claim(REPORT).map(|_| ())
    }

    /// The run has started. It replaces the earlier one, whose files are removed. Files that others have put into the
    /// directory stay.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn take_place(&self) -> Result<(), RunDirError> {
        let mut inner = self.inner();
        if inner.place == Path::new("") {
            return Ok(());
        }
        let (root, next) = (&self.root, Path::new(NEXT));
        // A summary marks a run as complete, so it is moved first.
        let summary = inner.earlier.contains(SUMMARY).then_some(SUMMARY);
        let others = inner.earlier.iter().map(String::as_str);
        for name in summary.into_iter().chain(others) {
            displace(root, name, Path::new(EARLIER).join(name))?;
        }
        displace(root, next.join(WRITTEN), WRITTEN)?;
        for name in &inner.ours.names {
            displace(root, next.join(name), name)?;
        }
        remove_all(&root.join(NEXT))?;
        // From here on there is no way back.
        inner.place = PathBuf::new();
        remove_all(&root.join(EARLIER))?;
        // Removes empty folders; folders with files of others are not empty.
        for folder in [FRAMES, CHECKPOINTS, FAILED_START] {
            let _ = files::remove_folder(root, folder);
        }
        Ok(())
    }

    /// The run has ended, started or not; returns the path of its files. A run that never started leaves the result of
    /// the earlier run as it is, with its own files in a folder beside it. If there was no result, it replaces the
    /// earlier run anyway.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn settle(&self) -> Result<PathBuf, RunDirError> {
        if self.is_beside() {
            // It may have failed while it replaced the earlier run.
            roll_back(&self.root)?;
            if !has_result(&self.root) {
                self.take_place()?;
            }
        }
        let mut inner = self.inner();
        if inner.place == Path::new("") {
            return Ok(self.root.clone());
        }
        let (next, aside) = (Path::new(NEXT), Path::new(FAILED_START));
        let mut known = written(&self.root)?;
        known.extend(inner.earlier.iter().cloned());
        // Removes files of an earlier attempt.
        for name in known
            .iter()
            .filter(|name| Path::new(name).starts_with(aside))
        {
            let _ = files::remove(&self.root, name);
        }
        for name in &inner.ours.names {
            displace(&self.root, next.join(name), aside.join(name))?;
            known.insert(format!("{FAILED_START}/{name}"));
        }
        remove_all(&self.root.join(NEXT))?;
        inner.ours = Written::open(&self.root, Path::new(""), known)?;
        inner.place = aside.to_path_buf();
        Ok(self.root.join(aside))
    }

    /// Removes all that this run has written, and the directory if nothing else is in it. Errors leave files of the run there, which
    /// the next one replaces.
    pub fn discard(&self) {
        let inner = self.inner();
        if inner.place != Path::new("") {
            let _ = remove_all(&self.root.join(NEXT));
            return;
        }
        let ours = inner.ours.names.iter().map(String::as_str);
        for name in ours.chain([WRITTEN, LOCK]) {
            let _ = files::remove(&self.root, name);
        }
        for folder in [FRAMES, CHECKPOINTS] {
            let _ = files::remove_folder(&self.root, folder);
        }
        let _ = fs::remove_dir(&self.root);
    }

    /// Writes `summary.json`.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn write_summary(&self, summary: &Summary) -> Result<(), RunDirError> {
        self.replace(SUMMARY, &json_of(summary), false)
    }

    /// Gives a file of the run the name [`aside`], where it stays.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub(crate) fn put_aside(&self, name: &str) -> Result<(), RunDirError> {
        displace(self.path(), name, aside(self.path(), name))
    }

    /// Keeps a summary that is written if the shared memory of the run vanishes, which ends this process at once; `None` keeps
    /// nothing.
    pub fn leave_summary(&self, summary: Option<&Summary>) {
        vanished::leave(self.path(), SUMMARY, summary.map(json_of));
    }

    /// Writes `bodies.csv`: the bodies at the end, one row each, in the order of the scene. The position is that of the
    /// centre of mass.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn write_bodies<'a>(
        &self,
        names: impl Iterator<Item = &'a str>,
        bodies: &[BodyState],
    ) -> Result<(), RunDirError> {
        let mut text = "name,x [m],y [m],angle [rad],vx [m/s],vy [m/s],spin [rad/s]\n".to_owned();
        for (name, b) in names.zip(bodies) {
            let ([x, y], [vx, vy]) = (b.position, b.velocity);
            let _ = writeln!(text, "{name},{x},{y},{},{vx},{vy},{}", b.angle, b.spin);
        }
        self.replace(BODIES, text.as_bytes(), false)
    }

    /// Writes a whole file: a reader sees the old one or the new one, never a part. With `durably` the file is on the disk when
    /// this returns.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn replace(&self, name: &str, bytes: &[u8], durably: bool) -> Result<(), RunDirError> {
        let (name, path) = self.claim(name)?;
        Ok(files::replace(&self.root, name, bytes, durably).map_err(fail("write", &path))?)
    }
}

/// The first free name for a changed table of a run directory: `history.csv.changed`, `history.csv.changed-2`.
pub fn aside(dir: &Path, table: &str) -> String {
    let mut name = format!("{table}.changed");
    for k in 2.. {
        if !files::is_there(dir, &name) {
            break;
        }
        name = format!("{table}.changed-{k}");
    }
    name
}

/// Whether the files in a directory are those of an earlier run, which a new one has not replaced yet.
pub fn is_to_be_replaced(dir: &Path) -> bool {
    files::is_there(dir, NEXT)
}

/// The names of the files in a run directory that Tandem has written, by its list.
fn written(dir: &Path) -> Result<BTreeSet<String>, RunDirError> {
    let list = match files::read_text(dir, WRITTEN, SMALL) {
        Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
        list => list.map_err(fail("read", &dir.join(WRITTEN)))?,
    };
    let names = list.lines().filter(|name| is_inside(name));
    Ok(names.map(str::to_owned).collect())
}

/// Refuses a directory in which a link or a special file is in the place of one of these files of a run, or a link in that
/// of a folder.
fn plain(dir: &Path, names: &BTreeSet<String>) -> Result<(), RunDirError> {
    for folder in [FRAMES, CHECKPOINTS, FAILED_START] {
        files::no_link(dir, folder).map_err(fail("use", &dir.join(folder)))?;
    }
    for name in names.iter().chain(&named_as_ours(dir)) {
        files::is_regular(dir, name).map_err(fail("use", &dir.join(name)))?;
    }
    Ok(())
}

/// Whether a name stays inside the directory, whoever has written the list.
fn is_inside(name: &str) -> bool {
    let parts = Path::new(name).components();
    !name.is_empty()
        && parts
            .into_iter()
            .all(|part| matches!(part, std::path::Component::Normal(_)))
}

/// The files that have the name of a file of a run.
fn named_as_ours(dir: &Path) -> BTreeSet<String> {
    let own = [SUMMARY, SCENE, LOG, HISTORY, COURSE, BODIES, RECORDING];
    let all = own.iter().chain(&["mpm.log", "dem.log"]);
    let mut names: BTreeSet<String> = all.map(ToString::to_string).collect();
    let numbered = |folder: &str, name: &str| match folder {
        FRAMES => {
            let frame = name.strip_suffix(".vtu").and_then(|n| n.split_once('_'));
            let is_frame = |(part, number)| PARTS.contains(&part) && is_number(number);
            name == "frames.pvd" || frame.is_some_and(is_frame)
        }
        _ => name.strip_suffix(".tandem").is_some_and(|state| {
            // One that is kept for other scenes.
            is_number(state.strip_suffix(".kept").unwrap_or(state))
        }),
    };
    for folder in [FRAMES, CHECKPOINTS] {
        for name in files::names(dir, folder).unwrap_or_default() {
            if numbered(folder, &name) {
                names.insert(format!("{folder}/{name}"));
            }
        }
    }
    names.retain(|name| files::is_there(dir, name));
    names
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// A file that a run would replace and that no run has written.
fn in_the_way(dir: &Path, earlier: &BTreeSet<String>) -> Option<String> {
    let mut names = named_as_ours(dir).into_iter();
    names.find(|name| !earlier.contains(name))
}

/// Whether a run that did a step has left a result.
fn has_result(dir: &Path) -> bool {
    // A killed coupler leaves the history, and perhaps a checkpoint. The history may be of any length.
    let rows = || {
        let history = files::open(dir, HISTORY, How::Read);
        history.is_ok_and(|file| BufReader::new(file.take(SMALL)).lines().nth(1).is_some())
    };
    Summary::read(dir).map_or_else(|_| rows(), |summary| summary.steps > 0)
}

/// Undoes the exchange of a run that was killed, or failed, while it replaced another one. That run had done nothing yet,
/// so the other one gets its place back, and its own files are in their folder again.
fn roll_back(dir: &Path) -> Result<(), RunDirError> {
    let (next, away) = (Path::new(NEXT), Path::new(EARLIER));
    // If the folder of the new run does not exist, the exchange was complete.
    if files::is_there(dir, next) && files::is_there(dir, away) {
        let mut names = files_below(dir, EARLIER).map_err(fail("read", &dir.join(away)))?;
        let listed = written(dir)?;
        // The new list is moved first, and from then on it is the list of the directory.
        if files::is_there(dir, next.join(WRITTEN)) {
            names.extend(listed);
        } else {
            let moved = listed.iter().filter(|name| files::is_there(dir, name));
            for name in moved {
                displace(dir, name, next.join(name))?;
            }
        }
        for name in &names {
            displace(dir, away.join(name), name)?;
        }
        Written::open(dir, Path::new(""), names)?;
    }
    remove_all(&dir.join(away))
}

/// Names of all files in a folder of the directory and in its folders.
fn files_below(dir: &Path, folder: &str) -> io::Result<BTreeSet<String>> {
    let mut below = BTreeSet::new();
    for name in files::names(dir, folder)? {
        let path = format!("{folder}/{name}");
        match files_below(dir, &path) {
            Ok(files) => below.extend(files.iter().map(|file| format!("{name}/{file}"))),
            Err(_) => _ = below.insert(name),
        }
    }
    Ok(below)
}

/// Moves a file within the directory; a missing file is ignored.
fn displace(dir: &Path, from: impl AsRef<Path>, to: impl AsRef<Path>) -> Result<(), RunDirError> {
    let path = dir.join(to.as_ref());
    Ok(files::rename(dir, from, to).map_err(fail("replace", &path))?)
}

/// Removes a folder that Tandem alone uses.
fn remove_all(folder: &Path) -> Result<(), RunDirError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(fail("remove", folder)(error).into())
        }
        _ => Ok(()),
    }
}

/// The content of `summary.json`.
fn json_of(summary: &Summary) -> Vec<u8> {
    let mut json = serde_json::to_vec_pretty(summary).expect("a summary has string keys only");
    json.push(b'\n');
    json
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bodies_read_back_to_the_same_bits() {
        let dir = tempfile::tempdir().unwrap();
        let run = RunDir::create(dir.path(), "").unwrap();
        let grain = BodyState {
            position: [0.1 + 0.2, -1e-300 / 3.0],
            angle: 7.0,
            spin: 2.0 / 3.0,
            ..BodyState::default()
        };
        run.write_bodies(
            ["floor", "grain_0"].into_iter(),
            &[BodyState::default(), grain],
        )
        .unwrap();
        let mut file = csv::Reader::from_path(dir.path().join("bodies.csv")).unwrap();
        let row = file.records().nth(1).unwrap().unwrap();
        assert_eq!(&row[0], "grain_0");
        let numbers: Vec<f64> = row.iter().skip(1).map(|n| n.parse().unwrap()).collect();
        let [x, y] = grain.position;
        assert_eq!(numbers, [x, y, grain.angle, 0.0, 0.0, grain.spin]);
    }

    /// Another run may have the directory that is in the place of one that was moved away.
    #[test]
    fn a_run_whose_directory_was_moved_writes_in_no_other() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("run");
        let moved = RunDir::create(&path, "moved").unwrap();
        moved.replace(HISTORY, b"moved", false).unwrap();
        fs::rename(&path, place.path().join("elsewhere")).unwrap();
        let other = RunDir::create(&path, "other").unwrap();
        let error = moved.replace(HISTORY, b"moved", false).unwrap_err();
        assert!(error.advice().contains("was moved"), "{error}");
        assert!(!path.join(HISTORY).exists());
        other.replace(HISTORY, b"other", false).unwrap();
    }

    /// A directory with the files of an earlier run, and a new run that is about to take its place.
    fn exchange(root: &Path) -> RunDir {
        let earlier = RunDir::create(root, "earlier").unwrap();
        earlier.replace(BODIES, b"earlier", false).unwrap();
        earlier
            .replace("frames/points_0000.vtu", b"earlier", false)
            .unwrap();
        drop(earlier);
        let new = RunDir::create(root, "new").unwrap();
        new.replace(HISTORY, b"new", false).unwrap();
        assert!(new.is_beside());
        new
    }

    /// Killed at any moment of the exchange: one of the two runs is there as a whole, and no file of the other one.
    #[test]
    fn an_exchange_that_is_cut_short_is_rolled_back() {
        let text = |path: &Path| fs::read_to_string(path).unwrap_or_default();
        for moment in 0..4 {
            let place = tempfile::tempdir().unwrap();
            let root = place.path();
            drop(exchange(root));
            let (next, away) = (Path::new(NEXT), Path::new(EARLIER));
            // The same steps as in `take_place`, up to that moment.
            displace(root, SCENE, away.join(SCENE)).unwrap();
            if moment > 0 {
                for name in [BODIES, "frames/points_0000.vtu"] {
                    displace(root, name, away.join(name)).unwrap();
                }
            }
            if moment > 1 {
                displace(root, next.join(WRITTEN), WRITTEN).unwrap();
                displace(root, next.join(SCENE), SCENE).unwrap();
            }
            if moment > 2 {
                displace(root, next.join(HISTORY), HISTORY).unwrap();
                remove_all(&root.join(next)).unwrap();
            }
            let found = RunDir::reopen(root).unwrap();
            let (ours, theirs) = if moment > 2 {
                (["new", "", "", "new"], [SCENE, HISTORY])
            } else {
                (["earlier", "earlier", "earlier", ""], [SCENE, BODIES])
            };
            let there = [SCENE, BODIES, "frames/points_0000.vtu", HISTORY];
            assert_eq!(there.map(|name| text(&root.join(name))), ours, "{moment}");
            assert!(theirs.iter().all(|name| found.has_written(name)));
            assert!(
                !root.join(next).exists() && !root.join(away).exists(),
                "{moment}"
            );
        }
    }

    /// The next run removed what the failed one had moved away, and the user was told that nothing had changed.
    #[test]
    fn an_exchange_that_fails_leaves_the_earlier_result() {
        let place = tempfile::tempdir().unwrap();
        let root = place.path();
        let earlier = RunDir::create(root, "earlier").unwrap();
        earlier.replace(HISTORY, b"time [s]\n0\n", false).unwrap();
        drop(earlier);
        let new = RunDir::create(root, "new").unwrap();
        let state = format!("{CHECKPOINTS}/1.tandem");
        new.replace(&state, b"new", false).unwrap();
        // Where a folder has to be made, which root could make anywhere else.
        fs::write(root.join(CHECKPOINTS), "mine").unwrap();
        new.take_place().unwrap_err();
        let failed = new.settle().unwrap();
        assert_eq!(failed, root.join(FAILED_START));
        drop(new);
        RunDir::reopen(root).unwrap();
        let text = |name: &Path| fs::read_to_string(root.join(name)).unwrap();
        assert_eq!(text(Path::new(SCENE)), "earlier");
        assert_eq!(text(Path::new(HISTORY)), "time [s]\n0\n");
        assert_eq!(text(Path::new(CHECKPOINTS)), "mine");
        assert_eq!(text(&failed.join(SCENE)), "new");
        assert_eq!(text(&failed.join(&state)), "new");
        assert!(!root.join(NEXT).exists() && !root.join(EARLIER).exists());
    }

    /// A file of the user's in the place of contacts, or of a state that is kept, was replaced.
    #[test]
    fn a_file_of_the_user_with_a_name_of_a_run_is_in_the_way() {
        for (name, is_in_the_way) in [
            (SUMMARY, true),
            ("frames/points_0000.vtu", true),
            ("frames/contacts_0000.vtu", true),
            ("frames/contacts_of_mine.vtu", false),
            ("frames/stresses_0000.vtu", false),
            ("checkpoints/0001.tandem", true),
            ("checkpoints/0001.kept.tandem", true),
            ("checkpoints/kept.tandem", false),
        ] {
            let place = tempfile::tempdir().unwrap();
            files::replace(place.path(), name, b"mine", false).unwrap();
            let made = RunDir::create(place.path(), "");
            let refused = matches!(made, Err(RunDirError::NotOurs(_)));
            assert_eq!(refused, is_in_the_way, "{name}: {made:?}");
        }
    }

    /// A failed start replaced it: no more than 512 MiB of a table are read at once.
    #[test]
    fn a_history_of_any_length_is_a_result() {
        let dir = tempfile::tempdir().unwrap();
        let has = |text: &str| {
            fs::write(dir.path().join(HISTORY), text).unwrap();
            has_result(dir.path())
        };
        assert!(!has("") && !has("time [s]\n") && has("time [s]\n0\n"));
        let file = File::options().write(true).open(dir.path().join(HISTORY));
        file.unwrap().set_len(files::TABLE + 1).unwrap();
        assert!(has_result(dir.path()));
    }
}
