//! Entities: labels and regions, and their parts in the partitions.

use std::collections::{BTreeMap, BTreeSet};

use super::super::embedded::WrittenEmbedded;
use super::super::error::Result;
use super::super::faces::MergedFace;
use super::super::merged::Merged;
use super::super::names::quotable;
use super::out::Out;
use super::piece::GmshPiece;

/// The least and the greatest coordinates.
type Bounds = [[f64; 3]; 2];

/// The entities of a file: for each label and region, the elements in each partition. The place of an entity counts surfaces, then volumes.
///
/// A label behind all others stands for the faces towards a sub-domain. Where that sub-domain is written too, these faces have no physical group
/// and lie in both partitions.
pub(super) struct Entities {
    /// Label and rank, ascending, and the number of faces.
    surfaces: Vec<((u32, u32), u64)>,
    /// Region and rank, ascending, and the number of tetrahedra.
    volumes: Vec<((u32, u32), u64)>,
    /// Bounds of the whole file, which every entity gets.
    bounds: Bounds,
    /// Ranks of all partitions, also of those in other files.
    ranks: Vec<u32>,
    n_labels: u32,
    /// Labels of faces in several groups, with the labels of those.
    sets: BTreeMap<u32, Vec<u32>>,
    /// Embedded edges and points: edges are in a curve for each label, each point is an entity of its own, numbered from 1. A file of one
    /// partition has none.
    pub embedded: WrittenEmbedded,
}

impl Entities {
    /// Counts the entities of a file. Errors: damage, the disk.
    pub fn gather(mesh: &mut Merged, piece: &GmshPiece) -> Result<Self> {
        let parts = mesh.parts();
        let mut entities = Self {
            surfaces: Vec::new(),
            volumes: Vec::new(),
            bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
            ranks: parts.iter().map(|part| part.rank).collect(),
            n_labels: mesh.n_labels(),
            sets: mesh.members(),
            embedded: WrittenEmbedded::default(),
        };
        if piece.which.len() == parts.len() {
            entities.embedded = mesh.embedded().clone();
        }
        let here: BTreeSet<u32> = piece.which.iter().map(|&p| parts[p].rank).collect();
        let mut surfaces = BTreeMap::<_, u64>::new();
        mesh.faces().each(|face| {
            let neighbor = entities.neighbor(face.label);
            if here.contains(&face.subdomain) || neighbor.is_some_and(|n| here.contains(&n)) {
                *surfaces.entry((face.label, face.subdomain)).or_default() += 1;
            }
            Ok(())
        })?;
        let mut volumes = BTreeMap::<_, u64>::new();
        for &p in piece.which {
            let mut part = mesh.open_part(p)?.part;
            let rank = parts[p].rank;
            for chunk in 0..part.tet_summaries().len() {
                let summary = part.tet_summaries()[chunk];
                let [low, high] = &mut entities.bounds;
                for (axis, (low, high)) in low.iter_mut().zip(high).enumerate() {
                    *low = low.min(summary.bounds[0][axis]);
                    *high = high.max(summary.bounds[1][axis]);
                }
                let [least, greatest] = summary.regions;
                if least == greatest {
                    *volumes.entry((least, rank)).or_default() += u64::from(summary.count);
                    continue;
                }
                for tet in part.tet_chunk(chunk as u32)?.records.iter() {
                    *volumes.entry((tet.region, rank)).or_default() += 1;
                }
            }
        }
        volumes.retain(|(region, _), _| mesh.writes(*region));
        piece.each_ghost(|ghost| {
            *volumes.entry((ghost.region, ghost.from)).or_default() += 1;
            Ok(())
        })?;
        entities.surfaces = surfaces.into_iter().collect();
        entities.volumes = volumes.into_iter().collect();
        Ok(entities)
    }

    /// The partition behind faces of this label.
    fn neighbor(&self, label: u32) -> Option<u32> {
        let rank = label.checked_sub(self.n_labels)?;
        self.ranks.contains(&rank).then_some(rank)
    }

    pub fn n_faces(&self) -> u64 {
        self.surfaces.iter().map(|s| s.1).sum()
    }

    pub fn n_tets(&self) -> u64 {
        self.volumes.iter().map(|v| v.1).sum()
    }

    pub fn is_partitioned(&self) -> bool {
        self.ranks.len() > 1
    }

    /// The place of a face's surface, if it is written.
    pub fn surface(&self, face: &MergedFace) -> Option<u32> {
        let key = (face.label, face.subdomain);
        let found = self.surfaces.binary_search_by_key(&key, |s| s.0);
        found.ok().map(|place| place as u32)
    }

    /// The place of a region's volume in a partition, which must have tetrahedra of the region.
    pub fn volume(&self, region: u32, rank: u32) -> u32 {
        let found = self.volumes.binary_search_by_key(&(region, rank), |v| v.0);
        let place = found.expect("regions were counted from the same tetrahedra");
        (self.surfaces.len() + place) as u32
    }

    /// The place of the volume of a partition's only region.
    pub fn only_volume(&self, rank: u32) -> Option<u32> {
        let mut of_rank = self.volumes.iter().filter(|(key, _)| key.1 == rank);
        match (of_rank.next(), of_rank.next()) {
            (Some(((region, _), _)), None) => Some(self.volume(*region, rank)),
            _ => None,
        }
    }

    /// Dimension, tag and number of elements of the entity at each place.
    pub fn tags(&self) -> Vec<(u32, u32, u64)> {
        let whole = |all: &[((u32, u32), u64)]| all.last().map_or(0, |(key, _)| key.0 + 1);
        let first = whole(&self.surfaces).max(whole(&self.volumes)) + 1;
        let parts = self.surfaces.iter().map(|(key, n)| (2, key.0 + 1, *n));
        let parts = parts.chain(self.volumes.iter().map(|(key, n)| (3, key.0, *n)));
        let tag = |(place, (dim, whole, n))| match self.is_partitioned() {
            true => (dim, first + place, n),
            false => (dim, whole, n),
        };
        (0..).zip(parts).map(tag).collect()
    }

