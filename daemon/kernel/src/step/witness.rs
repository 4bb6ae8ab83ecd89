//! Two triangles that proved a common point of a pair in the last step, and where to look when they do so no more.

use crate::cells::Cell;
use crate::object::Object;
use crate::polygon_box::bits_of;
use crate::polygon_pairs::WorldTriangle;
use crate::polygon_test::triangles;
use crate::submatrix::{Placed, Voxel};
use crate::voxel_pairs::VoxelPair;

/// The numbers of a triangle of either body.
pub(crate) type Witness = [u32; 2];

/// Whether the triangles have a common point, by the exact test.
pub(super) fn holds([p, q]: Witness, [a, b]: &[Placed<'_>; 2]) -> bool {
    let p = WorldTriangle::new(p, a.object, a.rows);
    let q = WorldTriangle::new(q, b.object, b.rows);
    p.bounds.overlaps(&q.bounds) && triangles(&p.corners, &q.corners).is_some()
}

/// The voxels that the triangles are in, of the last level that has children: surfaces that met there meet near by a little later.
pub(super) fn neighbourhood([p, q]: Witness, [a, b]: &[Placed<'_>; 2]) -> Option<VoxelPair> {
    let cell = |triangle: u32, object: &Object| Some(Cell::voxel(object.matrix(), voxel_around(triangle, object)?));
    Some(VoxelPair::of([cell(p, a.object)?, cell(q, b.object)?]))
}

/// `None` when rounding hides which it is, or when there is no such level below the container.
fn voxel_around(triangle: u32, object: &Object) -> Option<Voxel> {
    let corners = object.triangles()[triangle as usize].map(|vertex| object.vertices()[vertex as usize]);
    let centre = [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis] / 3.0).sum::<f64>());
    let wanted = object.matrix().depth().checked_sub(1).filter(|&level| level > 0)?;
    (0..wanted).try_fold(Voxel::CONTAINER, |voxel, _| child_around(centre, voxel, object))
}

fn child_around(point: [f64; 3], parent: Voxel, object: &Object) -> Option<Voxel> {
    let (matrix, level) = (object.matrix(), usize::from(parent.level));
    let (lattice, node) = (matrix.lattice(), matrix.node(level, parent.number));
    let halved = &lattice.levels()[level];
    let bits = lattice.bits_at(level + 1);
    let mut children = node.occupied;
    for axis in 0..3 {
        let first = parent.index[axis] << halved.bits[axis];
        let places = lattice.places_reached(axis, bits[axis], first, halved.bits[axis], point[axis], point[axis]);
        children &= halved.children_between(axis, places);
    }
    let child = bits_of(children).next()?;
    let place = halved.place[child as usize];
    let index = [0, 1, 2].map(|axis| parent.index[axis] << halved.bits[axis] | u32::from(place[axis]));
    Some(Voxel { level: parent.level + 1, number: node.child(child), index })
}
