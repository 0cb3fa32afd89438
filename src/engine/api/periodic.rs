//! Periodic pairs: labels whose triangles are the same at two places.

use std::fmt;
use std::str::FromStr;
use std::time::Instant;

use serde::Serialize;

use super::fields::journal;
use super::{Code, Error, Store, guarded};
use tetdb_base::geom::short;
use tetdb_base::storage::StorageError;
pub use tetdb_base::surface::MotionKind;
use tetdb_base::surface::{
    Patch, PatchTriangle, PeriodicMatch, Surface, Unpaired, UnpairedPart, match_patches, show,
};
use tetdb_schema::ids::{Owner, VertexId};
use tetdb_schema::labels::{LabelSet, labels_within};
use tetdb_schema::periodic::PeriodicRow;
use tetdb_store::store::{Catalog, Step};

/// Two labels to be recorded as a periodic pair, by name or number.
///
/// Its text is `left=right`, or `left=right:rotate`, `left=right:translate` where both motions would do.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicLabels {
    first: String,
    second: String,
    kind: Option<MotionKind>,
    tolerance: Option<f64>,
}

impl PeriodicLabels {
    /// The triangles of `first`, moved, are those of `second`.
    pub fn new(first: impl Into<String>, second: impl Into<String>) -> Self {
        Self { first: first.into(), second: second.into(), kind: None, tolerance: None }
    }

    /// Sets the kind of the motion. Default: a translation, if one is found, unless the mesh lies on the same side of both labels; otherwise
    /// the rotation by the smallest angle.
    pub fn kind(mut self, kind: MotionKind) -> Self {
        self.kind = Some(kind);
        self
    }

    /// Sets how far a moved vertex may be from its partner. Default: a millionth of the diagonal around both labels, a few times what
    /// 32-bit coordinates round by.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = Some(tolerance);
        self
    }
}

impl FromStr for PeriodicLabels {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (labels, kind) = match text.rsplit_once(':') {
            Some((labels, "translate")) => (labels, Some(MotionKind::Translation)),
            Some((labels, "rotate")) => (labels, Some(MotionKind::Rotation)),
            _ => (text, None),
        };
        match labels.split_once('=') {
            Some((first, second)) if !first.is_empty() && !second.is_empty() => {
                Ok(Self { kind, ..Self::new(first, second) })
            }
            _ => Err("give two labels, such as left=right or 0=1:rotate".to_owned()),
        }
    }
}

/// A periodic pair of a store.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Periodic {
    /// Name of the label that is moved.
    pub first: String,
    /// Name of the label that it is moved onto.
    pub second: String,
    /// Row of the pair in the catalog: labels, motion, counts.
    #[serde(flatten)]
    pub row: PeriodicRow,
}

/// Such as `x-low = x-high, moved by (1, 0, 0): 25 vertices, 32 triangles`.
impl fmt::Display for Periodic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { first, second, row } = self;
        let shift = row.map.map(|line| short(line[3])).join(", ");
        let motion = match row.angle {
            0.0 => format!("moved by ({shift})"),
            angle => format!("turned by {} degrees", short(angle.to_degrees())),
        };
        let (vertices, triangles) = (row.vertices, row.triangles);
        write!(f, "{first} = {second}, {motion}: {vertices} vertices, {triangles} triangles")
    }
}

impl Store {
    /// The periodic pairs, in the order in which they were recorded. Errors: damage.
    pub fn periodic(&self) -> Result<Vec<Periodic>, Error> {
        guarded(self.settings(), || periodic_of(&mut self.catalog_shared()))
    }

    /// The pairs of vertices of a periodic pair: one of the first label, and its partner. A vertex on the axis of a rotation has none.
    ///
    /// Errors: damage.
    pub fn periodic_vertices(&self, pair: &Periodic) -> Result<Vec<[VertexId; 2]>, Error> {
        guarded(self.settings(), || {
            let pairs = self.catalog_shared().periodic_vertices(&pair.row)?;
            let id = |index| VertexId { owner: Owner::Surface, index };
            Ok(pairs.into_iter().map(|pair| pair.map(id)).collect())
        })
    }

