//! What is fed with arbitrary bytes: every reader of surfaces, some of meshes, options and expressions, every decoder of pages and chunks.
//!
//! A target may answer with any error. It may not panic, hang, or hold more than its input justifies.
//! Bytes that cannot have been written are also given a valid head and checksum, or only the checksum would be tested.

use tetdb_base::expr::{ExprKind, Expression};
use tetdb_base::storage::kind;
use tetdb_base::surface::{orient_alike, validate};
use tetdb_engine::pipeline::MeshOptions;
use tetdb_io::read::{Format, read_memory};
use tetdb_kernel::samples::SampleSpec;
use tetdb_kernel::sizing::{LabelSize, RegionSize, SizeOptions, SizeSource};
use tetdb_schema::chunk::{
    ChunkAddress, ChunkKind, ChunkRecord, Decoder, HEAD_BYTES, RangeSummary, TetSummary,
    VertexSummary,
};
use tetdb_schema::page::{
    FORMAT_VERSION, Frame, PageAddress, PageKind, SLOTS, STORED_BYTES, access_page, open_page,
    seal_full_page, seal_page,
};
use tetdb_schema::record::{
    CoarseFace, CoarseTet, CoarseVertex, InterfaceFace, SealedFacet, SealedTet, SealedVertex,
    TetAttribute, WorkingFacet, WorkingTet, WorkingVertex,
};
use tetdb_schema::unsealed::{PageDecoder, PageRecord, extra_page};
use xxhash_rust::xxh3::xxh3_64;

/// A target and the folder of its corpus.
pub struct Target {
    pub name: &'static str,
    /// Of a reader.
    #[allow(dead_code)] // The test that replays the corpus asks for it.
    pub format: Option<Format>,
    pub run: fn(&[u8]),
}

const fn reader(name: &'static str, format: Format, run: fn(&[u8])) -> Target {
    Target { name, format: Some(format), run }
}

const fn text(name: &'static str, run: fn(&[u8])) -> Target {
    Target { name, format: None, run }
}

pub const TARGETS: &[Target] = &[
    reader("stl", Format::Stl, |bytes| read(Format::Stl, bytes)),
    reader("off", Format::Off, |bytes| read(Format::Off, bytes)),
    reader("obj", Format::Obj, |bytes| read(Format::Obj, bytes)),
    reader("ply", Format::Ply, |bytes| read(Format::Ply, bytes)),
    reader("medit", Format::Medit, |bytes| read(Format::Medit, bytes)),
    reader("meditb", Format::MeditBinary, |bytes| read(Format::MeditBinary, bytes)),
    reader("gmsh", Format::Gmsh, |bytes| read(Format::Gmsh, bytes)),
    reader("smesh", Format::TetgenSmesh, |bytes| read(Format::TetgenSmesh, bytes)),
    reader("poly", Format::TetgenPoly, |bytes| read(Format::TetgenPoly, bytes)),
    reader("3mf", Format::ThreeMf, |bytes| read(Format::ThreeMf, bytes)),
    reader("gii", Format::Gifti, |bytes| read(Format::Gifti, bytes)),
    text("vtkhdf", |bytes| drop(crate::mesh::read("vtkhdf", bytes))),
    text("vtu", |bytes| drop(crate::mesh::read("vtu", bytes))),
    text("inp", |bytes| drop(crate::mesh::read("inp", bytes))),
    text("msh", |bytes| drop(crate::mesh::read("msh", bytes))),
    text("expr", expression),
    text("config", config),
    text("option", option),
    Target { name: "page", format: None, run: page },
    Target { name: "unsealed", format: None, run: unsealed },
    Target { name: "chunk", format: None, run: chunk },
    Target { name: "file", format: None, run: crate::file::changed },
    Target { name: "store", format: None, run: crate::store::changed },
];

/// An expression of sizes or of a query: parsed, and its value at some points.
fn expression(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let Ok(found) = Expression::parse(text, &["x", "y", "z"]) else {
        return;
    };
    for values in [[0.0; 3], [1.0, -2.0, 0.5], [1e300, -1e-300, f64::NAN]] {
        match found.kind() {
            ExprKind::Number => {
                found.number(&values);
            }
            ExprKind::Truth => {
                let range = values.map(|x| [x, x]);
                // What holds at a point may hold around it.
                assert!(!found.truth(&values) || found.may_hold(&range), "{text}");
                found.may_hold(&[[-1.0, 1.0], [f64::NEG_INFINITY, f64::INFINITY], [0.0, 0.0]]);
            }
        }
    }
}

