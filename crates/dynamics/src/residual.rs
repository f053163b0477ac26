//! The residual of the bodies' own equations: how well a solution solves what it claims to.
//!
//! Of every body and joint three equations are evaluated, in f64 or, for the reference, in its own
//! precision:
//! - Newton-Euler: I a + bias - external - f + sum over children of X' f_child = 0 (6 rows),
//! - acceleration match: a - X a_parent - c - S qdd = 0 (6 rows),
//! - joint force: S' f - tau + E qdd = 0 (one row a freedom), E the inertia of its own.
//!
//! Each row is divided by the sum of the absolute values of its terms (products of a matrix and a
//! vector count entry by entry), which makes it a backward error: 1e-16 says that the solution solves a
//! problem whose numbers differ from the given ones in the 16th digit. Unlike the residual of the joint
//! torques it does not grow with the condition of the joint-space mass matrix.
//!
//! Taken row by row it is as strict as can be, and too strict where a sum is zero by construction: on a
//! planar robot, or for the moment in a ball joint made of three hinges, all terms of a row are
//! rounding, and the row reads 1. [`Residual::by_body`] therefore lets all rows of a body share the
//! largest of their sums, in the model's own units. Weights count there too: accelerations leave gravity out, so that of a body
//! that only falls the others are nothing but rounding.

use crate::balance::least_forces;
use crate::link::Scales;
use crate::refine::Loads;
use crate::workspace::{Sweeps, Workspace, in_precision};
use crate::{Error, Forces, Refinement};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Force, Motion, Real, RigidInertia, Sym3, Vec3, vec3};

/// The largest row-scaled residual of each kind of equation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residual {
    /// Of the bodies' Newton-Euler equations.
    pub newton_euler: f64,
    /// Of the accelerations across the joints.
    pub acceleration: f64,
    /// Of the joint forces.
    pub joint_force: f64,
    /// Of all of them, where the rows of one body share the largest of their scales.
    pub by_body: f64,
}

impl Residual {
    /// The largest, row by row.
    #[must_use]
    pub fn max(&self) -> f64 {
        worst_of(
            worst_of(self.newton_euler, self.acceleration),
            self.joint_force,
        )
    }

    fn is_finite(&self) -> bool {
        self.max().is_finite() && self.by_body.is_finite()
    }
}

/// What a solver has found, so that its [`residual`] can be taken and it can be [refined](crate::refine): implemented by [`Workspace`] and
/// [`DcaWorkspace`](crate::DcaWorkspace).
pub trait Solved: sealed::Sealed {
    /// Evaluates the equations for this solution; [`residual`] is the function to call.
    ///
    /// # Errors
    /// As that function's.
    fn residual(&self, model: &Model, state: &State, forces: &Forces) -> Result<Residual, Error>;

    /// Corrects this solution once; [`refine`](crate::refine) is the function to call.
    ///
    /// # Errors
    /// As that function's.
    fn refine(&mut self, forces: &Forces) -> Result<Refinement, Error>;
}

pub(crate) mod sealed {
    pub trait Sealed {}
}

/// Residual of the bodies' own equations of what a solver, [`aba`](crate::aba) or
/// [`dca`](crate::dca), and the joint forces computed after it ([`joint_wrenches`](crate::joint_wrenches),
/// [`DcaWorkspace::compute_joint_wrenches`](crate::DcaWorkspace::compute_joint_wrenches)) left in
/// `solved` for this state and these forces.
///
/// Evaluated in f64, or in the reference precision if that is the solver's, on the solution before
/// it is rounded to f64. Takes memory of its own, so it is a measurement and not part of a step.
///
/// # Errors
/// [`Error`] if an input does not fit the model or the solution has not been computed; [`Error::Overflow`] if terms of the
/// equations are too large to be summed.
pub fn residual(
    model: &Model,
    state: &State,
    forces: &Forces,
    solved: &impl Solved,
) -> Result<Residual, Error> {
    state.check(model)?;
    forces.check(model)?;
    solved.residual(model, state, forces)
}

impl sealed::Sealed for Workspace {}

