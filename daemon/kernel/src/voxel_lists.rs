//! Which triangle occupies which voxel of the full order, sorted by voxel.
//!
//! Chunks of triangles are cut into entries, a number each; every chunk puts its own by the highest bits of the voxel; then what all
//! chunks have of one part of the container is sorted at once, by the rest of the bits, while it is in the cache.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::container::{HALVINGS_PER_LEVEL, MAX_ORDER};
use crate::grid::Grid;
use crate::object::MAX_ELEMENTS;
use crate::polygon_box::{Occupancy, TooMany};
use crate::voxel_matrix::{BuildProgress, MAX_ENTRIES};

/// The most levels of a matrix.
const MAX_LEVELS: usize = MAX_ORDER.div_ceil(HALVINGS_PER_LEVEL) as usize;

/// A triangle in the list of a voxel. Entries ascend by voxel, then by triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u64);

const TRIANGLE_SHIFT: u32 = 3;
const VOXEL_SHIFT: u32 = 34;
const _: () = assert!(MAX_ELEMENTS <= 1 << (VOXEL_SHIFT - TRIANGLE_SHIFT));

impl Entry {
    fn new(voxel: u32, triangle: u32, newest: u32) -> Entry {
        Entry(u64::from(voxel) << VOXEL_SHIFT | u64::from(triangle) << TRIANGLE_SHIFT | u64::from(newest))
    }

    /// Number of the voxel among all of the full order.
    #[inline(always)]
    fn voxel(self) -> u32 {
        (self.0 >> VOXEL_SHIFT) as u32
    }

    #[inline(always)]
    fn triangle(self) -> u32 {
        (self.0 >> TRIANGLE_SHIFT) as u32 & ((1 << (VOXEL_SHIFT - TRIANGLE_SHIFT)) - 1)
    }

    /// The first level at which the triangle is in no earlier voxel that lies in the same node.
    #[inline(always)]
    fn newest_level(self) -> usize {
        (self.0 & ((1 << TRIANGLE_SHIFT) - 1)) as usize
    }
}

/// The first level at which two voxels lie in different nodes; that of the voxels themselves when they have one parent.
#[inline(always)]
pub(crate) fn level_that_parts(order: u32, one: u32, other: u32) -> usize {
    let halving = order - 1 - (one ^ other).ilog2();
    (halving / HALVINGS_PER_LEVEL + 1) as usize
}

/// Triangles that one thread takes at a time.
const CHUNK: usize = 1 << 12;
/// Triangles, or entries, that are shared out at once, a few milliseconds of work: a build and the steps of scenes take turns.
const TURN: usize = 1 << 15;
/// About so many triangles for each part that is sorted alone.
const PART_BITS: u32 = 10;
const MOST_PARTS_BITS: u32 = 12;

/// The entries of some triangles, put by part.
struct Chunk {
    entries: Vec<Entry>,
    /// Where each part starts, and where the last one ends.
    starts: Vec<u32>,
}

/// The lists of the voxels in one part of the container, one after the other.
pub(crate) struct Part {
    pub voxels: Vec<ListedVoxel>,
    /// Triangle numbers, ascending in each list.
    pub entries: Vec<u32>,
}

/// An occupied voxel of the full order.
pub(crate) struct ListedVoxel {
    /// Among all voxels of the full order.
    pub number: u32,
    /// How long its list is.
    pub entries: u32,
    /// Per level: how many of its triangles are in no earlier voxel of the same node.
    pub new_in_node: [u32; MAX_LEVELS],
}

impl Part {
    fn of(sorted: &[Entry]) -> Part {
        let entries = sorted.iter().map(|entry| entry.triangle()).collect();
        let voxel = |list: &[Entry]| {
            let mut new_in_node = [0; MAX_LEVELS];
            list.iter()
                .filter(|entry| entry.newest_level() < MAX_LEVELS)
                .for_each(|e| new_in_node[e.newest_level()] += 1);
            // What is new in a node is so in the nodes within it.
            (1..MAX_LEVELS).for_each(|level| new_in_node[level] += new_in_node[level - 1]);
            ListedVoxel { number: list[0].voxel(), entries: list.len() as u32, new_in_node }
        };
        Part { voxels: sorted.chunk_by(|one, next| one.voxel() == next.voxel()).map(voxel).collect(), entries }
    }
}

