//! Screws and compound joints against joints that make them up, and against exponentials.

use faer::Mat;
use faer::linalg::solvers::Solve;
use glam::{DAffine3, DQuat, DVec3};
use vertebra_assembly::{
    Compound, Joint, JointKind, MassProperties, ModelDescription, Random, State, generate,
};
use vertebra_dynamics::{
    DcaOptions, DcaWorkspace, Derivatives, Forces, Integrator, Precision, Simulation, Workspace,
    aba, aba_derivatives, crba, dca, forward_kinematics, rnea, rnea_derivatives,
};
use vertebra_spatial::Pose;

/// A screw is a cylindrical joint whose displacement follows its angle: with y = G q for the freedoms y of
/// the latter, G'M G qdd = G'(tau - h), from its dense matrices.
#[test]
fn screws_are_cylindrical_joints_that_are_tied() {
    for seed in 0..20 {
        let tied = generate::random_mechanism(9, false, seed).unwrap();
        let state = State::random(&tied, seed);
        let mut loose = ModelDescription::new("loose").gravity(tied.gravity());
        let mut pitches = Vec::new();
        for body in tied.describe().bodies {
            let Joint {
                kind,
                parent_placement,
                child_placement,
                ..
            } = body.joint;
            let joint = match kind {
                JointKind::Screw { axis, pitch } => {
                    pitches.push(Some(pitch));
                    Joint::cylindrical(axis)
                }
                _ => {
                    pitches.push(None);
                    Compound::from(Joint::new(kind))
                }
            };
            let joint = joint.at(parent_placement).on_child(child_placement);
            loose = loose.body(&body.name, body.parent.as_deref(), joint, body.mass);
        }
        let loose = loose.build().unwrap();
        let mut open = State::neutral(&loose);
        let (mut q, mut qd) = (Vec::new(), Vec::new());
        let mut ties = Vec::new();
        for (body, pitch) in tied.bodies().iter().zip(&pitches) {
            q.extend_from_slice(&state.q[body.position_range()]);
            qd.extend_from_slice(&state.qd[body.dof_range()]);
            ties.extend(body.dof_range().map(|dof| (dof, 1.0)));
            if let Some(pitch) = pitch {
                q.push(pitch * state.q[body.position_start]);
                qd.push(pitch * state.qd[body.dof_start]);
                ties.push((body.dof_start, *pitch));
            }
        }
        (open.q, open.qd) = (q, qd);
        let mut random = Random::new(seed);
        let mut forces = Forces::none(&tied);
        forces.joint.fill_with(|| random.symmetric());

        let mut workspace = Workspace::new(&loose, Precision::F64);
        let none = Forces::none(&loose);
        let still = vec![0.0; loose.dof_count()];
        let bias = rnea(&loose, &open, &still, &none, &mut workspace)
            .unwrap()
            .to_vec();
        let mass = crba(&loose, &open, &mut workspace).unwrap();
        let n = tied.dof_count();
        let mut reduced = Mat::<f64>::zeros(n, n);
        let mut right = Mat::from_fn(n, 1, |dof, _| forces.joint[dof]);
        for (row, &(at, factor)) in ties.iter().enumerate() {
            right[(at, 0)] -= factor * bias[row];
            for (column, &(to, other)) in ties.iter().enumerate() {
                reduced[(at, to)] += factor * mass[(row, column)] * other;
            }
        }
        let expected = reduced.partial_piv_lu().solve(&right);
        let largest = (0..n).fold(0.0_f64, |m, dof| m.max(expected[(dof, 0)].abs()));
        let mut workspace = Workspace::new(&tied, Precision::F64);
        let by_recursion = aba(&tied, &state, &forces, &mut workspace).unwrap();
        let mut tree = DcaWorkspace::new(&tied, &DcaOptions::default()).unwrap();
        let by_tree = dca(&tied, &state, &forces, &mut tree).unwrap();
        for found in [by_recursion, by_tree] {
            for (dof, &found) in found.iter().enumerate() {
                let off = (found - expected[(dof, 0)]).abs() / largest;
                assert!(off <= 1e-9, "seed {seed} dof {dof}: {off:e}");
            }
        }
    }
}

