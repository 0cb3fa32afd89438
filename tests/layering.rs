//! A module imports only from lower floors of its crate, and the files of a module form no circle.
//!
//! Why: cargo keeps the floors between crates, but inside one a convenient import would tie modules together unseen.
//! How: `syn` reads every file, tests left out. Each path is followed through re-exports to the file that defines its end.

mod sources;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use proc_macro2::{TokenStream, TokenTree};
use sources::{sources, src};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// The crates below `src` with the floors of their modules, from the lowest up.
const HOUSE: &[(&str, &[&[&str]])] = &[
    ("base", &[&["geom", "expr"], &["shape", "storage"], &["surface"]]),
    (
        "kernel",
        &[
            &["mesh", "topology"],
            &["delaunay", "reconnect", "sizing", "samples"],
            &["boundary", "optimize"],
            &["blocks"],
            &["bisect"],
        ],
    ),
    ("repair", &[&["resolve", "remesh", "wrap"], &["close"]]),
    ("store", &[&["sealed"], &["store"], &["query", "audit"], &["transfer"]]),
    ("io", &[&["read", "write"]]),
    ("engine", &[&["pipeline"], &["view"], &["api"]]),
    ("cli", &[]),
];

/// Files and functions above these lengths need a reason. The exceptions are listed below, each with its reason.
const FILE_LINES_MAX: usize = 500;
const FUNCTION_LINES_MAX: usize = 80;

/// Files above [`FILE_LINES_MAX`], tests at their feet not counted.
const LONG_FILES: &[(&str, &str)] = &[
    ("engine/api/mesher.rs", "a method with its documentation for each option of a mesh"),
    ("engine/api/surface.rs", "a method with its documentation for all that is done to a surface"),
    ("store/store/catalog.rs", "one transaction type: a reader and a writer for each table"),
];

/// Functions above [`FUNCTION_LINES_MAX`].
const LONG_FUNCTIONS: &[(&str, &str)] = &[
    ("cli/failure.rs help_of", "a sentence of help for each code"),
    (
        "kernel/blocks/insert.rs expand",
        "one tetrahedron of a cavity: its faces share products, and loads come before tests",
    ),
    (
        "kernel/boundary/grow.rs grow",
        "a cavity is grown, then refused for any of five reasons that need what was grown",
    ),
    (
        "kernel/boundary/points.rs build",
        "chains, faces and suppression of one attempt, which hand on four lists",
    ),
    ("cli/estimate.rs run", "an answer line by line, for people and for programs"),
    ("engine/pipeline/remesh/run.rs commit", "one commit: what it checks and all that it writes"),
    (
        "engine/pipeline/tasks/serve.rs serve",
        "what orders need is set up once and lent to the threads that do them",
    ),
];

#[test]
fn modules_import_from_lower_floors_alone() {
    let mut wrong = Vec::new();
    let mut n_imports = 0;
    for (name, floors) in HOUSE {
        let floor_of = |m: &str| floors.iter().position(|floor| floor.contains(&m));
        for (file, module) in &Crate::read(name).files {
            let Some(from) = floor_of(first(file)) else {
                continue;
            };
            for path in module.all_paths().filter(|p| p.len() > 1 && p[0] == "crate") {
                n_imports += 1;
                let to = floor_of(&path[1]);
                if path[1] != first(file) && to.is_some_and(|to| to >= from) {
                    wrong.push(format!("{name}/{file}: {}", path.join("::")));
                }
            }
        }
    }
    assert!(n_imports > 200, "only {n_imports} imports found: does the test read the sources?");
    assert!(wrong.is_empty(), "imports that do not lead down: {wrong:#?}");
}

#[test]
fn every_module_has_a_floor() {
    for (name, floors) in HOUSE.iter().filter(|(_, floors)| !floors.is_empty()) {
        let files = Crate::read(name).files;
        let found: BTreeSet<&str> =
            files.keys().map(|file| first(file)).filter(|m| !m.is_empty()).collect();
        let listed: BTreeSet<&str> = floors.iter().copied().flatten().copied().collect();
        assert_eq!(found, listed, "of src/{name}");
    }
}

