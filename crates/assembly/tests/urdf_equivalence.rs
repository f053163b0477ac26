//! URDF: what is written comes back as the same robot, and folding changes nothing.
#![cfg(feature = "urdf")]
#![expect(
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::{affine, assert_same_placement, body_placements, named_placement, total_moments};
use core::fmt::Write as _;
use glam::{DMat3, DVec3};
use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::urdf::{self, Options};
use vertebra_assembly::{JointKind, Model, State};
use vertebra_spatial::Pose;

/// The URDF text of a model whose joints URDF can state.
///
/// URDF has a link's frame on its joint's, so links stand at the models' child joint frames.
fn written(model: &Model) -> String {
    let mut text = String::from("<robot name='written'>\n<link name='world'/>\n");
    let vector = |v: DVec3| format!("{:?} {:?} {:?}", v.x, v.y, v.z);
    let origin = |pose: &Pose| {
        let m = pose.matrix().to_cols_array_2d();
        let (roll, yaw) = (m[1][2].atan2(m[2][2]), m[0][1].atan2(m[0][0]));
        let pitch = (-m[0][2]).atan2(m[0][0].hypot(m[0][1]));
        let turns = vector(DVec3::new(roll, pitch, yaw));
        format!("<origin xyz='{}' rpy='{turns}'/>", vector(pose.translation))
    };
    for body in model.bodies() {
        let mass = body.mass.placed(&body.joint.child_placement.inverse());
        let at_center = Pose::from_translation(mass.center);
        let [x, y, z] = mass.inertia.to_cols_array_2d();
        writeln!(
            text,
            "<link name='{}'><inertial>{}<mass value='{:?}'/>\
             <inertia ixx='{:?}' ixy='{:?}' ixz='{:?}' iyy='{:?}' iyz='{:?}' izz='{:?}'/></inertial></link>",
            body.name, origin(&at_center), mass.mass, x[0], x[1], x[2], y[1], y[2], z[2]
        )
        .unwrap();
        let (parent, seen_from) = match body.parent.and_then(|parent| model.body(parent)) {
            Some(parent) => (parent.name.as_str(), parent.joint.child_placement.inverse()),
            None => ("world", Pose::IDENTITY),
        };
        let (kind, axis) = match body.joint.kind {
            JointKind::Revolute { axis } => ("continuous", axis),
            JointKind::Prismatic { axis } => ("prismatic", axis),
            JointKind::Fixed => ("fixed", DVec3::X),
            JointKind::Free => ("floating", DVec3::X),
            JointKind::Spherical | JointKind::Screw { .. } => panic!("URDF has no such joints"),
        };
        writeln!(
            text,
            "<joint name='to-{0}' type='{kind}'><parent link='{parent}'/><child link='{0}'/>{1}<axis xyz='{2}'/></joint>",
            body.name,
            origin(&(seen_from * body.joint.parent_placement)),
            vector(axis)
        )
        .unwrap();
    }
    text + "</robot>"
}

/// A random model without ball joints.
fn writable(seed: u64) -> Model {
    let tree = RandomTree {
        floating: seed.is_multiple_of(2),
        ..RandomTree::mixed(30)
    };
    let mut description = generate::random_tree(&tree, seed).unwrap().describe();
    for body in &mut description.bodies {
        if body.joint.kind == JointKind::Spherical {
            body.joint.kind = JointKind::Revolute {
                axis: DVec3::new(0.6, 0.0, 0.8),
            };
        }
    }
    description.build().unwrap()
}

/// Forward kinematics compose up to `depth` placements whose entries are below `reach`; each costs
/// a few roundings of its own and of the roll, pitch and yaw it was written in.
fn tolerance(model: &Model) -> f64 {
    let depth = model.depth() as f64;
    let reach = 4.0 * depth;
    64.0 * f64::EPSILON * depth * reach
}

