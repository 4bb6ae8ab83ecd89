//! Meshes of few polygons, whose interference is known by heart.

use collided_client::{Mesh, Rows};

/// One triangle in the plane z = 0. With itself in the same place: one polygon pair, coplanar.
pub const TRIANGLE: Mesh<'static> =
    Mesh { vertices: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], corner_counts: &[3], corners: &[0, 1, 2] };

/// Two triangles in the plane z = 0 with a gap between them. With itself in the same place: two polygon pairs.
pub const TWO_TRIANGLES: Mesh<'static> = Mesh {
    vertices: &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [5., 0., 0.], [6., 0., 0.], [5., 1., 0.]],
    corner_counts: &[3, 3],
    corners: &[0, 1, 2, 3, 4, 5],
};

/// A translation.
pub fn at(x: f64, y: f64, z: f64) -> Rows {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]]
}
