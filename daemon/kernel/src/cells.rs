//! Cells: the pyramid of a voxel matrix, three halvings at a time.
//!
//! Eight parts suit a descent through two pyramids better than the 64 children of a node: a pair that is proven apart early
//! saves all that would be compared further down. Cells of an even rank are the voxels of the levels, those of an odd rank
//! stand half-way between two levels: eight children of a node, one byte of its word.

use std::ops::Range;

use crate::cell_boxes::CellBox;
use crate::container::{HALVINGS_PER_LEVEL, Lattice, MAX_ORDER};
use crate::object::Object;
use crate::submatrix::Voxel;
use crate::voxel_matrix::{Node, VoxelMatrix};

/// Ranks of cells, the voxels of the full order included.
pub(crate) const MAX_RANKS: usize = 2 * MAX_ORDER.div_ceil(HALVINGS_PER_LEVEL) as usize + 1;

/// Up to three halvings, which cut a cell into up to eight parts. The first halving is the highest bit of a part's number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cut {
    /// Halvings of each axis before.
    pub bits: [u32; 3],
    axes: [u8; 3],
    halvings: usize,
    /// Where the centres of the parts are, seen from that of the cell; in the units of [`Cell::centre`].
    pub centres: [[i32; 3]; 8],
}

impl Cut {
    fn new(axes: &[u8], bits: [u32; 3]) -> Cut {
        let mut centres = [[0; 3]; 8];
        for (part, centre) in centres.iter_mut().enumerate().take(1 << axes.len()) {
            let mut bits = bits;
            for (halving, &axis) in axes.iter().enumerate() {
                bits[axis as usize] += 1;
                let offset = 1 << (MAX_ORDER - bits[axis as usize]);
                let is_upper = part >> (axes.len() - 1 - halving) & 1 == 1;
                centre[axis as usize] += if is_upper { offset } else { -offset };
            }
        }
        let mut cut = Cut { bits, axes: [0; 3], halvings: axes.len(), centres };
        cut.axes[..axes.len()].copy_from_slice(axes);
        cut
    }

    /// The axes that are halved, in turn.
    #[inline(always)]
    pub fn axes(&self) -> &[u8] {
        &self.axes[..self.halvings]
    }

    /// The two cuts of one level of the matrix. The second one makes three of its halvings, or all when they are fewer.
    pub fn pair(axes: &[u8], bits: [u32; 3]) -> [Cut; 2] {
        let (first, second) = axes.split_at(axes.len().saturating_sub(3));
        let first = Cut::new(first, bits);
        let between = first.bits_after();
        [first, Cut::new(second, between)]
    }

    /// The first halvings of the cut alone.
    pub fn first_halvings(&self, count: usize) -> Cut {
        Cut::new(&self.axes()[..count], self.bits)
    }

    /// Place of a part among its siblings, and halvings made, per axis.
    pub fn place(&self, part: usize) -> ([u32; 3], [u32; 3]) {
        let (mut place, mut bits) = ([0; 3], [0; 3]);
        for (halving, &axis) in self.axes().iter().enumerate() {
            let upper = (part >> (self.halvings - 1 - halving)) as u32 & 1;
            place[axis as usize] = place[axis as usize] << 1 | upper;
            bits[axis as usize] += 1;
        }
        (place, bits)
    }

    /// Whether any of these eight parts lies in each of the parts that the first halvings alone make.
    pub fn merged(&self, occupied: u8, count: usize) -> u8 {
        let run = 1usize << (self.halvings - count);
        let any = |part: usize| occupied >> (part * run) & ((1u16 << run) - 1) as u8 != 0;
        (0..1 << count).fold(0, |merged, part| merged | u8::from(any(part)) << part)
    }

    /// Halvings of each axis when the cut is made.
    pub fn bits_after(&self) -> [u32; 3] {
        let mut bits = self.bits;
        self.axes().iter().for_each(|&axis| bits[axis as usize] += 1);
        bits
    }
}

/// A cell of an object's matrix that some polygon occupies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cell {
    /// Cuts made.
    pub rank: u8,
    /// Of an odd rank: which eight children of the node.
    pub octant: u8,
    /// The node of the matrix that it is or lies in, or, at the last rank, the voxel's list.
    pub number: u32,
    /// What its polygons reach of it.
    pub bounds: CellBox,
    /// How many triangles occupy it, at most.
    pub triangles: u32,
    /// From the container's middle, in halves of its sides times 2^-30: whole numbers.
    pub centre: [i32; 3],
}

impl Cell {
    /// The container.
    pub fn container(object: &Object) -> Cell {
        let triangles = object.triangle_count() as u32;
        Cell { rank: 0, octant: 0, number: 0, bounds: CellBox::WHOLE, triangles, centre: [0; 3] }
    }
}

