//! The vertices, triangles and labels of a surface as arrays.

use super::Surface;
impl Surface {
    /// Positions of the vertices; vertices with equal coordinates appear once.
    pub fn points(&self) -> &[[f64; 3]] {
        bytemuck::cast_slice(&self.inner.points[..self.inner.n_input_vertices()])
    }

    /// Corners of each triangle as three positions in [`Surface::points`]. All triangles are oriented like their neighbors.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.inner.triangles[..self.inner.n_input_triangles()]
    }

    /// The label of each triangle, a position in [`Surface::labels`].
    pub fn labels_of_triangles(&self) -> &[u32] {
        &self.inner.labels[..self.inner.n_input_triangles()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_comes_back_as_arrays_with_the_places_of_its_defects() {
        let surface = Surface::sample("box,h=0.5").unwrap();
        let names: Vec<&str> = (surface.labels_of_triangles().iter())
            .map(|&label| surface.labels()[label as usize].as_str())
            .collect();
        let (points, triangles) = (surface.points(), surface.triangles());
        let again = Surface::from_arrays(points, triangles, Some(&names)).unwrap();
        assert_eq!(again.points(), points);
        assert_eq!(again.triangles(), triangles);
        let open = Surface::from_arrays(points, &triangles[1..], None).unwrap();
        let report = open.check().unwrap();
        assert_eq!(report.places.len(), report.defects.len());
        assert_eq!(report.places[0].code, "open-surface");
        assert!(report.places[0].triangles[0].is_some() && report.places[0].at.is_some());
    }
}
