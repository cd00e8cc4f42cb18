//! `[study]`: what `tandem study` varies, and how it computes the error of a run.

use std::collections::BTreeSet;

use super::problems::Problems;
use super::written::StudyWritten;
use super::{Measurand, Study};
use record::check::{Check, Column};

/// The study of a scene with these checks and columns.
pub(super) fn study(
    problems: &mut Problems,
    written: Option<&StudyWritten>,
    checks: &[Check],
    columns: &[Column],
) -> Study {
    let with_reference = || {
        let near = |c: &&Check| c.expected.reference.is_some();
        checks.iter().filter(near).map(|c| c.name.as_str())
    };
    let mut study = Study {
        error: with_reference()
            .next()
            .map(|name| Measurand::Check(name.to_owned())),
        resolution: "mpm.cell".to_owned(),
        along: Vec::new(),
        vary: Vec::new(),
    };
    if let Some(written) = written {
        if let Some(name) = &written.error {
            let known = with_reference().any(|known| known == name);
            // If `--set check=[]` has removed the checks, the study is not used.
            if !known && !checks.is_empty() {
                problems.refuse_unknown(
                    "study.error",
                    &format!("`study.error` is \"{name}\", expected a check with a `reference`"),
                    [name, "checks with a reference"],
                    with_reference(),
                );
            }
            if !written.finer.is_empty() {
                problems.refuse_key(
                    "study.finer",
                    "a check already gives the error",
                    "give one of `error` and `finer`",
                );
            }
            study.error = known.then(|| Measurand::Check(name.clone()));
        } else if !written.finer.is_empty() {
            let columns = columns.iter().map(|c| c.name.as_str());
            let names = columns.chain(checks.iter().map(|c| c.name.as_str()));
            let known: BTreeSet<&str> = names.clone().collect();
            for (i, name) in written.finer.iter().enumerate() {
                if !known.contains(name.as_str()) {
                    let path = format!("study.finer.{i}");
                    let message = format!("`{path}` is \"{name}\", expected a column or a check");
                    let what = [name.as_str(), "known here"];
                    problems.refuse_unknown(&path, &message, what, names.clone());
                }
            }
            study.error = Some(Measurand::Finer(written.finer.clone()));
        }
        for (key, values) in &written.vary {
            if values.is_empty() {
                let message = format!("`{key}` has no values to vary over");
                problems.refuse("study.vary", message, "list its values, or leave it out");
            }
        }
        if let Some(resolution) = &written.resolution {
            study.resolution.clone_from(resolution);
        }
        // The values as `--set` takes them: texts without quotes.
        let spelt = |value: &toml::Value| match value {
            toml::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        study.vary = written
            .vary
            .iter()
            .map(|(key, values)| (key.clone(), values.iter().map(spelt).collect()))
            .collect();
    }
    study.along = written
        .and_then(|written| written.along.clone())
        .unwrap_or_else(|| Study::along(&study.resolution));
    study
}
