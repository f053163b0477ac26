//! Jacobians, operational-space inertia, centroidal momentum and derivatives, against other algorithms
//! and against differences in the reference precision.

#![expect(
    clippy::unwrap_used,
    reason = "a failed computation of a test fails it"
)]

use faer::Mat;
use glam::{DQuat, DVec3};
use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::{BodyId, JointKind, Model, Random, State};
use vertebra_dynamics::{
    BodyForce, BodyPoint, Centroidal, Derivatives, Error, Forces, Precision, Workspace, Wrench,
    aba, aba_derivatives, centroidal, crba, forward_kinematics, inverse_operational_inertia,
    mechanics, operational_inertia, rnea, rnea_derivatives,
};

fn vector(random: &mut Random) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| random.symmetric()))
}

fn problem(count: usize, seed: u64) -> (Model, State, Forces) {
    let tree = RandomTree {
        floating: seed.is_multiple_of(2),
        reach: 1 + count % 5,
        ..RandomTree::mixed(count)
    };
    let model = generate::random_tree(&tree, seed).unwrap();
    let state = State::random(&model, seed);
    let mut forces = Forces::none(&model);
    let mut random = Random::new(seed);
    forces.joint.fill_with(|| random.symmetric());
    for (k, body) in model.body_ids().enumerate().filter(|(k, _)| k % 3 == 1) {
        let wrench = Wrench::at_point(vector(&mut random), vector(&mut random))
            .with_torque(vector(&mut random));
        let wrench = if k % 2 == 0 {
            wrench.in_body_axes()
        } else {
            wrench
        };
        forces.push(body, wrench);
    }
    (model, state, forces)
}

fn points(model: &Model, seed: u64) -> Vec<BodyPoint> {
    let mut random = Random::new(seed);
    let count = model.last_body().0 + 1;
    [0, count / 2, count - 1]
        .map(|body| BodyPoint::new(BodyId(body), vector(&mut random)))
        .to_vec()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let off = a
        .iter()
        .zip(b)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    off / largest(b).max(f64::MIN_POSITIVE)
}

fn flat(motion: vertebra_dynamics::BodyMotion) -> Vec<f64> {
    [motion.angular.to_array(), motion.linear.to_array()].concat()
}

#[test]
fn jacobians_agree_with_velocities_powers_and_accelerations() {
    for (seed, count) in [(0, 1), (1, 2), (2, 9), (3, 40), (4, 40)] {
        let (model, state, forces) = problem(count, seed);
        let dofs = model.dof_count();
        let mut workspace = Workspace::new(&model, Precision::F64);
        let mut random = Random::new(seed + 1);
        let bound = 64.0 * f64::EPSILON * model.depth() as f64;
        let mut jacobian = vec![0.0; 6 * dofs];
        let mut tau = vec![0.0; dofs];
        forward_kinematics(&model, &state, &mut workspace).unwrap();
        for at in points(&model, seed) {
            workspace.jacobian(at, &mut jacobian).unwrap();
            let product = |rates: &[f64]| -> Vec<f64> {
                (0..6)
                    .map(|row| (0..dofs).map(|k| jacobian[6 * k + row] * rates[k]).sum())
                    .collect()
            };
            let frame = workspace.velocity(at.body).unwrap();
            let r = workspace.pose(at.body).unwrap().rotation * at.point;
            let velocity = vertebra_dynamics::BodyMotion {
                angular: frame.angular,
                linear: frame.linear + frame.angular.cross(r),
            };
            assert!(difference(&product(&state.qd), &flat(velocity)) <= bound);
            let multiplied = workspace.jacobian_mul(at, &state.qd).unwrap();
            assert!(difference(&flat(multiplied), &flat(velocity)) <= bound);

            let force = BodyForce {
                moment: vector(&mut random),
                force: vector(&mut random),
            };
            workspace
                .jacobian_transpose_mul(at, force, &mut tau)
                .unwrap();
            let power = velocity.angular.dot(force.moment) + velocity.linear.dot(force.force);
            let terms: Vec<f64> = tau.iter().zip(&state.qd).map(|(a, b)| a * b).collect();
            let size: f64 = terms.iter().map(|x| x.abs()).sum();
            assert!((terms.iter().sum::<f64>() - power).abs() <= bound * size);
        }
        let qdd = aba(&model, &state, &forces, &mut workspace)
            .unwrap()
            .to_vec();
        for at in points(&model, seed) {
            let total = workspace.jacobian_mul(at, &qdd).unwrap();
            let bias = workspace.bias_acceleration(at).unwrap();
            let frame = workspace.acceleration(at.body).unwrap();
            let still = workspace.velocity(at.body);
            assert!(matches!(still, Err(Error::NotComputed { .. })));
            let mut posed = Workspace::new(&model, Precision::F64);
            forward_kinematics(&model, &state, &mut posed).unwrap();
            let r = posed.pose(at.body).unwrap().rotation * at.point;
            let w = posed.velocity(at.body).unwrap().angular;
            let expected = [
                frame.angular.to_array(),
                (frame.linear + frame.angular.cross(r) + w.cross(w.cross(r))).to_array(),
            ]
            .concat();
            let found = [
                (total.angular + bias.angular).to_array(),
                (total.linear + bias.linear).to_array(),
            ]
            .concat();
            let size = largest(&flat(total)).max(largest(&flat(bias)));
            let off = difference(&found, &expected) * largest(&expected);
            assert!(off <= 64.0 * bound * size, "{off:e} of {size}");
        }
    }
}

