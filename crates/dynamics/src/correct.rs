//! Iterative refinement of what the articulated-body algorithm computed.
//!
//! With forces f that the joints transmit, a solution leaves, of the equations of a body,
//!
//! r = external + f - I a - sum over children of X' f_child;
//!
//! S'f = tau - E qdd and a = X a_parent + c + S qdd hold to rounding, since they are computed so. The correction
//! solves the same equations for bodies at rest on which r acts, with the factors at hand (symbols of
//! [`aba`](crate::aba)). Up: pA = -r + sum of X' pa, u = -S' pA, pa = pA + U D^-1 u. Down: a' = X a_parent,
//! qdd = D^-1 (u - U'a'), a = a' + S qdd. Both are added to those of the solution, pA too.
//!
//! Any f near those of the solution will do: how far off they are is in r. IA a + pA is right everywhere but costs
//! as much as the rest of a body together; what balances the body, r = 0 but for what S'f = tau then takes out, is
//! at hand. But summed from the tips the error of a joint's acceleration would come out n^3 times as large, or more. So
//! forces are summed over **runs** of [`RUN`] bodies, which start anew from IA a + pA.
//!
//! What is left by one is the [drift](crate::drift) of the bodies' places. The second takes it out first: a
//! is made to fit the joints where these then are, and r shows what that moves.

use crate::across::Given;
use crate::balance::least_forces;
use crate::drift::Drift;
use crate::link::{Kind, Link};
use crate::refine::{Loads, Size, relative};
use crate::residual::worst_of;
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Refinement, Workspace, finite_results};
use core::ops::AddAssign;
use vertebra_assembly::{Model, Units};
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// Bodies of a run. Sixteen are short enough for f32, and what starts a run is no longer noticed.
const RUN: usize = 16;

/// Memory of the corrections, one entry a body unless it says otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Corrections<T> {
    of_body: Vec<OfBody<T>>,
    /// What children other than the next body hand on; nothing between corrections.
    arriving: Vec<Arriving<T>>,
    /// Of bodies that have children other than the next.
    accelerations: Vec<Motion<T>>,
    /// u, then the correction of qdd; one entry a freedom.
    u: Vec<T>,
    /// None in the reference precision.
    drift: Option<Drift>,
}

/// What is known of a body's equation.
#[derive(Clone, Copy, Debug)]
struct OfBody<T> {
    /// Whether what its joint transmits is summed, and not the start of a run.
    sums: bool,
    /// What its terms are at least ([`least_forces`]).
    least: T,
}

/// What children hand on to a body, about its origin.
#[derive(Clone, Copy, Debug)]
struct Arriving<T> {
    /// What they take of its force.
    taken: Force<T>,
    /// Their bias force.
    bias: Force<T>,
    /// Size of what they take, where rounding is the load.
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

impl<T> Corrections<T> {
    /// Whether what a body's joint transmits is summed from what its children take.
    pub(crate) fn sums(&self, body: usize) -> bool {
        self.of_body[body].sums
    }
}

impl<T: Real> Corrections<T> {
    fn new(bodies: usize, freedoms: usize, model: &Model) -> Self {
        let mut depths: Vec<usize> = Vec::with_capacity(bodies);
        for body in model.bodies() {
            let depth = (body.parent).map_or(0, |parent| depths[parent.index()] + 1);
            depths.push(depth);
        }
        let least = least_forces(model).into_iter().map(T::from_f64);
        let of_body = depths.iter().zip(least).map(|(depth, least)| OfBody {
            sums: depth % RUN != 0,
            least,
        });
        Self {
            of_body: of_body.collect(),
            drift: Drift::of(model, T::EPSILON.to_f64()),
            arriving: vec![Arriving::NOTHING; bodies],
            accelerations: vec![Motion::ZERO; bodies],
            u: vec![T::ZERO; freedoms],
        }
    }
}

impl Workspace {
    /// Corrects the solution of the last [`aba`](crate::aba) once, or finds the response to other loads.
    pub(crate) fn correct(&mut self, forces: &Forces, loads: Loads) -> Result<Refinement, Error> {
        forces.check(&self.model)?;
        self.joint_accelerations()?;
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
            refined.residual = match loads {
                Loads::Left | Loads::Settled => s.gather_again::<false>(&mut own),
                Loads::Rounding => s.gather_again::<true>(&mut own),
            };
            let finite = match loads {
                Loads::Left | Loads::Settled => s.respond_again::<false>(&mut own),
                Loads::Rounding => s.respond_again::<true>(&mut own),
            };
            let (mut change, mut largest) = (0.0_f64, least);
            for (k, &by) in own.u.iter().enumerate() {
                if loads != Loads::Rounding {
                    s.u[k] += by;
                    qdd[k] = Real::to_f64(s.u[k]) * scales[k];
                }
                largest = largest.max(qdd[k].abs());
                change = worst_of(change, Real::to_f64(by).abs() * scales[k]);
            }
            refined.change = relative(change, largest);
            s.corrections = Some(own);
            s.acceleration.iter().position(|a| !(finite || a.is_finite()))
        });
        self.refuse_overflow("acceleration", failed)?;
        finite_results(&self.model, "joint acceleration", &self.qdd, self.time)?;
        self.computed.accelerations = true;
        self.computed.corrected |= loads != Loads::Rounding;
        self.computed.settled |= settles;
        Ok(refined)
    }
}

