//! MJCF files: models and dynamics against MuJoCo's own.

#![cfg(feature = "mjcf")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DQuat, DVec3};
use serde_json::Value;
use vertebra_assembly::{Closure, JointKind, Model, State};
use vertebra_dynamics::{
    Elements, Forces, Precision, Simulation, Workspace, aba, forward_kinematics,
};
use vertebra_files::FileError;
use vertebra_files::mjcf::{self, Options, Robot};
use vertebra_spatial::Pose;

/// What two programs in f64 agree to, relative.
const TOLERANCE: f64 = 1e-9;

fn parse(text: &str) -> Result<Robot, FileError> {
    mjcf::parse(text, &Options::default())
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

/// A case of MuJoCo's in our coordinates. Its free joints are in world axes, positions and forces too,
/// but angular rates in the body's; its quaternions start with w; positions count from `ref`.
struct Case {
    state: State,
    forces: Forces,
    qdd: Vec<f64>,
}

fn case(model: &Model, gold: &Value, case: &Value) -> Case {
    let [q, qd, tau, qdd] = ["q", "qd", "tau", "qdd"].map(|key| numbers(&case[key]));
    let mut state = State::neutral(model);
    let mut forces = Forces::none(model);
    let mut expected = vec![0.0; model.dof_count()];
    let movable = model
        .bodies()
        .iter()
        .filter(|body| body.joint.kind != JointKind::Fixed);
    for (body, joint) in movable.zip(gold["joints"].as_array().unwrap()) {
        let from = usize::try_from(joint["qadr"].as_u64().unwrap()).unwrap();
        let dof = usize::try_from(joint["vadr"].as_u64().unwrap()).unwrap();
        let quaternion = |at: usize| DQuat::from_xyzw(q[at + 1], q[at + 2], q[at + 3], q[at]);
        let vector = |list: &[f64], at: usize| DVec3::from_slice(&list[at..at + 3]);
        let (ours, dofs) = (body.position_range(), body.dof_range());
        match body.joint.kind {
            JointKind::Free => {
                let pose = Pose::new(quaternion(from + 3), vector(&q, from));
                let moved = body.joint.parent_placement.inverse() * pose;
                state.q[ours.start..ours.start + 3].copy_from_slice(&moved.translation.to_array());
                state.q[ours.start + 3..ours.end].copy_from_slice(&moved.rotation.to_array());
                let back = pose.rotation.conjugate();
                let w = vector(&qd, dof + 3);
                let v = back * vector(&qd, dof);
                let a = back * vector(&qdd, dof) - w.cross(v);
                for (list, angular, linear) in [
                    (&mut state.qd, w, v),
                    (
                        &mut forces.joint,
                        vector(&tau, dof + 3),
                        back * vector(&tau, dof),
                    ),
                    (&mut expected, vector(&qdd, dof + 3), a),
                ] {
                    list[dofs.start..dofs.start + 3].copy_from_slice(&angular.to_array());
                    list[dofs.start + 3..dofs.end].copy_from_slice(&linear.to_array());
                }
            }
            kind => {
                if kind == JointKind::Spherical {
                    state.q[ours].copy_from_slice(&quaternion(from).to_array());
                } else {
                    state.q[ours.start] = q[from] - joint["ref"].as_f64().unwrap();
                }
                let theirs = dof..dof + dofs.len();
                state.qd[dofs.clone()].copy_from_slice(&qd[theirs.clone()]);
                forces.joint[dofs.clone()].copy_from_slice(&tau[theirs.clone()]);
                expected[dofs].copy_from_slice(&qdd[theirs]);
            }
        }
    }
    Case {
        state,
        forces,
        qdd: expected,
    }
}

/// Accelerations, places and masses of a file are MuJoCo's.
fn agrees(text: &str, gold: &str) {
    let robot = parse(text).unwrap();
    let model = &robot.model;
    let gold: Value = serde_json::from_str(gold).unwrap();
    for (name, mass) in gold["masses"].as_object().unwrap() {
        let body = model.body(model.find(name).unwrap()).unwrap();
        let mass = mass.as_f64().unwrap();
        assert!((body.mass.mass - mass).abs() <= 1e-12 * mass, "{name}");
    }
    let mut workspace = Workspace::new(model, Precision::F64);
    for theirs in gold["cases"].as_array().unwrap() {
        let case = case(model, &gold, theirs);
        forward_kinematics(model, &case.state, &mut workspace).unwrap();
        for (name, position) in theirs["position"].as_object().unwrap() {
            let pose = workspace.pose(model.find(name).unwrap()).unwrap();
            let apart = pose.translation - DVec3::from_slice(&numbers(position));
            assert!(apart.length() < 1e-12, "{name} is {apart} away");
        }
        let mut elements = Elements::new(model);
        let loaded = elements.load(&case.state, &case.forces, 0.0).unwrap();
        let qdd = aba(model, &case.state, loaded, &mut workspace).unwrap();
        let largest = case.qdd.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (index, (ours, theirs)) in qdd.iter().zip(&case.qdd).enumerate() {
            let apart = (ours - theirs).abs() / largest;
            assert!(
                apart < TOLERANCE,
                "freedom {index}: {ours} against {theirs}"
            );
        }
    }
}

#[test]
fn a_quadruped_moves_as_in_mujoco() {
    agrees(
        include_str!("data/quadruped.xml"),
        include_str!("data/quadruped.gold.json"),
    );
}

#[test]
fn every_joint_shape_and_orientation_is_as_in_mujoco() {
    agrees(
        include_str!("data/mechanism.xml"),
        include_str!("data/mechanism.gold.json"),
    );
}

#[test]
fn several_joints_in_one_body_are_as_in_mujoco() {
    agrees(
        include_str!("data/chain.xml"),
        include_str!("data/chain.gold.json"),
    );
}

#[test]
fn classes_actuators_and_limits() {
    let robot = parse(include_str!("data/quadruped.xml")).unwrap();
    let model = &robot.model;
    let knee = model.body(robot.joints["knee_fl"]).unwrap();
    let range = knee.joint.limits.unwrap().position.unwrap();
    let degrees = |angle: f64| angle.to_radians();
    // The range counts from the reference, -40 degrees.
    assert!((range[0] - degrees(-80.0)).abs() < 1e-15 && (range[1] - degrees(20.0)).abs() < 1e-15);
    let [hip, knee, motor, speed] = &robot.actuators[..] else {
        unreachable!("four actuators")
    };
    let servo = |stiffness: f64, damping: f64| (stiffness, [0.0, -stiffness, -damping]);
    assert_eq!((hip.gain, hip.bias), servo(40.0, 2.0));
    assert_eq!(hip.largest_force, Some(30.0));
    assert_eq!((knee.gain, knee.bias), servo(25.0, 2.0));
    assert_eq!(knee.control_range, Some([-2.0, 0.0]));
    assert!((knee.reference - degrees(-40.0)).abs() < 1e-15);
    assert_eq!((motor.gain, motor.gear), (1.0, 12.0));
    assert_eq!((speed.gain, speed.bias), (3.0, [0.0, 0.0, -3.0]));
    assert_eq!(robot.time_step, Some(0.002));
    let imu = model.find_frame("imu").unwrap();
    assert_eq!(imu.body, model.find("trunk"));
    assert!((imu.placement.rotation * DVec3::X - DVec3::Y).length() < 1e-15);
    // The floor has no shape that bodies have; all else is there.
    assert_eq!(robot.parts.len(), 10);
    assert!(robot.ignored.is_empty(), "{:?}", robot.ignored);
}

#[test]
fn equalities_hold_bodies_where_the_file_has_them() {
    let robot = parse(
        r#"<mujoco><worldbody>
             <body name="a" pos="0 0 1"><joint name="a"/><geom size="0.1"/>
               <body name="b" pos="1 0 0"><joint name="b"/><geom size="0.1"/></body></body>
             <body name="c" pos="0 2 1" euler="0 0 90"><joint name="c"/><geom size="0.1"/></body>
           </worldbody>
           <equality>
             <connect name="k" body1="b" body2="c" anchor="0.1 0 0" solref="0.01 1"/>
             <weld body1="c" relpose="0 0 0 0 0 0 0"/>
             <joint joint1="b" joint2="a" polycoef="0.5 -2 0 0 0"/>
             <joint joint1="c" joint2="a" polycoef="0 1 1 0 0"/>
             <tendon tendon1="t"/>
             <weld body1="a" active="false"/>
             <conect body1="a"/>
           </equality></mujoco>"#,
    )
    .unwrap();
    let [connect, weld] = robot.model.loops() else {
        unreachable!("two loops")
    };
    let id = |name: &str| robot.model.find(name);
    assert_eq!((connect.name.as_str(), weld.name.as_str()), ("k", "weld"));
    assert_eq!(
        (connect.bodies, connect.closure),
        ([id("b"), id("c")], Closure::Ball)
    );
    // The point (1.1, 0, 1), seen from c at (0, 2, 1), which is turned to the left.
    let expected = DVec3::new(-2.0, -1.1, 0.0);
    assert!((connect.placements[1].translation - expected).length() < 1e-15);
    assert_eq!(
        (weld.bodies, weld.closure),
        ([id("c"), None], Closure::Weld)
    );
    let back = weld.placements[0].inverse().translation;
    assert!((back - DVec3::new(0.0, 2.0, 1.0)).length() < 1e-15);
    let [gears] = &robot.model.couplings().collect::<Vec<_>>()[..] else {
        unreachable!("one coupling")
    };
    assert_eq!((Some(gears.body), Some(gears.other)), (id("b"), id("a")));
    assert_eq!((gears.ratio, gears.offset), (-2.0, 0.5));
    let listed: Vec<String> = robot.ignored.iter().map(ToString::to_string).collect();
    assert_eq!(
        listed,
        [
            "line 7: `solref` of <connect> has no effect",
            "line 10: <joint> of <equality> has no effect: its polynomial is no line, which couplings are",
            "line 11: <tendon> of <equality> has no effect",
            "line 12: <weld> of <equality> has no effect: it is not active",
            "line 13: <conect> of <equality> has no effect: is <connect> meant?",
        ]
    );
}

/// Every equality at once: the states in which MuJoCo's residual of them is zero close our loops, and our
/// accelerations are those that MuJoCo's mass matrix, forces and constraint Jacobian give.
#[test]
fn closed_loops_move_as_mujocos_equalities_demand() {
    let robot = parse(include_str!("data/linkage.xml")).unwrap();
    assert!(robot.ignored.is_empty(), "{:?}", robot.ignored);
    let model = &robot.model;
    assert_eq!((model.loops().len(), model.couplings().count()), (4, 2));
    let gold: Value = serde_json::from_str(include_str!("data/linkage.gold.json")).unwrap();
    let mut simulation = Simulation::new(model.clone()).unwrap();
    for theirs in gold["cases"].as_array().unwrap() {
        let case = case(model, &gold, theirs);
        simulation.set_state(case.state).unwrap();
        simulation
            .forces_mut()
            .joint
            .copy_from_slice(&case.forces.joint);
        let violation = simulation.loop_violation().unwrap().unwrap();
        assert!(
            violation.position < 1e-13 && violation.rate < 1e-12,
            "{violation:?}"
        );
        let qdd = simulation.solve().unwrap().joint_accelerations().unwrap();
        let largest = case.qdd.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (index, (ours, theirs)) in qdd.iter().zip(&case.qdd).enumerate() {
            let apart = (ours - theirs).abs() / largest;
            assert!(
                apart < TOLERANCE,
                "freedom {index}: {ours} against {theirs}"
            );
        }
        simulation.steps(1e-3, 500).unwrap();
        let violation = simulation.loop_violation().unwrap().unwrap();
        assert!(violation.position < 1e-9, "{violation:?}");
    }
}
