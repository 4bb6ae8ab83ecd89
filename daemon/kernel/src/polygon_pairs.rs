//! Stage 7: polygon pairs, from the lists of the voxels that reach each other.
//!
//! The triangles of a voxel are carried into the world once for a batch of voxel pairs; two of them are a candidate when
//! their world boxes, which are exact (smallest and largest of the very coordinates that are tested), overlap. A pair of triangles often shares several pairs of voxels: a small memory of
//! recent candidates keeps most repetitions from the exact test, and what slips through is merged in stage 9.

use glam::DVec3;

use crate::affine::{Rows, world_vertex};
use crate::global_boxes::GlobalBox;
use crate::object::Object;
use crate::submatrix::Voxel;
use crate::voxel_pairs::VoxelPair;

/// A triangle at its world position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorldTriangle {
    pub corners: [DVec3; 3],
    pub bounds: GlobalBox,
    pub number: u32,
}

/// One body of a pair, and the triangles of it that the batch needs.
#[derive(Debug, Default)]
struct Gathered {
    triangles: Vec<WorldTriangle>,
    /// The voxel that was gathered last, where its triangles start, and the box of them all.
    last: Option<(Voxel, usize, GlobalBox)>,
    /// The triangles of a voxel above the full order, each once.
    merged: Vec<u32>,
}

/// Memory of the stage, kept by each worker from step to step.
#[derive(Debug, Default)]
pub(crate) struct Candidates {
    sides: [Gathered; 2],
    pairs: Vec<(u32, u32)>,
    recent: Recent,
}

impl Candidates {
    /// Forgets the candidates of the last batch.
    pub fn clear(&mut self) {
        self.pairs.clear();
        for side in &mut self.sides {
            side.triangles.clear();
            side.last = None;
        }
    }

    /// Forgets the pair of bodies: the same triangle numbers now mean other triangles.
    pub fn start_pair(&mut self) {
        self.recent.forget();
    }

    /// Appends the candidates of a pair of voxels; says how many pairs of triangles the two lists make. Of the others, those nearer
    /// than `clearance` lower it to a bound of their distance.
    #[inline(always)]
    pub fn add(&mut self, voxels: &VoxelPair, a: (&Object, &Rows), b: (&Object, &Rows), clearance: &mut f64) -> u64 {
        let [first, second] = &mut self.sides;
        let (start_a, _) = first.gather(voxels.a, a.0, a.1);
        let (start_b, bounds_b) = second.gather(voxels.b, b.0, b.1);
        for (i, p) in first.triangles.iter().enumerate().skip(start_a) {
            if !p.bounds.overlaps(&bounds_b) && p.bounds.gap(&bounds_b) > *clearance {
                continue;
            }
            for (j, q) in second.triangles.iter().enumerate().skip(start_b) {
                if p.bounds.overlaps(&q.bounds) {
                    if self.recent.is_new(p.number, q.number) {
                        self.pairs.push((i as u32, j as u32));
                    }
                } else if *clearance > 0.0 {
                    *clearance = clearance.min(p.bounds.gap(&q.bounds).next_down());
                }
            }
        }
        ((first.triangles.len() - start_a) * (second.triangles.len() - start_b)) as u64
    }

    /// The candidates of the batch.
    pub fn iter(&self) -> impl Iterator<Item = (&WorldTriangle, &WorldTriangle)> {
        let [first, second] = &self.sides;
        self.pairs.iter().map(|&(i, j)| (&first.triangles[i as usize], &second.triangles[j as usize]))
    }
}

impl Gathered {
    /// Where the voxel's triangles start (they are the last ones), and their box.
    fn gather(&mut self, voxel: Voxel, object: &Object, rows: &Rows) -> (usize, GlobalBox) {
        if let Some((last, start, bounds)) = self.last
            && last == voxel
        {
            return (start, bounds);
        }
        let level = usize::from(voxel.level);
        let mut numbers = object.matrix().triangles(level, voxel.number);
        if level < object.matrix().depth() {
            self.merged.clear();
            self.merged.extend_from_slice(numbers);
            self.merged.sort_unstable();
            self.merged.dedup();
            numbers = &self.merged;
        }
        let start = self.triangles.len();
        self.triangles.extend(numbers.iter().map(|&number| WorldTriangle::new(number, object, rows)));
        let bounds =
            self.triangles[start..].iter().fold(GlobalBox::EMPTY, |all, triangle| all.joined(&triangle.bounds));
        self.last = Some((voxel, start, bounds));
        (start, bounds)
    }
}

impl WorldTriangle {
    #[inline(always)]
    pub fn new(number: u32, object: &Object, rows: &Rows) -> WorldTriangle {
        let corner = |vertex: u32| world_vertex(rows, object.vertices()[vertex as usize]);
        // Corner by corner: `map` over the array costs a third more instructions here.
        let [p, q, r] = object.triangles()[number as usize];
        let (p, q, r) = (corner(p), corner(q), corner(r));
        let bounds = GlobalBox { min: p.min(q).min(r), max: p.max(q).max(r) };
        WorldTriangle { corners: [p, q, r], bounds, number }
    }
}

/// Candidates of this pair of bodies, by a hash of their numbers; one that is overwritten is tested again, to no harm.
/// Forgetting is counting on, not clearing.
#[derive(Debug)]
pub(crate) struct Recent {
    /// The triangle numbers and the generation they were seen in.
    seen: Vec<(u32, u32, u64)>,
    generation: u64,
    /// Entries of this generation.
    count: usize,
}

impl Default for Recent {
    fn default() -> Self {
        Recent { seen: vec![(0, 0, 0); Recent::SMALLEST], generation: 1, count: 0 }
    }
}

impl Recent {
    /// Fits into the innermost cache.
    const SMALLEST: usize = 1 << 10;
    /// 16 MiB. Polygons that are large for their voxels meet in very many pairs of them.
    const LARGEST: usize = 1 << 20;

    pub fn forget(&mut self) {
        self.generation += 1;
        self.count = 0;
    }

    #[inline]
    pub fn is_new(&mut self, a: u32, b: u32) -> bool {
        // Fibonacci hashing (Knuth, The Art of Computer Programming 3, section 6.4).
        let hash = (u64::from(a) << 32 | u64::from(b)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let place = (hash >> 32) as usize & (self.seen.len() - 1);
        let entry = (a, b, self.generation);
        let is_new = std::mem::replace(&mut self.seen[place], entry) != entry;
        self.count += usize::from(is_new);
        if self.count > self.seen.len() && self.seen.len() < Self::LARGEST {
            self.grow();
        }
        is_new
    }

    #[cold]
    fn grow(&mut self) {
        let size = 4 * self.seen.len();
        self.seen.clear();
        self.seen.resize(size, (0, 0, 0));
        self.count = 0;
    }
}
