//! Every scene that comes with Tandem parses, in every variant, and says what a run would do.

use std::path::{Path, PathBuf};

use coupler::scene::Scene;
use serde::Serialize;
use serde::de::DeserializeOwned;

pub fn scenes_below(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).expect("readable folder") {
        let path = entry.expect("readable entry").path();
        if path.is_dir() {
            scenes_below(&path, found);
        } else if path.extension().is_some_and(|e| e == "toml") {
            found.push(path);
        }
    }
}

fn scenes() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    scenes_below(&directory, &mut found);
    found.sort();
    found
}

fn load(file: &Path, variant: Option<&str>) -> Scene {
    Scene::load(file, variant, &[])
        .unwrap_or_else(|errors| panic!("{} {variant:?}\n{errors}", file.display()))
}

/// A configuration as its solver reads it.
fn sent<T: Serialize + DeserializeOwned>(config: &T) -> T {
    serde_json::from_str(&serde_json::to_string(config).unwrap()).unwrap()
}

/// The variant that tests run, where there is one.
fn quick(scene: &Scene) -> Option<&'static str> {
    let has = scene.variants.iter().any(|v| v == "quick");
    has.then_some("quick")
}

#[test]
fn every_scene_parses_in_every_variant_and_plans() {
    let files = scenes();
    assert!(files.len() >= 8, "only {} scenes", files.len());
    for file in files {
        let scene = load(&file, None);
        assert_eq!(
            (sent(&scene.mpm), sent(&scene.dem)),
            (scene.mpm.clone(), scene.dem.clone())
        );
        let stem = file.file_stem().expect("a file").to_string_lossy();
        assert_eq!(scene.name, stem, "the name is that of the file");
        assert!(!scene.about.is_empty(), "{stem} says what to look for");
        assert!(!scene.checks.is_empty(), "{stem} has checks");
        assert!(!scene.output.columns.is_empty(), "{stem} has columns");
        for variant in scene.variants.iter() {
            let scene = load(&file, Some(variant));
            assert!(!scene.plan().contains("runs\nleft out"), "something runs");
            assert_eq!((sent(&scene.mpm), sent(&scene.dem)), (scene.mpm, scene.dem));
        }
    }
}

#[test]
fn every_scene_checks_momentum_and_energy() {
    // Some of those at the edge stop by themselves; tests/hashes.rs holds each to its end.
    let edge = Path::new("extreme");
    for file in scenes()
        .iter()
        .filter(|f| !f.parent().unwrap().ends_with(edge))
    {
        let scene = load(file, None);
        // Where the momentum is none, `momentum_error` is rounding over rounding: then the sum itself is checked.
        for needed in ["momentum", "energy.residual_relative"] {
            let has = |check: &coupler::record::check::Check| check.value.source().contains(needed);
            assert!(scene.checks.iter().any(has), "{}: {needed}", scene.name);
        }
    }
}

#[test]
fn the_resolved_scene_is_the_same_scene_again() {
    let directory = tempfile::tempdir().expect("temporary directory");
    for file in scenes() {
        let first = load(&file, quick(&load(&file, None)));
        let again = directory.path().join("scene.toml");
        std::fs::write(&again, &first.resolved_toml).expect("writable");
        let second = load(&again, None);
        assert_eq!(second.resolved_toml, first.resolved_toml, "{}", first.name);
        assert_eq!(second.hash, first.hash);
        assert_eq!((second.mpm, second.dem), (first.mpm, first.dem));
        assert_eq!(second.time, first.time);
    }
}
