//! Recordings: what is written is read back, by another crate's reader of glTF too.

#![cfg(feature = "recording")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DQuat, DVec3};
use gltf::animation::Property;
use serde_json::Value;
use std::sync::Arc;
use vertebra_assembly::{Joint, Model, ModelError, Random, generate};
use vertebra_files::recording::{Recording, sticks};
use vertebra_files::{Part, Shape, TriangleSoup};
use vertebra_spatial::Pose;

fn model() -> Model {
    generate::chain(3, &Joint::spherical(), &generate::Rod::default()).unwrap()
}

fn recorded(model: &Model, parts: Vec<Part>, frames: u32) -> (Recording, Vec<Vec<Pose>>) {
    let mut random = Random::new(9);
    let mut recording = Recording::new(model, parts);
    let mut all = Vec::new();
    for frame in 0..frames {
        let mut pose = || Pose::new(random.rotation(), random.direction() * 2.0);
        let poses: Vec<Pose> = model.bodies().iter().map(|_| pose()).collect();
        recording.push(0.25 * f64::from(frame), &poses).unwrap();
        all.push(poses);
    }
    (recording, all)
}

fn every_shape(model: &Model) -> Vec<Part> {
    let tetrahedron = TriangleSoup {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let shapes = [
        Shape::Box {
            size: DVec3::new(1.0, 2.0, 3.0),
        },
        Shape::Sphere { radius: 0.5 },
        Shape::Cylinder {
            radius: 0.2,
            length: 1.0,
        },
        Shape::Capsule {
            radius: 0.2,
            length: 1.0,
        },
        Shape::Ellipsoid {
            radii: DVec3::new(0.1, 0.2, 0.3),
        },
        Shape::Mesh(Arc::new(tetrahedron)),
    ];
    let bodies = [None].into_iter().chain(model.body_ids().map(Some));
    let bodies: Vec<_> = bodies.collect();
    let parts = shapes
        .into_iter()
        .zip(bodies.iter().cycle())
        .map(|(shape, &body)| Part {
            body,
            placement: Pose::from_translation(DVec3::Z),
            shape,
        });
    parts.collect()
}

fn floats(blob: &[u8], accessor: &gltf::Accessor<'_>) -> Vec<f32> {
    let view = accessor.view().unwrap();
    let bytes = &blob[view.offset() + accessor.offset()..][..view.length()];
    let words = bytes.as_chunks::<4>().0;
    words.iter().map(|&word| f32::from_le_bytes(word)).collect()
}

#[test]
fn another_reader_finds_the_poses() {
    let model = model();
    let (recording, poses) = recorded(&model, every_shape(&model), 5);
    let mut file = Vec::new();
    recording.write_glb(&mut file).unwrap();
    // This validates references, bounds and counts.
    let read = gltf::Gltf::from_slice(&file).unwrap();
    let blob = read.blob.as_deref().unwrap();
    assert_eq!(read.meshes().len(), 6);
    let animation = read.animations().next().unwrap();
    assert_eq!(animation.channels().count(), 2 * 3);
    let names: Vec<&str> = model
        .bodies()
        .iter()
        .map(|body| body.name.as_str())
        .collect();
    for channel in animation.channels() {
        let node = channel.target().node();
        let body = names
            .iter()
            .position(|&name| Some(name) == node.name())
            .unwrap();
        let times = floats(blob, &channel.sampler().input());
        assert_eq!(times, [0.0, 0.25, 0.5, 0.75, 1.0]);
        let values = floats(blob, &channel.sampler().output());
        match channel.target().property() {
            Property::Translation => {
                for (value, frame) in values.as_chunks::<3>().0.iter().zip(&poses) {
                    let expected = frame[body].translation.as_vec3();
                    assert_eq!(*value, expected.to_array());
                }
            }
            Property::Rotation => {
                let mut before = None;
                for (value, frame) in values.as_chunks::<4>().0.iter().zip(&poses) {
                    let value = DQuat::from_array(value.map(f64::from));
                    assert!(value.dot(frame[body].rotation).abs() > 1.0 - 1e-6);
                    assert!(before.is_none_or(|before: DQuat| before.dot(value) >= 0.0));
                    before = Some(value);
                }
            }
            other => unreachable!("{other:?}"),
        }
    }
    // The root turns z up into y up.
    let root = read
        .default_scene()
        .or(read.scenes().next())
        .unwrap()
        .nodes()
        .next()
        .unwrap();
    let (_, turn, _) = root.transform().decomposed();
    let up = DQuat::from_array(turn.map(f64::from)) * DVec3::Z;
    assert!((up - DVec3::Y).length() < 1e-6);
}

/// What the format asks for and its reader passes over: accessors lie in their views and views in the buffer, on multiples of
/// four bytes and apart from each other; bounds that are stated are those of the numbers, and times rise.
#[test]
fn the_file_is_what_it_says() {
    let model = model();
    let (recording, _) = recorded(&model, every_shape(&model), 7);
    let mut file = Vec::new();
    recording.write_glb(&mut file).unwrap();
    let word = |at: usize| {
        let bytes = file[at..at + 4].try_into().unwrap();
        usize::try_from(u32::from_le_bytes(bytes)).unwrap()
    };
    assert_eq!(
        (&file[..4], word(4), word(8)),
        (&b"glTF"[..], 2, file.len())
    );
    let json_size = word(12);
    assert_eq!((&file[16..20], json_size % 4), (&b"JSON"[..], 0));
    let json: Value = serde_json::from_slice(&file[20..20 + json_size]).unwrap();
    let binary = 20 + json_size;
    assert_eq!(&file[binary + 4..binary + 8], b"BIN\0");
    let blob = &file[binary + 8..];
    assert_eq!((word(binary), blob.len() % 4), (blob.len(), 0));
    let number = |value: &Value| usize::try_from(value.as_u64().unwrap_or(0)).unwrap();
    let size = number(&json["buffers"][0]["byteLength"]);
    assert!(size <= blob.len() && blob.len() < size + 4);

    let list = |name: &str| json[name].as_array().unwrap().clone();
    let mut ends = 0;
    for view in &list("bufferViews") {
        let (start, length) = (number(&view["byteOffset"]), number(&view["byteLength"]));
        assert!(
            start >= ends && start.is_multiple_of(4) && start + length <= size,
            "{view}"
        );
        ends = start + length;
    }
    let nodes = list("nodes").len();
    let mut times = 0;
    for (index, accessor) in list("accessors").iter().enumerate() {
        let view = &list("bufferViews")[number(&accessor["bufferView"])];
        let width = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            other => unreachable!("{other}"),
        };
        let count = number(&accessor["count"]) * width;
        let start = number(&accessor["byteOffset"]);
        assert!(
            start + 4 * count <= number(&view["byteLength"]),
            "{accessor}"
        );
        let start = number(&view["byteOffset"]) + start;
        let words = blob[start..start + 4 * count].as_chunks::<4>().0;
        let is_float = number(&accessor["componentType"]) == 5126;
        let values = words.iter().map(|&word| match is_float {
            true => f64::from(f32::from_le_bytes(word)),
            false => f64::from(u32::from_le_bytes(word)),
        });
        let values: Vec<f64> = values.collect();
        assert!(values.iter().all(|x| x.is_finite()));
        for k in 0..width {
            let column = || values.iter().skip(k).step_by(width).copied();
            let bounds = [
                ("min", column().fold(f64::INFINITY, f64::min)),
                ("max", column().fold(f64::NEG_INFINITY, f64::max)),
            ];
            for (name, bound) in bounds {
                if let Some(stated) = accessor[name].as_array() {
                    let off = (stated[k].as_f64().unwrap() - bound).abs();
                    assert!(off <= 1e-7 * bound.abs(), "{name} of {accessor}");
                }
            }
        }
        let animation = &json["animations"][0];
        let samplers = animation["samplers"].as_array().unwrap();
        if samplers
            .iter()
            .any(|sampler| number(&sampler["input"]) == index)
        {
            assert!(accessor["min"].is_array() && accessor["max"].is_array());
            assert!(values.is_sorted_by(|a, b| a < b));
            times += 1;
        }
        for channel in animation["channels"].as_array().unwrap() {
            assert!(number(&channel["target"]["node"]) < nodes);
            assert!(number(&channel["sampler"]) < samplers.len());
        }
    }
    assert!(times > 0);
}

