//! Chunks come back; damage is an error, never a panic.

use super::*;
use crate::record::{
    CoarseFace, CoarseTet, CoarseVertex, InterfaceFace, SealedFacet, SealedTet, SealedVertex,
    WorkingFacet,
};

/// Deterministic pseudo-random numbers.
fn random(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(1);
        crate::digest::mix(seed, state)
    }
}

fn tets(n: u32) -> Vec<SealedTet> {
    let mut next = random(1);
    (0..n)
        .map(|i| {
            let a = i / 6;
            let step = |r: u64| 1 + (r % 40) as u32;
            let nodes = [a, a + step(next()), a + step(next()), a + step(next())];
            let region = if i % 1000 == 0 { u32::MAX - i } else { 3 };
            SealedTet { nodes, region }
        })
        .collect()
}

fn vertices(n: u32) -> Vec<SealedVertex> {
    let mut next = random(2);
    (0..n)
        .map(|i| {
            let noise = (next() % 4096) as f64 * 1e-6;
            let surface = next().is_multiple_of(3);
            let owner = if surface { 0 } else { (1 << 20) + 5 };
            let index = if surface { next() as u32 } else { i };
            SealedVertex {
                point: [noise - f64::from(i), noise * 3.0, 1.0 / (noise + 0.1)],
                h: noise as f32,
                tag: u32::from(surface),
                id: owner << 32 | u64::from(index),
            }
        })
        .collect()
}

fn facets(n: u32) -> Vec<SealedFacet> {
    (0..n)
        .map(|i| SealedFacet {
            vertices: [i, i + 7, i.wrapping_sub(3)],
            label: i / 100,
            triangle: u64::from(i) << (i % 33),
            regions: [1, i % 7 * u32::MAX / 7],
            tets: [if i % 2 == 0 { u32::MAX } else { i * 3 }, u32::MAX - 1 - i],
        })
        .collect()
}

fn faces(n: u32) -> Vec<InterfaceFace> {
    (0..n)
        .map(|i| InterfaceFace {
            vertices: [i, i + 1, i + 9],
            cut: 1 + i % 3,
            index: i.wrapping_mul(77_777),
            other: 8,
            tet: i * 4,
        })
        .collect()
}

/// Tetrahedra of a coarse snapshot: nodes in any even order, tetrahedra in any order.
fn coarse_tets(n: u32) -> Vec<CoarseTet> {
    let mut next = random(3);
    (tets(n).into_iter().enumerate())
        .map(|(i, tet)| {
            let [a, b, c, d] = tet.nodes;
            // Nodes of a tetrahedron differ.
            let nodes = [a, b, c + 50, d + 100];
            let [a, b, c, d] = nodes;
            let turned = [nodes, [b, a, d, c], [c, d, a, b], [b, c, a, d], [d, a, c, b]];
            CoarseTet {
                nodes: turned[(next() % 5) as usize],
                bits: next() as u8 & 0x93,
                region: tet.region,
                flags: u32::from(i % 40 == 0),
            }
        })
        .collect()
}

fn coarse_vertices(n: u32) -> Vec<CoarseVertex> {
    (vertices(n).into_iter())
        .map(|v| CoarseVertex { point: v.point, tag: v.tag | v.tag << 7, owner: v.id as u32 })
        .collect()
}

fn coarse_facets(n: u32) -> Vec<WorkingFacet> {
    (facets(n).into_iter())
        .map(|f| WorkingFacet {
            vertices: f.vertices,
            label: f.label,
            triangle: f.triangle,
            regions: f.regions,
        })
        .collect()
}

fn coarse_faces(n: u32) -> Vec<CoarseFace> {
    (faces(n).into_iter())
        .map(|f| CoarseFace { vertices: f.vertices, cut: f.cut, index: f.index, side: f.cut & 1 })
        .collect()
}

/// Numbers near each other, of either sign, and some of any bits.
fn words(n: u32) -> Vec<FieldWord> {
    let mut next = random(9);
    let smooth = |i: u32| (f64::from(i) * 1e-3).sin().to_bits();
    (0..n).map(|i| FieldWord(if i % 50 == 0 { next() } else { smooth(i) })).collect()
}

