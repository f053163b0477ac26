//! The motion: positions over time.

use super::Options;
use super::skeleton::{Channel, Skeleton};
use super::words::{self, Words};
use crate::{FileError, Problem};
use glam::{DQuat, DVec3};
use vertebra_assembly::{BodyId, JointKind, Model, ModelError, State};
use vertebra_dynamics::SphericalMotor;

/// Positions of a model over time, at equal intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    frame_time: f64,
    position_count: usize,
    /// Frame by frame, shape [frames, position_count].
    q: Vec<f64>,
}

impl Motion {
    /// Time from one frame to the next \[s\].
    #[must_use]
    pub const fn frame_time(&self) -> f64 {
        self.frame_time
    }

    /// Number of frames.
    #[must_use]
    pub fn len(&self) -> usize {
        self.q.len() / self.position_count.max(1)
    }

    /// Whether there are no frames.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.q.is_empty()
    }

    /// Time of the last frame \[s\].
    #[must_use]
    pub fn duration(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "frames are far fewer than 2^53")]
        let intervals = self.len().saturating_sub(1) as f64;
        intervals * self.frame_time
    }

    /// Positions in a frame, if there is one of that number.
    #[must_use]
    pub fn frame(&self, index: usize) -> Option<&[f64]> {
        self.q.chunks_exact(self.position_count.max(1)).nth(index)
    }

    /// Positions and rates at a time \[s\], for the model that the motion was read with.
    ///
    /// Between two frames displacements are interpolated linearly and rotations at constant angular
    /// velocity; rates are those of this interpolation. Before the first frame and after the last one
    /// the model stands still.
    ///
    /// # Errors
    /// [`ModelError::WrongLength`] for another model, [`ModelError::NonFinite`] for a time that is
    /// not a number.
    pub fn state(&self, model: &Model, time: f64) -> Result<State, ModelError> {
        let mut state = State::neutral(model);
        self.interpolate(model, time, &mut state)?;
        Ok(state)
    }

    /// [`state`](Self::state) without an allocation, into a state of the model.
    ///
    /// # Errors
    /// As [`state`](Self::state).
    pub fn interpolate(
        &self,
        model: &Model,
        time: f64,
        state: &mut State,
    ) -> Result<(), ModelError> {
        for (found, expected) in [
            (self.position_count, model.position_count()),
            (state.q.len(), model.position_count()),
            (state.qd.len(), model.dof_count()),
        ] {
            if found != expected {
                return Err(ModelError::WrongLength {
                    quantity: "positions of the motion or state",
                    expected,
                    found,
                });
            }
        }
        if !time.is_finite() {
            return Err(ModelError::NonFinite {
                quantity: "time",
                element: "motion".to_owned(),
                value: time,
            });
        }
        state.time = time;
        state.qd.fill(0.0);
        let last = self.len().saturating_sub(1);
        let at = time / self.frame_time;
        let (before, part) = split(at, last);
        let (Some(first), Some(second)) = (self.frame(before), self.frame((before + 1).min(last)))
        else {
            return Ok(());
        };
        if part == 0.0 {
            state.q.copy_from_slice(first);
        }
        let moves = time > 0.0 && time < self.duration();
        for body in model.bodies() {
            let (positions, dofs) = (body.position_range(), body.dof_range());
            let (a, b) = (&first[positions.clone()], &second[positions.clone()]);
            let q = &mut state.q[positions];
            let qd = &mut state.qd[dofs];
            let (shift, turn) = match body.joint.kind {
                JointKind::Free => (3, true),
                JointKind::Spherical => (0, true),
                _ => (a.len(), false),
            };
            for ((q, a), b) in q.iter_mut().zip(a).zip(b).take(shift) {
                *q = a + (b - a) * part;
            }
            if !turn {
                continue;
            }
            let (from, to) = (
                DQuat::from_slice(&a[shift..]),
                DQuat::from_slice(&b[shift..]),
            );
            let turned = rotation_vector(from.conjugate() * to);
            let now = (from * from_rotation_vector(turned * part)).normalize();
            if part > 0.0 {
                q[shift..].copy_from_slice(&now.to_array());
            }
            if moves {
                let speed = turned / self.frame_time;
                qd[..3].copy_from_slice(&speed.to_array());
                if shift == 3 {
                    let moved = (DVec3::from_slice(b) - DVec3::from_slice(a)) / self.frame_time;
                    qd[3..].copy_from_slice(&(now.conjugate() * moved).to_array());
                }
            }
        }
        Ok(())
    }
}

