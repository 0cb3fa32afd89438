//! Valid stores pass; each way to break one is found by its name.

use tetdb_schema::ids::{Owner, SubdomainId, VertexId};
use tetdb_schema::record::{FACES, NO_TET, SealedFacet, SealedTet, SealedVertex, tag};

use super::*;
use crate::sealed::SealedWriter;
use crate::store::Catalog;
use tetdb_base::geom::Point;
use tetdb_schema::catalog::{Job, StoreState, SubdomainRow, TopologyRow};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// A mesh before it is sealed: a box of cells, six tetrahedra each.
struct Draft {
    points: Vec<[f64; 3]>,
    tets: Vec<([u32; 4], u32)>,
    facets: Vec<SealedFacet>,
    surface: Surface,
}

fn draft(n: u32) -> Draft {
    let at = |x: u32, y: u32, z: u32| (x * (n + 1) + y) * (n + 1) + z;
    let mut points = Vec::new();
    for x in 0..=n {
        for y in 0..=n {
            for z in 0..=n {
                points.push([x, y, z].map(f64::from));
            }
        }
    }
    let mut tets = Vec::new();
    // Each cell along its diagonal, one tetrahedron for each order of the axes.
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    for cell in 0..n * n * n {
        let low = [cell / (n * n), cell / n % n, cell % n];
        for (k, order) in orders.iter().enumerate() {
            let mut corner = low;
            let mut nodes = [at(low[0], low[1], low[2]); 4];
            for (i, &axis) in order.iter().enumerate() {
                corner[axis] += 1;
                nodes[i + 1] = at(corner[0], corner[1], corner[2]);
            }
            if k >= 3 {
                nodes.swap(2, 3);
            }
            let region = 1 + u32::from(low[0] * 2 >= n);
            tets.push((SealedTet { nodes, region }.rotated().nodes, region));
        }
    }
    tets.sort_unstable();
    let (facets, surface) = boundary(&points, &tets);
    Draft { points, tets, facets, surface }
}

/// Faces with one side, or between regions, become the input.
fn boundary(points: &[[f64; 3]], tets: &[([u32; 4], u32)]) -> (Vec<SealedFacet>, Surface) {
    let mut sides = std::collections::BTreeMap::<[u32; 3], Vec<([u32; 3], u32, u32)>>::new();
    for (t, (nodes, region)) in (0..).zip(tets) {
        for face in FACES {
            let vertices = face.map(|k| nodes[k]);
            let mut key = vertices;
            key.sort_unstable();
            sides.entry(key).or_default().push((vertices, t, *region));
        }
    }
    let mut surface = Surface {
        points: points.iter().map(|&p| Point::from_array(p)).collect(),
        label_names: vec!["all".to_owned()],
        ..Surface::default()
    };
    let mut facets = Vec::new();
    for group in sides.values() {
        let front = group.get(1).map_or((NO_TET, 0), |s| (s.1, s.2));
        let (vertices, t, region) = group[0];
        if front.1 == region {
            continue;
        }
        facets.push(SealedFacet {
            vertices,
            label: 0,
            triangle: facets.len() as u64,
            regions: [front.1, region],
            tets: [front.0, t],
        });
        surface.triangles.push(vertices);
        surface.labels.push(0);
    }
    (facets, surface)
}

