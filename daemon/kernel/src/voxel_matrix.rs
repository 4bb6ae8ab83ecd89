//! The voxel matrix: for each voxel of the container, the polygons that occupy it.
//!
//! Halving the longest side M times makes an implicit kd-tree: the matrices of order 0, 1, …, M form a pyramid. Six halvings
//! are one level: a node has 64 children, one bit each of its occupancy word, and nothing is stored for empty space. Orders
//! between two levels are runs of that word. Memory follows the occupied voxels, not 2^M.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::cell_boxes::{CellBoxes, boxes_of_voxels};
use crate::container::{Container, HALVINGS_PER_LEVEL, Lattice, MAX_ORDER};
use crate::grid::Grid;
use crate::object::{ObjectError, Progress};
use crate::polygon_box::{TooMany, bits_of};
use crate::voxel_lists::{ListedVoxel, Part, level_that_parts, voxel_lists};

/// The most list entries of a voxel matrix: 2 GiB of triangle numbers.
pub const MAX_ENTRIES: usize = 1 << 29;

/// The order chosen when none is asked for, by what was measured on meshes of 216 to 69,451 triangles: finer voxels take more memory and
/// longer builds, and save no step any time. The surface of a container halved M times has about `4 · 2^(2M/3)` voxels, which makes one
/// to seven triangles for each (docs/accuracy.md says how to measure it anew).
pub fn automatic_order(triangle_count: usize) -> u32 {
    if triangle_count < 8 {
        return 0;
    }
    let doublings = (triangle_count as f64).log2();
    // Few triangles are often large ones, which coarse voxels tell apart badly.
    let few = f64::min(doublings + 1.0, 9.0);
    let order = f64::max(1.3 * doublings - 2.9, few).round() as u32;
    // A last level of one halving is hardly worth a level.
    let order = if order % HALVINGS_PER_LEVEL == 1 { order - 1 } else { order };
    order.min(MAX_ORDER)
}

/// One voxel that is halved further.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Node {
    /// The children that some polygon occupies.
    pub occupied: u64,
    /// Number, in the next level, of the first of them.
    pub first_child: u32,
    /// How many triangles occupy this voxel.
    pub triangles: u32,
}

impl Node {
    /// Number of an occupied child in the next level.
    #[inline]
    pub fn child(&self, child: u32) -> u32 {
        self.first_child + (self.occupied & ((1 << child) - 1)).count_ones()
    }
}

/// The sparse voxel matrix of one object. Built once.
#[derive(Debug, Clone)]
pub struct VoxelMatrix {
    lattice: Lattice,
    /// The nodes of each level, from the container down; as many levels as the lattice has.
    levels: Vec<Vec<Node>>,
    /// Where the list of each occupied voxel starts in `entries`, and where the last one ends.
    starts: Vec<u32>,
    /// Triangle numbers, ascending in each list.
    entries: Vec<u32>,
    boxes: CellBoxes,
}

impl VoxelMatrix {
    /// Builds the matrix: finds the voxels of the full order that each triangle occupies, sorts them, and reads off the nodes.
    ///
    /// # Errors
    /// [`ObjectError::MatrixTooLarge`] when the lists would exceed [`MAX_ENTRIES`].
    pub(crate) fn build(
        vertices: &[[f64; 3]],
        triangles: &[[u32; 3]],
        order: u32,
        progress: &dyn Progress,
    ) -> Result<VoxelMatrix, ObjectError> {
        let Some(container) = container_of(vertices, triangles, progress) else {
            return Ok(VoxelMatrix::empty());
        };
        let lattice = Lattice::new(container, order);
        let grid = Grid::new(&lattice);
        let corners_of =
            |triangle: u32| triangles[triangle as usize].map(|vertex| DVec3::from(vertices[vertex as usize]));
        let stage = |number| BuildProgress { listener: progress, stage: number };
        let parts = voxel_lists(&grid, triangles.len(), &corners_of, [stage(0), stage(1)]);
        let parts = parts.map_err(|TooMany| ObjectError::MatrixTooLarge {
            order,
            entries: MAX_ENTRIES + 1,
            limit: MAX_ENTRIES,
        })?;
        let Lists { levels, voxels, starts, entries } = Lists::of(&lattice, parts);
        let list = |voxel: usize| &entries[starts[voxel] as usize..starts[voxel + 1] as usize];
        let boxes = boxes_of_voxels(&grid, &voxels, &list, &corners_of, &stage(2));
        let boxes = CellBoxes::of(&lattice, &levels, boxes);
        Ok(VoxelMatrix { lattice, levels, starts, entries, boxes })
    }

