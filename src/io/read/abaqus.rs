//! Input decks of Abaqus, `.inp`: faces and nodes; element sets are labels.

use std::collections::HashMap;
use std::io::BufRead;

use super::element_sets::ASSEMBLY;
use super::feed::{Feed, Result, parse, quote};
use super::fem::{Elements, integer, line, real, unexpected, unsupported};
use super::gmsh_numbers::NodeTags;
use super::{FilePlace, SurfaceSink};
use tetdb_base::surface::NoteKind;

/// A keyword line and the state of the deck below it.
#[derive(Default)]
struct Deck {
    keyword: String,
    /// Names of options in capitals, with their values.
    options: Vec<(String, String)>,
    /// Type and set of the elements.
    kind: String,
    set: String,
    /// Element set to which lines add: its number, part, scope of the names in it, and whether lines are ranges.
    adds_to: Option<(u32, u32, u32, bool)>,
    n_parts: u32,
    n_instances: u32,
    is_assembly: bool,
    /// Parts by name, and by the name of an instance.
    parts: HashMap<String, u32>,
    instances: HashMap<String, u32>,
    /// Node sets, surfaces and internal element sets.
    n_left_out: u64,
    /// Members of sets that the file does not have.
    n_unknown: u64,
}

impl Elements<'_, '_> {
    /// An element of Abaqus: its number and its nodes.
    pub(super) fn abaqus_element(
        &mut self,
        text: &str,
        kind: &str,
        set: &str,
        place: &FilePlace,
    ) -> Result<()> {
        let words = text.split(',').filter(|w| !w.trim().is_empty());
        let tags = words.map(|w| integer(w, place)).collect::<Result<Vec<i64>>>()?;
        let (id, tags) = tags.split_first().ok_or_else(|| unexpected(place, "an element", text))?;
        let is = |prefixes: &[&str]| prefixes.iter().any(|p| kind.starts_with(p));
        let n = tags.len();
        // Continuum shells are solid elements.
        if is(&["C3D", "DC3D", "AC3D", "SC6R", "SC8R"]) {
            let corners = match n {
                4 | 10 => 4,
                5 | 13 => 5,
                6 | 15 => 6,
                8 | 20 | 27 => 8,
                _ => return Err(unexpected(place, "a solid element of that type", kind)),
            };
            self.late_solids.push((tags[..corners].to_vec(), set.to_owned(), place.clone()));
        } else if is(&[
            "T2D", "T3D", "B2", "B3", "PIPE", "CONN", "SPRING", "MASS", "ROTARY", "DASH", "GAP",
            "R2D", "RB",
        ]) {
            self.n_thin += 1;
        } else if is(&["S", "DS", "R3D", "M3D", "CPS", "CPE", "CAX", "F3D"]) {
            let corners = match n {
                3 | 6 | 7 => 3,
                4 | 8 | 9 => 4,
                _ => return Err(unexpected(place, "3, 4, 6, 8 or 9 nodes", text)),
            };
            self.face(*id, &tags[..corners], n, set, place);
        } else {
            return Err(unsupported(place, format!("the element type {}", quote(kind.as_bytes()))));
        }
        Ok(())
    }

    /// A line of `*ELSET`: numbers of elements, names of sets, or first, last and step.
    fn abaqus_set(&mut self, text: &str, deck: &mut Deck, place: &FilePlace) -> Result<()> {
        let Some((set, part, scope, is_range)) = deck.adds_to else { return Ok(()) };
        let words: Vec<&str> = text.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
        if is_range {
            let numbers = words.iter().map(|w| integer(w, place)).collect::<Result<Vec<i64>>>()?;
            let range = match numbers[..] {
                [first, last] => [first, last, 1],
                [first, last, step] if step > 0 => [first, last, step],
                _ => return Err(unexpected(place, "first, last and step of elements", text)),
            };
            if range[0] > range[1] {
                return Err(unexpected(place, "a last element behind the first", text));
            }
            self.sets.add(set, part, range);
            return Ok(());
        }
        for word in words {
            let of = word.split_once('.').and_then(|(instance, word)| {
                Some((*deck.instances.get(&instance.to_ascii_uppercase())?, word))
            });
            let (part, scope, word) = of.map_or((part, scope, word), |(of, word)| (of, of, word));
            let is_known = match parse::<i64>(word.as_bytes()) {
                Some(id) if part != ASSEMBLY => {
                    self.sets.add(set, part, [id, id, 1]);
                    true
                }
                Some(_) => false,
                None => self.sets.add_set(set, scope, word),
            };
            deck.n_unknown += u64::from(!is_known);
        }
        Ok(())
    }
}

impl Deck {
    fn option(&self, key: &str) -> Option<&str> {
        self.options.iter().find(|o| o.0 == key).map(|o| o.1.as_str())
    }

