//! Tells in one line which tests were left out for lack of something, and why. No test itself: libtest keeps to itself what
//! passing tests say. Cargo runs it after `tandem-tests`, whose notes it reads (`tests/harness/needs.rs`) and takes away.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn main() {
    if std::env::args().any(|argument| argument == "--list") {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("left-out");
    let entries = fs::read_dir(&folder).into_iter().flatten().flatten();
    let mut left_out: Vec<String> = entries
        .map(|entry| {
            let text = fs::read_to_string(entry.path()).expect("a note");
            let lines: BTreeSet<(&str, &str)> = text
                .lines()
                .filter_map(|line| line.split_once('\t'))
                .collect();
            let tests: BTreeSet<&str> = lines.iter().map(|line| line.0).collect();
            let why: BTreeSet<&str> = lines.iter().map(|line| line.1).collect();
            let why: Vec<&str> = why.into_iter().collect();
            let need = entry.file_name();
            format!(
                "{} tests for {} ({})",
                tests.len(),
                need.display(),
                why.join("; ")
            )
        })
        .collect();
    left_out.sort();
    let _ = fs::remove_dir_all(&folder);
    match left_out.as_slice() {
        [] => println!("\nleft out: nothing of tandem-tests\n"),
        left_out => println!("\nleft out: {}\n", left_out.join(", ")),
    }
}
