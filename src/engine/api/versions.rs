//! Versions of a store: saved, listed, compared, restored, dropped.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use serde::Serialize;

use super::compare::digests;
use super::fields::journal;
use super::{Code, Comparison, Error, Remeshed, Store, guarded};
use tetdb_schema::catalog::{FileRow, SubdomainRow, VersionRow};
use tetdb_schema::field::{FieldPart, FieldRow};
use tetdb_schema::row::RowKind;
use tetdb_store::store::{BEFORE, Catalog};

/// Most versions of a store. Each change reads the lists of all.
const VERSIONS_MAX: usize = 1000;
/// Most sub-domains of all versions together, for the same reason.
const SUBDOMAINS_MAX: usize = 100_000;
/// Most characters of a name.
const NAME_MAX: usize = 64;
/// The word for the store as it is, which names no version.
const NOW: &str = "now";

/// A version of a store: its mesh and fields as they were when it was saved.
///
/// Serialized, it is an element of the answer of `tetdb version STORE list --json`; the guide lists the keys.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Version {
    /// Its name.
    pub name: String,
    /// The note given with it.
    pub note: String,
    /// When it was saved: seconds since 1970.
    pub saved: u64,
    /// Digest of its mesh.
    pub digest: String,
    /// Number of tetrahedra.
    pub tets: u64,
    /// Number of vertices. A vertex shared by several sub-domains counts in each.
    pub vertices: u64,
    /// Number of sub-domains.
    pub subdomains: usize,
    /// Names of its fields.
    pub fields: Vec<String>,
    /// Bytes of files that nothing else needs: what dropping it frees.
    pub bytes: u64,
}

/// Two versions of a store compared.
///
/// Serialized, it is the answer of `tetdb version STORE diff --json`; the guide lists the keys.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct VersionDiff {
    /// True if mesh and fields are the same.
    pub same: bool,
    /// All sub-domains, by rank.
    pub subdomains: Vec<SubdomainDiff>,
    /// Fields of the first version alone, or with other values there.
    pub fields_before: Vec<String>,
    /// Fields of the second version alone, or with other values there.
    pub fields_after: Vec<String>,
    /// Qualities of the changed sub-domains; [`Comparison::same`] is true without any.
    pub qualities: Comparison,
}

/// A sub-domain in two versions. Pairs have the value of the first version first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SubdomainDiff {
    /// Rank of the sub-domain.
    pub id: u32,
    /// True if its meshes differ.
    pub changed: bool,
    /// Number of tetrahedra.
    pub tets: [u64; 2],
    /// Number of vertices.
    pub vertices: [u64; 2],
    /// Greatest quality q; 1 is regular.
    pub worst_q: [f64; 2],
}