fn field_summary() -> FieldSummary<false> {
    FieldSummary { first: 7, count: 9, piece: 3, pieces: 2, nan: 1, low: -0.5, high: 3.0 }
}

fn pack<R: ChunkRecord>(records: &[R]) -> Vec<PackedChunk<R>> {
    let mut packer = Packer::new(5, 2).expect("a zstd context");
    let mut chunks = Vec::new();
    for &r in records {
        chunks.extend(packer.push(r).expect("zstd"));
    }
    while let Some(chunk) = packer.cut().expect("zstd") {
        chunks.push(chunk);
    }
    assert_eq!(packer.count(), records.len() as u64);
    chunks
}

fn come_back<R: ChunkRecord + PartialEq + std::fmt::Debug>(records: &[R]) {
    let mut decoder = Decoder::<R>::new().expect("a zstd context");
    let (mut all, mut some) = (Vec::new(), Vec::new());
    for chunk in pack(records) {
        assert!(chunk.value.len() <= CHUNK_BYTES_MAX);
        let first = decoder.decode(&chunk.value, chunk.address, &mut some);
        assert_eq!(first, Ok(all.len() as u32));
        all.extend_from_slice(&some);
    }
    assert!(all == records, "{} of {}", all.len(), records.len());
}

#[test]
fn every_kind_comes_back() {
    for n in [0, 1, 2, 50_000] {
        come_back(&tets(n));
        come_back(&vertices(n));
        come_back(&facets(n));
        come_back(&faces(n));
        come_back(&coarse_tets(n));
        come_back(&coarse_vertices(n));
        come_back(&coarse_facets(n));
        come_back(&coarse_faces(n));
        come_back(&words(n));
    }
    let summary = TetSummary {
        bounds: [[0.1; 3], [0.9; 3]],
        volume: 2.0,
        quality: [1.0, 3.5],
        regions: [1, 70_000],
        vertices: [4, 9],
        first: 2,
        count: 3,
        open_faces: 5,
        bytes: 65_000,
        edge_max: 0.7,
    };
    come_back(&vec![summary; 3000]);
    let bounds = [[0.5; 3]; 2];
    come_back(&vec![VertexSummary { bounds, first: 0, count: 9, cells: 5 << 40 }; 5000]);
    come_back(&vec![RangeSummary::<true> { first: 0, count: 9 }; 50]);
    come_back(&vec![field_summary(); 5000]);
}

#[test]
fn chunks_are_well_filled() {
    for chunks in [
        pack(&tets(400_000)).iter().map(|c| c.value.len()).collect::<Vec<_>>(),
        pack(&vertices(60_000)).iter().map(|c| c.value.len()).collect(),
    ] {
        let full = &chunks[..chunks.len() - 1];
        let mean = full.iter().sum::<usize>() as f64 / full.len() as f64;
        assert!(mean > 0.94 * CHUNK_BYTES_MAX as f64, "{chunks:?}");
    }
}

/// Recomputes the checksum, so that the content behind it is tested too.
fn mend(value: &mut [u8]) {
    let sum = xxhash_rust::xxh3::xxh3_64(&value[8..]);
    value[..8].copy_from_slice(&sum.to_le_bytes());
}

fn damage<R: ChunkRecord>(records: &[R]) {
    let mut next = random(3);
    let mut decoder = Decoder::<R>::new().expect("a zstd context");
    let mut some = Vec::new();
    let chunk = &pack(records)[0];
    for _ in 0..400 {
        let mut value = chunk.value.clone();
        let bit = next() as usize % (value.len() * 8);
        value[bit / 8] ^= 1 << (bit % 8);
        assert!(
            decoder
                .decode(&value, chunk.address, &mut some)
                .is_err_and(|e| matches!(e.reason, ChunkDamage::Checksum { .. }))
        );
        mend(&mut value);
        let _ = decoder.decode(&value, chunk.address, &mut some);
        assert!(some.capacity() <= 2 * R::COUNT_MAX);
        let short = next() as usize % value.len();
        assert!(decoder.decode(&value[..short], chunk.address, &mut some).is_err());
    }
    // Random columns behind a valid head.
    for round in 0..400 {
        let mut raw: Vec<u8> = (0..next() % 3000).map(|_| next() as u8).collect();
        if round % 2 == 0 {
            raw.iter_mut().for_each(|b| *b &= 0x81);
        }
        let mut columns = columns::ColumnReader::new(&raw);
        some.clear();
        let count = next() as usize % 500;
        let _ = R::decode(&mut columns, u32::MAX - 400, count, &mut some);
    }
    let other = ChunkAddress { generation: 9, ..chunk.address };
    let found = decoder.decode(&chunk.value, other, &mut some);
    assert!(found.is_err_and(|e| e.to_string().contains("sub-domain 5")));
}

