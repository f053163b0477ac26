//! Every triangle of A against every triangle of B, in rows of A, over one or several threads.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use glam::{DVec3, Vec3};

use crate::bounds::{Bounds, BoundsList};
use crate::exact::triangles_intersect;
use crate::mesh::TriangleMesh;
use crate::moller::PlanedTriangle;
use crate::sink::Sink;
use crate::transform::{RelativePose, predicate_scale};

/// Triangles of A that a thread takes at a time.
const CHUNK: usize = 32;

/// A method, prepared for two meshes and a pose: finds the triangles of B that meet one triangle of A.
pub(crate) trait PairTest: Sync {
    /// The number of triangles of A.
    fn rows(&self) -> usize;

    /// Hands the colliding pairs of one triangle of A to the sink.
    fn visit_row(&self, row: usize, sink: &mut impl Sink) -> ControlFlow<()>;
}

/// Runs all rows, with one sink a thread, on at most this many threads (0: all there are).
///
/// Which sink gets which rows depends on timing, so callers merge sinks by operations that do not care.
pub(crate) fn run<S: Sink>(
    test: &impl PairTest,
    threads: usize,
    new_sink: impl Fn() -> S + Sync,
) -> Vec<S> {
    let next = AtomicUsize::new(0);
    let done = AtomicBool::new(false);
    let chunks = test.rows().div_ceil(CHUNK);
    let worker = || {
        let mut sink = new_sink();
        while !done.load(Ordering::Relaxed) {
            let chunk = next.fetch_add(1, Ordering::Relaxed);
            if chunk >= chunks {
                break;
            }
            let start = chunk * CHUNK;
            let mut rows = start..test.rows().min(start + CHUNK);
            if rows
                .try_for_each(|row| test.visit_row(row, &mut sink))
                .is_break()
            {
                done.store(true, Ordering::Relaxed);
            }
        }
        sink
    };
    spread(worker, threads, chunks)
}

/// Runs the worker on this thread, or at once on as many of rayon's as allowed and useful.
#[cfg(feature = "rayon")]
fn spread<S: Send>(worker: impl Fn() -> S + Sync, threads: usize, useful: usize) -> Vec<S> {
    use rayon::iter::{IntoParallelIterator, ParallelIterator};

    // Asking rayon for its size starts its threads, so one thread must not ask.
    if threads == 1 || useful == 1 {
        return vec![worker()];
    }
    let available = rayon::current_num_threads();
    let wanted = if threads == 0 { available } else { threads };
    let workers = wanted.min(available).min(useful);
    (0..workers).into_par_iter().map(|_| worker()).collect()
}

#[cfg(not(feature = "rayon"))]
fn spread<S: Send>(worker: impl Fn() -> S + Sync, _threads: usize, _useful: usize) -> Vec<S> {
    vec![worker()]
}

/// The exact test on the posed `f64` points, behind boxes that contain them.
pub(crate) struct ExactTest {
    a: Vec<[DVec3; 3]>,
    b: Vec<[DVec3; 3]>,
    a_bounds: Vec<Bounds>,
    b_bounds: BoundsList,
}

impl ExactTest {
    pub(crate) fn new(a: &TriangleMesh, b: &TriangleMesh, pose: &RelativePose) -> Self {
        let posed: Vec<DVec3> = b.vertices().iter().map(|&v| pose.apply(v)).collect();
        let scale = predicate_scale(&posed);
        let mut a = gather(a.triangles(), |i| a.vertices()[i].as_dvec3());
        let mut b = gather(b.triangles(), |i| posed[i]);
        let bounds = |triangles: &[[DVec3; 3]]| triangles.iter().map(Bounds::of).collect();
        let a_bounds: Vec<Bounds> = bounds(&a);
        let b_bounds: Vec<Bounds> = bounds(&b);
        // Scaled points would leave the range of f32 boxes, so the boxes come first.
        if scale != 1.0 {
            for point in a.iter_mut().chain(&mut b).flatten() {
                *point *= scale;
            }
        }
        Self {
            a,
            b,
            a_bounds,
            b_bounds: BoundsList::new(&b_bounds),
        }
    }
}

impl PairTest for ExactTest {
    fn rows(&self) -> usize {
        self.a.len()
    }

    fn visit_row(&self, row: usize, sink: &mut impl Sink) -> ControlFlow<()> {
        let triangle = &self.a[row];
        for column in self.b_bounds.overlapping(self.a_bounds[row]) {
            let pair = [id(row), column];
            if sink.wants(pair) && triangles_intersect(triangle, &self.b[column as usize]) {
                sink.hit(pair)?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// Möller's test on points posed in `f64` and rounded to `f32`, on every pair, as the source has it.
pub(crate) struct MollerTest {
    a: Vec<PlanedTriangle>,
    b: Vec<PlanedTriangle>,
    epsilon: f32,
}

impl MollerTest {
    pub(crate) fn new(
        a: &TriangleMesh,
        b: &TriangleMesh,
        pose: &RelativePose,
        epsilon: f32,
    ) -> Self {
        let posed: Vec<Vec3> = b
            .vertices()
            .iter()
            .map(|&v| pose.apply(v).as_vec3())
            .collect();
        let planes =
            |triangles: Vec<[Vec3; 3]>| triangles.into_iter().map(PlanedTriangle::new).collect();
        Self {
            a: planes(gather(a.triangles(), |i| a.vertices()[i])),
            b: planes(gather(b.triangles(), |i| posed[i])),
            epsilon,
        }
    }
}

impl PairTest for MollerTest {
    fn rows(&self) -> usize {
        self.a.len()
    }

    fn visit_row(&self, row: usize, sink: &mut impl Sink) -> ControlFlow<()> {
        let triangle = &self.a[row];
        for (column, other) in (0..).zip(&self.b) {
            let pair = [id(row), column];
            if sink.wants(pair) && triangle.intersects(other, self.epsilon) {
                sink.hit(pair)?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// The corners of all triangles, side by side.
fn gather<P>(triangles: &[[u32; 3]], vertex: impl Fn(usize) -> P) -> Vec<[P; 3]> {
    triangles
        .iter()
        .map(|corners| corners.map(|i| vertex(i as usize)))
        .collect()
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a mesh has at most u32::MAX triangles"
)]
fn id(index: usize) -> u32 {
    index as u32
}