impl Store {
    /// The versions of the store, the oldest first. Errors: damage.
    ///
    /// ```
    /// # use tetdb_engine::api as tetdb;
    /// # let dir = tempfile::tempdir()?;
    /// # let path = dir.path().join("box.tetdb");
    /// # let mut store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.25")?).create(&path)?;
    /// store.save_version("coarse", "as meshed", None)?;
    /// let before = store.summary().digest.clone();
    /// let fine = store.remesh().subdomains(&[0]).scaled(0.5).run()?.store;
    /// assert_eq!(fine.versions()?[0].digest, before);
    /// assert_eq!(tetdb::Store::open_version(&path, "coarse")?.summary().digest, before);
    /// assert!(fine.diff_versions("coarse", "now")?.subdomains[0].changed);
    /// assert!(tetdb::Store::open_version(&path, "coarse")?.diff_versions("coarse", "now")?.subdomains[0].changed);
    /// let mut store = fine.restore_version("coarse", true)?.store;
    /// assert_eq!(store.summary().digest, before);
    /// store.drop_version("coarse")?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn versions(&self) -> Result<Vec<Version>, Error> {
        guarded(self.settings(), || {
            let mut catalog = self.catalog_shared().now();
            let kept = kept(&mut catalog)?;
            let list = named(&mut catalog)?.into_iter();
            list.map(|(number, row)| shown(&catalog, number, row, &kept)).collect()
        })
    }

    /// The version of this name. Errors: `no-such-part`; damage.
    pub fn version(&self, name: &str) -> Result<Version, Error> {
        guarded(self.settings(), || {
            let mut catalog = self.catalog_shared().now();
            let ((number, row), kept) = (catalog.version_called(name)?, kept(&mut catalog)?);
            shown(&catalog, number, row, &kept)
        })
    }

    /// Saves the store as it is as a version, in one step. No file is copied: a version keeps files from being removed.
    ///
    /// With `keep`, the oldest versions beyond that number are dropped. Returns their names. Errors: `bad-version` for a name that is taken, or
    /// none: 1 to 64 letters, digits, `_`, `-` and `.`, but no `.` at the beginning and not `now`; `busy`; the disk.
    pub fn save_version(
        &mut self,
        name: &str,
        note: &str,
        keep: Option<usize>,
    ) -> Result<Vec<String>, Error> {
        let clock = Instant::now();
        self.change_fields(|catalog, _| {
            let mut others = named(catalog)?;
            check_name(name, &others)?;
            let excess = (others.len() + 1).saturating_sub(keep.unwrap_or(usize::MAX).max(1));
            let number = others.last().map_or(BEFORE, |last| last.0) + 1;
            let dropped: Vec<_> = others.drain(..excess).collect();
            let n_subdomains = catalog.subdomains()?.len().max(1);
            if others.len() >= VERSIONS_MAX.min(SUBDOMAINS_MAX / n_subdomains).max(1) {
                let message =
                    format!("the store has {} versions, the most it can have", others.len());
                return Err(bad(message).with_help("drop one first, or keep fewer"));
            }
            let saved = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |t| t.as_secs());
            let (name, note) = (name.to_owned(), note.to_owned());
            let new =
                catalog.version_now(VersionRow { name, note, saved, ..VersionRow::default() })?;
            let state = catalog.state()?;
            catalog.commit(|step| {
                step.set_version(number, &new);
                dropped.iter().for_each(|(number, _)| step.remove_version(*number));
                step.append_journal(&journal(state, "version", clock));
                Ok(())
            })?;
            Ok(dropped.into_iter().map(|(_, row)| row.name).collect())
        })
    }

    /// Makes a version the store as it is, in one step; [`Store::undo`] brings back what was before. Nothing is changed if that is the same.
    ///
    /// Also verifies the mesh if `verify` is true. Errors: `no-such-part`; `busy`; `invalid-mesh`.
    pub fn restore_version(self, name: &str, verify: bool) -> Result<Remeshed, Error> {
        self.restored(|catalog| Ok(catalog.version_called(name)?.0), verify)
    }

    /// Drops a version, and files that nothing else needs. Returns their bytes. Errors: `no-such-part`; `busy`.
    pub fn drop_version(&mut self, name: &str) -> Result<u64, Error> {
        let clock = Instant::now();
        self.change_fields(|catalog, _| {
            let (number, _) = catalog.version_called(name)?;
            let (freed, state) = (kept(catalog)?.alone.remove(&number), catalog.state()?);
            catalog.commit(|step| {
                step.remove_version(number);
                step.append_journal(&journal(state, "drop version", clock));
                Ok(())
            })?;
            Ok(freed.unwrap_or(0))
        })
    }

    /// Compares two versions; `now` is the store as it is. Only changed sub-domains are read. Errors: `no-such-part`; damage.
    pub fn diff_versions(&self, first: &str, second: &str) -> Result<VersionDiff, Error> {
        let settings = self.settings();
        guarded(settings, || {
            let open = |name: &str| -> Result<_, Error> {
                let mut catalog = self.catalog_shared().now();
                if name != NOW {
                    catalog = catalog.version_called(name).map(|(_, row)| catalog.at(&row))?;
                }
                let (rows, fields) = (catalog.subdomains()?, field_values(&mut catalog)?);
                Ok((catalog, rows, fields))
            };
            let ((a, rows_a, fields_a), (b, rows_b, fields_b)) = (open(first)?, open(second)?);
            let pairs = || rows_a.iter().zip(&rows_b);
            let subdomains = pairs().map(|(a, b)| SubdomainDiff {
                id: a.rank,
                changed: a.digest != b.digest,
                tets: [a.tets, b.tets],
                vertices: [a.vertices, b.vertices],
                worst_q: [a.quality.worst, b.quality.worst],
            });
            let changed = pairs().filter(|(a, b)| a.digest != b.digest);
            let (changed_a, changed_b): (Vec<_>, Vec<_>) =
                changed.map(|(a, b)| (a.clone(), b.clone())).unzip();
            let names = |of: &FieldValues, not_of: &FieldValues| {
                let own = of.iter().filter(|field| !not_of.contains(field));
                own.map(|field| field.0.clone()).collect()
            };
            Ok(VersionDiff {
                same: changed_a.is_empty() && fields_a == fields_b,
                subdomains: subdomains.collect(),
                fields_before: names(&fields_a, &fields_b),
                fields_after: names(&fields_b, &fields_a),
                qualities: Comparison::of_rows([(&a, &changed_a), (&b, &changed_b)], settings)?,
            })
        })
    }
}

