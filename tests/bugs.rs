//! Bugs of physics in a solver of bodies, one by one, as authors make them: `bugs.toml`.
//! The kit has to find each by random cases.

use crate::harness::needs::Need;
use crate::harness::{Place, copy, python_can_join, root};

const DISCS: &str = "examples/disc_dem.py";

/// Seeds and numbers of cases of a search: the case that is known to show what is looked for, and where it does not any more,
/// all from the start, as in every search of `.ci/nightly`, which prints where each is found.
fn searches(known: u64) -> impl Iterator<Item = (u64, u64)> {
    let whole = std::env::var_os("TANDEM_SEARCH").is_some();
    let known = (!whole).then_some((known, 1));
    known.into_iter().chain([(0, 10_000)])
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
    let mut missed = Vec::new();
    let bugs: toml::Table = include_str!("bugs.toml").parse().unwrap();
    for (k, bug) in bugs["bug"].as_array().unwrap().iter().enumerate() {
        let words = ["what", "file", "from", "to"];
        let [what, file, from, to] = words.map(|key| bug[key].as_str().unwrap());
        let seed = bug["seed"].as_integer().unwrap() as u64;
        let package = place.path(&format!("bug{k}"));
        for part in ["tandem_solver", "examples"] {
            copy(&root().join("python").join(part), &package.join(part));
        }
        let file = package.join(file);
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(
            text.matches(from).count(),
            1,
            "{what}: {from} has to be there once"
        );
        std::fs::write(&file, text.replace(from, to)).unwrap();
        let command = format!("python3 '{}'", package.join(DISCS).display());
        // No time to make a case small: the first one that shows the bug is enough.
        let found = searches(seed).find_map(|(seed, cases)| {
            let numbers = format!("--seed {seed} --cases {cases} --time 20 --shrink 0");
            let only = "J-1,T-1,F-8,F-7,F-5,F-6,F-9,E-4,R-3,L-2,N-1";
            let mut kit = vec!["conformance", "--dem", &command, "--only", only];
            kit.extend(numbers.split(' '));
            let ended = place.start(&kit).end();
            let again = ended.stdout.split("--seed ").nth(1).map(str::to_owned);
            again.filter(|_| ended.status.code() == Some(1) && ended.stdout.contains("FAIL"))
        });
        match found {
            Some(again) => println!("{what}: {}", again.lines().next().unwrap_or_default()),
            None => missed.push(what),
        }
    }
    assert!(missed.is_empty(), "not found:\n{}", missed.join("\n"));
}
