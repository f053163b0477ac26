//! Bad input ends in an error that names the culprit, and leaves everything as it was.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::DVec3;
use vertebra_assembly::{
    BodyId, Joint, MassProperties, Model, ModelDescription, ModelError, State, generate,
};
use vertebra_dynamics::{
    DcaOptions, DcaWorkspace, Error, Forces, Precision, Simulation, Workspace, Wrench, aba, crba,
    crba_forward_dynamics, dca, forward_kinematics, joint_wrenches, mechanics, residual, rnea,
};
use vertebra_spatial::Pose;

fn chain(count: usize) -> Model {
    generate::random_chain(count, &generate::Rod::default(), 3).unwrap()
}

/// Every function that takes a state, forces and a workspace.
fn all(model: &Model, state: &State, forces: &Forces, w: &mut Workspace) -> Vec<Option<Error>> {
    let qdd = vec![0.0; model.dof_count()];
    vec![
        aba(model, state, forces, w).err(),
        rnea(model, state, &qdd, forces, w).err(),
        crba_forward_dynamics(model, state, forces, w).err(),
    ]
}

#[test]
fn states_that_do_not_fit() {
    let model = chain(4);
    let forces = Forces::none(&model);
    let mut workspace = Workspace::new(&model, Precision::F64);
    let good = State::random(&model, 1);
    let broken: [fn(&mut State); 5] = [
        |s| s.q.truncate(3),
        |s| s.qd.push(0.0),
        |s| s.q[2] = f64::NAN,
        |s| s.qd[3] = f64::INFINITY,
        |s| s.time = f64::NAN,
    ];
    for break_it in broken {
        let mut state = good.clone();
        break_it(&mut state);
        for error in all(&model, &state, &forces, &mut workspace) {
            assert!(matches!(error, Some(Error::Model(_))), "{error:?}");
        }
        assert!(forward_kinematics(&model, &state, &mut workspace).is_err());
        assert!(crba(&model, &state, &mut workspace).is_err());
        assert!(mechanics(&model, &state, &mut workspace).is_err());
    }
    let mut state = good;
    state.q[2] = f64::NAN;
    let message = aba(&model, &state, &forces, &mut workspace)
        .unwrap_err()
        .to_string();
    assert!(message.contains("body-2"), "{message}");
}

#[test]
fn quaternions_that_are_none() {
    let model = generate::chain(2, &Joint::spherical(), &generate::Rod::default()).unwrap();
    let mut state = State::neutral(&model);
    state.q[4..8].fill(0.0);
    let mut workspace = Workspace::new(&model, Precision::F64);
    let error = aba(&model, &state, &Forces::none(&model), &mut workspace).unwrap_err();
    assert!(matches!(
        error,
        Error::Model(ModelError::NonUnitQuaternion { ref element, .. }) if element == "body-1"
    ));
}

#[test]
fn forces_that_do_not_fit() {
    let model = chain(4);
    let state = State::random(&model, 1);
    let mut workspace = Workspace::new(&model, Precision::F64);
    let body = model.last_body();
    let nan = [f64::NAN, 0.0, 0.0];
    let broken: [&dyn Fn(&mut Forces); 6] = [
        &|f| f.joint.truncate(1),
        &|f| f.joint[1] = f64::NEG_INFINITY,
        &|f| f.push(body, Wrench::at_center(nan)),
        &|f| f.push(body, Wrench::at_point([0.0; 3], nan)),
        &|f| f.push(body, Wrench::at_center([0.0; 3]).with_torque(nan)),
        &|f| f.push(BodyId(4), Wrench::at_center([0.0; 3])),
    ];
    for break_it in broken {
        let mut forces = Forces::none(&model);
        break_it(&mut forces);
        for error in all(&model, &state, &forces, &mut workspace) {
            let error = error.expect("refused").to_string();
            assert!(
                error.contains("body-")
                    || error.contains("joint forces")
                    || error.contains("number 4"),
                "{error}"
            );
        }
    }
    let qdd = [0.0, f64::NAN, 0.0, 0.0];
    let forces = Forces::none(&model);
    let error = rnea(&model, &state, &qdd, &forces, &mut workspace).unwrap_err();
    assert!(error.to_string().contains("body-1"), "{error}");
    assert!(rnea(&model, &state, &qdd[..3], &forces, &mut workspace).is_err());
}

