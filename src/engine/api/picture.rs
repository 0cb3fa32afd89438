//! Pictures of a mesh: cuts through it, and surfaces in space.

use std::path::Path;
use tetdb_schema::code::Code;
use tetdb_schema::word::Word;

use super::store::open_finished;
use super::targets::{check_target, inputs_of};
use super::{ChunkCounts, Condition, Error, Settings, Store, guarded};
use crate::view;
use crate::view::picture::{ColorBar, Picture, PictureFrame, Rgb, category, scale};
use crate::view::{Clip, Extent, Piece, Section, ShellView, View};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Budget, attempt};
use tetdb_schema::catalog::Stage;
use tetdb_store::query::{ExtraVariable, QuerySession, Selection};

/// Qualities from this value on have the last color. Few are worse, and the others should remain distinguishable.
const QUALITY_MOST: f32 = 3.0;
/// Color of pieces without a label.
const INSIDE: Rgb = Rgb([205, 205, 210]);
/// Bytes for a pixel: while it is drawn, with its height, and again while it is compressed.
const PIXEL_BYTES: u64 = 16;
/// Direction towards the viewer of surfaces in space: slightly from the right and from above.
const FROM: Point = Point::new(0.55, -1.0, 0.5);

/// Quantity that colors stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorBy {
    /// The sub-domain.
    #[default]
    Subdomain,
    /// The region.
    Region,
    /// Quality q from 1 to 3; not for surfaces.
    Quality,
    /// The mean edge length.
    Size,
    /// The label of input triangles, in space. Tetrahedra are gray.
    Label,
}

impl Word for ColorBy {
    const WORDS: &'static [(Self, &'static str)] = &[
        (Self::Subdomain, "subdomain"),
        (Self::Region, "region"),
        (Self::Quality, "quality"),
        (Self::Size, "size"),
        (Self::Label, "label"),
    ];
}

/// Subject of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Subject {
    /// The tetrahedra at a plane.
    Cut,
    /// The tetrahedra at a plane, of a kept intermediate mesh.
    Stage(u32, Stage),
    Surface(ShellView),
}

/// Description of a picture for [`Store::snapshot`]; `.png` or `.svg`.
#[derive(Clone, Debug)]
pub struct Snapshot {
    subject: Subject,
    plane: Option<Clip>,
    from: Option<Point>,
    color: ColorBy,
    /// A field instead.
    field: Option<String>,
    pixels: [u32; 2],
    condition: Option<Condition>,
    crinkle: bool,
}

/// Counts of a written picture.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Snapped {
    /// Length of the file.
    pub bytes: u64,
    /// Polygons drawn.
    pub pieces: u64,
    /// Least and greatest quality of the drawn polygons' tetrahedra; of the field instead, where one gives the colors.
    pub quality: [f32; 2],
    /// Least and greatest mean edge length.
    pub size: [f32; 2],
    /// Chunks read for the picture.
    pub chunks: ChunkCounts,
}

impl Snapshot {
    fn of(subject: Subject) -> Self {
        Self {
            subject,
            plane: None,
            from: None,
            color: ColorBy::default(),
            field: None,
            pixels: [1600, 1200],
            condition: None,
            crinkle: false,
        }
    }

    /// A cut through the mesh. Default plane: through the middle of the mesh, across its least extent; see [`Snapshot::plane`].
    pub fn cut() -> Self {
        Self::of(Subject::Cut)
    }

    /// A cut through a kept intermediate mesh: before a bisection, or with its zone refined.
    pub fn stage(cut: u32, refined: bool) -> Self {
        let stage = match refined {
            true => Stage::Refined,
            false => Stage::Coarse,
        };
        Self::of(Subject::Stage(cut, stage))
    }

    /// The surface in space.
    pub fn surface() -> Self {
        Self::of(Subject::Surface(ShellView::Boundary))
    }

