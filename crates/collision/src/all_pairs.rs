//! Every triangle of A against every triangle of B, in tiles of some rows of A and some columns of B.

use std::ops::{ControlFlow, Range};

use glam::{DVec3, Vec3};

use crate::bounds::{Bounds, LANES, Packet, lanes};
use crate::criterion::Criterion;
use crate::mesh::TriangleMesh;
use crate::moller::PlanedTriangle;
use crate::predicates::Plane;
use crate::sink::{PairTest, Sink};
use crate::transform::RelativePose;

/// Triangles of A in a task.
const ROWS: usize = 32;

/// Triangles of B in a task, a multiple of the lanes.
const COLUMNS: usize = 4096;

/// The number of tiles of two meshes of so many triangles.
fn tiles([a, b]: [usize; 2]) -> usize {
    a.div_ceil(ROWS) * b.div_ceil(COLUMNS)
}

/// The rows and the columns of a tile.
fn tile(task: usize, [a, b]: [usize; 2]) -> [Range<usize>; 2] {
    let across = b.div_ceil(COLUMNS);
    let (row, column) = (task / across * ROWS, task % across * COLUMNS);
    [row..a.min(row + ROWS), column..b.min(column + COLUMNS)]
}

/// The exact test on the posed `f64` points, behind boxes that contain them.
pub(crate) struct ExactTest {
    a: Vec<[DVec3; 3]>,
    b: Vec<[DVec3; 3]>,
    b_planes: Vec<Plane>,
    b_bounds: Vec<Packet>,
    criterion: Criterion,
}

impl ExactTest {
    pub(crate) fn new(
        a: &TriangleMesh,
        b: &TriangleMesh,
        pose: &RelativePose,
        criterion: Criterion,
    ) -> Self {
        let posed: Vec<DVec3> = b.vertices().iter().map(|&v| pose.apply(v)).collect();
        let b = gather(b.triangles(), |i| posed[i]);
        let packet = |chunk: &[[DVec3; 3]]| {
            let packet = Packet::new(chunk.iter().map(Bounds::around));
            criterion
                .reach()
                .map_or(packet, |reach| packet.grown(reach))
        };
        Self {
            a: gather(a.triangles(), |i| a.vertices()[i].as_dvec3()),
            b_planes: b.iter().map(|&corners| Plane::through(corners)).collect(),
            b_bounds: b.chunks(LANES).map(packet).collect(),
            b,
            criterion,
        }
    }

    fn sizes(&self) -> [usize; 2] {
        [self.a.len(), self.b.len()]
    }

    fn visit_row(
        &self,
        row: usize,
        columns: &Range<usize>,
        sink: &mut impl Sink,
    ) -> ControlFlow<()> {
        let triangle = &self.a[row];
        let bounds = Bounds::around(triangle);
        for index in columns.start / LANES..columns.end.div_ceil(LANES) {
            // Boxes of triangles are finite, so empty lanes are apart from all.
            for lane in lanes(self.b_bounds[index].overlaps(&bounds)) {
                let column = index * LANES + lane;
                let pair = [id(row), id(column)];
                if sink.wants(pair) {
                    let decision =
                        self.criterion
                            .decide(triangle, &self.b[column], &self.b_planes[column]);
                    sink.decided(&decision);
                    if decision.meet {
                        sink.hit(pair)?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

impl PairTest for ExactTest {
    type Scratch = ();

    fn tasks(&self) -> usize {
        tiles(self.sizes())
    }

    fn visit(&self, task: usize, (): &mut (), sink: &mut impl Sink) -> ControlFlow<()> {
        let [mut rows, columns] = tile(task, self.sizes());
        rows.try_for_each(|row| self.visit_row(row, &columns, sink))
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
    type Scratch = ();

    fn tasks(&self) -> usize {
        tiles([self.a.len(), self.b.len()])
    }

    fn visit(&self, task: usize, (): &mut (), sink: &mut impl Sink) -> ControlFlow<()> {
        let [rows, columns] = tile(task, [self.a.len(), self.b.len()]);
        for row in rows {
            for (column, other) in columns.clone().zip(&self.b[columns.clone()]) {
                let pair = [id(row), id(column)];
                if sink.wants(pair) && self.a[row].intersects(other, self.epsilon) {
                    sink.hit(pair)?;
                }
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
