//! Questions: selecting tetrahedra of a store.

use std::path::Path;

use super::guard::guarded_in;
use super::{AnswerColumn, Condition, Error, Store, VARIABLES};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::RunContext;
use tetdb_schema::code::Code;
pub use tetdb_schema::ids::{TetId, VertexId};
pub use tetdb_store::query::Measures as ChunkCounts;
pub use tetdb_store::query::TetChunk;
use tetdb_store::query::{ChunkedSelection, EXTRA_MAX, Hit, Ordered, QueryError, QuerySession};
use tetdb_store::query::{Selection, Solid};

/// Share of the memory cap for sorting answers. The session holds three quarters of the cap.
const SORTED_SHARE: u64 = 8;
/// Position of quality in [`VARIABLES`].
const QUALITY: usize = 0;

/// Order of sorted answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The least value first.
    Rising,
    /// The greatest value first.
    Falling,
}

/// A question: selects the tetrahedra that fulfill all of its conditions. Without a condition, it selects all.
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// # let mut store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.2")?).create(&path)?;
/// let near = store.query().in_box([0.0; 3], [0.3; 3]).where_("quality < 2 and x > 0.1")?;
/// for hit in near.answers()? {
///     let hit = hit?;
///     assert!(hit.shape.quality < 2.0);
/// }
/// let worst = store.query().order_by("quality", tetdb::Order::Falling)?.limit(3).collect()?;
/// assert_eq!(worst.len(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Query<'s> {
    store: &'s mut Store,
    selection: Selection,
    order: Option<(usize, Order)>,
    limit: Option<usize>,
}

/// A question that is answered chunk by chunk; see [`Query::by_chunk`]. It borrows no store.
pub struct ChunkedQuery(ChunkedSelection);

/// Iterator over the answers, which are found on demand. An error is the last item.
pub struct Answers<'s> {
    context: RunContext,
    found: Option<Hits<'s>>,
    left: usize,
}

type Hits<'s> = Box<dyn Iterator<Item = Result<Hit, QueryError>> + 's>;

impl Store {
    /// Starts a question about tetrahedra.
    pub fn query(&mut self) -> Query<'_> {
        Query::new(self)
    }

    /// Number of chunks that all questions so far have read, and number of all chunks. Errors: as [`Query::answers`].
    pub fn chunk_counts(&mut self) -> Result<ChunkCounts, Error> {
        self.with_session(|session| Ok(session.measures()))
    }
}

impl<'s> Query<'s> {
    pub(super) fn new(store: &'s mut Store) -> Self {
        Self { store, selection: Selection::default(), order: None, limit: None }
    }

    /// Selects tetrahedra that meet the box between two corners.
    pub fn in_box(mut self, low: [f64; 3], high: [f64; 3]) -> Self {
        let [low, high] = [low, high].map(Point::from_array);
        self.selection.solids.push(Solid::Box(Aabb { low, high }));
        self
    }

    /// Selects tetrahedra that meet the ball.
    pub fn in_sphere(mut self, center: [f64; 3], radius: f64) -> Self {
        let center = Point::from_array(center);
        self.selection.solids.push(Solid::Sphere { center, radius });
        self
    }

    /// Selects tetrahedra that meet the plane through `point`.
    pub fn at_plane(mut self, point: [f64; 3], normal: [f64; 3]) -> Self {
        let [point, normal] = [point, normal].map(Point::from_array);
        self.selection.solids.push(Solid::Plane { point, normal });
        self
    }

    /// Selects only tetrahedra that lie completely inside each box and ball.
    pub fn inside(mut self) -> Self {
        self.selection.inside = true;
        self
    }

    /// Selects tetrahedra in one of these sub-domains.
    pub fn in_subdomains(mut self, ranks: &[u32]) -> Self {
        self.selection.subdomains = Some(ranks.to_vec());
        self
    }

    /// Selects tetrahedra in one of these regions. The answers are an error, `no-such-part`, if one of them is not filled.
    pub fn in_regions(mut self, regions: &[u32]) -> Self {
        self.selection.regions = Some(regions.to_vec());
        self
    }

    /// Selects tetrahedra in a region with this name. Errors: `no-such-part`.
    pub fn in_region_called(mut self, name: &str) -> Result<Self, Error> {
        let found = self.store.summary().regions_called(name)?;
        self.selection.regions.get_or_insert_default().extend(found);
        Ok(self)
    }

