//! Motion within a step: where a body is at each time t from 0, the start of the step, to 1, its end.

use glam::DVec3;

use crate::affine::{Rows, magnitude, world_vertex};
use crate::container::Container;
use crate::global_boxes::GlobalBox;

/// How a body moves within a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Not at all.
    Still(Rows),
    /// Every vertex moves on a straight line, at constant speed, from its world position under `from` to that under
    /// `to`.
    Linear {
        /// The transform at t = 0.
        from: Rows,
        /// The transform at t = 1.
        to: Rows,
    },
    /// A screw: `p(t) = centre + t·translate + Rot(axis, angle·t)·(from·v − centre)`.
    Rigid {
        /// The transform at t = 0.
        from: Rows,
        /// Direction that the rotation is about, of any length but zero; world frame.
        axis: [f64; 3],
        /// A point on the axis at t = 0; world frame.
        centre: [f64; 3],
        /// Rotation over the step, in radians, counterclockwise seen against `axis`. May exceed π.
        angle: f64,
        /// Displacement of the centre over the step; world frame.
        translate: [f64; 3],
    },
}

/// Why a motion is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// NaN or infinity.
    #[error("the motion's {what} has the number {value}; every number must be finite")]
    NonFinite {
        /// `from`, `to`, `axis`, `centre`, `angle` or `translate`.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// An axis of length zero gives no direction.
    #[error("the motion's axis is zero; give a direction, of any other length")]
    ZeroAxis,
    /// The transform at the end has a number beyond f64.
    #[error("the motion ends at a transform with the number {value}; bring the centre and the translation nearer")]
    Overflow {
        /// The number.
        value: f64,
    },
}

impl Motion {
    /// Whether every number is finite, the axis is not zero, and the end can be written down.
    ///
    /// # Errors
    /// [`MotionError`] names the part.
    pub fn check(&self) -> Result<(), MotionError> {
        let matrix = |what, rows: &Rows| finite(what, rows.as_flattened());
        match self {
            Motion::Still(rows) => matrix("from", rows),
            Motion::Linear { from, to } => matrix("from", from).and_then(|()| matrix("to", to)),
            Motion::Rigid { from, axis, centre, angle, translate } => {
                matrix("from", from)?;
                finite("axis", axis)?;
                finite("centre", centre)?;
                finite("angle", &[*angle])?;
                finite("translate", translate)?;
                if *axis == [0.0; 3] {
                    return Err(MotionError::ZeroAxis);
                }
                match self.at(1.0).as_flattened().iter().find(|value| !value.is_finite()) {
                    Some(&value) => Err(MotionError::Overflow { value }),
                    None => Ok(()),
                }
            }
        }
    }

