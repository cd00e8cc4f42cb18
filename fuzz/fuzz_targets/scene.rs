//! The text of a scene: read and planned as `tandem plan` does it, or refused.

#![no_main]

use std::path::Path;

use coupler::scene::SceneFile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    // A scene may name files beside it: there are none.
    let file = SceneFile::of_text("scene.toml", text, Path::new("/nonexistent"));
    match file.and_then(|file| file.scene(None, &[])) {
        Ok(scene) => drop(scene.plan()),
        Err(errors) => drop(errors.to_string()),
    }
});
