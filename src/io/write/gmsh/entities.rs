//! Labels and regions, and what of them lies in which partition.

use std::collections::{BTreeMap, BTreeSet};

use super::super::error::Result;
use super::super::merged::Merged;
use super::super::names::quotable;
use super::out::Out;

/// The least and the greatest coordinates.
type Bounds = [[f64; 3]; 2];

/// What is written: of each label and region, the elements in each partition. The place of an entity counts surfaces, then volumes.
pub(super) struct Entities {
    /// Label and rank, ascending, and how many faces.
    surfaces: Vec<((u32, u32), u64)>,
    /// Region and rank, ascending, and how many tetrahedra.
    volumes: Vec<((u32, u32), u64)>,
    /// Of all that is written; it bounds every entity, if not closely.
    bounds: Bounds,
    is_partitioned: bool,
}

impl Entities {
    /// Counts those of the sub-domains at places `which`. Errors: damage, the disk.
    pub fn gather(mesh: &mut Merged, which: &[usize]) -> Result<Self> {
        let parts = mesh.parts();
        let ranks: BTreeSet<u32> = which.iter().map(|&p| parts[p].rank).collect();
        let mut surfaces = BTreeMap::<_, u64>::new();
        mesh.faces().each(|face| {
            if ranks.contains(&face.subdomain) {
                *surfaces.entry((face.label, face.subdomain)).or_default() += 1;
            }
            Ok(())
        })?;
        let mut volumes = BTreeMap::<_, u64>::new();
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for &p in which {
            let mut part = mesh.open_part(p)?.part;
            let rank = parts[p].rank;
            for chunk in 0..part.tet_summaries().len() {
                let summary = part.tet_summaries()[chunk];
                let [low, high] = &mut bounds;
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
        Ok(Self {
            surfaces: surfaces.into_iter().collect(),
            volumes: volumes.into_iter().collect(),
            bounds,
            is_partitioned: parts.len() > 1,
        })
    }

    pub fn n_faces(&self) -> u64 {
        self.surfaces.iter().map(|s| s.1).sum()
    }

    pub fn n_tets(&self) -> u64 {
        self.volumes.iter().map(|v| v.1).sum()
    }

    pub fn is_partitioned(&self) -> bool {
        self.is_partitioned
    }

    /// The place of a surface, if it is written.
    pub fn surface(&self, label: u32, rank: u32) -> Option<u32> {
        let found = self.surfaces.binary_search_by_key(&(label, rank), |s| s.0);
        found.ok().map(|place| place as u32)
    }

    /// The regions of a sub-domain, with the places of its volumes.
    pub fn volumes_of(&self, rank: u32) -> BTreeMap<u32, u32> {
        let all = (self.surfaces.len() as u32..).zip(&self.volumes);
        let of_rank = all.filter(|(_, (key, _))| key.1 == rank);
        of_rank.map(|(place, (key, _))| (key.0, place)).collect()
    }

    /// Dimension and tag of the entity at each place, and how many elements it has.
    pub fn tags(&self) -> Vec<(u32, u32, u64)> {
        let whole = |all: &[((u32, u32), u64)]| all.last().map_or(0, |(key, _)| key.0 + 1);
        let first = whole(&self.surfaces).max(whole(&self.volumes)) + 1;
        let parts = self.surfaces.iter().map(|(key, n)| (2, key.0 + 1, *n));
        let parts = parts.chain(self.volumes.iter().map(|(key, n)| (3, key.0, *n)));
        let tag = |(place, (dim, whole, n))| match self.is_partitioned {
            true => (dim, first + place, n),
            false => (dim, whole, n),
        };
        (0..).zip(parts).map(tag).collect()
    }

    fn labels(&self) -> BTreeSet<u32> {
        self.surfaces.iter().map(|(key, _)| key.0).collect()
    }

    fn regions(&self) -> BTreeSet<u32> {
        self.volumes.iter().map(|(key, _)| key.0).collect()
    }

    pub fn physical_names(&self, mesh: &Merged) -> String {
        let (labels, regions) = (self.labels(), self.regions());
        let mut text = format!("{}\n", labels.len() + regions.len());
        for label in labels {
            text += &format!(
                "2 {} \"{}\"\n",
                label + 1,
                quotable(&mesh.label_name(label))
            );
        }
        for region in regions {
            text += &format!("3 {region} \"{}\"\n", quotable(&mesh.region_name(region)));
        }
        text
    }

    fn put_bounds(&self, out: &mut Out) {
        self.bounds.iter().flatten().for_each(|&x| out.double(x));
    }

    /// Labels and regions as surfaces and volumes: tag, bounds, physical tag; what bounds them is not listed.
    pub fn write_model(&self, out: &mut Out) -> Result<()> {
        let (labels, regions) = (self.labels(), self.regions());
        for n in [0, 0, labels.len(), regions.len()] {
            out.size(n as u64);
        }
        out.end()?;
        for tag in labels.iter().map(|label| label + 1).chain(regions) {
            out.int(tag);
            self.put_bounds(out);
            out.size(1);
            out.int(tag);
            out.size(0);
            out.end()?;
        }
        Ok(())
    }

    /// What of them is in which partition.
    pub fn write_partitioned(&self, out: &mut Out, n_parts: usize, ghosts: bool) -> Result<()> {
        out.size(n_parts as u64);
        let tags = self.tags();
        let first_ghost = tags.iter().map(|t| t.1).max().unwrap_or(0) + 1;
        let n_ghosts = if ghosts { n_parts as u32 } else { 0 };
        out.size(n_ghosts.into());
        for p in 0..n_ghosts {
            out.int(first_ghost + p);
            out.int(p + 1);
        }
        out.end()?;
        for n in [0, 0, self.surfaces.len(), self.volumes.len()] {
            out.size(n as u64);
        }
        out.end()?;
        let keys = self.surfaces.iter().map(|(key, _)| (key.0 + 1, key.1));
        let keys = keys.chain(self.volumes.iter().map(|(key, _)| *key));
        for ((dim, tag, _), (whole, rank)) in tags.into_iter().zip(keys) {
            for n in [tag, dim, whole] {
                out.int(n);
            }
            out.size(1);
            out.int(rank + 1);
            self.put_bounds(out);
            out.size(1);
            out.int(whole);
            out.size(0);
            out.end()?;
        }
        Ok(())
    }
}
