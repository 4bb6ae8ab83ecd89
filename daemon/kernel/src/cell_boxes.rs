//! Boxes within the cells: how far what they hold really reaches.
//!
//! A surface seldom fills the cells that it passes through. A box with the sides of the cell, but only as large as the polygons
//! in it, proves most pairs of cells apart that their own sizes would leave open.

use glam::DVec3;
use rayon::prelude::*;

use crate::cells::Cut;
use crate::container::Lattice;
use crate::object::Progress;
use crate::voxel_matrix::Node;

/// The sides of a cell are divided into so many grains.
pub(crate) const GRAINS: u32 = 256;

/// A box within a cell: the first and the last grain, per axis, that its polygons reach. Both belong to it whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CellBox {
    pub min: [u8; 3],
    pub max: [u8; 3],
}

impl CellBox {
    pub const WHOLE: CellBox = CellBox { min: [0; 3], max: [u8::MAX; 3] };
    /// Holds nothing.
    const EMPTY: CellBox = CellBox { min: [u8::MAX; 3], max: [0; 3] };

    fn is_empty(&self) -> bool {
        self.min[0] > self.max[0]
    }

    fn holds(&self, other: &CellBox) -> bool {
        (0..3).all(|axis| self.min[axis] <= other.min[axis] && other.max[axis] <= self.max[axis])
    }

    fn join(&mut self, other: &CellBox) {
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(other.min[axis]);
            self.max[axis] = self.max[axis].max(other.max[axis]);
        }
    }

    /// The same box in the grains of the cell that `cut` has made this part of.
    fn in_parent(&self, cut: &Cut, part: usize) -> CellBox {
        let (place, bits) = cut.place(part);
        let grain = |axis: usize, grain: u8| ((place[axis] * GRAINS + u32::from(grain)) >> bits[axis]) as u8;
        CellBox {
            min: [0, 1, 2].map(|axis| grain(axis, self.min[axis])),
            max: [0, 1, 2].map(|axis| grain(axis, self.max[axis])),
        }
    }
}

/// The boxes of all cells but the container, which is its own.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellBoxes {
    /// Of the voxels of each level from the second one on, in their order.
    voxels: Vec<Vec<CellBox>>,
    /// Of the octants of each level, in the order of their nodes.
    octants: Vec<Vec<CellBox>>,
    /// Per level and node: where its octants start.
    first_octants: Vec<Vec<u32>>,
}

impl CellBoxes {
    /// From the boxes of the voxels of the full order.
    pub fn of(lattice: &Lattice, levels: &[Vec<Node>], voxels: Vec<CellBox>) -> CellBoxes {
        let mut boxes = CellBoxes::default();
        let mut children = voxels;
        for (nodes, cuts) in levels.iter().zip(lattice.cuts().chunks(2)).rev() {
            let mut first_octants = Vec::with_capacity(nodes.len());
            let (mut octants, mut parents) = (Vec::new(), Vec::with_capacity(nodes.len()));
            let mut next = children.iter();
            for node in nodes {
                first_octants.push(octants.len() as u32);
                let mut parent = CellBox::EMPTY;
                for octant in parts_of(node.octants()) {
                    let mut all = CellBox::EMPTY;
                    for part in parts_of(node.octant(octant as u8)) {
                        let child = next.next().map_or(CellBox::WHOLE, |child| child.in_parent(&cuts[1], part));
                        all.join(&child);
                    }
                    octants.push(all);
                    parent.join(&all.in_parent(&cuts[0], octant));
                }
                parents.push(parent);
            }
            boxes.voxels.push(std::mem::replace(&mut children, parents));
            boxes.octants.push(octants);
            boxes.first_octants.push(first_octants);
        }
        boxes.voxels.reverse();
        boxes.octants.reverse();
        boxes.first_octants.reverse();
        boxes
    }

    /// Where the octants of a node of `level` start.
    #[inline(always)]
    pub fn first_octant(&self, level: usize, node: u32) -> u32 {
        self.first_octants[level][node as usize]
    }

    #[inline(always)]
    pub fn of_octant(&self, level: usize, number: u32) -> &CellBox {
        &self.octants[level][number as usize]
    }

    /// Of a child of a node of `level`.
    #[inline(always)]
    pub fn of_child(&self, level: usize, number: u32) -> &CellBox {
        &self.voxels[level][number as usize]
    }

