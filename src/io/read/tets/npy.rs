//! Meshes in arrays of NumPy, as the exports write them: `NAME_points.npy`, `NAME_tets.npy`, and where they are there `NAME_region.npy`,
//! `NAME_subdomain.npy`, `NAME_triangles.npy` and `NAME_label.npy`.

use std::path::{Path, PathBuf};

use super::numbers::{Coding, Layout, Numbers, field_number};
use super::{FilePlace, MeshFields, RawMesh, ReadFault, Result};
use crate::read::error::Spot;
use crate::read::feed::check_point;
use crate::read::lengths::{ArrayFile, sides_of};
use tetdb_base::geom::Point;
use tetdb_schema::code::Code;
use tetdb_schema::field::FieldPlace;

/// The file of tetrahedra of a mesh that is named by one of its arrays, or by their common beginning.
pub fn tets_file(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let base = ["_points", "_tets"].iter().find_map(|end| stem.strip_suffix(end)).unwrap_or(&stem);
    path.with_file_name(format!("{base}_tets.npy"))
}

pub fn read(path: &Path, fields: MeshFields, mesh: &mut RawMesh) -> Result<()> {
    let tets = tets_file(path);
    let stem = tets.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let base = stem.trim_end_matches("_tets.npy").to_owned();
    mesh.stem.clone_from(&base);
    let beside = |name: &str| tets.with_file_name(format!("{base}_{name}.npy"));
    let (n_points, mut points) = array(&beside("points"), 3)?;
    for _ in 0..n_points {
        let p = Point::new(points.real()?, points.real()?, points.real()?);
        check_point(p, points.place())?;
        mesh.point(p);
    }
    points.end()?;
    let (n, mut corners) = array(&tets, 4)?;
    let column = |name: Option<&str>, default: &str, n: u64| -> Result<Option<Numbers>> {
        let path = beside(name.unwrap_or(default));
        if name.is_none() && (default.is_empty() || !path.is_file()) {
            return Ok(None);
        }
        let (found, numbers) = array(&path, 1)?;
        match found == n {
            true => Ok(Some(numbers)),
            false => Err(FilePlace::new(&path).refuse(ReadFault::CountMismatch {
                what: "numbers in an array",
                declared: found.to_string(),
                found: format!("{n} elements"),
            })),
        }
    };
    let mut regions = column(fields.region, "region", n)?;
    let mut parts = column(fields.part, "", n)?;
    let next = |list: &mut Option<Numbers>| list.as_mut().map_or(Ok(0), Numbers::integer);
    for _ in 0..n {
        let four = [(); 4].map(|()| vertex(&mut corners, n_points));
        let [a, b, c, d] = four;
        let region = mesh.regions.number(next(&mut regions)?);
        let part = match &mut parts {
            Some(parts) => mesh.parts.number(parts.integer()?),
            None => 0,
        };
        let taken = mesh.tet([a?, b?, c?, d?], region, part);
        taken.map_err(|fault| corners.place().refuse(fault))?;
    }
    [regions, parts].into_iter().flatten().chain([corners]).try_for_each(Numbers::end)?;
    values(&tets, &base, [n_points, n], fields, mesh)?;
    let triangles = beside("triangles");
    if triangles.is_file() {
        let (n, mut corners) = array(&triangles, 3)?;
        let mut labels = column(None, "label", n)?;
        for _ in 0..n {
            let [a, b, c] = [(); 3].map(|()| vertex(&mut corners, n_points));
            let corners = [a?, b?, c?];
            let label = mesh.labels.number(next(&mut labels)?);
            mesh.triangle(corners, label);
        }
        if labels.is_some() {
            mesh.notes.push("labels have numbers for names: arrays hold no others".to_owned());
        }
        labels.into_iter().chain([corners]).try_for_each(Numbers::end)?;
    }
    Ok(())
}

