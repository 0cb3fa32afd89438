//! The interface: a minimum cut of the cutting zone, then moves with costs that are no sums over faces.
//!
//! Labels by the side of the middle give 3.85 faces per h² of the plane, many tetrahedra with two or three of them and pinched
//! vertices. The minimum cut of the dual graph is the best of all interfaces for any cost that is a sum over faces:
//! 2.8 faces per h². Over-constrained tetrahedra and pinched vertices depend on several faces at once; they are reduced by
//! moving all free tetrahedra around an interface vertex to one side, or a single tetrahedron, as long as that gains.
//!
//! Source: the paper, section 1.1, "Choosing the interface", which makes the moves alone.

use super::core::CoreBoundary;
use super::flow::{FlowArc, Graph};
use super::interface_faces::interface_points;
use super::moves::Moves;
use super::side_labels::{InterfaceMeasures, SideLabels, face_cost, measure};
use super::surface::CuttingSurface;
use crate::mesh::{Mesh, Tet, dense};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Pages, check_cancelled, for_each_mut, spare_threads};
use tetdb_schema::page::NONE;

/// Nodes of a graph that is cut at once; wider interfaces are cut strip by strip. Of 593,000 tetrahedra, strips of 400,000 choose 46,024 faces in
/// 7.3 seconds, of 100,000 46,184 in 4.4, of 50,000 46,443 in 3.4. The result depends on it, so it is a constant.
const STRIP: usize = 100_000;
/// Share of a strip on each side of a border that is cut again, because each was cut without the other.
const BORDER: usize = 8;
/// Cost of a tetrahedron of volume h³ on the other side than its middle, for each h between the middle and the plane.
/// Without this cost the least cut as a whole lies anywhere between the limits, 0.15 to 0.4 h off: the parts of a box
/// in 64 had 0.85 to 1.18 of the mean, with it 0.98 to 1.02. It had 1 % fewer faces; for walls between balls 6 %.
const CENTERED: f64 = 1.0;
/// Most that costs, as much as several faces: a tetrahedron on a long triangle of the input may be much larger than h³.
const CENTERED_MOST: f64 = 4.0;
/// Capacities are costs in this fraction.
const SCALE: f64 = 256.0;

/// Report of the choice of an interface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InterfaceReport {
    /// Most bytes held besides the core.
    pub bytes: u64,
    /// Tetrahedra of the cutting zone.
    pub free_tets: u64,
    /// By the side of the middles.
    pub natural: InterfaceMeasures,
    /// After the minimum cut.
    pub minimum: InterfaceMeasures,
    /// In the end.
    pub chosen: InterfaceMeasures,
    /// Moves accepted.
    pub moves: u64,
}

/// Chooses sides, and stores the faces of the natural interface in `natural`. Effects: uses up the core's scratch map;
/// `tet_of` must be right.
pub(super) fn choose<P: Pages>(
    core: &mut Mesh<P>,
    surface: &impl CuttingSurface,
    core_boundary: &CoreBoundary,
    natural: Option<&mut Vec<[Point; 3]>>,
) -> (InterfaceReport, SideLabels) {
    let (labels, free) = SideLabels::new(core, surface, core_boundary);
    if let Some(natural) = natural {
        *natural = interface_points(core, &labels);
    }
    let mut report = InterfaceReport { free_tets: free.len() as u64, ..InterfaceReport::default() };
    let mut moves = Moves::new(core, labels, surface, core_boundary);
    report.natural = measure(core, &moves.labels, core_boundary);
    report.natural.pinched = moves.count_pinched(core, &free);
    report.bytes = minimum_cut(core, &mut moves.labels, surface, &free);
    report.bytes += size_of_val(&free[..]) as u64 + moves.bytes() + moves.labels.bytes();
    report.minimum = measure(core, &moves.labels, core_boundary);
    report.minimum.pinched = moves.count_pinched(core, &free);
    report.moves = moves.run(core, &free);
    report.chosen = measure(core, &moves.labels, core_boundary);
    report.chosen.pinched = moves.count_pinched(core, &free);
    (report, moves.labels)
}

/// Strips that are cut at once, each with a graph of its own of so many bytes, as memory allows.
const AT_ONCE: usize = 2;
const GRAPH_BYTES: u64 = 8 << 20;

/// How many strips are cut at once; the result does not depend on it.
fn strips_at_once<P: Pages>(core: &Mesh<P>) -> usize {
    let room = core.pages().bytes_used().map_or(u64::MAX, |[used, most]| most.saturating_sub(used));
    spare_threads().min((room / 4 / GRAPH_BYTES) as usize).max(AT_ONCE)
}

