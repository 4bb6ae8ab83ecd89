//! The voxel matrix: for each voxel of the container, the polygons that occupy it.
//!
//! Halving the longest side M times makes an implicit kd-tree: the matrices of order 0, 1, …, M form a pyramid. Six halvings
//! are one level: a node has 64 children, one bit each of its occupancy word, and nothing is stored for empty space. Orders
//! between two levels are runs of that word. Memory follows the occupied voxels, not 2^M.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::cell_boxes::{CellBoxes, boxes_of_voxels};
use crate::container::{Container, HALVINGS_PER_LEVEL, Lattice, MAX_ORDER};
use crate::object::{ObjectError, Progress};
use crate::polygon_box::{TriangleExtents, bits_of};

/// The most list entries of a voxel matrix: 2 GiB of triangle numbers.
pub const MAX_ENTRIES: usize = 1 << 29;

/// The order chosen when none is asked for: some four triangles for each voxel of the surface, fewer in small meshes. The surface of a
/// container halved M times has about `4 · 2^(2M/3)` voxels. Finer voxels take more memory and longer builds, and save no step
/// any time (docs/accuracy.md says how to measure it anew).
pub fn automatic_order(triangle_count: usize) -> u32 {
    if triangle_count < 8 {
        return 0;
    }
    let doublings = (triangle_count as f64).log2();
    let order = (1.5 * doublings - 5.0).round() as u32;
    // A last level of one halving is hardly worth a level.
    let order = if order % HALVINGS_PER_LEVEL == 1 { order - 1 } else { order };
    order.clamp(doublings.round() as u32, MAX_ORDER)
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

/// The lists of one level while it is built.
struct Lists {
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// Place of each voxel, per axis.
    places: Vec<[u32; 3]>,
}

impl VoxelMatrix {
    /// Builds the matrix level by level.
    ///
    /// # Errors
    /// [`ObjectError::MatrixTooLarge`] when the lists would exceed [`MAX_ENTRIES`].
    pub(crate) fn build(
        vertices: &[[f64; 3]],
        triangles: &[[u32; 3]],
        order: u32,
        progress: &dyn Progress,
    ) -> Result<VoxelMatrix, ObjectError> {
        let corner = |&vertex: &u32| vertices[vertex as usize];
        let Some(container) = Container::of(triangles.iter().flatten().map(corner)) else {
            return Ok(VoxelMatrix::empty());
        };
        let lattice = Lattice::new(container, order);
        let corners_of =
            |triangle: u32| triangles[triangle as usize].map(|vertex| DVec3::from(vertices[vertex as usize]));
        let mut lists = Lists::all(triangles.len() as u32);
        let mut levels = Vec::new();
        for level in 0..lattice.levels().len() {
            let masks =
                child_masks(&lattice, level, &lists, &corners_of, &BuildProgress::new(&lattice, level, progress));
            let nodes;
            (nodes, lists) = descend(&lattice, level, &lists, &masks, order)?;
            levels.push(nodes);
        }
        let Lists { mut starts, mut entries, places } = lists;
        starts.shrink_to_fit();
        entries.shrink_to_fit();
        let list = |voxel: usize| &entries[starts[voxel] as usize..starts[voxel + 1] as usize];
        let boxes = boxes_of_voxels(&lattice, &places, &list, &corners_of, progress);
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

impl Lists {
    /// The container holds every triangle.
    fn all(count: u32) -> Lists {
        Lists { starts: vec![0, count], entries: (0..count).collect(), places: vec![[0; 3]] }
    }

    fn voxels(&self) -> impl Iterator<Item = (usize, &[u32])> {
        self.starts.windows(2).map(|ends| &self.entries[ends[0] as usize..ends[1] as usize]).enumerate()
    }
}

/// For each entry of the lists, the children of its voxel that its triangle occupies.
fn child_masks(
    lattice: &Lattice,
    level: usize,
    lists: &Lists,
    corners_of: &(impl Fn(u32) -> [DVec3; 3] + Sync),
    progress: &BuildProgress<'_>,
) -> Vec<u64> {
    let reach = DVec3::from(lattice.container().reach());
    let level = &lattice.levels()[level];
    let mut voxel_of = vec![0u32; lists.entries.len()];
    for (voxel, ends) in lists.starts.windows(2).enumerate() {
        voxel_of[ends[0] as usize..ends[1] as usize].fill(voxel as u32);
    }
    let done = AtomicUsize::new(0);
    let mut masks = vec![0; voxel_of.len()];
    let fill = |masks: &mut [u64], first: usize| {
        for (entry, mask) in (first..).zip(masks.iter_mut()) {
            let extents = TriangleExtents::new(corners_of(lists.entries[entry]), reach);
            *mask = extents.children(lattice, level, lists.places[voxel_of[entry] as usize]);
        }
        let done = done.fetch_add(masks.len(), Ordering::Relaxed) + masks.len();
        progress.advanced(done, voxel_of.len());
    };
    for (turn, masks) in masks.chunks_mut(TURN).enumerate() {
        let chunks = |masks: &mut [u64]| {
            let chunks = masks.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(chunk, masks)| fill(masks, turn * TURN + chunk * CHUNK));
        };
        progress.listener.share(&mut || chunks(masks));
    }
    masks
}

/// Entries that one thread takes at a time: enough to be worth it, few enough to show progress.
const CHUNK: usize = 1 << 11;
/// Entries that are shared out at once, a few milliseconds of work: a build and the steps of scenes take turns.
const TURN: usize = 1 << 15;

/// Counts in parts of a level, since how many entries the later levels have is not known before them.
struct BuildProgress<'p> {
    listener: &'p dyn Progress,
    level: u64,
    levels: u64,
}

impl BuildProgress<'_> {
    const PARTS: u64 = 1000;

    fn new<'p>(lattice: &Lattice, level: usize, listener: &'p dyn Progress) -> BuildProgress<'p> {
        BuildProgress { listener, level: level as u64, levels: lattice.levels().len() as u64 }
    }

    fn advanced(&self, done: usize, total: usize) {
        let part = Self::PARTS * done as u64 / total as u64;
        self.listener.advanced(self.level * Self::PARTS + part, self.levels * Self::PARTS);
    }
}

