use super::*;
use crate::{
    DcaOptions, DcaWorkspace, Precision, SolverOptions, Workspace, aba, dca, joint_wrenches,
    refine, residual, rnea,
};
use glam::{DMat3, DQuat, DVec3};
use vertebra_assembly::{BallRange, Joint, MassProperties, ModelDescription};
use vertebra_spatial::Pose;

/// A body adrift with an arm on a ball joint, a hinge, a second ball joint, and a second such body beside it.
fn adrift() -> Model {
    let at = Pose::from_translation(DVec3::new(0.1, -0.2, 0.3));
    let rod = MassProperties::rod(1.5, 0.4, 0.05);
    let shoulder = Joint::spherical().with_ball_range(BallRange::cone(DVec3::Z, 0.5));
    let wrist = Joint::spherical().with_ball_range(BallRange::turn(0.8));
    let hand = MassProperties::cuboid(0.5, DVec3::new(0.1, 0.2, 0.05));
    ModelDescription::new("adrift")
        .body("base", None, Joint::free(), hand)
        .body("upper", Some("base"), shoulder.clone().at(at), rod)
        .body(
            "lower",
            Some("upper"),
            Joint::revolute(DVec3::Y).with_damping(0.3).at(at),
            rod,
        )
        .body("hand", Some("lower"), wrist.at(at), hand)
        .body("other base", None, Joint::free(), rod)
        .body("other arm", Some("other base"), shoulder.at(at), rod)
        .build()
        .unwrap()
}

/// The state of which a step of 1e-2 s takes every ball joint to its stop, each about an axis that is none of its own.
fn before_the_stops(model: &Model) -> State {
    let mut state = State::random(model, 7);
    for (body, (angle, axis)) in [
        ("upper", (0.49, DVec3::new(1.0, 2.0, 0.0))),
        ("hand", (0.79, DVec3::new(1.0, -1.0, 3.0))),
        ("other arm", (0.49, DVec3::new(-2.0, 1.0, 0.0))),
    ] {
        let body = &model.bodies()[model.find(body).unwrap().index()];
        let axis = axis.normalize();
        let turned = DQuat::from_axis_angle(axis, angle);
        state.q[body.position_range()].copy_from_slice(&turned.to_array());
        state.qd[body.dof_range()].copy_from_slice(&(axis * 6.0).to_array());
    }
    state
}

/// At its stop a ball joint has inertia between its freedoms. Behind a body adrift, whose six freedoms have none, it
/// stands in its own place in every equation: residuals, corrections and joint forces see what the solvers saw.
#[test]
fn stops_behind_bodies_adrift_are_the_same_in_all_equations() {
    let model = adrift();
    let state = before_the_stops(&model);
    let mut forces = Forces::none(&model);
    forces.joint.copy_from_slice(&State::random(&model, 8).qd);
    let mut elements = Elements::new(&model);
    let mut solver = Solver::new(&model, &SolverOptions::default()).unwrap();
    let qdd = elements.solve(&mut solver, &state, &forces, 1e-2).unwrap();
    let qdd = qdd.to_vec();
    let loaded = elements.loaded;
    let balls = || {
        let bodies = model.body_ids().zip(model.bodies());
        bodies.filter(|(_, body)| body.joint.kind == JointKind::Spherical)
    };
    // E as it is stored, joint by joint; all that is not of ball joints has nothing across.
    let own = |body: &vertebra_assembly::Body| {
        let dofs = body.dof_range();
        let [xy, xz, yz] = [0, 1, 2].map(|k| loaded.joint_inertia_across[dofs.start + k]);
        let [x, y, z] = [0, 1, 2].map(|k| loaded.joint_inertia[dofs.start + k]);
        DMat3::from_cols_array(&[x, xy, xz, xy, y, yz, xz, yz, z])
    };
    for (_, body) in balls() {
        let across = &loaded.joint_inertia_across[body.dof_range()];
        let largest = across.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(largest > 0.1, "the stop of `{}` does not bind", body.name);
    }
    let bound = 64.0 * f64::EPSILON * model.depth() as f64;
    // A stop's torque exceeds what it lets pass by as much as its inertia exceeds that of what it stops.
    let firm = firmness(f64::EPSILON) * bound;
    let check = |what: &str, found: crate::Residual| {
        let holds = found.joint_force <= bound && found.by_body <= firm;
        assert!(holds, "{what}: {found:?}");
    };

    let mut workspace = Workspace::new(&model, Precision::F64);
    assert_eq!(aba(&model, &state, &loaded, &mut workspace).unwrap(), qdd);
    joint_wrenches(&mut workspace).unwrap();
    let found = residual(&model, &state, &loaded, &workspace).unwrap();
    check("recursion", found);
    // What Newton and Euler make of the motion, without E, is what the joint passes on: tau - E qdd.
    let mut bare = loaded.clone();
    bare.joint_inertia.clear();
    let passed = rnea(&model, &state, &qdd, &bare, &mut workspace).unwrap();
    for (_, body) in balls() {
        let of = |values: &[f64]| DVec3::from_slice(&values[body.dof_range()]);
        let e = own(body);
        let expected = of(&loaded.joint) - e * of(&qdd);
        // Of the same size cancel: the torque of the stop in excess, and its E times the acceleration.
        let scale = (of(&loaded.joint).length()) + (e.abs() * of(&qdd).abs()).length();
        let off = (of(passed) - expected).length();
        assert!(
            off <= 64.0 * bound * scale,
            "`{}`: {off:e} of {scale:e}",
            body.name
        );
    }
    aba(&model, &state, &loaded, &mut workspace).unwrap();
    let change = refine(&loaded, &mut workspace).unwrap();
    assert!(change.residual <= firm, "recursion: {change:?}");
    joint_wrenches(&mut workspace).unwrap();
    let found = residual(&model, &state, &loaded, &workspace).unwrap();
    check("corrected recursion", found);

    let mut tree = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
    dca(&model, &state, &loaded, &mut tree).unwrap();
    refine(&loaded, &mut tree).unwrap();
    let again = refine(&loaded, &mut tree).unwrap();
    assert!(again.residual <= firm, "tree: {again:?}");
    tree.compute_joint_wrenches(&loaded).unwrap();
    let found = residual(&model, &state, &loaded, &tree).unwrap();
    check("tree", found);
}
