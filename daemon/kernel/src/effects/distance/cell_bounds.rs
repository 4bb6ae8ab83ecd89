//! How near the polygons of two cells can be.
//!
//! A point of one less a point of the other is `c + Σ tᵢ·gᵢ`, tᵢ from −1 to 1, where c goes from the centre of one
//! [shape](crate::cell_shapes) to that of the other and the gᵢ are their six half sides, all in the world. For any vector f,
//! `(f·c − Σ|f·gᵢ|) / |f|` is a bound of the distance, and a tight one when f points from one nearest point to the other. Such an f is what
//! is left of c when each gᵢ in turn has taken off it what it can, once: the first round of Hildreth, "A quadratic programming
//! procedure", 1957. (A second round opens a tenth fewer cells and costs more than that.) No inverse is needed, and whatever f is, the bound holds: any affine map is served, singular ones too.
//!
//! The parts of a cell are bounded four at a time, in f32.
//!
//! # Why it is a bound
//! Lengths are multiplied by a power of two so that the world box of both bodies has a longest side of 2 to 4. The centres of two cells are
//! taken from each other in f64. Roundings there, of 2^-53 of the magnitudes of both bodies along an axis: 5 in the middles (3 in the
//! map, 2 in the middle itself), 8 in the places of the centres (half a side, product, place, five sums), 2 in the sums of
//! both; what rounding moves vertices by, 5 ([`rounding_bound`](crate::affine::rounding_bound)), and planes, 6. [`SLACK`] is more than twice
//! their sum; underflow is far below [`UNDERFLOW`] times (4 + what it is multiplied by), as in [`submatrix`](crate::submatrix).
//! Both together are [`CellBounds::noise`], which whoever compares a bound adds to the other side.
//!
//! In f32, u = 2^-24. With D what lies between the centres of the two cells and R what both reach (the sums of magnitudes of their half
//! sides; a slanted shape reaches at most 3R from the centre of its cell), c is within 8u·(D + 3R) of its place and the gᵢ are within
//! 4u·3R. The products f·c and f·gᵢ and their sum pass 11 roundings, |f| and the quotient 4: in all less than 120u·(D + R), of
//! which [`F32_ROUNDING`] is more. Where f is so short that its square underflows, it is divided by something longer than |f|.
//!
//! # Bodies far apart for their size
//! Beside a distance of many times what the bodies reach, these f32 roundings are larger than what one cell is nearer than another. There f is
//! the direction d between the middles for all cells: it differs from the best one by an angle of reach/distance at most, so a bound is
//! below the distance by reach²/(2·distance) more. And what lies between two cells is counted from a distance s along d
//! on, less than that of any two points: the difference is taken in f64, and D and R above are of the size of the bodies. What f64
//! rounds in d, s and the difference is less than 16·2^-53 of the 1-norm of what is between the middles; [`FAR_SLACK`] is twice as much.

use glam::{DVec3, Mat4, Vec4};

use crate::cell_shapes::CellShape;
use crate::cells::{Cell, MAX_RANKS};
use crate::container::MAX_ORDER;
use crate::submatrix::{Placed, UNDERFLOW, Which, columns, reach};

const SLACK: f64 = 64.0 * (f64::EPSILON / 2.0);
/// 2^-17.
const F32_ROUNDING: f32 = 1.0 / (1 << 17) as f32;
/// 2^-30.
const UNIT: f64 = 1.0 / (1u64 << MAX_ORDER) as f64;

const FAR_SLACK: f64 = 32.0 * (f64::EPSILON / 2.0);
/// Bodies are far apart when their middles are so many times what they reach: from about there on the search is faster so.
const FAR: f64 = 64.0;

/// The square of this is far above what underflows.
const SHORTEST: f32 = 1e-15;

/// Parts that are bounded together.
pub(super) const LANES: usize = 4;

/// What one body contributes.
#[derive(Debug, Clone, Default)]
struct Side {
    /// Half the sides of the container in the world times 2^-30.
    steps: [DVec3; 3],
    /// Half the sides of the container in the world, counted on after the third.
    sides: [Vec4; 5],
    /// Per rank: what a cell reaches from its centre, in sum.
    reach: [f32; MAX_RANKS],
    /// Per rank: the longest side of a cell in the world, roughly; decides which cell is cut.
    size: [f32; MAX_RANKS],
    /// The rank at which the descent ends: see `Side` in [`submatrix`](crate::submatrix).
    depth: usize,
}