    fn empty() -> VoxelMatrix {
        let nothing = Container { min: [0.0; 3], max: [0.0; 3] };
        let (levels, boxes) = (Vec::new(), CellBoxes::default());
        VoxelMatrix { lattice: Lattice::new(nothing, 0), levels, starts: vec![0], entries: Vec::new(), boxes }
    }

    /// How the container is halved.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Voxels of the full order that at least one polygon occupies.
    pub fn occupied_voxels(&self) -> usize {
        self.starts.len() - 1
    }

    /// Memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        let nodes: usize = self.levels.iter().map(|level| size_of_val(level.as_slice())).sum();
        let lists = size_of_val(self.starts.as_slice()) + size_of_val(self.entries.as_slice());
        nodes + lists + self.boxes.memory_bytes()
    }

    #[inline(always)]
    pub(crate) fn boxes(&self) -> &CellBoxes {
        &self.boxes
    }

    /// The number of levels that are halved further; a voxel of this level has a list.
    #[inline]
    pub(crate) fn depth(&self) -> usize {
        self.levels.len()
    }

    #[inline]
    pub(crate) fn node(&self, level: usize, number: u32) -> Node {
        self.levels[level][number as usize]
    }

    /// How many triangles occupy a voxel of `level`.
    #[inline]
    pub(crate) fn triangle_count(&self, level: usize, number: u32) -> u32 {
        match self.levels.get(level) {
            Some(nodes) => nodes[number as usize].triangles,
            None => self.starts[number as usize + 1] - self.starts[number as usize],
        }
    }

    /// The triangles that occupy a voxel of `level`: ascending and each once for the full order; for a coarser one, the lists of
    /// all voxels in it, one after the other.
    #[inline]
    pub(crate) fn triangles(&self, level: usize, number: u32) -> &[u32] {
        self.triangles_of(level, number..number + 1)
    }

    /// The lists of consecutive voxels of the full order, one after the other.
    #[inline]
    pub(crate) fn entries_of(&self, lists: Range<u32>) -> &[u32] {
        &self.entries[self.starts[lists.start as usize] as usize..self.starts[lists.end as usize] as usize]
    }

    /// The lists of consecutive voxels of `level`, one after the other.
    #[inline]
    pub(crate) fn triangles_of(&self, level: usize, Range { start: mut first, mut end }: Range<u32>) -> &[u32] {
        // The children of consecutive nodes are consecutive.
        for (at, nodes) in self.levels.iter().enumerate().skip(level) {
            let voxels = || self.levels.get(at + 1).map_or(self.occupied_voxels(), Vec::len) as u32;
            end = nodes.get(end as usize).map_or_else(voxels, |node| node.first_child);
            first = nodes[first as usize].first_child;
        }
        self.entries_of(first..end)
    }

    /// The occupied voxels of a coarser order (or the full one) as places per axis, ascending by halving, each once.
    ///
    /// # Panics
    /// If `order` is greater than the order of the matrix.
    pub fn occupied_at(&self, order: u32) -> Vec<[u32; 3]> {
        assert!(order <= self.lattice.order(), "order {order} of a matrix of order {}", self.lattice.order());
        if self.entries.is_empty() {
            return Vec::new();
        }
        let mut found = vec![([0u32; 3], 0u32)];
        let mut remaining = order;
        for (level, nodes) in self.lattice.levels().iter().zip(&self.levels) {
            if remaining == 0 {
                break;
            }
            let halvings: u32 = level.bits.iter().sum();
            let skipped = halvings.saturating_sub(remaining);
            remaining -= halvings - skipped;
            let children = |&(at, number): &([u32; 3], u32)| {
                let node = nodes[number as usize];
                bits_of(node.occupied).map(move |child| {
                    let place = level.place[child as usize];
                    let at = [0, 1, 2].map(|axis| at[axis] << level.bits[axis] | u32::from(place[axis]));
                    (at, node.child(child))
                })
            };
            found = found.iter().flat_map(children).collect();
            let kept = self.lattice.bits_at_order(order);
            if skipped > 0 {
                let full = [0, 1, 2].map(|axis| level.bits_before[axis] + level.bits[axis]);
                found.iter_mut().for_each(|(at, _)| (0..3).for_each(|axis| at[axis] >>= full[axis] - kept[axis]));
            }
        }
        found.dedup_by_key(|(at, _)| *at);
        found.into_iter().map(|(at, _)| at).collect()
    }
}

