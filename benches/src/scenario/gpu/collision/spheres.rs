//! Two spheres that cross in a ring, the second written on the device.

use super::super::Meter;
use super::{Measured, note, timed, timed_on_device};
use crate::row::Row;
use crate::scenario::{Measurement, Selection, tableware};
use crate::suite::gold_meshes::wrong_pairs;
use std::sync::OnceLock;
use vertebra::collision::gpu::{Collider, Query};
use vertebra::glam::Vec3;
use vertebra::{Culling, TriangleMesh};
use vertebra_gpu::wgpu::DeviceType;
use vertebra_gpu::{Binding, Device, Kernel, Program, Recording, Slot, workgroups};

/// Steps around and down the spheres: 1e3 to 1e7 triangles of both.
const STEPS: [(usize, usize); 5] = [(23, 12), (71, 36), (224, 113), (708, 354), (2236, 1119)];

/// Triangles of both spheres that a processor is asked about at most.
const SOFTWARE_LIMIT: usize = 20_000;

/// Triangles of both spheres that are held against each other without a tree at most.
const ALL_PAIRS_LIMIT: usize = 1_100_000;

/// Where the second sphere stands, 1.5 radii away and along no axis \[m].
const ASIDE: Vec3 = Vec3::new(0.37, 0.61, 1.32);

/// How a row is measured, with this culling.
type Run = fn(&Subject, &Device, &Meter, Culling) -> anyhow::Result<Measured>;

const ROWS: [(&str, Culling, Run); 5] = [
    ("collision-refit-pairs", Culling::Auto, refitted),
    ("collision-spheres", Culling::Auto, on_device),
    ("collision-spheres-tree", Culling::Bvh, on_device),
    ("collision-spheres-all", Culling::AllPairs, on_device),
    ("collision-build", Culling::Auto, build),
];

/// Spheres of one size.
pub(in super::super) struct Subject {
    steps: (usize, usize),
    /// The pairs that the CPU finds, once a row needs them.
    exact: OnceLock<Vec<[u32; 2]>>,
}

/// The sizes.
pub(in super::super) fn subjects() -> Vec<Subject> {
    let subject = |steps| Subject {
        steps,
        exact: OnceLock::new(),
    };
    STEPS.into_iter().map(subject).collect()
}

/// The rows that are asked for.
pub(super) fn measurements<'a>(
    device: &'a Device,
    subjects: &'a [Subject],
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let software = device.info().device_type == DeviceType::Cpu;
    let mut list = Vec::new();
    for subject in subjects {
        let triangles = subject.triangles();
        for (name, culling, run) in ROWS {
            let slow = culling == Culling::AllPairs && triangles > ALL_PAIRS_LIMIT;
            if selection.wants(name) && !slow && !(software && triangles > SOFTWARE_LIMIT) {
                let label = format!("gpu crossing spheres of {triangles}: {name}");
                list.push(Measurement::new(label, move |meter| {
                    subject.measure(device, meter, (name, culling, run))
                }));
            }
        }
    }
    list
}

impl Subject {
    /// Triangles of both spheres.
    fn triangles(&self) -> usize {
        let (around, down) = self.steps;
        4 * around * (down - 1)
    }

    fn measure(
        &self,
        device: &Device,
        meter: &Meter,
        (name, culling, run): (&str, Culling, Run),
    ) -> anyhow::Result<Option<Row>> {
        let measured = run(self, device, meter, culling)?;
        let size = (self.triangles() as u64, "triangles");
        Ok(measured.row(device, ("crossing spheres", name), size))
    }

    /// The pairs that the CPU finds.
    fn exact(&self, sphere: &TriangleMesh) -> anyhow::Result<&[[u32; 2]]> {
        if let Some(exact) = self.exact.get() {
            return Ok(exact);
        }
        let moved = sphere.vertices().iter().map(|v| *v + ASIDE).collect();
        let moved = TriangleMesh::new(moved, sphere.triangles().to_vec())?;
        let pairs = vertebra::Query::new(sphere, &moved).threads(0).pairs()?;
        Ok(self.exact.get_or_init(|| pairs))
    }

    /// Both on the device, with how many pairs they have and how many of these are wrong.
    fn judged(
        &self,
        device: &Device,
        culling: Culling,
    ) -> anyhow::Result<(Spheres, u64, (u64, u64))> {
        let mut spheres = Spheres::new(device, self.steps, culling)?;
        spheres.write(ASIDE)?;
        let found = spheres.query.pairs()?;
        let wrong = wrong_pairs(&found, self.exact(spheres.a.mesh())?);
        Ok((spheres, found.len() as u64, wrong))
    }
}

