//! Rigid poses with a scale, and paths of them.

use collided_protocol::step::Rows;

/// Where a body is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Where its origin is.
    pub position: [f64; 3],
    /// How far it is turned about the x, then the y, then the z axis, in radians.
    pub turn: [f64; 3],
    /// How much larger it is than its object.
    pub scale: f64,
}

/// A pose at a time.
pub struct Key {
    /// From the begin (0) to the end (1) of the path.
    pub time: f64,
    /// The pose there.
    pub pose: Pose,
}

impl Pose {
    /// The pose, `scale` times larger.
    pub fn scaled(self, scale: f64) -> Pose {
        Pose { scale: self.scale * scale, ..self }
    }

    /// The pose as a transform.
    pub fn rows(&self) -> Rows {
        let [(sx, cx), (sy, cy), (sz, cz)] = self.turn.map(libm::sincos);
        let rotation = [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ];
        std::array::from_fn(|row| {
            let [x, y, z] = rotation[row].map(|entry| self.scale * entry);
            [x, y, z, self.position[row]]
        })
    }
}

/// On a circle about the upright y axis at the height given, `turns` times round, the x axis backwards.
pub fn circling(radius: f64, height: f64, turns: f64) -> Pose {
    let angle = std::f64::consts::TAU * turns;
    let (sin, cos) = libm::sincos(angle);
    Pose { position: [radius * cos, height, radius * sin], turn: [0.0, -angle, 0.0], scale: 1.0 }
}

/// The pose at `time` of a path, which is at rest at each key. Keys ascend in time.
pub fn along(keys: &[Key], time: f64) -> Pose {
    let after = keys.partition_point(|key| key.time <= time).clamp(1, keys.len() - 1);
    let (from, to) = (&keys[after - 1], &keys[after]);
    let share = ((time - from.time) / (to.time - from.time)).clamp(0.0, 1.0);
    let smooth = share * share * (3.0 - 2.0 * share);
    let mix = |a: f64, b: f64| a + (b - a) * smooth;
    let mix3 = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|axis| mix(a[axis], b[axis]));
    Pose {
        position: mix3(from.pose.position, to.pose.position),
        turn: mix3(from.pose.turn, to.pose.turn),
        scale: mix(from.pose.scale, to.pose.scale),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_turns_about_x_then_y_then_z() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let rows = Pose { position: [1.0, 2.0, 3.0], turn: [quarter, 0.0, quarter], scale: 2.0 }.rows();
        // y turns to z by the first turn, which the third leaves there.
        let image: [f64; 3] = std::array::from_fn(|row| rows[row][1] + rows[row][3]);
        for (found, expected) in image.into_iter().zip([1.0, 2.0, 5.0]) {
            assert!((found - expected).abs() < 1e-12, "{image:?}");
        }
    }

    #[test]
    fn a_path_meets_its_keys_and_ends_there() {
        let key = |time, x| Key { time, pose: Pose { position: [x, 0.0, 0.0], turn: [0.0; 3], scale: 1.0 } };
        let keys = [key(0.0, 1.0), key(0.5, 2.0), key(1.0, 4.0)];
        for (time, x) in [(-1.0, 1.0), (0.0, 1.0), (0.25, 1.5), (0.5, 2.0), (0.75, 3.0), (1.0, 4.0), (9.0, 4.0)] {
            assert_eq!(along(&keys, time).position[0], x, "at {time}");
        }
    }
}
