//! Transforms of common kinds, as rows of `[rotation, scale, shear | translation]`.

use collided_protocol::step::Rows;

/// The identity transform.
pub const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// A translation, in the caller's length unit.
pub fn translation([x, y, z]: [f64; 3]) -> Rows {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]]
}

/// A rotation about an axis through the origin, counterclockwise seen against the axis. `axis` may have any length; that of zero
/// turns nothing. `angle` is in radians. The same bits on every machine: sine and cosine are those of `libm`.
///
/// ```
/// use collided_client::{rotation, then, translation};
/// // A quarter turn about z, then one to the right: what was at x = 1 comes to (1, 1, 0).
/// let pose = then(&rotation([0.0, 0.0, 2.0], std::f64::consts::FRAC_PI_2), &translation([1.0, 0.0, 0.0]));
/// let [x, y, z] = pose.map(|row| row[0] + row[3]);
/// assert!((x - 1.0).abs() < 1e-15 && (y - 1.0).abs() < 1e-15 && z == 0.0);
/// ```
pub fn rotation(axis: [f64; 3], angle: f64) -> Rows {
    let largest = axis.iter().fold(0.0, |largest, part| part.abs().max(largest));
    if largest == 0.0 {
        return IDENTITY;
    }
    // Scaled first, so that no square overflows or vanishes.
    let scaled = axis.map(|part| part / largest);
    let length = scaled.iter().map(|part| part * part).sum::<f64>().sqrt();
    let [x, y, z] = scaled.map(|part| part / length);
    let (sin, cos, half) = (libm::sin(angle), libm::cos(angle), libm::sin(0.5 * angle));
    // Rodrigues' formula; 1 − cos without cancellation.
    let versine = 2.0 * half * half;
    let (unit, cross) = ([x, y, z], [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]);
    [0, 1, 2].map(|row| {
        let entry = |column: usize| {
            let diagonal = if row == column { cos } else { 0.0 };
            diagonal + versine * unit[row] * unit[column] + sin * cross[row][column]
        };
        [entry(0), entry(1), entry(2), 0.0]
    })
}

/// The transform that does `first`, and `next` after it.
pub fn then(first: &Rows, next: &Rows) -> Rows {
    next.map(|[x, y, z, shift]| {
        let entry = |column: usize| (x * first[0][column] + y * first[1][column]) + z * first[2][column];
        [entry(0), entry(1), entry(2), entry(3) + shift]
    })
}
