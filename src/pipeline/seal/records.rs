//! What is sorted while a sub-domain is sealed.

/// Nodes, region and flags of a tetrahedron, 4 + 1 + 1 big-endian words, and a mask of its required faces.
pub(in crate::pipeline) type TetRecord = [u8; 25];

/// The nodes of a tetrahedron, rotated.
pub(in crate::pipeline) fn nodes(record: &TetRecord) -> [u32; 4] {
    [0, 4, 8, 12].map(|at| word(record, at))
}

pub(in crate::pipeline) fn word(record: &[u8], at: usize) -> u32 {
    let bytes = [record[at], record[at + 1], record[at + 2], record[at + 3]];
    u32::from_be_bytes(bytes)
}
