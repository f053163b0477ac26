//! Models changed while they move, against their own kinematics.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::DVec3;
use vertebra_assembly::{
    BodyId, BodyShape, Builder, Closure, Compound, Edited, Joint, MassProperties, Mimic, Model,
    ModelDescription, ModelError, Random, State, generate,
};
use vertebra_dynamics::{Mechanics, Motor, Precision, Simulation, Workspace, forward_kinematics};
use vertebra_spatial::Pose;

/// Pose and velocity of every body.
fn motions(model: &Model, state: &State) -> Vec<(Pose, DVec3, DVec3)> {
    let mut workspace = Workspace::new(model, Precision::F64);
    forward_kinematics(model, state, &mut workspace).unwrap();
    let of = |id| {
        let velocity = workspace.velocity(id).unwrap();
        (
            workspace.pose(id).unwrap(),
            velocity.angular,
            velocity.linear,
        )
    };
    model.body_ids().map(of).collect()
}

/// The largest difference of pose, and of velocity, of bodies that are in both.
fn change(model: &Model, state: &State, edited: &Edited) -> (f64, f64) {
    let (before, after) = (motions(model, state), motions(&edited.model, &edited.state));
    let mut worst = (0.0_f64, 0.0_f64);
    for (old, new) in edited.bodies.iter().take(before.len()).enumerate() {
        let Some(new) = new else { continue };
        let ((p, w, v), (q, a, b)) = (&before[old], &after[new.index()]);
        let turned = 1.0 - p.rotation.dot(q.rotation).abs();
        let moved = (p.translation - q.translation).length().max(turned);
        worst = (
            worst.0.max(moved),
            worst.1.max((*w - *a).length().max((*v - *b).length())),
        );
        let name = |model: &Model, at: usize| model.bodies()[at].name.clone();
        assert_eq!(name(model, old), name(&edited.model, new.index()));
    }
    worst
}

#[test]
fn cuts_change_no_motion() {
    for seed in 0..20 {
        let model = generate::random_mechanism(15, false, seed).unwrap();
        let state = State::random(&model, seed);
        let mut random = Random::new(seed);
        let mut edit = model.edit(&state).unwrap();
        let mut cut = Vec::new();
        for _ in 0..4 {
            let name = format!("body-{}", random.below(15));
            if !cut.contains(&name) {
                edit.cut(model.find(&name).unwrap()).unwrap();
                cut.push(name);
            }
        }
        let edited = edit.finish().unwrap();
        let (moved, faster) = change(&model, &state, &edited);
        assert!(
            moved <= 1e-13 && faster <= 1e-12,
            "seed {seed}: {moved:e}, {faster:e}"
        );
        for name in &cut {
            let body = edited.model.find(name).unwrap();
            let body = edited.model.body(body).unwrap();
            assert!(body.parent.is_none() && body.dof_range().len() == 6);
        }
        // The bodies without mass of a joint that was cut are gone with it.
        let is_left = |name: &String| edited.model.find(&format!("{name}.1")).is_some();
        assert!(!cut.iter().any(is_left));
        assert_eq!(edited.state.time, state.time);
        let mut simulation = Simulation::new(edited.model).unwrap();
        simulation.set_state(edited.state).unwrap();
        simulation.step(1e-4).unwrap();
    }
}

/// Poses stay; the joint takes what it does not allow of the velocity, of the body and what it carries.
#[test]
fn bodies_are_welded_and_attached_where_they_are() {
    let joints = [
        Joint::revolute(DVec3::Y),
        Joint::prismatic(DVec3::X),
        Joint::screw(DVec3::Z, 0.2),
        Joint::spherical(),
        Joint::fixed(),
        Joint::free(),
    ];
    for (seed, joint) in (0..18).zip(joints.iter().cycle()) {
        let model = generate::random_mechanism(9, false, seed).unwrap();
        let state = State::random(&model, seed);
        let id = |index: usize| model.find(&format!("body-{index}")).unwrap();
        let mut edit = model.edit(&state).unwrap();
        edit.weld(id(3)).unwrap();
        let joint = joint
            .clone()
            .on_child(Pose::from_translation(DVec3::new(0.1, 0.2, 0.3)));
        let is_free = joint.kind.dof_count() == 6;
        edit.reattach(id(8), Some(id(1)), joint).unwrap();
        let edited = edit.finish().unwrap();
        let (moved, _) = change(&model, &state, &edited);
        assert!(moved <= 1e-13, "seed {seed}: {moved:e}");
        // Of a free joint all is kept.
        let mut alone = model.edit(&state).unwrap();
        alone.reattach(id(8), Some(id(1)), Joint::free()).unwrap();
        let (moved, faster) = change(&model, &state, &alone.finish().unwrap());
        assert!(
            moved <= 1e-13 && faster <= 1e-12,
            "{is_free}: {moved:e}, {faster:e}"
        );
    }
}

