//! What is asked for, and what of it follows from summaries.

use tetdb_schema::chunk::TetSummary;
use tetdb_schema::ids::TetId;

use super::hit::{EXCESS, Hit, ranges};
use super::solid::Solid;
use crate::sealed::input_index;
use tetdb_base::expr::Expression;
use tetdb_base::geom::{Aabb, Point};

/// Tetrahedra that all of this holds of; by default, all.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// They meet each of these.
    pub solids: Vec<Solid>,
    /// They even lie wholly in each of them.
    pub inside: bool,
    /// Their sub-domain is one of these ranks.
    pub subdomains: Option<Vec<u32>>,
    /// Their region is one of these.
    pub regions: Option<Vec<u32>>,
    /// They are among these.
    pub tets: Option<Vec<TetId>>,
    /// They have a face on an input triangle with one of these labels.
    pub labels: Option<Vec<u32>>,
    /// They have a vertex of the input.
    pub touching_surface: bool,
    /// They have a face on a sheet.
    pub touching_sheet: bool,
    /// They have a face on the interface of these two sub-domains.
    pub interface: Option<[u32; 2]>,
    /// They share a vertex, an edge or a face with these.
    pub sharing: Option<Sharing>,
    /// A truth about the [`VARIABLES`](super::VARIABLES).
    pub condition: Option<Expression>,
    /// Whether the excess of what is found is asked for, be it in no condition.
    pub excess: bool,
}

/// Vertices, of which a tetrahedron has some.
#[derive(Clone, Debug)]
pub struct Sharing {
    pub(super) vertices: Vec<(u64, Point)>,
    /// So many of them at least.
    pub(super) at_least: usize,
    /// Not this one.
    pub(super) except: Option<TetId>,
}

impl Sharing {
    /// Whether tetrahedra within `bounds` may have that many.
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
    /// Whether a sub-domain with this box may have any.
    pub(super) fn may_be_in(&self, rank: u32, bounds: &Aabb) -> bool {
        let named = |list: &Option<Vec<u32>>| list.as_ref().is_none_or(|l| l.contains(&rank));
        named(&self.subdomains)
            && self.interface.is_none_or(|pair| pair.contains(&rank))
            && self.tets.as_ref().is_none_or(|l| l.iter().any(|t| t.subdomain().rank() == rank))
            && self.may_meet(bounds)
    }

    /// Whether a chunk of a sub-domain may have any.
    pub(super) fn may_be_among(&self, rank: u32, chunk: &TetSummary) -> bool {
        let [low, high] = chunk.bounds.map(Point::from_array);
        let [least, most] = chunk.regions;
        let within = |r: &u32| (least..=most).contains(r);
        let end = chunk.first + chunk.count;
        let listed =
            |t: &TetId| t.subdomain().rank() == rank && (chunk.first..end).contains(&t.local());
        self.regions.as_ref().is_none_or(|l| l.iter().any(within))
            && self.tets.as_ref().is_none_or(|l| l.iter().any(listed))
            && self.may_meet(&Aabb { low, high })
            && self.condition.as_ref().is_none_or(|e| e.may_hold(&ranges(chunk, rank)))
    }

    /// Whether tetrahedra within `bounds` may be where they are asked for.
    pub(super) fn may_meet(&self, bounds: &Aabb) -> bool {
        self.solids.iter().all(|s| s.may_meet(bounds))
            && self.sharing.as_ref().is_none_or(|s| s.may_meet(bounds))
    }

    /// Whether the faces on the surface have to be known.
    pub(super) fn needs_surface(&self) -> bool {
        self.excess || (self.condition.as_ref()).is_some_and(|e| e.names(EXCESS))
    }

    /// Whether anything is asked about places.
    pub(super) fn is_local(&self) -> bool {
        !self.solids.is_empty() || self.sharing.is_some()
    }

    /// Whether its number and region suit.
    pub(super) fn may_be(&self, id: TetId, region: u32) -> bool {
        self.regions.as_ref().is_none_or(|l| l.contains(&region))
            && self.tets.as_ref().is_none_or(|l| l.contains(&id))
    }

    /// Whether all that is asked of a tetrahedron's vertices holds.
    pub(super) fn holds(&self, tet: &Hit) -> bool {
        let solid = |s: &Solid| match self.inside {
            true => s.holds(&tet.corners),
            false => s.meets(&tet.corners),
        };
        let is_input = |v: &u64| input_index(*v).is_some();
        self.solids.iter().all(solid)
            && (!self.touching_surface || tet.vertices.iter().any(is_input))
            && self.sharing.as_ref().is_none_or(|s| s.holds(tet.id, &tet.vertices))
            && self.condition.as_ref().is_none_or(|e| e.truth(&tet.values()))
    }
}