/// Surfaces are closed, face outwards, and enclose nearly what the shape does.
#[test]
fn surfaces_are_those_of_the_shapes() {
    let model = model();
    let parts = every_shape(&model);
    let (recording, _) = recorded(&model, parts.clone(), 1);
    let mut file = Vec::new();
    recording.write_glb(&mut file).unwrap();
    let read = gltf::Gltf::from_slice(&file).unwrap();
    let blob = read.blob.as_deref().unwrap();
    for (mesh, part) in read.meshes().zip(&parts) {
        let primitive = mesh.primitives().next().unwrap();
        let vectors = |semantic| {
            let numbers = floats(blob, &primitive.get(&semantic).unwrap());
            let points = numbers.as_chunks::<3>().0.iter();
            points
                .map(|p| DVec3::from_array(p.map(f64::from)))
                .collect::<Vec<_>>()
        };
        let positions = vectors(gltf::Semantic::Positions);
        let normals = vectors(gltf::Semantic::Normals);
        let indices = floats(blob, &primitive.indices().unwrap());
        let mut volume = 0.0;
        for corners in indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|index| index.to_bits() as usize);
            let [p, q, r] = [a, b, c].map(|index| positions[index]);
            volume += p.dot(q.cross(r)) / 6.0;
            let facing = (q - p)
                .cross(r - p)
                .dot(normals[a] + normals[b] + normals[c]);
            assert!(facing >= -1e-9, "{:?}", part.shape);
        }
        let expected = part.shape.mass_properties(1.0).unwrap().mass;
        assert!(
            (0.85..1.0001).contains(&(volume / expected)),
            "{:?}: {volume}",
            part.shape
        );
    }
}

