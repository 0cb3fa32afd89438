//! Meshes in input decks of Abaqus, `.inp`: `*NODE`, `*ELEMENT` of solid tetrahedra, `*ELSET` as regions, `*SURFACE` as labels.
//!
//! The set named by `*ELEMENT` or, behind it, by `*ELSET` is the region. A later set takes elements that are in the set of `*ELEMENT` alone.

use std::collections::HashMap;
use std::io::BufRead;

use super::raw::NodeNumbers;
use super::{Feed, RawMesh, ReadFault, Result};
use crate::read::fem::{integer, line, real, unexpected, unsupported};
use crate::read::{FilePlace, feed};
use tetdb_base::geom::{Point, counted};

/// Corners of the faces S1 to S4.
const FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];

struct Deck<'a> {
    mesh: &'a mut RawMesh,
    nodes: NodeNumbers,
    elements: NodeNumbers,
    keyword: String,
    kind: String,
    /// Region of elements or of a set, or label of a surface.
    group: u32,
    is_range: bool,
    /// Regions named by `*ELEMENT`, whose elements a set may take.
    of_elements: Vec<u32>,
    n_sets: u64,
    n_parts: u32,
    /// Members of sets and surfaces that are not taken.
    n_unknown: u64,
}

pub fn read<R: BufRead>(mut feed: Feed<R>, mesh: &mut RawMesh) -> Result<()> {
    let mut deck = Deck {
        mesh,
        nodes: NodeNumbers::default(),
        elements: NodeNumbers::default(),
        keyword: String::new(),
        kind: String::new(),
        group: 0,
        is_range: false,
        of_elements: Vec::new(),
        n_sets: 0,
        n_parts: 0,
        n_unknown: 0,
    };
    while let Some((mut text, place)) = line(&mut feed, "**")? {
        let is_keyword = text.trim_start().starts_with('*');
        if is_keyword || deck.keyword == "*ELEMENT" {
            while text.ends_with(',') {
                let Some((more, _)) = line(&mut feed, "**")? else {
                    return Err(feed.truncated("the rest of the line"));
                };
                text += &more;
            }
        }
        if is_keyword {
            deck.take(&text, &place)?;
            continue;
        }
        match deck.keyword.as_str() {
            "*NODE" => deck.node(&text, &place)?,
            "*ELEMENT" => deck.element(&text, &place, &feed)?,
            "*ELSET" => deck.set(&text, &place, &feed)?,
            "*SURFACE" => deck.surface(&text, &feed)?,
            "*INSTANCE" => return Err(unsupported(&place, "an instance that is moved")),
            _ => {}
        }
    }
    for (n, text) in [
        (deck.n_sets, "[set of nodes was|sets of nodes were] left out"),
        (
            deck.n_unknown,
            "[member of a set or surface is|members of sets and surfaces are] no tetrahedra of the file or in a set already, and left out",
        ),
    ] {
        if n > 0 {
            deck.mesh.notes.push(counted(n, text));
        }
    }
    Ok(())
}

