//! Closed, outward-oriented solids of few faces.

use std::f64::consts::PI;
use std::sync::Arc;

use collided_kernel::{Object, PolygonMesh, Rows};

use crate::meshes::build;

/// Corners and triangles of a box with the given half sides about the origin.
pub fn cuboid(half: [f64; 3]) -> Arc<Object> {
    let corners = (0..8).map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] }));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    build(PolygonMesh::from_polygons(corners.collect(), faces), None)
}

/// A tetrahedron with corners on every second corner of the cube of half side `size`.
pub fn tetrahedron(size: f64) -> Arc<Object> {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let scaled = corners.map(|corner: [f64; 3]| corner.map(|x| x * size));
    build(PolygonMesh::from_polygons(scaled.to_vec(), [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]), None)
}

/// An octahedron whose corners lie on the axes, `size` from the origin.
pub fn octahedron(size: f64) -> Arc<Object> {
    let corner = |i: usize| {
        [0, 1, 2].map(|axis| {
            if axis != i / 2 {
                0.0
            } else if i.is_multiple_of(2) {
                size
            } else {
                -size
            }
        })
    };
    let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    build(PolygonMesh::from_polygons((0..6).map(corner).collect(), faces), None)
}

/// A sphere about the origin: `2·rings` points around, `rings` from pole to pole, both poles on the x axis.
///
/// # Panics
/// When there are fewer than two rings.
pub fn sphere(radius: f64, rings: u32) -> Arc<Object> {
    assert!(rings >= 2, "a sphere of {rings} rings is flat");
    let around = 2 * rings;
    let mut corners = vec![[radius, 0.0, 0.0], [-radius, 0.0, 0.0]];
    for ring in 1..rings {
        let (sin, cos) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        corners.extend((0..around).map(|i| {
            let (y, z) = (PI * f64::from(i) / f64::from(rings)).sin_cos();
            [radius * cos, radius * sin * z, radius * sin * y]
        }));
    }
    let at = |ring: u32, i: u32| 2 + (ring - 1) * around + i % around;
    let mut faces = Vec::new();
    for i in 0..around {
        faces.push(vec![0, at(1, i), at(1, i + 1)]);
        faces.push(vec![1, at(rings - 1, i + 1), at(rings - 1, i)]);
        for ring in 1..rings - 1 {
            faces.push(vec![at(ring, i), at(ring + 1, i), at(ring + 1, i + 1)]);
            faces.push(vec![at(ring, i), at(ring + 1, i + 1), at(ring, i + 1)]);
        }
    }
    build(PolygonMesh::from_polygons(corners, faces), None)
}

/// A translation.
pub fn at(x: f64, y: f64, z: f64) -> Rows {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]]
}

/// A linear part and a translation.
pub fn rows(linear: &[[f64; 3]; 3], translation: [f64; 3]) -> Rows {
    [0, 1, 2].map(|row| [linear[row][0], linear[row][1], linear[row][2], translation[row]])
}
