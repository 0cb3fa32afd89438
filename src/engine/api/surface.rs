//! The input surface: reading, checking, refining and embedding sheets.

use std::io::Read;
use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use tetdb_schema::catalog::SurfaceSource;
use tetdb_schema::source::{BOUNDARY_OF, NamedFile, Origin, Source};
use xxhash_rust::xxh3::Xxh3;

use super::error::{Error, Remedy};
use super::{DefectPlace, Length, Settings, guarded};
use tetdb_base::geom::Point;
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::{self, SplitReport, SurfaceBuilder, orient_alike_with, split};
use tetdb_io::read::{WireKind, boundary_of, is_stream, read_surface_in};
use tetdb_io::write::{self, SurfaceWritten};
use tetdb_kernel::samples::{PREFIX, SampleSpec};
use tetdb_kernel::sizing::{ExtraSizes, SizeField, SizeOptions};

/// A triangle surface with labels, read from files, generated or given as arrays.
///
/// Invariant: all triangles are oriented like their neighbors. A surface is not validated on its own; [`Mesher`](super::Mesher)
/// validates it before meshing starts.
#[derive(Clone, Debug)]
pub struct Surface {
    #[doc(hidden)]
    pub inner: surface::Surface,
    #[doc(hidden)]
    pub sources: Vec<Source>,
    /// Number of triangles whose orientation was reversed.
    #[doc(hidden)]
    pub turned: usize,
    /// True if triangles are divided where embedded edges and points lie on them.
    pub(super) divides: bool,
    /// Distance within which embedded points and ends of embedded edges are moved onto triangles.
    pub(super) snaps: Option<Length>,
}

/// Defects of a surface, and measures of its triangles.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct CheckReport {
    /// Each defect as an error; about a hundred at most.
    pub defects: Vec<Error>,
    /// Place of each defect. Shape: parallel to `defects`.
    pub places: Vec<DefectPlace>,
    /// Number of all defects, listed or not.
    pub n_defects: u64,
    /// Edges with one triangle.
    pub n_open_edges: usize,
    /// Triangles with an angle below five degrees.
    pub n_small_angles: usize,
    /// Triangles on which every tetrahedron has quality q ≥ 2.
    pub n_forcing_triangles: usize,
    /// Least, median and greatest edge length, in input units.
    pub edges: [f64; 3],
    /// Enclosed volume in cubed input units; `None` for an open surface.
    pub volume: Option<f64>,
}

impl CheckReport {
    /// Returns whether the surface can be meshed.
    pub fn is_valid(&self) -> bool {
        self.n_defects == 0
    }

    fn error_of(defect: &surface::Defect, validation: &surface::Validation) -> Error {
        let files = &validation.files;
        Error::new(defect.code(), defect.in_words(files))
            .at(defect.place(files))
            .with_help(defect.help())
    }

    fn of(validation: &surface::Validation, fitness: &surface::Fitness) -> Self {
        let defects = validation.defects.iter();
        let defects = defects.map(|d| Self::error_of(d, validation));
        Self {
            defects: defects.collect(),
            places: DefectPlace::all_of(validation),
            n_defects: validation.n_defects,
            n_open_edges: validation.closedness.open.len(),
            n_small_angles: fitness.small_angles as usize,
            n_forcing_triangles: fitness.forcing_triangles as usize,
            edges: [fitness.edge_min, fitness.edge_median, fitness.edge_max],
            volume: fitness.volume,
        }
    }
}

/// Divides triangles until their edges are as short as `options` require. Where the surface is finer, sizes grow from its edges.
///
/// Errors: more triangles than fit in the memory of `scratch`.
pub(super) fn refine(
    surface: &surface::Surface,
    options: &SizeOptions,
    scratch: &ScratchSpace,
) -> Result<(surface::Surface, SplitReport), Error> {
    refuse_sheets(surface, "refined")?;
    let wanted = (options.hsiz).map_or(f64::INFINITY, |l| l.resolve(surface.bounds().diagonal()));
    let (points, triangles) = (&surface.points, &surface.triangles);
    let built =
        || SizeField::build_with(points, triangles, options, &ExtraSizes::default(), scratch);
    let (field, _) = attempt(built)??;
    let left = scratch.available().saturating_sub(field.bytes() as u64);
    Ok(split(surface, &|p| field.h(p).min(wanted), left)?)
}

