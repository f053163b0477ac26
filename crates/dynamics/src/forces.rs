//! Forces acting on a model: in its joints and on its bodies, and gravity where it differs from the model's.

use crate::Error;
use core::ops::Range;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use vertebra_assembly::{Body, BodyId, Model, ModelError};

/// Joint forces and external forces. Gravity is the model's, but for articulations that are given their
/// own ([`set_gravity`](Self::set_gravity)).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forces {
    /// Joint forces [N m or N], shape [`Model::dof_count`]; free and spherical joints in the axes of
    /// their rates.
    pub joint: Vec<f64>,
    /// Inertia E that freedoms have of their own and that moves with nothing but the joint
    /// [kg m^2 or kg]: that of a rotor, or what an implicit step adds ([`Elements`](crate::Elements)).
    /// The equations of motion are (M + E) qdd = tau - h. Empty for none, else shape
    /// [`Model::dof_count`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_inertia: Vec<f64>,
    /// What of E is off its diagonal, between the three freedoms of spherical joints: E_xy, E_xz, E_yz in their
    /// places. Empty for none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) joint_inertia_across: Vec<f64>,
    external: Vec<(BodyId, Wrench)>,
    /// What another gravity than the model's adds, body by body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    weights: Vec<(BodyId, Wrench)>,
}

impl Forces {
    /// No forces.
    #[must_use]
    pub fn none(model: &Model) -> Self {
        Self {
            joint: vec![0.0; model.dof_count()],
            joint_inertia: Vec::new(),
            joint_inertia_across: Vec::new(),
            external: Vec::new(),
            weights: Vec::new(),
        }
    }

    /// Lets a force act on a body, beside those that act already.
    pub fn push(&mut self, body: BodyId, wrench: Wrench) {
        self.external.push((body, wrench));
    }

    /// Takes what acts on the bodies from others.
    pub(crate) fn set_external(&mut self, other: &Self) {
        self.external.clone_from(&other.external);
        self.weights.clone_from(&other.weights);
    }

