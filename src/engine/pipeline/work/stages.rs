//! Intermediate meshes of bisections, kept for inspection: the mesh before a bisection, the mesh with its refined zone, and the
//! interface faces before and after the choice.

use tetdb_schema::ids::SubdomainId;

use crate::pipeline::error::PipelineError;
use crate::pipeline::progress::Watcher;
use crate::pipeline::seal::compact::seal;
use crate::pipeline::seal::target::SealTarget;
use crate::pipeline::tree::read_blob;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{DiskPath, Pages};
use tetdb_kernel::bisect::{InterfaceFaces, Zone};
use tetdb_kernel::mesh::Mesh;
use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::catalog::{Stage, StageRow};
use tetdb_schema::topology::{StageFaces, Triangle};
use tetdb_store::sealed::{Form, Sealed};
use tetdb_store::store::{Catalog, Step, StoreError};

/// Generation of the first file; no sub-domain reaches so many.
const FIRST: u32 = 1 << 30;

/// Destination of the stages of one cut.
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
    /// Seals the current mesh. Effects: its scratch map is overwritten and cleared. Errors: the disk.
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
        stages.sealed.push((stage, seal(mesh, None, &target, watch)?));
        Ok(())
    }
}

impl Stages {
    /// Returns a row for each file.
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

    /// Returns the bytes of the interface faces, for [`list`].
    pub fn face_bytes(&self) -> Vec<u8> {
        match self.sealed.is_empty() {
            true => Vec::new(),
            false => {
                let triangles = |faces: &[[Point; 3]]| {
                    faces.iter().map(|face| face.map(|p| p.to_array())).collect()
                };
                let InterfaceFaces { natural, chosen } = &self.faces;
                let faces = StageFaces { natural: triangles(natural), chosen: triangles(chosen) };
                faces.to_bytes()
            }
        }
    }
}

/// Lists the files of a cut's stages in `step`.
pub fn list(rows: &[StageRow], faces: &[u8], step: &mut Step) {
    for stage in rows {
        step.list_file(stage.cut, stage.row.generation);
        step.set_stage(stage);
    }
    if let Some(stage) = rows.first() {
        step.set_blob(Blob::StageFaces(stage.cut), faces);
    }
}

/// Returns the faces of a cut's interface before and after the choice, if they were kept.
///
/// Errors: a damaged catalog.
pub fn stage_faces(catalog: &mut Catalog, cut: u32) -> Result<Option<InterfaceFaces>, StoreError> {
    if catalog.blob(Blob::StageFaces(cut))?.is_none() {
        return Ok(None);
    }
    let StageFaces { natural, chosen } = read_blob(catalog, Blob::StageFaces(cut))?;
    let points =
        |faces: Vec<Triangle>| faces.into_iter().map(|face| face.map(Point::from_array)).collect();
    Ok(Some(InterfaceFaces { natural: points(natural), chosen: points(chosen) }))
}