    /// How many there are of octants of the nodes of `level`, and of their children.
    pub fn counts(&self, level: usize) -> [usize; 2] {
        [self.octants[level].len(), self.voxels[level].len()]
    }

    /// Memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        let boxes = self.voxels.iter().chain(&self.octants).map(|boxes| size_of_val(boxes.as_slice()));
        boxes.sum::<usize>() + self.first_octants.iter().map(|first| size_of_val(first.as_slice())).sum::<usize>()
    }
}

fn parts_of(mut mask: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let part = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (part < u8::BITS).then_some(part as usize)
    })
}

/// Voxels that one thread takes at a time.
const CHUNK: usize = 1 << 8;
/// Voxels that are shared out at once, a few milliseconds of work.
const TURN: usize = 1 << 14;

/// The boxes of the voxels of the full order: `places` says where they are, `triangles` what they list.
pub(crate) fn boxes_of_voxels<'l>(
    lattice: &Lattice,
    places: &[[u32; 3]],
    triangles: &(impl Fn(usize) -> &'l [u32] + Sync),
    corners_of: &(impl Fn(u32) -> [DVec3; 3] + Sync),
    progress: &dyn Progress,
) -> Vec<CellBox> {
    let grid = Grid::new(lattice);
    let mut boxes = vec![CellBox::WHOLE; places.len()];
    let fill = |boxes: &mut [CellBox], first: usize| {
        for (voxel, bounds) in (first..).zip(boxes) {
            *bounds = grid.bounds(places[voxel], triangles(voxel).iter().map(|&triangle| corners_of(triangle)));
        }
    };
    for (turn, boxes) in boxes.chunks_mut(TURN).enumerate() {
        let chunks = |boxes: &mut [CellBox]| {
            let chunks = boxes.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(chunk, boxes)| fill(boxes, turn * TURN + chunk * CHUNK));
        };
        progress.share(&mut || chunks(boxes));
    }
    boxes
}

/// The grains of all voxels of the full order.
struct Grid {
    middle: DVec3,
    /// Grains per unit of length; 0 along an axis without extent.
    per_length: DVec3,
    /// Halvings of each axis.
    bits: [u32; 3],
    /// What rounding may move a point by, in grains.
    margin: DVec3,
}

impl Grid {
    /// # Why nothing is lost
    /// Every point that a polygon has within the planes of a voxel is in the box that is found, or within the six roundings of
    /// the largest coordinate that [`submatrix`](crate::submatrix) grants the planes. Roundings, each of 2^-53, of 2g, where g
    /// is half the number of grains of the container: a corner passes 4 (grains per length, their product, the voxel's place).
    /// A corner that a cut makes is within 3 of the point at the computed share of its edge, whatever share that is, and that
    /// point is within 4 of the plane; the planes are moved out by `margin`, so what is cut off lies beyond the true plane.
    /// Six cuts one after the other: 4 + 6·7 = 46, that is 92 of g. The planes themselves: 6 of the largest coordinate. The
    /// margin is 128 of both, and is added to the box again. Halving subnormal coordinates loses four times 2^-1075.
    fn new(lattice: &Lattice) -> Grid {
        const ROUNDING: f64 = 128.0 * (f64::EPSILON / 2.0);
        /// 2^-1070.
        const HALVING: f64 = f64::from_bits(1 << 4);
        let bits = lattice.bits_at(lattice.levels().len());
        let (half, reach) = (lattice.half_sides(), lattice.container().reach());
        let grains = [0, 1, 2].map(|axis| f64::from(GRAINS / 2) * f64::from(1u32 << bits[axis]));
        let per_length = [0, 1, 2].map(|axis| {
            let per_length = grains[axis] / half[axis];
            if per_length.is_finite() { per_length } else { 0.0 }
        });
        // Without extent, or hardly any: every point counts as in the middle of its voxel, give or take the whole side.
        let margin = [0, 1, 2].map(|axis| match per_length[axis] {
            0.0 => f64::from(GRAINS),
            per_length => grains[axis] * ROUNDING + (reach[axis] * ROUNDING + HALVING) * per_length,
        });
        Grid { middle: lattice.middle(), per_length: per_length.into(), bits, margin: margin.into() }
    }

