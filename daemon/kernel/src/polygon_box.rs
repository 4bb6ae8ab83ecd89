//! Which voxels a triangle occupies: a conservative separating-axis test in the object's own frame.
//!
//! Akenine-Möller, "Fast 3D Triangle-Box Overlap Testing", JGT 2001: a triangle and a box are apart when an axis of the box,
//! the triangle's normal, or a product of an edge of each separates them. Here the box's own axes are compared exactly, and
//! the other ten with a bound on all rounding, so that no voxel that the exact triangle touches is ever left out.
//!
//! Most triangles are small for the voxels. One that lies between the planes of a single row of voxels occupies all that it
//! reaches, since it is connected; one within a single layer is a matter of two dimensions and three axes.

use std::array;

use glam::DVec3;

use crate::grid::Grid;

/// Blocks of voxels larger than this are searched from the container down, level by level.
const SMALL_BLOCK: u64 = 64;
/// Voxels are counted before they are listed where there may be more than this.
const MANY_VOXELS: u64 = 1 << 20;

/// Finds the voxels of the full order that triangles occupy, one triangle at a time.
pub(crate) struct Occupancy<'g> {
    grid: &'g Grid<'g>,
    numbers: Vec<u32>,
}

/// A block of voxels: the first and the last one per axis.
#[derive(Debug, Clone, Copy)]
struct Block {
    first: [u32; 3],
    last: [u32; 3],
}

/// One voxel or several that are one at a coarser order.
struct Node {
    level: usize,
    place: [u32; 3],
    number: u32,
}

impl<'g> Occupancy<'g> {
    pub fn new(grid: &'g Grid<'g>) -> Occupancy<'g> {
        Occupancy { grid, numbers: Vec::new() }
    }

    /// The numbers of the voxels that a triangle in the container occupies, ascending, one at least; `Err` when there are more than
    /// `limit`.
    #[inline]
    pub fn of(&mut self, corners: [DVec3; 3], limit: usize) -> Result<&[u32], TooMany> {
        let seen = corners.map(|corner| self.grid.seen_from(DVec3::ZERO, corner));
        let (min, max) = ends(&corners);
        let (at_min, at_max) = ends(&seen);
        let [x, y, z] =
            array::from_fn(|axis| self.grid.places_reached(axis, [min[axis], max[axis]], [at_min[axis], at_max[axis]]));
        let block = Block { first: [x[0], y[0], z[0]], last: [x[1], y[1], z[1]] };
        self.numbers.clear();
        if block.first == block.last {
            self.numbers.push((0..3).fold(0, |number, axis| number | self.grid.number_along(axis, block.first[axis])));
        } else {
            self.several(&block, seen, limit)?;
        }
        Ok(&self.numbers)
    }

    fn several(&mut self, block: &Block, seen: [DVec3; 3], limit: usize) -> Result<(), TooMany> {
        let origin = DVec3::from(block.first.map(f64::from));
        let outline = Outline::new(seen.map(|corner| corner - origin), block, self.grid.margin);
        let is_row = outline.axes().is_empty();
        if is_row && block.count() > limit as u64 {
            return Err(TooMany);
        }
        if is_row || block.count() <= SMALL_BLOCK {
            self.search(block, outline);
            return if self.numbers.len() <= limit { Ok(()) } else { Err(TooMany) };
        }
        let grid = self.grid;
        let container = || Node { level: 0, place: [0; 3], number: 0 };
        if block.count() > MANY_VOXELS {
            let mut count = 0;
            descend(grid, block, &outline, container(), &mut |_| {
                count += 1;
                count <= limit
            })?;
        }
        descend(grid, block, &outline, container(), &mut |number| {
            self.numbers.push(number);
            self.numbers.len() <= limit
        })
    }

    /// Compares every voxel of a block.
    #[inline(always)]
    fn search(&mut self, block: &Block, outline: Outline) {
        let outline = outline.widened(DVec3::splat(0.5));
        for z in block.first[2]..=block.last[2] {
            for y in block.first[1]..=block.last[1] {
                let in_row = self.grid.number_along(2, z) | self.grid.number_along(1, y);
                for x in block.first[0]..=block.last[0] {
                    if !outline.misses_point(block.offset([x, y, z]) + 0.5) {
                        self.numbers.push(in_row | self.grid.number_along(0, x));
                    }
                }
            }
        }
        self.numbers.sort_unstable();
    }
}

/// More voxels than there may be list entries.
#[derive(Debug)]
pub(crate) struct TooMany;