#[test]
fn files_of_a_module_form_no_circle() {
    let (mut found, mut n_edges) = (Vec::new(), 0);
    for (name, _) in HOUSE {
        let graph = Crate::read(name).graph();
        n_edges += graph.values().map(BTreeSet::len).sum::<usize>();
        found.extend(circles(&graph).iter().map(|files| describe(name, files, &graph)));
    }
    assert!(n_edges > 200, "only {n_edges} imports found: does the test read the sources?");
    assert!(found.is_empty(), "{} circles of files:\n{}", found.len(), found.join("\n"));
}

#[test]
fn circles_are_found_through_reexports_and_beside_functions_of_the_same_name() {
    let files = [
        ("a", "mod b; mod c; mod d; pub use b::{B, other as renamed}; use c::Hidden;"),
        ("a::b", "use super::c::C; fn f() { crate::a::d::g() }"),
        ("a::c", "use crate::a::renamed;"),
        ("a::d", "use super::Hidden; use super::super::e::E;"),
        ("e", "pub struct E;"),
        // A function and a module with the same name: the path through that name is the module's.
        ("f", "mod g; mod h; mod i; pub use i::g;"),
        ("f::g", "use super::h::H;"),
        ("f::h", "use super::g::G; sort_record! { struct R { x: super::i::I } }"),
        ("f::i", "pub fn g() {}"),
    ];
    let found = circles(&Crate::from_texts(files).graph());
    let files = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<BTreeSet<_>>();
    assert_eq!(found, [files(&["a::b", "a::c", "a::d"]), files(&["f::g", "f::h"])]);
}

#[test]
fn the_readme_names_every_module_and_no_file_that_is_not_there() {
    let text = fs::read_to_string(src().join("README.md")).expect("src/README.md is readable");
    for (name, floors) in HOUSE {
        for module in floors.iter().copied().flatten().chain([name]) {
            assert!(text.contains(&format!("`{module}`")), "src/README.md does not name {module}");
        }
    }
    let spans: Vec<&str> = text.split('`').skip(1).step_by(2).collect();
    for file in spans.iter().filter(|s| s.ends_with(".rs") || s.ends_with(".md")) {
        let found = src().join(file).exists() || src().join("..").join(file).exists();
        assert!(found, "src/README.md names {file}, which does not exist");
    }
}

#[test]
fn long_files_and_functions_are_those_with_a_reason() {
    let (mut files, mut functions) = (BTreeSet::new(), BTreeSet::new());
    let mut n_functions = 0;
    for path in sources(&src()) {
        let text = fs::read_to_string(&path).expect("a source file is readable");
        let name = path.strip_prefix(src()).expect("it is below src");
        let name = name.to_string_lossy().replace('\\', "/");
        let mut measured = Measured::default();
        measured.visit_file(&syn::parse_file(&text).expect("a source file parses"));
        let lines = text.lines().count() - measured.test_lines;
        if lines > FILE_LINES_MAX {
            files.insert(name.clone());
        }
        n_functions += measured.functions.len();
        let long = measured.functions.iter().filter(|(_, lines)| *lines > FUNCTION_LINES_MAX);
        functions.extend(long.map(|(function, _)| format!("{name} {function}")));
    }
    assert!(
        n_functions > 3000,
        "only {n_functions} functions found: does the test read the sources?"
    );
    let listed = |list: &[(&str, &str)]| list.iter().map(|row| row.0.to_owned()).collect();
    assert_eq!(files, listed(LONG_FILES));
    assert_eq!(functions, listed(LONG_FUNCTIONS));
}

/// Numbers of lines of the functions and of the tests in a file.
#[derive(Default)]
struct Measured {
    functions: Vec<(String, usize)>,
    test_lines: usize,
}

impl Measured {
    fn add(&mut self, signature: &syn::Signature, span: proc_macro2::Span) {
        let first = signature.span().start().line;
        self.functions.push((signature.ident.to_string(), span.end().line + 1 - first));
    }
}

impl<'ast> Visit<'ast> for Measured {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        match is_test(&item.attrs) {
            true => self.test_lines += item.span().end().line + 1 - item.span().start().line,
            false => visit::visit_item_mod(self, item),
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.add(&item.sig, item.span());
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.add(&item.sig, item.span());
        visit::visit_impl_item_fn(self, item);
    }
}

