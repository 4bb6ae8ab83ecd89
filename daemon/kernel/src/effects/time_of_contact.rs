//! Effect `time_of_contact`: when two moving bodies first meet.
//!
//! The answer is a bracket: proven free up to `lo`, in contact at or before `hi`. Nothing is sampled; a body that
//! passes through another within the step is found. The pairs of cells of the two pyramids, and the pairs of triangles
//! that they end in, are visited in the order of the earliest time at which they may meet (best first); what is left of
//! it ends as soon as no pair may meet before the bracket that is known. Continuous collision detection by conservative advancement (Mirtich, 1996) along
//! separating axes; the upper end is confirmed by the exact static test or by inclusion (Wang et al., "A Large-Scale
//! Benchmark and an Inclusion-Based Algorithm for Continuous Collision Detection", ACM TOG 2021, on why).
//!
//! The motion is that of exact reals. The static test sees rounded positions, which may meet a few ulp before: at the
//! start of the step they decide, and elsewhere where exact arithmetic does not tell, so that brackets are right up to
//! [`Motion`]'s position bound (a few ulp of the coordinates) divided by the closing speed.

mod body;
mod chords;
mod descent;
mod exact;
mod inclusion;
mod moving_triangles;
mod nearest;
mod queue;
mod span;
mod triangle_pair;

use crate::affine::Rows;
use crate::motion::Motion;
use crate::object::Object;

use body::MovingBody;
use descent::Search;
use triangle_pair::{Bracket, RESOLUTION, TrianglePair, Work};

pub use descent::Memory;

/// How exactly a time of contact is wanted, and what it may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeSettings {
    /// Width of the bracket, as a share of the step. Below 2^-46 it counts as that.
    pub tolerance: f64,
    /// Work that one pair of bodies may cost, in comparisons of two cells or of the boxes of two triangles (10 to 100 ns each).
    pub iterations: u32,
}

impl Default for TimeSettings {
    /// A millionth of the step; some tenths of a second at worst.
    fn default() -> Self {
        TimeSettings { tolerance: 1e-6, iterations: 1 << 22 }
    }
}

/// When two surfaces first meet, in shares of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeOfContact {
    /// Proven apart for the whole step.
    Free,
    /// A bracket no wider than the tolerance.
    Contact {
        /// Proven free before; 0 when they touch at the start.
        lo: f64,
        /// Contact at this time or before it is confirmed; 0 when they touch at the start.
        hi: f64,
    },
    /// A contact can be neither excluded nor placed within the tolerance: rounding hides it (they graze each other), or
    /// the iterations are used up.
    Possible {
        /// Proven free before.
        lo: f64,
        /// The last time at which the first contact may be.
        hi: f64,
        /// An upper bound of the distance between the surfaces at `lo`, in the scene's length unit.
        distance: f64,
    },
}

impl TimeOfContact {
    /// Up to this time the surfaces are proven apart.
    pub fn free_until(self) -> f64 {
        match self {
            TimeOfContact::Free => 1.0,
            TimeOfContact::Contact { lo, .. } | TimeOfContact::Possible { lo, .. } => lo,
        }
    }
}

/// When two bodies first meet, and where they are then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstContact {
    /// Not [`TimeOfContact::Free`].
    pub time: TimeOfContact,
    /// [`Motion::at`] of both bodies at the start of the bracket. Rounded, so that the static test may see a contact there that the
    /// exact motion meets a few ulp later.
    pub at_lo: [Rows; 2],
}

/// When the surfaces of two moving objects first meet. What is inside the other without touching it is not in contact.
///
/// Motions must have passed [`Motion::check`]. The answer does not depend on the orders of the voxel matrices, but for
/// the place of the bracket within the tolerance. `memory` is kept from call to call so that nothing is allocated after
/// warm-up.
///
/// ```
/// use collided_kernel::effects::time_of_contact::{Memory, TimeOfContact, TimeSettings, time_of_contact};
/// use collided_kernel::{Object, PolygonMesh, affine::IDENTITY, motion::Motion};
/// let triangle = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let plate = Object::build(PolygonMesh::from_polygons(triangle, [[0, 1, 2]]), None, &())?;
/// let at = |z: f64| [IDENTITY[0], IDENTITY[1], [0.0, 0.0, 1.0, z]];
/// let falls = Motion::Linear { from: at(1.0), to: at(-2.0) };
/// let (rests, settings) = (Motion::Still(at(0.0)), TimeSettings::default());
/// let found = time_of_contact((&plate, &falls), (&plate, &rests), settings, &mut Memory::default());
/// let TimeOfContact::Contact { lo, hi } = found else { panic!("it passes through: {found:?}") };
/// assert!(lo <= 1.0 / 3.0 && 1.0 / 3.0 <= hi && hi - lo <= 1e-6);
/// # Ok::<(), collided_kernel::ObjectError>(())
/// ```
pub fn time_of_contact(
    a: (&Object, &Motion),
    b: (&Object, &Motion),
    settings: TimeSettings,
    memory: &mut Memory,
) -> TimeOfContact {
    let (Some(first), Some(second)) = (MovingBody::new(a.0, a.1), MovingBody::new(b.0, b.1)) else {
        return TimeOfContact::Free;
    };
    let tolerance = settings.tolerance.max(4.0 * RESOLUTION);
    let mut search = Search::new([&first, &second], tolerance, Work(settings.iterations));
    search.run(memory);
    verdict(&search, tolerance)
}

fn verdict(search: &Search<'_>, tolerance: f64) -> TimeOfContact {
    let open = search.open();
    let (lo, hi) = match (search.contact, open) {
        (None, None) => return TimeOfContact::Free,
        (Some(Bracket { lo, hi }), None) => (lo, hi),
        (None, Some(open)) => (open.lo, open.hi),
        (Some(contact), Some(open)) => (contact.lo.min(open.lo), contact.hi),
    };
    if search.contact.is_some() && hi - lo <= tolerance {
        return TimeOfContact::Contact { lo, hi };
    }
    let nearest = TrianglePair { bodies: search.bodies, triangles: search.nearest, tolerance };
    TimeOfContact::Possible { lo, hi, distance: nearest.distance_at(lo) }
}