/// The lists of all voxels, part after part.
pub(crate) fn voxel_lists(
    grid: &Grid<'_>,
    triangle_count: usize,
    corners_of: &(impl Fn(u32) -> [DVec3; 3] + Sync),
    [finding, sorting]: [BuildProgress<'_>; 2],
) -> Result<Vec<Part>, TooMany> {
    let order = grid.lattice.order();
    let part_bits = triangle_count.ilog2().saturating_sub(PART_BITS).min(MOST_PARTS_BITS).min(order);
    let rest_bits = order - part_bits;
    let chunks = entries_by_part(grid, triangle_count, rest_bits, corners_of, &finding)?;
    let mut sizes = vec![0usize; 1 << part_bits];
    for chunk in &chunks {
        sizes.iter_mut().zip(chunk.starts.windows(2)).for_each(|(size, ends)| *size += (ends[1] - ends[0]) as usize);
    }
    let total: usize = sizes.iter().sum();
    if total > MAX_ENTRIES {
        return Err(TooMany);
    }
    let mut parts = Vec::with_capacity(sizes.len());
    let mut done = 0;
    while parts.len() < sizes.len() {
        let turn = turn_of_parts(&sizes, parts.len());
        let sort = |part: usize| {
            let mut entries = Vec::with_capacity(sizes[part]);
            chunks.iter().for_each(|chunk| entries.extend_from_slice(chunk.part(part)));
            Part::of(&sort_by_voxel(entries, rest_bits))
        };
        done += sizes[turn.clone()].iter().sum::<usize>();
        sorting.share(&mut || parts.par_extend(turn.clone().into_par_iter().map(sort)));
        sorting.advanced(done, total);
    }
    Ok(parts)
}

/// Parts from `first` on that are sorted in one turn.
fn turn_of_parts(sizes: &[usize], first: usize) -> Range<usize> {
    let mut entries = 0;
    let more = sizes[first..].iter().take_while(|&&size| {
        entries += size;
        entries - size < TURN
    });
    first..first + more.count()
}

fn entries_by_part(
    grid: &Grid<'_>,
    triangle_count: usize,
    rest_bits: u32,
    corners_of: &(impl Fn(u32) -> [DVec3; 3] + Sync),
    progress: &BuildProgress<'_>,
) -> Result<Vec<Chunk>, TooMany> {
    let found = AtomicUsize::new(0);
    let chunk_of = |first: usize| {
        let triangles = first as u32..triangle_count.min(first + CHUNK) as u32;
        let entries = entries_of(grid, triangles, corners_of, &found)?;
        Ok(Chunk::new(entries, grid.lattice.order(), rest_bits))
    };
    let mut chunks = Vec::with_capacity(triangle_count.div_ceil(CHUNK));
    for turn in (0..triangle_count).step_by(TURN) {
        let end = triangle_count.min(turn + TURN);
        let firsts = (turn..end).into_par_iter().step_by(CHUNK);
        let mut new = Ok(Vec::new());
        progress.share(&mut || new = firsts.clone().map(chunk_of).collect::<Result<Vec<Chunk>, TooMany>>());
        chunks.append(&mut new?);
        progress.advanced(end, triangle_count);
    }
    Ok(chunks)
}

fn entries_of(
    grid: &Grid<'_>,
    triangles: Range<u32>,
    corners_of: &impl Fn(u32) -> [DVec3; 3],
    found: &AtomicUsize,
) -> Result<Vec<Entry>, TooMany> {
    let order = grid.lattice.order();
    let mut occupancy = Occupancy::new(grid);
    let mut entries = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let room = MAX_ENTRIES.saturating_sub(found.load(Ordering::Relaxed));
        let voxels = occupancy.of(corners_of(triangle), room)?;
        found.fetch_add(voxels.len(), Ordering::Relaxed);
        entries.push(Entry::new(voxels[0], triangle, 0));
        let others = voxels.windows(2).map(|two| (two[1], level_that_parts(order, two[0], two[1])));
        entries.extend(others.map(|(voxel, level)| Entry::new(voxel, triangle, level as u32)));
    }
    Ok(entries)
}