fn verified(draft: &Draft, level: Level) -> Result<Report, StoreError> {
    let dir = tempfile::tempdir().expect("a folder for the test");
    let path = dir.path().join("a.tetdb");
    let mut catalog = Catalog::create(&path, &Job::default())?;
    let id = SubdomainId::new(0).expect("small");
    let mut writer = SealedWriter::create(catalog.file_path(0, 1), id, 1, 4 << 20)?;
    for (index, &point) in (0..).zip(&draft.points) {
        writer.push_vertex(SealedVertex {
            point,
            h: 1.0,
            tag: tag::SURFACE,
            id: VertexId { owner: Owner::Surface, index }.number(),
        })?;
    }
    writer.push_all_tets(draft.tets.iter().copied())?;
    for &facet in &draft.facets {
        writer.push_facet(facet)?;
    }
    let sealed = writer.finish()?;
    catalog.commit(|step| {
        step.list_file(0, 1);
        step.set_subdomain(&sealed.row);
        step.set_state(StoreState::Sealed);
        Ok(())
    })?;
    catalog.close()?;
    let mut store = Catalog::open(&path)?;
    let [tets, faces] = digest(&mut store, 1 << 20)?;
    assert_eq!([tets, faces], store.digest()?);
    let options = VerifyOptions::new(level, 4 << 20, dir.path().to_owned());
    let report = verify(&mut store, Some(&draft.surface), &options)?;
    assert_eq!(report.digest, tets.to_string());
    let surface = Some(&draft.surface);
    let catalog = store.share();
    let shared = verify_shared(&mut store, surface, &options, &mut |rows, apex, add| {
        for row in rows {
            let mut part = catalog.open_row(row.clone(), 1 << 20)?;
            add(verify_part(&mut part, apex, surface, &options)?)?;
        }
        Ok(())
    })?;
    assert_eq!(shared, report, "looked at apart and added up");
    Ok(report)
}

#[test]
fn a_valid_mesh_is_valid_on_every_level() -> Outcome {
    let draft = draft(12);
    for level in [Level::Element, Level::Adjacency, Level::Topology, Level::Geometry] {
        let report = verified(&draft, level)?;
        assert!(report.valid, "{report:?}");
    }
    let report = verified(&draft, Level::Delaunay)?;
    assert!(report.valid, "{report:?}");
    assert_eq!(report.tets, 12 * 12 * 12 * 6);
    assert_eq!(report.triangles_present, draft.surface.triangles.len() as u64);
    // Six sides of the box; the wall between the regions has two.
    assert_eq!(report.boundary_faces, 6 * 12 * 12 * 2);
    assert_eq!(report.inner_faces * 2 + report.boundary_faces, report.tets * 4);
    assert!((report.volume - 1728.0).abs() < 1e-9);
    assert!(report.delaunay_share() == 1.0, "cells of a grid are cospherical");
    serde_json::to_string(&report)?;
    Ok(())
}

#[test]
fn a_mesh_of_many_chunks_pairs_its_faces() -> Outcome {
    let draft = draft(26);
    let report = verified(&draft, Level::Delaunay)?;
    assert!(report.tets > 3 * 32_768 && report.valid, "{report:?}");
    assert_eq!(report.inner_faces * 2 + report.boundary_faces, report.tets * 4);
    Ok(())
}

#[test]
fn each_fault_is_found_by_its_name() -> Outcome {
    type Break = fn(&mut Draft);
    let faults: [(Finding, Break); 12] = [
        (Finding::OpenFace, |d| d.tets.truncate(d.tets.len() - 1)),
        (Finding::CrowdedFace, |d| d.tets.push(d.tets[40])),
        (Finding::NotPositive, |d| d.tets[33].0.swap(2, 3)),
        (Finding::NotPositive, |d| d.points[43] = d.points[42]),
        (Finding::RepeatedNode, |d| d.tets[7].0[2] = d.tets[7].0[3]),
        (Finding::UnusedVertex, |d| d.points.push([9.0; 3])),
        (Finding::MissingTriangle, |d| d.facets.truncate(d.facets.len() - 1)),
        (Finding::StrayFacet, |d| d.facets[5].tets[1] ^= 1),
        (Finding::RegionLeak, |d| d.tets[3].1 = 9),
        (Finding::NotAnInputTriangle, |d| d.facets[9].triangle = 8),
        (Finding::NotAnInputTriangle, |d| d.surface.points[0].x = -1e-300),
        (Finding::OneSidedFacet, |d| {
            let wall = d.facets.iter_mut().find(|f| f.tets[0] != NO_TET);
            wall.expect("a wall between regions").tets[0] = NO_TET;
        }),
    ];
    for (finding, fault) in faults {
        let mut draft = draft(4);
        fault(&mut draft);
        let report = verified(&draft, Level::Delaunay)?;
        assert!(!report.valid);
        assert!(report.count(finding) > 0, "{finding:?}: {report:?}");
        assert!(report.offenders.iter().any(|o| o.finding == finding));
    }
    Ok(())
}

