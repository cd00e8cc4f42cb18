//! Other solvers than the built-in ones: programs that join the run (PROTOCOL.md, O-1).

use std::path::{Path, absolute};

use toml::Value;

use super::Solvers;
use super::problems::Problems;
use super::written::SolversWritten;

/// The name of the solver that comes with Tandem.
pub const BUILT_IN: &str = "built-in";

/// The words of a command, as a shell splits them. Those that begin with `./` or `../` are paths relative to
/// `directory`. They are made absolute, so that the command means the same when it is read from another directory.
/// `None` if there is no word, or if a quotation does not end.
fn words(command: &str, directory: &Path) -> Option<Vec<String>> {
    let from_here = |word: String| {
        if !word.starts_with("./") && !word.starts_with("../") {
            return word;
        }
        let path = directory.join(&word);
        absolute(&path)
            .unwrap_or(path)
            .to_string_lossy()
            .into_owned()
    };
    let words = shlex::split(command)?;
    (!words.is_empty()).then(|| words.into_iter().map(from_here).collect())
}

/// Joins words into one command.
fn joined(words: &[String]) -> String {
    shlex::try_join(words.iter().map(String::as_str)).expect("split off a text without zero bytes")
}

/// The `--set` argument for `--dem COMMAND` or `--mpm COMMAND`. `side` is `dem` or `mpm`; paths are relative to the
/// working directory.
///
/// # Errors
/// A message, if `command` is not a command.
pub fn solver_override(side: &str, command: &str) -> Result<String, String> {
    let words = words(command, Path::new(".")).ok_or(format!("--{side}: not a command"))?;
    Ok(format!("solvers.{side}={}", Value::String(joined(&words))))
}

/// The solvers as written. `present` has the sides of the scene; paths are relative to `directory`.
pub(super) fn solvers(
    problems: &mut Problems,
    written: &SolversWritten,
    present: [bool; 2],
    directory: &Path,
) -> Solvers {
    let mut solver = |side: &str, command: Option<&String>, present: bool| {
        let command = command.filter(|command| command.as_str() != BUILT_IN)?;
        let path = format!("solvers.{side}");
        if !present {
            problems.warn(format!(
                "`{path}` has no effect: the scene has no `[{side}]`"
            ));
        }
        let words = words(command, directory);
        if words.is_none() {
            problems.refuse(
                &path,
                format!("`{path}` is {command:?}, expected a command"),
                format!("such as `python3 ./my_{side}.py`, or `{BUILT_IN}`"),
            );
        }
        words
    };
    Solvers {
        mpm: solver("mpm", written.mpm.as_ref(), present[0]),
        dem: solver("dem", written.dem.as_ref(), present[1]),
    }
}

/// The commands with absolute paths, each with its key.
pub(super) fn commands(solvers: &Solvers) -> impl Iterator<Item = (&'static str, String)> {
    [("solvers.mpm", &solvers.mpm), ("solvers.dem", &solvers.dem)]
        .into_iter()
        .filter_map(|(path, words)| Some((path, joined(words.as_ref()?))))
}