    /// The pairs of triangles of a periodic pair, by their numbers in the input. Errors: damage.
    pub fn periodic_triangles(&self, pair: &Periodic) -> Result<Vec<[u64; 2]>, Error> {
        guarded(self.settings(), || Ok(self.catalog_shared().periodic_triangles(&pair.row)?))
    }

    /// Records that the triangles of one label are those of another, moved by a translation or a rotation that is found from them.
    ///
    /// The mesh is not changed. A pair of the same labels is replaced.
    ///
    /// ```
    /// # use tetdb_engine::api as tetdb;
    /// # let dir = tempfile::tempdir()?;
    /// # let path = dir.path().join("box.tetdb");
    /// # let mut store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.5")?).create(&path)?;
    /// let pair = store.add_periodic(&tetdb::PeriodicLabels::new("x-low", "x-high"))?;
    /// assert_eq!(pair.row.map[0], [1.0, 0.0, 0.0, 1.0]);
    /// let [vertex, partner] = store.periodic_vertices(&pair)?[0];
    /// assert_ne!(vertex, partner);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    /// Errors: `not-periodic`; `no-such-part` for an unknown label; `memory`; `busy`; damage.
    pub fn add_periodic(&mut self, labels: &PeriodicLabels) -> Result<Periodic, Error> {
        let summary = self.summary();
        let numbers = numbers_of(labels, &summary.labels, &summary.label_sets)?;
        self.change_fields(|catalog, settings| {
            let (clock, state) = (Instant::now(), catalog.state()?);
            let rows = catalog.periodic()?;
            check_order(labels, numbers, &rows)?;
            let patches = catalog.patches(numbers, settings.cap()? / 2)?;
            let found = matched(labels, &patches)?;
            let old = rows.iter().find(|row| row.labels == numbers);
            let id = rows.iter().map(|row| row.id + 1).max().unwrap_or(0);
            let row = row(id, numbers, &found);
            catalog.commit(|step| {
                old.into_iter().for_each(|old| step.remove_periodic(old));
                step.set_periodic(&row, &found.vertices, &found.triangles);
                step.append_journal(&journal(state, "periodic pair", clock));
                Ok(())
            })?;
            Ok(named(row, &catalog.labels()?))
        })
    }

    /// Returns whether the pair is on record already, by such a motion. Errors: as [`Store::add_periodic`].
    pub(super) fn has_periodic(&self, labels: &PeriodicLabels) -> Result<bool, Error> {
        let summary = self.summary();
        let numbers = numbers_of(labels, &summary.labels, &summary.label_sets)?;
        let is_meant = |row: &PeriodicRow| {
            let kind = match row.angle {
                0.0 => MotionKind::Translation,
                _ => MotionKind::Rotation,
            };
            row.labels == numbers
                && labels.kind.is_none_or(|wanted| wanted == kind)
                && labels.tolerance.is_none_or(|most| row.deviation <= most)
        };
        Ok(self.periodic()?.iter().any(|pair| is_meant(&pair.row)))
    }

    /// Removes a periodic pair from the record. Errors: `no-such-part`; `busy`.
    pub fn drop_periodic(&mut self, labels: &PeriodicLabels) -> Result<(), Error> {
        let numbers = [&labels.first, &labels.second];
        let summary = self.summary();
        let [first, second] = numbers.map(|name| summary.label_called(name));
        let numbers = [first?, second?];
        self.change_fields(|catalog, _| {
            let (clock, state) = (Instant::now(), catalog.state()?);
            let rows = catalog.periodic()?;
            let Some(row) = rows.iter().find(|row| row.labels == numbers) else {
                let known = periodic_of(catalog)?;
                let names: Vec<String> =
                    known.iter().map(|pair| format!("{}={}", pair.first, pair.second)).collect();
                let (known, help) = match names.is_empty() {
                    true => ("the store has none".to_owned(), "there is nothing to drop"),
                    false => {
                        (format!("there are {}", names.join(", ")), "name one of these to drop it")
                    }
                };
                let message =
                    format!("there is no pair {}={}; {known}", labels.first, labels.second);
                return Err(Error::new(Code::NoSuchPart, message).with_help(help));
            };
            Ok(catalog.commit(|step| {
                step.remove_periodic(row);
                step.append_journal(&journal(state, "drop periodic pair", clock));
                Ok(())
            })?)
        })
    }
}

