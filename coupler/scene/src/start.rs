//! `[start]` and `output.checkpoint`: the initial state of a scene, and the states that its run saves for others.

use std::path::{Path, absolute};

use toml::Value;

use super::problems::Problems;
use super::written::StartWritten;
use super::{CheckpointPlan, Start};

/// The start as written; paths are relative to `directory`.
pub(super) fn start(
    problems: &mut Problems,
    written: Option<&StartWritten>,
    directory: &Path,
) -> Option<Start> {
    let StartWritten { from, time, state } = written?;
    let (run, at) = split(from);
    if run.is_empty() || at.is_some_and(|at| !at.is_finite() || at < 0.0) {
        let help = "the directory of a run, such as \"../runs/silo\", or one with a time, \"../runs/silo@0.4\"";
        problems.refuse(
            "start.from",
            format!("`start.from` is {from:?}, expected RUN or RUN@TIME"),
            help,
        );
    }
    if let Some(time) = *time {
        let expected = "0; without it the clock continues from that run";
        problems.number("start.time", time, time == 0.0, expected);
    }
    let path = directory.join(run);
    Some(Start {
        run: absolute(&path).unwrap_or(path),
        at,
        from_zero: time.is_some(),
        state: state.clone(),
    })
}

/// The run and the time in `RUN@TIME`. If the text after the `@` is not a number, it belongs to the path.
fn split(from: &str) -> (&str, Option<f64>) {
    from.rsplit_once('@')
        .and_then(|(run, at)| Some((run, Some(at.trim().parse().ok()?))))
        .unwrap_or((from, None))
}

/// The start with an absolute path, for the resolved scene.
pub(super) fn resolved(start: Option<&Start>) -> Option<(&'static str, Value)> {
    start.map(|start| ("start.from", Value::String(start.from())))
}

/// The times at which the run saves its state, if it has an output every `every` s up to `end` (s).
pub(super) fn checkpoint(
    problems: &mut Problems,
    written: Option<&CheckpointPlan>,
    [every, end]: [f64; 2],
) -> Option<CheckpointPlan> {
    let plan = written?;
    let CheckpointPlan {
        wall,
        time,
        at,
        end: at_end,
    } = plan;
    for (key, interval) in [("wall", wall), ("time", time)] {
        if let Some(interval) = interval {
            problems.above_zero(&format!("output.checkpoint.{key}"), *interval, "a time");
        }
    }
    if wall.is_none() && time.is_none() && at.is_empty() && !at_end {
        problems.refuse(
            "output.checkpoint",
            "it does not say when the state is saved",
            "give `wall` or `time` (intervals in s), `at` (times in s), or `end = true`",
        );
    }
    let mut plan = CheckpointPlan {
        at: Vec::new(),
        ..plan.clone()
    };
    for (i, &at) in at.iter().enumerate() {
        let path = format!("output.checkpoint.at.{i}");
        let outputs = (at / every).round();
        let expected =
            format!("a time of `output.every` or later, up to the end of the run ({end} s)");
        problems.number(
            &path,
            at,
            outputs > 0.0 && at <= end * (1.0 + 1e-12),
            &expected,
        );
        if (at - end).abs() <= 1e-9 * end {
            plan.end = true;
        } else if (at / every - outputs).abs() > 1e-9 * outputs.max(1.0) {
            // Steps end on rows of the history. Elsewhere a checkpoint would change them.
            problems.refuse(
                &path,
                format!(
                    "{at} s is not the time of a row of the history, which has one every {every} s"
                ),
                format!(
                    "give a whole multiple of `output.every`, such as {}",
                    outputs.max(1.0) * every
                ),
            );
        } else {
            plan.at.push(at);
        }
    }
    Some(plan)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_follows_the_last_at() {
        assert_eq!(split("runs/silo"), ("runs/silo", None));
        assert_eq!(split("runs/silo@0.4"), ("runs/silo", Some(0.4)));
        assert_eq!(split("me@host/silo@1e-3"), ("me@host/silo", Some(1e-3)));
        assert_eq!(split("me@host/silo"), ("me@host/silo", None));
    }
}