impl Cell {
    /// The cell that is a voxel of a level, at this place in its lattice.
    pub fn voxel(matrix: &VoxelMatrix, voxel: Voxel) -> Cell {
        let (level, lattice) = (usize::from(voxel.level), matrix.lattice());
        let bits = lattice.bits_at(level);
        let centre = |axis: usize| {
            let from_middle = 2 * i64::from(voxel.index[axis]) + 1 - (1i64 << bits[axis]);
            (from_middle << (MAX_ORDER - bits[axis])) as i32
        };
        let bounds =
            level.checked_sub(1).map_or(CellBox::WHOLE, |parent| *matrix.boxes().of_child(parent, voxel.number));
        Cell {
            rank: settled(lattice, 2 * voxel.level),
            octant: 0,
            number: voxel.number,
            bounds,
            triangles: matrix.triangle_count(level, voxel.number),
            centre: [0, 1, 2].map(centre),
        }
    }
}

/// A level of three halvings or fewer is cut once: its voxels are cells of the next rank.
#[inline(always)]
fn settled(lattice: &Lattice, rank: u8) -> u8 {
    rank + u8::from(lattice.cuts().get(usize::from(rank)).is_some_and(|cut| cut.axes().is_empty()))
}

/// The parts of a cell that some polygon occupies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parts {
    /// A bit each.
    pub occupied: u8,
    pub rank: u8,
    node: Node,
    /// Number of the next part, of the octants or of the voxels of the level.
    next: u32,
    /// Whether they are but the first halvings of what the matrix has.
    are_merged: bool,
}

impl VoxelMatrix {
    /// The parts of a cell.
    #[inline(always)]
    pub(crate) fn parts(&self, cell: &Cell) -> Parts {
        let level = usize::from(cell.rank / 2);
        let node = self.node(level, cell.number);
        if cell.rank.is_multiple_of(2) {
            let next = self.boxes().first_octant(level, cell.number);
            return Parts { occupied: node.octants(), rank: cell.rank + 1, node, next, are_merged: false };
        }
        let rank = settled(self.lattice(), cell.rank + 1);
        let next = node.child(8 * u32::from(cell.octant));
        Parts { occupied: node.octant(cell.octant), rank, node, next, are_merged: false }
    }

    /// What the polygons reach of the next of the parts, in turn.
    #[inline(always)]
    pub(crate) fn bounds_of_part(&self, cell: &Cell, parts: &Parts) -> CellBox {
        let level = usize::from(cell.rank / 2);
        match cell.rank % 2 {
            _ if parts.are_merged => CellBox::WHOLE,
            0 => *self.boxes().of_octant(level, parts.next),
            _ => *self.boxes().of_child(level, parts.next),
        }
    }

    /// The next of the parts, which has this number in its cut.
    #[inline(always)]
    pub(crate) fn part(&self, cell: &Cell, parts: &Parts, cut: &Cut, part: usize, bounds: CellBox) -> Cell {
        let centre = [0, 1, 2].map(|axis| cell.centre[axis] + cut.centres[part][axis]);
        let (level, rank) = (usize::from(cell.rank / 2), parts.rank);
        if cell.rank % 2 == 1 {
            let number = parts.next;
            let triangles = self.triangle_count(level + 1, number);
            return Cell { rank, octant: 0, number, bounds, triangles, centre };
        }
        let octant = part as u8;
        let triangles = if level + 1 < self.depth() {
            parts.node.triangles
        } else {
            self.entries_of(parts.node.octant_children(octant)).len() as u32
        };
        Cell { rank, octant, number: cell.number, bounds, triangles, centre }
    }

    /// The triangles that occupy a cell: of the last rank ascending and each once; of a lower one, the lists of all voxels in
    /// it, one after the other.
    #[inline]
    pub(crate) fn triangles_in(&self, cell: &Cell) -> &[u32] {
        let level = usize::from(cell.rank / 2);
        if cell.rank.is_multiple_of(2) {
            return self.triangles(level, cell.number);
        }
        self.triangles_of(level + 1, self.node(level, cell.number).octant_children(cell.octant))
    }
}

impl Parts {
    /// Those that the first halvings of the cut alone make. They have no list, and no number: a descent ends here.
    pub fn merge(&mut self, cell: &Cell, cut: &Cut, halvings: usize) {
        self.occupied = cut.merged(self.occupied, halvings);
        self.rank = cell.rank + 1;
        self.are_merged = true;
    }

    /// Goes past an occupied part.
    #[inline(always)]
    pub fn pass(&mut self) {
        self.next += 1;
    }

    /// Number of the next part, of the octants or of the voxels of the level.
    #[inline(always)]
    pub fn next(&self) -> u32 {
        self.next
    }

    /// Goes to the part of this number.
    #[inline(always)]
    pub fn go_to(&mut self, number: u32) {
        self.next = number;
    }
}

impl Node {
    /// Which of the eight children from `8 · octant` on are occupied.
    #[inline]
    pub fn octant(&self, octant: u8) -> u8 {
        (self.occupied >> (8 * octant)) as u8
    }

