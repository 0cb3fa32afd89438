//! The one convention of tetrahedra.
//!
//! ```text
//!            v3              positive: det(v1-v0, v2-v0, v3-v0) > 0
//!           /|\
//!          / | \             face i is opposite vertex i, counter-clockwise seen from outside:
//!         /  |  \              0: (1 2 3)   1: (0 3 2)   2: (0 1 3)   3: (0 2 1)
//!       v0 --+-- v2
//!         \  |  /            edges 0..6 = 01 02 03 12 13 23; the edge opposite e is 5 - e
//!          \ | /
//!           \|/
//!            v1
//! ```

/// Local vertices of face `i`, counter-clockwise seen from outside.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
/// Local vertices of edge `e`.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
/// `EDGE_OF[i][j]`: the edge between local vertices `i` and `j` (unused on the diagonal).
pub const EDGE_OF: [[usize; 4]; 4] = [[6, 0, 1, 2], [0, 6, 3, 4], [1, 3, 6, 5], [2, 4, 5, 6]];
