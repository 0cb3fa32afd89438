//! First steps of an import: vertices along the Hilbert curve, checked tetrahedra, their sub-domains.

use std::collections::{BTreeSet, HashMap};

use super::BadMesh;
use super::planes::{Planes, SAMPLE_MAX};
use super::records::{PartTet, SharedVertex};
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::TETS_PER_SUBDOMAIN;
use crate::pipeline::progress::{Event, Watcher};
use tetdb_base::geom::{Aabb, HilbertFrame, Point, counted, orient};
use tetdb_base::storage::{KeyedId, ScratchSpace, Sorter, SpillVec, check_cancelled, map_into};
use tetdb_base::surface::Surface;
use tetdb_io::read::{Groups, RawField};
use tetdb_schema::field::FieldPlace;
use tetdb_schema::ids::SubdomainId;
use tetdb_schema::page::NONE;

/// Tetrahedra processed at once.
pub const AT_ONCE: usize = 1 << 15;
/// Regions keep the numbers of the file up to this one: each number has a row in the catalog.
const REGION_MAX: i64 = 1 << 16;
const TURNED_HELP: &str = "write the mesh with corners in one order throughout; each first face must turn the same way seen from the fourth corner";
const FLAT_HELP: &str = "remove flat tetrahedra, or mesh again";

/// A face that is kept: three vertices, the tetrahedra behind and in front of it, and its number in the surface. [`NONE`] where there is
/// no such tetrahedron or the face is no part of the surface.
pub type Kept = [u32; 6];

/// A checked mesh, ready to be written.
pub struct Placed {
    /// Box of all vertices.
    pub bounds: Aabb,
    /// Number of sub-domains.
    pub n_parts: u32,
    /// Boundary, faces between regions, and the file's triangles.
    pub surface: Surface,
    /// Number and name of each region.
    pub regions: Vec<(u32, String)>,
    /// Notes for the user: vertices left out or joined, tetrahedra turned.
    pub notes: Vec<String>,
    pub(super) points: SpillVec<[f64; 3]>,
    /// Four vertices, region, sub-domain.
    pub(super) tets: SpillVec<[u32; 6]>,
    pub(super) order: Sorter<PartTet>,
    /// The first sub-domain of each vertex.
    pub(super) first_part: SpillVec<u32>,
    pub(super) shared: Sorter<SharedVertex>,
    /// Number in the surface of each vertex, or [`NONE`].
    pub(super) on_surface: SpillVec<u32>,
    pub(super) kept: SpillVec<Kept>,
    pub(super) values: FileValues,
}

/// Values of the file at its vertices and tetrahedra.
pub struct FileValues {
    /// In the order of the file.
    pub fields: Vec<RawField>,
    /// The vertex of the file that stands for each vertex, in the new order; empty where there are no fields.
    pub vertices: SpillVec<u32>,
}

/// Triangles of the file, and what else is kept of it.
pub struct FileTriangles {
    pub regions: Vec<(u32, String)>,
    pub notes: Vec<String>,
    pub triangles: SpillVec<[u32; 4]>,
    pub labels: Groups,
    pub stem: String,
    pub values: FileValues,
}

/// Vertices in their new order.
pub struct Vertices {
    pub points: SpillVec<[f64; 3]>,
    /// From the file's vertices; [`NONE`] for one that no tetrahedron has.
    pub new_of: SpillVec<u32>,
    pub bounds: Aabb,
}