/// Visits the occupied voxels within a node, ascending, until `visit` says that it is enough.
fn descend(
    grid: &Grid<'_>,
    block: &Block,
    outline: &Outline,
    node: Node,
    visit: &mut impl FnMut(u32) -> bool,
) -> Result<(), TooMany> {
    let levels = grid.lattice.levels();
    let level = &levels[node.level];
    let bits = grid.lattice.bits_at(node.level + 1);
    let finer: [u32; 3] = array::from_fn(|axis| grid.bits[axis] - bits[axis]);
    let mut children = !0;
    for axis in 0..3 {
        let first = node.place[axis] << level.bits[axis];
        let end = first + (1 << level.bits[axis]);
        let start = (block.first[axis] >> finer[axis]).clamp(first, end) - first;
        let end = ((block.last[axis] >> finer[axis]) + 1).clamp(first, end) - first;
        children &= level.children_between(axis, start as usize..end as usize);
    }
    let side = DVec3::from(finer.map(|bits| f64::from(1u32 << bits)));
    for child in bits_of(children) {
        let place = level.place[child as usize];
        let place = array::from_fn(|axis| node.place[axis] << level.bits[axis] | u32::from(place[axis]));
        if outline.misses(block.offset(array::from_fn(|axis| place[axis] << finer[axis])), side) {
            continue;
        }
        let number = node.number << level.bits.iter().sum::<u32>() | child;
        if node.level + 1 < levels.len() {
            descend(grid, block, outline, Node { level: node.level + 1, place, number }, visit)?;
        } else if !visit(number) {
            return Err(TooMany);
        }
    }
    Ok(())
}

impl Block {
    fn count(&self) -> u64 {
        (0..3).map(|axis| u64::from(self.last[axis] - self.first[axis]) + 1).product()
    }

    fn is_wide(&self, axis: usize) -> bool {
        self.first[axis] < self.last[axis]
    }

    /// Where a voxel is, seen from the first one.
    #[inline(always)]
    fn offset(&self, place: [u32; 3]) -> DVec3 {
        DVec3::from(array::from_fn(|axis| f64::from(place[axis]) - f64::from(self.first[axis])))
    }
}

/// A direction along which a triangle's extent is known.
#[derive(Debug, Clone, Copy)]
struct Axis {
    direction: DVec3,
    /// The triangle's extent, widened by every rounding that the comparison with a box can suffer.
    min: f64,
    max: f64,
}

/// A triangle, ready to be compared with many voxels: corners are measured in voxels, from the first of its block.
struct Outline {
    axes: [Axis; 10],
    count: usize,
}

impl Outline {
    /// # Why nothing is lost
    /// A point that the exact triangle has between the planes of a voxel is, measured in voxels, within the grid's margin of a point
    /// of the triangle that is given here, as well as of the cube of side 1. Whatever vector the direction is after its own
    /// rounding, a common point has one coordinate along it. Roundings of 2^-53 of the direction's components times the coordinates,
    /// which are below the block's sides and 1 (and the margin): 1 in each corner's difference, 3 in the product of a corner, 3 in
    /// that of a box's middle, 3 in that of half its sides, and 1 in each sum of two of these, of which there are three. That is 13,
    /// and the slack is 32. Nothing underflows: corners that the container holds are whole multiples of 2^-54.
    fn new(corners: [DVec3; 3], block: &Block, margin: DVec3) -> Outline {
        let sides = DVec3::from(array::from_fn(|axis| f64::from(block.last[axis] - block.first[axis]) + 1.0));
        let slack = margin + (sides.max_element() + margin.max_element() + 1.0) * (16.0 * f64::EPSILON);
        let [a, b, c] = corners;
        let edges = [b - a, c - b, a - c];
        let nothing = Axis { direction: DVec3::ZERO, min: 0.0, max: 0.0 };
        let mut outline = Outline { axes: [nothing; 10], count: 0 };
        match array::from_fn(|axis| block.is_wide(axis)) {
            [true, true, true] => {
                let normal = edges[0].cross(edges[1]);
                outline.add(normal, corners.map(|corner| normal.dot(corner)), slack);
                outline.add_edges::<1, 2>(&edges, &corners, slack);
                outline.add_edges::<2, 0>(&edges, &corners, slack);
                outline.add_edges::<0, 1>(&edges, &corners, slack);
            }
            [false, true, true] => outline.add_edges::<1, 2>(&edges, &corners, slack),
            [true, false, true] => outline.add_edges::<2, 0>(&edges, &corners, slack),
            [true, true, false] => outline.add_edges::<0, 1>(&edges, &corners, slack),
            // Connected, and between the planes of the row: it is in each voxel that it reaches.
            _ => {}
        }
        outline
    }

    /// The axes at right angles to an edge and to the axis that is neither `U` nor `V`.
    #[inline(always)]
    fn add_edges<const U: usize, const V: usize>(&mut self, edges: &[DVec3; 3], corners: &[DVec3; 3], slack: DVec3) {
        for edge in edges {
            let (u, v) = (-edge[V], edge[U]);
            let mut direction = DVec3::ZERO;
            (direction[U], direction[V]) = (u, v);
            self.add(direction, corners.map(|corner| u * corner[U] + v * corner[V]), slack);
        }
    }

    /// `at` is where the corners are along the direction.
    #[inline(always)]
    fn add(&mut self, direction: DVec3, at: [f64; 3], slack: DVec3) {
        let slack = direction.abs().dot(slack);
        let (min, max) = (smaller(smaller(at[0], at[1]), at[2]), larger(larger(at[0], at[1]), at[2]));
        self.axes[self.count] = Axis { direction, min: min - slack, max: max + slack };
        self.count += 1;
    }

