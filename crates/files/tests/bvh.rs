//! Motion capture: skeletons, motions, and everything that is refused.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat3, DQuat, DVec3};
use vertebra_assembly::{JointKind, State};
use vertebra_dynamics::{Precision, Simulation, Workspace, forward_kinematics};
use vertebra_files::FileError;
use vertebra_files::bvh::{self, Capture, Options};

const WALK: &str = include_str!("data/walk.bvh");

fn walk() -> Capture {
    bvh::parse(WALK, &Options::default()).unwrap()
}

#[test]
fn a_skeleton_is_a_model() {
    let capture = walk();
    let model = &capture.model;
    assert_eq!(model.bodies().len(), 11);
    assert_eq!(model.bodies()[0].joint.kind, JointKind::Free);
    let mass: f64 = model.bodies().iter().map(|body| body.mass.mass).sum();
    assert!((10.0..150.0).contains(&mass), "{mass} kg");
    assert_eq!(capture.motion.len(), 25);
    assert!((capture.motion.duration() - 0.96).abs() < 1e-15);
    assert!(capture.ignored.is_empty());
    assert_eq!(capture.parts.len(), 15);
    // Half a metre above the hips at rest, with z up: at the pose of the file the spine stands.
    let mut workspace = Workspace::new(model, Precision::F64);
    forward_kinematics(model, &State::neutral(model), &mut workspace).unwrap();
    let head = workspace.pose(model.find("Head").unwrap()).unwrap();
    assert!((head.translation - DVec3::new(0.0, -0.005, 0.54)).length() < 1e-15);
}

/// Places of a frame, by matrices straight from the definition of the format.
#[test]
fn frames_are_where_the_channels_say() {
    let capture = walk();
    let model = &capture.model;
    let mut workspace = Workspace::new(model, Precision::F64);
    let rows = WALK
        .lines()
        .skip_while(|line| !line.starts_with("Frame Time"))
        .skip(1);
    for (index, row) in rows.enumerate() {
        let mut numbers = row
            .split_whitespace()
            .map(|word| word.parse::<f64>().unwrap());
        let mut places: Vec<(DMat3, DVec3)> = Vec::new();
        for body in model.bodies() {
            let mut next = || numbers.next().unwrap();
            let moved = match body.parent {
                None => DVec3::new(next(), next(), next()) * 0.01,
                Some(_) => body.joint.parent_placement.translation,
            };
            let z = DMat3::from_rotation_z(next().to_radians());
            let x = DMat3::from_rotation_x(next().to_radians());
            let y = DMat3::from_rotation_y(next().to_radians());
            let (turn, origin) = match body.parent {
                Some(parent) => places[parent.index()],
                None => (DMat3::IDENTITY, DVec3::ZERO),
            };
            places.push((turn * z * x * y, origin + turn * moved));
        }
        let state = State {
            q: capture.motion.frame(index).unwrap().to_vec(),
            ..State::neutral(model)
        };
        forward_kinematics(model, &state, &mut workspace).unwrap();
        let upright = DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2);
        for (id, (turn, origin)) in model.body_ids().zip(&places) {
            let pose = workspace.pose(id).unwrap();
            assert!((pose.translation - upright * *origin).length() < 1e-14);
            assert!((pose.matrix() - upright * *turn).abs_diff_eq(DMat3::ZERO, 1e-14));
        }
    }
}

#[test]
fn between_frames_rates_are_those_of_the_positions() {
    let Capture { model, motion, .. } = walk();
    for time in [0.011, 0.333, 0.9587] {
        let state = motion.state(&model, time).unwrap();
        let step = 1e-6;
        let [before, after] = [-step, step].map(|dt| motion.state(&model, time + dt).unwrap());
        for body in model.bodies() {
            let (positions, dofs) = (body.position_range(), body.dof_range());
            let q = |state: &State| state.q[positions.clone()].to_vec();
            let (now, early, late) = (q(&state), q(&before), q(&after));
            let shift = now.len() - 4;
            let turn = |q: &[f64]| DQuat::from_slice(&q[shift..]);
            // q' = q w / 2, so that w = 2 q* q'.
            let rate = (turn(&late) - turn(&early)) * (0.5 / step);
            let angular = (turn(&now).conjugate() * rate).xyz() * 2.0;
            let stated = &state.qd[dofs];
            assert!((angular - DVec3::from_slice(stated)).length() < 1e-8);
            if shift == 3 {
                let moved = (DVec3::from_slice(&late) - DVec3::from_slice(&early)) * (0.5 / step);
                let linear = turn(&now).conjugate() * moved;
                assert!((linear - DVec3::from_slice(&stated[3..])).length() < 1e-8);
            }
        }
    }
    // Frames themselves are met, and beyond the ends all stands still.
    let met = motion.state(&model, 3.0 * motion.frame_time()).unwrap();
    let frame = motion.frame(3).unwrap();
    assert!(met.q.iter().zip(frame).all(|(a, b)| (a - b).abs() < 1e-12));
    let over = motion.state(&model, 99.0).unwrap();
    assert_eq!(over.q, motion.frame(24).unwrap());
    assert!(over.qd.iter().all(|&rate| rate == 0.0));
}

