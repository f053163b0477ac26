//! The centre of mass and momenta about it, as linear functions of the joint rates.
//!
//! Column j of the centroidal momentum matrix (Orin, Goswami and Lee, Auton. Robots 35, 2013) is the momentum
//! of everything beyond joint j when it alone moves at unit rate: Ic S, with the composite inertia Ic, seen at the
//! centre of mass. Its linear rows over the mass are the Jacobian of the centre of mass.

use crate::workspace::{in_precision, require};
use crate::{Error, Workspace};
use faer::Mat;
use glam::{DMat3, DVec3};
use vertebra_assembly::Model;
use vertebra_spatial::{Force, Motion, Real, RigidInertia, Vec3};

/// What [`centroidal`] computes, and its memory.
#[derive(Clone, Debug)]
pub struct Centroidal {
    /// Total mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the world \[m\].
    pub center: DVec3,
    /// Velocity of the centre of mass in world axes [m/s].
    pub velocity: DVec3,
    /// Angular momentum about the centre of mass in world axes [N m s].
    pub angular_momentum: DVec3,
    /// Linear momentum in world axes [N s].
    pub linear_momentum: DVec3,
    /// Inertia of all bodies about the centre of mass if all joints were locked, world axes [kg m^2].
    pub inertia: DMat3,
    /// Centroidal momentum matrix A: \[angular; linear momentum\] = A qd. Shape 6 x
    /// [`Model::dof_count`].
    pub matrix: Mat<f64>,
    /// Composite inertias about the bodies' origins in the model's units.
    composite: Vec<RigidInertia<f64>>,
}

impl Centroidal {
    /// Takes the memory for one model.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self {
            mass: 0.0,
            center: DVec3::ZERO,
            velocity: DVec3::ZERO,
            angular_momentum: DVec3::ZERO,
            linear_momentum: DVec3::ZERO,
            inertia: DMat3::ZERO,
            matrix: Mat::zeros(6, model.dof_count()),
            composite: vec![RigidInertia::ZERO; model.bodies().len()],
        }
    }

    /// Writes the Jacobian of the centre of mass: its velocity is J qd. Shape 3 x [`Model::dof_count`], by
    /// columns: `out[3 * dof + row]`.
    ///
    /// # Errors
    /// [`Error::Model`] if `out` has another length.
    pub fn center_jacobian(&self, out: &mut [f64]) -> Result<(), Error> {
        let dofs = self.matrix.ncols();
        crate::jacobian::check_length("the Jacobian of the centre", 3 * dofs, out.len())?;
        for dof in 0..dofs {
            for row in 0..3 {
                let momentum = self.matrix[(3 + row, dof)];
                out[3 * dof + row] = if momentum == 0.0 {
                    0.0
                } else {
                    momentum / self.mass
                };
            }
        }
        Ok(())
    }
}

/// Centre of mass, momenta and the centroidal momentum matrix, in O(n), from the kinematics of the last
/// [`forward_kinematics`](crate::forward_kinematics) or [`body_poses`](crate::body_poses). Sums are in f64.
///
/// # Errors
/// [`Error::NotComputed`] without kinematics; [`Error::WrongWorkspace`] if `out` was made for another model,
/// as far as sizes tell; [`Error::Overflow`].
pub fn centroidal(workspace: &Workspace, out: &mut Centroidal) -> Result<(), Error> {
    require(workspace.computed.poses, "poses", "forward_kinematics")?;
    let (bodies, dofs) = (workspace.model.bodies().len(), workspace.qdd.len());
    if out.composite.len() != bodies || out.matrix.ncols() != dofs {
        return Err(Error::WrongWorkspace {
            workspace: "centroidal".to_owned(),
            model: workspace.model.name().to_owned(),
        });
    }
    let units = workspace.model.units();
    let (mut mass, mut moment) = (0.0, Vec3::ZERO);
    let mut whole = RigidInertia::ZERO;
    let mut momentum = Force::ZERO;
    in_precision!(&workspace.arrays, s => {
        for (composite, inertia) in out.composite.iter_mut().zip(&s.inertia) {
            *composite = inertia.map(Real::to_f64);
        }
        for i in (0..bodies).rev() {
            let composite = out.composite[i];
            if let Some(parent) = s.links[i].parent {
                out.composite[parent] += composite.shifted_back(s.offset[i].map(Real::to_f64));
            } else {
                mass += composite.mass;
                moment += s.position[i].map(Real::to_f64) * composite.mass + composite.moment;
            }
        }
        let center = if mass > 0.0 { moment * (1.0 / mass) } else { Vec3::ZERO };
        moment = center;
        for i in 0..bodies {
            let from_center = s.position[i].map(Real::to_f64) - center;
            if s.links[i].parent.is_none() {
                whole += out.composite[i].shifted_back(from_center);
            }
            for dof in s.dofs(i) {
                let column: Motion<f64> = s.subspace[dof].map(Real::to_f64);
                let column = out.composite[i].mul(column).shifted_back(from_center);
                momentum += column * Real::to_f64(s.rates[dof]);
                for (row, entry) in column.to_array().into_iter().enumerate() {
                    out.matrix[(row, dof)] = entry;
                }
            }
        }
    });
    let impulse = units.mass * units.velocity();
    let rates = &workspace.scales.rate;
    for dof in 0..dofs {
        for row in 0..6 {
            let length = if row < 3 { units.length } else { 1.0 };
            out.matrix[(row, dof)] *= impulse * length * rates[dof];
        }
    }
    out.mass = mass * units.mass;
    out.center = moment.to_glam() * units.length;
    out.linear_momentum = momentum.linear.to_glam() * impulse;
    out.angular_momentum = momentum.angular.to_glam() * (impulse * units.length);
    out.velocity = if mass > 0.0 {
        momentum.linear.to_glam() * (units.velocity() / mass)
    } else {
        DVec3::ZERO
    };
    out.inertia = whole.rotational.to_mat3().to_glam() * (units.mass * units.length * units.length);
    let sums = [
        out.center,
        out.linear_momentum,
        out.angular_momentum,
        out.velocity,
    ];
    let finite = sums.iter().all(|v| v.is_finite())
        && out.inertia.is_finite()
        && (0..dofs).all(|dof| (0..6).all(|row| out.matrix[(row, dof)].is_finite()));
    workspace.refuse_overflow("centroidal momentum", (!finite).then_some(0))
}