/// The periodic pairs of a store. Errors: damage.
pub(super) fn periodic_of(catalog: &mut Catalog) -> Result<Vec<Periodic>, Error> {
    let (rows, labels) = (catalog.periodic()?, catalog.labels()?);
    Ok(rows.into_iter().map(|row| named(row, &labels)).collect())
}

/// Pairs of a surface that is not meshed yet, for its first commit.
pub(super) struct SurfacePairs(Vec<(PeriodicRow, PeriodicMatch)>);

impl SurfacePairs {
    /// Finds the pairs, within `memory` bytes. Errors: as [`Store::add_periodic`].
    pub fn find(surface: &Surface, pairs: &[PeriodicLabels], memory: u64) -> Result<Self, Error> {
        let (mut rows, mut found) = (Vec::new(), Vec::new());
        for (id, labels) in (0..).zip(pairs) {
            let numbers = numbers_of(labels, &surface.label_names, &surface.label_sets)?;
            check_order(labels, numbers, &rows)?;
            let matching = matched(labels, &patches_of(surface, numbers, memory)?)?;
            rows.push(row(id, numbers, &matching));
            found.push(matching);
        }
        Ok(Self(rows.into_iter().zip(found).collect()))
    }

    /// Records the pairs.
    pub fn record(&self, step: &mut Step) {
        for (row, found) in &self.0 {
            step.set_periodic(row, &found.vertices, &found.triangles);
        }
    }

    /// Returns whether a store has these pairs. Errors: damage.
    pub fn are_in(&self, catalog: &mut Catalog) -> Result<bool, Error> {
        Ok(catalog.periodic()?.iter().eq(self.0.iter().map(|(row, _)| row)))
    }
}

fn patches_of(surface: &Surface, numbers: [u32; 2], memory: u64) -> Result<[Patch; 2], Error> {
    let of_label = |label: u32| {
        let all = 0..surface.n_input_triangles() as u32;
        all.filter(move |&t| surface.labels[t as usize] == label)
    };
    let n: usize = numbers.iter().map(|&label| of_label(label).count()).sum();
    let needed = Patch::BYTES_EACH * n as u64;
    if needed > memory {
        let what = "triangles of periodic labels";
        return Err(StorageError::Budget { what, needed, available: memory }.into());
    }
    let triangle = |t: u32| PatchTriangle {
        number: t.into(),
        vertices: surface.triangles[t as usize],
        points: surface.corners(t),
    };
    Ok(numbers.map(|label| Patch::new(of_label(label).map(triangle).collect())))
}

/// The labels of a pair. Errors: unknown or equal ones, labels that share triangles with other groups.
fn numbers_of(
    labels: &PeriodicLabels,
    names: &[String],
    sets: &[LabelSet],
) -> Result<[u32; 2], Error> {
    let mut numbers = [0; 2];
    for (number, name) in numbers.iter_mut().zip([&labels.first, &labels.second]) {
        *number = super::names::label_among(names, name)?;
        if let [_, other, ..] = labels_within(sets, *number)[..] {
            let message = format!("some triangles of {name} belong to other groups too");
            let help = format!(
                "triangles of several groups have labels of their own, such as {other}; pair the labels one by one, by number"
            );
            return Err(Error::new(Code::NotPeriodic, message).with_help(help));
        }
    }
    if numbers[0] == numbers[1] {
        let message = format!("{} is no pair with itself", labels.first);
        return Err(Error::new(Code::NotPeriodic, message).with_help("name another label"));
    }
    if let Some(tolerance) = labels.tolerance.filter(|t| !(t.is_finite() && *t >= 0.0)) {
        let message = format!("the tolerance of a periodic pair is {tolerance}");
        return Err(Error::new(Code::NotPeriodic, message).with_help("give a length"));
    }
    Ok(numbers)
}

