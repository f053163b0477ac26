//! Triangle collision on the device: the source's pairs of meshes, and spheres that cross in a ring.

mod together;

use super::{Meter, sample};
use crate::measure::Timing;
use crate::row::Row;
use crate::scenario::{Measurement, Selection, meshes, tableware};
use crate::suite::gold_meshes::wrong_pairs;
use anyhow::Context;
use std::time::Instant;
use vertebra::collision::gpu::{Collider, Query, Statistics};
use vertebra::glam::{DQuat, DVec3, Vec3};
use vertebra::{Culling, Method, Pose, TriangleMesh};
use vertebra_gpu::wgpu::{DeviceType, Features};
use vertebra_gpu::{Binding, Device, Kernel, Recording, workgroups};

/// How a row is asked.
type Run = fn(&Device, &Meter, &meshes::Subject, &str, Culling) -> anyhow::Result<Option<Row>>;

/// How a row about spheres is asked, of so many steps around and down.
type SpheresRun = fn(&Device, &Meter, (usize, usize)) -> anyhow::Result<Option<Row>>;

/// The rows over the source's meshes.
const ROWS: [(&str, Culling, Run); 11] = [
    ("collision-pairs", Culling::Auto, pairs),
    ("collision-pairs-all", Culling::AllPairs, pairs),
    ("collision-pairs-tree", Culling::Bvh, pairs),
    ("collision-pairs-moving", Culling::Auto, moving),
    ("collision-pairs-upload", Culling::Auto, upload),
    ("collision-count", Culling::Auto, count),
    ("collision-any", Culling::Auto, any),
    ("collision-mask", Culling::Auto, mask),
    ("collision-device-all", Culling::AllPairs, on_device),
    ("collision-device-tree", Culling::Bvh, on_device),
    ("collision-moller", Culling::AllPairs, moller),
];

/// Steps around and down the spheres: 1e3 to 1e7 triangles of both.
const STEPS: [(usize, usize); 5] = [(23, 12), (71, 36), (224, 113), (708, 354), (2236, 1119)];

/// Triangles of both spheres that a processor is asked about at most, and a device in a quick run.
const SOFTWARE_LIMIT: usize = 20_000;
const QUICK_LIMIT: usize = 2_500_000;

/// Triangles of both spheres that are held against each other without a tree at most.
const ALL_PAIRS_LIMIT: usize = 1_100_000;

/// Where the second sphere stands, 1.5 radii away and along no axis \[m].
const ASIDE: Vec3 = Vec3::new(0.37, 0.61, 1.32);

/// The rows that are asked for.
pub(super) fn measurements<'a>(
    device: &'a Device,
    subjects: &'a [meshes::Subject],
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let mut list = Vec::new();
    let software = device.info().device_type == DeviceType::Cpu;
    for subject in subjects {
        for (name, culling, run) in ROWS {
            if selection.wants(name) {
                let label = format!("gpu {}: {name}", subject.scenario);
                list.push(Measurement::new(label, move |meter| {
                    run(device, meter, subject, name, culling)
                }));
            }
        }
    }
    let kinds: [(&str, SpheresRun); 4] = [
        ("collision-refit-pairs", refitted),
        ("collision-spheres-tree", |device, meter, steps| {
            spheres_on_device(
                device,
                meter,
                steps,
                ("collision-spheres-tree", Culling::Bvh),
            )
        }),
        ("collision-spheres-all", |device, meter, steps| {
            spheres_on_device(
                device,
                meter,
                steps,
                ("collision-spheres-all", Culling::AllPairs),
            )
        }),
        ("collision-build", build),
    ];
    for (around, down) in STEPS {
        let triangles = 4 * around * (down - 1);
        let most = match (software, selection.quick) {
            (true, _) => SOFTWARE_LIMIT,
            (false, true) => QUICK_LIMIT,
            (false, false) => usize::MAX,
        };
        for (name, run) in kinds {
            let slow = name == "collision-spheres-all" && triangles > ALL_PAIRS_LIMIT;
            if selection.wants(name) && triangles <= most && !slow {
                let label = format!("gpu crossing spheres of {triangles}: {name}");
                list.push(Measurement::new(label, move |meter| {
                    run(device, meter, (around, down))
                }));
            }
        }
    }
    for (name, run) in together::ROWS {
        if selection.wants(name) {
            list.push(Measurement::new(format!("gpu {name}"), move |meter| {
                run(device, meter, software)
            }));
        }
    }
    list
}

