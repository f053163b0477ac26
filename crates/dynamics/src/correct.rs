//! Iterative refinement of what the articulated-body algorithm computed.
//!
//! The solution leaves, of the equations of a body,
//!
//! r = external + f - I a - sum over children of X' f_child;
//!
//! S'f = tau - E qdd and a = X a_parent + c + S qdd hold to rounding, since they were computed so. The correction
//! solves the same equations for bodies at rest on which r acts, with the factors at hand (symbols of
//! [`aba`](crate::aba)). Up: pA = -r + sum of X' pa, u = -S' pA, pa = pA + U D^-1 u. Down: a' = X a_parent,
//! qdd = D^-1 (u - U'a'), a = a' + S qdd; then f = IA a + pA.
//!
//! What is left by one is the [drift](crate::drift) of the bodies' places. The second takes it out first: a
//! and f are made to fit the joints where these then are, and r shows what that moves.

use crate::across::Given;
use crate::drift::Drift;
use crate::drive::transmitted;
use crate::link::{Kind, Link};
use crate::own::OwnInertia;
use crate::refine::{Loads, Size, relative};
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Refinement, Workspace, finite_results, joint_wrenches};
use core::ops::AddAssign;
use vertebra_assembly::{Model, Units};
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Memory of the corrections, one entry a body unless it says otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Corrections<T> {
    /// What children other than the next body hand on; nothing between corrections.
    arriving: Vec<Arriving<T>>,
    /// pA.
    biases: Vec<Force<T>>,
    /// Of bodies that have children other than the next.
    accelerations: Vec<Motion<T>>,
    /// u, then the correction of qdd; one entry a freedom.
    u: Vec<T>,
    /// None in the reference precision.
    drift: Option<Drift>,
}

/// What children hand on to a body, about its origin.
#[derive(Clone, Copy, Debug)]
struct Arriving<T> {
    /// What they take of its force.
    taken: Force<T>,
    /// Their bias force.
    bias: Force<T>,
    /// Size of what they take.
    size: Size<T>,
}

impl<T: Real> Arriving<T> {
    const NOTHING: Self = Self {
        taken: Force::ZERO,
        bias: Force::ZERO,
        size: Size::ZERO,
    };
}

impl<T: Real> AddAssign for Arriving<T> {
    #[inline(always)]
    fn add_assign(&mut self, rhs: Self) {
        self.taken += rhs.taken;
        self.bias += rhs.bias;
        self.size = self.size.or(rhs.size);
    }
}

impl<T: Real> Corrections<T> {
    fn new(bodies: usize, freedoms: usize, model: &Model) -> Self {
        Self {
            drift: Drift::of(model, T::EPSILON.to_f64()),
            arriving: vec![Arriving::NOTHING; bodies],
            biases: vec![Force::ZERO; bodies],
            accelerations: vec![Motion::ZERO; bodies],
            u: vec![T::ZERO; freedoms],
        }
    }
}

impl Workspace {
    /// Corrects the solution of the last [`aba`](crate::aba) once, or adds the response to other loads.
    pub(crate) fn correct(&mut self, forces: &Forces, loads: Loads) -> Result<Refinement, Error> {
        forces.check(&self.model)?;
        if !self.computed.joint_wrenches {
            joint_wrenches(self)?;
        }
        self.computed.accelerations = false;
        self.computed.joint_wrenches = false;
        let settles = loads == Loads::Settled && !self.computed.settled;
        let least = self.least_acceleration();
        let (qdd, scales) = (&mut self.qdd, &self.scales.acceleration);
        let model = &self.model;
        let given = Given {
            q: &self.q,
            qd: &self.qd,
            rate_scales: &self.scales.rate,
            length: model.units().length,
        };
        let mut refined = Refinement::default();
        let failed = in_precision!(&mut self.arrays, s => {
            let mut own = (s.corrections.take())
                .unwrap_or_else(|| Corrections::new(s.links.len(), s.u.len(), model).into());
            if settles && let Some(drift) = &mut own.drift {
                s.settle(drift, &given, forces, model.units());
            }
            refined.residual = s.gather_again(&mut own, loads);
            s.respond_again(&mut own);
            let (mut change, mut largest) = (0.0_f64, least);
            for (k, &by) in own.u.iter().enumerate() {
                s.u[k] += by;
                qdd[k] = Real::to_f64(s.u[k]) * scales[k];
                largest = largest.max(qdd[k].abs());
                change = change.max(Real::to_f64(by).abs() * scales[k]);
            }
            refined.change = relative(change, largest);
            s.corrections = Some(own);
            s.acceleration.iter().position(|a| !a.is_finite())
        });
        self.refuse_overflow("acceleration", failed)?;
        finite_results(&self.model, "joint acceleration", &self.qdd, self.time)?;
        self.computed.accelerations = true;
        self.computed.joint_wrenches = true;
        self.computed.corrected |= loads != Loads::Rounding;
        self.computed.settled |= settles;
        Ok(refined)
    }
}

