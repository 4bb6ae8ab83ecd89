//! Numbers that the distance of two triangles is computed in: f64, and pairs of f64 where that is not enough.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::double::Double;

/// What the distance of two triangles needs of a number.
pub(super) trait Number:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + From<f64>
{
    /// Rounded to f64.
    fn rounded(self) -> f64;
}

impl Number for f64 {
    fn rounded(self) -> f64 {
        self
    }
}

impl Number for Double {
    fn rounded(self) -> f64 {
        self.high + self.low
    }
}

/// A vector of such numbers.
pub(super) type Vector<N> = [N; 3];

#[inline(always)]
pub(super) fn sub<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn dot<N: Number>(a: &Vector<N>, b: &Vector<N>) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + b·factor`.
#[inline(always)]
pub(super) fn along<N: Number>(a: &Vector<N>, b: &Vector<N>, factor: N) -> Vector<N> {
    [a[0] + b[0] * factor, a[1] + b[1] * factor, a[2] + b[2] * factor]
}
