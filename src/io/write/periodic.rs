//! Periodic pairs of labels in a written mesh: a section of Gmsh 4.1, arrays for NumPy, a table beside all others (Gmsh does not take the
//! section from binary files of version 2.2).

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::error::Result;
use super::merged::Merged;
use super::midpoints::{FACE_EDGES, Midpoints};
use super::output_files::OutputFiles;
use super::stream::Stream;
use tetdb_base::storage::StorageError;
use tetdb_schema::periodic::PeriodicRow;
use tetdb_store::sealed::input_index;

/// Bytes for each pair of vertices: the pair, with midpoints four times as many, and their tables.
const BYTES_EACH: u64 = 600;

/// A periodic pair of labels: its vertices and midpoints.
pub(super) struct PeriodicLink {
    pub row: PeriodicRow,
    /// A node of the first label and its partner, ascending by partner.
    pub nodes: Vec<[u64; 2]>,
}

/// The periodic pairs whose vertices are written.
#[derive(Default)]
pub(super) struct WrittenPeriodic(pub Vec<PeriodicLink>);

impl WrittenPeriodic {
    /// Gathers the pairs of nodes of which both are written, within `memory` bytes. Errors: more is needed; damage, the disk.
    pub fn gather(mesh: &mut Merged, midpoints: Option<&Midpoints>, memory: u64) -> Result<Self> {
        let rows = mesh.store.periodic()?;
        let needed = BYTES_EACH * rows.iter().map(|row| row.vertices).sum::<u64>();
        if needed > memory {
            let what = "periodic pairs of vertices";
            return Err(StorageError::Budget { what, needed, available: memory }.into());
        }
        let mut lists = Vec::new();
        for row in &rows {
            lists.push(mesh.store.periodic_vertices(row)?);
        }
        let all = lists.iter().flatten().flatten();
        let mut numbers: HashMap<u32, Option<u64>> = all.map(|&index| (index, None)).collect();
        if !numbers.is_empty() {
            mesh.vertices(|number, vertex| {
                let index = input_index(vertex.id);
                if let Some(found) = index.and_then(|index| numbers.get_mut(&index)) {
                    *found = found.or(Some(number));
                }
                Ok(())
            })?;
        }
        let number = |index: u32| numbers.get(&index).copied().flatten();
        let links = rows.into_iter().zip(lists).map(|(row, list)| {
            let nodes = list.into_iter().filter_map(|[a, b]| Some([number(a)?, number(b)?]));
            PeriodicLink { row, nodes: nodes.collect() }
        });
        let mut links = Self(links.collect());
        if let Some(midpoints) = midpoints {
            links.add_midpoints(mesh, midpoints)?;
        }
        links.0.retain(|link| !link.nodes.is_empty());
        links.0.iter_mut().for_each(|link| link.nodes.sort_unstable_by_key(|pair| pair[1]));
        Ok(links)
    }

    /// Adds the midpoints of edges whose ends are paired.
    fn add_midpoints(&mut self, mesh: &Merged, midpoints: &Midpoints) -> Result<()> {
        let first = mesh.n_vertices();
        for link in &mut self.0 {
            let partners: HashMap<u64, u64> = link.nodes.iter().map(|&[a, b]| (a, b)).collect();
            // Midpoints of each label by the ends of their edges, those of the first label by the partners.
            let mut middles = [BTreeMap::new(), BTreeMap::new()];
            let mut edges = midpoints.faces()?;
            mesh.faces().each(|face| {
                let numbers = edges.next()?;
                let Some(side) = link.row.labels.iter().position(|&l| l == face.label) else {
                    return Ok(());
                };
                for (edge, middle) in FACE_EDGES.into_iter().zip(numbers) {
                    let mut ends = edge.map(|i| face.vertices[i]);
                    if side == 0 {
                        // On the axis of a rotation a vertex is its own partner.
                        ends = ends.map(|v| partners.get(&v).copied().unwrap_or(v));
                    }
                    ends.sort_unstable();
                    middles[side].insert(ends, first + middle);
                }
                Ok(())
            })?;
            let [from, to] = &middles;
            let pairs = to.iter().filter_map(|(ends, &b)| Some([*from.get(ends)?, b]));
            link.nodes.extend(pairs.filter(|[a, b]| a != b));
        }
        Ok(())
    }

    /// For each node that is in a pair the least number of all nodes that are one with it, over all pairs of labels.
    pub fn least(&self) -> HashMap<u64, u64> {
        let mut least = HashMap::new();
        fn root(least: &HashMap<u64, u64>, mut v: u64) -> u64 {
            while let Some(&next) = least.get(&v).filter(|&&next| next != v) {
                v = next;
            }
            v
        }
        for &[a, b] in self.0.iter().flat_map(|link| &link.nodes) {
            let ends = [root(&least, a), root(&least, b)];
            let low = ends[0].min(ends[1]);
            for v in [a, b].into_iter().chain(ends) {
                least.insert(v, low);
            }
        }
        let nodes: Vec<u64> = least.keys().copied().collect();
        nodes.into_iter().map(|v| (v, root(&least, v))).collect()
    }

    /// Writes `NAME_periodic.csv`: for each pair of nodes the names of the labels, the numbers of both from 0, and the least number of all
    /// nodes that are one with them. Errors: the disk.
    pub fn write_list(&self, mesh: &Merged, outputs: &mut OutputFiles, out: &Path) -> Result<()> {
        if self.0.is_empty() {
            return Ok(());
        }
        let stem = out.file_stem().unwrap_or_default().to_string_lossy();
        let path = outputs.create(&out.with_file_name(format!("{stem}_periodic.csv")), 0)?;
        let mut stream = Stream::open(&path)?;
        stream.text("first,second,vertex,partner,least\n");
        let least = self.least();
        for PeriodicLink { row, nodes } in &self.0 {
            let name =
                |label| mesh.label_name(label).replace('"', "\"\"").replace(['\n', '\r'], " ");
            let [first, second] = row.labels.map(name);
            for [a, b] in nodes {
                stream.text(&format!("\"{first}\",\"{second}\",{a},{b},{}\n", least[a]));
                stream.end()?;
            }
        }
        stream.finish()
    }
}

impl PeriodicLink {
    /// The motion from the first label to the second as a matrix of four rows.
    pub fn matrix(&self) -> [f64; 16] {
        let [x, y, z] = self.row.map;
        let mut all = [0.0; 16];
        all.iter_mut()
            .zip([x, y, z, [0.0, 0.0, 0.0, 1.0]].as_flattened())
            .for_each(|(to, x)| *to = *x);
        all
    }
}
