//! Every kind of question is compared with a test of all tetrahedra, on a grid with many touching elements and on a real mesh.

mod grid;
mod near;
mod oracle;
mod place;
mod section;
mod value;

use std::collections::BTreeSet;

use tetdb_schema::ids::{TetId, VertexId};

use grid::Grid;
use tetdb_base::expr::Expression;
use tetdb_base::geom::{Aabb, Point, mix};
use tetdb_base::storage::Budget;
use tetdb_engine::pipeline::{MeshOptions, Subdomains};
use tetdb_schema::catalog::Job;
use tetdb_store::query::*;
use tetdb_store::store::Catalog;

type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// A store in its own folder.
struct Fixture {
    dir: tempfile::TempDir,
}

impl Fixture {
    fn path(&self) -> std::path::PathBuf {
        self.dir.path().join("a.tetdb")
    }

    fn session(&self, cap: u64) -> Outcome<QuerySession> {
        Ok(QuerySession::open(Catalog::open(self.path())?, &Budget::new(cap))?)
    }

    /// All tetrahedra, read without a query.
    fn all(&self) -> Outcome<Vec<Hit>> {
        let mut store = Catalog::open(self.path())?;
        let mut all = Vec::new();
        for row in store.subdomains()? {
            let mut part = store.open_subdomain(row.rank, 16 << 20)?;
            let tets = part.tets().collect::<Result<Vec<_>, _>>()?;
            let facets = part.facets().collect::<Result<Vec<_>, _>>()?;
            for (id, tet) in tets {
                let corners = part.corners(tet.nodes)?;
                let (ids, points) = (corners.map(|c| c.id), corners.map(|c| c.point));
                let own = facets.iter().filter(|f| f.tets.contains(&id.local()));
                let faces: Vec<[u32; 3]> = own.map(|facet| facet.vertices).collect();
                // A face is opposite the vertex that it lacks.
                let on_surface = tet.nodes.map(|v| faces.iter().any(|face| !face.contains(&v)));
                all.push(Hit {
                    on_surface: Some(on_surface),
                    ..Hit::new(id, tet.region, ids, points)
                });
            }
        }
        Ok(all)
    }
}

fn grid(cells: usize, parts: usize) -> Outcome<Fixture> {
    let fixture = Fixture { dir: tempfile::tempdir()? };
    Grid { cells, parts }.write(&fixture.path())?;
    Ok(fixture)
}

/// A mesh of two sub-domains with several chunks.
fn real() -> Outcome<Fixture> {
    real_of("box,h=0.05")
}

/// A sample in two sub-domains.
fn real_of(sample: &str) -> Outcome<Fixture> {
    let fixture = Fixture { dir: tempfile::tempdir()? };
    let surface = tetdb_kernel::samples::SampleSpec::parse(sample)?.make()?;
    let subdomains = Subdomains::Exactly(2);
    let options = MeshOptions { subdomains, ..MeshOptions::default() };
    let job = Job { options: serde_json::to_string(&options)?, ..Job::default() };
    let options = options.into();
    let mut catalog = Catalog::create(fixture.path(), &job)?;
    let budget = Budget::new(512 << 20);
    tetdb_engine::pipeline::mesh(&mut catalog, &surface.into(), &options, &budget, &|_| {})?;
    catalog.close()?;
    Ok(fixture)
}

/// A reproducible sequence of random numbers.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(mix(seed))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(1);
        mix(self.0)
    }

    /// A number from 0 to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn point(&mut self, bounds: &Aabb) -> Point {
        let share = Point::new(self.share(), self.share(), self.share());
        bounds.low + (bounds.high - bounds.low) * share
    }

    /// A point on the lattice of half cells of a grid, inside it or one step outside.
    fn lattice(&mut self, cells: usize) -> Point {
        let mut axis = || self.below(2 * cells + 3) as f64 / 2.0 - 0.5;
        Point::new(axis(), axis(), axis())
    }
}

fn ids(found: impl IntoIterator<Item = Result<Hit, QueryError>>) -> Outcome<Vec<TetId>> {
    let mut ids = Vec::new();
    for tet in found {
        ids.push(tet?.id);
    }
    Ok(ids)
}

/// Compares the answers with a test of all tetrahedra. Returns their number.
fn expect(
    session: &mut QuerySession,
    all: &[Hit],
    selection: Selection,
    holds: impl Fn(&Hit) -> bool,
) -> Outcome<usize> {
    let found = ids(session.select(selection.clone())?)?;
    let expected: Vec<TetId> = all.iter().filter(|t| holds(t)).map(|t| t.id).collect();
    assert_eq!(found, expected, "{selection:?}");
    Ok(found.len())
}
