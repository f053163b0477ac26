//! Joint-space solutions with the factors at hand: H x = tau, and J H^-1 J' by its square root.
//!
//! [`aba`](crate::aba) leaves the factors of the joint-space inertia H in innovations form (Rodriguez, Jain
//! and Kreutz-Delgado, J. Astronaut. Sci. 40, 1992). One sweep up,
//!
//! pA = sum over children of X' pa, u = tau - S' pA, pa = pA + U D^-1 u,
//!
//! and one down, a' = X a_parent, x = D^-1 (u - U' a'), a = a' + S x, solve for one right-hand side. The
//! sweep up alone is a triangular solution: with y = D^(-1/2) u, tau' H^-1 tau = y' y. A force that acts on
//! one body moves only the joints between it and the world on the way up, so that an entry of J H^-1 J'
//! costs as many operations as the tree is deep.

use crate::Workspace;
use crate::drive::driven;
use crate::link::Kind;
use crate::workspace::{Sweeps, in_precision};
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Memory of the substitutions, one entry a body unless it says otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Substitution<T> {
    /// Bias forces from the children; zero between substitutions.
    arriving: Vec<Force<T>>,
    accelerations: Vec<Motion<T>>,
    /// The right-hand side, then u, then x; one entry a freedom.
    x: Vec<T>,
}

impl<T: Real> Substitution<T> {
    fn new(bodies: usize, freedoms: usize) -> Self {
        Self {
            arriving: vec![Force::ZERO; bodies],
            accelerations: vec![Motion::ZERO; bodies],
            x: vec![T::ZERO; freedoms],
        }
    }
}

impl Workspace {
    /// Replaces joint forces by the accelerations H^-1 tau that they cause, both in the model's units,
    /// with the factors of the last [`aba`](crate::aba).
    pub(crate) fn substitute(&mut self, values: &mut [f64]) {
        in_precision!(&mut self.arrays, s => s.with_substitution(|s, own| {
            for (x, &value) in own.x.iter_mut().zip(&*values) {
                *x = vertebra_spatial::Number::from_f64(value);
            }
            s.substitute(own);
            for (value, &x) in values.iter_mut().zip(&own.x) {
                *value = Real::to_f64(x);
            }
        }));
    }

    /// Replaces joint forces tau, in the model's units, by y with y' y = tau' H^-1 tau. `row` has the
    /// freedoms of `bodies`, which are the bodies that tau acts on and all theirs up to the world, parents
    /// first.
    pub(crate) fn whiten(&mut self, bodies: &[usize], row: &mut [f64]) {
        in_precision!(&mut self.arrays, s => {
            s.with_substitution(|s, own| s.whiten(bodies, row, &mut own.arriving));
        });
    }
}

impl<T: Real> Sweeps<T> {
    /// Lends the memory of substitutions, taken when it is first asked for.
    fn with_substitution(&mut self, work: impl FnOnce(&Self, &mut Substitution<T>)) {
        let mut own = (self.substitution.take())
            .unwrap_or_else(|| Substitution::new(self.links.len(), self.u.len()).into());
        work(self, &mut own);
        self.substitution = Some(own);
    }

    fn substitute(&self, own: &mut Substitution<T>) {
        for i in (0..self.links.len()).rev() {
            let dofs = self.dofs(i);
            let passed = self.let_go_of(i, &mut own.arriving[i], &mut own.x[dofs]);
            if let Some(parent) = self.links[i].parent {
                own.arriving[parent] += passed.shifted_back(self.offset[i]);
            }
        }
        for i in 0..self.links.len() {
            let dofs = self.dofs(i);
            let mut a = self.links[i].parent.map_or(Motion::ZERO, |parent| {
                own.accelerations[parent].shifted(self.offset[i])
            });
            let mut response = [T::ZERO; 6];
            for (response, dof) in response.iter_mut().zip(dofs.clone()) {
                *response = own.x[dof] - a.dot(self.u_columns[dof]);
            }
            self.solve_pivot(i, &mut response);
            for (dof, response) in dofs.zip(response) {
                a += self.subspace[dof] * response;
                own.x[dof] = response;
            }
            own.accelerations[i] = a;
        }
    }

    fn whiten(&self, bodies: &[usize], row: &mut [f64], arriving: &mut [Force<T>]) {
        let mut end = row.len();
        for &i in bodies.iter().rev() {
            let start = end - self.links[i].kind.dof_count();
            let mut u = [T::ZERO; 6];
            for (u, &tau) in u.iter_mut().zip(&row[start..end]) {
                *u = T::from_f64(tau);
            }
            let passed = self.let_go_of(i, &mut arriving[i], &mut u[..end - start]);
            if let Some(parent) = self.links[i].parent {
                arriving[parent] += passed.shifted_back(self.offset[i]);
            }
            match self.links[i].kind.dof_count() {
                0 => {}
                1 => u[0] = u[0] * self.d_inverse[i].sqrt(),
                _ => {
                    if let Some(factor) = &self.factors[self.factor_of[i] as usize] {
                        factor.solve_lower(&mut u);
                    }
                }
            }
            for (y, u) in row[start..end].iter_mut().zip(u) {
                *y = u.to_f64();
            }
            end = start;
        }
    }

    /// Takes what has arrived at a body through its joint: `tau` becomes u; gives what is passed on.
    #[inline]
    fn let_go_of(&self, i: usize, arriving: &mut Force<T>, tau: &mut [T]) -> Force<T> {
        let bias = core::mem::take(arriving);
        let dofs = self.dofs(i);
        let drive = driven(&self.subspace[dofs.clone()], tau);
        let mut response = [T::ZERO; 6];
        for ((response, tau), dof) in response.iter_mut().zip(&mut *tau).zip(dofs.clone()) {
            *tau -= self.subspace[dof].dot(bias);
            *response = *tau;
        }
        self.solve_pivot(i, &mut response);
        let mut passed = bias;
        for (dof, response) in dofs.zip(response) {
            passed += self.u_columns[dof] * response;
        }
        // As in the solution, these let everything go but what drives them, unless they have inertia of
        // their own.
        match self.links[i].kind {
            _ if self.holds(i) => {}
            Kind::Spherical => passed.angular = drive.angular,
            Kind::Free => passed = drive,
            _ => {}
        }
        passed
    }

    /// Multiplies with D^-1 of a body's joint.
    #[inline]
    fn solve_pivot(&self, i: usize, response: &mut [T; 6]) {
        match self.links[i].kind.dof_count() {
            0 => {}
            1 => response[0] = response[0] * self.d_inverse[i],
            _ => {
                if let Some(factor) = &self.factors[self.factor_of[i] as usize] {
                    factor.solve(response);
                }
            }
        }
    }

    /// From the origin of a body's frame to a point of the body, given in its own frame in the model's
    /// units, world axes.
    pub(crate) fn arm(&self, body: usize, point: Vec3<T>) -> Vec3<T> {
        self.rotation[body] * self.frames[body].placement.point(point)
    }

    /// A body and its ancestors, outwards from the world.
    pub(crate) fn path_to(&self, body: usize) -> Vec<usize> {
        let mut path = vec![body];
        let mut at = body;
        while let Some(parent) = self.links[at].parent {
            path.push(parent);
            at = parent;
        }
        path.reverse();
        path
    }
}
