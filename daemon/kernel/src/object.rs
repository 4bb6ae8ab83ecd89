//! Objects: polygons in their own frame, cut into triangles, with their container and voxel matrix.

use std::sync::OnceLock;

use crate::cell_shapes::CellShapes;
use crate::container::{Container, MAX_ORDER};
use crate::mesh::PolygonMesh;
use crate::topology::Topology;
use crate::triangulation::triangulate;
use crate::voxel_matrix::{VoxelMatrix, automatic_order};
use crate::workforce::Workforce;

/// The most vertices, polygons or corners of one object.
pub const MAX_ELEMENTS: usize = 1 << 30;

/// Polygons in their own frame, their container and their voxel matrix. Immutable; changed by replacing it.
///
/// Polygons keep the caller's numbers. Inside, each is cut into triangles once (see the module `triangulation`); zero area is
/// allowed and kept.
#[derive(Debug, Clone)]
pub struct Object {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// The polygon of each triangle; empty when every polygon is a triangle, and the numbers are the same.
    polygon_of: Vec<u32>,
    polygon_count: usize,
    matrix: VoxelMatrix,
    shapes: OnceLock<CellShapes>,
    reach: [f64; 3],
    topology: OnceLock<Topology>,
}

/// Does the work of a build, and is told how far it has come, from worker threads. `&()` listens to nothing.
pub trait Progress: Workforce {
    /// `done` of `total` parts of the work. Threads report as they finish, so `done` may come out of order.
    fn advanced(&self, done: u64, total: u64);
}

impl Progress for () {
    fn advanced(&self, _: u64, _: u64) {}
}

/// Why polygons cannot become an object. Nothing is built then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjectError {
    /// NaN or infinity among the vertices, used or not.
    #[error("vertex {vertex} has {} = {value}; every coordinate must be a finite number", ["x", "y", "z"][*axis])]
    NonFiniteVertex {
        /// Number of the vertex.
        vertex: usize,
        /// 0, 1 or 2 for x, y or z.
        axis: usize,
        /// The coordinate.
        value: f64,
    },
    /// Fewer than 3 corners.
    #[error("polygon {polygon} has {corners} corners; a polygon needs at least 3")]
    TooFewCorners {
        /// Number of the polygon.
        polygon: usize,
        /// How many corners it has.
        corners: u32,
    },
    /// A corner names a vertex that is not there.
    #[error(
        "corner {corner} of polygon {polygon} is vertex {index}, but there are only {vertex_count} vertices (numbered from 0)"
    )]
    IndexOutOfRange {
        /// Number of the polygon.
        polygon: usize,
        /// Number of the corner in the polygon.
        corner: usize,
        /// The vertex it names.
        index: u32,
        /// How many vertices there are.
        vertex_count: usize,
    },
    /// `corner_counts` and `corners` do not belong together.
    #[error("the polygons have {expected} corners in all, but {found} corners are given")]
    CornerCount {
        /// What `corner_counts` add up to.
        expected: usize,
        /// How many corners there are.
        found: usize,
    },
    /// Beyond [`MAX_ELEMENTS`].
    #[error("the mesh has {count} {what}; at most {limit} are allowed, cut it into several objects")]
    TooManyElements {
        /// `vertices`, `polygons` or `corners`.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// Beyond [`MAX_ORDER`].
    #[error("order {order} is beyond the limit; give an order from 0 to {limit}, or none to have it chosen")]
    OrderOutOfRange {
        /// The order asked for.
        order: u32,
        /// The largest order.
        limit: u32,
    },
    /// The lists of the voxel matrix would take too much memory.
    #[error(
        "the voxel matrix of order {order} needs {entries} list entries or more; at most {limit} are allowed, give a lower order"
    )]
    MatrixTooLarge {
        /// The order asked for.
        order: u32,
        /// Entries counted when the build was given up.
        entries: usize,
        /// How many there may be.
        limit: usize,
    },
}