impl Chunk {
    /// Puts entries by part, by a counting sort that keeps their order.
    fn new(entries: Vec<Entry>, order: u32, rest_bits: u32) -> Chunk {
        let mut starts = vec![0u32; (1 << (order - rest_bits)) + 1];
        if order == rest_bits {
            starts[1] = entries.len() as u32;
            return Chunk { entries, starts };
        }
        let sorted = counting_sort(&entries, &mut starts[1..], |entry| (entry.voxel() >> rest_bits) as usize);
        Chunk { entries: sorted, starts }
    }

    fn part(&self, part: usize) -> &[Entry] {
        &self.entries[self.starts[part] as usize..self.starts[part + 1] as usize]
    }
}

/// Sorts by the lowest `bits` of the voxel's number, some of them at a time.
fn sort_by_voxel(mut entries: Vec<Entry>, bits: u32) -> Vec<Entry> {
    const DIGIT: u32 = 8;
    let passes = bits.div_ceil(DIGIT);
    let digit = bits.div_ceil(passes.max(1));
    for pass in 0..passes {
        let mut ends = [0; 1 << DIGIT];
        entries = counting_sort(&entries, &mut ends[..1 << digit], |entry| {
            (entry.voxel() >> (pass * digit)) as usize & ((1 << digit) - 1)
        });
    }
    entries
}

/// Sorts by `key`, which is less than the length of `ends`; that holds zeros, and where each key's entries end afterwards.
fn counting_sort(entries: &[Entry], ends: &mut [u32], key: impl Fn(Entry) -> usize) -> Vec<Entry> {
    entries.iter().for_each(|&entry| ends[key(entry)] += 1);
    let mut start = 0;
    for end in ends.iter_mut() {
        start += std::mem::replace(end, start);
    }
    let mut sorted = vec![Entry(0); entries.len()];
    for &entry in entries {
        let place = &mut ends[key(entry)];
        sorted[*place as usize] = entry;
        *place += 1;
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_sorted_by_voxel_and_keep_their_order_within() {
        for (order, rest_bits) in [(0, 0), (6, 0), (12, 5), (17, 17), (30, 20)] {
            let last = (1u64 << order) - 1;
            let voxel = |number: u64| ((number.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20) & last) as u32;
            let entries: Vec<Entry> = (0..3000).map(|number| Entry::new(voxel(number / 2), number as u32, 5)).collect();
            let mut expected = entries.clone();
            expected.sort();
            let chunk = Chunk::new(entries, order, rest_bits);
            let parts = 0..1usize << (order - rest_bits);
            let sorted: Vec<Entry> =
                parts.flat_map(|part| sort_by_voxel(chunk.part(part).to_vec(), rest_bits)).collect();
            assert_eq!(sorted, expected, "order {order}");
        }
    }

    #[test]
    fn an_entry_is_what_it_was_made_of() {
        let entry = Entry::new(0x3FFF_FFFF, MAX_ELEMENTS as u32, 5);
        assert_eq!((entry.voxel(), entry.triangle(), entry.newest_level()), (0x3FFF_FFFF, MAX_ELEMENTS as u32, 5));
    }

    #[test]
    fn voxels_part_at_the_first_halving_that_differs() {
        assert_eq!(level_that_parts(14, 0, 1), 3);
        assert_eq!([3, 4, 255].map(|other| level_that_parts(14, 0, other)), [3, 2, 2]);
        assert_eq!([256, 0x3FFF].map(|other| level_that_parts(14, 0, other)), [1, 1]);
        assert_eq!([(6, 63), (6, 1), (12, 64)].map(|(order, other)| level_that_parts(order, 0, other)), [1, 1, 1]);
    }
}
