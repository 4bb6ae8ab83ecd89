//! Stage 1: how far the points of a body have come, at most.
//!
//! Two surfaces that were a distance apart have no point in common while their points have together come less far than that
//! (`step/coherence.rs`). Each vertex moves no farther than the container's corners do, and every other point of a polygon no
//! farther than its vertices.
//!
//! # Rounding
//! With M, per world axis, the sum of the magnitudes ([`magnitude`](crate::affine::magnitude)) under both transforms and
//! u = 2^-53: the two world vertices are 5u·M off together, the differences of the entries, the centre and half sides of the
//! container and the products and sums less than 20u·M. [`ROUNDING`] is more than that; what products lose to underflow is below
//! [`UNDERFLOW`], and what halving subnormal sides loses below [`HALVING`]. The length of the vector has a few roundings of
//! its own, which the factor [`UPWARDS`] is above. Overflow leaves infinity or NaN, and the path begins anew.

use glam::DVec3;

use crate::affine::Rows;
use crate::container::Container;
use crate::motion::Motion;
use crate::submatrix::{HALVING, UNDERFLOW};

const ROUNDING: f64 = 32.0 * (f64::EPSILON / 2.0);
const UPWARDS: f64 = 1.0 + 16.0 * f64::EPSILON;

/// The way of a body since nothing was known of it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Path {
    /// At least the sum, over the steps, of how far any point has moved in each. World length.
    length: f64,
    /// How far any point has moved in the last step, at most.
    last: f64,
    /// The step that began it.
    begun: u64,
    /// The last step.
    step: u64,
}

impl Path {
    /// The path that begins with a step: what was known of the body's place before holds no longer.
    pub fn begin(step: u64) -> Path {
        Path { length: 0.0, last: 0.0, begun: step, step }
    }

    /// The path after one step more, in which no point has moved farther.
    pub fn advanced(&self, by: f64, step: u64) -> Path {
        let length = if by == 0.0 { self.length } else { (self.length + by).next_up() };
        if length.is_finite() { Path { length, last: by, step, ..*self } } else { Path::begin(step) }
    }

    /// The step that it leads to.
    pub fn step(&self) -> u64 {
        self.step
    }

    pub fn length(&self) -> f64 {
        self.length
    }

    /// Whether it has led through its last step from before.
    pub fn leads_through(&self) -> bool {
        self.begun < self.step
    }

    /// How far any point was from where the last step began, at any time of it.
    pub fn within(&self) -> f64 {
        self.last
    }
}

/// How far any point of the container's contents is, at any time of the motion, from where it was at the start: rounded world
/// positions and exact ones alike. Infinity or NaN when that is beyond f64. `magnitudes`: the sum of those at the start and at the end.
pub(crate) fn displacement(container: &Container, motion: &Motion, end: &Rows, magnitudes: DVec3) -> f64 {
    let between_ends = |from: &Rows| between(container, from, end, magnitudes);
    match motion {
        Motion::Still(_) => 0.0,
        Motion::Linear { from, .. } => between_ends(from),
        // Between two of its positions a point on a circle has come the chord, which is no longer than the arc or the diameter.
        Motion::Rigid { from, translate, .. } => {
            let arc = motion.turn().min(2.0) * motion.radius(container);
            let along = length_at_most(DVec3::from(*translate).abs());
            let rounding = length_at_most(motion.position_bound(container.reach()));
            ((arc + along + 2.0 * rounding) * UPWARDS).max(between_ends(from))
        }
    }
}

/// The same between two transforms. On a straight line the end is the farthest.
fn between(container: &Container, from: &Rows, to: &Rows, magnitudes: DVec3) -> f64 {
    let (min, max) = (DVec3::from(container.min), DVec3::from(container.max));
    let (centre, half) = (0.5 * min + 0.5 * max, 0.5 * max - 0.5 * min + DVec3::splat(HALVING));
    let farthest = DVec3::from([0, 1, 2].map(|row| {
        let [x, y, z, shift] = [0, 1, 2, 3].map(|column| to[row][column] - from[row][column]);
        let linear = DVec3::new(x, y, z);
        (linear.dot(centre) + shift).abs() + linear.abs().dot(half)
    }));
    length_at_most(farthest + magnitudes * ROUNDING + DVec3::splat(UNDERFLOW))
}

/// The length of a vector, or a little more. Scaled first: a square that vanished would make it less.
pub(crate) fn length_at_most(vector: DVec3) -> f64 {
    let largest = vector.abs().max_element();
    if largest > 0.0 { (vector / largest).length() * largest * UPWARDS + UNDERFLOW } else { vector.element_sum() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affine::{IDENTITY, magnitude, world_vertex};

    fn check(container: &Container, motion: &Motion) {
        let [start, end] = [motion.at(0.0), motion.end()];
        let magnitudes = [&start, &end].map(|rows| magnitude(rows, container.reach()));
        let reached = displacement(container, motion, &end, magnitudes[0] + magnitudes[1]);
        let corner = |rows: &Rows, corner: usize| {
            let side = |axis: usize| [container.min, container.max][corner >> axis & 1][axis];
            world_vertex(rows, [side(0), side(1), side(2)])
        };
        for step in 0..=16 {
            let rows = motion.at(f64::from(step) / 16.0);
            let farthest = (0..8).map(|at| {
                let way = corner(&rows, at) - corner(&motion.at(0.0), at);
                let largest = way.abs().max_element();
                if largest > 0.0 { (way / largest).length() * largest } else { 0.0 }
            });
            let farthest = farthest.fold(0.0, f64::max);
            assert!(farthest < reached, "{farthest:e} of {reached:e} at {step}/16 of {motion:?}");
        }
    }

    #[test]
    fn no_corner_moves_farther() {
        let containers = [
            Container { min: [-1.0, 0.1, 2.0], max: [0.3, 0.7, 5.0] },
            Container { min: [0.0; 3], max: [1e-200, 3e-200, 0.0] },
            Container { min: [1e6, -1e9, 5.0], max: [1e6 + 1e-3, -1e9, 5e8] },
        ];
        let sheared = [[0.3, -0.7, 0.1, 5.0], [-0.2, 0.9, -0.4, 1e6], [0.0, 1e-9, -1.0, 0.1]];
        let nudged = sheared.map(|row| row.map(f64::next_up));
        let flattened = [[1e-300, -2.0, 0.0, 0.0], [0.0; 4], [-3.0, -3.0, -3.0, 1e-9]];
        let turns = |angle: f64| Motion::Rigid {
            from: sheared,
            axis: [0.3, -1.0, 0.2],
            centre: [4.0, -2.0, 1e3],
            angle,
            translate: [0.0, 1e-3, -0.5],
        };
        for container in &containers {
            for (from, to) in [(IDENTITY, sheared), (sheared, nudged), (nudged, flattened), (flattened, IDENTITY)] {
                check(container, &Motion::Linear { from, to });
            }
            for angle in [0.0, 1e-9, 0.3, 3.0, 7.0, -40.0] {
                check(container, &turns(angle));
            }
        }
    }

    #[test]
    fn a_path_beyond_the_numbers_begins_anew() {
        let path = Path::begin(1).advanced(1.0, 2).advanced(1e-300, 3);
        assert!(path.length() > 1.0 && path.within() == 1e-300 && path.leads_through());
        assert_eq!(path.advanced(0.0, 4).length(), path.length());
        for by in [f64::INFINITY, f64::NAN] {
            let anew = path.advanced(by, 4);
            assert!(anew.length() == 0.0 && !anew.leads_through() && anew.advanced(0.0, 5).leads_through());
        }
    }
}
