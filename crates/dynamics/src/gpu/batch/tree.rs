//! The model as a batch sees it: bodies that move, those that are fixed to them worked in.

use crate::Wrench;
use crate::link::{BodyFrame, Kind, Link};
use vertebra_assembly::{Model, Units};
use vertebra_spatial::{Force, RigidInertia, Transform, Vec3};

/// A body that moves against its parent.
pub(super) struct Node {
    /// Its index in the model.
    pub(super) body: usize,
    /// Index of the node that carries it.
    pub(super) parent: Option<usize>,
    pub(super) kind: Kind,
    /// The joint frame on the parent, in the parent node's joint frame.
    pub(super) placement: Transform<f64>,
    /// Inertia about the joint's origin in joint axes, with that of all bodies fixed to it.
    pub(super) inertia: RigidInertia<f64>,
    pub(super) position: usize,
    pub(super) dof: usize,
}

/// Where a body of the model is in its node's joint frame.
struct Place {
    node: Option<usize>,
    at: Transform<f64>,
    frame: BodyFrame<f64>,
}

/// The moving bodies, parents first.
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    places: Vec<Place>,
    units: Units,
}

impl Tree {
    pub(super) fn new(model: &Model) -> Self {
        let (links, frames) = Link::<f64>::of_model(model);
        let mut nodes: Vec<Node> = Vec::new();
        let mut places: Vec<Place> = Vec::with_capacity(links.len());
        for (body, (link, frame)) in links.into_iter().zip(frames).enumerate() {
            let (parent, at) = match link.parent {
                Some(parent) => (places[parent].node, places[parent].at * link.placement),
                None => (None, link.placement),
            };
            if link.kind == Kind::Fixed {
                if let Some(node) = parent {
                    let inertia = link.inertia.rotated(&at.rotation);
                    nodes[node].inertia += inertia.shifted_back(at.translation);
                }
                places.push(Place {
                    node: parent,
                    at,
                    frame,
                });
                continue;
            }
            places.push(Place {
                node: Some(nodes.len()),
                at: Transform::IDENTITY,
                frame,
            });
            nodes.push(Node {
                body,
                parent,
                kind: link.kind,
                placement: at,
                inertia: link.inertia,
                position: link.q,
                dof: link.v,
            });
        }
        Self {
            nodes,
            places,
            units: *model.units(),
        }
    }

    /// Children of each node.
    pub(super) fn children(&self) -> Vec<Vec<usize>> {
        let mut children = vec![Vec::new(); self.nodes.len()];
        for (node, Node { parent, .. }) in self.nodes.iter().enumerate() {
            if let Some(parent) = parent {
                children[*parent].push(node);
            }
        }
        children
    }

    /// The node that feels forces on a body of the model; none if the body is fixed to the world.
    pub(super) fn carrier(&self, body: usize) -> Option<usize> {
        self.places.get(body)?.node
    }

    /// Adds a wrench on a body to the numbers that its node's kernel reads.
    ///
    /// In the node's axes and about its origin: moment and force of what is given in body axes. In world
    /// axes: force f and torque, and the sum of p f' over the points p (in the node's axes) where
    /// forces act, row by row.
    pub(super) fn push(&self, body: usize, wrench: &Wrench, numbers: &mut [f64; PUSH]) {
        let Place { at, frame, .. } = &self.places[body];
        let linear: Vec3<f64> = Vec3::from_glam(wrench.force / self.units.force());
        let angular: Vec3<f64> = Vec3::from_glam(wrench.torque / self.units.energy());
        let arm = at.point(match wrench.point {
            None => frame.center,
            Some(point) => frame
                .placement
                .point(Vec3::from_glam(point / self.units.length)),
        });
        let mut add = |first: usize, terms: [f64; 3]| {
            for (sum, term) in numbers[first..].iter_mut().zip(terms) {
                *sum += term;
            }
        };
        if wrench.body_axes {
            let axes = at.rotation * frame.placement.rotation;
            let force = Force::new(axes * angular, axes * linear).shifted_back(arm);
            add(0, force.angular.to_array());
            add(3, force.linear.to_array());
        } else {
            add(6, linear.to_array());
            add(9, angular.to_array());
            for (row, along) in arm.to_array().into_iter().enumerate() {
                add(12 + 3 * row, (linear * along).to_array());
            }
        }
    }
}

/// Numbers of a body with forces.
pub(super) const PUSH: usize = 21;
