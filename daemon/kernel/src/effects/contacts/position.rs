//! Where an edge meets a plane or another edge: the exact point, rounded once.
//!
//! An edge from p to q meets a plane, or a line that it shares a plane with, at `(s_p·q − s_q·p) / (s_p − s_q)`, where s is the
//! determinant whose sign says on which side a point lies. Every coordinate comes out as the f64 nearest to the exact one, ties
//! to even. So the error is at most half an ulp, and one point that is found from several pairs of polygons has the same
//! bits each time.
//!
//! Numbers made of two f64 decide the rounding nearly always; integers of any length decide what is left.

use glam::DVec3;
use num_bigint::BigInt;

use crate::double::Double;
use crate::predicates::any_range::integers;
use crate::predicates::is_tame;

/// What an edge is met by.
#[derive(Debug, Clone, Copy)]
pub(super) enum Met {
    /// The plane through three points.
    Plane([DVec3; 3]),
    /// The line through two points, in the plane of the edge, both seen without the coordinate of that number.
    Line([DVec3; 2], usize),
}

/// The point in which the edge from `p` to `q` passes through what it is met by, its ends being strictly on opposite sides.
pub(super) fn crossing(p: DVec3, q: DVec3, met: &Met) -> DVec3 {
    let quick = quick(p, q, met);
    if let [Some(x), Some(y), Some(z)] = quick {
        return DVec3::new(x, y, z);
    }
    let exact = exact(p, q, met);
    DVec3::from([0, 1, 2].map(|axis| quick[axis].unwrap_or_else(|| exact(axis))))
}

/// 2^-106: the square of half the distance from 1 to the next f64.
const UNIT: f64 = (f64::EPSILON / 2.0) * (f64::EPSILON / 2.0);
/// 2^-250. See [`quick`].
const SMALLEST: f64 = f64::from_bits((1023 - 250) << 52);
/// 2^-700: more than what a quotient below 2^-1022 can lose, times a tame difference.
const UNDERFLOW: f64 = f64::from_bits((1023 - 700) << 52);

/// The coordinates whose rounding two f64 decide.
///
/// Coordinates that are 0 or not below 2^-250 are multiples of 2^-302, so nothing but the quotient can underflow.
fn quick(p: DVec3, q: DVec3, met: &Met) -> [Option<f64>; 3] {
    let points = met.points();
    let far_from_underflow = |point: &DVec3| point.to_array().iter().all(|x| *x == 0.0 || x.abs() >= SMALLEST);
    let all = || points.iter().chain([&p, &q]);
    if !is_tame(all()) || !all().all(far_from_underflow) {
        return [None; 3];
    }
    let ((s_p, error_p), (s_q, error_q)) = sides(p, q, met);
    let difference = s_p - s_q;
    // NaN cannot be: all is tame.
    if difference.high.abs() <= 4.0 * (error_p + error_q) {
        return [None; 3];
    }
    let at = s_p / difference;
    let error_at = 2.0 * (2.0 * error_p + error_q) / difference.high.abs() + 32.0 * UNIT;
    [0, 1, 2].map(|axis| {
        let along = Double::difference(q[axis], p[axis]);
        if along.high == 0.0 {
            return Some(p[axis]);
        }
        let found = Double::from(p[axis]) + at * along;
        let size = p[axis].abs() + along.high.abs();
        let error = 2.0 * (along.high.abs() * error_at + 16.0 * UNIT * size) + UNDERFLOW;
        // Rounding is monotone: where both ends of the interval round to one f64, so does what lies between.
        let is_certain =
            found.high + (found.low + error) == found.high && found.high + (found.low - error) == found.high;
        is_certain.then_some(found.high)
    })
}

impl Met {
    fn points(&self) -> &[DVec3] {
        match self {
            Met::Plane(points) => points,
            Met::Line(points, _) => points,
        }
    }
}

