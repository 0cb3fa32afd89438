//! A store to look at again and again: its surfaces, cuts and answers as triangles, and the tetrahedron that is pointed at.

use std::path::Path;

use serde_json::json;

use super::page::{column, edge_bits, of_catalog};
use super::{Code, Error, Scalar, Settings, Store, VARIABLES, guarded};

use crate::view::page::{self, Surface, packed};
use crate::view::{self, Cross, DrawnTets, Patch, Ray};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Budget, attempt};
use tetdb_store::query::{EXTRA_MAX, ExtraVariable, Hit, QuerySession, Selection};

/// Largest number of triangles of a section; more are joined where they are smaller than a pixel of most screens.
const SECTION_MOST: usize = 160_000;
/// Largest number of tetrahedra drawn of an answer.
const ANSWERS_MOST: usize = 20_000;
/// Triangles of a share of a surface: what is read in a quarter of a second.
const SHARE_TRIANGLES: u64 = 200_000;
/// Most shares: each has its part of the triangles that are shown.
const SHARES_MAX: u64 = 16;
/// Memory from which another session is worth its thread.
const SESSION_BYTES: u64 = 64 << 20;
/// Sessions that find more than one thread can draw.
const SESSIONS_MAX: u64 = 8;

/// Triangles to be drawn, with values for each.
///
/// Shape: `triangles[i]` = places in `points`, numbered by first use; all columns and `values`, unless empty, run parallel to it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct DrawnTriangles {
    /// Positions of the vertices.
    pub points: Vec<Point>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Whole numbers of the triangles by name: `subdomain`, `other` (the sub-domain the normal of an interface points into), `region`,
    /// `label`, `edges` (a bit for each edge to draw, opposite its corner).
    pub columns: Vec<(&'static str, Vec<u32>)>,
    /// The value asked for, of the tetrahedron of each triangle.
    pub values: Vec<f32>,
    /// Number of triangles before vertices were joined.
    pub of: u64,
    /// Side of the cells in which vertices were joined, in input units; 0 if none were.
    pub joined: f64,
    /// Number of tetrahedra of the answer, and of those drawn; zeros for surfaces.
    pub tets: [u64; 2],
}

/// A tetrahedron that was pointed at.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PickedTet {
    /// The tetrahedron.
    pub hit: Hit,
    /// Where the ray meets it first.
    pub point: Point,
    /// Values of all columns of fields, by name.
    pub fields: Vec<(String, Scalar)>,
}

/// A store to look at: surfaces, sections and answers as triangles, and the first tetrahedron on a ray.
///
/// Calls answer from what is read already where they can. All is the same for any number of threads and any memory. A call that is
/// cancelled by the token of the settings leaves the viewer usable.
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// # tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.2")?).create(&path)?;
/// let mut viewer = tetdb::Viewer::open(&path, tetdb::Settings::new())?;
/// let half = [[0.5; 3], [1.0, 0.0, 0.0]];
/// let section = viewer.section(half, "quality", None)?;
/// assert_eq!(section.triangles.len(), section.values.len());
/// let picked = viewer.pick([[2.0, 0.4, 0.4], [-1.0, 0.0, 0.0]], Some(half), None, &[])?;
/// assert!((picked.unwrap().point.x - 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Viewer {
    store: Store,
    /// At least one; together they have half of the memory.
    sessions: Vec<QuerySession>,
    /// For triangles.
    budget: Budget,
}

impl Viewer {
    /// Opens a finished store. Errors: as [`Store::open`]; too little memory.
    pub fn open(path: impl AsRef<Path>, settings: Settings) -> Result<Self, Error> {
        let store = Store::open_with(path, settings)?;
        let cap = store.settings().cap()?;
        let most = (cap / 2 / SESSION_BYTES).clamp(1, SESSIONS_MAX);
        let n = most.min(store.settings().n_threads() as u64);
        let sessions = guarded(store.settings(), || {
            let open =
                |_| Ok(QuerySession::open(store.catalog_shared(), &Budget::new(cap / 2 / n))?);
            (0..n).map(open).collect()
        })?;
        Ok(Self { store, sessions, budget: Budget::new(cap / 8 * 3) })
    }

    /// The store.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Numbers of shares in which the boundary and the interfaces are read: one after the other, each is there soon.
    pub fn shares(&self) -> [u32; 2] {
        let rows = &self.store.summary().subdomains;
        let sum = |count: fn(&_) -> u64| rows.iter().map(count).sum::<u64>();
        let shares = |n: u64| n.div_ceil(SHARE_TRIANGLES).clamp(1, SHARES_MAX) as u32;
        [shares(sum(|row| row.facets)), shares(sum(|row| row.interface_faces))]
    }