/// Renumbers the used vertices; returns the used regions and the values too. Errors: a vertex that is not there.
pub fn renumber(
    raw: &mut SpillVec<[f64; 3]>,
    tets: &mut SpillVec<[u32; 6]>,
    mut fields: Vec<RawField>,
    space: &ScratchSpace,
    notes: &mut Vec<String>,
) -> Result<(Vertices, BTreeSet<u32>, FileValues), PipelineError> {
    let n = raw.len();
    let mut new_of = space.vec(n, NONE);
    let (mut regions, mut last_region) = (BTreeSet::new(), None);
    for t in 0..tets.len() {
        let [corners @ .., region, _] = tets.get(t);
        if last_region.replace(region) != Some(region) {
            regions.insert(region);
        }
        if let Some(v) = corners.into_iter().find(|&v| v as usize >= n) {
            let what =
                format!("a tetrahedron names vertex {}, and there are {n}", u64::from(v) + 1);
            let help = "write the file again from the program it comes from";
            return Err(BadMesh::new(what, help).at("tetrahedron", t as u64, &[]).into());
        }
        corners.into_iter().for_each(|v| new_of.set(v as usize, 0));
    }
    check_cancelled();
    let mut bounds = Aabb::EMPTY;
    for v in 0..n {
        if new_of.get(v) != NONE {
            bounds = bounds.with(Point::from_array(raw.get(v)));
        }
    }
    let frame = HilbertFrame::new(&bounds);
    let mut sorter = space.sorter_within(space.cap() / 4);
    for v in 0..n {
        if new_of.get(v) != NONE {
            sorter
                .push(KeyedId { key: frame.index(Point::from_array(raw.get(v))), id: v as u32 })?;
        }
    }
    let mut points = space.builder_within(space.available() / 4);
    let mut old_of = space.builder_within(space.available() / 16);
    let (mut n_used, mut n_differ, mut last_key) = (0, 0, None);
    // Vertices of one place of the curve by their coordinates.
    let mut alike: HashMap<[u64; 3], u32> = HashMap::new();
    for record in sorter.finish()? {
        let KeyedId { key, id } = record?;
        n_used += 1;
        let p = raw.get(id as usize);
        if last_key != Some(key) {
            alike.clear();
            last_key = Some(key);
        }
        let fresh = points.len() as u32;
        let new = *alike.entry(p.map(f64::to_bits)).or_insert(fresh);
        if new == fresh {
            points.push(p);
            old_of.push(if fields.is_empty() { NONE } else { id });
        } else if differ(&mut fields, [old_of.get(new as usize), id]) {
            n_differ += 1;
        }
        new_of.set(id as usize, new);
    }
    for (k, text) in [
        (n - n_used, "[vertex belongs|vertices belong] to no tetrahedron and [was|were] left out"),
        (
            n_used - points.len(),
            "[vertex repeats|vertices repeat] the coordinates of another and [was|were] joined to it",
        ),
        (n_differ, "joined [vertex has|vertices have] other values; the first of the file count"),
    ] {
        if k > 0 {
            notes.push(counted(k as u64, text));
        }
    }
    let values = FileValues { fields, vertices: old_of.finish() };
    Ok((Vertices { points: points.finish(), new_of, bounds }, regions, values))
}

/// Returns whether two vertices of the file have different values.
fn differ(fields: &mut [RawField], vertices: [u32; 2]) -> bool {
    fields.iter_mut().filter(|field| field.place == FieldPlace::Vertices).any(|field| {
        let n = field.components as usize;
        let [a, b] = vertices.map(|v| v as usize * n);
        (0..n).any(|k| field.words.get(a + k) != field.words.get(b + k))
    })
}

/// The new number of each group, and number and name of each region. Numbers of the file are kept if they can be.
pub fn region_numbers(groups: &Groups, used: &BTreeSet<u32>) -> (Vec<u32>, Vec<(u32, String)>) {
    let none = (0, String::new());
    let group = |g: u32| groups.list.get(g as usize).unwrap_or(&none);
    let mut order: Vec<u32> = used.iter().copied().collect();
    order.sort_by_key(|&g| group(g).0);
    let keeps = order.iter().all(|&g| (1..REGION_MAX).contains(&group(g).0));
    let mut rank = vec![0; used.last().map_or(0, |last| *last as usize + 1)];
    let mut regions = Vec::new();
    let is_one = order.len() == 1;
    for (k, g) in (1..).zip(order) {
        let (number, name) = group(g);
        let region = if keeps { *number as u32 } else { k };
        rank[g as usize] = region;
        let default = format!("region_{region}");
        let name = match name.as_str() {
            // Where numbers change, that of the file is the name, so that no two regions have one.
            "" if *number != 0 || !(keeps || is_one) => format!("region_{number}"),
            name => name.to_owned(),
        };
        regions.push((region, if name == default { String::new() } else { name }));
    }
    (rank, regions)
}

/// Where the sub-domain of a tetrahedron comes from.
pub enum Parts {
    /// The rank of each part of the file.
    OfFile(Vec<u32>),
    /// Planes for so many sub-domains, once there is a sample.
    Planes(u32, Option<Planes>),
}