#[test]
fn bodies_come_and_go_with_what_they_carry() {
    let rod = generate::Rod::default();
    let model = generate::tree(15, 2, &rod).unwrap();
    let state = State::random(&model, 1);
    let mut edit = model.edit(&state).unwrap();
    // Of a binary tree the second body carries a side of seven.
    edit.remove(BodyId(1)).unwrap();
    let again = edit.remove(BodyId(1)).unwrap_err();
    assert!(matches!(again, ModelError::NoSuchBody { .. }));
    // Cut loose, what the removed one carried stays.
    edit.cut(BodyId(4)).unwrap();
    let ball = MassProperties::sphere(0.5, 0.1);
    edit.add("ball", Some(BodyId(2)), Joint::spherical(), ball)
        .unwrap();
    let taken = edit.add("body-3", None, Joint::free(), ball).unwrap_err();
    assert!(matches!(taken, ModelError::DuplicateName { .. }));
    let edited = edit.finish().unwrap();
    assert_eq!(edited.model.bodies().len(), 15 - 7 + 3 + 1);
    assert_eq!(edited.bodies[1], None);
    assert_eq!(edited.model.find("body-4"), edited.bodies[4]);
    assert!(edited.model.find("body-9").is_some() && edited.model.find("body-7").is_none());
    let ball = edited.model.find("ball").unwrap();
    assert_eq!(edited.model.body(ball).unwrap().parent, edited.bodies[2]);
    edited.state.check(&edited.model).unwrap();
    let (moved, faster) = change(&model, &state, &edited);
    assert!(moved <= 1e-14 && faster <= 1e-13, "{moved:e} {faster:e}");
}

#[test]
fn impossible_changes_are_refused() {
    let model = generate::random_chain(5, &generate::Rod::default(), 1).unwrap();
    let state = State::neutral(&model);
    let mut edit = model.edit(&state).unwrap();
    edit.reattach(BodyId(1), Some(BodyId(3)), Joint::spherical())
        .unwrap();
    assert!(matches!(edit.finish(), Err(ModelError::Cycle { .. })));
    let mut edit = model.edit(&state).unwrap();
    edit.remove(BodyId(0)).unwrap();
    assert!(matches!(edit.finish(), Err(ModelError::Empty { .. })));
    let mut edit = model.edit(&state).unwrap();
    assert!(edit.cut(BodyId(5)).is_err());
    assert!(
        edit.reattach(BodyId(1), None, Joint::revolute(DVec3::ZERO))
            .is_err()
    );
    let mut short = state.clone();
    short.q.pop();
    assert!(model.edit(&short).is_err());
}

/// The chain that its own tip is attached to: order is made anew where parents came later.
#[test]
fn a_chain_turned_round_is_the_same_chain() {
    let model = generate::random_chain(6, &generate::Rod::default(), 4).unwrap();
    let state = State::random(&model, 2);
    let mut edit = model.edit(&state).unwrap();
    edit.cut(BodyId(3)).unwrap();
    let mut halves = edit.finish().unwrap();
    let mut edit = halves.model.edit(&halves.state).unwrap();
    let root = halves.bodies[0].unwrap();
    edit.reattach(root, halves.bodies[5], Joint::free())
        .unwrap();
    let turned = edit.finish().unwrap();
    let (moved, faster) = change(&halves.model, &halves.state, &turned);
    assert!(moved <= 1e-13 && faster <= 1e-12, "{moved:e} {faster:e}");
    assert!(turned.bodies[0].unwrap() > turned.bodies[5].unwrap());
    halves.bodies.clear();
}

