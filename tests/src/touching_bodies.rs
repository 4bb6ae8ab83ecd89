//! Pairs of bodies that share a point to the bit and lie, up to rounding, on opposite sides of a plane through it: every stage
//! that discards sees them at the very edge of its decision.
//!
//! The bodies are dust: polygons that are single points, at two opposite corners of a container, at the common point and ever
//! closer to it, so that the descent towards it goes as deep as the matrix.

use collided_kernel::PolygonMesh;
use collided_kernel::affine::world_vertex;
use collided_kernel::glam::DVec3;
use collided_protocol::step::Rows;
use proptest::array::{uniform2, uniform3};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use crate::plain_f64::{axes_of_boxes, corners_of_box, separated};
use crate::transforms::{Linear, extreme_linear};
use crate::triangle_pairs::{nudged, scaled};

/// Two dust bodies and where they are.
#[derive(Debug, Clone)]
pub struct Touching {
    /// The first [`COPIES`] polygons of both are the common point.
    pub meshes: [PolygonMesh; 2],
    /// The transforms.
    pub rows: [Rows; 2],
    /// Two opposite corners of each container.
    containers: [[DVec3; 2]; 2],
}

/// How many polygons of each body are the common point. Their pairs are more than a voxel pair may keep without being split.
pub const COPIES: usize = 3;

impl Touching {
    /// Whether comparing the containers by plain f64, without a bound on its rounding, would call them apart.
    pub fn plain_f64_loses_it(&self) -> bool {
        let corners = [0, 1].map(|body| {
            corners_of_box(self.containers[body]).map(|corner| world_vertex(&self.rows[body], corner.to_array()))
        });
        let [edges_a, edges_b] = self.rows.map(|rows| columns(&rows.map(|[x, y, z, _]| [x, y, z])));
        separated(&axes_of_boxes(&edges_a, &edges_b), &corners[0], &corners[1])
    }
}

/// How one body is made.
#[derive(Debug, Clone)]
struct Body {
    /// Lowest and highest coordinates, before the power of two.
    container: [Point; 2],
    linear: Linear,
    /// Where the common point is along the axes that the plane leaves free: a share of the side, and neighbours from there.
    place: [(f64, i8); 3],
    /// Where the dust thickens from, as shares of the sides.
    dust: Vec<Point>,
    /// Of the power of two of all coordinates in the object's frame.
    exponent: i32,
}

type Point = [f64; 3];

/// Bodies that touch. World sizes are about 2^`world_exponent`, object sizes about 2^`object_exponent`.
pub fn touching(
    object_exponent: impl Strategy<Value = i32> + Clone,
    world_exponent: impl Strategy<Value = i32>,
) -> impl Strategy<Value = Touching> {
    let shift = prop_oneof![
        2 => Just([0.0; 3]),
        2 => uniform3(-2.0..2.0),
        1 => (uniform3(-2.0..2.0), 10..50i32).prop_map(|(shift, exponent)| shift.map(|x| scaled(x, exponent))),
    ];
    let bodies = uniform2(body(object_exponent));
    (bodies, 0..PLANES, shift, world_exponent).prop_filter_map(
        "rounding leaves no translation that makes the points meet, or a coordinate overflows",
        |(bodies, plane, shift, exponent)| meeting(&bodies, plane, shift.map(|x| scaled(x, exponent)), exponent),
    )
}

fn body(exponent: impl Strategy<Value = i32>) -> impl Strategy<Value = Body> {
    let share = prop_oneof![
        2 => 0.0..1.0,
        2 => (0..=64i32).prop_map(|at| f64::from(at) / 64.0),
        1 => (0..=1i32 << 10).prop_map(|at| scaled(f64::from(at), -10)),
    ];
    let place = uniform3((share, -3..=3i8));
    let dust = vec(uniform3(0.0..=1.0), 6);
    (container(), extreme_linear(), place, dust, exponent).prop_map(|(container, linear, place, dust, exponent)| Body {
        container,
        linear,
        place,
        dust,
        exponent,
    })
}

/// Lowest and highest coordinates: sides on a grid, anywhere, thin, and far from the origin.
fn container() -> impl Strategy<Value = [Point; 2]> {
    let side = prop_oneof![
        2 => Just([0.0, 1.0]),
        2 => Just([-1.0, 1.0]),
        3 => (-1.0..1.0, 0.01..1.0).prop_map(|(low, side)| [low, low + side]),
        1 => (-1.0..1.0, -60..0i32).prop_map(|(low, side)| [low, low + scaled(1.0, side)]),
        1 => (-1.0..1.0, 5..50i32).prop_map(|(low, far)| [low + scaled(1.0, far), low + scaled(1.0, far) + 1.0]),
        1 => select(vec![0.0, 1.0]).prop_map(|at| [at, at]),
    ];
    uniform3(side).prop_map(|sides| [0, 1].map(|end| sides.map(|side| side[end])))
}

