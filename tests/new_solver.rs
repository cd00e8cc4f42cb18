//! `tandem new solver`: what it writes runs a collision and is passed by the kit, as it stands.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::harness::{Place, has, python_can_join, root, scene};

/// Runs a program in the folder; its output with its last lines.
#[track_caller]
fn runs(place: &Place, command: &mut Command) -> String {
    let ended = command
        .env("TANDEM", env!("CARGO_BIN_EXE_tandem"))
        .env("TANDEM_RUNTIME_DIR", place.temporary_path())
        .output()
        .unwrap();
    let mut output = String::from_utf8_lossy(&ended.stdout).into_owned();
    output += &String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(0), "{command:?}: {output}");
    output
}

/// A new solver, and what `tandem new` says that comes next.
fn new(place: &Place, name: &str, language: &str) -> String {
    let ended = place.tandem(&format!("new solver {name} --lang {language}"));
    ended.expect(0).stdout
}

fn collides(place: &Place, command: &str) {
    let more = format!("--dem \"{command}\" --variant quick");
    place
        .run("out", &scene("jiang2020/collision_hard"), &more)
        .expect(0);
}

#[test]
fn a_new_solver_in_python_collides_and_passes_its_tests() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let next = new(&place, "mine", "python");
    has(&next, "--dem \"python3 mine/solver.py\"");
    collides(&place, "python3 mine/solver.py");
    // The second of its tests is the kit.
    let mut tests = Command::new("python3");
    tests.args(["-m", "unittest", "discover", "mine"]);
    let output = runs(&place, tests.current_dir(place.path(".")));
    has(&output, "Ran 2 tests");
}

/// Lets the package compile its dependencies with the features, the versions and the profile of this tree. So cargo takes
/// what is there and does not compile 67 crates once more: only the two that have a path, which are not optimised.
fn with_features_of_this_tree(package: &Path) {
    let read = |path: &Path| -> toml::Table { fs::read_to_string(path).unwrap().parse().unwrap() };
    let tree = root();
    let mut manifest = read(package);
    manifest["profile"] = read(&tree.join("Cargo.toml"))["profile"].clone();
    let packages = manifest["profile"]["release"]["package"].as_table_mut();
    let packages = packages.unwrap();
    for name in ["interface", "mechanics"] {
        let plain = toml::Table::from_iter([("opt-level".to_owned(), 0.into())]);
        packages.insert(name.to_owned(), plain.into());
    }
    let dependencies = manifest["dependencies"].as_table_mut().unwrap();
    // It has no library: cargo warns of that, and unites the features of its dependencies with those of the package.
    let program = toml::Table::from_iter([("path".to_owned(), tree.to_str().unwrap().into())]);
    dependencies.insert("tandem".to_owned(), program.into());
    fs::write(package, manifest.to_string()).unwrap();
    fs::copy(
        tree.join("Cargo.lock"),
        package.with_file_name("Cargo.lock"),
    )
    .unwrap();
}

/// By a name that is a word of Rust's: it does not stand in the code.
#[test]
fn a_new_solver_in_rust_collides_and_passes_its_tests() {
    let place = Place::new();
    let next = new(&place, "type", "rust");
    has(&next, "cargo build --release");
    let package = place.path("type/Cargo.toml");
    with_features_of_this_tree(&package);
    // With what has been compiled for this test, and by the flags of this tree, which a command within it gets.
    let target = Path::new(env!("CARGO_BIN_EXE_tandem")).parent().unwrap();
    let mut tests = Command::new("cargo");
    tests.args([
        "test",
        "--release",
        "--offline",
        "--quiet",
        "--manifest-path",
    ]);
    tests.arg(package).arg("--target-dir");
    tests.arg(target.parent().unwrap()).current_dir(root());
    let output = runs(&place, &mut tests);
    has(&output, "2 passed");
    let program = target.join("type");
    collides(&place, &format!("'{}'", program.display()));
    fs::remove_file(program).unwrap();
}

#[test]
fn nothing_that_is_there_is_lost_to_a_new_solver() {
    let place = Place::new();
    let directory = place.path(".");
    fs::create_dir(directory.join("mine")).unwrap();
    for (words, why) in [
        ("mine --lang rust", "cannot make mine/"),
        ("../up --lang rust", "cannot be called"),
        ("2d --lang python", "begins with a letter"),
        ("other --lang rust --tree .", "no checkout"),
        ("build --lang rust", "cannot be called `build`"),
        ("mechanics --lang rust", "cannot be called `mechanics`"),
    ] {
        let ended = place.tandem(&format!("new solver {words}"));
        ended.expect(2).says(&[why]);
    }
    assert_eq!(place.content().len(), 1);
}
