//! From pieces to regions: equal pieces merged, then joined where they share an end.

use std::ops::Range;

use glam::DVec3;

use super::meeting::Meeting;
use super::normal::unit;
use super::{ContactArea, ContactPoint, ContactRegion, ContactSegment, Contacts};
use crate::topology::{join, root};

/// A place that pieces end at: its number in the order of positions.
type Place = u32;

/// What pairs of triangles meet in. Memory, too, of what is made of it.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    points: Vec<Piece<1>>,
    segments: Vec<Piece<2>>,
    areas: Vec<Area>,
    /// Ends of all pieces: their positions in the order in which they were found, then the place of each.
    positions: Vec<DVec3>,
    place_of: Vec<Place>,
    order: Vec<u32>,
    /// Position of each place, whether a segment or an area has it, and its parent in the forest of joined places.
    places: Vec<DVec3>,
    covered: Vec<bool>,
    parents: Vec<Place>,
    /// Sides of areas, ordered.
    sides: Vec<[Place; 2]>,
    /// Region of each root; `NONE` before it has one.
    region_of: Vec<u32>,
}

const NONE: u32 = u32::MAX;

/// A point or a segment: its ends, first as indices of positions, then as places.
#[derive(Debug, Clone, Copy)]
struct Piece<const N: usize> {
    region: u32,
    ends: [u32; N],
    normal: DVec3,
}

/// An area: its corners stand one after the other in the positions.
#[derive(Debug, Clone, Copy)]
struct Area {
    region: u32,
    start: u32,
    count: u32,
    normal: DVec3,
}

impl Area {
    fn corners(&self) -> Range<usize> {
        self.start as usize..(self.start + self.count) as usize
    }
}

impl Pieces {
    pub fn clear(&mut self) {
        self.points.clear();
        self.segments.clear();
        self.areas.clear();
        self.positions.clear();
    }

    /// Adds what two triangles meet in.
    pub fn add(&mut self, meeting: &Meeting, normal: DVec3) {
        let start = self.positions.len() as u32;
        // −0 and +0 are one place.
        self.positions.extend(meeting.ends().iter().map(|end| end.position + DVec3::ZERO));
        match meeting.ends().len() as u32 {
            0 => {}
            1 => self.points.push(Piece { region: NONE, ends: [start], normal }),
            2 => self.segments.push(Piece { region: NONE, ends: [start, start + 1], normal }),
            count => self.areas.push(Area { region: NONE, start, count, normal }),
        }
    }

    /// Numbers the places by position.
    fn find_places(&mut self) {
        let key = |i: &u32| self.positions[*i as usize].to_array();
        self.order.clear();
        self.order.extend(0..self.positions.len() as u32);
        self.order.sort_unstable_by(|i, j| compare(key(i), key(j)));
        self.places.clear();
        self.place_of.clear();
        self.place_of.resize(self.positions.len(), 0);
        for &i in &self.order {
            let position = self.positions[i as usize];
            if self.places.last() != Some(&position) {
                self.places.push(position);
            }
            self.place_of[i as usize] = self.places.len() as u32 - 1;
        }
    }

    fn use_places(&mut self) {
        let place_of = &self.place_of;
        self.points.iter_mut().for_each(|point| point.ends = point.ends.map(|end| place_of[end as usize]));
        for segment in &mut self.segments {
            segment.ends = segment.ends.map(|end| place_of[end as usize]);
            segment.ends.sort_unstable();
        }
    }

    /// Keeps each piece once, and only where no larger one holds it.
    fn merge(&mut self) {
        merge_equal(&mut self.points);
        merge_equal(&mut self.segments);
        self.sides.clear();
        for area in &self.areas {
            let corners = &self.place_of[area.corners()];
            let next = corners.iter().skip(1).chain(corners.first());
            self.sides.extend(corners.iter().zip(next).map(|(&p, &q)| [p.min(q), p.max(q)]));
        }
        self.sides.sort_unstable();
        self.sides.dedup();
        self.segments.retain(|segment| self.sides.binary_search(&segment.ends).is_err());
        self.covered.clear();
        self.covered.resize(self.places.len(), false);
        let ends = self.segments.iter().map(|segment| segment.ends).chain(self.sides.iter().copied());
        ends.flatten().for_each(|place| self.covered[place as usize] = true);
        self.points.retain(|point| !self.covered[point.ends[0] as usize]);
    }

    /// Joins the ends of each piece.
    fn join(&mut self) {
        self.parents.clear();
        self.parents.extend(0..self.places.len() as u32);
        for [p, q] in self.segments.iter().map(|segment| segment.ends).chain(self.sides.iter().copied()) {
            join(&mut self.parents, p, q);
        }
    }

    /// Gives each piece its region; says how many there are. Regions are numbered by their lowest place.
    fn number_regions(&mut self) -> u32 {
        self.region_of.clear();
        self.region_of.resize(self.places.len(), NONE);
        let mut count = 0;
        for place in 0..self.places.len() as u32 {
            let root = root(&mut self.parents, place) as usize;
            if self.region_of[root] == NONE {
                self.region_of[root] = count;
                count += 1;
            }
            self.region_of[place as usize] = self.region_of[root];
        }
        let region_of = |place: Place| self.region_of[place as usize];
        self.points.iter_mut().for_each(|point| point.region = region_of(point.ends[0]));
        self.segments.iter_mut().for_each(|segment| segment.region = region_of(segment.ends[0]));
        self.areas.iter_mut().for_each(|area| area.region = region_of(self.place_of[area.start as usize]));
        let corners = |area: &Area| &self.place_of[area.corners()];
        self.points.sort_unstable_by_key(|point| (point.region, point.ends));
        self.segments.sort_unstable_by_key(|segment| (segment.region, segment.ends));
        self.areas.sort_unstable_by(|area, other| {
            let places = (area.region, corners(area)).cmp(&(other.region, corners(other)));
            places.then(area.start.cmp(&other.start))
        });
        count
    }

