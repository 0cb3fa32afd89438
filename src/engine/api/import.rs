//! Importing a tetrahedral mesh made by another program.

use std::path::{Path, PathBuf};

use super::error::Remedy;
use super::field_spec::NewField;
use super::fields;
use super::mesher::verify_new;
use super::preflight::{scratch_beside, with_free_space};
use super::store::say_how_locked;
use super::surface::source;
use super::{
    Bytes, Error, Existing, Mesher, Settings, Store, Subdomains, Surface, guarded, job, replace,
};
use crate::pipeline::{self, MeshOptions, PipelineError, StoreValues};
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface;
use tetdb_io::read::{MeshFields, RawField, RawMesh, read_tets, tets_file};
use tetdb_schema::code::Code;
use tetdb_schema::field::{FieldNumber, FieldPlace};
use tetdb_schema::source::{Origin, Source};
use tetdb_store::store::{Catalog, StoreError};

/// Imports a tetrahedral mesh made by another program into a new store.
///
/// The mesh is checked: every tetrahedron has an exactly positive volume, and two tetrahedra share a whole face, an edge, a vertex or
/// nothing. No vertex moves and no tetrahedron is changed. Boundary, faces between regions and labelled triangles are the store's surface.
/// The store is finished, and everything works on it that works on a mesh of ours. [`Store::remesh`] starts from the faces around a
/// sub-domain and its regions.
///
/// ```no_run
/// # use tetdb_engine::api as tetdb;
/// let store = tetdb::Import::new("part.msh").create("part.tetdb")?;
/// # Ok::<(), tetdb::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Import {
    file: PathBuf,
    subdomains: Subdomains,
    part_field: Option<String>,
    region_field: Option<String>,
    settings: Settings,
    existing: Existing,
    verify: bool,
    fields: bool,
}

impl Import {
    /// Imports the mesh in a file: MEDIT, Gmsh, VTK, TetGen, Abaqus or NumPy arrays.
    pub fn new(file: impl AsRef<Path>) -> Self {
        Self {
            file: file.as_ref().to_owned(),
            subdomains: Subdomains::Auto,
            part_field: None,
            region_field: None,
            settings: Settings::new(),
            existing: Existing::default(),
            verify: true,
            fields: true,
        }
    }

    /// Sets the number of sub-domains. Default: one for every ten million tetrahedra.
    pub fn subdomains(mut self, n: Subdomains) -> Self {
        self.subdomains = n;
        self
    }

    /// Takes the sub-domains from this array of the file's cells, in place of planes. In Gmsh files it is the partition, under
    /// any name; `partition` is that of a .vtkhdf file.
    pub fn part_field(mut self, name: impl Into<String>) -> Self {
        self.part_field = Some(name.into());
        self
    }

    /// Takes the regions from this array of the file's cells. Default: `region`, where the file has one.
    pub fn region_field(mut self, name: impl Into<String>) -> Self {
        self.region_field = Some(name.into());
        self
    }

    /// Replaces all settings of the run.
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// Limits the memory of the run; see [`Settings::memory`].
    pub fn memory(mut self, cap: Bytes) -> Self {
        self.settings = self.settings.memory(cap);
        self
    }

    /// Sets the treatment of a store that already exists at the path. [`Existing::Keep`] refuses it.
    pub fn existing(mut self, existing: Existing) -> Self {
        self.existing = existing;
        self
    }

    /// Sets whether the finished store is verified. Default: true.
    pub fn verify(mut self, verify: bool) -> Self {
        self.verify = verify;
        self
    }

    /// Sets whether arrays of values become fields of the store. Default: true.
    pub fn fields(mut self, fields: bool) -> Self {
        self.fields = fields;
        self
    }

    /// Imports into a new store at `path` and opens it. An interrupted import leaves no store.
    ///
    /// # Errors
    /// Those of the file, with its place; `bad-mesh` with the first tetrahedra that are at fault; too little memory or disk.
    pub fn create(self, path: impl AsRef<Path>) -> Result<Store, Error> {
        let settings = self.settings.clone();
        self.create_reported(path.as_ref())?;
        Store::open_with(path, settings)
    }

    /// Like [`Import::create`], but does not open the store.
    pub fn create_reported(&self, path: &Path) -> Result<(), Error> {
        guarded(&self.settings, || self.run(path))
    }

