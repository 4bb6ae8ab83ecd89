//! Random affine transforms of every kind, and bodies placed by them.

use std::f64::consts::TAU;

use collided_kernel::Object;
use collided_protocol::step::Rows;
use proptest::array::uniform3;
use proptest::prelude::*;

use crate::triangle_pairs::scaled;

/// The linear part of a transform, row-major.
pub type Linear = [[f64; 3]; 3];

type Vector = [f64; 3];

/// Rotations, non-uniform scales, shears, mirrors and flattened ones, none far from unit size.
pub fn linear() -> impl Strategy<Value = Linear> {
    let scales = prop_oneof![3 => uniform3(0.2..2.0), 1 => uniform3(-2.0..2.0), 1 => flattening()];
    prop_oneof![
        1 => Just(diagonal([1.0; 3])),
        3 => rotation(),
        3 => (rotation(), scales, rotation()).prop_map(|(r, s, q)| product(&product(&r, &diagonal(s)), &q)),
        1 => uniform3(uniform3(-1.0..1.0)),
    ]
}

/// Like [`linear`], and far beyond: scales 2^60 either way in one map, columns that are parallel up to 2^-60, mirrors of both.
pub fn extreme_linear() -> impl Strategy<Value = Linear> {
    let power = || {
        (-60..=60i32, any::<bool>()).prop_map(|(exponent, mirror)| scaled(if mirror { -1.0 } else { 1.0 }, exponent))
    };
    let narrow = || (-60..=-10i32, -1.0..1.0).prop_map(|(exponent, part)| scaled(part, exponent));
    let flattened = (narrow(), narrow(), narrow()).prop_map(|(x, y, z)| [[1.0, 1.0, 1.0], [0.0, x, y], [0.0, 0.0, z]]);
    prop_oneof![
        2 => linear(),
        2 => (rotation(), uniform3(power()), rotation()).prop_map(|(r, s, q)| product(&product(&r, &diagonal(s)), &q)),
        1 => (rotation(), uniform3(power())).prop_map(|(r, s)| product(&r, &diagonal(s))),
        2 => (rotation(), flattened).prop_map(|(r, flattened)| product(&r, &flattened)),
    ]
}

/// Scales that carry space to a plane, a line or a point.
fn flattening() -> impl Strategy<Value = Vector> {
    (uniform3(0.5..2.0), uniform3(any::<bool>()))
        .prop_map(|(scales, kept)| [0, 1, 2].map(|axis| if kept[axis] { scales[axis] } else { 0.0 }))
}

/// Rotations about the x, y and z axis, one after the other.
pub fn rotation() -> impl Strategy<Value = Linear> {
    uniform3(0.0..TAU).prop_map(|angles| {
        let turns = [0, 1, 2].map(|axis| about_axis(axis, angles[axis]));
        product(&product(&turns[2], &turns[1]), &turns[0])
    })
}

fn about_axis(axis: usize, angle: f64) -> Linear {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut turn = diagonal([1.0; 3]);
    (turn[u][u], turn[u][v]) = (angle.cos(), -angle.sin());
    (turn[v][u], turn[v][v]) = (angle.sin(), angle.cos());
    turn
}

/// A direction of any length up to 1 per axis.
pub fn direction() -> impl Strategy<Value = Vector> {
    uniform3(-1.0..1.0)
}

fn diagonal([x, y, z]: Vector) -> Linear {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

fn product(a: &Linear, b: &Linear) -> Linear {
    a.map(|row| [0, 1, 2].map(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

/// The transform that brings an object to unit size, then maps it by `linear`, with the middle of its container at `centre`.
///
/// # Panics
/// When the object is empty.
pub fn placed(object: &Object, linear: &Linear, centre: Vector) -> Rows {
    let container = object.container().expect("an object with polygons has a container");
    let extents = [0, 1, 2].map(|axis| container.max[axis] - container.min[axis]);
    let size = extents.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    let middle = [0, 1, 2].map(|axis| container.min[axis] / 2.0 + container.max[axis] / 2.0);
    [0, 1, 2].map(|row| {
        let [x, y, z] = linear[row].map(|entry| entry / size);
        [x, y, z, centre[row] - (x * middle[0] + y * middle[1] + z * middle[2])]
    })
}