    /// Selects tetrahedra on an input triangle with one of these labels, or in the groups of one. Labels are positions in
    /// [`Summary::labels`](super::Summary::labels).
    pub fn on_labels(mut self, labels: &[u32]) -> Self {
        self.selection.labels = Some(labels.to_vec());
        self
    }

    /// Selects tetrahedra with a face on the interface of these two sub-domains.
    pub fn on_interface(mut self, low: u32, high: u32) -> Self {
        self.selection.interface = Some([low, high]);
        self
    }

    /// Selects tetrahedra with a vertex on the surface.
    pub fn touching_surface(mut self) -> Self {
        self.selection.touching_surface = true;
        self
    }

    /// Selects tetrahedra with a face on an embedded sheet.
    pub fn touching_sheet(mut self) -> Self {
        self.selection.touching_sheet = true;
        self
    }

    /// Selects tetrahedra that fulfill a condition such as `quality > 6 and region in [1, 2]`.
    ///
    /// Variables: quality, region, subdomain, volume, x, y, z (of the centroid), edge_min, edge_max, angle_min, angle_max (in degrees)
    /// and excess (quality over the least that the faces on the surface allow); fields of the store by name, where those at vertices
    /// stand for their mean; names of regions stand for their numbers.
    ///
    /// Errors: `bad-expression`, with the place.
    pub fn where_(self, condition: &str) -> Result<Self, Error> {
        let condition = self.store.condition_located(condition)?;
        Ok(self.condition(condition))
    }

    /// Selects tetrahedra that fulfill the condition; see [`Query::where_`].
    pub fn condition(mut self, condition: Condition) -> Self {
        self.selection.condition = Some(condition.expression);
        self.selection.condition_extra = condition.extra;
        self
    }

    /// Selects only among these tetrahedra.
    pub fn among(mut self, tets: &[TetId]) -> Self {
        self.selection.tets = Some(tets.to_vec());
        self
    }

    /// Selects tetrahedra that share a face with this one. Replaces any other neighborhood. Errors: `no-such-part`; damage.
    pub fn next_to(mut self, tet: TetId) -> Result<Self, Error> {
        self.selection.sharing =
            Some(self.store.with_session(|session| Ok(session.next_to(tet)?))?);
        Ok(self)
    }

    /// Selects tetrahedra that have all these vertices: the ball of one vertex, the shell of an edge. Replaces any other neighborhood.
    ///
    /// Errors: `no-such-part`; damage.
    pub fn around(mut self, vertices: &[VertexId]) -> Result<Self, Error> {
        self.selection.sharing =
            Some(self.store.with_session(|session| Ok(session.around(vertices)?))?);
        Ok(self)
    }

    /// Also computes [`Hit::excess`] of the answers, which requires reading the faces on the surface.
    pub fn with_excess(mut self) -> Self {
        self.selection.excess = true;
        self
    }

    /// Also reads these columns of fields, which [`Store::answer_columns`] gave.
    pub fn with_columns(mut self, columns: &[AnswerColumn]) -> Result<Self, Error> {
        let known = self.store.field_variables()?;
        for column in columns {
            if let AnswerColumn::Field { name, .. } = column
                && let Some((_, variable)) = known.iter().find(|(other, _)| other == name)
            {
                self.selection.extra.push(variable.clone());
            }
        }
        Ok(self)
    }

    /// Sorts the answers by one of the [`VARIABLES`] of conditions, or by a field. Errors: `bad-query`.
    pub fn order_by(mut self, variable: &str, order: Order) -> Result<Self, Error> {
        let place = match VARIABLES.iter().position(|v| *v == variable) {
            Some(place) => place,
            None => {
                let known = self.store.field_variables()?;
                let Some((_, field)) = known.iter().find(|(name, _)| name == variable) else {
                    let fields = known.iter().map(|(name, _)| &**name);
                    let names: Vec<&str> = VARIABLES.into_iter().chain(fields).collect();
                    let message = format!("{variable}: expected one of {}", names.join(", "));
                    return Err(Error::new(Code::BadQuery, message));
                };
                self.selection.extra.push(field.clone());
                VARIABLES.len() + self.selection.extra.len() - 1
            }
        };
        self.selection.excess |= variable == "excess";
        self.order = Some((place, order));
        Ok(self)
    }