/// Positions written on the device, boxes fitted, the sorted list on the host.
fn refitted(
    subject: &Subject,
    device: &Device,
    meter: &Meter,
    culling: Culling,
) -> anyhow::Result<Measured> {
    let (mut spheres, hits, wrong) = subject.judged(device, culling)?;
    let statistics = note(&spheres.query.statistics()?);
    let standing = timed(meter, || Ok(spheres.query.pairs()?))?;
    let standing = standing.map_or(f64::NAN, |timing| timing.median_s);
    let mut step = 0;
    let timing = timed(meter, || {
        step += 1;
        spheres.write(ASIDE * (1.0 + 1e-3 * (step % 16) as f32))?;
        Ok(spheres.query.pairs()?)
    })?;
    Ok(Measured {
        timing,
        hits,
        wrong,
        note: format!("{statistics}; {:.1} us where nothing moves", 1e6 * standing),
    })
}

/// The search alone.
fn on_device(
    subject: &Subject,
    device: &Device,
    meter: &Meter,
    culling: Culling,
) -> anyhow::Result<Measured> {
    let (spheres, hits, wrong) = subject.judged(device, culling)?;
    Ok(Measured {
        timing: timed_on_device(meter, &spheres.query)?,
        hits,
        wrong,
        note: note(&spheres.query.statistics()?),
    })
}

/// The tree of one sphere built again on the device.
fn build(
    subject: &Subject,
    device: &Device,
    meter: &Meter,
    culling: Culling,
) -> anyhow::Result<Measured> {
    let (mut spheres, hits, wrong) = subject.judged(device, culling)?;
    Ok(Measured {
        timing: timed(meter, || Ok(spheres.a.rebuild()?))?,
        hits,
        wrong,
        note: "one of the two, with allocating what sorting needs".to_owned(),
    })
}

/// Writes the vertices of the second sphere: the first, moved.
const SHIFT: Kernel = Kernel::new(
    "shift",
    &["
    struct Shift { by: vec3<f32>, count: u32 }
    @group(0) @binding(0) var<uniform> shift: Shift;
    @group(0) @binding(1) var<storage, read> base: array<f32>;
    @group(0) @binding(2) var<storage, read_write> moved: array<f32>;
    @compute @workgroup_size(256)
    fn main(
        @builtin(local_invocation_index) lane: u32,
        @builtin(workgroup_id) group: vec3<u32>,
        @builtin(num_workgroups) groups: vec3<u32>,
    ) {
        let i = (group.y * groups.x + group.x) * 256u + lane;
        if i < shift.count {
            moved[3u * i] = base[3u * i] + shift.by.x;
            moved[3u * i + 1u] = base[3u * i + 1u] + shift.by.y;
            moved[3u * i + 2u] = base[3u * i + 2u] + shift.by.z;
        }
    }"],
    &[
        Binding::uniform::<[u32; 4]>("shift"),
        Binding::read::<f32>("base"),
        Binding::read_write::<f32>("moved"),
    ],
    [256, 1, 1],
);

/// Two spheres on the device.
struct Spheres {
    a: Collider,
    b: Collider,
    query: Query,
    shift: Program,
    by: Slot<[u32; 4]>,
    vertices: u32,
}

impl Spheres {
    fn new(
        device: &Device,
        (around, down): (usize, usize),
        culling: Culling,
    ) -> anyhow::Result<Self> {
        let sphere = tableware::uv_sphere(around, down)?;
        let vertices = u32::try_from(sphere.vertices().len())?;
        let a = Collider::new(device, sphere.clone())?;
        let b = Collider::new(device, sphere)?;
        let query = Query::new(&a, &b)?.culling(culling);
        let mut recording = Recording::new("shift");
        let by = recording.buffer::<[u32; 4]>("by", 1);
        let base = recording.shared::<f32>("base", a.vertices().len());
        let moved = recording.shared::<f32>("moved", b.vertices().len());
        let list = [by.any(), base.any(), moved.any()];
        recording.dispatch(&SHIFT, &list, workgroups(vertices, 256));
        let shared = [base.is(a.vertices()), moved.is(b.vertices())];
        let shift = device.prepare_with(&recording, &shared)?;
        Ok(Self {
            a,
            b,
            query,
            shift,
            by,
            vertices,
        })
    }

    /// Writes the second sphere's vertices on the device, and fits its boxes.
    fn write(&mut self, by: Vec3) -> anyhow::Result<()> {
        let [x, y, z] = by.to_array().map(f32::to_bits);
        self.shift.write(self.by, &[[x, y, z, self.vertices]])?;
        drop(self.shift.run()?);
        Ok(self.b.refit()?)
    }
}
