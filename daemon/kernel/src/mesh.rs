//! Polygons as the caller gives them.

/// Polygons in their own frame: plain data, unchecked until [`Object::build`](crate::Object::build).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PolygonMesh {
    /// Positions in the object's frame, in the caller's length unit.
    pub vertices: Vec<[f64; 3]>,
    /// Number of corners of each polygon.
    pub corner_counts: Vec<u32>,
    /// Vertex index of each corner, polygon after polygon; as many as `corner_counts` add up to.
    pub corners: Vec<u32>,
}

impl PolygonMesh {
    /// A mesh of polygons given one by one, each by the vertex indices of its corners.
    ///
    /// ```
    /// use collided_kernel::PolygonMesh;
    /// let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    /// assert_eq!(PolygonMesh::from_polygons(square, [[0, 1, 2, 3]]).polygon_count(), 1);
    /// ```
    pub fn from_polygons<P: AsRef<[u32]>>(
        vertices: Vec<[f64; 3]>,
        polygons: impl IntoIterator<Item = P>,
    ) -> PolygonMesh {
        let mut mesh = PolygonMesh { vertices, ..PolygonMesh::default() };
        for polygon in polygons {
            mesh.corner_counts.push(polygon.as_ref().len() as u32);
            mesh.corners.extend_from_slice(polygon.as_ref());
        }
        mesh
    }

    /// Number of polygons.
    pub fn polygon_count(&self) -> usize {
        self.corner_counts.len()
    }

    /// The polygons in order, each as the vertex indices of its corners.
    ///
    /// # Panics
    /// If `corner_counts` add up to more than there are corners.
    pub fn polygons(&self) -> impl Iterator<Item = &[u32]> {
        let mut rest = self.corners.as_slice();
        self.corner_counts.iter().map(move |&count| {
            let (polygon, others) = rest.split_at(count as usize);
            rest = others;
            polygon
        })
    }
}