impl Workspace {
    /// What forces as large as the rounding of the bodies' equations move, as part of the largest acceleration
    /// ([`Loads::Rounding`]); the solution has it added.
    #[cfg(feature = "gpu")]
    pub(crate) fn response_to_rounding(&mut self, forces: &Forces) -> Result<f64, Error> {
        let response = self.correct(forces, Loads::Rounding)?;
        Ok(response.change)
    }
}

impl<T: Real> Sweeps<T> {
    /// Takes the drift out of the bodies' places. Of the solution, the accelerations are summed up again from
    /// those of the joints, and the transmitted forces have along the freedoms what drives these.
    fn settle(&mut self, drift: &mut Drift, given: &Given<'_>, forces: &Forces, units: &Units) {
        let (links, rotations, spins) = (&self.links, &self.rotation, &self.spin);
        let place = |i: usize| (rotations[i], spins[i]);
        let own = OwnInertia {
            diagonal: &self.added,
            across: &self.across,
        };
        drift.measure(given, links.len(), |i| &links[i], place);
        for i in 0..self.links.len() {
            let dofs = self.dofs(i);
            let link = &self.links[i];
            let (axes, w) = drift.settled(link.parent);
            let (rotation, spin) = drift.settled(Some(i));
            let r: Vec3<T> = axes * link.displacement(given);
            let columns = &mut self.subspace[dofs.clone()];
            let (joint_velocity, turning_rates) = link.span(&rotation, given, columns);
            let sideways = w.cross(joint_velocity.linear);
            let c = Motion::new(
                w.cross(joint_velocity.angular),
                w.cross(w.cross(r)) + sideways + sideways + turning_rates,
            );
            let inertia = link.inertia.rotated(&rotation);
            let above = link
                .parent
                .map_or(self.base, |parent| self.acceleration[parent]);
            let mut a = above.shifted(r) + c;
            for (dof, &column) in dofs.clone().zip(&*columns) {
                a += column * self.u[dof];
            }
            let mut tau = own.of(dofs.clone()).mul(&self.u[dofs.clone()]);
            for (tau, &given) in tau.iter_mut().zip(&self.tau[dofs]) {
                *tau = given - *tau;
            }
            self.joint_wrench[i] = transmitted(self.joint_wrench[i], columns, &tau);
            self.acceleration[i] = a;
            self.external[i] = -inertia.bias(spin);
            self.inertia[i] = inertia;
            self.joint_velocity[i] = joint_velocity;
            self.bias_acceleration[i] = c;
            self.offset[i] = r;
            self.spin[i] = spin;
            self.rotation[i] = rotation;
        }
        self.add_external(0, forces, units);
    }

    /// Up: bias forces of what acts. Gives the largest part of its terms that a body's equation
    /// leaves.
    fn gather_again(&self, own: &mut Corrections<T>, loads: Loads) -> f64 {
        let mut worst = 0.0_f64;
        let mut arriving = Arriving::NOTHING;
        for i in (0..self.links.len()).rev() {
            let Link {
                parent,
                kind,
                v,
                gathers,
                ..
            } = self.links[i];
            if gathers {
                arriving += core::mem::replace(&mut own.arriving[i], Arriving::NOTHING);
            }
            let (f, external) = (self.joint_wrench[i], self.external[i]);
            let inertial = self.inertia[i].mul(self.acceleration[i]);
            let rest = (f + external) - (inertial + arriving.taken);
            let size = (Size::of_force(f).or(Size::of_force(external)))
                .or(Size::of_force(inertial).or(arriving.size));
            worst = worst.max(size.left(Size::of_force(rest)));
            let load = match loads {
                Loads::Left | Loads::Settled => rest,
                Loads::Rounding => {
                    let turned = Size::of_turning(&self.inertia[i], self.acceleration[i]);
                    size.or(turned).rounding(i)
                }
            };
            let bias = arriving.bias - load;
            own.biases[i] = bias;
            let passed = match kind {
                Kind::Revolute | Kind::Prismatic => {
                    let column = self.subspace[v];
                    let u = if kind == Kind::Revolute {
                        -column.angular.dot(bias.angular)
                    } else {
                        -column.linear.dot(bias.linear)
                    };
                    own.u[v] = u;
                    bias + self.u_columns[v] * (u * self.d_inverse[i])
                }
                _ => self.let_go_again(i, own, bias),
            };
            arriving = Arriving::NOTHING;
            if let Some(parent) = parent {
                let r = self.offset[i];
                let taken = f.shifted_back(r);
                let handed = Arriving {
                    taken,
                    bias: passed.shifted_back(r),
                    size: Size::of_force(taken),
                };
                if parent + 1 == i {
                    arriving = handed;
                } else {
                    own.arriving[parent] += handed;
                }
            }
        }
        worst
    }

