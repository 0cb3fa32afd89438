//! Lasting ids of sub-domains, tetrahedra and vertices.
//!
//! Each id is also a number below 2^53, so that programs whose only number is a double can carry it.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// Bits of the local part of a tetrahedron's number.
const TET_BITS: u32 = 29;
/// Owners below this number are cuts (0 is the surface); the others are sub-domains.
const OWNER_SUBDOMAINS: u32 = 1 << 20;

/// The error for a text that is no id.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{text:?} is not {expected}")]
pub struct IdError {
    /// The text as it was given.
    pub text: String,
    /// The expected text.
    pub expected: &'static str,
}

/// Rank of a sub-domain, left to right in the bisection tree. Invariant: below [`SubdomainId::COUNT_MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SubdomainId(u32);

impl SubdomainId {
    /// Largest number of sub-domains of a store: the owners of their vertices must stay below 2^21.
    pub const COUNT_MAX: u32 = 1 << 20;

    /// The sub-domain of this rank; `None` if the rank is too large.
    pub const fn new(rank: u32) -> Option<Self> {
        if rank < Self::COUNT_MAX { Some(Self(rank)) } else { None }
    }

    /// Its rank.
    pub const fn rank(self) -> u32 {
        self.0
    }
}

impl fmt::Display for SubdomainId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// A tetrahedron of a sealed sub-domain, displayed as `7:1048211`. Invariant: `local < LOCAL_MAX`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TetId {
    subdomain: SubdomainId,
    local: u32,
}

impl TetId {
    /// Largest number of tetrahedra of one sub-domain.
    pub const LOCAL_MAX: u32 = 1 << TET_BITS;

    /// Tetrahedron `local` in the sealed order of `subdomain`; `None` if `local` is too large.
    pub const fn new(subdomain: SubdomainId, local: u32) -> Option<Self> {
        if local < Self::LOCAL_MAX { Some(Self { subdomain, local }) } else { None }
    }

    /// Its sub-domain.
    pub const fn subdomain(self) -> SubdomainId {
        self.subdomain
    }

    /// Its position in the sealed order.
    pub const fn local(self) -> u32 {
        self.local
    }

    /// `sub-domain << 29 | local`, below 2^53.
    pub const fn number(self) -> u64 {
        (self.subdomain.0 as u64) << TET_BITS | self.local as u64
    }

    /// The inverse of [`TetId::number`].
    pub const fn from_number(number: u64) -> Option<Self> {
        if number >> (TET_BITS + 20) != 0 {
            return None;
        }
        Some(Self {
            subdomain: SubdomainId((number >> TET_BITS) as u32),
            local: (number & (Self::LOCAL_MAX as u64 - 1)) as u32,
        })
    }
}

impl fmt::Display for TetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.subdomain, self.local)
    }
}

impl FromStr for TetId {
    type Err = IdError;

    fn from_str(text: &str) -> Result<Self, IdError> {
        let parsed = text.split_once(':').and_then(|(subdomain, local)| {
            Self::new(SubdomainId::new(subdomain.parse().ok()?)?, local.parse().ok()?)
        });
        parsed.ok_or_else(|| IdError {
            text: text.to_owned(),
            expected: "a tetrahedron such as 7:1048211",
        })
    }
}

/// The creator of a vertex, which numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Owner {
    /// The welded input.
    Surface,
    /// The cut of this number, 1.., in tree order.
    Cut(u32),
    /// The sub-domain of this rank.
    Subdomain(SubdomainId),
}

impl Owner {
    /// Its number: 0, the cut, or 2^20 + rank.
    pub const fn number(self) -> u32 {
        match self {
            Self::Surface => 0,
            Self::Cut(cut) => cut,
            Self::Subdomain(s) => OWNER_SUBDOMAINS + s.0,
        }
    }

    /// The inverse of [`Owner::number`].
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::Surface),
            1..OWNER_SUBDOMAINS => Some(Self::Cut(number)),
            _ => match SubdomainId::new(number - OWNER_SUBDOMAINS) {
                Some(s) => Some(Self::Subdomain(s)),
                None => None,
            },
        }
    }
}

/// A vertex, the same in every sub-domain that uses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId {
    /// The owner that numbers it.
    pub owner: Owner,
    /// Number within the owner.
    pub index: u32,
}

impl VertexId {
    /// `owner << 32 | index`, below 2^53.
    pub const fn number(self) -> u64 {
        (self.owner.number() as u64) << 32 | self.index as u64
    }

    /// The inverse of [`VertexId::number`].
    pub const fn from_number(number: u64) -> Option<Self> {
        if number >> 53 != 0 {
            return None;
        }
        match Owner::from_number((number >> 32) as u32) {
            Some(owner) => Some(Self { owner, index: number as u32 }),
            None => None,
        }
    }
}

impl fmt::Display for VertexId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.owner {
            Owner::Surface => write!(f, "surface:{}", self.index),
            Owner::Cut(cut) => write!(f, "cut{cut}:{}", self.index),
            Owner::Subdomain(s) => write!(f, "{s}:{}", self.index),
        }
    }
}

impl FromStr for VertexId {
    type Err = IdError;

    fn from_str(text: &str) -> Result<Self, IdError> {
        let parsed = text.split_once(':').and_then(|(owner, index)| {
            let owner = match owner.strip_prefix("cut") {
                Some(cut) => Owner::from_number(cut.parse().ok()?)
                    .filter(|owner| matches!(owner, Owner::Cut(_)))?,
                None if owner == "surface" => Owner::Surface,
                None => Owner::Subdomain(SubdomainId::new(owner.parse().ok()?)?),
            };
            Some(Self { owner, index: index.parse().ok()? })
        });
        parsed.ok_or_else(|| IdError {
            text: text.to_owned(),
            expected: "a vertex such as surface:12, cut3:5 or 7:40",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_are_two_ways_to_write_one_id() {
        let last = SubdomainId::new(SubdomainId::COUNT_MAX - 1).expect("in range");
        for (subdomain, local) in
            [(SubdomainId(7), 1_048_211), (SubdomainId(0), 0), (last, TetId::LOCAL_MAX - 1)]
        {
            let id = TetId::new(subdomain, local).expect("in range");
            assert!(id.number() < 1 << 53);
            assert_eq!(TetId::from_number(id.number()), Some(id));
            assert_eq!(id.to_string().parse(), Ok(id));
        }
        assert_eq!(
            TetId::new(SubdomainId(7), 1_048_211).map(|t| t.to_string()).as_deref(),
            Some("7:1048211")
        );
        for owner in [Owner::Surface, Owner::Cut(3), Owner::Subdomain(last)] {
            let id = VertexId { owner, index: u32::MAX };
            assert!(id.number() < 1 << 53);
            assert_eq!(VertexId::from_number(id.number()), Some(id));
            assert_eq!(id.to_string().parse(), Ok(id));
        }
        for text in ["7", "cut0:1", "cut1048576:1", "surface:x", "surface1:2", ":3"] {
            assert!(text.parse::<VertexId>().is_err(), "{text}");
        }
        assert!("7".parse::<TetId>().is_err() && "7:x".parse::<TetId>().is_err());
        assert_eq!((TetId::from_number(1 << 53), VertexId::from_number(1 << 53)), (None, None));
    }
}
