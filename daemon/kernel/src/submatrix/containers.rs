//! Two containers along each separating axis, in f64.

use glam::DVec3;

use super::lanes::LANES;
use super::{HALVING, Placed, SLACK, SMALLEST, UNDERFLOW, columns, faces, products, reach, unit_columns};
use crate::path::length_at_most;

/// The axes that are tried first prove most of what is to be proven.
const FACES: usize = 6;

/// Two placed bodies.
pub(super) struct Containers<'o> {
    pub placed: [Placed<'o>; 2],
    pub columns: [[DVec3; 3]; 2],
    /// Half the sides of the containers, in their own frames.
    pub halves: [[f64; 3]; 2],
    /// The middles of the containers, in their own frames.
    pub middles: [DVec3; 2],
    /// Twice the sum of what bounds the world coordinates of each.
    pub twice: DVec3,
    /// How far apart they must be proven to be.
    pub clearance: f64,
}

/// The containers along each axis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Along {
    directions: [[f64; LANES]; 3],
    /// Per body and axis of its container: half the extent of that side.
    pub edges: [[[f64; LANES]; 3]; 2],
    /// Of the middles, from the second to the first.
    pub offset: [f64; LANES],
    /// What rounding may add.
    pub slack: [f64; LANES],
    /// How far apart the middles may be.
    pub reach: [f64; LANES],
}

impl<'o> Containers<'o> {
    #[inline(always)]
    pub fn new(clearance: f64, a: Placed<'o>, b: Placed<'o>) -> Containers<'o> {
        let lattices = [a, b].map(|placed| placed.object.matrix().lattice());
        Containers {
            placed: [a, b],
            columns: [columns(a.rows), columns(b.rows)],
            halves: lattices.map(|lattice| lattice.half_sides()),
            middles: lattices.map(|lattice| lattice.middle()),
            twice: 2.0 * (a.magnitude + b.magnitude),
            clearance,
        }
    }

    /// `None` when the containers are proven apart.
    #[inline(always)]
    pub fn along(&self) -> Option<Along> {
        let mut along = Along::default();
        let edges = self.columns.map(unit_columns);
        along.set_directions(0, &faces(&edges));
        self.project::<0, FACES>(&mut along);
        if along.proves_apart::<0, FACES>() {
            return None;
        }
        along.set_directions(FACES, &products(&edges));
        self.project::<FACES, LANES>(&mut along);
        (!along.proves_apart::<FACES, LANES>()).then_some(along)
    }

    /// Along given axes.
    pub fn along_axes(&self, axes: &[DVec3]) -> Along {
        let mut along = Along::default();
        along.set_directions(0, axes);
        self.project::<0, LANES>(&mut along);
        along
    }

    /// Fills the lanes from `START` to `END`.
    #[inline(always)]
    fn project<const START: usize, const END: usize>(&self, along: &mut Along) {
        let [a, b] = self.placed.map(|placed| placed.rows);
        let shift = [a[0][3] - b[0][3], a[1][3] - b[1][3], a[2][3] - b[2][3]];
        let [x, y, z] = &along.directions;
        for lane in START..END {
            along.offset[lane] = x[lane] * shift[0] + y[lane] * shift[1] + z[lane] * shift[2];
        }
        for (body, sign) in [(0, 1.0), (1, -1.0)] {
            for axis in 0..3 {
                let column = self.columns[body][axis];
                let (half, middle) = (self.halves[body][axis], sign * self.middles[body][axis]);
                for lane in START..END {
                    let on_axis = x[lane] * column.x + y[lane] * column.y + z[lane] * column.z;
                    let edge = on_axis * half;
                    along.offset[lane] += on_axis * middle;
                    along.edges[body][axis][lane] = edge;
                    along.reach[lane] += edge.abs();
                }
            }
        }
        let underflow = self.underflow();
        for lane in START..END {
            let length = x[lane].abs() * self.twice.x + y[lane].abs() * self.twice.y + z[lane].abs() * self.twice.z;
            along.slack[lane] = length * (0.5 * SLACK) + underflow;
        }
        if self.are_halved() {
            for lane in START..END {
                let direction = DVec3::new(x[lane], y[lane], z[lane]);
                let columns = self.columns.as_flattened().iter();
                along.slack[lane] += columns.map(|column| column.dot(direction).abs()).sum::<f64>() * HALVING;
            }
        }
        if self.clearance > 0.0 {
            // The sums that the slack enters have fewer roundings than this.
            let clearance = self.clearance * (1.0 + 8.0 * f64::EPSILON);
            for lane in START..END {
                along.slack[lane] += clearance * length_at_most(DVec3::new(x[lane], y[lane], z[lane]));
            }
        }
        for lane in START..END {
            along.reach[lane] += along.slack[lane];
        }
    }

    /// What underflow can take.
    fn underflow(&self) -> f64 {
        UNDERFLOW * (4.0 + self.coordinates().into_iter().sum::<f64>())
    }

    /// More than rounding can move a polygon out of a voxel that lists it, and what points may stray.
    pub fn noise(&self) -> f64 {
        (0.5 * self.twice).max_element() * SLACK + self.clearance
    }

    /// Whether halving may have rounded a coordinate.
    pub fn are_halved(&self) -> bool {
        self.coordinates().into_iter().any(|reach| reach != 0.0 && reach < SMALLEST)
    }

    /// The largest coordinates of either body.
    fn coordinates(&self) -> [f64; 6] {
        let [[a, b, c], [d, e, f]] = self.placed.map(|placed| reach(placed.object));
        [a, b, c, d, e, f]
    }
}

impl Along {
    #[inline(always)]
    fn set_directions(&mut self, first: usize, directions: &[DVec3]) {
        for (lane, direction) in (first..).zip(directions) {
            for axis in 0..3 {
                self.directions[axis][lane] = direction[axis];
            }
        }
    }

    #[inline(always)]
    fn proves_apart<const START: usize, const END: usize>(&self) -> bool {
        // False for NaN: what is not proven apart is kept.
        (START..END).fold(false, |apart, lane| apart | (self.offset[lane].abs() > self.reach[lane]))
    }
}
