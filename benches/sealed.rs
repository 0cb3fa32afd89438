//! Sealed chunks of a Delaunay mesh of random points: bytes and rates of the codec, of writing, of verifying.
//!
//! `cargo bench --bench sealed -- [points]`; without an argument a smoke size. Rates are per
//! CPU second of all threads.

use tetdb_base::geom::{Aabb, HilbertFrame, Point};
use tetdb_base::storage::FlatPages;
use tetdb_kernel::delaunay::{Kernel, enclose};
use tetdb_kernel::mesh::Mesh;
use tetdb_schema::catalog::{Job, StoreState};
use tetdb_schema::chunk::{ChunkRecord, Decoder, Packer};
use tetdb_schema::digest::mix;
use tetdb_schema::ids::SubdomainId;
use tetdb_schema::record::{FACES, NO_TET, SealedFacet, SealedTet, SealedVertex, tag};
use tetdb_store::audit::{Level, VerifyOptions, verify};
use tetdb_store::sealed::{FacePairs, Paired, SealedWriter, sorted_face};
use tetdb_store::store::Catalog;

fn main() {
    let n = std::env::args().find_map(|a| a.parse().ok());
    let points = random_points(n.unwrap_or(20_000));
    let tets = delaunay(&points);
    println!("{} vertices, {} tetrahedra", points.len(), tets.len());

    let frame = HilbertFrame::new(&Aabb::around(points.iter().copied()));
    let mut along_curve = tets.clone();
    along_curve.sort_by_cached_key(|t| {
        let sum: Point = t.nodes.iter().map(|&v| points[v as usize]).sum();
        frame.index(sum / 4.0)
    });
    let mut by_nodes = tets;
    by_nodes.sort_unstable_by_key(|t| t.nodes);
    codec("tetrahedra by centroid", &along_curve, by_nodes.len());
    codec("tetrahedra by nodes", &by_nodes, by_nodes.len());
    let vertices = sealed_vertices(&points, &by_nodes);
    codec("vertices", &vertices, by_nodes.len());
    store(&vertices, &by_nodes);
}

fn random_points(n: usize) -> Vec<Point> {
    let coordinate = |i: u64| (mix(1, i) >> 11) as f64 / (1u64 << 53) as f64;
    let point =
        |i: u64| Point::new(coordinate(3 * i), coordinate(3 * i + 1), coordinate(3 * i + 2));
    let mut points: Vec<Point> = (0..n as u64).map(point).collect();
    let frame = HilbertFrame::new(&Aabb::around(points.iter().copied()));
    points.sort_by_cached_key(|&p| frame.index(p));
    points
}

/// Tetrahedra that touch no corner of the enclosing box; vertex numbers are places in `points`.
fn delaunay(points: &[Point]) -> Vec<SealedTet> {
    let mut mesh = Mesh::new(FlatPages::default());
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, &Aabb::around(points.iter().copied()));
    let mut place = vec![u32::MAX; points.len() * 2 + 4096];
    // In rounds, each along the curve: every 64th point, every 8th, all.
    let round = |i: usize| match i {
        _ if i.is_multiple_of(64) => 0,
        _ if i.is_multiple_of(8) => 1,
        _ => 2,
    };
    for r in 0..3 {
        for (i, &p) in points.iter().enumerate().filter(|(i, _)| round(*i) == r) {
            let v = mesh.add_vertex(p, 0.0);
            place[v as usize] = i as u32;
            hint = kernel
                .insert(&mut mesh, v, p, hint)
                .expect("random points differ and lie in the box");
        }
    }
    let mut tets = Vec::new();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let nodes = tet.vertices().map(|v| place[v as usize]);
        if !nodes.contains(&u32::MAX) {
            tets.push(SealedTet { nodes, region: 1 }.rotated());
        }
    }
    tets
}

/// Vertices with sizes; those of open faces are the surface's, the others the sub-domain's own.
fn sealed_vertices(points: &[Point], tets: &[SealedTet]) -> Vec<SealedVertex> {
    let mut surface = vec![false; points.len()];
    for (face, _) in hull(tets) {
        for v in face {
            surface[v as usize] = true;
        }
    }
    let id = SubdomainId::new(0).expect("small");
    (0u32..)
        .zip(points.iter().zip(surface))
        .map(|(i, (p, surface))| SealedVertex {
            point: p.to_array(),
            h: 0.01 * (1.0 + p.x as f32 * p.y as f32),
            tag: if surface { tag::SURFACE } else { tag::FREE },
            id: if surface { u64::from(i) } else { SealedVertex::own_id(id, i) },
        })
        .collect()
}

