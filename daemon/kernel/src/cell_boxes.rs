//! Boxes within the cells: how far what they hold really reaches.
//!
//! A surface seldom fills the cells that it passes through. A box with the sides of the cell, but only as large as the polygons
//! in it, proves most pairs of cells apart that their own sizes would leave open.

use glam::DVec3;
use rayon::prelude::*;

use crate::cells::Cut;
use crate::container::Lattice;
use crate::grid::Grid;
use crate::voxel_matrix::{BuildProgress, Node};

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
}

/// Where the parts of a cut are in the cell, and how many halvings they are smaller.
struct Parts {
    places: [[u32; 3]; 8],
    bits: [u32; 3],
}

impl Parts {
    fn of(cut: &Cut) -> Parts {
        let bits = [0, 1, 2].map(|axis| cut.bits_after()[axis] - cut.bits[axis]);
        Parts { places: std::array::from_fn(|part| cut.place(part).0), bits }
    }

    /// A box in this part, in the grains of the whole cell.
    #[inline(always)]
    fn in_whole(&self, part: usize, within: &CellBox) -> CellBox {
        let place = self.places[part];
        let grain = |axis: usize, grain: u8| ((place[axis] * GRAINS + u32::from(grain)) >> self.bits[axis]) as u8;
        CellBox {
            min: [0, 1, 2].map(|axis| grain(axis, within.min[axis])),
            max: [0, 1, 2].map(|axis| grain(axis, within.max[axis])),
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
            let [of_node, of_octant] = [0, 1].map(|cut| Parts::of(&cuts[cut]));
            let mut first_octants = Vec::with_capacity(nodes.len());
            let (mut octants, mut parents) = (Vec::new(), Vec::with_capacity(nodes.len()));
            let mut next = children.iter();
            for node in nodes {
                first_octants.push(octants.len() as u32);
                let mut parent = CellBox::EMPTY;
                for octant in parts_of(node.octants()) {
                    let mut all = CellBox::EMPTY;
                    for part in parts_of(node.octant(octant as u8)) {
                        let child = next.next().map_or(CellBox::WHOLE, |child| of_octant.in_whole(part, child));
                        all.join(&child);
                    }
                    octants.push(all);
                    parent.join(&of_node.in_whole(octant, &all));
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

/// The boxes of the voxels of the full order: `voxels` are their numbers, `triangles` says what they list.
pub(crate) fn boxes_of_voxels<'l>(
    grid: &Grid<'_>,
    voxels: &[u32],
    triangles: &(impl Fn(usize) -> &'l [u32] + Sync),
    corners_of: &(impl Fn(u32) -> [DVec3; 3] + Sync),
    progress: &BuildProgress<'_>,
) -> Vec<CellBox> {
    let mut boxes = vec![CellBox::WHOLE; voxels.len()];
    let fill = |boxes: &mut [CellBox], first: usize| {
        let mut scratch = Scratch::new();
        for (voxel, bounds) in (first..).zip(boxes) {
            *bounds = bounds_in_voxel(grid, grid.place(voxels[voxel]), triangles(voxel), corners_of, &mut scratch);
        }
    };
    for (turn, boxes) in boxes.chunks_mut(TURN).enumerate() {
        let chunks = |boxes: &mut [CellBox]| {
            let chunks = boxes.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(chunk, boxes)| fill(boxes, turn * TURN + chunk * CHUNK));
        };
        progress.share(&mut || chunks(boxes));
        progress.advanced(turn * TURN + boxes.len(), voxels.len());
    }
    boxes
}

/// The box of what some triangles have in a voxel.
///
/// # Why nothing is lost
/// Every point that a polygon has within the planes of a voxel is in the box that is found, or within the six roundings of
/// the largest coordinate that [`submatrix`](crate::submatrix) grants the planes. Roundings, each of 2^-53, of 2h, where h
/// is half the number of voxels of the container: a corner passes 5 (see [`Grid::new`]).
/// A corner that a cut makes is within 3 of the point at the computed share of its edge, whatever share that is, and that
/// point is within 4 of the plane; the planes are moved out by the grid's margin, so what is cut off lies beyond the true plane.
/// Six cuts one after the other: 5 + 6·7 = 47, that is 94 of h. The planes themselves: 6 of the largest coordinate. The
/// margin is 128 of both, and is added to the box again.
fn bounds_in_voxel(
    grid: &Grid<'_>,
    place: [u32; 3],
    triangles: &[u32],
    corners_of: &impl Fn(u32) -> [DVec3; 3],
    scratch: &mut Scratch,
) -> CellBox {
    let low = DVec3::from(place.map(f64::from));
    let mut all = CellBox::EMPTY;
    for triangles in triangles.chunks(FETCHED) {
        scratch.seen.clear();
        // First all that has to be fetched from memory, so that one triangle need not wait for another.
        scratch.seen.extend(triangles.iter().map(|&triangle| Seen::new(grid, low, corners_of(triangle))));
        for triangle in &scratch.seen {
            if !all.holds(&triangle.uncut) {
                all.join(&triangle.cut_off(grid.margin, &mut scratch.polygons));
            }
        }
        if all == CellBox::WHOLE {
            return all;
        }
    }
    if all.is_empty() { CellBox::WHOLE } else { all }
}

/// Triangles that are fetched together.
const FETCHED: usize = 16;

/// What is kept from voxel to voxel, so that room for it is made once.
struct Scratch {
    seen: Vec<Seen>,
    polygons: Polygons,
}

impl Scratch {
    fn new() -> Scratch {
        Scratch { seen: Vec::with_capacity(FETCHED), polygons: [[[0.0; 3]; MOST_CORNERS]; 2] }
    }
}

/// A triangle, measured in voxels from the low corner of one.
struct Seen {
    corners: [DVec3; 3],
    min: DVec3,
    max: DVec3,
    /// The box of all of it.
    uncut: CellBox,
}

impl Seen {
    #[inline(always)]
    fn new(grid: &Grid<'_>, low: DVec3, corners: [DVec3; 3]) -> Seen {
        let corners = corners.map(|corner| grid.seen_from(low, corner));
        let [p, q, r] = corners;
        let (min, max) = (p.min(q).min(r), p.max(q).max(r));
        Seen { corners, min, max, uncut: grains(min - grid.margin, max + grid.margin) }
    }

    /// The box of what it has in the voxel.
    #[inline(always)]
    fn cut_off(&self, margin: DVec3, polygons: &mut Polygons) -> CellBox {
        let end = DVec3::ONE + margin;
        let (below, above) = (self.min.cmplt(-margin), self.max.cmpgt(end));
        if !(below | above).any() {
            return self.uncut;
        }
        let mut polygon = Polygon::of(self.corners, polygons);
        for axis in 0..3 {
            if above.test(axis) {
                polygon.cut(axis, 1.0, end[axis]);
            }
            if below.test(axis) {
                polygon.cut(axis, -1.0, margin[axis]);
            }
        }
        match polygon.bounds() {
            _ if polygon.is_full => self.uncut,
            Some((min, max)) => grains(min - margin, max + margin),
            None => CellBox::EMPTY,
        }
    }
}

/// The grains between two corners. Casts round towards 0, and go to the nearest end where the number is out of range.
#[inline(always)]
fn grains(min: DVec3, max: DVec3) -> CellBox {
    let grains = |at: DVec3| (at * f64::from(GRAINS)).to_array().map(|at| at as u8);
    CellBox { min: grains(min), max: grains(max) }
}

/// A convex polygon gains at most one corner by a cut, so nine are enough; rounding may leave it a little less than convex.
const MOST_CORNERS: usize = 12;

/// Room for a polygon and for what a cut leaves of it.
type Polygons = [[[f64; 3]; MOST_CORNERS]; 2];

/// A triangle of which parts have been cut off.
struct Polygon<'s> {
    corners: &'s mut [[f64; 3]; MOST_CORNERS],
    spare: &'s mut [[f64; 3]; MOST_CORNERS],
    count: usize,
    /// Whether a corner had no room.
    is_full: bool,
}

impl<'s> Polygon<'s> {
    #[inline(always)]
    fn of(corners: [DVec3; 3], [room, spare]: &'s mut Polygons) -> Polygon<'s> {
        room[..3].copy_from_slice(&corners.map(|corner| corner.to_array()));
        Polygon { corners: room, spare, count: 3, is_full: false }
    }

    /// Cuts off what lies beyond a plane (Sutherland, Hodgman, "Reentrant Polygon Clipping", CACM 1974): `sign` times the
    /// coordinate is at most `limit`.
    #[inline(always)]
    fn cut(&mut self, axis: usize, sign: f64, limit: f64) {
        let beyond = |corner: &[f64; 3]| sign * corner[axis] > limit;
        let corners = &self.corners[..self.count];
        if !corners.iter().any(beyond) {
            return;
        }
        let mut count = 0;
        let mut add = |corner: [f64; 3]| {
            match self.spare.get_mut(count) {
                Some(place) => (*place, count) = (corner, count + 1),
                None => self.is_full = true,
            };
        };
        let Some(mut start) = corners.last() else { return };
        let mut starts_beyond = beyond(start);
        for end in corners {
            let ends_beyond = beyond(end);
            if starts_beyond != ends_beyond {
                let share = (sign * limit - start[axis]) / (end[axis] - start[axis]);
                add([0, 1, 2].map(|axis| start[axis] + (end[axis] - start[axis]) * share));
            }
            if !ends_beyond {
                add(*end);
            }
            (start, starts_beyond) = (end, ends_beyond);
        }
        self.count = count;
        std::mem::swap(&mut self.corners, &mut self.spare);
    }

    /// The smallest and the largest coordinates.
    #[inline(always)]
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let corners = self.corners[..self.count].iter().map(|&corner| (corner.into(), corner.into()));
        corners.reduce(|(min, max): (DVec3, DVec3), (corner, _)| (min.min(corner), max.max(corner)))
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

    /// Triangles about as large as the container, down to a 4,096th of it.
    fn soup(count: u64) -> Object {
        let share = |number: u64| (number.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64 / (1u64 << 24) as f64;
        let corner = |at: u64| {
            let (first, size) = (9 * (at / 3), 0.25f64.powi((at / 3 % 7) as i32));
            [0, 1, 2].map(|axis| share(first + axis) + size * share(1_000_000 + 3 * at + axis))
        };
        let polygons = (0..count as u32).map(|polygon| [3 * polygon, 3 * polygon + 1, 3 * polygon + 2]);
        let mesh = PolygonMesh::from_polygons((0..3 * count).map(corner).collect(), polygons);
        Object::build(mesh, Some(12), &()).expect("a good mesh")
    }

    #[test]
    fn a_triangle_is_listed_where_cutting_it_off_leaves_something_and_nowhere_else() {
        let object = soup(60);
        let matrix = object.matrix();
        let (grid, occupied) = (Grid::new(matrix.lattice()), matrix.occupied_at(12));
        let mut polygons = Scratch::new().polygons;
        for place in (0..1 << 12).map(|number| grid.place(number)) {
            let number = occupied.iter().position(|occupied| *occupied == place);
            let listed = number.map_or(&[][..], |number| matrix.triangles(matrix.depth(), number as u32));
            for (number, triangle) in object.triangles().iter().enumerate() {
                let corners = triangle.map(|vertex| DVec3::from(object.vertices()[vertex as usize]));
                let seen = Seen::new(&grid, DVec3::from(place.map(f64::from)), corners);
                let mut leaves_some = |margin| seen.cut_off(DVec3::splat(margin), &mut polygons) != CellBox::EMPTY;
                let is_listed = listed.contains(&(number as u32));
                assert!(is_listed || !leaves_some(0.0), "triangle {number} is missing in {place:?}");
                assert!(!is_listed || leaves_some(1e-9), "triangle {number} is not in {place:?}");
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