    /// The whole boundary of a sub-domain, in space.
    pub fn shell(rank: u32) -> Self {
        Self::of(Subject::Surface(ShellView::Subdomain(rank)))
    }

    /// The interface of a cut with kept stages: as it was chosen, or as the plane alone would give it.
    pub fn interface(cut: u32, chosen: bool) -> Self {
        Self::of(Subject::Surface(match chosen {
            true => ShellView::Chosen(cut),
            false => ShellView::Natural(cut),
        }))
    }

    /// Sets the plane of a cut through `point`, with its normal towards the viewer. A picture in space is cut away beyond this plane.
    pub fn plane(mut self, point: [f64; 3], normal: [f64; 3]) -> Self {
        self.plane = Some([point, normal].map(Point::from_array));
        self
    }

    /// Sets the direction towards the viewer of a picture in space.
    pub fn seen_from(mut self, direction: [f64; 3]) -> Self {
        self.from = Some(Point::from_array(direction));
        self
    }

    /// Sets the quantity that colors stand for. Default: sub-domains.
    pub fn color(mut self, by: ColorBy) -> Self {
        self.color = by;
        self
    }

    /// Colors a cut by a field of the store, or by a component such as `u.x`; see [`Store::condition`].
    pub fn color_field(mut self, name: impl Into<String>) -> Self {
        self.field = Some(name.into());
        self.color = ColorBy::Quality;
        self
    }

    /// Sets width and height in pixels. Default: 1600 by 1200.
    pub fn pixels(mut self, width: u32, height: u32) -> Self {
        self.pixels = [width, height];
        self
    }

    /// Draws only tetrahedra that fulfill a condition; see [`Query::where_`](super::Query::where_). Errors: `bad-expression`.
    pub fn where_(self, condition: &str) -> Result<Self, Error> {
        Ok(self.condition(Condition::parse_located(condition)?))
    }

    /// Draws only tetrahedra that fulfill the condition; see [`Snapshot::where_`].
    pub fn condition(mut self, condition: Condition) -> Self {
        self.condition = Some(condition);
        self
    }

    /// Draws the cut tetrahedra whole, instead of their intersections with the plane.
    pub fn crinkle(mut self) -> Self {
        self.crinkle = true;
        self
    }

    /// Checks the description. Errors: options that exclude each other.
    fn check(&self) -> Result<(), Error> {
        let bad = |message: &str| Err(Error::new(Code::BadQuery, message));
        let in_space = matches!(self.subject, Subject::Surface(_));
        if self.from.is_some() && !in_space {
            return bad("a direction to look from: expected a picture in space");
        }
        if in_space && self.field.is_some() {
            return bad("a color by a field: expected a cut, for faces have no value");
        }
        if in_space && self.color == ColorBy::Quality {
            return bad(
                "a color by quality: expected sub-domain, region or size, for faces have no quality",
            );
        }
        if !in_space && self.color == ColorBy::Label {
            return bad(
                "a color by label: expected a picture in space, for tetrahedra have no label",
            );
        }
        let vectors = self.plane.map(|[_, normal]| normal).into_iter().chain(self.from);
        if vectors.into_iter().any(|v| v == Point::ZERO) {
            return bad("a direction of zero length: expected three numbers that are not all zero");
        }
        Ok(())
    }
}

impl Store {
    /// Writes a picture to the file `out`, `.png` or `.svg`.
    ///
    /// Errors: `unknown-format`, `bad-query`, `no-such-part`; damage; the disk.
    pub fn snapshot(&self, out: impl AsRef<Path>, snapshot: &Snapshot) -> Result<Snapped, Error> {
        guarded(self.settings(), || {
            check_target(out.as_ref(), &inputs_of(self.path()))?;
            let field =
                snapshot.field.as_ref().map(|name| self.field_variable(name)).transpose()?;
            take(self.path(), out.as_ref(), (snapshot, field), self.settings())
        })
    }
}

