//! Size fields of remeshed sub-domains.

use super::shell::{Shell, shells};
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Options;
use crate::pipeline::tree;
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::SubdomainRow;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::{Catalog, StoreError};

use tetdb_base::geom::Point;
use tetdb_base::storage::{Budget, FrozenSpillVec, ScratchSpace, check_cancelled};
use tetdb_kernel::sizing::{
    BackgroundMesh, ExtraSizes, SizeConstraint, SizeField, SizingError, TETS_PER_LOAD, load_of_tet,
};

/// Relative difference below which sizes count as equal for `--changed`. Where two fields have different cells, their values
/// between equal constraints differ by this much.
const SAME: f64 = 0.05;

/// Relative difference below which fields of different options count as equal. With equal constraints they differ by rounding.
const UNCHANGED: f64 = 1e-5;

/// Least number of tetrahedra of a file's mesh that give one length together. Among equal edges lengths of single tetrahedra scatter by
/// 15 %, those of 64 by 2 %; a group is some two edges wide.
const GROUPED_MIN: u64 = 64;
/// Most groups: 10 MB. A group of a thousand tetrahedra, for a mesh of 130 million, is six edges wide.
const GROUPS_MAX: u64 = 1 << 17;

/// Wanted lengths given one by one.
#[derive(Clone, Debug)]
pub enum Values {
    /// One per tetrahedron of the remeshed sub-domains, by rank, each in its sealed order.
    Tets(Vec<f64>),
    /// One per vertex of the only remeshed sub-domain, in its sealed order.
    Vertices(Vec<f64>),
    /// One per vertex of the remeshed sub-domains, by rank, each in its sealed order; elsewhere that of the nearest vertex. A seventh of
    /// the memory of lengths that are linear in tetrahedra.
    Nearest(FrozenSpillVec<f64>),
}

impl Values {
    /// Memory held, in bytes.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Tets(h) | Self::Vertices(h) => 8 * h.len() as u64,
            Self::Nearest(h) => h.bytes() as u64,
        }
    }
}

/// Sizes that replace the recorded ones.
#[derive(Clone, Debug)]
pub struct NewSizes {
    /// A field for the whole surface; `None` for the recorded field of each sub-domain.
    pub field: Option<SizeField>,
    /// The field of the same surface without what is new, where that is not the recorded one: of an imported mesh.
    pub base: Option<SizeField>,
    /// Lengths given one by one, in place of a field.
    pub values: Option<Values>,
    /// Factor for all lengths.
    pub factor: f64,
    /// Least and greatest length; `values` are clamped to them.
    pub limits: [f64; 2],
    /// Slope with which lengths grow from the fixed faces.
    pub beta: f64,
    /// Text of the request, to be recorded.
    pub requested: String,
}

/// Wanted lengths of a sub-domain.
struct Wanted<'a> {
    /// The field with which the sub-domain was last meshed.
    had: &'a SizeField,
    /// The field of the whole surface without and with the new options.
    fields: Option<[&'a SizeField; 2]>,
    /// True if the recorded lengths were measured in an imported mesh, so that they are not those of its surface alone.
    is_of_file: bool,
    /// Factor for all lengths.
    factor: f64,
}

impl SizeConstraint for Wanted<'_> {
    /// Returns the length of the sub-domain's field, except where the new options change the field of the whole surface.
    fn h(&self, p: Point) -> Result<f64, SizingError> {
        let h = match self.fields.map(|fields| fields.map(|field| field.h(p))) {
            Some([whole, new]) if (new - whole).abs() <= UNCHANGED * whole => self.had.h(p),
            Some([_, new]) if !self.is_of_file => new,
            // The file's mesh is finer or coarser than its faces ask for.
            Some([whole, new]) if new < whole => new.min(self.had.h(p)),
            Some([_, new]) => new.max(self.had.h(p)),
            None => self.had.h(p),
        };
        Ok(h * self.factor)
    }

    fn divides(&self, middle: Point, width: f64) -> Option<bool> {
        let new = self.fields.map(|[_, new]| new);
        let answers = [Some(self.had), new].map(|field| field?.divides(middle, width));
        // Where lengths change from one field to the other, only their values decide.
        match (answers, self.fields) {
            ([Some(true), _] | [_, Some(true)], _) => Some(true),
            (_, Some([whole, _])) if !std::ptr::eq(self.had, whole) => None,
            ([had, _], None) => had,
            ([had, new], _) => had.and(new),
        }
    }
}

