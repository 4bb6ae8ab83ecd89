//! Stage 4: the collision interest matrix, sparse.
//!
//! Most entries are the default: the scene's effects, or nothing for two bodies of one group. What differs is kept with the
//! body of the smaller id, ordered by the other one's, so that a scene without rules pays nothing for them.

use crate::accuracy::Accuracy;
use crate::effects::Effects;
use crate::scene::BodyId;

/// What a scene wants to know of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interest {
    /// The scene's effects, or nothing within a group.
    #[default]
    Default,
    /// Nothing.
    Ignore,
    /// These effects instead of the scene's, also within a group.
    Effects(Effects),
}

/// Names a group of bodies that ignore each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct GroupId(pub u32);

/// One body's row of the matrix: its group, and its rules and accuracies with bodies of larger id.
#[derive(Debug, Clone, Default)]
pub(crate) struct InterestRow {
    group: Option<GroupId>,
    rules: Vec<(BodyId, Interest)>,
    accuracies: Vec<(BodyId, Accuracy)>,
}

impl InterestRow {
    pub fn of(group: Option<GroupId>) -> InterestRow {
        InterestRow { group, ..InterestRow::default() }
    }

    pub fn set(&mut self, other: BodyId, interest: Interest) {
        match (self.rules.binary_search_by_key(&other, |rule| rule.0), interest) {
            (Ok(at), Interest::Default) => drop(self.rules.remove(at)),
            (Ok(at), _) => self.rules[at].1 = interest,
            (Err(_), Interest::Default) => {}
            (Err(at), _) => self.rules.insert(at, (other, interest)),
        }
    }

    pub fn set_accuracy(&mut self, other: BodyId, accuracy: Option<Accuracy>) {
        match (self.accuracies.binary_search_by_key(&other, |rule| rule.0), accuracy) {
            (Ok(at), None) => drop(self.accuracies.remove(at)),
            (Ok(at), Some(accuracy)) => self.accuracies[at].1 = accuracy,
            (Err(_), None) => {}
            (Err(at), Some(accuracy)) => self.accuracies.insert(at, (other, accuracy)),
        }
    }

    /// The accuracy of the pair of this body and `other`, when it has one of its own.
    #[inline]
    pub fn accuracy(&self, other: BodyId) -> Option<&Accuracy> {
        if self.accuracies.is_empty() {
            return None;
        }
        let at = self.accuracies.binary_search_by_key(&other, |rule| rule.0).ok()?;
        Some(&self.accuracies[at].1)
    }

    /// The bodies of larger id for which a rule asks for an effect.
    pub fn rules_with(&self, effect: Effects) -> impl Iterator<Item = BodyId> {
        let asking =
            move |interest: &Interest| matches!(interest, Interest::Effects(effects) if effects.contains(effect));
        self.rules.iter().filter(move |(_, interest)| asking(interest)).map(|&(other, _)| other)
    }

    /// What to compute for the pair of this body and `other`, whose row is `row`.
    #[inline]
    pub fn effects(&self, other: BodyId, row: &InterestRow, scene: Effects) -> Effects {
        let rule = self.rules.binary_search_by_key(&other, |rule| rule.0);
        match rule.map_or(Interest::Default, |at| self.rules[at].1) {
            Interest::Default if self.group.is_some() && self.group == row.group => Effects::NONE,
            Interest::Default => scene,
            Interest::Ignore => Effects::NONE,
            Interest::Effects(effects) => effects,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_stands_above_the_group_and_the_group_above_the_scene() {
        let grouped = || InterestRow::of(Some(GroupId(7)));
        let (mut a, b, free) = (grouped(), grouped(), InterestRow::default());
        let scene = Effects::INTERFERENCE;
        assert_eq!(a.effects(BodyId(1), &free, scene), scene);
        assert_eq!(free.effects(BodyId(2), &InterestRow::default(), scene), scene);
        assert_eq!(a.effects(BodyId(1), &b, scene), Effects::NONE);
        a.set(BodyId(1), Interest::Effects(Effects::POLYGON_PAIRS));
        assert_eq!(a.effects(BodyId(1), &b, scene), Effects::POLYGON_PAIRS);
        a.set(BodyId(1), Interest::Ignore);
        assert_eq!(a.effects(BodyId(1), &free, scene), Effects::NONE);
        a.set(BodyId(1), Interest::Default);
        assert_eq!(a.effects(BodyId(1), &free, scene), scene);
    }
}
