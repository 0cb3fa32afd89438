//! Meshes a surface from arrays into the store given as the first argument. One run is cancelled, the next finishes. Then queries a box.
use tetdb::{CancelToken, Length, Mesher, Sizes, Surface};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("the path of a store")?;
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let surface = Surface::from_arrays(&points, &triangles, None)?.refined(Length::units(0.1))?;
    let mesher = Mesher::new(surface).sizes(Sizes::interior(Length::units(0.1)));
    let token = CancelToken::new();
    token.cancel();
    let cancelled = mesher.clone().cancel(&token).create(&path);
    assert!(cancelled.is_err_and(|error| error.is_cancelled()));
    let mut store = mesher.create(&path)?;
    let n = store.query().in_box([0.0; 3], [0.2; 3]).collect()?.len();
    println!("{} tetrahedra, {n} of them in the box", store.summary().n_tets);
    Ok(())
}
