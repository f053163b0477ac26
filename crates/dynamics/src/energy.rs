//! Energies, momenta and the centre of mass.

use crate::workspace::{Sweeps, in_f64, in_precision};
use crate::{Error, Workspace, forward_kinematics};
use glam::DVec3;
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Real, Vec3};

/// Energies and momenta of a whole model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mechanics {
    /// Kinetic energy \[J\].
    pub kinetic_energy: f64,
    /// Potential energy in the model's gravity, zero at the world's origin \[J\].
    pub potential_energy: f64,
    /// Total mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the world \[m\].
    pub center: DVec3,
    /// Linear momentum in world axes [N s].
    pub linear_momentum: DVec3,
    /// Angular momentum about the centre of mass in world axes [N m s].
    pub angular_momentum: DVec3,
}

/// Energies, momenta and centre of mass. Sums in f64, from the workspace's kinematics.
///
/// # Errors
/// [`Error`] if the state does not fit the model or the workspace belongs to another, or if a sum
/// overflows.
pub fn mechanics(
    model: &Model,
    state: &State,
    workspace: &mut Workspace,
) -> Result<Mechanics, Error> {
    forward_kinematics(model, state, workspace)?;
    let units = model.units();
    let sums = in_precision!(&workspace.arrays, s => s.sums());
    // About the centre of mass: L_c = L_o - c x p.
    let center = if sums.mass > 0.0 {
        sums.moment / sums.mass
    } else {
        DVec3::ZERO
    };
    let gravity = model.gravity() / units.acceleration();
    let momentum = units.mass * units.velocity();
    let result = Mechanics {
        kinetic_energy: sums.kinetic_energy * units.energy(),
        potential_energy: -gravity.dot(sums.moment) * units.energy(),
        mass: sums.mass * units.mass,
        center: center * units.length,
        linear_momentum: sums.linear * momentum,
        angular_momentum: (sums.angular - center.cross(sums.linear)) * (momentum * units.length),
    };
    let energies = [result.kinetic_energy, result.potential_energy];
    if energies.iter().all(|energy| energy.is_finite()) && result.angular_momentum.is_finite() {
        return Ok(result);
    }
    Err(Error::Overflow {
        quantity: "energy or momentum",
        body: model.bodies()[0].name.clone(),
        time: state.time,
    })
}

#[derive(Default)]
struct Sums {
    kinetic_energy: f64,
    mass: f64,
    moment: DVec3,
    linear: DVec3,
    /// About the world's origin.
    angular: DVec3,
}

impl<T: Real> Sweeps<T> {
    fn sums(&self) -> Sums {
        let mut sums = Sums::default();
        for i in 0..self.links.len() {
            let velocity = self.velocity[i];
            let momentum = self.inertia[i].mul(velocity);
            let position = self.position[i].to_glam();
            let mass = self.inertia[i].mass.to_f64();
            let linear = momentum.linear.to_glam();
            let power = in_f64(velocity).dot(vertebra_spatial::Force::new(
                Vec3::from_glam(momentum.angular.to_glam()),
                Vec3::from_glam(linear),
            ));
            sums.kinetic_energy += 0.5 * power;
            sums.mass += mass;
            sums.moment += position * mass + self.inertia[i].moment.to_glam();
            sums.linear += linear;
            sums.angular += momentum.angular.to_glam() + position.cross(linear);
        }
        sums
    }
}
