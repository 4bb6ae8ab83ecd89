//! Stage 3, for effects that look beyond overlapping boxes: `distance`, and `time_of_contact`.
//!
//! The boxes of all bodies are widened by what these effects may reach, and the broad phase finds the pairs of those. Nothing of
//! this happens in a scene that asks for neither.

use glam::DVec3;

use super::{Limit, World};
use crate::broad_phase::BroadPhase;
use crate::effects::Effects;
use crate::global_boxes::GlobalBox;
use crate::workforce::Workforce;

/// The effects that look beyond overlapping boxes.
pub(super) const FAR: Effects = Effects::DISTANCE.union(Effects::TIME_OF_CONTACT);

/// Memory of the stage.
#[derive(Debug, Default)]
pub(super) struct Reach {
    broad_phase: BroadPhase,
    boxes: Vec<GlobalBox>,
}

impl Reach {
    /// Every pair of bodies that may be near enough for these effects, and every pair whose boxes overlap; none when no pair asks
    /// for them.
    pub fn pairs(&mut self, world: &World<'_>, limit: &Limit<'_>, workforce: &dyn Workforce) -> &[(u32, u32)] {
        if !world.asked.meets(FAR) {
            return &[];
        }
        self.boxes.clear();
        self.boxes.extend((0..world.bodies.len() as u32).map(|body| reach(world, body)));
        self.broad_phase.overlapping_within(&self.boxes, |work| limit.spend(work), workforce)
    }
}

fn reach(world: &World<'_>, body: u32) -> GlobalBox {
    let mut bounds = world.boxes[body as usize];
    if let Some(container) = world.places.container(body) {
        if world.asked.contains(Effects::TIME_OF_CONTACT) {
            bounds = bounds.joined(&world.motion(body).swept_box(container));
        }
        if world.asked.contains(Effects::DISTANCE) {
            bounds = widened(&bounds, 0.5 * world.up_to);
        }
    }
    bounds
}

/// The box with every side moved out, rounded outwards.
fn widened(bounds: &GlobalBox, by: f64) -> GlobalBox {
    let by = DVec3::splat(by.next_up());
    GlobalBox { min: (bounds.min - by).map(f64::next_down), max: (bounds.max + by).map(f64::next_up) }
}
