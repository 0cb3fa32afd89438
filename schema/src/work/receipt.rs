//! Receipts: the results of orders, in the form in which the catalog records them.

use rkyv::{Archive, Deserialize, Serialize};

use super::CutOrder;
use crate::catalog::{CoarseRow, JournalRow, StageRow, SubdomainRow};
use crate::tree::{CutPlane, SubtreeMesh};

/// The result of a [`WorkOrder`](super::WorkOrder). Its files are not yet listed.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub enum Receipt {
    /// A bisected subtree.
    Cut(CutReceipt),
    /// A finished sub-domain.
    Subdomain(SubdomainReceipt),
}

/// A bisected subtree.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub struct CutReceipt {
    /// The mesh that was divided.
    pub parent: SubtreeMesh,
    /// The plane of the cut.
    pub zone: CutPlane,
    /// Low, high.
    pub children: [SubtreeMesh; 2],
    /// Faces of the interface.
    pub faces: u32,
    /// Faces of earlier cuts that the high child took over.
    pub inherited: Vec<InheritedFace>,
    /// Kept intermediate meshes, if any.
    pub stages: Vec<StageRow>,
    /// Bytes of [`StageFaces`](crate::topology::StageFaces), if stages are kept.
    pub stage_faces: Vec<u8>,
    /// The row to append.
    pub journal: JournalRow,
    /// Pages read and written.
    pub traffic: Traffic,
}

/// A finished sub-domain.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub struct SubdomainReceipt {
    /// Generation of the coarse mesh it was meshed from.
    pub coarse: u32,
    /// Its row.
    pub row: SubdomainRow,
    /// The coarse snapshot, if kept.
    pub kept: Option<CoarseRow>,
    /// Bytes of [`SubdomainTotals`](crate::totals::SubdomainTotals).
    pub totals: Vec<u8>,
    /// The row to append.
    pub journal: JournalRow,
    /// Pages read and written.
    pub traffic: Traffic,
}

/// An interface face of an earlier cut that a child took over from its parent.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct InheritedFace {
    /// Number of the cut.
    pub cut: u32,
    /// Number of the face in the cut.
    pub index: u32,
    /// The side of the cut where the child is: 0 low, 1 high.
    pub side: u32,
}

/// Pages read and written, and the largest number held at once.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traffic {
    /// Pages that came from a file.
    pub pages_read: u64,
    /// Pages that went to a file.
    pub pages_written: u64,
    /// Transactions of redb.
    pub commits: u64,
    /// Most frames in use.
    pub frames_used: u64,
}

impl CutReceipt {
    /// The orders that cut the children, for a subtree that was cut under `zones`.
    pub fn below(&self, zones: &[CutPlane]) -> impl Iterator<Item = CutOrder> {
        let zones = [zones, &[self.zone]].concat();
        let wide = self.children.into_iter().filter(|c| c.ranks.count > 1);
        wide.map(move |parent| CutOrder { parent, zones: zones.clone() })
    }
}

impl Receipt {
    /// Names of the files that were written.
    pub fn files(&self) -> Vec<String> {
        match self {
            Self::Cut(cut) => {
                let children = cut.children.iter().map(SubtreeMesh::file);
                let files = children.chain(cut.stages.iter().map(|stage| stage.row.file()));
                files.map(|file| file.subdomain_name()).collect()
            }
            Self::Subdomain(sub) => {
                let kept = sub.kept.iter().map(|kept| kept.file().coarse_name());
                [sub.row.file().subdomain_name()].into_iter().chain(kept).collect()
            }
        }
    }
}