#[test]
fn workspaces_of_other_models_and_results_not_computed() {
    let (model, other) = (chain(4), chain(4));
    let state = State::random(&model, 1);
    let forces = Forces::none(&model);
    let mut workspace = Workspace::new(&other, Precision::F32);
    for error in all(&model, &state, &forces, &mut workspace) {
        assert!(matches!(error, Some(Error::WrongWorkspace { .. })));
    }
    let mut workspace = Workspace::new(&model, Precision::F64);
    let body = model.last_body();
    let missing = |error: Option<Error>| matches!(error, Some(Error::NotComputed { .. }));
    assert!(missing(workspace.pose(body).err()));
    assert!(missing(workspace.velocity(body).err()));
    assert!(missing(workspace.acceleration(body).err()));
    assert!(missing(workspace.joint_accelerations().err()));
    assert!(missing(joint_wrenches(&mut workspace).err()));
    aba(&model, &state, &forces, &mut workspace).unwrap();
    assert!(missing(workspace.joint_wrench(body).err()));
    assert!(missing(residual(&model, &state, &forces, &workspace).err()));
    assert!(workspace.acceleration(body).is_ok());
    assert!(matches!(
        workspace.acceleration(BodyId(9)),
        Err(Error::UnknownBody { body: 9, .. })
    ));
    // What a failed call was about to replace is not offered as its result.
    let mut bad = state.clone();
    bad.q[0] = 1e300;
    bad.qd[0] = 1e300;
    assert!(matches!(
        aba(&model, &bad, &forces, &mut workspace),
        Err(Error::Overflow { .. })
    ));
    assert!(missing(workspace.joint_accelerations().err()));
}