impl Deck<'_> {
    fn take(&mut self, text: &str, place: &FilePlace) -> Result<()> {
        let mut words = text.trim_start().split(',').map(str::trim);
        self.keyword = words.next().unwrap_or_default().to_ascii_uppercase();
        let options: HashMap<String, String> = words
            .map(|word| {
                let (key, value) = word.split_once('=').unwrap_or((word, ""));
                (key.trim().to_ascii_uppercase(), value.trim().to_owned())
            })
            .collect();
        let value = |key: &str| options.get(key).cloned().unwrap_or_default();
        match self.keyword.as_str() {
            "*NODE" | "*ELEMENT" | "*ELSET" if options.contains_key("INPUT") => {
                return Err(unsupported(place, "data in a file of its own (INPUT)"));
            }
            "*NODE" if options.get("SYSTEM").is_some_and(|s| !s.eq_ignore_ascii_case("R")) => {
                return Err(unsupported(place, "coordinates that are not rectangular (SYSTEM)"));
            }
            // Programs keep the sides of surfaces in such sets.
            "*ELSET" if options.contains_key("INTERNAL") => self.keyword.clear(),
            "*ELEMENT" => {
                self.kind = value("TYPE").to_ascii_uppercase();
                self.group = self.mesh.regions.named(&value("ELSET"));
                self.of_elements.push(self.group);
            }
            "*ELSET" => {
                self.group = self.mesh.regions.named(&value("ELSET"));
                self.is_range = options.contains_key("GENERATE");
            }
            "*SURFACE" => {
                self.group = self.mesh.labels.named(&value("NAME"));
            }
            "*NSET" => self.n_sets += 1,
            "*PART" => {
                self.n_parts += 1;
                if self.n_parts > 1 {
                    return Err(unsupported(place, "a deck of several parts"));
                }
            }
            "*INCLUDE" | "*SYSTEM" | "*NGEN" | "*NFILL" | "*ELGEN" | "*NCOPY" | "*NMAP"
            | "*ELCOPY" => return Err(unsupported(place, format!("the keyword {}", self.keyword))),
            _ => {}
        }
        Ok(())
    }

    fn node(&mut self, text: &str, place: &FilePlace) -> Result<()> {
        let mut words = text.split(',');
        let number = integer(words.next().unwrap_or_default(), place)?;
        let mut xyz = [0.0; 3];
        for x in &mut xyz {
            if let Some(word) = words.next().filter(|word| !word.trim().is_empty()) {
                *x = real(word, place)?;
            }
        }
        let p = Point::from_array(xyz);
        feed::check_point(p, place)?;
        self.nodes.push(number, &self.mesh.space);
        self.mesh.point(p);
        Ok(())
    }

    fn element<R: BufRead>(&mut self, text: &str, place: &FilePlace, feed: &Feed<R>) -> Result<()> {
        let is = |prefixes: &[&str]| prefixes.iter().any(|p| self.kind.starts_with(p));
        if is(&[
            "T2D", "T3D", "B2", "B3", "PIPE", "CONN", "SPRING", "MASS", "ROTARY", "DASH", "GAP",
        ]) {
            self.mesh.n_thin += 1;
            return Ok(());
        }
        let mut numbers = [0; 11];
        let mut n = 0;
        for word in text.split(',').filter(|word| !word.trim().is_empty()) {
            let number = integer(word, place)?;
            if let Some(slot) = numbers.get_mut(n) {
                *slot = number;
            }
            n += 1;
        }
        let is_face = is(&["S", "DS", "R3D", "M3D", "CPS", "CPE", "F3D"]) && !is(&["SC", "SPRING"]);
        if is_face && [4, 7].contains(&n) {
            let corners = self.corners::<3, R>(&numbers[1..], place, feed)?;
            self.mesh.n_curved += u64::from(n > 4);
            let name = self.mesh.regions.list[self.group as usize].1.clone();
            let label = self.mesh.labels.named(&name);
            self.mesh.triangle(corners, label);
            return Ok(());
        }
        let declared = ["C3D", "DC3D", "AC3D"].iter().find_map(|p| self.kind.strip_prefix(p));
        let digits = |rest: &str| rest.chars().take_while(char::is_ascii_digit).collect::<String>();
        let declared = declared.and_then(|rest| digits(rest).parse::<usize>().ok());
        if ![Some(4), Some(10)].contains(&declared) || declared != n.checked_sub(1) {
            let what = format!("elements of the type {} with {} nodes", self.kind, n.max(1) - 1);
            return Err(unsupported(place, what));
        }
        let corners = self.corners::<4, R>(&numbers[1..], place, feed)?;
        self.mesh.n_curved += u64::from(n > 5);
        self.elements.push(numbers[0], &self.mesh.space);
        let taken = self.mesh.tet(corners, self.group, 0);
        taken.map_err(|fault: ReadFault| place.refuse(fault))
    }

    fn corners<const N: usize, R: BufRead>(
        &mut self,
        numbers: &[i64],
        place: &FilePlace,
        feed: &Feed<R>,
    ) -> Result<[u32; N]> {
        let mut corners = [0; N];
        for (corner, &number) in corners.iter_mut().zip(numbers) {
            let found = self.nodes.find(number, &self.mesh.space, feed);
            *corner = found.map_err(|e| e.at_spot(place.spot))?;
        }
        Ok(corners)
    }

    /// Puts elements into the set, unless they are in one.
    fn set<R: BufRead>(&mut self, text: &str, place: &FilePlace, feed: &Feed<R>) -> Result<()> {
        let words: Vec<&str> = text.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
        if self.is_range {
            let numbers = words.iter().map(|w| integer(w, place)).collect::<Result<Vec<i64>>>()?;
            let (first, last, step) = match numbers[..] {
                [first, last] if first <= last => (first, last, 1),
                [first, last, step] if step > 0 && first <= last => (first, last, step),
                _ => return Err(unexpected(place, "first, last and step of elements", text)),
            };
            let mut number = first;
            while number <= last && number - first < 1 << 31 {
                self.put(number, feed);
                let Some(next) = number.checked_add(step) else {
                    break;
                };
                number = next;
            }
            return Ok(());
        }
        for word in words {
            match word.parse() {
                Ok(number) => self.put(number, feed),
                Err(_) => self.n_unknown += 1,
            }
        }
        Ok(())
    }

    fn put<R: BufRead>(&mut self, number: i64, feed: &Feed<R>) {
        let Ok(t) = self.elements.find(number, &self.mesh.space, feed) else {
            self.n_unknown += 1;
            return;
        };
        let mut tet = self.mesh.tets.get(t as usize);
        match self.of_elements.contains(&tet[4]) {
            true => tet[4] = self.group,
            false => self.n_unknown += 1,
        }
        self.mesh.tets.set(t as usize, tet);
    }

    /// A face of an element as `12, S3`.
    fn surface<R: BufRead>(&mut self, text: &str, feed: &Feed<R>) -> Result<()> {
        let mut words = text.split(',').map(str::trim);
        let (number, face) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let face = face.to_ascii_uppercase().strip_prefix('S').and_then(|k| k.parse().ok());
        let face = face.filter(|k| (1..=4usize).contains(k));
        let found = number
            .parse()
            .ok()
            .and_then(|number| self.elements.find(number, &self.mesh.space, feed).ok());
        let (Some(t), Some(face)) = (found, face) else {
            self.n_unknown += 1;
            return Ok(());
        };
        let tet = self.mesh.tets.get(t as usize);
        self.mesh.triangle(FACES[face - 1].map(|k| tet[k]), self.group);
        Ok(())
    }
}
