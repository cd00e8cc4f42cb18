//! The house rules of ARCHITECTURE.md that a compiler does not keep: which crate may name which, where the transport
//! and the codec are named, where unsafe code may be, what every file must not have.
//!
//! Each rule is a function from what is to be judged to complaints, so that it is shown a wrong example as well as the
//! workspace.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use cargo_metadata::{Metadata, MetadataCommand};

/// Longest Rust file: beyond, a file has more than one subject.
const LONGEST: usize = 700;
/// Names that say nothing of what is inside.
const EMPTY_NAMES: [&str; 8] = [
    "utils", "util", "common", "helpers", "helper", "manager", "misc", "stuff",
];

/// Crate → what it depends on, of any kind.
type Arrows = BTreeMap<String, BTreeSet<String>>;

/// A file of the workspace.
#[derive(Clone)]
struct Source {
    path: String,
    text: String,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        Self {
            path: path.into(),
            text: text.into(),
        }
    }

    fn is_rust(&self) -> bool {
        Path::new(&self.path).extension().is_some_and(|e| e == "rs")
    }

    /// Its lines without comments, numbered from 1.
    fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        self.text.lines().enumerate().map(|(k, line)| {
            let code = line.split_once("//").map_or(line, |(code, _)| code);
            (k + 1, code)
        })
    }
}

fn workspace() -> Metadata {
    MetadataCommand::new()
        .manifest_path(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"))
        .no_deps()
        .other_options(["--offline".to_string()])
        .exec()
        .expect("cargo metadata")
}

fn arrows_of(metadata: &Metadata) -> Arrows {
    let packages = metadata.packages.iter();
    packages
        .map(|package| {
            let dependencies = package.dependencies.iter().map(|d| d.name.clone());
            (package.name.to_string(), dependencies.collect())
        })
        .collect()
}

/// Every file under version control that is text.
fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = Command::new("git")
        .args([
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
        ])
        .current_dir(root)
        .output()
        .expect("git lists the files");
    assert!(listed.status.success(), "git ls-files: {listed:?}");
    let names = String::from_utf8(listed.stdout).expect("UTF-8 names");
    let sources: Vec<Source> = names
        .split_terminator('\0')
        .filter_map(|name| {
            // Listed but deleted, or not text: no business of these rules.
            let text = std::fs::read_to_string(root.join(name)).ok()?;
            Some(Source::new(name, &text))
        })
        .collect();
    assert!(
        sources.iter().filter(|s| s.is_rust()).count() > 50,
        "too few files were found"
    );
    sources
}

/// What the crates may see of each other.
fn wrong_arrows(arrows: &Arrows) -> Vec<String> {
    let allowed: BTreeMap<&str, &[&str]> = BTreeMap::from([
        ("interface", &[][..]),
        ("mechanics", &["interface"][..]),
        ("mpm-proc", &["interface", "mechanics"][..]),
        ("dem-proc", &["interface", "mechanics"][..]),
        ("coupler", &["interface", "mechanics"][..]),
        ("conformance", &["interface", "mechanics"][..]),
        // Its tests play the built-in solvers.
        (
            "simulation",
            &["interface", "mechanics", "mpm-proc", "dem-proc"][..],
        ),
        ("study", &["coupler", "interface", "mechanics"][..]),
        ("chaos", &["coupler"][..]),
        ("report", &["coupler"][..]),
        // Whatever reads bytes from elsewhere; nobody sees it.
        (
            "fuzzing",
            &["interface", "mpm-proc", "dem-proc", "coupler", "report"][..],
        ),
        // Its tests run scenes; the solver itself sees the contract.
        (
            "rapier-dem",
            &["interface", "mechanics", "dem-proc", "coupler", "mpm-proc"][..],
        ),
        (
            "tandem",
            &[
                "interface",
                "mpm-proc",
                "dem-proc",
                "coupler",
                "conformance",
                "report",
                "study",
                "chaos",
            ][..],
        ),
    ]);
    let mut wrong = Vec::new();
    for (name, dependencies) in arrows {
        let Some(may) = allowed.get(name.as_str()) else {
            wrong.push(format!("{name} has no place in the house"));
            continue;
        };
        let seen = dependencies.iter().filter(|d| arrows.contains_key(*d));
        for other in seen.filter(|d| !may.contains(&d.as_str())) {
            wrong.push(format!("{name} sees {other}"));
        }
        for other in may.iter().filter(|d| !dependencies.contains(**d)) {
            wrong.push(format!("{name} does not see {other}"));
        }
    }
    for name in allowed.keys().filter(|name| !arrows.contains_key(**name)) {
        wrong.push(format!("{name} is missing"));
    }
    wrong
}