/// Scratch space with the remaining budget, for arrays of size fields.
pub fn room(catalog: &Catalog, budget: &Budget) -> Result<ScratchSpace, PipelineError> {
    // A store without the writer's lock may be on a read-only disk.
    let folder = match catalog.lock() {
        Some(_) => catalog.scratch_dir()?,
        None => std::env::temp_dir().into(),
    };
    Ok(ScratchSpace::new(budget.available(), folder))
}

/// Reads the recorded size field of the whole mesh. That of an imported store comes from the edges of all shells and the mesh of the file.
pub fn recorded_field(
    catalog: &mut Catalog,
    options: &Options,
    room: &ScratchSpace,
) -> Result<SizeField, PipelineError> {
    let bytes = match catalog.blob(Blob::SizeField)? {
        Some(bytes) => bytes,
        None if catalog.job()?.is_imported() => {
            let (surface, sizes) = (shells(catalog, room)?, &options.mesh.sizes);
            let _held = room.lease(surface.bytes());
            let (points, triangles) = (&surface.points, &surface.triangles);
            let rows = catalog.subdomains()?;
            let n_tets = rows.iter().map(|row| row.tets).sum::<u64>();
            let grouped = GROUPED_MIN.max(n_tets / GROUPS_MAX);
            let bytes = BackgroundMesh::bytes(n_tets / grouped + GROUPS_MAX / 8, 0);
            let _lengths = room.lease(bytes as usize);
            let lengths = lengths_of_mesh(catalog, &rows, grouped as usize, room)?;
            let extra = ExtraSizes { constraints: &[&lengths], ..ExtraSizes::default() };
            return Ok(SizeField::build_with(points, triangles, sizes, &extra, room)?.0);
        }
        None => Vec::new(),
    };
    let diagonal = tree::bounds(catalog)?.diagonal();
    let field = SizeField::from_bytes_in(&bytes, room)?;
    Ok(field.with_sources(&options.mesh.sizes, diagonal)?)
}

/// Lengths at which each place gets about as many tetrahedra as it has: those of the nearest group of so many that follow one another.
fn lengths_of_mesh(
    catalog: &mut Catalog,
    rows: &[SubdomainRow],
    grouped: usize,
    room: &ScratchSpace,
) -> Result<BackgroundMesh, PipelineError> {
    let (mut points, mut lengths) = (Vec::new(), Vec::new());
    for row in rows {
        let mut part = catalog.open_subdomain(row.rank, (room.available() / 4) as usize)?;
        for chunk in 0..part.tet_summaries().len() as u32 {
            check_cancelled();
            for group in part.tet_chunk(chunk)?.records.chunks(grouped) {
                let n = group.len() as f64;
                let (mut volume, mut center) = (0.0, Point::ZERO);
                for tet in group {
                    let [a, b, c, d] = part.corners(tet.nodes)?.map(|c| c.point);
                    volume += (b - a).dot((c - a).cross(d - a)) / 6.0;
                    center += (a + b + c + d) / (4.0 * n);
                }
                points.push(center);
                lengths.push((TETS_PER_LOAD * volume / n).cbrt().max(f64::MIN_POSITIVE));
            }
        }
    }
    Ok(BackgroundMesh::new(points, Vec::new(), lengths))
}

/// Size fields as recorded in the catalog.
pub struct Recorded<'a> {
    pub whole: &'a SizeField,
    /// Scratch space for arrays of fields, and for fields that are built.
    pub room: &'a ScratchSpace,
}

