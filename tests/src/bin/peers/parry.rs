//! What is asked of parry: its stock queries, and "dual", its bounding volume hierarchies traversed together with its own test of
//! two triangles in a short loop, which is faster.

use std::panic::{AssertUnwindSafe, catch_unwind};

use collided_kernel::PolygonMesh;
use collided_protocol::step::Rows;
use parry3d_f64::bounding_volume::BoundingVolume;
use parry3d_f64::math::{Matrix, Pose, Rotation, Vector};
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};
use parry3d_f64::query::details::intersection_test_support_map_support_map;
use parry3d_f64::query::{self, NonlinearRigidMotion, ShapeCastOptions};
use parry3d_f64::shape::{Shape, TriMesh};
use rayon::prelude::*;

/// No contact within the step.
pub const FREE: f64 = 2.0;
/// It panicked.
pub const PANICKED: f64 = -9.0;

/// Triangles as parry takes them.
pub struct Parts {
    vertices: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
}

impl Parts {
    pub fn of(triangles: &PolygonMesh) -> Parts {
        let vertices = triangles.vertices.iter().map(|&[x, y, z]| Vector::new(x, y, z)).collect();
        Parts { vertices, triangles: triangles.corners.as_chunks::<3>().0.to_vec() }
    }

    pub fn build(self) -> TriMesh {
        TriMesh::new(self.vertices, self.triangles).expect("parry takes the mesh")
    }
}

/// A rigid transform.
pub fn pose(rows: &Rows) -> Pose {
    let column = |j: usize| Vector::new(rows[0][j], rows[1][j], rows[2][j]);
    let rotation = Rotation::from_mat3(&Matrix::from_cols(column(0), column(1), column(2))).normalize();
    Pose::from_parts(column(3), rotation)
}

pub fn stock(at_a: &Pose, a: &TriMesh, at_b: &Pose, b: &TriMesh) -> bool {
    query::intersection_test(at_a, a, at_b, b).expect("parry tests meshes").intersecting
}

/// The pairs of triangles that interfere, as they are found; `b_in_a` carries the frame of `b` into that of `a`.
pub fn dual<'m>(b_in_a: &'m Pose, a: &'m TriMesh, b: &'m TriMesh) -> impl Iterator<Item = (u32, u32)> + 'm {
    let boxes = a.bvh().leaf_pairs(b.bvh(), move |x, y| x.aabb().intersects(&y.aabb().transform_by(b_in_a)));
    boxes.filter(move |&(i, j)| {
        let of_b = b.triangle(j).transformed(b_in_a);
        intersection_test_support_map_support_map(&Pose::identity(), &a.triangle(i), &of_b)
    })
}

pub fn distance(at_a: &Pose, a: &TriMesh, at_b: &Pose, b: &TriMesh) -> f64 {
    query::distance(at_a, a, at_b, b).expect("parry tests meshes").distance
}

/// The first contact of `b`, moving straight and turning about its frame's origin, with `a` at rest.
pub fn time_of_contact(at_a: &Pose, a: &TriMesh, [from, to]: [&Pose; 2], b: &TriMesh, rigid: bool) -> f64 {
    let velocity = to.translation - from.translation;
    let cast = || {
        let hit = if rigid {
            let angvel = (to.rotation * from.rotation.inverse()).to_scaled_axis();
            let still = NonlinearRigidMotion::constant_position(*at_a);
            let moves = NonlinearRigidMotion { start: *from, local_center: Vector::ZERO, linvel: velocity, angvel };
            query::cast_shapes_nonlinear(&still, a, &moves, b, 0.0, 1.0, true)
        } else {
            let options = ShapeCastOptions {
                max_time_of_impact: 1.0,
                target_distance: 0.0,
                stop_at_penetration: true,
                compute_impact_geometry_on_penetration: false,
            };
            query::cast_shapes(at_a, Vector::ZERO, a, from, velocity, b, options)
        };
        hit.ok().flatten().map_or(FREE, |hit| hit.time_of_impact)
    };
    catch_unwind(AssertUnwindSafe(cast)).unwrap_or(PANICKED)
}

/// Many bodies of one mesh: parry's hierarchy over their boxes, kept from step to step, then `dual`.
pub struct Crowd<'m> {
    mesh: &'m TriMesh,
    poses: Vec<Pose>,
    bodies: Bvh,
    workspace: BvhWorkspace,
    pairs: Vec<(u32, u32)>,
}

impl<'m> Crowd<'m> {
    pub fn new(mesh: &'m TriMesh, rows: &[Rows]) -> Crowd<'m> {
        let poses: Vec<Pose> = rows.iter().map(pose).collect();
        let (mut bodies, mut workspace) = (Bvh::new(), BvhWorkspace::default());
        for (pose, body) in poses.iter().zip(0..) {
            bodies.insert(mesh.compute_aabb(pose), body);
        }
        bodies.rebuild(&mut workspace, BvhBuildStrategy::Binned);
        Crowd { mesh, poses, bodies, workspace, pairs: Vec::new() }
    }

    /// Interfering pairs of bodies, after those of `moved` have gone to their new places.
    pub fn step(&mut self, rows: &[Rows], moved: &[u32], threads: usize) -> usize {
        for &body in moved {
            let pose = pose(&rows[body as usize]);
            self.poses[body as usize] = pose;
            self.bodies.insert_or_update_partially(self.mesh.compute_aabb(&pose), body, 0.0);
        }
        self.bodies.refit(&mut self.workspace);
        self.bodies.optimize_incremental(&mut self.workspace);
        self.pairs.clear();
        let pairs = &mut self.pairs;
        self.bodies.traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut |i, j| pairs.push((i, j)));
        let interfere = |&(i, j): &(u32, u32)| {
            let b_in_a = self.poses[i as usize].inv_mul(&self.poses[j as usize]);
            dual(&b_in_a, self.mesh, self.mesh).next().is_some()
        };
        match threads {
            1 => self.pairs.iter().filter(|&pair| interfere(pair)).count(),
            _ => self.pairs.par_iter().filter(|&pair| interfere(pair)).count(),
        }
    }
}
