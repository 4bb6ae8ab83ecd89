//! A number for each separating axis, in f32: four registers of four.

use glam::Vec4;

/// Axes that are looked at together: a power of two that holds the fifteen.
pub(crate) const LANES: usize = 16;

/// A number for each axis.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Lanes(pub(super) [Vec4; LANES / 4]);

impl Lanes {
    /// Rounded to the nearest f32.
    #[inline(always)]
    pub fn rounded(values: &[f64; LANES]) -> Lanes {
        let rounded = values.map(|value| value as f32);
        Lanes([0, 4, 8, 12].map(|i| Vec4::new(rounded[i], rounded[i + 1], rounded[i + 2], rounded[i + 3])))
    }

    #[inline(always)]
    pub fn plus(&self, other: &Lanes) -> Lanes {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        Lanes([a + e, b + f, c + g, d + h])
    }

    #[inline(always)]
    pub fn minus(&self, other: &Lanes) -> Lanes {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        Lanes([a - e, b - f, c - g, d - h])
    }

    #[inline(always)]
    pub fn times(&self, factor: f32) -> Lanes {
        let [a, b, c, d] = self.0;
        Lanes([a * factor, b * factor, c * factor, d * factor])
    }

    #[inline(always)]
    pub fn abs(&self) -> Lanes {
        let [a, b, c, d] = self.0;
        Lanes([a.abs(), b.abs(), c.abs(), d.abs()])
    }

    /// Whether one of them is greater in magnitude. False for NaN.
    #[inline(always)]
    pub fn any_beyond(&self, reach: &Lanes) -> bool {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, reach.0);
        ((a.abs().cmpgt(e) | b.abs().cmpgt(f)) | (c.abs().cmpgt(g) | d.abs().cmpgt(h))).any()
    }

    /// Whether one of them is greater in magnitude at both ends of a span, and of one sign. False for NaN.
    #[inline(always)]
    pub fn are_beyond_at_both([first, last]: &[Lanes; 2], [reach, last_reach]: &[Lanes; 2]) -> bool {
        let beyond = |i: usize| {
            let (x, y, r, s) = (first.0[i], last.0[i], reach.0[i], last_reach.0[i]);
            x.cmpgt(r) & y.cmpgt(s) | (-x).cmpgt(r) & (-y).cmpgt(s)
        };
        ((beyond(0) | beyond(1)) | (beyond(2) | beyond(3))).any()
    }
}
