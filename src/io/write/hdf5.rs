//! HDF5 files whose arrays are known in advance: groups, attributes, and contiguous arrays that are filled afterwards in any order.
//!
//! Is not a general writer: no chunks, no compression, names in ASCII, and the links of a group in its own header. So a file of any size is laid
//! out before its first byte is written.
//! Source: the HDF5 file format specification, version 3.0 (superblock 2, object headers 2); the checksum is Jenkins's `lookup3`.

use std::borrow::Cow;

use super::columns::Number;

impl Number {
    /// The message that describes it.
    fn datatype(self) -> Vec<u8> {
        let size = self.bytes() as u8;
        let precision = [0, 0, 8 * size, 0];
        let mut message = match self {
            // Class 1, implied leading bit, sign in bit 63.
            Self::F64 => vec![0x11, 0x20, 63, 0, size, 0, 0, 0],
            Self::F32 => vec![0x11, 0x20, 31, 0, size, 0, 0, 0],
            // Class 0; bit 3 of the second byte is the sign.
            _ => {
                let sign = 8 * u8::from(matches!(self, Self::I32 | Self::I64));
                vec![0x10, sign, 0, 0, size, 0, 0, 0]
            }
        };
        message.extend(precision);
        if self == Self::F32 {
            message.extend([23, 8, 0, 23]);
            message.extend(127u32.to_le_bytes());
        }
        if self == Self::F64 {
            // Exponent: place and bits; mantissa: place and bits; bias.
            message.extend([52, 11, 0, 52]);
            message.extend(1023u32.to_le_bytes());
        }
        message
    }
}

/// A node of the file's tree.
pub(super) struct Hdf5Object {
    name: Cow<'static, str>,
    attributes: Vec<Hdf5Attribute>,
    content: Content,
}

/// A small value attached to an object.
struct Hdf5Attribute {
    name: &'static str,
    datatype: Vec<u8>,
    dataspace: Vec<u8>,
    bytes: Vec<u8>,
}

enum Content {
    Group(Vec<Hdf5Object>),
    Array(Number, Vec<u64>),
}

impl Hdf5Object {
    pub fn group(name: impl Into<Cow<'static, str>>, children: Vec<Hdf5Object>) -> Self {
        let (attributes, content) = (Vec::new(), Content::Group(children));
        Self { name: name.into(), attributes, content }
    }

    /// An array of this shape, the last index running fastest.
    pub fn array(name: impl Into<Cow<'static, str>>, number: Number, shape: &[u64]) -> Self {
        let (attributes, content) = (Vec::new(), Content::Array(number, shape.to_vec()));
        Self { name: name.into(), attributes, content }
    }

    /// Attaches a list of integers.
    pub fn with_integers(mut self, name: &'static str, values: &[i64]) -> Self {
        self.attributes.push(Hdf5Attribute {
            name,
            datatype: Number::I64.datatype(),
            dataspace: dataspace(&[values.len() as u64]),
            bytes: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        });
        self
    }

    /// Attaches a text of ASCII.
    pub fn with_text(mut self, name: &'static str, text: &str) -> Self {
        let mut datatype = vec![0x13, 0, 0, 0];
        datatype.extend((text.len() as u32).to_le_bytes());
        self.attributes.push(Hdf5Attribute {
            name,
            datatype,
            dataspace: vec![2, 0, 0, 0],
            bytes: text.as_bytes().to_vec(),
        });
        self
    }
}

fn dataspace(shape: &[u64]) -> Vec<u8> {
    let mut message = vec![2, shape.len() as u8, 0, 1];
    message.extend(shape.iter().flat_map(|n| n.to_le_bytes()));
    message
}

/// The beginning of the file, and where its arrays are.
pub(super) struct Hdf5Layout {
    pub head: Vec<u8>,
    /// First byte and length of each array, in the order of the tree.
    pub arrays: Vec<[u64; 2]>,
    pub file_bytes: u64,
}

const SUPERBLOCK_BYTES: usize = 48;
/// Marks an address that leads nowhere.
const UNDEFINED: u64 = u64::MAX;

/// Lays out a file with this root.
pub(super) fn plan(root: &Hdf5Object) -> Hdf5Layout {
    // Headers have the same length whatever the addresses in them: the first round measures them.
    let measured = round(root, 0).head.len() as u64;
    round(root, measured)
}

fn round(root: &Hdf5Object, data: u64) -> Hdf5Layout {
    let mut plan =
        Hdf5Layout { head: vec![0; SUPERBLOCK_BYTES], arrays: Vec::new(), file_bytes: data };
    let root = put_object(root, &mut plan);
    let mut superblock = b"\x89HDF\r\n\x1a\n\x02\x08\x08\x00".to_vec();
    for address in [0, UNDEFINED, plan.file_bytes, root] {
        superblock.extend(address.to_le_bytes());
    }
    superblock.extend(lookup3(&superblock).to_le_bytes());
    plan.head[..SUPERBLOCK_BYTES].copy_from_slice(&superblock);
    plan
}

