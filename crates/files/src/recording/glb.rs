//! Binary glTF 2.0: one JSON chunk, one chunk of numbers.

use super::Recording;
use super::tessellate::surface;
use glam::{DQuat, DVec3};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::{self, Write};
use vertebra_spatial::Pose;

/// Codes of the format.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The file as it grows.
#[derive(Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    /// Meshes by the shape they show.
    known: HashMap<String, usize>,
}

pub(super) fn write(recording: &Recording, writer: &mut impl Write) -> io::Result<()> {
    let mut builder = Builder::default();
    let bodies = recording.model.bodies();
    // Node 0 turns z up into y up; the nodes of the bodies follow, then those of their shapes.
    builder.nodes.push(Value::Null);
    let mut shapes: Vec<Vec<usize>> = vec![Vec::new(); bodies.len()];
    let mut of_world = Vec::new();
    let first = recording.frames().next();
    for (index, body) in bodies.iter().enumerate() {
        let pose = first.map_or(Pose::IDENTITY, |(_, poses)| poses[index]);
        let mut node = placed(&pose);
        node["name"] = json!(body.name);
        builder.nodes.push(node);
    }
    for part in &recording.parts {
        let mesh = builder.mesh(&part.shape);
        let mut node = placed(&part.placement);
        node["mesh"] = json!(mesh);
        let shape = builder.nodes.len();
        builder.nodes.push(node);
        match part.body.and_then(|id| shapes.get_mut(id.index())) {
            Some(shapes) => shapes.push(shape),
            None => of_world.push(shape),
        }
    }
    for (index, shapes) in shapes
        .iter()
        .enumerate()
        .filter(|(_, shapes)| !shapes.is_empty())
    {
        builder.nodes[index + 1]["children"] = json!(shapes);
    }
    let all: Vec<usize> = (1..=bodies.len()).chain(of_world).collect();
    let half = core::f64::consts::FRAC_1_SQRT_2;
    builder.nodes[0] = json!({
        "name": recording.model.name(),
        "rotation": [-half, 0.0, 0.0, half],
        "children": all,
    });

    let mut root = json!({
        "asset": {"version": "2.0", "generator": "vertebra"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
    });
    if !recording.is_empty() {
        root["animations"] = json!([builder.animation(recording)]);
    }
    root["nodes"] = Value::Array(builder.nodes);
    // Empty lists are not allowed.
    for (key, list) in [
        ("meshes", builder.meshes),
        ("accessors", builder.accessors),
        ("bufferViews", builder.views),
    ] {
        if !list.is_empty() {
            root[key] = Value::Array(list);
        }
    }
    if !builder.bytes.is_empty() {
        root["buffers"] = json!([{"byteLength": builder.bytes.len()}]);
    }
    let mut text = serde_json::to_vec(&root)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    write_chunks(&text, &builder.bytes, writer)
}

/// Header and chunks; all lengths are 32-bit numbers. All numbers are of four bytes, so that the
/// second chunk needs no padding.
fn write_chunks(text: &[u8], bytes: &[u8], writer: &mut impl Write) -> io::Result<()> {
    let size = |length: usize| {
        u32::try_from(length).map_err(|_| {
            io::Error::new(
                io::ErrorKind::InvalidInput,
                "the recording exceeds the 4 GiB of binary glTF; record fewer frames",
            )
        })
    };
    let chunks = if bytes.is_empty() { 1 } else { 2 };
    let total = size(12 + 8 * chunks + text.len() + bytes.len())?;
    writer.write_all(b"glTF")?;
    writer.write_all(&2_u32.to_le_bytes())?;
    writer.write_all(&total.to_le_bytes())?;
    for (chunk, kind) in [(text, b"JSON"), (bytes, b"BIN\0")]
        .into_iter()
        .take(chunks)
    {
        writer.write_all(&size(chunk.len())?.to_le_bytes())?;
        writer.write_all(kind)?;
        writer.write_all(chunk)?;
    }
    Ok(())
}

impl Builder {
    /// Numbers in a view of their own: the accessor's index.
    fn accessor(
        &mut self,
        words: impl Iterator<Item = [u8; 4]>,
        target: Option<u32>,
        mut accessor: Value,
    ) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(words.flatten());
        let mut view = json!({
            "buffer": 0,
            "byteOffset": start,
            "byteLength": self.bytes.len() - start,
        });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        accessor["bufferView"] = json!(self.views.len());
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn mesh(&mut self, shape: &crate::Shape) -> usize {
        let key = format!("{shape:?}");
        if let Some(&mesh) = self.known.get(&key) {
            return mesh;
        }
        let surface = surface(shape);
        let count = surface.positions.len();
        let smallest = surface
            .positions
            .iter()
            .fold(DVec3::INFINITY, |low, &p| low.min(p));
        let largest = surface
            .positions
            .iter()
            .fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
        let vectors = |list: &[DVec3]| -> Vec<[u8; 4]> {
            list.iter().flat_map(|v| v.to_array()).map(single).collect()
        };
        let position = self.accessor(
            vectors(&surface.positions).into_iter(),
            Some(VERTICES),
            json!({
                "componentType": FLOAT, "type": "VEC3", "count": count,
                "min": rounded(smallest), "max": rounded(largest),
            }),
        );
        let normal = self.accessor(
            vectors(&surface.normals).into_iter(),
            Some(VERTICES),
            json!({"componentType": FLOAT, "type": "VEC3", "count": count}),
        );
        let corners = surface
            .triangles
            .iter()
            .flatten()
            .map(|index| index.to_le_bytes());
        let indices = self.accessor(
            corners,
            Some(INDICES),
            json!({"componentType": UNSIGNED_INT, "type": "SCALAR", "count": 3 * surface.triangles.len()}),
        );
        self.meshes.push(json!({"primitives": [{
            "attributes": {"POSITION": position, "NORMAL": normal},
            "indices": indices,
        }]}));
        self.known.insert(key, self.meshes.len() - 1);
        self.meshes.len() - 1
    }

    /// Two channels a body over one list of times.
    fn animation(&mut self, recording: &Recording) -> Value {
        let times = &recording.times;
        let (first, last) = (times[0], times[times.len() - 1]);
        let input = self.accessor(
            times.iter().map(|&time| single(time)),
            None,
            json!({
                "componentType": FLOAT, "type": "SCALAR", "count": times.len(),
                "min": [f64::from(narrow(first))], "max": [f64::from(narrow(last))],
            }),
        );
        let (mut channels, mut samplers) = (Vec::new(), Vec::new());
        for index in 0..recording.model.bodies().len() {
            let poses = || recording.frames().map(move |(_, poses)| poses[index]);
            let translations = poses()
                .flat_map(|pose| pose.translation.to_array())
                .map(single);
            let translation = self.accessor(
                translations.collect::<Vec<_>>().into_iter(),
                None,
                json!({"componentType": FLOAT, "type": "VEC3", "count": times.len()}),
            );
            // Of a quaternion and its negative the one nearer to that before: viewers take the way
            // between two as it is.
            let mut before = DQuat::IDENTITY;
            let mut rotations = Vec::with_capacity(4 * times.len());
            for pose in poses() {
                let near = match pose.rotation.dot(before) < 0.0 {
                    true => -pose.rotation,
                    false => pose.rotation,
                };
                before = near;
                rotations.extend(near.normalize().to_array().map(single));
            }
            let rotation = self.accessor(
                rotations.into_iter(),
                None,
                json!({"componentType": FLOAT, "type": "VEC4", "count": times.len()}),
            );
            for (path, output) in [("translation", translation), ("rotation", rotation)] {
                channels.push(json!({
                    "sampler": samplers.len(),
                    "target": {"node": index + 1, "path": path},
                }));
                samplers.push(json!({
                    "input": input, "output": output, "interpolation": "LINEAR",
                }));
            }
        }
        json!({"channels": channels, "samplers": samplers})
    }
}

fn placed(pose: &Pose) -> Value {
    json!({
        "translation": rounded(pose.translation),
        "rotation": pose.rotation.normalize().to_array().map(|x| f64::from(narrow(x))),
    })
}

fn rounded(v: DVec3) -> [f64; 3] {
    v.to_array().map(|x| f64::from(narrow(x)))
}

#[expect(clippy::cast_possible_truncation, reason = "glTF has f32")]
const fn narrow(x: f64) -> f32 {
    x.clamp(f32::MIN as f64, f32::MAX as f64) as f32
}

fn single(x: f64) -> [u8; 4] {
    narrow(x).to_le_bytes()
}
