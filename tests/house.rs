//! What no compiler and no linter holds: which crate sees which, that no files of a crate form a circle, and that a session
//! can be simulated (ARCHITECTURE.md). Which files may open files is in `clippy.toml`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::harness::root;

/// What each crate sees of the others, by dependencies of any kind. The tests of `simulation` play the built-in solvers, those of
/// `rapier-dem` run scenes; nobody sees `guard`.
const ARROWS: &str = "
    config:
    interface: config
    mechanics: interface
    mpm-proc: conformance interface mechanics
    dem-proc: conformance interface mechanics
    record: interface mechanics
    scene: interface mechanics record
    coupler: interface record scene
    conformance: interface mechanics
    simulation: dem-proc interface mechanics mpm-proc
    mutant: conformance dem-proc interface mpm-proc
    study: coupler interface mechanics
    report: coupler interface
    guard: coupler dem-proc interface mechanics mpm-proc
    rapier-dem: conformance coupler dem-proc interface mechanics mpm-proc
    tandem: conformance coupler dem-proc interface mpm-proc mutant report study";
/// Dependencies of one crate only: the transport, the codec, the broad phase.
const OWNERS: [(&str, &str); 3] = [
    ("iceoryx2", "interface"),
    ("bincode", "interface"),
    ("parry2d-f64", "dem-proc"),
];
/// The order of the protocol names no clock, thread or file, so that it can be simulated; but for those who drive it.
const DRIVERS: [&str; 2] = ["stopwatch.rs", "together.rs"];

fn packages() -> Vec<Value> {
    let arguments = [
        "metadata",
        "--no-deps",
        "--offline",
        "--format-version",
        "1",
    ];
    let told = Command::new(env!("CARGO"))
        .args(arguments)
        .current_dir(root())
        .output()
        .unwrap();
    let told: Value = serde_json::from_slice(&told.stdout).expect("cargo metadata");
    told["packages"].as_array().expect("packages").clone()
}

/// `cargo run` and `cargo test` build all dependencies once, as long as tests, benchmarks and examples want no feature of one
/// that the program does without: `Cargo.toml` of the program names those that they want.
#[test]
fn the_program_and_its_tests_share_their_dependencies() {
    let tree = |scope: &[&str]| -> BTreeSet<String> {
        let told = Command::new(env!("CARGO"))
            .args(["tree", "--offline", "--prefix", "none", "--no-dedupe"])
            .args(["--format", "{p} {f}"])
            .args(scope)
            .current_dir(root())
            .output()
            .unwrap();
        assert!(
            told.status.success(),
            "{}",
            String::from_utf8_lossy(&told.stderr)
        );
        let text = String::from_utf8(told.stdout).expect("names of crates");
        text.lines().map(str::to_owned).collect()
    };
    let of_program = tree(&["--edges", "normal"]);
    let of_tests = tree(&["--workspace", "--edges", "normal,dev"]);
    let apart: Vec<&String> = of_program.difference(&of_tests).collect();
    assert!(
        apart.is_empty(),
        "tests want them with more features: {apart:#?}"
    );
}

#[test]
fn arrows_between_crates_point_down() {
    let arrows = ARROWS
        .lines()
        .filter_map(|line| line.trim().split_once(':'));
    let arrows: BTreeMap<&str, &str> = arrows.collect();
    let mut found = BTreeMap::new();
    let packages = packages();
    for package in &packages {
        let name = package["name"].as_str().unwrap();
        let sees = package["dependencies"].as_array().unwrap().iter();
        let sees: BTreeSet<&str> = sees.map(|other| other["name"].as_str().unwrap()).collect();
        let ours: Vec<&str> = sees
            .iter()
            .copied()
            .filter(|other| arrows.contains_key(other))
            .collect();
        found.insert(name, ours.join(" "));
        for (what, owner) in OWNERS {
            assert_eq!(
                sees.contains(what),
                owner == name,
                "{name}: {what} is for {owner} alone"
            );
        }
    }
    let arrows: BTreeMap<&str, String> = arrows
        .into_iter()
        .map(|(name, sees)| (name, sees.trim().to_owned()))
        .collect();
    assert_eq!(found, arrows);
}

#[test]
fn a_session_names_no_clock_thread_or_file() {
    let mut found = Vec::new();
    for entry in fs::read_dir(root().join("interface/src/session")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let code = code(&fs::read_to_string(&path).unwrap());
        let mut words = code.split(|c: char| !is_of_word(c));
        if words.any(|word| ["Instant", "SystemTime", "thread", "fs", "net"].contains(&word)) {
            found.push(name);
        }
    }
    found.sort();
    assert_eq!(found, DRIVERS);
}