/// Three bodies adrift on two hinges, turning against each other.
fn adrift() -> (Model, State) {
    let at = Pose::from_translation(DVec3::new(0.3, 0.1, 0.0));
    let model = ModelDescription::new("adrift")
        .gravity(DVec3::ZERO)
        .body(
            "a",
            None,
            Joint::free(),
            MassProperties::cuboid(2.0, DVec3::new(0.4, 0.2, 0.1)),
        )
        .body(
            "b",
            Some("a"),
            Joint::revolute(DVec3::Y).at(at),
            MassProperties::rod(1.0, 0.5, 0.05),
        )
        .body(
            "c",
            Some("b"),
            Joint::revolute(DVec3::X).at(at),
            MassProperties::rod(0.7, 0.4, 0.05),
        )
        .build()
        .unwrap();
    let state = State::random(&model, 3);
    (model, state)
}

fn sums(model: &Model, state: &State) -> Mechanics {
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    simulation.mechanics().unwrap()
}

fn welded(model: &Model, state: &State) -> (Model, State) {
    let mut edit = model.edit(state).unwrap();
    edit.weld(model.find("c").unwrap()).unwrap();
    let edited = edit.finish().unwrap();
    (edited.model, edited.state)
}

/// A stiff motor that wants no motion takes a joint's rate out by an impact within one short step, and what is
/// welded then loses nothing; without it the rate is gone, and with it momentum.
#[test]
fn a_joint_that_is_stopped_first_is_welded_without_loss_of_momentum() {
    let (model, state) = adrift();
    let before = sums(&model, &state);
    let size = before.angular_momentum.length();
    let (plain, after) = welded(&model, &state);
    assert!(
        (sums(&plain, &after).angular_momentum - before.angular_momentum).length() > 1e-3 * size
    );

    // The step is so short that what it does not keep to rounding, the motion, is nothing.
    let (h, gain) = (1e-9, 1e15);
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let joint = model.find("c").unwrap();
    simulation
        .set_motor(joint, Motor::velocity(0.0, gain))
        .unwrap();
    simulation.step(h).unwrap();
    let stopped = simulation.state().unwrap().clone();
    let rate = |state: &State| state.qd[model.body(joint).unwrap().dof_start].abs();
    assert!(rate(&stopped) <= 1e-5 * rate(&state));
    let (model, state) = welded(&model, &stopped);
    let found = sums(&model, &state);
    assert!((found.angular_momentum - before.angular_momentum).length() <= 1e-5 * size);
    let speed = before.linear_momentum.length();
    assert!((found.linear_momentum - before.linear_momentum).length() <= 1e-5 * speed);
    // An impact loses energy.
    assert!(found.kinetic_energy < before.kinetic_energy);
}

/// Edits keep count of what they change: the model is the one that its description makes, whatever was done.
#[test]
fn an_edited_model_is_the_one_its_description_makes() {
    let mut random = Random::new(9);
    for seed in 0..40 {
        let options = generate::RandomTree::mixed(30);
        let mut model = generate::random_tree(&options, seed).unwrap();
        let mut state = State::random(&model, seed);
        for round in 0..4 {
            let mut edit = model.edit(&state).unwrap();
            let pick = |random: &mut Random| {
                BodyId(u32::try_from(random.below(model.bodies().len())).unwrap())
            };
            // What cannot be done leaves the edit as it was.
            let _ = edit.weld(pick(&mut random));
            let _ = edit.cut(pick(&mut random));
            let heavy =
                MassProperties::sphere(1e3 * random.unit() + 1e-3, 10.0 * random.unit() + 0.1);
            edit.add(format!("new {round}"), None, Joint::free(), heavy)
                .unwrap();
            let gone = pick(&mut random);
            let _ = if gone.0 > 0 {
                edit.remove(gone)
            } else {
                Ok(())
            };
            let Ok(edited) = edit.finish() else { continue };
            (model, state) = (edited.model, edited.state);
            let built = model.describe().build().unwrap();
            assert_eq!(model.units(), built.units());
            assert_eq!(
                (model.depth(), model.dof_count()),
                (built.depth(), built.dof_count())
            );
            assert_eq!(model.describe(), built.describe());
            assert_eq!(state.check(&built), Ok(()));
        }
    }
}

