//! PROTOCOL.md and the registry of its clauses agree.

use std::collections::BTreeSet;
use std::path::Path;

use interface::clauses::{CLAUSES, table};

/// The lines around the table of section 13.
const BEGIN: &str = "<!-- clauses: made of interface/src/clauses.rs; UPDATE_CLAUSES=1 cargo test -p interface --test interface-tests clauses:: -->\n";
const END: &str = "<!-- end of clauses -->\n";

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
        if is_id(bold) {
            assert!(prose.insert(bold), "{bold} is there twice");
        }
    }
    let rows: BTreeSet<&str> = CLAUSES.iter().map(|clause| clause.id).collect();
    assert_eq!(rows.len(), CLAUSES.len(), "a row is there twice");
    let unwritten: Vec<_> = rows.difference(&prose).collect();
    assert!(unwritten.is_empty(), "no prose: {unwritten:?}");
    let unlisted: Vec<_> = prose.difference(&rows).collect();
    assert!(unlisted.is_empty(), "no row: {unlisted:?}");
}

/// Whether a text is the id of a clause: a letter, a dash, a number.
fn is_id(text: &str) -> bool {
    let Some((letter, number)) = text.split_once('-') else {
        return false;
    };
    let letter = letter.len() == 1 && letter.chars().all(|c| c.is_ascii_uppercase());
    letter && number.parse::<u32>().is_ok()
}

/// The session names only clauses that exist.
#[test]
fn the_session_checks_what_the_registry_says() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/session");
    let mut named = BTreeSet::new();
    let files = std::fs::read_dir(folder).unwrap();
    let files = files.map(|entry| entry.unwrap().path());
    for file in files.filter(|path| path.is_file()) {
        let text = std::fs::read_to_string(file).unwrap();
        let quoted = text.split('"').skip(1).step_by(2);
        named.extend(quoted.filter(|text| is_id(text)).map(String::from));
    }
    let rows: BTreeSet<String> = CLAUSES.iter().map(|clause| clause.id.into()).collect();
    let unknown: Vec<_> = named.difference(&rows).collect();
    assert!(
        unknown.is_empty(),
        "named in the session, without a row: {unknown:?}"
    );
    assert!(named.len() > 25, "{named:?}");
}
