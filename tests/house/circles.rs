//! Circles between the files of a crate: each uses what the next one defines.
//!
//! Files are those that `mod` lines lead to from the root of a crate, without tests. A path counts for the file that *defines*
//! what it names: re-exports, also those of a parent for its children, are followed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{Visit, visit_path};
use syn::{Attribute, Item, UseTree};

/// Imports that are followed for one name, at most.
const MAX_IMPORTS: usize = 12;

/// A module of a crate: what it defines, what names in it stand for, and what it uses.
#[derive(Default)]
struct Module {
    /// Number of its file.
    file: usize,
    items: BTreeSet<String>,
    children: BTreeMap<String, usize>,
    imports: BTreeMap<String, Vec<String>>,
    /// Modules whose names all are imported.
    globs: Vec<Vec<String>>,
    parent: Option<usize>,
    paths: Vec<Vec<String>>,
}

/// The modules of a crate, its root first, and its files.
#[derive(Default)]
struct Crate {
    modules: Vec<Module>,
    files: Vec<PathBuf>,
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| {
        a.path().is_ident("cfg") && a.parse_args::<syn::Path>().is_ok_and(|p| p.is_ident("test"))
    })
}

impl Crate {
    fn read(root: &Path) -> Self {
        let mut made = Self::default();
        made.file(root.to_path_buf(), root.parent().unwrap().to_path_buf(), None);
        made
    }

    /// Reads a file, whose submodules are in `folder`; the number of its module.
    fn file(&mut self, path: PathBuf, folder: PathBuf, parent: Option<usize>) -> usize {
        let text = fs::read_to_string(&path).unwrap();
        let syntax = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        self.files.push(path);
        self.module(syntax.items, &folder, (self.files.len() - 1, parent))
    }

    fn module(
        &mut self,
        items: Vec<Item>,
        folder: &Path,
        (file, parent): (usize, Option<usize>),
    ) -> usize {
        let this = self.modules.len();
        self.modules.push(Module { file, parent, ..Module::default() });
        for item in items {
            match item {
                Item::Mod(item) if is_test(&item.attrs) => {}
                Item::Mod(item) => {
                    let name = item.ident.to_string();
                    let within = folder.join(&name);
                    let child = match item.content {
                        Some((_, items)) => self.module(items, &within, (file, Some(this))),
                        None => {
                            let flat = within.with_extension("rs");
                            let path = if flat.is_file() { flat } else { within.join("mod.rs") };
                            self.file(path, within, Some(this))
                        }
                    };
                    self.modules[this].children.insert(name, child);
                }
                Item::Use(item) => {
                    // A re-export alone does not count; where the file names what it re-exports, that does.
                    let used = matches!(item.vis, syn::Visibility::Inherited);
                    self.modules[this].import(&item.tree, &mut Vec::new(), used);
                }
                item => self.modules[this].define(&item),
            }
        }
        this
    }

    /// The module that `path` begins at, seen from `module`, and the names from there on; none outside of the crate.
    fn start<'p>(&self, module: usize, path: &'p [String]) -> Option<(usize, &'p [String])> {
        match path.first()?.as_str() {
            "crate" => Some((0, &path[1..])),
            "self" => Some((module, &path[1..])),
            "super" => {
                let mut at = self.modules[module].parent?;
                let mut rest = &path[1..];
                while rest.first().is_some_and(|name| name == "super") {
                    (at, rest) = (self.modules[at].parent?, &rest[1..]);
                }
                Some((at, rest))
            }
            _ => Some((module, path)),
        }
    }

    /// The file that defines what `path` names, seen from `module`; none for a module, and for other crates.
    fn defined(&self, module: usize, path: &[String], imports: usize) -> Option<usize> {
        let (mut at, mut rest) = self.start(module, path)?;
        loop {
            let (name, further) = rest.split_first()?;
            let here = &self.modules[at];
            if let Some(child) = here.children.get(name) {
                (at, rest) = (*child, further);
                continue;
            }
            if here.items.contains(name) {
                return Some(here.file);
            }
            let imports = imports.checked_sub(1)?;
            if let Some(stands_for) = here.imports.get(name) {
                // A name that stands for one of another crate is looked up no further.
                let whole = [stands_for, further].concat();
                return if whole == rest { None } else { self.defined(at, &whole, imports) };
            }
            return here
                .globs
                .iter()
                .find_map(|glob| self.defined(at, &[glob.as_slice(), rest].concat(), imports));
        }
    }

    /// The files that each file uses, with the paths by which it does.
    fn uses(&self) -> Vec<BTreeMap<usize, BTreeSet<String>>> {
        let mut all = vec![BTreeMap::<_, BTreeSet<_>>::new(); self.files.len()];
        for (number, module) in self.modules.iter().enumerate() {
            for path in &module.paths {
                let to = self.defined(number, path, MAX_IMPORTS);
                for to in to.into_iter().filter(|to| *to != module.file) {
                    all[module.file].entry(to).or_default().insert(path.join("::"));
                }
            }
        }
        all
    }
}