#[test]
fn damage_is_an_error() {
    damage(&tets(3000));
    damage(&vertices(500));
    damage(&facets(500));
    damage(&faces(500));
    damage(&words(2000));
    damage(&[field_summary(); 40]);
    let bounds = [[0.5; 3]; 2];
    damage(&[VertexSummary { bounds, first: 0, count: 9, cells: 5 << 40 }; 40]);
}

#[test]
fn a_summary_that_no_chunk_can_have_is_refused() {
    let sound = TetSummary {
        bounds: [[0.1; 3], [0.9; 3]],
        volume: 2.0,
        quality: [1.0, 3.5],
        regions: [1, 2],
        vertices: [4, 9],
        first: 0,
        count: 3,
        open_faces: 5,
        bytes: 65_000,
        edge_max: 0.7,
    };
    type Change = fn(&mut TetSummary);
    let changes: [Change; 7] = [
        |s| s.bounds[0][1] = f64::NAN,
        |s| s.bounds.swap(0, 1),
        |s| s.bounds[1][2] = f64::INFINITY,
        |s| s.quality = [f32::NAN; 2],
        |s| s.regions = [2, 1],
        |s| s.edge_max = -1.0,
        |s| s.count = 0,
    ];
    let mut decoder = Decoder::<TetSummary>::new().expect("a zstd context");
    for (i, change) in changes.into_iter().enumerate() {
        let mut summary = sound;
        change(&mut summary);
        let chunk = &pack(&[sound, summary])[0];
        let read = decoder.decode(&chunk.value, chunk.address, &mut Vec::new());
        assert!(read.is_err(), "change {i}");
    }
    let bounds = [[1.0; 3], [0.0; 3]];
    let summary = VertexSummary { bounds, first: 0, count: 9, cells: 0 };
    let chunk = &pack(&[summary])[0];
    let mut decoder = Decoder::<VertexSummary>::new().expect("a zstd context");
    assert!(decoder.decode(&chunk.value, chunk.address, &mut Vec::new()).is_err());
}

#[test]
fn the_cells_of_a_box_hold_its_vertices() {
    let mut state = 7u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    for scale in [1e-200, 1e-9, 1.0, 1e9] {
        for flat in [false, true] {
            let points: Vec<[f64; 3]> = (0..40)
                .map(|i| {
                    let on_border = |x: f64| {
                        if i % 3 == 0 { (x * 4.0).floor() / 4.0 } else { x }
                    };
                    let z = if flat { 0.3 } else { on_border(random()) };
                    [on_border(random()), on_border(random()), z].map(|x| (x - 0.4) * scale)
                })
                .collect();
            let bounds = [f64::min as fn(f64, f64) -> f64, f64::max].map(|of| {
                std::array::from_fn(|axis| {
                    points.iter().map(|p| p[axis]).reduce(of).expect("forty points")
                })
            });
            let cells = VertexSummary::cells_of(&bounds, points.iter().copied());
            let told = VertexSummary { bounds, first: 0, count: 40, cells };
            for p in &points {
                let is_in = |[low, high]: [[f64; 3]; 2]| {
                    (0..3).all(|axis| low[axis] <= p[axis] && p[axis] <= high[axis])
                };
                assert!(told.cells().any(is_in), "{p:?} of {bounds:?}");
            }
            assert!(flat || told.cells().count() > 20);
            let untold = VertexSummary { cells: 0, ..told };
            assert_eq!(untold.cells().collect::<Vec<_>>(), [bounds]);
        }
    }
}
