//! Conditions on tetrahedra, and their consequences for summaries.

use tetdb_schema::chunk::TetSummary;
use tetdb_schema::field::Scalar;
use tetdb_schema::ids::TetId;

use super::extra::ExtraVariable;
use super::hit::{EXCESS, Hit, NAN_AT, ranges};
use super::solid::Solid;
use crate::sealed::input_index;
use tetdb_base::expr::Expression;
use tetdb_base::geom::{Aabb, Point};

/// Conditions that a tetrahedron must satisfy together; by default none.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// The tetrahedron meets each of these solids.
    pub solids: Vec<Solid>,
    /// The tetrahedron is wholly in each of the solids.
    pub inside: bool,
    /// The rank of its sub-domain is one of these.
    pub subdomains: Option<Vec<u32>>,
    /// The number of its region is one of these.
    pub regions: Option<Vec<u32>>,
    /// The tetrahedron is one of these.
    pub tets: Option<Vec<TetId>>,
    /// It has a face on an input triangle with one of these labels.
    pub labels: Option<Vec<u32>>,
    /// It has a vertex of the input.
    pub touching_surface: bool,
    /// It has a face on a sheet.
    pub touching_sheet: bool,
    /// It has a face on the interface of these two sub-domains.
    pub interface: Option<[u32; 2]>,
    /// It shares vertices with these.
    pub sharing: Option<Sharing>,
    /// A condition on the [`VARIABLES`](super::VARIABLES).
    pub condition: Option<Expression>,
    /// True if the excess of the hits is needed, also without a condition on it.
    pub excess: bool,
    /// Variables of the condition behind [`VARIABLES`](super::VARIABLES).
    pub condition_extra: Vec<ExtraVariable>,
    /// Variables that the hits are to have, at most [`EXTRA_MAX`](super::EXTRA_MAX).
    pub extra: Vec<ExtraVariable>,
    /// Only the chunks of one of several shares: its number, and how many there are.
    pub share: Option<[usize; 2]>,
    /// True if questions about places nearby follow: chunks stay decoded where the memory is enough. Answers are the same.
    pub stays_decoded: bool,
}

/// Vertices, some of which a tetrahedron must have.
#[derive(Clone, Debug)]
pub struct Sharing {
    pub(super) vertices: Vec<(u64, Point)>,
    /// Least number of shared vertices.
    pub(super) at_least: usize,
    /// A tetrahedron to leave out.
    pub(super) except: Option<TetId>,
}

impl Sharing {
    /// Returns whether tetrahedra within `bounds` may have as many of the vertices.
    fn may_meet(&self, bounds: &Aabb) -> bool {
        let inside = |p: &Point| bounds.low.cmple(*p).all() && p.cmple(bounds.high).all();
        self.vertices.iter().filter(|(_, p)| inside(p)).count() >= self.at_least
    }

    fn holds(&self, id: TetId, vertices: &[u64; 4]) -> bool {
        let shared = self.vertices.iter().filter(|(v, _)| vertices.contains(v));
        self.except != Some(id) && shared.count() >= self.at_least
    }
}

impl Selection {
    /// Returns whether a sub-domain with this box may have hits.
    pub(super) fn may_be_in(&self, rank: u32, bounds: &Aabb) -> bool {
        let named = |list: &Option<Vec<u32>>| list.as_ref().is_none_or(|l| l.contains(&rank));
        named(&self.subdomains)
            && self.interface.is_none_or(|pair| pair.contains(&rank))
            && self.tets.as_ref().is_none_or(|l| l.iter().any(|t| t.subdomain().rank() == rank))
            && self.may_meet(bounds)
    }