    fn run(&self, path: &Path) -> Result<(), Error> {
        let settings = &self.settings;
        let cap = settings.cap()?;
        replace::settle(path, settings)?;
        Mesher::check_path(path, self.existing)?;
        if self.existing == Existing::Keep && path.exists() && !Catalog::is_vacant(path) {
            return Err(StoreError::Finished { path: path.to_owned() }.into());
        }
        if self.subdomains == Subdomains::Exactly(0) {
            let value = "0".to_owned();
            return Err(PipelineError::Option { option: "subdomains", value }.into());
        }
        let origin = self.origin()?;
        let scratch = scratch_beside(&surface::Surface::default(), cap / 16 * 7, path)?;
        let mut raw = RawMesh::new(scratch.clone());
        let fields = MeshFields {
            part: self.part_field.as_deref(),
            region: self.region_field.as_deref(),
            values: self.fields.then_some(may_be_field as fn(&str) -> bool),
        };
        read_tets(&self.file, fields, &mut raw).map_err(in_terms_of_meshes)?;
        let subdomains = self.subdomains.count();
        let watch = settings.watcher();
        let mut placed = pipeline::place(raw, subdomains, &scratch, &watch)
            .map_err(|e| self.placed_in(e.into()))?;
        placed.notes.iter().for_each(|note| settings.note(format!("note: {note}")));
        settings.note(format!("memory: {}", settings.cap_in_words()));
        let surface = Surface::imported(std::mem::take(&mut placed.surface), origin, &scratch)?;
        let (options, new) = (self.options(placed.n_parts), replace::new_of(path));
        replace::take_up(path, |_| false)?;
        let job = job::job(&options, &surface.sources);
        let mut catalog = Catalog::create_with(&new, &job, pipeline::record_recipe)?;
        let lock = catalog.lock().expect("it is open for writing");
        say_how_locked(&catalog, settings);
        let written = surface.keep_in(&new).and_then(|()| {
            let written = attempt(|| {
                pipeline::write_placed(&mut catalog, placed, &surface.inner, &scratch, &watch)
            });
            let written = written.map_err(Error::from)?;
            let values = written.map_err(|e| with_free_space(e.into(), &new, None))?;
            attempt(|| add_values(&mut catalog, settings, values))?
                .map_err(|e| with_free_space(e, &new, None))
        });
        if let Err(error) = written {
            drop(catalog);
            replace::remove(&new)?;
            return Err(error);
        }
        catalog.close()?;
        replace::exchange(path, &lock)?;
        if self.verify {
            verify_new(path, Some(&surface.inner), cap, settings, lock)?;
        }
        Ok(())
    }

    /// The file as the store records it.
    fn origin(&self) -> Result<Source, Error> {
        let is_array = self.file.extension().is_some_and(|ending| ending == "npy");
        let of = match is_array {
            true => source(&tets_file(&self.file))?,
            false => source(&self.file)?,
        };
        let file = of.origin.file().unwrap_or_default().to_owned();
        Ok(Source { origin: Origin::Imported(file), ..of })
    }

    fn options(&self, n_parts: u32) -> MeshOptions {
        let subdomains = Subdomains::Exactly(n_parts);
        MeshOptions { subdomains, drop_coarse: true, ..MeshOptions::default() }
    }

    /// Adds the file to the place of an error.
    fn placed_in(&self, error: Error) -> Error {
        match (error.code(), error.place()) {
            (Code::BadMesh, Some(place)) if !place.is_empty() => {
                let place = format!("{}, {place}", self.file.display());
                error.at(place)
            }
            (Code::BadMesh, _) => error.at(self.file.display()),
            _ => error,
        }
    }
}

/// Names of columns that exports write and the store has anyway.
const EXPORTED: [&str; 4] = ["global_id", "vertex_id", "input_id", "label"];

/// Returns whether an array of this name may be a field.
fn may_be_field(name: &str) -> bool {
    let new = NewField::new(name, FieldPlace::Vertices);
    !EXPORTED.contains(&name) && new.row(FieldNumber::F64, 1).is_ok()
}

/// Makes fields of the values of the file.
fn add_values(
    catalog: &mut Catalog,
    settings: &Settings,
    values: StoreValues,
) -> Result<(), Error> {
    let StoreValues { fields, mut order } = values;
    for RawField { name, place, number, components, words } in fields {
        let row = NewField::new(&name, place).row(number, components)?;
        let (order, mut words) =
            (&mut order[usize::from(place == FieldPlace::Tets)], words.finish());
        let mut next = 0;
        fields::add(catalog, settings, row, &mut |mesh, chunk| {
            let count = match place {
                FieldPlace::Tets => mesh.tet_summaries()[chunk as usize].count,
                FieldPlace::Vertices => mesh.vertex_summaries()[chunk as usize].count,
            } as usize;
            let n = components as usize;
            let mut chunk = Vec::with_capacity(count * n);
            for i in next..next + count {
                let first = order.get(i) as usize * n;
                (first..first + n).for_each(|k| chunk.push(words.get(k)));
            }
            next += count;
            Ok(chunk)
        })?;
    }
    Ok(())
}

/// Replaces help for surfaces by help for meshes.
fn in_terms_of_meshes(error: tetdb_io::read::ReadError) -> Error {
    let error = Error::from(error);
    match error.code() {
        Code::UnsupportedContent => error.with_help(
            "write the mesh with tetrahedra alone in the volume, for example as .vtu or .msh of version 4.1",
        ),
        Code::BadField => error.with_remedy(Remedy::General),
        _ => error,
    }
}

impl Surface {
    /// The surface of an imported mesh. The store keeps a copy of it.
    fn imported(
        inner: surface::Surface,
        origin: Source,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        let turned = Self::given(inner).oriented(scratch)?;
        let mut surface = Self::given(turned.inner);
        surface.sources.push(origin);
        Ok(surface)
    }
}
