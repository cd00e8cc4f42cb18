//! `tandem new`: a scene or a solver to begin with.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use coupler::scene::schema;
use interface::files;

use crate::cli::{Language, NewArgs, NewCommand};
use crate::exit::{Failed, bad_input};
use crate::terminal::{complain, say};

/// A scene with a comment at every key; [`NAME`] stands for its name.
const SCENE: &str = include_str!("new/scene.toml");
const NAME: &str = "NAME";
/// What editors check scenes by, beside the scene.
const SCHEMA: &str = "scene.schema.json";

/// In the files of a solver, the checkout that has the contract.
const TREE: &str = "TREE";

/// Names that no package of a solver can have: those of cargo's own folders, and of the packages that it is built with.
const TAKEN: [&str; 7] = [
    "build",
    "deps",
    "examples",
    "incremental",
    "interface",
    "config",
    "mechanics",
];

/// Where GitHub looks for what it runs at every push.
const WORKFLOW: &str = ".github/workflows/conformance.yml";
/// In the files of a solver, the folder of Tandem's scenes.
const SCENES: &str = "SCENES";

/// The files of a solver.
const PYTHON: &[(&str, &str)] = &[
    ("solver.py", include_str!("new/python/solver.py")),
    ("test_solver.py", include_str!("new/python/test_solver.py")),
    (WORKFLOW, include_str!("new/python/conformance.yml")),
];
const RUST: &[(&str, &str)] = &[
    ("Cargo.toml", include_str!("new/rust/package.toml")),
    ("src/lib.rs", include_str!("new/rust/solver.rs")),
    ("src/main.rs", include_str!("new/rust/main.rs")),
    ("tests/solver.rs", include_str!("new/rust/test.rs")),
    (WORKFLOW, include_str!("new/rust/conformance.yml")),
];

/// Writes what was asked for; nothing that is there is changed.
pub fn new(args: &NewArgs) -> Result<ExitCode, Failed> {
    let written = match &args.what {
        NewCommand::Scene { name } => scene(name),
        NewCommand::Solver { name, lang, tree } => solver(name, *lang, tree.as_deref()),
    };
    say(written.map_err(bad_input)?);
    Ok(ExitCode::SUCCESS)
}

fn scene(name: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    if name.is_empty() || !name.chars().all(plain) {
        return Err(format!(
            "a scene cannot be called `{name}`: a name has letters, digits, `_` and `-`"
        ));
    }
    let file = format!("{name}.toml");
    create(Path::new(&file), &SCENE.replace(NAME, name))?;
    // One that is there serves as well.
    match files::write_new_named(Path::new(SCHEMA), format!("{:#}\n", schema())) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            complain(format_args!("warning: cannot write {SCHEMA}: {error}"));
        }
        _ => {}
    }
    Ok(format!("wrote {file}; `tandem run {file}` runs it"))
}

/// A folder with a solver, which uses the contract in a checkout.
fn solver(name: &str, language: Language, tree: Option<&Path>) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "_-".contains(c);
    let begins = name.starts_with(|c: char| c.is_ascii_lowercase());
    if !begins || !name.chars().all(plain) {
        return Err(format!(
            "a solver cannot be called `{name}`: a name has lower-case letters, digits, `_` and `-`, and begins with a letter"
        ));
    }
    if language == Language::Rust && TAKEN.contains(&name) {
        return Err(format!(
            "a solver in Rust cannot be called `{name}`: cargo or the contract has this name already"
        ));
    }
    // A program that was installed as a wheel has brought what a solver in Python needs.
    let tree = match checkout(tree) {
        Err(_) if language == Language::Python && tree.is_none() => None,
        found => Some(found?),
    };
    let scenes = scenes(tree.as_deref());
    let folder = Path::new(name);
    std::fs::create_dir(folder).map_err(|error| format!("cannot make {name}/: {error}"))?;
    let (files, command, first) = match language {
        Language::Python => (PYTHON, format!("python3 {name}/solver.py"), String::new()),
        Language::Rust => (
            RUST,
            format!("{name}/target/release/{name}"),
            format!("  cargo build --release --manifest-path {name}/Cargo.toml\n"),
        ),
    };
    for (file, text) in files {
        create(&folder.join(file), &filled(text, name, tree.as_deref()))?;
    }
    if let (Language::Rust, Some(tree)) = (language, &tree) {
        // The versions that the checkout has been built with: those are at hand without a network.
        let lock = files::read_named_text(&tree.join("Cargo.lock"), files::SMALL);
        create(&folder.join("Cargo.lock"), &lock.unwrap_or_default())?;
    }
    Ok(format!(
        "wrote {name}/; next\n{first}  tandem run {scenes}/jiang2020/collision_hard.toml --dem \"{command}\"\n  tandem conformance --require held --dem \"{command}\""
    ))
}

/// The folder of Tandem's scenes, as a shell reads it.
fn scenes(tree: Option<&Path>) -> String {
    tree.map_or("$(python3 -m tandem)".to_owned(), |tree| {
        format!("{}/scenes", tree.display())
    })
}

/// A file of the solver `name`; without a tree, the packages of the wheel are used.
fn filled(text: &str, name: &str, tree: Option<&Path>) -> String {
    let text = text.replace(SCENES, &scenes(tree));
    let text = match tree {
        Some(tree) => text.replace(TREE, &tree.display().to_string()),
        None => text
            .split_inclusive('\n')
            .filter(|line| !line.contains(TREE))
            .collect(),
    };
    text.replace(NAME, name)
}

/// The checkout that was named, or that this program was built from.
fn checkout(named: Option<&Path>) -> Result<PathBuf, String> {
    let tree = named.unwrap_or(Path::new(env!("CARGO_MANIFEST_DIR")));
    let found = tree.canonicalize().ok();
    found
        .filter(|tree| tree.join("interface/PROTOCOL.md").is_file())
        .ok_or_else(|| {
            let tree = tree.display();
            format!("{tree} is no checkout of Tandem, which a solver is built with: name one with --tree DIR")
        })
}

fn create(path: &Path, text: &str) -> Result<(), String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder)
        .and_then(|()| files::write_new_named(path, text))
        .map_err(|error| format!("cannot write {}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solver_in_python_needs_no_checkout_where_the_wheel_is() {
        for (file, text) in PYTHON {
            let text = filled(text, "mine", None);
            for mark in [TREE, SCENES, NAME, "sys.path.append"] {
                assert!(!text.contains(mark), "{file}: {mark}");
            }
        }
        let solver = filled(PYTHON[0].1, "mine", None);
        assert!(solver.contains("tandem run $(python3 -m tandem)/jiang2020/"));
        assert!(solver.contains("from tandem_solver import"));
        let within = filled(PYTHON[0].1, "mine", Some(Path::new("/tree")));
        assert!(within.contains("tandem run /tree/scenes/jiang2020/"));
        assert!(within.contains("sys.path.append(\"/tree/python\")"));
    }
}
