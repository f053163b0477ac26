//! An SDF file with every joint that is read and frames in frames, against Drake.

#![cfg(feature = "sdf")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat3, DQuat, DVec3, EulerRot};
use serde_json::Value;
use vertebra_assembly::{Body, JointKind, State};
use vertebra_dynamics::{Elements, Forces, Precision, Workspace, aba, forward_kinematics};
use vertebra_files::sdf;

/// What two programs in f64 agree to, relative.
const TOLERANCE: f64 = 1e-9;

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap().iter();
    list.map(|x| x.as_f64().unwrap()).collect()
}

/// Takes over what Drake says of one joint with all of its freedoms on one body. Its ball joint has roll, pitch and
/// yaw and rates in the parent's axes; its free links a quaternion with w first, the place, and rates in world axes.
fn set(
    body: &Body,
    [q, qd, tau, qdd]: [&[f64]; 4],
    state: &mut State,
    forces: &mut Forces,
    expected: &mut [f64],
) {
    let (at, dofs) = (body.position_range(), body.dof_range());
    let vector = |list: &[f64], from: usize| DVec3::from_slice(&list[from..from + 3]);
    let mut rates = |list: [DVec3; 3], from: usize| {
        for (values, list) in [&mut state.qd, &mut forces.joint].into_iter().zip(list) {
            values[dofs.start + from..][..3].copy_from_slice(&list.to_array());
        }
        expected[dofs.start + from..][..3].copy_from_slice(&list[2].to_array());
    };
    match body.joint.kind {
        JointKind::Spherical => {
            let turn = DQuat::from_euler(EulerRot::ZYX, q[2], q[1], q[0]);
            let back = turn.conjugate();
            rates([qd, tau, qdd].map(|list| back * vector(list, 0)), 0);
            state.q[at].copy_from_slice(&turn.to_array());
        }
        JointKind::Free => {
            let place = body.joint.parent_placement.inverse();
            let turn = DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
            let back = turn.conjugate();
            let [angular, linear] =
                [0, 3].map(|from| [qd, tau, qdd].map(|list| back * vector(list, from)));
            rates(angular, 0);
            // Components in axes that turn.
            rates(
                [
                    linear[0],
                    linear[1],
                    linear[2] - angular[0].cross(linear[0]),
                ],
                3,
            );
            state.q[at.start..at.start + 3]
                .copy_from_slice(&place.transform_point(vector(q, 4)).to_array());
            state.q[at.start + 3..at.end].copy_from_slice(&(place.rotation * turn).to_array());
        }
        _ => {
            state.q[at].copy_from_slice(q);
            state.qd[dofs.clone()].copy_from_slice(qd);
            forces.joint[dofs.clone()].copy_from_slice(tau);
            expected[dofs].copy_from_slice(qdd);
        }
    }
}

#[test]
fn a_crane_and_a_press_move_as_drakes() {
    let import = sdf::parse(include_str!("data/crane.sdf")).unwrap();
    assert!(import.ignored.is_empty(), "{:?}", import.ignored);
    let model = &import.model;
    let gold: Value = serde_json::from_str(include_str!("data/crane.gold.json")).unwrap();
    for (name, mass) in gold["masses"].as_object().unwrap() {
        let body = model.body(model.find(name).unwrap()).unwrap();
        assert_eq!(body.mass.mass, mass.as_f64().unwrap(), "{name}");
    }
    let mut workspace = Workspace::new(model, Precision::F64);
    let mut elements = Elements::new(model);
    for case in gold["cases"].as_array().unwrap() {
        let mut state = State::neutral(model);
        let mut forces = Forces::none(model);
        let mut expected = vec![f64::NAN; model.dof_count()];
        for (name, values) in case["joints"].as_object().unwrap() {
            let lists = ["q", "qd", "tau", "qdd"].map(|key| numbers(&values[key]));
            // A free link stands under its own name, and a joint with two axes on two bodies in a row.
            let last = import.joints.get(name).copied();
            let last = model
                .body(last.or_else(|| model.find(name)).unwrap())
                .unwrap();
            let freedoms = last.dof_range().len();
            let mut chain = vec![last];
            if lists[1].len() > freedoms {
                chain.insert(0, model.body(last.parent.unwrap()).unwrap());
            }
            for (index, body) in chain.iter().enumerate() {
                let part = match chain.len() {
                    1 => lists.each_ref().map(Vec::as_slice),
                    _ => lists.each_ref().map(|list| &list[index..=index]),
                };
                set(body, part, &mut state, &mut forces, &mut expected);
            }
        }
        forward_kinematics(model, &state, &mut workspace).unwrap();
        for (name, place) in case["places"].as_object().unwrap() {
            let pose = workspace.pose(model.find(name).unwrap()).unwrap();
            let place = numbers(place);
            let axes = DMat3::from_cols_slice(&place[..9]);
            let apart = pose.translation - DVec3::from_slice(&place[9..]);
            assert!(apart.length() < 1e-12, "{name} is {apart} away");
            assert!(pose.matrix().abs_diff_eq(axes, 1e-12), "{name}");
        }
        let loaded = elements.load(&state, &forces, 0.0).unwrap();
        let qdd = aba(model, &state, loaded, &mut workspace).unwrap();
        let largest = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!(largest > 1.0);
        for (index, (ours, theirs)) in qdd.iter().zip(&expected).enumerate() {
            let apart = (ours - theirs).abs() / largest;
            assert!(
                apart < TOLERANCE,
                "freedom {index}: {ours} against {theirs}"
            );
        }
    }
}