/// Both meshes on the device.
fn query(
    device: &Device,
    subject: &meshes::Subject,
    culling: Culling,
) -> anyhow::Result<([Collider; 2], Query)> {
    let a = Collider::new(device, subject.a.clone())?;
    let b = Collider::new(device, subject.b.clone())?;
    let query = Query::new(&a, &b)?.culling(culling);
    Ok(([a, b], query))
}

/// A row that is timed by the clock on the wall.
fn timed<T>(
    meter: &Meter,
    mut call: impl FnMut() -> anyhow::Result<T>,
) -> anyhow::Result<Option<Timing>> {
    sample(meter, || {
        let start = Instant::now();
        call()?;
        Ok(start.elapsed().as_secs_f64())
    })
}

fn row(
    device: &Device,
    (scenario, method): (&str, &str),
    size: (u64, &str),
    timing: Option<Timing>,
    (hits, wrong): (u64, (u64, u64)),
    note: String,
) -> Option<Row> {
    timing.map(|timing| Row {
        backend: "gpu".to_owned(),
        device: device.description(),
        hits: Some(hits),
        false_pairs: Some(wrong.0),
        missed_pairs: Some(wrong.1),
        note,
        ..Row::new(scenario, method, "f32", size.0, size.1, &timing)
    })
}

fn note(statistics: &Statistics) -> String {
    let time = statistics.gpu_time.map_or_else(String::new, |time| {
        format!("; {:.1} us on the device", 1e6 * time)
    });
    format!(
        "{} pairs of blocks, {} pairs of triangles undecided{time}",
        statistics.block_pairs, statistics.undecided
    )
}

/// Meshes on the device, where they stand; the sorted list on the host.
fn pairs(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    let (_meshes, query) = query(device, subject, culling)?;
    let found = query.pairs()?;
    let wrong = wrong_pairs(&found, subject.reference()?);
    let note = note(&query.statistics()?);
    let timing = timed(meter, || Ok(query.pairs()?))?;
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    Ok(row(
        device,
        names,
        size,
        timing,
        (found.len() as u64, wrong),
        note,
    ))
}

/// Meshes on the device, of which B moves from call to call; the sorted list on the host.
fn moving(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    let (_meshes, query) = query(device, subject, culling)?;
    let pose = |step: u32| {
        let angle = 1e-3 * f64::from(step % 64);
        let rotation = DQuat::from_rotation_y(angle);
        Pose::new(rotation, DVec3::new(angle, -angle, 0.5 * angle))
    };
    let mut query = Some(query);
    let mut wrong = (0, 0);
    let mut undecided = 0;
    let mut hits = 0;
    for step in [1, 17, 40] {
        let asked = query
            .take()
            .context("it is put back below")?
            .pose_b(pose(step))?;
        let exact = vertebra::Query::new(&subject.a, &subject.b).pose_b(pose(step))?;
        let found = asked.pairs()?;
        let (too_many, too_few) = wrong_pairs(&found, &exact.threads(0).pairs()?);
        wrong = (wrong.0 + too_many, wrong.1 + too_few);
        hits = found.len() as u64;
        undecided = asked.statistics()?.undecided;
        query = Some(asked);
    }
    let mut step = 0;
    let timing = timed(meter, || {
        step += 1;
        let asked = query
            .take()
            .context("it is put back below")?
            .pose_b(pose(step))?;
        let found = asked.pairs()?;
        query = Some(asked);
        Ok(found)
    })?;
    let note = format!("errors over three poses; {undecided} pairs undecided");
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    Ok(row(device, names, size, timing, (hits, wrong), note))
}

/// Vertices of both meshes uploaded, boxes fitted; the sorted list on the host.
fn upload(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    let ([mut a, mut b], query) = query(device, subject, culling)?;
    let wrong = wrong_pairs(&query.pairs()?, subject.reference()?);
    let mut hits = 0;
    let timing = timed(meter, || {
        a.set_vertices(subject.a.vertices().to_vec())?;
        b.set_vertices(subject.b.vertices().to_vec())?;
        hits = query.pairs()?.len() as u64;
        Ok(())
    })?;
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    let note = "vertices uploaded in each call".to_owned();
    Ok(row(device, names, size, timing, (hits, wrong), note))
}

