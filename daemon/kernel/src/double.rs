//! Numbers made of two f64 (Joldes, Muller, Popescu, "Tight and Rigorous Error Bounds for Basic Building Blocks of Double-Word
//! Arithmetic", TOMS 2017), for where f64 is not enough and integers of any length are too slow.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// The unevaluated sum of two f64, the first of them the sum rounded: some 104 bits.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(crate) struct Double {
    pub high: f64,
    pub low: f64,
}

impl Double {
    /// Exact (Knuth).
    pub fn sum(a: f64, b: f64) -> Double {
        let high = a + b;
        let part = high - a;
        Double { high, low: (a - (high - part)) + (b - part) }
    }

    /// Exact where `a` is not smaller than `b` in magnitude, or both are 0 (Dekker).
    fn ordered_sum(a: f64, b: f64) -> Double {
        let high = a + b;
        Double { high, low: b - (high - a) }
    }

    pub fn difference(a: f64, b: f64) -> Double {
        Double::sum(a, -b)
    }

    /// Exact: the fused operation gives the very rounding error, on every machine.
    pub fn product(a: f64, b: f64) -> Double {
        let high = a * b;
        Double { high, low: a.mul_add(b, -high) }
    }
}

impl From<f64> for Double {
    fn from(high: f64) -> Double {
        Double { high, low: 0.0 }
    }
}

impl Neg for Double {
    type Output = Double;

    fn neg(self) -> Double {
        Double { high: -self.high, low: -self.low }
    }
}

impl Add for Double {
    type Output = Double;

    /// Algorithm 6 of Joldes et al.
    fn add(self, other: Double) -> Double {
        let (high, low) = (Double::sum(self.high, other.high), Double::sum(self.low, other.low));
        let inner = Double::ordered_sum(high.high, high.low + low.high);
        Double::ordered_sum(inner.high, low.low + inner.low)
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

    /// Algorithm 11 of Joldes et al.
    fn mul(self, other: Double) -> Double {
        let high = Double::product(self.high, other.high);
        let cross = self.high.mul_add(other.low, self.low * other.high);
        Double::ordered_sum(high.high, high.low + cross)
    }
}

impl Div for Double {
    type Output = Double;

    /// Algorithm 17 of Joldes et al.
    fn div(self, other: Double) -> Double {
        let first = self.high / other.high;
        let rest = self - other * Double::from(first);
        Double::ordered_sum(first, rest.high / other.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_f64_loses_is_kept() {
        let (one, tiny) = (Double::from(1.0), Double::from(2f64.powi(-90)));
        assert_eq!((one + tiny - one).high, 2f64.powi(-90));
        let near = one + Double::from(2f64.powi(-40));
        assert_eq!((near * near - one - Double::from(2f64.powi(-39))).high, 2f64.powi(-80));
        let third = one / Double::from(3.0);
        assert!((third * Double::from(3.0) - one).high.abs() < 2f64.powi(-100));
        assert!(-tiny < tiny && tiny < one && one < near);
    }
}