    /// The transform at `t`, 0 to 1. Rounded, with the same bits on every machine; exact at 0, and at 1 of a linear
    /// motion.
    pub fn at(&self, t: f64) -> Rows {
        match self {
            Motion::Still(rows) => *rows,
            Motion::Linear { from, to } => {
                [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| between(from[row][column], to[row][column], t)))
            }
            Motion::Rigid { from, axis, centre, angle, translate } => {
                if t == 0.0 {
                    return *from;
                }
                let turn = rotation(DVec3::from(*axis), angle * t);
                [0, 1, 2].map(|row| {
                    let product = |column: &dyn Fn(usize) -> f64| {
                        (turn[row][0] * column(0) + turn[row][1] * column(1)) + turn[row][2] * column(2)
                    };
                    let linear = |column: usize| product(&|i| from[i][column]);
                    let moved = product(&|i| from[i][3] - centre[i]) + (centre[row] + t * translate[row]);
                    [linear(0), linear(1), linear(2), moved]
                })
            }
        }
    }

    /// The transform at the end of the step.
    pub fn end(&self) -> Rows {
        self.at(1.0)
    }

    /// A world-axis box that holds every rounded vertex of the container's contents at every time of the step.
    ///
    /// On a straight line the extremes are at the ends, and their boxes are exact; only rounding in between can leave
    /// them, by no more than `position_bound`. A rotating point stays within its distance from
    /// the axis.
    pub fn swept_box(&self, container: &Container) -> GlobalBox {
        let ends = GlobalBox::of(container, &self.at(0.0)).joined(&GlobalBox::of(container, &self.end()));
        let pad = match self {
            Motion::Still(_) => return ends,
            Motion::Linear { .. } => 0.0,
            // Nowhere is a point farther from the chord of a whole turn, or of part of one, than the diameter of its
            // circle.
            Motion::Rigid { .. } => self.deviation(self.radius(container), 1.0),
        };
        let pad = DVec3::splat(pad) + self.position_bound(container.reach());
        GlobalBox { min: ends.min - pad, max: ends.max + pad }.or_everywhere()
    }

    /// Whether every vertex moves on a straight line.
    pub(crate) fn is_straight(&self) -> bool {
        !matches!(self, Motion::Rigid { .. })
    }

    /// Rotation over the step, in radians, without sign.
    pub(crate) fn turn(&self) -> f64 {
        match self {
            Motion::Rigid { angle, .. } => angle.abs(),
            _ => 0.0,
        }
    }

    /// A bound of the distance from the axis of rotation that the container's contents keep; 0 without rotation.
    pub(crate) fn radius(&self, container: &Container) -> f64 {
        let Motion::Rigid { from, axis, centre, .. } = self else { return 0.0 };
        let axis = direction(DVec3::from(*axis));
        let distance = |corner: usize| {
            let side = |axis: usize| [container.min, container.max][corner >> axis & 1][axis];
            let arm = world_vertex(from, [side(0), side(1), side(2)]) - DVec3::from(*centre);
            arm.cross(axis).length()
        };
        // The distance is a convex function: its largest value is at a corner. Rounding is relative to the arm.
        let rounding = (magnitude(from, container.reach()) + DVec3::from(*centre).abs()).length() * 1e-14;
        (0..8).map(distance).fold(0.0, f64::max) + rounding
    }

    /// How far a point within `radius` of the axis strays from the straight line between two of its positions,
    /// `duration` of the step apart: `r(1 − cos(θ/2)) ≤ r·θ²/8` for the angle θ in between, and never more than the
    /// diameter of its circle.
    pub(crate) fn deviation(&self, radius: f64, duration: f64) -> f64 {
        let angle = self.turn() * duration;
        radius * (angle * angle * (0.125 * (1.0 + 1e-12))).min(2.0)
    }

    /// A bound, per world axis, of the magnitude of every partial result on the way to a position, for vertices with
    /// `|x|, |y|, |z|` at most `reach`.
    pub(crate) fn magnitude(&self, reach: [f64; 3]) -> DVec3 {
        match self {
            Motion::Still(rows) => magnitude(rows, reach),
            Motion::Linear { from, to } => magnitude(from, reach).max(magnitude(to, reach)),
            Motion::Rigid { from, centre, translate, .. } => {
                let centre = DVec3::from(*centre).abs();
                let arm = magnitude(from, reach) + centre;
                // Entries of a rotation are at most 1.
                DVec3::splat(arm.element_sum()) + centre + DVec3::from(*translate).abs()
            }
        }
    }

    /// A bound, per world axis, of the distance between the vertices as [`at`](Self::at) and
    /// [`world_vertex`] place them and the exact motion.
    ///
    /// Linear: each entry of the interpolated matrix suffers three roundings, each at most 2^-53 of twice the larger
    /// end; with those of `world_vertex` fewer than 16 roundings of the magnitude. Rigid: sine and cosine (below 1
    /// ulp), the normalised axis and the products of the rotation suffer fewer than 24, the product with `from` 4 more,
    /// `world_vertex` 5; and the angle's own rounding turns a point by 2^-53 of the angle.
    pub(crate) fn position_bound(&self, reach: [f64; 3]) -> DVec3 {
        const UNIT: f64 = f64::EPSILON / 2.0;
        /// 2^-1060.
        const UNDERFLOW: DVec3 = DVec3::splat(f64::from_bits(1 << 14));
        let roundings = match self {
            Motion::Still(_) => 8.0,
            Motion::Linear { .. } => 16.0,
            Motion::Rigid { .. } => 48.0 + 2.0 * self.turn(),
        };
        self.magnitude(reach) * (roundings * UNIT) + UNDERFLOW
    }
}

impl GlobalBox {
    /// The box, or one that holds every finite position where a side is unknown.
    fn or_everywhere(self) -> GlobalBox {
        let known = !self.min.is_nan() && !self.max.is_nan();
        if known { self } else { GlobalBox { min: DVec3::MIN, max: DVec3::MAX } }
    }
}

fn finite(what: &'static str, numbers: &[f64]) -> Result<(), MotionError> {
    match numbers.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(MotionError::NonFinite { what, value }),
        None => Ok(()),
    }
}

/// The number at `t` between two. What does not change keeps its bits, and the ends are exact.
pub(crate) fn between(from: f64, to: f64, t: f64) -> f64 {
    if t == 1.0 {
        return to;
    }
    let difference = to - from;
    if difference.is_finite() { from + t * difference } else { (1.0 - t) * from + t * to }
}

