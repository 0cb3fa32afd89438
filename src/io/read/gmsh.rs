//! Gmsh `.msh` of versions 1, 2, 4.0 and 4.1, text and binary: triangles and quadrilaterals, physical groups as labels.
//!
//! Sections this reader does not need are passed over. A face in several physical groups has the labels of all, a volume the name of the
//! first, with a note; versions 1 and 2 repeat such elements. Curved faces are taken by their corners.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::io::BufRead;

use super::feed::{Feed, name};
use super::gmsh_numbers::{ElementType, GmshNumbers, NodeTags, Role, need_element_type};
use super::solids::Solids;
use super::tets::TetSink;
use super::{ReadFault, Result, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::NoteKind;
use tetdb_schema::field::FieldPlace;

/// State of a reader that all sections of a file share.
pub(super) struct GmshReader<'a, 'b, R> {
    pub(super) numbers: GmshNumbers<R>,
    pub(super) version: Version,
    pub(super) target: &'a mut SurfaceSink<'b>,
    pub(super) nodes: NodeTags,
    /// Names of the surface groups.
    pub(super) names: HashMap<i64, String>,
    /// Surface entity -> its physical groups (4).
    pub(super) groups: HashMap<i64, Vec<i64>>,
    /// Surface entities inside a volume, where two partitions meet (4.1).
    pub(super) inside: HashSet<i64>,
    /// The label used last and the groups it came from.
    pub(super) last: Option<(Vec<i64>, u32)>,
    /// Corners and group of the last solid element.
    pub(super) last_solid: Option<(ElementType, [i64; 8], i64)>,
    /// Volume groups with elements that another group has too.
    pub(super) other_groups: BTreeSet<i64>,
    /// Numbers at nodes by their tags, where they are wanted.
    pub(super) node_data: Option<HashMap<i64, f64>>,
    pub(super) solids: Solids,
    pub(super) n_curved: u64,
    pub(super) n_thin: u64,
    /// Names and groups of volumes, as of surfaces.
    pub(super) volume_names: HashMap<i64, String>,
    pub(super) volume_groups: HashMap<i64, Vec<i64>>,
    /// Where a mesh of tetrahedra is read, not a surface.
    pub(super) tets: Option<TetSink<'a>>,
    /// Partition of each volume entity (4), and that of the current element; 0 for none.
    pub(super) partitions: HashMap<i64, i64>,
    pub(super) partition: i64,
    /// Number of the current element.
    pub(super) element: i64,
}

/// A version of the format.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Version {
    V1,
    V2,
    V40,
    V41,
}

impl<'a, 'b, R: BufRead> GmshReader<'a, 'b, R> {
    /// Reads the head of a file.
    pub(super) fn open(mut feed: Feed<R>, target: &'a mut SurfaceSink<'b>) -> Result<Self> {
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
            last_solid: None,
            other_groups: BTreeSet::new(),
            node_data: None,
            solids: Solids::default(),
            n_curved: 0,
            n_thin: 0,
            volume_names: HashMap::new(),
            volume_groups: HashMap::new(),
            tets: None,
            partitions: HashMap::new(),
            partition: 0,
            element: 0,
        })
    }
}

