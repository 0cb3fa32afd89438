//! TetGen `.smesh` and `.poly`, with the points in the file or in the `.node` file beside it.
//!
//! A facet is what its polygons enclose, without the parts around its hole points. Polygons of two corners are edges to embed.
//! Points that mark holes and regions of the volume become seeds; a region gets the name `attribute_N` of its attribute, and a
//! length from its largest volume.

use std::collections::HashSet;
use std::io::BufRead;
use std::path::Path;

use super::embedded_sink::EmbeddedSink;
use super::feed::{Feed, name, parse};
use super::{FilePlace, ReadFault, Result, SurfaceSink, open};
use tetdb_base::geom::Point;
use tetdb_base::surface::{NoteKind, Seed, SeedKind, SurfaceError, VolumePoints};

/// The two layouts of the facet part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FacetLayout {
    /// One polygon per facet, the boundary marker after it.
    Smesh,
    /// Facets of several polygons and holes, the marker before them.
    Poly,
}

/// The numbering of points: the first one's number and how many.
#[derive(Clone, Copy)]
pub(super) struct Numbering {
    pub first: i64,
    pub n: u64,
}

pub(super) fn read<R: BufRead>(
    mut feed: Feed<R>,
    kind: FacetLayout,
    nodes: Option<&Path>,
    limit: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    feed.comment = Some(b'#');
    let numbering = match surface_points(&mut feed, target)? {
        Some(numbering) => numbering,
        None => read_node_file(&feed, nodes, limit, target)?,
    };
    let n_facets = feed.count("facets", 4)?;
    feed.skip_line()?;
    let (mut n_cut, mut n_edges) = (0, 0);
    for i in 0..n_facets {
        feed.need_record("facets", n_facets, i)?;
        let place = feed.place();
        match kind {
            FacetLayout::Smesh => {
                let corners = read_polygon(&mut feed, numbering)?;
                if corners.len() < 3 {
                    return Err(feed.unsupported(format!("a polygon of {} corners", corners.len())));
                }
                let marker = rest_of_line(&mut feed)?.pop().unwrap_or(0);
                add(&feed, &corners, marker, target)?;
            }
            FacetLayout::Poly => {
                let facet = read_facet(&mut feed, numbering)?;
                for polygon in &facet.polygons {
                    if let [a, b] = polygon[..] {
                        target.builder.edge([a, b]);
                        n_edges += 1;
                    }
                }
                n_cut += u64::from(add_facet(&place, &facet, target)?);
            }
        }
    }
    if n_cut > 0 {
        target.builder.note(NoteKind::CutFacets { n: n_cut });
    }
    if n_edges > 0 {
        target.builder.note(NoteKind::Edges { n: n_edges });
    }
    for points in [VolumePoints::Holes, VolumePoints::Regions] {
        read_volume_points(&mut feed, points, target)?;
    }
    feed.note_rest(target.builder)?;
    feed.finish(target.builder)
}

/// Reads the points that mark holes or regions of the volume, where the file has that part.
fn read_volume_points<R: BufRead>(
    feed: &mut Feed<R>,
    points: VolumePoints,
    target: &mut SurfaceSink,
) -> Result<()> {
    if feed.at_end()? {
        return Ok(());
    }
    let n = u64::try_from(feed.integer("the number of points in the volume")?).unwrap_or(0);
    feed.skip_line()?;
    for i in 0..n {
        feed.need_record("points in the volume", n, i)?;
        let _: i64 = feed.integer("the number of a point in the volume")?;
        let point = feed.point()?;
        match points {
            VolumePoints::Holes => target.builder.seed(Seed { point, kind: SeedKind::Hole }),
            VolumePoints::Regions => {
                let attribute = match feed.next_word_in_line()? {
                    true => name(feed.word()),
                    false => "0".to_owned(),
                };
                let name = target.region(point, &format!("attribute_{attribute}"));
                if feed.next_word_in_line()? {
                    let volume: f64 = feed.parse("the largest volume of a tetrahedron")?;
                    ask_volume(feed, name, volume, target)?;
                }
            }
        }
        feed.skip_line()?;
    }
    target.note_points(points, n);
    if n > 0 {
        target.builder.fill_rest();
    }
    Ok(())
}

