//! Scenes that are changed at random: whatever a text says, it is planned as by `tandem plan`, or refused, in bounded time and
//! memory.
//!
//! `CHANGED_SECONDS=60 CHANGED_SEED=7` looks for longer and elsewhere. A text that fails is kept; `CHANGED_TEXT=FILE` takes it
//! again.

use std::path::Path;
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use coupler::scene::SceneFile;
use fastrand::Rng;

use crate::scenes::scenes_below;

/// Longest that one text may take, on a machine that does other things.
const PATIENCE: Duration = Duration::from_secs(30);
/// Most memory of a text in bytes: for the schema and the bodies of a fill, as many as its limit allows, and for each of its bytes.
const MEMORY: [u64; 2] = [64 << 20, 4096];
/// Seeds are not longer in bytes.
const LONGEST: usize = 10_000;
/// Numbers at the edges of something, and words that are not numbers.
const WORDS: &str = "0 -1 3 0.5 1e-300 -1e300 1e16 5e-324 nan -inf 4294967296 1000000 9223372036854775807 \
    18446744073709551615 true \"\" [] {} \"t\" 1979-05-27T07:32:00Z";
const OPERATORS: &str = "+ - * / ^ , . ( )";

/// The scenes of the tree that are not long, and those that are wrong.
fn seeds() -> Vec<String> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for folder in [here.join("../scenes"), here.join("tests/bad_scenes")] {
        scenes_below(&folder, &mut paths);
    }
    paths.sort();
    let texts = paths.iter().map(std::fs::read_to_string);
    texts
        .map(Result::unwrap)
        .filter(|text| text.len() < LONGEST)
        .collect()
}

/// Changes a few lines of a text.
fn change(dice: &mut Rng, text: &str, seeds: &[String]) -> String {
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    for _ in 0..1 << dice.usize(..4) {
        lines.push(String::new());
        let at = dice.usize(..lines.len());
        match dice.u8(..8) {
            0 => drop(lines.remove(at)),
            1 => lines.insert(at, lines[at].clone()),
            2 => {
                let other = dice.usize(..lines.len());
                lines.swap(at, other);
            }
            3 => {
                let others = seeds[dice.usize(..seeds.len())].lines();
                let from = dice.usize(..100);
                let more: Vec<String> = others.skip(from).take(12).map(String::from).collect();
                lines.splice(at..at, more);
            }
            4 => {
                let line = &mut lines[at];
                let places: Vec<usize> = line.char_indices().map(|(place, _)| place).collect();
                let place = dice.choice(places).unwrap_or(0);
                line.truncate(place);
                line.push(dice.char(..));
            }
            _ => change_word(dice, &mut lines[at]),
        }
    }
    lines.join("\n")
}

/// Changes a number or a word of a line.
fn change_word(dice: &mut Rng, line: &mut String) {
    let of_word = |c: char| c.is_ascii_alphanumeric() || "._-+\"".contains(c);
    let words = line.split(|c| !of_word(c)).filter(|word| !word.is_empty());
    let words: Vec<&str> = words.collect();
    let Some(&word) = dice.choice(&words) else {
        return;
    };
    let [one, operator] = [WORDS, OPERATORS].map(|all| {
        let all: Vec<&str> = all.split_whitespace().collect();
        all[dice.usize(..all.len())]
    });
    let new = match dice.u8(..5) {
        0 => words[dice.usize(..words.len())].to_owned(),
        1 => format!("{word}{operator}{one}"),
        2 => f64::from_bits(dice.u64(..)).to_string(),
        _ => one.to_owned(),
    };
    let at = word.as_ptr() as usize - line.as_ptr() as usize;
    let span = at..at + word.len();
    line.replace_range(span, &new);
}

/// Reads and plans a scene and two of its variants, each of which is read like the scene.
fn plan(text: &str) -> Result<(), String> {
    // Scenes may name files beside them: here are none.
    let nowhere = std::env::temp_dir().join("tandem-no-scene");
    let file = SceneFile::of_text("scene.toml", text, &nowhere).map_err(|e| e.to_string())?;
    let scene = file.scene(None, &[]).map_err(|e| e.to_string())?;
    let _ = scene.plan();
    for variant in scene.variants.iter().take(2) {
        let scene = file.scene(Some(variant), &[]).map_err(|e| e.to_string())?;
        let _ = scene.plan();
    }
    Ok(())
}

/// What is wrong with what is done with a text.
fn wrong(text: &str) -> Option<String> {
    let (report, outcome) = channel();
    let own = text.to_owned();
    thread::spawn(move || {
        let taken = allocation_counter::measure(|| drop(plan(&own)));
        let _ = report.send(taken.bytes_max);
    });
    let [base, each] = MEMORY;
    match outcome.recv_timeout(PATIENCE) {
        // A panic ends the thread without an answer.
        Err(error) => Some(format!("it panics or hangs: {error}")),
        Ok(most) if most > base + each * text.len() as u64 => Some(format!("{most} bytes")),
        Ok(_) => None,
    }
}

#[test]
fn whatever_a_text_says_it_is_planned_or_refused() {
    if let Ok(path) = std::env::var("CHANGED_TEXT") {
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(wrong(&text), None, "{path}");
        return;
    }
    let asked = |name: &str, or: u64| std::env::var(name).map_or(or, |n| n.parse().unwrap());
    let mut dice = Rng::with_seed(asked("CHANGED_SEED", 15));
    let end = Instant::now() + Duration::from_secs(asked("CHANGED_SECONDS", 3));
    let (seeds, mut count) = (seeds(), 0);
    while Instant::now() < end {
        let text = change(&mut dice, &seeds[count % seeds.len()], &seeds);
        if let Some(wrong) = wrong(&text) {
            let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("changed.toml");
            std::fs::write(&kept, text).unwrap();
            panic!("{wrong}: CHANGED_TEXT={}", kept.display());
        }
        count += 1;
    }
    println!("{count} texts");
    assert!(count > 10, "only {count} texts");
}
