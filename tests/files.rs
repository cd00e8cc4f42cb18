//! The rules about files and functions that a compiler does not keep: no circle of files within a crate, and no
//! function that is too long to read at once.
//!
//! Files are parsed by syn. Code that only tests compile is left out. What a module only passes on (`pub use`) counts as
//! the file where it is defined.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// Longest function in lines, from `fn` to its closing brace.
const LONGEST: usize = 80;

/// The crates' source folders, from the workspace's root.
fn source_folders() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = fs::read_to_string(root.join("Cargo.toml")).expect("the manifest can be read");
    let manifest: toml::Table = manifest.parse().expect("a manifest is TOML");
    let members = manifest["workspace"]["members"].as_array();
    let members = members.expect("a workspace has members").iter();
    let mut folders: Vec<PathBuf> = members
        .map(|member| root.join(member.as_str().expect("a path")).join("src"))
        .collect();
    folders.push(root.join("src"));
    folders
}

/// A path of modules, without `crate`.
type Module = Vec<String>;

/// A file of a crate.
struct File {
    path: PathBuf,
    /// Modules of the crate that its code names, each once.
    named: BTreeSet<Module>,
    /// Names that it passes on, with where they come from.
    passed_on: BTreeMap<String, Module>,
    /// Functions beyond the limit.
    long: Vec<String>,
}

/// A crate, read from its root file.
#[derive(Default)]
struct Crate {
    files: BTreeMap<Module, File>,
}

impl Crate {
    fn read(folder: &Path) -> Self {
        let root = ["lib.rs", "main.rs"].map(|name| folder.join(name));
        let root = root.iter().find(|path| path.exists());
        let mut crate_ = Self::default();
        crate_.add(root.expect("a crate has a root"), &[]);
        crate_
    }

    fn add(&mut self, path: &Path, module: &[String]) {
        let text = fs::read_to_string(path).expect("a module can be read");
        let (file, children) = File::parse(path, &text, module);
        self.files.insert(module.to_vec(), file);
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        let folder = path.parent().expect("a file is in a folder");
        let folder = match stem {
            Some("lib" | "main" | "mod") => folder.to_path_buf(),
            Some(stem) => folder.join(stem),
            None => unreachable!("a source file has a name"),
        };
        for child in children {
            let candidates = [
                folder.join(format!("{child}.rs")),
                folder.join(&child).join("mod.rs"),
            ];
            let found = candidates.iter().find(|path| path.exists());
            let found = found.unwrap_or_else(|| panic!("{child} of {}", path.display()));
            self.add(found, &[module, &[child]].concat());
        }
    }

    /// The module whose file defines what `path` names, if it is one of this crate.
    fn home(&self, path: &[String]) -> Option<Module> {
        let mut path = path.to_vec();
        // A name is passed on a few times at most.
        for _ in 0..8 {
            let known = (0..=path.len()).rev();
            let known = known
                .map(|n| &path[..n])
                .find(|p| self.files.contains_key(*p))?;
            let rest = &path[known.len()..];
            let file = &self.files[known];
            let Some(source) = rest.first().and_then(|name| file.passed_on.get(name)) else {
                return Some(known.to_vec());
            };
            path = [source.as_slice(), &rest[1..]].concat();
        }
        None
    }

    /// Which file names which.
    fn arrows(&self) -> BTreeMap<&Module, BTreeSet<Module>> {
        let files = self.files.iter();
        files
            .map(|(module, file)| {
                let homes = file.named.iter().filter_map(|path| self.home(path));
                (module, homes.filter(|home| home != module).collect())
            })
            .collect()
    }

    /// The files of each circle.
    fn circles(&self) -> Vec<Vec<PathBuf>> {
        let arrows = self.arrows();
        let reached: BTreeMap<&Module, BTreeSet<&Module>> = arrows
            .keys()
            .map(|from| (*from, reachable(&arrows, from)))
            .collect();
        let mut circles: Vec<Vec<PathBuf>> = Vec::new();
        let mut seen = BTreeSet::new();
        for (module, ahead) in &reached {
            if !ahead.contains(module) || seen.contains(module) {
                continue;
            }
            let back = |other: &&&Module| reached[**other].contains(module);
            let members: Vec<_> = ahead.iter().filter(back).copied().collect();
            seen.extend(members.iter().copied());
            circles.push(
                members
                    .iter()
                    .map(|m| self.files[*m].path.clone())
                    .collect(),
            );
        }
        circles
    }
}