/// The vector with length 1. Scaled first, so that nothing overflows or vanishes.
fn direction(axis: DVec3) -> DVec3 {
    let scaled = axis / axis.abs().max_element();
    scaled / scaled.length()
}

/// Rodrigues' formula. The vertical part is `1 − cos` without cancellation.
fn rotation(axis: DVec3, angle: f64) -> [[f64; 3]; 3] {
    let axis = direction(axis);
    let (sin, cos, half) = (libm::sin(angle), libm::cos(angle), libm::sin(0.5 * angle));
    let versine = 2.0 * half * half;
    let cross = [[0.0, -axis.z, axis.y], [axis.z, 0.0, -axis.x], [-axis.y, axis.x, 0.0]];
    [0, 1, 2].map(|row| {
        [0, 1, 2].map(|column| {
            let unit = if row == column { cos } else { 0.0 };
            unit + versine * axis[row] * axis[column] + sin * cross[row][column]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affine::IDENTITY;

    const SCREW: Motion = Motion::Rigid {
        from: IDENTITY,
        axis: [0.0, 0.0, 3.0],
        centre: [1.0, 0.0, 0.0],
        angle: std::f64::consts::FRAC_PI_2,
        translate: [0.0, 0.0, 4.0],
    };

    #[test]
    fn a_screw_turns_counterclockwise_about_its_moving_centre() {
        let place = |t: f64| world_vertex(&SCREW.at(t), [2.0, 0.0, 0.0]);
        assert_eq!(place(0.0), DVec3::new(2.0, 0.0, 0.0));
        assert!((place(1.0) - DVec3::new(1.0, 1.0, 4.0)).length() < 1e-15);
        let root = std::f64::consts::FRAC_1_SQRT_2;
        assert!((place(0.5) - DVec3::new(1.0 + root, root, 2.0)).length() < 1e-15);
    }

    #[test]
    fn linear_motion_is_exact_at_its_ends_and_where_nothing_changes() {
        let mut to = IDENTITY;
        (to[0][3], to[1][1]) = (0.1, 1e300);
        let motion = Motion::Linear { from: IDENTITY, to };
        assert_eq!((motion.at(0.0), motion.end()), (IDENTITY, to));
        for t in [0.1, 1.0 / 3.0, 0.7] {
            assert_eq!(motion.at(t)[2], IDENTITY[2]);
        }
    }

    #[test]
    fn swept_boxes_hold_every_position_on_the_way() {
        let container = Container { min: [-1.0, 0.0, 0.25], max: [3.0, 0.5, 1.0] };
        let turns = |angle| Motion::Rigid {
            from: IDENTITY,
            axis: [1.0, 2.0, -1.0],
            centre: [0.5, 9.0, 0.0],
            angle,
            translate: [0.0, 1.0, 0.0],
        };
        let mut mirrored = IDENTITY;
        (mirrored[0][0], mirrored[1][3]) = (-7.0, 0.1);
        let linear = Motion::Linear { from: IDENTITY, to: mirrored };
        for motion in [SCREW, linear, turns(0.3), turns(-4.0), turns(30.0)] {
            let swept = motion.swept_box(&container);
            for step in 0..=100 {
                let now = GlobalBox::of(&container, &motion.at(f64::from(step) / 100.0));
                assert!(now.min.cmpge(swept.min).all() && now.max.cmple(swept.max).all(), "{motion:?} at {step}");
            }
        }
    }

    #[test]
    fn bad_motions_are_refused_by_name() {
        let bad = |axis, angle, translate: f64| {
            let translate = [0.0, translate, 0.0];
            Motion::Rigid { from: IDENTITY, axis, centre: [0.0; 3], angle, translate }.check()
        };
        assert_eq!(bad([0.0, 0.0, -0.0], 1.0, 0.0), Err(MotionError::ZeroAxis));
        let infinite = MotionError::NonFinite { what: "angle", value: f64::INFINITY };
        assert_eq!(bad([1.0, 0.0, 0.0], f64::INFINITY, 0.0), Err(infinite));
        assert!(bad([1.0, 0.0, 0.0], 1.0, f64::NAN).is_err());
        assert_eq!(bad([1e-320, 0.0, 0.0], 1e3, 1.0), Ok(()));
        assert!(Motion::Still([[f64::NAN; 4]; 3]).check().is_err());
        assert_eq!(SCREW.check(), Ok(()));
    }
}
