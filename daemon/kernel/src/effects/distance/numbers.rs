//! Numbers that the distance of two triangles is computed in: f64, and pairs of f64 where that is not enough.

use std::ops::{Add, Div, Mul, Neg, Sub};

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

/// The unevaluated sum of two f64, the second at most half an ulp of the first: some 104 bits (Dekker, "A Floating-Point
/// Technique for Extending the Available Precision", Numerische Mathematik 1971, section 5).
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(super) struct Double {
    high: f64,
    low: f64,
}

impl From<f64> for Double {
    fn from(high: f64) -> Double {
        Double { high, low: 0.0 }
    }
}

impl Number for Double {
    fn rounded(self) -> f64 {
        self.high + self.low
    }
}

impl Double {
    /// `high + low` where `high` is the larger one.
    fn quick_sum(high: f64, low: f64) -> Double {
        let sum = high + low;
        Double { high: sum, low: low - (sum - high) }
    }

    /// `a + b` without error (Knuth, The Art of Computer Programming 2, section 4.2.2, theorem B).
    fn sum(a: f64, b: f64) -> Double {
        let sum = a + b;
        let of_b = sum - a;
        Double { high: sum, low: (a - (sum - of_b)) + (b - of_b) }
    }

    /// `a · b` without error, where nothing underflows.
    fn product(a: f64, b: f64) -> Double {
        let product = a * b;
        Double { high: product, low: a.mul_add(b, -product) }
    }
}

impl Add for Double {
    type Output = Double;

    fn add(self, other: Double) -> Double {
        let (high, low) = (Double::sum(self.high, other.high), Double::sum(self.low, other.low));
        let carried = Double::quick_sum(high.high, high.low + low.high);
        Double::quick_sum(carried.high, carried.low + low.low)
    }
}

impl Neg for Double {
    type Output = Double;

    fn neg(self) -> Double {
        Double { high: -self.high, low: -self.low }
    }
}

impl Sub for Double {
    type Output = Double;

    fn sub(self, other: Double) -> Double {
        self + -other
    }
}

impl Mul for Double {
    type Output = Double;

    fn mul(self, other: Double) -> Double {
        let product = Double::product(self.high, other.high);
        Double::quick_sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Double {
    type Output = Double;

    fn div(self, other: Double) -> Double {
        let first = self.high / other.high;
        let rest = self - other * Double::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Double::from(second);
        Double::quick_sum(first, second) + Double::from(rest.high / other.high)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_f64_loses_is_kept() {
        let (one, tiny) = (Double::from(1.0), Double::from(2f64.powi(-90)));
        assert_eq!((one + tiny - one).rounded(), 2f64.powi(-90));
        let near = one + Double::from(2f64.powi(-40));
        assert_eq!((near * near - one - Double::from(2f64.powi(-39))).rounded(), 2f64.powi(-80));
        let third = one / Double::from(3.0);
        assert!((third * Double::from(3.0) - one).rounded().abs() < 2f64.powi(-100));
        assert!(-tiny < tiny && tiny < one && one < near);
    }
}
