//! 3MF: a zip archive with models as XML. Objects of triangles, or of other objects, are placed by a build.
//!
//! Models may name objects of other parts of the archive (the production extension). Source: the 3MF core specification.
//! The archive and its models are held in memory, within a limit.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io::{BufRead, Cursor, Read};

use super::feed::{Feed, check_point, name};
use super::three_mf_model::{Model, ObjectContent, Placed};
use super::{FilePlace, ReadError, ReadFault, Result, Spot, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

/// Objects in objects at most, and placed objects at most: more are meant to do harm.
const DEPTH_MAX: usize = 64;
const PLACED_MAX: usize = 1 << 20;
/// The model that an archive begins with, unless its relationships name another.
const USUAL_MODEL: &str = "3D/3dmodel.model";

type Archive = zip::ZipArchive<Cursor<Vec<u8>>>;

/// The models of an archive, by their paths.
struct Package {
    file: String,
    models: BTreeMap<String, Model>,
    /// Text of models that may still be unpacked, in bytes.
    bytes_left: u64,
}

pub(super) fn read<R: BufRead>(
    mut feed: Feed<R>,
    limit: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let bytes = feed.rest(limit)?;
    let place = FilePlace { file: feed.file().to_owned(), spot: Spot::File };
    let mut archive = Archive::new(Cursor::new(bytes)).map_err(|e| broken(&place, &e))?;
    let models = BTreeMap::new();
    let mut package = Package { file: place.file.clone(), models, bytes_left: limit };
    let root = package.root(&mut archive)?;
    let mut open = vec![root.clone()];
    while let Some(path) = open.pop() {
        if !package.models.contains_key(&path) {
            let text = package.part(&mut archive, &path)?;
            let file = format!("{}, {path}", package.file);
            let model = Model::parse(&text, &path, &file)?;
            open.extend(model.paths());
            package.models.insert(path, model);
        }
    }
    let placed = package.place_all(&root, target)?;
    package.note(&root, &placed, target);
    let n_settings = names(&archive).filter(|name| is_setting(name)).count();
    if n_settings > 0 {
        let text = "settings of a slicing program in the archive were left out: what only modifies or cuts other parts there is read as a part";
        target.builder.note(NoteKind::Said(text.to_owned()));
    }
    match target.builder.n_file_triangles() {
        0 => Err(place.refuse(ReadFault::Empty)),
        _ => target.builder.end_file().map_err(|source| place.refuse(ReadFault::Surface(source))),
    }
}

/// Names of the parts of an archive.
fn names(archive: &Archive) -> impl Iterator<Item = String> {
    archive.file_names().flatten().map(|name| name.into_owned())
}

fn is_setting(name: &str) -> bool {
    name.starts_with("Metadata/") && name.ends_with(".config")
}

fn broken(place: &FilePlace, error: &dyn std::fmt::Display) -> ReadError {
    let (expected, found) = ("an archive of a 3MF file".to_owned(), error.to_string());
    place.refuse(ReadFault::Unexpected { expected, found })
}

impl Package {
    fn place(&self) -> FilePlace {
        FilePlace { file: self.file.clone(), spot: Spot::File }
    }

    /// The path of the model that the archive begins with.
    fn root(&mut self, archive: &mut Archive) -> Result<String> {
        let is_there = |archive: &Archive, path: &str| {
            names(archive).any(|name| name.eq_ignore_ascii_case(path))
        };
        if is_there(archive, "_rels/.rels") {
            let text = self.part(archive, "_rels/.rels")?;
            if let Some(path) = Model::start_part(&text) {
                return Ok(path);
            }
        }
        Ok(USUAL_MODEL.to_owned())
    }

    /// The content of a part, unpacked. Errors: one that is not there, or is larger than what is left.
    fn part(&mut self, archive: &mut Archive, path: &str) -> Result<Vec<u8>> {
        let place = self.place();
        let found = names(archive).find(|name| name.eq_ignore_ascii_case(path));
        let found = found.ok_or_else(|| {
            let (expected, found) = (format!("a part {path}"), "none in the archive".to_owned());
            place.refuse(ReadFault::Unexpected { expected, found })
        })?;
        let part = archive.by_name(&found).map_err(|e| broken(&place, &e))?;
        let limit = self.bytes_left;
        let too_large = |needed| {
            place.refuse(ReadFault::TooLarge { what: "the models of the archive", needed, limit })
        };
        if part.size() > limit {
            return Err(too_large(part.size()));
        }
        let mut text = Vec::new();
        part.take(limit + 1).read_to_end(&mut text).map_err(|e| broken(&place, &e))?;
        self.bytes_left =
            limit.checked_sub(text.len() as u64).ok_or_else(|| too_large(text.len() as u64))?;
        Ok(text)
    }

    /// Adds the triangles of all placed objects. Returns the objects used, by path and number.
    fn place_all(&self, root: &str, target: &mut SurfaceSink) -> Result<HashSet<(String, u32)>> {
        let model = &self.models[root];
        let all: Vec<Placed> = match model.items.is_empty() {
            false => model.items.clone(),
            true => model.unplaced(),
        };
        let n_meshes = self.models.values().map(Model::n_meshes).sum::<usize>();
        let mut labels = Labels { is_alone: n_meshes == 1, ..Labels::default() };
        let (mut used, mut n_placed) = (HashSet::new(), 0);
        // The last one is placed first: the stack is reversed.
        let mut stack: Vec<(Placed, String, String, usize)> = Vec::new();
        for placed in all.into_iter().rev() {
            stack.push((placed, root.to_owned(), String::new(), 0));
        }
        while let Some((placed, from, named, depth)) = stack.pop() {
            n_placed += 1;
            if depth > DEPTH_MAX || n_placed > PLACED_MAX {
                let what = format!(
                    "objects in more than {DEPTH_MAX} others, or placed more than {PLACED_MAX} times,"
                );
                return Err(placed.place.refuse(ReadFault::Unsupported(what)));
            }
            let path = placed.path.clone().unwrap_or(from);
            let known = self.models.get(&path).and_then(|model| model.objects.get(&placed.object));
            let object = known.ok_or_else(|| {
                let (expected, found) =
                    ("an object that is there", format!("object {}", placed.object));
                placed.place.refuse(ReadFault::Unexpected { expected: expected.to_owned(), found })
            })?;
            used.insert((path.clone(), placed.object));
            let own = name(object.name.as_bytes());
            let named = if own.is_empty() { named } else { own };
            match &object.content {
                _ if object.is_support => {}
                ObjectContent::Mesh { points, triangles } => {
                    let label = labels.of(&named, (&path, placed.object), target);
                    add(points, triangles, &placed, label, target)?;
                }
                ObjectContent::Parts(parts) => {
                    for part in parts.iter().rev() {
                        let transform = part.transform.then(&placed.transform);
                        stack.push((
                            Placed { transform, ..part.clone() },
                            path.clone(),
                            named.clone(),
                            depth + 1,
                        ));
                    }
                }
                ObjectContent::Other(what) => {
                    let what = format!("an object of the kind `{what}`");
                    return Err(object.place.refuse(ReadFault::Unsupported(what)));
                }
            }
        }
        Ok(used)
    }

    /// Notes what was left out.
    fn note(&self, root: &str, used: &HashSet<(String, u32)>, target: &mut SurfaceSink) {
        let mut say = |text: String| target.builder.note(NoteKind::Said(text));
        let model = &self.models[root];
        say(format!("the unit of its coordinates is {}; they are taken as they are", model.unit));
        if model.items.is_empty() {
            say("no build places its objects: all are read".to_owned());
        }
        let all = || {
            self.models
                .iter()
                .flat_map(|(path, model)| model.objects.iter().map(move |(id, o)| (path, id, o)))
        };
        let unused = all().filter(|&(path, &id, o)| {
            matches!(o.content, ObjectContent::Mesh { .. }) && !used.contains(&(path.clone(), id))
        });
        for (n, what) in [
            (unused.count(), "object|that no build places|was|were"),
            (all().filter(|(.., o)| o.is_support).count(), "object|of the type support|was|were"),
        ] {
            let words: Vec<&str> = what.split('|').collect();
            match n {
                0 => {}
                1 => say(format!("1 {} {} {} left out", words[0], words[1], words[2])),
                n => say(format!("{n} {}s {} {} left out", words[0], words[1], words[3])),
            }
        }
        let left_out: std::collections::BTreeSet<&str> = self
            .models
            .values()
            .flat_map(|model| model.left_out.iter().map(String::as_str))
            .collect();
        if !left_out.is_empty() {
            let list: Vec<&str> = left_out.into_iter().collect();
            say(format!("left out: {}", list.join(", ")));
        }
    }
}

/// The labels of objects.
#[derive(Default)]
struct Labels {
    /// The file has one object of triangles.
    is_alone: bool,
    by_object: HashMap<(String, u32, String), u32>,
    n_of_name: HashMap<String, usize>,
}

impl Labels {
    /// The label of an object that is called `named` here. Objects of one name get numbers.
    fn of(&mut self, named: &str, (path, id): (&str, u32), target: &mut SurfaceSink) -> u32 {
        let key = (path.to_owned(), id, named.to_owned());
        if let Some(&label) = self.by_object.get(&key) {
            return label;
        }
        let name = match (named, self.is_alone) {
            ("", true) => String::new(),
            ("", false) => format!("object {id}"),
            (named, _) => named.to_owned(),
        };
        let n = self.n_of_name.entry(name.clone()).or_default();
        *n += 1;
        let label = match *n {
            1 => target.label(&name),
            n => target.label(&format!("{name}~{n}")),
        };
        self.by_object.insert(key, label);
        label
    }
}

fn add(
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    placed: &Placed,
    label: u32,
    target: &mut SurfaceSink,
) -> Result<()> {
    let refuse = |source| placed.place.refuse(ReadFault::Surface(source));
    let first = target.builder.n_file_vertices() as u32;
    let is_mirrored = placed.transform.is_mirroring();
    for p in points {
        let p = Point::from_array(placed.transform.of(*p));
        check_point(p, &placed.place)?;
        target.builder.vertex(p).map_err(refuse)?;
    }
    for &[a, b, c] in triangles {
        let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
        let corners = corners.map(|v| first + v);
        target.builder.polygon(&corners, label).map_err(refuse)?;
    }
    Ok(())
}