/// A pair of placed bodies, ready for bounding the distance of their cells. Kept from pair to pair for its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct CellBounds {
    sides: [Side; 2],
    /// From the middle of the first container to that of the second.
    between: DVec3,
    /// What rounding may take from a distance.
    pub noise: f64,
    /// How bodies far apart are looked at.
    pub afar: Option<Afar>,
}

/// Where bodies are far apart, what matters is how far their points reach along one direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Afar {
    /// From the one body to the other, of length 1.
    pub direction: DVec3,
    /// Bounds are counted from this distance on, which is no more than that of any two points, but for the noise.
    pub from: f64,
    /// What both bodies reach from their middles, in sum.
    pub reach: f64,
}

/// A vector in each lane.
#[derive(Debug, Clone, Copy, Default)]
struct Vectors {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl Vectors {
    #[inline(always)]
    fn each(&[a, b, c, d]: &[Vec4; LANES]) -> Vectors {
        let by_axis = Mat4::from_cols(a, b, c, d).transpose();
        Vectors { x: by_axis.x_axis, y: by_axis.y_axis, z: by_axis.z_axis }
    }

    #[inline(always)]
    fn all(vector: Vec4) -> Vectors {
        Vectors { x: Vec4::splat(vector.x), y: Vec4::splat(vector.y), z: Vec4::splat(vector.z) }
    }

    #[inline(always)]
    fn dot(&self, other: &Vectors) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    fn less(&self, other: &Vectors, times: Vec4) -> Vectors {
        Vectors { x: self.x - other.x * times, y: self.y - other.y * times, z: self.z - other.z * times }
    }
}

/// The parts of a cell, as seen from a cell of the other body.
pub(super) struct PartsSeen<'b> {
    side: &'b Side,
    /// Half the sides of its container, of the first body the other way round.
    signed: [Vec4; 3],
    /// From the one cell's shape to the other cell.
    base: Vec4,
    /// Half sides of the other cell's shape.
    beside: [Vectors; 3],
    /// 1 over their squares.
    inverse: [Vec4; 3],
    /// Of bodies far apart: the direction of all bounds.
    direction: Option<Vectors>,
    rounding: f32,
}

impl CellBounds {
    /// Makes ready for a pair; all lengths will be in world units times `scale`, a power of two.
    pub fn start(&mut self, a: Placed<'_>, b: Placed<'_>, scale: f64) {
        let magnitude = a.magnitude * scale + b.magnitude * scale;
        let coordinates = [a, b].map(|placed| {
            reach(placed.object).iter().sum::<f64>()
                + columns(placed.rows).map(|column| column.abs().element_sum()).iter().sum::<f64>()
        });
        self.noise = magnitude.element_sum() * SLACK + UNDERFLOW * (4.0 + coordinates[0] + coordinates[1]) * scale;
        let middles = [a, b].map(|placed| middle(placed) * scale);
        self.between = middles[1] - middles[0];
        for (side, placed) in self.sides.iter_mut().zip([a, b]) {
            side.start(placed, scale, self.noise);
        }
        self.look_from_afar();
    }

    fn look_from_afar(&mut self) {
        let length = self.between.length();
        let reach = self.sides.iter().map(|side| f64::from(side.reach[0])).sum();
        self.afar = (length > FAR * reach).then(|| {
            let direction = self.between / length;
            let along = |side: &Side| side.steps.map(|step| direction.dot(step).abs()).iter().sum::<f64>() / UNIT;
            let from = direction.dot(self.between) - self.sides.iter().map(along).sum::<f64>();
            Afar { direction, from, reach }
        });
        if self.afar.is_some() {
            self.noise += self.between.abs().element_sum() * FAR_SLACK;
        }
    }

    /// The distance that bounds are counted from.
    pub fn from(&self) -> f64 {
        self.afar.map_or(0.0, |afar| afar.from)
    }

    /// Whether the descent ends at this cell of `which`.
    #[inline(always)]
    pub fn is_last(&self, which: Which, cell: &Cell) -> bool {
        usize::from(cell.rank) >= self.sides[which as usize].depth
    }