/// A body whose mass hangs from it cannot do without.
#[test]
fn what_an_edit_leaves_without_mass_is_refused() {
    let model = ModelDescription::new("hollow")
        .body(
            "shell",
            None,
            Joint::revolute(DVec3::X),
            MassProperties::MASSLESS,
        )
        .body(
            "core",
            Some("shell"),
            Joint::revolute(DVec3::Y),
            MassProperties::sphere(1.0, 0.1),
        )
        .body(
            "tail",
            Some("core"),
            Joint::revolute(DVec3::X),
            MassProperties::sphere(1.0, 0.1),
        )
        .build()
        .unwrap();
    let state = State::neutral(&model);
    let mut edit = model.edit(&state).unwrap();
    edit.add(
        "spike",
        model.find("tail"),
        Joint::revolute(DVec3::Z),
        MassProperties::MASSLESS,
    )
    .unwrap();
    let refused = edit.finish().map(|edited| edited.model.depth());
    assert!(matches!(refused, Err(ModelError::MasslessBody { body, .. }) if body == "spike"));
    // Taken away, the core takes with it the shell that carries nothing else; welded to it, it stays.
    let mut edit = model.edit(&state).unwrap();
    edit.weld(model.find("core").unwrap()).unwrap();
    assert_eq!(edit.finish().unwrap().model.dof_count(), 2);
}

/// Two chains that fall apart are tied together, swing, and are let go of again.
#[test]
fn loops_are_closed_and_opened_while_bodies_move() {
    let model = ModelDescription::new("two");
    let rod = MassProperties::rod(1.0, 0.5, 0.02);
    let below = Pose::from_translation(DVec3::new(0.0, 0.0, -0.5));
    let hang = |joint: Joint| joint.on_child(below.inverse());
    let aside = Pose::from_translation(DVec3::new(0.6, 0.0, 0.0));
    let model = model
        .body("a", None, hang(Joint::spherical()), rod)
        .body("b", Some("a"), hang(Joint::revolute(DVec3::X)), rod)
        .body("c", None, hang(Joint::spherical().at(aside)), rod)
        .body("d", Some("c"), hang(Joint::revolute(DVec3::Y)), rod)
        .build()
        .unwrap();
    let mut simulation = Simulation::new(model.clone()).unwrap();
    let mut state = State::neutral(&model);
    state.qd.copy_from_slice(&State::random(&model, 2).qd);
    simulation.set_state(state).unwrap();
    for _ in 0..50 {
        simulation.step(1e-3).unwrap();
    }
    let id = |name: &str| model.find(name).unwrap();
    let at = simulation.pose(id("b")).unwrap();
    let state = simulation.state().unwrap().clone();
    let mut edit = model.edit(&state).unwrap();
    let ends = [Some(id("b")), Some(id("d"))];
    edit.close_at("tether", ends, at, Closure::Ball).unwrap();
    let refused = edit
        .close_at("tether", ends, at, Closure::Ball)
        .unwrap_err();
    assert!(matches!(refused, ModelError::DuplicateName { name } if name == "tether"));
    let same = edit.close("own", [Some(id("a")); 2], [at; 2], Closure::Weld);
    assert!(matches!(same, Err(ModelError::SelfLoop { .. })));
    edit.couple("gear", [id("d"), id("b")], 1.0, 0.0).unwrap();
    let ball = edit
        .couple("ball", [id("a"), id("b")], 1.0, 0.0)
        .unwrap_err();
    assert!(ball.to_string().contains("3 freedoms"), "{ball}");
    edit.uncouple("gear").unwrap();
    assert!(matches!(
        edit.open("no knot"),
        Err(ModelError::NoSuchLoop { .. })
    ));
    let tied = edit.finish().unwrap();
    assert_eq!(tied.state, state);

    let mut simulation = Simulation::new(tied.model.clone()).unwrap();
    simulation.set_state(tied.state).unwrap();
    let gap = |simulation: &mut Simulation| {
        let [b, d] = ["b", "d"].map(|name| simulation.pose(id(name)).unwrap());
        let held = simulation.model().loops()[0].placements;
        (b.transform_point(held[0].translation) - d.transform_point(held[1].translation)).length()
    };
    assert!(gap(&mut simulation) <= 1e-14);
    for _ in 0..200 {
        simulation.step(1e-3).unwrap();
        assert!(gap(&mut simulation) <= 1e-10);
    }
    let state = simulation.state().unwrap().clone();
    let mut edit = tied.model.edit(&state).unwrap();
    edit.open("tether").unwrap();
    let free = edit.finish().unwrap();
    assert_eq!(
        (free.model.describe(), &free.state),
        (model.describe(), &state)
    );
    // What mimics another joint does so no more.
    let mut description = model.describe();
    description.bodies[3].joint.mimic = Some(Mimic {
        body: "b".to_owned(),
        multiplier: 1.0,
        offset: 0.0,
    });
    let following = description.build().unwrap();
    let mut edit = following.edit(&state).unwrap();
    edit.uncouple("d").unwrap();
    assert!(matches!(
        edit.uncouple("d"),
        Err(ModelError::NoSuchLoop { .. })
    ));
    assert_eq!(edit.finish().unwrap().model.describe(), model.describe());
}

