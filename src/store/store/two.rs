//! A store of two sub-domains, written by hand for the tests of this crate and of those above.

use std::path::Path;

use tetdb_schema::ids::{Owner, SubdomainId, VertexId};
use tetdb_schema::record::{FACES, InterfaceFace, NO_TET, SealedFacet, SealedVertex, tag};

use super::*;
use crate::sealed::SealedWriter;

/// Two tetrahedra in each of two sub-domains, joined by the face of vertices 1 2 3.
pub fn two_subdomains(path: &Path) -> Result<(), StoreError> {
    let mut catalog = Catalog::create(path, &Job::default())?;
    let points =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
    // For each sub-domain: vertices, the tetrahedron, the face shared with the other one.
    let parts = [([0, 1, 2, 3], [0u32, 1, 2, 3], 0usize), ([4, 1, 2, 3], [0, 1, 3, 2], 0)];
    let mut sealed = Vec::new();
    for (rank, (vertices, nodes, shared)) in (0u32..).zip(parts) {
        let id = SubdomainId::new(rank).expect("small");
        let file = catalog.file_path(rank, 1);
        let mut writer = SealedWriter::create(&file, id, 1, 4 << 20)?;
        for v in vertices {
            writer.push_vertex(SealedVertex {
                point: points[v],
                h: 1.0,
                tag: tag::SURFACE,
                id: VertexId { owner: Owner::Surface, index: v as u32 }.number(),
            })?;
        }
        writer.push_all_tets(std::iter::once((nodes, 1)))?;
        let nodes = tetdb_schema::record::SealedTet { nodes, region: 1 }.rotated().nodes;
        for (i, corners) in FACES.iter().enumerate() {
            let face = corners.map(|c| nodes[c]);
            if i == shared {
                writer.push_interface_face(InterfaceFace {
                    vertices: face,
                    cut: 1,
                    index: 0,
                    other: 1 - rank,
                    tet: 0,
                })?;
            } else {
                writer.push_facet(SealedFacet {
                    vertices: face,
                    label: 0,
                    triangle: u64::from(rank) * 3 + i as u64 - 1,
                    regions: [0, 1],
                    tets: [NO_TET, 0],
                })?;
            }
        }
        sealed.push(writer.finish()?);
    }
    let side = sealed[0].interfaces[0];
    assert_eq!(side.digest, sealed[1].interfaces[0].digest);
    catalog.commit(|step| {
        step.set_labels(&vec!["label_0".to_owned()]);
        for part in &sealed {
            step.list_file(part.row.rank, 1);
            step.set_subdomain(&part.row);
            let neighbor = NeighborRow { subdomain: 1 - part.row.rank, faces: side.faces };
            step.set_topology(&TopologyRow { subdomain: part.row.rank, neighbors: vec![neighbor] });
        }
        step.set_interfaces(
            1,
            &vec![InterfaceRow {
                cut: 1,
                low: 0,
                high: 1,
                faces: side.faces,
                digest: side.digest.lanes,
            }],
        );
        step.set_state(StoreState::Sealed);
        Ok(())
    })?;
    catalog.close()
}
