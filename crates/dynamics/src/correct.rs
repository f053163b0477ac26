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

use crate::drive::transmitted;
use crate::link::Kind;
use crate::refine::{enlarge, left, relative};
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Refinement, Workspace, finite_results, joint_wrenches};
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Memory of the corrections, one entry a body unless it says otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Corrections<T> {
    /// What the children take of a body's force, about its origin, and their bias forces; zero between
    /// corrections, as is the next.
    arriving: Vec<[Force<T>; 2]>,
    /// The largest entries of the forces that children take.
    sizes: Vec<[T; 6]>,
    /// pA.
    biases: Vec<Force<T>>,
    accelerations: Vec<Motion<T>>,
    /// u, then the correction of qdd; one entry a freedom.
    u: Vec<T>,
}

impl<T: Real> Corrections<T> {
    fn new(bodies: usize, freedoms: usize) -> Self {
        Self {
            arriving: vec![[Force::ZERO; 2]; bodies],
            sizes: vec![[T::ZERO; 6]; bodies],
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
        let mut worst = 0.0_f64;
        for i in (0..self.links.len()).rev() {
            worst = worst.max(self.gather_again(i, own));
        }
        for i in 0..self.links.len() {
            self.respond_again(i, own);
        }
        worst
    }

    /// Up through one joint; gives what the body's equation leaves, as part of its largest term.
    fn gather_again(&self, i: usize, own: &mut Corrections<T>) -> f64 {
        let (f, external) = (self.joint_wrench[i], self.external[i]);
        let inertial = self.inertia[i].mul(self.acceleration[i]);
        let [taken, bias] = core::mem::replace(&mut own.arriving[i], [Force::ZERO; 2]);
        let mut size = core::mem::replace(&mut own.sizes[i], [T::ZERO; 6]);
        for term in [f, external, inertial] {
            enlarge(&mut size, term.to_array());
        }
        let load = f + external - inertial - taken;
        let bias = bias - load;
        own.biases[i] = bias;

        let mut passed = bias;
        let dofs = self.dofs(i);
        if let ([column], [u_column]) =
            (&self.subspace[dofs.clone()], &self.u_columns[dofs.clone()])
        {
            let u = -column.dot(bias);
            own.u[dofs.start] = u;
            passed += *u_column * (u * self.d_inverse[i]);
        } else {
            self.let_go_again(i, own, &mut passed);
        }
        if let Some(parent) = self.links[i].parent {
            let taken = f.shifted_back(self.offset[i]);
            enlarge(&mut own.sizes[parent], taken.to_array());
            own.arriving[parent][0] += taken;
            own.arriving[parent][1] += passed.shifted_back(self.offset[i]);
        }
        left(load.to_array(), &size)
    }

    /// Takes what a joint of no or several freedoms lets go out of the bias force.
    fn let_go_again(&self, i: usize, own: &mut Corrections<T>, passed: &mut Force<T>) {
        let dofs = self.dofs(i);
        let mut response = [T::ZERO; 6];
        for (dof, response) in dofs.clone().zip(&mut response) {
            *response = -self.subspace[dof].dot(*passed);
            own.u[dof] = *response;
        }
        self.solve_pivots(i, &mut response);
        for (dof, response) in dofs.zip(response) {
            *passed += self.u_columns[dof] * response;
        }
        // As in the solution, what these let go is exactly nothing, unless they have inertia of their own.
        match self.links[i].kind {
            _ if self.holds(i) => {}
            Kind::Spherical => passed.angular = Vec3::ZERO,
            Kind::Free => *passed = Force::ZERO,
            _ => {}
        }
    }

    /// Down through one joint; corrects the body's acceleration and transmitted force.
    fn respond_again(&mut self, i: usize, own: &mut Corrections<T>) {
        let dofs = self.dofs(i);
        let mut a = self.links[i].parent.map_or(Motion::ZERO, |parent| {
            own.accelerations[parent].shifted(self.offset[i])
        });
        if let ([column], [u_column]) =
            (&self.subspace[dofs.clone()], &self.u_columns[dofs.clone()])
        {
            let response = (own.u[dofs.start] - a.dot(*u_column)) * self.d_inverse[i];
            a += *column * response;
            own.u[dofs.start] = response;
        } else {
            let mut response = [T::ZERO; 6];
            for (dof, response) in dofs.clone().zip(&mut response) {
                *response = own.u[dof] - a.dot(self.u_columns[dof]);
            }
            self.solve_pivots(i, &mut response);
            for (dof, response) in dofs.clone().zip(response) {
                a += self.subspace[dof] * response;
                own.u[dof] = response;
            }
        }
        own.accelerations[i] = a;
        self.acceleration[i] += a;
        let f = self.articulated[i].mul(a) + own.biases[i];
        let mut tau = [T::ZERO; 6];
        for (tau, dof) in tau.iter_mut().zip(dofs.clone()) {
            *tau = -self.added[dof] * own.u[dof];
        }
        self.joint_wrench[i] += transmitted(f, &self.subspace[dofs], &tau);
    }

    /// Multiplies with D^-1 of a joint of several freedoms.
    fn solve_pivots(&self, i: usize, response: &mut [T; 6]) {
        if let Some(Some(factor)) = self.factors.get(self.factor_of[i] as usize) {
            factor.solve(response);
        }
    }
}
