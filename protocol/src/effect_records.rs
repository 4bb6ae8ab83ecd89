//! What the effects of a step say, in sections of the report of their own. An effect that no pair asks for has no records.
//!
//! Positions and directions are world coordinates, in the caller's length unit. Records of pairs come in the order of the
//! pairs, and name the pair by its place in [`SECTION_PAIRS`](crate::report::SECTION_PAIRS).

use bytemuck::{Pod, Zeroable};

use crate::step::Rows;

/// Section of [`DistanceRecord`]s, one for each pair that asks and is not farther than the limit.
pub const SECTION_DISTANCES: usize = 2;
/// Section of [`TimeRecord`]s, one for each pair that asks and is not proven free over the whole step.
pub const SECTION_TIMES_OF_CONTACT: usize = 3;
/// Section of [`ContactRegionRecord`]s.
pub const SECTION_CONTACT_REGIONS: usize = 4;
/// Section of [`ContactPointRecord`]s, those of the first region first.
pub const SECTION_CONTACT_POINTS: usize = 5;
/// Section of [`ContactSegmentRecord`]s, those of the first region first.
pub const SECTION_CONTACT_SEGMENTS: usize = 6;
/// Section of [`ContactAreaRecord`]s, those of the first region first.
pub const SECTION_CONTACT_AREAS: usize = 7;
/// Section of the corners of all areas, `[f64; 3]` each.
pub const SECTION_AREA_CORNERS: usize = 8;
/// Section of [`PenetrationRecord`]s, one for each interfering pair that asks.
pub const SECTION_PENETRATIONS: usize = 9;
/// Section of [`ImpulseRecord`]s.
pub const SECTION_IMPULSES: usize = 10;
/// Section of [`VelocityRecord`](crate::step::VelocityRecord)s: of the bodies with mass that an impulse has reached, after it.
pub const SECTION_VELOCITIES: usize = 11;

/// Section of [`BoundRecord`]s, one for each pair left possible.
pub const SECTION_BOUNDS: usize = 12;

/// How far apart, or how deep in each other, a pair that is left possible can be. Up to the rounding of world vertices.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BoundRecord {
    /// Place of the pair.
    pub pair: u32,
    /// Orders of the voxels of `a` and of `b` that reach each other; 0 are the containers.
    pub orders: [u32; 2],
    /// Zero in this version.
    pub reserved: u32,
    /// The surfaces meet, or are at most this far apart where they are nearest.
    pub apart_at_most: f64,
    /// A translation of this length takes the bodies apart.
    pub deep_at_most: f64,
}

/// The minimum distance of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DistanceRecord {
    /// Place of the pair.
    pub pair: u32,
    /// Polygon of body `a` that the nearest point is on, by the caller's number.
    pub polygon_a: u32,
    /// Polygon of body `b` that the nearest point is on.
    pub polygon_b: u32,
    /// Zero in this version.
    pub reserved: u32,
    /// Distance of the two points; 0 exactly when the surfaces interfere.
    pub value: f64,
    /// Proven: the surfaces are not nearer.
    pub lower: f64,
    /// The nearest point on body `a`.
    pub on_a: [f64; 3],
    /// The nearest point on body `b`.
    pub on_b: [f64; 3],
}

/// [`TimeRecord::kind`]: the first contact is in the bracket.
pub const TIME_CONTACT: u32 = 0;
/// [`TimeRecord::kind`]: a first contact may be in the bracket; whether it is was not found out.
pub const TIME_POSSIBLE: u32 = 1;

/// When a pair first meets, in shares of the step.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TimeRecord {
    /// Place of the pair.
    pub pair: u32,
    /// [`TIME_CONTACT`] or [`TIME_POSSIBLE`].
    pub kind: u32,
    /// Proven free before.
    pub lo: f64,
    /// Contact at this time or before: confirmed, or possible.
    pub hi: f64,
    /// An upper bound of the distance left at `lo` when the contact is only possible, else 0.
    pub distance: f64,
    /// Where body `a` is at `lo`.
    pub rows_a: Rows,
    /// Where body `b` is at `lo`.
    pub rows_b: Rows,
}

/// A connected part of what two bodies have in common.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ContactRegionRecord {
    /// Place of the pair.
    pub pair: u32,
    /// Zero in this version.
    pub reserved: u32,
    /// Its points: the first, and how many.
    pub points: [u32; 2],
    /// Its segments: the first, and how many.
    pub segments: [u32; 2],
    /// Its areas: the first, and how many.
    pub areas: [u32; 2],
    /// Its middle.
    pub centre: [f64; 3],
    /// Unit normal from body `a` to body `b`; zero where none is defined.
    pub normal: [f64; 3],
    /// Sum of the lengths of its segments.
    pub length: f64,
    /// Sum of its areas.
    pub area: f64,
}

/// A point in which two bodies meet.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ContactPointRecord {
    /// Where.
    pub position: [f64; 3],
    /// Unit normal from body `a` to body `b`; zero where none is defined.
    pub normal: [f64; 3],
}

/// A segment in which two bodies meet.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ContactSegmentRecord {
    /// Its ends.
    pub ends: [[f64; 3]; 2],
    /// Unit normal from body `a` to body `b`; zero where none is defined.
    pub normal: [f64; 3],
}

/// A part of a plane in which two polygons overlap.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ContactAreaRecord {
    /// Its corners: the first, and how many.
    pub corners: [u32; 2],
    /// Unit normal from body `a` to body `b`.
    pub normal: [f64; 3],
}

/// How to separate a pair.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PenetrationRecord {
    /// Place of the pair.
    pub pair: u32,
    /// Zero in this version.
    pub reserved: u32,
    /// Moves body `b` clear of body `a`.
    pub translation_of_b: [f64; 3],
    /// Its length.
    pub depth: f64,
}

/// An impulse at a contact.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ImpulseRecord {
    /// Place of the pair.
    pub pair: u32,
    /// Zero in this version.
    pub reserved: u32,
    /// Where it acts.
    pub point: [f64; 3],
    /// What body `b` gets; body `a` gets the opposite. Mass times length over the caller's time unit.
    pub impulse_on_b: [f64; 3],
}

const _: () = assert!(size_of::<DistanceRecord>() == 80);
const _: () = assert!(size_of::<TimeRecord>() == 224);
const _: () = assert!(size_of::<ContactRegionRecord>() == 96);
const _: () = assert!(size_of::<ContactPointRecord>() == 48);
const _: () = assert!(size_of::<ContactSegmentRecord>() == 72);
const _: () = assert!(size_of::<ContactAreaRecord>() == 32);
const _: () = assert!(size_of::<PenetrationRecord>() == 40);
const _: () = assert!(size_of::<ImpulseRecord>() == 56);
