//! Gmsh `.msh` of versions 1, 2, 4.0 and 4.1, text and binary: triangles and quadrilaterals, physical groups as labels.
//!
//! Sections this reader does not need are passed over. An element in several physical groups is given to the first, with a note;
//! version 2 repeats such elements, one behind the other. Curved faces are taken by their corners.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::io::BufRead;

use super::feed::{Feed, name};
use super::gmsh_numbers::{ElementType, GmshNumbers, NodeTags, Role, need_element_type};
use super::solids::Solids;
use super::{ReadFault, Result, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

/// State of a reader that all sections of a file share.
struct GmshReader<'a, 'b, R> {
    numbers: GmshNumbers<R>,
    version: Version,
    target: &'a mut SurfaceSink<'b>,
    nodes: NodeTags,
    /// Names of the surface groups.
    names: HashMap<i64, String>,
    /// Surface entity -> its first physical group (4.1).
    groups: HashMap<i64, i64>,
    /// Surface entities inside a volume, where two partitions meet (4.1).
    inside: HashSet<i64>,
    /// The label used last and the group it came from.
    last: Option<(i64, u32)>,
    /// Corners and group of the last element.
    last_element: Option<(ElementType, [i64; 8], i64)>,
    /// Surface groups with elements that another group has too.
    other_groups: BTreeSet<i64>,
    /// Numbers at nodes by their tags, where they are wanted.
    node_data: Option<HashMap<i64, f64>>,
    solids: Solids,
    n_curved: u64,
    /// Names and groups of volumes, as of surfaces.
    volume_names: HashMap<i64, String>,
    volume_groups: HashMap<i64, i64>,
}

/// A version of the format.
#[derive(Clone, Copy, PartialEq)]
enum Version {
    V1,
    V2,
    V40,
    V41,
}

impl<'a, 'b, R: BufRead> GmshReader<'a, 'b, R> {
    /// Reads the head of a file.
    fn open(mut feed: Feed<R>, target: &'a mut SurfaceSink<'b>) -> Result<Self> {
        feed.need_word("`$MeshFormat`")?;
        let (version, binary, big) = match feed.word() {
            b"$NOD" | b"$ELM" => (Version::V1, false, false),
            b"$MeshFormat" => read_format(&mut feed)?,
            word => return Err(feed.unexpected("`$MeshFormat`, or `$NOD` of version 1", word)),
        };
        Ok(GmshReader {
            numbers: GmshNumbers { feed, binary, big },
            version,
            target,
            nodes: NodeTags::default(),
            names: HashMap::new(),
            groups: HashMap::new(),
            inside: HashSet::new(),
            last: None,
            last_element: None,
            other_groups: BTreeSet::new(),
            node_data: None,
            solids: Solids::default(),
            n_curved: 0,
            volume_names: HashMap::new(),
            volume_groups: HashMap::new(),
        })
    }
}

pub(super) fn read<R: BufRead>(feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut mesh = GmshReader::open(feed, target)?;
    mesh.read_sections()?;
    if mesh.n_curved > 0 {
        mesh.target.builder.note(NoteKind::CurvedFaces { n: mesh.n_curved });
    }
    if !mesh.other_groups.is_empty() {
        let names: Vec<String> = mesh.other_groups.iter().map(|&g| mesh.group_name(g)).collect();
        mesh.target.builder.note(NoteKind::OtherGroups { names: names.join(", ") });
    }
    std::mem::take(&mut mesh.solids).finish("solid elements", mesh.target);
    mesh.numbers.feed.finish(mesh.target.builder)
}

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

/// The section `$MeshFormat`: the version, whether numbers are binary, and whether their high bytes come first.
fn read_format<R: BufRead>(feed: &mut Feed<R>) -> Result<(Version, bool, bool)> {
    feed.need_word("the format's version")?;
    let version = match feed.word() {
        b"2" | b"2.0" | b"2.1" | b"2.2" => Version::V2,
        b"4" | b"4.0" => Version::V40,
        b"4.1" => Version::V41,
        other => {
            let found = super::feed::quote(other);
            return Err(
                feed.unsupported(format!("version {found} of .msh (1, 2, 4.0 and 4.1 can)"))
            );
        }
    };
    let binary = match feed.integer("0 for text or 1 for binary")? {
        0 => false,
        1 => true,
        _ => return Err(feed.unexpected("0 for text or 1 for binary", feed.word())),
    };
    if feed.integer("the size of numbers")? != 8 {
        return Err(feed.unsupported("a .msh file with other than 8-byte numbers"));
    }
    feed.skip_line()?;
    let mut big = false;
    if binary {
        feed.at.is_binary = true;
        big = match i32::from_le_bytes(feed.bytes::<4>()?) {
            1 => false,
            0x0100_0000 => true,
            _ => return Err(feed.unexpected("the number 1 in either byte order", b"another")),
        };
    }
    feed.need_keyword("$EndMeshFormat")?;
    feed.skip_line()?;
    Ok((version, binary, big))
}

impl<R: BufRead> GmshReader<'_, '_, R> {
    fn read_sections(&mut self) -> Result<()> {
        use Version::{V1, V2, V40, V41};
        // The first section of version 1 has no head before it.
        let mut is_taken = self.version == V1;
        while is_taken || self.numbers.feed.next_word()? {
            is_taken = false;
            let section = self.numbers.feed.word().to_vec();
            if section.first() != Some(&b'$') {
                return Err(self.numbers.feed.unexpected("a section beginning with `$`", &section));
            }
            self.numbers.feed.skip_line()?;
            match (section.as_slice(), self.version) {
                (b"$PhysicalNames", _) => self.read_names()?,
                (b"$Entities", V40 | V41) => self.read_entities(false)?,
                (b"$PartitionedEntities", V40 | V41) => {
                    self.numbers.size()?;
                    let n_ghosts = self.numbers.size()?;
                    for _ in 0..self.numbers.check_count("ghosts", n_ghosts, 2, 4)? {
                        self.numbers.int()?;
                        self.numbers.int()?;
                    }
                    self.read_entities(true)?;
                }
                (b"$NodeData", _) if self.node_data.as_ref().is_some_and(HashMap::is_empty) => {
                    self.read_node_data()?;
                }
                (b"$NOD", V1) => self.read_nodes_2(false, "$ENDNOD")?,
                (b"$ELM", V1) => self.read_elements_2_text("$ENDELM")?,
                (b"$Nodes", V2) => self.read_nodes_2(false, "$EndNodes")?,
                (b"$ParametricNodes", V2) => self.read_nodes_2(true, "$EndParametricNodes")?,
                (b"$Nodes", _) => self.read_nodes_4()?,
                (b"$Elements", V2) if self.numbers.binary => self.read_elements_2_binary()?,
                (b"$Elements", V2) => self.read_elements_2_text("$EndElements")?,
                (b"$Elements", _) => self.read_elements_4()?,
                _ => {
                    let end: &[u8] = if self.version == V1 { b"$END" } else { b"$End" };
                    self.numbers.feed.skip_past(&[end, &section[1..]].concat())?;
                }
            }
        }
        Ok(())
    }

    /// `dimension tag "name"`, always text.
    fn read_names(&mut self) -> Result<()> {
        let feed = &mut self.numbers.feed;
        let n = feed.count("physical names", 6)?;
        let mut line = Vec::new();
        for _ in 0..n {
            let dimension = feed.integer("a dimension")?;
            let tag = feed.integer("a physical tag")?;
            line.clear();
            feed.read_line(&mut line)?;
            let text = name(&line);
            if dimension == 3 {
                let name = text.trim_matches('"').to_owned();
                self.volume_names.insert(tag, name);
            }
            if dimension == 2 {
                self.names.insert(tag, text.trim_matches('"').to_owned());
            }
        }
        self.numbers.end("$EndPhysicalNames")
    }

    /// Text in quotes, numbers and whole numbers, each with their count, then tags with numbers.
    fn read_node_data(&mut self) -> Result<()> {
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

    fn group_name(&self, group: i64) -> String {
        self.names.get(&group).cloned().unwrap_or_else(|| group.to_string())
    }

    /// The label of a physical group; 0 is none.
    fn label(&mut self, group: i64) -> u32 {
        if let Some((known, label)) = self.last
            && known == group
        {
            return label;
        }
        let label = match group {
            0 => self.target.label(""),
            _ => self.target.label(&self.group_name(group)),
        };
        self.last = Some((group, label));
        label
    }

    fn node(&mut self, tag: i64, p: Point) -> Result<()> {
        if !self.nodes.push(tag) {
            let found = format!("node {tag} a second time");
            let expected = "nodes of different tags".to_owned();
            return Err(self.numbers.feed.refuse(ReadFault::Unexpected { expected, found }));
        }
        self.numbers.feed.placed(self.target.builder.vertex(p))
    }

    fn point(&mut self) -> Result<Point> {
        Ok(Point::new(self.numbers.double()?, self.numbers.double()?, self.numbers.double()?))
    }

    /// Takes the nodes of an element as a face or a solid; the first ones are its corners.
    fn element(&mut self, kind: ElementType, tags: &[i64; 8], group: i64) -> Result<()> {
        let ElementType { n_nodes, n_corners, role } = kind;
        if role == Role::Thin {
            return Ok(());
        }
        if let Some((last, of_last, known)) = &self.last_element
            && (last.n_nodes, last.role, of_last) == (n_nodes, role, tags)
            && *known != group
        {
            self.other_groups.insert(group);
            return Ok(());
        }
        self.last_element = Some((kind, *tags, group));
        let mut corners = [0; 8];
        for (corner, tag) in corners.iter_mut().zip(&tags[..n_corners]) {
            *corner = self.nodes.find(*tag, &self.numbers.feed)?;
        }
        let corners = &corners[..n_corners];
        if role == Role::Face {
            self.n_curved += u64::from(n_nodes > n_corners);
            let label = self.label(group);
            return self.numbers.feed.placed(self.target.builder.polygon(corners, label));
        }
        let name = match (group, self.volume_names.get(&group)) {
            (0, _) => String::new(),
            (_, Some(name)) => name.clone(),
            _ => format!("volume_{group}"),
        };
        self.numbers.feed.placed(self.solids.add(corners, &name, self.target))
    }

    // --- 2.2 ----------------------------------------------------------------------------------

    /// The count of a section of 2.2, which is text in binary files too.
    fn text_count(&mut self, what: &'static str, words: u64, bytes: u64) -> Result<u64> {
        let declared = self.numbers.feed.integer(what)?;
        if self.numbers.binary {
            self.numbers.feed.skip_line()?;
        }
        self.numbers.check_count(what, declared, words, bytes)
    }

    fn read_nodes_2(&mut self, is_parametric: bool, end: &'static str) -> Result<()> {
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

    fn read_elements_2_text(&mut self, end: &'static str) -> Result<()> {
        let n = self.text_count("elements", 4, 2)?;
        for i in 0..n {
            self.numbers.need_record("elements", n, i)?;
            self.numbers.int()?;
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

    fn read_elements_2_binary(&mut self) -> Result<()> {
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
                self.numbers.int()?;
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
        for i in 0..n_tags {
            let tag = self.numbers.int()?;
            if i == 0 {
                group = tag;
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
        self.element(kind, &tags, group)
    }

    // --- 4.0 and 4.1 ----------------------------------------------------------------------------------

    fn read_entities(&mut self, partitioned: bool) -> Result<()> {
        let mut counts = [0; 4];
        for count in &mut counts {
            let declared = self.numbers.size()?;
            *count = self.numbers.check_count("entities", declared, 5, 4)?;
        }
        for (dimension, &n) in counts.iter().enumerate() {
            for i in 0..n {
                self.numbers.need_record("entities", n, i)?;
                let entity = self.numbers.int()?;
                if partitioned {
                    // Dimension and number of its parent, and the partitions.
                    let whole = self.numbers.int()?;
                    if (dimension, whole) == (2, 3) {
                        self.inside.insert(entity);
                    }
                    self.numbers.int()?;
                    self.int_list()?;
                }
                let is_point = dimension == 0 && self.version == Version::V41;
                for _ in 0..if is_point { 3 } else { 6 } {
                    self.numbers.double()?;
                }
                let groups = self.int_list()?;
                let known = match dimension {
                    2 => &mut self.groups,
                    _ => &mut self.volume_groups,
                };
                if let (2.., Some(&group)) = (dimension, groups.first()) {
                    known.insert(entity, group.saturating_abs());
                }
                if dimension == 2 {
                    self.other_groups.extend(groups.iter().skip(1).map(|g| g.saturating_abs()));
                }
                if dimension > 0 {
                    self.int_list()?;
                }
            }
        }
        self.numbers.end(match partitioned {
            true => "$EndPartitionedEntities",
            false => "$EndEntities",
        })
    }

    fn int_list(&mut self) -> Result<Vec<i64>> {
        let n = self.numbers.size()?;
        let n = self.numbers.check_count("tags", n, 1, 4)?;
        (0..n).map(|_| self.numbers.int()).collect()
    }

    /// The tag of a node or an element.
    fn tag(&mut self) -> Result<i64> {
        match self.version {
            Version::V40 => self.numbers.int(),
            _ => self.numbers.size(),
        }
    }

    /// The numbers before the blocks of a section: blocks, entries, and since 4.1 lowest and highest tag.
    fn block_header(&mut self, what: &'static str, words: u64) -> Result<(u64, u64)> {
        let (n_blocks, n) = (self.numbers.size()?, self.numbers.size()?);
        let n_blocks = self.numbers.check_count("blocks", n_blocks, 4, 5)?;
        let n = self.numbers.check_count(what, n, words, 8)?;
        if self.version == Version::V41 {
            self.numbers.size()?;
            self.numbers.size()?;
        }
        Ok((n_blocks, n))
    }

    /// The numbers before one block: entity dimension, entity, a third and the number of entries.
    fn block(&mut self, what: &'static str, words: u64) -> Result<(i64, i64, i64, u64)> {
        let (mut dimension, mut entity, third) =
            (self.numbers.int()?, self.numbers.int()?, self.numbers.int()?);
        if self.version == Version::V40 {
            (dimension, entity) = (entity, dimension);
        }
        let n = self.numbers.size()?;
        let n = self.numbers.check_count(what, n, words, 8)?;
        Ok((dimension, entity, third, n))
    }

    fn check_total(&self, what: &'static str, declared: u64, found: u64) -> Result<()> {
        if declared == found {
            return Ok(());
        }
        let found = format!("{found} found in the blocks");
        Err(self.numbers.feed.miscounted(what, declared, found))
    }

    fn read_nodes_4(&mut self) -> Result<()> {
        let (n_blocks, n_total) = self.block_header("nodes", 4)?;
        let mut found = 0;
        let mut tags = Vec::new();
        for i in 0..n_blocks {
            self.numbers.need_record("blocks", n_blocks, i)?;
            let (dimension, _, parametric, n) = self.block("nodes", 4)?;
            let n_parameters = if parametric != 0 { dimension.clamp(0, 3) } else { 0 };
            tags.clear();
            // In 4.0 each tag stands before its coordinates.
            for k in 0..if self.version == Version::V41 { n } else { 0 } {
                self.numbers.need_record("nodes", n, k)?;
                tags.push(self.numbers.size()?);
            }
            for k in 0..n {
                self.numbers.need_record("nodes", n, k)?;
                let tag = match tags.get(k as usize) {
                    Some(&tag) => tag,
                    None => self.tag()?,
                };
                let p = self.point()?;
                for _ in 0..n_parameters {
                    self.numbers.double()?;
                }
                self.node(tag, p)?;
            }
            found += n;
        }
        self.check_total("nodes", n_total, found)?;
        self.numbers.end("$EndNodes")
    }

    fn read_elements_4(&mut self) -> Result<()> {
        let (n_blocks, n_total) = self.block_header("elements", 2)?;
        let mut found = 0;
        for i in 0..n_blocks {
            self.numbers.need_record("blocks", n_blocks, i)?;
            let (dimension, entity, kind, n) = self.block("elements", 2)?;
            let kind = need_element_type(kind, &self.numbers.feed)?;
            let groups = match dimension {
                2 => Some(&self.groups),
                3 => Some(&self.volume_groups),
                _ => None,
            };
            let group = groups.and_then(|g| g.get(&entity)).copied().unwrap_or(0);
            let is_inside = dimension == 2 && self.inside.contains(&entity);
            for k in 0..n {
                self.numbers.need_record("elements", n, k)?;
                self.tag()?;
                let mut tags = [0; 8];
                for j in 0..kind.n_nodes {
                    let tag = self.tag()?;
                    if let Some(slot) = tags.get_mut(j) {
                        *slot = tag;
                    }
                }
                if !(is_inside && kind.role == Role::Face) {
                    self.element(kind, &tags, group)?;
                }
            }
            found += n;
        }
        self.check_total("elements", n_total, found)?;
        self.numbers.end("$EndElements")
    }
}
