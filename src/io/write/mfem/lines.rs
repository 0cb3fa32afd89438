//! Lines of an MFEM file.

use super::super::error::Result;
use super::super::stream::Stream;

/// MFEM's numbers of the two geometries.
pub(super) const TRIANGLE: u64 = 2;
pub(super) const TETRAHEDRON: u64 = 4;

pub(super) fn element(
    stream: &mut Stream,
    attribute: u64,
    geometry: u64,
    vertices: &[u64],
) -> Result<()> {
    stream.integer(attribute, b' ');
    stream.integer(geometry, b' ');
    list(stream, vertices)
}

/// Numbers on a line.
pub(super) fn list(stream: &mut Stream, numbers: &[u64]) -> Result<()> {
    stream.integers(numbers.iter().copied(), b' ', b'\n');
    stream.end()
}

pub(super) fn point(stream: &mut Stream, point: [f64; 3]) -> Result<()> {
    stream.doubles(point, b' ', b'\n');
    stream.end()
}
