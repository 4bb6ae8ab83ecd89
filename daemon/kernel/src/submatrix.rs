//! Stage 5: containers, and interference submatrices.
//!
//! All voxels of one level have the same size and orientation, so the fifteen axes that may separate a voxel of one body from
//! one of the other (Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH 1996, section 5) are computed once per pair of bodies, and
//! along each axis the reach of a voxel is one number per level. The axes are taken in the world, from the columns of the two
//! transforms, so no inverse is needed and singular transforms are served too.
//!
//! # Why nothing is lost
//! A common point of two world polygons is, along any direction L, both `L·(A x + s + e)` and `L·(B y + t + f)`, where x and y
//! lie in voxels that list the polygons, and e and f are what rounding moved the vertices by
//! ([`rounding_bound`](crate::affine::rounding_bound)). So `|offset + α·x − β·y|` is at most `|L|·(|e| + |f|)`, with α = AᵀL,
//! β = BᵀL, offset = L·(s − t). Whatever vector L came out of its own rounding, this holds for it.
//!
//! Roundings, each of 2^-53, of what they are measured by; a and b are `|L|·|A|·reach` and `|L|·|B|·reach` (sums of magnitudes,
//! reach the largest coordinates), m is a + b + `|L|·(|s| + |t|)`, that is `|L|·(magnitude of A + magnitude of B)`:
//!
//! | what | roundings | of |
//! |---|---|---|
//! | offset: the difference, three products, two sums | 4 | `\|L\|·(\|s\| + \|t\|)` |
//! | centre and half sides against the planes of the voxel: 3 in a plane, 3 in the centre | 6 | a, b |
//! | α·centre: 3 in α, 3 in the product with it | 6 | a, b |
//! | reach, `\|α\|·half sides`: 3 and 3 | 6 | a, b |
//! | position, its sum with α·centre, reach and slack, their sum | 4 | m |
//! | e and f | 5 | m |
//!
//! Together 27 of m. [`reached`](PairFrame::reached) needs no centre and no reach of the voxel that is split, but has the skew (3
//! in α, 2 in its own products) and three more sums: 28. Its quotients are rounded to nearest and then compared with planes,
//! which are f64: rounding is monotone, so a quotient does not pass a plane that the exact one does not pass. [`SLACK`] is
//! more than twice as much, for the terms of second order and the rounding of magnitude and slack themselves.
//!
//! Underflow: L is at most 2 along each world axis, and a product loses 2^-1075. That is three products in each of offset,
//! α·centre and reach, 18 in e and f times 2, and in α three times the coordinates: all below [`UNDERFLOW`] times (4 + sum of
//! coordinates). Halving subnormal coordinates loses 2^-1075 four times, which α may make large: [`HALVING`] is added to half
//! sides.
//!
//! Overflow: every term and partial sum is at most m, up to rounding. The slack is computed from 2m, which overflows before any
//! of them can. Then the slack is infinite, or a comparison sees NaN, and nothing is discarded.

use glam::DVec3;

use crate::affine::Rows;
use crate::container::{HALVINGS_PER_LEVEL, MAX_ORDER};
use crate::object::Object;
use crate::path::length_at_most;
use crate::polygon_box::unit_scale;

const SLACK: f64 = 64.0 * (f64::EPSILON / 2.0);
/// 2^-1060.
pub(crate) const UNDERFLOW: f64 = f64::from_bits(1 << 14);
/// 2^-1072.
pub(crate) const HALVING: f64 = f64::from_bits(1 << 2);

/// Levels of the pyramid, the voxels of the full order included.
pub(crate) const MAX_LEVELS: usize = (MAX_ORDER.div_ceil(HALVINGS_PER_LEVEL) + 1) as usize;

/// Face normals of the first body, face normals of the second, products of their edges.
const AXES: usize = 15;

/// One of the two bodies of a pair, as this stage sees it.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'o> {
    pub object: &'o Object,
    pub rows: &'o Rows,
    /// See [`magnitude`](crate::affine::magnitude); over the container.
    pub magnitude: DVec3,
}

/// A voxel of some level: the node of that number in the matrix, or, at the last level, the voxel's list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Voxel {
    pub level: u8,
    pub number: u32,
    /// Place in the lattice of that level, per axis.
    pub index: [u32; 3],
}

impl Voxel {
    /// The container: the one voxel of order 0.
    pub const CONTAINER: Voxel = Voxel { level: 0, number: 0, index: [0; 3] };
}

