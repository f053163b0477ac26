//! The residual of the bodies' own equations: how well a solution solves what it claims to.
//!
//! Of every body and joint three equations are evaluated in f64:
//! - Newton-Euler: I a + bias - external - f + sum over children of X' f_child = 0 (6 rows),
//! - acceleration match: a - X a_parent - c - S qdd = 0 (6 rows),
//! - joint force: S' f - tau = 0 (one row a freedom).
//!
//! Each row is divided by the sum of the absolute values of its terms (products of a matrix and a
//! vector count entry by entry), which makes it a backward error: 1e-16 says that the solution
//! solves a problem whose numbers differ from the given ones in the 16th digit. Unlike the residual
//! of the joint torques it does not grow with the condition of the joint-space mass matrix.

use crate::workspace::{Sweeps, Workspace, in_f64, in_f64_force, in_precision};
use crate::{Error, Forces};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Force, Motion, RigidInertia, Vec3, vec3};

/// The largest row-scaled residual of each kind of equation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residual {
    /// Of the bodies' Newton-Euler equations.
    pub newton_euler: f64,
    /// Of the accelerations across the joints.
    pub acceleration: f64,
    /// Of the joint forces.
    pub joint_force: f64,
}

impl Residual {
    /// The largest of the three.
    #[must_use]
    pub fn max(&self) -> f64 {
        worst_of(
            worst_of(self.newton_euler, self.acceleration),
            self.joint_force,
        )
    }
}

/// Residual of the bodies' own equations of what [`aba`](crate::aba) and
/// [`joint_wrenches`](crate::joint_wrenches) left in `workspace` for this state and these forces.
///
/// Evaluated in f64 whatever the workspace's precision; takes memory of its own, so it is a
/// measurement and not part of a step.
///
/// # Errors
/// [`Error`] if an input does not fit the model or the solution has not been computed.
pub fn residual(
    model: &Model,
    state: &State,
    forces: &Forces,
    workspace: &Workspace,
) -> Result<Residual, Error> {
    workspace.check_model(model)?;
    state.check(model)?;
    forces.check(model)?;
    let qdd = workspace.joint_accelerations()?;
    workspace.joint_wrench(model.last_body())?;
    let (a, f) = in_precision!(&workspace.arrays, s => (
        s.acceleration.iter().map(|&a| in_f64(a)).collect::<Vec<_>>(),
        s.joint_wrench.iter().map(|&f| in_f64_force(f)).collect::<Vec<_>>(),
    ));
    let scales = &workspace.scales;
    let s = &mut Sweeps::<f64>::new(model);
    s.set_state(state, model.units().length, &scales.rate);
    s.set_external(forces, model.units());
    for (u, (&qdd, &scale)) in s.u.iter_mut().zip(qdd.iter().zip(&scales.acceleration)) {
        *u = qdd / scale;
    }

    let mut worst = Residual::default();
    let mut balance = newton_euler_rows(s, forces, model, &a, &f);
    for i in (0..s.links.len()).rev() {
        let (row, scale) = balance[i];
        worst.newton_euler = worst_of(worst.newton_euler, largest(row, scale));
        if let Some(parent) = s.links[i].parent {
            let (row, scale) = &mut balance[parent];
            let (r, passed) = (s.offset[i], f[i]);
            add(row, force_array(passed.shifted_back(r)));
            add(scale, force_array(absolute_shift(passed, r)));
        }
    }
    for i in 0..s.links.len() {
        let (row, scale) = acceleration_rows(s, i, &a);
        worst.acceleration = worst_of(worst.acceleration, largest(row, scale));
        for dof in s.dofs(i) {
            let column = s.subspace[dof];
            let tau = forces.joint[dof] / scales.force[dof];
            let row = column.dot(f[i]) - tau;
            let scale = absolute(column).dot(absolute_force(f[i])) + tau.abs();
            worst.joint_force = worst_of(worst.joint_force, ratio(row, scale));
        }
    }
    Ok(worst)
}

type Rows = ([f64; 6], [f64; 6]);

/// Rows of the Newton-Euler equations without the children's forces, and the sums of their terms.
fn newton_euler_rows(
    s: &Sweeps<f64>,
    forces: &Forces,
    model: &Model,
    a: &[Motion<f64>],
    f: &[Force<f64>],
) -> Vec<Rows> {
    let mut rows: Vec<Rows> = (0..s.links.len())
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
    for (id, wrench) in forces.external() {
        let wrench = s.wrench_at_joint(id.index(), wrench, model.units());
        add(&mut rows[id.index()].1, force_array(absolute_force(wrench)));
    }
    rows
}

fn acceleration_rows(s: &Sweeps<f64>, i: usize, a: &[Motion<f64>]) -> Rows {
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
fn worst_of(a: f64, b: f64) -> f64 {
    if b <= a { a } else { b }
}

fn ratio(row: f64, scale: f64) -> f64 {
    if row == 0.0 { 0.0 } else { row.abs() / scale }
}

fn largest(row: [f64; 6], scale: [f64; 6]) -> f64 {
    row.iter().zip(scale).fold(0.0, |worst, (&row, scale)| {
        worst_of(worst, ratio(row, scale))
    })
}

fn add(sum: &mut [f64; 6], terms: [f64; 6]) {
    for (sum, term) in sum.iter_mut().zip(terms) {
        *sum += term;
    }
}

fn force_array(f: Force<f64>) -> [f64; 6] {
    let (n, l) = (f.angular, f.linear);
    [n.x, n.y, n.z, l.x, l.y, l.z]
}

fn motion_array(m: Motion<f64>) -> [f64; 6] {
    let (n, l) = (m.angular, m.linear);
    [n.x, n.y, n.z, l.x, l.y, l.z]
}

fn absolute(m: Motion<f64>) -> Motion<f64> {
    Motion::new(m.angular.abs(), m.linear.abs())
}

fn absolute_force(f: Force<f64>) -> Force<f64> {
    Force::new(f.angular.abs(), f.linear.abs())
}

/// The terms of a x b with absolute values: |a_y b_z| + |a_z b_y|, ...
fn absolute_cross(a: Vec3<f64>, b: Vec3<f64>) -> Vec3<f64> {
    let (a, b) = (a.abs(), b.abs());
    vec3(
        a.y * b.z + a.z * b.y,
        a.z * b.x + a.x * b.z,
        a.x * b.y + a.y * b.x,
    )
}

fn absolute_shift(f: Force<f64>, r: Vec3<f64>) -> Force<f64> {
    Force::new(
        f.angular.abs() + absolute_cross(r, f.linear),
        f.linear.abs(),
    )
}

/// |I| |a|.
fn absolute_product(inertia: &RigidInertia<f64>, a: Motion<f64>) -> Force<f64> {
    let i = inertia.rotational;
    let rotational = vertebra_spatial::Sym3 {
        xx: i.xx.abs(),
        yy: i.yy.abs(),
        zz: i.zz.abs(),
        xy: i.xy.abs(),
        xz: i.xz.abs(),
        yz: i.yz.abs(),
    };
    Force::new(
        rotational * a.angular + absolute_cross(inertia.moment, a.linear),
        a.linear * inertia.mass + absolute_cross(a.angular, inertia.moment),
    )
}