/// Writes a picture of the store at `path`.
fn take(
    path: &Path,
    out: &Path,
    (snapshot, field): (&Snapshot, Option<ExtraVariable>),
    settings: &Settings,
) -> Result<Snapped, Error> {
    snapshot.check()?;
    let (budget, pixels) = (settings.budget()?, snapshot.pixels);
    let _pixels = budget.lease(
        u64::from(pixels[0]) * u64::from(pixels[1]) * PIXEL_BYTES,
        "the pixels of the picture",
    )?;
    // The session uses three quarters of the budget given to it.
    let share = Budget::new(budget.available() * 3 / 4);
    let store = open_finished(path, settings)?;
    let mut session = match snapshot.subject {
        Subject::Stage(cut, stage) => QuerySession::open_stage(store, cut, stage, &share)?,
        _ => QuerySession::open(store, &share)?,
    };
    let scratch = (&*settings.scratch_dir(), budget.available() / 8);
    attempt(|| snapshot.draw(out, &mut session, scratch, field))?
}

impl Snapshot {
    fn draw(
        &self,
        out: &Path,
        session: &mut QuerySession,
        scratch: (&Path, u64),
        field: Option<ExtraVariable>,
    ) -> Result<Snapped, Error> {
        let (section, view) = pieces(self, session, scratch, field)?;
        let extent = section.extent;
        if extent.n == 0 {
            let message = "the plane cuts no tetrahedron of the mesh";
            let help = "choose a point within the bounds of the mesh";
            return Err(Error::new(Code::BadQuery, message).with_help(help));
        }
        let frame = PictureFrame {
            pixels: self.pixels,
            bounds: extent.bounds,
            edge: f64::from(extent.size[0].midpoint(extent.size[1])) * 0.5,
            bar: bar(self, &extent),
            kinds: are_many(self.color, self.subject, session),
        };
        let mut picture = Picture::new(out, frame)?;
        let in_space = self.crinkle || matches!(self.subject, Subject::Surface(_));
        for piece in section {
            draw(&mut picture, self, in_space, &extent, &piece?)?;
        }
        if let Some([point, normal]) = session.cutting()
            && let Some(line) = view.crossing(point, normal)
        {
            picture.line(line)?;
        }
        Ok(Snapped {
            bytes: picture.finish()?,
            pieces: extent.n,
            quality: extent.quality,
            size: extent.size,
            chunks: session.measures(),
        })
    }
}

/// The pieces to draw, and the view of them. `(dir, memory)`: folder and bytes for sorting.
fn pieces(
    snapshot: &Snapshot,
    session: &mut QuerySession,
    (dir, memory): (&Path, u64),
    field: Option<ExtraVariable>,
) -> Result<(Section, View), Error> {
    let bounds = session.bounds();
    let plane = snapshot.plane;
    if let Subject::Surface(shell) = snapshot.subject {
        let from = match snapshot.from {
            Some(from) => from,
            None => match shell {
                // An interface is nearly flat. It is seen from the side it faces, at a slant.
                ShellView::Natural(cut) | ShellView::Chosen(cut) => {
                    slanted(view::normal_of(session, cut)?)
                }
                ShellView::Boundary | ShellView::Subdomain(_) => FROM,
            },
        };
        let view = View::new((bounds.low + bounds.high) * 0.5, from);
        return Ok((view::shell(session, &view, shell, plane, dir, memory)?, view));
    }
    let middle = (bounds.low + bounds.high) * 0.5;
    let [point, normal] = plane.unwrap_or_else(|| match session.cutting() {
        // Across the plane of the cut, as upright as possible.
        Some([on, normal]) => {
            let middle = middle - normal * normal.dot(middle - on);
            let upright = if normal.z.abs() > 0.9 { Point::Y } else { Point::Z };
            let across = normal.cross(upright);
            [middle, if across.y > 0.0 { -across } else { across }]
        }
        None => [middle, thinnest(&bounds)],
    });
    let view = View::new(point, normal);
    let (condition, condition_extra) = match snapshot.condition.clone() {
        Some(Condition { expression, extra }) => (Some(expression), extra),
        None => (None, Vec::new()),
    };
    let extra = field.into_iter().collect();
    let selection = Selection { condition, condition_extra, extra, ..Selection::default() };
    let section = view::section(session, &view, snapshot.crinkle, selection, dir, memory)?;
    Ok((section, view))
}

