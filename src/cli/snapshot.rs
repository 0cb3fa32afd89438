//! `snapshot`: a picture of a cut through the mesh.

use super::args::{ColorBy, SnapshotArgs};
use super::failure::Failure;
use super::query_ask::{bad, condition, numbers};
use super::talk::Talk;
use super::{memory, store};
use crate::geom::{Aabb, Point};
use crate::io::picture::{Bar, Frame, Picture, Rgb, category, scale};
use crate::report::{Extent, Inquiry, Piece, Selection, View};
use crate::store::{Budget, attempt};

/// Qualities from here on have the last color: few are worse, and the others should differ.
const QUALITY_MOST: f32 = 3.0;
/// Least and greatest side of a picture in pixels.
const SIDE: std::ops::RangeInclusive<u32> = 64..=16_384;
/// Bytes of a pixel while it is drawn, and again while it is compressed.
const PIXEL_BYTES: u64 = 12;

pub fn run(args: &SnapshotArgs, talk: &Talk) -> Result<u8, Failure> {
    let (cap, _) = memory::cap(args.memory.as_deref())?;
    let pixels = pixels(&args.size)?;
    let budget = Budget::new(cap);
    let _pixels = budget.lease(
        u64::from(pixels[0]) * u64::from(pixels[1]) * PIXEL_BYTES,
        "the pixels of the picture; --size asks for fewer",
    )?;
    // The inquiry takes three quarters of what it is given.
    let share = Budget::new(budget.available() * 3 / 4);
    let mut inquiry = Inquiry::open(store::open_finished(&args.store)?, &share)?;
    let view = view(args.plane.as_deref(), &inquiry.bounds())?;
    let selection = Selection {
        condition: args.condition.as_deref().map(condition).transpose()?,
        ..Selection::default()
    };
    attempt(|| -> Result<u8, Failure> {
        let dir = std::env::temp_dir();
        let memory = budget.available() / 8;
        let section = inquiry.section(&view, args.crinkle, selection, &dir, memory)?;
        let extent = section.extent;
        if extent.n == 0 {
            let plane = args.plane.as_deref().unwrap_or_default();
            return Err(bad(
                "--plane",
                plane,
                "a plane that cuts tetrahedra of the mesh",
            ));
        }
        let frame = Frame {
            pixels,
            bounds: extent.bounds,
            edge: f64::from(extent.size[0].midpoint(extent.size[1])) * 0.5,
            bar: bar(args.color, &extent),
        };
        let mut picture = Picture::new(&args.output, frame)?;
        for piece in section {
            let piece = piece?;
            let color = color(args.color, &extent, &piece);
            // Faces seen from the side get less light.
            let color = color.lit(0.55 + 0.45 * piece.facing);
            picture.polygon(&piece.corners[..piece.n], color)?;
        }
        let bytes = picture.finish()?;
        talk.done();
        tell(args, &inquiry, &extent, bytes, talk);
        Ok(0)
    })?
}

fn tell(args: &SnapshotArgs, inquiry: &Inquiry, extent: &Extent, bytes: u64, talk: &Talk) {
    let measures = inquiry.measures();
    if talk.is_json() {
        talk.answer(&serde_json::json!({
            "schema": 1, "file": args.output.display().to_string(), "bytes": bytes, "pieces": extent.n,
            "quality": extent.quality, "size": extent.size, "chunks": measures,
        }));
        return;
    }
    talk.note(&format!(
        "wrote {} ({}): {} pieces, quality {:.3} to {:.3}; read {} of {} chunks of tetrahedra",
        args.output.display(),
        memory::show(bytes),
        extent.n,
        extent.quality[0],
        extent.quality[1],
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

/// The plane asked for, or one through the middle that cuts across the least extent.
fn view(plane: Option<&str>, bounds: &Aabb) -> Result<View, Failure> {
    if let Some(text) = plane {
        let expected = "six numbers, a point and a direction towards the viewer";
        let [x, y, z, nx, ny, nz] = numbers("--plane", text, expected)?;
        let (point, normal) = (Point::new(x, y, z), Point::new(nx, ny, nz));
        if normal == Point::ZERO {
            return Err(bad("--plane", text, expected));
        }
        return Ok(View::new(point, normal));
    }
    let extent = bounds.high - bounds.low;
    let least = extent.min_element();
    let normal = if extent.z == least {
        Point::Z
    } else if extent.y == least {
        Point::NEG_Y
    } else {
        Point::X
    };
    Ok(View::new((bounds.low + bounds.high) * 0.5, normal))
}

fn bar(by: ColorBy, extent: &Extent) -> Option<Bar> {
    let [least, most] = match by {
        ColorBy::Quality => [1.0, QUALITY_MOST],
        ColorBy::Size => extent.size,
        ColorBy::Subdomain | ColorBy::Region => return None,
    };
    Some(Bar {
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
