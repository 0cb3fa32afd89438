//! A room imports only from lower floors, never from its own; inside a room, files form no circle.
//!
//! Why: the topology kernel must not come to know formats, nor the store geometry, one convenient import at a time.
//! How: every `crate::ROOM` in the sources, tests left out, is looked up in the house below. Inside a room, every path is followed through
//! the re-exports to the file that defines its end.

mod sources;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use sources::{sources, src, without_tests};

/// Rooms from the lowest floor up.
const HOUSE: &[&[&str]] = &[
    &["geom", "expr"],
    &["storage"],
    &["mesh", "surface", "sealed"],
    &["delaunay", "reconnect", "sizing", "samples", "store"],
    &["boundary", "refine", "optimize"],
    &["bisect", "topology"],
    &["pipeline", "audit", "query"],
    &["io"],
    &["view"],
    &["api"],
    &["cli"],
];

/// Files and modules at the top of the crate that are no rooms.
const NOT_ROOMS: &[&str] = &["lib", "main", "guide"];

/// Longer files and functions are looked at a second time: those left are below, each with its reason.
const FILE_LINES_MAX: usize = 500;
const FUNCTION_LINES_MAX: usize = 80;

/// Files above [`FILE_LINES_MAX`], tests at their feet not counted.
const LONG_FILES: &[(&str, &str)] = &[
    ("api/mesher.rs", "a method with its documentation for each option of a mesh"),
    ("api/surface.rs", "a method with its documentation for all that is done to a surface"),
    ("store/catalog.rs", "one transaction type: a reader and a writer for each table"),
    ("audit/pass.rs", "one walk over a sub-domain that all five levels of checks share"),
    ("io/read/feed.rs", "the words, numbers and places that every text format reads by"),
    (
        "io/write/merged.rs",
        "one walk over all sub-domains as one mesh, which every format has its vertices, tetrahedra and faces from",
    ),
];

/// Functions above [`FUNCTION_LINES_MAX`].
const LONG_FUNCTIONS: &[(&str, &str)] = &[
    (
        "boundary/grow.rs grow",
        "a cavity is grown, then refused for any of five reasons that need what was grown",
    ),
    (
        "boundary/points.rs build",
        "chains, faces and suppression of one attempt, which hand on four lists",
    ),
    ("boundary/space.rs replace", "pairs of sides are matched; each step uses the list before"),
    ("cli/estimate.rs run", "an answer line by line, for people and for programs"),
    (
        "io/write/foam/faces.rs part",
        "one merge of four sorted streams; what a face is depends on all four",
    ),
    ("io/write/foam/processors.rs faces", "three kinds of faces in the order of one file"),
    ("io/write/foam/processors.rs write", "two passes that share their counts"),
    (
        "io/write/gmsh/nodes.rs claims",
        "faces, tetrahedra, vertices and ghosts claim in turn, into one sorter",
    ),
    ("io/write/midpoints.rs gather", "five passes, each sorted for the next"),
    (
        "io/write/vtu.rs write_partitions",
        "nine arrays named, opened, filled and closed in one order",
    ),
    (
        "io/write/vtu_boundary.rs write",
        "fourteen arrays named, opened, filled and closed in one order",
    ),
    ("pipeline/mesh/run.rs coarse_step", "one step of the recipe and its commit"),
    ("pipeline/remesh/run.rs commit", "one commit: what it checks and all that it writes"),
    (
        "pipeline/tasks/serve.rs serve",
        "what orders need is set up once and lent to the threads that do them",
    ),
    ("refine/long_edges.rs divide", "one edge from its length to its points"),
];

fn floor(room: &str) -> Option<usize> {
    HOUSE.iter().position(|rooms| rooms.contains(&room))
}

#[test]
fn rooms_import_only_from_lower_floors() {
    let mut wrong = BTreeSet::new();
    let mut n_imports = 0;
    for path in sources(&src()) {
        let Some(room) = room_of(&path) else { continue };
        let here =
            floor(&room).unwrap_or_else(|| panic!("{room} has no floor in this test's house"));
        let text = fs::read_to_string(&path).expect("a source file is readable");
        for other in imports(&without_tests(&text)) {
            if other == room || NOT_ROOMS.contains(&other.as_str()) {
                continue;
            }
            n_imports += 1;
            match floor(&other) {
                Some(there) if there < here => {}
                _ => _ = wrong.insert(format!("{}: {room} imports {other}", path.display())),
            }
        }
    }
    assert!(
        n_imports > 50,
        "only {n_imports} imports found: does the test still read the sources?"
    );
    assert!(wrong.is_empty(), "imports that go up or sideways:\n{wrong:#?}");
}