/// Whatever a body is carried by is welded as a whole, and nothing else; what carries something of its own is a body.
#[test]
fn compound_joints_are_welded_whole() {
    let rod = MassProperties::rod(1.0, 0.5, 0.05);
    let step = Pose::from_translation(DVec3::new(0.0, 0.1, 0.5));
    let row = [
        Joint::screw(DVec3::Z, 0.1),
        Joint::spherical(),
        Joint::revolute(DVec3::X).through(DVec3::new(0.0, 0.2, 0.1)),
    ];
    for joint in [
        Joint::universal(DVec3::X, DVec3::Y),
        Joint::cylindrical(DVec3::new(1.0, 2.0, 3.0)),
        Joint::planar(DVec3::X, DVec3::Z),
        Compound::new(row).on_child(step),
        Joint::revolute(DVec3::X).into(),
    ] {
        let chain = Builder::new("chain").chain("l", 3, joint, rod, step);
        let model = chain.build().unwrap().model;
        let state = State::random(&model, 3);
        let mut edit = model.edit(&state).unwrap();
        edit.weld(model.find("l-1").unwrap()).unwrap();
        let edited = edit.finish().unwrap();
        assert_eq!(3 * edited.model.dof_count(), 2 * model.dof_count());
        let (moved, _) = change(&model, &state, &edited);
        assert!(moved <= 1e-14, "{moved:e}");
        // The joints on either side keep their bits.
        for body in ["l-0", "l-2"] {
            let of = |model: &Model, state: &State| {
                let body = &model.bodies()[model.find(body).unwrap().index()];
                state.q[body.position_range()].to_vec()
            };
            assert_eq!(of(&edited.model, &edited.state), of(&model, &state));
        }
        // In the same edit it is cut loose again, and no body without mass is left of the joint.
        let mut edit = model.edit(&state).unwrap();
        edit.weld(model.find("l-1").unwrap()).unwrap();
        edit.cut(model.find("l-1").unwrap()).unwrap();
        let edited = edit.finish().unwrap();
        assert_eq!(3 * (edited.model.dof_count() - 6), 2 * model.dof_count());
        assert!(edited.model.find("l-1.1").is_none());
    }
}