/// Asks for the edges of regular tetrahedra of a volume in a region; none is asked for by volumes of zero and less.
fn ask_volume<R: BufRead>(
    feed: &Feed<R>,
    name: String,
    volume: f64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let h = (72f64.sqrt() * volume).cbrt();
    let known = target.builder.region_sizes().iter().find(|(of, _)| *of == name);
    match known.map(|(_, known)| *known) {
        _ if h.is_nan() => Err(feed.unexpected("a volume", feed.word())),
        _ if h <= 0.0 => Ok(()),
        Some(known) if known == h => Ok(()),
        Some(_) => {
            let what = format!("another largest volume for a second region {name}");
            Err(feed.unsupported(what))
        }
        None => {
            target.builder.region_size(name, h);
            Ok(())
        }
    }
}

pub(super) fn read_node_file<R: BufRead>(
    feed: &Feed<R>,
    nodes: Option<&Path>,
    limit: u64,
    target: &mut SurfaceSink,
) -> Result<Numbering> {
    let Some(path) = nodes else {
        return Err(feed.unsupported("points in a separate .node file"));
    };
    let mut feed = open(path, limit)?;
    feed.comment = Some(b'#');
    match surface_points(&mut feed, target)? {
        Some(numbering) => Ok(numbering),
        None => Err(feed.unexpected("points in the .node file", b"0")),
    }
}

/// The point part as vertices of a surface.
fn surface_points<R: BufRead>(
    feed: &mut Feed<R>,
    target: &mut SurfaceSink,
) -> Result<Option<Numbering>> {
    read_points(feed, |p, _| target.builder.vertex(p))
}

/// The points of a `.node` file, called by their markers.
pub(super) fn read_nodes<R: BufRead>(feed: &mut Feed<R>, sink: &mut EmbeddedSink) -> Result<()> {
    feed.comment = Some(b'#');
    let numbering = read_points(feed, |p, marker| {
        let label = sink.label(&marker_name(marker));
        sink.mark(sink.set.points.len() as u32, label)?;
        sink.point(p)
    })?;
    match numbering {
        Some(_) => Ok(()),
        None => Err(feed.unexpected("points in the .node file", b"0")),
    }
}

/// The number of the first point of a `.node` file, and all positions.
pub(super) fn read_positions<R: BufRead>(mut feed: Feed<R>) -> Result<(i64, Vec<Point>)> {
    feed.comment = Some(b'#');
    let mut points = Vec::new();
    let numbering = read_points(&mut feed, |p, _| {
        points.push(p);
        Ok(())
    })?;
    Ok((numbering.map_or(0, |numbering| numbering.first), points))
}

/// The facets of two corners in a `.poly` file, called by their markers.
pub(super) fn read_segments<R: BufRead>(
    mut feed: Feed<R>,
    nodes: &Path,
    limit: u64,
    sink: &mut EmbeddedSink,
) -> Result<()> {
    feed.comment = Some(b'#');
    let mut add = |p, _| sink.point(p);
    let numbering = match read_points(&mut feed, &mut add)? {
        Some(numbering) => numbering,
        None => {
            let mut nodes = open(nodes, limit)?;
            nodes.comment = Some(b'#');
            let found = read_points(&mut nodes, &mut add)?;
            found.ok_or_else(|| nodes.unexpected("points in the .node file", b"0"))?
        }
    };
    let n_facets = feed.count("facets", 4)?;
    feed.skip_line()?;
    let mut known = HashSet::new();
    for i in 0..n_facets {
        feed.need_record("facets", n_facets, i)?;
        let facet = read_facet(&mut feed, numbering)?;
        for edge in facet.polygons.iter().filter(|polygon| polygon.len() == 2) {
            // Facets that meet in an edge may both have it.
            if known.insert([edge[0].min(edge[1]), edge[0].max(edge[1])]) {
                let label = sink.label(&marker_name(facet.marker));
                feed.placed(sink.line(edge, label))?;
            }
        }
    }
    Ok(())
}

/// The label of a marker; empty for zero, which stands for none.
fn marker_name(marker: i64) -> String {
    match marker {
        0 => String::new(),
        marker => marker.to_string(),
    }
}

