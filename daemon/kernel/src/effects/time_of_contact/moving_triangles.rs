//! Triangles at both ends of a span of time, and the pairs of them that may meet in it.

use glam::DVec3;

use super::body::MovingBody;
use super::span::Span;
use crate::cells::Cell;
use crate::submatrix::{MovingBox, MovingFrame, Which, Window};

/// Triangles of one body at both ends of a span. Of those with the same last bits of their numbers the latest is held.
#[derive(Debug)]
pub(super) struct MovingTriangles {
    /// Number of the triangle, and the span that it is of.
    held: Vec<(u32, u32)>,
    span: u32,
    boxes: Vec<MovingBox>,
    ends: Vec<[[DVec3; 3]; 2]>,
    /// As long as twice the area.
    normals: Vec<DVec3>,
    /// The triangles of a cell, each once.
    merged: Vec<u32>,
    /// Those of them that reach the other cell.
    reaching: Vec<Reaching>,
}

/// A triangle that reaches a cell.
#[derive(Debug, Clone, Copy)]
struct Reaching {
    /// Of what it has in both cells.
    bounds: MovingBox,
    number: u32,
    place: u32,
}

impl Default for MovingTriangles {
    fn default() -> Self {
        MovingTriangles {
            held: vec![(0, 0); MovingTriangles::HELD],
            span: 0,
            boxes: vec![MovingBox::default(); MovingTriangles::HELD],
            ends: vec![[[DVec3::ZERO; 3]; 2]; MovingTriangles::HELD],
            normals: vec![DVec3::ZERO; MovingTriangles::HELD],
            merged: Vec::new(),
            reaching: Vec::new(),
        }
    }
}

impl MovingTriangles {
    /// Triangles that are held at a time: few enough for the caches.
    const HELD: usize = 1 << 10;

    /// Begins with a span: the same numbers now mean other places.
    pub fn start(&mut self) {
        self.span = self.span.wrapping_add(1);
        if self.span == 0 {
            self.held.fill((0, 0));
            self.span = 1;
        }
    }

    /// The corners of a triangle at both ends.
    #[inline(always)]
    pub fn ends(&mut self, number: u32, at: &Carrier<'_>) -> &[[DVec3; 3]; 2] {
        let place = self.place(number, at);
        &self.ends[place]
    }

    /// Where the triangle is held.
    #[inline(always)]
    fn place(&mut self, number: u32, at: &Carrier<'_>) -> usize {
        let place = number as usize % Self::HELD;
        if self.held[place] != (number, self.span) {
            let ends = [0, 1].map(|end| at.body.corners(number, &at.span.rows[end][at.which as usize]));
            let [p, q, r] = ends[0];
            self.normals[place] = (q - p).cross(r - p);
            self.boxes[place] = at.frame.box_of(&ends);
            self.ends[place] = ends;
            self.held[place] = (number, self.span);
        }
        place
    }

    /// Finds the triangles of a cell that reach the other cell; says how many the cell has.
    fn gather(&mut self, cell: &Cell, own: &MovingBox, other: &MovingBox, window: &Window, at: &Carrier<'_>) -> usize {
        let matrix = at.body.object.matrix();
        let mut merged = std::mem::take(&mut self.merged);
        merged.clear();
        merged.extend_from_slice(matrix.triangles_in(cell));
        if usize::from(cell.rank) < matrix.lattice().cuts().len() {
            merged.sort_unstable();
            merged.dedup();
        }
        self.reaching.clear();
        for &number in &merged {
            let place = self.place(number, at);
            let bounds = self.boxes[place].over(window);
            if !bounds.is_apart_from(other) {
                let bounds = bounds.within(own).within(other);
                self.reaching.push(Reaching { bounds, number, place: place as u32 });
            }
        }
        self.merged = merged;
        self.merged.len()
    }

    /// The sum of the normals of what reaches the other cell.
    fn normal(&self) -> DVec3 {
        self.reaching.iter().map(|reaching| self.normals[reaching.place as usize]).sum()
    }