impl Workspace {
    /// What forces as large as the rounding of the bodies' equations move, as part of the largest acceleration
    /// ([`Loads::Rounding`]).
    #[cfg(feature = "gpu")]
    pub(crate) fn response_to_rounding(&mut self, forces: &Forces) -> Result<f64, Error> {
        let response = self.correct(forces, Loads::Rounding)?;
        Ok(response.change)
    }
}

impl<T: Real> Sweeps<T> {
    /// Takes the drift out of the bodies' places. Of the solution, the accelerations are summed up again from
    /// those of the joints.
    fn settle(&mut self, drift: &mut Drift, given: &Given<'_>, forces: &Forces, units: &Units) {
        let (links, rotations, spins) = (&self.links, &self.rotation, &self.spin);
        let place = |i: usize| (rotations[i], spins[i]);
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
            for (&qdd, &column) in self.u[dofs].iter().zip(&*columns) {
                a += column * qdd;
            }
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
    ///
    /// Joints of one freedom are worked through in place: a force that some path takes through memory waits there
    /// for as long as the rest of a body takes.
    fn gather_again<const ROUNDING: bool>(&mut self, own: &mut Corrections<T>) -> f64 {
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
            let external = self.external[i];
            let inertial = self.inertia[i].mul(self.acceleration[i]);
            let balanced = inertial - external + arriving.taken;
            let OfBody { sums, least } = own.of_body[i];
            let mut f = if sums { balanced } else { self.whole_force(i) };
            match kind {
                Kind::Revolute => {
                    let axis = self.subspace[v].angular;
                    f.angular -= axis * (axis.dot(f.angular) - self.driving(v));
                }
                Kind::Prismatic => {
                    let axis = self.subspace[v].linear;
                    f.linear -= axis * (axis.dot(f.linear) - self.driving(v));
                }
                // All that acts is handed on.
                Kind::Fixed if sums && !ROUNDING => {
                    self.bias[i] += arriving.bias;
                    let r = self.offset[i];
                    let handed = Arriving {
                        taken: balanced.shifted_back(r),
                        bias: arriving.bias.shifted_back(r),
                        size: Size::ZERO,
                    };
                    arriving = self.hand_on_again(i, own, handed);
                    continue;
                }
                _ => {
                    let handed = self.gather_several::<ROUNDING>(i, own, &arriving, &mut worst);
                    arriving = self.hand_on_again(i, own, handed);
                    continue;
                }
            }
            let rest = f - balanced;
            // Of four terms that cancel the largest is at most three times as large as that of the others, and of
            // those that do not, as what they leave and the others. Beside weights, of which I a is without.
            let size =
                (Size::of_force(f).or(Size::of_force(external))).or(Size::of_force(inertial));
            worst = worst_of(worst, size.or_weight(least).leaving(rest));
            let load = if ROUNDING {
                self.rounding(i, size.or(arriving.size))
            } else {
                rest
            };
            let bias = arriving.bias - load;
            if !ROUNDING {
                self.bias[i] += bias;
            }
            let u = -self.subspace[v].dot(bias);
            own.u[v] = u;
            let passed = bias + self.u_columns[v] * (u * self.d_inverse[i]);
            let r = self.offset[i];
            let taken = f.shifted_back(r);
            let handed = Arriving {
                taken,
                bias: passed.shifted_back(r),
                size: if ROUNDING {
                    Size::of_force(taken)
                } else {
                    Size::ZERO
                },
            };
            arriving = match parent {
                Some(parent) if parent + 1 == i => handed,
                _ => self.hand_on_again(i, own, handed),
            };
        }
        worst
    }

