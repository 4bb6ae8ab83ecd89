//! How many times a surface winds around a point, exactly.
//!
//! A ray goes from the point along the world's x axis; each triangle that it passes counts +1 or −1 by the side on which it
//! is entered. A ray through an edge or a corner must be counted once, so the point is moved by (0, ε, ε²), smaller than any
//! number, in thought (Edelsbrunner and Mücke, "Simulation of Simplicity", ACM TOG 1990): then no ray meets an edge, and the
//! count is the same, as the point is not on the surface.

use glam::{DVec2, DVec3, Vec3Swizzles};

use crate::affine::{rounding_bound, world_vertex};
use crate::global_boxes::GlobalBox;
use crate::polygon_box::bits_of;
use crate::predicates::{Arithmetic, Sign};
use crate::submatrix::{Placed, Voxel};

/// Memory of the search for the triangles that a ray may pass.
#[derive(Debug, Default)]
pub(crate) struct Ray {
    voxels: Vec<Voxel>,
    triangles: Vec<u32>,
}

/// Winding number of the world surface of a body around a point that is not on it.
pub(super) fn winding<A: Arithmetic>(arithmetic: A, body: Placed<'_>, point: DVec3, ray: &mut Ray) -> i64 {
    ray.gather(body, point);
    let corner = |vertex: u32| world_vertex(body.rows, body.object.vertices()[vertex as usize]);
    let passed = ray.triangles.iter().map(|&triangle| {
        let corners = body.object.triangles()[triangle as usize].map(corner);
        i64::from(passes(arithmetic, &corners, point))
    });
    passed.sum()
}

impl Ray {
    /// The triangles, each once, of the voxels that the ray may pass.
    ///
    /// A point of a rounded world triangle is within [`rounding_bound`] of the exact image of a point of a voxel that lists the
    /// triangle, and the box of the voxel errs by no more than that either.
    fn gather(&mut self, body: Placed<'_>, start: DVec3) {
        let (matrix, lattice) = (body.object.matrix(), body.object.matrix().lattice());
        let pad = 2.0 * rounding_bound(body.magnitude);
        let may_pass = |voxel: &Voxel| {
            let container = lattice.voxel(lattice.bits_at(usize::from(voxel.level)), voxel.index);
            let bounds = GlobalBox::of(&container, body.rows);
            let (min, max) = (bounds.min - pad, bounds.max + pad);
            let beside = max.x < start.x || max.y < start.y || max.z < start.z || min.y > start.y || min.z > start.z;
            !beside
        };
        self.triangles.clear();
        self.voxels.clear();
        self.voxels.push(Voxel::CONTAINER);
        while let Some(voxel) = self.voxels.pop() {
            let level = usize::from(voxel.level);
            if level == matrix.depth() {
                self.triangles.extend_from_slice(matrix.triangles(level, voxel.number));
                continue;
            }
            let (node, halved) = (matrix.node(level, voxel.number), &lattice.levels()[level]);
            let children = bits_of(node.occupied).map(|child| {
                let place = halved.place[child as usize];
                let index = [0, 1, 2].map(|axis| voxel.index[axis] << halved.bits[axis] | u32::from(place[axis]));
                Voxel { level: voxel.level + 1, number: node.child(child), index }
            });
            self.voxels.extend(children.filter(may_pass));
        }
        self.triangles.sort_unstable();
        self.triangles.dedup();
    }
}

/// The sign with which a ray from `start` along +x passes a triangle; 0 when it does not.
fn passes<A: Arithmetic>(arithmetic: A, &[a, b, c]: &[DVec3; 3], start: DVec3) -> Sign {
    let [p, q, r] = [a, b, c].map(DVec3::yz);
    let facing = arithmetic.orient2d(p, q, r);
    let is_on_the_inner_side = |from, to| side(arithmetic, from, to, start.yz()) == facing;
    if facing == 0 || !(is_on_the_inner_side(p, q) && is_on_the_inner_side(q, r) && is_on_the_inner_side(r, p)) {
        return 0;
    }
    // Along the ray, the signed distance from the plane grows with the sign of `facing`.
    if arithmetic.orient3d(a, b, c, start) == -facing { facing } else { 0 }
}

/// On which side of the line through two different points the moved point lies; 0 for equal points.
fn side<A: Arithmetic>(arithmetic: A, from: DVec2, to: DVec2, point: DVec2) -> Sign {
    let compare = |left: f64, right: f64| Sign::from(left > right) - Sign::from(left < right);
    let sides = [arithmetic.orient2d(from, to, point), compare(from.y, to.y), compare(to.x, from.x)];
    sides.into_iter().find(|&sign| sign != 0).unwrap_or(0)
}