    /// Becomes a copy of others, in the memory at hand.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.joint.clone_from(&other.joint);
        self.joint_inertia.clone_from(&other.joint_inertia);
        self.joint_inertia_across
            .clone_from(&other.joint_inertia_across);
        self.set_external(other);
    }

    /// Takes all external forces away.
    pub fn clear_external(&mut self) {
        self.external.clear();
    }

    /// The external forces in the order they were added.
    #[must_use]
    pub fn external(&self) -> &[(BodyId, Wrench)] {
        &self.external
    }

    /// Inertia of a freedom's own [kg m^2 or kg].
    pub(crate) fn inertia(&self, dof: usize) -> f64 {
        self.joint_inertia.get(dof).copied().unwrap_or(0.0)
    }

    /// qd' E qd / 2 \[J\].
    pub(crate) fn own_energy(&self, model: &Model, qd: &[f64]) -> f64 {
        let along = self.joint_inertia.iter().zip(qd);
        let mut double: f64 = along.map(|(own, qd)| own * qd * qd).sum();
        if let across @ [_, ..] = self.inertias_across() {
            for body in model.bodies() {
                if let (&[xy, xz, yz], &[x, y, z]) =
                    (&across[body.dof_range()], &qd[body.dof_range()])
                {
                    double += 2.0 * (xy * x * y + xz * x * z + yz * y * z);
                }
            }
        }
        0.5 * double
    }

    /// What of E is off its diagonal, in the place of a freedom.
    pub(crate) fn inertia_across(&self, dof: usize) -> f64 {
        self.inertias_across().get(dof).copied().unwrap_or(0.0)
    }

    /// All of what E has off its diagonal: nothing where that is none.
    pub(crate) fn inertias_across(&self) -> &[f64] {
        if self.joint_inertia.is_empty() {
            &[]
        } else {
            &self.joint_inertia_across
        }
    }

    /// The entry of E of two freedoms of a joint, given all of its freedoms.
    pub(crate) fn inertia_between(&self, dofs: &Range<usize>, dof: usize, other: usize) -> f64 {
        match (dof == other, dofs.len()) {
            (true, _) => self.inertia(dof),
            (false, 3) => self.inertia_across(dof + other - dofs.start - 1),
            (false, _) => 0.0,
        }
    }

    /// The entries of E, on both sides of its diagonal: row, column and value.
    pub(crate) fn inertias<'a>(
        &'a self,
        model: &'a Model,
    ) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
        let own = self.joint_inertia.iter().enumerate();
        let is_across = !self.inertias_across().is_empty();
        let balls = model.bodies().iter().map(Body::dof_range);
        let balls = balls.filter(move |dofs| is_across && dofs.len() == 3);
        let across = balls.flat_map(move |dofs| {
            let first = dofs.start;
            dofs.zip([(0, 1), (0, 2), (1, 2)])
                .flat_map(move |(place, (k, l))| {
                    let value = self.inertia_across(place);
                    [(first + k, first + l, value), (first + l, first + k, value)]
                })
        });
        own.map(|(dof, &value)| (dof, dof, value)).chain(across)
    }

    /// Lets another gravity than the model's act on one articulation of a forest, named by its root, the
    /// body that the world carries [m/s^2, world axes]. Goes through all bodies once.
    ///
    /// On a body of mass m it acts as the force m (g - g of the model) at the centre of mass, which for
    /// gravity without gradient is exact. Potential energies remain those in the model's gravity.
    ///
    /// ```
    /// use vertebra_assembly::generate::{self, RandomTree};
    /// use vertebra_dynamics::{Forces, Simulation};
    ///
    /// let forest = RandomTree { articulations: 2, ..RandomTree::mixed(10) };
    /// let model = generate::random_tree(&forest, 1)?;
    /// let mut simulation = Simulation::new(model.clone())?;
    /// let moon = model.find("body-5").ok_or("the second root")?;
    /// simulation.forces_mut().set_gravity(&model, moon, [0.0, 0.0, -1.62])?;
    /// simulation.step(1e-3)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::UnknownBody`]; [`Error::NotARoot`] of a body that another carries;
    /// [`Error::NonFiniteInput`]. Then gravity is as it was.
    pub fn set_gravity(
        &mut self,
        model: &Model,
        root: BodyId,
        gravity: impl Into<DVec3>,
    ) -> Result<(), Error> {
        let gravity = gravity.into();
        let body = known(model, root)?;
        if let Some(parent) = body.parent {
            return Err(Error::NotARoot {
                body: body.name.clone(),
                root: model.bodies()[root_of(model, parent).index()].name.clone(),
            });
        }
        finite("gravity", &body.name, gravity)?;
        let difference = gravity - model.gravity();
        let mut carried = vec![false; model.bodies().len()];
        for (id, body) in model.body_ids().zip(model.bodies()) {
            carried[id.index()] = match body.parent {
                None => id == root,
                Some(parent) => carried[parent.index()],
            };
        }
        self.weights.retain(|(id, _)| !carried[id.index()]);
        if difference != DVec3::ZERO {
            let bodies = model.body_ids().filter(|id| carried[id.index()]);
            self.weights.extend(bodies.map(|id| {
                let mass = model.bodies()[id.index()].mass.mass;
                (id, Wrench::at_center(difference * mass))
            }));
        }
        Ok(())
    }

    /// Everything that acts on bodies beside the model's gravity.
    pub(crate) fn acting(&self) -> impl Iterator<Item = &(BodyId, Wrench)> {
        self.external.iter().chain(&self.weights)
    }

    /// Checks lengths, bodies and finiteness.
    ///
    /// # Errors
    /// [`Error`], naming the first number that is wrong.
    pub fn check(&self, model: &Model) -> Result<(), Error> {
        check_dofs(model, "joint forces", "joint force", &self.joint)?;
        if !self.joint_inertia.is_empty() {
            check_dofs(
                model,
                "joint inertias",
                "joint inertia",
                &self.joint_inertia,
            )?;
            let negative = |&inertia: &f64| inertia < 0.0;
            if let Some(dof) = self.joint_inertia.iter().position(negative) {
                return Err(Error::Model(ModelError::Negative {
                    quantity: "joint inertia",
                    body: body_of_dof(model, dof),
                    value: self.joint_inertia[dof],
                }));
            }
        }
        if !self.joint_inertia_across.is_empty() {
            let across = &self.joint_inertia_across;
            check_dofs(model, "joint inertias", "joint inertia", across)?;
        }
        for (id, wrench) in self.acting() {
            let body = known(model, *id)?;
            for (quantity, v) in [
                ("external force", wrench.force),
                ("external torque", wrench.torque),
                (
                    "point of an external force",
                    wrench.point.unwrap_or(DVec3::ZERO),
                ),
            ] {
                finite(quantity, &body.name, v)?;
            }
        }
        Ok(())
    }
}