fn reachable<'a>(
    arrows: &'a BTreeMap<&Module, BTreeSet<Module>>,
    from: &Module,
) -> BTreeSet<&'a Module> {
    let mut found = BTreeSet::new();
    let mut ahead: Vec<&Module> = arrows[from].iter().collect();
    while let Some(module) = ahead.pop() {
        if found.insert(module) {
            ahead.extend(&arrows[module]);
        }
    }
    found
}

impl File {
    /// Reads a file; with it the modules that it declares in files of their own.
    fn parse(path: &Path, text: &str, module: &[String]) -> (Self, Vec<String>) {
        let parsed = syn::parse_file(text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let declared = parsed.items.iter().filter_map(|item| match item {
            syn::Item::Mod(item) if item.content.is_none() && !for_tests(&item.attrs) => {
                Some(item.ident.to_string())
            }
            _ => None,
        });
        let children: Vec<String> = declared.collect();
        let mut reader = Reader {
            module,
            children: &children,
            file: Self {
                path: path.to_path_buf(),
                named: BTreeSet::new(),
                passed_on: BTreeMap::new(),
                long: Vec::new(),
            },
        };
        reader.visit_file(&parsed);
        let file = reader.file;
        (file, children)
    }
}

/// Whether `#[cfg(test)]` is among the attributes.
fn for_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || attribute.path().is_ident("cfg")
                && attribute
                    .parse_args::<syn::Path>()
                    .is_ok_and(|path| path.is_ident("test"))
    })
}

/// Collects what a file names.
struct Reader<'a> {
    module: &'a [String],
    children: &'a [String],
    file: File,
}