#[test]
fn operational_inertia_is_that_of_dense_matrices() {
    for (seed, count) in [(0, 3), (1, 12), (2, 25)] {
        let (model, state, forces) = problem(count, seed);
        let dofs = model.dof_count();
        let mut workspace = Workspace::new(&model, Precision::F64);
        let points = points(&model, seed);
        let mass = crba(&model, &state, &mut workspace).unwrap().to_owned();
        let mut jacobian = Mat::zeros(6 * points.len(), dofs);
        let mut columns = vec![0.0; 6 * dofs];
        for (k, &at) in points.iter().enumerate() {
            workspace.jacobian(at, &mut columns).unwrap();
            for dof in 0..dofs {
                for row in 0..6 {
                    jacobian[(6 * k + row, dof)] = columns[6 * dof + row];
                }
            }
        }
        use faer::linalg::solvers::Solve;
        let solved = mass.full_piv_lu().solve(jacobian.transpose());
        let dense = &jacobian * solved;
        let refused = inverse_operational_inertia(&mut workspace, &points);
        assert!(matches!(refused, Err(Error::NotComputed { .. })));
        aba(&model, &state, &forces, &mut workspace).unwrap();
        let inverse = inverse_operational_inertia(&mut workspace, &points).unwrap();
        let off = (&inverse - &dense).norm_max() / dense.norm_max();
        assert!(off <= 1e-10, "seed {seed}: {off:e}");
        // Of the floating base alone it exists.
        if seed % 2 == 0 {
            let inertia = operational_inertia(&mut workspace, &points[..1]).unwrap();
            let first = inverse.submatrix(0, 0, 6, 6);
            let product = first * &inertia;
            let off = (&product - Mat::<f64>::identity(6, 6)).norm_max();
            assert!(off <= 1e-9, "seed {seed}: {off:e}");
        }
        // A point twice is a singular set.
        let twice = [points[0], points[0]];
        assert!(matches!(
            operational_inertia(&mut workspace, &twice),
            Err(Error::SingularOperationalInertia { .. })
        ));
    }
}

