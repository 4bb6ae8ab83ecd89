//! Stage 5: containers, and interference submatrices.
//!
//! All cells of one rank have the same size and orientation, so the fifteen axes that may separate a cell of one body from one
//! of the other (Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH 1996, section 5) are computed once per pair of bodies, and
//! along each axis the reach of a cell is one number per rank. The axes are taken in the world, from the columns of the two
//! transforms, so no inverse is needed and singular transforms are served too. A cell is compared along all axes at once,
//! and then again with the [box](crate::cell_boxes) within it.
//!
//! # Why nothing is lost
//! A common point of two world polygons is, along any direction L, both `L·(A x + s + e)` and `L·(B y + t + f)`, where x and y
//! lie in cells that hold the polygons, and e and f are what rounding moved the vertices by
//! ([`rounding_bound`](crate::affine::rounding_bound)). So `|offset + α·x − β·y|` is at most `|L|·(|e| + |f|)`, with α = AᵀL,
//! β = BᵀL, offset = L·(s − t). Whatever vector L came out of its own rounding, this holds for it.
//!
//! Roundings in f64, each of 2^-53, of what they are measured by; a and b are `|L|·|A|·reach` and `|L|·|B|·reach` (sums of
//! magnitudes, reach the largest coordinates), m is a + b + `|L|·(|s| + |t|)`, that is `|L|·(magnitude of A + magnitude of B)`:
//!
//! | what | roundings | of |
//! |---|---|---|
//! | offset of the origins: the difference, three products, two sums | 4 | `\|L\|·(\|s\| + \|t\|)` |
//! | offset of the middles: 3 in α, the product, six sums | 10 | m |
//! | middle, half sides and centre against the planes of the voxel: 3 in a plane, 3 in the others | 6 | a, b |
//! | centre of a cell, a share of the container's edges: 3 in α, 3 in products and the scale, 2 in the sum | 8 | a, b |
//! | reach, likewise without its sum | 5 | a, b |
//! | the scale of the offset, and the sums of offset and centres | 3 | m |
//! | e and f | 5 | m |
//!
//! Together 41 of m; that of the containers, which is compared in f64, has no centre of a cell but seven sums in its reach. [`SLACK`]
//! is half as much again, for the terms of second order and the rounding of magnitude and slack themselves.
//!
//! Everything along an axis is divided by what the containers reach along it, so that f32 holds it. Roundings there, of u =
//! 2^-24; R is what two cells reach, slack included. Where they have a common point, their centres are no farther apart. A part
//! reaches an eighth of its parent or more along each axis, so R shrinks to an eighth by a cut at most. `between`, computed in
//! f64, is within 9u·R of its place when it is rounded, R that of the part about to be reached. The centre of a part is within
//! 24u·R of its place (the edge, two sums), and the sum with it is rounded: 25u·R with each expansion. After [`STALE`] = 3 of
//! them that is (34·64 + 25·8 + 25)·u·R. A box within a cell adds 12u·R. Reaches are sums of three products, below 8u·R.
//! Together below 2^-12·R, of which [`WIDEN`] is twice as much; for boxes, too, R is that of the whole cells. What underflows
//! in f32 is far below the slack, which is 2^-48 of what the containers reach or more.
//!
//! Underflow in f64: L is at most 2 along each world axis, and a product loses 2^-1075. That is three products in each of offset,
//! α·centre and reach, 18 in e and f times 2, and in α three times the coordinates: all far below [`UNDERFLOW`] times (4 + sum
//! of coordinates). Halving subnormal coordinates loses 2^-1075 four times, which α may make large: it is added where there are any.
//!
//! Overflow: every term and partial sum is at most m, up to rounding. The slack is computed from 2m, which overflows before any
//! of them can. Then a comparison sees NaN or an infinite reach, and nothing is discarded.
//!
//! [`STALE`]: crate::voxel_pairs::STALE

mod containers;
mod lanes;
mod moving;
mod outline;
mod side;
mod world_boxes;

use glam::DVec3;

use crate::affine::Rows;
use crate::cells::{Cell, Cut};
use crate::container::{HALVINGS_PER_LEVEL, MAX_ORDER};
use crate::instructions::{Work, dispatch};
use crate::object::Object;
use crate::polygon_box::unit_scale;
use containers::{Along, Containers};
use lanes::LANES;
pub(crate) use lanes::Lanes;
pub(crate) use moving::{MovingBox, MovingContainers, MovingFrame, Window};
pub(crate) use outline::{Outline, are_apart};
use side::{PartsAlong, Side};
pub(crate) use world_boxes::BoxFrame;

const SLACK: f64 = 64.0 * (f64::EPSILON / 2.0);
/// 2^-1020. Far more than underflow can take, but normal: arithmetic with subnormal numbers is a hundred times slower.
pub(crate) const UNDERFLOW: f64 = 4.0 * f64::MIN_POSITIVE;
/// 2^-900. What halving takes from larger coordinates is nothing to what rounding does.
const SMALLEST: f64 = f64::from_bits((1023 - 900) << 52);
/// 2^-1072.
pub(crate) const HALVING: f64 = f64::from_bits(1 << 2);
/// 1 + 2^-11: covers what f32 rounds.
const WIDEN: f32 = 1.0 + 1.0 / 2048.0;