#[test]
fn a_written_model_reads_back_the_same() {
    for seed in 0..60_u64 {
        let model = writable(seed);
        let text = written(&model);
        let kept = urdf::parse(&text, &Options::default().keep_fixed())
            .unwrap()
            .model;
        // The world link of the file is a body fixed to the world.
        assert_eq!(kept.bodies().len(), model.bodies().len() + 1);
        assert_eq!(kept.dof_count(), model.dof_count());

        let state = State::random(&model, seed);
        // Positions of the read model stand in its own order.
        let mut q = vec![0.0; kept.position_count()];
        for body in model.bodies() {
            let other = kept.body(kept.find(&body.name).unwrap()).unwrap();
            q[other.position_range()].copy_from_slice(&state.q[body.position_range()]);
        }
        let placements = body_placements(&model, &state.q);
        let read_placements = body_placements(&kept, &q);
        for (body, placement) in model.bodies().iter().zip(&placements) {
            let link = *placement * affine(&body.joint.child_placement);
            let found = named_placement(&kept, &read_placements, &body.name);
            assert_same_placement(&link, &found, tolerance(&model), &body.name);
            let other = kept.body(kept.find(&body.name).unwrap()).unwrap();
            let parent = |m: &Model, b: &vertebra_assembly::Body| {
                b.parent.map(|p| m.body(p).unwrap().name.clone())
            };
            let expected = parent(&model, body).unwrap_or_else(|| "world".to_owned());
            assert_eq!(parent(&kept, other), Some(expected));
        }
        assert_same_moments(
            total_moments(&model, &placements),
            total_moments(&kept, &read_placements),
            tolerance(&model),
        );
    }
}

fn assert_same_moments(a: (f64, DVec3, DMat3), b: (f64, DVec3, DMat3), tolerance: f64) {
    let reach = (a.2.x_axis.x + a.2.y_axis.y + a.2.z_axis.z).sqrt().max(1.0);
    assert!((a.0 - b.0).abs() <= tolerance * a.0, "mass {} {}", a.0, b.0);
    assert!(
        a.1.abs_diff_eq(b.1, tolerance * a.0 * reach),
        "first moment {} {}",
        a.1,
        b.1
    );
    assert!(
        a.2.abs_diff_eq(b.2, tolerance * a.0 * reach * reach),
        "second moment {} {}",
        a.2,
        b.2
    );
}

#[test]
fn folding_changes_neither_places_nor_masses() {
    for seed in 0..60_u64 {
        let model = writable(seed);
        // Nothing is welded to the world's link, so no mass is lost in it; the base that floats
        // is the first body.
        let text = written(&model);
        let floating =
            text.replace("<link name='world'/>", "")
                .replacen(&joint_to_world(&text), "", 1);
        let folded_options = Options::default().floating_base();
        let folded = urdf::parse(&floating, &folded_options).unwrap().model;
        let kept = urdf::parse(&floating, &folded_options.clone().keep_fixed())
            .unwrap()
            .model;
        assert_eq!(folded.dof_count(), kept.dof_count());
        assert_eq!(
            folded.bodies().len() + folded.frames().len(),
            kept.bodies().len()
        );
        let fixed = kept
            .bodies()
            .iter()
            .filter(|b| b.joint.kind == JointKind::Fixed)
            .count();
        assert_eq!(folded.frames().len(), fixed);
        // Both stand depth first: the same positions serve both.
        let state = State::random(&kept, seed);
        let kept_placements = body_placements(&kept, &state.q);
        let folded_placements = body_placements(&folded, &state.q);
        for (body, placement) in kept.bodies().iter().zip(&kept_placements) {
            let found = named_placement(&folded, &folded_placements, &body.name);
            assert_same_placement(placement, &found, tolerance(&kept), &body.name);
        }
        assert_same_moments(
            total_moments(&kept, &kept_placements),
            total_moments(&folded, &folded_placements),
            tolerance(&kept),
        );
    }
}

/// The element that joins the first body to the world.
fn joint_to_world(text: &str) -> String {
    let line = text
        .lines()
        .find(|line| line.contains("<parent link='world'/>"));
    line.unwrap().to_owned()
}
