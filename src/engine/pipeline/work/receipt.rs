//! What a worker has done.

use rkyv::{Archive, Deserialize, Serialize};

use super::order::CutOrder;
use crate::pipeline::tree::{PartMesh, ZoneRow};
use tetdb_base::storage::PagerStats;
use tetdb_schema::catalog::{CoarseRow, JournalRow, StageRow, SubdomainRow};
use tetdb_store::store::Catalog;

/// What became of an [`Order`](super::Order); its files are not yet listed.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub enum Receipt {
    /// A part in two.
    Cut(CutReceipt),
    /// A finished sub-domain.
    Subdomain(SubdomainReceipt),
}

/// A part in two.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub struct CutReceipt {
    pub parent: PartMesh,
    pub zone: ZoneRow,
    /// Low, high.
    pub children: [PartMesh; 2],
    /// Faces of the interface.
    pub faces: u32,
    /// Faces of earlier cuts that the high child took over.
    pub inherited: Vec<InheritedFace>,
    /// Meshes on the way, and the faces of the interface, where they are kept.
    pub stages: Vec<StageRow>,
    pub stage_faces: Vec<u8>,
    pub journal: JournalRow,
    pub traffic: Traffic,
}

/// A finished sub-domain.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub struct SubdomainReceipt {
    /// Generation of the coarse mesh it was meshed from.
    pub coarse: u32,
    pub row: SubdomainRow,
    /// The coarse snapshot, where it is kept.
    pub kept: Option<CoarseRow>,
    /// Regions and interfaces, as [`SealedTotals`](crate::pipeline::seal::totals::SealedTotals) writes them.
    pub totals: Vec<u8>,
    pub journal: JournalRow,
    pub traffic: Traffic,
}

/// An interface face of an earlier cut that a child took over from its parent.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct InheritedFace {
    pub cut: u32,
    /// Number in the cut.
    pub index: u32,
    /// On which side of the cut the child is.
    pub side: u32,
}

/// Pages read and written, and the most held at once.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traffic {
    pub pages_read: u64,
    pub pages_written: u64,
    pub commits: u64,
    pub frames_used: u64,
}

impl Traffic {
    pub fn new(pages: PagerStats, frames_used: usize) -> Self {
        Self {
            pages_read: pages.pages_read,
            pages_written: pages.pages_written,
            commits: pages.commits,
            frames_used: frames_used as u64,
        }
    }

    pub fn pages(self) -> PagerStats {
        PagerStats {
            pages_read: self.pages_read,
            pages_written: self.pages_written,
            commits: self.commits,
        }
    }
}

impl CutReceipt {
    /// The cuts to be made in the children of a part that was cut under `zones`.
    pub fn below(&self, zones: &[ZoneRow]) -> impl Iterator<Item = CutOrder> {
        let zones = [zones, &[self.zone]].concat();
        let wide = self.children.into_iter().filter(|c| c.part.count > 1);
        wide.map(move |parent| CutOrder { parent, zones: zones.clone() })
    }
}

impl Receipt {
    /// Names of the files that were written.
    pub fn files(&self) -> Vec<String> {
        let of_part = |p: &PartMesh| Catalog::file_name(p.part.first, p.generation);
        match self {
            Self::Cut(cut) => {
                let stages = cut.stages.iter();
                let stages = stages.map(|s| Catalog::file_name(s.row.rank, s.row.generation));
                cut.children.iter().map(of_part).chain(stages).collect()
            }
            Self::Subdomain(sub) => {
                let sealed = Catalog::file_name(sub.row.rank, sub.row.generation);
                let kept = sub.kept.iter();
                let kept = kept.map(|k| Catalog::coarse_name(k.rank, k.generation));
                [sealed].into_iter().chain(kept).collect()
            }
        }
    }
}