/// Calls `each` with every point and its marker or 0; returns `None` when the points are in another file.
fn read_points<R: BufRead>(
    feed: &mut Feed<R>,
    mut each: impl FnMut(Point, i64) -> std::result::Result<(), SurfaceError>,
) -> Result<Option<Numbering>> {
    let n = feed.integer("the number of points")?;
    if n == 0 {
        feed.skip_line()?;
        return Ok(None);
    }
    let n = feed.check_count("points", n, 8)?;
    if feed.next_word_in_line()? {
        let dimension: i64 = feed.parse("the dimension")?;
        if dimension != 3 {
            return Err(feed.unsupported(format!("points of dimension {dimension}")));
        }
    }
    let rest = rest_of_line(feed)?;
    let place_of_marker = match rest[..] {
        [n_attributes, n_markers] if n_markers > 0 => usize::try_from(n_attributes).ok(),
        _ => None,
    };
    let mut first = 0;
    for i in 0..n {
        if !feed.next_word()? {
            return Err(feed.too_few("points", n, i));
        }
        let number: i64 = feed.parse("a point number")?;
        if i == 0 {
            first = number;
        }
        if !(0..=1).contains(&first) || number != first + i as i64 {
            let expected = if i == 0 {
                "point number 0 or 1".to_owned()
            } else {
                format!("point number {}", first + i as i64)
            };
            return Err(feed.unexpected(expected, feed.word()));
        }
        let p = feed.point()?;
        let mut marker = 0;
        // The end of the line ends the search, because the head may declare any number of attributes.
        for place in 0..=place_of_marker.unwrap_or(0) {
            if !feed.next_word_in_line()? {
                break;
            }
            if place_of_marker == Some(place) {
                marker = parse(feed.word()).unwrap_or(0);
            }
        }
        feed.skip_line()?;
        feed.placed(each(p, marker))?;
    }
    Ok(Some(Numbering { first, n }))
}

/// A polygon: the number of corners and the corners.
fn read_polygon<R: BufRead>(feed: &mut Feed<R>, numbering: Numbering) -> Result<Vec<u32>> {
    let n = feed.count("corners", 2)?;
    if n == 0 {
        return Err(feed.unsupported("a polygon without corners"));
    }
    (0..n).map(|_| feed.index(numbering.first, numbering.n)).collect()
}

/// The whole numbers left on this line.
fn rest_of_line<R: BufRead>(feed: &mut Feed<R>) -> Result<Vec<i64>> {
    let mut numbers = Vec::new();
    while feed.next_word_in_line()? {
        match parse(feed.word()) {
            Some(n) if numbers.len() < 8 => numbers.push(n),
            _ => return Err(feed.unexpected("a whole number or the end of the line", feed.word())),
        }
    }
    Ok(numbers)
}

fn add<R: BufRead>(
    feed: &Feed<R>,
    corners: &[u32],
    marker: i64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let label = target.label(&marker_name(marker));
    feed.placed(target.builder.polygon(corners, label))
}

/// One facet of a `.poly`.
struct Facet {
    polygons: Vec<Vec<u32>>,
    holes: Vec<Point>,
    marker: i64,
}

fn read_facet<R: BufRead>(feed: &mut Feed<R>, numbering: Numbering) -> Result<Facet> {
    let n_polygons = feed.count("polygons", 4)?;
    let rest = rest_of_line(feed)?;
    let (n_holes, marker) = (rest.first().copied().unwrap_or(0), rest.get(1).copied().unwrap_or(0));
    let n_holes = feed.check_count("holes of a facet", n_holes, 6)?;
    let mut facet = Facet { polygons: Vec::new(), holes: Vec::new(), marker };
    for i in 0..n_polygons {
        feed.need_record("polygons", n_polygons, i)?;
        facet.polygons.push(read_polygon(feed, numbering)?);
        rest_of_line(feed)?;
    }
    for _ in 0..n_holes {
        feed.need_word("a hole of the facet")?;
        let _: i64 = feed.parse("a hole number")?;
        facet.holes.push(feed.point()?);
        feed.skip_line()?;
    }
    if n_polygons == 0 {
        let (expected, found) = ("at least one polygon".to_owned(), "none".to_owned());
        return Err(feed.refuse(ReadFault::Unexpected { expected, found }));
    }
    Ok(facet)
}

/// Adds the triangles of a facet; true when it is more than one polygon.
fn add_facet(place: &FilePlace, facet: &Facet, target: &mut SurfaceSink) -> Result<bool> {
    let most = facet.polygons.iter().map(Vec::len).max().unwrap_or(0);
    match (most, facet.holes.is_empty()) {
        (1, _) => return Err(place.refuse(ReadFault::Unsupported("a facet of points".to_owned()))),
        (2, true) => return Ok(false),
        (2, false) => {
            let what = "a facet of edges with holes".to_owned();
            return Err(place.refuse(ReadFault::Unsupported(what)));
        }
        _ => {}
    }
    let label = target.label(&marker_name(facet.marker));
    let added = target.builder.facet(&facet.polygons, &facet.holes, label);
    added.map_err(|source| place.refuse(ReadFault::Surface(source)))?;
    Ok(facet.polygons.len() > 1 || !facet.holes.is_empty())
}
