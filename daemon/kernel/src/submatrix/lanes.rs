//! A number for each separating axis, in f32.
//!
//! Plain arrays: the compiler makes of the loops the widest registers that it may use, and code that is
//! [dispatched](crate::instructions) may use those that the processor has. What each lane comes to is the same to the bit.

use glam::Vec4;

/// Axes that are looked at together: a power of two that holds the fifteen.
pub(crate) const LANES: usize = 16;

/// A number for each axis.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(crate) struct Lanes([f32; LANES]);

impl Lanes {
    /// Rounded to the nearest f32.
    #[inline(always)]
    pub fn rounded(values: &[f64; LANES]) -> Lanes {
        let mut lanes = Lanes::default();
        for lane in 0..LANES {
            lanes.0[lane] = values[lane] as f32;
        }
        lanes
    }

    #[inline(always)]
    pub fn plus(mut self, other: &Lanes) -> Lanes {
        for lane in 0..LANES {
            self.0[lane] += other.0[lane];
        }
        self
    }

    #[inline(always)]
    pub fn minus(mut self, other: &Lanes) -> Lanes {
        for lane in 0..LANES {
            self.0[lane] -= other.0[lane];
        }
        self
    }

    #[inline(always)]
    pub fn times(mut self, factor: f32) -> Lanes {
        for lane in 0..LANES {
            self.0[lane] *= factor;
        }
        self
    }

    #[inline(always)]
    pub fn abs(mut self) -> Lanes {
        for lane in 0..LANES {
            self.0[lane] = self.0[lane].abs();
        }
        self
    }

    /// Whether one of them is greater in magnitude. False for NaN.
    #[inline(always)]
    pub fn any_beyond(&self, reach: &Lanes) -> bool {
        let mut beyond = 0;
        for lane in 0..LANES {
            beyond |= u32::from(self.0[lane].abs() > reach.0[lane]);
        }
        beyond != 0
    }

    /// Whether one of them is greater in magnitude at both ends of a span, and of one sign. False for NaN.
    #[inline(always)]
    pub fn are_beyond_at_both([first, last]: &[Lanes; 2], [reach, last_reach]: &[Lanes; 2]) -> bool {
        let mut beyond = 0;
        for lane in 0..LANES {
            let (x, y, r, s) = (first.0[lane], last.0[lane], reach.0[lane], last_reach.0[lane]);
            beyond |= u32::from(x > r) & u32::from(y > s) | u32::from(-x > r) & u32::from(-y > s);
        }
        beyond != 0
    }

    /// Four of them, of [`LANES`] / 4 such registers.
    #[inline(always)]
    pub fn register(&self, number: usize) -> Vec4 {
        Vec4::from_slice(&self.0[4 * number..])
    }
}