/// Only `interface` depends on the transport and the codec.
fn strangers_with_transport(arrows: &Arrows) -> Vec<String> {
    let mut wrong = Vec::new();
    for (name, dependencies) in arrows.iter().filter(|(name, _)| *name != "interface") {
        for outside in ["iceoryx2", "bincode"] {
            for dependency in dependencies.iter().filter(|d| d.starts_with(outside)) {
                wrong.push(format!("{name} depends on {dependency}"));
            }
        }
    }
    wrong
}

/// Whether code names a crate in a path.
fn names(code: &str, crate_name: &str) -> bool {
    code.match_indices(crate_name).any(|(at, _)| {
        let before = code[..at].chars().next_back();
        let after = &code[at + crate_name.len()..];
        let whole = !before.is_some_and(|c| c.is_alphanumeric() || c == '_');
        let used = code[..at].trim_end().ends_with("use")
            || code[..at].trim_end().ends_with("extern crate");
        whole && (after.starts_with("::") || (used && after.starts_with([';', ' '])))
    })
}

/// Whether a file is the crate `interface`'s; the kit below it is a crate of its own.
fn of_interface(source: &Source) -> bool {
    let own = ["interface/src/", "interface/tests/", "interface/benches/"];
    own.iter().any(|folder| source.path.starts_with(folder))
}

/// The files that name the transport: what opens channels, what configures it, and the records that cross as they are.
const TRANSPORT: [&str; 3] = [
    "interface/src/transport/iceoryx.rs",
    "interface/src/transport/domain.rs",
    "interface/src/message/wire.rs",
];

/// The core of the protocol names no clock, thread or file.
fn core_with_io(sources: &[Source]) -> Vec<String> {
    let mut wrong = Vec::new();
    let core = |s: &&Source| s.path.starts_with("interface/src/core/") && s.is_rust();
    for source in sources.iter().filter(core) {
        for (line, code) in source.code() {
            for name in [
                "Instant",
                "SystemTime",
                "thread",
                "fs",
                "net",
                "io",
                "iceoryx",
            ] {
                if names_part(code, name) {
                    wrong.push(format!("{}:{line} names {name}", source.path));
                }
            }
        }
    }
    wrong
}

/// Whether code names `part` in a path.
fn names_part(code: &str, part: &str) -> bool {
    let ends = |c: Option<char>| !c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    code.match_indices(part).any(|(at, _)| {
        let (before, after) = (&code[..at], &code[at + part.len()..]);
        let whole = ends(before.chars().next_back()) && ends(after.chars().next());
        whole && (before.ends_with("::") || after.starts_with("::"))
    })
}

/// Sources name the transport in three files of `interface`, the codec in one, and parry in one of `dem-proc`.
fn misplaced_names(sources: &[Source]) -> Vec<String> {
    let mut wrong = Vec::new();
    for source in sources.iter().filter(|s| s.is_rust()) {
        let transport = TRANSPORT.contains(&source.path.as_str());
        let codec = source.path == "interface/src/message/codec.rs";
        let parry = source.path == "dem-proc/src/parry.rs";
        let rules = [
            ("iceoryx2", transport),
            ("bincode", codec),
            ("parry2d_f64", parry),
        ];
        for (line, code) in source.code() {
            for (name, allowed) in rules {
                if !allowed && names(code, name) {
                    wrong.push(format!("{}:{line} names {name}", source.path));
                }
            }
        }
    }
    wrong
}

/// Crate roots outside `interface` forbid unsafe code.
fn unsafe_roots(sources: &[Source]) -> Vec<String> {
    let is_root = |s: &&Source| {
        (s.path.ends_with("src/lib.rs") || s.path.ends_with("src/main.rs")) && !of_interface(s)
    };
    sources
        .iter()
        .filter(is_root)
        .filter(|s| !s.text.lines().any(|line| line == "#![forbid(unsafe_code)]"))
        .map(|s| format!("{} does not forbid unsafe code", s.path))
        .collect()
}

/// Every dependency of the workspace says why it is there, and members take theirs from the workspace.
fn unreasoned_dependencies(manifest: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut inside = false;
    let mut seen = 0;
    for line in manifest.lines() {
        if line.starts_with('[') {
            inside = line == "[workspace.dependencies]";
        } else if inside && line.contains('=') && !line.starts_with('#') {
            seen += 1;
            let reason = line
                .rsplit_once('#')
                .map_or("", |(_, reason)| reason.trim());
            if reason.len() < 10 {
                wrong.push(format!("no reason beside `{line}`"));
            }
        }
    }
    if seen == 0 {
        wrong.push("no [workspace.dependencies]".into());
    }
    wrong
}

