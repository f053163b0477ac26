//! The state of a model: what a simulation saves.

use crate::{JointKind, Model, ModelError, random::Random};
use serde::{Deserialize, Serialize};

/// Format version written, and the only one read.
const STATE_VERSION: u32 = 1;

/// Positions, rates and time. [`JointKind`] says which entries each kind of joint has.
///
/// Saved numbers come back to the last bit where the parser rounds correctly (`serde_json` does so
/// with its feature `float_roundtrip` only).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct State {
    /// Joint positions [rad, m, or quaternion x, y, z, w], shape [`Model::position_count`].
    pub q: Vec<f64>,
    /// Joint rates [rad/s or m/s], shape [`Model::dof_count`].
    pub qd: Vec<f64>,
    /// Time \[s\].
    pub time: f64,
}

/// The state as written to a file.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    version: u32,
    time: f64,
    q: Vec<f64>,
    qd: Vec<f64>,
}

impl From<State> for Saved {
    fn from(state: State) -> Self {
        Self {
            version: STATE_VERSION,
            time: state.time,
            q: state.q,
            qd: state.qd,
        }
    }
}

impl TryFrom<Saved> for State {
    type Error = ModelError;

    fn try_from(saved: Saved) -> Result<Self, ModelError> {
        if saved.version != STATE_VERSION {
            return Err(ModelError::UnsupportedVersion {
                what: "state",
                found: saved.version,
                supported: STATE_VERSION,
            });
        }
        Ok(Self {
            q: saved.q,
            qd: saved.qd,
            time: saved.time,
        })
    }
}

impl State {
    /// At rest at time 0, all positions zero and all quaternions the identity.
    #[must_use]
    pub fn neutral(model: &Model) -> Self {
        let mut q = vec![0.0; model.position_count()];
        for body in model.bodies() {
            let joint_q = &mut q[body.position_range()];
            if let (JointKind::Spherical | JointKind::Free, [.., w]) = (body.joint.kind, joint_q) {
                *w = 1.0;
            }
        }
        Self {
            q,
            qd: vec![0.0; model.dof_count()],
            time: 0.0,
        }
    }

    /// Random positions and rates, the same for the same seed on every machine.
    ///
    /// Angles are uniform in (-pi, pi), orientations uniform over all rotations, displacements in
    /// (-1, 1) of the model's length unit, rates in (-1, 1) rad/s and length units a second.
    #[must_use]
    pub fn random(model: &Model, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let length = model.units().length;
        let mut state = Self::neutral(model);
        for body in model.bodies() {
            let q = &mut state.q[body.position_range()];
            let qd = &mut state.qd[body.dof_range()];
            match body.joint.kind {
                JointKind::Fixed => {}
                JointKind::Revolute { .. } | JointKind::Screw { .. } => {
                    q[0] = random.symmetric() * core::f64::consts::PI;
                    qd[0] = random.symmetric();
                }
                JointKind::Prismatic { .. } => {
                    q[0] = random.symmetric() * length;
                    qd[0] = random.symmetric() * length;
                }
                JointKind::Spherical => {
                    q.copy_from_slice(&random.rotation().to_array());
                    qd.fill_with(|| random.symmetric());
                }
                JointKind::Free => {
                    let (position, rotation) = q.split_at_mut(3);
                    position.fill_with(|| random.symmetric() * length);
                    rotation.copy_from_slice(&random.rotation().to_array());
                    let (angular, linear) = qd.split_at_mut(3);
                    angular.fill_with(|| random.symmetric());
                    linear.fill_with(|| random.symmetric() * length);
                }
            }
        }
        state
    }

    /// Checks lengths, finiteness and unit quaternions (to 1e-6).
    ///
    /// # Errors
    /// [`ModelError::WrongLength`], [`ModelError::NonFinite`] or [`ModelError::NonUnitQuaternion`],
    /// naming the first joint that is wrong.
    pub fn check(&self, model: &Model) -> Result<(), ModelError> {
        for (quantity, found, expected) in [
            ("positions q", self.q.len(), model.position_count()),
            ("rates qd", self.qd.len(), model.dof_count()),
        ] {
            if found != expected {
                return Err(ModelError::WrongLength {
                    quantity,
                    expected,
                    found,
                });
            }
        }
        let non_finite = |quantity, element: &str, value| ModelError::NonFinite {
            quantity,
            element: element.to_owned(),
            value,
        };
        if !self.time.is_finite() {
            return Err(non_finite("time", "state", self.time));
        }
        // A look at all numbers at once; which one it is, is for the error alone.
        let all_finite = |values: &[f64]| values.iter().fold(true, |all, x| all & x.is_finite());
        let finite = all_finite(&self.q) & all_finite(&self.qd);
        // A quaternion has one number more than its joint has freedoms.
        let mut quaternions = self.q.len() - self.qd.len();
        for body in model.bodies() {
            if finite && quaternions == 0 {
                break;
            }
            let q = &self.q[body.position_range()];
            let qd = &self.qd[body.dof_range()];
            for (quantity, values) in [("joint position", q), ("joint rate", qd)] {
                if let Some(&value) = values.iter().find(|value| !value.is_finite()) {
                    return Err(non_finite(quantity, &body.name, value));
                }
            }
            let quaternion = match body.joint.kind {
                JointKind::Spherical => q,
                JointKind::Free => &q[3..],
                _ => continue,
            };
            quaternions -= 1;
            let length = quaternion.iter().map(|c| c * c).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-6 {
                return Err(ModelError::NonUnitQuaternion {
                    quantity: "joint position",
                    element: body.name.clone(),
                    length,
                });
            }
        }
        Ok(())
    }
}