/// What one body contributes to the separating axes.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// Per axis: transform's transpose times the axis.
    along: [DVec3; AXES],
    /// Per level and axis: half the extent of a voxel.
    reach: [[f64; AXES]; MAX_LEVELS],
    /// Per level: half sides of a voxel, in the object's frame.
    half: [DVec3; MAX_LEVELS],
    /// Per level: halvings of each axis.
    bits: [[u32; 3]; MAX_LEVELS],
    /// Per level: the longest side of a voxel in the world, roughly; decides which voxel is split.
    size: [f64; MAX_LEVELS],
    /// Middle of the container.
    middle: DVec3,
    /// The level whose voxels have children that are taken together, so many at a time: those of one voxel of the order at which
    /// the descent ends, when that order lies within a level.
    runs: Option<(usize, u32)>,
}

/// A pair of placed bodies, ready for comparing their voxels.
#[derive(Debug, Clone)]
pub(crate) struct PairFrame {
    sides: [Side; 2],
    offset: [f64; AXES],
    slack: [f64; AXES],
    /// Per side: the level at which the descent ends. Where a voxel is no larger than what rounding may move things by, its
    /// children cannot be told apart, and comparing them all would cost the square of their number for nothing.
    depth: [usize; 2],
    /// Per side and axis of its lattice: what the other two coordinates can add along the face normal.
    skew: [[f64; 3]; 2],
}

/// Which body of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Which {
    First = 0,
    Second = 1,
}

impl Which {
    pub fn other(self) -> Which {
        match self {
            Which::First => Which::Second,
            Which::Second => Which::First,
        }
    }
}

impl PairFrame {
    /// `None` when the containers are proven apart. `order`: the order of voxels at which the descent ends, if it is smaller than the
    /// object's own.
    pub fn new(a: Placed<'_>, b: Placed<'_>, order: Option<u32>) -> Option<PairFrame> {
        PairFrame::within(0.0, a, b, order)
    }

    /// Proves apart only what is proven farther apart than a clearance: the slack of each axis is larger by its length times that. `None`
    /// when the containers are.
    pub fn within(clearance: f64, a: Placed<'_>, b: Placed<'_>, order: Option<u32>) -> Option<PairFrame> {
        let (columns_a, columns_b) = (columns(a.rows), columns(b.rows));
        let directions = directions(&columns_a, &columns_b);
        let shift = DVec3::new(a.rows[0][3] - b.rows[0][3], a.rows[1][3] - b.rows[1][3], a.rows[2][3] - b.rows[2][3]);
        let coordinates = reach(a.object).into_iter().chain(reach(b.object)).sum::<f64>();
        let twice = 2.0 * (a.magnitude + b.magnitude);
        let mut slack =
            directions.map(|direction| direction.abs().dot(twice) * (0.5 * SLACK) + UNDERFLOW * (4.0 + coordinates));
        if clearance > 0.0 {
            // The sums that the slack enters have fewer roundings than this.
            let clearance = clearance * (1.0 + 8.0 * f64::EPSILON);
            slack.iter_mut().zip(&directions).for_each(|(slack, axis)| *slack += clearance * length_at_most(*axis));
        }
        let offset = directions.map(|direction| direction.dot(shift));
        let mut sides = [Side::new(a.object, &columns_a, &directions), Side::new(b.object, &columns_b, &directions)];
        let mut ends = [a.object, b.object].map(|object| object.matrix().depth());
        if let Some(order) = order {
            ends[0] = sides[0].end_at(order, a.object, &columns_a);
            ends[1] = sides[1].end_at(order, b.object, &columns_b);
        }
        let skew = [skew(&sides[0], a.object, 0), skew(&sides[1], b.object, 3)];
        let noise = (a.magnitude + b.magnitude).max_element() * SLACK;
        let depth = [sides[0].depth(ends[0], noise), sides[1].depth(ends[1], noise)];
        let frame = PairFrame { sides, offset, slack, depth, skew };
        let root = Voxel::CONTAINER;
        let seen = frame.seen_from(Which::First, root);
        (!frame.apart(Which::First, &seen, 0, root.index, 0..AXES)).then_some(frame)
    }

    /// Whether the descent ends at this voxel of `which`.
    #[inline]
    pub fn is_last(&self, which: Which, voxel: Voxel) -> bool {
        usize::from(voxel.level) == self.depth[which as usize]
    }

    /// See [`Side::runs`]: how many children of a voxel of this level of `which` are taken together, if they are.
    #[inline]
    pub fn run_of(&self, which: Which, level: usize) -> Option<u32> {
        self.sides[which as usize].runs.filter(|&(at, _)| at == level).map(|(_, run)| run)
    }

    /// Halvings of each axis of the voxels of a level.
    pub fn bits(&self, which: Which, level: usize) -> [u32; 3] {
        self.sides[which as usize].bits[level]
    }

