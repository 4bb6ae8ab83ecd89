//! When two voxels of moving bodies may meet: the separating axes of `submatrix.rs`, over a span of time.
//!
//! Over a span every point moves on a straight line, but for a known deviation. Along a fixed axis the distance between
//! the centres of two voxels is then linear in time, and half the extent of each is convex, so at most the line between
//! its values at the ends: an axis leaves the voxels an interval of time, two linear inequalities, and what all axes
//! leave is the window in which the voxels may meet. Children have no window outside their parents'.
//!
//! # Why nothing is lost
//! As written in `submatrix.rs`, at both ends of the span, with the magnitudes of the whole motion. What the motion
//! adds to it, the rounding of the positions on the way and the deviation from the chords, is part of the slack of each
//! axis.

use glam::DVec3;

use super::body::MovingBody;
use crate::affine::Rows;
use crate::object::Object;
use crate::submatrix::{MAX_LEVELS, Voxel, columns, directions};

const SLACK: f64 = 64.0 * (f64::EPSILON / 2.0);
/// 2^-1060.
const UNDERFLOW: f64 = f64::from_bits(1 << 14);

/// The axes are taken eight at a time, which the compiler turns into vectors: the face normals and two products of
/// edges, then the other products. Most voxels that are apart are told by the first part. The last axis is none, and
/// separates nothing.
const LANES: usize = 8;
const PARTS: usize = 2;

/// A number per axis of a part.
type Lanes = [f64; LANES];

/// A number per axis, by parts.
fn per_axis(number: impl Fn(usize) -> f64) -> [Lanes; PARTS] {
    std::array::from_fn(|part| std::array::from_fn(|lane| number(LANES * part + lane)))
}

/// A window of time, in the time of the span: 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    pub from: f64,
    pub until: f64,
}

impl Window {
    pub const WHOLE: Window = Window { from: 0.0, until: 1.0 };

    /// Leaves what is not after the times at which a linear function, from `start` to `end`, is positive; whether that
    /// is anything.
    ///
    /// Three roundings move the root by less than 4·2^-53 of itself, and outward it is moved by twice that.
    #[inline]
    pub fn leave_where_not_positive(&mut self, start: f64, end: f64) -> bool {
        const INWARD: f64 = 1.0 - 4.0 * f64::EPSILON;
        if start > 0.0 {
            if end > 0.0 {
                return false;
            }
            self.from = self.from.max(start / (start - end) * INWARD);
        } else if end > 0.0 {
            self.until = self.until.min(1.0 - end / (end - start) * INWARD + f64::EPSILON);
        }
        self.from <= self.until
    }
}

/// What one body contributes to the separating axes at both ends of the span.
#[derive(Debug, Clone)]
struct Side {
    /// Per end, object coordinate and axis: transform's transpose times the axis.
    along: [[[Lanes; PARTS]; 3]; 2],
    /// Per level, end and axis: half the extent of a voxel.
    reach: [[[Lanes; PARTS]; 2]; MAX_LEVELS],
    half: [DVec3; MAX_LEVELS],
    bits: [[u32; 3]; MAX_LEVELS],
    /// Per level: the longest side of a voxel in the world, roughly; decides which voxel is split.
    size: [f64; MAX_LEVELS],
    middle: DVec3,
}

/// Two moving bodies over a span of time.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    sides: [Side; 2],
    offset: [[Lanes; PARTS]; 2],
    slack: [Lanes; PARTS],
}

/// A voxel as the axes see it from those of one level of the other body, at both ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    position: [[Lanes; PARTS]; 2],
    /// What the two reach together.
    reach: [[Lanes; PARTS]; 2],
}