pub(super) fn read<R: BufRead>(feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut mesh = GmshReader::open(feed, target)?;
    if matches!(mesh.version, Version::V1 | Version::V2) {
        mesh.target.builder.join_groups_at_end();
    }
    mesh.read_sections()?;
    if mesh.n_curved > 0 {
        mesh.target.builder.note(NoteKind::CurvedFaces { n: mesh.n_curved });
    }
    if !mesh.other_groups.is_empty() {
        let names: Vec<String> = mesh.other_groups.iter().map(|&g| mesh.volume_name(g)).collect();
        mesh.target.builder.note(NoteKind::OtherGroups { names: names.join(", ") });
    }
    mesh.target.leave_out_cells(mesh.solids.len());
    std::mem::take(&mut mesh.solids).finish("solid elements", mesh.target);
    if mesh.n_thin > 0 {
        let what = "lines and points";
        mesh.target.builder.note(NoteKind::SkippedElements { what, n: mesh.n_thin });
    }
    mesh.target.end_cells(&mesh.numbers.feed)?;
    mesh.numbers.feed.finish(mesh.target.builder)
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
    pub(super) fn read_sections(&mut self) -> Result<()> {
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
                (b"$NodeData", V2 | V40 | V41) if self.tets.is_some() => {
                    self.read_values(FieldPlace::Vertices, "$EndNodeData")?;
                }
                (b"$ElementData", V2 | V40 | V41) if self.tets.is_some() => {
                    self.read_values(FieldPlace::Tets, "$EndElementData")?;
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
                    if let Some(tets) = &mut self.tets {
                        tets.skip(&section);
                    }
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

    /// The name of a physical group of volumes; 0 is none.
    fn volume_name(&self, group: i64) -> String {
        match (group, self.volume_names.get(&group)) {
            (0, _) => String::new(),
            (_, Some(name)) => name.clone(),
            _ => format!("volume_{group}"),
        }
    }

    /// The label of faces in these physical groups; 0 is none.
    fn label(&mut self, groups: &[i64]) -> u32 {
        if let Some((known, label)) = &self.last
            && known == groups
        {
            return *label;
        }
        let name = |group: &i64| match (group, self.names.get(group)) {
            (0, _) => String::new(),
            (_, Some(name)) => name.clone(),
            _ => group.to_string(),
        };
        let names: Vec<String> = groups.iter().map(name).collect();
        let label = self.target.label_of_all(&names);
        self.last = Some((groups.to_vec(), label));
        label
    }

    pub(super) fn node(&mut self, tag: i64, p: Point) -> Result<()> {
        if let Some(tets) = &mut self.tets {
            tets.node(tag, p);
            return Ok(());
        }
        if !self.nodes.push(tag) {
            let found = format!("node {tag} a second time");
            let expected = "nodes of different tags".to_owned();
            return Err(self.numbers.feed.refuse(ReadFault::Unexpected { expected, found }));
        }
        self.numbers.feed.placed(self.target.builder.vertex(p))
    }

    pub(super) fn point(&mut self) -> Result<Point> {
        Ok(Point::new(self.numbers.double()?, self.numbers.double()?, self.numbers.double()?))
    }

    /// Takes the nodes of an element as a face or a solid; the first ones are its corners.
    pub(super) fn element(
        &mut self,
        kind: ElementType,
        tags: &[i64; 8],
        groups: &[i64],
    ) -> Result<()> {
        if let Some(sink) = &mut self.tets {
            let names = [&self.names, &self.volume_names];
            let numbers = [self.element, self.partition];
            return sink.element(kind, tags, (groups, names), numbers, &self.numbers.feed);
        }
        let ElementType { n_nodes, n_corners, role } = kind;
        self.n_thin += u64::from(role == Role::Thin);
        if role == Role::Thin || role == Role::Face && self.target.leaves_out_face() {
            return Ok(());
        }
        let mut corners = [0; 8];
        for (corner, tag) in corners.iter_mut().zip(&tags[..n_corners]) {
            *corner = self.nodes.find(*tag, &self.numbers.feed)?;
        }
        let corners = &corners[..n_corners];
        if role == Role::Face {
            self.n_curved += u64::from(n_nodes > n_corners);
            let label = self.label(groups);
            return self.numbers.feed.placed(self.target.builder.polygon(corners, label));
        }
        let group = groups.first().copied().unwrap_or(0);
        if let Some((last, of_last, known)) = &self.last_solid
            && (last.n_nodes, of_last) == (n_nodes, tags)
            && *known != group
        {
            self.other_groups.insert(group);
            return Ok(());
        }
        self.last_solid = Some((kind, *tags, group));
        let name = self.volume_name(group);
        if self.target.cells.are_wanted() {
            return self.target.cell(&self.numbers.feed, (corners, n_nodes), &name);
        }
        self.numbers.feed.placed(self.solids.add(corners, &name, self.target))
    }

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
                    let parts = self.int_list()?;
                    if dimension == 3 {
                        self.partitions.insert(entity, parts.first().copied().unwrap_or(0));
                    }
                }
                let is_point = dimension == 0 && self.version == Version::V41;
                for _ in 0..if is_point { 3 } else { 6 } {
                    self.numbers.double()?;
                }
                let groups = self.int_list()?.into_iter().map(i64::saturating_abs).collect();
                match dimension {
                    2 => drop(self.groups.insert(entity, groups)),
                    3 => {
                        self.other_groups.extend(groups.iter().skip(1));
                        self.volume_groups.insert(entity, groups);
                    }
                    _ => {}
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
        // A block may have all nodes of the file.
        let space = match &self.tets {
            Some(sink) => sink.mesh.space.clone(),
            None => ScratchSpace::boundless(),
        };
        for i in 0..n_blocks {
            self.numbers.need_record("blocks", n_blocks, i)?;
            let (dimension, _, parametric, n) = self.block("nodes", 4)?;
            let n_parameters = if parametric != 0 { dimension.clamp(0, 3) } else { 0 };
            let mut tags = space.builder();
            // In 4.0 each tag stands before its coordinates.
            for k in 0..if self.version == Version::V41 { n } else { 0 } {
                self.numbers.need_record("nodes", n, k)?;
                tags.push(self.numbers.size()?);
            }
            for k in 0..n {
                self.numbers.need_record("nodes", n, k)?;
                let tag = match (k as usize) < tags.len() {
                    true => tags.get(k as usize),
                    false => self.tag()?,
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
            let groups = groups.and_then(|g| g.get(&entity)).cloned().unwrap_or_default();
            self.partition = match dimension {
                3 => self.partitions.get(&entity).copied().unwrap_or(0),
                _ => 0,
            };
            let is_inside = dimension == 2 && self.inside.contains(&entity);
            for k in 0..n {
                self.numbers.need_record("elements", n, k)?;
                self.element = self.tag()?;
                let mut tags = [0; 8];
                for j in 0..kind.n_nodes {
                    let tag = self.tag()?;
                    if let Some(slot) = tags.get_mut(j) {
                        *slot = tag;
                    }
                }
                if !(is_inside && kind.role == Role::Face) {
                    self.element(kind, &tags, &groups)?;
                }
            }
            found += n;
        }
        self.check_total("elements", n_total, found)?;
        self.numbers.end("$EndElements")
    }
}