/// A file of options.
fn config(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let Ok(options) = toml::from_str::<MeshOptions>(text) else {
        return;
    };
    // What a store has on record comes back as it was.
    let recorded = serde_json::to_string(&options).expect("options are text");
    assert_eq!(serde_json::from_str::<MeshOptions>(&recorded).ok(), Some(options));
}

/// One option as typed; the first byte says which.
fn option(bytes: &[u8]) {
    let Some((&which, rest)) = bytes.split_first() else {
        return;
    };
    let Ok(text) = std::str::from_utf8(rest) else {
        return;
    };
    match which % 8 {
        0 => drop(SizeOptions::parse(Some(text), Some(text), Some(text), None)),
        1 => drop(SizeOptions::parse(None, None, None, Some(text))),
        2 => drop(SizeSource::parse_box(text)),
        3 => drop(SizeSource::parse_sphere(text)),
        4 => drop(SizeSource::parse_cylinder(text)),
        5 => drop(RegionSize::parse(text)),
        6 => drop(LabelSize::parse(text)),
        _ => drop(SampleSpec::parse(text)),
    }
}

/// Larger surfaces are read but not validated.
const VALIDATED_MAX: usize = 2000;

fn read(format: Format, bytes: &[u8]) {
    let Ok(mut surface) = read_memory(format, "fuzz", bytes) else {
        return;
    };
    let n = surface.points.len();
    for t in &surface.triangles {
        assert!(t.iter().all(|&v| (v as usize) < n), "{t:?} of {n} vertices");
    }
    assert!(surface.points.iter().all(|p| p.is_finite()));
    assert_eq!(surface.labels.len(), surface.triangles.len());
    if surface.n_triangles() <= VALIDATED_MAX {
        orient_alike(&mut surface);
        let found = validate(&surface);
        assert_eq!(found.is_valid(), found.accept().is_ok());
    }
}

fn page(bytes: &[u8]) {
    let kind = kind::ALL[bytes.first().map_or(0, |&b| usize::from(b) % kind::ALL.len())];
    let address = PageAddress { kind, subdomain: 3, page: 7 };
    let mut frame: Box<Frame> = Box::new([Default::default(); SLOTS]);
    // As it is: wrong in length or checksum.
    assert!(open_page(bytes, address, &mut frame[..]).is_err());
    let _ = access_page(bytes);
    // As content, with the head a writer would have put.
    let mut content = bytes.to_vec();
    content.resize(STORED_BYTES, 0);
    bytemuck::cast_slice_mut(&mut frame[..SLOTS - 1]).copy_from_slice(&content);
    seal_page(&mut frame[..], address, 9);
    let stored = bytemuck::cast_slice::<_, u8>(&frame[..SLOTS - 1]).to_vec();
    assert_eq!(open_page(&stored, address, &mut frame[..]), Ok(9));
    let elsewhere = PageAddress { page: 8, ..address };
    assert!(open_page(&stored, elsewhere, &mut frame[..]).is_err());
    for slot in frame.iter().take(64) {
        assert_eq!(WorkingTet::from_slot(slot).to_slot(), *slot);
        assert_eq!(WorkingFacet::from_slot(slot).to_slot(), *slot);
        let _ = (WorkingVertex::from_slot(slot), TetAttribute::from_slot(slot, 3));
    }
}

/// Two bytes of count, then the slots of a page and of the one beside it.
fn unsealed(bytes: &[u8]) {
    let Some((&kind, rest)) = bytes.split_first() else {
        return;
    };
    match kind % 4 {
        0 => unsealed_records::<SealedTet>(rest),
        1 => unsealed_records::<SealedVertex>(rest),
        2 => unsealed_records::<SealedFacet>(rest),
        _ => unsealed_records::<InterfaceFace>(rest),
    }
}