    /// The box of what some triangles have in a voxel.
    fn bounds(&self, place: [u32; 3], triangles: impl Iterator<Item = [DVec3; 3]>) -> CellBox {
        let first = DVec3::from([0, 1, 2].map(|axis| {
            if self.per_length[axis] == 0.0 {
                return -f64::from(GRAINS / 2);
            }
            let from_middle = 2 * i64::from(place[axis]) - (1i64 << self.bits[axis]);
            (from_middle * i64::from(GRAINS / 2)) as f64
        }));
        let mut all = CellBox::EMPTY;
        for corners in triangles {
            let [p, q, r] = corners.map(|corner| (corner - self.middle) * self.per_length - first);
            let uncut = self.grains(p.min(q).min(r), p.max(q).max(r));
            if !all.holds(&uncut) {
                all.join(&self.cut_off([p, q, r], &uncut));
            }
        }
        if all.is_empty() { CellBox::WHOLE } else { all }
    }

    /// The box of what a triangle has in a voxel; `uncut` is its own.
    fn cut_off(&self, corners: [DVec3; 3], uncut: &CellBox) -> CellBox {
        let mut polygon = Polygon::of(corners);
        let end = DVec3::splat(f64::from(GRAINS)) + self.margin;
        for axis in 0..3 {
            polygon.cut(axis, 1.0, end[axis]);
            polygon.cut(axis, -1.0, self.margin[axis]);
        }
        match polygon.bounds() {
            _ if polygon.is_full => *uncut,
            Some((min, max)) => self.grains(min, max),
            None => CellBox::EMPTY,
        }
    }

    /// The grains between two corners. Casts round towards 0, and go to the nearest end where the number is out of range.
    fn grains(&self, min: DVec3, max: DVec3) -> CellBox {
        let grains = |at: DVec3| at.to_array().map(|at| at as u8);
        CellBox { min: grains(min - self.margin), max: grains(max + self.margin) }
    }
}

/// A triangle of which parts have been cut off.
struct Polygon {
    /// A convex polygon gains at most one corner by a cut, so nine are enough; rounding may leave it a little less than convex.
    corners: [DVec3; 12],
    count: usize,
    /// Whether a corner had no room.
    is_full: bool,
}

impl Polygon {
    fn of([p, q, r]: [DVec3; 3]) -> Polygon {
        let mut polygon = Polygon { corners: [p; 12], count: 3, is_full: false };
        (polygon.corners[1], polygon.corners[2]) = (q, r);
        polygon
    }

    /// Cuts off what lies beyond a plane (Sutherland, Hodgman, "Reentrant Polygon Clipping", CACM 1974): `sign` times the
    /// coordinate is at most `limit`.
    fn cut(&mut self, axis: usize, sign: f64, limit: f64) {
        let beyond = |corner: &DVec3| sign * corner[axis] > limit;
        if !self.corners[..self.count].iter().any(beyond) {
            return;
        }
        let (corners, count) = (self.corners, std::mem::take(&mut self.count));
        for at in 0..count {
            let (start, end) = (corners[at], corners[if at + 1 < count { at + 1 } else { 0 }]);
            if !beyond(&start) {
                self.add(start);
            }
            if beyond(&start) != beyond(&end) {
                let share = (sign * limit - start[axis]) / (end[axis] - start[axis]);
                self.add(start + (end - start) * share);
            }
        }
    }

    fn add(&mut self, corner: DVec3) {
        match self.corners.get_mut(self.count) {
            Some(place) => (*place, self.count) = (corner, self.count + 1),
            None => self.is_full = true,
        }
    }