/// Fifteen axes of the boxes, and the world's own, along which the global bounding boxes are compared.
const PLANES: usize = 18;

fn meeting(bodies: &[Body; 2], plane: usize, shift: Point, world_exponent: i32) -> Option<Touching> {
    let edges = [0, 1].map(|body| columns(&bodies[body].linear));
    let normal = match plane.checked_sub(15) {
        Some(axis) => DVec3::AXES[axis],
        None => axes_of_boxes(&edges[0], &edges[1])[plane],
    };
    let points = [bodies[0].extreme(normal, 1.0), bodies[1].extreme(normal, -1.0)];
    let linear = [0, 1].map(|body| bodies[body].scaled_linear(world_exponent));
    let vertices = [0, 1].map(|body| bodies[body].vertices(points[body]));
    let rows_a = std::array::from_fn(|row| with_translation(linear[0][row], shift[row]));
    let target = world_vertex(&rows_a, vertices[0][0]);
    let mut rows_b = linear[1].map(|row| with_translation(row, 0.0));
    for (row, target) in rows_b.iter_mut().zip(target.to_array()) {
        row[3] = translation_to(*row, vertices[1][0], target)?;
    }
    let rows = [rows_a, rows_b];
    let all_finite = vertices.iter().zip(&rows).all(|(vertices, rows)| {
        vertices.iter().all(|&vertex| world_vertex(rows, vertex).is_finite() && DVec3::from(vertex).is_finite())
    });
    let containers = [0, 1].map(|body| bodies[body].container.map(|p| DVec3::from(bodies[body].in_object_units(p))));
    all_finite.then(|| Touching { meshes: vertices.map(|vertices| points_at(&vertices)), rows, containers })
}

impl Body {
    /// A point of the container that goes furthest along `sign · normal`; anywhere along edges at right angles to it.
    fn extreme(&self, normal: DVec3, sign: f64) -> Point {
        let [low, high] = self.container;
        let edges = columns(&self.linear);
        [0, 1, 2].map(|axis| {
            let along = sign * normal.dot(edges[axis]);
            let (share, neighbours) = self.place[axis];
            if along.abs() > scaled(normal.abs().dot(edges[axis].abs()), -45) {
                if along > 0.0 { high[axis] } else { low[axis] }
            } else {
                nudged(low[axis] + share * (high[axis] - low[axis]), neighbours).clamp(low[axis], high[axis])
            }
        })
    }

    fn in_object_units(&self, point: Point) -> Point {
        point.map(|x| scaled(x, self.exponent))
    }

    fn scaled_linear(&self, world_exponent: i32) -> Linear {
        self.linear.map(|row| row.map(|entry| scaled(entry, world_exponent - self.exponent)))
    }

    /// `first` some times, the corners of the container, and dust that thickens towards `first`.
    fn vertices(&self, first: Point) -> Vec<Point> {
        let [low, high] = self.container;
        let dust = self.dust.iter().enumerate().map(|(k, share)| {
            [0, 1, 2].map(|axis| {
                let from = low[axis] + share[axis] * (high[axis] - low[axis]);
                let nearer = first[axis] + scaled(from - first[axis], -5 * k as i32);
                nearer.clamp(low[axis], high[axis])
            })
        });
        let points = [first; COPIES].into_iter().chain([low, high]).chain(dust);
        points.map(|point| self.in_object_units(point)).collect()
    }
}

/// A body of polygons that are single points.
pub fn points_at(points: &[[f64; 3]]) -> PolygonMesh {
    PolygonMesh::from_polygons(points.to_vec(), (0..points.len() as u32).map(|i| [i; 3]))
}

fn columns(linear: &Linear) -> [DVec3; 3] {
    [0, 1, 2].map(|column| DVec3::from(linear.map(|row| row[column])))
}

fn with_translation([x, y, z]: Point, translation: f64) -> [f64; 4] {
    [x, y, z, translation]
}

/// The translation with which a row carries `point` to `target`, to the bit.
fn translation_to([x, y, z, _]: [f64; 4], point: Point, target: f64) -> Option<f64> {
    let before = (x * point[0] + y * point[1]) + z * point[2];
    (-2..=2).map(|steps| nudged(target - before, steps)).find(|translation| before + translation == target)
}