    /// Which octants have an occupied child.
    #[inline]
    pub fn octants(&self) -> u8 {
        const LOW_BITS: u64 = 0x7F7F_7F7F_7F7F_7F7F;
        // The highest bit of each byte that is not 0, and then these bits side by side.
        let highest = (self.occupied | ((self.occupied & LOW_BITS) + LOW_BITS)) & !LOW_BITS;
        ((highest >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
    }

    /// Numbers of the occupied ones of these eight.
    #[inline]
    fn octant_children(&self, octant: u8) -> Range<u32> {
        let first = self.child(8 * u32::from(octant));
        first..first + self.octant(octant).count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::PolygonMesh;
    use crate::polygon_box::bits_of;

    fn tetrahedron(order: u32) -> Object {
        let vertices = vec![[0.0, 0.0, 0.0], [3.0, 0.1, 0.0], [0.2, 2.0, 0.1], [0.1, 0.3, 1.0]];
        let mesh = PolygonMesh::from_polygons(vertices, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
        Object::build(mesh, Some(order), &()).expect("a good mesh")
    }

    /// The cells of each rank, and the triangles that their lists hold.
    fn descend(object: &Object) -> Vec<Vec<Cell>> {
        let (matrix, cuts) = (object.matrix(), object.matrix().lattice().cuts());
        let mut ranks = vec![Vec::new(); cuts.len() + 1];
        ranks[0].push(Cell::container(object));
        for rank in 0..cuts.len() {
            for cell in ranks[rank].clone() {
                let mut parts = matrix.parts(&cell);
                for part in bits_of(parts.occupied.into()) {
                    let bounds = matrix.bounds_of_part(&cell, &parts);
                    let part = matrix.part(&cell, &parts, &cuts[rank], part as usize, bounds);
                    ranks[usize::from(part.rank)].push(part);
                    parts.pass();
                }
            }
        }
        ranks
    }

    #[test]
    fn cells_are_the_voxels_of_the_levels_and_lie_where_they_do() {
        for order in [1, 2, 3, 4, 6, 7, 9, 12, 14] {
            let object = tetrahedron(order);
            let (matrix, ranks) = (object.matrix(), descend(&object));
            let lattice = matrix.lattice();
            let mut last = Vec::new();
            for cell in &ranks[lattice.cuts().len()] {
                let bits = lattice.bits_at(matrix.depth());
                let index = [0, 1, 2]
                    .map(|axis| ((cell.centre[axis] + (1 << MAX_ORDER)) >> (MAX_ORDER + 1 - bits[axis])) as u32);
                let voxel = Voxel { level: matrix.depth() as u8, number: cell.number, index };
                assert_eq!(*cell, Cell::voxel(matrix, voxel), "order {order}");
                last.push(index);
            }
            assert_eq!(last, matrix.occupied_at(order), "order {order}");
        }
    }

    #[test]
    fn a_cell_has_the_triangles_of_its_parts() {
        let object = tetrahedron(14);
        let (matrix, ranks) = (object.matrix(), descend(&object));
        let merged = |cell: &Cell| {
            let mut triangles = matrix.triangles_in(cell).to_vec();
            triangles.sort_unstable();
            triangles.dedup();
            triangles
        };
        for cell in ranks.iter().flatten() {
            assert!(merged(cell).len() <= cell.triangles as usize && !merged(cell).is_empty(), "{cell:?}");
        }
        assert!(ranks.iter().all(|cells| cells.is_empty() || cells.iter().flat_map(merged).max() == Some(3)));
    }

    #[test]
    fn octants_are_the_bytes_that_are_not_zero() {
        let node = |occupied: u64| Node { occupied, first_child: 7, triangles: 1 };
        for word in [0, 1, u64::MAX, 0x8000_0000_0000_0000, 0x0100_8000_0040_0001, 0x00FF_0000_1000_0200] {
            let expected =
                (0..8).filter(|octant| word >> (8 * octant) & 0xFF != 0).fold(0, |mask, octant| mask | 1 << octant);
            assert_eq!(node(word).octants(), expected, "{word:x}");
        }
        assert_eq!(node(0x0100_8000_0040_0001).octant_children(5), 9..10);
    }

    #[test]
    fn the_first_halvings_alone_merge_the_parts_that_the_others_would_cut() {
        let cut = Cut::new(&[0, 2, 2], [1, 0, 0]);
        assert_eq!(
            (0..=3).map(|count| cut.merged(0b0010_0001, count)).collect::<Vec<_>>(),
            [1, 0b11, 0b0101, 0b0010_0001]
        );
        let first = cut.first_halvings(2);
        assert_eq!((first.bits_after(), first.place(3)), ([2, 0, 1], ([1, 0, 1], [1, 0, 1])));
        assert_eq!((cut.place(6), cut.centres[6]), (([1, 0, 2], [1, 0, 2]), [1 << 28, 0, 1 << 28]));
    }
}
