//! Beside stage 4: bodies that have no earlier step, though a pair of theirs asks for `time_of_contact`.
//!
//! It does not matter whether the pair is near: that its bodies count as still may be just why it is not.

use super::World;
use crate::effects::Effects;
use crate::scene::{Body, BodyId};

/// The first such body. Nothing is looked at in a scene without the effect, and little in one without new bodies.
pub(super) fn time_fault(world: &World<'_>) -> Option<BodyId> {
    if !world.asked.contains(Effects::TIME_OF_CONTACT) {
        return None;
    }
    let mut new_bodies = (0..).zip(world.bodies).filter(|&(at, _)| is_new(at, world)).map(|(_, body)| body);
    if world.effects.contains(Effects::TIME_OF_CONTACT) {
        return new_bodies.find(|body| world.bodies.iter().any(|other| asks(body, other, world))).map(|body| body.id);
    }
    // Only rules ask then. There may be many bodies and few rules.
    new_bodies.next()?;
    (0..).zip(world.bodies).flat_map(|(at, body)| by_rule(at, body, world)).min()
}

/// Whether this step is the first to place the body.
fn is_new(body: u32, world: &World<'_>) -> bool {
    world.places.is_new(body, world.step)
}

fn asks(body: &Body, other: &Body, world: &World<'_>) -> bool {
    let (first, second) = if body.id < other.id { (body, other) } else { (other, body) };
    let effects = first.interest.effects(second.id, &second.interest, world.effects);
    body.id != other.id && effects.contains(Effects::TIME_OF_CONTACT)
}

/// The new bodies of the pairs for which the body has a rule that asks.
fn by_rule<'w>(at: u32, body: &'w Body, world: &'w World<'_>) -> impl Iterator<Item = BodyId> + 'w {
    let others = body.interest.rules_with(Effects::TIME_OF_CONTACT);
    let others = others.filter_map(|other| world.bodies.binary_search_by_key(&other, |body| body.id).ok());
    let pairs = others.flat_map(move |other| [at, other as u32]);
    pairs.filter(|&body| is_new(body, world)).map(|body| world.bodies[body as usize].id)
}
