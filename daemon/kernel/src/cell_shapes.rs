//! Slanted boxes within the cells: how thin the surface is where it passes through.
//!
//! A surface that is nearly flat within a cell fills little of an upright box. A box that is sheared along one axis, so that two of its
//! faces follow the surface, is as thin as the surface is curved: with each cut into halves it becomes four times thinner, as
//! the boxes of Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH 1996, section 4 do. Its other sides are those of the
//! [box](crate::cell_boxes) within the cell.
//!
//! Lengths are in halves of the container's sides, per axis, as those of [`Cell::centre`](crate::cells::Cell).

use glam::DVec3;

use crate::cells::Cell;
use crate::container::{Lattice, MAX_ORDER};
use crate::object::Object;
use crate::polygon_box::bits_of;
use crate::submatrix::HALVING;

/// What holds all that the polygons have in a cell: `centre + r·h₀·(e₁ + s₀·e₀) + s·h₁·(e₂ + s₁·e₀) + t·h₂·e₀`, r, s and t from −1 to 1, where
/// e₀ is the unit vector of `axis`, e₁ and e₂ those of the two that follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CellShape {
    /// From the centre of the cell.
    pub centre: [f32; 3],
    /// Of the second axis, the third one and `axis`.
    pub halves: [f32; 3],
    /// How much the second and the third side rise along `axis`.
    pub slopes: [f32; 2],
    pub axis: u32,
}

/// The shapes of all cells of one object. Built once.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellShapes {
    /// That of the container, then those of the parts of the cells of each rank, in their order.
    shapes: Vec<CellShape>,
    /// Per rank: where the parts of its cells start.
    starts: Vec<u32>,
}

impl CellShapes {
    pub fn build(object: &Object) -> CellShapes {
        let (matrix, lattice) = (object.matrix(), object.matrix().lattice());
        let (mut starts, mut count) = (Vec::new(), 1);
        for parts in (0..matrix.depth()).flat_map(|level| matrix.boxes().counts(level)) {
            starts.push(count as u32);
            count += parts;
        }
        let mut shapes = CellShapes { shapes: vec![CellShape::CONTAINER; count], starts };
        if object.container().is_none() {
            return shapes;
        }
        let surface = Surface::new(object);
        let (mut last_in, mut triangles) = (vec![0; object.triangle_count()], Vec::new());
        let mut open = vec![Cell::container(object)];
        while let Some(cell) = open.pop() {
            let Some(cut) = lattice.cuts().get(usize::from(cell.rank)) else { continue };
            let mut parts = matrix.parts(&cell);
            for part in bits_of(parts.occupied.into()) {
                let bounds = matrix.bounds_of_part(&cell, &parts);
                let next = matrix.part(&cell, &parts, cut, part as usize, bounds);
                let shares = lattice.shares()[usize::from(next.rank)].map(f64::from);
                let number = shapes.number(&cell, parts.next());
                // The lists of the voxels in a cell repeat.
                triangles.clear();
                let is_new = |&triangle: &u32| std::mem::replace(&mut last_in[triangle as usize], number) != number;
                triangles.extend(matrix.triangles_in(&next).iter().copied().filter(is_new));
                shapes.shapes[number as usize] = surface.shape(&next, shares, &triangles);
                open.push(next);
                parts.pass();
            }
        }
        shapes
    }

    /// The shape of this number.
    #[inline(always)]
    pub fn of(&self, number: u32) -> &CellShape {
        &self.shapes[number as usize]
    }

    /// Number of the shape of a part of a cell.
    #[inline(always)]
    pub fn number(&self, cell: &Cell, part: u32) -> u32 {
        self.starts[usize::from(cell.rank)] + part
    }

    /// Memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.shapes.as_slice()) + size_of_val(self.starts.as_slice())
    }
}

impl CellShape {
    pub const CONTAINER: CellShape = CellShape { centre: [0.0; 3], halves: [1.0; 3], slopes: [0.0; 2], axis: 0 };

    /// The upright box within a cell. All of it is exact in f32.
    fn upright(cell: &Cell, shares: [f64; 3]) -> CellShape {
        const HALF_GRAIN: f64 = 1.0 / crate::cell_boxes::GRAINS as f64;
        let bounds = &cell.bounds;
        let sum = |axis: usize| f64::from(bounds.min[axis]) + f64::from(bounds.max[axis]) + 1.0;
        let extent = |axis: usize| f64::from(bounds.max[axis]) - f64::from(bounds.min[axis]) + 1.0;
        let centre = [0, 1, 2].map(|axis| (shares[axis] * (sum(axis) * HALF_GRAIN - 1.0)) as f32);
        let halves = [1, 2, 0].map(|axis| (shares[axis] * extent(axis) * HALF_GRAIN) as f32);
        CellShape { centre, halves, slopes: [0.0; 2], axis: 0 }
    }

