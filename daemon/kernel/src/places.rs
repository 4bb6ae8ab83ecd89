//! Stage 1: where the bodies are, and where a step takes them.
//!
//! An entry a body in each list: a step goes through all of them, and reads no more of a body than it needs.

use glam::DVec3;

use crate::affine::{IDENTITY, Rows};
use crate::container::Container;
use crate::global_boxes::GlobalBox;
use crate::motion::Motion;
use crate::object::Object;
use crate::path::displacement;
use crate::scene::Body;
use crate::step::Limit;
use crate::transforms::{RigidMotion, StepError, check_transform};

/// Where the bodies of a scene are.
#[derive(Debug, Default)]
pub(crate) struct Places {
    rows: Vec<Rows>,
    /// See [`magnitude`](crate::affine::magnitude); over the object's vertices.
    magnitudes: Vec<DVec3>,
    /// What a step brings, until all of it is checked; afterwards, where those bodies were before.
    staged: Vec<Rows>,
    staged_magnitudes: Vec<DVec3>,
    extents: Vec<Extent>,
    history: Vec<History>,
    boxes: Vec<GlobalBox>,
    /// Bodies that the step under way names; all of them, in a dense step.
    named: Named,
    /// Whether a body has another object since the last step.
    any_replaced: bool,
    /// Whether a body may have no box where it is.
    any_without_box: bool,
}

/// Which bodies a step names.
#[derive(Debug, Default)]
struct Named {
    all: bool,
    some: Vec<u32>,
}

/// What a body takes up in its own frame: copied from its object, to be at hand.
#[derive(Debug, Clone, Copy)]
struct Extent {
    container: Option<Container>,
    /// The largest magnitude of each coordinate over all vertices, used or not.
    reach: [f64; 3],
}

impl Extent {
    fn of(object: &Object) -> Extent {
        Extent { container: object.container(), reach: object.reach() }
    }
}

/// Steps at which something happened to a body.
#[derive(Debug, Clone, Copy)]
struct History {
    /// The step that last brought it a transform.
    staged: u64,
    /// The step that first placed it.
    first: u64,
    /// The step that last moved it, or gave it another object.
    changed: u64,
    /// The step that last gave it another object.
    exchanged: u64,
    /// Where the rigid motion that ends at `staged` stands in the scene's list.
    rigid: Option<u32>,
    /// Whether the object is new since the last step.
    replaced: bool,
    /// Whether what was staged is not where the body is.
    moves: bool,
    /// Whether its global bounding box is that of where it is.
    has_box: bool,
}

const NEVER: u64 = u64::MAX;

impl Places {
    pub fn add(&mut self, object: &Object) {
        self.rows.push(IDENTITY);
        self.staged.push(IDENTITY);
        self.magnitudes.push(DVec3::ZERO);
        self.staged_magnitudes.push(DVec3::ZERO);
        self.extents.push(Extent::of(object));
        self.history.push(History {
            staged: 0,
            first: NEVER,
            changed: NEVER,
            exchanged: NEVER,
            rigid: None,
            replaced: true,
            moves: false,
            has_box: false,
        });
        self.boxes.push(GlobalBox::EMPTY);
        (self.any_replaced, self.any_without_box) = (true, true);
    }

    pub fn remove(&mut self, at: usize) {
        self.rows.remove(at);
        self.staged.remove(at);
        self.magnitudes.remove(at);
        self.staged_magnitudes.remove(at);
        self.extents.remove(at);
        self.history.remove(at);
        self.boxes.remove(at);
    }

    /// A body has another object; it stays where it is.
    pub fn replace(&mut self, at: usize, object: &Object) {
        self.extents[at] = Extent::of(object);
        self.history[at].replaced = true;
        self.any_replaced = true;
    }

    pub fn rows(&self, body: u32) -> &Rows {
        &self.rows[body as usize]
    }

    pub fn magnitude(&self, body: u32) -> DVec3 {
        self.magnitudes[body as usize]
    }

