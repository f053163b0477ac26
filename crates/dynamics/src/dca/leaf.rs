//! Which chunks end with a leaf of their own.
//!
//! The recursion takes the inertia of a heavy body inboard, where each joint lets some of it go, all
//! of it once the joints passed can move it in all six directions: from there on it is rounding that
//! the light bodies have to stand out against. The compliance of the light bodies, to which a leaf
//! is joined, is regular only where their joints move in as many directions, and the leaf's own
//! small one drowns in its rounding otherwise. So a heavy body is a leaf where the joints inboard of
//! it, within the next lighter bodies, have six independent directions in a position like any other.

use super::plan::Outboard;
use crate::link::{Kind, Link};
use vertebra_assembly::Model;
use vertebra_assembly::schedule::{Chunk, Schedule};
use vertebra_spatial::{Mat3, Motion, Transform, subspace, vec3};

/// A body this many times as heavy as those inboard of it is a leaf of its own: a recursion that
/// starts from it would lose about as many digits of theirs as this has.
const LEAF_RATIO: f64 = 16.0;

/// Directions count as independent if the part of one that the others do not span is this large, of
/// unit vectors in the model's own unit of length.
const INDEPENDENT: f64 = 1e-4;

/// How a chunk ends outboard.
pub(super) fn outboard(
    model: &Model,
    schedule: &Schedule,
    chunk: &Chunk,
    weights: &[f64],
) -> Outboard {
    let start = if chunk.tail {
        Outboard::Free
    } else {
        Outboard::Half
    };
    let bodies = &schedule.order()[chunk.joints()];
    let Some((last, light)) = bodies.split_last() else {
        return start;
    };
    let heavy = weights[last.index()] / LEAF_RATIO;
    let mut directions = Directions::default();
    directions.pass(model, last.index());
    for body in light.iter().rev() {
        let weight = weights[body.index()];
        // Bodies without inertia of their own leave joints beyond without any, unless the recursion
        // brings that of the heavy body along.
        if weight == 0.0 || weight > heavy {
            return start;
        }
        directions.pass(model, body.index());
        if directions.rank() == 6 {
            return Outboard::Leaf;
        }
    }
    start
}

/// Whether a chunk long enough would end with a leaf: some body with lighter ones inboard of it, whose joints have six
/// freedoms.
#[cfg(feature = "gpu")]
pub(crate) fn has_heavy_end(model: &Model, weights: &[f64]) -> bool {
    let bodies = model.bodies();
    (0..bodies.len()).any(|last| {
        let heavy = weights[last] / LEAF_RATIO;
        let mut freedoms = bodies[last].dof_range().len();
        let mut at = bodies[last].parent;
        while let Some(body) = at.map(|body| body.index())
            && freedoms < 6
            && weights[body] > 0.0
            && weights[body] <= heavy
        {
            freedoms += bodies[body].dof_range().len();
            at = bodies[body].parent;
        }
        freedoms >= 6 && at != bodies[last].parent
    })
}

/// Motions that joints passed from the tip inwards allow, about the latest one's body before.
#[derive(Default)]
struct Directions(Vec<Motion<f64>>);

impl Directions {
    /// Passes a joint, at angles that no model is built for.
    fn pass(&mut self, model: &Model, body: usize) {
        let body = &model.bodies()[body];
        let link = Link::<f64>::new(body, model);
        let angle = 0.7 + 1.3 * (self.0.len() as f64);
        let (sin, cos) = angle.sin_cos();
        let turn = Mat3::from_cols(
            vec3(cos, sin, 0.0),
            vec3(-sin, cos, 0.0),
            vec3(0.0, 0.0, 1.0),
        );
        let (moved, columns): (_, &[Motion<f64>]) = match link.kind {
            Kind::Fixed => (Transform::IDENTITY, &[]),
            Kind::Revolute => {
                let moved = Transform {
                    rotation: turn,
                    ..Transform::IDENTITY
                };
                (moved, &subspace::revolute(vec3(0.0, 0.0, 1.0)))
            }
            Kind::Prismatic => {
                let moved = Transform {
                    translation: vec3(0.0, 0.0, angle),
                    ..Transform::IDENTITY
                };
                (moved, &subspace::prismatic(vec3(0.0, 0.0, 1.0)))
            }
            Kind::Screw => {
                let moved = Transform {
                    rotation: turn,
                    translation: vec3(0.0, 0.0, angle * link.pitch),
                };
                let axis = vec3(0.0, 0.0, 1.0);
                (moved, &subspace::screw(axis, link.pitch))
            }
            Kind::Spherical => (Transform::IDENTITY, &subspace::spherical(&Mat3::IDENTITY)),
            Kind::Free => (Transform::IDENTITY, &subspace::free(&Mat3::IDENTITY)),
        };
        for known in &mut self.0 {
            *known = moved.motion(*known);
        }
        self.0.extend_from_slice(columns);
        for known in &mut self.0 {
            *known = link.placement.motion(*known);
        }
    }

    /// How many are independent, by orthogonalisation.
    fn rank(&self) -> usize {
        let mut basis: Vec<[f64; 6]> = Vec::with_capacity(6);
        for motion in &self.0 {
            let mut rest = motion.to_array();
            scale(&mut rest);
            for known in &basis {
                let along: f64 = rest.iter().zip(known).map(|(a, b)| a * b).sum();
                for (rest, known) in rest.iter_mut().zip(known) {
                    *rest -= along * known;
                }
            }
            if scale(&mut rest) > INDEPENDENT && basis.len() < 6 {
                basis.push(rest);
            }
        }
        basis.len()
    }
}

/// Makes a vector one of unit length; returns the length it had.
fn scale(v: &mut [f64; 6]) -> f64 {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 {
        for x in v {
            *x /= length;
        }
    }
    length
}
