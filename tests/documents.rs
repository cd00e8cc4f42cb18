//! What the documents say of the code and can be checked: where each equation is computed, what messages say.

use std::fs;
use std::path::Path;

fn text(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The rows of the tables that name a file and a function, as (equation, file, function).
fn places(page: &str) -> Vec<[String; 3]> {
    let rows = page.lines().filter_map(|line| {
        let cells: Vec<&str> = line.trim().trim_matches('|').split('|').collect();
        let code = |cell: &str| {
            let cell = cell.trim();
            let inner = cell.strip_prefix('`')?.strip_suffix('`')?;
            Some(inner.to_string())
        };
        match cells[..] {
            [equation, _, file, function] => {
                Some([equation.trim().to_string(), code(file)?, code(function)?])
            }
            _ => None,
        }
    });
    rows.collect()
}

/// Rows whose file has no such function.
fn wrong(places: &[[String; 3]], read: impl Fn(&str) -> Option<String>) -> Vec<String> {
    let defines = |text: &str, function: &str| {
        text.contains(&format!("fn {function}(")) || text.contains(&format!("fn {function}<"))
    };
    let found = places
        .iter()
        .filter(|[_, file, function]| !read(file).is_some_and(|text| defines(&text, function)));
    let said =
        found.map(|[equation, file, function]| format!("{equation}: {file} has no {function}"));
    said.collect()
}

#[test]
fn every_equation_is_where_the_page_says() {
    let places = places(&text("docs/equations.md"));
    assert!(places.len() > 25, "only {} rows were read", places.len());
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let wrong = wrong(&places, |file| fs::read_to_string(root.join(file)).ok());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_row_that_names_no_function_of_its_file_is_found() {
    let page = "| equation | what | file | function |\n| --- | --- | --- | --- |\n\
                | (1) | a | `a.rs` | `one` |\n| (2) | b | `a.rs` | `two` |\n| (3) | c | `b.rs` | `one` |";
    let read = |file: &str| (file == "a.rs").then(|| "fn one(x: f64) {}".to_string());
    let wrong = wrong(&places(page), read);
    assert_eq!(wrong, ["(2): a.rs has no two", "(3): b.rs has no one"]);
}

/// What a page quotes of messages: the code of the first column of the table below a heading, cut where a message has
/// words of its own: numbers and names in capitals.
fn quoted(page: &str, heading: &str) -> Vec<String> {
    let (_, below) = page.split_once(heading).expect("the heading");
    let rows = below
        .lines()
        .skip_while(|line| !line.starts_with("| `"))
        .take_while(|line| line.starts_with('|'));
    let told = rows.flat_map(|row| {
        let first = row.split('|').nth(1).unwrap_or_default();
        first.split('`').skip(1).step_by(2)
    });
    let own = |word: &str| {
        let word = word.trim_end_matches(',');
        word == "dem"
            || word
                .chars()
                .all(|c| c.is_ascii_digit() || c.is_ascii_uppercase())
    };
    let mut parts = Vec::new();
    for message in told {
        let words: Vec<&str> = message.split(' ').collect();
        let of_message = words.split(|word| own(word)).map(|words| words.join(" "));
        parts.extend(of_message.filter(|part| part.contains(' ')));
    }
    parts
}

#[test]
fn messages_are_quoted_as_they_are() {
    let quoted = quoted(&text("docs/stopped.md"), "## By what it says");
    assert!(quoted.len() > 12, "{quoted:?}");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sources = String::new();
    let mut folders: Vec<_> = ["src", "coupler/src", "interface/src", "dem-proc/src"]
        .map(|folder| root.join(folder))
        .into();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                sources += &fs::read_to_string(&path).expect("a source");
            }
        }
    }
    // What is put into a message is in braces.
    let placeholders = sources.replace("{SHARED_MEMORY}", "/dev/shm");
    let unknown: Vec<&String> = quoted
        .iter()
        .filter(|part| !placeholders.contains(part.as_str()))
        .collect();
    assert!(unknown.is_empty(), "no source says {unknown:?}");
}

#[test]
fn a_message_is_cut_at_its_own_words() {
    let page = "# A\n| `x y` | b |\n## B\n\n| it says | why |\n| --- | --- |\n\
                | `point N left the domain`, `is 30 s late` | c |\n\nno `table here` |\n";
    assert_eq!(quoted(page, "## B"), ["left the domain", "s late"]);
}

/// Longest line of prose in Markdown.
const COLUMNS: usize = 100;

/// Lines of prose that are too long; code, tables and headings may be.
fn long_lines(page: &str) -> Vec<usize> {
    let mut fenced = false;
    let mut long = Vec::new();
    for (number, line) in (1..).zip(page.lines()) {
        let start = line.trim_start();
        fenced ^= start.starts_with("```");
        let free = fenced || start.starts_with(['|', '#', '<']) || line.starts_with("    ");
        if !free && line.chars().count() > COLUMNS {
            long.push(number);
        }
    }
    long
}

#[test]
fn lines_of_prose_fit() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = std::process::Command::new("git")
        .args(["ls-files", "*.md"])
        .current_dir(root)
        .output()
        .expect("git lists the files");
    let listed = String::from_utf8(listed.stdout).expect("UTF-8 names");
    // The brief is as it was handed over.
    let own = listed
        .lines()
        .filter(|name| !name.starts_with("docs/archive/"));
    let mut wrong = Vec::new();
    let mut pages = 0;
    for name in own {
        pages += 1;
        let lines = long_lines(&text(name));
        wrong.extend(lines.into_iter().map(|line| format!("{name}:{line}")));
    }
    assert!(pages > 20, "only {pages} pages were found");
    assert!(
        wrong.is_empty(),
        "beyond {COLUMNS} columns:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn a_long_line_of_prose_is_found_and_code_is_not() {
    let long = "word ".repeat(30);
    let page = format!("{long}\n\n    {long}\n\n```\n{long}\n```\n| {long} |\n- {long}\n");
    assert_eq!(long_lines(&page), [1, 9]);
}