    /// The global bounding boxes.
    pub fn boxes(&self) -> &[GlobalBox] {
        &self.boxes
    }

    /// The container of a body's object; `None` when it has no polygon.
    pub fn container(&self, body: u32) -> Option<&Container> {
        self.extents[body as usize].container.as_ref()
    }

    /// Whether this step is the first to place the body.
    pub fn is_new(&self, body: u32, step: u64) -> bool {
        self.history[body as usize].first == step
    }

    /// Whether the body is since the end of a step where it was then, and has the same object.
    pub fn rests_since_end_of(&self, body: u32, step: u64) -> bool {
        self.history[body as usize].changed <= step
    }

    /// Whether it was so within that step, too.
    pub fn rests_since_start_of(&self, body: u32, step: u64) -> bool {
        self.history[body as usize].changed < step
    }

    /// Whether this step has given the body another object, or its first one.
    pub fn is_exchanged(&self, body: u32, step: u64) -> bool {
        self.history[body as usize].exchanged == step
    }

    /// A step begins that names all bodies: reads each transform once, and checks it.
    pub fn stage_all(&mut self, bodies: &[Body], rows: &[Rows], step: u64) -> Result<(), StepError> {
        self.named.all = true;
        self.named.some.clear();
        for (at, (body, rows)) in bodies.iter().zip(rows).enumerate() {
            self.bring(at, *rows, None, step);
            self.check(at, body)?;
        }
        Ok(())
    }

    /// A step begins that names bodies one by one.
    pub fn stage_some(&mut self) {
        self.named.all = false;
        self.named.some.clear();
    }

    /// One of them; false when the step has named it before. It is checked later.
    #[must_use]
    pub fn stage_one(&mut self, at: usize, rows: Rows, rigid: Option<u32>, step: u64) -> bool {
        let is_first = self.history[at].staged != step;
        if is_first {
            self.bring(at, rows, rigid, step);
            self.named.some.push(at as u32);
        }
        is_first
    }

    fn bring(&mut self, at: usize, rows: Rows, rigid: Option<u32>, step: u64) {
        self.staged[at] = rows;
        let history = &mut self.history[at];
        (history.staged, history.rigid) = (step, rigid);
    }

    /// Checks what was staged one by one, and bodies that have another object.
    pub fn check_some(&mut self, bodies: &[Body], step: u64) -> Result<(), StepError> {
        if self.any_replaced && !self.named.all {
            for at in 0..bodies.len() {
                let _ = self.history[at].replaced && self.stage_one(at, self.rows[at], None, step);
            }
        }
        for place in 0..self.named.some.len() {
            let at = self.named.some[place] as usize;
            self.check(at, &bodies[at])?;
        }
        Ok(())
    }

    /// Whether the body moves to where it was staged, and its magnitude there.
    #[inline]
    fn check(&mut self, at: usize, body: &Body) -> Result<(), StepError> {
        let (rows, history) = (&self.staged[at], &mut self.history[at]);
        history.moves = history.replaced || history.rigid.is_some() || differ(rows, &self.rows[at]);
        self.staged_magnitudes[at] =
            if history.moves { check_transform(body, self.extents[at].reach, rows)? } else { self.magnitudes[at] };
        Ok(())
    }

    /// Whether a body can be placed so; its magnitude there.
    pub fn check_at(&self, at: usize, body: &Body, rows: &Rows) -> Result<DVec3, StepError> {
        check_transform(body, self.extents[at].reach, rows)
    }

