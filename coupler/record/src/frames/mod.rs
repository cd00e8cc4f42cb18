//! Frames: all points and all bodies at an instant, as VTK files in the run directory.
//!
//! `frames/points_0003.vtu` has a vertex for each material point, `frames/bodies_0003.vtu` a polygon for each body (for
//! a cluster, one for each disc), `frames/contacts_0003.vtu` a line for each contact, and `frames/frames.pvd` their
//! times. A separate thread writes them. If [`WAITING`] frames wait for a slow disk, the run waits too.

mod instant;
mod meshes;
pub mod numbers;
mod outline;
pub mod vtu;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use interface::config::capability::{CONTACTS, PLASTIC_STRAIN};
use interface::config::{DemConfig, Motion, MpmConfig};
use interface::files::{self, SMALL, TABLE};
use interface::message::control::Party;
use interface::message::wire::BodyState;
use interface::session::Round;
use quick_xml::events::Event;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::background::{Background, Mark};
use crate::error::fail;
use crate::rundir::{FRAME_LIST, FRAMES, RunDir, RunDirError};
pub use instant::{Content, Field};
use instant::{Instant, plastic_strain};
use meshes::{Outlined, bodies, contacts, points};
use vtu::{Mesh, attribute};

/// The parts of a frame, one file each.
pub(crate) const PARTS: [&str; 3] = ["points", "bodies", "contacts"];
/// Largest number of frames in memory that have not been written.
const WAITING: u64 = 4;

/// The frames of a run so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Listed {
    /// Their times in s.
    pub times: Vec<f64>,
    /// Whether there are contacts in them.
    #[serde(default)]
    pub contacts: bool,
}

/// Takes the frames of a run.
#[derive(Debug)]
pub struct Frames {
    content: Content,
    /// Whether frames have contacts, and the plastic strain of groups: what the solvers report of them.
    contacts: bool,
    plastic_strain: Option<Arc<[Option<f64>]>>,
    /// The frames that were taken so far.
    pub listed: Listed,
    /// Counts frames.
    writer: Background<Instant>,
}

impl Frames {
    /// The frames of a run that continues: those that are `listed` are kept, where their files are still there; later ones are
    /// removed. `start` are the bodies at the positions of the scene; empty if the first frame has them.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn resume(
        dir: &RunDir,
        has_points: bool,
        dem: Option<&DemConfig>,
        content: &Content,
        listed: Listed,
        start: &[BodyState],
    ) -> Result<Self, RunDirError> {
        let bodies = dem.iter().flat_map(|dem| &dem.bodies);
        let outlines = bodies.map(|body| Outlined {
            name: body.name.clone(),
            outlines: outline::outlines(body),
            is_free: body.motion == Motion::Free,
        });
        let outlines = outlines.collect();
        let mut series = Series {
            dir: dir.clone(),
            content: content.clone(),
            has: [has_points, dem.is_some(), listed.contacts],
            outlines,
            start: start.to_vec(),
            times: listed.times.clone(),
        };
        series.keep_listed()?;
        Ok(Self {
            content: content.clone(),
            contacts: false,
            plastic_strain: None,
            writer: Background::begin(listed.times.len() as u64, move |instant| {
                series.write(&instant)
            }),
            listed,
        })
    }

    /// Takes what the solvers can report, in a run with this continuum. Until this is known, frames have what every solver
    /// reports.
    pub fn reported_by(&mut self, mpm: Option<&MpmConfig>, can: impl Fn(Party, &str) -> bool) {
        self.contacts = can(Party::Dem, CONTACTS) && self.content.has(Field::Contacts);
        let mpm = mpm.filter(|_| can(Party::Mpm, PLASTIC_STRAIN));
        self.plastic_strain = mpm.and_then(plastic_strain);
    }

    /// Takes a frame, and the points out of `round`; the thread writes it soon.
    ///
    /// # Errors
    /// [`RunDirError`] if an earlier one could not be written.
    pub fn take(&mut self, time: f64, round: &mut Round) -> Result<(), RunDirError> {
        self.listed.contacts |= self.contacts;
        self.listed.times.push(time);
        let instant = Instant {
            time,
            points: std::mem::take(&mut round.points),
            bodies: round.bodies.clone(),
            plastic_strain: self.plastic_strain.clone(),
            contacts: self.contacts.then(|| round.contacts.clone()),
        };
        self.writer.give(instant, 1)
    }

    /// The mark of the frames that were taken so far.
    pub fn mark(&self) -> Mark {
        self.writer.mark()
    }

    /// Whether so many frames wait that no more should be taken.
    pub fn is_behind(&self) -> bool {
        self.writer.behind() >= WAITING
    }

    /// Waits until all frames are in their files.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn finish(&mut self) -> Result<(), RunDirError> {
        self.writer.finish()
    }
}

