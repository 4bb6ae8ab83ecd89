//! Two small meshes and two affine maps, from bytes to the report.

use std::sync::Arc;

use collided_kernel::{Effects, Object, PolygonMesh};
use collided_protocol::step::Rows;

use super::effects::{effects_agree, levels_are_right};
use super::source::Source;
use super::{build_or_refuse, is_finite};
use crate::kernel_pair::{self, KernelPair};
use crate::oracle::{self, Triangle};

const MAX_VERTICES: usize = 10;
const MAX_POLYGONS: usize = 8;
const MAX_CORNERS: usize = 7;
/// Orders beyond this take more time than they show: two polygons on one another meet in ever more voxels.
const ORDERS: usize = 16;
/// Triangle pairs that are shown to the oracle, which is slow.
const ORACLE_PAIRS: usize = 4;

/// Builds two meshes and places them. A mesh or a step is refused exactly when it has a number that is not finite (or a corner
/// that is not there); the report is what the brute-force twin finds, whichever body is first; and the twin's triangle test
/// agrees with the exact oracle. No level and no effect says anything else.
///
/// # Panics
/// When one of these does not hold.
pub fn meshes_and_transforms(bytes: &[u8]) {
    let mut source = Source::new(bytes);
    let orders = [0; 2].map(|_| source.below(ORDERS) as u32);
    let meshes = [0; 2].map(|_| mesh(&mut source));
    let rows = [0; 2].map(|_| source.transform());
    let [mesh_a, mesh_b] = meshes;
    let objects = (build_or_refuse(mesh_a, Some(orders[0])), build_or_refuse(mesh_b, Some(orders[1])));
    let (Some(a), Some(b)) = objects else { return };
    if let Some(interfering) = step_is_right([&a, &b], rows) {
        triangles_are_right([&a, &b], rows, &mut source);
        levels_are_right([&a, &b], rows, interfering);
        let before = source.transform();
        if is_finite(&b, &before) {
            effects_agree([&a, &b], rows, before, interfering);
        }
    }
}

fn mesh(source: &mut Source<'_>) -> PolygonMesh {
    let vertices: Vec<[f64; 3]> = (0..source.below(MAX_VERTICES + 1)).map(|_| source.point()).collect();
    let polygons: Vec<Vec<u32>> =
        (0..source.below(MAX_POLYGONS + 1)).map(|_| polygon(source, vertices.len())).collect();
    PolygonMesh::from_polygons(vertices, polygons)
}

/// Three corners or more but for one first byte in 256, and corners that are there but for the byte 255.
fn polygon(source: &mut Source<'_>, vertex_count: usize) -> Vec<u32> {
    let count = match source.byte() {
        255 => 2,
        byte => 3 + usize::from(byte) % (MAX_CORNERS - 2),
    };
    let corner = |source: &mut Source<'_>| match source.byte() {
        255 => u32::MAX,
        byte => u32::from(byte) % (vertex_count.max(1) as u32),
    };
    (0..count).map(|_| corner(source)).collect()
}

/// Checks the step, and says whether the surfaces meet; nothing when it was refused, and had to be.
fn step_is_right([a, b]: [&Arc<Object>; 2], [rows_a, rows_b]: [Rows; 2]) -> Option<bool> {
    let step = KernelPair::new(a, b, Effects::POLYGON_PAIRS).step(rows_a, rows_b);
    let finite = is_finite(a, &rows_a) && is_finite(b, &rows_b);
    let found = match step {
        Ok(found) => found,
        Err(error) => {
            assert!(!finite, "a finite step was refused: {error}");
            return None;
        }
    };
    assert!(finite, "a step with a number that is not finite was answered");
    assert_eq!(found, kernel_pair::brute_force([a, b], [&rows_a, &rows_b]));
    let swapped = KernelPair::new(b, a, Effects::POLYGON_PAIRS).step(rows_b, rows_a);
    assert_eq!(swapped.map(kernel_pair::Outcome::swapped).as_ref(), Ok(&found));
    let verdict = KernelPair::new(a, b, Effects::INTERFERENCE).step(rows_a, rows_b);
    assert_eq!(verdict.map(|outcome| outcome.interfering), Ok(found.interfering));
    Some(found.interfering)
}

fn triangles_are_right(objects: [&Object; 2], rows: [Rows; 2], source: &mut Source<'_>) {
    let [a, b] = [0, 1].map(|body| world_triangles(objects[body], &rows[body]));
    if a.is_empty() || b.is_empty() {
        return;
    }
    for _ in 0..ORACLE_PAIRS {
        let (p, q) = (&a[source.below(a.len())], &b[source.below(b.len())]);
        assert_eq!(kernel_pair::triangles(p, q), oracle::triangles(p, q), "{p:?} with {q:?}");
    }
}

fn world_triangles(object: &Object, rows: &Rows) -> Vec<Triangle> {
    let world = oracle::world_vertices(rows, object.vertices());
    object.triangles().iter().map(|triangle| triangle.map(|corner| world[corner as usize])).collect()
}