impl Solved for Workspace {
    fn residual(&self, model: &Model, state: &State, forces: &Forces) -> Result<Residual, Error> {
        self.check_model(model)?;
        self.joint_accelerations()?;
        self.joint_wrench(model.last_body())?;
        in_precision!(&self.arrays, s => {
            let solution = Solution {
                a: s.acceleration.iter().map(|a| a.map(Real::widen)).collect(),
                f: s.joint_wrench.iter().map(|f| f.map(Real::widen)).collect(),
                qdd: s.u.iter().map(|qdd| qdd.widen()).collect(),
            };
            solution.residual(model, state, forces, &self.scales)
        })
    }

    fn refine(&mut self, forces: &Forces) -> Result<Refinement, Error> {
        let loads = Loads::of_correction(self.computed.corrected);
        self.correct(forces, loads)
    }
}

/// Accelerations, gravity taken off, and transmitted forces of the bodies about their joints'
/// origins, and the joint accelerations.
pub(crate) struct Solution<T> {
    pub(crate) a: Vec<Motion<T>>,
    pub(crate) f: Vec<Force<T>>,
    pub(crate) qdd: Vec<T>,
}

impl<T: Real> Solution<T> {
    pub(crate) fn residual(
        &self,
        model: &Model,
        state: &State,
        forces: &Forces,
        scales: &Scales,
    ) -> Result<Residual, Error> {
        let mut s = Sweeps::<T>::new(model);
        s.set_state(&state.q, &state.qd, model.units().length, &scales.rate);
        s.add_external(0, forces, model.units());
        s.u.copy_from_slice(&self.qdd);
        evaluate(&s, model, forces, scales, &self.a, &self.f).map_err(|body| Error::Overflow {
            quantity: "residual",
            body: model.bodies()[body].name.clone(),
            time: state.time,
        })
    }
}

/// The residual, or the body of whose equations a term is not finite.
fn evaluate<T: Real>(
    s: &Sweeps<T>,
    model: &Model,
    forces: &Forces,
    scales: &Scales,
    a: &[Motion<T>],
    f: &[Force<T>],
) -> Result<Residual, usize> {
    let mut worst = Residual::default();
    let gravity = greatest(motion_array(absolute(s.base)));
    let least: Vec<T> = least_forces(model).into_iter().map(T::from_f64).collect();
    let mut balance = newton_euler_rows(s, forces, model, a, f);
    for i in (0..s.links.len()).rev() {
        let (row, scale) = balance[i];
        worst.newton_euler = worst_of(worst.newton_euler, largest(row, scale));
        let shared = greater(greatest(scale), least[i]);
        worst.by_body = worst_of(worst.by_body, largest(row, [shared; 6]));
        if !worst.is_finite() {
            return Err(i);
        }
        if let Some(parent) = s.links[i].parent {
            let (row, scale) = &mut balance[parent];
            let (r, passed) = (s.offset[i], f[i]);
            add(row, force_array(passed.shifted_back(r)));
            add(scale, force_array(absolute_shift(passed, r)));
        }
    }
    for i in 0..s.links.len() {
        let (row, scale) = acceleration_rows(s, i, a);
        worst.acceleration = worst_of(worst.acceleration, largest(row, scale));
        let shared = greater(greatest(scale), gravity);
        worst.by_body = worst_of(worst.by_body, largest(row, [shared; 6]));
        let shared = greater(greatest(balance[i].1), least[i]);
        let dofs = s.dofs(i);
        for dof in dofs.clone() {
            let column = s.subspace[dof];
            let tau = T::from_f64(forces.joint[dof] / scales.force[dof]);
            let mut row = column.dot(f[i]) - tau;
            let mut scale = absolute(column).dot(absolute_force(f[i])) + tau.abs();
            for other in dofs.clone() {
                let own = forces.inertia_between(&dofs, dof, other) * scales.inertia(dof);
                let own = T::from_f64(own) * s.u[other];
                row += own;
                scale += own.abs();
            }
            worst.joint_force = worst_of(worst.joint_force, ratio(row, scale));
            worst.by_body = worst_of(worst.by_body, ratio(row, greater(shared, scale)));
        }
        if !worst.is_finite() {
            return Err(i);
        }
    }
    Ok(worst)
}

type Rows<T> = ([T; 6], [T; 6]);

