//! The paths of the sources, resolved: `use` trees and paths in code, `crate`, `self` and `super`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{Visit, visit_path};
use syn::{ExprUnsafe, Item, ItemUse, Macro, UseTree};

/// One path that a file uses.
#[derive(Debug, Clone)]
pub struct Use {
    /// The file, from `src`.
    pub file: String,
    /// The module that the file is, from the crate's root.
    pub module: Vec<String>,
    /// The room of the file.
    pub from: String,
    /// The room, or the library, that the path leads to.
    pub to: String,
    /// The path from the crate's root, or from the library's.
    pub path: String,
    /// Whether it is a library's.
    pub external: bool,
}

/// The folder of the crate that effects, model and solvers share.
const CORE: &str = "core";

fn root() -> PathBuf {
    crate::common::root().join("src")
}

fn sources(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Every source: its name from `src`, and its text.
pub fn texts() -> impl Iterator<Item = (String, String)> {
    let root = root();
    let mut paths = Vec::new();
    sources(&root, &mut paths);
    assert!(paths.len() > 100, "{} files", paths.len());
    paths.into_iter().map(move |path| {
        let name = path.strip_prefix(&root).unwrap().display().to_string();
        (name, fs::read_to_string(&path).unwrap())
    })
}

/// Every source with its name from `src`, the module that it is, and what is in it.
fn files() -> Vec<(String, Vec<String>, syn::File)> {
    let read = |(name, text): (String, String)| {
        let mut module: Vec<String> =
            name.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
        if module.last().is_some_and(|last| last == "mod" || last == "lib" || last == "main") {
            module.pop();
        }
        // This crate holds several rooms.
        if module.first().is_some_and(|first| first == CORE) {
            module.remove(0);
        }
        let file = syn::parse_file(&text);
        (name.clone(), module, file.unwrap_or_else(|e| panic!("{name}: {e}")))
    };
    texts().map(read).collect()
}

/// Whether a room is a crate of its own.
fn is_crate(room: &str) -> bool {
    root().join(room).join("Cargo.toml").is_file()
}

/// The room that a crate of this name is.
fn room_of(name: &str) -> Option<&str> {
    name.strip_prefix("rumple_").filter(|room| is_crate(room))
}

struct Finder<'a> {
    file: &'a str,
    /// Module of the code at hand; inner modules are entered.
    module: Vec<String>,
    /// What names at the crate's root stand for.
    roots: &'a BTreeMap<String, Vec<String>>,
    found: Vec<Use>,
}

impl Finder<'_> {
    /// Records `segments`, if they lead out of the module or to a library.
    fn note(&mut self, segments: &[String]) {
        let Some(first) = segments.first() else { return };
        // A room may be a crate of its own; its root is then the room.
        let own = self.module.first().filter(|room| is_crate(room)).cloned();
        let mut full: Vec<String> = match first.as_str() {
            "crate" => own.iter().cloned().collect(),
            "self" => self.module.clone(),
            "super" => {
                let up = segments.iter().take_while(|s| *s == "super").count();
                self.module[..self.module.len().saturating_sub(up)].to_vec()
            }
            "std" | "core" | "alloc" => return,
            name => match room_of(name) {
                Some(CORE) => Vec::new(),
                Some(room) => vec![room.to_owned()],
                None => {
                    self.push(first.clone(), segments.join("::"), true);
                    return;
                }
            },
        };
        let skipped = segments.iter().take_while(|s| ["super", "self"].contains(&s.as_str()));
        let skipped = skipped.count().max(1);
        full.extend(segments[skipped..].iter().cloned());
        if first == "crate"
            && own.is_none()
            && let Some(stands_for) = full.first().and_then(|name| self.roots.get(name))
        {
            full.splice(..1, stands_for.iter().cloned());
        }
        let Some(room) = full.first().cloned() else { return };
        self.push(room, full.join("::"), false);
    }

    fn push(&mut self, to: String, path: String, external: bool) {
        let from = self.module.first().cloned().unwrap_or_default();
        if from.is_empty() {
            return;
        }
        let (file, module) = (self.file.to_owned(), self.module.clone());
        self.found.push(Use { file, module, from, to, path, external });
    }

    fn tree(&mut self, tree: &UseTree, before: &mut Vec<String>) {
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.tree(&path.tree, before);
                before.pop();
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.tree(tree, before);
                }
            }
            UseTree::Name(name) => self.leaf(&name.ident.to_string(), before),
            UseTree::Rename(name) => self.leaf(&name.ident.to_string(), before),
            UseTree::Glob(_) => self.leaf("*", before),
        }
    }

    fn leaf(&mut self, name: &str, before: &mut Vec<String>) {
        before.push(name.to_owned());
        self.note(before);
        before.pop();
    }
}