#[test]
fn json_has_the_last_bit() {
    let model = model();
    let (recording, poses) = recorded(&model, sticks(&model), 4);
    let mut file = Vec::new();
    recording.write_json(&mut file).unwrap();
    let table: Value = serde_json::from_slice(&file).unwrap();
    assert_eq!(table["parents"], serde_json::json!([null, 0, 1]));
    for (frame, poses) in table["frames"].as_array().unwrap().iter().zip(&poses) {
        for (row, pose) in frame["poses"].as_array().unwrap().iter().zip(poses) {
            let row: Vec<f64> = serde_json::from_value(row.clone()).unwrap();
            assert_eq!(row[..3], pose.translation.to_array());
            assert_eq!(row[3..], pose.rotation.to_array());
        }
    }
}

#[test]
fn frames_that_are_none_are_refused() {
    let model = model();
    let mut recording = Recording::new(&model, Vec::new());
    let still = [Pose::IDENTITY; 3];
    assert!(matches!(
        recording.push(0.0, &still[1..]),
        Err(ModelError::WrongLength { .. })
    ));
    recording.push(0.0, &still).unwrap();
    assert!(matches!(
        recording.push(0.0, &still),
        Err(ModelError::BadParameter { .. })
    ));
    let mut broken = still;
    broken[1].translation.x = f64::NAN;
    assert!(recording.push(1.0, &broken).is_err());
    assert_eq!(recording.len(), 1);
    let mut file = Vec::new();
    Recording::new(&model, Vec::new())
        .write_glb(&mut file)
        .unwrap();
    assert!(gltf::Gltf::from_slice(&file).is_ok());
}

#[test]
fn files_are_told_by_their_endings() {
    let folder = tempfile::tempdir().unwrap();
    let model = model();
    let (recording, _) = recorded(&model, sticks(&model), 2);
    let [glb, json] = ["a.glb", "a.json"].map(|name| folder.path().join(name));
    recording.save(&glb).unwrap();
    recording.save(&json).unwrap();
    assert_eq!(std::fs::read(glb).unwrap()[..4], *b"glTF");
    assert_eq!(std::fs::read(json).unwrap()[0], b'{');
    let shouted = folder.path().join("A.JSON");
    recording.save(&shouted).unwrap();
    assert_eq!(std::fs::read(shouted).unwrap()[0], b'{');
    // glTF as text is another format; nothing is left where it was asked for.
    let text = folder.path().join("a.gltf");
    let error = recording.save(&text).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::InvalidInput);
    assert!(
        error.to_string().ends_with("let the name end in .glb"),
        "{error}"
    );
    assert!(!text.exists());
    let nowhere = folder.path().join("no").join("a.glb");
    let error = recording.save(&nowhere).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::NotFound);
    let path = nowhere.display().to_string();
    assert!(error.to_string().starts_with(&path), "{error}");
}
