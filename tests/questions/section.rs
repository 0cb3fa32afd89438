//! Sections of the mesh by planes.

use super::*;
use tetdb_engine::view::{self, Piece, View};

/// Twice the signed area of a piece.
fn area(piece: &Piece) -> f64 {
    let corners = &piece.corners[..piece.n];
    let turned = corners.iter().zip(corners.iter().cycle().skip(1));
    turned.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum()
}

#[test]
fn sections_cover_what_the_plane_cuts_once() -> Outcome {
    let fixture = grid(4, 2)?;
    let mut session = fixture.session(64 << 20)?;
    let diagonal = 16.0 * 2f64.sqrt();
    for (origin, normal, expected) in [
        // Between and through vertices, from both sides, along a diagonal, through a corner.
        (Point::new(0.0, 0.0, 1.3), Point::Z, 16.0),
        (Point::new(0.0, 0.0, 2.0), Point::Z, 16.0),
        (Point::new(2.0, 0.0, 0.0), Point::NEG_X * 1e-200, 16.0),
        (Point::new(2.0, 2.0, 0.0), Point::new(1.0, 1.0, 0.0), diagonal),
        (Point::new(4.0, 4.0, 4.0), Point::ONE, 0.0),
    ] {
        let view = View::new(origin, normal);
        let section = |session: &mut QuerySession, crinkle| {
            view::section(
                session,
                &view,
                crinkle,
                Selection::default(),
                fixture.dir.path(),
                1 << 16,
            )
        };
        let cut = section(&mut session, false)?;
        let extent = cut.extent;
        let pieces: Vec<Piece> = cut.collect::<Result<_, _>>()?;
        assert_eq!(pieces.len() as u64, extent.n);
        let sum: f64 = pieces.iter().map(|p| area(p).abs()).sum();
        assert!((sum / 2.0 - expected).abs() < 1e-9, "{origin} {normal}: {sum}");
        assert!(pieces.iter().all(|p| p.quality >= 1.0 && p.facing == 1.0));
        if expected == 0.0 {
            continue;
        }
        // The front faces of whole tetrahedra cover at least the same area.
        let whole = section(&mut session, true)?;
        let pieces: Vec<Piece> = whole.collect::<Result<_, _>>()?;
        assert!(pieces.iter().all(|p| p.n == 3 && p.facing > 0.0 && area(p) > 0.0));
        let sum: f64 = pieces.iter().map(area).sum();
        assert!(sum / 2.0 >= expected - 1e-9, "{sum}");
    }
    Ok(())
}
