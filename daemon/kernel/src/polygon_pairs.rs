//! Stage 7: polygon pairs, from the lists of the voxels that reach each other.
//!
//! The triangles of a voxel are carried into the world when they are first needed, and held for the pairs of voxels that come
//! next. Two of them are a candidate when their world boxes overlap within the box that holds every common point of the two
//! voxels: a common point anywhere else is found where its own voxels are compared. A pair of triangles often shares several
//! pairs of voxels: a small memory of recent candidates keeps most repetitions from the exact test, and what slips through is
//! merged in stage 9.

use glam::{DVec3, Vec4};

use crate::affine::{Rows, world_vertex};
use crate::cells::Cell;
use crate::global_boxes::GlobalBox;
use crate::instructions::{Work, dispatch};
use crate::object::Object;
use crate::submatrix::{BoxFrame, PairFrame};
use crate::voxel_pairs::VoxelPair;

/// A triangle at its world position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorldTriangle {
    pub corners: [DVec3; 3],
    pub bounds: GlobalBox,
    pub number: u32,
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

/// The world box of a triangle as a [`BoxFrame`] measures it, each coordinate rounded to the nearest f32. Rounding is monotone:
/// boxes that have a point in common still have one.
#[derive(Debug, Clone, Copy, Default)]
struct RoundedBox {
    min: Vec4,
    max: Vec4,
}

impl RoundedBox {
    #[inline(always)]
    fn overlaps(&self, other: &RoundedBox) -> bool {
        (self.min.cmple(other.max) & other.min.cmple(self.max)).all()
    }

    /// How far apart they are along the axis where that is most.
    fn gap(&self, other: &RoundedBox) -> f32 {
        (self.min - other.max).max(other.min - self.max).truncate().max_element()
    }

    /// What both hold.
    #[inline(always)]
    fn common(&self, other: &RoundedBox) -> RoundedBox {
        RoundedBox { min: self.min.max(other.min), max: self.max.min(other.max) }
    }
}

/// One body of a pair, and triangles of it at their world positions. Of those with the same last bits of their numbers the latest
/// is held.
#[derive(Debug)]
struct WorldSide {
    /// Per column of the transform, a number for each world axis.
    columns: [[f64; 4]; 4],
    /// How boxes are measured.
    origin: [f64; 4],
    unit: f64,
    /// Number of the triangle, and the pair of bodies that it is of.
    held: Vec<(u32, u32)>,
    pair: u32,
    boxes: Vec<RoundedBox>,
    corners: Vec<[DVec3; 3]>,
    /// The triangles of a cell that reach the other cell.
    reaching: Vec<(RoundedBox, u32)>,
    /// The triangles of a cell above the full order, each once.
    merged: Vec<u32>,
}

/// Memory of the stage, kept by each worker from step to step.
#[derive(Debug, Default)]
pub(crate) struct Candidates {
    sides: [WorldSide; 2],
    pairs: Vec<[u32; 2]>,
    recent: Recent,
}

/// [`Candidates::add_all`], for the instructions of the processor.
struct AddAll<'a, 'o> {
    candidates: &'a mut Candidates,
    voxels: &'a [VoxelPair],
    objects: [&'o Object; 2],
    frame: &'a PairFrame,
    clearance: &'a mut f64,
}

impl Work for AddAll<'_, '_> {
    type Output = u64;

    #[inline(always)]
    fn run(self) -> u64 {
        let AddAll { candidates, voxels, objects, frame, clearance } = self;
        voxels.iter().map(|voxels| candidates.add(voxels, objects, frame, clearance)).sum()
    }
}

impl Candidates {
    /// Forgets the candidates of the last batch.
    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Begins with a pair of bodies: the same triangle numbers now mean other triangles.
    pub fn start_pair(&mut self, rows: [&Rows; 2], boxes: &BoxFrame) {
        self.recent.forget();
        self.pairs.clear();
        for (side, rows) in self.sides.iter_mut().zip(rows) {
            side.start(rows, boxes);
        }
    }

    /// Appends the candidates of pairs of voxels; says how many pairs of triangles their lists make. Of the others, those nearer
    /// than `clearance` lower it to a bound of their distance.
    pub fn add_all(
        &mut self,
        voxels: &[VoxelPair],
        objects: [&Object; 2],
        frame: &PairFrame,
        clearance: &mut f64,
    ) -> u64 {
        dispatch(AddAll { candidates: self, voxels, objects, frame, clearance })
    }

    /// Appends the candidates of a pair of voxels; says how many pairs of triangles the two lists make. Of the others, those nearer
    /// than `clearance` lower it to a bound of their distance.
    #[inline(always)]
    fn add(&mut self, voxels: &VoxelPair, objects: [&Object; 2], frame: &PairFrame, clearance: &mut f64) -> u64 {
        let [min, max] = frame.common_box(&voxels.cells);
        let both = RoundedBox { min, max };
        let [first, second] = &mut self.sides;
        let [a, b] = &voxels.cells;
        let pairs = first.gather(a, objects[0], &both) * second.gather(b, objects[1], &both);
        for (bounds, p) in &first.reaching {
            for (other, q) in &second.reaching {
                if bounds.overlaps(other) {
                    if self.recent.is_new(*p, *q) {
                        self.pairs.push([*p, *q]);
                    }
                } else if *clearance > 0.0 {
                    *clearance = clearance.min(frame.boxes().at_least(bounds.gap(other)));
                }
            }
        }
        pairs as u64
    }

    /// The candidates of the batch: pairs of triangle numbers.
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }

