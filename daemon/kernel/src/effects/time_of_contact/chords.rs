//! Two triangles whose corners move on straight lines: how long a fixed axis keeps them apart.
//!
//! Along a fixed axis each corner's place is linear in time, the greatest of the first triangle convex, the least of
//! the second concave: the gap between them is concave. So where an axis separates at both ends of a time it separates
//! in between, and the first time at which it stops is the root of one of nine linear functions. Stepping from such a
//! time to the next, with the best axis there, never passes a contact and converges like Newton's method.
//!
//! # Why nothing is missed
//! Corners are seen from the first corner of the first triangle, which moves along: a difference of two positions is
//! rounded relative to itself. With `scale` the largest of these coordinates, a place along an axis L (3 products, 2
//! sums, the difference, the step to a time) errs by less than 10·2^-53·|L|₁·scale, a gap by twice that, and the
//! rounding of the root moves it by 6·2^-53·|L|₁·scale more; [`SLACK`] is above their sum. Of axes nothing is asked but
//! to be finite: their own rounding and length do no harm. What the corners stray from their lines is `pad`.

use glam::DVec3;

use super::nearest;
use crate::polygon_box::unit_scale;

const SLACK: f64 = 64.0 * (f64::EPSILON / 2.0);
/// 2^-1060.
const UNDERFLOW: f64 = f64::from_bits(1 << 14);

/// Two triangles over one span of time, 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chords {
    /// At both ends: the corners of the first, then of the second, seen from the first corner of the first.
    ends: [[DVec3; 6]; 2],
    scale: f64,
    pad: f64,
}

/// How long an axis separates, in the time of the chords.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Separated {
    /// Proven until here, pad and rounding included.
    pub until: f64,
    /// As it would be without them.
    pub about: f64,
}

impl Chords {
    /// `a` and `b` are the corners at both ends. Points may stray from their lines by `pad`, both together.
    pub fn new(a: &[[DVec3; 3]; 2], b: &[[DVec3; 3]; 2], pad: f64) -> Chords {
        let seen = |end: usize| {
            let origin = a[end][0];
            [DVec3::ZERO, a[end][1] - origin, a[end][2] - origin]
                .into_iter()
                .chain(b[end].map(|corner| corner - origin))
                .enumerate()
                .fold([DVec3::ZERO; 6], |mut all, (i, corner)| {
                    all[i] = corner;
                    all
                })
        };
        let ends = [seen(0), seen(1)];
        let scale = ends.as_flattened().iter().fold(0.0, |scale: f64, corner| scale.max(corner.abs().max_element()));
        Chords { ends, scale, pad }
    }

    /// Of the axes that may separate at `now`, the one that does so longest; the first to reach `wanted` is good
    /// enough.
    pub fn separated_longest(&self, now: f64, wanted: f64) -> Option<Separated> {
        let corners = self.at(now);
        let mut best: Option<Separated> = None;
        let good_enough = |axis: DVec3| {
            if let Some(found) = self.separated_by(axis, now, wanted)
                && best.is_none_or(|best| found.until > best.until)
            {
                best = Some(found);
            }
            best.is_some_and(|best| best.until >= wanted)
        };
        let _ = axes(&corners).any(good_enough);
        best
    }

    /// Whether some axis separates them at `now`.
    pub fn separated_at(&self, now: f64) -> bool {
        self.separated_longest(now, now).is_some()
    }

    fn at(&self, now: f64) -> [DVec3; 6] {
        let [start, end] = &self.ends;
        [0, 1, 2, 3, 4, 5].map(|i| start[i] + (end[i] - start[i]) * now)
    }

    fn separated_by(&self, axis: DVec3, now: f64, wanted: f64) -> Option<Separated> {
        let [start, end] = [0, 1].map(|end| self.ends[end].map(|corner| corner.dot(axis)));
        let place = |t: f64| -> [f64; 6] { [0, 1, 2, 3, 4, 5].map(|i| start[i] + (end[i] - start[i]) * t) };
        let here = place(now);
        let (gap, sign) = gap(&here);
        let size = axis.abs();
        let slack = size.element_sum() * self.scale * SLACK + self.pad * axis.length() * (1.0 + 1e-15) + UNDERFLOW;
        // NaN proves nothing.
        let beyond = |gap: f64| gap > slack;
        if !beyond(gap) {
            return None;
        }
        let there = place(wanted);
        let mut separated = Separated { until: wanted, about: wanted };
        for i in 0..3 {
            for j in 3..6 {
                let (gap, last) = (sign * (here[j] - here[i]), sign * (there[j] - there[i]));
                if !beyond(last) {
                    let until = now + (wanted - now) * ((gap - slack) / (gap - last));
                    let about = now + (wanted - now) * (gap / (gap - last)).min(1.0);
                    separated.until = if until.is_nan() { now } else { separated.until.min(until) };
                    separated.about = separated.about.min(about);
                }
            }
        }
        Some(separated)
    }
}