#[test]
fn files_of_a_room_form_no_circle() {
    let modules = Modules::read();
    let graph = modules.graph();
    let n_edges: usize = graph.values().map(BTreeSet::len).sum();
    assert!(
        n_edges > 200,
        "only {n_edges} imports between the files of a room found: does the test still read the sources?"
    );
    let found: Vec<_> = circles(&graph).iter().map(|files| describe(files, &graph)).collect();
    assert!(
        found.is_empty(),
        "{} circles of files inside a room:\n{}",
        found.len(),
        found.join("\n")
    );
}

#[test]
fn circles_are_found_through_reexports() {
    let modules = Modules::from_texts([
        ("a", "mod b;\nmod c;\nmod d;\npub use b::{B, other as renamed};\nuse c::Hidden;"),
        ("a::b", "use super::c::C;\nfn f() { crate::a::d::g() }"),
        ("a::c", "use crate::a::renamed;"),
        ("a::d", "use super::Hidden;\nuse super::super::e::E;"),
        ("e", "pub struct E;"),
    ]);
    let files = |names: &[&str]| names.iter().map(|n| n.to_string()).collect();
    let found = circles(&modules.graph());
    assert_eq!(found, [files(&["a::b", "a::c", "a::d"])] as [BTreeSet<String>; 1]);
}

#[test]
fn the_readme_names_every_room_and_no_file_that_is_not_there() {
    let text = fs::read_to_string(src().join("README.md")).expect("src/README.md is readable");
    for room in HOUSE.iter().copied().flatten() {
        assert!(text.contains(&format!("[`{room}`]")), "src/README.md does not name {room}");
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
        if before_tests(&text).lines().count() > FILE_LINES_MAX {
            files.insert(name.clone());
        }
        for (function, lines) in functions_of(&text) {
            n_functions += 1;
            if lines > FUNCTION_LINES_MAX {
                functions.insert(format!("{name} {function}"));
            }
        }
    }
    assert!(
        n_functions > 3000,
        "only {n_functions} functions found: does the test still read the sources?"
    );
    let listed = |list: &[(&str, &str)]| list.iter().map(|row| row.0.to_owned()).collect();
    assert_eq!(files, listed(LONG_FILES));
    assert_eq!(functions, listed(LONG_FUNCTIONS));
}

/// The text up to the tests at its foot.
fn before_tests(text: &str) -> &str {
    text.split("\n#[cfg(test)]\nmod tests {").next().unwrap_or(text)
}

/// Functions with a body and the lines of each, as `cargo fmt` leaves them: from the name to the brace below it. Tests are left out.
fn functions_of(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = before_tests(text).lines().collect();
    let mut found = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let code = line.trim_start();
        let Some(at) = code.find("fn ").filter(|&at| {
            let words = code[..at].split_whitespace();
            words
                .map(|w| w.split('(').next().unwrap_or(w))
                .all(|w| ["pub", "const", "unsafe"].contains(&w))
        }) else {
            continue;
        };
        let attributes = lines[..i].iter().rev().map(|l| l.trim());
        let mut attributes = attributes.take_while(|l| l.starts_with("#["));
        let head = lines[i..].iter().find(|l| l.ends_with(['{', '}', ';']));
        if attributes.any(|l| l == "#[test]") || head.is_none_or(|l| l.ends_with(';')) {
            continue;
        }
        let end = format!("{}}}", &line[..line.len() - code.len()]);
        let ended = |l: &&str| {
            **l == end
                || l.len() > end.len() && l.starts_with(&end) && l.as_bytes()[end.len()] == b';'
        };
        if let Some(length) = lines[i..].iter().position(ended) {
            found.push((name(&code[at + "fn ".len()..]), length + 1));
        }
    }
    found
}

#[test]
fn functions_are_measured_to_their_last_brace() {
    let text = "trait T {\n    fn only_named(\n        &self,\n    );\n}\n\nfn a() {\n    1\n}\n\nimpl B {\n    pub(super) fn b(\n        c: u32,\n    ) -> u32 {\n        c\n    }\n}\n\
        #[test]\n#[ignore]\nfn left_out() {\n}\n";
    let found = functions_of(text);
    assert_eq!(found, [("a".to_owned(), 3), ("b".to_owned(), 5)]);
}

#[test]
fn every_room_is_a_module_of_the_crate() {
    let lib = fs::read_to_string(src().join("lib.rs")).expect("src/lib.rs is readable");
    let declared: BTreeSet<&str> = lib
        .lines()
        .filter_map(|l| l.trim_start().strip_prefix("pub mod ")?.strip_suffix(';'))
        .filter(|name| !NOT_ROOMS.contains(name))
        .collect();
    let found: BTreeSet<String> = sources(&src()).iter().filter_map(|p| room_of(p)).collect();
    assert_eq!(declared, found.iter().map(String::as_str).collect());
}