/// The determinants of both ends, each with a bound of its error.
///
/// A product errs by less than 7 units of 2^-106, a sum by less than 3 (Joldes et al., Table 1): in all by less than 32 of the
/// sum of magnitudes. The factor 64 also covers the rounding of that sum.
fn sides(p: DVec3, q: DVec3, met: &Met) -> ((Double, f64), (Double, f64)) {
    match *met {
        Met::Plane([o, a, b]) => {
            let (u, v) = (differences(a, o), differences(b, o));
            let minors = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| (u[i] * v[j], u[j] * v[i]));
            let side = |point: DVec3| {
                let w = differences(point, o);
                let term = |axis: usize| (minors[axis].0 - minors[axis].1) * w[axis];
                let size = |axis: usize| (minors[axis].0.high.abs() + minors[axis].1.high.abs()) * w[axis].high.abs();
                (term(0) + term(1) + term(2), 64.0 * UNIT * (size(0) + size(1) + size(2)))
            };
            (side(p), side(q))
        }
        Met::Line([r, s], dropped) => {
            let (i, j) = kept_axes(dropped);
            let along = differences(s, r);
            let side = |point: DVec3| {
                let w = differences(point, r);
                let (left, right) = (along[i] * w[j], along[j] * w[i]);
                (left - right, 64.0 * UNIT * (left.high.abs() + right.high.abs()))
            };
            (side(p), side(q))
        }
    }
}

/// The coordinates that are left when one is dropped.
pub(super) fn kept_axes(dropped: usize) -> (usize, usize) {
    ((dropped + 1) % 3, (dropped + 2) % 3)
}

fn differences(to: DVec3, from: DVec3) -> [Double; 3] {
    [0, 1, 2].map(|axis| Double::difference(to[axis], from[axis]))
}

/// The coordinates by integers of any length, for any finite positions.
fn exact(p: DVec3, q: DVec3, met: &Met) -> impl Fn(usize) -> f64 {
    let points = met.points();
    let at = |i: usize| points[i.min(points.len() - 1)];
    let all = [at(0), at(1), at(2), p, q].map(|point| point.to_array());
    // The 1 becomes what all numbers have been multiplied by.
    let [a0, a1, a2, b0, b1, b2, c0, c1, c2, p0, p1, p2, q0, q1, q2, one] = integers([
        all[0][0], all[0][1], all[0][2], all[1][0], all[1][1], all[1][2], all[2][0], all[2][1], all[2][2], all[3][0],
        all[3][1], all[3][2], all[4][0], all[4][1], all[4][2], 1.0,
    ]);
    let (first, second, third) = ([a0, a1, a2], [b0, b1, b2], [c0, c1, c2]);
    let (p, q) = ([p0, p1, p2], [q0, q1, q2]);
    let minus = |to: &[BigInt; 3], from: &[BigInt; 3]| [0, 1, 2].map(|axis| &to[axis] - &from[axis]);
    let minor = |u: &[BigInt; 3], v: &[BigInt; 3], axis: usize| {
        let (i, j) = kept_axes(axis);
        &u[i] * &v[j] - &u[j] * &v[i]
    };
    let u = minus(&second, &first);
    let side = |point: &[BigInt; 3]| {
        let w = minus(point, &first);
        match *met {
            Met::Plane(_) => {
                let v = minus(&third, &first);
                (0..3).map(|axis| minor(&u, &v, axis) * &w[axis]).sum::<BigInt>()
            }
            Met::Line(_, dropped) => minor(&u, &w, dropped),
        }
    };
    let (s_p, s_q) = (side(&p), side(&q));
    let denominator = (&s_p - &s_q) * one;
    move |axis| nearest(&(&s_p * &q[axis] - &s_q * &p[axis]), &denominator)
}

/// The f64 nearest to a quotient, ties to even. The quotient is in the range of f64, the denominator not 0.
fn nearest(numerator: &BigInt, denominator: &BigInt) -> f64 {
    let (n, d) = (numerator.magnitude(), denominator.magnitude());
    // 55 or 56 bits of the quotient, or down to a quarter of the smallest f64.
    let shift = (55 + d.bits() as i64 - n.bits() as i64).min(1076);
    let (n, d) = if shift >= 0 { (n << shift as u64, d.clone()) } else { (n.clone(), d << (-shift) as u64) };
    let quotient = &n / &d;
    let is_exact = &quotient * &d == n;
    // The last bit tells what has been cut off.
    let bits = quotient.to_u64_digits().first().copied().unwrap_or(0) | u64::from(!is_exact);
    let length = i64::from(64 - bits.leading_zeros());
    let dropped = (length - 53).max(if shift == 1076 { 2 } else { 1 });
    let (kept, rest, half) = (bits >> dropped, bits & ((1 << dropped) - 1), 1 << (dropped - 1));
    let rounded = kept + u64::from(rest > half || (rest == half && kept & 1 == 1));
    let magnitude = by_power_of_two(rounded as f64, dropped - shift);
    if (numerator.sign() == denominator.sign()) || rounded == 0 { magnitude } else { -magnitude }
}