fn draw(
    picture: &mut Picture,
    snapshot: &Snapshot,
    in_space: bool,
    extent: &Extent,
    piece: &Piece,
) -> Result<(), Error> {
    match snapshot.color {
        ColorBy::Subdomain => picture.kind(piece.subdomain),
        ColorBy::Region => picture.kind(piece.region),
        ColorBy::Label => piece.label.into_iter().for_each(|label| picture.kind(label)),
        ColorBy::Quality | ColorBy::Size => {}
    }
    let color = color(snapshot, extent, piece);
    // Faces seen at an angle get less light. Faces seen from behind are inside faces and have another color.
    let flat =
        matches!(snapshot.subject, Subject::Surface(ShellView::Natural(_) | ShellView::Chosen(_)));
    let color = if piece.facing >= 0.0 || flat {
        color.lit(0.5 + 0.5 * piece.facing.abs())
    } else {
        color.mixed(Rgb([232, 232, 236]), 0.45).lit(0.35 + 0.5 * piece.facing.abs())
    };
    if in_space {
        let [a, b, c, _] = piece.corners;
        let [x, y, z, _] = piece.heights;
        picture.solid(&[a, b, c], [x, y, z], color)?;
    } else {
        picture.polygon(&piece.corners[..piece.n], color)?;
    }
    Ok(())
}

/// Returns whether colors stand for several kinds.
fn are_many(by: ColorBy, subject: Subject, session: &QuerySession) -> bool {
    match by {
        _ if !matches!(
            subject,
            Subject::Cut | Subject::Surface(ShellView::Boundary | ShellView::Subdomain(_))
        ) =>
        {
            false
        }
        ColorBy::Subdomain => session.subdomains().len() > 1,
        ColorBy::Region | ColorBy::Label => true,
        ColorBy::Quality | ColorBy::Size => false,
    }
}

/// A direction near `normal`, on the side from which other pictures are seen.
fn slanted(normal: Point) -> Point {
    let normal = if normal.dot(FROM) < 0.0 { -normal } else { normal };
    normal + FROM.normalize() * 0.7
}

/// The direction across the least extent, towards the usual viewer.
fn thinnest(bounds: &Aabb) -> Point {
    let extent = bounds.high - bounds.low;
    let least = extent.min_element();
    if extent.z == least {
        Point::Z
    } else if extent.y == least {
        Point::NEG_Y
    } else {
        Point::X
    }
}

fn bar(of: &Snapshot, extent: &Extent) -> Option<ColorBar> {
    let [least, most] = match of.color {
        ColorBy::Quality if of.field.is_some() => extent.quality,
        ColorBy::Quality => [1.0, QUALITY_MOST],
        ColorBy::Size => extent.size,
        ColorBy::Subdomain | ColorBy::Region | ColorBy::Label => return None,
    };
    Some(ColorBar { least: f64::from(least), most: f64::from(most) })
}

fn color(of: &Snapshot, extent: &Extent, piece: &Piece) -> Rgb {
    let share = |x: f32| {
        bar(of, extent).map_or(0.0, |bar| {
            (f64::from(x) - bar.least) / (bar.most - bar.least).max(f64::MIN_POSITIVE)
        })
    };
    match of.color {
        ColorBy::Subdomain => category(piece.subdomain),
        ColorBy::Region => category(piece.region),
        ColorBy::Label => piece.label.map_or(INSIDE, category),
        ColorBy::Quality => scale(share(piece.quality)),
        ColorBy::Size => scale(share(piece.size)),
    }
}