fn known(model: &Model, id: BodyId) -> Result<&Body, Error> {
    model.body(id).ok_or_else(|| Error::UnknownBody {
        model: model.name().to_owned(),
        body: id.index(),
    })
}

fn finite(quantity: &'static str, element: &str, v: DVec3) -> Result<(), Error> {
    match v.to_array().into_iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(Error::NonFiniteInput {
            quantity,
            element: element.to_owned(),
            value,
        }),
    }
}

/// Refuses a length of a step \[s\] that is no number.
pub(crate) fn check_step(element: &str, h: f64) -> Result<(), Error> {
    if h.is_finite() {
        return Ok(());
    }
    Err(Error::NonFiniteInput {
        quantity: "step",
        element: element.to_owned(),
        value: h,
    })
}

/// The body of this articulation that the world carries.
fn root_of(model: &Model, mut body: BodyId) -> BodyId {
    while let Some(parent) = model.bodies()[body.index()].parent {
        body = parent;
    }
    body
}

/// Checks an array with one number a degree of freedom.
pub(crate) fn check_dofs(
    model: &Model,
    array: &'static str,
    quantity: &'static str,
    values: &[f64],
) -> Result<(), Error> {
    if values.len() != model.dof_count() {
        return Err(Error::Model(ModelError::WrongLength {
            quantity: array,
            expected: model.dof_count(),
            found: values.len(),
        }));
    }
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(dof) => Err(Error::NonFiniteInput {
            quantity,
            element: body_of_dof(model, dof),
            value: values[dof],
        }),
    }
}

/// Name of the body whose joint has that degree of freedom.
pub(crate) fn body_of_dof(model: &Model, dof: usize) -> String {
    let after = model.bodies().partition_point(|body| body.dof_start <= dof);
    model.bodies()[after.saturating_sub(1)].name.clone()
}

/// A force and a torque acting on a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force \[N\].
    pub force: DVec3,
    /// Torque [N m].
    pub torque: DVec3,
    /// Point where the force acts, in the body's frame \[m\]; none for the centre of mass.
    pub point: Option<DVec3>,
    /// Whether force and torque are given in the body's axes; else in the world's.
    pub body_axes: bool,
}

impl Wrench {
    /// A force \[N\] in world axes at the centre of mass.
    #[must_use]
    pub fn at_center(force: impl Into<DVec3>) -> Self {
        Self {
            force: force.into(),
            torque: DVec3::ZERO,
            point: None,
            body_axes: false,
        }
    }

    /// A force \[N\] in world axes at a point of the body, given in the body's frame \[m\].
    #[must_use]
    pub fn at_point(force: impl Into<DVec3>, point: impl Into<DVec3>) -> Self {
        Self {
            point: Some(point.into()),
            ..Self::at_center(force)
        }
    }

    /// Adds a torque [N m].
    #[must_use]
    pub fn with_torque(mut self, torque: impl Into<DVec3>) -> Self {
        self.torque += torque.into();
        self
    }

    /// The same numbers, understood in the body's axes.
    #[must_use]
    pub const fn in_body_axes(mut self) -> Self {
        self.body_axes = true;
        self
    }
}