    /// Takes a keyword line.
    fn take(&mut self, text: &str, mesh: &mut Elements, place: &FilePlace) -> Result<()> {
        let mut words = text.trim_start().split(',').map(str::trim);
        self.keyword = words.next().unwrap_or_default().to_ascii_uppercase();
        let option = |w: &str| {
            let (key, value) = w.split_once('=').unwrap_or((w, ""));
            (key.trim().to_ascii_uppercase(), value.trim().to_owned())
        };
        self.options = words.map(option).collect();
        let value = |key| self.option(key).unwrap_or_default().to_owned();
        let [kind, set] = ["TYPE", "ELSET"].map(value);
        let [name, part] = ["NAME", "PART"].map(|key| value(key).to_ascii_uppercase());
        match self.keyword.as_str() {
            "*NODE" | "*ELEMENT" | "*ELSET" if self.option("INPUT").is_some() => {
                return Err(unsupported(place, "data in a file of its own (INPUT)"));
            }
            "*ELEMENT" => {
                (self.kind, self.set) = (kind.to_ascii_uppercase(), set);
            }
            "*PART" => {
                mesh.end_part()?;
                self.n_parts += 1;
                mesh.part = self.n_parts;
                self.parts.insert(name, self.n_parts);
                mesh.nodes = NodeTags::default();
                mesh.first = mesh.target.builder.n_file_vertices() as u32;
            }
            "*ASSEMBLY" | "*END ASSEMBLY" => self.is_assembly = self.keyword == "*ASSEMBLY",
            "*INSTANCE" => {
                self.n_instances += 1;
                let part = self.parts.get(&part).copied();
                self.instances.insert(name, part.unwrap_or(mesh.part));
            }
            "*ELSET" => self.begin_set(mesh),
            "*NSET" | "*SURFACE" => self.n_left_out += 1,
            "*INCLUDE" | "*SYSTEM" | "*NGEN" | "*NFILL" | "*ELGEN" | "*NCOPY" | "*NMAP"
            | "*ELCOPY" => {
                return Err(unsupported(place, format!("the keyword {}", self.keyword)));
            }
            "*NODE" if self.option("SYSTEM").is_some_and(|s| !s.eq_ignore_ascii_case("R")) => {
                return Err(unsupported(place, "nodes in a coordinate system of their own"));
            }
            _ => {}
        }
        if self.n_instances > self.n_parts.max(1) {
            return Err(unsupported(place, "a part with several instances"));
        }
        Ok(())
    }

    /// Finds the set of `*ELSET`. Internal ones are those of a dialog, without a name by the user.
    fn begin_set(&mut self, mesh: &mut Elements) {
        self.adds_to = None;
        if self.option("INTERNAL").is_some() {
            self.n_left_out += 1;
            return;
        }
        let scope = if self.is_assembly { ASSEMBLY } else { mesh.part };
        let instance = self.option("INSTANCE").unwrap_or_default().to_ascii_uppercase();
        let part = self.instances.get(&instance).copied();
        let set = mesh.sets.any_case(scope, self.option("ELSET").unwrap_or_default());
        let is_range = self.option("GENERATE").is_some();
        self.adds_to = Some((set, part.unwrap_or(scope), part.unwrap_or(scope), is_range));
    }
}

/// Reads an input deck of Abaqus: `*NODE`, `*ELEMENT` and `*ELSET`; the sets of an element are its labels.
pub(super) fn read_abaqus<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut mesh = Elements::new(target);
    let mut deck = Deck::default();
    while let Some((mut text, place)) = line(&mut feed, "**")? {
        let is_keyword = text.trim_start().starts_with('*');
        if is_keyword || deck.keyword == "*ELEMENT" {
            let rest =
                if is_keyword { "the rest of the keyword" } else { "more nodes of the element" };
            while text.ends_with(',') {
                let Some((more, _)) = line(&mut feed, "**")? else {
                    return Err(feed.truncated(rest));
                };
                text += &more;
            }
        }
        if is_keyword {
            deck.take(&text, &mut mesh, &place)?;
            continue;
        }
        match deck.keyword.as_str() {
            "*INSTANCE" => return Err(unsupported(&place, "an instance that is moved")),
            "*NODE" => {
                let words: Vec<&str> = text.split(',').collect();
                let mut xyz = [0.0; 3];
                for (k, x) in xyz.iter_mut().enumerate() {
                    let word = words.get(k + 1).map(|w| w.trim()).filter(|w| !w.is_empty());
                    *x = word.map_or(Ok(0.0), |w| real(w, &place))?;
                }
                mesh.node(integer(words[0], &place)?, xyz, &place)?;
            }
            "*ELEMENT" => mesh.abaqus_element(&text, &deck.kind, &deck.set, &place)?,
            "*ELSET" => mesh.abaqus_set(&text, &mut deck, &place)?,
            _ => {}
        }
    }
    let n_with_others = mesh.take_faces()?;
    for (n, what) in [
        (deck.n_left_out, "node sets, surfaces and internal element sets were left out"),
        (
            n_with_others,
            "element sets have elements that are no faces; those have the set of *ELEMENT alone",
        ),
        (deck.n_unknown, "members of element sets are unknown and were left out"),
    ] {
        if n > 0 {
            mesh.target.builder.note(NoteKind::Said(format!("{n} {what}")));
        }
    }
    mesh.finish(&feed)
}