    /// The world positions of a pair of triangles.
    #[inline(always)]
    pub fn corners(&mut self, [p, q]: [u32; 2], [a, b]: [&Object; 2]) -> [&[DVec3; 3]; 2] {
        let [first, second] = &mut self.sides;
        [first.corners(p, a), second.corners(q, b)]
    }
}

impl Default for WorldSide {
    fn default() -> Self {
        WorldSide {
            columns: [[0.0; 4]; 4],
            origin: [0.0; 4],
            unit: 0.0,
            held: vec![(0, 0); WorldSide::HELD],
            pair: 0,
            boxes: vec![RoundedBox::default(); WorldSide::HELD],
            corners: vec![[DVec3::ZERO; 3]; WorldSide::HELD],
            reaching: Vec::new(),
            merged: Vec::new(),
        }
    }
}

impl WorldSide {
    /// Triangles that are held at a time: few enough for the caches.
    const HELD: usize = 1 << 10;

    fn start(&mut self, rows: &Rows, boxes: &BoxFrame) {
        self.columns = std::array::from_fn(|column| [rows[0][column], rows[1][column], rows[2][column], 0.0]);
        let origin = boxes.origin;
        (self.origin, self.unit) = ([origin.x, origin.y, origin.z, 0.0], boxes.unit);
        self.pair = self.pair.wrapping_add(1);
        if self.pair == 0 {
            self.held.fill((0, 0));
            self.pair = 1;
        }
    }

    /// Where the triangle is held.
    #[inline(always)]
    fn place(&mut self, number: u32, object: &Object) -> usize {
        let place = number as usize % Self::HELD;
        if self.held[place] != (number, self.pair) {
            self.carry(place, number, object);
        }
        place
    }

    #[inline(always)]
    fn corners(&mut self, number: u32, object: &Object) -> &[DVec3; 3] {
        let place = self.place(number, object);
        &self.corners[place]
    }

    #[inline(always)]
    fn carry(&mut self, place: usize, number: u32, object: &Object) {
        let [p, q, r] = object.triangles()[number as usize];
        let corner = |vertex: u32| world_position(&self.columns, object.vertices()[vertex as usize]);
        let (p, q, r) = (corner(p), corner(q), corner(r));
        let rounded = |at: [f64; 4]| {
            Vec4::from_array(std::array::from_fn(|axis| ((at[axis] - self.origin[axis]) * self.unit) as f32))
        };
        let (i, j, k) = (rounded(p), rounded(q), rounded(r));
        self.boxes[place] = RoundedBox { min: i.min(j).min(k), max: i.max(j).max(k) };
        self.corners[place] = [p, q, r].map(|[x, y, z, _]| DVec3::new(x, y, z));
        self.held[place] = (number, self.pair);
    }

    /// Finds the triangles of a cell that reach a box; says how many the cell has.
    #[inline(always)]
    fn gather(&mut self, cell: &Cell, object: &Object, within: &RoundedBox) -> usize {
        let matrix = object.matrix();
        if usize::from(cell.rank) == matrix.lattice().cuts().len() {
            self.reaching(matrix.triangles_in(cell), object, within)
        } else {
            let mut merged = std::mem::take(&mut self.merged);
            merged.clear();
            merged.extend_from_slice(matrix.triangles_in(cell));
            merged.sort_unstable();
            merged.dedup();
            let count = self.reaching(&merged, object, within);
            self.merged = merged;
            count
        }
    }

    #[inline(always)]
    fn reaching(&mut self, numbers: &[u32], object: &Object, within: &RoundedBox) -> usize {
        self.reaching.clear();
        for &number in numbers {
            let place = self.place(number, object);
            let bounds = self.boxes[place];
            if bounds.overlaps(within) {
                self.reaching.push((bounds.common(within), number));
            }
        }
        numbers.len()
    }
}

/// As [`world_vertex`], to the bit, with all axes side by side.
#[inline(always)]
fn world_position(columns: &[[f64; 4]; 4], [x, y, z]: [f64; 3]) -> [f64; 4] {
    let [a, b, c, d] = columns;
    std::array::from_fn(|axis| ((a[axis] * x + b[axis] * y) + c[axis] * z) + d[axis])
}

/// Candidates of this pair of bodies, by a hash of their numbers; one that is overwritten is tested again, to no harm.
/// Forgetting is counting on, not clearing.
#[derive(Debug)]
pub(crate) struct Recent {
    /// The triangle numbers and the generation they were seen in.
    seen: Vec<(u32, u32, u64)>,
    /// How many places are in use, a power of two, less one.
    mask: usize,
    generation: u64,
    /// Entries of this generation.
    count: usize,
}

impl Default for Recent {
    fn default() -> Self {
        Recent { seen: vec![(0, 0, 0); Recent::SMALLEST], mask: Recent::SMALLEST - 1, generation: 1, count: 0 }
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
        self.mask = Self::SMALLEST - 1;
    }

    #[inline]
    pub fn is_new(&mut self, a: u32, b: u32) -> bool {
        // Fibonacci hashing (Knuth, The Art of Computer Programming 3, section 6.4).
        let hash = (u64::from(a) << 32 | u64::from(b)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let place = (hash >> 32) as usize & self.mask;
        let entry = (a, b, self.generation);
        let is_new = std::mem::replace(&mut self.seen[place], entry) != entry;
        self.count += usize::from(is_new);
        if self.count > self.mask && self.mask < Self::LARGEST - 1 {
            self.grow();
        }
        is_new
    }

    #[cold]
    fn grow(&mut self) {
        let size = 4 * (self.mask + 1);
        self.seen.resize(size.max(self.seen.len()), (0, 0, 0));
        self.mask = size - 1;
        self.count = 0;
    }
}
