//! Energies, momenta and the centre of mass.

use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Workspace, forward_kinematics};
use glam::DVec3;
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Force, Number, Real, Vec3};

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

/// Energies, momenta and centre of mass. Sums in f64 at least, from the workspace's kinematics.
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
    let result = in_precision!(&workspace.arrays, s => s.mechanics(model));
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

/// Sums over the bodies in the model's units, momenta and first moment about the world's origin.
#[derive(Clone, Copy)]
struct Sums<T> {
    kinetic_energy: T,
    mass: T,
    moment: Vec3<T>,
    momentum: Force<T>,
}

impl<T: Real> Sums<T> {
    const ZERO: Self = Self {
        kinetic_energy: T::ZERO,
        mass: T::ZERO,
        moment: Vec3::ZERO,
        momentum: Force::ZERO,
    };

    fn center(&self) -> Vec3<T> {
        if self.mass > T::ZERO {
            self.moment * (T::ONE / self.mass)
        } else {
            Vec3::ZERO
        }
    }
}

impl<T: Real> Sweeps<T> {
    fn sums(&self) -> Sums<T::Wide> {
        let mut sums = Sums::ZERO;
        for i in 0..self.links.len() {
            let momentum = self.inertia[i].mul(self.velocity[i]).map(T::widen);
            let velocity = self.velocity[i].map(T::widen);
            let inertia = self.inertia[i].map(T::widen);
            let position = self.position[i].map(T::widen);
            sums.kinetic_energy += T::Wide::HALF * velocity.dot(momentum);
            sums.mass += inertia.mass;
            sums.moment += position * inertia.mass + inertia.moment;
            sums.momentum += momentum.shifted_back(position);
        }
        sums
    }

    /// Of the kinematics at hand.
    pub(crate) fn mechanics(&self, model: &Model) -> Mechanics {
        let units = model.units();
        let sums = self.sums();
        let center = sums.center();
        // About the centre of mass: L_c = L_o - c x p.
        let momentum = sums.momentum.shifted_back(-center);
        let gravity = Vec3::<T::Wide>::from_glam(model.gravity() / units.acceleration());
        let impulse = units.mass * units.velocity();
        Mechanics {
            kinetic_energy: sums.kinetic_energy.to_f64() * units.energy(),
            potential_energy: -gravity.dot(sums.moment).to_f64() * units.energy(),
            mass: sums.mass.to_f64() * units.mass,
            center: center.to_glam() * units.length,
            linear_momentum: momentum.linear.to_glam() * impulse,
            angular_momentum: momentum.angular.to_glam() * (impulse * units.length),
        }
    }
}
