//! netCDF classic files whose variables are known in advance: a header, then arrays that are filled afterwards in any order.
//!
//! Is not a general writer: variables are characters, 32-bit integers and doubles, and there is one record. Numbers have their great end first.
//! Source: the netCDF classic format specification. Version 2 has places of 64 bits; version 5, chosen where a variable needs it, also lengths.

/// Largest variable of version 2, in bytes.
const BYTES_MAX: u64 = u32::MAX as u64 - 3;

/// Type of a variable's values, as the format numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NetcdfType {
    Char = 2,
    Int = 4,
    Double = 6,
}

impl NetcdfType {
    fn bytes(self) -> u64 {
        match self {
            Self::Char => 1,
            Self::Int => 4,
            Self::Double => 8,
        }
    }
}

/// An attribute: its name, and a text or a number.
pub(super) type NetcdfAttribute = (&'static str, NetcdfValue);

/// The value of an attribute.
pub(super) enum NetcdfValue {
    Text(String),
    Int(i32),
    Float(f32),
}

struct Variable {
    name: String,
    kind: NetcdfType,
    dimensions: Vec<usize>,
    attributes: Vec<NetcdfAttribute>,
}

/// A file to be laid out.
#[derive(Default)]
pub(super) struct NetcdfFile {
    /// Names and lengths; a length of 0 stands for that of the records, of which there is one.
    dimensions: Vec<(String, u64)>,
    pub attributes: Vec<NetcdfAttribute>,
    variables: Vec<Variable>,
}

/// The beginning of the file, and where its variables are.
pub(super) struct NetcdfLayout {
    pub head: Vec<u8>,
    /// First byte and length of each variable.
    pub arrays: Vec<[u64; 2]>,
    pub file_bytes: u64,
}

impl NetcdfFile {
    /// Adds a dimension; returns its number.
    pub fn dimension(&mut self, name: impl Into<String>, length: u64) -> usize {
        self.dimensions.push((name.into(), length));
        self.dimensions.len() - 1
    }

    /// Adds a variable, the last dimension running fastest; returns its number.
    pub fn variable(
        &mut self,
        name: impl Into<String>,
        kind: NetcdfType,
        dimensions: &[usize],
        attributes: Vec<NetcdfAttribute>,
    ) -> usize {
        let (name, dimensions) = (name.into(), dimensions.to_vec());
        self.variables.push(Variable { name, kind, dimensions, attributes });
        self.variables.len() - 1
    }

    /// Number of variables so far.
    pub fn n_variables(&self) -> usize {
        self.variables.len()
    }

    fn bytes(&self, variable: &Variable) -> u64 {
        let lengths = variable.dimensions.iter().map(|&d| self.dimensions[d].1.max(1));
        lengths.product::<u64>() * variable.kind.bytes()
    }

    fn is_record(&self, variable: &Variable) -> bool {
        variable.dimensions.first().is_some_and(|&d| self.dimensions[d].1 == 0)
    }

    /// Lays out the file: variables of the record come last, as the format wants it.
    pub fn plan(&self) -> NetcdfLayout {
        self.plan_within(BYTES_MAX)
    }

    fn plan_within(&self, bytes_max: u64) -> NetcdfLayout {
        let mut arrays: Vec<[u64; 2]> = self.variables.iter().map(|v| [0, self.bytes(v)]).collect();
        let is_wide = arrays.iter().any(|&[_, bytes]| bytes > bytes_max);
        // The head has the same length whatever the places in it.
        let mut end = self.head(is_wide, &arrays).len() as u64;
        for is_record in [false, true] {
            for (array, variable) in arrays.iter_mut().zip(&self.variables) {
                if self.is_record(variable) == is_record {
                    array[0] = end;
                    end += array[1].next_multiple_of(4);
                }
            }
        }
        NetcdfLayout { head: self.head(is_wide, &arrays), arrays, file_bytes: end }
    }

    fn head(&self, is_wide: bool, arrays: &[[u64; 2]]) -> Vec<u8> {
        let mut head = Head { bytes: b"CDF".to_vec(), is_wide };
        head.bytes.push(if is_wide { 5 } else { 2 });
        head.count(u64::from(self.dimensions.iter().any(|d| d.1 == 0)));
        head.list(0x0a, self.dimensions.len());
        for (name, length) in &self.dimensions {
            head.text(name);
            head.count(*length);
        }
        head.attributes(&self.attributes);
        head.list(0x0b, self.variables.len());
        for (variable, [at, bytes]) in self.variables.iter().zip(arrays) {
            head.text(&variable.name);
            head.count(variable.dimensions.len() as u64);
            variable.dimensions.iter().for_each(|&d| head.count(d as u64));
            head.attributes(&variable.attributes);
            head.word(variable.kind as u32);
            head.count(bytes.next_multiple_of(4));
            head.bytes.extend(at.to_be_bytes());
        }
        head.bytes
    }
}

/// The header being written.
struct Head {
    bytes: Vec<u8>,
    /// Counts have 64 bits.
    is_wide: bool,
}

impl Head {
    fn word(&mut self, word: u32) {
        self.bytes.extend(word.to_be_bytes());
    }

    fn count(&mut self, n: u64) {
        match self.is_wide {
            true => self.bytes.extend(n.to_be_bytes()),
            false => self.word(n as u32),
        }
    }

    /// Begins a list; an empty one has no tag.
    fn list(&mut self, tag: u32, n: usize) {
        self.word(if n == 0 { 0 } else { tag });
        self.count(n as u64);
    }

    fn text(&mut self, text: &str) {
        self.count(text.len() as u64);
        self.bytes.extend(text.as_bytes());
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    fn attributes(&mut self, attributes: &[NetcdfAttribute]) {
        self.list(0x0c, attributes.len());
        for (name, value) in attributes {
            self.text(name);
            let (kind, word) = match value {
                NetcdfValue::Text(text) => {
                    self.word(NetcdfType::Char as u32);
                    self.text(text);
                    continue;
                }
                NetcdfValue::Int(n) => (4, n.to_be_bytes()),
                NetcdfValue::Float(x) => (5, x.to_be_bytes()),
            };
            self.word(kind);
            self.count(1);
            self.bytes.extend(word);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_that_of_the_specification() {
        let mut file = NetcdfFile::default();
        let [step, n] = [file.dimension("t", 0), file.dimension("n", 3)];
        file.attributes.push(("title", NetcdfValue::Text("abc".into())));
        file.variable("v", NetcdfType::Double, &[step, n], vec![]);
        file.variable("c", NetcdfType::Char, &[n], vec![("k", NetcdfValue::Int(7))]);
        let words = |bytes: &[u8]| -> Vec<u32> {
            let words = bytes.as_chunks::<4>().0;
            words.iter().map(|word| u32::from_be_bytes(*word)).collect()
        };
        let text = |text: &[u8; 4]| u32::from_be_bytes(*text);
        let layout = file.plan();
        let head = layout.head.len() as u64;
        // The characters come before the record, padded to four bytes.
        assert_eq!(layout.arrays, [[head + 4, 24], [head, 3]]);
        assert_eq!(layout.file_bytes, head + 28);
        let t = |name: &[u8; 4]| [1, text(name)];
        let mut expected = vec![text(b"CDF\x02"), 1, 0x0a, 2];
        expected.extend([t(b"t\0\0\0"), [0, 1], [text(b"n\0\0\0"), 3]].concat());
        expected.extend([0x0c, 1, 5, text(b"titl"), text(b"e\0\0\0"), 2, 3, text(b"abc\0")]);
        expected.extend([0x0b, 2, 1, text(b"v\0\0\0"), 2, 0, 1, 0, 0, 6, 24, 0, head as u32 + 4]);
        expected.extend([1, text(b"c\0\0\0"), 1, 1, 0x0c, 1, 1, text(b"k\0\0\0"), 4, 1, 7]);
        expected.extend([2, 4, 0, head as u32]);
        assert_eq!(words(&layout.head), expected);
        // Of version 5 all counts, and no tags or types, have 64 bits.
        let wide = file.plan_within(23).head;
        assert!(wide.starts_with(b"CDF\x05\0\0\0\0\0\0\0\x01\0\0\0\x0a\0\0\0\0\0\0\0\x02"));
        assert_eq!(wide.len() as u64, head + 4 * 23);
    }
}