/// Refuses a label that another one is moved onto already, and circles: solvers want one partner for each label, and a first one.
fn check_order(
    labels: &PeriodicLabels,
    [first, second]: [u32; 2],
    rows: &[PeriodicRow],
) -> Result<(), Error> {
    let onto = |label: u32| {
        let mut others = rows.iter().filter(|row| row.labels != [first, second]);
        others.find(|row| row.labels[1] == label).map(|row| row.labels[0])
    };
    let mut before = first;
    while before != second
        && let Some(next) = onto(before)
    {
        before = next;
    }
    if before == second || onto(second).is_some() {
        let message = format!("{} is moved onto another label already", labels.second);
        let message = match before == second {
            true => format!("{} is the partner of {} already", labels.first, labels.second),
            false => message,
        };
        return Err(Error::new(Code::NotPeriodic, message).with_help("drop the other pair first"));
    }
    Ok(())
}

fn matched(labels: &PeriodicLabels, patches: &[Patch; 2]) -> Result<PeriodicMatch, Error> {
    let names = [&labels.first, &labels.second];
    for (patch, name) in patches.iter().zip(names) {
        if patch.n_triangles() == 0 {
            let message = format!("no triangle has the label {name}");
            return Err(Error::new(Code::NotPeriodic, message).with_help("name another label"));
        }
    }
    let [first, second] = patches;
    match_patches(first, second, labels.kind, labels.tolerance).map_err(|unpaired| {
        let Unpaired { is_second, what } = unpaired;
        let [from, to] = if is_second { [names[1], names[0]] } else { names };
        let counts = [from, to].map(|name| {
            let patch = &patches[usize::from(name == names[1])];
            format!("{name} has {} triangles", patch.n_triangles())
        });
        let (message, place) = match what {
            UnpairedPart::Vertex { number, at, distance, tolerance, .. } if distance <= tolerance => (
                format!(
                    "vertex {number} of {from} and another one have the same partner within {}; allow a smaller distance",
                    short(tolerance)
                ),
                show(at),
            ),
            UnpairedPart::Vertex { number, at, moved, distance, tolerance } => (
                format!(
                    "vertex {number} of {from} has no partner: moved to {}, it is {} from the nearest vertex of {to}, allowed is {}; {}",
                    show(moved), short(distance), short(tolerance), counts.join(", ")
                ),
                show(at),
            ),
            UnpairedPart::Triangle { number, at } => (
                format!(
                    "triangle {number} of {from} has no partner: its vertices have, but they are no triangle of {to}; {}",
                    counts.join(", ")
                ),
                at.map(show).join(" "),
            ),
        };
        Error::new(Code::NotPeriodic, message).at(place).with_help(
            "both labels need the same triangles, up to one translation or rotation; mesh the one and copy it to the other, or allow a larger distance",
        )
    })
}

fn row(id: u32, labels: [u32; 2], found: &PeriodicMatch) -> PeriodicRow {
    PeriodicRow {
        id,
        labels,
        map: found.map,
        angle: found.angle,
        deviation: found.deviation,
        tolerance: found.tolerance,
        vertices: found.vertices.len() as u64,
        triangles: found.triangles.len() as u64,
    }
}

fn named(row: PeriodicRow, labels: &[String]) -> Periodic {
    let [first, second] = row
        .labels
        .map(|label| labels.get(label as usize).cloned().unwrap_or_else(|| label.to_string()));
    Periodic { first, second, row }
}
