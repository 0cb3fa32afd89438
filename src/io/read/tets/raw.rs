//! A mesh as its file has it.

use std::collections::HashMap;
use std::io::BufRead;

use super::numbers::Numbers;
use super::{Feed, ReadFault, Result};
use tetdb_base::geom::{Point, counted};
use tetdb_base::storage::{ScratchSpace, SpillVec, SpillVecBuilder, check_cancelled};
use tetdb_schema::field::{COMPONENTS, FieldNumber, FieldPlace};

/// Most tetrahedra of a mesh: a sub-domain that has all of them cannot be sealed with more.
const TETS_MAX: usize = 1 << 29;
/// Most regions: their names are in memory beside all else.
const GROUPS_MAX: u32 = 1 << 17;
/// Groups without a number have this one or higher ones.
const UNNUMBERED: i64 = 1 << 40;
/// Node numbers may be this many times as far apart as there are nodes. Beyond it, a table of the numbers would be mostly empty.
const SPARSE_MAX: u64 = 64;

/// A tetrahedral mesh as its file has it, in memory up to a share and in scratch files beyond it.
pub struct RawMesh {
    pub(in crate::read) space: ScratchSpace,
    /// Name of the file without folder and ending: the label of triangles that have none.
    pub stem: String,
    /// Positions of the vertices.
    pub points: SpillVecBuilder<[f64; 3]>,
    /// Four vertices, the position of the region in `regions`, and that of the part in `parts`.
    pub tets: SpillVecBuilder<[u32; 6]>,
    /// Three vertices, and the position of the label in `labels`.
    pub triangles: SpillVecBuilder<[u32; 4]>,
    /// Regions of tetrahedra.
    pub regions: Groups,
    /// Labels of triangles.
    pub labels: Groups,
    /// Parts of the mesh; empty where the file has none, or none are asked for.
    pub parts: Groups,
    /// Notes on what was left out or taken otherwise.
    pub notes: Vec<String>,
    /// Number of lines and points, and of tetrahedra and triangles with more nodes than corners.
    pub(super) n_thin: u64,
    pub(super) n_curved: u64,
    /// Values at vertices and tetrahedra, as far as they are taken.
    pub fields: Vec<RawField>,
}

/// Values of an array of the file.
pub struct RawField {
    /// Its name.
    pub name: String,
    /// Where the values are: at vertices or at tetrahedra.
    pub place: FieldPlace,
    /// Type of the numbers.
    pub number: FieldNumber,
    /// Numbers of a value.
    pub components: u32,
    /// The words of all numbers, value by value, in the order of the vertices or tetrahedra of the file.
    pub words: SpillVecBuilder<u64>,
}

/// How a mesh file is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshFields<'a> {
    /// The array of cells that gives parts.
    pub part: Option<&'a str>,
    /// The array of cells that gives regions.
    pub region: Option<&'a str>,
    /// Chooses the arrays of values that are taken, by name; `None` takes none.
    pub values: Option<fn(&str) -> bool>,
}

/// Groups of elements by number, some with a name.
#[derive(Clone, Debug, Default)]
pub struct Groups {
    /// Number and name of each, in the order of the file; the name is empty where there is none.
    pub list: Vec<(i64, String)>,
    ids: HashMap<i64, u32>,
    last: Option<(i64, u32)>,
}

impl Groups {
    /// The position of a group, which is added if new.
    #[inline]
    pub fn number(&mut self, number: i64) -> u32 {
        match self.last {
            Some((last, id)) if last == number => id,
            _ => self.with_name(number, String::new),
        }
    }

    /// As [`Groups::number`]; a new group gets a name.
    pub fn with_name(&mut self, number: i64, name: impl FnOnce() -> String) -> u32 {
        let list = &mut self.list;
        let id = *self.ids.entry(number).or_insert_with(|| {
            list.push((number, name()));
            list.len() as u32 - 1
        });
        self.last = Some((number, id));
        id
    }

    /// The position of the group of this name, which is added if new. `region_12` has number 12, others come behind all numbers.
    /// The group without a name has number 0.
    pub fn named(&mut self, name: &str) -> u32 {
        if name.is_empty() {
            return self.with_name(0, String::new);
        }
        if let Some(id) = self.list.iter().position(|group| group.1 == name) {
            return id as u32;
        }
        let number = name.strip_prefix("region_").and_then(|n| n.parse().ok());
        let number = number.filter(|n| !self.ids.contains_key(n) && *n < UNNUMBERED);
        self.with_name(number.unwrap_or(UNNUMBERED + self.list.len() as i64), || name.to_owned())
    }
}