#[test]
fn centroidal_quantities_are_those_of_sums_over_bodies() {
    for (seed, count) in [(0, 1), (1, 7), (2, 60)] {
        let (model, state, _) = problem(count, seed);
        let mut workspace = Workspace::new(&model, Precision::F64);
        let sums = mechanics(&model, &state, &mut workspace).unwrap();
        let mut found = Centroidal::new(&model);
        centroidal(&workspace, &mut found).unwrap();
        let dofs = model.dof_count();
        let product: Vec<f64> = (0..6)
            .map(|row| {
                (0..dofs)
                    .map(|k| found.matrix[(row, k)] * state.qd[k])
                    .sum()
            })
            .collect();
        let momentum = [
            sums.angular_momentum.to_array(),
            sums.linear_momentum.to_array(),
        ]
        .concat();
        let bound = 1e3 * f64::EPSILON * model.depth() as f64;
        assert!(difference(&product, &momentum) <= bound);
        assert!((found.center - sums.center).length() <= bound * (1.0 + sums.center.length()));
        assert!((found.mass - sums.mass).abs() <= bound * sums.mass);
        let mut jacobian = vec![0.0; 3 * dofs];
        found.center_jacobian(&mut jacobian).unwrap();
        let velocity: Vec<f64> = (0..3)
            .map(|row| (0..dofs).map(|k| jacobian[3 * k + row] * state.qd[k]).sum())
            .collect();
        let expected = sums.linear_momentum / sums.mass;
        assert!(difference(&velocity, &expected.to_array()) <= bound);
        // A floating base that turns takes everything with it: its angular columns are the locked inertia.
        if seed % 2 == 0 {
            let body = &model.bodies()[0];
            assert_eq!(body.joint.kind, JointKind::Free);
            let mut posed = Workspace::new(&model, Precision::F64);
            let mut unturned = state.clone();
            unturned.q[3..7].copy_from_slice(&[0.0, 0.0, 0.0, 1.0]);
            forward_kinematics(&model, &unturned, &mut posed).unwrap();
            centroidal(&posed, &mut found).unwrap();
            let trace = found.inertia.x_axis.x + found.inertia.y_axis.y + found.inertia.z_axis.z;
            let axes = [0, 1, 2].map(|k| {
                let placement = body.joint.parent_placement.rotation;
                let axis = placement * DVec3::AXES[k];
                let h = [0, 1, 2].map(|row| found.matrix[(row, k)]);
                axis.dot(DVec3::from_array(h))
            });
            assert!((axes.iter().sum::<f64>() - trace).abs() <= bound * trace);
        }
    }
}

/// The state moved along one freedom.
fn moved(model: &Model, state: &State, dof: usize, by: f64) -> State {
    let mut moved = state.clone();
    let body = model
        .bodies()
        .iter()
        .find(|body| body.dof_range().contains(&dof))
        .unwrap();
    let q = &mut moved.q[body.position_range()];
    let axis = dof - body.dof_start;
    let turn = |q: &mut [f64], axis: usize| {
        let orientation = DQuat::from_slice(q) * DQuat::from_axis_angle(DVec3::AXES[axis], by);
        q.copy_from_slice(&orientation.normalize().to_array());
    };
    match body.joint.kind {
        JointKind::Spherical => turn(q, axis),
        JointKind::Free if axis < 3 => turn(&mut q[3..], axis),
        JointKind::Free => {
            let step = DQuat::from_slice(&q[3..]) * DVec3::AXES[axis - 3] * by;
            for k in 0..3 {
                q[k] += step[k];
            }
        }
        _ => q[0] += by,
    }
    moved
}

/// Central differences of eighth order.
fn differentiate(step: f64, mut f: impl FnMut(f64) -> Vec<f64>) -> Vec<f64> {
    let weights = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let mut sum = vec![0.0; f(0.0).len()];
    for (k, weight) in weights.into_iter().enumerate() {
        let ahead = f(step * (k + 1) as f64);
        let behind = f(-step * (k + 1) as f64);
        for (sum, (ahead, behind)) in sum.iter_mut().zip(ahead.iter().zip(&behind)) {
            *sum += weight * (ahead - behind) / step;
        }
    }
    sum
}