/// Refuses an operation on a surface with sheets or embedded edges and points. `what` is the operation, as a participle.
pub(super) fn refuse_sheets(surface: &surface::Surface, what: &str) -> Result<(), Error> {
    match surface.has_sheets() || surface.has_embedded() {
        false => Ok(()),
        true => {
            Err(Error::new(Code::Usage, format!("a surface is {what} before anything is embedded")))
        }
    }
}

impl Surface {
    /// Reads files as one surface. Each file is one label, unless the file has labels of its own.
    ///
    /// Formats: STL, PLY, OBJ, OFF, 3MF, GIFTI, MEDIT, Gmsh, TetGen, VTK, Abaqus, Nastran and I-DEAS, also compressed as `.gz` or `.zst`, and pipes.
    ///
    /// Errors: a file that cannot be read, with the line or byte.
    pub fn read<P: AsRef<Path>>(files: impl IntoIterator<Item = P>) -> Result<Self, Error> {
        let paths: Vec<PathBuf> = files.into_iter().map(|p| p.as_ref().to_owned()).collect();
        guarded(&Settings::new(), || {
            let scratch = Settings::new().scratch_space(0)?;
            let whole = ScratchSpace::boundless();
            Self::read_in(&paths, &scratch)?.oriented(&whole)?.with_own_edges(&whole)
        })
    }

    /// The boundary of the volume cells of a mesh file (`.msh`, `.mesh`, `.meshb`, `.ele`), and faces between its regions.
    ///
    /// A triangle has the name of its region as label, one between two regions both names; each volume has a seed. Surface cells are
    /// left out. [`Surface::read`] does the same for a file with volume cells alone.
    ///
    /// Errors: as [`Surface::read`]; `unsupported-content` if three cells share a face.
    pub fn boundary_of(file: impl AsRef<Path>) -> Result<Self, Error> {
        let path = file.as_ref();
        if is_stream(path) {
            return Err(Error::new(
                Code::UnsupportedContent,
                "a stream cannot be read for its boundary",
            )
            .at(path.display())
            .with_help("write it to a file first"));
        }
        let mut word = std::ffi::OsString::from(BOUNDARY_OF);
        word.push(path);
        Self::read([word])
    }

    /// A surface from arrays.
    ///
    /// Shape: each triangle is three positions in `points`. `labels`, if given, runs parallel to `triangles` and has a name for each.
    /// Triangles are counter-clockwise seen from outside, or all clockwise. The store keeps a copy of such a surface.
    ///
    /// Errors: `index-out-of-range`, `not-a-number` and `count-mismatch` name the triangle or the point.
    pub fn from_arrays(
        points: &[[f64; 3]],
        triangles: &[[u32; 3]],
        labels: Option<&[&str]>,
    ) -> Result<Self, Error> {
        if let Some(labels) = labels.filter(|labels| labels.len() != triangles.len()) {
            let message = format!("{} labels for {} triangles", labels.len(), triangles.len());
            return Err(Error::new(Code::CountMismatch, message)
                .with_help("give one label for each triangle"));
        }
        guarded(&Settings::new(), || {
            let add = |builder: &mut SurfaceBuilder| {
                for (i, triangle) in triangles.iter().enumerate() {
                    let label = builder.label(labels.map_or("surface", |labels| labels[i]));
                    builder.triangle(*triangle, label)?;
                }
                Ok(())
            };
            Self::built(points, add)?.oriented(&ScratchSpace::boundless())
        })
    }

    /// A generated surface, such as `balls,count=100,seed=1` or `box,h=0.1`.
    ///
    /// Errors: `bad-sample`, with the reason.
    pub fn sample(spec: &str) -> Result<Self, Error> {
        guarded(&Settings::new(), || {
            let word = format!("{PREFIX}{}", spec.trim_start_matches(PREFIX));
            Self::generated(&word, Settings::new().cap()?)?.oriented(&ScratchSpace::boundless())
        })
    }

