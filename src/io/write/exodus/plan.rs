//! The variables of a file: their names, dimensions and places, and the content of those that are known before the mesh is read.

use std::collections::{BTreeMap, BTreeSet};

use crate::write::error::Result;
use crate::write::merged::Merged;
use crate::write::midpoints::Midpoints;
use crate::write::names::set_names;
use crate::write::netcdf::{NetcdfFile, NetcdfType, NetcdfValue};
use tetdb_schema::field::FieldRow;

/// Version of the programming interface whose files these are: the first ones with names of any length.
const VERSION: f32 = 8.03;
/// Length of names that every reader takes.
const NAME_BYTES: usize = 32;
/// Length of lines of information, with a zero behind.
const LINE_BYTES: usize = 81;

/// The file's variables, by their numbers.
pub(super) struct Plan {
    pub file: NetcdfFile,
    /// The bytes of variables that are known at once.
    pub fixed: Vec<(usize, Vec<u8>)>,
    pub coordinates: [usize; 3],
    pub node_map: usize,
    pub element_map: usize,
    pub node_values: Vec<usize>,
    /// By region.
    pub blocks: BTreeMap<u32, Block>,
    /// Elements and sides of each group.
    pub sets: BTreeMap<u32, [usize; 2]>,
    pub n_sides: u64,
    shared: BTreeMap<&'static str, usize>,
}

/// An element block.
pub(super) struct Block {
    /// Elements before it and in it.
    pub first: u64,
    pub n: u64,
    /// The place of its share of the element map: behind those of all variables.
    pub map: usize,
    pub nodes: usize,
    pub values: Vec<usize>,
}

impl Plan {
    /// Lays out the variables. Errors: damage.
    pub fn new(
        mesh: &mut Merged,
        midpoints: Option<&Midpoints>,
        [at_vertices, at_tets]: &[Vec<FieldRow>; 2],
    ) -> Result<Self> {
        let regions = mesh.region_counts()?;
        let names = regions.keys().map(|&region| (region, mesh.region_name(region)));
        let block_names: Vec<String> = set_names(&names.collect()).into_values().collect();
        let groups = mesh.groups();
        let group_names: Vec<String> = set_names(&groups).into_values().collect();
        let node_names = variable_names(at_vertices, &[]);
        let element_names = variable_names(at_tets, &["subdomain", "quality"]);
        let all = [&block_names, &group_names, &node_names, &element_names];
        let longest = all.into_iter().flatten().map(String::len).fold(NAME_BYTES, usize::max);
        let origin = mesh.origin()?;
        let mut plan = Self::begin(&origin, longest);

        let n_nodes = mesh.n_vertices() + midpoints.map_or(0, Midpoints::n);
        let [nodes, elements] =
            [plan.shared("num_nodes", n_nodes), plan.shared("num_elem", mesh.n_tets())];
        plan.texts("coor_names", "num_dim", longest + 1, &["x", "y", "z"].map(str::to_owned));
        plan.coordinates = ["coordx", "coordy", "coordz"].map(|name| plan.doubles(name, &[nodes]));
        plan.node_map = plan.ints("node_num_map", &[nodes]);
        plan.element_map = plan.ints("elem_num_map", &[elements]);
        plan.entities("eb", "num_el_blk", regions.keys().copied(), &block_names, longest);
        let ids = groups.keys().map(|group| group + 1);
        plan.entities("ss", "num_side_sets", ids, &group_names, longest);
        plan.texts("name_nod_var", "num_nod_var", longest + 1, &node_names);
        plan.texts("name_elem_var", "num_elem_var", longest + 1, &element_names);
        let step = plan.shared("time_step", 0);
        let table = [("num_el_blk", regions.len()), ("num_elem_var", element_names.len())];
        let table = table.map(|(name, n)| plan.shared(name, n as u64));
        let table = plan.ints("elem_var_tab", &table);
        plan.fix_ints(table, vec![1; regions.len() * element_names.len()]);
        let time = plan.doubles("time_whole", &[step]);
        plan.fixed.push((time, vec![0; 8]));

        for i in 1..=node_names.len() {
            let values = plan.doubles(&format!("vals_nod_var{i}"), &[step, nodes]);
            plan.node_values.push(values);
        }
        plan.add_blocks(&regions, if midpoints.is_some() { 10 } else { 4 }, element_names.len());
        for (i, group) in (1..).zip(groups.keys()) {
            let has_group = |label: &u32| mesh.label_members(*label).contains(group);
            let labels = mesh.faces().labels.iter().filter(|(label, _)| has_group(label));
            let n: u64 = labels.map(|(_, n)| n).sum();
            plan.n_sides += n;
            let n = plan.file.dimension(format!("num_side_ss{i}"), n);
            let both = ["elem_ss", "side_ss"].map(|name| plan.ints(&format!("{name}{i}"), &[n]));
            plan.sets.insert(*group, both);
        }
        let first_map = plan.file.n_variables();
        for (i, block) in plan.blocks.values_mut().enumerate() {
            block.map = first_map + i;
        }
        Ok(plan)
    }

