//! `snapshot`: a picture of a cut through the mesh, or of surfaces in space.

use std::path::Path;

use super::args::{ColorBy, SnapshotArgs};
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query_ask::{bad, condition, numbers};
use crate::api::store::open_finished;
use crate::geom::{Aabb, Point};
use crate::query::{QuerySession, Selection};
use crate::storage::{Budget, attempt};
use crate::view::picture::{ColorBar, Picture, PictureFrame, Rgb, category, scale};
use crate::view::{Clip, Extent, Piece, Section, ShellView, View};
use tetdb_schema::catalog::Stage;

/// Qualities from here on have the last color: few are worse, and the others should differ.
const QUALITY_MOST: f32 = 3.0;
/// Least and greatest side of a picture in pixels.
const SIDE: std::ops::RangeInclusive<u32> = 64..=16_384;
/// Bytes of a pixel while it is drawn, with its height, and again while it is compressed.
const PIXEL_BYTES: u64 = 16;
/// Towards the viewer of surfaces in space: a little from the right, a little from above.
const FROM: Point = Point::new(0.55, -1.0, 0.5);

/// What is drawn.
#[derive(Clone, Copy)]
enum Subject {
    /// The tetrahedra at a plane.
    Cut,
    /// The same of a mesh that was kept.
    Stage(u32, Stage),
    Surface(ShellView),
}

pub fn run(args: &SnapshotArgs, console: &Console) -> Result<u8, Failure> {
    let cap = memory::cap(args.read.memory.as_deref())?;
    let pixels = pixels(&args.size)?;
    let subject = subject(args)?;
    let budget = Budget::new(cap);
    let _pixels = budget.lease(
        u64::from(pixels[0]) * u64::from(pixels[1]) * PIXEL_BYTES,
        "the pixels of the picture; --size asks for fewer",
    )?;
    // The inquiry takes three quarters of what it is given.
    let share = Budget::new(budget.available() * 3 / 4);
    let store = open_finished(&args.store)?;
    let mut inquiry = match subject {
        Subject::Stage(cut, stage) => QuerySession::open_stage(store, cut, stage, &share)?,
        _ => QuerySession::open(store, &share)?,
    };
    attempt(|| -> Result<u8, Failure> {
        let (section, view) = pieces(args, subject, &mut inquiry, budget.available() / 8)?;
        let extent = section.extent;
        if extent.n == 0 {
            let plane = args.plane.as_deref().unwrap_or_default();
            let expected = "a plane that cuts tetrahedra of the mesh";
            return Err(bad("--plane", plane, expected));
        }
        let frame = PictureFrame {
            pixels,
            bounds: extent.bounds,
            edge: f64::from(extent.size[0].midpoint(extent.size[1])) * 0.5,
            bar: bar(args.color, &extent),
            kinds: are_many(args.color, subject, &inquiry),
        };
        let mut picture = Picture::new(&args.output, frame)?;
        let in_space = args.crinkle || matches!(subject, Subject::Surface(_));
        for piece in section {
            draw(&mut picture, args, subject, in_space, &extent, &piece?)?;
        }
        if let Some([point, normal]) = inquiry.cutting()
            && let Some(line) = view.crossing(point, normal)
        {
            picture.line(line)?;
        }
        let bytes = picture.finish()?;
        console.done();
        tell(args, &inquiry, &extent, bytes, console);
        Ok(0)
    })?
}

/// What is asked for. Errors: options that have no meaning.
fn subject(args: &SnapshotArgs) -> Result<Subject, Failure> {
    let subject = if args.surface {
        Subject::Surface(ShellView::Boundary)
    } else if let Some(rank) = args.shell {
        Subject::Surface(ShellView::Subdomain(rank))
    } else if let Some(text) = &args.stage {
        let expected =
            "a cut and what to show of it, such as 1:coarse, 1:refined, 1:natural or 1:interface";
        let named = text.split_once(':').and_then(|(cut, what)| {
            let cut = cut.trim().parse().ok()?;
            Some(match what.trim() {
                "coarse" => Subject::Stage(cut, Stage::Coarse),
                "refined" => Subject::Stage(cut, Stage::Refined),
                "natural" => Subject::Surface(ShellView::Natural(cut)),
                "interface" => Subject::Surface(ShellView::Chosen(cut)),
                _ => return None,
            })
        });
        named.ok_or_else(|| bad("--stage", text, expected))?
    } else {
        Subject::Cut
    };
    let in_space = matches!(subject, Subject::Surface(_));
    if let (Some(from), false) = (&args.from, in_space) {
        let expected = "a picture in space: --surface, --shell, or an interface with --stage";
        return Err(bad("--from", from, expected));
    }
    if in_space && matches!(args.color, ColorBy::Quality) {
        let expected = "subdomain, region or size, for faces have no quality";
        return Err(bad("--color", "quality", expected));
    }
    Ok(subject)
}