/// Dependencies with a version or path of a member's own.
fn dependencies_past_the_table(path: &str, manifest: &str) -> Vec<String> {
    let table: toml::Table = manifest.parse().expect("a manifest is TOML");
    let mut wrong = Vec::new();
    for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
        let entries = table.get(kind).and_then(toml::Value::as_table);
        for (name, value) in entries.into_iter().flatten() {
            if value.get("workspace").and_then(toml::Value::as_bool) != Some(true) {
                wrong.push(format!("{path}: {name} is not from the workspace's table"));
            }
        }
    }
    wrong
}

/// What no file may contain or be called.
fn untidy(source: &Source) -> Vec<String> {
    let mut wrong = Vec::new();
    let path = Path::new(&source.path);
    let parts = path.iter().map(|part| Path::new(part).file_stem());
    let parts = parts.flatten().filter_map(|stem| stem.to_str());
    for part in parts.filter(|part| EMPTY_NAMES.contains(part)) {
        wrong.push(format!("{}: `{part}` says nothing", source.path));
    }
    if source.is_rust() {
        let lines = source.text.lines().count();
        if lines > LONGEST {
            wrong.push(format!("{} has {lines} lines", source.path));
        }
        for unfinished in [concat!("todo", "!("), concat!("unimplemented", "!(")] {
            if source.text.contains(unfinished) {
                wrong.push(format!("{} is unfinished: {unfinished}", source.path));
            }
        }
    }
    for home in [
        concat!("/ho", "me/"),
        concat!("/ro", "ot/"),
        concat!("/Us", "ers/"),
    ] {
        // An absolute path begins the text or follows something that is not part of a path.
        let found = source.text.match_indices(home).any(|(at, _)| {
            let before = source.text[..at].chars().next_back();
            !before.is_some_and(|c| c.is_alphanumeric() || "._-~}>/".contains(c))
        });
        if found {
            wrong.push(format!("{} has somebody's home: {home}", source.path));
        }
    }
    wrong
}

/// The public index is the only place where dependencies come from.
fn private_registries(source: &Source) -> Vec<String> {
    let mut wrong = Vec::new();
    let name = Path::new(&source.path).file_name().and_then(|n| n.to_str());
    let config = source.path.contains(".cargo/") || name == Some("Cargo.toml");
    for (k, line) in source.text.lines().enumerate() {
        let foreign = if name == Some("Cargo.lock") {
            line.starts_with("source = ")
                && line != "source = \"registry+https://github.com/rust-lang/crates.io-index\""
        } else {
            let words = ["[source", "[registr", "replace-with", "registry"];
            config && words.iter().any(|word| line.trim_start().starts_with(word))
        };
        if foreign {
            wrong.push(format!("{}:{}: {line}", source.path, k + 1));
        }
    }
    wrong
}