    /// Moves the bodies, and computes their boxes as long as the budget lasts; says how many. What was staged now holds where a body was
    /// before.
    pub fn commit(&mut self, step: u64, limit: &Limit<'_>) -> u64 {
        if self.named.all {
            // Those that rest have the same in both.
            std::mem::swap(&mut self.rows, &mut self.staged);
            std::mem::swap(&mut self.magnitudes, &mut self.staged_magnitudes);
            self.history.iter_mut().for_each(|history| history.move_in(step));
        } else {
            for &at in &self.named.some {
                let at = at as usize;
                std::mem::swap(&mut self.rows[at], &mut self.staged[at]);
                std::mem::swap(&mut self.magnitudes[at], &mut self.staged_magnitudes[at]);
                self.history[at].move_in(step);
            }
        }
        self.any_replaced = false;
        self.compute_boxes(limit)
    }

    /// The boxes of the bodies that have none where they are.
    fn compute_boxes(&mut self, limit: &Limit<'_>) -> u64 {
        /// Boxes between two looks at the budget: about a microsecond.
        const SLICE: u64 = 32;
        let all = self.named.all || self.any_without_box;
        let candidates = if all { self.rows.len() } else { self.named.some.len() };
        let mut count = 0;
        self.any_without_box = false;
        for candidate in 0..candidates {
            let at = if all { candidate } else { self.named.some[candidate] as usize };
            if self.history[at].has_box {
                continue;
            }
            if limit.is_up() || count % SLICE == SLICE - 1 && limit.spend(SLICE) {
                self.any_without_box = true;
                break;
            }
            self.boxes[at] = self.box_at(at, &self.rows[at]);
            self.history[at].has_box = true;
            count += 1;
        }
        count
    }

    /// The global bounding box of a body at a transform.
    pub fn box_at(&self, at: usize, rows: &Rows) -> GlobalBox {
        self.extents[at].container.as_ref().map_or(GlobalBox::EMPTY, |container| GlobalBox::of(container, rows))
    }

    /// Computes the boxes of bodies that no step has placed as they are, where they are; says how many. The next step computes them again.
    pub fn settle(&mut self, bodies: &[Body]) -> Result<u64, StepError> {
        let mut count = 0;
        if !self.any_replaced && !self.any_without_box {
            return Ok(count);
        }
        for (at, body) in bodies.iter().enumerate() {
            if self.history[at].replaced || !self.history[at].has_box {
                self.magnitudes[at] = check_transform(body, self.extents[at].reach, &self.rows[at])?;
                self.boxes[at] = self.box_at(at, &self.rows[at]);
                count += 1;
            }
        }
        Ok(count)
    }

    /// How a body has moved in step number `step`, after [`commit`](Self::commit). The step that first places a body does not move it.
    pub fn motion(&self, body: u32, rigid: &[RigidMotion], step: u64) -> Motion {
        let (history, rows, from) = (&self.history[body as usize], self.rows(body), self.staged[body as usize]);
        if history.staged != step || history.first == step {
            return Motion::Still(*rows);
        }
        match history.rigid {
            Some(at) => rigid[at as usize].from(from),
            None if from == *rows => Motion::Still(*rows),
            None => Motion::Linear { from, to: *rows },
        }
    }

    /// How far any point of a body has come in such a step, at most: see [`displacement`].
    pub fn displacement(&self, body: u32, rigid: &[RigidMotion], step: u64) -> f64 {
        let magnitudes = self.magnitude(body) + self.staged_magnitudes[body as usize];
        let motion = self.motion(body, rigid, step);
        self.container(body).map_or(0.0, |container| displacement(container, &motion, self.rows(body), magnitudes))
    }
}

impl History {
    fn move_in(&mut self, step: u64) {
        if self.moves {
            if self.replaced {
                self.exchanged = step;
            }
            self.changed = step;
            self.first = self.first.min(step);
            (self.replaced, self.has_box) = (false, false);
        }
    }
}

/// Whether any entry differs. Zeros of either sign are different: the report is the same to the bit.
#[inline(always)]
fn differ(one: &Rows, other: &Rows) -> bool {
    let pairs = one.as_flattened().iter().zip(other.as_flattened());
    pairs.fold(0, |differences, (one, other)| differences | (one.to_bits() ^ other.to_bits())) != 0
}