fn unsealed_records<R: PageRecord>(bytes: &[u8]) {
    /// So that the page beside it is not its first.
    const PAGE: u32 = 9;
    let mut decoder = PageDecoder::new(5, 2);
    assert!(decoder.open::<R>(PAGE, bytes).is_err());
    let count = bytes.iter().take(2).fold(0, |n, &b| n << 8 | u32::from(b)) % 2100;
    let mut content = bytes.get(2..).unwrap_or_default().to_vec();
    content.resize(2 * STORED_BYTES, 0);
    let (main, extra) = content.split_at(STORED_BYTES);
    let sealed = |kind: PageKind, page: u32, content: &[u8]| {
        let mut frame: Box<Frame> = Box::new([Default::default(); SLOTS]);
        bytemuck::cast_slice_mut(&mut frame[..SLOTS - 1]).copy_from_slice(content);
        let address = PageAddress { kind, subdomain: 5, page };
        seal_full_page(&mut frame[..], address, 2, count);
        bytemuck::cast_slice::<_, u8>(&frame[..SLOTS - 1]).to_vec()
    };
    let opened = decoder.open::<R>(PAGE, &sealed(R::PAGE, PAGE, main));
    assert_eq!(opened, Ok(()));
    if let Some(kind) = R::EXTRA {
        let value = sealed(kind, extra_page(PAGE), extra);
        assert_eq!(decoder.open_extra::<R>(PAGE, &value), Ok(()));
    }
    let mut records: Vec<R> = Vec::new();
    let first = decoder.records(PAGE, &mut records);
    assert!(records.len() <= count as usize);
    assert_eq!(first.is_ok(), records.len() == count as usize && (1..=2046).contains(&count));
}

fn chunk(bytes: &[u8]) {
    let Some((&kind, rest)) = bytes.split_first() else {
        return;
    };
    match kind % 12 {
        0 => records::<SealedTet>(rest),
        1 => records::<SealedVertex>(rest),
        2 => records::<SealedFacet>(rest),
        3 => records::<InterfaceFace>(rest),
        4 => records::<TetSummary>(rest),
        5 => records::<VertexSummary>(rest),
        6 => records::<RangeSummary<true>>(rest),
        7 => records::<RangeSummary<false>>(rest),
        8 => records::<CoarseTet>(rest),
        9 => records::<CoarseVertex>(rest),
        10 => records::<WorkingFacet>(rest),
        _ => records::<CoarseFace>(rest),
    }
}

/// Four bytes of count, four of the first number, then columns.
fn records<R: ChunkRecord>(bytes: &[u8]) {
    let mut decoder = Decoder::<R>::new().expect("a zstd context");
    let address = ChunkAddress { kind: R::KIND, subdomain: 5, generation: 2, chunk: 0 };
    let mut found: Vec<R> = Vec::new();
    let mut decode = |value: &[u8]| {
        let first = decoder.decode(value, address, &mut found);
        assert!(found.len() <= R::COUNT_MAX);
        first.is_ok()
    };
    assert!(!decode(bytes));
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        u32::from_le_bytes(word.unwrap_or([0; 4]))
    };
    let (count, first) = (word(0) % 70_000, word(4));
    let raw = bytes.get(8..).unwrap_or_default();
    // Compressed and headed as an encoder does it; then the same with the bytes themselves for a payload.
    let packed = zstd::bulk::compress(raw, 1).expect("zstd has room");
    for payload in [&packed[..], raw] {
        decode(&headed(R::KIND, [first, count, payload.len() as u32, raw.len() as u32], payload));
    }
}

/// A chunk's head in front of a payload, as `schema/README.md` tells it.
fn headed(kind: ChunkKind, numbers: [u32; 4], payload: &[u8]) -> Vec<u8> {
    let mut value = vec![0; HEAD_BYTES];
    let [first, count, packed, raw] = numbers;
    let version_kind = u32::from(FORMAT_VERSION) | (kind as u32) << 16;
    let magic = u32::from_le_bytes(*b"TETC");
    let words = [magic, version_kind, 5, 0, 2, first, count, packed, raw, 0];
    for (bytes, word) in value[8..].chunks_exact_mut(4).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    value.extend_from_slice(payload);
    let sum = xxh3_64(&value[8..]);
    value[..8].copy_from_slice(&sum.to_le_bytes());
    value
}