/// Cuts strip by strip; returns the most bytes held.
fn minimum_cut<P: Pages>(
    core: &mut Mesh<P>,
    labels: &mut SideLabels,
    surface: &impl CuttingSurface,
    free: &[u32],
) -> u64 {
    core.reset_scratch(dense(core.tet_ids_end()), NONE);
    let mut order = free.to_vec();
    let strips = free.len().div_ceil(STRIP).max(1);
    let mut sorting = 0;
    if strips > 1 {
        sorting = sort_along(core, surface, &mut order);
    }
    let length = free.len().div_ceil(strips).max(1);
    let half = length / BORDER;
    // First every other strip, then the strips between, then the regions around the borders: those of one kind do not
    // touch.
    let mut kinds: [Vec<&[u32]>; 3] = [Vec::new(), Vec::new(), Vec::new()];
    for (k, strip) in order.chunks(length).enumerate() {
        kinds[k % 2].push(strip);
    }
    for border in (length..free.len()).step_by(length) {
        kinds[2].push(&order[border - half..free.len().min(border + half)]);
    }
    let at_once = strips_at_once(core);
    let mut cuts: Vec<(Vec<u32>, Graph)> = Vec::new();
    cuts.resize_with(strips.min(at_once), Default::default);
    for strips in kinds.iter().flat_map(|kind| kind.chunks(at_once)) {
        for (&strip, (tets, graph)) in strips.iter().zip(&mut cuts) {
            check_cancelled();
            // In id order, which follows the curve: neighbors in space are near in the graph's memory. The least cut
            // does not depend on the order.
            tets.clear();
            tets.extend_from_slice(strip);
            tets.sort_unstable();
            read_strip(core, labels, surface, tets, graph);
        }
        for_each_mut(&mut cuts[..strips.len()], |(_, graph)| {
            graph.cut();
        });
        for (tets, graph) in &cuts[..strips.len()] {
            label_strip(labels, tets, graph);
        }
    }
    core.clear_scratch();
    let held = cuts.iter().map(|(tets, graph)| 4 * tets.capacity() as u64 + graph.bytes());
    size_of_val(&order[..]) as u64 + sorting.max(held.sum())
}

/// Sorts along the longest direction in the surface, among three; returns the bytes held meanwhile.
fn sort_along<P: Pages>(
    core: &mut Mesh<P>,
    surface: &impl CuttingSurface,
    order: &mut Vec<u32>,
) -> u64 {
    let Some(&first) = order.first() else {
        return 0;
    };
    let tet = core.tet(first);
    let normal = surface.normal(core.points(&tet)[0]);
    let mut axes = [Point::X, Point::Y, Point::Z].map(|a| a - normal * normal.dot(a));
    axes.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let axes = [axes[0].normalize(), normal.cross(axes[0].normalize())];
    let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for &t in order.iter() {
        let tet = core.tet(t);
        let m = super::core::middle(core, &tet);
        for (axis, end) in axes.iter().zip(&mut ends) {
            let s = axis.dot(m);
            *end = [end[0].min(s), end[1].max(s)];
        }
    }
    let longer = usize::from(ends[1][1] - ends[1][0] > ends[0][1] - ends[0][0]);
    let mut keyed: Vec<(f64, u32)> = order
        .iter()
        .map(|&t| {
            let tet = core.tet(t);
            (axes[longer].dot(super::core::middle(core, &tet)), t)
        })
        .collect();
    keyed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    order.clear();
    order.extend(keyed.iter().map(|&(_, t)| t));
    size_of_val(&keyed[..]) as u64
}

/// Builds the graph of a strip; tetrahedra around it are source or sink.
fn read_strip<P: Pages>(
    core: &mut Mesh<P>,
    labels: &SideLabels,
    surface: &impl CuttingSurface,
    strip: &[u32],
    graph: &mut Graph,
) {
    for (node, &t) in strip.iter().enumerate() {
        core.set_scratch(dense(t), node as u32);
    }
    graph.clear();
    for &t in strip {
        let tet = core.tet(t);
        let mut arcs = [FlowArc::NONE; 4];
        let mut capacity = [0; 4];
        let mut terminal = pull(core, &tet, surface);
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            if !across.exists() {
                continue;
            }
            let node = core.scratch(dense(across.tet()));
            if node != NONE && (node as usize) < graph.n_nodes() {
                // The cost was found from the other side.
                arcs[i] = FlowArc::new(node, across.face());
                capacity[i] = graph.capacity(node, across.face());
                continue;
            }
            let corners = tet.face(i).map(|v| core.point(v));
            let cost = symmetric_cost(corners, surface);
            if node != NONE {
                (arcs[i], capacity[i]) = (FlowArc::new(node, across.face()), cost);
            } else {
                terminal[usize::from(labels.is_high(across.tet()))] += cost;
            }
        }
        graph.push(arcs, capacity, terminal);
    }
    for &t in strip {
        core.set_scratch(dense(t), NONE);
    }
}

/// Cost of `tet` on the other side than its middle, as capacities from the source and to the sink.
fn pull<P: Pages>(core: &mut Mesh<P>, tet: &Tet, surface: &impl CuttingSurface) -> [u32; 2] {
    let ends = core.ends(tet);
    let [a, b, c, d] = ends.map(|end| end.point);
    let h = 0.25 * ends.map(|end| f64::from(end.h)).iter().sum::<f64>();
    let share = (b - a).cross(c - a).dot(d - a) / (6.0 * h * h * h);
    let away = surface.distance((a + b + c + d) * 0.25) / h;
    let cost = (CENTERED * share * away.abs()).min(CENTERED_MOST);
    let cost = (SCALE * cost).round() as u32;
    if away < 0.0 { [cost, 0] } else { [0, cost] }
}

/// Labels a strip by the sides of its cut graph.
fn label_strip(labels: &mut SideLabels, strip: &[u32], graph: &Graph) {
    for (node, &t) in strip.iter().enumerate() {
        debug_assert!(labels.is_free(t));
        labels.set_high(t, !graph.is_source_side(node as u32));
    }
}

/// The cost of a face as a whole number, the same from both sides: its corners are taken in the order of their coordinates.
fn symmetric_cost(mut corners: [Point; 3], surface: &impl CuttingSurface) -> u32 {
    corners.sort_unstable_by(|&a, &b| tetdb_base::geom::lex_cmp(a, b));
    (SCALE * face_cost(corners, surface)).round() as u32
}
