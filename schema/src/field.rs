//! Rows of fields: named values at the vertices or tetrahedra of a finished mesh.
//!
//! The values of a sub-domain are a file of their own beside the sealed one. Its chunks hold the values of the chunks of vertices or
//! tetrahedra of the sub-domain, one by one, each component apart. A vertex that several sub-domains share has its value in each of
//! them; all are written from one value.

use rkyv::{Archive, Deserialize, Serialize};

use crate::catalog::FileRow;
use crate::word::Word;

/// Numbers of components that a value may have.
pub const COMPONENTS: [u32; 4] = [1, 3, 6, 9];

/// Where the values of a field are.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FieldPlace {
    /// A value for each vertex.
    Vertices,
    /// A value for each tetrahedron.
    Tets,
}

impl Word for FieldPlace {
    const WORDS: &'static [(Self, &'static str)] =
        &[(Self::Vertices, "vertices"), (Self::Tets, "tets")];
}

/// Type of the numbers of a field.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FieldNumber {
    /// Floating point, 32 bits.
    F32,
    /// Floating point, 64 bits.
    F64,
    /// Integer, 32 bits.
    I32,
    /// Integer, 64 bits.
    I64,
}

impl Word for FieldNumber {
    const WORDS: &'static [(Self, &'static str)] =
        &[(Self::F32, "f32"), (Self::F64, "f64"), (Self::I32, "i32"), (Self::I64, "i64")];
}

/// One number of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    /// Of `i32` or `i64`.
    Int(i64),
    /// Of `f32` or `f64`.
    Float(f64),
}

impl Scalar {
    /// The number as a double, to the nearest.
    pub fn to_f64(self) -> f64 {
        match self {
            Self::Int(n) => n as f64,
            Self::Float(x) => x,
        }
    }
}

impl FieldNumber {
    /// Bytes of a number.
    pub const fn bytes(self) -> usize {
        match self {
            Self::F32 | Self::I32 => 4,
            Self::F64 | Self::I64 => 8,
        }
    }

    /// Returns whether the numbers are integers.
    pub const fn is_integer(self) -> bool {
        matches!(self, Self::I32 | Self::I64)
    }

    /// The word that a chunk holds for a number; `None` for a number that the type does not have. An `f32` is the nearest one.
    pub fn pack(self, number: Scalar) -> Option<u64> {
        Some(match (self, number) {
            (Self::F32, number) => {
                let x = number.to_f64();
                let narrow = x as f32;
                if narrow.is_infinite() && x.is_finite() {
                    return None;
                }
                u64::from(narrow.to_bits())
            }
            (Self::F64, Scalar::Float(x)) => x.to_bits(),
            (Self::F64, Scalar::Int(n)) if (n as f64) as i128 == i128::from(n) => {
                (n as f64).to_bits()
            }
            (Self::I32, Scalar::Int(n)) => i64::from(i32::try_from(n).ok()?) as u64,
            (Self::I64, Scalar::Int(n)) => n as u64,
            // From 2^63 on, doubles are no 64-bit integers.
            (Self::I32 | Self::I64, Scalar::Float(x)) if x.fract() == 0.0 && x.abs() < 9.2e18 => {
                return self.pack(Scalar::Int(x as i64));
            }
            _ => return None,
        })
    }

    /// The word of a place that has no value: not a number, or 0 for integers.
    pub fn nothing(self) -> u64 {
        self.pack(Scalar::Float(f64::NAN)).unwrap_or_default()
    }

    /// The inverse of [`FieldNumber::pack`].
    pub fn unpack(self, word: u64) -> Scalar {
        match self {
            Self::F32 => Scalar::Float(f64::from(f32::from_bits(word as u32))),
            Self::F64 => Scalar::Float(f64::from_bits(word)),
            Self::I32 | Self::I64 => Scalar::Int(word as i64),
        }
    }
}

/// A field.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct FieldRow {
    /// Its number in the catalog, below 2^24.
    pub id: u32,
    /// Its name.
    pub name: String,
    /// Where its values are.
    pub place: FieldPlace,
    /// Type of its numbers.
    pub number: FieldNumber,
    /// Numbers of a value, one of [`COMPONENTS`].
    pub components: u32,
}

/// Names of the components of a value, of as many as it has.
const NAMES_3: [&str; 3] = ["x", "y", "z"];
const NAMES_6: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];
const NAMES_9: [&str; 9] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];

impl FieldRow {
    /// Names of its components in expressions: `T`, or `u.x`, `u.y`, `u.z`. Symmetric tensors are in VTK's order, others row by row.
    pub fn columns(&self) -> Vec<String> {
        let names: &[&str] = match self.components {
            3 => &NAMES_3,
            6 => &NAMES_6,
            9 => &NAMES_9,
            _ => return vec![self.name.clone()],
        };
        names.iter().map(|component| format!("{}.{component}", self.name)).collect()
    }
}

/// Extremes of one component; NaN counts apart. Without any other value, `low` is infinite and above `high`.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FieldRange {
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Number of values that are not numbers.
    pub nan: u64,
}

impl FieldRange {
    /// The range of no value.
    pub const EMPTY: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY, nan: 0 };

    /// Adds a value.
    #[inline]
    pub fn add(&mut self, x: f64) {
        if x.is_nan() {
            self.nan += 1;
        } else {
            self.low = self.low.min(x);
            self.high = self.high.max(x);
        }
    }

    /// Adds all values of another range.
    pub fn union(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.nan += other.nan;
    }
}

/// The values of a field in one sub-domain.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct FieldPart {
    /// Number of the field.
    pub field: u32,
    /// Rank of the sub-domain.
    pub rank: u32,
    /// Generation of the sub-domain's mesh that the values belong to.
    pub generation: u32,
    /// Number in the name of the file; no other file of a field that is listed has it.
    pub serial: u32,
    /// Number of values.
    pub values: u64,
    /// Number of stored pieces of chunks.
    pub pieces: u32,
    /// Number of stored blocks of summaries: of the chunks of values, and of the chunks of tetrahedra where the values are at vertices.
    pub summaries: [u32; 2],
    /// xxh3 of all numbers in order.
    pub digest: u64,
    /// Extremes of each component.
    pub ranges: Vec<FieldRange>,
    /// Length of the file.
    pub bytes: u64,
}

impl FieldPart {
    /// Its file.
    pub const fn file(&self) -> FileRow {
        FileRow { subdomain: self.rank, generation: self.serial }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_kept_or_refused() {
        use FieldNumber::{F32, F64, I32, I64};
        let (int, float) = (Scalar::Int, Scalar::Float);
        for (number, value) in [
            (F64, float(-0.1)),
            (F64, int(1 << 53)),
            (F32, float(0.5)),
            (F32, float(f64::INFINITY)),
            (I32, int(-7)),
            (I32, float(3.0)),
            (I64, int(i64::MIN)),
        ] {
            let word = number.pack(value).expect("it fits");
            assert_eq!(number.unpack(word).to_f64(), value.to_f64(), "{number:?} {value:?}");
        }
        for (number, value) in [
            (I32, int(1 << 31)),
            (I32, float(0.5)),
            (I64, float(1e19)),
            (I64, float(f64::NAN)),
            (F64, int((1 << 53) + 1)),
            (F32, float(1e300)),
        ] {
            assert_eq!(number.pack(value), None, "{number:?} {value:?}");
        }
        assert!(F32.unpack(F32.pack(float(f64::NAN)).unwrap()).to_f64().is_nan());
    }
}