/// The gap between the first three places and the last three, and the sign of the direction in which it is.
fn gap(place: &[f64; 6]) -> (f64, f64) {
    let least = |places: &[f64]| places.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = |places: &[f64]| places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (a, b) = place.split_at(3);
    let (up, down) = (least(b) - greatest(a), least(a) - greatest(b));
    if up >= down { (up, 1.0) } else { (down, -1.0) }
}

/// Axes that may separate two triangles, the likeliest and cheapest first: their normals, the products of their edges,
/// the shortest way between them, the normals of their edges within their planes, which tell triangles in one plane
/// apart, and the world's.
fn axes(corners: &[DVec3; 6]) -> impl Iterator<Item = DVec3> {
    let [a, b]: [[DVec3; 3]; 2] = [[corners[0], corners[1], corners[2]], [corners[3], corners[4], corners[5]]];
    let edges = |t: &[DVec3; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]].map(unit_scale);
    let (edges_a, edges_b) = (edges(&a), edges(&b));
    let normals = [edges_a[0].cross(edges_a[1]), edges_b[0].cross(edges_b[1])];
    let products = (0..9).map(move |i| edges_a[i / 3].cross(edges_b[i % 3]));
    let in_plane =
        (0..6).map(move |i| if i < 3 { edges_a[i].cross(normals[0]) } else { edges_b[i - 3].cross(normals[1]) });
    let nearest = std::iter::once_with(move || unit_scale(nearest::vector_between(&a, &b)));
    normals.into_iter().chain(products).chain(nearest).chain(in_plane).chain(DVec3::AXES)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    fn chords(b: [[f64; 3]; 3], shift: [f64; 3], pad: f64) -> Chords {
        let (a, b) = (FLAT.map(DVec3::from), b.map(DVec3::from));
        Chords::new(&[a, a], &[b, b.map(|corner| corner + DVec3::from(shift))], pad)
    }

    #[test]
    fn an_axis_separates_until_the_first_corner_arrives() {
        let above = [[1.0, 1.0, 2.0], [1.5, 1.0, 3.0], [1.0, 1.5, 3.0]];
        let found = chords(above, [0.0, 0.0, -8.0], 0.0).separated_longest(0.0, 1.0).expect("apart at the start");
        assert!(found.until < 0.25 && found.until > 0.25 - 1e-14, "{found:?}");
        let padded = chords(above, [0.0, 0.0, -8.0], 0.5).separated_longest(0.0, 1.0).expect("apart at the start");
        assert!(padded.until < 0.1875 && padded.until > 0.1875 - 1e-14, "{padded:?}");
        assert_eq!(chords(above, [0.0, 0.0, -8.0], 2.5).separated_longest(0.0, 1.0), None);
        let aside = chords(above, [7.0, 9.0, -8.0], 0.0).separated_longest(0.0, 1.0).expect("apart at the start");
        assert!(aside.until < 1.0 && aside.until >= 0.25 - 1e-14);
    }

    #[test]
    fn stepping_from_axis_to_axis_proves_a_miss() {
        let passing = chords([[6.0, 6.0, 0.5], [6.0, 6.0, 0.5], [6.0, 6.0, 0.5]], [-12.0, -2.0, -1.0], 0.0);
        let mut now = 0.0;
        for _ in 0..12 {
            match passing.separated_longest(now, 1.0) {
                Some(found) if found.until > now => now = found.until,
                _ => break,
            }
        }
        assert_eq!(now, 1.0);
    }

    #[test]
    fn in_one_plane() {
        let beside = [[5.0, 1.0, 0.0], [6.0, 1.0, 0.0], [5.0, 2.0, 0.0]];
        assert!(chords(beside, [0.0; 3], 0.0).separated_at(0.5));
        assert!(!chords(FLAT, [0.0; 3], 0.0).separated_at(0.5));
        assert!(
            !chords(beside, [f64::INFINITY; 3], 0.0).separated_longest(0.0, 1.0).is_some_and(|found| found.until > 0.0)
        );
    }
}
