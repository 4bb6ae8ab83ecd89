//! The triangles of small voxels at their world positions, with boxes along the direction in which the bodies are nearest.
//!
//! Near the nearest points both surfaces are nearly at right angles to the line between them. Boxes along that line are thin, so
//! that they tell pairs of triangles apart that voxels do not. A voxel is carried into the world once per query.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use glam::DVec3;

use crate::affine::Rows;
use crate::object::Object;
use crate::polygon_pairs::WorldTriangle;
use crate::submatrix::Voxel;

/// Three axes at right angles, from an origin; coordinates are scaled by a power of two.
///
/// A coordinate errs by less than 8·2^-53 of the 1-norm of the position relative to the origin. The axes are of length 1 and at right angles up
/// to [`NearFrame::SKEW`], which also covers the rounding of squares and sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearFrame {
    axes: [DVec3; 3],
    origin: DVec3,
    scale: f64,
    /// Boxes made in another frame are made anew.
    generation: u32,
}

impl NearFrame {
    /// 2^-40. A few roundings of 2^-53 each.
    pub const SKEW: f64 = f64::from_bits((1023 - 40) << 52);

    /// The world's axes, before any direction is known.
    pub fn of_world(origin: DVec3, scale: f64) -> NearFrame {
        NearFrame { axes: DVec3::AXES, origin, scale, generation: 0 }
    }

    /// Turns to a new direction of length 1, when it differs enough to be worth it.
    pub fn follow(&mut self, direction: DVec3, origin: DVec3) {
        /// Boxes are thicker by their width times the sine of the angle between.
        const WORTH_IT: f64 = 1.0 - 3e-3;
        if self.generation == 0 || direction.dot(self.axes[2]) < WORTH_IT {
            let (first, second) = direction.any_orthonormal_pair();
            *self = NearFrame { axes: [first, second, direction], origin, generation: self.generation + 1, ..*self };
        }
    }

    fn coordinates(&self, point: DVec3) -> DVec3 {
        // Neither the difference nor the scaled point may overflow.
        let point = if self.scale < 1.0 {
            point * self.scale - self.origin * self.scale
        } else {
            (point - self.origin) * self.scale
        };
        DVec3::from(self.axes.map(|axis| axis.dot(point)))
    }
}

/// A box along the axes of a [`NearFrame`].
#[derive(Debug, Clone, Copy)]
pub(super) struct NearBox {
    min: DVec3,
    max: DVec3,
}

impl NearBox {
    const EMPTY: NearBox = NearBox { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    fn of(triangle: &WorldTriangle, frame: &NearFrame) -> NearBox {
        let [p, q, r] = triangle.corners.map(|corner| frame.coordinates(corner));
        NearBox { min: p.min(q).min(r), max: p.max(q).max(r) }
    }

    fn joined(&self, other: &NearBox) -> NearBox {
        NearBox { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The square of the distance of two boxes.
    #[inline(always)]
    pub fn gap(&self, other: &NearBox) -> f64 {
        let gap = (other.min - self.max).max(self.min - other.max).max(DVec3::ZERO);
        gap.length_squared()
    }
}

/// The triangles of one voxel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    start: usize,
    end: usize,
    pub bounds: NearBox,
    generation: u32,
}

/// One body's voxels that were met so far.
#[derive(Debug, Default)]
pub(super) struct Patches {
    triangles: Vec<WorldTriangle>,
    boxes: Vec<NearBox>,
    patches: Vec<Patch>,
    of_voxel: HashMap<(u8, u32), u32, BuildHasherDefault<VoxelHash>>,
    /// Per triangle: the count of `made` when it was last put into a patch. The lists of a voxel above the full order repeat.
    last_in: Vec<u64>,
    /// Patches made so far, over all queries.
    made: u64,
}

impl Patches {
    /// Forgets all voxels.
    pub fn clear(&mut self) {
        self.triangles.clear();
        self.boxes.clear();
        self.patches.clear();
        self.of_voxel.clear();
    }

    /// The triangles of a voxel, their boxes in this frame.
    pub fn of(&mut self, voxel: Voxel, (object, rows): (&Object, &Rows), frame: &NearFrame) -> Patch {
        let next = self.patches.len() as u32;
        let number = *self.of_voxel.entry((voxel.level, voxel.number)).or_insert(next);
        if number == next {
            let start = self.triangles.len();
            self.gather(voxel, object, rows);
            let end = self.triangles.len();
            self.boxes.resize(end, NearBox::EMPTY);
            self.patches.push(Patch { start, end, bounds: NearBox::EMPTY, generation: u32::MAX });
        }
        let patch = &mut self.patches[number as usize];
        if patch.generation != frame.generation {
            patch.generation = frame.generation;
            patch.bounds = NearBox::EMPTY;
            let range = patch.start..patch.end;
            for (triangle, bounds) in self.triangles[range.clone()].iter().zip(&mut self.boxes[range]) {
                *bounds = NearBox::of(triangle, frame);
                patch.bounds = patch.bounds.joined(bounds);
            }
        }
        *patch
    }

    /// Appends the triangles of a voxel, each once.
    fn gather(&mut self, voxel: Voxel, object: &Object, rows: &Rows) {
        self.made += 1;
        if self.last_in.len() < object.triangle_count() {
            self.last_in.resize(object.triangle_count(), 0);
        }
        for &number in object.matrix().triangles(usize::from(voxel.level), voxel.number) {
            if std::mem::replace(&mut self.last_in[number as usize], self.made) != self.made {
                self.triangles.push(WorldTriangle::new(number, object, rows));
            }
        }
    }

    /// The triangles of a patch with their boxes.
    pub fn triangles(&self, patch: &Patch) -> impl Iterator<Item = (&WorldTriangle, &NearBox)> {
        let range = patch.start..patch.end;
        self.triangles[range.clone()].iter().zip(&self.boxes[range])
    }
}

/// Fibonacci hashing (Knuth, The Art of Computer Programming 3, section 6.4): voxels are numbered by us, not by a stranger.
#[derive(Debug, Default)]
struct VoxelHash(u64);

impl Hasher for VoxelHash {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u32(byte.into()));
    }

    fn write_u8(&mut self, number: u8) {
        self.write_u32(number.into());
    }

    fn write_u32(&mut self, number: u32) {
        self.0 = (self.0.rotate_left(32) ^ u64::from(number)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
}
