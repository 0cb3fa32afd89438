//! A model of a 3MF archive: its objects, and where a build places them.

use std::collections::{BTreeMap, BTreeSet};

use super::feed::{parse, quote};
use super::xml::{Lines, Tag, unescaped};
use super::{FilePlace, ReadFault, Result, Spot};
use tetdb_base::geom::Point;

/// Rows of a matrix that is multiplied from the right: three of the axes, then the shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform(pub [f64; 12]);

impl Transform {
    const NONE: Self = Self([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);

    pub fn of(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if *self == Self::NONE {
            return [x, y, z];
        }
        let m = &self.0;
        [0, 1, 2].map(|k| x * m[k] + y * m[3 + k] + z * m[6 + k] + m[9 + k])
    }

    /// This one, then another.
    pub fn then(&self, next: &Self) -> Self {
        let n = &next.0;
        let axis =
            |k: usize, column: usize| (0..3).map(|i| self.0[3 * k + i] * n[3 * i + column]).sum();
        let shift = next.of([self.0[9], self.0[10], self.0[11]]);
        Self(std::array::from_fn(|i| if i < 9 { axis(i / 3, i % 3) } else { shift[i - 9] }))
    }

    /// Returns whether it turns left hands into right ones.
    pub fn is_mirroring(&self) -> bool {
        let axis = |i: usize| Point::new(self.0[i], self.0[i + 1], self.0[i + 2]);
        axis(0).cross(axis(3)).dot(axis(6)) < 0.0
    }
}

/// An object that is placed, or is part of another.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub object: u32,
    /// The part of the archive that has the object, if it is another.
    pub path: Option<String>,
    pub transform: Transform,
    pub place: FilePlace,
}

#[derive(Debug)]
pub(super) enum ObjectContent {
    Mesh {
        points: Vec<[f64; 3]>,
        triangles: Vec<[u32; 3]>,
    },
    Parts(Vec<Placed>),
    /// Something else, by the name of its tag.
    Other(String),
}

#[derive(Debug)]
pub(super) struct Object {
    pub name: String,
    pub is_support: bool,
    pub content: ObjectContent,
    pub place: FilePlace,
}

#[derive(Debug)]
pub(super) struct Model {
    pub unit: String,
    pub objects: BTreeMap<u32, Object>,
    /// Objects in their places, which together are the surface.
    pub items: Vec<Placed>,
    /// Kinds of content that are not read.
    pub left_out: BTreeSet<String>,
}

/// A path within the archive.
fn path_of(text: &str) -> String {
    unescaped(text).trim_start_matches('/').to_owned()
}

impl Model {
    /// The path of the model in the relationships of the archive.
    pub fn start_part(text: &[u8]) -> Option<String> {
        let mut at = 0;
        loop {
            let tag = Tag::next(text, at)?;
            at = tag.end;
            let is_model = tag.get("Type").is_some_and(|kind| kind.ends_with("/3dmodel"));
            if tag.name == "Relationship" && is_model {
                return tag.get("Target").map(path_of);
            }
        }
    }

    /// Paths of other models that this one needs.
    pub fn paths(&self) -> Vec<String> {
        let parts = self.objects.values().flat_map(|object| match &object.content {
            ObjectContent::Parts(parts) => &parts[..],
            _ => &[],
        });
        parts.chain(&self.items).filter_map(|placed| placed.path.clone()).collect()
    }

    pub fn n_meshes(&self) -> usize {
        self.objects.values().filter(|o| matches!(o.content, ObjectContent::Mesh { .. })).count()
    }

    /// All objects that are no part of others, where they are.
    pub fn unplaced(&self) -> Vec<Placed> {
        let mut inner = BTreeSet::new();
        for object in self.objects.values() {
            if let ObjectContent::Parts(parts) = &object.content {
                inner.extend(parts.iter().filter(|p| p.path.is_none()).map(|p| p.object));
            }
        }
        let outer = self.objects.iter().filter(|(id, _)| !inner.contains(id));
        let placed = outer.map(|(&id, object)| Placed {
            object: id,
            path: None,
            transform: Transform::NONE,
            place: object.place.clone(),
        });
        placed.collect()
    }

    /// Reads a model. `file` names it in errors.
    pub fn parse(text: &[u8], path: &str, file: &str) -> Result<Self> {
        let mut parser = ModelParser {
            file,
            lines: Lines::default(),
            object: None,
            is_model: false,
            is_whole: false,
        };
        let mut model = Self {
            unit: "millimeter".to_owned(),
            objects: BTreeMap::new(),
            items: Vec::new(),
            left_out: BTreeSet::new(),
        };
        // The end of content that is not read.
        let mut skipped: Option<&str> = None;
        let mut at = 0;
        while let Some(tag) = Tag::next(text, at) {
            at = tag.end;
            parser.lines.advance(text, at);
            match skipped {
                Some(name) if tag.is_end && tag.name == name => skipped = None,
                Some(_) => {}
                None if !parser.take(&tag, &mut model)? && !tag.is_empty && !tag.is_end => {
                    skipped = Some(tag.name);
                }
                None => {}
            }
        }
        match (parser.is_model, parser.is_whole && parser.object.is_none()) {
            (true, true) => Ok(model),
            (true, false) => Err(parser.expected("the end of the model", "the end of the text")),
            (false, _) => Err(parser.expected("a tag `model`", path)),
        }
    }
}

struct ModelParser<'t> {
    file: &'t str,
    lines: Lines,
    object: Option<(u32, Object)>,
    is_model: bool,
    is_whole: bool,
}

