//! For each voxel that is halved further, the slab between two parallel planes that holds its polygons.
//!
//! A surface that is nearly flat within a voxel fills a slab much thinner than the voxel, which tells how far it really reaches.
//! Slabs at right angles to the mean normal are the thin side of an oriented box (Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH
//! 1996, section 4); the voxel is the rest of it.

use glam::DVec3;

use crate::voxel_matrix::VoxelMatrix;

/// All points x of the voxel's polygons, in the object's frame, have `min ≤ normal·x ≤ max`, but for the rounding of that product.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slab {
    normal: DVec3,
    min: f64,
    max: f64,
}

/// The slabs of one object, level by level. Built once.
#[derive(Debug, Clone, Default)]
pub(crate) struct VoxelSlabs {
    levels: Vec<Vec<Slab>>,
}

impl VoxelSlabs {
    pub fn build(vertices: &[[f64; 3]], triangles: &[[u32; 3]], matrix: &VoxelMatrix) -> VoxelSlabs {
        let corners = |&number: &u32| triangles[number as usize].map(|vertex| DVec3::from(vertices[vertex as usize]));
        let slab = |level: usize, number: u32| Slab::of(|| matrix.triangles(level, number).iter().map(corners));
        let level = |level: usize| (0..matrix.node_count(level) as u32).map(|number| slab(level, number)).collect();
        VoxelSlabs { levels: (0..matrix.depth()).map(level).collect() }
    }

    /// The slab of a voxel; a voxel of the full order has none.
    #[inline]
    pub fn of(&self, level: usize, number: u32) -> Option<&Slab> {
        self.levels.get(level).map(|slabs| &slabs[number as usize])
    }

    /// Memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(level.as_slice())).sum()
    }
}

impl Slab {
    fn of<T: Iterator<Item = [DVec3; 3]>>(triangles: impl Fn() -> T) -> Slab {
        // Twice the area each; where that overflows or vanishes, or they cancel, there is no normal, and the slab is everything.
        let areas = triangles().map(|[p, q, r]| (q - p).cross(r - p)).sum::<DVec3>();
        let normal = areas.try_normalize().unwrap_or(DVec3::ZERO);
        let mut slab = Slab { normal, min: f64::INFINITY, max: f64::NEG_INFINITY };
        for corner in triangles().flatten() {
            let at = normal.dot(corner);
            (slab.min, slab.max) = (slab.min.min(at), slab.max.max(at));
        }
        slab
    }

    /// The most of `along·x` for the points x that lie both in the slab and in the box of this centre and these half sides.
    ///
    /// `along` is cut into a multiple of the normal, which the slab bounds, and a rest, which the box bounds.
    #[inline]
    pub fn most(&self, along: DVec3, centre: DVec3, half: DVec3) -> f64 {
        let share = along.dot(self.normal);
        let rest = along - self.normal * share;
        let most = share * if share > 0.0 { self.max } else { self.min };
        most + rest.dot(centre) + rest.abs().dot(half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLES: [[DVec3; 3]; 2] = [
        [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.1), DVec3::new(0.0, 1.0, -0.1)],
        [DVec3::new(0.5, 0.5, 0.2), DVec3::new(1.0, 0.5, 0.2), DVec3::new(0.5, 1.0, 0.1)],
    ];

    #[test]
    fn no_corner_exceeds_the_most_and_a_flat_surface_is_thin_along_its_normal() {
        let slab = Slab::of(|| TRIANGLES.into_iter());
        let (centre, half) = (DVec3::new(0.5, 0.5, 0.0), DVec3::splat(0.5));
        for along in [DVec3::X, -DVec3::Y, DVec3::Z, -DVec3::Z, DVec3::new(0.3, -0.2, 0.9)] {
            let most = slab.most(along, centre, half);
            assert!(TRIANGLES.iter().flatten().all(|corner| along.dot(*corner) <= most + 1e-15), "{along}");
        }
        assert!(slab.most(slab.normal, centre, half) + slab.most(-slab.normal, centre, half) < 0.4);
    }

    #[test]
    fn surfaces_without_a_mean_normal_have_the_voxel_alone() {
        let both_ways = [TRIANGLES[0], [TRIANGLES[0][0], TRIANGLES[0][2], TRIANGLES[0][1]]];
        let slab = Slab::of(|| both_ways.into_iter());
        assert_eq!(slab.most(DVec3::X, DVec3::splat(0.5), DVec3::splat(0.5)), 1.0);
    }
}
