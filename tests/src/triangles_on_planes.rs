//! Triangles that pass, exactly, through a point on the planes between voxels, or a few ulp beside them.
//!
//! All coordinates are integers below 2^53 times one power of two, and all sides of the container are powers of two, so that
//! planes, points and sums of them are what they are in real numbers, while products of them are not.

use collided_kernel::PolygonMesh;
use collided_kernel::container::Lattice;
use collided_kernel::glam::DVec3;
use proptest::array::uniform3;
use proptest::prelude::*;
use proptest::sample::select;

use crate::oracle::Triangle;
use crate::plain_f64::{axes_of_triangle_and_box, corners_of_box, separated};
use crate::triangle_pairs::scaled;

/// A triangle in a container, and a point of it.
#[derive(Debug, Clone)]
pub struct OnPlanes {
    triangle: Triangle,
    /// Lowest and highest corner.
    container: [[f64; 3]; 2],
    /// A point of the triangle.
    pub point: [f64; 3],
}

impl OnPlanes {
    /// The triangle, and two points that hold the container open.
    pub fn mesh(&self) -> PolygonMesh {
        let vertices = self.triangle.into_iter().chain(self.container).collect();
        PolygonMesh::from_polygons(vertices, [[0, 1, 2], [3, 3, 3], [4, 4, 4]])
    }

    /// The voxels of an order whose closed boxes hold the point, as places per axis.
    pub fn voxels(&self, lattice: &Lattice, order: u32) -> Vec<[u32; 3]> {
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let last = (1u32 << halvings(lattice, order, axis)) - 1;
            let side = self.side(lattice, order, axis);
            let below = (((self.point[axis] - self.container[0][axis]) / side).floor() as u32).min(last);
            let on_plane = below > 0 && self.plane(lattice, order, axis, below) == self.point[axis];
            below - u32::from(on_plane)..=below
        });
        let mut voxels = Vec::new();
        for (x, y) in x.flat_map(|x| y.clone().map(move |y| (x, y))) {
            voxels.extend(z.clone().map(|z| [x, y, z]));
        }
        voxels
    }

    /// Whether plain f64, without a bound on its rounding, would leave the triangle out of one of these voxels.
    pub fn plain_f64_loses_one(&self, lattice: &Lattice, order: u32, voxels: &[[u32; 3]]) -> bool {
        let triangle = self.triangle.map(DVec3::from);
        let corner = |voxel: &[u32; 3], offset: u32| {
            DVec3::from([0, 1, 2].map(|axis| self.plane(lattice, order, axis, voxel[axis] + offset)))
        };
        let axes = axes_of_triangle_and_box(&triangle);
        voxels.iter().any(|voxel| separated(&axes, &triangle, &corners_of_box([corner(voxel, 0), corner(voxel, 1)])))
    }

    fn side(&self, lattice: &Lattice, order: u32, axis: usize) -> f64 {
        scaled(self.container[1][axis] - self.container[0][axis], -halvings(lattice, order, axis))
    }

    fn plane(&self, lattice: &Lattice, order: u32, axis: usize, index: u32) -> f64 {
        self.container[0][axis] + f64::from(index) * self.side(lattice, order, axis)
    }
}

fn halvings(lattice: &Lattice, order: u32, axis: usize) -> i32 {
    lattice.axes().iter().take(order as usize).filter(|&&halved| usize::from(halved) == axis).count() as i32
}

/// Triangles that have a point on the planes of an order up to about 18, or a few ulp beside some of them, in containers of any
/// shape, at any scale.
pub fn on_planes() -> impl Strategy<Value = OnPlanes> {
    // Sides 2^k, and where they begin.
    let axis = (40..=51i32, prop_oneof![Just(0i64), -(1i64 << 51)..1i64 << 51]);
    let share =
        || prop_oneof![4 => -1.0..1.0, 1 => Just(0.0), 1 => (-1.0..1.0, -50..0i32).prop_map(|(x, e)| scaled(x, e))];
    let beside = uniform3(prop_oneof![3 => Just(0i64), 1 => -3..=3i64]);
    let exponent = prop_oneof![Just(0), -1074..=970i32, -1074..=-1050i32];
    (uniform3(axis), uniform3(0..=64i64), beside, uniform3(share()), uniform3(share()), select(vec![0, 1, 2]), exponent)
        .prop_map(|(axes, places, beside, d, e, kind, exponent)| {
            let low = axes.map(|(_, low)| low);
            let high = axes.map(|(side, low)| low + (1i64 << side));
            let point: [i64; 3] = std::array::from_fn(|i| {
                (low[i] + places[i] * ((high[i] - low[i]) >> 6) + beside[i]).clamp(low[i], high[i])
            });
            // Half of the way to the nearer end, so that the sum of both stays inside.
            let room = |i: usize| (point[i] - low[i]).min(high[i] - point[i]) as f64 / 2.0;
            let step = |shares: [f64; 3]| -> [i64; 3] { std::array::from_fn(|i| (shares[i] * room(i)) as i64) };
            let (d, e) = (step(d), step(e));
            let at = |m: i64, n: i64| [0, 1, 2].map(|i| scaled((point[i] + m * d[i] + n * e[i]) as f64, exponent));
            let triangle = match kind {
                0 => [at(1, 0), at(-1, 0), at(0, 1)],
                1 => [at(1, 0), at(0, 1), at(-1, -1)],
                _ => [at(0, 0), at(1, 0), at(0, 1)],
            };
            let container = [low, high].map(|end| end.map(|x| scaled(x as f64, exponent)));
            OnPlanes { triangle, container, point: at(0, 0) }
        })
}