fn container_of(vertices: &[[f64; 3]], triangles: &[[u32; 3]], workforce: &dyn Progress) -> Option<Container> {
    /// Triangles that one thread takes at a time, and that are shared out at once.
    const CHUNK: usize = 1 << 14;
    const TURN: usize = 1 << 20;
    let of_chunk =
        |triangles: &[[u32; 3]]| Container::of(triangles.iter().flatten().map(|&vertex| vertices[vertex as usize]));
    if triangles.len() <= CHUNK {
        return of_chunk(triangles);
    }
    let mut ends = Vec::new();
    for turn in triangles.chunks(TURN) {
        workforce.share(&mut || ends.par_extend(turn.par_chunks(CHUNK).filter_map(of_chunk)));
    }
    Container::of(ends.iter().flat_map(|container| [container.min, container.max]))
}

/// The matrix while it is built: nodes, and the lists of the voxels.
struct Lists {
    levels: Vec<Vec<Node>>,
    /// Numbers of the occupied voxels among all of the full order, ascending.
    voxels: Vec<u32>,
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Lists {
    fn of(lattice: &Lattice, parts: Vec<Part>) -> Lists {
        let voxels: usize = parts.iter().map(|part| part.voxels.len()).sum();
        let mut lists = Lists {
            levels: vec![Vec::new(); lattice.levels().len()],
            voxels: Vec::with_capacity(voxels),
            starts: Vec::with_capacity(voxels + 1),
            entries: Vec::with_capacity(parts.iter().map(|part| part.entries.len()).sum()),
        };
        let mut end = 0;
        for part in parts {
            lists.entries.extend_from_slice(&part.entries);
            for voxel in &part.voxels {
                lists.starts.push(end);
                lists.add(lattice, voxel);
                end += voxel.entries;
            }
        }
        lists.starts.push(end);
        lists.levels.iter_mut().for_each(Vec::shrink_to_fit);
        lists
    }

    /// Adds a voxel to the nodes that it lies in, of which some begin with it.
    fn add(&mut self, lattice: &Lattice, voxel: &ListedVoxel) {
        let (order, number) = (lattice.order(), voxel.number);
        let first_new = self.voxels.last().map_or(0, |&before| level_that_parts(order, before, number));
        self.voxels.push(number);
        for level in 0..self.levels.len() {
            if level >= first_new {
                let first_child = self.levels.get(level + 1).map_or(self.voxels.len() - 1, Vec::len) as u32;
                self.levels[level].push(Node { occupied: 0, first_child, triangles: 0 });
            }
            let halvings = (HALVINGS_PER_LEVEL * (level as u32 + 1)).min(order);
            let child = number >> (order - halvings) & (lattice.levels()[level].place.len() as u32 - 1);
            let node = self.levels[level].last_mut().expect("it was there, or has just come");
            node.occupied |= 1 << child;
            node.triangles += voxel.new_in_node[level];
        }
    }
}

/// Counts in parts of a stage, since how many entries there are is not known before they are found.
pub(crate) struct BuildProgress<'p> {
    listener: &'p dyn Progress,
    stage: u64,
}