impl Parts {
    /// The parts of the file if it has any, else planes for `n` or as many as fit. Errors: too many parts.
    pub fn new(
        n: Option<u32>,
        groups: &Groups,
        tets: &SpillVec<[u32; 6]>,
    ) -> Result<Self, BadMesh> {
        let n_tets = tets.len() as u64;
        let found = match groups.list.len() {
            0 => {
                let auto = (n_tets as f64 / TETS_PER_SUBDOMAIN).ceil() as u32;
                let most = n_tets.min(SAMPLE_MAX) as u32;
                return Ok(Self::Planes(n.unwrap_or(auto).clamp(1, most), None));
            }
            found => found,
        };
        if found > SubdomainId::COUNT_MAX as usize {
            let what = format!("the mesh has {found} parts, more than there can be sub-domains");
            return Err(BadMesh::new(what, "give an array with fewer values for the parts"));
        }
        let mut order: Vec<usize> = (0..found).collect();
        order.sort_by_key(|&g| groups.list[g].0);
        let mut rank = vec![0; found];
        (0..).zip(order).for_each(|(k, g)| rank[g] = k);
        Ok(Self::OfFile(rank))
    }

    pub fn count(&self) -> u32 {
        match self {
            Self::OfFile(ranks) => ranks.len() as u32,
            Self::Planes(n, _) => *n,
        }
    }

    /// The sub-domain of a tetrahedron with this part of the file and these corners.
    pub fn of(&self, group: u32, corners: impl FnOnce() -> [Point; 4]) -> u32 {
        match self {
            Self::OfFile(ranks) => ranks[group as usize],
            Self::Planes(1, _) => 0,
            Self::Planes(_, planes) => planes.as_ref().map_or(0, |p| p.part(middle(&corners()))),
        }
    }
}

fn middle(corners: &[Point; 4]) -> Point {
    corners.iter().sum::<Point>() / 4.0
}

/// Tetrahedra being checked.
pub struct Placing {
    pub vertices: Vertices,
    pub parts_of: Parts,
    /// The new number of each region.
    pub region_rank: Vec<u32>,
}

impl Placing {
    /// Renumbers and checks all tetrahedra, and chooses the planes. If all are negative, they are turned.
    pub fn check(
        &mut self,
        raw: &mut SpillVec<[u32; 6]>,
        space: &ScratchSpace,
        watch: &Watcher,
        notes: &mut Vec<String>,
    ) -> Result<SpillVec<[u32; 6]>, PipelineError> {
        let n = raw.len();
        let mut tets = space.builder_within(space.available() / 4);
        let stride = (n as u64).div_ceil(SAMPLE_MAX) as usize;
        let mut sample = Vec::new();
        let (mut corners, mut signs) = (Vec::new(), Vec::new());
        let mut flat = BadMesh::new("a tetrahedron has no volume", FLAT_HELP);
        let what = "some tetrahedra are turned inside out, others are not";
        let (mut negative, mut first) = (BadMesh::new(what, TURNED_HELP), true);
        for from in (0..n).step_by(AT_ONCE) {
            check_cancelled();
            let done = from as u64;
            watch(Event {
                stage: "check tetrahedra",
                done,
                total: Some(n as u64),
                unit: "tetrahedra",
            });
            corners.clear();
            for t in from..n.min(from + AT_ONCE) {
                let [a, b, c, d, region, part] = raw.get(t);
                let nodes = [a, b, c, d].map(|v| self.vertices.new_of.get(v as usize));
                let four = nodes.map(|v| Point::from_array(self.vertices.points.get(v as usize)));
                if (1..4).any(|i| nodes[..i].contains(&nodes[i])) {
                    let what = "a tetrahedron has one vertex twice, or two at one place";
                    return Err(BadMesh::new(what, FLAT_HELP)
                        .at("tetrahedron", t as u64, &four)
                        .into());
                }
                let [a, b, c, d] = nodes;
                let region = self.region_rank[region as usize];
                tets.push([a, b, c, d, region, part]);
                if t % stride == 0 {
                    sample.push(middle(&four));
                }
                corners.push(four);
            }
            map_into(&corners, &mut signs, |&[a, b, c, d]| orient(a, b, c, d));
            for (t, (sign, four)) in (from as u64..).zip(signs.iter().zip(&corners)) {
                match sign.total_cmp(&0.0) {
                    _ if *sign == 0.0 => flat.add("tetrahedron", t, four),
                    std::cmp::Ordering::Less => negative.add("tetrahedron", t, four),
                    _ => first = false,
                }
            }
        }
        if flat.n > 0 {
            return Err(flat.into());
        }
        if negative.n > 0 && !first {
            return Err(negative.into());
        }
        let mut tets = tets.finish();
        if negative.n > 0 {
            for t in 0..n {
                tets.change(t, |tet| tet.swap(0, 1));
            }
            notes.push("all tetrahedra were turned inside out; they were turned back".to_owned());
        }
        if let Parts::Planes(n, planes) = &mut self.parts_of {
            *planes = Some(Planes::new(*n, &mut sample));
        }
        Ok(tets)
    }
}