impl Recorded<'_> {
    /// Returns the field with which a sub-domain was last meshed, if it has one of its own.
    pub fn own(
        &self,
        catalog: &mut Catalog,
        rank: u32,
    ) -> Result<Option<SizeField>, PipelineError> {
        match catalog.blob(Blob::SubdomainField(rank))? {
            Some(bytes) => Ok(Some(SizeField::from_bytes_in(&bytes, self.room)?)),
            None => Ok(None),
        }
    }

    /// Builds the field with which `rank` is to be remeshed; `None` for the field of the whole. `from` is the index of its first
    /// length in lengths given one by one.
    ///
    /// If the constraint equals the current lengths, the result equals the current field bit for bit.
    ///
    /// Errors: a wrong number of lengths; sizes that make no sense; damage.
    pub fn build_new(
        &self,
        catalog: &mut Catalog,
        rank: u32,
        sizes: &NewSizes,
        from: usize,
        memory: u64,
    ) -> Result<Option<SizeField>, PipelineError> {
        let own = self.own(catalog, rank)?;
        let had = own.as_ref().unwrap_or(self.whole);
        let background;
        let wanted;
        let wish: &dyn SizeConstraint = match &sizes.values {
            Some(values) => {
                background = on_mesh(catalog, rank, sizes, values, from, memory)?;
                &background
            }
            None => {
                wanted = self.wanted(had, sizes);
                &wanted
            }
        };
        let (points, triangles) = skin(catalog, rank, memory)?;
        let made = had.within(&points, &triangles, wish, sizes.beta, self.room)?;
        Ok(made.or(own))
    }

    fn wanted<'b>(&'b self, had: &'b SizeField, sizes: &'b NewSizes) -> Wanted<'b> {
        Wanted {
            had,
            fields: sizes
                .field
                .as_ref()
                .map(|new| [sizes.base.as_ref().unwrap_or(self.whole), new]),
            is_of_file: sizes.base.is_some(),
            factor: sizes.factor,
        }
    }

    /// Returns true if the new sizes of a sub-domain differ from its current ones by more than [`SAME`] at some vertex.
    pub fn differs(
        &self,
        catalog: &mut Catalog,
        rank: u32,
        sizes: &NewSizes,
        memory: u64,
    ) -> Result<bool, PipelineError> {
        // A repeated request changes nothing, whatever mesh it gave the first time.
        let requested = catalog.blob(Blob::Request(rank))?;
        if sizes.factor == 1.0 && requested.as_deref() == Some(sizes.requested.as_bytes()) {
            return Ok(false);
        }
        let own = self.own(catalog, rank)?;
        // A sub-domain with a field of its own blends both fields near its skin, so the blended field is compared.
        let made;
        let wanted;
        let (old, new): (&SizeField, &dyn SizeConstraint) = match &own {
            Some(own) => {
                made = self.build_new(catalog, rank, sizes, 0, memory)?;
                (own, made.as_ref().unwrap_or(own))
            }
            None => {
                wanted = self.wanted(self.whole, sizes);
                (self.whole, &wanted)
            }
        };
        let mut part = catalog.open_subdomain(rank, memory as usize)?;
        for chunk in part.vertex_chunks() {
            check_cancelled();
            for vertex in chunk?.records {
                let p = Point::from_array(vertex.point);
                let (old, new) = (old.h(p), new.h(p)?);
                if (new - old).abs() > SAME * old {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }
}

/// Predicted number of tetrahedra of a sub-domain meshed with `new`: its current number times the ratio of the loads
/// under `new` and `old`. Of large sub-domains some tetrahedra are sampled.
pub fn predicted(
    catalog: &mut Catalog,
    rank: u32,
    [old, new]: [&SizeField; 2],
    memory: u64,
) -> Result<f64, PipelineError> {
    const SAMPLED: u64 = 1 << 20;
    let mut part = catalog.open_subdomain(rank, memory as usize)?;
    let tets = part.row().tets as f64;
    let step = (part.row().tets / SAMPLED).max(1) as usize;
    let mut loads = [0.0; 2];
    for chunk in 0..part.tet_summaries().len() as u32 {
        check_cancelled();
        for tet in part.tet_chunk(chunk)?.records.into_iter().step_by(step) {
            let points = part.corners(tet.nodes)?.map(|c| c.point);
            let [a, b, c, d] = points;
            let volume = (b - a).dot((c - a).cross(d - a)) / 6.0;
            for (load, field) in loads.iter_mut().zip([old, new]) {
                *load += load_of_tet(volume, points.map(|p| field.h(p)));
            }
        }
    }
    // A sub-domain with a load close to zero consists of its skin alone.
    let ratio = loads[1].max(1.0 / TETS_PER_LOAD) / loads[0].max(1.0 / TETS_PER_LOAD);
    Ok(tets * ratio)
}

/// Turns lengths given one by one into a background mesh; lengths of tetrahedra become means at vertices.
fn on_mesh(
    catalog: &mut Catalog,
    rank: u32,
    sizes: &NewSizes,
    values: &Values,
    from: usize,
    memory: u64,
) -> Result<BackgroundMesh, PipelineError> {
    let mut part = catalog.open_subdomain(rank, memory as usize)?;
    let (n_tets, n_vertices) = (part.row().tets as usize, part.row().vertices as usize);
    let [low, high] = sizes.limits;
    let length = |h: f64| (h * sizes.factor).clamp(low, high);
    let mut points = Vec::with_capacity(n_vertices);
    for chunk in part.vertex_chunks() {
        points.extend(chunk?.records.iter().map(|v| Point::from_array(v.point)));
    }
    let mut tets = Vec::new();
    if !matches!(values, Values::Nearest(_)) {
        tets.reserve_exact(n_tets);
        for chunk in part.tet_chunks() {
            check_cancelled();
            tets.extend(chunk?.records.iter().map(|t| t.nodes));
        }
    }
    let h = match values {
        Values::Nearest(h) => (from..from + n_vertices).map(|i| length(h.get(i))).collect(),
        Values::Vertices(h) => h[from..from + n_vertices].iter().map(|&h| length(h)).collect(),
        Values::Tets(h) => {
            let mut sums = vec![(0.0, 0u32); n_vertices];
            for (tet, &h) in tets.iter().zip(&h[from..from + n_tets]) {
                for &v in tet {
                    let sum = &mut sums[v as usize];
                    *sum = (sum.0 + length(h), sum.1 + 1);
                }
            }
            // A vertex without a tetrahedron lies where the size of no point is evaluated.
            let mean = |&(sum, n): &(f64, u32)| if n > 0 { sum / f64::from(n) } else { 1.0 };
            sums.iter().map(mean).collect()
        }
    };
    Ok(BackgroundMesh::new(points, tets, h))
}

/// Returns the fixed faces of a sub-domain: input triangles and interface faces, as triangles that index the returned points.
fn skin(
    catalog: &mut Catalog,
    rank: u32,
    memory: u64,
) -> Result<(Vec<Point>, Vec<[u32; 3]>), PipelineError> {
    if catalog.coarse_snapshot(rank)?.is_none() {
        let shell = Shell::read(&mut catalog.open_subdomain(rank, (memory / 2) as usize)?)?;
        return Ok((shell.points(), shell.triangles));
    }
    let mut leaf = catalog.open_coarse(rank, (memory / 2) as usize)?;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for chunk in leaf.vertices() {
        points.extend(chunk?.records.iter().map(|v| Point::from_array(v.point)));
    }
    for chunk in leaf.facets() {
        let filled = chunk?.records.into_iter().filter(|f| f.regions != [0, 0]);
        triangles.extend(filled.map(|f| f.vertices));
    }
    for chunk in leaf.faces() {
        triangles.extend(chunk?.records.iter().map(|f| f.vertices));
    }
    let n = points.len() as u32;
    if triangles.iter().flatten().any(|&v| v >= n) {
        return Err(StoreError::Sealed(SealedError::Content {
            path: catalog.dir().to_owned(),
            subdomain: rank,
            what: "its coarse snapshot has a face without its vertices".to_owned(),
        })
        .into());
    }
    Ok((points, triangles))
}