#[test]
fn imports_are_found_however_they_are_written() {
    let text = "use crate::storage::Page;\nuse crate::{geom::Point, mesh::{Tet, Face}};\nlet x = crate::sizing::f();\n\
        /// [`crate::io`] is only named\n#[cfg(test)]\nmod tests { use crate::cli; }\n";
    let found: BTreeSet<String> = imports(&without_tests(text)).into_iter().collect();
    assert_eq!(found, ["geom", "mesh", "sizing", "storage"].map(String::from).into());
}

/// The folder (or file) directly below `src`.
fn room_of(path: &Path) -> Option<String> {
    let first = path.strip_prefix(src()).ok()?.iter().next()?;
    let room = Path::new(first).file_stem()?.to_string_lossy().into_owned();
    (!NOT_ROOMS.contains(&room.as_str())).then_some(room)
}

/// First names after `crate::`, also inside braces.
fn imports(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        // `crate_name::` and `$crate::` are other things.
        if text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &text[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            Some(list) => found.extend(names_in_braces(list)),
            None => found.push(name(rest)),
        }
    }
    // Types and functions of the crate's root are in lower floors' reach.
    found.retain(|n| n.starts_with(|c: char| c.is_ascii_lowercase()));
    found
}

fn names_in_braces(list: &str) -> Vec<String> {
    let (mut depth, mut start, mut found) = (0, true, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => start = true,
            c if c.is_whitespace() => {}
            _ if start => {
                found.push(name(&list[i..]));
                start = false;
            }
            _ => {}
        }
    }
    found
}

fn name(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// A module by its path from the crate's root, `pipeline::mesh::run`, with what it imports and the other paths in it.
#[derive(Default)]
struct Module {
    /// Name here -> path as it is written, of every `use`.
    uses: BTreeMap<String, Vec<String>>,
    paths: Vec<Vec<String>>,
}

/// What a path leads to.
enum Target {
    Module(String),
    /// Something defined in the file of this module.
    ItemOf(String),
}

/// Every module of the crate that is a file.
struct Modules(BTreeMap<String, Module>);

impl Modules {
    fn read() -> Self {
        let root = src();
        let texts: Vec<(String, String)> = sources(&root)
            .iter()
            .filter(|path| room_of(path).is_some())
            .map(|path| {
                let text = fs::read_to_string(path).expect("a source file is readable");
                (module_of(path.strip_prefix(&root).expect("it is below src")), text)
            })
            .collect();
        Self::from_texts(texts.iter().map(|(m, t)| (m.as_str(), t.as_str())))
    }

    fn from_texts<'a>(texts: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let modules = texts.into_iter().map(|(name, text)| {
            let (uses, rest) = split_uses(&without_tests(text));
            let module = Module {
                uses: uses.iter().flat_map(|u| use_tree(u)).collect(),
                paths: paths(&rest),
            };
            (name.to_owned(), module)
        });
        Self(modules.collect())
    }

    /// File -> files of the same room it takes something from, by the paths of their modules.
    fn graph(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut graph = BTreeMap::new();
        for (name, module) in &self.0 {
            // What only passes on a name of its own children needs nothing from them: these paths count where
            // they are used.
            let used = module.uses.values().filter(|path| !self.is_child(name, &path[0]));
            let inner = module.uses.iter().filter(|(alias, path)| {
                self.is_child(name, &path[0]) && module.paths.iter().any(|p| p[0] == **alias)
            });
            let all = used.chain(inner.map(|(_, path)| path)).chain(&module.paths);
            let to: BTreeSet<String> = all
                .filter_map(|path| self.file_of(name, path))
                .filter(|to| to != name && first(to) == first(name))
                .collect();
            graph.insert(name.clone(), to);
        }
        graph
    }

    fn is_child(&self, module: &str, name: &str) -> bool {
        self.0.contains_key(&join(module, name))
    }

    fn file_of(&self, from: &str, path: &[String]) -> Option<String> {
        match self.resolve(from, path)? {
            Target::ItemOf(module) => Some(module),
            // A folder's own name stands for nothing yet: what is taken from it is another path.
            Target::Module(m) if self.0.keys().any(|k| k.starts_with(&format!("{m}::"))) => None,
            Target::Module(module) => Some(module),
        }
    }

    fn resolve(&self, from: &str, path: &[String]) -> Option<Target> {
        let rest = &path[1..];
        match path[0].as_str() {
            "crate" => self.walk("", rest),
            "self" => self.walk(from, rest),
            "super" => {
                let parent = from.rsplit_once("::").map_or("", |(parent, _)| parent);
                match rest.first().map(String::as_str) {
                    Some("super") => self.resolve(parent, rest),
                    _ => self.walk(parent, rest),
                }
            }
            name if self.is_child(from, name) => self.walk(&join(from, name), rest),
            name => {
                let used = self.0.get(from)?.uses.get(name)?;
                self.continue_from(from, used, rest)
            }
        }
    }

    fn walk(&self, module: &str, path: &[String]) -> Option<Target> {
        let Some(name) = path.first() else {
            return Some(Target::Module(module.to_owned()));
        };
        let used = self.0.get(module).and_then(|m| m.uses.get(name));
        match used {
            Some(used) => self.continue_from(module, used, &path[1..]),
            None if self.is_child(module, name) => self.walk(&join(module, name), &path[1..]),
            None if self.0.contains_key(module) => Some(Target::ItemOf(module.to_owned())),
            None => None,
        }
    }

    fn continue_from(&self, module: &str, used: &[String], rest: &[String]) -> Option<Target> {
        // `use name;` and an outer crate's name lead nowhere in this crate.
        let known = ["crate", "self", "super"].contains(&used[0].as_str());
        if !known && !self.is_child(module, &used[0]) {
            return None;
        }
        match self.resolve(module, used)? {
            Target::Module(m) => self.walk(&m, rest),
            item => Some(item),
        }
    }
}