#[track_caller]
fn none(wrong: &[String]) {
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

#[test]
fn arrows_point_down() {
    none(&wrong_arrows(&arrows_of(&workspace())));
}

#[test]
fn only_interface_depends_on_transport_and_codec() {
    let arrows = arrows_of(&workspace());
    none(&strangers_with_transport(&arrows));
    assert!(arrows["interface"].contains("iceoryx2") && arrows["interface"].contains("bincode"));
}

#[test]
fn transport_codec_and_parry_are_named_in_their_files_only() {
    let sources = sources();
    none(&misplaced_names(&sources));
    let parry = |s: &Source| s.path == "dem-proc/src/parry.rs" && s.text.contains("parry2d");
    assert!(sources.iter().any(parry));
}

#[test]
fn the_core_of_the_protocol_has_no_io() {
    let sources = sources();
    none(&core_with_io(&sources));
    let core = |s: &&Source| s.path.starts_with("interface/src/core/");
    assert!(sources.iter().filter(core).count() > 5);
}

#[test]
fn unsafe_code_is_forbidden_outside_interface() {
    let sources = sources();
    none(&unsafe_roots(&sources));
    let roots = [
        "src/main.rs",
        "coupler/src/lib.rs",
        "coupler/report/src/lib.rs",
        "coupler/study/src/lib.rs",
        "coupler/chaos/src/lib.rs",
        "interface/conformance/src/lib.rs",
        "mpm-proc/src/lib.rs",
        "dem-proc/src/lib.rs",
    ];
    for root in roots {
        assert!(
            sources.iter().any(|s| s.path == root),
            "{root} is not there"
        );
    }
}

#[test]
fn dependencies_have_reasons_and_one_table() {
    let sources = sources();
    // No member of the workspace: cargo-fuzz wants it so.
    let member = |s: &&Source| s.path.ends_with("Cargo.toml") && s.path != "fuzz/Cargo.toml";
    for source in sources.iter().filter(member) {
        if source.path == "Cargo.toml" {
            none(&unreasoned_dependencies(&source.text));
        }
        none(&dependencies_past_the_table(&source.path, &source.text));
    }
}

#[test]
fn files_are_tidy() {
    let wrong: Vec<String> = sources().iter().flat_map(untidy).collect();
    none(&wrong);
}

#[test]
fn dependencies_come_from_the_public_index() {
    let wrong: Vec<String> = sources().iter().flat_map(private_registries).collect();
    none(&wrong);
}

/// The rules, each shown a wrong example: a rule that cannot fail is none.
mod the_rules_can_fail {
    use super::*;

    fn arrows(entries: &[(&str, &[&str])]) -> Arrows {
        let set = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        entries
            .iter()
            .map(|(name, to)| (name.to_string(), set(to)))
            .collect()
    }

    fn house() -> Arrows {
        arrows(&[
            ("interface", &["iceoryx2", "bincode"]),
            ("mechanics", &["interface", "schemars"]),
            ("mpm-proc", &["interface", "mechanics", "rayon"]),
            ("dem-proc", &["interface", "mechanics"]),
            ("coupler", &["interface", "mechanics"]),
            ("conformance", &["interface", "mechanics"]),
            (
                "simulation",
                &["interface", "mechanics", "mpm-proc", "dem-proc"],
            ),
            ("study", &["interface", "mechanics", "coupler", "resvg"]),
            ("chaos", &["coupler"]),
            ("report", &["coupler", "askama"]),
            (
                "fuzzing",
                &["interface", "mpm-proc", "dem-proc", "coupler", "report"],
            ),
            (
                "rapier-dem",
                &["interface", "mechanics", "dem-proc", "coupler", "mpm-proc"],
            ),
            (
                "tandem",
                &[
                    "interface",
                    "mpm-proc",
                    "dem-proc",
                    "coupler",
                    "conformance",
                    "report",
                    "study",
                    "chaos",
                ],
            ),
        ])
    }

    #[test]
    fn arrows_that_point_sideways_or_up() {
        none(&wrong_arrows(&house()));
        for (from, to) in [
            ("mpm-proc", "dem-proc"),
            ("coupler", "mpm-proc"),
            ("interface", "coupler"),
            ("interface", "conformance"),
            ("interface", "mechanics"),
            ("conformance", "dem-proc"),
            ("coupler", "study"),
            ("study", "mpm-proc"),
            ("dem-proc", "tandem"),
        ] {
            let mut house = house();
            house.get_mut(from).unwrap().insert(to.into());
            assert_eq!(wrong_arrows(&house), [format!("{from} sees {to}")]);
        }
        let mut stranger = house();
        stranger.insert("plotter".into(), BTreeSet::new());
        assert_eq!(wrong_arrows(&stranger).len(), 1);
        let mut aloof = house();
        aloof.get_mut("coupler").unwrap().clear();
        assert_eq!(
            wrong_arrows(&aloof),
            [
                "coupler does not see interface",
                "coupler does not see mechanics"
            ]
        );
    }

    #[test]
    fn transport_in_another_crate() {
        none(&strangers_with_transport(&house()));
        let mut house = house();
        house
            .get_mut("coupler")
            .unwrap()
            .insert("iceoryx2-bb-posix".into());
        assert_eq!(strangers_with_transport(&house).len(), 1);
    }

    #[test]
    fn names_in_the_wrong_room() {
        let transport = concat!("use ice", "oryx2::prelude::*;");
        let codec = concat!("let x = bin", "code::serde::encode();");
        let at = |path: &str, text: &str| misplaced_names(&[Source::new(path, text)]).len();
        assert_eq!(at("interface/src/transport/iceoryx.rs", transport), 0);
        assert_eq!(at("interface/src/session/turns.rs", transport), 1);
        assert_eq!(at("interface/src/message/codec.rs", codec), 0);
        assert_eq!(at("interface/src/transport/domain.rs", codec), 1);
        assert_eq!(at("interface/conformance/src/lib.rs", transport), 1);
        let parry = concat!("use parr", "y2d_f64::query::distance;");
        assert_eq!(at("dem-proc/src/parry.rs", parry), 0);
        assert_eq!(at("dem-proc/src/contact/overlap.rs", parry), 1);
        assert_eq!(at("coupler/src/run.rs", transport), 1);
        assert_eq!(at("coupler/src/run.rs", codec), 1);
        assert_eq!(
            at("src/main.rs", concat!("use ice", "oryx2 as transport;")),
            1
        );
        // In a comment it is talk; in another name it is another name.
        assert_eq!(at("src/main.rs", &format!("// {transport}")), 0);
        assert_eq!(at("src/main.rs", concat!("my_bin", "code::encode()")), 0);
    }

    #[test]
    fn a_core_with_a_clock_or_a_file() {
        let at =
            |text: &str| core_with_io(&[Source::new("interface/src/core/line.rs", text)]).len();
        assert_eq!(at("use std::time::Duration;"), 0);
        assert_eq!(at("use std::time::Instant;"), 1);
        assert_eq!(at("let now = Instant::now();"), 1);
        assert_eq!(at("std::thread::sleep(nap);"), 1);
        assert_eq!(at("use std::fs::File;"), 1);
    }

    #[test]
    fn a_root_that_allows_unsafe_code() {
        let bare = Source::new("coupler/src/lib.rs", "//! A crate.\n");
        assert_eq!(unsafe_roots(&[bare]).len(), 1);
        let mentioned = Source::new("src/main.rs", "// #![forbid(unsafe_code)]\n");
        assert_eq!(unsafe_roots(&[mentioned]).len(), 1);
        let root = Source::new("interface/src/lib.rs", "//! A crate.\n");
        assert_eq!(unsafe_roots(&[root]).len(), 0);
    }

    #[test]
    fn a_dependency_without_a_reason() {
        let reasoned = "[workspace.dependencies]\nserde = \"1\" # reads scenes\n";
        none(&unreasoned_dependencies(reasoned));
        let bare = "[workspace.dependencies]\nserde = \"1\"\nclap = \"4\" # why\n[lints]\nx = 1\n";
        assert_eq!(unreasoned_dependencies(bare).len(), 2);
        assert_eq!(
            unreasoned_dependencies("[package]\nname = \"x\"\n").len(),
            1
        );
        let own = "[dependencies]\na.workspace = true\nb = \"1\"\nc = { path = \"../c\" }\n";
        assert_eq!(dependencies_past_the_table("x", own).len(), 2);
    }

    #[test]
    fn untidy_files() {
        let complaints = |path: &str, text: &str| untidy(&Source::new(path, text)).len();
        assert_eq!(complaints("coupler/src/run.rs", "fn run() {}\n"), 0);
        assert_eq!(complaints("coupler/src/utils.rs", ""), 1);
        assert_eq!(complaints("coupler/src/helpers/mod.rs", ""), 1);
        assert_eq!(complaints("src/x.rs", concat!("fn f() { to", "do!() }")), 1);
        assert_eq!(
            complaints("src/x.rs", concat!("fn f() { unimple", "mented!() }")),
            1
        );
        assert_eq!(complaints("src/x.rs", &"\n".repeat(LONGEST + 1)), 1);
        assert_eq!(complaints("README.md", &"\n".repeat(LONGEST + 1)), 0);
        assert_eq!(
            complaints("README.md", concat!("see /ho", "me/ada/runs")),
            1
        );
        assert_eq!(complaints(".ci/run", concat!("PATH=/ro", "ot/bin")), 1);
        assert_eq!(
            complaints("README.md", concat!("https://example.org/ho", "me/x")),
            0
        );
    }

    #[test]
    fn another_registry() {
        let complaints =
            |path: &str, text: &str| private_registries(&Source::new(path, text)).len();
        let public = "source = \"registry+https://github.com/rust-lang/crates.io-index\"\n";
        assert_eq!(complaints("Cargo.lock", public), 0);
        assert_eq!(
            complaints(
                "Cargo.lock",
                "source = \"sparse+https://mirror.example/\"\n"
            ),
            1
        );
        assert_eq!(
            complaints(
                ".cargo/config.toml",
                "[source.crates-io]\nreplace-with = \"m\"\n"
            ),
            2
        );
        assert_eq!(
            complaints(".cargo/config.toml", "[build]\nrustflags = []\n"),
            0
        );
    }
}
