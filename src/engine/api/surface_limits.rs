//! Calls on surfaces that respect the memory limit of a run's settings.

use std::path::Path;

use super::job::take_seeds;
use super::mesher::leave_out;
use super::surface::refine;
use super::{EmbedOutside, Error, Length, Settings, Surface, guarded};
use crate::pipeline::{Options, refuse_outer};
use tetdb_base::storage::attempt;
use tetdb_base::surface::{SplitReport, validate_with};
use tetdb_io::read::WireKind as EmbeddedKind;
use tetdb_io::write;
use tetdb_kernel::sizing::SizeOptions;

impl Surface {
    /// Reads files as one surface, or generates one sample, within the memory of `settings`.
    ///
    /// Effects: notes on the content go to the listener of `settings`. Edges of `.poly` files are not yet embedded.
    ///
    /// # Errors
    /// As [`Surface::read`] and [`Surface::sample`].
    pub fn load(words: &[String], settings: &Settings) -> Result<Self, Error> {
        guarded(settings, || {
            let surface = Self::load_within(words, &settings.scratch_space(0)?)?;
            let scratch = settings.scratch_space(surface.inner.bytes() as u64)?;
            let surface = surface.oriented(&scratch)?;
            surface.notes().iter().for_each(|note| settings.note(format!("note: {note}")));
            Ok(surface)
        })
    }

    /// Like [`Surface::open_parts_as_sheets`], within the memory of `settings`. Also returns the number of triangles turned into sheets.
    pub fn open_parts_with(self, settings: &Settings) -> Result<(Self, usize), Error> {
        guarded(settings, || self.open_parts_in(&settings.scratch_space(0)?))
    }

    /// [`Surface::embedded_edges`] or [`Surface::embedded_points`] within the memory of `settings`.
    pub fn embedded_with(
        self,
        file: impl AsRef<Path>,
        kind: EmbeddedKind,
        name: Option<&str>,
        settings: &Settings,
    ) -> Result<Self, Error> {
        guarded(settings, || {
            let scratch = settings.scratch_space(self.inner.bytes() as u64)?;
            let n_notes = self.inner.notes.len();
            let surface = self.with_wires(file.as_ref(), kind, name, &scratch)?;
            surface.say_notes(n_notes, settings);
            Ok(surface)
        })
    }

    /// Embeds the edges of the surface's own files, within the memory of `settings`. Call after sheets are embedded.
    #[doc(hidden)]
    pub fn own_edges_with(self, settings: &Settings) -> Result<Self, Error> {
        guarded(settings, || {
            let scratch = settings.scratch_space(self.inner.bytes() as u64)?;
            let n_notes = self.inner.notes.len();
            let surface = self.with_own_edges(&scratch)?;
            surface.say_notes(n_notes, settings);
            Ok(surface)
        })
    }

    /// Reports notes from number `first` on.
    fn say_notes(&self, first: usize, settings: &Settings) {
        self.inner.notes[first..].iter().for_each(|note| settings.note(format!("note: {note}")));
    }

    /// [`Surface::validate`] within the memory of `settings`.
    pub fn validate_with(&self, settings: &Settings) -> Result<(), Error> {
        guarded(settings, || {
            let scratch = settings.scratch_space(self.inner.bytes() as u64)?;
            Ok(attempt(|| validate_with(&self.inner, &scratch))?.accept()?)
        })
    }

    /// Finds what is embedded outside the regions that are filled without further options, as a run does; of a surface with defects nothing.
    ///
    /// Effects: as `outside` says, edges and points there are left out, with a note. Errors: `sheet-outside`, `wire-outside`.
    pub fn inside_settled(
        mut self,
        outside: EmbedOutside,
        settings: &Settings,
    ) -> Result<Self, Error> {
        if !self.inner.has_embedded() && !self.inner.has_sheets() {
            return Ok(self);
        }
        guarded(settings, || {
            let scratch = settings.scratch_space(self.inner.bytes() as u64)?;
            if !attempt(|| validate_with(&self.inner, &scratch))?.is_valid() {
                return Ok(self);
            }
            let mut options = Options::default();
            take_seeds(&mut options.mesh, &self.inner);
            if outside == EmbedOutside::Skip && self.inner.has_embedded() {
                leave_out(&mut self, &options, &scratch, settings)?;
            }
            attempt(|| refuse_outer(&self.inner, &options, &scratch))??;
            Ok(self)
        })
    }

    /// [`Surface::refined`] with a gradation, within the memory of `settings`. The result is validated. Also returns the counts of the
    /// division.
    pub fn refined_with(
        &self,
        h: Length,
        gradation: Option<f64>,
        settings: &Settings,
    ) -> Result<(Self, SplitReport), Error> {
        let sizes = SizeOptions { hsiz: Some(h), hgrad: gradation, ..SizeOptions::default() };
        sizes.check()?;
        self.validate_with(settings)?;
        guarded(settings, || {
            let scratch = settings.scratch_space(self.inner.bytes() as u64)?;
            let (inner, report) = refine(&self.inner, &sizes, &scratch)?;
            let fine = Self::given(inner);
            fine.validate_with(settings)?;
            Ok((fine, report))
        })
    }

    /// Number of embedded edges and number of embedded points.
    pub fn n_embedded(&self) -> [usize; 2] {
        let embedded = &self.inner.embedded;
        [embedded.edges.len(), embedded.points.len()]
    }

    /// Number of triangles in sheets.
    pub fn n_sheet_triangles(&self) -> usize {
        self.inner.n_sheet_triangles()
    }

    /// Splits the surface in two: the shell without sheets, and the sheets alone.
    pub fn split_sheets(&self) -> [Self; 2] {
        [false, true].map(|sheets| Self::given(self.inner.part(sheets)))
    }

    /// Writes embedded edges and points to an `.obj` file. Errors: the disk.
    pub fn write_embedded(&self, out: impl AsRef<Path>) -> Result<(), Error> {
        Ok(write::wires(&self.inner.embedded_set(), out.as_ref())?)
    }
}
