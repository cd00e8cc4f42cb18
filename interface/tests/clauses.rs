//! PROTOCOL.md and the registry of its clauses say the same.

use std::collections::BTreeSet;
use std::path::Path;

use interface::clauses::{CLAUSES, table};

/// Where the table of section 13 stands.
const BEGIN: &str = "<!-- clauses: made of interface/src/clauses.rs; UPDATE_CLAUSES=1 cargo test -p interface --test clauses -->\n";
const END: &str = "<!-- end of clauses -->\n";

/// Rows whose prose is still to be written.
const PENDING: &[&str] = &["J-2", "K-3", "K-4", "L-6", "R-6"];

fn protocol() -> (std::path::PathBuf, String) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("PROTOCOL.md");
    let text = std::fs::read_to_string(&path).unwrap();
    (path, text)
}

#[test]
fn the_table_of_section_13_is_made_of_the_registry() {
    let (path, text) = protocol();
    let begin = text.find(BEGIN).expect("a table of clauses") + BEGIN.len();
    let end = begin + text[begin..].find(END).expect("its end");
    if text[begin..end] == table() {
        return;
    }
    if std::env::var_os("UPDATE_CLAUSES").is_some() {
        let new = [&text[..begin], &table(), &text[end..]].concat();
        return std::fs::write(path, new).unwrap();
    }
    panic!("PROTOCOL.md's table is not that of the registry: UPDATE_CLAUSES=1 writes it");
}

#[test]
fn every_clause_has_one_row_and_one_place_in_the_prose() {
    let (_, text) = protocol();
    let mut prose = BTreeSet::new();
    for bold in text.split("**").skip(1).step_by(2) {
        let mut parts = bold.split('-');
        let (Some(letter), Some(number), None) = (parts.next(), parts.next(), parts.next()) else {
            continue;
        };
        let id = letter.len() == 1 && letter.chars().all(|c| c.is_ascii_uppercase());
        if id && number.parse::<u32>().is_ok() {
            assert!(prose.insert(bold), "{bold} is there twice");
        }
    }
    let rows: BTreeSet<&str> = CLAUSES.iter().map(|clause| clause.id).collect();
    assert_eq!(rows.len(), CLAUSES.len(), "a row is there twice");
    let unwritten: Vec<_> = rows
        .difference(&prose)
        .filter(|id| !PENDING.contains(id))
        .collect();
    assert!(unwritten.is_empty(), "no prose: {unwritten:?}");
    let unlisted: Vec<_> = prose.difference(&rows).collect();
    assert!(unlisted.is_empty(), "no row: {unlisted:?}");
}