    /// Number of triangles.
    pub fn n_triangles(&self) -> usize {
        self.inner.n_input_triangles()
    }

    /// Number of vertices; vertices with equal coordinates count once.
    pub fn n_vertices(&self) -> usize {
        self.inner.n_input_vertices()
    }

    /// Low and high corner of the bounding box.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let bounds = self.inner.bounds();
        [bounds.low, bounds.high].map(|p| p.to_array())
    }

    /// Names of the labels.
    pub fn labels(&self) -> &[String] {
        &self.inner.label_names
    }

    /// Checks that the surface can be meshed.
    ///
    /// Errors: the first of the worst defects, with its place and the number of all defects.
    pub fn validate(&self) -> Result<(), Error> {
        guarded(&Settings::new(), || {
            surface::validate(&self.inner).accept()?;
            Ok(())
        })
    }

    /// Reports all defects of the surface and the measures of its triangles. Defects are not an error here.
    pub fn check(&self) -> Result<CheckReport, Error> {
        guarded(&Settings::new(), || {
            let validation = surface::validate(&self.inner);
            let fitness = surface::fitness(&self.inner, &validation.closedness);
            Ok(CheckReport::of(&validation, &fitness))
        })
    }

    /// Divides triangles until no edge is longer than `h`. New vertices lie on the old triangles. Where the surface is finer, lengths
    /// grow from its edges.
    ///
    /// Errors: a surface with defects; a length that makes no sense.
    pub fn refined(mut self, h: Length) -> Result<Self, Error> {
        guarded(&Settings::new(), || {
            surface::validate(&self.inner).accept()?;
            let options = SizeOptions::parse(Some(&h.to_string()), None, None, None)?;
            (self.inner, _) = refine(&self.inner, &options, &ScratchSpace::boundless())?;
            self.sources = self.copied(&self.inner);
            Ok(self)
        })
    }

    /// Divides triangles until their edges are as short as `h` at their position. The divided surface takes at most half of `cap`.
    #[doc(hidden)]
    pub fn divide(
        &mut self,
        h: &dyn Fn(Point) -> f64,
        cap: u64,
        scratch: &ScratchSpace,
    ) -> Result<(), Error> {
        (self.inner, _) = split(&self.inner, h, cap / 2)?;
        self.keep_all(scratch)
    }

    /// Embeds the triangles of `sheet` in the domain. They become faces of the mesh with tetrahedra on both sides, and separate no
    /// regions.
    ///
    /// A sheet may be open or closed, and may end inside the domain. It may touch other sheets and the surface only along edges and
    /// vertices that both have. Its labels are named `name:LABEL`, or `name` if the sheet has only one label. Default of `name`: the
    /// name of the sheet's file.
    pub fn embedded(mut self, sheet: Surface, name: Option<&str>) -> Result<Self, Error> {
        self.refuse_wires()?;
        let default = sheet.name();
        let name = name.unwrap_or(&default);
        let first = self.inner.n_triangles();
        self.inner.embed(&sheet.inner, name)?;
        self.turned += sheet.turned;
        let is_kept = self.sources.iter().any(|s| s.origin == Origin::Copy);
        match sheet.sources.as_slice() {
            [Source { origin: Origin::File(file) | Origin::Sample(file), bytes, hash }]
                if !is_kept =>
            {
                let sheet = NamedFile { name: name.to_owned(), file: file.clone() };
                let (origin, bytes, hash) = (Origin::Sheet(sheet), *bytes, *hash);
                self.sources.push(Source { origin, bytes, hash });
            }
            _ => {
                let known = self.sources.iter().find_map(|s| match s.origin {
                    Origin::SheetsFrom(first) => Some(first),
                    _ => None,
                });
                let is_open = self.sources.iter().any(|s| s.origin == Origin::OpenParts);
                let first = Origin::SheetsFrom(known.unwrap_or(first));
                self.sources = self.copied(&self.inner);
                self.sources.push(Source::unmarked(first));
                self.sources.extend(is_open.then(|| Source::unmarked(Origin::OpenParts)));
            }
        }
        Ok(self)
    }

    /// Turns the open parts of the surface into sheets; see [`Surface::embedded`].
    ///
    /// Open parts are triangles at an edge without a second triangle. Removing them may open further edges; the triangles there follow,
    /// and so on.
    pub fn open_parts_as_sheets(self) -> Result<Self, Error> {
        guarded(&Settings::new(), || Ok(self.open_parts_in(&ScratchSpace::boundless())?.0))
    }

    /// Like [`Surface::open_parts_as_sheets`], and returns the number of triangles turned into sheets.
    pub(super) fn open_parts_in(mut self, scratch: &ScratchSpace) -> Result<(Self, usize), Error> {
        self.refuse_wires()?;
        let n = attempt(|| self.inner.open_parts_to_sheets(scratch))?;
        self.sources.push(Source::unmarked(Origin::OpenParts));
        Ok((self, n))
    }

    fn refuse_wires(&self) -> Result<(), Error> {
        match self.inner.has_embedded() {
            false => Ok(()),
            true => Err(Error::new(Code::Usage, "sheets are embedded before edges and points")),
        }
    }

    /// Name of the first file, without folder and extension.
    fn name(&self) -> String {
        let file = self.inner.files.first().map(|file| Path::new(&file.name));
        let stem = file.and_then(Path::file_stem).map(|stem| stem.to_string_lossy());
        stem.filter(|s| !s.is_empty()).map_or("sheet".to_owned(), |s| s.into_owned())
    }

    /// Writes the surface as `.stl`, `.off`, `.obj` or `.ply`, without embedded edges and points.
    ///
    /// Errors: `unknown-format`, `lossy-format`; the disk.
    pub fn write(&self, out: impl AsRef<Path>) -> Result<SurfaceWritten, Error> {
        guarded(&Settings::new(), || {
            Ok(match self.inner.has_embedded() {
                true => write::surface(&self.inner.without_embedded(), out.as_ref())?,
                false => write::surface(&self.inner, out.as_ref())?,
            })
        })
    }

    /// Checks that [`Surface::write`] knows the format of a file of that name.
    ///
    /// Errors: `unknown-format`.
    pub fn check_format(out: impl AsRef<Path>) -> Result<(), Error> {
        Ok(write::check_surface_format(out.as_ref())?)
    }

    /// Reads files, or generates one sample, within the memory of `scratch`.
    pub(super) fn load_within(words: &[String], scratch: &ScratchSpace) -> Result<Self, Error> {
        let samples = words.iter().filter(|word| word.starts_with(PREFIX)).count();
        match (samples, words) {
            (1, [word]) => Self::generated(word, scratch.cap()),
            (0, _) => Self::read_in(&words.iter().map(PathBuf::from).collect::<Vec<_>>(), scratch),
            _ => Err(Error::new(Code::Usage, "a sample cannot be joined with other surfaces")
                .with_help("write it to a file first")
                .with_remedy(Remedy::General)),
        }
    }

    /// Orients all triangles like their neighbors.
    pub(super) fn oriented(mut self, scratch: &ScratchSpace) -> Result<Self, Error> {
        self.inner.shrink();
        let orientation = attempt(|| orient_alike_with(&mut self.inner, scratch))?;
        self.turned = orientation.flipped.len();
        Ok(self)
    }

    /// Notes on how the surface was read: what was left out, cut, joined or turned.
    pub fn notes(&self) -> Vec<String> {
        let mut notes: Vec<String> = self.inner.notes.iter().map(ToString::to_string).collect();
        if self.turned > 0 {
            notes.push(match self.turned {
                1 => "1 triangle was turned to run like its neighbors".to_owned(),
                n => format!("{n} triangles were turned to run like their neighbors"),
            });
        }
        notes
    }

    /// Writes a copy of a surface that came from no file to the store's folder. Errors: the disk.
    #[doc(hidden)]
    pub fn keep_in(&self, store: &Path) -> Result<(), Error> {
        if self.sources.iter().any(|source| source.origin == Origin::Copy) {
            write::surface(&self.inner.without_embedded(), &in_store(store))?;
        }
        self.keep_wires_in(store)
    }

    /// Reads again the surface that the store at `store` was made from.
    ///
    /// Errors: `unreadable-file`; `surface-changed` if a file has changed since.
    #[doc(hidden)]
    pub fn of_record(
        sources: &[SurfaceSource],
        store: &Path,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        let sources: Option<Vec<Source>> = sources.iter().map(Source::from_record).collect();
        let sources = sources.ok_or_else(|| {
            Error::new(Code::Damaged, "the record of the surface cannot be read")
                .at(store.display())
        })?;
        let n = sources.iter().position(|s| s.origin.is_inside()).unwrap_or(sources.len());
        let (own, inside) = sources.split_at(n);
        let mut surface = match own {
            [Source { origin: Origin::Copy, .. }] => {
                let mut surface = Self::read_in(&[in_store(store)], scratch)?;
                surface.sources = vec![given(&surface.inner)];
                surface
            }
            _ => {
                let words: Vec<String> = own.iter().map(|s| s.to_record().path).collect();
                Self::load_within(&words, scratch)?
            }
        };
        // The triangles of a copy with sheets were oriented before the sheets were embedded.
        if !inside.iter().any(|s| matches!(s.origin, Origin::SheetsFrom(_))) {
            surface = surface.oriented(scratch)?;
        }
        for source in inside {
            surface = surface.with_inside(&source.origin, store, scratch)?;
        }
        for (then, now) in sources.iter().zip(&surface.sources) {
            if (then.bytes, then.hash) != (now.bytes, now.hash) {
                return Err(Error::new(
                    Code::SurfaceChanged,
                    "the surface is not the one the store was begun with",
                )
                .at(now.to_record().path)
                .with_help("put the old file back, or name the surface to compare with")
                .with_remedy(Remedy::General));
            }
        }
        Ok(surface)
    }

    /// Embeds a recorded sheet, or recorded edges or points.
    pub(super) fn with_inside(
        mut self,
        origin: &Origin,
        store: &Path,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        match origin {
            Origin::SheetsFrom(first) => {
                if *first > self.inner.n_triangles() {
                    return Err(Error::new(Code::Damaged, "the record of sheets cannot be read"));
                }
                self.inner.sheets_from(*first);
                self.sources.push(Source::unmarked(origin.clone()));
                Ok(self)
            }
            Origin::Sheet(NamedFile { name, file }) => {
                let sheet =
                    Self::load_within(std::slice::from_ref(file), scratch)?.oriented(scratch)?;
                self.embedded(sheet, Some(name))
            }
            Origin::EmbeddedCopy(counts) => self.with_kept_wires(*counts, store, scratch),
            Origin::Edges(NamedFile { name, file }) => {
                self.with_wires(Path::new(file), WireKind::Edges, Some(name), scratch)
            }
            Origin::Points(NamedFile { name, file }) => {
                self.with_wires(Path::new(file), WireKind::Points, Some(name), scratch)
            }
            Origin::Resolved(_) | Origin::Closed(_) | Origin::Welded(_) => {
                self.repaired_again(origin, scratch)
            }
            // The copy in the store is that of the mesh already.
            Origin::Imported(_) => Ok(self),
            Origin::Wrapped(text) => self.wrapped_again(text, scratch),
            Origin::Remeshed(text) => self.remeshed_again(text, scratch),
            Origin::OpenParts | Origin::File(_) | Origin::Sample(_) | Origin::Copy => {
                Ok(self.open_parts_in(scratch)?.0)
            }
        }
    }

    /// A surface that came from no file. The store keeps a copy of it.
    pub(super) fn given(inner: surface::Surface) -> Self {
        let source = given(&inner);
        Self::of(inner, vec![source])
    }

    /// The record of a copy in the store; how it was repaired stays on record.
    pub(super) fn copied(&self, inner: &surface::Surface) -> Vec<Source> {
        let own = given(inner);
        let of_copy = |s: &Source| Source { hash: own.hash, ..s.clone() };
        let repairs: Vec<Source> =
            self.sources.iter().filter(|s| s.origin.is_repair()).map(of_copy).collect();
        std::iter::once(own).chain(repairs).collect()
    }

    fn of(inner: surface::Surface, sources: Vec<Source>) -> Self {
        Self { inner, sources, turned: 0, divides: false, snaps: None }
    }

    fn generated(word: &str, cap: u64) -> Result<Self, Error> {
        let spec = SampleSpec::parse(word)?;
        let source = Source::unmarked(Origin::Sample(spec.canonical()));
        let mut inner = surface::Surface::from(spec.make_within(cap)?);
        inner.add_support_triangles(&ScratchSpace::boundless())?;
        Ok(Self::of(inner, vec![source]))
    }

    fn read_in(paths: &[PathBuf], scratch: &ScratchSpace) -> Result<Self, Error> {
        // A stream can be read only once and is gone in a later run, so the store keeps a copy.
        let is_stream = paths.iter().any(|path| is_stream(path));
        let inner = read_surface_in(paths, scratch)?;
        let sources = match is_stream {
            true => vec![given(&inner)],
            false => paths.iter().map(|p| source(p)).collect::<Result<_, _>>()?,
        };
        Ok(Self::of(inner, sources))
    }

    /// A surface from arrays: its vertices are `points`, the rest is what `add` adds.
    pub(super) fn built(
        points: &[[f64; 3]],
        add: impl FnOnce(&mut SurfaceBuilder) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let mut builder = SurfaceBuilder::new();
        builder.begin_file("arrays");
        for (i, point) in points.iter().enumerate() {
            if point.iter().any(|x| !x.is_finite()) {
                return Err(Error::new(Code::NotANumber, "a coordinate is not a finite number")
                    .at(format!("point {i}")));
            }
            builder.vertex(Point::from_array(*point))?;
        }
        add(&mut builder)?;
        builder.end_file()?;
        let inner = builder.finish();
        Ok(Self::given(inner))
    }
}

