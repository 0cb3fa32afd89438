//! Every input triangle is a face of the mesh, and no vertex is added on the surface, also for shapes constructed to break this.
//!
//! Why: recovery is where meshers fail, and they fail on unusual shapes: dozens of ties, tiny angles, needles, copies one bit apart.
//! How: `solids` are known to be hard, and `cuts` draws small ones at random. Each shape is meshed and checked by `mesher`, or refused
//! by the validator because rounding caused crossings. No other outcome is accepted.
//!
//! `TETDB_TORTURE=20 cargo test --profile quick --test torture` meshes each solid with twenty times as many variants. `cargo test
//! --profile quick --test torture -- --ignored --nocapture random` draws 100,000 random cases. `TETDB_TORTURE_CASES` and
//! `TETDB_TORTURE_SEED` change their number and seed.

mod cuts;
mod listed;
mod many;
mod mesher;
mod plane;
mod random;
mod shape;
mod solids;