    /// Limits the number of answers to `n`.
    pub fn limit(mut self, n: usize) -> Self {
        self.limit = Some(n);
        self
    }

    /// Errors: `bad-query` for too many columns.
    fn checked(self) -> Result<Self, Error> {
        if self.selection.extra.len() > EXTRA_MAX {
            let message = format!("a question answers with at most {EXTRA_MAX} numbers of fields");
            return Err(Error::new(Code::BadQuery, message).with_help("ask for fewer columns"));
        }
        Ok(self)
    }

    /// Starts the search. Answers are found as they are taken. Errors: damage; too little memory.
    pub fn answers(self) -> Result<Answers<'s>, Error> {
        let settings = self.store.settings();
        let (memory, dir) = (settings.cap()? / SORTED_SHARE, settings.scratch_dir());
        let Self { store, selection, order, limit } = self.checked()?;
        let (context, session) = store.context_and_session()?;
        let context = context.clone();
        let found = guarded_in(&context, || match order {
            None => Ok(Box::new(session.select(selection)?) as Hits),
            Some(order) => sorted(session, selection, order, (limit, memory, &dir)),
        })?;
        Ok(Answers { context, found: Some(found), left: limit.unwrap_or(usize::MAX) })
    }

    /// The chunks that may have answers, in the order of ids; the others need not be read. Order and limit have no meaning here.
    ///
    /// ```
    /// # use tetdb_engine::api as tetdb;
    /// # let dir = tempfile::tempdir()?;
    /// # let path = dir.path().join("box.tetdb");
    /// # let mut store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.2")?).create(&path)?;
    /// let chunks = store.query().where_("quality > 1.5")?.chunks()?;
    /// let mut query = store.query().where_("quality > 1.5")?.by_chunk()?;
    /// for chunk in chunks {
    ///     for hit in query.answers(&mut store, chunk.subdomain, chunk.chunk)? {
    ///         assert!(hit.shape.quality > 1.5);
    ///     }
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    /// Errors: as [`Query::answers`].
    pub fn chunks(self) -> Result<Vec<TetChunk>, Error> {
        let selection = self.selection;
        self.store.with_session(|session| Ok(session.chunks(&selection)?))
    }

    /// A question whose chunks are read one by one, as the caller chooses. Order and limit have no meaning here. Errors: as
    /// [`Query::answers`].
    pub fn by_chunk(self) -> Result<ChunkedQuery, Error> {
        let Self { store, selection, .. } = self.checked()?;
        store.with_session(|session| Ok(ChunkedQuery(ChunkedSelection::new(session, selection)?)))
    }

    /// Collects all answers. Errors: as [`Query::answers`].
    pub fn collect(self) -> Result<Vec<Hit>, Error> {
        self.answers()?.collect()
    }
}

impl ChunkedQuery {
    /// The answers in a chunk of a sub-domain, in the order of ids. `store` is the one that was asked.
    ///
    /// Errors: `no-such-part`; damage; too little memory.
    pub fn answers(
        &mut self,
        store: &mut Store,
        subdomain: u32,
        chunk: u32,
    ) -> Result<Vec<Hit>, Error> {
        store.with_session(|session| Ok(self.0.hits(session, subdomain, chunk)?))
    }
}

/// Sorts the selected tetrahedra. A few of best or worst quality are found without reading all chunks.
fn sorted<'s>(
    session: &'s mut QuerySession,
    selection: Selection,
    (variable, order): (usize, Order),
    (limit, memory, dir): (Option<usize>, u64, &Path),
) -> Result<Hits<'s>, Error> {
    let falls = order == Order::Falling;
    let few = limit.filter(|n| n.saturating_mul(2 * size_of::<Hit>()) as u64 <= memory);
    if let Some(n) = few
        && variable == QUALITY
        && session.has_extremes(&selection)
    {
        return Ok(Box::new(session.extreme(&selection, falls, n)?.into_iter().map(Ok)));
    }
    let selected = session.select(selection)?;
    Ok(Box::new(Ordered::new(selected, variable, falls, dir, memory)?))
}

impl Iterator for Answers<'_> {
    type Item = Result<Hit, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let found = self.found.as_mut().filter(|_| self.left > 0)?;
        self.left -= 1;
        let next = guarded_in(&self.context, || Ok(found.next().transpose()?)).transpose();
        if !matches!(next, Some(Ok(_))) {
            self.found = None;
        }
        next
    }
}