/// The nodes of a level and the lists of the next one.
fn descend(
    lattice: &Lattice,
    level: usize,
    lists: &Lists,
    masks: &[u64],
    order: u32,
) -> Result<(Vec<Node>, Lists), ObjectError> {
    let entries: usize = masks.iter().map(|mask| mask.count_ones() as usize).sum();
    if entries > MAX_ENTRIES {
        return Err(ObjectError::MatrixTooLarge { order, entries, limit: MAX_ENTRIES });
    }
    let level = &lattice.levels()[level];
    let mut nodes = Vec::with_capacity(lists.places.len());
    let mut next = Lists { starts: vec![0], entries: vec![0; entries], places: Vec::new() };
    for (voxel, triangles) in lists.voxels() {
        let masks = &masks[lists.starts[voxel] as usize..][..triangles.len()];
        let occupied = masks.iter().fold(0, |all, mask| all | mask);
        nodes.push(Node { occupied, first_child: next.places.len() as u32, triangles: triangles.len() as u32 });
        next.distribute(triangles, masks, occupied);
        next.places.extend(bits_of(occupied).map(|child| {
            let place = level.place[child as usize];
            [0, 1, 2].map(|axis| lists.places[voxel][axis] << level.bits[axis] | u32::from(place[axis]))
        }));
    }
    Ok((nodes, next))
}

impl Lists {
    /// Appends the lists of the occupied children of one voxel, by a counting sort.
    fn distribute(&mut self, triangles: &[u32], masks: &[u64], occupied: u64) {
        let mut counts = [0u32; 64];
        masks.iter().for_each(|&mask| bits_of(mask).for_each(|child| counts[child as usize] += 1));
        let mut cursors = [0u32; 64];
        let mut end = self.starts.last().copied().unwrap_or(0);
        for child in bits_of(occupied) {
            cursors[child as usize] = end;
            end += counts[child as usize];
            self.starts.push(end);
        }
        for (&triangle, &mask) in triangles.iter().zip(masks) {
            for child in bits_of(mask) {
                self.entries[cursors[child as usize] as usize] = triangle;
                cursors[child as usize] += 1;
            }
        }
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