/// Levels of the pyramid, the voxels of the full order included.
pub(crate) const MAX_LEVELS: usize = (MAX_ORDER.div_ceil(HALVINGS_PER_LEVEL) + 1) as usize;

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

/// A pair of placed bodies, ready for comparing their cells. Used for one pair after the other.
#[derive(Debug, Default)]
pub(crate) struct PairFrame {
    sides: [Side; 2],
    /// From the middle of the second container to that of the first, over their reach.
    offset: [f64; LANES],
    slack: Lanes,
    /// How far apart the middles of the containers may be.
    reach: [f64; LANES],
    boxes: BoxFrame,
}

/// [`PairFrame::start_within`], for the instructions of the processor.
struct Start<'f, 'o> {
    frame: &'f mut PairFrame,
    clearance: f64,
    sides: [Placed<'o>; 2],
    order: Option<u32>,
}

impl Work for Start<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.frame.start_with(self.clearance, self.sides, self.order)
    }
}

impl PairFrame {
    /// False when the containers are proven apart. `order`: the order of voxels at which the descent ends, if it is smaller than the
    /// object's own.
    pub fn start(&mut self, a: Placed<'_>, b: Placed<'_>, order: Option<u32>) -> bool {
        self.start_within(0.0, a, b, order)
    }

    /// Proves apart only what is proven farther apart than a clearance: the slack of each axis is larger by its length times that. False
    /// when the containers are.
    pub fn start_within(&mut self, clearance: f64, a: Placed<'_>, b: Placed<'_>, order: Option<u32>) -> bool {
        dispatch(Start { frame: self, clearance, sides: [a, b], order })
    }

    #[inline(always)]
    fn start_with(&mut self, clearance: f64, [a, b]: [Placed<'_>; 2], order: Option<u32>) -> bool {
        let containers = Containers::new(clearance, a, b);
        let Some(along) = containers.along() else { return false };
        self.scale(&along);
        let noise = (0.5 * containers.twice).max_element() * SLACK;
        for body in 0..2 {
            let object = containers.placed[body].object;
            let side = &mut self.sides[body];
            side.start(object, &containers.columns[body], &containers.halves[body]);
            let last = match order {
                Some(order) if order < object.order() => {
                    side.end_at(order, object, &containers.columns[body], &containers.halves[body])
                }
                _ => object.matrix().lattice().cuts().len(),
            };
            side.depth = side.depth(last, noise);
        }
        self.place_boxes(&containers);
        true
    }

    /// Takes over what is along the axes, divided by the reach of the containers so that f32 can hold it.
    #[inline(always)]
    fn scale(&mut self, along: &Along) {
        /// 2^-30.
        const UNIT: f64 = 1.0 / (1u64 << MAX_ORDER) as f64;
        let scale = along.reach.map(|reach| 1.0 / reach);
        let scaled = |values: &[f64; LANES]| -> [f64; LANES] { std::array::from_fn(|lane| values[lane] * scale[lane]) };
        for (side, edges) in self.sides.iter_mut().zip(&along.edges) {
            for axis in 0..3 {
                let edge = scaled(&edges[axis]);
                side.along[axis] = edge.map(|edge| edge * UNIT);
                side.edges[axis] = Lanes::rounded(&edge);
            }
        }
        self.offset = scaled(&along.offset);
        self.slack = Lanes::rounded(&scaled(&along.slack)).times(WIDEN);
        self.reach = along.reach;
    }

    /// Whether the descent ends at this cell of `which`.
    #[inline(always)]
    pub fn is_last(&self, which: Which, cell: &Cell) -> bool {
        usize::from(cell.rank) >= self.sides[which as usize].depth
    }

    /// The cut in place of the matrix's own of a cell of this rank, if there is one.
    pub fn last_cut(&self, which: Which, rank: u8) -> Option<&Cut> {
        let last = self.sides[which as usize].last_cut.as_ref();
        last.filter(|(at, _)| *at == usize::from(rank)).map(|(_, cut)| cut)
    }

    /// The parts that a cell of this rank is cut into, as the axes see them from a cell of the other body; `between` is what
    /// lies between the two.
    #[inline(always)]
    pub fn parts(
        &mut self,
        split: Which,
        rank: u8,
        part_rank: u8,
        cut: &Cut,
        other: &Cell,
        between: &Lanes,
    ) -> PartsAlong<'_> {
        if self.sides[split as usize].known >> rank & 1 == 0 {
            self.sides[split as usize].learn(split, rank, cut);
        }
        let (side, beside) = (&self.sides[split as usize], &self.sides[split.other() as usize]);
        let own = side.reach[part_rank as usize];
        // What f32 rounds is measured by whole cells, however little their polygons reach of them.
        let rounding = own.plus(&beside.reach[other.rank as usize]).times(WIDEN - 1.0);
        let beside = beside.bounds(split.other(), other.rank, &other.bounds);
        let boxes = beside.reach.plus(&self.slack).plus(&rounding);
        PartsAlong {
            centres: &side.parts[rank as usize],
            base: between.plus(&beside.centre),
            reach: own.plus(&boxes),
            beside: boxes,
            side,
            split,
        }
    }