/// The pose across a compound joint is the product of its motions about their own points.
#[test]
fn compounds_are_products_of_exponentials() {
    let mut random = Random::new(5);
    for _ in 0..50 {
        let motions: Vec<(JointKind, DVec3)> = (0..1 + random.below(4))
            .map(|_| {
                let (axis, pitch) = (random.direction(), random.symmetric());
                let kind = match random.below(3) {
                    0 => JointKind::Revolute { axis },
                    1 => JointKind::Prismatic { axis },
                    _ => JointKind::Screw { axis, pitch },
                };
                (kind, random.direction())
            })
            .collect();
        let joints = motions
            .iter()
            .map(|&(kind, point)| Joint::new(kind).through(point));
        let mut pose = || Pose::new(random.rotation(), random.direction());
        let (on_parent, on_child) = (pose(), pose());
        let joint = Compound::new(joints).at(on_parent).on_child(on_child);
        let mass = MassProperties::sphere(1.0, 0.2);
        let model = ModelDescription::new("compound")
            .body("end", None, joint, mass)
            .build()
            .unwrap();
        assert_eq!(model.bodies().len(), motions.len());
        let state = State::random(&model, 3);
        let affine =
            |pose: &Pose| DAffine3::from_rotation_translation(pose.rotation, pose.translation);
        let mut expected = affine(&on_parent);
        for (&(kind, point), &q) in motions.iter().zip(&state.q) {
            let moved = match kind {
                JointKind::Revolute { axis } => DAffine3::from_axis_angle(axis, q),
                JointKind::Prismatic { axis } => DAffine3::from_translation(axis * q),
                JointKind::Screw { axis, pitch } => DAffine3::from_rotation_translation(
                    DQuat::from_axis_angle(axis, q),
                    axis * (pitch * q),
                ),
                _ => DAffine3::IDENTITY,
            };
            let to = DAffine3::from_translation(point);
            expected = expected * to * moved * to.inverse();
        }
        expected *= affine(&on_child).inverse();
        let mut workspace = Workspace::new(&model, Precision::F64);
        forward_kinematics(&model, &state, &mut workspace).unwrap();
        let found = affine(&workspace.pose(model.find("end").unwrap()).unwrap());
        for (a, b) in found
            .to_cols_array()
            .into_iter()
            .zip(expected.to_cols_array())
        {
            assert!((a - b).abs() <= 1e-14, "{a} for {b}");
        }
    }
}

/// A nut on a thread under gravity falls as slowly as its spin allows: v' = -g p^2 m / (I + p^2 m).
#[test]
fn a_nut_runs_down_its_thread() {
    let nut = MassProperties::cuboid(0.5, DVec3::new(0.1, 0.1, 0.04));
    let pitch = 0.03;
    let model = ModelDescription::new("thread")
        .body("nut", None, Joint::screw(DVec3::Z, pitch), nut)
        .build()
        .unwrap();
    let mut simulation = Simulation::new(model)
        .unwrap()
        .with_integrator(Integrator::RungeKutta4);
    for _ in 0..100 {
        simulation.step(0.01).unwrap();
    }
    let moved = nut.inertia.z_axis.z + pitch * pitch * nut.mass;
    let spin = -9.81 * pitch * nut.mass / moved;
    let state = simulation.state().unwrap();
    assert!(
        (state.qd[0] - spin).abs() <= 1e-11 * spin.abs(),
        "{}",
        state.qd[0]
    );
    assert!((state.q[0] - 0.5 * spin).abs() <= 1e-11 * spin.abs());
}

/// Derivatives of forward dynamics with screws and with inertia of the freedoms' own, against central
/// differences.
#[test]
fn derivatives_know_screws_and_rotors() {
    for seed in 0..6 {
        let model = generate::random_mechanism(6, false, seed).unwrap();
        let state = State::random(&model, seed);
        let mut random = Random::new(seed);
        let mut forces = Forces::none(&model);
        forces.joint.fill_with(|| random.symmetric());
        forces.joint_inertia = (0..model.dof_count()).map(|_| random.unit()).collect();
        let mut workspace = Workspace::new(&model, Precision::F64);
        let mut found = Derivatives::new(&model);
        aba_derivatives(&model, &state, &forces, &mut workspace, &mut found).unwrap();
        let mut inverse = Derivatives::new(&model);
        let qdd = workspace.joint_accelerations().unwrap().to_vec();
        rnea_derivatives(&model, &state, &qdd, &forces, &mut workspace, &mut inverse).unwrap();
        let identity = &found.drive * &inverse.drive;
        let mut solve = |state: &State, forces: &Forces| {
            aba(&model, state, forces, &mut workspace).unwrap().to_vec()
        };
        for body in model.bodies() {
            for dof in body.dof_range() {
                let e = 1e-6;
                let mut difference = |change: &dyn Fn(&mut State, &mut Forces, f64)| {
                    let [up, down] = [e, -e].map(|e| {
                        let (mut state, mut forces) = (state.clone(), forces.clone());
                        change(&mut state, &mut forces, e);
                        solve(&state, &forces)
                    });
                    up.iter()
                        .zip(down)
                        .map(|(a, b)| (a - b) / (2.0 * e))
                        .collect::<Vec<_>>()
                };
                let by_rate = difference(&|state, _, e| state.qd[dof] += e);
                let by_force = difference(&|_, forces, e| forces.joint[dof] += e);
                let mut columns = vec![(by_rate, &found.rate), (by_force, &found.drive)];
                if body.dof_range().len() == 1 {
                    let by_position = difference(&|state, _, e| state.q[body.position_start] += e);
                    columns.push((by_position, &found.position));
                }
                for (expected, found) in columns {
                    let largest = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                    for (row, expected) in expected.into_iter().enumerate() {
                        let off = (found[(row, dof)] - expected).abs() / largest;
                        assert!(off <= 1e-6, "seed {seed} row {row} dof {dof}: {off:e}");
                    }
                }
                for row in 0..model.dof_count() {
                    let unit = f64::from(u8::from(row == dof));
                    assert!((identity[(row, dof)] - unit).abs() <= 1e-9);
                }
            }
        }
    }
}