    /// Which of two cells is larger in the world.
    #[inline(always)]
    pub fn larger(&self, [a, b]: &[Cell; 2]) -> Which {
        let size = |which: Which, cell: &Cell| self.sides[which as usize].size[usize::from(cell.rank)];
        if size(Which::First, a) >= size(Which::Second, b) { Which::First } else { Which::Second }
    }

    /// The cell `split` of a pair, about to be cut, as seen from the other one, whose shape is `beside`.
    #[inline(always)]
    pub fn parts(&self, split: Which, cells: &[Cell; 2], beside: &CellShape) -> PartsSeen<'_> {
        let [first, second] = &self.sides;
        let mut between = self.between;
        for axis in 0..3 {
            let [a, b] = [0, 1].map(|body: usize| f64::from(cells[body].centre[axis]));
            between += second.steps[axis] * b - first.steps[axis] * a;
        }
        if let Some(Afar { direction, from, .. }) = self.afar {
            between -= direction * from;
        }
        let between = between.as_vec3().extend(0.0);
        let (side, other) = (&self.sides[split as usize], &self.sides[split.other() as usize]);
        let sign = if split == Which::Second { 1.0 } else { -1.0 };
        let [x, y, z] = beside.centre;
        let [a, b, c, ..] = &other.sides;
        let centre = *a * x + *b * y + *c * z;
        let [first, second, third] = other.halves(beside);
        let inverse = |half: Vec4| Vec4::splat(1.0 / (half.dot(half) + f32::MIN_POSITIVE));
        let [i, j, k, ..] = &side.sides;
        let reach = side.reach[usize::from(cells[split as usize].rank)]
            + other.reach[usize::from(cells[split.other() as usize].rank)];
        PartsSeen {
            side,
            signed: [*i * sign, *j * sign, *k * sign],
            base: between - centre * sign,
            beside: [Vectors::all(first), Vectors::all(second), Vectors::all(third)],
            inverse: [inverse(first), inverse(second), inverse(third)],
            direction: self.afar.map(|afar| Vectors::all(afar.direction.as_vec3().extend(0.0))),
            rounding: (between.abs().element_sum() + reach) * F32_ROUNDING,
        }
    }
}

/// Up to four parts in the world, as a [`PartsSeen`] places them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lanes {
    /// From the centre of the one body's shape to that of the other's.
    centres: [Vec4; LANES],
    halves: [[Vec4; LANES]; 3],
}

impl PartsSeen<'_> {
    /// Puts a part into a lane: where its cell is, seen from that of the cell it is cut from, and its shape.
    #[inline(always)]
    pub fn put(&self, lanes: &mut Lanes, lane: usize, [x, y, z]: [i32; 3], shape: &CellShape) {
        const UNIT: f32 = self::UNIT as f32;
        let [i, j, k] = shape.centre;
        let (x, y, z) = (x as f32 * UNIT + i, y as f32 * UNIT + j, z as f32 * UNIT + k);
        let [a, b, c] = &self.signed;
        lanes.centres[lane] = self.base + *a * x + *b * y + *c * z;
        let [first, second, third] = self.side.halves(shape);
        lanes.halves[0][lane] = first;
        lanes.halves[1][lane] = second;
        lanes.halves[2][lane] = third;
    }

    /// How far apart the parts in the lanes are at least, from [`CellBounds::from`] on.
    #[inline(always)]
    pub fn bounds(&self, lanes: &Lanes) -> [f32; LANES] {
        let centre = Vectors::each(&lanes.centres);
        let [i, j, k] = &lanes.halves;
        let (i, j, k) = (Vectors::each(i), Vectors::each(j), Vectors::each(k));
        let [p, q, r] = &self.beside;
        let rest = self.direction.unwrap_or_else(|| self.rest(centre, [&i, &j, &k]));
        let gap = rest.dot(&centre) - rest.dot(p).abs() - rest.dot(q).abs() - rest.dot(r).abs();
        let gap = gap - rest.dot(&i).abs() - rest.dot(&j).abs() - rest.dot(&k).abs();
        (gap / rest.dot(&rest).sqrt().max(Vec4::splat(SHORTEST)) - self.rounding).to_array()
    }
}

