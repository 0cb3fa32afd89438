//! Universal files of I-DEAS, `.unv`: faces and nodes.

use std::collections::BTreeSet;
use std::io::BufRead;

use super::feed::{Feed, Result, name};
use super::fem::{DeckLine, Elements, integer, line, real, unexpected, unsupported};
use super::{FilePlace, SurfaceSink};
use tetdb_base::surface::NoteKind;

/// Reads a universal file of I-DEAS: nodes (2411, 781), elements (2412) and groups of elements, which are labels.
pub(super) fn read_unv<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut mesh = Elements::new(target);
    let mut n_others = 0;
    let mut solids = Vec::new();
    while let Some((mark, place)) = line(&mut feed, "\0")? {
        if mark.trim() != "-1" {
            return Err(unexpected(&place, "-1 before a data set", mark));
        }
        let Some((kind, _)) = line(&mut feed, "\0")? else {
            break;
        };
        let mut rows = Vec::new();
        loop {
            match line(&mut feed, "\0")? {
                Some((text, _)) if text.trim() == "-1" => break,
                Some(row) => rows.push(row),
                None => return Err(feed.truncated("-1 behind a data set")),
            }
        }
        let mut rows = rows.into_iter();
        match kind.trim() {
            "2411" | "781" => {
                while let (Some((head, place)), Some((xyz, second))) = (rows.next(), rows.next()) {
                    let tag = numbers(&head, &place)?.first().copied().unwrap_or(0);
                    let xyz = xyz
                        .split_whitespace()
                        .map(|w| real(w, &second))
                        .collect::<Result<Vec<f64>>>()?;
                    let xyz = xyz
                        .try_into()
                        .map_err(|_| unexpected(&second, "three coordinates", "others"))?;
                    mesh.node(tag, xyz, &place)?;
                }
            }
            "2412" => {
                unv_elements(&mut mesh, rows, &mut solids)?;
            }
            "2467" | "2477" | "2452" | "2435" | "2432" | "2430" | "2429" => {
                n_others += read_groups(&mut mesh, kind.trim(), rows)?;
            }
            kind @ ("15" | "71" | "780" | "2417") => {
                return Err(unsupported(&place, format!("the old data set {kind}")));
            }
            "2420" if !are_global_axes(rows) => {
                return Err(unsupported(&place, "a coordinate system of its own (2420)"));
            }
            _ => {}
        }
    }
    mesh.take_faces()?;
    let elements: Vec<(u32, i64)> = solids.iter().map(|(id, ..)| (0, *id)).collect();
    let (groups, _) = mesh.sets.by_element(&elements);
    let mut others = BTreeSet::new();
    for (id, tags, place) in solids {
        let sets = groups.get(&(0, id)).map_or(&[][..], Vec::as_slice);
        let mut names = sets.iter().map(|&set| mesh.sets.name(set).to_owned());
        let name = names.next().unwrap_or_default();
        others.extend(names);
        mesh.solid(&tags, &name, &place)?;
    }
    if !others.is_empty() {
        let names = Vec::from_iter(others).join(", ");
        mesh.target.builder.note(NoteKind::OtherGroups { names });
    }
    if n_others > 0 {
        let what = "entries of groups that are no elements, such as nodes,";
        mesh.target.builder.note(NoteKind::SkippedElements { what, n: n_others });
    }
    mesh.finish(&feed)
}

/// Reads a data set of groups: kind and number of an entity, and in later kinds of data sets two more words. Returns the number of
/// entries that are no elements.
fn read_groups(
    mesh: &mut Elements,
    kind: &str,
    mut rows: impl Iterator<Item = DeckLine>,
) -> Result<u64> {
    let each = if ["2432", "2430", "2429"].contains(&kind) { 2 } else { 4 };
    let mut n_others = 0;
    while let (Some((head, place)), Some((title, _))) = (rows.next(), rows.next()) {
        let n = numbers(&head, &place)?.last().copied().unwrap_or(0);
        let mut words = Vec::new();
        while (words.len() as i64) < n.saturating_mul(each) {
            let Some((row, place)) = rows.next() else {
                let expected = format!("{n} entities of the group");
                return Err(unexpected(&place, &expected, "the end of the data set"));
            };
            words.extend(numbers(&row, &place)?);
        }
        let set = mesh.sets.exact(0, &name(title.as_bytes()));
        for entry in words.chunks_exact(each as usize) {
            // Kind 8 is an element.
            match entry[0] {
                8 => mesh.sets.add(set, 0, [entry[1], entry[1], 1]),
                0 => {}
                _ => n_others += 1,
            }
        }
    }
    Ok(n_others)
}

/// Returns whether the matrix of a coordinate system is that of the global axes, which leaves nodes in place.
fn are_global_axes(rows: impl Iterator<Item = DeckLine>) -> bool {
    let words: Vec<String> = rows
        .skip(3)
        .flat_map(|(text, _)| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
        .collect();
    let axes: Vec<f64> = (words.iter().take(12))
        .filter_map(|w| w.to_ascii_lowercase().replace('d', "e").parse().ok())
        .collect();
    axes.iter().enumerate().all(|(k, x)| *x == f64::from(u8::from(k < 9 && k % 4 == 0)))
}

fn numbers(text: &str, place: &FilePlace) -> Result<Vec<i64>> {
    text.split_whitespace().map(|w| integer(w, place)).collect()
}

/// The elements of data set 2412; solid ones go to `solids`.
fn unv_elements(
    mesh: &mut Elements,
    rows: impl Iterator<Item = DeckLine>,
    solids: &mut Vec<(i64, Vec<i64>, FilePlace)>,
) -> Result<()> {
    let mut rows = rows.peekable();
    while let Some((head, place)) = rows.next() {
        let [id, kind, .., n] = numbers(&head, &place)?[..] else {
            return Err(unexpected(&place, "the head of an element", head));
        };
        // Beams have a line of three numbers for their orientation, rods in some files.
        let is_rod = kind == 11 && n == 2;
        let has_three = |(row, _): &DeckLine| row.split_whitespace().count() == 3;
        if matches!(kind, 21..=24) || is_rod && rows.peek().is_some_and(has_three) {
            rows.next();
        }
        let mut tags = Vec::new();
        while (tags.len() as i64) < n {
            let Some((row, place)) = rows.next() else {
                return Err(unexpected(
                    &place,
                    "the nodes of the element",
                    "the end of the data set",
                ));
            };
            tags.extend(numbers(&row, &place)?);
        }
        // The nodes of a curved face run around it: every second one is a corner.
        let corners = |step: usize| tags.iter().copied().step_by(step).collect::<Vec<i64>>();
        match (kind, tags.len()) {
            (41 | 51 | 61 | 71 | 74 | 81 | 91, 3) | (44 | 54 | 64 | 84 | 94, 4) => {
                mesh.face(id, &tags, tags.len(), "", &place);
            }
            (42 | 52 | 62 | 72 | 82 | 92, 6) | (45 | 55 | 65 | 75 | 85 | 95, 8) => {
                mesh.face(id, &corners(2), tags.len(), "", &place);
            }
            (111, 4) | (112, 6) | (115, 8) => solids.push((id, tags, place)),
            (118, 10) => solids.push((id, vec![tags[0], tags[2], tags[4], tags[9]], place)),
            (11 | 21..=24 | 31 | 32 | 121..=171, _) => mesh.n_thin += 1,
            _ => {
                let what = format!("element type {kind} of {} nodes", tags.len());
                return Err(unsupported(&place, what));
            }
        }
    }
    Ok(())
}
