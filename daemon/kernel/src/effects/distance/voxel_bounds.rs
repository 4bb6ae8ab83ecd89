//! How near two voxels of two placed bodies can be, from below.
//!
//! Along each axis of a right-angled frame, the extents of the two voxels leave a gap or none; the distance is at least the
//! root of the sum of the squares of the three gaps. Two frames are tried: one that follows the edges of the first body's voxels,
//! one those of the second's. For a rigid placement that is the distance of the one voxel from the other's bounding box along its
//! sides. The reach of a voxel along each axis is one number per level, and the places of the children of a voxel
//! are told apart by one small table per axis of the lattice.
//!
//! Once a near pair of points is known, the slabs of the voxels ([`voxel_slabs`](crate::voxel_slabs)) bound the gap along the direction
//! between them.
//!
//! # Why it is a bound
//! Along a direction f, a point of one world polygon and one of the other differ by `offset + α·x − β·y`, with α = Aᵀf, β = Bᵀf,
//! offset = f·(s − t), and x and y in voxels that list the polygons, up to what rounding moved the vertices by
//! ([`rounding_bound`](crate::affine::rounding_bound)); as in [`submatrix`](crate::submatrix), whatever f came out of its own rounding. The
//! computed α, β, offset, centres, places, reaches and sums err by less than 112·2^-53 of `|f|·(magnitude of A + magnitude of B)`, and
//! 8·2^-53 more cover the vertices: [`SLACK`] is above their sum. Three directions F give `|Fᵀd|² ≤ (1 + 3g)·|d|²`, g the
//! largest entry of `FᵀF − 1`, which is computed, with 2^-48 for its rounding and that of all squares and sums.

use glam::DVec3;

use crate::affine::Rows;
use crate::container::LatticeLevel;
use crate::object::Object;
use crate::submatrix::{MAX_LEVELS, Placed, UNDERFLOW, Voxel, Which, columns, reach};

const SLACK: f64 = 128.0 * (f64::EPSILON / 2.0);
const SQUARES: f64 = f64::from_bits((1023 - 48) << 52);

/// Three of each frame.
const AXES: usize = 6;

/// One number per axis of the frames.
type PerAxis = [f64; AXES];

/// What one body contributes.
#[derive(Debug, Clone)]
struct Side {
    /// Transform's transpose times the axis.
    along: [DVec3; AXES],
    /// Per level: half the extent of a voxel.
    reach: [PerAxis; MAX_LEVELS],
    half: [DVec3; MAX_LEVELS],
    bits: [[u32; 3]; MAX_LEVELS],
    /// Per level: the square of a voxel's longest side in the world, roughly; decides which voxel is split.
    size: [f64; MAX_LEVELS],
    middle: DVec3,
    /// The level at which the descent ends: see `PairFrame` in [`submatrix`](crate::submatrix).
    depth: usize,
    /// Per level and axis of the lattice: where the places start in `places`.
    starts: [[usize; 3]; MAX_LEVELS],
    /// What a child's place along an axis of the lattice adds to its parent's first one.
    places: Vec<PerAxis>,
}

/// A pair of placed bodies, ready for bounding the distance of their voxels. Kept from pair to pair for its memory.
#[derive(Debug, Clone)]
pub(super) struct VoxelBounds {
    sides: [Side; 2],
    offset: PerAxis,
    slack: PerAxis,
    /// A bound is the sum of squares divided by this.
    divisor: f64,
    near: Option<NearDirections>,
}

/// Directions of length 1 at right angles, times the scale; in the first one the bodies are nearly as near as they can be.
#[derive(Debug, Clone, Copy)]
struct NearDirections {
    /// Per direction: transform's transpose times it; of the second body with the opposite sign.
    along: [[DVec3; 2]; 3],
    /// Per direction: what the two translations add to a point of the second body less one of the first.
    offset: [f64; 3],
    /// Per direction: what rounding may.
    slack: [f64; 3],
}

/// How near two voxels can be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bound {
    /// The square of the distance, times [`VoxelBounds::divisor`], is at least this.
    pub square: f64,
    /// The square of the distance of the centres, roughly.
    pub centres: f64,
}

