//! The pages: each is in the summary, each link leads to a file and a heading, each equation is where its table says, each value
//! of a check is that of the table of checks.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

use crate::harness::needs::Need;
use crate::harness::root;

const SUMMARY: &str = "docs/SUMMARY.md";

/// All files of the repository, from its root; new ones too, and not what git ignores.
fn listed() -> BTreeSet<String> {
    let arguments = ["ls-files", "--cached", "--others", "--exclude-standard"];
    let listed = Command::new("git")
        .args(arguments)
        .current_dir(root())
        .output()
        .unwrap();
    let listed = String::from_utf8(listed.stdout).expect("UTF-8 names");
    let there = listed.lines().filter(|name| root().join(name).is_file());
    there.map(str::to_owned).collect()
}

fn text(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Where the links and pictures of a page lead, as written, and what a link can name after `#`: a heading in small letters
/// with a hyphen for each space, and a number if the page has that name already.
fn links_and_anchors(page: &str) -> (Vec<String>, BTreeSet<String>) {
    let (mut links, mut anchors, mut heading) = (Vec::new(), BTreeSet::new(), None);
    for event in Parser::new_ext(page, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                links.push(dest_url.into_string());
            }
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::Text(text) | Event::Code(text) => {
                if let Some(words) = &mut heading {
                    *words += &text;
                }
            }
            Event::End(TagEnd::Heading(_)) => {
                let words = heading.take().unwrap_or_default().to_lowercase();
                let kept = |c: &char| c.is_alphanumeric() || "-_ ".contains(*c);
                let name = words.chars().filter(kept).collect::<String>();
                let name = name.replace(' ', "-");
                let mut given =
                    std::iter::once(name.clone()).chain((1..).map(|k| format!("{name}-{k}")));
                anchors.extend(given.find(|name| !anchors.contains(name)));
            }
            _ => {}
        }
    }
    (links, anchors)
}

/// Where a link of a page leads: a path from the root, and what is after `#`. `None` for what is elsewhere.
fn target(from: &str, link: &str) -> Option<(String, Option<String>)> {
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
    let mut parts: Vec<&str> = from.split('/').collect();
    if !path.is_empty() {
        parts.pop();
    }
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." if parts.pop().is_some() => {}
            part => parts.push(part),
        }
    }
    Some((
        parts.join("/"),
        (!anchor.is_empty()).then(|| anchor.to_owned()),
    ))
}

#[test]
fn every_link_leads_to_a_file_and_a_heading_and_every_page_is_in_the_summary_once() {
    let files = listed();
    let is_page = |name: &&String| Path::new(name).extension().is_some_and(|e| e == "md");
    let pages = files.iter().filter(is_page);
    let pages: BTreeMap<&str, String> = pages.map(|name| (name.as_str(), text(name))).collect();
    let read = |page: &String| links_and_anchors(page);
    let pages: BTreeMap<&str, _> = pages
        .iter()
        .map(|(name, page)| (*name, read(page)))
        .collect();
    let (mut wrong, mut count) = (Vec::new(), 0);
    let mut unlisted: BTreeSet<&str> = pages
        .keys()
        .copied()
        .filter(|name| *name != SUMMARY)
        .collect();
    for (name, (links, _)) in &pages {
        for link in links {
            count += 1;
            let Some((path, anchor)) = target(name, link) else {
                continue;
            };
            let there = match (pages.get(path.as_str()), anchor) {
                (Some((_, anchors)), Some(anchor)) => anchors.contains(&anchor),
                _ => files.contains(&path),
            };
            if !there || *name == SUMMARY && !unlisted.remove(path.as_str()) {
                wrong.push(format!("{name}: {link}"));
            }
        }
    }
    assert!(count > 500, "only {count} links were read");
    assert!(
        wrong.is_empty(),
        "these lead nowhere, or twice to a page:\n{}",
        wrong.join("\n")
    );
    assert!(unlisted.is_empty(), "{SUMMARY} lacks {unlisted:?}");
}