impl BuildProgress<'_> {
    const STAGES: u64 = 3;
    const PARTS: u64 = 1000;

    pub fn share(&self, job: &mut (dyn FnMut() + Send)) {
        self.listener.share(job);
    }

    pub fn advanced(&self, done: usize, total: usize) {
        let part = Self::PARTS * done as u64 / total as u64;
        self.listener.advanced(self.stage * Self::PARTS + part, Self::STAGES * Self::PARTS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::PolygonMesh;
    use crate::object::Object;

    fn tetrahedron(order: u32) -> Object {
        let vertices = vec![[0.0, 0.0, 0.0], [3.0, 0.1, 0.0], [0.2, 2.0, 0.1], [0.1, 0.3, 1.0]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        Object::build(PolygonMesh::from_polygons(vertices, faces), Some(order), &()).expect("a good mesh")
    }

    /// The voxels that sampled points of the triangles lie in.
    fn sampled(object: &Object, order: u32) -> Vec<[u32; 3]> {
        let lattice = object.matrix().lattice();
        let bits = lattice.bits_at_order(order);
        let mut voxels = Vec::new();
        for triangle in object.triangles() {
            let [a, b, c] = triangle.map(|vertex| DVec3::from(object.vertices()[vertex as usize]));
            for (i, j) in (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (i, j))) {
                let point = a + (b - a) * (i as f64 / 40.0) + (c - a) * (j as f64 / 40.0);
                voxels.push([0, 1, 2].map(|axis| {
                    let last = (1u32 << bits[axis]) - 1;
                    (0..last).find(|&index| lattice.plane(axis, bits[axis], index + 1) > point[axis]).unwrap_or(last)
                }));
            }
        }
        voxels
    }

    #[test]
    fn every_order_of_the_pyramid_holds_what_the_polygons_occupy() {
        let object = tetrahedron(14);
        for order in 0..=14 {
            let occupied = object.matrix().occupied_at(order);
            assert!(sampled(&object, order).iter().all(|voxel| occupied.contains(voxel)), "order {order}");
            let mut coarser = tetrahedron(order).matrix().occupied_at(order);
            let mut occupied = occupied;
            coarser.sort();
            occupied.sort();
            assert_eq!(coarser, occupied, "order {order}");
        }
    }

    #[test]
    fn memory_follows_the_surface() {
        let voxels = [12, 18, 24].map(|order| tetrahedron(order).occupied_voxels());
        assert!(voxels[1] < 6 * 4 * voxels[0] && voxels[2] < 6 * 4 * voxels[1], "{voxels:?}");
    }

    #[test]
    fn lists_are_ascending_and_a_polygon_on_a_plane_is_in_both_voxels() {
        let vertices = vec![[0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0]];
        let mesh = PolygonMesh::from_polygons(vertices, [[0, 1, 1], [2, 3, 4]]);
        let object = Object::build(mesh, Some(1), &()).expect("a good mesh");
        assert_eq!(object.matrix().lattice().axes(), [0]);
        assert_eq!([0, 1].map(|voxel| object.matrix().triangles(1, voxel).to_vec()), [[0, 1], [0, 1]]);
    }

    #[test]
    fn a_voxel_of_a_coarser_level_has_the_lists_of_all_voxels_in_it() {
        let object = tetrahedron(14);
        let matrix = object.matrix();
        for level in 0..matrix.depth() {
            for (number, node) in matrix.levels[level].iter().enumerate() {
                let children = bits_of(node.occupied).map(|child| matrix.triangles(level + 1, node.child(child)));
                let expected: Vec<u32> = children.flatten().copied().collect();
                assert_eq!(matrix.triangles(level, number as u32), expected);
            }
        }
    }
}