/// Name and digests of the values of each field.
type FieldValues = BTreeSet<(String, Vec<u64>)>;

fn field_values(catalog: &mut Catalog) -> Result<FieldValues, Error> {
    let parts = catalog.field_parts()?;
    let of = |field: FieldRow| {
        let own = parts.iter().filter(|part| part.field == field.id);
        (field.name, own.map(|part| part.digest).collect())
    };
    Ok(catalog.fields()?.into_iter().map(of).collect())
}

/// Versions with a name, the oldest first.
fn named(catalog: &mut Catalog) -> Result<Vec<(u32, VersionRow)>, Error> {
    Ok(catalog.versions()?.into_iter().filter(|(number, _)| *number != BEFORE).collect())
}

fn bad(message: String) -> Error {
    Error::new(Code::BadVersion, message)
}

fn check_name(name: &str, others: &[(u32, VersionRow)]) -> Result<(), Error> {
    let is_known = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    let is_long = !(1..=NAME_MAX).contains(&name.chars().count());
    // `..` and hidden files are names of paths.
    if is_long || !name.chars().all(is_known) || name.starts_with('.') || name == NOW {
        let help = format!(
            "take up to {NAME_MAX} letters, digits, _, - and . but no . at the beginning, and not {NOW}"
        );
        return Err(bad(format!("{name:?} is no name of a version")).with_help(help));
    }
    match others.iter().any(|(_, row)| row.name == name) {
        true => Err(bad(format!("there is a version {name} already"))
            .with_help("drop it first, or take another name")),
        false => Ok(()),
    }
}

fn shown(catalog: &Catalog, number: u32, row: VersionRow, kept: &Kept) -> Result<Version, Error> {
    let mut then = catalog.at(&row);
    let (rows, fields) = (then.subdomains()?, then.fields()?);
    Ok(Version {
        name: row.name,
        note: row.note,
        saved: row.saved,
        digest: digests(&rows)[0].to_string(),
        tets: rows.iter().map(|row| row.tets).sum(),
        vertices: rows.iter().map(|row| row.vertices).sum(),
        subdomains: rows.len(),
        fields: fields.into_iter().map(|field| field.name).collect(),
        bytes: kept.alone.get(&number).copied().unwrap_or(0),
    })
}

/// Disk that versions take.
#[derive(Default)]
pub(super) struct Kept {
    /// Names of the versions, the oldest first.
    pub names: Vec<String>,
    /// Bytes of files that one version alone needs, by its number.
    pub alone: BTreeMap<u32, u64>,
    /// Bytes of files that only versions need.
    pub bytes: u64,
    /// Bytes of all files of sub-domains and fields.
    pub all_bytes: u64,
}

/// The disk that the versions of a store take, from the rows of the catalog.
pub(super) fn kept(catalog: &mut Catalog) -> Result<Kept, Error> {
    // Files of sub-domains and of fields, with their bytes.
    let (mut meshes, mut values) = (BTreeMap::new(), BTreeMap::new());
    let rows: Vec<SubdomainRow> = catalog.everywhere(RowKind::Subdomain)?;
    meshes.extend(rows.iter().map(|row| (row.file(), row.bytes)));
    let parts: Vec<FieldPart> = catalog.everywhere(RowKind::FieldPart)?;
    values.extend(parts.iter().map(|part| (part.file(), part.bytes)));
    let all_bytes = meshes.values().chain(values.values()).sum();
    for row in catalog.subdomains()? {
        meshes.remove(&row.file());
    }
    for part in catalog.field_parts()? {
        values.remove(&part.file());
    }
    let mut kept =
        Kept { bytes: meshes.values().chain(values.values()).sum(), all_bytes, ..Kept::default() };
    let mut users = [BTreeMap::<FileRow, Vec<u32>>::new(), BTreeMap::new()];
    for (number, version) in catalog.versions()? {
        for (users, files) in users.iter_mut().zip([&version.meshes, &version.fields]) {
            files.iter().for_each(|file| users.entry(*file).or_default().push(number));
        }
        kept.names.extend((number != BEFORE).then_some(version.name));
    }
    for (users, bytes) in users.iter().zip([&meshes, &values]) {
        for (file, bytes) in bytes {
            if let Some([number]) = users.get(file).map(Vec::as_slice) {
                *kept.alone.entry(*number).or_default() += bytes;
            }
        }
    }
    Ok(kept)
}