/// The rows that name a file and a function.
#[test]
fn every_equation_is_where_its_table_says() {
    let page = text("docs/equations.md");
    let (mut wrong, mut count) = (Vec::new(), 0);
    for row in page.lines().filter(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let code = |cell: &str| Some(cell.strip_prefix('`')?.strip_suffix('`')?.to_owned());
        let Some((file, function)) = cells
            .get(2)
            .and_then(|file| code(file))
            .zip(cells.get(3).and_then(|name| code(name)))
        else {
            continue;
        };
        count += 1;
        let source = fs::read_to_string(root().join(&file)).unwrap_or_default();
        if !["(", "<"]
            .iter()
            .any(|after| source.contains(&format!("fn {function}{after}")))
        {
            wrong.push(format!("{}: {file} has no {function}", cells[0]));
        }
    }
    assert!(count > 25, "only {count} rows were read");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The words of code in a page: of blocks in Python and Rust but for comments and texts, and between backticks.
fn code_words(page: &str) -> BTreeSet<String> {
    let (mut words, mut block) = (BTreeSet::new(), None);
    let mut add = |code: &str| {
        let names =
            words_of(code).filter(|word| word.len() > 2 && !word.starts_with(char::is_numeric));
        words.extend(names.map(str::to_owned));
    };
    for event in Parser::new_ext(page, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::CodeBlock(kind)) => block = Some(kind),
            Event::End(TagEnd::CodeBlock) => block = None,
            Event::Code(code) => add(&code),
            Event::Text(code) => {
                if let Some(CodeBlockKind::Fenced(language)) = &block
                    && matches!(&**language, "python" | "rust")
                {
                    let lines = code.lines().map(|line| line.split(['#', '"']).next());
                    lines.flatten().for_each(&mut add);
                }
            }
            _ => {}
        }
    }
    words
}

fn words_of(code: &str) -> impl Iterator<Item = &str> {
    code.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}

/// The words that code in the tree consists of.
fn known_words() -> BTreeSet<String> {
    let rooms = [
        "interface/src/",
        "interface/mechanics/",
        "python/",
        "src/",
        "examples/",
        "scenes/",
    ];
    let of_code = |name: &String| {
        let extension = Path::new(name).extension().and_then(|e| e.to_str());
        let is_code = matches!(extension, Some("rs" | "py" | "toml"));
        is_code && rooms.iter().any(|room| name.starts_with(room))
    };
    let mut words = BTreeSet::new();
    for name in listed() {
        if of_code(&name) {
            words.extend(words_of(&text(&name)).map(str::to_owned));
        }
        // Names of files and folders are words too.
        words.extend(words_of(&name).map(str::to_owned));
    }
    words
}

/// `ContactForces` stood there, which has been in no language here.
#[test]
fn every_name_in_the_guide_for_authors_exists() {
    let known = known_words();
    let strange =
        |page: &str| -> Vec<String> { code_words(page).difference(&known).cloned().collect() };
    assert_eq!(
        strange("The bodies are an argument (`ContactForces`)."),
        ["ContactForces"]
    );
    assert_eq!(
        strange("```rust\nsolver.advence(&step) # advunce\n```"),
        ["advence"]
    );
    let guide = text("docs/solver-authors.md");
    assert!(code_words(&guide).len() > 100);
    assert_eq!(strange(&guide), Vec::<String>::new());
}

/// `docs/results/values.py --check` of a copy whose table has another value, too.
#[test]
fn values_on_the_pages_are_those_of_the_table_of_checks() {
    let there = Command::new("python3").arg("--version").output().is_ok();
    if !Need::Python.is_met(there, "there is no python3") {
        return;
    }
    let check = |root: &Path| {
        let script = root.join("docs/results/values.py");
        let checked = Command::new("python3").arg(script).arg("--check").output();
        let checked = checked.unwrap();
        let printed = [checked.stdout, checked.stderr].concat();
        (
            checked.status.success(),
            String::from_utf8(printed).unwrap(),
        )
    };
    assert_eq!(check(root()), (true, String::new()));

    let copy = tempfile::tempdir().unwrap();
    let results = copy.path().join("docs/results");
    fs::create_dir_all(results.join("tables")).unwrap();
    let copied = [
        "docs/results/values.py",
        "docs/results/tables/variations.csv",
        "README.md",
    ];
    for name in copied {
        fs::copy(root().join(name), copy.path().join(name)).unwrap();
    }
    let table = text("docs/results/tables/checks.csv");
    let other = table.replace("peak force,4.91584", "peak force,4.95");
    assert_ne!(other, table);
    fs::write(results.join("tables/checks.csv"), other).unwrap();
    let (holds, printed) = check(copy.path());
    assert!(!holds && printed.contains("README.md"), "{printed}");
}
