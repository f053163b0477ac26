//! What accepted input must be, whatever was fed in. A violation panics: that is how a fuzzer sees
//! it.

use vertebra::glam::DVec3;
use vertebra::{
    Error, Forces, Joint, MassProperties, Model, ModelDescription, Precision, Query, State,
    TriangleMesh, Workspace, aba, forward_kinematics, mechanics,
};

/// Largest number of triangles whose pairs are counted.
const MOST_TRIANGLES: usize = 64;

/// A model refers to nothing outside itself, survives being written down, and moves without NaN.
pub fn model_is_sound(model: &Model) {
    assert!(!model.bodies().is_empty());
    for (id, body) in model.body_ids().zip(model.bodies()) {
        assert!(
            body.parent.is_none_or(|parent| parent < id),
            "{}",
            body.name
        );
        assert!(body.mass.mass >= 0.0 && body.mass.mass.is_finite());
        assert_eq!(body.mass.violation(), None, "{}", body.name);
        assert_eq!(model.find(&body.name), Some(id));
        assert!(body.dof_range().end <= model.dof_count());
        assert!(body.position_range().end <= model.position_count());
    }
    for frame in model.frames() {
        assert!(frame.placement.rotation.is_finite() && frame.placement.translation.is_finite());
        assert!(frame.body.is_none_or(|body| model.body(body).is_some()));
    }
    let written = model.describe();
    let again = written.clone().build();
    assert_eq!(again.map(|model| model.describe()), Ok(written));
    for state in [State::neutral(model), State::random(model, 1)] {
        assert_eq!(state.check(model), Ok(()));
        state_is_sound(model, &state);
    }
}

/// The model whose states are read: a joint of every kind that has coordinates.
pub fn every_kind() -> Model {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    ModelDescription::new("every kind")
        .body("base", None, Joint::free(), rod)
        .body("hinge", Some("base"), Joint::revolute(DVec3::X), rod)
        .body("slide", Some("hinge"), Joint::prismatic(DVec3::Y), rod)
        .body("ball", Some("slide"), Joint::spherical(), rod)
        .build()
        .expect("the model is valid")
}

/// A state that fits its model gives finite results, or an error that says why there are none.
pub fn state_is_sound(model: &Model, state: &State) {
    // A state drawn at random closes no loops: it is one of the tree.
    let mut workspace = Workspace::of_tree(model, Precision::F64);
    if let Some(qdd) = computed(aba(model, state, &Forces::none(model), &mut workspace)) {
        assert_eq!(qdd.len(), model.dof_count());
        assert!(qdd.iter().all(|x| x.is_finite()));
    }
    if let Some(sums) = computed(mechanics(model, state, &mut workspace)) {
        assert!(sums.kinetic_energy.is_finite() && sums.potential_energy.is_finite());
        assert!(sums.center.is_finite() && sums.angular_momentum.is_finite());
    }
    if computed(forward_kinematics(model, state, &mut workspace)).is_some() {
        for body in model.body_ids() {
            if let Some(pose) = computed(workspace.pose(body)) {
                assert!(pose.rotation.is_finite() && pose.translation.is_finite());
            }
            if let Some(velocity) = computed(workspace.velocity(body)) {
                assert!(velocity.angular.is_finite() && velocity.linear.is_finite());
            }
        }
    }
}

/// The result; none where the numbers do not allow one. No other error may follow upon acceptance.
fn computed<T>(result: Result<T, Error>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(Error::Overflow { .. } | Error::SingularJoint { .. }) => None,
        Err(error) => panic!("{error}"),
    }
}

/// A mesh is finite and in range, survives OBJ, and meets itself.
pub fn mesh_is_sound(mesh: &TriangleMesh) {
    assert!(mesh.vertices().iter().all(|v| v.is_finite()));
    let in_range = |&i: &u32| (i as usize) < mesh.vertices().len();
    assert!(mesh.triangles().iter().flatten().all(in_range));
    let mut file = Vec::new();
    assert!(mesh.write_obj(&mut file).is_ok());
    assert_eq!(TriangleMesh::from_obj(&file).as_ref(), Ok(mesh));
    if mesh.len() <= MOST_TRIANGLES {
        let pairs = Query::new(mesh, mesh).pairs().unwrap_or_default();
        let meets = |i, j| pairs.binary_search(&[i, j]).is_ok();
        for (i, _) in (0..).zip(mesh.triangles()) {
            assert!(meets(i, i), "triangle {i} does not meet itself");
        }
        assert!(pairs.iter().all(|&[i, j]| meets(j, i)), "not symmetric");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra::assembly::urdf;
    use vertebra::files;

    /// A seed that is refused leads the fuzzer nowhere.
    #[test]
    fn seeds_are_accepted() -> Result<(), Box<dyn std::error::Error>> {
        mesh_is_sound(&TriangleMesh::from_obj(include_bytes!(
            "../seeds/obj/fan.obj"
        ))?);
        mesh_is_sound(&TriangleMesh::from_stl(include_bytes!(
            "../seeds/stl/text.stl"
        ))?);
        mesh_is_sound(&TriangleMesh::from_stl(include_bytes!(
            "../seeds/stl/binary.stl"
        ))?);
        for ply in [
            &include_bytes!("../seeds/ply/text.ply")[..],
            include_bytes!("../seeds/ply/little.ply"),
            include_bytes!("../seeds/ply/big.ply"),
        ] {
            mesh_is_sound(&TriangleMesh::from_ply(ply)?);
        }
        mesh_is_sound(&TriangleMesh::from_off(include_bytes!(
            "../seeds/off/square.off"
        ))?);
        let robot = urdf::parse(include_str!("../seeds/urdf/arm.urdf"), &Default::default())?;
        model_is_sound(&robot.model);
        for robot in [
            include_str!("../seeds/mjcf/mechanism.xml"),
            include_str!("../seeds/mjcf/linkage.xml"),
        ] {
            model_is_sound(&files::mjcf::parse(robot, &Default::default())?.model);
        }
        model_is_sound(&files::sdf::parse(include_str!("../seeds/sdf/rover.sdf"))?.model);
        let peptide = include_str!("../seeds/pdb/peptide.pdb");
        model_is_sound(&files::pdb::parse_pdb(peptide, &Default::default())?.model);
        let peptide = include_str!("../seeds/mmcif/peptide.cif");
        model_is_sound(&files::pdb::parse_mmcif(peptide, &Default::default())?.model);
        let walk = include_str!("../seeds/bvh/walk.bvh");
        model_is_sound(&files::bvh::parse(walk, &Default::default())?.model);
        let locks = files::strands::parse(include_str!("../seeds/strands/locks.strands"))?;
        model_is_sound(&locks.build(&Joint::spherical(), None)?);
        model_is_sound(&serde_json::from_str(include_str!(
            "../seeds/model_json/arm.json"
        ))?);
        let state = serde_json::from_str(include_str!("../seeds/state_json/state.json"))?;
        state_is_sound(&every_kind(), &state);
        Ok(())
    }
}