impl Object {
    /// Checks the polygons, cuts them into triangles and builds the voxel matrix.
    ///
    /// `order` is the order M of the matrix, 0 to [`MAX_ORDER`]; `None` chooses it from the polygons. Fewer halvings are made
    /// where f64 cannot split the container any more. A mesh without polygons is allowed; it never interferes.
    ///
    /// # Errors
    /// [`ObjectError`] names the vertex, polygon or limit.
    pub fn build(mesh: PolygonMesh, order: Option<u32>, progress: &dyn Progress) -> Result<Object, ObjectError> {
        check(&mesh)?;
        if let Some(order) = order.filter(|&order| order > MAX_ORDER) {
            return Err(ObjectError::OrderOutOfRange { order, limit: MAX_ORDER });
        }
        let (triangles, polygon_of) = cut(&mesh);
        let order = order.unwrap_or_else(|| automatic_order(triangles.len()));
        let matrix = VoxelMatrix::build(&mesh.vertices, &triangles, order, progress)?;
        let reach = Container::of(mesh.vertices.iter().copied()).map_or([0.0; 3], |all| all.reach());
        Ok(Object {
            polygon_count: mesh.polygon_count(),
            vertices: mesh.vertices,
            triangles,
            polygon_of,
            matrix,
            shapes: OnceLock::new(),
            reach,
            topology: OnceLock::new(),
        })
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Number of polygons, as the caller numbers them.
    pub fn polygon_count(&self) -> usize {
        self.polygon_count
    }

    /// Number of triangles that the polygons were cut into.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Positions in the object's frame.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// Vertex indices of the triangles, in the order of their polygons.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The polygon that a triangle was cut from.
    #[inline]
    pub fn polygon_of(&self, triangle: usize) -> u32 {
        if self.polygon_of.is_empty() { triangle as u32 } else { self.polygon_of[triangle] }
    }

    /// The container; `None` when there is no polygon.
    pub fn container(&self) -> Option<Container> {
        (!self.triangles.is_empty()).then(|| *self.matrix.lattice().container())
    }

    /// The voxel matrix.
    pub fn matrix(&self) -> &VoxelMatrix {
        &self.matrix
    }

    /// The triangles as a surface: closed or not, and its connected parts. Found out when first asked.
    pub fn topology(&self) -> &Topology {
        self.topology.get_or_init(|| Topology::of(&self.vertices, &self.triangles))
    }

    /// How thin the surface is in each cell. Found out when first asked.
    pub(crate) fn shapes(&self) -> &CellShapes {
        self.shapes.get_or_init(|| CellShapes::build(self))
    }

    /// Order M of the voxel matrix: halvings made.
    pub fn order(&self) -> u32 {
        self.matrix.lattice().order()
    }

    /// Voxels that at least one polygon occupies.
    pub fn occupied_voxels(&self) -> usize {
        self.matrix.occupied_voxels()
    }

    /// Memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.polygon_of.as_slice())
            + self.matrix.memory_bytes()
            + self.topology.get().map_or(0, Topology::memory_bytes)
            + self.shapes.get().map_or(0, CellShapes::memory_bytes)
    }

    /// The largest magnitude of each coordinate over all vertices, used or not.
    pub(crate) fn reach(&self) -> [f64; 3] {
        self.reach
    }
}

fn check(mesh: &PolygonMesh) -> Result<(), ObjectError> {
    let sizes =
        [("vertices", mesh.vertices.len()), ("polygons", mesh.corner_counts.len()), ("corners", mesh.corners.len())];
    if let Some(&(what, count)) = sizes.iter().find(|(_, count)| *count > MAX_ELEMENTS) {
        return Err(ObjectError::TooManyElements { what, count, limit: MAX_ELEMENTS });
    }
    check_vertices(&mesh.vertices)?;
    check_polygons(mesh)
}

fn check_vertices(vertices: &[[f64; 3]]) -> Result<(), ObjectError> {
    for (vertex, position) in vertices.iter().enumerate() {
        if let Some(axis) = position.iter().position(|coordinate| !coordinate.is_finite()) {
            return Err(ObjectError::NonFiniteVertex { vertex, axis, value: position[axis] });
        }
    }
    Ok(())
}