impl<'ast> Visit<'ast> for Finder<'_> {
    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.tree(&item.tree, &mut Vec::new());
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        let first = segments[0].as_str();
        let known = ["crate", "super", "self"].contains(&first)
            || LIBRARIES.contains(&first)
            || room_of(first).is_some();
        if known && segments.len() > 1 {
            self.note(&segments);
        }
        visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast Macro) {
        // Macros of the crate's root belong to the room that defines them.
        let segments: Vec<String> =
            item.path.segments.iter().map(|s| s.ident.to_string()).collect();
        if segments.len() == 2 && segments[0] == "crate" {
            let room = match segments[1].as_str() {
                "register_kind" | "family" => "registry",
                "checked_number" => "numerics",
                _ => return,
            };
            self.push(room.into(), segments.join("::"), false);
            return;
        }
        self.visit_path(&item.path);
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if let Some((_, items)) = &item.content {
            self.module.push(item.ident.to_string());
            items.iter().for_each(|item| self.visit_item(item));
            self.module.pop();
        }
    }
}

/// Libraries that are looked for in paths of code, where no `use` names them.
const LIBRARIES: [&str; 7] =
    ["diffsol", "diffsol_la", "faer", "libloading", "mpi", "vtkio", "clap"];

/// What the names that `lib.rs` re-exports stand for.
fn roots(lib: &syn::File) -> BTreeMap<String, Vec<String>> {
    fn leaves(tree: &UseTree, before: &[String], all: &mut BTreeMap<String, Vec<String>>) {
        match tree {
            UseTree::Path(path) => {
                leaves(&path.tree, &[before, &[path.ident.to_string()]].concat(), all);
            }
            UseTree::Group(group) => group.items.iter().for_each(|t| leaves(t, before, all)),
            UseTree::Name(name) => {
                let name = name.ident.to_string();
                all.insert(name.clone(), [before, &[name]].concat());
            }
            _ => {}
        }
    }
    let mut all = BTreeMap::new();
    for item in &lib.items {
        if let Item::Use(item) = item {
            leaves(&item.tree, &[], &mut all);
        }
    }
    for path in all.values_mut() {
        match room_of(&path[0]) {
            Some(CORE) => drop(path.remove(0)),
            Some(room) => path[0] = room.to_owned(),
            None => {}
        }
    }
    all
}

/// All paths of all sources.
pub fn uses() -> Vec<Use> {
    let files = files();
    let mut roots = BTreeMap::new();
    for name in ["lib.rs", "core/lib.rs"] {
        let lib = files.iter().find(|f| f.0 == name).unwrap();
        roots.extend(self::roots(&lib.2));
    }
    let mut all = Vec::new();
    for (name, module, file) in &files {
        let mut finder =
            Finder { file: name, module: module.clone(), roots: &roots, found: Vec::new() };
        finder.visit_file(file);
        all.append(&mut finder.found);
    }
    all
}

struct Unsafe(bool);

impl<'ast> Visit<'ast> for Unsafe {
    fn visit_expr_unsafe(&mut self, _: &'ast ExprUnsafe) {
        self.0 = true;
    }

    fn visit_signature(&mut self, signature: &'ast syn::Signature) {
        self.0 |= signature.unsafety.is_some();
    }
}

/// The files with something unsafe in them.
pub fn unsafe_blocks() -> Vec<String> {
    let mut found = Vec::new();
    for (name, _, file) in files() {
        let mut seen = Unsafe(false);
        seen.visit_file(&file);
        if seen.0 {
            found.push(name);
        }
    }
    found
}
