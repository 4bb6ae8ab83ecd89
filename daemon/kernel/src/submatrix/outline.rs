//! The first look at two bodies, at a fraction of what a [`PairFrame`](super::PairFrame) costs: whether the sides of their containers,
//! or the voxels of one that lie in the container of the other, prove them apart.
//!
//! What belongs to a body alone is computed once a step. In the frame of a container, whose sides go from −1 to 1, the other container
//! lies within a *block*: an interval along each side. That is the interference submatrix of the whole container, and where none of
//! its voxels is occupied the bodies have no point in common.
//!
//! # Why nothing is lost
//! The axes are normals of the sides, n = e × f from edges of the container, or whatever came out of their rounding. By the argument of
//! [`submatrix`](super), along n no two common points are farther apart than its slack of 64 roundings of m, whatever n is. Used up of it,
//! by its table: the centres are world vertices and their difference, 6 with the middles; the products with n, 3; edges and reach, 8;
//! vertices, 5; planes of voxels and grains, 6; the division by the own edge and the place on the grid, 5 of the own container. Together
//! 33. What the other edges of the own container have along n is added: nothing but rounding, unless the body is flattened.

use glam::DVec3;

use super::{MAX_LEVELS, Placed, SLACK, SMALLEST, UNDERFLOW, columns, reach, sides, unit_columns};
use crate::affine::world_vertex;
use crate::cell_boxes::{CellBox, GRAINS};
use crate::container::{LatticeLevel, MAX_ORDER};
use crate::voxel_matrix::VoxelMatrix;

/// A body as its container in the world.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Outline {
    centre: DVec3,
    /// Half the sides.
    edges: [DVec3; 3],
    /// Of the sides.
    normals: [DVec3; 3],
    /// Per normal: its own edge along it, and what the two others reach.
    own: [f64; 3],
    rest: [f64; 3],
    /// Twice what bounds the world coordinates.
    twice: DVec3,
    /// What underflow can take.
    underflow: f64,
    /// Whether halving has not rounded a coordinate.
    is_exact: bool,
}

/// Intervals along the sides of a container that is divided into 2^30 along each; the first and the last of these, both of them whole.
#[derive(Debug, Clone, Copy)]
struct Block {
    first: [u32; 3],
    last: [u32; 3],
}

impl Outline {
    pub fn of(body: Placed<'_>) -> Outline {
        let lattice = body.object.matrix().lattice();
        let (columns, halves) = (columns(body.rows), lattice.half_sides());
        let edges = [0, 1, 2].map(|axis| columns[axis] * halves[axis]);
        let normals = sides(&unit_columns(columns));
        let along = normals.map(|normal| edges.map(|edge| normal.dot(edge)));
        let reach = reach(body.object);
        Outline {
            centre: world_vertex(body.rows, lattice.middle().to_array()),
            edges,
            normals,
            own: [0, 1, 2].map(|axis| along[axis][axis]),
            rest: [0, 1, 2].map(|axis| along[axis][(axis + 1) % 3].abs() + along[axis][(axis + 2) % 3].abs()),
            twice: 2.0 * body.magnitude,
            underflow: UNDERFLOW * (4.0 + reach.iter().sum::<f64>()),
            is_exact: reach.iter().all(|&reach| reach == 0.0 || reach >= SMALLEST),
        }
    }

    /// The block of this container that the other one lies in; `None` when it lies beside it.
    #[inline]
    fn block_of(&self, other: &Outline) -> Option<Block> {
        let (shift, twice) = (other.centre - self.centre, self.twice + other.twice);
        let underflow = self.underflow + other.underflow;
        let mut block = Block { first: [0; 3], last: [0; 3] };
        for axis in 0..3 {
            let normal = self.normals[axis];
            let [x, y, z] = other.edges.map(|edge| normal.dot(edge).abs());
            let slack = normal.abs().dot(twice) * (0.5 * SLACK) + underflow;
            let (offset, reach) = (normal.dot(shift), x + y + z + slack + self.rest[axis]);
            let own = self.own[axis].abs();
            // False for NaN: what is not proven apart is kept.
            if offset.abs() > reach + own {
                return None;
            }
            let offset = if self.own[axis] < 0.0 { -offset } else { offset };
            (block.first[axis], block.last[axis]) = (first_at((offset - reach) / own), last_at((offset + reach) / own));
        }
        Some(block)
    }
}