fn hull(tets: &[SealedTet]) -> Vec<([u32; 3], u32)> {
    let mut pairs = FacePairs::new(tets.len());
    for (t, tet) in tets.iter().enumerate() {
        for (i, f) in FACES.iter().enumerate() {
            let (face, odd) = sorted_face(f.map(|k| tet.nodes[k]));
            let paired = pairs.add(face, odd, (4 * t + i) as u32);
            assert!(matches!(paired, Paired::Open | Paired::With(_)));
        }
    }
    let open = pairs.open().map(|(_, _, reference)| {
        let (t, i) = (reference / 4, reference as usize % 4);
        (FACES[i].map(|k| tets[t as usize].nodes[k]), t)
    });
    open.collect()
}

fn codec<R: ChunkRecord + PartialEq>(name: &str, records: &[R], n_tets: usize) {
    let start = cpu_seconds();
    let mut packer = Packer::new(0, 1).expect("zstd");
    let mut chunks = Vec::new();
    for &r in records {
        chunks.extend(packer.push(r).expect("zstd"));
    }
    while let Some(chunk) = packer.cut().expect("zstd") {
        chunks.push(chunk);
    }
    let encode = cpu_seconds() - start;
    let mut decoder = Decoder::<R>::new().expect("zstd");
    let mut back = Vec::new();
    let start = cpu_seconds();
    for chunk in &chunks {
        decoder.decode(&chunk.value, chunk.address, &mut back).expect("undamaged");
    }
    let decode = cpu_seconds() - start;
    let bytes: usize = chunks.iter().map(|c| c.value.len()).sum();
    let rooms: usize =
        chunks.iter().map(|c| (c.value.len() + 16).next_power_of_two().max(4096)).sum();
    let n = records.len() as f64;
    println!(
        "{name}: {} chunks, {:.2} B a record, {:.2} B/tet, fill {:.3}; encode {:.1} M/s, decode {:.1} M/s",
        chunks.len(),
        bytes as f64 / n,
        rooms as f64 / n_tets as f64,
        bytes as f64 / rooms as f64,
        n / encode / 1e6,
        n / decode / 1e6,
    );
}

fn store(vertices: &[SealedVertex], tets: &[SealedTet]) {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("bench.tetdb");
    let mut catalog = Catalog::create(&path, &Job::default()).expect("a new store");
    let id = SubdomainId::new(0).expect("small");
    let facets = hull(tets);
    let start = cpu_seconds();
    let mut writer =
        SealedWriter::create(catalog.file_path(0, 1), id, 1, 48 << 20).expect("a new file");
    for &v in vertices {
        writer.push_vertex(v).expect("disk");
    }
    let all = tets.iter().map(|t| (t.nodes, t.region));
    writer.push_all_tets(all).expect("disk");
    for (triangle, (vertices, tet)) in (0..).zip(facets) {
        let facet =
            SealedFacet { vertices, label: 0, triangle, regions: [0, 1], tets: [NO_TET, tet] };
        writer.push_facet(facet).expect("disk");
    }
    let sealed = writer.finish().expect("disk");
    let seconds = cpu_seconds() - start;
    println!(
        "write: {:.2} M tets/s, file {:.2} B/tet",
        tets.len() as f64 / seconds / 1e6,
        sealed.row.bytes as f64 / tets.len() as f64
    );
    let commit = catalog.commit(|step| {
        step.list_file(0, 1);
        step.set_subdomain(&sealed.row);
        step.set_state(StoreState::Sealed);
        Ok(())
    });
    commit.expect("disk");
    catalog.close().expect("disk");
    for (level, megabytes) in [
        (Level::Element, 64),
        (Level::Adjacency, 64),
        (Level::Geometry, 64),
        (Level::Delaunay, 64),
        (Level::Delaunay, 512),
    ] {
        let options = VerifyOptions::new(level, megabytes << 20, dir.path().to_owned());
        let start = cpu_seconds();
        let report = Catalog::open(&path)
            .and_then(|mut s| verify(&mut s, None, &options))
            .expect("undamaged");
        let seconds = cpu_seconds() - start;
        assert!(report.valid, "{report:?}");
        println!(
            "verify {level:?} in {megabytes} MiB: {:.2} M tets/s, Delaunay share {:.4}",
            tets.len() as f64 / seconds / 1e6,
            report.delaunay_share()
        );
    }
}

/// CPU time of this process where the system tells it, else wall time; in hundredths.
fn cpu_seconds() -> f64 {
    use std::time::{SystemTime, UNIX_EPOCH};
    let told = std::fs::read_to_string("/proc/self/stat").ok();
    let ticks = told.and_then(|s| {
        let mut fields = s.rsplit(')').next()?.split_whitespace().skip(11);
        let user: f64 = fields.next()?.parse().ok()?;
        let system: f64 = fields.next()?.parse().ok()?;
        Some(user + system)
    });
    let wall = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
    ticks.map_or_else(wall, |t| t / 100.0)
}
