//! What a run of a scene costs on this machine: its beginning is run, and what the rest takes follows from it.

use std::fmt::{self, Display};
use std::time::Duration;

use coupler::record::rundir::RunDir;
use coupler::record::summary::Status;
use coupler::run::checkpoint::branch::Branch;
use coupler::run::{RunOptions, run};
use coupler::scene::Scene;
use report::words::{duration, moment};

/// What a run costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// Wall time in s, start-up included.
    wall: f64,
    /// Steps.
    steps: f64,
    /// Steps that were run to find out.
    tried: u64,
    /// Wall time of one of them in s.
    step: f64,
    /// They were the whole run.
    whole: bool,
}

/// Runs the beginning of `scene` as `options` say, for `stepping` after its start-up, in a directory that is removed.
///
/// # Errors
/// Why this does not show the cost of the run.
pub fn measure(scene: &Scene, options: RunOptions, stepping: Duration) -> Result<Cost, String> {
    let mut scene = scene.clone();
    scene.output.report = false;
    scene.checks.clear();
    let branch = Branch::find(&mut scene).map_err(|errors| errors.to_string())?;
    let place = tempfile::tempdir().map_err(|e| format!("no place for its files: {e}"))?;
    let dir = RunDir::create(&place.path().join("run"), &scene.resolved_toml)
        .map_err(|error| error.to_string())?;
    let options = RunOptions {
        stepping: Some(stepping),
        progress: false,
        ..options
    };
    let began = branch.as_ref().map_or(0.0, |branch| branch.begin);
    let summary = run(&scene, &options, &dir, branch).summary;
    let whole = match summary.status {
        Status::Done | Status::CheckFailed => true,
        Status::Interrupted if summary.steps > 0 => false,
        _ => {
            let reason = summary.reason.unwrap_or_default();
            return Err(format!("its first steps end with: {reason}"));
        }
    };
    let tried = summary.steps as f64;
    let step = summary.spent.stepping_wall_s / tried.max(1.0);
    let left = (scene.time.end - summary.time) / (summary.time - began);
    let left = if whole { 0.0 } else { tried * left };
    Ok(Cost {
        wall: summary.spent.wall_s + left * step,
        steps: tried + left.ceil(),
        tried: summary.steps,
        step,
        whole,
    })
}

impl Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wall = duration(self.wall);
        let words = if self.whole {
            format!("{wall} on this machine, for all {} steps", self.tried)
        } else {
            format!(
                "about {wall} on this machine: {} steps took {} each, and there will be about {:.1e}",
                self.tried,
                moment(self.step),
                self.steps
            )
        };
        // Numbers and units are kept together on a page; here lines do not break.
        f.write_str(&words.replace('\u{a0}', " "))
    }
}