    /// Order of the voxels of a level.
    pub fn order(&self, which: Which, voxel: Voxel) -> u32 {
        self.bits(which, usize::from(voxel.level)).iter().sum()
    }

    /// The other body's voxel as the axes see it: `offset − β·centre`, so that a voxel with centre c is apart when
    /// `|α·c + this|` exceeds what the two reach.
    pub fn seen_from(&self, split: Which, other: Voxel) -> Seen {
        let side = &self.sides[split.other() as usize];
        let centre = side.centre(other.level as usize, other.index);
        let sign = if split == Which::First { 1.0 } else { -1.0 };
        let level = other.level as usize;
        let mut seen = Seen { position: [0.0; AXES], reach: [0.0; AXES] };
        for axis in 0..AXES {
            seen.position[axis] = sign * self.offset[axis] - side.along[axis].dot(centre);
            seen.reach[axis] = side.reach[level][axis] + self.slack[axis];
        }
        seen
    }

    /// The extent, along one axis of the lattice of `split`, that the other's voxel reaches; NaN or infinite where unknown.
    pub fn reached(&self, split: Which, seen: &Seen, axis: usize) -> (f64, f64) {
        let face = 3 * split as usize + axis;
        let along = self.sides[split as usize].along[face][axis];
        if along == 0.0 || !along.is_finite() {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let reach = seen.reach[face] + self.skew[split as usize][axis];
        let ends = [(-seen.position[face] - reach) / along, (-seen.position[face] + reach) / along];
        if along > 0.0 { (ends[0], ends[1]) } else { (ends[1], ends[0]) }
    }

    /// Whether one of `axes` proves the voxel at `level` and `index` of `split` apart from the one that is `seen`.
    #[inline]
    pub fn apart(
        &self,
        split: Which,
        seen: &Seen,
        level: usize,
        index: [u32; 3],
        axes: std::ops::Range<usize>,
    ) -> bool {
        let side = &self.sides[split as usize];
        let centre = side.centre(level, index);
        let reach = &side.reach[level];
        let mut axes = axes;
        // False for NaN: what is not proven apart is kept.
        axes.any(|axis| (side.along[axis].dot(centre) + seen.position[axis]).abs() > reach[axis] + seen.reach[axis])
    }

    /// The axes besides the face normals of `split`, which [`reached`](Self::reached) has used.
    pub fn other_axes(split: Which) -> [std::ops::Range<usize>; 2] {
        match split {
            Which::First => [3..AXES, 0..0],
            Which::Second => [0..3, 6..AXES],
        }
    }

    /// Centre of a voxel, in the object's frame.
    pub fn centre(&self, which: Which, voxel: Voxel) -> DVec3 {
        self.sides[which as usize].centre(usize::from(voxel.level), voxel.index)
    }

    /// Half the sides of a voxel, in the object's frame.
    pub fn half_sides(&self, which: Which, voxel: Voxel) -> DVec3 {
        self.sides[which as usize].half[usize::from(voxel.level)]
    }

    /// More than rounding can move a point of one body against one of the other, or a polygon out of a voxel that lists it.
    pub fn noise(&self, a: Placed<'_>, b: Placed<'_>) -> f64 {
        2.0 * SLACK * (a.magnitude + b.magnitude).length() + UNDERFLOW
    }

    /// The length of a translation that takes the containers apart: the smallest overlap along an axis.
    pub fn overlap_of_containers(&self, a: Placed<'_>, b: Placed<'_>) -> f64 {
        let directions = directions(&columns(a.rows), &columns(b.rows));
        let (seen, side) = (self.seen_from(Which::First, Voxel::CONTAINER), &self.sides[0]);
        let centre = side.centre(0, [0; 3]);
        let overlaps = directions.iter().enumerate().map(|(axis, direction)| {
            let between = (side.along[axis].dot(centre) + seen.position[axis]).abs();
            (side.reach[0][axis] + seen.reach[axis] - between) / direction.length()
        });
        overlaps.fold(f64::INFINITY, |least, overlap| if overlap >= 0.0 { least.min(overlap) } else { least })
    }

    /// Which of two voxels is larger in the world.
    pub fn larger(&self, a: Voxel, b: Voxel) -> Which {
        let size = |which: Which, voxel: Voxel| self.sides[which as usize].size[voxel.level as usize];
        if size(Which::First, a) >= size(Which::Second, b) { Which::First } else { Which::Second }
    }
}

/// A voxel as the separating axes see it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    position: [f64; AXES],
    /// Half its extent, and the slack of the axis.
    reach: [f64; AXES],
}

