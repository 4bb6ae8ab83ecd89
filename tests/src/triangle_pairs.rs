//! Pairs of triangles that exact tests get wrong: strategies for property tests and for long runs alike.
//!
//! A pair is a base, where special positions are frequent, and a deformation, which keeps them, nearly keeps them or carries
//! them to another scale. What shrinks, shrinks towards a small integer grid without a deformation.

use proptest::array::{uniform3, uniform4, uniform6};
use proptest::prelude::*;
use proptest::sample::select;

use crate::oracle::Triangle;

/// Two triangles of any finite coordinates, degenerate ones among them.
pub type Pair = (Triangle, Triangle);

type Point = [f64; 3];

/// Every kind of pair.
pub fn any_pair() -> impl Strategy<Value = Pair> {
    let base = prop_oneof![
        3 => grid_pair(-3, 3),
        2 => grid_pair(0, 2),
        2 => plane_pair(),
        2 => pool_pair(),
        3 => feature_pair(),
        2 => needle_pair(),
    ];
    let deformed =
        (base, deformation()).prop_filter_map("a coordinate overflowed", |(pair, deformation)| deformation.apply(pair));
    prop_oneof![12 => deformed, 1 => any_finite_pair()]
}

/// Corners on a small integer grid.
pub fn grid_pair(min: i32, max: i32) -> impl Strategy<Value = Pair> {
    uniform6(grid_point(min, max)).prop_map(pair_of)
}

fn grid_point(min: i32, max: i32) -> impl Strategy<Value = Point> {
    uniform3((min..=max).prop_map(f64::from))
}

fn pair_of([a, b, c, d, e, f]: [Point; 6]) -> Pair {
    ([a, b, c], [d, e, f])
}

/// All corners in one plane, which an integer map tilts.
fn plane_pair() -> impl Strategy<Value = Pair> {
    let in_plane = uniform6((0..=5, 0..=5));
    let directions = uniform3((-2..=2, -2..=2));
    (in_plane, directions).prop_map(|(points, directions)| {
        let tilted = |(u, v)| directions.map(|(along_u, along_v)| f64::from(u * along_u + v * along_v));
        pair_of(points.map(tilted))
    })
}

/// Corners out of four points, so that corners and edges are shared and triangles collapse.
fn pool_pair() -> impl Strategy<Value = Pair> {
    (uniform4(grid_point(-2, 2)), uniform6(0..4usize)).prop_map(|(pool, picks)| pair_of(picks.map(|pick| pool[pick])))
}

/// A corner or an edge of the second triangle passes through a point that is, rounded, on the first one: in its face, on an
/// edge, at a corner.
fn feature_pair() -> impl Strategy<Value = Pair> {
    let weight = prop_oneof![2 => Just(0.0), 1 => Just(0.5), 1 => Just(1.0), 4 => 0.0..1.0];
    let direction = || uniform3(-1.0..1.0);
    (real_triangle(), weight.clone(), weight, any::<bool>(), direction(), direction()).prop_map(
        |(a, u, v, through, d, e)| {
            let on_a = mix(mix(a[0], a[1], u), a[2], v);
            let first = if through { [0, 1, 2].map(|i| on_a[i] - d[i]) } else { on_a };
            let shifted = |by: Point| [0, 1, 2].map(|i| on_a[i] + by[i]);
            (a, [first, shifted(d), shifted(e)])
        },
    )
}

fn real_triangle() -> impl Strategy<Value = Triangle> {
    prop_oneof![uniform3(grid_point(-3, 3)), uniform3(uniform3(-1.0..1.0))]
}

fn mix(p: Point, q: Point, weight: f64) -> Point {
    [0, 1, 2].map(|i| p[i] + weight * (q[i] - p[i]))
}