#[test]
fn two_subdomains_verify_and_a_changed_interface_is_found() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("two.tetdb");
    crate::store::two_subdomains(&path)?;
    let options = VerifyOptions::new(Level::Delaunay, 4 << 20, dir.path().to_owned());
    let report = verify(&mut Catalog::open(&path)?, None, &options)?;
    assert!(report.valid, "{report:?}");
    assert_eq!((report.subdomains, report.interface_faces), (2, 2));
    let mut catalog = Catalog::open_writable(&path)?;
    let mut rows = catalog.interfaces()?;
    rows[0].digest[1] ^= 1;
    catalog.commit(|step| {
        step.set_interfaces(1, &rows);
        Ok(())
    })?;
    catalog.close()?;
    let report = verify(&mut Catalog::open(&path)?, None, &options)?;
    assert_eq!(report.count(Finding::CatalogDiffers), 1);
    Ok(())
}

#[test]
fn every_row_that_was_changed_is_found() -> Outcome {
    type Change = fn(&mut SubdomainRow, &mut Vec<TopologyRow>);
    let changes: [Change; 9] = [
        |row, _| row.volume *= 1.0 + 1e-12,
        |row, _| row.bounds[1][0] += 1.0,
        |row, _| row.bytes += 1,
        |row, _| row.quality.bins.swap(0, 9),
        |row, _| row.quality.worst += 1.0,
        |row, _| row.quality.worst_tet += 1,
        |row, _| row.quality.dihedral[0] *= 0.5,
        |_, topology| topology[1].neighbors[0].faces += 1,
        |_, topology| topology[0].neighbors.clear(),
    ];
    let dir = tempfile::tempdir()?;
    let options = VerifyOptions::new(Level::Topology, 4 << 20, dir.path().to_owned());
    for (i, change) in changes.into_iter().enumerate() {
        let path = dir.path().join(format!("{i}.tetdb"));
        crate::store::two_subdomains(&path)?;
        let mut catalog = Catalog::open_writable(&path)?;
        let (mut row, mut topology) = (catalog.subdomain(1)?, catalog.topology()?);
        change(&mut row, &mut topology);
        catalog.commit(|step| {
            step.set_subdomain(&row);
            topology.iter().for_each(|row| step.set_topology(row));
            Ok(())
        })?;
        catalog.close()?;
        let report = verify(&mut Catalog::open(&path)?, None, &options)?;
        assert_eq!(report.count(Finding::CatalogDiffers), 1, "change {i}");
    }
    Ok(())
}

#[test]
fn a_row_without_sense_is_damage_and_no_panic() -> Outcome {
    type Change = fn(&mut SubdomainRow);
    let changes: [Change; 4] = [
        |row| row.bounds[0][1] = f64::NAN,
        |row| row.bounds.swap(0, 1),
        |row| row.bounds[1][2] = f64::INFINITY,
        |row| row.quality.worst = f64::NAN,
    ];
    for change in changes {
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("a.tetdb");
        crate::store::two_subdomains(&path)?;
        let mut catalog = Catalog::open_writable(&path)?;
        let mut row = catalog.subdomain(0)?;
        change(&mut row);
        catalog.commit(|step| {
            step.set_subdomain(&row);
            Ok(())
        })?;
        let refused = Catalog::open(&path)?.subdomains().map(drop);
        assert!(refused.is_err_and(|error| error.is_damage()));
    }
    Ok(())
}