/// Stiff motors move every joint as it was captured, whatever the hips do.
#[test]
fn motors_follow_the_motion() {
    let Capture { model, motion, .. } = walk();
    let mut wanted = motion.state(&model, 0.0).unwrap();
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(wanted.clone()).unwrap();
    let driven = bvh::motors(&model, &wanted, |_| [1.0, 1.0]).count();
    assert_eq!(driven, model.bodies().len() - 1);
    let step = 1e-3;
    for _ in 0..400 {
        // Steps are implicit: they meet the targets at their ends.
        let end = simulation.time() + step;
        motion.interpolate(&model, end, &mut wanted).unwrap();
        for (body, motor) in bvh::motors(&model, &wanted, |_| [1e5, 1e4]) {
            simulation.set_spherical_motor(body, motor).unwrap();
        }
        simulation.step(step).unwrap();
        let found = &simulation.state().unwrap().q;
        for body in model.bodies().iter().skip(1) {
            let range = body.position_range();
            let [found, wanted] = [found, &wanted.q].map(|q| DQuat::from_slice(&q[range.clone()]));
            let off = found.angle_between(wanted);
            assert!(off <= 1e-2, "{}: {off}", body.name);
        }
    }
}

#[test]
fn mistakes_are_named_with_line_and_element() {
    let refused = |text: &str, line: u32, words: &str| {
        let error: FileError = bvh::parse(text, &Options::default()).unwrap_err();
        assert_eq!(error.location.line, Some(line), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    };
    let replaced = |from: &str, to: &str| WALK.replacen(from, to, 1);
    refused("", 1, "found the end of the text where HIERARCHY");
    refused("HIERARCHY\nJOINT a", 2, "where ROOT");
    refused(
        &replaced("OFFSET 0.00 12.0 0.5", "OFFSET 0.00 x 0.5"),
        8,
        "joint `Spine`: found `x`",
    );
    refused(
        &replaced("3 Zrotation", "3 Wrotation"),
        9,
        "found `Wrotation` where a channel",
    );
    refused(
        &replaced("CHANNELS 3", "CHANNELS 4"),
        10,
        "found `JOINT` where a channel",
    );
    refused(
        &replaced("End Site", "Sites"),
        14,
        "where JOINT, End Site or a closing brace",
    );
    refused(
        &replaced(
            "CHANNELS 3 Zrotation Xrotation",
            "CHANNELS 3 Zrotation zrotation",
        ),
        9,
        "joint `Spine`: found `zrotation` where a channel that the joint has not named yet",
    );
    for stated in ["24", "26"] {
        refused(
            &replaced("Frames: 25", &format!("Frames: {stated}")),
            78,
            &format!("the motion: states {stated} frames, but 25 follow"),
        );
    }
    // A number too few, too many, or none at all, in the middle of the motion.
    let lines: Vec<&str> = WALK.lines().collect();
    let row = lines[89];
    let (short, word) = row.trim_end().rsplit_once(' ').unwrap();
    let with = |row: &str, line: u32, words: &str| {
        let text = [&lines[..89], &[row], &lines[90..]].concat().join("\n");
        refused(&text, line, words);
    };
    with(
        short,
        90,
        "frame 11: has 35 numbers, but the joints have 36 channels",
    );
    with(&format!("{row} {word}"), 90, "frame 11: has 37 numbers");
    with(
        &format!("{short} 1x"),
        90,
        "frame 11: found `1x` where a number",
    );
    with("", 78, "states 25 frames, but 24 follow");
    refused(&replaced("Frames: 25", "Frames: -1"), 78, "a count");
    refused(
        &replaced("Time: 0.04", "Time: 0"),
        79,
        "the frame time [s] is 0",
    );
    let error = bvh::parse(WALK, &Options::default().unit(0.0)).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("the unit [m] of the options is 0"),
        "{error}"
    );
}

#[test]
fn displacements_of_inner_joints_are_listed() {
    let text = "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT b { OFFSET 0 1 0 CHANNELS 4 Xposition Zrotation Xrotation Yrotation
        End Site { OFFSET 0 1 0 } } } MOTION Frames: 1 Frame Time: 1
        0 0 0 7 0 0 0";
    let capture = bvh::parse(text, &Options::default()).unwrap();
    assert_eq!(
        capture.ignored[0].to_string(),
        "line 2: `Xposition` of joint `b` has no effect: bones keep their lengths"
    );
    assert_eq!(capture.motion.frame(0).unwrap()[..3], [0.0; 3]);
}