impl Reader<'_> {
    /// A path as one from the crate's root, if it is one of the crate.
    fn absolute(&self, segments: &[String]) -> Option<Module> {
        let first = segments.first()?;
        match first.as_str() {
            "crate" => Some(segments[1..].to_vec()),
            "self" => Some([self.module, &segments[1..]].concat()),
            "super" => {
                let up = segments.iter().take_while(|s| *s == "super").count();
                let base = self.module.len().checked_sub(up)?;
                Some([&self.module[..base], &segments[up..]].concat())
            }
            name if self.children.iter().any(|child| child == name) => {
                Some([self.module, segments].concat())
            }
            _ => None,
        }
    }

    fn name(&mut self, segments: &[String]) {
        self.file.named.extend(self.absolute(segments));
    }

    fn take_use(&mut self, tree: &syn::UseTree, before: &[String], passes_on: bool) {
        match tree {
            syn::UseTree::Path(path) => {
                let ahead = [before, &[path.ident.to_string()]].concat();
                self.take_use(&path.tree, &ahead, passes_on);
            }
            syn::UseTree::Name(name) => {
                let ident = name.ident.to_string();
                self.take_name(&ident.clone(), &ident, before, passes_on);
            }
            syn::UseTree::Rename(name) => {
                self.take_name(
                    &name.rename.to_string(),
                    &name.ident.to_string(),
                    before,
                    passes_on,
                );
            }
            syn::UseTree::Glob(_) => {
                if !passes_on {
                    self.name(before);
                }
            }
            syn::UseTree::Group(group) => {
                for tree in &group.items {
                    self.take_use(tree, before, passes_on);
                }
            }
        }
    }

    fn take_name(&mut self, known_as: &str, name: &str, before: &[String], passes_on: bool) {
        let path = match name {
            "self" => before.to_vec(),
            name => [before, &[name.to_string()]].concat(),
        };
        if passes_on {
            if let Some(path) = self.absolute(&path) {
                self.file.passed_on.insert(known_as.to_string(), path);
            }
        } else {
            self.name(&path);
        }
    }

    fn measure(&mut self, name: &syn::Ident, block: &syn::Block, start: usize) {
        let lines = block.span().end().line + 1 - start;
        if lines > LONGEST {
            let path = self.file.path.display();
            self.file
                .long
                .push(format!("{path}: {name} has {lines} lines"));
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if for_tests(&item.attrs) {
            return;
        }
        let passes_on = !matches!(item.vis, syn::Visibility::Inherited);
        self.take_use(&item.tree, &[], passes_on);
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !for_tests(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        if !for_tests(&item.attrs) {
            self.measure(
                &item.sig.ident,
                &item.block,
                item.sig.fn_token.span.start().line,
            );
            visit::visit_item_fn(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !for_tests(&item.attrs) {
            self.measure(
                &item.sig.ident,
                &item.block,
                item.sig.fn_token.span.start().line,
            );
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        if !for_tests(&item.attrs) {
            visit::visit_item_impl(self, item);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() && path.segments.len() > 1 {
            let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
            self.name(&segments);
        }
        visit::visit_path(self, path);
    }
}

#[test]
fn no_circle_of_files() {
    let root = env!("CARGO_MANIFEST_DIR");
    let mut complaints = Vec::new();
    for folder in source_folders() {
        for circle in Crate::read(&folder).circles() {
            let files: Vec<String> = circle
                .iter()
                .map(|path| {
                    path.strip_prefix(root)
                        .unwrap_or(path)
                        .display()
                        .to_string()
                })
                .collect();
            complaints.push(format!("{} files: {}", files.len(), files.join(" ")));
        }
    }
    assert!(complaints.is_empty(), "circles:\n{}", complaints.join("\n"));
}

#[test]
fn no_function_is_too_long() {
    let crates = source_folders()
        .into_iter()
        .map(|folder| Crate::read(&folder));
    let long: Vec<String> = crates
        .flat_map(|c| c.files.into_values().flat_map(|file| file.long))
        .collect();
    assert!(
        long.is_empty(),
        "beyond {LONGEST} lines:\n{}",
        long.join("\n")
    );
}

mod the_rules_can_fail {
    use super::*;

    /// A crate of these files.
    fn crate_of(files: &[(&str, &str)]) -> (tempfile::TempDir, Crate) {
        let folder = tempfile::tempdir().expect("a directory");
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        }
        let crate_ = Crate::read(folder.path());
        (folder, crate_)
    }

    fn circles(files: &[(&str, &str)]) -> usize {
        crate_of(files).1.circles().len()
    }

    const TWO: (&str, &str) = ("lib.rs", "mod a; mod b;");

    #[test]
    fn two_files_that_name_one_another() {
        let names_b = ("a.rs", "use crate::b::B; pub struct A;");
        assert_eq!(circles(&[TWO, names_b, ("b.rs", "pub struct B;")]), 0);
        for b in [
            "use crate::a::A; pub struct B;",
            "use super::{a::A}; pub struct B;",
            "pub struct B(crate::a::A);",
            "pub struct B; fn make() { let a = super::a::A; }",
        ] {
            assert_eq!(circles(&[TWO, names_b, ("b.rs", b)]), 1, "{b}");
        }
        let tested = "pub struct B; #[cfg(test)] mod tests { use crate::a::A; }";
        assert_eq!(circles(&[TWO, names_b, ("b.rs", tested)]), 0);
    }

    #[test]
    fn a_module_and_its_child() {
        let uses = ("m/mod.rs", "mod child; use child::X; pub struct Y;");
        let passes_on = ("m/mod.rs", "mod child; pub use child::X; pub struct Y;");
        let child = ("m/child.rs", "use super::Y; pub struct X;");
        assert_eq!(circles(&[("lib.rs", "mod m;"), uses, child]), 1);
        assert_eq!(circles(&[("lib.rs", "mod m;"), passes_on, child]), 0);
        // What is passed on belongs to the file that defines it.
        let user = ("n.rs", "use crate::m::X; pub struct N;");
        let child = ("m/child.rs", "use crate::n::N; pub struct X;");
        let root = ("lib.rs", "mod m; mod n;");
        assert_eq!(circles(&[root, passes_on, child, user]), 1);
    }

    #[test]
    fn a_function_of_many_lines() {
        let of = |lines: usize| format!("pub fn long() {{\n{}}}", "    step();\n".repeat(lines));
        let long = |lines| {
            let text = of(lines);
            let (_folder, crate_) = crate_of(&[("lib.rs", &text)]);
            crate_
                .files
                .into_values()
                .map(|file| file.long.len())
                .sum::<usize>()
        };
        assert_eq!(long(LONGEST - 2), 0);
        assert_eq!(long(LONGEST - 1), 1);
    }
}
