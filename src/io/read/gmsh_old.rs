//! Sections of Gmsh files of versions 1 and 2, and the numbers at nodes of all versions.

use std::collections::HashMap;
use std::io::BufRead;

use super::feed::Feed;
use super::gmsh::{GmshReader, Version};
use super::gmsh_numbers::{ElementType, need_element_type};
use super::{Result, SurfaceSink};
use tetdb_base::geom::Point;

/// Points, tetrahedra between them, and a number at each point.
pub(super) type NodeData = (Vec<Point>, Vec<[u32; 4]>, Vec<f64>);

/// Reads the tetrahedra of a file and the numbers of its first `$NodeData` at the nodes that have one.
pub(super) fn read_node_data<R: BufRead>(
    feed: Feed<R>,
    target: &mut SurfaceSink,
) -> Result<NodeData> {
    let mut mesh = GmshReader::open(feed, target)?;
    mesh.node_data = Some(HashMap::new());
    mesh.read_sections()?;
    let data = mesh.node_data.take().unwrap_or_default();
    let feed = &mesh.numbers.feed;
    let mut at = HashMap::new();
    for (&tag, &h) in &data {
        at.insert(mesh.nodes.find(tag, feed)?, h);
    }
    let tets = mesh.solids.tets();
    let (mut points, mut numbers, mut position) = (Vec::new(), Vec::new(), HashMap::new());
    for v in 0..mesh.target.builder.n_file_vertices() as u32 {
        if let (Some(&h), Some(p)) = (at.get(&v), mesh.target.builder.position(v)) {
            position.insert(v, points.len() as u32);
            points.push(p);
            numbers.push(h);
        }
    }
    let place = |t: [u32; 4]| {
        let corners = t.map(|v| position.get(&v).copied());
        match corners {
            [Some(a), Some(b), Some(c), Some(d)] => Ok([a, b, c, d]),
            _ => Err(feed.unexpected("a number at every node of the tetrahedra", b"fewer")),
        }
    };
    let tets = tets.map(place).collect::<Result<Vec<_>>>()?;
    match data.is_empty() {
        true => Err(feed.unexpected("a section `$NodeData`", b"none")),
        false => Ok((points, tets, numbers)),
    }
}

impl<R: BufRead> GmshReader<'_, '_, R> {
    /// The count of a section of 2.2, which is text in binary files too.
    fn text_count(&mut self, what: &'static str, words: u64, bytes: u64) -> Result<u64> {
        let declared = self.numbers.feed.integer(what)?;
        if self.numbers.binary {
            self.numbers.feed.skip_line()?;
        }
        self.numbers.check_count(what, declared, words, bytes)
    }

    pub(super) fn read_nodes_2(&mut self, is_parametric: bool, end: &'static str) -> Result<()> {
        let n = self.text_count("nodes", 4, 7)?;
        for i in 0..n {
            self.numbers.need_record("nodes", n, i)?;
            let tag = self.numbers.int()?;
            let p = self.point()?;
            if is_parametric {
                // Dimension and number of the entity, and a parameter or two.
                let dimension = self.numbers.int()?;
                self.numbers.int()?;
                for _ in 0..if dimension < 3 { dimension } else { 0 } {
                    self.numbers.double()?;
                }
            }
            self.node(tag, p)?;
        }
        self.numbers.end(end)
    }

    pub(super) fn read_elements_2_text(&mut self, end: &'static str) -> Result<()> {
        let n = self.text_count("elements", 4, 2)?;
        for i in 0..n {
            self.numbers.need_record("elements", n, i)?;
            self.element = self.numbers.int()?;
            let kind = self.numbers.int()?;
            match self.version {
                Version::V1 => {
                    let group = self.numbers.int()?;
                    self.numbers.int()?;
                    let n_nodes = self.numbers.int()?;
                    let known = need_element_type(kind, &self.numbers.feed)?;
                    if usize::try_from(n_nodes) != Ok(known.n_nodes) {
                        let found = n_nodes.to_string();
                        let expected = format!("{} nodes", known.n_nodes);
                        return Err(self.numbers.feed.unexpected(expected, found.as_bytes()));
                    }
                    self.read_corners(known, group)?;
                }
                _ => {
                    let n_tags = self.numbers.int()?;
                    self.read_element_2(kind, n_tags)?;
                }
            }
        }
        self.numbers.end(end)
    }

    pub(super) fn read_elements_2_binary(&mut self) -> Result<()> {
        let n = self.text_count("elements", 1, 4)?;
        let mut done = 0;
        while done < n {
            let kind = self.numbers.int()?;
            let in_block = self.numbers.int()?;
            let in_block = self.numbers.check_count("elements", in_block, 1, 4)?;
            let n_tags = self.numbers.int()?;
            if in_block == 0 || in_block > n - done {
                let feed = &self.numbers.feed;
                return Err(feed.unexpected(
                    format!("a block of 1 to {} elements", n - done),
                    in_block.to_string().as_bytes(),
                ));
            }
            for _ in 0..in_block {
                self.element = self.numbers.int()?;
                self.read_element_2(kind, n_tags)?;
            }
            done += in_block;
        }
        self.numbers.end("$EndElements")
    }

    /// The tags and nodes of one element.
    fn read_element_2(&mut self, kind: i64, n_tags: i64) -> Result<()> {
        let n_tags = self.numbers.check_count("element tags", n_tags, 1, 4)?;
        let mut group = 0;
        self.partition = 0;
        for i in 0..n_tags {
            let tag = self.numbers.int()?;
            match i {
                0 => group = tag,
                3 => self.partition = tag,
                _ => {}
            }
        }
        let kind = need_element_type(kind, &self.numbers.feed)?;
        self.read_corners(kind, group)
    }

    /// The nodes of an element of versions 1 and 2.
    fn read_corners(&mut self, kind: ElementType, group: i64) -> Result<()> {
        let mut tags = [0; 8];
        for i in 0..kind.n_nodes {
            let tag = self.numbers.int()?;
            if let Some(slot) = tags.get_mut(i) {
                *slot = tag;
            }
        }
        self.element(kind, &tags, &[group])
    }

    /// Text in quotes, numbers and whole numbers, each with their count, then tags with numbers.
    pub(super) fn read_node_data(&mut self) -> Result<()> {
        let n_texts = self.numbers.feed.count("texts", 1)?;
        // A line for each, behind that of their number.
        for _ in 0..=n_texts {
            self.numbers.feed.skip_line()?;
        }
        for _ in 0..self.numbers.feed.count("numbers", 2)? {
            self.numbers.feed.need_word("a number")?;
        }
        let mut counts = [0, 1, 0];
        let n_counts = self.numbers.feed.count("whole numbers", 2)?;
        for k in 0..n_counts {
            let n = self.numbers.feed.integer("a whole number")?;
            if let Some(count) = counts.get_mut(k as usize) {
                *count = n;
            }
        }
        if counts[1] != 1 {
            return Err(self.numbers.feed.unsupported("node data that is not one number a node"));
        }
        if self.numbers.binary {
            self.numbers.feed.skip_line()?;
        }
        let n = self.numbers.check_count("numbers at nodes", counts[2], 2, 6)?;
        let mut data = HashMap::new();
        for i in 0..n {
            self.numbers.need_record("numbers at nodes", n, i)?;
            let tag = self.numbers.int()?;
            data.insert(tag, self.numbers.double()?);
        }
        self.node_data = Some(data);
        self.numbers.end("$EndNodeData")
    }
}
