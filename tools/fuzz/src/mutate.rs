//! Changes to bytes: small ones anywhere, and numbers that readers trip over.

/// Longest input made.
const BYTES_MAX: usize = 1 << 16;

/// Text that means too much, too little or nothing.
const WORDS: &[&str] = &[
    "-1",
    "0",
    "1",
    "2",
    "3",
    "255",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "18446744073709551616",
    "99999999999999999999999",
    "1e308",
    "1e309",
    "-1e-320",
    "nan",
    "inf",
    "-inf",
    "0x10",
    "1.",
    ".5",
    "+",
    "-",
    "e5",
    "1e",
    "//",
    "1//1",
    "-1/-1/-1",
    "\n",
    "\r",
    "\0",
    "#",
    "\"",
    "end",
    "End",
    "facet",
    "$End",
    "list",
    "uchar",
    "double",
    "property",
    "element",
    "solid",
    "endsolid",
    "vertex",
    "outer loop",
    "OFF",
    "COFF",
    "v ",
    "f ",
    "g ",
    "Vertices",
    "Triangles",
    "Dimension",
    "$Nodes",
    "$Elements",
    "$PhysicalNames",
    "comment label",
    "format ascii 1.0",
    "hsiz",
    "hgrad",
    "size_sphere",
    "size_expr",
    "= [[",
    "sqrt(",
    "min(",
    "max(",
    " and ",
    " or ",
    "not ",
    " in (",
    "^",
    "x",
    "%",
    "sample:balls,count=",
    "label:",
];

/// Words of four or eight bytes, the same in binary.
const NUMBERS: &[u64] = &[
    0,
    1,
    2,
    3,
    7,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x3fff_ffff,
    1 << 32,
    1 << 62,
    u64::MAX,
    0x7ff0_0000_0000_0000,
    0x7ff8_0000_0000_0001,
    0x7fef_ffff_ffff_ffff,
    0x7f80_0000,
];

/// A seeded source of mutated inputs.
pub struct Mutator(u64);

impl Mutator {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    /// One of the seeds, changed a few times.
    pub fn mutated(&mut self, seeds: &[Vec<u8>]) -> Vec<u8> {
        let mut input = seeds[self.below(seeds.len())].clone();
        for _ in 0..=self.below(6) {
            self.change(&mut input, seeds);
        }
        input.truncate(BYTES_MAX);
        input
    }

    fn change(&mut self, input: &mut Vec<u8>, seeds: &[Vec<u8>]) {
        let n = input.len();
        let at = self.below(n + 1);
        let until = (at + 1 + self.below(16)).min(n);
        match self.below(11) {
            0 if at < n => input[at] ^= 1 << self.below(8),
            1 if at < n => input[at] = self.bits() as u8,
            2 => input.insert(at, self.bits() as u8),
            3 if at < n => drop(input.drain(at..until)),
            4 => {
                // A piece again, elsewhere.
                let piece = input[at.min(until)..until].to_vec();
                let to = self.below(n + 1);
                input.splice(to..to, piece);
            }
            5 => input.truncate(at),
            6 => {
                // The end of another seed.
                let other = &seeds[self.below(seeds.len())];
                let from = self.below(other.len() + 1);
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
            7 | 8 => {
                // A word of text in place of the one here.
                let is_text = |b: &u8| !b.is_ascii_whitespace();
                let start = input[..at].iter().rposition(|b| !is_text(b)).map_or(0, |i| i + 1);
                let end = input[at..].iter().position(|b| !is_text(b)).map_or(n, |i| at + i);
                let word = WORDS[self.below(WORDS.len())];
                if end - start < 40 {
                    input.splice(start..end, word.bytes());
                }
            }
            9 => {
                let number = NUMBERS[self.below(NUMBERS.len())];
                let mut bytes = number.to_le_bytes();
                let width = [1, 2, 4, 8][self.below(4)];
                if self.below(4) == 0 {
                    bytes[..width].reverse();
                }
                let end = (at + width).min(n);
                input.splice(at..end, bytes[..width].iter().copied());
            }
            _ => {
                // A line or a piece again, many times.
                let piece = input[at.min(until)..until].to_vec();
                for _ in 0..self.below(100) {
                    input.splice(at..at, piece.iter().copied());
                }
            }
        }
    }
}
