//! The pages as a book, and where their links lead, on a git host and in the book.
//!
//! The book is left in `target/book`. Its layout is that of the repository, so that a link between two pages is the same
//! in both; what else a page links to (scenes, pictures, scripts) lies in it as a copy.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex};

use mdbook_driver::MDBook;
use mdbook_driver::config::Config;
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use tracing_subscriber::fmt::MakeWriter;

const SUMMARY: &str = "docs/SUMMARY.md";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All files of the repository, from its root; new ones too, and not what git ignores.
fn listed() -> BTreeSet<String> {
    let listed = Command::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard"])
        .current_dir(root())
        .output()
        .expect("git lists the files");
    let listed = String::from_utf8(listed.stdout).expect("UTF-8 names");
    let there = listed.lines().filter(|name| root().join(name).is_file());
    there.map(str::to_owned).collect()
}

/// A page as a git host reads it.
#[derive(Debug, Default, PartialEq)]
struct Page {
    /// Where its links and pictures lead, as written.
    links: Vec<String>,
    /// What a link can name after `#`.
    anchors: BTreeSet<String>,
}

impl Page {
    fn of(text: &str) -> Self {
        let options = Options::ENABLE_TABLES | Options::ENABLE_STRIKETHROUGH;
        let mut page = Self::default();
        let mut heading: Option<String> = None;
        for event in Parser::new_ext(text, options) {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.links.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => {
                    let words = heading.take().unwrap_or_default();
                    page.add_anchor(&words);
                }
                Event::Text(text) | Event::Code(text) => {
                    if let Some(words) = &mut heading {
                        words.push_str(&text);
                    }
                }
                _ => {}
            }
        }
        page
    }

    /// The name that a heading gets: small letters, a hyphen for each space, a number where it is there already.
    fn add_anchor(&mut self, heading: &str) {
        let letters = heading.trim().to_lowercase();
        let letters = letters.chars().filter_map(|c| match c {
            ' ' => Some('-'),
            c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
            _ => None,
        });
        let name: String = letters.collect();
        let mut given = name.clone();
        let mut times = 0;
        while !self.anchors.insert(given) {
            times += 1;
            given = format!("{name}-{times}");
        }
    }
}

/// Where a link of a file leads: a path from the root (the file itself for `#...`), and what is after `#`.
/// `None` for what is elsewhere.
fn target(from: &str, link: &str) -> Option<(String, Option<String>)> {
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (path, anchor) = match link.split_once('#') {
        Some((path, anchor)) => (path, Some(anchor.to_owned())),
        None => (link, None),
    };
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

/// Links that lead nowhere, of files whose anchors are known where they are pages. A link to a folder is one: a book has no
/// list of a folder's files.
fn dead(pages: &BTreeMap<String, Page>, files: &BTreeSet<String>) -> Vec<String> {
    let mut dead = Vec::new();
    for (name, page) in pages {
        for link in &page.links {
            let Some((path, anchor)) = target(name, link) else {
                continue;
            };
            let there = match (pages.get(&path), anchor) {
                (Some(page), Some(anchor)) => page.anchors.contains(&anchor),
                _ => files.contains(&path),
            };
            if !there {
                dead.push(format!("{name}: {link}"));
            }
        }
    }
    dead
}

fn is_page(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|e| e == "md")
}

fn pages(files: &BTreeSet<String>) -> BTreeMap<String, Page> {
    let names = files.iter().filter(|name| is_page(name));
    let read = names.map(|name| {
        let text = fs::read_to_string(root().join(name)).expect("a page");
        (name.clone(), Page::of(&text))
    });
    read.collect()
}

#[test]
fn every_link_of_a_page_leads_to_a_file_and_a_heading() {
    let files = listed();
    let pages = pages(&files);
    assert!(pages.len() > 50, "only {} pages were found", pages.len());
    let dead = dead(&pages, &files);
    assert!(dead.is_empty(), "these lead nowhere:\n{}", dead.join("\n"));
}

#[test]
fn a_link_that_leads_nowhere_is_found() {
    let page = Page::of(
        "# The `first` page: a_b\n## Twice\n## Twice\n[good](b/c.md#twice-1) ![](b/p.png) [out](https://a.b/c)\n\
         [self](#the-first-page-a_b) [no heading](b/c.md#thrice) [no file](../c.md) [folder](b/)\n\n    [code](x.md)\n",
    );
    assert_eq!(page.links.len(), 7);
    let headings = ["the-first-page-a_b", "twice", "twice-1"];
    assert_eq!(page.anchors, headings.map(String::from).into());
    let other = Page::of("# Twice\n# Twice\n[back](../a.md#twice)");
    let pages = BTreeMap::from([("a.md".to_owned(), page), ("b/c.md".to_owned(), other)]);
    let files = BTreeSet::from(["a.md", "b/c.md", "b/p.png"].map(String::from));
    assert_eq!(
        dead(&pages, &files),
        ["a.md: b/c.md#thrice", "a.md: ../c.md", "a.md: b/"]
    );
}

#[test]
fn every_page_is_in_the_book_once() {
    let files = listed();
    let summary = Page::of(&fs::read_to_string(root().join(SUMMARY)).expect("the summary"));
    let mut missing: BTreeSet<&str> = files.iter().map(String::as_str).collect();
    missing.retain(|name| is_page(name) && *name != SUMMARY);
    for link in &summary.links {
        let (path, _) = target(SUMMARY, link).expect("a page of the repository");
        assert!(
            missing.remove(path.as_str()),
            "{path} is there twice, or is no page"
        );
    }
    assert!(missing.is_empty(), "{SUMMARY} lacks {missing:?}");
}