impl Frame {
    pub fn new(bodies: [&MovingBody<'_>; 2], start: f64, end: f64) -> Frame {
        let at = |t: f64| bodies.map(|body| body.motion.at(t));
        let (ends, middle) = ([at(start), at(end)], at(0.5 * start + 0.5 * end));
        let mut axes = [DVec3::ZERO; LANES * PARTS];
        axes[..15].copy_from_slice(&directions(&columns(&middle[0]), &columns(&middle[1])));
        let magnitude = bodies[0].magnitude + bodies[1].magnitude;
        let bound = bodies[0].bound + bodies[1].bound;
        let deviation: f64 = bodies.iter().map(|body| body.deviation(end - start)).sum();
        let coordinates = bodies.iter().flat_map(|body| body.reach).sum::<f64>();
        let slack = per_axis(|axis| {
            let rounding = axes[axis].abs().dot(magnitude * SLACK + bound);
            rounding + axes[axis].length() * deviation * (1.0 + 1e-15) + UNDERFLOW * (4.0 + coordinates)
        });
        let offset = ends.map(|[a, b]| {
            let shift = DVec3::new(a[0][3] - b[0][3], a[1][3] - b[1][3], a[2][3] - b[2][3]);
            per_axis(|axis| axes[axis].dot(shift))
        });
        let side = |which: usize| Side::new(bodies[which].object, [&ends[0][which], &ends[1][which]], &axes);
        Frame { sides: [side(0), side(1)], offset, slack }
    }

    /// The voxel `other` of the body that is not `split`, so that one of `split` at `level` with centre c may meet it
    /// while `|α·c + position|` is at most what the two reach.
    pub fn seen_from(&self, split: usize, level: usize, other: Voxel) -> Seen {
        let (own, side) = (&self.sides[split], &self.sides[1 - split]);
        let other_level = usize::from(other.level);
        let centre = side.centre(other_level, other.index);
        let sign = if split == 0 { 1.0 } else { -1.0 };
        let mut seen = Seen { position: self.offset, reach: own.reach[level] };
        for end in 0..2 {
            let [x, y, z] = &side.along[end];
            for part in 0..PARTS {
                for lane in 0..LANES {
                    let along = x[part][lane] * centre.x + y[part][lane] * centre.y + z[part][lane] * centre.z;
                    let position = &mut seen.position[end][part][lane];
                    *position = sign * *position - along;
                    seen.reach[end][part][lane] += side.reach[other_level][end][part][lane] + self.slack[part][lane];
                }
            }
        }
        seen
    }

    /// The times within `window` at which the voxel at `level` and `index` of `split` may meet the one that is `seen`
    /// from its level.
    #[inline]
    pub fn window(
        &self,
        split: usize,
        seen: &Seen,
        level: usize,
        index: [u32; 3],
        mut window: Window,
    ) -> Option<Window> {
        let side = &self.sides[split];
        let centre = side.centre(level, index);
        (0..PARTS).all(|part| side.leave(part, seen, centre, &mut window)).then_some(window)
    }

    /// The times at which the containers may meet.
    pub fn containers(&self) -> Option<Window> {
        let root = Voxel::CONTAINER;
        self.window(0, &self.seen_from(0, 0, root), 0, root.index, Window::WHOLE)
    }

    /// The longest side of a voxel in the world, roughly.
    pub fn size(&self, which: usize, level: u8) -> f64 {
        self.sides[which].size[usize::from(level)]
    }
}

impl Side {
    fn new(object: &Object, rows: [&Rows; 2], axes: &[DVec3; LANES * PARTS]) -> Side {
        let columns = rows.map(columns);
        let along = columns.map(|columns| columns.map(|column| per_axis(|axis| column.dot(axes[axis]))));
        let lattice = object.matrix().lattice();
        let container = lattice.container();
        let mut side = Side {
            along,
            reach: [[[[0.0; LANES]; PARTS]; 2]; MAX_LEVELS],
            half: [DVec3::ZERO; MAX_LEVELS],
            bits: [[0; 3]; MAX_LEVELS],
            size: [0.0; MAX_LEVELS],
            middle: 0.5 * DVec3::from(container.min) + 0.5 * DVec3::from(container.max),
        };
        for level in 0..=object.matrix().depth() {
            let half = lattice.half_sides_at(level);
            side.half[level] = half;
            side.bits[level] = lattice.bits_at(level);
            for end in 0..2 {
                let size = |coordinate: usize, axis: usize| along[end][coordinate][axis / LANES][axis % LANES].abs();
                side.reach[level][end] =
                    per_axis(|axis| DVec3::from([0, 1, 2].map(|coordinate| size(coordinate, axis))).dot(half));
            }
            let sides = columns.map(|columns| [0, 1, 2].map(|axis| columns[axis].abs().max_element() * half[axis]));
            side.size[level] = sides.as_flattened().iter().copied().fold(0.0, f64::max);
        }
        side
    }

    /// Leaves of the window what the axes of a part do; whether that is anything.
    #[inline(always)]
    fn leave(&self, part: usize, seen: &Seen, centre: DVec3, window: &mut Window) -> bool {
        let place = |end: usize| -> Lanes {
            let [x, y, z] = &self.along[end];
            let (x, y, z, position) = (&x[part], &y[part], &z[part], &seen.position[end][part]);
            std::array::from_fn(|lane| {
                (x[lane] * centre.x + y[lane] * centre.y) + (z[lane] * centre.z + position[lane])
            })
        };
        let (starts, ends) = (place(0), place(1));
        let (first, last) = (&seen.reach[0][part], &seen.reach[1][part]);
        // False for NaN: what is not proven apart is kept.
        let apart = |lane: usize| (starts[lane].abs() > first[lane]) | (ends[lane].abs() > last[lane]);
        if !(0..LANES).fold(false, |any, lane| any | apart(lane)) {
            return true;
        }
        (0..LANES).all(|lane| {
            !apart(lane)
                || window.leave_where_not_positive(starts[lane] - first[lane], ends[lane] - last[lane])
                    && window.leave_where_not_positive(-starts[lane] - first[lane], -ends[lane] - last[lane])
        })
    }

    /// Centre of a voxel, in the object's frame. Counted from the middle, so that nothing overflows.
    #[inline]
    fn centre(&self, level: usize, index: [u32; 3]) -> DVec3 {
        let bits = self.bits[level];
        let steps = [0, 1, 2].map(|axis| (2 * i64::from(index[axis]) + 1 - (1i64 << bits[axis])) as f64);
        self.middle + DVec3::from(steps) * self.half[level]
    }
}