impl ModelParser<'_> {
    fn place(&self) -> FilePlace {
        FilePlace { file: self.file.to_owned(), spot: Spot::Line(self.lines.line()) }
    }

    fn expected(&self, expected: &str, found: &str) -> super::ReadError {
        let (expected, found) = (expected.to_owned(), quote(found.as_bytes()));
        self.place().refuse(ReadFault::Unexpected { expected, found })
    }

    fn number(&self, tag: &Tag, key: &str) -> Result<f64> {
        let word = tag.get(key).unwrap_or_default();
        parse(word.trim().as_bytes()).filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            let found = quote(word.as_bytes());
            self.place().refuse(ReadFault::NotANumber { what: "a coordinate", found })
        })
    }

    fn id(&self, tag: &Tag, key: &str) -> Result<u32> {
        let word = tag.get(key).unwrap_or_default();
        let id = word.trim().parse().ok();
        id.ok_or_else(|| self.expected(&format!("a number as `{key}`"), word))
    }

    /// Takes a tag. Returns false where what is in it is not read.
    fn take(&mut self, tag: &Tag, model: &mut Model) -> Result<bool> {
        match (tag.name, tag.is_end) {
            ("model", false) => {
                self.is_model = true;
                model.unit = unescaped(tag.get("unit").unwrap_or("millimeter"));
            }
            (
                "resources" | "build" | "metadata" | "metadatagroup" | "mesh" | "vertices"
                | "triangles" | "components",
                false,
            ) => {
                if let (Some((_, object)), "mesh") = (&mut self.object, tag.name) {
                    object.content =
                        ObjectContent::Mesh { points: Vec::new(), triangles: Vec::new() };
                }
            }
            ("model", true) => self.is_whole = true,
            ("object", false) => self.begin(tag)?,
            ("object", true) => self.end(model)?,
            ("vertex", false) => {
                let p = [self.number(tag, "x")?, self.number(tag, "y")?, self.number(tag, "z")?];
                if let Some((_, Object { content: ObjectContent::Mesh { points, .. }, .. })) =
                    &mut self.object
                {
                    points.push(p);
                }
            }
            ("triangle", false) => {
                let corners = [self.id(tag, "v1")?, self.id(tag, "v2")?, self.id(tag, "v3")?];
                if tag.get("pid").is_some() || tag.get("p1").is_some() {
                    model.left_out.insert("colors and materials of triangles".to_owned());
                }
                self.add_triangle(corners)?;
            }
            ("component" | "item", false) => {
                let placed = self.placed(tag)?;
                match &mut self.object {
                    None => model.items.push(placed),
                    Some((_, Object { content: ObjectContent::Parts(parts), .. })) => {
                        parts.push(placed)
                    }
                    Some((_, object)) => object.content = ObjectContent::Parts(vec![placed]),
                }
            }
            (_, true) => {}
            (other, false) => {
                let what = match other {
                    "basematerials" | "colorgroup" | "texture2d" | "texture2dgroup"
                    | "compositematerials" | "multiproperties" => "colors and materials".to_owned(),
                    "beamlattice" => "lattices of beams".to_owned(),
                    "trianglesets" => "sets of triangles".to_owned(),
                    "slicestack" => "slices".to_owned(),
                    other => format!("`{other}`"),
                };
                match &mut self.object {
                    Some((_, object)) if matches!(object.content, ObjectContent::Other(_)) => {
                        object.content = ObjectContent::Other(other.to_owned());
                    }
                    _ => drop(model.left_out.insert(what)),
                }
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn begin(&mut self, tag: &Tag) -> Result<()> {
        let id = self.id(tag, "id")?;
        let is_support = tag.get("type").is_some_and(|kind| kind.ends_with("support"));
        let name = unescaped(tag.get("name").unwrap_or_default());
        let content = ObjectContent::Other("object without triangles".to_owned());
        self.object = Some((id, Object { name, is_support, content, place: self.place() }));
        if tag.is_empty {
            return Err(self.expected("an object with content", "an empty one"));
        }
        Ok(())
    }

    fn end(&mut self, model: &mut Model) -> Result<()> {
        let Some((id, object)) = self.object.take() else {
            return Err(self.expected("an object before its end", "none"));
        };
        if let ObjectContent::Mesh { points, triangles } = &object.content {
            let n = points.len();
            if let Some(&v) = triangles.iter().flatten().find(|&&v| v as usize >= n) {
                let (index, high) = (i64::from(v), n as i64 - 1);
                let place = object.place;
                return Err(place.refuse(ReadFault::IndexOutOfRange { index, low: 0, high }));
            }
        }
        match model.objects.insert(id, object) {
            None => Ok(()),
            Some(_) => Err(self.expected("an object with a number of its own", &id.to_string())),
        }
    }

    fn add_triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        if let Some((_, Object { content: ObjectContent::Mesh { triangles, .. }, .. })) =
            &mut self.object
        {
            triangles.push(corners);
        }
        Ok(())
    }

    fn placed(&self, tag: &Tag) -> Result<Placed> {
        let transform = match tag.get("transform") {
            None => Transform::NONE,
            Some(text) => {
                let words = text.split_ascii_whitespace().map(|word| parse(word.as_bytes()));
                let numbers: Option<Vec<f64>> = words.collect();
                let numbers = numbers.filter(|n| n.iter().all(|x| x.is_finite()));
                let matrix = numbers.and_then(|numbers| <[f64; 12]>::try_from(numbers).ok());
                Transform(
                    matrix.ok_or_else(|| self.expected("a transform of twelve numbers", text))?,
                )
            }
        };
        Ok(Placed {
            object: self.id(tag, "objectid")?,
            path: tag.get("path").map(path_of),
            transform,
            place: self.place(),
        })
    }
}