/// Keeps what is logged.
#[derive(Clone, Default)]
struct Heard(Arc<Mutex<Vec<u8>>>);

impl io::Write for Heard {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("one thread").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl MakeWriter<'_> for Heard {
    type Writer = Self;

    fn make_writer(&self) -> Self {
        self.clone()
    }
}

impl Heard {
    /// Runs something, and tells what was said as a warning or an error meanwhile.
    fn warnings_of(made: impl FnOnce() -> mdbook_driver::errors::Result<()>) -> String {
        let heard = Self::default();
        let log = tracing_subscriber::fmt()
            .with_max_level(tracing::Level::WARN)
            .with_writer(heard.clone())
            .with_ansi(false)
            .finish();
        let ended = tracing::subscriber::with_default(log, made);
        let mut said =
            String::from_utf8(heard.0.lock().expect("one thread").clone()).expect("text");
        if let Err(error) = ended {
            said.push_str(&error.to_string());
        }
        said
    }
}

/// A folder with the pages and what they link to, as they lie in the repository.
fn laid_out(pages: &BTreeMap<String, Page>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let mut names: BTreeSet<String> = pages.keys().cloned().collect();
    for (name, page) in pages {
        let linked = page.links.iter().filter_map(|link| target(name, link));
        names.extend(linked.map(|(path, _)| path));
    }
    names.remove(SUMMARY);
    for name in names {
        let copy = folder.path().join(&name);
        fs::create_dir_all(copy.parent().expect("a folder")).expect("a folder");
        fs::copy(root().join(&name), copy).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    // The summary names pages from its own folder, a book from its root.
    let mut summary = fs::read_to_string(root().join(SUMMARY)).expect("the summary");
    for link in &pages[SUMMARY].links {
        let (path, _) = target(SUMMARY, link).expect("a page of the repository");
        summary = summary.replace(&format!("]({link})"), &format!("](<{path}>)"));
    }
    fs::write(folder.path().join("SUMMARY.md"), summary).expect("the summary");
    folder
}

/// Makes the book out of such a folder, and tells what mdbook had to say.
fn make(folder: &Path, book: &Path) -> String {
    Heard::warnings_of(|| {
        let mut config = Config::from_disk(root().join("docs/book.toml"))?;
        config.book.src = PathBuf::new();
        book.clone_into(&mut config.build.build_dir);
        MDBook::load_with_config(folder, config)?.build()
    })
}

/// Every file below a folder, from there.
fn files_below(folder: &Path) -> BTreeSet<String> {
    let (mut found, mut folders) = (BTreeSet::new(), vec![folder.to_owned()]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("it is below");
                found.insert(name.to_str().expect("UTF-8").to_owned());
            }
        }
    }
    found
}

/// The values of an attribute in a page of the book.
fn attributes<'a>(html: &'a str, name: &str) -> impl Iterator<Item = &'a str> {
    let begin = format!(" {name}=\"");
    let parts: Vec<&str> = html.split(&begin).skip(1).collect();
    parts.into_iter().filter_map(|rest| rest.split('"').next())
}

/// A page of the book as a browser reads it.
fn browsed(html: &str) -> Page {
    let links = attributes(html, "href").chain(attributes(html, "src"));
    Page {
        links: links.map(str::to_owned).collect(),
        anchors: attributes(html, "id").map(str::to_owned).collect(),
    }
}

#[test]
fn mdbook_makes_the_book_without_a_warning_and_its_links_lead_somewhere() {
    let pages = pages(&listed());
    let folder = laid_out(&pages);
    let book = root().join("target/book");
    let said = make(folder.path(), &book);
    assert!(said.is_empty(), "{said}");
    let files = files_below(&book);
    let html = files.iter().filter(|name| {
        let extension = Path::new(name).extension();
        extension.is_some_and(|e| e == "html")
    });
    let html: BTreeMap<String, Page> = html
        .map(|name| {
            let text = fs::read_to_string(book.join(name)).expect("a page of the book");
            (name.clone(), browsed(&text))
        })
        .collect();
    // Every page but the summary is there under its name, and links to the others.
    for name in pages.keys().filter(|name| *name != SUMMARY) {
        let name = Path::new(name).with_extension("html");
        let made = html.get(name.to_str().expect("UTF-8"));
        assert!(
            made.is_some_and(|page| page.links.len() > 5),
            "{}",
            name.display()
        );
    }
    let dead = dead(&html, &files);
    assert!(
        dead.is_empty(),
        "these lead nowhere in the book:\n{}",
        dead.join("\n")
    );
}

#[test]
fn what_mdbook_warns_of_is_heard() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    fs::write(path.join("SUMMARY.md"), "- [A](a.md)\n").expect("a page");
    fs::write(path.join("a.md"), "# A\n\na <b>bold word\n").expect("a page");
    let said = make(path, &path.join("book"));
    assert!(said.contains("WARN") && said.contains("a.md"), "{said:?}");
    fs::remove_file(path.join("a.md")).expect("a page");
    assert!(make(path, &path.join("book")).contains("a.md"));
}
