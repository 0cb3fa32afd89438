//! One sub-domain: saturated, optimized and sealed alone, by a worker of its own.

use std::collections::BTreeMap;
use std::time::Instant;

use tetdb_schema::digest::Digest;
use tetdb_schema::ids::SubdomainId;

use super::divide::{WORK, open_part};
use super::fine::{FineReport, fine};
use super::keep::keep;
use super::seal::{Target, seal};
use super::tree::PartMesh;
use super::watch::Watcher;
use super::{PipelineError, Plan};
use crate::bisect::{Method, Zone};
use crate::catalog::{CoarseRow, Form, InterfaceSide, RegionTotals, Sealed};
use crate::geom::Aabb;
use crate::mesh::{Mesh, Workspace};
use crate::optimize::Mode;
use crate::sizing::SizeField;
use crate::store::{Backing, DiskPath, PagerStats, attempt};
use crate::topology::Owners;

/// What a worker needs to make a sub-domain.
pub(super) struct LeafJob {
    pub part: PartMesh,
    /// The part's file, the file of its changes, the file to make.
    pub base: DiskPath,
    pub work: DiskPath,
    pub sealed: DiskPath,
    pub form: Form,
    /// Generation of the file to make.
    pub generation: u32,
    /// A size field of its own, in place of that of the whole.
    pub field: Option<SizeField>,
    /// Where to keep the coarse leaf, if it is to be kept.
    pub kept: Option<DiskPath>,
    pub scratch: DiskPath,
    pub zones: Vec<Zone>,
    /// Owners of the faces around it, by cut.
    pub owners: BTreeMap<u32, Owners>,
    pub share: Plan,
}

/// What is the same for all sub-domains.
#[derive(Clone, Copy)]
pub(super) struct Common<'a> {
    pub field: &'a SizeField,
    pub mode: Mode,
    pub method: Method,
    pub bounds: Aabb,
}

/// A finished sub-domain; its file is not yet listed.
pub(super) struct Leaf {
    pub part: PartMesh,
    pub generation: u32,
    pub sealed: Sealed,
    pub kept: Option<CoarseRow>,
    /// Seconds it took to keep the coarse leaf.
    pub keep_s: f64,
    pub fine: FineReport,
    pub pages: PagerStats,
    pub frames_used: usize,
    pub work: Option<DiskPath>,
    pub seal_seconds: f64,
    pub clock: Instant,
}

impl LeafJob {
    /// Does the whole job; a failed page access ends here.
    pub(super) fn run(self, common: Common, watch: &Watcher) -> Result<Leaf, PipelineError> {
        attempt(|| {
            let backing = Backing {
                subdomain: self.part.part.first,
                generation: self.part.generation + WORK,
                work_path: self.work.clone(),
                base: None,
                cache_bytes: self.share.redb as usize,
            };
            let mesh = open_part(self.part, self.base.clone(), backing, self.share.frames)?;
            self.finish(mesh, common, watch)
        })?
    }

    /// The same for a mesh already open.
    pub(super) fn finish(
        self,
        mut mesh: Mesh,
        common: Common,
        watch: &Watcher,
    ) -> Result<Leaf, PipelineError> {
        let clock = Instant::now();
        let space = Workspace {
            dir: &self.scratch,
            memory: self.share.buffers / 2,
        };
        let (rank, coarse) = (self.part.part.first, self.part.generation);
        let kept = match &self.kept {
            Some(path) => Some(keep(&mut mesh, path, rank, coarse, self.share.buffers)?),
            None => None,
        };
        let keep_s = clock.elapsed().as_secs_f64();
        let fine = fine(
            &mut mesh,
            self.field.as_ref().unwrap_or(common.field),
            common,
            &self.zones,
            &space,
            watch,
        )?;
        let generation = self.generation;
        let target = Target {
            path: &self.sealed,
            form: self.form,
            scratch: &self.scratch,
            subdomain: SubdomainId::new(rank).expect("fewer parts than ranks"),
            generation,
            memory: self.share.buffers,
            bounds: common.bounds,
            owners: Some(&self.owners),
        };
        let seal_clock = Instant::now();
        let sealed = seal(&mut mesh, &target, watch)?;
        let seal_seconds = seal_clock.elapsed().as_secs_f64();
        let pager = mesh.into_pages();
        let (pages, frames_used) = (pager.stats(), pager.frames_used());
        let work = pager.discard();
        let _ = self.scratch.remove_dir_all();
        Ok(Leaf {
            part: self.part,
            generation,
            sealed,
            kept,
            keep_s,
            fine,
            pages,
            frames_used,
            work,
            seal_seconds,
            clock,
        })
    }
}

impl Leaf {
    /// Removes the file of changes, which nobody needs any more.
    pub(super) fn remove_work(&self) -> Result<(), PipelineError> {
        match &self.work {
            Some(path) => Ok(path.remove_file()?),
            None => Ok(()),
        }
    }
}

/// Regions and interfaces of a sealed sub-domain, kept until all are there.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SealedTotals {
    pub regions: BTreeMap<u32, RegionTotals>,
    pub interfaces: Vec<InterfaceSide>,
}

impl SealedTotals {
    pub(super) fn of(sealed: &Sealed) -> Self {
        Self {
            regions: sealed.regions.clone(),
            interfaces: sealed.interfaces.clone(),
        }
    }

    /// Number of regions, three words of each, then five of each interface.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let mut words = vec![self.regions.len() as u64];
        for (&region, totals) in &self.regions {
            words.extend([u64::from(region), totals.tets, totals.volume.to_bits()]);
        }
        for side in &self.interfaces {
            let [a, b] = side.digest.lanes;
            words.extend([u64::from(side.cut), u64::from(side.other), side.faces, a, b]);
        }
        words.into_iter().flat_map(u64::to_le_bytes).collect()
    }

    /// The inverse of [`SealedTotals::to_bytes`].
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let words: Vec<u64> = bytes
            .chunks_exact(8)
            .map(|b| u64::from_le_bytes(std::array::from_fn(|i| b[i])))
            .collect();
        let (&n, rest) = words.split_first()?;
        let regions = rest.get(..(n as usize).checked_mul(3)?)?;
        let mut totals = Self::default();
        for r in regions.chunks_exact(3) {
            let region = RegionTotals {
                tets: r[1],
                volume: f64::from_bits(r[2]),
            };
            totals.regions.insert(r[0] as u32, region);
        }
        for s in rest[regions.len()..].chunks_exact(5) {
            totals.interfaces.push(InterfaceSide {
                cut: s[0] as u32,
                other: s[1] as u32,
                faces: s[2],
                digest: Digest {
                    lanes: [s[3], s[4]],
                },
            });
        }
        Some(totals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_come_back_from_their_bytes() {
        let mut totals = SealedTotals::default();
        let region = RegionTotals {
            tets: 17,
            volume: 0.1,
        };
        totals.regions.insert(4, region);
        totals.interfaces.push(InterfaceSide {
            cut: 3,
            other: 2,
            faces: 9,
            digest: Digest { lanes: [5, 6] },
        });
        assert_eq!(SealedTotals::from_bytes(&totals.to_bytes()), Some(totals));
        assert_eq!(SealedTotals::from_bytes(&[9, 0, 0, 0, 0, 0, 0, 0]), None);
    }
}
