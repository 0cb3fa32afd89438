//! Numbers as differences, each to the one before.

use super::columns::{Columns, Malformed, Reader, unzigzag32, unzigzag64, zigzag32, zigzag64};

/// Differences of 32-bit numbers, zigzag.
pub(super) fn steps32(values: impl Iterator<Item = u32>) -> impl Iterator<Item = u32> {
    let mut base = 0;
    values.map(move |value| zigzag32(value, std::mem::replace(&mut base, value)))
}

/// Differences of 64-bit numbers, zigzag.
pub(super) fn steps64(values: impl Iterator<Item = u64>) -> impl Iterator<Item = u64> {
    let mut base = 0;
    values.map(move |value| zigzag64(value, std::mem::replace(&mut base, value)))
}

/// The inverse of [`steps32`].
pub(super) fn walk32(steps: impl Iterator<Item = u32>) -> impl Iterator<Item = u32> {
    steps.scan(0, |base, step| {
        *base = unzigzag32(step, *base);
        Some(*base)
    })
}

/// The inverse of [`steps64`].
pub(super) fn walk64(steps: impl Iterator<Item = u64>) -> impl Iterator<Item = u64> {
    steps.scan(0, |base, step| {
        *base = unzigzag64(step, *base);
        Some(*base)
    })
}

/// Differences as varints.
pub(super) fn put_steps32(values: impl Iterator<Item = u32>, columns: &mut Columns) {
    columns.varints32(steps32(values));
}

/// The same of 64-bit numbers.
pub(super) fn put_steps64(values: impl Iterator<Item = u64>, columns: &mut Columns) {
    steps64(values).for_each(|step| columns.varint(step));
}

/// The inverse of [`put_steps32`]: calls `each` with places and numbers.
pub(super) fn take_steps32(
    columns: &mut Reader<'_>,
    count: usize,
    mut each: impl FnMut(usize, u32),
) -> Result<(), Malformed> {
    let mut base = 0;
    for i in 0..count {
        base = unzigzag32(columns.varint32()?, base);
        each(i, base);
    }
    Ok(())
}

/// The inverse of [`put_steps64`]: calls `each` with places and numbers.
pub(super) fn take_steps64(
    columns: &mut Reader<'_>,
    count: usize,
    mut each: impl FnMut(usize, u64),
) -> Result<(), Malformed> {
    let mut base = 0;
    for i in 0..count {
        base = unzigzag64(columns.varint()?, base);
        each(i, base);
    }
    Ok(())
}

/// Coordinates, an axis after the other: the high bytes of neighboring ones agree, the low ones are noise kept as it is.
pub(super) fn put_points(points: impl Iterator<Item = [f64; 3]> + Clone, columns: &mut Columns) {
    let mut steps = Vec::new();
    for axis in 0..3 {
        steps.clear();
        steps.extend(steps64(points.clone().map(|p| p[axis].to_bits())));
        columns.planes(&steps, 8);
    }
}

/// The inverse of [`put_points`]: calls `each` with places, axes and coordinates.
pub(super) fn take_points(
    columns: &mut Reader<'_>,
    count: usize,
    mut each: impl FnMut(usize, usize, f64),
) -> Result<(), Malformed> {
    for axis in 0..3 {
        let bits = walk64(columns.planes(count, 8)?.into_iter());
        for (i, bits) in bits.enumerate() {
            each(i, axis, f64::from_bits(bits));
        }
    }
    Ok(())
}
