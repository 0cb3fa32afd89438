//! Meshes on their way, kept to be looked at: of each bisection the mesh before it, the mesh with its zone refined, and the faces of
//! the interface before and after the choice.

use tetdb_schema::ids::SubdomainId;

use crate::pipeline::error::PipelineError;
use crate::pipeline::progress::Watcher;
use crate::pipeline::seal::compact::seal;
use crate::pipeline::seal::target::SealTarget;
use crate::pipeline::tree::blob;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{DiskPath, Pages};
use tetdb_kernel::bisect::{InterfaceFaces, Zone};
use tetdb_kernel::mesh::Mesh;
use tetdb_schema::catalog::{Stage, StageRow};
use tetdb_store::sealed::SealedError;
use tetdb_store::sealed::{Form, Sealed};
use tetdb_store::store::{Catalog, Step, StoreError};

/// Generation of the first file; no sub-domain has as many.
const FIRST: u32 = 1 << 30;

/// Where the stages of one cut go.
pub struct StageFiles<'a> {
    pub cut: u32,
    pub output: &'a DiskPath,
    pub scratch: &'a DiskPath,
    pub memory: u64,
    pub bounds: Aabb,
}

/// The stages of one cut; their files are not yet listed.
#[derive(Default)]
pub struct Stages {
    sealed: Vec<(Stage, Sealed)>,
    pub faces: InterfaceFaces,
}

fn generation(stage: Stage) -> u32 {
    FIRST + stage as u32
}

impl StageFiles<'_> {
    /// Seals the mesh as it is. Effects: its scratch map is used up. Errors: the disk.
    pub fn save<P: Pages>(
        &self,
        mesh: &mut Mesh<P>,
        stage: Stage,
        stages: &mut Stages,
        watch: &Watcher,
    ) -> Result<(), PipelineError> {
        let name = Catalog::file_name(self.cut, generation(stage));
        let target = SealTarget {
            form: Form::Packed,
            path: &self.output.join(name),
            scratch: self.scratch,
            subdomain: SubdomainId::new(self.cut).expect("fewer cuts than ranks"),
            generation: generation(stage),
            memory: self.memory,
            bounds: self.bounds,
            owners: None,
        };
        mesh.refresh_tet_of();
        stages.sealed.push((stage, seal(mesh, &target, watch)?));
        Ok(())
    }
}

impl Stages {
    /// A row for each file.
    pub fn rows(&self, zone: &Zone) -> Vec<StageRow> {
        let row = |(stage, sealed): &(Stage, Sealed)| StageRow {
            cut: zone.cut,
            stage: *stage,
            normal: zone.surface.normal.to_array(),
            offset: zone.surface.offset,
            row: sealed.row.clone(),
        };
        self.sealed.iter().map(row).collect()
    }

    /// The faces of the interface, for [`list`].
    pub fn face_bytes(&self) -> Vec<u8> {
        match self.sealed.is_empty() {
            true => Vec::new(),
            false => to_bytes(&self.faces),
        }
    }
}

/// Lists the files of a cut's stages.
pub fn list(rows: &[StageRow], faces: &[u8], step: &mut Step) {
    for stage in rows {
        step.list_file(stage.cut, stage.row.generation);
        step.set_stage(stage);
    }
    if let Some(stage) = rows.first() {
        step.set_blob(blob::FACES + stage.cut, faces);
    }
}

/// The number of natural faces, then nine numbers for each face.
fn to_bytes(faces: &InterfaceFaces) -> Vec<u8> {
    let mut bytes = (faces.natural.len() as u64).to_le_bytes().to_vec();
    for corner in faces.natural.iter().chain(&faces.chosen).flatten() {
        for x in corner.to_array() {
            bytes.extend_from_slice(&x.to_le_bytes());
        }
    }
    bytes
}

fn from_bytes(bytes: &[u8]) -> Option<InterfaceFaces> {
    let (head, rest) = bytes.split_first_chunk::<8>()?;
    let number = |b: &[u8]| f64::from_le_bytes(std::array::from_fn(|i| b[i]));
    let numbers: Vec<f64> = rest.chunks_exact(8).map(number).collect();
    let face = |c: &[f64]| [0, 3, 6].map(|k| Point::new(c[k], c[k + 1], c[k + 2]));
    let mut faces: Vec<[Point; 3]> = numbers.chunks_exact(9).map(face).collect();
    let natural = usize::try_from(u64::from_le_bytes(*head)).ok()?;
    if natural > faces.len() || rest.len() != faces.len() * 72 {
        return None;
    }
    let chosen = faces.split_off(natural);
    Some(InterfaceFaces { natural: faces, chosen })
}

/// The faces of a cut's interface before and after the choice, where they were kept.
///
/// Errors: a damaged catalog.
pub fn stage_faces(catalog: &mut Catalog, cut: u32) -> Result<Option<InterfaceFaces>, StoreError> {
    let Some(bytes) = catalog.blob(blob::FACES + cut)? else {
        return Ok(None);
    };
    let faces = from_bytes(&bytes).ok_or_else(|| {
        StoreError::Sealed(SealedError::Content {
            path: catalog.dir().to_owned(),
            subdomain: cut,
            what: format!("the faces kept of cut {cut} are damaged"),
        })
    });
    faces.map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_come_back_from_their_bytes() {
        let face = |x: f64| [Point::splat(x), Point::X, Point::new(0.1, x, 3.0)];
        let faces =
            InterfaceFaces { natural: vec![face(1.0), face(-2.5)], chosen: vec![face(1e9)] };
        let bytes = to_bytes(&faces);
        assert_eq!(from_bytes(&bytes), Some(faces));
        assert_eq!(from_bytes(&bytes[..bytes.len() - 8]), None);
        assert_eq!(from_bytes(&[7, 0, 0, 0, 0, 0, 0, 0]), None);
    }
}
