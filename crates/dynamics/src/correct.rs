//! Iterative refinement of what the articulated-body algorithm computed.
//!
//! The solution leaves, of the equations of a body and its joint,
//!
//! r = external + f - I a - sum over children of X' f_child,   j = X a_parent + c + S qdd - a,
//!
//! and S'f = tau to rounding. The correction solves the same equations for bodies at rest on which r
//! acts and in whose joints accelerations jump by j, with the factors at hand (symbols of
//! [`aba`](crate::aba)). Up: pA = -r + sum of X' pa, u = -S' pA, pa = pA + IA j + U D^-1 (u - U'j). Down:
//! a' = X a_parent + j, qdd = D^-1 (u - U'a'), a = a' + S qdd; then f = IA a + pA.

use crate::drive::transmitted;
use crate::link::Kind;
use crate::refine::{larger, left, relative, size};
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Refinement, Workspace, finite_results, joint_wrenches};
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Memory of the corrections, one entry a body unless it says otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Corrections<T> {
    /// r.
    loads: Vec<Force<T>>,
    /// The largest entry of any of r's terms.
    sizes: Vec<T>,
    /// j.
    jumps: Vec<Motion<T>>,
    /// pA.
    biases: Vec<Force<T>>,
    accelerations: Vec<Motion<T>>,
    /// u, then the correction of qdd; one entry a freedom.
    u: Vec<T>,
}

impl<T: Real> Corrections<T> {
    fn new(bodies: usize, freedoms: usize) -> Self {
        Self {
            loads: vec![Force::ZERO; bodies],
            sizes: vec![T::ZERO; bodies],
            jumps: vec![Motion::ZERO; bodies],
            biases: vec![Force::ZERO; bodies],
            accelerations: vec![Motion::ZERO; bodies],
            u: vec![T::ZERO; freedoms],
        }
    }
}

impl Workspace {
    /// Corrects the solution of the last [`aba`](crate::aba) once.
    pub(crate) fn correct(&mut self, forces: &Forces) -> Result<Refinement, Error> {
        forces.check(&self.model)?;
        if !self.computed.joint_wrenches {
            joint_wrenches(self)?;
        }
        self.computed.accelerations = false;
        self.computed.joint_wrenches = false;
        let (qdd, scales) = (&mut self.qdd, &self.scales.acceleration);
        let mut refined = Refinement::default();
        let failed = in_precision!(&mut self.arrays, s => {
            let mut own = (s.corrections.take())
                .unwrap_or_else(|| Corrections::new(s.links.len(), s.u.len()).into());
            refined.residual = s.correct(&mut own);
            let (mut change, mut largest) = (0.0_f64, 0.0_f64);
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
        Ok(refined)
    }
}

impl<T: Real> Sweeps<T> {
    /// Corrects accelerations and transmitted forces; leaves the correction of qdd in `u`. Gives the
    /// residual before.
    fn correct(&mut self, own: &mut Corrections<T>) -> f64 {
        let mut worst = self.measure(own);
        for i in (0..self.links.len()).rev() {
            worst = worst.max(left(own.loads[i].to_array(), own.sizes[i]));
            self.gather_again(i, own);
        }
        for i in 0..self.links.len() {
            self.respond_again(i, own);
        }
        worst
    }

    /// r and j of all bodies; gives the largest part of a joint's accelerations that j is.
    fn measure(&self, own: &mut Corrections<T>) -> f64 {
        let mut worst = 0.0_f64;
        for i in 0..self.links.len() {
            let (a, f) = (self.acceleration[i], self.joint_wrench[i]);
            let parent = self.links[i].parent;
            let above = parent.map_or(self.base, |parent| {
                self.acceleration[parent].shifted(self.offset[i])
            });
            let mut matched = above + self.bias_acceleration[i];
            let scale = size([a.to_array(), matched.to_array()]);
            for dof in self.dofs(i) {
                matched += self.subspace[dof] * self.u[dof];
            }
            let jump = matched - a;
            worst = worst.max(left(jump.to_array(), scale));
            own.jumps[i] = jump;

            let inertial = self.inertia[i].mul(a);
            own.loads[i] = f + self.external[i] - inertial;
            own.sizes[i] = size([f, self.external[i], inertial].map(Force::to_array));
            own.biases[i] = Force::ZERO;
            if let Some(parent) = parent {
                let taken = f.shifted_back(self.offset[i]);
                own.loads[parent] -= taken;
                own.sizes[parent] = larger(own.sizes[parent], size([taken.to_array()]));
            }
        }
        worst
    }

    /// Up through one joint.
    fn gather_again(&self, i: usize, own: &mut Corrections<T>) {
        let dofs = self.dofs(i);
        let jump = own.jumps[i];
        let bias = own.biases[i] - own.loads[i];
        own.biases[i] = bias;
        let mut passed = bias + self.articulated[i].mul(jump);
        let mut response = [T::ZERO; 6];
        for (k, dof) in dofs.clone().enumerate() {
            own.u[dof] = -self.subspace[dof].dot(bias);
            response[k] = own.u[dof] - jump.dot(self.u_columns[dof]);
        }
        self.solve_pivots(i, &mut response);
        for (dof, response) in dofs.zip(response) {
            passed += self.u_columns[dof] * response;
        }
        // As in the solution, what these let go is exactly nothing.
        match self.links[i].kind {
            Kind::Spherical => passed.angular = Vec3::ZERO,
            Kind::Free => passed = Force::ZERO,
            _ => {}
        }
        if let Some(parent) = self.links[i].parent {
            own.biases[parent] += passed.shifted_back(self.offset[i]);
        }
    }

    /// Down through one joint; corrects the body's acceleration and transmitted force.
    fn respond_again(&mut self, i: usize, own: &mut Corrections<T>) {
        let dofs = self.dofs(i);
        let mut a = own.jumps[i];
        if let Some(parent) = self.links[i].parent {
            a += own.accelerations[parent].shifted(self.offset[i]);
        }
        let mut response = [T::ZERO; 6];
        for (k, dof) in dofs.clone().enumerate() {
            response[k] = own.u[dof] - a.dot(self.u_columns[dof]);
        }
        self.solve_pivots(i, &mut response);
        for (dof, response) in dofs.clone().zip(response) {
            a += self.subspace[dof] * response;
            own.u[dof] = response;
        }
        own.accelerations[i] = a;
        self.acceleration[i] += a;
        let f = self.articulated[i].mul(a) + own.biases[i];
        let still = [T::ZERO; 6];
        self.joint_wrench[i] += transmitted(self.links[i].kind, f, &self.subspace[dofs], &still);
    }

    /// Multiplies with D^-1.
    fn solve_pivots(&self, i: usize, response: &mut [T; 6]) {
        match self.links[i].kind {
            Kind::Fixed => {}
            Kind::Revolute | Kind::Prismatic => response[0] = response[0] * self.d_inverse[i],
            Kind::Spherical | Kind::Free => {
                if let Some(factor) = &self.factors[self.factor_of[i] as usize] {
                    factor.solve(response);
                }
            }
        }
    }
}