/// Places along half a side, and the last one along a side.
const HALF: f64 = (1u32 << (MAX_ORDER - 1)) as f64;
const LAST: u32 = (1 << MAX_ORDER) - 1;

/// The place on the grid of a share of half a side. NaN and what is below the side are at its start.
#[inline]
fn first_at(share: f64) -> u32 {
    // Casts round down, and make 0 of NaN.
    (((share.clamp(-1.0, 1.0) + 1.0) * HALF) as u32).min(LAST)
}

/// The same, NaN and what is above at the end.
#[inline]
fn last_at(share: f64) -> u32 {
    if share < 1.0 { first_at(share) } else { LAST }
}

/// Whether two bodies are proven apart.
pub(crate) fn are_apart([a, b]: [Placed<'_>; 2], [outline_a, outline_b]: [&Outline; 2]) -> bool {
    if !outline_a.is_exact || !outline_b.is_exact {
        return false;
    }
    let Some(in_a) = outline_a.block_of(outline_b) else { return true };
    let Some(in_b) = outline_b.block_of(outline_a) else { return true };
    is_vacant(a.object.matrix(), &in_a) || is_vacant(b.object.matrix(), &in_b)
}

/// Voxels looked at before the block counts as occupied: a few times what it takes to find one in it.
const MOST_VOXELS: usize = 32;

/// A node of the matrix on the way down: its number, its place in the lattice of its level, and which children are still to be looked at.
type Node = (u32, [u32; 3], u64);

/// A block of a larger share of the container is hardly ever empty: not worth a look.
const LARGEST_BLOCK: f64 = 1.0 / 16.0;

/// Whether no voxel in a block is proven to be occupied there. May give up.
fn is_vacant(matrix: &VoxelMatrix, block: &Block) -> bool {
    let levels = matrix.lattice().levels();
    let Some(first) = levels.first().filter(|_| block.share() < LARGEST_BLOCK) else { return false };
    let mut path: [Node; MAX_LEVELS] = [(0, [0; 3], 0); MAX_LEVELS];
    path[0].2 = matrix.node(0, 0).occupied & children_in(first, [0; 3], block);
    let (mut level, mut looked_at) = (0, 0);
    loop {
        let (number, index, open) = path[level];
        if open == 0 {
            match level {
                0 => return true,
                _ => level -= 1,
            }
            continue;
        }
        let (child, halved) = (open.trailing_zeros(), &levels[level]);
        path[level].2 = open & (open - 1);
        let place = halved.place[child as usize];
        let at = [0, 1, 2].map(|axis| index[axis] << halved.bits[axis] | u32::from(place[axis]));
        let number = matrix.node(level, number).child(child);
        let found = block.meets(matrix.boxes().of_child(level, number), at, halved);
        looked_at += 1;
        match (found, levels.get(level + 1)) {
            (Meets::Beside, _) => {}
            (Meets::Within, _) | (_, None) => return false,
            _ if looked_at == MOST_VOXELS => return false,
            (Meets::Across, Some(next)) => {
                level += 1;
                path[level] = (number, at, matrix.node(level, number).occupied & children_in(next, at, block));
            }
        }
    }
}

/// The children of a node at a place that lie in the block.
#[inline]
fn children_in(halved: &LatticeLevel, index: [u32; 3], block: &Block) -> u64 {
    let mut children = u64::MAX;
    for axis in 0..3 {
        let bits = halved.bits[axis];
        let (width, first) = (MAX_ORDER - halved.bits_before[axis] - bits, index[axis] << bits);
        let place = |at: u32| (at >> width).saturating_sub(first).min(1 << bits) as usize;
        // Before the node, or behind it: no child.
        let end = if block.last[axis] >> width < first { 0 } else { place(block.last[axis]) + 1 };
        children &= halved.children_between(axis, place(block.first[axis])..end.min(1 << bits));
    }
    children
}

/// How what a voxel holds lies to a block.
enum Meets {
    Beside,
    Across,
    Within,
}

impl Block {
    /// Of the container's volume.
    fn share(&self) -> f64 {
        (0..3).map(|axis| f64::from(self.last[axis] - self.first[axis]) * (1.0 / f64::from(LAST))).product()
    }

    /// How the box within a voxel lies to the block.
    #[inline]
    fn meets(&self, bounds: &CellBox, at: [u32; 3], halved: &LatticeLevel) -> Meets {
        let (mut is_beside, mut is_within) = (false, true);
        for axis in 0..3 {
            let width = MAX_ORDER - halved.bits_before[axis] - halved.bits[axis];
            let start = u64::from(at[axis]) << width;
            let grain = |grain: u32| start + ((u64::from(grain) << width) / u64::from(GRAINS));
            let (min, end) = (grain(bounds.min[axis].into()), grain(u32::from(bounds.max[axis]) + 1));
            let (first, last) = (u64::from(self.first[axis]), u64::from(self.last[axis]));
            is_beside |= min > last || end < first;
            is_within &= first <= min && end <= last;
        }
        match (is_beside, is_within) {
            (true, _) => Meets::Beside,
            (_, true) => Meets::Within,
            _ => Meets::Across,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affine::{IDENTITY, Rows, magnitude};
    use crate::mesh::PolygonMesh;
    use crate::object::Object;

    /// A box of triangles, a hundred on each side: its voxels are thin.
    fn hollow(half: f64) -> Object {
        let (mut vertices, mut polygons) = (Vec::new(), Vec::new());
        let at = |step: u32| half * (f64::from(step) / 5.0 - 1.0);
        for side in 0..6 {
            let first = vertices.len() as u32;
            let (axis, end) = (side / 2, if side % 2 == 0 { -half } else { half });
            vertices.extend((0..121).map(|corner| {
                let mut position = [end; 3];
                (position[(axis + 1) % 3], position[(axis + 2) % 3]) = (at(corner / 11), at(corner % 11));
                position
            }));
            let cells = (0..100).map(|cell| first + cell / 10 * 11 + cell % 10);
            polygons.extend(cells.map(|cell| [cell, cell + 1, cell + 12, cell + 11]));
        }
        Object::build(PolygonMesh::from_polygons(vertices, polygons), Some(12), &()).expect("a good mesh")
    }

    fn apart(a: &Object, b: &Object, rows: [&Rows; 2]) -> bool {
        let sides = [(a, rows[0]), (b, rows[1])];
        let sides = sides.map(|(object, rows)| Placed { object, rows, magnitude: magnitude(rows, object.reach()) });
        let outlines = sides.map(Outline::of);
        are_apart(sides, outlines.each_ref())
    }

    /// Turned about z, sheared, mirrored, and moved along x.
    fn placed(x: f64) -> Rows {
        let (sine, cosine) = 0.3f64.sin_cos();
        [[cosine, -sine, 0.0, x], [-sine, -cosine, 0.2, 0.0], [0.0, 0.0, 1.0, 0.0]]
    }

    #[test]
    fn what_lies_within_the_other_container_but_in_none_of_its_voxels_is_apart() {
        let (room, chair) = (hollow(4.0), hollow(0.5));
        for (x, expected) in [(0.0, true), (2.0, true), (3.7, false), (4.3, false), (6.0, true), (-40.0, true)] {
            let rows = placed(x);
            assert_eq!(apart(&room, &chair, [&IDENTITY, &rows]), expected, "at {x}");
            assert_eq!(apart(&chair, &room, [&rows, &IDENTITY]), expected, "at {x}, the other way round");
        }
    }

    #[test]
    fn what_cannot_be_compared_is_kept() {
        let cube = hollow(1.0);
        let flat = [[1.0, 0.0, 0.0, 0.5], [0.0; 4], [0.0, 0.0, 1.0, 0.0]];
        assert!(!apart(&cube, &cube, [&IDENTITY, &flat]));
        let huge = IDENTITY.map(|row| row.map(|entry| entry * 1e308));
        assert!(!apart(&cube, &cube, [&huge, &huge]));
        let points = [[0.0; 4]; 3];
        assert!(apart(&cube, &cube, [&points, &[[0.0, 0.0, 0.0, 5.0], [0.0; 4], [0.0; 4]]]));
        assert!(!apart(&cube, &cube, [&points, &points]));
    }

    #[test]
    fn places_on_the_grid_are_those_of_the_ends() {
        let middle = LAST / 2 + 1;
        assert_eq!([f64::NAN, f64::NEG_INFINITY, -1.0, 0.0, 2.0].map(first_at), [0, 0, 0, middle, LAST]);
        assert_eq!([f64::NAN, f64::INFINITY, 1.0, 0.0, -2.0].map(last_at), [LAST, LAST, LAST, middle, 0]);
    }
}
