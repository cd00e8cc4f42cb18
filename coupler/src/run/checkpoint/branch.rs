//! A scene that begins with the state of another run.

use std::iter;

use interface::message::control::Party;
use interface::session::solver_part;

use super::file::{self, About, Checkpoint};
use super::state::Phase;
use crate::record::check::When;
use crate::run::pace::Pace;
use crate::scene::Scene;
use crate::scene::diagnostic::SceneErrors;

/// The state of another run with which a scene begins.
#[derive(Debug)]
pub struct Branch {
    pub(crate) checkpoint: Checkpoint,
    /// Whether the scene continues as that run would, with the same steps and the same bits. Otherwise the velocities
    /// are first brought to the time of the positions, under the scene's own laws, which gives its first energies and
    /// its first step.
    pub(crate) as_before: bool,
    /// Time in s at which the clock of the scene begins.
    pub begin: f64,
}

impl Branch {
    /// Finds the state with which `scene` begins, and notes it in the scene. `None` if the scene describes its own
    /// initial state.
    ///
    /// # Errors
    /// Why the scene cannot begin with that state, in terms of its keys.
    pub fn find(scene: &mut Scene) -> Result<Option<Self>, SceneErrors> {
        let Some(start) = scene.start.clone() else {
            return Ok(None);
        };
        let run = start.run.display().to_string();
        let of_from = |message: &str, help: &str| scene.complaint("start.from", message, help);
        let parent = Scene::of_run(&start.run).map_err(|errors| {
            let message = format!("`start.from` is no run: {}", errors.0[0].message);
            of_from(
                &message,
                "give the directory of a run, from the scene file's folder",
            )
        })?;
        let checkpoint = file::of_time(&start.run, &About::of(&parent), start.at);
        let checkpoint = checkpoint.map_err(|error| {
            let help = "`output.checkpoint = { end = true }` or `{ at = [...] }` keeps states for other scenes";
            of_from(&error.to_string(), help)
        })?;
        let state = checkpoint.state_hash();
        if let Some(expected) = start.state.as_ref().filter(|expected| **expected != state) {
            let message =
                format!("`start.state` is {expected}, the checkpoint in {run} has {state}");
            let help = "the run in that directory has changed; without `start.state` the scene begins with its present state";
            return Err(scene.complaint("start.state", &message, help));
        }
        scene.branches_off(&parent, &run)?;
        let begin = if start.from_zero {
            0.0
        } else {
            checkpoint.about.time
        };
        times_after(scene, begin)?;
        scene.begun_with(checkpoint.about.time, &state);
        Ok(Some(Self {
            as_before: !start.from_zero && goes_on(scene, &parent, &checkpoint),
            begin,
            checkpoint,
        }))
    }

    /// The state that the solver of `party` saved.
    pub fn saved(&self, party: Party) -> Option<&[u8]> {
        let mut solvers = self.checkpoint.solvers.iter();
        let (_, saved) = solvers.find(|(of, _)| *of == party)?;
        Some(solver_part(saved))
    }

    /// The description of the checkpoint.
    pub fn about(&self) -> &About {
        &self.checkpoint.about
    }
}

/// Refuses an end of `scene`, and times and windows of its checks, that are before its `begin` (s).
fn times_after(scene: &Scene, begin: f64) -> Result<(), SceneErrors> {
    let end = scene.time.end;
    let of_checks = scene.checks.iter().enumerate().map(|(i, check)| {
        let [from, to] = check.window;
        let (key, time) = match check.when {
            When::At(at) => ("when.at", at),
            // A window from 0 is the whole run.
            _ if from > 0.0 => ("from", from),
            _ => ("to", to),
        };
        (format!("check.{i}.{key}"), time, time < begin - 1e-9 * end)
    });
    let of_end = ("time.end".to_owned(), end, end <= begin);
    let mut times = iter::once(of_end).chain(of_checks);
    let Some((key, time, _)) = times.find(|(.., is_before)| *is_before) else {
        return Ok(());
    };
    let message = format!("`{key}` is {time} s, and the scene begins at {begin} s");
    let help = "the clock continues from that run, unless `start.time = 0`";
    Err(scene.complaint(&key, &message, help))
}

/// Whether a run of `scene` does the same steps after the checkpoint as a run of `parent` would.
fn goes_on(scene: &Scene, parent: &Scene, checkpoint: &Checkpoint) -> bool {
    let rules = |scene: &Scene| {
        let mut time = scene.time;
        (time.end, time.min_step) = (0.0, None);
        (time, scene.output.every)
    };
    let next_output = |scene: &Scene| {
        let mut pace = Pace::new(scene.time, scene.output.every);
        pace.so_far.clone_from(&checkpoint.state.account.so_far);
        pace.next_output()
    };
    let same = scene.mpm == parent.mpm && scene.dem == parent.dem && rules(scene) == rules(parent);
    // The present epoch ends on the next output.
    same && (checkpoint.state.phase == Phase::Done || next_output(scene) == next_output(parent))
}