    /// Adds a direction to the boxes of what reaches the other cell; the box around all of them.
    fn turn_to(&mut self, direction: DVec3, window: &Window, frame: &MovingFrame) -> MovingBox {
        let mut all = MovingBox::EMPTY;
        for reaching in &mut self.reaching {
            frame.add_direction(&mut reaching.bounds, &self.ends[reaching.place as usize], direction, window);
            all = all.joined(&reaching.bounds);
        }
        all
    }

    /// Keeps what may meet a box.
    fn narrow(&mut self, other: &MovingBox) {
        self.reaching.retain(|reaching| !reaching.bounds.is_apart_from(other));
    }
}

/// What carries the triangles of a body.
#[derive(Clone, Copy)]
pub(super) struct Carrier<'c> {
    pub body: &'c MovingBody<'c>,
    pub which: Which,
    pub span: &'c Span,
    pub frame: &'c MovingFrame,
}

/// Calls `found` for the pairs of triangles of two cells whose boxes meet within the window; says how many pairs were compared.
pub(super) fn candidates(
    sides: &mut [MovingTriangles; 2],
    cells: &[Cell; 2],
    [a, b]: &[MovingBox; 2],
    window: &Window,
    carriers: &[Carrier<'_>; 2],
    mut found: impl FnMut([u32; 2], Window),
) -> u64 {
    let [first, second] = sides;
    let (a, b) = (&a.over(window), &b.over(window));
    let pairs =
        first.gather(&cells[0], a, b, window, &carriers[0]) * second.gather(&cells[1], b, a, window, &carriers[1]);
    // Surfaces that are about to meet face each other: along their normals they are apart the longest.
    let direction = (first.normal() - second.normal()).try_normalize().unwrap_or(DVec3::ZERO);
    let frame = carriers[0].frame;
    let (all_a, all_b) = (first.turn_to(direction, window, frame), second.turn_to(direction, window, frame));
    first.narrow(&all_b);
    second.narrow(&all_a);
    for p in &first.reaching {
        for q in &second.reaching {
            if let Some(meeting) = p.bounds.meet(&q.bounds, &Window::WHOLE) {
                found([p.number, q.number], window.within(&meeting));
            }
        }
    }
    pairs as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affine::{IDENTITY, Rows, world_vertex};
    use crate::container::MAX_ORDER;
    use crate::mesh::PolygonMesh;
    use crate::motion::Motion;
    use crate::object::Object;

    /// Numbers from -1 to 1 (Knuth, The Art of Computer Programming 2, section 3.3.4, line 26).
    struct Random(u64);

    impl Random {
        fn number(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn share(&mut self) -> f64 {
            0.5 * (1.0 + self.number())
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::from([0, 1, 2].map(|_| self.number()))
        }

        fn rows(&mut self, scale: f64) -> Rows {
            [0, 1, 2].map(|_| [0, 1, 2, 3].map(|_| scale * self.number()))
        }
    }

    /// A ball of many triangles, not quite round.
    fn ball(order: u32) -> Object {
        let at = |ring: u32, step: u32| {
            let (polar, turn) = (f64::from(ring) * 0.3 + 0.1, f64::from(step) * 0.5);
            [1.5 * polar.sin() * turn.cos(), polar.sin() * turn.sin(), 0.7 * polar.cos() + 0.01 * f64::from(step)]
        };
        let vertices = (0..130).map(|i| at(i / 13, i % 13)).collect();
        let faces = (0..9u32).flat_map(|ring| (0..12).map(move |step| 13 * ring + step));
        let polygons = faces.flat_map(|i| [[i, i + 1, i + 13], [i + 1, i + 14, i + 13]]);
        let polygons: Vec<[u32; 3]> = polygons.collect();
        Object::build(PolygonMesh::from_polygons(vertices, polygons), Some(order), &()).expect("a good mesh")
    }

    /// A point of a triangle, in the object's frame.
    #[derive(Clone, Copy)]
    struct Point {
        triangle: u32,
        at: DVec3,
    }

    impl Point {
        fn any(object: &Object, random: &mut Random) -> Point {
            let triangle = (random.share() * object.triangle_count() as f64) as u32 % object.triangle_count() as u32;
            let [p, q, r] = object.triangles()[triangle as usize].map(|v| DVec3::from(object.vertices()[v as usize]));
            let (i, j) = (random.share(), random.share());
            let (i, j) = if i + j > 1.0 { (1.0 - i, 1.0 - j) } else { (i, j) };
            Point { triangle, at: p + (q - p) * i + (r - p) * j }
        }

        /// Whether it is well within a cell.
        fn is_in(&self, cell: &Cell, object: &Object) -> bool {
            let lattice = object.matrix().lattice();
            let half = DVec3::from(lattice.half_sides());
            let share = DVec3::from(lattice.shares()[usize::from(cell.rank)].map(f64::from));
            let centre = DVec3::from(cell.centre.map(f64::from)) / f64::from(1u32 << MAX_ORDER);
            ((self.at - lattice.middle()) / half - centre).abs().cmplt(share - 1e-12).all()
        }
    }

    /// Goes down to the cells that hold two points which meet at `time`: no window on the way may leave it out.
    fn check(objects: [&Object; 2], motions: [&Motion; 2], points: [Point; 2], time: f64) {
        let [a, b] = [0, 1].map(|i| MovingBody::new(objects[i], motions[i]).expect("it has triangles"));
        let bodies = [&a, &b];
        let about = format!("{motions:?} at {time}");
        let span = Span::new(bodies, 0.0, 1.0);
        let containers = span.containers(bodies);
        let [from, until] = containers.window().unwrap_or_else(|| panic!("containers of {about}"));
        assert!(from <= time && time <= until, "containers of {about}");
        let mut frame = MovingFrame::default();
        frame.start(&containers);
        let mut sides = <[MovingTriangles; 2]>::default();
        sides.iter_mut().for_each(MovingTriangles::start);
        let (mut cells, mut window) = (objects.map(Cell::container), Window::WHOLE);
        let holds = |window: &Window| f64::from(window.from) <= time && time <= f64::from(window.until);
        loop {
            let boxes = [Which::First, Which::Second].map(|which| frame.cell_box(which, &cells[which as usize]));
            let carrier = |which: Which| Carrier { body: bodies[which as usize], which, span: &span, frame: &frame };
            let carriers = [carrier(Which::First), carrier(Which::Second)];
            let mut found = false;
            candidates(&mut sides, &cells, &boxes, &window, &carriers, |triangles, window| {
                found |= triangles == points.map(|point| point.triangle) && holds(&window);
            });
            assert!(found, "triangles {cells:?} of {about}");
            let open = |which: &Which| !frame.is_last(*which, &cells[*which as usize]);
            let larger = frame.larger(&cells);
            let Some(split) = [larger, larger.other()].into_iter().find(open) else { return };
            let (object, cell) = (objects[split as usize], cells[split as usize]);
            let (matrix, cut) = (object.matrix(), &object.matrix().lattice().cuts()[usize::from(cell.rank)]);
            let mut parts = matrix.parts(&cell);
            let along = frame.parts(split, parts.rank, cut, &cells);
            let mut next = None;
            let occupied = parts.occupied;
            for number in (0..8).filter(|part| occupied >> part & 1 == 1) {
                let bounds = matrix.bounds_of_part(&cell, &parts);
                let part = matrix.part(&cell, &parts, cut, number, bounds);
                if points[split as usize].is_in(&part, object) {
                    let found = along.part(number).and_then(|at| along.window(&at, &bounds, &window));
                    next = Some((part, found.unwrap_or_else(|| panic!("{part:?} of {about}"))));
                }
                parts.pass();
            }
            // On the border of two cells, nearly.
            let Some((part, left)) = next else { return };
            assert!(holds(&left), "{part:?} {left:?} of {about}");
            (cells[split as usize], window) = (part, left);
        }
    }

    /// The same rows, with a translation that takes a point to a place.
    fn brought(mut rows: Rows, point: DVec3, place: DVec3) -> Rows {
        rows.iter_mut().for_each(|row| row[3] = 0.0);
        let shift = place - world_vertex(&rows, point.to_array());
        (0..3).for_each(|axis| rows[axis][3] = shift[axis]);
        rows
    }

    #[test]
    fn points_that_meet_on_straight_lines_are_in_the_window_of_all_their_cells() {
        let objects = [ball(14), ball(9)];
        let mut random = Random(7);
        for round in 0..300 {
            let scale = [1.0, 1e-3, 1e6, 1e-150, 1e150][round % 5];
            let points = objects.each_ref().map(|object| Point::any(object, &mut random));
            let time = random.share();
            let mut rows: [Rows; 4] = [0; 4].map(|_| random.rows(scale));
            if round % 7 == 0 {
                // Flattened at its start.
                rows[2][1] = rows[2][0];
            }
            let [from, to, from_b, to_b] = rows;
            let to = if round % 3 == 0 { from } else { to };
            let at = |rows: &Rows| world_vertex(rows, points[0].at.to_array());
            let place = at(&from) * (1.0 - time) + at(&to) * time;
            let way = random.vector() * scale * if round % 2 == 0 { 100.0 } else { 1.0 };
            let second = Motion::Linear {
                from: brought(from_b, points[1].at, place - way * time),
                to: brought(to_b, points[1].at, place + way * (1.0 - time)),
            };
            let first = Motion::Linear { from, to };
            check(objects.each_ref(), [&first, &second], points, time);
            check([&objects[1], &objects[0]], [&second, &first], [points[1], points[0]], time);
        }
    }

    #[test]
    fn points_that_meet_on_circles_are_in_the_window_of_all_their_cells() {
        let objects = [ball(14), ball(9)];
        let mut random = Random(3);
        for round in 0..200 {
            let points = objects.each_ref().map(|object| Point::any(object, &mut random));
            let time = random.share();
            let motion = Motion::Rigid {
                from: random.rows(1.0),
                axis: random.vector().to_array(),
                centre: random.vector().to_array(),
                angle: [0.05, 0.5, 3.0, 20.0][round % 4] * random.number(),
                translate: random.vector().to_array(),
            };
            let place = world_vertex(&motion.at(time), points[0].at.to_array());
            let rests = Motion::Still(brought(random.rows(1.0), points[1].at, place));
            check(objects.each_ref(), [&motion, &rests], points, time);
        }
    }

    #[test]
    fn most_triangles_that_stay_apart_are_no_candidates() {
        let object = ball(9);
        let mut far = IDENTITY;
        far[0][3] = 2.9;
        let (rests, comes) = (Motion::Still(IDENTITY), Motion::Linear { from: far, to: far });
        let bodies = [&rests, &comes].map(|motion| MovingBody::new(&object, motion).expect("it has triangles"));
        let span = Span::new([&bodies[0], &bodies[1]], 0.0, 1.0);
        let mut frame = MovingFrame::default();
        frame.start(&span.containers([&bodies[0], &bodies[1]]));
        let carriers = [(0, Which::First), (1, Which::Second)].map(|(body, which)| Carrier {
            body: &bodies[body],
            which,
            span: &span,
            frame: &frame,
        });
        let mut sides = <[MovingTriangles; 2]>::default();
        sides.iter_mut().for_each(MovingTriangles::start);
        let (cells, mut found) = ([Cell::container(&object); 2], 0);
        let boxes = [Which::First, Which::Second].map(|which| frame.cell_box(which, &cells[which as usize]));
        let compared = candidates(&mut sides, &cells, &boxes, &Window::WHOLE, &carriers, |_, _| found += 1);
        assert!(found * 100 < compared, "{found} of {compared}");
    }
}
