//! The old mesh with its fields: chunks decoded last within a share of the memory.

use super::overlap::Cutter;
use super::{FieldTransfer, TransferMethod};
use crate::query::{QueryError, QuerySession, chunk_bounds};
use crate::sealed::FieldColumn;
use crate::store::Catalog;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::Budget;
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::field::Scalar;

/// The old mesh, open for one thread.
pub struct OldMesh {
    pub session: QuerySession,
}

/// Vertices or tetrahedra of the new mesh that follow one another.
pub enum TargetSlice<'a> {
    Points(&'a [Point]),
    Tets(&'a [[Point; 4]]),
}

/// Values at some targets.
pub struct TargetValues {
    /// Of each field, value by value.
    pub words: Vec<Vec<u64>>,
    /// TargetSlice outside of the old mesh.
    pub outside: u64,
    /// Volume of the tetrahedra, and what of it the old mesh covers, where that was computed.
    pub volumes: [f64; 2],
    /// Sums of value times volume: of each field, for each component.
    pub integrals: Vec<Vec<f64>>,
}

/// Sums over what tetrahedra of the new mesh share with those of the old.
enum OverlapSums {
    /// Value times volume, by tetrahedron and component.
    Means(Vec<f64>),
    /// The values met by each tetrahedron, with their volume.
    Shares(Vec<Vec<(Vec<u64>, f64)>>),
}

impl OldMesh {
    /// Opens these sub-domains with `bytes` of memory. Errors: damage; too little memory.
    pub fn open(from: &Catalog, rows: &[SubdomainRow], bytes: u64) -> Result<Self, QueryError> {
        let session = QuerySession::open_rows(from.share(), rows.to_vec(), &Budget::new(bytes))?;
        Ok(Self { session })
    }

    /// Chunks of tetrahedra whose boxes meet another, by rank and number, with their boxes.
    pub fn chunks_meeting(&mut self, bounds: &Aabb) -> Result<Vec<(u32, u32, Aabb)>, QueryError> {
        let mut ranks = Vec::new();
        let rows = &self.session.rows;
        self.session.tree.visit(&|b| b.meets(bounds), &mut |i| ranks.push(rows[i].rank));
        let mut chunks = Vec::new();
        for rank in ranks {
            let part = self.session.part(rank)?;
            part.tree.visit(&|b| b.meets(bounds), &mut |chunk| {
                let around = chunk_bounds(&part.subdomain, chunk);
                if around.meets(bounds) {
                    chunks.push((rank, chunk as u32, around));
                }
            });
        }
        Ok(chunks)
    }

    /// The values of fields, all with one method. Errors: damage.
    pub fn values(
        &mut self,
        at: &TargetSlice,
        fields: &[FieldTransfer],
    ) -> Result<TargetValues, QueryError> {
        let method = fields.first().map(|field| field.method);
        match at {
            TargetSlice::Points(points) => self.at_points(points, fields),
            TargetSlice::Tets(tets) if method == Some(TransferMethod::Overlap) => {
                self.by_overlap(tets, fields)
            }
            TargetSlice::Tets(tets) => {
                let cutters: Vec<Cutter> = tets.iter().map(Cutter::new).collect();
                let all: Vec<usize> = (0..tets.len()).collect();
                let mut values = TargetValues::new(fields, &cutters);
                self.at_centroids(tets, &all, fields, &mut values)?;
                values.integrate(fields, &cutters);
                Ok(values)
            }
        }
    }

    fn at_points(
        &mut self,
        points: &[Point],
        fields: &[FieldTransfer],
    ) -> Result<TargetValues, QueryError> {
        let places = self.places(points)?;
        let mut values = TargetValues::new(fields, &[]);
        values.outside = places.iter().filter(|place| place.is_outside).count() as u64;
        for (field, words) in fields.iter().zip(&mut values.words) {
            let is_linear =
                field.method == TransferMethod::Linear && !field.old.number.is_integer();
            for place in &places {
                let file = self.session.field(&field.old, place.rank)?;
                // A vertex that is the point hands on each bit, also of what is not a number.
                let vertex = match is_linear {
                    true => place.shares.iter().position(|&share| share == 1.0),
                    false => Some(place.nearest),
                };
                for component in 0..field.old.components {
                    if let Some(i) = vertex {
                        words.push(file.word(place.nodes[i], component)?);
                        continue;
                    }
                    let mut sum = 0.0;
                    for (node, share) in place.nodes.into_iter().zip(place.shares) {
                        if share != 0.0 {
                            let word = file.word(node, component)?;
                            sum += field.old.number.unpack(word).to_f64() * share;
                        }
                    }
                    words.push(field.word(sum));
                }
            }
        }
        Ok(values)
    }

    fn by_overlap(
        &mut self,
        tets: &[[Point; 4]],
        fields: &[FieldTransfer],
    ) -> Result<TargetValues, QueryError> {
        let cutters: Vec<Cutter> = tets.iter().map(Cutter::new).collect();
        let bounds = cutters.iter().fold(Aabb::EMPTY, |all, cutter| all.union(cutter.bounds));
        let mut covered = vec![0.0; tets.len()];
        let mut sums: Vec<OverlapSums> =
            fields.iter().map(|field| OverlapSums::new(field, tets.len())).collect();
        for (rank, chunk, around) in self.chunks_meeting(&bounds)? {
            let mut near = (0..).zip(&cutters).filter(|(_, cutter)| cutter.bounds.meets(&around));
            let Some(first) = near.next() else { continue };
            let old = self.session.searched(rank, chunk)?;
            let columns = self.columns(fields, rank, chunk)?;
            for (new, cutter) in std::iter::once(first).chain(near) {
                old.tree.visit(&|b| b.meets(&cutter.bounds), &mut |i| {
                    let corners = old.frame.corners(&old.frame.tets[i]);
                    let volume = cutter.overlap(&corners);
                    let [a, b, c, d] = corners;
                    let whole = (b - a).cross(c - a).dot(d - a).abs() / 6.0;
                    if volume > SHARE_MIN * whole.min(cutter.volume()) {
                        covered[new] += volume;
                        for ((sum, field), columns) in sums.iter_mut().zip(fields).zip(&columns) {
                            sum.add(field, new, (columns, i), volume);
                        }
                    }
                });
            }
        }
        let mut values = TargetValues::new(fields, &cutters);
        values.volumes[1] = covered.iter().sum();
        for ((field, words), sum) in fields.iter().zip(&mut values.words).zip(sums) {
            sum.words(field, &covered, words);
        }
        let left: Vec<usize> = (0..tets.len()).filter(|&i| covered[i] == 0.0).collect();
        self.at_centroids(tets, &left, fields, &mut values)?;
        values.integrate(fields, &cutters);
        Ok(values)
    }

    /// Sets the values of some tetrahedra to those at their centroids.
    fn at_centroids(
        &mut self,
        tets: &[[Point; 4]],
        which: &[usize],
        fields: &[FieldTransfer],
        values: &mut TargetValues,
    ) -> Result<(), QueryError> {
        let centroid = |&i: &usize| tets[i].iter().sum::<Point>() * 0.25;
        let places = self.places(&which.iter().map(centroid).collect::<Vec<_>>())?;
        values.outside += places.iter().filter(|place| place.is_outside).count() as u64;
        for (field, words) in fields.iter().zip(&mut values.words) {
            let n = field.old.components as usize;
            words.resize(tets.len() * n, 0);
            for (&i, place) in which.iter().zip(&places) {
                let file = self.session.field(&field.old, place.rank)?;
                for component in 0..n {
                    let column = file.column(place.chunk, component as u32)?;
                    words[i * n + component] = column[place.tet];
                }
            }
        }
        Ok(())
    }

    /// The values of a chunk of tetrahedra: of each field, for each component.
    fn columns(
        &mut self,
        fields: &[FieldTransfer],
        rank: u32,
        chunk: u32,
    ) -> Result<Vec<Vec<FieldColumn>>, QueryError> {
        let mut columns = Vec::new();
        for field in fields {
            let file = self.session.field(&field.old, rank)?;
            let of = (0..field.old.components).map(|component| file.column(chunk, component));
            columns.push(of.collect::<Result<_, _>>()?);
        }
        Ok(columns)
    }

    /// Sums of value times volume over the old mesh: of each field, for each component. Errors: damage.
    pub fn integrals(&mut self, fields: &[FieldTransfer]) -> Result<Vec<Vec<f64>>, QueryError> {
        let mut all = TargetValues::new(fields, &[]).integrals;
        for row in self.session.rows.clone() {
            for chunk in 0..row.chunks[0] {
                let old = self.session.searched(row.rank, chunk)?;
                let corners = |tet| Cutter::new(&old.frame.corners(tet));
                let cutters: Vec<Cutter> = old.frame.tets.iter().map(corners).collect();
                let mut values = TargetValues::new(fields, &cutters);
                for (words, columns) in
                    values.words.iter_mut().zip(self.columns(fields, row.rank, chunk)?)
                {
                    let rows = 0..cutters.len();
                    *words = rows.flat_map(|i| columns.iter().map(move |c| c[i])).collect();
                }
                values.integrate(fields, &cutters);
                add(&mut all, &values.integrals);
            }
        }
        Ok(all)
    }
}

/// Least share of the smaller of two tetrahedra: those that only touch share ten times less by rounding.
const SHARE_MIN: f64 = 1e-13;

/// Adds sums of each field and component.
pub fn add(all: &mut [Vec<f64>], more: &[Vec<f64>]) {
    let pairs = all.iter_mut().flatten().zip(more.iter().flatten());
    pairs.for_each(|(sum, x)| *sum += x);
}

impl TargetValues {
    pub fn new(fields: &[FieldTransfer], cutters: &[Cutter]) -> Self {
        let zeros = |field: &FieldTransfer| vec![0.0; field.old.components as usize];
        Self {
            words: vec![Vec::new(); fields.len()],
            outside: 0,
            volumes: [cutters.iter().map(Cutter::volume).sum(), 0.0],
            integrals: fields.iter().map(zeros).collect(),
        }
    }

    fn integrate(&mut self, fields: &[FieldTransfer], cutters: &[Cutter]) {
        for ((field, words), sums) in fields.iter().zip(&self.words).zip(&mut self.integrals) {
            for (value, cutter) in words.chunks(sums.len()).zip(cutters) {
                for (sum, &word) in sums.iter_mut().zip(value) {
                    *sum += field.old.number.unpack(word).to_f64() * cutter.volume();
                }
            }
        }
    }
}

impl OverlapSums {
    fn new(field: &FieldTransfer, n_tets: usize) -> Self {
        match field.old.number.is_integer() {
            true => Self::Shares(vec![Vec::new(); n_tets]),
            false => Self::Means(vec![0.0; n_tets * field.old.components as usize]),
        }
    }

    /// Adds the value of row `i` of the columns with a volume.
    fn add(
        &mut self,
        field: &FieldTransfer,
        new: usize,
        (columns, i): (&[FieldColumn], usize),
        volume: f64,
    ) {
        match self {
            Self::Means(sums) => {
                let own = sums[new * columns.len()..].iter_mut();
                for (sum, column) in own.zip(columns) {
                    *sum += field.old.number.unpack(column[i]).to_f64() * volume;
                }
            }
            Self::Shares(met) => {
                let is_same = |words: &[u64]| words.iter().zip(columns).all(|(w, c)| *w == c[i]);
                match met[new].iter_mut().find(|(words, _)| is_same(words)) {
                    Some((_, sum)) => *sum += volume,
                    None => met[new].push((columns.iter().map(|c| c[i]).collect(), volume)),
                }
            }
        }
    }

    /// The words of all tetrahedra; any where nothing is covered.
    fn words(self, field: &FieldTransfer, covered: &[f64], words: &mut Vec<u64>) {
        let n = field.old.components as usize;
        match self {
            Self::Means(sums) => {
                let means = sums.chunks(n).zip(covered);
                words.extend(means.flat_map(|(of, v)| of.iter().map(move |s| field.word(s / v))));
            }
            Self::Shares(met) => {
                for mut values in met {
                    // Of equal ones the first.
                    values.sort_by(|a, b| b.1.total_cmp(&a.1));
                    let most = values.into_iter().next();
                    words.extend(most.map_or_else(|| vec![0; n], |(words, _)| words));
                }
            }
        }
    }
}

impl FieldTransfer {
    /// The word of a mean of values.
    fn word(&self, mean: f64) -> u64 {
        self.old.number.pack(Scalar::Float(mean)).expect("a mean of numbers of the type fits it")
    }
}
