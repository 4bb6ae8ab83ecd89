//! Stage 7: polygon pairs, from the lists of the voxels that reach each other.
//!
//! The triangles of a voxel are carried into the world when they are first needed, and held for the pairs of voxels that come
//! next. Two of them are a candidate when their world boxes overlap within the box that holds every common point of the two
//! voxels: a common point anywhere else is found where its own voxels are compared. A pair of triangles often shares several
//! pairs of voxels: a small memory of recent candidates keeps most repetitions from the exact test, and what slips through is
//! merged in stage 9.

mod list;
mod recent;

use glam::{DVec3, Vec4};

use crate::affine::{Rows, world_vertex};
use crate::cells::Cell;
use crate::global_boxes::GlobalBox;
use crate::instructions::{Work, dispatch};
use crate::object::Object;
use crate::submatrix::{BoxFrame, PairFrame};
use crate::voxel_pairs::VoxelPair;
use list::List;
pub(crate) use recent::Recent;

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

    /// What holds nothing.
    const EMPTY: RoundedBox = RoundedBox { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    #[inline(always)]
    fn joined(&self, other: &RoundedBox) -> RoundedBox {
        RoundedBox { min: self.min.min(other.min), max: self.max.max(other.max) }
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
}

/// Memory of the stage, kept by each worker from step to step.
#[derive(Debug, Default)]
pub(crate) struct Candidates {
    sides: [WorldSide; 2],
    /// The triangles of each cell that reach the other cell.
    reaching: [List<(RoundedBox, u32)>; 2],
    /// Those of the second cell whose boxes overlap that of one of the first.
    near: List<u32>,
    /// The triangles of a cell above the full order, each once.
    merged: Vec<u32>,
    pairs: List<[u32; 2]>,
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
        // A loop: what an iterator folds is not inlined, and then not compiled for the processor.
        let mut pairs = 0;
        for voxels in voxels {
            pairs += candidates.add(voxels, objects, frame, clearance);
        }
        pairs
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
        let [side_a, side_b] = &mut self.sides;
        let [first, second] = &mut self.reaching;
        let numbers = listed(&voxels.cells[0], objects[0], &mut self.merged);
        let mut count = numbers.len();
        let met = side_a.reaching(numbers, objects[0], &both, first);
        let numbers = listed(&voxels.cells[1], objects[1], &mut self.merged);
        count *= numbers.len();
        if first.kept().is_empty() {
            return count as u64;
        }
        // What is near without meeting counts only where there is a clearance to lower.
        let within = if *clearance > 0.0 { both } else { met };
        side_b.reaching(numbers, objects[1], &within, second);
        self.pair_up();
        if *clearance > 0.0 {
            *clearance = clearance.min(frame.boxes().at_least(self.least_gap()));
        }
        count as u64
    }

    /// Appends the pairs that reach each other and were not seen lately.
    #[inline(always)]
    fn pair_up(&mut self) {
        let Candidates { reaching: [first, second], near, pairs, recent, .. } = self;
        for (bounds, p) in first.kept() {
            near.clear();
            let mut writer = near.write(second.kept().len());
            for (other, q) in second.kept() {
                writer.put(*q, bounds.overlaps(other));
            }
            let count = writer.count;
            near.end(count);
            let mut writer = pairs.write(count);
            for &q in near.kept() {
                writer.put([*p, q], recent.is_new(*p, q));
            }
            let count = writer.count;
            pairs.end(count);
        }
    }

    /// How far the nearest of those are that do not reach each other, along the axis where that is most.
    #[inline(always)]
    fn least_gap(&self) -> f32 {
        let [first, second] = &self.reaching;
        let mut least = f32::INFINITY;
        for (bounds, _) in first.kept() {
            for (other, _) in second.kept() {
                if !bounds.overlaps(other) {
                    // NaN counts as nothing.
                    least = least.min(bounds.gap(other).max(0.0));
                }
            }
        }
        least
    }

    /// The candidates of the batch: pairs of triangle numbers.
    pub fn pairs(&self) -> &[[u32; 2]] {
        self.pairs.kept()
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

    /// Finds the triangles that reach a box, and what each has of it; says what all of them have of it together.
    #[inline(always)]
    fn reaching(
        &mut self,
        numbers: &[u32],
        object: &Object,
        within: &RoundedBox,
        reaching: &mut List<(RoundedBox, u32)>,
    ) -> RoundedBox {
        reaching.clear();
        let mut writer = reaching.write(numbers.len());
        for &number in numbers {
            let place = self.place(number, object);
            let bounds = self.boxes[place];
            writer.put((bounds.common(within), number), bounds.overlaps(within));
        }
        let count = writer.count;
        reaching.end(count);
        let mut all = RoundedBox::EMPTY;
        for (bounds, _) in reaching.kept() {
            all = all.joined(bounds);
        }
        all
    }
}

/// The triangles of a cell, each once.
#[inline(always)]
fn listed<'l>(cell: &Cell, object: &'l Object, merged: &'l mut Vec<u32>) -> &'l [u32] {
    let matrix = object.matrix();
    if usize::from(cell.rank) == matrix.lattice().cuts().len() {
        return matrix.triangles_in(cell);
    }
    merged.clear();
    merged.extend_from_slice(matrix.triangles_in(cell));
    merged.sort_unstable();
    merged.dedup();
    merged
}

/// As [`world_vertex`], to the bit, with all axes side by side.
#[inline(always)]
fn world_position(columns: &[[f64; 4]; 4], [x, y, z]: [f64; 3]) -> [f64; 4] {
    let [a, b, c, d] = columns;
    std::array::from_fn(|axis| ((a[axis] * x + b[axis] * y) + c[axis] * z) + d[axis])
}