/// A voxel that is split, and the other body's voxel, as the axes see them.
pub(super) struct Split<'b> {
    side: &'b Side,
    level: usize,
    /// Of the first child's centre, seen from the other voxel.
    first: PerAxis,
    /// Of a child and the other voxel, and the slack.
    reach: PerAxis,
}

impl Default for VoxelBounds {
    fn default() -> Self {
        let side = Side {
            along: [DVec3::ZERO; AXES],
            reach: [[0.0; AXES]; MAX_LEVELS],
            half: [DVec3::ZERO; MAX_LEVELS],
            bits: [[0; 3]; MAX_LEVELS],
            size: [0.0; MAX_LEVELS],
            middle: DVec3::ZERO,
            depth: 0,
            starts: [[0; 3]; MAX_LEVELS],
            places: Vec::new(),
        };
        VoxelBounds { sides: [side.clone(), side], offset: [0.0; AXES], slack: [0.0; AXES], divisor: 1.0, near: None }
    }
}

impl VoxelBounds {
    /// Makes ready for a pair; all lengths will be in world units times `scale`, a power of two.
    pub fn start(&mut self, a: Placed<'_>, b: Placed<'_>, scale: f64) {
        let (columns_a, columns_b) = (columns(a.rows), columns(b.rows));
        self.near = None;
        let frames = [frame(&columns_a), frame(&columns_b)];
        self.divisor = 1.0 + 3.0 * skew(&frames[0]).max(skew(&frames[1])) + SQUARES;
        let directions: [DVec3; AXES] = std::array::from_fn(|axis| frames[axis / 3][axis % 3] * scale);
        let shift = |rows: &Rows| DVec3::new(rows[0][3], rows[1][3], rows[2][3]);
        let shift = shift(a.rows) - shift(b.rows);
        self.offset = directions.map(|axis| axis.dot(shift));
        let noise = (a.magnitude + b.magnitude).max_element() * scale * SLACK;
        self.sides[0].start(a.object, &columns_a, &directions, scale, noise);
        self.sides[1].start(b.object, &columns_b, &directions, scale, noise);
        self.slack = std::array::from_fn(|axis| {
            slack(directions[axis], [self.sides[0].along[axis], self.sides[1].along[axis]], [a, b])
        });
    }

    /// Bounds along this direction too, of length 1 up to rounding, from the first body to the second. Changes the divisor.
    pub fn follow(&mut self, direction: DVec3, a: Placed<'_>, b: Placed<'_>, scale: f64) {
        let (second, third) = direction.any_orthonormal_pair();
        let frame = [direction, second, third];
        self.divisor = self.divisor.max(1.0 + 3.0 * skew(&frame) + SQUARES);
        let directions = frame.map(|direction| direction * scale);
        let shift = |rows: &Rows| DVec3::new(rows[0][3], rows[1][3], rows[2][3]);
        let shift = shift(b.rows) - shift(a.rows);
        let along = |rows: &Rows, direction: DVec3| DVec3::from(columns(rows).map(|column| column.dot(direction)));
        let along = directions.map(|direction| [along(a.rows, direction), along(b.rows, -direction)]);
        let mut slacks = [0, 1, 2].map(|axis| slack(directions[axis], along[axis], [a, b]));
        // The slabs mix the axes of the object: products that cancel are not bounded by the magnitude of world coordinates.
        let [near_a, near_b] = along[0].map(|along| along.abs().element_sum());
        slacks[0] +=
            SLACK * (near_a * reach(a.object).iter().sum::<f64>() + near_b * reach(b.object).iter().sum::<f64>());
        self.near =
            Some(NearDirections { along, offset: directions.map(|direction| direction.dot(shift)), slack: slacks });
    }

