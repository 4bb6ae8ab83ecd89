//! Poses at which two meshes are about to touch: found by bisection with the exact test.

use std::sync::Arc;

use collided_kernel::affine::IDENTITY;
use collided_kernel::{Effects, Object};
use collided_protocol::step::Rows;

use crate::crowd;
use crate::kernel_pair::KernelPair;

/// An approach of a second body to a first one at rest.
#[derive(Debug, Clone, Copy)]
pub struct Approach {
    /// The second body's rotation and scale.
    pub rotation: [[f64; 3]; 3],
    /// Where its origin is when the middles of the two bodies' containers are in one place.
    pub middle: [f64; 3],
    /// The way it leaves, of length 1.
    pub away: [f64; 3],
    /// How far out it still interferes.
    pub meets: f64,
    /// The next number, or nearly: there it is clear.
    pub clear: f64,
}

impl Approach {
    /// Where the second body is, so far out.
    pub fn at(&self, out: f64) -> Rows {
        std::array::from_fn(|row| {
            let [x, y, z] = self.rotation[row];
            [x, y, z, self.middle[row] + self.away[row] * out]
        })
    }

    /// So many approaches from random directions, with random rotations and the second body scaled: the same on every machine.
    ///
    /// # Panics
    /// When the objects do not interfere when their middles are in one place, or still do `far` from there.
    pub fn random([a, b]: [&Arc<Object>; 2], scale: f64, far: f64, count: usize, seed: u64) -> Vec<Approach> {
        let mut pair = KernelPair::new(a, b, Effects::INTERFERENCE);
        let middles = [a, b].map(|object| middle(object));
        random_poses(count, seed)
            .into_iter()
            .map(|(rotation, away)| {
                let rotation = rotation.map(|row| row.map(|x| scale * x));
                let turned = rotation.map(|row| (0..3).map(|axis| row[axis] * middles[1][axis]).sum::<f64>());
                let middle = std::array::from_fn(|axis| middles[0][axis] - turned[axis]);
                let start = Approach { rotation, middle, away, meets: 0.0, clear: far };
                start.narrowed(|rows| pair.step(IDENTITY, rows).expect("good transforms").interfering)
            })
            .collect()
    }

    /// Bisects until no number is left between the two ends.
    ///
    /// # Panics
    /// When it does not interfere where it `meets`, or does where it is `clear`.
    pub fn narrowed(mut self, mut interferes: impl FnMut(Rows) -> bool) -> Approach {
        assert!(
            interferes(self.at(self.meets)) && !interferes(self.at(self.clear)),
            "the ends are what they are to be"
        );
        loop {
            let middle = 0.5 * (self.meets + self.clear);
            if middle <= self.meets || middle >= self.clear {
                return self;
            }
            *(if interferes(self.at(middle)) { &mut self.meets } else { &mut self.clear }) = middle;
        }
    }
}

fn middle(object: &Object) -> [f64; 3] {
    let container = object.container().expect("the object has polygons");
    std::array::from_fn(|axis| 0.5 * (container.min[axis] + container.max[axis]))
}

/// A rotation, and a direction of length 1.
pub type Pose = ([[f64; 3]; 3], [f64; 3]);

/// Random ones: the same on every machine.
pub fn random_poses(count: usize, seed: u64) -> Vec<Pose> {
    let poses = crowd::moving_within(2.0, count, 1, seed).swap_remove(0);
    let split = |rows: Rows| {
        let rotation = rows.map(|[x, y, z, _]| [x, y, z]);
        let from_centre = rows.map(|[.., at]| at - 1.0);
        let length = from_centre.iter().map(|x| x * x).sum::<f64>().sqrt();
        (rotation, from_centre.map(|x| x / length))
    };
    poses.into_iter().map(split).collect()
}