    fn position(&self, place: Place) -> DVec3 {
        self.places[place as usize]
    }
}

fn compare(p: [f64; 3], q: [f64; 3]) -> std::cmp::Ordering {
    p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(p[2].total_cmp(&q[2]))
}

/// Equal pieces become one, with the sum of their normals.
fn merge_equal<const N: usize>(pieces: &mut Vec<Piece<N>>) {
    // By their normals too, so that sums do not depend on the order of the triangles.
    pieces.sort_unstable_by(|piece, other| {
        piece.ends.cmp(&other.ends).then(compare(piece.normal.to_array(), other.normal.to_array()))
    });
    pieces.dedup_by(|next, kept| {
        let same = next.ends == kept.ends;
        if same {
            kept.normal += next.normal;
        }
        same
    });
    pieces.iter_mut().for_each(|piece| piece.normal = unit(piece.normal));
}

/// What the pieces of one kind add up to.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    size: f64,
    /// Sums of middles and of normals, each times the size of its piece.
    moment: DVec3,
    normal: DVec3,
    /// Sums of middles and of normals as they are, for pieces without measurable size.
    middles: DVec3,
    normals: DVec3,
}

impl Sums {
    fn add(&mut self, size: f64, middle: DVec3, normal: DVec3) {
        self.count += 1.0;
        self.size += size;
        self.moment += middle * size;
        self.normal += normal * size;
        self.middles += middle;
        self.normals += normal;
    }

    /// Centre and normal; `None` without a piece.
    fn averages(&self) -> Option<(DVec3, DVec3)> {
        /// What is left of normals that cancel out is rounding.
        const CANCELLED: f64 = 1e-12;
        let average = |sum: DVec3, weight: f64| (sum.length() > CANCELLED * weight).then(|| unit(sum));
        if self.size > 0.0 && self.moment.is_finite() {
            let normal = average(self.normal, self.size).unwrap_or(DVec3::ZERO);
            return Some((self.moment / self.size, normal));
        }
        let normal = average(self.normals, self.count).unwrap_or(DVec3::ZERO);
        (self.count > 0.0).then(|| (self.middles / self.count, normal))
    }
}

impl Contacts {
    /// Groups the pieces into regions.
    pub(super) fn group(&mut self) {
        self.pieces.find_places();
        self.pieces.use_places();
        self.pieces.merge();
        self.pieces.join();
        let (mut points, mut segments, mut areas) = (0, 0, 0);
        for region in 0..self.pieces.number_regions() {
            let sums = [
                self.take_areas(region, &mut areas),
                self.take_segments(region, &mut segments),
                self.take_points(region, &mut points),
            ];
            let averages = sums.iter().find_map(Sums::averages).unwrap_or_default();
            let start = self.regions.last().map_or([0; 3], |last| [last.points.end, last.segments.end, last.areas.end]);
            self.regions.push(ContactRegion {
                points: start[0]..points,
                segments: start[1]..segments,
                areas: start[2]..areas,
                centre: averages.0.to_array(),
                normal: averages.1.to_array(),
                length: sums[1].size,
                area: sums[0].size,
            });
        }
    }

    /// Moves the region's points, from the given one on, into the result.
    fn take_points(&mut self, region: u32, next: &mut usize) -> Sums {
        let mut sums = Sums::default();
        while let Some(point) = self.pieces.points.get(*next).filter(|point| point.region == region) {
            let position = self.pieces.position(point.ends[0]);
            sums.add(0.0, position, point.normal);
            self.points.push(ContactPoint { position: position.to_array(), normal: point.normal.to_array() });
            *next += 1;
        }
        sums
    }

    fn take_segments(&mut self, region: u32, next: &mut usize) -> Sums {
        let mut sums = Sums::default();
        while let Some(segment) = self.pieces.segments.get(*next).filter(|segment| segment.region == region) {
            let [p, q] = segment.ends.map(|place| self.pieces.position(place));
            sums.add(p.distance(q), p / 2.0 + q / 2.0, segment.normal);
            self.segments
                .push(ContactSegment { ends: [p.to_array(), q.to_array()], normal: segment.normal.to_array() });
            *next += 1;
        }
        sums
    }

    fn take_areas(&mut self, region: u32, next: &mut usize) -> Sums {
        let mut sums = Sums::default();
        while let Some(&area) = self.pieces.areas.get(*next).filter(|area| area.region == region) {
            let start = self.corners.len();
            self.corners.extend(self.pieces.positions[area.corners()].iter().map(|corner| corner.to_array()));
            let (twice, moment) = area_and_moment(&self.pieces.positions[area.corners()]);
            if twice.dot(area.normal) < 0.0 {
                self.corners[start..].reverse();
            }
            sums.add(twice.length() / 2.0, moment, area.normal);
            self.areas.push(ContactArea { corners: start..self.corners.len(), normal: area.normal.to_array() });
            *next += 1;
        }
        sums
    }
}

/// Twice the vector area of a convex polygon, and its centroid.
fn area_and_moment(corners: &[DVec3]) -> (DVec3, DVec3) {
    let first = corners[0];
    let mut twice = DVec3::ZERO;
    let (mut weights, mut moment) = (0.0, DVec3::ZERO);
    for ends in corners[1..].windows(2) {
        let (u, v) = (ends[0] - first, ends[1] - first);
        let part = u.cross(v);
        twice += part;
        weights += part.length();
        moment += (u + v) / 3.0 * part.length();
    }
    (twice, if weights > 0.0 { first + moment / weights } else { first })
}
