//! The mesh against its input: every triangle there, bit for bit, and nothing added on it.

use tetdb_schema::record::{NO_TET, SealedFacet};

use super::{Finding, Report};
use crate::sealed::Corner;
use tetdb_base::surface::Surface;

/// The input, and its triangles found so far. Memory: three bits for each triangle.
pub(super) struct Input<'a> {
    surface: &'a Surface,
    /// Bits of triangles found with a filled front, with a filled back, at all.
    seen: [Vec<u64>; 3],
    doubled: Vec<DoubledSide>,
}

/// The number of a triangle, and which of its sides is filled twice.
type DoubledSide = (u32, u8);

/// The triangles of one part of the mesh.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug)]
pub(super) struct FoundTriangles {
    /// Place and bits of the words that are not all zero, as in [`Input`].
    words: Vec<(u32, [u64; 3])>,
    doubled: Vec<DoubledSide>,
}

/// Sets a bit; says whether it was set before.
fn set(bits: &mut [u64], at: usize) -> bool {
    let word = &mut bits[at / 64];
    let was = *word >> (at % 64) & 1 != 0;
    *word |= 1 << (at % 64);
    was
}

fn get(bits: &[u64], at: usize) -> bool {
    bits[at / 64] >> (at % 64) & 1 != 0
}

/// The surface vertices of a facet's corners, where they are the input's.
fn input_vertices(corners: &[Corner; 3]) -> [Option<u32>; 3] {
    corners.each_ref().map(Corner::input_index)
}

/// Every vertex of a facet is the input's, whether the input is at hand or not.
pub(super) fn check_owners(subdomain: u32, corners: &[Corner; 3], report: &mut Report) {
    if input_vertices(corners).contains(&None) {
        let what = "a facet has a vertex that is not the input's";
        report.find(Finding::AddedVertex, subdomain, what).with_corners(corners);
    }
}

impl<'a> Input<'a> {
    pub(super) fn new(surface: &'a Surface) -> Self {
        let words = surface.triangles.len().div_ceil(64);
        Self { surface, seen: [(); 3].map(|()| vec![0; words]), doubled: Vec::new() }
    }

    /// Returns the found triangles, for [`add`](Self::add) in another process.
    pub(super) fn into_found(self) -> FoundTriangles {
        let word = |at: usize| (at as u32, self.seen.each_ref().map(|bits| bits[at]));
        let words = (0..self.seen[0].len()).map(word);
        FoundTriangles {
            words: words.filter(|(_, bits)| *bits != [0; 3]).collect(),
            doubled: self.doubled,
        }
    }

    /// Adds the triangles found in another part of the mesh.
    pub(super) fn add(&mut self, other: FoundTriangles) {
        self.doubled.extend(other.doubled);
        for (at, bits) in other.words {
            for (side, more) in (0..).zip(bits) {
                let Some(word) = self.seen[side].get_mut(at as usize) else {
                    continue;
                };
                let both = *word & more;
                *word |= more;
                if side < 2 {
                    let set = (0..64).filter(|bit| both >> bit & 1 != 0);
                    (self.doubled).extend(set.map(|bit| (at * 64 + bit, side as u8)));
                }
            }
        }
    }

    /// Compares a facet with the triangle it names.
    pub(super) fn check(
        &mut self,
        subdomain: u32,
        facet: &SealedFacet,
        corners: &[Corner; 3],
        report: &mut Report,
    ) {
        if let Some(what) = self.difference(facet, corners) {
            let what = format_args!("the facet of input triangle {} {what}", facet.triangle);
            report.find(Finding::NotAnInputTriangle, subdomain, what).with_corners(corners);
        }
    }

    fn difference(&mut self, facet: &SealedFacet, corners: &[Corner; 3]) -> Option<&'static str> {
        let number = usize::try_from(facet.triangle).unwrap_or(usize::MAX);
        let Some(triangle) = self.surface.triangles.get(number) else {
            return Some("names a triangle the input does not have");
        };
        let found = input_vertices(corners);
        let same = (0..3).any(|turn| (0..3).all(|i| found[(i + turn) % 3] == Some(triangle[i])));
        if !same {
            return Some("has other vertices");
        }
        let bits = |p: tetdb_base::geom::Point| p.to_array().map(f64::to_bits);
        let moved = corners.iter().zip(found).any(|(c, v)| {
            let input = v.and_then(|v| self.surface.points.get(v as usize));
            input.is_none_or(|&p| bits(p) != bits(c.point))
        });
        if moved {
            return Some("has a vertex at another place");
        }
        set(&mut self.seen[2], number);
        for side in 0..2 {
            if facet.tets[side] != NO_TET && set(&mut self.seen[side], number) {
                self.doubled.push((number as u32, side as u8));
            }
        }
        None
    }

    /// Counts the found triangles; reports the missing ones.
    pub(super) fn finish(mut self, report: &mut Report) {
        self.doubled.sort_unstable();
        for &(number, side) in &self.doubled {
            let side = ["front", "back"][usize::from(side)];
            let what = format!("input triangle {number} is there twice with its {side} filled");
            self.report(Finding::NotAnInputTriangle, number as usize, what, report);
        }
        for number in 0..self.surface.triangles.len() {
            let sides = [0, 1].map(|side| get(&self.seen[side], number));
            let is_sheet = self.surface.is_sheet(number as u32);
            let is_support_triangle = self.surface.is_support_triangle(number as u32);
            if sides == [true; 2] || (sides != [false; 2] && !is_sheet) {
                report.triangles_present += u64::from(!is_support_triangle);
            } else if is_sheet {
                report.triangles_missing += u64::from(!is_support_triangle);
                self.report_missing(
                    number,
                    match is_support_triangle {
                        true => "holds an embedded edge and has not a tetrahedron on each side",
                        false => "is part of a sheet and has not a tetrahedron on each side",
                    },
                    report,
                );
            } else if get(&self.seen[2], number) {
                report.triangles_unfilled += 1;
            } else {
                report.triangles_missing += 1;
                self.report_missing(number, "is not in the mesh", report);
            }
        }
    }

    fn report_missing(&self, number: usize, what: &str, report: &mut Report) {
        let what = format!("input triangle {number} {what}");
        self.report(Finding::MissingTriangle, number, what, report);
    }

    fn report(&self, finding: Finding, number: usize, what: String, report: &mut Report) {
        report.find(finding, None, what).with_points(self.surface.corners(number as u32));
    }
}