/// Identity of a surface that came from no file: a hash of points, triangles and labels.
pub(super) fn given(surface: &surface::Surface) -> Source {
    let mut hash = Xxh3::new();
    for x in surface.points.iter().flat_map(|p| p.to_array()) {
        hash.update(&x.to_le_bytes());
    }
    for (t, triangle) in (0u32..).zip(&surface.triangles) {
        triangle.iter().for_each(|v| hash.update(&v.to_le_bytes()));
        hash.update(surface.label_name(t).as_bytes());
    }
    Source { origin: Origin::Copy, bytes: 0, hash: halves(&hash) }
}

/// Path in a store for the copy of a surface that came from no file.
#[doc(hidden)]
pub fn in_store(store: &Path) -> PathBuf {
    store.join("surface.obj")
}

/// Identity of a file: absolute path, length and hash.
#[doc(hidden)]
pub fn source(path: &Path) -> Result<Source, Error> {
    if let Some(inner) = boundary_of(path) {
        let of = source(&inner)?;
        let file = of.origin.file().unwrap_or_default();
        return Ok(Source { origin: Origin::File(format!("{BOUNDARY_OF}{file}")), ..of });
    }
    let io = |e: std::io::Error| {
        let message = match e.kind() {
            std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
            _ => format!("the file cannot be read: {e}"),
        };
        Error::new(Code::UnreadableFile, message).at(path.display())
    };
    let absolute = std::path::absolute(path).map_err(io)?;
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        let message = "it is not a regular file, and would have to be read twice";
        return Err(Error::new(Code::UnreadableFile, message).at(path.display()));
    }
    let mut file = std::fs::File::open(path).map_err(io)?;
    let mut hash = Xxh3::new();
    let (mut buffer, mut bytes) = (vec![0; 1 << 16], 0);
    loop {
        let n = file.read(&mut buffer).map_err(io)?;
        if n == 0 {
            break;
        }
        bytes += n as u64;
        hash.update(&buffer[..n]);
    }
    let origin = Origin::File(absolute.to_string_lossy().into_owned());
    Ok(Source { origin, bytes, hash: halves(&hash) })
}

/// The two halves of a 128-bit hash, low half first.
pub(super) fn halves(hash: &Xxh3) -> [u64; 2] {
    let digest = hash.digest128();
    [digest as u64, (digest >> 64) as u64]
}
