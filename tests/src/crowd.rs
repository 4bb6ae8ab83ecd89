//! A generated scene of many moving bodies: the same for the same numbers, on every machine.

use collided_protocol::step::Rows;

/// SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014, figure 16).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A generator; the same seed gives the same numbers.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// From 0 up to, not including, 1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ mixed >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }
}

/// Transforms of `count` bodies over `steps` steps, `[step][body]`. Bodies of unit size turn and drift in a cube in which each
/// has `room` cubic units to itself.
pub fn moving(count: usize, steps: usize, room: f64, seed: u64) -> Vec<Vec<Rows>> {
    moving_within((count as f64 * room).cbrt(), count, steps, seed)
}

/// As [`moving`], in a cube of the given side: the same bits on every machine, since the cube root is not needed.
pub fn moving_within(side: f64, count: usize, steps: usize, seed: u64) -> Vec<Vec<Rows>> {
    let mut random = Random::new(seed);
    let mut bodies: Vec<Body> = (0..count).map(|_| Body::new(&mut random, side)).collect();
    let mut step = || bodies.iter_mut().map(|body| body.advance(side)).collect();
    (0..steps).map(|_| step()).collect()
}

/// A rotation as a unit quaternion, and a position, with what they change by in a step.
struct Body {
    rotation: [f64; 4],
    spin: [f64; 4],
    position: [f64; 3],
    drift: [f64; 3],
}

impl Body {
    fn new(random: &mut Random, side: f64) -> Body {
        Body {
            rotation: unit([random.signed(), random.signed(), random.signed(), random.signed()]),
            spin: unit([1.0, 0.02 * random.signed(), 0.02 * random.signed(), 0.02 * random.signed()]),
            position: [side * random.unit(), side * random.unit(), side * random.unit()],
            drift: [0.05 * random.signed(), 0.05 * random.signed(), 0.05 * random.signed()],
        }
    }

    fn advance(&mut self, side: f64) -> Rows {
        self.rotation = unit(product(self.spin, self.rotation));
        for (position, drift) in self.position.iter_mut().zip(&mut self.drift) {
            *position += *drift;
            if !(0.0..=side).contains(position) {
                *drift = -*drift;
            }
        }
        rows(self.rotation, self.position)
    }
}

fn unit(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    q.map(|x| x / length)
}

fn product([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

/// The transform of a rotation and a position.
fn rows([w, x, y, z]: [f64; 4], [px, py, pz]: [f64; 3]) -> Rows {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y), px],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x), py],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y), pz],
    ]
}
