//! The text of a scene, read and planned as `tandem check` and `tandem plan` do.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use coupler::scene::SceneFile;

use crate::target::Target;

/// Scenes.
pub const TARGET: Target = Target {
    name: "scene",
    run,
    seeds,
    change: |changer, input, seeds| changer.text(input, seeds),
    // The schema, and the bodies of a fill: as many as its limit allows.
    base: 64 << 20,
    per_byte: 4096,
};

/// Scenes may name files beside them: here are none.
static NOWHERE: LazyLock<PathBuf> = LazyLock::new(|| std::env::temp_dir().join("tandem-no-scene"));

fn run(input: &[u8]) {
    let file = match SceneFile::of_text("scene.toml", &String::from_utf8_lossy(input), &NOWHERE) {
        Ok(file) => file,
        Err(errors) => return drop(errors.to_string()),
    };
    match file.scene(None, &[]) {
        Ok(scene) => {
            let _ = scene.plan().to_string();
            // Each of them is read like the scene.
            for variant in scene.variants.iter().take(2) {
                match file.scene(Some(variant), &[]) {
                    Ok(scene) => drop(scene.plan().to_string()),
                    Err(errors) => drop(errors.to_string()),
                }
            }
        }
        Err(errors) => drop(errors.to_string()),
    }
}

/// The scenes of the tree that are not long, and those that are wrong.
fn seeds() -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut seeds = Vec::new();
    for folder in ["scenes", "coupler/tests/bad_scenes"] {
        gather(&root.join(folder), &mut seeds);
    }
    seeds
}

fn gather(folder: &Path, seeds: &mut Vec<Vec<u8>>) {
    let entries = std::fs::read_dir(folder).expect("the scenes of the tree");
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            gather(&path, seeds);
        } else if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read(&path).expect("a scene");
            if text.len() < 10_000 {
                seeds.push(text);
            }
        }
    }
}
