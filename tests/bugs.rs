//! Bugs of physics in a solver, one by one, as authors make them: `bugs.toml`.
//! The kit has to find each by random cases.

use std::path::Path;
use std::process::Command;

use interface::message::control::Party;
use serde_json::{Value, json};

use crate::harness::needs::Need;
use crate::harness::{Ended, Place, copy, has, python_can_join, root, words};

/// What the kit says of each bug.
const STORIES: &str = "docs/results/conformance/bugs.json";

const DISCS: &str = "examples/disc_dem.py";

/// What random cases judge of bodies, and of a continuum.
const ONLY: [&str; 2] = [
    "J-1,T-1,F-8,F-7,F-5,F-6,F-9,E-4,R-3,L-2,N-1",
    "F-1a,T-1a,I-2g,I-7a,I-6a,L-2a,R-3e,N-1a",
];

/// Seeds and numbers of cases of a search: the case that is known to show what is looked for, and where it does not any more,
/// all from the start, as in every search of `.ci/nightly`, which prints where each is found.
fn searches(known: u64) -> impl Iterator<Item = (u64, u64)> {
    let whole = std::env::var_os("TANDEM_SEARCH").is_some();
    let known = (!whole).then_some((known, 1));
    known.into_iter().chain([(0, 10_000)])
}

/// A change of a file, and a seed whose case shows it.
struct Bug {
    what: String,
    seed: u64,
    file: String,
    from: String,
    to: String,
}

impl Bug {
    /// Those of a list of `bugs.toml`.
    fn all(list: &str) -> Vec<Self> {
        let lists: toml::Table = include_str!("bugs.toml").parse().unwrap();
        let of = |bug: &toml::Value| {
            let words = |key: &str| bug[key].as_str().unwrap().to_owned();
            Self {
                what: words("what"),
                seed: bug["seed"].as_integer().unwrap() as u64,
                file: words("file"),
                from: words("from"),
                to: words("to"),
            }
        };
        lists[list].as_array().unwrap().iter().map(of).collect()
    }

    /// Whether it is in a continuum.
    fn is_of_continuum(&self) -> bool {
        self.file.starts_with("mpm-proc")
    }

    /// Changes its file in a copy; returns what was there.
    fn put(&self, tree: &Path) -> String {
        let (file, Self { what, from, .. }) = (tree.join(&self.file), self);
        let text = std::fs::read_to_string(&file).unwrap();
        let count = text.matches(from).count();
        assert_eq!(count, 1, "{what}: {from} has to be there once");
        std::fs::write(&file, text.replace(from, &self.to)).unwrap();
        text
    }

    /// What the kit says of it, of which `run` says how that ends with more options; nothing where it does not find it.
    fn story(&self, place: &Place, run: impl Fn(&str) -> Ended) -> Option<Value> {
        // No time to make a case small where nobody reads it: the first one that shows the bug is enough.
        let shrink = if writes() { 4 } else { 0 };
        let only = ONLY[usize::from(self.is_of_continuum())];
        let found = searches(self.seed).find_map(|(seed, cases)| {
            let file = place.path("verdicts.json");
            let ended = run(&format!(
                "--only {only} --seed {seed} --cases {cases} --time 60 --shrink {shrink} --json {}",
                file.display()
            ));
            let text = std::fs::read_to_string(file).ok()?;
            let verdicts: Value = serde_json::from_str(&text).ok()?;
            let clauses = verdicts["clauses"].as_array()?.iter();
            let failed = clauses.filter(|clause| clause["verdict"] == "fail");
            // The clause whose breach comes first in a step is the nearest to the cause.
            let mut stories = failed.map(|clause| {
                json!({
                    "bug": self.what,
                    "clause": clause["id"],
                    "step": clause["step"],
                    "expected": clause["expected"],
                    "got": clause["got"],
                    "story": clause["story"],
                })
            });
            stories.find(|_| ended.status.code() == Some(1))
        });
        let again = found
            .as_ref()
            .and_then(|found| found["story"].as_array()?.last());
        println!("{}: {}", self.what, again.unwrap_or(&json!("not found")));
        found
    }
}

/// Whether what the kit says of the bugs is written to [`STORIES`].
fn writes() -> bool {
    std::env::var_os("UPDATE_STORIES").is_some()
}

