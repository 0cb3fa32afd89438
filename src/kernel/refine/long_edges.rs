//! Points that divide long edges.

use std::ops::Range;

use super::candidate::{Candidate, Keyed};
use super::edge_cache::EdgeCache;
use super::field::{Field, Lengths};
use super::pattern::Pattern;
use super::recent::refuses;
use super::worker::Worker;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{EDGE_OF, EDGES, MARK};
use crate::mesh::{End, Mesh, Scan, Tet, scan_parts, tets_of_page};
use crate::reconnect::Shell;
use tetdb_base::geom::{HilbertFrame, Point, mix};
use tetdb_base::storage::{Pages, sort_unstable_by};

/// Edges longer than this, in units of the wanted length, are divided.
const LONG: f64 = std::f64::consts::SQRT_2;
/// Square of a length, in units of the smaller size of its ends, that Simpson's rule never takes for more than [`LONG`].
const SHORT: f64 = LONG * LONG * (1.0 - 1e-9);
/// The same for edges between two fixed vertices: such edges make tetrahedra with four vertices on the surface.
const LONG_FIXED: f64 = 1.0;
/// An edge is cut into at most this many pieces at once: coarse edges cross the same space many times over, and
/// dividing them step by step keeps the cavities of their points small and most candidates useful.
const PIECES_MAX: u32 = 6;
/// Points on edges longer than this are displaced, else they stand in layers (density per 0.25 h: cv 0.14 against 0.05).
const JITTER_FROM: f64 = 2.0;
/// Largest displacement per axis in units of h.
const JITTER: f64 = 0.4;
/// Largest shell that is looked at for required faces.
const SHELL_MAX: usize = 64;
/// Places for edges of a page that were listed already: five tetrahedra have the same one, and sorting is dear.
const SEEN: usize = 1 << 12;
/// Edges divided as one part.
const EDGES_PART: usize = 1 << 12;

impl Worker {
    /// Gathers the edges of the unexamined tetrahedra of some pages, and marks those examined.
    pub(super) fn collect_edges<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        field: &Field,
        pages: &[u32],
    ) {
        self.edges.clear();
        let edges = LongEdges { field, settled: &self.settled, examined_too: self.examined_too };
        let found = scan_parts(mesh, pages, &edges);
        for (&page, edges) in pages.iter().zip(found) {
            if let Some(edges) = edges {
                self.edges.extend(edges);
                mark_examined(mesh, page);
            }
        }
        sort_unstable_by(&mut self.edges, Edge::cmp);
        self.edges.dedup_by_key(|e| e.0);
    }

    /// The points that divide the gathered edges.
    pub(super) fn make_candidates<P: Pages>(&mut self, mesh: &mut Mesh<P>, field: &Field) {
        self.candidates.set(Vec::new());
        let n = self.edges.len();
        let starts = (0..n).step_by(EDGES_PART);
        let parts: Vec<Range<usize>> = starts.map(|i| i..n.min(i + EDGES_PART)).collect();
        let division =
            Division { edges: &self.edges, field, order: &self.order, placing: self.placing };
        let found = scan_parts(mesh, &parts, &division);
        let candidates = found.into_iter().map(|(candidates, settled)| {
            for edge in settled {
                self.settled.add(edge);
            }
            candidates
        });
        self.candidates.set(candidates.collect());
    }
}

/// An edge as an ordered pair of vertices, and a tetrahedron that has it.
type Edge = (u64, u32);

/// Lists the edges of a page's unexamined tetrahedra that may be long; none when all are examined or out of reach, so that the page need not
/// be changed.
struct LongEdges<'a> {
    field: &'a Field<'a>,
    settled: &'a EdgeCache,
    examined_too: bool,
}

impl Scan for LongEdges<'_> {
    type Part = u32;
    type Output = Option<Vec<Edge>>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Option<Vec<Edge>> {
        let mut found: Option<(Vec<Edge>, EdgeCache)> = None;
        tets_of_page(mesh, page, |mesh, t, tet| {
            if self.examined_too || tet.node[EXAMINED] & MARK == 0 {
                let ends = mesh.ends(&tet);
                if self.field.reaches(&ends) {
                    let found = found.get_or_insert_with(|| (Vec::new(), EdgeCache::new(SEEN)));
                    self.list(t, &tet, &ends, found);
                }
            }
        });
        found.map(|(edges, _)| edges)
    }
}

