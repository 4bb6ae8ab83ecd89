//! Stage 2: global bounding boxes, from the transformed containers.

use glam::DVec3;

use crate::affine::Rows;
use crate::container::Container;

/// A world-axis box. Both corners belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalBox {
    /// Smallest world coordinates.
    pub min: DVec3,
    /// Largest world coordinates.
    pub max: DVec3,
}

impl GlobalBox {
    /// The box that holds nothing and overlaps nothing.
    pub const EMPTY: GlobalBox = GlobalBox { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box of a transformed container. It holds every rounded world vertex of the container's contents.
    ///
    /// No pad is needed: a world coordinate is computed by products and sums whose rounding is monotone in each vertex
    /// coordinate, so its extremes over the container are reached, rounding included, at corners, and this is the very
    /// formula of [`world_vertex`](crate::affine::world_vertex) there. A corner may overflow where no vertex does: such a side
    /// goes as far as a finite coordinate can, and still not to where [`EMPTY`](Self::EMPTY) begins.
    pub fn of(container: &Container, rows: &Rows) -> GlobalBox {
        let extreme = |row: [f64; 4], low: bool| {
            let at = |axis: usize| {
                let smallest = (row[axis] >= 0.0) == low;
                row[axis] * if smallest { container.min[axis] } else { container.max[axis] }
            };
            ((at(0) + at(1)) + at(2)) + row[3]
        };
        let low = |row: [f64; 4]| bounded(extreme(row, true), f64::MIN);
        let high = |row: [f64; 4]| bounded(extreme(row, false), f64::MAX);
        GlobalBox { min: DVec3::from(rows.map(low)), max: DVec3::from(rows.map(high)) }
    }

    /// Whether the boxes have a point in common.
    #[inline]
    pub fn overlaps(&self, other: &GlobalBox) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// The smallest box that holds both.
    #[inline]
    pub(crate) fn joined(&self, other: &GlobalBox) -> GlobalBox {
        GlobalBox { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}

fn bounded(coordinate: f64, otherwise: f64) -> f64 {
    if coordinate.is_finite() { coordinate } else { otherwise }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affine::world_vertex;

    #[test]
    fn the_box_is_that_of_all_eight_corners() {
        let container = Container { min: [-1.0, 0.1, 2.0], max: [0.3, 0.7, 5.0] };
        let maps = [
            [[0.3, -0.7, 0.1, 5.0], [-0.2, 0.9, -0.4, 1e6], [0.0, 0.0, -1.0, 0.1]],
            [[1e-300, -2.0, 0.0, 0.0], [0.0; 4], [-3.0, -3.0, -3.0, 1e-9]],
        ];
        for rows in maps {
            let corners = (0..8).map(|corner| {
                let side = |axis: usize| [container.min, container.max][corner >> axis & 1][axis];
                world_vertex(&rows, [side(0), side(1), side(2)])
            });
            let expected = corners.fold(GlobalBox::EMPTY, |all, p| all.joined(&GlobalBox { min: p, max: p }));
            assert_eq!(GlobalBox::of(&container, &rows), expected);
        }
    }

    #[test]
    fn a_corner_that_overflows_leaves_its_side_to_every_finite_coordinate() {
        let container = Container { min: [0.0; 3], max: [1e200, 1.0, 1.0] };
        let rows = [[1e200, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let found = GlobalBox::of(&container, &rows);
        assert_eq!((found.min, found.max), (DVec3::ZERO, DVec3::new(f64::MAX, 1.0, 1.0)));
        let everything = GlobalBox { min: DVec3::MIN, max: DVec3::MAX };
        assert!(everything.overlaps(&found) && !everything.overlaps(&GlobalBox::EMPTY));
    }
}