fn join(module: &str, name: &str) -> String {
    if module.is_empty() { name.to_owned() } else { format!("{module}::{name}") }
}

fn first(module: &str) -> &str {
    module.split("::").next().unwrap_or(module)
}

/// `mesh/run.rs` -> `mesh::run`, `mesh/mod.rs` -> `mesh`.
fn module_of(path: &Path) -> String {
    let names: Vec<_> =
        path.with_extension("").iter().map(|n| n.to_string_lossy().into_owned()).collect();
    let names = names.strip_suffix(&["mod".to_owned()]).unwrap_or(&names);
    names.join("::")
}

/// The trees of all `use`, and the text without them.
fn split_uses(text: &str) -> (Vec<String>, String) {
    let (mut uses, mut rest) = (Vec::new(), String::new());
    let mut inside: Option<String> = None;
    for line in text.lines() {
        let line = line.trim();
        let start = line
            .find("use ")
            .filter(|&at| at == 0 || line.starts_with("pub") && line[..at].ends_with([' ', ')']));
        match (&mut inside, start) {
            (Some(tree), _) => tree.push_str(line),
            (None, Some(at)) => inside = Some(line[at + "use ".len()..].to_owned()),
            (None, None) => {
                rest.push_str(line);
                rest.push('\n');
            }
        }
        if let Some(tree) = inside.take_if(|tree| tree.ends_with(';')) {
            uses.push(tree.trim_end_matches(';').to_owned());
        }
    }
    (uses, rest)
}

/// Name -> path for every leaf of `a::{b, c::{d, e as f}}`.
fn use_tree(tree: &str) -> Vec<(String, Vec<String>)> {
    let tree = tree.trim();
    if let Some((prefix, list)) = tree.split_once('{') {
        let list = list.strip_suffix('}').expect("a list ends with its brace");
        let prefix = path(prefix);
        return split_list(list)
            .into_iter()
            .flat_map(use_tree)
            .map(|(name, rest)| match rest.as_slice() {
                [own] if own == "self" => {
                    (prefix.last().cloned().unwrap_or_default(), prefix.clone())
                }
                _ => (name, [prefix.clone(), rest].concat()),
            })
            .collect();
    }
    let (tree, alias) = tree.split_once(" as ").unwrap_or((tree, ""));
    let path = path(tree);
    let Some(last) = path.last() else {
        return Vec::new();
    };
    let name = if alias.is_empty() { last } else { alias.trim() };
    vec![(name.to_owned(), path.clone())]
}

/// The parts between the commas that are in no inner braces.
fn split_list(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&list[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&list[start..]);
    parts.retain(|part| !part.trim().is_empty());
    parts
}

fn path(text: &str) -> Vec<String> {
    text.split("::").map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()).collect()
}

/// Every path and name in code.
fn paths(text: &str) -> Vec<Vec<String>> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'))
        .map(path)
        .filter(|p| !p.is_empty())
        .collect()
}

/// The largest groups of files that all lead to each other.
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

fn describe(files: &BTreeSet<String>, graph: &BTreeMap<String, BTreeSet<String>>) -> String {
    let lines = files.iter().map(|file| {
        let to: Vec<&str> = graph[file].intersection(files).map(String::as_str).collect();
        format!("    {file} -> {}", to.join(", "))
    });
    format!("  circle of {}:\n{}", files.len(), lines.collect::<Vec<_>>().join("\n"))
}