/// All that is drawn, and how it is seen.
fn pieces(
    args: &SnapshotArgs,
    subject: Subject,
    inquiry: &mut QuerySession,
    memory: u64,
) -> Result<(Section, View), Failure> {
    let dir = std::env::temp_dir();
    let dir: &Path = &dir;
    let bounds = inquiry.bounds();
    let plane = args.plane.as_deref().map(plane).transpose()?;
    if let Subject::Surface(shell) = subject {
        let from = match &args.from {
            Some(text) => direction(text)?,
            None => match shell {
                // An interface is nearly flat: it is seen from the side it faces, at a slant.
                ShellView::Natural(cut) | ShellView::Chosen(cut) => {
                    slanted(inquiry.normal_of(cut)?)
                }
                ShellView::Boundary | ShellView::Subdomain(_) => FROM,
            },
        };
        let view = View::new((bounds.low + bounds.high) * 0.5, from);
        return Ok((inquiry.shell(&view, shell, plane, dir, memory)?, view));
    }
    let middle = (bounds.low + bounds.high) * 0.5;
    let [point, normal] = plane.unwrap_or_else(|| match inquiry.cutting() {
        // Across the plane of the cut, as upright as can be.
        Some([on, normal]) => {
            let middle = middle - normal * normal.dot(middle - on);
            let upright = if normal.z.abs() > 0.9 {
                Point::Y
            } else {
                Point::Z
            };
            let across = normal.cross(upright);
            [middle, if across.y > 0.0 { -across } else { across }]
        }
        None => [middle, thinnest(&bounds)],
    });
    let view = View::new(point, normal);
    let selection = Selection {
        condition: args.condition.as_deref().map(condition).transpose()?,
        ..Selection::default()
    };
    let section = inquiry.section(&view, args.crinkle, selection, dir, memory)?;
    Ok((section, view))
}

fn draw(
    picture: &mut Picture,
    args: &SnapshotArgs,
    subject: Subject,
    in_space: bool,
    extent: &Extent,
    piece: &Piece,
) -> Result<(), Failure> {
    match args.color {
        ColorBy::Subdomain => picture.kind(piece.subdomain),
        ColorBy::Region => picture.kind(piece.region),
        ColorBy::Quality | ColorBy::Size => {}
    }
    let color = color(args.color, extent, piece);
    // Faces seen from the side get less light; what is seen from behind is the inside.
    let flat = matches!(
        subject,
        Subject::Surface(ShellView::Natural(_) | ShellView::Chosen(_))
    );
    let color = if piece.facing >= 0.0 || flat {
        color.lit(0.5 + 0.5 * piece.facing.abs())
    } else {
        color
            .mixed(Rgb([232, 232, 236]), 0.45)
            .lit(0.35 + 0.5 * piece.facing.abs())
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

/// Whether colors stand for several kinds.
fn are_many(by: ColorBy, subject: Subject, inquiry: &QuerySession) -> bool {
    match by {
        _ if !matches!(
            subject,
            Subject::Cut | Subject::Surface(ShellView::Boundary | ShellView::Subdomain(_))
        ) =>
        {
            false
        }
        ColorBy::Subdomain => inquiry.subdomains().len() > 1,
        ColorBy::Region => true,
        ColorBy::Quality | ColorBy::Size => false,
    }
}

fn tell(
    args: &SnapshotArgs,
    inquiry: &QuerySession,
    extent: &Extent,
    bytes: u64,
    console: &Console,
) {
    let measures = inquiry.measures();
    if console.is_json() {
        console.answer(&serde_json::json!({
            "schema": 1, "file": args.output.display().to_string(), "bytes": bytes, "pieces": extent.n,
            "quality": extent.quality, "size": extent.size, "chunks": measures,
        }));
        return;
    }
    console.note(&format!(
        "wrote {} ({}): {} pieces; read {} of {} chunks of tetrahedra",
        args.output.display(),
        memory::show(bytes),
        extent.n,
        measures.tet_chunks_read,
        measures.tet_chunks
    ));
}

fn pixels(text: &str) -> Result<[u32; 2], Failure> {
    let sides = text.split_once('x').and_then(|(w, h)| {
        let side = |s: &str| s.trim().parse().ok().filter(|n| SIDE.contains(n));
        Some([side(w)?, side(h)?])
    });
    let expected = "width and height in pixels, such as 1600x1200, each from 64 to 16384";
    sides.ok_or_else(|| bad("--size", text, expected))
}

/// A point of the plane asked for, and its direction towards the viewer.
fn plane(text: &str) -> Result<Clip, Failure> {
    let expected = "six numbers, a point and a direction towards the viewer";
    let [x, y, z, nx, ny, nz] = numbers("--plane", text, expected)?;
    let (point, normal) = (Point::new(x, y, z), Point::new(nx, ny, nz));
    if normal == Point::ZERO {
        return Err(bad("--plane", text, expected));
    }
    Ok([point, normal])
}

fn direction(text: &str) -> Result<Point, Failure> {
    let expected = "three numbers, a direction towards the viewer";
    let from = Point::from_array(numbers("--from", text, expected)?);
    if from == Point::ZERO {
        return Err(bad("--from", text, expected));
    }
    Ok(from)
}

/// A direction near `normal`, from the half that is seen from in other pictures.
fn slanted(normal: Point) -> Point {
    let normal = if normal.dot(FROM) < 0.0 {
        -normal
    } else {
        normal
    };
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

fn bar(by: ColorBy, extent: &Extent) -> Option<ColorBar> {
    let [least, most] = match by {
        ColorBy::Quality => [1.0, QUALITY_MOST],
        ColorBy::Size => extent.size,
        ColorBy::Subdomain | ColorBy::Region => return None,
    };
    Some(ColorBar {
        least: f64::from(least),
        most: f64::from(most),
    })
}

fn color(by: ColorBy, extent: &Extent, piece: &Piece) -> Rgb {
    let share = |x: f32| {
        bar(by, extent).map_or(0.0, |bar| {
            (f64::from(x) - bar.least) / (bar.most - bar.least).max(f64::MIN_POSITIVE)
        })
    };
    match by {
        ColorBy::Subdomain => category(piece.subdomain),
        ColorBy::Region => category(piece.region),
        ColorBy::Quality => scale(share(piece.quality)),
        ColorBy::Size => scale(share(piece.size)),
    }
}