/// The state of the writing thread.
struct Series {
    dir: RunDir,
    content: Content,
    /// [`PARTS`].
    has: [bool; 3],
    /// Each body at its initial position.
    outlines: Vec<Outlined>,
    /// The states of the bodies at these positions.
    start: Vec<BodyState>,
    times: Vec<f64>,
}

impl Series {
    /// Keeps the frames that are listed, of those that exist.
    fn keep_listed(&self) -> Result<(), RunDirError> {
        if self.times.is_empty() {
            return Ok(());
        }
        let kept: BTreeSet<String> = names(0..self.times.len()).collect();
        let dir = self.dir.path();
        let keep = || {
            for name in files::names(dir, FRAMES)? {
                let in_run = format!("{FRAMES}/{name}");
                let frame = in_run != FRAME_LIST && self.dir.has_written(&in_run);
                if frame && !kept.contains(&in_run) {
                    files::remove(dir, in_run)?;
                }
            }
            Ok(())
        };
        keep().map_err(fail("go on in", &dir.join(FRAMES)))?;
        self.dir.replace(FRAME_LIST, &self.list(), false)
    }

    fn write(&mut self, instant: &Instant) -> Result<(), RunDirError> {
        if self.start.is_empty() {
            self.start.clone_from(&instant.bodies);
        }
        let number = self.times.len();
        if self.has[0] {
            self.write_part("points", number, &points(instant, &self.content))?;
        }
        if self.has[1] {
            let bodies = bodies(&self.outlines, &self.start, &instant.bodies, &self.content);
            self.write_part("bodies", number, &bodies)?;
        }
        if let Some(states) = &instant.contacts {
            self.has[2] = true;
            let contacts = contacts(states, instant, &self.outlines);
            self.write_part("contacts", number, &contacts)?;
        }
        self.times.push(instant.time);
        self.dir.replace(FRAME_LIST, &self.list(), false)
    }

    fn write_part(&self, part: &str, number: usize, mesh: &Mesh) -> Result<(), RunDirError> {
        let name = format!("{FRAMES}/{}", file(part, number));
        self.dir
            .replace(&name, &mesh.to_file(self.content.precision), false)
    }

    /// ParaView's list of the files and their times. Nothing in it needs an escape.
    fn list(&self) -> Vec<u8> {
        let mut xml = "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n <Collection>\n".to_owned();
        for (number, time) in self.times.iter().enumerate() {
            let parts = PARTS.into_iter().zip(self.has);
            for (part, (name, _)) in parts.filter(|(_, has)| *has).enumerate() {
                let file = file(name, number);
                let _ = writeln!(
                    xml,
                    "  <DataSet timestep=\"{time}\" part=\"{part}\" name=\"{name}\" file=\"{file}\"/>"
                );
            }
        }
        xml += " </Collection>\n</VTKFile>";
        xml.into_bytes()
    }
}

/// The files of these frames in a run directory, of which some may not exist.
pub fn names(frames: std::ops::Range<usize>) -> impl Iterator<Item = String> {
    let files = frames.flat_map(|number| PARTS.map(|name| file(name, number)));
    files.map(|name| format!("{FRAMES}/{name}"))
}

fn file(name: &str, number: usize) -> String {
    format!("{name}_{number:04}.vtu")
}

/// A frame that is read from its files.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// In s.
    pub time: f64,
    /// The points, if the run had any.
    pub points: Option<Mesh>,
    /// The bodies, likewise.
    pub bodies: Option<Mesh>,
    /// The contacts, if the bodies' side reported them.
    pub contacts: Option<Mesh>,
}

/// Why a frame cannot be read.
#[derive(Debug, Error)]
#[error("{}: {what}", path.display())]
pub struct FrameError {
    path: PathBuf,
    what: String,
}

