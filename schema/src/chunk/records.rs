//! The columns of every kind of record, of sealed sub-domains and of coarse snapshots.

use super::column::{
    ColumnForm, Dictionary, DifferencePlanes, Differences, FaceVertices, Points, RotatedNodes,
    TetOrNone, TurnedNodes, VertexNumbers, columns,
};
use super::columns::{ColumnReader, ColumnWriter, Malformed};
use super::{ChunkKind, ChunkRecord};
use crate::record::{
    CoarseFace, CoarseTet, CoarseVertex, InterfaceFace, SealedFacet, SealedTet, SealedVertex,
    WorkingFacet,
};

impl ChunkRecord for SealedTet {
    const KIND: ChunkKind = ChunkKind::Tets;
    const COUNT_MAX: usize = 32_768;
    const RAW_BYTES_MAX: usize = 4 * 4 + 10;
    columns! {
        nodes: RotatedNodes,
        region: Dictionary,
    }
}

impl ChunkRecord for SealedVertex {
    const KIND: ChunkKind = ChunkKind::Vertices;
    const COUNT_MAX: usize = 8192;
    const RAW_BYTES_MAX: usize = 3 * 8 + 4 + 10 + 10 + 5;
    columns! {
        point: Points,
        h: DifferencePlanes,
        tag: Dictionary,
        id: VertexNumbers,
    }
}

impl ChunkRecord for SealedFacet {
    const KIND: ChunkKind = ChunkKind::Facets;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 10 + 10 + 2 * 10 + 2 * 5;
    columns! {
        vertices: FaceVertices,
        label: Dictionary,
        triangle: Differences,
        regions[0]: Dictionary,
        tets[0]: TetOrNone,
        regions[1]: Dictionary,
        tets[1]: TetOrNone,
    }
}

impl ChunkRecord for InterfaceFace {
    const KIND: ChunkKind = ChunkKind::InterfaceFaces;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 2 * 10 + 2 * 5;
    columns! {
        vertices: FaceVertices,
        cut: Dictionary,
        other: Dictionary,
        index: Differences,
        tet: TetOrNone,
    }
}

impl ChunkRecord for CoarseTet {
    const KIND: ChunkKind = ChunkKind::CoarseTets;
    const COUNT_MAX: usize = 32_768;
    const RAW_BYTES_MAX: usize = 4 * 4 + 1 + 3 * 10;
    columns! {
        nodes: TurnedNodes,
        bits: Dictionary,
        region: Dictionary,
        flags: Dictionary,
    }
}

impl ChunkRecord for CoarseVertex {
    const KIND: ChunkKind = ChunkKind::CoarseVertices;
    const COUNT_MAX: usize = 8192;
    const RAW_BYTES_MAX: usize = 3 * 8 + 10 + 5;
    columns! {
        point: Points,
        tag: Dictionary,
        owner: DifferencePlanes,
    }
}

impl ChunkRecord for WorkingFacet {
    const KIND: ChunkKind = ChunkKind::CoarseFacets;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 10 + 10 + 2 * 10;
    columns! {
        vertices: FaceVertices,
        label: Dictionary,
        triangle: Differences,
        regions[0]: Dictionary,
        regions[1]: Dictionary,
    }
}

impl ChunkRecord for CoarseFace {
    const KIND: ChunkKind = ChunkKind::CoarseFaces;
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = 3 * 5 + 2 * 10 + 5;
    columns! {
        vertices: FaceVertices,
        cut: Dictionary,
        side: Dictionary,
        index: Differences,
    }
}