impl RawMesh {
    /// An empty mesh in so much memory.
    pub fn new(space: ScratchSpace) -> Self {
        let share = space.available() / 8;
        Self {
            stem: String::new(),
            points: space.builder_within(share),
            tets: space.builder_within(share),
            triangles: space.builder_within(share / 2),
            regions: Groups::default(),
            labels: Groups::default(),
            parts: Groups::default(),
            notes: Vec::new(),
            n_thin: 0,
            n_curved: 0,
            fields: Vec::new(),
            space,
        }
    }

    /// Adds a vertex.
    pub fn point(&mut self, p: Point) {
        self.points.push((p + Point::ZERO).to_array());
    }

    /// Adds a tetrahedron. Errors: there are too many, or too many regions.
    #[inline]
    pub(super) fn tet(
        &mut self,
        [a, b, c, d]: [u32; 4],
        region: u32,
        part: u32,
    ) -> std::result::Result<(), ReadFault> {
        if self.tets.len() >= TETS_MAX {
            let what = format!("a mesh of more than {TETS_MAX} tetrahedra");
            return Err(ReadFault::Unsupported(what));
        }
        if region >= GROUPS_MAX {
            return Err(ReadFault::Unsupported(format!(
                "a mesh of more than {GROUPS_MAX} regions"
            )));
        }
        if self.tets.len().is_multiple_of(1 << 16) {
            check_cancelled();
        }
        self.tets.push([a, b, c, d, region, part]);
        Ok(())
    }

    /// Adds a triangle.
    pub fn triangle(&mut self, [a, b, c]: [u32; 3], label: u32) {
        self.triangles.push([a, b, c, label]);
    }

    /// Begins values of so many numbers, unless no field has so many or one has the name; returns their position in `fields`.
    pub(super) fn field(
        &mut self,
        name: &str,
        place: FieldPlace,
        number: FieldNumber,
        components: usize,
    ) -> Option<usize> {
        let components = COMPONENTS.into_iter().find(|&n| n as usize == components)?;
        if self.fields.iter().any(|field| field.name == name) {
            return None;
        }
        let words = self.space.builder_within(self.space.available() / 32);
        self.fields.push(RawField { name: name.to_owned(), place, number, components, words });
        Some(self.fields.len() - 1)
    }

    /// Reads `n` values of a field, with which `numbers` end. Errors: a number that its type does not have; fewer or more.
    pub(super) fn values(&mut self, field: usize, mut numbers: Numbers, n: u64) -> Result<()> {
        let mut row = Vec::new();
        let field = &mut self.fields[field];
        for i in 0..n {
            row.clear();
            numbers.value((field.number, field.components), (&field.name, i), &mut row)?;
            row.iter().for_each(|&word| field.words.push(word));
        }
        numbers.end()
    }

    /// Notes arrays of values that no field holds, or that are not taken.
    pub(super) fn leave_out(&mut self, names: &[&str]) {
        if !names.is_empty() {
            self.notes.push(format!("arrays of values were left out: {}", names.join(", ")));
        }
    }

    /// Ends reading: counts become notes, and fields without a value for each vertex or tetrahedron are left out.
    pub(super) fn end(&mut self) {
        let [n_points, n_tets] = [self.points.len(), self.tets.len()];
        let is_whole = |field: &RawField| {
            let n = if field.place == FieldPlace::Vertices { n_points } else { n_tets };
            field.words.len() == n * field.components as usize
        };
        let (whole, partial) = std::mem::take(&mut self.fields).into_iter().partition(is_whole);
        self.fields = whole;
        let partial: Vec<RawField> = partial;
        self.leave_out(&partial.iter().map(|field| &*field.name).collect::<Vec<_>>());

        for (n, text) in [
            (self.n_thin, "[line or point was|lines and points were] left out"),
            (
                self.n_curved,
                "[element has nodes beside its corners|elements have nodes beside their corners]; only the corners were taken",
            ),
        ] {
            if n > 0 {
                self.notes.push(counted(n, text));
            }
        }
    }
}