/// Rows of the Newton-Euler equations without the children's forces, and the sums of their terms.
fn newton_euler_rows<T: Real>(
    s: &Sweeps<T>,
    forces: &Forces,
    model: &Model,
    a: &[Motion<T>],
    f: &[Force<T>],
) -> Vec<Rows<T>> {
    let mut rows: Vec<Rows<T>> = (0..s.links.len())
        .map(|i| {
            let row = s.inertia[i].mul(a[i]) - s.external[i] - f[i];
            let bias = s.inertia[i].bias(s.spin[i]);
            // The terms of I a: |I| |a|, and those of the centripetal force as it stands.
            let scale = absolute_product(&s.inertia[i], absolute(a[i]))
                + absolute_force(bias)
                + absolute_force(f[i]);
            (force_array(row), force_array(scale))
        })
        .collect();
    for (id, wrench) in forces.acting() {
        let i = id.index();
        let wrench = s.frames[i].wrench_at_joint(s.rotation[i], wrench, model.units());
        add(&mut rows[id.index()].1, force_array(absolute_force(wrench)));
    }
    rows
}

fn acceleration_rows<T: Real>(s: &Sweeps<T>, i: usize, a: &[Motion<T>]) -> Rows<T> {
    let above = s.links[i].parent.map_or(s.base, |parent| a[parent]);
    let r = if s.links[i].parent.is_some() {
        s.offset[i]
    } else {
        Vec3::ZERO
    };
    let c = s.bias_acceleration[i];
    let mut row = a[i] - above.shifted(r) - c;
    let swept = absolute_cross(above.angular, r);
    let mut scale = absolute(a[i]) + absolute(above) + absolute(c);
    scale.linear += swept;
    for dof in s.dofs(i) {
        let term = s.subspace[dof] * s.u[dof];
        row = row - term;
        scale += absolute(term);
    }
    (motion_array(row), motion_array(scale))
}

/// The larger of two residuals; NaN, which `f64::max` would drop, is the worst.
pub(crate) fn worst_of(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// Not a number where the terms have overflowed, beside whose sum any row would be nothing.
fn ratio<T: Real>(row: T, scale: T) -> f64 {
    if !scale.is_finite() {
        f64::NAN
    } else if row == T::ZERO {
        0.0
    } else {
        (row.abs() / scale).to_f64()
    }
}

fn largest<T: Real>(row: [T; 6], scale: [T; 6]) -> f64 {
    row.iter().zip(scale).fold(0.0, |worst, (&row, scale)| {
        worst_of(worst, ratio(row, scale))
    })
}

fn greatest<T: Real>(scale: [T; 6]) -> T {
    scale.into_iter().fold(T::ZERO, greater)
}

fn greater<T: Real>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

fn add<T: Real>(sum: &mut [T; 6], terms: [T; 6]) {
    for (sum, term) in sum.iter_mut().zip(terms) {
        *sum += term;
    }
}

fn force_array<T: Real>(f: Force<T>) -> [T; 6] {
    let (n, l) = (f.angular, f.linear);
    [n.x, n.y, n.z, l.x, l.y, l.z]
}

fn motion_array<T: Real>(m: Motion<T>) -> [T; 6] {
    let (n, l) = (m.angular, m.linear);
    [n.x, n.y, n.z, l.x, l.y, l.z]
}

fn absolute<T: Real>(m: Motion<T>) -> Motion<T> {
    Motion::new(m.angular.abs(), m.linear.abs())
}

fn absolute_force<T: Real>(f: Force<T>) -> Force<T> {
    Force::new(f.angular.abs(), f.linear.abs())
}

/// The terms of a x b with absolute values: |a_y b_z| + |a_z b_y|, ...
fn absolute_cross<T: Real>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    let (a, b) = (a.abs(), b.abs());
    vec3(
        a.y * b.z + a.z * b.y,
        a.z * b.x + a.x * b.z,
        a.x * b.y + a.y * b.x,
    )
}

fn absolute_shift<T: Real>(f: Force<T>, r: Vec3<T>) -> Force<T> {
    Force::new(
        f.angular.abs() + absolute_cross(r, f.linear),
        f.linear.abs(),
    )
}

/// |I| |a|.
fn absolute_product<T: Real>(inertia: &RigidInertia<T>, a: Motion<T>) -> Force<T> {
    let rotational: Sym3<T> = inertia.rotational.map(T::abs);
    Force::new(
        rotational * a.angular + absolute_cross(inertia.moment, a.linear),
        a.linear * inertia.mass + absolute_cross(a.angular, inertia.moment),
    )
}
