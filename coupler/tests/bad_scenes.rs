//! Bad scenes are files; each carries what its refusal must say in `# expect:` lines at its top. Bad values are rows of a table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use coupler::scene::{Scene, SceneFile};
use serde::Deserialize;

use crate::scenes::scenes_below;

fn bad_scenes() -> Vec<PathBuf> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_scenes");
    let mut files = Vec::new();
    scenes_below(&directory, &mut files);
    files.sort();
    files
}

#[test]
fn every_bad_scene_gives_its_expected_message_and_names_its_file() {
    let files = bad_scenes();
    assert!(files.len() >= 25, "only {} bad scenes", files.len());
    let mut disappointments = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("readable");
        let expected: Vec<&str> = text
            .lines()
            .map_while(|line| line.strip_prefix("# expect: "))
            .collect();
        assert!(!expected.is_empty(), "{} expects nothing", file.display());
        // A variant that is wrong is refused when it is asked for.
        let variant = text
            .lines()
            .find_map(|line| line.strip_prefix("# variant: "));
        let message = match Scene::load(&file, variant, &[]) {
            Ok(_) => "nothing: it was accepted".to_owned(),
            Err(errors) => errors.to_string(),
        };
        for place in message.lines().filter(|line| line.contains("-->")) {
            assert!(place.contains(&*file.to_string_lossy()), "{place}");
        }
        for phrase in expected.iter().filter(|phrase| !message.contains(**phrase)) {
            let file = file.display();
            disappointments.push(format!("{file}\nexpected: {phrase}\ngot:\n{message}"));
        }
    }
    assert!(disappointments.is_empty(), "{}", disappointments.join("\n"));
}

/// A sound scene, and rows of values that are wrong in it.
#[derive(Deserialize)]
struct BadValues {
    scene: String,
    bad: String,
}

#[test]
fn every_bad_value_is_refused_with_key_and_reason() {
    let tables: BTreeMap<String, Vec<BadValues>> =
        toml::from_str(include_str!("bad_values.toml")).expect("tables");
    let mut disappointments = Vec::new();
    for BadValues { scene, bad } in &tables["of"] {
        let file = SceneFile::of_text("sound.toml", scene, Path::new("."));
        let file = file.unwrap_or_else(|errors| panic!("{errors}"));
        file.scene(None, &[])
            .unwrap_or_else(|errors| panic!("{errors}"));
        for row in bad.lines() {
            let mut cells = row.split(" | ");
            let set = cells.next().expect("what is set").split("; ");
            let set: Vec<String> = set.map(String::from).collect();
            let message = match file.scene(None, &set) {
                Ok(_) => "nothing: it was accepted".to_owned(),
                Err(errors) => errors.to_string(),
            };
            if !cells.all(|phrase| message.contains(phrase)) {
                disappointments.push(format!("{row}\ngot:\n{message}"));
            }
        }
    }
    assert!(disappointments.is_empty(), "{}", disappointments.join("\n"));
}