impl LongEdges<'_> {
    #[inline(always)]
    fn list(&self, t: u32, tet: &Tet, ends: &[End; 4], (edges, seen): &mut (Vec<Edge>, EdgeCache)) {
        // Which edges are long is as good as random: all are looked at before any is listed.
        let mut listed = 0u32;
        for (k, [i, j]) in EDGES.into_iter().enumerate() {
            let fixed = ends[i].fixed & ends[j].fixed;
            listed |= u32::from(fixed | may_be_long(&ends[i], &ends[j])) << k;
        }
        let v = tet.vertices();
        while listed != 0 {
            let [i, j] = EDGES[listed.trailing_zeros() as usize];
            listed &= listed - 1;
            let fixed = ends[i].fixed && ends[j].fixed;
            let (a, b) = (v[i].min(v[j]), v[i].max(v[j]));
            let edge = u64::from(a) << 32 | u64::from(b);
            // Of several tetrahedra with an edge the first counts.
            if seen.add(edge) && !(fixed && self.settled.has(edge)) {
                edges.push((edge, t));
            }
        }
    }
}

fn mark_examined<P: Pages>(mesh: &mut Mesh<P>, page: u32) {
    tets_of_page(mesh, page, |mesh, t, tet| {
        if tet.node[EXAMINED] & MARK == 0 {
            mesh.set_mark(t, EXAMINED, true);
        }
    });
}

/// What became of an edge.
#[derive(PartialEq)]
enum Verdict {
    /// It joins fixed vertices, and will never be divided.
    Settled,
    /// It was divided, or may be another time.
    Open,
}

/// Finds the points that divide edges, and the edges that are settled.
struct Division<'a> {
    edges: &'a [Edge],
    field: &'a Field<'a>,
    order: &'a HilbertFrame,
    placing: bool,
}

impl Scan for Division<'_> {
    type Part = Range<usize>;
    type Output = (Keyed, Vec<u64>);

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, part: &Range<usize>) -> Self::Output {
        let mut divider = Divider {
            field: self.field,
            order: self.order,
            pattern: self.placing.then(Pattern::new),
            shell: Shell::default(),
            points: Vec::new(),
            found: Keyed::default(),
        };
        let mut settled = Vec::new();
        for &(edge, tet) in &self.edges[part.clone()] {
            if divider.divide(mesh, edge, tet) == Verdict::Settled {
                settled.push(edge);
            }
        }
        divider.found.candidates.shrink_to_fit();
        (divider.found, settled)
    }
}

/// Divides edges one after another.
struct Divider<'a> {
    field: &'a Field<'a>,
    order: &'a HilbertFrame,
    pattern: Option<Pattern>,
    shell: Shell,
    /// Points of the edge at hand.
    points: Vec<Candidate>,
    found: Keyed,
}

