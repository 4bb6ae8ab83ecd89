//! World boxes: of cells, and how those of triangles are measured to be compared with them.
//!
//! # Why nothing is lost
//! Boxes are measured from the middle of the first container, by what reaches from there to the farthest point of either body,
//! so their coordinates are at most 1. In f32 the middle, three columns and their shares, and the sums pass ten roundings of 2^-24;
//! [`BOX_ROUNDING`] is sixteen. What rounding moves vertices and planes by is below [`SLACK`] times twice the magnitudes, as along
//! the separating axes. The coordinates of triangles are rounded to the nearest f32 in the same frame, which is monotone.

use glam::{DVec3, Vec4};

use super::containers::Containers;
use super::side::{HALF_GRAIN, Side};
use super::{PairFrame, SLACK, SMALLEST};
use crate::cell_boxes::GRAINS;
use crate::cells::Cell;
use crate::container::MAX_ORDER;

/// 2^900.
const LARGEST: f64 = f64::from_bits((1023 + 900) << 52);

/// 2^-20: sixteen roundings of f32, of what reaches to the farthest point.
pub(super) const BOX_ROUNDING: f32 = 1.0 / (1 << 20) as f32;

/// How world boxes are measured, so that f32 is fine enough for them and holds them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BoxFrame {
    /// From here.
    pub origin: DVec3,
    /// By what reaches from there to the farthest point of either body, or more: 1 over it.
    pub unit: f64,
    /// What rounding may move a box by.
    rounding: Vec4,
    /// The same, and the clearance.
    slack: Vec4,
}

impl BoxFrame {
    /// A world length that a gap between boxes stands for, at least.
    pub fn at_least(&self, gap: f32) -> f64 {
        let gap = f64::from(gap - 2.0 * self.rounding.max_element());
        if gap > 0.0 { gap / self.unit } else { 0.0 }
    }
}

impl PairFrame {
    #[inline(always)]
    pub(super) fn place_boxes(&mut self, containers: &Containers<'_>) {
        let origin = containers.world_middle(0);
        let Some(unit) = containers.box_unit(containers.world_reach(origin).max_element()) else {
            // Nothing is told apart by boxes.
            let everything = Vec4::INFINITY;
            self.boxes = BoxFrame { rounding: everything, slack: everything, ..BoxFrame::default() };
            self.sides.iter_mut().for_each(Side::place_nowhere);
            return;
        };
        for (body, side) in self.sides.iter_mut().enumerate() {
            side.place(containers.world_middle(body) - origin, &containers.world_edges(body), unit);
        }
        let rounding = containers.box_rounding(unit);
        let clearance = (containers.clearance * unit) as f32;
        let slack = rounding + clearance * (1.0 + BOX_ROUNDING);
        self.boxes = BoxFrame { origin, unit, rounding, slack };
    }

    /// How world boxes are measured.
    pub fn boxes(&self) -> &BoxFrame {
        &self.boxes
    }

    /// The world box that holds every common point of polygons in two cells, and of other points those nearer to each other than
    /// the clearance: where it starts and ends, as [`boxes`](Self::boxes) has it.
    #[inline(always)]
    pub fn common_box(&self, cells: &[Cell; 2]) -> [Vec4; 2] {
        let (a, half_a) = self.sides[0].world_box(&cells[0]);
        let (b, half_b) = self.sides[1].world_box(&cells[1]);
        let (half_a, half_b) = (half_a + self.boxes.slack, half_b + self.boxes.slack);
        [(a - half_a).max(b - half_b), (a + half_a).min(b + half_b)]
    }
}

impl Containers<'_> {
    /// The middle of a container in the world.
    pub(super) fn world_middle(&self, body: usize) -> DVec3 {
        let ([x, y, z], at, rows) = (self.columns[body], self.middles[body], self.placed[body].rows);
        x * at.x + y * at.y + z * at.z + DVec3::new(rows[0][3], rows[1][3], rows[2][3])
    }

    /// Half the sides of a container in the world.
    pub(super) fn world_edges(&self, body: usize) -> [DVec3; 3] {
        [0, 1, 2].map(|axis| self.columns[body][axis] * self.halves[body][axis])
    }

    /// More than reaches from a point to the farthest of either container, per world axis.
    pub(super) fn world_reach(&self, from: DVec3) -> DVec3 {
        let extent = |body: usize| self.world_edges(body).iter().fold(DVec3::ZERO, |sum, edge| sum + edge.abs());
        let distance = |body: usize| (self.world_middle(body) - from).abs();
        distance(0).max(distance(1)) + extent(0) + extent(1)
    }

    /// 1 over what boxes are measured by. `None` where they are too small or too large for that, whatever the unit.
    pub(super) fn box_unit(&self, reach: f64) -> Option<f64> {
        (!self.are_halved() && (SMALLEST..LARGEST).contains(&reach)).then(|| 1.0 / reach)
    }

    /// What rounding may move a box by.
    pub(super) fn box_rounding(&self, unit: f64) -> Vec4 {
        (self.twice * SLACK * unit).as_vec3().extend(0.0) + BOX_ROUNDING
    }
}

impl Side {
    pub(super) fn place(&mut self, middle: DVec3, edges: &[DVec3; 3], unit: f64) {
        let rounded = |vector: DVec3| (vector * unit).as_vec3().extend(0.0);
        (self.middle, self.columns) = (rounded(middle), edges.map(rounded));
    }

    pub(super) fn place_nowhere(&mut self) {
        (self.middle, self.columns) = (Vec4::ZERO, [Vec4::ZERO; 3]);
    }

    /// Centre and half the sides of the world box around the box within a cell.
    #[inline(always)]
    pub(super) fn world_box(&self, cell: &Cell) -> (Vec4, Vec4) {
        /// 2^-30.
        const UNIT: f32 = 1.0 / (1 << MAX_ORDER) as f32;
        let shares = self.shares[cell.rank as usize];
        let (mut centre, mut half) = (self.middle, Vec4::ZERO);
        for axis in 0..3 {
            let (min, max) = (f32::from(cell.bounds.min[axis]), f32::from(cell.bounds.max[axis]));
            let grain = shares[axis] * HALF_GRAIN;
            centre +=
                self.columns[axis] * (cell.centre[axis] as f32 * UNIT + (min + max - (GRAINS - 1) as f32) * grain);
            half += self.columns[axis].abs() * ((max - min + 1.0) * grain);
        }
        (centre, half)
    }
}