fn count(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    let (_meshes, query) = query(device, subject, culling)?;
    let (found, exact) = (query.count()?, subject.reference()?.len() as u64);
    let wrong = (found.saturating_sub(exact), exact.saturating_sub(found));
    let timing = timed(meter, || Ok(query.count()?))?;
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    Ok(row(
        device,
        names,
        size,
        timing,
        (found, wrong),
        String::new(),
    ))
}

fn any(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    let (_meshes, query) = query(device, subject, culling)?;
    let (found, exact) = (query.any()?, !subject.reference()?.is_empty());
    let wrong = (u64::from(found && !exact), u64::from(exact && !found));
    let timing = timed(meter, || Ok(query.any()?))?;
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    let hits = u64::from(found);
    Ok(row(
        device,
        names,
        size,
        timing,
        (hits, wrong),
        String::new(),
    ))
}

fn mask(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    let (_meshes, query) = query(device, subject, culling)?;
    let (a, b) = query.mask()?;
    let mut exact = (vec![false; a.len()], vec![false; b.len()]);
    for [i, j] in subject.reference()? {
        exact.0[*i as usize] = true;
        exact.1[*j as usize] = true;
    }
    let marks = a.iter().chain(&b).zip(exact.0.iter().chain(&exact.1));
    let mut wrong = (0, 0);
    for (found, exact) in marks {
        wrong.0 += u64::from(*found && !exact);
        wrong.1 += u64::from(!found && *exact);
    }
    let hits = a.iter().chain(&b).filter(|hit| **hit).count() as u64;
    let timing = timed(meter, || Ok(query.mask()?))?;
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    let note = "hits and errors count triangles".to_owned();
    Ok(row(device, names, size, timing, (hits, wrong), note))
}

/// The source's test, every triangle against every other, on the device alone.
fn moller(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    let (_meshes, query) = query(device, subject, culling)?;
    let query = query.method(Method::MOLLER)?;
    let found = query.pairs()?;
    let wrong = wrong_pairs(&found, subject.reference()?);
    let on_cpu = subject.query()?.method(Method::MOLLER).threads(0).pairs()?;
    let (only_here, only_there) = wrong_pairs(&found, &on_cpu);
    let time = || query.statistics().map(|statistics| statistics.gpu_time);
    let timing = match time()? {
        Some(_) => sample(meter, || time()?.context("the device takes times"))?,
        None => timed(meter, || Ok(query.pairs()?))?,
    };
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    let hits = (found.len() as u64, wrong);
    let note = format!("{only_here} pairs that the CPU's has not, and {only_there} fewer");
    Ok(row(device, names, size, timing, hits, note))
}