    /// Returns whether a chunk of a sub-domain may have hits.
    pub(super) fn may_be_among(
        &self,
        rank: u32,
        chunk: &TetSummary,
        extra: (&[[f64; 2]], &[bool]),
    ) -> bool {
        let [low, high] = chunk.bounds.map(Point::from_array);
        let [least, most] = chunk.regions;
        let within = |r: &u32| (least..=most).contains(r);
        let end = chunk.first + chunk.count;
        let listed =
            |t: &TetId| t.subdomain().rank() == rank && (chunk.first..end).contains(&t.local());
        self.regions.as_ref().is_none_or(|l| l.iter().any(within))
            && self.tets.as_ref().is_none_or(|l| l.iter().any(listed))
            && self.may_meet(&Aabb { low, high })
            && self.condition.as_ref().is_none_or(|e| may_hold(e, &ranges(chunk, rank), extra))
    }

    /// Returns whether all tetrahedra of a chunk are hits for sure.
    pub(super) fn holds_for_all(
        &self,
        rank: u32,
        chunk: &TetSummary,
        (extra, extra_nan): (&[[f64; 2]], &[bool]),
    ) -> bool {
        let others = self.is_local() || self.touching_surface || self.touching_sheet;
        let lists = self.regions.is_some() || self.tets.is_some() || self.labels.is_some();
        if others || lists || self.interface.is_some() {
            return false;
        }
        self.condition.as_ref().is_none_or(|condition| {
            let own = ranges(chunk, rank);
            let nan = [&NAN_AT[..], extra_nan].concat();
            condition.must_hold_with(&[&own, extra].concat(), &nan)
        })
    }

    /// Returns whether tetrahedra within `bounds` may satisfy the conditions on places.
    pub(super) fn may_meet(&self, bounds: &Aabb) -> bool {
        self.solids.iter().all(|s| s.may_meet(bounds))
            && self.sharing.as_ref().is_none_or(|s| s.may_meet(bounds))
    }

    /// Returns whether the faces on the surface are needed.
    pub(super) fn needs_surface(&self) -> bool {
        self.excess || (self.condition.as_ref()).is_some_and(|e| e.names(EXCESS))
    }

    /// Returns whether there is a condition on places.
    pub(super) fn is_local(&self) -> bool {
        !self.solids.is_empty() || self.sharing.is_some()
    }

    /// Returns whether id and region satisfy the conditions.
    pub(super) fn may_be(&self, id: TetId, region: u32) -> bool {
        self.regions.as_ref().is_none_or(|l| l.contains(&region))
            && self.tets.as_ref().is_none_or(|l| l.contains(&id))
    }

    /// Returns whether a tetrahedron with these corners satisfies the conditions on its place.
    pub(super) fn meets(&self, corners: &[Point; 4]) -> bool {
        self.solids.iter().all(|solid| match self.inside {
            true => solid.holds(corners),
            false => solid.meets(corners),
        })
    }

    /// Returns whether a tetrahedron in its place satisfies the conditions on its vertices and values.
    ///
    /// `extra`: values of the condition's extra variables.
    pub(super) fn holds(&self, tet: &Hit, extra: &[Scalar]) -> bool {
        let is_input = |v: &u64| input_index(*v).is_some();
        (!self.touching_surface || tet.vertices.iter().any(is_input))
            && self.sharing.as_ref().is_none_or(|s| s.holds(tet.id, &tet.vertices))
            && self.condition.as_ref().is_none_or(|e| truth(e, tet, extra))
    }
}

fn may_hold(
    condition: &Expression,
    own: &[[f64; 2]],
    (extra, nan): (&[[f64; 2]], &[bool]),
) -> bool {
    if extra.is_empty() {
        return condition.may_hold(own);
    }
    let nan = [&vec![false; own.len()][..], nan].concat();
    condition.may_hold_with(&[own, extra].concat(), &nan)
}

fn truth(condition: &Expression, tet: &Hit, extra: &[Scalar]) -> bool {
    let named = tet.values_of(|variable| condition.names(variable));
    if extra.is_empty() {
        return condition.truth(&named);
    }
    let mut values = named.to_vec();
    values.extend(extra.iter().map(|value| value.to_f64()));
    condition.truth(&values)
}