#[test]
fn derivatives_are_those_of_differences_in_the_reference_precision() {
    for (seed, count) in [(0, 1), (1, 4), (2, 8), (3, 12), (6, 10)] {
        let (model, state, forces) = problem(count, seed);
        let dofs = model.dof_count();
        let mut reference = Workspace::new(&model, Precision::Reference);
        let mut workspace = Workspace::new(&model, Precision::F64);
        let mut found = Derivatives::new(&model);
        let mut random = Random::new(seed);
        let qdd: Vec<f64> = (0..dofs).map(|_| random.symmetric()).collect();
        let step = 2.0_f64.powi(-9);
        let close = |found: &Mat<f64>, dof: usize, expected: &[f64], what: &str| {
            let off = difference(found.col_as_slice(dof), expected);
            assert!(off <= 1e-9, "seed {seed}: by {what} {dof}: {off:e}");
        };

        rnea_derivatives(&model, &state, &qdd, &forces, &mut workspace, &mut found).unwrap();
        let mut inverse = |state: &State, qdd: &[f64]| {
            rnea(&model, state, qdd, &forces, &mut reference)
                .unwrap()
                .to_vec()
        };
        for dof in 0..dofs {
            let by = differentiate(step, |h| inverse(&moved(&model, &state, dof, h), &qdd));
            close(&found.position, dof, &by, "position");
            let by = differentiate(step, |h| {
                let mut state = state.clone();
                state.qd[dof] += h;
                inverse(&state, &qdd)
            });
            close(&found.rate, dof, &by, "rate");
        }
        let mass = crba(&model, &state, &mut workspace).unwrap().to_owned();
        assert!((&mass - &found.drive).norm_max() <= 1e-13 * mass.norm_max());

        aba_derivatives(&model, &state, &forces, &mut workspace, &mut found).unwrap();
        let mut forward = |state: &State, forces: &Forces| {
            aba(&model, state, forces, &mut reference).unwrap().to_vec()
        };
        for dof in 0..dofs {
            let by = differentiate(step, |h| forward(&moved(&model, &state, dof, h), &forces));
            close(&found.position, dof, &by, "position");
            let by = differentiate(step, |h| {
                let mut state = state.clone();
                state.qd[dof] += h;
                forward(&state, &forces)
            });
            close(&found.rate, dof, &by, "rate");
        }
        let unit = &found.drive * &mass;
        let off = (&unit - Mat::<f64>::identity(dofs, dofs)).norm_max();
        assert!(
            off <= 1e-13 * mass.norm_max() * found.drive.norm_max(),
            "{off:e}"
        );
    }
}

/// In f64 the derivatives are those of the reference precision to rounding, on long chains too.
#[test]
fn derivatives_lose_few_digits() {
    let model = generate::random_chain(96, &generate::Rod::default(), 5).unwrap();
    let (state, forces) = (State::random(&model, 6), Forces::none(&model));
    let solve = |precision| {
        let mut workspace = Workspace::new(&model, precision);
        let mut found = Derivatives::new(&model);
        aba_derivatives(&model, &state, &forces, &mut workspace, &mut found).unwrap();
        found
    };
    let (exact, found) = (solve(Precision::Reference), solve(Precision::F64));
    for (exact, found) in [
        (&exact.position, &found.position),
        (&exact.rate, &found.rate),
        (&exact.drive, &found.drive),
    ] {
        let error = (exact - found).norm_max() / exact.norm_max();
        assert!(error <= 1e-10, "{error:e}");
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let (model, state, forces) = problem(5, 3);
    let mut workspace = Workspace::new(&model, Precision::F64);
    let at = BodyPoint::origin(BodyId(0));
    let mut out = vec![0.0; 6 * model.dof_count()];
    let refused = workspace.jacobian(at, &mut out);
    assert!(matches!(refused, Err(Error::NotComputed { .. })));
    forward_kinematics(&model, &state, &mut workspace).unwrap();
    assert!(matches!(
        workspace.jacobian(at, &mut out[1..]),
        Err(Error::Model(_))
    ));
    let unknown = workspace.jacobian(BodyPoint::origin(BodyId(99)), &mut out);
    assert!(matches!(unknown, Err(Error::UnknownBody { .. })));
    let infinite = BodyPoint::new(BodyId(0), DVec3::INFINITY);
    let refused = workspace.jacobian(infinite, &mut out);
    assert!(matches!(refused, Err(Error::NonFiniteInput { .. })));
    let (other, ..) = problem(6, 3);
    let mut wrong = Derivatives::new(&other);
    let refused = aba_derivatives(&model, &state, &forces, &mut workspace, &mut wrong);
    assert!(matches!(refused, Err(Error::WrongWorkspace { .. })));
    let refused = centroidal(&workspace, &mut Centroidal::new(&other));
    assert!(matches!(
        refused,
        Err(Error::WrongWorkspace { .. }) | Err(Error::NotComputed { .. })
    ));
}
