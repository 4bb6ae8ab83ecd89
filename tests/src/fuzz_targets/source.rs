//! Numbers from the bytes of a fuzzer. Where the bytes end, zeros follow.

use collided_protocol::step::Rows;

/// Coordinates at which arithmetic goes wrong: the ends of the range of f64, the limits of the kernel's predicates, numbers
/// that are not what their digits say, and three that are no coordinates.
#[rustfmt::skip]
const SPECIAL: [f64; 32] = [
    -0.0, 5e-324, -5e-324, f64::MIN_POSITIVE, f64::MAX, f64::MIN, 1e300, -1e300,
    1e-300, 1e150, -1e150, 1e-150, 1e100, 1e-100, f64::EPSILON, 1.0 + f64::EPSILON,
    1.0 - f64::EPSILON / 2.0, 0.1, 0.2, 0.3, 0.7, 1.0 / 3.0, 1e16, 9007199254740993.0,
    2.037035976334486e90, 5.527147875260445e-76, 1e8, 1e-8, 1e308, f64::NAN, f64::INFINITY, f64::NEG_INFINITY,
];

/// Bytes that are taken as numbers, one after the other.
pub struct Source<'a> {
    rest: &'a [u8],
    last: f64,
}

impl<'a> Source<'a> {
    pub fn new(bytes: &'a [u8]) -> Source<'a> {
        Source { rest: bytes, last: 0.0 }
    }

    pub fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.rest.split_first() else { return 0 };
        self.rest = rest;
        first
    }

    /// 0 to `count − 1`; `count` is not 0.
    pub fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count
    }

    /// Most often a small number, so that special positions are frequent; any f64, NaN and infinity too.
    pub fn coordinate(&mut self) -> f64 {
        let tag = self.byte();
        let value = f64::from(tag & 31);
        self.last = match tag >> 5 {
            0..=2 => value % 8.0 - 3.0,
            3 => (value - 16.0) / 4.0,
            4 => SPECIAL[usize::from(tag & 31)],
            5 => self.beside_last(tag & 31),
            // In two factors, for 2^-1024 is not a normal number.
            6 => self.last * 2f64.powi(4 * i32::from(self.byte() as i8)) * 2f64.powi(4 * (i32::from(tag & 31) - 16)),
            _ => f64::from_le_bytes([0; 8].map(|_: u8| self.byte())),
        };
        self.last
    }

    /// A neighbour of the last coordinate, or its opposite.
    fn beside_last(&self, which: u8) -> f64 {
        match which % 6 {
            0 => self.last.next_up(),
            1 => self.last.next_down(),
            2 => self.last.next_up().next_up(),
            3 => self.last.next_down().next_down(),
            4 => -self.last,
            _ => self.last,
        }
    }

    pub fn point(&mut self) -> [f64; 3] {
        [0; 3].map(|_| self.coordinate())
    }

    /// An affine map, singular or not, and not always finite.
    pub fn transform(&mut self) -> Rows {
        let linear = match self.byte() % 4 {
            0 => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            1 => self.exchanged_axes(),
            // Singular: the rows are multiples of one.
            2 => {
                let row = self.point();
                self.point().map(|factor| row.map(|entry| factor * entry))
            }
            _ => [0; 3].map(|_| self.point()),
        };
        linear.map(|[x, y, z]| [x, y, z, self.coordinate()])
    }

    /// A permutation of the axes, each of them scaled.
    fn exchanged_axes(&mut self) -> [[f64; 3]; 3] {
        let (first, scales) = (self.below(3), self.point());
        let mut linear = [[0.0; 3]; 3];
        for (row, scale) in scales.into_iter().enumerate() {
            linear[row][(first + row) % 3] = scale;
        }
        linear
    }

    /// Most often a small number; after the byte 255 any.
    pub fn number(&mut self) -> u64 {
        match self.byte() {
            255 => u64::from_le_bytes([0; 8].map(|_: u8| self.byte())),
            byte => u64::from(byte),
        }
    }

    /// What has not been taken.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }
}
