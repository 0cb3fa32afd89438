//! Records whose bytes have the order of the records.

/// A record of an external sort: its bytes, compared one after the other, have its order.
///
/// `sort_record!` writes this for a struct: fields one after the other, without gaps, numbers
/// big-endian. So records sort by their first field, equal ones by the second, and so on.
pub trait SortRecord: Copy + Send + Sync {
    /// `[u8; N]`.
    type Bytes: SortBytes;
    /// The record as bytes.
    fn to_bytes(&self) -> Self::Bytes;
    /// The record of these bytes.
    fn from_bytes(bytes: &Self::Bytes) -> Self;
}

/// An array of bytes.
pub trait SortBytes: AsRef<[u8]> + AsMut<[u8]> + Copy + Ord + Send + Sync {
    /// All bytes zero.
    const ZERO: Self;
}

impl<const N: usize> SortBytes for [u8; N] {
    const ZERO: Self = [0; N];
}

/// Bytes as they are.
impl<const N: usize> SortRecord for [u8; N] {
    type Bytes = Self;

    fn to_bytes(&self) -> Self {
        *self
    }

    fn from_bytes(bytes: &Self) -> Self {
        *bytes
    }
}

/// A field of a [`SortRecord`].
pub trait SortField: Copy {
    /// Number of bytes.
    const BYTES: usize;
    /// Writes it into exactly so many bytes.
    fn put(self, bytes: &mut [u8]);
    /// Reads it back.
    fn get(bytes: &[u8]) -> Self;
}

macro_rules! big_endian {
    ($($number:ty),*) => {$(
        impl SortField for $number {
            const BYTES: usize = size_of::<Self>();

            #[inline(always)]
            fn put(self, bytes: &mut [u8]) {
                bytes.copy_from_slice(&self.to_be_bytes());
            }

            #[inline(always)]
            fn get(bytes: &[u8]) -> Self {
                Self::from_be_bytes(bytes.try_into().expect("a field gets its bytes"))
            }
        }
    )*};
}

big_endian!(u8, u32, u64);

impl SortField for bool {
    const BYTES: usize = 1;

    #[inline(always)]
    fn put(self, bytes: &mut [u8]) {
        bytes[0] = u8::from(self);
    }

    #[inline(always)]
    fn get(bytes: &[u8]) -> Self {
        bytes[0] != 0
    }
}

/// In the order of [`f64::total_cmp`].
impl SortField for f64 {
    const BYTES: usize = 8;

    #[inline(always)]
    fn put(self, bytes: &mut [u8]) {
        total_order(self).put(bytes);
    }

    #[inline(always)]
    fn get(bytes: &[u8]) -> Self {
        let ordered = u64::get(bytes);
        let bits = if ordered >> 63 == 1 { ordered ^ (1 << 63) } else { !ordered };
        Self::from_bits(bits)
    }
}

/// A number that orders as [`f64::total_cmp`] does: bits of negative numbers inverted, the others above them.
#[inline(always)]
pub fn total_order(x: f64) -> u64 {
    let bits = x.to_bits();
    bits ^ if bits >> 63 == 1 { u64::MAX } else { 1 << 63 }
}

impl<T: SortField, const N: usize> SortField for [T; N] {
    const BYTES: usize = N * T::BYTES;

    #[inline(always)]
    fn put(self, bytes: &mut [u8]) {
        for (place, x) in bytes.chunks_exact_mut(T::BYTES).zip(self) {
            x.put(place);
        }
    }

    #[inline(always)]
    fn get(bytes: &[u8]) -> Self {
        std::array::from_fn(|i| T::get(&bytes[i * T::BYTES..][..T::BYTES]))
    }
}

/// Payload of a record: its bytes in memory order. Their order has no meaning, but is always the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload<T>(pub T);

impl<T: bytemuck::Pod> SortField for Payload<T> {
    const BYTES: usize = size_of::<T>();

    #[inline(always)]
    fn put(self, bytes: &mut [u8]) {
        bytes.copy_from_slice(bytemuck::bytes_of(&self.0));
    }

    #[inline(always)]
    fn get(bytes: &[u8]) -> Self {
        Self(bytemuck::pod_read_unaligned(bytes))
    }
}

/// Defines a struct that is a [`SortRecord`]: it sorts by its fields from the first to the last.
#[macro_export]
macro_rules! sort_record {
    ($(#[$meta:meta])* $vis:vis struct $name:ident {
        $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $type:ty,)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct $name {
            $($(#[$field_meta])* $field_vis $field: $type,)*
        }

        impl $crate::storage::SortRecord for $name {
            type Bytes = [u8; 0 $(+ <$type as $crate::storage::SortField>::BYTES)*];

            #[inline(always)]
            fn to_bytes(&self) -> Self::Bytes {
                use $crate::storage::{SortBytes, SortField};
                let mut bytes = Self::Bytes::ZERO;
                let rest = &mut bytes[..];
                $(
                    let (place, rest) = rest.split_at_mut(<$type>::BYTES);
                    self.$field.put(place);
                )*
                let _ = rest;
                bytes
            }

            #[inline(always)]
            fn from_bytes(bytes: &Self::Bytes) -> Self {
                use $crate::storage::SortField;
                let rest = &bytes[..];
                $(
                    let (place, rest) = rest.split_at(<$type>::BYTES);
                    let $field = <$type>::get(place);
                )*
                let _ = rest;
                Self { $($field),* }
            }
        }
    };
}
pub use crate::sort_record;

sort_record! {
    /// A number of something, and the key it is sorted by.
    #[derive(Eq)]
    pub struct KeyedId {
        /// The primary key.
        pub key: u64,
        /// The number of the item.
        pub id: u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    sort_record! {
        struct Sample {
            number: bool,
            x: f64,
            words: [u32; 2],
            last: u8,
        }
    }

    #[test]
    fn bytes_have_the_order_of_the_fields() {
        let numbers = [f64::NEG_INFINITY, -2.5, -1e-300, -0.0, 0.0, 3.0, f64::NAN];
        let mut samples = Vec::new();
        for number in [false, true] {
            for x in numbers {
                for words in [[0, 9], [1, 0], [256, 255]] {
                    samples.extend([0, 255].map(|last| Sample { number, x, words, last }));
                }
            }
        }
        for pair in samples.windows(2) {
            assert!(pair[0].to_bytes() < pair[1].to_bytes(), "{pair:?}");
        }
        for sample in samples {
            let back = Sample::from_bytes(&sample.to_bytes());
            assert_eq!(back.x.to_bits(), sample.x.to_bits());
            assert_eq!(
                (back.number, back.words, back.last),
                (sample.number, sample.words, sample.last)
            );
        }
    }
}