    /// As [`Bound::square`], from the gap that the slabs leave along the near direction and those of the voxels beside it; 0 while there
    /// is no such direction.
    #[inline]
    pub fn near_square(&self, objects: [&Object; 2], voxels: [Voxel; 2]) -> f64 {
        let Some(near) = &self.near else { return 0.0 };
        let levels = voxels.map(|voxel| usize::from(voxel.level));
        let centres = [0, 1].map(|body| self.sides[body].centre(levels[body], voxels[body].index));
        let halves = [0, 1].map(|body| self.sides[body].half[levels[body]]);
        let most = |body: usize| {
            let (along, centre, half) = (near.along[0][body], centres[body], halves[body]);
            match objects[body].slabs().of(levels[body], voxels[body].number) {
                Some(slab) => slab.most(along, centre, half),
                None => along.dot(centre) + along.abs().dot(half),
            }
        };
        // 0 where it is NaN: nothing is proven.
        let thin = (near.offset[0] - most(0) - most(1) - near.slack[0]).max(0.0);
        let beside = |axis: usize| {
            let [a, b] = near.along[axis];
            let apart = (near.offset[axis] - a.dot(centres[0]) - b.dot(centres[1])).abs();
            (apart - a.abs().dot(halves[0]) - b.abs().dot(halves[1]) - near.slack[axis]).max(0.0)
        };
        let (second, third) = (beside(1), beside(2));
        thin * thin + second * second + third * third
    }

    /// What a squared distance is multiplied by before it is compared with [`Bound::square`].
    pub fn divisor(&self) -> f64 {
        self.divisor
    }

    /// Whether the descent ends at this voxel of `which`.
    #[inline]
    pub fn is_last(&self, which: Which, voxel: Voxel) -> bool {
        usize::from(voxel.level) == self.sides[which as usize].depth
    }

    /// Which of two voxels is larger in the world.
    #[inline]
    pub fn larger(&self, a: Voxel, b: Voxel) -> Which {
        let size = |which: Which, voxel: Voxel| self.sides[which as usize].size[usize::from(voxel.level)];
        if size(Which::First, a) >= size(Which::Second, b) { Which::First } else { Which::Second }
    }

    /// The voxel `parent` of `which`, about to be split, as seen from the other body's voxel.
    pub fn split(&self, which: Which, parent: Voxel, halved: &LatticeLevel, other: Voxel) -> Split<'_> {
        let (side, beside) = (&self.sides[which as usize], &self.sides[which.other() as usize]);
        let level = usize::from(parent.level);
        let index = [0, 1, 2].map(|axis| parent.index[axis] << halved.bits[axis]);
        let (first, centre) = (side.centre(level + 1, index), beside.centre(usize::from(other.level), other.index));
        let sign = if which == Which::First { 1.0 } else { -1.0 };
        let mut split = Split { side, level, first: [0.0; AXES], reach: [0.0; AXES] };
        for axis in 0..AXES {
            split.first[axis] = sign * self.offset[axis] + side.along[axis].dot(first) - beside.along[axis].dot(centre);
            split.reach[axis] =
                side.reach[level + 1][axis] + beside.reach[usize::from(other.level)][axis] + self.slack[axis];
        }
        split
    }
}

impl Split<'_> {
    /// Of the child at this place among its siblings, and the other voxel.
    #[inline(always)]
    pub fn bound(&self, place: [u8; 3]) -> Bound {
        let starts = self.side.starts[self.level];
        let [x, y, z] = [0, 1, 2].map(|axis| &self.side.places[starts[axis] + usize::from(place[axis])]);
        let (mut squares, mut centres) = ([0.0; AXES], [0.0; AXES]);
        for axis in 0..AXES {
            let apart = (self.first[axis] + x[axis] + y[axis] + z[axis]).abs();
            // 0 where it is NaN: nothing is proven.
            let gap = (apart - self.reach[axis]).max(0.0);
            squares[axis] = gap * gap;
            centres[axis] = apart * apart;
        }
        let sum = |squares: &PerAxis, first: usize| squares[first] + squares[first + 1] + squares[first + 2];
        Bound { square: sum(&squares, 0).max(sum(&squares, 3)), centres: sum(&centres, 0) }
    }
}