impl PartsSeen<'_> {
    /// What is left of what lies between the centres when each half side has taken off what it can.
    #[inline(always)]
    fn rest(&self, centre: Vectors, halves: [&Vectors; 3]) -> Vectors {
        let mut rest = centre;
        for (side, inverse) in self.beside.iter().zip(&self.inverse) {
            take(&mut rest, side, *inverse);
        }
        for side in halves {
            take(&mut rest, side, Vec4::ONE / (side.dot(side) + Vec4::splat(f32::MIN_POSITIVE)));
        }
        rest
    }
}

/// Takes off `rest` as much of `side` as makes it shortest, from −1 to 1 times.
#[inline(always)]
fn take(rest: &mut Vectors, side: &Vectors, inverse: Vec4) {
    let times = (rest.dot(side) * inverse).max(Vec4::NEG_ONE).min(Vec4::ONE);
    *rest = rest.less(side, times);
}

impl Side {
    fn start(&mut self, placed: Placed<'_>, scale: f64, noise: f64) {
        let lattice = placed.object.matrix().lattice();
        let half = lattice.half_sides();
        let columns = columns(placed.rows);
        let sides = [0, 1, 2].map(|axis| columns[axis] * half[axis] * scale);
        self.steps = sides.map(|side| side * UNIT);
        self.sides = [0, 1, 2, 0, 1].map(|axis| sides[axis].as_vec3().extend(0.0));
        let [sums, longest] =
            [DVec3::element_sum, DVec3::max_element].map(|of| sides.map(|side| of(side.abs()) as f32));
        for (rank, shares) in lattice.shares().iter().enumerate() {
            let scaled = |lengths: &[f32; 3]| [0, 1, 2].map(|axis| lengths[axis] * shares[axis]);
            self.reach[rank] = scaled(&sums).iter().sum();
            self.size[rank] = scaled(&longest).into_iter().fold(0.0, f32::max);
        }
        let last = lattice.cuts().len();
        let small = (noise as f32).max(self.size[last]);
        self.depth = (0..last).find(|&rank| self.size[rank] <= small).unwrap_or(last);
    }

    /// The half sides of a shape in the world.
    #[inline(always)]
    fn halves(&self, shape: &CellShape) -> [Vec4; 3] {
        let at = shape.axis as usize;
        let (axis, second, third) = (self.sides[at], self.sides[at + 1], self.sides[at + 2]);
        let ([h, i, j], [s, t]) = (shape.halves, shape.slopes);
        [(second + axis * s) * h, (third + axis * t) * i, axis * j]
    }
}

