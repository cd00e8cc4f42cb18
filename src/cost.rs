//! What a run of a scene costs on this machine: its beginning is run, and what the rest takes follows from it.

use std::fmt::{self, Display};
use std::time::Duration;

use coupler::record::rundir::RunDir;
use coupler::record::summary::Status;
use coupler::run::checkpoint::branch::Branch;
use coupler::run::{RunOptions, run};
use coupler::scene::Scene;

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
/// Why that does not tell what the run costs.
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
    let began = branch.as_ref().map_or(0.0, |branch| branch.time());
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
    let step = summary.stepping_wall_s / tried.max(1.0);
    let left = (scene.time.end - summary.time) / (summary.time - began);
    let left = if whole { 0.0 } else { tried * left };
    Ok(Cost {
        wall: summary.wall_s + left * step,
        steps: tried + left.ceil(),
        tried: summary.steps,
        step,
        whole,
    })
}

impl Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wall = in_time(self.wall);
        if self.whole {
            return write!(f, "{wall} on this machine, for all {} steps", self.tried);
        }
        write!(
            f,
            "about {wall} on this machine: {} steps took {} each, and there will be about {:.1e}",
            self.tried,
            in_time(self.step),
            self.steps
        )
    }
}

/// A time as people read it.
fn in_time(seconds: f64) -> String {
    let [minute, hour, day] = [60.0, 3600.0, 86_400.0];
    match seconds {
        s if s < 1e-3 => format!("{:.1} us", 1e6 * s),
        s if s < 1.0 => format!("{:.1} ms", 1e3 * s),
        s if s < 2.0 * minute => format!("{s:.1} s"),
        s if s < 2.0 * hour => format!("{:.0} minutes", s / minute),
        s if s < 2.0 * day => format!("{:.1} hours", s / hour),
        s => format!("{:.1} days", s / day),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_in_units_that_people_use() {
        let told = [3.2e-6, 4.5e-3, 1.25, 90.0, 600.0, 3.6e4, 1e6].map(in_time);
        let expected = [
            "3.2 us",
            "4.5 ms",
            "1.2 s",
            "90.0 s",
            "10 minutes",
            "10.0 hours",
            "11.6 days",
        ];
        assert_eq!(told, expected);
    }
}