fn check_polygons(mesh: &PolygonMesh) -> Result<(), ObjectError> {
    let expected = mesh.corner_counts.iter().map(|&count| count as usize).sum();
    if expected != mesh.corners.len() {
        return Err(ObjectError::CornerCount { expected, found: mesh.corners.len() });
    }
    let vertex_count = mesh.vertices.len();
    // What is to be blamed is looked for only where there is something.
    let fewest = mesh.corner_counts.iter().copied().min().unwrap_or(3);
    let largest = mesh.corners.iter().copied().max();
    if fewest >= 3 && largest.is_none_or(|index| (index as usize) < vertex_count) {
        return Ok(());
    }
    for (polygon, corners) in mesh.polygons().enumerate() {
        if corners.len() < 3 {
            return Err(ObjectError::TooFewCorners { polygon, corners: corners.len() as u32 });
        }
        if let Some(corner) = corners.iter().position(|&index| index as usize >= vertex_count) {
            return Err(ObjectError::IndexOutOfRange { polygon, corner, index: corners[corner], vertex_count });
        }
    }
    Ok(())
}

/// Triangles in the order of their polygons, and the polygon of each (empty when the numbers are the same).
fn cut(mesh: &PolygonMesh) -> (Vec<[u32; 3]>, Vec<u32>) {
    if mesh.corners.len() == 3 * mesh.polygon_count() {
        // No polygon has fewer than three corners, so none has more.
        return (mesh.corners.as_chunks().0.to_vec(), Vec::new());
    }
    let mut triangles = Vec::with_capacity(mesh.corners.len() - 2 * mesh.polygon_count());
    let mut polygon_of = Vec::with_capacity(triangles.capacity());
    for (polygon, corners) in mesh.polygons().enumerate() {
        triangulate(&mesh.vertices, corners, &mut triangles);
        polygon_of.resize(triangles.len(), polygon as u32);
    }
    (triangles, polygon_of)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn error(vertices: &[[f64; 3]], polygons: &[&[u32]], order: Option<u32>) -> ObjectError {
        let mesh = PolygonMesh::from_polygons(vertices.to_vec(), polygons);
        Object::build(mesh, order, &()).expect_err("a bad mesh")
    }

    #[test]
    fn bad_meshes_are_refused_by_name() {
        let nan = [[0.0; 3], [1.0, f64::NAN, 0.0], [0.0, 1.0, 0.0]];
        assert!(matches!(error(&nan, &[], None), ObjectError::NonFiniteVertex { vertex: 1, axis: 1, .. }));
        let found = error(&CORNERS, &[&[0, 1, 2], &[0, 1]], None);
        assert_eq!(found, ObjectError::TooFewCorners { polygon: 1, corners: 2 });
        let found = error(&CORNERS, &[&[0, 1, 2], &[0, 1, 3]], None);
        assert_eq!(found, ObjectError::IndexOutOfRange { polygon: 1, corner: 2, index: 3, vertex_count: 3 });
        let found = error(&CORNERS, &[&[0, 1, 2]], Some(31));
        assert_eq!(found, ObjectError::OrderOutOfRange { order: 31, limit: 30 });
        let mesh = PolygonMesh { vertices: CORNERS.to_vec(), corner_counts: vec![3], corners: vec![0, 1] };
        let found = Object::build(mesh, None, &()).expect_err("a corner is missing");
        assert_eq!(found, ObjectError::CornerCount { expected: 3, found: 2 });
    }

    #[test]
    fn an_empty_mesh_is_an_object_without_container() {
        let object = Object::build(PolygonMesh::default(), Some(12), &()).expect("empty is allowed");
        assert_eq!((object.container(), object.order(), object.occupied_voxels()), (None, 0, 0));
    }

    #[test]
    fn polygons_keep_their_numbers() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = PolygonMesh::from_polygons(vertices, [&[0u32, 1, 2, 3][..], &[0, 1, 2]]);
        let object = Object::build(mesh, None, &()).expect("good");
        let polygons: Vec<u32> = (0..object.triangle_count()).map(|triangle| object.polygon_of(triangle)).collect();
        assert_eq!(polygons, [0, 0, 1]);
    }
}
