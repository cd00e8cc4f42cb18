//! The run directory: what a run leaves behind (DESIGN.md section 6).

use std::fmt::Write as _;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use interface::message::wire::BodyState;
use thiserror::Error;

use crate::record::summary::Summary;

/// Writing to the run directory failed.
#[derive(Debug, Error)]
#[error("cannot {action} {path}: {source}")]
pub struct RunDirError {
    action: &'static str,
    path: PathBuf,
    source: io::Error,
}

/// A run as a page for a browser.
pub const REPORT: &str = "report.html";
const RECORDING: &str = "recording.tandem";
/// ParaView's list of the frames.
pub(crate) const FRAME_LIST: &str = "frames/frames.pvd";

/// A run directory in use.
#[derive(Debug, Clone)]
pub struct RunDir {
    path: PathBuf,
}

impl RunDir {
    /// Creates `path`, and proves that it can be written, before anything is started. Files of an earlier run of the
    /// same names are replaced.
    ///
    /// # Errors
    /// [`RunDirError`]; nothing is left behind.
    pub fn create(path: &Path) -> Result<Self, RunDirError> {
        let existed = path.exists();
        fs::create_dir_all(path).map_err(fail("create the run directory", path))?;
        if let Err(source) = tempfile::tempfile_in(path) {
            if !existed {
                let _ = fs::remove_dir(path);
            }
            return Err(fail("write in the run directory", path)(source));
        }
        // What tells of a whole run must not be there before this one has made its own.
        for name in ["summary.json", REPORT, RECORDING, FRAME_LIST] {
            let file = path.join(name);
            match fs::remove_file(&file) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(fail("replace", &file)(source));
                }
                _ => {}
            }
        }
        for file in crate::run::checkpoint::file::list(path) {
            fs::remove_file(&file).map_err(fail("replace", &file))?;
        }
        Ok(Self {
            path: path.to_path_buf(),
        })
    }

    /// The directory of a run that is to go on.
    ///
    /// # Errors
    /// [`RunDirError`] when nothing can be written there.
    pub fn reopen(path: &Path) -> Result<Self, RunDirError> {
        tempfile::tempfile_in(path).map_err(fail("write in the run directory", path))?;
        Ok(Self {
            path: path.to_path_buf(),
        })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where everything that crosses is recorded, if that is asked for.
    pub fn recording(&self) -> PathBuf {
        self.path.join(RECORDING)
    }

    /// Creates a file for lines of log.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn log(&self) -> Result<File, RunDirError> {
        let path = self.path.join("log.jsonl");
        File::create(&path).map_err(fail("create", &path))
    }

    /// Opens the file for lines of log of a run that goes on.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn log_on(&self) -> Result<File, RunDirError> {
        let path = self.path.join("log.jsonl");
        let file = OpenOptions::new().append(true).create(true).open(&path);
        file.map_err(fail("open", &path))
    }

    /// Writes the scene as resolved.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn write_scene(&self, toml: &str) -> Result<(), RunDirError> {
        self.write_whole("scene.toml", toml.as_bytes())
    }

    /// Writes `summary.json`.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn write_summary(&self, summary: &Summary) -> Result<(), RunDirError> {
        let mut json = serde_json::to_vec_pretty(summary).expect("a summary has string keys only");
        json.push(b'\n');
        self.write_whole("summary.json", &json)
    }

    /// Writes `bodies.csv`: where the bodies are at the end, one row each, in the order of the scene. Position is that of
    /// the centre of mass.
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
        self.write_whole("bodies.csv", text.as_bytes())
    }

    /// Writes a file as a whole: a reader sees the old one or the new one, never half of either.
    pub(crate) fn write_whole(&self, name: &str, bytes: &[u8]) -> Result<(), RunDirError> {
        let path = self.path.join(name);
        let write = || {
            let mut file = tempfile::NamedTempFile::new_in(&self.path)?;
            file.write_all(bytes)?;
            file.persist(&path)?;
            Ok(())
        };
        write().map_err(fail("write", &path))
    }
}

pub(crate) fn fail(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RunDirError {
    let path = path.to_path_buf();
    move |source| RunDirError {
        action,
        path,
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_under_a_file_is_refused_and_nothing_is_left() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("file"), b"x").unwrap();
        let error = RunDir::create(&dir.path().join("file/run"))
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("cannot create the run directory"),
            "{error}"
        );
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn the_bodies_read_back_to_the_same_bits() {
        let dir = tempfile::tempdir().unwrap();
        let run = RunDir::create(dir.path()).unwrap();
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
}