    /// The smallest and the largest coordinates.
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let corners = self.corners[..self.count].iter().map(|&corner| (corner, corner));
        corners.reduce(|(min, max), (corner, _)| (min.min(corner), max.max(corner)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::Cell;
    use crate::container::MAX_ORDER;
    use crate::mesh::PolygonMesh;
    use crate::object::Object;

    /// All cells of an object, from the container down.
    fn cells(object: &Object) -> Vec<Cell> {
        let (matrix, cuts) = (object.matrix(), object.matrix().lattice().cuts());
        let mut all = vec![Cell::container(object)];
        let mut next = 0;
        while let Some(cell) = all.get(next).copied() {
            next += 1;
            let Some(cut) = cuts.get(usize::from(cell.rank)) else { continue };
            let mut parts = matrix.parts(&cell);
            for part in parts_of(parts.occupied) {
                all.push(matrix.part(&cell, &parts, cut, part, matrix.bounds_of_part(&cell, &parts)));
                parts.pass();
            }
        }
        all
    }

    /// Points of each triangle, in halves of the container's sides from its middle.
    fn sampled(object: &Object) -> Vec<DVec3> {
        let lattice = object.matrix().lattice();
        let half = DVec3::from(lattice.half_sides());
        let corners = |triangle: &[u32; 3]| {
            triangle.map(|vertex| (DVec3::from(object.vertices()[vertex as usize]) - lattice.middle()) / half)
        };
        let points = |[a, b, c]: [DVec3; 3]| {
            let point = move |i: usize, j: usize| a + (b - a) * (i as f64 / 60.0) + (c - a) * (j as f64 / 60.0);
            (0..=60).flat_map(move |i| (0..=60 - i).map(move |j| point(i, j)))
        };
        object.triangles().iter().map(corners).flat_map(points).collect()
    }

    fn tetrahedron(size: f64, far: f64) -> Object {
        let vertices = vec![[0.0, 0.0, 0.0], [3.0, 0.1, 0.0], [0.2, 2.0, 0.1], [0.1, 0.3, 1.0]];
        let vertices = vertices.into_iter().map(|vertex| vertex.map(|coordinate| size * coordinate + far)).collect();
        let mesh = PolygonMesh::from_polygons(vertices, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
        Object::build(mesh, Some(14), &()).expect("a good mesh")
    }

    #[test]
    fn every_point_in_a_cell_is_in_its_box() {
        for (size, far) in [(1.0, 0.0), (1e-3, 7e5), (1e200, -1e199), (1e-300, 0.0)] {
            let object = tetrahedron(size, far);
            let (points, shares) = (sampled(&object), object.matrix().lattice().shares());
            // Samples are rounded where the container is far away.
            let rounding = 1e-14 * (1.0 + (far / size).abs());
            for cell in cells(&object) {
                let share = DVec3::from(shares[usize::from(cell.rank)].map(f64::from));
                let centre = DVec3::from(cell.centre.map(f64::from)) / f64::from(1u32 << MAX_ORDER);
                let grain = share * (2.0 / f64::from(GRAINS));
                let low = centre - share + grain * DVec3::from(cell.bounds.min.map(f64::from)) - rounding;
                let high = centre - share + grain * (DVec3::from(cell.bounds.max.map(f64::from)) + 1.0) + rounding;
                let inside = |point: &&DVec3| (**point - centre).abs().cmplt(share - rounding).all();
                for point in points.iter().filter(inside) {
                    assert!(point.cmpge(low).all() && point.cmple(high).all(), "{point} in {cell:?} of {size}");
                }
            }
        }
    }

    #[test]
    fn most_boxes_are_smaller_than_their_cells() {
        let object = tetrahedron(1.0, 0.0);
        let last = object.matrix().lattice().cuts().len();
        let voxels: Vec<CellBox> =
            cells(&object).iter().filter(|cell| usize::from(cell.rank) == last).map(|cell| cell.bounds).collect();
        let smaller = voxels.iter().filter(|bounds| **bounds != CellBox::WHOLE).count();
        assert!(2 * smaller > voxels.len(), "{smaller} of {}", voxels.len());
    }

    #[test]
    fn a_triangle_is_cut_off_at_the_sides_of_the_voxel() {
        let mesh = PolygonMesh::from_polygons(vec![[0.0; 3], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0]], [[0, 1, 2]]);
        let object = Object::build(mesh, Some(2), &()).expect("a good mesh");
        let boxes: Vec<_> = cells(&object).iter().map(|cell| (cell.centre, cell.bounds.min, cell.bounds.max)).collect();
        // The half of the square that is beyond the slanted side holds one corner of it alone.
        let quarter = 1 << (MAX_ORDER - 1);
        let found = boxes.iter().find(|(centre, ..)| *centre == [quarter, quarter, 0]);
        let (_, min, max) = found.expect("the corner is shared");
        assert_eq!((min[0], max[0], min[1], max[1]), (0, 0, 0, 0));
    }
}
