//! Signs by integers of any length: exact for every finite f64, subnormal numbers and mixed scales included.

use glam::{DVec2, DVec3};
use num_bigint::{BigInt, Sign as BigSign};

use super::Sign;

/// The numbers, all multiplied by one power of two that makes them integers.
pub(crate) fn integers<const N: usize>(numbers: [f64; N]) -> [BigInt; N] {
    let parts = numbers.map(decode);
    let nonzero = parts.iter().filter(|(mantissa, _)| *mantissa != 0);
    let lowest = nonzero.map(|&(_, exponent)| exponent).min().unwrap_or(0);
    parts.map(|(mantissa, exponent)| match mantissa {
        0 => BigInt::ZERO,
        _ => BigInt::from(mantissa) << (exponent - lowest) as u32,
    })
}

/// A finite number as `mantissa · 2^exponent`.
fn decode(number: f64) -> (i64, i32) {
    let bits = number.to_bits();
    let (biased, fraction) = ((bits >> 52 & 0x7ff) as i32, (bits & ((1 << 52) - 1)) as i64);
    let (mantissa, exponent) = if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) };
    (if number.is_sign_negative() { -mantissa } else { mantissa }, exponent)
}

fn sign(number: &BigInt) -> Sign {
    match number.sign() {
        BigSign::Minus => -1,
        BigSign::NoSign => 0,
        BigSign::Plus => 1,
    }
}

pub(super) fn orient3d(o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
    let [ox, oy, oz, ax, ay, az, bx, by, bz, px, py, pz] =
        integers([o.x, o.y, o.z, a.x, a.y, a.z, b.x, b.y, b.z, p.x, p.y, p.z]);
    let (ux, uy, uz) = (ax - &ox, ay - &oy, az - &oz);
    let (vx, vy, vz) = (bx - &ox, by - &oy, bz - &oz);
    let normal = (&uy * &vz - &uz * &vy, &uz * &vx - &ux * &vz, &ux * &vy - &uy * &vx);
    sign(&(normal.0 * (px - ox) + normal.1 * (py - oy) + normal.2 * (pz - oz)))
}

pub(super) fn orient2d(o: DVec2, a: DVec2, p: DVec2) -> Sign {
    let [ox, oy, ax, ay, px, py] = integers([o.x, o.y, a.x, a.y, p.x, p.y]);
    sign(&((ax - &ox) * (&py - &oy) - (ay - oy) * (px - ox)))
}