/// The middle of a container in the world.
fn middle(placed: Placed<'_>) -> DVec3 {
    let (at, rows) = (placed.object.matrix().lattice().middle(), placed.rows);
    crate::affine::world_vertex(rows, at.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affine::{Rows, magnitude, world_vertex};
    use crate::cell_boxes::CellBox;
    use crate::mesh::PolygonMesh;
    use crate::object::Object;
    use crate::polygon_box::bits_of;

    /// A closed surface with flat and steep faces, needles among them.
    fn object(order: u32) -> Object {
        let vertices = vec![[0.0, 0.0, 0.0], [3.0, 0.1, 0.0], [0.2, 2.0, 0.1], [0.1, 0.3, 1.0], [1.5, 1.0, 0.7]];
        let faces = [[0, 2, 1], [0, 1, 3], [3, 1, 4], [1, 2, 4], [2, 3, 4], [0, 3, 2]];
        Object::build(PolygonMesh::from_polygons(vertices, faces), Some(order), &()).expect("a good mesh")
    }

    /// Points of the surface, in the object's frame.
    fn sampled(object: &Object) -> Vec<[f64; 3]> {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| DVec3::from(object.vertices()[vertex as usize]));
        let points = |[a, b, c]: [DVec3; 3]| {
            let point = move |i: usize, j: usize| a + (b - a) * (i as f64 / 12.0) + (c - a) * (j as f64 / 12.0);
            (0..=12).flat_map(move |i| (0..=12 - i).map(move |j| point(i, j).to_array()))
        };
        object.triangles().iter().map(corners).flat_map(points).collect()
    }

    /// The cells of a rank, or of the next one where the matrix has none of it, with the numbers of their shapes.
    fn cells(object: &Object, rank: u8) -> Vec<(Cell, u32)> {
        let (mut open, mut found) = (vec![(Cell::container(object), 0)], Vec::new());
        while let Some((cell, shape)) = open.pop() {
            if cell.rank >= rank { found.push((cell, shape)) } else { open.extend(parts(object, &cell)) }
        }
        found
    }

    /// The parts of a cell, with the numbers of their shapes.
    fn parts(object: &Object, cell: &Cell) -> Vec<(Cell, u32)> {
        let (matrix, shapes) = (object.matrix(), object.shapes());
        let (mut parts, mut found) = (matrix.parts(cell), Vec::new());
        for part in bits_of(parts.occupied.into()) {
            let cut = &matrix.lattice().cuts()[usize::from(cell.rank)];
            let next = matrix.part(cell, &parts, cut, part as usize, CellBox::WHOLE);
            found.push((next, shapes.number(cell, parts.next())));
            parts.pass();
        }
        found
    }

    /// Which of these points of an object are in a cell of it.
    fn points_in(object: &Object, cell: &Cell, points: &[[f64; 3]]) -> Vec<usize> {
        let lattice = object.matrix().lattice();
        let shares = lattice.shares()[usize::from(cell.rank)];
        let is_in = |&point: &usize| {
            (0..3).all(|axis| {
                let at = (points[point][axis] - lattice.middle()[axis]) / lattice.half_sides()[axis];
                (at - f64::from(cell.centre[axis]) * UNIT).abs() <= f64::from(shares[axis])
            })
        };
        (0..points.len()).filter(is_in).collect()
    }

    /// Bounds of all parts of the cells of one rank beside the cells of another, against the distances of points in them; says the
    /// share of bounds that are within half of the distance.
    fn check(maps: [Rows; 2], ranks: [u8; 2], split: Which) -> f64 {
        let objects = [object(12), object(9)];
        let points = objects.each_ref().map(sampled);
        let world: [Vec<DVec3>; 2] =
            std::array::from_fn(|i| points[i].iter().map(|&point| world_vertex(&maps[i], point)).collect());
        let corners = || world.iter().flatten().copied();
        let size = (corners().reduce(DVec3::max).unwrap() - corners().reduce(DVec3::min).unwrap()).max_element();
        let scale = 2f64.powi(-size.log2().floor() as i32);
        let placed = [0, 1].map(|i| Placed {
            object: &objects[i],
            rows: &maps[i],
            magnitude: magnitude(&maps[i], objects[i].matrix().lattice().container().reach()),
        });
        let mut bounds = CellBounds::default();
        bounds.start(placed[0], placed[1], scale);
        let (one, other) = (split as usize, split.other() as usize);
        let (mut count, mut tight) = (0.0, 0.0);
        for (parent, _) in cells(&objects[one], ranks[one]) {
            for (beside, shape) in cells(&objects[other], ranks[other]) {
                let near = points_in(&objects[other], &beside, &points[other]);
                let mut pair = [parent, beside];
                pair.swap(0, one);
                let seen = bounds.parts(split, &pair, objects[other].shapes().of(shape));
                for (part, number) in parts(&objects[one], &parent) {
                    let mut lanes = Lanes::default();
                    let from_parent = [0, 1, 2].map(|axis| part.centre[axis] - parent.centre[axis]);
                    let shape = objects[one].shapes().of(number);
                    (0..LANES).for_each(|lane| seen.put(&mut lanes, lane, from_parent, shape));
                    let least = seen.bounds(&lanes);
                    assert!(least.iter().all(|bound| bound.to_bits() == least[0].to_bits()));
                    let own = points_in(&objects[one], &part, &points[one]);
                    let pairs = own.iter().flat_map(|&p| near.iter().map(move |&q| (p, q)));
                    let distances = pairs.map(|(p, q)| ((world[one][p] - world[other][q]) * scale).length());
                    let distance = distances.fold(f64::INFINITY, f64::min);
                    let bound = bounds.from() + f64::from(least[0]);
                    assert!(
                        bound.is_nan() || bound <= distance + bounds.noise,
                        "{bound} {distance} {maps:?} {ranks:?}"
                    );
                    if distance < f64::INFINITY {
                        (count, tight) = (count + 1.0, tight + f64::from(u8::from(bound > 0.5 * distance)));
                    }
                }
            }
        }
        tight / count
    }

    const TURNED: Rows = [[0.36, 0.48, -0.8, 0.3], [-0.8, 0.6, 0.0, 4.0], [0.48, 0.64, 0.6, 1.0]];

    /// So far from another one that stands there.
    fn away(distance: f64, from_origin: f64) -> Rows {
        let mut rows = TURNED;
        rows.iter_mut().zip([0.6, -0.5, 0.62]).for_each(|(row, along)| row[3] = from_origin + distance * along);
        rows
    }

    #[test]
    fn no_bound_exceeds_the_distance_of_points_in_the_cells() {
        let scaled = |rows: Rows, factor: f64| rows.map(|row| row.map(|entry| entry * factor));
        let still = crate::affine::IDENTITY;
        let maps = [
            [still, TURNED],
            [still, still],
            // Sheared, mirrored and of unlike scale; flattened; to a line; to a point.
            [[[1.0, 5.0, 0.0, 0.0], [0.0, -1e-3, 0.0, 3.0], [0.2, 0.0, 30.0, 0.0]], TURNED],
            [[[1.0, 0.0, 1.0, -4.0], [0.0, 1.0, 1.0, 0.0], [0.0; 4]], TURNED],
            [[[1.0, 2.0, 3.0, 9.0], [1.0, 2.0, 3.0, 0.0], [0.0, 0.0, 0.0, 1.0]], still],
            [[[0.0, 0.0, 0.0, 9.0], [0.0; 4], [0.0; 4]], TURNED],
            // Far from the origin, huge, tiny.
            [[still[0], still[1], [0.0, 0.0, 1.0, 1e9]], [TURNED[0], TURNED[1], [0.48, 0.64, 0.6, 1e9 + 4.0]]],
            [scaled(still, 1e150), scaled(TURNED, 1e150)],
            [scaled(still, 1e-250), scaled(TURNED, 1e-250)],
            [scaled(still, 1e-12), TURNED],
            // Far apart, and far from the origin as well.
            [still, away(1e4, 0.0)],
            [still, away(1e7, 0.0)],
            [scaled(still, 1e-3), away(1e12, 0.0)],
            [away(1.0, 1e10), away(1e4, 1e10)],
        ];
        for maps in maps {
            for ranks in [[0, 0], [1, 0], [2, 1], [1, 2]] {
                check(maps, ranks, Which::First);
                check([maps[1], maps[0]], ranks, Which::Second);
            }
        }
    }

    #[test]
    fn most_bounds_of_small_cells_are_tight() {
        let tight = check([crate::affine::IDENTITY, TURNED], [2, 2], Which::First);
        assert!(tight > 0.9, "{tight}");
    }

    #[test]
    fn bounds_of_bodies_far_apart_tell_their_cells_apart() {
        let objects = [object(12), object(9)];
        for distance in [3e3, 1e6, 1e9] {
            let maps = [crate::affine::IDENTITY, away(distance, 0.0)];
            let placed = [0, 1].map(|i| super::super::placed((&objects[i], &maps[i])));
            let scale = 2f64.powi(-distance.log2().floor() as i32);
            let mut bounds = CellBounds::default();
            bounds.start(placed[0], placed[1], scale);
            let containers = [0, 1].map(|i| Cell::container(&objects[i]));
            let seen = bounds.parts(Which::First, &containers, objects[1].shapes().of(0));
            let bound = |(part, number): (Cell, u32)| {
                let mut lanes = Lanes::default();
                seen.put(&mut lanes, 0, part.centre, objects[0].shapes().of(number));
                f64::from(seen.bounds(&lanes)[0]) / scale
            };
            let mut least: Vec<f64> = parts(&objects[0], &containers[0]).into_iter().map(bound).collect();
            least.sort_by(f64::total_cmp);
            let (nearest, farthest) = (least[0], least[least.len() - 1]);
            // Of a body 3 long.
            assert!(nearest > -0.01 && farthest - nearest > 0.5 && farthest < 9.0, "{distance}: {least:?}");
        }
    }
}