/// `number · 2^exponent`, exact where the result is an f64.
fn by_power_of_two(number: f64, exponent: i64) -> f64 {
    let power = |exponent: i64| f64::from_bits(((1023 + exponent) as u64) << 52);
    // Neither half of the exponent leaves the range of f64.
    number * power(exponent / 2) * power(exponent - exponent / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(numerator: i128, denominator: i128) -> f64 {
        nearest(&BigInt::from(numerator), &BigInt::from(denominator))
    }

    #[test]
    fn quotients_are_rounded_to_nearest_even() {
        for (n, d) in [(1, 3), (-2, 3), (10, 10), (7, -5), (0, 3), (1 << 53, 1 << 10)] {
            assert_eq!(ratio(n, d), n as f64 / d as f64, "{n}/{d}");
        }
        assert_eq!(ratio((1 << 53) + 1, 1), 2f64.powi(53));
        assert_eq!(ratio((1 << 53) + 3, 1), 2f64.powi(53) + 4.0);
        assert_eq!(ratio(((1 << 53) + 1) * 1000 + 1, 1000), 2f64.powi(53) + 2.0);
    }

    #[test]
    fn the_ends_of_f64_are_rounded_once() {
        let power = |exponent: u32| BigInt::from(1) << exponent;
        assert_eq!(nearest(&BigInt::from(1), &power(1074)), f64::from_bits(1));
        assert_eq!(nearest(&BigInt::from(1), &power(1075)), 0.0);
        assert_eq!(nearest(&BigInt::from(3), &power(1076)), f64::from_bits(1));
        assert_eq!(nearest(&BigInt::from(-3), &power(1075)), -f64::from_bits(2));
        // Just below a tie between two subnormal numbers: rounding to 53 bits first would make it a tie.
        let tie = (BigInt::from((1u64 << 52) + 1) << 10) + (1 << 9) - 1;
        assert_eq!(nearest(&tie, &power(1074 + 10)), f64::from_bits((1 << 52) + 1));
        assert_eq!(nearest(&(power(1024) - power(971)), &power(0)), f64::MAX);
    }

    #[test]
    fn both_ways_give_the_same_bits() {
        let point = |seed: u64| {
            DVec3::from([1, 2, 3].map(|axis| {
                // SplitMix64: a multiple alone would put all points in a line.
                let mixed = (3 * seed + axis).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                ((mixed ^ mixed >> 27) >> 11) as f64 / 2f64.powi(53) - 0.5
            }))
        };
        let mut decided = 0;
        for seed in 0..300 {
            let [o, a, b, p] = [0, 1, 2, 3].map(|i| point(7 * seed + i));
            let q = o + (a - o) * 0.3 + (b - o) * 0.2 + (o - p) * 0.7;
            let met = Met::Plane([o, a, b]);
            let exact = exact(p, q, &met);
            for (axis, found) in quick(p, q, &met).into_iter().enumerate() {
                decided += usize::from(found.is_some());
                assert!(found.is_none_or(|found| found == exact(axis)), "{seed} {axis}");
            }
        }
        assert!(decided > 880, "{decided} of 900 decided by two f64");
    }

    #[test]
    fn tiny_and_huge_positions_are_served() {
        for scale in [f64::from_bits(4), 1e-310, 1e-200, 1e200, 1e307] {
            let met = Met::Plane([DVec3::ZERO, DVec3::X * scale, DVec3::Y * scale]);
            let (p, q) = (DVec3::new(0.25, 0.5, -1.0) * scale, DVec3::new(0.25, 0.5, 1.0) * scale);
            assert_eq!(crossing(p, q, &met), (p + q) / 2.0);
            let line = Met::Line([DVec3::ZERO, DVec3::X * scale], 2);
            let (p, q) = (DVec3::new(0.25, -1.0, 0.0) * scale, DVec3::new(0.75, 1.0, 0.0) * scale);
            assert_eq!(crossing(p, q, &line), p / 2.0 + q / 2.0);
        }
    }
}