    /// A share of the input triangles with a tetrahedron on at least one side; columns `subdomain`, `region`, `label`. Large surfaces
    /// are coarsened.
    ///
    /// Errors: `bad-query` for a share that is not there; damage.
    pub fn boundary(&mut self, share: u32) -> Result<DrawnTriangles, Error> {
        let of = known_share(share, self.shares()[0])?;
        self.draw(|sessions, budget| {
            let patch = view::scene(sessions, budget).boundary([share, of])?;
            let columns = vec![
                ("subdomain", column(&patch, |skin| skin.subdomain)),
                ("region", column(&patch, |skin| skin.region)),
                ("label", column(&patch, |skin| skin.label)),
            ];
            Ok(DrawnTriangles::new(patch, columns))
        })
    }

    /// A share of the faces between sub-domains; columns `subdomain`, `other`. Large interfaces are coarsened.
    ///
    /// Errors: `bad-query` for a share that is not there; damage.
    pub fn interfaces(&mut self, share: u32) -> Result<DrawnTriangles, Error> {
        let of = known_share(share, self.shares()[1])?;
        self.draw(|sessions, budget| {
            let patch = view::scene(sessions, budget).interfaces([share, of])?;
            let columns = vec![
                ("subdomain", column(&patch, |ranks| ranks[0])),
                ("other", column(&patch, |ranks| ranks[1])),
            ];
            Ok(DrawnTriangles::new(patch, columns))
        })
    }

    /// The section by a plane, as a point and a normal, of the tetrahedra that fulfill `condition`; columns `subdomain`, `region`,
    /// `edges`. `value` is a variable of conditions or a field; see [`Query::where_`](super::Query::where_). Of large sections,
    /// vertices are joined.
    ///
    /// Errors: `bad-query`, `bad-expression`; damage.
    pub fn section(
        &mut self,
        plane: [[f64; 3]; 2],
        value: &str,
        condition: Option<&str>,
    ) -> Result<DrawnTriangles, Error> {
        let plane = line_of("a plane", plane)?;
        let (mut selection, variable) = self.selection(value, condition)?;
        selection.stays_decoded = true;
        self.draw(|sessions, budget| {
            let of = |hit: &Hit| Some(hit.value(variable) as f32);
            let mut scene = view::scene(sessions, budget);
            Ok(scene.section(plane, selection, &of, SECTION_MOST)?.into())
        })
    }

    /// The tetrahedra that fulfill `condition`, whole: counted, and up to 20,000 of them drawn, spread evenly over the answer. Columns
    /// and `value` as for [`Viewer::section`].
    ///
    /// Errors: `bad-query`, `bad-expression`; damage.
    pub fn answers(&mut self, condition: &str, value: &str) -> Result<DrawnTriangles, Error> {
        let (selection, variable) = self.selection(value, Some(condition))?;
        self.draw(|sessions, budget| {
            let of = |hit: &Hit| Some(hit.value(variable) as f32);
            let mut scene = view::scene(sessions, budget);
            Ok(scene.answers(selection, &of, ANSWERS_MOST)?.into())
        })
    }

    /// The first tetrahedron that a ray, as its end and its direction, meets behind a plane, among those that fulfill `condition` and
    /// are not in the sub-domains `hidden`.
    ///
    /// Errors: `bad-query`, `bad-expression`; damage.
    pub fn pick(
        &mut self,
        ray: [[f64; 3]; 2],
        clip: Option<[[f64; 3]; 2]>,
        condition: Option<&str>,
        hidden: &[u32],
    ) -> Result<Option<PickedTet>, Error> {
        let [origin, direction] = line_of("a ray", ray)?;
        let clip = clip.map(|plane| line_of("a plane", plane)).transpose()?;
        let (mut selection, _) = self.selection(VARIABLES[0], condition)?;
        let ranks = self.store.summary().subdomains.iter().map(|row| row.rank);
        selection.subdomains = Some(ranks.filter(|rank| !hidden.contains(rank)).collect());
        let known = self.store.field_variables()?;
        self.draw(|sessions, _| {
            let session = &mut sessions[0];
            let ray = Ray { origin, direction };
            let Some((distance, hit)) = view::pick(session, &ray, clip, selection)? else {
                return Ok(None);
            };
            let mut fields = Vec::new();
            for known in known.chunks(EXTRA_MAX) {
                let extra = known.iter().map(|(_, variable)| variable.clone()).collect();
                let tets = Some(vec![hit.id]);
                for found in session.select(Selection { tets, extra, ..Selection::default() })? {
                    let values = known.iter().zip(found?.extra);
                    fields.extend(values.map(|((name, _), value)| (name.clone(), value)));
                }
            }
            Ok(Some(PickedTet { hit, point: origin + direction * distance, fields }))
        })
    }

