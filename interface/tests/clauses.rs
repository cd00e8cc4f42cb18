//! PROTOCOL.md states every clause once, says who checks it, and the session names no other.

use std::collections::BTreeSet;
use std::path::Path;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// Whether a text is the id of a clause: a letter, a dash, a number.
fn is_id(text: &str) -> bool {
    let Some((letter, number)) = text.split_once('-') else {
        return false;
    };
    let letter = letter.len() == 1 && letter.chars().all(|c| c.is_ascii_uppercase());
    letter && number.parse::<u32>().is_ok()
}

/// The ids in a text that is split like this; each may be there once only.
fn ids<'a>(parts: impl Iterator<Item = &'a str>) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    for id in parts.filter(|part| is_id(part)) {
        assert!(found.insert(id), "{id} is there twice");
    }
    found
}

#[test]
fn every_clause_has_one_place_in_the_text_and_one_in_the_table_of_who_checks_it() {
    let text = read("PROTOCOL.md");
    let (clauses, table) = text.split_once("## 13 Who checks what").expect("a table");
    let stated = ids(clauses.split("**").skip(1).step_by(2));
    let listed = ids(table
        .split(['|', ',', ' ', '\n'])
        .map(|id| id.trim_end_matches("\\*")));
    assert!(stated.len() > 100, "{stated:?}");
    let unlisted: Vec<_> = stated.symmetric_difference(&listed).collect();
    assert!(unlisted.is_empty(), "in one of both only: {unlisted:?}");
}

#[test]
fn the_session_names_only_clauses_that_exist() {
    let protocol = read("PROTOCOL.md");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/session");
    let mut named = BTreeSet::new();
    for file in std::fs::read_dir(folder).unwrap() {
        let text = std::fs::read_to_string(file.unwrap().path()).unwrap();
        let quoted = text.split('"').skip(1).step_by(2);
        named.extend(quoted.filter(|text| is_id(text)).map(String::from));
    }
    let unknown = named
        .iter()
        .find(|id| !protocol.contains(&format!("**{id}**")));
    assert_eq!(unknown, None);
    assert!(named.len() > 25, "{named:?}");
}