/// The test alone: from the first dispatch to the end of the last.
fn on_device(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    method: &str,
    culling: Culling,
) -> anyhow::Result<Option<Row>> {
    if !device.features().contains(Features::TIMESTAMP_QUERY) {
        return Ok(None);
    }
    let (_meshes, query) = query(device, subject, culling)?;
    let found = query.pairs()?;
    let wrong = wrong_pairs(&found, subject.reference()?);
    let statistics = query.statistics()?;
    let timing = sample(meter, || {
        let time = query.statistics()?.gpu_time;
        time.context("the device takes times")
    })?;
    let names = (subject.scenario.as_str(), method);
    let size = (subject.size(), "triangle pairs");
    let pairs_per_second = |timing: &Timing| subject.size() as f64 / timing.median_s;
    let note = format!(
        "{}; {:.2e} pairs/s",
        note(&statistics),
        timing.as_ref().map_or(0.0, pairs_per_second)
    );
    Ok(row(
        device,
        names,
        size,
        timing,
        (found.len() as u64, wrong),
        note,
    ))
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

/// Two spheres on the device, the second written there.
struct Spheres {
    sphere: TriangleMesh,
    a: Collider,
    b: Collider,
    query: Query,
    shift: vertebra_gpu::Program,
    by: vertebra_gpu::Slot<[u32; 4]>,
}

impl Spheres {
    fn new(
        device: &Device,
        (around, down): (usize, usize),
        culling: Culling,
    ) -> anyhow::Result<Self> {
        let sphere = tableware::uv_sphere(around, down)?;
        let a = Collider::new(device, sphere.clone())?;
        let b = Collider::new(device, sphere.clone())?;
        let query = Query::new(&a, &b)?.culling(culling);
        let mut recording = Recording::new("shift");
        let by = recording.buffer::<[u32; 4]>("by", 1);
        let base = recording.shared::<f32>("base", a.vertices().len());
        let moved = recording.shared::<f32>("moved", b.vertices().len());
        let count = u32::try_from(sphere.vertices().len())?;
        let groups = workgroups(count, 256);
        recording.dispatch(&SHIFT, &[by.any(), base.any(), moved.any()], groups);
        let shared = [base.is(a.vertices()), moved.is(b.vertices())];
        let shift = device.prepare_with(&recording, &shared)?;
        Ok(Self {
            sphere,
            a,
            b,
            query,
            shift,
            by,
        })
    }

    /// Writes the second sphere's vertices on the device, and fits its boxes.
    fn write(&mut self, by: Vec3) -> anyhow::Result<()> {
        let count = u32::try_from(self.sphere.vertices().len())?;
        let [x, y, z] = by.to_array().map(f32::to_bits);
        self.shift.write(self.by, &[[x, y, z, count]])?;
        drop(self.shift.run()?);
        Ok(self.b.refit()?)
    }

    /// The pairs that the CPU finds.
    fn exact(&self, by: Vec3) -> anyhow::Result<Vec<[u32; 2]>> {
        let moved = self.sphere.vertices().iter().map(|v| *v + by).collect();
        let moved = TriangleMesh::new(moved, self.sphere.triangles().to_vec())?;
        let query = vertebra::Query::new(&self.sphere, &moved).threads(0);
        Ok(query.pairs()?)
    }

    fn size(&self) -> (u64, &'static str) {
        (2 * self.sphere.len() as u64, "triangles")
    }
}

/// Where the second sphere stands in call `step`.
fn by(step: u32) -> Vec3 {
    ASIDE * (1.0 + 1e-3 * (step % 16) as f32)
}

/// Positions written on the device, boxes fitted, the sorted list on the host.
fn refitted(device: &Device, meter: &Meter, steps: (usize, usize)) -> anyhow::Result<Option<Row>> {
    let mut spheres = Spheres::new(device, steps, Culling::Auto)?;
    spheres.write(ASIDE)?;
    let found = spheres.query.pairs()?;
    let wrong = wrong_pairs(&found, &spheres.exact(ASIDE)?);
    let note = note(&spheres.query.statistics()?);
    let mut step = 0;
    let timing = timed(meter, || {
        step += 1;
        spheres.write(by(step))?;
        Ok(spheres.query.pairs()?)
    })?;
    let names = ("crossing spheres", "collision-refit-pairs");
    let hits = (found.len() as u64, wrong);
    Ok(row(device, names, spheres.size(), timing, hits, note))
}

/// The search alone, by timestamps.
fn spheres_on_device(
    device: &Device,
    meter: &Meter,
    steps: (usize, usize),
    (method, culling): (&str, Culling),
) -> anyhow::Result<Option<Row>> {
    if !device.features().contains(Features::TIMESTAMP_QUERY) {
        return Ok(None);
    }
    let mut spheres = Spheres::new(device, steps, culling)?;
    spheres.write(ASIDE)?;
    let found = spheres.query.pairs()?;
    let wrong = wrong_pairs(&found, &spheres.exact(ASIDE)?);
    let statistics = spheres.query.statistics()?;
    let timing = sample(meter, || {
        let time = spheres.query.statistics()?.gpu_time;
        time.context("the device takes times")
    })?;
    let names = ("crossing spheres", method);
    let hits = (found.len() as u64, wrong);
    Ok(row(
        device,
        names,
        spheres.size(),
        timing,
        hits,
        note(&statistics),
    ))
}

/// The tree of one sphere built again on the device.
fn build(device: &Device, meter: &Meter, steps: (usize, usize)) -> anyhow::Result<Option<Row>> {
    let mut spheres = Spheres::new(device, steps, Culling::Auto)?;
    spheres.write(ASIDE)?;
    let timing = timed(meter, || Ok(spheres.a.rebuild()?))?;
    let found = spheres.query.pairs()?;
    let wrong = wrong_pairs(&found, &spheres.exact(ASIDE)?);
    let names = ("crossing spheres", "collision-build");
    let (size, unit) = spheres.size();
    let hits = (found.len() as u64, wrong);
    let note = "one of the two, with allocating what sorting needs".to_owned();
    Ok(row(device, names, (size / 2, unit), timing, hits, note))
}