/// Triangles whose corners are, rounded, on one line, and lines that nearly meet.
fn needle_pair() -> impl Strategy<Value = Pair> {
    let needle = || (uniform3(-1.0..1.0), uniform3(-1.0..1.0), -0.5..1.5, select(vec![0.0, 1e-16, 1e-12, 1e-6]));
    (needle(), needle(), any::<bool>(), 0.0..1.0).prop_map(|((p, q, s, width), (r, t, u, width_b), meet, at)| {
        let thin = |p, q, s, width| {
            let [x, y, z] = mix(p, q, s);
            [p, q, [x, y + width, z]]
        };
        let r = if meet { mix(t, mix(p, q, at), 1.5) } else { r };
        (thin(p, q, s, width), thin(r, t, u, width_b))
    })
}

/// Any bits that are not NaN or infinity.
fn any_finite_pair() -> impl Strategy<Value = Pair> {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    uniform6(uniform3(POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO)).prop_map(pair_of)
}

/// What happens to a base pair.
#[derive(Debug, Clone, Copy)]
enum Deformation {
    Nothing,
    /// One affine map for both triangles, rounded.
    Affine([[f64; 4]; 3]),
    /// Axis by axis, a power of two.
    Scales([i32; 3]),
    /// Coordinate by coordinate, so many neighbours up or down.
    Nudges([[i8; 3]; 6]),
    /// One nudge after a power of two of all.
    ScaledNudge {
        exponent: i32,
        corner: usize,
        axis: usize,
        steps: i8,
    },
}

fn deformation() -> impl Strategy<Value = Deformation> {
    let exponent = || prop_oneof![-1070..1020i32, -1074..-1000i32, 1000..1022i32, -60..60i32];
    let one_scale = exponent().prop_map(|e| Deformation::Scales([e; 3]));
    let nudge = prop_oneof![4 => Just(0i8), 1 => -2..=2i8];
    let nudged = (exponent(), 0..6usize, 0..3usize, -2..=2i8)
        .prop_map(|(exponent, corner, axis, steps)| Deformation::ScaledNudge { exponent, corner, axis, steps });
    prop_oneof![
        3 => Just(Deformation::Nothing),
        2 => uniform3(uniform4(-2.0..2.0)).prop_map(Deformation::Affine),
        1 => one_scale,
        1 => uniform3(exponent()).prop_map(Deformation::Scales),
        2 => uniform6(uniform3(nudge)).prop_map(Deformation::Nudges),
        1 => nudged,
    ]
}

impl Deformation {
    /// The deformed pair; `None` when a coordinate is no longer finite.
    fn apply(self, (a, b): Pair) -> Option<Pair> {
        let corner = |i: usize, point: Point| match self {
            Deformation::Nothing => point,
            Deformation::Affine(rows) => rows.map(|[m, n, o, t]| m * point[0] + n * point[1] + o * point[2] + t),
            Deformation::Scales(exponents) => [0, 1, 2].map(|axis| scaled(point[axis], exponents[axis])),
            Deformation::Nudges(nudges) => [0, 1, 2].map(|axis| nudged(point[axis], nudges[i][axis])),
            Deformation::ScaledNudge { exponent, corner, axis, steps } => {
                let mut point = point.map(|x| scaled(x, exponent));
                if i == corner {
                    point[axis] = nudged(point[axis], steps);
                }
                point
            }
        };
        let deformed = |t: Triangle, first| [0, 1, 2].map(|i| corner(first + i, t[i]));
        let pair = (deformed(a, 0), deformed(b, 3));
        let finite = |t: &Triangle| t.iter().flatten().all(|x| x.is_finite());
        (finite(&pair.0) && finite(&pair.1)).then_some(pair)
    }
}

/// `x · 2^exponent`, rounded once where it is subnormal and infinite where it overflows.
pub fn scaled(x: f64, exponent: i32) -> f64 {
    // Two factors, because 2^-1074 by 2^2044 is a normal number, and neither power alone is enough.
    let near = exponent.clamp(-1000, 1000);
    x * 2f64.powi(near) * 2f64.powi(exponent - near)
}

/// The neighbour of `x` so many steps up, or down.
pub fn nudged(x: f64, steps: i8) -> f64 {
    let step = if steps > 0 { f64::next_up } else { f64::next_down };
    (0..steps.unsigned_abs()).fold(x, |x, _| step(x))
}