/// A motor for each spherical joint of a model, which strives for its orientation and rate in the state that is
/// `wanted`, such as one of [`Motion::interpolate`]; `gains` gives stiffness [N m/rad] and damping [N m s/rad] by
/// body. The root, which moves freely, has none.
///
/// ```
/// use vertebra_dynamics::Simulation;
/// use vertebra_files::bvh::{self, Options};
///
/// # let text = "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
/// #     JOINT b { OFFSET 0 9 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 9 0 } } }
/// #     MOTION Frames: 2 Frame Time: 0.1
/// #     0 0 0 0 0 0
/// #     0 0 0 0 40 0";
/// let bvh::Capture { model, motion, .. } = bvh::parse(text, &Options::default())?;
/// let mut wanted = motion.state(&model, 0.0)?;
/// let mut simulation = Simulation::new(model.clone())?;
/// for _ in 0..100 {
///     motion.interpolate(&model, simulation.time(), &mut wanted)?;
///     for (body, motor) in bvh::motors(&model, &wanted, |_| [50.0, 5.0]) {
///         simulation.set_spherical_motor(body, motor)?;
///     }
///     simulation.step(1e-3)?;
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn motors<'a>(
    model: &'a Model,
    wanted: &'a State,
    gains: impl Fn(BodyId) -> [f64; 2] + 'a,
) -> impl Iterator<Item = (BodyId, SphericalMotor)> + 'a {
    let bodies = model.body_ids().zip(model.bodies());
    bodies.filter_map(move |(id, body)| {
        if body.joint.kind != JointKind::Spherical {
            return None;
        }
        let q = wanted.q.get(body.position_range())?;
        let rate = wanted.qd.get(body.dof_range())?;
        let [stiffness, damping] = gains(id);
        let motor = SphericalMotor::orientation(DQuat::from_slice(q), stiffness, damping);
        Some((id, motor.at_rate(DVec3::from_slice(rate))))
    })
}

/// The frame before a time counted in frames, and the part of the way to the next.
fn split(at: f64, last: usize) -> (usize, f64) {
    #[expect(clippy::cast_precision_loss, reason = "frames are far fewer than 2^53")]
    let end = last as f64;
    if at <= 0.0 {
        return (0, 0.0);
    }
    if at >= end {
        return (last, 0.0);
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "it is between zero and the number of frames"
    )]
    let before = at as usize;
    (before, at - at.floor())
}

/// The shorter turn that a unit quaternion is, as axis times angle \[rad\].
fn rotation_vector(q: DQuat) -> DVec3 {
    let (v, w) = match q.w < 0.0 {
        true => (-q.xyz(), -q.w),
        false => (q.xyz(), q.w),
    };
    let sine = v.length();
    match sine < 1e-12 {
        true => v * 2.0,
        false => v * (2.0 * libm::atan2(sine, w) / sine),
    }
}

fn from_rotation_vector(v: DVec3) -> DQuat {
    let angle = v.length();
    let v = match angle < 1e-12 {
        true => v * 0.5,
        false => v * (libm::sin(0.5 * angle) / angle),
    };
    DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle))
}

/// Reads from `MOTION` to the end.
pub(super) fn read(
    words: &mut Words<'_>,
    skeleton: &Skeleton,
    options: &Options,
) -> Result<Motion, FileError> {
    let element = "the motion";
    words.expect(element, "MOTION")?;
    words.expect(element, "Frames:")?;
    let count_line = words.line();
    let stated = words.count(element)?;
    words.expect(element, "Frame")?;
    words.expect(element, "Time:")?;
    let line = words.line();
    let frame_time = words.number(element)?;
    if !(1e-9..=1e9).contains(&frame_time) {
        let problem = Problem::OutOfRange {
            quantity: "the frame time [s]",
            value: frame_time,
            requirement: "above zero, and not absurd",
        };
        return Err(FileError::on_line(line, element, problem));
    }
    let position_count = skeleton
        .bones
        .iter()
        .map(|bone| if bone.parent.is_none() { 7 } else { 4 });
    let mut motion = Motion {
        frame_time,
        position_count: position_count.sum(),
        q: Vec::new(),
    };
    let channels = skeleton.bones.iter().map(|bone| bone.channels.len()).sum();
    if channels == 0 && stated > 0 {
        let problem = Problem::Empty("no joint has channels, so that frames are empty");
        return Err(FileError::on_line(count_line, element, problem));
    }
    // Every frame has a line of its own, by which a number too many or too few is found where it is.
    let (mut row, mut found) = (Vec::with_capacity(channels), 0);
    while let Some(line) = words.take_line(&mut row) {
        found += 1;
        let element = format!("frame {found}");
        if row.len() != channels {
            let found = row.len();
            let problem = Problem::FrameLength { channels, found };
            return Err(FileError::on_line(line, element, problem));
        }
        let mut row = row.iter();
        for bone in &skeleton.bones {
            let mut position = DVec3::ZERO;
            let mut rotation = DQuat::IDENTITY;
            for (&channel, &word) in bone.channels.iter().zip(&mut row) {
                let number = words::number(word)
                    .ok_or_else(|| words::refused(line, &element, "a number", Some(word)))?;
                match channel {
                    Channel::Position(axis) => position[axis] = number * options.unit,
                    Channel::Rotation(axis) => rotation *= turn(axis, number.to_radians()),
                }
                if position.abs().max_element() > 1e100 {
                    let problem = Problem::OutOfRange {
                        quantity: "a displacement",
                        value: number,
                        requirement: "that of a body",
                    };
                    return Err(FileError::on_line(line, element, problem));
                }
            }
            if bone.parent.is_none() {
                motion.q.extend(position.to_array());
            }
            motion.q.extend(rotation.normalize().to_array());
        }
    }
    if found != stated {
        let problem = Problem::FrameCount { stated, found };
        return Err(FileError::on_line(count_line, element, problem));
    }
    Ok(motion)
}

/// `libm` makes the motion the same, bit for bit, on every machine.
fn turn(axis: DVec3, angle: f64) -> DQuat {
    let v = axis * libm::sin(0.5 * angle);
    DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle))
}