/// The list of the frames of a run directory.
#[derive(Debug)]
pub struct FrameList {
    run: PathBuf,
    entries: Vec<Entry>,
}

impl FrameList {
    /// Reads the list of a run directory; it is empty if there is none.
    ///
    /// # Errors
    /// [`FrameError`]: it is there and cannot be read.
    pub fn read(run: &Path) -> Result<Self, FrameError> {
        let entries = match files::read_text(run, FRAME_LIST, SMALL) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            Err(error) => Err(error.to_string()),
            Ok(text) => entries(&text),
        };
        Ok(Self {
            entries: entries.map_err(bad(run.join(FRAME_LIST)))?,
            run: run.to_path_buf(),
        })
    }

    /// The times of the frames in s.
    pub fn times(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.entries.iter().map(|entry| entry.time).collect();
        times.dedup();
        times
    }

    /// Reads the frame of this time (s).
    ///
    /// # Errors
    /// [`FrameError`]: there is none, or it cannot be read.
    pub fn frame(&self, time: f64) -> Result<Frame, FrameError> {
        let (run, entries) = (&self.run, &self.entries);
        let bad_list = bad(run.join(FRAME_LIST));
        let away = |entry: &&Entry| (entry.time - time).abs();
        let nearest = entries.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        let last = entries.last().map_or(0.0, |entry| entry.time);
        let nearest = match nearest {
            // A time printed in a caption does not have all its digits.
            Some(nearest) if away(&nearest) <= 1e-6 * last.max(time) => nearest.time,
            Some(nearest) => {
                let what = format!("no frame at {time} s; the nearest is at {} s", nearest.time);
                return Err(bad_list(what));
            }
            None => {
                return Err(bad_list(
                    "no frames; only a run with `output.frames` has frames".into(),
                ));
            }
        };
        let part = |name: &str| {
            let found = entries.iter().find(|e| e.time == nearest && e.name == name);
            found
                .map(|entry| {
                    let name = Path::new(FRAMES).join(&entry.file);
                    let file = files::read(run, &name, TABLE).map_err(|e| e.to_string());
                    let mesh = file.and_then(|file| Mesh::from_file(&file));
                    mesh.map_err(bad(run.join(name)))
                })
                .transpose()
        };
        Ok(Frame {
            time: nearest,
            points: part("points")?,
            bodies: part("bodies")?,
            contacts: part("contacts")?,
        })
    }
}

/// What is wrong with a file.
fn bad(path: PathBuf) -> impl FnOnce(String) -> FrameError {
    move |what| FrameError { path, what }
}

/// A line of the list.
#[derive(Debug)]
struct Entry {
    time: f64,
    name: String,
    file: String,
}

fn entries(text: &str) -> Result<Vec<Entry>, String> {
    let mut reader = quick_xml::Reader::from_str(text);
    let mut entries = Vec::new();
    loop {
        match reader.read_event().map_err(|e| e.to_string())? {
            Event::Eof => return Ok(entries),
            Event::Empty(element) if element.name().as_ref() == "DataSet" => {
                let attribute = |name: &str| attribute(&element, name);
                let time = attribute("timestep")?;
                let file = attribute("file")?;
                // A run directory may come from elsewhere, so its list may only name files in it.
                if Path::new(&file).file_name() != Some(OsStr::new(&file)) {
                    return Err(format!(
                        "`{file}` is not the name of a file in the same directory"
                    ));
                }
                entries.push(Entry {
                    time: time.parse().map_err(|e| format!("{time}: {e}"))?,
                    name: attribute("name")?,
                    file,
                });
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Otherwise a list could name any file that the reader may read.
    #[test]
    fn a_list_names_files_of_its_folder_only() {
        let list = |file: &str| {
            format!(
                r#"<VTKFile><DataSet timestep="0.5" part="0" name="points" file="{file}"/></VTKFile>"#
            )
        };
        assert_eq!(entries(&list("points_0000.vtu")).unwrap()[0].time, 0.5);
        for elsewhere in ["../a.vtu", "/etc/passwd", "a/b.vtu", "..", ""] {
            assert!(entries(&list(elsewhere)).is_err(), "{elsewhere}");
        }
    }
}