/// A source without comments, and without the tests at its end.
fn code(text: &str) -> String {
    let text = text
        .split("\n#[cfg(test)]\nmod tests {")
        .next()
        .expect("a part");
    let lines = text
        .lines()
        .map(|line| line.split("//").next().expect("a part"));
    lines.collect::<Vec<_>>().join("\n")
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// A path of modules from the root of a crate.
type Module = Vec<String>;

/// A file of a crate.
#[derive(Default)]
struct File {
    /// Modules in files of their own.
    children: Vec<String>,
    /// What its code names in this crate.
    named: BTreeSet<Module>,
    /// Names that it passes on (`pub use`), with where they come from.
    passed_on: BTreeMap<String, Module>,
}

impl File {
    fn read(text: &str, module: &[String]) -> Self {
        let mut file = Self::default();
        let code = code(&code(text).replace("#[cfg(test)]\n", "// "));
        for (above, line) in [""].into_iter().chain(code.lines()).zip(code.lines()) {
            let child = line
                .rsplit_once("mod ")
                .and_then(|(_, name)| name.strip_suffix(';'))
                .filter(|_| !above.starts_with("#[path")); // a file that other crates share
            file.children.extend(child.map(str::to_owned));
        }
        let mut others = String::new();
        for part in code.split(';') {
            let Some((before, tree)) = part.split_once("use ").filter(|(before, _)| {
                before
                    .lines()
                    .last()
                    .is_none_or(|line| line.trim_start().is_empty() || line.starts_with("pub"))
            }) else {
                others += part;
                continue;
            };
            others += before;
            let passes_on = before
                .lines()
                .last()
                .is_some_and(|line| line.starts_with("pub"));
            for path in branches(tree) {
                let (path, known_as) = path
                    .split_once(" as ")
                    .unwrap_or((&path, path.rsplit("::").next().expect("a part")));
                file.take(path, module, passes_on.then_some(known_as));
            }
        }
        for path in others
            .split(|c: char| !is_of_word(c) && c != ':')
            .filter(|path| path.contains("::"))
        {
            file.take(path, module, None);
        }
        file
    }

    /// Notes a path, which is known by a name to others if it is passed on.
    fn take(&mut self, path: &str, module: &[String], passed_on: Option<&str>) {
        let path: Vec<String> = path
            .split("::")
            .filter(|word| !matches!(*word, "" | "*"))
            .map(str::to_owned)
            .collect();
        let up = path.iter().take_while(|word| *word == "super").count();
        let path = match path.first().map(String::as_str) {
            Some("crate") => path[1..].to_vec(),
            Some("self") => [module, &path[1..]].concat(),
            Some("super") if up <= module.len() => {
                [&module[..module.len() - up], &path[up..]].concat()
            }
            Some(name) if self.children.iter().any(|child| child == name) => {
                [module, &path].concat()
            }
            _ => return,
        };
        match passed_on {
            Some(name) => _ = self.passed_on.insert(name.to_owned(), path),
            None => _ = self.named.insert(path),
        }
    }
}

/// The paths of a `use`, with ` as NAME` where it says so.
fn branches(tree: &str) -> Vec<String> {
    let Some((before, group)) = tree.split_once('{') else {
        return vec![tree.trim().trim_end_matches("::self").to_owned()];
    };
    // A text that has "use" in it is none.
    let Some((group, _)) = group.rsplit_once('}') else {
        return Vec::new();
    };
    let (mut deep, mut paths) = (0, Vec::new());
    for branch in group.split(|c| {
        deep += i32::from(c == '{') - i32::from(c == '}');
        deep == 0 && c == ','
    }) {
        if !branch.trim().is_empty() {
            paths.extend(branches(&format!("{}{}", before.trim(), branch.trim())));
        }
    }
    paths
}

/// Adds a file and the files of its modules.
fn add(files: &mut BTreeMap<Module, File>, path: &Path, module: &[String]) {
    let file = File::read(&fs::read_to_string(path).expect("a source"), module);
    let folder = match path.file_stem().and_then(|stem| stem.to_str()) {
        Some("lib" | "main" | "mod") => path.parent().expect("a folder").to_path_buf(),
        _ => path.with_extension(""),
    };
    for child in &file.children {
        let places = [
            folder.join(format!("{child}.rs")),
            folder.join(child).join("mod.rs"),
        ];
        let found = places
            .iter()
            .find(|path| path.exists())
            .expect("a module has a file");
        add(
            files,
            found,
            &[module, std::slice::from_ref(child)].concat(),
        );
    }
    files.insert(module.to_vec(), file);
}

/// The file that defines what a path names; names are passed on a few times at most.
fn home<'a>(
    files: &'a BTreeMap<Module, File>,
    path: &[String],
    passed: usize,
) -> Option<&'a Module> {
    let known = (0..=path.len())
        .rev()
        .find_map(|n| files.get_key_value(&path[..n]));
    let (module, file) = known?;
    let rest = &path[module.len()..];
    match rest.first().and_then(|name| file.passed_on.get(name)) {
        Some(source) if passed < 8 => home(files, &[source, &rest[1..]].concat(), passed + 1),
        _ => Some(module),
    }
}

#[test]
fn no_circle_of_files() {
    let (mut circles, mut count) = (Vec::new(), 0);
    for package in packages() {
        let folder =
            PathBuf::from(package["manifest_path"].as_str().unwrap()).with_file_name("src");
        let roots = ["lib.rs", "main.rs"].map(|name| folder.join(name));
        let mut files = BTreeMap::new();
        // `simulation` is a program of tests.
        let Some(root) = roots.iter().find(|path| path.exists()) else {
            continue;
        };
        add(&mut files, root, &[]);
        let ahead = |from: &Module| -> BTreeSet<&Module> {
            let named = files[from].named.iter();
            named
                .filter_map(|path| home(&files, path, 0))
                .filter(|home| *home != from)
                .collect()
        };
        for start in files.keys() {
            let (mut reached, mut next) = (BTreeSet::new(), vec![start]);
            while let Some(module) = next.pop() {
                next.extend(
                    ahead(module)
                        .into_iter()
                        .filter(|module| reached.insert(*module)),
                );
            }
            if reached.contains(start) {
                circles.push(format!("{} {}", folder.display(), start.join("::")));
            }
        }
        count += files.len();
    }
    assert!(count > 200, "only {count} files were read");
    assert!(
        circles.is_empty(),
        "these reach themselves:\n{}",
        circles.join("\n")
    );
}