/// Forces of which there still are numbers, but no longer of the sums that residuals are measured by: at a lever.
#[test]
fn residuals_that_overflow_name_the_body() {
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let far = Pose::from_translation(DVec3::Y * 1e6);
    let slide = || Joint::prismatic(DVec3::X);
    let model = ModelDescription::new("pushed")
        .body("slider", None, slide(), rod)
        .body("far", Some("slider"), slide().at(far), rod)
        .build()
        .unwrap();
    let (state, mut forces) = (State::neutral(&model), Forces::none(&model));
    let mut alone = Workspace::new(&model, Precision::F64);
    let mut tree = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
    let mut seen = [0; 2];
    for doubling in 0..40 {
        forces.joint[1] = 1e300 * f64::from(doubling).exp2();
        aba(&model, &state, &forces, &mut alone).unwrap();
        dca(&model, &state, &forces, &mut tree).unwrap();
        if joint_wrenches(&mut alone).is_err() || tree.compute_joint_wrenches(&forces).is_err() {
            break;
        }
        let found = [
            residual(&model, &state, &forces, &alone),
            residual(&model, &state, &forces, &tree),
        ];
        for found in found {
            match found {
                Ok(left) => {
                    assert!(left.max() <= f64::EPSILON, "{left:?}");
                    seen[0] += 1;
                }
                Err(Error::Overflow { quantity, body, .. }) => {
                    assert_eq!((quantity, &*body), ("residual", "slider"));
                    seen[1] += 1;
                }
                Err(other) => panic!("{other:?}"),
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 0), "{seen:?}");
}

/// Two hinges about one axis with next to nothing between them: nothing says which of them turns.
/// (With nothing at all the model is refused.)
fn doubled_hinge(inertia_between: f64) -> Model {
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let between = MassProperties {
        inertia: glam::DMat3::from_diagonal(DVec3::splat(inertia_between)),
        ..MassProperties::MASSLESS
    };
    let hinge = || Joint::revolute(DVec3::X);
    ModelDescription::new("doubled")
        .body("frame", None, Joint::revolute(DVec3::Y), rod)
        .body(
            "between",
            Some("frame"),
            hinge().at(Pose::from_translation(DVec3::Z)),
            between,
        )
        .body("end", Some("between"), hinge(), rod)
        .build()
        .unwrap()
}

#[test]
fn singular_joints_are_named() {
    for (precision, vanishing) in [(Precision::F64, 1e-17), (Precision::F32, 1e-9)] {
        for inertia in [vanishing, 1e-2 * vanishing] {
            let model = doubled_hinge(inertia);
            for seed in 0..20 {
                let state = State::random(&model, seed);
                let mut workspace = Workspace::new(&model, precision);
                let error = aba(&model, &state, &Forces::none(&model), &mut workspace);
                assert!(
                    matches!(error, Err(Error::SingularJoint { ref body }) if body == "between"),
                    "{precision} {inertia:e}: {error:?}"
                );
            }
        }
    }
    // Enough inertia, and it can be solved.
    let model = doubled_hinge(1e-9);
    let mut workspace = Workspace::new(&model, Precision::F64);
    let state = State::random(&model, 1);
    aba(&model, &state, &Forces::none(&model), &mut workspace).unwrap();
}

/// Mass on its own axis: what rounding leaves of the pivot is no inertia.
#[test]
fn noise_is_not_inertia() {
    let mut random = vertebra_assembly::Random::new(3);
    for precision in [Precision::F64, Precision::F32] {
        for _ in 0..200 {
            let axis = random.direction();
            // A rod thinner than either precision can tell, lying along the axis.
            let thin = 1e-3 * precision.epsilon();
            let turn = glam::DQuat::from_rotation_arc(DVec3::Z, axis);
            let rod = MassProperties {
                mass: 1.0,
                center: DVec3::ZERO,
                inertia: glam::DMat3::from_diagonal(DVec3::new(1.0, 1.0, thin)),
            };
            let rod = rod.placed(&Pose::from_rotation(turn));
            let Ok(model) = ModelDescription::new("thin")
                .body("rod", None, Joint::revolute(axis), rod)
                .build()
            else {
                continue;
            };
            let mut forces = Forces::none(&model);
            forces.joint[0] = 1.0;
            let mut workspace = Workspace::new(&model, precision);
            let outcome = aba(&model, &State::neutral(&model), &forces, &mut workspace);
            assert!(
                matches!(outcome, Err(Error::SingularJoint { .. })),
                "{precision} {axis}: {outcome:?}"
            );
        }
    }
}

#[test]
fn no_nan_leaves() {
    for precision in [Precision::F64, Precision::F32] {
        for joint in [
            Joint::free(),
            Joint::prismatic(DVec3::new(1.0, 2.0, 3.0)),
            Joint::revolute(DVec3::ONE),
            Joint::spherical(),
        ] {
            let model = generate::chain(3, &joint, &generate::Rod::default()).unwrap();
            let forces = Forces::none(&model);
            for exponent in [15, 19, 25, 38, 39, 75, 150, 154, 200, 300, 308] {
                for (scale_q, scale_qd) in [(true, false), (false, true), (true, true)] {
                    let mut state = State::random(&model, exponent);
                    let size = 1.7 * 10.0_f64.powi(i32::try_from(exponent).unwrap());
                    for body in model.bodies() {
                        let positions = match body.joint.kind {
                            vertebra_assembly::JointKind::Free => 3,
                            vertebra_assembly::JointKind::Spherical => 0,
                            _ => 1,
                        };
                        for q in &mut state.q[body.position_range()][..positions] {
                            *q = if scale_q { size } else { *q };
                        }
                    }
                    if scale_qd {
                        state.qd.fill(size);
                    }
                    check_finite(&model, &state, &forces, precision);
                }
            }
        }
    }
}

/// Whatever does not fail is finite.
fn check_finite(model: &Model, state: &State, forces: &Forces, precision: Precision) {
    let mut workspace = Workspace::new(model, precision);
    let w = &mut workspace;
    if let Ok(qdd) = aba(model, state, forces, w) {
        assert!(qdd.iter().all(|x| x.is_finite()));
        for id in model.body_ids() {
            if let Ok(a) = w.acceleration(id) {
                assert!(a.angular.is_finite() && a.linear.is_finite());
            }
        }
        if joint_wrenches(w).is_ok() {
            for id in model.body_ids() {
                if let Ok(f) = w.joint_wrench(id) {
                    assert!(f.moment.is_finite() && f.force.is_finite());
                }
            }
        }
    }
    let zeros = vec![0.0; model.dof_count()];
    if let Ok(tau) = rnea(model, state, &zeros, forces, w) {
        assert!(tau.iter().all(|x| x.is_finite()));
    }
    if let Ok(mass) = crba(model, state, w) {
        assert!(mass.col_iter().all(|c| c.iter().all(|x| x.is_finite())));
    }
    if forward_kinematics(model, state, w).is_ok() {
        for id in model.body_ids() {
            if let Ok(pose) = w.pose(id) {
                assert!(pose.translation.is_finite() && pose.rotation.is_finite());
            }
            if let Ok(v) = w.velocity(id) {
                assert!(v.angular.is_finite() && v.linear.is_finite());
            }
        }
    }
    if let Ok(sums) = mechanics(model, state, w) {
        assert!(sums.kinetic_energy.is_finite() && sums.center.is_finite());
        assert!(sums.linear_momentum.is_finite() && sums.angular_momentum.is_finite());
    }
    let mut simulation = Simulation::new(model.clone())
        .unwrap()
        .with_precision(precision)
        .unwrap();
    simulation.set_state(state.clone()).unwrap();
    if simulation.step(1e-3).is_ok() {
        simulation.state().unwrap().check(model).unwrap();
    } else {
        assert_eq!(simulation.state().unwrap(), state);
    }
}

#[test]
fn large_angles_keep_their_digits_in_single_precision() {
    let model = chain(4);
    let mut state = State::random(&model, 4);
    let forces = Forces::none(&model);
    let turns = 16_000.0 * core::f64::consts::TAU;
    let qdd: Vec<Vec<f64>> = [0.0, turns]
        .into_iter()
        .map(|extra| {
            state.q[1] += extra;
            let mut workspace = Workspace::new(&model, Precision::F32);
            aba(&model, &state, &forces, &mut workspace)
                .unwrap()
                .to_vec()
        })
        .collect();
    let largest = qdd[0].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (a, b) in qdd[0].iter().zip(&qdd[1]) {
        // 1e5 rad hold the angle to 1e-11 in f64; the rest is f32 rounding.
        assert!((a - b).abs() <= 64.0 * f64::from(f32::EPSILON) * largest);
    }
}

#[test]
fn a_mass_matrix_that_cannot_be_factored_is_refused() {
    let model = doubled_hinge(1e-17);
    let state = State::random(&model, 2);
    let mut workspace = Workspace::new(&model, Precision::F64);
    let outcome = crba_forward_dynamics(&model, &state, &Forces::none(&model), &mut workspace);
    // Rounding may leave the vanishing pivot slightly positive; then ABA is the one to tell.
    if let Err(error) = outcome {
        assert!(
            matches!(error, Error::SingularMassMatrix { dofs: 3, .. }),
            "{error:?}"
        );
    }
}

#[test]
fn a_dense_matrix_too_large_is_refused() {
    let model = chain(16_385);
    let mut workspace = Workspace::new(&model, Precision::F32);
    let state = State::neutral(&model);
    assert!(matches!(
        crba(&model, &state, &mut workspace),
        Err(Error::DenseTooLarge { dofs: 16_385, .. })
    ));
}

#[test]
fn a_failed_step_leaves_the_state_as_it_was() {
    let model = chain(8);
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(State::random(&model, 5)).unwrap();
    let before = simulation.state().unwrap().clone();
    assert!(matches!(
        simulation.step(f64::NAN),
        Err(Error::NonFiniteInput { .. })
    ));
    assert_eq!(*simulation.state().unwrap(), before);

    // A force beyond all measure.
    simulation
        .forces_mut()
        .push(model.last_body(), Wrench::at_center([1e308; 3]));
    simulation
        .forces_mut()
        .push(model.last_body(), Wrench::at_center([1e308; 3]));
    let error = simulation.step(1e-3).unwrap_err();
    assert!(matches!(error, Error::Overflow { .. }), "{error:?}");
    assert_eq!(*simulation.state().unwrap(), before);

    // And it goes on when the cause is gone.
    simulation.forces_mut().clear_external();
    simulation.step(1e-3).unwrap();
    assert!(simulation.state().unwrap().time > before.time);

    // A step so long that it overflows.
    let before = simulation.state().unwrap().clone();
    assert!(simulation.step(1e308).is_err());
    assert_eq!(*simulation.state().unwrap(), before);
    let mut other = State::neutral(&model);
    other.q.pop();
    assert!(simulation.set_state(other).is_err());
    assert_eq!(*simulation.state().unwrap(), before);
}