    /// The file's attributes and lines of information.
    fn begin(origin: &[String], longest_name: usize) -> Self {
        let mut file = NetcdfFile::default();
        file.attributes = vec![
            ("api_version", NetcdfValue::Float(VERSION)),
            ("version", NetcdfValue::Float(VERSION)),
            ("floating_point_word_size", NetcdfValue::Int(8)),
            ("file_size", NetcdfValue::Int(1)),
            ("maximum_name_length", NetcdfValue::Int(longest_name as i32)),
            ("int64_status", NetcdfValue::Int(0)),
            ("title", NetcdfValue::Text(origin[..2].join(", "))),
        ];
        let mut plan = Self {
            file,
            fixed: Vec::new(),
            coordinates: [0; 3],
            node_map: 0,
            element_map: 0,
            node_values: Vec::new(),
            blocks: BTreeMap::new(),
            sets: BTreeMap::new(),
            n_sides: 0,
            shared: BTreeMap::new(),
        };
        plan.texts("info_records", "num_info", LINE_BYTES, origin);
        plan
    }

    /// The number of a dimension that several variables have.
    fn shared(&mut self, name: &'static str, length: u64) -> usize {
        *self.shared.entry(name).or_insert_with(|| self.file.dimension(name, length))
    }

    fn ints(&mut self, name: &str, dimensions: &[usize]) -> usize {
        self.file.variable(name, NetcdfType::Int, dimensions, vec![])
    }

    fn doubles(&mut self, name: &str, dimensions: &[usize]) -> usize {
        self.file.variable(name, NetcdfType::Double, dimensions, vec![])
    }

    fn fix_ints(&mut self, variable: usize, values: Vec<u32>) {
        self.fixed.push((variable, values.into_iter().flat_map(u32::to_be_bytes).collect()));
    }

    /// A variable of texts of `width` bytes, zeros behind each; none where there is no text.
    fn texts(&mut self, name: &str, rows: &'static str, width: usize, texts: &[String]) {
        if texts.is_empty() {
            return;
        }
        let columns = if width == LINE_BYTES { "len_line" } else { "len_name" };
        let dimensions =
            [self.shared(rows, texts.len() as u64), self.shared(columns, width as u64)];
        let variable = self.file.variable(name, NetcdfType::Char, &dimensions, vec![]);
        let padded = |text: &String| {
            let mut bytes = text.clone().into_bytes();
            bytes.resize(width, 0);
            bytes
        };
        self.fixed.push((variable, texts.iter().flat_map(padded).collect()));
    }

    /// Status, ids and names of blocks or sets.
    fn entities(
        &mut self,
        kind: &str,
        rows: &'static str,
        ids: impl Iterator<Item = u32>,
        names: &[String],
        longest_name: usize,
    ) {
        if names.is_empty() {
            return;
        }
        let rows_of = self.shared(rows, names.len() as u64);
        let status = self.ints(&format!("{kind}_status"), &[rows_of]);
        self.fix_ints(status, vec![1; names.len()]);
        let is_id = vec![("name", NetcdfValue::Text("ID".to_owned()))];
        let name = format!("{kind}_prop1");
        let property = self.file.variable(name, NetcdfType::Int, &[rows_of], is_id);
        self.fix_ints(property, ids.collect());
        self.texts(&format!("{kind}_names"), rows, longest_name + 1, names);
    }

    /// Connectivity and variables of each block.
    fn add_blocks(&mut self, regions: &BTreeMap<u32, u64>, n_nodes: u64, n_variables: usize) {
        let step = self.shared("time_step", 0);
        let mut first = 0;
        for (b, (&region, &n)) in (1..).zip(regions) {
            let elements = self.file.dimension(format!("num_el_in_blk{b}"), n);
            let nodes = self.file.dimension(format!("num_nod_per_el{b}"), n_nodes);
            // Every reader knows `TETRA`, not every one `TETRA4`.
            let kind = if n_nodes == 4 { "TETRA" } else { "TETRA10" };
            let kind = vec![("elem_type", NetcdfValue::Text(kind.to_owned()))];
            let name = format!("connect{b}");
            let nodes = self.file.variable(name, NetcdfType::Int, &[elements, nodes], kind);
            let values = (1..=n_variables)
                .map(|v| self.doubles(&format!("vals_elem_var{v}eb{b}"), &[step, elements]));
            let values = values.collect();
            self.blocks.insert(region, Block { first, n, map: 0, nodes, values });
            first += n;
        }
    }
}

/// Names of variables: those of `own`, then those of the fields' components, such as `u_x`, distinct without regard to case.
fn variable_names(fields: &[FieldRow], own: &[&str]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let components = fields.iter().flat_map(FieldRow::columns).map(|name| name.replace('.', "_"));
    let distinct = |mut name: String| {
        while !taken.insert(name.to_lowercase()) {
            name.push('_');
        }
        name
    };
    own.iter().map(|name| (*name).to_owned()).chain(components).map(distinct).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_schema::field::{FieldNumber, FieldPlace};

    #[test]
    fn no_two_variables_have_one_name() {
        let field = |name: &str, components| FieldRow {
            id: 0,
            name: name.to_owned(),
            place: FieldPlace::Tets,
            number: FieldNumber::F64,
            components,
        };
        let fields = [field("u", 3), field("U_x", 1), field("t", 1)];
        let names = variable_names(&fields, &["quality"]);
        assert_eq!(names, ["quality", "u_x", "u_y", "u_z", "U_x_", "t"]);
    }
}
