//! Separating axes by plain f64, without a margin: what a culling test must not do.

use collided_kernel::glam::DVec3;

/// Whether one of the axes separates two sets of points, by plain f64 and without a margin.
pub fn separated(axes: &[DVec3], a: &[DVec3], b: &[DVec3]) -> bool {
    let extent = |axis: &DVec3, points: &[DVec3]| {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        points.iter().map(|point| axis.dot(*point)).fold(ends, |(low, high), at| (low.min(at), high.max(at)))
    };
    axes.iter().any(|axis| {
        let ((low_a, high_a), (low_b, high_b)) = (extent(axis, a), extent(axis, b));
        high_a < low_b || high_b < low_a
    })
}

/// The fifteen axes that may separate two boxes with these edges: face normals of each, products of their edges.
pub fn axes_of_boxes(a: &[DVec3; 3], b: &[DVec3; 3]) -> [DVec3; 15] {
    let face = |edges: &[DVec3; 3], axis: usize| edges[(axis + 1) % 3].cross(edges[(axis + 2) % 3]);
    std::array::from_fn(|axis| match axis {
        0..3 => face(a, axis),
        3..6 => face(b, axis - 3),
        _ => a[(axis - 6) / 3].cross(b[(axis - 6) % 3]),
    })
}

/// The ten axes, besides its own, that may separate a box from a triangle: the normal, and edges by the box's axes.
pub fn axes_of_triangle_and_box([a, b, c]: &[DVec3; 3]) -> [DVec3; 10] {
    let edges = [b - a, c - b, a - c];
    std::array::from_fn(|axis| match axis.checked_sub(1) {
        None => edges[0].cross(edges[1]),
        Some(product) => DVec3::AXES[product % 3].cross(edges[product / 3]),
    })
}

/// The corners of a box.
pub fn corners_of_box([low, high]: [DVec3; 2]) -> [DVec3; 8] {
    let side = |corner: usize, axis: usize| [low, high][corner >> axis & 1][axis];
    std::array::from_fn(|corner| DVec3::from([0, 1, 2].map(|axis| side(corner, axis))))
}