/// Returns whether an item is built only for tests.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|a| match &a.meta {
        syn::Meta::List(list) if a.path().is_ident("cfg") => list.tokens.to_string() == "test",
        meta => meta.path().is_ident("test"),
    })
}

/// A file as a module: its imports, and the other paths in it.
#[derive(Default)]
struct Module {
    /// Local name and path of every `use`.
    uses: BTreeMap<String, Vec<String>>,
    paths: Vec<Vec<String>>,
}

impl Module {
    fn parse(text: &str) -> Self {
        let mut module = Self::default();
        module.visit_file(&syn::parse_file(text).expect("a source file parses"));
        module
    }

    fn all_paths(&self) -> impl Iterator<Item = &Vec<String>> {
        self.uses.values().chain(&self.paths)
    }

    fn add_tree(&mut self, tree: &syn::UseTree, mut path: Vec<String>) {
        match tree {
            syn::UseTree::Path(p) => {
                path.push(p.ident.to_string());
                self.add_tree(&p.tree, path);
            }
            syn::UseTree::Name(n) if n.ident == "self" => {
                self.uses.insert(path.last().cloned().unwrap_or_default(), path);
            }
            syn::UseTree::Name(n) => {
                path.push(n.ident.to_string());
                self.uses.insert(n.ident.to_string(), path);
            }
            syn::UseTree::Rename(r) => {
                path.push(r.ident.to_string());
                self.uses.insert(r.rename.to_string(), path);
            }
            syn::UseTree::Glob(_) => self.paths.push(path),
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.add_tree(tree, path.clone()));
            }
        }
    }

    /// Paths among the tokens of a macro.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Ident(name) => {
                    if colons != 2 {
                        self.paths.extend((!path.is_empty()).then(|| std::mem::take(&mut path)));
                    }
                    path.push(name.to_string());
                    colons = 0;
                }
                TokenTree::Punct(p) if p.as_char() == ':' => colons += 1,
                other => {
                    colons = 0;
                    self.paths.extend((!path.is_empty()).then(|| std::mem::take(&mut path)));
                    if let TokenTree::Group(group) = other {
                        self.add_tokens(group.stream());
                    }
                }
            }
        }
        self.paths.extend((!path.is_empty()).then_some(path));
    }
}

impl<'ast> Visit<'ast> for Module {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        let attributes = match item {
            syn::Item::Mod(i) => &i.attrs,
            syn::Item::Fn(i) => &i.attrs,
            syn::Item::Use(i) => &i.attrs,
            syn::Item::Impl(i) => &i.attrs,
            _ => &Vec::new(),
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.add_tree(&item.tree, Vec::new());
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.push(path.segments.iter().map(|s| s.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.add_tokens(item.tokens.clone());
    }

    fn visit_item_macro(&mut self, item: &'ast syn::ItemMacro) {
        // Paths in a macro definition are resolved where the macro is used.
        if !item.mac.path.is_ident("macro_rules") {
            self.visit_macro(&item.mac);
        }
    }
}

/// Every file of a crate by the path of its module, `pipeline::mesh::run`.
struct Crate {
    files: BTreeMap<String, Module>,
}

impl Crate {
    fn read(name: &str) -> Self {
        let root = src().join(name);
        let files = sources(&root).into_iter().map(|path| {
            let text = fs::read_to_string(&path).expect("a source file is readable");
            (module_of(path.strip_prefix(&root).expect("it is below")), Module::parse(&text))
        });
        Self { files: files.collect() }
    }

    fn from_texts<'a>(texts: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let files = texts.into_iter().map(|(name, text)| (name.to_owned(), Module::parse(text)));
        Self { files: files.collect() }
    }

    /// For each file, the files of the same module from which it imports.
    fn graph(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut graph = BTreeMap::new();
        for (name, module) in &self.files {
            // A re-exported name of a file's own children counts where the name is used.
            let used = module.uses.iter().filter(|(alias, path)| {
                !self.is_child(name, &path[0]) || module.paths.iter().any(|p| p[0] == **alias)
            });
            let all = used.map(|(_, path)| path).chain(&module.paths);
            let to: BTreeSet<String> = all
                .filter_map(|path| self.file_of(name, path, 0))
                .filter(|to| to != name && first(to) == first(name))
                .collect();
            graph.insert(name.clone(), to);
        }
        graph
    }