    /// Tetrahedra with a value and a condition, and the place of the value.
    fn selection(&self, value: &str, condition: Option<&str>) -> Result<(Selection, usize), Error> {
        let mut selection = Selection { excess: value == "excess", ..Selection::default() };
        if let Some(text) = condition {
            let condition = self.store.condition_located(text)?;
            selection.condition = Some(condition.expression);
            selection.condition_extra = condition.extra;
        }
        let variable = match VARIABLES.iter().position(|name| *name == value) {
            Some(place) => place,
            None => {
                let field: ExtraVariable = self.store.field_variable(value)?;
                selection.extra.push(field);
                VARIABLES.len()
            }
        };
        Ok((selection, variable))
    }

    fn draw<T>(
        &mut self,
        work: impl FnOnce(&mut [QuerySession], &Budget) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let Self { store, sessions, budget } = self;
        guarded(store.settings(), || attempt(|| work(sessions, budget))?)
    }

    /// The page that shows the store: it carries what the catalog says and `token`, and only scripts and styles with `nonce`.
    #[doc(hidden)]
    pub fn page(&mut self, token: &str, nonce: &str) -> Result<String, Error> {
        let (store, bounds) = (&self.store, self.sessions[0].bounds());
        let title = store.path().file_stem().unwrap_or_default().to_string_lossy();
        let fields = store.fields()?;
        let shares = self.shares();
        let mut data = guarded(store.settings(), || {
            of_catalog(store.path(), &mut store.catalog_shared(), &title)
        })?;
        data["scene"] = json!({ "low": bounds.low.to_array(), "high": bounds.high.to_array() });
        data["fields"] = json!(fields);
        data["variables"] = json!(VARIABLES);
        data["shares"] = json!({ "boundary": shares[0], "interfaces": shares[1] });
        data["token"] = json!(token);
        Ok(page::live(&title, &data, nonce))
    }

    /// Triangles for the page: a line of JSON, then the packed surface, then the values as 32-bit numbers.
    #[doc(hidden)]
    pub fn message(&self, drawn: &DrawnTriangles) -> Vec<u8> {
        let channels: Vec<Vec<u32>> = drawn.columns.iter().map(|(_, list)| list.clone()).collect();
        let (points, triangles) = (&drawn.points[..], &drawn.triangles[..]);
        let surface = Surface { points, triangles, channels: &channels };
        let surface = packed(&surface, &self.sessions[0].bounds());
        let is_number = |x: &&f32| x.is_finite();
        let least = drawn.values.iter().filter(is_number).copied().reduce(f32::min);
        let most = drawn.values.iter().filter(is_number).copied().reduce(f32::max);
        let head = json!({
            "columns": drawn.columns.iter().map(|(name, _)| name).collect::<Vec<_>>(), "bytes": surface.len(),
            "values": drawn.values.len(), "range": [least, most], "shown": triangles.len(), "of": drawn.of,
            "joined": drawn.joined, "tets": drawn.tets[0], "drawn": drawn.tets[1],
        });
        let values = drawn.values.iter().flat_map(|value| value.to_le_bytes());
        format!("{head}\n").into_bytes().into_iter().chain(surface).chain(values).collect()
    }
}

impl DrawnTriangles {
    fn new<T>(patch: Patch<T>, columns: Vec<(&'static str, Vec<u32>)>) -> Self {
        let Patch { points, triangles, cell: joined, of, .. } = patch;
        Self { points, triangles, columns, values: Vec::new(), of, joined, tets: [0; 2] }
    }
}

impl From<DrawnTets> for DrawnTriangles {
    fn from(DrawnTets { patch, tets, drawn }: DrawnTets) -> Self {
        let columns = vec![
            ("subdomain", column(&patch, |cross: &Cross| cross.subdomain)),
            ("region", column(&patch, |cross| cross.region)),
            ("edges", column(&patch, edge_bits)),
        ];
        let values = patch.tags.iter().map(|cross| cross.quality).collect();
        Self { values, tets: [tets, drawn], ..Self::new(patch, columns) }
    }
}

/// A point and a direction. Errors: numbers that are not finite; a direction without length.
fn line_of(what: &str, line: [[f64; 3]; 2]) -> Result<[Point; 2], Error> {
    let [point, direction] = line.map(Point::from_array);
    // Directions are scaled, so that no product of theirs is too large or too small.
    let direction = direction / direction.abs().max_element();
    if point.is_finite() && direction.is_finite() {
        return Ok([point, direction]);
    }
    let message = format!(
        "{what}: expected a point and a direction, six finite numbers, the last three not all zero"
    );
    Err(Error::new(Code::BadQuery, message))
}

fn known_share(share: u32, of: u32) -> Result<u32, Error> {
    match share < of {
        true => Ok(of),
        false => Err(Error::new(Code::BadQuery, format!("share {share}: expected one below {of}"))),
    }
}
