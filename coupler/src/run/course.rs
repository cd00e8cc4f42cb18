//! `course.csv`: the course of a run. One row at each output of the history, with the energies of the ledger and the
//! number of steps that each limit has determined. `history.csv` has the columns of the scene; this file has the same
//! columns for every run.

use crate::record::Sealed;
use crate::record::history::History;
use crate::record::ledger::Energies;
use crate::record::rundir::{COURSE, RunDir, RunDirError};
use crate::run::pace::Pace;
use crate::run::stability::Bound;

/// `course.csv` being written.
#[derive(Debug)]
pub struct Course {
    /// Its file.
    pub rows: History,
    /// The last step in s, and the number of steps by each limit, at the moment that is measured next.
    steps: [f64; 1 + Bound::ALL.len()],
}

impl Course {
    /// The file of a new run, or of one that continues behind what it had at the checkpoint.
    pub fn open(dir: &RunDir, at: Option<&Sealed>) -> Result<Self, RunDirError> {
        Ok(Self {
            rows: History::open(dir, COURSE, &header(), at)?,
            steps: [0.0; 1 + Bound::ALL.len()],
        })
    }

    /// Stores the steps before a grant. A grant measures its begin, whatever the number of its steps.
    pub fn before(&mut self, pace: &Pace) {
        let bound_by = &pace.so_far.bound_by;
        let [step, counts @ ..] = &mut self.steps;
        *step = pace.so_far.last.map_or(0.0, |(step, _)| step);
        for (count, bound) in counts.iter_mut().zip(Bound::ALL) {
            *count = bound_by.get(bound).map_or(0.0, |&steps| steps as f64);
        }
    }

    /// Adds the row for `time` (s), the begin of the last grant.
    pub fn row(&mut self, time: f64, energies: &Energies) -> Result<(), RunDirError> {
        let mut row = vec![time];
        row.extend(self.steps);
        row.extend(energies.parts().map(|(_, value)| value));
        self.rows.row(&row)
    }
}

/// The names of the columns. Steps are counted from the start; `step` is the last one.
fn header() -> Vec<String> {
    let bounds = Bound::ALL.iter();
    let bounds = bounds.map(|bound| format!("steps by {} [1]", bound.name()));
    let energies = Energies::default()
        .parts()
        .map(|(name, _)| format!("{name} [J/m]"));
    ["time [s]".to_owned(), "step [s]".to_owned()]
        .into_iter()
        .chain(bounds)
        .chain(energies)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_header_names_every_number_of_a_row() {
        let dir = tempfile::tempdir().unwrap();
        let run = RunDir::create(dir.path(), "").unwrap();
        let mut course = Course::open(&run, None).unwrap();
        let plan = crate::scene::TimePlan::until(1.0);
        let energies = Energies {
            kinetic: 3.0,
            total: 3.0,
            ..Energies::default()
        };
        course.before(&Pace::new(plan, 0.1));
        course.row(0.0, &energies).unwrap();
        course.rows.finish().unwrap();
        let text = fs::read_to_string(dir.path().join(COURSE)).unwrap();
        let lines: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!(lines[0].len(), lines[1].len());
        let at = lines[0].iter().position(|name| *name == "kinetic [J/m]");
        assert_eq!(lines[1][at.unwrap()], "3");
    }
}