    fn is_child(&self, module: &str, name: &str) -> bool {
        self.files.contains_key(&join(module, name))
    }

    /// The file that defines the end of a path; `None` for a folder's own name and for other crates.
    fn file_of(&self, from: &str, path: &[String], depth: u32) -> Option<String> {
        let (mut at, mut rest) = match path[0].as_str() {
            "crate" => (String::new(), &path[1..]),
            "self" => (from.to_owned(), &path[1..]),
            "super" => (parent(from).to_owned(), &path[1..]),
            name if path.len() > 1 && self.is_child(from, name) => (from.to_owned(), path),
            name if self.files.get(from)?.uses.contains_key(name) => (from.to_owned(), path),
            _ => return None,
        };
        while let Some(name) = rest.first() {
            let used = self.files.get(&at).and_then(|m| m.uses.get(name));
            if name == "super" {
                at = parent(&at).to_owned();
            } else if rest.len() > 1 && self.is_child(&at, name) {
                at = join(&at, name);
            } else if let Some(used) = used.filter(|_| depth < 16) {
                let whole = [used, &rest[1..]].concat();
                return match whole == path && at == from {
                    true => None,
                    false => self.file_of(&at, &whole, depth + 1),
                };
            } else if self.is_child(&at, name) {
                at = join(&at, name);
            } else {
                return Some(at);
            }
            rest = &rest[1..];
        }
        let is_folder = self.files.keys().any(|k| k.starts_with(&format!("{at}::")));
        (!at.is_empty() && !is_folder).then_some(at)
    }
}

fn join(module: &str, name: &str) -> String {
    if module.is_empty() { name.to_owned() } else { format!("{module}::{name}") }
}

fn parent(module: &str) -> &str {
    module.rsplit_once("::").map_or("", |(parent, _)| parent)
}

fn first(module: &str) -> &str {
    module.split("::").next().unwrap_or(module)
}

/// `mesh/run.rs` -> `mesh::run`, `mesh/mod.rs` -> `mesh`, `lib.rs` -> the empty path.
fn module_of(path: &Path) -> String {
    let names: Vec<_> =
        path.with_extension("").iter().map(|n| n.to_string_lossy().into_owned()).collect();
    match names.split_last() {
        Some((last, folders)) if last == "mod" || last == "lib" => folders.join("::"),
        _ => names.join("::"),
    }
}

/// The largest groups of files that import each other, directly or through others.
fn circles(graph: &BTreeMap<String, BTreeSet<String>>) -> Vec<BTreeSet<String>> {
    let reach: BTreeMap<&String, BTreeSet<&String>> =
        graph.keys().map(|f| (f, reached(f, graph))).collect();
    let mut found: Vec<BTreeSet<String>> = Vec::new();
    for (file, others) in &reach {
        let circle: BTreeSet<String> =
            others.iter().filter(|o| reach[*o].contains(file)).map(|o| (*o).clone()).collect();
        if !circle.is_empty() && !found.contains(&circle) {
            found.push(circle);
        }
    }
    found
}

fn reached<'a>(
    file: &'a String,
    graph: &'a BTreeMap<String, BTreeSet<String>>,
) -> BTreeSet<&'a String> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![file]);
    while let Some(next) = open.pop() {
        for to in &graph[next] {
            if reached.insert(to) {
                open.push(to);
            }
        }
    }
    reached
}

fn describe(
    name: &str,
    files: &BTreeSet<String>,
    graph: &BTreeMap<String, BTreeSet<String>>,
) -> String {
    let lines = files.iter().map(|file| {
        let to: Vec<&str> = graph[file].intersection(files).map(String::as_str).collect();
        format!("    {name}/{file} -> {}", to.join(", "))
    });
    format!("  circle of {}:\n{}", files.len(), lines.collect::<Vec<_>>().join("\n"))
}