/// Arrays beside that have a row for each vertex, or for each tetrahedron; which is known where these are not equally many.
fn values(
    tets: &Path,
    base: &str,
    counts: [u64; 2],
    fields: MeshFields,
    mesh: &mut RawMesh,
) -> Result<()> {
    let folder = tets.parent().filter(|folder| !folder.as_os_str().is_empty());
    let listed = std::fs::read_dir(folder.unwrap_or(Path::new(".")));
    let listed =
        listed.map_err(|e| FilePlace::new(tets).refuse(ReadFault::Unreadable(e.to_string())))?;
    let mut names: Vec<String> =
        listed.flatten().filter_map(|file| file.file_name().into_string().ok()).collect();
    names.sort();
    let names: Vec<&str> = names
        .iter()
        .filter_map(|file| file.strip_prefix(base)?.strip_prefix('_')?.strip_suffix(".npy"))
        .collect();
    // Meshes whose names go on where the name of this one ends.
    let is_mesh = |other: &&str| names.contains(&&*format!("{other}_points"));
    let others: Vec<&str> =
        names.iter().filter_map(|name| name.strip_suffix("_tets")).filter(is_mesh).collect();
    let is_foreign = |name: &str| {
        let mut rests = others.iter().filter_map(|other| name.strip_prefix(other));
        rests.any(|rest| rest.starts_with('_'))
    };
    let mut left_out = Vec::new();
    for &name in names.iter().filter(|name| !is_foreign(name)) {
        let own = ["points", "tets", "triangles", "region", "label"];
        if own.contains(&name) || [fields.part, fields.region].contains(&Some(name)) {
            continue;
        }
        let path = tets.with_file_name(format!("{base}_{name}.npy"));
        let is_wanted = fields.values.is_some_and(|takes| takes(name));
        let found = if is_wanted { open_foreign(&path)? } else { None };
        let field = found.as_ref().and_then(|(rows, columns, kind, _)| {
            let place = match counts.map(|n| n == *rows) {
                [true, false] => FieldPlace::Vertices,
                [false, true] => FieldPlace::Tets,
                _ => return None,
            };
            mesh.field(name, place, field_number(kind)?, *columns as usize)
        });
        let (Some(field), Some((rows, _, _, numbers))) = (field, found) else {
            left_out.push(name);
            continue;
        };
        mesh.values(field, numbers, rows)?;
    }
    mesh.leave_out(&left_out);
    if !others.is_empty() {
        mesh.notes.push(format!("arrays of other meshes were left out: {}", others.join(", ")));
    }
    Ok(())
}

/// As [`open`]; `None` also for what is no array at all, for all files of that name are tried.
fn open_foreign(path: &Path) -> Result<Option<(u64, u64, &'static str, Numbers)>> {
    match open(path) {
        Err(error) if error.code() != Code::UnreadableFile => Ok(None),
        opened => opened,
    }
}

fn vertex(corners: &mut Numbers, n: u64) -> Result<u32> {
    let v = corners.integer()?;
    let known = u64::try_from(v).ok().filter(|&v| v < n);
    known.map(|v| v as u32).ok_or_else(|| {
        let (low, high) = (0, n as i64 - 1);
        corners.place().refuse(ReadFault::IndexOutOfRange { index: v, low, high })
    })
}

/// The numbers of an array of so many columns, and of how many rows. Errors: another shape or type.
fn array(path: &Path, columns: u64) -> Result<(u64, Numbers)> {
    match open(path)? {
        Some((rows, found, _, numbers)) if found == columns => Ok((rows, numbers)),
        _ => {
            let mut file = ArrayFile::open(path)?;
            let (kind, _, shape) = file.head_words()?;
            let expected = format!("rows of {columns} numbers in C order");
            let found = format!("an array of shape {shape} and type {kind}");
            Err(file.unexpected(Spot::Byte(8), &expected, found))
        }
    }
}

/// Rows, columns, type in VTK's words and numbers of an array; `None` for another shape or type.
fn open(path: &Path) -> Result<Option<(u64, u64, &'static str, Numbers)>> {
    let mut file = ArrayFile::open(path)?;
    let (kind, is_by_rows, shape) = file.head_words()?;
    let sides = sides_of(&shape);
    let sides: Option<Vec<u64>> = sides.iter().map(|side| side.parse().ok()).collect();
    let (rows, columns) = match sides.as_deref() {
        Some(&[n]) => (n, 1),
        Some(&[n, k]) if is_by_rows || k == 1 => (n, k),
        Some(&[n, k, l]) if is_by_rows => (n, k.saturating_mul(l)),
        _ => return Ok(None),
    };
    let word = match kind.trim_start_matches(['<', '>', '=', '|']) {
        "i1" => "Int8",
        "u1" => "UInt8",
        "i2" => "Int16",
        "u2" => "UInt16",
        "i4" => "Int32",
        "u4" => "UInt32",
        "i8" => "Int64",
        "u8" => "UInt64",
        "f4" => "Float32",
        "f8" => "Float64",
        _ => return Ok(None),
    };
    let is_big = kind.starts_with('>');
    let layout = Layout { is_big, header: 0, is_packed: false, block_max: 0 };
    let at = file.taken();
    let open = std::fs::File::open(path)
        .map_err(|e| FilePlace::new(path).refuse(ReadFault::Unreadable(e.to_string())))?;
    let (name, what) = (path.to_string_lossy(), "the numbers of an array");
    let numbers = Numbers::binary(&name, open, at, word, (Coding::Raw, layout), what)?;
    Ok(Some((rows, columns, word, numbers)))
}