impl Module {
    fn import(&mut self, tree: &UseTree, before: &mut Vec<String>, used: bool) {
        let mut add = |name: String, before: &[String], last: String| {
            // `self` is the module before it.
            let path = if last == "self" { before.to_vec() } else { [before, &[last]].concat() };
            let name = if name == "self" { path.last().cloned().unwrap_or_default() } else { name };
            self.paths.extend(used.then(|| path.clone()));
            self.imports.insert(name, path);
        };
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.import(&path.tree, before, used);
                before.pop();
            }
            UseTree::Group(group) => group.items.iter().for_each(|t| self.import(t, before, used)),
            UseTree::Name(name) => add(name.ident.to_string(), before, name.ident.to_string()),
            UseTree::Rename(to) => add(to.rename.to_string(), before, to.ident.to_string()),
            UseTree::Glob(_) => self.globs.push(before.clone()),
        }
    }

    fn define(&mut self, item: &Item) {
        let name = match item {
            Item::Const(item) => Some(&item.ident),
            Item::Enum(item) => Some(&item.ident),
            Item::Fn(item) => Some(&item.sig.ident),
            Item::Macro(item) => item.ident.as_ref(),
            Item::Static(item) => Some(&item.ident),
            Item::Struct(item) => Some(&item.ident),
            Item::Trait(item) => Some(&item.ident),
            Item::Type(item) => Some(&item.ident),
            Item::Union(item) => Some(&item.ident),
            _ => None,
        };
        self.items.extend(name.map(ToString::to_string));
        self.visit_item(item);
    }

    /// The paths in the text of a macro.
    fn text(&mut self, text: &str) {
        let text = text.replace(" :: ", "::");
        let paths = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
        let segments = |path: &str| path.split("::").map(str::to_owned).collect::<Vec<_>>();
        self.paths.extend(paths.map(segments).filter(|path| path.len() > 1));
    }
}

impl<'ast> Visit<'ast> for Module {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.push(path.segments.iter().map(|s| s.ident.to_string()).collect());
        visit_path(self, path);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        // In a function: the names are its own.
        let mut within = Self::default();
        within.import(&item.tree, &mut Vec::new(), true);
        self.paths.append(&mut within.paths);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.visit_path(&item.path);
        self.text(&item.tokens.to_string());
    }
}

/// For every file the files that it reaches.
fn reached(uses: &[BTreeMap<usize, BTreeSet<String>>]) -> Vec<BTreeSet<usize>> {
    let from = |file: usize| {
        let mut seen = BTreeSet::new();
        let mut ahead: Vec<usize> = uses[file].keys().copied().collect();
        while let Some(next) = ahead.pop() {
            if seen.insert(next) {
                ahead.extend(uses[next].keys());
            }
        }
        seen
    };
    (0..uses.len()).map(from).collect()
}

/// The circles of the crate with this root, as text.
fn circles(root: &Path) -> Vec<String> {
    let made = Crate::read(root);
    let uses = made.uses();
    let reached = reached(&uses);
    let mut found = Vec::new();
    for first in 0..uses.len() {
        let circle: BTreeSet<usize> =
            reached[first].iter().copied().filter(|f| reached[*f].contains(&first)).collect();
        if circle.first() != Some(&first) {
            continue;
        }
        let mut text = format!("\ncircle of {} files", circle.len());
        for from in &circle {
            for (to, paths) in uses[*from].iter().filter(|(to, _)| circle.contains(to)) {
                let [from, to] = [from, to].map(|f| made.files[*f].display());
                let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
                text += &format!("\n  {from} -> {to}: {}", paths.join(", "));
            }
        }
        found.push(text);
    }
    found
}

/// The roots of all crates of the project.
fn roots() -> Vec<PathBuf> {
    let project = crate::common::root();
    let folders = ["src", "plugins"].into_iter().flat_map(|folder| {
        fs::read_dir(project.join(folder)).unwrap().map(|entry| entry.unwrap().path())
    });
    let folders = folders.chain([project.clone(), project.join("python")]);
    let roots = folders.filter(|folder| folder.join("Cargo.toml").is_file());
    let root = |folder: PathBuf| ["src/lib.rs", "lib.rs"].map(|name| folder.join(name));
    roots.flat_map(root).filter(|root| root.is_file()).collect()
}

#[test]
fn no_files_of_a_crate_form_a_circle() {
    let roots = roots();
    assert!(roots.len() > 15, "{roots:?}");
    let found: Vec<String> = roots.iter().flat_map(|root| circles(root)).collect();
    assert!(found.is_empty(), "{} circles:{}", found.len(), found.concat());
}

#[test]
fn a_circle_is_told_from_a_re_export() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    let root = folder.join("lib.rs");
    for (lib, one, other, expected) in [
        // The parent re-exports what its child takes.
        ("mod one; mod other; pub use other::B;", "use super::B; struct A(B);", "pub struct B;", 0),
        (
            "mod one; mod other;",
            "pub struct A; use crate::other::B;",
            "pub struct B; use super::one::A;",
            1,
        ),
        // The parent defines what its child takes, and calls it.
        (
            "mod one; mod other; struct C; fn f() { one::f() }",
            "fn f() { let _ = super::C; }",
            "",
            1,
        ),
        ("mod one; mod other; struct C;", "fn f() { let _ = super::C; }", "", 0),
        ("mod one; mod other; struct C; fn f() { vec![one::f()]; }", "use super::C;", "", 0),
        (
            "mod one; mod other; struct C; fn f() { vec![one::f()]; }",
            "use super::C; fn f() {}",
            "",
            1,
        ),
        (
            "mod one; mod other; pub use one::A;",
            "pub struct A; fn f() { super::other::g() }",
            "pub fn g() -> super::A {}",
            1,
        ),
        ("mod one; mod other; pub use one::A; struct C;", "pub struct A; use super::C;", "", 0),
        ("mod one; mod other; pub use one::A; struct C(A);", "pub struct A; use super::C;", "", 1),
        // Tests of a child may use anything.
        (
            "mod one; mod other; use one::A; struct C;",
            "struct A; #[cfg(test)] mod tests { use crate::C; }",
            "",
            0,
        ),
    ] {
        write("lib.rs", lib);
        write("one.rs", one);
        write("other.rs", other);
        assert_eq!(circles(&root).len(), expected, "{lib} {one} {other}: {:?}", circles(&root));
    }
}
