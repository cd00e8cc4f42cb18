//! Names and texts of a run in the page of its report: none may become markup or script.

use std::path::Path;
use std::sync::LazyLock;

use report::record::Record;

use crate::run::{LEFT, directory};
use crate::target::Target;

/// Pages. An input is texts, one a line: what the scene is called, why the run ended, a check, a column, a line of the log;
/// or, if it begins with a zero byte, the bytes of one file of the run directory.
pub const TARGET: Target = Target {
    name: "page",
    run,
    seeds,
    change: |changer, input, seeds| changer.text(input, seeds),
    // The template with its script, and curves.
    base: 64 << 20,
    per_byte: 4096,
};

/// Files that a page is made of.
const FILES: [&str; 5] = [
    "summary.json",
    "scene.toml",
    "history.csv",
    "course.csv",
    "log.jsonl",
];

fn run(input: &[u8]) {
    let dir = directory();
    LEFT.put(dir.path());
    match input {
        [0, file, bytes @ ..] => {
            let name = FILES[usize::from(*file) % FILES.len()];
            std::fs::write(dir.path().join(name), bytes).expect("room for an input");
        }
        text => rename(dir.path(), &String::from_utf8_lossy(text)),
    }
    let Ok(record) = Record::read(dir.path()) else {
        return;
    };
    if let Ok(page) = report::page::page(&[record], None) {
        judge(&page);
    }
}

/// Puts the texts where names and reasons are.
fn rename(dir: &Path, text: &str) {
    let mut lines = text.lines().chain(std::iter::repeat(text));
    let mut next = || lines.next().unwrap_or_default();
    let summary = dir.join("summary.json");
    let read = std::fs::read_to_string(&summary).expect("the summary of the small run");
    let mut value: serde_json::Value = serde_json::from_str(&read).expect("JSON");
    value["scene"] = next().into();
    value["reason"] = next().into();
    value["status"] = next().into();
    value["checks"][0]["name"] = next().into();
    value["checks"][0]["source"] = next().into();
    value["checks"][0]["unit"] = next().into();
    std::fs::write(summary, value.to_string()).expect("room for an input");
    let column = next().replace('"', "\"\"");
    let history = dir.join("history.csv");
    let read = std::fs::read_to_string(&history).expect("the history of the small run");
    let rows = read.split_once('\n').map_or("", |(_, rows)| rows);
    std::fs::write(history, format!("time [s],\"{column}\"\n{rows}")).expect("room for an input");
    let line =
        serde_json::json!({"timestamp": next(), "level": next(), "fields": {"message": next()}});
    std::fs::write(dir.join("log.jsonl"), format!("{line}\n")).expect("room for an input");
    let about = toml::Value::String(next().to_owned());
    let scene = dir.join("scene.toml");
    let read = std::fs::read_to_string(&scene).expect("the scene of the small run");
    let read: Vec<&str> = read
        .lines()
        .filter(|line| !line.starts_with("about"))
        .collect();
    std::fs::write(scene, format!("about = {about}\n{}", read.join("\n"))).expect("room");
}

/// What a text would have to begin or end to become more than text.
const ELEMENTS: [&str; 7] = [
    "<script", "</script", "<style", "</style", "<iframe", "<img", "<!--",
];

/// How many of them a page has.
fn elements(page: &str) -> [usize; ELEMENTS.len()] {
    let page = page.to_ascii_lowercase();
    ELEMENTS.map(|element| page.matches(element).count())
}

/// As many elements as the page of the small run has, whatever the texts are.
fn judge(page: &str) {
    static PLAIN: LazyLock<[usize; ELEMENTS.len()]> = LazyLock::new(|| {
        let dir = directory();
        LEFT.put(dir.path());
        let record = Record::read(dir.path()).expect("the small run");
        elements(&report::page::page(&[record], None).expect("its page"))
    });
    for ((element, found), most) in ELEMENTS.iter().zip(elements(page)).zip(*PLAIN) {
        assert!(
            found <= most,
            "{found} of `{element}` in the page, expected at most {most}"
        );
    }
}

fn seeds() -> Vec<Vec<u8>> {
    let evil = "</script><script>alert(1)</script>\n<!--<script>\n\" onload=\"x\n' & &amp; <b>\n]]>\n\u{2028}\u{0}\u{202e}x\n\
                <img src=x onerror=alert(1)>\n</style>\n{{ title }}\n\\u003c/script>\nx\ny\nz";
    let mut seeds = vec![
        evil.into(),
        b"name\nreason\ndone\ncheck\nsource\nm\nx [m]\nnow\nINFO\nwords\nabout".to_vec(),
    ];
    for (k, name) in FILES.iter().enumerate() {
        seeds.push([&[0, k as u8], LEFT.file(name)].concat());
    }
    seeds
}
