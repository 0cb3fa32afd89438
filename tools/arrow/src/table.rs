//! The tables of a store: names, columns and their types.

use std::sync::Arc;

use arrow_schema::{DataType, Field, Schema, SchemaRef};
use tetdb::{Code, Error, FieldNumber, FieldPlace, Store};

/// A table of a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// A row for each tetrahedron.
    Tets,
    /// A row for each vertex of each sub-domain: a vertex of an interface has one in each.
    Vertices,
    /// A row for each face on the surface, an inner wall or a sheet. One between two sub-domains has a row in each.
    Faces,
    /// A row for each pair of sub-domains that share faces, and cut.
    Interfaces,
    /// A row for each sub-domain.
    Subdomains,
    /// A row for each region, the empty ones too.
    Regions,
    /// A row for each label of the surface.
    Labels,
    /// A row for each version.
    Versions,
}

use DataType::{Boolean, Float32, Float64, Int32, Int64, Utf8};

type Column = (&'static str, DataType);

/// As in the Parquet export, then what conditions also know. `x y z` is the centroid.
const TETS: &[Column] = &[
    ("id", Int64),
    ("subdomain", Int32),
    ("region", Int32),
    ("quality", Float64),
    ("volume", Float64),
    ("x", Float64),
    ("y", Float64),
    ("z", Float64),
    ("v0", Int64),
    ("v1", Int64),
    ("v2", Int64),
    ("v3", Int64),
    ("edge_min", Float64),
    ("edge_max", Float64),
    ("angle_min", Float64),
    ("angle_max", Float64),
];

/// As in the Parquet export, then the sub-domain.
const VERTICES: &[Column] = &[
    ("id", Int64),
    ("x", Float64),
    ("y", Float64),
    ("z", Float64),
    ("h", Float32),
    ("tag", Int32),
    ("subdomain", Int32),
];

/// `x y z` is the centroid. Front is where the normal points to. See [`NULLABLE`].
const FACES: &[Column] = &[
    ("triangle", Int64),
    ("subdomain", Int32),
    ("label", Int32),
    ("v0", Int64),
    ("v1", Int64),
    ("v2", Int64),
    ("region_front", Int32),
    ("region_behind", Int32),
    ("tet_front", Int64),
    ("tet_behind", Int64),
    ("area", Float64),
    ("x", Float64),
    ("y", Float64),
    ("z", Float64),
];

const INTERFACES: &[Column] =
    &[("cut", Int32), ("low", Int32), ("high", Int32), ("faces", Int64), ("digest", Utf8)];

const SUBDOMAINS: &[Column] = &[
    ("subdomain", Int32),
    ("tets", Int64),
    ("vertices", Int64),
    ("facets", Int64),
    ("interface_faces", Int64),
    ("worst_q", Float64),
    ("volume", Float64),
    ("x_min", Float64),
    ("y_min", Float64),
    ("z_min", Float64),
    ("x_max", Float64),
    ("y_max", Float64),
    ("z_max", Float64),
    ("bytes", Int64),
    ("digest", Utf8),
];

const REGIONS: &[Column] =
    &[("region", Int32), ("name", Utf8), ("tets", Int64), ("volume", Float64), ("filled", Boolean)];

const LABELS: &[Column] = &[("label", Int32), ("name", Utf8)];

const VERSIONS: &[Column] = &[
    ("name", Utf8),
    ("note", Utf8),
    ("saved", Int64),
    ("tets", Int64),
    ("vertices", Int64),
    ("subdomains", Int64),
    ("bytes", Int64),
    ("digest", Utf8),
];

/// Columns with rows that have no value: a triangle that holds an embedded edge and is none of the input, a side without a tetrahedron in
/// the sub-domain, a region without a name.
const NULLABLE: &[(Table, &str)] = &[
    (Table::Faces, "triangle"),
    (Table::Faces, "tet_front"),
    (Table::Faces, "tet_behind"),
    (Table::Regions, "name"),
];

impl Table {
    /// All tables.
    pub const ALL: [Self; 8] = [
        Self::Tets,
        Self::Vertices,
        Self::Faces,
        Self::Interfaces,
        Self::Subdomains,
        Self::Regions,
        Self::Labels,
        Self::Versions,
    ];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tets => "tets",
            Self::Vertices => "vertices",
            Self::Faces => "faces",
            Self::Interfaces => "interfaces",
            Self::Subdomains => "subdomains",
            Self::Regions => "regions",
            Self::Labels => "labels",
            Self::Versions => "versions",
        }
    }

    /// The table of this name. Errors: `bad-query`.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|table| table.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new(Code::BadQuery, format!("there is no table {name}; there are {names}"))
        })
    }

    fn own(self) -> &'static [Column] {
        match self {
            Self::Tets => TETS,
            Self::Vertices => VERTICES,
            Self::Faces => FACES,
            Self::Interfaces => INTERFACES,
            Self::Subdomains => SUBDOMAINS,
            Self::Regions => REGIONS,
            Self::Labels => LABELS,
            Self::Versions => VERSIONS,
        }
    }

    /// Where the fields are that are columns of the table.
    pub fn place(self) -> Option<FieldPlace> {
        match self {
            Self::Tets => Some(FieldPlace::Tets),
            Self::Vertices => Some(FieldPlace::Vertices),
            _ => None,
        }
    }

    /// All columns of the table, those of fields last. Errors: damage; a field with the name of another column.
    pub fn schema(self, store: &Store) -> Result<SchemaRef, Error> {
        let own = self.own().iter().map(|(name, number)| {
            Field::new(*name, number.clone(), NULLABLE.contains(&(self, *name)))
        });
        let mut all: Vec<Field> = own.collect();
        if let Some(place) = self.place() {
            for field in store.fields()?.into_iter().filter(|field| field.at == place) {
                let number = match field.number {
                    FieldNumber::F32 => Float32,
                    FieldNumber::F64 => Float64,
                    FieldNumber::I32 => Int32,
                    FieldNumber::I64 => Int64,
                };
                for name in field.columns {
                    if all.iter().any(|other| *other.name() == name) {
                        let message =
                            format!("the field {name} is called as a column of {}", self.name());
                        return Err(Error::new(Code::BadField, message)
                            .with_help("add it again under another name, and drop this one"));
                    }
                    all.push(Field::new(name, number.clone(), false));
                }
            }
        }
        Ok(Arc::new(Schema::new(all)))
    }
}
