//! f64 coordinates as integers on one common scale.

use num_bigint::BigInt;

/// A point with integer coordinates.
pub type IntegerPoint = [BigInt; 3];

/// The points times one power of two, common to all of them, that makes every coordinate an integer.
///
/// # Panics
/// When a coordinate is NaN or infinite.
pub fn on_common_scale<'a>(points: impl Iterator<Item = &'a [f64; 3]>) -> Vec<IntegerPoint> {
    let parts: Vec<[Parts; 3]> = points.map(|point| point.map(Parts::of)).collect();
    let nonzero = parts.iter().flatten().filter(|parts| parts.mantissa != 0);
    let scale = nonzero.map(|parts| parts.exponent).min().unwrap_or(0);
    parts.into_iter().map(|point| point.map(|parts| parts.scaled(scale))).collect()
}

/// `mantissa · 2^exponent`, the mantissa odd or zero.
struct Parts {
    mantissa: i64,
    exponent: i32,
}

impl Parts {
    fn of(value: f64) -> Parts {
        assert!(value.is_finite(), "the oracle takes finite coordinates only, not {value}");
        let bits = value.to_bits();
        let fraction = (bits & ((1 << 52) - 1)) as i64;
        let (magnitude, exponent) = match (bits >> 52 & 0x7ff) as i32 {
            0 => (fraction, -1074),
            biased => (fraction | 1 << 52, biased - 1075),
        };
        let mantissa = if value.is_sign_negative() { -magnitude } else { magnitude };
        let zeros = if mantissa == 0 { 0 } else { mantissa.trailing_zeros() };
        Parts { mantissa: mantissa >> zeros, exponent: exponent + zeros as i32 }
    }

    /// The value divided by `2^scale`; `scale` is at most the exponent, or the value is zero.
    fn scaled(self, scale: i32) -> BigInt {
        match self.mantissa {
            0 => BigInt::ZERO,
            mantissa => BigInt::from(mantissa) << (self.exponent - scale) as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scaled(point: [f64; 3]) -> [BigInt; 3] {
        on_common_scale([point].iter()).remove(0)
    }

    #[test]
    fn small_integers_stay_small() {
        assert_eq!(scaled([1.0, -6.0, 0.0]), [1, -6, 0].map(BigInt::from));
        assert_eq!(scaled([4.0, -8.0, -0.0]), [1, -2, 0].map(BigInt::from));
        assert_eq!(scaled([0.5, 0.75, -3.0]), [2, 3, -12].map(BigInt::from));
    }

    #[test]
    fn the_whole_range_of_f64_is_exact() {
        let smallest = f64::from_bits(1);
        let largest = BigInt::from((1i64 << 53) - 1) << (971 + 1074);
        assert_eq!(scaled([smallest, f64::MAX, -1.0]), [BigInt::from(1), largest, BigInt::from(-1) << 1074]);
        assert_eq!(scaled([f64::MIN_POSITIVE, smallest, 0.0])[0], BigInt::from(1i64 << 52));
    }

    #[test]
    #[should_panic(expected = "finite")]
    fn nan_is_refused() {
        scaled([0.0, f64::NAN, 0.0]);
    }
}