impl Divider<'_> {
    fn divide<P: Pages>(&mut self, mesh: &mut Mesh<P>, edge: u64, tet: u32) -> Verdict {
        let field = self.field;
        let (a, b) = ((edge >> 32) as u32, edge as u32);
        let (pa, ha) = mesh.point_and_size(a);
        let (pb, hb) = mesh.point_and_size(b);
        let (ha, hb) = (f64::from(ha), f64::from(hb));
        let length = (pb - pa).length();
        let length_at = |u: f64, p: Point| match field.lengths {
            Lengths::Field => (field.h)(p),
            Lengths::Ends => ha + (hb - ha) * u,
        };
        // Simpson's rule with the arithmetic mean in the middle: 1 % high at a ratio of two.
        let mut metric = length * (1.0 / ha + 8.0 / (ha + hb) + 1.0 / hb) / 6.0;
        let mut long = LONG;
        let fixed = mesh.is_fixed(a) && mesh.is_fixed(b);
        if fixed {
            long = LONG_FIXED;
            // Both ends only know the surface; the middle may want less.
            let hm = length_at(0.5, (pa + pb) * 0.5);
            metric = metric.max(length * (1.0 / ha + 4.0 / hm + 1.0 / hb) / 6.0);
        }
        if metric <= long || fixed && self.is_required(mesh, a, b, tet) {
            return if fixed { Verdict::Settled } else { Verdict::Open };
        }
        let sizes = match field.lengths {
            Lengths::Field => [ha, hb],
            Lengths::Ends => [f64::INFINITY; 2],
        };
        let Some([from, to]) = field.place.stretch(pa, pb, sizes) else {
            return Verdict::Open;
        };
        // An edge short enough is divided as it is everywhere; of a long one only the stretch counts, so that its
        // few pieces at a time do not step over the place.
        let whole = metric <= f64::from(PIECES_MAX) || to - from >= 1.0;
        let class = if metric > 4.0 {
            0
        } else if metric > JITTER_FROM {
            1
        } else {
            2
        };
        self.points.clear();
        let mut try_point = |u: f64| {
            let mut point = pa + (pb - pa) * u;
            let mut h = length_at(u, point);
            let pattern = self.pattern.as_mut();
            if let Some(place) = pattern.and_then(|pattern| pattern.nearest(field, point, h)) {
                point = place;
                h = length_at(u, point);
            } else if metric > JITTER_FROM {
                point += jitter(point) * (JITTER * h);
                h = length_at(u, point);
            }
            if field.place.admits(point, h) {
                let h = h as f32;
                self.points.push(Candidate { point, h, tet });
            }
        };
        if whole {
            let pieces = (metric.round() as u32).clamp(2, PIECES_MAX);
            for k in 1..pieces {
                let u = division(f64::from(k) / f64::from(pieces), hb / ha);
                try_point(u);
            }
        } else {
            let u = 0.5 * (from + to);
            let middle = length_at(u, pa + (pb - pa) * u);
            let pieces = ((to - from) * length / middle).round() as u32;
            let pieces = pieces.clamp(1, PIECES_MAX);
            for k in 0..pieces {
                let u = from + (to - from) * ((f64::from(k) + 0.5) / f64::from(pieces));
                try_point(u);
            }
        }
        self.drop_near(mesh, a, b, tet);
        for candidate in self.points.drain(..) {
            let place = self.order.index(candidate.point) >> 2;
            self.found.candidates.push(candidate);
            self.found.keys.push(class << 62 | place);
        }
        Verdict::Open
    }

    /// Drops the points that are too near to a vertex around the edge a b of `tet`.
    ///
    /// Vertices stay where they are while edges are divided, so these points would be refused when their turn comes, at ten times the cost: of balls
    /// seven points in ten are too near to be inserted, and three quarters of those are found here.
    fn drop_near<P: Pages>(&mut self, mesh: &mut Mesh<P>, a: u32, b: u32, tet: u32) {
        let record = mesh.tet(tet);
        let corners = record.vertices();
        for v in corners {
            self.drop_near_to(mesh, v);
        }
        let (Some(i), Some(j)) = (record.local(a), record.local(b)) else {
            return;
        };
        if !self.points.is_empty()
            && (self.shell).gather_from(mesh, tet, &record, EDGE_OF[i][j], SHELL_MAX)
        {
            for k in 0..self.shell.ring.len() {
                let v = self.shell.ring[k];
                if !corners.contains(&v) {
                    self.drop_near_to(mesh, v);
                }
            }
        }
    }

    #[inline]
    fn drop_near_to<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32) {
        let (q, h) = mesh.point_and_size(v);
        self.points.retain(|c| !refuses((q - c.point).length_squared(), h, c));
    }

    /// Whether the edge a b of `tet` belongs to a required face: its points would lie in that face.
    fn is_required<P: Pages>(&mut self, mesh: &mut Mesh<P>, a: u32, b: u32, tet: u32) -> bool {
        let record = mesh.tet(tet);
        let (Some(i), Some(j)) = (record.local(a), record.local(b)) else {
            return false;
        };
        // A shell too large to be gathered is worth its candidate.
        self.shell.gather_from(mesh, tet, &record, EDGE_OF[i][j], SHELL_MAX)
            && (self.shell.required || !self.shell.closed)
    }
}

/// Whether an edge with an end that is not fixed has to be looked at: most are too short whatever the size between their ends, and
/// need no sorting.
#[inline(always)]
fn may_be_long(a: &End, b: &End) -> bool {
    let least = f64::from(if a.h < b.h { a.h } else { b.h });
    (a.point - b.point).length_squared() > SHORT * least * least
}

/// Parameter along an edge at the fraction `f` of its metric length, sizes growing from 1 to `r`.
///
/// For a linear size this is (r^f - 1) / (r - 1); the quadratic here has its value and slope in the middle to a
/// few percent for ratios up to four, which later divisions correct.
fn division(f: f64, r: f64) -> f64 {
    let skew = ((r - 1.0) / (r + 1.0)).clamp(-0.6, 0.6);
    f - skew * f * (1.0 - f)
}

/// Three numbers in [-1, 1) from the bits of a position.
fn jitter(p: Point) -> Point {
    let mut state =
        p.to_array().into_iter().fold(0x6A69_7474_6572_u64, |s, c| mix(s ^ c.to_bits()));
    let mut next = || {
        state = mix(state);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    Point::new(next(), next(), next())
}
