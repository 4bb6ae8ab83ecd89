//! Perspective projection.

use super::vector::{cross, dot, normalised, sub};

/// Where a picture is taken from.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    /// Where the camera is.
    pub eye: [f64; 3],
    /// What it looks at, in the middle of the picture.
    pub target: [f64; 3],
    /// What is upwards in the picture.
    pub up: [f64; 3],
    /// Half the picture's height, divided by the tangent of half its angle of view.
    pub zoom: f64,
}

/// A camera with its axes and a picture's size.
pub struct View {
    eye: [f64; 3],
    right: [f64; 3],
    down: [f64; 3],
    forward: [f64; 3],
    /// Pixels in the length of the distance.
    scale: f64,
    middle: [f64; 2],
}

impl View {
    /// The view of `camera` in a picture of `width` by `height` pixels.
    pub fn new(camera: &Camera, [width, height]: [f64; 2]) -> View {
        let forward = normalised(sub(camera.target, camera.eye));
        let right = normalised(cross(forward, camera.up));
        View {
            eye: camera.eye,
            right,
            down: cross(forward, right),
            forward,
            scale: camera.zoom * height / 2.0,
            middle: [width / 2.0, height / 2.0],
        }
    }

    /// The pixel at which a point is seen; `None` for one not in front of the camera.
    pub fn project(&self, point: [f64; 3]) -> Option<[f64; 2]> {
        let ray = sub(point, self.eye);
        let depth = dot(ray, self.forward);
        let pixel = |axis: [f64; 3], middle: f64| middle + self.scale * dot(ray, axis) / depth;
        (depth > 0.0).then(|| [pixel(self.right, self.middle[0]), pixel(self.down, self.middle[1])])
    }

    /// A direction given to the right, down and away from the camera, in the world.
    pub fn to_world(&self, direction: [f64; 3]) -> [f64; 3] {
        let [right, down, away] = direction;
        std::array::from_fn(|axis| right * self.right[axis] + down * self.down[axis] + away * self.forward[axis])
    }

    /// From the camera to a point.
    pub fn ray(&self, point: [f64; 3]) -> [f64; 3] {
        sub(point, self.eye)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_has_its_target_in_the_middle_and_up_upwards() {
        let camera = Camera { eye: [0.0, 0.0, 4.0], target: [0.0; 3], up: [0.0, 1.0, 0.0], zoom: 2.0 };
        let view = View::new(&camera, [300.0, 200.0]);
        for (point, pixel) in [
            ([0.0, 0.0, 0.0], Some([150.0, 100.0])),
            ([1.0, 1.0, 0.0], Some([200.0, 50.0])),
            ([1.0, 1.0, 2.0], Some([250.0, 0.0])),
            ([0.0, 0.0, 5.0], None),
        ] {
            assert_eq!(view.project(point), pixel);
        }
    }
}