    fn axes(&self) -> &[Axis] {
        &self.axes[..self.count]
    }

    /// Whether no point of the triangle lies in a box, proven by one of the axes. The caller compares the boxes.
    fn misses(&self, low: DVec3, side: DVec3) -> bool {
        let half = 0.5 * side;
        let centre = low + half;
        self.axes().iter().any(|axis| {
            let (at, radius) = (axis.direction.dot(centre), axis.direction.abs().dot(half));
            at - radius > axis.max || at + radius < axis.min
        })
    }

    /// The extents with half the sides of a box added: what the middle of that box is compared with.
    #[inline(always)]
    fn widened(mut self, half: DVec3) -> Outline {
        for axis in &mut self.axes[..self.count] {
            let radius = axis.direction.abs().dot(half);
            (axis.min, axis.max) = (axis.min - radius, axis.max + radius);
        }
        self
    }

    #[inline(always)]
    fn misses_point(&self, point: DVec3) -> bool {
        self.axes().iter().any(|axis| {
            let at = axis.direction.dot(point);
            at > axis.max || at < axis.min
        })
    }
}

/// Unlike `f64::min` it need not look for NaN.
#[inline(always)]
fn smaller(one: f64, other: f64) -> f64 {
    if one < other { one } else { other }
}

#[inline(always)]
fn larger(one: f64, other: f64) -> f64 {
    if one > other { one } else { other }
}

/// The smallest and the largest coordinates.
#[inline(always)]
fn ends([a, b, c]: &[DVec3; 3]) -> (DVec3, DVec3) {
    (a.min(*b).min(*c), a.max(*b).max(*c))
}

/// The vector with its largest component scaled to 1, so that products of two of them neither overflow nor vanish.
pub(crate) fn unit_scale(vector: DVec3) -> DVec3 {
    let largest = vector.abs().max_element();
    if largest > 0.0 { vector / largest } else { DVec3::ZERO }
}

/// The positions of the bits that are set, lowest first.
pub(crate) fn bits_of(mut mask: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (bit < u64::BITS).then_some(bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::{Container, Lattice};

    /// A triangle within the container, about `size` of it.
    fn triangle(container: &Container, size: f64) -> [DVec3; 3] {
        let (min, side) = (DVec3::from(container.min), DVec3::from(container.max) - DVec3::from(container.min));
        let corners = [DVec3::new(0.0, 0.1, 0.05), DVec3::new(0.9, 0.7, 0.3), DVec3::new(0.2, 0.8, 0.95)];
        corners.map(|corner| min + side * (DVec3::new(0.03, 0.01, 0.02) + 0.95 * size * corner))
    }

    #[test]
    fn every_point_of_a_triangle_is_in_a_voxel_that_is_found_up_to_the_largest_order() {
        let containers = [[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [-3.0, 7.0, 1e3, 1.0, 8.0, 1e3 + 0.3]]
            .map(|[a, b, c, d, e, f]| Container { min: [a, b, c], max: [d, e, f] });
        let sizes = [(0, 1.0), (1, 1.0), (5, 0.1), (9, 1.0), (18, 1.0), (18, 0.01), (24, 0.1), (30, 0.05), (30, 0.001)];
        for (container, (order, size)) in containers.iter().flat_map(|container| sizes.map(|of| (container, of))) {
            let lattice = Lattice::new(*container, order);
            let (grid, corners) = (Grid::new(&lattice), triangle(container, size));
            let mut occupancy = Occupancy::new(&grid);
            let numbers = occupancy.of(corners, usize::MAX).expect("there is room").to_vec();
            assert!(numbers.is_sorted_by(|one, next| one < next), "order {order}");
            let points = (0..=99).flat_map(|i| (0..=99 - i).map(move |j| (f64::from(i) / 99.0, f64::from(j) / 99.0)));
            for (s, t) in points {
                let point = corners[0] + (corners[1] - corners[0]) * s + (corners[2] - corners[0]) * t;
                let seen = grid.seen_from(DVec3::ZERO, point);
                let number = (0..3).fold(0, |number, axis| {
                    let [place, _] = grid.places_reached(axis, [point[axis]; 2], [seen[axis]; 2]);
                    number | grid.number_along(axis, place)
                });
                assert!(numbers.binary_search(&number).is_ok(), "order {order}, size {size}: {point}");
            }
        }
    }

    #[test]
    fn more_voxels_than_there_may_be_are_refused() {
        let container = Container { min: [0.0; 3], max: [1.0; 3] };
        for order in [6, 24] {
            let lattice = Lattice::new(container, order);
            let grid = Grid::new(&lattice);
            let mut occupancy = Occupancy::new(&grid);
            let corners = triangle(&container, 1.0);
            let count = occupancy.of(corners, usize::MAX).expect("there is room").len();
            assert!(occupancy.of(corners, count - 1).is_err(), "order {order}");
            assert!(occupancy.of(corners, count).is_ok(), "order {order}");
        }
    }
}