/// A rope added link by link in one edit is the rope that its description makes, at rest against what carries it.
#[test]
fn what_an_edit_adds_can_carry_more() {
    let (model, state) = adrift();
    let step = Pose::from_translation(DVec3::new(0.0, 0.0, 0.1));
    let shape = || BodyShape::capsule(0.01, 0.08).placed(&step);
    let joint = |index: usize| -> Compound {
        match index % 3 {
            0 => Joint::spherical().at(step).into(),
            1 => Joint::universal(DVec3::X, DVec3::Y).at(step),
            _ => Joint::revolute(DVec3::Y).with_damping(1e-3).at(step).into(),
        }
    };
    let mut edit = model.edit(&state).unwrap();
    let mut ids = vec![model.find("c").unwrap()];
    let mut written = model.describe();
    for index in 0..9 {
        let (name, below) = (format!("r-{index}"), ids[index]);
        ids.push(edit.add(&name, Some(below), joint(index), shape()).unwrap());
        let parent = match index {
            0 => "c".to_owned(),
            _ => format!("r-{}", index - 1),
        };
        let mass = shape().mass_properties().unwrap();
        written = written.body(name, Some(&parent), joint(index), mass);
    }
    // What is refused leaves the edit as it was, a compound joint's names included.
    let mut refused = |name: &str, parent: u32, joint: Compound, shape: BodyShape| {
        edit.add(name, Some(BodyId(parent)), joint, shape)
            .unwrap_err()
    };
    let hinge = || Compound::from(Joint::revolute(DVec3::X));
    assert!(matches!(
        refused("x", 99, hinge(), shape()),
        ModelError::NoSuchBody { body: 99, .. }
    ));
    assert!(matches!(
        refused("r-4", 0, hinge(), shape()),
        ModelError::DuplicateName { .. }
    ));
    assert!(matches!(
        refused("r-4.1", 0, hinge(), shape()),
        ModelError::DuplicateName { .. }
    ));
    assert!(matches!(
        refused("", 0, hinge(), shape()),
        ModelError::EmptyName { .. }
    ));
    let flat = refused("x", 0, hinge(), BodyShape::sphere(-1.0));
    assert!(flat.to_string().contains("body `x`: the radius"), "{flat}");
    let bent = Compound::new([Joint::revolute(DVec3::X), Joint::revolute(DVec3::ZERO)]);
    assert!(matches!(
        refused("x", 0, bent, shape()),
        ModelError::ZeroAxis { .. }
    ));
    let whole = edit.clone().finish().unwrap();
    assert_eq!(whole.model.describe(), written.build().unwrap().describe());
    whole.state.check(&whole.model).unwrap();
    let (moved, faster) = change(&model, &state, &whole);
    assert!(moved <= 1e-14 && faster <= 1e-13, "{moved:e} {faster:e}");
    let named = |edited: &Edited, index: usize| {
        let id = edited.bodies[ids[index].index()].unwrap();
        assert_eq!(Some(id), edited.model.find(&format!("r-{}", index - 1)));
        id
    };

    // Added bodies are cut, attached elsewhere, welded, coupled, tied and removed as others are.
    edit.cut(ids[5]).unwrap();
    edit.weld(ids[2]).unwrap();
    edit.couple("gear", [ids[3], model.find("b").unwrap()], 1.0, 0.0)
        .unwrap();
    edit.reattach(ids[8], Some(ids[4]), Joint::free()).unwrap();
    edit.remove(ids[9]).unwrap();
    assert!(matches!(
        edit.weld(ids[9]),
        Err(ModelError::NoSuchBody { .. })
    ));
    let before = motions(&whole.model, &whole.state);
    let at = before[named(&whole, 4).index()].0;
    edit.close_at("knot", [Some(ids[4]), None], at, Closure::Ball)
        .unwrap();
    let edited = edit.finish().unwrap();
    let after = motions(&edited.model, &edited.state);
    for index in 1..9 {
        let (p, w, v) = before[named(&whole, index).index()];
        let (q, a, b) = after[named(&edited, index).index()];
        assert!((p.translation - q.translation).length() <= 1e-14);
        assert!((w - a).length().max((v - b).length()) <= 1e-13, "{index}");
    }
    assert_eq!(edited.bodies[ids[9].index()], None);
    let freedoms = |index: usize| {
        let body = edited.model.body(named(&edited, index)).unwrap();
        (body.dof_range().len(), body.parent.is_none())
    };
    assert_eq!([2, 5, 8].map(freedoms), [(0, false), (6, true), (6, false)]);
    assert_eq!(edited.model.couplings().count(), 1);
    let mut edit = edited.model.edit(&edited.state).unwrap();
    edit.uncouple("gear").unwrap();
    let tied = edit.finish().unwrap();
    let mut simulation = Simulation::new(tied.model).unwrap();
    simulation.set_state(tied.state).unwrap();
    assert!(simulation.loop_violation().unwrap().unwrap().position <= 1e-14);
    simulation.step(1e-4).unwrap();
}

/// What cannot be closed where both frames are at one place is refused at once, and not by the first step.
#[test]
fn closures_that_hold_frames_apart_are_not_closed_at_a_place() {
    let (model, state) = adrift();
    let mut edit = model.edit(&state).unwrap();
    let mut close = |closure| {
        let ends = [model.find("c"), None];
        edit.close_at("tether", ends, Pose::IDENTITY, closure)
    };
    let universal = |second| Closure::Universal {
        first: DVec3::X,
        second,
    };
    for closure in [Closure::Distance { length: 0.5 }, universal(DVec3::ONE)] {
        let error = close(closure).unwrap_err();
        assert!(matches!(&error, ModelError::NotThere { name } if name == "tether"));
        assert!(error.to_string().contains("Edit::close"), "{error}");
    }
    close(universal(DVec3::new(0.0, 3.0, 4.0))).unwrap();
    assert_eq!(edit.finish().unwrap().model.loops().len(), 1);
}
