//! Meshes in input decks of Abaqus, `.inp`: `*NODE`, `*ELEMENT` of solid tetrahedra, `*ELSET` as regions, `*SURFACE` as labels.
//!
//! The set named by `*ELEMENT` or, behind it, by `*ELSET` is the region. A later set takes elements that are in the set of `*ELEMENT` alone.
//! Sets and surfaces may name sets of `*ELSET` before them. Abaqus/CAE has one for each side of a surface, with the option `INTERNAL`.

use std::collections::HashMap;
use std::io::BufRead;
use std::ops::Range;

use super::raw::NodeNumbers;
use super::{Feed, RawMesh, ReadFault, Result};
use crate::read::fem::{integer, line, real, unexpected, unsupported};
use crate::read::{FilePlace, feed};
use tetdb_base::geom::{Point, counted};
use tetdb_base::storage::SpillVecBuilder;

/// Corners of the faces S1 to S4.
const FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];

/// Sets and surfaces that name sets may have so many members for each element of the file, where a few are usual. Without a limit, sets
/// that name each other twice take all the disk.
const NAMED_MAX: usize = 64;

struct Deck<'a> {
    mesh: &'a mut RawMesh,
    nodes: NodeNumbers,
    elements: NodeNumbers,
    keyword: String,
    kind: String,
    /// Region of elements or of a set, or label of a surface.
    group: u32,
    is_range: bool,
    /// Positions of the tetrahedra of all sets of `*ELSET`, one set behind the other.
    members: SpillVecBuilder<u32>,
    /// Where the tetrahedra of a set are in `members`, by its name in capitals.
    sets: HashMap<String, Vec<Range<usize>>>,
    /// The set that is read, and whether it is a region.
    set: String,
    is_region: bool,
    /// Regions named by `*ELEMENT`, whose elements a set may take.
    of_elements: Vec<u32>,
    n_sets: u64,
    n_parts: u32,
    /// Members of sets and surfaces that are not taken.
    n_unknown: u64,
}

pub fn read<R: BufRead>(mut feed: Feed<R>, mesh: &mut RawMesh) -> Result<()> {
    let mut deck = Deck {
        members: mesh.space.builder(),
        mesh,
        nodes: NodeNumbers::of("node"),
        elements: NodeNumbers::of("element"),
        keyword: String::new(),
        kind: String::new(),
        group: 0,
        is_range: false,
        sets: HashMap::new(),
        set: String::new(),
        is_region: false,
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
            "*SURFACE" => deck.surface(&text, &place, &feed)?,
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
            "*ELEMENT" => {
                self.kind = value("TYPE").to_ascii_uppercase();
                self.group = self.mesh.regions.named(&value("ELSET"));
                self.of_elements.push(self.group);
            }
            "*ELSET" => {
                self.set = value("ELSET").to_ascii_uppercase();
                self.is_region = !options.contains_key("INTERNAL");
                if self.is_region {
                    self.group = self.mesh.regions.named(&value("ELSET"));
                }
                let n = self.members.len();
                self.sets.entry(self.set.clone()).or_default().push(n..n);
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
        self.elements.prepare(&self.mesh.space, feed)?;
        let words: Vec<&str> = text.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
        if self.is_range {
            let numbers = words.iter().map(|w| integer(w, place)).collect::<Result<Vec<i64>>>()?;
            let (first, last, step) = match numbers[..] {
                [first, last] if first <= last => (first, last, 1),
                [first, last, step] if step > 0 && first <= last => (first, last, step),
                _ => return Err(unexpected(place, "first, last and step of elements", text)),
            };
            let (numbers, n_others) = self.elements.among([first, last, step]);
            numbers.for_each(|number| self.put(number, feed));
            self.n_unknown = self.n_unknown.saturating_add(n_others);
            return Ok(());
        }
        for word in words {
            if let Ok(number) = word.parse() {
                self.put(number, feed);
                continue;
            }
            let Some(ranges) = self.ranges(word) else {
                self.n_unknown += 1;
                continue;
            };
            self.check_named(self.members.len(), &ranges, place)?;
            for i in ranges.into_iter().flatten() {
                let t = self.members.get(i);
                self.put_tet(t);
            }
        }
        Ok(())
    }

    /// Where the members of a set are that was read before.
    fn ranges(&self, name: &str) -> Option<Vec<Range<usize>>> {
        self.sets.get(&name.trim_matches('"').to_ascii_uppercase()).cloned()
    }

    /// Errors: so many members and these are more than a deck has.
    fn check_named(&self, n: usize, more: &[Range<usize>], place: &FilePlace) -> Result<()> {
        let n_all = more.iter().fold(n, |n, range| n + range.len());
        let limit = NAMED_MAX * self.mesh.tets.len() + (1 << 16);
        match n_all <= limit {
            true => Ok(()),
            false => Err(unsupported(place, format!("sets that name sets, of {n_all} elements"))),
        }
    }

    fn put<R: BufRead>(&mut self, number: i64, feed: &Feed<R>) {
        match self.elements.find(number, &self.mesh.space, feed) {
            Ok(t) => self.put_tet(t),
            Err(_) => self.n_unknown += 1,
        }
    }

    fn put_tet(&mut self, t: u32) {
        self.members.push(t);
        if let Some(range) = self.sets.get_mut(&self.set).and_then(|ranges| ranges.last_mut()) {
            range.end += 1;
        }
        if !self.is_region {
            return;
        }
        let mut tet = self.mesh.tets.get(t as usize);
        match self.of_elements.contains(&tet[4]) {
            true => tet[4] = self.group,
            false => self.n_unknown += 1,
        }
        self.mesh.tets.set(t as usize, tet);
    }

    /// Faces of an element as `12, S3`, or of all elements of a set as `NAME, S3`.
    fn surface<R: BufRead>(&mut self, text: &str, place: &FilePlace, feed: &Feed<R>) -> Result<()> {
        self.elements.prepare(&self.mesh.space, feed)?;
        let mut words = text.split(',').map(str::trim);
        let (number, face) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let face = face.to_ascii_uppercase().strip_prefix('S').and_then(|k| k.parse().ok());
        let Some(face) = face.filter(|k| (1..=4usize).contains(k)) else {
            self.n_unknown += 1;
            return Ok(());
        };
        let group = self.group;
        let add = |mesh: &mut RawMesh, t: u32| {
            let tet = mesh.tets.get(t as usize);
            mesh.triangle(FACES[face - 1].map(|k| tet[k]), group);
        };
        if let Ok(number) = number.parse() {
            match self.elements.find(number, &self.mesh.space, feed) {
                Ok(t) => add(self.mesh, t),
                Err(_) => self.n_unknown += 1,
            }
        } else if let Some(ranges) = self.ranges(number) {
            self.check_named(self.mesh.triangles.len(), &ranges, place)?;
            for i in ranges.into_iter().flatten() {
                add(self.mesh, self.members.get(i));
            }
        } else {
            self.n_unknown += 1;
        }
        Ok(())
    }
}
