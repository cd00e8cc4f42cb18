//! The pages: each is in the summary, each link leads to a file and a heading, each equation is where its table says.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path};
use std::process::Command;

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

/// The lines of a page without code: what is between fences, indented, or between backticks.
fn prose(page: &str) -> impl Iterator<Item = String> {
    let mut fenced = false;
    page.lines().filter_map(move |line| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        let code = fenced || fence || line.starts_with("    ") && !line.contains("](");
        (!code).then(|| line.split('`').step_by(2).collect::<Vec<_>>().join("`"))
    })
}

/// Where the links and pictures of a page lead, as written.
fn links(page: &str) -> Vec<String> {
    let text: Vec<String> = prose(page).collect();
    let text = text.join("\n");
    let links = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'));
    links.map(|(link, _)| link.to_owned()).collect()
}

/// What a link can name after `#`: a heading in small letters, a hyphen for each space, a number where it is there already.
fn anchors(page: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    let mut fenced = false;
    for line in page.lines() {
        fenced ^= line.trim_start().starts_with("```");
        let heading = line.trim_start_matches('#');
        if fenced || !line.starts_with('#') || !heading.starts_with(' ') {
            continue;
        }
        let letters = heading.trim().to_lowercase().replace(' ', "-");
        let name: String = letters
            .chars()
            .filter(|c| c.is_alphanumeric() || "-_".contains(*c))
            .collect();
        let mut given = (0..).map(|k| match k {
            0 => name.clone(),
            k => format!("{name}-{k}"),
        });
        let new = given.find(|name| !anchors.contains(name));
        anchors.extend(new);
    }
    anchors
}

/// Where a link of a page leads: a path from the root, and what is after `#`. `None` for what is elsewhere.
fn target(from: &str, link: &str) -> Option<(String, Option<String>)> {
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (path, anchor) = link.split_once('#').map_or((link, None), |(path, anchor)| {
        (path, Some(anchor.to_owned()))
    });
    if path.is_empty() {
        return Some((from.to_owned(), anchor));
    }
    let mut parts: Vec<&str> = from.split('/').collect();
    parts.pop();
    for component in Path::new(path).components() {
        match component {
            Component::ParentDir if parts.pop().is_none() => parts.push(".."),
            Component::Normal(name) => parts.push(name.to_str()?),
            _ => {}
        }
    }
    Some((parts.join("/"), anchor))
}

#[test]
fn every_link_leads_to_a_file_and_a_heading_and_every_page_is_in_the_summary_once() {
    let files = listed();
    let is_page = |name: &&String| Path::new(name).extension().is_some_and(|e| e == "md");
    let pages = files.iter().filter(is_page);
    let pages: BTreeMap<&str, String> = pages.map(|name| (name.as_str(), text(name))).collect();
    let (mut wrong, mut count) = (Vec::new(), 0);
    let mut unlisted: BTreeSet<&str> = pages
        .keys()
        .copied()
        .filter(|name| *name != SUMMARY)
        .collect();
    for (name, page) in &pages {
        for link in links(page) {
            count += 1;
            let Some((path, anchor)) = target(name, &link) else {
                continue;
            };
            let there = match (pages.get(path.as_str()), anchor) {
                (Some(page), Some(anchor)) => anchors(page).contains(&anchor),
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

/// The words of code in a page: of code blocks, and between backticks, but for comments and commands of a shell.
fn code_words(page: &str) -> BTreeSet<String> {
    let (mut words, mut block) = (BTreeSet::new(), None);
    let mut add = |code: &str| {
        let parts = code.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let names =
            parts.filter(|part| part.len() > 2 && !part.starts_with(|c: char| c.is_ascii_digit()));
        words.extend(names.map(str::to_owned));
    };
    for line in page.lines() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            block = block.is_none().then(|| language.to_owned());
        } else {
            match block.as_deref() {
                Some("python" | "rust") => add(line.split(['#', '"']).next().unwrap_or_default()),
                Some(_) => {}
                None => line.split('`').skip(1).step_by(2).for_each(&mut add),
            }
        }
    }
    words
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
            let text = text(&name);
            let parts = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            words.extend(parts.map(str::to_owned));
        }
        // Names of files and folders are words too.
        let parts = name.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        words.extend(parts.map(str::to_owned));
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