/// Adds an object's header behind those of its children; returns its address.
fn put_object(object: &Hdf5Object, plan: &mut Hdf5Layout) -> u64 {
    let mut messages = Vec::new();
    let mut message = |kind: u8, data: &[u8]| {
        messages.push(kind);
        messages.extend((data.len() as u16).to_le_bytes());
        messages.push(0);
        messages.extend_from_slice(data);
    };
    match &object.content {
        Content::Group(children) => {
            let mut info = vec![0, 0];
            info.extend([0xff; 16]);
            message(0x02, &info);
            message(0x0a, &[0, 0]);
            for child in children {
                let mut link = vec![1, 0, child.name.len() as u8];
                link.extend_from_slice(child.name.as_bytes());
                link.extend(put_object(child, plan).to_le_bytes());
                message(0x06, &link);
            }
        }
        Content::Array(number, shape) => {
            let bytes = shape.iter().product::<u64>() * number.bytes();
            let at = plan.file_bytes.next_multiple_of(8);
            plan.arrays.push([at, bytes]);
            plan.file_bytes = at + bytes;
            message(0x01, &dataspace(shape));
            message(0x03, &number.datatype());
            // Space at once, no fill value of the caller's.
            message(0x05, &[3, 0x09]);
            let mut layout = vec![3, 1];
            layout.extend(if bytes == 0 { UNDEFINED } else { at }.to_le_bytes());
            layout.extend(bytes.to_le_bytes());
            message(0x08, &layout);
        }
    }
    for a in &object.attributes {
        let mut data = vec![3, 0];
        for length in [a.name.len() + 1, a.datatype.len(), a.dataspace.len()] {
            data.extend((length as u16).to_le_bytes());
        }
        data.push(0);
        data.extend_from_slice(a.name.as_bytes());
        data.push(0);
        for part in [&a.datatype, &a.dataspace, &a.bytes] {
            data.extend_from_slice(part);
        }
        message(0x0c, &data);
    }
    let mut header = b"OHDR\x02\x02".to_vec();
    header.extend((messages.len() as u32).to_le_bytes());
    header.extend(messages);
    header.extend(lookup3(&header).to_le_bytes());
    let address = plan.head.len() as u64;
    plan.head.extend(header);
    address
}

/// The checksum of headers: Bob Jenkins's `hashlittle` of 2006, begun with 0.
fn lookup3(bytes: &[u8]) -> u32 {
    let start = 0xdead_beef_u32.wrapping_add(bytes.len() as u32);
    let mut state = [start; 3];
    let add = |state: &mut [u32; 3], block: &[u8]| {
        for (i, &byte) in block.iter().enumerate() {
            let word = &mut state[i / 4];
            *word = word.wrapping_add(u32::from(byte) << (8 * (i % 4)));
        }
    };
    let mut rest = bytes;
    while rest.len() > 12 {
        add(&mut state, &rest[..12]);
        rest = &rest[12..];
        let [mut a, mut b, mut c] = state;
        for (i, turn) in [4, 6, 8, 16, 19, 4].into_iter().enumerate() {
            let (x, y, z) = match i % 3 {
                0 => (&mut a, &mut c, b),
                1 => (&mut b, &mut a, c),
                _ => (&mut c, &mut b, a),
            };
            *x = x.wrapping_sub(*y) ^ y.rotate_left(turn);
            *y = y.wrapping_add(z);
        }
        state = [a, b, c];
    }
    if rest.is_empty() {
        return state[2];
    }
    add(&mut state, rest);
    let [mut a, mut b, mut c] = state;
    for (i, turn) in [14, 11, 25, 16, 4, 14, 24].into_iter().enumerate() {
        let (x, y) = match i % 3 {
            0 => (&mut c, b),
            1 => (&mut a, c),
            _ => (&mut b, a),
        };
        *x = (*x ^ y).wrapping_sub(y.rotate_left(turn));
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_published_one() {
        // The values its author's own test prints.
        assert_eq!(lookup3(b""), 0xdead_beef);
        assert_eq!(lookup3(b"Four score and seven years ago"), 0x1777_0551);
    }

    #[test]
    fn arrays_follow_the_headers_and_do_not_overlap() {
        let root = Hdf5Object::group(
            "",
            vec![
                Hdf5Object::array("a", Number::U8, &[3]).with_text("kind", "x"),
                Hdf5Object::group("g", vec![Hdf5Object::array("b", Number::F64, &[5, 3])]),
                Hdf5Object::array("c", Number::I64, &[0]),
            ],
        );
        let plan = plan(&root);
        let head = plan.head.len() as u64;
        let first = head.next_multiple_of(8);
        assert_eq!(plan.arrays, [[first, 3], [first + 8, 120], [first + 128, 0]]);
        assert_eq!(plan.file_bytes, first + 128);
        assert!(plan.head.starts_with(b"\x89HDF\r\n\x1a\n"));
    }
}