    /// The labels with a physical group.
    fn labels(&self) -> BTreeSet<u32> {
        let labels = self.surfaces.iter().map(|(key, _)| key.0);
        labels.filter(|&label| self.neighbor(label).is_none()).collect()
    }

    /// The physical tags of a label.
    fn physical(&self, label: u32) -> Vec<u32> {
        let members = self.sets.get(&label).cloned().unwrap_or_else(|| vec![label]);
        members.into_iter().map(|member| member + 1).collect()
    }

    fn regions(&self) -> BTreeSet<u32> {
        self.volumes.iter().map(|(key, _)| key.0).collect()
    }

    pub fn physical_names(&self, mesh: &Merged) -> String {
        let groups = self.labels().into_iter().flat_map(|label| self.physical(label));
        let groups: BTreeSet<u32> = groups.map(|tag| tag - 1).collect();
        physical_names(mesh, &self.embedded, groups, self.regions())
    }

    fn put_bounds(&self, out: &mut Out) {
        self.bounds.iter().flatten().for_each(|&x| out.double(x));
    }

    /// Writes labels and regions as surfaces and volumes: tag, bounds, physical tags, no bounding entities.
    pub fn write_model(&self, out: &mut Out) -> Result<()> {
        let (labels, regions) = (self.labels(), self.regions());
        let curves = self.embedded.edge_labels();
        let points = &self.embedded.points;
        for n in [points.len(), curves.len(), labels.len(), regions.len()] {
            out.size(n as u64);
        }
        out.end()?;
        for (tag, point) in (1u32..).zip(points) {
            out.int(tag);
            point.point.iter().for_each(|&x| out.double(x));
            out.size(1);
            out.int(point.label + 1);
            out.end()?;
        }
        let curves = curves.into_keys().map(|label| (label + 1, vec![label + 1]));
        let surfaces = labels.iter().map(|&label| (label + 1, self.physical(label)));
        let volumes = regions.into_iter().map(|region| (region, vec![region]));
        for (tag, physical) in curves.chain(surfaces).chain(volumes) {
            out.int(tag);
            self.put_bounds(out);
            out.size(physical.len() as u64);
            physical.into_iter().for_each(|tag| out.int(tag));
            out.size(0);
            out.end()?;
        }
        Ok(())
    }

    /// Writes the parts of labels and regions in the partitions.
    pub fn write_partitioned(&self, out: &mut Out, ghosts: bool) -> Result<()> {
        out.size(self.ranks.len() as u64);
        let tags = self.tags();
        let first_ghost = tags.iter().map(|t| t.1).max().unwrap_or(0) + 1;
        let of_ghosts = if ghosts { &self.ranks[..] } else { &[] };
        out.size(of_ghosts.len() as u64);
        for (tag, rank) in (first_ghost..).zip(of_ghosts) {
            out.int(tag);
            out.int(rank + 1);
        }
        out.end()?;
        for n in [0, 0, self.surfaces.len(), self.volumes.len()] {
            out.size(n as u64);
        }
        out.end()?;
        let (surfaces, volumes) = tags.split_at(self.surfaces.len());
        for ((_, tag, _), ((label, rank), _)) in surfaces.iter().zip(&self.surfaces) {
            match self.neighbor(*label) {
                // Faces between partitions lie in a volume; any region will do.
                Some(other) => {
                    let region = self.regions().first().copied().unwrap_or_default();
                    self.put(out, [*tag, 3, region], &[*rank, other], &[])?;
                }
                None => self.put(out, [*tag, 2, label + 1], &[*rank], &self.physical(*label))?,
            }
        }
        for ((_, tag, _), ((region, rank), _)) in volumes.iter().zip(&self.volumes) {
            self.put(out, [*tag, 3, *region], &[*rank], &[*region])?;
        }
        Ok(())
    }

    /// Writes an entity of partitions: its tag, dimension and tag of its parent, ranks, physical groups.
    fn put(&self, out: &mut Out, head: [u32; 3], ranks: &[u32], physical: &[u32]) -> Result<()> {
        head.into_iter().for_each(|n| out.int(n));
        out.size(ranks.len() as u64);
        ranks.iter().for_each(|rank| out.int(rank + 1));
        self.put_bounds(out);
        out.size(physical.len() as u64);
        physical.iter().for_each(|&tag| out.int(tag));
        out.size(0);
        out.end()
    }
}

/// Number and names of physical groups: points (dimension 0), edges (1) and surfaces (2) by label, volumes (3) by region.
pub(in crate::write) fn physical_names(
    mesh: &Merged,
    embedded: &WrittenEmbedded,
    labels: impl IntoIterator<Item = u32>,
    regions: impl IntoIterator<Item = u32>,
) -> String {
    let points = embedded.point_labels().into_keys().map(|label| (0, label));
    let edges = embedded.edge_labels().into_keys().map(|label| (1, label));
    let surfaces = labels.into_iter().map(|label| (2, label));
    let labelled = points.chain(edges).chain(surfaces);
    let labelled = labelled.map(|(dim, label)| (dim, label + 1, mesh.label_name(label)));
    let volumes = regions.into_iter().map(|region| (3, region, mesh.region_name(region)));
    let lines: Vec<String> = (labelled.chain(volumes))
        .map(|(dim, tag, name)| format!("{dim} {tag} \"{}\"\n", quotable(&name)))
        .collect();
    format!("{}\n{}", lines.len(), lines.concat())
}