    /// `offset + α·centre − β·centre` of two cells.
    #[inline(always)]
    pub fn between(&self, [a, b]: &[Cell; 2]) -> Lanes {
        let [first, second] = &self.sides;
        let (s, t) = (a.centre.map(f64::from), b.centre.map(f64::from));
        let mut between = self.offset;
        for lane in 0..LANES {
            let at = |side: &Side, centre: [f64; 3]| {
                side.along[0][lane] * centre[0] + side.along[1][lane] * centre[1] + side.along[2][lane] * centre[2]
            };
            between[lane] += at(first, s) - at(second, t);
        }
        Lanes::rounded(&between)
    }

    /// Which of two cells is larger in the world.
    #[inline(always)]
    pub fn larger(&self, [a, b]: &[Cell; 2]) -> Which {
        let size = |which: Which, cell: &Cell| self.sides[which as usize].size[cell.rank as usize];
        if size(Which::First, a) >= size(Which::Second, b) { Which::First } else { Which::Second }
    }

    /// Half the sides of a cell, over those of its container.
    pub fn shares(&self, which: Which, cell: &Cell) -> [f32; 3] {
        self.sides[which as usize].shares[cell.rank as usize]
    }

    /// More than rounding can move a point of one body against one of the other, or a polygon out of a voxel that lists it.
    pub fn noise(&self, a: Placed<'_>, b: Placed<'_>) -> f64 {
        2.0 * SLACK * (a.magnitude + b.magnitude).length() + UNDERFLOW
    }

    /// The length of a translation that takes the containers apart: the smallest overlap along an axis.
    pub fn overlap_of_containers(&self, a: Placed<'_>, b: Placed<'_>) -> f64 {
        let directions = directions(&columns(a.rows), &columns(b.rows));
        let overlaps = directions
            .iter()
            .enumerate()
            .map(|(lane, direction)| (1.0 - self.offset[lane].abs()) * self.reach[lane] / direction.length());
        overlaps.fold(f64::INFINITY, |least, overlap| if overlap >= 0.0 { least.min(overlap) } else { least })
    }
}

/// The largest magnitude of each coordinate of what the voxels hold.
pub(crate) fn reach(object: &Object) -> [f64; 3] {
    object.matrix().lattice().container().reach()
}

pub(crate) fn columns(rows: &Rows) -> [DVec3; 3] {
    [0, 1, 2].map(|column| DVec3::new(rows[0][column], rows[1][column], rows[2][column]))
}

/// The fifteen axes: face normals of the first container, face normals of the second, products of their edges. One that comes
/// out as zero separates nothing, and flattened bodies may have no other: the world's own axes take the place of those.
pub(crate) fn directions(columns_a: &[DVec3; 3], columns_b: &[DVec3; 3]) -> [DVec3; 15] {
    let edges = [unit_columns(*columns_a), unit_columns(*columns_b)];
    let (faces, products) = (faces(&edges), products(&edges));
    std::array::from_fn(|axis| if axis < 6 { faces[axis] } else { products[axis - 6] })
}

/// The columns with components of at most 1, so that products of two of them neither overflow nor vanish.
#[inline(always)]
fn unit_columns(columns: [DVec3; 3]) -> [DVec3; 3] {
    columns.map(|column| {
        let largest = column.abs().max_element();
        // Those of a rotation are as they should be.
        if (0.5..=1.0).contains(&largest) { column } else { unit_scale(column) }
    })
}

#[inline(always)]
fn faces(edges: &[[DVec3; 3]; 2]) -> [DVec3; 6] {
    let ([i, j, k], [l, m, n]) = (sides(&edges[0]), sides(&edges[1]));
    [i, j, k, l, m, n]
}

/// The normals of the sides of one container.
#[inline(always)]
fn sides(edges: &[DVec3; 3]) -> [DVec3; 3] {
    separating([edges[1].cross(edges[2]), edges[2].cross(edges[0]), edges[0].cross(edges[1])])
}

#[inline(always)]
fn products(edges: &[[DVec3; 3]; 2]) -> [DVec3; 9] {
    let [a, b] = edges;
    separating(std::array::from_fn(|pair| a[pair / 3].cross(b[pair % 3])))
}

#[inline(always)]
fn separating<const COUNT: usize>(mut directions: [DVec3; COUNT]) -> [DVec3; COUNT] {
    for (axis, direction) in directions.iter_mut().enumerate() {
        if *direction == DVec3::ZERO {
            *direction = DVec3::AXES[axis % 3];
        }
    }
    directions
}