    /// Takes what a joint of no or several freedoms lets go out of a bias force.
    fn let_go_again(&self, i: usize, own: &mut Corrections<T>, bias: Force<T>) -> Force<T> {
        let mut passed = bias;
        let dofs = self.dofs(i);
        let mut response = [T::ZERO; 6];
        for (dof, response) in dofs.clone().zip(&mut response) {
            *response = -self.subspace[dof].dot(passed);
            own.u[dof] = *response;
        }
        self.solve_pivots(i, &mut response);
        for (dof, response) in dofs.zip(response) {
            passed += self.u_columns[dof] * response;
        }
        // As in the solution, what these let go is exactly nothing, unless they have inertia of their own.
        match self.links[i].kind {
            _ if self.holds(i) => {}
            Kind::Spherical => passed.angular = Vec3::ZERO,
            Kind::Free => passed = Force::ZERO,
            _ => {}
        }
        passed
    }

    /// Down: corrects the bodies' accelerations and transmitted forces.
    fn respond_again(&mut self, own: &mut Corrections<T>) {
        let mut last = Motion::ZERO;
        for i in 0..self.links.len() {
            let Link {
                parent,
                kind,
                v,
                gathers,
                ..
            } = self.links[i];
            let above = match parent {
                Some(parent) if parent + 1 == i => last,
                Some(parent) => own.accelerations[parent],
                None => Motion::ZERO,
            };
            let mut a = above.shifted(self.offset[i]);
            let mut f;
            match kind {
                // U' a' = (X' U)' a_parent does not wait for a'.
                Kind::Revolute => {
                    let axis = self.subspace[v].angular;
                    let response = (own.u[v] - above.dot(self.above[v].0)) * self.d_inverse[i];
                    own.u[v] = response;
                    a.angular += axis * response;
                    f = self.articulated[i].mul(a) + own.biases[i];
                    f.angular -= axis * (axis.dot(f.angular) + self.added[v] * response);
                }
                Kind::Prismatic => {
                    let axis = self.subspace[v].linear;
                    let response = (own.u[v] - above.dot(self.above[v].0)) * self.d_inverse[i];
                    own.u[v] = response;
                    a.linear += axis * response;
                    f = self.articulated[i].mul(a) + own.biases[i];
                    f.linear -= axis * (axis.dot(f.linear) + self.added[v] * response);
                }
                _ => {
                    let dofs = self.dofs(i);
                    let mut response = [T::ZERO; 6];
                    for (dof, response) in dofs.clone().zip(&mut response) {
                        *response = own.u[dof] - a.dot(self.u_columns[dof]);
                    }
                    self.solve_pivots(i, &mut response);
                    for (dof, response) in dofs.clone().zip(response) {
                        a += self.subspace[dof] * response;
                        own.u[dof] = response;
                    }
                    f = self.articulated[i].mul(a) + own.biases[i];
                    let held = self.own(i).mul(&response[..dofs.len()]);
                    let tau = held.map(|held| -held);
                    f = transmitted(f, &self.subspace[dofs], &tau);
                }
            }
            if gathers {
                own.accelerations[i] = a;
            }
            last = a;
            self.acceleration[i] += a;
            self.joint_wrench[i] += f;
        }
    }

    /// Multiplies with D^-1 of a joint, which of one freedom is a number.
    fn solve_pivots(&self, i: usize, response: &mut [T; 6]) {
        if self.links[i].kind.dof_count() == 1 {
            response[0] = response[0] * self.d_inverse[i];
        } else if let Some(Some(factor)) = self.factors.get(self.factor_of[i] as usize) {
            factor.solve(response);
        }
    }
}