/// Each bug is found; its story is written where that is asked for.
fn all_are_found(list: &str, found: &[(String, Option<Value>)]) {
    let missed: Vec<_> = found.iter().filter(|(_, story)| story.is_none()).collect();
    assert!(missed.is_empty(), "not found: {missed:?}");
    if writes() {
        let path = root().join(STORIES);
        let text = std::fs::read_to_string(&path).unwrap_or("{}".into());
        let mut stories: Value = serde_json::from_str(&text).unwrap();
        stories[list] = found
            .iter()
            .filter_map(|(_, story)| story.clone())
            .collect();
        let text = serde_json::to_string_pretty(&stories).unwrap();
        std::fs::write(path, text + "\n").unwrap();
    }
}

/// The stories that are written are those of the bugs that there are.
#[test]
fn every_bug_has_its_story() {
    let text = std::fs::read_to_string(root().join(STORIES)).unwrap();
    let stories: Value = serde_json::from_str(&text).unwrap();
    for list in stories.as_object().unwrap().keys() {
        let known = stories[list].as_array().unwrap().iter();
        let known: Vec<&str> = known.map(|known| known["bug"].as_str().unwrap()).collect();
        let bugs = Bug::all(list);
        let bugs: Vec<&str> = bugs.iter().map(|bug| bug.what.as_str()).collect();
        assert_eq!(known, bugs, "UPDATE_STORIES=1 writes them");
        // The story of a clause that a bug breaks names the usual mistakes.
        for known in stories[list].as_array().unwrap() {
            let mut clauses = [Party::Dem, Party::Mpm].map(conformance::clause::own);
            let mut clauses = clauses.iter_mut().flatten();
            let of = clauses.find(|clause| clause.id == known["clause"]);
            assert!(!of.unwrap().often.is_empty(), "{}", known["clause"]);
        }
    }
    let page = std::fs::read_to_string(root().join("docs/conformance.md")).unwrap();
    has(&page, &format!("has {} more", Bug::all("bug").len()));
}

#[test]
fn every_bug_of_physics_is_found_by_random_cases() {
    if !Need::Python.is_met(
        python_can_join(),
        "python3 cannot import iceoryx2: python/README.md",
    ) {
        return;
    }
    let place = Place::new();
    let mut found = Vec::new();
    for (k, bug) in Bug::all("bug").into_iter().enumerate() {
        let package = place.path(&format!("bug{k}"));
        for part in ["tandem_solver", "examples"] {
            copy(&root().join("python").join(part), &package.join(part));
        }
        bug.put(&package);
        let discs = package.join(DISCS).display().to_string();
        let kit = format!("conformance --dem 'python3 {discs}'");
        let run = |options: &str| place.tandem(&format!("{kit} {options}"));
        let story = bug.story(&place, run);
        found.push((bug.what, story));
    }
    all_are_found("bug", &found);
}

/// In a copy of the tree, which is built with each.
#[test]
#[ignore = "builds all again and again: ten minutes"]
fn every_bug_of_the_built_in_solver_is_found_by_random_cases() {
    let place = Place::new();
    let tree = place.path("tree");
    let shell = |script: &str| {
        let mut sh = Command::new("sh");
        sh.args(["-ec", script])
            .env("TREE", &tree)
            .current_dir(root());
        assert!(sh.status().unwrap().success(), "{script}");
    };
    shell(r#"mkdir "$TREE"; git ls-files -z | xargs -0 cp -P --parents -t "$TREE""#);
    let mut found = Vec::new();
    for bug in Bug::all("built_in") {
        let before = bug.put(&tree);
        shell(r#"cargo build --release --bin tandem --manifest-path "$TREE/Cargo.toml""#);
        let program = tree.join("target/release/tandem");
        let run = |options: &str| {
            let side = if bug.is_of_continuum() { "mpm" } else { "dem" };
            let kit = format!("conformance --{side} built-in --in-process {options}");
            place.start_as(&program, &words(&kit)).end()
        };
        let story = bug.story(&place, run);
        std::fs::write(tree.join(&bug.file), before).unwrap();
        found.push((bug.what, story));
    }
    all_are_found("built_in", &found);
}

#[test]
fn the_lines_that_bugs_change_are_there() {
    for bug in Bug::all("built_in") {
        let text = std::fs::read_to_string(root().join(&bug.file)).unwrap();
        assert_eq!(text.matches(&bug.from).count(), 1, "{}", bug.what);
    }
}
