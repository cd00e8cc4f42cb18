//! `tandem new`: a scene to begin with.

use std::io;
use std::path::Path;
use std::process::ExitCode;

use coupler::scene::schema;
use interface::files;

use crate::cli::{NewArgs, NewCommand};
use crate::exit::BAD_INPUT;
use crate::terminal::{complain, say};

/// A scene with a comment at every key; [`NAME`] stands for its name.
const SCENE: &str = include_str!("new/scene.toml");
const NAME: &str = "NAME";
/// What editors check scenes by, beside the scene.
const SCHEMA: &str = "scene.schema.json";

/// Writes what was asked for; nothing that is there is changed.
pub fn new(args: &NewArgs) -> ExitCode {
    let NewCommand::Scene { name } = &args.what;
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    if name.is_empty() || !name.chars().all(plain) {
        complain(format_args!(
            "error: a scene cannot be called `{name}`: a name has letters, digits, `_` and `-`"
        ));
        return ExitCode::from(BAD_INPUT);
    }
    let file = format!("{name}.toml");
    if let Err(error) = files::write_new_named(Path::new(&file), &SCENE.replace(NAME, name)) {
        complain(format_args!("error: cannot write {file}: {error}"));
        return ExitCode::from(BAD_INPUT);
    }
    // One that is there serves as well.
    match files::write_new_named(Path::new(SCHEMA), &format!("{:#}\n", schema())) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            complain(format_args!("warning: cannot write {SCHEMA}: {error}"));
        }
        _ => {}
    }
    say(format_args!("wrote {file}; `tandem run {file}` runs it"));
    ExitCode::SUCCESS
}