/// From the numbers of nodes or elements in a file to their positions.
pub(super) struct NodeNumbers {
    /// The word for errors: `node` or `element`.
    noun: &'static str,
    first: i64,
    n: u32,
    /// All numbers, once they turn out not to count up by one.
    sparse: Option<SpillVecBuilder<i64>>,
    /// The lowest number, and positions from it on.
    table: Option<(i64, SpillVec<u32>)>,
}

impl NodeNumbers {
    /// No numbers yet, of nodes or elements.
    pub fn of(noun: &'static str) -> Self {
        Self { noun, first: 0, n: 0, sparse: None, table: None }
    }

    /// The next node of the file has this number.
    pub fn push(&mut self, number: i64, space: &ScratchSpace) {
        if self.n == 0 {
            self.first = number;
        }
        if self.sparse.is_none() && self.first.checked_add(i64::from(self.n)) != Some(number) {
            let mut all = space.builder();
            (0..self.n).for_each(|i| all.push(self.first + i64::from(i)));
            self.sparse = Some(all);
        }
        if let Some(all) = &mut self.sparse {
            all.push(number);
            self.table = None;
        }
        self.n += 1;
    }

    /// Makes the table of the numbers, if it is missing and needed. Errors: two nodes have one number; the numbers are too far apart.
    pub fn prepare<R: BufRead>(&mut self, space: &ScratchSpace, feed: &Feed<R>) -> Result<()> {
        match self.sparse.is_some() && self.table.is_none() {
            true => self.build(space, feed),
            false => Ok(()),
        }
    }

    /// The position of a node. Errors: there is no such node; two have one number.
    #[inline]
    pub fn find<R: BufRead>(
        &mut self,
        number: i64,
        space: &ScratchSpace,
        feed: &Feed<R>,
    ) -> Result<u32> {
        self.prepare(space, feed)?;
        let (low, n) = match &mut self.table {
            None => (self.first, u64::from(self.n)),
            Some((low, table)) => {
                let at = number.checked_sub(*low).and_then(|i| usize::try_from(i).ok());
                let found = at.filter(|&i| i < table.len()).map(|i| table.get(i));
                return match found {
                    Some(position) if position != u32::MAX => Ok(position),
                    _ => Err(feed.out_of_range(number, *low, *low + (table.len() as i64 - 1))),
                };
            }
        };
        feed.check_index(number, low, n)
    }

    /// The numbers from `first` to `last` by `step`, which is above 0, as far as they lie between the least and the greatest known one; and how
    /// many lie outside. Call [`NodeNumbers::prepare`] first.
    pub fn among(&self, [first, last, step]: [i64; 3]) -> (impl Iterator<Item = i64> + use<>, u64) {
        let [first, last, step] = [first, last, step].map(i128::from);
        let (low, n) = match &self.table {
            Some((low, table)) => (*low, table.len() as i128),
            None => (self.first, i128::from(self.n)),
        };
        let (low, high) = (i128::from(low), i128::from(low) + n - 1);
        let count = |from: i128, to: i128| if to < from { 0 } else { (to - from) / step + 1 };
        let from = first + ((low - first).max(0) + step - 1) / step * step;
        let (n_within, n_all) = (count(from, last.min(high)), count(first, last));
        let numbers = (0..n_within).map(move |k| (from + k * step) as i64);
        (numbers, u64::try_from(n_all - n_within).unwrap_or(u64::MAX))
    }

    fn build<R: BufRead>(&mut self, space: &ScratchSpace, feed: &Feed<R>) -> Result<()> {
        let Some(all) = &mut self.sparse else { return Ok(()) };
        let (mut low, mut high) = (i64::MAX, i64::MIN);
        for i in 0..all.len() {
            (low, high) = (low.min(all.get(i)), high.max(all.get(i)));
        }
        let span = high.abs_diff(low).saturating_add(1);
        if span > SPARSE_MAX * u64::from(self.n) + (1 << 20) {
            let (n, noun) = (self.n, self.noun);
            return Err(feed.unsupported(format!("numbers from {low} to {high} of {n} {noun}s")));
        }
        let mut table = space.vec(span as usize, u32::MAX);
        for i in 0..all.len() {
            let at = (all.get(i) - low) as usize;
            if table.get(at) != u32::MAX {
                let expected = format!("{}s of different numbers", self.noun);
                let found = format!("{} {} a second time", self.noun, all.get(i));
                return Err(feed.refuse(ReadFault::Unexpected { expected, found }));
            }
            table.set(at, i as u32);
        }
        self.table = Some((low, table));
        Ok(())
    }
}
