//! Strands: text, chains along polylines, and everything that is refused.

use glam::DVec3;
use vertebra_assembly::{Joint, Random, State};
use vertebra_dynamics::{Precision, Workspace, forward_kinematics};
use vertebra_files::strands::{self, Strand, Strands};

const LOCKS: &str = include_str!("data/locks.strands");

#[test]
fn chains_lie_along_their_polylines() {
    let locks = strands::parse(LOCKS).unwrap();
    let names: Vec<&str> = locks
        .strands
        .iter()
        .map(|strand| strand.name.as_str())
        .collect();
    assert_eq!(names, ["fringe", "strand_2", "braid"]);
    assert_eq!(locks.strands[0].radius, 0.03 * 0.01);
    assert_eq!(locks.strands[2].radius, 0.01);
    let model = locks.build(&Joint::spherical(), None).unwrap();
    assert_eq!(model.bodies().len(), 3 + 2 + 2);
    let mut workspace = Workspace::new(&model, Precision::F64);
    forward_kinematics(&model, &State::neutral(&model), &mut workspace).unwrap();
    for strand in &locks.strands {
        for (ends, number) in strand.points.windows(2).zip(1..) {
            let id = model.find(&format!("{}.{number}", strand.name)).unwrap();
            let pose = workspace.pose(id).unwrap();
            let length = (ends[1] - ends[0]).length();
            assert!((pose.translation - ends[0]).length() < 1e-14);
            let tip = pose.transform_point(DVec3::new(0.0, 0.0, length));
            assert!((tip - ends[1]).length() < 1e-14);
        }
    }
    let mass: f64 = model.bodies().iter().map(|body| body.mass.mass).sum();
    let volume = |strand: &Strand| {
        let length: f64 = strand
            .points
            .windows(2)
            .map(|p| (p[1] - p[0]).length())
            .sum();
        std::f64::consts::PI * strand.radius * strand.radius * length * strand.density
    };
    let expected: f64 = locks.strands.iter().map(volume).sum();
    assert!((mass - expected).abs() < 1e-14 * expected);
    assert_eq!(locks.parts(&model, None).len(), 7);
    assert!(
        locks
            .parts(&model, None)
            .iter()
            .all(|part| part.body.is_some())
    );
}

#[test]
fn strands_are_cut_into_equal_links() {
    let line = vec![DVec3::ZERO, DVec3::X, DVec3::new(4.0, 0.0, 0.0)];
    let one = Strands {
        strands: vec![Strand::new("s", line, 0.01, 1.0)],
    };
    for count in [1, 2, 7, 64] {
        let model = one.build(&Joint::spherical(), Some(count)).unwrap();
        assert_eq!(model.bodies().len(), count);
        let length = 4.0 / count as f64;
        for body in &model.bodies()[1..] {
            let shift = body.joint.parent_placement.translation;
            assert!((shift - DVec3::new(0.0, 0.0, length)).length() < 1e-13);
        }
    }
}

#[test]
fn what_is_written_is_read_to_the_last_bit() {
    let mut random = Random::new(4);
    let strands = (0..20).map(|index| {
        let points = (0..5 + index).map(|_| random.direction() * 3.0).collect();
        Strand::new(
            format!("a lock {index}"),
            points,
            1e-4 * random.symmetric().abs(),
            1e3,
        )
    });
    let strands = Strands {
        strands: strands.collect(),
    };
    let mut again = strands::parse(&strands.write()).unwrap();
    for strand in &mut again.strands {
        strand.line = 0;
    }
    assert_eq!(again, strands);
}

#[test]
fn mistakes_are_named_with_line_and_element() {
    let refused = |text: &str, line: u32, words: &str| {
        let error = strands::parse(text).unwrap_err();
        assert_eq!(error.location.line, Some(line), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    };
    refused("", 1, "`strands 1`");
    refused(
        "# only\nstrands 2",
        2,
        "found `strands 2` where `strands 1`",
    );
    refused("strands 1\n0 0 0", 2, "`strand` before its points");
    refused("strands 1\nradius -1", 2, "a number above zero");
    refused("strands 1\nstrand a\n0 0 nan", 3, "three coordinates");
    refused("strands 1\nstrand a\n0 0", 3, "three coordinates");
    refused(
        "strands 1\nstrand a\n0 0 0\n",
        2,
        "strand `a`: has fewer than two points",
    );
    refused(
        "strands 1\nstrand a\n0 0 0\n0 0 0",
        2,
        "two neighbouring points",
    );
    refused(
        "strands 1\nstrand a\n0 0 0\n0 0 1\nstrand a",
        5,
        "taken already, on line 2",
    );
    let empty = Strands::default()
        .build(&Joint::spherical(), None)
        .unwrap_err();
    assert!(empty.to_string().contains("no links"), "{empty}");
}