    /// Puts what a body hands on where its parent finds it; gives what is at hand for the next body.
    #[inline(always)]
    fn hand_on_again(
        &self,
        i: usize,
        own: &mut Corrections<T>,
        handed: Arriving<T>,
    ) -> Arriving<T> {
        match self.links[i].parent {
            Some(parent) if parent + 1 == i => return handed,
            Some(parent) => own.arriving[parent] += handed,
            None => {}
        }
        Arriving::NOTHING
    }

    /// A force as large as the rounding of a body's equation, given the size of its terms.
    fn rounding(&self, i: usize, size: Size<T>) -> Force<T> {
        let turned = Size::of_turning(&self.inertia[i], self.acceleration[i]);
        size.or(turned).rounding(i)
    }

    /// The same of a body whose joint has no or several freedoms, given what arrives: what it hands on.
    fn gather_several<const ROUNDING: bool>(
        &mut self,
        i: usize,
        own: &mut Corrections<T>,
        arriving: &Arriving<T>,
        worst: &mut f64,
    ) -> Arriving<T> {
        let external = self.external[i];
        let inertial = self.inertia[i].mul(self.acceleration[i]);
        let balanced = inertial - external + arriving.taken;
        let OfBody { sums, least } = own.of_body[i];
        let f = if sums { balanced } else { self.whole_force(i) };
        let f = self.driven_right(i, f);
        let rest = f - balanced;
        let size = (Size::of_force(f).or(Size::of_force(external))).or(Size::of_force(inertial));
        *worst = worst_of(*worst, size.or_weight(least).leaving(rest));
        let load = if ROUNDING {
            self.rounding(i, size.or(arriving.size))
        } else {
            rest
        };
        let bias = arriving.bias - load;
        if !ROUNDING {
            self.bias[i] += bias;
        }
        let passed = self.let_go_again(i, own, bias);
        let r = self.offset[i];
        let taken = f.shifted_back(r);
        Arriving {
            taken,
            bias: passed.shifted_back(r),
            size: Size::of_force(taken),
        }
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

    /// Down: corrects the bodies' accelerations, unless what responds is [`Loads::Rounding`]; says whether they are finite.
    fn respond_again<const ROUNDING: bool>(&mut self, own: &mut Corrections<T>) -> bool {
        let mut last = Motion::ZERO;
        let mut finite = true;
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
            match kind {
                // U' a' = (X' U)' a_parent does not wait for a'.
                Kind::Revolute => {
                    let axis = self.subspace[v].angular;
                    let response = (own.u[v] - above.dot(self.above[v].0)) * self.d_inverse[i];
                    own.u[v] = response;
                    a.angular += axis * response;
                }
                Kind::Prismatic => {
                    let axis = self.subspace[v].linear;
                    let response = (own.u[v] - above.dot(self.above[v].0)) * self.d_inverse[i];
                    own.u[v] = response;
                    a.linear += axis * response;
                }
                Kind::Fixed => {}
                _ => {
                    let dofs = self.dofs(i);
                    let mut response = [T::ZERO; 6];
                    for (dof, response) in dofs.clone().zip(&mut response) {
                        *response = own.u[dof] - a.dot(self.u_columns[dof]);
                    }
                    self.solve_pivots(i, &mut response);
                    for (dof, response) in dofs.zip(response) {
                        a += self.subspace[dof] * response;
                        own.u[dof] = response;
                    }
                }
            }
            if gathers {
                own.accelerations[i] = a;
            }
            last = a;
            if !ROUNDING {
                a += self.acceleration[i];
                self.acceleration[i] = a;
            }
            finite &= a.is_finite();
        }
        finite
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