impl Side {
    fn start(&mut self, object: &Object, columns: &[DVec3; 3], directions: &[DVec3; AXES], scale: f64, noise: f64) {
        let matrix = object.matrix();
        let lattice = matrix.lattice();
        let container = lattice.container();
        self.along = directions.map(|direction| DVec3::from(columns.map(|column| column.dot(direction))));
        self.middle = 0.5 * DVec3::from(container.min) + 0.5 * DVec3::from(container.max);
        let last = matrix.depth();
        for level in 0..=last {
            let half = lattice.half_sides_at(level);
            (self.half[level], self.bits[level]) = (half, lattice.bits_at(level));
            self.reach[level] = self.along.map(|along| along.abs().dot(half));
            let sides = [0, 1, 2].map(|axis| columns[axis].abs().max_element() * half[axis] * scale);
            self.size[level] = sides[0].max(sides[1]).max(sides[2]);
        }
        self.depth = (0..last).find(|&level| self.size[level] <= noise.max(self.size[last])).unwrap_or(last);
        self.places.clear();
        for (level, halved) in lattice.levels().iter().enumerate() {
            for axis in 0..3 {
                self.starts[level][axis] = self.places.len();
                let side = 2.0 * self.half[level + 1][axis];
                let place = |place: u32| self.along.map(|along| along[axis] * (f64::from(place) * side));
                self.places.extend((0..1 << halved.bits[axis]).map(place));
            }
        }
    }

    /// Centre of a voxel, in the object's frame. Counted from the middle, so that nothing overflows.
    #[inline]
    fn centre(&self, level: usize, index: [u32; 3]) -> DVec3 {
        let bits = self.bits[level];
        let steps = [0, 1, 2].map(|axis| (2 * i64::from(index[axis]) + 1 - (1i64 << bits[axis])) as f64);
        self.middle + DVec3::from(steps) * self.half[level]
    }
}

/// What rounding may take from or add to a gap along a direction: see the module. What underflows, of the world vertices, of places in
/// the objects, and of the products, is 2^-1060 at most, each times what it is multiplied by.
fn slack(direction: DVec3, along: [DVec3; 2], [a, b]: [Placed<'_>; 2]) -> f64 {
    let factors = [direction, along[0], along[1]].map(|vector| vector.abs().element_sum());
    let coordinates = reach(a.object).into_iter().chain(reach(b.object)).chain(factors).sum::<f64>();
    direction.abs().dot(a.magnitude + b.magnitude) * SLACK + UNDERFLOW * (4.0 + coordinates)
}

/// Three directions of length 1 at right angles, of which the first follows the longest column and the second the column that is
/// longest beside it (Gram and Schmidt, the second made twice: Giraud, Langou, Rozložník, "The loss of orthogonality in the Gram–Schmidt
/// orthogonalization process", 2005, "twice is enough").
fn frame(columns: &[DVec3; 3]) -> [DVec3; 3] {
    /// Columns shorter than this share of the longest one have no direction of their own beside it.
    const SHORTEST: f64 = f64::EPSILON;
    let largest = columns.iter().fold(0.0, |largest, column| f64::max(largest, column.abs().max_element()));
    if largest == 0.0 || !largest.is_finite() {
        return DVec3::AXES;
    }
    let columns = columns.map(|column| column / largest);
    let longest = |vectors: &[DVec3; 3]| {
        let longer = |i: usize, j: usize| if vectors[j].length_squared() > vectors[i].length_squared() { j } else { i };
        vectors[longer(longer(0, 1), 2)]
    };
    let first = longest(&columns).normalize();
    let beside = |vector: DVec3| vector - first * first.dot(vector);
    let second = longest(&columns.map(beside));
    let second = if second.length() > SHORTEST { beside(second.normalize()) } else { first.any_orthogonal_vector() };
    let second = second.normalize();
    [first, second, first.cross(second)]
}

/// The largest entry of `FᵀF − 1`.
fn skew(frame: &[DVec3; 3]) -> f64 {
    let entries =
        [0, 1, 2].map(|i| (frame[i].length_squared() - 1.0).abs().max(frame[i].dot(frame[(i + 1) % 3]).abs()));
    entries[0].max(entries[1]).max(entries[2])
}
