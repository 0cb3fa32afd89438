//! Numbers that look random, made of numbers: the same on every machine.

/// Mixes the bits of `v`: one step of SplitMix64 from the state `v`.
///
/// Source: G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
#[inline]
pub fn mix(v: u64) -> u64 {
    let mut z = v.wrapping_add(STEP);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}

/// What SplitMix64 adds to its state at each step.
pub const STEP: u64 = 0x9E37_79B9_7F4A_7C15;
