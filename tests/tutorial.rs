//! The tutorial, followed word by word; the scene of the front page; what `tandem new` writes; the schema that editors check scenes by.

use std::fs;

use crate::harness::{Place, has, root};

/// What a fenced block of a page asks for.
#[derive(Debug, PartialEq)]
enum Block {
    /// Text to add to the scene.
    Scene(String),
    /// Commands, and the exit status that each has.
    Commands(Vec<String>, i32),
    /// Lines, parts of which the last commands have printed, in this order.
    Output(Vec<String>),
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(kind) = line.strip_prefix("```") else {
            continue;
        };
        let inside: Vec<String> = lines
            .by_ref()
            .take_while(|line| *line != "```")
            .map(str::to_owned)
            .collect();
        blocks.push(match kind.split_once(' ').unwrap_or((kind, "")) {
            ("toml", "") => Block::Scene(inside.join("\n") + "\n\n"),
            ("sh", "") => Block::Commands(inside, 0),
            ("sh", more) => {
                let status = more.strip_prefix("status=").and_then(|n| n.parse().ok());
                Block::Commands(inside, status.expect("`sh status=N`"))
            }
            ("text", "") => Block::Output(inside),
            other => panic!("nobody knows what to do with {other:?}"),
        });
    }
    blocks
}

#[test]
fn the_tutorial_works_as_it_stands() {
    let place = Place::new();
    let page = fs::read_to_string(root().join("docs/tutorial.md")).unwrap();
    let directory = place.path(".");
    let (mut scene, mut output, mut commands) = (String::new(), String::new(), 0);
    for block in blocks(&page) {
        match block {
            Block::Scene(more) => {
                scene += &more;
                fs::write(directory.join("first.toml"), &scene).unwrap();
            }
            Block::Commands(lines, status) => {
                output.clear();
                for line in lines {
                    let words = line
                        .strip_prefix("tandem ")
                        .expect("a command of the program");
                    let ended = place.tandem(words).expect(status);
                    output += &ended.stdout;
                    output += &ended.stderr;
                    commands += 1;
                }
            }
            Block::Output(lines) => {
                let mut rest = output.as_str();
                for line in lines {
                    let line = line.trim();
                    let found = rest.find(line);
                    let at = found.unwrap_or_else(|| panic!("`{line}` is not in: {output}"));
                    rest = &rest[at + line.len()..];
                }
            }
        }
    }
    assert!(commands >= 8, "{commands} commands");
    for made in [
        "height.svg",
        "motion.png",
        "checked/report.html",
        "cells/study.svg",
    ] {
        assert!(directory.join(made).is_file(), "{made}");
    }
}

#[test]
fn the_scene_of_the_front_page_runs_and_the_page_is_short() {
    let place = Place::new();
    let page = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(page.lines().count() <= 120, "{}", page.lines().count());
    let scene = page.split("```toml\n").nth(1).unwrap();
    let scene = scene.split("```").next().unwrap();
    assert!(scene.lines().count() <= 15, "{scene}");
    let directory = place.path(".");
    fs::write(directory.join("ball.toml"), scene).unwrap();
    place.tandem("run ball.toml --in-process").expect(0);
    assert!(directory.join("runs/ball/report.html").is_file());
}

#[test]
fn a_new_scene_runs_and_nothing_that_is_there_is_lost() {
    let place = Place::new();
    let directory = place.path(".");
    let ended = place.tandem("new scene fall").expect(0);
    has(&ended.stdout, "`tandem run fall.toml` runs it");
    assert!(directory.join("scene.schema.json").is_file());
    for variant in ["", "--variant quick"] {
        place.run("out", "fall.toml", variant).expect(0);
        assert!(directory.join("out/report.html").is_file());
    }
    fs::write(directory.join("mine.toml"), "mine").unwrap();
    for name in ["mine", "../up", "''"] {
        place.tandem(&format!("new scene {name}")).expect(2);
    }
    assert_eq!(fs::read(directory.join("mine.toml")).unwrap(), b"mine");
}

/// `UPDATE_SCHEMA=1` writes them.
#[test]
fn the_schemas_in_the_tree_are_those_of_the_program() {
    let place = Place::new();
    for (of, file) in [
        ("scene", "scenes/scene.schema.json"),
        ("mpm", "interface/schema/mpm.json"),
        ("dem", "interface/schema/dem.json"),
    ] {
        let schema = place.tandem(&format!("schema {of}")).expect(0).stdout;
        let path = root().join(file);
        if std::env::var_os("UPDATE_SCHEMA").is_some() {
            fs::write(&path, &schema).unwrap();
        }
        let there = fs::read_to_string(&path).unwrap_or_default();
        let help =
            "UPDATE_SCHEMA=1 cargo test --release --workspace --test tandem-tests tutorial::";
        assert!(there == schema, "{file} is old: {help}");
    }
}
