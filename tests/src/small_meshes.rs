//! Meshes of few polygons: some whose interference is known by heart, and random ones where special positions are frequent.

use collided_client::{Mesh, Rows};
use collided_kernel::PolygonMesh;
use proptest::array::uniform3;
use proptest::collection::vec;
use proptest::prelude::*;

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

/// Triangles, quadrilaterals and pentagons on few grid points, so that they share corners, overlap and collapse.
pub fn small_mesh() -> impl Strategy<Value = PolygonMesh> {
    let vertices = vec(uniform3((-2..=2i32).prop_map(f64::from)), 5..9);
    (vertices, vec(vec(0..5u32, 3..=5), 0..8))
        .prop_map(|(vertices, polygons)| PolygonMesh::from_polygons(vertices, polygons))
}