impl Side {
    fn new(object: &Object, columns: &[DVec3; 3], directions: &[DVec3; AXES]) -> Side {
        let lattice = object.matrix().lattice();
        let along = directions.map(|direction| DVec3::from(columns.map(|column| column.dot(direction))));
        let container = lattice.container();
        let mut side = Side {
            along,
            reach: [[0.0; AXES]; MAX_LEVELS],
            half: [DVec3::ZERO; MAX_LEVELS],
            bits: [[0; 3]; MAX_LEVELS],
            size: [0.0; MAX_LEVELS],
            middle: 0.5 * DVec3::from(container.min) + 0.5 * DVec3::from(container.max),
            runs: None,
        };
        for level in 0..=object.matrix().depth() {
            side.set_level(level, lattice.bits_at(level), object, columns);
        }
        side
    }

    fn set_level(&mut self, level: usize, bits: [u32; 3], object: &Object, columns: &[DVec3; 3]) {
        let half = object.matrix().lattice().half_sides_after(bits);
        self.bits[level] = bits;
        self.half[level] = half;
        self.reach[level] = self.along.map(|along| along.abs().dot(half + DVec3::splat(HALVING)));
        let sides = [0, 1, 2].map(|axis| columns[axis].abs().max_element() * half[axis]);
        self.size[level] = sides[0].max(sides[1]).max(sides[2]);
    }

    /// Ends the descent at the voxels of `order`, or of the object's own if that is smaller; says at which level. Where the order lies
    /// within a level, the voxels of the next one are from now on those of the order.
    fn end_at(&mut self, order: u32, object: &Object, columns: &[DVec3; 3]) -> usize {
        let lattice = object.matrix().lattice();
        if order >= lattice.order() {
            return object.matrix().depth();
        }
        let (level, halvings) = ((order / HALVINGS_PER_LEVEL) as usize, order % HALVINGS_PER_LEVEL);
        if halvings == 0 {
            return level;
        }
        let children = lattice.levels()[level].place.len() as u32;
        self.runs = Some((level, children >> halvings));
        self.set_level(level + 1, lattice.bits_at_order(order), object, columns);
        level + 1
    }

    /// The first level whose voxels are within `noise` of a point, or as large in the world as those of the last one (which they
    /// are when the body is flattened across the side that is halved), or the last one.
    fn depth(&self, last: usize, noise: f64) -> usize {
        (0..last).find(|&level| self.size[level] <= noise.max(self.size[last])).unwrap_or(last)
    }

    /// Centre of a voxel, in the object's frame. Counted from the middle, so that nothing overflows.
    #[inline]
    fn centre(&self, level: usize, index: [u32; 3]) -> DVec3 {
        let bits = self.bits[level];
        let steps = [0, 1, 2].map(|axis| (2 * i64::from(index[axis]) + 1 - (1i64 << bits[axis])) as f64);
        self.middle + DVec3::from(steps) * self.half[level]
    }
}

/// The largest magnitude of each coordinate of what the voxels hold.
pub(crate) fn reach(object: &Object) -> [f64; 3] {
    object.matrix().lattice().container().reach()
}

pub(crate) fn columns(rows: &Rows) -> [DVec3; 3] {
    [0, 1, 2].map(|column| DVec3::new(rows[0][column], rows[1][column], rows[2][column]))
}

/// The fifteen axes. One that comes out as zero separates nothing, and flattened bodies may have no other: the world's own axes
/// take the place of those.
pub(crate) fn directions(columns_a: &[DVec3; 3], columns_b: &[DVec3; 3]) -> [DVec3; AXES] {
    let (a, b) = (columns_a.map(unit_scale), columns_b.map(unit_scale));
    let faces = |edges: &[DVec3; 3]| [edges[1].cross(edges[2]), edges[2].cross(edges[0]), edges[0].cross(edges[1])];
    let mut directions = [DVec3::ZERO; AXES];
    directions[..3].copy_from_slice(&faces(&a));
    directions[3..6].copy_from_slice(&faces(&b));
    for (i, edge) in a.iter().enumerate() {
        for (j, other) in b.iter().enumerate() {
            directions[6 + 3 * i + j] = edge.cross(*other);
        }
    }
    for (axis, direction) in directions.iter_mut().enumerate() {
        if *direction == DVec3::ZERO {
            *direction = DVec3::AXES[axis % 3];
        }
    }
    directions
}

/// A face normal is at right angles to the other two edges only up to rounding.
fn skew(side: &Side, object: &Object, first_face: usize) -> [f64; 3] {
    let reach = reach(object);
    [0, 1, 2].map(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        let along = side.along[first_face + axis];
        along[next].abs() * reach[next] + along[last].abs() * reach[last]
    })
}
