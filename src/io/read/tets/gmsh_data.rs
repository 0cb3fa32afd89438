//! Values at the nodes and elements of Gmsh files, `$NodeData` and `$ElementData`.

use std::io::BufRead;

use super::Result;
use crate::read::gmsh::GmshReader;
use tetdb_schema::field::{FieldNumber, FieldPlace};

impl<R: BufRead> GmshReader<'_, '_, R> {
    /// Reads a section of values into a field of the mesh. One that is not taken, or has no value for some vertex or tetrahedron, is left
    /// out with a note.
    pub(in crate::read) fn read_values(
        &mut self,
        place: FieldPlace,
        end: &'static str,
    ) -> Result<()> {
        let numbers = &mut self.numbers;
        let n_texts = numbers.feed.count("texts", 1)?;
        numbers.feed.skip_line()?;
        let (mut name, mut line) = (String::new(), Vec::new());
        for i in 0..n_texts {
            line.clear();
            numbers.feed.read_line(&mut line)?;
            if i == 0 {
                let text = String::from_utf8_lossy(&line);
                name = text.trim().trim_matches('"').to_owned();
            }
        }
        for _ in 0..numbers.feed.count("numbers", 2)? {
            numbers.feed.need_word("a number")?;
        }
        // Step, components, records.
        let mut counts = [0, 1, 0];
        for k in 0..numbers.feed.count("whole numbers", 2)? {
            let n = numbers.feed.integer("a whole number")?;
            if let Some(count) = counts.get_mut(k as usize) {
                *count = n;
            }
        }
        if numbers.binary {
            numbers.feed.skip_line()?;
        }
        let components = numbers.check_count("numbers of a value", counts[1], 1, 8)?;
        let n = numbers.check_count("values", counts[2], 1 + components, 6)?;
        let Some(sink) = &mut self.tets else { return Ok(()) };
        let (total, known) = match place {
            FieldPlace::Vertices => (sink.mesh.points.len(), &mut sink.nodes),
            FieldPlace::Tets => (sink.mesh.tets.len(), &mut sink.elements),
        };
        let mesh = &mut *sink.mesh;
        // Values before their vertices or tetrahedra, or of numbers that no table holds, are left out.
        let is_usable = total > 0 && known.prepare(&mesh.space, &numbers.feed).is_ok();
        let field = match is_usable && sink.takes.is_some_and(|takes| takes(&name)) {
            true => mesh.field(&name, place, FieldNumber::F64, components as usize),
            false => None,
        };
        if let Some(field) = field {
            (0..total as u64 * components).for_each(|_| mesh.fields[field].words.push(0));
        }
        let n_seen_at = if field.is_some() { total } else { 0 };
        let (mut seen, mut n_seen) = (mesh.space.vec(n_seen_at, 0u8), 0);
        for i in 0..n {
            numbers.need_record("values", n, i)?;
            let tag = numbers.int()?;
            // Elements that are no tetrahedra have no number here.
            let at = match field {
                Some(_) => known.find(tag, &mesh.space, &numbers.feed).ok(),
                None => None,
            };
            let at = at.map(|at| at as usize).filter(|&at| at < seen.len());
            for k in 0..components as usize {
                let word = numbers.value()?.to_bits();
                if let (Some(field), Some(at)) = (field, at) {
                    mesh.fields[field].words.set(at * components as usize + k, word);
                }
            }
            if let Some(at) = at {
                n_seen += usize::from(seen.get(at) == 0);
                seen.set(at, 1);
            }
        }
        if field.is_some() && n_seen < total {
            mesh.fields.pop();
        }
        if field.is_none() || n_seen < total {
            mesh.leave_out(&[&name]);
        }
        numbers.end(end)
    }
}
