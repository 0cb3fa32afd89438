//! Every input triangle is a face of the mesh and nothing is added on the surface: for shapes made to break that promise.
//!
//! Why: recovery is where meshers fail, and they fail on shapes nobody drew: ties by the dozen, angles of nothing, needles,
//! copies one bit apart. How: `solids` are known to be hard, `cuts` draws small ones at random; each is meshed and
//! checked by `mesher`, or refused by the validator because rounding made it cross itself. There is no third way.
//!
//! `TETDB_TORTURE=20 cargo test --profile quick --test torture` meshes each solid with twenty times as many variants.
//! `cargo test --profile quick --test torture -- --ignored --nocapture random` draws 100,000 random cases; `TETDB_TORTURE_CASES` and
//! `TETDB_TORTURE_SEED` say otherwise.

mod cuts;
mod listed;
mod many;
mod mesher;
mod plane;
mod random;
mod shape;
mod solids;
