//! From a contact region to a few points that carry the same impulses.

use glam::DVec3;

use super::ManifoldPoint;
use crate::effects::contacts::{ContactRegion, Contacts};

/// Directions in the contact plane whose farthest points are taken.
const DIRECTIONS: usize = 8;

/// Appends the extreme points of a region, each with the region's normal: of an area the corners of its outline (the
/// farthest in eight directions, so all four of a rectangle), of a segment its ends, of a point itself. A region without a
/// normal adds nothing: there is no direction to push along.
pub fn add_manifold(contacts: &Contacts, region: &ContactRegion, manifold: &mut Vec<ManifoldPoint>) {
    let normal = DVec3::from(region.normal);
    if normal == DVec3::ZERO {
        return;
    }
    let (u, v) = normal.any_orthonormal_pair();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let diagonal = [(1.0, 0.0), (half, half), (0.0, 1.0), (-half, half)];
    let directions = diagonal.into_iter().flat_map(|(x, y)| [u * x + v * y, -(u * x + v * y)]);
    let start = manifold.len();
    for direction in directions.take(DIRECTIONS) {
        let farthest = positions(contacts, region)
            .map(|position| (DVec3::from(position).dot(direction), position))
            .reduce(|best, next| if next.0 > best.0 { next } else { best });
        let Some((_, position)) = farthest else { return };
        if !manifold[start..].iter().any(|point| point.position == position) {
            manifold.push(ManifoldPoint { position, normal: region.normal });
        }
    }
}

fn positions<'c>(contacts: &'c Contacts, region: &ContactRegion) -> impl Iterator<Item = [f64; 3]> + use<'c> {
    let corners =
        contacts.areas()[region.areas.clone()].iter().flat_map(|area| &contacts.corners()[area.corners.clone()]);
    let ends = contacts.segments()[region.segments.clone()].iter().flat_map(|segment| &segment.ends);
    let points = contacts.points()[region.points.clone()].iter().map(|point| &point.position);
    corners.chain(ends).chain(points).copied()
}