    /// The same box, its sides counted from this axis on.
    fn counted_from(&self, axis: usize) -> CellShape {
        let halves = [0, 1, 2].map(|side| self.halves[(side + axis) % 3]);
        CellShape { halves, axis: axis as u32, ..*self }
    }
}

/// The triangles of an object, as the shapes are measured.
struct Surface<'o> {
    triangles: &'o [[u32; 3]],
    vertices: Vec<DVec3>,
    /// Of each triangle, twice its area long.
    normals: Vec<DVec3>,
    /// What rounding may have moved a vertex by, per axis.
    error: DVec3,
}

impl<'o> Surface<'o> {
    /// A vertex passes five roundings of the largest coordinate (in the middle, in half the sides, in their difference) and two of itself;
    /// halving subnormal coordinates loses twice 2^-1075.
    fn new(object: &'o Object) -> Surface<'o> {
        const ROUNDING: f64 = 8.0 * (f64::EPSILON / 2.0);
        let lattice: &Lattice = object.matrix().lattice();
        let (half, reach) = (lattice.half_sides(), lattice.container().reach());
        let middle = lattice.middle();
        let relative = |axis: usize, at: f64| if half[axis] > 0.0 { (at - middle[axis]) / half[axis] } else { 0.0 };
        let place = |vertex: &[f64; 3]| DVec3::from([0, 1, 2].map(|axis| relative(axis, vertex[axis])));
        let error = [0, 1, 2].map(|axis| match half[axis] {
            0.0 => 0.0,
            half => ROUNDING * (1.0 + reach[axis] / half) + HALVING / half,
        });
        let vertices: Vec<DVec3> = object.vertices().iter().map(place).collect();
        let normal = |triangle: &[u32; 3]| {
            let [p, q, r] = triangle.map(|vertex| vertices[vertex as usize]);
            (q - p).cross(r - p)
        };
        let normals = object.triangles().iter().map(normal).collect();
        Surface { triangles: object.triangles(), vertices, normals, error: error.into() }
    }

    /// The thinner one of the box within a cell and the box that is sheared to follow these triangles.
    fn shape(&self, cell: &Cell, shares: [f64; 3], triangles: &[u32]) -> CellShape {
        let upright = CellShape::upright(cell, shares);
        self.slanted(cell, shares, triangles, &upright).unwrap_or(upright)
    }

    fn slanted(&self, cell: &Cell, shares: [f64; 3], triangles: &[u32], upright: &CellShape) -> Option<CellShape> {
        /// 2^-30.
        const UNIT: f64 = 1.0 / (1u64 << MAX_ORDER) as f64;
        /// A box that is but a little thinner has its sides aslant for nothing.
        const WORTH_IT: f64 = 0.8;
        /// 2^-20: more than a few roundings of f32.
        const F32_ROUNDING: f64 = 1.0 / (1 << 20) as f64;
        let normal = self.mean_normal(triangles);
        let steepness = (normal * DVec3::from(shares)).abs();
        let axis =
            if steepness.x >= steepness.y.max(steepness.z) { 0 } else { 1 + usize::from(steepness.z > steepness.y) };
        let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
        let slopes = [second, third].map(|other| (-normal[other] / normal[axis]) as f32);
        if !slopes.iter().all(|slope| slope.is_finite()) {
            return None;
        }
        let mut across = DVec3::ZERO;
        (across[axis], across[second], across[third]) = (1.0, -f64::from(slopes[0]), -f64::from(slopes[1]));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &number in triangles {
            for vertex in self.triangles[number as usize] {
                let height = across.dot(self.vertices[vertex as usize]);
                low = if height < low { height } else { low };
                high = if height > high { height } else { high };
            }
        }
        // Heights pass five more roundings of numbers up to 1 and the slopes.
        let error = 2.0 * across.abs().dot(self.error);
        let mut shape = upright.counted_from(axis);
        let mut at = DVec3::from(cell.centre.map(f64::from)) * UNIT;
        for other in [second, third] {
            at[other] += f64::from(shape.centre[other]);
        }
        let middle = 0.5 * low + 0.5 * high - across.dot(at);
        let half = (0.5 * high - 0.5 * low + error) * (1.0 + F32_ROUNDING) + middle.abs() * F32_ROUNDING;
        // False for NaN.
        let is_thin = half < WORTH_IT * f64::from(shape.halves[2]) && middle.abs() <= 2.0 * shares[axis];
        (shape.centre[axis], shape.halves[2], shape.slopes) = (middle as f32, half as f32, slopes);
        is_thin.then_some(shape)
    }

    /// The normals of triangles, turned to one side, since neighbours may be oriented either way.
    fn mean_normal(&self, triangles: &[u32]) -> DVec3 {
        triangles.iter().fold(DVec3::ZERO, |sum, &number| {
            let normal = self.normals[number as usize];
            if sum.dot(normal) < 0.0 { sum - normal } else { sum + normal }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::PolygonMesh;

    fn object(vertices: &[[f64; 3]], order: u32, size: f64, far: f64) -> Object {
        let vertices = vertices.iter().map(|vertex| vertex.map(|x| size * x + far)).collect();
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        Object::build(PolygonMesh::from_polygons(vertices, faces), Some(order), &()).expect("a good mesh")
    }

    /// All cells but the container, with their shapes.
    fn shapes(object: &Object) -> Vec<(Cell, CellShape)> {
        let (matrix, shapes) = (object.matrix(), object.shapes());
        let (mut open, mut all) = (vec![Cell::container(object)], Vec::new());
        while let Some(cell) = open.pop() {
            let Some(cut) = matrix.lattice().cuts().get(usize::from(cell.rank)) else { continue };
            let mut parts = matrix.parts(&cell);
            for part in bits_of(parts.occupied.into()) {
                let bounds = matrix.bounds_of_part(&cell, &parts);
                let next = matrix.part(&cell, &parts, cut, part as usize, bounds);
                all.push((next, *shapes.of(shapes.number(&cell, parts.next()))));
                open.push(next);
                parts.pass();
            }
        }
        all
    }

    const FLAT: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [3.0, 0.1, 0.0], [0.2, 2.0, 0.1], [0.1, 0.3, 1.0]];

    #[test]
    fn every_point_in_a_cell_is_in_its_shape() {
        /// 2^-30.
        const UNIT: f64 = 1.0 / (1u64 << MAX_ORDER) as f64;
        let plane = FLAT.map(|[x, y, _]| [x, y, 0.5]);
        let turned = FLAT.map(|[x, y, _]| [x, y, x - 0.3 * y]);
        let all =
            [(FLAT, 1.0, 0.0), (FLAT, 1e-3, 7e5), (FLAT, 1e200, -1e199), (FLAT, 1e-300, 0.0), (FLAT, 1e-310, 0.0)];
        for (vertices, size, far) in all.into_iter().chain([(plane, 1.0, 0.0), (turned, 1.0, 3.0)]) {
            let object = object(&vertices, 14, size, far);
            let lattice = object.matrix().lattice();
            let (half, middle) = (lattice.half_sides(), lattice.middle());
            // Samples are rounded where the container is far away or tiny.
            let rounding = 1e-14 * (1.0 + (far / size).abs()) + if size < 1e-305 { 1e-8 } else { 0.0 };
            let corner = |vertex: u32| {
                let at = object.vertices()[vertex as usize];
                let relative =
                    |axis: usize| if half[axis] > 0.0 { (at[axis] - middle[axis]) / half[axis] } else { 0.0 };
                DVec3::from([0, 1, 2].map(relative))
            };
            for (cell, shape) in shapes(&object) {
                let shares = lattice.shares()[usize::from(cell.rank)].map(f64::from);
                let cell_at = DVec3::from(cell.centre.map(f64::from)) * UNIT;
                for triangle in object.triangles() {
                    let [a, b, c] = triangle.map(corner);
                    for (i, j) in (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (f64::from(i), f64::from(j)))) {
                        let at = a + (b - a) * (i / 40.0) + (c - a) * (j / 40.0) - cell_at;
                        if (0..3).any(|axis| at[axis].abs() > shares[axis]) {
                            continue;
                        }
                        let axis = shape.axis as usize;
                        let at = at - DVec3::from(shape.centre.map(f64::from));
                        let [second, third] = [1, 2].map(|after| at[(axis + after) % 3]);
                        let [rise, other] = shape.slopes.map(f64::from);
                        let sides = [second, third, at[axis] - rise * second - other * third];
                        let within = |side: usize| sides[side].abs() <= f64::from(shape.halves[side]) + rounding;
                        assert!((0..3).all(within), "{size}: {at} of {cell:?} is not in {shape:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_face_is_thin_wherever_it_is_alone() {
        let object = object(&FLAT, 12, 1.0, 0.0);
        let last = object.matrix().lattice().cuts().len();
        let all = shapes(&object);
        let small = all.iter().filter(|(cell, _)| usize::from(cell.rank) == last && cell.triangles == 1);
        assert!(small.clone().count() > 20);
        assert!(small.clone().all(|(_, shape)| shape.halves[2] < 1e-5), "{:?}", small.collect::<Vec<_>>());
    }
}
