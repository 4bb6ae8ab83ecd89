//! Mass, centre of mass and inertia.

use glam::{DMat3, DVec3};

use super::ResponseError;
use crate::affine::Rows;
use crate::object::Object;
use crate::topology::Closure;

/// Mass properties in the object's frame.
///
/// The mass is that of the body as it stands in the scene; a transform that scales or shears moves the mass with the
/// body, and leaves its amount alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Positive; infinite for a body that never moves.
    pub mass: f64,
    /// Centre of mass.
    pub centre: [f64; 3],
    /// Inertia tensor about the centre of mass. Symmetric, positive definite; not looked at where the mass is infinite.
    pub inertia: [[f64; 3]; 3],
}

impl MassProperties {
    /// A body that never moves.
    pub const STATIC: MassProperties = MassProperties { mass: f64::INFINITY, centre: [0.0; 3], inertia: [[0.0; 3]; 3] };

    /// Of a closed mesh that is filled evenly, `density` in mass per cubed length of the object's frame. Which way around its
    /// faces run does not matter, as long as all run the same way.
    ///
    /// Integrals over tetrahedra from one point to each triangle (Blow and Binstock 2004, "How to find the inertia tensor (or
    /// other mass properties) of a 3D solid body represented by a triangle mesh"), in f64.
    ///
    /// # Errors
    /// When the density is not positive, the mesh not closed and consistently oriented (vertices at equal positions being one),
    /// or its volume within 1e-12 of nothing, measured by the tetrahedra.
    pub fn of_closed_mesh(object: &Object, density: f64) -> Result<MassProperties, ResponseError> {
        /// Volume that may be rounding, relative to the volume of all tetrahedra.
        const NOTHING: f64 = 1e-12;
        if !(density > 0.0 && density.is_finite()) {
            return Err(ResponseError::Density { density });
        }
        match object.topology().closure() {
            Closure::Closed => {}
            Closure::Open { edges } => return Err(ResponseError::OpenMesh { edges }),
            Closure::Inconsistent { edges } => return Err(ResponseError::InconsistentMesh { edges }),
        }
        let integrals = Integrals::over(object);
        if integrals.volume.abs() <= NOTHING * integrals.magnitude || !integrals.volume.is_finite() {
            return Err(ResponseError::NoVolume);
        }
        let centre = integrals.first / integrals.volume;
        let mass = density * integrals.volume.abs();
        let covariance = integrals.second * (mass / integrals.volume) - outer(centre, centre) * mass;
        let inertia = inertia_of(covariance);
        Ok(MassProperties {
            mass,
            centre: (integrals.reference + centre).to_array(),
            inertia: [0, 1, 2].map(|row| inertia.row(row).to_array()),
        })
    }

    /// The inverse of the mass, and of the inertia tensor in the world, zero for a static body; `None` where that tensor has
    /// none. The tensor's second moments move as the body does, which for a rigid transform turns the tensor.
    pub(super) fn inverse(&self, rows: &Rows) -> Option<(f64, DMat3)> {
        /// A tensor whose determinant is less, relative to its trace cubed, turns about some axis without resistance.
        const SINGULAR: f64 = 1e-30;
        if self.mass == f64::INFINITY {
            return Some((0.0, DMat3::ZERO));
        }
        let inertia = matrix(&self.inertia);
        if inertia.transpose() != inertia {
            return None;
        }
        let covariance = DMat3::from_diagonal(DVec3::splat(trace(inertia) / 2.0)) - inertia;
        let linear = matrix(&rows.map(|[x, y, z, _]| [x, y, z]));
        let world = inertia_of(linear * covariance * linear.transpose());
        let minor = world.x_axis.x * world.y_axis.y - world.x_axis.y * world.y_axis.x;
        let determinant = world.determinant();
        let is_positive = world.x_axis.x > 0.0 && minor > 0.0 && determinant > SINGULAR * trace(world).powi(3);
        is_positive.then(|| (1.0 / self.mass, world.inverse()))
    }
}

/// ∫1, ∫x and ∫xxᵀ over the inside, x counted from the reference; negative where the faces run the other way.
struct Integrals {
    reference: DVec3,
    volume: f64,
    first: DVec3,
    second: DMat3,
    /// Volume of all tetrahedra.
    magnitude: f64,
}

impl Integrals {
    fn over(object: &Object) -> Integrals {
        let container = object.container().map_or(([0.0; 3], [0.0; 3]), |container| (container.min, container.max));
        let reference = DVec3::from(container.0) / 2.0 + DVec3::from(container.1) / 2.0;
        let mut sums = Integrals { reference, volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO, magnitude: 0.0 };
        for triangle in object.triangles() {
            let [p, q, r] = triangle.map(|vertex| DVec3::from(object.vertices()[vertex as usize]) - reference);
            let six_volumes = p.dot(q.cross(r));
            let sum = p + q + r;
            sums.volume += six_volumes / 6.0;
            sums.magnitude += six_volumes.abs() / 6.0;
            sums.first += sum * (six_volumes / 24.0);
            let squares = outer(p, p) + outer(q, q) + outer(r, r) + outer(sum, sum);
            sums.second += squares * (six_volumes / 120.0);
        }
        sums
    }
}

fn outer(u: DVec3, v: DVec3) -> DMat3 {
    DMat3::from_cols(u * v.x, u * v.y, u * v.z)
}

fn trace(matrix: DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

/// The inertia tensor of a distribution with these second moments.
fn inertia_of(covariance: DMat3) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(trace(covariance))) - covariance
}

/// From rows.
fn matrix(rows: &[[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(rows).transpose()
}
